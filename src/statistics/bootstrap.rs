//! Bootstrap intervals of means over materials.

use super::mean::mean;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// With fewer values there is no interval and no test: five signs are equal by chance once in sixteen, above 5 %.
pub const FEWEST: usize = 6;

/// Sets drawn. The ends of an interval then lie within 2 % of its width of those of infinitely many.
const RESAMPLES: usize = 10_000;

/// Sets that are summed side by side; divides [`RESAMPLES`].
const TOGETHER: usize = 8;

/// Materials drawn with replacement: for every list of values of one length the same draws, made when first asked for and kept.
#[derive(Debug)]
pub struct Bootstrap {
    seed: u64,
    /// By number of values: 10 000 sets one after the other.
    drawn: Mutex<BTreeMap<usize, Arc<[u32]>>>,
}

impl Bootstrap {
    /// The draws of a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            drawn: Mutex::new(BTreeMap::new()),
        }
    }

    /// A 95 % bootstrap interval of the mean of a population of which these values are a sample.
    ///
    /// Percentiles of the means of 10 000 sets drawn with replacement, taken further out: a resampled mean spreads
    /// sqrt((n − 1)/n) too little, and has the spread of n values only, so that 95 % of normal values become 93 % at n = 24
    /// and 87 % at n = 6. The tail is Φ(−sqrt(n/(n − 1)) t), t the 97.5 % point of Student's t with n − 1 degrees of freedom
    /// (Hesterberg, "What teachers should know about the bootstrap", Am. Stat. 69, 2015). BCa does not mend this, and loses
    /// where tails are heavy, as those of log ratios are.
    ///
    /// Equal values in equal order and an equal seed give equal bits. `None` with fewer
    /// than [`FEWEST`] values or where one is not finite.
    pub fn mean_interval(&self, values: &[f64]) -> Option<[f64; 2]> {
        if values.len() < FEWEST || !values.iter().all(|v| v.is_finite()) {
            return None;
        }
        let centre = mean(values)?;
        let deviations: Vec<f64> = values.iter().map(|v| v - centre).collect();
        let n = values.len();
        let drawn = self.drawn(n);
        let mut means = Vec::with_capacity(RESAMPLES);
        // Several at once: a single sum waits for each of its additions.
        for sets in drawn.chunks_exact(TOGETHER * n) {
            let mut sums = [0.0; TOGETHER];
            for k in 0..n {
                for (j, sum) in sums.iter_mut().enumerate() {
                    *sum += deviations[sets[j * n + k] as usize];
                }
            }
            means.extend(sums.map(|s| s / n as f64));
        }
        let tail = tail(n)?;
        Some([tail, 1.0 - tail].map(|at| centre + quantile(&mut means, at)))
    }

    /// The draws for `n` values: positions in 0..n, 10 000 sets one after the other.
    fn drawn(&self, n: usize) -> Arc<[u32]> {
        // A thread that panicked left nothing half done: an entry is whole or not there.
        let mut drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        let made = drawn.entry(n).or_insert_with(|| {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            // The high word of a product is uniform in 0..n but for a bias of n/2³².
            let draw = |_| ((u64::from(rng.next_u32()) * n as u64) >> 32) as u32;
            (0..RESAMPLES * n).map(draw).collect()
        });
        Arc::clone(made)
    }
}

/// The share of resampled means of `n` values to leave out at each end.
fn tail(n: usize) -> Option<f64> {
    let n = n as f64;
    let t = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.inverse_cdf(0.975);
    Some(Normal::standard().cdf(-(n / (n - 1.0)).sqrt() * t))
}

/// The quantile of values, straight between them; sorts only as much as it needs.
fn quantile(values: &mut [f64], at: f64) -> f64 {
    let place = at * (values.len() - 1) as f64;
    let (_, below, above) = values.select_nth_unstable_by(place as usize, f64::total_cmp);
    let below = *below;
    // The last value has none above it.
    let above = above.iter().copied().min_by(f64::total_cmp);
    below + (place - (place as usize) as f64) * (above.unwrap_or(below) - below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_as_scipy_has_them() {
        // norm.cdf(-sqrt(n / (n - 1)) * t.ppf(0.975, n - 1)) for n = 6, 24, 100
        let scipy = [
            (6, 0.002_431_803_174_611_566_7),
            (24, 0.017_293_967_308_914_08),
            (100, 0.023_064_387_207_087_644),
        ];
        for (n, expected) in scipy {
            let got = tail(n).unwrap();
            assert!((got / expected - 1.0).abs() < 1e-8, "{n}: {got}");
        }
    }

    /// The interval by its definition: every set drawn anew, all means sorted.
    fn by_definition(values: &[f64], seed: u64) -> [f64; 2] {
        let n = values.len() as u64;
        let centre = mean(values).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut means: Vec<f64> = (0..RESAMPLES)
            .map(|_| {
                let draw = |_| values[((u64::from(rng.next_u32()) * n) >> 32) as usize] - centre;
                (0..n).map(draw).sum::<f64>() / n as f64
            })
            .collect();
        means.sort_by(f64::total_cmp);
        let tail = tail(values.len()).unwrap();
        [tail, 1.0 - tail].map(|at| {
            let place = at * (RESAMPLES - 1) as f64;
            let below = place as usize;
            let (low, high) = (means[below], means[below + 1]);
            centre + (low + (place - below as f64) * (high - low))
        })
    }

    #[test]
    fn shared_draws_change_nothing() {
        let shared = Bootstrap::new(7);
        // In this order, so that draws of other lengths were made before.
        for n in [24, 6, 100, 24, 7] {
            let v: Vec<f64> = (1..=n).map(|k| f64::from(k * k).sin().exp()).collect();
            let expected = by_definition(&v, 7);
            assert_eq!(shared.mean_interval(&v), Some(expected), "{n}");
            assert_eq!(Bootstrap::new(7).mean_interval(&v), Some(expected), "{n}");
        }
        assert_eq!(RESAMPLES % TOGETHER, 0);
    }
}
