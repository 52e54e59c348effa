//! Measurements.

use super::common::{near, planned, product, table};
use super::schema::check_lines;
use super::{ANGLES, FORMATS, backwards, kinds, refused, schedules};
use gonio::brdf::Channels;
use gonio::geometry::Symmetry;
use gonio::measurement::{About, Details, Flags, Measurement, Outcome, Readings};
use gonio::measurement::{measurement_schema, read_measurement, write_measurement};
use gonio::parametrization::usual_form;
use gonio::sampling::Random;
use gonio::schedule::schedule_hash;
use gonio::schedule::{
    Assume, FileError, Itinerary, Schedule, ScheduleFormat, Sequence, Unreachable,
};
use std::sync::Arc;

/// Values over 30 decades, some negative, and every kind of outcome.
pub fn measured(
    schedule: &Arc<Schedule>,
    channels: Channels,
    details: bool,
) -> (Measurement, Itinerary) {
    let itinerary = backwards(schedule);
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
        let values = (0..poses * n).map(|i| match outcomes[i / n] {
            Outcome::Reading => number(i, salt) * sign.powi(i as i32),
            _ => 0.0,
        });
        values.collect()
    };
    let flags = |i: usize| {
        let all = Flags::ALL.iter().enumerate();
        let set = all.filter(|(bit, _)| i >> bit & 1 == 1);
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
        schedule: Arc::clone(schedule),
    };
    (measurement, itinerary)
}

pub fn about(measurement: &Measurement, itinerary: &Itinerary) -> About {
    let hash = schedule_hash(&measurement.schedule, Sequence::Visits(itinerary));
    About {
        is_bare: false,
        material: Some("red # paint, \"matte\" = 1".into()),
        instrument: Some(itinerary.instrument.clone()),
        realisation: Some(3),
        seed: Some(u64::MAX),
        schedule_hash: Some(hash),
        foreign_header: None,
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

fn try_read(text: &str) -> Result<Readings, FileError> {
    read_measurement(text, "m.csv", &Assume::default())
}

fn read(text: &str) -> Readings {
    try_read(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The poses in the order of their rows.
fn order(m: &Measurement) -> Vec<u32> {
    let mut order: Vec<u32> = (0..m.places.len() as u32).collect();
    order.retain(|pose| m.places[*pose as usize].line > 0);
    order.sort_by_key(|pose| m.places[*pose as usize].line);
    order
}

/// The note that so many rows were replaced.
fn replaced(rows: usize) -> String {
    format!("{rows} rows replaced by later attempts")
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
    let schema = measurement_schema();
    for (i, (schedule, channels)) in product(schedules(), kinds()).into_iter().enumerate() {
        // Half of each, in turn.
        let details = (i + i / kinds().len()).is_multiple_of(2);
        let (measurement, itinerary) = measured(&schedule, channels, details);
        let about = about(&measurement, &itinerary);
        let backwards: Vec<u32> = (0..schedule.poses.len() as u32).rev().collect();
        let sequences = [Sequence::Order(&backwards), Sequence::Visits(&itinerary)];
        let sequences = [Sequence::Generated].into_iter().chain(sequences);
        let formats = FORMATS.into_iter().chain([ScheduleFormat::Arrays]);
        for (sequence, format) in product(sequences, formats) {
            let text = text(&measurement, &about, sequence, format);
            if format == ScheduleFormat::JsonLines {
                check_lines(&schema, &text);
            }
            let back = read(&text);
            assert_same(&back.measurement, &measurement);
            assert_eq!(back.about, about);
            assert!(back.notes.is_empty(), "{:?}", back.notes);
            if let Sequence::Order(poses) = sequence {
                assert_eq!(order(&back.measurement), poses);
            }
        }
    }
}

#[test]
fn four_angles_and_a_value_are_enough() {
    let columns = format!("{ANGLES},value\r\n").replace(',', ";");
    let m = read(&format!("{columns}10;0;20;180;0,5\r\n30;0;20;180;\r\n")).measurement;
    assert_eq!(m.outcomes, [Outcome::Reading, Outcome::NoData]);
    assert_eq!((m.values[0], m.details), (0.5, None));
    // Times the cosine: cos 60° = 1/2 to rounding, uncertainties too.
    let cosine = format!("{ANGLES},value_cos,uncertainty\n60,0,20,0,0.25,0.01\n");
    let m = read(&cosine).measurement;
    let details = m.details.unwrap();
    near(m.values[0], 0.5, 1e-15, "value");
    near(details.type_b[0], 0.02, 1e-16, "uncertainty");
    assert_eq!(details.type_a[0], 0.0);
    let m = read(&format!(
        "value_g,value_b,value_r,{ANGLES},flags\n\
         2,3,1,10,0,20,0,saturated ; clipped\n,,,20,0,20,0,unreachable:axis-range:3\n",
    ));
    let m = m.measurement;
    assert_eq!(m.channels, Channels::Rgb);
    assert_eq!(m.values[..3], [1.0, 2.0, 3.0]);
    let flags = m.details.unwrap().flags;
    assert_eq!(flags, [Flags::SATURATED.with(Flags::CLIPPED), Flags::NONE]);
    let unreachable = Outcome::Unreachable(Unreachable::AxisRange(3));
    assert_eq!(m.outcomes[1], unreachable);
}

#[test]
fn a_later_attempt_replaces_an_earlier_one() {
    let rows = "10,0,20,0,1,1\n20,0,20,0,2,1\n10,0,20,0,3,3\n10,0,20,360,4,2\n";
    let back = read(&format!("{ANGLES},value,attempt\n{rows}"));
    assert_eq!(back.notes, [replaced(2)]);
    assert_eq!(back.measurement.values, [2.0, 3.0]);
    // With an index the number is the pose's, whichever row counts.
    let rows = "5,10,0,20,0,1,1\n7,20,0,20,0,2,1\n5,10,0,20,0,3,2\n";
    let back = read(&format!("index,{ANGLES},value,attempt\n{rows}"));
    assert_eq!(order(&back.measurement), [1, 0]);
    assert_eq!(back.measurement.values, [3.0, 2.0]);
}

#[test]
fn a_pose_may_have_any_number_of_attempts() {
    // Two poses, tried in turns; the azimuth of one goes round, which moves it by roundings.
    const ATTEMPTS: usize = 100_000;
    for (index, numbers) in [("", ["", ""]), ("index,", ["0,", "1,"])] {
        let mut text = format!("{index}{ANGLES},value,attempt\n");
        for i in 0..ATTEMPTS {
            // The latest is in the middle.
            let attempt = 1 + (i + ATTEMPTS / 2) % ATTEMPTS;
            let turn = 360 * (i / 2 % 2);
            let pose = ["10,70,20,0".into(), format!("33,{turn},20,7")];
            text += &format!("{}{},{i},{attempt}\n", numbers[i % 2], pose[i % 2]);
        }
        let back = read(&text);
        let latest = (ATTEMPTS / 2) as f64;
        assert_eq!(back.notes, [replaced(ATTEMPTS - 2)]);
        assert_eq!(back.measurement.values, [latest - 2.0, latest - 1.0]);
    }
}

#[test]
fn a_reading_beyond_all_bounds_is_refused_with_its_line() {
    for (column, theta, value, is_good) in [
        ("value", 10.0, "1e308", false),
        ("value", 10.0, "-1e151", false),
        ("value", 10.0, "1e150", true),
        // The cosine of 89.9° is 1/573.
        ("value_cos", 89.9, "1e306", false),
        ("value_cos", 89.9, "1e148", false),
        ("value_cos", 89.9, "1e147", true),
        ("value_cos", 10.0, "0.9e150", true),
    ] {
        let csv = format!("{ANGLES},{column}\n1,0,2,0,1\n{theta},0,3,4,{value}\n");
        let row = |theta: f64, value: &str| {
            let angles = format!("\"theta_i_deg\":{theta},\"phi_i_deg\":0,\"theta_o_deg\":3");
            format!("{{{angles},\"phi_o_deg\":4,\"{column}\":{value}}}\n")
        };
        let json = row(1.0, "1") + &row(theta, value);
        for (text, line) in [(csv, "3"), (json, "2")] {
            if is_good {
                let values = read(&text).measurement.values;
                assert!(values.iter().all(|v| v.is_finite()));
                continue;
            }
            let number: f64 = value.parse().unwrap();
            let told =
                format!("m.csv:{line}: {column} = {number:e} is no reading … because: without");
            refused(try_read(&text), line, &(told + " the cosine"));
        }
    }
}

#[test]
fn uncertainties_that_go_with_no_value_are_not_dropped() {
    for [columns, stray] in table(
        "
        value_r,value_g,value_b,uncertainty  | uncertainty
        value,type_a,type_a_r                | type_a_r
        value_450nm,value_550nm,type_b_450nm | type_b_450nm
        value_450nm,uncertainty_451nm        | uncertainty_451nm",
    ) {
        let cells = ",1".repeat(columns.split(',').count());
        let text = format!("{ANGLES},{columns}\n10,0,20,0{cells}\n");
        let told = format!("m.csv:1: column {stray} does not go with");
        refused(try_read(&text), "1", &told);
    }
}

#[test]
fn readings_of_one_configuration_become_their_mean() {
    // Light and sensor exchanged, and the sample turned: one configuration to an isotropic and
    // reciprocal material, three to one without symmetries.
    let text = format!(
        "{ANGLES},value,type_a,type_b,flags\n\
         10,0,20,70,1,0.3,0.5,\n20,70,10,0,3,0.4,0.7,clipped\n10,30,20,100,,,,no-data\n\
         50,0,20,70,9,0.1,0.1,\n"
    );
    let merged = |text: &str, symmetry| {
        // Without symmetries each row is a configuration.
        let rows = read(text).measurement;
        let pairs = rows.schedule.poses.iter().map(|pose| pose.pair);
        let schedule = Arc::new(Schedule::of_pairs(usual_form(symmetry), pairs));
        Measurement { schedule, ..rows }.merged()
    };
    let (m, n) = merged(&text, Symmetry::NONE);
    assert_eq!((m.outcomes.len(), n.poses), (4, 0));
    let (m, n) = merged(&text, Symmetry::FULL);
    assert_eq!((n.poses, n.compared), (2, 1));
    // 1 and 3: a deviation of the root of 2 about 2.
    near(n.scatter, 0.5_f64.sqrt(), 1e-15, "scatter");
    assert_eq!(m.outcomes, [Outcome::Reading; 2]);
    assert_eq!(m.values, [2.0, 9.0]);
    assert_eq!(m.schedule.poses.len(), 2);
    let details = m.details.unwrap();
    // 1 and 3 scatter more than they claim: by 1, the standard error of their mean, and not by the
    // 0.25 of 0.3 and 0.4. What readings share does not average out.
    near(details.type_a[0], 1.0, 1e-15, "type A");
    near(details.type_b[0], 0.6, 1e-15, "type B");
    assert_eq!(details.flags, [Flags::CLIPPED, Flags::NONE]);
    // Where they scatter less, it is as much as they claim.
    let close = text.replace("10,0,20,70,1,", "10,0,20,70,2.9,");
    let (m, _) = merged(&close, Symmetry::FULL);
    near(m.details.unwrap().type_a[0], 0.25, 1e-15, "claimed");
    // The nodes of a lattice are told apart already.
    let form = crate::common::form("hybrid", Symmetry::FULL);
    let (m, _) = measured(&planned(&form, "grid", 60, 1), Channels::Rgb, true);
    let (again, n) = m.clone().merged();
    assert_eq!(n.poses, 0);
    assert_same(&again, &m);
}

#[test]
fn what_is_no_measurement_is_refused_with_its_line() {
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
        ,value_cos,uncertainty | 89.9,0,3,4,1,1e306 | 2 | m.csv:2: uncertainty = 1e306
        ,value | 1,2,95,4,5 | 2 | theta_o_deg = 95"#,
    ) {
        refused(try_read(&format!("{ANGLES}{more}\n{rows}\n")), line, part);
    }
}
