//! A virtual gonio-reflectometer.

pub mod brdf;
#[cfg(feature = "cli")]
pub mod cli;
pub mod error;
pub mod experiment;
pub mod files;
pub mod geometry;
pub mod instrument;
pub mod measurement;
pub mod metrics;
pub mod numeric;
pub mod parametrization;
pub mod reconstruct;
pub mod registry;
pub mod report;
pub mod sampling;
pub mod schedule;

pub use error::Error;
