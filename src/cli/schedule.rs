//! `gonio schedule`.

use super::{
    ConfigArgs, JsonArgs, ReadingArgs, SeedArgs, assumed, choose_material, each_once, format_names,
    format_of, keep_named, listed, make_folder, note, one_value, planned_instrument,
    refuse_existing, refuse_unwritable, write_file, writer, written,
};
use crate::error::{Error, ParameterError, count, in_left_open};
use crate::experiment::{Material, Plan, PlannedInstrument, Router, ScheduleKey, Source};
use crate::formats::{CSV, Format, WRITE_SCHEDULE, WriteSchedule};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::Order;
use crate::report::schedule_stem;
use crate::schedule::{Itinerary, Sequence, Unvisited, unvisited};
use clap::Args;
use clap::builder::{PossibleValue, TypedValueParser};
use serde_json::{Value as Json, json};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// One row a pose: index, coordinates, and the elevation and azimuth of both arms in degrees
#[derive(Debug, Args)]
#[command(after_help = "\
A config with several parametrizations, warps, sample sets, budgets, seeds or symmetries of
materials has several schedules. Choose one with the options, which take the names that
results.csv has in its columns; or give a folder (-o DIR/) and get a file for each:

  gonio schedule configs/quickstart.toml --parametrization hybrid --sample-set grid --budget 1000 \\
    -o hybrid.csv
  gonio schedule configs/quickstart.toml -o schedules/ --format json-lines

After an acquisition that was broken off:

  gonio schedule configs/quickstart.toml --parametrization hybrid --sample-set grid --budget 1000 \\
    --append readings.csv --partial -o left.csv")]
#[command(mut_group("ReadingArgs", |group| group.requires("append")))]
pub(super) struct Schedule {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    seed: SeedArgs,
    /// Only this parametrization
    #[arg(long, value_name = "NAME")]
    parametrization: Option<String>,
    /// Only with this warp: `none`, or e.g. `theta_h:square-root`
    #[arg(long, value_name = "WARP")]
    warp: Option<String>,
    /// Only this sample set
    #[arg(long, value_name = "NAME")]
    sample_set: Option<String>,
    /// Only this budget, whether the config has it or not: 500, 1e6
    #[arg(long, value_name = "N", value_parser = super::budget)]
    budget: Option<usize>,
    /// Only as many poses as the instrument can take of, whether the config has them or not
    #[arg(long, value_name = "N", conflicts_with = "budget", value_parser = super::budget)]
    readings: Option<usize>,
    /// Only what takes the instrument this long, whether the config has it or not: 30, 0.5
    #[arg(long, value_name = "M", conflicts_with_all = ["budget", "readings"], value_parser = super::minutes)]
    minutes: Option<f64>,
    /// For this instrument: one of the config, a preset (see `gonio list instruments`) or a file
    #[arg(long, value_name = "NAME|FILE")]
    instrument: Option<String>,
    /// In which order the instrument visits the poses [default: the config's, else two-opt]
    #[arg(long, value_parser = orders())]
    order: Option<Order>,
    /// Leave out the poses the instrument cannot take; the file lists them with their reasons
    #[arg(long)]
    skip_unreachable: bool,
    /// Only for the symmetries of this material
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    #[arg(short, long, value_name = "FILE", default_value = "-",
        help = format!("File ({}), or a folder for several schedules; `-` is stdout",
            WRITE_SCHEDULE.extensions(".")))]
    output: PathBuf,
    /// Format [default: by the file's extension; csv in a folder and on stdout]
    #[arg(long, value_parser = format_names(&WRITE_SCHEDULE))]
    format: Option<Format>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Leave out the poses that have a reading in this file: what is still to be visited, under the
    /// same numbers
    #[arg(long, value_name = "READINGS")]
    append: Option<PathBuf>,
    /// How far light and sensor of a reading may be from the pose that it counts for, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.05, requires = "append",
        value_parser = tolerance)]
    tolerance: f64,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    json: JsonArgs,
}

fn tolerance(text: &str) -> Result<f64, ParameterError> {
    let degrees = text.parse().unwrap_or(f64::NAN);
    in_left_open("tolerance", degrees, 0.0, 10.0)
        .map_err(|e| ParameterError::new(e.key, text, e.allowed))
}

/// A schedule, and the poses of it that are visited.
struct Made {
    schedule: Arc<crate::schedule::Schedule>,
    itinerary: Option<Itinerary>,
    /// Poses that have no reading yet; `None`: not asked for.
    left: Option<Vec<u32>>,
    budget: usize,
}

impl Made {
    fn write(&self, write: WriteSchedule, out: &mut dyn Write) -> io::Result<()> {
        let sequence = match (&self.itinerary, &self.left) {
            (None, Some(left)) => Sequence::Order(left),
            (itinerary, _) => itinerary.as_ref().into(),
        };
        write(&self.schedule, sequence, out)
    }
}

/// What is printed of a schedule that was written: a line for people, and an object for programs.
type Summary = (String, Json);

/// Reads an [`Order`] by its name.
pub(super) fn orders() -> impl TypedValueParser<Value = Order> {
    let named = |order: Order| (order, PossibleValue::new(order.name()));
    one_value(Order::ALL.map(named).into())
}

/// Poses depend on a material by its symmetries alone: a config that names none is for those that have all.
pub(super) fn suppose_material(source: &mut Source) -> Result<(), Error> {
    let table = source.table()?;
    let table = table.get_ref();
    if table.contains_key("material") || table.contains_key("materials_dir") {
        return Ok(());
    }
    let (name, full) = (source.name(), Symmetry::FULL);
    note(&format!(
        "gonio: {name} names no material; the poses are for {full} ones"
    ));
    source.set("material=[{kind=\"lambert\"}]", "no material".into())
}

impl Schedule {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut source = self.config.source()?;
        self.seed.apply(&mut source)?;
        suppose_material(&mut source)?;
        let mut plan = Plan::read_parts(&source)?;
        let symmetries = self.select(&mut plan)?;
        let (units, plan) = (plan.units(), &plan);
        let of = |symmetry| {
            units
                .iter()
                .map(move |unit| plan.schedule_key(unit, symmetry))
        };
        let keys: Vec<ScheduleKey<'_>> = symmetries.into_iter().flat_map(of).collect();
        let mut maker = Maker {
            done: self.read()?,
            options: &self,
            router: Router::default(),
        };
        let stdout = self.output == Path::new("-");
        if !stdout && (names_folder(&self.output) || self.output.is_dir()) {
            return self.export_all(&keys, &mut maker);
        }
        let [key] = keys.as_slice() else {
            let place = self.config.config.display().to_string();
            let several = several(&keys, plan);
            let message = format!("{several}; or give a folder with -o DIR/");
            return Err(Error::config(place, message));
        };
        if stdout && self.json.wanted() {
            let message = "the schedule itself goes to stdout; allowed: with -o FILE";
            return Err(Error::config("--json", message));
        }
        if stdout {
            let write = self.writer(self.format.or(Some(CSV)))?;
            let Some(made) = maker.make(key)? else {
                return Ok(());
            };
            let mut out = BufWriter::new(io::stdout().lock());
            let result = made.write(write, &mut out);
            return written(Path::new("stdout"), result.and_then(|()| out.flush()));
        }
        let write = self.writer(self.format)?;
        refuse_unwritable(&self.output, self.force)?;
        let summary = maker.write(key, write, &self.output)?;
        self.print_summaries(&summary.into_iter().collect::<Vec<_>>())
    }

    /// The pairs that were read already; `None` without `--append`.
    fn read(&self) -> Result<Option<Vec<DirectionPair>>, Error> {
        let Some(path) = &self.append else {
            return Ok(None);
        };
        let paths = std::slice::from_ref(path);
        let readings = self.reading.read_all(paths, &assumed())?;
        for text in &readings.notes {
            note(&format!("gonio: {}: {text}", path.display()));
        }
        let measurement = readings.measurement;
        let poses = measurement.schedule.poses.iter().enumerate();
        let read = poses.filter(|(i, _)| measurement.value(*i).is_some());
        Ok(Some(read.map(|(_, pose)| pose.pair).collect()))
    }

    /// Prints what was written.
    fn print_summaries(&self, summaries: &[Summary]) -> Result<(), Error> {
        let objects: Vec<&Json> = summaries.iter().map(|(_, object)| object).collect();
        let lines = || summaries.iter().map(|(line, _)| line.as_str());
        self.json.print(&objects, |_| lines().collect())
    }

    fn writer(&self, format: Option<Format>) -> Result<WriteSchedule, Error> {
        let format = format_of(&WRITE_SCHEDULE, format, &self.output)?;
        writer(&WRITE_SCHEDULE, &format, &self.output)
    }

    /// Leaves in a plan what the options select, and gives it what they ask for beside it; returns the symmetries
    /// that are selected.
    fn select(&self, plan: &mut Plan) -> Result<Vec<Symmetry>, Error> {
        plan.instruments = self.instruments(plan)?;
        let symmetries = match &self.material {
            None => plan.symmetries(),
            Some(_) => vec![choose_material(&plan.materials, self.material.as_deref())?.symmetry],
        };
        let (name, all) = (self.parametrization.as_deref(), &mut plan.parametrizations);
        keep_named("--parametrization", name, all, |c| c.name())?;
        keep_named("--warp", self.warp.as_deref(), all, |c| &c.warp)?;
        plan.unguided = all[0].unguided();
        let (name, all) = (self.sample_set.as_deref(), &mut plan.sample_sets);
        keep_named("--sample-set", name, all, |s| &s.name)?;
        let of_instruments = [
            ("--readings", self.readings.is_some()),
            ("--minutes", self.minutes.is_some()),
        ];
        let asked = of_instruments.into_iter().find(|(_, is_asked)| *is_asked);
        if let (Some((option, _)), []) = (asked, &plan.instruments[..]) {
            let message = "is for an instrument, and there is none; allowed: with --instrument, \
                           or a config that has one";
            return Err(Error::config(option, message));
        }
        if asked.is_some() || self.budget.is_some() {
            plan.budgets = self.budget.into_iter().collect();
            plan.readings = self.readings.into_iter().collect();
            plan.minutes = self.minutes.into_iter().collect();
        }
        Ok(symmetries)
    }

    /// The instruments that the options select; none: the poses as they are.
    fn instruments(&self, plan: &Plan) -> Result<Vec<PlannedInstrument>, Error> {
        let mut instruments = match &self.instrument {
            None => plan.instruments.clone(),
            Some(name) => vec![planned_instrument(plan, name)?],
        };
        if let Some(order) = self.order {
            if instruments.is_empty() {
                let message = "poses are visited by an instrument, and there is none; allowed: \
                               with --instrument, or a config that has one";
                return Err(Error::config("--order", message));
            }
            for instrument in &mut instruments {
                instrument.use_of.order = order;
            }
        }
        for instrument in instruments.iter().filter(|_| self.instrument.is_some()) {
            let is_wanted = |m: &&Material| self.material.as_ref().is_none_or(|n| *n == m.name);
            for material in plan.materials.iter().filter(is_wanted) {
                let name = format!("material \"{}\"", material.name);
                instrument.check_symmetry(material.symmetry, &name, || "--instrument".into())?;
            }
        }
        Ok(instruments)
    }

    fn export_all(&self, keys: &[ScheduleKey<'_>], maker: &mut Maker<'_>) -> Result<(), Error> {
        let dir = &self.output;
        let format = self.format.unwrap_or(CSV);
        let write = self.writer(Some(format))?;
        make_folder(dir)?;
        let path = |key| dir.join(format!("{}.{}", schedule_stem(key), format.extension()));
        for key in keys {
            refuse_existing(&path(key), self.force)?;
        }
        let write = |key| maker.write(key, write, &path(key)).transpose();
        let summaries = keys.iter().filter_map(write);
        self.print_summaries(&summaries.collect::<Result<Vec<_>, _>>()?)
    }
}

/// Makes schedules, and keeps what they share.
struct Maker<'a> {
    options: &'a Schedule,
    /// Pairs that were read already.
    done: Option<Vec<DirectionPair>>,
    router: Router,
}

impl Maker<'_> {
    /// The schedule of a key, `None` if nothing of it is left to be visited.
    fn make(&mut self, key: &ScheduleKey<'_>) -> Result<Option<Made>, Error> {
        let route = self.router.find(key, false)?;
        let mut made = Made {
            itinerary: route.itinerary().cloned(),
            schedule: route.schedule,
            left: None,
            budget: route.budget,
        };
        if let Some(done) = &self.done {
            let degrees = self.options.tolerance;
            let Unvisited { poses, elsewhere } =
                unvisited(&made.schedule, done, degrees.to_radians());
            let (all, left) = (made.schedule.poses.len(), poses.len());
            let read = all - left;
            let elsewhere = match elsewhere {
                0 => String::new(),
                n => format!("; readings of no pose: {n}"),
            };
            note(&format!(
                "gonio: {read} of {all} poses have a reading within {degrees}°, {left} are left{elsewhere}"
            ));
            if let Some(instrument) = key.instrument {
                let bench = instrument.bench(instrument.use_of.parts(), key.seed);
                let bench = bench.map_err(Error::internal)?;
                let order = instrument.use_of.order;
                made.itinerary = Some(bench.plan_of(&made.schedule, &poses, order));
            }
            made.left = Some(poses);
        }
        let skip = self.options.skip_unreachable;
        match (&made.itinerary, &made.left) {
            (Some(i), _) if !i.unreachable.is_empty() && !skip => {
                Err(Error::infeasible("--instrument", out_of_reach(i)))
            }
            (Some(Itinerary { visits, .. }), Some(_)) if visits.is_empty() => Ok(None),
            (None, Some(left)) if left.is_empty() => Ok(None),
            _ => Ok(Some(made)),
        }
    }

    fn write(
        &mut self,
        key: &ScheduleKey<'_>,
        write: WriteSchedule,
        path: &Path,
    ) -> Result<Option<Summary>, Error> {
        let Some(made) = self.make(key)? else {
            let path = path.display();
            note(&format!(
                "gonio: {path}: nothing is left, no file is written"
            ));
            return Ok(None);
        };
        write_file(path, |out| made.write(write, out))?;
        let all = made.schedule.poses.len();
        let poses = made.left.as_ref().map_or(all, Vec::len);
        let (parametrization, set) = (key.coordinates.label(), &key.sample_set.name);
        let mut line = format!("{parametrization}, {set}: {}", count(poses, "pose"));
        let mut object = json!({
            "file": path.to_string_lossy(),
            "parametrization": parametrization,
            "sample_set": set,
            "poses": poses,
            "budget": made.budget,
        });
        if let Some(itinerary) = &made.itinerary {
            let (instrument, minutes) = (&itinerary.instrument, itinerary.seconds() / 60.0);
            let lost = itinerary.unreachable.len();
            line += &format!(", {lost} out of reach of {instrument}, {minutes:.1} minutes");
            object["visits"] =
                json!({"instrument": instrument, "out_of_reach": lost, "minutes": minutes});
        }
        Ok(Some((line + "\n", object)))
    }
}

/// Most poses that a sentence names.
const NAMED: usize = 5;

/// A sentence about the poses an instrument cannot take.
pub(super) fn out_of_reach(itinerary: &Itinerary) -> String {
    let all = itinerary.visits.len() + itinerary.unreachable.len();
    let first = itinerary.unreachable.iter().take(NAMED);
    let named = first.map(|(pose, reason)| format!("{pose}: {}", reason.name()));
    let more = match itinerary.unreachable.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    let skip = match itinerary.visits.is_empty() {
        true => "",
        false => ", or --skip-unreachable, which lists them all in the file",
    };
    let (instrument, lost) = (&itinerary.instrument, itinerary.unreachable.len());
    let named = listed(named);
    format!(
        "{instrument} cannot take {lost} of {all} poses ({named}{more}); allowed: an instrument that can{skip}"
    )
}

/// True if a path can only be a folder.
fn names_folder(path: &Path) -> bool {
    let text = path.as_os_str().as_encoded_bytes();
    text.ends_with(b"/") || text.ends_with(std::path::MAIN_SEPARATOR_STR.as_bytes())
}

/// A sentence about the options in which the schedules of a plan differ.
fn several(keys: &[ScheduleKey<'_>], plan: &Plan) -> String {
    let kinds = keys.iter().map(|k| k.coordinates.name());
    let warps = keys.iter().map(|k| &k.coordinates.warp);
    let sets = plan.sample_sets.iter().map(|s| s.name.clone());
    let instruments = plan.instruments.iter().map(|i| i.name.clone());
    let is_folded_differently = keys.iter().any(|k| k.symmetry != keys[0].symmetry);
    let materials = plan.materials.iter().filter(|_| is_folded_differently);
    let materials = materials.map(|m| m.name.clone());
    // Where there is more than one allowance, each is a choice.
    let fewest = if plan.allowances().len() > 1 { 1 } else { 2 };
    let options = [
        ("--parametrization", names(kinds), 2),
        ("--warp", names(warps), 2),
        ("--sample-set", names(sets), 2),
        ("--budget", names(&plan.budgets), fewest),
        ("--readings", names(&plan.readings), fewest),
        ("--minutes", names(&plan.minutes), fewest),
        ("--instrument", names(instruments), 2),
        ("--seed", names(&plan.seeds), 2),
        ("--material", names(materials), 2),
    ];
    let options = options.into_iter();
    let options = options.filter(|(_, names, fewest)| names.len() >= *fewest);
    let options = options.map(|(option, names, _)| format!("{option} ({})", names.join(", ")));
    let (count, options) = (keys.len(), listed(options));
    format!("this config has {count} schedules; choose one with {options}")
}

/// Values of an option, each once.
fn names<T: ToString>(all: impl IntoIterator<Item = T>) -> Vec<String> {
    each_once(all.into_iter().map(|value| value.to_string()))
}
