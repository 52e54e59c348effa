//! The rows of a study, indexed by measure, choice, allowance and material.

use super::super::choices::{Choice, are_named};
use super::super::row::Row;
use super::metric::Metric;
use crate::statistics::{compares, geometric_mean};
use std::collections::HashMap;

/// Names in the order of their first appearance.
pub(super) struct Names<T> {
    pub list: Vec<T>,
    places: HashMap<T, usize>,
}

impl<T: Clone + Eq + std::hash::Hash> Names<T> {
    pub(crate) fn new() -> Self {
        Self {
            list: Vec::new(),
            places: HashMap::new(),
        }
    }

    pub(crate) fn place(&mut self, name: T) -> usize {
        let next = self.list.len();
        let list = &mut self.list;
        *self.places.entry(name.clone()).or_insert_with(|| {
            list.push(name);
            next
        })
    }
}

/// Rows with the distinct names of their columns.
pub(super) struct Index<'a> {
    pub choices: Names<Choice>,
    pub allowances: Names<&'a str>,
    pub materials: Names<&'a str>,
    pub measures: Names<&'a str>,
    pub truths: Names<&'a str>,
    /// Truth class of each material: a position in `truths`.
    truth_of: Vec<usize>,
    /// Rows of several seeds by measure, choice, allowance, material.
    rows: HashMap<[usize; 4], Vec<&'a Row>>,
    /// One position per choice: of its warps among those of its parametrization.
    pub warp: Vec<usize>,
}

impl<'a> Index<'a> {
    pub(crate) fn new(rows: &[&'a Row]) -> Self {
        let mut index = Self {
            choices: Names::new(),
            allowances: Names::new(),
            materials: Names::new(),
            measures: Names::new(),
            truths: Names::new(),
            truth_of: Vec::new(),
            rows: HashMap::new(),
            warp: Vec::new(),
        };
        for row in rows {
            let truth = index.truths.place(&row.truth);
            let material = index.materials.place(&row.material);
            if material == index.truth_of.len() {
                index.truth_of.push(truth);
            }
            let at = [
                index.measures.place(&row.measure),
                index.choices.place(row.choice()),
                index.allowances.place(&row.allowed),
                material,
            ];
            index.rows.entry(at).or_default().push(row);
        }
        let mut warps: HashMap<&str, Vec<&str>> = HashMap::new();
        for choice in &index.choices.list {
            let list = warps.entry(&choice.parametrization).or_default();
            if !list.contains(&choice.warp.as_str()) {
                list.push(&choice.warp);
            }
            let place = list.iter().position(|w| *w == choice.warp);
            index.warp.push(place.unwrap_or_default());
        }
        index
    }

    /// Label of the coordinates of a reconstruction; `None` of one that only ever works in those of the schedule.
    pub fn chosen(&self, c: usize) -> Option<String> {
        let choice = &self.choices.list[c];
        let mut others = self.choices.list.iter();
        let given =
            others.any(|o| o.reconstruction == choice.reconstruction && are_named(&o.coordinates));
        given.then(|| choice.worked_in())
    }

    /// True if two choices are warped alike: at the same place of the warps of their parametrizations, or at the last there is.
    pub(crate) fn alike(&self, a: usize, b: usize) -> bool {
        let (x, y) = (self.warp[a], self.warp[b]);
        let last = |c: usize| {
            let name = &self.choices.list[c].parametrization;
            let mine = self.choices.list.iter().zip(&self.warp);
            let mine = mine.filter(|(choice, _)| choice.parametrization == *name);
            mine.map(|(_, w)| *w).max().unwrap_or_default()
        };
        x == y || (x > last(b) && y == last(b)) || (y > last(a) && x == last(a))
    }

    /// Positions of the materials of a truth class; `None`: of all materials.
    pub(crate) fn of_truth(&self, truth: Option<usize>) -> Vec<usize> {
        let all = 0..self.materials.list.len();
        all.filter(|&m| truth.is_none_or(|t| self.truth_of[m] == t))
            .collect()
    }

    /// The materials by which choices differ, and the others with the reason: where a choice is exact, rounding would decide.
    pub(crate) fn compared(
        &self,
        metric: Metric,
        measure: usize,
        materials: &[usize],
    ) -> (Vec<usize>, Vec<String>) {
        let (mut kept, mut left_out) = (Vec::new(), Vec::new());
        for &m in materials {
            let is_mine = |at: &[usize; 4]| at[0] == measure && at[3] == m;
            let mine = self.rows.iter().filter(|(at, _)| is_mine(at));
            let mine = mine.flat_map(|(_, rows)| rows);
            let errors: Vec<f64> = mine.filter_map(|r| metric.error(r)).collect();
            let is_empty = errors.is_empty();
            if compares(errors) {
                kept.push(m);
                continue;
            }
            let reason = match is_empty {
                true => "no error is defined",
                false => "exact by a choice",
            };
            left_out.push(format!("{} ({reason})", self.materials.list[m]));
        }
        (kept, left_out)
    }

    /// A value by choice, allowance and position in `materials`.
    pub(crate) fn each<T>(
        &self,
        measure: usize,
        materials: &[usize],
        of: impl Fn([usize; 4]) -> T,
    ) -> Vec<Vec<Vec<T>>> {
        let at = |c, a| materials.iter().map(|&m| of([measure, c, a, m])).collect();
        let allowances = 0..self.allowances.list.len();
        let of_choice = |c| allowances.clone().map(|a| at(c, a)).collect();
        (0..self.choices.list.len()).map(of_choice).collect()
    }

    /// The arithmetic mean over seeds of a number of the rows; 0 of none.
    pub(crate) fn average(&self, at: [usize; 4], of: impl Fn(&Row) -> f64) -> f64 {
        let rows = self.rows.get(&at).map_or(&[][..], Vec::as_slice);
        rows.iter().map(|r| of(r)).sum::<f64>() / rows.len().max(1) as f64
    }

    /// The geometric mean over seeds of a number of the rows; `None` where it is not defined.
    pub(crate) fn mean(&self, at: [usize; 4], of: impl Fn(&Row) -> Option<f64>) -> Option<f64> {
        let rows = self.rows.get(&at)?;
        let values: Option<Vec<f64>> = rows.iter().map(|r| of(r)).collect();
        geometric_mean(&values?)
    }
}
