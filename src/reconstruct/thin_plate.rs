//! Local splines through the k nearest readings: keys of a config. The rule is that of
//! [`super::local_spline`].

use super::coordinates::{Coordinates, ReconstructionCoordinates};
use super::local_spline::Local;
use super::scattered::scattered;
use super::transform::{EPSILON, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError, check_neighbours};
use crate::error::ParameterError;
use crate::registry::declare;

declare! {
    dyn Reconstruct, "thin-plate": "local thin-plate spline over the k nearest readings; also stretch (1.5, of sheets 3)", [
        "neighbours = 30",
        "noise = true",
        "coordinates = { kind = \"hybrid\" }",
    ]
    /// The thin-plate spline, as a config writes it.
    pub struct ThinPlate {
        /// Function of f_r that is interpolated.
        values: Values = Values::Log;
        /// Offset of the logarithm, sr⁻¹.
        epsilon: f64 = EPSILON;
        /// Number of neighbours (readings and their mirror images).
        neighbours: usize = 30;
        /// Coordinates to interpolate in; by default those of the schedule.
        coordinates: Option<Coordinates> = None;
        /// Weight of the first radial axis against the second; by default [`super::STRETCH`], or
        /// [`super::STRETCH_OF_SHEETS`] if the readings lie in sheets. A grid in its own coordinates has
        /// none.
        stretch: Option<f64> = None;
        /// True to miss readings by their uncertainty of type A, as far as the others ask for it.
        noise: bool = false;
    }
}

/// Fewest neighbours that are asked for: one more than the polynomials of the 4-D embedding.
const FEWEST: usize = 6;

impl Reconstruct for ThinPlate {
    fn label(&self) -> String {
        super::label(KIND, self.values, self.noise, self.coordinates.as_ref())
    }

    chooses_coordinates!();

    fn weighs_readings(&self) -> bool {
        self.noise
    }

    // A system of equations.
    fn value_seconds(&self, _readings: usize) -> f64 {
        4e-5
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.values.check(self.epsilon)?;
        check_neighbours(self.neighbours, FEWEST)?;
        ReconstructionCoordinates::new(&self.coordinates, self.stretch).check()
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        let r = &Readings {
            noise: r.noise.filter(|_| self.noise),
            ..*r
        };
        let rule = Local::new(check_neighbours(self.neighbours, FEWEST)?, self.values);
        let transform = self.values.with(self.epsilon);
        let search = ReconstructionCoordinates::new(&self.coordinates, self.stretch);
        scattered(KIND, r, &search, transform, rule)
    }
}
