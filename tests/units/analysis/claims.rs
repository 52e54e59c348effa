//! Verdicts that follow from the equations, and verdicts on materials made to have them.

use crate::common::{matte, model, near};
use gonio::analysis::{Claim, Verdict, on_material, on_materials, on_test_functions};
use std::sync::LazyLock;

fn verdict(claims: &[Claim], id: &str) -> Verdict {
    claims.iter().find(|c| c.id == id).unwrap().verdict
}

fn number(claims: &[Claim], id: &str, name: &str) -> f64 {
    let claim = claims.iter().find(|c| c.id == id).unwrap();
    let found = claim.numbers.iter().find(|(n, _)| n == name);
    found.unwrap_or_else(|| panic!("{claim:?}")).1
}

/// Of the test functions.
static EQUATIONS: LazyLock<Vec<Claim>> = LazyLock::new(|| on_test_functions().unwrap());

/// Of S and of F, as materials.
static S_AND_F: LazyLock<[Vec<Claim>; 2]> = LazyLock::new(|| {
    ["test-s", "test-f"].map(|kind| on_material(kind, &*model(kind, "")).unwrap())
});

#[test]
fn equations_are_judged_as_the_algebra_says() {
    let claims = &*EQUATIONS;
    let hold = "orthographic-is-hybrid-at-90 reciprocity-is-half-a-turn cos-theta-d product-of-cosines \
        back-isolines-concentric f-aligned-half-difference f-aligned-hybrid f-bends-orthographic \
        s-aligned-orthographic s-aligned-hybrid s-independent-of-phi-d g-circular-at-90";
    let hold_partly = "length-of-h-bar theta-k slices-correspond projection-to-two-dimensions \
        mirror-isolines-pinched";
    for (ids, want) in [
        (hold, Verdict::Holds),
        ("g-zero-on-the-horizon phi-k-is-a-sum", Verdict::DoesNotHold),
        (hold_partly, Verdict::HoldsPartly),
    ] {
        for id in ids.split(' ') {
            assert_eq!(verdict(claims, id), want, "{id}");
        }
    }
    // At quarter turns alone a hybrid slice is one of half/difference coordinates.
    for (azimuth, is_slice) in [(0, true), (30, false), (60, false), (90, true)] {
        let name = format!("spread_of_phi_d_at_{azimuth}deg_deg");
        let spread = number(claims, "slices-correspond", &name);
        assert_eq!(is_slice, spread < 0.5, "{azimuth}: {spread}");
    }
    // Half of all pairs; 20 000 of them have a standard error of 0.0035.
    let share = number(claims, "theta-k", "share_on_the_other_branch");
    near(share, 0.5, 0.01, "share");
    // Small isolines of both are ellipses of axes 1 : cos 75°.
    for name in ["aspect_small_theta_h", "aspect_small_h_bar"] {
        let aspect = number(claims, "mirror-isolines-pinched", name);
        near(aspect * 75_f64.to_radians().cos(), 1.0, 0.01, name);
    }
    // G − |h_bar|² − |k|² = k_z², and |k_z| = |cos θ_i − cos θ_o|/2 is a half at most.
    let at_0 = number(claims, "g-circular-at-90", "largest_difference_hybrid_0deg");
    assert!(at_0 > 0.24 && at_0 < 0.25, "{at_0}");
}

#[test]
fn claims_are_named_once_and_say_what_they_measure() {
    let claims = [&EQUATIONS[..], &S_AND_F[0]].concat();
    let mut names: Vec<_> = claims.iter().map(|c| (c.id, c.material.clone())).collect();
    names.sort();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
    for claim in &claims {
        let is_said = !claim.numbers.is_empty() && !claim.finding.is_empty();
        let is_finite = claim.numbers.iter().all(|(_, v)| v.is_finite());
        assert!(is_said && is_finite, "{claim:?}");
    }
}

#[test]
fn lobes_of_theta_h_are_not_like_s_and_lobes_of_h_bar_are() {
    let [s, f] = &*S_AND_F;
    // S is a function of |h_bar| by construction; F of theta_d, which both charts keep.
    assert_eq!(verdict(s, "isolines-like-s"), Verdict::Holds);
    let name = "changes_with_azimuth_orthographic";
    let [of_s, of_f] = [s, f].map(|claims| number(claims, "hybrid-changes-least", name));
    assert_eq!(of_s, 0.0);
    assert_ne!(verdict(f, "isolines-like-s"), Verdict::Holds);
    assert!(of_f > 1e-3, "{of_f}");
}

#[test]
fn a_constant_neither_holds_nor_fails() {
    // No variance: no share of it, on no slice. Two averages of a constant are that constant, but
    // an error relative to black is no number.
    for (albedo, projection) in [(0.5, Verdict::Holds), (0.0, Verdict::NotDefined)] {
        let lambert = matte(albedo);
        for claim in on_material("matte", &lambert).unwrap() {
            let want = match claim.id {
                "projection-to-two-dimensions" => projection,
                _ => Verdict::NotDefined,
            };
            assert_eq!(claim.verdict, want, "{albedo}: {claim:?}");
            let undefined = want == Verdict::NotDefined;
            assert_eq!(claim.numbers.is_empty(), undefined, "{claim:?}");
            assert!(!claim.finding.is_empty());
        }
    }
}

#[test]
fn the_claim_on_common_materials_is_on_their_averages() {
    let [s, f] = S_AND_F.clone();
    assert_eq!(on_materials(&s), None);
    let both = [s.clone(), f.clone()].concat();
    let claim = on_materials(&both).unwrap();
    for (name, mean) in &claim.numbers {
        let [a, b] = [&s, &f].map(|claims| number(claims, "hybrid-aligns-best", name));
        assert!((mean - 0.5 * (a + b)).abs() < 1e-15, "{name}");
    }
    // S and F are sums in hybrid coordinates; S is none in half/difference ones, F none in orthographic ones.
    assert_eq!(claim.verdict, Verdict::Holds, "{}", claim.finding);
    // A material that leaves nothing to measure has no say.
    let black = matte(0.0);
    let with_black = [both, on_material("black", &black).unwrap()].concat();
    assert_eq!(on_materials(&with_black), Some(claim));
}
