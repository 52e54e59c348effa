//! Poses before the first reading by what many materials were like, as others published it: to compare with.
//!
//! All choose among the same candidates, up to an elevation of 80°, by the mean and the functions of a prior, whose
//! coefficients have variance 1; poses that were read count as chosen. Materials of other symmetries are planned for as
//! if they had those of the prior.

use super::choice::{Wanted, least_error};
use super::field::{Field, MOST, Reach, admit, field, pairs};
use super::greedy::{normalised, squared};
use super::rows::Rows;
use super::{Chosen, Planner, Task};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::numeric::hashed;
use crate::parametrization::Axis;
use crate::reconstruct::{COMPONENTS, Components, Posterior, PriorFile, RIDGE, Reconstruct};
use crate::registry::{self, Entry, Keys, Resolved, named};
use crate::schedule::SampleSet;
use serde::{Deserialize, Serialize};

named! {
    /// What decides over poses.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Criterion {
        /// The condition number of the functions at all poses, by exchanges (Nielsen, Jensen & Ramamoorthi 2015, "On optimal,
        /// minimal BRDF sampling for reflectance acquisition").
        ConditionNumber = "condition-number": "poses that make the functions of a prior well-conditioned (Nielsen et al. 2015)",
        /// Simultaneous orthogonal matching pursuit of the materials of the prior (Miandji et al. 2024, "FROST-BRDF"); beyond
        /// their rank as `DOptimal` with the usual ridge.
        Somp = "somp": "poses by matching pursuit of the materials of a prior (FROST, 2024)",
        /// QR with column pivoting of as many functions as poses (Manohar et al. 2018, "Data-driven sparse sensor placement for
        /// reconstruction"); beyond their number as `DOptimal` with the usual ridge.
        QrPivot = "qr-pivot": "poses by QR with pivoting of the functions of a prior (Manohar et al. 2018)",
        /// The determinant of ridge + Σ q qᵀ over all poses, one by one (Fedorov 1972; of
        /// [components](crate::reconstruct::Components) with this ridge).
        DOptimal = "d-optimal": "poses that leave the coefficients of a prior the least volume",
        /// The error of ln f that the materials of the prior are left with by kriging, one pose after the other: half under
        /// the cosine measure, half times the mean of their (f cos)². None of them is left out for that; the kernel has a variance for what functions of others say wrongly of one.
        Erm = "erm": "poses that leave the materials of a prior the least error of ln f by kriging",
    }
}

/// The keys of most.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Named {
    /// `built-in`, or a file of `gonio train`.
    prior: PriorFile,
}

/// A planner by what many materials were like.
#[derive(Clone, Debug)]
pub struct Published {
    criterion: Criterion,
    /// The prior, and the ridge of [`Criterion::DOptimal`].
    keys: Components,
}

/// The registry entry of a criterion, by its number.
fn entry<const CRITERION: usize>() -> Entry<dyn Planner> {
    let criterion = Criterion::ALL[CRITERION];
    Entry {
        kind: criterion.name(),
        summary: criterion.summary(),
        examples: match criterion {
            Criterion::DOptimal => &["", "ridge = 0.1\nprior = \"built-in\""],
            _ => &["", "prior = \"built-in\""],
        },
        read: |table| {
            let criterion = Criterion::ALL[CRITERION];
            let keys = match criterion {
                Criterion::DOptimal => {
                    let mut keys: Components = registry::parse(table)?;
                    keys.ridge.get_or_insert(RIDGE);
                    keys
                }
                _ => Components {
                    prior: registry::parse::<Named>(table)?.prior,
                    ..Components::default()
                },
            };
            Ok(Box::new(Published { criterion, keys }))
        },
    }
}

/// The registry entries.
pub(super) fn entries() -> [Entry<dyn Planner>; Criterion::ALL.len()] {
    [
        entry::<0>(),
        entry::<1>(),
        entry::<2>(),
        entry::<3>(),
        entry::<4>(),
    ]
}

impl Published {
    /// Numbers of candidates, of which none is in `read`.
    fn chosen(
        &self,
        field: &Field,
        read: &[DirectionPair],
        seed: u64,
        wanted: Wanted<'_>,
    ) -> Result<Vec<usize>, ParameterError> {
        let prior = self.keys.prior.load()?;
        let mut pairs = field.pairs();
        let candidates = pairs.len();
        pairs.extend(read);
        let (_, functions) = prior.basis_at(&pairs);
        let rows = |functions| Rows::new(functions, candidates);
        Ok(match self.criterion {
            Criterion::ConditionNumber => rows(functions).conditioned(seed, wanted),
            Criterion::Somp => rows(functions).pursuit(&prior.centres, wanted),
            Criterion::QrPivot => rows(functions).pivots(wanted),
            Criterion::DOptimal => {
                let ridge = self.keys.ridge.unwrap_or(RIDGE);
                rows(functions).d_optimal(Vec::new(), ridge, wanted)
            }
            Criterion::Erm => {
                let process = Posterior::before(Symmetry::FULL, Some(&prior));
                let at_places = prior.basis_at(&field.places).1;
                let residuals = [at_places, functions].map(|q| prior.centres.tr_mul(&q));
                let [places, from] = [&field.places, &pairs].map(|list| process.places(list));
                let bright = squared(&field.places, prior.brightness(&field.places));
                let bright = field.density.iter().zip(bright).map(|(w, f)| w * f);
                let halves = [field.density.clone(), bright.collect()].map(normalised);
                let [log, square] = halves;
                let weights: Vec<f64> = log.zip(square).map(|(l, q)| 0.5 * (l + q)).collect();
                let both = [&places, &from];
                least_error(&process, both, residuals, &weights, read.len(), wanted)
            }
        })
    }
}

impl Resolved for Published {
    fn resolved(&self) -> Keys {
        let (kind, prior) = (self.criterion.name(), self.keys.prior.clone());
        match self.criterion {
            Criterion::DOptimal => registry::resolved(kind, &self.keys),
            _ => registry::resolved(kind, &Named { prior }),
        }
    }
}

impl SampleSet for Published {
    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        Reconstruct::check(&self.keys)
    }

    plans_by_design!();
}

impl Planner for Published {
    fn prior(&self) -> Option<&PriorFile> {
        Some(&self.keys.prior)
    }

    fn assumes(&self) -> Option<&'static str> {
        Some(COMPONENTS)
    }

    fn most(&self) -> usize {
        MOST
    }

    fn next(&self, task: &Task<'_>, so_far: &Measurement, most: usize) -> Chosen {
        let before = so_far.schedule.poses.len();
        admit(self.criterion.name(), before + most, MOST)?;
        let reach = Reach::new(task, so_far);
        let Some(field) = field(self.criterion.name(), (task, &reach), so_far, most)? else {
            return Ok(Vec::new());
        };
        let wanted = task.wanted(most.min(field.candidates.len()));
        let seed = hashed([task.seed, before as u64, 3]);
        let chosen = self.chosen(&field, &pairs(so_far, true, usize::MAX), seed, wanted)?;
        Ok(field.poses(&chosen))
    }
}
