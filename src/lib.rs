//! A virtual gonio-reflectometer: a BRDF goes in, a BRDF comes out.
//!
//! `config → Brdf → Schedule → Instrument → Measurement → Reconstruction (again a Brdf) → metrics`
//!
//! Truth and reconstruction are the same trait, so everything downstream works on analytic models,
//! measured tables and reconstructions alike. The whole pipeline in a dozen lines:
//!
//! ```
//! use gonio::brdf::{self, Channels};
//! use gonio::instrument::{Ideal, Instrument};
//! use gonio::metrics::{self, Measure, MetricsSpec};
//! use gonio::{parametrization, reconstruct, registry, schedule};
//! use std::sync::Arc;
//!
//! fn find<T: ?Sized>(family: Vec<registry::Entry<T>>, kind: &str, keys: &str) -> Box<T> {
//!     let entry = family.iter().find(|e| e.kind == kind).expect(kind);
//!     registry::read_text(entry, keys).expect(keys)
//! }
//!
//! // A material, and what its symmetries leave to be measured in half/difference coordinates.
//! let truth = find(brdf::all(), "ggx", "alpha = 0.5").build(Channels::Luminance)?;
//! let coordinates = parametrization::find("half-difference").unwrap().form(truth.symmetry());
//! // At most 1000 configurations on a regular grid, measured by the ideal instrument.
//! let grid = find(schedule::all(), "grid", "");
//! let poses = Arc::new(grid.plan(&coordinates, 1000, 1)?);
//! let measurement = Ideal.measure(&*truth, &poses);
//! // A BRDF again, and how far it is from the truth.
//! let copy = find(reconstruct::all(), "cubic", "").reconstruct(&measurement)?;
//! let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default())?;
//! let (f, g) = (metrics::evaluate(&*truth, &pairs), metrics::evaluate(&*copy, &pairs));
//! let errors = metrics::compare(&pairs, &f, &g);
//! assert!(measurement.readings() <= 1000 && errors.log_relative < Some(0.01));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Glossary
//!
//! | name | meaning |
//! |---|---|
//! | `omega_i`, `omega_o` | directions towards light and sensor, unit, away from the surface |
//! | `h`, `k` | (omega_i ± omega_o)/2, *not* normalised: \|h\| = cos theta_d, \|k\| = sin theta_d |
//! | `h_bar`, `k_bar` | their projections on the tangent plane |
//! | `f_r` | BRDF in sr⁻¹, **without** the cosine |
//! | pose | one configuration of the two arms, a light and a sensor direction |
//! | itinerary | when an instrument visits which pose, and which ones it cannot take |
//! | type A, type B | standard uncertainty of what scatters between readings, and of what they share |
//! | slice | a BRDF at fixed view, in the chart of [`parametrization::view_centered`] |
//! | energy | zeroth moment of a slice, without the cosine: no albedo |
//! | budget | the largest number of distinct physical configurations a schedule may have; given, or found for readings or minutes |
//! | measure | how the pairs an error is averaged over are distributed |
//!
//! Radians inside; degrees only in config keys and file columns that end in `_deg`.
//!
//! # Features
//!
//! `cli` (default): the `gonio` command; it has `pictures`. `pictures`: OpenEXR, PNG, diagrams, reports, and
//! environment maps from files. Without them the library needs neither an argument parser nor an image format.
//!
//! # Pages
//!
//! [`docs::design`]: why the house stands as it does. [`docs::errata`]: what the papers misprint.
//! [`docs::parametrizations`]: which coordinates to sample and to reconstruct in.
//! [`docs::relations`]: moments of a slice and of the picture. [`docs::changelog`].

pub mod analysis;
pub mod brdf;
#[cfg(feature = "cli")]
pub mod cli;
pub mod docs;
pub mod error;
pub mod experiment;
pub mod files;
pub mod geometry;
pub mod instrument;
pub mod lighting;
pub mod measurement;
pub mod metrics;
pub mod moments;
pub mod numeric;
pub mod parametrization;
pub mod reconstruct;
pub mod registry;
pub mod report;
pub mod sampling;
pub mod schedule;
pub mod statistics;

pub use error::Error;
