//! A box of coordinates and its directions: text, JSON and a picture.

use super::bounces::{capture_json, errors_are, estimate, of_classes, percent, range, shown};
use crate::analysis::bounces::{Capture, PathSample};
use crate::analysis::{Estimate, Image, Needs, Reach, Subset, SubsetMeasure};
use crate::error::{count, listed};
use crate::geometry::DirectionPair;
use crate::parametrization::{Axis, Parametrization, Unit};
use crate::report::pictures::plot::{coordinate, label};
use crate::report::svg::plot::{Axis as PlotAxis, Mark, Panel, Series};
use serde_json::{Map, Value, json};

/// All results about a box.
pub struct SubsetReport<'a> {
    /// The box.
    pub subset: &'a Subset,
    /// Its measure.
    pub measure: SubsetMeasure,
    /// Ranges of the angles it needs.
    pub needs: Needs,
    /// Its image in each of the other parametrizations.
    pub images: Vec<(std::sync::Arc<dyn Parametrization>, Image)>,
    /// Name of each instrument, and the part of the box it can reach.
    pub reaches: Vec<(String, Reach)>,
    /// A material, and the share of its energy inside the box; `None` for a black one.
    pub energy: Option<(String, Option<Estimate>)>,
    /// Paths of a material that separates scattering orders, and what the box holds of them.
    pub bounces: Option<(PathSample, Capture)>,
}

/// Ranges along axes, by their symbols.
fn ranges(axes: &[Axis], ranges: &[[f64; 2]; 3]) -> String {
    let parts = axes.iter().zip(ranges);
    listed(parts.map(|(axis, r)| format!("{} {}", axis.symbol, range(axis.unit, *r))))
}

impl SubsetReport<'_> {
    /// The title of its picture.
    pub(crate) fn title(&self) -> String {
        let form = &*self.subset.form;
        // The whole of an axis needs no word.
        let all = form.axes().iter().zip(&self.subset.ranges);
        let bounded = all.filter(|(axis, r)| **r != axis.range);
        let parts = bounded.map(|(axis, r)| {
            let [low, high] = r.map(|v| coordinate(axis, v));
            format!(", {} from {low} to {high}", axis.label)
        });
        let parts: String = parts.collect();
        format!("Pairs of a box of {} coordinates{parts}", form.name())
    }

    pub(crate) fn text(&self) -> String {
        let form = &*self.subset.form;
        let mut out = format!(
            "{}: {}\n",
            form.name(),
            ranges(form.axes(), &self.subset.ranges)
        );
        let by_quadrature = ("by quadrature", self.measure.quadrature);
        let by_counting = ("counted", self.measure.counted);
        let [(name, best), (other_name, other)] = match self.measure.is_counted() {
            true => [by_counting, by_quadrature],
            false => [by_quadrature, by_counting],
        };
        out += &format!(
            "  measure             {} sr² {name} ({} {other_name}), {} of all pairs\n",
            shown(best.value, best.error),
            shown(other.value, other.error),
            percent(&self.measure.share())
        );
        if let Some((material, share)) = &self.energy {
            let share = match share {
                None => "–".into(),
                Some(share) if share.value > 0.0 && !share.resolved() => {
                    format!("not resolved ({})", percent(share))
                }
                Some(share) => percent(share),
            };
            out += &format!("  energy              {share} of that of {material}\n");
        }
        if let Some((sample, capture)) = &self.bounces {
            let followed = count(sample.followed, "path");
            out += &match capture.captured.iter().any(|c| c.value > 0.0) {
                true => format!(
                    "  facets met          {} of the light inside\n  of each number      {} is inside ({followed}; {})\n",
                    of_classes(&capture.inside),
                    of_classes(&capture.captured),
                    errors_are(sample)
                ),
                false => format!("  facets met          none of {followed} is inside\n"),
            };
        }
        for (name, angles) in self.needs {
            out += &format!("  {name:19} {}\n", range(Unit::Radian, angles));
        }
        out += "  the smallest box around it in other coordinates, and how much of that it fills\n";
        for (form, image) in &self.images {
            out += &format!(
                "    {:17} {:>18}  {}\n",
                form.name(),
                percent(&image.fill),
                ranges(form.axes(), &image.ranges)
            );
        }
        out += "  instruments, the share they reach, and where their axes stand for it\n";
        for (name, reach) in &self.reaches {
            let axes = reach.axes.iter().filter_map(|(axis, ends)| {
                Some(format!("{axis} {}", range(Unit::Radian, (*ends)?)))
            });
            out += &format!(
                "    {name:17} {:5.1} %  {}\n",
                100.0 * reach.share,
                listed(axes)
            );
        }
        out
    }

    /// The report as one JSON object; angles in degrees.
    pub(crate) fn json(&self) -> Value {
        let boxed = |axes: &[Axis], ranges: &[[f64; 2]; 3]| -> Value {
            let parts = axes.iter().zip(ranges);
            let parts =
                parts.map(|(a, r)| (a.column(), r.map(|v| a.file_value(v)).to_vec().into()));
            Value::Object(parts.collect())
        };
        let degrees = |r: [f64; 2]| r.map(f64::to_degrees);
        let form = &*self.subset.form;
        let images = self.images.iter().map(|(form, image)| {
            let found = json!({
                "box": boxed(form.axes(), &image.ranges),
                "fill": image.fill.value,
                "fill_error": image.fill.error,
            });
            (form.name().to_owned(), found)
        });
        let reaches = self.reaches.iter().map(|(name, reach)| {
            let axes = reach.axes.iter();
            let axes: Map<_, _> = axes
                .map(|(axis, ends)| (format!("{axis}_deg"), json!(ends.map(degrees))))
                .collect();
            let found = json!({ "share": reach.share, "axes": axes });
            (name.clone(), found)
        });
        let mut report = json!({
            "parametrization": form.name(),
            "box": boxed(form.axes(), &self.subset.ranges),
            "measure_sr2": estimate(&self.measure.best()),
            "measured_by": if self.measure.is_counted() { "counting" } else { "quadrature" },
            "quadrature_sr2": estimate(&self.measure.quadrature),
            "counted_sr2": estimate(&self.measure.counted),
            "share_of_all_pairs": self.measure.share().value,
            "energy_share": self.energy.as_ref().map(|(material, share)| json!({
                "material": material,
                "value": share.map(|s| s.value),
                "error": share.map(|s| s.error),
            })),
            "bounces": self.bounces.as_ref().map(|(sample, capture)| json!({
                "paths": sample.followed,
                "batches": sample.batches(),
                "classes": capture_json(capture),
            })),
        });
        for (name, angles) in self.needs {
            report[format!("{}_deg", name.replace(' ', "_"))] = json!(degrees(angles));
        }
        report["images"] = json!(images.collect::<Map<_, _>>());
        report["instruments"] = json!(reaches.collect::<Map<_, _>>());
        report
    }

    /// A panel of the elevations, and one of the first two axes of each parametrization: the pairs
    /// of the set before `all`, pairs from everywhere.
    pub(crate) fn panels(&self, all: &[DirectionPair]) -> Vec<Panel> {
        // Enough to show an area, few enough for a file of some hundred kilobytes.
        const SHOWN: u64 = 700;
        let members = self.subset.members(SHOWN, 0);
        let members: Vec<DirectionPair> = members.iter().map(|m| m.pair).collect();
        let panel =
            |title: &str, axes: [PlotAxis; 2], place: &dyn Fn(&DirectionPair) -> [f64; 2]| {
                let series = |name: &str, color: usize, pairs: &[DirectionPair]| {
                    let points = pairs.iter().map(place).map(|[x, y]| (x, Some(y)));
                    Series::new(name, color, Mark::Points, points)
                };
                let everywhere = series("all pairs, cosine-distributed", 5, all);
                Panel::new(title, axes, [everywhere, series("the box", 1, &members)])
            };
        let elevations = ["θ_i (°)", "θ_o (°)"].map(|l| PlotAxis::linear(l).within([0.0, 90.0]));
        let both = |p: &DirectionPair| [p.omega_i, p.omega_o].map(|d| d.theta().to_degrees());
        let mut of_elevations = panel("elevations", elevations, &both);
        if self.subset.form.symmetry().reciprocal {
            // The set holds both orders of light and sensor, its members are one of them.
            for series in of_elevations.series.iter_mut().skip(1) {
                let other = series.points.clone().into_iter();
                let other = other.filter_map(|(x, y)| Some((y?, Some(x))));
                series.points.extend(other);
            }
        }
        let mut panels = vec![of_elevations];
        let images = self.images.iter().map(|(form, _)| &**form);
        for form in std::iter::once(&*self.subset.form).chain(images) {
            let axis = |i: usize| {
                let axis = &form.axes()[i];
                PlotAxis::linear(label(axis)).within(axis.range.map(|end| axis.file_value(end)))
            };
            panels.push(panel(form.name(), [axis(0), axis(1)], &|p| {
                let coords = form.forward(p);
                [0, 1].map(|i| form.axes()[i].file_value(coords[i]))
            }));
        }
        panels
    }
}
