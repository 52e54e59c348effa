//! A Zemax table as a config names it.

use super::super::{TableError, label_of};
use super::Zemax;
use super::file::{head, text};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::geometry::Symmetry;
use crate::registry;

file_table! {
    "zemax": "isotropic table about the mirror direction, the text of OpticStudio (Zemax) at `path`; also no_reading"
    /// A Zemax table, as a config writes it.
    pub struct ZemaxSpec {}
}

impl ZemaxSpec {
    /// What stands before the values, of a scene that can make use of it.
    fn head<T>(
        &self,
        channels: &Channels,
        then: impl FnOnce(super::file::Head<'_>) -> Result<T, TableError>,
    ) -> Result<T, BuildError> {
        let found = text(&self.path).and_then(|text| {
            let head = head(&text)?;
            head.content.suits(channels)?;
            then(head)
        });
        found.map_err(|e| e.of_file(&self.path))
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
