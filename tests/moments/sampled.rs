//! Random estimators against the peak-resolving one: right to the uncertainty they state where
//! enough effective samples carry them, and saying so where not.

use super::common::chi_squared::{equal_bins, uniformity};
use super::common::model;
use super::{estimate, resolving};
use gonio::brdf::Brdf;
use gonio::moments::{
    Component, Estimator, MomentsSpec, MonteCarlo, ScrambledSobol, SliceMoments, Unresolved,
};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

const SEEDS: u64 = 80;
const BINS: usize = 8;

#[test]
fn errors_are_distributed_as_the_uncertainty_says() {
    let materials = [
        ("lambert", "albedo = 0.5"),
        ("ggx", "alpha = 0.8"),
        ("ggx", "alpha = 0.3"),
        ("phong", "rho_d = 0.3\nrho_s = 0.5\nexponent = 20.0"),
    ];
    let by: [&dyn Estimator; 2] = [
        &MonteCarlo { samples: 32 << 10 },
        &ScrambledSobol { samples: 32 << 9 },
    ];
    // An estimate from 32 independent sets over its jackknife uncertainty is Student's t with 31
    // degrees of freedom; its distribution function makes it uniform.
    let student = StudentsT::new(0.0, 1.0, 31.0).unwrap();
    let mut tests = 0;
    for (kind, text) in materials {
        let brdf = model(kind, text);
        for theta_o in [0.3, 1.2] {
            let truth = estimate(&*brdf, theta_o, &resolving(1e-9), 1);
            assert_eq!(truth.unresolved, None);
            for estimator in by {
                let label = format!("{kind} {text:?} at {theta_o} by {}", estimator.label());
                let all: Vec<SliceMoments> = (0..SEEDS)
                    .into_par_iter()
                    .map(|seed| estimate(&*brdf, theta_o, estimator, 100 + seed))
                    .collect();
                assert!(all.iter().all(|s| s.unresolved.is_none()), "{label}");
                for c in Component::ALL {
                    if kind == "lambert" && c == Component::ENERGY {
                        // A constant value: every sample gives the energy without error.
                        let energies = all.iter().map(|s| s.moments.get(c).unwrap());
                        for e in energies {
                            assert!(e.uncertainty < 1e-13 * e.value, "{label}: {e:?}");
                        }
                        continue;
                    }
                    let want = truth.moments.get(c).unwrap().value;
                    let scores = all.iter().map(|s| {
                        let e = s.moments.get(c).unwrap();
                        student.cdf((e.value - want) / e.uncertainty)
                    });
                    tests += 1;
                    // Some 240 tests: however they depend on each other, the chance that right code
                    // fails any of them is below 2.4e-4, and seeds are fixed.
                    let p = uniformity(&equal_bins(scores, BINS));
                    assert!(p >= 1e-6, "{label}: {c} has p = {p:e}");
                }
            }
        }
    }
    assert!(tests > 200);
}

/// GGX 0.001, alone and above a diffuse base, in which its lobe may be missed without a trace in
/// the sampled values.
fn mirrors() -> [Box<dyn Brdf>; 2] {
    let sum = "component = [{ weight = 0.5, brdf = { kind = \"lambert\" } }, \
               { weight = 0.5, brdf = { kind = \"ggx\", alpha = 0.001 } }]";
    [model("ggx", "alpha = 0.001"), model("sum", sum)]
}

#[test]
fn lobes_between_the_points_are_told_at_every_view() {
    let by: [&dyn Estimator; 2] = [&MonteCarlo { samples: 20_000 }, &ScrambledSobol::default()];
    let views = MomentsSpec::default().view_angles();
    for brdf in mirrors() {
        for estimator in by {
            let found: Vec<_> = views
                .par_iter()
                .map(|&theta_o| {
                    let got = estimate(&*brdf, theta_o, estimator, 3).unresolved;
                    let why = got.unwrap_or_else(|| panic!("{} at {theta_o}", estimator.label()));
                    matches!(why, Unresolved::PeakUnseen)
                })
                .collect();
            // Nearly always no point at all is in the lobe.
            assert!(found.iter().filter(|unseen| **unseen).count() > 80);
        }
        // What tells them is not the material: the other estimator resolves it.
        let got = estimate(&*brdf, 0.7, &resolving(1e-5), 3);
        assert_eq!(got.unresolved, None);
    }
}
