//! Light by the number of facets it met.

use crate::brdf::{ChannelValues, Channels};
use serde::{Deserialize, Serialize};
use smallvec::smallvec;
use std::fmt;

/// Classes of light: one facet, two, three or more.
pub const CLASSES: usize = 3;

/// Light that is asked for, by the number of facets it met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// All of it.
    #[default]
    All,
    /// One facet.
    First,
    /// Two.
    Second,
    /// Three or more.
    Later,
}

impl Part {
    /// The classes that it is made of.
    pub fn classes(self) -> std::ops::Range<usize> {
        match self {
            Part::All => 0..CLASSES,
            Part::First => 0..1,
            Part::Second => 1..2,
            Part::Later => 2..CLASSES,
        }
    }
}

/// As a config writes it.
impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Part::All => "all",
            Part::First => "first",
            Part::Second => "second",
            Part::Later => "later",
        })
    }
}

/// f_r of one pair by the number of facets, and what it may be off by: sr⁻¹, without the cosine.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Value of each class and channel.
    pub value: [ChannelValues; CLASSES],
    /// Standard error of the luminance of each class.
    pub error: [f64; CLASSES],
    /// Standard error of the luminance of their sum; errors of classes that one path makes are not independent.
    pub error_of_sum: f64,
}

/// Paths that are averaged: what each of them gave to the classes.
#[derive(Clone, Debug)]
pub struct Bounces {
    sums: [ChannelValues; CLASSES],
    /// Of the path that is followed.
    path: [ChannelValues; CLASSES],
    /// Means and sums of squared deviations of luminance: of the classes, and of their sum.
    moments: [[f64; 2]; CLASSES + 1],
    paths: usize,
}

impl Bounces {
    /// No paths.
    pub fn new(channels: usize) -> Self {
        let none = || [(); CLASSES].map(|()| smallvec![0.0; channels]);
        Self {
            sums: none(),
            path: none(),
            moments: [[0.0; 2]; CLASSES + 1],
            paths: 0,
        }
    }

    /// Adds what light of `bounces` facets (from 1 on) brings, one value a channel, to the path that is followed.
    #[inline]
    pub fn add(&mut self, bounces: usize, values: impl Iterator<Item = f64>) {
        let class = &mut self.path[bounces.min(CLASSES) - 1];
        for (sum, value) in class.iter_mut().zip(values) {
            *sum += value;
        }
    }

    /// Ends the path; `luminance` is that of the channels.
    pub fn end(&mut self, luminance: impl Fn(&[f64]) -> f64) {
        self.paths += 1;
        let n = self.paths as f64;
        let mut whole = 0.0;
        for class in 0..=CLASSES {
            let value = match self.path.get_mut(class) {
                Some(values) => {
                    let value = luminance(values);
                    for (sum, value) in self.sums[class].iter_mut().zip(values.iter_mut()) {
                        *sum += std::mem::take(value);
                    }
                    whole += value;
                    value
                }
                None => whole,
            };
            // Welford's: squares of values cancel where the mean is large.
            let [mean, square] = &mut self.moments[class];
            let step = value - *mean;
            *mean += step / n;
            *square += step * (value - *mean);
        }
    }

    /// Means and standard errors; an error of one path is infinite where it brought light.
    pub fn split(&self) -> Split {
        let n = self.paths as f64;
        let error = |[mean, square]: [f64; 2]| match self.paths {
            0 | 1 if mean == 0.0 => 0.0,
            0 | 1 => f64::INFINITY,
            _ => (square / (n * (n - 1.0))).sqrt(),
        };
        let [a, b, c, sum] = self.moments.map(error);
        Split {
            value: self
                .sums
                .clone()
                .map(|sums| sums.iter().map(|s| s / n.max(1.0)).collect()),
            error: [a, b, c],
            error_of_sum: sum,
        }
    }
}

/// Channels in which light is followed where a scene is in `channels`: R, G, B for luminance if something has a colour, since
/// the product of luminances is not the luminance of the product.
pub(super) fn followed(channels: &Channels, distinct: usize) -> Channels {
    match channels {
        Channels::Luminance if distinct > 1 => Channels::Rgb,
        other => other.clone(),
    }
}
