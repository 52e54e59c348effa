//! `[pictures]`: the pictures that are drawn of each material for the report.

use super::choices::MAX_BUDGET;
use super::source::Source;
use super::tables::section;
use crate::error::Error;
use crate::lighting::{self, LightingSpec, SkySpec};
use crate::registry::{self, ReadError, Table};
use serde::{Deserialize, Serialize};

/// `[pictures]`: pictures that are drawn of each material.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PictureSpec {
    /// True if pictures are drawn.
    pub draw: bool,
    /// Width and height of a sphere, pixels.
    pub resolution: usize,
    /// Samples per pixel.
    pub samples: usize,
    /// Budget of the reconstructions that are drawn, distinct configurations.
    pub budget: usize,
    /// Lighting of the spheres.
    #[serde(skip)]
    pub lighting: Box<dyn LightingSpec>,
}

impl Default for PictureSpec {
    fn default() -> Self {
        Self {
            draw: true,
            resolution: 512,
            samples: 8,
            budget: 1000,
            lighting: Box::new(SkySpec::default()),
        }
    }
}

impl PictureSpec {
    /// Takes the table out of a config's; where there is none, `draw` says if pictures are drawn.
    pub(super) fn take(config: &mut Table<'_>, draw: bool) -> Result<Self, ReadError> {
        let Some(mut table) = registry::take_table(config, "pictures")? else {
            return Ok(Self {
                draw,
                ..Self::default()
            });
        };
        let lighting = registry::take_table(&mut table, "lighting")?;
        let lighting = lighting.map(lighting::read).transpose()?;
        let mut spec: Self = registry::parse(table)?;
        if let Some(lighting) = lighting {
            spec.lighting = lighting;
        }
        Ok(spec)
    }

    pub(super) fn check(&self, source: &Source) -> Result<(), Error> {
        let at = source.place("pictures");
        for (key, value, most) in [
            ("resolution", self.resolution, 2048),
            ("samples", self.samples, 65_536),
            ("budget", self.budget, MAX_BUDGET),
        ] {
            at.key(key).whole(value, 1..=most)?;
        }
        let at = at.key("lighting");
        self.lighting.check().map_err(|e| at.not_built(e))
    }

    /// Every key with its value.
    pub(crate) fn resolved(&self) -> toml::Table {
        let mut table = section(self);
        table.insert("lighting".into(), self.lighting.resolved().into());
        table
    }
}
