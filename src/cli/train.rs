//! `gonio train`.

use super::{BrdfArgs, Progress, ThreadArgs, build, named, print, refuse_unwritable, wrote};
use crate::brdf::Channels;
use crate::error::{Error, count};
use crate::experiment::{self, Material};
use crate::files::write_atomically;
use crate::reconstruct::{FUNCTIONS, KernelTraining, NODES, TrainError, Training};
use clap::Args;
use std::io::Write;
use std::path::PathBuf;

/// Configurations at which materials are looked at, by default.
const USUAL_NODES: u32 = 60_000;

/// Makes a prior: what many materials have in common, for few readings of another
#[derive(Debug, Args)]
#[command(after_help = "\
Planners and kriging take it as prior = \"FILE\". It is for isotropic, reciprocal and bilateral materials, in every
channel; a run refuses one that was made of a file it tests. The last word of a name is the family of a material
(red-paint and gold-paint2 are paint): how far to trust the prior is seen by families that are left out.

  gonio train MERL --except brass,nickel -o prior.gonio
  gonio train MERL --except brass,nickel --kernel -o kernels.json
  gonio next --set 'prior=\"prior.gonio\"' --batch 8 -o poses.csv")]
pub(super) struct Train {
    #[command(flatten)]
    brdf: BrdfArgs,
    /// Materials to leave out, by name, joined by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    except: Vec<String>,
    /// Functions by which materials differ, at most
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u16).range(1..=FUNCTIONS as i64))]
    functions: u16,
    /// Configurations at which materials are looked at, at most
    #[arg(long, value_name = "N", default_value_t = USUAL_NODES,
        value_parser = clap::value_parser!(u32).range(*NODES.start() as i64..=*NODES.end() as i64))]
    nodes: u32,
    /// Kernels of kriging instead: for each parametrization, plain and warped, constants that suit these materials, as JSON
    #[arg(long, conflicts_with_all = ["functions", "nodes"])]
    kernel: bool,
    /// The file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl Train {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        refuse_unwritable(&self.output, self.force)?;
        let mut materials = self.brdf.plan()?.materials;
        for name in &self.except {
            named("--except", name, &materials, |m| &m.name)?;
        }
        materials.retain(|m| !self.except.contains(&m.name));
        let refused = |e: TrainError| Error::config("gonio train", e);
        if self.kernel {
            return self.kernels(&materials);
        }
        let mut training = Training::new(self.nodes as usize).map_err(refused)?;
        Progress::over(&materials, |material, _| {
            let channels = match material.is_coloured() {
                true => Channels::Rgb,
                false => Channels::Luminance,
            };
            let brdf = build(material, channels)?;
            let content = experiment::content(material)?;
            let added = training.add(&material.name, &content, &*brdf);
            added.map_err(|e| Error::data(&material.name, e))
        })?;
        let families = training.families();
        let prior = training.prior(self.functions.into()).map_err(refused)?;
        let bytes = prior.to_bytes();
        self.write(&bytes)?;
        let [scale, share] = prior.scale_and_share();
        print(&format!(
            "{} of {families} families, {}, {:.2} MB\nkernel: scale {scale:.3}, share {share:.3}{}\n",
            count(prior.materials().len(), "material"),
            count(prior.functions(), "function"),
            bytes.len() as f64 / 1e6,
            match families {
                0 | 1 => ", not fitted: one family cannot be left out",
                _ => "",
            },
        ))
    }

    /// Writes kernels of these materials.
    fn kernels(&self, materials: &[Material]) -> Result<(), Error> {
        let mut training = KernelTraining::default();
        let progress = Progress::over(materials, |material, _| {
            let brdf = build(material, Channels::Luminance)?;
            let added = training.add(&material.name, &*brdf);
            added.map_err(|e| Error::data(&material.name, e))
        })?;
        let except = match self.except.as_slice() {
            [] => String::new(),
            names => format!(" --except {}", names.join(",")),
        };
        let command = format!("gonio train DIR{except} --kernel");
        let kernels = training.kernels(command, |next| progress.doing(|| next.into()));
        drop(progress);
        let kernels = kernels.map_err(|e| Error::config("gonio train", e))?;
        self.write(kernels.to_json().as_bytes())?;
        let materials = count(kernels.materials.len(), "material");
        let kernels = count(kernels.constants.len(), "kernel");
        print(&format!("{materials}, {kernels}\n"))
    }

    fn write(&self, bytes: &[u8]) -> Result<(), Error> {
        let written = write_atomically(&self.output, |out| out.write_all(bytes));
        written.map_err(|e| Error::output(&self.output, e))?;
        wrote(&self.output);
        Ok(())
    }
}
