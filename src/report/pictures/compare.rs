//! Truth, reconstruction and difference as spheres beside each other, with the errors of the
//! picture.
//!
//! A table need not reach the horizon. Light from where the truth or the reconstruction has no data
//! is left out of both, and a pixel that gets most of its light from there is without data: it is
//! no black, so it is hatched, and in no error.

use super::plot::{FRAME, bar, circle, hatched, text};
use super::render::{SpherePair, render_spheres};
use crate::brdf::Brdf;
use crate::lighting::Lighting;
use crate::numeric::luminance;
use crate::report::SphereImage;
use crate::report::pictures::png::encoded;
use crate::report::pictures::slice::write_comparison;
use crate::report::pictures::sphere::with_alpha;
use crate::report::svg::canvas::Canvas;
use std::io::{self, Seek, Write};

/// Pixels between the spheres of a PNG.
const GAP: usize = 8;

/// A pixel that gets more of its light than this from where there is no data is without data.
const UNKNOWN: f64 = 0.5;

/// Spheres of a material and of its reconstruction under the same light.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The material; `None` also in pixels without data.
    pub truth: SphereImage,
    /// Its reconstruction; `None` also in pixels without data.
    pub reconstruction: SphereImage,
    /// RMS of the difference in luminance over RMS of the truth's, over the pixels with data;
    /// `None` if the truth is black there, or there are none.
    pub nrmse: Option<f64>,
    /// Mean of |difference| over the truth's luminance, which counts as a thousandth of its mean at
    /// least; `None` as for `nrmse`.
    pub mean_relative: Option<f64>,
    /// Share of the sphere's pixels that is without data.
    pub without_data: f64,
    /// One flag per pixel: true if it is without data.
    unknown: Vec<bool>,
}

impl Comparison {
    /// Renders both by the same points: see [`render_spheres`].
    pub fn new(
        truth: &dyn Brdf,
        reconstruction: &dyn Brdf,
        lighting: &dyn Lighting,
        resolution: usize,
        samples: usize,
    ) -> Self {
        let mut one = Self::all(truth, &[reconstruction], lighting, resolution, samples);
        one.remove(0)
    }

    /// Comparisons of several reconstructions with one material, all rendered by the same points.
    pub fn all(
        truth: &dyn Brdf,
        reconstructions: &[&dyn Brdf],
        lighting: &dyn Lighting,
        resolution: usize,
        samples: usize,
    ) -> Vec<Self> {
        let pairs = render_spheres(truth, reconstructions, lighting, resolution, samples);
        pairs.into_iter().map(Self::from_spheres).collect()
    }

    fn from_spheres(pair: SpherePair) -> Self {
        let (mut images, left_out) = (pair.images, pair.left_out);
        let unknown: Vec<bool> = left_out.iter().map(|share| *share > UNKNOWN).collect();
        let share = |i: usize| images[0].coverage(i);
        let covered: f64 = (0..unknown.len()).map(share).sum();
        let left_out = unknown.iter().enumerate().filter(|(_, u)| **u);
        let left_out: f64 = left_out.map(|(i, _)| share(i)).sum();
        for image in &mut images {
            for (pixel, _) in image.pixels.iter_mut().zip(&unknown).filter(|(_, u)| **u) {
                *pixel = None;
            }
        }
        let [truth, reconstruction] = images;
        let both = truth.pixels.iter().zip(&reconstruction.pixels).enumerate();
        let both = both.filter_map(|(i, (f, g))| {
            Some([truth.coverage(i), luminance((*f)?), luminance((*g)?)])
        });
        let both: Vec<_> = both.collect();
        let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
            both.iter().map(|[share, f, g]| share * of(*f, *g)).sum()
        };
        let n = sum(&|_, _| 1.0);
        let mean = sum(&|f, _| f) / n;
        let squares = sum(&|f, g| (g - f).powi(2));
        let of_truth = sum(&|f, _| f * f);
        let relative = sum(&|f, g| (g - f).abs() / f.max(1e-3 * mean));
        let defined = of_truth > 0.0;
        Self {
            nrmse: defined.then(|| (squares / of_truth).sqrt()),
            mean_relative: defined.then(|| relative / n),
            without_data: left_out / covered,
            truth,
            reconstruction,
            unknown,
        }
    }

    /// Errors of the picture for people: "–" if they are not defined, and the share of the sphere
    /// without data if there is one.
    pub fn errors(&self) -> String {
        let shown = |v: Option<f64>| v.map_or("–".into(), |v| format!("{v:.4}"));
        let mut text = format!(
            "image nrmse {}, mean relative {}",
            shown(self.nrmse),
            shown(self.mean_relative)
        );
        if self.without_data > 0.0 {
            text += &format!("; {:.1} % without data", 100.0 * self.without_data);
        }
        text
    }

    /// Width and height of the PNG.
    pub(crate) fn size(&self) -> [usize; 2] {
        let side = self.truth.resolution;
        [3 * side + 2 * GAP, side]
    }

    /// Truth, reconstruction and difference side by side as a PNG file: the first two over the
    /// truth's white, the third from blue (too dark) over white to red (too bright), on the one scale that
    /// all comparisons have: see [`svg`](Self::svg). Hatched in all: no data; beside the spheres it is transparent.
    pub fn png(&self) -> Vec<u8> {
        let side = self.truth.resolution;
        let white = self.truth.white();
        // Stripes as wide on a small sphere as on a large one.
        let stripe = (side / 32).max(1);
        let both = [&self.truth, &self.reconstruction];
        let colour = |sphere: usize, i: usize| match sphere {
            _ if self.unknown[i] => hatched(i, side, stripe),
            0 | 1 => both[sphere].shown(i, white),
            _ => {
                let [f, g] = both.map(|image| image.pixels[i].map_or(0.0, luminance));
                signed(place((g - f) / white))
            }
        };
        let mut pixels = Vec::with_capacity(self.size()[0] * side);
        for row in 0..side {
            for sphere in 0..3 {
                if sphere > 0 {
                    pixels.extend([[0; 4]; GAP]);
                }
                let row = row * side..(row + 1) * side;
                pixels.extend(row.map(|i| with_alpha(colour(sphere, i), self.truth.coverage(i))));
            }
        }
        encoded(&pixels, self.size()[0])
    }

    /// Writes one OpenEXR file with the layers `truth`, `reconstruction` and `difference`
    /// (reconstruction − truth), each with `A`, the share of a pixel that the sphere covers (0 without
    /// data), and linear `R`, `G`, `B`, which are multiplied by it; errors are those of `out`.
    pub fn write_exr(&self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        let [f, g] = [&self.truth, &self.reconstruction].map(SphereImage::covered);
        write_comparison(self.truth.resolution, &["R", "G", "B"], [f, g], out)
    }

    /// `png`, which is what [`png`](Self::png) returns, with names and errors around it, and the scale of differences: their luminance over the
    /// truth's white, signed, by its logarithm. The scale is the same for all comparisons, so that pictures
    /// beside each other rank what they show.
    pub fn svg(&self, title: &str, png: &[u8]) -> String {
        const SIDE: f64 = 256.0;
        const TOP: f64 = 66.0;
        let scale = SIDE / self.truth.resolution as f64;
        let size = self.size().map(|v| v as f64 * scale);
        let paper = [size[0] + 32.0, TOP + size[1] + 104.0];
        Canvas::titled(title, paper, 22.0, |canvas| {
            let middle = 16.0 + 0.5 * size[0];
            let names = ["truth", "reconstruction", "difference"];
            let place_of = |i: usize| 16.0 + i as f64 * (size[0] - SIDE) / 2.0 + 0.5 * SIDE;
            for (i, name) in names.into_iter().enumerate() {
                text(canvas, [place_of(i), 52.0], name, 13.0, false);
            }
            canvas.image([16.0, TOP], size, png);
            // White is a difference too: where none is the sphere still ends.
            let r = 0.5 * SIDE;
            let rim = circle(120).map(|[c, s]| [place_of(2) + r * c, TOP + r + r * s]);
            canvas.line(&rim.collect::<Vec<_>>(), FRAME, 0.8);
            let below = TOP + size[1] + 20.0;
            let hatched = match self.without_data > 0.0 {
                true => " (hatched)",
                false => "",
            };
            let errors = self.errors() + hatched;
            text(canvas, [middle, below], &errors, 12.5, false);
            let says = "difference in luminance over the truth's white (the same scale in all pictures): blue too dark, \
                        red too bright, white within ±0.001";
            signed_bar(canvas, [middle, below + 20.0], 1.0, says)
        })
    }
}

/// The smallest difference, over the truth's white, that has a colour.
pub(in crate::report) const LEAST: f64 = 1e-3;

/// Place of a difference on the scale of colours, in [−1, 1]: its logarithm from [`LEAST`] to 1.
pub(super) fn place(difference: f64) -> f64 {
    let size = (difference.abs() / LEAST).max(1.0).ln() / (1.0 / LEAST).ln();
    size.min(1.0).copysign(difference)
}

/// The colour of a place: from dark blue (−1) over white to dark red (1), evenly darker to both sides.
pub(in crate::report) fn signed(t: f64) -> [u8; 3] {
    /// At 0, 1/3, 2/3 and 1, one and the other side (Brewer's RdBu).
    const COLOURS: [[[f64; 3]; 4]; 2] = [
        [
            [255.0, 255.0, 255.0],
            [253.0, 219.0, 199.0],
            [214.0, 96.0, 77.0],
            [103.0, 0.0, 31.0],
        ],
        [
            [255.0, 255.0, 255.0],
            [209.0, 229.0, 240.0],
            [67.0, 147.0, 195.0],
            [5.0, 48.0, 97.0],
        ],
    ];
    let side = &COLOURS[usize::from(t < 0.0)];
    let at = 3.0 * t.abs().min(1.0);
    let first = (at as usize).min(2);
    let rest = at - first as f64;
    [0, 1, 2].map(|c| {
        let [a, b] = [side[first][c], side[first + 1][c]];
        (a + rest * (b - a)).round() as u8
    })
}

/// Draws the scale of colours of differences, with differences below it in a unit of which there are `units` in 1.
pub(super) fn signed_bar(canvas: &mut Canvas, at: [f64; 2], units: f64, says: &str) {
    let tick = |difference: f64| {
        let number = (units * difference).to_string().replace('-', "−");
        (0.5 + 0.5 * place(difference), number)
    };
    let ticks = [-1.0, -0.1, -0.01, 0.0, 0.01, 0.1, 1.0].map(tick);
    bar(canvas, at, 520.0, |t| signed(2.0 * t - 1.0), &ticks, says)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_differences_are_darker_and_signs_have_their_hue() {
        let lightness = |d: f64| signed(place(d)).iter().map(|c| i32::from(*c)).sum::<i32>();
        for sign in [-1.0, 1.0] {
            let sizes = (0..30).map(|i| LEAST * 10f64.powf(f64::from(i) / 10.0));
            let all: Vec<i32> = sizes.map(|d| lightness(sign * d)).collect();
            assert!(all.windows(2).all(|w| w[1] < w[0]), "{all:?}");
        }
        let [blue, red] = [-0.02, 0.02].map(|d| signed(place(d)));
        assert!(blue[2] > blue[0] && red[0] > red[2]);
        assert_eq!([0.0, 0.5 * LEAST].map(|d| signed(place(d))), [[255; 3]; 2]);
        assert_eq!(signed(place(-7.0)), signed(-1.0));
    }
}
