//! Reconstructions: a BRDF of readings, and how uncertain it is.

use crate::arrays::{Sides, rows};
use crate::errors::refused;
use crate::keys::{named, read};
use crate::material::PyMaterial;
use crate::measurement::PyMeasurement;
use gonio::reconstruct::{Coverage, Replicated, Uncertain, all};
use gonio::validation::Reconstruction;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// A BRDF made of readings: a material that knows what it was made of.
#[pyclass(frozen, extends = PyMaterial, name = "Reconstruction", module = "gonio")]
pub struct PyReconstruction {
    made: Reconstruction,
}

type Types<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

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
    /// Standard uncertainties (k = 1) of the luminance at pairs, 1/sr: types A and B, each (n,); with `channels` of every channel,
    /// each (n, channels). They are those of its readings and, made by kriging, between them.
    #[pyo3(signature = (omega_i, omega_o, *, channels = false))]
    fn uncertainty<'py>(
        &self,
        py: Python<'py>,
        omega_i: &Bound<'py, PyAny>,
        omega_o: &Bound<'py, PyAny>,
        channels: bool,
    ) -> PyResult<Types<'py>> {
        let pairs = Sides::read(omega_i, omega_o)?.pairs()?.all()?;
        let known = py.detach(|| {
            self.replicated().map(|r| match channels {
                true => r.channels_at(&pairs),
                false => r.luminance_at(&pairs),
            })
        });
        let known = known.map_err(refused)?;
        let of = |u: fn(&Uncertain) -> f64| {
            let all: Vec<f64> = known.iter().map(u).collect();
            PyResult::Ok(match channels {
                true => rows(py, all, self.made.measurement.channels.count())?.into_any(),
                false => PyArray1::from_vec(py, all).into_any(),
            })
        };
        Ok((of(|u| u.type_a)?, of(|u| u.type_b)?))
    }

    /// How pairs lie to the readings, a name each: interpolated, extrapolated or unknown.
    fn coverage<'py>(
        &self,
        omega_i: &Bound<'py, PyAny>,
        omega_o: &Bound<'py, PyAny>,
    ) -> PyResult<Vec<&'static str>> {
        let py = omega_i.py();
        let pairs = Sides::read(omega_i, omega_o)?.pairs()?.all()?;
        let found = py.detach(|| self.made.cover().map(|c| c.coverages(&pairs)));
        let found = found.map_err(refused)?.into_iter();
        Ok(found.map(Coverage::name).collect())
    }

    /// The method, with the keys that are not at their defaults.
    #[getter]
    fn method(&self) -> String {
        self.made.method.label()
    }

    fn __repr__(slf: &Bound<'_, Self>) -> String {
        let readings = gonio::error::count(slf.get().made.measurement.readings(), "reading");
        format!(
            "<gonio.Reconstruction {} of {readings}>",
            slf.get().method()
        )
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
    measurement: &PyMeasurement,
    reconstruction: Option<&str>,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyReconstruction>> {
    let method = match reconstruction {
        Some(kind) => {
            let method = read("reconstruction", &all(), named(kind, keys)?)?;
            method.check().map_err(refused)?;
            Some(Arc::from(method))
        }
        None if keys.is_some_and(|keys| !keys.is_empty()) => {
            return Err(refused(
                "the readings choose the reconstruction; allowed: keys with the kind of one",
            ));
        }
        None => None,
    };
    let measurement = Arc::clone(&measurement.measurement);
    let made = py.detach(|| Reconstruction::new(measurement, method));
    let made = made.map_err(refused)?;
    let material = PyMaterial {
        brdf: Arc::clone(&made.brdf),
        keys: None,
        label: made.method.label(),
    };
    let of = PyClassInitializer::from(material).add_subclass(PyReconstruction { made });
    Py::new(py, of)
}
