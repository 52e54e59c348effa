//! Distortions of materials in parametrizations: rows for programs, tables for people.

use crate::analysis::{Anisotropy, Averaging, Distortion, Scale, Shares, Weight, gradient_shares};
use crate::metrics::Errors;
use crate::parametrization::Axis;
use crate::report::Columns;
use serde::Serialize;
use std::io::{self, Write};

/// Shares of one slice, or of all azimuths.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SharesRow {
    /// Name of the material.
    pub material: String,
    /// Name of the parametrization.
    pub parametrization: &'static str,
    /// `value` or `log`.
    pub scale: &'static str,
    /// `coordinates` or `solid-angle`.
    pub weight: &'static str,
    /// Symbol of the first axis.
    pub first_axis: &'static str,
    /// Symbol of the second axis.
    pub second_axis: &'static str,
    /// Third coordinate of the slice, degrees; `None` for all azimuths.
    pub phi_deg: Option<f64>,
    /// Share of the lattice that is physical and has data.
    pub physical: f64,
    /// Share of the variance that the first axis explains; `None` if there is no variance.
    pub first: Option<f64>,
    /// Share of the variance that the second axis explains.
    pub second: Option<f64>,
    /// Share of the variance that a sum of functions of the two axes explains.
    pub sum: Option<f64>,
    /// Share that a function of both explains over all azimuths; the rest changes with azimuth.
    pub both: Option<f64>,
    /// Share of the energy of the gradient along the first axis.
    pub gradient_first: Option<f64>,
    /// Share along the second axis.
    pub gradient_second: Option<f64>,
    /// Share along the azimuth, over all azimuths.
    pub gradient_phi: Option<f64>,
    /// Mean squared deviation of the slice from the average over all azimuths, in units of the
    /// variance.
    pub deviation: Option<f64>,
}

impl SharesRow {
    /// The rows of a distortion: one per slice, then that of all azimuths.
    pub fn of(
        material: &str,
        parametrization: &'static str,
        axes: &[Axis],
        (scale, weight): (Scale, Weight),
        found: &Distortion,
    ) -> Vec<Self> {
        let row = |phi: Option<f64>, physical: f64, shares: Option<Shares>| Self {
            material: material.into(),
            parametrization,
            scale: scale.name(),
            weight: weight.name(),
            first_axis: axes[0].symbol,
            second_axis: axes[1].symbol,
            phi_deg: phi,
            physical,
            first: shares.map(|s| s.axis[0]),
            second: shares.map(|s| s.axis[1]),
            sum: shares.map(|s| s.additive),
            both: None,
            gradient_first: None,
            gradient_second: None,
            gradient_phi: None,
            deviation: None,
        };
        let slices = found.slices.iter().map(|slice| {
            let gradient = gradient_shares(&slice.gradient);
            Self {
                gradient_first: gradient.map(|g| g[0]),
                gradient_second: gradient.map(|g| g[1]),
                deviation: slice.deviation,
                // Multiples of 30° to the last bit, but for rounding.
                ..row(
                    Some((slice.phi.to_degrees() * 1e9).round() / 1e9),
                    slice.physical,
                    slice.shares,
                )
            }
        });
        let gradient = gradient_shares(&found.gradient);
        let all = Self {
            both: found.shares.map(|s| s.both),
            gradient_first: gradient.map(|g| g[0]),
            gradient_second: gradient.map(|g| g[1]),
            gradient_phi: gradient.map(|g| g[2]),
            ..row(None, found.physical, found.shares)
        };
        slices.chain([all]).collect()
    }
}

/// Errors of the approximation that does not depend on the azimuth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReductionRow {
    /// Name of the material.
    pub material: String,
    /// Name of the parametrization.
    pub parametrization: &'static str,
    /// `uniform`, `solid-angle` or `cosine`.
    pub averaging: &'static str,
    /// `nrmse` against the BRDF.
    pub nrmse: Option<f64>,
    /// `log_relative` against the BRDF.
    pub log_relative: Option<f64>,
    /// `nrmse` of this approximation against the one in half/difference coordinates.
    pub nrmse_from_half_difference: Option<f64>,
    /// `log_relative` of this approximation against the one in half/difference coordinates.
    pub log_relative_from_half_difference: Option<f64>,
}

impl ReductionRow {
    /// The row of an approximation.
    pub fn new(
        material: &str,
        parametrization: &'static str,
        averaging: Averaging,
        errors: &Errors,
        from_half_difference: &Errors,
    ) -> Self {
        Self {
            material: material.into(),
            parametrization,
            averaging: averaging.name(),
            nrmse: errors.nrmse,
            log_relative: errors.log_relative,
            nrmse_from_half_difference: from_half_difference.nrmse,
            log_relative_from_half_difference: from_half_difference.log_relative,
        }
    }
}

/// Stretching of small steps by a parametrization.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StretchRow {
    /// Name of the parametrization.
    pub parametrization: &'static str,
    /// Median condition number.
    pub condition_median: f64,
    /// 95 % of the condition numbers are below it.
    pub condition_p95: f64,
    /// Median relative difference of the product of singular values from the Jacobian.
    pub jacobian_error_median: f64,
    /// Number of pairs.
    pub pairs: usize,
    /// Number of pairs left out.
    pub skipped: usize,
}

impl StretchRow {
    /// The row of a parametrization.
    pub fn new(parametrization: &'static str, found: &Anisotropy) -> Self {
        Self {
            parametrization,
            condition_median: found.condition.median,
            condition_p95: found.condition.p95,
            jacobian_error_median: found.jacobian_error.median,
            pairs: found.pairs,
            skipped: found.skipped,
        }
    }
}

/// Writes rows as CSV, columns named as their fields; undefined values are empty fields.
///
/// # Errors
/// Whatever `out` reports.
pub fn rows_csv<T: Serialize>(rows: &[T], out: &mut impl Write) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    for row in rows {
        csv.serialize(row)?;
    }
    csv.flush()
}

/// Writes rows as a JSON array of objects; undefined values are `null`.
///
/// # Errors
/// Whatever `out` reports.
pub fn rows_json<T: Serialize>(rows: &[T], out: &mut impl Write) -> io::Result<()> {
    for (i, row) in rows.iter().enumerate() {
        out.write_all(if i == 0 { b"[\n" } else { b",\n" })?;
        serde_json::to_writer(&mut *out, row)?;
    }
    out.write_all(if rows.is_empty() { b"[]\n" } else { b"\n]\n" })
}

/// "98.7", in percent.
fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |s| format!("{:.1}", 100.0 * s))
}

/// Shares in percent: a block per material and parametrization, a line per slice.
pub fn shares_table(rows: &[SharesRow]) -> String {
    let mut out = String::new();
    let same = |a: &SharesRow, b: &SharesRow| {
        let key = |r: &SharesRow| (r.parametrization, r.scale, r.weight);
        a.material == b.material && key(a) == key(b)
    };
    for block in rows.chunk_by(same) {
        let Some(first) = block.first() else {
            continue;
        };
        let what = match first.scale {
            "log" => "ln(f + 1e-3)",
            _ => "f",
        };
        let [a, b] = [first.first_axis, first.second_axis];
        out += &format!(
            "{}, {}: percent of the variance of {what}, nodes weighed by {}\n",
            first.material, first.parametrization, first.weight
        );
        let mut columns = Columns::new(&format!(
            ">azimuth\t>{a}\t>{b}\t>sum\t>both\t>gradient along {a}\t>{b}\t>azimuth\t>deviation"
        ));
        for row in block {
            let azimuth = row.phi_deg.map_or("all".into(), |p| format!("{p:.0}°"));
            let shares = [
                row.first,
                row.second,
                row.sum,
                row.both,
                row.gradient_first,
                row.gradient_second,
                row.gradient_phi,
                row.deviation,
            ];
            columns.row(&format!("{azimuth}\t{}", shares.map(percent).join("\t")));
        }
        out += &format!("{columns}\n");
    }
    out
}

/// "0.0123", or "1.2e-5" if it is small.
fn error(value: Option<f64>) -> String {
    match value {
        Some(v) if v == 0.0 || v >= 1e-4 => format!("{v:.4}"),
        Some(v) => format!("{v:.1e}"),
        None => "–".into(),
    }
}

/// Errors of approximations in two dimensions, a line each.
pub fn reduction_table(rows: &[ReductionRow]) -> String {
    let mut out = String::new();
    for block in rows.chunk_by(|a, b| a.material == b.material) {
        let Some(first) = block.first() else {
            continue;
        };
        out += &format!(
            "{}: averaged over the azimuth; errors, and errors from half-difference\n",
            first.material
        );
        let mut columns = Columns::new("\t\t>nrmse\t>log\t>nrmse\t>log");
        for row in block {
            let errors = [
                row.nrmse,
                row.log_relative,
                row.nrmse_from_half_difference,
                row.log_relative_from_half_difference,
            ];
            let (name, averaging) = (row.parametrization, row.averaging);
            columns.row(&format!(
                "  {name}\t{averaging}\t{}",
                errors.map(error).join("\t")
            ));
        }
        out += &format!("{columns}\n");
    }
    out
}

/// Stretching of steps, one line per parametrization.
pub fn stretch_table(rows: &[StretchRow]) -> String {
    let mut columns =
        Columns::new("\t>median\t>95 %\tproduct of singular values against the Jacobian (median)");
    for row in rows {
        columns.row(&format!(
            "{}\t{:.2}\t{:.2}\t{:.1e}",
            row.parametrization, row.condition_median, row.condition_p95, row.jacobian_error_median
        ));
    }
    format!(
        "Longest over shortest way of a step, axes of length 1, over cosine-distributed pairs\n\n{columns}"
    )
}
