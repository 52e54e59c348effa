//! Schedules as CSV and JSON Lines.
//!
//! One row per pose: `index`, the coordinates the set is uniform in (angles in degrees, column ends
//! in `_deg`), then `theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg` of the two arms; no column
//! comes twice, so spherical coordinates have none of their own beside the arms'. With an itinerary
//! rows come in the order of time and go on with `block`, with `stop` of an instrument that takes pictures, one column per axis (`<name>_deg`), and
//! `move_seconds, exposure_seconds, seconds, at_seconds`; poses that the instrument cannot take are
//! listed in the header with their reasons.
//!
//! The header says what the columns are and what a program needs to know the schedule again:
//! parametrization, warps, symmetry, sample set, number of poses, the axes of a lattice (from which
//! its nodes and poses follow, see [`super::Grid`]), instrument and order, and `schedule_hash`, the
//! BLAKE3 hash of the rows.

use super::table::{Column, Part, ScheduleFormat, Sheet};
use super::{Directions, Itinerary, LayoutSet, Pictures, Schedule, Visit};
use crate::error::count;
use crate::geometry::DirectionPair;
use crate::parametrization::{Axis, Unit};
use serde_json::{Map, Value, json};
use std::io::{self, Write};

pub(crate) const SCHEDULE_HASH: &str = "schedule_hash";

/// The poses of a file, and the order of its rows.
#[derive(Clone, Copy, Debug)]
pub enum Sequence<'a> {
    /// Poses in the order of their generation.
    Generated,
    /// These poses, by number, in this order.
    Order(&'a [u32]),
    /// The visits of a machine.
    Visits(&'a Itinerary),
}

impl<'a> From<Option<&'a Itinerary>> for Sequence<'a> {
    fn from(itinerary: Option<&'a Itinerary>) -> Self {
        itinerary.map_or(Self::Generated, Self::Visits)
    }
}

impl Sequence<'_> {
    /// The numbers of its poses, of so many; then, if `all`, of those that a machine cannot take.
    pub(crate) fn poses(self, number: usize, all: bool) -> Vec<usize> {
        match self {
            Self::Generated => (0..number).collect(),
            Self::Order(order) => order.iter().map(|&pose| pose as usize).collect(),
            Self::Visits(i) => {
                let lost = i.unreachable.iter().filter(|_| all).map(|lost| lost.0);
                let poses = i.visits.iter().map(|visit| visit.pose).chain(lost);
                poses.map(|pose| pose as usize).collect()
            }
        }
    }
}

/// Writes the poses of a schedule that a sequence names.
pub fn write_schedule(
    schedule: &Schedule,
    sequence: Sequence<'_>,
    format: ScheduleFormat,
    out: &mut dyn Write,
) -> io::Result<()> {
    let rows = PoseRows::new(schedule, sequence, false);
    rows.sheet().write(format, SCHEDULE_HASH, out)
}

/// The hash that [`write_schedule`] gives the file: of the values in its rows, in either format.
pub fn schedule_hash(schedule: &Schedule, sequence: Sequence<'_>) -> String {
    PoseRows::new(schedule, sequence, false).sheet().hash()
}

/// Name of the sample set of poses from a table.
pub(crate) const FROM_FILE: &str = "file";

/// Description of the file, one sentence per line.
pub(crate) fn description(schedule: &Schedule, what: &str) -> Vec<String> {
    let p = &schedule.parametrization;
    let s = p.symmetry();
    let symmetries = match s.names().join(", ") {
        none if none.is_empty() => "none".to_owned(),
        names => names,
    };
    vec![
        format!("gonio {} {what}: {} above the horizon", env!("CARGO_PKG_VERSION"), count(schedule.poses.len(), "pose")),
        if schedule.sample_set == LayoutSet::KIND {
            format!("of a published layout; coordinates are {} (warp: {}), each once under the symmetries {symmetries}", p.name(), p.warp_name())
        } else if schedule.sample_set == FROM_FILE {
            format!("from a table; coordinates are {} (warp: {}), symmetries {symmetries}", p.name(), p.warp_name())
        } else if !is_uniform(&schedule.sample_set) {
            format!("chosen by {}; coordinates are {} (warp: {}), symmetries {symmetries}", schedule.sample_set, p.name(), p.warp_name())
        } else {
            format!("{} points, uniform in {} coordinates (warp: {}), each once under the symmetries {symmetries}; {:.4} of the box is below the horizon and left out", schedule.sample_set, p.name(), p.warp_name(), schedule.unphysical_share)
        },
        "frame: right-handed, z = sample normal, azimuths from x (tangent) towards y; all directions point away from the sample".to_owned(),
    ]
}

/// True if the poses of a sample set of this name are uniform in the coordinates that they are planned in.
fn is_uniform(name: &str) -> bool {
    let unguided = [Directions::KIND, LayoutSet::KIND, Pictures::KIND];
    !unguided.contains(&name) && super::all().iter().any(|set| set.kind == name)
}

pub(crate) const ARMS: [&str; 4] = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"];

pub(crate) const TIMES: [&str; 4] = ["move_seconds", "exposure_seconds", "seconds", "at_seconds"];

/// The axes with a column of their own: spherical coordinates are the angles of the arms.
pub(crate) fn coordinate_axes(axes: &[Axis]) -> impl Iterator<Item = (usize, &Axis)> {
    let axes = axes.iter().enumerate();
    axes.filter(|(_, axis)| !ARMS.contains(&axis.column().as_str()))
}

/// The rows of a file that has one for each pose.
pub(crate) struct PoseRows<'a> {
    schedule: &'a Schedule,
    sequence: Sequence<'a>,
    /// Numbers of the poses of the rows.
    pub poses: Vec<usize>,
    /// True if rows have the angles of the arms alone, for a schedule that states no coordinates and symmetries.
    pub is_bare: bool,
}

impl<'a> PoseRows<'a> {
    /// Rows of the poses that a sequence visits, then, if `all`, of those that it cannot.
    pub(crate) fn new(schedule: &'a Schedule, sequence: Sequence<'a>, all: bool) -> Self {
        Self {
            schedule,
            sequence,
            poses: sequence.poses(schedule.poses.len(), all),
            is_bare: false,
        }
    }

    pub(crate) fn columns(&self) -> Vec<Column<'_>> {
        let pose = |row: usize| &self.schedule.poses[self.poses[row]];
        let number = "number of the pose in its schedule, from 0";
        let mut columns = vec![Column::new("index", number, |row| self.poses[row] as f64)];
        let axes = coordinate_axes(self.schedule.parametrization.axes());
        for (d, axis) in axes.filter(|_| !self.is_bare) {
            let unit = match axis.unit {
                Unit::Radian => "degrees",
                Unit::One => "no unit",
            };
            let [lo, hi] = axis.range.map(|v| axis.file_value(v));
            let meaning = format!("coordinate in [{lo}, {hi}], {unit}");
            let value = move |row| axis.file_value(pose(row).coords[d]);
            columns.push(Column::new(axis.column(), meaning, value));
        }
        let arms: [Part<DirectionPair>; 4] = [
            ("angle of the light from the normal", |p| p.omega_i.theta()),
            ("azimuth of the light", |p| p.omega_i.phi()),
            ("angle of the sensor from the normal", |p| p.omega_o.theta()),
            ("azimuth of the sensor", |p| p.omega_o.phi()),
        ];
        for (name, (meaning, angle)) in ARMS.into_iter().zip(arms) {
            let degrees = move |row| angle(&pose(row).pair).to_degrees();
            columns.push(Column::new(name, format!("{meaning}, degrees"), degrees));
        }
        let Sequence::Visits(itinerary) = self.sequence else {
            return columns;
        };
        let visit = |row: usize| itinerary.visits.get(row);
        let taken: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
        let block = "number of the run of rows that share a light direction";
        columns.push(Column::new("block", block, move |row| {
            Some(f64::from(visit(row)?.block))
        }));
        if itinerary.takes_pictures() {
            let stop = "number of the stop: rows that share one are read in one picture";
            columns.push(Column::new("stop", stop, move |row| {
                Some(f64::from(visit(row)?.stop))
            }));
        }
        for (k, name) in itinerary.axes.iter().enumerate() {
            let meaning = format!("position of the axis {name}, degrees");
            let position = move |row| Some(visit(row)?.positions[k].to_degrees());
            let mut column = format!("{name}_deg");
            // Its name may be that of a coordinate.
            if taken.contains(&column) {
                column.insert_str(0, "axis_");
            }
            columns.push(Column::new(column, meaning, position));
        }
        let times: [Part<Visit>; 4] = [
            ("travel from the row before, and settling", |v| {
                v.move_seconds
            }),
            ("all exposures of this pose", |v| v.exposure_seconds),
            (
                "everything: moving, exposures, overhead, calibration before it",
                |v| v.seconds,
            ),
            ("from the start to the middle of the exposures", |v| {
                v.at_seconds
            }),
        ];
        for (name, (meaning, seconds)) in TIMES.into_iter().zip(times) {
            columns.push(Column::new(name, meaning, move |row| {
                visit(row).map(seconds)
            }));
        }
        columns
    }

    /// Facts from which a program can restore the schedule.
    pub(crate) fn facts(&self) -> Map<String, Value> {
        let schedule = self.schedule;
        let p = &schedule.parametrization;
        let mut facts = Map::new();
        let mut add = |key: &str, value: Value| facts.insert(key.into(), value);
        if !self.is_bare {
            add("parametrization", json!(p.name()));
            add("warp", json!(p.warp_name()));
            add("symmetry", json!(p.symmetry()));
        }
        add("sample_set", json!(schedule.sample_set));
        add("poses", json!(schedule.poses.len()));
        add("unphysical_share", json!(schedule.unphysical_share));
        if let Some(method) = &schedule.assumes {
            add("assumes", json!(method));
        }
        if let Some(lattice) = &schedule.lattice {
            add("lattice", json!(lattice.axes));
        }
        if let Sequence::Visits(itinerary) = self.sequence {
            add("instrument", json!(itinerary.instrument));
            add("axes", json!(itinerary.axes));
            add("order", json!(itinerary.order));
            let unreachable = itinerary.unreachable.iter();
            let unreachable: Vec<_> = unreachable.map(|(i, why)| (i, why.label())).collect();
            add("unreachable", json!(unreachable));
        }
        facts
    }

    fn sheet(&self) -> Sheet<'_> {
        let mut about = description(self.schedule, "schedule");
        if let Sequence::Visits(i) = self.sequence {
            about.push(format!(
                "rows in the order of time ({}) of {}: {:.0} s; {} cannot be measured, see unreachable",
                i.order,
                i.instrument,
                i.seconds(),
                count(i.unreachable.len(), "pose"),
            ));
        }
        if let Sequence::Order(order) = self.sequence {
            about.push(format!("rows: {} of these poses", order.len()));
        }
        Sheet {
            about,
            facts: self.facts(),
            columns: self.columns(),
            rows: self.poses.len(),
        }
    }
}
