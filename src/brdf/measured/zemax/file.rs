//! The text: keys and lists of angles in degrees, then blocks of values, a row an azimuth. Lines that begin with `#` are
//! comments.
//!
//! ```text
//! Source Measured
//! Symmetry PlaneSymmetrical
//! SpectralContent Monochrome
//! ScatterType BRDF
//! SampleRotation 1
//! 0
//! AngleOfIncidence 2
//! 0 30
//! ScatterAzimuth 3
//! 0 90 180
//! ScatterRadial 2
//! 0 90
//!
//! Monochrome
//! DataBegin
//! TIS 0.5
//! 0.16 0.16
//! …
//! DataEnd
//! ```
//!
//! `PlaneSymmetrical` has azimuths from 0° to 180° and stands for both sides of the plane of incidence, `Asymmetrical` goes
//! round. With `XYZ` there are blocks `TristimulusX`, `TristimulusY` and `TristimulusZ`; here they stand for R, G, B of
//! which grey has X = Y = Z. `TIS`, the albedo of the incidence, is passed over. What stands for no
//! reading is one ([`crate::brdf::Marks`]): a text in place of a value, or a number as -999 far outside all others. Values below 0 count as 0. Both are counted.

use super::{Angles, Zemax};
use crate::brdf::Channels;
use crate::brdf::marks::{Marks, is_mark};
use crate::brdf::measured::TableError;
use crate::brdf::measured::doubts::{Doubts, doubted};
use crate::error::excerpt;
use crate::files;
use crate::numeric::{LARGEST_READING, XYZ};
use glam::DVec3;
use std::f64::consts::PI;
use std::io;
use std::path::Path;

fn no_access(e: io::Error) -> TableError {
    TableError::Io("no access to this Zemax table", e)
}

/// Words of a text, with their lines.
struct Words<'t> {
    lines: std::iter::Enumerate<std::str::Lines<'t>>,
    line: usize,
    words: std::str::SplitWhitespace<'t>,
}

impl<'t> Words<'t> {
    fn new(text: &'t str) -> Self {
        Self {
            lines: text.lines().enumerate(),
            line: 0,
            words: "".split_whitespace(),
        }
    }

    fn next(&mut self, before: &'static str) -> Result<&'t str, TableError> {
        loop {
            if let Some(word) = self.words.next() {
                return Ok(word);
            }
            let Some((i, line)) = self.lines.next() else {
                let message = format!("the text ends before {before}");
                return Err(TableError::Malformed(message));
            };
            self.line = i + 1;
            if !line.trim_start().starts_with('#') {
                self.words = line.split_whitespace();
            }
        }
    }

    fn refuse(&self, found: &str, allowed: &str) -> TableError {
        TableError::line(self.line, format!("{}: allowed {allowed}", excerpt(found)))
    }

    fn expect(&mut self, word: &'static str) -> Result<(), TableError> {
        let found = self.next(word)?;
        match found.eq_ignore_ascii_case(word) {
            true => Ok(()),
            false => Err(self.refuse(found, &format!("is {word}"))),
        }
    }

    fn number(&mut self, before: &'static str) -> Result<f64, TableError> {
        let word = self.next(before)?;
        self.parsed(word)
    }

    fn parsed(&self, word: &str) -> Result<f64, TableError> {
        let is_kept = |x: &f64| x.abs() <= LARGEST_READING;
        let number = word.parse::<f64>().ok().filter(is_kept);
        let allowed = || format!("is a number of at most {LARGEST_READING:e}");
        number.ok_or_else(|| self.refuse(word, &allowed()))
    }

    /// A value of the table; NaN, which is counted, of a text that stands for no reading.
    fn value(&mut self, texts: &mut Marks) -> Result<f64, TableError> {
        match self.next("the last value")? {
            word if is_mark(word) => {
                texts.see(word);
                Ok(f64::NAN)
            }
            word => self.parsed(word),
        }
    }

    /// One of some words, by its place among them.
    fn one_of(&mut self, before: &'static str, all: &[&str]) -> Result<usize, TableError> {
        let word = self.next(before)?;
        let found = all.iter().position(|w| w.eq_ignore_ascii_case(word));
        found.ok_or_else(|| self.refuse(word, &format!("are {}", all.join(", "))))
    }

    /// A list of ascending angles (degrees) within bounds, in rad.
    fn angles(&mut self, before: &'static str, most: f64) -> Result<Vec<f64>, TableError> {
        let word = self.next(before)?;
        let count = word.parse::<usize>().ok().filter(|n| *n > 0);
        let count = count.ok_or_else(|| self.refuse(word, "is a whole number from 1"))?;
        let mut found: Vec<f64> = Vec::new();
        for _ in 0..count {
            let angle = self.number(before)?;
            let ascends = found.last().is_none_or(|last| angle > *last);
            if !ascends || !(0.0..=most).contains(&angle) {
                let allowed = format!("are degrees from 0 to {most}, each above the one before");
                return Err(self.refuse(&angle.to_string(), &allowed));
            }
            found.push(angle);
        }
        Ok(found.into_iter().map(f64::to_radians).collect())
    }
}

/// What a table holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    /// One value.
    Monochrome,
    /// X, Y, Z.
    Xyz,
}

impl Content {
    /// Checks that a scene can make use of it.
    pub fn suits(self, channels: &Channels) -> Result<(), TableError> {
        match (self, channels) {
            (Self::Monochrome, Channels::Wavelengths(w)) if w.nm().len() > 1 => {
                Err(TableError::Channels(
                    "this table is of one wavelength or luminance; allowed: channels = \"luminance\", \"rgb\" or one wavelength",
                ))
            }
            (Self::Xyz, Channels::Wavelengths(_)) => Err(TableError::Channels(
                "this table holds X, Y, Z; allowed: channels = \"luminance\" or \"rgb\"",
            )),
            _ => Ok(()),
        }
    }
}

/// Everything before the values.
pub struct Head<'t> {
    /// The nodes.
    pub angles: Angles,
    /// What the values are.
    pub content: Content,
    words: Words<'t>,
}

/// Reads a file.
pub(crate) fn text(path: &Path) -> Result<String, TableError> {
    files::read_foreign_text(path, files::TABLE_LIMIT).map_err(no_access)
}

/// Reads what is before the values.
pub(crate) fn head(text: &str) -> Result<Head<'_>, TableError> {
    let mut words = Words::new(text);
    words.expect("Source")?;
    words.next("Symmetry")?;
    words.expect("Symmetry")?;
    let symmetries = ["PlaneSymmetrical", "Asymmetrical", "Asymmetrical4D"];
    let mirrored = words.one_of("SpectralContent", &symmetries)? == 0;
    words.expect("SpectralContent")?;
    let content = match words.one_of("ScatterType", &["Monochrome", "XYZ"])? {
        0 => Content::Monochrome,
        _ => Content::Xyz,
    };
    words.expect("ScatterType")?;
    words.one_of("SampleRotation", &["BRDF"])?;
    words.expect("SampleRotation")?;
    let rotation = words.angles("the list of SampleRotation", 360.0)?;
    words.expect("AngleOfIncidence")?;
    let theta_i = words.angles("the list of AngleOfIncidence", 90.0)?;
    words.expect("ScatterAzimuth")?;
    let most = if mirrored { 180.0 } else { 360.0 };
    let azimuth = words.angles("the list of ScatterAzimuth", most)?;
    words.expect("ScatterRadial")?;
    let radial = words.angles("the list of ScatterRadial", 180.0)?;
    Ok(Head {
        angles: Angles {
            rotation,
            theta_i,
            azimuth,
            radial,
            mirrored,
        },
        content,
        words,
    })
}

impl Head<'_> {
    /// The values of the next block.
    fn block(&mut self, name: &'static str, texts: &mut Marks) -> Result<Vec<f64>, TableError> {
        let words = &mut self.words;
        words.expect(name)?;
        words.expect("DataBegin")?;
        let mut values = Vec::new();
        for _ in 0..self.angles.rotation.len() * self.angles.theta_i.len() {
            words.expect("TIS")?;
            words.next("the value of TIS")?;
            for _ in 0..self.angles.azimuth.len() * self.angles.radial.len() {
                values.push(words.value(texts)?);
            }
        }
        words.expect("DataEnd")?;
        Ok(values)
    }

    /// The table, for a scene in some channels; `no_reading` is one more number that stands for no reading.
    pub fn load(
        mut self,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Zemax, TableError> {
        self.content.suits(&channels)?;
        let mut texts = Marks::default();
        let names: &[&'static str] = match self.content {
            Content::Monochrome => &["Monochrome"],
            Content::Xyz => &["TristimulusX", "TristimulusY", "TristimulusZ"],
        };
        let mut values = Vec::new();
        for name in names {
            values.extend(self.block(name, &mut texts)?);
        }
        if let Ok(word) = self.words.next("the end") {
            let allowed = "is nothing behind the last DataEnd";
            return Err(self.words.refuse(word, allowed));
        }
        let mut doubts = Doubts::take(&mut values, texts, no_reading);
        let nodes = self.angles.count();
        let angles = &self.angles;
        let first = values.iter().take(nodes).enumerate();
        doubts.look_for_zeros(
            first.filter_map(|(node, value)| doubted(*value, || Some(angles.pair(node)))),
        );
        // Of NaN and 0 the maximum would be 0.
        let negative = values.iter_mut().filter(|v| **v < 0.0);
        negative.for_each(|v| *v = 0.0);
        let mut planes: Vec<Vec<f64>> = values.chunks_exact(nodes).map(Into::into).collect();
        if let ([x, y, z], Channels::Rgb) = (&mut planes[..], &channels) {
            let inverse = XYZ.inverse();
            for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
                let xyz = DVec3::new(*x, *y, *z);
                // A node is known in all channels or in none.
                let rgb = match xyz.is_nan() {
                    true => DVec3::NAN,
                    false => (inverse * xyz).max(DVec3::ZERO),
                };
                (*x, *y, *z) = (rgb.x, rgb.y, rgb.z);
            }
        }
        doubts.is_grey = (planes.len(), channels.count()) == (1, 3);
        let values = match (planes.len(), channels.count()) {
            // Luminance is Y.
            (3, 1) => planes.swap_remove(1),
            (1, 3) => planes[0].repeat(3),
            _ => planes.concat(),
        };
        if values.iter().all(|v| v.is_nan()) {
            let message = "no cell of this table holds a reading";
            return Err(TableError::NoData(message.into()));
        }
        Ok(Zemax {
            angles: self.angles,
            channels,
            values,
            doubts,
        })
    }
}

impl Zemax {
    /// Reads a text for a scene in some channels.
    pub fn read(text: &str, channels: Channels) -> Result<Self, TableError> {
        head(text)?.load(channels, None)
    }
}

/// Degrees of a list, as they were before they became rad.
pub(super) fn degrees(angles: &[f64]) -> String {
    let tidy = angles.iter().map(|a| (a * 180.0 / PI * 1e9).round() / 1e9);
    let texts: Vec<String> = tidy.map(|degrees| degrees.to_string()).collect();
    texts.join(" ")
}
