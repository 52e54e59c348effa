//! The command line: one file per command.
//!
//! Results go to stdout or into files, everything else to stderr. Exit codes:
//! see [`Error::exit_code`].

mod advise;
mod bench;
mod brdf_args;
mod check;
mod claims;
mod collect;
mod config_args;
mod convert;
mod cross_validation;
mod density;
mod distortion;
mod energy;
mod init;
mod kept;
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
mod talk;
mod train;

use crate::brdf::{Brdf, BuildError, Channels};
use crate::error::{Error, ParameterError, count, excerpt, in_left_open, one_of};
use crate::experiment::{AnyPlan, MAX_BUDGET, MAX_MINUTES, Material, Source};
use crate::files;
use crate::formats::{Format, Use, WRITE_TABLE};
use crate::registry::Entry;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use config_args::ConfigArgs;
pub use signals::exit_code;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;
pub use talk::say_error;
use talk::{TalkArgs, color_of, detail, say};

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
    talk: TalkArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented config to start from
    Init(init::Init),
    /// Run an experiment: measure, reconstruct, compare
    Run(run::Run),
    /// Put the parts of a run together
    Merge(merge::Merge),
    /// Check a config as `run` would and print its plan, without measuring
    Check(check::Check),
    /// List what a config can name
    List(list::List),
    /// Export schedules of a config, for an instrument
    Schedule(schedule::Schedule),
    /// Which poses and which reconstruction are best for materials like some
    Advise(advise::Advise),
    /// The poses to read next, from the readings so far
    Next(next::Next),
    /// Measure a material at the poses of a schedule file
    Measure(measure::Measure),
    /// Make a BRDF of a measurement file, and say how good it is
    Reconstruct(reconstruct::Reconstruct),
    /// JSON Schema of configs, instruments, and of the lines of our files
    Schema(schema::Schema),
    /// Moment profiles of a material, or of every material of a config
    Moments(moments::Moments),
    /// Pictures of a material seen from chosen elevations
    Slice(slice::Slice),
    /// Symmetries of a material, by how much it misses them and what they save
    Symmetry(symmetry::SymmetryArgs),
    /// How far the isolines of a material are from the axes of each parametrization
    Distortion(distortion::Distortion),
    /// Which coordinates the poses of schedules follow
    Density(density::DensityArgs),
    /// What Barla et al. 2015 say of the parametrizations, and whether it is so
    Claims(claims::Claims),
    /// Pictures of parametrizations, materials and reconstructions
    Picture(picture::Picture),
    /// The light paths that a box of coordinates stands for
    Subset(subset::Subset),
    /// Which coordinates light of one facet, of two, of more is in
    Paths(paths::PathsArgs),
    /// A rough surface: its statistics, and light after one facet and more
    Surface(surface::SurfaceArgs),
    #[command(about = format!("Write a material of a config as a table ({})", WRITE_TABLE.extensions(".")))]
    Tabulate(tabulate::Tabulate),
    /// Write a table, readings or a schedule in another format, and say what became of them
    Convert(convert::Convert),
    /// What many materials have in common, for planners and reconstructions
    Train(train::Train),
    /// Every registry at the edges of its domain: errors against their conditioning
    Stability(stability::Stability),
    /// Measure the program against the clock
    Bench(bench::Bench),
    /// What completes commands and options in a shell
    Completions(shell::Completions),
    /// Man pages
    Man(shell::ManPages),
}

impl Cli {
    /// The command line of this process; ends it where that is refused, or asks for help.
    pub fn read() -> Self {
        let command = signed(Self::command()).color(color_of(std::env::args_os()));
        let matches = command.try_get_matches();
        let read = matches.and_then(|matches| Self::from_arg_matches(&matches));
        read.unwrap_or_else(|e| tell(&e))
    }

    /// Does what the command line asks for.
    ///
    /// # Errors
    /// Anything; [`Error::exit_code`] tells what kind.
    pub fn run(self) -> Result<(), Error> {
        self.talk.apply();
        check_threads()?;
        signals::watch()?;
        let start = Instant::now();
        let done = self.command.run();
        detail(|| {
            let threads = rayon::current_num_threads();
            format!(
                "gonio: took {:.2} s on {}",
                start.elapsed().as_secs_f64(),
                count(threads, "thread")
            )
        });
        done
    }
}

/// Most threads that may be asked for.
const MOST_THREADS: u16 = 1024;

/// Refuses what no thread pool is made of.
fn check_threads() -> Result<(), Error> {
    const VARIABLE: &str = "RAYON_NUM_THREADS";
    let asked = std::env::var(VARIABLE).ok();
    match asked.filter(|text| text.parse().is_ok_and(|n: u64| n > MOST_THREADS.into())) {
        Some(text) => {
            let message = format!("allowed is a whole number from 1 to {MOST_THREADS}");
            Err(Error::config(
                format!("{VARIABLE} = {}", excerpt(&text)),
                message,
            ))
        }
        None => Ok(()),
    }
}

/// Prints the help that was asked for, or why a command line is refused, and ends the process.
fn tell(e: &clap::Error) -> ! {
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
/// whoever reads the value says what is allowed.
fn signed(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|arg| {
        let valued = !arg.is_positional() && arg.get_action().takes_values();
        match valued {
            true => arg.allow_negative_numbers(true),
            false => arg,
        }
    });
    command.mut_subcommands(signed)
}

impl Command {
    fn run(self) -> Result<(), Error> {
        match self {
            Command::Init(command) => command.run(),
            Command::Run(command) => command.run(),
            Command::Merge(command) => command.run(),
            Command::Check(command) => command.run(),
            Command::List(command) => command.run(),
            Command::Schedule(command) => command.run(),
            Command::Advise(command) => command.run(),
            Command::Next(command) => command.run(),
            Command::Measure(command) => command.run(),
            Command::Reconstruct(command) => command.run(),
            Command::Schema(command) => command.run(),
            Command::Moments(command) => command.run(),
            Command::Slice(command) => command.run(),
            Command::Distortion(command) => command.run(),
            Command::Density(command) => command.run(),
            Command::Claims(command) => command.run(),
            Command::Symmetry(command) => command.run(),
            Command::Picture(command) => command.run(),
            Command::Subset(command) => command.run(),
            Command::Paths(command) => command.run(),
            Command::Surface(command) => command.run(),
            Command::Tabulate(command) => command.run(),
            Command::Convert(command) => command.run(),
            Command::Train(command) => command.run(),
            Command::Stability(command) => command.run(),
            Command::Bench(command) => command.run(),
            Command::Completions(command) => command.run(),
            Command::Man(command) => command.run(),
        }
    }
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
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()
            .map_err(|e| Error::Internal(e.to_string()))
    }
}

/// The experiment of a config of any kind, all of its materials used.
fn any_plan(source: &Source) -> Result<AnyPlan, Error> {
    let plan = AnyPlan::read(source)?;
    remark(match &plan {
        AnyPlan::Acquisition(plan) => &plan.materials,
        AnyPlan::Moments(plan) => &plan.materials,
        AnyPlan::Relations(plan) => &plan.base.materials,
    });
    Ok(plan)
}

/// Says what is peculiar about materials that are used, or about their files.
fn remark(materials: &[Material]) {
    let several = materials.len() > 1;
    for material in materials {
        let name = match several {
            true => format!("{}: ", material.name),
            false => String::new(),
        };
        for remark in &material.remarks {
            say(&format!("gonio: {name}{remark}"));
        }
    }
}

/// The material that `--material` names; the only one needs no name.
fn choose_material<'a>(
    materials: &'a [Material],
    name: Option<&str>,
) -> Result<&'a Material, Error> {
    let names = || materials.iter().map(|m| m.name.clone());
    match (name, materials) {
        (None, [only]) => Ok(only),
        (None, _) => {
            let allowed = names().collect::<Vec<_>>().join(", ");
            let message = format!("this config has several materials; allowed: one of {allowed}");
            Err(Error::config("--material", message))
        }
        (Some(name), all) => {
            let chosen = all.iter().find(|m| m.name == name);
            chosen.ok_or_else(|| unknown("--material", name, names()))
        }
    }
}

/// The member of a family that an option names.
fn member<T: ?Sized>(
    option: &str,
    what: &str,
    name: &str,
    family: &[Entry<T>],
) -> Result<Entry<T>, Error> {
    let found = family.iter().find(|e| e.kind == name);
    found.copied().ok_or_else(|| {
        let allowed = one_of(name, family.iter().map(|e| e.kind));
        let name = excerpt(name);
        Error::config(option, format!("{name:?} is no {what}; allowed: {allowed}"))
    })
}

/// The error for a name that the config has not; each of `allowed` is told once.
fn unknown(option: &str, name: &str, allowed: impl IntoIterator<Item = String>) -> Error {
    let mut names: Vec<String> = Vec::new();
    for name in allowed {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let allowed = match names.is_empty() {
        true => "another option, as the config has none of these".into(),
        false => one_of(name, names),
    };
    let name = excerpt(name);
    let message = format!("\"{name}\" is not in this config; allowed: {allowed}");
    Error::config(option, message)
}

/// The BRDF of a material.
fn build(material: &Material, channels: Channels) -> Result<Box<dyn Brdf>, Error> {
    detail(|| {
        let tables = material.spec.tables().files;
        let files = tables
            .iter()
            .map(|file| format!(", reads {}", file.display()));
        let files: String = files.collect();
        format!("gonio: material {}{files}", material.name)
    });
    let brdf = material.spec.build(channels).map_err(|e| match e {
        BuildError::Data { path, message } => Error::data(path, message),
        e => Error::config(format!("--material {}", material.name), e),
    })?;
    doubt(material, &*brdf);
    Ok(brdf)
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

/// Reads a `--format` by its name.
fn format_names<T: 'static>(
    wanted: &'static Use<T>,
) -> impl TypedValueParser<Value = Format> + use<T> {
    let value = |f: Format| PossibleValue::new(f.name).help(f.summary);
    let names = PossibleValuesParser::new(wanted.formats().map(value));
    names.try_map(|name| wanted.named(&name))
}

/// The text of an input file, and the function that reads it.
fn read_as<T>(path: &Path, wanted: &Use<T>) -> Result<(String, T), Error> {
    detail(|| format!("gonio: reads {}", path.display()));
    wanted.open(path)
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
    written(
        Path::new("stdout"),
        out.write_all(text.as_bytes()).and_then(|()| out.flush()),
    )
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

/// Reads a number of configurations: 1000, or 1e6.
fn budget(text: &str) -> Result<usize, ParameterError> {
    const MOST: u64 = MAX_BUDGET as u64;
    let number = whole::<1, MOST>(text);
    let number = number.map_err(|e| ParameterError::new("budget", text, e.0))?;
    Ok(number as usize)
}

/// What a number of an option must be.
#[derive(Debug, thiserror::Error)]
#[error("allowed: {0}")]
struct NoNumber(String);

/// Reads a whole number: 1000, or 1e6.
fn whole<const LEAST: u64, const MOST: u64>(text: &str) -> Result<u64, NoNumber> {
    let text = text.trim();
    let of_float = |n: f64| (n.fract() == 0.0 && (0.0..1e15).contains(&n)).then_some(n as u64);
    let number = text.parse().ok();
    let number = number.or_else(|| of_float(text.parse().ok()?));
    number
        .filter(|n| (LEAST..=MOST).contains(n))
        .ok_or_else(|| {
            let allowed = match MOST {
                u64::MAX => format!("a whole number from {LEAST} on"),
                _ => format!("a whole number from {LEAST} to {MOST}"),
            };
            NoNumber(allowed)
        })
}

/// Reads a number that `check` takes.
fn number(
    text: &str,
    check: impl FnOnce(f64) -> Result<f64, ParameterError>,
) -> Result<f64, NoNumber> {
    let number = text.trim().parse().unwrap_or(f64::NAN);
    check(number).map_err(|e| NoNumber(e.allowed))
}

/// Reads a time in minutes: 90, or 0.5.
fn minutes(text: &str) -> Result<f64, NoNumber> {
    number(text, |n| in_left_open("minutes", n, 0.0, MAX_MINUTES))
}

/// Refuses to replace a file unless `force`, and a folder, a device or an input always; its folder may be made later.
fn refuse_existing(path: &Path, force: bool) -> Result<(), Error> {
    match destination(path)?.exists() && !force {
        true => Err(Error::output(
            path,
            "this file exists; choose another with -o, or --force to replace it",
        )),
        false => files::claim(path).map_err(|e| Error::output(path, e)),
    }
}

/// The same of a file whose folder must be there.
fn refuse_unwritable(path: &Path, force: bool) -> Result<(), Error> {
    let destination = destination(path)?;
    let dir = destination
        .parent()
        .filter(|dir| !dir.as_os_str().is_empty());
    match dir.filter(|dir| !dir.is_dir()) {
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
