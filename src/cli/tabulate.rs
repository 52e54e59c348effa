//! `gonio tabulate`.

use super::{ConfigArgs, ThreadArgs, build, choose_material, refuse_existing};
use crate::brdf::measured::merl::{MerlError, MerlGrid, write_merl_file};
use crate::error::Error;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Tabulate {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// The material, by its name; not needed if the config has only one
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// The file to write, by custom NAME.binary
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
}

impl Tabulate {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let source = self.config.source()?;
        let plan = super::plan(&source)?;
        let material = choose_material(&plan.materials, self.material.as_deref())?;
        refuse_existing(&self.output, self.force)?;
        let brdf = build(material, plan.channels)?;
        let written =
            MerlGrid::holding(&*brdf).and_then(|grid| write_merl_file(&*brdf, grid, &self.output));
        written.map_err(|e| match e {
            MerlError::Io(e) => Error::output(self.output, format!("cannot write this file: {e}")),
            e => Error::config(format!("--material {}", material.name), e),
        })
    }
}
