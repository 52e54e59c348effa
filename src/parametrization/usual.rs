//! Coordinates where none are asked for.

use super::{Form, HalfDifference, Parametrization, ParametrizationSpec, WarpSpec, Warps};
use crate::geometry::Symmetry;
use std::sync::Arc;

/// Coordinates that are fine where lobes peak, where none are asked for: half/difference with a square root along θ_h.
pub fn usual_form(symmetry: Symmetry) -> Arc<dyn Parametrization> {
    let warps = Warps::from([("theta_h".to_owned(), WarpSpec::SquareRoot)]);
    let spec = ParametrizationSpec::new::<Form<HalfDifference>>(warps);
    let form = spec.form(symmetry);
    form.unwrap_or_else(|_| unreachable!("theta_h is radial"))
}
