//! `gonio density`.

use super::{JsonArgs, ThreadArgs, assumed, print, print_json, read_schedule};
use crate::analysis::{self, Density};
use crate::error::{Error, ParameterError, count, in_left_open};
use crate::formats::READ_SCHEDULE;
use crate::geometry::{DirectionPair, Symmetry};
use crate::report::Columns;
use crate::schedule::Assume;
use crate::statistics::mean_and_error;
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// Tells which coordinates poses follow: where their uniform points are dense
#[derive(Debug, Args)]
#[command(after_help = "\
For each pose the logarithm of the density that uniform points of the coordinates have there, over that of uniform
pairs of directions; half a degree about it counts, so that poles have a value. The coordinates of the largest mean
are those that the poses follow most, and if they follow them altogether the mean is that of their own points.

Schedules are taken for independent: those of one planner and one budget, of several materials or seeds.

  gonio run configs/planning.toml --set materials_dir=MERL --set output.schedules=csv -o out
  gonio density out/schedules/*_adaptive_64_*")]
pub(super) struct DensityArgs {
    #[arg(required = true, value_name = "SCHEDULE",
        help = format!("Schedules ({}); those of several materials or seeds tell how far the means are known",
            READ_SCHEDULE.extensions(".")))]
    schedules: Vec<PathBuf>,
    /// Largest elevation of poses that count, degrees
    #[arg(long, value_name = "DEG", default_value_t = 80.0, value_parser = elevation)]
    elevation: f64,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

fn elevation(text: &str) -> Result<f64, ParameterError> {
    let number = text.trim().parse().unwrap_or(f64::NAN);
    in_left_open("elevation", number, 0.0, 90.0)
}

/// Coordinates, and how far poses follow them.
#[derive(Serialize)]
struct Line {
    coordinates: String,
    warp: String,
    /// Mean over files of the mean log density of their poses, and its standard error; with one file over its poses.
    log_density: f64,
    standard_error: Option<f64>,
    /// What it is less than that of the first coordinates, and the standard error of that.
    less_than_first: f64,
    standard_error_of_less: Option<f64>,
    /// The mean of the coordinates' own uniform points.
    of_own_points: f64,
    /// Its standard error.
    standard_error_of_own: Option<f64>,
    /// What is independent: mean log densities of files, or those of the poses of the only one.
    #[serde(skip)]
    values: Vec<Option<f64>>,
}

impl DensityArgs {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let mut symmetry: Option<Symmetry> = None;
        let mut files: Vec<Vec<DirectionPair>> = Vec::new();
        let assume = Assume {
            otherwise: Symmetry::FULL,
            ..assumed()
        };
        for path in &self.schedules {
            let schedule = read_schedule(path, &assume)?.schedule;
            let folded = schedule.parametrization.symmetry();
            if symmetry.is_some_and(|known| known != folded) {
                let message =
                    "its symmetries are not those of the first; allowed: schedules that fold alike";
                return Err(Error::data(path, message));
            }
            symmetry = Some(folded);
            files.push(schedule.poses.iter().map(|pose| pose.pair).collect());
        }
        let symmetry = symmetry.unwrap_or(Symmetry::FULL);
        let elevation = self.elevation.to_radians();
        let mut lines: Vec<Line> = Vec::new();
        let is_within = |pair: &&DirectionPair| analysis::is_within(pair, elevation);
        let counted = files.iter().flatten().filter(is_within).count();
        for (name, form) in analysis::fine_and_plain(symmetry) {
            let warp = form.warp_name();
            let too_few = |what: &str| {
                let most = self.elevation;
                let message = format!("within {most}° there are too few {what}; allowed: more");
                Error::config("--elevation", message)
            };
            let points = || format!("points of {name} coordinates");
            let density = Density::new(form, elevation).ok_or_else(|| too_few(&points()))?;
            let of = |pairs: &Vec<DirectionPair>| -> Vec<Option<f64>> {
                pairs.par_iter().map(|pair| density.log(pair)).collect()
            };
            let logs: Vec<Vec<Option<f64>>> = files.iter().map(of).collect();
            let mean = |logs: &Vec<Option<f64>>| Some(mean_and_error(&present(logs))?.0);
            let values = match logs.as_slice() {
                [only] => only.clone(),
                _ => logs.iter().map(mean).collect(),
            };
            let known = mean_and_error(&present(&values));
            let (log_density, standard_error) = known.ok_or_else(|| too_few("poses"))?;
            let own = mean_and_error(&density.of_own()).ok_or_else(|| too_few(&points()))?;
            lines.push(Line {
                coordinates: name.into(),
                warp,
                log_density,
                standard_error,
                less_than_first: 0.0,
                standard_error_of_less: None,
                of_own_points: own.0,
                standard_error_of_own: own.1,
                values,
            });
        }
        lines.sort_by(|a, b| b.log_density.total_cmp(&a.log_density));
        let first = lines[0].values.clone();
        for line in &mut lines[1..] {
            let both = first.iter().zip(&line.values);
            let less: Vec<f64> = both.filter_map(|(a, b)| Some((*a)? - (*b)?)).collect();
            if let Some((mean, error)) = mean_and_error(&less) {
                (line.less_than_first, line.standard_error_of_less) = (mean, error);
            }
        }
        if self.json.wanted() {
            return print_json(&lines);
        }
        let head = "coordinates\t>mean ln density\t>less than the first\t>of their own points";
        let mut columns = Columns::new(head);
        let known = |value: f64, error: Option<f64>| match error {
            Some(error) => format!("{value:.2} ± {error:.2}"),
            None => format!("{value:.2}"),
        };
        for (i, line) in lines.iter().enumerate() {
            let warp = match line.warp.as_str() {
                "none" => String::new(),
                warp => format!(" {warp}"),
            };
            let less = match i {
                0 => String::new(),
                _ => known(line.less_than_first, line.standard_error_of_less),
            };
            let (coordinates, own) = (&line.coordinates, line.of_own_points);
            let all = known(line.log_density, line.standard_error);
            let own = known(own, line.standard_error_of_own);
            columns.row(&format!("{coordinates}{warp}\t{all}\t{less}\t{own}"));
        }
        let poses: usize = files.iter().map(Vec::len).sum();
        let left = match poses - counted {
            0 => String::new(),
            left => format!("; {left} beyond {}° are left out", self.elevation),
        };
        let (poses, files) = (count(counted, "pose"), count(files.len(), "file"));
        print(&format!("{poses} of {files}{left}\n\n{columns}"))
    }
}

/// Those that are there.
fn present(values: &[Option<f64>]) -> Vec<f64> {
    values.iter().copied().flatten().collect()
}
