//! What a bench would report. Today's instrument is ideal: arms at exactly the asked directions,
//! point source and detector, no noise. Its reading is the BRDF itself, bit for bit.

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
        let outcomes = presence
            .into_iter()
            .map(|p| match p {
                Presence::Present => Outcome::Reading,
                Presence::Missing => Outcome::NoData,
            })
            .collect();
        Measurement {
            schedule: Arc::clone(schedule),
            channels,
            values,
            outcomes,
        }
    }
}
