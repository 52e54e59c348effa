//! Measured BSDFs of MDL: the bytes, and what is refused.
#![cfg(feature = "experiments")]

mod common;

use common::{ISOTROPIC, made, material};
use gonio::brdf::measured::mdl::{CELLS, write_mdl};
use gonio::brdf::{Brdf, Channels, Presence, Wavelengths};
use gonio::geometry::DirectionPair;
use std::f64::consts::{FRAC_PI_2, PI};

fn values(brdf: &dyn Brdf, pair: &DirectionPair) -> Vec<f64> {
    let mut out = vec![0.0; brdf.channels().count()];
    assert_eq!(brdf.eval(pair, &mut out), Presence::Present, "{pair:?}");
    out
}

#[test]
fn an_mbsdf_has_a_header_and_the_values_of_cells() {
    let ggx = material("ggx", "alpha = 0.3", Channels::Rgb);
    let mut bytes = Vec::new();
    write_mdl(&*ggx, &mut bytes).unwrap();
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
    for [i, o, d] in [
        [0, 0, 0],
        [10, 10, m - 1],
        [30, 31, 178],
        [89, 40, 3],
        [5, 77, 90],
    ] {
        let theta = |k: usize| FRAC_PI_2 * (k as f64 + 0.5) / n as f64;
        let delta = PI * (d as f64 + 0.5) / m as f64;
        let truth = values(
            &*ggx,
            &DirectionPair::from_spherical(theta(i), 0.4 + delta, theta(o), 0.4),
        );
        for (c, want) in truth.into_iter().enumerate() {
            let found = f32::from_le_bytes(word(3 + 3 * ((i * n + o) * m + d) + c));
            assert!((f64::from(found) / want - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn what_it_cannot_hold_is_refused() {
    let mut bytes = Vec::new();
    let ward = material("ward", "alpha = [0.1, 0.4]", Channels::Luminance);
    let told = write_mdl(&*ward, &mut bytes).unwrap_err().to_string();
    assert!(told.contains("isotropic"), "{told}");
    let at = |nm: &[f64]| {
        let nm = Wavelengths::new(nm).unwrap();
        material("lambert", "albedo = 0.5", Channels::Wavelengths(nm))
    };
    let told = write_mdl(&*at(&[450.0, 550.0]), &mut bytes)
        .unwrap_err()
        .to_string();
    assert!(told.contains("one wavelength"), "{told}");
    assert!(bytes.is_empty());
    // One wavelength is a line of the header.
    write_mdl(&*at(&[632.8]), &mut bytes).unwrap();
    let mark = b"\nwavelength_nm=\"632.8\"\n";
    assert!(bytes.windows(mark.len()).any(|w| w == mark));
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
    let mut bytes = Vec::new();
    write_mdl(&sided, &mut bytes).unwrap();
    let [n, m] = CELLS;
    let body = &bytes[bytes.len() - 4 * n * n * m..];
    for [i, o, d] in [[0, 0, 0], [3, 80, 9], [80, 3, m - 1]] {
        let at = 4 * ((i * n + o) * m + d);
        let found = f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
        let light = FRAC_PI_2 * (i as f64 + 0.5) / n as f64;
        assert!(
            (f64::from(found) - light - 0.15).abs() < 1e-6,
            "{found} {light}"
        );
    }
}
