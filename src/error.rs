//! The one public error; its variants say who must act.

use std::borrow::Cow;
use std::ops::{Bound, RangeBounds};
use std::path::{Path, PathBuf};

/// Why a file is not read that is to be replaced, and why one that was read is not replaced.
pub(crate) const IS_INPUT: &str =
    "this file is read and was to be replaced; choose another name for what is written";

/// Most characters of a user's text that a message repeats.
const EXCERPT: usize = 60;

/// The part of a user's text that a message repeats: all of it, or the start of a long one, on one line. Quotes
/// are closed.
pub(crate) fn excerpt(text: &str) -> Cow<'_, str> {
    let quote = if text.starts_with('"') { "\"" } else { "" };
    match text.char_indices().nth(EXCERPT) {
        None => printable(text),
        Some((end, _)) => format!("{}…{quote}", printable(&text[..end])).into(),
    }
}

/// Largest number of characters of another library's message on a file, or of a list that the file holds.
const REASON: usize = 240;

/// The message of another library on a file, or a list that the file holds, of any length: its start, on one line.
pub(crate) fn reason(why: impl std::fmt::Display) -> String {
    let why: String = why.to_string().chars().take(REASON).collect();
    printable(&why).into_owned()
}

/// A text without what moves a cursor or changes colours: a line stays one, whatever a name or a cell holds.
///
/// ```
/// assert_eq!(gonio::error::printable("a\nb"), "a\u{fffd}b");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    match text.contains(char::is_control) {
        true => text.replace(char::is_control, "\u{fffd}").into(),
        false => text.into(),
    }
}

/// Texts in one line, with commas.
///
/// ```
/// assert_eq!(gonio::error::listed([1, 2]), "1, 2");
/// ```
pub fn listed(all: impl IntoIterator<Item: ToString>) -> String {
    let texts = all.into_iter().map(|one| one.to_string());
    texts.collect::<Vec<_>>().join(", ")
}

/// A number of things: `1 row`, `2 rows`.
///
/// ```
/// assert_eq!(gonio::error::count(1, "row"), "1 row");
/// assert_eq!(gonio::error::count(0, "row"), "0 rows");
/// ```
pub fn count(number: usize, noun: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{plural}")
}

/// A number of things with its verb: `1 row is`, `2 rows are`.
pub fn count_are(number: usize, noun: &str) -> String {
    let verb = if number == 1 { "is" } else { "are" };
    format!("{} {verb}", count(number, noun))
}

/// What is allowed where `found` is none of `names`: the names, and the one that may be meant.
///
/// ```
/// let allowed = gonio::error::one_of("hybird", ["spherical", "hybrid"]);
/// assert_eq!(allowed, "spherical, hybrid; did you mean hybrid?");
/// assert_eq!(gonio::error::one_of("polar", ["spherical", "hybrid"]), "spherical, hybrid");
///
/// // Names that a file holds are of any length and number; a sentence is not.
/// let long = "x".repeat(5000);
/// assert!(gonio::error::one_of("polar", [&long]).len() < 100);
/// assert!(gonio::error::one_of("polar", vec!["name"; 5000]).len() < 1300);
/// ```
pub fn one_of<S: AsRef<str>>(found: &str, names: impl IntoIterator<Item = S>) -> String {
    let names: Vec<S> = names.into_iter().collect();
    let list: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    excerpts(&list) + &meant(found, &list)
}

/// Most characters of the names that are allowed.
const NAMES: usize = 1200;

/// Names that a user may have given, of any length and number: as many as a sentence holds, of long ones the start.
fn excerpts(names: &[&str]) -> String {
    let mut list = String::new();
    for (i, name) in names.iter().enumerate() {
        let name = excerpt(name);
        if list.len() + name.len() > NAMES {
            return format!("{list} and {} more", names.len() - i);
        }
        list += if i > 0 { ", " } else { "" };
        list += &name;
    }
    list
}

/// Ends a sentence on a name that is not allowed: `; did you mean NAME?`, or nothing if none is near.
pub(crate) fn meant<S: AsRef<str>>(found: &str, names: &[S]) -> String {
    let plain = |text: &str| text.to_lowercase().replace(['_', ' '], "-");
    // Of a long text only the start can be a name.
    let found: String = plain(found).chars().take(EXCERPT).collect();
    let letters = |text: &str| text.chars().count();
    let near = names.iter().map(AsRef::as_ref).filter_map(|name| {
        let name = (name, plain(name));
        let wrong = strsim::osa_distance(&found, &name.1);
        let length = letters(&found).max(letters(&name.1));
        // One slip in three letters; of two letters one.
        (wrong <= (length / 3).max(1) && wrong < length).then_some((wrong, name.0))
    });
    let begins = |name: &&str| letters(&found) > 2 && plain(name).starts_with(&found);
    let nearest = near.min_by_key(|(wrong, _)| *wrong).map(|(_, name)| name);
    match nearest.or_else(|| names.iter().map(AsRef::as_ref).find(begins)) {
        Some(name) => format!("; did you mean {}?", excerpt(name)),
        None => String::new(),
    }
}

/// A parameter outside its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key} = {value}: allowed is {allowed}")]
pub struct ParameterError {
    /// The config key.
    pub key: String,
    /// The value that was given.
    pub value: String,
    /// The allowed values, as a phrase.
    pub allowed: String,
}

/// Characters of a number from which on it is written with an exponent: doubles have fewer digits.
const LONG: usize = 24;

impl ParameterError {
    /// The key, the value that was given (of a long one the start is kept, of none `""`), and what is
    /// allowed.
    pub fn new(
        key: impl Into<String>,
        value: impl std::fmt::Display,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            key: key.into(),
            value: match value.to_string() {
                nothing if nothing.is_empty() => "\"\"".into(),
                text => match text.parse::<f64>() {
                    Ok(number) if text.len() > LONG && number.is_finite() => format!("{number:e}"),
                    _ => excerpt(&text).into_owned(),
                },
            },
            allowed: allowed.into(),
        }
    }

    /// This error for a table inside `table`: its key gets that prefix.
    #[must_use]
    pub(crate) fn within(self, table: &str) -> Self {
        Self {
            key: format!("{table}.{}", self.key),
            ..self
        }
    }
}

/// Checks `lo < value ≤ hi`; NaN and infinities fail, so `hi` may be infinite.
pub fn in_left_open(key: &str, value: f64, lo: f64, hi: f64) -> Result<f64, ParameterError> {
    if value > lo && value <= hi && value.is_finite() {
        return Ok(value);
    }
    let allowed = if hi == f64::INFINITY {
        format!("a finite number above {lo}")
    } else {
        format!("a number in ({lo}, {hi}]")
    };
    Err(ParameterError::new(key, value, allowed))
}

/// Checks `lo ≤ value ≤ hi` (NaN fails).
pub(crate) fn in_closed(key: &str, value: f64, lo: f64, hi: f64) -> Result<f64, ParameterError> {
    if value >= lo && value <= hi {
        Ok(value)
    } else {
        Err(ParameterError::new(
            key,
            value,
            format!("a number in [{lo}, {hi}]"),
        ))
    }
}

/// Numbers above `lo` up to `hi`.
pub(crate) const fn left_open(lo: f64, hi: f64) -> (Bound<f64>, Bound<f64>) {
    (Bound::Excluded(lo), Bound::Included(hi))
}

/// Checks that a number is in a range, `lo..=hi` or [`left_open`].
pub(crate) fn in_range(
    key: &str,
    value: f64,
    range: &impl RangeBounds<f64>,
) -> Result<f64, ParameterError> {
    let hi = match range.end_bound() {
        Bound::Included(hi) | Bound::Excluded(hi) => *hi,
        Bound::Unbounded => f64::INFINITY,
    };
    match range.start_bound() {
        Bound::Excluded(lo) => in_left_open(key, value, *lo, hi),
        Bound::Included(lo) => in_closed(key, value, *lo, hi),
        Bound::Unbounded => in_closed(key, value, f64::NEG_INFINITY, hi),
    }
}

/// Checks that a whole number is one of `least..=most`.
pub(crate) fn in_whole(
    key: &str,
    value: usize,
    [least, most]: [usize; 2],
) -> Result<usize, ParameterError> {
    match (least..=most).contains(&value) {
        true => Ok(value),
        false => {
            let allowed = format!("a whole number from {least} to {most}");
            Err(ParameterError::new(key, value, allowed))
        }
    }
}

/// A path in a message; `""` of none.
fn named(path: &Path) -> String {
    match path.as_os_str().is_empty() {
        true => "\"\"".into(),
        false => path.display().to_string(),
    }
}

/// The error behind an error.
pub(crate) type Cause = Box<dyn std::error::Error + Send + Sync>;

/// Everything that can go wrong, by who must act.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The author of the config: a key, its value, what is allowed.
    #[error("{place}: {message}")]
    Config {
        /// File and line, or the option.
        place: String,
        /// The message, one sentence.
        message: String,
    },
    /// The owner of the output folder.
    #[error("{}: {message}", named(path))]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// The message, one sentence.
        message: String,
    },
    /// The owner of the input data.
    #[error("{}: {message}", named(path))]
    Data {
        /// The file or folder.
        path: PathBuf,
        /// The message, one sentence.
        message: String,
        /// Why, if the sentence does not say it.
        #[source]
        source: Option<Cause>,
    },
    /// Who chose the instrument: it cannot measure what is asked.
    #[error("{place}: {message}")]
    Infeasible {
        /// File and line, or the option.
        place: String,
        /// The message, one sentence.
        message: String,
    },
    /// Some jobs of a run failed; the rows of the others are kept.
    #[error("{failed} of {} failed; the rows of the others are in {}", count(*jobs, "job"), path.display())]
    JobsFailed {
        /// Jobs that failed.
        failed: usize,
        /// Jobs of the run.
        jobs: usize,
        /// The run's folder.
        path: PathBuf,
    },
    /// Parts of a study are missing; the rows of the others are kept.
    #[error("only {rows} of {} there; they are in {}", count_are(*of, "row"), path.display())]
    Incomplete {
        /// Number of rows there are.
        rows: usize,
        /// Number of rows of the whole.
        of: usize,
        /// The folder.
        path: PathBuf,
    },
    /// A check found a violation.
    #[error("{0}")]
    Violation(String),
    /// The user pressed Ctrl-C; finished rows are kept.
    #[error("interrupted; {} in {}", count_are(*rows, "finished row"), path.display())]
    Interrupted {
        /// Rows that were written.
        rows: usize,
        /// The run's folder.
        path: PathBuf,
    },
    /// The authors of the program: something that should not happen.
    #[error("internal error: {0}")]
    Internal(String),
}

impl Error {
    /// Exit code: 1 internal; 2 usage, config or output folder; 3 input data; 4 infeasible plan; 5 some jobs
    /// failed or are missing; 6 a check found a violation; 130 interrupted (`gonio` has 143 of SIGTERM).
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Internal(_) => 1,
            Error::Config { .. } | Error::Output { .. } => 2,
            Error::Data { .. } => 3,
            Error::Infeasible { .. } => 4,
            Error::JobsFailed { .. } | Error::Incomplete { .. } => 5,
            Error::Violation(_) => 6,
            Error::Interrupted { .. } => 130,
        }
    }

    /// An error that should not happen.
    pub(crate) fn internal(e: impl std::fmt::Display) -> Self {
        Error::Internal(e.to_string())
    }

    /// A config error.
    pub(crate) fn config(place: impl Into<String>, message: impl std::fmt::Display) -> Self {
        Error::Config {
            place: place.into(),
            message: message.to_string(),
        }
    }

    /// A plan that an instrument cannot carry out.
    pub(crate) fn infeasible(place: impl Into<String>, message: impl std::fmt::Display) -> Self {
        Error::Infeasible {
            place: place.into(),
            message: message.to_string(),
        }
    }

    /// An input-data error; an output error if the file is to be replaced.
    pub fn data(path: impl Into<PathBuf>, message: impl std::fmt::Display) -> Self {
        let message = message.to_string();
        match message.ends_with(IS_INPUT) {
            true => Error::output(path, IS_INPUT),
            false => Error::Data {
                path: path.into(),
                message,
                source: None,
            },
        }
    }

    /// An output error.
    pub fn output(path: impl Into<PathBuf>, message: impl std::fmt::Display) -> Self {
        Error::Output {
            path: path.into(),
            message: message.to_string(),
        }
    }
}
