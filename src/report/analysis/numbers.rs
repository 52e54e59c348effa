//! Numbers with their errors, and ranges, as texts.

use crate::analysis::Estimate;
use crate::parametrization::Unit;

/// Decimals at most.
const DECIMALS: f64 = 9.0;

/// "0.377 ± 2.1e-3": the first digit that is uncertain is the last one. An error that no digit shows is rounding, and left out;
/// "–": of nothing, NaN.
pub(super) fn shown(value: f64, error: f64) -> String {
    if value.is_nan() {
        return "–".into();
    }
    if error < 0.5 * 10f64.powf(-DECIMALS) {
        let scale = 10f64.powf(DECIMALS);
        // Without the sign of a zero.
        return format!("{}", (value * scale).round() / scale + 0.0);
    }
    let digits = (-error.log10()).ceil().clamp(0.0, DECIMALS) as usize;
    format!("{value:.digits$} ± {error:.1e}")
}

/// A share as [`shown`], in percent.
pub(super) fn percent(share: &Estimate) -> String {
    match share.value.is_nan() {
        true => shown(share.value, share.error),
        false => format!("{} %", shown(100.0 * share.value, 100.0 * share.error)),
    }
}

/// "30° to 60°", or "0.2 to 0.4"; "45°" of one place.
pub(super) fn range(unit: Unit, [lo, hi]: [f64; 2]) -> String {
    let (ends, least, sign) = match unit {
        Unit::Radian => ([lo, hi].map(f64::to_degrees), 1.0, "°"),
        Unit::One => ([lo, hi], 4.0, ""),
    };
    // Two digits of the length, so that ends differ.
    let length = ends[1] - ends[0];
    let digits = 1.0 - length.max(1e-300).log10().floor();
    // What is shorter than all decimals is one place but for rounding.
    let digits = match digits <= DECIMALS {
        true => digits.max(least),
        false => least,
    };
    let scale = 10f64.powf(digits);
    // Rounded first, and without the sign of a zero.
    let [lo, hi] = ends.map(|v| (v * scale).round() / scale + 0.0);
    let digits = digits as usize;
    match lo == hi {
        true => format!("{lo:.digits$}{sign}"),
        false => format!("{lo:.digits$}{sign} to {hi:.digits$}{sign}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    #[test]
    fn errors_decide_how_many_digits_are_told() {
        for (value, error, text) in [
            (0.37712, 2.1e-3, "0.377 ± 2.1e-3"),
            (12.0, 3.0, "12 ± 3.0e0"),
            (100.0, 0.0, "100"),
            (1e-17, 2e-13, "0"),
            (-1e-17, 0.0, "0"),
            (44.1, 1e-12, "44.1"),
            (f64::NAN, f64::NAN, "–"),
        ] {
            assert_eq!(shown(value, error), text);
        }
        let nothing = Estimate {
            value: f64::NAN,
            error: f64::NAN,
        };
        assert_eq!(percent(&nothing), "–");
    }

    #[test]
    fn ends_of_narrow_ranges_differ() {
        for (unit, ends, text) in [
            (Unit::One, [0.0, 0.2], "0.0000 to 0.2000"),
            (Unit::One, [0.0, 3.1e-7], "0.00000000 to 0.00000031"),
            (Unit::One, [0.5, 0.5], "0.5000"),
            (Unit::Radian, [FRAC_PI_4, FRAC_PI_4 + 1e-15], "45.0°"),
            (Unit::Radian, [0.0, 0.5], "0.0° to 28.6°"),
            (Unit::Radian, [0.0, 1e-4], "0.0000° to 0.0057°"),
        ] {
            assert_eq!(range(unit, ends), text);
        }
    }
}
