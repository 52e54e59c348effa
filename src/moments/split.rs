//! The diffuse part of a BRDF, as Zubiaga et al. 2015 (§2.2) take it: the smallest value of the
//! slice at θ_o = 45°.

use super::slice::{Batch, Channel, Kind, Slice};
use crate::brdf::Brdf;
use crate::error::ParameterError;
use crate::parametrization::view_centered;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Nodes along each angle, first over the square and then around the best node.
const NODES: usize = 128;
/// Nodes along each angle of a refinement.
const FINE: usize = 17;
/// Refinements; each is 8 times finer.
const ROUNDS: usize = 3;

/// The smallest value (sr⁻¹) of the slice at θ_o = 45°: 128 × 128 nodes at the middle of equal
/// cells of the square (θ, φ), then three times a finer grid around the smallest. Nodes without
/// data are left out; 0 if that leaves none.
///
/// # Errors
/// If the BRDF was not built for the channel.
pub fn lambertian_part(brdf: &dyn Brdf, channel: Channel) -> Result<f64, ParameterError> {
    let slice = Slice::new(brdf, channel, FRAC_PI_4)?;
    let mut batch = Batch::default();
    let mut least: Option<(f64, [f64; 2])> = None;
    let mut cell = 2.0 * FRAC_PI_2 / NODES as f64;
    let mut look = |centre: [f64; 2], cell: f64, n: usize, least: &mut Option<(f64, [f64; 2])>| {
        // The middle of the outermost cells of the square, so that no node is on the horizon.
        let limit = FRAC_PI_2 - 0.5 * cell.min(2.0 * FRAC_PI_2 / NODES as f64);
        let step = |i: usize| (i as f64 - 0.5 * (n - 1) as f64) * cell;
        let mut points = Vec::with_capacity(n * n);
        batch.clear();
        for i in 0..n {
            for j in 0..n {
                let [theta, phi] =
                    [centre[0] + step(i), centre[1] + step(j)].map(|a| a.clamp(-limit, limit));
                points.push([theta, phi]);
                batch.push(&slice, view_centered(theta, phi));
            }
        }
        slice.evaluate(&mut batch);
        for ((&value, kind), point) in batch.values().iter().zip(batch.kinds()).zip(points) {
            if *kind != Kind::Missing && least.is_none_or(|(smallest, _)| value < smallest) {
                *least = Some((value, point));
            }
        }
    };
    look([0.0; 2], cell, NODES, &mut least);
    for _ in 0..ROUNDS {
        let Some((_, centre)) = least else {
            break;
        };
        cell /= (FINE / 2) as f64;
        look(centre, cell, FINE, &mut least);
    }
    Ok(least.map_or(0.0, |(value, _)| value))
}
