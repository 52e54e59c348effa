//! `[[instrument]]`: the machines that measure, the flaws that are simulated, and the order in
//! which they visit the poses.

use super::checks::Names;
use super::choices::IDEAL;
use super::choices::Material;
use super::source::Source;
use super::tables::section;
use crate::error::{Error, ParameterError, excerpt, meant, one_of};
use crate::geometry::Symmetry;
use crate::instrument::{self, Bench, InstrumentSpec, Order, Parts};
use crate::registry::{self, ReadError, Table, keys};
use std::path::{Path, PathBuf};

/// A `[[instrument]]` as written.
#[derive(Clone, Debug)]
pub struct InstrumentTable {
    name: Option<String>,
    from: From,
    use_of: Use,
}

/// Source of an instrument's specification.
#[derive(Clone, Debug)]
enum From {
    Preset(String),
    File(PathBuf),
    /// `spec`: the same keys, in the config.
    Spec(Box<InstrumentSpec>),
}

keys! {
    /// Order of an instrument's visits and the flaws that are simulated.
    #[derive(Copy, PartialEq)]
    pub struct Use {
        /// Rule that orders its visits to the poses.
        order: Order = Order::default();
        /// True if it has limits; without them every pose is reachable.
        limits: bool = true;
        /// True if its apertures are finite; without them every reading is one evaluation.
        apertures: bool = true;
        /// True if positions, light, sensor and calibration are noisy.
        noise: bool = true;
        /// True if the error of unreachable poses is found, by measuring without limits too.
        holes: bool = true;
        /// Seed of what all its readings share (offsets of axes, the tile, drift); that of the row if left out.
        realisation: Option<u64> = None;
    }
}

impl Use {
    /// The keys of an `[[instrument]]` and what they mean; one of the first three is needed.
    pub(crate) const KEYS: [(&str, &str); 11] = [
        ("preset", "one of those below"),
        (
            "change",
            "keys of the preset that are others here, as in its file: { picture = { centre_px = 0 } }",
        ),
        ("file", "an instrument file, relative to the working folder"),
        ("spec", "the keys of such a file, here"),
        ("name", "in results; that of the instrument if left out"),
        ("order", "in which the poses are visited"),
        ("limits", "false: every pose is reachable"),
        ("apertures", "false: light and sensor are points"),
        (
            "noise",
            "false: no counts, no offsets and repeatability of axes, no error of tile and lamp",
        ),
        (
            "holes",
            "false: do not measure again without limits to see what unreachable poses cost",
        ),
        (
            "realisation",
            "seed of what all readings of one machine share; that of the row if left out",
        ),
    ];

    /// The parts that are simulated.
    pub fn parts(self) -> Parts {
        Parts {
            limits: self.limits,
            apertures: self.apertures,
            noise: self.noise,
        }
    }
}

pub(super) fn table(mut table: Table<'_>) -> Result<InstrumentTable, ReadError> {
    let span = table.span();
    let name = registry::take_string(&mut table, "name")?;
    let preset = registry::take_string(&mut table, "preset")?;
    let file = registry::take_string(&mut table, "file")?;
    let spec = registry::take_table(&mut table, "spec")?;
    let change = registry::take_table(&mut table, "change")?;
    let changed = match (change, &preset) {
        (None, _) => None,
        (Some(change), Some(preset)) => changed(preset, change)?,
        (Some(change), None) => {
            let message = "change is of the keys of a preset; allowed: with preset, as a file and a spec have all keys themselves";
            return Err(ReadError::new(change.span(), message));
        }
    };
    let from = match (preset, file, spec) {
        (Some(preset), None, None) => match changed {
            Some(spec) => From::Spec(Box::new(spec)),
            None => From::Preset(preset),
        },
        (None, Some(file), None) => From::File(file.into()),
        (None, None, Some(spec)) => From::Spec(Box::new(instrument::read_table(spec)?)),
        _ => {
            let message = "an instrument has one of preset, file and spec; allowed: exactly one";
            return Err(ReadError::new(span, message));
        }
    };
    Ok(InstrumentTable {
        name,
        from,
        use_of: registry::parse(table)?,
    })
}

/// A preset with some of its keys changed; `None` if there is no such preset.
fn changed(name: &str, change: Table<'_>) -> Result<Option<InstrumentSpec>, ReadError> {
    let span = change.span();
    let known = instrument::presets().into_iter().find(|p| p.name == name);
    let Some(preset) = known else {
        return Ok(None);
    };
    let of_change = |e: &dyn std::fmt::Display| ReadError::new(span.clone(), e.to_string());
    let mut keys: toml::Table = toml::from_str(preset.text).map_err(|e| of_change(&e))?;
    merge(&mut keys, registry::parse(change)?);
    let text = toml::to_string(&keys).map_err(|e| of_change(&e))?;
    instrument::read(&text)
        .map(Some)
        .map_err(|e| of_change(&format_args!("change: {}", e.message)))
}

/// Sets the values of a table to those of another, tables in them key by key.
fn merge(keys: &mut toml::Table, change: toml::Table) {
    for (key, value) in change {
        match (keys.get_mut(&key), value) {
            (Some(toml::Value::Table(keys)), toml::Value::Table(change)) => merge(keys, change),
            (_, value) => {
                keys.insert(key, value);
            }
        }
    }
}

/// An instrument that measures.
#[derive(Clone, Debug)]
pub struct PlannedInstrument {
    /// Its name in results, unique in its plan.
    pub name: String,
    /// Its specification: every key with its value.
    pub spec: InstrumentSpec,
    /// Order of its visits and the flaws that are simulated.
    pub use_of: Use,
    /// Name of its preset, if it is one.
    preset: Option<String>,
}

impl PlannedInstrument {
    /// The instrument that a preset's name or a file's path means, visiting the poses in this order.
    ///
    /// # Errors
    /// As [`load`].
    pub fn load(preset_or_path: &str, order: Order) -> Result<Self, Error> {
        let usual = Use::default();
        Ok(Self::new(load(preset_or_path)?, Use { order, ..usual }))
    }

    /// The instrument of a specification, under its own name.
    pub fn new(spec: InstrumentSpec, use_of: Use) -> Self {
        Self {
            name: spec.name.clone(),
            spec,
            use_of,
            preset: None,
        }
    }

    /// Refuses an anisotropic material on a machine that cannot turn it; `place` is where the instrument is named.
    ///
    /// # Errors
    /// [`Error::Infeasible`].
    pub fn check_symmetry(
        &self,
        symmetry: Symmetry,
        material: &str,
        place: impl FnOnce() -> String,
    ) -> Result<(), Error> {
        // The specification was checked when it was read.
        let class = self.spec.kinematic_class();
        let class = class.map_err(Error::internal)?;
        if symmetry.isotropic || !class.isotropic_only {
            return Ok(());
        }
        let message = format!(
            "instrument \"{}\" is of class {}, which cannot turn the sample about its normal, and \
             {material} is anisotropic; allowed: isotropic materials, or an instrument of another \
             class",
            self.name, class.name,
        );
        Err(Error::infeasible(place(), message))
    }

    /// Seed of what all its readings share, in rows of a seed.
    pub fn realisation(&self, seed: u64) -> u64 {
        self.use_of.realisation.unwrap_or(seed)
    }

    /// The machine that measures the rows of a seed.
    ///
    /// # Errors
    /// As [`Bench::new`]; none for a plan's instruments, which were tried.
    pub fn bench(&self, parts: Parts, seed: u64) -> Result<Bench, ParameterError> {
        Bench::new(&self.spec, parts, self.realisation(seed))
    }

    pub(crate) fn resolved(&self) -> toml::Table {
        let mut table = toml::Table::new();
        match &self.preset {
            Some(preset) => table.insert("preset".into(), preset.clone().into()),
            None => table.insert("spec".into(), section(&self.spec).into()),
        };
        table.insert("name".into(), self.name.clone().into());
        table.extend(section(&self.use_of));
        table
    }
}

/// The instrument that a preset's name or a file's path means.
///
/// # Errors
/// [`Error::Config`], with file and line.
pub fn load(preset_or_path: &str) -> Result<InstrumentSpec, Error> {
    if let Some(spec) = preset(preset_or_path)? {
        return Ok(spec);
    }
    let path = Path::new(preset_or_path);
    let looks_like_a_file = path.extension().is_some() || path.components().count() > 1;
    if looks_like_a_file || path.exists() {
        return read(path);
    }
    let presets = instrument::presets();
    let names: Vec<_> = presets.iter().map(|p| p.name).collect();
    let message = format!(
        "\"{}\" is no instrument; allowed: {}, or the path of a file.toml{}",
        excerpt(preset_or_path),
        names.join(", "),
        meant(preset_or_path, &names)
    );
    Err(Error::config("--instrument", message))
}

fn preset(name: &str) -> Result<Option<InstrumentSpec>, Error> {
    let presets = instrument::presets();
    let Some(preset) = presets.iter().find(|p| p.name == name) else {
        return Ok(None);
    };
    let spec = instrument::read(preset.text);
    let spec = spec.map_err(|e| Error::Internal(format!("preset {name}: {e}")))?;
    Ok(Some(spec))
}

fn read(path: &Path) -> Result<InstrumentSpec, Error> {
    let source = Source::read(path)?;
    instrument::read_table(source.table()?).map_err(|e| source.error(e))
}

/// Reads every instrument of a config and checks it against the materials.
pub(super) fn gather(
    source: &Source,
    tables: Vec<InstrumentTable>,
    materials: &[Material],
) -> Result<Vec<PlannedInstrument>, Error> {
    let mut names_taken = Names::default();
    let mut list = Vec::with_capacity(tables.len());
    for (i, table) in tables.into_iter().enumerate() {
        let at = source.place("instrument").index(i);
        let (spec, preset) = match table.from {
            From::Preset(name) => match preset(&name)? {
                Some(spec) => (spec, Some(name)),
                None => {
                    let name = excerpt(&name);
                    let presets = instrument::presets();
                    let allowed = one_of(&name, presets.iter().map(|p| p.name));
                    let predicate = format!("= \"{name}\"; allowed: {allowed}");
                    return Err(at.key("preset").problem(predicate));
                }
            },
            From::File(file) => {
                if !file.is_file() {
                    return Err(at.key("file").problem(format_args!(
                        "= {file:?}: there is no such file; allowed: an instrument file, its path \
                         relative to the folder gonio is started in"
                    )));
                }
                (read(&file)?, None)
            }
            From::Spec(spec) => (*spec, None),
        };
        let name = table.name.unwrap_or_else(|| spec.name.clone());
        names_taken.take(&at, &name)?;
        if name == IDEAL {
            let predicate =
                format!("= \"{IDEAL}\" is the instrument without flaws; allowed: another");
            return Err(at.key("name").problem(predicate));
        }
        let planned = PlannedInstrument {
            name,
            spec,
            use_of: table.use_of,
            preset,
        };
        for material in materials {
            let name = format!("material \"{}\"", material.name);
            planned.check_symmetry(material.symmetry, &name, || at.location())?;
        }
        list.push(planned);
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_are_those_that_are_read() {
        let read = ["preset", "change", "file", "spec", "name"];
        let read = read.iter().chain(Use::NAMES);
        assert!(Use::KEYS.iter().map(|(key, _)| key).eq(read));
    }
}
