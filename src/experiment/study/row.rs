//! A line of the results of a study.

use super::plan::{Choice, Label};
use crate::experiment::row::Row;
use serde::{Deserialize, Serialize};

/// The hash of everything that determines a row, 16 hexadecimal digits.
pub type RowKey = String;

/// One reconstruction of one material, compared with it under one measure. A cell is empty (JSON:
/// null) where a quantity is not defined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyRow {
    /// Hash of everything that determines this row.
    pub key: RowKey,
    /// Name of the material.
    pub material: String,
    /// Hash of what it is: its keys and the bytes of its files.
    pub material_key: RowKey,
    /// What its truth is aligned with, or a table in; what it may favour.
    pub truth: String,
    /// Its alignment q: the width of the lobe in theta_h goes as (cos theta_d)^−q.
    pub alignment: Option<f64>,
    /// Coordinates the sample set is uniform in.
    pub parametrization: String,
    /// Their warps, `axis:warp` joined by `;`, or `none`.
    pub warp: String,
    /// Name of the sample set.
    pub sample_set: String,
    /// Name of the instrument.
    pub instrument: String,
    /// Name of the reconstruction.
    pub reconstruction: String,
    /// Coordinates it works in; `own`: those of the sample set.
    pub coordinates: String,
    /// What the schedule was allowed.
    pub allowed: String,
    /// Distinct configurations that were allowed, or found.
    pub budget: usize,
    /// Poses that have a reading.
    pub readings: usize,
    /// Seed.
    pub seed: u64,
    /// Distribution of the test pairs.
    pub measure: String,
    /// RMS of (g − f) cos over RMS of f cos.
    pub nrmse: Option<f64>,
    /// Mean |ln((g + 1e-3)/(f + 1e-3))|.
    pub log_relative: Option<f64>,
    /// Mean |ln(1 + g cos) − ln(1 + f cos)|.
    pub log1p: Option<f64>,
    /// RMS of (g cos)^(1/3) − (f cos)^(1/3).
    pub cbrt: Option<f64>,
    /// Mean of |g − f| / max(f, 1e-3).
    pub mean_relative: Option<f64>,
    /// Maximum of |g − f| / max(f, 1e-3).
    pub max_relative: Option<f64>,
    /// Share of the poses the instrument can take.
    pub reachable: f64,
    /// Time the instrument takes for the schedule; the ideal one takes none.
    pub instrument_seconds: Option<f64>,
    /// Share of the points of the box that are no physical configuration.
    pub unphysical_share: f64,
    /// Test pairs compared.
    pub pairs: usize,
    /// Test pairs left out because the truth has no data there.
    pub pairs_missing: usize,
    /// Wall time to make the schedule and the instrument's way through it.
    pub plan_seconds: f64,
    /// Wall time to measure the material.
    pub measure_seconds: f64,
    /// This material's share of the wall time to reconstruct the stack.
    pub reconstruct_seconds: f64,
    /// This material's share of the wall time to evaluate and compare the stack.
    pub evaluate_seconds: f64,
}

impl StudyRow {
    /// The columns, in order, and what they mean.
    pub const COLUMNS: [(&str, &str); 31] = [
        ("key", "hash of everything that determines the row"),
        of_acquisition("material"),
        (
            "material_key",
            "hash of what it is: its keys and the bytes of its files",
        ),
        (
            "truth",
            "what the truth is aligned with or a table in, and may favour: theta_h, h_bar, neither, half-difference table, spherical table; anisotropic ones say so",
        ),
        (
            "alignment",
            "measured alignment q of the lobe, whose width in theta_h goes as (cos theta_d)^-q: 0 is theta_h, 1 is |h_bar|; empty without a lobe",
        ),
        of_acquisition("parametrization"),
        of_acquisition("warp"),
        of_acquisition("sample_set"),
        of_acquisition("instrument"),
        of_acquisition("reconstruction"),
        (
            "coordinates",
            "coordinates it works in; own: those of the sample set",
        ),
        of_acquisition("allowed"),
        of_acquisition("budget"),
        of_acquisition("readings"),
        of_acquisition("seed"),
        of_acquisition("measure"),
        of_acquisition("nrmse"),
        of_acquisition("log_relative"),
        of_acquisition("log1p"),
        of_acquisition("cbrt"),
        of_acquisition("mean_relative"),
        of_acquisition("max_relative"),
        of_acquisition("reachable"),
        of_acquisition("instrument_seconds"),
        of_acquisition("unphysical_share"),
        of_acquisition("pairs"),
        of_acquisition("pairs_missing"),
        (
            "plan_seconds",
            "wall time to make the schedule and the instrument's way through it, made once for all materials",
        ),
        ("measure_seconds", "wall time to measure the material"),
        (
            "reconstruct_seconds",
            "wall time to reconstruct the stack, over the number of its materials",
        ),
        (
            "evaluate_seconds",
            "wall time to evaluate and compare the stack, over the number of its materials; shared by the measures",
        ),
    ];

    /// Everything but material, measure, allowance and seed.
    pub fn choice(&self) -> Choice {
        Choice {
            parametrization: self.parametrization.clone(),
            warp: self.warp.clone(),
            sample_set: self.sample_set.clone(),
            instrument: self.instrument.clone(),
            reconstruction: self.reconstruction.clone(),
            coordinates: self.coordinates.clone(),
        }
    }

    /// What it is of.
    pub fn label(&self) -> Label {
        Label {
            material: self.material.clone(),
            choice: self.choice(),
            allowed: self.allowed.clone(),
            seed: self.seed,
            measure: self.measure.clone(),
        }
    }

    /// Seconds of computing behind this row: measuring (where that is simulated), reconstructing,
    /// evaluating.
    pub fn seconds(&self) -> f64 {
        self.measure_seconds + self.reconstruct_seconds + self.evaluate_seconds
    }
}

/// A column that means what it means in an acquisition, found by its name while compiling.
const fn of_acquisition(name: &str) -> (&'static str, &'static str) {
    let mut i = 0;
    while i < Row::COLUMNS.len() {
        let column = Row::COLUMNS[i];
        if same(column.0.as_bytes(), name.as_bytes()) {
            return column;
        }
        i += 1;
    }
    panic!("an acquisition has no such column")
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_fields() {
        let columns = StudyRow::COLUMNS.map(|(name, _)| name);
        let object = columns.map(|name| match name {
            "key" | "material" | "material_key" | "truth" | "parametrization" | "warp"
            | "sample_set" | "instrument" | "reconstruction" | "coordinates" | "allowed"
            | "measure" => format!("\"{name}\":\"\""),
            _ => format!("\"{name}\":1"),
        });
        let text = format!("{{{}}}", object.join(","));
        let row: StudyRow = serde_json::from_str(&text).unwrap();
        let value = serde_json::to_value(&row).unwrap();
        let fields: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
        assert_eq!(fields, columns);
    }
}
