//! Tables about the mirror direction, as OpticStudio (Zemax) reads them for its scattering model of tabular BSDF;
//! the submodule `file` reads and writes the text.
//!
//! A table holds f_r over the polar angle of the light, and over an azimuth and an angle (`radial`) about the mirror
//! direction: with the light at azimuth 0 the frame of normal and tangent is turned about the bitangent until the normal is
//! the mirror direction; azimuth 0 then points from there towards the normal. A lobe stays where it is as the light moves.
//!
//! A table of several rotations of the sample (about its normal, counted as azimuths are) is of an anisotropic material: with the light at
//! azimuth 0 of the instrument, that of the sample is minus the rotation.
//!
//! Between nodes the value is linear in each of the angles; rotations go round the circle if no gap between them is far wider than the others. Nodes below the horizon are left out and the weights of the
//! others renormalised, as are those without a reading. Outside the angles of the table nothing was measured, and the pair is [`Presence::Missing`].

pub(crate) mod file;
mod write;

pub(super) use file::{Head, head, text};
pub use write::{LEVELS, Level, table_pairs, tabulate};

use super::doubts::{Doubts, of_doubts};
use super::specs::file_table;
use super::{FileFormat, TableError, around, write_file};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

/// Distance beyond the ends of a list of angles (rad) within which an angle counts as on them: they are decimals of
/// degrees, and those that are looked up went through sines.
const SLACK: f64 = 1e-9;

/// A table as a BRDF.
#[derive(Clone, Debug)]
pub struct Zemax {
    angles: Angles,
    channels: Channels,
    /// In sr⁻¹, NaN without a reading, then in all channels; channel after channel, in each the radial angles run fastest, then the azimuths.
    values: Vec<f64>,
    doubts: Doubts,
}

/// The nodes of a table, rad.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Angles {
    /// Rotations of the sample, ascending; a single one of an isotropic material.
    pub rotation: Vec<f64>,
    /// Polar angles of the light, ascending.
    pub theta_i: Vec<f64>,
    /// Azimuths about the mirror direction, ascending; 0 to π of a mirrored table, else round the circle.
    pub azimuth: Vec<f64>,
    /// Angles from the mirror direction, ascending.
    pub radial: Vec<f64>,
    /// True if the plane of incidence is one of mirror symmetry.
    pub mirrored: bool,
}

/// The nodes around a number, and their weights.
type Around = [(usize, f64); 2];

impl Angles {
    /// Number of nodes.
    pub(super) fn count(&self) -> usize {
        // Lists without values may be of any length.
        let lists = [&self.rotation, &self.theta_i, &self.azimuth, &self.radial];
        lists.iter().fold(1, |n, list| n.saturating_mul(list.len()))
    }

    /// The symmetries of a table over these nodes.
    pub(super) fn symmetry(&self) -> Symmetry {
        let isotropic = self.rotation.len() == 1;
        Symmetry {
            isotropic,
            bilateral: isotropic && self.mirrored,
            ..Symmetry::NONE
        }
    }

    fn pair(&self, node: usize) -> DirectionPair {
        let (n, m) = (self.radial.len(), self.azimuth.len());
        let lights = self.theta_i.len();
        let theta = self.theta_i[node / (n * m) % lights];
        let turn = -self.rotation[node / (n * m * lights)];
        let [radial, azimuth] = [self.radial[node % n], self.azimuth[node / n % m]];
        let local = Direction::from_spherical(radial, azimuth).vector();
        let (sin, cos) = theta.sin_cos();
        let sensor = DVec3::new(
            cos * local.x - sin * local.z,
            local.y,
            sin * local.x + cos * local.z,
        );
        let sensor = Direction::try_new(DQuat::from_rotation_z(turn) * sensor);
        let sensor = sensor.unwrap_or(Direction::NORMAL);
        DirectionPair::new(Direction::from_spherical(theta, turn), sensor)
    }

    /// Rotation, polar angle of the light, azimuth and radial angle of a pair.
    fn place(&self, pair: &DirectionPair) -> [f64; 4] {
        let (theta, phi) = (pair.omega_i.theta(), pair.omega_i.phi());
        let o = pair.omega_o.vector();
        let (sin, cos) = phi.sin_cos();
        let (x, y) = (cos * o.x + sin * o.y, cos * o.y - sin * o.x);
        let (sin, cos) = theta.sin_cos();
        let (x, z) = (cos * x + sin * o.z, cos * o.z - sin * x);
        let azimuth = y.atan2(x);
        let azimuth = match self.mirrored {
            true => azimuth.abs(),
            false => azimuth.rem_euclid(TAU),
        };
        [(-phi).rem_euclid(TAU), theta, azimuth, x.hypot(y).atan2(z)]
    }

    fn around_rotation(&self, rotation: f64) -> Option<Around> {
        let nodes = &self.rotation;
        let gaps = nodes.windows(2).map(|pair| pair[1] - pair[0]);
        let widest = gaps.fold(0.0, f64::max);
        match nodes[..] {
            [_] => Some([(0, 1.0), (0, 0.0)]),
            [first, .., last] if first + TAU - last <= WIDER * widest => on_circle(nodes, rotation),
            _ => within(nodes, rotation),
        }
    }

    fn around_azimuth(&self, azimuth: f64) -> Option<Around> {
        match self.mirrored {
            true => within(&self.azimuth, azimuth),
            false => on_circle(&self.azimuth, azimuth),
        }
    }
}

/// Rotations go round the circle if the gap at its end is at most so many times the widest other one.
const WIDER: f64 = 1.5;

/// The nodes around an angle, over the end of the circle too.
fn on_circle(nodes: &[f64], angle: f64) -> Option<Around> {
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let gap = first + TAU - last;
    let beyond = match angle {
        a if a < first => a + TAU - last,
        a => a - last,
    };
    // A circle whose end is its start has no gap.
    if gap > SLACK && (0.0..=gap).contains(&beyond) {
        let upper = beyond / gap;
        return Some([(nodes.len() - 1, 1.0 - upper), (0, upper)]);
    }
    within(nodes, angle)
}

/// The nodes around a number among ascending ones; `None` outside.
fn within(nodes: &[f64], x: f64) -> Option<Around> {
    // Of NaN it is false.
    let is_inside = x >= nodes[0] - SLACK && x <= nodes[nodes.len() - 1] + SLACK;
    is_inside.then(|| around(nodes, x))
}

impl Zemax {
    /// Nodes with a weight at a pair, and their weights, which add up to 1; empty without data.
    fn weights(&self, pair: &DirectionPair) -> Vec<(usize, f64)> {
        let angles = &self.angles;
        let [rotation, theta, azimuth, radial] = angles.place(pair);
        let axes = (
            angles.around_rotation(rotation),
            within(&angles.theta_i, theta),
            angles.around_azimuth(azimuth),
            within(&angles.radial, radial),
        );
        let (Some(rotation), Some(light), Some(azimuth), Some(radial)) = axes else {
            return Vec::new();
        };
        let mut found = Vec::with_capacity(16);
        let mut total = 0.0;
        for corner in 0..16 {
            let [(i, u), (j, v)] = [light[corner & 1], azimuth[corner >> 1 & 1]];
            let [(k, w), (r, t)] = [radial[corner >> 2 & 1], rotation[corner >> 3]];
            let light = r * angles.theta_i.len() + i;
            let node = (light * angles.azimuth.len() + j) * angles.radial.len() + k;
            let weight = u * v * w * t;
            let is_read = !self.values[node].is_nan();
            if weight > 0.0 && is_read && angles.pair(node).omega_o.cos_theta() > 0.0 {
                total += weight;
                found.push((node, weight));
            }
        }
        found.iter_mut().for_each(|(_, weight)| *weight /= total);
        found
    }
}

impl Brdf for Zemax {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.angles.symmetry()
    }

    of_doubts!(doubts);

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        if !pair.is_above_horizon() {
            return Presence::Present;
        }
        let weights = self.weights(pair);
        let planes = self.values.chunks_exact(self.angles.count());
        for (out, plane) in out.iter_mut().zip(planes) {
            *out = weights
                .iter()
                .map(|(node, weight)| weight * plane[*node])
                .sum();
        }
        Presence::of(!weights.is_empty())
    }
}

file_table! {
    "zemax": "table about the mirror direction, the text of OpticStudio (Zemax) at `path`; also no_reading",
    Neither, {
        extensions: &["zbsdf"],
        begins: Some(|bytes| {
            let text = String::from_utf8_lossy(bytes);
            let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
            let mut next = |key: &str| lines.next().is_some_and(|line| line.starts_with(key));
            next("Source") && next("Symmetry")
        }),
        summary: "about the mirror direction, text of OpticStudio (Zemax), written of isotropic materials; luminance, R, G, B or one wavelength",
        write: Some(|brdf, of, path| {
            let (table, filled) = tabulate(brdf, LEVELS[of.size])?;
            write_file(path, filled, |out| table.write(out))
        }),
        pairs: Some(|brdf, size| table_pairs(brdf, LEVELS[size])),
        sizes: LEVELS.len(),
    }
    /// A Zemax table, as a config writes it.
    pub struct ZemaxSpec {}

    fn fits(&self, channels: &Channels) -> Result<(), TableError> {
        self.head(channels, |_| Ok(()))
    }

    fn channels(&self) -> Result<Option<Channels>, TableError> {
        let is_grey = head(&text(&self.path)?)?.content == file::Content::Monochrome;
        Ok(is_grey.then_some(Channels::Luminance))
    }

    fn symmetries(&self, channels: &Channels) -> Result<Symmetry, TableError> {
        self.head(channels, |head| Ok(head.angles.symmetry()))
    }

    fn load(&self, channels: Channels) -> Result<impl Brdf + 'static, TableError> {
        self.head(&channels, |head| head.load(channels.clone(), self.no_reading))
    }

    fn channel_bytes(&self) -> usize {
        let nodes = text(&self.path).and_then(|text| Ok(head(&text)?.angles.count()));
        nodes.unwrap_or(0).saturating_mul(8)
    }
}

impl ZemaxSpec {
    /// What `then` makes of all before the values, of a scene that can make use of it.
    fn head<T>(
        &self,
        channels: &Channels,
        then: impl FnOnce(Head<'_>) -> Result<T, TableError>,
    ) -> Result<T, TableError> {
        let text = text(&self.path)?;
        let head = head(&text)?;
        head.content.suits(channels)?;
        then(head)
    }
}
