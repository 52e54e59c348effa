//! Scenes of wavelengths: at each of them a scene is what a scene in luminance is that has its value.
#![cfg(feature = "experiments")]

mod common;

use common::{form, member, near, planned, present, preset, test_pairs};
use gonio::brdf::{self, Brdf, BrdfSpec, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Bench, Ideal, Instrument, Order, Parts};
use gonio::measurement::Measurement;
use gonio::metrics::{self, Measure};
use gonio::moments::{Channel, Slice};
use gonio::reconstruct;
use gonio::schedule::Schedule;
use gonio::{numeric, registry};
use std::f64::consts::PI;
use std::sync::Arc;

const COUNTS: [usize; 4] = [1, 3, 7, 31];

/// `n` wavelengths, nm.
fn nm(n: usize) -> Vec<f64> {
    (0..n).map(|i| 400.0 + 10.0 * i as f64).collect()
}

fn scene(n: usize) -> Channels {
    common::wavelengths(&nm(n))
}

/// Different values in (0, 1) whose Rec. 709 luminance, which a scene in luminance takes of a grey
/// value, is the value to the bit.
fn values(n: usize) -> Vec<f64> {
    let all = (1..1024).map(|i| f64::from(i * 389 % 1024) / 1024.0);
    let is_kept = |v: &f64| *v > 0.05 && numeric::luminance([*v; 3]) == *v;
    let found: Vec<f64> = all.filter(is_kept).take(n).collect();
    assert_eq!(found.len(), n);
    found
}

/// Models with `X` where a value by wavelength goes.
const MODELS: [(&str, &str); 9] = [
    ("lambert", "albedo = X"),
    ("oren-nayar", "albedo = X\nsigma_deg = 30.0"),
    (
        "ggx",
        "alpha = 0.4\nfresnel = { kind = \"schlick\", f0 = X }",
    ),
    (
        "beckmann",
        "alpha = 0.5\nfresnel = { kind = \"conductor\", eta = X, kappa = 2.0 }",
    ),
    ("ward", "alpha = 0.5\nrho_d = 0.25\nrho_s = X"),
    ("phong", "exponent = 10.0\nrho_d = X\nrho_s = 0.125"),
    ("sheen", "rho = X\nalpha = 0.5"),
    (
        "shifted-gamma",
        "rho_d = X\nrho_s = 0.2\nalpha = X\np = 0.8\nf0 = 0.0\nf1 = -0.5\nkap = 6.0\nlambda = 2.5\nc = 0.0\nk = 24.0\ntheta0_rad = -0.2",
    ),
    (
        "sum",
        "component = [{ weight = 0.5, brdf = { kind = \"lambert\", albedo = X } }, { weight = 0.5, brdf = { kind = \"retro-reflective\", of = { kind = \"ggx\", alpha = 0.5 } } }]",
    ),
];

fn spec(kind: &str, text: &str) -> Box<dyn BrdfSpec> {
    member(brdf::all(), kind, text)
}

fn build(kind: &str, text: &str, value: &str, channels: Channels) -> Box<dyn Brdf> {
    let spec = spec(kind, &text.replace('X', value));
    spec.check(&channels).unwrap();
    spec.build(channels).unwrap()
}

fn sampled(values: &[f64]) -> String {
    let nm = nm(values.len());
    format!("{{ nm = {nm:?}, values = {values:?} }}")
}

fn poses(budget: usize) -> Arc<Schedule> {
    planned(&form("half-difference", Symmetry::FULL), "sobol", budget, 3)
}

/// Everything but noise.
const QUIET: Parts = Parts {
    noise: false,
    ..Parts::ALL
};

/// Channel `c` of `n`, as bits.
fn bits(values: &[f64], c: usize, n: usize) -> Vec<u64> {
    let channel = values.iter().skip(c).step_by(n);
    channel.map(|v| v.to_bits()).collect()
}

/// Wavelength `c` of `n` against a measurement in luminance, bit by bit.
fn assert_channel(spectral: &Measurement, c: usize, luminance: &Measurement, what: &str) {
    let n = spectral.channels.count();
    assert_eq!(spectral.outcomes, luminance.outcomes, "{what}");
    let [one, other] = [bits(&spectral.values, c, n), bits(&luminance.values, 0, 1)];
    assert!(one == other, "{what}");
    let (a, b) = (&spectral.details, &luminance.details);
    assert_eq!(a.is_some(), b.is_some());
    if let (Some(a), Some(b)) = (a, b) {
        assert!(a.flags == b.flags, "{what}");
        for (a, b) in [(&a.type_a, &b.type_a), (&a.type_b, &b.type_b)] {
            assert!(bits(a, c, n) == bits(b, 0, 1), "{what}");
        }
    }
}

/// Asserts that each wavelength of a scene is read as its value is in luminance.
fn assert_separate(model: (&str, &str), measure: impl Fn(&dyn Brdf) -> Measurement) {
    let (kind, text) = model;
    for n in COUNTS {
        let values = values(n);
        let spectral = build(kind, text, &sampled(&values), scene(n));
        assert_eq!(*spectral.channels(), scene(n));
        let spectral = measure(&*spectral);
        assert!(spectral.readings() > 30);
        for (c, value) in values.iter().enumerate() {
            let one = build(kind, text, &value.to_string(), Channels::Luminance);
            let what = format!("{kind} {c} of {n}");
            assert_channel(&spectral, c, &measure(&*one), &what);
        }
    }
}

#[test]
fn an_ideal_reading_of_a_wavelength_is_that_of_its_value() {
    let poses = poses(300);
    for model in MODELS {
        assert_separate(model, |brdf| Ideal.measure(brdf, &poses));
    }
}

#[test]
fn so_is_a_reading_through_apertures() {
    let poses = poses(60);
    let bench = Bench::new(&preset("cornell"), QUIET, 1).unwrap();
    let itinerary = bench.plan(&poses, Order::AsGenerated);
    let session = bench.session(&itinerary, 1);
    // Smooth: every wavelength alone asks for the nodes that all together ask for.
    for model in [MODELS[0], MODELS[2]] {
        assert_separate(model, |brdf| {
            let measured = session.measure(brdf, &poses);
            assert!(measured.details.is_some());
            measured
        });
    }
}

#[test]
fn a_grey_lobe_is_read_the_same_at_every_wavelength() {
    // Narrower than the apertures, so that all ways of integration are taken; with noise the
    // detector draws for one wavelength after the other, and the first has the luminance's draws.
    let (poses, text) = (poses(40), "alpha = 0.01");
    for (parts, wanted) in [(QUIET, 7), (Parts::ALL, 1)] {
        let bench = Bench::new(&preset("pgii"), parts, 1).unwrap();
        let itinerary = bench.plan(&poses, Order::AsGenerated);
        let session = bench.session(&itinerary, 1);
        let grey = session.measure(&*build("ggx", text, "", Channels::Luminance), &poses);
        let spectral = session.measure(&*build("ggx", text, "", scene(wanted)), &poses);
        for c in 0..wanted {
            assert_channel(&spectral, c, &grey, &format!("{c} of {wanted}"));
        }
    }
}

#[test]
fn readings_are_reconstructed_wavelength_by_wavelength() {
    let (poses, n) = (poses(200), 7);
    let values = values(n);
    let (kind, text) = MODELS[4];
    let pairs = test_pairs(Measure::Cosine, 200);
    let spectral = build(kind, text, &sampled(&values), scene(n));
    let spectral = Ideal.measure(&*spectral, &poses);
    for entry in reconstruct::all() {
        let Ok(method) = registry::read_text(&entry, "") else {
            continue;
        };
        // What is fitted to the first channel is not fitted to each.
        if method.needs_grid() || method.weighs_readings() {
            continue;
        }
        let together = method.reconstruct(&spectral).unwrap();
        assert_eq!(*together.channels(), scene(n));
        for (c, value) in values.iter().enumerate() {
            let one = build(kind, text, &value.to_string(), Channels::Luminance);
            let alone = method.reconstruct(&Ideal.measure(&*one, &poses)).unwrap();
            for pair in &pairs {
                let (all, one) = (present(&*together, pair), alone.luminance(pair).unwrap());
                assert!((all[c] - one).abs() <= 1e-12 * one.abs(), "{}", entry.kind);
            }
        }
        // What metrics compare is the mean over the wavelengths.
        let means = metrics::evaluate(&*together, &pairs);
        for (i, pair) in pairs.iter().enumerate() {
            let all = present(&*together, pair);
            let trapezoids: f64 = all.windows(2).map(|v| 10.0 * 0.5 * (v[0] + v[1])).sum();
            let mean = trapezoids / 60.0;
            assert!((means.get(i).unwrap() - mean).abs() <= 1e-13 * mean);
        }
    }
}

#[test]
fn samples_are_joined_by_straight_lines_and_must_cover_the_scene() {
    let text = "albedo = { nm = [400, 500, 700], values = [0.1, 0.3, 0.7] }";
    let spec = spec("lambert", text);
    let at = common::wavelengths;
    let brdf = spec.build(at(&[400.0, 425.0, 600.0, 700.0])).unwrap();
    let normal = DirectionPair::from_spherical(0.0, 0.0, 0.3, 1.0);
    let out = present(&*brdf, &normal).into_iter();
    for (out, want) in out.zip([0.1, 0.15, 0.5, 0.7]) {
        near(out * PI, want, 1e-15, "straight line");
    }
    assert_eq!(spec.label(), "lambert");
    let again = brdf::read(toml::de::DeTable::parse(&spec.resolved().to_string()).unwrap());
    assert_eq!(again.unwrap().resolved(), spec.resolved());
    for short in [&[399.0, 500.0][..], &[500.0, 701.0]] {
        let sentence = spec.check(&at(short)).unwrap_err().to_string();
        let start = "albedo = { nm = [400 to 700]";
        assert!(sentence.starts_with(start), "{sentence}");
    }
}

#[test]
fn what_a_scene_cannot_use_is_refused_by_its_key() {
    let spectral = scene(3);
    let colour = "albedo = [0.1, 0.2, 0.3]";
    let samples = "albedo = { nm = [400, 700], values = [0.1, 0.2] }";
    let high = "albedo = { nm = [300, 700], values = [0.1, 1.2] }";
    let table = "of = { kind = \"lambert\", albedo = 0.5 }";
    let inside = format!("of = {{ kind = \"lambert\", {colour} }}");
    for (kind, text, channels, key) in [
        ("lambert", colour, &spectral, "albedo = [0.1, 0.2, 0.3]:"),
        ("lambert", samples, &Channels::Luminance, "albedo = { nm"),
        ("lambert", samples, &Channels::Rgb, "albedo = { nm"),
        ("lambert", high, &spectral, "albedo = 1.2"),
        ("tabulated", table, &spectral, "format = merl"),
        ("retro-reflective", &inside, &spectral, "of.albedo = [0.1"),
        ("low-abc", "", &spectral, "k_d = [0.150463"),
    ] {
        let spec = spec(kind, text);
        let sentence = spec.check(channels).unwrap_err().to_string();
        assert!(sentence.starts_with(key), "{sentence}");
        let built = spec.build(channels.clone()).err().unwrap();
        assert_eq!(built.to_string(), sentence);
    }
    let lambert = build("lambert", "albedo = X", "0.5", spectral);
    assert!(Slice::new(&*lambert, Channel::Luminance, 0.3).is_ok());
    assert!(Slice::new(&*lambert, Channel::Red, 0.3).is_err());
}
