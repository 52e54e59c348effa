//! `gonio measure`.

use super::schedule::out_of_reach;
use super::{
    ConfigArgs, ReadingsFile, ThreadArgs, assumed, build, choose_material, format_names, listed,
    note, planned_instrument, print, read_schedule,
};
use crate::error::{Error, count};
use crate::experiment::{IDEAL, Plan, PlannedInstrument};
use crate::formats::{Format, READ_SCHEDULE, WRITE_READINGS};
use crate::instrument::{Ideal, Instrument};
use crate::measurement::About;
use crate::schedule::{Assume, Sequence};
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Measures exactly the poses of the file, in its order
#[derive(Debug, Args)]
#[command(after_help = "\
The schedule is one that `gonio schedule` wrote, or any CSV with the columns theta_i_deg, phi_i_deg,
theta_o_deg and phi_o_deg:

  gonio schedule configs/quickstart.toml --parametrization hybrid --sample-set grid --budget 1000 \\
    -o poses.csv
  gonio measure poses.csv --config configs/quickstart.toml --material ggx-0.05 -o readings.csv
  gonio reconstruct readings.csv --against configs/quickstart.toml --material ggx-0.05")]
pub(super) struct Measure {
    #[arg(help = format!("The schedule ({})", READ_SCHEDULE.extensions(".")))]
    schedule: PathBuf,
    /// The config that has the material, or a material: a table, readings or a kind
    #[arg(long, value_name = "CONFIG|BRDF")]
    config: PathBuf,
    /// Override a key of the config, or set one of the material
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The material, by its name; not needed if the config has only one
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// The instrument: one of the config, a preset (see `gonio list instruments`) or a file
    /// [default: the config's, if it has one, else the ideal one]
    #[arg(long, value_name = "NAME|FILE")]
    instrument: Option<String>,
    /// Measure the other poses where the instrument cannot take all; the file says which and why
    #[arg(long)]
    skip_unreachable: bool,
    /// Seed of the noise and of the errors the instrument happens to have [default: the config's]
    #[arg(long, value_name = "N", value_parser = super::whole::<0, { u64::MAX }>)]
    seed: Option<u64>,
    #[arg(short, long, value_name = "FILE",
        help = format!("The file to write ({}); a folder of a format that has one light a file (--format pab-opto)",
            WRITE_READINGS.extensions(".")))]
    output: PathBuf,
    /// Format of the file [default: by its extension]
    #[arg(long, value_parser = format_names(&WRITE_READINGS))]
    format: Option<Format>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl Measure {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let file = ReadingsFile::new(self.format, &self.output)?;
        file.refuse_existing(self.force)?;
        let (config, set) = (self.config.clone(), self.set.clone());
        let source = ConfigArgs { config, set }.source()?;
        let plan = Plan::read_parts(&source)?;
        let material = choose_material(&plan.materials, self.material.as_deref())?;
        super::remark(std::slice::from_ref(material));
        let assume = Assume {
            otherwise: material.symmetry,
            ..assumed()
        };
        let poses = read_schedule(&self.schedule, &assume)?;
        let folded = poses.schedule.parametrization.symmetry();
        if folded.and(material.symmetry) != folded {
            let (name, held) = (&material.name, material.symmetry);
            note(&format!(
                "gonio: the schedule is for {folded} materials; {name} is {held}"
            ));
        }
        let brdf = build(material, plan.channels.clone())?;
        let instrument = self.instrument(&plan)?;
        // A plan has one seed or more.
        let seed = self.seed.unwrap_or(plan.seeds[0]);
        let about = About {
            is_bare: false,
            material: Some(material.name.clone()),
            instrument: Some(instrument.as_ref().map_or(IDEAL, |i| &i.name).into()),
            realisation: instrument.as_ref().map(|i| i.realisation(seed)),
            seed: instrument.as_ref().map(|_| seed),
            schedule_hash: Some(poses.hash.clone()),
            foreign_header: None,
        };
        if let (Some(planned), Some(instrument)) = (&poses.instrument, &instrument)
            && *planned != instrument.spec.name
        {
            let (name, finds) = (&instrument.name, "finds its own positions and times");
            note(&format!(
                "gonio: the schedule was planned for {planned}; {name} {finds}"
            ));
        }
        let (order, lost) = (poses.order, poses.unreachable);
        let schedule = Arc::new(poses.schedule);
        let mut minutes = String::new();
        let (measurement, itinerary) = match &instrument {
            None => {
                let measurement = Ideal.measure(&*brdf, &schedule);
                (measurement.of_poses(&order, &lost), None)
            }
            Some(instrument) => {
                let name = format!("the schedule for \"{}\"", material.name);
                instrument.check_symmetry(folded, &name, || "--instrument".into())?;
                let bench = instrument.bench(instrument.use_of.parts(), seed);
                let bench = bench.map_err(Error::internal)?;
                let mut itinerary = bench.plan_given(&schedule, &order);
                let is_partial = !itinerary.unreachable.is_empty() && !self.skip_unreachable;
                if is_partial || itinerary.visits.is_empty() {
                    return Err(Error::infeasible("--instrument", out_of_reach(&itinerary)));
                }
                minutes = format!(", {:.1} minutes", itinerary.seconds() / 60.0);
                // What the schedule left out keeps its reason.
                itinerary.unreachable.extend(&lost);
                let measurement = bench.session(&itinerary, seed).measure(&*brdf, &schedule);
                (measurement, Some(itinerary))
            }
        };
        let mut rows = order.clone();
        let sequence = match &itinerary {
            Some(itinerary) => Sequence::Visits(itinerary),
            None => {
                rows.extend(lost.iter().map(|(pose, _)| pose));
                Sequence::Order(&rows)
            }
        };
        file.write(&measurement, &about, sequence)?;
        let poses = count(order.len() + lost.len(), "pose");
        let readings = count(measurement.readings(), "reading");
        let (holes, lost) = (measurement.no_data(), measurement.unreachable());
        print(&format!(
            "{poses}: {readings}, {holes} without data, {lost} out of reach{minutes}\n"
        ))
    }

    /// The instrument that measures; `None`: the ideal one.
    fn instrument(&self, plan: &Plan) -> Result<Option<PlannedInstrument>, Error> {
        if let Some(name) = &self.instrument {
            return planned_instrument(plan, name).map(Some);
        }
        match plan.instruments.as_slice() {
            [] => Ok(None),
            [one] => Ok(Some(one.clone())),
            several => {
                let (count, names) = (several.len(), listed(several.iter().map(|i| &i.name)));
                let message = format!(
                    "this config has {count} instruments; choose one with --instrument ({names})"
                );
                Err(Error::config(self.config.display().to_string(), message))
            }
        }
    }
}
