//! What a config says: every key with its value, read but not yet put together.
//!
//! Each table of a config is a plain struct that refuses unknown keys; each choice (material,
//! sample set, reconstruction) is read by its own registry. Whether the values fit each other is
//! [`Plan`](super::Plan)'s business.

use super::instruments::{self, InstrumentTable};
use super::kind::Kind;
use super::moments::MomentsTable;
use super::source::Source;
use crate::brdf::{self, BrdfSpec, Channels};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::metrics::{Measure, MetricsSpec};
use crate::parametrization::{self, WarpName};
use crate::reconstruct::{self, Reconstruct};
use crate::registry::{self, ReadError, Table};
use crate::schedule::{self, SampleSet, ScheduleFormat};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

/// The keys of a config's top level.
pub(super) const KEYS: [&str; 20] = [
    "question",
    "experiment",
    "channels",
    "seeds",
    "budgets",
    "readings",
    "minutes",
    "measures",
    "quantities",
    "materials_dir",
    "only",
    "merl",
    "material",
    "parametrization",
    "sample_set",
    "reconstruction",
    "instrument",
    "metrics",
    "moments",
    "output",
];

/// Keys of the elements of a list that are read before their family sees the table, and so are
/// missing from what it lists as allowed.
pub(super) const COMMON_KEYS: [(&str, &[&str]); 6] = [
    ("instrument", &["preset", "file", "spec", "name"]),
    ("lighting", &["kind", "name"]),
    ("material", &["kind", "name", "symmetry"]),
    ("parametrization", &["kind"]),
    ("sample_set", &["kind", "name"]),
    ("reconstruction", &["kind", "name"]),
];

/// An experiment as it was written, defaults filled in.
#[derive(Debug)]
pub struct Config<'s> {
    /// The text, for the places of later errors.
    pub source: &'s Source,
    /// The keys that are no tables.
    pub scalars: Scalars,
    /// Keys that every MERL file of `materials_dir` gets.
    pub merl: Option<Table<'s>>,
    /// The materials that are written out.
    pub materials: Vec<MaterialTable>,
    /// The parametrizations.
    pub parametrizations: Vec<ParametrizationTable>,
    /// The sample sets.
    pub sample_sets: Vec<Named<dyn SampleSet>>,
    /// The reconstructions.
    pub reconstructions: Vec<Named<dyn Reconstruct>>,
    /// The instruments; none: the ideal one.
    pub instruments: Vec<InstrumentTable>,
    /// How reconstructions are compared with the truth.
    pub metrics: MetricsSpec,
    /// How their moments are, if `quantities` asks for it.
    pub moments: Option<MomentsTable>,
    /// What is written beside the results.
    pub output: Output,
}

/// The keys of the top level that are no tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scalars {
    /// What the experiment asks; for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub question: Option<String>,
    /// Which kind of experiment this is.
    pub experiment: Kind,
    /// What is measured.
    pub channels: Channels,
    /// Seeds of the sample sets; each makes a run of its own.
    pub seeds: Vec<i64>,
    /// Numbers of distinct configurations a schedule may have.
    pub budgets: Vec<i64>,
    /// Numbers of poses of a schedule that an instrument can take; its budget is found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub readings: Vec<i64>,
    /// Times a schedule may take on an instrument; its budget is found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub minutes: Vec<f64>,
    /// Distributions of the test pairs.
    pub measures: Vec<Measure>,
    /// What is compared beside the values.
    pub quantities: Vec<Quantity>,
    /// A folder whose `*.binary` files are all materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub materials_dir: Option<PathBuf>,
    /// The files of that folder that are meant, by name; all of them if not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only: Option<Vec<String>>,
}

/// What a run compares beside the values of truth and reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// The moments of their slices, see [`moments`](crate::moments).
    Moments,
}

impl Quantity {
    /// As configs write it.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Moments => "moments",
        }
    }
}

impl Default for Scalars {
    fn default() -> Self {
        Self {
            question: None,
            experiment: Kind::Acquisition,
            channels: Channels::Luminance,
            seeds: vec![1],
            budgets: vec![250, 1000],
            readings: Vec::new(),
            minutes: Vec::new(),
            measures: Measure::ALL.to_vec(),
            quantities: Vec::new(),
            materials_dir: None,
            only: None,
        }
    }
}

/// A choice with the name it has in results, if one is written.
#[derive(Debug)]
pub struct Named<T: ?Sized> {
    /// `name`.
    pub name: Option<String>,
    /// The member of its family.
    pub choice: Box<T>,
}

/// A `[[material]]`.
#[derive(Debug)]
pub struct MaterialTable {
    /// Its name and model.
    pub named: Named<dyn BrdfSpec>,
    /// What schedules assume of it instead of what its BRDF declares.
    pub symmetry: SymmetryTable,
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
    pub fn over(self, declared: Symmetry) -> Symmetry {
        Symmetry {
            isotropic: self.isotropic.unwrap_or(declared.isotropic),
            reciprocal: self.reciprocal.unwrap_or(declared.reciprocal),
            bilateral: self.bilateral.unwrap_or(declared.bilateral),
        }
    }
}

/// A `[[parametrization]]`.
#[derive(Clone, Debug)]
pub struct ParametrizationTable {
    /// Its name in [`parametrization::all`].
    pub name: &'static str,
    /// Warps by axis symbol.
    pub warp: BTreeMap<String, WarpName>,
}

/// What is written beside the results: nothing unless asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// The schedules, and in which format.
    pub schedules: Schedules,
    /// Pictures of a slice of truth, reconstruction and difference.
    pub slices: bool,
}

/// Whether schedules are written: `false` or the name of a format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Schedules(pub Option<ScheduleFormat>);

impl Serialize for Schedules {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            None => serializer.serialize_bool(false),
            Some(format) => format.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Schedules {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct V;
        impl Visitor<'_> for V {
            type Value = Schedules;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("false, \"csv\" or \"json-lines\"")
            }
            fn visit_bool<E: de::Error>(self, on: bool) -> Result<Schedules, E> {
                if on {
                    Err(E::invalid_value(de::Unexpected::Bool(on), &self))
                } else {
                    Ok(Schedules(None))
                }
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Schedules, E> {
                match name {
                    "csv" => Ok(Schedules(Some(ScheduleFormat::Csv))),
                    "json-lines" => Ok(Schedules(Some(ScheduleFormat::JsonLines))),
                    _ => Err(E::invalid_value(de::Unexpected::Str(name), &self)),
                }
            }
        }
        deserializer.deserialize_any(V)
    }
}

impl<'s> Config<'s> {
    /// Reads a config.
    ///
    /// # Errors
    /// [`Error::Config`] with the place of the first key that is unknown, missing or of another type.
    pub fn read(source: &'s Source) -> Result<Self, Error> {
        Kind::Acquisition.require(source)?;
        Self::from_table(source, source.table()?, &KEYS).map_err(|e| source.error(e))
    }

    /// Reads the tables that kinds of experiments share; `keys` are those the kind allows.
    pub(super) fn from_table(
        source: &'s Source,
        mut table: Table<'s>,
        keys: &[&str],
    ) -> Result<Self, ReadError> {
        refuse_unknown(&table, keys)?;
        let materials = take_list(&mut table, "material", material)?;
        let parametrizations = take_list(&mut table, "parametrization", parametrization)?;
        let sample_sets = take_list(&mut table, "sample_set", |t| named(t, schedule::read))?;
        let reconstructions = take_list(&mut table, "reconstruction", |t| {
            named(t, reconstruct::read)
        })?;
        let instruments = take_list(&mut table, "instrument", instruments::table)?;
        let merl = registry::take_table(&mut table, "merl")?;
        let metrics = registry::take_table(&mut table, "metrics")?;
        let moments = MomentsTable::take(&mut table)?;
        let output = registry::take_table(&mut table, "output")?;
        let has = |key: &str| table.get_ref().contains_key(key);
        let no_budgets = !has("budgets") && (has("readings") || has("minutes"));
        let mut scalars: Scalars = registry::parse(table)?;
        if no_budgets {
            scalars.budgets.clear();
        }
        Ok(Self {
            source,
            scalars,
            merl,
            materials: materials.unwrap_or_default(),
            parametrizations: parametrizations.unwrap_or_else(|| {
                let table = |name| ParametrizationTable {
                    name,
                    warp: BTreeMap::new(),
                };
                vec![table("half-difference")]
            }),
            sample_sets: match sample_sets {
                Some(list) => list,
                None => vec![default_choice("grid", schedule::read)?],
            },
            reconstructions: match reconstructions {
                Some(list) => list,
                None => vec![default_choice("multilinear", reconstruct::read)?],
            },
            instruments: instruments.unwrap_or_default(),
            metrics: metrics
                .map(registry::parse)
                .transpose()?
                .unwrap_or_default(),
            moments,
            output: output.map(registry::parse).transpose()?.unwrap_or_default(),
        })
    }
}

/// Refuses a config with a key of the top level that is not in `keys`.
pub(super) fn refuse_unknown(table: &Table<'_>, keys: &[&str]) -> Result<(), ReadError> {
    for key in table.get_ref().keys() {
        let name = key.get_ref().as_ref();
        if !keys.contains(&name) {
            let allowed = keys.join(", ");
            let message = format!("unknown key {name}; allowed: {allowed}");
            return Err(ReadError::at(key.span(), message));
        }
    }
    Ok(())
}

/// Takes an array of tables and reads each; `None` if the key is absent, which is not the same as
/// an empty list.
pub(super) fn take_list<'s, T>(
    table: &mut Table<'s>,
    key: &str,
    read: impl Fn(Table<'s>) -> Result<T, ReadError>,
) -> Result<Option<Vec<T>>, ReadError> {
    let Some(tables) = registry::take_tables(table, key)? else {
        return Ok(None);
    };
    tables
        .into_iter()
        .map(read)
        .collect::<Result<_, _>>()
        .map(Some)
}

/// Takes `name` and lets the family read the rest.
pub(super) fn named<'s, T: ?Sized>(
    mut table: Table<'s>,
    read: impl Fn(Table<'s>) -> Result<Box<T>, ReadError>,
) -> Result<Named<T>, ReadError> {
    let name = registry::take_string(&mut table, "name")?;
    let choice = read(table)?;
    Ok(Named { name, choice })
}

pub(super) fn material(mut table: Table<'_>) -> Result<MaterialTable, ReadError> {
    let symmetry = registry::take_table(&mut table, "symmetry")?;
    let symmetry = symmetry.map(registry::parse).transpose()?;
    Ok(MaterialTable {
        named: named(table, brdf::read)?,
        symmetry: symmetry.unwrap_or_default(),
    })
}

fn parametrization(mut table: Table<'_>) -> Result<ParametrizationTable, ReadError> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Rest {
        #[serde(default)]
        warp: BTreeMap<String, WarpName>,
    }
    let names: Vec<_> = parametrization::all().iter().map(|e| e.name).collect();
    let index = registry::take_kind("parametrization", &names, &mut table)?;
    let Rest { warp } = registry::parse(table)?;
    Ok(ParametrizationTable {
        name: names[index],
        warp,
    })
}

/// The member of a family that a config gets if it names none.
fn default_choice<T: ?Sized>(
    kind: &str,
    read: fn(Table<'_>) -> Result<Box<T>, ReadError>,
) -> Result<Named<T>, ReadError> {
    let text = format!("kind = \"{kind}\"");
    let choice = read(toml::de::DeTable::parse(&text)?)?;
    Ok(Named { name: None, choice })
}
