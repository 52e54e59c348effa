//! `gonio tabulate`.

use super::energy::EnergyArgs;
use super::progress::Progress;
use super::talk::wrote;
use super::{ConfigArgs, ThreadArgs, build, choose_material, format_names, print, refuse_existing};
use crate::brdf::{Brdf, Channels, Presence, Watched};
use crate::error::Error;
use crate::experiment::{Material, Plan, Source};
use crate::formats::{Format, TableError, WRITE_TABLE};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Debug, Args)]
#[command(after_help = "\
A table holds R, G, B: those of the material, unless the config says other channels
(--set channels=luminance writes a grey table).")]
pub(super) struct Tabulate {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// The material, by its name; not needed if the config has only one
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Format of the file [default: by its extension]
    #[arg(long, value_parser = format_names(&WRITE_TABLE))]
    format: Option<Format>,
    #[arg(short, long, value_name = "FILE",
        help = format!("The file to write ({})", WRITE_TABLE.extensions(".")))]
    output: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    energy: EnergyArgs,
}

impl Tabulate {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let format = WRITE_TABLE.format(self.format, &self.output);
        let format = format.map_err(|e| Error::output(&self.output, e))?;
        let source = self.config.source()?;
        let plan = super::plan(&source)?;
        let material = choose_material(&plan.materials, self.material.as_deref())?;
        refuse_existing(&self.output, self.force)?;
        let brdf = build(material, channels(&source, &plan, material)?)?;
        self.energy.check(&*brdf, 0.0)?;
        let name = || format!("--material {}", material.name);
        write(format, &*brdf, &self.output, name)
    }
}

/// The channels of the table: those that the config names; else R, G, B, for which every format has
/// room, of a material that has them.
fn channels(source: &Source, plan: &Plan, material: &Material) -> Result<Channels, Error> {
    let named = source.table()?.get_ref().contains_key("channels");
    Ok(match !named && material.is_coloured() {
        true => Channels::Rgb,
        false => plan.channels.clone(),
    })
}

/// Writes a BRDF as a table; `place` is who chose it.
pub(super) fn write(
    format: Format,
    brdf: &dyn Brdf,
    path: &Path,
    place: impl FnOnce() -> String,
) -> Result<(), Error> {
    let table = WRITE_TABLE.function(&format);
    let table = table.map_err(|e| Error::output(path, e))?;
    let pairs = format.table_pairs.map_or(0, |pairs| pairs(brdf));
    let progress = Progress::of(pairs, "tabulates");
    // Bits of the largest value so far: those of positive numbers stand in their order.
    let largest = AtomicU64::new(0);
    let width = brdf.channels().count();
    let brdf = Watched::new(brdf, |values: &[f64], presence: &[Presence]| {
        let present = values.chunks(width).zip(presence);
        let present = present.filter(|(_, p)| **p == Presence::Present);
        let most = present.flat_map(|(v, _)| v).copied().fold(0.0, f64::max);
        largest.fetch_max(most.to_bits(), Ordering::Relaxed);
        progress.count(presence.len() as u64);
    });
    table(&brdf, path).map_err(|e| match e {
        TableError::Io(_) => Error::output(path, e),
        TableError::Unsuited(_) => Error::config(place(), e),
    })?;
    let largest = f64::from_bits(largest.load(Ordering::Relaxed));
    drop(progress);
    wrote(path);
    print(&format!("largest value: {largest:.4e} 1/sr\n"))
}
