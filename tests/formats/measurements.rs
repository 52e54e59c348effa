//! Measurements.

use super::common::table;
use super::{FORMATS, backwards, chain, kinds, planned, schedules};
use gonio::brdf::Channels;
use gonio::geometry::Symmetry;
use gonio::measurement::{About, Details, Flags, Measurement, MeasurementFile, Outcome};
use gonio::measurement::{read_measurement, write_measurement};
use gonio::sampling::Random;
use gonio::schedule::schedule_hash;
use gonio::schedule::{Assume, Itinerary, Schedule, ScheduleFormat, Sequence, Unreachable};
use std::sync::Arc;

/// Values over 30 decades, some negative, and every kind of outcome.
pub fn measured(schedule: Schedule, channels: Channels, details: bool) -> (Measurement, Itinerary) {
    let itinerary = backwards(&schedule);
    let poses = schedule.poses.len();
    let n = channels.count();
    let random = Random::new(8);
    let number = |i: usize, salt: u64| {
        let [a, b]: [f64; 2] = random.point(i as u64 + (salt << 32));
        10f64.powf(30.0 * a - 15.0) * (1.0 + b)
    };
    let mut outcomes = vec![Outcome::Reading; poses];
    for i in (0..poses).filter(|i| i % 7 == 0) {
        outcomes[i] = Outcome::NoData;
    }
    for &(pose, why) in &itinerary.unreachable {
        outcomes[pose as usize] = Outcome::Unreachable(why);
    }
    outcomes[2] = Outcome::NotVisited;
    let list = |salt: u64, sign: f64| -> Vec<f64> {
        let values = (0..poses * n).map(|i| {
            let read = outcomes[i / n] == Outcome::Reading;
            if read {
                number(i, salt) * sign.powi(i as i32)
            } else {
                0.0
            }
        });
        values.collect()
    };
    let flags = |i: usize| {
        let set = Flags::ALL
            .iter()
            .enumerate()
            .filter(|(bit, _)| i >> bit & 1 == 1);
        set.fold(Flags::NONE, |all, (_, (flag, _))| all.with(*flag))
    };
    let measurement = Measurement {
        channels,
        values: list(0, -1.0),
        details: details.then(|| Details {
            type_a: list(1, 1.0),
            type_b: list(2, 1.0),
            flags: (0..poses).map(flags).collect(),
        }),
        outcomes,
        places: Vec::new(),
        half_angles_deg: if details { [0.25, 0.5] } else { [0.0; 2] },
        schedule: Arc::new(schedule),
    };
    (measurement, itinerary)
}

pub fn about(measurement: &Measurement, itinerary: &Itinerary) -> About {
    About {
        is_bare: false,
        material: Some("red # paint, \"matte\" = 1".into()),
        instrument: Some(itinerary.instrument.clone()),
        realisation: Some(3),
        seed: Some(u64::MAX),
        schedule_hash: Some(schedule_hash(
            &measurement.schedule,
            Sequence::Visits(itinerary),
        )),
    }
}

pub fn text(m: &Measurement, about: &About, sequence: Sequence, format: ScheduleFormat) -> String {
    let mut bytes = Vec::new();
    write_measurement(m, about, sequence, format, &mut bytes).unwrap();
    match format {
        ScheduleFormat::Arrays => super::as_text("npz", &bytes).unwrap(),
        _ => String::from_utf8(bytes).unwrap(),
    }
}

fn read(text: &str) -> MeasurementFile {
    let read = read_measurement(text, "m", &Assume::default());
    read.unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Bit for bit; NaN would differ.
fn assert_same(a: &Measurement, b: &Measurement) {
    assert_eq!(a.channels, b.channels);
    assert_eq!(a.outcomes, b.outcomes);
    assert_eq!(a.half_angles_deg, b.half_angles_deg);
    let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&a.values), bits(&b.values));
    assert_eq!(a.details, b.details);
    assert_eq!(a.schedule.poses.len(), b.schedule.poses.len());
    assert!(a.schedule.lattice == b.schedule.lattice);
}

#[test]
fn a_measurement_comes_back_to_the_bit() {
    for schedule in schedules() {
        for channels in kinds() {
            for details in [false, true] {
                let (measurement, itinerary) =
                    measured(schedule.clone(), channels.clone(), details);
                let about = about(&measurement, &itinerary);
                let backwards: Vec<u32> = (0..schedule.poses.len() as u32).rev().collect();
                for sequence in [
                    Sequence::Generated,
                    Sequence::Order(&backwards),
                    Sequence::Visits(&itinerary),
                ] {
                    for format in FORMATS.into_iter().chain([ScheduleFormat::Arrays]) {
                        let back = read(&text(&measurement, &about, sequence, format));
                        assert_same(&back.measurement, &measurement);
                        assert_eq!(back.about, about);
                        assert_eq!(back.replaced, 0);
                        if let Sequence::Order(order) = sequence {
                            assert_eq!(back.order, order);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn four_angles_and_a_value_are_enough() {
    let m = read(
        "theta_i_deg;phi_i_deg;theta_o_deg;phi_o_deg;value\r\n10;0;20;180;0,5\r\n30;0;20;180;\r\n",
    );
    let m = m.measurement;
    assert_eq!(m.outcomes, [Outcome::Reading, Outcome::NoData]);
    assert_eq!((m.values[0], m.details), (0.5, None));
    // Times the cosine: cos 60° = 1/2 to rounding, uncertainties too.
    let m = read(
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value_cos,uncertainty\n60,0,20,0,0.25,0.01\n",
    );
    let (value, details) = (m.measurement.values[0], m.measurement.details.unwrap());
    assert!((value - 0.5).abs() < 1e-15);
    assert!((details.type_b[0] - 0.02).abs() < 1e-16 && details.type_a[0] == 0.0);
    let m = read(
        "value_g,value_b,value_r,theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,flags\n\
         2,3,1,10,0,20,0,saturated ; clipped\n,,,20,0,20,0,unreachable:axis-range:3\n",
    );
    let m = m.measurement;
    assert_eq!(
        (m.channels, &m.values[..3]),
        (Channels::Rgb, &[1.0, 2.0, 3.0][..])
    );
    let flags = m.details.unwrap().flags;
    assert_eq!(flags, [Flags::SATURATED.with(Flags::CLIPPED), Flags::NONE]);
    assert_eq!(
        m.outcomes[1],
        Outcome::Unreachable(Unreachable::AxisRange(3))
    );
}

#[test]
fn a_later_attempt_replaces_an_earlier_one() {
    let back = read(
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,attempt\n\
         10,0,20,0,1,1\n20,0,20,0,2,1\n10,0,20,0,3,3\n10,0,20,360,4,2\n",
    );
    assert_eq!(back.replaced, 2);
    assert_eq!(back.measurement.values, [2.0, 3.0]);
    // With an index the number is the pose's, whichever row counts.
    let back = read(
        "index,theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,attempt\n\
         5,10,0,20,0,1,1\n7,20,0,20,0,2,1\n5,10,0,20,0,3,2\n",
    );
    assert_eq!(
        (back.measurement.values, back.order),
        (vec![3.0, 2.0], vec![1, 0])
    );
}

#[test]
fn a_pose_may_have_any_number_of_attempts() {
    // Two poses, tried in turns; the azimuth of one goes round, which moves it by roundings.
    const ATTEMPTS: usize = 100_000;
    for index in ["", "index,"] {
        let mut text =
            format!("{index}theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,attempt\n");
        for i in 0..ATTEMPTS {
            // The latest is in the middle.
            let attempt = 1 + (i + ATTEMPTS / 2) % ATTEMPTS;
            let turn = 360 * (i / 2 % 2);
            let pose = ["10,70,20,0", "33,TURN,20,7"][i % 2].replace("TURN", &turn.to_string());
            let number = if index.is_empty() {
                ""
            } else {
                ["0,", "1,"][i % 2]
            };
            text += &format!("{number}{pose},{i},{attempt}\n");
        }
        let back = read(&text);
        let latest = ATTEMPTS / 2;
        assert_eq!(back.replaced, ATTEMPTS - 2);
        assert_eq!(
            back.measurement.values,
            [latest as f64 - 2.0, latest as f64 - 1.0]
        );
    }
}

#[test]
fn a_reading_beyond_all_bounds_is_refused_with_its_line() {
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    let fields = |theta: f64| {
        format!("\"theta_i_deg\":{theta},\"phi_i_deg\":0,\"theta_o_deg\":3,\"phi_o_deg\":4")
    };
    for (column, theta, value, good) in [
        ("value", 10.0, "1e308", false),
        ("value", 10.0, "-1e151", false),
        ("value", 10.0, "1e150", true),
        // The cosine of 89.9° is 1/573.
        ("value_cos", 89.9, "1e306", false),
        ("value_cos", 89.9, "1e148", false),
        ("value_cos", 89.9, "1e147", true),
        ("value_cos", 10.0, "0.9e150", true),
    ] {
        let csv = format!("{angles},{column}\n1,0,2,0,1\n{theta},0,3,4,{value}\n");
        let row = |theta: f64, value: &str| format!("{{{},\"{column}\":{value}}}\n", fields(theta));
        let json = row(1.0, "1") + &row(theta, value);
        for (text, line) in [(csv, 3), (json, 2)] {
            match read_measurement(&text, "m", &Assume::default()) {
                Ok(back) => {
                    assert!(good, "{text}");
                    assert!(back.measurement.values.iter().all(|v| v.is_finite()));
                }
                Err(e) => {
                    assert!(!good, "{e}");
                    assert_eq!(e.line, Some(line), "{e}");
                    let number: f64 = value.parse().unwrap();
                    let start = format!("{column} = {number:e} is no reading");
                    assert!(e.message.starts_with(&start), "{e}");
                    assert!(chain(&e).contains("because: without the cosine"), "{e}");
                }
            }
        }
    }
    let text = format!("{angles},value_cos,uncertainty\n89.9,0,3,4,1,1e306\n");
    let e = read_measurement(&text, "m", &Assume::default())
        .err()
        .unwrap();
    assert!(e.message.starts_with("uncertainty = 1e306"), "{e}");
}

#[test]
fn uncertainties_that_go_with_no_value_are_not_dropped() {
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    for (columns, stray) in [
        ("value_r,value_g,value_b,uncertainty", "uncertainty"),
        ("value,type_a,type_a_r", "type_a_r"),
        ("value_450nm,value_550nm,type_b_450nm", "type_b_450nm"),
        ("value_450nm,uncertainty_451nm", "uncertainty_451nm"),
    ] {
        let cells = "1,".repeat(columns.split(',').count());
        let cells = cells.trim_end_matches(',');
        let text = format!("{angles},{columns}\n10,0,20,0,{cells}\n");
        let e = read_measurement(&text, "m", &Assume::default());
        let e = e.err().unwrap();
        let start = format!("column {stray} does not go with");
        assert!(e.message.starts_with(&start), "{columns}: {e}");
    }
}

#[test]
fn readings_of_one_configuration_become_their_mean() {
    // Light and sensor exchanged, and the sample turned: one configuration to an isotropic and
    // reciprocal material, three to one without symmetries.
    let text = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,type_a,type_b,flags\n\
                10,0,20,70,1,0.3,0.5,\n20,70,10,0,3,0.4,0.7,clipped\n10,30,20,100,,,,no-data\n\
                50,0,20,70,9,0.1,0.1,\n";
    let merged = |symmetry| {
        let assume = Assume {
            otherwise: symmetry,
            ..Assume::default()
        };
        let read = read_measurement(text, "m", &assume).unwrap();
        read.measurement.merged()
    };
    let (m, n) = merged(Symmetry::NONE);
    assert_eq!((m.outcomes.len(), n.poses), (4, 0));
    let (m, n) = merged(Symmetry::FULL);
    assert_eq!((n.poses, n.compared), (2, 1));
    // 1 and 3: a deviation of the root of 2 about 2.
    assert!((n.scatter - 0.5_f64.sqrt()).abs() < 1e-15);
    assert_eq!(m.outcomes, [Outcome::Reading; 2]);
    assert_eq!(
        (m.values.as_slice(), m.schedule.poses.len()),
        (&[2.0, 9.0][..], 2)
    );
    let details = m.details.unwrap();
    // 1 and 3 scatter more than they claim: by 1, the standard error of their mean, and not by the
    // 0.25 of 0.3 and 0.4. What readings share does not average out.
    assert!((details.type_a[0] - 1.0).abs() < 1e-15);
    assert!((details.type_b[0] - 0.6).abs() < 1e-15);
    assert_eq!(details.flags, [Flags::CLIPPED, Flags::NONE]);
    // Where they scatter less, it is as much as they claim.
    let close = text.replace("10,0,20,70,1,", "10,0,20,70,2.9,");
    let assume = Assume {
        otherwise: Symmetry::FULL,
        ..Assume::default()
    };
    let (m, _) = read_measurement(&close, "m", &assume)
        .unwrap()
        .measurement
        .merged();
    assert!((m.details.unwrap().type_a[0] - 0.25).abs() < 1e-15);
    // The nodes of a lattice are told apart already.
    let form = crate::common::form("hybrid", Symmetry::FULL);
    let (m, _) = measured(planned(&form, "grid", 60), Channels::Rgb, true);
    let (again, n) = m.clone().merged();
    assert_eq!(n.poses, 0);
    assert_same(&again, &m);
}

#[test]
fn what_is_no_measurement_is_refused_with_its_line() {
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    for [more, rows, line, part] in table(
        r#"
        | 1,2,3,4 | 1 | there must be one kind of values
        ,value,value_cos | 1,2,3,4,5,6 | 1 | there must be one kind of values
        ,value_r,value_g | 1,2,3,4,5,6 | 1 | there must be one kind of values
        ,value_nits | 1,2,3,4,5 | 1 | column "value_nits" is not known
        ,value | 1,2,3,4,x | 2 | value = x: allowed is a finite number
        ,value,flags | 1,2,3,4,5,dirty | 2 | "dirty" is no flag; allowed are saturated
        ,value,flags | 1,2,3,4,5,no-data | 2 | says there is none
        ,value,flags | 1,2,3,4,,no-data;occluded | 2 | one reason
        ,value,flags | 1,2,3,4,,unreachable:tired | 2 | light-elevation
        ,value,type_a | 1,2,3,4,5,-2 | 2 | type_a = -2: allowed is a number from 0
        ,value,attempt | 1,2,3,4,5,0 | 2 | attempt = 0: allowed is a whole number from 1
        ,value,attempt | 1,2,3,4,5,2\n1,2,3,4,6,2 | 3 | this pose is that of line 2 with the same attempt
        ,value,index | 1,2,3,4,5,0\n1,2,3,9,6,0 | 3 | this index is that of line 2
        ,value | 1,2,95,4,5 | 2 | theta_o_deg = 95"#,
    ) {
        let line = line.parse().unwrap();
        let text = format!("{head}{more}\n{rows}\n");
        let e = read_measurement(&text, "m.csv", &Assume::default())
            .err()
            .unwrap();
        assert_eq!(e.line, Some(line), "{text}: {e}");
        assert!(chain(&e).contains(part), "{text}: {e}");
        // Nothing of it is lost on the way to the terminal.
        let told = chain(&e);
        assert_eq!(chain(&gonio::Error::from(e)), told);
    }
}
