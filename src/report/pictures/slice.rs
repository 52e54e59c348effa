//! A picture of a reconstruction: one slice of truth, reconstruction and difference.
//!
//! The slice is the hemisphere of omega_i seen from above, at theta_o = 45°, phi_o = 0: pixel
//! (x, y) of the unit disk is the direction (x, y, sqrt(1 − x² − y²)), x to the right and y up, so
//! that the mirror direction lies left of the centre. Values are f_r in sr⁻¹.
//!
//! One OpenEXR file with 32-bit channels in three layers: `truth`, `reconstruction` and
//! `difference` (reconstruction − truth, signed), each with `Y` or linear-sRGB `R`, `G`, `B`, and
//! `A`: 1 where there is a value, 0 outside the disk and where a table has no data.

use super::plot::middles;
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{Direction, DirectionPair};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage};
use rayon::prelude::*;
use std::io::{self, Seek, Write};

/// Width and height in pixels.
pub const RESOLUTION: usize = 256;

/// Elevation of the sensor, degrees.
pub const THETA_O_DEG: f64 = 45.0;

/// Channels of an image.
pub(super) type Channels32 = SmallVec<[AnyChannel<FlatSamples>; 4]>;

/// Writes the slice of a material and of its reconstruction; errors are those of `out`.
pub fn write_slice(
    truth: &dyn Brdf,
    reconstruction: &dyn Brdf,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let names = channel_names(truth.channels());
    write_comparison(RESOLUTION, names, [truth, reconstruction].map(pixels), out)
}

/// Names of the channels of a picture in OpenEXR: colours, or luminance alone.
pub(super) fn channel_names(channels: &Channels) -> &'static [&'static str] {
    match channels {
        Channels::Luminance | Channels::Wavelengths(_) => &["Y"],
        Channels::Rgb => &["R", "G", "B"],
    }
}

/// Values of a pixel, and its opacity; zeros where there is no value.
pub(super) type Pixel = ([f64; 3], f64);

/// Writes square pictures of a truth and of its reconstruction, and their difference (reconstruction − truth) where
/// both have a value, as OpenEXR.
pub(super) fn write_comparison(
    side: usize,
    names: &[&str],
    [truth, reconstruction]: [Vec<Pixel>; 2],
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let minus = |((f, of_f), (g, of_g)): (&Pixel, &Pixel)| match of_f * of_g {
        0.0 => Pixel::default(),
        _ => (std::array::from_fn(|c| g[c] - f[c]), *of_f),
    };
    let difference: Vec<_> = truth.iter().zip(&reconstruction).map(minus).collect();
    let mut list = Channels32::new();
    push_layer(&mut list, "truth.", names, &truth);
    push_layer(&mut list, "reconstruction.", names, &reconstruction);
    push_layer(&mut list, "difference.", names, &difference);
    write_channels(side, list, out)
}

/// A square image of all these channels as OpenEXR.
pub(super) fn write_channels(
    side: usize,
    list: Channels32,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let image = Image::from_channels((side, side), AnyChannels::sort(list));
    let written = image.write().non_parallel().to_buffered(out);
    written.map_err(io::Error::other)
}

/// Adds the channels of a layer, 32 bits, row after row from the top: a channel for each name behind the prefix of the
/// layer, and `A`.
pub(super) fn push_layer(list: &mut Channels32, layer: &str, names: &[&str], pixels: &[Pixel]) {
    // A value past the range of f32 is shown as its largest: infinity would spread in viewers.
    let limit = f64::from(f32::MAX);
    let mut push = |name: &str, value: &dyn Fn(&Pixel) -> f64| {
        let samples = pixels.iter().map(|p| value(p).clamp(-limit, limit) as f32);
        let samples = FlatSamples::F32(samples.collect());
        list.push(AnyChannel::new(format!("{layer}{name}").as_str(), samples));
    };
    for (c, name) in names.iter().enumerate() {
        push(name, &|(values, _)| values[c]);
    }
    push("A", &|(_, alpha)| *alpha);
}

/// The values of a BRDF at pairs of directions, in R, G, B or all of its luminance, sr⁻¹; `None` without data.
pub(super) fn values(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Vec<Option<[f64; 3]>> {
    let channels = brdf.channels();
    let (values, presence) = brdf.values(pairs);
    let found = values.chunks_exact(channels.count()).zip(presence);
    found
        .map(|(v, presence)| (presence == Presence::Present).then(|| channels.rgb(v)))
        .collect()
}

/// The values of a BRDF, row after row from the top.
fn pixels(brdf: &dyn Brdf) -> Vec<Pixel> {
    let omega_o = Direction::from_spherical(THETA_O_DEG.to_radians(), 0.0);
    let pair = |p: [f64; 2]| {
        let [x, y] = p.map(|t| 2.0 * t - 1.0);
        let z2 = 1.0 - x * x - y * y;
        let omega_i = || Direction::from_unit(glam::DVec3::new(x, y, z2.sqrt()));
        (z2 > 0.0).then(|| DirectionPair::new(omega_i(), omega_o))
    };
    let places: Vec<_> = middles(RESOLUTION).map(pair).collect();
    let rows = places.par_chunks(RESOLUTION).flat_map_iter(|row| {
        let pairs: Vec<_> = row.iter().flatten().copied().collect();
        let mut found = values(brdf, &pairs).into_iter();
        let value = move |pair: &Option<_>| pair.and_then(|_| found.next()?);
        row.iter().map(value)
    });
    rows.map(|v| v.map_or_else(Pixel::default, |rgb| (rgb, 1.0)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::testing::made;
    use crate::geometry::Symmetry;

    #[test]
    fn the_mirror_direction_lies_left_of_the_centre_and_up_is_up() {
        let plane = |eval: fn(&DirectionPair) -> f64| {
            let probe = made(Symmetry::NONE, move |pair| Some([eval(pair)]));
            pixels(&probe)
        };
        let at = |plane: &[Pixel], x: usize, y: usize| plane[y * RESOLUTION + x].0[0];
        let middle = RESOLUTION / 2;
        // Its half vector is the normal: no other pixel is closer to it.
        let h = plane(|pair| pair.half().normalize().z);
        let peak = (0..h.len()).max_by(|&a, &b| h[a].0[0].total_cmp(&h[b].0[0]));
        let (x, y) = peak.map(|i| (i % RESOLUTION, i / RESOLUTION)).unwrap();
        let mirror = 0.5 * (1.0 - THETA_O_DEG.to_radians().sin()) * RESOLUTION as f64;
        assert!((x as f64 + 0.5 - mirror).abs() <= 1.0, "{x}");
        assert!(y.abs_diff(middle) <= 1, "{y}");
        // x to the right and y up.
        let [right, up] = [
            plane(|pair| 1.0 + pair.omega_i.vector().x),
            plane(|pair| 1.0 + pair.omega_i.vector().y),
        ];
        assert!(at(&right, RESOLUTION - 2, middle) > 1.9 && at(&right, 1, middle) < 0.1);
        assert!(at(&up, middle, 1) > 1.9 && at(&up, middle, RESOLUTION - 2) < 0.1);
    }
}
