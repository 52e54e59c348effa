//! A Zemax table as a config names it.

use super::super::label_of;
use super::Zemax;
use super::file::{ZemaxError, head, text};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::error::ParameterError;
use crate::geometry::Symmetry;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "zemax";

/// The registry entry. No examples: those must build on every machine, and this kind needs a file.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "isotropic table about the mirror direction, the text of OpticStudio (Zemax) at `path`; also no_reading",
    examples: &[],
    read: |table| Ok(Box::new(registry::parse::<ZemaxSpec>(table)?)),
};

/// A Zemax table, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZemaxSpec {
    /// The file.
    pub path: PathBuf,
    /// One more number that stands for no reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_reading: Option<f64>,
}

impl ZemaxSpec {
    /// A file.
    pub fn of(path: PathBuf) -> Self {
        Self {
            path,
            no_reading: None,
        }
    }

    fn error(&self, e: &ZemaxError) -> BuildError {
        match e {
            ZemaxError::Monochrome | ZemaxError::Tristimulus => {
                ParameterError::new("path", self.path.display(), e.to_string()).into()
            }
            e => BuildError::data(&self.path, e),
        }
    }

    /// What stands before the values, of a scene that can make use of it.
    fn head<T>(
        &self,
        channels: &Channels,
        then: impl FnOnce(super::file::Head<'_>) -> Result<T, ZemaxError>,
    ) -> Result<T, BuildError> {
        let found = text(&self.path).and_then(|text| {
            let head = head(&text)?;
            head.content.suits(channels)?;
            then(head)
        });
        found.map_err(|e| self.error(&e))
    }
}

impl BrdfSpec for ZemaxSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        label_of(&self.path, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.head(channels, |_| Ok(()))
    }

    fn symmetry(&self, channels: &Channels) -> Result<Symmetry, BuildError> {
        self.head(channels, |head| {
            Ok(Symmetry {
                isotropic: true,
                bilateral: head.angles.mirrored,
                ..Symmetry::NONE
            })
        })
    }

    fn favours(&self) -> Favours {
        Favours::Neither
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let table: Zemax = self.head(&channels, |head| {
            head.load(channels.clone(), self.no_reading)
        })?;
        Ok(Box::new(table))
    }

    fn tables(&self) -> Tables {
        let nodes = text(&self.path).and_then(|text| Ok(head(&text)?.angles.count()));
        Tables {
            files: vec![self.path.clone()],
            channel_bytes: nodes.unwrap_or(0).saturating_mul(8),
        }
    }
}
