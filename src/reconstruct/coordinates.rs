//! The coordinates in which scattered readings are interpolated.

use super::ReconstructError;
use crate::error::{ParameterError, in_closed, one_of};
use crate::geometry::Symmetry;
use crate::parametrization::{self, Parametrization, Warps};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A parametrization and its warps, as a config writes them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coordinates {
    /// Name of the parametrization.
    pub kind: String,
    /// Warps by axis symbol.
    #[serde(default, skip_serializing_if = "Warps::is_empty")]
    pub warp: Warps,
}

impl Coordinates {
    /// The form of this parametrization for a BRDF with these symmetries.
    ///
    /// # Errors
    /// If there is no such parametrization, axis or warp.
    pub(crate) fn form(
        &self,
        symmetry: Symmetry,
    ) -> Result<Arc<dyn Parametrization>, ParameterError> {
        let Some(entry) = parametrization::find(&self.kind) else {
            let names = parametrization::all();
            let allowed = one_of(&self.kind, names.iter().map(|e| e.kind));
            return Err(ParameterError::new("coordinates.kind", &self.kind, allowed));
        };
        entry.warped(symmetry, &self.warp).map_err(|e| {
            let key = format!("coordinates.warp.{}", e.axis);
            let value = self
                .warp
                .get(&e.axis)
                .map_or_else(String::new, |w| w.name());
            ParameterError::new(key, value, e.problem.to_string())
        })
    }

    /// `kind` or `kind+axis:warp`, for labels.
    pub(crate) fn label(&self) -> String {
        let mut label = self.kind.clone();
        for (axis, warp) in &self.warp {
            label.push_str(&format!("+{axis}:{}", warp.name()));
        }
        label
    }
}

/// Coordinates that default to those of the schedule, and the shape of their embedding.
pub(super) struct ReconstructionCoordinates<'a> {
    /// Coordinates to interpolate in; `None`: those of the schedule.
    pub coordinates: Option<&'a Coordinates>,
    /// Weight of the first radial axis against the second, if it is not the default.
    pub stretch: Option<f64>,
}

impl<'a> ReconstructionCoordinates<'a> {
    /// Those of a method's keys.
    pub(crate) fn new(coordinates: &'a Option<Coordinates>, stretch: Option<f64>) -> Self {
        Self {
            coordinates: coordinates.as_ref(),
            stretch,
        }
    }

    /// Checks what can be checked without a schedule.
    pub fn check(&self) -> Result<(), ParameterError> {
        // Smaller or larger, neighbours collapse into clusters or sheets thinner than rounding.
        if let Some(stretch) = self.stretch {
            in_closed("stretch", stretch, 1e-3, 1e3)?;
        }
        if let Some(coordinates) = self.coordinates {
            coordinates.form(Symmetry::FULL)?;
        }
        Ok(())
    }

    /// The parametrization to interpolate in.
    pub(crate) fn resolve(
        &self,
        schedule: &Arc<dyn Parametrization>,
    ) -> Result<Arc<dyn Parametrization>, ReconstructError> {
        match self.coordinates {
            None => Ok(Arc::clone(schedule)),
            Some(coordinates) => Ok(coordinates.form(schedule.symmetry())?),
        }
    }
}
