//! Any isotropic BRDF as a Zemax table.

use super::file::degrees;
use super::{Angles, Zemax};
use crate::brdf::measured::doubts::Doubts;
use crate::brdf::measured::{TableError, fill_gaps, gaps, rows, suits_isotropic, values_or_nan};
use crate::brdf::{Brdf, Channels};
use crate::geometry::DirectionPair;
use crate::numeric::XYZ;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::io::{self, Write};

/// The last polar angle of the light, degrees.
const LAST_DEG: f64 = 89.0;

/// The largest angle from the mirror direction at which a sensor can be, degrees.
const FARTHEST_DEG: f64 = 90.0 + LAST_DEG;

/// Steps of the polar angle of the light, of the azimuth from 0° to 180°, and of the angle from the mirror direction.
pub type Level = [usize; 3];

/// Those that a tolerance chooses from, the usual one first.
pub const LEVELS: [Level; 3] = [[36, 24, 60], [72, 48, 120], [144, 96, 240]];

/// Nodes. Lights are equally far apart, angles from the mirror direction in proportion to their squares: lobes are narrow.
fn angles([theta_i, azimuth, radial]: Level, mirrored: bool) -> Angles {
    let list = |steps: usize, angle: &dyn Fn(f64) -> f64| {
        // To what is written.
        let tidy = |x: f64| (x * 1e6).round() / 1e6;
        let all = (0..=steps).map(|k| tidy(angle(k as f64 / steps as f64)).to_radians());
        all.collect::<Vec<f64>>()
    };
    let turn = if mirrored { 1 } else { 2 };
    Angles {
        rotation: vec![0.0],
        theta_i: list(theta_i, &|x| LAST_DEG * x),
        azimuth: list(turn * azimuth, &|x| 180.0 * turn as f64 * x),
        radial: list(radial, &|x| FARTHEST_DEG * x * x),
        mirrored,
    }
}

/// Pairs that are evaluated.
///
/// # Errors
/// [`TableError::Unsuited`] of a BRDF that is not isotropic, or of several wavelengths.
pub fn table_pairs(brdf: &dyn Brdf, level: Level) -> Result<u64, TableError> {
    let wavelengths = "a Zemax table holds luminance, R, G, B or one wavelength";
    suits_isotropic(brdf, "a Zemax table", wavelengths, 1)?;
    Ok(angles(level, brdf.symmetry().bilateral).count() as u64)
}

/// Tabulates a BRDF. A sensor below the horizon has 0; one without data has what the sensor before it has, towards the
/// mirror direction, or else the next that has some: the format has no holes. Also returns the number of sensors without data.
///
/// # Errors
/// As [`table_pairs`], and [`TableError::NoData`] of a BRDF without any.
pub fn tabulate(brdf: &dyn Brdf, level: Level) -> Result<(Zemax, usize), TableError> {
    table_pairs(brdf, level)?;
    let n = brdf.channels().count();
    let angles = angles(level, brdf.symmetry().bilateral);
    let row = angles.radial.len();
    let (rows, lost) = rows(angles.count() / row, "node", |r| {
        let pairs: Vec<DirectionPair> = (r * row..(r + 1) * row).map(|k| angles.pair(k)).collect();
        let mut values = values_or_nan(brdf, &pairs);
        let below = |k: usize| !pairs[k].is_above_horizon();
        for k in (0..row).filter(|k| below(*k)) {
            values[n * k..n * (k + 1)].fill(f64::NAN);
        }
        let lost = gaps(&values, n) - (0..row).filter(|k| below(*k)).count();
        let has_data = fill_gaps(&mut values, n);
        for k in (0..row).filter(|k| below(*k)) {
            values[n * k..n * (k + 1)].fill(0.0);
        }
        (values, has_data, lost)
    })?;
    let plane = |c: usize| {
        let values = rows.iter().flatten();
        values.skip(c).step_by(n).copied().collect::<Vec<f64>>()
    };
    let table = Zemax {
        values: (0..n).flat_map(plane).collect(),
        channels: brdf.channels().clone(),
        angles,
        doubts: Doubts::default(),
    };
    Ok((table, lost))
}

/// The albedo of an incidence, by trapezoids over the angles about the mirror direction.
fn total(angles: &Angles, light: usize, values: &[f64]) -> f64 {
    let (n, m) = (angles.radial.len(), angles.azimuth.len());
    let width = |nodes: &[f64], k: usize| {
        let [low, high] = [k.saturating_sub(1), (k + 1).min(nodes.len() - 1)];
        0.5 * (nodes[high] - nodes[low])
    };
    let node = |k: usize| {
        let cos = angles.pair(light * n * m + k).omega_o.cos_theta().max(0.0);
        let area = width(&angles.radial, k % n) * width(&angles.azimuth, k / n);
        values[k] * cos * angles.radial[k % n].sin() * area
    };
    let sum: f64 = (0..n * m).map(node).sum();
    let covered = angles.azimuth[m - 1] - angles.azimuth[0];
    sum * TAU / if covered > 0.0 { covered } else { PI }
}

impl Zemax {
    /// Writes the text. Values have seven digits.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let angles = &self.angles;
        let symmetry = if angles.mirrored {
            "PlaneSymmetrical"
        } else {
            "Asymmetrical"
        };
        let is_coloured = self.channels == Channels::Rgb;
        let content = if is_coloured { "XYZ" } else { "Monochrome" };
        writeln!(out, "# tabulated by gonio {}", env!("CARGO_PKG_VERSION"))?;
        if let Some(w) = self.channels.wavelengths() {
            writeln!(out, "# at {} nm", w.nm()[0])?;
        }
        writeln!(
            out,
            "Source Measured\nSymmetry {symmetry}\nSpectralContent {content}\nScatterType BRDF\nSampleRotation 1\n0"
        )?;
        for (key, list) in [
            ("AngleOfIncidence", &angles.theta_i),
            ("ScatterAzimuth", &angles.azimuth),
            ("ScatterRadial", &angles.radial),
        ] {
            writeln!(out, "{key} {}\n{}", list.len(), degrees(list))?;
        }
        let planes: Vec<&[f64]> = self.values.chunks_exact(angles.count()).collect();
        match planes[..] {
            [r, g, b] if is_coloured => {
                let names = ["TristimulusX", "TristimulusY", "TristimulusZ"];
                for (c, name) in names.into_iter().enumerate() {
                    let of = |k: usize| (XYZ * DVec3::new(r[k], g[k], b[k]))[c];
                    let plane: Vec<f64> = (0..angles.count()).map(of).collect();
                    self.write_block(name, &plane, out)?;
                }
                Ok(())
            }
            _ => self.write_block("Monochrome", &self.values, out),
        }
    }

    fn write_block(&self, name: &str, plane: &[f64], out: &mut impl Write) -> io::Result<()> {
        let angles = &self.angles;
        writeln!(out, "\n{name}\nDataBegin")?;
        let lights = plane.chunks_exact(angles.azimuth.len() * angles.radial.len());
        for (light, values) in lights.enumerate() {
            writeln!(out, "TIS {:.6}", total(angles, light, values))?;
            for row in values.chunks_exact(angles.radial.len()) {
                let row: Vec<String> = row.iter().map(|v| format!("{v:.6e}")).collect();
                writeln!(out, "{}", row.join("\t"))?;
            }
        }
        writeln!(out, "DataEnd")
    }
}
