//! Truth, reconstruction and difference as spheres beside each other, with the errors of the
//! picture.

use super::render::render_spheres;
use crate::brdf::Brdf;
use crate::lighting::Lighting;
use crate::numeric::luminance;
use crate::report::SphereImage;
use crate::report::slice::{Channels32, channel, write_channels};
use crate::report::sphere::{encoded, write_rgb};
use std::io::{self, Seek, Write};

/// Pixels between the spheres of a PNG.
const GAP: usize = 8;

/// A material and what was made of it under the same light.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The material.
    pub truth: SphereImage,
    /// Its reconstruction.
    pub reconstruction: SphereImage,
    /// RMS of the difference in luminance over RMS of the truth's, over the sphere.
    pub nrmse: f64,
    /// Mean of |difference| over the truth's luminance, which counts as a thousandth of its mean at
    /// least.
    pub mean_relative: f64,
}

impl Comparison {
    /// Renders both by the same points: see [`render_spheres`]. Pairs without data reflect
    /// nothing, in either.
    pub fn new(
        truth: &dyn Brdf,
        reconstruction: &dyn Brdf,
        lighting: &dyn Lighting,
        resolution: usize,
        samples: usize,
    ) -> Self {
        let images = render_spheres([truth, reconstruction], lighting, resolution, samples);
        let [truth, reconstruction] = images;
        let both = truth.pixels.iter().zip(&reconstruction.pixels);
        let both = both.filter_map(|(f, g)| Some([luminance((*f)?), luminance((*g)?)]));
        let both: Vec<_> = both.collect();
        let n = both.len().max(1) as f64;
        let mean = both.iter().map(|[f, _]| f).sum::<f64>() / n;
        let squares: f64 = both.iter().map(|[f, g]| (g - f).powi(2)).sum();
        let of_truth: f64 = both.iter().map(|[f, _]| f * f).sum();
        let relative = |[f, g]: &[f64; 2]| (g - f).abs() / f.max(1e-3 * mean);
        // Darkness equals darkness.
        let over = |a: f64, b: f64| if a == 0.0 { 0.0 } else { a / b };
        Self {
            nrmse: over(squares.sqrt(), of_truth.sqrt()),
            mean_relative: both
                .iter()
                .map(|v| if v[0] == v[1] { 0.0 } else { relative(v) })
                .sum::<f64>()
                / n,
            truth,
            reconstruction,
        }
    }

    /// What the strongest red and blue of the difference stand for, over the truth's white: the
    /// first of …, 0.1, 0.2, 0.5, 1, … that 99 % of the sphere stay below.
    pub fn range(&self) -> f64 {
        let white = self.truth.white();
        let mut sizes: Vec<f64> = self.differences().flatten().map(f64::abs).collect();
        sizes.sort_by(f64::total_cmp);
        let most = sizes.get(sizes.len() * 99 / 100).copied().unwrap_or(0.0) / white;
        let steps = (-4..=3).flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
        steps.into_iter().find(|s| *s >= most).unwrap_or(1e4)
    }

    /// Reconstruction − truth in luminance.
    fn differences(&self) -> impl Iterator<Item = Option<f64>> {
        let both = self.truth.pixels.iter().zip(&self.reconstruction.pixels);
        both.map(|(f, g)| Some(luminance((*g)?) - luminance((*f)?)))
    }

    /// Width and height of the PNG.
    pub fn size(&self) -> [usize; 2] {
        let side = self.truth.resolution;
        [3 * side + 2 * GAP, side]
    }

    /// Writes truth, reconstruction and difference side by side as PNG: the first two over the
    /// truth's white, the third from blue (too dark) over white to red (too bright), see
    /// [`range`](Self::range).
    ///
    /// # Errors
    /// Whatever `out` reports.
    pub fn write_png(&self, out: &mut impl Write) -> io::Result<()> {
        let side = self.truth.resolution;
        let white = self.truth.white();
        let shown = |p: &Option<[f64; 3]>| p.map_or([255; 3], |c| c.map(|v| encoded(v / white)));
        let largest = white * self.range();
        let signed = |d: Option<f64>| {
            let t = d.map_or(0.0, |d| (d / largest).clamp(-1.0, 1.0));
            let other = (255.0 * (1.0 - t.abs())) as u8;
            // Beside the sphere it is grey: there white says that nothing differs.
            match d {
                None => [205; 3],
                Some(_) if t > 0.0 => [255, other, other],
                Some(_) => [other, other, 255],
            }
        };
        let differences: Vec<_> = self.differences().map(signed).collect();
        let mut bytes = Vec::with_capacity(3 * self.size()[0] * side);
        for row in 0..side {
            let at = row * side..(row + 1) * side;
            for image in [&self.truth, &self.reconstruction] {
                bytes.extend(image.pixels[at.clone()].iter().flat_map(shown));
                bytes.extend([255; 3 * GAP]);
            }
            bytes.extend(differences[at].as_flattened());
        }
        write_rgb(&bytes, self.size()[0], out)
    }

    /// Writes one OpenEXR file with the layers `truth`, `reconstruction` and `difference`
    /// (reconstruction − truth), each with linear `R`, `G`, `B`, and `A`: 1 on the sphere.
    ///
    /// # Errors
    /// Whatever `out` reports.
    pub fn write_exr(&self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        let mut list = Channels32::new();
        let pixel = |p: &Option<[f64; 3]>, c: usize| p.map_or(0.0, |p| p[c]);
        let (f, g) = (&self.truth.pixels, &self.reconstruction.pixels);
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            list.push(channel("truth", name, f.iter().map(|p| pixel(p, c))));
            list.push(channel(
                "reconstruction",
                name,
                g.iter().map(|p| pixel(p, c)),
            ));
            let both = f.iter().zip(g);
            let minus = both.map(|(f, g)| pixel(g, c) - pixel(f, c));
            list.push(channel("difference", name, minus));
        }
        for layer in ["truth", "reconstruction", "difference"] {
            let alpha = f.iter().map(|p| f64::from(u8::from(p.is_some())));
            list.push(channel(layer, "A", alpha));
        }
        write_channels([self.truth.resolution; 2], list, out)
    }

    /// The PNG with names and errors around it.
    ///
    /// # Errors
    /// [`Error::Internal`](crate::Error::Internal) if drawing fails, which it should not.
    #[cfg(feature = "plots")]
    pub fn svg(&self, title: &str) -> Result<String, crate::Error> {
        use super::plot::text;
        use crate::report::svg::canvas::{Canvas, fitted};
        const SIDE: f64 = 256.0;
        const TOP: f64 = 66.0;
        let mut png = Vec::new();
        self.write_png(&mut png)
            .map_err(|e| crate::Error::Internal(format!("cannot draw: {e}")))?;
        let scale = SIDE / self.truth.resolution as f64;
        let size = self.size().map(|v| v as f64 * scale);
        Canvas::draw([size[0] + 32.0, TOP + size[1] + 44.0], |canvas| {
            let middle = 16.0 + 0.5 * size[0];
            text(
                canvas,
                [middle, 22.0],
                &fitted(title, 18.0, size[0]),
                16.0,
                true,
            )?;
            for (i, name) in ["truth", "reconstruction", "difference"]
                .into_iter()
                .enumerate()
            {
                let x = 16.0 + i as f64 * (size[0] - SIDE) / 2.0 + 0.5 * SIDE;
                text(canvas, [x, 52.0], name, 13.0, false)?;
            }
            canvas.image([16.0, TOP], size, &png);
            let caption = format!(
                "image nrmse {:.4}, mean relative {:.4}; difference in luminance: \
                 blue −{r}, red +{r} of white",
                self.nrmse,
                self.mean_relative,
                r = self.range(),
            );
            text(
                canvas,
                [middle, TOP + size[1] + 22.0],
                &caption,
                12.5,
                false,
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Channels, Lambert, Spectrum};
    use crate::lighting::{LightingSpec, SkySpec};

    fn compare(truth: f64, other: f64) -> Comparison {
        let [f, g] = [truth, other].map(|a| Lambert::new(Spectrum::Grey(a), Channels::Rgb));
        let sky = SkySpec::default().build().unwrap();
        Comparison::new(&f, &g, &*sky, 24, 8)
    }

    #[test]
    fn the_errors_of_a_darker_copy_are_exact() {
        // By the same points a copy of 0.4 times the albedo is 0.4 times the picture, noise and all.
        let darker = compare(0.5, 0.2);
        assert!((darker.nrmse - 0.6).abs() < 1e-12 && (darker.mean_relative - 0.6).abs() < 1e-12);
        assert!((0.2..=1.0).contains(&darker.range()), "{}", darker.range());
        let same = compare(0.5, 0.5);
        assert_eq!((same.nrmse, same.mean_relative), (0.0, 0.0));
        let black = compare(0.0, 0.0);
        assert_eq!((black.nrmse, black.mean_relative), (0.0, 0.0));
    }

    #[test]
    fn pictures_lie_side_by_side() {
        let darker = compare(0.5, 0.2);
        let mut png = Vec::new();
        darker.write_png(&mut png).unwrap();
        let picture = image::load_from_memory(&png).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (3 * 24 + 16, 24));
        let at = |x: u32| picture.get_pixel(x, 8).0;
        let [truth, copy, difference] = [12, 44, 76].map(at);
        assert!(truth[0] > copy[0] && copy[0] > 0);
        assert!(
            difference[2] == 255 && difference[0] < 255,
            "{difference:?}"
        );
        assert_eq!((at(27), picture.get_pixel(64, 0).0), ([255; 3], [205; 3]));
        let mut exr = io::Cursor::new(Vec::new());
        darker.write_exr(&mut exr).unwrap();
        assert!(exr.into_inner().starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    }

    #[cfg(feature = "plots")]
    #[test]
    fn plates_quote_the_errors() {
        let svg = compare(0.5, 0.2).svg("half").unwrap();
        assert!(svg.contains("nrmse 0.6000") && svg.contains("reconstruction"));
        assert_eq!(svg.matches("<image").count(), 1);
    }
}
