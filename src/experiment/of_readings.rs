//! A file of readings as a material: the BRDF that `gonio reconstruct` makes of it.

use crate::brdf::measured::label_of;
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, InChannels, Tables};
use crate::error::{Error, ParameterError, count, in_left_open, one_of};
use crate::formats::{self, Readings, load_readings};
use crate::geometry::Symmetry;
use crate::instrument;
use crate::parametrization;
use crate::reconstruct::{self, Estimated, Reconstruct, ReconstructError};
use crate::registry::{self, Entry, ReadError, Table};
use crate::schedule::{
    AngleUnit, Assume, Azimuth, Conventions, Polarisation, Quantity, UncertaintyUnit, whole_pixels,
};
use crate::validation::{self, CrossValidation};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const KIND: &str = "readings";

/// Bytes of a reconstruction for each byte of the file, whose rows stand in a tree with their mirror images.
const BYTES_A_BYTE: usize = 4;

/// The registry entry. No examples: those must build on every machine, and this kind needs a file.
pub(super) const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "the readings at `file`, reconstructed; also reconstruction, parametrization, symmetries, \
              and how a foreign file is read: columns, angles, elevation, azimuth, quantity, uncertainties, coverage_factor, polarisation, partial, mixed, no_reading, pixels",
    examples: &[],
    read: |table| Ok(Box::new(ReadingsSpec::read(table)?)),
};

/// The keys of a config, left out where [`Assume`] and the file say it; the reconstruction, which is listed, is taken out before.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    file: PathBuf,
    /// Name of the coordinates, in which readings that say none are interpolated.
    parametrization: Option<String>,
    /// Symmetries of the material, by which a reading stands for others.
    symmetries: Option<Symmetry>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    columns: BTreeMap<String, String>,
    angles: Option<AngleUnit>,
    #[serde(default)]
    elevation: bool,
    azimuth: Option<Azimuth>,
    quantity: Option<Quantity>,
    uncertainties: Option<UncertaintyUnit>,
    coverage_factor: Option<f64>,
    polarisation: Option<Polarisation>,
    #[serde(default)]
    partial: bool,
    #[serde(default)]
    mixed: bool,
    no_reading: Option<f64>,
    #[serde(default, deserialize_with = "whole_pixels")]
    pixels: Option<NonZeroUsize>,
    #[serde(default, rename = "reconstruction", skip_serializing)]
    _reconstruction: Option<IgnoredAny>,
}

/// Readings of a material, as a config writes them.
#[derive(Debug)]
pub struct ReadingsSpec {
    keys: Keys,
    /// `None`: what the readings choose, see [`validation::chosen`].
    reconstruction: Option<Arc<dyn Reconstruct>>,
}

/// The keys of a material that is a file: a table in a format that is read, or readings under any name; `None` of others.
pub fn keys_of_file(path: &Path) -> Option<registry::Keys> {
    match formats::of_file(path) {
        Some(format) if format.table.read.is_some() => {
            format.table.read.map(|read| read(path.into()).resolved())
        }
        Some(format) if format.read_readings.is_none() => None,
        None if !path.is_file() => None,
        _ => Some(ReadingsSpec::keys_of(path.into())),
    }
}

impl ReadingsSpec {
    /// The table of a material that is a file of readings, with every other key at its default.
    pub(crate) fn keys_of(file: PathBuf) -> registry::Keys {
        let mut keys = registry::Keys::new();
        keys.insert("kind".into(), KIND.into());
        keys.insert("file".into(), file.to_string_lossy().into_owned().into());
        keys
    }

    fn read(mut table: Table<'_>) -> Result<Self, ReadError> {
        let method = registry::take(&mut table, "reconstruction", reconstruct::read)?;
        Ok(Self {
            keys: registry::parse(table)?,
            reconstruction: method.map(Arc::from),
        })
    }

    /// The readings, and what makes a BRDF of them.
    fn load(&self, scene: &Channels) -> Result<Readings, BuildError> {
        let Keys { file, .. } = &self.keys;
        if let Some(name) = &self.keys.parametrization
            && parametrization::find(name).is_none()
        {
            let all = parametrization::all();
            let allowed = one_of(name, all.iter().map(|e| e.kind));
            return Err(ParameterError::new("parametrization", name, allowed).into());
        }
        if let Some(factor) = self.keys.coverage_factor {
            in_left_open("coverage_factor", factor, 0.0, 10.0)?;
        }
        if let Some(method) = &self.reconstruction {
            method.check().map_err(of_method)?;
        }
        let readings = self.readings()?;
        let measurement = &readings.measurement;
        let held = &measurement.channels;
        // In a scene of luminance wavelengths have one: their mean.
        let is_alike = held == scene || *scene == Channels::Luminance;
        if !is_alike && [held, scene].iter().any(|c| c.wavelengths().is_some()) {
            let allowed = format!(
                "readings of {}, as the scene asks for: this file holds {}",
                words(scene),
                words(held)
            );
            return Err(ParameterError::new("file", file.display(), allowed).into());
        }
        let chosen = self.reconstruction.as_ref();
        let is_grid = measurement.schedule.lattice.is_some();
        if let Some(method) = chosen.filter(|method| method.needs_grid() && !is_grid) {
            let allowed = format!("one that needs no grid: {} has none", file.display());
            let error = ParameterError::new("reconstruction.kind", method.label(), allowed);
            return Err(error.into());
        }
        Ok(readings)
    }

    fn readings(&self) -> Result<Readings, BuildError> {
        load_readings(&self.keys.file, &self.assume()).map_err(|e| match e {
            Error::Data {
                path,
                message,
                source,
            } => {
                let source = source.map_or(String::new(), |e| format!(": {e}"));
                let message = as_keys(&(message + &source));
                BuildError::Data { path, message }
            }
            e => self.unusable(e),
        })
    }

    fn assume(&self) -> Assume {
        let keys = &self.keys;
        Assume {
            parametrization: keys.parametrization.clone(),
            symmetry: keys.symmetries,
            otherwise: Symmetry::FULL,
            axes: instrument::axis_names(),
            conventions: Conventions {
                columns: keys.columns.clone().into_iter().collect(),
                angles: keys.angles,
                elevation: keys.elevation,
                azimuth: keys.azimuth,
                quantity: keys.quantity,
                uncertainties: keys.uncertainties,
                coverage_factor: keys.coverage_factor,
                polarisation: keys.polarisation,
                partial: keys.partial,
                mixed: keys.mixed,
                no_reading: keys.no_reading,
                pixels: keys.pixels,
            },
        }
    }

    fn unusable(&self, e: impl ToString) -> BuildError {
        BuildError::Data {
            path: self.keys.file.clone(),
            message: e.to_string(),
        }
    }
}

/// A sentence about a file that advises options, with the keys of a material in their place.
fn as_keys(sentence: &str) -> String {
    let options = [
        (
            "--symmetry with those that it has, or none",
            "symmetries = { isotropic = …, reciprocal = …, bilateral = … }",
        ),
        ("--columns", "columns"),
        ("--angles", "angles"),
        ("--elevation", "elevation"),
        ("--azimuth", "azimuth"),
        ("--quantity", "quantity"),
        ("--uncertainties", "uncertainties"),
        ("--partial", "partial"),
        ("--mixed", "mixed"),
        ("--no-reading", "no_reading ="),
        ("--pixels", "pixels"),
        ("--polarisation", "polarisation ="),
    ];
    let replace =
        |text: String, (option, key): &(&str, &str)| text.replace(option, &format!("`{key}`"));
    options.iter().fold(sentence.to_owned(), replace)
}

/// The error of a reconstruction's key, spelled from the material.
fn of_method(mut e: ParameterError) -> ParameterError {
    e.key = format!("reconstruction.{}", e.key);
    e
}

fn words(channels: &Channels) -> String {
    match channels {
        Channels::Luminance => "luminance".into(),
        Channels::Rgb => "R, G, B".into(),
        Channels::Wavelengths(w) => {
            let (nm, count) = (w.nm(), count(w.nm().len(), "wavelength"));
            format!("{count} from {} to {} nm", nm[0], nm[nm.len() - 1])
        }
    }
}

impl BrdfSpec for ReadingsSpec {
    fn resolved(&self) -> registry::Keys {
        let mut table = registry::resolved(KIND, &self.keys);
        if let Some(method) = &self.reconstruction {
            table.insert("reconstruction".into(), method.resolved().into());
        }
        table
    }

    fn label(&self) -> String {
        label_of(&self.keys.file, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.load(channels).map(drop)
    }

    fn held_channels(&self) -> Result<Option<Channels>, BuildError> {
        Ok(Some(self.readings()?.measurement.channels))
    }

    fn symmetry(&self, channels: &Channels) -> Result<Symmetry, BuildError> {
        let measurement = self.load(channels)?.measurement;
        Ok(measurement.schedule.parametrization.symmetry())
    }

    fn favours(&self) -> Favours {
        Favours::Reconstruction
    }

    fn remarks(&self) -> Vec<String> {
        let file = self.keys.file.display();
        let Ok(readings) = load_readings(&self.keys.file, &self.assume()) else {
            return Vec::new();
        };
        let measurement = &readings.measurement;
        let choose = self.reconstruction.is_none() && CrossValidation::is_possible(measurement);
        let choice = choose.then(|| {
            format!(
                "the readings choose their reconstruction, and `gonio reconstruct {file}` says which"
            )
        });
        let sentences = readings.notes.into_iter().chain(readings.warnings);
        let sentences = sentences.map(|sentence| as_keys(&sentence));
        let mean = measurement.channels.wavelengths().map(|of| {
            let count = count(of.nm().len(), "wavelength");
            format!("in a scene of luminance its luminance is the mean over its {count}")
        });
        let sentences = sentences.chain(mean).chain(choice);
        let with_file = |sentence| format!("{file}: {sentence}");
        sentences.map(with_file).collect()
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let measurement = self.load(&channels)?.measurement;
        let chosen = self.reconstruction.clone();
        let method = chosen.unwrap_or_else(|| validation::chosen(&measurement));
        let brdf = Estimated::new(method, measurement).map_err(|e| match e {
            ReconstructError::Parameter(e) => of_method(e).into(),
            e => self.unusable(e),
        })?;
        Ok(if *brdf.channels() == channels {
            Box::new(brdf)
        } else {
            Box::new(InChannels::new(Arc::new(brdf) as Arc<dyn Brdf>, channels))
        })
    }

    fn tables(&self) -> Tables {
        let bytes = fs::metadata(&self.keys.file).map_or(0, |file| file.len() as usize);
        Tables {
            files: vec![self.keys.file.clone()],
            channel_bytes: BYTES_A_BYTE * bytes,
        }
    }
}
