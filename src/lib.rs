//! A virtual gonio-reflectometer: a BRDF goes in, a BRDF comes out.
//!
//! `config → Brdf → Schedule → Instrument → Measurement → Reconstruction (again a Brdf) → metrics`
//!
//! Truth and reconstruction are the same trait, so everything downstream works on analytic models,
//! measured tables and reconstructions alike. The whole pipeline, with a material of your own:
//!
//! ```
//! use gonio::brdf::{Brdf, Channels, Presence};
//! use gonio::geometry::{DirectionPair, Symmetry};
//! use gonio::instrument::{Ideal, Instrument};
//! use gonio::metrics::{self, Measure, MetricsSpec};
//! use gonio::moments::{Channel, MomentErrors, MomentsSpec, PeakResolving, Profile};
//! use gonio::parametrization::{Form, HalfDifference, Parametrization};
//! use gonio::reconstruct::{Cubic, Reconstruct};
//! use gonio::schedule::{Grid, SampleSet};
//! use std::sync::Arc;
//!
//! /// A power of the cosine between normal and half vector (Blinn 1977).
//! struct Blinn(f64);
//!
//! impl Brdf for Blinn {
//!     fn channels(&self) -> &Channels {
//!         &Channels::Luminance
//!     }
//!     fn symmetry(&self) -> Symmetry {
//!         Symmetry::FULL
//!     }
//!     fn conserves_energy(&self) -> bool {
//!         false
//!     }
//!     fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
//!         let above = pair.omega_i.cos_theta() > 0.0 && pair.omega_o.cos_theta() > 0.0;
//!         out[0] = if above { pair.half().normalize().z.powf(self.0) } else { 0.0 };
//!         Presence::Present
//!     }
//! }
//!
//! let truth = Blinn(20.0);
//! // What its symmetries leave to be measured, in half/difference coordinates.
//! let form: Arc<dyn Parametrization> = Arc::new(Form::<HalfDifference>::new(truth.symmetry()));
//! // At most 1000 configurations on a regular grid, measured by the ideal instrument.
//! let poses = Arc::new(Grid::default().plan(&form, 1000, 1)?);
//! let measurement = Ideal.measure(&truth, &poses);
//! // A BRDF again, and how far it is from the truth: at pairs of directions, and in its moments.
//! let copy = Cubic::default().reconstruct(&measurement)?;
//! let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default())?;
//! let (f, g) = (metrics::evaluate(&truth, &pairs), metrics::evaluate(&*copy, &pairs));
//! let errors = metrics::compare(&pairs, &f, &g);
//! assert!(measurement.readings() <= 1000 && errors.nrmse < Some(0.01));
//! let (views, integral) = (MomentsSpec { views: 5, ..MomentsSpec::default() }, PeakResolving::default());
//! let of_truth = Profile::new(&truth, Channel::Luminance, &views, &integral, 1)?;
//! let of_copy = Profile::against(&of_truth, &*copy, &views, &integral, 1)?;
//! let [all_views, ..] = MomentErrors::between(&of_truth, &of_copy);
//! assert!(all_views.energy < Some(0.01));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Configs name members of a registry; a program adds its own by [`brdf::join`],
//! [`parametrization::join`], [`schedule::join`], [`reconstruct::join`] (with an example) and
//! [`lighting::join`].
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
//! `cli` (default): the `gonio` command; it has all others but `parquet`, the rows of a run as Parquet. `surfaces`: height fields, also from OpenEXR, PNG and CSV, and rays
//! through them. `pictures`: OpenEXR, PNG, diagrams,
//! HTML reports, and environment maps from files; it has `experiments`. `experiments`: plans, configs in TOML,
//! runs, their statistics and tables, presets of instruments. `stability`: the walk over extreme cases. Without any:
//! models, tables, schedules, instruments, measurements and their files, reconstructions, errors, moments.
//!
//! # Pages
//!
//! [`docs::findings`]: what came out. [`docs::laboratory`]: from a machine to a BRDF, step by step.
//! [`docs::design`]: why the house stands as it does. [`docs::errata`]: what the papers misprint.
//! [`docs::parametrizations`]: which coordinates to sample and to reconstruct in.
//! [`docs::moments`]: how many readings a moment needs.
//! [`docs::light_paths`]: which coordinates separate the scattering orders of light.
//! [`docs::pictures`]: instruments that read a picture at a stop. [`docs::planning`]: which poses to read next. [`docs::stability`]: what becomes of digits at the edges. [`docs::relations`]: moments of a slice and of the picture.
//! [`docs::explore`]: a page that answers a hand. [`docs::sampling`]: light directions drawn in proportion to a BRDF. [`docs::formats`]: files. [`docs::inputs`]: what is refused, doubted and counted. [`docs::cluster`]: many machines at once.
//! [`docs::python`]: NumPy arrays in and out.
//! [`docs::terms`]: one word for one thing. [`docs::changelog`].

// What only the program and its features call is private, and has no caller without them.
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

pub mod acquisition;
pub mod analysis;
#[cfg(feature = "pictures")]
pub mod bench;
pub mod brdf;
#[cfg(feature = "cli")]
pub mod cli;
pub mod docs;
pub mod error;
#[cfg(feature = "experiments")]
pub mod experiment;
pub mod files;
pub mod formats;
pub mod geometry;
pub mod importance;
pub mod instrument;
pub mod light_paths;
pub mod lighting;
pub mod measurement;
pub mod metrics;
pub mod moments;
pub mod numeric;
pub mod parametrization;
pub mod reconstruct;
pub mod registry;
#[cfg(feature = "experiments")]
pub mod report;
pub mod sampling;
pub mod schedule;
#[cfg(feature = "stability")]
pub mod stability;
#[cfg(feature = "experiments")]
pub mod statistics;
pub mod validation;

pub use error::Error;
