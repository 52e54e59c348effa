//! Symmetries of a BRDF: changes of a pair that leave it unchanged.

use crate::error::{ParameterError, listed};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Symmetries of a BRDF; a declared symmetry folds the domain of a parametrization,
/// so that no configuration is measured twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Symmetry {
    /// Unchanged when the sample turns about its normal.
    pub isotropic: bool,
    /// Unchanged when light and sensor are exchanged.
    pub reciprocal: bool,
    /// Unchanged by a mirror: through every plane that holds the normal if isotropic, through
    /// the t–n and the b–n plane if not (brushed metal, woven cloth).
    pub bilateral: bool,
}

impl Symmetry {
    /// No symmetry at all.
    pub const NONE: Self = Self {
        isotropic: false,
        reciprocal: false,
        bilateral: false,
    };
    /// Isotropic, reciprocal and bilateral: every isotropic model, and MERL.
    pub const FULL: Self = Self {
        isotropic: true,
        reciprocal: true,
        bilateral: true,
    };
    /// Reciprocal and mirror-symmetric about both tangent axes, but not isotropic.
    pub const ORTHOTROPIC: Self = Self {
        isotropic: false,
        reciprocal: true,
        bilateral: true,
    };

    /// Those of these names.
    ///
    /// # Errors
    /// The first that is no name of one.
    pub fn named<S: AsRef<str>>(
        names: impl IntoIterator<Item = S>,
    ) -> Result<Self, ParameterError> {
        let mut symmetry = Self::NONE;
        for name in names {
            match name.as_ref() {
                "isotropic" => symmetry.isotropic = true,
                "reciprocal" => symmetry.reciprocal = true,
                "bilateral" => symmetry.bilateral = true,
                name => {
                    let allowed = "isotropic, reciprocal, bilateral, or none";
                    return Err(ParameterError::new("symmetry", name, allowed));
                }
            }
        }
        Ok(symmetry)
    }

    /// These symmetries, with isotropy set or cleared.
    #[must_use]
    pub(crate) const fn with_isotropy(self, isotropic: bool) -> Self {
        Self { isotropic, ..self }
    }

    /// Names of those that hold.
    pub fn names(self) -> Vec<&'static str> {
        let all = [
            (self.isotropic, "isotropic"),
            (self.reciprocal, "reciprocal"),
            (self.bilateral, "bilateral"),
        ];
        let held = all.into_iter().filter(|(holds, _)| *holds);
        held.map(|(_, name)| name).collect()
    }

    /// The symmetries that both have.
    pub fn and(self, other: Self) -> Self {
        Self {
            isotropic: self.isotropic && other.isotropic,
            reciprocal: self.reciprocal && other.reciprocal,
            bilateral: self.bilateral && other.bilateral,
        }
    }
}

/// What a material of these symmetries is: `isotropic, reciprocal`.
impl fmt::Display for Symmetry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let anisotropic = (!self.isotropic).then_some("anisotropic");
        f.write_str(&listed(anisotropic.into_iter().chain(self.names())))
    }
}
