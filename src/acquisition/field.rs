//! Where errors count, and the poses that a planner chooses from.

use super::choice::Wanted;
use super::{Chosen, Task};
use crate::geometry::{Direction, DirectionPair, angle_between};
use crate::instrument::Machine;
use crate::measurement::{Measurement, Outcome};
use crate::numeric::{GRAZING_COS, hashed};
use crate::parametrization::{Parametrization, usual_form};
use crate::reconstruct::{Posterior, some};
use crate::sampling::GOLDEN_ANGLE;
use crate::schedule::{Draws, Pictures, PlanError, Pose, SampleSet, SobolSet, StopAngle, azimuth};
use glam::DVec3;
use std::cell::OnceCell;
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

/// Candidates at θ_h = 0, where lobes peak.
const ON_PEAK: u64 = 24;

/// Elevation of candidates and of places where errors count, at most, rad: tables are extrapolated beyond.
pub(super) const MASK: f64 = 80.0 * std::f64::consts::PI / 180.0;

/// Poses of a whole acquisition, at most, where each candidate is compared with all places for each pose.
pub(super) const MOST: usize = 1000;

/// Components of directions that differ by less are those of one pose: a file's digits may change the last.
const SAME: f64 = 1e-9;

/// Places and candidates of one round; other rounds have others.
pub(super) struct Field {
    /// Coordinates that are fine where lobes peak.
    own: Arc<dyn Parametrization>,
    cos_mask: f64,
    /// Points of half/difference coordinates with a square root along θ_h.
    pub places: Vec<DirectionPair>,
    /// The density of errors at each place: of cos θ_i cos θ_o in those coordinates.
    pub density: Vec<f64>,
    /// Poses that the instrument can take.
    pub candidates: Vec<Pose>,
    /// `None` where each pose is chosen by itself.
    pictures: Option<CandidatePictures>,
}

/// Stops of which whole pictures are chosen.
struct CandidatePictures {
    /// The poses of the picture of each stop.
    poses: Vec<Vec<Pose>>,
    /// The stop of each candidate: some poses of a picture stand for it.
    stops: Vec<u32>,
    /// Pictures to be chosen, and poses of all of them at most.
    n: usize,
    most: usize,
}

/// Stops that pictures are chosen of.
const STOPS: usize = 48;

/// Candidates of each stop, at most.
const OF_PICTURE: usize = 40;

/// Largest angle that a stop of a candidate is at, rad.
const LAST_STOP: f64 = 85.0 * std::f64::consts::PI / 180.0;

/// The density of cos θ_i cos θ_o inside the mask, at a pair with these coordinates.
fn density(own: &dyn Parametrization, cos_mask: f64, Pose { pair, coords }: &Pose) -> f64 {
    let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.cos_theta());
    match i.min(o) > cos_mask {
        true => i * o * own.jacobian(coords),
        false => 0.0,
    }
}

/// True if both directions of two pairs are near.
fn near(a: &DirectionPair, b: &DirectionPair) -> bool {
    let off = |a: Direction, b: Direction| angle_between(a.vector(), b.vector());
    off(a.omega_i, b.omega_i).max(off(a.omega_o, b.omega_o)) < NEAR
}

/// The poses that can be taken: by the machine of a task, and near none that an instrument could not take.
pub(super) struct Reach<'a> {
    form: &'a dyn Parametrization,
    machine: Option<&'a Machine>,
    refused: Vec<DirectionPair>,
    so_far: &'a Measurement,
    /// What was read and what was not, made when first asked for; `None` if that is singular.
    asked: OnceCell<Option<Posterior>>,
}

/// Poses where the share of readings is lower, of those nearby and of one besides, are left out by planners that
/// weigh nothing by it.
const HOPEFUL: f64 = 0.75;

impl<'a> Reach<'a> {
    /// After the poses of a measurement.
    pub(crate) fn new(task: &'a Task<'_>, so_far: &'a Measurement) -> Self {
        let all = so_far.outcomes.iter().zip(&so_far.schedule.poses);
        let refused = all.filter(|(outcome, _)| matches!(outcome, Outcome::Unreachable(_)));
        let refused = refused.filter_map(|(_, pose)| canonical(&*task.form, &pose.pair));
        Self {
            form: &*task.form,
            machine: task.machine,
            refused: refused.map(|pose| pose.pair).collect(),
            so_far,
            asked: OnceCell::new(),
        }
    }

    fn takes(&self, pose: &Pose) -> bool {
        let reached = |m: &Machine| m.place(&pose.pair, self.form.symmetry().isotropic).is_ok();
        let of_refused = |other: &DirectionPair| near(&pose.pair, other);
        self.machine.is_none_or(reached) && !self.refused.iter().any(of_refused)
    }

    /// The pose of a pair; `None` if it cannot be taken.
    pub(crate) fn pose(&self, pair: &DirectionPair) -> Option<Pose> {
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.cos_theta());
        let pose = (i.min(o) > GRAZING_COS).then(|| canonical(self.form, pair));
        pose.flatten().filter(|pose| self.takes(pose))
    }

    /// True where there may be readings.
    pub(crate) fn hopes(&self, poses: &[Pose]) -> Vec<bool> {
        let of = || supposed(Posterior::before(self.form.symmetry(), None), self.so_far);
        let all_read = self.so_far.readings() == self.so_far.outcomes.len();
        let asked = match all_read {
            true => None,
            false => self.asked.get_or_init(of).as_ref(),
        };
        let Some(process) = asked else {
            return vec![true; poses.len()];
        };
        let pairs: Vec<DirectionPair> = poses.iter().map(|pose| pose.pair).collect();
        let shares = process.readable(&process.places(&pairs)).into_iter();
        shares.map(|share| share >= HOPEFUL).collect()
    }

    /// Those of some poses where there may be readings.
    pub(crate) fn hopeful(&self, mut poses: Vec<Pose>) -> Vec<Pose> {
        let mut hopes = self.hopes(&poses).into_iter();
        poses.retain(|_| hopes.next() == Some(true));
        poses
    }
}

/// The pose of a pair in the coordinates of a form.
fn canonical(form: &dyn Parametrization, pair: &DirectionPair) -> Option<Pose> {
    let coords = form.forward(pair);
    let pair = form.inverse(&coords)?;
    Some(Pose { coords, pair })
}

/// Poses whose readings are supposed, at most: of more, so many at random.
pub(super) const MOST_ASKED: usize = 4000;

/// The pairs of a measurement that gave a reading, or those that gave none; of more than `most` poses of either kind, of so many at
/// random.
pub(super) fn pairs(so_far: &Measurement, read: bool, most: usize) -> Vec<DirectionPair> {
    let asked = some(so_far.outcomes.len(), most).into_iter();
    let wanted = asked.filter(|&i| (so_far.outcomes[i] == Outcome::Reading) == read);
    wanted.map(|i| so_far.schedule.poses[i].pair).collect()
}

/// The process without a reading, given where readings were and were not to be had, but not what was read; `None` if it is singular.
pub(super) fn supposed(process: Posterior, so_far: &Measurement) -> Option<Posterior> {
    let process = process.supposing(&pairs(so_far, true, MOST_ASKED), true)?;
    process.supposing(&pairs(so_far, false, MOST_ASKED), false)
}

/// The poses so far, with the luminance f where there was a reading.
pub(super) fn luminances(
    so_far: &Measurement,
) -> impl Iterator<Item = (&DirectionPair, Option<f64>)> {
    let channels = &so_far.channels;
    let values = so_far.values.chunks(channels.count());
    let all = so_far.outcomes.iter().zip(&so_far.schedule.poses);
    all.zip(values).map(|((outcome, pose), f)| {
        let read = *outcome == Outcome::Reading;
        (&pose.pair, read.then(|| channels.luminance(f)))
    })
}

impl Field {
    /// Candidates for `poses` poses in the coordinates of a task, where errors count up to the elevation `mask`, rad,
    /// and none is near a pose of a measurement that the instrument could not take. `round` is the stream of
    /// random numbers.
    pub(crate) fn new(
        task: &Task<'_>,
        mask: f64,
        poses: usize,
        so_far: &Measurement,
        round: u64,
    ) -> Result<Self, PlanError> {
        let mut field = Self::without_candidates(task, mask, round)?;
        let for_candidates = hashed([task.seed, round, 1]);
        let reach = Reach::new(task, so_far);
        let wanted = CANDIDATES.max(OF_EACH * poses);
        let mut candidates = Vec::new();
        let mut drawn = wanted;
        while candidates.len() < wanted.min(2 * poses) || candidates.is_empty() {
            candidates = SobolSet {}.plan(&task.form, drawn, for_candidates)?.poses;
            candidates.retain(|pose| reach.takes(pose));
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
            reach.pose(&DirectionPair::from_spherical(theta, phi, theta, phi + PI))
        });
        candidates.extend(on_peak);
        field.candidates = candidates;
        Ok(field)
    }

    /// [`new`](Self::new) for about `poses` poses in whole pictures, of stops at such angles.
    pub(crate) fn of_pictures(
        task: &Task<'_>,
        stop: StopAngle,
        mask: f64,
        poses: usize,
        so_far: &Measurement,
        round: u64,
    ) -> Result<Self, PlanError> {
        let mut field = Self::without_candidates(task, mask, round)?;
        let n = ((poses as f64 / Pictures::NODES as f64).round() as usize).max(1);
        let for_candidates = hashed([task.seed, round, 1]);
        let shift = (hashed([for_candidates, 3]) >> 11) as f64 / (1_u64 << 53) as f64;
        let set = Pictures {
            stop,
            ..Pictures::default()
        };
        let (reach, mut draws) = (
            Reach::new(task, so_far),
            Draws::new(for_candidates, &*task.form),
        );
        let first = hashed([for_candidates, 4]) as usize % STOPS;
        let pictures = (0..STOPS.max(2 * n)).map(|k| {
            let angle = (k as f64 + shift) / STOPS.max(2 * n) as f64 * LAST_STOP;
            let at = [angle, azimuth(first + k, task.form.symmetry())];
            draws.picture(&set, &*task.form, at, poses.div_ceil(n), |pose| {
                reach.takes(pose)
            })
        });
        let pictures: Vec<Vec<Pose>> = pictures.collect();
        let mut stops = Vec::new();
        for (stop, picture) in pictures.iter().enumerate() {
            let some = picture.iter().take(OF_PICTURE);
            stops.extend(some.clone().map(|_| stop as u32));
            field.candidates.extend(some);
        }
        field.pictures = Some(CandidatePictures {
            poses: pictures,
            stops,
            n,
            most: poses,
        });
        Ok(field)
    }

    fn without_candidates(task: &Task<'_>, mask: f64, round: u64) -> Result<Self, PlanError> {
        let (own, cos_mask) = (usual_form(task.form.symmetry()), mask.cos());
        let at = SobolSet {}
            .plan(&own, PLACES, hashed([task.seed, round, 0]))?
            .poses;
        let inside = at
            .iter()
            .map(|pose| (pose.pair, density(&*own, cos_mask, pose)));
        let (places, density) = inside.filter(|p| p.1 > 0.0).unzip();
        Ok(Self {
            own,
            cos_mask,
            places,
            density,
            candidates: Vec::new(),
            pictures: None,
        })
    }

    /// Choices among the candidates that make so many poses.
    pub(crate) fn wanted<'a>(&'a self, task: &'a Task<'_>, poses: usize) -> Wanted<'a> {
        match &self.pictures {
            None => task.wanted(poses),
            Some(pictures) => Wanted {
                stops: &pictures.stops,
                ..task.wanted(pictures.n * OF_PICTURE)
            },
        }
    }

    /// The density of errors at the candidates; on the peak, where it vanishes, that around it.
    pub(crate) fn candidate_density(&self) -> Vec<f64> {
        let around = |&Pose { pair, .. }: &Pose| {
            let mut coords = self.own.forward(&pair);
            coords[0] = coords[0].max(PEAK);
            density(&*self.own, self.cos_mask, &Pose { coords, pair })
        };
        self.candidates.iter().map(around).collect()
    }

    /// The pairs of the candidates.
    pub(crate) fn pairs(&self) -> Vec<DirectionPair> {
        self.candidates.iter().map(|pose| pose.pair).collect()
    }

    /// The candidates of these numbers, or the pictures of their stops.
    pub(crate) fn poses(&self, numbers: &[usize]) -> Vec<Pose> {
        let Some(pictures) = &self.pictures else {
            return numbers.iter().map(|&c| self.candidates[c]).collect();
        };
        let mut stops: Vec<u32> = numbers.iter().map(|&c| pictures.stops[c]).collect();
        stops.dedup();
        let stops = stops.into_iter().take(pictures.n);
        let poses = stops.flat_map(|stop| &pictures.poses[stop as usize]);
        poses.copied().take(pictures.most).collect()
    }
}

/// The error of more poses than a planner chooses at most.
pub(super) fn admit(kind: &'static str, budget: usize, most: usize) -> Result<(), PlanError> {
    match budget > most {
        true => Err(PlanError::Refused(format!(
            "budget = {budget}: {kind} chooses at most {most} poses; allowed: fewer"
        ))),
        false => Ok(()),
    }
}

/// Candidates for `n` poses after those of a measurement, where there may be readings, up to the mask; `None` if there
/// are none any more.
pub(super) fn field(
    kind: &'static str,
    (task, reach): (&Task<'_>, &Reach<'_>),
    so_far: &Measurement,
    n: usize,
) -> Result<Option<Field>, PlanError> {
    let asked = so_far.schedule.poses.len();
    let mut field = Field::new(task, MASK, n, so_far, asked as u64)?;
    field.candidates = reach.hopeful(field.candidates);
    field.candidates.retain(|pose| is_inside(&pose.pair));
    match field.candidates.is_empty() {
        // What was read is read.
        true if so_far.readings() > 0 => Ok(None),
        true => Err(PlanError::NoCandidate { sample_set: kind }),
        false => Ok(Some(field)),
    }
}

/// True if both directions are inside the mask.
pub(super) fn is_inside(pair: &DirectionPair) -> bool {
    pair.least_cosine() >= MASK.cos()
}

/// Some poses without those that are there twice or were asked for before, and then others of the candidates, until they
/// are `n`.
pub(super) fn filled(
    kind: &'static str,
    (task, reach): (&Task<'_>, &Reach<'_>),
    so_far: &Measurement,
    n: usize,
    mut poses: Vec<Pose>,
) -> Chosen {
    let before = so_far.schedule.poses.iter();
    let before = before.filter_map(|pose| canonical(&*task.form, &pose.pair));
    let mut there: Vec<[DVec3; 2]> = before.map(|pose| pose.pair.vectors()).collect();
    let mut is_new = |pose: &Pose| {
        let [i, o] = pose.pair.vectors();
        let mut known = there.iter();
        let new = !known.any(|[a, b]| a.abs_diff_eq(i, SAME) && b.abs_diff_eq(o, SAME));
        there.extend(new.then_some([i, o]));
        new
    };
    poses.retain(&mut is_new);
    poses.truncate(n);
    if poses.len() < n
        && let Some(field) = field(kind, (task, reach), so_far, n)?
    {
        let others = field.candidates.into_iter();
        poses.extend(others.filter(is_new).take(n - poses.len()));
    }
    Ok(poses)
}
