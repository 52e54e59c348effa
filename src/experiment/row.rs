//! One row of results: plain data, the same fields in the same order in every file format.

use serde::{Deserialize, Serialize};

/// The comparison of one reconstruction with the truth under one measure.
///
/// The fields are the columns of `results.csv` and the keys of `results.jsonl`. An error that has
/// no value (no pair to compare) is empty in the one and `null` in the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Name of the material.
    pub material: String,
    /// Name of the parametrization the sample set is uniform in.
    pub parametrization: String,
    /// Its warps, `axis:warp` joined by `;`, or `none`.
    pub warp: String,
    /// Name of the sample set.
    pub sample_set: String,
    /// Name of the reconstruction.
    pub reconstruction: String,
    /// Distinct configurations that were allowed.
    pub budget: usize,
    /// Poses that have a reading.
    pub readings: usize,
    /// Seed of the sample set.
    pub seed: u64,
    /// Distribution of the test pairs.
    pub measure: String,
    /// RMS of (g − f) cos over RMS of f cos; f truth, g reconstruction.
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
    /// Mean relative error of the directional albedo; the same for every measure.
    pub albedo: Option<f64>,
    /// Mean relative error of the energy of slices, as the next five if `quantities` asks for it;
    /// the same for every measure. See [`MomentErrors`](crate::moments::MomentErrors).
    pub moment_energy: Option<f64>,
    /// Mean error of their mean direction, rad.
    pub moment_mean_rad: Option<f64>,
    /// The same relative to σ.
    pub moment_mean: Option<f64>,
    /// Mean error of their covariance relative to σ².
    pub moment_covariance: Option<f64>,
    /// Mean error of their co-skewness.
    pub moment_skewness: Option<f64>,
    /// Mean error of their excess co-kurtosis.
    pub moment_kurtosis: Option<f64>,
    /// Slices of truth and reconstruction whose moments did not reach the estimator's tolerance.
    pub moment_unresolved: Option<usize>,
    /// Configurations visited.
    pub poses: usize,
    /// Poses where the material has no data.
    pub no_data: usize,
    /// Share of the points of the box that are no physical configuration.
    pub unphysical_share: f64,
    /// Test pairs compared.
    pub pairs: usize,
    /// Test pairs left out because the truth has no data there.
    pub pairs_missing: usize,
    /// Test pairs left out because the reconstruction has no value there.
    pub pairs_unreconstructed: usize,
    /// Time to make the schedule; it is made once and shared by the rows that use it.
    pub plan_seconds: f64,
    /// Time to measure it; shared by the reconstructions of a measurement.
    pub measure_seconds: f64,
    /// Time to reconstruct; shared by the measures.
    pub reconstruct_seconds: f64,
    /// Time to evaluate the reconstruction at the pairs of this measure and compare, plus the time
    /// of its albedo, which is shared by the measures.
    pub evaluate_seconds: f64,
    /// Time to integrate the moments of the reconstruction; shared by the measures.
    pub moment_seconds: Option<f64>,
}

impl Row {
    /// The columns, in order, and what they mean.
    pub const COLUMNS: [(&str, &str); 34] = [
        ("material", "name of the material"),
        (
            "parametrization",
            "coordinates the sample set is uniform in",
        ),
        ("warp", "their warps, `axis:warp` joined by `;`, or `none`"),
        ("sample_set", "name of the sample set"),
        ("reconstruction", "name of the reconstruction"),
        ("budget", "distinct configurations that were allowed"),
        ("readings", "poses that have a reading"),
        ("seed", "seed of the sample set"),
        ("measure", "distribution of the test pairs"),
        (
            "nrmse",
            "RMS of (g − f) cos over RMS of f cos; f truth, g reconstruction, cos = cos theta_i",
        ),
        ("log_relative", "mean |ln((g + 1e-3)/(f + 1e-3))|"),
        ("log1p", "mean |ln(1 + g cos) − ln(1 + f cos)|"),
        ("cbrt", "RMS of (g cos)^(1/3) − (f cos)^(1/3)"),
        ("mean_relative", "mean of |g − f| / max(f, 1e-3)"),
        ("max_relative", "maximum of |g − f| / max(f, 1e-3)"),
        (
            "albedo",
            "mean relative error of the directional albedo at eight theta_o from 0 to 80°; the same for every measure",
        ),
        (
            "moment_energy",
            "mean over the views of the relative error of the energy of slices; this and the next six with quantities = [\"moments\"], the same for every measure",
        ),
        (
            "moment_mean_rad",
            "mean over the views of the error of the mean direction of slices, the larger of both angles, in radians",
        ),
        ("moment_mean", "the same, each angle relative to its sigma"),
        (
            "moment_covariance",
            "mean over the views of the largest error of a covariance relative to sigma²",
        ),
        (
            "moment_skewness",
            "mean over the views of the largest error of a co-skewness",
        ),
        (
            "moment_kurtosis",
            "mean over the views of the largest error of an excess co-kurtosis",
        ),
        (
            "moment_unresolved",
            "slices of truth and reconstruction whose moments missed the estimator's tolerance",
        ),
        ("poses", "configurations visited"),
        ("no_data", "poses where the material has no data"),
        (
            "unphysical_share",
            "share of the points of the box that are no physical configuration",
        ),
        ("pairs", "test pairs compared"),
        (
            "pairs_missing",
            "test pairs left out because the truth has no data there",
        ),
        (
            "pairs_unreconstructed",
            "test pairs left out because the reconstruction has no value there",
        ),
        (
            "plan_seconds",
            "wall time to make the schedule; made once and shared by the rows that use it",
        ),
        (
            "measure_seconds",
            "wall time to measure; shared by the reconstructions of a measurement",
        ),
        (
            "reconstruct_seconds",
            "wall time to reconstruct; shared by the measures",
        ),
        (
            "evaluate_seconds",
            "wall time to evaluate at the pairs of this measure and compare, plus that of the albedo, which the measures share",
        ),
        (
            "moment_seconds",
            "wall time to integrate the moments of the reconstruction; shared by the measures",
        ),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_fields() {
        let columns = Row::COLUMNS.map(|(name, _)| name);
        let object = columns.map(|name| match name {
            "material" | "parametrization" | "warp" | "sample_set" | "reconstruction"
            | "measure" => format!("\"{name}\":\"\""),
            _ => format!("\"{name}\":1"),
        });
        let text = format!("{{{}}}", object.join(","));
        let row: Row = serde_json::from_str(&text).unwrap();
        let value = serde_json::to_value(&row).unwrap();
        let fields: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
        assert_eq!(fields, columns);
    }
}
