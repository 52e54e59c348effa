//! Reconstructions compared with their truths: errors at test pairs, albedos, moments.

use super::choices::{Material, Method};
use super::counts::{Built, Counters, Spent, Stage, Work, timed};
use super::material_batch::{MaterialBatch, evaluate};
use super::observer::{Event, EventSink, GoOn, Job, ScheduleKey, Stop};
use super::plan::Plan;
use super::readings::Readings;
use super::row::{HOLES, Quantities, Row};
use crate::analysis::{Alignment, alignment};
use crate::brdf::Brdf;
use crate::error::{Error, ParameterError};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::{
    self, AlbedoProbe, Errors, Expected, Level, Tally, TestSet, TruthErrors, Uncovered, Values,
    WITHIN,
};
use crate::moments::{MomentErrors, Profile, VIEW_BANDS};
use crate::reconstruct::{self, Cover, Coverage, ReconstructError, Replicated, Uncertain};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Candidates up to which the values of a truth are kept; beyond they are evaluated again.
const KEPT: usize = 1 << 18;

/// Members of a group whose reconstructions are asked what they expect between two looks for a stop.
const TOGETHER: usize = 8;

/// A material with the values that its reconstructions are compared with.
pub(super) struct Truth {
    pub brdf: Built,
    pub alignment: Option<Alignment>,
    /// What its paths may be off by, one per measure; empty of what has none.
    errors: Vec<TruthErrors>,
    /// Values at the levels of test pairs that were asked for, sr⁻¹, without the cosine.
    levels: Mutex<Vec<Arc<Values>>>,
    /// Values at the pairs of the albedo probe, sr⁻¹, if albedos are compared.
    albedo: Option<Values>,
    profile: Option<Profile>,
}

impl Truth {
    /// Writes what it may be off by under a measure, by number.
    pub(crate) fn write(&self, at: usize, to: &mut Quantities) {
        to.set_all(&TruthErrors::QUANTITIES, self.errors.get(at));
    }
}

/// A material, its truth, its readings.
type Member<'a> = (&'a Material, &'a Truth, &'a Readings);

/// The comparison of one material's reconstruction with its truth.
#[derive(Default)]
pub(super) struct Compared {
    /// Sums over the pairs.
    tally: Tally,
    /// Sums over the pairs of a reconstruction from readings without limits, where that differs.
    whole: Option<Tally>,
    /// True if these are known to be the same.
    nothing_lost: bool,
    /// True if the standard errors are below the tolerance, one per measure.
    pub converged: Vec<bool>,
    /// Shares of the pairs that readings do not surround, one per measure.
    uncovered: Vec<Uncovered>,
    /// Share of the pairs within the uncertainty, one per measure, if it is counted and there is one.
    within: Vec<Option<f64>>,
    /// Errors that the reconstruction expects, one per measure, if they are asked for and it has them.
    expected: Vec<Expected>,
    /// Error of the directional albedo, and what its quadrature may be off by.
    albedo: Option<[f64; 2]>,
    /// Errors of the moments in each band of views, and number of unresolved slices.
    moments: Option<([MomentErrors; VIEW_BANDS.len()], usize)>,
    /// Wall times of reconstruction, of evaluation, and, s, of the moments.
    pub reconstructed: Spent,
    pub evaluated: Spent,
    pub moment_seconds: Option<f64>,
    /// False as long as pairs are added.
    is_done: bool,
}

/// The test pairs and probes that reconstructions are compared at.
pub(super) struct Evaluator<'a> {
    plan: &'a Plan,
    set: TestSet,
    /// Its levels that were asked for.
    levels: Mutex<Vec<Arc<Level>>>,
    probe: Option<AlbedoProbe>,
    counters: Counters,
}

/// Reconstructions of some members of a group.
struct Made {
    /// Their positions in the group, ascending.
    members: Vec<usize>,
    copies: Copies,
    /// Those from readings without limits, where they differ.
    whole: Option<MaterialBatch>,
}

impl<'a> Evaluator<'a> {
    pub(crate) fn new(plan: &'a Plan, counters: &Counters) -> Result<Self, Error> {
        let set = TestSet::new(&plan.measures, &plan.metrics);
        Ok(Self {
            set: set.map_err(|e| Error::config("metrics", e))?,
            levels: Mutex::default(),
            probe: plan.albedo.then(AlbedoProbe::new),
            counters: counters.clone(),
            plan,
        })
    }

    /// Number of pairs at which values of a material are held, at most: those that are kept, or those of the last level.
    pub(crate) fn pairs(&self) -> usize {
        let probe = self.probe.as_ref().map_or(0, |p| p.pairs().len());
        let last = self.plan.metrics.max_pairs / 2;
        probe + self.set.candidates(0).max(KEPT).max(last)
    }

    fn level(&self, n: usize) -> Arc<Level> {
        let mut levels = self.levels.lock().unwrap_or_else(PoisonError::into_inner);
        while levels.len() <= n {
            let next = self.set.level(levels.len());
            let made = next.pairs.len();
            self.counters.add(Stage::Truth, Work::TestPairs, made);
            levels.push(Arc::new(next));
        }
        Arc::clone(&levels[n])
    }

    /// Evaluates a material at the first test pairs and probes; what is wrong with it is no reason to stop.
    pub(crate) fn truth(&self, brdf: Built, events: &EventSink<'_, Row>) -> Result<Truth, Stop> {
        let counters = &self.counters;
        let at = |stage| brdf.counted_at(counters, stage);
        let (profile, _) = counters.timed(Stage::Moments, || self.profile(&at(Stage::Moments)));
        let profile = profile.map_err(Stop::failed)?;
        events.go_on()?;
        let (alignment, _) = counters.timed(Stage::Alignment, || alignment(&at(Stage::Alignment)));
        let (found, _) = counters.timed(Stage::Truth, || {
            let (brdf_at, level) = (&at(Stage::Truth), self.level(0));
            let first = evaluate(brdf_at, &level.pairs, &|| events.go_on())?;
            events.go_on()?;
            let split = brdf_at.as_split();
            let errors = split.map(|split| TruthErrors::per_measure(&level, split, &first));
            events.go_on()?;
            let albedo = self.probe.as_ref().map(|p| p.evaluate(brdf_at));
            Ok::<_, Stop>((first, albedo, errors.unwrap_or_default()))
        });
        let (first, albedo, errors) = found?;
        Ok(Truth {
            alignment,
            errors,
            levels: Mutex::new(vec![Arc::new(first)]),
            albedo,
            profile,
            brdf,
        })
    }

    /// The values of a truth at a level of pairs; a material asks for them in order.
    fn values(&self, truth: &Truth, n: usize) -> Arc<Values> {
        let mut levels = truth.levels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(values) = levels.get(n) {
            return Arc::clone(values);
        }
        let brdf = truth.brdf.counted_at(&self.counters, Stage::Truth);
        let values = Arc::new(metrics::evaluate(&brdf, &self.level(n).pairs));
        if levels.len() == n && self.set.candidates(n) <= KEPT {
            levels.push(Arc::clone(&values));
        }
        values
    }

    /// The coverage of the counted test pairs by the poses that have a reading.
    pub(crate) fn coverage(&self, measured: &Measurement) -> Vec<Coverage> {
        let found = self.counters.timed(Stage::Evaluate, || {
            let all = &self.level(0).pairs;
            let pairs: Vec<_> = Uncovered::counted(all.len()).map(|i| all[i]).collect();
            match Cover::of(measured) {
                Ok(cover) => cover.coverages(&pairs),
                // Without any reading.
                Err(_) => vec![Coverage::Unknown; pairs.len()],
            }
        });
        found.0
    }

    /// Reconstructs a group, whose readings have this coverage, and compares each with its truth, at as many pairs as it needs.
    pub(crate) fn compared(
        &self,
        schedule: &ScheduleKey<'_>,
        members: &[Member<'_>],
        coverage: &[Coverage],
        method: &Method,
        events: &mut EventSink<'_, Row>,
    ) -> Result<Vec<Compared>, Stop> {
        let mut comparison = Comparison {
            judge: self,
            schedule,
            members,
            method,
            compared: Vec::new(),
        };
        let all: Vec<usize> = (0..members.len()).collect();
        let (made, reconstructed) = self.counters.repeated(Stage::Reconstruct, |counters| {
            reconstruct::forget_searches();
            comparison.reconstructed(all.clone(), counters)
        });
        let mut made = made.map_err(Stop::failed)?;
        let share = 1.0 / members.len() as f64;
        let new = |member: &Member<'_>| Compared {
            tally: self.set.tally(),
            whole: made.whole.as_ref().map(|_| self.set.tally()),
            nothing_lost: member.2.nothing_lost,
            reconstructed: reconstructed.times(share),
            ..Compared::default()
        };
        comparison.compared = members.iter().map(new).collect();
        if let Copies::One(copy) = &made.copies {
            comparison.examine(&**copy, events)?;
        }
        let go_on = || events.go_on();
        let (first, _) = self.counters.timed(Stage::Evaluate, || {
            let (albedos, seconds) = timed(|| comparison.albedos(&made.copies, &go_on));
            albedos?;
            comparison.cover(coverage);
            comparison.within(&go_on)?;
            comparison.expected(&go_on)?;
            Ok::<_, Stop>(if self.probe.is_some() { seconds } else { 0.0 })
        });
        let of_albedo = first?;
        for n in 0.. {
            let is_open = |i: &usize| !comparison.compared[*i].is_done;
            let open: Vec<usize> = (0..members.len()).filter(is_open).collect();
            if open.is_empty() {
                break;
            }
            let (seen, _) = self.counters.timed(Stage::Evaluate, || {
                // The neighbours of a pair are found once for all: few are worth another reconstruction.
                if 2 * open.len() <= made.members.len()
                    && let Ok(fewer) = comparison.reconstructed(open.clone(), &self.counters)
                {
                    made = fewer;
                }
                comparison.see(n, &made, &go_on)
            });
            let seen = seen?;
            // The probes of the albedo are evaluated as the first pairs are, and their time varies as much.
            let more = match n == 0 && seen.seconds > 0.0 {
                true => of_albedo / seen.seconds,
                false => 0.0,
            };
            let spent = seen.times((1.0 + more) / open.len() as f64);
            let waiting = comparison.compared.par_iter_mut().filter(|c| !c.is_done);
            waiting.for_each(|compared| {
                compared.evaluated = compared.evaluated + spent;
                compared.is_done = self.set.is_enough(&compared.tally) || self.set.is_last(n);
                if compared.is_done {
                    let measures = 0..self.set.measures.len();
                    let converged = measures.map(|at| self.set.has_converged(&compared.tally, at));
                    compared.converged = converged.collect();
                }
            });
        }
        Ok(comparison.compared)
    }

    /// Counts work of evaluating reconstructions.
    fn count(&self, work: Work, number: usize) {
        self.counters.add(Stage::Evaluate, work, number);
    }

    /// The moment profile of a BRDF; `None` if moments are not compared.
    fn profile(&self, brdf: &dyn Brdf) -> Result<Option<Profile>, ParameterError> {
        let Some(table) = &self.plan.moments else {
            return Ok(None);
        };
        // The plan has one seed or more, and the table one channel.
        let (seed, channel) = (self.plan.seeds[0], table.spec.channels[0]);
        Profile::new(brdf, channel, &table.spec, &*table.estimator, seed).map(Some)
    }
}

/// The comparison of a group with its truths.
struct Comparison<'c> {
    judge: &'c Evaluator<'c>,
    schedule: &'c ScheduleKey<'c>,
    members: &'c [Member<'c>],
    method: &'c Method,
    compared: Vec<Compared>,
}

impl Comparison<'_> {
    fn reconstructed(
        &self,
        which: Vec<usize>,
        counters: &Counters,
    ) -> Result<Made, ReconstructError> {
        let (judge, method) = (self.judge, &*self.method.method);
        let some = || which.iter().map(|&i| &self.members[i]);
        let all: Vec<&Measurement> = some().map(|m| &m.2.measured).collect();
        let copies = match (judge.plan.needs_brdfs(), all.as_slice()) {
            (true, [only]) => Copies::One(method.reconstruct(only)?),
            (_, all) => Copies::MaterialBatch(MaterialBatch::new(method, all)?),
        };
        let wholes: Option<Vec<&Measurement>> = some().map(|m| m.2.whole.as_ref()).collect();
        // Its reconstruction works if that of fewer readings did.
        let whole = wholes.and_then(|all| MaterialBatch::new(method, &all).ok());
        let made = copies.interpolants() + whole.as_ref().map_or(0, MaterialBatch::interpolants);
        counters.add(Stage::Reconstruct, Work::Reconstructions, made);
        Ok(Made {
            whole,
            copies,
            members: which,
        })
    }

    /// Adds the pairs of a level to the comparisons that are not done; returns the wall time of evaluating them.
    fn see(&mut self, n: usize, made: &Made, go_on: GoOn<'_>) -> Result<Spent, Stop> {
        let (judge, members) = (self.judge, self.members);
        let level = judge.level(n);
        let place = |i: usize| made.members.binary_search(&i).ok();
        let truth = |(i, compared): (usize, &Compared)| {
            (!compared.is_done).then(|| judge.values(members[i].1, n))
        };
        let truths: Vec<Option<Arc<Values>>> =
            self.compared.iter().enumerate().map(truth).collect();
        let mut parts = Vec::new();
        for range in level.slices() {
            let pairs = &level.pairs[range.clone()];
            let (values, seconds) = timed(|| made.copies.evaluate(pairs, go_on));
            let values = values?;
            parts.push((pairs.len(), seconds));
            let evaluate = |stack: &MaterialBatch| stack.evaluate(pairs, go_on);
            let whole = made.whole.as_ref().map(evaluate).transpose()?;
            let lists = values.len() + whole.as_ref().map_or(0, Vec::len);
            judge.count(Work::Evaluated, lists * pairs.len());
            let all = self.compared.par_iter_mut().enumerate();
            all.for_each(|(i, compared)| {
                let (Some(truth), Some(at)) = (&truths[i], place(i)) else {
                    return;
                };
                let add = |tally: &mut Tally, values: &Values| {
                    let to = tally.replicates_mut().par_iter_mut().enumerate();
                    to.for_each(|(r, to)| {
                        let values = (values, range.start);
                        level.add_replicate(r, to, range.clone(), truth, values);
                    });
                };
                add(&mut compared.tally, &values[at]);
                if let (Some(tally), Some(whole)) = (&mut compared.whole, &whole) {
                    add(tally, &whole[at]);
                }
            });
        }
        Ok(Spent::of_parts(&parts))
    }

    /// Shows the reconstruction of the only member, and compares its moments.
    fn examine(&mut self, copy: &dyn Brdf, events: &mut EventSink<'_, Row>) -> Result<(), Stop> {
        let (judge, only) = (self.judge, &self.members[0]);
        if judge.plan.output.slices {
            let job = Job {
                material: only.0,
                schedule: *self.schedule,
                method: self.method,
            };
            let truth = only.1.brdf.counted_at(&judge.counters, Stage::Pictures);
            let copy = judge.counters.reconstruction(copy, Stage::Pictures);
            let event = Event::Reconstructed(&job, &truth, &copy);
            events.observer.observe(&event)?;
        }
        if let (Some(of_truth), Some(table)) = (&only.1.profile, &judge.plan.moments) {
            events.go_on()?;
            let copy = judge.counters.reconstruction(copy, Stage::Moments);
            let (seed, estimator) = (judge.plan.seeds[0], &*table.estimator);
            let (profile, seconds) = judge.counters.timed(Stage::Moments, || {
                Profile::against(of_truth, &copy, &table.spec, estimator, seed)
            });
            // The truth went the same way before.
            let profile = profile.map_err(Error::internal)?;
            let errors = MomentErrors::between(of_truth, &profile);
            let unresolved = of_truth.unresolved() + profile.unresolved();
            self.compared[0].moments = Some((errors, unresolved));
            self.compared[0].moment_seconds = Some(seconds);
        }
        Ok(())
    }

    fn albedos(&mut self, copies: &Copies, go_on: GoOn<'_>) -> Result<(), Stop> {
        let Some(probe) = &self.judge.probe else {
            return Ok(());
        };
        let values = copies.evaluate(probe.pairs(), go_on)?;
        let evaluated = values.len() * probe.pairs().len();
        self.judge.count(Work::Evaluated, evaluated);
        for ((member, values), compared) in self.members.iter().zip(&values).zip(&mut self.compared)
        {
            let truth = member.1.albedo.as_ref();
            compared.albedo = truth.and_then(|truth| probe.error_and_quadrature(truth, values));
        }
        Ok(())
    }

    fn cover(&mut self, coverage: &[Coverage]) {
        let level = self.judge.level(0);
        for (member, compared) in self.members.iter().zip(&mut self.compared) {
            let truth = self.judge.values(member.1, 0);
            let weights = level.weights.iter();
            let shares = weights.map(|weights| Uncovered::among(coverage, weights, &truth));
            compared.uncovered = shares.collect();
        }
    }

    /// Shares of the first pairs where a reconstruction is within its uncertainty, if they are asked for.
    fn within(&mut self, go_on: GoOn<'_>) -> Result<(), Stop> {
        let judge = self.judge;
        if !judge.plan.uncertainty {
            return Ok(());
        }
        let level = judge.level(0);
        for (member, compared) in self.members.iter().zip(&mut self.compared) {
            go_on()?;
            // Its reconstruction works if that of the readings alone did.
            let of = Replicated::of(&member.2.measured, &*self.method.method);
            let Some(replicated) = of.ok().flatten() else {
                continue;
            };
            let at = replicated.luminance_at(&level.pairs);
            judge.count(Work::Reconstructions, 1);
            judge.count(Work::Evaluated, at.len());
            let values = Values::from(at.iter().map(|at| at.value).collect::<Vec<_>>());
            let uncertainty: Vec<f64> = at.iter().map(Uncertain::uncertainty).collect();
            let truth = judge.values(member.1, 0);
            let share = |weights: &Vec<f64>| {
                metrics::share_within(|i| weights[i], &truth, &values, &uncertainty)
            };
            compared.within = level.weights.iter().map(share).collect();
        }
        Ok(())
    }

    /// The errors that reconstructions expect at some of the first pairs, if they are asked for.
    fn expected(&mut self, go_on: GoOn<'_>) -> Result<(), Stop> {
        let (judge, method) = (self.judge, &self.method.method);
        if !judge.plan.expected {
            return Ok(());
        }
        let level = judge.level(0);
        let all = self.compared.chunks_mut(TOGETHER);
        for (members, compared) in self.members.chunks(TOGETHER).zip(all) {
            go_on()?;
            let both = members.par_iter().zip(compared);
            both.for_each(|(member, compared)| {
                // As above.
                let predictive = method.predictive(&member.2.measured).ok().flatten();
                let expected =
                    predictive.map(|predictive| Expected::per_measure(&level, &*predictive));
                judge.count(Work::Reconstructions, usize::from(expected.is_some()));
                compared.expected = expected.unwrap_or_default();
            });
        }
        Ok(())
    }
}

/// Reconstructions of a group.
enum Copies {
    MaterialBatch(MaterialBatch),
    One(Box<dyn Brdf>),
}

impl Copies {
    fn interpolants(&self) -> usize {
        match self {
            Copies::MaterialBatch(stack) => stack.interpolants(),
            Copies::One(_) => 1,
        }
    }

    fn evaluate(&self, pairs: &[DirectionPair], go_on: GoOn<'_>) -> Result<Vec<Values>, Stop> {
        match self {
            Copies::MaterialBatch(stack) => stack.evaluate(pairs, go_on),
            Copies::One(brdf) => Ok(vec![evaluate(&**brdf, pairs, go_on)?]),
        }
    }
}

impl Compared {
    /// Writes the numbers under a measure, by number, and returns its errors.
    pub(crate) fn write(&self, at: usize, to: &mut Quantities) -> Errors {
        let errors = self.tally.errors(at);
        let whole = match &self.whole {
            Some(whole) => Some(whole.errors(at)),
            None => self.nothing_lost.then_some(errors),
        };
        to.set_all(&Errors::QUANTITIES, Some(&errors));
        for (hole, of) in &HOLES {
            let both = of(&errors).zip(whole.as_ref().and_then(of));
            to.set(hole.name, both.map(|(e, w)| e - w));
        }
        let standard = self.tally.standard_errors(at);
        to.set_all(&Errors::STANDARD_ERRORS, Some(&standard));
        to.set_all(&Uncovered::QUANTITIES, Some(&self.uncovered[at]));
        to.set(WITHIN.name, self.within.get(at).copied().flatten());
        to.set_all(&Expected::QUANTITIES, self.expected.get(at));
        let [error, quadrature] = self.albedo.map_or([None; 2], |both| both.map(Some));
        to.set(AlbedoProbe::QUANTITY.name, error);
        to.set(AlbedoProbe::QUADRATURE.name, quadrature);
        for (band, quantities) in MomentErrors::QUANTITIES.iter().enumerate() {
            to.set_all(
                quantities,
                self.moments.as_ref().map(|(errors, _)| &errors[band]),
            );
        }
        let unresolved = self.moments.as_ref().map(|(_, n)| *n as f64);
        to.set(MomentErrors::UNRESOLVED.name, unresolved);
        errors
    }
}
