//! Symmetries of a BRDF: changes of a pair that leave it unchanged.

use serde::{Deserialize, Serialize};

/// Symmetries of a BRDF; a declared symmetry folds the domain of a parametrization,
/// so that no configuration is measured twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
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
