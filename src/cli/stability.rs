//! `gonio stability`.

use super::signals::{self, stop_flag};
use super::{OutputArgs, Progress, ThreadArgs, no_member, write_text};
use crate::error::{Error, count};
use crate::report::{broken, stability_html, stability_table};
use crate::stability::{self, Extent, Family, Verdict};
use clap::{ArgGroup, Args};
use std::path::PathBuf;

/// Walks every registry over the extreme cases and judges each error by the conditioning of its case
#[derive(Debug, Args)]
#[command(after_help = families(), group = ArgGroup::new("files").multiple(true))]
pub(super) struct Stability {
    /// Families to walk; all if left out
    #[arg(value_name = "FAMILY")]
    families: Vec<String>,
    /// A part of the cases, in some seconds
    #[arg(long)]
    short: bool,
    /// Write a page with the tables to this file
    #[arg(long, value_name = "FILE", group = "files")]
    html: Option<PathBuf>,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// The families, a line each.
fn families() -> String {
    let line = |f: &Family| format!("\n  {:<17} {}", f.name, f.summary);
    let lines: String = stability::all().iter().map(line).collect();
    format!("Families:{lines}\n\nExit code 6 if a law is broken.")
}

impl Stability {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        self.output.check()?;
        self.output.check_also(self.html.as_deref())?;
        let all = stability::all();
        let names = || all.iter().map(|f| f.name);
        if let Some(name) = self.families.iter().find(|f| !names().any(|n| n == *f)) {
            return Err(no_member("FAMILY", "family", name, names()));
        }
        let extent = match self.short {
            true => Extent::Short,
            false => Extent::Whole,
        };
        let wanted =
            |f: &&Family| self.families.is_empty() || self.families.iter().any(|n| n == f.name);
        let families = all.iter().filter(wanted);
        let families: Vec<_> = families.map(|f| (f.name, (f.checks)(extent))).collect();
        let laws: usize = families.iter().map(|(_, checks)| checks.len()).sum();
        let progress = Progress::with_work(laws as u64, "");
        let stop = stop_flag("");
        let findings = stability::run(families, &stop, &|| progress.count(1));
        drop(progress);
        signals::ends();
        self.output.write_rows(&findings, stability_table)?;
        if let Some(path) = &self.html {
            write_text(path, &stability_html(&findings))?;
        }
        let walked = findings.iter().map(|f| f.verdict != Verdict::Interrupted);
        let rows = walked.filter(|is_walked| *is_walked).count();
        if rows < findings.len() {
            let path = self.output.place().to_owned();
            return Err(Error::Interrupted { rows, path });
        }
        let mut broken = broken(&findings).map(|f| format!("{}: {}", f.member, f.law));
        let Some(first) = broken.next() else {
            return Ok(());
        };
        Err(Error::Violation(match broken.count() {
            0 => format!("a law is broken: {first}"),
            more => format!("{} are broken; the first: {first}", count(more + 1, "law")),
        }))
    }
}
