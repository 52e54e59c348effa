//! Where errors count, and the poses that a planner chooses from.

use super::Task;
use crate::geometry::{Direction, DirectionPair, Symmetry, angle_between};
use crate::instrument::Machine;
use crate::measurement::{Measurement, Outcome};
use crate::parametrization::{Coords, Parametrization, usual_form};
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

/// Candidates that are drawn before a machine is said to reach too few, for each that is wanted.
const PATIENCE: usize = 64;

/// θ_h as a share of a right angle, its root, below which the density is what it is there: it vanishes at the
/// peak, where one reading serves all around.
const PEAK: f64 = 0.04;

/// The part of a turn that is least near to any fraction of it, rad.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Candidates at θ_h = 0, where lobes peak.
const ON_PEAK: u64 = 24;

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

    /// The density of cos θ_i cos θ_o inside the mask, at a pair with these coordinates.
    fn density(&self, pair: &DirectionPair, coords: &Coords) -> f64 {
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.cos_theta());
        match i.min(o) > self.cos_mask {
            true => i * o * self.form.jacobian(coords),
            false => 0.0,
        }
    }
}

/// True if both directions of two pairs are near.
fn near(a: &DirectionPair, b: &DirectionPair) -> bool {
    let off = |a: Direction, b: Direction| angle_between(a.vector(), b.vector());
    off(a.omega_i, b.omega_i).max(off(a.omega_o, b.omega_o)) < NEAR
}

/// A seed from several numbers, with nothing in common with that of others (splitmix64; Steele et al. 2014).
fn hashed(numbers: [u64; 3]) -> u64 {
    numbers.into_iter().fold(0, |state, x| {
        let z = (state ^ x).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}

impl Field {
    /// Candidates for `poses` poses in the coordinates of a task, where errors count up to the elevation `mask`, rad,
    /// and none is near a pose of a measurement that the instrument could not take. `round` tells fields of one
    /// seed apart.
    pub fn new(
        task: &Task<'_>,
        mask: f64,
        poses: usize,
        so_far: &Measurement,
        round: u64,
    ) -> Result<Self, PlanError> {
        let own = Own::new(task.form.symmetry(), mask);
        let [for_places, for_candidates] = [0, 1].map(|role| hashed([task.seed, round, role]));
        let at = SobolSet {}.plan(&own.form, PLACES, for_places)?.poses;
        let inside = at
            .iter()
            .map(|pose| (pose.pair, own.density(&pose.pair, &pose.coords)));
        let (places, density): (Vec<_>, Vec<_>) = inside.filter(|p| p.1 > 0.0).unzip();
        let canonical = |pair: &DirectionPair| {
            let coords = task.form.forward(pair);
            let pair = task.form.inverse(&coords)?;
            Some(Pose { coords, pair })
        };
        let all = so_far.outcomes.iter().zip(&so_far.schedule.poses);
        let refused = all.filter(|(outcome, _)| matches!(outcome, Outcome::Unreachable(_)));
        let refused = refused.filter_map(|(_, pose)| canonical(&pose.pair));
        let refused: Vec<DirectionPair> = refused.map(|pose| pose.pair).collect();
        let turn_freely = task.form.symmetry().isotropic;
        let taken = |pose: &Pose| {
            let reached = |m: &Machine| m.place(&pose.pair, turn_freely).is_ok();
            task.machine.is_none_or(reached) && !refused.iter().any(|other| near(&pose.pair, other))
        };
        let wanted = CANDIDATES.max(OF_EACH * poses);
        let mut candidates = Vec::new();
        let mut drawn = wanted;
        while candidates.len() < wanted.min(2 * poses) || candidates.is_empty() {
            candidates = SobolSet {}.plan(&task.form, drawn, for_candidates)?.poses;
            candidates.retain(taken);
            if drawn >= PATIENCE * wanted {
                break;
            }
            drawn *= 4;
        }
        let on_peak = (0..ON_PEAK).filter_map(|k| {
            let turn = (hashed([for_candidates, 2, k]) >> 11) as f64 / (1_u64 << 53) as f64;
            let theta = (k as f64 + turn) / ON_PEAK as f64 * FRAC_PI_2;
            // Azimuths that no mirror of the material makes one.
            let phi = k as f64 * GOLDEN_ANGLE;
            canonical(&DirectionPair::from_spherical(theta, phi, theta, phi + PI))
        });
        candidates.extend(on_peak.filter(taken));
        Ok(Self {
            own,
            places,
            density,
            candidates,
        })
    }

    /// The density of errors at the candidates; on the peak, where it vanishes, that around it.
    pub fn candidate_density(&self) -> Vec<f64> {
        let pairs = self.candidates.iter().map(|pose| &pose.pair);
        let density = |pair| {
            let mut coords = self.own.form.forward(pair);
            coords[0] = coords[0].max(PEAK);
            self.own.density(pair, &coords)
        };
        pairs.map(density).collect()
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
