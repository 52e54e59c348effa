//! Light by the number of facets that it met, and where in a parametrization it is.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "experiments")]
mod bounces;
#[cfg(feature = "surfaces")]
mod height_fields;
mod smith;

use gonio::brdf::microfacet::{Distribution, FresnelSpec};
use gonio::brdf::{Channels, Part, Roughness, Spectrum};
use gonio::light_paths::{DiffuseSpec, FacetsSpec, Paths, SmithMultiple};

const MIRRORS: FacetsSpec = FacetsSpec::Mirror(FresnelSpec::None);

fn white() -> FacetsSpec {
    FacetsSpec::Diffuse(DiffuseSpec {
        albedo: Spectrum::Grey(1.0),
    })
}

fn paths(bounces: Part, paths: usize) -> Paths {
    Paths {
        bounces,
        paths,
        seed: 1,
    }
}

/// A surface in luminance.
fn surface<D: Distribution>(
    alpha: Roughness,
    facets: &FacetsSpec,
    paths: Paths,
) -> SmithMultiple<D> {
    SmithMultiple::new(alpha, facets, paths, Channels::Luminance).unwrap()
}
