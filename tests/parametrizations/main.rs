//! Coordinates of every parametrization: there and back, the measure, and what the papers misprint.
#![cfg(feature = "experiments")]

#[path = "../common/mod.rs"]
mod common;

mod errata;
mod jacobians;
mod round_trips;

use common::{at, polar, warps};
use gonio::geometry::Symmetry;
use gonio::parametrization::Parametrization;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Every polar parametrization under a symmetry: plain, each warp an axis can have, and all radial axes
/// bent by the same warp.
fn forms(symmetry: Symmetry) -> Vec<Arc<dyn Parametrization>> {
    let mut forms = Vec::new();
    for entry in polar() {
        forms.push(entry.form(symmetry));
        for warp in warps() {
            let mut bent = BTreeMap::new();
            for axis in entry.axes(symmetry) {
                let alone = BTreeMap::from([(axis.symbol.to_owned(), warp)]);
                if let Ok(p) = entry.warped(symmetry, &alone) {
                    forms.push(p);
                    bent.extend(alone);
                }
            }
            if bent.len() > 1 {
                let all = entry.warped(symmetry, &bent);
                forms.push(all.expect("each alone is allowed"));
            }
        }
    }
    forms
}
