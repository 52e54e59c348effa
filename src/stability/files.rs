//! Files: what is written is read back, whatever the numbers.

use super::cases::{Case, pairs_above};
use super::{Check, Extent, Family, Law, ROUNDING, Watch};
use crate::formats;
use crate::geometry::{Symmetry, distance};
use crate::measurement::{About, Measurement, Outcome};
use crate::numeric::GRAZING_COS;
use crate::parametrization;
use crate::schedule::{Assume, Pose, Schedule, Sequence};
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "files",
    summary: "poses and readings of extreme pairs and values, written and read back in every format of text",
    checks,
};

const POSES: Law = Law {
    name: "poses that come back",
    unit: "rad",
    allowed: 16.0,
};
const READINGS: Law = Law {
    name: "readings that come back",
    unit: "relative",
    allowed: 8.0,
};
const OTHERS: Law = Law::strict("a text that is cut or spoilt is refused with a reason, or read");

fn schedule(cases: &[Case]) -> Option<Arc<Schedule>> {
    let form = parametrization::find("half-difference")?.form(Symmetry::NONE);
    let pose = |case: &Case| Pose {
        coords: form.forward(&case.pair),
        pair: case.pair,
    };
    Some(Arc::new(Schedule {
        sample_set: "extremes".into(),
        poses: cases.iter().map(pose).collect(),
        lattice: None,
        unphysical_share: 0.0,
        assumes: None,
        parametrization: form,
    }))
}

/// Extreme pairs at least so far apart, rad: files may put repeated poses together.
fn cases(extent: Extent, apart: f64) -> Vec<Case> {
    let mut kept: Vec<Case> = Vec::new();
    for case in extent.of(pairs_above(GRAZING_COS), 5) {
        let near = |k: &Case| distance(&k.pair, &case.pair, Symmetry::NONE) < apart;
        if !kept.iter().any(near) {
            kept.push(case);
        }
    }
    kept
}

/// Beyond rounding; beyond what encoders err by.
const APART: [f64; 2] = [1e-8, 1e-3];

/// Values over the decades that a reading may have, and 0.
fn value(k: usize) -> f64 {
    const VALUES: [f64; 8] = [0.0, 1e-300, 1e-30, 0.1, 1.0 / 3.0, 1e12, 1e149, 5e-324];
    VALUES[k % VALUES.len()]
}

fn measured(schedule: &Arc<Schedule>) -> Measurement {
    let poses = schedule.poses.len();
    Measurement {
        schedule: Arc::clone(schedule),
        channels: crate::brdf::Channels::Luminance,
        values: (0..poses).map(value).collect(),
        outcomes: vec![Outcome::Reading; poses],
        details: None,
        places: Vec::new(),
        half_angles_deg: [0.0; 2],
    }
}

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for format in formats::all() {
        if let (Some(write), Some(read)) = (format.write_schedule, format.read_schedule) {
            let text = move |schedule: &Schedule| {
                let mut bytes = Vec::new();
                write(schedule, Sequence::Generated, &mut bytes).ok()?;
                format.text_of(bytes)
            };
            checks.push(Check::new(
                format!("{}, poses", format.name),
                POSES,
                move |watch| {
                    let cases = cases(extent, APART[0]);
                    let Some(schedule) = schedule(&cases) else {
                        return;
                    };
                    let back =
                        text(&schedule).and_then(|t| read(&t, "poses", &Assume::default()).ok());
                    watch.spent(cases.len());
                    let back = back.map_or(Vec::new(), |file| file.schedule.poses);
                    for (k, case) in cases.iter().enumerate() {
                        let off = back.get(k).map_or(f64::INFINITY, |pose| {
                            distance(&pose.pair, &case.pair, Symmetry::NONE)
                        });
                        watch.see(off, ROUNDING, &case.name);
                    }
                },
            ));
        }
        if let (Some(write), Some(read)) = (format.write_readings, format.read_readings) {
            let text = move |measured: &Measurement| {
                let mut bytes = Vec::new();
                write(measured, &About::default(), Sequence::Generated, &mut bytes).ok()?;
                format.text_of(bytes)
            };
            checks.push(Check::new(
                format!("{}, readings", format.name),
                READINGS,
                move |watch| {
                    let Some(schedule) = schedule(&cases(extent, APART[1])) else {
                        return;
                    };
                    let measured = measured(&schedule);
                    let back = text(&measured).map(|t| read(&t, "readings", &Assume::default()));
                    watch.spent(measured.values.len());
                    let back = match back {
                        Some(Ok(back)) => back.measurement.values,
                        _ => Vec::new(),
                    };
                    for (k, want) in measured.values.iter().enumerate() {
                        let off = back.get(k).map_or(f64::INFINITY, |v| (v - want).abs());
                        watch.see(
                            off,
                            ROUNDING * want.max(f64::MIN_POSITIVE),
                            &format_args!("{want:e}"),
                        );
                    }
                },
            ));
            checks.push(Check::new(
                format!("{}, spoilt", format.name),
                OTHERS,
                move |watch| {
                    let Some(schedule) = schedule(&extent.of(cases(Extent::Short, APART[0]), 9))
                    else {
                        return;
                    };
                    let Some(whole) = text(&measured(&schedule)) else {
                        return;
                    };
                    let ends = (0..=whole.len()).filter(|&end| whole.is_char_boundary(end));
                    for end in extent.of(ends.collect(), 17) {
                        spoilt(&whole[..end], read, watch);
                    }
                    for (old, new) in [
                        ("1", "NaN"),
                        ("1", "inf"),
                        ("1", "-1e400"),
                        (",", ";"),
                        ("\n", "\r\n"),
                        ("e", ""),
                    ] {
                        spoilt(&whole.replace(old, new), read, watch);
                    }
                },
            ));
        }
    }
    checks
}

/// What is read must be finite.
fn spoilt(text: &str, read: formats::ReadReadings, watch: &mut Watch) {
    watch.spent(1);
    match read(text, "readings", &Assume::default()) {
        Ok(read) => {
            let finite = read.measurement.values.iter().all(|v| v.is_finite());
            watch.holds(finite, &format_args!("{} bytes", text.len()));
        }
        Err(reason) => watch.holds(
            !reason.to_string().is_empty(),
            &format_args!("{} bytes", text.len()),
        ),
    }
}
