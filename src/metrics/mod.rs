//! Weighted error measures between two BRDFs, and directional albedo.
//!
//! f truth, g reconstruction, both in luminance (sr⁻¹, without the cosine), cos = cos θ_i. The
//! metrics are averages over test pairs, whose distribution is the *measure*. A [`TestSet`] has the pairs of a run,
//! with weights that lead back to each measure and with standard errors: its beginning is the same for every
//! reconstruction, so that two are compared on the same questions, and it goes on until what is asked is known.
//! [`test_pairs`] are pairs without weights, for whom a list is enough.
//!
//! ```
//! use gonio::brdf::{Channels, Lambert, Spectrum};
//! use gonio::metrics::{self, Measure, MetricsSpec};
//! let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default()).unwrap();
//! let [truth, darker] = [0.8, 0.6].map(|albedo| {
//!     let brdf = Lambert::new(Spectrum::Grey(albedo), Channels::Luminance);
//!     metrics::evaluate(&brdf, &pairs)
//! });
//! let errors = metrics::compare(&pairs, &truth, &darker);
//! assert!((errors.nrmse.unwrap() - 0.25).abs() < 1e-12);
//! ```

mod albedo;
mod errors;
mod expected;
mod histogram;
mod of_truth;
mod pairs;
mod part;
mod quantity;
mod sum;
mod tally;
mod terms;
mod test_set;
mod uncovered;
mod within;

pub use albedo::AlbedoProbe;
pub use errors::Errors;
pub use expected::Expected;
pub(crate) use of_truth::TruthErrors;
pub use pairs::{Measure, MetricsSpec, test_pairs};
pub(crate) use quantity::quantities;
pub use quantity::{Judged, Quantity};
pub(crate) use tally::jackknife;
pub use tally::{Replicate, Tally, compare, compare_weighted};
pub use test_set::{Compared, Level, REPLICATES, TestSet};
pub use uncovered::Uncovered;
pub use within::{WITHIN, share_within};

use crate::brdf::{Brdf, Presence};
use crate::geometry::DirectionPair;
use rayon::prelude::*;

/// Pairs a task evaluates in one batch: far above the cost of a task, and their 80 kB stay in a core's own cache.
const CHUNK: usize = 1024;

/// Luminance of a BRDF at a list of pairs, with the pairs where it has no data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// f_r without the cosine, sr⁻¹, one per pair; 0 and meaningless where missing.
    pub luminance: Vec<f64>,
    /// One flag per pair, true without data; empty if nothing is missing.
    pub missing: Vec<bool>,
}

impl Values {
    /// The value at pair `index`; `None` if it is missing, or not finite and ≥ 0 as [`Brdf`] promises.
    #[inline]
    pub fn get(&self, index: usize) -> Option<f64> {
        let value = self.luminance[index];
        let present = !self.missing.get(index).copied().unwrap_or(false);
        (present && value >= 0.0 && value.is_finite()).then_some(value)
    }

    /// Appends the values at further pairs.
    pub fn append(&mut self, further: Values) {
        let (before, after) = (self.luminance.len(), further.luminance.len());
        if !(self.missing.is_empty() && further.missing.is_empty()) {
            self.missing.resize(before, false);
            self.missing.extend(further.missing);
            self.missing.resize(before + after, false);
        }
        self.luminance.extend(further.luminance);
    }
}

impl From<Vec<f64>> for Values {
    /// Values of which none is missing.
    fn from(luminance: Vec<f64>) -> Self {
        Self {
            luminance,
            missing: Vec::new(),
        }
    }
}

/// Evaluates in parallel; the result does not depend on the number of threads.
pub fn evaluate(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Values {
    let channels = brdf.channels();
    let n = channels.count();
    let mut luminance = vec![0.0; pairs.len()];
    let mut missing = vec![false; pairs.len()];
    // Scratch of one task, reused for its next chunks; a luminance scene writes in place.
    let scratch = || {
        let colours = if n == 1 { 0 } else { n * CHUNK };
        ([Presence::Missing; CHUNK], vec![0.0; colours])
    };
    pairs
        .par_chunks(CHUNK)
        .zip(luminance.par_chunks_mut(CHUNK))
        .zip(missing.par_chunks_mut(CHUNK))
        .for_each_init(scratch, |(presence, colours), ((pairs, out), missing)| {
            let presence = &mut presence[..pairs.len()];
            if n == 1 {
                brdf.eval_batch(pairs, out, presence);
            } else {
                let colours = &mut colours[..n * pairs.len()];
                brdf.eval_batch(pairs, colours, presence);
                for (out, colour) in out.iter_mut().zip(colours.chunks_exact(n)) {
                    *out = channels.luminance(colour);
                }
            }
            for ((out, missing), presence) in out.iter_mut().zip(missing).zip(presence) {
                *missing = *presence == Presence::Missing;
                if *missing {
                    // The reused scratch still holds the colours of an earlier chunk here.
                    *out = 0.0;
                }
            }
        });
    if !missing.contains(&true) {
        missing = Vec::new();
    }
    Values { luminance, missing }
}
