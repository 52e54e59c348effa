//! What laboratories write where they have no reading, in readings and in tables.

use crate::error::{count, excerpt, listed};
use std::collections::BTreeMap;

/// Numbers that stand for no reading where they are far outside all others.
const NUMBERS: [f64; 6] = [-1.0, -99.0, -999.0, -9999.0, 9999.0, 1e30];

/// A mark is beyond so many times the largest size of all other values.
const BEYOND: f64 = 10.0;

/// Values from which on zeros among them are doubted.
pub(crate) const FEWEST_DOUBTED: usize = 30;

/// Zeros are doubted where all other values are above this share of the median of the positive ones.
const FAR_FROM_ZERO: f64 = 0.05;

/// Texts that stand for no reading, in small letters.
const TEXTS: [&str; 18] = [
    "nan", "-nan", "n.a.", "n.a", "n/a", "na", "#n/a", "#na", "-", "--", "none", "null",
    "overflow", "overload", "ovl", "1.#ind", "-1.#ind", "1.#qnan",
];

/// True of a text in place of a number that stands for no reading.
pub(crate) fn is_mark(text: &str) -> bool {
    TEXTS.iter().any(|mark| mark.eq_ignore_ascii_case(text))
}

/// True of one of [`NUMBERS`], in double or single precision.
pub(crate) fn is_mark_number(value: f64) -> bool {
    NUMBERS.iter().any(|mark| is(value, *mark))
}

/// True of a number in double or single precision.
pub(crate) fn is(value: f64, number: f64) -> bool {
    value == number || value == f64::from(number as f32)
}

/// True of one of some marks, in double or single precision.
pub(crate) fn is_among(value: f64, marks: &[f64]) -> bool {
    marks.iter().any(|mark| is(value, *mark))
}

/// Those of [`NUMBERS`] among values that stand for no reading, and another one that does.
pub(crate) fn marks_among(
    values: impl Iterator<Item = f64> + Clone,
    other: Option<f64>,
) -> Vec<f64> {
    let rest = values.clone().filter(|v| !is_mark_number(*v));
    let largest = rest.fold(0.0, |most: f64, v| most.max(v.abs()));
    let is_mark =
        |mark: &f64| mark.abs() > BEYOND * largest && values.clone().any(|v| is(v, *mark));
    NUMBERS.into_iter().filter(is_mark).chain(other).collect()
}

/// How many values are 0 and the least of the positive ones, if all that are not 0 are so far from it that the zeros seem to stand
/// for no reading; `None` also of few values.
pub(crate) fn zeros_among(values: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    let (mut all, mut zeros, mut positive) = (0, 0, Vec::new());
    for value in values.filter(|v| !v.is_nan()) {
        all += 1;
        zeros += usize::from(value == 0.0);
        positive.extend((value > 0.0).then_some(value));
    }
    if zeros == 0 || positive.is_empty() || all < FEWEST_DOUBTED {
        return None;
    }
    let middle = positive.len() / 2;
    let (below, median, _) = positive.select_nth_unstable_by(middle, f64::total_cmp);
    let least = below.iter().copied().fold(*median, f64::min);
    (least > FAR_FROM_ZERO * *median).then_some((zeros, least))
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

    /// The sentence that describes it; `None` if there is none.
    pub fn warning(&self) -> Option<String> {
        let each = self.0.iter();
        let each = listed(each.map(|(mark, n)| format!("{mark} in {}", count(*n, "cell"))));
        (!each.is_empty()).then(|| format!("taken for no reading: {each}"))
    }
}
