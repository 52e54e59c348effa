//! Schedules as CSV and JSON Lines.
//!
//! One row per pose: `index`, the coordinates the set is uniform in (angles in degrees, column ends
//! in `_deg`), then `theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg` of the two arms; no column
//! comes twice, so spherical coordinates have none of their own beside the arms'. With an itinerary
//! rows come in the order of time and go on with `block`, one column per axis (`<name>_deg`), and
//! `move_seconds, exposure_seconds, seconds, at_seconds`; poses that the instrument cannot take are
//! listed in the header with their reasons.
//!
//! The header says what the columns are and what a program needs to know the schedule again:
//! parametrization, warps, symmetry, sample set, number of poses, the axes of a lattice (from which
//! its nodes and poses follow, see [`super::Grid`]), instrument and order, and `schedule_hash`, the
//! BLAKE3 hash of the rows.

use super::format::ScheduleFormat;
use super::table::{Cell, Sheet};
use super::{Itinerary, Schedule};
use crate::error::count;
use crate::parametrization::{Axis, Unit};
use serde_json::{Map, Value, json};
use std::io::{self, Write};

/// The fact that holds the hash of a schedule's rows.
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

/// Writes the poses of a schedule that a sequence names.
///
/// # Errors
/// Whatever `out` reports.
pub fn write_schedule(
    schedule: &Schedule,
    sequence: Sequence<'_>,
    format: ScheduleFormat,
    out: &mut dyn Write,
) -> io::Result<()> {
    let rows = PoseRows::new(schedule, sequence, false);
    let row = |i: usize, cells: &mut Vec<Cell>| rows.fill(i, cells);
    rows.sheet(&row).write(format, SCHEDULE_HASH, out)
}

/// The hash that [`write_schedule`] gives the file: of the values in its rows, in either format.
pub fn schedule_hash(schedule: &Schedule, sequence: Sequence<'_>) -> String {
    let rows = PoseRows::new(schedule, sequence, false);
    let row = |i: usize, cells: &mut Vec<Cell>| rows.fill(i, cells);
    rows.sheet(&row).hash()
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
        if schedule.is_of_others() {
            format!("from a table; coordinates are {} (warp: {}), symmetries {symmetries}", p.name(), p.warp_name())
        } else if !super::all().iter().any(|set| set.kind == schedule.sample_set) {
            format!("chosen by {}; coordinates are {} (warp: {}), symmetries {symmetries}", schedule.sample_set, p.name(), p.warp_name())
        } else {
            format!("{} points, uniform in {} coordinates (warp: {}), each once under the symmetries {symmetries}; {:.4} of the box is below the horizon and left out", schedule.sample_set, p.name(), p.warp_name(), schedule.unphysical_share)
        },
        "frame: right-handed, z = sample normal, azimuths from x (tangent) towards y; all directions point away from the sample".to_owned(),
    ]
}

/// The columns of the two arms.
pub(crate) const ARMS: [&str; 4] = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"];

/// The columns of time.
pub(crate) const TIMES: [&str; 4] = ["move_seconds", "exposure_seconds", "seconds", "at_seconds"];

/// The column of an instrument's axis. Where its name is that of a coordinate, the column says so.
fn axis_column(name: &str, taken: &[String]) -> String {
    let column = format!("{name}_deg");
    if taken.contains(&column) {
        format!("axis_{column}")
    } else {
        column
    }
}

/// The axes with a column of their own: spherical coordinates are the angles of the arms.
pub(crate) fn coordinate_axes(axes: &[Axis]) -> impl Iterator<Item = (usize, &Axis)> {
    let axes = axes.iter().enumerate();
    axes.filter(|(_, axis)| !ARMS.contains(&axis.column().as_str()))
}

/// The rows of a file that has one for each pose.
pub(crate) struct PoseRows<'a> {
    schedule: &'a Schedule,
    sequence: Sequence<'a>,
    /// True if poses without a visit come after those with one; else they are left out.
    all: bool,
    /// True if rows have the angles of the arms alone.
    is_bare: bool,
    axes: Vec<(usize, Axis)>,
}

impl<'a> PoseRows<'a> {
    /// Rows of the poses that a sequence visits, then, if `all`, of those that it cannot.
    pub fn new(schedule: &'a Schedule, sequence: Sequence<'a>, all: bool) -> Self {
        let axes = coordinate_axes(schedule.parametrization.axes());
        Self {
            schedule,
            sequence,
            all,
            is_bare: false,
            axes: axes.map(|(d, axis)| (d, *axis)).collect(),
        }
    }

    /// The same rows without coordinates and symmetries, which nothing said.
    pub fn without_coordinates(self) -> Self {
        Self {
            is_bare: true,
            axes: Vec::new(),
            ..self
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self.sequence {
            Sequence::Generated => self.schedule.poses.len(),
            Sequence::Order(order) => order.len(),
            Sequence::Visits(i) if self.all => i.visits.len() + i.unreachable.len(),
            Sequence::Visits(i) => i.visits.len(),
        }
    }

    /// Number of the pose of a row.
    pub fn pose(&self, row: usize) -> usize {
        match self.sequence {
            Sequence::Generated => row,
            Sequence::Order(order) => order[row] as usize,
            Sequence::Visits(i) => match i.visits.get(row) {
                Some(visit) => visit.pose as usize,
                None => i.unreachable[row - i.visits.len()].0 as usize,
            },
        }
    }

    /// Names and meanings of the columns.
    pub fn columns(&self) -> Vec<(String, String)> {
        let mut columns: Vec<(String, String)> = Vec::new();
        let mut add = |name: &str, meaning: &str| columns.push((name.into(), meaning.into()));
        add("index", "number of the pose in its schedule, from 0");
        for (_, axis) in &self.axes {
            let unit = match axis.unit {
                Unit::Radian => "degrees",
                Unit::One => "no unit",
            };
            let [lo, hi] = axis.range.map(|v| axis.file_value(v));
            add(
                &axis.column(),
                &format!("coordinate in [{lo}, {hi}], {unit}"),
            );
        }
        for (column, meaning) in ARMS.into_iter().zip([
            "angle of the light from the normal, degrees",
            "azimuth of the light, degrees",
            "angle of the sensor from the normal, degrees",
            "azimuth of the sensor, degrees",
        ]) {
            add(column, meaning);
        }
        let Sequence::Visits(itinerary) = self.sequence else {
            return columns;
        };
        let taken: Vec<_> = columns.iter().map(|(name, _)| name.clone()).collect();
        let mut add = |name: &str, meaning: &str| columns.push((name.into(), meaning.into()));
        add(
            "block",
            "number of the run of rows that share a light direction",
        );
        for name in &itinerary.axes {
            let meaning = format!("position of the axis {name}, degrees");
            add(&axis_column(name, &taken), &meaning);
        }
        for (column, meaning) in TIMES.into_iter().zip([
            "travel from the row before, and settling",
            "all exposures of this pose",
            "everything: moving, exposures, overhead, calibration before it",
            "from the start to the middle of the exposures",
        ]) {
            add(column, meaning);
        }
        columns
    }

    /// Appends the cells of a row.
    pub fn fill(&self, row: usize, cells: &mut Vec<Cell>) {
        let number = self.pose(row);
        let pose = &self.schedule.poses[number];
        cells.push(Cell::Number(number as f64));
        for (d, axis) in &self.axes {
            cells.push(Cell::Number(axis.file_value(pose.coords[*d])));
        }
        for arm in [pose.pair.omega_i, pose.pair.omega_o] {
            cells.push(Cell::Number(arm.theta().to_degrees()));
            cells.push(Cell::Number(arm.phi().to_degrees()));
        }
        let Sequence::Visits(itinerary) = self.sequence else {
            return;
        };
        let axes = itinerary.axes.len();
        let Some(visit) = itinerary.visits.get(row) else {
            cells.extend((0..1 + axes + TIMES.len()).map(|_| Cell::Empty));
            return;
        };
        cells.push(Cell::Number(f64::from(visit.block)));
        let positions = visit.positions[..axes].iter();
        cells.extend(positions.map(|p| Cell::Number(p.to_degrees())));
        cells.extend(
            [
                visit.move_seconds,
                visit.exposure_seconds,
                visit.seconds,
                visit.at_seconds,
            ]
            .map(Cell::Number),
        );
    }

    /// Facts from which a program can restore the schedule.
    pub fn facts(&self) -> Map<String, Value> {
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

    fn sheet<'b>(&self, row: &'b dyn Fn(usize, &mut Vec<Cell>)) -> Sheet<'b> {
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
            rows: self.len(),
            row,
        }
    }
}
