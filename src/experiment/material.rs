//! Materials of a plan.

use crate::analysis::Alignment;
use crate::brdf::{BrdfSpec, Channels, Favours};
use crate::geometry::Symmetry;

/// A material to be measured.
#[derive(Debug)]
pub struct Material {
    /// Its name in results, unique in its plan.
    pub name: String,
    /// Specification it is built from.
    pub spec: Box<dyn BrdfSpec>,
    /// Symmetries that its schedules use to fold the coordinates.
    pub symmetry: Symmetry,
    /// What is peculiar about its files, a sentence each.
    pub remarks: Vec<String>,
}

impl Material {
    /// Its kind, which it shares with the materials it is compared with.
    pub(crate) fn group(&self) -> String {
        let resolved = self.spec.resolved();
        let kind = resolved.get("kind").and_then(toml::Value::as_str);
        kind.unwrap_or_default().to_owned()
    }

    /// True if it has values in R, G, B.
    pub(crate) fn is_coloured(&self) -> bool {
        self.spec.check(&Channels::Rgb).is_ok()
    }

    /// Truth class of its rows: the coordinates it favours, by its alignment if that is known. Anisotropic materials are one class.
    pub(crate) fn truth(&self, alignment: Option<&Alignment>) -> &'static str {
        let declared = self.spec.favours();
        let favours = alignment.map_or(declared, |a| declared.measured(a.q, a.standard_error));
        if self.symmetry.isotropic || favours == Favours::SphericalTable {
            favours.name()
        } else {
            "anisotropic"
        }
    }
}
