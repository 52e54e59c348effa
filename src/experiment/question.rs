//! `[report]`: the choice that the findings of an acquisition compare.

use super::checks::each_once;
use super::choices::{Choice, NONE, OWN};
use super::source::Source;
use crate::error::{Error, one_of};
use crate::registry::named;
use serde::{Deserialize, Serialize};

named! {
    /// A column of a choice whose levels a report can compare.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Factor {
        /// The coordinates that are sampled; warps at the same place of their lists are compared.
        #[default]
        Parametrization = "parametrization",
        /// The warps of the coordinates that are sampled.
        Warp = "warp",
        /// Sample set.
        SampleSet = "sample_set",
        /// Instrument.
        Instrument = "instrument",
        /// Reconstruction.
        Reconstruction = "reconstruction",
        /// The coordinates that scattered readings are interpolated in.
        Coordinates = "coordinates",
    }
}

impl Factor {
    /// Its value in a choice.
    pub(crate) fn level(self, choice: &Choice) -> &str {
        match self {
            Factor::Parametrization => &choice.parametrization,
            Factor::Warp => &choice.warp,
            Factor::SampleSet => &choice.sample_set,
            Factor::Instrument => &choice.instrument,
            Factor::Reconstruction => &choice.reconstruction,
            Factor::Coordinates => &choice.coordinates,
        }
    }

    /// True if two choices differ in this column and in no other, but for what depends on the parametrization: warps, and between
    /// one and none the sample set and the names of coordinates.
    pub(super) fn alone_differs(self, a: &Choice, b: &Choice) -> bool {
        let by_guide = self == Factor::Parametrization;
        let unguided = by_guide && (a.parametrization == NONE) != (b.parametrization == NONE);
        Factor::ALL.into_iter().all(|factor| {
            let same = factor.level(a) == factor.level(b);
            match factor {
                factor if factor == self => !same,
                Factor::Warp => same || by_guide,
                Factor::SampleSet => same || unguided,
                Factor::Coordinates if unguided => a.worked_in() == b.worked_in(),
                _ => same,
            }
        })
    }
}

impl Choice {
    /// The coordinates that its reconstruction works in, those of the schedule by their name.
    pub(super) fn worked_in(&self) -> String {
        if self.coordinates != OWN {
            return self.coordinates.clone();
        }
        let warp = match self.warp.as_str() {
            NONE => String::new(),
            warp => format!("+{}", warp.replace(';', "+")),
        };
        format!("{}{warp}", self.parametrization)
    }

    /// Identity of a row without its material: the allowance and the distribution of the test pairs as rows name them.
    pub(super) fn label(&self, allowed: &str, seed: u64, measure: &str) -> String {
        let all = Factor::ALL.map(|factor| format!("{:?}", factor.level(self)));
        // Names are free texts: in quotes no two labels are written alike.
        format!("{} {allowed} {seed} {measure:?}", all.join(" "))
    }
}

/// The factor, reference and challenger of a report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSpec {
    /// Its title; the question, if there is one, stands above all.
    pub title: Option<String>,
    /// The column whose levels are compared, all else equal.
    pub factor: Factor,
    /// The level that others are compared with; the first if not written.
    pub reference: Option<String>,
    /// The level that the verdict is about; the best beside the reference if not written.
    pub challenger: Option<String>,
}

impl ReportSpec {
    /// Refuses names that are no level of the factor; `levels` are those of the plan.
    pub(super) fn check(&self, source: &Source, levels: &[&str]) -> Result<(), Error> {
        let at = source.place("report");
        for (key, name) in [
            ("reference", &self.reference),
            ("challenger", &self.challenger),
        ] {
            if let Some(name) = name
                && !levels.contains(&name.as_str())
            {
                let allowed = format!(
                    "a {} of this config: {}",
                    self.factor.name(),
                    one_of(name, each_once(levels.iter().copied()))
                );
                return Err(at.key(key).refused(format!("{name:?}"), allowed));
            }
        }
        if self.reference.is_some() && self.reference == self.challenger {
            let another = self.factor.name();
            let predicate = format!("is the reference itself; allowed: another {another}");
            return Err(at.key("challenger").problem(predicate));
        }
        Ok(())
    }
}
