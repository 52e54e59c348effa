//! What laboratories write where they have no reading.

use crate::error::{count, excerpt};
use std::collections::BTreeMap;

/// Numbers that stand for no reading where they are far outside all others.
const NUMBERS: [f64; 6] = [-1.0, -99.0, -999.0, -9999.0, 9999.0, 1e30];

/// A mark is beyond so many times the largest size of all other values.
const BEYOND: f64 = 10.0;

/// Texts that stand for no reading, in small letters.
const TEXTS: [&str; 17] = [
    "nan", "n.a.", "n.a", "n/a", "na", "#n/a", "#na", "-", "--", "none", "null", "overflow",
    "overload", "ovl", "1.#ind", "-1.#ind", "1.#qnan",
];

/// True of a text in place of a number that stands for no reading.
pub(crate) fn is_mark(text: &str) -> bool {
    TEXTS.iter().any(|mark| mark.eq_ignore_ascii_case(text))
}

/// Those of [`NUMBERS`] among values that stand for no reading, and another one that does.
pub(crate) fn marks_among(
    values: impl Iterator<Item = f64> + Clone,
    other: Option<f64>,
) -> Vec<f64> {
    let rest = values.clone().filter(|v| !NUMBERS.contains(v));
    let largest = rest.fold(0.0, |most: f64, v| most.max(v.abs()));
    let is_mark = |mark: &f64| mark.abs() > BEYOND * largest && values.clone().any(|v| v == *mark);
    NUMBERS.into_iter().filter(is_mark).chain(other).collect()
}

/// How often which mark stood for no reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Marks(BTreeMap<String, usize>);

impl Marks {
    /// Counts one.
    pub fn see(&mut self, mark: &str) {
        *self.0.entry(excerpt(mark).into_owned()).or_default() += 1;
    }

    /// Adds those that were counted elsewhere.
    pub fn add(&mut self, more: Marks) {
        for (mark, count) in more.0 {
            *self.0.entry(mark).or_default() += count;
        }
    }

    /// Number of all.
    pub fn count(&self) -> usize {
        self.0.values().sum()
    }

    /// The sentence that says it; `None` if there is none.
    pub fn warning(&self) -> Option<String> {
        let each = self.0.iter();
        let each = each.map(|(mark, n)| format!("{mark} in {}", count(*n, "cell")));
        let each: Vec<String> = each.collect();
        (!each.is_empty()).then(|| format!("taken for no reading: {}", each.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_far_outside_what_is_read() {
        let among = |values: &[f64]| marks_among(values.iter().copied(), None);
        assert_eq!(among(&[0.1, 0.3, -999.0, -999.0]), [-999.0]);
        assert_eq!(among(&[0.01, -1.0]), [-1.0]);
        // Noise, or a peak.
        assert!(among(&[0.3, -1.0]).is_empty());
        assert!(among(&[2000.0, 9999.0]).is_empty());
        assert!(among(&[0.1, 0.2]).is_empty());
        assert!(is_mark("N.A.") && is_mark("Overflow") && !is_mark("12"));
    }
}
