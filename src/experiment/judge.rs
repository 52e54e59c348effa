//! Reconstructions compared with their truths: errors at test pairs, albedos, moments.

use super::choices::{Material, Method};
use super::observer::{Event, Job, ScheduleKey, Seconds, Stop, Teller, timed};
use super::plan::Plan;
use super::readings::Readings;
use super::row::{HOLES, Quantities, Row};
use super::stack::{Stack, evaluate};
use crate::analysis::alignment;
use crate::brdf::Brdf;
use crate::error::{Error, ParameterError};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::{self, AlbedoProbe, Errors, Uncovered, Values, WITHIN};
use crate::moments::{MomentErrors, Profile};
use crate::reconstruct::{Cover, Coverage, ReconstructError, Replicated, Uncertain};
use rayon::prelude::*;

/// A material with the values that its reconstructions are compared with.
pub(super) struct Truth {
    pub brdf: Box<dyn Brdf>,
    pub alignment: Option<f64>,
    /// Values at the test pairs, sr⁻¹, without the cosine: one list per measure.
    values: Vec<Values>,
    /// Values at the pairs of the albedo probe, sr⁻¹, if albedos are compared.
    albedo: Option<Values>,
    /// Moment profile, if moments are compared.
    profile: Option<Profile>,
}

/// Errors of one method's reconstructions of a group of materials.
pub(super) struct Compared {
    /// Errors, `[measure][material]`.
    pub errors: Vec<Vec<Errors>>,
    /// Errors of reconstructions from readings without limits, `[measure][material]`, where known.
    whole: Vec<Vec<Option<Errors>>>,
    /// Shares of the pairs that readings do not surround, `[measure][material]`.
    uncovered: Vec<Vec<Uncovered>>,
    /// Share of the pairs within the uncertainty, `[measure][material]`, if it is counted and there is one.
    within: Vec<Vec<Option<f64>>>,
    /// Error of the directional albedo, one per material.
    albedo: Vec<Option<f64>>,
    /// Errors of the moments and number of unresolved slices, one per material.
    moments: Vec<Option<(MomentErrors, usize)>>,
    pub reconstruct_seconds: f64,
    /// Wall time of evaluation and comparison, s, one per measure.
    pub evaluate_seconds: Vec<f64>,
    pub moment_seconds: Option<f64>,
}

/// The test pairs and probes that reconstructions are compared at.
pub(super) struct Judge<'a> {
    plan: &'a Plan,
    /// Test pairs, one list per measure.
    pairs: Vec<Vec<DirectionPair>>,
    /// Albedo probe, if albedos are compared.
    probe: Option<AlbedoProbe>,
}

impl<'a> Judge<'a> {
    pub fn new(plan: &'a Plan) -> Result<Self, Error> {
        let pairs = plan.measures.iter().map(|&measure| {
            metrics::test_pairs(measure, &plan.metrics).map_err(|e| Error::config("metrics", e))
        });
        Ok(Self {
            pairs: pairs.collect::<Result<_, _>>()?,
            probe: plan.albedo.then(AlbedoProbe::new),
            plan,
        })
    }

    /// Number of pairs at which every material and reconstruction is evaluated.
    pub fn pairs(&self) -> usize {
        let probe = self.probe.as_ref().map_or(0, |p| p.pairs().len());
        probe + self.pairs.iter().map(Vec::len).sum::<usize>()
    }

    /// Evaluates a material at the test pairs and probes.
    pub fn truth(
        &self,
        brdf: Box<dyn Brdf>,
        seconds: &mut Seconds,
    ) -> Result<Truth, ParameterError> {
        let (profile, took) = timed(|| self.profile(&*brdf));
        seconds.moments += took;
        let profile = profile?;
        let (truth, took) = timed(|| {
            let at = |pairs: &Vec<DirectionPair>| metrics::evaluate(&*brdf, pairs);
            Truth {
                alignment: alignment(&*brdf).map(|a| a.q),
                values: self.pairs.iter().map(at).collect(),
                albedo: self.probe.as_ref().map(|p| p.evaluate(&*brdf)),
                profile,
                brdf,
            }
        });
        seconds.truth += took;
        Ok(truth)
    }

    /// The coverage of the counted test pairs by the poses that have a reading, one list per measure.
    pub fn coverage(&self, measured: &Measurement, seconds: &mut Seconds) -> Vec<Vec<Coverage>> {
        let (found, took) = timed(|| {
            let cover = Cover::of(measured).ok();
            let at = |pairs: &[DirectionPair]| match &cover {
                Some(cover) => cover.coverages(pairs),
                // Without any reading.
                None => vec![Coverage::Unknown; pairs.len()],
            };
            let pairs = self.pairs.iter().map(|p| Uncovered::counted(p));
            pairs.map(at).collect()
        });
        seconds.evaluate += took;
        found
    }

    /// Reconstructs a group, whose readings have this coverage, and compares it with its truths; or the reason why there is none.
    pub fn compared(
        &self,
        schedule: &ScheduleKey<'_>,
        members: &[(&Material, &Truth, &Readings)],
        coverage: &[Vec<Coverage>],
        method: &Method,
        teller: &mut Teller<'_, Row>,
    ) -> Result<Result<Compared, ReconstructError>, Stop> {
        let all: Vec<&Measurement> = members.iter().map(|m| &m.2.measured).collect();
        let alone = self.plan.needs_brdfs();
        let (made, reconstruct_seconds) = timed(|| match (alone, members) {
            (true, [only]) => method.method.reconstruct(&only.2.measured).map(Copies::One),
            _ => Stack::new(&*method.method, &all).map(Copies::Stack),
        });
        teller.summary.seconds.reconstruct += reconstruct_seconds;
        let copies = match made {
            Ok(copies) => copies,
            Err(e) => return Ok(Err(e)),
        };
        let mut moments = vec![None; members.len()];
        let mut moment_seconds = None;
        if let (Copies::One(copy), [only]) = (&copies, members) {
            if self.plan.output.slices {
                let job = Job {
                    schedule: Some(*schedule),
                    method: Some(method),
                    ..Job::of(only.0)
                };
                let event = Event::Reconstructed(&job, &*only.1.brdf, &**copy);
                teller.observer.tell(&event)?;
            }
            if let Some(of_truth) = &only.1.profile {
                teller.go_on()?;
                let (profile, seconds) = timed(|| self.profile(&**copy));
                // The truth went the same way before.
                let profile = profile.map_err(|e| Error::Internal(e.to_string()))?;
                moments[0] = profile.map(|profile| {
                    let errors = MomentErrors::between(of_truth, &profile);
                    (errors, of_truth.unresolved() + profile.unresolved())
                });
                teller.summary.seconds.moments += seconds;
                moment_seconds = Some(seconds);
            }
        }
        let go_on = || teller.go_on();
        let mut evaluate_seconds = Vec::new();
        let (albedo, albedo_seconds) = timed(|| match &self.probe {
            None => Ok(vec![None; members.len()]),
            Some(probe) => {
                let values = copies.evaluate(probe.pairs(), &go_on)?;
                let of = |(m, values): (&(&Material, &Truth, &Readings), &Values)| {
                    let truth = m.1.albedo.as_ref()?;
                    probe.error(truth, values)
                };
                Ok::<_, Stop>(members.iter().zip(&values).map(of).collect())
            }
        });
        let albedo = albedo?;
        let wholes: Option<Vec<&Measurement>> =
            members.iter().map(|m| m.2.whole.as_ref()).collect();
        // Its reconstruction works if that of fewer readings did.
        let whole = wholes.and_then(|all| Stack::new(&*method.method, &all).ok());
        // As above.
        let replicated = |measurement: &&Measurement| {
            let of = |_| Replicated::of(measurement, &*method.method).ok().flatten();
            self.plan.uncertainty.then_some(()).and_then(of)
        };
        let (replicated, mut uncertainty_seconds) =
            timed(|| all.iter().map(replicated).collect::<Vec<_>>());
        let (mut errors, mut whole_errors, mut uncovered) = (Vec::new(), Vec::new(), Vec::new());
        let mut within = Vec::new();
        for (at, pairs) in self.pairs.iter().enumerate() {
            let truths: Vec<&Values> = members.iter().map(|m| &m.1.values[at]).collect();
            let compare = |values: Vec<Values>| -> Vec<Errors> {
                let both = truths.par_iter().zip(&values);
                both.map(|(f, g)| metrics::compare(pairs, f, g)).collect()
            };
            let (found, seconds) = timed(|| copies.evaluate(pairs, &go_on).map(compare));
            let found = found?;
            evaluate_seconds.push(seconds + albedo_seconds);
            whole_errors.push(match &whole {
                Some(whole) => {
                    let found = compare(whole.evaluate(pairs, &go_on)?);
                    found.into_iter().map(Some).collect()
                }
                None => {
                    let lost = |(m, e): (&(&Material, &Truth, &Readings), &Errors)| {
                        m.2.nothing_lost.then_some(*e)
                    };
                    members.iter().zip(&found).map(lost).collect()
                }
            });
            errors.push(found);
            let shares = truths.iter().map(|f| Uncovered::among(&coverage[at], f));
            uncovered.push(shares.collect());
            let (shares, seconds) = timed(|| self.within(pairs, &truths, &replicated, &go_on));
            within.push(shares?);
            uncertainty_seconds += seconds;
        }
        let evaluated = evaluate_seconds.iter().sum::<f64>();
        // The albedo is in each of them, and was evaluated once.
        let again = (evaluate_seconds.len() - 1) as f64 * albedo_seconds;
        teller.summary.seconds.evaluate += evaluated - again + uncertainty_seconds;
        Ok(Ok(Compared {
            errors,
            whole: whole_errors,
            uncovered,
            within,
            albedo,
            moments,
            reconstruct_seconds,
            evaluate_seconds,
            moment_seconds,
        }))
    }

    /// Shares of the pairs where a reconstruction is as near as its uncertainty says, one per material.
    fn within(
        &self,
        pairs: &[DirectionPair],
        truths: &[&Values],
        replicated: &[Option<Replicated>],
        go_on: &dyn Fn() -> Result<(), Stop>,
    ) -> Result<Vec<Option<f64>>, Stop> {
        let of = |(truth, replicated): (&&Values, &Option<Replicated>)| {
            let Some(replicated) = replicated else {
                return Ok(None);
            };
            go_on()?;
            let at = replicated.at(pairs);
            let values = Values {
                luminance: at.iter().map(|at| at.value).collect(),
                missing: Vec::new(),
            };
            let uncertainty: Vec<f64> = at.iter().map(Uncertain::uncertainty).collect();
            Ok(metrics::share_within(|_| 1.0, truth, &values, &uncertainty))
        };
        truths.iter().zip(replicated).map(of).collect()
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

/// Reconstructions of a group.
enum Copies {
    /// Reconstructions of all its materials at once.
    Stack(Stack),
    /// Reconstruction of its only material.
    One(Box<dyn Brdf>),
}

impl Copies {
    fn evaluate(
        &self,
        pairs: &[DirectionPair],
        go_on: &dyn Fn() -> Result<(), Stop>,
    ) -> Result<Vec<Values>, Stop> {
        match self {
            Copies::Stack(stack) => stack.evaluate(pairs, go_on),
            Copies::One(brdf) => Ok(vec![evaluate(&**brdf, pairs, go_on)?]),
        }
    }
}

impl Compared {
    /// Writes the numbers of a material under a measure.
    pub fn write(&self, at: usize, i: usize, to: &mut Quantities) {
        let errors = &self.errors[at][i];
        let whole = self.whole[at][i].as_ref();
        let moments = self.moments[i].as_ref();
        for (quantity, of) in Errors::QUANTITIES {
            to.set(quantity.name, of(errors));
            let hole = HOLES.iter().find(|(_, less)| *less == quantity.name);
            if let (Some((hole, _)), Some(whole)) = (hole, whole) {
                let more = of(errors).zip(of(whole)).map(|(e, w)| e - w);
                to.set(hole.name, more);
            }
        }
        for (quantity, of) in Uncovered::QUANTITIES {
            to.set(quantity.name, of(&self.uncovered[at][i]));
        }
        to.set(WITHIN.name, self.within[at][i]);
        to.set(AlbedoProbe::QUANTITY.name, self.albedo[i]);
        if let Some((errors, unresolved)) = moments {
            for (quantity, of) in MomentErrors::QUANTITIES {
                to.set(quantity.name, of(errors));
            }
            to.set(MomentErrors::UNRESOLVED.name, Some(*unresolved as f64));
        }
    }
}
