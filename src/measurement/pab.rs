//! Text of the gonio-photometers of pab advanced technologies, which `pabopto2bsdf` of Radiance reads: one light direction a
//! file, several where files were put together.
//!
//! ```text
//! #sample_name "brushed steel"
//! #format: theta phi BRDF
//! #intheta 30
//! #inphi 0
//! #upphi 0
//! #colorimetry: CIE-Y
//! #datapoints_in_file 2
//! 28.5 180 1.93
//! 30 180 2.01
//! ```
//!
//! Lines that begin with `#` come before the rows; a colon after their first word may be there or not. Angles are in degrees,
//! polar ones from the normal, azimuths from an axis of the sample: the mirror direction is at `inphi` + 180.
//! `#incident_angle 30 0` stands for both angles of the light, `#upphi` says which azimuth is upwards in a picture and is
//! passed over. A value is f_r in sr⁻¹ (`BRDF`, `BSDF`), or times cos theta of the row (`DSF`); with `CIE-XYZ` there are
//! three, which are read as R, G, B of which grey has X = Y = Z. Rows below the horizon are of light that was transmitted.

use super::scattered::{Rows, numbers, refuse_columns, rgb_of};
use super::{About, Measurement, Readings};
use crate::brdf::Channels;
use crate::error::{excerpt, printable};
use crate::geometry::Direction;
use crate::numeric::XYZ;
use crate::schedule::{Assume, Azimuth, FileError, Quantity, Sequence};
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::io::{self, Write};

/// What `#format: theta phi` may go on with.
const KINDS: [(&str, Quantity); 3] = [
    ("BRDF", Quantity::Brdf),
    ("BSDF", Quantity::Brdf),
    ("DSF", Quantity::BrdfCosine),
];

/// Parts of a degree to which angles are written.
const TIDY: f64 = 1e12;

/// What `#colorimetry` may say.
const COLORIMETRY: [(&str, Channels); 2] =
    [("CIE-Y", Channels::Luminance), ("CIE-XYZ", Channels::Rgb)];

/// The words of a line of the header; the first one without its colon.
fn header(line: &str) -> Option<Vec<&str>> {
    let mut words: Vec<&str> = line.strip_prefix('#')?.split_whitespace().collect();
    let first = words.first_mut()?;
    *first = first.trim_end_matches(':');
    Some(words)
}

/// True if a text begins with such a header.
pub(crate) fn is_pab(text: &str) -> bool {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let mut header = lines.map_while(header);
    header.any(|words| matches!(words[..], ["format", "theta", "phi", _]))
}

/// The header of a light direction.
#[derive(Clone, Default)]
struct Header {
    theta: Option<f64>,
    phi: Option<f64>,
    quantity: Option<Quantity>,
    channels: Option<Channels>,
    /// Rows that it promises, and the line.
    points: Option<(usize, usize)>,
    rows: usize,
}

impl Header {
    /// Takes in a line; false if its key is not read. A promise that stands where another one comes was not kept: its light has
    /// no rows.
    fn see(
        &mut self,
        words: &[&str],
        name: &str,
        line: usize,
        partial: bool,
    ) -> Result<bool, FileError> {
        let refuse = |allowed: &str| {
            let message = format!("#{}: allowed {allowed}", excerpt(&words.join(" ")));
            FileError::on_line(name, line, message)
        };
        let angle = |word: &str, allowed: &str| {
            let angle = word.parse::<f64>().ok().filter(|x| x.is_finite());
            angle.ok_or_else(|| refuse(allowed)).map(Some)
        };
        match *words {
            ["format", "theta", "phi", kind] => {
                let known = KINDS.iter().find(|k| k.0.eq_ignore_ascii_case(kind));
                let known = known.ok_or_else(|| refuse("are BRDF, BSDF and DSF"))?;
                self.quantity = Some(known.1);
            }
            ["format", ..] => return Err(refuse("is theta phi and one of BRDF, BSDF, DSF")),
            ["colorimetry", name] => {
                let mut all = COLORIMETRY.into_iter();
                let known = all.find(|k| k.0.eq_ignore_ascii_case(name));
                let known = known.ok_or_else(|| refuse("are CIE-Y and CIE-XYZ"))?;
                self.channels = Some(known.1);
            }
            ["intheta" | "theta_in", x] => self.theta = angle(x, "is a number of degrees")?,
            ["inphi" | "phi_in", x] => self.phi = angle(x, "is a number of degrees")?,
            ["incident_angle", theta, phi] => {
                let allowed = "are two numbers of degrees";
                (self.theta, self.phi) = (angle(theta, allowed)?, angle(phi, allowed)?);
            }
            ["datapoints_in_file", n] => {
                let points = n.parse().map_err(|_| refuse("is a whole number"))?;
                self.check_rows(name, partial)?;
                self.points = Some((points, line));
            }
            ["spectral", ..] => {
                let allowed = "is text with a column of CIE-Y or three of CIE-XYZ";
                return Err(refuse(allowed));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Checks that there are as many rows as were promised, unless files may be cut.
    fn check_rows(&self, name: &str, partial: bool) -> Result<(), FileError> {
        match self.points {
            Some((points, line)) if points != self.rows && !partial => {
                let message = format!("#datapoints_in_file {points}: {} rows are there", self.rows);
                Err(match self.rows < points {
                    true => FileError::whole(name, message).cut_if(true),
                    false => FileError::on_line(name, line, message),
                })
            }
            _ => Ok(()),
        }
    }
}

/// Reads a text; `name` stands for the file in messages.
///
/// # Errors
/// One sentence with the line: a header that lacks a line or holds an unsupported value, a row with another number of
/// cells, or with one that is no finite number or no reading, another number of rows than promised.
pub fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let conventions = &assume.conventions;
    refuse_columns("pab-opto text", name, conventions, None)?;
    let azimuth = conventions.azimuth.unwrap_or(Azimuth::Sample);
    let mut rows = Rows::new(name);
    let mut header = Header::default();
    let mut all: Option<Channels> = None;
    for (line, content) in (1..).zip(text.lines().map(str::trim)) {
        if content.is_empty() {
            continue;
        }
        if content.starts_with('#') {
            if header.rows > 0 {
                // The next light; what the values are may have been said once.
                header.check_rows(name, conventions.partial)?;
                header = Header {
                    quantity: header.quantity,
                    channels: header.channels,
                    ..Header::default()
                };
            }
            let words = self::header(content).unwrap_or_default();
            if let ["sample_name", rest @ ..] = &words[..] {
                let material = rest.join(" ");
                let material = material.trim_matches('"');
                rows.name_material(line, material, conventions.mixed)?;
            } else if let [key, ..] = words[..]
                && !header.see(&words, name, line, conventions.partial)?
            {
                rows.pass_over(key);
            }
            continue;
        }
        let missing = |what: &str| {
            let message = format!("the line {what} is missing before this row");
            FileError::on_line(name, line, message)
        };
        let theta = header.theta.ok_or_else(|| missing("#intheta"))?;
        let phi = header.phi.ok_or_else(|| missing("#inphi"))?;
        let said = conventions.quantity.or(header.quantity);
        let quantity = said.ok_or_else(|| missing("#format"))?;
        let channels = header.channels.clone().unwrap_or(Channels::Luminance);
        if *all.get_or_insert_with(|| channels.clone()) != channels {
            let message = "its #colorimetry is not that of the rows before; allowed: one for all";
            return Err(FileError::on_line(name, line, message));
        }
        let (words, count) = (content.split_whitespace(), 2 + channels.count());
        let cells = numbers(words, name, line, "the header asks for", &[count])?;
        header.rows += 1;
        let turned = azimuth.about_axis(false, 180.0, [phi, cells[1]]);
        let [light, view] = [[theta, turned[0]], [cells[0], turned[1]]].map(|angles| {
            let [theta, phi] = angles.map(f64::to_radians);
            Direction::from_spherical(theta, phi).vector()
        });
        let values = match &cells[2..] {
            xyz @ [_, _, _] => rgb_of(xyz, conventions.no_reading),
            values => values.to_vec(),
        };
        rows.push(line, [light, view], quantity, &values, &[])?;
    }
    header.check_rows(name, conventions.partial)?;
    rows.readings(all.unwrap_or(Channels::Luminance), assume, true, true)
}

/// Angles (degrees) of a direction as the text has them: 30 is 29.999999999999996 once it went through a sine, and the normal
/// has no azimuth.
pub(crate) fn text_angles(direction: Direction) -> [f64; 2] {
    let tidy = |angle: f64| (angle.to_degrees() * TIDY).round() / TIDY;
    // Without the sign of 0.
    match tidy(direction.theta()) {
        0.0 => [0.0; 2],
        theta => [theta, tidy(direction.phi()) + 0.0],
    }
}

/// The poses with a reading, by the direction of the light, each in the order of the rows.
pub fn by_light(measurement: &Measurement, sequence: Sequence<'_>) -> Vec<Vec<u32>> {
    let mut places = FxHashMap::default();
    let mut lights: Vec<Vec<u32>> = Vec::new();
    for pose in measurement.read_poses(sequence) {
        let light = measurement.schedule.poses[pose].pair.omega_i;
        let place = places.entry(text_angles(light).map(f64::to_bits));
        let place = *place.or_insert_with(|| {
            lights.push(Vec::new());
            lights.len() - 1
        });
        lights[place].push(pose as u32);
    }
    lights
}

/// Writes the readings of a measurement, light after light; poses without a reading, uncertainties and flags have no place in
/// it, and readings by wavelength are an error.
pub(crate) fn write(
    measurement: &Measurement,
    about: &About,
    sequence: Sequence<'_>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let channels = &measurement.channels;
    let Some((colorimetry, _)) = COLORIMETRY.iter().find(|(_, c)| c == channels) else {
        let message = "pab-opto text holds luminance or R, G, B and no wavelengths";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    };
    let material = about.material.as_deref().unwrap_or("unknown");
    let material = printable(material).replace('"', "'");
    let row = |pose: usize| {
        let pair = &measurement.schedule.poses[pose].pair;
        let [light, sensor] = [pair.omega_i, pair.omega_o].map(text_angles);
        Some((light, sensor, measurement.value(pose)?))
    };
    let read = measurement.read_poses(sequence).into_iter();
    let rows: Vec<_> = read.filter_map(row).collect();
    for rows in rows.chunk_by(|a, b| a.0 == b.0) {
        let [theta, phi] = rows[0].0;
        let points = rows.len();
        write!(
            out,
            "#sample_name \"{material}\"\n#format: theta phi BRDF\n#intheta {theta}\n#inphi {phi}\n\
             #upphi 0\n#colorimetry: {colorimetry}\n#datapoints_in_file\t{points}\n"
        )?;
        for (_, [theta, phi], values) in rows {
            write!(out, "{theta} {phi}")?;
            match values {
                rgb @ [_, _, _] => {
                    let xyz = XYZ * DVec3::from_slice(rgb);
                    writeln!(out, " {:e} {:e} {:e}", xyz.x, xyz.y, xyz.z)?;
                }
                values => values.iter().try_for_each(|v| writeln!(out, " {v:e}"))?,
            }
        }
    }
    Ok(())
}
