//! Distortions of materials in parametrizations: rows for programs, tables for people.

use crate::analysis::{Anisotropy, Distortion, Gradients, Scale, Shares, Weight};
use crate::error::count;
use crate::parametrization::Axis;
use crate::report::schema::Csv;
use crate::report::{Columns, each_once, in_memory};
use crate::statistics::{Bootstrap, median};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// Shares of one slice, or of all azimuths.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    /// Standard error of these shares, the largest.
    pub gradient_se: Option<f64>,
    /// Mean squared deviation of the slice from the average over all azimuths, in units of the
    /// variance.
    pub deviation: Option<f64>,
}

impl SharesRow {
    /// The rows of a distortion: one per slice, then that of all azimuths; with the energies of its gradient where they were asked for.
    pub fn rows(
        material: &str,
        parametrization: &'static str,
        axes: &[Axis],
        (scale, weight): (Scale, Weight),
        found: &Distortion,
        gradients: Option<&Gradients>,
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
            ..Self::default()
        };
        let slices = found.slices.iter().enumerate().map(|(i, slice)| {
            let gradient = gradients.and_then(|g| g.slices[i].shares());
            // Multiples of 30° to the last bit, but for rounding.
            let phi = (slice.phi.to_degrees() * 1e9).round() / 1e9;
            Self {
                gradient_first: gradient.map(|g| g[0].0),
                gradient_second: gradient.map(|g| g[1].0),
                gradient_se: gradient.map(|g| g[0].1),
                deviation: slice.deviation,
                ..row(Some(phi), slice.physical, slice.shares)
            }
        });
        let gradient = gradients.and_then(|g| g.all.shares());
        let all = Self {
            both: found.shares.map(|s| s.both),
            gradient_first: gradient.map(|g| g[0].0),
            gradient_second: gradient.map(|g| g[1].0),
            gradient_phi: gradient.map(|g| g[2].0),
            gradient_se: gradient.map(|g| g.iter().fold(0.0, |most, (_, error)| error.max(most))),
            ..row(None, found.physical, found.shares)
        };
        slices.chain([all]).collect()
    }
}

/// How well a parametrization is aligned with several materials, beside half/difference coordinates on the same.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlignmentRow {
    /// Name of the parametrization.
    pub parametrization: &'static str,
    /// `coordinates` or `solid-angle`.
    pub weight: &'static str,
    /// `sum`: a function of the first axis plus one of the second; `both`: any function of these two.
    pub function: &'static str,
    /// Materials that vary.
    pub materials: usize,
    /// Mean over them of the share of the variance that such a function explains.
    pub mean: f64,
    /// Ends of the 95 % bootstrap interval of that mean over materials; `None` of fewer than 6.
    pub mean_low: Option<f64>,
    /// The upper end.
    pub mean_high: Option<f64>,
    /// Median of that share.
    pub median: f64,
    /// Materials of which it explains more than half/difference coordinates do.
    pub more: usize,
    /// Materials of which it explains less.
    pub less: usize,
    /// Mean of the difference of the shares.
    pub difference: f64,
    /// Ends of the interval of that mean.
    pub low: Option<f64>,
    /// The upper end.
    pub high: Option<f64>,
}

/// The coordinates that others are compared with.
pub(super) const REFERENCE: &str = "half-difference";

/// A share of the variance, by its name.
type Named = (&'static str, fn(&SharesRow) -> Option<f64>);

/// Functions of two axes whose shares are listed: aligned isolines are those of a sum.
const FUNCTIONS: [Named; 2] = [("sum", |r| r.sum), ("both", |r| r.both)];

/// Seed of the bootstrap: the same rows give the same intervals.
const SEED: u64 = 1;

impl AlignmentRow {
    /// A row per weight, function and parametrization, from the rows of all materials in all of them.
    pub(crate) fn rows(rows: &[SharesRow]) -> Vec<Self> {
        let bootstrap = Bootstrap::new(SEED);
        let all = || rows.iter().filter(|r| r.phi_deg.is_none());
        let mut found = Vec::new();
        for weight in Weight::ALL.map(Weight::name) {
            for (function, of) in FUNCTIONS {
                let mine = || all().filter(|r| r.weight == weight);
                let names = each_once(mine().map(|r| r.parametrization));
                // By material.
                let shares = |name: &str| -> BTreeMap<&str, f64> {
                    let rows = mine().filter(|r| r.parametrization == name);
                    rows.filter_map(|r| Some((r.material.as_str(), of(r)?)))
                        .collect()
                };
                if !names.contains(&REFERENCE) {
                    continue;
                }
                let reference = shares(REFERENCE);
                let lists = names.into_iter().map(|name| (name, shares(name)));
                let rows = lists.filter(|(_, list)| !list.is_empty());
                found.extend(rows.map(|(parametrization, list)| {
                    let more =
                        |(material, share): (&&str, &f64)| Some(share - reference.get(material)?);
                    let differences: Vec<f64> = list.iter().filter_map(more).collect();
                    let interval = bootstrap.mean_interval(&differences);
                    let mut sorted: Vec<f64> = list.values().copied().collect();
                    let of_mean = bootstrap.mean_interval(&sorted);
                    sorted.sort_by(f64::total_cmp);
                    Self {
                        parametrization,
                        weight,
                        function,
                        materials: sorted.len(),
                        mean: mean(&sorted),
                        mean_low: of_mean.map(|[low, _]| low),
                        mean_high: of_mean.map(|[_, high]| high),
                        median: median(&sorted).unwrap_or_default(),
                        more: differences.iter().filter(|d| **d > 0.0).count(),
                        less: differences.iter().filter(|d| **d < 0.0).count(),
                        difference: mean(&differences),
                        low: interval.map(|[low, _]| low),
                        high: interval.map(|[_, high]| high),
                    }
                }));
            }
        }
        found
    }

    /// Difference and its interval, in percent.
    pub(super) fn compared(&self) -> [String; 2] {
        let points = |x: f64| format!("{:+.1}", 100.0 * x);
        let interval = self.low.zip(self.high);
        let interval = interval.map_or("–".into(), |(low, high)| {
            format!("{} to {}", points(low), points(high))
        });
        [points(self.difference), interval]
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Alignment over materials: a block per weight and function, a line per parametrization.
pub fn alignment_table(rows: &[AlignmentRow]) -> String {
    let mut out = String::new();
    for block in rows.chunk_by(|a, b| (a.weight, a.function) == (b.weight, b.function)) {
        let first = &block[0];
        let function = match first.function {
            "sum" => "a function of the first axis plus one of the second explains",
            _ => "any function of the first two axes explains",
        };
        out += &format!(
            "Percent of the variance of ln(f + 1e-3) that {function}, nodes weighed by {}, over {}\n",
            first.weight,
            count(first.materials, "material")
        );
        let line = |row: &AlignmentRow| {
            let [mean, median] = [row.mean, row.median].map(|share| percent(Some(share)));
            let (name, [difference, interval]) = (row.parametrization, row.compared());
            let counts = format!("{}\t{}", row.more, row.less);
            format!("  {name}\t{mean}\t{median}\t{counts}\t{difference}\t{interval}")
        };
        let head = format!("\t>mean\t>median\t>more\t>less\t>than {REFERENCE}, mean\t>95 %");
        out += &format!("{}\n", Columns::with_rows(&head, block.iter().map(line)));
    }
    out
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

/// Rows as CSV, columns named as their fields; undefined values are empty fields.
pub fn rows_csv<T: Serialize>(rows: &[T]) -> String {
    let mut csv = Csv::new();
    for (i, row) in rows.iter().enumerate() {
        if let Value::Object(cells) = in_memory(serde_json::to_value(row)) {
            if i == 0 {
                csv.row(cells.keys());
            }
            csv.values(&cells);
        }
    }
    csv.text()
}

/// Rows as a JSON array of objects, one a line; undefined values are `null`.
pub fn rows_json<T: Serialize>(rows: &[T]) -> String {
    let lines = rows.iter().map(|row| in_memory(serde_json::to_string(row)));
    match rows {
        [] => "[]\n".into(),
        _ => format!("[\n{}\n]\n", lines.collect::<Vec<_>>().join(",\n")),
    }
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
        let first = &block[0];
        let what = match first.scale {
            "log" => "ln(f + 1e-3)",
            _ => "f",
        };
        let [a, b] = [first.first_axis, first.second_axis];
        out += &format!(
            "{}, {}: percent of the variance of {what}, nodes weighed by {}\n",
            first.material, first.parametrization, first.weight
        );
        let head = format!(
            ">azimuth\t>{a}\t>{b}\t>sum\t>both\t>gradient along {a}\t>{b}\t>azimuth\t>±\t>deviation"
        );
        let line = |row: &SharesRow| {
            let azimuth = row.phi_deg.map_or("all".into(), |p| format!("{p:.0}°"));
            let shares = [
                row.first,
                row.second,
                row.sum,
                row.both,
                row.gradient_first,
                row.gradient_second,
                row.gradient_phi,
                row.gradient_se,
                row.deviation,
            ];
            format!("{azimuth}\t{}", shares.map(percent).join("\t"))
        };
        out += &format!("{}\n", Columns::with_rows(&head, block.iter().map(line)));
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
        out += &format!(
            "{}: averaged over the azimuth; errors, and errors from half-difference\n",
            block[0].material
        );
        let line = |row: &ReductionRow| {
            let errors = [
                row.nrmse,
                row.log_relative,
                row.nrmse_from_half_difference,
                row.log_relative_from_half_difference,
            ];
            let errors = errors.map(error).join("\t");
            format!("  {}\t{}\t{errors}", row.parametrization, row.averaging)
        };
        let head = "\t\t>nrmse\t>log\t>nrmse\t>log";
        out += &format!("{}\n", Columns::with_rows(head, block.iter().map(line)));
    }
    out
}

/// Stretching of steps, one line per parametrization.
pub fn stretch_table(rows: &[Anisotropy]) -> String {
    let line = |row: &Anisotropy| {
        let [median, p95] = [row.condition_median, row.condition_p95];
        let (name, jacobian) = (row.parametrization, row.jacobian_error_median);
        format!("{name}\t{median:.2}\t{p95:.2}\t{jacobian:.1e}")
    };
    let columns = Columns::with_rows(
        "\t>median\t>95 %\tproduct of singular values against the Jacobian (median)",
        rows.iter().map(line),
    );
    format!(
        "Longest over shortest way of a step, axes of length 1, over cosine-distributed pairs\n\n{columns}"
    )
}
