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
            csv.write_record(columns.iter().map(|(name, _)| name))
                .map_err(io_error)?;
            for (index, pose) in schedule.poses.iter().enumerate() {
                let values = row(schedule, pose);
                let index = std::iter::once(index.to_string());
                csv.write_record(index.chain(values.iter().map(f64::to_string)))
                    .map_err(io_error)?;
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

/// The system's error behind one of the CSV writer, whose own conversion hides its kind.
fn io_error(e: csv::Error) -> io::Error {
    match e.into_kind() {
        csv::ErrorKind::Io(e) => e,
        other => io::Error::other(format!("{other:?}")),
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
        "angle of the light from the normal, degrees",
        "azimuth of the light, degrees",
        "angle of the sensor from the normal, degrees",
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

#[cfg(test)]
mod tests {
    use super::super::{Grid, SampleSet, SobolSet};
    use super::*;
    use crate::geometry::{DirectionPair, Symmetry};
    use crate::parametrization::{self, WarpName};
    use std::collections::BTreeMap;

    /// Schedules with plain, warped, 3-D and 4-D columns.
    fn schedules() -> Vec<Schedule> {
        let mut schedules = Vec::new();
        for symmetry in [Symmetry::FULL, Symmetry::NONE] {
            for entry in parametrization::all() {
                let p = entry.form(symmetry);
                schedules.push(Grid::default().plan(&p, 40, 1).unwrap());
                schedules.push(SobolSet::default().plan(&p, 9, 1).unwrap());
            }
        }
        let entry = parametrization::find("half-difference").unwrap();
        let warps = BTreeMap::from([("theta_h".to_owned(), WarpName::Merl)]);
        let p = entry.warped(Symmetry::FULL, &warps).unwrap();
        schedules.push(Grid::default().plan(&p, 40, 1).unwrap());
        schedules
    }

    fn text(schedule: &Schedule, format: ScheduleFormat) -> String {
        let mut bytes = Vec::new();
        write_schedule(schedule, format, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// Angle columns in degrees against the pose they were written from.
    /// `ulps` is what the reader may lose.
    fn check_row(schedule: &Schedule, index: usize, ulps: f64, value: impl Fn(&str) -> f64) {
        let pose = &schedule.poses[index];
        assert_eq!(value("index"), index as f64);
        let angles = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"];
        let [ti, pi, to, po] = angles.map(|name| value(name).to_radians());
        let back = DirectionPair::from_spherical(ti, pi, to, po);
        for (a, b) in [
            (back.omega_i, pose.pair.omega_i),
            (back.omega_o, pose.pair.omega_o),
        ] {
            // Degrees and back round the angles once each.
            assert!((a.vector() - b.vector()).length() < 2e-15);
        }
        for (axis, c) in schedule.parametrization.axes().iter().zip(pose.coords) {
            let written = value(&axis.column());
            let expected = if axis.column().ends_with("_deg") {
                c.to_degrees()
            } else {
                c
            };
            // The coordinates exactly, unless an arm's column stands for them.
            let slack = if ARMS.contains(&axis.column().as_str()) {
                1e-13
            } else {
                ulps * f64::EPSILON * expected.abs()
            };
            assert!((written - expected).abs() <= slack, "{}", axis.column());
        }
    }

    #[test]
    fn csv_reads_back_with_comments_skipped() {
        for schedule in schedules() {
            let text = text(&schedule, ScheduleFormat::Csv);
            let comments: Vec<_> = text.lines().take_while(|l| l.starts_with("# ")).collect();
            assert!(
                text.lines()
                    .skip(comments.len())
                    .all(|l| !l.starts_with('#'))
            );
            let mut reader = csv::ReaderBuilder::new()
                .comment(Some(b'#'))
                .from_reader(text.as_bytes());
            let header = reader.headers().unwrap().clone();
            for name in &header {
                // Every column is explained.
                let start = format!("# {name}: ");
                assert_eq!(
                    comments.iter().filter(|c| c.starts_with(&start)).count(),
                    1,
                    "{name}"
                );
            }
            for arm in ARMS {
                assert!(header.iter().any(|h| h == arm), "{arm}");
            }
            assert_eq!(
                header
                    .iter()
                    .collect::<std::collections::HashSet<_>>()
                    .len(),
                header.len()
            );
            let mut rows = 0;
            for record in reader.records() {
                let record = record.unwrap();
                check_row(&schedule, rows, 0.0, |name| {
                    let column = header.iter().position(|h| h == name).expect(name);
                    record[column].parse().unwrap()
                });
                rows += 1;
            }
            assert_eq!(rows, schedule.poses.len());
        }
    }

    #[test]
    fn every_json_line_parses_and_the_first_is_the_header() {
        for schedule in schedules() {
            let text = text(&schedule, ScheduleFormat::JsonLines);
            let mut lines = text
                .lines()
                .map(|l| serde_json::from_str::<Value>(l).unwrap());
            let header = lines.next().unwrap()["header"].clone();
            assert_eq!(header["poses"], schedule.poses.len());
            assert_eq!(header["parametrization"], schedule.parametrization.name());
            assert_eq!(header["warp"], schedule.parametrization.warp_name());
            let symmetry: Symmetry = serde_json::from_value(header["symmetry"].clone()).unwrap();
            assert_eq!(symmetry, schedule.parametrization.symmetry());
            let columns: Vec<_> = header["columns"].as_object().unwrap().keys().collect();
            let mut rows = 0;
            for line in lines {
                let object = line.as_object().unwrap();
                assert_eq!(object.keys().collect::<Vec<_>>(), columns);
                // The text is exact; serde_json, without `float_roundtrip`, reads it to an ulp.
                check_row(&schedule, rows, 1.0, |name| object[name].as_f64().unwrap());
                rows += 1;
            }
            assert_eq!(rows, schedule.poses.len());
        }
    }

    #[test]
    fn degrees_and_units_are_in_the_column_names() {
        let names = |name: &str, warps: &[(&str, WarpName)]| {
            let warps = warps.iter().map(|&(a, w)| (a.to_owned(), w)).collect();
            let entry = parametrization::find(name).unwrap();
            let p = entry.warped(Symmetry::FULL, &warps).unwrap();
            let schedule = SobolSet::default().plan(&p, 1, 0).unwrap();
            let names: Vec<_> = columns(&schedule)
                .into_iter()
                .map(|(name, _)| name)
                .collect();
            names[1..].join(" ")
        };
        assert_eq!(
            names("half-difference", &[]),
            "theta_h_deg theta_d_deg phi_d_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
        assert_eq!(
            names("half-difference", &[("theta_h", WarpName::Merl)]),
            "theta_h_merl theta_d_deg phi_d_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
        assert_eq!(
            names(
                "hybrid",
                &[("k", WarpName::Arcsine), ("h_bar", WarpName::SquareRoot)]
            ),
            "h_bar_square_root k_arcsine_deg delta_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
        assert_eq!(
            names("spherical", &[]),
            "delta_phi_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
    }

    #[test]
    fn the_header_says_what_was_folded_and_left_out() {
        let entry = parametrization::find("orthographic").unwrap();
        let schedule = Grid::default()
            .plan(&entry.form(Symmetry::FULL), 200, 1)
            .unwrap();
        let about = description(&schedule).join("\n");
        let poses = schedule.poses.len();
        let share = format!("{:.4}", schedule.unphysical_share);
        for part in [
            &format!("{poses} poses"),
            "isotropic, reciprocal, bilateral",
            &share,
        ] {
            assert!(about.contains(part), "{about}");
        }
        let schedule = Grid::default()
            .plan(&entry.form(Symmetry::NONE), 200, 1)
            .unwrap();
        assert!(description(&schedule).join("\n").contains("folded: none"));
    }

    #[test]
    fn file_names_choose_the_format() {
        let of = |name: &str| ScheduleFormat::of(std::path::Path::new(name));
        assert_eq!(of("a/poses.csv"), Some(ScheduleFormat::Csv));
        assert_eq!(of("poses.CSV"), Some(ScheduleFormat::Csv));
        assert_eq!(of("poses.jsonl"), Some(ScheduleFormat::JsonLines));
        assert_eq!(of("poses.ndjson"), Some(ScheduleFormat::JsonLines));
        assert_eq!(of("poses.json"), None);
        assert_eq!(of("csv"), None);
    }
}
