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
    ($($(#[$doc:meta])* $function:ident: $all:path => $name:ident, $text:ident;)*) => {
        $(
            $(#[$doc])*
            #[pyfunction]
            pub fn $function(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
                let all = $all().into_iter().map(|e| (e.$name, e.$text));
                // A material of Python in a config has a kind that no text of a config can use.
                all.filter(|(name, _)| *name != given::KIND).into_py_dict(py)
            }
        )*
    };
}

families! {
    /// Kinds of materials, with what they are.
    materials: experiment::materials => kind, summary;
    /// Names of parametrizations, with what they are.
    parametrizations: parametrization::all => kind, summary;
    /// Kinds of warps of an axis, with what they are.
    warps: parametrization::warps => kind, summary;
    /// Kinds of sample sets, with what they are.
    sample_sets: schedule::all => kind, summary;
    /// Kinds of planners, with what they are.
    planners: acquisition::all => kind, summary;
    /// Kinds of reconstructions, with what they are.
    reconstructions: reconstruct::all => kind, summary;
    /// Names of instruments that come with the program, each with the text of its file (TOML).
    instruments: instrument::presets => name, text;
    /// Names of file formats, with what they are.
    formats: files::all => name, summary;
}

/// Names of the measures: distributions of the pairs that errors are averaged over.
#[pyfunction]
pub fn measures() -> Vec<&'static str> {
    Measure::ALL.map(Measure::name).to_vec()
}
