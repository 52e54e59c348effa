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
mod spec;

pub(crate) use file::tabulate;
pub use file::{FILE_LEN, check, suits, write_utia};
pub use spec::{ENTRY, UtiaSpec};

use super::doubts::Doubts;
use crate::brdf::{Brdf, Channels, Presence};
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
    symmetry: Symmetry,
    doubts: Doubts,
}

impl Utia {
    fn new(planes: Vec<Vec<f64>>, doubts: Doubts) -> Self {
        Self {
            planes,
            symmetry: Symmetry::NONE,
            doubts,
        }
    }

    /// The table, declared to have these symmetries; a fresh one has none. Look-ups do not use
    /// them: they tell others what may be folded.
    #[must_use]
    pub(crate) fn with_symmetry(mut self, symmetry: Symmetry) -> Self {
        self.symmetry = symmetry;
        self
    }
}

/// Position of the node (theta, phi) of light and of sensor in a plane.
pub fn index([theta_i, phi_i]: [usize; 2], [theta_v, phi_v]: [usize; 2]) -> usize {
    DIRECTIONS * (AZIMUTHS * theta_i + phi_i) + AZIMUTHS * theta_v + phi_v
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

    fn conserves_energy(&self) -> bool {
        false
    }

    fn remarks(&self) -> Vec<String> {
        self.doubts.remarks()
    }

    fn cells_without_reading(&self) -> usize {
        self.doubts.marks.count()
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        if !pair.is_above_horizon() {
            return Presence::Present;
        }
        let (Some(light), Some(sensor)) = (around(pair.omega_i), around(pair.omega_o)) else {
            return Presence::Missing;
        };
        let mut total = 0.0;
        for (i, u) in light {
            for (v, w) in sensor {
                let (node, weight) = (DIRECTIONS * i + v, u * w);
                // A node of weight 0 may be the far side of the last elevation, or hold no data.
                if weight > 0.0 && self.planes.iter().all(|plane| !plane[node].is_nan()) {
                    total += weight;
                    for (sum, plane) in out.iter_mut().zip(&self.planes) {
                        *sum += weight * plane[node];
                    }
                }
            }
        }
        if total > 0.0 {
            out.iter_mut().for_each(|sum| *sum /= total);
            return Presence::Present;
        }
        Presence::Missing
    }
}
