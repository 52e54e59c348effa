//! Isotropic BRDFs as tensor trees of Radiance, which its material `BSDF` reads (Ward et al. 2012, *A practical framework
//! for sharing and rendering real-world bidirectional scattering distribution functions*; the source of Radiance,
//! `bsdf_t.c`).
//!
//! A `TensorTree3` is an octree over (x, s, t): x = (1 − sin theta_i)/2, of which only 0 … ½ is used, and (s, t) the point
//! of the unit square that Shirley and Chiu's map ([`disk`]) sends to the projection of omega_o, where omega_i has
//! azimuth π. A leaf holds f_r in sr⁻¹, without the cosine, for all of its cube: here the mean over it, so that integrals
//! over the disk, which hold the sensor's cosine, are kept.
//!
//! A finest cell is taken at its midpoint. Eight leaves become one where their standard deviation is at most
//! q √(mean · r) with q = [`MERGED`] and r the root mean square of f_r cos theta_i for cosine-distributed directions. As
//! mean squares of the mean are at most r², that adds at most q to the normalised error in that measure, wherever f_r is
//! large or small.
//!
//! The block `Visible` has the luminance. Of a BRDF in R, G, B the blocks `CIE-u` and `CIE-v` have the chromaticity by the
//! primaries of Radiance, in which it shows R, G, B unchanged; its luminance weighs them by .265, .670 and .065.

mod node;
mod read;
mod write;

pub use node::Node;
pub(super) use read::{check, text};
pub use write::{LEVELS, table_pairs, tabulate, write_tensor_tree};

use super::doubts::{Doubts, of_doubts};
use super::specs::{file_table, length};
use super::{FileFormat, TableError, without_wavelengths, write_file};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{DirectionPair, Symmetry};
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// What a TensorTree3 has by construction.
const SYMMETRY: Symmetry = Symmetry::NONE.with_isotropy(true);

/// u' and v' of grey.
const GREY: [f64; 2] = [4.0 / 19.0, 9.0 / 19.0];

/// CIE 1931 X, Y, Z of R, G, B by the primaries of Radiance (`color.h`: .64 .33, .29 .60, .15 .06), whose white has
/// X = Y = Z.
const XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(0.514_144_620_811, 0.265_105_820_106, 0.024_100_529_101),
    DVec3::new(0.323_884_479_718, 0.670_105_820_106, 0.122_852_733_686),
    DVec3::new(0.161_970_899_471, 0.064_788_359_788, 0.853_046_737_213),
);

/// Cells of a tree with colours that are made 0: those of light and sensor in one direction at the horizon, to which
/// reciprocity exchanges each other.
const UNSEEN: [[f64; 3]; 2] = [[0.0, 0.0, 0.499_999], [0.0, 0.0, 0.5]];

/// Why wavelengths are refused.
const WAVELENGTHS: &str = "a tensor tree holds luminance or R, G, B and no wavelengths";

/// A tensor tree as a BRDF: the value of the leaf that a pair is in.
#[derive(Clone, Debug)]
pub struct TensorTree {
    /// Luminance, then u' and v' if they are known.
    trees: Vec<Node>,
    channels: Channels,
    doubts: Doubts,
}

impl Brdf for TensorTree {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        SYMMETRY
    }

    of_doubts!(doubts);

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        if !pair.is_above_horizon() {
            out.fill(0.0);
            return Presence::Present;
        }
        let place = place(pair);
        let y = self.trees[0].value_at(place);
        let chromaticity = match &self.trees[1..] {
            [u, v] => Some([u.value_at(place), v.value_at(place)]),
            _ => None,
        };
        if y.is_nan() || chromaticity.is_some_and(|uv| uv.iter().any(|x| x.is_nan())) {
            out.fill(0.0);
            return Presence::Missing;
        }
        out.fill(y);
        if let ([r, g, b], Some([u, v])) = (out, chromaticity) {
            // No colour is below: a darker one is grey.
            if v > LEAST_V {
                // CIE 1976; the sum of the three is 1 / y.
                let x = 9.0 * u / (4.0 * v);
                let z = (12.0 - 3.0 * u - 20.0 * v) / (4.0 * v);
                let rgb = XYZ.inverse() * (y * DVec3::new(x, 1.0, z));
                [*r, *g, *b] = rgb.max(DVec3::ZERO).to_array();
            }
        }
        Presence::Present
    }
}

/// Below every v' of a colour, of which the least is .016.
const LEAST_V: f64 = 1e-3;

/// The place of a pair in the cube, of which no coordinate is 1.
fn place(pair: &DirectionPair) -> [f64; 3] {
    let turn = PI - pair.omega_i.phi();
    let (sin, cos) = turn.sin_cos();
    let o = pair.omega_o.vector();
    let [s, t] = square([cos * o.x - sin * o.y, sin * o.x + cos * o.y]);
    let below = |x: f64| x.clamp(0.0, 1.0 - f64::EPSILON);
    [0.5 - 0.5 * pair.omega_i.sin_theta().clamp(1e-9, 1.0), s, t].map(below)
}

/// Share of its root mean square by which a BRDF may err for being stored in larger cells.
pub const MERGED: f64 = 0.02;

/// The point of the unit disk at a point of the unit square, by rings (Shirley and Chiu 1997, *A low distortion map
/// between disk and square*). Areas are kept, up to the factor π.
///
/// ```
/// use gonio::brdf::measured::tensor_tree::disk;
/// let [x, y] = disk([1.0, 0.5]);
/// assert_eq!([x, y], [1.0, 0.0]);
/// ```
pub fn disk([s, t]: [f64; 2]) -> [f64; 2] {
    let [a, b] = [2.0 * s - 1.0, 2.0 * t - 1.0];
    let (radius, azimuth) = if a == 0.0 && b == 0.0 {
        (0.0, 0.0)
    } else if a.abs() >= b.abs() {
        (a, FRAC_PI_4 * b / a)
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * a / b)
    };
    let (sin, cos) = azimuth.sin_cos();
    [radius * cos, radius * sin]
}

/// The point of the unit square of a point of the unit disk: the inverse of [`disk`].
///
/// ```
/// use gonio::brdf::measured::tensor_tree::{disk, square};
/// let [s, t] = square(disk([0.3, 0.8]));
/// assert!((s - 0.3).abs() + (t - 0.8).abs() < 1e-14);
/// ```
pub fn square([x, y]: [f64; 2]) -> [f64; 2] {
    let radius = x.hypot(y);
    // Counted from the middle of the first of four sides.
    let turn = (y.atan2(x) + FRAC_PI_4).rem_euclid(TAU);
    let side = (turn / FRAC_PI_2).floor();
    let along = radius * (turn - side * FRAC_PI_2 - FRAC_PI_4) / FRAC_PI_4;
    let [a, b] = match side as u8 {
        0 => [radius, along],
        1 => [-along, radius],
        2 => [-radius, -along],
        _ => [along, -radius],
    };
    [(a + 1.0) / 2.0, (b + 1.0) / 2.0]
}

/// Bytes of a tree for each byte of its text, at most: a number, its place and a box of eight.
const TREE_BYTES: usize = 10;

file_table! {
    "tensor-tree": "isotropic reflection of a Radiance BSDF, the TensorTree3 XML at `path`; also no_reading",
    SphericalTable, {
        extensions: &["xml"],
        begins: Some(|bytes| String::from_utf8_lossy(bytes).contains("<WindowElement")),
        summary: "isotropic, for the material BSDF of Radiance: TensorTree3, luminance or R, G, B",
        write: Some(|brdf, of, path| {
            let (trees, filled) = tabulate(brdf, LEVELS[of.size])?;
            write_file(path, filled, |out| write_tensor_tree(&trees, out))
        }),
        pairs: Some(|brdf, size| table_pairs(brdf, LEVELS[size])),
        sizes: LEVELS.len(),
    }
    /// A tensor tree, as a config writes it.
    pub struct TensorTreeSpec {}

    fn fits(&self, channels: &Channels) -> Result<(), TableError> {
        without_wavelengths("path", self.path.display(), channels)?;
        check(&text(&self.path)?).map(drop)
    }

    fn channels(&self) -> Result<Option<Channels>, TableError> {
        check(&text(&self.path)?).map(Some)
    }

    fn symmetries(&self, _channels: &Channels) -> Result<Symmetry, TableError> {
        Ok(SYMMETRY)
    }

    fn load(&self, channels: Channels) -> Result<impl Brdf + 'static, TableError> {
        without_wavelengths("path", self.path.display(), &channels)?;
        TensorTree::read_without(&text(&self.path)?, channels, self.no_reading)
    }

    fn channel_bytes(&self) -> usize {
        length(&self.path).saturating_mul(TREE_BYTES)
    }
}
