//! Importance sampling: light directions for a view, drawn in proportion to f_r cos θ_i of any BRDF.
//!
//! [`TabulatedSampler`] tabulates the density over a [`LightChart`] of the light direction at a grid of views, the chart being an argument of one
//! construction (conditional tables as in Lawrence, Rusinkiewicz and Ramamoorthi 2004, and in Dupuy and Jakob 2018). [`compare`] finds
//! which chart does it best: by the relative variance of f_r cos θ_i over the density, by quadrature. See [`docs::sampling`](crate::docs::sampling).

mod chart;
mod comparison;
mod sampler;
mod table;
#[cfg(test)]
mod tests;
mod variance;

pub use chart::{Axes, LightChart, RadialWarp};
pub use comparison::{CELLS, COSINES, OtherScore, SamplerScores, TableScore, compare};
pub use sampler::{Conditional, SamplerSettings, TabulatedSampler};
pub use table::InCells;

pub use variance::{VIEWS_DEG, relative_variance};
