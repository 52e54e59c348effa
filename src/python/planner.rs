//! Planners: which poses to read next.

use crate::errors::{goes_on, refused};
use crate::instrument::{PyInstrument, check};
use crate::keys::{self, named, read, symmetry};
use crate::measurement::PyMeasurement;
use crate::schedule::PySchedule;
use crate::state::{Reduced, reduced_to, restored, text};
use gonio::acquisition::{self, Task};
use gonio::geometry::Symmetry;
use gonio::metrics::Expected;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::sync::{Arc, Mutex, PoisonError};

/// What a planner answers: the next poses, or that the readings are enough.
#[pyclass(frozen, name = "Suggestion", module = "gonio")]
pub struct PySuggestion {
    /// The next poses, the most telling first; none if the readings are enough.
    #[pyo3(get)]
    schedule: Py<PySchedule>,
    /// True if the readings so far have reached the target.
    #[pyo3(get)]
    enough: bool,
    now: Option<(Expected, usize)>,
    then: Option<(Expected, usize)>,
}

/// Expected errors, and what those of nine of ten materials are below.
fn errors_of<'py>(
    py: Python<'py>,
    known: Option<(Expected, usize)>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let Some((expected, readings)) = known else {
        return Ok(None);
    };
    let all = PyDict::new(py);
    for (quantity, get) in Expected::QUANTITIES {
        let bound = get(&expected.bound(readings)).unwrap_or(f64::NAN);
        all.set_item(quantity.name, get(&expected).unwrap_or(f64::NAN))?;
        all.set_item(format!("{}_bound", quantity.name), bound)?;
    }
    Ok(Some(all))
}

#[pymethods]
impl PySuggestion {
    /// Errors (cosine) expected with the readings so far, each with what nine of ten materials are below; None if not known.
    #[getter]
    fn now<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        errors_of(py, self.now)
    }

    /// The same with readings at the next poses too.
    #[getter]
    fn then<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        errors_of(py, self.then)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let known = text(&(self.now, self.then))?;
        reduced_to::<Self, _>(py, (&self.schedule, self.enough, known))
    }

    #[classmethod]
    fn _restored(
        _class: &Bound<'_, PyType>,
        schedule: Py<PySchedule>,
        enough: bool,
        known: &str,
    ) -> PyResult<Self> {
        let (now, then) = restored(known)?;
        Ok(Self {
            schedule,
            enough,
            now,
            then,
        })
    }

    fn __repr__(&self) -> String {
        if self.enough {
            return "<gonio.Suggestion enough>".into();
        }
        let poses = self.schedule.get().schedule.poses.len();
        format!("<gonio.Suggestion {}>", gonio::error::count(poses, "pose"))
    }
}

/// The poses that tell most of a material, given its readings so far: the loop of a laboratory.
///
/// `planners()` lists the kinds; the other keys are those of a config, e.g. `target={"nrmse": 0.05}`. With an instrument no pose
/// is out of its reach. Poses of `so_far` without a reading count as asked for.
#[pyfunction]
#[pyo3(signature = (batch, so_far = None, planner = "adaptive", *, symmetry = None, instrument = None, seed = 1, **keys))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn suggest(
    py: Python<'_>,
    #[pyo3(from_py_with = keys::batch)] batch: usize,
    so_far: Option<&PyMeasurement>,
    planner: &str,
    symmetry: Option<&Bound<'_, PyAny>>,
    instrument: Option<&PyInstrument>,
    #[pyo3(from_py_with = keys::seed)] seed: u64,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<PySuggestion> {
    let named = named(planner, keys)?;
    let planner = read("planner", "planner", &acquisition::all(), named)?;
    planner.check(&[]).map_err(refused)?;
    let given = symmetry.map(self::symmetry).transpose()?;
    let held = so_far.map(|m| m.measurement.schedule.parametrization.symmetry());
    let symmetry = match (given, held) {
        (Some(given), Some(held)) if given != held => {
            let message = "symmetry is that of the readings so far; allowed: to leave it out";
            return Err(refused(message));
        }
        (given, held) => held.or(given).unwrap_or(Symmetry::FULL),
    };
    if let Some(planned) = instrument.and_then(|i| i.planned.as_ref()) {
        check(planned, symmetry, "the material")?;
    }
    let bench = instrument.map_or(Ok(None), |i| i.bench(seed))?;
    let stopped = Mutex::new(None);
    let batch = py.detach(|| {
        let so_far = so_far.map(|m| &*m.measurement);
        let task = Task {
            machine: bench.as_ref().map(|bench| bench.machine()),
            go_on: &|| goes_on(&mut stopped.lock().unwrap_or_else(PoisonError::into_inner)),
            ..Task::after(so_far, batch, symmetry, seed)
        };
        task.ask(&*planner, so_far)
    });
    if let Some(e) = stopped.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(e);
    }
    let batch = batch.map_err(refused)?;
    let all = batch.readings + batch.schedule.poses.len();
    Ok(PySuggestion {
        enough: batch.is_enough,
        now: batch.forecast.as_ref().map(|f| (f.now, batch.readings)),
        then: batch.forecast.map(|f| (f.then, all)),
        schedule: Py::new(py, PySchedule::from(Arc::new(batch.schedule)))?,
    })
}
