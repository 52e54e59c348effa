//! `gonio paths`.

use super::{
    BrdfArgs, DrawingArgs, JsonArgs, Progress, ThreadArgs, choice_of, in_range, print, whole,
};
use crate::brdf::{Channels, Part};
use crate::error::{Error, left_open};
use crate::experiment::split_of;
use crate::parametrization;
use crate::report::BouncesReport;
use crate::schedule::Choice;
use clap::Args;

/// Classes of light.
const BOUNCES: [Choice<Part>; 3] = choices! {
    "first", "Light that met one facet" => Part::First;
    "second", "Two" => Part::Second;
    "later", "Three or more" => Part::Later;
};

#[derive(Debug, Args)]
#[command(after_help = "\
Light paths are followed through the surface. Printed are, with standard errors, the share of light of each number of facets;
how many bits the coordinates of each parametrization tell of that number, by the best axis, the best two and all; the box of
coordinates with almost nothing but light of two facets that holds most of it, as `gonio subset --box` reads it; and the
ranges that hold 95 % of each. Boxes and pictures are of every turn of the sample.

  gonio paths smith-multiple --set alpha=0.5 -o paths.svg
  gonio paths smith-multiple --set alpha=1 --bounce later --purity 0.5")]
pub(super) struct PathsArgs {
    #[command(flatten)]
    brdf: BrdfArgs,
    /// Light paths that are followed, 1024 to 2²⁴
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = whole::<1024, 16_777_216>)]
    paths: u64,
    /// The light that boxes are to hold
    #[arg(long, value_parser = choice_of(&BOUNCES), default_value = "second")]
    bounce: Part,
    /// Share of it in a box, at least
    #[arg(long, value_name = "SHARE", default_value_t = 0.9, value_parser = in_range("purity", left_open(0.0, 1.0)))]
    purity: f64,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    drawing: DrawingArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl PathsArgs {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        self.drawing.check()?;
        let (material, brdf) = self.brdf.one(Channels::Luminance)?;
        let split = split_of(&material.name, &*brdf)?;
        let entries = parametrization::all();
        let mut progress = Progress::with_work(1 + entries.len() as u64, "");
        let report = BouncesReport::new(
            &material.name,
            split,
            self.paths as usize,
            &entries,
            (self.bounce, self.purity),
            |next| {
                progress.advance(1.0);
                progress.doing(|| next.into());
            },
        );
        drop(progress);
        let report = report?;
        match self.json.wanted() {
            // Of a line for each of the maps' numbers most would be spaces.
            true => print(&format!("{}\n", report.json()))?,
            false => print(&report.text())?,
        }
        self.drawing.write(|| Ok(report.svg()))
    }
}
