//! What kind of experiment a config describes.

use super::source::{KeyPath, Source};
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// Kinds of experiments: the value of `experiment`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Measure materials at sample sets, reconstruct them and compare; [`Config`](super::Config).
    #[default]
    Acquisition,
    /// Moment profiles of materials, their fits and correlations; [`moments`](super::moments).
    Moments,
    /// Moments of reflected radiance, rendered and predicted; [`relations`](super::relations).
    Relations,
    /// Which coordinates to sample and to reconstruct in; [`study`](super::study).
    Study,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Kind; 4] = [
        Kind::Acquisition,
        Kind::Moments,
        Kind::Relations,
        Kind::Study,
    ];

    /// As configs write it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Acquisition => "acquisition",
            Kind::Moments => "moments",
            Kind::Relations => "relations",
            Kind::Study => "study",
        }
    }

    /// One line for `gonio list`.
    pub fn summary(self) -> &'static str {
        match self {
            Kind::Acquisition => "measure at sample sets, reconstruct, compare (the default)",
            Kind::Moments => "moment profiles of BRDF slices, their fits and correlations",
            Kind::Relations => "moments of reflected radiance, rendered and predicted from moments",
            Kind::Study => {
                "the cross table of coordinates to sample and to reconstruct in; resumable, with a report"
            }
        }
    }

    /// The kind of a config.
    ///
    /// # Errors
    /// [`Error::Config`] if the text is no TOML or names another kind.
    pub fn of(source: &Source) -> Result<Self, Error> {
        let table = source.table()?;
        let Some(value) = table.get_ref().get("experiment") else {
            return Ok(Self::default());
        };
        let text = value.get_ref().as_str();
        if let Some(kind) = Self::ALL.into_iter().find(|k| Some(k.name()) == text) {
            return Ok(kind);
        }
        let found = match text {
            Some(text) => format!("{text:?}"),
            None => format!("a value of type {}", value.get_ref().type_str()),
        };
        let names = Self::ALL.map(|k| format!("{:?}", k.name())).join(", ");
        let message = format!("experiment = {found}; allowed: {names}");
        Err(source.error_at(&KeyPath::of("experiment"), message))
    }

    /// Refuses a config of another kind.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn require(self, source: &Source) -> Result<(), Error> {
        let found = Self::of(source)?;
        if found == self {
            return Ok(());
        }
        let message = format!(
            "experiment = {:?}: allowed here is {:?}",
            found.name(),
            self.name()
        );
        Err(source.error_at(&KeyPath::of("experiment"), message))
    }
}
