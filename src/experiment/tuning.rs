//! Ratios of grids that are tuned: on materials that are not tested, once for each schedule that asks for it.
//!
//! The number of nodes along an axis for one along the last is found by coordinate descent: each is multiplied and divided
//! by a step, and what errs less is kept; the step starts at 2 and becomes its root where nothing errs less, down to the
//! fourth root of 2. What is minimised is the geometric mean of nrmse over the training materials.

use super::counts::{Built, Counters, Stage, Work};
use super::materials::Material;
use super::stop::{GoOn, Stop};
use crate::brdf::Channels;
use crate::error::{Error, ParameterError};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::{Ideal, Instrument};
use crate::metrics::{self, Values};
use crate::parametrization::Parametrization;
use crate::reconstruct::Reconstruct;
use crate::schedule::SampleSet;
use crate::statistics::EXACT;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Grids that one tuning measures at most.
const MOST: usize = 60;

/// The smallest step of a ratio.
const FINEST: f64 = 1.18;

/// True if a material of symmetry `own` may be measured by a schedule that folds `folded`.
pub(super) fn suits_folding(own: Symmetry, folded: Symmetry) -> bool {
    (own.isotropic || !folded.isotropic)
        && (own.reciprocal || !folded.reciprocal)
        && (own.bilateral || !folded.bilateral)
}

/// A training material and its values at the pairs.
struct Truth {
    symmetry: Symmetry,
    brdf: Built,
    values: Values,
}

/// What ratios are tuned on, and those found so far.
pub struct Tuning {
    /// The hash of what determines a ratio: materials, pairs and reconstruction.
    pub(super) key: String,
    /// `[tuning]` with every default.
    pub(super) resolved: toml::Table,
    pub(super) materials: Vec<Material>,
    pub(super) method: Arc<dyn Reconstruct>,
    pub(super) pairs: Vec<DirectionPair>,
    pub(super) memory: Memory,
}

/// What a tuning made so far.
#[derive(Default)]
pub(super) struct Memory {
    truths: OnceLock<Vec<Truth>>,
    /// Kept for every later run and picture.
    found: Mutex<Vec<Tuned>>,
}

/// A grid whose ratio is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// The parametrization.
    pub parametrization: String,
    /// Its warps, or `none`.
    pub warp: String,
    /// Name of the sample set.
    pub sample_set: String,
    /// The symmetries that fold the grid.
    pub symmetry: Symmetry,
    /// Configurations it may have.
    pub budget: usize,
}

impl std::fmt::Debug for Tuning {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "tuning {}", self.key)
    }
}

/// A ratio that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuned {
    /// The grid.
    #[serde(flatten)]
    pub grid: Wanted,
    /// Relative numbers of nodes per axis.
    pub ratio: Vec<f64>,
    /// Numbers of nodes per axis.
    pub shape: Vec<usize>,
    /// Geometric mean of nrmse over the training materials.
    pub nrmse: f64,
    /// Geometric mean of nrmse over the training materials, of the parametrization's own ratio.
    pub nrmse_untuned: f64,
    /// Grids that were measured.
    pub tried: usize,
}

impl Tuned {
    /// Adds the ratios of grids that have none yet.
    pub(crate) fn add(to: &mut Vec<Self>, others: Vec<Self>) {
        for other in others {
            if to.iter().all(|t| t.grid != other.grid) {
                to.push(other);
            }
        }
    }
}

impl Tuning {
    fn truths(&self, counters: &Counters) -> Result<&[Truth], Stop> {
        if let Some(truths) = self.memory.truths.get() {
            return Ok(truths);
        }
        let mut truths = Vec::new();
        for material in &self.materials {
            let brdf = Built::new(&*material.spec, Channels::Luminance, counters);
            let brdf = brdf.map_err(|e| Stop::Error(Error::data(&material.name, e)))?;
            let values = metrics::evaluate(&brdf.counted_at(counters, Stage::Plan), &self.pairs);
            truths.push(Truth {
                symmetry: material.symmetry,
                values,
                brdf,
            });
        }
        Ok(self.memory.truths.get_or_init(|| truths))
    }

    /// The ratios so far, in the order they were found.
    pub(crate) fn found(&self) -> Vec<Tuned> {
        let found = self.memory.found.lock();
        found.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The ratio of a grid, sought if it is not known; `set` is to be tuned, `with` counts and may stop it.
    pub(super) fn find(
        &self,
        grid: Wanted,
        set: &dyn SampleSet,
        form: &Arc<dyn Parametrization>,
        (counters, go_on): (&Counters, GoOn<'_>),
    ) -> Result<Tuned, Stop> {
        if let Some(known) = self.found().into_iter().find(|t| t.grid == grid) {
            return Ok(known);
        }
        let suits = |t: &&Truth| suits_folding(t.symmetry, grid.symmetry);
        let mut search = Search {
            tuning: self,
            truths: self.truths(counters)?.iter().filter(suits).collect(),
            set,
            form,
            budget: grid.budget,
            known: HashMap::new(),
            counters,
            go_on,
        };
        let mut ratio: Vec<f64> = form.axes().iter().map(|a| a.density).collect();
        let (mut shape, mut least) = search.error(&ratio)?;
        let untuned = least;
        let mut step: f64 = 2.0;
        while step > FINEST && search.known.len() < MOST {
            let mut better = false;
            for d in 0..ratio.len() - 1 {
                for factor in [step, 1.0 / step] {
                    if search.known.len() >= MOST {
                        break;
                    }
                    let mut other = ratio.clone();
                    other[d] *= factor;
                    match search.error(&other) {
                        Ok((its, error)) if error < least => {
                            (ratio, shape, least, better) = (other, its, error, true);
                        }
                        // Out of the range of ratios, or too few poses: no candidate.
                        Ok(_) | Err(Stop::Failed(_)) => {}
                        Err(e) => return Err(e),
                    }
                }
            }
            if !better {
                step = step.sqrt();
            }
        }
        let tuned = Tuned {
            tried: search.known.len(),
            grid,
            ratio,
            shape,
            nrmse: least,
            nrmse_untuned: untuned,
        };
        let found = self.memory.found.lock();
        let mut found = found.unwrap_or_else(PoisonError::into_inner);
        found.push(tuned.clone());
        Ok(tuned)
    }
}

struct Search<'a> {
    tuning: &'a Tuning,
    truths: Vec<&'a Truth>,
    set: &'a dyn SampleSet,
    form: &'a Arc<dyn Parametrization>,
    budget: usize,
    /// By shape: many ratios are one.
    known: HashMap<Vec<usize>, f64>,
    counters: &'a Counters,
    go_on: GoOn<'a>,
}

impl Search<'_> {
    /// The shape that a ratio gives, and the error on the training materials.
    fn error(&mut self, ratio: &[f64]) -> Result<(Vec<usize>, f64), Stop> {
        let tuned = self.set.tuned(ratio);
        let set = tuned.as_deref().unwrap_or(self.set);
        // Grids do not depend on the seed.
        let schedule = set.plan(self.form, self.budget, 0).map_err(Stop::failed)?;
        let schedule = Arc::new(schedule);
        let axes = schedule.lattice.iter().flat_map(|lattice| &lattice.axes);
        let shape: Vec<usize> = axes.map(|axis| axis.n).collect();
        if let Some(&error) = self.known.get(&shape) {
            return Ok((shape, error));
        }
        let add = |work, number| self.counters.add(Stage::Plan, work, number);
        add(Work::Grids, 1);
        let [mut logs, mut count] = [0.0; 2];
        for truth in &self.truths {
            (self.go_on)()?;
            let brdf = truth.brdf.counted_at(self.counters, Stage::Plan);
            let measurement = Ideal.measure(&brdf, &schedule);
            let made = match self.tuning.method.reconstruct(&measurement) {
                Ok(made) => {
                    add(Work::Reconstructions, 1);
                    let made = self.counters.reconstruction(&*made, Stage::Plan);
                    metrics::evaluate(&made, &self.tuning.pairs)
                }
                Err(e) => {
                    let e = ParameterError::new("ratio", format!("{ratio:?}"), e.to_string());
                    return Err(Stop::failed(e));
                }
            };
            let errors = metrics::compare(&self.tuning.pairs, &truth.values, &made);
            // Below that it is rounding, which has no say; a black truth has no error.
            if let Some(error) = errors.nrmse {
                logs += error.max(EXACT).ln();
                count += 1.0;
            }
        }
        let error = (logs / f64::max(count, 1.0)).exp();
        self.known.insert(shape.clone(), error);
        Ok((shape, error))
    }
}
