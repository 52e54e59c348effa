//! Rules over the readings next to a pair.
//!
//! The nearest reading: on a grid the nearest node in index units (below the horizon the reading
//! of a next node), else the nearest point of the embedding (see [`super::scattered`]).
//!
//! Inverse-distance weighting over the k nearest readings (Shepard 1968, local): y(x) = Σ w_j y_j / Σ w_j,
//! w_j = d_j^−power, d the distance in the embedding. At a reading the weight is infinite and the reading is returned.

use super::cloud::{Cloud, Found, Search};
use super::coordinates::{Coordinates, ReconstructionCoordinates};
use super::grid::{Continuation, GridInterpolant, Padded, Rule};
use super::scattered::{ScatteredRule, scattered};
use super::transform::{EPSILON, Transform, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError, check_neighbours};
use crate::error::{ParameterError, in_left_open};
use crate::registry::declare;
use std::num::NonZeroUsize;

declare! {
    impl dyn Reconstruct, "nearest": "the nearest reading; also stretch (1.5, of sheets 3)", [
        "",
        "coordinates = { kind = \"half-difference\" }",
    ]
    /// The nearest reading, as a config writes it.
    pub struct NearestReading {
        /// Coordinates of the search; by default those of the schedule.
        coordinates: Option<Coordinates> = None;
        /// Weight of the first radial axis against the second; by default [`super::STRETCH`], or
        /// [`super::STRETCH_OF_SHEETS`] if the readings lie in sheets. A grid in its own coordinates has
        /// none.
        stretch: Option<f64> = None;
    }
}

impl Reconstruct for NearestReading {
    fn label(&self) -> String {
        super::label(
            NearestReading::KIND,
            Values::Log,
            false,
            self.coordinates.as_ref(),
        )
    }

    chooses_coordinates!();

    fn check(&self) -> Result<(), ParameterError> {
        ReconstructionCoordinates::new(&self.coordinates, self.stretch).check()
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        if r.schedule.lattice.is_none() || self.coordinates.is_some() {
            let search = ReconstructionCoordinates::new(&self.coordinates, self.stretch);
            return scattered(NearestReading::KIND, r, &search, Transform::Linear, First);
        }
        match r.schedule.parametrization.axes().len() {
            3 => on_grid::<3>(r),
            _ => on_grid::<4>(r),
        }
    }
}

fn on_grid<const D: usize>(r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
    let transform = Transform::Linear;
    let table =
        Padded::<D>::new(NearestReading::KIND, r, transform, 2, Continuation::Copy)?.cropped(1);
    let strides = table.strides();
    let rule = Round { table, strides };
    Ok(Box::new(GridInterpolant::new(rule, r, transform)))
}

/// Rule on a lattice: the value of the nearest node.
struct Round<const D: usize> {
    table: Padded<D>,
    strides: [usize; D],
}

impl<const D: usize> Rule<D> for Round<D> {
    #[inline]
    fn interpolate(&self, x: &[f64; D], out: &mut [f64]) {
        let mut at = 0;
        for d in 0..D {
            let node = (x[d] + self.table.pad as f64 + 0.5).floor();
            let node = node.clamp(0.0, (self.table.shape[d] - 1) as f64);
            at += node as usize * self.strides[d];
        }
        out.copy_from_slice(&self.table.values[at..at + out.len()]);
    }
}

/// Rule over neighbours: the value of the first.
struct First;

impl<const K: usize> ScatteredRule<K> for First {
    type Scratch = ();

    fn interpolate(
        &self,
        cloud: &Cloud<K>,
        queries: &[[f64; K]],
        _scratch: &mut (),
        out: &mut [f64],
    ) {
        for (x, out) in queries.iter().zip(out.chunks_exact_mut(cloud.channels)) {
            out.copy_from_slice(cloud.value(cloud.nearest(x)));
        }
    }
}

declare! {
    impl dyn Reconstruct, "inverse-distance": "inverse-distance weights over the k nearest readings; also stretch (1.5, of sheets 3)", [
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
        coordinates: Option<Coordinates> = None;
        /// Weight of the first radial axis against the second; by default [`super::STRETCH`], or
        /// [`super::STRETCH_OF_SHEETS`] if the readings lie in sheets. A grid in its own coordinates has
        /// none.
        stretch: Option<f64> = None;
    }
}

impl Reconstruct for InverseDistance {
    fn label(&self) -> String {
        super::label(
            InverseDistance::KIND,
            self.values,
            false,
            self.coordinates.as_ref(),
        )
    }

    chooses_coordinates!();

    // A search for neighbours.
    fn value_seconds(&self, _readings: usize) -> f64 {
        7e-6
    }

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
        let search = ReconstructionCoordinates::new(&self.coordinates, self.stretch);
        scattered(InverseDistance::KIND, r, &search, transform, rule)
    }
}

/// Inverse-distance weights as a rule over neighbours.
pub(super) struct Shepard {
    pub neighbours: NonZeroUsize,
    pub power: f64,
}

impl<const K: usize> ScatteredRule<K> for Shepard {
    type Scratch = Search;

    fn interpolate(
        &self,
        cloud: &Cloud<K>,
        queries: &[[f64; K]],
        search: &mut Search,
        out: &mut [f64],
    ) {
        search.restart();
        for (x, out) in queries.iter().zip(out.chunks_exact_mut(cloud.channels)) {
            cloud.find(x, self.neighbours, search);
            Self::mean(self.power, cloud, &search.found, out);
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
