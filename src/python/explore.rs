//! Pages that answer a hand.

use crate::errors::{of_files, refused};
use crate::files::{refuse_existing, write};
use crate::given::detached;
use crate::material::{Origin, PyMaterial};
use crate::measurement::PyMeasurement;
use gonio::report::explore::{Exploration, ShownMaterial, ShownReadings};
use pyo3::prelude::*;
use std::io::Write;
use std::path::PathBuf;

/// A page that shows materials and readings, and answers a hand: one HTML file that asks for no other.
#[pyclass(name = "Page", module = "gonio", frozen)]
pub struct PyPage {
    /// The page.
    #[pyo3(get)]
    html: String,
}

#[pymethods]
impl PyPage {
    /// Writes the page to a file.
    #[pyo3(signature = (path, *, force = false))]
    fn write(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        refuse_existing(&path, force)?;
        write(py, &path, |out| out.write_all(self.html.as_bytes()))
    }

    /// The page in a frame of a notebook.
    fn _repr_html_(&self) -> String {
        let text = self.html.replace('&', "&amp;").replace('"', "&quot;");
        let text = text.replace('<', "&lt;").replace('>', "&gt;");
        // Readers of XML take line ends in attributes for spaces.
        let text = text.replace('\n', "&#10;");
        format!(
            "<iframe title=\"gonio\" sandbox=\"allow-scripts allow-downloads\" width=\"100%\" height=\"900\" srcdoc=\"{text}\"></iframe>"
        )
    }

    fn __repr__(&self) -> String {
        format!("Page({} bytes)", self.html.len())
    }
}

/// A page of materials and readings, for notebooks or a file.
///
/// Where there are readings and less than two materials, the next is reconstructed from them.
#[pyfunction]
#[pyo3(signature = (a = None, b = None, readings = None))]
pub fn explore(
    py: Python<'_>,
    a: Option<&PyMaterial>,
    b: Option<&PyMaterial>,
    readings: Option<&PyMeasurement>,
) -> PyResult<PyPage> {
    if a.is_none() && b.is_some() {
        return Err(refused("b: there is no a; allowed: b beside a"));
    }
    let shown = |m: &&PyMaterial| {
        let mut shown = ShownMaterial::new(&m.label, &m.label, m.brdf.clone());
        shown.is_slow |= matches!(m.origin, Origin::Readings | Origin::Function(_));
        shown
    };
    let read = |r: &PyMeasurement| ShownReadings {
        name: "readings".into(),
        argument: "readings.csv".into(),
        measurement: r.measurement.clone(),
    };
    let page = Exploration {
        command: "gonio.explore(…)".into(),
        materials: [a, b].iter().flatten().map(shown).collect(),
        readings: readings.map(read),
        ..Exploration::default()
    };
    let made = detached(py, || page.html());
    Ok(PyPage {
        html: made?.map_err(of_files)?,
    })
}
