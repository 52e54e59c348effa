//! Where a reconstruction is uncertain, over the directions of the sensor.

use super::plot::{DARK, FRAME, Plot, Swatch, bar, circle, middles, swatches, text};
use crate::geometry::DirectionPair;
use crate::reconstruct::{Cover, Coverage};
use crate::report::svg::canvas::{Canvas, Ink};
use crate::report::svg::plot::ramp;
use std::f64::consts::FRAC_PI_2;

/// Polar angles of the light, degrees.
const THETA_I_DEG: [f64; 3] = [0.0, 30.0, 60.0];

const SIDE: f64 = 230.0;
const PIXELS: usize = 160;
const MARGIN: f64 = 18.0;
const GAP: f64 = 34.0;
const TOP: f64 = 78.0;

/// Where no reading is near.
const UNKNOWN: Ink = [150; 3];

/// Every other stripe where readings lie on one side.
const STRIPE: Ink = [255; 3];

/// Where readings surround a pair, without uncertainties.
const KNOWN: Ink = [0x56, 0xb4, 0xe9];

/// Relative standard uncertainties (k = 1) of a reconstruction.
#[derive(Clone, Copy)]
pub(crate) struct Relative<'a> {
    /// u/f at pairs; infinite where the reconstruction is black and yet uncertain.
    pub at: &'a dyn Fn(&[DirectionPair]) -> Vec<f64>,
    /// What they are of, in the legend: `those of its readings`.
    pub of: &'a str,
}

/// Polar maps of the relative standard uncertainty (k = 1) of a reconstruction: the polar angle of the sensor
/// outwards from 0° to 90°, light at 0°, 30° and 60° with azimuth 0 to the right. Colours go by the logarithm,
/// the same in all maps. Striped where readings do not surround a pair, grey where none is near; without
/// uncertainties that is all there is to see.
pub(crate) fn uncertainty_svg(
    title: &str,
    relative: Option<Relative<'_>>,
    cover: &Cover,
) -> String {
    let maps = THETA_I_DEG.map(|theta| Map::new(theta.to_radians(), relative, cover));
    let scale = relative.map(|_| Scale::covering(maps.iter().flat_map(Map::known)));
    let width = 2.0 * MARGIN + 3.0 * SIDE + 2.0 * GAP;
    let below = TOP + SIDE + 22.0;
    Canvas::titled(title, [width, below + 104.0], 22.0, |canvas| {
        let middle = 0.5 * width;
        for (i, (map, theta)) in maps.iter().zip(THETA_I_DEG).enumerate() {
            let plot = Plot::new([MARGIN + i as f64 * (SIDE + GAP), TOP], SIDE);
            let above = [plot.at[0] + 0.5 * SIDE, TOP - 18.0];
            text(canvas, above, &format!("θ_i = {theta}°"), 13.0, true);
            plot.raster(canvas, &map.colours(scale.as_ref()));
            rings(canvas, &plot, theta);
        }
        if let (Some(scale), Some(relative)) = (&scale, relative) {
            scale.key(canvas, [middle, below], relative.of);
        }
        let known = if scale.is_some() { ramp(0.4) } else { KNOWN };
        let meanings = [
            Swatch::new(known, "readings surround it"),
            Swatch {
                stripes: Some(STRIPE),
                ..Swatch::new(known, "readings on one side only")
            },
            Swatch::new(UNKNOWN, "no reading within 30°"),
        ];
        let shown = &meanings[usize::from(scale.is_some())..];
        swatches(canvas, [middle, below + 66.0], shown);
        let says = "rings: θ_o = 30°, 60°, 90°;  circle: the light, at azimuth 0;  dot: its mirror direction";
        text(canvas, [middle, below + 88.0], says, 11.5, false);
    })
}

/// What is known at the pixels of a map.
struct Map(Vec<Option<(Coverage, Option<f64>)>>);

impl Map {
    fn new(theta_i: f64, relative: Option<Relative<'_>>, cover: &Cover) -> Self {
        let pixels: Vec<_> = middles(PIXELS).map(|p| pair(theta_i, p)).collect();
        let pairs: Vec<_> = pixels.iter().flatten().copied().collect();
        let relative = relative.map(|relative| (relative.at)(&pairs));
        let coverages = cover.coverages(&pairs);
        let mut known = (0..pairs.len()).map(|i| {
            let relative = relative.as_ref().map(|of| of[i]);
            (coverages[i], relative)
        });
        let pixels = pixels.iter().map(|pair| pair.and_then(|_| known.next()));
        Self(pixels.collect())
    }

    /// Relative uncertainties where a reading is near.
    fn known(&self) -> impl Iterator<Item = f64> {
        let near = |(coverage, _): &&(Coverage, _)| *coverage != Coverage::Unknown;
        let pixels = self.0.iter().flatten().filter(near);
        pixels.filter_map(|(_, relative)| *relative)
    }

    fn colours(&self, scale: Option<&Scale>) -> Vec<Ink> {
        let colour = |(i, pixel): (usize, &Option<(Coverage, Option<f64>)>)| {
            let Some((coverage, relative)) = pixel else {
                return [255; 3];
            };
            let known = match (scale, relative) {
                (Some(scale), Some(relative)) => ramp(scale.place(*relative)),
                _ => KNOWN,
            };
            match coverage {
                Coverage::Interpolated => known,
                Coverage::Extrapolated if (i % PIXELS + i / PIXELS) % 6 < 3 => STRIPE,
                Coverage::Extrapolated => known,
                Coverage::Unknown => UNKNOWN,
            }
        };
        self.0.iter().enumerate().map(colour).collect()
    }
}

/// The pair at a point of the unit square, `None` beside the disk.
fn pair(theta_i: f64, point: [f64; 2]) -> Option<DirectionPair> {
    let [x, y] = point.map(|t| 2.0 * t - 1.0);
    let r = x.hypot(y);
    let pair = || DirectionPair::from_spherical(theta_i, 0.0, r * FRAC_PI_2, y.atan2(x));
    (r < 1.0).then(pair)
}

/// Draws rings of the polar angle, and the directions of light and mirror.
fn rings(canvas: &mut Canvas, plot: &Plot, theta_deg: f64) {
    for (ring, ink, width) in [(30.0, FRAME, 0.6), (60.0, FRAME, 0.6), (90.0, DARK, 1.3)] {
        let points = circle(180).map(|p| p.map(|v| 0.5 + v * ring / 180.0));
        let points: Vec<_> = points.collect();
        plot.line(canvas, &points, ink, width);
    }
    let away = theta_deg / 180.0;
    let [light, mirror] = [0.5 + away, 0.5 - away].map(|x| plot.place([x, 0.5]));
    canvas.dot(light, 5.6, DARK);
    canvas.dot(light, 4.2, [255; 3]);
    canvas.dot(mirror, 3.4, [255; 3]);
    canvas.dot(mirror, 2.4, DARK);
}

/// Colours of relative uncertainties.
struct Scale {
    /// The ends and what is written between them, 1, 2 or 5 times a power of ten.
    levels: Vec<f64>,
}

impl Scale {
    /// A scale that shows all but a hundredth at either end, of two to six steps (two decades).
    fn covering(relative: impl Iterator<Item = f64>) -> Self {
        let mut shown: Vec<f64> = relative.filter(|r| *r > 0.0 && r.is_finite()).collect();
        shown.sort_by(f64::total_cmp);
        let at = |i: usize| shown.get(i).copied().unwrap_or(0.01);
        let ends = [at(shown.len() / 100), at(shown.len() * 99 / 100)];
        let steps = (-8..=2).flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
        let steps: Vec<f64> = steps.collect();
        let last = steps.len() - 1;
        let lo = steps.partition_point(|s| *s <= ends[0]).clamp(1, last - 1) - 1;
        let hi = steps.partition_point(|s| *s <= ends[1]).clamp(lo + 2, last);
        let lo = lo.max(hi.saturating_sub(6));
        Self {
            levels: steps[lo..=hi].to_vec(),
        }
    }

    /// Place on the scale, in [0, 1].
    fn place(&self, relative: f64) -> f64 {
        let [lo, hi] = [self.levels[0], self.levels[self.levels.len() - 1]];
        ((relative / lo).ln() / (hi / lo).ln()).clamp(0.0, 1.0)
    }

    /// Draws the scale with its levels.
    fn key(&self, canvas: &mut Canvas, at: [f64; 2], of: &str) {
        let tick = |level: &f64| {
            // As many digits as the smallest level has.
            let percent = format!("{:.7}", 100.0 * level);
            let percent = percent.trim_end_matches('0').trim_end_matches('.');
            (self.place(*level), format!("{percent} %"))
        };
        let ticks: Vec<_> = self.levels.iter().map(tick).collect();
        let says = format!("relative standard uncertainty of the BRDF, u/f (k = 1), from {of}");
        bar(canvas, at, 440.0, ramp, &ticks, &says)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::iter::repeat_n;

    #[test]
    fn scales_end_at_round_numbers_around_what_is_shown() {
        let ends = |of: &[f64]| {
            let levels = Scale::covering(of.iter().copied()).levels;
            [levels[0], levels[levels.len() - 1]]
        };
        let close =
            |got: [f64; 2], want: [f64; 2]| (0..2).all(|i| (got[i] / want[i] - 1.0).abs() < 1e-9);
        assert!(close(ends(&[0.013, 0.04, 0.07]), [0.01, 0.1]));
        // One value has colours on both sides.
        assert!(close(ends(&[0.03]), [0.02, 0.1]));
        assert!(close(ends(&[]), [0.01, 0.05]));
        // A black pixel is off every scale, and so is an uncertainty of 0.
        let black = [0.02, 0.03, f64::INFINITY, 0.0];
        assert!(close(ends(&black), [0.02, 0.1]));
        let many: Vec<f64> = repeat_n(1e-7, 50).chain(repeat_n(0.03, 50)).collect();
        let [lo, hi] = ends(&many);
        assert!(close([lo, hi], [hi / 100.0, 0.05]), "{lo} {hi}");
        let scale = Scale::covering([0.01, 0.1].into_iter());
        assert_eq!([scale.place(0.0), scale.place(f64::INFINITY)], [0.0, 1.0]);
    }

    #[test]
    fn maps_have_the_light_where_it_is_drawn() {
        let theta = 0.5;
        let at = |theta_o: f64| pair(theta, [0.5 + 0.5 * theta_o / FRAC_PI_2, 0.5]);
        assert!(at(theta).unwrap().separation() < 1e-12);
        let mirror = pair(theta, [0.5 - 0.5 * theta / FRAC_PI_2, 0.5]).unwrap();
        assert!(mirror.half().truncate().length() < 1e-12);
        assert!(pair(theta, [0.99, 0.99]).is_none());
    }
}
