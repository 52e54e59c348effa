//! What a config of this kind says beyond that of an acquisition.

use crate::brdf::Channels;
use crate::error::{Error, ParameterError, in_closed};
use crate::experiment::checks::distinct;
use crate::experiment::config::{Config, KEYS, Output, take_list};
use crate::experiment::kind::Kind;
use crate::experiment::plan::MAX_BUDGET;
use crate::experiment::source::{KeyPath, Source};
use crate::lighting::{self, LightingSpec, SkySpec};
use crate::reconstruct::Coordinates;
use crate::registry::{self, ReadError, Table};
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

/// The keys of the top level that only this kind has.
const OWN_KEYS: [&str; 3] = ["band", "coordinates", "pictures"];

/// The keys of a `[[reconstruction]]` that only this kind has.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Reach {
    /// The largest budget it is used at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up_to: Option<i64>,
    /// The one sample set it is used on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<String>,
}

/// `[pictures]`: what of each material is drawn.
#[derive(Debug)]
pub struct PictureSpec {
    /// Whether anything is.
    pub draw: bool,
    /// Width and height of a sphere, pixels.
    pub resolution: usize,
    /// Samples a pixel.
    pub samples: usize,
    /// The light they are in.
    pub lighting: Box<dyn LightingSpec>,
    /// Budget of the reconstructions that are drawn.
    pub budget: usize,
}

/// The keys of it that are plain values.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PictureScalars {
    draw: bool,
    resolution: usize,
    samples: usize,
    budget: usize,
}

impl Default for PictureScalars {
    fn default() -> Self {
        Self {
            draw: true,
            resolution: 128,
            samples: 64,
            budget: 1000,
        }
    }
}

impl PictureSpec {
    fn take(config: &mut Table<'_>) -> Result<Self, ReadError> {
        let table = registry::take_table(config, "pictures")?;
        let (scalars, lighting) = match table {
            None => (PictureScalars::default(), None),
            Some(mut table) => {
                let lighting = registry::take_table(&mut table, "lighting")?;
                let lighting = lighting.map(lighting::read).transpose()?;
                (registry::parse(table)?, lighting)
            }
        };
        let PictureScalars {
            draw,
            resolution,
            samples,
            budget,
        } = scalars;
        Ok(Self {
            draw,
            resolution,
            samples,
            budget,
            lighting: lighting.unwrap_or_else(|| Box::new(SkySpec::default())),
        })
    }

    fn check(&self, source: &Source) -> Result<(), Error> {
        let base = KeyPath::of("pictures");
        for (key, value, most) in [
            ("resolution", self.resolution, 2048),
            ("samples", self.samples, 65_536),
            ("budget", self.budget, MAX_BUDGET),
        ] {
            if !(1..=most).contains(&value) {
                let path = base.key(key);
                let allowed = format!("a whole number from 1 to {most}");
                let e = ParameterError::new(path.to_string(), value, allowed);
                return Err(source.error_at(&path, e));
            }
        }
        let path = base.key("lighting");
        self.lighting
            .check()
            .map_err(|e| crate::experiment::materials::build_error(source, &path, e))
    }

    /// Every key with its value.
    pub fn resolved(&self) -> toml::Table {
        let mut table = crate::experiment::resolved::section(&PictureScalars {
            draw: self.draw,
            resolution: self.resolution,
            samples: self.samples,
            budget: self.budget,
        });
        table.insert("lighting".into(), self.lighting.resolved().into());
        table
    }
}

/// A config of this kind as it was written.
#[derive(Debug)]
pub(super) struct StudyConfig<'s> {
    pub common: Config<'s>,
    /// In which scattered readings are interpolated, beside their own; empty: those only.
    pub coordinates: Vec<Coordinates>,
    /// One a reconstruction.
    pub reach: Vec<Reach>,
    pub pictures: PictureSpec,
    /// The largest ratio of errors that counts as no difference.
    pub band: f64,
}

/// The default band: a twentieth. Less is nothing to choose an acquisition by.
const BAND: f64 = 1.05;

impl<'s> StudyConfig<'s> {
    pub fn read(source: &'s Source) -> Result<Self, Error> {
        Kind::Study.require(source)?;
        let mut table = source.table()?;
        let keys: Vec<&str> = KEYS.into_iter().chain(OWN_KEYS).collect();
        let read = |e| source.error(e);
        let coordinates = take_list(&mut table, "coordinates", registry::parse).map_err(read)?;
        let pictures = PictureSpec::take(&mut table).map_err(read)?;
        let reach = take_reach(&mut table).map_err(read)?;
        let band = take_band(source, &mut table)?;
        let common = Config::from_table(source, table, &keys).map_err(read)?;
        let config = Self {
            coordinates: coordinates.unwrap_or_default(),
            reach,
            pictures,
            band,
            common,
        };
        config.check(source)?;
        Ok(config)
    }

    fn check(&self, source: &Source) -> Result<(), Error> {
        let scalars = &self.common.scalars;
        let refuse = |key: &str, message: &str| {
            let message = format!("{message} in an experiment of kind \"study\"");
            Err(source.error_at(&KeyPath::of(key), message))
        };
        if scalars.channels != Channels::Luminance {
            return refuse("channels", "channels: allowed is \"luminance\"");
        }
        if !scalars.quantities.is_empty() {
            return refuse("quantities", "quantities: allowed are none");
        }
        if self.common.output != Output::default() {
            return refuse(
                "output",
                "output: allowed are schedules = false and slices = false",
            );
        }
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

/// Takes `band`.
fn take_band(source: &Source, config: &mut Table<'_>) -> Result<f64, Error> {
    let Some(value) = config.get_mut().remove("band") else {
        return Ok(BAND);
    };
    let path = KeyPath::of("band");
    let value = f64::deserialize(toml::de::ValueDeserializer::from(value));
    let value = value.map_err(|e| source.error_at(&path, format!("band: {}", e.message())))?;
    match in_closed("band", value, 1.0, 10.0) {
        Ok(band) => Ok(band),
        Err(e) => Err(source.error_at(&path, e)),
    }
}

/// Takes the keys of every `[[reconstruction]]` that only this kind has; what is no list of tables
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
