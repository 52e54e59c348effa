//! The command line: one file per command.
//!
//! Results go to stdout or into files, everything else to stderr. Exit codes:
//! see [`Error::exit_code`].

/// Values of an option by their names, and what they mean.
macro_rules! choices {
    ($($name:expr, $meaning:literal => $value:expr;)*) => {
        [$(crate::schedule::choice($value, $name, $meaning)),*]
    };
}

mod advise;
mod bench;
mod brdf_args;
mod cached;
mod check;
mod claims;
mod config_args;
mod convert;
mod cross_validation;
mod density;
mod distortion;
mod energy;
mod explore;
mod init;
mod list;
mod measure;
mod merge;
mod moments;
mod next;
mod output;
mod paths;
mod picture;
mod progress;
mod reading;
mod readings_file;
mod reconstruct;
mod run;
mod sampling;
mod schedule;
mod schema;
mod shell;
mod signals;
mod slice;
mod stability;
mod subset;
mod surface;
mod symmetry;
mod tabulate;
mod train;
mod values;
mod verbosity;

use crate::brdf::{Brdf, BuildError, Channels};
use crate::error::{Error, ParameterError, count, excerpt, listed, one_of};
use crate::experiment::{AnyPlan, Material, Plan, PlannedInstrument, Source};
use crate::files;
use crate::formats::{Format, READ_SCHEDULE, Use, WRITE_TABLE};
use crate::instrument::{self, Order};
use crate::parametrization::{self, ParametrizationSpec};
use crate::registry::Entry;
use crate::report::each_once;
use crate::schedule::{Assume, Choice, ScheduleFile};
use brdf_args::{BrdfArgs, is_config};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, CommandFactory, FromArgMatches, Parser};
use config_args::ConfigArgs;
use output::{DrawingArgs, JsonArgs, OutputArgs, print_json, refuse_other_endings, write_text};
use progress::Progress;
use reading::ReadingArgs;
use readings_file::ReadingsFile;
pub use signals::exit_code;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;
use values::{budget, in_range, minutes, whole};
pub use verbosity::say_error;
use verbosity::{
    VerbosityArgs, color_of, detail, is_quiet, is_verbose, note, say, suspected, with_bound, wrote,
};

/// A virtual gonio-reflectometer: measure, reconstruct and compare BRDFs.
#[derive(Debug, Parser)]
#[command(name = "gonio", version, arg_required_else_help = true)]
#[command(
    after_help = "Exit codes: 0 done; 1 internal error; 2 usage, config or output folder; \
    3 input data; 4 infeasible plan; 5 some jobs failed or are missing; 6 a check found a violation; interrupted: 130 by SIGINT (Ctrl-C), 143 by SIGTERM."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// A choice between commands, each of which runs.
macro_rules! commands {
    ($(#[$of:meta])* $visible:vis enum $commands:ident { $($(#[$meta:meta])* $name:ident($command:ty),)* }) => {
        #[derive(Debug, clap::Subcommand)]
        $(#[$of])*
        $visible enum $commands {
            $($(#[$meta])* $name($command),)*
        }

        impl $commands {
            $visible fn run(self) -> Result<(), Error> {
                match self {
                    $(Self::$name(command) => command.run(),)*
                }
            }
        }
    };
}
use commands;

commands! {
    enum Command {
        /// Write a commented config to start from
        Init(init::Init),
        /// Run an experiment: measure, reconstruct, compare
        Run(run::Run),
        /// Merge the shards of a run
        Merge(merge::Merge),
        /// Check a config and print its plan, with an estimate of its time, without measuring
        Check(check::Check),
        /// List what a config can name
        List(list::List),
        /// Export schedules of a config, for an instrument
        Schedule(schedule::Schedule),
        /// Recommend poses and a reconstruction for a material, by trying them on materials like it
        Advise(advise::Advise),
        /// Choose the poses to measure next, from the readings so far
        Next(next::Next),
        /// Measure a material at the poses of a schedule file
        Measure(measure::Measure),
        /// Reconstruct the BRDF from readings, and report its error
        Reconstruct(reconstruct::Reconstruct),
        /// JSON Schema of configs, instrument files, schedules and readings
        Schema(schema::Schema),
        /// Moment profiles of a material, or of every material of a config
        Moments(moments::Moments),
        /// Pictures of a material seen from chosen elevations
        Slice(slice::Slice),
        /// Symmetries of a material: how far it deviates from them, and what they save
        Symmetry(symmetry::SymmetryArgs),
        /// How far the isolines of a material are from the axes of each parametrization
        Distortion(distortion::Distortion),
        /// Write a page that shows a material, its readings and an instrument, and answers a hand
        Explore(explore::Explore),
        /// Relative variance of light directions drawn from tables, by the coordinates of the tables
        Sampling(sampling::SamplingArgs),
        /// Density of the poses of schedules in each parametrization
        Density(density::DensityArgs),
        /// Check the claims of Barla et al. 2015 about the parametrizations
        Claims(claims::Claims),
        /// Pictures of parametrizations, materials and reconstructions
        #[command(subcommand)]
        Picture(picture::Picture),
        /// Pairs of directions in a box of coordinates
        Subset(subset::Subset),
        /// Statistics of light in each parametrization, by scattering order
        Paths(paths::PathsArgs),
        /// A rough surface: its statistics and its light by scattering order
        Surface(surface::SurfaceArgs),
        #[command(about = format!("Write a material of a config as a table ({})", WRITE_TABLE.extensions(".")))]
        Tabulate(tabulate::Tabulate),
        /// Convert a table, readings or a schedule to another format
        Convert(convert::Convert),
        /// Train a prior or a kernel on many materials, for planners and reconstructions
        Train(train::Train),
        /// Numerical stability: errors of all models and coordinates at the edges of their domains
        Stability(stability::Stability),
        /// Error against run time of kernels, estimators and formats
        Bench(bench::Bench),
        /// Print the completion script of a shell
        Completions(shell::Completions),
        /// Man pages
        Man(shell::ManPages),
    }
}

impl Cli {
    /// The command line of this process; ends it where that is refused, or asks for help.
    pub fn read() -> Self {
        let command = signed(Self::command()).color(color_of(std::env::args_os()));
        let matches = command.try_get_matches();
        let read = matches.and_then(|matches| Self::from_arg_matches(&matches));
        read.unwrap_or_else(|e| end_with(&e))
    }

    /// Does what the command line asks for.
    ///
    /// # Errors
    /// Anything; [`Error::exit_code`] has a number for each kind.
    pub fn run(self) -> Result<(), Error> {
        self.verbosity.apply();
        check_threads()?;
        signals::watch()?;
        let start = Instant::now();
        let done = self.command.run();
        detail(|| {
            let seconds = start.elapsed().as_secs_f64();
            let threads = count(rayon::current_num_threads(), "thread");
            format!("gonio: took {seconds:.2} s on {threads}")
        });
        done
    }
}

/// Most threads that may be asked for.
const MOST_THREADS: u16 = 1024;

/// Refuses what no thread pool is made of.
fn check_threads() -> Result<(), Error> {
    const VARIABLE: &str = "RAYON_NUM_THREADS";
    let asked = std::env::var(VARIABLE).unwrap_or_default();
    if asked.parse().is_ok_and(|n: u64| n > MOST_THREADS.into()) {
        let place = format!("{VARIABLE} = {}", excerpt(&asked));
        let message = format!("allowed is a whole number from 1 to {MOST_THREADS}");
        return Err(Error::config(place, message));
    }
    Ok(())
}

/// Prints the help that was asked for, or why a command line is refused, and ends the process.
fn end_with(e: &clap::Error) -> ! {
    if e.kind() == clap::error::ErrorKind::InvalidUtf8 {
        let named = std::env::args_os().find(|argument| argument.to_str().is_none());
        let named = named.unwrap_or_default();
        let message = "this argument is no UTF-8; allowed: another name";
        let error = Error::config(excerpt(&named.to_string_lossy()), message);
        say_error(&error);
        std::process::exit(error.exit_code().into())
    }
    if e.use_stderr() {
        e.exit()
    }
    let error = written(Path::new("stdout"), e.print()).err();
    error.iter().for_each(|error| say_error(error));
    std::process::exit(error.map_or(0, |error| error.exit_code().into()))
}

/// The commands with options that take a negative number for a value, and not for another option:
/// the reader of the value says what is allowed.
fn signed(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|arg| {
        let valued = !arg.is_positional() && arg.get_action().takes_values();
        arg.allow_negative_numbers(valued)
    });
    command.mut_subcommands(signed)
}

/// The largest seed of a config: TOML has no larger numbers.
const MOST_SEED: u64 = i64::MAX as u64;

/// `--seed`, where something is random.
#[derive(Debug, Args)]
struct SeedArgs {
    /// One seed in place of the config's `seeds`
    #[arg(long, value_name = "N", value_parser = whole::<0, MOST_SEED>)]
    seed: Option<u64>,
}

impl SeedArgs {
    fn apply(&self, source: &mut Source) -> Result<(), Error> {
        match self.seed {
            Some(seed) => source.set(&format!("seeds=[{seed}]"), format!("--seed {seed}")),
            None => Ok(()),
        }
    }
}

/// `--threads`, where something is heavy.
#[derive(Debug, Args)]
struct ThreadArgs {
    /// Threads to work with [default: one per core]; results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)))]
    threads: Option<u16>,
}

impl ThreadArgs {
    fn apply(&self) -> Result<(), Error> {
        let Some(threads) = self.threads else {
            return Ok(());
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        pool.build_global().map_err(Error::internal)
    }
}

/// The experiment of a config of any kind, all of its materials used.
fn any_plan(source: &Source) -> Result<AnyPlan, Error> {
    let plan = AnyPlan::read(source)?;
    remark(plan.materials());
    Ok(plan)
}

/// Says what is peculiar about materials that are used, or about their files.
fn remark(materials: &[Material]) {
    for Material { name, remarks, .. } in materials {
        let of = (materials.len() > 1).then(|| format!("{name}: "));
        let of = of.unwrap_or_default();
        for remark in remarks {
            say(&format!("gonio: {of}{remark}"));
        }
    }
}

/// The material that `--material` names; the only one needs no name.
fn choose_material<'a>(
    materials: &'a [Material],
    name: Option<&str>,
) -> Result<&'a Material, Error> {
    match (name, materials) {
        (None, [only]) => Ok(only),
        (None, _) => {
            let allowed = listed(materials.iter().map(|m| &m.name));
            let message = format!("this config has several materials; allowed: one of {allowed}");
            Err(Error::config("--material", message))
        }
        (Some(name), all) => named("--material", name, all, |m| &m.name),
    }
}

/// The member of a family that an option names.
fn member<T: ?Sized>(
    option: &str,
    what: &str,
    name: &str,
    family: &[Entry<T>],
) -> Result<Entry<T>, Error> {
    let found = family.iter().find(|e| e.kind == name).copied();
    found.ok_or_else(|| no_member(option, what, name, family.iter().map(|e| e.kind)))
}

/// The parametrization that an option names.
fn parametrization_of(option: &str, name: &str) -> Result<Entry<ParametrizationSpec>, Error> {
    member(option, "parametrization", name, &parametrization::all())
}

/// The error of a name that an option gives and no member of a family has.
fn no_member<'a>(
    option: &str,
    what: &str,
    name: &str,
    family: impl IntoIterator<Item = &'a str>,
) -> Error {
    let (found, allowed) = (excerpt(name), one_of(name, family));
    let message = format!("{found:?} is no {what}; allowed: {allowed}");
    Error::config(option, message)
}

/// A member of a family with the keys of `--set`.
fn with_keys<T: ?Sized>(entry: &Entry<T>, set: &[String]) -> Result<Box<T>, Error> {
    let mut keys = Source::new("--set", "");
    set_all(&mut keys, set)?;
    (entry.read)(keys.table()?).map_err(|e| keys.error(e))
}

/// Sets the keys of every `--set`.
fn set_all(source: &mut Source, set: &[String]) -> Result<(), Error> {
    set_below(source, set, |_| "")
}

/// Sets the keys of every `--set`, each below the table that the first word of the key belongs to.
fn set_below(
    source: &mut Source,
    set: &[String],
    table: impl Fn(&str) -> &'static str,
) -> Result<(), Error> {
    set.iter().try_for_each(|assignment| {
        let first = assignment.split(['.', '=']).next().unwrap_or_default();
        let key = format!("{}{assignment}", table(first.trim()));
        source.set(&key, format!("--set {assignment}"))
    })
}

/// The first member of a list of the config that has the name an option gives.
fn named<'a, T>(
    option: &str,
    name: &str,
    all: &'a [T],
    name_of: impl Fn(&T) -> &str,
) -> Result<&'a T, Error> {
    let found = all.iter().find(|member| name_of(member) == name);
    found.ok_or_else(|| {
        let names = each_once(all.iter().map(|member| name_of(member).to_owned()));
        let allowed = match names.is_empty() {
            true => "another option, as the config has none of these".into(),
            false => one_of(name, names),
        };
        let name = excerpt(name);
        let message = format!("\"{name}\" is not in this config; allowed: {allowed}");
        Error::config(option, message)
    })
}

/// Leaves of a list of the config what an option names: one member or more; all without the option.
fn keep_named<T>(
    option: &str,
    name: Option<&str>,
    all: &mut Vec<T>,
    name_of: impl Fn(&T) -> &str,
) -> Result<(), Error> {
    if let Some(name) = name {
        named(option, name, all, &name_of)?;
        all.retain(|member| name_of(member) == name);
    }
    Ok(())
}

/// The instrument of this name in a plan, else the preset or file.
fn planned_instrument(plan: &Plan, name: &str) -> Result<PlannedInstrument, Error> {
    match plan.instruments.iter().find(|i| i.name == name) {
        Some(planned) => Ok(planned.clone()),
        None => PlannedInstrument::load(name, Order::default()),
    }
}

fn build(material: &Material, channels: Channels) -> Result<Box<dyn Brdf>, Error> {
    detail(|| {
        let tables = material.spec.tables().files.into_iter();
        let files: String = tables.map(|f| format!(", reads {}", f.display())).collect();
        format!("gonio: material {}{files}", material.name)
    });
    let brdf = material.spec.build(channels);
    let brdf = brdf.map_err(|e| not_built(&format!("--material {}", material.name), e))?;
    doubt(material, &*brdf);
    Ok(brdf)
}

/// The error of a material or a lighting that cannot be built; `place` is where its keys are.
fn not_built(place: &str, e: BuildError) -> Error {
    match e {
        BuildError::Data { path, message } => Error::data(path, message),
        e => Error::config(place, e),
    }
}

/// Says what is doubtful about the files of a material that was built.
fn doubt(material: &Material, brdf: &dyn Brdf) {
    let name = match &material.spec.tables().files[..] {
        [] => return,
        [file] => file.display().to_string(),
        _ => material.name.clone(),
    };
    for remark in brdf.remarks() {
        say(&format!("gonio: {name}: {remark}"));
    }
}

/// Reads one of some values by its name.
fn one_value<T: Clone + Send + Sync + 'static>(
    all: Vec<(T, PossibleValue)>,
) -> impl TypedValueParser<Value = T> {
    let names: Vec<PossibleValue> = all.iter().map(|(_, name)| name.clone()).collect();
    PossibleValuesParser::new(names).try_map(move |name| {
        let found = all.iter().find(|(_, value)| value.get_name() == name);
        let found = found.map(|(value, _)| value.clone());
        found.ok_or_else(|| ParameterError::new("value", name, "one of the list"))
    })
}

/// Reads one of the values of an option by its name; a value without a description is listed by its name.
fn choices<T: Copy + Send + Sync>(
    all: &'static [Choice<T>],
) -> impl TypedValueParser<Value = &'static Choice<T>> {
    let named = all.iter().map(|choice| {
        let meaning = Some(choice.meaning).filter(|meaning| !meaning.is_empty());
        (choice, PossibleValue::new(choice.name).help(meaning))
    });
    one_value(named.collect())
}

/// Reads one of the values of an option by its name: the value alone.
fn choice_of<T: Copy + Send + Sync>(all: &'static [Choice<T>]) -> impl TypedValueParser<Value = T> {
    choices(all).map(|choice| choice.value)
}

/// Reads a `--format` by its name.
fn format_names<T>(wanted: &Use<T>) -> impl TypedValueParser<Value = Format> + use<T> {
    let value = |f: Format| (f, PossibleValue::new(f.name).help(f.summary));
    one_value(wanted.formats().map(value).collect())
}

/// The format of an output file: the one that was chosen, else that which its extension says.
fn format_of<T>(wanted: &Use<T>, chosen: Option<Format>, path: &Path) -> Result<Format, Error> {
    let format = wanted.format(chosen, path);
    format.map_err(|e| Error::output(path, e))
}

/// The function that writes an output file in a format.
fn writer<T>(wanted: &Use<T>, format: &Format, path: &Path) -> Result<T, Error> {
    let write = wanted.function(format);
    write.map_err(|e| Error::output(path, e))
}

/// What files of poses and readings do not say.
fn assumed() -> Assume {
    Assume {
        axes: instrument::axis_names(),
        ..Assume::default()
    }
}

fn read_schedule(path: &Path, assume: &Assume) -> Result<ScheduleFile, Error> {
    detail(|| format!("gonio: reads {}", path.display()));
    let (text, read) = READ_SCHEDULE.open(path)?;
    Ok(read(&text, &path.display().to_string(), assume)?)
}

/// The text of an input file.
fn read_text(path: &Path) -> Result<String, Error> {
    detail(|| format!("gonio: reads {}", path.display()));
    files::read_text(path, files::TABLE_LIMIT)
        .map_err(|e| Error::data(path, format!("cannot read this file: {e}")))
}

/// Prints results. A reader that has seen enough (`| head`) is no error.
fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    let done = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    written(Path::new("stdout"), done)
}

/// The outcome of writing results to `path`; a reader that has seen enough is no error.
fn written(path: &Path, result: io::Result<()>) -> Result<(), Error> {
    match result {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::output(path, format!("cannot write this file: {e}")))
        }
        _ => Ok(()),
    }
}

/// Bytes of ours as text.
fn text(bytes: Vec<u8>) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(Error::internal)
}

/// Writes bytes into a file, without a note.
fn write_quietly(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    let body = |out: &mut BufWriter<File>| out.write_all(bytes.as_ref());
    written(path, files::write_atomically(path, body))
}

/// Writes a file, and notes its path on stderr.
fn write_file(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    written(path, files::write_atomically(path, body))?;
    wrote(path);
    Ok(())
}

/// Makes a folder for files, and those that it is in.
fn make_folder(dir: &Path) -> Result<(), Error> {
    fs::create_dir_all(dir).map_err(|e| Error::output(dir, format!("cannot make this folder: {e}")))
}

/// Refuses to replace a file unless `force`, and a folder, a device or an input always; its folder may be made later.
fn refuse_existing(path: &Path, force: bool) -> Result<(), Error> {
    if destination(path)?.exists() && !force {
        let message = "this file exists; allowed: another name, or --force to replace it";
        return Err(Error::output(path, message));
    }
    files::claim(path).map_err(|e| Error::output(path, e))
}

/// Refuses what [`refuse_existing`] does, and a file whose folder is not there.
fn refuse_unwritable(path: &Path, force: bool) -> Result<(), Error> {
    let is_missing = |dir: &&Path| !dir.as_os_str().is_empty() && !dir.is_dir();
    match destination(path)?.parent().filter(is_missing) {
        Some(dir) => {
            let message = format!("there is no folder {}", dir.display());
            Err(Error::output(path, message))
        }
        None => refuse_existing(path, force),
    }
}

fn destination(path: &Path) -> Result<PathBuf, Error> {
    files::destination(path)
        .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))
}
