//! Schedules as CSV and JSON Lines.
//!
//! One row a pose: `index`, the coordinates the set is uniform in (angles in degrees, column ends
//! in `_deg`), then `theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg` of the two arms; no column
//! comes twice, so spherical coordinates have none of their own beside the arms'. A CSV begins with comment lines (`#`) that say what the columns are; a JSON Lines file begins with one
//! `{"header": …}` object that does.

use super::{Pose, Schedule};
use crate::parametrization::{Axis, Unit};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::io::{self, Write};

/// File formats of a schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScheduleFormat {
    /// Comma-separated values with a commented header.
    Csv,
    /// One JSON object a line, the first one the header.
    JsonLines,
}

impl ScheduleFormat {
    /// The format a file name asks for: `.csv`, `.jsonl` or `.ndjson`.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "jsonl" | "ndjson" => Some(Self::JsonLines),
            _ => None,
        }
    }

    /// The extension of file names.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::JsonLines => "jsonl",
        }
    }
}

/// Writes a schedule.
///
/// # Errors
/// Whatever `out` reports.
pub fn write_schedule(
    schedule: &Schedule,
    format: ScheduleFormat,
    out: &mut dyn Write,
) -> io::Result<()> {
    let columns = columns(schedule);
    match format {
        ScheduleFormat::Csv => {
            for line in description(schedule) {
                writeln!(out, "# {line}")?;
            }
            for (name, meaning) in &columns {
                writeln!(out, "# {name}: {meaning}")?;
            }
            let mut csv = csv::Writer::from_writer(out);
            csv.write_record(columns.iter().map(|(name, _)| name))?;
            for (index, pose) in schedule.poses.iter().enumerate() {
                let values = row(schedule, pose);
                let index = std::iter::once(index.to_string());
                csv.write_record(index.chain(values.iter().map(f64::to_string)))?;
            }
            csv.flush()
        }
        ScheduleFormat::JsonLines => {
            let meanings: Map<String, Value> = columns
                .iter()
                .map(|(name, meaning)| (name.clone(), json!(meaning)))
                .collect();
            let header = json!({ "header": {
                "about": description(schedule),
                "parametrization": schedule.parametrization.name(),
                "warp": schedule.parametrization.warp_name(),
                "symmetry": schedule.parametrization.symmetry(),
                "sample_set": schedule.sample_set,
                "poses": schedule.poses.len(),
                "columns": meanings,
            }});
            writeln!(out, "{header}")?;
            for (index, pose) in schedule.poses.iter().enumerate() {
                let mut object = Map::new();
                object.insert("index".into(), json!(index));
                let names = columns[1..].iter().map(|(name, _)| name.clone());
                object.extend(names.zip(row(schedule, pose).into_iter().map(Value::from)));
                writeln!(out, "{}", Value::Object(object))?;
            }
            out.flush()
        }
    }
}

/// What the file is, a sentence a line.
fn description(schedule: &Schedule) -> Vec<String> {
    let p = &schedule.parametrization;
    let s = p.symmetry();
    let symmetries: Vec<_> = [
        (s.isotropic, "isotropic"),
        (s.reciprocal, "reciprocal"),
        (s.bilateral, "bilateral"),
    ]
    .into_iter()
    .filter_map(|(has, name)| has.then_some(name))
    .collect();
    let symmetries = if symmetries.is_empty() {
        "none".to_owned()
    } else {
        symmetries.join(", ")
    };
    vec![
        format!("gonio {} schedule: {} poses, distinct and above the horizon", env!("CARGO_PKG_VERSION"), schedule.poses.len()),
        format!("{} points, uniform in {} coordinates (warp: {})", schedule.sample_set, p.name(), p.warp_name()),
        format!("symmetries folded: {symmetries}; {:.4} of the box is below the horizon and left out", schedule.unphysical_share),
        "frame: right-handed, z = sample normal, azimuths from x (tangent) towards y; all directions point away from the sample".to_owned(),
    ]
}

/// The columns of the two arms.
const ARMS: [&str; 4] = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"];

/// The axes with a column of their own: spherical coordinates are the angles of the arms.
fn coordinate_axes(schedule: &Schedule) -> impl Iterator<Item = (usize, &Axis)> {
    let axes = schedule.parametrization.axes().iter().enumerate();
    axes.filter(|(_, axis)| !ARMS.contains(&axis.column().as_str()))
}

/// Column names and what they mean.
fn columns(schedule: &Schedule) -> Vec<(String, String)> {
    let mut columns = vec![("index".to_owned(), "order of measuring, from 0".to_owned())];
    for (_, axis) in coordinate_axes(schedule) {
        let unit = match axis.unit {
            Unit::Radian => "degrees",
            Unit::One => "no unit",
        };
        let [lo, hi] = axis.range.map(|v| axis.file_value(v));
        columns.push((axis.column(), format!("coordinate in [{lo}, {hi}], {unit}")));
    }
    for (column, meaning) in ARMS.into_iter().zip([
        "elevation of the light from the normal, degrees",
        "azimuth of the light, degrees",
        "elevation of the sensor from the normal, degrees",
        "azimuth of the sensor, degrees",
    ]) {
        columns.push((column.to_owned(), meaning.to_owned()));
    }
    columns
}

/// The values after `index`.
fn row(schedule: &Schedule, pose: &Pose) -> Vec<f64> {
    let mut values: Vec<f64> = coordinate_axes(schedule)
        .map(|(d, axis)| axis.file_value(pose.coords[d]))
        .collect();
    for arm in [pose.pair.omega_i, pose.pair.omega_o] {
        values.push(arm.theta().to_degrees());
        values.push(arm.phi().to_degrees());
    }
    values
}
