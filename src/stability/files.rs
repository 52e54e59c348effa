//! Files: what is written is read back, whatever the numbers.

use super::cases::{Case, pairs_above, schedule_of};
use super::{Check, Extent, Family, Finding, Law, ROUNDING};
use crate::brdf::Channels;
use crate::formats;
use crate::geometry::{Symmetry, distance};
use crate::measurement::{About, Measurement, Outcome};
use crate::numeric::GRAZING_COS;
use crate::schedule::{Assume, Pose, Schedule, Sequence};

pub(super) const FAMILY: Family = Family {
    name: "files",
    summary: "poses and readings of extreme pairs and values, written and read back in every format of text",
    checks,
};

const POSES: Law = Law::bounded("poses that come back", "rad", 16.0);
const READINGS: Law = Law::bounded("readings that come back", "relative", 8.0);
const OTHERS: Law = Law::strict("a text that is cut or spoilt is refused with a reason, or read");

/// Extreme pairs at least so far apart, rad: files may put repeated poses together.
fn cases(extent: Extent, apart: f64) -> Vec<Case> {
    let mut kept: Vec<Case> = Vec::new();
    for case in extent.subset(pairs_above(GRAZING_COS), 5) {
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

fn measured(cases: &[Case]) -> Measurement {
    let poses = cases.len();
    Measurement {
        schedule: schedule_of(cases, Symmetry::NONE),
        channels: Channels::Luminance,
        values: (0..poses).map(value).collect(),
        outcomes: vec![Outcome::Reading; poses],
        details: None,
        places: Vec::new(),
        half_angles_deg: [0.0; 2],
    }
}

/// What spoils a text: each of the first is replaced by the second.
const SPOILT: [(&str, &str); 6] = [
    ("1", "NaN"),
    ("1", "inf"),
    ("1", "-1e400"),
    (",", ";"),
    ("\n", "\r\n"),
    ("e", ""),
];

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for format in formats::all() {
        let name = format.name;
        if let (Some(write), Some(read)) = (format.write_schedule, format.read_schedule) {
            let back = move |schedule: &Schedule| {
                let mut bytes = Vec::new();
                write(schedule, Sequence::Generated, &mut bytes).ok()?;
                let text = format.text_of(bytes)?;
                Some(read(&text, "poses", &Assume::default()).ok()?.schedule)
            };
            let run = move |watch: &mut Finding| {
                let cases = cases(extent, APART[0]);
                let back = back(&schedule_of(&cases, Symmetry::NONE));
                let back = back.map_or(Vec::new(), |schedule| schedule.poses);
                watch.spent(cases.len());
                for (k, Case { name, pair }) in cases.iter().enumerate() {
                    let off = |pose: &Pose| distance(&pose.pair, pair, Symmetry::NONE);
                    let off = back.get(k).map_or(f64::INFINITY, off);
                    watch.see(off, ROUNDING, name);
                }
            };
            checks.push(Check::new(format!("{name}, poses"), POSES, run));
        }
        if let (Some(write), Some(read)) = (format.write_readings, format.read_readings) {
            let text = move |measured: &Measurement| {
                let mut bytes = Vec::new();
                write(measured, &About::default(), Sequence::Generated, &mut bytes).ok()?;
                format.text_of(bytes)
            };
            let run = move |watch: &mut Finding| {
                let measured = measured(&cases(extent, APART[1]));
                let back = text(&measured).map(|t| read(&t, "readings", &Assume::default()));
                let back = match back {
                    Some(Ok(back)) => back.measurement.values,
                    _ => Vec::new(),
                };
                watch.spent(measured.values.len());
                for (k, want) in measured.values.iter().enumerate() {
                    let off = back.get(k).map_or(f64::INFINITY, |v| (v - want).abs());
                    let conditioning = ROUNDING * want.max(f64::MIN_POSITIVE);
                    watch.see(off, conditioning, &format_args!("{want:e}"));
                }
            };
            checks.push(Check::new(format!("{name}, readings"), READINGS, run));
            let run = move |watch: &mut Finding| {
                let cases = extent.subset(cases(Extent::Short, APART[0]), 9);
                let Some(whole) = text(&measured(&cases)) else {
                    return;
                };
                let ends = (0..=whole.len()).filter(|&end| whole.is_char_boundary(end));
                for end in extent.subset(ends.collect(), 17) {
                    spoilt(&whole[..end], read, watch);
                }
                for (old, new) in SPOILT {
                    spoilt(&whole.replace(old, new), read, watch);
                }
            };
            checks.push(Check::new(format!("{name}, spoilt"), OTHERS, run));
        }
    }
    checks
}

/// What is read must be finite.
fn spoilt(text: &str, read: formats::ReadReadings, watch: &mut Finding) {
    watch.spent(1);
    let holds = match read(text, "readings", &Assume::default()) {
        Ok(read) => read.measurement.values.iter().all(|v| v.is_finite()),
        Err(reason) => !reason.to_string().is_empty(),
    };
    watch.holds(holds, &format_args!("{} bytes", text.len()));
}
