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
