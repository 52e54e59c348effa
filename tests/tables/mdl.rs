//! Measured BSDFs of MDL: the bytes.

use crate::common::{ISOTROPIC, made, material, near, present, wavelengths};
use gonio::brdf::measured::mdl::{CELLS, tabulate, write_mdl};
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::DirectionPair;
use std::f64::consts::{FRAC_PI_2, PI};

/// The bytes of the table of a BRDF.
fn mbsdf(brdf: &dyn Brdf) -> Vec<u8> {
    let (values, _) = tabulate(brdf).unwrap();
    let mut bytes = Vec::new();
    write_mdl(&values, brdf.channels(), &mut bytes).unwrap();
    bytes
}

#[test]
fn an_mbsdf_has_a_header_and_the_values_of_cells() {
    let ggx = material("ggx", "alpha = 0.3", Channels::Rgb);
    let bytes = mbsdf(&*ggx);
    let mark = b"\nMBSDF_DATA=\n";
    let start = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let header = std::str::from_utf8(&bytes[..start]).unwrap();
    let mut lines = header.lines();
    assert_eq!(lines.next(), Some("NVIDIA ARC MBSDF V1"));
    assert!(lines.next().unwrap().starts_with("generator=\"gonio "));
    let body = &bytes[start..];
    let word = |k: usize| -> [u8; 4] { body[4 * k..4 * k + 4].try_into().unwrap() };
    let [n, m] = CELLS;
    let sizes = [0, 1, 2].map(|k| u32::from_le_bytes(word(k)) as usize);
    assert_eq!(sizes, [1, n, m]);
    assert_eq!(body.len(), 12 + 4 * 3 * n * n * m);
    let cells = [[0, 0, 0], [10, 10, m - 1], [30, 31, 178]];
    for [i, o, d] in cells.into_iter().chain([[89, 40, 3], [5, 77, 90]]) {
        let theta = |k: usize| FRAC_PI_2 * (k as f64 + 0.5) / n as f64;
        let delta = PI * (d as f64 + 0.5) / m as f64;
        let pair = DirectionPair::from_spherical(theta(i), 0.4 + delta, theta(o), 0.4);
        for (c, want) in present(&*ggx, &pair).into_iter().enumerate() {
            let found = f32::from_le_bytes(word(3 + 3 * ((i * n + o) * m + d) + c));
            near(f64::from(found) / want, 1.0, 1e-6, [i, o, d, c]);
        }
    }
    // One wavelength is a line of the header.
    let one = material("lambert", "albedo = 0.5", wavelengths(&[632.8]));
    let bytes = mbsdf(&*one);
    let line = b"\nwavelength_nm=\"632.8\"\n";
    assert!(bytes.windows(line.len()).any(|w| w == line));
}

/// A material whose two sides differ: the table has one cell for both, their mean.
#[test]
fn two_sides_have_one_mean() {
    let sided = made(ISOTROPIC, |pair| {
        let turn = pair.omega_o.phi() - pair.omega_i.phi();
        // Not reciprocal either: light and sensor have places of their own.
        let side = if turn.sin() > 0.0 { 0.05 } else { 0.25 };
        Some([pair.omega_i.theta() + side])
    });
    let bytes = mbsdf(&sided);
    let [n, m] = CELLS;
    let body = &bytes[bytes.len() - 4 * n * n * m..];
    for [i, o, d] in [[0, 0, 0], [3, 80, 9], [80, 3, m - 1]] {
        let at = 4 * ((i * n + o) * m + d);
        let found = f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
        let light = FRAC_PI_2 * (i as f64 + 0.5) / n as f64;
        near(f64::from(found) - light, 0.15, 1e-6, [i, o, d]);
    }
}
