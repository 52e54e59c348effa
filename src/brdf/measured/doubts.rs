//! Values of a table that stand for no reading, and what is doubtful about the others.

use crate::brdf::marks::{Marks, is, marks_among, zeros_among};
use crate::error::count_are;
use crate::geometry::DirectionPair;

/// Remarks of a [`Brdf`](crate::brdf::Brdf) with a field of [`Doubts`] on its file.
macro_rules! of_doubts {
    ($field:ident) => {
        fn remarks(&self) -> Vec<String> {
            self.$field.remarks()
        }

        fn cells_without_reading(&self) -> usize {
            self.$field.marks.count()
        }
    };
}
pub(super) use of_doubts;

/// Cosine of the elevation up to which a zero is doubted: 80°. Nearer to the horizon nothing is left of a signal.
const GRAZING: f64 = 0.173_648;

/// A value of a pair, if it is one of those that are doubted: a zero is not near the horizon.
pub(super) fn doubted(value: f64, pair: impl Fn() -> Option<DirectionPair>) -> Option<f64> {
    let is_high = |p: DirectionPair| {
        let directions = [p.omega_i, p.omega_o];
        directions.iter().all(|d| d.cos_theta() >= GRAZING)
    };
    (value != 0.0 || pair().is_some_and(is_high)).then_some(value)
}

/// What was peculiar about the values of a table as they are in its file.
#[derive(Clone, Debug, Default)]
pub(super) struct Doubts {
    /// What stood for no reading.
    pub marks: Marks,
    /// Values below 0.
    negative: usize,
    /// Zeros, and the least of all others, where these are far from 0.
    zeros: Option<(usize, f64)>,
    /// True if one value of a pair stands for R, G and B.
    pub is_grey: bool,
}

impl Doubts {
    /// Counts a number that stands for no reading.
    pub(crate) fn see(&mut self, value: f64) {
        self.marks.see(&match value.abs() < 1e16 {
            true => value.to_string(),
            false => format!("{value:e}"),
        });
    }

    /// Makes NaN of numbers that stand for no reading, `no_reading` among them, and of what is infinite, and counts these and
    /// values below 0. NaN is counted unless there was a text in its place, which has been counted.
    pub(crate) fn take<T>(values: &mut [T], texts: Marks, no_reading: Option<f64>) -> Self
    where
        T: Copy + Into<f64> + From<f32>,
    {
        let finite = values
            .iter()
            .map(|v| (*v).into())
            .filter(|v: &f64| v.is_finite());
        let marks = marks_among(finite, no_reading);
        let unseen = texts.count() == 0;
        let mut doubts = Self {
            marks: texts,
            ..Self::default()
        };
        for slot in values {
            let value: f64 = (*slot).into();
            if let Some(mark) = marks.iter().find(|mark| is(value, **mark)) {
                doubts.see(*mark);
                *slot = T::from(f32::NAN);
            } else if value.is_infinite() || value.is_nan() && unseen {
                doubts.see(value);
                *slot = T::from(f32::NAN);
            } else {
                doubts.negative += usize::from(value < 0.0);
            }
        }
        doubts
    }

    /// Adds those of further values of the table.
    pub(crate) fn add(&mut self, more: Self) {
        self.marks.add(more.marks);
        self.negative += more.negative;
    }

    /// Doubts zeros among values, of which none is one that was below 0.
    pub(crate) fn look_for_zeros(&mut self, values: impl Iterator<Item = f64>) {
        self.zeros = zeros_among(values);
    }

    /// The sentences about them.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let negative = (self.negative > 0).then(|| {
            let values = count_are(self.negative, "value");
            format!("{values} below 0: taken as 0")
        });
        let zeros = self.zeros.map(|(zeros, least)| {
            format!(
                "{} 0 and all others are {least} and more, as if there was no reading; no_reading = 0 passes these over \
                 (gonio convert: --no-reading 0)",
                count_are(zeros, "value")
            )
        });
        let grey = self
            .is_grey
            .then(|| "luminance alone: R, G and B are alike".to_owned());
        let marks = self.marks.warning().into_iter();
        marks.chain(negative).chain(zeros).chain(grey).collect()
    }
}
