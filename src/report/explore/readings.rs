//! Readings as the page holds them, with what the others let expect of each.

use super::packed::{Coded, Parts};
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
    let (expected, by) = match visit {
        // What is simulated needs no check.
        Some(_) => (vec![[f64::NAN, 0.0]; read.len()], ""),
        None => expectations(measurement, &read)?,
    };
    let suspected = match visit {
        Some(_) => Vec::new(),
        None => suspects(measurement),
    };
    let mut columns = Vec::new();
    for &pose in &shown {
        let DirectionPair { omega_i, omega_o } = measurement.schedule.poses[pose].pair;
        let values = measurement.value(pose).unwrap_or_default();
        columns.extend(omega_i.vector().to_array());
        columns.extend(omega_o.vector().to_array());
        columns.push(measurement.channels.luminance(values));
        columns.push(uncertainty(measurement, pose));
        columns.extend(expected[pose]);
        columns.push(f64::from(u8::from(
            suspected.iter().any(|s| s.pose == pose),
        )));
        columns.push(
            measurement
                .places
                .get(pose)
                .map_or(0.0, |place| place.line as f64),
        );
        columns.push(visit.map_or(0.0, |visit| f64::from(visit[pose])));
        columns.extend(spectrum.iter().map(|&c| values[c]));
    }
    let mut note = match every {
        1 => String::new(),
        _ => format!("{} of {} readings, every {every}th", shown.len(), all.len()),
    };
    if !by.is_empty() {
        note += &format!(
            "{}expectations {by}",
            if note.is_empty() { "" } else { "; " }
        );
    }
    let names: Vec<String> = match measurement.channels.wavelengths() {
        Some(all) => spectrum
            .iter()
            .map(|&c| format!("{} nm", all.nm()[c]))
            .collect(),
        None => spectrum
            .iter()
            .map(|&c| ["R", "G", "B"][c].into())
            .collect(),
    };
    Ok(json!({
        "name": name,
        "note": note,
        "columns": 13 + spectrum.len(),
        "blob": parts.add_numbers("readings", columns),
        "channels": names,
        "isotropic": measurement.schedule.parametrization.symmetry().isotropic,
    }))
}

/// Standard uncertainty of a reading's luminance (sr⁻¹), as if what its channels err by were alike; 0: unknown.
fn uncertainty(measurement: &Measurement, pose: usize) -> f64 {
    let n = measurement.channels.count();
    let of = |all: &[f64]| {
        measurement
            .channels
            .luminance(&all[n * pose..n * (pose + 1)])
    };
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
        let without = |pose: usize| {
            let mut present = read.to_vec();
            present[pose] = false;
            let poses = vec![pose];
            LeftOut { present, poses }
        };
        let sets: Vec<LeftOut> = taken.iter().map(|&pose| without(pose)).collect();
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
        let pairs = left
            .iter()
            .map(|&pose| measurement.schedule.poses[pose].pair);
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
        node.as_ref()?;
        let u = found.next()?;
        (u.value > 0.0).then(|| u.uncertainty() / u.value)
    };
    let shares: Vec<f64> = nodes
        .iter()
        .map(share)
        .map(|u| u.unwrap_or(f64::NAN))
        .collect();
    let coded = Coded::new(&shares);
    let blob = parts.add("uncertainty", &coded.differences(1));
    Some(json!({"dims": CELLS, "blob": blob, "step": coded.step, "low": coded.low}))
}
