//! `gonio bench`.

mod pilot;

use super::output::{JsonArgs, print_json};
use super::talk::{note, wrote};
use super::{ThreadArgs, print, refuse_existing, written};
use crate::brdf::measured::merl::Merl;
use crate::brdf::{self, Brdf, Channels};
use crate::error::Error;
use crate::files::write_atomically;
use crate::moments::{
    Channel, Component, Estimator, MomentsSpec, MonteCarlo, Order, PeakResolving, Profile,
    ScrambledSobol,
};
use crate::registry;
use clap::{Args, Subcommand};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What can be measured against the clock.
#[derive(Debug, Args)]
pub(super) struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Error against seconds of the moment estimators
    Moments(BenchMoments),
}

impl Bench {
    pub(super) fn run(self) -> Result<(), Error> {
        match self.what {
            What::Moments(bench) => bench.run(),
        }
    }
}

/// Each estimator over its ladder of samples or tolerances, on Lambert, GGX 0.1, 0.01, 0.001 and a
/// table: energy and covariance of every view against a tight reference
#[derive(Debug, Args)]
struct BenchMoments {
    #[command(flatten)]
    threads: ThreadArgs,
    /// A MERL table in place of one of GGX 0.1
    #[arg(long, value_name = "FILE")]
    merl: Option<PathBuf>,
    /// View elevations, from 0° to 89°
    #[arg(long, value_name = "N", default_value_t = 90, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    views: u32,
    #[command(flatten)]
    json: JsonArgs,
    /// Folder for bench.csv and bench.svg
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long, requires = "output")]
    force: bool,
}

/// Seed of everything random here.
const SEED: u64 = 1;
/// Least time of a rung's repetitions, s; there are at most [`REPEATS`] of them.
const ENOUGH: f64 = 0.05;
const REPEATS: usize = 5;
/// What errors are against.
const REFERENCE: PeakResolving = PeakResolving {
    tolerance: 1e-9,
    max_evaluations: 2_000_000,
};
/// Errors at which times are compared.
const TARGETS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
const KINDS: [&str; 3] = ["monte-carlo", "sobol", "peak-resolving"];

/// One estimator with one parameter on one material.
#[derive(Serialize)]
struct Row {
    material: String,
    estimator: &'static str,
    parameter: String,
    /// Evaluations of the BRDF, mean over the views.
    evaluations: usize,
    seconds: f64,
    /// Largest relative error of a view.
    energy_error: f64,
    /// Largest error of a view and component, relative to σ².
    covariance_error: f64,
    /// Median over the views of the largest error of a component, relative to σ².
    covariance_median: f64,
    #[serde(rename = "unresolved_views")]
    unresolved: usize,
    /// Accuracy of the reference in energy and covariance: smaller errors are unknown.
    #[serde(rename = "reference_error")]
    known: [f64; 2],
    /// True if most views are resolved, so that the error can be extrapolated.
    #[serde(skip)]
    lawful: bool,
}

impl Row {
    const HEAD: [&str; 9] = [
        "material",
        "estimator",
        "parameter",
        "evaluations",
        "seconds",
        "energy_error",
        "covariance_error",
        "covariance_median",
        "unresolved_views",
    ];

    fn cells(&self) -> [String; 9] {
        [
            self.material.clone(),
            self.estimator.into(),
            self.parameter.clone(),
            self.evaluations.to_string(),
            format!("{:.3e}", self.seconds),
            format!("{:.2e}", self.energy_error),
            format!("{:.2e}", self.covariance_error),
            format!("{:.2e}", self.covariance_median),
            self.unresolved.to_string(),
        ]
    }
}

/// A table's line.
fn line(cells: &[String; 9]) -> String {
    let [a, b, c, d, e, f, g, h, i] = cells;
    format!("{a:<14} {b:<14} {c:>9} {d:>11} {e:>9} {f:>12} {g:>16} {h:>17} {i:>16}\n")
}

impl BenchMoments {
    fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let files = self
            .output
            .as_ref()
            .map(|dir| ["bench.csv", "bench.svg"].map(|f| dir.join(f)));
        for file in files.iter().flatten() {
            refuse_existing(file, self.force)?;
        }
        let table = self.table()?;
        let spec = MomentsSpec {
            views: self.views as usize,
            order: Order::new(2).unwrap_or_default(),
            ..MomentsSpec::default()
        };
        let mut materials = vec![("lambert".into(), build("lambert", "")?)];
        materials.extend(lobes()?);
        materials.push(table);
        let seconds = pilot::seconds(&materials, &spec)?;
        note(&format!(
            "gonio: takes about {}",
            pilot::shown(seconds.iter().flatten().sum())
        ));
        let json = self.json.wanted();
        if !json {
            print(&line(&Row::HEAD.map(Into::into)))?;
        }
        let mut told = pilot::Told::new(json, seconds);
        let mut rows = Vec::new();
        for (material, brdf) in &materials {
            climb(material, &**brdf, &spec, &mut rows, &mut told)?;
        }
        drop(told);
        match json {
            true => print_json(&rows)?,
            false => print(&comparison(&rows))?,
        }
        let Some([csv, svg]) = files else {
            return Ok(());
        };
        if let Some(dir) = &self.output {
            std::fs::create_dir_all(dir)
                .map_err(|e| Error::output(dir, format!("cannot make this folder: {e}")))?;
        }
        write_csv(&rows, &csv)?;
        draw(&rows, &svg)
    }

    /// The measured table, or the one that stands for it.
    fn table(&self) -> Result<Named, Error> {
        let Some(path) = &self.merl else {
            let text = "of = { kind = \"ggx\", alpha = 0.1 }";
            return Ok(("table-ggx-0.1".into(), build("tabulated", text)?));
        };
        let table = Merl::load(path, Channels::Luminance).map_err(|e| Error::data(path, e))?;
        let name = path.file_stem().unwrap_or("table".as_ref());
        Ok((name.to_string_lossy().into_owned(), Box::new(table)))
    }
}

/// A material and its name in the table.
type Named = (String, Box<dyn Brdf>);

fn lobes() -> Result<Vec<Named>, Error> {
    ["0.1", "0.01", "0.001"]
        .into_iter()
        .map(|alpha| {
            Ok((
                format!("ggx-{alpha}"),
                build("ggx", &format!("alpha = {alpha}"))?,
            ))
        })
        .collect()
}

/// A material from the registry. Names and keys are constants: a failure is an internal error.
fn build(kind: &str, text: &str) -> Result<Box<dyn Brdf>, Error> {
    let internal = |e: &dyn std::fmt::Display| Error::Internal(format!("{kind}: {e}"));
    let entries = brdf::all();
    let entry = entries.iter().find(|e| e.kind == kind);
    let entry = entry.ok_or_else(|| internal(&"no such material"))?;
    let spec = registry::read_text(entry, text).map_err(|e| internal(&e))?;
    spec.build(Channels::Luminance).map_err(|e| internal(&e))
}

/// Every estimator with every parameter, cheapest first.
fn ladders() -> Vec<(&'static str, String, Box<dyn Estimator>)> {
    let mut all: Vec<(_, _, Box<dyn Estimator>)> = Vec::new();
    for samples in [1024, 10_016, 100_000, 320_000] {
        all.push((
            KINDS[0],
            samples.to_string(),
            Box::new(MonteCarlo { samples }),
        ));
    }
    for power in [10, 12, 14, 16, 18] {
        let samples = 1 << power;
        all.push((
            KINDS[1],
            format!("2^{power}"),
            Box::new(ScrambledSobol { samples }),
        ));
    }
    for power in 2..=8 {
        let by = PeakResolving {
            tolerance: f64::powi(10.0, -power),
            ..PeakResolving::default()
        };
        all.push((KINDS[2], format!("1e-{power}"), Box::new(by)));
    }
    all
}

/// Results of every rung on one material.
fn climb(
    material: &str,
    brdf: &dyn Brdf,
    spec: &MomentsSpec,
    rows: &mut Vec<Row>,
    told: &mut pilot::Told,
) -> Result<(), Error> {
    let profile = |by: &dyn Estimator| profile(brdf, spec, by);
    let reference = profile(&REFERENCE)?;
    told.done();
    let known = errors(&reference, |v, c| {
        Some(reference.slices[v].moments.get(c)?.uncertainty)
    });
    let line_of = format!(
        "{material}: reference good to {:.0e} in energy, {:.0e} in covariance",
        known.energy, known.covariance
    );
    told.suspend(|| note(&line_of));
    let mut exhausted = false;
    for (estimator, parameter, by) in ladders() {
        if exhausted {
            // A smaller tolerance would end at the same number of values with the same result.
            told.done();
            continue;
        }
        let mut seconds = Vec::new();
        let got = loop {
            let start = Instant::now();
            let got = profile(&*by)?;
            seconds.push(start.elapsed().as_secs_f64());
            if seconds.len() >= REPEATS || seconds.iter().sum::<f64>() > ENOUGH {
                break got;
            }
        };
        let errors = errors(&reference, |v, c| {
            let value = got.slices[v].moments.get(c)?.value;
            Some(value - reference.slices[v].moments.get(c)?.value)
        });
        let total: usize = got.slices.iter().map(|s| s.evaluations).sum();
        let row = Row {
            material: material.into(),
            estimator,
            parameter,
            evaluations: total / got.slices.len().max(1),
            seconds: median(&mut seconds),
            energy_error: errors.energy.max(known.energy),
            covariance_error: errors.covariance.max(known.covariance),
            covariance_median: errors.covariance_median.max(known.covariance_median),
            unresolved: got.unresolved(),
            known: [known.energy, known.covariance],
            lawful: 2 * got.unresolved() < got.slices.len(),
        };
        exhausted = estimator == KINDS[2] && row.unresolved == got.slices.len();
        told.done();
        told.row(&line(&row.cells()))?;
        rows.push(row);
    }
    Ok(())
}

/// The profile of a material by an estimator.
fn profile(brdf: &dyn Brdf, spec: &MomentsSpec, by: &dyn Estimator) -> Result<Profile, Error> {
    Profile::new(brdf, Channel::Luminance, spec, by, SEED)
        .map_err(|e| Error::Internal(e.to_string()))
}

struct Errors {
    energy: f64,
    covariance: f64,
    covariance_median: f64,
}

/// Absolute differences by view and component in units of the reference's scales. A moment that is
/// undefined, as where an estimator saw nothing, counts as off by 1: the whole of it.
fn errors(reference: &Profile, difference: impl Fn(usize, Component) -> Option<f64>) -> Errors {
    let (mut energy, mut covariances) = (0.0_f64, Vec::new());
    for (view, slice) in reference.slices.iter().enumerate() {
        let truth = &slice.moments;
        let (Some(alpha), Some([s, t])) = (truth.energy(), truth.sigma()) else {
            continue;
        };
        let off = |c, scale: f64| difference(view, c).map_or(1.0, |d| (d / scale).abs());
        energy = energy.max(off(Component::ENERGY, alpha));
        let scaled = Component::ALL
            .into_iter()
            .filter(|c| c.order() == 2)
            .map(|c| off(c, s.powi(c.n as i32) * t.powi(c.m as i32)));
        covariances.push(scaled.fold(0.0, f64::max));
    }
    let covariance = covariances.iter().copied().fold(0.0, f64::max);
    Errors {
        energy,
        covariance,
        covariance_median: median(&mut covariances),
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Seconds for an error, by the way they were found.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Time {
    /// Interpolated between two rungs.
    Between(f64),
    /// Upper bound: the cheapest rung is already better.
    AtMost(f64),
    /// Extrapolated beyond the dearest rung, along N^(−1/2).
    Beyond(f64),
    /// Lower bound: the dearest rung is unresolved, or its error more than two decades above.
    MoreThan(f64),
}

impl Time {
    fn seconds(self) -> f64 {
        let (Time::Between(s) | Time::AtMost(s) | Time::Beyond(s) | Time::MoreThan(s)) = self;
        s
    }

    /// The seconds for an error, from points (seconds, error), cheapest first; `lawful` says that
    /// the last of them may be extrapolated.
    fn to_reach(target: f64, points: &[(f64, f64)], lawful: bool) -> Option<Self> {
        let (&first, rest) = points.split_first()?;
        if first.1 <= target {
            return Some(Time::AtMost(first.0));
        }
        let mut last = first;
        for &next in rest {
            if next.1 <= target {
                // An error of 0 is as good as any: rungs are compared, not logarithms.
                let share = match next.1 > 0.0 {
                    true => (last.1 / target).ln() / (last.1 / next.1).ln(),
                    false => 1.0,
                };
                return Some(Time::Between(last.0 * (next.0 / last.0).powf(share)));
            }
            last = next;
        }
        let ratio = last.1 / target;
        Some(if lawful && ratio <= 100.0 {
            Time::Beyond(last.0 * ratio * ratio)
        } else {
            Time::MoreThan(last.0)
        })
    }
}

/// Seconds each estimator needs for the same error, and how many times those of the peak-resolving
/// one that is.
fn comparison(rows: &[Row]) -> String {
    let mut out = String::from(
        "\nseconds to reach an error in every view, and how many times those of peak-resolving\n\
         (< the cheapest rung is better; * extrapolated: error falls with the root of the time;\n\
         > not reached, and unresolved or too far off to extrapolate)\n",
    );
    type Quantity = (&'static str, fn(&Row) -> f64);
    let quantities: [Quantity; 2] = [
        ("energy", |r| r.energy_error),
        ("covariance", |r| r.covariance_error),
    ];
    let mut materials: Vec<&str> = rows.iter().map(|r| r.material.as_str()).collect();
    materials.dedup();
    for material in materials {
        for (quantity, of) in quantities {
            for target in TARGETS {
                let which = usize::from(quantity == "covariance");
                let known = rows.iter().find(|r| r.material == material);
                if known.is_some_and(|r| r.known[which] > target) {
                    out += &format!(
                        "{material:<14} {quantity:<11} {target:>5.0e}  not known: below what the \
                         reference is good to\n"
                    );
                    continue;
                }
                let times = KINDS.map(|kind| {
                    let rungs = rows
                        .iter()
                        .filter(|r| r.material == material && r.estimator == kind);
                    let rungs: Vec<&Row> = rungs.collect();
                    let points: Vec<_> = rungs.iter().map(|r| (r.seconds, of(r))).collect();
                    Time::to_reach(target, &points, rungs.last().is_some_and(|r| r.lawful))
                });
                out += &format!("{material:<14} {quantity:<11} {target:>5.0e}");
                let least = times[2].map(Time::seconds);
                for (kind, time) in KINDS.iter().zip(times) {
                    let Some(time) = time else { continue };
                    let mark = match time {
                        Time::Between(_) => ' ',
                        Time::AtMost(_) => '<',
                        Time::Beyond(_) => '*',
                        Time::MoreThan(_) => '>',
                    };
                    let ratio = least.map_or(f64::NAN, |least| time.seconds() / least);
                    out += &format!("  {kind} {mark}{:.1e} s", time.seconds());
                    if *kind != KINDS[2] {
                        out += &format!(" ({ratio:.1e}×)");
                    }
                }
                out += "\n";
            }
        }
    }
    out
}

fn write_csv(rows: &[Row], path: &Path) -> Result<(), Error> {
    let result = write_atomically(path, |out| {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(Row::HEAD)?;
        for row in rows {
            csv.write_record(row.cells())?;
        }
        csv.flush()
    });
    written(path, result)?;
    wrote(path);
    Ok(())
}

/// Draws a panel per material: error over seconds, energy as a line, covariance dashed.
fn draw(rows: &[Row], path: &Path) -> Result<(), Error> {
    use crate::report::{Axis, Mark, Panel, Scale, Series, svg};
    use std::io::Write;
    let axis = |label: &str| Axis {
        label: label.into(),
        scale: Scale::Log,
        range: None,
    };
    let mut panels: Vec<Panel> = Vec::new();
    for row in rows {
        if panels.last().is_none_or(|p| p.title != row.material) {
            let series = KINDS.iter().enumerate().flat_map(|(color, kind)| {
                [("energy", Mark::Line), ("covariance", Mark::Dashed)].map(|(what, mark)| Series {
                    name: format!("{kind}, {what}"),
                    color,
                    mark,
                    points: Vec::new(),
                })
            });
            panels.push(Panel {
                title: row.material.clone(),
                x: axis("seconds"),
                y: axis("largest relative error"),
                series: series.collect(),
            });
        }
        let (Some(panel), Some(kind)) = (
            panels.last_mut(),
            KINDS.iter().position(|k| *k == row.estimator),
        ) else {
            continue;
        };
        let errors = [row.energy_error, row.covariance_error];
        for (series, error) in panel.series[2 * kind..].iter_mut().zip(errors) {
            series.points.push((row.seconds, Some(error)));
        }
    }
    let text = svg("Error of moments over seconds", &panels, 3)?;
    written(
        path,
        write_atomically(path, |out| out.write_all(text.as_bytes())),
    )?;
    wrote(path);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_lie_on_lines_in_logarithms() {
        let points = [(1.0, 1e-1), (100.0, 1e-2), (1e4, 1e-4)];
        let at = |target| Time::to_reach(target, &points, true).unwrap();
        assert_eq!(at(0.5), Time::AtMost(1.0));
        for (target, want) in [(1e-1_f64.powf(1.5), 10.0), (1e-3, 1e3), (1e-4, 1e4)] {
            let Time::Between(got) = at(target) else {
                panic!("{target}")
            };
            assert!((got / want - 1.0).abs() < 1e-12, "{target}: {got}");
        }
        let Time::Beyond(got) = at(1e-5) else {
            panic!()
        };
        assert!((got / 1e6 - 1.0).abs() < 1e-12);
        // A ladder that ends in an exact result.
        let exact = Time::to_reach(1e-3, &[(1.0, 0.1), (2.0, 0.0)], true);
        assert_eq!(exact, Some(Time::Between(2.0)));
        assert_eq!(Time::to_reach(1.0, &[], true), None);
        let far = Time::to_reach(1e-7, &points, true);
        assert_eq!(far, Some(Time::MoreThan(1e4)));
        let lawless = Time::to_reach(1e-5, &points, false);
        assert_eq!(lawless, Some(Time::MoreThan(1e4)));
    }
}
