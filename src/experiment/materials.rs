//! The materials of a plan: those written out, and the MERL files of a folder.

use super::checks::{Names, Place, distinct, refuse_empty};

use super::of_readings;
use super::source::Source;
use super::tables::{Named, insert_list, named, section};
use crate::analysis::Alignment;
use crate::brdf::{self, Brdf, BrdfSpec, BuildError, Channels, Favours, SplitBrdf};
use crate::error::{Error, listed};
use crate::formats::{self, MERL};
use crate::geometry::Symmetry;
use crate::light_paths;
use crate::registry::{self, Entry, ReadError, Table, with};
use serde::Deserialize;
use std::borrow::Cow;
use std::path::Path;
use std::sync::Once;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A material to be measured.
#[derive(Debug)]
pub struct Material {
    /// Its name in results, unique in its plan.
    pub name: String,
    /// Specification it is built from.
    pub spec: Box<dyn BrdfSpec>,
    /// Symmetries that its schedules use to fold the coordinates.
    pub symmetry: Symmetry,
    /// What is peculiar about its files, a sentence each.
    pub remarks: Vec<String>,
}

impl Material {
    /// Its kind, which it shares with the materials it is compared with.
    pub(crate) fn group(&self) -> String {
        let resolved = self.spec.resolved();
        let kind = resolved.get("kind").and_then(toml::Value::as_str);
        kind.unwrap_or_default().to_owned()
    }

    /// True if it has values in R, G, B.
    pub(crate) fn is_coloured(&self) -> bool {
        self.spec.check(&Channels::Rgb).is_ok()
    }

    /// Truth class of its rows: the coordinates it favours, by its alignment if that is known. Anisotropic materials are one class.
    pub(crate) fn truth(&self, alignment: Option<&Alignment>) -> &'static str {
        let declared = self.spec.favours();
        let favours = alignment.map_or(declared, |a| declared.measured(a.q, a.standard_error));
        if self.symmetry.isotropic || favours == Favours::SphericalTable {
            favours.name()
        } else {
            "anisotropic"
        }
    }
}

/// A `[[material]]`.
#[derive(Debug)]
pub struct MaterialTable {
    /// Its name and model.
    pub named: Named<dyn BrdfSpec>,
    /// Symmetries that schedules assume instead of those its BRDF declares.
    pub symmetry: SymmetryTable,
}

impl From<Box<dyn BrdfSpec>> for MaterialTable {
    fn from(spec: Box<dyn BrdfSpec>) -> Self {
        Self {
            named: Named::from(spec),
            symmetry: SymmetryTable::default(),
        }
    }
}

impl MaterialTable {
    /// Its name, written or made from its keys.
    fn name(&self) -> String {
        let name = self.named.name.clone();
        name.unwrap_or_else(|| self.named.choice.label())
    }

    /// The material, whose keys are checked.
    pub(super) fn checked(self, at: &Place<'_>, channels: &Channels) -> Result<Material, Error> {
        let (name, spec) = (self.name(), self.named.choice);
        let declared = spec.check(channels).and_then(|()| spec.symmetry(channels));
        let declared = declared.map_err(|e| at.not_built(e))?;
        Ok(Material {
            symmetry: self.symmetry.over(declared),
            remarks: spec.remarks(),
            name,
            spec,
        })
    }
}

/// Symmetries that a config overrides, one by one.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SymmetryTable {
    isotropic: Option<bool>,
    reciprocal: Option<bool>,
    bilateral: Option<bool>,
}

impl SymmetryTable {
    /// The symmetries to assume of a BRDF that declares `declared`.
    pub(crate) fn over(self, declared: Symmetry) -> Symmetry {
        Symmetry {
            isotropic: self.isotropic.unwrap_or(declared.isotropic),
            reciprocal: self.reciprocal.unwrap_or(declared.reciprocal),
            bilateral: self.bilateral.unwrap_or(declared.bilateral),
        }
    }
}

/// Every kind of material that a config can name. Files of readings and materials whose light paths are followed join those of
/// [`brdf::all`] as the members of a program do, so that materials made of other materials have them too.
pub fn all() -> Vec<Entry<dyn BrdfSpec>> {
    static JOIN: Once = Once::new();
    // A program's own kind of this name stays.
    JOIN.call_once(|| {
        for entry in [
            of_readings::ENTRY,
            light_paths::SMITH_MULTIPLE,
            #[cfg(feature = "surfaces")]
            light_paths::MICRO_SURFACE,
        ] {
            _ = brdf::join(entry);
        }
    });
    brdf::all()
}

fn read(table: Table<'_>) -> Result<Box<dyn BrdfSpec>, ReadError> {
    registry::read("material", &all(), table)
}

pub(super) fn material(mut table: Table<'_>) -> Result<MaterialTable, ReadError> {
    let symmetry = registry::take(&mut table, "symmetry", registry::parse)?;
    Ok(MaterialTable {
        named: named(table, read)?,
        symmetry: symmetry.unwrap_or_default(),
    })
}

/// Writes the materials of a plan into its resolved config: the first `written` one by one, of files of a folder their keys.
pub(super) fn insert_materials(table: &mut toml::Table, materials: &[Material], written: usize) {
    let (written, files) = materials.split_at(written);
    if let Some(first) = files.first() {
        let mut keys = first.spec.resolved();
        keys.remove("kind");
        keys.remove("path");
        table.insert("merl".into(), keys.into());
    }
    insert_list(table, "material", written.iter().map(written_out));
}

/// A material as a config writes it out.
pub(super) fn written_out(material: &Material) -> toml::Table {
    let table = with(material.spec.resolved(), "name", &*material.name);
    with(table, "symmetry", section(&material.symmetry))
}

/// Checks and names every material for a scene in `channels`: those of `tables`, and the MERL files of the folder `dir`, all or
/// `only` some, with the keys `merl`. Also returns the names of `only` that the folder does not have.
pub(super) fn gather(
    source: &Source,
    tables: Vec<MaterialTable>,
    dir: Option<&Path>,
    only: Option<&[String]>,
    merl: Option<Table<'_>>,
    channels: &Channels,
) -> Result<(Vec<Material>, Vec<String>), Error> {
    if let Some(only) = only {
        let at = source.place("only");
        refuse_empty(&at, only)?;
        distinct(&at, only, String::clone)?;
    }
    let mut missing = only.unwrap_or_default().to_vec();
    let mut names = Names::default();
    let mut materials = Vec::new();
    for (i, table) in tables.into_iter().enumerate() {
        let at = source.place("material").index(i);
        names.take(&at, &table.name())?;
        materials.push(table.checked(&at, channels)?);
    }
    let at = source.place("merl");
    match (dir, merl) {
        (Some(dir), merl) => {
            let mut found = Vec::new();
            for spec in files(source, dir, merl)? {
                let name = spec.label();
                if only.is_some_and(|only| !only.contains(&name)) {
                    continue;
                }
                missing.retain(|wanted| *wanted != name);
                names.take(&source.place("materials_dir"), &name)?;
                let declared = spec.check(channels).and_then(|()| spec.symmetry(channels));
                found.push((name, spec, declared));
            }
            if found.is_empty() {
                let message = format!(
                    "this folder has none of the {} files that `only` names, e.g. {}.{}; \
                     choose another folder with --set materials_dir=DIR",
                    missing.len(),
                    missing.first().map_or("", String::as_str),
                    MERL.extension()
                );
                return Err(Error::data(dir, message));
            }
            let of_files = of_files(found).map_err(|e| at.not_built(e))?;
            materials.extend(of_files);
        }
        (None, Some(_)) => {
            let message = "merl has keys for the files of materials_dir, which is not set; \
                           allowed: both or neither";
            return Err(at.error(message));
        }
        (None, None) => {}
    }
    if let (None, Some(_)) = (dir, only) {
        let message =
            "only names files of materials_dir, which is not set; allowed: both or neither";
        return Err(source.place("only").error(message));
    }
    if materials.is_empty() {
        let message = "material is missing; allowed: at least one [[material]], or materials_dir";
        return Err(source.place("material").error(message));
    }
    Ok((materials, missing))
}

/// A file of a folder: its name, what it is, and the symmetries that it declares, or why it cannot be read.
type OfFile = (String, Box<dyn BrdfSpec>, Result<Symmetry, BuildError>);

/// The materials of a folder's files. One that cannot be read, whose jobs fail, has the symmetries of the first that can.
fn of_files(found: Vec<OfFile>) -> Result<Vec<Material>, BuildError> {
    let mut declared = found.iter().map(|(.., declared)| declared);
    let usual = declared.find_map(|d| d.as_ref().ok().copied());
    let material = |(name, spec, declared): OfFile| {
        let (symmetry, remarks) = match (declared, usual) {
            (Ok(symmetry), _) => (symmetry, spec.remarks()),
            (Err(BuildError::Data { .. }), Some(usual)) => (usual, Vec::new()),
            (Err(e), _) => return Err(e),
        };
        Ok(Material {
            name,
            spec,
            symmetry,
            remarks,
        })
    };
    found.into_iter().map(material).collect()
}

/// Keys of a MERL file that the files of a folder do not share.
pub(super) const OF_ONE_FILE: [&str; 4] = ["kind", "path", "name", "symmetry"];

/// The specs of a folder's files, sorted by name.
fn files(
    source: &Source,
    dir: &Path,
    keys: Option<Table<'_>>,
) -> Result<Vec<Box<dyn BrdfSpec>>, Error> {
    let keys = keys.unwrap_or_else(|| Spanned::new(0..0, DeTable::new()));
    for key in OF_ONE_FILE {
        if keys.get_ref().contains_key(key) {
            let at = source.place("merl").key(key);
            return Err(at.error(format_args!(
                "unknown key {at}; allowed: the keys of material kind merl that suit every file"
            )));
        }
    }
    let unusable = |message: String| {
        let advice = "choose another folder with --set materials_dir=DIR";
        Error::data(dir, format!("{message}; {advice}"))
    };
    let extension = MERL.extension();
    let paths = formats::files_in(dir, &MERL)
        .map_err(|e| unusable(format!("no folder to look for *.{extension} files in: {e}")))?;
    if paths.is_empty() {
        let message = format!("this folder holds no MERL file; looked for *.{extension}");
        return Err(unusable(message));
    }
    let mut specs = Vec::with_capacity(paths.len());
    for path in paths {
        let Some(text) = path.to_str() else {
            return Err(Error::data(
                path,
                "the name of this file is not valid UTF-8",
            ));
        };
        let mut table = keys.clone();
        for (key, value) in [("kind", "merl"), ("path", text)] {
            let value = DeValue::String(Cow::Owned(value.to_owned()));
            let entry = (Spanned::new(0..0, key.into()), Spanned::new(0..0, value));
            table.get_mut().insert(entry.0, entry.1);
        }
        specs.push(read(table).map_err(|e| source.error(e))?);
    }
    Ok(specs)
}

/// The material as one whose light is split by scattering order.
///
/// # Errors
/// If it is of a kind whose light is not.
pub fn split_of<'a>(name: &str, brdf: &'a dyn Brdf) -> Result<&'a dyn SplitBrdf, Error> {
    brdf.as_split().ok_or_else(|| {
        let kinds = all().into_iter().filter(|entry| {
            let spec = registry::read_text(entry, entry.examples.first().copied().unwrap_or(""));
            // Those of files are tables.
            let spec = spec.ok().filter(|spec| spec.tables().files.is_empty());
            let built = spec.and_then(|spec| spec.build(Channels::Luminance).ok());
            built.is_some_and(|brdf| brdf.as_split().is_some())
        });
        let message = format!(
            "this material does not tell light by the number of facets that it met; allowed: one of kind {}",
            listed(kinds.map(|entry| entry.kind))
        );
        Error::config(name, message)
    })
}
