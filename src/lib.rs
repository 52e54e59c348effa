//! A virtual gonio-reflectometer.

pub mod brdf;
pub mod error;
pub mod geometry;
pub mod numeric;
pub mod parametrization;
pub mod registry;
pub mod sampling;

pub use error::Error;
