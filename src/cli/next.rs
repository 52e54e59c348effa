//! `gonio next`.

use super::reconstruct::symmetry;
use super::schedule::{orders, out_of_reach};
use super::{
    ReadingArgs, ThreadArgs, assumed, format_names, format_of, member, note, print,
    refuse_unwritable, suspected, whole, with_bound, with_keys, write_file, writer,
};
use crate::acquisition::{self, Forecast, MomentAim, MomentForecast, Planner, Task};
use crate::error::{Error, count};
use crate::experiment::PlannedInstrument;
use crate::formats::{Format, WRITE_SCHEDULE};
use crate::geometry::Symmetry;
use crate::instrument::{Machine, Order};
use crate::measurement::Measurement;
use crate::metrics::Expected;
use crate::schedule::{Assume, Itinerary, Sequence};
use clap::Args;
use std::path::PathBuf;

/// Chooses the poses that tell most of a material, given its readings so far
#[derive(Debug, Args)]
#[command(after_help = "\
A laboratory goes round: poses, readings, further poses. All that is known is in the files of readings,
so that it can stop, and start again, after any step. Without a file the poses are those that tell most
of any material:

  gonio next --batch 16 --instrument cornell -o poses1.csv
  gonio measure poses1.csv --config configs/quickstart.toml --material ggx-0.3 --instrument cornell \\
    -o readings1.csv
  gonio next readings1.csv --batch 16 --instrument cornell -o poses2.csv
  gonio measure poses2.csv --config configs/quickstart.toml --material ggx-0.3 --instrument cornell \\
    -o readings2.csv
  gonio next readings1.csv readings2.csv --batch 16 --instrument cornell -o poses3.csv

Once the upper bounds of the errors have reached a target (--set target.nrmse=0.05), or that of a moment its level
(--for variance=5%), it prints `stop: …` and leaves no schedule.")]
pub(super) struct Next {
    /// The readings so far, in any number of files; poses without a reading count as asked for
    readings: Vec<PathBuf>,
    /// Number of poses to choose
    #[arg(long, value_name = "N", value_parser = super::budget)]
    batch: usize,
    /// The planner, see `gonio list planners`
    #[arg(long, value_name = "KIND", default_value = "adaptive")]
    planner: String,
    /// Choose poses for a moment of slices without their diffuse part instead, until its error is below a level: variance=5%, mean_deg_40_70=1,
    /// energy (of its own level, 1 %); at 0 without a stop
    #[arg(long = "for", value_name = "MOMENT[=LEVEL]")]
    moment: Option<MomentAim>,
    /// Set a key of the planner, e.g. weight=0.5
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Symmetries of the material, joined by commas: isotropic, reciprocal, bilateral; or none
    /// [default: those of the file, else all three]
    #[arg(long, value_name = "LIST", value_parser = symmetry)]
    symmetry: Option<Symmetry>,
    /// For this instrument: a preset (see `gonio list instruments`) or a file; it visits the poses in the
    /// shortest time, and none is out of its reach
    #[arg(long, value_name = "NAME|FILE")]
    instrument: Option<String>,
    /// In which order the instrument visits the poses [default: two-opt]
    #[arg(long, requires = "instrument", value_parser = orders())]
    order: Option<Order>,
    /// Seed of the poses to choose from
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<0, { u64::MAX }>)]
    seed: u64,
    #[arg(short, long, value_name = "FILE",
        help = format!("The schedule to write ({}); the most informative pose first, if no instrument orders them",
            WRITE_SCHEDULE.extensions(".")))]
    output: PathBuf,
    /// Format of the file [default: by its extension]
    #[arg(long, value_parser = format_names(&WRITE_SCHEDULE))]
    format: Option<Format>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

impl Next {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let format = format_of(&WRITE_SCHEDULE, self.format, &self.output)?;
        let write = writer(&WRITE_SCHEDULE, &format, &self.output)?;
        refuse_unwritable(&self.output, self.force)?;
        let planner = self.planner()?;
        let assume = Assume {
            symmetry: self.symmetry,
            otherwise: Symmetry::FULL,
            ..assumed()
        };
        let so_far = match self.readings.as_slice() {
            [] => None,
            paths => {
                let so_far = self.reading.read_all(paths, &assume)?;
                for note in so_far.notes {
                    print(&format!("{note}\n"))?;
                }
                Some(so_far.measurement)
            }
        };
        let symmetry = match &so_far {
            Some(so_far) => so_far.schedule.parametrization.symmetry(),
            None => self.symmetry.unwrap_or(Symmetry::FULL),
        };
        let instrument = match &self.instrument {
            Some(name) => {
                let planned = PlannedInstrument::load(name, self.order.unwrap_or_default())?;
                planned.check_symmetry(symmetry, "the material", || "--instrument".into())?;
                let bench = planned.bench(planned.use_of.parts(), self.seed);
                Some((bench.map_err(Error::internal)?, planned))
            }
            None => None,
        };
        let task = Task {
            machine: instrument.as_ref().map(|(bench, _)| bench.machine()),
            ..Task::after(so_far.as_ref(), self.batch, symmetry, self.seed)
        };
        let batch = task.ask(&*planner, so_far.as_ref());
        let batch = batch.map_err(|e| Error::infeasible("--batch", e))?;
        let (schedule, readings) = (&batch.schedule, batch.readings);
        if batch.is_enough {
            let known = batch.forecast.map(|f| {
                let of_moment = f.moment.map(|m| format!(", {}", of_moment(&m)[0]));
                with_bound(&f.now, readings) + &of_moment.unwrap_or_default()
            });
            if self.output.is_file() {
                // To be replaced by nothing: its poses are not to be read again.
                let removed = std::fs::remove_file(&self.output);
                removed.map_err(|e| Error::output(&self.output, e))?;
            }
            return print(&format!("stop: {}\n", known.unwrap_or_default()));
        }
        let chosen = schedule.poses.len();
        if chosen == 0 {
            let message = format!("{} has no further pose", self.planner);
            return Err(Error::infeasible("--planner", message));
        }
        let mut minutes = String::new();
        let itinerary = match &instrument {
            Some((bench, instrument)) => {
                let itinerary = bench.plan(schedule, instrument.use_of.order);
                if !itinerary.unreachable.is_empty() {
                    return Err(Error::infeasible("--instrument", out_of_reach(&itinerary)));
                }
                let tile = instrument.spec.calibration.seconds * calibrations(&itinerary) as f64;
                minutes = format!(
                    ", {:.1} minutes, {:.1} of them at the reference tile",
                    itinerary.seconds() / 60.0,
                    tile / 60.0
                );
                Some(itinerary)
            }
            None => None,
        };
        let sequence = Sequence::from(itinerary.as_ref());
        write_file(&self.output, |out| write(schedule, sequence, out))?;
        print(&format!(
            "so far: {}, {}\nnext: {}{minutes}\n",
            count(batch.asked, "pose"),
            count(readings, "reading"),
            count(chosen, "pose"),
        ))?;
        if chosen < self.batch {
            note(&format!(
                "gonio: fewer than {}: {}",
                self.batch,
                match task.machine.and_then(Machine::stop_angle) {
                    Some(_) => "the pictures of the stops that were chosen hold no more",
                    None => "the instrument can take no more of those there are to choose from",
                }
            ));
        }
        let Some(Forecast {
            now,
            then,
            moment,
            suspects,
        }) = &batch.forecast
        else {
            return Ok(());
        };
        if let Some(so_far) = &so_far {
            print(&suspected(so_far, &self.readings, suspects))?;
            self.note_rise(&assume, now, |before| planner.forecast(&task, before, &[]))?;
        }
        let both = [(now, readings), (then, readings + chosen)];
        let [now, then] = both.map(|(errors, readings)| with_bound(errors, readings));
        if let (Some(aim), None) = (self.moment, moment) {
            note(&format!(
                "gonio: {} of these readings is not defined: the material is matte or black; poses are those for the BRDF",
                aim.column()
            ));
        }
        let more = moment.as_ref().map(of_moment);
        let [more_now, more_then] = more.map_or_else(Default::default, |more| {
            more.map(|text| format!(", {text}"))
        });
        print(&format!("now: {now}{more_now}\nthen: {then}{more_then}\n"))
    }

    /// Says so where the last file of several raised an expected error: its readings are unlike what those before promised.
    fn note_rise(
        &self,
        assume: &Assume,
        now: &Expected,
        forecast: impl FnOnce(&Measurement) -> Option<Forecast>,
    ) -> Result<(), Error> {
        let Some((last, before @ [_, ..])) = self.readings.split_last() else {
            return Ok(());
        };
        let before = self.reading.read_all(before, assume)?.measurement;
        let Some(Forecast { now: before, .. }) = forecast(&before) else {
            return Ok(());
        };
        for (name, before, now) in [
            ("nrmse", before.nrmse, now.nrmse),
            ("log_relative", before.log_relative, now.log_relative),
        ] {
            if let (Some(before), Some(now)) = (before, now)
                && now > before
            {
                note(&format!(
                    "gonio: the readings of {} raise the expected {name} from {before:.4} to {now:.4}: they are not what those before promised",
                    last.display()
                ));
            }
        }
        Ok(())
    }

    /// The planner that is asked for, a sample set or not.
    fn planner(&self) -> Result<Box<dyn Planner>, Error> {
        let entry = member("--planner", "planner", &self.planner, &acquisition::all())?;
        let mut keys = self.set.clone();
        keys.extend(self.moment.map(|aim| format!("for=\"{aim}\"")));
        let planner = with_keys(&entry, &keys)?;
        planner.check(&[]).map_err(|e| Error::config("--set", e))?;
        Ok(planner)
    }
}

/// The expected errors of a moment, now and then, with what nine of ten are below.
fn of_moment(moment: &MomentForecast) -> [String; 2] {
    let bounds = moment.bounds();
    let both = [(moment.now, bounds[0]), (moment.then, bounds[1])];
    let name = moment.aim.column();
    both.map(|(expected, bound)| format!("{name} {expected:.4} (upper bound {bound:.4})"))
}

/// How often the tile is read: a batch that follows at once needs no reading of it at its start.
fn calibrations(itinerary: &Itinerary) -> usize {
    let ends = itinerary.visits.iter();
    let mut ends: Vec<f64> = ends
        .map(|v| v.at_seconds - v.since_calibration_seconds)
        .collect();
    ends.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
    ends.len()
}
