//! The columns of pairs in chosen coordinates, and the terms of kernels of them.
//!
//! Every parametrization is treated alike, so that none is favoured. With radial coordinates r₁, r₂ over their ranges (warped,
//! if they are) and the azimuth a of the 3-D form times π over its range, or 2π where it is periodic, a pair has the columns
//! r₁, r₂, e = r₁ r₂ cos a, f = r₁ r₂ sin a: where a radial coordinate is 0 its azimuth has no effect, and the ends of an azimuth are one
//! place, or a mirror. In 4-D, with (x₁, y₁) = r₁ (cos a₁, sin a₁) and (x₂, y₂) = r₂ (cos a₂, sin a₂), a₁ + a₂ in the place of a₂ where that
//! turns with a₁, and 2 a₂ in its place where its period is π, the further columns are x₁, y₁, x₂, y₂ or, for bilateral materials,
//! what both mirrors leave: |x₁|, |y₁|, |x₂|, |y₂|, e = x₁ x₂, f = y₁ y₂, with a period of π |x₁|, |y₁|, x₂, 2 x₁ y₁ y₂ / r₁.
//! Coordinates that are no polar ones stand as they are, over their largest sizes.

use super::kernel::{A, B, C, Columns, D, E, F, Kernel, P, R, Term, usual_columns};
use super::trained::{self, TERMS};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::{Axis, AxisKind, Coords, Layout, Parametrization};
use crate::reconstruct::Coordinates;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Where the covariances of pairs are those of some columns.
#[derive(Clone)]
pub(super) struct Space {
    symmetry: Symmetry,
    /// `None`: the columns of the kernel without a choice, of half/difference.
    chosen: Option<(Arc<dyn Parametrization>, Coordinates)>,
}

impl Space {
    /// Of a material of this symmetry.
    ///
    /// # Errors
    /// If there is no such parametrization, axis or warp.
    pub(crate) fn new(
        symmetry: Symmetry,
        coordinates: Option<&Coordinates>,
    ) -> Result<Self, ParameterError> {
        let form = |c: &Coordinates| Ok::<_, ParameterError>((c.form(symmetry)?, c.clone()));
        Ok(Self {
            symmetry,
            chosen: coordinates.map(form).transpose()?,
        })
    }

    /// Without a choice of coordinates.
    pub(crate) fn usual(symmetry: Symmetry) -> Self {
        Self {
            symmetry,
            chosen: None,
        }
    }

    /// The kernel of many materials.
    pub(crate) fn kernel(&self) -> Kernel {
        match &self.chosen {
            None => Kernel::new(self.symmetry),
            Some((form, coordinates)) => kernel(&**form, &trained::constants(coordinates)),
        }
    }

    pub(crate) fn columns(&self, pairs: &[DirectionPair]) -> Vec<Columns> {
        let mut columns = usual_columns(pairs, self.symmetry);
        if let Some((form, _)) = &self.chosen {
            let mut coords = vec![[0.0; 4]; pairs.len()];
            form.forward_batch(pairs, &mut coords);
            let facts = form.facts();
            for (columns, c) in columns.iter_mut().zip(&coords) {
                chosen_columns(form.axes(), facts.layout, c, columns);
            }
        }
        columns
    }
}

/// A kernel of the columns of a form, of the logarithms of amplitudes and lengths of each of [`TERMS`].
pub(super) fn kernel(form: &dyn Parametrization, constants: &[f64]) -> Kernel {
    let isotropic = form.axes().len() == 3;
    let straight = form.facts().layout == Layout::Straight;
    let mut constants = constants.iter().map(|x| x.exp());
    let mut next = || constants.next().unwrap_or(1.0);
    let of = |columns: &&[usize]| {
        let amplitude = next();
        let all = columns.len() > 1;
        let lengths = columns.iter().map(|&c| (c, next()));
        // In 4-D a term of several columns is one of both vectors.
        let split = |(c, length): (usize, f64)| match c {
            P if all && !isotropic => vec![(A, length), (B, length)],
            R if all && !isotropic => vec![(C, length), (D, length)],
            E | F if straight => vec![(A + c - E, length)],
            c => vec![(c, length)],
        };
        Term {
            amplitude,
            lengths: lengths.flat_map(split).collect(),
        }
    };
    Kernel::of_terms(TERMS.iter().map(of).collect())
}

/// Writes the columns of coordinates.
fn chosen_columns(axes: &[Axis], layout: Layout, c: &Coords, out: &mut Columns) {
    let over = |i: usize| c[i] / axes[i].range[0].abs().max(axes[i].range[1].abs());
    // An azimuth so that its range is a turn, or half of one between mirrors.
    let turn = |axis: &Axis, a: f64| match axis.kind {
        AxisKind::Mirrored => a * PI / axis.length(),
        _ => a * TAU / axis.length(),
    };
    if layout == Layout::Straight {
        let places: &[usize] = if axes.len() == 3 {
            &[P, R, A]
        } else {
            &[A, B, C, D]
        };
        for (i, &place) in places.iter().enumerate() {
            out[place] = over(i);
        }
        return;
    }
    if let [_, _, azimuth] = axes {
        let (r1, r2) = (over(0), over(1));
        let (sin, cos) = turn(azimuth, c[2]).sin_cos();
        (out[P], out[R], out[E], out[F]) = (r1, r2, r1 * r2 * cos, r1 * r2 * sin);
        return;
    }
    let (r1, r2) = (over(0), over(2));
    let folded = axes[1].kind == AxisKind::Mirrored;
    let half = axes[3].length() < 1.5 * PI;
    let nested = if layout == Layout::Nested { c[1] } else { 0.0 };
    let a2 = (c[3] + nested) * if half { 2.0 } else { 1.0 };
    let (y1, x1) = c[1].sin_cos();
    let (y2, x2) = a2.sin_cos();
    let ([x1, y1], [x2, y2]) = ([r1 * x1, r1 * y1], [r2 * x2, r2 * y2]);
    (out[P], out[R]) = (r1, r2);
    debug_assert!(!folded || axes[1].length() < FRAC_PI_2 + 1e-9);
    [out[A], out[B], out[C], out[D]] = match (folded, half) {
        (false, _) => [x1, y1, x2, y2],
        (true, true) => [x1.abs(), y1.abs(), x2, 2.0 * x1 * y1 * y2 / r1.max(1e-300)],
        (true, false) => [x1.abs(), y1.abs(), x2.abs(), y2.abs()],
    };
    if folded && !half {
        (out[E], out[F]) = (x1 * x2, y1 * y2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Direction;
    use crate::parametrization;
    use crate::sampling::{Random, cosine_hemisphere};
    use glam::DVec3;

    /// Pairs that a material of this symmetry has the same value at.
    fn images(pair: &DirectionPair, symmetry: Symmetry) -> Vec<DirectionPair> {
        let map = |f: &dyn Fn(DVec3) -> DVec3| {
            let [i, o] = [pair.omega_i, pair.omega_o].map(|d| Direction::from_unit(f(d.vector())));
            DirectionPair::new(i, o)
        };
        let mut all = Vec::new();
        if symmetry.reciprocal {
            all.push(DirectionPair::new(pair.omega_o, pair.omega_i));
        }
        if symmetry.isotropic {
            let turn = glam::DMat3::from_rotation_z(0.7);
            all.push(map(&|v| turn * v));
        }
        if symmetry.bilateral {
            all.push(map(&|v| DVec3::new(v.x, -v.y, v.z)));
            all.push(map(&|v| DVec3::new(-v.x, v.y, v.z)));
        }
        all
    }

    #[test]
    fn columns_have_the_symmetries_of_the_material() {
        let random = Random::new(3);
        let pairs = (0..200).map(|k| {
            let [a, b, c, d] = random.point(k);
            DirectionPair::new(cosine_hemisphere([a, b]), cosine_hemisphere([c, d]))
        });
        let pairs: Vec<DirectionPair> = pairs.collect();
        for entry in parametrization::all() {
            let coordinates = Coordinates {
                kind: entry.kind.into(),
                warp: Default::default(),
            };
            for bits in 0..8 {
                let [isotropic, reciprocal, bilateral] = [1, 2, 4].map(|bit| bits & bit > 0);
                let symmetry = Symmetry {
                    isotropic,
                    reciprocal,
                    bilateral,
                };
                let space = Space::new(symmetry, Some(&coordinates)).unwrap();
                for pair in &pairs {
                    let own = space.columns(&[*pair])[0];
                    assert!(own[A..].iter().all(|x| x.abs() <= 1.0 + 1e-12), "{own:?}");
                    for image in images(pair, symmetry) {
                        let theirs = space.columns(&[image])[0];
                        let off = own.iter().zip(theirs).map(|(a, b)| (a - b).abs());
                        let off = off.fold(0.0, f64::max);
                        assert!(off < 1e-9, "{} {symmetry:?} {pair:?}: {off:e}", entry.kind);
                    }
                }
            }
        }
    }
}
