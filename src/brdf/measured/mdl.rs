//! Isotropic BRDFs as measured BSDFs of the Material Definition Language (NVIDIA), which Omniverse and Iray read.
//!
//! ```text
//! NVIDIA ARC MBSDF V1
//! key="value"
//! MBSDF_DATA=
//! u32      0: one f32 a cell, 1: three (R, G, B)
//! u32 n    cells of theta
//! u32 m    cells of delta phi
//! f32[]    at (theta_i n + theta_o) m + delta phi
//! ```
//!
//! Numbers are little-endian. A cell holds f_r in sr⁻¹ at its middle: theta over [0, π/2), the angle between the azimuths of
//! light and sensor over [0, π], where π is the mirror direction. Layout and lines are those that open readers of the format
//! expect; that values are without a cosine was inferred, and no program that renders them was run.

use super::{
    FileFormat, TableError, fill_gaps, rows, suits_isotropic, values_or_exchanged, write_file,
};
use crate::brdf::{Brdf, Channels};
use crate::geometry::DirectionPair;
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::{self, Write};

/// Cells of theta and of delta phi: one degree each.
pub const CELLS: [usize; 2] = [90, 180];

/// Pairs that are evaluated.
///
/// # Errors
/// [`TableError::Unsuited`] of a BRDF that is not isotropic, or of several wavelengths.
pub fn table_pairs(brdf: &dyn Brdf) -> Result<u64, TableError> {
    let wavelengths = "an MBSDF table holds luminance, R, G, B or one wavelength";
    suits_isotropic(brdf, "an MBSDF table", wavelengths, 1)?;
    Ok((sides(brdf).len() * CELLS[0] * CELLS[0] * CELLS[1]) as u64)
}

/// Sides of the plane of incidence that are evaluated: the table has one for both.
fn sides(brdf: &dyn Brdf) -> &'static [f64] {
    match brdf.symmetry().bilateral {
        true => &[1.0],
        false => &[1.0, -1.0],
    }
}

/// Puts the mean of two values, or the one that is known, in place of the first.
fn meet(a: &mut f64, b: f64) {
    *a = match (a.is_nan(), b.is_nan()) {
        (true, _) => b,
        (false, true) => *a,
        (false, false) => 0.5 * (*a + b),
    };
}

/// Tabulates a BRDF, channels together, the mean of both sides of the plane of incidence. A cell without data has what it has
/// with light and sensor exchanged, else what the cell nearer to retro-reflection has, or, if there is none, the nearest one; 0
/// where a pair of elevations has no data at all. Also returns the number of pairs without data.
///
/// # Errors
/// As [`table_pairs`], and [`TableError::NoData`] of a BRDF without any.
pub fn tabulate(brdf: &dyn Brdf) -> Result<(Vec<f64>, usize), TableError> {
    table_pairs(brdf)?;
    let n = brdf.channels().count();
    let [elevations, azimuths] = CELLS;
    let row = |r: usize| {
        let theta = |k: usize| FRAC_PI_2 * (k as f64 + 0.5) / elevations as f64;
        let (mut values, mut lost) = (Vec::new(), 0);
        for side in sides(brdf) {
            let pairs = (0..azimuths).map(|k| {
                let phi = side * PI * (k as f64 + 0.5) / azimuths as f64;
                let [light, sensor] = [r / elevations, r % elevations].map(theta);
                DirectionPair::from_spherical(light, 0.0, sensor, phi)
            });
            let (found, more) = values_or_exchanged(brdf, &pairs.collect::<Vec<_>>());
            lost += more;
            match values.is_empty() {
                true => values = found,
                false => values.iter_mut().zip(found).for_each(|(a, b)| meet(a, b)),
            }
        }
        let has_data = fill_gaps(&mut values, n);
        (values, has_data, lost)
    };
    let (rows, lost) = rows(elevations * elevations, "cell", row)?;
    Ok((rows.concat(), lost))
}

/// Writes the values of a BRDF of some channels, as [`tabulate`] makes them.
///
/// ```
/// use gonio::brdf::measured::mdl::{tabulate, write_mdl};
/// use gonio::brdf::{Channels, Lambert, Spectrum};
/// let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
/// let (values, _) = tabulate(&grey)?;
/// let mut bytes = Vec::new();
/// write_mdl(&values, &Channels::Luminance, &mut bytes).unwrap();
/// assert!(bytes.starts_with(b"NVIDIA ARC MBSDF V1\n"));
/// let last = f32::from_le_bytes(*bytes.last_chunk().unwrap());
/// assert_eq!(last, (0.5 / std::f64::consts::PI) as f32);
/// # Ok::<(), gonio::brdf::measured::TableError>(())
/// ```
pub fn write_mdl(values: &[f64], channels: &Channels, out: &mut impl Write) -> io::Result<()> {
    let version = env!("CARGO_PKG_VERSION");
    writeln!(out, "NVIDIA ARC MBSDF V1\ngenerator=\"gonio {version}\"")?;
    if let Some(w) = channels.wavelengths() {
        writeln!(out, "wavelength_nm=\"{}\"", w.nm()[0])?;
    }
    writeln!(out, "MBSDF_DATA=")?;
    let kind = u32::from(*channels == Channels::Rgb);
    for number in [kind, CELLS[0] as u32, CELLS[1] as u32] {
        out.write_all(&number.to_le_bytes())?;
    }
    for value in values {
        out.write_all(&(*value as f32).to_le_bytes())?;
    }
    Ok(())
}

/// Isotropic tables over elevations and the angle between azimuths, of the Material Definition Language.
pub(super) const FORMAT: FileFormat = FileFormat {
    name: "mdl",
    extensions: &["mbsdf"],
    summary: "isotropic, over elevations, for MDL (Omniverse, Iray); luminance, R, G, B or one wavelength",
    write: Some(|brdf, _, path| {
        let (values, filled) = tabulate(brdf)?;
        write_file(path, filled, |out| write_mdl(&values, brdf.channels(), out))
    }),
    pairs: Some(|brdf, _| table_pairs(brdf)),
    ..FileFormat::NONE
};
