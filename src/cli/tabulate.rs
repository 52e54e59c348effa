//! `gonio tabulate`.

use super::{ConfigArgs, ThreadArgs, refuse_existing};
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
        let names: Vec<_> = plan.materials.iter().map(|m| m.name.as_str()).collect();
        let chosen = match (&self.material, plan.materials.as_slice()) {
            (None, [only]) => Some(only),
            (None, _) => None,
            (Some(name), all) => all.iter().find(|m| m.name == *name),
        };
        let Some(material) = chosen else {
            let allowed = names.join(", ");
            let message = match &self.material {
                Some(name) => format!("\"{name}\" is not in this config; allowed: {allowed}"),
                None => format!("this config has several materials; allowed: one of {allowed}"),
            };
            return Err(Error::config("--material", message));
        };
        refuse_existing(&self.output, self.force)?;
        let brdf = material.spec.build(plan.channels).map_err(|e| match e {
            crate::brdf::BuildError::Data { path, message } => Error::Data { path, message },
            e => Error::config(format!("--material {}", material.name), e),
        })?;
        let written =
            MerlGrid::holding(&*brdf).and_then(|grid| write_merl_file(&*brdf, grid, &self.output));
        written.map_err(|e| match e {
            MerlError::Io(e) => Error::output(self.output, format!("cannot write this file: {e}")),
            e => Error::config(format!("--material {}", material.name), e),
        })
    }
}
