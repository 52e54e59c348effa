//! Pictures of materials, reconstructions and parametrizations.

#[cfg(feature = "exr")]
mod distribution;
#[cfg(feature = "exr")]
mod render;

#[cfg(feature = "exr")]
pub use render::render_sphere;
