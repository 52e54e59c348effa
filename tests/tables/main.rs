//! Tables of measured BRDFs, by format: the bytes, what is between the nodes, and what is refused. No file is needed: every
//! table is made here.
#![cfg(feature = "experiments")]

#[path = "../common/mod.rs"]
mod common;
mod mdl;
mod merl;
mod rgl;
mod tensor_tree;
mod utia;
mod zemax;

use common::{cosine_pairs, lowest, material, says, table, wavelengths};
use gonio::brdf::measured::TableError;
use gonio::brdf::{Brdf, Channels};
use gonio::formats::{Tabulation, WRITE_TABLE};
use gonio::geometry::DirectionPair;

/// Cosine-distributed pairs of elevations up to 80°.
fn high_pairs(count: usize) -> Vec<DirectionPair> {
    let high = cosine_pairs(1).filter(|p| lowest(p) > 80f64.to_radians().cos());
    high.take(count).collect()
}

/// Root mean square of the differences of all channels over that of the truth, with the light's cosine.
fn nrmse<T: AsRef<[f64]>>(pairs: &[DirectionPair], of: impl Fn(&DirectionPair) -> [T; 2]) -> f64 {
    let [mut sum, mut square] = [0.0; 2];
    for pair in pairs {
        let cos2 = pair.omega_i.cos_theta().powi(2);
        let [truth, found] = of(pair);
        for (t, f) in truth.as_ref().iter().zip(found.as_ref()) {
            sum += cos2 * (t - f).powi(2);
            square += cos2 * t * t;
        }
    }
    (sum / square).sqrt()
}

/// Checks what a stream that cannot be read as a table is refused for.
fn malformed<T: std::fmt::Debug>(read: Result<T, TableError>) -> String {
    match read.unwrap_err() {
        TableError::Malformed(why) => why,
        e => panic!("{e}"),
    }
}

#[test]
fn what_a_table_cannot_hold_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let grey = |nm: &[f64]| material("lambert", "albedo = 0.5", wavelengths(nm));
    let brushed = material("ward", "alpha = [0.1, 0.4]", Channels::Luminance);
    for [name, of_brushed, of_one, of_two] in table(
        "
        merl        | isotropic | no wavelengths | no wavelengths
        utia        |           | no wavelengths | no wavelengths
        rgl         |           |                |
        tensor-tree | isotropic | no wavelengths | no wavelengths
        zemax       | isotropic |                | one wavelength
        mdl         | isotropic |                | one wavelength",
    ) {
        let path = dir.path().join(name);
        let format = WRITE_TABLE.named(name).unwrap();
        let write = WRITE_TABLE.function(&format).unwrap();
        let cases: [(&dyn Brdf, _); 3] = [
            (&*brushed, of_brushed),
            (&*grey(&[632.8]), of_one),
            (&*grey(&[450.0, 550.0]), of_two),
        ];
        // Nothing but a refusal is looked for: the other tables are large.
        for (brdf, part) in cases.into_iter().filter(|(_, part)| !part.is_empty()) {
            let refusal = write(brdf, Tabulation::default(), &path).unwrap_err();
            says(&refusal.to_string(), part);
            assert!(!path.exists(), "{name}");
        }
    }
}
