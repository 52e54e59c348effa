//! Ranges and ticks of axes.

use super::canvas::text_width;
use crate::numeric::extent;
use crate::report::svg::plot::{Axis, Scale};

/// Font size of tick labels, pixels.
pub(in crate::report) const SIZE: f64 = 11.0;

/// Values are clamped to this, and so far from 0 on logarithmic axes, before anything is computed:
/// differences of larger ones overflow.
const LARGEST: f64 = 1e300;

/// Values on linear axes that are all below this are rounding of quantities about 1, and are shown as zeros.
const ROUNDING: f64 = 1e-15;

/// An axis with its range and ticks.
pub(in crate::report) struct Ruler {
    scale: Scale,
    /// Ends, log10 of them on logarithmic axes.
    ends: [f64; 2],
    /// Places in [0, 1] with a label.
    pub labelled: Vec<(f64, String)>,
    /// Places in [0, 1] without one.
    pub minor: Vec<f64>,
}

impl Ruler {
    /// The axis of a panel whose data is `values`, `length` pixels long.
    pub(crate) fn new(
        axis: &Axis,
        values: impl Iterator<Item = f64>,
        length: f64,
        horizontal: bool,
    ) -> Self {
        let ends = ends(axis, values, horizontal);
        let mut ruler = Self {
            scale: axis.scale,
            ends,
            labelled: Vec::new(),
            minor: Vec::new(),
        };
        let fits = |labels: &[(f64, String)]| {
            let extent = |label: &str| match horizontal {
                true => text_width(label, SIZE) + 10.0,
                false => 1.6 * SIZE,
            };
            labels.windows(2).all(|w| {
                let apart = (w[1].0 - w[0].0) * length;
                apart >= 0.5 * (extent(&w[0].1) + extent(&w[1].1))
            })
        };
        let most = (length / if horizontal { 55.0 } else { 34.0 }).max(2.0) as usize;
        let candidates: Vec<Vec<(f64, String)>> = match axis.scale {
            Scale::Linear => {
                let ticks = |count| linear_ticks(ends, count, axis.label.contains("(°)"));
                (1..=most).rev().map(ticks).collect()
            }
            Scale::Log => ruler.log_candidates(most),
        };
        let good = candidates.into_iter().find(|labels| fits(labels));
        ruler.labelled = good.unwrap_or_default();
        if axis.scale == Scale::Log {
            ruler.minor = ruler.log_minor(length);
        }
        ruler
    }

    /// Place of a value: 0 at the lower end, 1 at the upper; `None` if it cannot be shown.
    pub(crate) fn place(&self, value: f64) -> Option<f64> {
        let value = transformed(self.scale, value)?;
        Some((value - self.ends[0]) / (self.ends[1] - self.ends[0]))
    }

    /// Candidate sets of labels (place, text), from many to few.
    fn log_candidates(&self, most: usize) -> Vec<Vec<(f64, String)>> {
        let [lo, hi] = self.ends;
        let decades = lo.floor() as i32..=hi.ceil() as i32;
        let plain = lo > -3.01 && hi < 4.01;
        let mut all = Vec::new();
        let mut add = |mantissas: &[u8], every: i32| {
            let chosen = decades.clone().filter(|d| d.rem_euclid(every) == 0);
            let ticks = chosen.flat_map(|d| mantissas.iter().map(move |&m| (m, d)));
            let inside = ticks.filter_map(|(m, d)| {
                let at = (f64::from(d) + f64::from(m).log10() - lo) / (hi - lo);
                (-1e-9..=1.0 + 1e-9)
                    .contains(&at)
                    .then(|| (at, power(m, d, plain)))
            });
            let labels: Vec<_> = inside.collect();
            if (2..=most.max(3)).contains(&labels.len()) {
                all.push(labels);
            }
        };
        add(&[1, 2, 3, 4, 5, 6, 7, 8, 9], 1);
        add(&[1, 2, 5], 1);
        add(&[1, 3], 1);
        for every in [1, 2, 3, 5, 10, 20, 50, 100, 200] {
            add(&[1], every);
        }
        // Within half a decade there are few of these, or none.
        let [a, b] = self.ends.map(|e| 10f64.powf(e));
        let equal = [5, 4, 3, 2, 1].map(|count| {
            let labels = linear_ticks([a, b], count, false);
            let place = |t: f64| ((a + t * (b - a)).log10() - lo) / (hi - lo);
            let labels = labels.into_iter().map(|(t, l)| (place(t), l));
            labels.collect()
        });
        if hi - lo < 0.5 {
            return equal.into_iter().chain(all).collect();
        }
        all.extend(equal);
        all
    }

    fn log_minor(&self, length: f64) -> Vec<f64> {
        let [lo, hi] = self.ends;
        let decade = length / (hi - lo);
        let mantissas: &[u8] = match decade {
            d if d > 40.0 => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
            d if d > 6.0 => &[1],
            _ => &[],
        };
        let decades = lo.floor() as i32..=hi.ceil() as i32;
        let places = decades.flat_map(|d| {
            let at = move |m: &u8| (f64::from(d) + f64::from(*m).log10() - lo) / (hi - lo);
            mantissas.iter().map(at)
        });
        places.filter(|t| (0.0..=1.0).contains(t)).collect()
    }
}

/// Ticks of a linear axis between two ends, `count` of them or fewer: places in [0, 1] and labels.
fn linear_ticks([lo, hi]: [f64; 2], count: usize, degrees: bool) -> Vec<(f64, String)> {
    let least = (hi - lo) / count as f64;
    let power = 10f64.powf(least.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    let steps: &[f64] = match degrees && (2.0..=180.0).contains(&least) {
        true => &[5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0],
        false => &round,
    };
    // Rounding may leave the last one a little below.
    let enough = steps.iter().copied().find(|s| *s >= least * (1.0 - 1e-9));
    let step = enough.unwrap_or(10.0 * power);
    let (first, last) = ((lo / step - 1e-6).ceil(), (hi / step + 1e-6).floor());
    let largest = first.abs().max(last.abs()) * step;
    let tick = |k: f64| {
        let label = match k {
            0.0 => "0".into(),
            k => number(k * step, step, largest),
        };
        ((k * step - lo) / (hi - lo), label)
    };
    let count = (last - first).clamp(0.0, 100.0) as usize;
    let ticks = (0..=count).map(|i| first + i as f64);
    ticks.filter(|k| *k <= last).map(tick).collect()
}

/// A value on the scale of the axis: itself or its log10; `None` if it has no place.
fn transformed(scale: Scale, value: f64) -> Option<f64> {
    match scale {
        _ if !value.is_finite() => None,
        Scale::Linear => Some(value.clamp(-LARGEST, LARGEST)),
        Scale::Log => (value > 0.0).then(|| value.clamp(1.0 / LARGEST, LARGEST).log10()),
    }
}

/// Lower and upper end, apart from each other; log10 of them on logarithmic axes.
fn ends(axis: &Axis, values: impl Iterator<Item = f64>, horizontal: bool) -> [f64; 2] {
    let asked = axis.range.and_then(|[a, b]| {
        let [a, b] = [transformed(axis.scale, a)?, transformed(axis.scale, b)?];
        Some([a.min(b), a.max(b)])
    });
    let shown = values.filter_map(|v| transformed(axis.scale, v));
    let Some([lo, hi]) = asked.or_else(|| extent(shown)) else {
        // Nothing to show.
        return match axis.scale {
            Scale::Linear => [0.0, 1.0],
            Scale::Log => [-1.0, 1.0],
        };
    };
    let largest = lo.abs().max(hi.abs());
    if asked.is_some() && hi - lo > 1e-12 * largest && hi - lo > 1e-290 {
        return [lo, hi];
    }
    match axis.scale {
        // Labels of the two ends would differ only in the twelfth digit; the data is constant.
        Scale::Linear if hi - lo <= 1e-4 * largest || largest < ROUNDING => {
            let middle = 0.5 * lo + 0.5 * hi;
            let half = if largest < ROUNDING {
                1.0
            } else {
                0.1 * largest
            };
            [middle - half, middle + half]
        }
        Scale::Linear if horizontal => [lo, hi],
        Scale::Linear => {
            let pad = 0.04 * (hi - lo);
            [lo - pad, hi + pad]
        }
        // With a tick at each end there are always two.
        Scale::Log if hi - lo < 1.0 => {
            let (a, b) = (snapped(lo, false), snapped(hi, true));
            if b - a > 0.01 {
                [a, b]
            } else {
                [snapped(lo - 0.1, false), snapped(hi + 0.1, true)]
            }
        }
        Scale::Log if horizontal => [lo, hi],
        Scale::Log => {
            let pad = 0.03 * (hi - lo);
            [lo - pad, hi + pad]
        }
    }
}

/// The nearest log10 of 1, 2 or 5 times a power of ten above or below.
fn snapped(log: f64, up: bool) -> f64 {
    let decade = log.floor();
    let steps = [0.0, 2f64.log10(), 5f64.log10(), 1.0].map(|m| decade + m);
    let found = if up {
        steps.into_iter().find(|s| *s >= log - 1e-9)
    } else {
        steps.into_iter().rev().find(|s| *s <= log + 1e-9)
    };
    found.unwrap_or(log)
}

/// A tick's label; `step` is the distance of ticks, `largest` the largest of them.
fn number(value: f64, step: f64, largest: f64) -> String {
    let digit = |v: f64| (v * (1.0 + 1e-9)).log10().floor() as i32;
    let text = if (1e-3..1e5).contains(&largest) {
        let decimals = (-digit(step)).clamp(0, 15) as usize;
        format!("{value:.decimals$}")
    } else {
        // One power of ten for all labels of an axis.
        let exponent = digit(largest);
        let decimals = (exponent - digit(step)).clamp(0, 15) as usize;
        let mantissa = value / 10f64.powi(exponent);
        product(&format!("{mantissa:.decimals$}"), exponent)
    };
    text.replace('-', "−")
}

/// Text of m · 10^d.
fn power(mantissa: u8, decade: i32, plain: bool) -> String {
    if plain {
        let decimals = (-decade).max(0) as usize;
        let value = f64::from(mantissa) * 10f64.powi(decade);
        return format!("{value:.decimals$}");
    }
    product(&mantissa.to_string(), decade)
}

/// A number times a power of ten, without a factor of 1.
fn product(mantissa: &str, exponent: i32) -> String {
    match mantissa {
        "1" => format!("10{}", raised(exponent)),
        "-1" => format!("-10{}", raised(exponent)),
        m => format!("{m}·10{}", raised(exponent)),
    }
}

/// A number in superscript.
fn raised(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |c: char| c.to_digit(10).map_or('⁻', |d| DIGITS[d as usize]);
    number.to_string().chars().map(digit).collect()
}
