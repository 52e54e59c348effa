//! Stretching of small steps by a parametrization.
//!
//! The map from coordinates to the two spheres of directions, modulo a turn of the sample, has
//! three singular values at each pair: the longest and the shortest way (rad) that a small step of
//! a given length in coordinates can lead, each axis scaled to length 1 as a grid with equally many
//! nodes along each would have it, and one between. Their ratio, the condition number, is 1 where
//! the map is a similarity.
//!
//! They are found from [`forward`](crate::parametrization::Parametrization::forward), whose
//! derivative along orthonormal tangents of both spheres is a 3 × 4 matrix that vanishes along the
//! turn; its non-zero singular values are the reciprocals. With θ_i, θ_o the elevations and ℓ the
//! lengths of the axes, σ₁ σ₂ σ₃ √(sin² θ_i + sin² θ_o) = J ℓ₁ ℓ₂ ℓ₃, J the Jacobian: the turn by
//! dφ moves both directions by sin θ dφ.

use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric::wrap_angle;
use crate::parametrization::{Parametrization, ParametrizationSpec};
use crate::registry::Entry;
use nalgebra::Matrix3x4;
use rayon::prelude::*;
use serde::Serialize;

/// Step of the central differences (rad): its square and its share of a rounding, 1e-16 over it,
/// are both below 1e-10.
const STEP: f64 = 1e-6;

/// Stretching of steps by a parametrization, over a set of pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Anisotropy {
    /// Name of the parametrization.
    pub parametrization: &'static str,
    /// Median condition number, ≥ 1.
    pub condition_median: f64,
    /// 95 % of the condition numbers are below it.
    pub condition_p95: f64,
    /// Median relative difference of the product of the singular values from the Jacobian.
    pub jacobian_error_median: f64,
    /// Number of pairs.
    pub pairs: usize,
    /// Pairs left out: at a pole or on the horizon, where there is no derivative.
    pub skipped: usize,
}

/// The value below which a share of sorted ones is.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[(share * (sorted.len() - 1) as f64).round() as usize]
}

/// Anisotropy of the 3-D form of a parametrization for BRDFs with every symmetry, over `pairs`;
/// `None` if no pair has a derivative.
pub fn anisotropy(
    entry: &Entry<ParametrizationSpec>,
    pairs: &[DirectionPair],
) -> Option<Anisotropy> {
    // Derivatives must not see the folds, lengths are those of the folded axes.
    let open = entry.form(Symmetry::NONE.with_isotropy(true));
    let axes = entry.axes(Symmetry::FULL);
    let lengths = [0, 1, 2].map(|i| axes[i].length());
    let found = pairs.par_iter().filter_map(|pair| {
        let [long, middle, short] = stretches(&*open, lengths, pair)?;
        let turn = pair.omega_i.sin_theta().hypot(pair.omega_o.sin_theta());
        let volume = open.jacobian(&open.forward(pair)) * lengths.iter().product::<f64>();
        let error = (long * middle * short * turn / volume - 1.0).abs();
        Some((long / short, error))
    });
    let (mut conditions, mut errors): (Vec<f64>, Vec<f64>) = found.unzip();
    conditions.sort_by(f64::total_cmp);
    errors.sort_by(f64::total_cmp);
    (!conditions.is_empty()).then(|| Anisotropy {
        parametrization: entry.kind,
        condition_median: quantile(&conditions, 0.5),
        condition_p95: quantile(&conditions, 0.95),
        jacobian_error_median: quantile(&errors, 0.5),
        pairs: conditions.len(),
        skipped: pairs.len() - conditions.len(),
    })
}

/// The singular values (rad) of the map from coordinates, axes scaled to length 1, to pairs modulo
/// a turn of the sample, descending. `open` is an isotropic form without folds. `None` at poles
/// and on the horizon.
pub fn stretches(
    open: &dyn Parametrization,
    lengths: [f64; 3],
    pair: &DirectionPair,
) -> Option<[f64; 3]> {
    let step = |d: Direction, tangent: usize, by: f64| {
        let (a, b) = d.vector().any_orthonormal_pair();
        let moved = Direction::try_new(d.vector() + by * [a, b][tangent])?;
        (moved.cos_theta() > 0.0).then_some(moved)
    };
    let (i, o) = (pair.omega_i, pair.omega_o);
    let mut matrix = Matrix3x4::zeros();
    for column in 0..4 {
        let moved = |by: f64| {
            Some(match column {
                0 | 1 => DirectionPair::new(step(i, column, by)?, o),
                _ => DirectionPair::new(i, step(o, column - 2, by)?),
            })
        };
        let ahead = open.forward(&moved(STEP)?);
        let behind = open.forward(&moved(-STEP)?);
        let mut differences = [0, 1, 2].map(|row| ahead[row] - behind[row]);
        differences[2] = wrap_angle(differences[2]);
        for row in 0..3 {
            matrix[(row, column)] = differences[row] / (2.0 * STEP * lengths[row]);
        }
    }
    let mut values = matrix.singular_values();
    values.as_mut_slice().sort_by(f64::total_cmp);
    let [a, b, c] = [values[0], values[1], values[2]];
    // NaN fails.
    (a > 0.0 && c.is_finite()).then(|| [1.0 / a, 1.0 / b, 1.0 / c])
}
