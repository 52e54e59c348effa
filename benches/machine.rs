//! What one core of this machine can do at most: the limits that kernels are measured against.
//!
//! Arithmetic is on the widest vectors that the processor has, in registers, chosen at run time as for our kernels. A
//! gather reads a table at random places, one value each.

use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};
use gonio::sampling::Random;
use pulp::{Arch, Simd, WithSimd};

/// Vectors that are worked on in turn: enough that none waits for itself, few enough for registers.
const VECTORS: usize = 12;
/// Operations on each of them.
const PASSES: usize = 20_000;

#[derive(Clone, Copy, Debug)]
enum Operation {
    MultiplyAdd,
    Multiply,
    Divide,
    SquareRoot,
}

impl WithSimd for Operation {
    /// A number that keeps it from being left out, and the numbers in a vector.
    type Output = (f64, usize);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let [near, small] = [0.999_999, 1e-6].map(|x| simd.splat_f64s(black_box(x)));
        let sum = match self {
            Self::MultiplyAdd => repeated(simd, |x| simd.mul_add_f64s(x, near, small)),
            Self::Multiply => repeated(simd, |x| simd.mul_f64s(x, near)),
            Self::Divide => repeated(simd, |x| simd.div_f64s(near, x)),
            Self::SquareRoot => repeated(simd, |x| simd.sqrt_f64s(x)),
        };
        (sum, S::F64_LANES)
    }
}

/// Does it over and over to every vector; their sum.
#[inline(always)]
fn repeated<S: Simd>(simd: S, operation: impl Fn(S::f64s) -> S::f64s) -> f64 {
    let mut vectors = [simd.splat_f64s(black_box(1.5)); VECTORS];
    for _ in 0..PASSES {
        for x in &mut vectors {
            *x = operation(*x);
        }
    }
    vectors.iter().map(|x| simd.reduce_sum_f64s(*x)).sum()
}

#[divan::bench(args = [
    Operation::MultiplyAdd,
    Operation::Multiply,
    Operation::Divide,
    Operation::SquareRoot,
])]
fn arithmetic(bencher: Bencher, operation: Operation) {
    let arch = Arch::new();
    let (_, lanes) = arch.dispatch(operation);
    bencher
        .counter(ItemsCount::new(VECTORS * PASSES * lanes))
        .bench_local(|| arch.dispatch(black_box(operation)));
}

/// Values at random places of tables of so many kB.
#[divan::bench(args = [100, 1000, 10_000, 100_000])]
fn gather(bencher: Bencher, kilobytes: usize) {
    const READS: usize = 100_000;
    let table: Vec<f64> = (0..kilobytes * 125).map(|i| i as f64).collect();
    let random = Random::new(1);
    let place = |i| (random.point::<1>(i)[0] * table.len() as f64) as usize;
    let places: Vec<usize> = (0..READS as u64).map(place).collect();
    let mut out = vec![0.0; READS];
    bencher.counter(ItemsCount::new(READS)).bench_local(|| {
        for (out, &place) in out.iter_mut().zip(black_box(&places)) {
            *out = table[place];
        }
        black_box(&mut out);
    });
}

/// Bytes that are read from memory and written to it.
#[divan::bench]
fn copy(bencher: Bencher) {
    const BYTES: usize = 64 << 20;
    let from = vec![1.0_f64; BYTES / 8];
    let mut to = from.clone();
    bencher
        .counter(BytesCount::new(2 * BYTES))
        .bench_local(|| to.copy_from_slice(black_box(&from)));
}
