//! BRDFs that miss one symmetry by a known amount.

use crate::common::{ISOTROPIC, at, made, model, near, symmetries};
use gonio::analysis::{Deviations, SYMMETRY_TOLERANCE, deviations, savings, symmetry_pairs};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::{self, Layout};
use gonio::sampling::Sobol;

fn found(f: impl Fn(&DirectionPair) -> Option<f64> + Send + Sync) -> Deviations {
    let brdf = made(Symmetry::FULL, move |pair| f(pair).map(|v| [v]));
    deviations(&brdf, &symmetry_pairs())
}

const E: f64 = 0.2;

/// f = 1 ± e, and T exchanges the signs: every difference is 2e.
#[test]
fn errors_of_reciprocity_and_of_bilateral_symmetry_are_their_closed_form() {
    let steeper = |p: &DirectionPair| p.omega_i.cos_theta() - p.omega_o.cos_theta();
    // sin phi_d changes sign with the exchange too; the product with the difference of the
    // cosines, which does so as well, is reciprocal.
    let turned = |p: &DirectionPair| p.omega_i.vector().cross(p.omega_o.vector()).z * steeper(p);
    let one = found(|p| Some(1.0 + E * steeper(p).signum()));
    let other = found(|p| Some(1.0 + E * turned(p).signum()));
    for found in [one.reciprocity, other.bilateral] {
        let want = 2.0 * E / (1.0 + E * E).sqrt();
        near(found.relative, want, 1e-12, found);
        near(found.pairwise, 2.0 * E, 1e-12, found);
        near(found.max_log, ((1.0 + E) / (1.0 - E)).ln(), 1e-12, found);
        assert!(!found.holds(SYMMETRY_TOLERANCE) && found.holds(0.4));
    }
    let [one, other] = [one, other].map(|found| found.holding(SYMMETRY_TOLERANCE));
    assert!(one.isotropic && one.bilateral && !one.reciprocal);
    assert!(other.isotropic && other.reciprocal && !other.bilateral);
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

/// Turns are whole steps of a table, so that it shows what was measured.
#[test]
fn tables_have_the_symmetries_of_what_they_are_made_of() {
    for keys in [
        "of = { kind = \"ggx\", alpha = 0.1 }",
        "format = \"utia\"\nof = { kind = \"ggx\", alpha = 0.4 }",
    ] {
        let found = deviations(&*model("tabulated", keys), &symmetry_pairs());
        assert_eq!(found.holding(1e-9), Symmetry::FULL, "{keys}: {found:?}");
    }
}

/// The share of the unfolded box that represents itself, counted point by point.
#[test]
fn savings_are_the_share_of_the_box_that_is_left() {
    for symmetry in symmetries() {
        let unfolded = [Symmetry::NONE, ISOTROPIC][usize::from(symmetry.isotropic)];
        for saving in savings(symmetry) {
            let entry = parametrization::find(saving.parametrization).unwrap();
            let form = entry.form(symmetry);
            if form.facts().layout == Layout::Straight {
                // Its images are no equal shares of the box.
                continue;
            }
            let whole = entry.form(unfolded);
            assert_eq!(saving.dimensions, whole.axes().len());
            let mut sobol = Sobol::new(7);
            let n = 1 << 13;
            let kept = (0..n).filter(|&i| {
                let c = at(&*whole, sobol.point(i));
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
}
