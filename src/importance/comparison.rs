//! Which chart draws best.

use super::chart::Axes;
use super::variance::{HALF_VECTOR, Nodes, VIEWS_DEG, view};
use super::{InCells, SamplerSettings, TabulatedSampler};
use crate::brdf::microfacet::{FresnelSpec, Ggx, Microfacet};
use crate::brdf::{Brdf, Channels, Roughness, SampleBrdf};
use crate::error::ParameterError;
use crate::sampling::{Random, cosine_hemisphere_pdf};
use rayon::prelude::*;
use std::time::Instant;

/// Cells along either axis of the tables that are compared.
pub const CELLS: [usize; 4] = [8, 16, 32, 64];

/// Shares of the cosine that are compared.
pub const COSINES: [f64; 2] = [0.0, 0.01];

/// Draws that are timed.
const DRAWS: u64 = 1 << 12;

/// Roughnesses of GGX that are tried, even in their logarithm from .001 to 1, and its shares.
const ALPHAS: usize = 25;
const GGX_SHARES: [f64; 9] = [0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 0.99];

/// A sampler that was tried, with what it is good for.
#[derive(Clone, Debug, PartialEq)]
pub struct TableScore {
    /// What was tried.
    pub settings: SamplerSettings,
    /// Relative variance of f_r cos θ_i over the density, the mean over [`VIEWS_DEG`]; infinite where the density is 0 and f_r is not.
    pub relative_variance: f64,
    /// Bytes of its tables, over the whole circle of azimuths.
    pub bytes: usize,
    /// Seconds to make them.
    pub seconds: f64,
    /// Nanoseconds a draw with its density, on one thread.
    pub nanoseconds: f64,
}

/// A density that is no table of the BRDF.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherScore {
    /// Its name.
    pub name: String,
    /// As in [`TableScore`].
    pub relative_variance: f64,
    /// Roughness, of GGX.
    pub alpha: Option<f64>,
}

/// All that was tried of one BRDF.
#[derive(Clone, Debug, PartialEq)]
pub struct SamplerScores {
    /// Number of views of [`VIEWS_DEG`] at which something is reflected: means are over them.
    pub views: usize,
    /// By chart, course in cells, cells and share of the cosine.
    pub tried: Vec<TableScore>,
    /// The cosine, the sampler of the model itself, and the mixture of GGX and cosine of least variance.
    pub others: Vec<OtherScore>,
}

/// Tries every chart with tables at some views. `None` of a BRDF that reflects nothing at any of [`VIEWS_DEG`], or has no data there.
///
/// # Errors
/// See [`SamplerSettings::check`].
pub fn compare(brdf: &dyn Brdf, views: usize) -> Result<Option<SamplerScores>, ParameterError> {
    let of_half_vectors = nodes(brdf, &HALF_VECTOR);
    let reflects = |nodes: &&Nodes| nodes.albedo() > 0.0;
    let views_with_light = of_half_vectors.iter().filter(reflects).count();
    if views_with_light == 0 {
        return Ok(None);
    }
    let mut tried = Vec::new();
    for axes in Axes::all() {
        let nodes = nodes(brdf, &axes);
        for in_cells in InCells::ALL {
            for cells in CELLS {
                let mut settings = SamplerSettings {
                    axes,
                    in_cells,
                    cells: [cells; 2],
                    views,
                    cosine: 0.0,
                    ..SamplerSettings::default()
                };
                let start = Instant::now();
                let mut sampler = TabulatedSampler::new(brdf, settings)?;
                let (seconds, bytes) = (start.elapsed().as_secs_f64(), sampler.bytes());
                let nanoseconds = nanoseconds_a_draw(&sampler);
                for cosine in COSINES {
                    settings.cosine = cosine;
                    sampler = sampler.with_share_of_cosine(cosine);
                    let Some(relative_variance) = mean(&nodes, |nodes| nodes.of(&sampler)) else {
                        return Ok(None);
                    };
                    tried.push(TableScore {
                        settings,
                        relative_variance,
                        bytes,
                        seconds,
                        nanoseconds,
                    });
                }
            }
        }
    }
    Ok(Some(SamplerScores {
        views: views_with_light,
        tried,
        others: others(brdf, &of_half_vectors),
    }))
}

/// The quadratures of all views in a chart.
fn nodes(brdf: &dyn Brdf, axes: &Axes) -> Vec<Nodes> {
    let views = (0..VIEWS_DEG.len()).into_par_iter();
    views.map(|k| Nodes::new(brdf, axes, view(k))).collect()
}

/// The mean over the views at which something is reflected; `None` if there is none.
fn mean(nodes: &[Nodes], of: impl Fn(&Nodes) -> Option<f64> + Send + Sync) -> Option<f64> {
    let all: Vec<_> = nodes.par_iter().map(of).collect();
    mean_of(all)
}

fn mean_of(all: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let all: Vec<f64> = all.into_iter().flatten().collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

fn nanoseconds_a_draw(sampler: &TabulatedSampler) -> f64 {
    let random = Random::new(1);
    let start = Instant::now();
    let sum: f64 = (0..DRAWS)
        .filter_map(|i| sampler.draw(view(i as usize % VIEWS_DEG.len()), random.point(i)))
        .map(|(_, density)| density)
        .sum();
    std::hint::black_box(sum);
    start.elapsed().as_secs_f64() * 1e9 / DRAWS as f64
}

/// Densities that are no tables.
fn others(brdf: &dyn Brdf, nodes: &[Nodes]) -> Vec<OtherScore> {
    let mut others = Vec::new();
    let mut add = |name: String, variance: Option<f64>| {
        others.extend(variance.map(|relative_variance| OtherScore {
            name,
            relative_variance,
            alpha: None,
        }));
    };
    let cosine = |nodes: &Nodes, k: usize| cosine_hemisphere_pdf(nodes.pairs()[k].omega_i);
    add(
        "cosine".into(),
        mean(nodes, |n| n.relative_variance(true, |k| cosine(n, k))),
    );
    if let Some(own) = brdf.as_sample() {
        let variance = mean(nodes, |n| {
            n.relative_variance(false, |k| own.pdf(&n.pairs()[k]))
        });
        add("its own".into(), variance);
    }
    let best = (0..ALPHAS).into_par_iter().filter_map(|k| {
        let alpha = 10f64.powf(-3.0 * (1.0 - k as f64 / (ALPHAS - 1) as f64));
        let roughness = Roughness::Isotropic(alpha);
        let ggx = Microfacet::<Ggx>::new(roughness, &FresnelSpec::default(), Channels::Luminance);
        let density = |n: &Nodes| n.pairs().iter().map(|pair| ggx.pdf(pair)).collect();
        let densities: Vec<Vec<f64>> = nodes.iter().map(density).collect();
        let of = |share: f64| {
            let each = nodes.iter().zip(&densities).map(|(n, of_ggx)| {
                n.relative_variance(false, |k| share * of_ggx[k] + (1.0 - share) * cosine(n, k))
            });
            Some((mean_of(each)?, alpha, share))
        };
        let all = GGX_SHARES.iter().filter_map(|share| of(*share));
        all.min_by(|a, b| a.0.total_cmp(&b.0))
    });
    let least = best.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    others.extend(least.map(|(relative_variance, alpha, _)| OtherScore {
        name: "GGX and cosine".into(),
        relative_variance,
        alpha: Some(alpha),
    }));
    others
}
