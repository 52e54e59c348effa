//! Names and order of choices: the best over all budgets first.

use crate::experiment::{Cell, Choice, Factor, Line, Metric, Ranking, Scope, are_named};
use crate::report::first_of_each;
use crate::statistics::EXACT;

/// A parametrization with its warps.
pub(super) fn sampling(choice: &Choice) -> String {
    match choice.warp.as_str() {
        "none" => choice.parametrization.clone(),
        warp => format!("{} {warp}", choice.parametrization),
    }
}

/// True of the metrics that a command prints; the others stand in `ranking.csv` and the report.
pub(super) fn is_printed(metric: &Metric) -> bool {
    *metric == Metric::Nrmse || metric.is_of_moments() && metric.is_of_all_views()
}

/// A metric and its measure, which `pairs` follows; moments have none.
pub(super) fn error_of(scope: &Scope, pairs: &str) -> String {
    match (scope.metric.name(), scope.measure.as_str()) {
        (metric, "") => metric.into(),
        (metric, measure) => format!("{metric}, {measure}{pairs}"),
    }
}

/// A reconstruction, with its coordinates where these are not those of the schedule.
pub(super) fn by(choice: &Choice) -> String {
    match are_named(&choice.coordinates) {
        false => choice.reconstruction.clone(),
        true => format!("{} in {}", choice.reconstruction, choice.coordinates),
    }
}

/// What a curve is of: a sampling, with its sample set where a report is about these.
pub(super) fn subject(factor: Factor, choice: &Choice) -> String {
    match factor {
        Factor::SampleSet => format!("{}, {}", sampling(choice), choice.sample_set),
        _ => sampling(choice),
    }
}

/// The cell of a line at allowance `a`, if it has errors of all materials.
pub(super) fn whole(line: &Line, a: usize) -> Option<&Cell> {
    line.cells[a].as_ref().filter(|c| c.place.is_some())
}

/// The cells of a line that have errors of all materials.
pub(super) fn wholes(line: &Line) -> impl Iterator<Item = &Cell> {
    (0..line.cells.len()).filter_map(|a| whole(line, a))
}

/// Positions of the allowances that lines are ranked over: those that every line has, or else those
/// that most lines have. Over others a line would gain by the hard allowances it lacks.
fn common(ranking: &Ranking) -> Vec<usize> {
    let allowances = ranking.lines.iter().map(|l| l.cells.len()).max();
    let count = |a: usize| ranking.lines.iter().filter(move |l| whole(l, a).is_some());
    let counts = (0..allowances.unwrap_or(0)).map(|a| count(a).count());
    let counts: Vec<usize> = counts.collect();
    let most = counts.iter().copied().max();
    let all = (0..counts.len()).filter(|a| Some(counts[*a]) == most);
    all.collect()
}

/// Mean log ratio of a choice's errors to the best ones, over some allowances. Infinite where it
/// lacks one.
fn distance(ranking: &Ranking, line: &Line, allowances: &[usize]) -> f64 {
    let ratio = |&a: &usize| {
        let means = ranking.lines.iter().filter_map(|l| Some(whole(l, a)?.mean));
        let best = means.fold(f64::INFINITY, f64::min).max(EXACT);
        Some((whole(line, a)?.mean / best).max(1.0).ln())
    };
    let ratios: Option<Vec<f64>> = allowances.iter().map(ratio).collect();
    ratios.map_or(f64::INFINITY, |r| r.iter().sum::<f64>() / r.len() as f64)
}

/// Lines of a ranking, the best first.
pub(super) fn sorted(ranking: &Ranking) -> Vec<&Line> {
    let common = common(ranking);
    let with = |l| (distance(ranking, l, &common), l);
    let mut lines: Vec<(f64, &Line)> = ranking.lines.iter().map(with).collect();
    // Stable: the order of the plan decides ties.
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    lines.into_iter().map(|(_, l)| l).collect()
}

/// Of the lines of a choice's [`subject`] the best at allowance `a`.
pub(super) fn best_at<'r>(
    ranking: &'r Ranking,
    factor: Factor,
    choice: &Choice,
    a: usize,
) -> Option<&'r Line> {
    let own = |l: &&Line| subject(factor, &l.choice) == subject(factor, choice);
    let known = ranking.lines.iter().filter(|l| whole(l, a).is_some());
    known.filter(own).min_by_key(|l| whole(l, a)?.place)
}

/// The best choice of each [`subject`] over all budgets, the best first: one reconstruction each, whatever
/// the budget. Choices with an error at every budget come before the others: a curve needs several
/// points.
pub(super) fn best_of_each(ranking: &Ranking, factor: Factor) -> Vec<&Line> {
    let mut lines = sorted(ranking);
    lines.sort_by_key(|l| std::cmp::Reverse(wholes(l).count()));
    let of = |line: &&Line| subject(factor, &line.choice);
    first_of_each(lines, |a, b| of(a) == of(b))
}
