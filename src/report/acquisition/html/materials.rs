//! The section of each material: the error of each sampling on it.

use super::super::order::{by, sampling};
use super::figure::figures;
use super::{MaterialPictures, fold, folded, sampling_name};
use crate::experiment::{Choice, Row};
use crate::report::acquisition::table::error;
use crate::report::{each_once, first_of_each};
use crate::statistics::{EXACT, geometric_mean, is_exact};
use maud::{Markup, html};
use std::collections::{HashMap, HashSet};

/// A material's errors.
pub(super) struct Material {
    pub name: String,
    pub truth: String,
    /// Measured alignment q of its lobe.
    pub alignment: Option<f64>,
    pub measures: Vec<Measure>,
}

impl Material {
    /// True if every sampling reconstructs it exactly at every allowance that it is used at.
    fn is_exact(&self) -> bool {
        let lines = || self.measures.iter().flat_map(|m| &m.lines);
        let mut all = lines().flat_map(|l| l.best.iter().flatten()).peekable();
        all.peek().is_some() && all.all(|b| is_exact(b.error))
    }
}

/// Errors under a measure.
pub(super) struct Measure {
    pub name: String,
    /// One line per sampling, in the order of the rows.
    pub lines: Vec<Line>,
}

/// A sampling, and its best reconstruction at each allowance.
pub(super) struct Line {
    /// The sampling; reconstruction and coordinates are those of its first row.
    pub choice: Choice,
    pub best: Vec<Option<Best>>,
    /// The one reconstruction that is best over all allowances, where it has errors.
    pub course: Vec<Best>,
}

/// The best reconstruction: its name and coordinates, `nrmse` and readings, means over seeds.
#[derive(Clone)]
pub(super) struct Best {
    pub method: String,
    pub error: f64,
    pub readings: f64,
}

/// Errors of seeds, each with its readings, by choice.
type OfSeeds = HashMap<Choice, Vec<(f64, f64)>>;

/// Every material's errors, in the order of the rows.
pub(super) fn tables(rows: &[&Row], allowances: &[String]) -> Vec<Material> {
    // By material, measure and allowance.
    let mut cells: HashMap<[&str; 3], OfSeeds> = HashMap::new();
    for row in rows {
        if let Some(nrmse) = row.value("nrmse") {
            let of = cells.entry([&row.material, &row.measure, &row.allowed]);
            let of_seeds = of.or_default().entry(row.choice()).or_default();
            of_seeds.push((nrmse, row.readings as f64));
        }
    }
    let are_known = |r: &&&Row| allowances.contains(&r.allowed) && r.value("nrmse").is_some();
    let with_error = rows.iter().filter(are_known);
    let measures = each_once(with_error.map(|r| r.measure.as_str()));
    let mut seen = HashSet::new();
    let all = rows.iter().map(|r| r.choice());
    let choices: Vec<Choice> = all.filter(|c| seen.insert(c.clone())).collect();
    let samplings = first_of_each(&choices, |a, b| {
        a.parametrization == b.parametrization && a.warp == b.warp
    });
    let methods = each_once(choices.iter().map(|choice| Choice {
        parametrization: String::new(),
        warp: String::new(),
        ..choice.clone()
    }));
    let found = |[material, measure, allowed]: [&str; 3], sampling: &Choice, method: &Choice| {
        let (parametrization, warp) = (sampling.parametrization.clone(), sampling.warp.clone());
        let of_seeds = cells.get(&[material, measure, allowed])?.get(&Choice {
            parametrization,
            warp,
            ..method.clone()
        })?;
        let (errors, readings): (Vec<f64>, Vec<f64>) = of_seeds.iter().copied().unzip();
        Some(Best {
            method: by(method),
            error: geometric_mean(&errors)?,
            readings: geometric_mean(&readings)?,
        })
    };
    let line = |material, measure, sampling: &Choice| {
        let of = |m: &Choice| -> Vec<Option<Best>> {
            let each = allowances.iter();
            each.map(|a| found([material, measure, a], sampling, m))
                .collect()
        };
        let all: Vec<_> = methods.iter().map(of).collect();
        let best = |a: usize| {
            let found = all.iter().filter_map(|of| of[a].clone());
            found.min_by(|x, y| x.error.total_cmp(&y.error))
        };
        let best = (0..allowances.len()).map(best).collect();
        let mean = |course: &[Best]| {
            let logs = course.iter().map(|b| b.error.max(EXACT).ln());
            logs.sum::<f64>() / course.len().max(1) as f64
        };
        let better = |x: &Vec<Best>, y: &Vec<Best>| {
            let fewer = y.len().cmp(&x.len());
            fewer.then(mean(x).total_cmp(&mean(y)))
        };
        let courses = all.into_iter().map(|of| of.into_iter().flatten().collect());
        Line {
            choice: sampling.clone(),
            best,
            course: courses.min_by(better).unwrap_or_default(),
        }
    };
    let mut seen = HashSet::new();
    let firsts = rows.iter().filter(|r| seen.insert(&r.material));
    let of = |material| {
        let measures = measures.iter().map(|&name| Measure {
            name: name.into(),
            lines: samplings.iter().map(|s| line(material, name, s)).collect(),
        });
        measures.collect()
    };
    firsts
        .map(|&first| Material {
            name: first.material.clone(),
            truth: first.truth.clone(),
            alignment: first.alignment,
            measures: of(&first.material),
        })
        .collect()
}

/// Materials that are not folded away.
const OPEN: usize = 4;

/// What diagrams and tables of materials show.
pub(super) fn legend() -> Markup {
    html! {
        p {
            "Curves: of each sampling the one reconstruction that is best on the material over all "
            "budgets, named below. Tables: the best reconstruction of each sampling at each budget, "
            "named in the cell; a " b { "★" } " marks the least error of its column."
        }
    }
}

pub(super) fn section(
    number: usize,
    material: &Material,
    allowances: &[String],
    pictures: Option<&MaterialPictures>,
    curves: Option<Markup>,
) -> Markup {
    let table = |m: &Measure| (format!("nrmse, {} pairs", m.name), table(m, allowances));
    let tables = material.measures.iter().map(table);
    let body = html! {
        p.truth {
            "Truth: " (material.truth)
            @match material.alignment {
                Some(q) => { (format!("; measured alignment q = {q:.2} (0: a lobe over theta_h, 1: over |h_bar|)")) }
                None => { "; no lobe whose alignment could be measured" }
            }
        }
        @if let Some(pictures) = pictures { (figures(&pictures.pictures)) }
        @if let Some(curves) = curves { (curves) }
        @if material.is_exact() {
            p { "Exact: at every budget all samplings have a reconstruction whose error is one of rounding." }
        } @else {
            (folded(tables))
        }
    };
    html! {
        section.material id={ "material-" (number) } { (fold(number < OPEN, "", &material.name, body)) }
    }
}

fn table(measure: &Measure, allowances: &[String]) -> Markup {
    let column = |a: usize| measure.lines.iter().filter_map(move |l| l.best[a].as_ref());
    let least = |a: usize| column(a).map(|b| b.error).fold(f64::INFINITY, f64::min);
    let allowed = allowances.iter().map(String::as_str);
    let head = ["sampled in"].into_iter().chain(allowed);
    let rows = html! {
        tbody {
            @for line in measure.lines.iter().filter(|l| l.best.iter().any(Option::is_some)) {
                tr {
                    th scope="row" title=(sampling(&line.choice)) { (sampling_name(&line.choice)) }
                    @for (a, best) in line.best.iter().enumerate() {
                        @if let Some(best) = best {
                            td.best[best.error <= least(a)]
                                title={ (format!("{:.0}", best.readings)) " readings" } {
                                b { (error(Some(best.error))) }
                                @if best.error <= least(a) { " ★" }
                                small { (best.method) }
                            }
                        } @else {
                            td { "–" }
                        }
                    }
                }
            }
        }
    };
    super::table(Some("methods sorts"), "", head, rows)
}
