use crate::common::made;
use gonio::analysis::alignment;
use gonio::brdf;
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::Symmetry;
use toml::de::DeTable;

/// A lobe over (theta_h, |h_bar|).
fn lobe(f: impl Fn(f64, f64) -> f64 + Send + Sync) -> impl Brdf {
    made(Symmetry::FULL, move |pair| {
        let h = pair.half();
        let h_bar = h.x.hypot(h.y);
        Some([f(h_bar.atan2(h.z), h_bar)])
    })
}

fn model(text: &str) -> Box<dyn Brdf> {
    let spec = brdf::read(DeTable::parse(text).unwrap()).unwrap();
    spec.build(Channels::Luminance).unwrap()
}

fn gauss(x: f64) -> f64 {
    (-x * x).exp()
}

#[test]
fn functions_of_one_coordinate_have_their_exponent() {
    for width in [1e-5, 0.01, 0.1] {
        let half_width = width * 2f64.ln().sqrt();
        for base in [0.0, 0.3] {
            let angle = alignment(&lobe(|t: f64, _| base + gauss(t / width))).unwrap();
            let length = alignment(&lobe(|_, l: f64| base + gauss(l / width))).unwrap();
            // Rounding of the half vector, of size 1e-16, against the width.
            let tolerance = 1e-15 / width + 1e-9;
            assert!(angle.q.abs() < tolerance, "{width}: {angle:?}");
            assert!((length.q - 1.0).abs() < tolerance, "{width}: {length:?}");
            assert_eq!((angle.slices, length.slices), (13, 13));
            assert!((angle.half_width / half_width - 1.0).abs() < 1e-6);
            assert!((length.half_width / half_width.asin() - 1.0).abs() < 1e-6);
        }
    }
    // Between the two: sin(theta_h) = |h_bar|/cos(theta_d), so that this is q = 1/2.
    let between = |t: f64, l: f64| gauss((t.sin() * l).sqrt() / 0.05);
    let found = alignment(&lobe(between)).unwrap();
    assert!((found.q - 0.5).abs() < 1e-9, "{found:?}");
}

#[test]
fn models_have_the_exponent_of_their_formula() {
    // Shadowing, Fresnel and cosines move the exponents by the squared width of the lobe.
    for (text, want, tolerance) in [
        ("kind = \"ggx\"\nalpha = 0.02", 0.0, 0.01),
        ("kind = \"beckmann\"\nalpha = 0.05", 0.0, 0.02),
        ("kind = \"ward\"\nalpha = 0.05", 0.0, 0.02),
        ("kind = \"ward\"\nalpha = [0.02, 0.06]", 0.0, 0.02),
        ("kind = \"phong\"\nexponent = 1000", 0.0, 1e-6),
        ("kind = \"shifted-gamma\"", 0.0, 0.1),
        ("kind = \"low-abc-smooth\"\nb = 3000.0\nc = 1.5", 1.0, 0.01),
    ] {
        let found = alignment(&*model(text)).unwrap();
        println!("{text}: {found:?}");
        assert!((found.q - want).abs() < tolerance, "{text}: {found:?}");
    }
}

#[test]
fn without_a_lobe_there_is_no_exponent() {
    for text in [
        "kind = \"lambert\"",
        "kind = \"oren-nayar\"",
        "kind = \"sheen\"",
        "kind = \"retro-reflective\"\nof = { kind = \"ggx\", alpha = 0.05 }",
    ] {
        let found = alignment(&*model(text));
        assert_eq!(found, None, "{text}");
    }
}
