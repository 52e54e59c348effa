//! Text of pab-opto and text after ASTM E1392: random readings come back, and headers by others are read.

use super::common::{edited, model, near, refused_edits, says, table, wavelengths};
use super::{conventions, refused, try_read};
use gonio::brdf::Channels;
use gonio::formats::{self, READ_READINGS, Readings, WRITE_READINGS};
use gonio::geometry::{DirectionPair, Symmetry, distance};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::{About, Details, Flags, Measurement, Outcome};
use gonio::schedule::{AngleUnit, Assume, Conventions, Schedule, Sequence};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Readings at a few lights, some of which have none.
fn measured(channels: Channels) -> Measurement {
    let form = crate::common::form("spherical", Symmetry::NONE);
    let pair = |k: usize| {
        let (x, light) = (k as f64, (k / 5) as f64);
        let (theta_i, phi_i) = (0.1 + 0.3 * light, 2.0 - light);
        DirectionPair::from_spherical(theta_i, phi_i, 0.1 + 0.013 * x, 2.9 * x % 3.0)
    };
    let schedule = Schedule::of_pairs(form, (0..20).map(pair));
    let lambert = model("lambert", "albedo = 0.5");
    let mut measurement = Ideal.measure(&*lambert, &Arc::new(schedule));
    let values = channels.count() * 20;
    measurement.channels = channels;
    measurement.outcomes[7] = Outcome::NoData;
    measurement.values = (0..values).map(|k| 1.0 / (k as f64 + 3.0)).collect();
    measurement.details = Some(Details {
        type_a: vec![0.01; values],
        type_b: vec![0.02; values],
        flags: vec![Flags::NONE; 20],
    });
    measurement
}

fn written(name: &str, measurement: &Measurement) -> std::io::Result<String> {
    let about = About {
        material: Some("brushed \"steel\"".into()),
        ..About::default()
    };
    let mut bytes = Vec::new();
    let format = WRITE_READINGS.named(name).unwrap();
    let write = WRITE_READINGS.function(&format).unwrap();
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
    let spectral = wavelengths(&[450.0, 1550.0 / 3.0]);
    for name in ["pab-opto", "astm"] {
        for channels in [Channels::Luminance, Channels::Rgb, spectral.clone()] {
            let before = measured(channels.clone());
            let text = match written(name, &before) {
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
                let pairs = [&before.schedule.poses[old], &after.schedule.poses[k]].map(|p| p.pair);
                let found = distance(&pairs[0], &pairs[1], Symmetry::NONE);
                near(found, 0.0, 1e-13, k);
                let [old, new] = [before.value(old), after.value(k)].map(Option::unwrap);
                for (a, b) in old.iter().zip(new) {
                    near(a / b, 1.0, 1e-13, (name, k));
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
    let note = "1 row with light or sensor below the horizon: passed over";
    assert_eq!(readings.notes, [note]);
    let m = readings.measurement;
    // Divided by the cosine of the sensor.
    near(m.values[0], 0.5, 1e-15, "60°");
    near(m.values[1], 1.0, 1e-15, "0°");
    let [ti, pi, to, po] = [30_f64, 90.0, 60.0, -90.0].map(f64::to_radians);
    let mirror = DirectionPair::from_spherical(ti, pi, to, po);
    let off = distance(&m.schedule.poses[0].pair, &mirror, Symmetry::NONE);
    near(off, 0.0, 1e-12, "mirror");
    // Other words for the same.
    for [old, new] in table(
        r"#format theta | #format: theta
        #incident_angle 30 90 | #intheta 30\n#inphi: 90
        #incident_angle 30 90 | #theta_in 30\n#phi_in 90\n#upphi 90
        \n60 270 0.25 | \n\n 60\t270\t2.5e-1",
    ) {
        let other = read(&edited(PAB, old, new)).measurement;
        assert_eq!(other.values, m.values);
        assert_eq!(other.schedule.poses, m.schedule.poses);
    }
    // X, Y, Z of grey.
    let (head, _) = PAB.split_once("60 270").unwrap();
    let rows = "60 270 0.25 0.25 0.25\n0 0 1 1 1\n120 270 0 0 0\n";
    let grey = read(&(head.replace("CIE-Y", "CIE-XYZ") + rows)).measurement;
    assert_eq!(grey.channels, Channels::Rgb);
    for (k, value) in grey.values.iter().enumerate() {
        near(*value, [0.5, 1.0][k / 3], 1e-3, k);
    }
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
    let found = distance(&m.schedule.poses[1].pair, &pair, Symmetry::NONE);
    near(found, 0.0, 1e-14, "pose");
    let without = ASTM.replace("phi_i,", "");
    let without = without.replace("400nm,500nm", "value,phi_x");
    assert!(formats::of_text(&without).is_some_and(|f| f.name == "astm"));
    let grey = "VARS theta_i,theta_s,phi_s,signal\n0.5,0.5,3.1,1.5\n";
    let grey = read(grey).measurement;
    assert_eq!(grey.channels, Channels::Luminance);
    assert_eq!(grey.values, [1.5]);
}

#[test]
fn what_cannot_be_is_refused_with_its_line() {
    for [text, old, new, line, part] in table(
        r#"
        PAB | DSF | BTDF | 3 | #format theta phi BTDF: allowed are BRDF, BSDF and DSF
        PAB | CIE-Y | RGB | 5 | #colorimetry RGB: allowed are CIE-Y and CIE-XYZ
        PAB | #incident_angle 30 90\n |  | 6 | the line #intheta is missing before this row
        PAB | 30 90 | 30 x | 4 | allowed are two numbers of degrees
        PAB | 270 0.25 | 270 | 7 | 2 cells where the header asks for 3
        PAB | 0 0 1\n | 0 0 1 1\n | 8 | 4 cells where the header asks for 3
        PAB | file\t3 | file\t2 | 6 | #datapoints_in_file 2: 3 rows are there
        PAB | file\t3 | file\t4 | - | #datapoints_in_file 4: 3 rows are there; --partial reads up to the cut
        PAB | 0.25 | 1e400 | 7 | 1e400: allowed is a finite number
        ASTM | theta_s | theta_o | 3 | VARS lacks theta_s
        ASTM | 400nm | R | 3 | VARS names the values R,500nm; allowed: R,G,B
        ASTM | 500nm | 300nm | 3 | VARS: wavelengths_nm = 300
        ASTM | POINTS 2 | POINTS two | 2 | NUM_POINTS two: allowed is a whole number
        ASTM | POINTS 2 | POINTS 3 | - | NUM_POINTS 3: 2 rows are there; --partial reads up to the cut
        ASTM | 3.1,1.5,2.5 | 3.1,1.5 | 4 | 5 cells where VARS names 6"#,
    ) {
        let text = if text == "PAB" { PAB } else { ASTM };
        let read = try_read(&edited(text, old, new), Conventions::default());
        refused(read, line, part);
    }
    // Light below the horizon is passed over.
    assert_eq!(read(&edited(ASTM, "0.5,0,", "2,0,")).notes.len(), 1);
    for (text, what) in [(PAB, "pab-opto text"), (ASTM, "ASTM text")] {
        let read = try_read(text, conventions("elevation"));
        refused(read, "-", &format!("--elevation: the header of {what}"));
    }
}

/// A light whose rows are not all there, or not at all, before another one.
#[test]
fn each_light_has_the_rows_that_it_promises() {
    let cut = PAB.replace("file\t3", "file\t4");
    let none = &PAB[..PAB.find("60 270").unwrap()];
    for (first, rows) in [(&cut[..], 3), (none, 0)] {
        let text = format!("{first}{PAB}");
        let strict = try_read(&text, Conventions::default()).err().unwrap();
        says(&strict.to_string(), &format!(": {rows} rows are there"));
        let partial = try_read(&text, conventions("partial")).unwrap();
        assert_eq!(partial.measurement.readings(), 2);
    }
}

#[test]
fn conventions_of_the_command_line_are_for_them_too() {
    for (text, value) in [(PAB, 0.25), (ASTM, 1.5)] {
        let [plain, other] = ["", "azimuth=mirror quantity=percent"]
            .map(|words| super::read(text, words).measurement);
        near(other.values[0] * 100.0 * PI, value, 1e-12, text);
        let phi = |m: &Measurement| {
            let pair = m.schedule.poses[0].pair;
            pair.omega_o.phi() - pair.omega_i.phi()
        };
        // The azimuth is counted from that of the mirror direction, not from 0.
        let mirror = plain.schedule.poses[0].pair.omega_i.phi() + PI;
        let off = phi(&other) - phi(&plain) - mirror;
        near((off + PI).rem_euclid(TAU), PI, 1e-12, text);
    }
}

#[test]
fn angles_of_astm_are_in_radians_or_said_to_be_degrees() {
    let degrees = "LAB_NAME A\nSAMPLE_NAME \"steel\"\nVARS theta_i,phi_i,theta_s,phi_s,signal\n30,0,2,180,1.5\n30,0,60,10,2\n";
    let astm = READ_READINGS.named("astm").unwrap();
    let astm = READ_READINGS.function(&astm).unwrap();
    let read = |text: &str, angles| {
        let mut assume = Assume::default();
        assume.conventions.angles = angles;
        astm(text, "m.astm", &assume)
    };
    let turns =
        "theta_i = 30: allowed are at most 0.5 turns, in radians, or in degrees with --angles deg";
    refused(read(degrees, None), "4", turns);
    let found = read(degrees, Some(AngleUnit::Degrees)).unwrap();
    let [ti, to] = [30_f64, 2.0].map(f64::to_radians);
    let pair = DirectionPair::from_spherical(ti, 0.0, to, PI);
    let back = &found.measurement.schedule.poses[0].pair;
    let off = distance(back, &pair, Symmetry::NONE);
    near(off, 0.0, 1e-14, "pose");
    assert_eq!(found.about.material.as_deref(), Some("steel"));
    assert_eq!(found.unread, ["LAB_NAME"]);
    // An angle is no value.
    let angles = "signal | theta_i | VARS names the angle theta_i: allowed are
                  signal | theta_t | VARS names the angle theta_t: allowed are";
    refused_edits(degrees, angles, |text| read(text, None));
}
