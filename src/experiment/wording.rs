//! Places in a config, and serde's and toml's messages about them in the house's words: key, value, what is allowed.

use crate::error::{excerpt, meant, one_of};
use std::fmt;

/// A step from a table or array to what it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// The value of a key.
    Key(String),
    /// An element of an array, from 0.
    Index(usize),
}

/// Path of a value in a config; shown as `material[2].alpha`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub(super) Vec<Step>);

impl KeyPath {
    /// The path of a key in the table at this path.
    #[must_use]
    pub(crate) fn key(&self, key: &str) -> Self {
        self.then(Step::Key(key.into()))
    }

    /// The path of an element of the array at this path.
    #[must_use]
    pub(crate) fn index(&self, index: usize) -> Self {
        self.then(Step::Index(index))
    }

    fn then(&self, step: Step) -> Self {
        let mut path = self.clone();
        path.0.push(step);
        path
    }

    pub(super) fn starts_with(&self, other: &Self) -> bool {
        self.0.starts_with(&other.0)
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (i, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) if i == 0 => write!(f, "{}", excerpt(key))?,
                Step::Key(key) => write!(f, ".{}", excerpt(key))?,
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// Keys that are read before the rest of a table of the top level, or, if `true`, of elements of a list there: its reader does
/// not list them as allowed.
const TAKEN_KEYS: [(&str, bool, &[&str]); 9] = [
    ("moments", false, &["estimator"]),
    ("pictures", false, &["lighting"]),
    ("tuning", false, &["materials"]),
    (
        "instrument",
        true,
        &["preset", "change", "file", "spec", "name"],
    ),
    ("lighting", true, &["kind", "name"]),
    ("material", true, &["kind", "name", "symmetry"]),
    ("parametrization", true, &["kind"]),
    ("reconstruction", true, &["kind", "name", "up_to", "on"]),
    ("sample_set", true, &["kind", "name", "up_to", "on"]),
];

/// Keys of a table at the top level, or of an element of a list there, that its reader does not see.
pub(super) fn taken_before(name: &str, in_list: bool) -> &'static [&'static str] {
    let is_it = |taken: &&(&str, bool, _)| (taken.0, taken.1) == (name, in_list);
    TAKEN_KEYS.iter().find(is_it).map_or(&[], |taken| taken.2)
}

/// A message on the text `found` that names its key and value: serde's, which do not, are put into the house's words.
pub(super) fn name_key(path: &KeyPath, found: &str, message: &str) -> String {
    let found = excerpt(found);
    let typed = message
        .strip_prefix("invalid type: ")
        .or_else(|| message.strip_prefix("invalid value: "));
    if let Some((found, expected)) = typed.and_then(|m| m.split_once(", expected ")) {
        // Of names in a list the one that may be meant.
        let names: Vec<&str> = expected.split('"').skip(1).step_by(2).collect();
        let quoted = found.split('"').nth(1).unwrap_or_default();
        return format!(
            "{path} is {}; allowed: {}{}",
            excerpt(found),
            in_words(expected),
            meant(quoted, &names)
        );
    }
    let listed = |found: &str, extra: &[&str]| {
        let list = message
            .split_once("`, expected ")
            .map_or("", |(_, list)| list);
        let all: Vec<_> = extra.iter().copied().chain(quoted(list)).collect();
        if all.is_empty() {
            "none here".into()
        } else {
            one_of(found, all)
        }
    };
    if message.starts_with("unknown field `") {
        let extra: &[&str] = match path.0.as_slice() {
            [Step::Key(list), Step::Index(_), Step::Key(_)] => taken_before(list, true),
            [Step::Key(table), Step::Key(_)] => taken_before(table, false),
            _ => &[],
        };
        let key = message.split('`').nth(1).unwrap_or_default();
        return format!("unknown key {path}; allowed: {}", listed(key, extra));
    }
    if message == "wanted string or table" {
        return format!("{path} = {found}; allowed: a string");
    }
    if let Some(rest) = message.strip_prefix("unknown variant `") {
        let variant = rest.split('`').next().unwrap_or(rest);
        let (variant, allowed) = (excerpt(variant), listed(variant, &[]));
        return format!("{path} = \"{variant}\"; allowed: {allowed}");
    }
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("{path} lacks the key {}", key.replace('`', ""));
    }
    // Of a table whose keys are known here by their own place.
    if let Some((key, list)) = message
        .strip_prefix("unknown key `")
        .and_then(|rest| rest.split_once("`, expected "))
    {
        let names: Vec<&str> = quoted(list).collect();
        return format!("{path}: {message}{}", meant(key, &names));
    }
    let last_key = path.0.iter().rev().find_map(|step| match step {
        Step::Key(key) => Some(key.as_str()),
        Step::Index(_) => None,
    });
    let Some(key) = last_key else {
        return message.to_owned();
    };
    match message.strip_prefix(key).and_then(|m| m.strip_prefix(": ")) {
        Some(rest) => format!("{path} = {found}: {rest}"),
        None if message.contains(key) => message.to_owned(),
        None => format!("{path}: {message}"),
    }
}

/// The names of serde's `one of `a`, `b``.
pub(super) fn quoted(list: &str) -> impl Iterator<Item = &str> {
    list.split('`').skip(1).step_by(2)
}

/// Name of a Rust type in a config author's words.
fn in_words(expected: &str) -> &str {
    match expected {
        "f64" | "f32" => "a number",
        "usize" | "u64" | "u32" => "a whole number, at least 0",
        "i64" | "i32" => "a whole number",
        "a boolean" => "true or false",
        "a sequence" => "a list [ … ]",
        "a map" => "a table",
        "path string" => "a string",
        other => other,
    }
}
