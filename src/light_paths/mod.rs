//! Materials whose light paths are followed from facet to facet.
//!
//! A facet that was hit may send light to another one. Models of single reflection leave that out; here it is counted, apart:
//!
//! f_r = f₁ + f₂ + f₃₊,   f_n the light of scattering order n.
//!
//! Values are means over random paths and have a standard error ([`Split`](crate::brdf::Split)). A pair has the same paths in every run and on
//! every number of threads, and so has its mirror image, its reverse, and, of isotropic facets, the pair as the sample is
//! turned.

mod accumulate;
mod canonical;
mod facets;
#[cfg(feature = "surfaces")]
mod gathered;
#[cfg(feature = "surfaces")]
mod micro;
#[cfg(feature = "surfaces")]
mod normals;
mod smith;
#[cfg(feature = "surfaces")]
pub mod surface;
#[cfg(feature = "surfaces")]
mod trace;
#[cfg(feature = "surfaces")]
mod transport;
mod walk;

pub use facets::{DiffuseSpec, FacetsSpec, all as facets, read as read_facets};
#[cfg(feature = "surfaces")]
pub use micro::{ENTRY as MICRO_SURFACE, MicroSurface, MicroSurfaceSpec};
pub use smith::{ENTRY as SMITH_MULTIPLE, Paths, SmithMultiple};
#[cfg(feature = "surfaces")]
pub use trace::{Exit, Hit, Ray, Tracer};
#[cfg(feature = "surfaces")]
pub use transport::{Energies, Transport, TransportSpec};
