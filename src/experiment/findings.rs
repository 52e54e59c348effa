//! Findings from rows: rankings, duels between levels of a factor, orders of convergence, and the share of the variance that
//! each factor explains. All is paired over materials; errors of several seeds are averaged first (geometrically).

mod calibration;
mod index;
mod levels;
mod metric;

pub use calibration::{Calibrated, Calibration};
pub use levels::{LevelLine, Levels, Needed};
pub use metric::Metric;

use index::{Index, Names};

use super::choices::{Choice, NONE};
use super::question::{Factor, ReportSpec};
use super::row::Row;
use crate::statistics::{
    Bootstrap, EXACT, Paired, PooledOrder, Shares, error_at, geometric_mean, median, order,
    pooled_order, variance_shares,
};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Seed of the bootstrap: the same rows give the same intervals.
const SEED: u64 = 1;

/// The rows a finding is about.
#[derive(Clone, Debug, PartialEq)]
pub struct Scope {
    /// Error metric.
    pub metric: Metric,
    /// Distribution of the test pairs; empty for an error of moments, which has none.
    pub measure: String,
    /// Truth class of the materials; `None`: all of them.
    pub truth: Option<String>,
    /// Materials that are compared.
    pub materials: usize,
    /// Materials that say nothing about which choice is better, and why: `lambert (exact by a choice)`.
    pub left_out: Vec<String>,
}

/// A choice of a ranking at every allowance.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The choice.
    pub choice: Choice,
    /// One cell per allowance; `None` where no material has an error.
    pub cells: Vec<Option<Cell>>,
    /// Slope of ln error on ln readings, over materials.
    pub order: Option<PooledOrder>,
}

/// A choice at an allowance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Geometric mean of the error over materials.
    pub mean: f64,
    /// Median of the error over materials.
    pub median: f64,
    /// Comparison with the best choice of this allowance, p adjusted; `None` of the best, and where materials are missing.
    pub against_best: Option<Paired>,
    /// Rank among the choices that have errors of all materials, from 1; `None` for the others.
    pub place: Option<usize>,
    /// Geometric mean of the readings.
    pub readings: f64,
    /// Geometric mean of the seconds of computing a material.
    pub seconds: Option<f64>,
    /// The geometric means of the ends of their ranges within the run; `None` if that of a material is not known.
    pub seconds_range: Option<[f64; 2]>,
    /// Geometric mean of the seconds of the instrument, where it has any.
    pub instrument_seconds: Option<f64>,
}

/// Every choice, in the order of the rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// The rows it is about.
    pub scope: Scope,
    /// One line per choice, in the order of the plan.
    pub lines: Vec<Line>,
}

/// One level of a factor against another, all else equal: where poses or readings were allowed, at the same readings.
/// The error of the side with more is interpolated to them, or else that of the other side to its number, if either can be.
#[derive(Clone, Debug, PartialEq)]
pub struct Duel {
    /// The first level's choice.
    pub a: Choice,
    /// The second level's choice.
    pub b: Choice,
    /// One comparison per allowance, p adjusted over them; ratios below 1: the first is better.
    pub cells: Vec<Option<Paired>>,
    /// Over all allowances, if there are several: geometric means of the materials that have an error at each.
    pub overall: Option<Paired>,
}

/// All duels of a scope.
#[derive(Clone, Debug, PartialEq)]
pub struct Duels {
    /// The rows they are about.
    pub scope: Scope,
    /// Pairs of choices, in the order of the plan.
    pub duels: Vec<Duel>,
}

/// The share of the variance of ln error that each factor explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained {
    /// The rows it is about.
    pub scope: Scope,
    /// True of reconstructions in chosen coordinates, false of those in the schedule's own.
    pub scattered: bool,
    /// Names of the factors.
    pub factors: Vec<&'static str>,
    /// Shares of the variance, 0 to 1.
    pub shares: Shares,
}

/// All findings from a set of rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// The column whose levels the duels compare.
    pub factor: Factor,
    /// The level that others are compared with.
    pub reference: Option<String>,
    /// The level that the verdict is about.
    pub challenger: Option<String>,
    /// The allowances, in the order of the plan.
    pub allowances: Vec<String>,
    /// Truth classes, each once.
    pub truths: Vec<String>,
    /// One ranking per metric, measure and truth class that has materials to compare, and one over all of them.
    pub rankings: Vec<Ranking>,
    /// The duels of each ranking.
    pub duels: Vec<Duels>,
    /// One per error of moments that has a level, and truth class, where numbers of poses or readings were allowed.
    pub levels: Vec<Levels>,
    /// One per metric and measure, and one more where there are scattered reconstructions.
    pub explained: Vec<Explained>,
    /// One per metric, measure and choice that expects errors.
    pub calibrations: Vec<Calibration>,
}

impl Findings {
    /// Findings that count ratios of errors below `band` (above 1) as none, and compare parametrizations with the first.
    pub fn new(rows: &[&Row], band: f64) -> Self {
        Self::asked(rows, band, &ReportSpec::default())
    }

    /// Findings on the factor, reference and challenger of `spec`.
    pub(crate) fn asked(rows: &[&Row], band: f64, spec: &ReportSpec) -> Self {
        let index = Index::new(rows);
        let mut levels = index.choices.list.iter().map(|c| spec.factor.level(c));
        let guided = levels.clone().find(|level| *level != NONE);
        let first = guided.or_else(|| levels.next()).map(str::to_owned);
        let mut findings = Self {
            factor: spec.factor,
            reference: spec.reference.clone().or(first),
            challenger: spec.challenger.clone(),
            allowances: strings(&index.allowances.list),
            truths: strings(&index.truths.list),
            calibrations: calibration::calibrations(&index),
            ..Self::default()
        };
        let truths = index.truths.list.len();
        // One truth is all of them.
        let each = (0..truths).filter(|_| truths > 1).map(Some);
        let scopes: Vec<Option<usize>> = std::iter::once(None).chain(each).collect();
        let mut tables = Vec::new();
        for metric in Metric::ALL.into_iter().filter(|m| m.is_asked(rows)) {
            let measures = index.measures.list.len();
            // Moments are the same for every measure.
            let distinct = if metric.is_of_moments() { 1 } else { measures };
            for measure in 0..distinct.min(measures) {
                tables.extend(scopes.iter().map(|&truth| (metric, measure, truth)));
            }
        }
        // The draws are the same for every table.
        let bootstrap = Bootstrap::new(SEED);
        let found: Vec<_> = tables
            .into_par_iter()
            .filter_map(|(metric, measure, truth)| {
                let of_truth = index.of_truth(truth);
                let (materials, left_out) = index.compared(metric, measure, &of_truth);
                if truth.is_some() && materials.is_empty() {
                    return None;
                }
                let measured = match metric.is_of_moments() {
                    true => "",
                    false => index.measures.list[measure],
                };
                let scope = Scope {
                    metric,
                    measure: measured.into(),
                    truth: truth.map(|t| index.truths.list[t].into()),
                    materials: materials.len(),
                    left_out,
                };
                let table = Table {
                    errors: index.each(measure, &materials, |at| {
                        index.mean(at, |r| metric.error(r))
                    }),
                    relative: index.each(measure, &materials, |at| {
                        index.average(at, |r| metric.relative_error(r))
                    }),
                    readings: index.each(measure, &materials, |at| {
                        index.mean(at, Row::counted_readings).unwrap_or(0.0)
                    }),
                    index: &index,
                    bootstrap: &bootstrap,
                    band,
                    measure,
                    materials,
                };
                let ranking = Ranking {
                    lines: table.lines(),
                    scope: scope.clone(),
                };
                let duels = Duels {
                    duels: table.duels(spec.factor),
                    scope: scope.clone(),
                };
                let kinds = [false, true].into_iter().filter(|_| truth.is_none());
                let explained = kinds.filter_map(|scattered| table.explained(&scope, scattered));
                let explained: Vec<_> = explained.collect();
                Some((ranking, duels, table.levels(metric, scope), explained))
            })
            .collect();
        for (ranking, duels, levels, explained) in found {
            findings.rankings.push(ranking);
            findings.duels.push(duels);
            findings.levels.extend(levels);
            findings.explained.extend(explained);
        }
        findings
    }

    /// The ranking of a scope.
    pub fn ranking(&self, metric: Metric, measure: &str, truth: Option<&str>) -> Option<&Ranking> {
        let is =
            |s: &Scope| s.metric == metric && s.measure == measure && s.truth.as_deref() == truth;
        self.rankings.iter().find(|r| is(&r.scope))
    }
}

fn strings(list: &[&str]) -> Vec<String> {
    list.iter().map(|s| (*s).to_owned()).collect()
}

/// Errors of one metric and measure over some materials.
struct Table<'i, 'a> {
    index: &'i Index<'a>,
    bootstrap: &'i Bootstrap,
    /// The largest ratio of errors that counts as no difference.
    band: f64,
    measure: usize,
    materials: Vec<usize>,
    /// By choice, allowance and position in `materials`: an error, and its standard error as a share of it.
    errors: Vec<Vec<Vec<Option<f64>>>>,
    relative: Vec<Vec<Vec<f64>>>,
    /// Readings in the same order; 0 where time was allowed.
    readings: Vec<Vec<Vec<f64>>>,
}

impl Table<'_, '_> {
    /// Errors at all materials, if all have one.
    fn whole(&self, choice: usize, allowance: usize) -> Option<Vec<f64>> {
        let errors: Option<Vec<f64>> = self.errors[choice][allowance].iter().copied().collect();
        errors.filter(|e| !e.is_empty())
    }

    /// Geometric mean of a number of the rows over the materials that have it.
    fn over(&self, [c, a]: [usize; 2], of: impl Fn(&Row) -> Option<f64>) -> Option<f64> {
        let at = |&m: &usize| self.index.mean([self.measure, c, a, m], &of);
        let values: Vec<f64> = self.materials.iter().filter_map(at).collect();
        geometric_mean(&values)
    }

    fn lines(&self) -> Vec<Line> {
        let choices = self.index.choices.list.iter().enumerate();
        let allowances = self.index.allowances.list.len();
        let lines = choices.map(|(c, choice)| Line {
            choice: choice.clone(),
            cells: (0..allowances).map(|a| self.cell(c, a)).collect(),
            order: self.order(c),
        });
        let mut lines: Vec<Line> = lines.collect();
        for a in 0..allowances {
            self.place(&mut lines, a);
        }
        lines
    }

    /// Readings until errors stay below the level of a metric, of every choice that has an error of each material at some allowance.
    fn levels(&self, metric: Metric, scope: Scope) -> Option<Levels> {
        let level = metric.level()?;
        let needed = |c: usize, m: usize| {
            // What has no error is above every level.
            let point = |a: usize| {
                let error = self.errors[c][a][m].unwrap_or(f64::INFINITY);
                (self.readings[c][a][m], error)
            };
            let points = (0..self.errors[c].len()).map(point);
            let points = points.filter(|(readings, _)| *readings > 0.0);
            Needed::until(level, points.collect())
        };
        let choices = self.index.choices.list.iter().enumerate();
        let lines = choices.filter_map(|(c, choice)| {
            let all = (0..self.materials.len()).map(|m| needed(c, m));
            LevelLine::new(choice.clone(), all.collect::<Option<_>>()?)
        });
        let lines: Vec<LevelLine> = lines.collect();
        (!lines.is_empty()).then_some(Levels {
            scope,
            level,
            lines,
        })
    }

    fn cell(&self, c: usize, a: usize) -> Option<Cell> {
        let errors: Vec<f64> = self.errors[c][a].iter().copied().flatten().collect();
        Some(Cell {
            mean: geometric_mean(&errors)?,
            median: median(&errors)?,
            against_best: None,
            place: None,
            readings: self.over([c, a], |r| Some(r.readings as f64))?,
            seconds: self.over([c, a], Row::seconds),
            seconds_range: self.seconds_range(c, a),
            instrument_seconds: self.over([c, a], |r| r.instrument_seconds),
        })
    }

    /// Ends of the ranges of the wall times, over the materials, which were timed together: one has no more to say than all.
    fn seconds_range(&self, c: usize, a: usize) -> Option<[f64; 2]> {
        let end = |end: usize| {
            let of = |&m: &usize| {
                let at = [self.measure, c, a, m];
                self.index.mean(at, |r| Some(r.seconds_range()?[end]))
            };
            let all: Option<Vec<f64>> = self.materials.iter().map(of).collect();
            geometric_mean(&all?)
        };
        Some([end(0)?, end(1)?])
    }

    /// Slopes of the materials, pooled.
    fn order(&self, c: usize) -> Option<PooledOrder> {
        let slope = |i: usize| {
            let points = (0..self.errors[c].len()).filter_map(|a| {
                let at = [self.measure, c, a, self.materials[i]];
                let readings = self.index.mean(at, |r| Some(r.readings as f64))?;
                Some((readings, self.errors[c][a][i]?))
            });
            order(&points.collect::<Vec<_>>()).map(|o| o.slope)
        };
        let slopes: Vec<f64> = (0..self.materials.len()).filter_map(slope).collect();
        pooled_order(&slopes, self.bootstrap)
    }

    /// Sets the places at an allowance, and compares every choice with the best.
    fn place(&self, lines: &mut [Line], a: usize) {
        let whole: Vec<Option<Vec<f64>>> = (0..lines.len()).map(|c| self.whole(c, a)).collect();
        let mut order: Vec<usize> = (0..lines.len()).filter(|&c| whole[c].is_some()).collect();
        let mean = |c: usize| lines[c].cells[a].map_or(f64::INFINITY, |cell| cell.mean);
        order.sort_by(|&x, &y| mean(x).total_cmp(&mean(y)).then(x.cmp(&y)));
        let Some((&best, others)) = order.split_first() else {
            return;
        };
        let Some(of_best) = &whole[best] else {
            return;
        };
        let compared = others.iter().map(|&c| {
            let both = whole[c].as_deref()?.iter().zip(of_best);
            self.paired([c, best], a, both.map(|(x, y)| Some((*x, *y))))
        });
        let compared = adjusted(&compared.collect::<Vec<_>>());
        for (i, &c) in order.iter().enumerate() {
            if let Some(cell) = &mut lines[c].cells[a] {
                cell.place = Some(i + 1);
                cell.against_best = i.checked_sub(1).and_then(|i| compared[i]);
            }
        }
    }

    /// Compares two choices at an allowance by their errors at each material, `None` where one has none.
    fn paired(
        &self,
        choices: [usize; 2],
        allowance: usize,
        errors: impl Iterator<Item = Option<(f64, f64)>>,
    ) -> Option<Paired> {
        let (mut pairs, mut known) = (Vec::new(), Vec::new());
        let [a, b] = choices.map(|c| &self.relative[c][allowance]);
        for (both, relative) in errors.zip(a.iter().copied().zip(b.iter().copied())) {
            if let Some(both) = both {
                pairs.push(both);
                known.push(relative);
            }
        }
        Some(Paired::new(&pairs, self.band, self.bootstrap)?.known_to(&known))
    }

    /// All pairs of choices that differ in the factor only; `b` is the earlier one.
    fn duels(&self, factor: Factor) -> Vec<Duel> {
        let choices = &self.index.choices.list;
        let mut duels = Vec::new();
        for (j, b) in choices.iter().enumerate() {
            for (i, a) in choices.iter().enumerate().skip(j + 1) {
                let alike = factor != Factor::Parametrization || self.index.alike(i, j);
                if !alike || !factor.alone_differs(a, b) {
                    continue;
                }
                let cells = (0..self.index.allowances.list.len()).map(|at| {
                    let both = (0..self.materials.len()).map(|m| self.alike([i, j], at, m));
                    self.paired([i, j], at, both)
                });
                duels.push(Duel {
                    a: a.clone(),
                    b: b.clone(),
                    cells: adjusted(&cells.collect::<Vec<_>>()),
                    overall: self.overall([i, j]),
                });
            }
        }
        duels
    }

    /// Errors of two choices at a material and an allowance, at equal readings.
    fn alike(&self, [i, j]: [usize; 2], at: usize, m: usize) -> Option<(f64, f64)> {
        let of = |c: usize| Some((self.readings[c][at][m], self.errors[c][at][m]?));
        let ((n, x), (k, y)) = (of(i)?, of(j)?);
        if n == k || n * k == 0.0 {
            return Some((x, y));
        }
        // Between this allowance and those beside it.
        let between = |c: usize, readings: f64| {
            let near = at.saturating_sub(1)..(at + 2).min(self.errors[c].len());
            let points = near.filter_map(|a| Some((self.readings[c][a][m], self.errors[c][a][m]?)));
            error_at(&points.collect::<Vec<_>>(), readings)
        };
        let (fewer, more) = (n.min(k), n.max(k));
        let both = [fewer, more].map(|to| Some((between(i, to)?, between(j, to)?)));
        both.into_iter().flatten().next().or(Some((x, y)))
    }

    /// Compares two choices by their mean errors over all allowances, at the materials that have them.
    fn overall(&self, choices: [usize; 2]) -> Option<Paired> {
        let allowances = self.index.allowances.list.len();
        if allowances < 2 {
            return None;
        }
        let known = |c: usize, m: usize| {
            let squares = (0..allowances).map(|a| self.relative[c][a][m].powi(2));
            squares.sum::<f64>().sqrt() / allowances as f64
        };
        let both = (0..self.materials.len()).filter_map(|m| {
            let errors = (0..allowances).map(|a| self.alike(choices, a, m));
            let (a, b): (Vec<f64>, Vec<f64>) =
                errors.collect::<Option<Vec<_>>>()?.into_iter().unzip();
            let [of_a, of_b] = choices.map(|c| known(c, m));
            Some(((geometric_mean(&a)?, geometric_mean(&b)?), (of_a, of_b)))
        });
        let (errors, known): (Vec<_>, Vec<_>) = both.unzip();
        Some(Paired::new(&errors, self.band, self.bootstrap)?.known_to(&known))
    }

    /// Shares of the variance, of the choices in their own coordinates or of the others.
    fn explained(&self, scope: &Scope, scattered: bool) -> Option<Explained> {
        let choices = &self.index.choices.list;
        let is_mine = |c: &usize| self.index.chosen(*c).is_some() == scattered;
        let mut samplings = Names::new();
        let mut methods = Names::new();
        let mut coordinates = Names::new();
        let mut rows: Vec<(Vec<usize>, f64)> = Vec::new();
        for c in (0..choices.len()).filter(is_mine) {
            let choice = &choices[c];
            let sampling = samplings.place(&choice.parametrization);
            let [set, instrument] = [&choice.sample_set, &choice.instrument];
            let method = methods.place([set, instrument, &choice.reconstruction]);
            let mut levels = vec![sampling, self.index.warp[c], method];
            if scattered {
                levels.push(coordinates.place(self.index.chosen(c)));
            }
            for (a, errors) in self.errors[c].iter().enumerate() {
                let known = errors.iter().enumerate();
                rows.extend(known.filter_map(|(m, error)| {
                    // As exact as rounding allows, see `geometric_mean`.
                    Some((
                        [&*levels, &[a, m]].concat(),
                        error.as_ref()?.max(EXACT).ln(),
                    ))
                }));
            }
        }
        let mut factors = vec!["parametrization", "warp", "reconstruction"];
        factors.extend(scattered.then_some("coordinates"));
        factors.extend(["budget", "material"]);
        let rows: Vec<(&[usize], f64)> = rows.iter().map(|(l, e)| (l.as_slice(), *e)).collect();
        Some(Explained {
            scope: scope.clone(),
            scattered,
            factors,
            shares: variance_shares(&rows)?,
        })
    }
}

/// Comparisons with p-values adjusted for their number; `None` stays `None`.
fn adjusted(list: &[Option<Paired>]) -> Vec<Option<Paired>> {
    let there: Vec<Paired> = list.iter().copied().flatten().collect();
    let mut adjusted = Paired::adjusted(&there).into_iter();
    let mut next = |p: &Option<Paired>| p.and_then(|_| adjusted.next());
    list.iter().map(&mut next).collect()
}
