//! `gonio tabulate`.

use super::{ConfigArgs, ThreadArgs, build, choose_material, refuse_existing};
use crate::brdf::measured::merl::{MerlError, MerlGrid, write_merl_file};
use crate::brdf::measured::utia::{UtiaError, write_utia_file};
use crate::error::Error;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Isotropic, over half/difference angles
    Merl,
    /// Anisotropic, over elevations to 75° and azimuths
    Utia,
}

#[derive(Debug, Args)]
pub(super) struct Tabulate {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// The material, by its name; not needed if the config has only one
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Format of the file
    #[arg(long, value_enum, default_value = "merl")]
    format: Format,
    /// The file to write, by custom NAME.binary (merl) or NAME.bin (utia)
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
        let unwritten = |e| Error::output(&self.output, format!("cannot write this file: {e}"));
        let unsuited =
            |e: &dyn std::fmt::Display| Error::config(format!("--material {}", material.name), e);
        match self.format {
            Format::Merl => MerlGrid::holding(&*brdf)
                .and_then(|grid| write_merl_file(&*brdf, grid, &self.output))
                .map_err(|e| match e {
                    MerlError::Io(e) => unwritten(e),
                    e => unsuited(&e),
                }),
            Format::Utia => write_utia_file(&*brdf, &self.output).map_err(|e| match e {
                UtiaError::Io(e) => unwritten(e),
                e => unsuited(&e),
            }),
        }
    }
}
