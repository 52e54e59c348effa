//! Runs a plan: material after material, schedule after schedule.
//!
//! Jobs run one after the other and the stages are parallel inside, so that a stage's time means
//! something and no byte of the results depends on the number of threads. One material is loaded
//! at a time.

use super::instruments::PlannedInstrument;
use super::observer::{Failure, Input, Job, Observer, ScheduleKey, Stage, Summary};
use super::plan::{Material, Plan};
use super::readings::Readings;
use super::route::{Place, Router};
use super::row::{Comparison, Row, Times};
use crate::brdf::Brdf;
use crate::error::{Error, ParameterError};
use crate::geometry::DirectionPair;
use crate::metrics::{self, AlbedoProbe, Errors, Values};
use crate::moments::{MomentErrors, Profile};
use std::path::PathBuf;
use std::time::Instant;

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
pub(super) enum Stop {
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
    /// Its number in the plan.
    number: usize,
    material: &'a Material,
    brdf: Box<dyn Brdf>,
    /// One a measure.
    values: Vec<Values>,
    albedo: Values,
    /// Its moments, if they are asked for.
    profile: Option<Profile>,
}

struct Runner<'a> {
    plan: &'a Plan,
    observer: &'a mut dyn Observer,
    /// One list a measure.
    pairs: Vec<Vec<DirectionPair>>,
    probe: AlbedoProbe,
    router: Router,
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
            router: Router::default(),
            summary: Summary::default(),
        })
    }

    fn materials(&mut self) -> Result<(), Stop> {
        for (i, material) in self.plan.materials.iter().enumerate() {
            self.begin(Stage::Load, &Job::of(material))?;
            match self.load(i, material) {
                Ok(truth) => self.schedules(&truth)?,
                Err(reason) => {
                    self.fail(&Job::of(material), reason, self.plan.jobs_per_material());
                    let allowances = self.plan.allowances();
                    let each = self.plan.jobs_per_material() / allowances.len();
                    for allowance in allowances {
                        self.observer.advanced(each, allowance);
                    }
                }
            }
        }
        Ok(())
    }

    fn load(&mut self, number: usize, material: &'a Material) -> Result<Truth<'a>, String> {
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
            number,
            material,
            brdf,
            values,
            albedo,
            profile,
        })
    }

    fn schedules(&mut self, truth: &Truth<'a>) -> Result<(), Stop> {
        let plan = self.plan;
        let instruments: Vec<Option<&PlannedInstrument>> = match plan.instruments.as_slice() {
            [] => vec![None],
            list => list.iter().map(Some).collect(),
        };
        for (c, coordinates) in plan.parametrizations.iter().enumerate() {
            for (s, sample_set) in plan.sample_sets.iter().enumerate() {
                for (i, &instrument) in instruments.iter().enumerate() {
                    for allowance in plan.allowances() {
                        let mut rows = Vec::new();
                        let mut ended = Ok(());
                        for &seed in &plan.seeds {
                            let key = ScheduleKey {
                                coordinates,
                                symmetry: truth.material.symmetry,
                                sample_set,
                                allowance,
                                budget: 0,
                                instrument,
                                seed,
                            };
                            let place = Place {
                                symmetry: key.symmetry,
                                coordinates: c,
                                sample_set: s,
                                instrument: i,
                            };
                            ended = self.measure(truth, (key, place), &mut rows);
                            if ended.is_err() {
                                break;
                            }
                        }
                        self.hand_over(rows)?;
                        ended?;
                    }
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
        (mut key, place): (ScheduleKey<'a>, Place),
        rows: &mut Vec<(usize, Row)>,
    ) -> Result<(), Stop> {
        let mut job = Job {
            schedule: Some(key),
            ..Job::of(truth.material)
        };
        self.begin(Stage::Plan, &job)?;
        let symmetry = key.symmetry;
        let mut later = self.plan.materials.iter().skip(truth.number + 1);
        // Several instruments share a schedule as several materials do.
        let again = self.plan.instruments.len() > 1 || later.any(|m| m.symmetry == symmetry);
        let observer = &*self.observer;
        let found = self
            .router
            .route(&mut key, place, again, &|| observer.cancelled())?;
        self.summary.seconds.plan = self.router.seconds();
        let route = match found {
            Ok(route) => route,
            Err(reason) => {
                let jobs = self.plan.reconstructions.len();
                self.fail(&job, reason, jobs);
                self.observer.advanced(jobs, key.allowance);
                return Ok(());
            }
        };
        if route.is_new {
            let itinerary = route.itinerary.as_deref();
            self.observer.planned(&key, &route.schedule, itinerary)?;
        }
        job.schedule = Some(key);
        self.begin(Stage::Measure, &job)?;
        let observer = &*self.observer;
        let cancelled = || observer.cancelled();
        let (readings, measure_seconds) =
            timed(|| Readings::take(&*truth.brdf, &key, &route, &cancelled));
        let readings = readings?;
        self.summary.seconds.measure += measure_seconds;
        let shared = Times {
            plan: route.seconds,
            measure: measure_seconds,
        };
        for r in 0..self.plan.reconstructions.len() {
            let made = self.reconstruct(truth, &mut job, r, &readings)?;
            for (measure, comparison) in self.plan.measures.iter().zip(made) {
                let name = &self.plan.reconstructions[r].name;
                let material = &truth.material.name;
                let facts = &readings.facts;
                let row = Row::new(
                    material,
                    &key,
                    name,
                    measure.name(),
                    facts,
                    comparison,
                    shared,
                );
                rows.push((r, row));
            }
            self.observer.advanced(1, key.allowance);
        }
        Ok(())
    }

    /// Reconstructs a measurement and compares it with the truth: one comparison a measure; none if
    /// it fails.
    fn reconstruct(
        &mut self,
        truth: &Truth<'a>,
        job: &mut Job<'a>,
        r: usize,
        readings: &Readings,
    ) -> Result<Vec<Comparison>, Stop> {
        let plan = self.plan;
        let method = &plan.reconstructions[r];
        job.reconstruction = Some(&method.name);
        self.begin(Stage::Reconstruct, job)?;
        let (result, reconstruct_seconds) = timed(|| method.method.reconstruct(&readings.measured));
        self.summary.seconds.reconstruct += reconstruct_seconds;
        let brdf = match result {
            Ok(brdf) => brdf,
            Err(e) => {
                self.fail(job, e.to_string(), 1);
                return Ok(Vec::new());
            }
        };
        self.begin(Stage::Evaluate, job)?;
        self.observer.reconstructed(job, &*truth.brdf, &*brdf)?;
        let (albedo, albedo_seconds) = timed(|| {
            let values = self.evaluate(&*brdf, self.probe.pairs())?;
            Ok::<_, Stop>(self.probe.error(&truth.albedo, &values))
        });
        self.summary.seconds.evaluate += albedo_seconds;
        let albedo = albedo?;
        let (moments, moment_seconds) = timed(|| self.moments(truth, &*brdf));
        self.summary.seconds.moments += moment_seconds;
        let moments = moments?;
        let whole = match &readings.whole {
            // Its reconstruction works if that of fewer readings did.
            Some(whole) => method.method.reconstruct(whole).ok(),
            None => None,
        };
        let mut made = Vec::with_capacity(plan.measures.len());
        for m in 0..plan.measures.len() {
            let (errors, seconds) = timed(|| self.errors(truth, &*brdf, m));
            self.summary.seconds.evaluate += seconds;
            let errors = errors?;
            let whole = match &whole {
                Some(whole) => Some(self.errors(truth, &**whole, m)?),
                None => readings.nothing_lost.then_some(errors),
            };
            made.push(Comparison {
                errors,
                whole,
                albedo,
                moments,
                reconstruct_seconds,
                evaluate_seconds: seconds + albedo_seconds,
                moment_seconds: moments.map(|_| moment_seconds),
            });
        }
        Ok(made)
    }

    /// Errors of a reconstruction under one measure.
    fn errors(&self, truth: &Truth<'_>, brdf: &dyn Brdf, measure: usize) -> Result<Errors, Stop> {
        let values = self.evaluate(brdf, &self.pairs[measure])?;
        Ok(metrics::compare(
            &self.pairs[measure],
            &truth.values[measure],
            &values,
        ))
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
