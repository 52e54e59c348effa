//! The profiles of every material, and the rows they become.

use super::plan::MomentsPlan;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::observer::{Failure, Input, Job};
use crate::experiment::plan::Material;
use crate::experiment::run::{hash, timed};
use crate::moments::{Channel, Component, Profile, SliceMoments};

/// The profiles of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialProfiles {
    /// Name of the material.
    pub material: String,
    /// The kind of the material; materials of a kind are analysed together.
    pub group: String,
    /// One a channel of the plan.
    pub profiles: Vec<Profile>,
    /// Wall time of each.
    pub seconds: Vec<f64>,
}

impl MaterialProfiles {
    /// One row a channel and view.
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
    /// Which number of it.
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

    /// The same with its names, for JSON; `null` where there is no value.
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

/// Is told what happens while materials are analysed, and may stop it.
pub trait Desk {
    /// True if the run shall stop; asked before every profile.
    fn cancelled(&self) -> bool {
        false
    }

    /// A material's turn has come.
    fn begins(&mut self, _material: &Material) {}

    /// The profiles of a material are there; `inputs` are the files it was read from.
    ///
    /// # Errors
    /// End the run.
    fn profiles(
        &mut self,
        brdf: &dyn Brdf,
        profiles: MaterialProfiles,
        inputs: Vec<Input>,
    ) -> Result<(), Error>;

    /// A material could not be analysed; the others go on.
    fn failed(&mut self, failure: Failure);
}

/// The profiles of every material of a plan, one material after the other; false if it was stopped
/// on the way.
///
/// # Errors
/// Those of the desk.
pub fn measure(plan: &MomentsPlan, desk: &mut dyn Desk) -> Result<bool, Error> {
    for material in &plan.materials {
        if desk.cancelled() {
            return Ok(false);
        }
        desk.begins(material);
        let inputs = hash(&material.spec.inputs());
        let brdf = material.spec.build(plan.channels());
        let (inputs, brdf) = match (inputs, brdf.map_err(|e| e.to_string())) {
            (Ok(inputs), Ok(brdf)) => (inputs, brdf),
            (Err(reason), _) | (_, Err(reason)) => {
                desk.failed(Failure {
                    job: Job::of(material).to_string(),
                    reason,
                    jobs: 1,
                });
                continue;
            }
        };
        let mut profiles = MaterialProfiles {
            material: material.name.clone(),
            group: material.group(),
            profiles: Vec::new(),
            seconds: Vec::new(),
        };
        let table = &plan.moments;
        for &channel in &table.spec.channels {
            if desk.cancelled() {
                return Ok(false);
            }
            let (profile, seconds) =
                timed(|| Profile::new(&*brdf, channel, &table.spec, &*table.estimator, plan.seed));
            // The plan has checked every key, and builds what the channels need.
            profiles
                .profiles
                .push(profile.map_err(|e| Error::Internal(e.to_string()))?);
            profiles.seconds.push(seconds);
        }
        desk.profiles(&*brdf, profiles, inputs)?;
    }
    Ok(true)
}
