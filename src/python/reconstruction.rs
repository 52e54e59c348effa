//! Reconstructions: a BRDF of readings, and how uncertain it is.

use crate::arrays::{Both, Shaped, Sides, shaped};
use crate::errors::refused;
use crate::keys::{named, read};
use crate::material::{Origin, PyMaterial};
use crate::measurement::PyMeasurement;
use crate::state::{Reduced, reduced_to};
use gonio::reconstruct::{Coverage, Reconstruct, Replicated, Uncertain, all};
use gonio::validation::Reconstruction;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::sync::Arc;

/// A BRDF made of readings: a material that knows what it was made of.
#[pyclass(frozen, extends = PyMaterial, name = "Reconstruction", module = "gonio")]
pub struct PyReconstruction {
    made: Reconstruction,
    measurement: Py<PyMeasurement>,
}

impl PyReconstruction {
    fn replicated(&self) -> Result<&Replicated, String> {
        let made = self.made.replicated().map_err(|e| e.to_string())?;
        made.ok_or_else(|| {
            "most readings have no uncertainty; allowed: readings with type_a or type_b, or kriging"
                .into()
        })
    }
}

#[pymethods]
impl PyReconstruction {
    /// Standard uncertainties (k = 1) of the luminance at pairs, 1/sr: types A and B, each in the shape that the directions broadcast to;
    /// with `channels` of every channel, each (…, channels). They are those of its readings and, made by kriging, between them.
    #[pyo3(signature = (omega_i, omega_o, *, channels = false))]
    fn uncertainty<'py>(
        &self,
        py: Python<'py>,
        omega_i: &Bound<'py, PyAny>,
        omega_o: &Bound<'py, PyAny>,
        channels: bool,
    ) -> PyResult<Both<'py>> {
        let sides = Sides::read(omega_i, omega_o)?;
        let pairs = sides.pairs()?.above(py)?;
        let known = py.detach(|| {
            self.replicated().map(|r| match channels {
                true => r.channels_at(&pairs),
                false => r.luminance_at(&pairs),
            })
        });
        let known = known.map_err(refused)?;
        let of = |u: fn(&Uncertain) -> f64| -> Shaped<'py> {
            let width = channels.then(|| self.made.measurement.channels.count());
            shaped(py, known.iter().map(u).collect(), &sides.shape, width)
        };
        Ok((of(|u| u.type_a)?, of(|u| u.type_b)?))
    }

    /// How pairs lie to the readings, a name each: interpolated, extrapolated or unknown; lists in lists where directions broadcast to
    /// several axes.
    fn coverage<'py>(
        &self,
        omega_i: &Bound<'py, PyAny>,
        omega_o: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = omega_i.py();
        let sides = Sides::read(omega_i, omega_o)?;
        let pairs = sides.pairs()?.above(py)?;
        let found = py.detach(|| self.made.cover().map(|c| c.coverages(&pairs)));
        let found = found.map_err(refused)?.into_iter();
        let names: Vec<&str> = found.map(Coverage::name).collect();
        let names = py.import("numpy")?.call_method1("array", (names,))?;
        let names = names.call_method1("reshape", (sides.shape.clone(),))?;
        names.call_method0("tolist")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let keys = self.made.method.resolved().to_string();
        let measurement = self.measurement.clone_ref(py);
        reduced_to::<Self, _>(py, (measurement, keys))
    }

    /// The BRDF is made again, of the same readings.
    #[classmethod]
    fn _restored(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        measurement: Py<PyMeasurement>,
        keys: &str,
    ) -> PyResult<Py<Self>> {
        let keys = toml::from_str(keys).map_err(refused)?;
        let method = read("reconstruction", "reconstruction", &all(), keys)?;
        made(py, measurement, Some(Arc::from(method)))
    }

    /// The method, with the keys that are not at their defaults.
    #[getter]
    fn method(&self) -> String {
        self.made.method.label()
    }

    fn __repr__(slf: &Bound<'_, Self>) -> String {
        let this = slf.get();
        let readings = gonio::error::count(this.made.measurement.readings(), "reading");
        format!("<gonio.Reconstruction {} of {readings}>", this.method())
    }
}

/// The BRDF of a measurement. Without a kind it is the method that the readings choose: the one that predicts best what it was not
/// given, or kriging if that is within a standard error.
///
/// `reconstructions()` lists the kinds; the other keys are those of a config, e.g. `noise=True`.
#[pyfunction]
#[pyo3(signature = (measurement, reconstruction = None, **keys))]
pub fn reconstruct(
    py: Python<'_>,
    measurement: Py<PyMeasurement>,
    reconstruction: Option<&str>,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyReconstruction>> {
    let method = match reconstruction {
        Some(kind) => {
            let named = named(kind, keys)?;
            let method = read("reconstruction", "reconstruction", &all(), named)?;
            method.check().map_err(refused)?;
            Some(Arc::from(method))
        }
        None if keys.is_some_and(|keys| !keys.is_empty()) => {
            let why = "the readings choose the reconstruction";
            return Err(refused(format!(
                "{why}; allowed: keys with the kind of one"
            )));
        }
        None => None,
    };
    made(py, measurement, method)
}

/// The BRDF of a measurement by a method, or by that which the readings choose.
fn made(
    py: Python<'_>,
    measurement: Py<PyMeasurement>,
    method: Option<Arc<dyn Reconstruct>>,
) -> PyResult<Py<PyReconstruction>> {
    let readings = Arc::clone(&measurement.get().measurement);
    let made = py.detach(|| Reconstruction::new(readings, method));
    let made = made.map_err(refused)?;
    let material = PyMaterial {
        brdf: Arc::clone(&made.brdf),
        origin: Origin::Readings,
        tables: std::sync::OnceLock::new(),
        label: made.method.label(),
    };
    let made = PyReconstruction { made, measurement };
    Py::new(py, PyClassInitializer::from(material).add_subclass(made))
}
