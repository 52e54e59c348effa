//! The kinds of experiments that a config can describe.

use super::source::Source;
use crate::error::{Error, excerpt, meant};
use crate::registry::named;
use serde::{Deserialize, Serialize};

named! {
    /// Kinds of experiments: the value of `experiment`.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Kind {
        #[default]
        Acquisition = "acquisition": "measure at sample sets, reconstruct, compare (the default)",
        Moments = "moments": "moment profiles of BRDF slices, their fits and correlations",
        Relations = "relations": "moments of reflected radiance, rendered and predicted from moments",
        Study = "study": "an acquisition that draws its materials, leaves out albedos, and prints its findings only",
    }
}

impl Kind {
    /// The kind of a config, or an [`Error::Config`] if the text is no TOML or names another kind.
    pub(crate) fn of_config(source: &Source) -> Result<Self, Error> {
        let table = source.table()?;
        let Some(value) = table.get_ref().get("experiment") else {
            return Ok(Self::default());
        };
        let text = value.get_ref().as_str();
        if let Some(kind) = Self::ALL.into_iter().find(|k| Some(k.name()) == text) {
            return Ok(kind);
        }
        let found = match text {
            Some(text) => format!("{:?}", excerpt(text)),
            None => format!("a value of type {}", value.get_ref().type_str()),
        };
        let names = Self::ALL.map(|k| format!("{:?}", k.name())).join(", ");
        let meant = meant(text.unwrap_or_default(), &Self::ALL.map(Kind::name));
        let message = format!("experiment = {found}; allowed: {names}{meant}");
        Err(source.place("experiment").error(message))
    }

    /// True of the kinds that analyse profiles of moments instead of reconstructions.
    pub(crate) fn has_profiles(self) -> bool {
        matches!(self, Kind::Moments | Kind::Relations)
    }

    /// True of the kind whose `pictures.draw` is true by default.
    pub(super) fn draws(self) -> bool {
        self == Kind::Study
    }

    /// Quantities compared beside the values if the config does not name them.
    pub(super) fn quantities(self) -> &'static [QuantityGroup] {
        match self {
            Kind::Acquisition => &[QuantityGroup::Albedo],
            Kind::Moments | Kind::Relations | Kind::Study => &[],
        }
    }
}

named! {
    /// Quantities that a run compares beside the values of truth and reconstruction.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum QuantityGroup {
        /// Their directional albedos.
        Albedo = "albedo",
        /// The moments of their slices, see [`moments`](crate::moments).
        Moments = "moments",
        /// The share of the pairs that are as near as the uncertainty of the readings says.
        Uncertainty = "uncertainty",
        /// The errors that reconstructions expect of themselves, where they know.
        Expected = "expected",
    }
}
