//! A measurement becomes a BRDF again. For one of your own see [`join`].

/// The methods of [`Reconstruct`] about coordinates, for a struct whose field `coordinates` holds
/// them if they are not those of the schedule.
macro_rules! chooses_coordinates {
    () => {
        fn coordinates(&self) -> Option<&crate::reconstruct::Coordinates> {
            self.coordinates.as_ref()
        }

        fn within(
            &self,
            coordinates: &crate::reconstruct::Coordinates,
        ) -> Option<std::sync::Arc<dyn Reconstruct>> {
            Some(std::sync::Arc::new(Self {
                coordinates: Some(coordinates.clone()),
                ..self.clone()
            }))
        }
    };
}

mod cloud;
mod components;
mod coordinates;
mod coverage;
mod cubic;
mod fit;
mod grid;
mod interpolant;
mod interpolated;
mod kriging;
mod lattice_method;
mod local_spline;
mod neighbours;
mod row;
mod scattered;
mod sheets;
mod spline_block;
mod thin_plate;
mod transform;
mod uncertainty;

pub use components::Components;
pub(crate) use components::{KIND as COMPONENTS, RIDGE};
pub use coordinates::Coordinates;
pub use coverage::{Cover, Coverage, Covered, Fill};
pub use cubic::{Cubic, CubicRule};
pub use fit::Fit;
pub use grid::Continuation;
pub use interpolant::{
    Interpolant, LogNormal, Predictive, Readings, Suspect, noise, present, values_at,
};
pub(crate) use kriging::{
    Estimates, KIND as KRIGING, LocalPosterior, MOST_COMPARED, MOST_SPARSE, Mixture, Places,
    Posterior, some,
};
pub use kriging::{
    FUNCTIONS, KernelTraining, Kernels, Kriging, NODES, Prior, PriorFile, TRUSTED, TrainError,
    Trained, Training, forget_searches, suspects,
};
pub use lattice_method::{LatticeMethod, LatticeRule, Multilinear, MultilinearRule};
pub use neighbours::{InverseDistance, NearestReading};
pub use sheets::{IN_SHEETS, Sheets, incidences};
pub(crate) use sheets::{Still, are_in_plane, still};
pub use thin_plate::ThinPlate;
pub use transform::{EPSILON, Transform, Values};
pub(crate) use uncertainty::states_uncertainties;
pub use uncertainty::{Estimated, MOST_PREDICTED, Replicated, Uncertain};

use coordinates::ReconstructionCoordinates;
use interpolated::Interpolated;

use crate::brdf::Brdf;
use crate::error::{ParameterError, count_are};
use crate::measurement::Measurement;
use crate::registry::{Resolved, family};
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Readings that are left out together.
pub struct LeftOut {
    /// One flag per pose: true of the readings that predict.
    pub(crate) present: Vec<bool>,
    /// The poses that are predicted.
    pub(crate) poses: Vec<usize>,
}

/// What readings that were left out are predicted to be.
pub struct Predicted {
    /// The values of each pose, sr⁻¹.
    pub(crate) values: Vec<f64>,
    /// The variance of ln(f + ε) at each pose, without what all readings share.
    pub(crate) variances: Vec<f64>,
}

/// Turns a measurement into a BRDF. A config names one by `kind`.
pub trait Reconstruct: Resolved + std::fmt::Debug + Send + Sync {
    /// A short name for tables, the kind unless keys that matter differ from their defaults.
    fn label(&self) -> String;

    /// True if this needs readings on a grid.
    fn needs_grid(&self) -> bool {
        false
    }

    /// The coordinates it interpolates in; `None`: those of the schedule.
    fn coordinates(&self) -> Option<&Coordinates> {
        None
    }

    /// This method in other coordinates; `None` if it has no choice of them.
    fn within(&self, _coordinates: &Coordinates) -> Option<Arc<dyn Reconstruct>> {
        None
    }

    /// True if it works in the coordinates of the schedule where it is given none; false of methods that have columns of their own, or
    /// none at all.
    fn takes_those_of_schedules(&self) -> bool {
        true
    }

    /// The prior of other materials; `None`: none that is in a file.
    fn prior(&self) -> Option<&PriorFile> {
        None
    }

    /// True if weights depend on the values of readings or on how uncertain they are, and not on poses alone:
    /// then several values of a pose share them only if they are of one material.
    fn weighs_readings(&self) -> bool {
        false
    }

    /// Time to make the interpolant of so many readings of one material on one core, within a factor of three, s.
    fn fit_seconds(&self, readings: usize) -> f64 {
        2e-6 * readings as f64
    }

    /// Time of one value on one core, of so many readings, within a factor of three, s.
    fn value_seconds(&self, _readings: usize) -> f64 {
        7e-7
    }

    /// Checks every parameter that can be checked without readings.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    fn check(&self) -> Result<(), ParameterError>;

    /// An interpolant through (or near) the readings, with equal weights for all values of a pose.
    /// It has the symmetries of the schedule.
    ///
    /// # Errors
    /// If there are too few readings, or none on a grid where one is needed.
    fn interpolate(
        &self,
        readings: &Readings<'_>,
    ) -> Result<Box<dyn Interpolant>, ReconstructError>;

    /// What is predicted of readings from others, set by set, where it follows from one system of all; `None`: where the others of each set
    /// are to be reconstructed by themselves.
    ///
    /// # Errors
    /// As [`interpolate`](Self::interpolate).
    fn leave_out(
        &self,
        _readings: &Readings<'_>,
        _sets: &[LeftOut],
    ) -> Result<Option<Vec<Predicted>>, ReconstructError> {
        Ok(None)
    }

    /// The BRDF of a measurement: it has the symmetries of the schedule and the channels of the
    /// measurement; it is 0 below the horizon, and finite and ≥ 0 above it.
    ///
    /// # Errors
    /// As [`interpolate`](Self::interpolate).
    fn reconstruct(&self, measurement: &Measurement) -> Result<Box<dyn Brdf>, ReconstructError> {
        let present = interpolant::present(measurement);
        let noise = noise(measurement);
        let interpolant =
            self.interpolate(&Readings::new(measurement, &present, noise.as_deref()))?;
        Ok(Box::new(Interpolated {
            interpolant,
            channels: measurement.channels.clone(),
            symmetry: measurement.schedule.parametrization.symmetry(),
        }))
    }

    /// How far off the luminance of that BRDF may be, by the luminance of the readings alone; `None` of a method that
    /// does not know.
    ///
    /// # Errors
    /// As [`interpolate`](Self::interpolate), or of fewer readings: `kriging` predicts errors of 100 000 at most.
    fn predictive(
        &self,
        _measurement: &Measurement,
    ) -> Result<Option<Box<dyn Predictive>>, ReconstructError> {
        Ok(None)
    }
}

/// Reason why a measurement could not be turned into a BRDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReconstructError {
    /// Fewer readings than the method needs.
    #[error("{} too few: {method} needs at least {needed}", count_are(*readings, "reading"))]
    TooFew {
        /// The method.
        method: &'static str,
        /// Number of readings.
        readings: usize,
        /// Number of readings that it needs.
        needed: usize,
    },
    /// More readings than the method takes.
    #[error("{} too many: {method} takes at most {allowed}", count_are(*readings, "reading"))]
    TooMany {
        /// The method.
        method: &'static str,
        /// Number of readings.
        readings: usize,
        /// Number of readings that it takes.
        allowed: usize,
    },
    /// A material is richer than those of a prior.
    #[error(
        "{method} takes isotropic, reciprocal and bilateral materials, as those of its prior are"
    )]
    Symmetry {
        /// The method.
        method: &'static str,
    },
    /// The equations of the readings have no solution.
    #[error("{method} has no solution: the covariances of {} are singular", crate::error::count(*readings, "reading"))]
    Singular {
        /// The method.
        method: &'static str,
        /// Number of readings.
        readings: usize,
    },
    /// The readings are not on a grid.
    #[error("{method} needs a grid, the sample set is {sample_set}")]
    NoGrid {
        /// The method.
        method: &'static str,
        /// The sample set of the readings.
        sample_set: String,
    },
    /// A parameter is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

family! {
    ///
    /// ```
    /// use gonio::error::ParameterError;
    /// use gonio::experiment::{Plan, Source};
    /// use gonio::geometry::DirectionPair;
    /// use gonio::reconstruct::{self, Interpolant, Readings, Reconstruct, ReconstructError};
    /// use gonio::registry::{self, Entry, Resolved};
    /// use serde::{Deserialize, Serialize};
    ///
    /// /// Lambert's law: the mean of the readings, times a factor.
    /// #[derive(Debug, Serialize, Deserialize)]
    /// #[serde(deny_unknown_fields)]
    /// struct Flat {
    ///     factor: f64,
    /// }
    ///
    /// struct Constant(Vec<f64>);
    ///
    /// impl Interpolant for Constant {
    ///     fn width(&self) -> usize {
    ///         self.0.len()
    ///     }
    ///     fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
    ///         for (pair, out) in pairs.iter().zip(out.chunks_exact_mut(self.width())) {
    ///             let above = pair.omega_i.cos_theta() > 0.0 && pair.omega_o.cos_theta() > 0.0;
    ///             for (out, mean) in out.iter_mut().zip(&self.0) {
    ///                 *out = if above { *mean } else { 0.0 };
    ///             }
    ///         }
    ///     }
    /// }
    ///
    /// impl Resolved for Flat {
    ///     fn resolved(&self) -> registry::Keys {
    ///         registry::resolved("flat", self)
    ///     }
    /// }
    ///
    /// impl Reconstruct for Flat {
    ///     fn label(&self) -> String {
    ///         "flat".into()
    ///     }
    ///     fn needs_grid(&self) -> bool {
    ///         false
    ///     }
    ///     fn check(&self) -> Result<(), ParameterError> {
    ///         Ok(())
    ///     }
    ///     fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
    ///         let values = (0..r.present.len()).filter_map(|i| r.value(i));
    ///         let mut mean = vec![0.0; r.width];
    ///         for value in values {
    ///             for (mean, v) in mean.iter_mut().zip(value) {
    ///                 *mean += self.factor * v / r.count() as f64;
    ///             }
    ///         }
    ///         Ok(Box::new(Constant(mean)))
    ///     }
    /// }
    ///
    /// reconstruct::join(Entry {
    ///     kind: "flat",
    ///     summary: "the mean of the readings",
    ///     examples: &["factor = 1"],
    ///     read: |table| Ok(Box::new(registry::parse::<Flat>(table)?)),
    /// })?;
    /// let text = "[[material]]\nkind = \"lambert\"\n[[reconstruction]]\nkind = \"flat\"\nfactor = 1";
    /// let plan = Plan::read(&Source::new("example", text))?;
    /// assert_eq!(plan.methods[0].name, "flat");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    "reconstruction": dyn Reconstruct = [
        NearestReading::ENTRY,
        Multilinear::ENTRY,
        Cubic::ENTRY,
        InverseDistance::ENTRY,
        thin_plate::ENTRY,
        sheets::ENTRY,
        kriging::ENTRY,
        components::ENTRY,
        fit::ENTRY,
    ]
}

/// Readings up to which kriging takes a second or so for each of some systems of them.
pub(crate) const KRIGED: usize = 2000;

/// The reconstruction of readings that nothing can be left out of: cubic if they are on a grid, else kriging, or thin-plate if they are
/// more than it is tried on.
pub fn default_for(measurement: &Measurement) -> Arc<dyn Reconstruct> {
    if measurement.schedule.lattice.is_some() {
        Arc::new(Cubic::default())
    } else if measurement.readings() <= KRIGED {
        Arc::new(Kriging::default())
    } else {
        Arc::new(ThinPlate::default())
    }
}

/// Default weight of the first radial axis of an embedding against the second: lobes are narrower
/// along it.
pub const STRETCH: f64 = 1.5;

/// Default weight for readings in sheets: they resolve lobes along the sheet, and what connects two
/// sheets is that lobes change little along the second axis.
pub const STRETCH_OF_SHEETS: f64 = 3.0;

/// The kind, with the keys that are not at their defaults.
fn label(kind: &str, values: Values, noise: bool, coordinates: Option<&Coordinates>) -> String {
    let mut label = kind.to_owned();
    if noise {
        label.push_str("-noise");
    }
    if values == Values::Linear {
        label.push_str("-linear");
    }
    if let Some(coordinates) = coordinates {
        label.push_str(&format!("[{}]", coordinates.label()));
    }
    label
}

/// Refuses no reading, and more than `most`.
fn admit(method: &'static str, readings: usize, most: usize) -> Result<(), ReconstructError> {
    match readings {
        0 => Err(ReconstructError::TooFew {
            method,
            readings,
            needed: 1,
        }),
        _ if readings > most => Err(ReconstructError::TooMany {
            method,
            readings,
            allowed: most,
        }),
        _ => Ok(()),
    }
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
