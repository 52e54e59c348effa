//! Anisotropic tables in the format of the UTIA database (Filip and Vávra 2014).
//!
//! A plane holds one channel of f_r over (theta_i, phi_i, theta_v, phi_v), v the sensor:
//! elevations 0, 15, …, 75°, azimuths 0, 7.5, …, 352.5°; [`mod@file`] has the bytes.
//!
//! Between nodes the value is linear in each of the four angles, periodic in the azimuths. Nodes
//! without data are left out and the weights of the others renormalised. Beyond 75° in either
//! elevation nothing was measured, and nothing is made up: the pair is
//! [`Presence::Missing`]. Below the horizon the value is 0.
//!
//! The format guarantees no symmetry and none is declared; the `symmetry` of a config says what is
//! known about the sample.

pub mod file;

pub(crate) use file::tabulate;
pub use file::{FILE_LEN, table_pairs, write_utia};

use super::doubts::{Doubts, of_doubts};
use super::specs::file_table;
use super::{FileFormat, TableError, without_wavelengths, write_file};
use crate::brdf::{Brdf, Channels, Presence};
use crate::error::in_left_open;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use std::f64::consts::PI;

/// Nodes in elevation.
pub(crate) const ELEVATIONS: usize = 6;
/// Nodes in azimuth.
pub(crate) const AZIMUTHS: usize = 48;
/// Nodes of one direction.
const DIRECTIONS: usize = ELEVATIONS * AZIMUTHS;
/// Pairs of directions that a table holds.
pub const NODES: usize = DIRECTIONS * DIRECTIONS;
/// Steps of elevation and azimuth (rad): 15° and 7.5°.
const STEP: [f64; 2] = [PI / 12.0, PI / 24.0];

/// Distance beyond the last node, in steps, within which an elevation counts as on it: an angle
/// that went through sines and cosines is good to a few 1e-16 rad.
const SLACK: f64 = 1e-12;

/// A UTIA table as a BRDF.
#[derive(Clone, Debug)]
pub struct Utia {
    /// One of luminance, or three of R, G, B: in sr⁻¹, NaN where there is no data.
    planes: Vec<Vec<f64>>,
    /// What it is declared to have, none as it is read. Look-ups do not use it: it says what may be folded.
    pub(super) symmetry: Symmetry,
    doubts: Doubts,
}

/// The pair at a node of a plane.
fn pair(node: usize) -> DirectionPair {
    let direction = |d: usize| {
        let (theta, phi) = (d / AZIMUTHS, d % AZIMUTHS);
        Direction::from_spherical(theta as f64 * STEP[0], phi as f64 * STEP[1])
    };
    DirectionPair::new(direction(node / DIRECTIONS), direction(node % DIRECTIONS))
}

/// The four nodes around a direction, as positions among [`DIRECTIONS`], and their weights; `None`
/// beyond the last elevation.
#[inline]
fn around(omega: Direction) -> Option<[(usize, f64); 4]> {
    let last = (ELEVATIONS - 1) as f64;
    let x = omega.theta() / STEP[0];
    // Written so that NaN fails.
    if !(x <= last + SLACK) {
        return None;
    }
    let x = x.min(last);
    let theta = (x as usize).min(ELEVATIONS - 2);
    let u = x - theta as f64;
    let y = omega.phi() / STEP[1];
    let floor = y.floor();
    let v = y - floor;
    // phi is in [−π, π], so that floor is in −24 … 24.
    let phi = (floor as i64).rem_euclid(AZIMUTHS as i64) as usize;
    let next = if phi + 1 < AZIMUTHS { phi + 1 } else { 0 };
    let (low, high) = (AZIMUTHS * theta, AZIMUTHS * (theta + 1));
    Some([
        (low + phi, (1.0 - u) * (1.0 - v)),
        (low + next, (1.0 - u) * v),
        (high + phi, u * (1.0 - v)),
        (high + next, u * v),
    ])
}

impl Brdf for Utia {
    fn channels(&self) -> &Channels {
        match self.planes.len() {
            1 => &Channels::Luminance,
            _ => &Channels::Rgb,
        }
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    of_doubts!(doubts);

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        match self.planes.as_slice() {
            [luminance] => interpolate([luminance], pair, out),
            [r, g, b] => interpolate([r, g, b], pair, out),
            _ => Presence::Missing,
        }
    }
}

/// Writes the values of planes at a pair; those of all channels side by side are in registers.
fn interpolate<const N: usize>(
    planes: [&Vec<f64>; N],
    pair: &DirectionPair,
    out: &mut [f64],
) -> Presence {
    if !pair.is_above_horizon() {
        return Presence::Present;
    }
    let (Some(light), Some(sensor)) = (around(pair.omega_i), around(pair.omega_o)) else {
        return Presence::Missing;
    };
    let (mut sums, mut total) = ([0.0; N], 0.0);
    for (i, u) in light {
        for (v, w) in sensor {
            let (node, weight) = (DIRECTIONS * i + v, u * w);
            let values = planes.map(|plane| plane[node]);
            // A node of weight 0 may be the far side of the last elevation, or hold no data.
            if weight > 0.0 && values.iter().all(|value| !value.is_nan()) {
                total += weight;
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += weight * value;
                }
            }
        }
    }
    if !(total > 0.0) {
        return Presence::Missing;
    }
    for (out, sum) in out.iter_mut().zip(sums) {
        *out = sum / total;
    }
    Presence::Present
}

fn one() -> f64 {
    1.0
}

file_table! {
    "utia": "measured anisotropic table to 75°, the UTIA .bin file at `path`; also scale, no_reading",
    SphericalTable, {
        extensions: &["bin"],
        summary: "anisotropic, over elevations to 75° and azimuths",
        write: Some(|brdf, of, path| {
            let (content, filled) = tabulate(brdf, of.fill)?;
            write_file(path, filled, |out| content.write(out))
        }),
        has_holes: true,
        pairs: Some(|brdf, _| table_pairs(brdf)),
    }
    /// A UTIA file, as a config writes it.
    pub struct UtiaSpec {
        /// Factor from stored values to sr⁻¹, above 0 and at most 10⁶.
        #[serde(default = "one")]
        scale: f64 = one();
    }

    fn fits(&self, channels: &Channels) -> Result<(), TableError> {
        without_wavelengths("path", self.path.display(), channels)?;
        in_left_open("scale", self.scale, 0.0, 1e6)?;
        file::open(&self.path).map(drop)
    }

    fn symmetries(&self, _channels: &Channels) -> Result<Symmetry, TableError> {
        Ok(Symmetry::NONE)
    }

    fn load(&self, channels: Channels) -> Result<impl Brdf + 'static, TableError> {
        self.fits(&channels)?;
        let file = file::open(&self.path)?;
        Utia::read_without(file, self.scale, channels, self.no_reading)
    }

    fn channel_bytes(&self) -> usize {
        FILE_LEN as usize / Channels::Rgb.count()
    }
}
