//! Laws of the library's modules, one module a room, through the public interface.

#[path = "../common/mod.rs"]
mod common;

mod acquisition;
mod analysis;
#[cfg(feature = "pictures")]
mod bench;
mod brdf;
#[cfg(feature = "experiments")]
mod experiment;
mod files;
mod geometry;
mod instrument;
mod light_paths;
mod metrics;
mod moments;
mod numeric;
mod parametrization;
mod reconstruct;
#[cfg(feature = "experiments")]
mod report;
mod sampling;
mod schedule;
#[cfg(feature = "experiments")]
mod statistics;
