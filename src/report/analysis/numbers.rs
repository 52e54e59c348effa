//! Numbers with their errors, and ranges, as texts.

use crate::analysis::Estimate;
use crate::parametrization::Unit;

/// "0.377 ± 2.1e-3": the first digit that is uncertain is the last one.
pub(super) fn shown(value: f64, error: f64) -> String {
    let digits = if error > 0.0 {
        (-error.log10()).ceil().clamp(0.0, 9.0) as usize
    } else {
        9
    };
    format!("{value:.digits$} ± {error:.1e}")
}

/// A share as [`shown`], in percent.
pub(super) fn percent(share: &Estimate) -> String {
    format!("{} %", shown(100.0 * share.value, 100.0 * share.error))
}

/// "30° to 60°", or "0.2 to 0.4".
pub(super) fn range(unit: Unit, [lo, hi]: [f64; 2]) -> String {
    match unit {
        Unit::Radian => {
            // Rounded first, and without the sign of a zero.
            let shown = |v: f64| (v.to_degrees() * 10.0).round() / 10.0 + 0.0;
            format!("{:.1}° to {:.1}°", shown(lo), shown(hi))
        }
        Unit::One => format!("{lo:.4} to {hi:.4}"),
    }
}
