//! `gonio sampling`.

use super::{BrdfArgs, OutputArgs, ThreadArgs, note, refuse_other_endings, write_text};
use crate::error::{Error, count, in_whole, listed};
use crate::importance::{
    CELLS, COSINES, InCells, LightChart, RadialWarp, SamplerScores, VIEWS_DEG, compare,
};
use crate::report::{self, Axis, Columns, Mark, Panel, Series};
use crate::statistics::{Bootstrap, Paired, geometric_mean, is_exact};
use clap::{ArgGroup, Args};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Cells by which materials are compared.
const AT: usize = 16;

/// Ratios of variances within it are no difference.
const BAND: f64 = 1.05;

/// How well light directions are drawn by tables in each parametrization
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("files").multiple(true))]
#[command(after_help = "\
The number is the relative variance of f cos theta_i over the density of the draws, ∫ (f cos)²/p dω / a² − 1: one draw estimates the
albedo a with this squared relative error. It is the mean over views at 10°, 40°, 70°, 85° and at 11.25°, 39.375°, 67.5°, 84.375°, midway
between tables of 16, 32 or 64 views. Of several materials, geometric means and ratios are printed, without those that some sampler draws
exactly; --format csv and json have a row for each.

  gonio sampling ggx --set alpha=0.1
  gonio sampling MERL --format csv -o sampling.csv")]
pub(super) struct SamplingArgs {
    #[command(flatten)]
    brdf: BrdfArgs,
    /// Elevations of the view that have a table, from 1 to 256
    #[arg(long, value_name = "N", default_value_t = 32)]
    views: usize,
    /// Draw the relative variance over the cells into this file (*.svg) as well
    #[arg(long, value_name = "FILE", group = "files")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

/// A sampler on a material.
#[derive(Serialize)]
struct Row {
    /// Chart, warp, ends and course in cells, in words.
    #[serde(skip)]
    name: String,
    material: String,
    /// Chart of the light direction, or what is drawn from in place of tables.
    sampler: String,
    warp: Option<&'static str>,
    ends: Option<&'static str>,
    in_cells: Option<&'static str>,
    cells: Option<usize>,
    views: Option<usize>,
    cosine: Option<f64>,
    /// Infinite: left out.
    relative_variance: Option<f64>,
    bytes: Option<usize>,
    seconds: Option<f64>,
    nanoseconds: Option<f64>,
    /// Roughness of the GGX that draws best beside the cosine.
    alpha: Option<f64>,
}

impl Row {
    fn of(material: &str, compared: &SamplerScores) -> Vec<Self> {
        let finite = |v: f64| v.is_finite().then_some(v);
        let tables = compared.tried.iter().map(|tried| {
            let of = &tried.settings;
            let ends = if of.axes.to_horizon {
                "horizon"
            } else {
                "fixed"
            };
            Self {
                name: format!("{}, {}", of.axes.name(), of.in_cells.name()),
                material: material.into(),
                sampler: of.axes.chart.name().into(),
                warp: Some(of.axes.warp.name()),
                ends: Some(ends),
                in_cells: Some(of.in_cells.name()),
                cells: Some(of.cells[0]),
                views: Some(of.views),
                cosine: Some(of.cosine),
                relative_variance: finite(tried.relative_variance),
                bytes: Some(tried.bytes),
                seconds: Some(tried.seconds),
                nanoseconds: Some(tried.nanoseconds),
                alpha: None,
            }
        });
        let others = compared.others.iter().map(|other| Self {
            name: other.name.clone(),
            material: material.into(),
            sampler: other.name.clone(),
            warp: None,
            ends: None,
            in_cells: None,
            cells: None,
            views: None,
            cosine: None,
            relative_variance: finite(other.relative_variance),
            bytes: None,
            seconds: None,
            nanoseconds: None,
            alpha: other.alpha,
        });
        tables.chain(others).collect()
    }
}

impl SamplingArgs {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        self.output.check()?;
        refuse_other_endings(self.picture.as_deref(), "svg")?;
        self.output.check_also(self.picture.as_deref())?;
        in_whole("views", self.views, [1, 256]).map_err(|e| Error::config("--views", e))?;
        let mut rows = Vec::new();
        let outcome = self.brdf.each(self.output.place(), |material, brdf| {
            let found = compare(brdf, self.views).map_err(Error::internal)?;
            match found {
                Some(found) => {
                    if found.views < VIEWS_DEG.len() {
                        note(&format!(
                            "gonio: {}: only {} of {} views count, as it reflects nothing or has no data at the others",
                            material.name,
                            found.views,
                            VIEWS_DEG.len()
                        ));
                    }
                    rows.extend(Row::of(&material.name, &found));
                }
                None => note(&format!(
                    "gonio: {} is left out: it reflects nothing, or has no data, at any view",
                    material.name
                )),
            }
            Ok(())
        });
        if matches!(outcome, Ok(()) | Err(Error::JobsFailed { .. })) {
            self.output.write_rows(&rows, |rows| {
                let (compared, exact) = without_exact(rows);
                text(&compared, &exact, self.views)
            })?;
            if let Some(path) = self.picture.as_ref().filter(|_| !rows.is_empty()) {
                write_text(path, &picture(&without_exact(&rows).0))?;
            }
        }
        outcome
    }
}

/// Rows by sampler, in the order in which they were tried, each a list for its materials.
struct Line<'a> {
    name: String,
    rows: Vec<&'a Row>,
}

impl Line<'_> {
    /// The geometric mean over materials of the relative variance with this many cells and share of the cosine.
    fn mean(&self, cells: Option<usize>, cosine: Option<f64>) -> Option<f64> {
        let all = self.variances(cells, cosine);
        let all: Option<Vec<f64>> = all.into_values().collect();
        geometric_mean(&all?)
    }

    fn variances(&self, cells: Option<usize>, cosine: Option<f64>) -> BTreeMap<&str, Option<f64>> {
        let is_asked = |row: &&&Row| row.cells == cells && row.cosine == cosine;
        let of = self.rows.iter().filter(is_asked);
        of.map(|row| (&*row.material, row.relative_variance))
            .collect()
    }

    /// Cells of the smallest table of at most this relative variance, and its bytes, the most over the materials.
    fn smallest(&self, most: f64) -> Option<(usize, usize)> {
        let mean = |cells: usize| self.mean(Some(cells), Some(COSINES[1]));
        let is_good = |cells: &usize| mean(*cells).is_some_and(|mean| mean <= most);
        let cells = CELLS.into_iter().find(is_good)?;
        let of = self.rows.iter().filter(|row| row.cells == Some(cells));
        Some((cells, of.filter_map(|row| row.bytes).max()?))
    }
}

/// A variance to three digits or so.
fn shown(v: Option<f64>) -> String {
    match v {
        None => "–".into(),
        Some(v) if is_exact(v) => "0".into(),
        Some(v) if !(1e-3..1000.0).contains(&v) => format!("{v:.2e}"),
        Some(v) if v >= 1.0 => format!("{v:.2}"),
        Some(v) => format!("{v:.4}"),
    }
}

/// The rows of several materials without those of which a sampler draws one exactly, since its ratios mean nothing; and the names of these. All of
/// one material.
fn without_exact(rows: &[Row]) -> (Vec<&Row>, Vec<&str>) {
    let is_one = rows.iter().all(|row| row.material == rows[0].material);
    let exact = rows
        .iter()
        .filter(|row| !is_one && row.relative_variance.is_some_and(is_exact));
    let mut exact: Vec<&str> = exact.map(|row| &*row.material).collect();
    exact.dedup();
    let kept = rows.iter().filter(|row| !exact.contains(&&*row.material));
    (kept.collect(), exact)
}

/// The rows of each sampler.
fn lines<'a>(rows: &[&'a Row]) -> Vec<Line<'a>> {
    let mut lines: Vec<Line<'a>> = Vec::new();
    for &row in rows {
        match lines.iter_mut().find(|line| line.name == row.name) {
            Some(line) => line.rows.push(row),
            None => lines.push(Line {
                name: row.name.clone(),
                rows: vec![row],
            }),
        }
    }
    lines
}

/// The materials, and what they are called together.
fn materials<'a>(rows: &[&'a Row]) -> (Vec<&'a str>, String) {
    let mut all: Vec<&str> = rows.iter().map(|row| &*row.material).collect();
    all.dedup();
    let together = match all.as_slice() {
        [only] => (*only).to_owned(),
        all => format!("geometric mean over {} materials", all.len()),
    };
    (all, together)
}

/// The relative variance over the cells: a panel for each warp and each kind of ends, a colour for each chart.
fn picture(rows: &[&Row]) -> String {
    let all = lines(rows);
    let mut panels: Vec<Panel> = Vec::new();
    for line in &all {
        let row = line.rows[0];
        let (Some(warp), Some(ends), Some(in_cells)) = (row.warp, row.ends, row.in_cells) else {
            continue;
        };
        let warp = if warp == RadialWarp::Plain.name() {
            "equal steps of the radius"
        } else {
            warp
        };
        let title = format!("{warp}, ends: {ends}");
        let color = LightChart::ALL
            .iter()
            .position(|chart| chart.name() == row.sampler);
        let mark = if in_cells == InCells::Bilinear.name() {
            Mark::Line
        } else {
            Mark::Dashed
        };
        let points = CELLS.map(|c| (c as f64, line.mean(Some(c), Some(COSINES[1]))));
        let series = Series::new(
            format!("{}, {in_cells}", row.sampler),
            color.unwrap_or(0),
            mark,
            points,
        );
        match panels.iter_mut().find(|panel| panel.title == title) {
            Some(panel) => panel.series.push(series),
            None => {
                let axes = [
                    Axis::log("cells along either axis"),
                    Axis::log("relative variance"),
                ];
                panels.push(Panel::new(title, axes, [series]));
            }
        }
    }
    let title = format!(
        "Relative variance of f cos over the density of draws: {}",
        materials(rows).1
    );
    report::svg(&title, &panels, 2)
}

fn text(rows: &[&Row], exact: &[&str], views: usize) -> String {
    let lines = lines(rows);
    let (materials, of) = materials(rows);
    if materials.is_empty() {
        return String::new();
    }
    let (tables, others): (Vec<_>, Vec<_>) = lines
        .into_iter()
        .partition(|line| line.rows[0].cells.is_some());
    let at = |line: &Line<'_>| line.mean(Some(AT), Some(COSINES[1]));
    let known = |line: &&Line<'_>| at(line).is_some();
    let best = tables.iter().filter(known).min_by(|a, b| {
        at(a)
            .unwrap_or(f64::INFINITY)
            .total_cmp(&at(b).unwrap_or(f64::INFINITY))
    });
    let several = materials.len() > 1;
    let cells: String = CELLS.iter().map(|c| format!("\t>{c}²")).collect();
    let ratio = if several { "\t>ratio, 95 %" } else { "" };
    let mut columns = Columns::new(&format!(
        "coordinates\tin cells{cells}\t>{AT}² without{ratio}\t>cells for 0.1\t>for 0.01\t>ns\t>ms"
    ));
    let bootstrap = Bootstrap::new(1);
    let ratio = |line: &Line<'_>| -> String {
        let Some(best) = best.filter(|_| several) else {
            return String::new();
        };
        let is_table = line.rows[0].cells.map(|_| AT);
        let own = line.variances(is_table, is_table.map(|_| COSINES[1]));
        let of_best = best.variances(Some(AT), Some(COSINES[1]));
        let pair =
            |(material, v): (&&str, &Option<f64>)| Some(((*v)?, (*of_best.get(*material)?)?));
        let pairs: Vec<_> = own.iter().filter_map(pair).collect();
        let paired = Paired::new(&pairs, BAND, &bootstrap);
        let text = paired.map_or("–".into(), |p| {
            let interval = p
                .interval
                .map_or(String::new(), |[low, high]| format!(" {low:.2}–{high:.2}"));
            format!("{:.2}{interval}", p.ratio)
        });
        format!("\t{text}")
    };
    for line in &tables {
        let of_cells: String = CELLS
            .iter()
            .map(|c| format!("\t{}", shown(line.mean(Some(*c), Some(COSINES[1])))))
            .collect();
        let smallest = |most: f64| match line.smallest(most) {
            Some((cells, bytes)) => format!("\t{cells}², {:.0} kB", bytes as f64 / 1e3),
            None => "\t–".into(),
        };
        let at_cells = |cells: usize| line.rows.iter().filter(move |row| row.cells == Some(cells));
        let mean = |of: fn(&Row) -> Option<f64>, cells: usize| {
            let all: Vec<f64> = at_cells(cells).filter_map(|row| of(row)).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        let (name, in_cells) = line.name.rsplit_once(", ").unwrap_or((&line.name, ""));
        columns.row(&format!(
            "{name}\t{in_cells}{of_cells}\t{}{}{}{}\t{:.0}\t{:.1}",
            shown(line.mean(Some(AT), Some(COSINES[0]))),
            ratio(line),
            smallest(0.1),
            smallest(0.01),
            mean(|row| row.nanoseconds, AT),
            1e3 * mean(|row| row.seconds, AT),
        ));
    }
    let mut out = format!(
        "{of}: relative variance of f cos over the density of draws, mean over 8 views\ntables of {}, with 1 % of the draws by the cosine; without it where it says so; ns a draw and ms to make the tables of {AT}²\n\n{columns}",
        count(views, "view")
    );
    for line in &others {
        let missing = materials.len() - line.rows.len();
        let of = if missing > 0 {
            format!(" (of {} materials)", line.rows.len())
        } else {
            String::new()
        };
        let ratio = ratio(line).replace('\t', ", ratio ");
        out += &format!(
            "{}: {}{ratio}{of}\n",
            line.name,
            shown(line.mean(None, None))
        );
    }
    if let Some(best) = best {
        out += &format!("\nleast at {AT}²: {}\n", best.name);
    }
    if !exact.is_empty() {
        out += &format!(
            "left out, as a sampler draws them exactly: {}\n",
            listed(exact)
        );
    }
    out
}
