//! Which readings are left out together.

use super::{Beside, ValidationError};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::numeric::{hashed, wrap_angle};
use crate::parametrization::Parametrization;
use crate::reconstruct::{Still, are_in_plane, still};
use std::fmt;

/// Groups that are left out in turn, at most: each costs a reconstruction.
const MOST: usize = 10;

/// Parts of the directions within sheets, of which one is left out with a sheet. Sheets often share their
/// directions: readings of the next sheet in the same one would hide what lies between directions.
const PARTS: usize = 3;

/// Fewest sheets of which one is left out: without one of two nothing lies between sheets.
const FEWEST: usize = 3;

/// Coordinates that differ by less than this, rad, are those of one place.
const SAME: f64 = 1e-6;

/// Angles within sheets that differ by less than this, rad, are one: 0.06°.
const SAME_DIRECTION: f64 = 1e-3;

/// What is left out at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// Whole sheets of constant incidence, of more than ten sheets every tenth at a time; and of the
    /// others a third of their directions.
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
                let each = if *sheets > MOST { "every 10th" } else { "each" };
                write!(
                    f,
                    "cross-validation, {each} in turn of {sheets} sheets of constant {angle}, with a third of the others"
                )
            }
            Left::Points { sets } => write!(f, "{sets}-fold cross-validation, random sets"),
        }
    }
}

/// What is left out of a reading's sheet, and of the others.
#[derive(Clone, Copy, PartialEq, Eq)]
struct InSheets {
    /// Sheet modulo [`MOST`]; `None`: in no sheet.
    sheet: Option<usize>,
    /// Part of the directions, below [`PARTS`].
    part: usize,
}

/// Readings by the group they are left out with.
pub(super) struct Groups {
    pub left: Left,
    /// Number of groups.
    pub count: usize,
    /// Group of each reading; `None`: it judges nothing.
    pub of: Vec<Option<usize>>,
    /// Number of the place of each reading: the same under the symmetries is the same place.
    place: Vec<usize>,
    /// Of readings in sheets, what is left out with each group; and where each reading is.
    sheets: Option<(Vec<InSheets>, Vec<InSheets>)>,
}

impl Groups {
    /// Groups of the readings of some poses: whole sheets if `sheets` is true, or where they lie in sheets.
    pub(crate) fn new(
        measurement: &Measurement,
        poses: &[usize],
        sheets: Option<bool>,
    ) -> Result<Self, ValidationError> {
        let schedule = &measurement.schedule;
        let pairs: Vec<_> = poses.iter().map(|&i| schedule.poses[i].pair).collect();
        if sheets.is_none() && pairs.len() > 1 && are_in_plane(&pairs) {
            return Err(ValidationError::NothingBeside(Beside::Plane));
        }
        let place = places(&*schedule.parametrization, &pairs);
        let in_sheets = match sheets {
            Some(false) => None,
            _ => by_sheets(&pairs),
        };
        match in_sheets {
            Some((count, of_sensor, at)) if count >= FEWEST => {
                Ok(Self::of_sheets(count, of_sensor, at, place))
            }
            _ if sheets == Some(true) => Err(ValidationError::NoSheets),
            Some((count, of_sensor, _)) => {
                let beside = Beside::Sheets(count, of_sensor);
                Err(ValidationError::NothingBeside(beside))
            }
            _ => Self::of_points(place),
        }
    }

    /// A sheet and a part of the directions at a time.
    fn of_sheets(count: usize, of_sensor: bool, at: Vec<InSheets>, place: Vec<usize>) -> Self {
        let left = Left::Sheets {
            sheets: count,
            of_sensor,
        };
        let sheets = count.min(MOST);
        let group = |n: usize| InSheets {
            sheet: Some(n % sheets),
            part: (n % sheets + n / sheets) % PARTS,
        };
        let groups: Vec<InSheets> = (0..MOST.min(PARTS * sheets)).map(group).collect();
        let group_of = |at: &InSheets| groups.iter().position(|group| group == at);
        Self {
            left,
            count: groups.len(),
            of: at.iter().map(group_of).collect(),
            place,
            sheets: Some((groups, at)),
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
        order.sort_by_key(|&n| (hashed([n as u64]), n));
        let mut group = vec![0; places];
        for (i, n) in order.into_iter().enumerate() {
            group[n] = i % sets;
        }
        Ok(Self {
            left: Left::Points { sets },
            count: sets,
            of: place.iter().map(|&n| Some(group[n])).collect(),
            place,
            sheets: None,
        })
    }

    /// The poses that judge, each with its group, of those that these groups were made of.
    pub(crate) fn judges(&self, poses: &[usize]) -> Vec<(usize, usize)> {
        let of = poses.iter().zip(&self.of);
        of.filter_map(|(&pose, &group)| Some((pose, group?)))
            .collect()
    }

    /// One flag per reading: true if it may be used to predict `group`. What stands at the place of a
    /// reading of the group may not, in whatever sheet it is.
    pub(crate) fn kept(&self, group: usize) -> Vec<bool> {
        let places = self.place.iter().max().map_or(0, |n| n + 1);
        let mut open = vec![true; places];
        for (&place, &of) in self.place.iter().zip(&self.of) {
            if of == Some(group) {
                open[place] = false;
            }
        }
        let mut kept: Vec<bool> = self.place.iter().map(|&place| open[place]).collect();
        if let Some((groups, at)) = &self.sheets {
            let left = groups[group];
            for (kept, at) in kept.iter_mut().zip(at) {
                *kept &= at.sheet != left.sheet && at.part != left.part;
            }
        }
        kept
    }
}

/// The number of the place of each pair; `form` folds pairs that are the same to the material.
fn places(form: &dyn Parametrization, pairs: &[DirectionPair]) -> Vec<usize> {
    let key = |pair: &DirectionPair| form.forward(pair).map(|x| (x / SAME).round() as i64);
    numbers(pairs.iter().map(key))
}

/// Number of sheets, true if it is the sensor that stood still, and where readings are in them, if most lie
/// in sheets.
fn by_sheets(pairs: &[DirectionPair]) -> Option<(usize, bool, Vec<InSheets>)> {
    let Still { of_sensor, sheets } = still(pairs)?;
    // As if it were the light that stood still.
    let as_of_light = |p: &DirectionPair| if of_sensor { p.swapped() } else { *p };
    let pairs: Vec<DirectionPair> = pairs.iter().map(as_of_light).collect();
    let in_no_sheet = |direction: usize| InSheets {
        sheet: None,
        part: (hashed([direction as u64]) % PARTS as u64) as usize,
    };
    let mut at: Vec<InSheets> = directions(&pairs).into_iter().map(in_no_sheet).collect();
    for (n, sheet) in sheets.iter().enumerate() {
        for &i in sheet {
            at[i].sheet = Some(n % MOST);
        }
    }
    Some((sheets.len(), of_sensor, at))
}

/// The number of the second direction of each pair, seen from the azimuth of the first.
fn directions(pairs: &[DirectionPair]) -> Vec<usize> {
    let key = |pair: &DirectionPair| {
        let turn = wrap_angle(pair.omega_o.phi() - pair.omega_i.phi()).abs();
        [pair.omega_o.theta(), turn].map(|x| (x / SAME_DIRECTION).round() as i64)
    };
    numbers(pairs.iter().map(key))
}

/// A number for each thing, by their order: what is left out does not depend on the order of rows.
fn numbers<K: Ord + Copy>(things: impl Iterator<Item = K>) -> Vec<usize> {
    let things: Vec<K> = things.collect();
    let mut known = things.clone();
    known.sort_unstable();
    known.dedup();
    let number = |thing: &K| known.partition_point(|other| other < thing);
    things.iter().map(number).collect()
}
