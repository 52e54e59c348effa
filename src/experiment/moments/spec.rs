//! The table `[moments]` of a config: the quantities that are analysed and their estimator.

use crate::error::Error;
use crate::experiment::checks::refused_in;
use crate::experiment::keypath::KeyPath;
use crate::experiment::source::Source;
use crate::experiment::tables::section;
use crate::moments::{self, Estimator, MomentsSpec, PeakResolving};
use crate::registry::{self, ReadError, Table};

/// `[moments]`.
#[derive(Debug)]
pub struct MomentsTable {
    /// Every key but the estimator.
    pub spec: MomentsSpec,
    /// `estimator`.
    pub estimator: Box<dyn Estimator>,
}

impl Default for MomentsTable {
    fn default() -> Self {
        Self {
            spec: MomentsSpec::default(),
            estimator: Box::new(PeakResolving::default()),
        }
    }
}

impl MomentsTable {
    /// Takes the table out of a config's, if it is there.
    ///
    /// # Errors
    /// For keys that are unknown or of another type.
    pub(in crate::experiment) fn take(config: &mut Table<'_>) -> Result<Option<Self>, ReadError> {
        let Some(mut table) = registry::take_table(config, "moments")? else {
            return Ok(None);
        };
        let estimator = match registry::take_table(&mut table, "estimator")? {
            // Keys of the default one need not name it.
            Some(estimator) if !estimator.get_ref().contains_key("kind") => {
                Box::new(registry::parse::<PeakResolving>(estimator)?)
            }
            Some(estimator) => moments::read(estimator)?,
            None => Box::new(PeakResolving::default()),
        };
        let spec = registry::parse(table)?;
        Ok(Some(Self { spec, estimator }))
    }

    /// Checks every key.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub(in crate::experiment) fn check(&self, source: &Source) -> Result<(), Error> {
        let base = KeyPath::of("moments");
        let estimator = base.key("estimator");
        let spec = self.spec.check();
        spec.map_err(|e| refused_in(source, &base, &e))?;
        let checked = self.estimator.check();
        checked.map_err(|e| refused_in(source, &estimator, &e))
    }

    /// Every key with its value.
    pub(in crate::experiment) fn resolved(&self) -> toml::Table {
        let mut table = section(&self.spec);
        table.insert("estimator".into(), self.estimator.resolved().into());
        table
    }
}
