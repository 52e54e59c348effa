//! Which readings are left out together.

use super::ValidationError;
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::parametrization::Parametrization;
use crate::reconstruct::{IN_SHEETS, incidences};
use rustc_hash::FxHashMap;
use std::fmt;

/// Groups that are left out in turn, at most: each costs a reconstruction.
const MOST: usize = 10;

/// Coordinates that differ by less than this, rad, are those of one place.
const SAME: f64 = 1e-6;

/// What is left out at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// Whole sheets of constant incidence; of more than ten sheets every tenth at a time.
    Sheets {
        /// Number of sheets.
        sheets: usize,
        /// True if it is the sensor that stood still.
        of_sensor: bool,
    },
    /// One of up to ten sets of readings that are picked at random.
    Points {
        /// Number of sets.
        sets: usize,
    },
}

impl fmt::Display for Left {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Left::Sheets { sheets, of_sensor } => {
                let angle = if *of_sensor { "theta_o" } else { "theta_i" };
                let part = sheets.div_ceil(MOST);
                let each = match part {
                    1 => "each in turn".to_owned(),
                    _ => format!("every {MOST}th in turn"),
                };
                write!(f, "{each} of {sheets} sheets of constant {angle} left out")
            }
            Left::Points { sets } => write!(f, "each in turn of {sets} random sets left out"),
        }
    }
}

/// Readings by the group they are left out with.
pub(super) struct Groups {
    pub left: Left,
    /// Group of each reading; `None`: it is never left out.
    pub of: Vec<Option<usize>>,
    /// Number of the place of each reading: the same under the symmetries is the same place.
    pub place: Vec<usize>,
}

impl Groups {
    /// Groups of the readings of some poses: whole sheets if `sheets` says so, or where they lie in sheets.
    pub fn new(
        measurement: &Measurement,
        poses: &[usize],
        sheets: Option<bool>,
    ) -> Result<Self, ValidationError> {
        let schedule = &measurement.schedule;
        let pairs: Vec<_> = poses.iter().map(|&i| schedule.poses[i].pair).collect();
        let place = places(&*schedule.parametrization, &pairs);
        let in_sheets = match sheets {
            Some(false) => None,
            _ => by_sheets(&pairs),
        };
        match in_sheets {
            Some((sheets, of)) => Ok(Self {
                left: sheets,
                of: of.into_iter().map(|n| n.map(|n| n % MOST)).collect(),
                place,
            }),
            None if sheets == Some(true) => Err(ValidationError::NoSheets),
            None => Self::of_points(place),
        }
    }

    /// Random groups of places.
    fn of_points(place: Vec<usize>) -> Result<Self, ValidationError> {
        let places = place.iter().max().map_or(0, |n| n + 1);
        if places < 2 {
            return Err(ValidationError::TooFew { places });
        }
        let sets = MOST.min(places);
        let mut order: Vec<usize> = (0..places).collect();
        order.sort_by_key(|&n| (shuffled(n), n));
        let mut group = vec![0; places];
        for (i, n) in order.into_iter().enumerate() {
            group[n] = i % sets;
        }
        Ok(Self {
            left: Left::Points { sets },
            of: place.iter().map(|&n| Some(group[n])).collect(),
            place,
        })
    }

    /// Number of groups.
    pub fn count(&self) -> usize {
        match self.left {
            Left::Sheets { sheets, .. } => sheets.min(MOST),
            Left::Points { sets } => sets,
        }
    }

    /// The poses that are left out once, each with its group, of those that these groups were made of.
    pub fn judges(&self, poses: &[usize]) -> Vec<(usize, usize)> {
        let of = poses.iter().zip(&self.of);
        of.filter_map(|(&pose, &group)| Some((pose, group?)))
            .collect()
    }

    /// One flag per reading: true if it may be used to predict `group`. What stands at the place of a
    /// reading of the group may not, in whatever sheet it is.
    pub fn kept(&self, group: usize) -> Vec<bool> {
        let places = self.place.iter().max().map_or(0, |n| n + 1);
        let mut open = vec![true; places];
        for (&place, &of) in self.place.iter().zip(&self.of) {
            if of == Some(group) {
                open[place] = false;
            }
        }
        self.place.iter().map(|&place| open[place]).collect()
    }
}

/// A number for each number that looks random (the finaliser of SplitMix64).
fn shuffled(n: usize) -> u64 {
    let mut x = (n as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The number of the place of each pair; `form` folds pairs that are the same to the material.
fn places(form: &dyn Parametrization, pairs: &[DirectionPair]) -> Vec<usize> {
    let mut known = FxHashMap::default();
    let key = |pair: &DirectionPair| form.forward(pair).map(|x| (x / SAME).round() as i64);
    let number = |pair| {
        let next = known.len();
        *known.entry(key(pair)).or_insert(next)
    };
    pairs.iter().map(number).collect()
}

/// Readings by their sheet, if most lie in two sheets or more.
fn by_sheets(pairs: &[DirectionPair]) -> Option<(Left, Vec<Option<usize>>)> {
    let side = |of_sensor: bool| {
        let theta = |p: &DirectionPair| match of_sensor {
            true => p.omega_o.theta(),
            false => p.omega_i.theta(),
        };
        let sheets = incidences(&pairs.iter().map(theta).collect::<Vec<_>>());
        let taken: usize = sheets.iter().map(Vec::len).sum();
        let mut of = vec![None; pairs.len()];
        for (n, sheet) in sheets.iter().enumerate() {
            for &i in sheet {
                of[i] = Some(n);
            }
        }
        let sheets = sheets.len();
        let enough = sheets >= 2 && taken as f64 >= IN_SHEETS * pairs.len() as f64;
        enough.then_some((Left::Sheets { sheets, of_sensor }, of, sheets))
    };
    // The one that stood still is the one with fewer sheets.
    let sides = [false, true].into_iter().filter_map(side);
    let (left, of, _) = sides.min_by_key(|(_, _, sheets)| *sheets)?;
    Some((left, of))
}
