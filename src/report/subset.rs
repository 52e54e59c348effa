//! What a box of coordinates stands for: text, JSON and a picture.

use super::plot::{Axis as PlotAxis, Mark, Panel, Series};
use crate::analysis::{Estimate, Image, Needs, Reach, Subset};
use crate::geometry::DirectionPair;
use crate::parametrization::{Axis, Parametrization, Unit};
use std::f64::consts::TAU;

/// Everything that is known of a box.
pub struct SubsetReport<'a> {
    /// The box.
    pub subset: &'a Subset,
    /// Its measure by quadrature, sr².
    pub measure: Estimate,
    /// Its measure by counting, sr².
    pub counted: Estimate,
    /// The angles it needs.
    pub needs: Needs,
    /// Its image in each of the other parametrizations.
    pub images: Vec<(std::sync::Arc<dyn Parametrization>, Image)>,
    /// What each instrument makes of it.
    pub reaches: Vec<(String, Reach)>,
    /// A material, and which share of its energy the set holds.
    pub energy: Option<(String, Estimate)>,
}

/// "30° to 60°", or "0.2 to 0.4".
fn range(unit: Unit, [lo, hi]: [f64; 2]) -> String {
    match unit {
        Unit::Radian => {
            // Rounded first, and without the sign of a zero.
            let shown = |v: f64| (v.to_degrees() * 10.0).round() / 10.0 + 0.0;
            format!("{:.1}° to {:.1}°", shown(lo), shown(hi))
        }
        Unit::One => format!("{lo:.4} to {hi:.4}"),
    }
}

/// Ranges along axes, by their symbols.
fn ranges(axes: &[Axis], ranges: &[[f64; 2]; 3]) -> String {
    let parts = axes.iter().zip(ranges);
    let parts = parts.map(|(axis, r)| format!("{} {}", axis.symbol, range(axis.unit, *r)));
    parts.collect::<Vec<_>>().join(", ")
}

impl SubsetReport<'_> {
    /// For people.
    pub fn text(&self) -> String {
        let form = self.subset.form();
        let mut out = format!(
            "{}: {}\n",
            form.name(),
            ranges(form.axes(), &self.subset.ranges())
        );
        let Estimate { value, error } = self.measure;
        out += &format!(
            "  measure             {value:.6} sr² ± {error:.1e}, {:.4} % of all pairs; \
             counted {:.6} ± {:.1e}\n",
            100.0 * value / (TAU * TAU),
            self.counted.value,
            self.counted.error
        );
        if let Some((material, share)) = &self.energy {
            out += &format!(
                "  energy              {:.3} % ± {:.1e} % of that of {material}\n",
                100.0 * share.value,
                100.0 * share.error
            );
        }
        for (name, angles) in self.angles() {
            out += &format!("  {name:19} {}\n", range(Unit::Radian, angles));
        }
        out += "  the smallest box around it in other coordinates, and how much of that it fills\n";
        for (form, image) in &self.images {
            out += &format!(
                "    {:17} {:5.1} %  {}\n",
                form.name(),
                100.0 * image.fill,
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
                axes.collect::<Vec<_>>().join(", ")
            );
        }
        out
    }

    fn angles(&self) -> [(&'static str, [f64; 2]); 4] {
        [
            ("theta_i", self.needs.theta_i),
            ("theta_o", self.needs.theta_o),
            ("azimuth difference", self.needs.azimuth),
            ("separation", self.needs.separation),
        ]
    }

    /// For programs: one object; angles in degrees.
    pub fn json(&self) -> serde_json::Value {
        let boxed = |axes: &[Axis], ranges: &[[f64; 2]; 3]| -> serde_json::Value {
            let parts = axes.iter().zip(ranges);
            let parts =
                parts.map(|(a, r)| (a.column(), r.map(|v| a.file_value(v)).to_vec().into()));
            serde_json::Value::Object(parts.collect())
        };
        let degrees = |r: [f64; 2]| r.map(f64::to_degrees);
        let estimate = |e: &Estimate| serde_json::json!({ "value": e.value, "error": e.error });
        let form = self.subset.form();
        let images = self.images.iter().map(|(form, image)| {
            let found = serde_json::json!({
                "box": boxed(form.axes(), &image.ranges),
                "fill": image.fill,
            });
            (form.name().to_owned(), found)
        });
        let reaches = self.reaches.iter().map(|(name, reach)| {
            let axes = reach.axes.iter();
            let axes: serde_json::Map<_, _> = axes
                .map(|(axis, ends)| (format!("{axis}_deg"), serde_json::json!(ends.map(degrees))))
                .collect();
            let found = serde_json::json!({ "share": reach.share, "axes": axes });
            (name.clone(), found)
        });
        serde_json::json!({
            "parametrization": form.name(),
            "box": boxed(form.axes(), &self.subset.ranges()),
            "measure_sr2": estimate(&self.measure),
            "counted_sr2": estimate(&self.counted),
            "share_of_all_pairs": self.measure.value / (TAU * TAU),
            "energy_share": self.energy.as_ref().map(|(material, share)| serde_json::json!({
                "material": material, "value": share.value, "error": share.error,
            })),
            "theta_i_deg": degrees(self.needs.theta_i),
            "theta_o_deg": degrees(self.needs.theta_o),
            "azimuth_difference_deg": degrees(self.needs.azimuth),
            "separation_deg": degrees(self.needs.separation),
            "images": images.collect::<serde_json::Map<_, _>>(),
            "instruments": reaches.collect::<serde_json::Map<_, _>>(),
        })
    }

    /// A panel of the elevations, and one of the first two axes of each parametrization: the pairs
    /// of the set before `all`, pairs from everywhere.
    pub fn panels(&self, all: &[DirectionPair]) -> Vec<Panel> {
        // Enough to show an area, few enough for a file of some hundred kilobytes.
        const SHOWN: u64 = 700;
        let members = self.subset.members(SHOWN, 0);
        let members: Vec<DirectionPair> = members.iter().map(|m| m.pair).collect();
        let panel =
            |title: &str, axes: [PlotAxis; 2], place: &dyn Fn(&DirectionPair) -> [f64; 2]| {
                let series = |name: &str, color: usize, pairs: &[DirectionPair]| Series {
                    name: name.into(),
                    color,
                    mark: Mark::Points,
                    points: pairs
                        .iter()
                        .map(|p| {
                            let [x, y] = place(p);
                            (x, Some(y))
                        })
                        .collect(),
                };
                let [x, y] = axes;
                Panel {
                    title: title.into(),
                    x,
                    y,
                    series: vec![
                        series("all pairs, cosine-distributed", 5, all),
                        series("the box", 1, &members),
                    ],
                }
            };
        let elevation = |symbol: &str| PlotAxis {
            label: format!("{symbol} (deg)"),
            range: Some([0.0, 90.0]),
            ..PlotAxis::default()
        };
        let elevations = [elevation("theta_i"), elevation("theta_o")];
        let mut panels = vec![panel("elevations", elevations, &|p| {
            [p.omega_i, p.omega_o].map(|d| d.theta().to_degrees())
        })];
        let images = self.images.iter().map(|(form, _)| &**form);
        for form in std::iter::once(self.subset.form()).chain(images) {
            let axis = |i: usize| {
                let axis = &form.axes()[i];
                let unit = match axis.unit {
                    Unit::Radian => " (deg)",
                    Unit::One => "",
                };
                PlotAxis {
                    label: format!("{}{unit}", axis.symbol),
                    range: Some(axis.range.map(|end| axis.file_value(end))),
                    ..PlotAxis::default()
                }
            };
            panels.push(panel(form.name(), [axis(0), axis(1)], &|p| {
                let coords = form.forward(p);
                [0, 1].map(|i| form.axes()[i].file_value(coords[i]))
            }));
        }
        panels
    }
}
