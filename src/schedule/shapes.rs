//! How many nodes grids have along their axes: the largest shape in a ratio, and shapes near it that
//! fill the budget.

use super::Schedule;
use super::lattice::Lattice;
use super::sample_set::Planned;
use crate::geometry::Symmetry;
use crate::parametrization::{Axis, AxisKind, Parametrization};
use std::f64::consts::PI;
use std::sync::Arc;

/// The relative numbers of nodes: those asked for, or those of the axes.
pub(super) fn in_numbers(asked: Option<&[f64]>, axes: &[Axis]) -> Vec<f64> {
    asked.map_or_else(|| axes.iter().map(|a| a.density).collect(), <[f64]>::to_vec)
}

/// The largest shape in the given ratio whose schedule fits the budget: the next finer shape has
/// more poses than that.
pub(super) fn largest(
    parametrization: &Arc<dyn Parametrization>,
    ratio: &[f64],
    budget: usize,
    kind: &'static str,
    lay_out: impl Fn(&[usize]) -> Option<Schedule>,
) -> Planned {
    let mut shapes = Shapes::new(parametrization.axes(), parametrization.symmetry(), ratio);
    let mut fits: Option<Schedule> = None;
    // Shapes by number: those below `low` fit, `high` does not. Shapes with no more nodes than the
    // budget fit without a try; from there, the share of nodes that are poses predicts the rest,
    // and laying a shape out stops as soon as it is too large.
    let (mut low, mut high) = (0, usize::MAX);
    let mut guess = shapes.first_above(budget as f64).saturating_sub(1);
    while low < high {
        match lay_out(shapes.get(guess)) {
            Some(schedule) => {
                low = guess + 1;
                let poses = schedule.poses.len() as f64;
                // No shape has less than a hundredth: that only bounds the next step.
                let share = (poses / shapes.nodes(guess)).max(0.01);
                guess = shapes.first_above(budget as f64 / share).saturating_sub(1);
                fits = Some(schedule);
            }
            None => high = guess,
        }
        guess = guess.max(low);
        if guess >= high {
            guess = low + (high - low) / 2;
        }
    }
    match fits {
        Some(schedule) if !schedule.poses.is_empty() => Ok(schedule),
        _ => Schedule::chosen(parametrization, kind, budget, Vec::new(), 0.0),
    }
}

/// The grid nearest to the `ratio` that fills the budget to a hundredth, among shapes whose axes have at most
/// 15 %, or one step, more or fewer nodes than those of `first`; if none does, the fullest. Nearness is the
/// sum of the squared logarithms of what axes are off, of the first axis [`FIRST`] times: errors follow it
/// most. Where exchanging light and sensor exchanges axes they stay equal, or nodes would not be shared.
pub(super) fn filled(
    first: Schedule,
    ratio: &[f64],
    budget: usize,
    lay_out: impl Fn(&[usize]) -> Option<Schedule>,
) -> Schedule {
    let full = |schedule: &Schedule| schedule.poses.len() as f64 >= (1.0 - FULL) * budget as f64;
    let Some(base) = first.lattice.as_ref().map(Lattice::shape) else {
        return first;
    };
    let axes = first.parametrization.axes();
    // Axes that change together.
    let groups: Vec<Vec<usize>> = if first.parametrization.facts().exchange {
        let is_radial = |d: &usize| axes[*d].kind == AxisKind::Radial;
        let (radial, azimuths) = (0..base.len()).partition(is_radial);
        vec![radial, azimuths]
    } else {
        (0..base.len()).map(|d| vec![d]).collect()
    };
    let steps = steps(axes, first.parametrization.symmetry());
    let mut shapes = vec![base.clone()];
    for group in &groups {
        let (n, step) = (base[group[0]], steps[group[0]]);
        let reach = ((n as f64 * REACH / step as f64) as usize).max(1) * step;
        let lengths = (n.saturating_sub(reach).max(step)..=n + reach).step_by(step);
        let mut more = Vec::new();
        for (n, shape) in lengths.flat_map(|n| shapes.iter().map(move |shape| (n, shape))) {
            let mut shape = shape.clone();
            for &d in group {
                // An azimuth of a turn keeps its four times of one of a quarter.
                let scaled = (base[d] * n) as f64 / (base[group[0]] * steps[d]) as f64;
                shape[d] = (scaled.round() as usize).max(1) * steps[d];
            }
            more.push(shape);
        }
        shapes = more;
    }
    // The share of nodes that are configurations changes little between shapes, and predicts.
    let nodes = |shape: &[usize]| shape.iter().map(|&n| n as f64).product::<f64>();
    let wanted = budget as f64 * nodes(&base) / first.poses.len() as f64;
    let share = |shape: &[usize]| nodes(shape) / wanted;
    shapes.retain(|shape| share(shape) <= 1.0 + NEAR);
    let scale = (wanted / ratio.iter().product::<f64>()).powf(1.0 / ratio.len() as f64);
    let off = |shape: &[usize]| -> f64 {
        let axes = shape.iter().zip(ratio);
        let squares = axes.map(|(&n, r)| (n as f64 / (scale * r)).ln().powi(2));
        squares
            .zip([FIRST, 1.0, 1.0, 1.0])
            .map(|(s, w)| s * w)
            .sum()
    };
    shapes.sort_by(|a, b| off(a).total_cmp(&off(b)));
    let mut best = first;
    for shape in shapes {
        if full(&best) {
            break;
        }
        let may_hold_more = share(&shape) >= best.poses.len() as f64 / budget as f64 - NEAR;
        let other = may_hold_more.then(|| lay_out(&shape)).flatten();
        best = other
            .filter(|s| s.poses.len() > best.poses.len())
            .unwrap_or(best);
    }
    best
}

/// How much the first axis counts against each other one, in all coordinates alike: the ratio of two filled grids of
/// `configs/causes.toml` goes from budget to budget as the ratio of their nodes along it.
const FIRST: f64 = 4.0;
/// How far the axes of a grid that fills its budget may leave those of one that keeps its ratio.
const REACH: f64 = 0.15;
/// Share of a budget that a full grid may leave.
const FULL: f64 = 0.01;
/// How far off, as a share of the budget, the configurations of a shape are predicted at most.
const NEAR: f64 = 0.05;

/// The steps in which the numbers of nodes along axes grow.
fn steps(axes: &[Axis], symmetry: Symmetry) -> Vec<usize> {
    // A pole joins azimuth a with a + π: a full turn needs an even number of nodes for both
    // to be on the lattice. Where reciprocity leaves an azimuth its full turn beside one
    // folded to a quarter (spherical coordinates), it gets four nodes at a time, so that in
    // the default ratio the two stay in step: exchanging light and sensor then takes nodes
    // to nodes.
    let quarter = |a: &Axis| a.kind == AxisKind::Mirrored && a.length() < 0.6 * PI;
    let full = if symmetry.reciprocal && axes.iter().any(quarter) {
        4
    } else {
        2
    };
    let step = |a: &Axis| match a.kind {
        AxisKind::Periodic if a.length() > 1.5 * PI => full,
        _ => 1,
    };
    axes.iter().map(step).collect()
}

/// The growing sequence of shapes in a ratio: as a common scale grows, one axis after the other
/// gains a node.
struct Shapes {
    step: Vec<usize>,
    ratio: Vec<f64>,
    list: Vec<Vec<usize>>,
}

impl Shapes {
    fn new(axes: &[Axis], symmetry: Symmetry, ratio: &[f64]) -> Self {
        let step = steps(axes, symmetry);
        let first = step.clone();
        Self {
            step,
            ratio: ratio.to_vec(),
            list: vec![first],
        }
    }

    fn nodes(&mut self, number: usize) -> f64 {
        self.get(number).iter().map(|&n| n as f64).product()
    }

    /// Number of the first shape with more than `nodes` nodes.
    fn first_above(&mut self, nodes: f64) -> usize {
        let mut number = 0;
        while self.nodes(number) <= nodes {
            number += 1;
        }
        number
    }

    fn get(&mut self, number: usize) -> &[usize] {
        while self.list.len() <= number {
            let last = &self.list[self.list.len() - 1];
            let step = |d: usize| self.step[d];
            // The scale at which axis d, rounded to the nearest allowed number, gains its step.
            let scale = |d: usize| (last[d] as f64 + 0.5 * step(d) as f64) / self.ratio[d];
            let next = (0..last.len()).map(scale).fold(f64::INFINITY, f64::min);
            let shape = (0..last.len())
                .map(|d| {
                    if scale(d) <= next {
                        last[d] + step(d)
                    } else {
                        last[d]
                    }
                })
                .collect();
            self.list.push(shape);
        }
        &self.list[number]
    }
}
