//! Exponentials, logarithms and cube roots without branches, tables or calls, as [`super::angles`] has sines: loops over
//! them become vector instructions, and every machine gives the same bits.

use std::f64::consts::LOG2_E;

/// ln 2 as a sum: multiples of the first by less than 2²⁰ are exact.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

/// (eʳ − 1 − r)/r² in powers of r, by interpolation for |r| ≤ ln 2 / 2.
const EXP: [f64; 11] = [
    0.5,
    0.166_666_666_666_666_7,
    0.041_666_666_666_666_66,
    0.008_333_333_333_326_129,
    0.001_388_888_888_889_133_5,
    0.000_198_412_698_748_101_2,
    2.480_158_730_479_926_4e-5,
    2.755_725_544_012_747_5e-6,
    2.755_729_584_589_017_6e-7,
    2.510_519_413_470_533_8e-8,
    2.090_663_719_601_844e-9,
];

/// Largest size of an exponent: [`exp`] of what is beyond is that of this.
pub(crate) const LARGEST_EXPONENT: f64 = 708.0;

/// eˣ to 1 ulp, of a number of at most [`LARGEST_EXPONENT`].
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    // Beside 1.5 · 2⁵² the last bits of a sum are a whole number.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let x = x.clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT);
    let t = x * LOG2_E + WHOLE;
    let n = t - WHOLE;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let (r2, pair) = (r * r, |i: usize| EXP[i] + r * EXP[i + 1]);
    let low = pair(0) + r2 * pair(2);
    let high = pair(4) + r2 * pair(6);
    let highest = pair(8) + r2 * EXP[10];
    let r4 = r2 * r2;
    let e = 1.0 + (r + r2 * (low + r4 * (high + r4 * highest)));
    e * f64::from_bits(t.to_bits().wrapping_add(1023) << 52)
}

/// (ln((1 + s)/(1 − s)) − 2s)/s³ in powers of s² (FreeBSD's `e_log.c`).
const LN: [f64; 7] = [
    0.666_666_666_666_673_5,
    0.399_999_999_994_094_2,
    0.285_714_287_436_623_9,
    0.222_221_984_321_497_84,
    0.181_835_721_616_180_5,
    0.153_138_376_992_093_73,
    0.147_981_986_051_165_86,
];

/// ln x to 1 ulp: −∞ of 0, NaN of negative numbers.
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    /// sqrt(1/2): numbers are taken apart into powers of 2 and a rest in [sqrt(1/2), sqrt 2).
    const FIRST: u64 = 0x3fe6_a09e_667f_3bcd;
    const MANTISSA: u64 = (1 << 52) - 1;
    /// 2⁵², whose last bits count.
    const COUNT: u64 = 0x4330_0000_0000_0000;
    let tiny = x < f64::MIN_POSITIVE;
    let [up, down] = if tiny {
        [2f64.powi(54), 54.0]
    } else {
        [1.0, 0.0]
    };
    let t = (x * up).to_bits().wrapping_add((1023 << 52) - FIRST);
    let k = f64::from_bits(t >> 52 | COUNT) - (2f64.powi(52) + 1023.0) - down;
    let f = f64::from_bits((t & MANTISSA) + FIRST) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let odd = z * (LN[0] + w * (LN[2] + w * (LN[4] + w * LN[6])));
    let even = w * (LN[1] + w * (LN[3] + w * LN[5]));
    let half = 0.5 * f * f;
    let found = k * LN_2[0] - ((half - (s * (half + (odd + even)) + k * LN_2[1])) - f);
    let beyond = if x == 0.0 {
        f64::NEG_INFINITY
    } else {
        f64::NAN
    };
    let beyond = if x == f64::INFINITY { x } else { beyond };
    if (x > 0.0) & (x < f64::INFINITY) {
        found
    } else {
        beyond
    }
}

/// ln(1 + x) to 2 ulp: −∞ of −1, NaN below.
#[inline(always)]
pub(crate) fn ln_1p(x: f64) -> f64 {
    let u = 1.0 + x;
    // What rounding took from u.
    let rest = (x - (u - 1.0)) / u;
    ln(u)
        + if (u > 0.0) & (u < f64::INFINITY) {
            rest
        } else {
            0.0
        }
}

/// The cube root of a number ≥ 0 that is not subnormal, to 1 ulp.
#[inline(always)]
pub(crate) fn cbrt(x: f64) -> f64 {
    /// 2⁵², whose last bits count.
    const COUNT: u64 = 0x4330_0000_0000_0000;
    /// The first half of a number less a third of x's begins 1/cbrt x: 1 − xy³ is below 0.11.
    const FIRST: f64 = 1_430_186_287.0;
    let first_half = f64::from_bits(x.to_bits() >> 32 | COUNT) - 2f64.powi(52);
    let first = (FIRST - first_half * (1.0 / 3.0)) + 2f64.powi(52);
    let mut y = f64::from_bits(first.to_bits() << 32);
    for _ in 0..2 {
        // (1 − e)^(−1/3) by its first powers: e becomes 0.9 e⁴.
        let e = 1.0 - (x * y) * (y * y);
        y += y * e * (1.0 / 3.0 + e * (2.0 / 9.0 + e * (14.0 / 81.0)));
    }
    let y2 = y * y;
    let root = x * y2;
    root + (x - root * root * root) * y2 * (1.0 / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::exact::Exact;
    use crate::numeric::exact::tests::{numbers, off};

    fn assert_last_bits(name: &str, x: f64, got: f64, want: &Exact, allowed: f64) {
        let off = off(got, want, want.to_f64());
        assert!(got == want.to_f64() || off < allowed, "{name} {x:e}: {off}");
    }

    #[test]
    fn powers_are_good_to_the_last_bits() {
        for size in numbers(4000, [-18.0, LARGEST_EXPONENT.log10()]) {
            for x in [size, -size] {
                assert_last_bits("exp", x, exp(x), &Exact::from(x).exp(), 2.0);
            }
        }
        let third = Exact::from(1.0) / Exact::from(3.0);
        let near_one = numbers(2000, [-15.0, -0.5]).flat_map(|d| [1.0 + d, 1.0 - d]);
        for x in numbers(4000, [-307.0, 308.0]).chain(near_one) {
            assert_last_bits("ln", x, ln(x), &Exact::from(x).ln(), 2.0);
            assert_last_bits("cbrt", x, cbrt(x), &Exact::from(x).powf(&third), 2.0);
        }
        for size in numbers(4000, [-300.0, 300.0]) {
            for x in [size, -size].into_iter().filter(|x| *x > -1.0) {
                let exact = Exact::from(x);
                // Of smaller numbers the sum has too few digits left, and the series has no third term.
                let want = match size > 1e-18 {
                    true => (Exact::from(1.0) + &exact).ln(),
                    false => exact.clone() - exact.clone() * &exact / Exact::from(2.0),
                };
                assert_last_bits("ln_1p", x, ln_1p(x), &want, 4.0);
            }
        }
    }

    #[test]
    fn edges_are_those_of_the_standard_library() {
        for x in [0.0, f64::INFINITY, f64::NAN, -1.0, 1.0, f64::from_bits(1)] {
            let (got, want) = (ln(x), x.ln());
            let close = (got - want).abs() <= 1e-15 * want.abs();
            assert!(close || got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan()));
            let (got, want) = (ln_1p(x), x.ln_1p());
            let close = (got - want).abs() <= 1e-15 * want.abs();
            assert!(
                close || got == want || (got.is_nan() && want.is_nan()),
                "{x}"
            );
        }
        assert_eq!([cbrt(0.0), exp(0.0), exp(-0.0)], [0.0, 1.0, 1.0]);
        assert!(exp(f64::NAN).is_nan() && cbrt(f64::NAN).is_nan());
        assert_eq!([exp(1e300), exp(-1e300)], [exp(708.0), exp(-708.0)]);
    }
}
