//! `gonio measure`.

use super::check::words;
use super::{ThreadArgs, build, choose_material, print, read_text, refuse_existing, say, written};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::Source;
use crate::files::write_atomically;
use crate::instrument::{Ideal, Instrument};
use crate::measurement::{About, Measurement, write_measurement};
use crate::schedule::{Assume, ScheduleFile, ScheduleFormat, Sequence, read_schedule};
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Measures exactly the poses of the file, in its order
#[derive(Debug, Args)]
#[command(after_help = "\
The schedule is one that `gonio schedule` wrote, or any CSV with the columns theta_i_deg, phi_i_deg,
theta_o_deg and phi_o_deg:

  gonio schedule configs/quickstart.toml --parametrization hybrid --budget 1000 -o poses.csv
  gonio measure poses.csv --config configs/quickstart.toml --material \"ggx 2\" -o readings.csv
  gonio reconstruct readings.csv --against configs/quickstart.toml --material \"ggx 2\"")]
pub(super) struct Measure {
    /// The schedule (.csv, .jsonl)
    schedule: PathBuf,
    /// The config that has the material
    #[arg(long, value_name = "CONFIG")]
    config: PathBuf,
    /// Override a key of the config
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The material, by its name; not needed if the config has only one
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Seed of the noise, which the ideal instrument has none of; kept in the file
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The file to write (.csv, .jsonl)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl Measure {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let Some(format) = ScheduleFormat::of(&self.output) else {
            let message = "the format is not known by this name; allowed: .csv, .jsonl";
            return Err(Error::output(self.output, message));
        };
        refuse_existing(&self.output, self.force)?;
        let mut source = Source::read(&self.config)?;
        for assignment in &self.set {
            source.set(assignment, format!("--set {assignment}"))?;
        }
        let plan = super::plan(&source)?;
        let material = choose_material(&plan.materials, self.material.as_deref())?;
        let assume = Assume {
            otherwise: material.symmetry,
            ..Assume::default()
        };
        let name = self.schedule.display().to_string();
        let file = read_schedule(&read_text(&self.schedule)?, &name, &assume)?;
        let folded = file.schedule.parametrization.symmetry();
        if folded.and(material.symmetry) != folded {
            say(&format!(
                "gonio: the schedule is for {} materials; {} is {}",
                words(folded),
                material.name,
                words(material.symmetry),
            ));
        }
        let brdf = build(material, plan.channels)?;
        let about = About {
            material: Some(material.name.clone()),
            instrument: Some("ideal".into()),
            realisation: None,
            seed: self.seed,
            schedule_hash: Some(file.hash.clone()),
        };
        let (measurement, order) = measured(&Ideal, &*brdf, file);
        let sequence = Sequence::Order(&order);
        written(
            &self.output,
            write_atomically(&self.output, |out| {
                write_measurement(&measurement, &about, sequence, format, out)
            }),
        )?;
        print(&format!(
            "{} poses: {} readings, {} without data\n",
            measurement.outcomes.len(),
            measurement.readings(),
            measurement.no_data(),
        ))
    }
}

/// What an instrument reports of the poses of a file, and the order of its rows.
fn measured(
    instrument: &dyn Instrument,
    brdf: &dyn Brdf,
    file: ScheduleFile,
) -> (Measurement, Vec<u32>) {
    let schedule = Arc::new(file.schedule);
    (instrument.measure(brdf, &schedule), file.order)
}
