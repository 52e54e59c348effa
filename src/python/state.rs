//! Objects as texts (JSON), for pickle: numbers to the bit.

use crate::errors::refused;
use gonio::schedule::Schedule;
use pyo3::prelude::*;
use pyo3::{BoundObject, PyTypeInfo};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What `__reduce__` returns: a function, and its arguments.
pub type Reduced<'py> = PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)>;

/// The function that makes an object of a class again, and what it takes.
pub fn reduced_to<'py, T: PyTypeInfo, A>(py: Python<'py>, arguments: A) -> Reduced<'py>
where
    A: IntoPyObject<'py>,
{
    let restore = py.get_type::<T>().getattr("_restored")?;
    let arguments = arguments.into_pyobject(py).map_err(Into::into)?;
    Ok((restore, arguments.into_bound().into_any()))
}

/// The same of an object that is one text.
pub fn reduced<'py, T: PyTypeInfo>(py: Python<'py>, state: &impl Serialize) -> Reduced<'py> {
    reduced_to::<T, _>(py, (text(state)?,))
}

/// A state as a text.
pub fn text(state: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(state).map_err(refused)
}

/// The state of a text.
pub fn restored<S: DeserializeOwned>(text: &str) -> PyResult<S> {
    let state = serde_json::from_str(text);
    let other = "this pickle is not of this version of gonio";
    state.map_err(|e| refused(format!("{other} ({e}); allowed: one that it made")))
}

/// Refuses a pickle whose lists do not fit its poses.
pub fn check(fits: bool, what: &str) -> PyResult<()> {
    match fits {
        true => Ok(()),
        false => Err(refused(format!(
            "this pickle is damaged: {what} do not fit the poses; allowed: one that gonio made"
        ))),
    }
}

/// Refuses numbers that are of none of the poses, in the lattice of a schedule or beside it.
pub fn check_numbers<'a>(
    schedule: &'a Schedule,
    beside: impl Iterator<Item = &'a u32>,
) -> PyResult<()> {
    let of_lattice = schedule.lattice.iter().flat_map(|l| &l.pose).flatten();
    let mut numbers = of_lattice.chain(beside);
    let fit = numbers.all(|&n| (n as usize) < schedule.poses.len());
    check(fit, "numbers")
}
