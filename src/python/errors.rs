//! Errors and warnings raised in Python, and its interrupts.

use crate::words::{in_keywords, without_brackets};
use gonio::Error;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A `ValueError` with a sentence, in which options of the command are keywords.
pub fn refused(sentence: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(in_keywords(&sentence.to_string()))
}

/// A refusal of an argument of another type.
pub fn other_type(name: &str, value: &Bound<'_, PyAny>, allowed: &str) -> PyErr {
    refused(format!("{name} = {value}: allowed is {allowed}"))
}

/// An error about `key` of the library, which is an argument of another name, or about a part of it.
pub fn renamed(key: &str, argument: &str) -> impl Fn(PyErr) -> PyErr {
    move |e| {
        let sentence = Python::attach(|py| e.value(py).to_string());
        let rest = sentence.strip_prefix(key);
        match rest.filter(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')) {
            Some(rest) => refused(format!("{argument}{rest}")),
            None => e,
        }
    }
}

/// An error about the keys of a dictionary that is an argument.
pub fn within(argument: &str) -> impl Fn(PyErr) -> PyErr {
    move |e| Python::attach(|py| refused(format!("{argument}: {}", e.value(py))))
}

/// The sentence of an error about keys that have no line: without the place.
pub fn of_keys(e: Error) -> PyErr {
    match e {
        // An option of the command is an argument.
        Error::Config { ref place, .. } if place.starts_with("--") => of_files(e),
        Error::Config { message, .. } | Error::Infeasible { message, .. } => {
            refused(without_brackets(&message))
        }
        e => of_files(e),
    }
}

/// The sentence of an error about files, with its place, and with its reason.
pub fn of_files(e: Error) -> PyErr {
    match std::error::Error::source(&e) {
        Some(why) => refused(format!("{e}: {why}")),
        None => refused(e),
    }
}

/// Issues a sentence as a Python warning, in which options of the command are keywords.
pub fn warn(py: Python<'_>, sentence: &str) -> PyResult<()> {
    let sentence = in_keywords(sentence);
    py.import("warnings")?.call_method1("warn", (sentence,))?;
    Ok(())
}

/// False after an interrupt (Ctrl-C), which is kept to be raised.
pub fn goes_on(stopped: &mut Option<PyErr>) -> bool {
    let checked = Python::attach(|py| py.check_signals());
    *stopped = stopped.take().or(checked.err());
    stopped.is_none()
}
