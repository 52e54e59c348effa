//! The experiment `relations`: moments of the radiance that a material reflects, rendered and
//! predicted from moments of its slices and of the light (Zubiaga et al. 2015, §3.2 and §3.3; see
//! [`docs::relations`](crate::docs::relations)).

use super::checks::{below, distinct, name_all};
use super::config::{named, refuse_unknown, take_list};
use super::kind::Kind;
use super::materials::build_error;
use super::moments::MomentsPlan;
use super::observer::{Failure, Input, Job};
use super::resolved::{self, insert_list, section};
use super::run::hash;
use super::source::{KeyPath, Source};
use crate::brdf::Brdf;
use crate::error::{Error, ParameterError};
use crate::lighting::{self, Lighting, LightingSpec};
use crate::moments::Profile;
use crate::moments::relations::{Along, Relation, RelationSpec, compare};
use crate::registry::{self, ReadError, Table};
use serde::{Deserialize, Serialize};

/// Keys that a config of this kind has.
const KEYS: [&str; 10] = [
    "question",
    "experiment",
    "seeds",
    "materials_dir",
    "only",
    "merl",
    "material",
    "moments",
    "lighting",
    "relations",
];

/// `[relations]` but for the keys of [`RelationSpec`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Keys {
    views_deg: Vec<f64>,
    along: Vec<Along>,
    window_deg: f64,
    azimuth_deg: f64,
    tolerance: f64,
    max_evaluations: usize,
    max_views: usize,
}

impl Default for Keys {
    fn default() -> Self {
        let spec = RelationSpec::default();
        Self {
            views_deg: (1..=7).map(|i| 10.0 * f64::from(i)).collect(),
            along: vec![Along::Theta, Along::Phi],
            window_deg: spec.window_deg,
            azimuth_deg: spec.azimuth_deg,
            tolerance: spec.tolerance,
            max_evaluations: spec.max_evaluations,
            max_views: spec.max_views,
        }
    }
}

/// A lighting with its name in results.
#[derive(Debug)]
pub struct PlannedLight {
    /// The name, unique in its plan.
    pub name: String,
    /// How to build it.
    pub spec: Box<dyn LightingSpec>,
}

/// An experiment of this kind that can be run.
#[derive(Debug)]
pub struct RelationsPlan {
    /// Materials and how their profiles are integrated.
    pub base: MomentsPlan,
    /// The lightings.
    pub lightings: Vec<PlannedLight>,
    /// View elevations, rad.
    pub views: Vec<f64>,
    /// Ways the view moves.
    pub along: Vec<Along>,
    /// How a relation is measured.
    pub spec: RelationSpec,
    /// The config with every default filled in.
    pub resolved: toml::Table,
}

impl RelationsPlan {
    /// Reads and checks a config of kind `relations`.
    ///
    /// # Errors
    /// [`Error::Config`] and [`Error::Data`].
    pub fn read(source: &Source) -> Result<Self, Error> {
        Kind::Relations.require(source)?;
        let (table, lights, keys) = parts(source.table()?).map_err(|e| source.error(e))?;
        let base = MomentsPlan::from_table(source, table)?;
        let here = KeyPath::of("relations");
        let spec = RelationSpec {
            window_deg: keys.window_deg,
            azimuth_deg: keys.azimuth_deg,
            tolerance: keys.tolerance,
            max_evaluations: keys.max_evaluations,
            max_views: keys.max_views,
        };
        spec.check()
            .map_err(|e| source.error_at(&below(&here, &e.key), format!("{here}.{e}")))?;
        distinct(
            source,
            "relations.views_deg",
            &keys.views_deg,
            f64::to_string,
        )?;
        for (i, &view) in keys.views_deg.iter().enumerate() {
            let last = base.moments.spec.max_view_deg;
            if !(view >= 0.0 && view <= last) {
                let path = here.key("views_deg").index(i);
                let allowed = format!("an angle in [0, {last}], the range of [moments]");
                let e = ParameterError::new(path.to_string(), view, allowed);
                return Err(source.error_at(&path, e));
            }
        }
        distinct(source, "relations.along", &keys.along, |a| a.name())?;
        let order = base.moments.spec.order.get();
        if order < 2 {
            let path = KeyPath::of("moments").key("order");
            let allowed = "a whole number in [2, 4] in this experiment";
            let e = ParameterError::new(path.to_string(), order, allowed);
            return Err(source.error_at(&path, e));
        }
        let channels = &base.moments.spec.channels;
        if channels.len() > 1 {
            let path = KeyPath::of("moments").key("channels");
            let names: Vec<_> = channels.iter().map(|c| c.name()).collect();
            let found = format!("[{}]", names.join(", "));
            let e = ParameterError::new(path.to_string(), found, "one in this experiment");
            return Err(source.error_at(&path, e));
        }
        if let Some(m) = base.materials.iter().find(|m| !m.symmetry.isotropic) {
            let message = format!(
                "material {:?} is anisotropic: allowed here are isotropic ones",
                m.name
            );
            return Err(source.error_at(&KeyPath::of("material"), message));
        }
        let mut lightings = Vec::new();
        for (i, (name, spec)) in name_all(source, "lighting", lights, |s| s.label())?
            .into_iter()
            .enumerate()
        {
            let path = KeyPath::of("lighting").index(i);
            spec.check().map_err(|e| build_error(source, &path, e))?;
            lightings.push(PlannedLight { name, spec });
        }
        let mut resolved = base.resolved.clone();
        resolved.remove("analysis");
        let tables = lightings
            .iter()
            .map(|l| resolved::named(l.spec.resolved(), &l.name));
        insert_list(&mut resolved, "lighting", tables);
        resolved.insert("relations".into(), section(&keys).into());
        Ok(Self {
            base,
            lightings,
            views: keys.views_deg.iter().map(|v| v.to_radians()).collect(),
            along: keys.along,
            spec,
            resolved,
        })
    }
}

type Parts<'s> = (Table<'s>, Vec<super::config::Named<dyn LightingSpec>>, Keys);

fn parts(mut table: Table<'_>) -> Result<Parts<'_>, ReadError> {
    refuse_unknown(&table, &KEYS)?;
    let lights = take_list(&mut table, "lighting", |t| named(t, lighting::read))?;
    let keys = registry::take_table(&mut table, "relations")?;
    let keys = keys.map(registry::parse).transpose()?;
    Ok((table, lights.unwrap_or_default(), keys.unwrap_or_default()))
}

/// One relation, as `relations.csv` has it.
#[derive(Clone, Debug, PartialEq)]
pub struct RelationRow {
    /// Name of the material.
    pub material: String,
    /// Name of the lighting.
    pub lighting: String,
    /// Rendered and predicted.
    pub relation: Relation,
}

/// Is told what happens, and may stop it.
pub trait Desk {
    /// True if the run shall stop; asked before every relation.
    fn cancelled(&self) -> bool {
        false
    }

    /// The relations of a material under a lighting; `inputs` are the files they were read from.
    ///
    /// # Errors
    /// End the run.
    fn rows(&mut self, rows: Vec<RelationRow>, inputs: Vec<Input>) -> Result<(), Error>;

    /// Something could not be done; the rest goes on.
    fn failed(&mut self, failure: Failure);
}

/// Every relation of a plan; false if it was stopped on the way.
///
/// # Errors
/// Those of the desk.
pub fn measure(plan: &RelationsPlan, desk: &mut dyn Desk) -> Result<bool, Error> {
    let table = &plan.base.moments;
    for material in &plan.base.materials {
        if desk.cancelled() {
            return Ok(false);
        }
        let job = Job::of(material).to_string();
        let built = hash(&material.spec.inputs()).and_then(|inputs| {
            let brdf = material.spec.build(plan.base.channels());
            let brdf = brdf.map_err(|e| e.to_string())?;
            let channel = table.spec.channels[0];
            let seed = plan.base.seed;
            let profile = Profile::new(&*brdf, channel, &table.spec, &*table.estimator, seed);
            Ok((inputs, brdf, profile.map_err(|e| e.to_string())?))
        });
        let (mut inputs, brdf, profile) = match built {
            Ok(built) => built,
            Err(reason) => {
                let jobs = plan.lightings.len();
                desk.failed(Failure { job, reason, jobs });
                continue;
            }
        };
        for light in &plan.lightings {
            let job = format!("{job}, {}", light.name);
            let built = hash(&light.spec.inputs())
                .and_then(|read| Ok((read, light.spec.build().map_err(|e| e.to_string())?)));
            let rows = built.and_then(|(read, lighting)| {
                inputs.extend(read);
                relations(plan, desk, &*brdf, &profile, &*lighting)
            });
            match rows {
                Ok(None) => return Ok(false),
                Ok(Some(relations)) => {
                    let row = |relation| RelationRow {
                        material: material.name.clone(),
                        lighting: light.name.clone(),
                        relation,
                    };
                    let rows = relations.into_iter().map(row).collect();
                    desk.rows(rows, std::mem::take(&mut inputs))?;
                }
                Err(reason) => desk.failed(Failure {
                    job,
                    reason,
                    jobs: 1,
                }),
            }
        }
    }
    Ok(true)
}

/// The relations of a material under a lighting; `None` if they were stopped.
fn relations(
    plan: &RelationsPlan,
    desk: &dyn Desk,
    brdf: &dyn Brdf,
    profile: &Profile,
    lighting: &dyn Lighting,
) -> Result<Option<Vec<Relation>>, String> {
    let mut relations = Vec::new();
    for &along in &plan.along {
        for &view in &plan.views {
            if desk.cancelled() {
                return Ok(None);
            }
            let relation = compare(brdf, profile, lighting, view, along, &plan.spec);
            relations.push(relation.map_err(|e| e.to_string())?);
        }
    }
    Ok(Some(relations))
}
