//! BRDFs that miss one symmetry by a known amount.

use crate::common::made;
use gonio::analysis::{
    Deviation, Deviations, SYMMETRY_TOLERANCE, deviations, savings, symmetry_pairs,
};
use gonio::brdf::Channels;
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization;
use gonio::sampling::Sobol;

fn found(f: impl Fn(&DirectionPair) -> Option<f64> + Send + Sync) -> Deviations {
    let brdf = made(Symmetry::FULL, move |pair| f(pair).map(|v| [v]));
    deviations(&brdf, &symmetry_pairs())
}

const E: f64 = 0.2;

/// f = 1 ± e, and T exchanges the signs: every difference is 2e.
fn check_signs(found: Deviation) {
    let want = 2.0 * E / (1.0 + E * E).sqrt();
    assert!((found.relative - want).abs() < 1e-12, "{found:?}");
    assert!((found.pairwise - 2.0 * E).abs() < 1e-12, "{found:?}");
    let log = ((1.0 + E) / (1.0 - E)).ln();
    assert!((found.max_log - log).abs() < 1e-12, "{found:?}");
    assert!(!found.holds(SYMMETRY_TOLERANCE) && found.holds(0.4));
}

#[test]
fn an_error_of_reciprocity_is_its_closed_form() {
    let found = found(|p| {
        let sign = (p.omega_i.cos_theta() - p.omega_o.cos_theta()).signum();
        Some(1.0 + E * sign)
    });
    check_signs(found.reciprocity);
    let symmetry = found.holding(SYMMETRY_TOLERANCE);
    assert!(symmetry.isotropic && symmetry.bilateral && !symmetry.reciprocal);
}

#[test]
fn an_error_of_bilateral_symmetry_is_its_closed_form() {
    // sin phi_d changes sign with the exchange too; the product with the difference of the
    // cosines, which does so as well, is reciprocal.
    let found = found(|p| {
        let (i, o) = (p.omega_i.vector(), p.omega_o.vector());
        let sign = (i.cross(o).z * (i.z - o.z)).signum();
        Some(1.0 + E * sign)
    });
    check_signs(found.bilateral);
    let symmetry = found.holding(SYMMETRY_TOLERANCE);
    assert!(symmetry.isotropic && symmetry.reciprocal && !symmetry.bilateral);
}

#[test]
fn an_error_of_isotropy_is_its_closed_form() {
    let found = found(|p| {
        let h = p.half();
        Some(1.0 + E * (2.0 * h.y.atan2(h.x)).cos())
    });
    // cos 2φ less cos 2(φ + δ): mean square 1 − cos 2δ over φ, averaged over the turns.
    let turns = [7.5f64, 30.0, 45.0, 90.0];
    let squares = turns.map(|turn| 1.0 - (2.0 * turn.to_radians()).cos());
    let mean = squares.iter().sum::<f64>() / 4.0;
    let want = E * (mean / (1.0 + 0.5 * E * E)).sqrt();
    // Sobol points are even in azimuth to far better than 1/sqrt(n).
    let got = found.isotropy.relative;
    assert!((got / want - 1.0).abs() < 1e-3, "{got} {want}");
    assert!(found.isotropy.max_log <= ((1.0 + E) / (1.0 - E)).ln());
    let symmetry = found.holding(SYMMETRY_TOLERANCE);
    assert_eq!(symmetry, Symmetry::ORTHOTROPIC);
}

#[test]
fn a_peak_does_not_hide_what_lies_beside_it() {
    let found = found(|p| {
        let h = p.half();
        let (along, across) = (h.x.abs(), h.y.abs());
        let brushed = if along > across { 1.0 + E } else { 1.0 - E };
        Some(brushed + 1e6 * (-1e4 * (h.x * h.x + h.y * h.y)).exp())
    });
    assert!(found.isotropy.relative < 1e-3, "{found:?}");
    assert!(found.isotropy.pairwise > 0.1, "{found:?}");
    assert!(!found.isotropy.holds(SYMMETRY_TOLERANCE));
    assert!(found.reciprocity.holds(1e-12) && found.bilateral.holds(1e-12));
}

#[test]
fn data_on_one_side_only_is_counted() {
    let holed = |p: &DirectionPair| {
        let lower = p.omega_i.cos_theta() < p.omega_o.cos_theta();
        (!lower).then_some(1.0)
    };
    let one = found(holed).reciprocity;
    assert_eq!((one.compared, one.missing), (0, 0));
    assert_eq!(one.one_sided, 20_000);
    assert!(!one.holds(1.0));
    let two = found(holed).bilateral;
    assert_eq!(two.compared + two.missing, 40_000);
    assert!(two.holds(0.0) && two.missing > 10_000);
    assert!(!found(|_| None).isotropy.holds(1.0));
    assert!(found(|_| Some(0.0)).isotropy.holds(0.0));
    let lit = found(|p| Some(f64::from(u8::from(p.omega_i.vector().x > 0.0))));
    assert_eq!(lit.bilateral.max_log, f64::INFINITY);
}

#[test]
fn models_have_what_they_declare() {
    for (kind, text, want) in [
        ("ggx", "alpha = 0.05", Symmetry::FULL),
        ("ward", "alpha = [0.05, 0.2]", Symmetry::ORTHOTROPIC),
        (
            "tabulated",
            "of = { kind = \"ggx\", alpha = 0.1 }",
            Symmetry::FULL,
        ),
        (
            "tabulated",
            "format = \"utia\"\nof = { kind = \"ggx\", alpha = 0.4 }",
            // Its turns are whole steps of the table, so that it shows what was measured.
            Symmetry::FULL,
        ),
    ] {
        let entries = gonio::brdf::all();
        let entry = entries.iter().find(|e| e.kind == kind).unwrap();
        let spec = gonio::registry::read_text(entry, text).unwrap();
        let brdf = spec.build(Channels::Luminance).unwrap();
        let found = deviations(&*brdf, &symmetry_pairs());
        println!("{kind} {text}: {found:?}");
        assert_eq!(found.holding(1e-9), want, "{kind} {text}: {found:?}");
    }
}

/// The share of the unfolded box that represents itself, counted point by point.
#[test]
fn savings_are_the_share_of_the_box_that_is_left() {
    for bits in 0..8 {
        let symmetry = Symmetry {
            isotropic: bits & 1 != 0,
            reciprocal: bits & 2 != 0,
            bilateral: bits & 4 != 0,
        };
        let unfolded = Symmetry {
            isotropic: symmetry.isotropic,
            ..Symmetry::NONE
        };
        for saving in savings(symmetry) {
            let entry = parametrization::find(saving.parametrization).unwrap();
            let form = entry.form(symmetry);
            let axes = entry.axes(unfolded);
            assert_eq!(saving.dimensions, axes.len());
            let mut sobol = Sobol::new(7);
            let n = 1 << 13;
            let kept = (0..n).filter(|&i| {
                let u: [f64; 4] = sobol.point(i);
                let mut c = [0.0; 4];
                for ((c, u), axis) in c.iter_mut().zip(u).zip(&axes) {
                    *c = axis.range[0] + u * axis.length();
                }
                let same = form.canonical(&c).unwrap();
                c.iter().zip(same).all(|(a, b)| (a - b).abs() < 1e-12)
            });
            let share = kept.count() as f64 / n as f64;
            let want = 1.0 / saving.copies as f64;
            // The last digits of 8192 even points; halves and quarters of axes are exact.
            assert!((share / want - 1.0).abs() < 0.03, "{saving:?}: {share}");
            assert_eq!(saving.folds.is_empty(), saving.copies == 1, "{saving:?}");
        }
    }
    let folds = |symmetry, name: &str| {
        let mut all = savings(symmetry).into_iter();
        let saving = all.find(|s| s.parametrization == name).unwrap();
        (saving.dimensions, saving.copies, saving.folds.join(", "))
    };
    assert_eq!(
        folds(Symmetry::FULL, "half-difference"),
        (3, 4, "phi_d 360° to 90°".into())
    );
    assert_eq!(
        folds(Symmetry::FULL, "spherical"),
        (3, 4, "delta_phi 360° to 180°, theta_i ≥ theta_o".into())
    );
    assert_eq!(
        folds(Symmetry::ORTHOTROPIC, "hybrid"),
        (4, 8, "phi_h 360° to 90°, phi_k 360° to 180°".into())
    );
}
