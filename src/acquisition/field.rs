//! Where errors count, and the poses that a planner chooses from.

use super::{Task, usual_form};
use crate::geometry::{Direction, DirectionPair, Symmetry, angle_between};
use crate::measurement::{Measurement, Outcome};
use crate::parametrization::Parametrization;
use crate::schedule::{PlanError, Pose, SampleSet, SobolSet};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Places at which an error is estimated.
const PLACES: usize = 1400;

/// Candidates, of which a budget is chosen.
const CANDIDATES: usize = 2200;

/// Candidates for each pose that is chosen, at least.
const OF_EACH: usize = 4;

/// Poses this near to one that the instrument could not take are taken to be out of its reach too, rad.
const NEAR: f64 = 0.05;

/// The part of a turn that is least near to any fraction of it, rad.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Candidates at θ_h = 0, where lobes peak.
const ON_PEAK: usize = 24;

/// Places and candidates of one round; other rounds have others.
pub(super) struct Field {
    own: Own,
    /// Points of half/difference coordinates with a square root along θ_h.
    pub places: Vec<DirectionPair>,
    /// The density of errors at each place: of cos θ_i cos θ_o in those coordinates.
    pub density: Vec<f64>,
    /// Poses that the instrument can take.
    pub candidates: Vec<Pose>,
}

/// Coordinates that are fine where lobes peak.
struct Own {
    form: Arc<dyn Parametrization>,
    cos_mask: f64,
}

impl Own {
    fn new(symmetry: Symmetry, mask: f64) -> Self {
        Self {
            form: usual_form(symmetry),
            cos_mask: mask.cos(),
        }
    }

    /// The density of cos θ_i cos θ_o inside the mask, at a pair.
    fn density(&self, pair: &DirectionPair) -> f64 {
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.cos_theta());
        match i.min(o) > self.cos_mask {
            true => i * o * self.form.jacobian(&self.form.forward(pair)),
            false => 0.0,
        }
    }
}

impl Field {
    /// Candidates for `poses` poses in the coordinates of a task, where errors count up to the elevation `mask`, rad.
    /// `round` tells fields of one seed apart.
    pub fn new(task: &Task<'_>, mask: f64, poses: usize, round: u64) -> Result<Self, PlanError> {
        let own = Own::new(task.form.symmetry(), mask);
        // Seeds are hashed: any odd constant keeps those of two rounds apart.
        let seed = task
            .seed
            .wrapping_add(round.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let at = SobolSet {}.plan(&own.form, PLACES, seed ^ 1)?.poses;
        let inside = at.iter().map(|pose| (pose.pair, own.density(&pose.pair)));
        let (places, density): (Vec<_>, Vec<_>) = inside.filter(|p| p.1 > 0.0).unzip();
        let count = CANDIDATES.max(OF_EACH * poses);
        let mut candidates = SobolSet {}.plan(&task.form, count, seed)?.poses;
        let on_peak = (0..ON_PEAK).filter_map(|k| {
            let theta = (k as f64 + 0.5) / ON_PEAK as f64 * FRAC_PI_2;
            // Azimuths that no mirror of the material makes one.
            let phi = k as f64 * GOLDEN_ANGLE;
            let pair = DirectionPair::from_spherical(theta, phi, theta, phi + PI);
            let coords = task.form.forward(&pair);
            let pair = task.form.inverse(&coords)?;
            Some(Pose { coords, pair })
        });
        candidates.extend(on_peak);
        let turn_freely = task.form.symmetry().isotropic;
        if let Some(machine) = task.machine {
            candidates.retain(|pose| machine.place(&pose.pair, turn_freely).is_ok());
        }
        Ok(Self {
            own,
            places,
            density,
            candidates,
        })
    }

    /// Leaves out candidates near poses that the instrument could not take.
    pub fn avoid(&mut self, so_far: &Measurement) {
        let all = so_far.outcomes.iter().zip(&so_far.schedule.poses);
        let refused = all.filter(|(outcome, _)| matches!(outcome, Outcome::Unreachable(_)));
        let refused: Vec<DirectionPair> = refused.map(|(_, pose)| pose.pair).collect();
        let near = |a: Direction, b: Direction| angle_between(a.vector(), b.vector()) < NEAR;
        self.candidates.retain(|pose| {
            let pair = &pose.pair;
            let is_near = |other: &DirectionPair| {
                near(pair.omega_i, other.omega_i) && near(pair.omega_o, other.omega_o)
            };
            !refused.iter().any(is_near)
        });
    }

    /// The density of errors at the candidates.
    pub fn candidate_density(&self) -> Vec<f64> {
        let pairs = self.candidates.iter().map(|pose| &pose.pair);
        pairs.map(|pair| self.own.density(pair)).collect()
    }

    /// The pairs of the candidates.
    pub fn pairs(&self) -> Vec<DirectionPair> {
        self.candidates.iter().map(|pose| pose.pair).collect()
    }

    /// The candidates of these numbers.
    pub fn poses(&self, numbers: &[usize]) -> Vec<Pose> {
        numbers.iter().map(|&c| self.candidates[c]).collect()
    }
}
