//! Tables as dictionaries of columns, ready for pandas and polars.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value};

/// Columns of rows: arrays of int, float (NaN where there is no value) or bool, lists of text (None where there is none).
pub fn columns<'py>(py: Python<'py>, rows: &[Map<String, Value>]) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyDict::new(py);
    for name in rows.first().into_iter().flat_map(Map::keys) {
        let cells = rows.iter().map(|row| row.get(name).unwrap_or(&Value::Null));
        columns.set_item(name, column(py, &cells.collect::<Vec<_>>())?)?;
    }
    Ok(columns)
}

/// One column, of the type that all its values have.
fn column<'py>(py: Python<'py>, cells: &[&Value]) -> PyResult<Bound<'py, PyAny>> {
    let flags: Option<Vec<bool>> = cells.iter().map(|v| v.as_bool()).collect();
    if let Some(flags) = flags {
        return Ok(PyArray1::from_vec(py, flags).into_any());
    }
    let whole: Option<Vec<i64>> = cells.iter().map(|v| v.as_i64()).collect();
    if let Some(whole) = whole {
        return Ok(PyArray1::from_vec(py, whole).into_any());
    }
    if cells.iter().all(|v| v.is_number() || v.is_null()) {
        let values = cells.iter().map(|v| v.as_f64().unwrap_or(f64::NAN));
        return Ok(PyArray1::from_iter(py, values).into_any());
    }
    let text = |v: &&Value| match v {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    };
    cells.iter().map(text).collect::<Vec<_>>().into_pyobject(py)
}

/// Python's objects of a JSON text.
pub fn of_json<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
