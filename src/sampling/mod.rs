//! Points in the unit cube, and warps of them onto the hemisphere.
//!
//! Every point depends on (seed, index) only, never on what was drawn before it, so that any
//! number of threads gives the same set.

mod hemisphere;
mod points;
mod quadrature;

pub use hemisphere::{
    cosine_hemisphere, cosine_hemisphere_pdf, ggx_half_vector, ggx_half_vector_pdf,
};
pub use points::{Random, RandomStream, Sobol};
pub use quadrature::{GAUSS_KRONROD, gauss_legendre};
pub(crate) use quadrature::{cut, halve_worst, mirrored};

/// The part of a turn that is least near to any fraction of it, rad.
pub(crate) const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
