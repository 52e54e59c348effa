//! Measured tables, and materials converted into tables, on rayon's threads: what is written does not depend on their number.

mod doubts;
mod error;
mod format;
pub mod mdl;
pub mod merl;
pub mod rgl;
mod specs;
mod tabulated;
pub mod tensor_tree;
pub mod utia;
pub mod zemax;

pub use self::{
    merl::MerlSpec, rgl::RglSpec, tensor_tree::TensorTreeSpec, utia::UtiaSpec, zemax::ZemaxSpec,
};
pub use error::TableError;
pub use format::{FileFormat, ReadTable, TablePairs, Tabulation, WriteTable};
pub use tabulated::TabulatedSpec;

use format::write_file;

use super::{Brdf, BrdfSpec, Channels, Presence};
use crate::error::ParameterError;
use crate::files;
use crate::geometry::DirectionPair;
use crate::registry::Entry;
use rayon::prelude::*;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Every file format of tables.
pub(crate) const FORMATS: [FileFormat; 6] = [
    merl::FORMAT,
    utia::FORMAT,
    rgl::FORMAT,
    tensor_tree::FORMAT,
    zemax::FORMAT,
    mdl::FORMAT,
];

/// The materials that are tables: of each format that is read, and of none.
pub(super) fn entries() -> impl Iterator<Item = Entry<dyn BrdfSpec>> {
    let of_files = FORMATS.into_iter().filter_map(|format| format.material);
    of_files.chain([tabulated::ENTRY])
}

/// Values of a channel that are written at a time.
const PART: usize = 360;

/// Opens a table that is a regular file; also its length.
fn open_regular(
    path: &Path,
    no_access: fn(io::Error) -> TableError,
) -> Result<(File, u64), TableError> {
    // By the name of the file: opening a pipe without a writer would block.
    let meta = std::fs::metadata(path).map_err(no_access)?;
    if !meta.is_file() {
        return Err(TableError::Malformed("not a regular file".into()));
    }
    Ok((files::open(path).map_err(no_access)?, meta.len()))
}

/// Values of a BRDF at some pairs, channels together; NaN without data, or where it breaks its promise to be finite and not
/// negative.
fn values_or_nan(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Vec<f64> {
    let (values, presence) = brdf.values(pairs);
    or_nan(values, &presence)
}

/// [`values_or_nan`] of the pairs of a row, see [`Brdf::eval_row`].
fn row_or_nan(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Vec<f64> {
    let mut values = vec![0.0; brdf.channels().count() * pairs.len()];
    let mut presence = vec![Presence::Missing; pairs.len()];
    brdf.eval_row(pairs, &mut values, &mut presence);
    or_nan(values, &presence)
}

fn or_nan(mut values: Vec<f64>, presence: &[Presence]) -> Vec<f64> {
    let n = values.len() / presence.len().max(1);
    for (values, presence) in values.chunks_exact_mut(n.max(1)).zip(presence) {
        let is_kept = |v: &f64| (0.0..=f64::MAX).contains(v);
        if *presence == Presence::Missing || !values.iter().all(is_kept) {
            values.fill(f64::NAN);
        }
    }
    values
}

/// Pairs whose values, `n` together, are NaN.
fn gaps(values: &[f64], n: usize) -> usize {
    values.chunks_exact(n).filter(|v| v[0].is_nan()).count()
}

/// [`values_or_nan`], but pairs without data have the values of those with light and sensor exchanged, which reciprocity makes
/// equal: for a format without holes. Also returns their number.
fn values_or_exchanged(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> (Vec<f64>, usize) {
    let n = brdf.channels().count();
    let mut values = values_or_nan(brdf, pairs);
    let lost = (0..pairs.len()).filter(|k| values[k * n].is_nan());
    let lost: Vec<usize> = lost.collect();
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

/// Checks that a `table` of isotropic materials can hold a BRDF; the sentence `wavelengths` refuses one of more than `most` of them.
fn suits_isotropic(
    brdf: &dyn Brdf,
    table: &str,
    wavelengths: &str,
    most: usize,
) -> Result<(), TableError> {
    if !brdf.symmetry().isotropic {
        return Err(TableError::Unsuited(format!(
            "{table} holds isotropic materials; this one changes as the sample is turned"
        )));
    }
    match brdf.channels().wavelengths() {
        Some(w) if w.nm().len() > most => Err(TableError::Unsuited(wavelengths.into())),
        _ => Ok(()),
    }
}

/// The values of a file in R, G and B, one plane after the other.
pub(crate) struct Planes {
    /// What is before them.
    head: Vec<u8>,
    /// The number that stands for a value of a channel.
    stored: fn(usize, f64) -> f64,
    /// Channels, 1 or 3.
    n: usize,
    /// Channels together. The file has all of R before any of G; holding every value costs less than asking the BRDF three times.
    values: Vec<f64>,
}

impl Planes {
    /// Writes the file.
    pub(crate) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(&self.head)?;
        let mut bytes = Vec::new();
        for c in 0..3 {
            for part in self.values.chunks(self.n * PART) {
                bytes.clear();
                let channel = part.iter().skip(c.min(self.n - 1)).step_by(self.n);
                bytes.extend(channel.flat_map(|v| (self.stored)(c, *v).to_le_bytes()));
                out.write_all(&bytes)?;
            }
        }
        Ok(())
    }
}

/// The rows of a table, and the number of pairs without data in all of them. Of each, `row` gives the values, whether it has data,
/// and the number of its pairs without. A sentence calls their nodes a `place`.
fn rows(
    count: usize,
    place: &str,
    row: impl Fn(usize) -> (Vec<f64>, bool, usize) + Sync + Send,
) -> Result<(Vec<Vec<f64>>, usize), TableError> {
    let rows: Vec<_> = (0..count).into_par_iter().map(row).collect();
    if !rows.iter().any(|(_, has_data, _)| *has_data) {
        let message = format!("this material has no data at any {place} of the table");
        return Err(TableError::NoData(message));
    }
    let lost = rows.iter().map(|(.., lost)| lost).sum();
    Ok((rows.into_iter().map(|(values, ..)| values).collect(), lost))
}

/// The nodes around a place, and their weights; those beyond an end have the end's.
fn around(nodes: &[f64], x: f64) -> [(usize, f64); 2] {
    let Some(last) = nodes.len().checked_sub(2) else {
        return [(0, 1.0), (0, 0.0)];
    };
    let low = nodes
        .partition_point(|n| *n < x)
        .saturating_sub(1)
        .min(last);
    let t = ((x - nodes[low]) / (nodes[low + 1] - nodes[low])).clamp(0.0, 1.0);
    [(low, 1.0 - t), (low + 1, t)]
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
