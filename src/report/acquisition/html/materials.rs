//! The section of each material: the error of each sampling on it.

use super::super::order::sampling;
use super::figure::figures;
use super::{MaterialPictures, sampling_name};
use crate::experiment::{Choice, OWN, Row};
use crate::report::acquisition::table::error;
use crate::statistics::{EXACT, geometric_mean};
use maud::{Markup, html};
use std::collections::HashMap;

/// A material's errors.
pub(super) struct Material {
    pub name: String,
    pub truth: String,
    /// Measured alignment q of its lobe.
    pub alignment: Option<f64>,
    pub measures: Vec<Measure>,
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
pub(super) struct Best {
    pub method: String,
    pub error: f64,
    pub readings: f64,
}

/// Positions of names in the order of their first appearance.
#[derive(Default)]
struct Places<'a> {
    list: Vec<&'a str>,
    places: HashMap<&'a str, usize>,
}

impl<'a> Places<'a> {
    fn place(&mut self, name: &'a str) -> usize {
        let next = self.list.len();
        *self.places.entry(name).or_insert_with(|| {
            self.list.push(name);
            next
        })
    }
}

/// Key of a row: positions of material, measure, sampling, allowance and method.
type Key = [usize; 5];

/// Every material's errors, in the order of the rows.
pub(super) fn tables(rows: &[&Row], allowances: &[String]) -> Vec<Material> {
    let mut materials = Places::default();
    let mut measures = Places::default();
    let mut samplings: Vec<Choice> = Vec::new();
    let mut methods: Vec<[&str; 4]> = Vec::new();
    let mut truths: Vec<(&str, Option<f64>)> = Vec::new();
    let mut cells: HashMap<Key, Vec<(f64, f64)>> = HashMap::new();
    for row in rows {
        let material = materials.place(&row.material);
        if material == truths.len() {
            truths.push((&row.truth, row.alignment));
        }
        let is_mine = |c: &Choice| c.parametrization == row.parametrization && c.warp == row.warp;
        let s = samplings.iter().position(is_mine).unwrap_or_else(|| {
            samplings.push(row.choice());
            samplings.len() - 1
        });
        let method = [
            row.reconstruction.as_str(),
            &row.coordinates,
            &row.sample_set,
            &row.instrument,
        ];
        let m = methods
            .iter()
            .position(|m| *m == method)
            .unwrap_or_else(|| {
                methods.push(method);
                methods.len() - 1
            });
        let Some(a) = allowances.iter().position(|a| *a == row.allowed) else {
            continue;
        };
        if let Some(nrmse) = row.value("nrmse") {
            let at = [material, measures.place(&row.measure), s, a, m];
            cells
                .entry(at)
                .or_default()
                .push((nrmse, row.readings as f64));
        }
    }
    let found = |m: usize, at: [usize; 4]| {
        let [material, measure, s, a] = at;
        let of_seeds = cells.get(&[material, measure, s, a, m])?;
        let (errors, readings): (Vec<f64>, Vec<f64>) = of_seeds.iter().copied().unzip();
        let [name, coordinates, ..] = methods[m];
        Some(Best {
            method: match coordinates {
                OWN => name.into(),
                c => format!("{name} in {c}"),
            },
            error: geometric_mean(&errors)?,
            readings: geometric_mean(&readings)?,
        })
    };
    let best = |at: [usize; 4]| {
        let all = (0..methods.len()).filter_map(|m| found(m, at));
        all.min_by(|x, y| x.error.total_cmp(&y.error))
    };
    let course = |material, measure, s| {
        let of = |m| -> Vec<Best> {
            let all = 0..allowances.len();
            all.filter_map(|a| found(m, [material, measure, s, a]))
                .collect()
        };
        let mean = |course: &[Best]| {
            let logs = course.iter().map(|b| b.error.max(EXACT).ln());
            logs.sum::<f64>() / course.len().max(1) as f64
        };
        let better = |x: &Vec<Best>, y: &Vec<Best>| {
            let fewer = y.len().cmp(&x.len());
            fewer.then(mean(x).total_cmp(&mean(y)))
        };
        (0..methods.len())
            .map(of)
            .min_by(better)
            .unwrap_or_default()
    };
    let line = |material, measure, s: usize| Line {
        choice: samplings[s].clone(),
        best: (0..allowances.len())
            .map(|a| best([material, measure, s, a]))
            .collect(),
        course: course(material, measure, s),
    };
    (0..truths.len())
        .map(|material| Material {
            name: materials.list[material].into(),
            truth: truths[material].0.into(),
            alignment: truths[material].1,
            measures: (measures.list.iter().enumerate())
                .map(|(measure, name)| Measure {
                    name: (*name).into(),
                    lines: (0..samplings.len())
                        .map(|s| line(material, measure, s))
                        .collect(),
                })
                .collect(),
        })
        .collect()
}

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

/// The section of a material.
pub(super) fn section(
    number: usize,
    material: &Material,
    allowances: &[String],
    pictures: Option<&MaterialPictures>,
    curves: Option<Markup>,
) -> Markup {
    html! {
        section.page.material id={ "material-" (number) } {
            h3 { (material.name) }
            p.truth {
                "Truth: " (material.truth)
                @match material.alignment {
                    Some(q) => { (format!("; measured alignment q = {q:.2} (0: a lobe over theta_h, 1: over |h_bar|)")) }
                    None => { "; no lobe whose alignment could be measured" }
                }
            }
            @if let Some(pictures) = pictures { (figures(&pictures.pictures)) }
            @if let Some(curves) = curves { (curves) }
            @for measure in &material.measures { (table(measure, allowances)) }
        }
    }
}

fn table(measure: &Measure, allowances: &[String]) -> Markup {
    let column = |a: usize| measure.lines.iter().filter_map(move |l| l.best[a].as_ref());
    let least = |a: usize| column(a).map(|b| b.error).fold(f64::INFINITY, f64::min);
    let caption = format!("nrmse, {} pairs", measure.name);
    let head = ["sampled in"]
        .into_iter()
        .chain(allowances.iter().map(String::as_str));
    let rows = html! {
        tbody {
            @for line in &measure.lines {
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
    super::table(Some("methods sorts"), &caption, head, rows)
}
