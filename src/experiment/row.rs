//! One row of results: plain data, the same fields in the same order in every file format.

use super::observer::ScheduleKey;
use super::readings::Facts;
use crate::metrics::Errors;
use crate::moments::MomentErrors;
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
    /// Name of the instrument; `ideal` has no flaws.
    pub instrument: String,
    /// Distinct configurations that were allowed.
    pub budget: usize,
    /// What the schedule was allowed, by which the budget was found: `1000 poses` (the budget
    /// itself), `1000 readings` or `60 minutes`.
    pub allowed: String,
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
    /// Share of the poses that the instrument can take.
    pub reachable: f64,
    /// Why it cannot take the others: `reason:count` joined by `;`.
    pub unreachable: String,
    /// Readings at full scale: lower bounds.
    pub saturated: usize,
    /// Readings below their noise (k = 2).
    pub below_noise: usize,
    /// `nrmse` less that of the same schedule on the same instrument without limits; 0 if every
    /// pose is reachable, empty if it was not asked for.
    pub hole_nrmse: Option<f64>,
    /// The same of `log_relative`.
    pub hole_log_relative: Option<f64>,
    /// Time the instrument takes for the schedule; the ideal one takes none.
    pub instrument_seconds: Option<f64>,
    /// Share of the points of the box that are no physical configuration.
    pub unphysical_share: f64,
    /// Test pairs compared.
    pub pairs: usize,
    /// Test pairs left out because the truth has no data there.
    pub pairs_missing: usize,
    /// Test pairs left out because the reconstruction has no value there.
    pub pairs_unreconstructed: usize,
    /// Time to make the schedule and an instrument's way through it; it is made once and shared by the rows that use it.
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

/// What rows call the instrument without flaws.
pub const IDEAL: &str = "ideal";

/// A reconstruction compared with the truth under one measure.
pub(super) struct Comparison {
    pub errors: Errors,
    /// Errors of the same without limits, if they are known.
    pub whole: Option<Errors>,
    pub albedo: Option<f64>,
    /// With the number of slices that are unresolved.
    pub moments: Option<(MomentErrors, usize)>,
    pub reconstruct_seconds: f64,
    pub evaluate_seconds: f64,
    pub moment_seconds: Option<f64>,
}

/// Times that the reconstructions of a schedule share.
#[derive(Clone, Copy)]
pub(super) struct Times {
    pub plan: f64,
    pub measure: f64,
}

impl Row {
    pub(super) fn new(
        material: &str,
        key: &ScheduleKey<'_>,
        reconstruction: &str,
        measure: &str,
        facts: &Facts,
        comparison: Comparison,
        shared: Times,
    ) -> Self {
        let Comparison { errors, whole, .. } = comparison;
        let moments = comparison.moments.map(|(m, _)| m).unwrap_or_default();
        let more = |of: fn(&Errors) -> Option<f64>| Some(of(&errors)? - of(whole.as_ref()?)?);
        Self {
            material: material.into(),
            parametrization: key.coordinates.name().into(),
            warp: key.coordinates.warp.clone(),
            sample_set: key.sample_set.name.clone(),
            reconstruction: reconstruction.into(),
            instrument: key.instrument.map_or(IDEAL, |i| i.name.as_str()).into(),
            budget: key.budget,
            allowed: key.allowance.to_string(),
            readings: facts.readings,
            seed: key.seed,
            measure: measure.into(),
            nrmse: errors.nrmse,
            log_relative: errors.log_relative,
            log1p: errors.log1p,
            cbrt: errors.cbrt,
            mean_relative: errors.mean_relative,
            max_relative: errors.max_relative,
            albedo: comparison.albedo,
            moment_energy: moments.energy,
            moment_mean_rad: moments.mean,
            moment_mean: moments.mean_relative,
            moment_covariance: moments.covariance,
            moment_skewness: moments.skewness,
            moment_kurtosis: moments.kurtosis,
            moment_unresolved: comparison.moments.map(|(_, unresolved)| unresolved),
            poses: facts.poses,
            no_data: facts.no_data,
            reachable: facts.reachable,
            unreachable: facts.unreachable.clone(),
            saturated: facts.saturated,
            below_noise: facts.below_noise,
            hole_nrmse: more(|e| e.nrmse),
            hole_log_relative: more(|e| e.log_relative),
            instrument_seconds: facts.instrument_seconds,
            unphysical_share: facts.unphysical_share,
            pairs: errors.pairs,
            pairs_missing: errors.pairs_missing,
            pairs_unreconstructed: errors.pairs_unreconstructed,
            plan_seconds: shared.plan,
            measure_seconds: shared.measure,
            reconstruct_seconds: comparison.reconstruct_seconds,
            evaluate_seconds: comparison.evaluate_seconds,
            moment_seconds: comparison.moment_seconds,
        }
    }

    /// The columns, in order, and what they mean.
    pub const COLUMNS: [(&str, &str); 43] = [
        ("material", "name of the material"),
        (
            "parametrization",
            "coordinates the sample set is uniform in",
        ),
        ("warp", "their warps, `axis:warp` joined by `;`, or `none`"),
        ("sample_set", "name of the sample set"),
        ("reconstruction", "name of the reconstruction"),
        ("instrument", "name of the instrument; ideal has no flaws"),
        (
            "budget",
            "distinct configurations that were allowed, or found for the readings or minutes that were",
        ),
        (
            "allowed",
            "what the schedule was allowed: N poses (the budget itself), N readings or M minutes",
        ),
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
        ("reachable", "share of the poses the instrument can take"),
        (
            "unreachable",
            "why it cannot take the others, `reason:count` joined by `;`",
        ),
        ("saturated", "readings at full scale: lower bounds"),
        ("below_noise", "readings below their noise (k = 2)"),
        (
            "hole_nrmse",
            "nrmse less that of the same schedule on the same instrument without limits",
        ),
        ("hole_log_relative", "the same of log_relative"),
        (
            "instrument_seconds",
            "time the instrument takes for the schedule: moves, settling, exposures, overhead, calibrations",
        ),
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
            "wall time to make the schedule and, for an instrument, its way through it; made once and shared by the rows that use it",
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
            | "measure" | "instrument" | "allowed" | "unreachable" => format!("\"{name}\":\"\""),
            _ => format!("\"{name}\":1"),
        });
        let text = format!("{{{}}}", object.join(","));
        let row: Row = serde_json::from_str(&text).unwrap();
        let value = serde_json::to_value(&row).unwrap();
        let fields: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
        assert_eq!(fields, columns);
    }
}
