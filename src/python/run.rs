//! Whole experiments: a config in, a table out.

use crate::errors::{goes_on, of_files, of_keys, other_type, refused, warn};
use crate::given::detached;
use crate::keys::{source, table};
use crate::table::columns;
use gonio::Error;
use gonio::experiment::moments::MaterialProfiles;
use gonio::experiment::{
    AnyPlan, Event, Experiment, Extent, Failure, Known, Observer, Record, Row, Source, Summary,
};
use gonio::report::{profile_objects, relation_objects};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value};
use std::cell::RefCell;
use std::path::PathBuf;

/// Keeps records, and stops at an interrupt of Python.
struct Keep<'i, R> {
    records: Vec<R>,
    interrupt: RefCell<&'i mut Option<PyErr>>,
}

impl<R: Clone> Observer<R> for Keep<'_, R> {
    fn cancelled(&self) -> bool {
        !goes_on(&mut self.interrupt.borrow_mut())
    }

    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        if let Event::Made(records) = event {
            self.records.extend_from_slice(records);
        }
        Ok(())
    }
}

/// Runs an experiment without Python's lock: its records in the order they were made, and the run's summary.
/// [`Error::Interrupted`] after an interrupt of Python, which is left in `interrupt`.
pub fn kept<E: Experiment>(
    plan: &E,
    interrupt: &mut Option<PyErr>,
) -> Result<(Vec<E::Record>, Summary), Error> {
    let mut keep = Keep {
        records: Vec::new(),
        interrupt: RefCell::new(interrupt),
    };
    let summary = plan.run(&Extent::default(), &Known::default(), &mut keep)?;
    if keep.interrupt.into_inner().is_some() {
        let (rows, path) = (0, PathBuf::new());
        return Err(Error::Interrupted { rows, path });
    }
    Ok((keep.records, summary))
}

/// Runs an experiment: its records in the order of results.
fn records<E: Experiment + Sync>(py: Python<'_>, plan: &E) -> PyResult<Vec<E::Record>>
where
    E::Record: Send,
{
    let mut interrupt = None;
    let done = detached(py, || kept(plan, &mut interrupt))?;
    interrupt.map_or(Ok(()), Err)?;
    let (mut records, summary) = done.map_err(of_files)?;
    for Failure { job, reason, .. } in &summary.failures {
        let sentence = format!("{job}: {reason}");
        if records.is_empty() {
            return Err(refused(sentence));
        }
        warn(py, &sentence)?;
    }
    let place = |record: &E::Record| summary.keys.iter().position(|key| key[..] == *record.key());
    records.sort_by_cached_key(place);
    Ok(records)
}

/// What a record is as an object of JSON.
fn object(record: impl serde::Serialize) -> PyResult<Map<String, Value>> {
    match serde_json::to_value(record).map_err(refused)? {
        Value::Object(object) => Ok(object),
        other => Err(refused(format!("{other} is no row"))),
    }
}

/// The text of a config, a path or a dictionary of its keys, and how its errors are raised.
pub fn config_source(config: &Bound<'_, PyAny>) -> PyResult<(Source, fn(Error) -> PyErr)> {
    if let Ok(keys) = config.cast::<PyDict>() {
        return Ok((source("config", &table(Some(keys))?), of_keys));
    }
    let path = config.extract::<PathBuf>();
    let path = path.map_err(|_| other_type("config", config, "a path or a dictionary"))?;
    Ok((Source::read(&path).map_err(of_files)?, of_files))
}

/// Runs the experiment of a config (a path, or a dictionary of its keys): its table, a dictionary of columns for pandas or polars.
///
/// The rows are those of `results.csv`, or of `profiles.csv` and `relations.csv` where the config is about moments. `set`
/// overrides keys: `{"metrics.tolerance": 0.05}`. Nothing is written. A job that fails is a warning, unless all do.
#[pyfunction]
#[pyo3(signature = (config, *, set = None))]
pub fn run<'py>(
    py: Python<'py>,
    config: &Bound<'py, PyAny>,
    set: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (mut source, refuse) = config_source(config)?;
    for (key, value) in table(set)? {
        let assignment = format!("{key}={value}");
        let label = format!("set {assignment}");
        source.set(&assignment, label).map_err(refuse)?;
    }
    let plan = detached(py, || AnyPlan::read(&source))?.map_err(refuse)?;
    let rows = match plan {
        AnyPlan::Acquisition(plan) => {
            let rows: Vec<Row> = records(py, &*plan)?;
            rows.iter().map(object).collect::<PyResult<Vec<_>>>()?
        }
        AnyPlan::Moments(plan) => {
            let found = records(py, &*plan)?;
            let rows = found.iter().flat_map(MaterialProfiles::rows);
            profile_objects(&rows.collect::<Vec<_>>())
        }
        AnyPlan::Relations(plan) => {
            let rows: Vec<_> = records(py, &*plan)?.iter().flat_map(|r| r.rows()).collect();
            relation_objects(&rows)
        }
    };
    columns(py, &rows)
}
