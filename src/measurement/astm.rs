//! Text after ASTM E1392, as measurements of angle-resolved scatter are exchanged.
//!
//! ```text
//! SAMPLE brushed steel
//! NUM_POINTS 2
//! VARS theta_i,phi_i,theta_s,phi_s,450nm,550nm
//! 0.5236,0,0.4974,3.1416,1.93,1.97
//! 0.5236,0,0.5236,3.1416,2.01,2.05
//! ```
//!
//! Lines of a key and its value end with `VARS`, which names the columns; `NUM_POINTS` may be missing, other keys but the names of sample and instrument are passed
//! over. Angles are in radians unless `--angles deg` is given, polar ones from the normal, azimuths from an axis of the sample; both directions point away
//! from it, so that the mirror direction is at phi_i + π. Without `phi_i` the light is at azimuth 0 of an isotropic sample.
//! Values are f_r in sr⁻¹ in R, G, B, in X, Y, Z (which are read as R, G, B of which grey has X = Y = Z), at
//! wavelengths, or in one column of any other name.

use super::scattered::{Rows, numbers, refuse_columns, rgb_of};
use super::{About, Measurement, Readings};
use crate::brdf::{Channels, Wavelengths};
use crate::error::{excerpt, printable};
use crate::geometry::Direction;
use crate::schedule::{AngleUnit, Assume, Azimuth, FileError, Quantity, Sequence};
use std::f64::consts::PI;
use std::io::{self, Write};

/// The line that names columns.
const VARS: &str = "VARS";

/// The line with the number of rows.
const POINTS: &str = "NUM_POINTS";

/// Columns of angles.
const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_s", "phi_s"];

/// Angle beyond a number of turns (rad) that digits explain.
const SLACK: f64 = 1e-3;

/// Unit at the end of the name of a wavelength.
const NM: &str = "nm";

/// Lines of a header, at most: a text that goes on is another one.
const HEADER: usize = 1000;

/// The rest of a line that begins with a key.
fn after<'t>(line: &'t str, key: &str) -> Option<&'t str> {
    let (first, rest) = line.trim().split_once(char::is_whitespace)?;
    (first == key).then_some(rest.trim())
}

/// True if a text has the header of such a file.
pub(crate) fn is_astm(text: &str) -> bool {
    let mut header = text.lines().take(HEADER);
    let has_angle = |names: &str| names.split(',').any(|name| name.trim() == ANGLES[0]);
    header.any(|line| after(line, VARS).is_some_and(has_angle))
}

struct Columns {
    /// Where the angles are; the azimuth of the light may be missing.
    angles: [Option<usize>; 4],
    values: Vec<usize>,
    channels: Channels,
    /// Whether three values are X, Y, Z.
    is_xyz: bool,
    count: usize,
}

impl Columns {
    fn read(names: &str, name: &str, line: usize) -> Result<Self, FileError> {
        let refuse = |message: String| FileError::on_line(name, line, message);
        let names: Vec<&str> = names.split(',').map(str::trim).collect();
        let angles = ANGLES.map(|angle| names.iter().position(|n| *n == angle));
        for (angle, at) in ANGLES.iter().zip(angles) {
            if at.is_none() && *angle != "phi_i" {
                return Err(refuse(format!("{VARS} lacks {angle}")));
            }
        }
        let is_value = |at: &usize| !angles.contains(&Some(*at));
        let values: Vec<usize> = (0..names.len()).filter(is_value).collect();
        let bands: Vec<&str> = values.iter().map(|at| names[*at]).collect();
        let is_angle = |name: &&&str| ["theta", "phi"].iter().any(|of| name.starts_with(of));
        if let Some(more) = bands.iter().find(is_angle) {
            let what = format!("{VARS} names the angle {}", excerpt(more));
            let all = ANGLES.join(", ");
            return Err(refuse(format!("{what}: allowed are {all}, each once")));
        }
        let nm = |band: &&str| band.strip_suffix(NM)?.trim().parse::<f64>().ok();
        let nm: Option<Vec<f64>> = bands.iter().map(nm).collect();
        let channels = match (&bands[..], nm) {
            ([], _) => return Err(refuse(format!("{VARS} names no column of values"))),
            (_, Some(nm)) => {
                let known = Wavelengths::new(&nm).map_err(|e| refuse(format!("{VARS}: {e}")))?;
                Channels::Wavelengths(known)
            }
            (["R", "G", "B"] | ["Red", "Green", "Blue"] | ["X", "Y", "Z"], _) => Channels::Rgb,
            ([_], _) => Channels::Luminance,
            (several, _) => {
                let message = format!(
                    "{VARS} names the values {}; allowed: R,G,B, or Red,Green,Blue, or X,Y,Z, or wavelengths as 450nm, or one name",
                    excerpt(&several.join(","))
                );
                return Err(refuse(message));
            }
        };
        Ok(Self {
            angles,
            is_xyz: bands == ["X", "Y", "Z"],
            values,
            channels,
            count: names.len(),
        })
    }
}

/// Reads a text; `name` stands for the file in messages.
///
/// # Errors
/// One sentence with the line: no line `VARS`, or one without an angle or with unknown values, a row with another number of
/// cells, or with one that is no finite number or no reading, another number of rows than promised.
pub fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let conventions = &assume.conventions;
    refuse_columns("ASTM text", name, conventions, Some("--angles"))?;
    let unit = conventions.angles.unwrap_or(AngleUnit::Radians);
    let azimuth = conventions.azimuth.unwrap_or(Azimuth::Sample);
    let quantity = conventions.quantity.unwrap_or(Quantity::Brdf);
    let mut lines = (1..).zip(text.lines().map(str::trim));
    let mut points = None;
    let mut rows = Rows::new(name);
    let columns = loop {
        let Some((line, content)) = lines.next() else {
            let message = format!("the line {VARS} is missing, which names the columns");
            return Err(FileError::whole(name, message).cut_if(true));
        };
        let Some((key, value)) = content.split_once(char::is_whitespace) else {
            continue;
        };
        let value = value.trim();
        let unquoted = value.trim_matches('"');
        match key {
            "SAMPLE" | "SAMPLE_NAME" => rows.name_material(line, unquoted, conventions.mixed)?,
            "INSTRUMENT" | "SYSTEM_NAME" => rows.about.instrument = Some(unquoted.into()),
            "WRITTEN_BY" => {}
            POINTS => {
                points = Some(value.parse::<usize>().map_err(|_| {
                    let message = format!("{POINTS} {}: allowed is a whole number", excerpt(value));
                    FileError::on_line(name, line, message)
                })?);
            }
            VARS => break Columns::read(value, name, line)?,
            key => rows.pass_over(key),
        }
    };
    let fixes_sample = columns.angles[1].is_some();
    let mut found = 0;
    let mut values = vec![0.0; columns.values.len()];
    for (line, content) in lines.filter(|(_, content)| !content.is_empty()) {
        let words = content.split([',', ' ', '\t']);
        let words = words.filter(|word| !word.is_empty());
        let asks = format!("{VARS} names");
        let cells = numbers(words, name, line, &asks, &[columns.count])?;
        found += 1;
        let angles = columns.angles.map(|at| at.map_or(0.0, |at| cells[at]));
        let radians = angles.map(|angle| match unit {
            AngleUnit::Radians => angle,
            AngleUnit::Degrees => angle.to_radians(),
        });
        for (at, turns) in [0.5, 2.0, 0.5, 2.0].into_iter().enumerate() {
            if radians[at].abs() > turns * 2.0 * PI + SLACK {
                let message = format!(
                    "{} = {}: allowed are at most {turns} turns, in radians, or in degrees with --angles deg",
                    ANGLES[at], angles[at]
                );
                return Err(FileError::on_line(name, line, message));
            }
        }
        let [theta_i, phi_i, theta_s, phi_s] = radians;
        let turned = azimuth.about_axis(false, PI, [phi_i, phi_s]);
        let light = Direction::from_spherical(theta_i, turned[0]).vector();
        let view = Direction::from_spherical(theta_s, turned[1]).vector();
        for (value, at) in values.iter_mut().zip(&columns.values) {
            *value = cells[*at];
        }
        if columns.is_xyz {
            values = rgb_of(&values, conventions.no_reading);
        }
        rows.push(line, [light, view], quantity, &values, &[])?;
    }
    if let Some(points) = points.filter(|p| *p != found && !conventions.partial) {
        let message = format!("{POINTS} {points}: {found} rows are there");
        return Err(FileError::whole(name, message).cut_if(found < points));
    }
    rows.readings(columns.channels, assume, fixes_sample, true)
}

/// Writes the readings of a measurement; poses without a reading, uncertainties and flags have no place in it.
pub(crate) fn write(
    measurement: &Measurement,
    about: &About,
    sequence: Sequence<'_>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let read = measurement.read_poses(sequence);
    let bands = match &measurement.channels {
        Channels::Luminance => "Y".into(),
        Channels::Rgb => "R,G,B".into(),
        Channels::Wavelengths(w) => {
            let names: Vec<String> = w.nm().iter().map(|nm| format!("{nm}{NM}")).collect();
            names.join(",")
        }
    };
    if let Some(material) = &about.material {
        writeln!(out, "SAMPLE {}", printable(material))?;
    }
    if let Some(instrument) = &about.instrument {
        writeln!(out, "INSTRUMENT {}", printable(instrument))?;
    }
    writeln!(out, "WRITTEN_BY gonio {}", env!("CARGO_PKG_VERSION"))?;
    writeln!(out, "{POINTS} {}", read.len())?;
    writeln!(out, "{VARS} {},{bands}", ANGLES.join(","))?;
    for pose in read {
        let pair = &measurement.schedule.poses[pose].pair;
        let [i, s] = [pair.omega_i, pair.omega_o].map(|d| format!("{:e},{:e}", d.theta(), d.phi()));
        write!(out, "{i},{s}")?;
        for value in measurement.value(pose).into_iter().flatten() {
            write!(out, ",{value:e}")?;
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}
