//! What kriging is for: few readings anywhere.

use super::common::{Level, errors, levels, model, product, test_pairs};
use super::{form, measure, method};
use gonio::brdf::measured::merl::MerlGrid;
use gonio::brdf::{Brdf, Presence};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics::Measure;
use gonio::schedule::SobolSet;

levels! {
    few_readings_say_more_than_to_a_local_spline: "thorough: more readings";
}

fn pairs() -> Vec<DirectionPair> {
    test_pairs(Measure::Cosine, 20_000)
}

/// Glossy, rough and matte, with and without a Fresnel factor.
fn materials() -> Vec<Box<dyn Brdf>> {
    let texts = [
        ("ggx", "alpha = 0.1"),
        ("ggx", "alpha = 0.3"),
        ("beckmann", "alpha = 0.2"),
        ("ward", "alpha = 0.15"),
        ("oren-nayar", "sigma_deg = 30.0"),
    ];
    texts.iter().map(|(kind, keys)| model(kind, keys)).collect()
}

/// The error of a method from Sobol points in half/difference coordinates.
fn error(
    truth: &dyn Brdf,
    kind: &str,
    keys: &str,
    readings: usize,
    pairs: &[DirectionPair],
) -> f64 {
    let form = form("half-difference", Symmetry::FULL);
    let m = measure(truth, &form, &SobolSet {}, readings);
    let copy = method(kind, keys).reconstruct(&m).unwrap();
    errors(truth, &*copy, pairs).nrmse.unwrap()
}

/// Geometric mean of ratios.
fn mean(ratios: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = ratios.map(f64::ln).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

fn few_readings_say_more_than_to_a_local_spline(level: Level) {
    let pairs = pairs();
    let materials = materials();
    for readings in level.of(vec![64, 250], vec![64, 250, 1000]) {
        let ratio = mean(materials.iter().map(|truth| {
            let of = |kind| error(&**truth, kind, "", readings, &pairs);
            of("kriging") / of("thin-plate")
        }));
        assert!(ratio < 0.2, "{readings}: {ratio}");
    }
}

#[test]
fn errors_fall_over_decades() {
    let pairs = pairs();
    for truth in materials() {
        let errors = [16, 128, 1000].map(|n| error(&*truth, "kriging", "", n, &pairs));
        // An order of a half at least: four times the readings halve the error.
        for pair in errors.windows(2) {
            assert!(pair[1] < pair[0] / 2.8, "{errors:?}");
        }
    }
}

/// More than one system holds: they still say more than a tenth of them.
#[test]
#[ignore = "thorough: ten thousand readings"]
fn readings_beyond_one_system_are_of_use() {
    let pairs = pairs();
    let truth = model("ggx", "alpha = 0.1");
    let [few, many] = [1000, 10_001].map(|n| error(&*truth, "kriging", "fit = false", n, &pairs));
    assert!(many < few / 3.0, "{few} {many}");
}

/// Also where no material of the prior is like it.
#[test]
fn a_prior_helps_while_readings_are_few_and_never_hurts_much() {
    let pairs = pairs();
    let mut all = materials();
    let sgd = "rho_d = 0.1\nrho_s = 0.2\nalpha = 0.05\np = 0.4\nf0 = 0.1\nf1 = -0.05\nkap = 20.0\nlambda = 3.0\n\
               c = 1e-7\nk = 30.0\ntheta0_rad = 0.1";
    let retro = "of = { kind = \"ggx\", alpha = 0.3 }";
    let others = [
        model("shifted-gamma", sgd),
        model("retro-reflective", retro),
        model("test-g", ""),
    ];
    all.extend(others);
    let mut means = Vec::new();
    for readings in [8, 16, 32, 33] {
        let ratios = all.iter().map(|truth| {
            let of = |keys| error(&**truth, "kriging", keys, readings, &pairs);
            of("prior = \"built-in\"") / of("")
        });
        let ratios: Vec<f64> = ratios.collect();
        assert!(ratios.iter().all(|r| *r < 2.0), "{readings}: {ratios:?}");
        means.push(mean(ratios.into_iter()));
    }
    let is_less = means.iter().zip([0.6, 0.9, 1.0]).all(|(m, most)| *m < most);
    assert!(is_less && means[3] == 1.0, "{means:?}");
}

/// A row of a table is interpolated where that is good to 1e-5, and costs less.
#[test]
fn rows_are_what_their_pairs_are() {
    let grid = MerlGrid::RECIPROCAL;
    let form = form("half-difference", Symmetry::FULL);
    for (alpha, readings) in [(0.5, 60), (0.1, 300), (0.03, 300)] {
        let truth = model("ggx", &format!("alpha = {alpha}"));
        let m = measure(&*truth, &form, &SobolSet {}, readings);
        let copy = method("kriging", "").reconstruct(&m).unwrap();
        for (h, d) in product([0, 3, 20, 60, 85], [0, 10, 45, 80]) {
            let cells = (0..90).filter_map(|phi| grid.pair([h, d, phi]));
            let pairs: Vec<DirectionPair> = cells.collect();
            let mut row = vec![0.0; pairs.len()];
            let mut presence = vec![Presence::Missing; pairs.len()];
            copy.eval_row(&pairs, &mut row, &mut presence);
            let (each, _) = copy.values(&pairs);
            for (k, (a, b)) in row.iter().zip(each).enumerate() {
                let off = ((a + 1e-3) / (b + 1e-3)).ln().abs();
                assert!(off < 2e-5, "{alpha} {readings} {h} {d} {k}: {a} {b}");
            }
        }
    }
}
