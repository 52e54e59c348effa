//! A BRDF in the planes of the first two axes of parametrizations (Figs. 3 to 5 of Barla et al.
//! 2015, bottom).

use super::plates::{Pixel, Plates, meanings, raster};
use super::plot::{Plane, Plot, bar, log_ticks, middles, text};
use crate::brdf::Brdf;
use crate::numeric::luminance;
use crate::parametrization::ParametrizationSpec;
use crate::registry::Entry;
use crate::report::pictures::slice::{
    Channels32, channel_names, push_layer, values, write_channels,
};
use crate::report::svg::canvas::{Canvas, Ink};
use crate::report::svg::plot::ramp;
use rayon::prelude::*;
use std::io::{self, Seek, Write};

/// Most isolines from the darkest to the brightest.
const LEVELS: f64 = 24.0;

/// Planes of a BRDF: one per parametrization and azimuth.
pub struct BrdfSlices {
    plates: Plates,
    resolution: usize,
    channel_names: &'static [&'static str],
    /// f_r in R, G, B, sr⁻¹: planes of the first parametrization first, row after row from the top.
    pixels: Vec<Vec<Pixel<[f64; 3]>>>,
}

impl BrdfSlices {
    /// Looks at the middles of `resolution` × `resolution` equal cells (clamped to [2, 1024]) of
    /// each plane: first axis to the right, second upwards, azimuth as given (degrees), first
    /// azimuth 0 for BRDFs that are not isotropic.
    pub fn new(
        brdf: &dyn Brdf,
        parametrizations: &[Entry<ParametrizationSpec>],
        phi_deg: &[f64],
        resolution: usize,
    ) -> Self {
        let resolution = resolution.clamp(2, 1024);
        let plates = Plates::new(parametrizations, |_| phi_deg.to_vec(), brdf.symmetry());
        let look = |(plane, phi): &(&Plane, f64)| look(brdf, plane, phi.to_radians(), resolution);
        let planes: Vec<_> = plates.each().collect();
        Self {
            pixels: planes.par_iter().map(look).collect(),
            plates,
            resolution,
            channel_names: channel_names(brdf.channels()),
        }
    }

    /// Every luminance above 0, from small to large.
    fn shown(&self) -> Vec<f64> {
        let values = self.pixels.iter().flatten().filter_map(Pixel::value);
        let values = values.map(|rgb| luminance(*rgb));
        let mut values: Vec<_> = values.filter(|v| *v > 0.0).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// A row per parametrization, a column per azimuth, below a title with the name of the material. Colours go by the
    /// logarithm of luminance, the same in all; so do isolines, in equal steps. Grey: below the horizon; hatched: no data.
    pub fn svg(&self, material: &str) -> String {
        let tone = Tone::from_luminances(&self.shown());
        let title = format!("{material}: BRDF in slices of coordinates, luminance (sr⁻¹)");
        let draw = |canvas: &mut Canvas, plot: &Plot, place: usize| {
            let pixels = &self.pixels[place];
            raster(canvas, plot, pixels, |rgb| match &tone {
                Some(tone) => ramp(tone.place(luminance(*rgb))),
                None => [0; 3],
            });
            // Black is darker than any level.
            let log = |rgb: &[f64; 3]| luminance(*rgb).max(1e-300).ln();
            let logs: Vec<_> = pixels.iter().map(|p| p.value().map(log)).collect();
            for (level, ink) in tone.iter().flat_map(Tone::isolines) {
                plot.isolines(canvas, &logs, level.ln(), ink, 0.7);
            }
        };
        self.plates.svg(&title, draw, |canvas, [middle, below]| {
            meanings(canvas, [middle, below], &self.pixels);
            match &tone {
                Some(tone) => tone.key(canvas, [middle, below + 14.0]),
                None => text(canvas, [middle, below + 20.0], "all is black", 12.0, false),
            }
        })
    }

    /// Writes one OpenEXR file with a layer a plane, named `hybrid.phi_30` (22.5° is `22p5`), each with `Y` or linear
    /// `R`, `G`, `B` (f_r, sr⁻¹), and `A`: 1 where there is a value; errors are those of `out`.
    pub fn write_exr(&self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        let mut list = Channels32::new();
        for ((plane, phi), pixels) in self.plates.each().zip(&self.pixels) {
            // A second point would begin a layer of its own.
            let phi = phi.to_string().replace('.', "p");
            let layer = format!("{}.phi_{phi}.", plane.name);
            let value = |p: &Pixel<_>| p.value().map_or_else(Default::default, |rgb| (*rgb, 1.0));
            let pixels: Vec<_> = pixels.iter().map(value).collect();
            push_layer(&mut list, &layer, self.channel_names, &pixels);
        }
        write_channels(self.resolution, list, out)
    }
}

/// A BRDF at the middles of the pixels of a plane, at an azimuth (rad).
pub(super) fn look(
    brdf: &dyn Brdf,
    plane: &Plane,
    phi: f64,
    resolution: usize,
) -> Vec<Pixel<[f64; 3]>> {
    let pair = |p| plane.form.inverse(&plane.coords(p, phi));
    let pairs: Vec<_> = middles(resolution).map(pair).collect();
    let inside: Vec<_> = pairs.iter().flatten().copied().collect();
    let mut found = values(brdf, &inside).into_iter();
    let pixel = |pair: &Option<_>| match pair {
        None => Pixel::Outside,
        Some(_) => found.next().flatten().map_or(Pixel::Missing, Pixel::Value),
    };
    pairs.iter().map(pixel).collect()
}

/// Colours and isolines of luminance.
struct Tone {
    /// The luminance of the first colour, which darker ones have too, and of the last.
    ends: [f64; 2],
    /// Luminances of the isolines.
    levels: Vec<f64>,
    /// Isolines to a factor of ten.
    per_decade: f64,
}

impl Tone {
    /// From what a hundredth of the pixels is darker than to the brightest; `None` without a value above 0.
    fn from_luminances(shown: &[f64]) -> Option<Self> {
        let (lo, hi) = (*shown.get(shown.len() / 100)?, *shown.last()?);
        // One value has a scale as well.
        let [lo, hi] = match hi / lo > 1.001 {
            true => [lo, hi],
            false => [0.9 * lo, 1.1 * hi],
        };
        let steps = [50.0, 20.0, 10.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5, 0.2];
        let decades = (hi / lo).log10();
        let fits = steps.into_iter().find(|n| decades * n <= LEVELS);
        let per_decade = fits.unwrap_or(0.01);
        let [first, last] = [lo, hi].map(|v| v.log10() * per_decade);
        let steps = first.ceil() as i32..=last.floor() as i32;
        Some(Self {
            ends: [lo, hi],
            levels: steps
                .map(|k| 10f64.powf(f64::from(k) / per_decade))
                .collect(),
            per_decade,
        })
    }

    /// Place on the scale; black is below it.
    fn place(&self, v: f64) -> f64 {
        let [lo, hi] = self.ends;
        (v.max(1e-300) / lo).ln() / (hi / lo).ln()
    }

    /// The luminance of every isoline and its ink, which contrasts with the colour there.
    fn isolines(&self) -> impl Iterator<Item = (f64, Ink)> {
        let ink = |level: f64| [if self.place(level) < 0.55 { 255 } else { 20 }; 3];
        self.levels.iter().map(move |&level| (level, ink(level)))
    }

    /// Draws the colours with the isolines among them.
    fn key(&self, canvas: &mut Canvas, [middle, y]: [f64; 2]) {
        const LENGTH: f64 = 520.0;
        let apart = match self.per_decade {
            n if n >= 1.0 => format!("{n} isolines a decade"),
            n => format!("an isoline every {:.0} decades", 1.0 / n),
        };
        let caption = format!(
            "luminance of the BRDF (sr⁻¹), {apart}: the same in all slices; \
             the darkest colour: {} sr⁻¹ and less",
            number(self.ends[0])
        );
        let ticks = log_ticks(self.ends, LENGTH);
        bar(canvas, [middle, y], LENGTH, ramp, &ticks, &caption);
        for (level, ink) in self.isolines() {
            let x = middle + LENGTH * (self.place(level) - 0.5);
            canvas.line(&[[x, y], [x, y + 14.0]], ink, 0.7);
        }
    }
}

/// A number with two significant digits.
fn number(v: f64) -> String {
    match v.log10().floor() {
        d if (-3.0..4.0).contains(&d) => format!("{v:.*}", (1.0 - d).max(0.0) as usize),
        _ => format!("{v:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_in_equal_ratios_and_brighter_is_brighter() {
        let shown: Vec<f64> = (1..=1000).map(f64::from).collect();
        let tone = Tone::from_luminances(&shown).unwrap();
        let levels = &tone.levels;
        assert!((8..=24).contains(&levels.len()));
        for w in levels.windows(2) {
            assert!(((w[1] / w[0]).log10() * tone.per_decade - 1.0).abs() < 1e-12);
        }
        assert!(levels[0] >= 11.0 && levels[levels.len() - 1] <= 1000.0);
        // Every value has a colour of its own up to the brightest.
        assert!(tone.place(500.0) < tone.place(1000.0) && tone.place(1000.0) <= 1.0);
    }
}
