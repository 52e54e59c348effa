//! Lengths, angles and their sines without branches, tables or calls: loops over them become vector instructions, and every
//! machine gives the same bits (no fused multiply-add, which some have not).

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};

/// tan(π/8): the angle from which on π/4 is split off.
const TAN_PI_8: f64 = 0.414_213_562_373_095_03;

/// π/4, π/2 and π less their `f64`.
const REST: f64 = 3.061_616_997_868_383e-17;

/// (atan(q) − q)/q³ in powers of q², minimax over q² ≤ tan²(π/8).
const ATAN: [f64; 11] = [
    -0.333_333_333_333_331_2,
    0.199_999_999_999_408_37,
    -0.142_857_142_792_449_68,
    0.111_111_107_446_570_99,
    -0.090_908_968_014_728_13,
    0.076_920_451_945_614_81,
    -0.066_629_502_460_367_92,
    0.058_468_667_522_751_39,
    -0.050_350_497_953_124_39,
    0.037_963_903_161_110_83,
    -0.017_803_896_394_812_564,
];

/// The angle (rad) of the vector (x, y), in [−π, π], to 2 ulp; as the standard library's of NaN and of numbers neither
/// infinite nor subnormal, but 0 of (±0, ±0), and π of a −0 above a negative number.
#[inline(always)]
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let (small, large) = if steep { (ax, ay) } else { (ay, ax) };
    let large = if large == 0.0 { 1.0 } else { large };
    let wide = small > TAN_PI_8 * large;
    let over = if wide { small - large } else { small };
    let under = if wide { small + large } else { large };
    let q = over / under;
    let z = q * q;
    let (z2, z4) = (z * z, (z * z) * (z * z));
    let pair = |i: usize| ATAN[i] + z * ATAN[i + 1];
    let low = pair(0) + z2 * pair(2);
    let middle = pair(4) + z2 * pair(6);
    let high = pair(8) + z2 * ATAN[10];
    let r = q + q * z * (low + z4 * (middle + z4 * high));
    let r = if wide { FRAC_PI_4 + (r + REST) } else { r };
    let r = if steep {
        FRAC_PI_2 - (r - 2.0 * REST)
    } else {
        r
    };
    let r = if x < 0.0 { PI - (r - 4.0 * REST) } else { r };
    r.copysign(y + 0.0)
}

/// sqrt(x² + y²), to 1 ulp, of numbers whose squares do not overflow.
#[inline(always)]
pub(crate) fn hypot(x: f64, y: f64) -> f64 {
    let [up, down] = scale(x.abs().max(y.abs()));
    let (x, y) = (x * up, y * up);
    (x * x + y * y).sqrt() * down
}

/// A power of 2 and its inverse: 1, or one that lifts a number whose square would lose digits.
#[inline(always)]
pub(crate) fn scale(largest: f64) -> [f64; 2] {
    const UP: f64 = f64::from_bits((1023 + 900) << 52);
    const DOWN: f64 = f64::from_bits((1023 - 900) << 52);
    let tiny = largest < 1e-140;
    [if tiny { UP } else { 1.0 }, if tiny { DOWN } else { 1.0 }]
}

/// Largest angle (rad) of [`sin_cos`].
pub(crate) const LARGEST_ANGLE: f64 = 1e6;

/// π/2 as a sum: multiples of the first two by less than 2²⁰ are exact.
const PARTS: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];

/// (sin x − x)/x³ and (cos x − 1 + x²/2)/x⁴ in powers of x², minimax over |x| ≤ π/4.
const SIN: [f64; 6] = [
    -0.166_666_666_666_666_16,
    0.008_333_333_333_320_297,
    -0.000_198_412_698_285_998_4,
    2.755_731_335_888_172e-6,
    -2.505_071_419_879_576_3e-8,
    1.589_457_313_629_884_1e-10,
];
const COS: [f64; 6] = [
    0.041_666_666_666_666_45,
    -0.001_388_888_888_886_095_6,
    2.480_158_728_381_035_7e-5,
    -2.755_731_307_943_685_7e-7,
    2.087_558_003_775_504e-9,
    -1.135_326_283_413_335_2e-11,
];

/// Sine and cosine of an angle of at most [`LARGEST_ANGLE`], to 2⁻⁵³ each; without meaning beyond.
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    // Beside 1.5 · 2⁵² the last bits of a sum are a whole number.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let t = x * FRAC_2_PI + WHOLE;
    let n = t - WHOLE;
    let quarter = t.to_bits();
    let r = ((x - n * PARTS[0]) - n * PARTS[1]) - n * PARTS[2];
    let z = r * r;
    let z2 = z * z;
    let pair = |c: &[f64; 6], i: usize| c[i] + z * c[i + 1];
    let s = pair(&SIN, 1) + z2 * (pair(&SIN, 3) + z2 * SIN[5]);
    let s = r + r * z * (SIN[0] + z * s);
    let c = pair(&COS, 0) + z2 * (pair(&COS, 2) + z2 * pair(&COS, 4));
    let c = (1.0 - 0.5 * z) + z2 * c;
    let odd = quarter & 1 != 0;
    let (sin, cos) = if odd { (c, s) } else { (s, c) };
    let flipped = |v: f64, by: u64| f64::from_bits(v.to_bits() ^ ((by & 2) << 62));
    (flipped(sin, quarter), flipped(cos, quarter + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::exact::Exact;
    use crate::numeric::exact::tests::{numbers, off};

    /// Numbers of all sizes and both signs.
    fn of_both_signs(n: u64, decades: [f64; 2]) -> impl Iterator<Item = f64> {
        numbers(n, decades).flat_map(|x| [x, -x])
    }

    #[test]
    fn sines_are_good_to_the_last_bits_of_one() {
        let quarters = (-40..=40).map(|q| f64::from(q) * FRAC_PI_4);
        for x in of_both_signs(2000, [-300.0, 6.0]).chain(quarters) {
            let (sin, cos) = sin_cos(x);
            let (s, c) = Exact::from(x).sin_cos();
            assert!(off(sin, &s, x.abs().clamp(1e-300, 1.0)) < 2.0, "sin {x:e}");
            assert!(off(cos, &c, 1.0) < 2.0, "cos {x:e}");
        }
    }

    #[test]
    fn angles_are_good_to_two_ulp() {
        let near = |x: f64| [x, x.next_up(), x.next_down()];
        let edges = [0.0, 1.0, TAN_PI_8, 1.0 / TAN_PI_8, 1e-8, 1e-300, 1e300];
        let edges = edges.into_iter().flat_map(near).flat_map(|y| [y, -y]);
        for y in of_both_signs(2000, [-20.0, 20.0]).chain(edges) {
            for x in [1.0, -1.0] {
                let got = atan2(y, x);
                let want = Exact::atan2(&y.into(), &x.into());
                let size = if y == 0.0 { 1.0 } else { got.abs() };
                assert!(off(got, &want, size) < 4.0, "{y:e} {x} {got}");
            }
        }
    }

    #[test]
    fn no_vector_is_too_short_or_has_no_angle() {
        assert_eq!([atan2(0.0, 0.0), atan2(-0.0, -0.0)], [0.0; 2]);
        assert_eq!([atan2(0.0, -1.0), atan2(-0.0, -1.0)], [PI; 2]);
        assert!(atan2(f64::NAN, 1.0).is_nan() && atan2(1.0, f64::NAN).is_nan());
        for e in -323..150 {
            let unit: f64 = format!("1e{e}").parse().unwrap();
            // Of subnormal numbers all the digits that they have.
            let few = f64::from_bits(1);
            assert!((hypot(3.0 * unit, 4.0 * unit) - 5.0 * unit).abs() <= 3e-15 * unit + 5.0 * few);
            if unit.is_normal() {
                assert!(
                    (atan2(unit, 2.0 * unit) - atan2(1.0, 2.0)).abs() < 2e-16,
                    "{e}"
                );
            }
        }
    }
}
