//! Errors and warnings raised in Python, and its interrupts.

use gonio::Error;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A `ValueError` with a sentence.
pub fn refused(sentence: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(sentence.to_string())
}

/// A refusal of an argument of another type.
pub fn other_type(name: &str, value: &Bound<'_, PyAny>, allowed: &str) -> PyErr {
    refused(format!("{name} = {value}: allowed is {allowed}"))
}

/// The sentence of an error about keys that have no line: without the place.
pub fn of_keys(e: Error) -> PyErr {
    match e {
        Error::Config { message, .. } | Error::Infeasible { message, .. } => refused(message),
        e => of_files(e),
    }
}

/// The sentence of an error about files, with its place, and with its reason.
pub fn of_files(e: Error) -> PyErr {
    let reason = std::error::Error::source(&e).map_or(String::new(), |why| format!(": {why}"));
    refused(format!("{e}{reason}"))
}

/// Issues a sentence as a Python warning.
pub fn warn(py: Python<'_>, sentence: &str) -> PyResult<()> {
    py.import("warnings")?.call_method1("warn", (sentence,))?;
    Ok(())
}

/// False after an interrupt (Ctrl-C), which is kept to be raised.
pub fn goes_on(stopped: &mut Option<PyErr>) -> bool {
    let checked = Python::attach(|py| py.check_signals());
    *stopped = stopped.take().or(checked.err());
    stopped.is_none()
}
