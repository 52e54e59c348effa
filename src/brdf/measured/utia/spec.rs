//! A UTIA file as a config names it.

use super::super::{label_of, without_wavelengths};
use super::{Utia, check};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::error::in_left_open;
use crate::geometry::Symmetry;
use crate::registry;

file_table! {
    "utia": "measured anisotropic table to 75°, the UTIA .bin file at `path`; also scale, no_reading"
    /// A UTIA file, as a config writes it.
    pub struct UtiaSpec {
        /// Factor from stored values to sr⁻¹, above 0 and at most 10⁶.
        #[serde(default = "one")]
        scale: f64 = one();
    }
}

fn one() -> f64 {
    1.0
}

impl BrdfSpec for UtiaSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        label_of(&self.path, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        without_wavelengths("path", self.path.display(), channels)?;
        in_left_open("scale", self.scale, 0.0, 1e6)?;
        check(&self.path).map_err(|e| e.of_file(&self.path))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(Symmetry::NONE)
    }

    fn favours(&self) -> Favours {
        Favours::SphericalTable
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        let table = Utia::load(&self.path, self.scale, channels, self.no_reading);
        Ok(Box::new(table.map_err(|e| e.of_file(&self.path))?))
    }

    fn tables(&self) -> Tables {
        Tables {
            files: vec![self.path.clone()],
            channel_bytes: super::FILE_LEN as usize / Channels::Rgb.count(),
        }
    }
}
