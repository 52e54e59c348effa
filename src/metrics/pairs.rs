//! The fixed test pairs, and their distributions.
//!
//! | measure | density of (omega_i, omega_o), sr⁻² |
//! |---|---|
//! | `cosine` | cos θ_i cos θ_o / π² |
//! | `steep`, `grazing` | the same where both polar angles are up to 65°, and where one is above |
//! | `lobe` | half of that; half: omega_o with density cos θ_o / π, half vector with density D(θ_h) cos θ_h of GGX, alpha 0.3, 0.1, 0.03, 0.01 equally often, omega_i the reflection of omega_o about it |
//!
//! Both restricted to pairs with θ_i, θ_o < mask and at least the minimum separation between light
//! and sensor. Candidates are scrambled Sobol points and rejected ones are replaced, so the number
//! of pairs is exact. `cosine` weighs what a diffuse room sees; under it a lobe of alpha 0.01 gets
//! one pair in thousands, hence `lobe`.
//!
//! The mask costs no candidates where it can be put into the warp: the cosine distribution cut at
//! the mask is the warp of u sin²(mask), and a half vector lies inside the mask if both directions
//! do (a cone is convex), so its distribution is cut there too. What is left is the same
//! conditional distribution that rejection alone would give.

use super::part::{MEASURED, Part, Window};
use crate::error::{ParameterError, in_left_open, in_whole};
use crate::geometry::DirectionPair;
use crate::registry::{keys, named};
use crate::sampling::Sobol;
use serde::{Deserialize, Serialize};

/// cos 65°: below, coordinates that are wide apart at the horizon show it.
const COS_GRAZING: f64 = 0.422_618_261_740_699_44;

/// Largest number of pairs: beyond it the pairs alone fill half a gigabyte.
const MAX_PAIRS: usize = 10_000_000;

/// Candidates a population may spend before its acceptance is judged: one block of Sobol points.
pub(super) const TRIAL: u64 = Sobol::BLOCK;

/// A window that keeps less than one candidate in this many is refused.
const MIN_ACCEPTANCE_INVERSE: u64 = 1000;

named! {
    /// Distribution of test pairs.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Measure {
        /// Both directions cosine-distributed: density cos θ_i cos θ_o / π².
        Cosine = "cosine",
        /// Half as `Cosine`; half with omega_o cosine-distributed and half vectors of GGX, alpha 0.3, 0.1, 0.03, 0.01 equally.
        Lobe = "lobe",
        /// The part of `Cosine` where both polar angles are up to 65°.
        Steep = "steep",
        /// The part of `Cosine` where one polar angle or both are above 65°.
        Grazing = "grazing",
    }
}

impl Measure {
    /// Those that are used where none are named.
    pub const USUAL: [Measure; 2] = [Measure::Cosine, Measure::Lobe];

    /// True if a pair is in the part of the hemispheres that it is about.
    pub(super) fn has(self, pair: &DirectionPair) -> bool {
        let lower = pair.least_cosine();
        match self {
            Measure::Cosine | Measure::Lobe => true,
            Measure::Steep => lower >= COS_GRAZING,
            Measure::Grazing => lower < COS_GRAZING,
        }
    }
}

keys! {
    /// Number, range and seed of the test pairs.
    #[derive(PartialEq)]
    pub struct MetricsSpec {
        /// Pairs to begin with, 1 to 10 000 000; of [`TestSet`](super::TestSet) the next multiple of 512, less those outside the window.
        pairs: usize = 1 << 13;
        /// Pairs that are not exceeded where more are added, up to 10 000 000.
        max_pairs: usize = 1 << 18;
        /// Largest standard error of an average, as a share of it, at which no more pairs are added; in (0, 1].
        tolerance: f64 = 0.02;
        /// Both elevations stay below it, degrees in (0, 90].
        mask_deg: f64 = 80.0;
        /// Smallest angle between light and sensor, degrees in [0, 180) and below twice the mask.
        min_separation_deg: f64 = 0.0;
        /// Seed of the fixed set of pairs.
        seed: u64 = 0;
    }
}

impl MetricsSpec {
    /// Checks every key, and that the mask leaves room for the separation.
    ///
    /// # Errors
    /// Names the key, its value and what is allowed.
    pub fn check(&self) -> Result<(), ParameterError> {
        for (key, pairs) in [("pairs", self.pairs), ("max_pairs", self.max_pairs)] {
            in_whole(key, pairs, [1, MAX_PAIRS])?;
        }
        in_left_open("tolerance", self.tolerance, 0.0, 1.0)?;
        in_left_open("mask_deg", self.mask_deg, 0.0, 90.0)?;
        // Two directions inside the mask are less than twice the mask apart. 90° gives 180.
        let limit = 2.0 * self.mask_deg;
        if !(self.min_separation_deg >= 0.0 && self.min_separation_deg < limit) {
            return Err(ParameterError::new(
                "min_separation_deg",
                self.min_separation_deg,
                format!("a number in [0, {limit}), twice mask_deg"),
            ));
        }
        Ok(())
    }

    /// The error for a mask and separation that leave next to no pairs.
    pub(super) fn hopeless(&self) -> ParameterError {
        ParameterError::new(
            "mask_deg, min_separation_deg",
            format!("{}, {}", self.mask_deg, self.min_separation_deg),
            "a window that keeps at least one pair in a thousand: a wider mask or a smaller separation",
        )
    }
}

/// The fixed test pairs of a measure: exactly `spec.pairs`, the same ones for the same spec.
///
/// Under [`Measure::Lobe`] pairs with an even index are the cosine half, the others cycle through the four lobes.
///
/// # Errors
/// As [`MetricsSpec::check`]; also for a window that keeps less than one candidate in a thousand.
///
/// ```
/// use gonio::metrics::{Measure, MetricsSpec, test_pairs};
/// let spec = MetricsSpec { pairs: 100, mask_deg: 60.0, ..Default::default() };
/// let pairs = test_pairs(Measure::Lobe, &spec).unwrap();
/// assert_eq!(pairs.len(), 100);
/// assert!(pairs.iter().all(|pair| pair.omega_i.cos_theta() > 0.5));
/// ```
pub fn test_pairs(
    measure: Measure,
    spec: &MetricsSpec,
) -> Result<Vec<DirectionPair>, ParameterError> {
    spec.check()?;
    let window = Window::new(spec.mask_deg, spec.min_separation_deg);
    let population = |i: usize| {
        // Any odd constant keeps the five seeds apart; `Sobol` hashes what it is given.
        let stream = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Population {
            sobol: Sobol::new(spec.seed.wrapping_add(stream)),
            part: MEASURED[i],
            tried: 0,
            kept: 0,
        }
    };
    let mut cosine = population(0);
    let mut lobes = [1, 2, 3, 4].map(population);
    (0..spec.pairs)
        .map(|i| {
            let population = match measure {
                Measure::Lobe if i % 2 == 1 => &mut lobes[i / 2 % (MEASURED.len() - 1)],
                _ => &mut cosine,
            };
            let pair = population.draw(&window, |pair| measure.has(pair));
            pair.ok_or_else(|| spec.hopeless())
        })
        .collect()
}

/// A distribution that a measure is mixed from, with its own Sobol points.
struct Population {
    sobol: Sobol,
    part: Part,
    tried: u64,
    kept: u64,
}

impl Population {
    /// The next pair inside the window that passes a filter, `None` if there are next to none.
    fn draw(
        &mut self,
        window: &Window,
        passes: impl Fn(&DirectionPair) -> bool,
    ) -> Option<DirectionPair> {
        while self.tried < TRIAL || self.kept * MIN_ACCEPTANCE_INVERSE >= self.tried {
            let pair = self.part.candidate(self.sobol.point(self.tried), window);
            self.tried += 1;
            let kept = pair.filter(|pair| window.keeps(pair) && passes(pair));
            if kept.is_some() {
                self.kept += 1;
                return kept;
            }
        }
        None
    }
}
