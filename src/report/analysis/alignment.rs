//! A figure of the alignment of parametrizations with materials.

use super::distortion::{AlignmentRow, REFERENCE, SharesRow};
use crate::analysis::Weight;
use crate::error::{Error, count};
use crate::report::svg::axis;
use crate::report::svg::canvas::{Align, Canvas, Ink, Lettering, fitted};
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
///
/// # Errors
/// [`Error::Internal`] if drawing fails, which it should not.
pub fn alignment_svg(shares: &[SharesRow]) -> Result<String, Error> {
    let means = AlignmentRow::of(shares);
    let shares: Vec<&SharesRow> = shares.iter().filter(|r| r.phi_deg.is_none()).collect();
    let of = |material: &str, name: &str, weight: &str| -> Option<f64> {
        let mut found = shares
            .iter()
            .filter(|r| r.material == material && r.parametrization == name && r.weight == weight);
        found.next()?.sum
    };
    let mut names: Vec<&str> = Vec::new();
    let mut materials: Vec<&str> = Vec::new();
    for row in &shares {
        if !names.contains(&row.parametrization) {
            names.push(row.parametrization);
        }
        if materials.last() != Some(&row.material.as_str()) {
            materials.push(&row.material);
        }
    }
    let weights = Weight::ALL.map(Weight::name);
    let key = |material: &str| of(material, REFERENCE, weights[0]).unwrap_or(-1.0);
    materials.sort_by(|a, b| key(b).total_cmp(&key(a)).then(a.cmp(b)));
    let logs = shares.iter().all(|r| r.scale == "log");
    let what = if logs {
        "ln(f + 1e-3)"
    } else {
        "f, or of ln(f + 1e-3),"
    };

    let lines_top = TOP + names.len() as f64 * MEAN + 16.0;
    let bottom = lines_top + materials.len() as f64 * LINE;
    let width = 2.0 * MARGIN + NAMES + weights.len() as f64 * (PLOT + NOTES);
    Canvas::draw([width, bottom + 70.0], |canvas| {
        let middle = 0.5 * width;
        let mut how = Lettering::new(15.5, Align::Middle);
        how.bold = true;
        let title = format!(
            "Share of the variance of {what} that a function of the first axis plus one of the second explains"
        );
        canvas.text(
            [middle, 24.0],
            &fitted(&title, 17.0, width - 2.0 * MARGIN),
            how,
        );
        how = Lettering::new(SIZE, Align::End);
        let names_end = MARGIN + NAMES - 10.0;
        let mean_y = |i: usize| TOP + (i as f64 + 0.5) * MEAN;
        let line_y = |i: usize| lines_top + (i as f64 + 0.5) * LINE;
        for (i, name) in names.iter().enumerate() {
            canvas.text([names_end, mean_y(i)], &format!("mean, {name}"), how);
        }
        for (i, material) in materials.iter().enumerate() {
            canvas.text([names_end, line_y(i)], &fitted(material, SIZE, NAMES), how);
        }
        for (k, weight) in weights.into_iter().enumerate() {
            let left = MARGIN + NAMES + k as f64 * (PLOT + NOTES);
            let at = |share: f64| left + PLOT * place(share);
            how = Lettering::new(12.5, Align::Middle);
            how.bold = true;
            let by = match weight {
                "coordinates" => "by equal steps of the coordinates",
                _ => "by solid angle",
            };
            canvas.text([left + 0.5 * PLOT, TOP - 16.0], by, how);
            how = Lettering::new(SIZE, Align::Start);
            canvas.text([left + PLOT + 8.0, TOP - 24.0], "mean difference from", how);
            let than = format!("{REFERENCE} (95 %)");
            canvas.text([left + PLOT + 8.0, TOP - 10.0], &than, how);
            how = Lettering::new(axis::SIZE, Align::Middle);
            for percent in PERCENT {
                let x = at(percent / 100.0);
                canvas.line(&[[x, TOP], [x, bottom]], GRID, 0.8);
                canvas.text([x, bottom + 12.0], &percent.to_string(), how);
            }
            canvas.text([left + 0.5 * PLOT, bottom + 30.0], "share (%)", how);
            let corners = [
                [left, TOP],
                [at(1.0), TOP],
                [at(1.0), bottom],
                [left, bottom],
                [left, TOP],
            ];
            canvas.line(&corners, FRAME, 0.8);
            canvas.line(
                &[[left, lines_top - 8.0], [at(1.0), lines_top - 8.0]],
                FRAME,
                0.8,
            );
            for (i, name) in names.iter().enumerate() {
                let ink: Ink = palette(color_of(name), 0);
                let mut found = means.iter().filter(|m| {
                    (m.parametrization, m.weight, m.function) == (*name, weight, "sum")
                });
                let Some(mean) = found.next() else {
                    continue;
                };
                let y = mean_y(i);
                if let (Some(low), Some(high)) = (mean.mean_low, mean.mean_high) {
                    canvas.line(&[[at(low), y], [at(high), y]], ink, 1.7);
                    for end in [low, high] {
                        canvas.line(&[[at(end), y - 4.0], [at(end), y + 4.0]], ink, 1.2);
                    }
                }
                canvas.dot([at(mean.mean), y], 3.6, ink);
                if *name != REFERENCE {
                    let [difference, interval] = mean.compared();
                    how = Lettering::new(SIZE, Align::Start);
                    let compared = format!("{difference} ({interval})").replace('-', "−");
                    canvas.text([left + PLOT + 8.0, y], &compared, how);
                }
                for (i, material) in materials.iter().enumerate() {
                    if let Some(share) = of(material, name, weight) {
                        canvas.dot([at(share), line_y(i)], 2.4, ink);
                    }
                }
            }
        }
        let says = format!(
            "{}, sorted by {REFERENCE}, left; axis: logarithm of the rest, 100 % − share; bars: 95 % bootstrap \
             interval over materials; differences are those on the same material",
            count(materials.len(), "material")
        );
        canvas.text(
            [middle, bottom + 54.0],
            &says,
            Lettering::new(11.0, Align::Middle),
        );
        Ok(())
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
