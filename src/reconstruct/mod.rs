//! A measurement becomes a BRDF again.

mod coordinates;
mod cubic;
mod grid;
mod interpolant;
mod inverse_distance;
mod lattice_method;
mod multilinear;
mod nearest;
mod scattered;
mod thin_plate;
mod transform;

pub use coordinates::Coordinates;
pub use cubic::{Cubic, CubicRule};
pub use interpolant::{Interpolant, Readings};
pub use inverse_distance::InverseDistance;
pub use lattice_method::{LatticeMethod, LatticeRule};
pub use multilinear::{Multilinear, MultilinearRule};
pub use nearest::NearestReading;
pub use thin_plate::ThinPlate;
pub use transform::{Transform, Values};

use coordinates::ReconstructionCoordinates;
use interpolant::Interpolated;

use crate::brdf::Brdf;
use crate::error::ParameterError;
use crate::measurement::Measurement;
use crate::registry::{self, Entry, ReadError, Table};
use std::num::NonZeroUsize;

/// Turns a measurement into a BRDF. A config names one by `kind`.
pub trait Reconstruct: std::fmt::Debug + Send + Sync {
    /// The kind and every key with its value, defaults filled in.
    fn resolved(&self) -> toml::Table;

    /// A short name for tables, the kind unless keys that matter differ from their defaults.
    fn label(&self) -> String;

    /// True if this needs readings on a grid.
    fn needs_grid(&self) -> bool;

    /// Checks every parameter that can be checked without readings.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    fn check(&self) -> Result<(), ParameterError>;

    /// What interpolates (or approximates) the readings, every value of a pose with the same
    /// weights. It has the symmetries of the schedule.
    ///
    /// # Errors
    /// If there are too few readings, or none on a grid where one is needed.
    fn interpolate(
        &self,
        readings: &Readings<'_>,
    ) -> Result<Box<dyn Interpolant>, ReconstructError>;

    /// The BRDF of a measurement: it has the symmetries of the schedule and the channels of the
    /// measurement; it is 0 below the horizon, and finite and ≥ 0 above it.
    ///
    /// # Errors
    /// As [`interpolate`](Self::interpolate).
    fn reconstruct(&self, measurement: &Measurement) -> Result<Box<dyn Brdf>, ReconstructError> {
        let present = interpolant::present(measurement);
        let interpolant = self.interpolate(&Readings {
            schedule: &measurement.schedule,
            width: measurement.channels.count(),
            values: &measurement.values,
            present: &present,
        })?;
        Ok(Box::new(Interpolated {
            interpolant,
            channels: measurement.channels,
            symmetry: measurement.schedule.parametrization.symmetry(),
        }))
    }
}

/// Why a measurement could not be turned into a BRDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReconstructError {
    /// Fewer readings than the method needs.
    #[error("{readings} readings are too few: {method} needs at least {needed}")]
    TooFew {
        /// The method.
        method: &'static str,
        /// Readings there are.
        readings: usize,
        /// Readings it needs.
        needed: usize,
    },
    /// The readings are not on a grid.
    #[error("{method} needs a grid, the sample set is {sample_set}")]
    NoGrid {
        /// The method.
        method: &'static str,
        /// The sample set there is.
        sample_set: String,
    },
    /// A parameter is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// Every reconstruction a config can name.
pub fn all() -> Vec<Entry<dyn Reconstruct>> {
    vec![
        nearest::ENTRY,
        Multilinear::ENTRY,
        Cubic::ENTRY,
        inverse_distance::ENTRY,
        thin_plate::ENTRY,
    ]
}

/// Reads a reconstruction from its config table.
pub fn read(table: Table<'_>) -> Result<Box<dyn Reconstruct>, ReadError> {
    registry::read("reconstruction", &all(), table)
}

/// Default weight of the first radial axis of an embedding against the second: lobes are narrower
/// along it.
const STRETCH: f64 = 1.5;

/// The kind, and what of it is not the default.
fn label(kind: &str, values: Values, coordinates: Option<&Coordinates>) -> String {
    let mut label = kind.to_owned();
    if values == Values::Linear {
        label.push_str("-linear");
    }
    if let Some(coordinates) = coordinates {
        label.push_str(&format!("[{}]", coordinates.label()));
    }
    label
}

/// Checks a number of neighbours.
fn check_neighbours(n: usize, fewest: usize) -> Result<NonZeroUsize, ParameterError> {
    match NonZeroUsize::new(n) {
        Some(n) if (fewest..=256).contains(&n.get()) => Ok(n),
        _ => Err(ParameterError::new(
            "neighbours",
            n,
            format!("a whole number in [{fewest}, 256]"),
        )),
    }
}
