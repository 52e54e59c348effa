//! Readings that are known to be uncertain.

use super::common::{Level, levels, product, test_pairs};
use super::layouts::{models, readings_of, scattered, sheets};
use super::method;
use super::uncertainty::err;
use gonio::brdf::Brdf;
use gonio::measurement::Measurement;
use gonio::metrics::{self, Measure};

levels! {
    known_noise_is_smoothed: "thorough: every model";
}

/// What a model has at a layout with this relative noise, whose uncertainty is told.
fn noisy(model: &dyn Brdf, angles: &[[f64; 3]], noise: f64) -> Measurement {
    let mut m = readings_of(model, angles);
    m.details.as_mut().unwrap().type_a = m.values.iter().map(|v| noise * v).collect();
    err(&mut m, 5);
    m.values.iter_mut().for_each(|v| *v = v.max(0.0));
    m
}

/// To miss readings by their noise never costs much, and wins where they are noisy.
fn known_noise_is_smoothed(level: Level) {
    let pairs = test_pairs(Measure::Cosine, 2000);
    let layouts = [sheets(&[15.0, 30.0, 45.0, 60.0], 8, 12), scattered(500)];
    let mut gains = Vec::new();
    for (name, model) in models().into_iter().step_by(level.of(9, 1)) {
        let truth = metrics::evaluate(&*model, &pairs);
        for (angles, noise) in product(&layouts, [0.0, 0.02, 0.3]) {
            let m = noisy(&*model, angles, noise);
            for kind in ["thin-plate", "sheets"] {
                let error = |keys: &str| {
                    let brdf = method(kind, keys).reconstruct(&m).unwrap();
                    let values = metrics::evaluate(&*brdf, &pairs);
                    let errors = metrics::compare(&pairs, &truth, &values);
                    errors.log_relative.unwrap()
                };
                let [plain, missed] = ["", "noise = true"].map(error);
                if noise == 0.0 {
                    assert_eq!(plain, missed, "{name} {kind}");
                } else {
                    let what = || format!("{name} {kind} {noise}: {missed} of {plain}");
                    assert!(missed <= 1.02 * plain + 1e-6, "{}", what());
                }
                if noise == 0.3 {
                    gains.push(missed / plain);
                }
            }
        }
    }
    let mean = gains.iter().sum::<f64>() / gains.len() as f64;
    assert!(mean < 0.8, "{mean}");
}
