//! Acquisition: which poses to read next, from what is known of a material.
//!
//! A [`Planner`] chooses poses for a [`Task`], given the measurement so far. Sample sets are planners that answer
//! once. A planner keeps nothing between two answers: the poses and readings so far are all it needs, so that a
//! program that crashes, or a laboratory that goes home, continues where it was.
//!
//! [`Greedy`] is ours. [`Published`], [`Retro`] and [`Slices`] are what others published, to compare with: all take
//! poses that a machine reaches, and ask no more where there was nothing to read.
//!
//! ```
//! use gonio::acquisition::{Aim, Greedy, Planner, Rule, Task, acquire};
//! use gonio::brdf::microfacet::{FresnelSpec, Ggx, Microfacet};
//! use gonio::brdf::{Brdf, Channels, Roughness};
//! use gonio::metrics::{self, Measure, MetricsSpec};
//! use gonio::parametrization::{Form, HalfDifference};
//! use gonio::reconstruct::{Kriging, Reconstruct};
//! use gonio::schedule::{SampleSet, SobolSet};
//! use std::sync::Arc;
//!
//! let (alpha, fresnel) = (Roughness::Isotropic(0.1), FresnelSpec::default());
//! let truth: Microfacet<Ggx> = Microfacet::new(alpha, &fresnel, Channels::Luminance);
//! let form = Arc::new(Form::<HalfDifference>::new(truth.symmetry()));
//! let task = Task { form, budget: 64, seed: 1, machine: None, go_on: &|| true, truth: None };
//! let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default())?;
//! let error = |planner: &dyn Planner| {
//!     let measured = acquire(planner, &task, &truth)?;
//!     let copy = Kriging::default().reconstruct(&measured)?;
//!     let values = [&truth as &dyn Brdf, &*copy].map(|f| metrics::evaluate(f, &pairs));
//!     Ok::<_, Box<dyn std::error::Error>>(metrics::compare(&pairs, &values[0], &values[1]).nrmse.unwrap())
//! };
//! let adaptive = Greedy::new(Rule::Adaptive, Aim::default());
//! assert!(error(&adaptive)? < 0.5 * error(&*gonio::acquisition::once(Box::new(SobolSet {})))?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

/// The schedule of a planner for any machine, as a sample set has it.
macro_rules! plans_by_design {
    () => {
        fn plan(
            &self,
            form: &std::sync::Arc<dyn crate::parametrization::Parametrization>,
            budget: usize,
            seed: u64,
        ) -> crate::schedule::Planned {
            self.design(&Task::plain(form, budget, seed))
        }
    };
}

mod choice;
mod dupuy_jakob;
mod field;
mod greedy;
mod moments;
mod published;
mod rows;
mod vavra_filip;

pub use dupuy_jakob::Retro;
pub use greedy::{Aim, Greedy, Rule, Target};
pub use moments::{MomentAim, MomentForecast};
pub use published::{Criterion, Published};
pub use vavra_filip::Slices;

use crate::brdf::{Brdf, Channels};
use crate::error::ParameterError;
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument, Machine};
use crate::measurement::Measurement;
use crate::metrics::Expected;
use crate::parametrization::{Axis, Parametrization, usual_form};
use crate::reconstruct::{PriorFile, Suspect};
use crate::registry::{self, Entry, Joined, ReadError, Resolved, Table, Taken, forwarded};
use crate::schedule::{self, PlanError, Planned, Pose, SampleSet, Schedule, StopAngle};
use std::sync::Arc;

/// What is to be measured.
#[derive(Clone)]
pub struct Task<'a> {
    /// The coordinates that candidates are uniform in, folded by the symmetries of the material.
    pub form: Arc<dyn Parametrization>,
    /// Poses of the whole acquisition, at most.
    pub budget: usize,
    /// Seed of whatever is random.
    pub seed: u64,
    /// The machine that is to reach every pose; `None`: each can be taken.
    pub machine: Option<&'a Machine>,
    /// Asked before each choice: false ends a batch with the poses so far.
    pub go_on: &'a dyn Fn() -> bool,
    /// The material itself, for an oracle; `None` where it is unknown.
    pub truth: Option<&'a dyn Brdf>,
}

impl Task<'_> {
    /// So many poses, while it goes on.
    fn wanted(&self, n: usize) -> choice::Wanted<'_> {
        choice::Wanted {
            n,
            go_on: self.go_on,
            stops: &[],
        }
    }

    /// The rest of the budget, chosen by a planner after the readings so far; `None`: after none.
    ///
    /// # Errors
    /// As [`Planner::next`].
    pub fn ask(
        &self,
        planner: &dyn Planner,
        so_far: Option<&Measurement>,
    ) -> Result<Batch, PlanError> {
        let nothing = nothing(self);
        let so_far = so_far.unwrap_or(&nothing);
        let asked = so_far.schedule.poses.len();
        let is_enough = planner.is_enough(self, so_far);
        let poses = match is_enough {
            true => Vec::new(),
            false => planner.next(self, so_far, self.budget.saturating_sub(asked))?,
        };
        Ok(Batch {
            forecast: planner.forecast(self, so_far, &poses),
            schedule: scheduled(self, planner, poses),
            is_enough,
            asked,
            readings: so_far.readings(),
        })
    }
}

impl Task<'_> {
    /// The angle that the poses of a stop share, if the machine takes pictures.
    fn stop_angle(&self) -> Option<StopAngle> {
        self.machine?.stop_angle()
    }
}

impl Task<'static> {
    /// So many poses more than a measurement has, of a material with these symmetries, in the usual coordinates.
    pub fn after(
        so_far: Option<&Measurement>,
        poses: usize,
        symmetry: Symmetry,
        seed: u64,
    ) -> Self {
        let before = so_far.map_or(0, |m| m.schedule.poses.len());
        Self::plain(&usual_form(symmetry), before + poses, seed)
    }

    /// Any machine, and all the time there is.
    pub(crate) fn plain(form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Self {
        Self {
            form: Arc::clone(form),
            budget,
            seed,
            machine: None,
            go_on: &|| true,
            truth: None,
        }
    }
}

/// The errors expected before and after a batch, under the cosine measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// With the readings so far.
    pub now: Expected,
    /// With those of the batch too.
    pub then: Expected,
    /// Of a moment that is asked for; `None` also where it is not defined.
    pub moment: Option<MomentForecast>,
    /// Readings so far that all others contradict, and that are left out.
    pub suspects: Vec<Suspect>,
}

/// Chooses the poses of an acquisition. A config names one by `kind`, among the sample sets.
pub trait Planner: SampleSet {
    /// Number of poses to ask for, given that `asked` were asked for before, where poses are chosen one by one
    /// or, `in_pictures`, stop by stop; `None` if all are known before the first reading, as [`design`](Self::design) gives them.
    fn batch(&self, _asked: usize, _budget: usize, _in_pictures: bool) -> Option<usize> {
        None
    }

    /// Poses of a whole acquisition, at most.
    fn most(&self) -> usize {
        usize::MAX
    }

    /// The prior of other materials, where it is in a file.
    fn prior(&self) -> Option<&PriorFile> {
        None
    }

    /// Kind of the reconstruction that the poses are chosen for; `None`: for none of them.
    fn assumes(&self) -> Option<&'static str> {
        None
    }

    /// True if the poses depend on the instrument of a task: on the poses that it reaches.
    fn depends_on_instrument(&self) -> bool {
        true
    }

    /// True if a larger budget goes on where a smaller one breaks off: what is asked for depends on the readings so far
    /// and on the size of a batch, and of the budget only its last batch.
    fn nests(&self) -> bool {
        false
    }

    /// True if the readings so far are enough: no further pose is asked for.
    fn is_enough(&self, _task: &Task<'_>, _so_far: &Measurement) -> bool {
        false
    }

    /// Errors expected with the readings so far, and with those at some poses more; `None` where
    /// nothing was read, and of a planner that does not know.
    fn forecast(
        &self,
        _task: &Task<'_>,
        _so_far: &Measurement,
        _next: &[Pose],
    ) -> Option<Forecast> {
        None
    }

    /// The schedule of a whole budget, before any reading.
    ///
    /// # Errors
    /// As [`SampleSet::plan`].
    fn design(&self, task: &Task<'_>) -> Planned {
        let poses = self.next(task, &nothing(task), task.budget)?;
        Ok(scheduled(task, self, poses))
    }

    /// The next poses, at most `most`, from the most informative on; none if there is nothing left to ask for.
    /// `so_far` has all poses that were asked for, also those without a reading.
    ///
    /// # Errors
    /// As [`SampleSet::plan`].
    fn next(&self, task: &Task<'_>, so_far: &Measurement, most: usize) -> Chosen;
}

/// Poses, or the reason why there are none.
pub type Chosen = Result<Vec<Pose>, PlanError>;

/// The readings of a BRDF by the instrument without flaws, batch after batch; it is the truth of the task.
///
/// # Errors
/// As [`Planner::next`].
pub fn acquire(
    planner: &dyn Planner,
    task: &Task<'_>,
    brdf: &dyn Brdf,
) -> Result<Measurement, PlanError> {
    let first = further(planner, task, &nothing(task))?;
    acquire_from(planner, task, brdf, first.unwrap_or_default(), &mut |_| {})
}

/// [`acquire`] where some poses are known, of the first batch or of several. `planned` is called with the number of all poses, of
/// these and after each further batch.
///
/// # Errors
/// As [`Planner::next`].
pub(crate) fn acquire_from(
    planner: &dyn Planner,
    task: &Task<'_>,
    brdf: &dyn Brdf,
    known: Vec<Pose>,
    planned: &mut dyn FnMut(usize),
) -> Result<Measurement, PlanError> {
    let task = &Task {
        truth: Some(brdf),
        ..task.clone()
    };
    let measure = |poses| {
        let schedule = scheduled(task, planner, poses);
        Ideal.measure(brdf, &Arc::new(schedule))
    };
    planned(known.len());
    let mut so_far = measure(known);
    while let Some(poses) = further(planner, task, &so_far)? {
        planned(poses.len());
        so_far = measure(poses);
    }
    Ok(so_far)
}

/// A measurement without poses, of one channel.
pub fn nothing(task: &Task<'_>) -> Measurement {
    Measurement {
        schedule: Arc::new(Schedule {
            sample_set: String::new(),
            ..Schedule::of_pairs(Arc::clone(&task.form), [])
        }),
        channels: Channels::Luminance,
        values: Vec::new(),
        outcomes: Vec::new(),
        details: None,
        places: Vec::new(),
        half_angles_deg: [0.0; 2],
    }
}

/// The poses of a measurement and those of the next batch; `None` if there is none.
///
/// # Errors
/// As [`Planner::next`].
pub(crate) fn further(
    planner: &dyn Planner,
    task: &Task<'_>,
    so_far: &Measurement,
) -> Result<Option<Vec<Pose>>, PlanError> {
    let mut poses = so_far.schedule.poses.clone();
    let left = task.budget.saturating_sub(poses.len());
    let most = planner
        .batch(poses.len(), task.budget, task.stop_angle().is_some())
        .unwrap_or(left);
    if most.min(left) == 0 || planner.is_enough(task, so_far) {
        return Ok(None);
    }
    let next = planner.next(task, so_far, most.min(left))?;
    poses.extend(&next);
    Ok((!next.is_empty()).then_some(poses))
}

/// The answer of a planner.
pub struct Batch {
    /// The next poses, the most telling first; none if the readings are enough.
    pub schedule: Schedule,
    /// True if the readings so far have reached the target.
    pub is_enough: bool,
    /// Poses that were asked for before.
    pub asked: usize,
    /// Readings so far.
    pub readings: usize,
    /// Errors expected now, and with readings at these poses too; `None` where they are not known.
    pub forecast: Option<Forecast>,
}

/// Poses of a batch after `asked` ones: half as many as these, at first `first`, and no more than are left.
fn halves(first: usize, asked: usize, budget: usize) -> usize {
    let usual = match asked {
        0 => first,
        _ => asked.div_ceil(2),
    };
    usual.min(budget.saturating_sub(asked))
}

/// The schedule of the poses that a planner chose.
pub fn scheduled<P: Planner + ?Sized>(task: &Task<'_>, planner: &P, poses: Vec<Pose>) -> Schedule {
    Schedule {
        assumes: planner.assumes().map(str::to_owned),
        ..Schedule::new(Arc::clone(&task.form), planner.label(), poses, 0.0)
    }
}

/// A sample set, which answers once.
#[derive(Debug)]
struct Once(Box<dyn SampleSet>);

impl Resolved for Once {
    forwarded!(0: resolved -> registry::Keys);
}

impl SampleSet for Once {
    forwarded! {
        0: label -> String, is_grid -> bool, is_random -> bool, is_unguided -> bool,
        tuned(ratio: &[f64]) -> Option<Box<dyn SampleSet>>,
        check(axes: &[Axis]) -> Result<(), ParameterError>,
        plan(form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Planned,
    }
}

impl Planner for Once {
    fn design(&self, task: &Task<'_>) -> Planned {
        self.plan(&task.form, task.budget, task.seed)
    }

    fn next(&self, task: &Task<'_>, so_far: &Measurement, most: usize) -> Chosen {
        let mut poses = self.design(task)?.poses;
        let asked = so_far.schedule.poses.len().min(poses.len());
        poses.drain(..asked);
        poses.truncate(most);
        Ok(poses)
    }

    fn depends_on_instrument(&self) -> bool {
        false
    }
}

/// A sample set as a planner.
pub fn once(set: Box<dyn SampleSet>) -> Box<dyn Planner> {
    Box::new(Once(set))
}

static JOINED: Joined<dyn Planner> = Joined::new();

fn built_in() -> Vec<Entry<dyn Planner>> {
    let greedy = greedy::entries().into_iter();
    let published = published::entries().into_iter();
    let others = [dupuy_jakob::ENTRY, vavra_filip::ENTRY];
    greedy.chain(published).chain(others).collect()
}

/// Every planner a config can name that is no [sample set](schedule::all).
pub fn all() -> Vec<Entry<dyn Planner>> {
    JOINED.after(built_in())
}

/// Adds a planner of a program's own to [`all`].
///
/// # Errors
/// If a planner or sample set of that kind is there.
pub fn join(entry: Entry<dyn Planner>) -> Result<(), Taken> {
    if schedule::all().iter().any(|set| set.kind == entry.kind) {
        return Err(Taken(entry.kind));
    }
    JOINED.add(built_in(), entry)
}

/// Reads a sample set or planner from its config table.
pub fn read(table: Table<'_>) -> Result<Box<dyn Planner>, ReadError> {
    registry::read_of_two("sample set", &schedule::all(), once, &all(), table)
}
