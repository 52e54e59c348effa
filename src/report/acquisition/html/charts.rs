//! The diagrams of a report.

use super::super::findings::{Against, compared_at, level, method_beside};
use super::super::order::{best_at, best_of_each, error_of, is_printed, sampling, wholes};
use super::super::verdict::{Contest, number, of_all, said};
use super::figure::chart;
use super::materials::Material;
use super::scope_title;
use crate::error::count;
use crate::experiment::{Calibration, Cell, Choice, Factor, Findings, Line, NONE, Ranking};
use crate::report::svg::plot::{
    Axis, Forest, ForestGroup, ForestLine, Mark, Panel, Point, Series, color_of,
};
use crate::report::svg::{forest_svg, labelled, svg};
use crate::report::{TIMES, each_once, grouped};
use crate::statistics::{BAND, Paired, is_exact};
use maud::{Markup, html};

/// The most lines of a diagram.
const LINES: usize = 8;

/// A cost as the horizontal axis of a diagram.
struct Cost {
    title: &'static str,
    label: &'static str,
    of: fn(&Cell) -> Option<f64>,
    /// Its range within the run, where it has one.
    range: fn(&Cell) -> Option<[f64; 2]>,
}

const READINGS: Cost = Cost {
    title: "against readings",
    label: "readings",
    of: |c| Some(c.readings),
    range: |_| None,
};

const INSTRUMENT: Cost = Cost {
    title: "against the instrument",
    label: "minutes of the instrument",
    of: |c| c.instrument_seconds.map(|s| s / 60.0),
    range: |_| None,
};

const COMPUTING: Cost = Cost {
    title: "against computing",
    label: "seconds of computing a material",
    of: |c| c.seconds,
    range: |c| c.seconds_range,
};

/// Of each sampling the best at each budget.
fn best_of_each_budget(ranking: &Ranking, factor: Factor) -> Vec<Line> {
    let mut least: Vec<Line> = best_of_each(ranking, factor).into_iter().cloned().collect();
    for line in &mut least {
        let best = |a| {
            let best = best_at(ranking, factor, &line.choice, a);
            best.unwrap_or(line).cells[a]
        };
        line.cells = (0..line.cells.len()).map(best).collect();
    }
    least
}

/// The chart of the verdict: the error of every sampling by its best reconstruction of each budget against readings, with the
/// interval of the ratio of the pair where the challenger is among these. `None` of fewer than two budgets.
pub(super) fn decisive(
    findings: &Findings,
    ranking: &Ranking,
    contest: Option<&Contest>,
    looks: &Looks,
) -> Option<Markup> {
    let best = |line: &Line, a: usize| best_at(ranking, looks.factor, &line.choice, a);
    let least = best_of_each_budget(ranking, looks.factor);
    let lines: Vec<&Line> = least.iter().collect();
    let by = |line: &Line| {
        let allowances = findings.allowances.iter().enumerate();
        let groups = grouped(allowances.filter_map(|(a, at)| {
            let method = method_beside(&best(line, a)?.choice, findings);
            Some((method, at.as_str()))
        }));
        let each = groups.iter().map(|(by, at)| match groups.len() {
            1 => by.clone(),
            _ => format!("{by} at {}", at.join(", ")),
        });
        each.collect::<Vec<_>>().join(" and ")
    };
    let mut panel = panel(ranking, &lines, &READINGS, looks);
    let scope = &ranking.scope;
    panel.title = format!("{} against readings", scope.metric.name());
    let by = lines.iter().map(|l| (by(l), looks.name(&l.choice)));
    let mut caption = format!(
        "Geometric mean over {}, {} pairs. Each point is the best at its budget. {}",
        count(scope.materials, "material"),
        scope.measure,
        named_by(by.filter(|(by, _)| !by.is_empty()))
    );
    let mut label = format!("{}: error against readings", scope_title(scope));
    if let Some(contest) = contest {
        let [x, y] = contest.pair.each_ref().map(|c| level(findings, c));
        // What a report compares but samplings is not among their best reconstructions.
        let is_of_samplings = matches!(
            findings.factor,
            Factor::Parametrization | Factor::Warp | Factor::SampleSet
        );
        let own = |choice: &Choice| ranking.lines.iter().find(|l| l.choice == *choice);
        for choice in contest.pair.iter().filter(|_| !is_of_samplings) {
            if let Some(line) = own(choice).filter(|l| lines.iter().all(|o| o.cells != l.cells)) {
                let mut series = looks.series(choice, course(line, READINGS.of));
                (series.name, series.mark) = (level(findings, choice), Mark::DashDotted);
                panel.series.push(series);
            }
        }
        let challenger = |a: usize| {
            let line = own(&contest.pair[0])?;
            best(line, a).filter(|l| *l == line)?.cells[a].as_ref()
        };
        let mut ends = [Vec::new(), Vec::new()];
        let cells = contest.cells.iter().enumerate();
        let cells = cells.map(|(a, ratio)| challenger(a).zip(ratio.as_ref()));
        // A tint has no gaps: where another reconstruction is the best of the challenger's curve, it ends.
        for (cell, ratio) in cells.skip_while(Option::is_none).map_while(|cell| cell) {
            for (side, end) in ends.iter_mut().zip(ratio.interval.into_iter().flatten()) {
                side.push((cell.readings, Some(cell.mean * end / ratio.ratio)));
            }
        }
        let [low, high] = ends;
        if low.len() > 1 {
            let color = color_of(&contest.pair[0].parametrization);
            let corners = low.into_iter().chain(high.into_iter().rev());
            let area = Series::new("", color, Mark::Area, corners);
            panel.series.insert(0, area);
            caption += &format!(
                " Tinted: the 95 % interval of the ratio of {x} to {y}, about the line of the first."
            );
        }
        label = format!("{label}, {x} and {y} among them");
    }
    curve(&panel, &label, &caption)
}

/// Error against what it costs, of all truths together; wall times are a picture apart.
pub(super) fn curves(findings: &Findings, looks: &Looks) -> Option<Markup> {
    let mut parts = Vec::new();
    for cost in [&READINGS, &INSTRUMENT] {
        let mut charts = Vec::new();
        // The first against readings is that of the verdict.
        let rankings = of_all(findings).into_iter();
        for ranking in rankings.skip(usize::from(cost.title == READINGS.title)) {
            let mut lines = best_of_each(ranking, looks.factor);
            lines.truncate(LINES);
            let panel = panel(ranking, &lines, cost, looks);
            let label = format!("{} {}", scope_title(&ranking.scope), cost.title);
            let lines = lines.iter();
            let by = lines.map(|l| (method_beside(&l.choice, findings), looks.name(&l.choice)));
            charts.extend(curve(&panel, &label, &named_by(by)));
        }
        if !charts.is_empty() {
            parts.push((cost.title, charts));
        }
    }
    (!parts.is_empty()).then(|| {
        html! {
            p {
                "Of each sampling the one reconstruction that is best over all budgets, which stands below; "
                "its points go from the smallest budget to the largest. A colour is "
                (looks.colour()) ", in all diagrams. Dashed: without a warp where there is one with it too."
            }
            @for (title, charts) in &parts {
                h3 { "Error " (title) }
                div.panels { @for chart in charts { (chart) } }
            }
            h3 { "Error " (COMPUTING.title) }
            p {
                "Wall times depend on the machine: they are in timings.jsonl, and " a href=(TIMES) { (TIMES) }
                " is their picture, beside this page. Across a point: the least and the most its steps took where they were repeated; another run may differ by more."
            }
            figure { img alt="nrmse against seconds of computing a material" src=(TIMES); }
        }
    })
}

/// True over expected errors against readings, a diagram for each metric and measure.
pub(super) fn calibrated(findings: &Findings, looks: &Looks) -> Vec<Markup> {
    let mut charts = Vec::new();
    let all = &findings.calibrations;
    for lines in all.chunk_by(Calibration::is_of_same_error) {
        let (metric, measure) = (lines[0].metric.name(), &lines[0].measure);
        let mut series = Vec::new();
        for (color, line) in lines.iter().take(LINES).enumerate() {
            let cells = || line.cells.iter().flatten();
            let mut name = looks.name(&line.choice);
            let method = |line: &Calibration| method_beside(&line.choice, findings);
            if lines.iter().any(|l| method(l) != method(line)) {
                name = format!("{name}, {}", method(line));
            }
            let medians = cells().map(|c| (c.readings, Some(c.median)));
            series.push(Series::new(name, color, Mark::Line, medians));
            let ninths = cells().filter_map(|c| Some((c.readings, Some(c.ninth?))));
            series.push(Series::new("", color, Mark::Dotted, ninths));
        }
        let title = format!("{metric} over expected, {measure} pairs");
        let axes = [READINGS.label, "true over expected error"].map(Axis::log);
        let panel = Panel::new(title, axes, series);
        let label = format!("{metric} over what was expected, {measure} pairs, against readings");
        let caption = "Lines: the median over materials. Dots: 90 % of materials are below.";
        charts.extend(curve(&panel, &label, caption));
    }
    charts
}

/// A diagram whose lines carry their names; `None` without a line: one point is no curve.
fn curve(panel: &Panel, label: &str, caption: &str) -> Option<Markup> {
    let is_curved = panel.series.iter().any(|s| s.points.len() > 1);
    is_curved.then(|| chart(&labelled(panel), label, caption))
}

/// Reconstructions and the lines that they are of, as a caption.
fn named_by(lines: impl IntoIterator<Item = (String, String)>) -> String {
    let groups = grouped(lines);
    if let [(by, _)] = &groups[..] {
        return format!("All by {by}.");
    }
    let groups = groups.iter();
    let texts = groups.map(|(by, names)| format!("{}: by {by}", names.join(" · ")));
    texts.collect::<Vec<_>>().join("; ") + "."
}

/// The curves of `nrmse` against readings and minutes of the instrument as an SVG file: a row per cost, a column per measure.
pub fn study_curves(findings: &Findings) -> String {
    sheet(findings, &[READINGS, INSTRUMENT])
}

/// The curves of `nrmse` against wall times as an SVG file, a column per measure.
pub fn study_timings(findings: &Findings) -> String {
    sheet(findings, &[COMPUTING])
}

fn sheet(findings: &Findings, costs: &[Cost]) -> String {
    let looks = Looks::new(findings);
    let rankings = of_all(findings);
    let printed = rankings.iter().filter(|r| is_printed(&r.scope.metric));
    let (of_moments, of_pairs): (Vec<&Ranking>, Vec<&Ranking>) =
        printed.partition(|r| r.scope.metric.is_of_moments());
    let mut panels = Vec::new();
    for cost in costs {
        let panel = |r: &&Ranking| {
            let mut named = best_of_each(r, looks.factor);
            named.truncate(LINES);
            let mut panel = panel(r, &named, cost, &looks);
            for series in &mut panel.series {
                let own = |l: &&&Line| looks.name(&l.choice) == series.name;
                if let Some(line) = named.iter().find(own) {
                    series.name += &format!(", by {}", method_beside(&line.choice, findings));
                }
            }
            panel
        };
        let row: Vec<Panel> = of_pairs.iter().map(panel).collect();
        if row.iter().any(|p| !p.series.is_empty()) {
            panels.extend(row);
        }
    }
    let shows_moments = costs.iter().any(|cost| cost.label == READINGS.label);
    for ranking in of_moments.iter().filter(|_| shows_moments) {
        let lines = best_of_each_budget(ranking, looks.factor);
        let lines: Vec<&Line> = lines.iter().take(LINES).collect();
        panels.push(panel(ranking, &lines, &READINGS, &looks));
    }
    let materials = rankings.first().map_or(0, |r| r.scope.materials);
    let of = count(materials, "material");
    let has_range = |p: &Panel| p.series.iter().any(|s| s.name.is_empty());
    let note = match panels.iter().any(has_range) {
        true => "\nacross a point: the least and the most its steps took",
        false => "",
    };
    let by = match shows_moments && !of_moments.is_empty() {
        true => ", of moments by the best of each budget",
        false => "",
    };
    let title = format!("Error of each sampling by its best reconstruction{by}, {of}{note}");
    let least = if by.is_empty() { 1 } else { 2 };
    svg(&title, &panels, of_pairs.len().max(least))
}

/// The curves of some lines of a ranking.
fn panel(ranking: &Ranking, lines: &[&Line], cost: &Cost, looks: &Looks) -> Panel {
    let series = lines.iter().flat_map(|line| {
        let curve = looks.series(&line.choice, course(line, cost.of));
        let ranges = Series::new("", curve.color, Mark::Line, ranges(line, cost));
        [ranges, curve]
    });
    let scope = &ranking.scope;
    Panel::new(
        error_of(scope, " pairs"),
        [cost.label, scope.metric.name()].map(Axis::log),
        series.filter(|s| !s.points.is_empty()),
    )
}

/// Points of a line at a cost, where it has errors of all materials: means over fewer are others.
fn course(line: &Line, cost: fn(&Cell) -> Option<f64>) -> Vec<Point> {
    let points = wholes(line).filter_map(|c| Some((cost(c)?, Some(c.mean))));
    points.collect()
}

/// Lines across the points of a curve, over the ranges of their costs where these are known.
fn ranges(line: &Line, cost: &Cost) -> Vec<Point> {
    let each = wholes(line).filter_map(|c| Some(((cost.range)(c)?, c.mean)));
    let ends = each.flat_map(|([low, high], y)| [(low, Some(y)), (high, Some(y)), (high, None)]);
    ends.collect()
}

/// Colours and strokes of curves: a colour per parametrization, a stroke per warp; where a report is about sample
/// sets a colour per set. Equal in all diagrams of a report.
pub(super) struct Looks {
    factor: Factor,
    sets: Vec<String>,
    samplings: Vec<(String, String)>,
}

impl Looks {
    pub(super) fn new(findings: &Findings) -> Self {
        let lines = || findings.rankings.iter().flat_map(|r| &r.lines);
        let choices = || lines().map(|line| line.choice.clone());
        Self {
            factor: findings.factor,
            sets: each_once(choices().map(|c| c.sample_set)),
            samplings: each_once(choices().map(|c| (c.parametrization, c.warp))),
        }
    }

    /// What has a colour of its own.
    fn colour(&self) -> &'static str {
        match self.factor {
            Factor::SampleSet => "a sample set",
            _ => "a parametrization",
        }
    }

    /// Name of a choice's sampling.
    fn name(&self, choice: &Choice) -> String {
        self.series(choice, Vec::new()).name
    }

    /// Name, colour and stroke of a choice's sampling.
    fn series(&self, choice: &Choice, points: Vec<Point>) -> Series {
        let own = |s: &&(String, String)| s.0 == choice.parametrization;
        let siblings: Vec<&(String, String)> = self.samplings.iter().filter(own).collect();
        let warps = siblings.iter().filter(|s| s.1 != "none");
        let place = warps.clone().position(|s| s.1 == choice.warp);
        let name = match (choice.warp.as_str(), warps.count()) {
            ("none", _) if choice.parametrization == NONE => {
                format!("none ({})", choice.sample_set)
            }
            ("none", _) => choice.parametrization.clone(),
            (_, 1) => format!("{}, warped", choice.parametrization),
            _ => sampling(choice),
        };
        let mark = match (choice.warp.as_str(), place) {
            ("none", _) if siblings.len() > 1 => Mark::Dashed,
            ("none", _) => Mark::Line,
            (_, place) => {
                [Mark::Line, Mark::Dotted, Mark::DashDotted][place.unwrap_or_default() % 3]
            }
        };
        let set = self.sets.iter().position(|s| *s == choice.sample_set);
        let (name, color) = match (self.factor, self.samplings.len()) {
            (Factor::SampleSet, 1) => (choice.sample_set.clone(), set.unwrap_or(0)),
            (Factor::SampleSet, _) => (format!("{name}, {}", choice.sample_set), set.unwrap_or(0)),
            _ => (name, color_of(&choice.parametrization)),
        };
        Series::new(name, color, mark, points)
    }
}

/// Ratios and intervals of every sampling.
pub(super) fn forest(
    rows: &[Against],
    findings: &Findings,
    looks: &Looks,
    label: &str,
    title: &str,
) -> Option<Markup> {
    let cells = || rows.iter().flat_map(|r| r.cells.iter().flatten());
    let line = |(cell, at): (&Option<Paired>, String)| {
        let cell = cell.as_ref()?;
        Some(ForestLine {
            name: at,
            ratio: cell.ratio,
            interval: cell.interval,
            note: format!("{}  {}", number(cell.ratio), said(cell)),
        })
    };
    let groups = rows.iter().map(|row| {
        let Series { color, mark, .. } = looks.series(&row.choice, Vec::new());
        let lines = row.cells.iter().zip(compared_at(findings));
        ForestGroup {
            name: row.name.clone(),
            color,
            mark,
            lines: lines.filter_map(line).collect(),
        }
    });
    let forest = Forest {
        label: label.into(),
        band: cells().map(|c| c.band).fold(BAND, f64::max),
        groups: groups.filter(|g| !g.lines.is_empty()).collect(),
    };
    let label = format!("{title}: {label}");
    (!forest.groups.is_empty()).then(|| chart(&forest_svg(&forest), &label, ""))
}

/// The curves of a material, one diagram per measure.
pub(super) fn of_material(material: &Material, looks: &Looks) -> Option<Markup> {
    let mut charts = Vec::new();
    for measure in &material.measures {
        let mut by = Vec::new();
        let series = measure.lines.iter().take(LINES).map(|line| {
            let inexact = line.course.iter().filter(|b| !is_exact(b.error));
            let points = inexact.map(|b| (b.readings, Some(b.error)));
            let series = looks.series(&line.choice, points.collect());
            let method = line.course.first().map(|b| b.method.clone());
            by.extend(method.map(|method| (method, series.name.clone())));
            series
        });
        let title = format!("nrmse, {} pairs", measure.name);
        let panel = Panel::new(title, ["readings", "nrmse"].map(Axis::log), series);
        let (of, measure) = (&material.name, &measure.name);
        let label = format!("{of}: nrmse against readings, {measure}");
        charts.extend(curve(&panel, &label, &named_by(by)));
    }
    (!charts.is_empty()).then(|| html! { div.panels { @for c in &charts { (c) } } })
}
