//! A figure of the alignment of parametrizations with materials.

use super::distortion::{AlignmentRow, REFERENCE, SharesRow};
use crate::analysis::Weight;
use crate::error::count;
use crate::report::each_once;
use crate::report::pictures::plot::text;
use crate::report::svg::axis;
use crate::report::svg::canvas::{Align, Canvas, Ink, Lettering, fitted};
use crate::report::svg::marker::Shape;
use crate::report::svg::plot::{color_of, palette};
use crate::report::svg::{FRAME, GRID};

/// Heights of the lines of a mean and of a material, pixels.
const MEAN: f64 = 17.0;
const LINE: f64 = 12.5;

/// Widths of the names, of a plot and of the notes beside it.
const NAMES: f64 = 178.0;
const PLOT: f64 = 300.0;
const NOTES: f64 = 158.0;

const MARGIN: f64 = 16.0;
const TOP: f64 = 92.0;
const SIZE: f64 = 10.5;

/// Shares that are written at the axis, percent.
const PERCENT: [f64; 9] = [0.0, 50.0, 80.0, 90.0, 95.0, 98.0, 99.0, 99.5, 99.9];

/// Place of a share on the axis, in [0, 1]: the logarithm of the rest, from all to a thousandth, as most shares
/// are near 1.
fn place(share: f64) -> f64 {
    (-(1.0 - share).max(1e-3).log10() / 3.0).clamp(0.0, 1.0)
}

/// The share of the variance that a sum of functions of the two axes explains, for each parametrization and
/// both weights: its mean over materials with the 95 % bootstrap interval, beside it the difference from
/// half/difference coordinates with its own, and below it a line per material, sorted by the
/// first plot's share in half/difference coordinates.
pub fn alignment_svg(shares: &[SharesRow]) -> String {
    let means = AlignmentRow::rows(shares);
    let shares: Vec<&SharesRow> = shares.iter().filter(|r| r.phi_deg.is_none()).collect();
    let of = |material: &str, name: &str, weight: &str| -> Option<f64> {
        let is = |r: &&&SharesRow| {
            r.material == material && r.parametrization == name && r.weight == weight
        };
        shares.iter().find(is)?.sum
    };
    let names = each_once(shares.iter().map(|r| r.parametrization));
    let mut materials: Vec<&str> = shares.iter().map(|r| r.material.as_str()).collect();
    materials.dedup();
    let weights = Weight::ALL.map(Weight::name);
    let key = |material: &str| of(material, REFERENCE, weights[0]).unwrap_or(-1.0);
    materials.sort_by(|a, b| key(b).total_cmp(&key(a)).then(a.cmp(b)));
    let logs = shares.iter().all(|r| r.scale == "log");
    let what = match logs {
        true => "ln(f + 1e-3)",
        false => "f, or of ln(f + 1e-3),",
    };

    let lines_top = TOP + names.len() as f64 * MEAN + 16.0;
    let bottom = lines_top + materials.len() as f64 * LINE;
    let width = 2.0 * MARGIN + NAMES + weights.len() as f64 * (PLOT + NOTES);
    let title = format!(
        "Share of the variance of {what} that a function of the first axis plus one of the second explains"
    );
    Canvas::titled(&title, [width, bottom + 70.0], 24.0, |canvas| {
        let middle = 0.5 * width;
        let [start, end] = [Align::Start, Align::End].map(|align| Lettering::new(SIZE, align));
        let names_end = MARGIN + NAMES - 10.0;
        let mean_y = |i: usize| TOP + (i as f64 + 0.5) * MEAN;
        let line_y = |i: usize| lines_top + (i as f64 + 0.5) * LINE;
        for (i, name) in names.iter().enumerate() {
            canvas.text([names_end, mean_y(i)], &format!("mean, {name}"), end);
        }
        for (i, material) in materials.iter().enumerate() {
            canvas.text([names_end, line_y(i)], &fitted(material, SIZE, NAMES), end);
        }
        for (k, weight) in weights.into_iter().enumerate() {
            let left = MARGIN + NAMES + k as f64 * (PLOT + NOTES);
            let at = |share: f64| left + PLOT * place(share);
            let by = match weight {
                "coordinates" => "by equal steps of the coordinates",
                _ => "by solid angle",
            };
            text(canvas, [left + 0.5 * PLOT, TOP - 16.0], by, 12.5, true);
            canvas.text(
                [left + PLOT + 8.0, TOP - 24.0],
                "mean difference from",
                start,
            );
            let than = format!("{REFERENCE} (95 %)");
            canvas.text([left + PLOT + 8.0, TOP - 10.0], &than, start);
            let how = Lettering::new(axis::SIZE, Align::Middle);
            for percent in PERCENT {
                let x = at(percent / 100.0);
                canvas.line(&[[x, TOP], [x, bottom]], GRID, 0.8);
                canvas.text([x, bottom + 12.0], &percent.to_string(), how);
            }
            canvas.text([left + 0.5 * PLOT, bottom + 30.0], "share (%)", how);
            let [right, between] = [at(1.0), lines_top - 8.0];
            canvas.frame([left, TOP], [right, bottom], FRAME);
            canvas.line(&[[left, between], [right, between]], FRAME, 0.8);
            for (i, name) in names.iter().enumerate() {
                let color = color_of(name);
                let (ink, shape): (Ink, _) = (palette(color, 0), Shape::of(color));
                let is = |m: &&AlignmentRow| {
                    (m.parametrization, m.weight, m.function) == (*name, weight, "sum")
                };
                let Some(mean) = means.iter().find(is) else {
                    continue;
                };
                let y = mean_y(i);
                if let (Some(low), Some(high)) = (mean.mean_low, mean.mean_high) {
                    canvas.line(&[[at(low), y], [at(high), y]], ink, 1.7);
                    for end in [low, high] {
                        canvas.line(&[[at(end), y - 4.0], [at(end), y + 4.0]], ink, 1.2);
                    }
                }
                canvas.marker(shape, [at(mean.mean), y], 3.6, ink);
                if *name != REFERENCE {
                    let [difference, interval] = mean.compared();
                    let compared = format!("{difference} ({interval})").replace('-', "−");
                    canvas.text([left + PLOT + 8.0, y], &compared, start);
                }
                for (i, material) in materials.iter().enumerate() {
                    if let Some(share) = of(material, name, weight) {
                        canvas.marker(shape, [at(share), line_y(i)], 2.4, ink);
                    }
                }
            }
        }
        let says = format!(
            "{}, sorted by {REFERENCE}, left; axis: logarithm of the rest, 100 % − share; bars: 95 % bootstrap \
             interval over materials; differences are those on the same material",
            count(materials.len(), "material")
        );
        text(canvas, [middle, bottom + 54.0], &says, 11.0, false);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_shares_lie_farther_right() {
        let places = PERCENT.map(|p| place(p / 100.0));
        assert!(places.windows(2).all(|w| w[0] < w[1]));
        assert_eq!([places[0], place(1.0), place(-0.1)], [0.0, 1.0, 0.0]);
        assert!((places[8] - 1.0).abs() < 1e-9);
    }
}
