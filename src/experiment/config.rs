//! The keys of a config with their values: ranges, and keys that exclude each other, are checked here, and whether the choices
//! fit each other by [`Plan`](super::Plan). Each table is a plain struct that refuses unknown keys; each choice (material,
//! sample set, reconstruction) is read by its own registry.

use super::checks::{distinct, refuse_empty};
use super::choices::{MAX_BUDGET, Reach};
use super::instruments::{self, InstrumentTable};
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
use crate::error::{Error, ParameterError, in_closed, in_left_open, listed};
use crate::formats::{Format, WRITE_SCHEDULE};
use crate::metrics::{self, Measure, MetricsSpec};
use crate::parametrization::{self, Form, HalfDifference, ParametrizationSpec, Warps};
use crate::reconstruct::{self, Coordinates, Multilinear, Reconstruct};
use crate::registry::{self, ReadError, Table, keys};
use crate::schedule::Grid;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use toml::de::DeTable;

/// The keys of a config's top level that are tables, and `band`.
const TABLES: [&str; 14] = [
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

/// True of a key of a config's top level.
#[cfg(feature = "cli")]
pub(crate) fn is_config_key(key: &str) -> bool {
    Scalars::NAMES.contains(&key) || TABLES.contains(&key)
}

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
    pub parametrizations: Vec<ParametrizationSpec>,
    /// The sample sets, each with its budget limit and instruments.
    pub sample_sets: Vec<(Named<dyn Planner>, Reach)>,
    /// The reconstructions, each with its budget limit and sample sets.
    pub reconstructions: Vec<(Named<dyn Reconstruct>, Reach)>,
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

keys! {
    /// The keys of the top level that are no tables.
    #[derive(PartialEq)]
    pub struct Scalars {
        /// The question the experiment asks; for people.
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
        materials_dir: Option<PathBuf> = None;
        /// The files of that folder that are meant, by name; all of them if not written.
        only: Option<Vec<String>> = None;
    }
}

/// The longest a step of a job may be repeated for, s.
const MAX_REPEAT_SECONDS: f64 = 60.0;

keys! {
    /// What is written beside the results: nothing unless asked for.
    #[derive(Copy, PartialEq)]
    pub struct Output {
        /// The schedules, and in which format.
        schedules: Schedules = Schedules::default();
        /// Pictures of a slice of truth, reconstruction and difference.
        slices: bool = false;
        /// `results.parquet` beside `results.csv`: the same columns with their types.
        parquet: bool = false;
        /// `explore.html`: a page that shows the first material, its readings by the largest schedule, and the instrument on its tour.
        explore: bool = false;
        /// Seconds that each step of a job may be repeated for, so that its time has a range; 0: never.
        repeat_seconds: f64 = 0.002;
    }
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
                write!(f, "false or one of {}", listed(names))
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
        let kind = Kind::of_config(source)?;
        if kind.has_profiles() {
            let at = source.place("experiment");
            let name = kind.name();
            return Err(at.problem(format_args!("= {name:?}: allowed here is \"acquisition\"")));
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
        refuse_unknown(&rest, &[Scalars::NAMES, &TABLES])?;
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
            materials: take_list(table, "material", material)?.unwrap_or_default(),
            parametrizations: take_list(table, "parametrization", parametrization)?
                .unwrap_or_else(|| vec![usual()]),
            sample_sets: take_list(table, "sample_set", |t| reaching(t, acquisition::read))?
                .unwrap_or_else(|| vec![(grid(), Reach::default())]),
            reconstructions: take_list(table, "reconstruction", |t| {
                reaching(t, reconstruct::read)
            })?
            .unwrap_or_else(|| vec![(multilinear(), Reach::default())]),
            instruments: take_list(table, "instrument", instruments::table)?.unwrap_or_default(),
            merl: registry::take_table(table, "merl")?,
            metrics: registry::take(table, "metrics", registry::parse)?.unwrap_or_default(),
            tuning: registry::take(table, "tuning", TuningTable::read)?,
            moments: registry::take(table, "moments", MomentsTable::read)?,
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
        in_closed("band", self.band, 1.0, 10.0).map_err(|e| source.place("band").error(e))?;
        self.pictures.check(source)?;
        let check = |list: &str, i: usize, reach: &Reach| {
            let at = source.place(list).index(i).key("up_to");
            let checked = |n| at.whole(n, 1..=MAX_BUDGET as i64);
            reach.up_to.map_or(Ok(()), checked)
        };
        for (i, (_, reach)) in self.sample_sets.iter().enumerate() {
            check("sample_set", i, reach)?;
        }
        for (i, (_, reach)) in self.reconstructions.iter().enumerate() {
            check("reconstruction", i, reach)?;
        }
        let at = source.place("coordinates");
        distinct(&at, &self.coordinates, Coordinates::label)
    }
}

/// The default band: a twentieth. Less is nothing to choose an acquisition by.
const BAND: f64 = 1.05;

fn take_band(config: &mut Table<'_>) -> Result<f64, ReadError> {
    let Some(value) = config.get_mut().remove("band") else {
        return Ok(BAND);
    };
    let span = value.span();
    let value = f64::deserialize(toml::de::ValueDeserializer::from(value));
    value.map_err(|e| ReadError::new(span, e.message()))
}

/// Reads a member of a family, and the keys of it that say where it is used.
fn reaching<'s, T: ?Sized>(
    mut table: Table<'s>,
    read: impl Fn(Table<'s>) -> Result<Box<T>, ReadError>,
) -> Result<(Named<T>, Reach), ReadError> {
    let mut own = DeTable::new();
    for key in ["up_to", "on"] {
        own.extend(table.get_mut().remove_entry(key));
    }
    let reach = registry::parse(toml::Spanned::new(table.span(), own))?;
    Ok((named(table, read)?, reach))
}

/// Seeds, budgets and readings, each in range and each once.
pub(super) type Numbers = (Vec<u64>, Vec<usize>, Vec<usize>);

/// Checks lists of numbers, and that there is at least one seed and one allowance.
pub(super) fn checked_numbers(config: &Config<'_>) -> Result<Numbers, Error> {
    let (source, scalars) = (config.source, &config.scalars);
    let convert = |key: &str, list: &[i64], range: RangeInclusive<i64>| {
        let at = source.place(key);
        for (i, &value) in list.iter().enumerate() {
            at.index(i).whole(value, range.clone())?;
        }
        distinct(&at, list, i64::to_string)
    };
    convert("seeds", &scalars.seeds, 0..=i64::MAX)?;
    refuse_empty(&source.place("seeds"), &scalars.seeds)?;
    let seeds = scalars.seeds.iter().map(|seed| seed.unsigned_abs());
    let counts = |key: &str, list: &[i64]| {
        convert(key, list, 1..=MAX_BUDGET as i64)?;
        let counts = list.iter().map(|count| count.unsigned_abs() as usize);
        Ok::<Vec<usize>, Error>(counts.collect())
    };
    let budgets = counts("budgets", &scalars.budgets)?;
    let readings = counts("readings", &scalars.readings)?;
    let minutes = &scalars.minutes;
    if readings.is_empty() && minutes.is_empty() {
        refuse_empty(&source.place("budgets"), &budgets)?;
    }
    let at = source.place("minutes");
    distinct(&at, minutes, f64::to_string)?;
    for (i, &m) in minutes.iter().enumerate() {
        let at = at.index(i);
        in_left_open(&at.to_string(), m, 0.0, MAX_MINUTES).map_err(|e| at.error(e))?;
    }
    if let Some(key) = of_instruments(&readings, minutes)
        && config.instruments.is_empty()
    {
        return Err(source.place(key).problem(
            "are those of an instrument, and there is none; allowed: with an [[instrument]] only",
        ));
    }
    Ok((seeds.collect(), budgets, readings))
}

/// The first key that allows schedules something other than poses, if one does.
pub(super) fn of_instruments(readings: &[usize], minutes: &[f64]) -> Option<&'static str> {
    match (readings, minutes) {
        ([], []) => None,
        ([], _) => Some("minutes"),
        _ => Some("readings"),
    }
}

/// The longest time a schedule may be asked to take: a year.
pub const MAX_MINUTES: f64 = 525_600.0;

pub(super) fn check_metrics(config: &Config<'_>) -> Result<(), Error> {
    let at = config.source.place("metrics");
    let refuse = |e: ParameterError| {
        // Keys that only fail together are listed with commas; the first one is a place.
        let first = e.key.split(',').next().unwrap_or(&e.key);
        at.key(first).error(format!("{at}.{e}"))
    };
    config.metrics.check().map_err(refuse)?;
    // A window that keeps next to nothing shows in the first few pairs.
    let few = MetricsSpec {
        pairs: config.metrics.pairs.min(16),
        ..config.metrics.clone()
    };
    for &measure in &config.scalars.measures {
        metrics::test_pairs(measure, &few).map_err(refuse)?;
    }
    Ok(())
}

pub(super) fn check_quantities(config: &Config<'_>) -> Result<(), Error> {
    let source = config.source;
    let wanted = config.scalars.quantities.as_deref().unwrap_or_default();
    distinct(&source.place("quantities"), wanted, |q| q.name())?;
    let Some(moments) = &config.moments else {
        return Ok(());
    };
    if !wanted.contains(&QuantityGroup::Moments) {
        let predicate = "has keys for a quantity that is not asked for; allowed: with quantities = \
                         [\"moments\"] only";
        return Err(source.place("moments").problem(predicate));
    }
    moments.check(source)?;
    if moments.spec.azimuths > 1 {
        let allowed = "1 where reconstructions are compared: of views at azimuth 0";
        let at = source.place("moments.azimuths");
        return Err(at.refused(moments.spec.azimuths, allowed));
    }
    let at = source.place("moments.channels");
    match moments.spec.channels.as_slice() {
        [channel]
            if config.scalars.channels == Channels::Rgb
                || channel.needs() == Channels::Luminance =>
        {
            Ok(())
        }
        [channel] => Err(at.problem(format_args!(
            "= [{:?}] needs channels = \"rgb\"; allowed: luminance, or that",
            channel.name()
        ))),
        several => Err(at.problem(format_args!(
            "has {} channels; allowed: one, which the columns of results are about",
            several.len()
        ))),
    }
}

pub(super) fn check_output(config: &Config<'_>) -> Result<(), Error> {
    let lacks = |key: &str, work: &str, feature: &str| {
        let predicate = format!(
            "= true: this build of gonio cannot {work}: it lacks the feature {feature} (cargo install --path . --features {feature})"
        );
        Err(config.source.place("output").key(key).problem(predicate))
    };
    let drawn = [
        ("slices", config.output.slices),
        ("explore", config.output.explore),
    ];
    if let Some((key, _)) = drawn
        .into_iter()
        .find(|(_, is_asked)| *is_asked && !cfg!(feature = "pictures"))
    {
        return lacks(key, "draw pictures", "pictures");
    }
    if config.output.parquet && !cfg!(feature = "parquet") {
        return lacks("parquet", "write Parquet", "parquet");
    }
    let seconds = config.output.repeat_seconds;
    if !(0.0..=MAX_REPEAT_SECONDS).contains(&seconds) {
        let at = config.source.place("output.repeat_seconds");
        let allowed = format!("a number from 0 to {MAX_REPEAT_SECONDS}");
        return Err(at.refused(seconds, allowed));
    }
    Ok(())
}
