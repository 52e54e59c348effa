//! The argument CONFIG of commands that look at experiments.

use super::{detail, set_all};
use crate::error::Error;
use crate::experiment::Source;
use crate::formats::{self, MERL};
use clap::Args;
use std::path::{Path, PathBuf};

/// Name and text of the config that tables are run with; the name leads to it from a checkout.
const OF_TABLES: (&str, &str) = ("configs/merl.toml", include_str!("../../configs/merl.toml"));

/// A config and what overrides it.
#[derive(Debug, Args)]
pub(super) struct ConfigArgs {
    /// The experiment, a TOML file; or a MERL table (*.binary) or a folder of them, on which
    /// configs/merl.toml is done (for `check` also an instrument: file or preset)
    pub(super) config: PathBuf,
    /// Override a key: dotted path, numbers for positions in arrays, `all` for each member that has the rest of the
    /// key; a TOML value, else a bare string
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl ConfigArgs {
    /// The text with every override.
    pub(super) fn source(&self) -> Result<Source, Error> {
        detail(|| format!("gonio: reads {}", self.config.display()));
        let format = formats::of_name(&self.config);
        let is_table = format == Some(MERL);
        if let Some(format) = format.filter(|_| !is_table && self.config.is_file()) {
            let message = format!(
                "a file of format {} is no config; allowed: a config (*.toml), a MERL table \
                 (*.{}), a folder of them",
                format.name,
                MERL.extension()
            );
            return Err(Error::config(self.config.display().to_string(), message));
        }
        let source = match is_table || self.config.is_dir() {
            true => of_tables(&self.config)?,
            false => Source::read(&self.config)?,
        };
        self.apply(source)
    }

    /// A config with every override.
    pub(super) fn apply(&self, mut source: Source) -> Result<Source, Error> {
        set_all(&mut source, &self.set)?;
        Ok(source)
    }

    /// Name of what is done, for folders of results.
    pub(super) fn stem(&self) -> String {
        let folder = match self.config.is_dir() {
            true => self.config.canonicalize().ok(),
            false => None,
        };
        let name = match &folder {
            Some(folder) => folder.file_name(),
            None => self.config.file_stem(),
        };
        name.unwrap_or("run".as_ref())
            .to_string_lossy()
            .into_owned()
    }
}

/// The config of tables for a table, or for those of a folder: what it is set to is written as
/// `--set` would.
fn of_tables(path: &Path) -> Result<Source, Error> {
    let refuse = |message: String| Error::data(path, message);
    let text = |of: Option<&str>| match of {
        Some(text) => Ok(toml::Value::from(text).to_string()),
        None => Err(refuse("the name of this file is not valid UTF-8".into())),
    };
    let (name, config) = OF_TABLES;
    let mut source = Source::new(name, config);
    let mut set = |assignment: String| source.set(&assignment, format!("--set {assignment}"));
    if path.is_dir() {
        set(format!("materials_dir={}", text(path.to_str())?))?;
        return Ok(source);
    }
    std::fs::metadata(path).map_err(|e| refuse(format!("cannot read this file: {e}")))?;
    let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    let dir = dir.unwrap_or(Path::new("."));
    set(format!("materials_dir={}", text(dir.to_str())?))?;
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    set(format!("only=[{}]", text(stem)?))?;
    Ok(source)
}
