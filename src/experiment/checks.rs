//! Checks of lists and names in a config: refuses empty lists and duplicates.

use super::keypath::KeyPath;
use super::source::Source;
use super::tables::Named;
use crate::error::{Error, ParameterError, excerpt};
use std::collections::HashSet;
use std::fmt::Display;

/// The path of a parameter, whose key may be dotted, in the table at `base`.
pub(super) fn below(base: &KeyPath, key: &str) -> KeyPath {
    key.split('.')
        .fold(base.clone(), |path, part| path.key(part))
}

/// The items without those that came before.
pub(super) fn each_once<T: PartialEq>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut distinct = Vec::new();
    for item in items {
        if !distinct.contains(&item) {
            distinct.push(item);
        }
    }
    distinct
}

/// The error of a value that is not allowed.
pub(super) fn refused(
    source: &Source,
    path: &KeyPath,
    value: impl Display,
    allowed: impl Into<String>,
) -> Error {
    source.error_at(path, ParameterError::new(path.to_string(), value, allowed))
}

/// The error of a parameter of the table at `base`, named from the top of the config.
pub(super) fn refused_in(source: &Source, base: &KeyPath, e: &ParameterError) -> Error {
    source.error_at(&below(base, &e.key), format!("{base}.{e}"))
}

/// Refuses an empty list and one that names something twice.
pub(super) fn distinct<T, S: Display + Eq + std::hash::Hash>(
    source: &Source,
    key: &str,
    list: &[T],
    show: impl Fn(&T) -> S,
) -> Result<(), Error> {
    refuse_empty(source, key, list)?;
    let mut seen = HashSet::new();
    for (i, item) in list.iter().enumerate() {
        if !seen.insert(show(item)) {
            let path = below(&KeyPath::default(), key).index(i);
            let message = format!("{path} = {} is there twice; allowed: once", show(item));
            return Err(source.error_at(&path, message));
        }
    }
    Ok(())
}

/// Refuses an empty list.
pub(super) fn refuse_empty<T>(source: &Source, key: &str, list: &[T]) -> Result<(), Error> {
    if list.is_empty() {
        let message = format!("{key} = []: allowed is at least one");
        return Err(source.error_at(&below(&KeyPath::default(), key), message));
    }
    Ok(())
}

/// Gives every choice its name, written or made from its keys.
pub(super) fn name_all<T: ?Sized>(
    source: &Source,
    key: &str,
    list: Vec<Named<T>>,
    label: impl Fn(&T) -> String,
) -> Result<Vec<(String, Box<T>)>, Error> {
    refuse_empty(source, key, &list)?;
    let mut names = Names::default();
    let mut out = Vec::with_capacity(list.len());
    for (i, Named { name, choice }) in list.into_iter().enumerate() {
        let name = name.unwrap_or_else(|| label(&choice));
        names.take(source, &KeyPath::of(key).index(i), &name)?;
        out.push((name, choice));
    }
    Ok(out)
}

/// Bytes of a name. File systems allow 255, of which endings and whatever tells several files of one
/// name apart need some.
const LONGEST_NAME: usize = 200;

/// Names already used in a plan.
#[derive(Default)]
pub(super) struct Names(HashSet<String>);

impl Names {
    /// Takes the name of the table at `path`; refuses one already taken.
    pub(super) fn take(
        &mut self,
        source: &Source,
        path: &KeyPath,
        name: &str,
    ) -> Result<(), Error> {
        let place = path.key("name");
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            let allowed = "a text that is not blank and has no control characters";
            return Err(refused(source, &place, format!("{name:?}"), allowed));
        }
        if name.len() > LONGEST_NAME {
            let allowed = format!("at most {LONGEST_NAME} bytes, as names become those of files");
            return Err(refused(source, &place, format!("{name:?}"), allowed));
        }
        if !self.0.insert(name.to_owned()) {
            let name = excerpt(name);
            let message = format!(
                "{place} = {name:?} is taken; allowed: names that differ, e.g. name = \"{name}-2\""
            );
            return Err(source.error_at(&place, message));
        }
        Ok(())
    }
}
