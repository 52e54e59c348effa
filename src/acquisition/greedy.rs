//! Poses chosen one by one, each where its reading is most informative, by a Gaussian process of ln f.
//!
//! Errors are those of ln f and of f cos θ_i, both under the density cos θ_i cos θ_o. Two criteria: the variance
//! that a reading takes from all places (A-optimal design; Krause, Singh & Guestrin 2008), and the variance at the
//! pose itself. Where a material was read, places count by how bright it is there, and by how far the readings near
//! are from what the others predict of them.

use super::choice::{Weights, a_optimal, least_certain};
use super::field::{Field, MOST as MOST_COMPARED, MOST_ASKED, admit, pairs, supposed};
use super::moments::{self, MomentAim, MomentForecast, OfLogs};
use super::{Chosen, Forecast, Planner, Task, halves};
use crate::brdf::microfacet::{FresnelSpec, Ggx, Microfacet};
use crate::brdf::{Brdf, Channels, Roughness};
use crate::error::{ParameterError, in_closed, in_left_open};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::Expected;
use crate::moments::Influences;
use crate::parametrization::Axis;
use crate::reconstruct::{
    Coordinates, Estimates, KRIGING, Kriging, LocalPosterior, MOST_COMPARED as MOST_WHOLE,
    MOST_SPARSE, Mixture, Posterior, Predictive, PriorFile, Reconstruct, ReconstructError, TRUSTED,
    Values,
};
use crate::registry::{self, Entry, Keys, Resolved, keys, named};
use crate::schedule::{Pictures, PlanError, Pose, SampleSet};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_PI;

/// Poses of the first batch, which all materials share.
const FIRST: usize = 8;

/// Poses from which on the least certain ones are as informative as those that A-optimal design finds, for less time.
const MANY: usize = 512;

/// Poses of a batch, at most: their covariances with all candidates take half a gigabyte.
const MOST_AT_ONCE: usize = 4000;

/// The round of places at which errors are expected: none that poses were chosen by.
const UNSEEN: u64 = u64::MAX;

named! {
    /// What decides over the next pose.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Rule {
        /// The variance of any material that is left at all places, whatever was read there.
        AOptimal = "a-optimal": "poses that leave the least variance of any material; before the first reading",
        /// The variance of the material at hand that is left at all places, batch after batch; from 512 poses on as
        /// `Uncertainty`.
        Adaptive = "adaptive": "poses that leave the least variance of the material at hand, batch after batch",
        /// The variance of the material at hand at the pose, batch after batch.
        Uncertainty = "uncertainty": "poses where the material at hand is least certain, batch after batch",
        /// As `Adaptive`, by the material itself in place of what its readings say: what knowing where to look is worth.
        Oracle = "oracle": "as adaptive, by the errors that a material that is known is left with; in studies",
    }
}

/// The least mask, degrees: inside it there are enough places and candidates.
const LEAST_MASK: f64 = 40.0;

keys! {
    /// What errors count.
    pub struct Aim {
        /// Share λ of the error of f cos in what is made small, 2(1 − λ) ln E|Δ ln f| + λ ln E(Δ f cos)², in [0, 1].
        weight: f64 = 0.5;
        /// Elevation up to which errors count, degrees in [40, 90].
        mask_deg: f64 = 80.0;
        /// What is known beforehand: `built-in` (materials of formulas), or a file of `gonio train`.
        prior: Option<PriorFile> = None;
        /// Coordinates of the kernel, by default those of `kriging`.
        coordinates: Option<Coordinates> = None;
        /// Errors that are small enough: once what nine of ten materials are below has reached all, no pose is asked for.
        target: Option<Target> = None;
        /// A moment of slices that poses are chosen for in place of the BRDF, e.g. `variance=5%` or `energy_40_70=1%`; by `uncertainty`,
        /// and from 512 poses on, it only ends them: once what the error of nine of ten materials is below has reached the level, no pose is
        /// asked for; with a target both are to be reached. At level 0 they go on, as with `a-optimal`, which chooses before the first reading. The
        /// smallest value of the slice at 45° is taken off as a diffuse part, views are at azimuth 0, and `weight` and `mask_deg` do not count.
        #[serde(rename = "for")]
        moment: Option<MomentAim> = None;
    }
}

/// Exclusive lower end of targets: below the noise of any reading.
const LEAST_TARGET: f64 = 1e-6;

/// Errors to be reached, each in (1e-6, 10]; those that are not named are not asked for.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Target {
    /// Of `nrmse`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nrmse: Option<f64>,
    /// Of `log_relative`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_relative: Option<f64>,
}

impl Target {
    /// The errors that are named.
    fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let all = [("nrmse", self.nrmse), ("log_relative", self.log_relative)];
        all.into_iter()
            .filter_map(|(name, error)| Some((name, error?)))
    }

    fn is_reached(&self, bound: &Expected) -> bool {
        let reached = |error: Option<f64>, asked: Option<f64>| {
            asked.is_none_or(|asked| error.is_some_and(|error| error <= asked))
        };
        reached(bound.nrmse, self.nrmse) && reached(bound.log_relative, self.log_relative)
    }
}

/// A planner that takes the most informative pose, again and again.
#[derive(Clone, Debug)]
pub struct Greedy {
    rule: Rule,
    aim: Aim,
}

/// The registry entry of a rule, by its number.
fn entry<const RULE: usize>() -> Entry<dyn Planner> {
    let rule = Rule::ALL[RULE];
    Entry {
        kind: rule.name(),
        summary: rule.summary(),
        examples: &[
            "",
            "weight = 0.4\nmask_deg = 75\nprior = \"built-in\"",
            "for = \"variance=0\"",
        ],
        read: |table| {
            let aim = registry::parse(table)?;
            Ok(Box::new(Greedy::new(Rule::ALL[RULE], aim)))
        },
    }
}

/// The registry entries.
pub(super) fn entries() -> [Entry<dyn Planner>; Rule::ALL.len()] {
    [entry::<0>(), entry::<1>(), entry::<2>(), entry::<3>()]
}

impl Greedy {
    /// A planner of this rule.
    pub fn new(rule: Rule, aim: Aim) -> Self {
        Self { rule, aim }
    }

    /// What makes something of readings.
    fn kriging(&self) -> Kriging {
        Kriging {
            prior: self.aim.prior.clone(),
            coordinates: self.aim.coordinates.clone(),
            ..Kriging::default()
        }
    }

    /// The moment that poses are chosen for.
    fn chosen_for(&self) -> Option<MomentAim> {
        self.aim.moment.filter(|_| self.rule != Rule::Uncertainty)
    }

    /// Candidates for `n` poses after those of a measurement: others in every round.
    fn field(
        &self,
        task: &Task<'_>,
        so_far: &Measurement,
        n: usize,
        round: u64,
    ) -> Result<Field, PlanError> {
        let mask = self.aim.mask_deg.to_radians();
        let field = match task.stop_angle() {
            Some(stop) => Field::of_pictures(task, stop, mask, n, so_far, round)?,
            None => Field::new(task, mask, n, so_far, round)?,
        };
        match field.candidates.is_empty() {
            true => Err(PlanError::NoCandidate {
                sample_set: self.rule.name(),
            }),
            false => Ok(field),
        }
    }

    /// So many poses for any material, given where it was read but not what was.
    fn beforehand(&self, task: &Task<'_>, so_far: &Measurement, n: usize) -> Chosen {
        let asked = so_far.schedule.poses.len();
        let field = self.field(task, so_far, n, asked as u64)?;
        let wanted = field.wanted(task, n);
        let process = Posterior::beforehand(&self.kriging(), task.form.symmetry())?;
        let process = supposed(process, so_far);
        let process = process.ok_or_else(|| self.singular(asked))?;
        let candidates = process.places(&field.pairs());
        let for_moment = self.chosen_for().filter(|_| n <= MOST_COMPARED);
        let for_moment = for_moment.and_then(|aim| {
            let sums = lobes().flat_map(|lobe| aim.sums(&lobe)).collect::<Vec<_>>();
            moments::choose(&process, &sums, &candidates, wanted)
        });
        let chosen = if let Some(chosen) = for_moment {
            chosen
        } else if n <= MOST_COMPARED {
            let places = process.places(&field.places);
            let bright = match process.prior() {
                Some(known) => squared(&field.places, known.brightness(&field.places)),
                None => brightness(&field.places, &field.density),
            };
            let bright = field.density.iter().zip(bright);
            let weights = Weights {
                of_square: bright.map(|(w, f)| w * f).collect(),
                of_log: field.density.clone(),
                share: self.aim.weight,
                cap: 4.0,
            };
            a_optimal(&process, [&places, &candidates], &weights, wanted)
        } else {
            let weights = field.candidate_density().into_iter();
            let weights: Vec<f64> = weights.map(|w| w.powf(2.0 / 3.0)).collect();
            least_certain(&(&process, &candidates), &weights, wanted)
        };
        Ok(field.poses(&chosen))
    }

    fn singular(&self, readings: usize) -> PlanError {
        let e = ReconstructError::Singular {
            method: self.rule.name(),
            readings,
        };
        self.unknown(&e)
    }

    fn unknown(&self, e: &ReconstructError) -> PlanError {
        let kind = self.rule.name();
        PlanError::Refused(format!("{kind} cannot learn from these readings: {e}"))
    }

    /// So many poses by what is known of the material. Poses without a reading count as if they had been read as expected, and make
    /// those near less likely to be read.
    fn informed(&self, task: &Task<'_>, so_far: &Measurement, n: usize) -> Chosen {
        let asked = so_far.schedule.poses.len();
        let kriging = self.kriging();
        let unread = |most| pairs(so_far, false, most);
        let unknown = |e| self.unknown(&e);
        let field = self.field(task, so_far, n, asked as u64)?;
        let wanted = field.wanted(task, n);
        let pairs = field.pairs();
        let share = self.aim.weight;
        let truth = match self.rule {
            Rule::Oracle => Some(task.truth.ok_or_else(|| {
                let what = "knows the material that it measures; allowed: in studies, which do";
                PlanError::Refused(format!("{} {what}", self.rule.name()))
            })?),
            _ => None,
        };
        // The density of the poses that leave the smallest error, up to what the kernel makes of them.
        let least_certain = |candidates: &dyn Estimates| {
            let density = &field.candidate_density();
            let known = Known::new(candidates, &pairs, density, truth);
            let log = normalised(known.weights(|w, _, s| (w * s.sqrt()).powf(2.0 / 3.0)));
            let square = normalised(known.weights(|w, f, s| (w * f * s).sqrt()));
            let mixed = log.zip(square).map(|(l, q)| (1.0 - share) * l + share * q);
            let weights: Vec<f64> = mixed.collect();
            least_certain(candidates, &weights, wanted)
        };
        let many = asked > MOST_ASKED && so_far.readings() > TRUSTED;
        if so_far.readings() > MOST_WHOLE || many {
            let (process, _) = LocalPosterior::new(&kriging, so_far).map_err(unknown)?;
            let process = process.supposing(&unread(usize::MAX));
            let process = process.ok_or_else(|| self.singular(asked))?;
            let candidates = process.at(&pairs).ok_or_else(|| self.singular(asked))?;
            return Ok(field.poses(&least_certain(&candidates)));
        }
        let process = Posterior::likeliest(&kriging, so_far).map_err(unknown)?;
        let process = process.supposing(&unread(MOST_ASKED), false);
        let process = process.ok_or_else(|| self.singular(asked))?;
        let candidates = process.places(&pairs);
        let few = asked < MANY && n <= MOST_COMPARED;
        let for_moment = self.chosen_for().filter(|_| few).and_then(|aim| {
            let logs = |pairs: &[DirectionPair]| (&process, &process.places(pairs)).likely_most();
            let expected = OfLogs {
                symmetry: task.form.symmetry(),
                logs,
            };
            let sums = aim.sums(truth.unwrap_or(&expected));
            moments::choose(&process, &sums, &candidates, wanted)
        });
        let chosen = if let Some(chosen) = for_moment {
            chosen
        } else if self.rule != Rule::Uncertainty && few {
            let places = process.places(&field.places);
            let at = (&process, &places);
            let known = Known::new(&at, &field.places, &field.density, truth);
            let weights = Weights {
                of_square: known.weights(|w, f, s| w * f * s),
                of_log: known.weights(|w, _, s| w * s),
                share,
                cap: 1.0,
            };
            a_optimal(&process, [&places, &candidates], &weights, wanted)
        } else {
            least_certain(&(&process, &candidates))
        };
        Ok(field.poses(&chosen))
    }
}

impl Resolved for Greedy {
    fn resolved(&self) -> Keys {
        registry::resolved(self.rule.name(), &self.aim)
    }
}

impl SampleSet for Greedy {
    fn label(&self) -> String {
        let mut label = self.rule.name().to_owned();
        if self.aim.prior.is_some() {
            label.push_str("-prior");
        }
        if let Some(coordinates) = &self.aim.coordinates {
            label.push_str(&format!("[{}]", coordinates.label()));
        }
        for (name, error) in self.aim.target.iter().flat_map(Target::named) {
            label.push_str(&format!("-to-{name}-{error}"));
        }
        if let Some(aim) = self.aim.moment {
            label.push_str(&format!("-for-{}", aim.name()));
            if aim.level > 0.0 {
                label.push_str(&format!("-{}", aim.level));
            }
        }
        label
    }

    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        in_closed("weight", self.aim.weight, 0.0, 1.0)?;
        in_closed("mask_deg", self.aim.mask_deg, LEAST_MASK, 90.0)?;
        self.kriging().check()?;
        if self.rule == Rule::AOptimal
            && let Some(aim) = self.aim.moment.filter(|aim| aim.level > 0.0)
        {
            let allowed = format!(
                "{}=0: its poses are chosen before the first reading",
                aim.name()
            );
            return Err(ParameterError::new("for", format!("\"{aim}\""), allowed));
        }
        let Some(target) = self.aim.target else {
            return Ok(());
        };
        if self.rule == Rule::AOptimal {
            let allowed = "none: its poses are chosen before the first reading";
            return Err(ParameterError::new("target", "{ … }", allowed));
        }
        if target.named().next().is_none() {
            return Err(ParameterError::new(
                "target",
                "{}",
                "nrmse, log_relative or both",
            ));
        }
        for (name, error) in target.named() {
            in_left_open(&format!("target.{name}"), error, LEAST_TARGET, 10.0)?;
        }
        Ok(())
    }

    plans_by_design!();
}

impl Planner for Greedy {
    fn prior(&self) -> Option<&PriorFile> {
        self.aim.prior.as_ref()
    }

    fn assumes(&self) -> Option<&'static str> {
        Some(KRIGING)
    }

    fn nests(&self) -> bool {
        self.rule != Rule::AOptimal
    }

    fn batch(&self, asked: usize, budget: usize, in_pictures: bool) -> Option<usize> {
        let batch = match in_pictures {
            // A stop is not worth a rest of less than half a picture.
            true => match budget.saturating_sub(asked) {
                rest if asked > 0 && 2 * rest < Pictures::NODES => 0,
                rest => halves(Pictures::NODES, asked, budget).max(Pictures::NODES.min(rest)),
            },
            false => halves(FIRST, asked, budget),
        };
        (self.rule != Rule::AOptimal).then_some(batch.min(MOST_AT_ONCE))
    }

    fn most(&self) -> usize {
        match self.rule {
            Rule::AOptimal => MOST_COMPARED,
            Rule::Adaptive | Rule::Uncertainty | Rule::Oracle => MOST_SPARSE,
        }
    }

    fn is_enough(&self, task: &Task<'_>, so_far: &Measurement) -> bool {
        let aim = self.aim.moment.filter(|aim| aim.level > 0.0);
        let is_asked = (self.aim.target.is_some() || aim.is_some()) && self.rule != Rule::AOptimal;
        let Some(forecast) = is_asked.then(|| self.forecast(task, so_far, &[])).flatten() else {
            return false;
        };
        let bound = forecast.now.bound(so_far.readings());
        let is_reached = |target: Target| target.is_reached(&bound);
        self.aim.target.is_none_or(is_reached)
            && aim.is_none_or(|_| forecast.moment.is_some_and(|moment| moment.is_reached()))
    }

    fn forecast(&self, task: &Task<'_>, so_far: &Measurement, next: &[Pose]) -> Option<Forecast> {
        // Poses without a reading do not count.
        let mixture = Mixture::new(&self.kriging(), so_far).ok()?;
        let field = self.field(task, so_far, 0, UNSEEN).ok()?;
        let next: Vec<DirectionPair> = next.iter().map(|pose| pose.pair).collect();
        let known = mixture.with(&field.places, &next)?;
        let [now, then] = [0, 1].map(|then| {
            let pairs = field.places.iter().zip(&field.density).zip(&known);
            let all = pairs.map(|((pair, w), known)| (*w, pair.omega_i.cos_theta(), known[then]));
            Expected::from_pairs(all)
        });
        let moment = self.aim.moment.and_then(|aim| {
            let logs = |pairs: &[DirectionPair]| mixture.means(pairs);
            let symmetry = task.form.symmetry();
            let sums = aim.sums(&OfLogs { symmetry, logs });
            let error = |read: &[DirectionPair]| {
                let of = |sums: &Influences| {
                    mixture.variances_of_sums_with(&sums.pairs, &sums.weights, read)
                };
                let views: Option<Vec<Vec<f64>>> = sums.iter().map(of).collect();
                moments::expected(views?.into_iter())
            };
            let now = error(&[])?;
            let then = if next.is_empty() { now } else { error(&next)? };
            Some(MomentForecast { aim, now, then })
        });
        Some(Forecast {
            now,
            then,
            moment,
            suspects: mixture.suspects().to_vec(),
        })
    }

    fn next(&self, task: &Task<'_>, so_far: &Measurement, most: usize) -> Chosen {
        let asked = so_far.schedule.poses.len();
        admit(self.rule.name(), asked + most, self.most())?;
        if most > MOST_AT_ONCE {
            let kind = self.rule.name();
            return Err(PlanError::Refused(format!(
                "batch = {most}: {kind} chooses at most {MOST_AT_ONCE} poses at once; allowed: at most so many"
            )));
        }
        let next = match (self.rule, so_far.readings()) {
            (Rule::AOptimal, _) | (_, 0) => self.beforehand(task, so_far, most),
            _ => self.informed(task, so_far, most),
        };
        match next {
            // What was read is read.
            Err(PlanError::NoCandidate { .. }) if so_far.readings() > 0 => Ok(Vec::new()),
            next => next,
        }
    }
}

pub(super) fn normalised(list: Vec<f64>) -> impl Iterator<Item = f64> {
    let sum: f64 = list.iter().sum();
    list.into_iter().map(move |x| x / sum)
}

/// What is known of a material at pairs.
struct Known<'a> {
    density: &'a [f64],
    /// (f cos)², as large as it may well be.
    bright: Vec<f64>,
    /// How far readings near are from what the others predict of them, squared, in units of the variance.
    surprise: Vec<f64>,
}

impl<'a> Known<'a> {
    fn new(
        at: &dyn Estimates,
        pairs: &[DirectionPair],
        density: &'a [f64],
        truth: Option<&dyn Brdf>,
    ) -> Self {
        let (scale, logs) = (at.scale(), at.means().into_iter());
        let logs: Vec<(f64, f64)> = logs.zip(at.variances()).collect();
        let mut bright = at.likely_most();
        let mut surprise = at.surprise();
        if let Some(truth) = truth {
            for (i, (pair, (z, v))) in pairs.iter().zip(&logs).enumerate() {
                // What it has no data for is as it is expected to be.
                let Some(f) = truth.luminance(pair) else {
                    continue;
                };
                bright[i] = Values::Log.with(1e-3).forward(f);
                surprise[i] = (bright[i] - z).powi(2) / (v * scale).max(1e-12);
            }
        }
        let bright = pairs.iter().zip(bright).map(|(pair, z)| {
            let cosine = pair.omega_i.cos_theta();
            (2.0 * z).exp() * cosine * cosine
        });
        Self {
            density,
            bright: bright.collect(),
            surprise,
        }
    }

    /// A function of density, brightness and surprise at each pair.
    fn weights(&self, of: impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
        let all = self.density.iter().zip(&self.bright).zip(&self.surprise);
        all.map(|((w, f), s)| of(*w, *f, *s)).collect()
    }
}

/// f² cos² of f² at pairs.
pub(super) fn squared(pairs: &[DirectionPair], squares: Vec<f64>) -> Vec<f64> {
    let all = pairs.iter().zip(squares);
    all.map(|(pair, f)| f * pair.omega_i.cos_theta().powi(2))
        .collect()
}

/// Glossy and matte materials, whose moments stand for those of any.
fn lobes() -> impl Iterator<Item = Microfacet<Ggx>> {
    [0.05, 0.15, 0.4, 0.9].into_iter().map(lobe)
}

/// The lobe of a roughness.
fn lobe(alpha: f64) -> Microfacet<Ggx> {
    let (alpha, fresnel) = (Roughness::Isotropic(alpha), FresnelSpec::default());
    Microfacet::new(alpha, &fresnel, Channels::Luminance)
}

/// (f cos)² of many glossy materials at pairs, on average, each as a share of its own mean under a density.
fn brightness(pairs: &[DirectionPair], density: &[f64]) -> Vec<f64> {
    const LOBES: usize = 16;
    let mut sum = vec![0.0; pairs.len()];
    for k in 0..LOBES {
        // From a mirror-like lobe to a matte one.
        let alpha = 0.012 * (0.9_f64 / 0.012).powf(k as f64 / (LOBES - 1) as f64);
        let (values, _) = lobe(alpha).values(pairs);
        for albedo in [0.0, 0.3] {
            let squares = pairs.iter().zip(&values).map(|(pair, f)| {
                let cosine = pair.omega_i.cos_theta();
                ((f + albedo * FRAC_1_PI) * cosine).powi(2)
            });
            let squares: Vec<f64> = squares.collect();
            let mean: f64 = squares.iter().zip(density).map(|(f, w)| f * w).sum();
            for (sum, f) in sum.iter_mut().zip(squares) {
                *sum += f / mean;
            }
        }
    }
    sum
}
