//! Random and scrambled Sobol points in the unit cube, addressed by index.

use rand::{Rng, SeedableRng, TryRng};
use rand_chacha::ChaCha8Rng;
use sobol_burley::parts;
use std::convert::Infallible;

/// 2^-32: the step of a 32-bit fraction.
const STEP: f64 = 1.0 / 4_294_967_296.0;

/// Independent uniform points: point `i` comes from the `i`-th stream of ChaCha8.
#[derive(Clone, Debug)]
pub struct Random {
    base: ChaCha8Rng,
}

impl Random {
    /// Points of the given seed.
    pub fn new(seed: u64) -> Self {
        Self {
            base: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Point `index` in `[0, 1)^D`.
    pub fn point<const D: usize>(&self, index: u64) -> [f64; D] {
        let mut stream = self.stream(index);
        std::array::from_fn(|_| stream.next())
    }

    /// The numbers of stream `index`, of which point `index` is the beginning: for work in blocks,
    /// where a stream per point would cost more than the numbers.
    pub fn stream(&self, index: u64) -> RandomStream {
        let mut rng = self.base.clone();
        rng.set_stream(index);
        RandomStream(rng)
    }
}

/// Independent uniform numbers, one after the other.
#[derive(Clone, Debug)]
pub struct RandomStream(ChaCha8Rng);

impl RandomStream {
    /// The next number in `[0, 1)`.
    #[inline]
    #[expect(clippy::should_implement_trait, reason = "it never ends")]
    pub fn next(&mut self) -> f64 {
        // The upper 53 bits fill the significand of a number in [0, 1).
        (self.0.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }
}

/// So that `rand_distr` draws from it.
impl TryRng for RandomStream {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.0.next_u32())
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.0.next_u64())
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.0.fill_bytes(bytes);
        Ok(())
    }
}

/// Owen-scrambled Sobol points (Burley 2020, crate `sobol_burley`), at most eight dimensions.
///
/// The crate's sequence ends at 2^16 points and its public samplers round to `f32`. Here the index
/// is cut into blocks of 2^16, each scrambled with its own seed, and the full 32 bits are used:
/// points stay distinct and each block is a (t, m, s)-net of its own.
#[derive(Clone, Debug)]
pub struct Sobol {
    seed: u64,
    block: u64,
    scramble: u32,
}

impl Sobol {
    /// Points per block.
    pub const BLOCK: u64 = 1 << 16;

    /// Points of the given seed.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            block: 0,
            scramble: block_seed(seed, 0),
        }
    }

    /// Point `index` in `[0, 1)^D`. (`&mut` only caches the current block's seed.)
    pub fn point<const D: usize>(&mut self, index: u64) -> [f64; D] {
        const { assert!(D <= 8) };
        let block = index / Self::BLOCK;
        if block != self.block {
            self.block = block;
            self.scramble = block_seed(self.seed, block);
        }
        let low = scrambled((index % Self::BLOCK) as u32, 0, self.scramble);
        if D <= 4 {
            return std::array::from_fn(|d| low[d]);
        }
        let high = scrambled((index % Self::BLOCK) as u32, 1, self.scramble);
        std::array::from_fn(|d| if d < 4 { low[d] } else { high[d - 4] })
    }
}

/// Seed of one block: a ChaCha8 word, so that neighbouring seeds and blocks are unrelated.
fn block_seed(seed: u64, block: u64) -> u32 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(block);
    rng.next_u32()
}

/// Four dimensions of one point: `sobol_burley::sample_4d` without its final rounding to `f32`.
fn scrambled(index: u32, dimension_set: u32, seed: u32) -> [f64; 4] {
    let shuffled = parts::owen_scramble_rev(index.reverse_bits(), parts::hash(seed ^ 0x79c6_8e4a));
    let sobol = parts::sobol_int4_rev(shuffled, dimension_set);
    let scramble = {
        let seed: parts::Int4 = [seed.wrapping_mul(0x9c8f_2d3b); 4].into();
        let set: parts::Int4 = [dimension_set; 4].into();
        seed ^ set ^ [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].into()
    };
    let bits = parts::owen_scramble_int4_rev(sobol, parts::hash_int4(scramble));
    let words: [u32; 4] = bits.reverse_bits().into();
    // The half step keeps points inside (0, 1): a coordinate of exactly 0 is a degenerate pose.
    words.map(|w| (f64::from(w) + 0.5) * STEP)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::testing::{equal_bins, uniformity};
    use std::collections::HashSet;

    #[test]
    fn a_million_sobol_points_are_distinct() {
        let n = 1_000_000;
        let mut sobol = Sobol::new(0);
        let mut points: Vec<[u64; 4]> = (0..n)
            .map(|i| sobol.point::<4>(i).map(f64::to_bits))
            .collect();
        for d in 0..4 {
            // A coordinate has 2^32 values: some 100 of 10^6 draws meet an earlier one by chance.
            let distinct: HashSet<u64> = points.iter().map(|p| p[d]).collect();
            assert!(
                distinct.len() > 990_000,
                "dimension {d}: {}",
                distinct.len()
            );
        }
        points.sort_unstable();
        points.dedup();
        assert_eq!(points.len() as u64, n);
    }

    #[test]
    fn every_block_is_stratified() {
        // (0, m, 2)-net: every dyadic rectangle of area 2^-m holds one of 2^m consecutive points.
        let mut sobol = Sobol::new(3);
        for block in [0, 1, 15] {
            for m in [4, 10] {
                for x_bits in 0..=m {
                    let (nx, ny) = (1_u64 << x_bits, 1_u64 << (m - x_bits));
                    let mut seen = vec![false; 1 << m];
                    for i in 0..1 << m {
                        let [x, y] = sobol.point(block * Sobol::BLOCK + i);
                        let cell = (x * nx as f64) as u64 * ny + (y * ny as f64) as u64;
                        assert!(!std::mem::replace(&mut seen[cell as usize], true));
                    }
                }
            }
        }
        // Every single dimension of a whole block, one point in each of 65 536 intervals.
        for d in 0..8 {
            let mut seen = vec![false; 1 << 16];
            for i in 0..Sobol::BLOCK {
                let x = sobol.point::<8>(Sobol::BLOCK + i)[d];
                let cell = (x * 65_536.0) as usize;
                assert!(!std::mem::replace(&mut seen[cell], true), "{d} {cell}");
            }
        }
    }

    #[test]
    fn blocks_and_seeds_are_unrelated() {
        // Correlation of 65 536 independent pairs of points: standard error 0.004.
        let mut sobol = [Sobol::new(0), Sobol::new(1)];
        let [mut of_blocks, mut of_seeds] = [0.0, 0.0];
        for i in 0..Sobol::BLOCK {
            let [a] = sobol[0].point(i);
            let [b] = sobol[0].point(i + Sobol::BLOCK);
            let [c] = sobol[1].point(i);
            of_blocks += 12.0 * (a - 0.5) * (b - 0.5);
            of_seeds += 12.0 * (a - 0.5) * (c - 0.5);
        }
        let n = Sobol::BLOCK as f64;
        assert!((of_blocks / n).abs() < 0.02, "{}", of_blocks / n);
        assert!((of_seeds / n).abs() < 0.02, "{}", of_seeds / n);
    }

    #[test]
    fn a_point_depends_on_its_index_only() {
        let random = Random::new(5);
        let mut sobol = Sobol::new(5);
        // Two blocks of Sobol points, so that going back changes the cached seed.
        let indices: Vec<u64> = (65_000..66_000).chain([0, u64::MAX]).collect();
        let forwards: Vec<([f64; 3], [f64; 3])> = indices
            .iter()
            .map(|&i| (random.point(i), sobol.point(i)))
            .collect();
        for (&i, point) in indices.iter().zip(&forwards).rev() {
            assert_eq!((random.point(i), sobol.point(i)), *point);
            assert_eq!(Random::new(5).point(i), point.0);
        }
        let other = Random::new(6);
        assert!(
            indices
                .iter()
                .all(|&i| other.point::<3>(i) != random.point(i))
        );
    }

    #[test]
    fn more_dimensions_extend_a_point() {
        let random = Random::new(9);
        let mut sobol = Sobol::new(9);
        for i in [0, 1, 1000, 65_535, 65_536, 1 << 40] {
            let eight: [f64; 8] = sobol.point(i);
            assert_eq!(sobol.point::<4>(i)[..], eight[..4]);
            assert_eq!(sobol.point::<1>(i)[..], eight[..1]);
            assert_eq!(sobol.point::<5>(i)[..], eight[..5]);
            assert_eq!(sobol.point::<7>(i)[..], eight[..7]);
            // Beyond the first 16 words the generator moves on to its next block.
            let long: [f64; 40] = random.point(i);
            assert_eq!(random.point::<4>(i)[..], long[..4]);
            assert_eq!(random.point::<9>(i)[..], long[..9]);
        }
    }

    #[test]
    fn coordinates_are_inside_the_unit_interval() {
        let random = Random::new(1);
        let mut sobol = Sobol::new(1);
        for i in 0..100_000 {
            assert!(random.point::<2>(i).iter().all(|x| (0.0..1.0).contains(x)));
            let inside = |x: &f64| *x > 0.0 && *x < 1.0;
            assert!(sobol.point::<8>(i).iter().all(inside));
        }
    }

    #[test]
    fn random_points_are_uniform_and_streams_independent() {
        let random = Random::new(2);
        let points: Vec<[f64; 3]> = (0..100_000).map(|i| random.point(i)).collect();
        for d in 0..3 {
            let p = uniformity(&equal_bins(points.iter().map(|x| x[d]), 100));
            assert!(p > 1e-3, "dimension {d}: p = {p}");
        }
        // Two coordinates of one point, and the same coordinate of neighbouring streams.
        let cell = |a: f64, b: f64| ((a * 16.0).floor() + b) / 16.0;
        let within = points.iter().map(|x| cell(x[0], x[1]));
        let across = points.windows(2).map(|w| cell(w[0][0], w[1][0]));
        for p in [
            uniformity(&equal_bins(within, 256)),
            uniformity(&equal_bins(across, 256)),
        ] {
            assert!(p > 1e-3, "p = {p}");
        }
    }

    #[test]
    fn smooth_integrals_converge_faster_than_random() {
        // RMS over 16 seeds of the error of ∫ Π (1 + (e^x_d − (e − 1))/2) = 1 over four dimensions.
        let rms = |n: u64| {
            let square = |seed: u64| {
                let mut sobol = Sobol::new(seed);
                let mean: f64 = (0..n)
                    .map(|i| {
                        let x: [f64; 4] = sobol.point(i);
                        let factor = |x: f64| 1.0 + 0.5 * (x.exp() - (1.0_f64.exp() - 1.0));
                        x.map(factor).iter().product::<f64>()
                    })
                    .sum::<f64>()
                    / n as f64;
                (mean - 1.0).powi(2)
            };
            ((0..16).map(square).sum::<f64>() / 16.0).sqrt()
        };
        let (coarse, fine) = (rms(1 << 8), rms(1 << 14));
        let order = (coarse / fine).log2() / 6.0;
        assert!(order > 0.9, "N^-{order}: {coarse:e} {fine:e}");
        // Sixteen blocks average sixteen independent nets: half an order, no worse.
        let many = rms(1 << 20);
        assert!(many < 0.35 * rms(1 << 16), "{many:e}");
    }
}
