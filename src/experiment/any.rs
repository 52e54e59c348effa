//! The experiment of a config, whatever its kind: the only place that distinguishes kinds.

use super::choices::Material;
use super::kind::Kind;
use super::moments::{AnalysisSpec, MomentsPlan};
use super::plan::Plan;
use super::relations::RelationsPlan;
use super::source::Source;
use crate::error::Error;
use crate::lighting::SkySpec;

/// An experiment of any kind, to be run.
pub enum AnyPlan {
    /// Measure, reconstruct and compare.
    Acquisition(Box<Plan>),
    /// Moment profiles.
    Moments(Box<MomentsPlan>),
    /// Moments of reflected radiance.
    Relations(Box<RelationsPlan>),
}

impl AnyPlan {
    /// Reads a config and puts it together.
    ///
    /// # Errors
    /// As [`Plan::read`].
    pub fn read(source: &Source) -> Result<Self, Error> {
        Ok(match Kind::of_config(source)? {
            Kind::Acquisition | Kind::Study => Self::Acquisition(Box::new(Plan::read(source)?)),
            Kind::Moments => Self::Moments(Box::new(MomentsPlan::read(source)?)),
            Kind::Relations => Self::Relations(Box::new(RelationsPlan::read(source)?)),
        })
    }

    pub(crate) fn materials(&self) -> &[Material] {
        match self {
            Self::Acquisition(plan) => &plan.materials,
            Self::Moments(plan) => &plan.materials,
            Self::Relations(plan) => &plan.base.materials,
        }
    }

    /// Its materials, and how their moments are taken.
    pub fn into_moments(self) -> MomentsPlan {
        match self {
            Self::Moments(plan) => *plan,
            Self::Relations(plan) => plan.base,
            Self::Acquisition(plan) => MomentsPlan {
                question: plan.question,
                seed: plan.seeds[0],
                materials: plan.materials,
                missing: plan.missing,
                moments: plan.moments.unwrap_or_default(),
                analysis: AnalysisSpec::default(),
                lighting: Box::new(SkySpec::default()),
                resolved: plan.resolved,
                wavelengths: plan.channels.wavelengths().cloned(),
            },
        }
    }
}
