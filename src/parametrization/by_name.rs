//! A parametrization as its name, symmetries and warps, for serde: `#[serde(with = "gonio::parametrization::by_name")]`.

use super::{Parametrization, Warps, find};
use crate::geometry::Symmetry;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::sync::Arc;

/// What is written of a parametrization.
#[derive(Serialize, Deserialize)]
struct Named {
    name: String,
    symmetry: Symmetry,
    warps: Warps,
}

/// Writes what [`deserialize`] finds it by.
///
/// # Errors
/// A parametrization that is not found by its name, and those of the format.
pub fn serialize<S: Serializer>(form: &Arc<dyn Parametrization>, to: S) -> Result<S::Ok, S::Error> {
    let axes = form.axes().iter();
    let warps = axes.filter_map(|axis| Some((axis.symbol.to_owned(), axis.warp?)));
    let named = Named {
        name: form.name().to_owned(),
        symmetry: form.symmetry(),
        warps: warps.collect(),
    };
    let found = find(&named.name).and_then(|e| e.warped(named.symmetry, &named.warps).ok());
    if found.is_none_or(|found| found.axes() != form.axes()) {
        let message = format!("parametrization = {} is not found by that name", named.name);
        return Err(serde::ser::Error::custom(message));
    }
    named.serialize(to)
}

/// Finds a parametrization of [`all`](super::all).
///
/// # Errors
/// A name that is not there, a warp on an axis that cannot have it, and those of the format.
pub fn deserialize<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<Arc<dyn Parametrization>, D::Error> {
    let Named {
        name,
        symmetry,
        warps,
    } = Named::deserialize(from)?;
    let unknown = || D::Error::custom(format!("parametrization = {name} is not known"));
    let entry = find(&name).ok_or_else(unknown)?;
    entry.warped(symmetry, &warps).map_err(D::Error::custom)
}
