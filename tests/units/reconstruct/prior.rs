//! Laws of priors.

use crate::common::made;
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::Measurement;
use gonio::parametrization::usual_form;
use gonio::reconstruct::{EPSILON, Kriging, Prior, PriorFile, Reconstruct, Training, Transform};
use gonio::schedule::{SampleSet, SobolSet};
use std::path::PathBuf;
use std::sync::Arc;

const TRANSFORM: Transform = Transform::Log { epsilon: EPSILON };

/// ln(f + ε) = Σ c_k q_k, of functions that are smooth on the lattice.
fn log(c: [f64; 3], pair: &DirectionPair) -> f64 {
    let half = pair.half();
    let (lifted, facing) = (half.z, half.dot(pair.omega_i.vector()));
    let q = [1.0 - lifted, (1.0 - facing).powi(2), lifted * facing];
    c.iter().zip(q).map(|(c, q)| c * q).sum()
}

/// A BRDF with such a logarithm in each channel.
fn member<const N: usize>(c: [[f64; 3]; N]) -> impl Brdf {
    made(Symmetry::FULL, move |pair| {
        Some(c.map(|c| TRANSFORM.inverse(log(c, pair))))
    })
}

/// Members of several families of names.
fn trained() -> Training {
    let mut training = Training::new(2000).unwrap();
    for i in 0..24 {
        let u = |k: f64| 4.0 * (f64::from(i + 1) * k).fract() - 2.0;
        let member = member([[0.8192, 0.6710, 0.5497].map(u)]);
        let name = format!("{i}-{}", ["wood", "paint", "felt"][i as usize % 3]);
        training.add(&name, &format!("{i}"), &member).unwrap();
    }
    training
}

fn measured(brdf: &dyn Brdf, budget: usize) -> Measurement {
    let schedule = SobolSet {}.plan(&usual_form(Symmetry::FULL), budget, 3);
    Ideal.measure(brdf, &Arc::new(schedule.unwrap()))
}

fn file(prior: &Prior) -> (tempfile::NamedTempFile, PriorFile) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(&file, prior.to_bytes()).unwrap();
    let named = PriorFile::from(file.path().to_owned());
    (file, named)
}

/// The largest error of ln(f + ε), by so many readings, with a prior and without.
fn errors(c: [f64; 3], n: usize) -> [f64; 2] {
    let brdf = &member([c]);
    let (_file, prior) = file(&trained().prior(80).unwrap());
    let at: Vec<_> = measured(brdf, 300).schedule.poses.clone();
    [Some(prior), None].map(|prior| {
        let kriging = Kriging {
            prior,
            ..Kriging::default()
        };
        let copy = kriging.reconstruct(&measured(brdf, n)).unwrap();
        let off = |pose: &gonio::schedule::Pose| {
            let mut f = [0.0];
            let _ = copy.eval(&pose.pair, &mut f);
            (TRANSFORM.forward(f[0]) - log(c, &pose.pair)).abs()
        };
        at.iter().map(off).sum::<f64>() / at.len() as f64
    })
}

#[test]
fn a_member_of_a_family_is_known_from_as_many_readings_as_it_has_coefficients() {
    let [with, without] = errors([1.3, -0.7, 0.4], 4);
    assert!(with < 0.02 && with < 0.2 * without, "{with} {without}");
}

#[test]
fn each_channel_is_what_it_is_alone() {
    let members = [[1.3, -0.7, 0.4], [-1.0, 0.2, 1.5], [0.3, 1.4, -1.2]];
    let coloured = member(members);
    let (_file, prior) = file(&trained().prior(80).unwrap());
    // Shares are those of all channels together: one kernel and one share for each.
    let kriging = Kriging {
        prior: Some(prior),
        fit: false,
        ..Kriging::default()
    };
    let copy = kriging.reconstruct(&measured(&coloured, 5)).unwrap();
    for pose in &measured(&coloured, 100).schedule.poses {
        let mut f = [0.0; 3];
        let _ = copy.eval(&pose.pair, &mut f);
        for (f, member) in f.iter().zip(members) {
            let off = TRANSFORM.forward(*f) - log(member, &pose.pair);
            assert!(off.abs() < 0.15, "{off} at {pose:?}");
        }
    }
}

#[test]
fn what_contradicts_a_prior_is_reconstructed_without_it() {
    let stripes = made(Symmetry::FULL, |pair| {
        Some([(8.0 * (60.0 * pair.half().z).sin()).exp()])
    });
    let (_file, prior) = file(&trained().prior(80).unwrap());
    let readings = measured(&stripes, 30);
    let copy = |prior| {
        let kriging = Kriging {
            prior,
            ..Kriging::default()
        };
        kriging.reconstruct(&readings).unwrap()
    };
    let [with, without] = [Some(prior), None].map(copy);
    assert_eq!(with.remarks().len(), 1);
    for pose in &readings.schedule.poses {
        let (mut a, mut b) = ([0.0], [0.0]);
        let _ = with.eval(&pose.pair, &mut a);
        let _ = without.eval(&pose.pair, &mut b);
        assert_eq!(a, b);
    }
}

#[test]
fn what_is_no_material_of_a_prior_is_refused() {
    let mut training = Training::new(2000).unwrap();
    training.add("a", "a", &member([[0.0; 3]])).unwrap();
    let skew = gonio::brdf::all();
    let ward = skew.iter().find(|e| e.kind == "ward").unwrap();
    let ward = gonio::registry::read_text(ward, "alpha = [0.1, 0.3]\nrho_s = 0.3").unwrap();
    let ward = ward.build(Channels::Luminance).unwrap();
    let told = training.add("w", "w", &*ward).unwrap_err().to_string();
    assert!(told.contains("w is not isotropic"), "{told}");
    let told = training.prior(80).unwrap_err().to_string();
    assert!(told.contains("at least 2"), "{told}");
}

/// The file that is a part of the program.
static BYTES: &[u8] = include_bytes!("../../../src/reconstruct/kriging/prior/built-in.gonio");

#[test]
fn the_prior_of_formulas_is_there() {
    let prior = PriorFile::from(PathBuf::from("built-in")).load().unwrap();
    assert!(prior.materials().len() > 50 && prior.to_bytes() == BYTES);
    assert!(BYTES.len() <= 300_000);
}
