//! The experiment `relations`: moments of the radiance that a material reflects, rendered and
//! predicted from moments of its slices and of the light (Zubiaga et al. 2015, §3.2 and §3.3; see
//! [`docs::relations`](crate::docs::relations)).

use super::checks::{distinct, name_all, refuse_empty};
use super::counts::{Built, Stage};
use super::each::{Of, PerMaterial};
use super::key::{Expected, Input, Part, RowKey, forget_paths, hash, of_part};
use super::moments::{self, MomentsPlan};
use super::observer::{EventSink, Stop};
use super::record::{Head, Record};
use super::source::Source;
use super::tables::{Named, insert_list, named, section, take_list};
use crate::brdf::{BuildError, Channels};
use crate::error::{Error, listed};
use crate::lighting::{self, Lighting, LightingSpec};
use crate::moments::Profile;
use crate::moments::relations::{
    Along, LEAST_TURNING_DEG, Relation, RelationSpec, SliceModel, compare,
};
use crate::registry::{self, ReadError, Table, keys, with};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

keys! {
    /// `[relations]`: the views, and the keys of [`RelationSpec`].
    struct Keys {
        views_deg: Vec<f64> = (1..=7).map(|i| 10.0 * f64::from(i)).collect();
        along: Vec<Along> = vec![Along::Theta, Along::Phi];
        window_deg: Widths = Widths::One(RelationSpec::default().window_deg);
        azimuth_deg: f64 = RelationSpec::default().azimuth_deg;
        tolerance: f64 = RelationSpec::default().tolerance;
        max_evaluations: usize = RelationSpec::default().max_evaluations;
        max_views: usize = RelationSpec::default().max_views;
        components: usize = RelationSpec::default().components;
    }
}

/// Widths of the window, degrees; a config writes `20` or `[5, 20]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "window_deg: allowed is a number of degrees, or several: [5, 20]"
)]
enum Widths {
    One(f64),
    Several(Vec<f64>),
}

impl Widths {
    fn list(&self) -> Vec<f64> {
        match self {
            Self::One(width) => vec![*width],
            Self::Several(widths) => widths.clone(),
        }
    }
}

/// A lighting with its name in results.
pub struct PlannedLight {
    /// The name, unique in its plan.
    pub name: String,
    /// Specification it is built from.
    pub spec: Box<dyn LightingSpec>,
    /// The lighting that was built last, with the hash of what determines it.
    built: Mutex<Option<(blake3::Hash, Arc<dyn Lighting>)>>,
}

impl fmt::Debug for PlannedLight {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {:?}", self.name, self.spec)
    }
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
    /// Directions in which the view moves.
    pub along: Vec<Along>,
    /// Settings of the measurement of a relation, with each width of the window.
    pub specs: Vec<RelationSpec>,
    /// The config with every default filled in.
    pub resolved: toml::Table,
}

impl RelationsPlan {
    /// Reads and checks a config of kind `relations`.
    ///
    /// # Errors
    /// [`Error::Config`] and [`Error::Data`].
    pub(super) fn read(source: &Source) -> Result<Self, Error> {
        let (table, lights, keys) = parts(source.table()?).map_err(|e| source.error(e))?;
        let base = MomentsPlan::from_table(source, table)?;
        let here = source.place("relations");
        let windows = keys.window_deg.list();
        let of = |window_deg: &f64| RelationSpec {
            window_deg: *window_deg,
            azimuth_deg: keys.azimuth_deg,
            tolerance: keys.tolerance,
            max_evaluations: keys.max_evaluations,
            max_views: keys.max_views,
            components: keys.components,
        };
        let specs: Vec<RelationSpec> = windows.iter().map(of).collect();
        let at = here.key("window_deg");
        refuse_empty(&at, &windows)?;
        distinct(&at, &windows, f64::to_string)?;
        for spec in &specs {
            spec.check().map_err(|e| here.refused_key(&e))?;
        }
        let at = here.key("views_deg");
        refuse_empty(&at, &keys.views_deg)?;
        distinct(&at, &keys.views_deg, f64::to_string)?;
        let last = base.moments.spec.max_view_deg;
        let is_outside = |view: &f64| !(0.0..=last).contains(view);
        if let Some(i) = keys.views_deg.iter().position(is_outside) {
            let allowed = format!("an angle in [0, {last}], the range of [moments]");
            return Err(at.index(i).refused(keys.views_deg[i], allowed));
        }
        let at = here.key("along");
        refuse_empty(&at, &keys.along)?;
        distinct(&at, &keys.along, |a| a.name())?;
        let turns = keys.along.contains(&Along::Azimuth);
        let is_at_normal = |view: &f64| turns && *view < LEAST_TURNING_DEG;
        if let Some(i) = keys.views_deg.iter().position(is_at_normal) {
            let allowed = format!(
                "at least {LEAST_TURNING_DEG} where along has azimuth: it turns about the normal"
            );
            let at = here.key("views_deg").index(i);
            return Err(at.refused(keys.views_deg[i], allowed));
        }
        let order = base.moments.spec.order.get();
        if order < 2 {
            let allowed = "a whole number in [2, 4] in this experiment";
            return Err(source.place("moments.order").refused(order, allowed));
        }
        let channels = &base.moments.spec.channels;
        if channels.len() > 1 {
            let found = format!("[{}]", listed(channels.iter().map(|c| c.name())));
            let at = source.place("moments.channels");
            return Err(at.refused(found, "one in this experiment"));
        }
        if let Some(m) = base.materials.iter().find(|m| !m.symmetry.isotropic) {
            let message = format!(
                "material {:?} is anisotropic: allowed here are isotropic ones",
                m.name
            );
            return Err(source.place("material").error(message));
        }
        let mut lightings = Vec::new();
        let at = source.place("lighting");
        let named = name_all(&at, lights, |s| s.label())?;
        for (i, (name, spec)) in named.into_iter().enumerate() {
            spec.check().map_err(|e| at.index(i).not_built(e))?;
            lightings.push(PlannedLight {
                name,
                spec,
                built: Mutex::default(),
            });
        }
        let mut resolved = base.resolved.clone();
        resolved.remove("analysis");
        let written = |l: &PlannedLight| with(l.spec.resolved(), "name", &*l.name);
        insert_list(&mut resolved, "lighting", lightings.iter().map(written));
        resolved.insert("relations".into(), section(&keys).into());
        Ok(Self {
            base,
            lightings,
            views: keys.views_deg.iter().map(|v| v.to_radians()).collect(),
            along: keys.along,
            specs,
            resolved,
        })
    }
}

type Parts<'s> = (Table<'s>, Vec<Named<dyn LightingSpec>>, Keys);

fn parts(mut table: Table<'_>) -> Result<Parts<'_>, ReadError> {
    moments::refuse_others(&table, &["lighting", "relations"])?;
    let lights = take_list(&mut table, "lighting", |t| named(t, lighting::read))?;
    let keys = registry::take(&mut table, "relations", registry::parse)?;
    Ok((table, lights.unwrap_or_default(), keys.unwrap_or_default()))
}

/// Reads the tables of a config of this kind, without checking their values.
pub(super) fn read_keys(table: Table<'_>) -> Result<(), ReadError> {
    let (table, _, _) = parts(table)?;
    moments::read_tables(table)
}

/// The relations of a material under a lighting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialRelations {
    /// Hash of everything that determines them.
    pub key: RowKey,
    /// Name of the material.
    pub material: String,
    /// Hash of the material's keys and files.
    pub material_key: RowKey,
    /// Name of the lighting.
    pub lighting: String,
    /// Relations, one per window, direction of motion and view; the views of a direction stand together, and the directions of a window.
    pub relations: Vec<Relation>,
}

impl MaterialRelations {
    /// One row per relation.
    pub fn rows(&self) -> impl Iterator<Item = RelationRow> {
        self.relations.iter().map(|&relation| RelationRow {
            material: self.material.clone(),
            lighting: self.lighting.clone(),
            relation,
        })
    }
}

/// One relation, as `relations.csv` has it.
#[derive(Clone, Debug, PartialEq)]
pub struct RelationRow {
    /// Name of the material.
    pub material: String,
    /// Name of the lighting.
    pub lighting: String,
    /// The relation, rendered and predicted.
    pub relation: Relation,
}

impl Record for MaterialRelations {
    const FILE: &'static str = "relations.jsonl";
    const TIMES: &'static [&'static str] = &[];

    fn key(&self) -> &str {
        &self.key
    }

    fn material(&self) -> (&str, &str) {
        (&self.material, &self.material_key)
    }

    fn label(&self) -> String {
        self.lighting.clone()
    }
}

impl RelationsPlan {
    /// Hash of everything that determines the relations under a lighting but the material; unreadable files fail later.
    fn part(&self, light: &PlannedLight) -> blake3::Hash {
        let mut part = Part::new();
        let mut lighting = light.spec.resolved();
        forget_paths(&mut lighting);
        part.feed(&light.name);
        part.feed(&lighting.to_string());
        for input in hash(&light.spec.inputs()).unwrap_or_default() {
            part.feed(&input.blake3);
        }
        part.feed(&self.base.moments.resolved().to_string());
        part.feed(&self.base.seed.to_string());
        let keys = self.resolved.get("relations").map(|k| k.to_string());
        part.feed(&keys.unwrap_or_default());
        part.finish()
    }

    /// A lighting, built from the files that the key of its record holds.
    fn lighting(
        &self,
        light: &PlannedLight,
        of: &Of<'_, SliceModel>,
    ) -> Result<Arc<dyn Lighting>, Stop> {
        let is_meant = |part| of_part(of.material_key, part) == of.key;
        let mut held = light.built.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, built)) = held.as_ref().filter(|(part, _)| is_meant(part)) {
            return Ok(Arc::clone(built));
        }
        let built: Arc<dyn Lighting> = Arc::from(light.spec.build().map_err(Stop::failed)?);
        // Read again: another program may replace its files at any time.
        let part = self.part(light);
        if !is_meant(&part) {
            return Err(Stop::failed(BuildError::Data {
                path: light.spec.inputs().into_iter().next().unwrap_or_default(),
                message: "it was replaced while the run went on".into(),
            }));
        }
        *held = Some((part, Arc::clone(&built)));
        Ok(built)
    }
}

impl PerMaterial for RelationsPlan {
    type Record = MaterialRelations;
    /// What the slices of the material are, for all its lightings.
    type Shared = SliceModel;

    fn head(&self) -> Head<'_> {
        Head {
            resolved: &self.resolved,
            ..self.base.head()
        }
    }

    fn records(&self) -> Vec<Expected> {
        let of =
            |light: &PlannedLight| Expected::of_any(&light.name, &light.name, self.part(light));
        self.lightings.iter().map(of).collect()
    }

    fn channels(&self) -> Channels {
        self.base.channels()
    }

    fn inputs(&self) -> Vec<Input> {
        let read = |light: &PlannedLight| hash(&light.spec.inputs()).unwrap_or_default();
        self.lightings.iter().flat_map(read).collect()
    }

    fn shared(
        &self,
        brdf: &Built,
        events: &mut EventSink<'_, MaterialRelations>,
    ) -> Result<SliceModel, Stop> {
        let table = &self.base.moments;
        let brdf = &brdf.counted_at(&events.counters, Stage::Moments);
        let (channel, seed) = (table.spec.channels[0], self.base.seed);
        let (profile, _) = events.counters.timed(Stage::Moments, || {
            Profile::new(brdf, channel, &table.spec, &*table.estimator, seed)
        });
        profile.map(SliceModel::new).map_err(Stop::failed)
    }

    fn record(
        &self,
        place: usize,
        of: Of<'_, SliceModel>,
        events: &mut EventSink<'_, MaterialRelations>,
    ) -> Result<MaterialRelations, Stop> {
        let light = &self.lightings[place];
        let lighting = self.lighting(light, &of)?;
        let counters = events.counters.clone();
        let brdf = of.brdf.counted_at(&counters, Stage::Evaluate);
        let mut relations = Vec::new();
        for spec in &self.specs {
            for &along in &self.along {
                for &view in &self.views {
                    events.go_on()?;
                    let (relation, _) = counters.timed(Stage::Evaluate, || {
                        compare(&brdf, of.shared, &*lighting, view, along, spec)
                    });
                    relations.push(relation.map_err(Stop::failed)?);
                }
            }
        }
        Ok(MaterialRelations {
            key: of.key,
            material: of.material.name.clone(),
            material_key: of.material_key.to_owned(),
            lighting: light.name.clone(),
            relations,
        })
    }
}
