//! Fits of models: they are found again, and what is not determined is said.

use super::common::{Level, errors, levels, model, near, says, table, test_pairs};
use super::{form, measure, method};
use gonio::brdf::{self, Brdf, Channels};
use gonio::geometry::Symmetry;
use gonio::measurement::Measurement;
use gonio::metrics::Measure;
use gonio::reconstruct::{Fit, Readings, Reconstruct, ReconstructError};
use gonio::registry;
use gonio::sampling::Random;
use gonio::schedule::SobolSet;

levels! {
    every_model_can_be_fitted: "thorough: every example of every model";
}

fn readings(truth: &dyn Brdf, count: usize) -> Measurement {
    let form = form("half-difference", Symmetry::FULL);
    measure(truth, &form, &SobolSet {}, count)
}

fn error(truth: &dyn Brdf, copy: &dyn Brdf) -> f64 {
    let pairs = test_pairs(Measure::Lobe, 10_000);
    errors(truth, copy, &pairs).nrmse.unwrap()
}

/// Readings of a model, and the same kind with other numbers to begin with.
#[test]
fn a_model_is_found_again_from_few_readings() {
    for [kind, truth, start] in table(
        r#"
        ggx | alpha = 0.15 | kind = "ggx", alpha = 0.5
        ggx | alpha = 0.02 | kind = "ggx", alpha = 0.3
        beckmann | alpha = 0.2 | kind = "beckmann"
        ward | rho_d = 0.3\nrho_s = 0.2\nalpha = 0.1 | kind = "ward"
        phong | rho_d = 0.2\nrho_s = 0.5\nexponent = 80.0 | kind = "phong"
        oren-nayar | albedo = 0.4\nsigma_deg = 25.0 | kind = "oren-nayar""#,
    ) {
        let truth = model(kind, truth);
        let fit = method("fit", &format!("model = {{ {start} }}"));
        for count in [16, 100] {
            let copy = fit.reconstruct(&readings(&*truth, count)).unwrap();
            let error = error(&*truth, &*copy);
            near(error, 0.0, 1e-4, (kind, count, copy.remarks()));
        }
    }
}

/// Every example of every model that has free numbers: none is lost, whatever its kind of number.
fn every_model_can_be_fitted(level: Level) {
    let mut fitted = 0;
    // Values that are means over random paths, which other numbers draw anew, have no fit to their digits.
    let random = ["smith-multiple", "micro-surface"];
    let formulas = brdf::all().into_iter();
    for entry in formulas.filter(|entry| !random.contains(&entry.kind)) {
        for text in entry.examples.iter().take(level.of(1, usize::MAX)) {
            let Ok(spec) = registry::read_text(&entry, text) else {
                continue;
            };
            let Ok(truth) = spec.build(Channels::Luminance) else {
                continue;
            };
            let form = form("half-difference", truth.symmetry());
            let m = measure(&*truth, &form, &SobolSet {}, 200);
            let fit = Fit {
                model: Some(spec),
                fixed: Vec::new(),
                starts: level.of(1, 3),
            };
            match fit.reconstruct(&m) {
                Ok(copy) => {
                    let error = error(&*truth, &*copy);
                    let what = || format!("{} {text}: {error:e} {:?}", entry.kind, copy.remarks());
                    assert!(error < 1e-3, "{}", what());
                    fitted += 1;
                }
                // Equal numbers are no symmetry; some have no number.
                Err(e) => says(&e.to_string(), "model"),
            }
        }
    }
    assert!(fitted > level.of(10, 25), "{fitted}");
}

/// The usual model is a sum: both parts of such a material are found.
#[test]
fn a_sum_is_found_again() {
    let truth = model(
        "sum",
        "component = [{ weight = 0.5, brdf = { kind = \"lambert\", albedo = 0.6 } }, \
         { weight = 0.1, brdf = { kind = \"ggx\", alpha = 0.07, fresnel = { kind = \"none\" } } }]",
    );
    let copy = method("fit", "").reconstruct(&readings(&*truth, 64));
    let copy = copy.unwrap();
    let error = error(&*truth, &*copy);
    assert!(error < 1e-4, "{error:e}, {:?}", copy.remarks());
    assert_eq!(copy.remarks().len(), 3);
}

/// Weight and albedo are one number, whatever the readings; with one of them fixed both are known.
#[test]
fn numbers_that_are_not_determined_are_told() {
    let sum = "component = [{ weight = 0.5, brdf = { kind = \"lambert\", albedo = 0.6 } }]";
    let truth = model("sum", sum);
    let m = readings(&*truth, 30);
    let told = |fixed: &str| {
        let keys = format!("model = {{ kind = \"sum\", {sum} }}\nfixed = [{fixed}]");
        method("fit", &keys).reconstruct(&m).unwrap().remarks()
    };
    let both = told("");
    assert_eq!(both.len(), 2);
    says(&both.join("; "), "do not determine");
    let one = told("\"component[0].weight\"");
    assert!(one.len() == 1 && one[0].contains("albedo = 0.6"), "{one:?}");
}

/// What is found scatters over noise as its standard error says.
#[test]
fn standard_errors_are_those_of_noise() {
    let truth = model("ward", "rho_d = 0.3\nrho_s = 0.2\nalpha = 0.1");
    let m = readings(&*truth, 60);
    let fit = method("fit", "model = { kind = \"ward\" }\nstarts = 2");
    let present = vec![true; m.values.len()];
    let random = Random::new(5);
    let mut squares = std::collections::BTreeMap::<String, Vec<f64>>::new();
    let seeds = 40;
    for seed in 0..seeds {
        let noisy = m.values.iter().enumerate().map(|(i, f)| {
            // The sum of twelve uniform numbers is nearly normal.
            let u: [f64; 12] = random.point(seed * 1000 + i as u64);
            f * (1.0 + 0.05 * (u.iter().sum::<f64>() - 6.0))
        });
        let noisy: Vec<f64> = noisy.collect();
        let noise: Vec<f64> = noisy.iter().map(|f| 0.05 * f).collect();
        let found = fit.interpolate(&Readings {
            schedule: &m.schedule,
            width: 1,
            values: &noisy,
            present: &present,
            noise: Some(&noise),
            half_angles_deg: [0.0; 2],
        });
        for remark in found.unwrap().remarks() {
            let (name, numbers) = remark.split_once(" = ").unwrap();
            let (value, error) = numbers.split_once(" ± ").unwrap();
            let truth = match name {
                "rho_d" => 0.3,
                "rho_s" => 0.2,
                _ => 0.1,
            };
            let [value, error]: [f64; 2] = [value, error].map(|x| x.parse().unwrap());
            let z = (value - truth) / error;
            squares.entry(name.to_owned()).or_default().push(z * z);
        }
    }
    assert_eq!(squares.len(), 3);
    for (name, squares) in squares {
        // The mean of 40 squares of a normal number is 1 ± 0.22; a bound on misfit of 2 % is in the errors too.
        let mean = squares.iter().sum::<f64>() / seeds as f64;
        assert!((0.4..1.7).contains(&mean), "{name}: {mean}");
    }
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let m = readings(&*model("ggx", "alpha = 0.3"), 30);
    let refused = |keys: &str| match method("fit", keys).reconstruct(&m) {
        Err(ReconstructError::Parameter(e)) => e.to_string(),
        other => panic!("{keys}: {:?}", other.err()),
    };
    // Equal numbers are no symmetry.
    for [keys, parts] in table(
        r#"model = { kind = "ward", alpha = [0.1, 0.4] } | isotropic
        model = { kind = "ggx", alpha = [0.2, 0.2] } | isotropic
        model = { kind = "ggx" }\nfixed = ["roughness"] | roughness … alpha
        starts = 0 | starts = 0"#,
    ) {
        says(&refused(keys), parts);
    }
}
