//! Light of one facet, of two, of more in each parametrization: text and JSON.

use crate::analysis::Estimate;
use crate::analysis::bounces::{
    self, Capture, ChartBounces, LEAST_CAPTURE, LightShares, MAP_CELLS, Map, PathSample, Spread,
};
use crate::brdf::{CLASSES, Part, SplitBrdf};
use crate::error::{Error, count, listed};
use crate::numeric::extent;
use crate::parametrization::{Axis, ParametrizationSpec, Unit};
use crate::registry::Entry;
use crate::report::Columns;
use crate::report::pictures::bounces::bounces_svg;
use serde_json::{Value, json};

/// All results about the light paths of a material.
pub struct BouncesReport<'a> {
    material: &'a str,
    sample: PathSample,
    /// Light that leaves, and the shares of the classes.
    shares: LightShares,
    /// Entropy of the class, bits.
    entropy: Estimate,
    /// The class of the boxes.
    class: Part,
    /// Share of its light that a box has at least.
    purity: f64,
    charts: Vec<ChartBounces>,
}

/// What light of a class met.
fn met(class: Part) -> &'static str {
    match class {
        Part::First => "one facet",
        Part::Second => "two facets",
        Part::Later => "three facets and more",
        Part::Multiple => "two facets and more",
        Part::All => "any number of facets",
    }
}

/// Digits of maps in JSON.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

/// An estimate with its standard error.
pub(super) fn estimate(e: &Estimate) -> Value {
    json!({ "value": e.value, "error": e.error })
}

/// An object with a key for each class.
fn by_class(of: impl Fn(usize) -> Value) -> Value {
    let classes = Part::CLASSES.iter().enumerate();
    let classes = classes.map(|(i, class)| (class.to_string(), of(i)));
    Value::Object(classes.collect())
}

/// What a set holds, for each class.
pub(super) fn capture_json(capture: &Capture) -> Value {
    by_class(|c| {
        json!({
            "share_inside": estimate(&capture.inside[c]),
            "captured": estimate(&capture.captured[c]),
        })
    })
}

/// "first 71.2 ± 1.0e-1 %, second …".
pub(super) fn of_classes(estimates: &[Estimate; CLASSES]) -> String {
    let parts = Part::CLASSES.iter().zip(estimates);
    listed(parts.map(|(class, e)| format!("{class} {}", percent(e))))
}

/// What the errors of a sample hold.
pub(super) fn errors_are(sample: &PathSample) -> String {
    let (of, batches) = (errors_of(sample), sample.batches());
    let more = match sample.spread {
        Spread::FewSurfaces => ": another surface of the kind may differ by more",
        Spread::Surfaces | Spread::Paths => "",
    };
    format!("standard errors are those of {of}, over {batches} batches{more}")
}

/// What the errors of a sample are of.
fn errors_of(sample: &PathSample) -> &'static str {
    match sample.spread {
        Spread::Surfaces => "paths and surfaces",
        Spread::Paths | Spread::FewSurfaces => "paths",
    }
}

impl<'a> BouncesReport<'a> {
    /// Follows so many paths of a material, and analyses `parametrizations`; boxes are those of `class` with such a share of its
    /// light (`purity`, in (0, 1]). `doing` gets the name of each step before it.
    ///
    /// # Errors
    /// If no light leaves the material.
    pub fn new(
        material: &'a str,
        brdf: &dyn SplitBrdf,
        paths: usize,
        parametrizations: &[Entry<ParametrizationSpec>],
        (class, purity): (Part, f64),
        mut doing: impl FnMut(&str),
    ) -> Result<Self, Error> {
        doing("light paths");
        let sample = PathSample::follow(brdf, paths);
        if !sample.has_light() {
            let message = "no light leaves it; allowed: a material that reflects";
            return Err(Error::config(material, message));
        }
        let charts = parametrizations.iter().map(|entry| {
            doing(entry.kind);
            let place = class.classes().start;
            ChartBounces::new(&sample, entry, brdf.symmetry(), place, purity)
        });
        Ok(Self {
            material,
            shares: sample.shares(),
            entropy: bounces::entropy(&sample),
            class,
            purity,
            charts: charts.collect(),
            sample,
        })
    }

    /// Caption of its picture: shares, and the information of the coordinates about the class, without the boxes.
    pub(crate) fn caption(&self) -> String {
        let pairs = self.charts.iter().map(|chart| {
            let (pair, bits) = chart.information.best_pair();
            let [a, b] = pair.map(|i| chart.axes[i].symbol);
            format!("{} {a}, {b}: {}", chart.name, shown(bits.value, bits.error))
        });
        let all = self.charts.iter().map(|chart| chart.information.all.value);
        let [low, high] = extent(all).unwrap_or_default();
        let mut caption = format!(
            "Light by the number of facets that it met, of {}: {} of all light leaves; {}.",
            count(self.sample.followed, "path"),
            percent(&self.shares.albedo),
            of_classes(&self.shares.classes),
        );
        if self.entropy.value > 0.0 {
            caption += &format!(
                " Of the {} bits that it takes to know the number, the best two axes tell {}; all axes {low:.3} to {high:.3}.",
                shown(self.entropy.value, self.entropy.error),
                pairs.collect::<Vec<_>>().join("; "),
            );
        }
        caption
    }

    /// The report as text.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{}: {} followed, {} left; {}\n\n",
            self.material,
            count(self.sample.followed, "path"),
            self.sample.pairs.len(),
            errors_are(&self.sample)
        );
        out += &format!(
            "light that leaves   {} of what comes from the hemisphere\n  of that             {}\n",
            percent(&self.shares.albedo),
            of_classes(&self.shares.classes)
        );
        let only = Part::CLASSES.iter().zip(&self.shares.classes);
        match only.into_iter().find(|(_, share)| share.value == 1.0) {
            Some((class, _)) => {
                out += &format!(
                    "\nAll of it met {}: there is nothing that coordinates could tell apart.\n",
                    met(*class)
                );
            }
            None => {
                out += &self.information();
                out += &self.boxes();
            }
        }
        out += &self.ranges();
        out
    }

    fn information(&self) -> String {
        let line = |chart: &ChartBounces| {
            let found = &chart.information;
            let (single, of_single) = found.best_single();
            let (pair, of_pair) = found.best_pair();
            let [single, a, b] = [single, pair[0], pair[1]].map(|i| chart.axes[i].symbol);
            let [one, two, all] = [of_single, of_pair, found.all].map(|e| shown(e.value, e.error));
            format!("  {}\t{single}\t{one}\t{a}, {b}\t{two}\t{all}", chart.name)
        };
        let columns = Columns::with_rows(
            "\tbest axis\t>bits\tbest two axes\t>bits\t>all axes, bits",
            self.charts.iter().map(line),
        );
        format!(
            "\nWhat coordinates tell of the class, of {} bits that it takes (mutual information)\n{columns}",
            shown(self.entropy.value, self.entropy.error)
        )
    }

    fn boxes(&self) -> String {
        let mut out = format!(
            "\nThe box with at least {} % of its light from {} that holds most of it; told by other paths than chose it\n",
            // Without the last digits that a product leaves.
            (1e8 * self.purity).round() / 1e6,
            met(self.class)
        );
        let class = self.class.classes().start;
        let mut columns = Columns::new("\t>its light\t>of the class\t--box");
        for chart in &self.charts {
            let Some(best) = &chart.best else {
                return format!("\nThere is no light of {}.\n", met(self.class));
            };
            let [pure, held] = [best.capture.inside[class], best.capture.captured[class]];
            let none = match !best.is_pure(self.purity) {
                true => "no box is so pure; the purest: ",
                false => "",
            };
            columns.row(&format!(
                "  {}\t{}\t{}\t{none}\"{}\"",
                chart.name,
                percent(&pure),
                percent(&held),
                best.text
            ));
        }
        out += &columns.to_string();
        let mut bests = self.charts.iter().filter_map(|c| c.best.as_ref());
        if bests.any(|b| !b.is_pure(self.purity)) {
            out += &format!(
                "  boxes that hold less than {} % of the class do not count\n",
                100.0 * LEAST_CAPTURE
            );
        }
        out
    }

    fn ranges(&self) -> String {
        let mut columns = Columns::new("\taxis\tfirst\tsecond\tlater");
        for chart in &self.charts {
            for (i, (axis, ranges)) in chart.axes.iter().zip(&chart.ranges).enumerate() {
                let name = if i == 0 { chart.name } else { "" };
                let cells = ranges.map(|r| r.map_or("–".into(), |r| range(axis.unit, r)));
                columns.row(&format!("  {name}\t{}\t{}", axis.symbol, cells.join("\t")));
            }
        }
        format!("\nRanges that hold 95 % of the light of a class\n{columns}")
    }

    /// The report as one JSON object; angles in degrees.
    pub fn json(&self) -> Value {
        let charts = self.charts.iter();
        let charts = charts.map(|chart| (chart.name.to_owned(), self.chart(chart)));
        json!({
            "material": self.material,
            "paths": self.sample.followed,
            "left": self.sample.pairs.len(),
            "batches": self.sample.batches(),
            "errors": errors_of(&self.sample),
            "albedo": estimate(&self.shares.albedo),
            "shares": by_class(|c| estimate(&self.shares.classes[c])),
            "entropy_bits": estimate(&self.entropy),
            "box_of": self.class.to_string(),
            "purity": self.purity,
            "parametrizations": charts.collect::<serde_json::Map<_, _>>(),
        })
    }

    /// Maps of each parametrization.
    pub fn svg(&self) -> String {
        let title = format!(
            "{}: light by the number of facets that it met",
            self.material
        );
        bounces_svg(&title, &self.charts)
    }

    fn chart(&self, chart: &ChartBounces) -> Value {
        let symbol = |i: usize| chart.axes[i].symbol;
        let bits = |axes: &[usize], e: &Estimate| {
            let axes: Vec<&str> = axes.iter().map(|&i| symbol(i)).collect();
            json!({ "axes": axes, "bits": e.value, "error": e.error })
        };
        let found = &chart.information;
        let every: Vec<usize> = (0..chart.axes.len()).collect();
        let single = found.single.iter().enumerate().map(|(i, e)| bits(&[i], e));
        let pairs = found.pairs.iter().map(|(pair, e)| bits(pair, e));
        let information = single.chain(pairs).chain([bits(&every, &found.all)]);
        let ranges = chart.axes.iter().zip(&chart.ranges).map(|(axis, ranges)| {
            let ends = |c: usize| json!(ranges[c].map(|r| r.map(|x| axis.file_value(x))));
            (axis.column(), by_class(ends))
        });
        let best = chart.best.as_ref().map(|best| {
            json!({
                "box": best.text,
                "pure": best.is_pure(self.purity),
                "purity_of_choice": best.chosen_by,
                "classes": capture_json(&best.capture),
            })
        });
        let maps = chart.maps.iter().map(|map| self.map(map, chart));
        json!({
            "information": information.collect::<Vec<_>>(),
            "ranges": ranges.collect::<serde_json::Map<_, _>>(),
            "box": best,
            "maps": maps.collect::<Vec<_>>(),
        })
    }

    fn map(&self, map: &Map, chart: &ChartBounces) -> Value {
        let form = &chart.map_axes;
        let file = |axis: &Axis, x: f64| match axis.unit {
            // Multiples of a degree but for rounding.
            Unit::Radian => (axis.file_value(x) * 1e9).round() / 1e9,
            Unit::One => x,
        };
        let about = map.azimuth.map(|about| about.map(|x| file(&form[2], x)));
        let ranges = [0, 1].map(|i| form[i].range.map(|end| form[i].file_value(end)));
        let rows = |of: &dyn Fn(usize) -> Value| -> Vec<Value> {
            let row = |j: usize| (0..MAP_CELLS).map(|i| of(j * MAP_CELLS + i)).collect();
            (0..MAP_CELLS).map(row).collect()
        };
        json!({
            "axes": [form[0].column(), form[1].column()],
            "ranges": ranges,
            "azimuth": form[2].column(),
            "about": about.map(|[middle, half]| json!({ "middle": middle, "half_width": half })),
            "light": rows(&|cell| json!(rounded(map.light[cell].iter().sum()))),
            "shares": by_class(|c| {
                Value::Array(rows(&|cell| json!(map.shares(cell).map(|s| rounded(s[c])))))
            }),
        })
    }
}

/// Decimals at most.
const DECIMALS: f64 = 9.0;

/// "0.377 ± 2.1e-3": the first digit that is uncertain is the last one. An error that no digit shows is rounding, and left out;
/// "–": of nothing, NaN.
pub(super) fn shown(value: f64, error: f64) -> String {
    if value.is_nan() {
        return "–".into();
    }
    if error < 0.5 * 10f64.powf(-DECIMALS) {
        let scale = 10f64.powf(DECIMALS);
        // Without the sign of a zero.
        return format!("{}", (value * scale).round() / scale + 0.0);
    }
    let digits = (-error.log10()).ceil().clamp(0.0, DECIMALS) as usize;
    format!("{value:.digits$} ± {error:.1e}")
}

/// A share as [`shown`], in percent.
pub(super) fn percent(share: &Estimate) -> String {
    match share.value.is_nan() {
        true => shown(share.value, share.error),
        false => format!("{} %", shown(100.0 * share.value, 100.0 * share.error)),
    }
}

/// "30° to 60°", or "0.2 to 0.4"; "45°" of one place.
pub(super) fn range(unit: Unit, [lo, hi]: [f64; 2]) -> String {
    let (ends, least, sign) = match unit {
        Unit::Radian => ([lo, hi].map(f64::to_degrees), 1.0, "°"),
        Unit::One => ([lo, hi], 4.0, ""),
    };
    // Two digits of the length, so that ends differ.
    let length = ends[1] - ends[0];
    let digits = 1.0 - length.max(1e-300).log10().floor();
    // What is shorter than all decimals is one place but for rounding.
    let digits = match digits <= DECIMALS {
        true => digits.max(least),
        false => least,
    };
    let scale = 10f64.powf(digits);
    // Rounded first, and without the sign of a zero.
    let [lo, hi] = ends.map(|v| (v * scale).round() / scale + 0.0);
    let digits = digits as usize;
    match lo == hi {
        true => format!("{lo:.digits$}{sign}"),
        false => format!("{lo:.digits$}{sign} to {hi:.digits$}{sign}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    #[test]
    fn errors_decide_how_many_digits_are_told() {
        for (value, error, text) in [
            (0.37712, 2.1e-3, "0.377 ± 2.1e-3"),
            (12.0, 3.0, "12 ± 3.0e0"),
            (100.0, 0.0, "100"),
            (1e-17, 2e-13, "0"),
            (-1e-17, 0.0, "0"),
            (44.1, 1e-12, "44.1"),
            (f64::NAN, f64::NAN, "–"),
        ] {
            assert_eq!(shown(value, error), text);
        }
        let nothing = Estimate {
            value: f64::NAN,
            error: f64::NAN,
        };
        assert_eq!(percent(&nothing), "–");
    }

    #[test]
    fn ends_of_narrow_ranges_differ() {
        for (unit, ends, text) in [
            (Unit::One, [0.0, 0.2], "0.0000 to 0.2000"),
            (Unit::One, [0.0, 3.1e-7], "0.00000000 to 0.00000031"),
            (Unit::One, [0.5, 0.5], "0.5000"),
            (Unit::Radian, [FRAC_PI_4, FRAC_PI_4 + 1e-15], "45.0°"),
            (Unit::Radian, [0.0, 0.5], "0.0° to 28.6°"),
            (Unit::Radian, [0.0, 1e-4], "0.0000° to 0.0057°"),
        ] {
            assert_eq!(range(unit, ends), text);
        }
    }
}
