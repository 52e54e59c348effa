//! `gonio run`.

mod acquisition;
mod consumers;
mod explain;
mod moments;
mod relations;

use super::progress::Progress;
use super::signals::{self, stop_flag};
use super::talk::{detail, note, say};
use super::{ConfigArgs, SeedArgs, ThreadArgs, doubt, print};
use crate::brdf::BuildError;
use crate::error::{Error, count_are};
use crate::experiment::{
    AnyPlan, Experiment, Extent, Material, Observer, Record, RowKey, Shard, Source, Summary, Tuned,
    material_key,
};
use crate::formats::of_name;
use crate::report::{Machine, MadeBy, MadeFrom, Manifest, Outcome, RunFolder, read_rows};
use clap::Args;
use consumers::{Consumers, Files};
use explain::Explained;
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Instant, SystemTime};

/// Folder of runs that name none.
const RUNS: &str = "runs";

#[derive(Debug, Args)]
pub(super) struct Run {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    seed: SeedArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Folder of the results; a run that is there goes on [default: runs/NAME, or NAME-2, NAME-3, …
    /// where other configs have taken it]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Make everything again that is in the output folder
    #[arg(long)]
    force: bool,
    /// Only this part of the work, i/n with 1 <= i <= n
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// List what would be run, and what of it is done
    #[arg(long)]
    list: bool,
    /// Memory for materials and their readings, in megabytes; results do not depend on it
    #[arg(long, value_name = "MB", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..))]
    memory: u32,
    /// Print what was done, how often and in how many seconds, and what was left out and why
    #[arg(long)]
    explain: bool,
}

/// A kind of experiment as commands show it: observers of a run, and output at its end.
pub(super) trait Shown: Experiment {
    /// Observers beside the progress bar and the file of records.
    ///
    /// # Errors
    /// Errors of building what the observers need.
    fn listeners<'a>(
        &'a self,
        folder: &'a RefCell<RunFolder<Self::Record>>,
        context: &RunContext,
    ) -> Result<Vec<Box<dyn Observer<Self::Record> + 'a>>, Error>;

    /// Prints a summary of the records, and writes their tables and pictures.
    ///
    /// # Errors
    /// Errors of drawing, printing and writing.
    fn conclude(&self, folder: &mut RunFolder<Self::Record>, end: &End<'_>) -> Result<(), Error>;

    /// What the config does not ask for: a name, and by which key.
    fn left_out(&self) -> Vec<(&'static str, String)>;
}

/// What listeners are told of the run.
pub(super) struct RunContext {
    /// Set when the run shall stop.
    pub(super) stop: Arc<AtomicBool>,
    /// The part that is run.
    pub(super) shard: Option<Shard>,
}

/// The end of a run: keys and status.
pub(super) struct End<'a> {
    /// Keys of the records of the plan, or of its part, in their order.
    pub(super) keys: &'a [RowKey],
    /// Keys of the materials, as far as they are known.
    pub(super) materials: &'a [Option<RowKey>],
    /// The manifest, as JSON.
    pub(super) manifest: &'a serde_json::Value,
    /// True unless it was stopped.
    pub(super) ended: bool,
    /// True of a whole run, false of a part.
    pub(super) whole: bool,
}

/// Commands on an experiment of any kind.
pub(super) trait Runnable {
    /// `gonio run`.
    fn run(&self, command: &Run, source: &Source, started: SystemTime) -> Result<(), Error>;

    /// `gonio merge`.
    fn merge(
        &self,
        command: &super::merge::Merge,
        source: &Source,
        started: SystemTime,
    ) -> Result<(), Error>;

    /// `gonio check`.
    fn check(&self, json: bool) -> Result<(), Error>;
}

/// The experiment of a config.
pub(super) fn experiment(source: &Source) -> Result<Box<dyn Runnable>, Error> {
    Ok(match super::any_plan(source)? {
        AnyPlan::Acquisition(plan) => plan,
        AnyPlan::Moments(plan) => plan,
        AnyPlan::Relations(plan) => plan,
    })
}

impl<E: Shown + super::check::Checked> Runnable for E {
    fn run(&self, command: &Run, source: &Source, started: SystemTime) -> Result<(), Error> {
        command.perform(self, source, started)
    }

    fn merge(
        &self,
        command: &super::merge::Merge,
        source: &Source,
        started: SystemTime,
    ) -> Result<(), Error> {
        command.put_together(self, source, started)
    }

    fn check(&self, json: bool) -> Result<(), Error> {
        super::check::Checked::check(self, json)?;
        // What is wrong with other materials is said before there is a plan.
        let is_table = |file: &PathBuf| of_name(file).is_some_and(|f| f.read_table.is_some());
        let has_table = |m: &&Material| m.spec.tables().files.iter().any(is_table);
        let mut first = None;
        for material in self.materials().iter().filter(has_table) {
            let built = material.spec.widest_channels();
            match built.and_then(|channels| material.spec.build(channels)) {
                Ok(brdf) => doubt(material, &*brdf),
                Err(BuildError::Data { path, message }) => {
                    let message = format!("{message}; its jobs fail, the others run");
                    let error = Error::data(path, message);
                    match &first {
                        None => first = Some(error),
                        Some(_) => say(&format!("gonio: {error}")),
                    }
                }
                Err(_) => {}
            }
        }
        first.map_or(Ok(()), Err)
    }
}

impl Run {
    pub(super) fn run(self) -> Result<(), Error> {
        let started = SystemTime::now();
        self.threads.apply()?;
        let mut source = self.config.source()?;
        self.seed.apply(&mut source)?;
        experiment(&source)?.run(&self, &source, started)
    }

    fn perform<E: Shown>(
        &self,
        plan: &E,
        source: &Source,
        started: SystemTime,
    ) -> Result<(), Error> {
        tell_missing(plan.missing());
        let resolved = plan.resolved();
        let stem = self.stem();
        let dir = match &self.output {
            Some(dir) => dir.clone(),
            None => RunFolder::<E::Record>::next(Path::new(RUNS), &stem, resolved)?,
        };
        if self.list {
            return list(plan, self.shard, &dir);
        }
        if let Some(shard) = self
            .shard
            .filter(|_| RunFolder::<E::Record>::is_whole(&dir))
        {
            let message = format!(
                "a whole run is here, of which --shard {shard} would leave a part; choose \
                 another folder with -o"
            );
            return Err(Error::output(dir, message));
        }
        let context = RunContext {
            stop: stop_flag(
                "; rows that were finished are kept, and the same command goes on from them",
            ),
            shard: self.shard,
        };
        let folder = RunFolder::open(&dir, self.force, resolved)?;
        if let Some(question) = plan.question() {
            print(&format!("{}\n\n", question.trim()))?;
        }
        let known = folder.known();
        let before = MadeFrom::read(&dir).tuned;
        let before = if folder.goes_on() { before } else { Vec::new() };
        let folder = RefCell::new(folder);
        let extent = Extent {
            shard: self.shard,
            memory: (self.memory as usize) << 20,
        };
        let mut summary = {
            let mut consumers = Consumers {
                stop: Arc::clone(&context.stop),
                progress: Progress::new(),
                list: vec![Box::new(Files(&folder))],
            };
            consumers.list.extend(plan.listeners(&folder, &context)?);
            plan.run(&extent, &known, &mut consumers)?
        };
        signals::ends();
        let mut folder = folder.into_inner();
        if summary.interrupted && folder.is_untouched() {
            let (rows, path) = (known.len(), dir);
            return Err(Error::Interrupted { rows, path });
        }
        let rows = folder.sorted(&summary.keys).0.len();
        let mut tuned = summary.tuned.clone();
        Tuned::add(&mut tuned, before);
        let outcome = Outcome {
            rows,
            failures: summary.failures.clone(),
            tuned,
            interrupted: summary.interrupted,
            shard: self.shard.map(|s| s.to_string()),
            ..Outcome::default()
        };
        tell_inputs(&summary);
        let manifest = manifest(plan, source, summary.inputs.clone(), outcome, None);
        let facts = serde_json::to_value(&manifest).map_err(|e| Error::Internal(e.to_string()))?;
        let begun = Instant::now();
        plan.conclude(
            &mut folder,
            &End {
                keys: &summary.keys,
                materials: &summary.materials,
                manifest: &facts,
                ended: !summary.interrupted,
                whole: self.shard.is_none(),
            },
        )?;
        summary.seconds.report = begun.elapsed().as_secs_f64();
        summary.counts.extend(&folder.ledger().counts());
        if self.explain {
            let explained = Explained {
                counts: &summary.counts,
                seconds: &summary.seconds,
                rows: [summary.rows, rows.saturating_sub(summary.rows)],
                left_out: plan.left_out(),
            };
            print(&explained.text())?;
        }
        let machine = Machine::new(started, summary.seconds.by_stage(), summary.counts);
        let path = folder.finish(&summary.keys, manifest, &machine)?;
        if summary.interrupted {
            return Err(Error::Interrupted { rows, path });
        }
        let failed: usize = summary.failures.iter().map(|f| f.jobs).sum();
        if failed > 0 {
            let jobs = jobs(plan, self.shard);
            return Err(Error::JobsFailed { failed, jobs, path });
        }
        note(&format!(
            "\n{} in {}",
            count_are(rows, "row"),
            path.display()
        ));
        Ok(())
    }

    /// Default name of this run's folder.
    fn stem(&self) -> String {
        let stem = self.config.stem();
        match self.shard {
            Some(Shard { part, of }) => format!("{stem}.shard-{part}-of-{of}"),
            None => stem,
        }
    }
}

/// The manifest of a run or of a merged one.
pub(super) fn manifest<E: Experiment>(
    plan: &E,
    source: &Source,
    inputs: Vec<crate::experiment::Input>,
    outcome: Outcome,
    parts: Option<MadeFrom>,
) -> Manifest {
    let made_by = MadeBy {
        resolved: plan.resolved(),
        seeds: &plan.seeds(),
        missing: plan.missing(),
    };
    Manifest::new(made_by, source, inputs, outcome, parts)
}

/// Jobs of a run: records that are made together count once.
fn jobs<E: Experiment>(plan: &E, shard: Option<Shard>) -> usize {
    let expected = plan.expected(shard);
    expected.chunk_by(|a, b| a.job == b.job).count()
}

/// Prints every job and whether it is done.
fn list<E: Experiment>(plan: &E, shard: Option<Shard>, dir: &Path) -> Result<(), Error> {
    let rows: Vec<E::Record> = if dir.join(E::Record::FILE).exists() {
        read_rows(dir)?
    } else {
        Vec::new()
    };
    let known: HashSet<&str> = rows.iter().map(|r| r.key()).collect();
    let expected = plan.expected(shard);
    let mut keys: HashMap<usize, RowKey> = HashMap::new();
    let (mut out, mut done, mut jobs) = (String::new(), 0, 0);
    for job in expected.chunk_by(|a, b| a.job == b.job) {
        let material = job[0].material;
        if let std::collections::hash_map::Entry::Vacant(entry) = keys.entry(material) {
            // One that cannot be read fails when it is run; nothing of it is done.
            entry.insert(material_key(&plan.materials()[material]).unwrap_or_default());
        }
        let mine: Vec<RowKey> = job.iter().map(|e| e.key(&keys[&material])).collect();
        let is_done = mine.iter().all(|k| known.contains(k.as_str()));
        done += usize::from(is_done);
        jobs += 1;
        let word = if is_done { "done" } else { "open" };
        out += &format!("{word}  {}  {}\n", mine.join(" "), job[0].job);
    }
    out += &format!(
        "{done} of {} done in {}\n",
        count_are(jobs, "job"),
        dir.display()
    );
    print(&out)
}

/// Tells the files that a run has read, where details are wanted.
pub(super) fn tell_inputs(summary: &Summary) {
    for input in &summary.inputs {
        detail(|| format!("gonio: read {}", input.path.display()));
    }
}

/// Writes the materials that a config names but its folder lacks to stderr.
pub(super) fn tell_missing(names: &[String]) {
    if !names.is_empty() {
        let list = names.join(", ");
        note(&format!("gonio: not in materials_dir, skipped: {list}"));
    }
}
