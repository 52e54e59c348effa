//! Analysis of a BRDF and a parametrization before anything is measured: distances of isolines from
//! axes, symmetries, and the pairs of directions in a box of coordinates.

mod alignment;
mod anisotropy;
pub mod bounces;
mod claims;
mod density;
mod distortion;
mod reduction;
mod shares;
mod subset;
mod symmetry;

pub use alignment::{Alignment, alignment};
pub use anisotropy::{Anisotropy, anisotropy, stretches};
pub use claims::{Claim, Verdict, on_material, on_materials, on_test_functions};
pub use density::{Density, fine_and_plain, is_within};
pub use distortion::{
    Distortion, Gradient, Gradients, LATTICE, PHI_CELLS, SliceDistortion, View, Weight,
    slice_angles,
};
pub use reduction::{Averaging, reduced};
pub use shares::{Cell, Shares};
pub use subset::{ENERGY_PAIRS, Estimate, Image, Member, Needs, Reach, Subset, SubsetMeasure};
pub use symmetry::{
    Deviation, Deviations, SYMMETRY_TOLERANCE, Saving, deviations, savings, symmetry_pairs,
};

use crate::registry::named;
use serde::Serialize;

/// ε (sr⁻¹) of [`Scale::Log`], the floor of the metric `log_relative`.
const FLOOR: f64 = 1e-3;

named! {
    /// Scale on which a function is analysed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Scale {
        /// f itself: for the functions F, S and G of Barla et al. Of a glossy BRDF it sees the peak
        /// alone.
        Value = "value",
        /// ln(f + 1e-3 sr⁻¹): ratios, as the eye and the metric `log_relative` see a BRDF.
        Log = "log",
    }
}

impl Scale {
    /// The analysed number of a value f ≥ 0 (sr⁻¹).
    #[inline]
    pub(crate) fn apply(self, f: f64) -> f64 {
        match self {
            Scale::Value => f,
            Scale::Log => (f + FLOOR).ln(),
        }
    }
}
