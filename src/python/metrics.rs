//! How far two materials are apart.

use crate::errors::refused;
use crate::given::detached;
use crate::keys::{parsed, table};
use crate::material::PyMaterial;
use gonio::error::ParameterError;
use gonio::metrics::{Errors, Judged, Measure, MetricsSpec, TestSet};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Adds quantities under their names, NaN where they are not defined.
pub fn quantities<T>(to: &Bound<'_, PyDict>, all: &[Judged<T>], of: &T) -> PyResult<()> {
    all.iter()
        .try_for_each(|(quantity, get)| to.set_item(quantity.name, get(of).unwrap_or(f64::NAN)))
}

/// Measures by their names.
fn measures(names: Option<Vec<String>>) -> PyResult<Vec<Measure>> {
    let Some(names) = names else {
        return Ok(Measure::USUAL.to_vec());
    };
    if names.is_empty() {
        return Err(refused("measures = []; allowed: one measure or more"));
    }
    let find = |name: &String| {
        let found = Measure::ALL.into_iter().find(|m| m.name() == name);
        let allowed = Measure::ALL.map(Measure::name).join(", ");
        found.ok_or_else(|| refused(ParameterError::new("measures", name, allowed)))
    };
    names.iter().map(find).collect()
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
    let compared = detached(py, || {
        let set = TestSet::new(&measures, &spec)?;
        let tally = set.compare(&*truth.brdf, &*copy.brdf).tally;
        Ok::<_, ParameterError>((set, tally))
    });
    let (set, tally) = compared?.map_err(refused)?;
    let all = PyDict::new(py);
    for (at, measure) in measures.iter().enumerate() {
        let (errors, standard) = (tally.errors(at), tally.standard_errors(at));
        let of = PyDict::new(py);
        quantities(&of, &Errors::QUANTITIES, &errors)?;
        quantities(&of, &Errors::STANDARD_ERRORS, &standard)?;
        for (name, pairs) in [
            ("pairs", errors.pairs),
            ("pairs_missing", errors.pairs_missing),
            ("pairs_unreconstructed", errors.pairs_unreconstructed),
        ] {
            of.set_item(name, pairs)?;
        }
        of.set_item("converged", set.has_converged(&tally, at))?;
        all.set_item(measure.name(), of)?;
    }
    Ok(all)
}
