//! The moment profiles of every material, and their rows in `profiles.csv`.

use super::plan::MomentsPlan;
use crate::brdf::Channels;
use crate::error::Error;
use crate::experiment::counts::{Built, Stage};
use crate::experiment::each::{Of, PerMaterial};
use crate::experiment::key::{Expected, Part, RowKey};
use crate::experiment::observer::{EventSink, Stop};
use crate::experiment::record::{Head, Record};
use crate::moments::{Channel, Clamping, Profile, SliceMoments};
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
    /// One profile per channel of the plan, of views at azimuth 0.
    pub profiles: Vec<Profile>,
    /// Those of further view azimuths, all azimuths of a channel after one another; none of isotropic materials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<Profile>,
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

const LABEL: &str = "profiles";

impl MaterialProfiles {
    /// One row per channel and view; those of further azimuths last.
    pub fn rows(&self) -> impl Iterator<Item = ProfileRow<'_>> {
        let of = |profile| ProfileRow::of_profile(&self.material, profile);
        self.profiles.iter().chain(&self.further).flat_map(of)
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
    /// View azimuth, rad.
    pub phi_o: f64,
    /// The moments.
    pub slice: &'a SliceMoments,
}

impl<'a> ProfileRow<'a> {
    /// The rows of a profile, one per view.
    pub fn of_profile(material: &'a str, profile: &'a Profile) -> impl Iterator<Item = Self> {
        let views = profile.views.iter().zip(&profile.slices);
        views.map(move |(&theta_o, slice)| Self {
            material,
            channel: profile.channel,
            theta_o,
            phi_o: profile.azimuth,
            slice,
        })
    }
}

/// Degrees of an angle that was degrees before: without the last digits, which are rounding.
pub fn degrees(angle: f64) -> f64 {
    (angle.to_degrees() * 1e10).round() / 1e10
}

/// A number with as many digits as distinguish it from every other one, with an exponent if it is small.
pub fn shown(value: f64) -> String {
    format!("{value:?}")
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
    type Record = MaterialProfiles;
    type Shared = ();

    fn head(&self) -> Head<'_> {
        Head {
            question: self.question.as_deref(),
            resolved: &self.resolved,
            seeds: std::slice::from_ref(&self.seed),
            materials: &self.materials,
            missing: &self.missing,
        }
    }

    fn records(&self) -> Vec<Expected> {
        vec![Expected::of_any(LABEL, LABEL, self.part())]
    }

    fn channels(&self) -> Channels {
        MomentsPlan::channels(self)
    }

    fn shared(&self, _: &Built, _: &mut EventSink<'_, MaterialProfiles>) -> Result<(), Stop> {
        Ok(())
    }

    fn record(
        &self,
        _place: usize,
        of: Of<'_, ()>,
        events: &mut EventSink<'_, MaterialProfiles>,
    ) -> Result<MaterialProfiles, Stop> {
        let table = &self.moments;
        let counters = events.counters.clone();
        let brdf = of.brdf.counted_at(&counters, Stage::Moments);
        let (mut profiles, mut further, mut times) = (Vec::new(), Vec::new(), Vec::new());
        for &channel in &table.spec.channels {
            events.go_on()?;
            let (profile, seconds) = counters.timed(Stage::Moments, || {
                Profile::new(&brdf, channel, &table.spec, &*table.estimator, self.seed)
            });
            // The plan has checked every key, and builds what the channels need.
            let profile = profile.map_err(Error::internal)?;
            times.push(seconds);
            for azimuth in table.spec.further_azimuths(&brdf) {
                events.go_on()?;
                let (made, seconds) = counters.timed(Stage::Moments, || {
                    let estimator = &*table.estimator;
                    profile.at_azimuth(azimuth, &brdf, &table.spec, estimator, self.seed)
                });
                further.push(made.map_err(Error::internal)?);
                times.push(seconds);
            }
            profiles.push(profile);
        }
        // Colours of a material share their shape: the first channel stands for all.
        let clamping = match self.analysis.horizon {
            false => None,
            true => {
                let range = self.analysis.range().map_err(Error::internal)?;
                let last = range.ends[1];
                let found = Clamping::of(&brdf, &profiles[0], &*table.estimator, last);
                Some(found.map_err(Error::internal)?)
            }
        };
        Ok(MaterialProfiles {
            key: of.key,
            material: of.material.name.clone(),
            material_key: of.material_key.to_owned(),
            group: of.material.group(),
            profiles,
            further,
            seconds: times,
            clamping,
        })
    }
}
