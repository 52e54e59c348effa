//! Moments from points that are spread evenly over the square (θ, φ): the Monte Carlo estimator of
//! Zubiaga et al. 2015, Eq. 6, and its variant with scrambled Sobol points.
//!
//! µ_nm ≈ (π²/N) Σ θ^n φ^m ρ(θ, φ). The points come in [`REPLICATES`] independent sets of equal
//! size; leaving out one set at a time (the grouped jackknife) gives the uncertainty of every
//! moment, linear or not, without a formula for each. For Sobol points the sets are independent
//! scramblings, so that their spread includes the even distribution of the points of one set.

use super::component::{Estimate, Moments, Order};
use super::estimator::{Estimator, SliceMoments, Unresolved};
use super::slice::{Batch, Kind, Slice};
use super::tally::Tally;
use crate::error::ParameterError;
use crate::parametrization::{VIEW_CENTERED_AREA, view_centered};
use crate::registry::declare;
use crate::sampling::{Random, Sobol};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Independent sets of points.
pub const REPLICATES: usize = 32;

/// Points that are evaluated together.
const CHUNK: usize = 1024;

declare! {
    impl dyn Estimator, "monte-carlo": "random points over the square (theta, phi) (Zubiaga et al. 2015, Eq. 6)", [
        "samples = 100000",
    ]
    /// The estimator of the paper: independent, uniformly distributed points.
    #[derive(Copy, PartialEq)]
    pub struct MonteCarlo {
        /// Points per slice, a multiple of 32.
        samples: usize = 100_000;
    }
}

declare! {
    impl dyn Estimator, "sobol": "32 scramblings of a Sobol set over the square (theta, phi)", ["samples = 131072"]
    /// The estimator with scrambled Sobol points.
    #[derive(Copy, PartialEq)]
    pub struct ScrambledSobol {
        /// Points per slice, 32 times a power of two.
        samples: usize = 1 << 17;
    }
}

/// Most points per slice.
const MAX_SAMPLES: usize = 1 << 36;

impl Estimator for MonteCarlo {
    fn label(&self) -> String {
        format!("{}-{}", Self::KIND, self.samples)
    }

    fn check(&self) -> Result<(), ParameterError> {
        let fits = self.samples.is_multiple_of(REPLICATES);
        if fits && (REPLICATES..=MAX_SAMPLES).contains(&self.samples) {
            return Ok(());
        }
        let allowed = format!("a multiple of {REPLICATES} up to {MAX_SAMPLES}");
        Err(ParameterError::new("samples", self.samples, allowed))
    }

    fn estimate(&self, slice: &Slice<'_>, order: Order, seed: u64) -> SliceMoments {
        let random = Random::new(seed);
        replicated(slice, order, self.samples, |replicate| {
            let mut stream = random.stream(replicate);
            move |_| [stream.next(), stream.next()]
        })
    }
}

impl Estimator for ScrambledSobol {
    fn label(&self) -> String {
        format!("{}-{}", Self::KIND, self.samples)
    }

    fn check(&self) -> Result<(), ParameterError> {
        let sets = self.samples / REPLICATES;
        if sets * REPLICATES == self.samples
            && sets.is_power_of_two()
            && self.samples <= MAX_SAMPLES
        {
            return Ok(());
        }
        let allowed =
            format!("{REPLICATES} times a power of two, e.g. 131072, up to {MAX_SAMPLES}");
        Err(ParameterError::new("samples", self.samples, allowed))
    }

    fn estimate(&self, slice: &Slice<'_>, order: Order, seed: u64) -> SliceMoments {
        let blocks = (self.samples / REPLICATES) as u64;
        // Sets start at a block of their own, which has a scrambling of its own.
        let blocks = blocks.div_ceil(Sobol::BLOCK);
        replicated(slice, order, self.samples, |replicate| {
            let mut sobol = Sobol::new(seed);
            let first = replicate * blocks * Sobol::BLOCK;
            move |i| sobol.point(first + i)
        })
    }
}

/// Sums over one set of points.
struct Set {
    tally: Tally,
    /// Σ (w / largest)² over its points: w² itself leaves the range of f64 at 1e154 and 1e-162.
    squares: f64,
    largest: f64,
    missing: usize,
    clamped: usize,
}

/// Estimates from `samples` points of the unit square, the i-th of each set by `points(set)(i)`.
fn replicated<P>(
    slice: &Slice<'_>,
    order: Order,
    samples: usize,
    points: impl Fn(u64) -> P + Sync,
) -> SliceMoments
where
    P: FnMut(u64) -> [f64; 2],
{
    let per_set = (samples / REPLICATES).max(1);
    let sets: Vec<Set> = (0..REPLICATES as u64)
        .into_par_iter()
        .map(|set| Set::draw(slice, order, per_set, points(set)))
        .collect();
    let area = VIEW_CENTERED_AREA / (per_set * REPLICATES) as f64;
    let weight: f64 = sets.iter().map(|s| s.tally.weight()).sum();
    let share = |of: fn(&Set) -> usize| {
        sets.iter().map(of).sum::<usize>() as f64 / (per_set * REPLICATES) as f64
    };
    let missing_share = share(|s| s.missing);
    let largest = sets.iter().map(|s| s.largest).fold(0.0, f64::max);
    let peak = slice.value(-slice.theta_o, 0.0).unwrap_or(0.0);
    let effective = if largest > 0.0 {
        let relative = |s: &Set| s.squares * (s.largest / largest).powi(2);
        (weight / largest).powi(2) / sets.iter().map(relative).sum::<f64>()
    } else {
        0.0
    };
    let unresolved = if missing_share == 1.0 || (weight == 0.0 && peak == 0.0) {
        // Nothing there, or nothing but black: there is nothing to resolve.
        None
    } else if peak > 2.0 * largest {
        Some(Unresolved::PeakUnseen)
    } else if effective < Unresolved::ENOUGH {
        Some(Unresolved::FewSamples { effective })
    } else {
        None
    };
    SliceMoments {
        moments: if missing_share == 1.0 {
            Moments::default()
        } else {
            jackknife(&sets, order, area)
        },
        unresolved,
        missing_share,
        clamped_share: share(|s| s.clamped),
        evaluations: per_set * REPLICATES + 1,
    }
}

impl Set {
    fn draw(
        slice: &Slice<'_>,
        order: Order,
        n: usize,
        mut point: impl FnMut(u64) -> [f64; 2],
    ) -> Self {
        let (mut batch, mut angles) = (Batch::default(), Vec::with_capacity(CHUNK));
        let mut set = Self {
            tally: Tally::new(order),
            squares: 0.0,
            largest: 0.0,
            missing: 0,
            clamped: 0,
        };
        let mut done = 0;
        while done < n {
            let len = CHUNK.min(n - done);
            batch.clear();
            angles.clear();
            for i in done..done + len {
                let [theta, phi] = point(i as u64).map(|u| (u - 0.5) * PI);
                angles.push([theta, phi]);
                batch.push(slice, view_centered(theta, phi));
            }
            slice.evaluate(&mut batch);
            set.tally
                .merge(&Tally::from_points(order, &angles, batch.values()));
            let largest = batch.values().iter().copied().fold(set.largest, f64::max);
            if largest > set.largest {
                set.squares *= (set.largest / largest).powi(2);
                set.largest = largest;
            }
            for (&value, kind) in batch.values().iter().zip(batch.kinds()) {
                if value > 0.0 {
                    set.squares += (value / largest).powi(2);
                }
                set.missing += usize::from(*kind == Kind::Missing);
                set.clamped += usize::from(*kind == Kind::Clamped);
            }
            done += len;
        }
        set
    }
}

/// Moments of all sets together, `area` (rad²) per point, with the spread of those of all but one.
fn jackknife(sets: &[Set], order: Order, area: f64) -> Moments {
    let n = sets.len();
    let none = Tally::new(order);
    // before[i]: sets 0..i; after: sets i+1..n, from behind.
    let mut before = vec![none; n + 1];
    for (i, set) in sets.iter().enumerate() {
        before[i + 1] = before[i];
        before[i + 1].merge(&set.tally);
    }
    let mut after = none;
    let mut without = vec![[None; 15]; n];
    for i in (0..n).rev() {
        let mut rest = before[i];
        rest.merge(&after);
        without[i] = rest.values();
        if let Some(energy) = &mut without[i][0] {
            // Of n − 1 sets, scaled to n.
            *energy *= area * n as f64 / (n - 1) as f64;
        }
        let mut next = sets[i].tally;
        next.merge(&after);
        after = next;
    }
    let mut whole = before[n].values();
    if let Some(energy) = &mut whole[0] {
        *energy *= area;
    }
    let mut moments = Moments::default();
    for (i, out) in moments.0.iter_mut().enumerate() {
        let Some(value) = whole[i] else {
            continue;
        };
        // A moment that some sets alone leave undefined has no known uncertainty.
        let uncertainty = if without.iter().all(|w| w[i].is_some()) {
            let values = || without.iter().filter_map(|w| w[i]);
            let mean = values().sum::<f64>() / n as f64;
            // In units of the largest, whose square may be out of the range of f64.
            let largest = values().map(|v| (v - mean).abs()).fold(0.0, f64::max);
            if largest > 0.0 {
                let spread: f64 = values().map(|v| ((v - mean) / largest).powi(2)).sum();
                largest * (spread * (n - 1) as f64 / n as f64).sqrt()
            } else {
                0.0
            }
        } else {
            f64::INFINITY
        };
        *out = Some(Estimate { value, uncertainty });
    }
    moments
}
