//! Every file format of tables, schedules, readings and environment maps: one list, [`all`].
//!
//! The commands find a format by its name (`--format`) or by the extension of a file, and text that
//! is read by its first lines; help texts, `gonio list formats` and the page
//! [`docs::formats`](crate::docs::formats) walk the same list. A new format is a [`Format`] in [`all`]; of
//! tables, a [`FileFormat`], which has its own kind of material, and one line in
//! [`brdf::measured`](crate::brdf::measured). Readings have one kind of material for all formats, and a panorama is decoded by
//! [`MapSpec`](crate::lighting::MapSpec).

mod choice;
mod list;
mod readings;

pub use crate::brdf::measured::{TableError, Tabulation, WriteTable};
pub use crate::measurement::Readings;
pub use choice::{FormatError, Use, files_in, of_file, of_name, of_text};
pub(crate) use list::CSV;
pub use list::all;
pub use readings::{load_all_readings, load_readings, read_readings};

use crate::brdf::measured::{FileFormat, ReadTable, merl};
use crate::lighting::LightingSpec;
use crate::measurement::{About, Measurement};
use crate::schedule::{Assume, FileError, Schedule, ScheduleFile, Sequence};
use std::io::{self, Write};
use std::path::PathBuf;

/// Isotropic tables over half/difference angles, of the MERL database.
pub const MERL: Format = Format::of_tables(&merl::FORMAT);

/// The bytes of a file, and its name in messages.
pub(crate) type AsText = fn(&[u8], &str) -> Result<String, FileError>;

/// Text, its name in messages, and what is taken for granted.
pub(crate) type ReadSchedule = fn(&str, &str, &Assume) -> Result<ScheduleFile, FileError>;

/// Poses, which of them, and the order of the rows.
pub type WriteSchedule = fn(&Schedule, Sequence<'_>, &mut dyn Write) -> io::Result<()>;

/// Text, its name in messages, and what is taken for granted; see [`read_readings`].
pub(crate) type ReadReadings = fn(&str, &str, &Assume) -> Result<Readings, FileError>;

/// Readings, where they come from, and the order of the rows.
pub type WriteReadings = fn(&Measurement, &About, Sequence<'_>, &mut dyn Write) -> io::Result<()>;

/// The light that a panorama is.
pub(crate) type ReadEnvironment = fn(PathBuf) -> Box<dyn LightingSpec>;

/// Formats that tables are read from.
pub const READ_TABLE: Use<ReadTable> = Use::new("tables", |f| f.table.read);

/// Formats that tables are written in.
pub const WRITE_TABLE: Use<WriteTable> = Use::new("tables", |f| f.table.write);

/// Formats that schedules are read from.
pub const READ_SCHEDULE: Use<ReadSchedule> = Use::new("schedules", |f| f.read_schedule);

/// Formats that schedules are written in.
pub const WRITE_SCHEDULE: Use<WriteSchedule> = Use::new("schedules", |f| f.write_schedule);

/// Formats that readings are read from.
pub const READ_READINGS: Use<ReadReadings> = Use::new("readings", |f| f.read_readings);

/// Formats that readings are written in.
pub const WRITE_READINGS: Use<WriteReadings> = Use::new("readings", |f| f.write_readings);

/// Formats that anything is written in.
pub(crate) const WRITE: Use<()> = Use::new("tables, readings and schedules", |f| {
    let is_written =
        f.table.write.is_some() || f.write_readings.is_some() || f.write_schedule.is_some();
    is_written.then_some(())
});

/// Formats that environment maps are read from.
pub(crate) const READ_ENVIRONMENT: Use<ReadEnvironment> =
    Use::new("environment maps", |f| f.read_environment);

/// One file format; a use without a function is one that it has not.
#[derive(Clone, Copy)]
pub struct Format {
    /// What `--format` and configs call it, kebab-case.
    pub name: &'static str,
    /// Extensions of file names in lower case; files that are written get the first one.
    pub extensions: &'static [&'static str],
    /// One line for `gonio list` and the docs.
    pub summary: &'static str,
    /// Whether a text is of this format. Text has names of every sort, or comes through a pipe; a
    /// format without this is recognised by its extension alone.
    pub recognises: Option<fn(&str) -> bool>,
    /// Of a binary format of poses or readings: the equivalent text.
    pub as_text: Option<AsText>,
    /// Tables of BRDFs.
    pub table: FileFormat,
    /// Reads a schedule.
    pub read_schedule: Option<ReadSchedule>,
    /// Writes a schedule.
    pub write_schedule: Option<WriteSchedule>,
    /// Reads readings.
    pub read_readings: Option<ReadReadings>,
    /// Writes readings.
    pub write_readings: Option<WriteReadings>,
    /// What is left out of readings that are written, a phrase; empty: nothing.
    pub left_out: &'static str,
    /// Whether a file of readings has one light direction; those of several are files of a folder.
    pub one_light: bool,
    /// Reads an environment map.
    pub read_environment: Option<ReadEnvironment>,
}

impl Format {
    /// A format without any use.
    const NONE: Self = Self {
        name: "",
        extensions: &[],
        summary: "",
        recognises: None,
        as_text: None,
        table: FileFormat::NONE,
        read_schedule: None,
        write_schedule: None,
        read_readings: None,
        write_readings: None,
        left_out: "",
        one_light: false,
        read_environment: None,
    };

    const fn of_tables(format: &FileFormat) -> Self {
        Self {
            name: format.name,
            extensions: format.extensions,
            summary: format.summary,
            table: *format,
            ..Self::NONE
        }
    }

    /// True if readings that are written keep their uncertainties.
    pub(crate) fn keeps_uncertainties(&self) -> bool {
        !self.left_out.contains("uncertainties")
    }

    /// The sentence about what is left out of readings that are written; `None` if nothing is.
    pub fn leaves_out(&self, measurement: &Measurement) -> Option<String> {
        let holes = measurement.readings() < measurement.outcomes.len();
        let is_some = holes || measurement.details.is_some();
        let Self { name, left_out, .. } = self;
        let sentence = || format!("{name} has no place for {left_out}; they are left out");
        (!left_out.is_empty() && is_some).then(sentence)
    }

    /// The extension of files that are written.
    pub fn extension(&self) -> &'static str {
        self.extensions.first().copied().unwrap_or(self.name)
    }

    /// The text that the bytes of a file of poses or readings stand for; `None` if they are none.
    pub(crate) fn text_of(&self, bytes: Vec<u8>) -> Option<String> {
        match self.as_text {
            Some(as_text) => as_text(&bytes, self.name).ok(),
            None => String::from_utf8(bytes).ok(),
        }
    }

    /// What it holds, and whether that is read and written: a phrase each.
    pub fn holds(&self) -> Vec<String> {
        let table = (self.table.read.is_some(), self.table.write.is_some());
        let schedule = (self.read_schedule.is_some(), self.write_schedule.is_some());
        let readings = (self.read_readings.is_some(), self.write_readings.is_some());
        let uses = [
            ("table of a BRDF", table),
            ("schedule", schedule),
            ("readings", readings),
            ("environment map", (self.read_environment.is_some(), false)),
        ];
        let phrase = |(what, is)| match is {
            (true, true) => Some(format!("{what} (read, written)")),
            (true, false) => Some(format!("{what} (read)")),
            (false, true) => Some(format!("{what} (written)")),
            (false, false) => None,
        };
        uses.into_iter().filter_map(phrase).collect()
    }
}

impl PartialEq for Format {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Format {}

impl std::fmt::Debug for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name)
    }
}
