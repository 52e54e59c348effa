//! What readings say of a pair: whether it lies between them, beside them, or far from all.
//!
//! It is a fact of the poses, not of the method: every reconstruction of the same readings has the same
//! coverage. Errors of a reconstruction are always those of the whole; a file may leave out what is not
//! covered, see [`Fill`].

use super::ReconstructError;
use super::cloud::Search;
use super::coordinates::ReconstructionCoordinates;
use super::interpolant::{Readings, present};
use super::scattered::Embedded;
use super::transform::Transform;
use crate::brdf::{Brdf, Presence, of_wrapped};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::registry::named;
use rayon::prelude::*;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU64, Ordering};

named! {
    /// How a pair lies to the readings, in the order of confidence.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Coverage {
        /// Readings surround it, or the next one is as near as readings are to each other, and within a tenth
        /// of the range of the coordinates.
        Interpolated = "interpolated",
        /// Readings lie on one side of it.
        Extrapolated = "extrapolated",
        /// No reading is near: farther than a third of the range of the coordinates (30° of 90°).
        Unknown = "unknown",
    }
}

named! {
    /// What a file has where readings do not surround a pair.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Fill {
        /// No data.
        None = "none",
        /// The nearest reading.
        Nearest = "nearest",
        /// What the method makes of it.
        #[default]
        Extrapolate = "extrapolate",
    }
}

/// Readings that are looked for: enough to surround a pair in 4-D.
const NEIGHBOURS: NonZeroUsize = NonZeroUsize::MIN.saturating_add(15);

/// Distance from all readings beyond which a pair is unknown, in units of the range of coordinates.
const FAR: f64 = 1.0 / 3.0;

/// Distance within which a reading speaks for a pair, however far apart readings are: 9° of 90°.
const NEAR: f64 = 0.1;

/// Pairs of a parallel task, at least.
const CHUNK: usize = 256;

/// The poses of some readings.
trait Places: Send + Sync {
    fn coverage(&self, pair: &DirectionPair, search: &mut Search) -> Coverage;

    /// The value of the reading nearest to a pair.
    fn nearest_value(&self, pair: &DirectionPair) -> &[f64];
}

impl<const K: usize> Places for Embedded<K> {
    fn coverage(&self, pair: &DirectionPair, search: &mut Search) -> Coverage {
        // A few readings may be surrounded by their own images, which is no evidence of what is between.
        let fills_space = self.find(pair, NEIGHBOURS, search);
        let found = &search.found;
        let surrounded = fills_space && found.index.len() >= NEIGHBOURS.get();
        let nearest = found.distance2[0].sqrt();
        if nearest > FAR {
            Coverage::Unknown
        } else if surrounded || nearest <= self.cloud.gap(found.index[0]).min(NEAR) {
            Coverage::Interpolated
        } else {
            Coverage::Extrapolated
        }
    }

    fn nearest_value(&self, pair: &DirectionPair) -> &[f64] {
        self.cloud.value(self.cloud.nearest(&self.place(pair)))
    }
}

/// What the readings of a measurement cover.
pub struct Cover(Box<dyn Places>);

impl Cover {
    /// Of the poses of `measurement` that have a reading.
    ///
    /// # Errors
    /// If there is none.
    pub fn of(measurement: &Measurement) -> Result<Self, ReconstructError> {
        let present = present(measurement);
        let readings = Readings::new(measurement, &present, None);
        // Distances are those on the bench: no axis counts more than the other.
        let own = ReconstructionCoordinates {
            coordinates: None,
            stretch: Some(1.0),
        };
        let transform = Transform::Linear;
        Ok(Self(
            match measurement.schedule.parametrization.axes().len() {
                3 => Box::new(Embedded::<3>::new("coverage", &readings, &own, transform)?),
                _ => Box::new(Embedded::<4>::new("coverage", &readings, &own, transform)?),
            },
        ))
    }

    /// The coverage of a pair.
    pub fn coverage(&self, pair: &DirectionPair) -> Coverage {
        self.0.coverage(pair, &mut Search::default())
    }

    /// The coverage of many pairs, in parallel.
    pub fn coverages(&self, pairs: &[DirectionPair]) -> Vec<Coverage> {
        let pairs = pairs.par_iter().with_min_len(CHUNK);
        pairs
            .map_init(Search::default, |search, pair| {
                self.0.coverage(pair, search)
            })
            .collect()
    }
}

/// A reconstruction with the coverage of its readings, as a BRDF for files. It counts what it is asked.
pub struct Covered<'a> {
    brdf: &'a dyn Brdf,
    cover: Cover,
    fill: Fill,
    /// Pairs above the horizon that were asked for, by [`Coverage::ALL`].
    asked: [AtomicU64; 3],
}

impl<'a> Covered<'a> {
    /// `brdf` made of the readings of `measurement`, filled as `fill` defines.
    ///
    /// # Errors
    /// If there is no reading.
    pub fn new(
        brdf: &'a dyn Brdf,
        measurement: &Measurement,
        fill: Fill,
    ) -> Result<Self, ReconstructError> {
        Ok(Self {
            brdf,
            cover: Cover::of(measurement)?,
            fill,
            asked: Default::default(),
        })
    }

    /// Forgets what was asked for.
    pub(crate) fn forget(&self) {
        for n in &self.asked {
            n.store(0, Ordering::Relaxed);
        }
    }

    /// Shares of the pairs above the horizon that were asked for since the start, or since
    /// [`forget`](Self::forget), by [`Coverage::ALL`]; 0 before any was.
    pub(crate) fn shares(&self) -> [f64; 3] {
        let asked = self.asked.each_ref().map(|n| n.load(Ordering::Relaxed));
        let all = asked.iter().sum::<u64>().max(1);
        asked.map(|n| n as f64 / all as f64)
    }
}

impl Brdf for Covered<'_> {
    of_wrapped!(brdf);

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let mut presence = [Presence::Present];
        self.eval_batch(std::slice::from_ref(pair), out, &mut presence);
        presence[0]
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        self.brdf.eval_batch(pairs, out, presence);
        self.fill(pairs, out, presence);
    }

    fn eval_row(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        self.brdf.eval_row(pairs, out, presence);
        self.fill(pairs, out, presence);
    }
}

impl Covered<'_> {
    /// Puts in what a file is to have where readings do not surround a pair, and counts what was asked for.
    fn fill(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let width = self.channels().count();
        let (mut asked, mut search) = ([0; 3], Search::default());
        for ((pair, out), presence) in pairs.iter().zip(out.chunks_mut(width)).zip(presence) {
            if !pair.is_above_horizon() {
                continue;
            }
            let coverage = self.cover.0.coverage(pair, &mut search);
            asked[coverage as usize] += 1;
            if coverage == Coverage::Interpolated {
                continue;
            }
            match self.fill {
                Fill::None => *presence = Presence::Missing,
                Fill::Nearest => out.copy_from_slice(self.cover.0.nearest_value(pair)),
                Fill::Extrapolate => {}
            }
        }
        for (all, n) in self.asked.iter().zip(asked) {
            all.fetch_add(n, Ordering::Relaxed);
        }
    }
}
