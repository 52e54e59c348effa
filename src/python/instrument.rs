//! Instruments, and measuring with them.

use crate::errors::{of_files, of_keys, other_type, refused, renamed, warn, within};
use crate::given::detached;
use crate::keys::{self, parsed, source, table};
use crate::material::PyMaterial;
use crate::measurement::PyMeasurement;
use crate::schedule::PySchedule;
use crate::state::{Reduced, reduced, restored};
use gonio::experiment::{IDEAL, PlannedInstrument, Use, load_instrument};
use gonio::geometry::Symmetry;
use gonio::instrument::{self, Bench, Ideal, Instrument, InstrumentSpec};
use gonio::measurement::About;
use gonio::schedule::{Itinerary, Visit};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::path::PathBuf;

/// A machine that measures; without `spec` the ideal one, whose reading is the BRDF itself.
///
/// `spec` is the name of a preset (`instruments()`), the path of an instrument file, or a dictionary of its keys;
/// `limits`, `apertures` and `noise` false leave that flaw out, `order` is the rule of its visits, `realisation` the
/// seed of what all its readings share.
#[pyclass(frozen, name = "Instrument", module = "gonio")]
pub struct PyInstrument {
    pub planned: Option<PlannedInstrument>,
}

impl PyInstrument {
    /// The machine for a seed; `None`: the ideal one.
    pub fn bench(&self, seed: u64) -> PyResult<Option<Bench>> {
        let bench = |p: &PlannedInstrument| p.bench(p.use_of.parts(), seed).map_err(refused);
        self.planned.as_ref().map(bench).transpose()
    }
}

#[pymethods]
impl PyInstrument {
    #[new]
    #[pyo3(signature = (spec = None, **keys))]
    fn new(spec: Option<&Bound<'_, PyAny>>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let use_of: Use = parsed("instrument", table(keys)?)?;
        let spec = match spec {
            None if keys.is_some_and(|keys| !keys.is_empty()) => {
                return Err(refused(
                    "the ideal instrument has no keys; allowed: the name of a preset, a file or a dictionary before them",
                ));
            }
            None => return Ok(Self { planned: None }),
            Some(spec) => match spec.cast::<PyDict>() {
                Ok(keys) => {
                    let source = source("instrument", &table(Some(keys))?);
                    let table = source.table().map_err(of_keys)?;
                    let read = instrument::read_table(table);
                    let read = read.map_err(|e| of_keys(source.error(e)));
                    read.map_err(within("spec"))?
                }
                Err(_) => {
                    let allowed = "a name, a path or a dictionary";
                    let name = spec.extract::<PathBuf>();
                    let name = name.map_err(|_| other_type("spec", spec, allowed))?;
                    let name = name.to_string_lossy();
                    // The text of a file is no name of one.
                    if name.contains('\n') {
                        return Err(refused(format!(
                            "spec is a text of several lines; allowed: {allowed}, as tomllib.loads makes of a text"
                        )));
                    }
                    let read = load_instrument(&name).map_err(of_files);
                    read.map_err(renamed("instrument", "spec"))?
                }
            },
        };
        let planned = Some(PlannedInstrument::new(spec, use_of));
        Ok(Self { planned })
    }

    /// Its visits to the poses that it can take, in the order of time: a table of pose, block, positions of its axes in degrees, and seconds.
    fn visits<'py>(&self, py: Python<'py>, schedule: &PySchedule) -> PyResult<Bound<'py, PyDict>> {
        let (Some(planned), Some(bench)) = (&self.planned, self.bench(0)?) else {
            return Err(refused(
                "the ideal instrument has no axes and takes no time; allowed: a machine",
            ));
        };
        let folded = schedule.schedule.parametrization.symmetry();
        check(planned, folded, "the schedule")?;
        let itinerary = py.detach(|| itinerary(planned, &bench, schedule));
        let visits = &itinerary.visits;
        let all = PyDict::new(py);
        let floats = |of: &dyn Fn(&Visit) -> f64| PyArray1::from_iter(py, visits.iter().map(of));
        let whole = |of: fn(&Visit) -> u32| {
            PyArray1::from_iter(py, visits.iter().map(|v| i64::from(of(v))))
        };
        all.set_item("pose", whole(|v| v.pose))?;
        all.set_item("block", whole(|v| v.block))?;
        if itinerary.takes_pictures() {
            all.set_item("stop", whole(|v| v.stop))?;
        }
        for (i, axis) in itinerary.axes.iter().enumerate() {
            let positions = floats(&|v| v.positions[i].to_degrees());
            all.set_item(format!("{axis}_deg"), positions)?;
        }
        let times: [(&str, fn(&Visit) -> f64); 4] = [
            ("move_seconds", |v| v.move_seconds),
            ("exposure_seconds", |v| v.exposure_seconds),
            ("seconds", |v| v.seconds),
            ("at_seconds", |v| v.at_seconds),
        ];
        for (name, of) in times {
            all.set_item(name, floats(&of))?;
        }
        Ok(all)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let planned = self.planned.as_ref();
        reduced::<Self>(py, &planned.map(|p| (&p.spec, &p.use_of)))
    }

    #[classmethod]
    fn _restored(_class: &Bound<'_, PyType>, state: &str) -> PyResult<Self> {
        let planned: Option<(InstrumentSpec, Use)> = restored(state)?;
        let planned = planned.map(|(spec, use_of)| PlannedInstrument::new(spec, use_of));
        Ok(Self { planned })
    }

    /// Its name; `ideal` of the one without flaws.
    #[getter]
    fn name(&self) -> &str {
        self.planned.as_ref().map_or(IDEAL, |p| &p.name)
    }

    fn __repr__(&self) -> String {
        format!("<gonio.Instrument {}>", self.name())
    }
}

/// The visits to the poses of a schedule, in its order if it has one.
fn itinerary(planned: &PlannedInstrument, bench: &Bench, schedule: &PySchedule) -> Itinerary {
    match &schedule.order {
        Some(order) => bench.plan_given(&schedule.schedule, order),
        None => bench.plan(&schedule.schedule, planned.use_of.order),
    }
}

/// Refuses what is anisotropic on a machine that cannot turn the sample.
pub fn check(planned: &PlannedInstrument, symmetry: Symmetry, what: &str) -> PyResult<()> {
    let checked = planned.check_symmetry(symmetry, what, || "instrument".into());
    checked.map_err(of_keys)
}

/// What an instrument reads of a material at the poses of a schedule; without one, the ideal instrument.
///
/// Poses that it cannot take have the reason in `outcomes` and NaN for values. `seed` is that of the noise.
#[pyfunction]
#[pyo3(signature = (material, schedule, instrument = None, *, seed = 1))]
pub fn measure(
    py: Python<'_>,
    material: &PyMaterial,
    schedule: &PySchedule,
    instrument: Option<&PyInstrument>,
    #[pyo3(from_py_with = keys::seed)] seed: u64,
) -> PyResult<PyMeasurement> {
    let brdf = &*material.brdf;
    let poses = &schedule.schedule;
    let (folded, held) = (poses.parametrization.symmetry(), brdf.symmetry());
    if folded.and(held) != folded {
        let words = |symmetry: Symmetry| match symmetry.names().join(", ") {
            none if none.is_empty() => "without symmetries".into(),
            names => names,
        };
        let (folded, name, held) = (words(folded), &material.label, words(held));
        let sentence = format!("the schedule is for materials that are {folded}; {name} is {held}");
        warn(py, &sentence)?;
    }
    let planned = instrument.and_then(|i| i.planned.as_ref());
    let about = |planned: Option<&PlannedInstrument>| About {
        material: Some(material.label.clone()),
        instrument: Some(planned.map_or(IDEAL, |i| &i.name).into()),
        realisation: planned.map(|i| i.realisation(seed)),
        seed: planned.map(|_| seed),
        ..About::default()
    };
    let bench = instrument.map_or(Ok(None), |i| i.bench(seed))?;
    let (Some(planned), Some(bench)) = (planned, bench) else {
        let measurement = detached(py, || match &schedule.order {
            Some(order) => Ideal.measure(brdf, poses).of_poses(order, &schedule.lost),
            None => Ideal.measure(brdf, poses),
        })?;
        return Ok(PyMeasurement::new(measurement, about(None), None));
    };
    check(planned, folded, "the schedule")?;
    let (measurement, itinerary) = detached(py, || {
        let mut itinerary = itinerary(planned, &bench, schedule);
        // What the schedule left out keeps its reason.
        itinerary.unreachable.extend(&schedule.lost);
        let measurement = bench.session(&itinerary, seed).measure(brdf, poses);
        (measurement, itinerary)
    })?;
    let about = about(Some(planned));
    Ok(PyMeasurement::new(measurement, about, Some(itinerary)))
}
