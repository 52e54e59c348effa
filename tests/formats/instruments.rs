//! Text of pab-opto and text after ASTM E1392: random readings come back, and headers by others are read.

use super::common::table;
use super::{told, try_read};
use gonio::brdf::{Channels, Wavelengths};
use gonio::formats::{self, Format, READ_READINGS, Readings, WRITE_READINGS};
use gonio::geometry::{DirectionPair, Symmetry, distance};
use gonio::measurement::{About, Details, Flags, Measurement, Outcome};
use gonio::schedule::{AngleUnit, Assume, Conventions, Pose, Schedule, Sequence};
use std::sync::Arc;

fn format(name: &str) -> Format {
    WRITE_READINGS.named(name).unwrap()
}

/// Readings at a few lights, some of which have none.
fn measured(channels: Channels) -> Measurement {
    let form = crate::common::form("spherical", Symmetry::NONE);
    let pose = |k: usize| {
        let x = k as f64;
        let light = (k / 5) as f64;
        let pair = DirectionPair::from_spherical(
            0.1 + 0.3 * light,
            2.0 - light,
            0.1 + 0.013 * x,
            2.9 * x % 3.0,
        );
        Pose {
            coords: form.forward(&pair),
            pair,
        }
    };
    let poses: Vec<Pose> = (0..20).map(pose).collect();
    let n = channels.count();
    let mut outcomes = vec![Outcome::Reading; poses.len()];
    outcomes[7] = Outcome::NoData;
    Measurement {
        channels,
        values: (0..n * poses.len())
            .map(|k| 1.0 / (k as f64 + 3.0))
            .collect(),
        details: Some(Details {
            type_a: vec![0.01; n * poses.len()],
            type_b: vec![0.02; n * poses.len()],
            flags: vec![Flags::NONE; poses.len()],
        }),
        outcomes,
        places: Vec::new(),
        half_angles_deg: [0.0; 2],
        schedule: Arc::new(Schedule {
            sample_set: "some".into(),
            poses,
            lattice: None,
            unphysical_share: 0.0,
            assumes: None,
            parametrization: form,
        }),
    }
}

fn written(format: &Format, measurement: &Measurement) -> std::io::Result<String> {
    let about = About {
        material: Some("brushed \"steel\"".into()),
        ..About::default()
    };
    let mut bytes = Vec::new();
    let write = WRITE_READINGS.function(format).unwrap();
    write(measurement, &about, Sequence::Generated, &mut bytes)?;
    Ok(String::from_utf8(bytes).unwrap())
}

fn read(text: &str) -> Readings {
    let format = formats::of_text(text).unwrap();
    let assume = Assume {
        symmetry: Some(Symmetry::NONE),
        ..Assume::default()
    };
    READ_READINGS.function(&format).unwrap()(text, "some.txt", &assume).unwrap()
}

#[test]
fn readings_come_back_without_what_has_no_place() {
    let nm = Wavelengths::new(&[450.0, 1550.0 / 3.0]).unwrap();
    for name in ["pab-opto", "astm"] {
        for channels in [
            Channels::Luminance,
            Channels::Rgb,
            Channels::Wavelengths(nm.clone()),
        ] {
            let before = measured(channels.clone());
            let text = match written(&format(name), &before) {
                Ok(text) => text,
                Err(e) => {
                    assert!(name == "pab-opto" && channels.wavelengths().is_some());
                    assert!(e.to_string().contains("no wavelengths"));
                    continue;
                }
            };
            assert_eq!(formats::of_text(&text).unwrap().name, name);
            let after = read(&text).measurement;
            assert_eq!(after.channels, channels);
            assert!(after.details.is_none());
            assert_eq!(after.readings(), 19);
            let kept = (0..20).filter(|k| before.value(*k).is_some());
            for (k, old) in kept.enumerate() {
                let pairs = [
                    &before.schedule.poses[old].pair,
                    &after.schedule.poses[k].pair,
                ];
                assert!(distance(pairs[0], pairs[1], Symmetry::NONE) < 1e-13);
                let values = before
                    .value(old)
                    .unwrap()
                    .iter()
                    .zip(after.value(k).unwrap());
                for (a, b) in values {
                    assert!((a / b - 1.0).abs() < 1e-13, "{name}: {a} {b}");
                }
            }
        }
    }
}

const PAB: &str = "#measured some day\n#sample_name \"x\"\n#format theta phi DSF\n#incident_angle 30 90\n\
                   #colorimetry: CIE-Y\n#datapoints_in_file\t3\n60 270 0.25\n0 0 1\n120 270 0.5\n";

#[test]
fn a_header_of_pab_opto_is_read_in_its_dialects() {
    let readings = read(PAB);
    assert_eq!(
        readings.notes,
        ["1 row with light or sensor below the horizon: passed over"]
    );
    let m = readings.measurement;
    // Divided by the cosine of the sensor.
    assert!((m.values[0] - 0.5).abs() < 1e-15 && (m.values[1] - 1.0).abs() < 1e-15);
    let pair = m.schedule.poses[0].pair;
    let mirror = DirectionPair::from_spherical(
        30f64.to_radians(),
        90f64.to_radians(),
        60f64.to_radians(),
        -90f64.to_radians(),
    );
    assert!(distance(&pair, &mirror, Symmetry::NONE) < 1e-12);
    // Other words for the same.
    for (old, new) in [
        ("#format theta", "#format: theta"),
        ("#incident_angle 30 90", "#intheta 30\n#inphi: 90"),
        (
            "#incident_angle 30 90",
            "#theta_in 30\n#phi_in 90\n#upphi 90",
        ),
        ("\n60 270 0.25", "\n\n 60\t270\t2.5e-1"),
    ] {
        assert!(PAB.contains(old));
        let other = read(&PAB.replace(old, new)).measurement;
        assert_eq!(other.values, m.values);
        assert_eq!(other.schedule.poses, m.schedule.poses);
    }
    // X, Y, Z of grey.
    let grey = PAB
        .replace("CIE-Y", "CIE-XYZ")
        .replace("0.25\n", "0.25 0.25 0.25\n");
    let grey = grey
        .replace(" 0 1\n", " 0 1 1 1\n")
        .replace("0.5\n", "0 0 0\n");
    let grey = read(&grey).measurement;
    assert_eq!(grey.channels, Channels::Rgb);
    assert!(
        grey.values
            .iter()
            .zip([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
            .all(|(a, b)| (a - b).abs() < 1e-3)
    );
    // Files one after the other.
    let two = PAB.to_owned() + &PAB.replace("30 90", "40 90");
    assert_eq!(read(&two).measurement.readings(), 4);
}

const ASTM: &str = "SAMPLE steel\nNUM_POINTS 2\nVARS theta_i,phi_i,theta_s,phi_s,400nm,500nm\n\
                    0.5,0,0.5,3.1,1.5,2.5\n0.5, -1, 0.2, 0, 3, 4\n";

#[test]
fn a_header_of_astm_says_what_columns_are() {
    let m = read(ASTM).measurement;
    assert_eq!(m.channels.wavelengths().unwrap().nm(), [400.0, 500.0]);
    assert_eq!(m.values, [1.5, 2.5, 3.0, 4.0]);
    let pair = DirectionPair::from_spherical(0.5, -1.0, 0.2, 0.0);
    assert!(distance(&m.schedule.poses[1].pair, &pair, Symmetry::NONE) < 1e-14);
    let without = ASTM
        .replace("phi_i,", "")
        .replace("400nm,500nm", "value,phi_x");
    assert!(formats::of_text(&without).is_some_and(|f| f.name == "astm"));
    let grey = "VARS theta_i,theta_s,phi_s,signal\n0.5,0.5,3.1,1.5\n";
    let grey = read(grey).measurement;
    assert_eq!(
        (grey.channels, &grey.values[..]),
        (Channels::Luminance, &[1.5][..])
    );
}

#[test]
fn what_cannot_be_is_refused_with_its_line() {
    for [text, old, new, part] in table(
        r#"
        PAB | DSF | BTDF | m.csv:3: #format theta phi BTDF: allowed are BRDF, BSDF and DSF
        PAB | CIE-Y | RGB | m.csv:5: #colorimetry RGB: allowed are CIE-Y and CIE-XYZ
        PAB | #incident_angle 30 90\n |  | the line #intheta is missing before this row
        PAB | 30 90 | 30 x | allowed are two numbers of degrees
        PAB | 270 0.25 | 270 | m.csv:7: 2 cells where the header asks for 3
        PAB | 0 0 1\n | 0 0 1 1\n | m.csv:8: 4 cells where the header asks for 3
        PAB | file\t3 | file\t2 | m.csv:6: #datapoints_in_file 2: 3 rows are there
        PAB | file\t3 | file\t4 | #datapoints_in_file 4: 3 rows are there; --partial reads up to the cut
        PAB | 0.25 | 1e400 | m.csv:7: 1e400: allowed is a finite number
        ASTM | theta_s | theta_o | m.csv:3: VARS lacks theta_s
        ASTM | 400nm | R | VARS names the values R,500nm; allowed: R,G,B
        ASTM | 500nm | 300nm | VARS: wavelengths_nm = 300
        ASTM | POINTS 2 | POINTS two | m.csv:2: NUM_POINTS two: allowed is a whole number
        ASTM | POINTS 2 | POINTS 3 | NUM_POINTS 3: 2 rows are there; --partial reads up to the cut
        ASTM | 3.1,1.5,2.5 | 3.1,1.5 | m.csv:4: 5 cells where VARS names 6
        ASTM | 0.5,0, | 2,0, |"#,
    ) {
        let text = if text == "PAB" { PAB } else { ASTM };
        assert!(text.contains(old), "{old}");
        let told = try_read(&text.replace(old, new), Conventions::default());
        match told {
            Err(e) => assert!(e.to_string().contains(part) && !part.is_empty(), "{e}"),
            Ok(readings) => assert!(part.is_empty() && readings.notes.len() == 1, "{part}"),
        }
    }
    for (text, what) in [(PAB, "pab-opto text"), (ASTM, "ASTM text")] {
        let conventions = told("elevation");
        let told = try_read(text, conventions).err().unwrap().to_string();
        assert!(
            told.contains(&format!("--elevation: the header of {what}")),
            "{told}"
        );
    }
}

/// A light whose rows are not all there, or not at all, before another one.
#[test]
fn each_light_has_the_rows_that_it_promises() {
    let cut = PAB.replace("file\t3", "file\t4");
    let none = &PAB[..PAB.find("60 270").unwrap()];
    for (first, rows) in [(&cut[..], 3), (none, 0)] {
        let text = format!("{first}{PAB}");
        let told = try_read(&text, Conventions::default()).err().unwrap();
        let part = format!(": {rows} rows are there");
        assert!(told.to_string().contains(&part), "{told}");
        let conventions = super::told("partial");
        let read = try_read(&text, conventions).unwrap().measurement;
        assert_eq!(read.readings(), 2);
    }
}

#[test]
fn conventions_of_the_command_line_are_for_them_too() {
    let conventions = told("azimuth=mirror quantity=percent");
    for (text, value) in [(PAB, 0.25), (ASTM, 1.5)] {
        let [plain, other] = [Conventions::default(), conventions.clone()]
            .map(|c| try_read(text, c).unwrap().measurement);
        assert!((other.values[0] * 100.0 * std::f64::consts::PI - value).abs() < 1e-12);
        let phi = |m: &Measurement| {
            let pair = m.schedule.poses[0].pair;
            pair.omega_o.phi() - pair.omega_i.phi()
        };
        let turn = (phi(&other) - phi(&plain)).rem_euclid(std::f64::consts::TAU);
        // The azimuth is counted from that of the mirror direction, not from 0.
        let mirror = plain.schedule.poses[0].pair.omega_i.phi() + std::f64::consts::PI;
        assert!(
            (turn - mirror).sin().abs() < 1e-12 && (turn - mirror).cos() > 0.0,
            "{turn}"
        );
    }
}

#[test]
fn angles_of_astm_are_in_radians_or_said_to_be_degrees() {
    let degrees = "LAB_NAME A\nSAMPLE_NAME \"steel\"\nVARS theta_i,phi_i,theta_s,phi_s,signal\n30,0,2,180,1.5\n30,0,60,10,2\n";
    let astm = formats::READ_READINGS
        .named("astm")
        .unwrap()
        .read_readings
        .unwrap();
    let read = |text: &str, angles| {
        let mut assume = Assume::default();
        assume.conventions.angles = angles;
        astm(text, "m.astm", &assume)
    };
    let refused = |text: &str| read(text, None).err().unwrap().to_string();
    let said = refused(degrees);
    assert!(
        said.contains("m.astm:4: theta_i = 30: allowed are at most 0.5 turns, in radians, or in degrees with --angles deg"),
        "{said}"
    );
    let found = read(degrees, Some(AngleUnit::Degrees)).unwrap();
    let pair = DirectionPair::from_spherical(
        30_f64.to_radians(),
        0.0,
        2_f64.to_radians(),
        std::f64::consts::PI,
    );
    assert!(
        distance(
            &found.measurement.schedule.poses[0].pair,
            &pair,
            Symmetry::NONE
        ) < 1e-14
    );
    assert_eq!(found.about.material.as_deref(), Some("steel"));
    assert_eq!(found.unread, ["LAB_NAME"]);
    // An angle is no value.
    for more in ["theta_i", "theta_t"] {
        let said = refused(&degrees.replace("signal", more));
        assert!(
            said.contains(&format!("VARS names the angle {more}: allowed are")),
            "{said}"
        );
    }
}
