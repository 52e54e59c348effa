//! Schedules: which poses are visited.

use crate::arrays::{Matrix, Sides, rows, vectors};
use crate::errors::{of_files, other_type, refused};
use crate::files::{self, refuse_existing, writer};
use crate::html::{self, HEAD};
use crate::keys::{self, named, read, symmetry};
use crate::parametrization::PyParametrization;
use crate::state::{Reduced, check_numbers, reduced, restored};
use gonio::Error;
use gonio::formats::{READ_SCHEDULE, WRITE_SCHEDULE};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::axis_names;
use gonio::schedule::{self, Assume, Schedule, Sequence, Unreachable};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyType};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Poses to be measured: pairs of directions, with their coordinates.
///
/// `Schedule(omega_i, omega_o)` has poses of your own, all pairs in C order where their shapes broadcast to several axes, `plan(…)` those of a sample set, `Schedule.open(path)` those of
/// a file. A file may list some poses of a lattice, in an order of its own: the arrays have every pose of the lattice as it is
/// numbered, `order` says which of them are listed, and only these are measured.
#[pyclass(frozen, name = "Schedule", module = "gonio")]
pub struct PySchedule {
    pub schedule: Arc<Schedule>,
    /// The poses in the order of a file's rows; `None`: all as they are numbered.
    pub order: Option<Vec<u32>>,
    /// Poses that the file says cannot be taken.
    pub lost: Vec<(u32, Unreachable)>,
}

impl From<Arc<Schedule>> for PySchedule {
    fn from(schedule: Arc<Schedule>) -> Self {
        Self {
            schedule,
            order: None,
            lost: Vec::new(),
        }
    }
}

impl PySchedule {
    /// These poses, by number, which are on no lattice then, unless they are all as they are numbered.
    pub fn of_poses(&self, poses: &[u32]) -> Self {
        let all = &self.schedule;
        let are_all = poses.len() == all.poses.len() && poses.is_sorted();
        let schedule = Schedule {
            parametrization: Arc::clone(&all.parametrization),
            sample_set: all.sample_set.clone(),
            poses: poses.iter().map(|&i| all.poses[i as usize]).collect(),
            lattice: all.lattice.clone().filter(|_| are_all),
            unphysical_share: all.unphysical_share,
            assumes: all.assumes.clone(),
        };
        let numbers: HashMap<u32, u32> = poses.iter().copied().zip(0..).collect();
        let order = self.order.as_ref().map(|order| {
            let listed = order.iter().filter_map(|pose| numbers.get(pose));
            listed.copied().collect()
        });
        let lost = self.lost.iter();
        let lost = lost.filter_map(|(pose, why)| Some((*numbers.get(pose)?, *why)));
        Self {
            schedule: Arc::new(schedule),
            order,
            lost: lost.collect(),
        }
    }

    fn pairs(&self) -> impl Iterator<Item = &DirectionPair> + Clone {
        self.schedule.poses.iter().map(|pose| &pose.pair)
    }
}

#[pymethods]
impl PySchedule {
    #[new]
    #[pyo3(signature = (omega_i, omega_o, *, parametrization = None, symmetry = None))]
    fn new(
        omega_i: &Bound<'_, PyAny>,
        omega_o: &Bound<'_, PyAny>,
        parametrization: Option<&Bound<'_, PyAny>>,
        symmetry: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let pairs = Sides::read(omega_i, omega_o)?.pairs()?.visible()?;
        let form = form(omega_i.py(), parametrization, symmetry)?.form;
        Ok(Arc::new(Schedule::of_pairs(form, pairs)).into())
    }

    /// The schedule of a file: one that gonio wrote, or a table with the angles of light and sensor.
    #[classmethod]
    #[pyo3(signature = (path, *, parametrization = None, symmetry = None))]
    fn open(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        path: PathBuf,
        parametrization: Option<String>,
        symmetry: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let assume = Assume {
            parametrization,
            symmetry: symmetry.map(self::symmetry).transpose()?,
            otherwise: Symmetry::FULL,
            axes: axis_names(),
            ..Assume::default()
        };
        let file = py.detach(|| {
            let (text, read) = READ_SCHEDULE.open(&path)?;
            read(&text, &path.display().to_string(), &assume).map_err(Error::from)
        });
        let file = file.map_err(of_files)?;
        Ok(Self {
            schedule: Arc::new(file.schedule),
            order: Some(file.order),
            lost: file.unreachable,
        })
    }

    /// Writes the poses in their order, in the format that the name says, or `format`: `formats()` lists them.
    #[pyo3(signature = (path, *, format = None, force = false))]
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        force: bool,
    ) -> PyResult<()> {
        let (_, write) = writer(&WRITE_SCHEDULE, format, &path)?;
        refuse_existing(&path, force)?;
        let sequence = match &self.order {
            Some(order) => Sequence::Order(order),
            None => Sequence::Generated,
        };
        files::write(py, &path, |out| write(&self.schedule, sequence, out))
    }

    fn __len__(&self) -> usize {
        self.schedule.poses.len()
    }

    /// The poses of a number, a slice, a mask or an array of numbers, each at most once.
    fn __getitem__(&self, key: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(self.of_poses(&chosen(key, self.schedule.poses.len())?))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduced::<Self>(py, &(&self.schedule, &self.order, &self.lost))
    }

    #[classmethod]
    fn _restored(_class: &Bound<'_, PyType>, state: &str) -> PyResult<Self> {
        type State = (Arc<Schedule>, Option<Vec<u32>>, Vec<(u32, Unreachable)>);
        let (schedule, order, lost): State = restored(state)?;
        let listed = order.iter().flatten();
        check_numbers(&schedule, listed.chain(lost.iter().map(|(pose, _)| pose)))?;
        Ok(Self {
            schedule,
            order,
            lost,
        })
    }

    /// The first poses as a table, for notebooks: angles in degrees.
    fn _repr_html_(&self) -> String {
        let names = ["pose"].into_iter().chain(html::ANGLES).map(String::from);
        let row = |(i, pair): (usize, &DirectionPair)| {
            let number = std::iter::once(i.to_string());
            number.chain(html::degrees(pair)).collect()
        };
        let rows: Vec<_> = self.pairs().enumerate().take(HEAD).map(row).collect();
        let (names, count) = (names.collect::<Vec<_>>(), self.schedule.poses.len());
        html::table(&self.__repr__(), &names, &rows, count)
    }

    /// Directions towards the light, (n, 3).
    #[getter]
    fn omega_i<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        vectors(py, self.pairs().map(|p| p.omega_i))
    }

    /// Directions towards the sensor, (n, 3).
    #[getter]
    fn omega_o<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        vectors(py, self.pairs().map(|p| p.omega_o))
    }

    /// Coordinates of the poses, (n, axes).
    #[getter]
    fn coordinates<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        let n = self.schedule.parametrization.axes().len();
        let poses = self.schedule.poses.iter();
        let coords = poses.flat_map(|p| p.coords.into_iter().take(n));
        rows(py, coords.collect(), n)
    }

    /// Numbers of the poses that a file lists, in the order of its rows, (k,) ints; None without a file: all.
    ///
    /// `omega_i[order]` are the directions in the order of the rows.
    #[getter]
    fn order<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<i64>>> {
        let order = self.order.as_ref()?;
        Some(PyArray1::from_iter(py, order.iter().map(|&i| i64::from(i))))
    }

    /// The coordinates that the poses are in.
    #[getter]
    fn parametrization(&self) -> PyParametrization {
        PyParametrization {
            form: Arc::clone(&self.schedule.parametrization),
        }
    }

    /// Name of the sample set or planner, `file` of poses by others.
    #[getter]
    fn sample_set(&self) -> &str {
        &self.schedule.sample_set
    }

    fn __repr__(&self) -> String {
        let form = self.schedule.parametrization.name();
        let poses = gonio::error::count(self.schedule.poses.len(), "pose");
        let set = &self.schedule.sample_set;
        format!("<gonio.Schedule {set} ({poses}) in {form}>")
    }
}

/// The poses of `count` that a key chooses: a number, a slice, a mask, or an array of numbers, as NumPy takes them.
pub fn chosen(key: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<u32>> {
    let numpy = key.py().import("numpy")?;
    let all = numpy.call_method1("arange", (count,))?;
    let chosen = numpy.call_method1("atleast_1d", (all.get_item(key)?,))?;
    let chosen: Vec<u32> = chosen.call_method0("tolist")?.extract().map_err(|_| {
        let allowed = "a number, a slice, a mask or a list of numbers, of one axis";
        other_type("key", key, allowed)
    })?;
    let mut seen = vec![false; count];
    for &pose in &chosen {
        if std::mem::replace(&mut seen[pose as usize], true) {
            let message = format!("key takes pose {pose} twice; allowed: each pose once");
            return Err(refused(message));
        }
    }
    Ok(chosen)
}

/// The parametrization that is given, or half-difference.
pub fn form(
    py: Python<'_>,
    parametrization: Option<&Bound<'_, PyAny>>,
    symmetry: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyParametrization> {
    let usual = PyString::new(py, "half-difference");
    PyParametrization::read(parametrization.unwrap_or(&usual), symmetry)
}

/// The poses of a sample set: at most `budget`, uniform in the coordinates of a parametrization.
///
/// `sample_sets()` lists the kinds; the other keys are those of a config, e.g. `ratio`.
#[pyfunction]
#[pyo3(signature = (sample_set, budget, parametrization = None, *, symmetry = None, seed = 1, **keys))]
pub fn plan(
    py: Python<'_>,
    sample_set: &str,
    #[pyo3(from_py_with = keys::budget)] budget: usize,
    parametrization: Option<&Bound<'_, PyAny>>,
    symmetry: Option<&Bound<'_, PyAny>>,
    #[pyo3(from_py_with = keys::seed)] seed: u64,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<PySchedule> {
    let named = named(sample_set, keys)?;
    let set = read("sample set", "sample_set", &schedule::all(), named)?;
    let form = form(py, parametrization, symmetry)?.form;
    set.check(form.axes()).map_err(refused)?;
    let schedule = py.detach(|| set.plan(&form, budget, seed));
    Ok(Arc::new(schedule.map_err(refused)?).into())
}
