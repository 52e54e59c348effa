//! The file: three planes of little-endian `f64` and nothing else, 1 990 656 bytes.
//!
//! ```text
//! 3 × plane  f64[phi_v + 48 theta_v + 288 (phi_i + 48 theta_i)]   R, then G, then B
//! ```
//!
//! There is no header: a file is known by its length. Negative values occur where the instrument's
//! noise is larger than the signal, and count as 0, as in the readers of the database's authors; a
//! value that is NaN or infinite, as it is stored or in sr⁻¹, and a number as -999 far outside all others ([`crate::brdf::Marks`])
//! is no data. The writer here
//! marks missing data by NaN.
//!
//! Colours are linear. The absolute scale of the database is not documented; `scale` turns stored
//! values into sr⁻¹.

use super::super::doubts::Doubts;
use super::super::{Planes, fill_gaps, gaps};
use super::{NODES, Utia, pair};
use crate::brdf::{Brdf, Channels, Marks, Presence};
use crate::files;
use crate::geometry::DirectionPair;
use crate::numeric;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

/// Length of a file in bytes.
pub const FILE_LEN: u64 = 3 * 8 * NODES as u64;

/// Pairs the writer evaluates in one batch: those of one light direction.
const ROW: usize = super::DIRECTIONS;

/// Reason why a table could not be read or written. Messages do not name the file; callers do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UtiaError {
    /// The system reported an error.
    #[error("no access to this UTIA table: {0}")]
    Io(#[from] io::Error),
    /// The path is a folder, a pipe or a device.
    #[error("not a regular file")]
    NotAFile,
    /// Another length than a table has.
    #[error(
        "not a UTIA file: found {found} bytes, expected {FILE_LEN} (three planes of 288×288 f64, no header)"
    )]
    Length {
        /// Bytes found.
        found: u64,
    },
    /// A table has colours only.
    #[error("a UTIA table holds R, G, B and no wavelengths")]
    Wavelengths,
    /// A stream goes on after the table.
    #[error("found more data after the {FILE_LEN} bytes of a UTIA table")]
    TooLong,
    /// No node holds data.
    #[error("every value is NaN or infinite: the table holds no data")]
    NoData,
}

/// Checks the length of a file without reading it.
///
/// # Errors
/// [`UtiaError`] if the file cannot be opened, is not a regular file, or has another length.
pub fn check(path: &Path) -> Result<(), UtiaError> {
    open(path).map(drop)
}

fn open(path: &Path) -> Result<File, UtiaError> {
    // Asked by name: a pipe that nobody writes to would not open.
    let meta = std::fs::metadata(path)?;
    if !meta.is_file() {
        return Err(UtiaError::NotAFile);
    }
    let file = files::open(path)?;
    if meta.len() != FILE_LEN {
        return Err(UtiaError::Length { found: meta.len() });
    }
    Ok(file)
}

impl Utia {
    /// Loads a file; `scale` turns its values into sr⁻¹. In luminance one plane is held.
    ///
    /// # Errors
    /// [`UtiaError`].
    pub fn load(path: &Path, scale: f64, channels: Channels) -> Result<Self, UtiaError> {
        Self::load_without(path, scale, channels, None)
    }

    /// Loads a file; `no_reading` is one more number that stands for no reading.
    pub(super) fn load_without(
        path: &Path,
        scale: f64,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Self, UtiaError> {
        Self::read_without(open(path)?, scale, channels, no_reading)
    }

    /// Reads a file's bytes from anywhere; they must end where the table ends.
    ///
    /// # Errors
    /// [`UtiaError`].
    pub fn read(input: impl Read, scale: f64, channels: Channels) -> Result<Self, UtiaError> {
        Self::read_without(input, scale, channels, None)
    }

    fn read_without(
        mut input: impl Read,
        scale: f64,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Self, UtiaError> {
        let mut bytes = Vec::with_capacity(FILE_LEN as usize);
        input.by_ref().take(FILE_LEN).read_to_end(&mut bytes)?;
        if (bytes.len() as u64) < FILE_LEN {
            return Err(UtiaError::Length {
                found: bytes.len() as u64,
            });
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
            Channels::Rgb => Planes::Rgb([plane(), plane(), plane()]),
            Channels::Luminance => {
                // In the order of `numeric::luminance`; NaN in any channel stays NaN.
                let mut sum = plane();
                for value in &mut sum {
                    *value *= numeric::LUMINANCE[0];
                }
                for weight in &numeric::LUMINANCE[1..] {
                    for (sum, value) in sum.iter_mut().zip(plane()) {
                        *sum += weight * value;
                    }
                }
                Planes::Luminance(sum)
            }
            Channels::Wavelengths(_) => return Err(UtiaError::Wavelengths),
        };
        if input.read(&mut [0])? > 0 {
            return Err(UtiaError::TooLong);
        }
        let has_data = match &planes {
            Planes::Luminance(plane) => plane.iter().any(|v| !v.is_nan()),
            Planes::Rgb([r, g, b]) => {
                let nodes = r.iter().zip(g).zip(b);
                nodes.into_iter().any(|((r, g), b)| !(r + g + b).is_nan())
            }
        };
        if has_data {
            Ok(Self::new(planes, doubts))
        } else {
            Err(UtiaError::NoData)
        }
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

/// Tabulates a BRDF and writes it in the format of a UTIA file (scale 1). Where the BRDF has no data
/// or breaks its promise to be finite and not negative, NaN is written. A BRDF in luminance is
/// written as a grey one. Runs on rayon's threads; the bytes do not depend on their number.
///
/// # Errors
/// [`UtiaError::Wavelengths`] of a BRDF by wavelength, and any error of `out`.
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
/// # Ok::<(), gonio::brdf::measured::utia::UtiaError>(())
/// ```
pub fn write_utia(brdf: &dyn Brdf, out: &mut impl Write) -> Result<(), UtiaError> {
    Ok(write_planes(
        &tabulate(brdf)?,
        brdf.channels().count(),
        out,
    )?)
}

/// Writes a file that appears whole or not at all.
///
/// # Errors
/// As [`write_utia`].
pub fn write_utia_file(brdf: &dyn Brdf, path: &Path) -> Result<(), UtiaError> {
    let values = tabulate(brdf)?;
    Ok(files::write_atomically(path, |out| {
        write_planes(&values, brdf.channels().count(), out)
    })?)
}

/// The same file, but pairs without data have the values of the pair before them in it, those at the start of the first that has
/// some. Returns their number.
///
/// # Errors
/// As [`write_utia`], and [`UtiaError::NoData`] of a BRDF without any.
pub fn write_utia_file_filled(brdf: &dyn Brdf, path: &Path) -> Result<usize, UtiaError> {
    let n = brdf.channels().count();
    let mut values = tabulate(brdf)?;
    let filled = gaps(&values, n);
    if !fill_gaps(&mut values, n) {
        return Err(UtiaError::NoData);
    }
    files::write_atomically(path, |out| write_planes(&values, n, out))?;
    Ok(filled)
}

/// Whether a table can hold a BRDF.
///
/// # Errors
/// [`UtiaError::Wavelengths`].
pub fn suits(brdf: &dyn Brdf) -> Result<(), UtiaError> {
    match brdf.channels().wavelengths() {
        Some(_) => Err(UtiaError::Wavelengths),
        None => Ok(()),
    }
}

/// Values of all nodes, channels together; NaN where there is no data.
fn tabulate(brdf: &dyn Brdf) -> Result<Vec<f64>, UtiaError> {
    suits(brdf)?;
    let n = brdf.channels().count();
    let mut values = vec![f64::NAN; n * NODES];
    values
        .par_chunks_mut(n * ROW)
        .enumerate()
        .for_each(|(light, values)| {
            let pairs: Vec<DirectionPair> = (0..ROW).map(|v| pair(ROW * light + v)).collect();
            let mut presence = [Presence::Missing; ROW];
            brdf.eval_batch(&pairs, values, &mut presence);
            for (values, presence) in values.chunks_exact_mut(n).zip(presence) {
                let kept = |v: &f64| (0.0..=f64::MAX).contains(v);
                if presence == Presence::Missing || !values.iter().all(kept) {
                    values.fill(f64::NAN);
                }
            }
        });
    Ok(values)
}

/// The file of `n` interleaved channels, 1 or 3.
fn write_planes(values: &[f64], n: usize, out: &mut impl Write) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(8 * ROW);
    for c in 0..3 {
        for row in values.chunks(n * ROW) {
            bytes.clear();
            let channel = row.iter().skip(c.min(n - 1)).step_by(n);
            bytes.extend(channel.flat_map(|v| v.to_le_bytes()));
            out.write_all(&bytes)?;
        }
    }
    Ok(())
}
