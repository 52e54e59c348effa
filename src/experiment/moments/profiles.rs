//! The moment profiles of every material, and their rows in `profiles.csv`.

use super::plan::MomentsPlan;
use crate::brdf::{BuildError, Channels};
use crate::error::Error;
use crate::experiment::choices::Material;
use crate::experiment::counts::{Built, Stage};
use crate::experiment::each::{self, Of, PerMaterial};
use crate::experiment::key::{Expected, Part, RowKey};
use crate::experiment::observer::{Observer, Stop, Summary, Teller, timed};
use crate::experiment::record::{Experiment, Extent, Known, Record, Shard};
use crate::moments::{Channel, Clamping, Component, Profile, SliceMoments};
use serde::{Deserialize, Serialize};

/// The profiles of a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialProfiles {
    /// Hash of everything that determines them.
    pub key: RowKey,
    /// Name of the material.
    pub material: String,
    /// Hash of the material's keys and files.
    pub material_key: RowKey,
    /// The kind of the material; materials of a kind are analysed together.
    pub group: String,
    /// One profile per channel of the plan.
    pub profiles: Vec<Profile>,
    /// Wall time of each profile, s; empty if the timings of the run are lost.
    #[serde(default)]
    pub seconds: Vec<f64>,
    /// Clamping of the first profile by the horizon, if the config asks for it.
    pub clamping: Option<Clamping>,
}

impl Record for MaterialProfiles {
    const FILE: &'static str = "profiles.jsonl";
    const TIMES: &'static [&'static str] = &["seconds"];

    fn key(&self) -> &str {
        &self.key
    }

    fn material(&self) -> (&str, &str) {
        (&self.material, &self.material_key)
    }

    fn label(&self) -> String {
        LABEL.into()
    }
}

/// Label of a record.
const LABEL: &str = "profiles";

impl MaterialProfiles {
    /// One row per channel and view.
    pub fn rows(&self) -> impl Iterator<Item = ProfileRow<'_>> {
        self.profiles.iter().flat_map(move |profile| {
            let views = profile.views.iter().zip(&profile.slices);
            views.map(move |(&theta_o, slice)| ProfileRow {
                material: &self.material,
                channel: profile.channel,
                theta_o,
                slice,
            })
        })
    }
}

/// The moments of one slice, as `profiles.csv` has them.
#[derive(Clone, Copy, Debug)]
pub struct ProfileRow<'a> {
    /// Name of the material.
    pub material: &'a str,
    /// Channel of the profile.
    pub channel: Channel,
    /// View elevation, rad.
    pub theta_o: f64,
    /// The moments.
    pub slice: &'a SliceMoments,
}

impl ProfileRow<'_> {
    /// The columns of a table of rows.
    pub fn columns() -> Vec<String> {
        let mut columns: Vec<String> = ["material", "channel", "theta_o_deg"]
            .map(String::from)
            .into();
        for component in Component::ALL {
            columns.push(component.to_string());
            columns.push(format!("{component}_uncertainty"));
        }
        columns.extend(
            [
                "missing_share",
                "clamped_share",
                "evaluations",
                "unresolved",
            ]
            .map(String::from),
        );
        columns
    }

    /// The fields, in the order of the columns; empty where there is no value.
    pub fn fields(&self) -> Vec<String> {
        let mut fields = vec![
            self.material.to_owned(),
            self.channel.name().to_owned(),
            shown(degrees(self.theta_o)),
        ];
        for component in Component::ALL {
            let estimate = self.slice.moments.get(component);
            fields.push(estimate.map_or(String::new(), |e| shown(e.value)));
            fields.push(estimate.map_or(String::new(), |e| shown(e.uncertainty)));
        }
        fields.push(shown(self.slice.missing_share));
        fields.push(shown(self.slice.clamped_share));
        fields.push(self.slice.evaluations.to_string());
        let unresolved = self.slice.unresolved;
        fields.push(unresolved.map_or(String::new(), |u| u.to_string()));
        fields
    }

    /// The fields with their names, for JSON; `null` where there is no value.
    pub fn json(&self) -> serde_json::Value {
        let mut object = serde_json::Map::new();
        object.insert("material".into(), self.material.into());
        object.insert("channel".into(), self.channel.name().into());
        object.insert("theta_o_deg".into(), degrees(self.theta_o).into());
        for component in Component::ALL {
            let estimate = self.slice.moments.get(component);
            let name = component.to_string();
            object.insert(name.clone(), estimate.map(|e| e.value).into());
            let uncertainty = estimate.map(|e| e.uncertainty);
            object.insert(format!("{name}_uncertainty"), uncertainty.into());
        }
        object.insert("missing_share".into(), self.slice.missing_share.into());
        object.insert("clamped_share".into(), self.slice.clamped_share.into());
        object.insert("evaluations".into(), self.slice.evaluations.into());
        let unresolved = self.slice.unresolved.map(|u| u.to_string());
        object.insert("unresolved".into(), unresolved.into());
        object.into()
    }
}

/// Degrees of an angle that was degrees before: without the last digits, which are rounding.
pub fn degrees(angle: f64) -> f64 {
    (angle.to_degrees() * 1e10).round() / 1e10
}

/// A number with the digits that tell it from every other one, with an exponent if it is small.
pub fn shown(value: f64) -> String {
    format!("{value:?}")
}

impl Experiment for MomentsPlan {
    type Record = MaterialProfiles;

    fn question(&self) -> Option<&str> {
        self.question.as_deref()
    }

    fn resolved(&self) -> &toml::Table {
        &self.resolved
    }

    fn seeds(&self) -> Vec<u64> {
        vec![self.seed]
    }

    fn materials(&self) -> &[Material] {
        &self.materials
    }

    fn missing(&self) -> &[String] {
        &self.missing
    }

    fn expected(&self, shard: Option<Shard>) -> Vec<Expected> {
        let part = self.part();
        let mine = |i: &usize| shard.is_none_or(|s| s.has(*i));
        let of = |material: usize| Expected {
            material,
            label: LABEL.into(),
            job: format!("{}, {LABEL}", self.materials[material].name),
            part,
        };
        (0..self.materials.len()).filter(mine).map(of).collect()
    }

    fn run(
        &self,
        extent: &Extent,
        known: &Known<MaterialProfiles>,
        observer: &mut dyn Observer<MaterialProfiles>,
    ) -> Result<Summary, Error> {
        each::run(self, extent, known, observer)
    }
}

impl MomentsPlan {
    /// Hash of everything that determines profiles but the material.
    fn part(&self) -> blake3::Hash {
        let mut part = Part::new();
        part.feed(LABEL);
        part.feed(&self.moments.resolved().to_string());
        part.feed(&self.seed.to_string());
        // What the horizon explains counts up to the last fitted view.
        let horizon = self.analysis.horizon.then_some(self.analysis.max_view_deg);
        part.feed(&format!("{horizon:?}"));
        part.finish()
    }
}

impl PerMaterial for MomentsPlan {
    type Shared = ();

    fn channels(&self) -> Channels {
        MomentsPlan::channels(self)
    }

    fn shared(&self, _: &Built, _: &mut Teller<'_, MaterialProfiles>) -> Result<(), BuildError> {
        Ok(())
    }

    fn record(
        &self,
        _place: usize,
        of: Of<'_, ()>,
        teller: &mut Teller<'_, MaterialProfiles>,
    ) -> Result<Result<MaterialProfiles, BuildError>, Stop> {
        let internal = |e: &dyn std::fmt::Display| Error::Internal(e.to_string());
        let table = &self.moments;
        let ledger = teller.ledger.clone();
        let brdf = of.brdf.at(&ledger, Stage::Moments);
        let (mut profiles, mut times) = (Vec::new(), Vec::new());
        for &channel in &table.spec.channels {
            teller.go_on()?;
            let (profile, seconds) =
                timed(|| Profile::new(&brdf, channel, &table.spec, &*table.estimator, self.seed));
            // The plan has checked every key, and builds what the channels need.
            profiles.push(profile.map_err(|e| internal(&e))?);
            times.push(seconds);
        }
        teller.summary.seconds.moments += times.iter().sum::<f64>();
        // Colours of a material share their shape: the first channel stands for all.
        let clamping = match self.analysis.horizon {
            false => None,
            true => {
                let range = self.analysis.range().map_err(|e| internal(&e))?;
                let last = range.ends()[1];
                let found = Clamping::of(&brdf, &profiles[0], &*table.estimator, last);
                Some(found.map_err(|e| internal(&e))?)
            }
        };
        Ok(Ok(MaterialProfiles {
            key: of.key,
            material: of.material.name.clone(),
            material_key: of.material_key.to_owned(),
            group: of.material.group(),
            profiles,
            seconds: times,
            clamping,
        }))
    }
}
