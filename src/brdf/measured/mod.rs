//! Measured tables, and materials converted into tables.

mod doubts;
pub mod mdl;
pub mod merl;
pub mod rgl;
mod tabulated;
pub mod tensor_tree;
pub mod utia;
pub mod zemax;

pub use tabulated::TabulatedSpec;

pub(super) use merl::ENTRY as MERL;
pub(super) use rgl::ENTRY as RGL;
pub(super) use tabulated::ENTRY as TABULATED;
pub(super) use tensor_tree::ENTRY as TENSOR_TREE;
pub(super) use utia::ENTRY as UTIA;
pub(super) use zemax::ENTRY as ZEMAX;

use super::{Brdf, Channels, Presence};
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use std::fmt;
use std::path::Path;

/// The values of a table, one list per channel; each kind of table says what they mean.
#[derive(Clone, Debug)]
enum Planes {
    /// One plane.
    Luminance(Vec<f64>),
    /// R, G, B.
    Rgb([Vec<f64>; 3]),
}

impl Planes {
    fn channels(&self) -> &'static Channels {
        match self {
            Planes::Luminance(_) => &Channels::Luminance,
            Planes::Rgb(_) => &Channels::Rgb,
        }
    }
}

/// Values of a BRDF at some pairs, channels together; NaN without data, or where it breaks its promise to be finite and not
/// negative.
fn values_or_nan(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Vec<f64> {
    let n = brdf.channels().count();
    let mut values = vec![0.0; n * pairs.len()];
    let mut presence = vec![Presence::Missing; pairs.len()];
    brdf.eval_batch(pairs, &mut values, &mut presence);
    for (values, presence) in values.chunks_exact_mut(n).zip(presence) {
        let is_kept = |v: &f64| (0.0..=f64::MAX).contains(v);
        if presence == Presence::Missing || !values.iter().all(is_kept) {
            values.fill(f64::NAN);
        }
    }
    values
}

/// Pairs whose values, `n` together, are NaN.
fn gaps(values: &[f64], n: usize) -> usize {
    values.chunks_exact(n).filter(|v| v[0].is_nan()).count()
}

/// [`values_or_nan`] and the number of pairs without data, but pairs without data have the values of those with light and sensor exchanged, which reciprocity
/// makes equal: for a format without holes.
fn values_or_exchanged(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> (Vec<f64>, usize) {
    let n = brdf.channels().count();
    let mut values = values_or_nan(brdf, pairs);
    let lost: Vec<usize> = (0..pairs.len())
        .filter(|k| values[k * n].is_nan())
        .collect();
    let exchanged: Vec<DirectionPair> = lost.iter().map(|k| pairs[*k].swapped()).collect();
    let found = values_or_nan(brdf, &exchanged);
    for (k, found) in lost.iter().zip(found.chunks_exact(n)) {
        values[k * n..][..n].copy_from_slice(found);
    }
    (values, lost.len())
}

/// Fills what is NaN in a row of values of `n` channels, for a format without holes: by the value before, at the start by the
/// first one there is; by 0, and the answer is false, if there is none.
fn fill_gaps(row: &mut [f64], n: usize) -> bool {
    let first = row.chunks_exact(n).position(|v| !v[0].is_nan());
    let Some(first) = first else {
        row.fill(0.0);
        return false;
    };
    for k in 0..row.len() / n {
        let source = if k < first {
            first
        } else {
            k.saturating_sub(1)
        };
        if row[n * k].is_nan() {
            row.copy_within(n * source..n * (source + 1), n * k);
        }
    }
    true
}

/// Label of a table: the name of its file, or its kind if that has none.
pub(crate) fn label_of(path: &Path, kind: &str) -> String {
    let stem = path.file_stem();
    stem.map_or(kind.into(), |stem| stem.to_string_lossy().into_owned())
}

/// Refuses a table of R, G, B, which `key` names, in a scene of wavelengths.
fn without_wavelengths(
    key: &str,
    table: impl fmt::Display,
    channels: &Channels,
) -> Result<(), ParameterError> {
    if channels.wavelengths().is_none() {
        return Ok(());
    }
    let allowed =
        "a material known by wavelength in a scene of wavelengths: this table holds R, G, B";
    Err(ParameterError::new(key, table, allowed))
}
