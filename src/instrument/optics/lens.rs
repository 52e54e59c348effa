//! The directions of the light that a given outer direction leaves: where two caps overlap.

use crate::sampling::gauss_legendre;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Nodes along the angle and along the chord, from coarse to fine.
const LEVELS: [[usize; 2]; 5] = [[2, 1], [3, 2], [5, 3], [8, 5], [12, 8]];

/// The number of levels.
pub(super) const FINEST: usize = LEVELS.len() - 1;

/// A chord of the overlap in the stereographic plane about the first cap's centre.
#[derive(Clone, Copy, Debug)]
struct Chord {
    x: f64,
    /// Half its length.
    half: f64,
    /// Its share of the area over `half`.
    width: f64,
}

/// Rules of every level.
#[derive(Clone, Debug)]
pub(super) struct Lens {
    rules: Vec<[Vec<(f64, f64)>; 2]>,
}

/// The overlap of the caps at one distance.
#[derive(Clone, Debug, Default)]
pub(super) struct Overlap {
    chords: Vec<Chord>,
    /// The place where the caps meet, if one of them is a point.
    point: Option<f64>,
}

impl Lens {
    pub(super) fn new() -> Self {
        let rules = LEVELS.map(|level| level.map(gauss_legendre)).to_vec();
        Self { rules }
    }

    /// Chords of the overlap of a cap of half-angle `a` around the origin and one of `b` at
    /// distance `rho`, both as circles of the stereographic plane.
    pub(super) fn overlap(&self, a: f64, b: f64, rho: f64, level: usize, out: &mut Overlap) {
        out.chords.clear();
        out.point = match (a, b) {
            (0.0, _) => Some(0.0),
            (_, 0.0) => Some((0.5 * rho).tan()),
            _ => None,
        };
        if out.point.is_some() {
            return;
        }
        let r1 = (0.5 * a).tan();
        let [near, far] = [rho - b, rho + b].map(|x| (0.5 * x).tan());
        let (x2, r2) = (0.5 * (near + far), 0.5 * (far - near));
        if rho <= (a - b).abs() {
            let (x, r) = if a < b { (0.0, r1) } else { (x2, r2) };
            self.segment(x, r, 1.0, FRAC_PI_2, level, out);
            self.segment(x, r, -1.0, FRAC_PI_2, level, out);
            return;
        }
        // The circles cross at this x.
        let cross = (x2 * x2 + r1 * r1 - r2 * r2) / (2.0 * x2);
        let angle = |c: f64| c.clamp(-1.0, 1.0).acos();
        self.segment(0.0, r1, 1.0, angle(cross / r1), level, out);
        self.segment(x2, r2, -1.0, angle((x2 - cross) / r2), level, out);
    }

    /// A circular segment: x = centre ± r cos φ, φ in [0, to], chords of half-length r sin φ.
    fn segment(&self, centre: f64, r: f64, sign: f64, to: f64, level: usize, out: &mut Overlap) {
        let first = out.chords.len();
        let mut area = 0.0;
        for (phi, w) in &self.rules[level][0] {
            let (s, c) = (0.5 * to * (1.0 + phi)).sin_cos();
            let width = 0.5 * to * w * r * s;
            area += 2.0 * width * r * s;
            out.chords.push(Chord {
                x: centre + sign * r * c,
                half: r * s,
                width,
            });
        }
        // The area is known: a coarse rule need not be wrong about it.
        let exact = r * r * (to - to.sin() * to.cos());
        if area > 0.0 && to > 1e-3 && to <= PI {
            for chord in &mut out.chords[first..] {
                chord.width *= exact / area;
            }
        }
    }

    /// Every direction of an overlap with its weight. `frame` holds the centre of the first cap, the
    /// direction towards the second, and what is across.
    pub(super) fn for_each(
        &self,
        overlap: &Overlap,
        frame: &[DVec3; 3],
        level: usize,
        mut visit: impl FnMut(DVec3, f64),
    ) {
        let [centre, along, across] = *frame;
        let at = |x: f64, y: f64| {
            let q = 1.0 / (1.0 + x * x + y * y);
            let v = centre * (2.0 * q - 1.0) + (along * x + across * y) * (2.0 * q);
            (v, 4.0 * q * q)
        };
        if let Some(x) = overlap.point {
            visit(at(x, 0.0).0, 1.0);
            return;
        }
        for chord in &overlap.chords {
            for (y, w) in &self.rules[level][1] {
                let (v, area) = at(chord.x, chord.half * y);
                visit(v, chord.width * chord.half * w * area);
            }
        }
    }
}
