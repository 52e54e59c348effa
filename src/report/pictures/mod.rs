//! Pictures of materials, reconstructions and parametrizations.

pub(super) mod bounces;
mod compare;
mod contours;
mod distribution;
mod dome;
mod errors;
mod functions;
mod hemispheres;
mod lobe;
mod plates;
pub(super) mod plot;
pub(super) mod png;
mod render;
pub(super) mod slice;
mod slices;
pub(super) mod sphere;
mod stops;
mod uncertainty;

pub use compare::Comparison;
pub(super) use compare::{LEAST, signed};
pub use errors::ErrorMap;
pub use functions::test_functions_svg;
pub use hemispheres::hemispheres_svg;
pub use lobe::{FlatSlice, Radius, slice_svg};
pub use render::{SpherePair, render_sphere, render_spheres};
pub use slice::{RESOLUTION, THETA_O_DEG, write_slice};
pub use slices::BrdfSlices;
pub use sphere::{FilterEllipse, SphereImage, sphere_svg};
pub use stops::stops_svg;
pub(crate) use uncertainty::{Relative, uncertainty_svg};
