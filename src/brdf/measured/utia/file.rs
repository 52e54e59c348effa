//! The file: three planes of little-endian `f64` and nothing else, 1 990 656 bytes.
//!
//! ```text
//! 3 × plane  f64[phi_v + 48 theta_v + 288 (phi_i + 48 theta_i)]   R, then G, then B
//! ```
//!
//! There is no header: a file is known by its length. Negative values occur where the instrument's
//! noise is larger than the signal, and count as 0, as in the readers of the database's authors; a
//! value that is NaN or infinite, as it is stored or in sr⁻¹, and a number as -999 far outside all others ([`crate::brdf::Marks`])
//! is no data.
//!
//! Colours are linear. The absolute scale of the database is not documented; `scale` turns stored
//! values into sr⁻¹.

use super::super::doubts::Doubts;
use super::super::{Planes, TableError, fill_gaps, gaps, open_regular, values_or_nan};
use super::{NODES, Utia, pair};
use crate::brdf::{Brdf, Channels, Marks};
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

/// Length of a file in bytes.
pub const FILE_LEN: u64 = 3 * 8 * NODES as u64;

/// Pairs the writer evaluates in one batch: those of one light direction.
const ROW: usize = super::DIRECTIONS;

/// Why wavelengths are refused.
const WAVELENGTHS: &str = "a UTIA table holds R, G, B and no wavelengths";

fn no_access(e: io::Error) -> TableError {
    TableError::Io("no access to this UTIA table", e)
}

fn no_data() -> TableError {
    TableError::NoData("every value is NaN or infinite: the table holds no data".into())
}

fn wrong_length(found: u64) -> TableError {
    TableError::Malformed(format!(
        "not a UTIA file: found {found} bytes, expected {FILE_LEN} (three planes of 288×288 f64, no header)"
    ))
}

/// Opens a file and checks its length.
pub(super) fn open(path: &Path) -> Result<File, TableError> {
    match open_regular(path, no_access)? {
        (file, FILE_LEN) => Ok(file),
        (_, length) => Err(wrong_length(length)),
    }
}

impl Utia {
    /// Reads a file's bytes, which must end where the table ends; `scale` turns its values into sr⁻¹.
    pub fn read(input: impl Read, scale: f64, channels: Channels) -> Result<Self, TableError> {
        Self::read_without(input, scale, channels, None)
    }

    /// [`read`](Self::read) with one more number that stands for no reading.
    pub(super) fn read_without(
        mut input: impl Read,
        scale: f64,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Self, TableError> {
        let mut bytes = Vec::with_capacity(FILE_LEN as usize);
        let mut table = input.by_ref().take(FILE_LEN);
        table.read_to_end(&mut bytes).map_err(no_access)?;
        if (bytes.len() as u64) < FILE_LEN {
            return Err(wrong_length(bytes.len() as u64));
        }
        let stored = bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b));
        let mut stored: Vec<f64> = stored.collect();
        let mut doubts = Doubts::take(&mut stored, Marks::default(), no_reading);
        doubts.look_for_zeros(stored.iter().copied().take(NODES));
        let mut planes = stored.chunks_exact(NODES);
        let mut plane = || -> Vec<f64> {
            let plane = planes.next().unwrap_or_default();
            plane.iter().map(|v| held(*v, scale)).collect()
        };
        let planes = match channels {
            Channels::Rgb => vec![plane(), plane(), plane()],
            Channels::Luminance => {
                // In the order of `numeric::luminance`; NaN in any channel stays NaN. Whatever is added to −0 keeps its bits.
                let mut sum = vec![-0.0; NODES];
                for weight in numeric::LUMINANCE {
                    for (sum, value) in sum.iter_mut().zip(plane()) {
                        *sum += weight * value;
                    }
                }
                vec![sum]
            }
            Channels::Wavelengths(_) => return Err(TableError::Channels(WAVELENGTHS)),
        };
        if input.read(&mut [0]).map_err(no_access)? > 0 {
            let message = format!("found more data after the {FILE_LEN} bytes of a UTIA table");
            return Err(TableError::Malformed(message));
        }
        let has_data = |node: usize| planes.iter().all(|plane| !plane[node].is_nan());
        if !(0..NODES).any(has_data) {
            return Err(no_data());
        }
        Ok(Self {
            planes,
            symmetry: Symmetry::NONE,
            doubts,
        })
    }
}

/// A stored value in sr⁻¹, NaN if it is no data.
fn held(stored: f64, scale: f64) -> f64 {
    let held = stored.max(0.0) * scale;
    if stored.is_finite() && held.is_finite() {
        held
    } else {
        f64::NAN
    }
}

/// Tabulates a BRDF and writes it in the format of a UTIA file (scale 1): NaN where the BRDF has no data or breaks its promise to
/// be finite and not negative, one in luminance as a grey one.
///
/// # Errors
/// [`TableError::Unsuited`] of a BRDF by wavelength, and any error of `out`.
///
/// ```
/// use gonio::brdf::measured::utia::{FILE_LEN, Utia, write_utia};
/// use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
/// use gonio::geometry::DirectionPair;
/// let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
/// let mut bytes = Vec::new();
/// write_utia(&grey, &mut bytes)?;
/// assert_eq!(bytes.len() as u64, FILE_LEN);
/// let table = Utia::read(bytes.as_slice(), 1.0, Channels::Luminance)?;
/// let [inside, beyond] = [1.2, 1.4].map(|t| DirectionPair::from_spherical(t, 0.0, 0.5, 2.0));
/// assert!((table.luminance(&inside).unwrap() * std::f64::consts::PI - 0.5).abs() < 1e-14);
/// assert_eq!(table.luminance(&beyond), None);
/// # Ok::<(), gonio::brdf::measured::TableError>(())
/// ```
pub fn write_utia(brdf: &dyn Brdf, out: &mut impl Write) -> Result<(), TableError> {
    tabulate(brdf, false)?.0.write(out).map_err(no_access)
}

/// Pairs that the table of a BRDF is made of.
///
/// # Errors
/// [`TableError::Unsuited`] of a BRDF by wavelength.
pub fn table_pairs(brdf: &dyn Brdf) -> Result<u64, TableError> {
    match brdf.channels().wavelengths() {
        Some(_) => Err(TableError::Unsuited(WAVELENGTHS.into())),
        None => Ok(NODES as u64),
    }
}

/// Tabulates a BRDF. If `fill`, pairs without data have the values of the pair before them in the file, those at the start of the
/// first that has some; also returns their number, else 0.
/// Errors: as [`table_pairs`], and [`TableError::NoData`] if there is none to fill with.
pub(crate) fn tabulate(brdf: &dyn Brdf, fill: bool) -> Result<(Planes, usize), TableError> {
    table_pairs(brdf)?;
    let n = brdf.channels().count();
    let row = |light: usize| {
        let pairs: Vec<DirectionPair> = (0..ROW).map(|v| pair(ROW * light + v)).collect();
        values_or_nan(brdf, &pairs)
    };
    let rows: Vec<Vec<f64>> = (0..ROW).into_par_iter().map(row).collect();
    let mut values = rows.concat();
    let filled = if fill { gaps(&values, n) } else { 0 };
    if fill && !fill_gaps(&mut values, n) {
        return Err(no_data());
    }
    let planes = Planes {
        head: Vec::new(),
        stored: |_, v| v,
        n,
        values,
    };
    Ok((planes, filled))
}
