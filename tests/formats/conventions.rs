//! Readings of others: a file of ours, written in each of their conventions, is the same readings.

use super::common::{ISOTROPIC, model, random_pair, says, table};
use super::{chain, chord, cuts, measurements, planned, told, try_read};
use gonio::brdf::{self, Brdf, Channels};
use gonio::error::count;
use gonio::formats::Readings;
use gonio::geometry::{DirectionPair, Symmetry, distance};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::{About, Measurement, retro_peak, write_measurement};
use gonio::parametrization::{self, Parametrization};
use gonio::registry;
use gonio::sampling::Random;
use gonio::schedule::{AngleUnit, Azimuth, Conventions, Pose, Quantity, UncertaintyUnit};
use gonio::schedule::{Schedule, ScheduleFormat, Sequence};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;
use std::sync::Arc;

fn read(text: &str, conventions: Conventions) -> Readings {
    try_read(text, conventions).unwrap_or_else(|e| panic!("{}\n{text}", chain(&e)))
}

/// Pairs above the horizon, none of them on the normal.
fn pairs() -> Vec<DirectionPair> {
    let random = Random::new(3);
    let good = |d: f64| (0.05..0.999).contains(&d);
    (0..60)
        .map(|i| random_pair(&random, i))
        .filter(|p| good(p.omega_i.cos_theta()) && good(p.omega_o.cos_theta()))
        .collect()
}

fn value(i: usize) -> f64 {
    0.01 + i as f64 * 0.37
}

/// How a table is written.
#[derive(Clone, Copy, Debug)]
enum Text {
    Csv,
    /// Semicolons, decimal commas, a byte-order mark and CRLF.
    Spreadsheet,
    JsonLines,
}

fn written(columns: &[&str], rows: &[Vec<f64>], text: Text) -> String {
    let cells = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>();
    let mut out = String::new();
    match text {
        Text::Csv => {
            out += &(columns.join(",") + "\n");
            rows.iter()
                .for_each(|r| out += &(cells(r).join(",") + "\n"));
        }
        Text::Spreadsheet => {
            out += &format!("\u{feff}{}\r\n", columns.join(";"));
            let row = |r| cells(r).join(";").replace('.', ",") + "\r\n";
            rows.iter().for_each(|r| out += &row(r));
        }
        Text::JsonLines => {
            for row in rows {
                let object = columns
                    .iter()
                    .map(|c| c.to_string())
                    .zip(row.iter().copied());
                let object: std::collections::BTreeMap<String, f64> = object.collect();
                out += &(serde_json::to_string(&object).unwrap() + "\n");
            }
        }
    }
    out
}

/// An angle within a turn either way.
fn wrapped(degrees: f64) -> f64 {
    degrees % 360.0
}

fn assert_same(m: &Measurement, pairs: &[DirectionPair], isotropic: bool, what: &str) {
    assert_eq!(m.readings(), pairs.len(), "{what}");
    for (i, pair) in pairs.iter().enumerate() {
        let back = &m.schedule.poses[i].pair;
        let off = match isotropic {
            true => distance(back, pair, ISOTROPIC),
            false => chord(back, pair),
        };
        assert!(off < 1e-12, "{what}: {off:e}");
        let found = m.value(i).unwrap()[0];
        assert!((found / value(i) - 1.0).abs() < 1e-12, "{what}: {found}");
    }
}

#[test]
fn angles_in_every_convention_are_the_same_poses() {
    let pairs = pairs();
    let mut told = 0;
    for unit in AngleUnit::ALL {
        for elevation in [false, true] {
            for azimuth in [None]
                .into_iter()
                .chain(Azimuth::ALL.map(|a| Some(a.value)))
            {
                // Both azimuths, the sensor's alone, and the difference of ours, phi_i - phi_o.
                for (columns, which) in [
                    ("theta_i,phi_i,theta_o,phi_o", 0),
                    ("theta_i,theta_o,phi_o", 1),
                    ("theta_i,theta_o,delta_phi", 2),
                ] {
                    let row = |(i, pair): (usize, &DirectionPair)| {
                        let polar = |theta: f64| match elevation {
                            true => 90.0 - theta.to_degrees(),
                            false => theta.to_degrees(),
                        };
                        let (l, s) = (pair.omega_i, pair.omega_o);
                        let [mut a, mut b] = [l.phi().to_degrees(), s.phi().to_degrees()];
                        if which > 0 {
                            (a, b) = (0.0, b - a);
                        }
                        match azimuth {
                            None | Some(Azimuth::Sample) => {}
                            Some(Azimuth::Light) => b -= a,
                            Some(Azimuth::Mirror) => b -= a + 180.0,
                            Some(Azimuth::Propagation) if which == 0 => a += 180.0,
                            // The light goes to 0, so it comes from 180°.
                            Some(Azimuth::Propagation) => b += 180.0,
                        }
                        let [a, b] = [a, b].map(wrapped);
                        let angles = match which {
                            0 => vec![polar(l.theta()), a, polar(s.theta()), b],
                            1 => vec![polar(l.theta()), polar(s.theta()), b],
                            _ => vec![polar(l.theta()), polar(s.theta()), -b],
                        };
                        let in_unit = angles.iter().map(|a| match unit.value {
                            AngleUnit::Degrees => *a,
                            AngleUnit::Radians => a.to_radians(),
                        });
                        in_unit.chain([value(i)]).collect::<Vec<_>>()
                    };
                    let rows: Vec<Vec<f64>> = pairs.iter().enumerate().map(row).collect();
                    let ours: Vec<&str> = columns.split(',').chain(["value"]).collect();
                    let suffixed = |ending: &str| -> Vec<String> {
                        let of =
                            |c: &&str| format!("{c}{}", if *c == "value" { "" } else { ending });
                        ours.iter().map(of).collect()
                    };
                    let unit_said = suffixed(&format!("_{}", unit.name));
                    let theirs = suffixed("In");
                    let map = |from: &[String]| {
                        let pairs = ours.iter().zip(from);
                        pairs
                            .map(|(a, b)| (a.to_string(), b.clone()))
                            .collect::<Vec<_>>()
                    };
                    for (header, columns, angles) in [
                        (unit_said.clone(), vec![], None),
                        (suffixed(""), vec![], Some(unit.value)),
                        (theirs.clone(), map(&theirs), Some(unit.value)),
                    ] {
                        for text in [Text::Csv, Text::Spreadsheet, Text::JsonLines] {
                            let header: Vec<&str> = header.iter().map(String::as_str).collect();
                            let conventions = Conventions {
                                columns: columns.clone(),
                                angles,
                                elevation,
                                azimuth,
                                ..Conventions::default()
                            };
                            let what = format!("{header:?} {conventions:?} {text:?}");
                            let back = read(&written(&header, &rows, text), conventions);
                            let isotropic = back
                                .measurement
                                .schedule
                                .parametrization
                                .symmetry()
                                .isotropic;
                            assert_eq!(isotropic, which > 0, "{what}");
                            assert_same(&back.measurement, &pairs, isotropic, &what);
                            told += 1;
                        }
                    }
                }
            }
        }
    }
    assert_eq!(told, 2 * 2 * 5 * 3 * 3 * 3);
}

#[test]
fn values_of_every_quantity_are_the_same_readings() {
    let pairs = pairs();
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    for quantity in Quantity::ALL {
        let of_one = |pair: &DirectionPair| match quantity.name {
            "brdf" => 1.0,
            "brdf-cosine" => pair.omega_o.vector().z,
            "brdf-cosine-light" => pair.omega_i.vector().z,
            "reflectance-factor" => PI,
            "percent" => 100.0 * PI,
            other => panic!("{other}"),
        };
        let conventions = || told(&format!("quantity={}", quantity.name));
        let rows = |degrees: bool, more: usize| -> Vec<Vec<f64>> {
            let row = |(i, pair): (usize, &DirectionPair)| {
                let (l, s) = (pair.omega_i, pair.omega_o);
                let angles = [l.theta(), l.phi(), s.theta(), s.phi()];
                let angles = angles.map(|a| if degrees { a.to_degrees() } else { a });
                let mut row = angles.to_vec();
                row.extend(std::iter::repeat_n(value(i) * of_one(pair), 1 + more));
                row
            };
            pairs.iter().enumerate().map(row).collect()
        };
        let header: Vec<&str> = angles.split(',').chain(["value", "type_a"]).collect();
        for text in [Text::Csv, Text::Spreadsheet, Text::JsonLines] {
            let back = read(&written(&header, &rows(true, 1), text), conventions());
            assert_same(&back.measurement, &pairs, false, quantity.name);
            // Uncertainties are of the same quantity.
            let details = back.measurement.details.unwrap();
            for (i, a) in details.type_a.iter().enumerate() {
                assert!((a / value(i) - 1.0).abs() < 1e-12, "{}", quantity.name);
            }
        }
        // An ALTA file that does not say it, or says something else.
        let cells = rows(false, 0).into_iter().map(|row| {
            let cells: Vec<_> = row.iter().map(f64::to_string).collect();
            cells.join(" ") + "\n"
        });
        let cells: String = cells.collect();
        for line in [
            "",
            "#PARAM_OUT UNKNOWN_OUTPUT\n",
            "#PARAM_OUT INV_STERADIAN\n",
        ] {
            let text = format!("#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n{line}{cells}");
            let back = read(&text, conventions());
            assert_same(&back.measurement, &pairs, false, quantity.name);
            let unsaid = try_read(&text, Conventions::default());
            match line.ends_with("INV_STERADIAN\n") {
                true => assert!(unsaid.is_ok()),
                false => {
                    let message = unsaid.err().unwrap().message;
                    assert!(
                        message.contains("--quantity with one of brdf, "),
                        "{message}"
                    );
                }
            }
        }
    }
    // ALTA's own word for a cosine, and ours, are quantities.
    for (word, quantity) in [
        ("INV_STERADIAN", Quantity::Brdf),
        ("INV_STERADIAN_COSINE_FACTOR", Quantity::BrdfCosine),
    ] {
        let text = |line: &str| {
            format!("#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n{line}0.4 0.1 1.1 0.2 3\n")
        };
        let said = read(
            &text(&format!("#PARAM_OUT {word}\n")),
            Conventions::default(),
        );
        let given = Conventions {
            quantity: Some(quantity),
            ..Conventions::default()
        };
        let given = read(&text(""), given);
        assert_eq!(said.measurement.values, given.measurement.values);
    }
    let cos = read(
        &format!("{angles},value_cos\n20,0,70,0,3\n"),
        Conventions::default(),
    );
    let light = told("quantity=brdf-cosine-light");
    let given = read(&format!("{angles},value\n20,0,70,0,3\n"), light);
    assert_eq!(cos.measurement.values, given.measurement.values);
}

#[test]
fn azimuths_of_alta_are_counted_like_others() {
    let pairs = pairs();
    for (input, which) in [
        ("SPHERICAL_TL_PL_TV_PV", 0),
        ("ISOTROPIC_TV_TL_DPHI", 1),
        ("ISOTROPIC_TL_TV_PROJ_DPHI", 2),
    ] {
        for azimuth in Azimuth::ALL {
            let mut text = format!("#DIM {} 1\n#PARAM_IN {input}\n", 4 - usize::from(which > 0));
            text += "#PARAM_OUT INV_STERADIAN\n";
            for (i, pair) in pairs.iter().enumerate() {
                let (l, s) = (pair.omega_i, pair.omega_o);
                let (mut a, mut b) = (l.phi(), s.phi());
                if which > 0 {
                    (a, b) = (0.0, b - a);
                }
                match azimuth.name {
                    "sample" => {}
                    "light" => b -= a,
                    "mirror" => b -= a + PI,
                    _ => a += PI,
                }
                // The difference is that of light and view.
                let d = a - b;
                let x = match which {
                    0 => vec![l.theta(), a, s.theta(), b],
                    1 => vec![s.theta(), l.theta(), d],
                    _ => vec![l.theta(), s.theta() * d.cos(), s.theta() * d.sin()],
                };
                let x: Vec<_> = x.iter().map(f64::to_string).collect();
                text += &format!("{} {}\n", x.join(" "), value(i));
            }
            let conventions = told(&format!("azimuth={}", azimuth.name));
            let back = read(&text, conventions);
            let what = format!("{input} {}", azimuth.name);
            assert_same(&back.measurement, &pairs, which > 0, &what);
        }
    }
}

#[test]
fn wavelengths_by_row_are_those_by_column() {
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    let wide = "10,0,20,30,0.1,0.2,0.3,0.01,0.02,0.03\n40,0,50,60,0.4,0.5,0.6,0.04,0.05,0.06\n";
    let header = "value_450nm,value_550.5nm,value_1064nm,type_a_450nm,type_a_550.5nm,type_a_1064nm";
    let wide = read(
        &format!("{angles},{header}\n{wide}"),
        Conventions::default(),
    );
    // In any order.
    let long = "40,0,50,60,1064,0.6,0.06\n10,0,20,30,450,0.1,0.01\n10,0,20,30,1064,0.3,0.03\n\
                40,0,50,60,450,0.4,0.04\n10,0,20,-330,550.5,0.2,0.02\n40,0,50,60,550.5,0.5,0.05\n";
    for (name, columns) in [("wavelength_nm", ""), ("lambda", "wavelength_nm=lambda")] {
        let conventions = || told(&format!("columns={columns}"));
        let text = format!("{angles},{name},value,type_a\n{long}");
        let back = read(&text, conventions());
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
        let part = read(&missing, conventions());
        assert_eq!((part.lost, part.rows), (1, 5));
        assert_eq!(part.measurement.value(0), None);
        assert_eq!(part.measurement.value(1), wide.measurement.value(0));
    }
    // A later attempt at one wavelength replaces that one only.
    let text = format!(
        "{angles},wavelength_nm,value,attempt\n10,0,20,30,450,1,1\n10,0,20,30,550,2,1\n\
         10,0,20,30,450,3,2\n"
    );
    assert_eq!(
        read(&text, Conventions::default()).measurement.values,
        [3.0, 2.0]
    );
    // Other names for each.
    let text = format!("{angles},R450,R550,u450,u550,lamp\n10,0,20,30,1,2,0.1,0.2,off\n");
    let columns = "value_450nm=R450,value_550nm=R550,uncertainty_450nm=u450,uncertainty_550nm=u550";
    let conventions = told(&format!("columns={columns}"));
    let back = read(&text, conventions);
    assert_eq!(back.measurement.values, [1.0, 2.0]);
    assert_eq!(back.measurement.details.unwrap().type_b, [0.1, 0.2]);
    assert_eq!(back.notes, ["columns that were passed over: lamp"]);
}

#[test]
fn repeats_of_a_pose_show_their_scatter() {
    // Two channels, four poses with 1 to 4 readings each, in any order of rows.
    let readings = |pose: usize, k: usize| {
        let [a, b]: [f64; 2] = Random::new(5).point((pose * 10 + k) as u64);
        [1.0 + 0.1 * a, 5.0 - 0.1 * b]
    };
    let claimed = 0.02;
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    for (columns, own) in [
        ("value_450nm,value_550nm", 0.0),
        (
            "value_450nm,value_550nm,type_a_450nm,type_a_550nm,type_b_450nm,type_b_550nm",
            claimed,
        ),
    ] {
        let mut rows = Vec::new();
        for pose in 0..4 {
            for k in 0..=pose {
                let [a, b] = readings(pose, k);
                let angles = format!("{},0,20,{}", 10 + pose, 360 * (k % 2));
                let more = if own > 0.0 {
                    format!(",{own},{own},{},{}", 0.1 * (k + 1) as f64, 0.3)
                } else {
                    String::new()
                };
                rows.push(format!("{angles},{a},{b}{more}"));
            }
        }
        // Repeats come one after the other, or in turns.
        let turns: Vec<String> = [0, 2, 5, 9, 1, 8, 4, 7, 3, 6]
            .map(|i| rows[i].clone())
            .to_vec();
        let mut first = None;
        for rows in [rows, turns] {
            let text = format!("{angles},{columns}\n{}\n", rows.join("\n"));
            let back = read(&text, Conventions::default());
            assert_eq!(back.notes.len(), 1);
            assert!(
                back.notes[0].starts_with("6 rows with a pose of another row"),
                "{:?}",
                back.notes
            );
            let m = back.measurement;
            let details = m.details.as_ref().unwrap();
            for (at, pose) in m.schedule.poses.iter().enumerate() {
                let number = (pose.pair.omega_i.theta().to_degrees() - 10.0).round() as usize;
                let n = (number + 1) as f64;
                for c in 0..2 {
                    let of_pose = |number: usize| {
                        let all = (0..=number).map(|k| readings(number, k)[c]);
                        let mean = all.clone().sum::<f64>() / (number + 1) as f64;
                        (mean, all.map(|x| (x - mean).powi(2)).sum::<f64>())
                    };
                    let (mean, squares) = of_pose(number);
                    let shown = match (number, own > 0.0) {
                        (0, _) => 0.0,
                        (_, true) => (squares / (n - 1.0) / n).sqrt(),
                        // Nothing is claimed: 6 degrees of freedom together, of which t₉₅ is 2.52.
                        (_, false) => {
                            let shares = (1..4).map(|p| of_pose(p).1 / of_pose(p).0.powi(2));
                            1.26 * mean * (shares.sum::<f64>() / 6.0 / n).sqrt()
                        }
                    };
                    let claims = own / n.sqrt();
                    let of = |list: &[f64]| list[2 * at + c];
                    assert!((of(&m.values) - mean).abs() < 1e-14);
                    assert!((of(&details.type_a) - shown.max(claims)).abs() < 1e-14);
                    // What readings share does not average out.
                    let shared = match (own > 0.0, c) {
                        (false, _) => 0.0,
                        (true, 0) => 0.1 * (number + 2) as f64 / 2.0,
                        (true, _) => 0.3,
                    };
                    assert!((of(&details.type_b) - shared).abs() < 1e-14);
                }
            }
            let mut values = m.values.clone();
            values.sort_by(f64::total_cmp);
            let same = |a: &Vec<f64>| a.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-14);
            assert!(first.get_or_insert(values.clone()).len() == 8);
            assert!(first.as_ref().is_some_and(same));
        }
    }
    // The same through ALTA.
    let text = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n\
                0.1 0 0.2 0 1\n0.1 0 0.2 0 2\n0.1 0 0.2 0 6\n0.3 0 0.2 0 4\n";
    let m = read(text, Conventions::default()).measurement;
    assert_eq!(m.values, [3.0, 4.0]);
    let a = m.details.unwrap().type_a;
    // Squares 4, 1 and 9 over 2 · 3; of 2 degrees t₉₅ is 4.53.
    assert!(
        (a[0] / 2.265 - (14.0_f64 / 6.0).sqrt()).abs() < 1e-14 && a[1] == 0.0,
        "{a:?}"
    );
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
            let mut text = String::from("theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n");
            let truth = |k: usize| 1e-3 * step.powi(k as i32);
            for k in 0..2 * poses {
                let (pose, repeat) = (k % poses, k / poses);
                let z: f64 = StandardNormal.sample(&mut random);
                let value = truth(pose) * (1.0 + noise * z);
                let theta = 10.0 + 0.2 * pose as f64 + 0.002 * repeat as f64;
                text += &format!("{theta},0,20,180.001,{value}\n");
            }
            let m = read(&text, Conventions::default()).measurement;
            assert_eq!(m.schedule.poses.len(), poses);
            let a = &m.details.as_ref().unwrap().type_a;
            let within = |k: &usize| (m.values[*k] - truth(*k)).abs() <= 2.0 * a[*k];
            covered += (0..poses).filter(within).count();
            all += poses;
        }
        let share = covered as f64 / all as f64;
        println!("values {step} apart: {share:.3} of {all} within 2u");
        assert!((share - 0.9545).abs() < 0.015, "{share}");
    }
    let read = |text: String| read(&text, Conventions::default()).measurement;
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value";
    // A scan in steps that encoders could not repeat is one, from either end.
    let lobe = |k: i32| (-0.02 * f64::from(k * k)).exp();
    let row = |k: i32| format!("{},0,{},180,{}\n", 30, 30.0 + 0.004 * f64::from(k), lobe(k));
    for all in [(-9..10).collect::<Vec<i32>>(), (-9..10).rev().collect()] {
        let m = read(format!(
            "{head}\n{}",
            all.into_iter().map(row).collect::<String>()
        ));
        assert_eq!(m.values.len(), 19);
        assert!(m.values.contains(&1.0) && m.details.is_none());
    }
    // What a row does not claim is as what the others do.
    let m = read(format!(
        "{head},type_a,type_b\n30,0,0,0,1,.04,.1\n30,0,0,0,1,,\n"
    ));
    let details = m.details.unwrap();
    assert_eq!(details.type_b, [0.1]);
    assert!((details.type_a[0] - 0.04 / 2_f64.sqrt()).abs() < 1e-15);
    // Equal numbers, as of a column that was copied, say nothing, beside others too; nor are they written as 0.
    let row = "30,0,0,0,0.2\n";
    let m = read(format!("{head}\n{row}{row}{row}40,0,0,0,.3\n"));
    assert_eq!(m.details.as_ref().unwrap().type_a, [0.0; 2]);
    let pair = "50,0,0,0,.19\n50,0,0,0,.21\n";
    let of_pair = |text: String| read(text).details.unwrap().type_a.into_iter().last();
    let [alone, beside] = ["", row].map(|row| of_pair(format!("{head}\n{row}{row}{pair}")));
    assert_eq!(alone, beside);
}

#[test]
fn a_cut_file_is_read_up_to_the_cut() {
    let form = crate::common::form("hybrid", Symmetry::FULL);
    let (m, itinerary) = measurements::measured(planned(&form, "grid", 60), Channels::Rgb, true);
    let about = measurements::about(&m, &itinerary);
    let partial = || told("partial");
    let mut texts: Vec<String> = super::FORMATS
        .map(|format| measurements::text(&m, &about, Sequence::Generated, format))
        .to_vec();
    // The same without a header, whose rows nobody counted.
    let bare = texts[0].lines().filter(|l| !l.starts_with('#'));
    texts.push(bare.map(|l| l.to_owned() + "\n").collect());
    for text in texts {
        let whole = read(&text, Conventions::default());
        let note = format!("not cut: {} rows were read", whole.rows);
        assert_eq!(read(&text, partial()).notes, [note]);
        let lines = text.lines().count();
        for cut in cuts(&text) {
            let back = read(cut, partial());
            // Every line that ends is read.
            let ended = cut.matches('\n').count();
            assert_eq!(back.rows, whole.rows - (lines - ended), "{cut}");
            // Whether rows are missing that nobody counted is not known.
            let seems_whole = cut.ends_with('\n') && !text.starts_with(['#', '{']);
            let start = if seems_whole { "not cut" } else { "cut" };
            let note = back.notes.last().unwrap();
            assert!(
                note.starts_with(&format!("{start}: {} w", count(back.rows, "row"))),
                "{note}"
            );
            for i in 0..back.measurement.schedule.poses.len() {
                if let Some(value) = back.measurement.value(i) {
                    assert_eq!(Some(value), whole.measurement.value(i));
                }
            }
            match try_read(cut, Conventions::default()) {
                Err(e) => assert!(e.message.ends_with("--partial reads up to the cut"), "{e}"),
                // Nobody can tell whether the last number is whole.
                Ok(_) => assert!(whole.rows > back.rows && !text.starts_with(['#', '{'])),
            }
        }
    }
    let alta = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n\
                0.1 0 0.2 0 1\n0.3 0 0.2 0 4\n";
    for (cut, rows) in [
        ("0.5 0 0.2\n", 2),
        ("0.5 0 0.2", 2),
        ("0.5 0 0.2 0 1", 2),
        ("", 2),
    ] {
        let text = format!("{alta}{cut}");
        assert_eq!(read(&text, partial()).rows, rows);
        let strict = try_read(&text, Conventions::default());
        assert_eq!(
            strict.is_err(),
            cut.starts_with("0.5") && !cut.ends_with('1')
        );
    }
    // What is wrong elsewhere is wrong still.
    for text in [
        alta.replace("0.1 0 0.2 0 1", "0.1 0 0.2"),
        alta.replace("0.2 0 4", "0.2 0 x"),
    ] {
        assert!(try_read(&text, partial()).is_err());
        let e = try_read(&text, Conventions::default()).err().unwrap();
        assert!(!e.message.contains("--partial"), "{e}");
    }
}

/// Sheets of constant incidence.
fn sheets(form: &Arc<dyn Parametrization>, elevations: &[f64], step: usize) -> Arc<Schedule> {
    let mut poses = Vec::new();
    for &theta_i in elevations {
        for theta_o in (2..90).step_by(step) {
            for phi in (0..360).step_by(2 * step) {
                let [a, b, c] = [theta_i, theta_o as f64, phi as f64].map(f64::to_radians);
                let pair = DirectionPair::from_spherical(a, 0.0, b, c);
                let coords = form.forward(&pair);
                poses.push(Pose { coords, pair });
            }
        }
    }
    Arc::new(Schedule {
        parametrization: Arc::clone(form),
        sample_set: "file".into(),
        poses,
        lattice: None,
        unphysical_share: 0.0,
        assumes: None,
    })
}

#[test]
fn only_a_single_peak_at_the_light_is_doubted() {
    let form = crate::common::form("spherical", Symmetry::NONE);
    let halves = parametrization::find("half-difference").unwrap();
    let halves = halves.form(Symmetry::NONE);
    let layouts = [
        sheets(&form, &[15.0, 30.0, 60.0], 4),
        sheets(&form, &[0.0, 20.0, 40.0, 60.0, 80.0], 10),
        Arc::new(planned(&form, "sobol", 20_000)),
        Arc::new(planned(&halves, "grid", 2000)),
    ];
    let mut doubted = 0;
    for layout in &layouts {
        let peak = |brdf: &dyn Brdf| retro_peak(&Ideal.measure(brdf, layout));
        for entry in brdf::all() {
            for example in entry.examples {
                let Ok(spec) = registry::read_text(&entry, example) else {
                    panic!("{} {example}", entry.kind);
                };
                // Tables of files are not there.
                let Ok(brdf) = spec.build(Channels::Luminance) else {
                    continue;
                };
                let found = peak(&*brdf);
                assert!(
                    found.is_none() || entry.kind == "retro-reflective",
                    "{} {example}: {found:?}",
                    entry.kind
                );
                doubted += usize::from(found.is_some());
            }
        }
        let retro = |of: &str| format!("of = {{ {of} }}");
        for of in [
            "kind = \"ggx\", alpha = 0.1",
            "kind = \"ggx\", alpha = 0.3",
            "kind = \"phong\"",
        ] {
            let found = peak(&*model("retro-reflective", &retro(of))).unwrap_or_else(|| {
                panic!("{of}: a lobe turned to the light is seen");
            });
            assert!(found.retro >= 3.0 * found.mirror);
        }
        // A rough lobe has no peak that is so near.
        let rough = "kind = \"ggx\", alpha = 0.6, fresnel = { kind = \"none\" }";
        let found = peak(&*model("retro-reflective", &retro(rough)));
        assert!(
            found.is_some_and(|f| f.retro >= 1.5 * f.mirror),
            "{found:?}"
        );
        // Both peaks, of any weights; a matte one with a lobe at the light.
        for (mirror, back) in [(1.0, 1.0), (0.1, 0.9), (0.5, 0.5)] {
            let both = format!(
                "component = [{{ weight = {back}, brdf = {{ kind = \"retro-reflective\", \
                 of = {{ kind = \"ggx\", alpha = 0.2 }} }} }}, \
                 {{ weight = {mirror}, brdf = {{ kind = \"ggx\", alpha = 0.1 }} }}]"
            );
            let found = peak(&*model("sum", &both));
            assert!(found.is_none(), "{mirror} {back}: {found:?}");
        }
    }
    assert!(doubted >= layouts.len(), "{doubted}");
    // A file whose azimuths were turned says so; one that was told does not, nor ours.
    let m = Ideal.measure(
        &*model("retro-reflective", "of = { kind = \"ggx\", alpha = 0.2 }"),
        &layouts[0],
    );
    let mut bytes = Vec::new();
    let about = About::default();
    write_measurement(
        &m,
        &about,
        Sequence::Generated,
        ScheduleFormat::Csv,
        &mut bytes,
    )
    .unwrap();
    let ours = String::from_utf8(bytes).unwrap();
    let bare: String = ours
        .lines()
        .filter(|l| !l.starts_with('#'))
        .map(|l| l.to_owned() + "\n")
        .collect();
    assert!(read(&ours, Conventions::default()).warnings.is_empty());
    let warnings = read(&bare, Conventions::default()).warnings;
    assert_eq!(warnings.len(), 1);
    let peak = retro_peak(&m).unwrap();
    for part in [
        format!("{:.3e} 1/sr", peak.retro),
        "--azimuth mirror".into(),
        "if ".into(),
    ] {
        assert!(warnings[0].contains(&part), "{}", warnings[0]);
    }
    for azimuth in Azimuth::ALL {
        let told = told(&format!("azimuth={}", azimuth.name));
        let back = read(&bare, told);
        assert!(back.warnings.is_empty());
        // Turned, the peak is at the mirror direction.
        let turned = matches!(azimuth.name, "mirror" | "propagation");
        assert_eq!(retro_peak(&back.measurement).is_none(), turned);
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
        FOUR,value\n1,2,0,4,1e-3\n1,2,0,4 |  | 4 cells where there are 5 columns; --partial reads up to the cut
        ALTA | columns=value=x | --columns: the header of an ALTA file says what its columns are
        ALTA | azimuth=mirror | --azimuth: #PARAM_IN RUSIN_TH_TD has no azimuths of its own"#,
    ) {
        let alta = "#DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 0.3";
        let text = text.replace("FOUR", "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg");
        let text = text.replace("ALTA", alta) + "\n";
        let e = try_read(&text, told(options)).err().expect(part);
        says(&chain(&e), part);
    }
}

#[test]
fn elevations_and_percents_that_nothing_names_are_doubted() {
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,uncertainty\n";
    let file = |from: fn(i32) -> i32, uncertainty: f64| {
        let mut text = head.to_owned();
        for light in [0, 20, 40] {
            for sensor in (0..80).step_by(10) {
                let (i, o) = (from(light), from(sensor));
                text += &format!("{i},0,{o},180,0.3,{uncertainty}\n");
            }
        }
        text
    };
    let warnings = |text: &str, conventions: Conventions| read(text, conventions).warnings;
    let right = file(|theta| theta, 0.006);
    assert!(warnings(&right, Conventions::default()).is_empty());
    let elevations = file(|theta| 90 - theta, 0.006);
    let said = warnings(&elevations, Conventions::default());
    assert!(
        said.len() == 1 && said[0].contains("--elevation"),
        "{said:?}"
    );
    let told = told("elevation");
    assert!(warnings(&elevations, told).is_empty());
    let percent = file(|theta| theta, 2.0);
    let said = warnings(&percent, Conventions::default());
    let option = "--uncertainties percent";
    assert!(said.len() == 1 && said[0].contains(option), "{said:?}");
    // Two percent of .3 are .006 1/sr, whatever the unit of the values.
    for (text, uncertainties, quantity, want) in [
        (&right, UncertaintyUnit::Value, Quantity::Brdf, 0.006),
        (&percent, UncertaintyUnit::Percent, Quantity::Brdf, 0.006),
        (
            &file(|t| t, 0.02),
            UncertaintyUnit::Relative,
            Quantity::Brdf,
            0.006,
        ),
        (
            &percent,
            UncertaintyUnit::Percent,
            Quantity::ReflectanceFactor,
            0.006 / PI,
        ),
    ] {
        let told = Conventions {
            uncertainties: Some(uncertainties),
            quantity: Some(quantity),
            ..Conventions::default()
        };
        let back = read(text, told);
        assert!(back.warnings.is_empty(), "{:?}", back.warnings);
        let u = back.measurement.details.unwrap().type_b[0];
        assert!(
            (u / want - 1.0).abs() < 1e-12,
            "{uncertainties:?}: {u} {want}"
        );
    }
}
