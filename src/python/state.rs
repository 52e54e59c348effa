//! Objects as texts (JSON), for pickle: numbers to the bit.

use crate::errors::{refused, unpicklable};
use crate::measurement::PyMeasurement;
use crate::schedule::PySchedule;
use gonio::brdf::Channels;
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::instrument::Order;
use gonio::measurement::{About, Details, Flags, Measurement, Outcome, Place};
use gonio::parametrization::{Parametrization, WarpSpec, find};
use gonio::schedule::{
    Itinerary, Lattice, LatticeAxis, Pose, Positions, Schedule, Unreachable, Visit,
};
use pyo3::prelude::*;
use pyo3::{BoundObject, PyTypeInfo};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What `__reduce__` returns: a function, and its arguments.
pub type Reduced<'py> = PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)>;

/// The function that makes an object of a class again, and what it takes.
pub fn reduced_to<'py, T: PyTypeInfo, A>(py: Python<'py>, arguments: A) -> Reduced<'py>
where
    A: IntoPyObject<'py>,
{
    let restore = py.get_type::<T>().getattr("_restored")?;
    let arguments = arguments.into_pyobject(py).map_err(Into::into)?;
    Ok((restore, arguments.into_bound().into_any()))
}

/// The same of an object that is one text.
pub fn reduced<'py, T: PyTypeInfo>(py: Python<'py>, state: &impl Serialize) -> Reduced<'py> {
    reduced_to::<T, _>(py, (text(state)?,))
}

/// A state as a text.
pub fn text(state: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(state).map_err(refused)
}

/// The state of a text.
pub fn restored<S: DeserializeOwned>(text: &str) -> PyResult<S> {
    serde_json::from_str(text).map_err(|e| {
        refused(format!(
            "this pickle is not of this version of gonio ({e}); allowed: one that it made"
        ))
    })
}

/// A list of a pickle whose length is another than that of the poses.
fn damaged(what: &str) -> PyErr {
    refused(format!(
        "this pickle is damaged: {what} do not fit the poses; allowed: one that gonio made"
    ))
}

/// A parametrization.
#[derive(Serialize, Deserialize)]
pub struct FormState {
    name: String,
    symmetry: Vec<String>,
    warp: String,
}

impl FormState {
    /// The state of a form.
    ///
    /// # Errors
    /// `TypeError` of one that no name makes.
    pub fn of(form: &Arc<dyn Parametrization>) -> PyResult<Self> {
        let state = Self {
            name: form.name().into(),
            symmetry: form
                .symmetry()
                .names()
                .into_iter()
                .map(Into::into)
                .collect(),
            warp: form.warp_name(),
        };
        match state.form() {
            Ok(_) => Ok(state),
            Err(_) => Err(unpicklable(&format!(
                "coordinates {} with warp {} cannot be pickled; allowed: those of parametrizations()",
                state.name, state.warp
            ))),
        }
    }

    /// The form.
    pub fn form(&self) -> PyResult<Arc<dyn Parametrization>> {
        let unknown = || refused(format!("parametrization = {} is not known", self.name));
        let mut warps = BTreeMap::new();
        for warp in self.warp.split(';').filter(|warp| *warp != "none") {
            let parts = warp.split_once(':');
            let warp = parts.and_then(|(axis, name)| Some((axis.into(), WarpSpec::named(name)?)));
            let (axis, warp) = warp.ok_or_else(unknown)?;
            warps.insert(axis, warp);
        }
        let symmetry = Symmetry::named(&self.symmetry).map_err(refused)?;
        let entry = find(&self.name).ok_or_else(unknown)?;
        entry.warped(symmetry, &warps).map_err(refused)
    }
}

/// A schedule, with the order of a file.
#[derive(Serialize, Deserialize)]
pub struct ScheduleState {
    form: FormState,
    sample_set: String,
    /// Coordinates, and vectors of light and sensor.
    poses: Vec<[f64; 10]>,
    lattice: Option<(Vec<LatticeAxis>, Vec<Option<u32>>)>,
    unphysical_share: f64,
    assumes: Option<String>,
    order: Option<Vec<u32>>,
    lost: Vec<(u32, String)>,
}

fn pose(of: &[f64; 10]) -> Pose {
    let [a, b, c, d, light @ .., _, _, _] = *of;
    let sensor = [of[7], of[8], of[9]];
    let direction = |v: [f64; 3]| Direction::from_unit(v.into());
    Pose {
        coords: [a, b, c, d],
        pair: DirectionPair::new(direction(light), direction(sensor)),
    }
}

fn numbers(pose: &Pose) -> [f64; 10] {
    let [a, b, c, d] = pose.coords;
    let [i, j, k] = pose.pair.omega_i.vector().to_array();
    let [u, v, w] = pose.pair.omega_o.vector().to_array();
    [a, b, c, d, i, j, k, u, v, w]
}

fn labelled(lost: &[(u32, Unreachable)]) -> Vec<(u32, String)> {
    lost.iter()
        .map(|(pose, why)| (*pose, why.label()))
        .collect()
}

fn reasons(lost: Vec<(u32, String)>) -> PyResult<Vec<(u32, Unreachable)>> {
    let reason = |(pose, why): (u32, String)| Some((pose, Unreachable::of_label(&why)?));
    let all = lost.into_iter().map(reason).collect::<Option<_>>();
    all.ok_or_else(|| damaged("reasons"))
}

impl ScheduleState {
    /// The state of a schedule.
    pub fn of(of: &PySchedule) -> PyResult<Self> {
        let schedule = &of.schedule;
        let lattice = schedule.lattice.as_ref();
        Ok(Self {
            form: FormState::of(&schedule.parametrization)?,
            sample_set: schedule.sample_set.clone(),
            poses: schedule.poses.iter().map(numbers).collect(),
            lattice: lattice.map(|l| (l.axes.clone(), l.pose.clone())),
            unphysical_share: schedule.unphysical_share,
            assumes: schedule.assumes.clone(),
            order: of.order.clone(),
            lost: labelled(&of.lost),
        })
    }

    /// The schedule.
    pub fn schedule(self) -> PyResult<PySchedule> {
        let poses: Vec<Pose> = self.poses.iter().map(pose).collect();
        let of_lattice = self.lattice.iter().flat_map(|(_, poses)| poses).flatten();
        let listed = self.order.iter().flatten();
        let lost = self.lost.iter().map(|(pose, _)| pose);
        let mut numbers = of_lattice.chain(listed).chain(lost);
        if numbers.any(|&n| n as usize >= poses.len()) {
            return Err(damaged("numbers"));
        }
        Ok(PySchedule {
            schedule: Arc::new(Schedule {
                parametrization: self.form.form()?,
                sample_set: self.sample_set,
                poses,
                lattice: self.lattice.map(|(axes, pose)| Lattice { axes, pose }),
                unphysical_share: self.unphysical_share,
                assumes: self.assumes,
            }),
            order: self.order,
            lost: reasons(self.lost)?,
        })
    }
}

/// The visits of a machine.
#[derive(Serialize, Deserialize)]
struct ItineraryState {
    instrument: String,
    axes: Vec<String>,
    order: String,
    /// Pose, block, positions, and five times.
    visits: Vec<(u32, u32, Positions, [f64; 5])>,
    unreachable: Vec<(u32, String)>,
}

impl ItineraryState {
    fn of(itinerary: &Itinerary) -> Self {
        let visit = |v: &Visit| {
            let times = [
                v.move_seconds,
                v.exposure_seconds,
                v.seconds,
                v.at_seconds,
                v.since_calibration_seconds,
            ];
            (v.pose, v.block, v.positions, times)
        };
        Self {
            instrument: itinerary.instrument.clone(),
            axes: itinerary.axes.clone(),
            order: itinerary.order.into(),
            visits: itinerary.visits.iter().map(visit).collect(),
            unreachable: labelled(&itinerary.unreachable),
        }
    }

    fn itinerary(self) -> PyResult<Itinerary> {
        // "given" is the order of a file.
        let mut orders = Order::ALL.map(Order::name).into_iter().chain(["given"]);
        let order = orders.find(|order| *order == self.order);
        let visit = |(pose, block, positions, times): (u32, u32, Positions, [f64; 5])| {
            let [
                move_seconds,
                exposure_seconds,
                seconds,
                at_seconds,
                since_calibration_seconds,
            ] = times;
            Visit {
                pose,
                block,
                positions,
                move_seconds,
                exposure_seconds,
                seconds,
                at_seconds,
                since_calibration_seconds,
            }
        };
        Ok(Itinerary {
            instrument: self.instrument,
            axes: self.axes,
            order: order.ok_or_else(|| damaged("visits"))?,
            visits: self.visits.into_iter().map(visit).collect(),
            unreachable: reasons(self.unreachable)?,
        })
    }
}

/// A measurement. What is no number in JSON is NaN.
#[derive(Serialize, Deserialize)]
pub struct MeasurementState {
    schedule: ScheduleState,
    channels: Channels,
    values: Vec<Option<f64>>,
    outcomes: Vec<String>,
    type_a: Option<Vec<Option<f64>>>,
    type_b: Option<Vec<Option<f64>>>,
    flags: Vec<Vec<String>>,
    half_angles_deg: [f64; 2],
    places: Vec<[usize; 2]>,
    about: About,
    is_bare: bool,
    itinerary: Option<ItineraryState>,
}

fn some(numbers: &[f64]) -> Vec<Option<f64>> {
    numbers.iter().copied().map(Some).collect()
}

fn plain(numbers: Vec<Option<f64>>) -> Vec<f64> {
    let numbers = numbers.into_iter();
    numbers.map(|x| x.unwrap_or(f64::NAN)).collect()
}

impl MeasurementState {
    /// The state of a measurement.
    pub fn of(of: &PyMeasurement) -> PyResult<Self> {
        let m = &of.measurement;
        let details = m.details.as_ref();
        let flags = |set: &Flags| {
            let all = Flags::ALL.into_iter();
            let held = all.filter(|(flag, _)| set.has(*flag));
            held.map(|(_, name)| name.into()).collect()
        };
        Ok(Self {
            schedule: ScheduleState::of(&PySchedule::from(Arc::clone(&m.schedule)))?,
            channels: m.channels.clone(),
            values: some(&m.values),
            outcomes: m.outcomes.iter().map(outcome_label).collect(),
            type_a: details.map(|d| some(&d.type_a)),
            type_b: details.map(|d| some(&d.type_b)),
            flags: details.map_or(Vec::new(), |d| d.flags.iter().map(flags).collect()),
            half_angles_deg: m.half_angles_deg,
            places: m.places.iter().map(|p| [p.file, p.line]).collect(),
            about: of.about.clone(),
            is_bare: of.about.is_bare,
            itinerary: of.itinerary.as_ref().map(ItineraryState::of),
        })
    }

    /// The measurement.
    pub fn measurement(self) -> PyResult<PyMeasurement> {
        let schedule = self.schedule.schedule()?.schedule;
        let (poses, channels) = (schedule.poses.len(), self.channels.count());
        let outcome = |label: &String| match label.as_str() {
            "reading" => Some(Outcome::Reading),
            "no-data" => Some(Outcome::NoData),
            "not-visited" => Some(Outcome::NotVisited),
            label => Unreachable::of_label(label).map(Outcome::Unreachable),
        };
        let outcomes: Option<Vec<_>> = self.outcomes.iter().map(outcome).collect();
        let outcomes = outcomes.filter(|all| all.len() == poses);
        let flags = |names: &Vec<String>| {
            let all = Flags::ALL.into_iter();
            let held = all.filter(|(_, name)| names.iter().any(|held| held == name));
            held.fold(Flags::NONE, |set, (flag, _)| set.with(flag))
        };
        let wide = |numbers: Vec<Option<f64>>| {
            Some(plain(numbers)).filter(|all| all.len() == poses * channels)
        };
        let details = match (self.type_a, self.type_b) {
            (Some(a), Some(b)) if self.flags.len() == poses => Some(Details {
                type_a: wide(a).ok_or_else(|| damaged("uncertainties"))?,
                type_b: wide(b).ok_or_else(|| damaged("uncertainties"))?,
                flags: self.flags.iter().map(flags).collect(),
            }),
            (None, None) => None,
            _ => return Err(damaged("flags")),
        };
        let place = |[file, line]: [usize; 2]| Place { file, line };
        let measurement = Measurement {
            schedule,
            channels: self.channels,
            values: wide(self.values).ok_or_else(|| damaged("values"))?,
            outcomes: outcomes.ok_or_else(|| damaged("outcomes"))?,
            details,
            half_angles_deg: self.half_angles_deg,
            places: self.places.into_iter().map(place).collect(),
        };
        let about = About {
            is_bare: self.is_bare,
            ..self.about
        };
        let itinerary = self.itinerary.map(ItineraryState::itinerary).transpose()?;
        Ok(PyMeasurement::new(measurement, about, itinerary))
    }
}

/// An outcome as the text of a pickle has it: with the number of an axis.
fn outcome_label(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Unreachable(why) => why.label(),
        other => crate::measurement::outcome_name(other).into(),
    }
}
