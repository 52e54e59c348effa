//! Moments of slices, and their profiles over the view.

use crate::arrays::{doubt_degrees, list};
use crate::errors::{refused, within};
use crate::given::detached;
use crate::keys::{self, parsed, read, table};
use crate::material::PyMaterial;
use crate::metrics::quantities;
use gonio::brdf::Brdf;
use gonio::error::{ParameterError, listed};
use gonio::experiment::moments::ProfileRow;
use gonio::moments::{
    self, Channel, Estimator, MomentErrors, MomentsSpec, Order, PeakResolving, Profile, Slice,
};
use gonio::report::profile_objects;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use serde_json::{Map, Value};

/// An estimator from its keys; those of the default one need not name it.
fn estimator(keys: toml::Table) -> PyResult<Box<dyn Estimator>> {
    let estimator: Box<dyn Estimator> = match keys.contains_key("kind") {
        true => read("estimator", "kind", &moments::all(), keys)?,
        false => Box::new(parsed::<PeakResolving>("estimator", keys)?),
    };
    estimator.check().map_err(refused)?;
    Ok(estimator)
}

/// The keys of `[moments]`.
fn settings(keys: Option<&Bound<'_, PyDict>>) -> PyResult<(MomentsSpec, Box<dyn Estimator>)> {
    let mut keys = table(keys)?;
    let estimator = match keys.remove("estimator") {
        None => estimator(toml::Table::new())?,
        Some(toml::Value::Table(keys)) => self::estimator(keys).map_err(within("estimator"))?,
        Some(other) => {
            let message = format!("estimator = {other}; allowed: a dictionary");
            return Err(refused(message));
        }
    };
    let spec: MomentsSpec = parsed("moments", keys)?;
    spec.check().map_err(refused)?;
    Ok((spec, estimator))
}

/// The moments of slices at some views, as a profile of them.
pub fn moments_at(
    py: Python<'_>,
    brdf: &dyn Brdf,
    theta_o: &Bound<'_, PyAny>,
    channel: &str,
    seed: u64,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<Profile> {
    let views = list(theta_o, "theta_o")?;
    doubt_degrees(py, "theta_o", &views)?;
    let named = Channel::ALL.into_iter().find(|c| c.name() == channel);
    let unknown = || refused(ParameterError::new("channel", channel, Channel::names()));
    let channel = named.ok_or_else(unknown)?;
    let estimator = estimator(table(keys)?)?;
    let slices = detached(py, || {
        let slice = |theta_o: &f64| {
            let slice = Slice::new(brdf, channel, *theta_o)?;
            Ok::<_, ParameterError>(estimator.estimate(&slice, Order::MAX, seed))
        };
        views.par_iter().map(slice).collect::<Result<Vec<_>, _>>()
    });
    Ok(Profile {
        channel,
        order: Order::MAX,
        slices: slices?.map_err(refused)?,
        views,
        azimuth: 0.0,
        diffuse: 0.0,
    })
}

/// Profiles of every channel that is asked for.
pub fn profiles(
    py: Python<'_>,
    brdf: &dyn Brdf,
    seed: u64,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<Profile>> {
    let (spec, estimator) = settings(keys)?;
    let made = detached(py, || {
        let mut all: Vec<Profile> = Vec::new();
        for &channel in &spec.channels {
            let first = Profile::new(brdf, channel, &spec, &*estimator, seed)?;
            for azimuth in spec.further_azimuths(brdf) {
                all.push(first.at_azimuth(azimuth, brdf, &spec, &*estimator, seed)?);
            }
            all.push(first);
        }
        all.sort_by(|a, b| a.azimuth.total_cmp(&b.azimuth));
        Ok::<_, ParameterError>(all)
    });
    made?.map_err(refused)
}

/// Rows of profiles by the names of their columns.
pub fn objects(material: &str, profiles: &[Profile]) -> Vec<Map<String, Value>> {
    let rows = |p| ProfileRow::of_profile(material, p);
    profile_objects(&profiles.iter().flat_map(rows).collect::<Vec<_>>())
}

/// Errors of the moments of a copy: means over the views, all of them and those of bands, NaN where undefined. Keys are those of `[moments]` in a config,
/// with one channel.
#[pyfunction]
#[pyo3(signature = (truth, copy, *, seed = 1, **keys))]
pub fn moment_errors<'py>(
    py: Python<'py>,
    truth: &PyMaterial,
    copy: &PyMaterial,
    #[pyo3(from_py_with = keys::seed)] seed: u64,
    keys: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (spec, estimator) = settings(keys)?;
    if let [_, _, ..] = spec.channels[..] {
        let names = listed(spec.channels.iter().map(|c| c.name()));
        let error = ParameterError::new("channels", names, "one channel");
        return Err(refused(error));
    }
    if spec.azimuths > 1 {
        let error = ParameterError::new("azimuths", spec.azimuths, "1");
        return Err(refused(error));
    }
    let errors = detached(py, || {
        let f = Profile::new(&*truth.brdf, spec.channels[0], &spec, &*estimator, seed)?;
        let g = Profile::against(&f, &*copy.brdf, &spec, &*estimator, seed)?;
        Ok::<_, ParameterError>(MomentErrors::between(&f, &g))
    });
    let errors = errors?.map_err(refused)?;
    let all = PyDict::new(py);
    for (of_band, errors) in MomentErrors::QUANTITIES.iter().zip(errors) {
        quantities(&all, of_band, &errors)?;
    }
    Ok(all)
}
