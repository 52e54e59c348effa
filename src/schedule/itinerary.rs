//! Itineraries: the times and durations of a machine's visits to the poses of a schedule, and the
//! poses it cannot take. Plain data, which an instrument fills in.

use serde::{Deserialize, Serialize};

/// The most axes an instrument has.
pub const MAX_AXES: usize = 4;

/// Positions of the axes, rad, in the order of the instrument's preset; those it lacks are 0.
pub type Positions = [f64; MAX_AXES];

/// Reason why a pose cannot be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Unreachable {
    /// The light is further from the normal than its arm goes.
    LightElevation,
    /// The sensor is further from the normal than its arm goes.
    SensorElevation,
    /// The arms are so close that one hides the sample from the other.
    Occluded,
    /// No solution has this axis (and all others) within its range.
    AxisRange(u8),
    /// The two bodies of this pair of the limits would touch.
    Collision(u8),
}

impl Unreachable {
    /// Names of the reasons, as files and reports write them.
    pub(crate) const NAMES: [&str; 5] = [
        "light-elevation",
        "sensor-elevation",
        "occluded",
        "axis-range",
        "collision",
    ];

    /// The reason's name, without the number of its axis or pair.
    pub fn name(self) -> &'static str {
        let [light, sensor, occluded, axis, collision] = Self::NAMES;
        match self {
            Self::LightElevation => light,
            Self::SensorElevation => sensor,
            Self::Occluded => occluded,
            Self::AxisRange(_) => axis,
            Self::Collision(_) => collision,
        }
    }

    /// The reason as rows of files write it: the name, and the number of its axis or pair behind a
    /// colon.
    pub fn label(self) -> String {
        let name = self.name();
        match self {
            Self::AxisRange(number) | Self::Collision(number) => format!("{name}:{number}"),
            Self::LightElevation | Self::SensorElevation | Self::Occluded => name.into(),
        }
    }

    /// The reason of a text written by `label`.
    pub fn of_label(label: &str) -> Option<Self> {
        let (name, number) = match label.split_once(':') {
            Some((name, number)) => (name, Some(number.parse().ok()?)),
            None => (label, None),
        };
        let all = match number {
            Some(number) => vec![Self::AxisRange(number), Self::Collision(number)],
            None => vec![Self::LightElevation, Self::SensorElevation, Self::Occluded],
        };
        all.into_iter().find(|reason| reason.name() == name)
    }
}

/// A stop of a machine at a pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// Number of the pose in its schedule.
    pub pose: u32,
    /// Number of the run of visits that share a light direction, from 0; of a picture that of its first pose.
    pub block: u32,
    /// Number of the stop, from 0. An instrument that takes pictures reads several poses at one.
    pub stop: u32,
    /// Positions of the axes, rad.
    pub positions: Positions,
    /// Travel from the visit before (or from rest at 0) and settling, s.
    pub move_seconds: f64,
    /// All exposures of this stop, s; 0 of a further pose of a picture, as all times are.
    pub exposure_seconds: f64,
    /// Total: moving, exposures, overhead, and a calibration if one comes before this pose, s.
    pub seconds: f64,
    /// From the start of the schedule to the middle of the exposures, s.
    pub at_seconds: f64,
    /// From the end of the last calibration (or the start) to the middle of the exposures, s.
    pub since_calibration_seconds: f64,
}

/// The visits of one machine to the poses of one schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Itinerary {
    /// Name of the instrument.
    pub instrument: String,
    /// Names of its axes.
    pub axes: Vec<String>,
    /// Name of the order.
    pub order: String,
    /// Visits in the order of time; every reachable pose once.
    pub visits: Vec<Visit>,
    /// The poses that are left out, by number, with reasons.
    pub unreachable: Vec<(u32, Unreachable)>,
}

impl Itinerary {
    /// Seconds from start to end.
    pub fn seconds(&self) -> f64 {
        // A sum of nothing would be −0.
        self.visits.iter().fold(0.0, |sum, v| sum + v.seconds)
    }

    /// Number of stops: visits, unless an instrument takes pictures.
    pub fn stops(&self) -> usize {
        self.visits.last().map_or(0, |last| last.stop as usize + 1)
    }

    /// True if several poses share a stop.
    pub fn takes_pictures(&self) -> bool {
        self.stops() < self.visits.len()
    }

    /// The lowest number of a pose at each stop.
    pub(crate) fn first_poses(&self) -> Vec<u32> {
        let mut firsts = vec![u32::MAX; self.stops()];
        for visit in &self.visits {
            let first = &mut firsts[visit.stop as usize];
            *first = visit.pose.min(*first);
        }
        firsts
    }

    /// Share of the poses that can be measured, in [0, 1]; 1 if there are none.
    pub(crate) fn reachable(&self) -> f64 {
        let all = self.visits.len() + self.unreachable.len();
        if all == 0 {
            return 1.0;
        }
        self.visits.len() as f64 / all as f64
    }

    /// Number of poses each reason keeps out, `reason:count` joined by `;`; empty if none does.
    pub(crate) fn reasons_text(&self) -> String {
        let counts = Unreachable::NAMES.into_iter().zip(self.reasons());
        let counts = counts.filter(|(_, n)| *n > 0);
        let parts: Vec<_> = counts.map(|(name, n)| format!("{name}:{n}")).collect();
        parts.join(";")
    }

    /// Number of poses that each reason keeps out, in the order of [`Unreachable::NAMES`].
    pub(crate) fn reasons(&self) -> [usize; Unreachable::NAMES.len()] {
        Unreachable::NAMES.map(|name| {
            let same = |(_, reason): &&(u32, Unreachable)| reason.name() == name;
            self.unreachable.iter().filter(same).count()
        })
    }
}
