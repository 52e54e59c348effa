//! Laws of the library's modules, one module a room, through the public interface.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "experiments")]
mod analysis;
#[cfg(feature = "pictures")]
mod bench;
#[cfg(feature = "experiments")]
mod brdf;
#[cfg(feature = "experiments")]
mod experiment;
mod files;
mod geometry;
#[cfg(feature = "experiments")]
mod instrument;
#[cfg(all(feature = "experiments", feature = "surfaces"))]
mod light_paths;
mod metrics;
#[cfg(feature = "experiments")]
mod moments;
mod numeric;
#[cfg(feature = "experiments")]
mod parametrization;
#[cfg(feature = "experiments")]
mod report;
mod sampling;
#[cfg(feature = "experiments")]
mod schedule;
#[cfg(feature = "experiments")]
mod statistics;
