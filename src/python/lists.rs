//! What there is to choose from: the registries, as dictionaries of names and what they are.

use crate::given;
use gonio::experiment;
use gonio::formats as files;
use gonio::metrics::Measure;
use gonio::{acquisition, instrument, parametrization, reconstruct, schedule};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

/// Functions that list the families of registries.
macro_rules! families {
    ($($(#[$doc:meta])* $name:ident: $all:path;)*) => {
        $(
            $(#[$doc])*
            #[pyfunction]
            pub fn $name(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
                // A material of Python in a config has a kind that no text of a config can use.
                let all = $all().into_iter().filter(|e| e.kind != given::KIND);
                all.map(|e| (e.kind, e.summary)).into_py_dict(py)
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
    let presets = instrument::presets().into_iter();
    presets.map(|p| (p.name, p.text)).into_py_dict(py)
}

/// Names of file formats, with what they are.
#[pyfunction]
pub fn formats(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = files::all().into_iter();
    all.map(|f| (f.name, f.summary)).into_py_dict(py)
}

/// Names of the measures: distributions of the pairs that errors are averaged over.
#[pyfunction]
pub fn measures() -> Vec<&'static str> {
    Measure::ALL.map(Measure::name).to_vec()
}
