//! How far two materials are apart.

use crate::arrays::refused;
use crate::keys::{parsed, table};
use crate::material::PyMaterial;
use gonio::error::ParameterError;
use gonio::metrics::{self, Errors, Measure, MetricsSpec, TestSet};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Measures by their names.
fn measures(names: Option<Vec<String>>) -> PyResult<Vec<Measure>> {
    let Some(names) = names else {
        return Ok(Measure::USUAL.to_vec());
    };
    let find = |name: &String| {
        let found = Measure::ALL.into_iter().find(|m| m.name() == name);
        let allowed = Measure::ALL.map(Measure::name).join(", ");
        found.ok_or_else(|| refused(ParameterError::new("measures", name, allowed)))
    };
    let found: Vec<Measure> = names.iter().map(find).collect::<PyResult<_>>()?;
    if found.is_empty() {
        return Err(refused("measures = []; allowed: one measure or more"));
    }
    Ok(found)
}

/// Errors of a copy against a truth, in luminance: for each measure every error with its standard error (`…_se`).
///
/// NaN where an error is not defined. The other keys are those of `[metrics]` in a config, e.g. `tolerance` and
/// `mask_deg`. `pairs` were compared; `converged` is false if `max_pairs` came before the tolerance.
#[pyfunction]
#[pyo3(signature = (truth, copy, measures = None, **keys))]
pub fn compare<'py>(
    py: Python<'py>,
    truth: &PyMaterial,
    copy: &PyMaterial,
    measures: Option<Vec<String>>,
    keys: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let measures = self::measures(measures)?;
    let spec: MetricsSpec = parsed("metrics", table(keys)?)?;
    let compared = py.detach(|| {
        let set = TestSet::new(&measures, &spec)?;
        let mut tally = set.tally();
        for n in 0.. {
            let level = set.level(n);
            let [f, g] = [&truth.brdf, &copy.brdf].map(|b| metrics::evaluate(&**b, &level.pairs));
            level.add_to(&mut tally, &f, &g);
            if set.is_enough(&tally) || set.is_last(n) {
                break;
            }
        }
        Ok::<_, ParameterError>((set, tally))
    });
    let (set, tally) = compared.map_err(refused)?;
    let all = PyDict::new(py);
    for (at, measure) in measures.iter().enumerate() {
        let (errors, standard) = (tally.errors(at), tally.standard_errors(at));
        let of = PyDict::new(py);
        for (quantity, get) in Errors::QUANTITIES {
            of.set_item(quantity.name, get(&errors).unwrap_or(f64::NAN))?;
        }
        for (quantity, get) in Errors::STANDARD_ERRORS {
            of.set_item(quantity.name, get(&standard).unwrap_or(f64::NAN))?;
        }
        of.set_item("pairs", errors.pairs)?;
        of.set_item("pairs_missing", errors.pairs_missing)?;
        of.set_item("pairs_unreconstructed", errors.pairs_unreconstructed)?;
        of.set_item("converged", set.has_converged(&tally, at))?;
        all.set_item(measure.name(), of)?;
    }
    Ok(all)
}
