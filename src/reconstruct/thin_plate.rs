//! Local splines through the k nearest readings: keys of a config. The rule is that of
//! [`super::local_spline`].

use super::coordinates::{Coordinates, ReconstructionCoordinates};
use super::local_spline::Local;
use super::scattered::{Embedded, ScatteredInterpolant};
use super::transform::{EPSILON, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError, check_neighbours};
use crate::error::ParameterError;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};

const KIND: &str = "thin-plate";

/// The registry entry.
pub(super) const ENTRY: Entry<dyn Reconstruct> = Entry {
    kind: KIND,
    summary: "local thin-plate spline over the k nearest readings; also stretch (1.5, of sheets 3)",
    examples: &[
        "neighbours = 30",
        "noise = true",
        "coordinates = { kind = \"hybrid\" }",
    ],
    read: |table| Ok(Box::new(registry::parse::<ThinPlate>(table)?)),
};

/// The thin-plate spline, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ThinPlate {
    /// Function of f_r that is interpolated.
    pub values: Values,
    /// Offset of the logarithm, sr⁻¹.
    pub epsilon: f64,
    /// Number of neighbours (readings and their mirror images).
    pub neighbours: usize,
    /// Coordinates to interpolate in; by default those of the schedule.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinates: Option<Coordinates>,
    /// Weight of the first radial axis against the second; by default [`super::STRETCH`], or
    /// [`super::STRETCH_OF_SHEETS`] if the readings lie in sheets. A grid in its own coordinates has
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stretch: Option<f64>,
    /// True to miss readings by their uncertainty of type A, as far as the others ask for it.
    pub noise: bool,
}

impl Default for ThinPlate {
    fn default() -> Self {
        Self {
            values: Values::Log,
            epsilon: EPSILON,
            neighbours: 30,
            coordinates: None,
            stretch: None,
            noise: false,
        }
    }
}

/// Fewest neighbours that are asked for: one more than the polynomials of the 4-D embedding.
const FEWEST: usize = 6;

impl ThinPlate {
    fn search(&self) -> ReconstructionCoordinates<'_> {
        ReconstructionCoordinates {
            coordinates: self.coordinates.as_ref(),
            stretch: self.stretch,
        }
    }

    fn build<const K: usize>(
        &self,
        r: &Readings<'_>,
    ) -> Result<Box<dyn Interpolant>, ReconstructError> {
        let transform = self.values.with(self.epsilon);
        let readings = Embedded::<K>::new(KIND, r, &self.search(), transform, 1)?;
        let rule = Local::new(check_neighbours(self.neighbours, FEWEST)?, self.values);
        Ok(Box::new(ScatteredInterpolant::new(
            rule, readings, transform,
        )))
    }
}

impl Reconstruct for ThinPlate {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        super::label(KIND, self.values, self.noise, self.coordinates.as_ref())
    }

    fn needs_grid(&self) -> bool {
        false
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
        self.search().check()
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        let r = &Readings {
            noise: r.noise.filter(|_| self.noise),
            ..*r
        };
        match r.schedule.parametrization.axes().len() {
            3 => self.build::<3>(r),
            _ => self.build::<4>(r),
        }
    }
}
