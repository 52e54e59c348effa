//! The library for Python: NumPy arrays in and out.
//!
//! A thin floor above the library: it turns arrays into directions, dictionaries into the keys of configs, and errors
//! into `ValueError` with the library's sentence. Whatever takes time runs without Python's global lock. Signatures
//! with types and units stand in `gonio/__init__.pyi`; a test compares them with the module.

mod advice;
mod arrays;
mod errors;
mod explore;
mod files;
mod given;
mod html;
mod instrument;
mod keys;
mod lists;
mod material;
mod measurement;
mod metrics;
mod moments;
mod parametrization;
mod planner;
mod reconstruction;
mod run;
mod schedule;
mod shapes;
mod state;
mod table;
mod words;

use pyo3::prelude::*;

#[pymodule]
mod _gonio {
    /// The version of the library.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name of it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    #[pymodule_export]
    use super::advice::advise;
    #[pymodule_export]
    use super::arrays::{angles, direction};
    #[pymodule_export]
    use super::explore::{PyPage, explore};
    #[pymodule_export]
    use super::instrument::{PyInstrument, measure};
    #[pymodule_export]
    use super::lists::{
        formats, instruments, materials, measures, parametrizations, planners, reconstructions,
        sample_sets, warps,
    };
    #[pymodule_export]
    use super::material::PyMaterial;
    #[pymodule_export]
    use super::measurement::PyMeasurement;
    #[pymodule_export]
    use super::metrics::compare;
    #[pymodule_export]
    use super::moments::moment_errors;
    #[pymodule_export]
    use super::parametrization::PyParametrization;
    #[pymodule_export]
    use super::planner::{PySuggestion, suggest};
    #[pymodule_export]
    use super::reconstruction::{PyReconstruction, reconstruct};
    #[pymodule_export]
    use super::run::run;
    #[pymodule_export]
    use super::schedule::{PySchedule, plan};
}
