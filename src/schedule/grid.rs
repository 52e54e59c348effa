//! Sample sets that are laid out on a grid of shapes: the regular grid and its jittered sibling.
//!
//! A grid is the largest in its ratio with at most the budgeted number of distinct configurations:
//! a common scale grows, each axis has the nearest whole number of nodes, and the next finer shape
//! has more configurations than the budget.

use super::lattice::{Centring, Lattice, LatticeAxis, coords, each_node_while, node_at};
use super::sample_set::{Planned, SampleSet, from_unit, place};
use super::shapes::{filled, in_numbers, largest};
use super::{Pose, Schedule};
use crate::error::{ParameterError, listed};
use crate::parametrization::{Axis, AxisKind, Coords, Parametrization};
use crate::registry::declare;
use crate::sampling::Random;
use rustc_hash::FxHashMap;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::sync::Arc;

/// How many nodes the axes of a grid have relative to each other.
#[derive(Clone, Debug, PartialEq)]
pub enum Ratio {
    /// Numbers, one per axis.
    Numbers(Vec<f64>),
    /// `"tuned"`: what errs least on materials that are not tested; an experiment finds it.
    Tuned,
}

impl Serialize for Ratio {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Ratio::Numbers(numbers) => numbers.serialize(serializer),
            Ratio::Tuned => serializer.serialize_str(TUNED),
        }
    }
}

impl<'de> Deserialize<'de> for Ratio {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct V;
        impl<'de> Visitor<'de> for V {
            type Value = Ratio;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of numbers, or \"tuned\"")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<Ratio, E> {
                match word {
                    TUNED => Ok(Ratio::Tuned),
                    _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
                }
            }
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Ratio, A::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(Ratio::Numbers)
            }
        }
        deserializer.deserialize_any(V)
    }
}

const TUNED: &str = "tuned";

declare! {
    impl dyn SampleSet, "grid": "regular grid, cell- or node-centred per axis; ratio = \"tuned\" with [tuning]; fill", [
        "",
        "ratio = [4, 4, 1]\ncentring = [\"start\", \"cell\", \"cell\"]\nfill = true",
    ]
    /// Regular grid: the largest in its ratio with at most the budgeted number of configurations.
    pub struct Grid {
        /// Relative numbers of nodes per axis; by default those of the
        /// parametrization (4:4:1, spherical 1:1:2).
        ratio: Option<Ratio> = None;
        /// Node positions per axis; by default `start` on an axis that is warped towards the peak at
        /// its start, else `cell`.
        centring: Option<Vec<Centring>> = None;
        /// True to leave the ratio, an axis by 15 % or one step, for the nearest grid that fills the budget, so
        /// that grids of different coordinates have as many configurations.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        fill: bool = false;
    }
}

impl Grid {
    fn numbers(&self) -> Option<&[f64]> {
        match &self.ratio {
            Some(Ratio::Numbers(numbers)) => Some(numbers),
            _ => None,
        }
    }

    fn axes(&self, axes: &[Axis], shape: &[usize]) -> Vec<LatticeAxis> {
        let centring = |i: usize, axis: &Axis| match &self.centring {
            Some(list) => list[i],
            None => default_centring(axis),
        };
        let axes = axes.iter().zip(shape).enumerate();
        axes.map(|(i, (axis, &n))| LatticeAxis::new(axis, centring(i, axis), n))
            .collect()
    }

    /// The schedule of one shape, `None` if it has more than `budget` configurations.
    fn lay_out(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        shape: &[usize],
        budget: usize,
    ) -> Option<Schedule> {
        let axes = self.axes(parametrization.axes(), shape);
        let (poses, pose) = nodes(&**parametrization, &axes, budget)?;
        let unphysical = pose.iter().filter(|p| p.is_none()).count();
        let unphysical_share = unphysical as f64 / pose.len() as f64;
        let form = Arc::clone(parametrization);
        Some(Schedule {
            lattice: Some(Lattice { axes, pose }),
            ..Schedule::new(form, Self::KIND, poses, unphysical_share)
        })
    }
}

impl SampleSet for Grid {
    fn is_grid(&self) -> bool {
        true
    }

    fn is_random(&self) -> bool {
        false
    }

    fn tuned(&self, ratio: &[f64]) -> Option<Box<dyn SampleSet>> {
        let tuned = Self {
            ratio: Some(Ratio::Numbers(ratio.to_vec())),
            ..self.clone()
        };
        (self.ratio == Some(Ratio::Tuned)).then(|| Box::new(tuned) as _)
    }

    fn check(&self, axes: &[Axis]) -> Result<(), ParameterError> {
        check_ratio(self.numbers(), axes)?;
        let Some(list) = &self.centring else {
            return Ok(());
        };
        let refuse =
            |allowed: String| ParameterError::new("centring", format!("{list:?}"), allowed);
        if list.len() != axes.len() {
            return Err(refuse(format!("one entry per axis ({})", symbols(axes))));
        }
        // Half a cell short of one end only, an azimuth would not fold onto its own nodes.
        let radial = |axis: &&Axis| axis.kind == AxisKind::Radial;
        let mut entries = list.iter().zip(axes);
        if entries.any(|(centring, axis)| *centring == Centring::Start && !radial(&axis)) {
            let radial = symbols(axes.iter().filter(radial));
            return Err(refuse(format!("start for {radial} only")));
        }
        Ok(())
    }

    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, _seed: u64) -> Planned {
        self.check(form.axes())?;
        if self.ratio == Some(Ratio::Tuned) {
            let allowed = "numbers, or an experiment with [tuning], which finds them";
            return Err(ParameterError::new("ratio", format!("{TUNED:?}"), allowed).into());
        }
        let lay_out = |shape: &[usize]| self.lay_out(form, shape, budget);
        let ratio = in_numbers(self.numbers(), form.axes());
        let schedule = largest(form, &ratio, budget, Self::KIND, lay_out)?;
        Ok(match self.fill {
            true => filled(schedule, &ratio, budget, lay_out),
            false => schedule,
        })
    }
}

declare! {
    impl dyn SampleSet, "stratified": "one random point in each cell of a regular grid", ["", "ratio = [2, 2, 1]"]
    /// Jittered grid: one random point in each cell.
    pub struct Stratified {
        /// Relative numbers of cells per axis; by default those of the
        /// parametrization (4:4:1, spherical 1:1:2).
        ratio: Option<Vec<f64>> = None;
    }
}

impl Stratified {
    /// The schedule of one shape, `None` if it has more than `budget` configurations.
    fn jitter(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        shape: &[usize],
        random: &Random,
        budget: usize,
    ) -> Option<Schedule> {
        let axes = parametrization.axes();
        let mut poses = Vec::new();
        let mut cell = 0;
        each_node_while(shape, |index| {
            let jitter: [f64; 4] = random.point(cell);
            cell += 1;
            let mut u = [0.0; 4];
            for (d, (&i, &n)) in index.iter().zip(shape).enumerate() {
                u[d] = (i as f64 + jitter[d]) / n as f64;
            }
            poses.extend(place(&**parametrization, &from_unit(axes, &u)));
            poses.len() <= budget
        });
        if poses.len() > budget {
            return None;
        }
        let unphysical_share = 1.0 - poses.len() as f64 / cell as f64;
        let form = Arc::clone(parametrization);
        Some(Schedule::new(form, Self::KIND, poses, unphysical_share))
    }
}

impl SampleSet for Stratified {
    fn check(&self, axes: &[Axis]) -> Result<(), ParameterError> {
        check_ratio(self.ratio.as_deref(), axes)
    }

    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Planned {
        self.check(form.axes())?;
        let random = Random::new(seed);
        let ratio = in_numbers(self.ratio.as_deref(), form.axes());
        largest(form, &ratio, budget, Self::KIND, |shape| {
            self.jitter(form, shape, &random, budget)
        })
    }
}

/// The distinct configurations of a lattice in the order of its nodes, and for each node the one that
/// it names; `None` if there are more than `limit`. Depends on nothing but the axes: a file that
/// holds them holds the grid.
pub(super) fn nodes(
    parametrization: &dyn Parametrization,
    axes: &[LatticeAxis],
    limit: usize,
) -> Option<(Vec<Pose>, Vec<Option<u32>>)> {
    let shape: Vec<usize> = axes.iter().map(|a| a.n).collect();
    let count = shape.iter().product();
    // Most configurations are named by the coordinates of a node: a list by its number takes a tenth of the time and
    // memory of a table. The number of the configuration and 1.
    let mut named = vec![0_u32; count];
    let mut distinct = Distinct::new(parametrization.axes());
    let mut poses = Vec::new();
    let mut pose = Vec::with_capacity(count);
    each_node_while(&shape, |index| {
        let place = place(parametrization, &coords(axes, index));
        pose.push(place.map(|new| {
            let next = poses.len() as u32;
            let found = match node_at(axes, &new.coords, 0.5 / Distinct::STEPS) {
                Some(node) => {
                    let first = &mut named[node];
                    if *first == 0 {
                        *first = next + 1;
                    }
                    *first - 1
                }
                None => distinct.first(&new.coords, next),
            };
            if found == next {
                poses.push(new);
            }
            found
        }));
        poses.len() <= limit
    });
    (poses.len() <= limit).then_some((poses, pose))
}

/// A table of configurations, which recognises coordinates that name the same one.
pub(crate) struct Distinct {
    // The standard hasher takes most of the time of laying out a grid; no input is chosen to attack this map.
    seen: FxHashMap<[i64; 4], u32>,
    scale: [(f64, f64, bool); 4],
}

impl Distinct {
    /// Steps per axis: nodes of any grid that fits in memory are further apart, and rounding is
    /// a million times smaller.
    const STEPS: f64 = 1e9;
    /// Shifts the steps against the nodes, which sit at fractions of the range: rounding would
    /// separate two equal nodes half-way between steps (512 nodes do that). The golden ratio
    /// is as far from all fractions as a number can be.
    const SHIFT: f64 = 0.618_033_988_749_894_9;

    /// An empty table for coordinates along these axes.
    pub(crate) fn new(axes: &[Axis]) -> Self {
        let mut scale = [(0.0, 0.0, false); 4];
        for (s, axis) in scale.iter_mut().zip(axes) {
            let periodic = axis.kind == AxisKind::Periodic;
            *s = (axis.range[0], Self::STEPS / axis.length(), periodic);
        }
        Self {
            seen: FxHashMap::default(),
            scale,
        }
    }

    /// The number under which this configuration came first: `next` if it is new.
    pub(crate) fn first(&mut self, coords: &Coords, next: u32) -> u32 {
        let key = self.key(coords);
        *self.seen.entry(key).or_insert(next)
    }

    fn key(&self, coords: &Coords) -> [i64; 4] {
        std::array::from_fn(|d| {
            let (lo, scale, periodic) = self.scale[d];
            let key = ((coords[d] - lo) * scale + Self::SHIFT).floor() as i64;
            // The end of a circle is its start.
            let turn = Self::STEPS as i64;
            key - if periodic && key >= turn { turn } else { 0 }
        })
    }
}

/// Default positions of nodes. Where a warp crowds them towards the peak, one sits
/// on it. Where they are equally spaced a node on the peak would stand for its whole coarse cell,
/// and a lone spike is worse interpolated than missed.
fn default_centring(axis: &Axis) -> Centring {
    if axis.peak_at_start && axis.warp.is_some_and(|warp| warp.crowds_start()) {
        Centring::Start
    } else {
        Centring::Cell
    }
}

fn check_ratio(ratio: Option<&[f64]>, axes: &[Axis]) -> Result<(), ParameterError> {
    let Some(ratio) = ratio else { return Ok(()) };
    if ratio.len() == axes.len() && ratio.iter().all(|r| (1e-3..=1e3).contains(r)) {
        return Ok(());
    }
    let allowed = format!("a number in [0.001, 1000] per axis ({})", symbols(axes));
    Err(ParameterError::new("ratio", format!("{ratio:?}"), allowed))
}

fn symbols<'a>(axes: impl IntoIterator<Item = &'a Axis>) -> String {
    listed(axes.into_iter().map(|a| a.symbol))
}
