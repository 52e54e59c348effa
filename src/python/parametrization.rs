//! Coordinates of pairs of directions.

use crate::arrays::{
    Both, Matrix, Shaped, Sides, doubt_degrees, numbers, rows, shape, shaped, slice,
};
use crate::errors::{other_type, refused};
use crate::keys::{named, read, symmetry, table};
use crate::state::{Reduced, reduced, restored};
use gonio::error::listed;
use gonio::geometry::{Direction, Symmetry};
use gonio::parametrization::{Coords, Parametrization, Unit, all, by_name};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Coordinates of pairs of directions, folded by the symmetries of a material; `warp` bends axes.
///
/// `Parametrization("half-difference", warp={"theta_h": "square-root"})`; without `symmetry` the form for
/// materials that are isotropic, reciprocal and bilateral.
#[pyclass(frozen, name = "Parametrization", module = "gonio")]
#[derive(Serialize, Deserialize)]
pub struct PyParametrization {
    #[serde(with = "by_name")]
    pub form: Arc<dyn Parametrization>,
}

impl PyParametrization {
    /// A parametrization as it is given to functions: one, or its name.
    pub fn read(value: &Bound<'_, PyAny>, folded: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        if let Ok(known) = value.cast::<PyParametrization>() {
            if folded.is_some() {
                return Err(refused(
                    "symmetry is that of the parametrization that is given; allowed: its name instead",
                ));
            }
            let form = Arc::clone(&known.get().form);
            return Ok(Self { form });
        }
        let name: String = value.extract().map_err(|_| {
            let allowed = "a name, or a gonio.Parametrization";
            other_type("parametrization", value, allowed)
        })?;
        Self::named(&name, folded, None, "parametrization")
    }

    /// That of a name, which is an argument.
    fn named(
        name: &str,
        symmetry: Option<&Bound<'_, PyAny>>,
        warp: Option<&Bound<'_, PyDict>>,
        argument: &str,
    ) -> PyResult<Self> {
        let mut keys = named(name, None)?;
        let warp = table(warp)?;
        if !warp.is_empty() {
            keys.insert("warp".into(), warp.into());
        }
        let spec = read("parametrization", argument, &all(), keys)?;
        let symmetry = symmetry.map_or(Ok(Symmetry::FULL), self::symmetry)?;
        let form = spec.form(symmetry).map_err(refused)?;
        Ok(Self { form })
    }

    /// Coordinates in rows as wide as there are axes, and the shape before them.
    fn coordinates(&self, value: &Bound<'_, PyAny>) -> PyResult<(Vec<Coords>, Vec<usize>)> {
        let array = numbers(value, "coordinates")?;
        let axes = self.form.axes();
        let batch = match array.shape().split_last() {
            Some((width, [])) if *width == axes.len() => vec![1],
            Some((width, batch)) if *width == axes.len() => batch.to_vec(),
            _ => {
                let (n, symbols, shape) = (axes.len(), listed(self.axes()), shape(&array));
                return Err(refused(format!(
                    "coordinates have the shape {shape}; allowed: (…, {n}), {symbols}"
                )));
            }
        };
        let rows = slice(&array)?.chunks_exact(axes.len());
        for (i, axis) in axes.iter().enumerate() {
            if axis.unit == Unit::Radian {
                let name = format!("coordinates, {}", axis.symbol);
                doubt_degrees(value.py(), &name, rows.clone().map(|row| &row[i]))?;
            }
        }
        let coords = rows.map(|row| {
            let mut coords = [0.0; 4];
            coords[..row.len()].copy_from_slice(row);
            coords
        });
        Ok((coords.collect(), batch))
    }
}

#[pymethods]
impl PyParametrization {
    #[new]
    #[pyo3(signature = (name, *, symmetry = None, warp = None))]
    fn new(
        name: &str,
        symmetry: Option<&Bound<'_, PyAny>>,
        warp: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        Self::named(name, symmetry, warp, "name")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduced::<Self>(py, self)
    }

    #[classmethod]
    fn _restored(_class: &Bound<'_, PyType>, state: &str) -> PyResult<Self> {
        restored(state)
    }

    /// Coordinates of pairs above the horizon, (…, axes), where the shapes of directions broadcast; a warning tells of pairs below it.
    fn forward<'py>(
        &self,
        omega_i: &Bound<'py, PyAny>,
        omega_o: &Bound<'py, PyAny>,
    ) -> Shaped<'py> {
        let py = omega_i.py();
        let n = self.form.axes().len();
        let sides = Sides::read(omega_i, omega_o)?;
        let values = sides.pairs()?.map(py, n, |pairs, out| {
            let mut all = vec![[0.0; 4]; pairs.len()];
            self.form.forward_batch(pairs, &mut all);
            for (row, coords) in out.chunks_exact_mut(n).zip(all) {
                row.copy_from_slice(&coords[..n]);
            }
        })?;
        shaped(py, values, &sides.shape, Some(n))
    }

    /// Light and sensor directions at coordinates, two arrays (…, 3); NaN where there is no pair above the horizon.
    fn inverse<'py>(&self, coordinates: &Bound<'py, PyAny>) -> PyResult<Both<'py>> {
        let py = coordinates.py();
        let (coords, batch) = self.coordinates(coordinates)?;
        let pairs = py.detach(|| {
            let all = coords.par_iter().map(|c| self.form.inverse(c));
            all.collect::<Vec<_>>()
        });
        let side = |of: fn(&gonio::geometry::DirectionPair) -> Direction| {
            let vector = |pair: &Option<_>| {
                let found = pair.as_ref().map(|p| of(p).vector().to_array());
                found.unwrap_or([f64::NAN; 3])
            };
            let values = pairs.iter().flat_map(vector).collect();
            shaped(py, values, &batch, Some(3))
        };
        Ok((side(|p| p.omega_i)?, side(|p| p.omega_o)?))
    }

    /// d omega_i d omega_o = J d(coordinates of the form with 4 axes), steradians², (…); NaN where there is no pair.
    fn jacobian<'py>(&self, coordinates: &Bound<'py, PyAny>) -> Shaped<'py> {
        let py = coordinates.py();
        let (coords, batch) = self.coordinates(coordinates)?;
        let values = py.detach(|| {
            let at = |c: &Coords| match self.form.inverse(c) {
                Some(_) => self.form.jacobian(c),
                None => f64::NAN,
            };
            coords.par_iter().map(at).collect::<Vec<_>>()
        });
        shaped(py, values, &batch, None)
    }

    /// The representative, inside the ranges of the axes, of the configuration at coordinates, (…, axes); NaN if there is none.
    fn canonical<'py>(&self, coordinates: &Bound<'py, PyAny>) -> Shaped<'py> {
        let py = coordinates.py();
        let (coords, batch) = self.coordinates(coordinates)?;
        let n = self.form.axes().len();
        let at = |c: &Coords| self.form.canonical(c).unwrap_or([f64::NAN; 4]);
        let rows = coords.iter().flat_map(|c| at(c).into_iter().take(n));
        let values = py.detach(|| rows.collect());
        shaped(py, values, &batch, Some(n))
    }

    /// Name in configs.
    #[getter]
    fn name(&self) -> &'static str {
        self.form.name()
    }

    /// Symbols of the axes.
    #[getter]
    fn axes(&self) -> Vec<&'static str> {
        self.form.axes().iter().map(|a| a.symbol).collect()
    }

    /// Smallest and largest value of each axis, (axes, 2): radians, or no unit.
    #[getter]
    fn ranges<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        let ranges = self.form.axes().iter().flat_map(|a| a.range);
        rows(py, ranges.collect(), 2)
    }

    /// The warps, `none`, or e.g. `theta_h:square-root`.
    #[getter]
    fn warp(&self) -> String {
        self.form.warp_name()
    }

    /// Names of the symmetries that fold the domain.
    #[getter]
    fn symmetry(&self) -> Vec<&'static str> {
        self.form.symmetry().names()
    }

    fn __repr__(&self) -> String {
        let axes = self.axes().join(", ");
        format!("<gonio.Parametrization {} ({axes})>", self.form.name())
    }
}
