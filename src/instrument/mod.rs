//! Virtual instruments: measurements of a BRDF along a schedule.
//!
//! [`Ideal`] has its arms at exactly the asked directions, a point source, a point detector and no
//! noise: its reading is the BRDF itself, bit for bit, at the cost of evaluating it.
//!
//! A [`Bench`] is a machine of a [preset](presets()): a [`Machine`] of rotation axes with limits,
//! apertures, a detector, motion that takes time. It plans an
//! [`Itinerary`](crate::schedule::Itinerary) of a schedule, and a [`Session`] measures along it. Each
//! part can be left out, and then costs nothing.

mod bench;
mod class;
mod detector;
mod machine;
mod motion;
mod optics;
mod picture;
#[cfg(feature = "experiments")]
mod presets;
mod spec;
mod tour;

pub use bench::{Bench, Parts, Session};
pub use class::{AxisTemplate, Class, Ends, classes};
pub use machine::{Axis, Machine};
pub use motion::{AxisMotion, Motion, Stop, Travel};
pub use optics::{Average, Filling, Footprint, Optics, Tolerance, Workspace, collected, footprint};
#[cfg(feature = "experiments")]
pub use presets::{Preset, axis_names, presets, read, read_table};
pub use spec::{
    AxisSpec, BodySpec, CalibrationSpec, CollisionSpec, DetectorSpec, InstrumentSpec, LimitsSpec,
    PictureSpec, Provenance, Scan, SourceSpec, Tag, TimingSpec,
};
pub use tour::Order;

use crate::brdf::{Brdf, Presence};
use crate::geometry::DirectionPair;
use crate::measurement::{Measurement, Outcome};
use crate::schedule::Schedule;
use rayon::prelude::*;
use std::sync::Arc;

/// Measures a BRDF at the poses of a schedule.
pub trait Instrument: Send + Sync {
    /// The outcome of every pose.
    fn measure(&self, brdf: &dyn Brdf, schedule: &Arc<Schedule>) -> Measurement;
}

/// The instrument without flaws.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ideal;

/// Poses per parallel task: enough to hide the cost of a task, few enough to balance two cores.
const CHUNK: usize = 1024;

impl Instrument for Ideal {
    fn measure(&self, brdf: &dyn Brdf, schedule: &Arc<Schedule>) -> Measurement {
        let channels = brdf.channels();
        let n = channels.count();
        let mut values = vec![0.0; schedule.poses.len() * n];
        let mut presence = vec![Presence::Present; schedule.poses.len()];
        values
            .par_chunks_mut(CHUNK * n)
            .zip(presence.par_chunks_mut(CHUNK))
            .zip(schedule.poses.par_chunks(CHUNK))
            .for_each(|((values, presence), poses)| {
                let pairs: Vec<DirectionPair> = poses.iter().map(|p| p.pair).collect();
                brdf.eval_batch(&pairs, values, presence);
            });
        let outcome = |presence| match presence {
            Presence::Present => Outcome::Reading,
            Presence::Missing => Outcome::NoData,
        };
        Measurement {
            schedule: Arc::clone(schedule),
            channels: channels.clone(),
            values,
            outcomes: presence.into_iter().map(outcome).collect(),
            details: None,
            places: Vec::new(),
            half_angles_deg: [0.0; 2],
        }
    }
}
