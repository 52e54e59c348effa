//! The argument CONFIG of commands that look at experiments.

use super::{detail, set_all, set_below};
use crate::error::Error;
use crate::experiment::{Source, is_config_key, keys_of_file, materials};
use crate::files::is_stream;
use crate::formats::{self, MERL};
use clap::Args;
use std::path::{Path, PathBuf};
use toml_edit::DocumentMut;

/// Name and text of the config that tables are run with; the name leads to it from a checkout.
const OF_TABLES: (&str, &str) = ("configs/merl.toml", include_str!("../../configs/merl.toml"));

/// Keys of a material, as a config writes them, of a file of one or of a kind; `None` of another target.
pub(super) fn keys_of_material(target: &Path) -> Option<String> {
    let is_kind = |name: &&str| materials().into_iter().any(|entry| entry.kind == *name);
    match target.to_str().filter(is_kind) {
        // A file may be called as a kind is.
        Some(kind) if !target.is_file() => Some(format!("kind = \"{kind}\"")),
        _ => keys_of_file(target).map(|keys| keys.to_string()),
    }
}

/// A config and what overrides it.
#[derive(Debug, Args)]
pub(super) struct ConfigArgs {
    /// The experiment, a TOML file; or a material, on which configs/merl.toml is done: a table, a folder of MERL tables,
    /// readings, or a kind (see `gonio list materials`; for `check` also an instrument: file or preset)
    pub(super) config: PathBuf,
    /// Override a key of the config, or set one of the material that stands in its place: dotted path, numbers for positions in
    /// arrays, `all` for each member that has the rest of the key; a TOML value, else a bare string
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
}

impl ConfigArgs {
    /// The text with every override.
    pub(super) fn source(&self) -> Result<Source, Error> {
        detail(|| format!("gonio: reads {}", self.config.display()));
        let path = &self.config;
        let of_config = path.extension().is_some_and(|e| e == "toml") || is_stream(path);
        if formats::of_name(path) == Some(MERL) || path.is_dir() {
            return self.apply(of_tables(path)?);
        }
        match keys_of_material(path).filter(|_| !of_config) {
            None => self.apply(Source::read(path)?),
            Some(keys) => {
                let (name, config) = OF_TABLES;
                let mut config: DocumentMut = config.parse().map_err(Error::internal)?;
                for key in ["materials_dir", "merl"] {
                    config.remove(key);
                }
                let text = format!("{config}\n[[material]]\n{keys}\n");
                let mut source = Source::new(name, text);
                set_below(&mut source, &self.set, |first| match is_config_key(first) {
                    true => "",
                    false => "material.0.",
                })?;
                Ok(source)
            }
        }
    }

    /// A config with every override.
    pub(super) fn apply(&self, mut source: Source) -> Result<Source, Error> {
        set_all(&mut source, &self.set)?;
        Ok(source)
    }

    /// Name of what is done, for folders of results.
    pub(super) fn stem(&self) -> String {
        let folder = self.config.canonicalize().ok().filter(|dir| dir.is_dir());
        let name = match &folder {
            Some(folder) => folder.file_name(),
            None => self.config.file_stem(),
        };
        let name = name.unwrap_or("run".as_ref());
        name.to_string_lossy().into_owned()
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
    std::fs::metadata(path).map_err(|e| refuse(format!("cannot read this file: {e}")))?;
    let parent = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    let dir = match path.is_dir() {
        true => path,
        false => parent.unwrap_or(Path::new(".")),
    };
    set(format!("materials_dir={}", text(dir.to_str())?))?;
    if !path.is_dir() {
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        set(format!("only=[{}]", text(stem)?))?;
    }
    Ok(source)
}
