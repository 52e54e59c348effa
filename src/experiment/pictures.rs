//! `[pictures]`: the pictures that are drawn of each material for the report.

use super::choices::MAX_BUDGET;
use super::source::Source;
use super::tables::section;
use crate::error::Error;
use crate::lighting::{self, LightingSpec, SkySpec};
use crate::registry::{self, ReadError, Table, keys};
use std::sync::Arc;

keys! {
    /// `[pictures]`: pictures that are drawn of each material.
    pub struct PictureSpec {
        /// True if pictures are drawn.
        draw: bool = true;
        /// Width and height of a sphere, pixels.
        resolution: usize = 512;
        /// Samples per pixel.
        samples: usize = 8;
        /// Budget of the reconstructions that are drawn, distinct configurations.
        budget: usize = 1000;
        /// Lighting of the spheres.
        #[serde(skip)]
        lighting: Arc<dyn LightingSpec> = Arc::new(SkySpec::default());
    }
}

impl PictureSpec {
    /// Takes the table out of a config's; where there is none, `draw` says if pictures are drawn.
    pub(super) fn take(config: &mut Table<'_>, draw: bool) -> Result<Self, ReadError> {
        let Some(mut table) = registry::take_table(config, "pictures")? else {
            let usual = Self::default();
            return Ok(Self { draw, ..usual });
        };
        let lighting = registry::take(&mut table, "lighting", lighting::read)?;
        let mut spec: Self = registry::parse(table)?;
        if let Some(lighting) = lighting {
            spec.lighting = lighting.into();
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

    pub(crate) fn resolved(&self) -> toml::Table {
        registry::with(section(self), "lighting", self.lighting.resolved())
    }
}
