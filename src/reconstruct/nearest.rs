//! The nearest reading: on a grid the nearest node in index units (below the horizon the reading
//! of a next node), else the nearest point of the embedding (see [`super::scattered`]).

use super::cloud::Cloud;
use super::coordinates::{Coordinates, ReconstructionCoordinates};
use super::grid::{Continuation, GridInterpolant, Padded, Rule};
use super::scattered::{ScatteredRule, scattered};
use super::transform::{Transform, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError};
use crate::error::ParameterError;
use crate::registry::{self, declare};

declare! {
    dyn Reconstruct, "nearest": "the nearest reading; also stretch (1.5, of sheets 3)", [
        "",
        "coordinates = { kind = \"half-difference\" }",
    ]
    /// The nearest reading, as a config writes it.
    pub struct NearestReading {
        /// Coordinates of the search; by default those of the schedule.
        #[serde(skip_serializing_if = "Option::is_none")]
        coordinates: Option<Coordinates> = None;
        /// Weight of the first radial axis against the second; by default [`super::STRETCH`], or
        /// [`super::STRETCH_OF_SHEETS`] if the readings lie in sheets. A grid in its own coordinates has
        /// none.
        #[serde(skip_serializing_if = "Option::is_none")]
        stretch: Option<f64> = None;
    }
}

impl NearestReading {
    fn search(&self) -> ReconstructionCoordinates<'_> {
        ReconstructionCoordinates::new(&self.coordinates, self.stretch)
    }
}

impl Reconstruct for NearestReading {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        super::label(KIND, Values::Log, false, self.coordinates.as_ref())
    }

    chooses_coordinates!();

    fn check(&self) -> Result<(), ParameterError> {
        ReconstructionCoordinates::new(&self.coordinates, self.stretch).check()
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        if r.schedule.lattice.is_none() || self.coordinates.is_some() {
            return scattered(KIND, r, &self.search(), Transform::Linear, First);
        }
        match r.schedule.parametrization.axes().len() {
            3 => on_grid::<3>(r),
            _ => on_grid::<4>(r),
        }
    }
}

/// The readings on a grid.
fn on_grid<const D: usize>(r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
    let transform = Transform::Linear;
    let table = Padded::<D>::new(KIND, r, transform, 2, Continuation::Copy)?.cropped(1);
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

    fn scratch(&self) {}

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
