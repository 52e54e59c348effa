//! Test pairs of every measure at once, in independent replicates.
//!
//! A lobe of 0.1° gets a handful of ten thousand pairs that are spread as a measure is, and every seed misses it
//! alike. So the pairs are of one mixture q, which looks everywhere where a BRDF may be narrow, and an average
//! under a measure p weighs each pair by p/q and divides by the sum of these weights:
//!
//! | share | density of (omega_i, omega_o), omega_o with density cos θ_o / π but in the first and the last |
//! |---|---|
//! | 1/2 | cos θ_i cos θ_o / π² |
//! | 6/32 | half vectors with density D(θ_h) cos θ_h of GGX, alpha 0.3, 0.1, 0.03, 0.01, 0.003, 0.001 |
//! | 5/32 | \|h_bar\| with density s² / (π (s² + \|h_bar\|²)²), s = 0.1, 0.03, 0.01, 0.003, 0.001 |
//! | 4/32 | the same of half the distance between light and sensor, projected: s = 0.1, 0.03, 0.01, 0.003 |
//! | 1/32 | both directions uniform in solid angle: as many at grazing elevations as elsewhere |
//!
//! No weight of a cosine pair is above 2. Sixteen replicates are scrambled independently of each other, and the
//! scatter of what they say is the standard error of what all of them say (Owen, *Monte Carlo theory, methods and
//! examples*, §17.3 and §9.10). Pairs come in levels, each as many as all before it: a beginning is a mixture of the
//! same shares.
//!
//! Candidates outside the window (below the horizon, beyond the mask, too close) are left out and not replaced, so
//! that q is known. The parts of [`Measure::Lobe`] are weighed by their shares inside the window.

use super::pairs::{LOBE_ALPHAS, Window, test_pairs};
use super::{Measure, MetricsSpec, Tally, Values};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::{Sobol, cosine_hemisphere, ggx_half_vector, ggx_half_vector_pdf};
use glam::DVec2;
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_PI, TAU};
use std::ops::Range;

/// Sets of pairs that are scrambled independently.
pub const REPLICATES: usize = 16;

/// The parts of the mixture: the first has half of it, the others have equal shares.
const MIXTURE: [Part; 17] = [
    Part::Cosine,
    // These four are the lobes of `Measure::Lobe`.
    Part::HalfVector(LOBE_ALPHAS[0]),
    Part::HalfVector(LOBE_ALPHAS[1]),
    Part::HalfVector(LOBE_ALPHAS[2]),
    Part::HalfVector(LOBE_ALPHAS[3]),
    Part::HalfVector(0.003),
    Part::HalfVector(0.001),
    Part::Half(0.1),
    Part::Half(0.03),
    Part::Half(0.01),
    Part::Half(0.003),
    Part::Half(0.001),
    Part::Back(0.1),
    Part::Back(0.03),
    Part::Back(0.01),
    Part::Back(0.003),
    Part::Uniform,
];

/// Parts beside the cosine distribution, equally often.
const PARTS: usize = MIXTURE.len() - 1;

/// Candidates after which every part has had its share.
const CYCLE: usize = 2 * PARTS;

/// Candidates that tell which share of a part is inside the window: to 0.1 % or better.
const TRIAL: u64 = Sobol::BLOCK;

/// A part of the mixture.
#[derive(Clone, Copy)]
enum Part {
    Cosine,
    HalfVector(f64),
    Half(f64),
    Back(f64),
    Uniform,
}

impl Part {
    /// A candidate from a point of the unit cube; `None` if there is no such pair.
    fn candidate(self, u: [f64; 4], cut: &Cut) -> Option<DirectionPair> {
        let cosine = |u: [f64; 2]| cosine_hemisphere([u[0] * cut.sin2, u[1]]);
        let omega_o = cosine([u[0], u[1]]);
        // omega_i at the point of the unit disc that the sensor's is taken to.
        let offset = |scale: f64, sign: f64| {
            let (sin, cos) = (TAU * u[3]).sin_cos();
            let v = u[2] * cut.sin2 / (scale * scale + cut.sin2);
            let radius = scale * (v / (1.0 - v)).sqrt();
            let at = 2.0 * radius * DVec2::new(cos, sin) + sign * omega_o.vector().truncate();
            let sin2 = at.length_squared();
            (sin2 < 1.0).then(|| Direction::from_unit(at.extend((1.0 - sin2).sqrt())))
        };
        let omega_i = match self {
            Part::Cosine => cosine([u[2], u[3]]),
            Part::HalfVector(alpha) => {
                // The share of half vectors inside the mask: tan²θ_h = α² u/(1 − u), solved for u.
                let h = ggx_half_vector(alpha, [u[2] * cut.share(alpha), u[3]]).vector();
                Direction::from_unit(2.0 * omega_o.vector().dot(h) * h - omega_o.vector())
            }
            Part::Half(scale) => offset(scale, -1.0)?,
            Part::Back(scale) => offset(scale, 1.0)?,
            Part::Uniform => {
                let uniform = |u: [f64; 2]| {
                    let cos = 1.0 - u[0] * (1.0 - cut.cos);
                    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
                    let (s, c) = (TAU * u[1]).sin_cos();
                    Direction::from_unit(glam::DVec3::new(sin * c, sin * s, cos))
                };
                let [a, b] = [[u[0], u[1]], [u[2], u[3]]].map(uniform);
                return Some(DirectionPair::new(a, b));
            }
        };
        Some(DirectionPair::new(omega_i, omega_o))
    }

    /// Density of the candidates inside the mask, sr⁻².
    fn density(self, facts: &Facts, cut: &Cut) -> f64 {
        let cosine = |cos: f64| cos * FRAC_1_PI / cut.sin2;
        let [cos_i, cos_o] = facts.cos;
        // Of a point of the disc; a point of omega_i's disc is four of them, and cos θ_i of a steradian.
        let offset = |scale: f64, r2: f64| {
            let s2 = scale * scale;
            let share = cut.sin2 / (s2 + cut.sin2);
            s2 * FRAC_1_PI / ((s2 + r2) * (s2 + r2)) / share * 0.25 * cos_i
        };
        match self {
            Part::Cosine => cosine(cos_i) * cosine(cos_o),
            Part::HalfVector(alpha) => {
                let normals = ggx_half_vector_pdf(alpha, facts.half) / cut.share(alpha);
                cosine(cos_o) * normals / (4.0 * facts.cos_d)
            }
            Part::Half(scale) => cosine(cos_o) * offset(scale, facts.half2),
            Part::Back(scale) => cosine(cos_o) * offset(scale, facts.back2),
            Part::Uniform => (TAU * (1.0 - cut.cos)).powi(-2),
        }
    }
}

/// The mask, as parts are cut at it.
struct Cut {
    cos: f64,
    sin2: f64,
}

impl Cut {
    /// The share of half vectors within it.
    fn share(&self, alpha: f64) -> f64 {
        self.sin2 / (self.sin2 + alpha * alpha * (1.0 - self.sin2))
    }
}

/// What densities need of a pair.
struct Facts {
    /// cos θ_i, cos θ_o.
    cos: [f64; 2],
    half: Direction,
    /// cos θ_d.
    cos_d: f64,
    /// |h_bar|² and |k_bar|².
    half2: f64,
    back2: f64,
}

impl Facts {
    fn of(pair: &DirectionPair) -> Self {
        let (h, k) = pair.half_and_back();
        Self {
            cos: [pair.omega_i.cos_theta(), pair.omega_o.cos_theta()],
            half: Direction::from_unit(h / h.length()),
            cos_d: h.length(),
            half2: h.truncate().length_squared(),
            back2: k.truncate().length_squared(),
        }
    }
}

/// Pairs of all replicates, and their weights.
#[derive(Clone, Debug, Default)]
pub struct Level {
    /// Replicate after replicate.
    pub pairs: Vec<DirectionPair>,
    /// Weights of the pairs, one list per measure.
    pub weights: Vec<Vec<f64>>,
    /// Where the pairs of each replicate are.
    pub replicates: Vec<Range<usize>>,
}

impl Level {
    /// Adds the pairs to a tally of the same set, with the values at all of them.
    ///
    /// # Panics
    /// If it has other replicates or measures.
    pub fn add_to(&self, tally: &mut Tally, truth: &Values, reconstruction: &Values) {
        for (r, range) in self.replicates.iter().enumerate() {
            let lists = (self.pairs.as_slice(), self.weights.as_slice());
            tally.add(r, range.clone(), lists, truth, (reconstruction, 0));
        }
    }

    /// Replicates that follow each other, with at most so many pairs together, or one.
    pub fn chunks(&self, most: usize) -> Vec<Range<usize>> {
        let mut chunks: Vec<Range<usize>> = Vec::new();
        for (r, range) in self.replicates.iter().enumerate() {
            match chunks.last_mut() {
                Some(last) if range.end - self.replicates[last.start].start <= most => {
                    last.end = r + 1
                }
                _ => chunks.push(r..r + 1),
            }
        }
        chunks
    }

    /// The pairs of some replicates: where they begin and end.
    pub fn span(&self, replicates: &Range<usize>) -> Range<usize> {
        self.replicates[replicates.start].start..self.replicates[replicates.end - 1].end
    }
}

/// The test pairs of some measures, without end.
pub struct TestSet {
    window: Window,
    cut: Cut,
    seed: u64,
    measures: Vec<Measure>,
    /// Candidates of a replicate in the first level.
    first: usize,
    max_pairs: usize,
    tolerance: f64,
    /// Shares of [`Part::Cosine`] and of each lobe of [`LOBE_ALPHAS`] inside the window.
    inside: [f64; 1 + LOBE_ALPHAS.len()],
}

impl TestSet {
    /// The pairs of `spec`, for these measures.
    ///
    /// # Errors
    /// As [`MetricsSpec::check`]; also for a mask and separation that together leave less than one candidate in
    /// a thousand.
    pub fn new(measures: &[Measure], spec: &MetricsSpec) -> Result<Self, ParameterError> {
        spec.check()?;
        let window = Window::new(spec);
        let cut = Cut {
            cos: window.cos_mask,
            sin2: window.sin2_mask,
        };
        let mut inside = [0.0; 1 + LOBE_ALPHAS.len()];
        let lobes = measures.contains(&Measure::Lobe);
        let asked = if lobes { inside.len() } else { 1 };
        for (inside, part) in inside.iter_mut().zip(MIXTURE).take(asked) {
            let mut sobol = Sobol::new(spec.seed);
            let kept = (0..TRIAL).filter(|&i| {
                let pair = part.candidate(sobol.point(i), &cut);
                pair.is_some_and(|pair| window.keeps(&pair))
            });
            *inside = kept.count() as f64 / TRIAL as f64;
            if *inside < 1e-3 {
                return Err(spec.hopeless());
            }
        }
        for &measure in measures {
            // A part that the mask leaves nothing of.
            let few = MetricsSpec {
                pairs: 1,
                ..spec.clone()
            };
            test_pairs(measure, &few)?;
        }
        Ok(Self {
            window,
            cut,
            seed: spec.seed,
            measures: measures.to_vec(),
            first: spec.pairs.div_ceil(REPLICATES * CYCLE) * CYCLE,
            max_pairs: spec.max_pairs,
            tolerance: spec.tolerance,
            inside,
        })
    }

    /// The measures, in the order of the weights.
    pub fn measures(&self) -> &[Measure] {
        &self.measures
    }

    /// Candidates of this and all levels before it.
    pub fn candidates(&self, level: usize) -> usize {
        (REPLICATES * self.first) << level
    }

    /// An empty sum over these pairs.
    pub fn tally(&self) -> Tally {
        Tally::new(self.measures.len(), REPLICATES)
    }

    /// True if the pairs of another level would be more than `max_pairs`.
    pub fn is_last(&self, level: usize) -> bool {
        self.candidates(level + 1) > self.max_pairs
    }

    /// True if the standard error of every average under a measure, by number, is below the tolerance.
    pub fn has_converged(&self, tally: &Tally, measure: usize) -> bool {
        tally.has_converged(measure, self.tolerance)
    }

    /// True if all that is waited for has converged: every measure but parts of others that are asked for too.
    pub fn is_enough(&self, tally: &Tally) -> bool {
        let is_part = |m: &Measure| self.measures.iter().any(|other| m.is_part_of(*other));
        let mut all = self.measures.iter().enumerate();
        all.all(|(at, m)| is_part(m) || self.has_converged(tally, at))
    }

    /// The pairs of a level: those of level 0 are the beginning, each further one has as many as all before it.
    pub fn level(&self, level: usize) -> Level {
        let of = match level {
            0 => 0..self.first,
            level => self.first << (level - 1)..self.first << level,
        };
        let replicates = (0..REPLICATES).into_par_iter();
        let replicates: Vec<_> = replicates.map(|r| self.replicate(r, of.clone())).collect();
        let mut all = Level {
            weights: vec![Vec::new(); self.measures.len()],
            ..Level::default()
        };
        for (pairs, weights) in replicates {
            let start = all.pairs.len();
            all.pairs.extend(pairs);
            all.replicates.push(start..all.pairs.len());
            for (all, weights) in all.weights.iter_mut().zip(weights) {
                all.extend(weights);
            }
        }
        all
    }

    /// Pairs and weights of some candidates of a replicate.
    fn replicate(&self, replicate: usize, of: Range<usize>) -> (Vec<DirectionPair>, Vec<Vec<f64>>) {
        let mut sobol: Vec<Sobol> = (0..MIXTURE.len())
            .map(|part| {
                // Any odd constant keeps the seeds apart; `Sobol` hashes what it is given.
                let stream = (replicate * MIXTURE.len() + part + 1) as u64;
                let seed = self
                    .seed
                    .wrapping_add(stream.wrapping_mul(0x9e37_79b9_7f4a_7c15));
                Sobol::new(seed)
            })
            .collect();
        let mut pairs = Vec::new();
        for i in of {
            let (part, number) = match i % 2 {
                0 => (0, i / 2),
                _ => (1 + i / 2 % PARTS, i / CYCLE),
            };
            let point = sobol[part].point(number as u64);
            let candidate = MIXTURE[part].candidate(point, &self.cut);
            pairs.extend(candidate.filter(|pair| self.window.keeps(pair)));
        }
        pairs.sort_by_cached_key(place);
        let mut weights = vec![Vec::with_capacity(pairs.len()); self.measures.len()];
        for pair in &pairs {
            let densities = self.densities(pair);
            let others: f64 = densities[1..].iter().sum();
            let mixture = 0.5 * (densities[0] + others / PARTS as f64);
            for (weights, measure) in weights.iter_mut().zip(&self.measures) {
                let density = match measure.has(pair) {
                    true => self.density(*measure, &densities),
                    false => 0.0,
                };
                weights.push(density / mixture);
            }
        }
        (pairs, weights)
    }

    /// The densities of all parts at a pair.
    fn densities(&self, pair: &DirectionPair) -> [f64; MIXTURE.len()] {
        let facts = Facts::of(pair);
        MIXTURE.map(|part| part.density(&facts, &self.cut))
    }

    /// The density of a measure inside the window, from those of the parts.
    fn density(&self, measure: Measure, densities: &[f64]) -> f64 {
        let cosine = densities[0] / self.inside[0];
        match measure {
            Measure::Cosine | Measure::Steep | Measure::Grazing => cosine,
            Measure::Lobe => {
                // The first parts after the cosine distribution are those of the measure.
                let lobes = densities[1..].iter().zip(&self.inside[1..]);
                let lobes: f64 = lobes.map(|(d, inside)| d / inside).sum();
                0.5 * (cosine + lobes / LOBE_ALPHAS.len() as f64)
            }
        }
    }
}

/// Where a pair is on a curve through all pairs (Morton 1966, over sqrt |h_bar|, |k_bar| and the angle between):
/// what is looked up for pairs that follow each other is near in memory.
fn place(pair: &DirectionPair) -> u32 {
    const BITS: u32 = 7;
    let (h, k) = pair.half_and_back();
    let [h, k] = [h.truncate(), k.truncate()];
    let [r, s] = [h.length(), k.length()];
    let cos = if r * s > 0.0 {
        h.dot(k).abs() / (r * s)
    } else {
        0.0
    };
    let numbers = [r.sqrt(), s, cos].map(|x| (x * f64::from(1 << BITS)) as u32);
    let bit = |bit: u32| numbers.iter().fold(0, |key, n| 2 * key + (n >> bit & 1));
    (0..=BITS).rev().fold(0, |key, b| 8 * key + bit(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(pairs: usize, mask_deg: f64, min_separation_deg: f64, seed: u64) -> MetricsSpec {
        MetricsSpec {
            pairs,
            mask_deg,
            min_separation_deg,
            seed,
            ..MetricsSpec::default()
        }
    }

    /// Mean over the replicates, and its standard error.
    fn mean(of: impl Fn(usize) -> f64) -> (f64, f64) {
        let values: Vec<f64> = (0..REPLICATES).map(of).collect();
        let n = REPLICATES as f64;
        let mean = values.iter().sum::<f64>() / n;
        let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        (mean, (spread / (n * (n - 1.0))).sqrt())
    }

    /// The integral of every density over the window is the share of its candidates that are inside.
    #[test]
    fn densities_are_those_of_the_candidates() {
        for (mask, separation) in [(90.0, 0.0), (80.0, 0.0), (40.0, 25.0)] {
            let set = TestSet::new(&Measure::USUAL, &spec(1 << 17, mask, separation, 3)).unwrap();
            let level = set.level(0);
            let each = set.first as f64;
            for (m, part) in MIXTURE.into_iter().enumerate() {
                let mut sobol = Sobol::new(99);
                let n = 1 << 15;
                let inside = (0..n).filter(|&i| {
                    let pair = part.candidate(sobol.point(i), &set.cut);
                    pair.is_some_and(|pair| set.window.keeps(&pair))
                });
                let inside = inside.count() as f64 / n as f64;
                let (integral, error) = mean(|r| {
                    let of = level.pairs[level.replicates[r].clone()].iter();
                    let of = of.map(|pair| {
                        let densities = set.densities(pair);
                        let others: f64 = densities[1..].iter().sum();
                        densities[m] / (0.5 * (densities[0] + others / PARTS as f64))
                    });
                    of.sum::<f64>() / each
                });
                let off = (integral - inside).abs();
                assert!(
                    off < 4.0 * error + 3e-3,
                    "{mask} {m}: {integral} ± {error}, {inside}"
                );
                // Nearly empty is no test.
                assert!(inside > 0.05 || separation > 0.0, "{mask} {m}: {inside}");
            }
        }
    }

    /// Averages of the weighted pairs are those of the pairs of each measure.
    #[test]
    fn weights_lead_back_to_the_measures() {
        type Number = fn(&DirectionPair) -> f64;
        let numbers: [Number; 4] = [
            |p| p.omega_i.cos_theta() * p.omega_o.cos_theta(),
            |p| p.half().truncate().length(),
            |p| 1.0 / (1.0 + 1e4 * p.half().truncate().length_squared()),
            |p| f64::from(u8::from(p.separation() < 0.5)),
        ];
        for (mask, separation) in [(90.0, 0.0), (80.0, 0.0), (50.0, 20.0)] {
            // No pair of a narrower window grazes.
            let measures = &Measure::ALL[..if mask > 65.0 { 4 } else { 3 }];
            let set = TestSet::new(measures, &spec(1 << 16, mask, separation, 1)).unwrap();
            let level = set.level(0);
            for (at, measure) in measures.iter().copied().enumerate() {
                let plain = test_pairs(measure, &spec(200_000, mask, separation, 2)).unwrap();
                for (k, number) in numbers.into_iter().enumerate() {
                    let n = plain.len() as f64;
                    let expected = plain.iter().map(number).sum::<f64>() / n;
                    // That of independent pairs; Sobol points are better.
                    let square: f64 = plain.iter().map(|p| (number(p) - expected).powi(2)).sum();
                    let of_plain = square.sqrt() / n;
                    let (found, error) = mean(|r| {
                        let (mut sum, mut all) = (0.0, 0.0);
                        for i in level.replicates[r].clone() {
                            sum += level.weights[at][i] * number(&level.pairs[i]);
                            all += level.weights[at][i];
                        }
                        sum / all
                    });
                    let what = || format!("{mask} {measure:?} {k}: {found} ± {error}, {expected}");
                    assert!(error < 0.03 * expected, "{}", what());
                    assert!(
                        (found - expected).abs() < 4.0 * error.hypot(of_plain),
                        "{}",
                        what()
                    );
                }
            }
        }
    }

    /// The mean cosine of cosine-distributed directions is 2/3 of the hemisphere.
    #[test]
    fn weights_of_the_cosine_measure_are_bounded_and_have_the_mean_on_paper() {
        let set = TestSet::new(&[Measure::Cosine], &spec(1 << 15, 90.0, 0.0, 0)).unwrap();
        let level = set.level(0);
        assert!(level.weights[0].iter().all(|w| *w <= 2.0 * (1.0 + 1e-12)));
        let sum = |of: &dyn Fn(&DirectionPair) -> f64| -> f64 {
            level
                .pairs
                .iter()
                .zip(&level.weights[0])
                .map(|(p, w)| w * of(p))
                .sum()
        };
        let cosine = sum(&|p| p.omega_i.cos_theta()) / sum(&|_| 1.0);
        assert!((cosine - 2.0 / 3.0).abs() < 2e-3, "{cosine}");
    }

    /// Levels go on where the one before ended.
    #[test]
    fn a_level_is_as_many_as_all_before_it() {
        let small = TestSet::new(&Measure::ALL, &spec(512, 80.0, 0.0, 0)).unwrap();
        let large = TestSet::new(&Measure::ALL, &spec(2048, 80.0, 0.0, 0)).unwrap();
        assert_eq!([small.candidates(0), small.candidates(2)], [512, 2048]);
        let of = |levels: &[Level], r: usize| -> Vec<DirectionPair> {
            let of = levels
                .iter()
                .map(|l| l.pairs[l.replicates[r].clone()].to_vec());
            let mut all = of.collect::<Vec<_>>().concat();
            // Each level is in an order of its own.
            all.sort_by_key(|pair| pair.omega_i.vector().x.to_bits());
            all
        };
        let levels: Vec<Level> = (0..3).map(|n| small.level(n)).collect();
        let whole = [large.level(0)];
        for r in 0..REPLICATES {
            assert_eq!(of(&levels, r), of(&whole, r));
        }
        for most in [1, 700, 1 << 20] {
            let chunks = whole[0].chunks(most);
            let joined: Vec<usize> = chunks.iter().cloned().flatten().collect();
            assert_eq!(joined, (0..REPLICATES).collect::<Vec<_>>());
            let fits = |c: &Range<usize>| c.len() == 1 || whole[0].span(c).len() <= most;
            assert!(chunks.iter().all(fits));
        }
    }

    /// Over many seeds an average differs from the truth as its standard error says, of a lobe that plain pairs
    /// never see too.
    #[test]
    fn standard_errors_are_honest() {
        for width in [0.5, 0.03, 2e-3] {
            let value = |p: &DirectionPair, w: f64| {
                let sin2 = p.half().truncate().length_squared() / p.half().length_squared();
                0.1 + (-sin2 / (w * w)).exp() / (w * w)
            };
            let errors = |seed: u64, pairs: usize| {
                let set = TestSet::new(&[Measure::Cosine], &spec(pairs, 80.0, 0.0, seed)).unwrap();
                let level = set.level(0);
                let values = |w: f64| Values {
                    luminance: level.pairs.iter().map(|p| value(p, w)).collect(),
                    missing: Vec::new(),
                };
                let mut tally = set.tally();
                level.add_to(&mut tally, &values(width), &values(1.1 * width));
                let of = |e: crate::metrics::Errors| [e.nrmse, e.log_relative].map(Option::unwrap);
                (of(tally.errors(0)), of(tally.standard_errors(0)))
            };
            let (truth, _) = errors(1000, 1 << 19);
            let mut z2 = [0.0; 2];
            let seeds = 40;
            for seed in 0..seeds {
                let (found, standard) = errors(seed, 4096);
                for k in 0..2 {
                    assert!(
                        standard[k] < 0.1 * found[k],
                        "{width} {k}: {standard:?} {found:?}"
                    );
                    z2[k] += ((found[k] - truth[k]) / standard[k]).powi(2) / seeds as f64;
                }
            }
            // The mean of 40 squares of Student's t with 15 degrees of freedom is 1.15 ± 0.32.
            assert!(
                z2.iter().all(|z2| (0.4..2.4).contains(z2)),
                "{width}: {z2:?}"
            );
        }
    }
}
