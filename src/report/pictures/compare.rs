//! Truth, reconstruction and difference as spheres beside each other, with the errors of the
//! picture.
//!
//! A table need not reach the horizon. Light from where the truth or the reconstruction has no data
//! is left out of both, and a pixel that gets most of its light from there is without data: it is
//! no black, so it is hatched, and in no error.

use super::render::render_spheres;
use crate::brdf::Brdf;
use crate::lighting::Lighting;
use crate::numeric::luminance;
use crate::report::SphereImage;
use crate::report::pictures::slice::{Channels32, channel, write_channels};
use crate::report::pictures::sphere::{encoded, write_rgb};
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
        let brdfs = [truth, reconstruction];
        let (mut images, left_out) = render_spheres(brdfs, lighting, resolution, samples);
        let unknown: Vec<bool> = left_out.iter().map(|share| *share > UNKNOWN).collect();
        let sphere = images[0].pixels.iter().flatten().count();
        for image in &mut images {
            for (pixel, _) in image.pixels.iter_mut().zip(&unknown).filter(|(_, u)| **u) {
                *pixel = None;
            }
        }
        let [truth, reconstruction] = images;
        let both = truth.pixels.iter().zip(&reconstruction.pixels);
        let both = both.filter_map(|(f, g)| Some([luminance((*f)?), luminance((*g)?)]));
        let both: Vec<_> = both.collect();
        let n = both.len() as f64;
        let mean = both.iter().map(|[f, _]| f).sum::<f64>() / n;
        let squares: f64 = both.iter().map(|[f, g]| (g - f).powi(2)).sum();
        let of_truth: f64 = both.iter().map(|[f, _]| f * f).sum();
        let relative: f64 = both
            .iter()
            .map(|[f, g]| (g - f).abs() / f.max(1e-3 * mean))
            .sum();
        let defined = of_truth > 0.0;
        Self {
            nrmse: defined.then(|| (squares / of_truth).sqrt()),
            mean_relative: defined.then(|| relative / n),
            without_data: unknown.iter().filter(|u| **u).count() as f64 / sphere.max(1) as f64,
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

    /// The difference shown as the strongest red and blue, over the truth's white: the first of
    /// …, 0.1, 0.2, 0.5, 1, … that 99 % of the sphere stay below.
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
    /// [`range`](Self::range). Hatched in all: no data.
    ///
    /// # Errors
    /// Whatever `out` reports.
    pub fn write_png(&self, out: &mut impl Write) -> io::Result<()> {
        let side = self.truth.resolution;
        let white = self.truth.white();
        let shown = |p: Option<[f64; 3]>| p.map_or([255; 3], |c| c.map(|v| encoded(v / white)));
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
        // Stripes as wide on a small sphere as on a large one.
        let stripe = (side / 32).max(1);
        let hatched = |at: usize| match (at % side + at / side) / stripe % 2 {
            0 => [150; 3],
            _ => [190; 3],
        };
        let or_hatched = |at: usize, colour| match self.unknown[at] {
            true => hatched(at),
            false => colour,
        };
        let differences: Vec<_> = self.differences().map(signed).collect();
        let mut bytes = Vec::with_capacity(3 * self.size()[0] * side);
        for row in 0..side {
            let at = row * side..(row + 1) * side;
            for image in [&self.truth, &self.reconstruction] {
                let colour = |i| or_hatched(i, shown(image.pixels[i]));
                bytes.extend(at.clone().flat_map(colour));
                bytes.extend([255; 3 * GAP]);
            }
            bytes.extend(at.flat_map(|i| or_hatched(i, differences[i])));
        }
        write_rgb(&bytes, self.size()[0], out)
    }

    /// Writes one OpenEXR file with the layers `truth`, `reconstruction` and `difference`
    /// (reconstruction − truth), each with linear `R`, `G`, `B`, and `A`: 1 on the sphere
    /// where there are data.
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
            );
            for (i, name) in ["truth", "reconstruction", "difference"]
                .into_iter()
                .enumerate()
            {
                let x = 16.0 + i as f64 * (size[0] - SIDE) / 2.0 + 0.5 * SIDE;
                text(canvas, [x, 52.0], name, 13.0, false);
            }
            canvas.image([16.0, TOP], size, &png);
            let r = self.range();
            let hatched = if self.without_data > 0.0 {
                " (hatched)"
            } else {
                ""
            };
            let caption = format!(
                "{}{hatched}; difference in luminance: blue −{r}, red +{r} of white",
                self.errors()
            );
            text(
                canvas,
                [middle, TOP + size[1] + 22.0],
                &caption,
                12.5,
                false,
            );
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Channels, Lambert, Presence, Spectrum};
    use crate::geometry::{DirectionPair, Symmetry};
    use crate::lighting::{LightingSpec, SkySpec};
    use std::f64::consts::PI;

    fn compare(truth: f64, other: f64) -> Comparison {
        let [f, g] = [truth, other].map(|a| Lambert::new(Spectrum::Grey(a), Channels::Rgb));
        let sky = SkySpec::default().build().unwrap();
        Comparison::new(&f, &g, &*sky, 24, 8)
    }

    #[test]
    fn the_errors_of_a_darker_copy_are_exact() {
        // By the same points a copy of 0.4 times the albedo is 0.4 times the picture, noise and all.
        let darker = compare(0.5, 0.2);
        let near = |v: Option<f64>| (v.unwrap() - 0.6).abs() < 1e-12;
        assert!(near(darker.nrmse) && near(darker.mean_relative));
        assert!((0.2..=1.0).contains(&darker.range()), "{}", darker.range());
        let same = compare(0.5, 0.5);
        assert_eq!((same.nrmse, same.mean_relative), (Some(0.0), Some(0.0)));
        // Relative to nothing.
        for grey in [0.0, 0.3] {
            let black = compare(0.0, grey);
            assert_eq!((black.nrmse, black.mean_relative), (None, None));
            assert_eq!(black.errors(), "image nrmse –, mean relative –");
        }
    }

    /// Reflects like a matte surface of albedo 0.5, and has no data beyond some elevation of light
    /// or view.
    struct Bounded(f64);

    impl Brdf for Bounded {
        fn channels(&self) -> &Channels {
            &Channels::Luminance
        }
        fn symmetry(&self) -> Symmetry {
            Symmetry::FULL
        }
        fn conserves_energy(&self) -> bool {
            true
        }
        fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
            out[0] = 0.5 / PI;
            if pair.omega_i.theta().max(pair.omega_o.theta()) > self.0 {
                out[0] = 0.0;
                return Presence::Missing;
            }
            Presence::Present
        }
    }

    #[test]
    fn missing_data_are_not_black() {
        let entries = crate::lighting::all();
        let even = entries.iter().find(|e| e.kind == "constant").unwrap();
        let even = crate::registry::read_text(even, "")
            .unwrap()
            .build()
            .unwrap();
        let bound = 70_f64.to_radians();
        let matte = |albedo| Lambert::new(Spectrum::Grey(albedo), Channels::Luminance);
        // Whichever of the two lacks data: what both have is equal, or 0.4 of it.
        let bounded = Bounded(bound);
        for (truth, other, want) in [
            (&bounded as &dyn Brdf, &matte(0.5) as &dyn Brdf, 0.0),
            (&matte(0.5), &bounded, 0.0),
            (&bounded, &matte(0.2), 0.6),
        ] {
            let found = Comparison::new(truth, other, &*even, 64, 32);
            for error in [found.nrmse, found.mean_relative] {
                assert!((error.unwrap() - want).abs() < 1e-12, "{error:?} {want}");
            }
            // The ring of the disk beyond sin 70°, within a pixel of its edge; other views have
            // sin² 70° of their light from within 70°.
            let ring = 1.0 - bound.sin().powi(2);
            assert!((found.without_data - ring).abs() < 0.04, "{found:?}");
            let said = found.errors();
            assert!(said.ends_with("% without data"), "{said}");
            let mut png = Vec::new();
            found.write_png(&mut png).unwrap();
            let picture = image::load_from_memory(&png).unwrap().into_rgb8();
            // The leftmost pixels of the sphere.
            for x in [0, 64 + 8, 2 * (64 + 8)] {
                let [r, g, b] = picture.get_pixel(x, 32).0;
                assert!((r == 150 || r == 190) && r == g && g == b, "{x}: {r}");
            }
        }
        let nothing = Comparison::new(&Bounded(0.0), &matte(0.5), &*even, 16, 8);
        assert_eq!((nothing.nrmse, nothing.without_data), (None, 1.0));
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

    #[test]
    fn plates_quote_the_errors() {
        let svg = compare(0.5, 0.2).svg("half").unwrap();
        assert!(svg.contains("nrmse 0.6000") && svg.contains("reconstruction"));
        assert_eq!(svg.matches("<image").count(), 1);
    }
}
