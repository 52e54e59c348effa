//! The claims of Barla, Belcour and Pacanowski 2015 ("In Praise of an Alternative BRDF
//! Parametrization", B15 below) as tests, its errata too: an erratum's test shows that the printed
//! form fails and that the corrected form holds. The vectors are computed here from the two
//! directions; the library is asked for coordinates only.
#![cfg(feature = "experiments")]

mod common;

use common::{ISOTROPIC, form, polar, random_pair};
use glam::{DMat3, DVec3};
use gonio::geometry::{Direction, DirectionPair, Symmetry, angle_between, distance};
use gonio::parametrization::{self, Parametrization, WarpSpec};
use gonio::sampling::{Random, Sobol};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Rounding of the few operations behind each identity: measured < 2e-15, most below 1e-15.
const ULPS: f64 = 5e-15;

/// h and k as section 2 defines them, of a pair.
struct Vectors {
    i: DVec3,
    o: DVec3,
    h: DVec3,
    k: DVec3,
}

impl Vectors {
    fn of(pair: &DirectionPair) -> Self {
        let (i, o) = (pair.omega_i.vector(), pair.omega_o.vector());
        Self {
            i,
            o,
            h: (i + o) / 2.0,
            k: (i - o) / 2.0,
        }
    }

    fn h_bar(&self) -> f64 {
        self.h.truncate().length()
    }

    fn theta_h(&self) -> f64 {
        self.h_bar().atan2(self.h.z)
    }

    fn theta_d(&self) -> f64 {
        angle_between(self.i, self.o) / 2.0
    }

    fn phi_h(&self) -> f64 {
        self.h.y.atan2(self.h.x)
    }

    fn phi_k(&self) -> f64 {
        self.k.y.atan2(self.k.x)
    }

    /// d of section 2, by the two rotations of 000 (Rusinkiewicz's).
    fn d(&self) -> DVec3 {
        rot_b(-self.theta_h()) * rot_n(-self.phi_h()) * self.i
    }

    fn phi_d(&self) -> f64 {
        let d = self.d();
        d.y.atan2(d.x)
    }
}

/// Rotation about the bi-normal b = y.
fn rot_b(angle: f64) -> DMat3 {
    DMat3::from_rotation_y(angle)
}

/// Rotation about the normal n = z.
fn rot_n(angle: f64) -> DMat3 {
    DMat3::from_rotation_z(angle)
}

/// Both directions uniform on the hemisphere.
fn pairs(seed: u64, count: u64) -> impl Iterator<Item = DirectionPair> {
    let random = Random::new(seed);
    (0..count).map(move |i| random_pair(&random, i))
}

fn warped(name: &str, symmetry: Symmetry, axis: &str, warp: WarpSpec) -> Arc<dyn Parametrization> {
    let entry = parametrization::find(name).expect("in the registry");
    let warps = BTreeMap::from([(axis.to_owned(), warp)]);
    entry.warped(symmetry, &warps).expect("the axis has it")
}

/// Difference of two angles, in [0, π].
fn turn(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(TAU);
    d.min(TAU - d)
}

#[track_caller]
fn assert_close(what: &str, a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{what}: {a} and {b}");
}

// Appendix: |h|² = (1 + omega_i·omega_o)/2, |k|² = (1 − omega_i·omega_o)/2, |h|² + |k|² = 1, h·k = 0.
#[test]
fn half_and_back_vector_are_orthogonal_legs_of_a_unit_hypotenuse() {
    for pair in pairs(10, 10_000) {
        let v = Vectors::of(&pair);
        let (hh, kk) = (v.h.length_squared(), v.k.length_squared());
        assert_close("|h|²", hh, (1.0 + v.i.dot(v.o)) / 2.0, ULPS);
        assert_close("|k|²", kk, (1.0 - v.i.dot(v.o)) / 2.0, ULPS);
        assert_close("|h|² + |k|²", hh + kk, 1.0, ULPS);
        assert_close("h·k", v.h.dot(v.k), 0.0, ULPS);
        let (h, k) = (pair.half(), pair.back());
        assert_eq!((h, k), (v.h, v.k), "the library's h and k");
        let (h, k) = pair.half_and_back();
        // The rounding of the definitions is removed: |h·k| is an ulp of |h||k|, not of 1.
        assert!(h.dot(k).abs() <= 4.0 * f64::EPSILON * h.length() * k.length());
    }
}

// Appendix: cos theta_d = omega_i·ĥ = |h| = sqrt(1 − |k|²); so sin theta_d = |k|.
#[test]
fn the_lengths_of_h_and_k_are_cosine_and_sine_of_theta_d() {
    let p = form("half-difference", ISOTROPIC);
    for pair in pairs(11, 10_000) {
        let v = Vectors::of(&pair);
        let [_, theta_d, ..] = p.forward(&pair);
        assert_close("|h|", v.h.length(), theta_d.cos(), ULPS);
        assert_close("|k|", v.k.length(), theta_d.sin(), ULPS);
        assert_close("d", v.i.dot(v.h.normalize()), theta_d.cos(), ULPS);
        assert_close("Kahan", v.theta_d(), theta_d, ULPS);
    }
}

// Section 3, specular test function: "|h_bar|² = sin theta_h cos theta_d". Erratum: no square. The
// appendix has it right: |h_bar|² = (1 − cos² theta_h)(1 − sin² theta_d).
#[test]
fn erratum_projected_half_vector_is_sin_theta_h_cos_theta_d_without_the_square() {
    let p = form("half-difference", ISOTROPIC);
    let mut printed = Vec::new();
    for pair in pairs(12, 10_000) {
        let h_bar = Vectors::of(&pair).h_bar();
        let [theta_h, theta_d, ..] = p.forward(&pair);
        let product = theta_h.sin() * theta_d.cos();
        assert_close("|h_bar|", h_bar, product, ULPS);
        let appendix = (1.0 - theta_h.cos().powi(2)) * (1.0 - theta_d.sin().powi(2));
        assert_close("|h_bar|²", h_bar * h_bar, appendix, ULPS);
        printed.push((h_bar * h_bar - product).abs());
    }
    let median = quantile(&mut printed, 0.5);
    println!("|h_bar|² − sin theta_h cos theta_d: median {median:.3}");
    // x − x² of a length: 0.25 at most, and 0 only at 0 and 1.
    assert!(median > 0.15, "the printed form is off by {median}");
}

// Section 3: F = 1 − cos theta_d = 1 − |h|, a function of one coordinate in half/difference (theta_d)
// and hybrid (|k|), but not in orthographic coordinates, where it bends away from phi_k = 90°.
#[test]
fn fresnel_test_function_is_aligned_with_half_difference_and_hybrid_but_not_orthographic() {
    let fresnel = |pair: &DirectionPair| {
        let v = Vectors::of(pair);
        1.0 - v.i.dot(v.h.normalize())
    };
    let hybrid = form("hybrid", ISOTROPIC);
    let half = form("half-difference", ISOTROPIC);
    for pair in pairs(13, 10_000) {
        let f = fresnel(&pair);
        assert_close("1 − |h|", f, 1.0 - pair.half().length(), ULPS);
        assert_close("theta_d", f, 1.0 - half.forward(&pair)[1].cos(), ULPS);
        let k = hybrid.forward(&pair)[1];
        // 1 − k² cancels near k = 1: its root keeps half the digits of what is left.
        let root = ((1.0 - k) * (1.0 + k)).sqrt();
        assert_close("|k|", f, 1.0 - root, ULPS / root);
    }
    let orthographic = form("orthographic", ISOTROPIC);
    let at = |delta: f64| fresnel(&orthographic.inverse(&[0.5, 0.4, delta, 0.0]).unwrap());
    // At 90° k lies in the tangent plane, |k| = |k_bar|; at 0° it rises out of it.
    assert_close("at 90°", at(FRAC_PI_2), 1.0 - (1.0f64 - 0.16).sqrt(), ULPS);
    println!("F at |h_bar| = 0.5, |k_bar| = 0.4: {:.4} at 0°", at(0.0));
    assert!(at(0.0) - at(FRAC_PI_2) > 0.04, "{}", at(0.0));
}

// Section 3: S = 1 − |h_bar| (000). Erratum of 001, which prints 1 − |h|: that is F, not aligned with
// the horizontal axis of the orthographic and hybrid parametrizations.
#[test]
fn erratum_specular_test_function_is_one_minus_the_projected_half_vector() {
    for name in ["orthographic", "hybrid"] {
        let p = form(name, ISOTROPIC);
        let at = |delta: f64, k: f64| Vectors::of(&p.inverse(&[0.4, k, delta, 0.0]).unwrap());
        let mut printed = Vec::new();
        for step in 0..10 {
            let v = at(0.15 * f64::from(step), 0.04 * f64::from(step));
            assert_close("S", 1.0 - v.h_bar(), 1.0 - 0.4, ULPS);
            printed.push(1.0 - v.h.length());
        }
        // The axis |h_bar| is fixed, so an aligned function would not move.
        let spread = quantile(&mut printed, 1.0) - quantile(&mut printed, 0.0);
        assert!(spread > 0.05, "{name}: 1 − |h| moves by {spread} only");
    }
    // And in half/difference coordinates S is distorted, "independently of phi_d".
    let p = form("half-difference", ISOTROPIC);
    let s = |theta_d: f64, phi_d: f64| {
        1.0 - Vectors::of(&p.inverse(&[0.5, theta_d, phi_d, 0.0]).unwrap()).h_bar()
    };
    assert!(s(1.0, 0.7) - s(0.1, 0.7) > 0.2);
    assert_close("phi_d", s(0.6, 0.3), s(0.6, 1.2), ULPS);
}

// Section 3 and the appendix's last line: at phi_k = 90° theta_k is 90°, k equals k_bar, the
// orthographic and hybrid parametrizations are identical, and isolines of G are circles.
#[test]
fn orthographic_and_hybrid_are_identical_at_phi_k_90() {
    let (orthographic, hybrid) = (form("orthographic", ISOTROPIC), form("hybrid", ISOTROPIC));
    let mut sobol = Sobol::new(16);
    let (mut seen, mut apart) = (0, 0.0f64);
    for i in 0..4_000 {
        let [a, b]: [f64; 2] = sobol.point(i);
        let Some(p) = orthographic.inverse(&[a, b, FRAC_PI_2, 0.0]) else {
            assert!(hybrid.inverse(&[a, b, FRAC_PI_2, 0.0]).is_none());
            continue;
        };
        let q = hybrid
            .inverse(&[a, b, FRAC_PI_2, 0.0])
            .expect("the same disc");
        // sqrt(1 − r²) doubles the relative rounding of 1 − r².
        let cos = p.omega_i.cos_theta();
        assert!(
            distance(&p, &q, ISOTROPIC) < 4e-16 / cos.max(1e-8),
            "{a} {b}"
        );
        let v = Vectors::of(&p);
        assert!(v.k.z.abs() < 4e-16 / cos.max(1e-8), "theta_k is 90°");
        let product = v.i.z * v.o.z;
        assert_close("circle", product, 1.0 - a * a - b * b, ULPS);
        seen += 1;
        if let (Some(p), Some(q)) = (
            orthographic.inverse(&[a, b, 0.6, 0.0]),
            hybrid.inverse(&[a, b, 0.6, 0.0]),
        ) {
            apart = apart.max(distance(&p, &q, ISOTROPIC));
        }
    }
    // A quarter disc of the unit square.
    assert_close("share", f64::from(seen) / 4_000.0, PI / 4.0, 2e-3);
    assert!(apart > 0.1, "away from 90° they differ by {apart}");
}

// Section 3 and appendix, phi_k = phi_h + phi_d. Erratum: false in general. True:
// phi_k − phi_h = atan2(sin phi_d, cos theta_h cos phi_d), and back.
#[test]
fn erratum_phi_k_is_not_phi_h_plus_phi_d() {
    let mut printed = Vec::new();
    let p = form("half-difference", Symmetry::NONE);
    let q = form("hybrid", Symmetry::NONE);
    for pair in pairs(18, 100_000) {
        let v = Vectors::of(&pair);
        let [theta_h, phi_h, _, phi_d] = p.forward(&pair);
        let [_, hybrid_phi_h, _, phi_k] = q.forward(&pair);
        assert!(turn(phi_h, hybrid_phi_h) < 1e-12 / theta_h.min(1.0));
        // Azimuths lose the digits that short projections do not have.
        let k_bar = v.k.truncate().length();
        let rounding = 4e-16 / v.h_bar().min(k_bar).min(1.0);
        let (s, c) = phi_d.sin_cos();
        let there = s.atan2(theta_h.cos() * c);
        assert!(turn(phi_k - phi_h, there) < 8.0 * rounding, "{pair:?}");
        let (s, c) = (phi_k - phi_h).sin_cos();
        let back = (theta_h.cos() * s).atan2(c);
        // 1/cos theta_h: near theta_h = 90° Δ jumps and phi_d with it.
        assert!(
            turn(phi_d, back) < 8.0 * rounding / theta_h.cos(),
            "{pair:?}"
        );
        assert!(turn(phi_d, v.phi_d()) < 16.0 * rounding, "{pair:?}");
        printed.push(turn(phi_k, phi_h + phi_d).to_degrees());
    }
    let (median, worst) = (quantile(&mut printed, 0.5), quantile(&mut printed, 1.0));
    println!("phi_k − phi_h − phi_d: median {median:.2}°, worst of random pairs {worst:.1}°");
    // Standard error of the median of 1e5 such errors, from their density: 0.03°.
    assert_close("median", median, 4.3, 0.1);
    assert!(worst < 90.0);

    // Up to 90° in the limit theta_h → 90°: there Δ is 90° for any phi_d > 0, however small.
    let mut limit = 0.0f64;
    for e in 1..8 {
        let theta_h = FRAC_PI_2 - 10f64.powi(-e);
        let phi_d = 10f64.powf(-0.5 * f64::from(e));
        // Both directions are above the horizon: theta_d is smaller than 90° − theta_h.
        let coords = [theta_h, 0.0, 0.1 * 10f64.powi(-e), phi_d];
        let v = Vectors::of(&p.inverse(&coords).expect("above the horizon"));
        limit = limit.max(turn(v.phi_k(), v.phi_h() + phi_d));
    }
    println!(
        "largest error towards theta_h = 90°: {:.3}°",
        limit.to_degrees()
    );
    assert!(limit < FRAC_PI_2 && limit.to_degrees() > 89.9);
}

// Section 3: "any slice in the hybrid parametrization corresponds to a warped slice in the
// half/difference parametrization". Erratum: at fixed phi only for phi = 0, 90, 180, 270° or theta_h = 0.
#[test]
fn erratum_slices_at_fixed_azimuth_correspond_at_quarter_turns_only() {
    let (hybrid, half) = (
        form("hybrid", ISOTROPIC),
        form("half-difference", ISOTROPIC),
    );
    let spread = |delta: f64, h_bar_from: f64| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut seen = 0;
        for i in 0..40 {
            for j in 1..40 {
                let h_bar = h_bar_from + f64::from(i) / 41.0 * (1.0 - h_bar_from);
                let coords = [h_bar, f64::from(j) / 41.0, delta, 0.0];
                let Some(pair) = hybrid.inverse(&coords) else {
                    continue;
                };
                // Away from the horizon: there the inverse knows k_z to 1e-8 only.
                if pair.omega_i.cos_theta().min(pair.omega_o.cos_theta()) < 1e-3 {
                    continue;
                }
                let away = half.forward(&pair)[2] - delta;
                let away = away - TAU * (away / TAU).round();
                (low, high) = (low.min(away), high.max(away));
                seen += 1;
            }
        }
        assert!(seen > 300, "{seen}");
        (low, high)
    };
    for quarter in -1..=2 {
        let (low, high) = spread(f64::from(quarter) * FRAC_PI_2, 0.01);
        assert!(
            low.abs().max(high.abs()) < 1e-10,
            "{quarter}: {low:e} {high:e}"
        );
    }
    for degrees in [
        1.0, 10.0, 30.0, 45.0, 60.0, 80.0, 89.0, 100.0, 135.0, -20.0, -110.0,
    ] {
        let (low, high) = spread(f64::to_radians(degrees), 0.01);
        println!(
            "Δ = {degrees}°: phi_d − Δ in [{:.2}°, {:.2}°]",
            low.to_degrees(),
            high.to_degrees()
        );
        assert!(
            (high - low).to_degrees() > 0.5,
            "{degrees}° is a slice of phi_d"
        );
    }
    // theta_h = 0 in the limit (the coordinate itself is 0 at the pole): error ~ theta_h²/4.
    for e in 1..7 {
        let h_bar = 10f64.powi(-e);
        let pair = hybrid.inverse(&[h_bar, 0.5, 0.6, 0.0]).unwrap();
        let error = (half.forward(&pair)[2] - 0.6).abs();
        assert!(error < h_bar * h_bar + 1e-9, "{h_bar:e}: {error:e}");
    }
}

// Section 3 and appendix: (|h_bar|, |k|) and (theta_h, theta_d) are related by a 2-D warp, exactly:
// cos² theta_h = (1 − |h_bar|² − |k|²)/(1 − |k|²), cos² theta_d = 1 − |k|².
#[test]
fn hybrid_lengths_are_a_two_dimensional_warp_of_half_difference_angles() {
    let (hybrid, half) = (
        form("hybrid", ISOTROPIC),
        form("half-difference", ISOTROPIC),
    );
    for pair in pairs(19, 10_000) {
        let [theta_h, theta_d, ..] = half.forward(&pair);
        let [h_bar, k, ..] = hybrid.forward(&pair);
        assert_close("|h_bar|", h_bar, theta_h.sin() * theta_d.cos(), ULPS);
        assert_close("|k|", k, theta_d.sin(), ULPS);
        let (hh, kk) = (h_bar * h_bar, k * k);
        let cos2 = (1.0 - hh - kk) / (1.0 - kk);
        // 1 − |k|² → 0 towards opposed grazing directions.
        let rounding = ULPS / (1.0 - kk);
        assert_close("cos² theta_h", cos2, theta_h.cos().powi(2), rounding);
        assert_close("cos² theta_d", 1.0 - kk, theta_d.cos().powi(2), ULPS);
        let hn = Vectors::of(&pair).h.z;
        assert_close("(h·n)²", hn * hn, 1.0 - kk - hh, ULPS);
    }
}

// Section 3: "reducing a BRDF dimensionality to 2 by means of projection will yield the exact same
// approximations in both". The circles projected along are the same (test above); the averages are
// only if both weigh a circle alike: uniform in phi_k is not uniform in phi_d.
#[test]
fn projections_to_two_dimensions_agree_only_with_the_same_weight_on_the_circle() {
    let (hybrid, half) = (
        form("hybrid", ISOTROPIC),
        form("half-difference", ISOTROPIC),
    );
    let (theta_h, theta_d) = (0.8f64, 0.6f64);
    let coords = [theta_h.sin() * theta_d.cos(), theta_d.sin()];
    let product = |pair: DirectionPair| pair.omega_i.cos_theta() * pair.omega_o.cos_theta();
    let (mut by_phi_d, mut by_phi_k, mut reweighted) = (0.0, 0.0, 0.0);
    let n = 1_000;
    for i in 0..n {
        let phi = TAU * (f64::from(i) + 0.5) / f64::from(n);
        let at_d = product(half.inverse(&[theta_h, theta_d, phi, 0.0]).unwrap());
        let at_k = product(hybrid.inverse(&[coords[0], coords[1], phi, 0.0]).unwrap());
        by_phi_d += at_d / f64::from(n);
        by_phi_k += at_k / f64::from(n);
        // d phi_d / dΔ of phi_d = atan2(cos theta_h sin Δ, cos Δ).
        let (s, c) = phi.sin_cos();
        let slope = theta_h.cos() / (c * c + (theta_h.cos() * s).powi(2));
        reweighted += at_k * slope / f64::from(n);
    }
    println!("mean product of cosines: {by_phi_d:.6} over phi_d, {by_phi_k:.6} over phi_k");
    assert!((by_phi_d - by_phi_k).abs() > 0.01);
    // The midpoint rule on a smooth periodic function is exact to rounding.
    assert_close("reweighted", reweighted, by_phi_d, 1e-13);
}

// Section 2: reciprocity is phi_d → phi_d + π (half/difference), phi_k → phi_k + π (orthographic and
// hybrid), nothing else moving.
#[test]
fn reciprocity_turns_the_second_azimuth_by_half_a_turn() {
    for name in ["half-difference", "orthographic", "hybrid", "stark"] {
        let p = form(name, Symmetry::NONE);
        for pair in pairs(20, 5_000) {
            let (c, d) = (p.forward(&pair), p.forward(&pair.swapped()));
            let rounding = 1e-14 / Vectors::of(&pair).h_bar().min(c[2]).min(1.0);
            assert_close("r1", c[0], d[0], ULPS);
            assert_close("r2", c[2], d[2], ULPS);
            assert!(turn(c[1], d[1]) < rounding, "{name} {pair:?}");
            // The projection of k may be shorter than k.
            let k_bar = pair.back().truncate().length();
            assert!(
                turn(c[3], d[3] + PI) < rounding + 1e-14 / k_bar,
                "{name} {pair:?}"
            );
        }
    }
}

// Section 2: d = rot(b, −theta_h) rot(n, −phi_h) omega_i (000) describes omega_i where ĥ is the north
// pole. Erratum of 001, which prints rot(n, −theta_h) rot(b, −phi_h).
#[test]
fn erratum_rotation_axes_of_the_difference_vector() {
    let p = form("half-difference", Symmetry::NONE);
    let mut swapped_axes = Vec::new();
    for pair in pairs(21, 10_000) {
        let v = Vectors::of(&pair);
        let [theta_h, phi_h, theta_d, phi_d] = p.forward(&pair);
        let h = v.h.normalize();
        let right = |x: DVec3| rot_b(-theta_h) * rot_n(-phi_h) * x;
        assert!((right(h) - DVec3::Z).length() < ULPS, "ĥ becomes the pole");
        let d = Direction::from_spherical(theta_d, phi_d).vector();
        assert!(
            (right(v.i) - d).length() < 4.0 * ULPS / v.h.length(),
            "{pair:?}"
        );
        let wrong = rot_n(-theta_h) * rot_b(-phi_h) * h;
        swapped_axes.push(angle_between(wrong, DVec3::Z).to_degrees());
        // Equations 1 and 2, back.
        let i = rot_n(phi_h) * rot_b(theta_h) * d;
        assert!((i - v.i).length() < 4.0 * ULPS / v.h.length());
        assert!((2.0 * i.dot(h) * h - i - v.o).length() < 8.0 * ULPS / v.h.length());
    }
    let median = quantile(&mut swapped_axes, 0.5);
    println!("axes swapped: ĥ lands {median:.0}° from the pole in the median");
    assert!(median > 45.0);
}

// Appendix: "Since d_bar makes an angle phi_d with b". Erratum: with t. (k = rot rot d_bar holds.)
#[test]
fn erratum_phi_d_is_measured_from_the_tangent() {
    let p = form("half-difference", Symmetry::NONE);
    for pair in pairs(22, 5_000) {
        let v = Vectors::of(&pair);
        let [theta_h, phi_h, theta_d, phi_d] = p.forward(&pair);
        let d = v.d();
        let d_bar = DVec3::new(d.x, d.y, 0.0);
        let k = rot_n(phi_h) * rot_b(theta_h) * d_bar;
        let rounding = 4.0 * ULPS / v.h.length();
        assert!((k - v.k).length() < rounding, "{pair:?}");
        assert_close("t", d_bar.x, theta_d.sin() * phi_d.cos(), rounding);
        assert_close("b", d_bar.y, theta_d.sin() * phi_d.sin(), rounding);
    }
    // At phi_d = 0, light in the plane of n and h, d_bar is along t and at 90° to b.
    let pair = p.inverse(&[0.4, 0.3, 0.5, 0.0]).unwrap();
    let d = Vectors::of(&pair).d();
    assert!(d.x > 0.4 && d.y.abs() < ULPS);
}

// Section 2: for isotropic BRDFs phi_h is dropped. In half/difference coordinates that is all; in
// orthographic and hybrid ones phi_k turns with the sample too, and what is left is phi_k − phi_h.
#[test]
fn erratum_isotropic_coordinates_keep_the_difference_of_azimuths() {
    for pair in pairs(23, 2_000) {
        let angle = 1.0 + pair.omega_i.cos_theta();
        let spin = |d: Direction| Direction::try_new(rot_n(angle) * d.vector()).unwrap();
        let turned = DirectionPair::new(spin(pair.omega_i), spin(pair.omega_o));
        let v = Vectors::of(&pair);
        let k_bar = v.k.truncate().length();
        let rounding = 1e-14 / v.h_bar().min(k_bar).min(1.0);
        for entry in polar() {
            let p = entry.form(ISOTROPIC);
            let (c, d) = (p.forward(&pair), p.forward(&turned));
            assert_close("r1", c[0], d[0], ULPS);
            assert_close("r2", c[1], d[1], ULPS);
            let projection = v.i.truncate().length().min(v.o.truncate().length());
            assert!(
                turn(c[2], d[2]) < rounding + 1e-14 / projection,
                "{}",
                entry.kind
            );
        }
        let moved = |name: &str, axis: usize| {
            let p = form(name, Symmetry::NONE);
            turn(p.forward(&pair)[axis], p.forward(&turned)[axis])
        };
        for (name, axis) in [
            ("half-difference", 1),
            ("orthographic", 1),
            ("orthographic", 3),
            ("hybrid", 1),
            ("hybrid", 3),
        ] {
            assert_close(name, moved(name, axis), angle, rounding);
        }
        assert!(moved("half-difference", 3) < rounding);
    }
}

// Section 2: rho(theta_i, theta_o, |phi_i − phi_o|) for isotropic BRDFs. The absolute value assumes a
// mirror symmetry on top: isotropy alone does not join the two signs.
#[test]
fn absolute_azimuth_difference_assumes_bilateral_symmetry() {
    let left = DirectionPair::from_spherical(0.9, 1.1, 0.5, 0.2);
    let right = DirectionPair::from_spherical(0.9, 0.2, 0.5, 1.1);
    let bilateral = Symmetry {
        bilateral: true,
        ..ISOTROPIC
    };
    assert!(distance(&left, &right, ISOTROPIC) > 0.3);
    assert!(distance(&left, &right, bilateral) < 1e-15);
    let c = |s| form("spherical", s).forward(&left);
    let d = |s| form("spherical", s).forward(&right);
    assert_close("signed", c(ISOTROPIC)[2], -d(ISOTROPIC)[2], ULPS);
    assert_close("absolute", c(bilateral)[2], d(bilateral)[2], ULPS);
    assert!(c(ISOTROPIC)[2] > 0.8);
}

// Section 2: alpha = |k|², sigma = |h_bar|² (Stark et al., equations 35 and 36).
#[test]
fn stark_coordinates_are_squares_of_the_hybrid_lengths() {
    for symmetry in [Symmetry::NONE, ISOTROPIC, Symmetry::FULL] {
        let (stark, hybrid) = (form("stark", symmetry), form("hybrid", symmetry));
        let second = stark
            .axes()
            .iter()
            .position(|a| a.symbol == "alpha")
            .unwrap();
        for pair in pairs(24, 5_000) {
            let v = Vectors::of(&pair);
            let (s, h) = (stark.forward(&pair), hybrid.forward(&pair));
            assert_close("sigma", s[0], v.h_bar().powi(2), ULPS);
            assert_close("alpha", s[second], v.k.length_squared(), ULPS);
            for d in 0..4 {
                let square = d == 0 || d == second;
                let expected = if square { h[d] * h[d] } else { h[d] };
                assert_close("hybrid", s[d], expected, ULPS);
            }
        }
    }
}

/// Share of the isotropic box that is above the horizon, by Sobol points.
fn physical_share(p: &dyn Parametrization) -> f64 {
    let count = 1 << 19;
    let mut sobol = Sobol::new(25);
    let mut inside = 0;
    for i in 0..count {
        let u: [f64; 3] = sobol.point(i);
        let mut c = [0.0; 4];
        for (d, axis) in p.axes().iter().enumerate() {
            c[d] = axis.range[0] + axis.length() * u[d];
        }
        inside += u64::from(p.inverse(&c).is_some());
    }
    inside as f64 / count as f64
}

/// Share of the isotropic box that is above the horizon, by midpoints in the radial coordinates and
/// in closed form in the azimuth: `steep` is T² where |cos azimuth| < 1/T is the valid part.
fn closed_form_share(steep: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 500;
    let middle = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
    let valid = |t2: f64| match t2 {
        t2 if t2 <= 1.0 => 1.0,
        t2 => 1.0 - t2.sqrt().recip().acos() / FRAC_PI_2,
    };
    let rows = (0..n).flat_map(|i| (0..n).map(move |j| (middle(i), middle(j))));
    rows.map(|(a, b)| valid(steep(a, b))).sum::<f64>() / f64::from(n * n)
}

// The valid set is a box in spherical coordinates only.
#[test]
fn physical_shares_of_the_isotropic_box() {
    // h_z > |k_z| in each set of coordinates.
    let half = |a: f64, b: f64| ((a * FRAC_PI_2).tan() * (b * FRAC_PI_2).tan()).powi(2);
    let orthographic = |a: f64, b: f64| match 1.0 - a * a - b * b {
        m if m > 0.0 => (2.0 * a * b / m).powi(2),
        _ => f64::INFINITY,
    };
    let hybrid = |a: f64, b: f64| match 1.0 - a * a - b * b {
        hz2 if hz2 > 0.0 => a * a * (b * b - hz2) / (hz2 * hz2),
        _ => f64::INFINITY,
    };
    let plain = |name| form(name, Symmetry::FULL);
    let bent = |name, axis, warp| warped(name, Symmetry::FULL, axis, warp);
    let root = WarpSpec::SquareRoot;
    let shares = [
        (plain("spherical"), closed_form_share(|_, _| 0.0), 1.0),
        (plain("half-difference"), closed_form_share(half), 0.617),
        (
            bent("half-difference", "theta_h", root),
            closed_form_share(|a, b| half(a * a, b)),
            0.752,
        ),
        (
            bent("half-difference", "theta_h", WarpSpec::Merl),
            closed_form_share(|a, b| half(a * a, b)),
            0.752,
        ),
        (
            plain("orthographic"),
            closed_form_share(orthographic),
            0.583,
        ),
        (plain("hybrid"), closed_form_share(hybrid), 0.699),
        (
            bent("hybrid", "h_bar", root),
            closed_form_share(|a, b| hybrid(a * a, b)),
            0.811,
        ),
    ];
    for (p, exact, digits) in shares {
        let share = physical_share(&*p);
        let what = format!("{} {}", p.name(), p.warp_name());
        println!("{what}: {share:.5} by points, {exact:.5} by quadrature");
        // Half a unit of the third digit, and the midpoint rule: halving its step moves ≤ 4e-5.
        assert_close(&what, exact, digits, 5.4e-4);
        // 2^19 points: measured within 2e-4.
        assert_close(&what, share, exact, 4e-4);
    }
    // Folding drops mirror images of both sets alike: the share is that of the unfolded box.
    for name in ["half-difference", "orthographic", "hybrid"] {
        let (folded, whole) = (form(name, Symmetry::FULL), form(name, ISOTROPIC));
        let (a, b) = (physical_share(&*folded), physical_share(&*whole));
        assert_close(name, a, b, 4e-4);
    }
}

// The condition behind the shares: both directions are above the horizon exactly if h_z > |k_z|.
#[test]
fn valid_coordinates_are_those_with_h_z_above_k_z() {
    let mut sobol = Sobol::new(26);
    let hybrid = form("hybrid", ISOTROPIC);
    let half = form("half-difference", ISOTROPIC);
    let orthographic = form("orthographic", ISOTROPIC);
    let mut checked = 0;
    for i in 0..20_000 {
        let [a, b, c]: [f64; 3] = sobol.point(i);
        let delta = PI * (2.0 * c - 1.0);
        let mut check = |p: &dyn Parametrization, coords: [f64; 4], margin: f64| {
            // Closer to the horizon than rounding, either answer is right.
            if margin.abs() > 1e-12 {
                assert_eq!(
                    p.inverse(&coords).is_some(),
                    margin > 0.0,
                    "{} {coords:?}",
                    p.name()
                );
                checked += 1;
            }
        };
        // Half/difference: cos d cos h > sin d sin h |cos phi_d|.
        let (th, td) = (a * FRAC_PI_2, b * FRAC_PI_2);
        let margin = td.cos() * th.cos() - td.sin() * th.sin() * delta.cos().abs();
        check(&*half, [th, td, delta, 0.0], margin);
        // Hybrid: h_z² > |k|² |h_bar|² cos² Δ / (h_z² + |h_bar|² cos² Δ).
        let (hz2, down2) = (1.0 - a * a - b * b, (a * delta.cos()).powi(2));
        let margin = hz2.min(hz2 * (hz2 + down2) - b * b * down2);
        check(&*hybrid, [a, b, delta, 0.0], margin);
        // Orthographic: |h_bar ± k_bar| < 1.
        let margin = 1.0 - a * a - b * b - 2.0 * a * b * delta.cos().abs();
        check(&*orthographic, [a, b, delta, 0.0], margin);
    }
    assert!(checked > 59_900, "{checked}");
}

// Why atan2: "cos theta_d = omega_i·ĥ" and the like, taken literally with acos, lose half the digits
// near the mirror direction (theta_h → 0) and near retro-reflection (theta_d → 0).
#[test]
fn acos_loses_half_the_digits_near_mirror_and_retro() {
    let p = form("half-difference", ISOTROPIC);
    let mut worst = [0.0f64; 4];
    for step in 0..200 {
        let small = 10f64.powf(-6.0 - 0.05 * f64::from(step));
        // Near retro: light and sensor 2·small apart in elevation, theta_d = small.
        let retro = DirectionPair::from_spherical(0.7 + small, 0.3, 0.7 - small, 0.3);
        let v = Vectors::of(&retro);
        let naive = v.i.dot(v.h.normalize()).min(1.0).acos();
        worst[0] = worst[0].max((naive - small).abs());
        worst[1] = worst[1].max((p.forward(&retro)[1] - small).abs());
        // Near mirror: opposite azimuths, elevations 0.7 ± small: theta_h = small.
        let mirror = DirectionPair::from_spherical(0.7 + small, 0.3, 0.7 - small, 0.3 + PI);
        let v = Vectors::of(&mirror);
        let naive = (v.h.z / v.h.length()).min(1.0).acos();
        worst[2] = worst[2].max((naive - small).abs());
        worst[3] = worst[3].max((p.forward(&mirror)[0] - small).abs());
    }
    let [naive_retro, retro, naive_mirror, mirror] = worst;
    println!(
        "retro: acos {naive_retro:.1e}, ours {retro:.1e}; \
         mirror: acos {naive_mirror:.1e}, ours {mirror:.1e}"
    );
    assert!(naive_retro >= 1e-8 && naive_mirror >= 1e-8);
    // The directions themselves are rounded to 1e-16.
    assert!(retro < 1e-15 && mirror < 1e-15);
}

/// The q-quantile; sorts its argument.
fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}
