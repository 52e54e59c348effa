//! Advice: which poses and reconstruction are best for materials like some.

use crate::errors::{of_files, of_keys, refused, renamed, warn};
use crate::given::detached;
use crate::keys;
use crate::run::{config_source, kept};
use crate::state::text;
use crate::table::of_json;
use gonio::Error;
use gonio::error::{ParameterError, in_left_open};
use gonio::experiment::{
    AdviceSpec, Allowance, AnyPlan, FORMULAS, Failure, MAX_MINUTES, Metric, Source,
};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Compares poses and reconstructions on materials like the one to be measured: the best choices, a dictionary each.
///
/// `config` (a path, or a dictionary of keys) names the materials, `{"materials_dir": "MERL"}`; without it, formulas stand for all.
/// Allowed are `budget` poses, or `minutes` on `instrument`, a preset or a file. Poses serve a `moment` of slices instead,
/// `"variance=5%"`, if one is named; without a budget they are the least of 16, 32, 64, 128 and 250 that bring 85 % of
/// materials to its level, or 250. Errors are `nrmse` and `log_relative` under the
/// cosine measure (`by` ranks), `mean` over materials and `below`, what 90 % of materials are below. `prior` is a
/// file of `gonio train`. At most `most` materials are tried, spread evenly over those that are named.
#[pyfunction]
#[pyo3(signature = (config = None, *, budget = None, minutes = None, instrument = None, by = "nrmse", moment = None, most = 12, prior = None, seed = 1))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn advise<'py>(
    py: Python<'py>,
    config: Option<&Bound<'py, PyAny>>,
    budget: Option<&Bound<'py, PyAny>>,
    minutes: Option<f64>,
    instrument: Option<PathBuf>,
    by: &str,
    moment: Option<&str>,
    #[pyo3(from_py_with = keys::most)] most: usize,
    prior: Option<PathBuf>,
    #[pyo3(from_py_with = keys::seed_of_config)] seed: i64,
) -> PyResult<Bound<'py, PyAny>> {
    let allowance = match (budget, minutes) {
        (Some(budget), None) => Some(Allowance::Poses(keys::budget(budget)?)),
        (None, Some(minutes)) => {
            in_left_open("minutes", minutes, 0.0, MAX_MINUTES).map_err(refused)?;
            if instrument.is_none() {
                return Err(refused("minutes is of an instrument; allowed: to name one"));
            }
            Some(Allowance::Minutes(minutes))
        }
        (None, None) if moment.is_some() => None,
        _ => {
            return Err(refused(
                "allowed is one of budget, minutes and, alone or beside one, moment",
            ));
        }
    };
    let of_argument = |name: &'static str| {
        move |e: ParameterError| refused(ParameterError::new(name, e.value, e.allowed))
    };
    let moment = moment.map(str::parse).transpose();
    let moment = moment.map_err(of_argument("moment"))?;
    let by = Metric::named(by).map_err(of_argument("by"))?;
    let (source, refuse): (_, fn(Error) -> PyErr) = match config {
        Some(config) => config_source(config)?,
        None => (Source::new("advise", FORMULAS), of_keys),
    };
    let asked = AdviceSpec {
        allowance,
        moment,
        instrument: instrument.map(|name| name.to_string_lossy().into_owned()),
        seed,
        by,
        most,
        prior,
        built_in_prior: config.is_some(),
    };
    let mut interrupt = None;
    let advised = detached(py, || {
        let materials = AnyPlan::read(&source)?.into_moments();
        asked.advise(materials, |plan| {
            let (rows, summary) = kept(plan, &mut interrupt)?;
            Ok((rows, summary.failures))
        })
    });
    interrupt.map_or(Ok(()), Err)?;
    let advised = advised?.map_err(|e| match e {
        Error::Data { .. } => of_files(e),
        e => renamed("instrument[0].file", "instrument")(refuse(e)),
    })?;
    for Failure { job, reason, .. } in &advised.failures {
        warn(py, &format!("{job}: {reason}"))?;
    }
    if advised.is_enough == Some(false) {
        let too_few = format!("{} bring too few materials to the level", advised.allowance);
        warn(py, &too_few)?;
    }
    if !advised.left_out.is_empty() {
        warn(py, &format!("left out: {}", advised.left_out.join(", ")))?;
    }
    of_json(py, &text(&advised.choices)?)
}
