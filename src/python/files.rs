//! Files that are written: their formats, and what is refused.

use crate::errors::of_files;
use gonio::files::{destination, write_atomically};
use gonio::formats::{Format, Use};
use pyo3::prelude::*;
use std::fmt::Display;
use std::fs::File;
use std::io::{BufWriter, Error, Result};
use std::path::Path;

/// The error of a file that cannot be written.
pub fn unwritable(path: &Path, e: impl Display) -> PyErr {
    of_files(gonio::Error::output(path, e))
}

/// The error of a file that the file system refuses.
pub fn refused_by_system(path: &Path) -> impl Fn(Error) -> PyErr {
    move |e| unwritable(path, format_args!("cannot write this file: {e}"))
}

/// The format of this name, else that which the name of the file says, and the function that writes it.
pub fn writer<T>(wanted: &Use<T>, name: Option<&str>, path: &Path) -> PyResult<(Format, T)> {
    let named = name.map(|name| wanted.named(name)).transpose();
    let format = named.and_then(|named| wanted.format(named, path));
    let found = format.and_then(|format| Ok((format, wanted.function(&format)?)));
    found.map_err(|e| unwritable(path, e))
}

/// Refuses to replace a file unless `force`.
pub fn refuse_existing(path: &Path, force: bool) -> PyResult<()> {
    let there = destination(path).map_err(refused_by_system(path))?;
    if force || !there.exists() {
        return Ok(());
    }
    let message = "this file exists; allowed: another, or force=True to replace it";
    Err(unwritable(path, message))
}

/// Writes a file, whole or not at all, without the global lock.
pub fn write(
    py: Python<'_>,
    path: &Path,
    body: impl FnOnce(&mut BufWriter<File>) -> Result<()> + Send,
) -> PyResult<()> {
    let done = py.detach(|| write_atomically(path, body));
    done.map_err(refused_by_system(path))
}
