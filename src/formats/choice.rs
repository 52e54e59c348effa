//! Which format a file has.

use super::{Format, all};
use crate::error::{Error, excerpt, listed, one_of};
use crate::schedule::table::as_text;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A use of files: the words for it, and the function of a format that does it.
pub struct Use<T> {
    /// Plural, e.g. `schedules`.
    pub what: &'static str,
    /// `None` if a format does not do it.
    pub of: fn(&Format) -> Option<T>,
}

/// Why a file has no format for a use, one sentence.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FormatError(String);

impl<T> Use<T> {
    /// A use and who does it.
    pub(super) const fn new(what: &'static str, of: fn(&Format) -> Option<T>) -> Self {
        Self { what, of }
    }

    /// The formats that do this.
    pub fn formats(&self) -> impl Iterator<Item = Format> {
        let of = self.of;
        all().into_iter().filter(move |f| of(f).is_some())
    }

    /// Their extensions, each after `prefix`, joined by commas.
    pub fn extensions(&self, prefix: &str) -> String {
        let all = self.formats().flat_map(|f| f.extensions);
        listed(all.map(|e| format!("{prefix}{e}")))
    }

    /// The format of this name.
    pub fn named(&self, name: &str) -> Result<Format, FormatError> {
        let found = self.formats().find(|f| f.name == name);
        found.ok_or_else(|| self.unknown(name))
    }

    /// The error of a name of no such format.
    fn unknown(&self, name: &str) -> FormatError {
        let (found, what) = (excerpt(name), self.what);
        let allowed = one_of(name, self.formats().map(|f| f.name));
        FormatError(format!(
            "{found:?} is no format of {what}; allowed: {allowed}"
        ))
    }

    /// The function of a format that was chosen, else of that of the extension of `path`.
    pub fn choose(&self, chosen: Option<Format>, path: &Path) -> Result<T, FormatError> {
        self.function(&self.format(chosen, path)?)
    }

    /// The format that was chosen, else that of the extension of `path`.
    pub fn format(&self, chosen: Option<Format>, path: &Path) -> Result<Format, FormatError> {
        let said = || of_name(path).filter(|f| (self.of)(f).is_some());
        chosen.or_else(said).ok_or_else(|| {
            let (what, allowed) = (self.what, self.extensions("."));
            FormatError(format!(
                "no format of {what} is known by this name; allowed: {allowed}, or --format"
            ))
        })
    }

    /// The text of a file, and the function of its format: chosen by the file's extension, else by
    /// its first lines. Text that nothing recognises is CSV.
    ///
    /// # Errors
    /// [`Error::Data`] if it cannot be read, or is of a format that does not do this.
    pub fn open(&self, path: &Path) -> Result<(String, T), Error> {
        let function = |format| self.function(&format).map_err(|e| Error::data(path, e));
        let by_name = of_file(path).filter(|f| f.recognises.is_none());
        let by_name = by_name.map(function).transpose()?;
        let text = as_text(path).map_err(|e| Error::data(path, e.message))?;
        let found = match by_name {
            Some(found) => found,
            None => function(of_text(&text).unwrap_or(super::CSV))?,
        };
        Ok((text, found))
    }

    /// The function of a format.
    pub fn function(&self, format: &Format) -> Result<T, FormatError> {
        (self.of)(format).ok_or_else(|| self.unknown(format.name))
    }
}

/// The format of the extension of a file, in capitals or not.
pub fn of_name(path: &Path) -> Option<Format> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    let mut all = all().into_iter();
    all.find(|f| f.extensions.contains(&extension.as_str()))
}

const HEAD: u64 = 4096;

/// The format of a file: what its first bytes say, else of a text what is in it, else its extension. `None` of text that nothing
/// recognises but CSV, which takes any, and of a file that is not there and has no extension of ours.
pub fn of_file(path: &Path) -> Option<Format> {
    let by_name = of_name(path);
    if !path.is_file() {
        return by_name;
    }
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    if read.is_err() {
        return by_name;
    }
    let begins = |f: &Format| f.table.begins.is_some_and(|begins| begins(&head));
    if let Some(format) = all().into_iter().find(begins) {
        return Some(format);
    }
    // Of a format that is known by its first bytes it is none.
    by_name.filter(|f| f.table.begins.is_none())
}

/// The format of a text.
pub fn of_text(text: &str) -> Option<Format> {
    let mut all = all().into_iter();
    all.rfind(|f| f.recognises.is_some_and(|is| is(text)))
}

/// The files of a format directly in a folder, sorted by name.
///
/// Names that start with a dot are left out: they are other programs' side files (`._gold.binary`
/// on a disk that has seen a Mac), not tables. A link that leads nowhere is in the list, and an
/// error when it is read.
pub fn files_in(dir: &Path, format: &Format) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(dir)? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.as_encoded_bytes());
        let hidden = name.is_some_and(|name| name.starts_with(b"."));
        if !hidden && of_name(&path) == Some(*format) && !path.is_dir() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
