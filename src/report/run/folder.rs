//! The folder of a run: its records in [`Record::FILE`], one a line, appended as they come, from which a run goes on; all wall
//! times in [`TIMINGS`], so that every other file of equal runs is equal; [`CONFIG`]; and [`MANIFEST`], which is written last.
//!
//! At the end come tables and pictures of the records. Every file but those of the records and their times is whole or not there.

use super::manifest::{MANIFEST, Manifest, read_manifest};
use super::rows::{RowFile, no_folder, unwritable};
use super::timings::{Machine, TIMINGS, remove};
use crate::error::Error;
use crate::experiment::{
    Allowance, Coordinates, Counters, Job, Known, NONE, Record, RowKey, ScheduleKey, Stage, Work,
};
use crate::files::{self, remove_parts, write_atomically};
use crate::registry::named;
use serde_json::Value;
use std::collections::{BTreeSet, HashMap};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Table;

/// The resolved config of a run: running it again gives the same results.
pub const CONFIG: &str = "config.toml";
const CONFIG_HEAD: &str = "\
# Every key of this run with its value; running this file gives the same results.
# Paths are relative to the folder that gonio is started in.

";
/// The rows of an acquisition as a table, in the order of the config.
pub const RESULTS: &str = "results.csv";
/// [`RESULTS`] with typed columns.
pub const PARQUET: &str = "results.parquet";
/// A page that answers a hand, if asked.
pub const EXPLORE: &str = "explore.html";
/// Every choice at every allowance with its statistics.
pub const RANKING: &str = "ranking.csv";
/// The report of a study: rankings, comparisons and a verdict.
pub const REPORT: &str = "report.html";
/// Errors against wall times: a picture of `timings.jsonl`.
pub const TIMES: &str = "timings.svg";
/// The profiles of a moment experiment: a row per material, channel and view.
pub const PROFILES: &str = "profiles.csv";
/// What the profiles of each material have been fitted with.
pub const FITS: &str = "fits.csv";
/// A row per group of materials and pair of quantities.
pub const CORRELATIONS: &str = "correlations.csv";
/// What the materials of each group have in common.
pub const SUMMARY: &str = "summary.json";
/// The relations: a row per material, lighting, view and way to move it.
pub const RELATIONS: &str = "relations.csv";

/// Records whose lines are made at once.
const WRITTEN: usize = 4096;

/// Files made from all records: removed as soon as there is another record.
const OF_ALL: [&str; 12] = [
    MANIFEST,
    RESULTS,
    PARQUET,
    RANKING,
    REPORT,
    EXPLORE,
    TIMES,
    PROFILES,
    FITS,
    CORRELATIONS,
    SUMMARY,
    RELATIONS,
];

named! {
    /// A folder within a run's.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Below {
        /// One file per schedule, if asked.
        Schedules = "schedules",
        /// One picture per reconstruction, if asked.
        Slices = "slices",
        /// Diagrams of a moment experiment or of relations.
        Figures = "figures",
        /// Pictures of a report; their names say what they show.
        Pictures = "pictures",
    }
}

impl Below {
    /// A file in it, relative to the folder of a run.
    fn file(self, name: &str) -> String {
        format!("{}/{name}", self.name())
    }
}

/// A run's folder while the run goes on; `R` is its record. What cannot be written is [`Error::Output`].
pub struct RunFolder<R> {
    dir: PathBuf,
    file: RowFile,
    rows: Vec<Arc<R>>,
    /// Finished files, relative to the folder.
    files: BTreeSet<String>,
    /// True if pictures of earlier runs are drawn again.
    redraw: bool,
    /// True if it held a run of the same config before, which goes on.
    pub(crate) is_same: bool,
    /// Counters of files, and of what is made for pictures.
    pub(crate) counters: Counters,
}

impl<R: Record> RunFolder<R> {
    /// Opens a folder, which is made if need be, with the records that are there. `force` drops them.
    ///
    /// # Errors
    /// [`Error::Output`] if it cannot be written to, if a run is going on there, or if something
    /// else is; [`Error::Data`] if its records cannot be read.
    pub fn open(dir: &Path, force: bool, resolved: &Table) -> Result<Self, Error> {
        let failed = |e| no_folder(dir, &e);
        if dir.exists() && !dir.is_dir() {
            return Err(Error::output(
                dir,
                "this is no folder; choose another with -o",
            ));
        }
        fs::create_dir_all(dir).map_err(failed)?;
        let is_new = !dir.join(R::FILE).exists();
        let is_there = |name: &&str| dir.join(name).symlink_metadata().is_ok();
        let mut others = std::iter::once(CONFIG).chain(OF_ALL);
        if let (true, Some(name)) = (is_new, others.find(is_there)) {
            let message = format!(
                "{name} is here, and no run with a {} wrote it; choose another folder with -o",
                R::FILE
            );
            return Err(Error::output(dir, message));
        }
        let mut file = RowFile::open(dir, R::FILE)?;
        // The lock is held: files that are half written are left of a crash.
        let folders = Below::ALL.iter().map(|below| dir.join(below.name()));
        for folder in std::iter::once(dir.to_owned()).chain(folders) {
            remove_parts(&folder);
        }
        // Those that are dropped may be of another version.
        let rows = if force { Vec::new() } else { file.read()? };
        let config = config_text(resolved)?;
        let is_same = holds(dir, &config);
        if force {
            file.clear::<R>()?;
        }
        if force || !is_same {
            // They are named by their place in a config.
            clear(dir).map_err(failed)?;
            // These would be of other rows if this run were cut.
            for name in OF_ALL {
                remove(fs::remove_file(dir.join(name))).map_err(failed)?;
            }
        }
        write_atomically(&dir.join(CONFIG), |out| out.write_all(config.as_bytes()))
            .map_err(failed)?;
        Ok(Self {
            dir: dir.to_owned(),
            file,
            rows,
            files: BTreeSet::new(),
            redraw: force,
            is_same: is_same && !force,
            counters: Counters::default(),
        })
    }

    /// The folder for a config: the first of `parent/stem`, `parent/stem-2`, … that holds a run of it, or is not there.
    ///
    /// # Errors
    /// [`Error::Internal`] for a config that cannot be written.
    pub(crate) fn next(parent: &Path, stem: &str, resolved: &Table) -> Result<PathBuf, Error> {
        let config = config_text(resolved)?;
        let mut names =
            std::iter::once(stem.to_owned()).chain((2..).map(|n| format!("{stem}-{n}")));
        let suits = |dir: &PathBuf| {
            dir.symlink_metadata().is_err() || (dir.join(R::FILE).exists() && holds(dir, &config))
        };
        let found = names.by_ref().map(|n| parent.join(n)).find(suits);
        found.ok_or_else(|| Error::Internal("the names have no end".into()))
    }

    /// True if a whole run is here, and not a part of one.
    pub(crate) fn is_whole(dir: &Path) -> bool {
        let manifest: Value = read_manifest(dir);
        manifest["gonio"].is_string() && manifest["shard"].is_null()
    }

    fn wrote(&self, path: &Path, stage: Stage) {
        let bytes = fs::metadata(path).map_or(0, |file| file.len() as usize);
        self.counters.add(stage, Work::FilesWritten, 1);
        self.counters.add(stage, Work::BytesWritten, bytes);
    }

    /// The records that are there, by key.
    pub fn known(&self) -> Known<R> {
        let all = self.rows.iter();
        all.map(|r| (r.key().to_owned(), Arc::clone(r))).collect()
    }

    /// Appends records and hands them to the system, so that a crash of the program loses none of
    /// them, and one of the machine those of a second.
    pub(crate) fn write_rows(&mut self, rows: &[R]) -> Result<(), Error> {
        if rows.is_empty() {
            return Ok(());
        }
        for name in OF_ALL {
            // They are of fewer records now, and shall not look whole.
            remove(fs::remove_file(self.dir.join(name))).map_err(|e| self.failed(&e))?;
        }
        for some in rows.chunks(WRITTEN) {
            self.rows.extend(some.iter().cloned().map(Arc::new));
            self.file.append(some).map_err(|e| self.failed(&e))?;
        }
        Ok(())
    }

    /// The records of some keys, in their order; those of other configs come after them.
    pub(crate) fn sorted(&self, keys: &[RowKey]) -> (Vec<&R>, Vec<&R>) {
        sorted(&self.rows, keys)
    }

    /// Writes one of the named files at the top of the folder.
    pub(crate) fn write_file(
        &mut self,
        name: &'static str,
        bytes: impl AsRef<[u8]>,
    ) -> Result<(), Error> {
        let path = self.dir.join(name);
        write_atomically(&path, |out| out.write_all(bytes.as_ref()))
            .map_err(|e| unwritable(&path, &e))?;
        self.wrote(&path, Stage::Report);
        self.files.insert(name.to_owned());
        Ok(())
    }

    /// Writes a file in one of the folders below.
    pub(crate) fn write_below(
        &mut self,
        below: Below,
        name: &str,
        body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<(), Error> {
        let file = below.file(name);
        let path = self.dir.join(&file);
        let there = self.file.is_there();
        let there = there.and_then(|()| fs::create_dir_all(self.dir.join(below.name())));
        let written = there.and_then(|()| write_atomically(&path, body));
        written.map_err(|e| unwritable(&path, &e))?;
        let stage = match below {
            Below::Schedules => Stage::Report,
            Below::Slices | Below::Figures | Below::Pictures => {
                self.counters.add(Stage::Pictures, Work::Drawn, 1);
                Stage::Pictures
            }
        };
        self.wrote(&path, stage);
        self.files.insert(file);
        Ok(())
    }

    /// Writes a picture, unless it is there: its name stands for its contents.
    pub(crate) fn write_picture<T: AsRef<[u8]>>(
        &mut self,
        name: &str,
        body: impl FnOnce() -> T,
    ) -> Result<(), Error> {
        if self.has(Below::Pictures, name) {
            self.files.insert(Below::Pictures.file(name));
            return Ok(());
        }
        let bytes = body();
        self.write_below(Below::Pictures, name, |out| out.write_all(bytes.as_ref()))
    }

    /// Takes over the files below another folder that are not here.
    pub(crate) fn copy_below(&mut self, from: &Path) -> Result<(), Error> {
        for below in Below::ALL {
            let Ok(entries) = fs::read_dir(from.join(below.name())) else {
                // It has none of them.
                continue;
            };
            let files = entries.flatten().filter(|e| e.path().is_file());
            for entry in files {
                let name = entry.file_name().to_string_lossy().into_owned();
                if !self.has(below, &name) {
                    let bytes = fs::read(entry.path()).map_err(|e| self.failed(&e))?;
                    self.write_below(below, &name, |out| out.write_all(&bytes))?;
                }
            }
        }
        Ok(())
    }

    /// True if a file is in one of the folders below and need not be drawn again.
    pub(crate) fn has(&self, below: Below, name: &str) -> bool {
        let file = below.file(name);
        self.files.contains(&file) || (!self.redraw && self.dir.join(file).exists())
    }

    /// The bytes of a file in one of the folders below, if it is there.
    pub(crate) fn below(&self, below: Below, name: &str) -> Option<Vec<u8>> {
        fs::read(self.dir.join(below.file(name))).ok()
    }

    /// True if nothing was changed since the folder was opened: a finished run is still one.
    pub(crate) fn is_untouched(&self) -> bool {
        self.is_same && self.files.is_empty() && self.dir.join(MANIFEST).exists()
    }

    /// Ends a run: sorts the records by the order of `keys`, and writes the manifest.
    pub(crate) fn finish(
        mut self,
        keys: &[RowKey],
        mut manifest: Manifest,
        machine: &Machine,
    ) -> Result<PathBuf, Error> {
        let (mine, others) = sorted(&self.rows, keys);
        let sorted: Vec<&R> = mine.into_iter().chain(others).collect();
        let written = self.file.finish(&sorted, machine);
        written.map_err(|e| self.failed(&e))?;
        self.files
            .extend([CONFIG, MANIFEST, TIMINGS, R::FILE].map(String::from));
        for below in Below::ALL {
            // Those of an earlier run of the same config.
            let entries = fs::read_dir(self.dir.join(below.name()));
            let names = entries.into_iter().flatten().flatten();
            let names = names.map(|entry| below.file(&entry.file_name().to_string_lossy()));
            self.files.extend(names);
        }
        manifest.files = self.files.iter().cloned().collect();
        write_atomically(&self.dir.join(MANIFEST), |out| {
            serde_json::to_writer_pretty(&mut *out, &manifest)?;
            out.write_all(b"\n")
        })
        .map_err(|e| self.failed(&e))?;
        Ok(self.dir)
    }

    /// What is wrong if a write failed: of a folder that is gone, that it is gone.
    fn failed(&self, e: &io::Error) -> Error {
        let gone = self.file.is_there().err();
        let e = gone.as_ref().unwrap_or(e);
        Error::output(&self.dir, format!("cannot write results: {e}"))
    }
}

/// The records of some keys, in their order, and the others; of several of one key the last.
fn sorted<'r, R: Record>(rows: &'r [Arc<R>], keys: &[RowKey]) -> (Vec<&'r R>, Vec<&'r R>) {
    let rows = rows.iter().map(Arc::as_ref);
    let mut by_key: HashMap<&str, &R> = rows.clone().map(|r| (r.key(), r)).collect();
    let mine = keys.iter().filter_map(|k| by_key.remove(k.as_str()));
    let mine = mine.collect();
    let others = rows.filter(|r| {
        let last = by_key.get(r.key());
        last.is_some_and(|&last| std::ptr::eq(last, *r))
    });
    (mine, others.collect())
}

fn config_text(resolved: &Table) -> Result<String, Error> {
    let config = toml::to_string(resolved).map_err(|e| Error::Internal(e.to_string()))?;
    Ok(format!("{CONFIG_HEAD}{config}"))
}

/// True if this resolved config is in a folder.
fn holds(dir: &Path, config: &str) -> bool {
    let there = files::read(&dir.join(CONFIG), files::CONFIG_LIMIT);
    there.is_ok_and(|there| there == config.as_bytes())
}

/// Removes the schedules, slices and figures that a run wrote, and nothing else.
fn clear(dir: &Path) -> io::Result<()> {
    let manifest: Value = read_manifest(dir);
    let listed = match (&manifest["gonio"], &manifest["files"]) {
        (Value::String(_), Value::Array(files)) => files.as_slice(),
        _ => &[],
    };
    for name in listed.iter().filter_map(Value::as_str) {
        let Some((top, below)) = name.split_once('/') else {
            continue;
        };
        // A manifest that was tampered with shall not lead out of the folder.
        let plain = !below.starts_with('.') && !below.contains(['/', '\\']);
        let ours = [Below::Schedules, Below::Slices, Below::Figures].map(Below::name);
        if ours.contains(&top) && plain {
            remove(fs::remove_file(dir.join(name)))?;
            // Fails as long as something is in it.
            let _ = fs::remove_dir(dir.join(top));
        }
    }
    Ok(())
}

/// A name as part of a file name: letters, digits, `.`, `-` and `_` stay, every other character
/// becomes `%` and its number, so that different names stay different; at most 200 bytes.
pub fn file_stem(name: &str) -> String {
    let mut stem = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '.' | '-' | '_' => stem.push(c),
            _ => stem.push_str(&format!("%{:X}", u32::from(c))),
        }
    }
    shortened(stem, 200)
}

/// Bytes of a file name without its extension: file systems take 255 in all.
const LONGEST: usize = 240;

/// An ASCII name of at most so many bytes: of a longer one its start and its hash.
fn shortened(mut stem: String, longest: usize) -> String {
    if stem.len() > longest {
        let hash = blake3::hash(stem.as_bytes()).to_hex();
        stem.truncate(longest - 17);
        stem = format!("{stem}-{}", &hash[..16]);
    }
    stem
}

/// The file name of a picture of a reconstruction's slice.
pub fn slice_name(job: &Job<'_>) -> String {
    let (material, method) = (&job.material.name, job.method.label());
    let schedule = schedule_stem(&job.schedule);
    let name = format!("{}_{schedule}_{}", file_stem(material), file_stem(&method));
    shortened(name, LONGEST) + ".exr"
}

/// Coordinates as part of a file name.
pub(crate) fn coordinates_stem(coordinates: &Coordinates) -> String {
    if coordinates.name() == NONE {
        return NONE.into();
    }
    let warps = coordinates.spec.warps.iter();
    let warps = warps.map(|(axis, warp)| format!("_{axis}-{}", warp.name()));
    coordinates.name().to_owned() + &warps.collect::<String>()
}

/// The file name, without extension, of a schedule; different for different schedules of a plan.
pub fn schedule_stem(key: &ScheduleKey<'_>) -> String {
    let stem = coordinates_stem(key.coordinates);
    let s = key.symmetry;
    let symmetry: String = [(s.isotropic, 'i'), (s.reciprocal, 'r'), (s.bilateral, 'b')]
        .into_iter()
        .map(|(has, letter)| if has { letter } else { '-' })
        .collect();
    let set = file_stem(&key.sample_set.name);
    let part = |name: &str| format!("_{}", file_stem(name));
    let instrument = key.instrument.map_or(String::new(), |i| part(&i.name));
    let material = key.material.map_or(String::new(), |m| part(&m.name));
    let allowance = match key.allowance {
        Allowance::Poses(n) => n.to_string(),
        Allowance::Readings(n) => format!("{n}readings"),
        Allowance::Minutes(minutes) => format!("{minutes}min"),
    };
    let seed = key.seed;
    let stem = format!("{stem}_{symmetry}_{set}_{allowance}{instrument}{material}_seed{seed}");
    shortened(stem, LONGEST)
}
