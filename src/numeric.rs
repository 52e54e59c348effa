//! Tolerances and guarded functions, each with its reason, and what several rooms search and sum with.

pub(crate) mod angles;
mod correlation;
#[cfg(any(test, feature = "stability"))]
pub(crate) mod exact;
pub(crate) mod powers;
pub(crate) mod ranks;
pub(crate) mod tree;

use glam::{DMat3, DVec3};

/// Cosine below which a direction counts as *on* the horizon for a real pose.
///
/// A node at theta = 90° has cosine 6e-17 in `f64`, not 0: positive, yet no instrument can see it
/// and several models diverge there. In orthographic and hybrid coordinates, where the cosine is
/// sqrt(1 − r²), rounding makes it up to 3e-8. A tenth of a micro-radian is above both, and far
/// below any arm's resolution.
pub const GRAZING_COS: f64 = 1e-7;

/// Largest distance (rad) below the horizon that rounding may give a direction on it.
///
/// The inverse maps add and subtract numbers of size 1 a handful of times;
/// 1e-14 is about 45 ulp, and 1e-14 rad is no physical distance.
pub(crate) const HORIZON_SLACK: f64 = 1e-14;

/// Smallest value a reflectance model divides by.
///
/// Several models diverge where a cosine or the half vector vanishes. A denominator of 1e-100 is
/// further down than any pose, and keeps f and f² below overflow for every allowed parameter, so
/// that values stay finite without moving any that differs from the horizon in double precision.
pub(crate) const DENOMINATOR_FLOOR: f64 = 1e-100;

/// Largest size of a reading in a file, sr⁻¹.
///
/// Far above what any model gives (see `DENOMINATOR_FLOOR`), and its square, summed over millions
/// of readings, is still finite.
pub const LARGEST_READING: f64 = 1e150;

/// `sqrt(max(x, 0))`: for differences that are non-negative on paper and may
/// round to a few ulp below 0.
#[inline]
pub(crate) fn safe_sqrt(x: f64) -> f64 {
    x.max(0.0).sqrt()
}

/// A number that looks random, from several numbers, with nothing in common with that of others (splitmix64; Steele et al. 2014).
pub(crate) fn hashed<const N: usize>(numbers: [u64; N]) -> u64 {
    numbers.into_iter().fold(0, |state, x| {
        let z = (state ^ x).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}

/// A closure as [`vectorised`] calls it: by a reference, as a call by value goes through a function that is not inlined.
pub(crate) struct Inlined<F>(pub F);

impl<T, F: FnMut() -> T> pulp::NullaryFnOnce for Inlined<F> {
    type Output = T;

    #[inline(always)]
    fn call(mut self) -> T {
        (self.0)()
    }
}

/// The value of an expression, compiled for the vectors of each machine with what it calls that is `inline(always)`.
macro_rules! vectorised {
    ($value:expr) => {
        pulp::Arch::new().dispatch($crate::numeric::Inlined(
            #[inline(always)]
            || $value,
        ))
    };
}
pub(crate) use vectorised;

/// Wraps an angle (rad) into `[-π, π]`; angles already there keep every bit.
#[inline]
pub fn wrap_angle(a: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if (-PI..=PI).contains(&a) {
        a
    } else {
        a - TAU * (a / TAU).round()
    }
}

/// The last number on the way from `inside` to `outside` for which `holds`, by so many halvings.
pub(crate) fn last_where(
    mut inside: f64,
    mut outside: f64,
    halvings: usize,
    holds: impl Fn(f64) -> bool,
) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (inside + outside);
        match holds(middle) {
            true => inside = middle,
            false => outside = middle,
        }
    }
    inside
}

/// Smallest and largest of some values; `None` of none.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    let ends = values.into_iter().map(|v| [v, v]);
    ends.reduce(|[lo, hi], [v, _]| [v.min(lo), v.max(hi)])
}

/// Luminance of a linear-sRGB triple (Rec. 709 weights).
#[inline]
pub fn luminance(rgb: [f64; 3]) -> f64 {
    LUMINANCE[0] * rgb[0] + LUMINANCE[1] * rgb[1] + LUMINANCE[2] * rgb[2]
}

/// Rec. 709 luminance weights of linear R, G, B.
pub(crate) const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// CIE 1931 X, Y, Z of linear R, G, B (IEC 61966-2-1), each divided by that of white: grey has X = Y = Z.
pub(crate) const XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(0.4124 / 0.9505, LUMINANCE[0], 0.0193 / 1.089),
    DVec3::new(0.3576 / 0.9505, LUMINANCE[1], 0.1192 / 1.089),
    DVec3::new(0.1805 / 0.9505, LUMINANCE[2], 0.9505 / 1.089),
);

/// The value in the middle, or above it of two there; `None` of nothing. Changes the order of the values.
pub(crate) fn upper_median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Numbers that may be infinite in formats that have no infinity: JSON writes `null` for it.
pub(crate) mod infinite_as_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes a number, or nothing in place of an infinite one.
    ///
    /// # Errors
    /// Errors of the format.
    pub(crate) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        value.is_finite().then_some(*value).serialize(serializer)
    }

    /// Reads a number, or infinity in place of nothing.
    ///
    /// # Errors
    /// Errors of the format.
    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
    }
}
pub use correlation::{Correlation, CorrelationMatrix, correlate};
