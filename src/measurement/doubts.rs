//! Sentences that doubt how a table by others was read.

use super::Measurement;
use crate::brdf::marks::{FEWEST_DOUBTED, zeros_among};
use crate::error::{count, count_are};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

/// Elevation up to which a light is at the normal, degrees.
const NORMAL: f64 = 1.0;

/// The sentence that doubts that angles are counted from the normal, where lights are at 90° and none is at the normal.
pub(super) fn seem_elevations(measurement: &Measurement, at_horizon: usize) -> Option<String> {
    let poses = measurement.schedule.poses.iter();
    let lights = poses.map(|pose| pose.pair.omega_i.theta().to_degrees());
    let least = lights.fold(f64::INFINITY, f64::min);
    (least > NORMAL).then(|| {
        format!(
            "in {} the light is at 90°, where it lights nothing, and in none it is at the normal, as if angles were counted \
             from the surface, which --elevation takes into account",
            count(at_horizon, "row")
        )
    })
}

/// The sentence that doubts the unit of uncertainties of which half are larger than nine of ten values.
pub(super) fn seem_percent(measurement: &Measurement) -> Option<String> {
    let details = measurement.details.as_ref()?;
    let n = measurement.channels.count();
    let quantile = |mut all: Vec<f64>, share: f64| {
        all.sort_by(f64::total_cmp);
        all.get((share * all.len() as f64) as usize).copied()
    };
    let read = (0..measurement.outcomes.len()).filter(|&i| measurement.value(i).is_some());
    let read: Vec<usize> = read.flat_map(|i| i * n..(i + 1) * n).collect();
    let values = read.iter().map(|&i| measurement.values[i].abs()).collect();
    let both = read
        .iter()
        .map(|&i| details.type_a[i].hypot(details.type_b[i]));
    let (value, uncertainty) = (quantile(values, 0.9)?, quantile(both.collect(), 0.5)?);
    (uncertainty > value).then(|| {
        format!(
            "half of the uncertainties are {uncertainty} 1/sr and more, and nine of ten values below {value} 1/sr, as if \
             they were in percent, which --uncertainties percent takes into account (--uncertainties value, if they are right)"
        )
    })
}

/// Pairs of elevations at which the largest value is there from which on it is doubted.
const SATURATED: usize = 4;

/// The sentences that doubt the largest value if it is far above half of all and there at several pairs of elevations, and zeros if all
/// other values are far from 0.
pub(super) fn seem_no_readings(measurement: &Measurement) -> Vec<String> {
    let channels = 0..measurement.channels.count();
    let doubts = channels.flat_map(|c| seem_no_readings_of(measurement, c));
    BTreeSet::from_iter(doubts).into_iter().collect()
}

fn seem_no_readings_of(measurement: &Measurement, channel: usize) -> Vec<String> {
    let value = |i: usize| measurement.value(i).map(|v| v[channel]);
    let poses = 0..measurement.outcomes.len();
    let mut values: Vec<f64> = poses.clone().filter_map(value).collect();
    let mut doubts = Vec::new();
    if values.len() < FEWEST_DOUBTED {
        return doubts;
    }
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let middle = values.len() / 2;
    let (_, &mut median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let equal = poses.filter(|i| value(*i) == Some(most));
    let elevations = |i: usize| {
        let pair = &measurement.schedule.poses[i].pair;
        [pair.omega_i, pair.omega_o].map(|d| d.theta().to_degrees().round() as i32)
    };
    let places: BTreeSet<[i32; 2]> = equal.clone().map(elevations).collect();
    if places.len() >= SATURATED && most > 2.0 * median {
        doubts.push(format!(
            "the largest value, {most}, is there {} times, as if the sensor were saturated; --no-reading {most} passes these over",
            equal.count()
        ));
    }
    if let Some((zeros, least)) = zeros_among(values.into_iter()) {
        doubts.push(format!(
            "{} 0 and all others are {least} and more, as if there was no reading; --no-reading 0 passes these over",
            count_are(zeros, "value")
        ));
    }
    doubts
}

/// The sentence that doubts the unit of the angles if those of several poses are no larger than
/// those of the hemisphere in radians.
pub(super) fn seems_radians(measurement: &Measurement) -> Option<String> {
    let poses = &measurement.schedule.poses;
    let polar = poses.iter().flat_map(|pose| {
        let pair = &pose.pair;
        [pair.omega_i.theta(), pair.omega_o.theta()]
    });
    let largest = polar.fold(0.0, f64::max).to_degrees();
    let doubtful = poses.len() > 1 && largest > 0.0 && largest <= FRAC_PI_2;
    doubtful.then(|| {
        format!(
            "no polar angle is above {largest:.2}°, as if radians were read as degrees; allowed: \
             columns that end in _rad, or --angles rad"
        )
    })
}

/// The value that laboratories write where they have none.
const MARK: f64 = -1.0;

/// Rows with values below 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Negative {
    pub rows: usize,
    /// Line of the first of them, from 1; 0 if there is none.
    pub first: usize,
    /// Those that are -1 and nothing else.
    pub marks: usize,
}

impl Negative {
    /// Looks at the values of a row as they are in the file.
    pub(super) fn see(&mut self, line: usize, mut values: impl Iterator<Item = f64> + Clone) {
        if !values.clone().any(|v| v < 0.0) {
            return;
        }
        self.rows += 1;
        if self.first == 0 {
            self.first = line;
        }
        self.marks += usize::from(values.all(|v| v == MARK));
    }

    /// The sentence that warns of them; `None` if there is none.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self { rows, first, marks } = *self;
        let mut text = match rows {
            0 => return None,
            1 => format!("the value of line {first} is below 0 and counts as 0"),
            _ => format!(
                "{} have values below 0, which count as 0, the first in line {first}",
                count(rows, "row")
            ),
        };
        // A single one may be noise.
        if marks > 1 {
            text += &format!(
                "; -1 in {marks} of them may stand for no data, whose cells should be empty"
            );
        }
        Some(text)
    }
}
