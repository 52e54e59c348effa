//! Places in a config, and checks of lists and names there: refuses empty lists and duplicates.

use super::source::Source;
use super::tables::Named;
use super::wording::KeyPath;
use crate::brdf::BuildError;
use crate::error::{Error, ParameterError, excerpt};
use std::collections::HashSet;
use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;

/// A place in a config, which errors about its value name.
#[derive(Clone)]
pub(crate) struct Place<'s> {
    source: &'s Source,
    path: KeyPath,
}

impl Source {
    /// The place of a key of the top level; the key of a table within is dotted.
    pub(crate) fn place(&self, key: &str) -> Place<'_> {
        let (source, path) = (self, KeyPath::default());
        Place { source, path }.key(key)
    }
}

impl<'s> Place<'s> {
    /// The place of a key of the table here; the key of a table within is dotted.
    pub(crate) fn key(&self, key: &str) -> Self {
        let keys = key.split('.');
        Self {
            path: keys.fold(self.path.clone(), |path, key| path.key(key)),
            ..*self
        }
    }

    /// The place of an element of the list here.
    pub(crate) fn index(&self, index: usize) -> Self {
        Self {
            path: self.path.index(index),
            ..*self
        }
    }

    /// An error about the value here, in a sentence.
    pub(crate) fn error(&self, sentence: impl Display) -> Error {
        self.source.error_at(&self.path, sentence)
    }

    /// An error about the value here, in a sentence that begins with the place.
    pub(crate) fn problem(&self, predicate: impl Display) -> Error {
        self.error(format_args!("{self} {predicate}"))
    }

    /// The error of a value here that is not allowed.
    pub(crate) fn refused(&self, value: impl Display, allowed: impl Into<String>) -> Error {
        self.error(ParameterError::new(self.to_string(), value, allowed))
    }

    /// Refuses a whole number here that is out of range.
    pub(crate) fn whole<T: Display + PartialOrd>(
        &self,
        value: T,
        range: RangeInclusive<T>,
    ) -> Result<(), Error> {
        if range.contains(&value) {
            return Ok(());
        }
        let (least, most) = range.into_inner();
        Err(self.refused(value, format!("a whole number from {least} to {most}")))
    }

    /// The error of a parameter of the table here, named from the top of the config.
    pub(crate) fn refused_key(&self, e: &ParameterError) -> Error {
        self.key(&e.key).error(format_args!("{self}.{e}"))
    }

    /// The error of a material or lighting here, by who must act.
    pub(crate) fn not_built(&self, e: BuildError) -> Error {
        match e {
            BuildError::Parameter(e) => self.refused_key(&e),
            BuildError::Data { path, message } => Error::data(path, message),
        }
    }

    /// The line, or the option, that sets the value here.
    pub(crate) fn location(&self) -> String {
        self.source.location(&self.path)
    }
}

impl Display for Place<'_> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        self.path.fmt(f)
    }
}

/// Items, each once, in the order of their first appearance.
pub(crate) fn each_once<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    first_of_each(items, T::eq)
}

/// Of items that are alike the first, in their order.
pub(crate) fn first_of_each<T>(
    items: impl IntoIterator<Item = T>,
    are_alike: impl Fn(&T, &T) -> bool,
) -> Vec<T> {
    let mut list: Vec<T> = Vec::new();
    for item in items {
        if !list.iter().any(|known| are_alike(known, &item)) {
            list.push(item);
        }
    }
    list
}

/// Refuses a list that names something twice.
pub(super) fn distinct<T, S: Display + Eq + std::hash::Hash>(
    at: &Place<'_>,
    list: &[T],
    show: impl Fn(&T) -> S,
) -> Result<(), Error> {
    let mut seen = HashSet::new();
    for (i, item) in list.iter().enumerate() {
        if !seen.insert(show(item)) {
            let predicate = format!("= {} is there twice; allowed: once", show(item));
            return Err(at.index(i).problem(predicate));
        }
    }
    Ok(())
}

pub(super) fn refuse_empty<T>(at: &Place<'_>, list: &[T]) -> Result<(), Error> {
    match list.is_empty() {
        true => Err(at.problem("= []: allowed is at least one")),
        false => Ok(()),
    }
}

/// Gives every choice its name, written or made from its keys.
pub(super) fn name_all<T: ?Sized>(
    at: &Place<'_>,
    list: Vec<Named<T>>,
    label: impl Fn(&T) -> String,
) -> Result<Vec<(String, Box<T>)>, Error> {
    refuse_empty(at, &list)?;
    let mut names = Names::default();
    let named = list.into_iter().enumerate().map(|(i, table)| {
        let name = table.name.unwrap_or_else(|| label(&table.choice));
        names.take(&at.index(i), &name)?;
        Ok((name, table.choice))
    });
    named.collect()
}

/// Bytes of a name. File systems allow 255, of which endings need some.
const LONGEST_NAME: usize = 200;

/// Names already used in a plan.
#[derive(Default)]
pub(super) struct Names(HashSet<String>);

impl Names {
    /// Takes the name of a table; refuses one already taken.
    pub(super) fn take(&mut self, table: &Place<'_>, name: &str) -> Result<(), Error> {
        let place = table.key("name");
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            let allowed = "a text that is not blank and has no control characters";
            return Err(place.refused(format!("{name:?}"), allowed));
        }
        if name.len() > LONGEST_NAME {
            let allowed = format!("at most {LONGEST_NAME} bytes, as names become those of files");
            return Err(place.refused(format!("{name:?}"), allowed));
        }
        if !self.0.insert(name.to_owned()) {
            let name = excerpt(name);
            let predicate = format!(
                "= {name:?} is taken; allowed: names that differ, e.g. name = \"{name}-2\""
            );
            return Err(place.problem(predicate));
        }
        Ok(())
    }
}
