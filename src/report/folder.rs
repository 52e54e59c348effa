//! The folder of a run.
//!
//! ```text
//! config.toml     the resolved config; running it again gives the same results
//! manifest.json   version, status, inputs, files; written last
//! ```
//!
//! An acquisition adds
//!
//! ```text
//! results.csv     one row per comparison
//! results.jsonl   the same rows
//! schedules/      if asked: one file per schedule
//! slices/         if asked: one picture per reconstruction
//! ```
//!
//! and a moment experiment
//!
//! ```text
//! profiles.csv      one row per material, channel and view
//! fits.csv          one row per material: what its profiles have been fitted with
//! correlations.csv  one row per group and pair of quantities
//! summary.json      one object per group: what its materials have in common
//! figures/          diagrams
//! ```
//!
//! and one of relations `relations.csv`, one row per material, lighting, view and way to move it, and
//! `figures/`.
//!
//! Until the run is over every name ends in `.part`. After a crash only those are left, with the
//! rows that were finished.

use super::manifest::Manifest;
use super::relations;
use super::results::{ResultFiles, TableFile, going_on, part};
use crate::error::Error;
use crate::experiment::moments::ProfileRow;
use crate::experiment::relations::RelationRow;
use crate::experiment::{Allowance, Kind, Row, ScheduleKey};
use crate::files::write_atomically;
use crate::schedule::{Itinerary, Schedule, ScheduleFormat, write_schedule};
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use toml::Table;

/// The resolved config of a run.
pub const CONFIG: &str = "config.toml";
pub(super) const CONFIG_HEAD: &str = "\
# Every key of this run with its value; running this file gives the same results.
# Paths are relative to the folder that gonio is started in.

";
pub(super) const MANIFEST: &str = "manifest.json";
const SCHEDULES: &str = "schedules";
const SLICES: &str = "slices";
/// The folder of diagrams.
const FIGURES: &str = "figures";
/// The tables of a moment experiment beside its profiles.
pub const FITS: &str = "fits.csv";
/// See [`FITS`].
pub const CORRELATIONS: &str = "correlations.csv";
/// See [`FITS`].
pub const SUMMARY: &str = "summary.json";

/// Everything a run writes at the top of its folder.
const NAMES: [&str; 12] = [
    CONFIG,
    MANIFEST,
    ResultFiles::NAMES[0],
    ResultFiles::NAMES[1],
    TableFile::NAMES[0],
    TableFile::NAMES[1],
    FITS,
    CORRELATIONS,
    SUMMARY,
    SCHEDULES,
    SLICES,
    FIGURES,
];

/// Those that are folders.
const FOLDERS: [&str; 3] = [SCHEDULES, SLICES, FIGURES];

/// What cannot happen: a run writes the rows of its own kind.
const OTHER_KIND: &str = "rows of another kind of experiment";

/// The files that grow while a run goes on.
enum Growing {
    Results(ResultFiles),
    Table(TableFile),
}

impl Growing {
    fn create(dir: &Path, kind: Kind) -> io::Result<Self> {
        Ok(match kind {
            Kind::Acquisition => Self::Results(ResultFiles::create(dir)?),
            Kind::Moments => {
                let name = TableFile::NAMES[0];
                Self::Table(TableFile::create(dir, name, ProfileRow::columns())?)
            }
            // Has a folder of its own kind.
            Kind::Study => return Err(io::Error::other(OTHER_KIND)),
            Kind::Relations => {
                let name = TableFile::NAMES[1];
                Self::Table(TableFile::create(dir, name, relations::columns())?)
            }
        })
    }

    fn rows(&self) -> usize {
        match self {
            Self::Results(files) => files.rows(),
            Self::Table(file) => file.rows(),
        }
    }
}

/// A run's folder while the run goes on.
pub struct RunFolder {
    dir: PathBuf,
    growing: Growing,
    /// Finished files, relative to the folder.
    files: BTreeSet<String>,
}

impl RunFolder {
    /// Starts a run in `dir`, which is made if need be.
    ///
    /// # Errors
    /// [`Error::Output`] if the folder cannot be written to, or if a run is there already, unless
    /// `force` says to replace it.
    pub fn create(dir: &Path, force: bool, kind: Kind, resolved: &Table) -> Result<Self, Error> {
        let failed = |e: io::Error| {
            let message = format!("cannot write to this folder: {e}; choose another with -o");
            Error::output(dir, message)
        };
        if dir.exists() && !dir.is_dir() {
            return Err(Error::output(
                dir,
                "this is no folder; choose another with -o",
            ));
        }
        fs::create_dir_all(dir).map_err(failed)?;
        if going_on(dir) {
            // Not even with `force`: its files would be given their names half-written.
            let message = "a run is going on here; choose another folder with -o, or wait for it";
            return Err(Error::output(dir, message));
        }
        let taken = |dir: &Path| {
            let mut names = NAMES
                .into_iter()
                .flat_map(|n| [n.into(), format!("{n}.part")]);
            names.find(|name| dir.join(name).symlink_metadata().is_ok())
        };
        if force {
            clear(dir).map_err(failed)?;
        }
        if let Some(name) = taken(dir) {
            let message = if force {
                format!("{name} is here, and no run wrote it; choose another folder with -o")
            } else {
                format!("a run is here already ({name}); choose another folder with -o, or --force")
            };
            return Err(Error::output(dir, message));
        }
        Self::start(dir, kind, resolved).map_err(failed)
    }

    /// Starts a run in the first folder of `parent/stem`, `parent/stem-2`, … that does not exist.
    ///
    /// # Errors
    /// [`Error::Output`] if the folder cannot be made.
    pub fn create_next(
        parent: &Path,
        stem: &str,
        kind: Kind,
        resolved: &Table,
    ) -> Result<Self, Error> {
        let names = (2..).map(|n| format!("{stem}-{n}"));
        for name in std::iter::once(stem.to_owned()).chain(names) {
            let dir = parent.join(name);
            let made = fs::create_dir_all(parent).and_then(|()| fs::create_dir(&dir));
            match made.and_then(|()| Self::start(&dir, kind, resolved)) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists && dir.exists() => {}
                Err(e) => {
                    let message = format!("cannot make this folder: {e}; choose another with -o");
                    return Err(Error::output(dir, message));
                }
                Ok(folder) => return Ok(folder),
            }
        }
        unreachable!("the names have no end")
    }

    fn start(dir: &Path, kind: Kind, resolved: &Table) -> io::Result<Self> {
        let growing = Growing::create(dir, kind)?;
        let config = toml::to_string(resolved).map_err(io::Error::other)?;
        fs::write(part(dir, CONFIG), format!("{CONFIG_HEAD}{config}"))?;
        Ok(Self {
            dir: dir.to_owned(),
            growing,
            files: BTreeSet::new(),
        })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Rows written so far.
    pub fn rows(&self) -> usize {
        self.growing.rows()
    }

    /// Appends rows to the results of an acquisition.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_rows(&mut self, rows: &[Row]) -> Result<(), Error> {
        let written = match &mut self.growing {
            Growing::Results(files) => files.write(rows),
            Growing::Table(_) => Err(io::Error::other(OTHER_KIND)),
        };
        self.report(written)
    }

    /// Appends rows to the profiles of a moment experiment.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_profiles(&mut self, rows: &[ProfileRow<'_>]) -> Result<(), Error> {
        let written = match &mut self.growing {
            Growing::Table(file) => file.write(rows.iter().map(|r| r.fields())),
            Growing::Results(_) => Err(io::Error::other(OTHER_KIND)),
        };
        self.report(written)
    }

    /// Appends rows to the relations of an experiment of that kind.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_relations(&mut self, rows: &[RelationRow]) -> Result<(), Error> {
        let written = match &mut self.growing {
            Growing::Table(file) => file.write(rows.iter().map(relations::fields)),
            Growing::Results(_) => Err(io::Error::other(OTHER_KIND)),
        };
        self.report(written)
    }

    /// Writes one of the named files at the top of the folder.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_file(
        &mut self,
        name: &'static str,
        body: impl FnOnce(&mut io::BufWriter<fs::File>) -> io::Result<()>,
    ) -> Result<(), Error> {
        let path = part(&self.dir, name);
        write_atomically(&path, body)
            .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))?;
        self.files.insert(name.to_owned());
        Ok(())
    }

    /// Writes a diagram.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_figure(
        &mut self,
        name: String,
        body: impl FnOnce(&mut io::BufWriter<fs::File>) -> io::Result<()>,
    ) -> Result<(), Error> {
        self.write_below(FIGURES, name, body)
    }

    fn report(&self, written: io::Result<()>) -> Result<(), Error> {
        written.map_err(|e| Error::output(&self.dir, format!("cannot write results: {e}")))
    }

    /// Writes a schedule.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_schedule(
        &mut self,
        key: &ScheduleKey<'_>,
        schedule: &Schedule,
        itinerary: Option<&Itinerary>,
        format: ScheduleFormat,
    ) -> Result<(), Error> {
        let name = format!("{}.{}", schedule_stem(key), format.extension());
        self.write_below(SCHEDULES, name, |out| {
            write_schedule(schedule, itinerary, format, out)
        })
    }

    /// Writes a picture of a slice of truth, reconstruction and difference.
    ///
    /// # Errors
    /// [`Error::Output`].
    #[cfg(feature = "exr")]
    pub fn write_slice(
        &mut self,
        job: &crate::experiment::Job<'_>,
        truth: &dyn crate::brdf::Brdf,
        reconstruction: &dyn crate::brdf::Brdf,
    ) -> Result<(), Error> {
        let mut name = file_stem(&job.material.name);
        for part in job.schedule.iter().map(schedule_stem) {
            name = format!("{name}_{part}");
        }
        for part in job.reconstruction.iter().map(|r| file_stem(r)) {
            name = format!("{name}_{part}");
        }
        self.write_below(SLICES, name + ".exr", |out| {
            super::write_slice(truth, reconstruction, out)
        })
    }

    fn write_below(
        &mut self,
        folder: &str,
        name: String,
        body: impl FnOnce(&mut io::BufWriter<fs::File>) -> io::Result<()>,
    ) -> Result<(), Error> {
        let dir = part(&self.dir, folder);
        let path = dir.join(&name);
        fs::create_dir_all(&dir)
            .and_then(|()| write_atomically(&path, body))
            .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))?;
        self.files.insert(format!("{folder}/{name}"));
        Ok(())
    }

    /// Gives every file its name; the manifest comes last.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn finish(mut self, mut manifest: Manifest) -> Result<PathBuf, Error> {
        let dir = self.dir.clone();
        self.files.extend([CONFIG, MANIFEST].map(String::from));
        match &self.growing {
            Growing::Results(_) => self.files.extend(ResultFiles::NAMES.map(String::from)),
            Growing::Table(file) => {
                self.files.insert(file.name().into());
            }
        }
        manifest.files = self.files.into_iter().collect();
        let finish = || {
            match self.growing {
                Growing::Results(files) => files.finish()?,
                Growing::Table(file) => file.finish()?,
            }
            for name in [CONFIG, FITS, CORRELATIONS, SUMMARY]
                .into_iter()
                .chain(FOLDERS)
            {
                let unfinished = part(&dir, name);
                if unfinished.exists() {
                    fs::rename(unfinished, dir.join(name))?;
                }
            }
            write_atomically(&dir.join(MANIFEST), |out| {
                serde_json::to_writer_pretty(&mut *out, &manifest)?;
                out.write_all(b"\n")
            })
        };
        let finished: io::Result<()> = finish();
        finished.map_err(|e| Error::output(&dir, format!("cannot finish this folder: {e}")))?;
        Ok(dir)
    }
}

/// Removes what a run wrote, whether it ended or not, and nothing else.
fn clear(dir: &Path) -> io::Result<()> {
    let manifest = fs::read(dir.join(MANIFEST)).unwrap_or_default();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap_or_default();
    let listed = match (&manifest["gonio"], &manifest["files"]) {
        (serde_json::Value::String(_), serde_json::Value::Array(files)) => files.as_slice(),
        _ => &[],
    };
    for name in listed.iter().filter_map(serde_json::Value::as_str) {
        // A manifest that was tampered with shall not lead out of the folder.
        let (top, below) = match name.split_once('/') {
            Some((top, below)) => (top, Some(below)),
            None => (name, None),
        };
        let plain = below.is_none_or(|b| !b.starts_with('.') && !b.contains(['/', '\\']));
        if NAMES.contains(&top) && plain {
            remove(fs::remove_file(dir.join(name)))?;
        }
    }
    for name in NAMES {
        let unfinished = part(dir, name);
        if unfinished.is_dir() {
            for entry in fs::read_dir(&unfinished)? {
                remove(fs::remove_file(entry?.path()))?;
            }
            remove(fs::remove_dir(&unfinished))?;
        } else {
            remove(fs::remove_file(&unfinished))?;
        }
    }
    for name in FOLDERS {
        // Fails if someone else's files are in it, which are not ours to remove.
        let _ = fs::remove_dir(dir.join(name));
    }
    Ok(())
}

/// What is not there need not be removed.
pub(super) fn remove(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// A name as part of a file name: letters, digits, `.`, `-` and `_` stay, every other character
/// becomes `%` and its number, so that different names stay different.
pub fn file_stem(name: &str) -> String {
    let mut stem = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '.' | '-' | '_' => stem.push(c),
            _ => stem.push_str(&format!("%{:X}", u32::from(c))),
        }
    }
    stem
}

/// The file name, without extension, of a schedule; different for different schedules of a plan.
pub fn schedule_stem(key: &ScheduleKey<'_>) -> String {
    let mut stem = key.coordinates.name().to_owned();
    for (axis, warp) in &key.coordinates.warps {
        stem.push_str(&format!("_{axis}-{}", warp.name()));
    }
    let s = key.symmetry;
    let symmetry: String = [(s.isotropic, 'i'), (s.reciprocal, 'r'), (s.bilateral, 'b')]
        .into_iter()
        .map(|(has, letter)| if has { letter } else { '-' })
        .collect();
    let set = file_stem(&key.sample_set.name);
    let instrument = match key.instrument {
        Some(instrument) => format!("_{}", file_stem(&instrument.name)),
        None => String::new(),
    };
    let allowance = match key.allowance {
        Allowance::Poses(n) => n.to_string(),
        Allowance::Readings(n) => format!("{n}readings"),
        Allowance::Minutes(minutes) => format!("{minutes}min"),
    };
    let seed = key.seed;
    format!("{stem}_{symmetry}_{set}_{allowance}{instrument}_seed{seed}")
}
