//! A parametrization as configs name it: its kind, and warps of its axes.

use super::{Axis, Parametrization, WarpError, Warped, Warps};
use crate::geometry::Symmetry;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// A parametrization that has a form for BRDFs of any symmetry.
pub trait ParametrizationKind: Parametrization + Sized + 'static {
    /// Name in configs and result files.
    const KIND: &'static str;

    /// The form for BRDFs with these symmetries.
    fn with_symmetry(symmetry: Symmetry) -> Self;
}

/// Makes the form for some symmetries with warps.
type Build = fn(Symmetry, &Warps) -> Result<Arc<dyn Parametrization>, WarpError>;

/// A parametrization and its warps; the symmetries of a material make a form of it.
#[derive(Clone)]
pub struct ParametrizationSpec {
    /// Name in configs and result files.
    pub kind: &'static str,
    /// The warps.
    pub warps: Warps,
    build: Build,
}

impl fmt::Debug for ParametrizationSpec {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {:?}", self.kind, self.warps)
    }
}

/// The keys of a parametrization in a config.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default, skip_serializing_if = "Warps::is_empty")]
    warp: Warps,
}

impl ParametrizationSpec {
    /// The parametrization of a type, with warps by axis symbol.
    ///
    /// ```
    /// use gonio::geometry::Symmetry;
    /// use gonio::parametrization::{Form, Hybrid, ParametrizationSpec, Warps};
    /// let hybrid = ParametrizationSpec::new::<Form<Hybrid>>(Warps::new());
    /// assert_eq!(hybrid.form(Symmetry::FULL).unwrap().axes()[0].symbol, "h_bar");
    /// ```
    pub fn new<P: ParametrizationKind>(warps: Warps) -> Self {
        Self {
            kind: P::KIND,
            warps,
            build: |symmetry, warps| {
                let form = P::with_symmetry(symmetry);
                if warps.is_empty() {
                    Ok(Arc::new(form))
                } else {
                    Ok(Arc::new(Warped::new(form, warps)?))
                }
            },
        }
    }

    /// The kind and every key with its value.
    pub fn resolved(&self) -> registry::Keys {
        let warp = self.warps.clone();
        registry::resolved(self.kind, &Keys { warp })
    }

    /// The form for BRDFs with these symmetries.
    ///
    /// # Errors
    /// If a warp is on no axis of this form, or its axis cannot have it.
    pub fn form(&self, symmetry: Symmetry) -> Result<Arc<dyn Parametrization>, WarpError> {
        (self.build)(symmetry, &self.warps)
    }
}

/// The registry entry of a parametrization.
pub const fn entry<P: ParametrizationKind>(
    summary: &'static str,
    examples: &'static [&'static str],
) -> Entry<ParametrizationSpec> {
    Entry {
        kind: P::KIND,
        summary,
        examples,
        read: |table| {
            let Keys { warp } = registry::parse(table)?;
            Ok(Box::new(ParametrizationSpec::new::<P>(warp)))
        },
    }
}

impl Entry<ParametrizationSpec> {
    /// The plain form of this parametrization for a BRDF with these symmetries.
    pub fn form(&self, symmetry: Symmetry) -> Arc<dyn Parametrization> {
        // Without warps there is nothing that could be refused.
        match self.warped(symmetry, &Warps::new()) {
            Ok(form) => form,
            Err(e) => unreachable!("no warp was asked for: {e}"),
        }
    }

    /// The form with warps on the named axes.
    ///
    /// # Errors
    /// If a name is no axis of this form, or its axis cannot have that warp.
    pub fn warped(
        &self,
        symmetry: Symmetry,
        warps: &Warps,
    ) -> Result<Arc<dyn Parametrization>, WarpError> {
        match registry::read_text(self, "") {
            Ok(spec) => (spec.build)(symmetry, warps),
            Err(e) => unreachable!("every key has a default: {e}"),
        }
    }

    /// The axes of the plain form.
    pub fn axes(&self, symmetry: Symmetry) -> Vec<Axis> {
        self.form(symmetry).axes().to_vec()
    }
}
