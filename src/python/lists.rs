//! What there is to choose from: the registries, as dictionaries of names and what they are.

use crate::given;
use gonio::experiment;
use gonio::formats as files;
use gonio::metrics::Measure;
use gonio::{acquisition, instrument, parametrization, reconstruct, schedule};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Names and what they are, in the order of the list.
fn dictionary<'py, K: AsRef<str>, V: AsRef<str>>(
    py: Python<'py>,
    all: impl IntoIterator<Item = (K, V)>,
) -> PyResult<Bound<'py, PyDict>> {
    let names = PyDict::new(py);
    for (name, what) in all {
        names.set_item(name.as_ref(), what.as_ref())?;
    }
    Ok(names)
}

/// Functions that list the families of registries.
macro_rules! families {
    ($($(#[$doc:meta])* $name:ident: $all:path;)*) => {
        $(
            $(#[$doc])*
            #[pyfunction]
            pub fn $name(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
                // A material of Python in a config has a kind that no text of a config can use.
                let all = $all().into_iter().filter(|e| e.kind != given::KIND);
                dictionary(py, all.map(|e| (e.kind, e.summary)))
            }
        )*
    };
}

families! {
    /// Kinds of materials, with what they are.
    materials: experiment::materials;
    /// Names of parametrizations, with what they are.
    parametrizations: parametrization::all;
    /// Kinds of warps of an axis, with what they are.
    warps: parametrization::warps;
    /// Kinds of sample sets, with what they are.
    sample_sets: schedule::all;
    /// Kinds of planners, with what they are.
    planners: acquisition::all;
    /// Kinds of reconstructions, with what they are.
    reconstructions: reconstruct::all;
}

/// Names of instruments that come with the program, each with the text of its file (TOML).
#[pyfunction]
pub fn instruments(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    dictionary(py, instrument::presets().iter().map(|p| (p.name, p.text)))
}

/// Names of file formats, with what they are.
#[pyfunction]
pub fn formats(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    dictionary(py, files::all().iter().map(|f| (f.name, f.summary)))
}

/// Names of the measures: distributions of the pairs that errors are averaged over.
#[pyfunction]
pub fn measures() -> Vec<&'static str> {
    Measure::ALL.map(Measure::name).to_vec()
}
