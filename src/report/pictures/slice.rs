//! A picture of a reconstruction: one slice of truth, reconstruction and difference.
//!
//! The slice is the hemisphere of omega_i seen from above, at theta_o = 45°, phi_o = 0: pixel
//! (x, y) of the unit disk is the direction (x, y, sqrt(1 − x² − y²)), x to the right and y up, so
//! that the mirror direction lies left of the centre. Values are f_r in sr⁻¹.
//!
//! One OpenEXR file with 32-bit channels in three layers: `truth`, `reconstruction` and
//! `difference` (reconstruction − truth, signed), each with `Y` or linear-sRGB `R`, `G`, `B`, and
//! `A`: 1 where there is a value, 0 outside the disk and where a table has no data.

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

/// Writes the slice of a material and of its reconstruction.
///
/// # Errors
/// Whatever `out` reports.
pub fn write_slice(
    truth: &dyn Brdf,
    reconstruction: &dyn Brdf,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let channels = truth.channels();
    let [truth, reconstruction] = [truth, reconstruction].map(pixels);
    let difference = reconstruction.iter().zip(&truth).map(minus).collect();
    let mut list = SmallVec::new();
    let layers = [
        ("truth", truth),
        ("reconstruction", reconstruction),
        ("difference", difference),
    ];
    for (layer, plane) in layers {
        push_layer(&mut list, layer, channel_names(channels), &plane);
    }
    write_channels([RESOLUTION; 2], list, out)
}

/// What the values of a picture are called in OpenEXR: colours, or luminance alone.
pub(super) fn channel_names(channels: &Channels) -> &'static [&'static str] {
    match channels {
        Channels::Luminance | Channels::Wavelengths(_) => &["Y"],
        Channels::Rgb => &["R", "G", "B"],
    }
}

/// An image of all these channels as OpenEXR.
pub(super) fn write_channels(
    [width, height]: [usize; 2],
    list: Channels32,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let image = Image::from_channels((width, height), AnyChannels::sort(list));
    image
        .write()
        .non_parallel()
        .to_buffered(out)
        .map_err(io::Error::other)
}

/// Values of a pixel, and its opacity.
pub(super) type Pixel = ([f64; 3], f64);

/// Adds the channels of a layer, 32 bits, row after row from the top: a channel for each name, and `A`.
pub(super) fn push_layer(list: &mut Channels32, layer: &str, names: &[&str], pixels: &[Pixel]) {
    // A value past the range of f32 is shown as its largest: infinity would spread in viewers.
    let limit = f64::from(f32::MAX);
    let mut push = |name: &str, value: &dyn Fn(&Pixel) -> f64| {
        let samples = pixels.iter().map(|p| value(p).clamp(-limit, limit) as f32);
        let samples = FlatSamples::F32(samples.collect());
        list.push(AnyChannel::new(format!("{layer}.{name}").as_str(), samples));
    };
    for (c, name) in names.iter().enumerate() {
        push(name, &|(values, _)| values[c]);
    }
    push("A", &|(_, alpha)| *alpha);
}

/// The difference of two pixels, where both have a value.
fn minus(((a, of_a), (b, of_b)): (&Pixel, &Pixel)) -> Pixel {
    match of_a * of_b {
        0.0 => Pixel::default(),
        _ => (std::array::from_fn(|c| a[c] - b[c]), 1.0),
    }
}

/// The values of a BRDF, row after row from the top.
fn pixels(brdf: &dyn Brdf) -> Vec<Pixel> {
    let omega_o = Direction::from_spherical(THETA_O_DEG.to_radians(), 0.0);
    let channels = brdf.channels();
    let n = channels.count();
    let mut pixels = vec![Pixel::default(); RESOLUTION * RESOLUTION];
    let centre = |i: usize| (2.0 * i as f64 + 1.0) / RESOLUTION as f64 - 1.0;
    let rows = pixels.par_chunks_mut(RESOLUTION).enumerate();
    rows.for_each(|(row, pixels)| {
        let y = -centre(row);
        let mut columns = Vec::with_capacity(RESOLUTION);
        let mut pairs = Vec::with_capacity(RESOLUTION);
        for column in 0..RESOLUTION {
            let x = centre(column);
            let z2 = 1.0 - x * x - y * y;
            if z2 > 0.0 {
                let omega_i = Direction::from_unit(glam::DVec3::new(x, y, z2.sqrt()));
                columns.push(column);
                pairs.push(DirectionPair::new(omega_i, omega_o));
            }
        }
        let mut values = vec![0.0; n * pairs.len()];
        let mut presence = vec![Presence::Missing; pairs.len()];
        brdf.eval_batch(&pairs, &mut values, &mut presence);
        let found = columns.iter().zip(&presence).zip(values.chunks_exact(n));
        for ((&column, &presence), values) in found {
            if presence == Presence::Present {
                pixels[column] = (channels.rgb(values), 1.0);
            }
        }
    });
    pixels
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
