//! Runs a plan: material after material, schedule after schedule.
//!
//! Jobs run one after the other and the stages are parallel inside, so that a stage's time means
//! something and no byte of the results depends on the number of threads. One material is loaded
//! at a time.

use super::observer::{Failure, Input, Job, Observer, ScheduleKey, Stage, Summary};
use super::plan::{Material, Plan};
use super::row::Row;
use crate::brdf::Brdf;
use crate::error::{Error, ParameterError};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::{Ideal, Instrument};
use crate::metrics::{self, AlbedoProbe, Values};
use crate::moments::{MomentErrors, Profile};
use crate::schedule::Schedule;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Poses that schedules may hold while they wait for the next material (100 bytes each); further
/// ones are planned again.
const CACHED_POSES: usize = 4_000_000;

/// Pairs at which a reconstruction is evaluated between two looks at whether the run shall stop:
/// a fraction of a second of the slowest one. (A multiple of what a thread takes at a time.)
const SLAB: usize = 1 << 14;

/// Runs a plan.
///
/// # Errors
/// Those of the observer. A job that cannot be done is no error but a [`Failure`] of the summary.
pub fn run(plan: &Plan, observer: &mut dyn Observer) -> Result<Summary, Error> {
    let mut runner = Runner::new(plan, observer)?;
    match runner.materials() {
        Ok(()) => {}
        Err(Stop::Cancelled) => runner.summary.interrupted = true,
        Err(Stop::Error(e)) => return Err(e),
    }
    Ok(runner.summary)
}

/// Why a run ends early.
enum Stop {
    Cancelled,
    Error(Error),
}

impl From<Error> for Stop {
    fn from(e: Error) -> Self {
        Stop::Error(e)
    }
}

/// A material and what reconstructions of it are compared with.
struct Truth<'a> {
    material: &'a Material,
    brdf: Box<dyn Brdf>,
    /// One a measure.
    values: Vec<Values>,
    albedo: Values,
    /// Its moments, if they are asked for.
    profile: Option<Profile>,
}

/// Position of a schedule's choices in the plan.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct CacheKey {
    symmetry: Symmetry,
    coordinates: usize,
    sample_set: usize,
    budget: usize,
    seed: u64,
}

struct Runner<'a> {
    plan: &'a Plan,
    observer: &'a mut dyn Observer,
    /// One list a measure.
    pairs: Vec<Vec<DirectionPair>>,
    probe: AlbedoProbe,
    schedules: HashMap<CacheKey, (Arc<Schedule>, f64)>,
    cached_poses: usize,
    summary: Summary,
}

impl<'a> Runner<'a> {
    fn new(plan: &'a Plan, observer: &'a mut dyn Observer) -> Result<Self, Error> {
        let pairs = plan.measures.iter().map(|&measure| {
            metrics::test_pairs(measure, &plan.metrics).map_err(|e| Error::config("metrics", e))
        });
        Ok(Self {
            plan,
            observer,
            pairs: pairs.collect::<Result<_, _>>()?,
            probe: AlbedoProbe::new(),
            schedules: HashMap::new(),
            cached_poses: 0,
            summary: Summary::default(),
        })
    }

    fn materials(&mut self) -> Result<(), Stop> {
        for (i, material) in self.plan.materials.iter().enumerate() {
            self.begin(Stage::Load, &Job::of(material))?;
            match self.load(material) {
                Ok(truth) => self.schedules(&truth, i)?,
                Err(reason) => {
                    self.fail(&Job::of(material), reason, self.plan.jobs_per_material());
                    let per_budget = self.plan.jobs_per_material() / self.plan.budgets.len();
                    for &budget in &self.plan.budgets {
                        self.observer.advanced(per_budget, budget);
                    }
                }
            }
        }
        Ok(())
    }

    fn load(&mut self, material: &'a Material) -> Result<Truth<'a>, String> {
        let (inputs, seconds) = timed(|| hash(&material.spec.inputs()));
        self.summary.seconds.load += seconds;
        let (brdf, seconds) = timed(|| material.spec.build(self.plan.channels));
        self.summary.seconds.load += seconds;
        let (inputs, brdf) = (inputs?, brdf.map_err(|e| e.to_string())?);
        let ((values, albedo), seconds) = timed(|| {
            let at = |pairs: &Vec<DirectionPair>| metrics::evaluate(&*brdf, pairs);
            (
                self.pairs.iter().map(at).collect(),
                self.probe.evaluate(&*brdf),
            )
        });
        self.summary.seconds.truth += seconds;
        let (profile, seconds) = timed(|| self.profile(&*brdf));
        self.summary.seconds.moments += seconds;
        let profile = profile.map_err(|e| e.to_string())?;
        self.observer.loaded(material, &inputs);
        Ok(Truth {
            material,
            brdf,
            values,
            albedo,
            profile,
        })
    }

    fn schedules(&mut self, truth: &Truth<'a>, material: usize) -> Result<(), Stop> {
        let plan = self.plan;
        for (c, coordinates) in plan.parametrizations.iter().enumerate() {
            for (s, sample_set) in plan.sample_sets.iter().enumerate() {
                for &budget in &plan.budgets {
                    let mut rows = Vec::new();
                    let mut ended = Ok(());
                    for &seed in &plan.seeds {
                        let key = ScheduleKey {
                            coordinates,
                            symmetry: truth.material.symmetry,
                            sample_set,
                            budget,
                            seed,
                        };
                        ended = self.measure(truth, material, (c, s), key, &mut rows);
                        if ended.is_err() {
                            break;
                        }
                    }
                    self.hand_over(rows)?;
                    ended?;
                }
            }
        }
        Ok(())
    }

    /// Sorts rows that were made seed by seed into the order of results.
    fn hand_over(&mut self, mut rows: Vec<(usize, Row)>) -> Result<(), Error> {
        rows.sort_by_key(|(reconstruction, _)| *reconstruction);
        self.summary.rows += rows.len();
        self.observer
            .rows(rows.into_iter().map(|(_, row)| row).collect())
    }

    /// One schedule: plan, measure, and every reconstruction.
    fn measure(
        &mut self,
        truth: &Truth<'a>,
        material: usize,
        (coordinates, sample_set): (usize, usize),
        key: ScheduleKey<'a>,
        rows: &mut Vec<(usize, Row)>,
    ) -> Result<(), Stop> {
        let mut job = Job {
            schedule: Some(key),
            ..Job::of(truth.material)
        };
        self.begin(Stage::Plan, &job)?;
        let cache_key = CacheKey {
            symmetry: key.symmetry,
            coordinates,
            sample_set,
            budget: key.budget,
            seed: key.seed,
        };
        let (schedule, plan_seconds) = match self.schedule(cache_key, &key, material)? {
            Ok(planned) => planned,
            Err(reason) => {
                let jobs = self.plan.reconstructions.len();
                self.fail(&job, reason, jobs);
                self.observer.advanced(jobs, key.budget);
                return Ok(());
            }
        };
        self.begin(Stage::Measure, &job)?;
        let (measurement, measure_seconds) = timed(|| Ideal.measure(&*truth.brdf, &schedule));
        self.summary.seconds.measure += measure_seconds;
        for (r, method) in self.plan.reconstructions.iter().enumerate() {
            job.reconstruction = Some(&method.name);
            self.begin(Stage::Reconstruct, &job)?;
            let (result, reconstruct_seconds) = timed(|| method.method.reconstruct(&measurement));
            self.summary.seconds.reconstruct += reconstruct_seconds;
            match result {
                Err(e) => self.fail(&job, e.to_string(), 1),
                Ok(brdf) => {
                    self.begin(Stage::Evaluate, &job)?;
                    self.observer.reconstructed(&job, &*truth.brdf, &*brdf)?;
                    let (albedo, albedo_seconds) = timed(|| {
                        let values = self.evaluate(&*brdf, self.probe.pairs())?;
                        Ok::<_, Stop>(self.probe.error(&truth.albedo, &values))
                    });
                    self.summary.seconds.evaluate += albedo_seconds;
                    let albedo = albedo?;
                    let (moments, moment_seconds) = timed(|| self.moments(truth, &*brdf));
                    self.summary.seconds.moments += moment_seconds;
                    let moments = moments?;
                    let errors_of = moments.map(|(errors, _)| errors).unwrap_or_default();
                    for (m, measure) in self.plan.measures.iter().enumerate() {
                        let (errors, seconds) = timed(|| {
                            let values = self.evaluate(&*brdf, &self.pairs[m])?;
                            let errors =
                                metrics::compare(&self.pairs[m], &truth.values[m], &values);
                            Ok::<_, Stop>(errors)
                        });
                        self.summary.seconds.evaluate += seconds;
                        let errors = errors?;
                        let row = Row {
                            material: truth.material.name.clone(),
                            parametrization: key.coordinates.name().into(),
                            warp: key.coordinates.warp.clone(),
                            sample_set: key.sample_set.name.clone(),
                            reconstruction: method.name.clone(),
                            budget: key.budget,
                            readings: measurement.readings(),
                            seed: key.seed,
                            measure: measure.name().into(),
                            nrmse: errors.nrmse,
                            log_relative: errors.log_relative,
                            log1p: errors.log1p,
                            cbrt: errors.cbrt,
                            mean_relative: errors.mean_relative,
                            max_relative: errors.max_relative,
                            albedo,
                            moment_energy: errors_of.energy,
                            moment_mean_rad: errors_of.mean,
                            moment_mean: errors_of.mean_relative,
                            moment_covariance: errors_of.covariance,
                            moment_skewness: errors_of.skewness,
                            moment_kurtosis: errors_of.kurtosis,
                            moment_unresolved: moments.map(|(_, unresolved)| unresolved),
                            poses: schedule.poses.len(),
                            no_data: measurement.no_data(),
                            unphysical_share: schedule.unphysical_share,
                            pairs: errors.pairs,
                            pairs_missing: errors.pairs_missing,
                            pairs_unreconstructed: errors.pairs_unreconstructed,
                            plan_seconds,
                            measure_seconds,
                            reconstruct_seconds,
                            evaluate_seconds: seconds + albedo_seconds,
                            moment_seconds: moments.map(|_| moment_seconds),
                        };
                        rows.push((r, row));
                    }
                }
            }
            self.observer.advanced(1, key.budget);
        }
        Ok(())
    }

    /// The moments of a BRDF, if they are asked for.
    fn profile(&self, brdf: &dyn Brdf) -> Result<Option<Profile>, ParameterError> {
        let Some(table) = &self.plan.moments else {
            return Ok(None);
        };
        // The plan has one seed or more, and the table one channel.
        let (seed, channel) = (self.plan.seeds[0], table.spec.channels[0]);
        Profile::new(brdf, channel, &table.spec, &*table.estimator, seed).map(Some)
    }

    /// Moment errors of a reconstruction, and how many slices are unresolved.
    fn moments(
        &self,
        truth: &Truth<'_>,
        brdf: &dyn Brdf,
    ) -> Result<Option<(MomentErrors, usize)>, Stop> {
        let Some(of_truth) = &truth.profile else {
            return Ok(None);
        };
        if self.observer.cancelled() {
            return Err(Stop::Cancelled);
        }
        // The truth went the same way before.
        let profile = self
            .profile(brdf)
            .map_err(|e| Error::Internal(e.to_string()))?;
        Ok(profile.map(|profile| {
            let errors = MomentErrors::between(of_truth, &profile);
            (errors, of_truth.unresolved() + profile.unresolved())
        }))
    }

    /// The schedule and the time it took to make, now or for an earlier material; or why there is
    /// none.
    fn schedule(
        &mut self,
        cache_key: CacheKey,
        key: &ScheduleKey<'_>,
        material: usize,
    ) -> Result<Result<(Arc<Schedule>, f64), String>, Error> {
        if let Some(cached) = self.schedules.get(&cache_key) {
            return Ok(Ok(cached.clone()));
        }
        let form = match key.coordinates.form(key.symmetry) {
            Ok(form) => form,
            Err(e) => return Err(Error::Internal(format!("a warp that was checked: {e}"))),
        };
        let (planned, seconds) = timed(|| key.sample_set.set.plan(&form, key.budget, key.seed));
        self.summary.seconds.plan += seconds;
        let schedule = match planned {
            Ok(schedule) => Arc::new(schedule),
            Err(e) => return Ok(Err(e.to_string())),
        };
        self.observer.planned(key, &schedule)?;
        let mut later = self.plan.materials.iter().skip(material + 1);
        let again = later.any(|m| m.symmetry == key.symmetry);
        let total = self.cached_poses + schedule.poses.len();
        if again && total <= CACHED_POSES {
            self.cached_poses = total;
            self.schedules
                .insert(cache_key, (Arc::clone(&schedule), seconds));
        }
        Ok(Ok((schedule, seconds)))
    }

    /// [`metrics::evaluate`], or stops on the way: large sets of pairs take a slow reconstruction
    /// minutes.
    fn evaluate(&self, brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Result<Values, Stop> {
        let mut values = Values::default();
        for slab in pairs.chunks(SLAB) {
            if self.observer.cancelled() {
                return Err(Stop::Cancelled);
            }
            values.append(metrics::evaluate(brdf, slab));
        }
        Ok(values)
    }

    /// Announces a stage, or stops before it.
    fn begin(&mut self, stage: Stage, job: &Job<'_>) -> Result<(), Stop> {
        if self.observer.cancelled() {
            return Err(Stop::Cancelled);
        }
        self.observer.stage(stage, job);
        Ok(())
    }

    fn fail(&mut self, job: &Job<'_>, reason: String, jobs: usize) {
        let failure = Failure {
            job: job.to_string(),
            reason,
            jobs,
        };
        self.observer.failed(&failure);
        self.summary.failures.push(failure);
    }
}

pub(super) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

/// Hashes the files of a material.
pub(super) fn hash(paths: &[PathBuf]) -> Result<Vec<Input>, String> {
    let hash = |path: &PathBuf| -> std::io::Result<Input> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(std::fs::File::open(path)?)?;
        Ok(Input {
            path: path.clone(),
            blake3: hasher.finalize().to_hex().to_string(),
        })
    };
    let with_path = |path: &PathBuf| hash(path).map_err(|e| format!("{}: {e}", path.display()));
    paths.iter().map(with_path).collect()
}
