//! Light by its scattering order, the number of facets it met: f_r = f₁ + f₂ + f₃₊.

use super::{Brdf, ChannelValues};
use crate::geometry::DirectionPair;
use crate::registry::named;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Number of classes of scattering order: 1, 2, 3 or more.
pub const CLASSES: usize = 3;

named! {
    /// Light that is asked for, by the number of facets it met.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Part {
        /// All of it.
        #[default]
        All = "all",
        /// One facet.
        First = "first",
        /// Two.
        Second = "second",
        /// Three or more.
        Later = "later",
        /// Two or more.
        Multiple = "multiple",
    }
}

impl Part {
    /// The parts of one class each, in the order of the classes.
    pub const CLASSES: [Part; CLASSES] = [Part::First, Part::Second, Part::Later];

    /// The part of one class that light of scattering order `order`, 1 or more, is in.
    pub fn from_order(order: usize) -> Part {
        Self::CLASSES[order.clamp(1, CLASSES) - 1]
    }

    /// The classes that it is made of.
    pub fn classes(self) -> std::ops::Range<usize> {
        match self {
            Part::All => 0..CLASSES,
            Part::First => 0..1,
            Part::Second => 1..2,
            Part::Later => 2..CLASSES,
            Part::Multiple => 1..CLASSES,
        }
    }

    /// True if light of scattering order `order`, 1 or more, is in it.
    pub fn holds(self, order: usize) -> bool {
        self.classes().contains(&(order.clamp(1, CLASSES) - 1))
    }

    /// Highest scattering order that has to be followed for it.
    pub fn last(self) -> usize {
        match self.classes().end {
            CLASSES => usize::MAX,
            last => last,
        }
    }
}

/// As a config writes it.
impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Standard errors of luminance, sr⁻¹: of each class and of their sum, since errors of classes that one path makes are not
/// independent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SplitErrors(pub [f64; CLASSES + 1]);

impl SplitErrors {
    fn with(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| of(self.0[i], other.0[i])))
    }

    /// Those of a sum with something that has nothing to do with it.
    pub fn hypot(&self, other: &Self) -> Self {
        self.with(other, f64::hypot)
    }

    /// Those of a sum with something that errs as this does.
    pub fn plus(&self, other: &Self) -> Self {
        self.with(other, |a, b| a + b)
    }

    /// Those of a share.
    pub fn times(&self, share: f64) -> Self {
        self.with(self, |e, _| share * e)
    }

    /// That of a part; of two classes as if they had nothing to do with each other.
    pub fn error(&self, part: Part) -> f64 {
        let of_classes = self.0[part.classes()].iter();
        match part {
            Part::All => self.0[CLASSES],
            _ => of_classes.fold(0.0, |all, e| all.hypot(*e)),
        }
    }
}

/// f_r of one pair by scattering order, and its standard errors: sr⁻¹, without the cosine.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Value of each class and channel.
    pub value: [ChannelValues; CLASSES],
    /// Errors that more paths make smaller.
    pub transport: SplitErrors,
    /// Errors that only more surface makes smaller: of its kind this one is a draw. 0 of what is an average over all.
    pub realisation: SplitErrors,
}

impl Split {
    /// No light, in so many channels.
    pub fn dark(channels: usize) -> Self {
        Self {
            value: [(); CLASSES].map(|()| ChannelValues::from_elem(0.0, channels)),
            transport: SplitErrors::default(),
            realisation: SplitErrors::default(),
        }
    }

    /// Values of a part, one a channel.
    pub fn part(&self, part: Part) -> ChannelValues {
        let mut classes = self.value[part.classes()].iter();
        let mut sum = classes.next().cloned().unwrap_or_default();
        for class in classes {
            sum.iter_mut().zip(class).for_each(|(s, v)| *s += v);
        }
        sum
    }

    /// This split with the classes outside `part` set to 0.
    pub fn only(mut self, part: Part) -> Self {
        let others = (0..CLASSES).filter(|class| !part.classes().contains(class));
        others.clone().for_each(|class| self.value[class].fill(0.0));
        for errors in [&mut self.transport, &mut self.realisation] {
            others.clone().for_each(|class| errors.0[class] = 0.0);
            errors.0[CLASSES] = errors.error(part);
        }
        self
    }

    /// Standard error of the luminance of a part, both kinds together.
    pub fn error(&self, part: Part) -> f64 {
        let kinds = [self.transport, self.realisation];
        let [a, b] = kinds.map(|errors| errors.error(part));
        a.hypot(b)
    }
}

/// A path of light through the facets of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPath {
    /// Where it came from and where it left to.
    pub pair: DirectionPair,
    /// Scattering order, 1 or more.
    pub order: usize,
    /// Luminance that is left of it, 1 of a path that lost nothing.
    pub light: f64,
}

/// Where a part of what a value is off by comes from: pairs that name the same one are off together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// Paths, or facets, that many pairs have in common.
    Common(u64),
    /// Paths of a pair, and of those that mean the same by a symmetry.
    Pair(u64),
}

/// A BRDF that separates light by scattering order.
pub trait SplitBrdf: Brdf {
    /// f_r of a pair by scattering order, in the channels of the BRDF; 0 of classes that the material does not ask for.
    fn split(&self, pair: &DirectionPair) -> Split;

    /// Follows `count` paths of block `block` and hands over those that leave. Light comes from the hemisphere as its cosine, so
    /// the mean of [`LightPath::light`] over all `count` paths whose pairs are in a set S is
    ///
    /// (1/π) ∫_S f_r cos θ_i cos θ_o dω_i dω_o.
    ///
    /// Blocks are independent of each other, and a block is the same whenever it is asked for.
    fn paths(&self, block: u64, count: usize, each: &mut dyn FnMut(LightPath));

    /// True if each value is the mean of random paths of its own pair: it takes milliseconds, and its noise is not that of the next.
    fn follows_pairs(&self) -> bool;

    /// What the luminance of a pair may be off by (sr⁻¹, standard errors), in parts that have nothing to do with each other.
    fn noise(&self, pair: &DirectionPair, each: &mut dyn FnMut(Source, f64));

    /// Surfaces of a kind that it averages over, of which block b is followed on number b modulo this; 0 of what is an average over
    /// all of a kind, or the only one.
    fn surfaces(&self) -> usize {
        0
    }
}

/// Standard errors of N weighted sums of luminance, from the [noise](SplitBrdf::noise) of their pairs.
pub(crate) struct SumErrors<const N: usize> {
    /// What each source shifts the sums by.
    shifts: FxHashMap<Source, [f64; N]>,
}

impl<const N: usize> SumErrors<N> {
    pub(crate) fn new() -> Self {
        Self {
            shifts: FxHashMap::default(),
        }
    }

    /// Adds a pair by its weights in the sums.
    pub(crate) fn add(&mut self, brdf: &dyn SplitBrdf, pair: &DirectionPair, weights: [f64; N]) {
        brdf.noise(pair, &mut |source, error| {
            let sums = self.shifts.entry(source).or_insert([0.0; N]);
            let parts = sums.iter_mut().zip(weights);
            parts.for_each(|(sum, w)| *sum += w * error);
        });
    }

    /// Of all that was added: by what many pairs have in common, and by the paths of single pairs.
    pub(crate) fn errors(&self) -> [[f64; N]; 2] {
        // In one order, so that sums round the same.
        let mut all: Vec<_> = self.shifts.iter().collect();
        all.sort_unstable_by_key(|(source, _)| **source);
        let mut squares = [[0.0; N]; 2];
        for (source, shifts) in all {
            let of = usize::from(matches!(source, Source::Pair(_)));
            let parts = squares[of].iter_mut().zip(shifts);
            parts.for_each(|(sum, s)| *sum += s * s);
        }
        squares.map(|of| of.map(f64::sqrt))
    }
}
