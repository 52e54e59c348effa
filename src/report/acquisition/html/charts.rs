//! The diagrams of a report.

use super::super::findings::{Against, materials, method, sampling};
use super::figure::chart;
use super::materials::Material;
use super::verdict::number;
use super::{scope_title, sorted};
use crate::error::Error;
use crate::experiment::{Cell, Choice, Findings, Line, Metric, Ranking};
use crate::report::svg::plot::{Axis, Forest, ForestGroup, ForestLine, Mark, Panel, Scale, Series};
use crate::report::svg::{forest_svg, labelled, svg};
use crate::statistics::BAND;
use maud::{Markup, html};

/// The most lines of a diagram.
const LINES: usize = 8;

fn log(label: &str) -> Axis {
    Axis {
        label: label.into(),
        scale: Scale::Log,
        range: None,
    }
}

/// A cost as the horizontal axis of a diagram.
struct Cost {
    title: &'static str,
    label: &'static str,
    of: fn(&Cell) -> Option<f64>,
}

const COSTS: [Cost; 3] = [
    Cost {
        title: "against readings",
        label: "readings",
        of: |c| Some(c.readings),
    },
    Cost {
        title: "against computing",
        label: "seconds of computing a material",
        of: |c| Some(c.seconds),
    },
    Cost {
        title: "against the instrument",
        label: "minutes of the instrument",
        of: |c| c.instrument_seconds.map(|s| s / 60.0),
    },
];

/// Error against what it costs, of all truths together.
pub(super) fn curves(findings: &Findings) -> Result<Option<Markup>, Error> {
    let mut parts = Vec::new();
    for cost in &COSTS {
        let mut charts = Vec::new();
        let all = findings.rankings.iter();
        for ranking in all.filter(|r| r.scope.truth.is_none()) {
            let panel = panel(ranking, cost);
            let points = panel.series.iter().map(|s| s.points.len()).max();
            // One point is no curve.
            if points.is_some_and(|n| n > 1) {
                let label = format!("{} {}", scope_title(&ranking.scope), cost.title);
                charts.push(chart(&labelled(&panel)?, &label, ""));
            }
        }
        if !charts.is_empty() {
            parts.push((cost.title, charts));
        }
    }
    let first = findings
        .rankings
        .iter()
        .find(|r| r.scope.metric == Metric::Nrmse);
    Ok((!parts.is_empty()).then(|| {
        html! {
            p {
                "The best reconstruction of each sampling, joined from the smallest budget to the "
                "largest. Dashed: without a warp where there is one with it too."
                @if let Some(ranking) = first {
                    " By " (ranking.scope.metric.name()) ", " (ranking.scope.measure) " pairs: "
                    @for (i, line) in best_of_each(ranking).iter().take(LINES).enumerate() {
                        @if i > 0 { "; " }
                        (sampling(&line.choice)) " with " (method(&line.choice, findings))
                    }
                    "."
                }
            }
            @for (title, charts) in &parts {
                h3 { "Error " (title) }
                div.panels { @for chart in charts { (chart) } }
            }
        }
    }))
}

/// The curves of `nrmse` as an SVG file: a row per cost, a column per measure.
pub fn sheet(findings: &Findings) -> Result<String, Error> {
    let of_all = |r: &&Ranking| r.scope.truth.is_none() && r.scope.metric == Metric::Nrmse;
    let rankings: Vec<&Ranking> = findings.rankings.iter().filter(of_all).collect();
    let mut panels = Vec::new();
    for cost in &COSTS {
        let row: Vec<Panel> = rankings.iter().map(|r| panel(r, cost)).collect();
        if row.iter().any(|p| !p.series.is_empty()) {
            panels.extend(row);
        }
    }
    let of = materials(rankings.first().map_or(0, |r| r.scope.materials));
    let title = format!("Error of the best reconstruction of each sampling, {of}");
    svg(&title, &panels, rankings.len().max(1))
}

fn panel(ranking: &Ranking, cost: &Cost) -> Panel {
    let lines = best_of_each(ranking);
    let looks = Looks::new(ranking.lines.iter().map(|l| &l.choice));
    let series = lines.into_iter().take(LINES).map(|line| {
        let cells = line.cells.iter().flatten();
        let points = cells.filter_map(|c| Some(((cost.of)(c)?, Some(c.mean))));
        looks.series(&line.choice, points.collect())
    });
    let scope = &ranking.scope;
    Panel {
        title: format!("{}, {} pairs", scope.metric.name(), scope.measure),
        x: log(cost.label),
        y: log(scope.metric.name()),
        series: series.filter(|s| !s.points.is_empty()).collect(),
    }
}

/// The best choice of each sampling, the best first. Choices with an error at every allowance come
/// before the others: a curve needs several points.
fn best_of_each(ranking: &Ranking) -> Vec<&Line> {
    let count = |line: &Line| line.cells.iter().flatten().count();
    let lines = sorted(ranking);
    let most = lines.iter().map(|l| count(l)).max();
    let (whole, part): (Vec<&Line>, Vec<&Line>) =
        lines.into_iter().partition(|l| Some(count(l)) == most);
    let mut best: Vec<&Line> = Vec::new();
    for line in whole.into_iter().chain(part) {
        let own = sampling(&line.choice);
        if !best.iter().any(|b| sampling(&b.choice) == own) {
            best.push(line);
        }
    }
    best
}

/// Colours and strokes of curves: a colour per parametrization; dashes without a warp.
struct Looks {
    parametrizations: Vec<String>,
    /// Samplings, each once.
    samplings: Vec<(String, String)>,
}

impl Looks {
    fn new<'a>(choices: impl Iterator<Item = &'a Choice>) -> Self {
        let mut looks = Self {
            parametrizations: Vec::new(),
            samplings: Vec::new(),
        };
        for choice in choices {
            if !looks.parametrizations.contains(&choice.parametrization) {
                looks.parametrizations.push(choice.parametrization.clone());
            }
            let sampling = (choice.parametrization.clone(), choice.warp.clone());
            if !looks.samplings.contains(&sampling) {
                looks.samplings.push(sampling);
            }
        }
        looks
    }

    fn series(&self, choice: &Choice, points: Vec<(f64, Option<f64>)>) -> Series {
        let own = |p: &String| *p == choice.parametrization;
        let siblings = self.samplings.iter().filter(|s| own(&s.0)).count();
        let (name, mark) = match (choice.warp.as_str(), siblings) {
            ("none", 1) => (choice.parametrization.clone(), Mark::Line),
            ("none", _) => (choice.parametrization.clone(), Mark::Dashed),
            (_, 1 | 2) => (format!("{}, warped", choice.parametrization), Mark::Line),
            _ => (sampling(choice), Mark::Line),
        };
        let color = self.parametrizations.iter().position(own);
        Series {
            name,
            color: self.further(choice).or(color).unwrap_or_default(),
            mark,
            points,
        }
    }

    /// The colour of a second warp and of later ones, which would look like the first.
    fn further(&self, choice: &Choice) -> Option<usize> {
        let mut later: Vec<&(String, String)> = Vec::new();
        for p in &self.parametrizations {
            let warped = self.samplings.iter().filter(|s| s.0 == *p && s.1 != "none");
            later.extend(warped.skip(1));
        }
        let is = |s: &&(String, String)| s.0 == choice.parametrization && s.1 == choice.warp;
        let place = later.iter().position(is)?;
        Some(self.parametrizations.len() + place)
    }
}

/// Ratios and intervals of every sampling.
pub(super) fn forest(
    rows: &[Against],
    findings: &Findings,
    label: &str,
    title: &str,
) -> Result<Option<Markup>, Error> {
    let cells = || rows.iter().flat_map(|r| r.cells.iter().flatten());
    let groups = rows.iter().map(|row| ForestGroup {
        name: row.name.clone(),
        lines: (row.cells.iter().zip(&findings.allowances))
            .filter_map(|(cell, at)| {
                let cell = cell.as_ref()?;
                Some(ForestLine {
                    name: at.clone(),
                    ratio: cell.ratio,
                    interval: cell.interval,
                    note: format!("{}  {}", number(cell.ratio), cell.verdict()),
                })
            })
            .collect(),
    });
    let forest = Forest {
        label: label.into(),
        band: cells().map(|c| c.band).fold(BAND, f64::max),
        groups: groups.filter(|g| !g.lines.is_empty()).collect(),
    };
    let text = forest_svg(&forest)?;
    Ok((!forest.groups.is_empty()).then(|| chart(&text, &format!("{title}: {label}"), "")))
}

/// The curves of a material, one diagram per measure.
pub(super) fn of_material(material: &Material) -> Result<Option<Markup>, Error> {
    let choices = material.measures.iter().flat_map(|m| &m.lines);
    let looks = Looks::new(choices.map(|l| &l.choice));
    let mut charts = Vec::new();
    for measure in &material.measures {
        let series = measure.lines.iter().take(LINES).map(|line| {
            let found = line.best.iter().flatten();
            let points = found.map(|b| (b.readings, Some(b.error)));
            looks.series(&line.choice, points.collect())
        });
        let panel = Panel {
            title: format!("nrmse, {} pairs", measure.name),
            x: log("readings"),
            y: log("nrmse"),
            series: series.collect(),
        };
        if panel.series.iter().any(|s| s.points.len() > 1) {
            let label = format!(
                "{}: nrmse against readings, {}",
                material.name, measure.name
            );
            charts.push(chart(&labelled(&panel)?, &label, ""));
        }
    }
    Ok((!charts.is_empty()).then(|| html! { div.panels { @for c in &charts { (c) } } }))
}
