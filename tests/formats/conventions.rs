//! Readings of others: a file of ours, written in each of their conventions, is the same readings.

use super::common::{ISOTROPIC, form, material, near, planned, product, random_pairs, says, table};
use super::{
    ALTA, ANGLES, bare, chain, chord, conventions, cuts, measurements, read, refused, try_read,
};
use gonio::brdf::Channels;
use gonio::error::count;
use gonio::geometry::{Direction, DirectionPair, Symmetry, distance};
use gonio::measurement::{Measurement, read_measurement};
use gonio::sampling::Random;
use gonio::schedule::{
    AngleUnit, Assume, Azimuth, Conventions, Pictures, Pose, Quantity, SampleSet, Sequence,
};
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Pairs above the horizon, none of them on the normal.
fn pairs() -> Vec<DirectionPair> {
    let good = |d: Direction| (0.05..0.999).contains(&d.cos_theta());
    let all = random_pairs(3).take(60);
    all.filter(|p| good(p.omega_i) && good(p.omega_o)).collect()
}

fn value(i: usize) -> f64 {
    0.01 + i as f64 * 0.37
}

/// A table as CSV, as a spreadsheet with semicolons, decimal commas, a byte-order mark and CRLF, and as lines of JSON.
fn written(columns: &[String], rows: &[Vec<f64>]) -> [String; 3] {
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let numbers = |row: &Vec<f64>| line(row.iter().map(f64::to_string).collect());
    let csv = line(columns.to_vec()) + &rows.iter().map(numbers).collect::<String>();
    let spreadsheet = csv.replace(',', ";").replace('.', ",");
    let spreadsheet = spreadsheet.replace('\n', "\r\n");
    let object = |row: &Vec<f64>| {
        let object: BTreeMap<_, _> = columns.iter().zip(row).collect();
        serde_json::to_string(&object).unwrap() + "\n"
    };
    let json = rows.iter().map(object).collect();
    [csv, format!("\u{feff}{spreadsheet}"), json]
}

/// The azimuths of light and sensor, rad, as a file in a convention has them; `is_alone`: it has no azimuth of the light.
fn azimuths(azimuth: Azimuth, pair: &DirectionPair, is_alone: bool) -> [f64; 2] {
    let [mut a, mut b] = [pair.omega_i.phi(), pair.omega_o.phi()];
    if is_alone {
        (a, b) = (0.0, b - a);
    }
    match azimuth {
        Azimuth::Sample => {}
        Azimuth::Light => b -= a,
        Azimuth::Mirror => b -= a + PI,
        // The light goes to 0, so it comes from π.
        Azimuth::Propagation if is_alone => b += PI,
        Azimuth::Propagation => a += PI,
    }
    [a, b]
}

fn assert_same(m: &Measurement, pairs: &[DirectionPair], isotropic: bool, what: &str) {
    assert_eq!(m.readings(), pairs.len(), "{what}");
    let symmetry = m.schedule.parametrization.symmetry();
    assert_eq!(symmetry.isotropic, isotropic, "{what}");
    for (i, pair) in pairs.iter().enumerate() {
        let back = &m.schedule.poses[i].pair;
        let off = match isotropic {
            true => distance(back, pair, ISOTROPIC),
            false => chord(back, pair),
        };
        near(off, 0.0, 1e-12, what);
        near(m.value(i).unwrap()[0] / value(i), 1.0, 1e-12, what);
    }
}

#[test]
fn angles_in_every_convention_are_the_same_poses() {
    let pairs = pairs();
    let mut files = 0;
    // Both azimuths, the sensor's alone, and the difference of ours, phi_i - phi_o.
    let columns = [
        "theta_i,phi_i,theta_o,phi_o",
        "theta_i,theta_o,phi_o",
        "theta_i,theta_o,delta_phi",
    ];
    let azimuths_or_none = [None]
        .into_iter()
        .chain(Azimuth::ALL.map(|a| Some(a.value)));
    let polar = product(AngleUnit::ALL, [false, true]);
    let choices = product(azimuths_or_none, product(polar, columns));
    for (azimuth, ((unit, elevation), columns)) in choices {
        let is_alone = !columns.contains("phi_i");
        let row = |(i, pair): (usize, &DirectionPair)| {
            let [a, b] = azimuths(azimuth.unwrap_or(Azimuth::Sample), pair, is_alone);
            let zenith = |d: Direction| d.theta();
            let polar = |d| {
                if elevation {
                    FRAC_PI_2 - zenith(d)
                } else {
                    zenith(d)
                }
            };
            let angle = |column| match column {
                "theta_i" => polar(pair.omega_i),
                "theta_o" => polar(pair.omega_o),
                "phi_i" => a % TAU,
                "phi_o" => b % TAU,
                _ => -b % TAU,
            };
            let in_unit = |column| match unit.value {
                AngleUnit::Degrees => angle(column).to_degrees(),
                AngleUnit::Radians => angle(column),
            };
            columns.split(',').map(in_unit).chain([value(i)]).collect()
        };
        let rows: Vec<Vec<f64>> = pairs.iter().enumerate().map(row).collect();
        // Names that say the unit, ours without it, and those of a laboratory.
        for ending in [&format!("_{}", unit.name), "", "In"] {
            let names = columns.split(',').map(|c| format!("{c}{ending}"));
            let names: Vec<String> = names.chain(["value".into()]).collect();
            let ours = columns.split(',').chain(["value"]).map(str::to_owned);
            let renamed = ours.zip(names.clone()).filter(|_| ending == "In");
            let conventions = Conventions {
                columns: renamed.collect(),
                angles: (!ending.starts_with('_')).then_some(unit.value),
                elevation,
                azimuth,
                ..Conventions::default()
            };
            for text in written(&names, &rows) {
                let what = format!("{names:?} {conventions:?} {}", &text[..9]);
                let back = try_read(&text, conventions.clone()).expect(&what);
                assert_same(&back.measurement, &pairs, is_alone, &what);
                files += 1;
            }
        }
    }
    assert_eq!(files, 5 * 2 * 2 * 3 * 3 * 3);
}

#[test]
fn values_of_every_quantity_are_the_same_readings() {
    let pairs = pairs();
    for quantity in Quantity::ALL {
        let of_one = |pair: &DirectionPair| match quantity.name {
            "brdf" => 1.0,
            "brdf-cosine" => pair.omega_o.vector().z,
            "brdf-cosine-light" => pair.omega_i.vector().z,
            "reflectance-factor" => PI,
            "percent" => 100.0 * PI,
            other => panic!("{other}"),
        };
        let words = &format!("quantity={}", quantity.name);
        let angles = |pair: &DirectionPair| {
            let (l, s) = (pair.omega_i, pair.omega_o);
            [l.theta(), l.phi(), s.theta(), s.phi()]
        };
        let row = |(i, pair): (usize, &DirectionPair)| {
            let value = value(i) * of_one(pair);
            let [a, b, c, d] = angles(pair).map(f64::to_degrees);
            vec![a, b, c, d, value, value]
        };
        let rows: Vec<Vec<f64>> = pairs.iter().enumerate().map(row).collect();
        let header = ANGLES.split(',').chain(["value", "type_a"]);
        for text in written(&header.map(str::to_owned).collect::<Vec<_>>(), &rows) {
            let m = read(&text, words).measurement;
            assert_same(&m, &pairs, false, words);
            // Uncertainties are of the same quantity.
            for (i, a) in m.details.unwrap().type_a.iter().enumerate() {
                near(a / value(i), 1.0, 1e-12, words);
            }
        }
        // An ALTA file that does not say it, or says something else.
        let row = |(i, pair): (usize, &DirectionPair)| {
            let cells = angles(pair).map(|angle| angle.to_string()).join(" ");
            format!("{cells} {}\n", value(i) * of_one(pair))
        };
        let cells: String = pairs.iter().enumerate().map(row).collect();
        for line in [
            "",
            "#PARAM_OUT UNKNOWN_OUTPUT\n",
            "#PARAM_OUT INV_STERADIAN\n",
        ] {
            let text = format!("{ALTA}{line}{cells}");
            assert_same(&read(&text, words).measurement, &pairs, false, words);
            match try_read(&text, Conventions::default()) {
                Ok(_) => assert!(line.ends_with("INV_STERADIAN\n")),
                Err(e) => says(&e.message, "--quantity with one of brdf, "),
            }
        }
    }
    // ALTA's own word for a cosine, and ours, are quantities.
    let alta = |line: &str| format!("{ALTA}{line}0.4 0.1 1.1 0.2 3\n");
    let csv = |column: &str| format!("{ANGLES},{column}\n20,0,70,0,3\n");
    let said = |word: &str| alta(&format!("#PARAM_OUT {word}\n"));
    let cosine = said("INV_STERADIAN_COSINE_FACTOR");
    for (said, given, words) in [
        (said("INV_STERADIAN"), alta(""), "quantity=brdf"),
        (cosine, alta(""), "quantity=brdf-cosine"),
        (csv("value_cos"), csv("value"), "quantity=brdf-cosine-light"),
    ] {
        let [said, given] = [read(&said, ""), read(&given, words)];
        assert_eq!(said.measurement.values, given.measurement.values);
    }
}

#[test]
fn azimuths_of_alta_are_counted_like_others() {
    let pairs = pairs();
    for (input, dimensions) in [
        ("SPHERICAL_TL_PL_TV_PV", 4),
        ("ISOTROPIC_TV_TL_DPHI", 3),
        ("ISOTROPIC_TL_TV_PROJ_DPHI", 3),
    ] {
        for azimuth in Azimuth::ALL {
            let mut text = format!("#DIM {dimensions} 1\n#PARAM_IN {input}\n");
            text += "#PARAM_OUT INV_STERADIAN\n";
            for (i, pair) in pairs.iter().enumerate() {
                let (l, s) = (pair.omega_i.theta(), pair.omega_o.theta());
                let [a, b] = azimuths(azimuth.value, pair, dimensions == 3);
                // The difference is that of light and view.
                let d = a - b;
                let x = match input {
                    "SPHERICAL_TL_PL_TV_PV" => vec![l, a, s, b],
                    "ISOTROPIC_TV_TL_DPHI" => vec![s, l, d],
                    _ => vec![l, s * d.cos(), s * d.sin()],
                };
                let x: Vec<_> = x.iter().map(f64::to_string).collect();
                text += &format!("{} {}\n", x.join(" "), value(i));
            }
            let words = format!("azimuth={}", azimuth.name);
            let back = read(&text, &words).measurement;
            assert_same(&back, &pairs, dimensions == 3, &format!("{input} {words}"));
        }
    }
}

#[test]
fn wavelengths_by_row_are_those_by_column() {
    let wide = "10,0,20,30,0.1,0.2,0.3,0.01,0.02,0.03\n40,0,50,60,0.4,0.5,0.6,0.04,0.05,0.06\n";
    let header = "value_450nm,value_550.5nm,value_1064nm,type_a_450nm,type_a_550.5nm,type_a_1064nm";
    let wide = read(&format!("{ANGLES},{header}\n{wide}"), "");
    // In any order.
    let long = "40,0,50,60,1064,0.6,0.06\n10,0,20,30,450,0.1,0.01\n10,0,20,30,1064,0.3,0.03\n\
                40,0,50,60,450,0.4,0.04\n10,0,20,-330,550.5,0.2,0.02\n40,0,50,60,550.5,0.5,0.05\n";
    for (name, columns) in [("wavelength_nm", ""), ("lambda", "wavelength_nm=lambda")] {
        let words = &format!("columns={columns}");
        let text = format!("{ANGLES},{name},value,type_a\n{long}");
        let back = read(&text, words);
        let m = &back.measurement;
        assert_eq!(m.channels, wide.measurement.channels);
        assert_eq!(back.rows, 6);
        for (pose, other) in [(0, 1), (1, 0)] {
            assert_eq!(m.value(pose), wide.measurement.value(other));
        }
        let a = &m.details.as_ref().unwrap().type_a;
        assert_eq!(a, &[0.04, 0.05, 0.06, 0.01, 0.02, 0.03]);
        let missing = text.replace("40,0,50,60,550.5,0.5,0.05\n", "");
        // That pose alone has no reading.
        let part = read(&missing, words);
        assert_eq!((part.lost, part.rows), (1, 5));
        assert_eq!(part.measurement.value(0), None);
        assert_eq!(part.measurement.value(1), wide.measurement.value(0));
    }
    // A later attempt at one wavelength replaces that one only.
    let text = format!(
        "{ANGLES},wavelength_nm,value,attempt\n10,0,20,30,450,1,1\n10,0,20,30,550,2,1\n\
         10,0,20,30,450,3,2\n"
    );
    assert_eq!(read(&text, "").measurement.values, [3.0, 2.0]);
    // Other names for each.
    let text = format!("{ANGLES},R450,R550,u450,u550,lamp\n10,0,20,30,1,2,0.1,0.2,off\n");
    let columns = "value_450nm=R450,value_550nm=R550,uncertainty_450nm=u450,uncertainty_550nm=u550";
    let back = read(&text, &format!("columns={columns}"));
    assert_eq!(back.measurement.values, [1.0, 2.0]);
    assert_eq!(back.measurement.details.unwrap().type_b, [0.1, 0.2]);
    assert_eq!(back.notes, ["ignored columns: lamp"]);
}

#[test]
fn repeats_of_a_pose_show_their_scatter() {
    // Two channels, four poses with 1 to 4 readings each, in any order of rows.
    let readings = |pose: usize, k: usize| {
        let [a, b]: [f64; 2] = Random::new(5).point((pose * 10 + k) as u64);
        [1.0 + 0.1 * a, 5.0 - 0.1 * b]
    };
    // Mean, and the sum of squares about it.
    let statistics = |pose: usize, c: usize| {
        let all = (0..=pose).map(|k| readings(pose, k)[c]);
        let mean = all.clone().sum::<f64>() / (pose + 1) as f64;
        (mean, all.map(|x| (x - mean).powi(2)).sum::<f64>())
    };
    let claimed = 0.02;
    let details = ",type_a_450nm,type_a_550nm,type_b_450nm,type_b_550nm";
    for columns in ["", details] {
        let is_claimed = !columns.is_empty();
        let row = |(pose, k): (usize, usize)| {
            let [a, b] = readings(pose, k);
            let more = format!(",{claimed},{claimed},{},0.3", 0.1 * (k + 1) as f64);
            let more = if is_claimed { &*more } else { "" };
            format!("{},0,20,{},{a},{b}{more}\n", 10 + pose, 360 * (k % 2))
        };
        let all = (0..4).flat_map(|pose| (0..=pose).map(move |k| (pose, k)));
        let rows: Vec<String> = all.map(row).collect();
        // Repeats come one after the other, or in turns.
        let turns = [0, 2, 5, 9, 1, 8, 4, 7, 3, 6].map(|i: usize| rows[i].clone());
        for rows in [rows.concat(), turns.concat()] {
            let text = format!("{ANGLES},value_450nm,value_550nm{columns}\n{rows}");
            let back = read(&text, "");
            let [note] = &back.notes[..] else {
                panic!("{:?}", back.notes)
            };
            assert!(
                note.starts_with("6 rows with a pose of another row"),
                "{note}"
            );
            let m = back.measurement;
            assert_eq!(m.values.len(), 8);
            let details = m.details.as_ref().unwrap();
            for (at, pose) in m.schedule.poses.iter().enumerate() {
                let number = (pose.pair.omega_i.theta().to_degrees() - 10.0).round() as usize;
                let n = (number + 1) as f64;
                for c in 0..2 {
                    let (mean, squares) = statistics(number, c);
                    let shown = match (number, is_claimed) {
                        (0, _) => 0.0,
                        (_, true) => (squares / (n - 1.0) / n).sqrt(),
                        // Nothing is claimed: 6 degrees of freedom together, of which t₉₅ is 2.52.
                        (_, false) => {
                            let of_pose = (1..4).map(|pose| statistics(pose, c));
                            let shares = of_pose.map(|(mean, squares)| squares / mean.powi(2));
                            1.26 * mean * (shares.sum::<f64>() / 6.0 / n).sqrt()
                        }
                    };
                    // What readings share does not average out.
                    let (own, shared) = match (is_claimed, c) {
                        (false, _) => (0.0, 0.0),
                        (true, 0) => (claimed / n.sqrt(), 0.1 * (number + 2) as f64 / 2.0),
                        (true, _) => (claimed / n.sqrt(), 0.3),
                    };
                    let what = (columns, number, c);
                    near(m.values[2 * at + c], mean, 1e-14, what);
                    near(details.type_a[2 * at + c], shown.max(own), 1e-14, what);
                    near(details.type_b[2 * at + c], shared, 1e-14, what);
                }
            }
        }
    }
    // The same through ALTA.
    let rows = "0.1 0 0.2 0 1\n0.1 0 0.2 0 2\n0.1 0 0.2 0 6\n0.3 0 0.2 0 4\n";
    let m = read(&format!("{ALTA}#PARAM_OUT INV_STERADIAN\n{rows}"), "").measurement;
    assert_eq!(m.values, [3.0, 4.0]);
    // Squares 4, 1 and 9 over 2 · 3; of 2 degrees t₉₅ is 4.53.
    let a = m.details.unwrap().type_a;
    near(a[0] / 2.265, (14.0_f64 / 6.0).sqrt(), 1e-14, "ALTA");
    assert_eq!(a[1], 0.0);
}

/// Uncertainties of a few repeats cover as often as they say: of two readings of each pose, of values that have others like them and
/// of values that stand alone; the second reading has other digits of its angles, as encoders give them.
#[test]
fn two_readings_of_a_pose_cover_the_truth() {
    let noise = 0.05;
    let mut random = Random::new(7).stream(0);
    // Steps of values, and poses in a file.
    for (step, poses, files) in [(1.02_f64, 300, 8), (9.0, 6, 400)] {
        let (mut covered, mut all) = (0, 0);
        for _ in 0..files {
            let mut text = format!("{ANGLES},value\n");
            let truth = |k: usize| 1e-3 * step.powi(k as i32);
            for k in 0..2 * poses {
                let (pose, repeat) = (k % poses, k / poses);
                let z: f64 = StandardNormal.sample(&mut random);
                let value = truth(pose) * (1.0 + noise * z);
                let theta = 10.0 + 0.2 * pose as f64 + 0.002 * repeat as f64;
                text += &format!("{theta},0,20,180.001,{value}\n");
            }
            let m = read(&text, "").measurement;
            assert_eq!(m.schedule.poses.len(), poses);
            let a = &m.details.as_ref().unwrap().type_a;
            let within = |k: &usize| (m.values[*k] - truth(*k)).abs() <= 2.0 * a[*k];
            covered += (0..poses).filter(within).count();
            all += poses;
        }
        let share = covered as f64 / all as f64;
        near(share, 0.9545, 0.015, ("within 2u of values apart by", step));
    }
    let read = |columns: &str, rows: String| {
        read(&format!("{ANGLES},value{columns}\n{rows}"), "").measurement
    };
    // A scan in steps that encoders could not repeat is one, from either end.
    let lobe = |k: i32| (-0.02 * f64::from(k * k)).exp();
    let row = |k: i32| format!("{},0,{},180,{}\n", 30, 30.0 + 0.004 * f64::from(k), lobe(k));
    for all in [(-9..10).collect::<Vec<i32>>(), (-9..10).rev().collect()] {
        let m = read("", all.into_iter().map(row).collect());
        assert_eq!(m.values.len(), 19);
        assert!(m.values.contains(&1.0) && m.details.is_none());
    }
    // What a row does not claim is as what the others do.
    let m = read(",type_a,type_b", "30,0,0,0,1,.04,.1\n30,0,0,0,1,,\n".into());
    let details = m.details.unwrap();
    assert_eq!(details.type_b, [0.1]);
    near(details.type_a[0], 0.04 / 2_f64.sqrt(), 1e-15, "type A");
    // Equal numbers, as of a column that was copied, say nothing, beside others too; nor are they written as 0.
    let row = "30,0,0,0,0.2\n";
    let m = read("", format!("{row}{row}{row}40,0,0,0,.3\n"));
    assert_eq!(m.details.as_ref().unwrap().type_a, [0.0; 2]);
    let pair = "50,0,0,0,.19\n50,0,0,0,.21\n";
    let of_pair = |row| {
        let details = read("", format!("{row}{row}{pair}")).details;
        details.unwrap().type_a.into_iter().next_back()
    };
    assert_eq!(of_pair(""), of_pair(row));
}

#[test]
fn a_cut_file_is_read_up_to_the_cut() {
    let form = crate::common::form("hybrid", Symmetry::FULL);
    let poses = planned(&form, "grid", 16, 1);
    let (m, itinerary) = measurements::measured(&poses, Channels::Rgb, true);
    let about = measurements::about(&m, &itinerary);
    let text = |format| measurements::text(&m, &about, Sequence::Generated, format);
    let mut texts = super::FORMATS.map(text).to_vec();
    // The same without a header, whose rows nothing counts.
    texts.push(bare(&texts[0]));
    for text in texts {
        let whole = read(&text, "");
        let note = format!("not cut: {} rows were read", whole.rows);
        assert_eq!(read(&text, "partial").notes, [note]);
        let lines = text.lines().count();
        let is_counted = text.starts_with(['#', '{']);
        for cut in cuts(&text) {
            let back = read(cut, "partial");
            // Every line that ends is read.
            let ended = cut.matches('\n').count();
            assert_eq!(back.rows, whole.rows - (lines - ended), "{cut}");
            // Without a count it is not known whether rows are missing.
            let is_whole = cut.ends_with('\n') && !is_counted;
            let start = if is_whole { "not cut" } else { "cut" };
            let start = format!("{start}: {} w", count(back.rows, "row"));
            let note = back.notes.last().unwrap();
            assert!(note.starts_with(&start), "{note}");
            for i in 0..back.measurement.schedule.poses.len() {
                if let Some(value) = back.measurement.value(i) {
                    assert_eq!(Some(value), whole.measurement.value(i));
                }
            }
            match try_read(cut, Conventions::default()) {
                Err(e) => assert!(e.message.ends_with("--partial reads up to the cut"), "{e}"),
                // Whether the last number is whole is not known.
                Ok(_) => assert!(whole.rows > back.rows && !is_counted),
            }
        }
    }
    let head = format!("{ALTA}#PARAM_OUT INV_STERADIAN\n");
    let alta = head + "0.1 0 0.2 0 1\n0.3 0 0.2 0 4\n";
    let cuts = [
        ("0.5 0 0.2\n", true),
        ("0.5 0 0.2", true),
        ("0.5 0 0.2 0 1", false),
        ("", false),
    ];
    for (cut, is_refused) in cuts {
        let text = format!("{alta}{cut}");
        assert_eq!(read(&text, "partial").rows, 2);
        let strict = try_read(&text, Conventions::default());
        assert_eq!(strict.is_err(), is_refused);
    }
    // What is wrong elsewhere is wrong still.
    for (from, to) in [("0.1 0 0.2 0 1", "0.1 0 0.2"), ("0.2 0 4", "0.2 0 x")] {
        let text = alta.replace(from, to);
        assert!(try_read(&text, conventions("partial")).is_err());
        let e = try_read(&text, Conventions::default()).err().unwrap();
        assert!(!e.message.contains("--partial"), "{e}");
    }
}

#[test]
fn what_cannot_be_meant_is_refused_in_a_sentence() {
    for [text, options, part] in table(
        r#"
        FOUR,value\n1,2,3,4,5 | columns=theta_i=thetaIn | --columns theta_i=thetaIn: there is no such column; allowed: theta_i_deg, phi_i_deg
        a,b,c,d,e\n1,2,3,4,5 | columns=theta_i_deg=a,tetha_o_deg=b | column "tetha_o_deg" is not known; allowed: index, theta_i_deg
        a,b,c,d,e\n1,2,3,4,5 | columns=theta_i_deg=a,theta_i_rad=b | --columns theta_i_rad=b: one of them is named before
        a,b,c,d,e\n1,2,3,4,5 | columns=theta_i=a | column "a" does not say its unit; allowed: a name that ends in _deg or _rad, or --angles with one of deg, rad
        theta_i,theta_o_deg,phi_o_deg,value\n1,2,3,4 |  | column "theta_i" does not say its unit
        a,b,c,v\n1,2,3,5 | columns=theta_i_deg=a,theta_o_deg=b,value=v | column phi_o_deg is missing; needed are theta_i_deg
        a,b,c,v\n1,2,3,5 | columns=theta_i_deg=a,theta_o_deg=b,phi_o_deg=c | under another name: --columns value=NAME
        theta_i_rad,theta_o_rad,phi_o_rad,value\n1,1.6,3,4 |  | theta_o_rad = 1.6: allowed is a number in (-pi/2, pi/2): above the horizon
        a,theta_o_rad,phi_o_rad,value\n1,1.5,7,4 | columns=theta_i_rad=a | phi_o_rad = 7: allowed is a number in [-2 pi, 2 pi]
        FOUR,value\n1,2,-1,4,5 | elevation | theta_o_deg = -1: allowed is a number in (0, 180): above the horizon
        FOUR,value_cos\n1,2,0,4,5 | quantity=percent | columns value_cos… say what they are
        FOUR,value_r,value_g,value_b,wavelength_nm\n1,2,0,4,5,6,7,550 |  | column wavelength_nm goes with one column of values
        FOUR,value,wavelength_nm\n1,2,0,4,5,0.55 |  | wavelength_nm = 0.55 cannot be
        FOUR,value,wavelength_nm\n1,2,0,4,5, |  | no row has all of its angles and a wavelength
        FOUR,temperature,value\n1,2,0,4,21,5 |  | with --columns, which says their names in the file, others are passed over
        FOUR,value\n10,0,20,180,1\n10,0,30,180,inf |  | m.csv:3: value = inf: allowed is a finite number
        FOUR,value,attempt\n10,0,20,180,1,1\n10,0,90,180,1,1 |  | m.csv:3: theta_o_deg = 9
        FOUR,value\n10,0,20,180,1\n10,0,91,180,0\n10,0,92,180,0 |  | m.csv:3: theta_o_deg = 9
        {"theta_i_deg":1,"theta_o_deg":90,"phi_o_deg":0,"value":1} |  | there is no row above the horizon
        FOUR,value_450nm,value_550nm,value_450.0nm\n10,0,20,180,1,2,3 |  | m.csv:1: columns value_450nm and value_450.0nm are of one wavelength; allowed: one column for each
        theta_i_deg,theta_o_deg,value\n30,50,1\n30,20,2 |  | m.csv:1: column phi_o_deg is missing
        FOUR,value\n1,2,0,4,1e-3\n1,2,0,4 |  | 4 cells where there are 5 columns; --partial reads up to the cut
        ALTA | columns=value=x | --columns: the header of an ALTA file says what its columns are
        ALTA | azimuth=mirror | --azimuth: #PARAM_IN RUSIN_TH_TD has no azimuths of its own"#,
    ) {
        let alta = "#DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 0.3";
        let text = text.replace("FOUR", ANGLES);
        let text = text.replace("ALTA", alta) + "\n";
        let e = try_read(&text, conventions(options)).err().expect(part);
        says(&chain(&e), part);
    }
}

#[test]
fn pixels_of_a_stop_become_few_readings() {
    let (stops, of_each, nodes) = (3, 4000, 60);
    let set = Pictures {
        nodes: of_each,
        most: stops * of_each,
        ..Pictures::default()
    };
    let form = form("half-difference", Symmetry::FULL);
    let poses = set.plan(&form, stops * of_each, 1).unwrap().poses;
    assert_eq!(poses.len(), stops * of_each);
    let truth = material("ggx", "alpha = 0.2", Channels::Luminance);
    let row = |(i, pose): (usize, &Pose)| {
        let of = |d: Direction| format!("{},{}", d.theta().to_degrees(), d.phi().to_degrees());
        let angles = [pose.pair.omega_i, pose.pair.omega_o].map(of).join(",");
        format!(
            "{},{angles},{}\n",
            i / of_each,
            truth.luminance(&pose.pair).unwrap()
        )
    };
    let head = "stop,theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n".to_owned();
    let mut rows: Vec<String> = poses.iter().enumerate().map(row).collect();
    let words = format!("pixels={nodes}");
    let symmetric = |text: &str| {
        let assume = Assume {
            symmetry: Some(Symmetry::FULL),
            conventions: conventions(&words),
            ..Assume::default()
        };
        read_measurement(text, "m.csv", &assume).unwrap()
    };
    let all = symmetric(&(head.clone() + &rows.concat()));
    let m = &all.measurement;
    assert_eq!(m.readings(), stops * nodes);
    says(
        &all.notes.join(" "),
        "12000 pixels of 3 stops: 180 readings, means over patches of",
    );
    let off = |(i, pose): (usize, &Pose)| {
        (m.value(i).unwrap()[0] / truth.luminance(&pose.pair).unwrap() - 1.0).abs()
    };
    let poses = m.schedule.poses.iter().enumerate();
    let worst = poses.map(off).fold(0.0, f64::max);
    assert!(worst < 0.01, "{worst}");
    // Whatever the order of the rows.
    rows.reverse();
    let again = symmetric(&(head + &rows.concat())).measurement;
    let sorted = |m: &Measurement| {
        let mut all: Vec<u64> = m.values.iter().map(|f| f.to_bits()).collect();
        all.sort_unstable();
        all
    };
    assert!(sorted(&again) == sorted(m));
    let without = "theta_i,theta_o,phi_o,value\n10,20,30,1\n";
    refused(
        try_read(without, conventions(&words)),
        "1",
        "--pixels … no column stop",
    );
}
