//! Moments of BRDF slices up to order 4 (Zubiaga et al. 2015), their profiles over the view
//! elevation, fits of these, and relations to reflected radiance.
//!
//! A [`Slice`] is a BRDF at fixed view in the chart of
//! [`view_centered`](crate::parametrization::view_centered). An [`Estimator`] integrates its
//! [`Moments`]; a [`Profile`] does so for a dense set of views. Truth and reconstruction are both
//! BRDFs: the difference of their profiles is the moment error of an acquisition.
//!
//! ```
//! use gonio::brdf::{Channels, Lambert, Spectrum};
//! use gonio::moments::{Channel, Estimator, Order, PeakResolving, Slice};
//! use std::f64::consts::PI;
//! let lambert = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
//! let slice = Slice::new(&lambert, Channel::Luminance, 1.0).unwrap();
//! let moments = PeakResolving::default().estimate(&slice, Order::MAX, 1).moments;
//! // ρ = a/π has energy a π, variance π²/12 and excess kurtosis −1.2.
//! assert!((moments.energy().unwrap() - 0.5 * PI).abs() < 1e-12);
//! assert!((moments.covariance().unwrap()[0] - PI * PI / 12.0).abs() < 1e-12);
//! assert!((moments.value(4, 0).unwrap() + 1.2).abs() < 1e-12);
//! ```

mod clamping;
mod component;
mod cubature;
mod curve;
mod errors;
mod estimator;
mod fit;
mod gaussian;
mod mesh;
mod noise;
mod peak;
mod profile;
pub mod relations;
mod sampled;
mod slice;
mod tally;

pub use clamping::{Clamping, HorizonCopy};
pub use component::{Component, Estimate, Moments, Order};
pub(crate) use errors::Influences;
pub use errors::{MomentErrors, VIEW_BANDS};
pub use estimator::{Estimator, SliceMoments, Unresolved, all, read};
pub use fit::*;
pub use gaussian::TruncatedGaussian;
pub use peak::PeakResolving;
pub use profile::{MomentsSpec, Profile, Split, lambertian_part};
pub use sampled::{MonteCarlo, ScrambledSobol};
pub use slice::{Batch, Channel, Kind, Slice};
pub use tally::Tally;
