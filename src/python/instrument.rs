//! Instruments, and measuring with them.

use crate::arrays::refused;
use crate::keys::{of_files, of_keys, parsed, table};
use crate::material::PyMaterial;
use crate::measurement::PyMeasurement;
use crate::schedule::PySchedule;
use gonio::experiment::{IDEAL, PlannedInstrument, Source, Use, load_instrument};
use gonio::instrument::{self, Bench, Ideal, Instrument};
use gonio::measurement::{About, Measurement, Outcome};
use gonio::schedule::{Schedule, Unreachable};
use pyo3::prelude::*;
use pyo3::types::PyDict;
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
                    let source = Source::new("instrument", table(Some(keys))?.to_string());
                    let table = source.table().map_err(of_keys)?;
                    instrument::read_table(table).map_err(|e| of_keys(source.error(e)))?
                }
                Err(_) => {
                    let name: PathBuf = spec.extract().map_err(|_| {
                        refused(format!(
                            "spec = {spec}: allowed is a name, a path or a dictionary"
                        ))
                    })?;
                    load_instrument(&name.to_string_lossy()).map_err(of_files)?
                }
            },
        };
        let planned = PlannedInstrument::new(spec, use_of);
        Ok(Self {
            planned: Some(planned),
        })
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

/// The measurement of these poses alone: a lattice has others, which a file does not list.
fn only(mut measurement: Measurement, poses: &[u32], lost: &[(u32, Unreachable)]) -> Measurement {
    let mut asked = vec![false; measurement.outcomes.len()];
    for &pose in poses {
        asked[pose as usize] = true;
    }
    for (outcome, asked) in measurement.outcomes.iter_mut().zip(asked) {
        if !asked {
            *outcome = Outcome::NotVisited;
        }
    }
    for &(pose, reason) in lost {
        measurement.outcomes[pose as usize] = Outcome::Unreachable(reason);
    }
    measurement
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
    seed: u64,
) -> PyResult<PyMeasurement> {
    let brdf = &*material.brdf;
    let poses = &schedule.schedule;
    let planned = instrument.and_then(|i| i.planned.as_ref());
    let about = |planned: Option<&PlannedInstrument>| About {
        material: Some(material.label.clone()),
        instrument: Some(planned.map_or(IDEAL, |i| &i.name).into()),
        realisation: planned.map(|i| i.realisation(seed)),
        seed: planned.map(|_| seed),
        schedule_hash: None,
    };
    let (Some(planned), Some(instrument)) = (planned, instrument) else {
        let measurement = py.detach(|| match &schedule.order {
            Some(order) => only(Ideal.measure(brdf, poses), order, &schedule.lost),
            None => Ideal.measure(brdf, poses),
        });
        return Ok(PyMeasurement::new(measurement, about(None), None));
    };
    let folded = Schedule::clone(poses).parametrization.symmetry();
    planned
        .check_symmetry(folded, "the schedule", || "instrument".into())
        .map_err(of_keys)?;
    let Some(bench) = instrument.bench(seed)? else {
        return Err(refused("the ideal instrument has no machine"));
    };
    let (measurement, itinerary) = py.detach(|| {
        let mut itinerary = match &schedule.order {
            Some(order) => bench.plan_given(poses, order),
            None => bench.plan(poses, planned.use_of.order),
        };
        // What the schedule left out keeps its reason.
        itinerary.unreachable.extend(&schedule.lost);
        let measurement = bench.session(&itinerary, seed).measure(brdf, poses);
        (measurement, itinerary)
    });
    Ok(PyMeasurement::new(
        measurement,
        about(Some(planned)),
        Some(itinerary),
    ))
}
