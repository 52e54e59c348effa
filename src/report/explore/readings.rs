//! Readings as the page holds them, with what the others let expect of each.

use super::packed::Parts;
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::reconstruct::{
    EPSILON, Kriging, LeftOut, Readings, Reconstruct, ReconstructError, Replicated, ThinPlate,
    noise, present, suspects, values_at,
};
use serde_json::{Value as Json, json};

/// The most readings that a page holds; of more every n-th.
pub const MOST: usize = 5000;

/// Wavelengths of a reading that a page holds.
const SPECTRUM: usize = 64;

/// As many readings as are each predicted from all others by kriging.
const LEFT_OUT_ONE_BY_ONE: usize = 2000;

/// Of more nothing is expected: it would take minutes.
const MOST_LEFT_OUT: usize = 100_000;

/// Parts that more readings are left out in.
const PARTS: usize = 10;

/// What others let expect of a reading: luminance and its standard uncertainty, 0 if unknown; NaN: nothing.
type Expectations = Vec<[f64; 2]>;

/// Facts of readings, and their columns. `visit` has the place of each pose on a tour.
pub(super) fn facts(
    name: &str,
    measurement: &Measurement,
    visit: Option<&[u32]>,
    parts: &Parts,
) -> Result<Json, ReconstructError> {
    let read = present(measurement);
    let all: Vec<usize> = (0..read.len()).filter(|&i| read[i]).collect();
    let every = all.len().div_ceil(MOST).max(1);
    let shown: Vec<usize> = all.iter().copied().step_by(every).collect();
    let n = measurement.channels.count();
    let spectrum: Vec<usize> = match n {
        1 => Vec::new(),
        n => (0..n).step_by(n.div_ceil(SPECTRUM)).collect(),
    };
    // What is simulated needs no check.
    let (mut expected, mut by, mut suspected) = (vec![[f64::NAN, 0.0]; read.len()], "", Vec::new());
    if visit.is_none() {
        (expected, by) = expectations(measurement, &read)?;
        suspected = suspects(measurement);
    }
    let mut columns = Vec::new();
    for &pose in &shown {
        let DirectionPair { omega_i, omega_o } = measurement.schedule.poses[pose].pair;
        let values = measurement.value(pose).unwrap_or_default();
        let luminance = measurement.channels.luminance(values);
        let is_suspected = suspected.iter().any(|s| s.pose == pose);
        let line = measurement.places.get(pose).map_or(0, |place| place.line);
        let place = visit.map_or(0, |visit| visit[pose]);
        columns.extend(omega_i.vector().to_array());
        columns.extend(omega_o.vector().to_array());
        columns.extend([luminance, uncertainty(measurement, pose)]);
        columns.extend(expected[pose]);
        columns.extend([
            f64::from(u8::from(is_suspected)),
            line as f64,
            f64::from(place),
        ]);
        columns.extend(spectrum.iter().map(|&c| values[c]));
    }
    let mut notes = Vec::new();
    if every > 1 {
        let [shown, all] = [shown.len(), all.len()];
        notes.push(format!("{shown} of {all} readings, every {every}th"));
    }
    if !by.is_empty() {
        notes.push(format!("expectations {by}"));
    }
    let names = spectrum.iter();
    let names = names.filter_map(|&c| measurement.channels.name(c));
    parts.add_numbers("readings", columns);
    Ok(json!({
        "name": name,
        "note": notes.join("; "),
        "columns": 13 + spectrum.len(),
        "blob": "readings",
        "channels": names.collect::<Vec<_>>(),
        "isotropic": measurement.schedule.parametrization.symmetry().isotropic,
    }))
}

/// Standard uncertainty of a reading's luminance (sr⁻¹), as if what its channels err by were alike; 0: unknown.
fn uncertainty(measurement: &Measurement, pose: usize) -> f64 {
    let channels = &measurement.channels;
    let at = channels.count() * pose..channels.count() * (pose + 1);
    let of = |all: &[f64]| channels.luminance(&all[at.clone()]);
    let details = measurement.details.as_ref();
    details.map_or(0.0, |d| of(&d.type_a).hypot(of(&d.type_b)))
}

/// What the other readings let expect of each, and by which method.
fn expectations(
    measurement: &Measurement,
    read: &[bool],
) -> Result<(Expectations, &'static str), ReconstructError> {
    let noise = noise(measurement);
    let readings = Readings::new(measurement, read, noise.as_deref());
    let mut all = vec![[f64::NAN, 0.0]; read.len()];
    let luminance = |values: &[f64]| measurement.channels.luminance(values);
    let n = measurement.channels.count();
    let taken: Vec<usize> = (0..read.len()).filter(|&i| read[i]).collect();
    if !(3..=MOST_LEFT_OUT).contains(&taken.len()) {
        return Ok((all, ""));
    }
    if taken.len() <= LEFT_OUT_ONE_BY_ONE {
        let without = |&pose: &usize| {
            let mut present = read.to_vec();
            present[pose] = false;
            let poses = vec![pose];
            LeftOut { present, poses }
        };
        let sets: Vec<LeftOut> = taken.iter().map(without).collect();
        let found = Kriging::default().leave_out(&readings, &sets)?;
        for (set, found) in sets.iter().zip(found.iter().flatten()) {
            let value = luminance(&found.values[..n]);
            let u = (value + EPSILON) * found.variances[0].max(0.0).sqrt();
            all[set.poses[0]] = [value, u];
        }
        return Ok((all, "by kriging from all others"));
    }
    for part in 0..PARTS {
        let left: Vec<usize> = taken.iter().copied().skip(part).step_by(PARTS).collect();
        let mut present = read.to_vec();
        for &pose in &left {
            present[pose] = false;
        }
        let others = Readings {
            present: &present,
            ..readings
        };
        let made = ThinPlate::default().interpolate(&others)?;
        let poses = &measurement.schedule.poses;
        let pairs = left.iter().map(|&pose| poses[pose].pair);
        let values = values_at(&*made, &pairs.collect::<Vec<_>>());
        for (pose, values) in left.into_iter().zip(values.chunks_exact(n)) {
            all[pose] = [luminance(values), 0.0];
        }
    }
    Ok((all, "by a thin plate from nine tenths of the others"))
}

/// Cells of the table of uncertainties.
const CELLS: [usize; 3] = [30, 20, 20];

/// The relative standard uncertainty of luminance over half and difference angles; `None` where a reconstruction has none.
pub(super) fn uncertainties(
    replicated: &Replicated,
    symmetry: Symmetry,
    parts: &Parts,
) -> Option<Json> {
    if !symmetry.isotropic || !symmetry.reciprocal {
        return None;
    }
    let [n_h, n_d, n_phi] = CELLS;
    let cells = (0..n_h * n_d * n_phi).map(|i| [i / n_phi / n_d, i / n_phi % n_d, i % n_phi]);
    let nodes = cells.map(|cell| super::table::node(&CELLS, symmetry, &cell));
    let nodes: Vec<Option<DirectionPair>> = nodes.collect();
    let pairs: Vec<DirectionPair> = nodes.iter().flatten().copied().collect();
    let mut found = replicated.luminance_at(&pairs).into_iter();
    let share = |node: &Option<DirectionPair>| {
        let u = node.as_ref().and_then(|_| found.next());
        let u = u.filter(|u| u.value > 0.0);
        u.map_or(f64::NAN, |u| u.uncertainty() / u.value)
    };
    let shares: Vec<f64> = nodes.iter().map(share).collect();
    let [low, step] = parts.add_values("uncertainty", &shares, 1);
    Some(json!({"dims": CELLS, "blob": "uncertainty", "step": step, "low": low}))
}
