//! `gonio run`.

mod acquisition;
mod moments;
mod relations;

use super::signals::{self, stop_flag};
use super::{
    ConfigArgs, Progress, SeedArgs, ThreadArgs, any_plan, detail, doubt, note, print, say,
};
use crate::error::{Error, count, count_are};
use crate::experiment::{
    AnyPlan, ByProduct, Counts, Event, Experiment, Extent, Failure, Known, Observer, Record,
    RowKey, Shard, Source, Stage, Summary, Tuned, Work, material_key,
};
use crate::report::{Machine, MadeFrom, Manifest, Outcome, REPORT, RunFolder, read_rows};
use clap::Args;
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
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
    /// Folder of the results; an interrupted run there resumes [default: runs/NAME, or NAME-2, NAME-3, …
    /// where other configs have taken it]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Redo everything that is in the output folder
    #[arg(long)]
    force: bool,
    /// Only this part of the work, i/n with 1 <= i <= n
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// List the jobs, and which of them are done
    #[arg(long)]
    list: bool,
    /// Memory for materials and their readings, in megabytes; results do not depend on it
    #[arg(long, value_name = "MB", default_value_t = Extent::MEMORY_MB as u32, value_parser = clap::value_parser!(u32).range(1..))]
    memory: u32,
    /// Print what was done, how often and in how many seconds, and what was left out and why
    #[arg(long)]
    explain: bool,
}

/// The lines of a table for the records of one schedule or material.
pub(super) type Lines<'a, R> = Box<dyn Fn(&[&R]) -> String + 'a>;

/// A table that is printed while a run goes on: its head, and its lines.
pub(super) type Printed<'a, R> = (String, Lines<'a, R>);

/// An observer of the records of a run, if it needs one.
pub(super) type Listener<'a, R> = Option<Box<dyn Observer<R> + 'a>>;

/// A kind of experiment as commands show it: observers of a run, and output at its end.
pub(super) trait Shown: Experiment {
    /// The table that is printed while the run goes on, if one is; errors of the values that the lines need.
    fn table(&self) -> Result<Option<Printed<'_, Self::Record>>, Error>;

    /// The observer beside the progress bar, the file of records and the table, of a run, or of a shard, that `stop` ends; errors
    /// of building what it needs.
    fn listener<'a>(
        &'a self,
        _folder: &'a RefCell<RunFolder<Self::Record>>,
        _shard: Option<Shard>,
        _stop: &Arc<AtomicBool>,
    ) -> Result<Listener<'a, Self::Record>, Error> {
        Ok(None)
    }

    /// Prints a summary of the records, and writes their tables and pictures.
    fn conclude(&self, folder: &mut RunFolder<Self::Record>, end: &End<'_>) -> Result<(), Error>;

    /// What the config does not ask for: a name, and by which key.
    fn left_out(&self) -> Vec<(&'static str, String)> {
        Vec::new()
    }
}

/// The end of a run: keys and status.
pub(super) struct End<'a> {
    /// Keys of the records of the plan, or of its part, in their order.
    pub(super) keys: &'a [RowKey],
    /// Keys of the materials, as far as they are known.
    pub(super) materials: &'a [Option<RowKey>],
    /// The manifest.
    pub(super) manifest: &'a Manifest,
    /// True unless it was stopped.
    pub(super) ended: bool,
    /// True of a whole run, false of a part.
    pub(super) whole: bool,
}

impl End<'_> {
    /// Writes what is made of all records, and adds what that took.
    pub(super) fn conclude<E: Shown>(
        &self,
        plan: &E,
        folder: &mut RunFolder<E::Record>,
        seconds: &mut BTreeMap<String, f64>,
        counts: &mut Counts,
    ) -> Result<(), Error> {
        let begun = Instant::now();
        plan.conclude(folder, self)?;
        *seconds.entry(Stage::Report.name().into()).or_default() += begun.elapsed().as_secs_f64();
        counts.extend(&folder.counters.counts());
        Ok(())
    }
}

impl Run {
    pub(super) fn run(self) -> Result<(), Error> {
        let started = SystemTime::now();
        self.threads.apply()?;
        let mut source = self.config.source()?;
        self.seed.apply(&mut source)?;
        match any_plan(&source)? {
            AnyPlan::Acquisition(plan) => self.perform(&*plan, &source, started),
            AnyPlan::Moments(plan) => self.perform(&*plan, &source, started),
            AnyPlan::Relations(plan) => self.perform(&*plan, &source, started),
        }
    }

    fn perform<E: Shown>(
        &self,
        plan: &E,
        source: &Source,
        started: SystemTime,
    ) -> Result<(), Error> {
        let head = plan.head();
        note_missing(head.missing);
        let stem = self.stem();
        let dir = match &self.output {
            Some(dir) => dir.clone(),
            None => RunFolder::<E::Record>::next(Path::new(RUNS), &stem, head.resolved)?,
        };
        if self.list {
            return list(plan, self.shard, &dir);
        }
        if let Some(shard) = self.shard
            && RunFolder::<E::Record>::is_whole(&dir)
        {
            let message = format!(
                "a whole run is here, of which --shard {shard} would leave a part; choose another folder with -o"
            );
            return Err(Error::output(dir, message));
        }
        let stop = stop_flag("; finished rows are kept, and the same command resumes from them");
        let folder = RunFolder::open(&dir, self.force, head.resolved)?;
        if let Some(question) = head.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        let known = folder.known();
        let before = MadeFrom::read(&dir).tuned;
        let before = if folder.is_same { before } else { Vec::new() };
        let folder = RefCell::new(folder);
        let extent = Extent {
            shard: self.shard,
            memory: (self.memory as usize) << 20,
        };
        let mut summary = {
            let progress = Progress::new();
            let (table_head, lines) = plan.table()?.unzip();
            table_head.map_or(Ok(()), |head| print(&head))?;
            let mut consumers = Consumers {
                progress,
                folder: &folder,
                lines,
                listener: plan.listener(&folder, self.shard, &stop)?,
                stop,
            };
            plan.run(&extent, &known, &mut consumers)?
        };
        signals::ends();
        let mut folder = folder.into_inner();
        if summary.interrupted && folder.is_untouched() {
            let (rows, path) = (known.len(), dir);
            return Err(Error::Interrupted { rows, path });
        }
        let (rows, others) = folder.sorted(&summary.keys);
        let (rows, others) = (rows.len(), others.len());
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
        note_inputs(&summary);
        let manifest = Manifest::new(head, source, summary.inputs.clone(), outcome, None);
        let end = End {
            keys: &summary.keys,
            materials: &summary.materials,
            manifest: &manifest,
            ended: !summary.interrupted,
            whole: self.shard.is_none(),
        };
        let mut seconds = summary.seconds.by_stage();
        end.conclude(plan, &mut folder, &mut seconds, &mut summary.counts)?;
        if self.explain {
            let made = [summary.rows, rows.saturating_sub(summary.rows)];
            let text = explained(&summary.counts, &seconds, made, &plan.left_out());
            print(&text)?;
        }
        let machine = Machine::new(started, seconds, summary.counts);
        let path = folder.finish(&summary.keys, manifest, &machine)?;
        if summary.interrupted {
            return Err(Error::Interrupted { rows, path });
        }
        let failed: usize = summary.failures.iter().map(|f| f.jobs).sum();
        if failed > 0 {
            // Records that are made together are of one job.
            let expected = plan.expected(self.shard);
            let jobs = expected.chunk_by(|a, b| a.job == b.job).count();
            return Err(Error::JobsFailed { failed, jobs, path });
        }
        let mut text = format!("\n{} in {}", count_are(rows, "row"), path.display());
        let report = path.join(REPORT);
        if report.exists() {
            text += &format!("; report: {}", report.display());
        }
        note(&text);
        if others > 0 && self.shard.is_none() {
            let others = count_are(others, "row");
            let file = E::Record::FILE;
            note(&format!(
                "{others} kept in {file} alone: of another config, or of files that have changed since"
            ));
        }
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

/// Prints every job and whether it is done.
fn list<E: Experiment>(plan: &E, shard: Option<Shard>, dir: &Path) -> Result<(), Error> {
    let rows: Vec<E::Record> = match dir.join(E::Record::FILE).exists() {
        true => read_rows(dir)?,
        false => Vec::new(),
    };
    let known: HashSet<&str> = rows.iter().map(|r| r.key()).collect();
    let expected = plan.expected(shard);
    let mut keys: HashMap<usize, RowKey> = HashMap::new();
    let (mut out, mut done, mut jobs) = (String::new(), 0, 0);
    for job in expected.chunk_by(|a, b| a.job == b.job) {
        let material = job[0].material;
        // One that cannot be read fails when it is run; nothing of it is done.
        let key = || material_key(&plan.head().materials[material]).unwrap_or_default();
        let key = keys.entry(material).or_insert_with(key);
        let mine: Vec<RowKey> = job.iter().map(|e| e.key(key)).collect();
        let is_done = mine.iter().all(|k| known.contains(k.as_str()));
        done += usize::from(is_done);
        jobs += 1;
        let word = if is_done { "done" } else { "open" };
        out += &format!("{word}  {}  {}\n", mine.join(" "), job[0].job);
    }
    let (jobs, dir) = (count_are(jobs, "job"), dir.display());
    print(&format!("{out}{done} of {jobs} done in {dir}\n"))
}

/// Lists the files that a run has read on stderr, with `--verbose`.
pub(super) fn note_inputs(summary: &Summary) {
    for input in &summary.inputs {
        detail(|| format!("gonio: read {}", input.path.display()));
    }
}

/// Writes the materials that a config names but its folder lacks to stderr.
pub(super) fn note_missing(names: &[String]) {
    if !names.is_empty() {
        let list = names.join(", ");
        note(&format!("gonio: not in materials_dir, skipped: {list}"));
    }
}

/// What a run did, and what it had no need to do: a line for each kind of work of each stage, and one for each thing that
/// was left out and why. `rows` are those that were made, and those that were known before.
fn explained(
    counts: &Counts,
    seconds_of: &BTreeMap<String, f64>,
    rows: [usize; 2],
    left_out: &[(&'static str, String)],
) -> String {
    let mut out = String::from("\nwhat was done\n");
    for stage in Stage::ALL {
        let seconds = format!("{:.3} s", seconds_of[stage.name()]);
        let mut head = [stage.name(), &seconds];
        let works = Work::ALL.map(|work| (counts.get(stage, work), work.summary()));
        for (number, what) in works.into_iter().filter(|(number, _)| *number > 0) {
            let [name, seconds] = std::mem::take(&mut head);
            out += &format!("  {name:<12}{seconds:>12}{number:>15}  {what}\n");
        }
    }
    let [made, known] = rows.map(|n| count(n, "row"));
    out += &format!("  {made} made, {known} known before\n");
    if !left_out.is_empty() {
        out += "what was left out\n";
    }
    for (name, why) in left_out {
        out += &format!("  {name:<12}{why}\n");
    }
    out
}

/// All observers of a run, as one.
struct Consumers<'a, R> {
    stop: Arc<AtomicBool>,
    progress: Progress,
    /// Where records are appended to their file.
    folder: &'a RefCell<RunFolder<R>>,
    /// Lines that are printed.
    lines: Option<Lines<'a, R>>,
    listener: Listener<'a, R>,
}

impl<R: Record> Observer<R> for Consumers<'_, R> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn begins(&mut self, work: f64) {
        self.progress.begin(work as u64);
    }

    fn requests(&self, wish: &ByProduct<'_>) -> bool {
        let listener = self.listener.as_ref();
        listener.is_some_and(|listener| listener.requests(wish))
    }

    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        self.progress.follow(event);
        // What is printed must not run into the bar.
        match event {
            // Failures are printed with --quiet too.
            Event::Failed(failure) => {
                self.progress
                    .suspend(|| print_failures(std::slice::from_ref(failure)));
            }
            Event::Loaded(material, _, brdf) => {
                self.progress.suspend(|| doubt(material, *brdf));
            }
            Event::Made(rows) => self.folder.borrow_mut().write_rows(rows)?,
            Event::Complete(rows) => {
                if let Some(lines) = &self.lines {
                    self.progress.suspend(|| print(&lines(rows)))?;
                }
            }
            _ => {}
        }
        match &mut self.listener {
            Some(listener) => listener.observe(event),
            None => Ok(()),
        }
    }
}

/// Keeps records in memory, and shows the progress.
struct Collect<T> {
    progress: Progress,
    made: Vec<T>,
}

/// Runs all of an experiment: what was made, and what failed.
pub(super) fn collect<E: Experiment>(plan: &E) -> Result<(Vec<E::Record>, Vec<Failure>), Error> {
    let mut collected = Collect {
        progress: Progress::new(),
        made: Vec::new(),
    };
    let summary = plan.run(&Extent::default(), &Known::default(), &mut collected)?;
    note_inputs(&summary);
    Ok((collected.made, summary.failures))
}

/// Writes what failed to stderr.
pub(super) fn print_failures(failures: &[Failure]) {
    for Failure { job, reason, .. } in failures {
        say(&format!("gonio: {job}: {reason}"));
    }
}

impl<T: Clone> Observer<T> for Collect<T> {
    fn begins(&mut self, work: f64) {
        self.progress.begin(work as u64);
    }

    fn observe(&mut self, event: &Event<'_, T>) -> Result<(), Error> {
        self.progress.follow(event);
        if let Event::Made(made) = event {
            self.made.extend_from_slice(made);
        }
        Ok(())
    }
}
