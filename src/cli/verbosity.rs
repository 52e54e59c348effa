//! Notes on stderr beside errors, and their colours: `--quiet`, `--verbose`, `--color`.

use crate::error::{count, printable};
use crate::measurement::Measurement;
use crate::metrics::Expected;
use crate::reconstruct::Suspect;
use clap::builder::styling::{AnsiColor, Style};
use clap::{Args, ColorChoice, ValueEnum};
use std::env;
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Options of every command.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct VerbosityArgs {
    /// No progress bar and no notes on stderr; errors are still printed
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Print which files are read, how long it took and on how many threads
    #[arg(short, long, global = true)]
    verbose: bool,
    /// Colours in help and messages; by default on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_name = "WHEN", default_value_t = ColorChoice::Auto)]
    color: ColorChoice,
}

/// The options of this process; a library call has none.
static OPTIONS: OnceLock<VerbosityArgs> = OnceLock::new();

impl VerbosityArgs {
    pub(super) fn apply(self) {
        // Set once: a process has one command line.
        let _ = OPTIONS.set(self);
    }
}

/// True if stderr has errors only.
pub(super) fn is_quiet() -> bool {
    OPTIONS.get().is_some_and(|options| options.quiet)
}

/// True with `--verbose`.
pub(super) fn is_verbose() -> bool {
    OPTIONS.get().is_some_and(|options| options.verbose)
}

/// Writes a line to stderr. A stderr that is closed is no
/// reason to end otherwise than without that line (`eprintln!` would panic).
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Writes a line that is no error to stderr, unless `--quiet`.
pub(super) fn note(line: &str) {
    if !is_quiet() {
        say(line);
    }
}

/// Notes the path of a file that was written. Results alone go to stdout: paths are notes.
pub(super) fn wrote(path: &Path) {
    note(&printable(&path.display().to_string()));
}

/// Writes a line to stderr with `--verbose`.
pub(super) fn detail(line: impl FnOnce() -> String) {
    if is_verbose() {
        say(&printable(&line()));
    }
}

/// Writes an error and its cause to stderr.
pub fn say_error(error: &dyn std::error::Error) {
    let style = match OPTIONS.get().map(|options| options.color) {
        Some(ColorChoice::Always) => true,
        Some(ColorChoice::Never) | None => false,
        Some(ColorChoice::Auto) => {
            io::stderr().is_terminal() && env::var_os("NO_COLOR").is_none_or(|no| no.is_empty())
        }
    };
    let style = match style {
        true => AnsiColor::Red.on_default().bold(),
        false => Style::new(),
    };
    // A path may have any character but `/`.
    let text = |error: &dyn std::error::Error| printable(&error.to_string()).into_owned();
    say(&format!("{style}gonio:{style:#} {}", text(error)));
    let mut cause = error.source();
    while let Some(error) = cause {
        say(&format!("  because: {}", text(error)));
        cause = error.source();
    }
}

/// The colours that a command line asks for, before it is read: help and refusals have some too.
pub(super) fn color_of(args: impl IntoIterator<Item = OsString>) -> ColorChoice {
    let args = args.into_iter();
    let mut args = args.map(|arg| arg.to_string_lossy().into_owned());
    while let Some(arg) = args.next().filter(|arg| arg != "--") {
        let value = match arg.strip_prefix("--color") {
            Some("") => args.next(),
            Some(rest) => rest.strip_prefix('=').map(str::to_owned),
            None => None,
        };
        if let Some(choice) = value.and_then(|v| ColorChoice::from_str(&v, false).ok()) {
            return choice;
        }
    }
    ColorChoice::Auto
}

/// Expected errors, each with what nine of ten are below.
pub(super) fn with_bound(expected: &Expected, readings: usize) -> String {
    let bound = expected.bound(readings);
    let error = |error: Option<f64>| error.map_or("–".into(), |e| format!("{e:.4}"));
    let with = |own, bound| format!("{} (upper bound {})", error(own), error(bound));
    let nrmse = with(expected.nrmse, bound.nrmse);
    let log_relative = with(expected.log_relative, bound.log_relative);
    format!("expected nrmse {nrmse}, log_relative {log_relative}")
}

/// Most suspected readings that are listed.
const LISTED: usize = 20;

/// The readings of some files that all others contradict, a line each; nothing if there are none.
pub(super) fn suspected(
    measurement: &Measurement,
    files: &[PathBuf],
    suspects: &[Suspect],
) -> String {
    if suspects.is_empty() {
        return String::new();
    }
    let all = count(suspects.len(), "reading");
    let them = if suspects.len() == 1 { "it" } else { "them" };
    let mut text = format!("left out: {all}, since all others contradict {them}\n");
    for suspect in suspects.iter().take(LISTED) {
        let pair = &measurement.schedule.poses[suspect.pose].pair;
        let place = measurement.places.get(suspect.pose);
        let place = place.and_then(|place| Some((files.get(place.file)?.display(), place.line)));
        let place = place.map(|(file, line)| format!("{file}:{line}: "));
        text += &format!(
            "  {}theta_i {:.2}°, theta_o {:.2}°, {:.2}° apart: {:.4} where {:.4} ± {:.4} is expected\n",
            place.unwrap_or_default(),
            pair.omega_i.theta().to_degrees(),
            pair.omega_o.theta().to_degrees(),
            pair.separation().to_degrees(),
            suspect.value,
            suspect.expected,
            suspect.uncertainty,
        );
    }
    if let further @ 1.. = suspects.len().saturating_sub(LISTED) {
        text += &format!("  and {further} more\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_known_before_the_command_line_is_read() {
        let of = |line: &str| color_of(line.split(' ').map(OsString::from));
        assert_eq!(of("gonio list --color always"), ColorChoice::Always);
        assert_eq!(of("gonio --color=never list"), ColorChoice::Never);
        assert_eq!(of("gonio --color=blue list"), ColorChoice::Auto);
        assert_eq!(of("gonio list -- --color=never"), ColorChoice::Auto);
        assert_eq!(of("gonio"), ColorChoice::Auto);
    }
}
