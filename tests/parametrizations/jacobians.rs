//! The Jacobian of every parametrization: that of a warped or folded form by that of the plain one, and all of them by the
//! measure of the whole domain.

use super::common::{Level, levels, lowest, near, random_pairs, symmetries};
use super::{at, forms};
use gonio::geometry::Symmetry;
use gonio::parametrization::{self, Axis, AxisKind, Coords, Parametrization, WarpSpec};
use gonio::sampling::Sobol;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

levels! {
    the_box_holds_the_measure_of_both_hemispheres: "thorough: more points";
}

fn name(p: &dyn Parametrization) -> String {
    format!("{} (warp: {})", p.name(), p.warp_name())
}

/// Slope of the plain coordinate along an axis over the warped one, by differences of fourth order; `None` where they leave
/// the domain.
fn slope([p, plain]: [&dyn Parametrization; 2], c: &Coords, d: usize) -> Option<f64> {
    let step = 2e-4 * p.axes()[d].length();
    let along = |steps: f64| {
        let mut moved = *c;
        moved[d] += steps * step;
        Some(plain.forward(&p.inverse(&moved)?)[d])
    };
    let [near, far] = [1.0, 2.0].map(|n| Some(along(n)? - along(-n)?));
    Some((8.0 * near? - far?) / (12.0 * step))
}

/// That of a plain form is judged by differences in 50 digits (`gonio stability`, the law `Jacobian`).
#[test]
fn a_warp_multiplies_the_jacobian_by_its_slope() {
    for p in forms(Symmetry::NONE) {
        let entry = parametrization::find(p.name()).expect("in the registry");
        let plain = entry.form(Symmetry::NONE);
        let mut sobol = Sobol::new(30);
        let mut seen = 0;
        for i in 0..1_000 {
            let c = at(&*p, sobol.point(i));
            // Away from poles, where the domain ends and leaves no room for a two-sided step.
            let mut radial = p
                .axes()
                .iter()
                .zip(c)
                .filter(|(axis, _)| axis.kind == AxisKind::Radial);
            if radial.any(|(axis, c)| c < 0.05 * axis.range[1]) {
                continue;
            }
            let Some(pair) = p.inverse(&c).filter(|pair| lowest(pair) > 0.1) else {
                continue;
            };
            let bent = (0..4).filter(|d| p.axes()[*d].warp.is_some());
            let slopes: Option<f64> = bent.map(|d| slope([&*p, &*plain], &c, d)).product();
            let Some(slopes) = slopes else { continue };
            let want = plain.jacobian(&plain.forward(&pair)) * slopes;
            near(p.jacobian(&c) / want, 1.0, 1e-10, (name(&*p), c));
            seen += 1;
        }
        assert!(seen > 200, "{}: {seen}", name(&*p));
    }
}

#[test]
fn folded_and_isotropic_forms_have_the_jacobian_of_the_pair() {
    let whole = forms(Symmetry::NONE);
    for symmetry in symmetries() {
        for p in forms(symmetry) {
            let same = |q: &&Arc<dyn Parametrization>| name(&***q) == name(&*p);
            let plain = whole.iter().find(same);
            let plain = plain.expect("warps do not depend on symmetry");
            for pair in random_pairs(31).take(500) {
                let [j, reference] = [&p, plain].map(|p| p.jacobian(&p.forward(&pair)));
                // The orthographic 1/(cos cos) amplifies rounding towards the horizon.
                let allowed = 1e-13 * reference / lowest(&pair).powi(2);
                // Exchanging light and sensor exchanges the two factors of a warped axis.
                let is_warped = p.warp_name() != "none";
                let exchanges = p.facts().exchange && symmetry.reciprocal && is_warped;
                let swapped = plain.jacobian(&plain.forward(&pair.swapped()));
                let error = (j - reference).abs();
                let other = if exchanges { swapped } else { reference };
                let error = error.min((j - other).abs());
                let what = || format!("{} {symmetry:?} {pair:?}: {j} {reference}", name(&*p));
                assert!(error <= allowed.max(1e-13 * swapped), "{}", what());
            }
        }
    }
}

/// How many configurations of the unfolded hemispheres one point of the box stands for.
fn copies(p: &dyn Parametrization) -> f64 {
    let s = p.symmetry();
    let both = |has: bool, n: f64| if has { n } else { 1.0 };
    match (p.facts().exchange, s.isotropic) {
        // The box holds both orders of the directions, only its azimuth is halved.
        (true, true) => both(s.reciprocal || s.bilateral, 2.0),
        (true, false) => both(s.bilateral, 4.0),
        (_, true) => both(s.reciprocal, 2.0) * both(s.bilateral, 2.0),
        (_, false) => both(s.reciprocal, 2.0) * both(s.bilateral, 4.0),
    }
}

fn the_box_holds_the_measure_of_both_hemispheres(level: Level) {
    // ∬ w d omega_i d omega_o: 1 gives (2π)², both cosines > 0.1 give (0.9 · 2π)², cos cos gives π²,
    // cos cos (omega_i·omega_o) gives the squared length of ∫ cos omega d omega = (0, 0, 2π/3).
    let exact = [TAU * TAU, (0.9 * TAU).powi(2), PI * PI, (TAU / 3.0).powi(2)];
    let count = level.of(1 << 15, 1 << 17);
    for symmetry in level.of(vec![Symmetry::NONE, Symmetry::FULL], symmetries()) {
        for p in forms(symmetry) {
            let volume: f64 = p.axes().iter().map(|a| a.length()).product();
            let turn = if symmetry.isotropic { TAU } else { 1.0 };
            // A power below the root, and an asinh of a small scale, leave fewer points near the horizon,
            // where integrands are steep: with four and eight times as many there are as many as a root has.
            let thin = |axis: &Axis| match axis.warp {
                Some(WarpSpec::Power { exponent }) if exponent < 0.5 => 2,
                Some(WarpSpec::Asinh { scale }) if scale < 0.1 => 3,
                _ => 0,
            };
            let count = count << p.axes().iter().map(thin).max().unwrap_or(0);
            let scale = volume * turn * copies(&*p) / count as f64;
            let mut sobol = Sobol::new(32);
            let mut sums = [0.0; 4];
            for i in 0..count {
                let c = at(&*p, sobol.point(i));
                let Some(pair) = p.inverse(&c) else { continue };
                let j = p.jacobian(&c);
                // On the horizon itself, a set of measure 0 that rounding may hit.
                if j == f64::INFINITY {
                    continue;
                }
                let cos = pair.omega_i.cos_theta() * pair.omega_o.cos_theta();
                let high = f64::from(u8::from(lowest(&pair) > 0.1));
                let dot = pair.omega_i.vector().dot(pair.omega_o.vector());
                for (sum, w) in sums.iter_mut().zip([1.0, high, cos, cos * dot]) {
                    *sum += j * w;
                }
            }
            let errors: [f64; 4] =
                std::array::from_fn(|w| (sums[w] * scale / exact[w] - 1.0).abs());
            // About twice the worst measured. 1/(cos cos) and 1/(1 − |k|² − |h_bar|² sin² delta) are
            // integrable, their squares are not: the total measure converges slowly there.
            let allowed = match p.facts().singular {
                true => [0.15, 0.025, 0.008, 0.008],
                false => [0.004, 0.004, 6e-4, 6e-4],
            };
            for (w, error) in errors.into_iter().enumerate() {
                // Errors of Sobol points fall as their number grows.
                let allowed = level.of(4.0, 1.0) * allowed[w];
                near(error, 0.0, allowed, (symmetry, w, name(&*p)));
            }
        }
    }
}

#[test]
fn jacobian_on_edges_is_zero_finite_or_infinite_but_never_nan() {
    for symmetry in symmetries() {
        for p in forms(symmetry) {
            let axes = p.axes();
            let places = |d: usize| {
                let (lo, length) = (axes[d].range[0], axes[d].length());
                let at = [0.0, 1e-300, 1e-8, 0.25, 0.5, 0.75, 1.0 - 1e-8, 1.0];
                at.map(|u| lo + length * u)
            };
            let n = 8usize;
            let (mut zero, mut infinite) = (0, 0);
            for code in 0..n.pow(axes.len() as u32) {
                let mut c = [0.0; 4];
                let mut rest = code;
                for (d, c) in c.iter_mut().enumerate().take(axes.len()) {
                    *c = places(d)[rest % n];
                    rest /= n;
                }
                let j = p.jacobian(&c);
                let what = || format!("{} {symmetry:?} {c:?}: {j}", name(&*p));
                assert!(!j.is_nan() && j >= 0.0, "{}", what());
                zero += usize::from(j == 0.0);
                infinite += usize::from(j == f64::INFINITY);
                if let Some(pair) = p.inverse(&c) {
                    assert!(j.is_finite() || lowest(&pair) < 1e-7, "{}", what());
                }
            }
            assert_eq!(infinite > 0, p.facts().singular, "{}", name(&*p));
            // Poles: the measure vanishes, except in coordinates that absorb it.
            assert!(zero > 0 || p.facts().squared, "{}", name(&*p));
        }
    }
}
