//! Pictures of materials, reconstructions and parametrizations.

#[cfg(feature = "exr")]
mod compare;
#[cfg(all(feature = "exr", feature = "plots"))]
mod contours;
#[cfg(feature = "exr")]
mod distribution;
#[cfg(all(feature = "exr", feature = "plots"))]
mod dome;
#[cfg(all(feature = "exr", feature = "plots"))]
mod functions;
#[cfg(all(feature = "exr", feature = "plots"))]
mod hemispheres;
#[cfg(all(feature = "exr", feature = "plots"))]
mod plot;
#[cfg(feature = "exr")]
mod render;
#[cfg(all(feature = "exr", feature = "plots"))]
mod slices;

#[cfg(feature = "exr")]
pub use compare::Comparison;
#[cfg(all(feature = "exr", feature = "plots"))]
pub use functions::test_functions_svg;
#[cfg(all(feature = "exr", feature = "plots"))]
pub use hemispheres::hemispheres_svg;
#[cfg(feature = "exr")]
pub use render::{render_sphere, render_spheres};
#[cfg(all(feature = "exr", feature = "plots"))]
pub use slices::BrdfSlices;
