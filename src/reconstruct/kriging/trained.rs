//! Constants of kernels in chosen coordinates, of `gonio train --kernel`.

use super::kernel::{E, F, P, R};
use crate::reconstruct::Coordinates;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// The columns of a kernel's terms: singles first.
pub(super) const TERMS: [&[usize]; 9] = [
    &[P],
    &[P],
    &[R],
    &[E],
    &[P, R],
    &[P, R],
    &[P, R, E, F],
    &[P, R, E, F],
    &[P, R, E, F],
];

/// The kernel of chosen coordinates from which constants are sought: amplitude and lengths of each term.
pub(super) const START: [(f64, &[f64]); TERMS.len()] = [
    (1.0, &[1.0]),
    (0.2, &[0.2]),
    (0.1, &[1.0]),
    (0.1, &[1.0]),
    (0.3, &[1.0, 1.0]),
    (0.05, &[0.2, 0.7]),
    (5.0, &[3.0, 3.0, 3.0, 3.0]),
    (0.5, &[0.6, 1.0, 1.0, 1.0]),
    (0.05, &[0.2, 0.5, 0.5, 0.5]),
];

/// Kernels of many materials, as a file holds them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kernels {
    /// The command that made them.
    pub command: String,
    /// Names of the materials that they were fitted to.
    pub materials: Vec<String>,
    /// Hash (BLAKE3) of the constants as JSON.
    pub blake3: String,
    /// Logarithms of amplitude and lengths of each term, by the label of the coordinates, to 3 decimals.
    pub constants: BTreeMap<String, Vec<f64>>,
}

impl Kernels {
    pub(super) fn hash(constants: &BTreeMap<String, Vec<f64>>) -> String {
        let text = serde_json::to_string(constants).unwrap_or_default();
        blake3::hash(text.as_bytes()).to_hex().to_string()
    }

    /// The constants of some coordinates; of warps to which nothing was fitted those of the plain parametrization; of another
    /// parametrization the means of all.
    fn of(&self, coordinates: &Coordinates) -> Vec<f64> {
        let found = self.constants.get(&coordinates.label());
        if let Some(constants) = found.or_else(|| self.constants.get(&coordinates.kind)) {
            return constants.clone();
        }
        let others = self.constants.iter().filter(|(label, _)| *label != DEFAULT);
        let others: Vec<&Vec<f64>> = others.map(|(_, all)| all).collect();
        let mean = |i: usize| others.iter().map(|all| all[i]).sum::<f64>() / others.len() as f64;
        (0..LOGS).map(mean).collect()
    }

    /// The kernels as a file.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// Number of the constants of a kernel.
const LOGS: usize = {
    let (mut sum, mut i) = (0, 0);
    while i < TERMS.len() {
        sum += 1 + TERMS[i].len();
        i += 1;
    }
    sum
};

/// The label of the kernel without a choice of coordinates.
pub(super) const DEFAULT: &str = "default";

/// The kernels that are built in.
static BUILT_IN: LazyLock<Option<Kernels>> = LazyLock::new(|| {
    let kernels: Kernels = serde_json::from_str(include_str!("kernels.json")).ok()?;
    (!kernels.constants.is_empty()).then_some(kernels)
});

/// The logarithms of the constants of a kernel in some coordinates.
pub(super) fn constants(coordinates: &Coordinates) -> Vec<f64> {
    match &*BUILT_IN {
        Some(kernels) => kernels.of(coordinates),
        None => start(),
    }
}

/// Those from which they are sought.
pub(super) fn start() -> Vec<f64> {
    let of = |(amplitude, lengths): &(f64, &[f64])| {
        let all = std::iter::once(amplitude).chain(lengths.iter());
        all.map(|x| x.ln()).collect::<Vec<_>>()
    };
    START.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constants_are_those_that_were_hashed() {
        let kernels = BUILT_IN.as_ref().unwrap();
        assert_eq!(Kernels::hash(&kernels.constants), kernels.blake3);
    }
}
