//! A chart with the symmetries of a BRDF: the 4-D form, or the 3-D form of isotropic BRDFs, with
//! its domain folded so that one configuration has one set of coordinates.
//!
//! | symmetry | spherical | the others |
//! |---|---|---|
//! | isotropic | azimuth difference in [−π, π] | the same |
//! | + reciprocal | exchanged if the azimuth is negative: [0, π] | azimuth and azimuth + π are one: [0, π] |
//! | + bilateral | [0, π], exchanged if theta_i < theta_o | [0, π/2] |
//!
//! In 4-D, reciprocity folds the second azimuth to a period of π (spherical: exchanged if
//! theta_i < theta_o), and bilateral symmetry about both tangent axes folds the first azimuth to
//! [0, π/2].

use super::{
    Axis, AxisKind, Azimuth, Chart, Coords, Facts, Images, Layout, Parametrization,
    ParametrizationKind, Quantity, Unit,
};
use crate::geometry::{BLOCK, DirectionPair, FEW, PairBlock, Symmetry};
use crate::numeric::angles::LARGEST_ANGLE;
use crate::numeric::{vectorised, wrap_angle};
use glam::DVec3;
use smallvec::smallvec;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::marker::PhantomData;

/// Calls the [`Fold`] of a chart and a symmetry.
macro_rules! folded {
    ($chart:ident, $symmetry:expr, $call:ident($($argument:expr),*)) => {
        match ($symmetry.reciprocal, $symmetry.bilateral) {
            (false, false) => Fold::<$chart, false, false>::$call($($argument),*),
            (true, false) => Fold::<$chart, true, false>::$call($($argument),*),
            (false, true) => Fold::<$chart, false, true>::$call($($argument),*),
            (true, true) => Fold::<$chart, true, true>::$call($($argument),*),
        }
    };
}

/// A [`Chart`] under given symmetries.
#[derive(Clone, Debug)]
pub struct Form<C> {
    chart: PhantomData<fn() -> C>,
    symmetry: Symmetry,
    axes: Vec<Axis>,
}

impl<C: Chart> Form<C> {
    /// The form of the chart for BRDFs with this symmetry.
    pub fn new(symmetry: Symmetry) -> Self {
        let [r1, r2] = C::RADIAL.map(|r| Axis {
            symbol: r.symbol,
            label: r.label,
            unit: r.unit,
            range: [0.0, r.max],
            kind: AxisKind::Radial,
            quantity: r.quantity,
            peak_at_start: false,
            density: C::RADIAL_DENSITY,
            warp: None,
        });
        let r1 = Axis {
            peak_at_start: C::PEAK_AT_START,
            ..r1
        };
        let azimuth = |azimuth: Azimuth, range: [f64; 2], kind| Axis {
            symbol: azimuth.symbol,
            label: azimuth.label,
            unit: Unit::Radian,
            range,
            kind,
            quantity: Quantity::Other,
            peak_at_start: false,
            density: (range[1] - range[0]) / FRAC_PI_2,
            warp: None,
        };
        let full = ([-PI, PI], AxisKind::Periodic);
        let axes = if symmetry.isotropic {
            let (range, kind) = match (symmetry.reciprocal, symmetry.bilateral, C::EXCHANGE) {
                (false, false, _) => full,
                (true, false, false) => ([0.0, PI], AxisKind::Periodic),
                (true, true, false) => ([0.0, FRAC_PI_2], AxisKind::Mirrored),
                (true, _, true) | (false, true, _) => ([0.0, PI], AxisKind::Mirrored),
            };
            vec![r1, r2, azimuth(C::RELATIVE, range, kind)]
        } else {
            let (range1, kind1) = if symmetry.bilateral {
                ([0.0, FRAC_PI_2], AxisKind::Mirrored)
            } else {
                full
            };
            let (range2, kind2) = if symmetry.reciprocal && !C::EXCHANGE {
                ([0.0, PI], AxisKind::Periodic)
            } else {
                full
            };
            vec![
                r1,
                azimuth(C::AZIMUTH[0], range1, kind1),
                r2,
                azimuth(C::AZIMUTH[1], range2, kind2),
            ]
        };
        Self {
            chart: PhantomData,
            symmetry,
            axes,
        }
    }

    /// Folds the azimuth of the 3-D form; `a` is in [−π, π].
    #[inline]
    fn fold_relative(&self, c: [f64; 3]) -> [f64; 3] {
        folded!(C, self.symmetry, relative(c))
    }

    /// Folds the 4-D form; azimuths are in [−π, π].
    #[inline]
    fn fold_absolute(&self, c: Coords) -> Coords {
        folded!(C, self.symmetry, absolute(c))
    }
}

/// The folds of a symmetry, known when they are compiled, so that many are folded at once.
struct Fold<C, const RECIPROCAL: bool, const BILATERAL: bool>(PhantomData<fn() -> C>);

impl<C: Chart, const RECIPROCAL: bool, const BILATERAL: bool> Fold<C, RECIPROCAL, BILATERAL> {
    /// Folds the azimuth of the 3-D form; `a` is in [−π, π].
    #[inline(always)]
    fn relative([r1, r2, a]: [f64; 3]) -> [f64; 3] {
        if !C::EXCHANGE {
            let mut a = if BILATERAL { a.abs() } else { a };
            if RECIPROCAL {
                a = if BILATERAL { acute(a) } else { half_turn(a) };
            }
            return [r1, r2, a];
        }
        let exchanged = match (RECIPROCAL, BILATERAL) {
            (false, _) => false,
            (true, true) => r1 < r2,
            (true, false) => {
                // Light and sensor exchanged: (r1, r2, a) is (r2, r1, −a). At a = 0 and ±π the
                // azimuth is equal for both, and the elevations decide.
                let tie = same(a, 0.0) | same(a.abs(), PI);
                (tie & (r1 < r2)) | (!tie & (a < 0.0))
            }
        };
        let folded = RECIPROCAL || BILATERAL;
        let a = if folded { a.abs() } else { a };
        if exchanged { [r2, r1, a] } else { [r1, r2, a] }
    }

    /// Folds the 4-D form; azimuths are in [−π, π].
    #[inline(always)]
    fn absolute(c: Coords) -> Coords {
        let kept = Self::mirrored(c);
        if !RECIPROCAL {
            return kept;
        }
        if C::EXCHANGE {
            let exchanged = Self::mirrored([c[2], c[3], c[0], c[1]]);
            // Elevations decide; azimuths only where the elevations are equal.
            let (x, y) = (exchanged, kept);
            let nested = (x[1] < y[1]) | ((x[1] == y[1]) & (x[3] < y[3]));
            let later = (x[0] > y[0]) | ((x[0] == y[0]) & nested);
            return if later { exchanged } else { kept };
        }
        let [r1, a1, r2, a2] = kept;
        let a2 = half_turn(a2);
        // The mirror that keeps a1 sends a2 to −a2 (or π − a2): one of the two.
        let on_mirror = BILATERAL & (same(a1, 0.0) | same(a1, FRAC_PI_2));
        let other = half_turn(-a2);
        [
            r1,
            a1,
            r2,
            if on_mirror & (other < a2) { other } else { a2 },
        ]
    }

    /// Folds a block of either form, an array each coordinate.
    #[inline(always)]
    fn block([x, y, z, w]: &mut [[f64; BLOCK]; 4], isotropic: bool) {
        if isotropic {
            for j in 0..BLOCK {
                [x[j], y[j], z[j]] = Self::relative([x[j], y[j], z[j]]);
            }
        } else {
            for j in 0..BLOCK {
                [x[j], y[j], z[j], w[j]] = Self::absolute([x[j], y[j], z[j], w[j]]);
            }
        }
    }

    /// Brings the first azimuth into [0, π/2] by the mirrors y → −y and x → −x.
    #[inline(always)]
    fn mirrored([r1, a1, r2, a2]: Coords) -> Coords {
        if !BILATERAL {
            return [r1, a1, r2, a2];
        }
        let below = a1 < 0.0;
        let (b1, b2) = if below { (-a1, -a2) } else { (a1, a2) };
        // A mirror always flips the nested azimuth; an absolute one is reflected like a1.
        let across = |a2: f64| if C::NESTED { -a2 } else { supplement(a2) };
        let behind = b1 > FRAC_PI_2;
        let b2 = if behind { across(b2) } else { b2 };
        let b1 = acute(b1);
        let (first, last) = (same(b1, 0.0), same(b1, FRAC_PI_2));
        let b2 = if first | (C::NESTED & last) {
            b2.abs()
        } else if last & (b2.abs() > FRAC_PI_2) {
            supplement(b2)
        } else {
            b2
        };
        // At a pole one azimuth is left, the one of the other direction, and both mirrors fold it.
        let (pole, other) = (r1 == 0.0, r2 == 0.0);
        let c1 = if other { quarter_turn(a1) } else { b1 };
        let c2 = if other { 0.0 } else { b2 };
        [
            r1,
            if pole { 0.0 } else { c1 },
            r2,
            if pole { quarter_turn(a2) } else { c2 },
        ]
    }
}

/// True if two azimuths differ by rounding only: a few ulp of π, which the last of many equal steps
/// from 0 to π/2 misses it by.
#[inline(always)]
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-15
}

/// An angle in [0, π] as itself or its supplement, the smaller.
#[inline(always)]
fn acute(a: f64) -> f64 {
    if a > FRAC_PI_2 { PI - a } else { a }
}

/// π − a, in [−π, π], of an angle there.
#[inline(always)]
fn supplement(a: f64) -> f64 {
    let b = PI - a;
    if b > PI { b - TAU } else { b }
}

/// An angle in [−π, π] as its image in [0, π/2] under both mirrors.
#[inline(always)]
fn quarter_turn(a: f64) -> f64 {
    a.abs().min(PI - a.abs())
}

/// An angle in [−π, π] as its representative in [0, π).
#[inline(always)]
fn half_turn(a: f64) -> f64 {
    let a = if a < 0.0 { a + PI } else { a };
    if a >= PI { 0.0 } else { a }
}

impl<C: Chart> Form<C> {
    /// Absolute coordinates of those of the form.
    #[inline(always)]
    fn lifted(&self, [x, y, z, w]: Coords) -> Coords {
        if self.symmetry.isotropic {
            C::lift([x, y, z])
        } else {
            [x, y, z, w]
        }
    }

    /// ω_i and ω_o at absolute coordinates, and whether these are in range and the directions above the horizon.
    #[inline(always)]
    fn directions([r1, a1, r2, a2]: [f64; 4]) -> ([DVec3; 2], bool) {
        let [max1, max2] = C::RADIAL.map(|r| r.max);
        let in_range = (r1 >= 0.0) & (r1 <= max1) & (r2 >= 0.0) & (r2 <= max2);
        let (directions, above) = C::inverse([r1, a1, r2, a2]);
        (directions, in_range & above)
    }

    /// Coordinates of many pairs.
    #[inline(always)]
    fn forward_blocks(&self, pairs: &[DirectionPair], out: &mut [Coords]) {
        let isotropic = self.symmetry.isotropic;
        let mut block = PairBlock::new();
        let mut c = [[0.0; BLOCK]; 4];
        let blocks = pairs.chunks(BLOCK).zip(out.chunks_mut(BLOCK));
        for (pairs, out) in blocks {
            if pairs.len() < FEW {
                for (pair, out) in pairs.iter().zip(out) {
                    *out = self.forward(pair);
                }
                continue;
            }
            block.load(pairs);
            if isotropic {
                let [r1, r2, a, _] = &mut c;
                for j in 0..BLOCK {
                    [r1[j], r2[j], a[j]] = C::relative(block.vectors(j));
                }
            } else {
                let [r1, a1, r2, a2] = &mut c;
                for j in 0..BLOCK {
                    [r1[j], a1[j], r2[j], a2[j]] = C::absolute(block.vectors(j));
                }
            }
            folded!(C, self.symmetry, block(&mut c, isotropic));
            for (j, out) in out.iter_mut().enumerate() {
                *out = [c[0][j], c[1][j], c[2][j], c[3][j]];
            }
        }
    }

    /// Pairs at many coordinates.
    #[inline(always)]
    fn inverse_blocks(&self, coords: &[Coords], out: &mut [Option<DirectionPair>]) {
        let mut c = [[0.0; BLOCK]; 4];
        let mut v = [[0.0; BLOCK]; 6];
        let mut valid = [0.0; BLOCK];
        let blocks = coords.chunks(BLOCK).zip(out.chunks_mut(BLOCK));
        for (coords, out) in blocks {
            let mut near = true;
            for (j, &coords) in coords.iter().enumerate() {
                let lifted = self.lifted(coords);
                near &= (lifted[1].abs() <= LARGEST_ANGLE) & (lifted[3].abs() <= LARGEST_ANGLE);
                for (c, x) in c.iter_mut().zip(lifted) {
                    c[j] = x;
                }
            }
            if !near || coords.len() < FEW {
                for (coords, out) in coords.iter().zip(out) {
                    *out = self.inverse(coords);
                }
                continue;
            }
            let [ix, iy, iz, ox, oy, oz] = &mut v;
            for j in 0..BLOCK {
                let ([i, o], is_valid) = Self::directions([c[0][j], c[1][j], c[2][j], c[3][j]]);
                (ix[j], iy[j], iz[j]) = (i.x, i.y, i.z);
                (ox[j], oy[j], oz[j]) = (o.x, o.y, o.z);
                valid[j] = if is_valid { 1.0 } else { 0.0 };
            }
            for (j, out) in out.iter_mut().enumerate() {
                let at = |c: usize| DVec3::new(v[c][j], v[c + 1][j], v[c + 2][j]);
                *out = (valid[j] != 0.0).then(|| DirectionPair::from_unit([at(0), at(3)]));
            }
        }
    }
}

impl<C: Chart> ParametrizationKind for Form<C> {
    const KIND: &'static str = C::NAME;

    fn with_symmetry(symmetry: Symmetry) -> Self {
        Self::new(symmetry)
    }
}

impl<C: Chart> Parametrization for Form<C> {
    fn name(&self) -> &'static str {
        C::NAME
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    #[inline]
    fn forward(&self, pair: &DirectionPair) -> Coords {
        if self.symmetry.isotropic {
            let [r1, r2, a] = self.fold_relative(C::relative(pair.vectors()));
            [r1, r2, a, 0.0]
        } else {
            self.fold_absolute(C::absolute(pair.vectors()))
        }
    }

    fn forward_batch(&self, pairs: &[DirectionPair], out: &mut [Coords]) {
        debug_assert_eq!(pairs.len(), out.len());
        vectorised!(self.forward_blocks(pairs, out));
    }

    #[inline]
    fn inverse(&self, coords: &Coords) -> Option<DirectionPair> {
        let [r1, a1, r2, a2] = self.lifted(*coords);
        let finite = a1.is_finite() && a2.is_finite();
        let near = |a: f64| {
            if a.abs() > LARGEST_ANGLE {
                wrap_angle(a)
            } else {
                a
            }
        };
        let (directions, valid) = Self::directions([r1, near(a1), r2, near(a2)]);
        (valid && finite).then(|| DirectionPair::from_unit(directions))
    }

    fn inverse_batch(&self, coords: &[Coords], out: &mut [Option<DirectionPair>]) {
        debug_assert_eq!(coords.len(), out.len());
        vectorised!(self.inverse_blocks(coords, out));
    }

    fn canonical(&self, &[x, y, z, w]: &Coords) -> Option<Coords> {
        let [max1, max2] = C::RADIAL.map(|r| r.max);
        let in_range = |r1: f64, r2: f64| r1.abs() <= max1 && r2.abs() <= max2;
        if self.symmetry.isotropic {
            let (mut r1, mut r2, mut a) = (x, y, z);
            if !in_range(r1, r2) {
                return None;
            }
            // Through a pole: the other side of the circle.
            for r in [&mut r1, &mut r2] {
                if *r < 0.0 {
                    *r = -*r;
                    a += PI;
                }
            }
            a = wrap_angle(a);
            if r1 == 0.0 || r2 == 0.0 {
                a = 0.0;
            }
            let [r1, r2, a] = self.fold_relative([r1, r2, a]);
            return Some([r1, r2, a, 0.0]);
        }
        let (mut r1, mut a1, mut r2, mut a2) = (x, y, z, w);
        if !in_range(r1, r2) {
            return None;
        }
        if r1 < 0.0 {
            r1 = -r1;
            a1 += PI;
            if C::NESTED {
                a2 += PI;
            }
        }
        if r2 < 0.0 {
            r2 = -r2;
            a2 += PI;
        }
        if r1 == 0.0 {
            // Only the sum of nested azimuths is left at the pole.
            if C::NESTED {
                a2 += a1;
            }
            a1 = 0.0;
        }
        if r2 == 0.0 {
            a2 = 0.0;
        }
        Some(self.fold_absolute([r1, wrap_angle(a1), r2, wrap_angle(a2)]))
    }

    #[inline]
    fn jacobian(&self, &[x, y, z, w]: &Coords) -> f64 {
        if self.symmetry.isotropic {
            C::jacobian(C::lift([x, y, z]))
        } else {
            C::jacobian([x, y, z, w])
        }
    }

    fn facts(&self) -> Facts {
        Facts {
            layout: if C::NESTED && !self.symmetry.isotropic {
                Layout::Nested
            } else {
                Layout::Polar
            },
            exchange: C::EXCHANGE,
            round_trip: C::ROUND_TRIP,
            singular: C::SINGULAR,
            squared: C::SQUARED,
        }
    }

    fn plane_labels(&self) -> [&'static str; 2] {
        C::LIFTED
    }

    fn images(&self, &c: &Coords) -> Images {
        let s = self.symmetry;
        let mut images: Images = smallvec![c];
        if s.isotropic {
            if s.reciprocal {
                images.push(if C::EXCHANGE {
                    [c[1], c[0], -c[2], 0.0]
                } else {
                    [c[0], c[1], wrap_angle(c[2] + PI), 0.0]
                });
            }
            if s.bilateral {
                for i in 0..images.len() {
                    let [r1, r2, a, _] = images[i];
                    images.push([r1, r2, -a, 0.0]);
                }
            }
            return images;
        }
        if s.reciprocal {
            images.push(if C::EXCHANGE {
                [c[2], c[3], c[0], c[1]]
            } else {
                [c[0], c[1], c[2], wrap_angle(c[3] + PI)]
            });
        }
        if s.bilateral {
            for i in 0..images.len() {
                let [r1, a1, r2, a2] = images[i];
                images.push([r1, -a1, r2, -a2]);
            }
            for i in 0..images.len() {
                let [r1, a1, r2, a2] = images[i];
                let b2 = if C::NESTED { -a2 } else { wrap_angle(PI - a2) };
                images.push([r1, wrap_angle(PI - a1), r2, b2]);
            }
        }
        images
    }
}
