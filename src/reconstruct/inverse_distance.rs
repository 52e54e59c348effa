//! Inverse-distance weighting over the k nearest readings (Shepard 1968, local).
//!
//! y(x) = Σ w_j y_j / Σ w_j, w_j = d_j^−power, d the distance in the embedding of
//! [`super::scattered`]. At a reading the weight is infinite and the reading is returned.

use super::cloud::{Cloud, Found};
use super::coordinates::{Coordinates, ReconstructionCoordinates};
use super::scattered::{ScatteredRule, scattered};
use super::transform::{EPSILON, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError, check_neighbours};
use crate::error::{ParameterError, in_left_open};
use crate::registry::{self, declare};
use std::num::NonZeroUsize;

declare! {
    dyn Reconstruct, "inverse-distance": "inverse-distance weights over the k nearest readings; also stretch (1.5, of sheets 3)", [
        "neighbours = 12\npower = 2.0",
        "coordinates = { kind = \"half-difference\", warp = { theta_h = \"square-root\" } }",
    ]
    /// Inverse-distance weighting, as a config writes it.
    pub struct InverseDistance {
        /// Function of f_r that is interpolated.
        values: Values = Values::Log;
        /// Offset of the logarithm, sr⁻¹.
        epsilon: f64 = EPSILON;
        /// Number of neighbours (readings and their mirror images).
        neighbours: usize = 12;
        /// Exponent of the distance.
        power: f64 = 2.0;
        /// Coordinates to interpolate in; by default those of the schedule.
        #[serde(skip_serializing_if = "Option::is_none")]
        coordinates: Option<Coordinates> = None;
        /// Weight of the first radial axis against the second; by default [`super::STRETCH`], or
        /// [`super::STRETCH_OF_SHEETS`] if the readings lie in sheets. A grid in its own coordinates has
        /// none.
        #[serde(skip_serializing_if = "Option::is_none")]
        stretch: Option<f64> = None;
    }
}

impl InverseDistance {
    fn search(&self) -> ReconstructionCoordinates<'_> {
        ReconstructionCoordinates::new(&self.coordinates, self.stretch)
    }
}

impl Reconstruct for InverseDistance {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        super::label(KIND, self.values, false, self.coordinates.as_ref())
    }

    chooses_coordinates!();

    fn check(&self) -> Result<(), ParameterError> {
        self.values.check(self.epsilon)?;
        check_neighbours(self.neighbours, 1)?;
        in_left_open("power", self.power, 0.0, 100.0)?;
        ReconstructionCoordinates::new(&self.coordinates, self.stretch).check()
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        let rule = Shepard {
            neighbours: check_neighbours(self.neighbours, 1)?,
            power: self.power,
        };
        let transform = self.values.with(self.epsilon);
        scattered(KIND, r, &self.search(), transform, rule)
    }
}

/// Inverse-distance weights as a rule over neighbours.
pub(super) struct Shepard {
    pub neighbours: NonZeroUsize,
    pub power: f64,
}

impl<const K: usize> ScatteredRule<K> for Shepard {
    type Scratch = Found;

    fn scratch(&self) -> Found {
        Found::default()
    }

    fn interpolate(
        &self,
        cloud: &Cloud<K>,
        queries: &[[f64; K]],
        found: &mut Found,
        out: &mut [f64],
    ) {
        found.restart();
        for (x, out) in queries.iter().zip(out.chunks_exact_mut(cloud.channels)) {
            cloud.find(x, self.neighbours, found);
            Self::mean(self.power, cloud, found, out);
        }
    }
}

impl Shepard {
    /// The weighted mean of the neighbours that were found.
    pub(crate) fn mean<const K: usize>(
        power: f64,
        cloud: &Cloud<K>,
        found: &Found,
        out: &mut [f64],
    ) {
        out.fill(0.0);
        let mut total = 0.0;
        let nearest = found.distance2[0];
        let exponent = -0.5 * power;
        for (&i, &d2) in found.index.iter().zip(&found.distance2) {
            // Relative to the nearest one: no overflow however close it is, and exactly that
            // reading where the distance is 0.
            let w = if d2 == nearest {
                1.0
            } else {
                // (d/d_nearest)^−power; 0 if the nearest is at distance 0.
                let ratio = d2 / nearest;
                if exponent == -1.0 {
                    1.0 / ratio
                } else {
                    ratio.powf(exponent)
                }
            };
            total += w;
            for (out, y) in out.iter_mut().zip(cloud.value(i)) {
                *out += w * y;
            }
        }
        for out in out {
            *out /= total;
        }
    }
}
