//! The plan of a config of kind `moments`: its keys checked and put together.

use crate::brdf::{Channels, Wavelengths};
use crate::error::{Error, ParameterError};
use crate::experiment::checks::each_once;
use crate::experiment::choices::Material;
use crate::experiment::kind::Kind;
use crate::experiment::materials::{self, MaterialTable, material};
use crate::experiment::source::Source;
use crate::experiment::tables::{refuse_unknown, section, take_list};
use crate::lighting::{self, LightingSpec, SkySpec};
use crate::moments::{self, Estimator, MomentsSpec, PeakResolving, ViewRange};
use crate::registry::{self, ReadError, Table, keys};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Keys of the top level that configs of other kinds do not have.
const OWN: [&str; 2] = ["analysis", "lighting"];

/// Refuses a key of the top level that neither all configs about moments have nor this kind has of its `own`.
pub(in crate::experiment) fn refuse_others(
    table: &Table<'_>,
    own: &[&str],
) -> Result<(), ReadError> {
    let shared = ["merl", "material", "moments"];
    refuse_unknown(table, &[Scalars::NAMES, &shared, own])
}

keys! {
    /// The keys of the top level that are no tables.
    struct Scalars {
        question: Option<String> = None;
        experiment: Kind = Kind::Moments;
        seeds: Vec<u64> = vec![1];
        materials_dir: Option<PathBuf> = None;
        only: Option<Vec<String>> = None;
    }
}

keys! {
    /// `[analysis]`: the range of the fits and further analyses of the profiles.
    #[derive(PartialEq)]
    pub struct AnalysisSpec {
        /// The first view that fits use, degrees.
        min_view_deg: f64 = 0.0;
        /// The last view that fits use, degrees. Measured tables are unreliable beyond 80°.
        max_view_deg: f64 = 80.0;
        /// True if clamping by the horizon is found for each profile; costs a second profile.
        horizon: bool = false;
        /// Materials that are drawn as a sphere with the covariance ellipses of three views; other names are left out.
        spheres: Vec<String> = Vec::new();
        /// Published numbers to compare with.
        published: Option<PublishedNumbers> = None;
    }
}

/// `[analysis.published]`: published results, texts that are printed beside those found here.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PublishedNumbers {
    /// The publication.
    pub by: String,
    /// The kind of the materials the numbers are of.
    pub group: String,
    /// Published text for the row "theta_0 of each material".
    pub theta_0: String,
    /// Published text for the row "theta_1 of each material".
    pub theta_1: String,
    /// Published text for the row "theta_0, theta_1 shared by all".
    pub theta_shared: String,
    /// Published text for the row "energy rises from theta_0 to theta_1".
    pub energy_rises: String,
    /// Published text for the row "slope of the mean".
    pub mean_slope: String,
    /// Published text for the row "average variance (rad²)".
    pub average_variance: String,
    /// Published text for the row "energy fit, median MAE and RMSE, relative".
    pub energy_fit: String,
    /// Published text for the row "mean fit, median MAE and RMSE (rad)".
    pub mean_fit: String,
    /// Published text for the row "variance fit, median MAE and RMSE (rad²)".
    pub variance_fit: String,
    /// Published text for the row "variance ≈ (π²/12)(1+µ) + c µ(1+µ)".
    pub mean_variance: String,
    /// Published text for the row "largest moment odd in phi, standardised".
    pub odd_moments: String,
    /// Published text for the row "share the horizon explains".
    pub horizon: String,
}

impl AnalysisSpec {
    /// The views that fits use, or the key that is out of range.
    pub(crate) fn range(&self) -> Result<ViewRange, ParameterError> {
        ViewRange::from_degrees(self.min_view_deg, self.max_view_deg)
    }
}

/// A moment experiment that can be run.
#[derive(Debug)]
pub struct MomentsPlan {
    /// The question it asks.
    pub question: Option<String>,
    /// Seed of random estimators.
    pub seed: u64,
    /// The materials.
    pub materials: Vec<Material>,
    /// Names of the config's `only` that its folder of materials does not have.
    pub missing: Vec<String>,
    /// Moments that are analysed, and their estimator.
    pub moments: MomentsTable,
    /// Fits and further analyses of the profiles.
    pub analysis: AnalysisSpec,
    /// Lighting of the spheres.
    pub lighting: Box<dyn LightingSpec>,
    /// The config with every default filled in.
    pub resolved: toml::Table,
    /// The wavelengths its materials are known at, of an acquisition by wavelength.
    pub wavelengths: Option<Wavelengths>,
}

impl MomentsPlan {
    /// Reads and checks a config of kind `moments`.
    ///
    /// # Errors
    /// [`Error::Config`] and [`Error::Data`], as those of [`Plan::read`](crate::experiment::Plan::read).
    pub(in crate::experiment) fn read(source: &Source) -> Result<Self, Error> {
        let table = source.table()?;
        refuse_others(&table, &OWN).map_err(|e| source.error(e))?;
        Self::from_table(source, table)
    }

    /// Puts the keys of a table together that has no others.
    pub(in crate::experiment) fn from_table<'s>(
        source: &'s Source,
        table: Table<'s>,
    ) -> Result<Self, Error> {
        let parts = parts(table).map_err(|e| source.error(e))?;
        let (scalars, analysis, lighting) = (parts.scalars, parts.analysis, parts.lighting);
        let moments = parts.moments.unwrap_or_default();
        moments.check(source)?;
        let range = analysis.range();
        range.map_err(|e| source.place("analysis").refused_key(&e))?;
        let &[seed] = scalars.seeds.as_slice() else {
            let message = format!("seeds = {:?}: allowed is one seed", scalars.seeds);
            return Err(source.place("seeds").error(message));
        };
        let written = parts.tables.len();
        let (materials, missing) = materials::gather(
            source,
            parts.tables,
            scalars.materials_dir.as_deref(),
            scalars.only.as_deref(),
            parts.merl,
            &moments.spec.needs(),
        )?;
        let checked = lighting.check();
        checked.map_err(|e| source.place("lighting").not_built(e))?;
        let mut resolved = section(&scalars);
        materials::insert_materials(&mut resolved, &materials, written);
        resolved.insert("moments".into(), moments.resolved().into());
        resolved.insert("analysis".into(), section(&analysis).into());
        if !analysis.spheres.is_empty() {
            resolved.insert("lighting".into(), lighting.resolved().into());
        }
        Ok(Self {
            question: scalars.question,
            seed,
            materials,
            missing,
            moments,
            analysis,
            lighting,
            resolved,
            wavelengths: None,
        })
    }

    /// Channels that the materials are built for.
    pub(crate) fn channels(&self) -> Channels {
        self.seen_in(self.moments.spec.needs())
    }

    /// The wavelengths of the scene, if it has any; else `otherwise`.
    pub(crate) fn seen_in(&self, otherwise: Channels) -> Channels {
        match &self.wavelengths {
            Some(wavelengths) => Channels::Wavelengths(wavelengths.clone()),
            None => otherwise,
        }
    }

    /// The groups of materials, in the order of their first member.
    pub(crate) fn groups(&self) -> Vec<String> {
        each_once(self.materials.iter().map(Material::group))
    }
}

/// The tables of a config, taken apart.
struct Parts<'s> {
    scalars: Scalars,
    merl: Option<Table<'s>>,
    tables: Vec<MaterialTable>,
    moments: Option<MomentsTable>,
    analysis: AnalysisSpec,
    lighting: Box<dyn LightingSpec>,
}

/// Reads the tables of a config of this kind, without checking their values.
pub(in crate::experiment) fn read_keys(table: Table<'_>) -> Result<(), ReadError> {
    refuse_others(&table, &OWN)?;
    read_tables(table)
}

/// Reads the tables of a config that has no other keys.
pub(in crate::experiment) fn read_tables(table: Table<'_>) -> Result<(), ReadError> {
    parts(table).map(drop)
}

fn parts(mut table: Table<'_>) -> Result<Parts<'_>, ReadError> {
    let tables = take_list(&mut table, "material", material)?.unwrap_or_default();
    let merl = registry::take_table(&mut table, "merl")?;
    let moments = registry::take(&mut table, "moments", MomentsTable::read)?;
    let analysis = registry::take(&mut table, "analysis", registry::parse)?;
    let lighting = registry::take(&mut table, "lighting", lighting::read)?;
    Ok(Parts {
        scalars: registry::parse(table)?,
        merl,
        tables,
        moments,
        analysis: analysis.unwrap_or_default(),
        lighting: lighting.unwrap_or_else(|| Box::new(SkySpec::default())),
    })
}

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
    pub(in crate::experiment) fn read(mut table: Table<'_>) -> Result<Self, ReadError> {
        let estimator = match registry::take_table(&mut table, "estimator")? {
            // Keys of the default one need not name it.
            Some(estimator) if !estimator.get_ref().contains_key("kind") => {
                Box::new(registry::parse::<PeakResolving>(estimator)?)
            }
            Some(estimator) => moments::read(estimator)?,
            None => Box::new(PeakResolving::default()),
        };
        let spec = registry::parse(table)?;
        Ok(Self { spec, estimator })
    }

    pub(in crate::experiment) fn check(&self, source: &Source) -> Result<(), Error> {
        let at = source.place("moments");
        self.spec.check().map_err(|e| at.refused_key(&e))?;
        let checked = self.estimator.check();
        checked.map_err(|e| at.key("estimator").refused_key(&e))
    }

    pub(in crate::experiment) fn resolved(&self) -> toml::Table {
        let estimator = self.estimator.resolved();
        registry::with(section(&self.spec), "estimator", estimator)
    }
}
