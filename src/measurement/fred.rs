//! Tabulated BSDFs of FRED (Photon Engineering), as its scatter models import them.
//!
//! ```text
//! type bsdf_data
//! format angles=deg bsdf=value scale=1
//! 10 0
//! 0 0 0.2924
//! 5 0 0.3200
//! ```
//!
//! A row of two numbers is a direction of the light (polar angle and azimuth), the rows of three below it are directions of the sensor
//! with a value, f_r in sr⁻¹ times `scale`. Azimuths count from the mirror direction.

use super::Readings;
use super::scattered::{Rows, numbers, refuse_columns};
use crate::brdf::Channels;
use crate::brdf::marks::is_mark_number;
use crate::error::excerpt;
use crate::geometry::Direction;
use crate::schedule::{AngleUnit, Assume, Azimuth, FileError, Quantity};

/// How the first line begins, in small letters.
const TYPE: &str = "type bsdf_data";

/// What the line `format` may say.
const ALLOWED: &str = "angles=deg or angles=rad, bsdf=value and scale=NUMBER";

/// True if a text begins so.
pub(crate) fn is_fred(text: &str) -> bool {
    let words: Vec<&str> = text.split_whitespace().take(2).collect();
    words.join(" ").eq_ignore_ascii_case(TYPE)
}

/// Reads a text; `name` stands for the file in messages.
///
/// # Errors
/// One sentence with the line: a format that is not known, a row before the direction of its light, or one of another number of cells
/// or with one that is no finite number or no reading.
pub fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let conventions = &assume.conventions;
    refuse_columns("FRED's text", name, conventions, None)?;
    let azimuth = conventions.azimuth.unwrap_or(Azimuth::Mirror);
    let quantity = conventions.quantity.unwrap_or(Quantity::Brdf);
    let (mut unit, mut scale) = (AngleUnit::Degrees, 1.0);
    let mut rows = Rows::new(name);
    let mut light: Option<[f64; 2]> = None;
    let mut turns = false;
    for (line, content) in (1..).zip(text.lines().map(str::trim)).skip(1) {
        if content.is_empty() || content.starts_with(['#', '!', '%']) {
            continue;
        }
        if let Some(format) = content.strip_prefix("format") {
            for word in format.split_whitespace() {
                let scaled = word.strip_prefix("scale=").map(str::parse::<f64>);
                match (word.to_ascii_lowercase().as_str(), scaled) {
                    ("angles=deg", _) => unit = AngleUnit::Degrees,
                    ("angles=rad", _) => unit = AngleUnit::Radians,
                    ("bsdf=value", _) => {}
                    (_, Some(Ok(x))) if x.is_finite() && x > 0.0 => scale = x,
                    _ => {
                        let message = format!("format {}: allowed are {ALLOWED}", excerpt(word));
                        return Err(FileError::on_line(name, line, message));
                    }
                }
            }
            continue;
        }
        let asks = "a light has 2, a reading 3, not";
        let cells = numbers(content.split_whitespace(), name, line, asks, &[2, 3])?;
        let [theta, phi] = [cells[0], cells[1]].map(|angle| unit.degrees(angle));
        let Some(&value) = cells.get(2) else {
            turns |= light.is_some_and(|[_, before]| before != phi);
            light = Some([theta, phi]);
            continue;
        };
        let Some([theta_i, phi_i]) = light else {
            let message =
                "a row of two numbers is missing before this one: the direction of its light";
            return Err(FileError::on_line(name, line, message));
        };
        let [phi_i, phi_o] = azimuth.about_axis(false, 180.0, [phi_i, phi]);
        let directions = [[theta_i, phi_i], [theta, phi_o]].map(|angles| {
            let [theta, phi] = angles.map(f64::to_radians);
            Direction::from_spherical(theta, phi).vector()
        });
        // What stands for no reading has no scale.
        let is_mark = is_mark_number(value) || conventions.no_reading == Some(value);
        let value = if is_mark { value } else { value * scale };
        rows.push(line, directions, quantity, &[value], &[])?;
    }
    rows.readings(Channels::Luminance, assume, turns, true)
}
