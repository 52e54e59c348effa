//! `gonio bench`.

use super::signals::stop_flag;
use super::{
    JsonArgs, Progress, ThreadArgs, make_folder, note, print, print_json, refuse_existing,
    write_text,
};
use crate::bench::{
    self, Layout, Listener, Machine, Row, Section, Settings, Task, fronts, grown, json, reached,
};
use crate::error::Error;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use serde_json::{Map, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What choices are worth for what they cost here: errors against seconds, and the best of them
#[derive(Debug, Args)]
pub(super) struct Bench {
    /// What to measure; all of it if left out
    #[arg(value_name = "SECTION", value_parser = sections())]
    sections: Vec<String>,
    /// Little of each section: all of them take less than 20 s on two cores
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    threads: ThreadArgs,
    /// A MERL table in place of one of GGX 0.1 (moments, reconstructions)
    #[arg(long, value_name = "FILE")]
    merl: Option<PathBuf>,
    /// View elevations of moments, from 0° to 89° [default: 90, or 1 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    views: Option<u32>,
    #[command(flatten)]
    json: JsonArgs,
    /// Folder for bench-SECTION.csv and bench-SECTION.svg
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long, requires = "output")]
    force: bool,
}

fn sections() -> PossibleValuesParser {
    let value = |s: &'static Section| PossibleValue::new(s.name).help(s.summary);
    bench::all().map(value).into()
}

impl Bench {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let is_wanted = |s: &&Section| {
            self.sections.is_empty() || self.sections.iter().any(|name| name == s.name)
        };
        let sections: Vec<_> = bench::all().into_iter().filter(is_wanted).collect();
        for section in &sections {
            for file in self.files(section).into_iter().flatten() {
                refuse_existing(&file, self.force)?;
            }
        }
        let settings = Settings {
            quick: self.quick,
            views: self.views.map(|n| n as usize),
            merl: self.merl.clone(),
        };
        let mut output = BenchOutput {
            stop: stop_flag(""),
            progress: Progress::new(),
            layout: None,
        };
        let mut tasks = Vec::new();
        for section in sections {
            tasks.push(Task::new(section, &settings, &mut output)?);
        }
        let seconds: f64 = tasks.iter().map(Task::seconds).sum();
        note(&match seconds {
            s if s < 90.0 => format!("gonio: takes about {} s", s.ceil()),
            s => format!("gonio: takes about {:.0} minutes", s / 60.0),
        });
        output.progress = Progress::with_work((STEPS * seconds) as u64, "benches");
        self.measure(&tasks, &mut output)
    }

    fn measure(&self, tasks: &[Task], output: &mut BenchOutput) -> Result<(), Error> {
        let machine = Machine::this();
        let mut objects = Map::new();
        let mut count = 0;
        for task in tasks {
            if !output.go_on() {
                break;
            }
            let section = task.section;
            if !self.json.wanted() {
                let layout = Layout::new(task);
                output.progress.suspend(|| print(&layout.head(&machine)))?;
                output.layout = Some(layout);
            }
            let rows = task.run(output)?;
            count += rows.len();
            match self.json.wanted() {
                true => {
                    objects.insert(section.name.into(), json(section, &rows));
                }
                false => {
                    let text = fronts(section, &rows)
                        + &reached(section, &rows)
                        + &grown(section, &rows)
                        + "\n";
                    output.progress.suspend(|| print(&text))?;
                }
            }
            if let Some([csv, svg]) = self.files(section) {
                output.progress.suspend(|| {
                    csv.parent().map_or(Ok(()), make_folder)?;
                    write_text(&csv, &bench::csv(section, &rows, &machine))?;
                    write_text(&svg, &bench::svg(section, &rows, &machine))
                })?;
            }
        }
        if self.json.wanted() {
            let (cpu, threads) = (machine.cpu, machine.threads);
            print_json(&json!({"cpu": cpu, "threads": threads, "sections": objects}))?;
        }
        if !output.go_on() {
            // The folder is made with the first file.
            let folder = self.output.clone().filter(|dir| count > 0 && dir.exists());
            let path = folder.unwrap_or_else(|| "stdout".into());
            return Err(Error::Interrupted { rows: count, path });
        }
        Ok(())
    }

    fn files(&self, section: &Section) -> Option<[PathBuf; 2]> {
        let dir = self.output.as_ref()?;
        Some(["csv", "svg"].map(|ending| dir.join(format!("bench-{}.{ending}", section.name))))
    }
}

/// The rows that are printed, and the bar below them.
struct BenchOutput {
    stop: Arc<AtomicBool>,
    progress: Progress,
    /// `None`: rows are printed as JSON at the end.
    layout: Option<Layout>,
}

/// Steps of the bar in a second.
const STEPS: f64 = 1000.0;

impl Listener for BenchOutput {
    fn go_on(&self) -> bool {
        !self.stop.load(Ordering::SeqCst)
    }

    fn made(&mut self, _: &Task, row: &Row) -> Result<(), Error> {
        match &self.layout {
            Some(layout) => self.progress.suspend(|| print(&layout.row(row))),
            None => Ok(()),
        }
    }

    fn left_out(&mut self, what: &str, why: &str) {
        let line = format!("gonio: {what} is left out: {why}");
        self.progress.suspend(|| note(&line));
    }

    fn passed(&mut self, seconds: f64) {
        self.progress.advance(STEPS * seconds);
    }
}
