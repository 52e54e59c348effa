//! The keys of a config with their values, read but not yet checked against each other.
//!
//! Each table of a config is a plain struct that refuses unknown keys; each choice (material,
//! sample set, reconstruction) is read by its own registry. Whether the values fit each other is
//! [`Plan`](super::Plan)'s business.

use super::checks::distinct;
use super::choices::MAX_BUDGET;
use super::instruments::{self, InstrumentTable};
use super::keypath::KeyPath;
use super::kind::{Kind, QuantityGroup};
use super::materials::{MaterialTable, material};
use super::moments::MomentsTable;
use super::pictures::PictureSpec;
use super::question::ReportSpec;
use super::source::Source;
use super::tables::{Named, named, refuse_unknown, take_list};
use super::training::TuningTable;
use crate::acquisition::{self, Planner};
use crate::brdf::Channels;
use crate::error::{Error, ParameterError, in_closed};
use crate::formats::{Format, WRITE_SCHEDULE};
use crate::metrics::{Measure, MetricsSpec};
use crate::parametrization::{self, Form, HalfDifference, ParametrizationSpec, Warps};
use crate::reconstruct::{self, Coordinates, Multilinear, Reconstruct};
use crate::registry::{self, ReadError, Table, keys};
use crate::schedule::Grid;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::path::PathBuf;
use toml::de::{DeTable, DeValue};

/// The keys of a config's top level.
const KEYS: [&str; 25] = [
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
    "coordinates",
    "instrument",
    "metrics",
    "tuning",
    "moments",
    "band",
    "report",
    "pictures",
    "output",
];

/// An experiment as it was written, defaults filled in.
#[derive(Debug)]
pub(crate) struct Config<'s> {
    /// The text, for the places of later errors.
    pub source: &'s Source,
    /// The keys that are no tables.
    pub scalars: Scalars,
    /// Keys that every MERL file of `materials_dir` gets.
    pub merl: Option<Table<'s>>,
    /// The materials that are written out.
    pub materials: Vec<MaterialTable>,
    /// The parametrizations.
    pub parametrizations: Vec<ParametrizationSpec>,
    /// The sample sets.
    pub sample_sets: Vec<Named<dyn Planner>>,
    /// The reconstructions.
    pub reconstructions: Vec<Named<dyn Reconstruct>>,
    /// Budget limit and sample set of each reconstruction, in the order of `reconstructions`.
    pub reach: Vec<Reach>,
    /// Coordinates that scattered readings are interpolated in; empty: those of their schedule.
    pub coordinates: Vec<Coordinates>,
    /// The instruments; none: the ideal one.
    pub instruments: Vec<InstrumentTable>,
    /// Number, range and seed of the test pairs.
    pub metrics: MetricsSpec,
    /// What the ratios of grids are tuned on.
    pub tuning: Option<TuningTable>,
    /// How their moments are, if `quantities` asks for it.
    pub moments: Option<MomentsTable>,
    /// The largest ratio of errors that counts as no difference.
    pub band: f64,
    /// Factor, reference and challenger of the report.
    pub report: ReportSpec,
    /// Pictures that are drawn of each material.
    pub pictures: PictureSpec,
    /// Files that are written beside the results.
    pub output: Output,
}

/// The keys of a `[[reconstruction]]` that limit where it is used.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reach {
    /// The largest budget it is used at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up_to: Option<i64>,
    /// The one sample set it is used on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<String>,
}

keys! {
    /// The keys of the top level that are no tables.
    #[derive(PartialEq)]
    pub(crate) struct Scalars {
        /// The question the experiment asks; for people.
        #[serde(skip_serializing_if = "Option::is_none")]
        question: Option<String> = None;
        /// Kind of the experiment.
        experiment: Kind = Kind::Acquisition;
        /// Channels that are measured.
        channels: Channels = Channels::Luminance;
        /// Seeds of the sample sets; each makes a run of its own.
        seeds: Vec<i64> = vec![1];
        /// Numbers of distinct configurations a schedule may have.
        budgets: Vec<i64> = vec![250, 1000];
        /// Numbers of poses of a schedule that an instrument can take; its budget is found.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        readings: Vec<i64> = Vec::new();
        /// Times a schedule may take on an instrument, minutes; its budget is found.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        minutes: Vec<f64> = Vec::new();
        /// Distributions of the test pairs.
        measures: Vec<Measure> = Measure::USUAL.to_vec();
        /// Quantities that are compared beside the values; the defaults of its kind if not written.
        quantities: Option<Vec<QuantityGroup>> = None;
        /// A folder whose `*.binary` files are all materials.
        #[serde(skip_serializing_if = "Option::is_none")]
        materials_dir: Option<PathBuf> = None;
        /// The files of that folder that are meant, by name; all of them if not written.
        #[serde(skip_serializing_if = "Option::is_none")]
        only: Option<Vec<String>> = None;
    }
}

/// What is written beside the results: nothing unless asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// The schedules, and in which format.
    pub schedules: Schedules,
    /// Pictures of a slice of truth, reconstruction and difference.
    pub slices: bool,
    /// `results.parquet` beside `results.csv`: the same columns with their types.
    pub parquet: bool,
}

/// Format of the schedules that are written: `false` (none) or the name of a format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Schedules(pub Option<Format>);

impl Serialize for Schedules {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            None => serializer.serialize_bool(false),
            Some(format) => serializer.serialize_str(format.name),
        }
    }
}

impl<'de> Deserialize<'de> for Schedules {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct V;
        impl Visitor<'_> for V {
            type Value = Schedules;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                let names = WRITE_SCHEDULE.formats().map(|f| format!("{:?}", f.name));
                let names: Vec<_> = names.collect();
                write!(f, "false or one of {}", names.join(", "))
            }
            fn visit_bool<E: de::Error>(self, on: bool) -> Result<Schedules, E> {
                if on {
                    Err(E::invalid_value(de::Unexpected::Bool(on), &self))
                } else {
                    Ok(Schedules(None))
                }
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Schedules, E> {
                let format = WRITE_SCHEDULE.named(name);
                let invalid = |_| E::invalid_value(de::Unexpected::Str(name), &self);
                Ok(Schedules(Some(format.map_err(invalid)?)))
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
        let kind = Kind::of(source)?;
        if kind.has_profiles() {
            return Err(Kind::Acquisition.refusal(kind, source));
        }
        let table = source.table()?;
        let config = Self::from_table(source, table, kind).map_err(|e| source.error(e))?;
        config.check()?;
        Ok(config)
    }

    /// Reads the tables of a config of kind `kind`, without checking their values.
    pub(super) fn from_table(
        source: &'s Source,
        mut rest: Table<'s>,
        kind: Kind,
    ) -> Result<Self, ReadError> {
        refuse_unknown(&rest, &KEYS)?;
        let has = |key: &str| rest.get_ref().contains_key(key);
        let no_budgets = !has("budgets") && (has("readings") || has("minutes"));
        let table = &mut rest;
        let usual = || ParametrizationSpec::new::<Form<HalfDifference>>(Warps::new());
        let grid = || Named::from(acquisition::once(Box::new(Grid::default())));
        let multilinear = || Named::from(Box::new(Multilinear::default()) as Box<dyn Reconstruct>);
        let parametrization = |t| parametrization::read(t).map(|spec| *spec);
        Ok(Self {
            source,
            band: take_band(table)?,
            coordinates: take_list(table, "coordinates", registry::parse)?.unwrap_or_default(),
            report: registry::take(table, "report", registry::parse)?.unwrap_or_default(),
            pictures: PictureSpec::take(table, kind.draws())?,
            reach: take_reach(table)?,
            materials: take_list(table, "material", material)?.unwrap_or_default(),
            parametrizations: take_list(table, "parametrization", parametrization)?
                .unwrap_or_else(|| vec![usual()]),
            sample_sets: take_list(table, "sample_set", |t| named(t, acquisition::read))?
                .unwrap_or_else(|| vec![grid()]),
            reconstructions: take_list(table, "reconstruction", |t| named(t, reconstruct::read))?
                .unwrap_or_else(|| vec![multilinear()]),
            instruments: take_list(table, "instrument", instruments::table)?.unwrap_or_default(),
            merl: registry::take_table(table, "merl")?,
            metrics: registry::take(table, "metrics", registry::parse)?.unwrap_or_default(),
            tuning: TuningTable::take(table)?,
            moments: MomentsTable::take(table)?,
            output: registry::take(table, "output", registry::parse)?.unwrap_or_default(),
            scalars: {
                let mut scalars: Scalars = registry::parse(rest)?;
                if no_budgets {
                    scalars.budgets.clear();
                }
                let quantities = scalars.quantities.take();
                scalars.quantities = Some(quantities.unwrap_or_else(|| kind.quantities().to_vec()));
                scalars
            },
        })
    }

    fn check(&self) -> Result<(), Error> {
        let source = self.source;
        in_closed("band", self.band, 1.0, 10.0)
            .map_err(|e| source.error_at(&KeyPath::of("band"), e))?;
        self.pictures.check(source)?;
        for (i, reach) in self.reach.iter().enumerate() {
            let path = KeyPath::of("reconstruction").index(i).key("up_to");
            if let Some(n) = reach.up_to
                && !(1..=MAX_BUDGET as i64).contains(&n)
            {
                let allowed = format!("a whole number from 1 to {MAX_BUDGET}");
                let e = ParameterError::new(path.to_string(), n, allowed);
                return Err(source.error_at(&path, e));
            }
        }
        if !self.coordinates.is_empty() {
            distinct(source, "coordinates", &self.coordinates, Coordinates::label)?;
        }
        Ok(())
    }
}

/// The default band: a twentieth. Less is nothing to choose an acquisition by.
const BAND: f64 = 1.05;

/// Takes `band`.
fn take_band(config: &mut Table<'_>) -> Result<f64, ReadError> {
    let Some(value) = config.get_mut().remove("band") else {
        return Ok(BAND);
    };
    let span = value.span();
    let value = f64::deserialize(toml::de::ValueDeserializer::from(value));
    value.map_err(|e| ReadError::at(span, e.message()))
}

/// Takes the keys of every `[[reconstruction]]` that say where it is used; what is no list of tables
/// is left for its reader to refuse.
fn take_reach(config: &mut Table<'_>) -> Result<Vec<Reach>, ReadError> {
    let Some(list) = config.get_mut().get_mut("reconstruction") else {
        return Ok(vec![Reach::default()]);
    };
    let DeValue::Array(items) = list.get_mut() else {
        return Ok(Vec::new());
    };
    let mut all = Vec::new();
    for item in items.iter_mut() {
        let span = item.span();
        let mut own = DeTable::new();
        if let DeValue::Table(table) = item.get_mut() {
            for key in ["up_to", "on"] {
                if let Some((key, value)) = table.remove_entry(key) {
                    own.insert(key, value);
                }
            }
        }
        all.push(registry::parse(toml::Spanned::new(span, own))?);
    }
    Ok(all)
}

/// The tables of a config that a plan has in another form.
pub(super) struct Written<'c> {
    /// The keys that are no tables.
    pub scalars: toml::Table,
    /// Number of the materials that have a table.
    pub materials: usize,
    pub reconstructions: &'c [(String, std::sync::Arc<dyn Reconstruct>)],
    pub reach: &'c [Reach],
    pub coordinates: &'c [Coordinates],
}
