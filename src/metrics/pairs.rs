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

use crate::error::{ParameterError, in_left_open, in_whole};
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::{Sobol, cosine_hemisphere, ggx_half_vector};
use serde::{Deserialize, Serialize};

/// Roughnesses of the lobes in [`Measure::Lobe`], equally often.
pub(super) const LOBE_ALPHAS: [f64; 4] = [0.3, 0.1, 0.03, 0.01];

/// cos 65°: below, coordinates that are wide apart at the horizon show it.
const COS_GRAZING: f64 = 0.422_618_261_740_699_44;

/// Largest number of pairs: beyond it the pairs alone fill half a gigabyte.
const MAX_PAIRS: usize = 10_000_000;

/// Candidates a population may spend before its acceptance is judged: one block of Sobol points.
const TRIAL: u64 = Sobol::BLOCK;

/// A window that keeps less than one candidate in this many is refused.
const MIN_ACCEPTANCE_INVERSE: u64 = 1000;

/// Distribution of test pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Both directions cosine-distributed: density cos θ_i cos θ_o / π².
    Cosine,
    /// Half as `Cosine`; half with omega_o cosine-distributed and the half vector drawn from GGX,
    /// alpha 0.3, 0.1, 0.03, 0.01 equally, pairs below the horizon dropped.
    Lobe,
    /// The part of `Cosine` where both polar angles are up to 65°.
    Steep,
    /// The part of `Cosine` where one polar angle or both are above 65°.
    Grazing,
}

impl Measure {
    /// Every measure.
    pub const ALL: [Measure; 4] = [
        Measure::Cosine,
        Measure::Lobe,
        Measure::Steep,
        Measure::Grazing,
    ];

    /// Those that are used where none are named.
    pub const USUAL: [Measure; 2] = [Measure::Cosine, Measure::Lobe];

    /// Name in configs and result files.
    pub fn name(self) -> &'static str {
        match self {
            Measure::Cosine => "cosine",
            Measure::Lobe => "lobe",
            Measure::Steep => "steep",
            Measure::Grazing => "grazing",
        }
    }

    /// True if its pairs are some of another's.
    pub(super) fn is_part_of(self, other: Measure) -> bool {
        other == Measure::Cosine && matches!(self, Measure::Steep | Measure::Grazing)
    }

    /// True if a pair is in the part of the hemispheres that it is about.
    pub(super) fn has(self, pair: &DirectionPair) -> bool {
        let lower = pair.omega_i.cos_theta().min(pair.omega_o.cos_theta());
        match self {
            Measure::Cosine | Measure::Lobe => true,
            Measure::Steep => lower >= COS_GRAZING,
            Measure::Grazing => lower < COS_GRAZING,
        }
    }
}

/// Number, range and seed of the test pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MetricsSpec {
    /// Pairs to begin with, 1 to 10 000 000; of [`TestSet`](super::TestSet) the next multiple of 512, of which
    /// those outside the window are left out.
    pub pairs: usize,
    /// Pairs that are not exceeded where more are added, up to 10 000 000.
    pub max_pairs: usize,
    /// Largest standard error of an average, as a share of it, at which no more pairs are added; in (0, 1].
    pub tolerance: f64,
    /// Both elevations stay below it, degrees in (0, 90].
    pub mask_deg: f64,
    /// Smallest angle between light and sensor, degrees in [0, 180) and below twice the mask.
    pub min_separation_deg: f64,
    /// Seed of the fixed set of pairs.
    pub seed: u64,
}

impl Default for MetricsSpec {
    fn default() -> Self {
        Self {
            pairs: 1 << 13,
            max_pairs: 1 << 18,
            tolerance: 0.02,
            mask_deg: 80.0,
            min_separation_deg: 0.0,
            seed: 0,
        }
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
/// Under [`Measure::Lobe`] pairs with an even index are the cosine half, the others cycle through
/// the four lobes. (One more cosine pair if the number is odd.)
///
/// # Errors
/// As [`MetricsSpec::check`]; also for a mask and separation that together leave less than
/// one candidate in a thousand.
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
    let window = Window::new(spec);
    let mut cosine = Population::new(spec.seed, 0, None);
    let mut lobes = [0, 1, 2, 3].map(|i| Population::new(spec.seed, i + 1, Some(LOBE_ALPHAS[i])));
    (0..spec.pairs)
        .map(|i| {
            let population = match measure {
                Measure::Lobe if i % 2 == 1 => &mut lobes[i / 2 % LOBE_ALPHAS.len()],
                _ => &mut cosine,
            };
            population
                .draw(
                    |pair| window.keeps(pair) && measure.has(pair),
                    window.sin2_mask,
                )
                .ok_or_else(|| spec.hopeless())
        })
        .collect()
}

/// Condition on the pairs that are kept.
pub(super) struct Window {
    /// Both cosines are above this.
    pub cos_mask: f64,
    pub sin2_mask: f64,
    /// Smallest angle between light and sensor, rad.
    min_separation: f64,
}

impl Window {
    pub fn new(spec: &MetricsSpec) -> Self {
        let (sin, cos) = spec.mask_deg.to_radians().sin_cos();
        Self {
            // cos 90° is 6e-17 in `f64`; a mask of 90° means the horizon itself.
            cos_mask: if spec.mask_deg == 90.0 { 0.0 } else { cos },
            sin2_mask: sin * sin,
            min_separation: spec.min_separation_deg.to_radians(),
        }
    }

    pub fn keeps(&self, pair: &DirectionPair) -> bool {
        pair.omega_i.cos_theta() > self.cos_mask
            && pair.omega_o.cos_theta() > self.cos_mask
            && (self.min_separation == 0.0 || pair.separation() >= self.min_separation)
    }
}

/// A distribution that a measure is mixed from, with its own Sobol points.
struct Population {
    sobol: Sobol,
    /// Roughness of the lobe; `None` for two cosine-distributed directions.
    alpha: Option<f64>,
    tried: u64,
    kept: u64,
}

impl Population {
    fn new(seed: u64, stream: usize, alpha: Option<f64>) -> Self {
        // Any odd constant keeps the five seeds apart; `Sobol` hashes what it is given.
        let seed = seed.wrapping_add((stream as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        Self {
            sobol: Sobol::new(seed),
            alpha,
            tried: 0,
            kept: 0,
        }
    }

    /// The next pair inside the window, `None` if there are next to none.
    fn draw(
        &mut self,
        keeps: impl Fn(&DirectionPair) -> bool,
        sin2_mask: f64,
    ) -> Option<DirectionPair> {
        loop {
            if self.tried >= TRIAL && self.kept * MIN_ACCEPTANCE_INVERSE < self.tried {
                return None;
            }
            let u = self.sobol.point(self.tried);
            self.tried += 1;
            let pair = self.candidate(u, sin2_mask);
            if keeps(&pair) {
                self.kept += 1;
                return Some(pair);
            }
        }
    }

    fn candidate(&self, u: [f64; 4], sin2_mask: f64) -> DirectionPair {
        let omega_o = cosine_hemisphere([u[0] * sin2_mask, u[1]]);
        let Some(alpha) = self.alpha else {
            return DirectionPair::new(cosine_hemisphere([u[2] * sin2_mask, u[3]]), omega_o);
        };
        // The share of half vectors inside the mask: tan²θ_h = α² u/(1 − u), solved for u.
        let share = sin2_mask / (sin2_mask + alpha * alpha * (1.0 - sin2_mask));
        let h = ggx_half_vector(alpha, [u[2] * share, u[3]]).vector();
        let omega_i = 2.0 * omega_o.vector().dot(h) * h - omega_o.vector();
        DirectionPair::new(Direction::from_unit(omega_i), omega_o)
    }
}
