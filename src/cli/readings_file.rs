//! Files of readings that are written: one, or one for each direction of the light in a folder.

use super::{format_of, listed, make_folder, note, refuse_unwritable, write_file, writer, written};
use crate::error::Error;
use crate::files;
use crate::formats::{self, Format, WRITE_READINGS, WriteReadings};
use crate::measurement::pab::by_light;
use crate::measurement::{About, Measurement};
use crate::schedule::Sequence;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Names of files that have one light direction each begin with it.
const LIGHT: &str = "light-";

/// What readings are written to.
pub(super) struct ReadingsFile<'a> {
    path: &'a Path,
    format: Format,
    write: WriteReadings,
}

impl<'a> ReadingsFile<'a> {
    /// A file of the format that was chosen, else of that which its extension says.
    pub(crate) fn new(chosen: Option<Format>, path: &'a Path) -> Result<Self, Error> {
        let format = format_of(&WRITE_READINGS, chosen, path)?;
        Ok(Self {
            path,
            format,
            write: writer(&WRITE_READINGS, &format, path)?,
        })
    }

    /// Refuses a format that has no place for uncertainties.
    pub(crate) fn for_uncertainties(self) -> Result<Self, Error> {
        if !self.format.keeps_uncertainties() {
            let formats = formats::all().into_iter();
            let names = formats.filter(|f| f.write_readings.is_some() && f.keeps_uncertainties());
            let (name, names) = (self.format.name, listed(names.map(|f| f.name)));
            let message =
                format!("{name} has no place for uncertainties; allowed: {names}, or .svg");
            return Err(Error::output(self.path, message));
        }
        Ok(self)
    }

    /// Refuses to replace what is there, unless that is wanted.
    pub(crate) fn refuse_existing(&self, force: bool) -> Result<(), Error> {
        if !self.is_folder() {
            refuse_unwritable(self.path, force)
        } else if self.path.exists() && !force {
            let message = "this folder exists; choose another with -o, or --force to replace its files of lights";
            Err(Error::output(self.path, message))
        } else if self.path.exists() {
            let claim = |path: PathBuf| files::claim(&path).map_err(|e| Error::output(path, e));
            self.files()?.into_iter().try_for_each(claim)
        } else {
            Ok(())
        }
    }

    /// The files that hold the readings.
    pub(crate) fn files(&self) -> Result<Vec<PathBuf>, Error> {
        if !self.is_folder() {
            return Ok(vec![self.path.into()]);
        }
        let failed = |e| Error::output(self.path, format!("cannot read this folder: {e}"));
        formats::files_in(self.path, &self.format).map_err(failed)
    }

    /// Of some poses those that are written with a reading, in the order of the files.
    pub fn order(&self, measurement: &Measurement, poses: &[u32]) -> Vec<u32> {
        if self.format.one_light {
            return by_light(measurement, Sequence::Order(poses)).concat();
        }
        let has_value = |p: &u32| measurement.value(*p as usize).is_some();
        poses.iter().copied().filter(has_value).collect()
    }

    /// True if it is a folder, with a file for each direction of the light.
    fn is_folder(&self) -> bool {
        self.format.one_light && formats::of_name(self.path) != Some(self.format)
    }

    /// Writes the readings, and notes what the format has no place for.
    pub(crate) fn write(
        &self,
        measurement: &Measurement,
        about: &About,
        sequence: Sequence<'_>,
    ) -> Result<(), Error> {
        let (format, write) = (self.format, self.write);
        let file = |path: &Path, sequence| {
            write_file(path, |out| write(measurement, about, sequence, out))
        };
        if let Some(sentence) = format.leaves_out(measurement) {
            note(&format!("gonio: {sentence}"));
        }
        if !format.left_out.is_empty() && measurement.readings() == 0 {
            let name = format.name;
            let message = format!("there is no reading, and {name} holds nothing else");
            return Err(Error::output(self.path, message));
        }
        if !format.one_light {
            return file(self.path, sequence);
        }
        let lights = by_light(measurement, sequence);
        if !self.is_folder() {
            if lights.len() == 1 {
                return file(self.path, sequence);
            }
            let (several, name) = (lights.len(), format.name);
            let message = format!(
                "{several} directions of the light; allowed: one in a file of {name}, or -o FOLDER --format {name}"
            );
            return Err(Error::output(self.path, message));
        }
        // All of them are ready before anything that is there is touched.
        let dir = self.path;
        let texts = lights.iter().map(|poses| {
            let mut text = Vec::new();
            let done = write(measurement, about, Sequence::Order(poses), &mut text);
            written(dir, done).map(|()| text)
        });
        let texts = texts.collect::<Result<Vec<_>, Error>>()?;
        make_folder(dir)?;
        let failed = |e| Error::output(dir, format!("cannot make this folder: {e}"));
        // Those of an earlier measurement are of other lights.
        for old in formats::files_in(dir, &format).map_err(failed)? {
            let name = old.file_stem().and_then(|name| name.to_str());
            let number = name.and_then(|name| name.strip_prefix(LIGHT));
            if number.is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit())) {
                written(&old, std::fs::remove_file(&old))?;
            }
        }
        for (i, text) in texts.iter().enumerate() {
            let path = dir.join(format!("{LIGHT}{:04}.{}", i + 1, format.extension()));
            write_file(&path, |out| out.write_all(text))?;
        }
        Ok(())
    }
}
