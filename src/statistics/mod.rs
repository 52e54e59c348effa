//! Statistics of errors on the same materials: paired ratios of two choices, intervals, tests,
//! orders of convergence, and the share of the variance that each factor explains.
//!
//! Independent of reflectance: numbers in, numbers out. Errors are compared by their logarithms:
//! materials differ by orders of magnitude, and what a choice changes is a factor.

mod bootstrap;
mod mean;
mod order;
mod paired;
mod variance;
mod wilcoxon;

pub use bootstrap::{Bootstrap, FEWEST};
pub use mean::{
    EXACT, compares, geometric_mean, is_exact, mean_and_error, median, median_ranks, upper_quantile,
};
pub use order::{Order, PooledOrder, error_at, order, pooled_order};
pub use paired::{BAND, Paired, SIGNIFICANCE, Verdict};
pub use variance::{Shares, variance_shares};
pub use wilcoxon::{holm, least_p, signed_rank};
