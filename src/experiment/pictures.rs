//! `[pictures]`: the pictures that are drawn of each material for the report.

use super::choices::MAX_BUDGET;
use super::keypath::KeyPath;
use super::materials::build_error;
use super::source::Source;
use super::tables::section;
use crate::error::{Error, ParameterError};
use crate::lighting::{self, LightingSpec, SkySpec};
use crate::registry::{self, ReadError, Table};
use serde::{Deserialize, Serialize};

/// `[pictures]`: pictures that are drawn of each material.
#[derive(Debug)]
pub struct PictureSpec {
    /// True if pictures are drawn.
    pub draw: bool,
    /// Width and height of a sphere, pixels.
    pub resolution: usize,
    /// Samples per pixel.
    pub samples: usize,
    /// Lighting of the spheres.
    pub lighting: Box<dyn LightingSpec>,
    /// Budget of the reconstructions that are drawn, distinct configurations.
    pub budget: usize,
}

/// The keys of `[pictures]` that are plain values.
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
    /// Takes the table out of a config's; `draw` is the default of its key `draw`.
    pub(super) fn take(config: &mut Table<'_>, draw: bool) -> Result<Self, ReadError> {
        let table = registry::take_table(config, "pictures")?;
        let (scalars, lighting) = match table {
            None => (
                PictureScalars {
                    draw,
                    ..PictureScalars::default()
                },
                None,
            ),
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

    pub(super) fn check(&self, source: &Source) -> Result<(), Error> {
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
            .map_err(|e| build_error(source, &path, e))
    }

    /// Every key with its value.
    pub fn resolved(&self) -> toml::Table {
        let mut table = section(&PictureScalars {
            draw: self.draw,
            resolution: self.resolution,
            samples: self.samples,
            budget: self.budget,
        });
        table.insert("lighting".into(), self.lighting.resolved().into());
        table
    }
}
