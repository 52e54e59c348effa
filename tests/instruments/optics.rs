//! Averages over both apertures: closed forms, brute force, and what they do to a lobe.

use crate::common::{Level, levels, made, model};
use glam::DVec3;
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::geometry::{Direction, DirectionPair, Symmetry, angle_between};
use gonio::instrument::{Average, Filling, Optics, Tolerance, Workspace};
use gonio::sampling::{Sobol, gauss_legendre};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Mutex;

levels! {
    lobes_far_narrower_than_the_apertures_are_found: "thorough: three widths";
    apertures_widen_a_lobe_by_their_second_moments: "thorough: four widths";
    any_aperture_at_any_elevation_comes_to_an_end: "thorough: every aperture at every elevation";
}

/// A BRDF of one formula, 0 below the horizon.
fn formula(f: impl Fn(&DirectionPair) -> f64 + Send + Sync) -> impl Brdf {
    made(Symmetry::NONE, move |pair| {
        Some([if pair.is_above_horizon() {
            f(pair)
        } else {
            0.0
        }])
    })
}

fn deg(x: f64) -> f64 {
    x.to_radians()
}

fn average(brdf: &dyn Brdf, pair: &DirectionPair, a: [f64; 2], relative: f64) -> Average {
    let tolerance = Tolerance {
        relative,
        refinement: 4_000_000,
        ..Tolerance::default()
    };
    let optics = Optics::new(a[0], a[1], tolerance);
    let mut work = Workspace::default();
    optics.average(brdf, pair, &mut work).expect("a value")
}

/// A right-handed frame with the direction as its third vector.
fn frame(c: DVec3) -> [DVec3; 3] {
    let x = c.any_orthonormal_vector();
    [x, c.cross(x), c]
}

/// Directions of a cap at cos = 1 − u (1 − cos a), azimuth 2πv.
fn cap([x, y, z]: [DVec3; 3], a: f64, u: f64, v: f64) -> DVec3 {
    let drop = u * 2.0 * (0.5 * a).sin().powi(2);
    let sin = (drop * (2.0 - drop)).sqrt();
    let (s, c) = (TAU * v).sin_cos();
    (x * c + y * s) * sin + z * (1.0 - drop)
}

/// Polar products: n nodes of Gauss in the cosine and 2n even azimuths on either cap.
fn brute(brdf: &dyn Brdf, pair: &DirectionPair, a: [f64; 2], n: usize) -> f64 {
    let rule = gauss_legendre(n);
    let nodes = |c: Direction, a: f64| -> Vec<(DVec3, f64)> {
        if a == 0.0 {
            return vec![(c.vector(), 1.0)];
        }
        let frame = frame(c.vector());
        let mut all = Vec::new();
        for (x, w) in &rule {
            for k in 0..2 * n {
                let v = (k as f64 + 0.37) / (2 * n) as f64;
                all.push((cap(frame, a, 0.5 * (1.0 + x), v), *w));
            }
        }
        all
    };
    let (light, sensor) = (nodes(pair.omega_i, a[0]), nodes(pair.omega_o, a[1]));
    let sums: Vec<[f64; 2]> = light
        .par_iter()
        .map(|(i, wi)| {
            let mut sums = [0.0; 2];
            if i.z <= 0.0 {
                return sums;
            }
            for (o, wo) in &sensor {
                if o.z <= 0.0 {
                    continue;
                }
                let pair = DirectionPair::new(Direction::from_unit(*i), Direction::from_unit(*o));
                let w = wi * wo * i.z;
                sums[0] += w * brdf.luminance(&pair).expect("a value");
                sums[1] += w;
            }
            sums
        })
        .collect();
    let total = |k: usize| sums.iter().map(|s| s[k]).sum::<f64>();
    total(0) / total(1)
}

fn mirror(theta: f64, off: f64, side: f64) -> DirectionPair {
    DirectionPair::from_spherical(theta, 0.0, theta + off, PI + side)
}

/// What is meant to be hard: on the mirror direction, beside it, far from it, grazing.
fn geometries() -> Vec<(&'static str, DirectionPair)> {
    let pair = DirectionPair::from_spherical;
    vec![
        ("mirror at the normal", mirror(0.0, 0.0, 0.0)),
        ("mirror", mirror(deg(45.0), 0.0, 0.0)),
        ("inside the mirror", mirror(deg(45.0), deg(0.7), deg(0.5))),
        ("edge of the mirror", mirror(deg(45.0), deg(1.9), deg(0.5))),
        ("beside the mirror", mirror(deg(45.0), deg(4.0), deg(2.5))),
        ("grazing mirror", mirror(deg(80.0), 0.0, 0.0)),
        (
            "inside the grazing mirror",
            mirror(deg(80.0), deg(0.7), deg(2.0)),
        ),
        ("retro", pair(deg(50.0), 0.0, deg(50.0), 0.0)),
        ("anywhere", pair(deg(50.0), 0.0, deg(10.0), 1.0)),
        ("grazing", pair(deg(87.0), 0.0, deg(85.0), 2.5)),
    ]
}

const APERTURES: [[f64; 2]; 4] = [[1.0, 1.0], [0.3, 1.5], [0.0, 1.0], [1.0, 0.0]];

#[test]
fn a_constant_is_itself_even_where_the_horizon_cuts() {
    let brdf = model("lambert", "albedo = 0.5");
    for a in [[1.0, 2.0], [0.0, 3.0], [3.0, 0.0], [10.0, 5.0]] {
        for theta_i in [0.0, 30.0, 85.0, 88.0, 89.5, 89.99] {
            for theta_o in [0.0, 50.0, 87.5, 89.9] {
                let pair = DirectionPair::from_spherical(deg(theta_i), 0.2, deg(theta_o), 2.0);
                let got = average(&*brdf, &pair, a.map(deg), 1e-4);
                let want = 0.5 / PI;
                assert!(
                    (got.value[0] - want).abs() < 1e-12 * want,
                    "{a:?} {theta_i} {theta_o}"
                );
                let cut = theta_i + a[0] > 90.0 || theta_o + a[1] > 90.0;
                assert_eq!(got.clipped, cut, "{a:?} {theta_i} {theta_o}");
                assert!(got.evaluations < 4000);
            }
        }
    }
}

#[test]
fn cosines_have_their_closed_forms() {
    let of_sensor = formula(|p| p.omega_o.cos_theta());
    let of_light = formula(|p| p.omega_i.cos_theta());
    for a in [0.3, 2.0, 8.0].map(deg) {
        for theta in [0.0, 0.4, 1.0, 1.3] {
            let pair = DirectionPair::from_spherical(theta, 0.3, 1.2, 2.0);
            // ⟨ω⟩ over a cap is (1 + cos a)/2 of its centre; ⟨z²⟩ follows from ⟨cos²⟩ about the centre.
            let z = pair.omega_i.cos_theta();
            let first = 0.5 * (1.0 + a.cos());
            let about = (1.0 + a.cos() + a.cos().powi(2)) / 3.0;
            let second = z * z * about + (1.0 - z * z) * 0.5 * (1.0 - about);
            for (brdf, want) in [
                (&of_sensor as &dyn Brdf, pair.omega_o.cos_theta() * first),
                (&of_light, second / (z * first)),
            ] {
                for tolerance in [1e-2, 1e-4, 1e-6] {
                    let got = average(brdf, &pair, [a, a], tolerance);
                    let error = (got.value[0] - want).abs();
                    assert!(
                        error <= got.error[0],
                        "{a} {theta}: {error:e} {:e}",
                        got.error[0]
                    );
                    assert!(got.error[0] <= tolerance * want + 1e-12);
                }
            }
        }
        // Half of the light's cap below the horizon: integrals of z and z² over the other half.
        let pair = DirectionPair::from_spherical(0.5 * PI, 0.3, 0.2, 2.0);
        let first = a - a.sin() * a.cos();
        let second = 0.5 * PI * (2.0 / 3.0 - a.cos() + a.cos().powi(3) / 3.0);
        let got = average(&of_light, &pair, [a, 0.0], 1e-6);
        let error = (got.value[0] - second / first).abs();
        // 1e-11: the closed forms cancel at small angles.
        assert!(
            error <= got.error[0] + 1e-11 / a,
            "{a}: {error:e} {:e}",
            got.error[0]
        );
        assert!(got.clipped && got.error[0] <= 1e-6 * got.value[0]);
    }
}

#[test]
fn the_stated_error_bounds_the_true_one() {
    let mut worst = [0.0_f64; 2];
    for (alpha, n) in [(0.5, 10), (0.1, 16), (0.03, 20), (0.01, 24)] {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        for (name, pair) in geometries() {
            for a in APERTURES.map(|a| a.map(deg)) {
                let n = if a[0] * a[1] == 0.0 { 6 * n } else { n };
                let truth = brute(&*brdf, &pair, a, n);
                // A lower order says how good the truth is.
                let unsure = (truth - brute(&*brdf, &pair, a, n - n / 5)).abs() + 1e-12 * truth;
                if unsure > 1e-4 * truth {
                    continue;
                }
                for k in 2..=6 {
                    let tolerance = f64::powi(10.0, -k);
                    let got = average(&*brdf, &pair, a, tolerance);
                    let (value, error) = (got.value[0], got.error[0]);
                    let off = (value - truth).abs();
                    let text = format!(
                        "{alpha} {name} {a:.3?} 1e-{k}: off {:.1e} stated {:.1e} unsure {:.1e}, {} values",
                        off / truth,
                        error / truth,
                        unsure / truth,
                        got.evaluations
                    );
                    assert!(off <= error + unsure, "{text}");
                    assert!(error <= tolerance * value + 1e-12, "{text}");
                    worst[0] = worst[0].max((off - unsure) / error);
                    worst[1] = worst[1].max((off - unsure) / (tolerance * value));
                }
            }
        }
    }
    println!(
        "largest true error over stated {:.3}, over tolerance {:.3}",
        worst[0], worst[1]
    );
    assert!(worst[0] <= 1.0, "{worst:?}");
}

/// GGX lobes by importance sampling: light uniform in its cap, half vector from D cos θ_h, and what
/// meets the sensor's cap counts. Mean and standard error of 16 scrambled sets.
fn by_importance(brdf: &dyn Brdf, alpha: f64, pair: &DirectionPair, a: [f64; 2]) -> [f64; 2] {
    let light = frame(pair.omega_i.vector());
    let cos_cap = a[1].cos();
    let solid = TAU * 2.0 * (0.5 * a[1]).sin().powi(2);
    let mean_cos = pair.omega_i.cos_theta() * 0.5 * (1.0 + a[0].cos());
    let points = 1_u64 << 15;
    let means: Vec<f64> = (0..16_u64)
        .into_par_iter()
        .map(|seed| {
            let mut sobol = Sobol::new(seed);
            let mut sum = 0.0;
            for k in 0..points {
                let [u, v, s, t] = sobol.point(k);
                let i = cap(light, a[0], u, v);
                let slope2 = alpha * alpha * s / (1.0 - s);
                let cos_h = 1.0 / (1.0 + slope2).sqrt();
                let (y, x) = (TAU * t).sin_cos();
                let h = DVec3::new(x * slope2.sqrt(), y * slope2.sqrt(), 1.0) * cos_h;
                let o = 2.0 * i.dot(h) * h - i;
                if o.dot(pair.omega_o.vector()) < cos_cap || o.z <= 0.0 {
                    continue;
                }
                let d = (alpha / (alpha * alpha + slope2)).powi(2) / (PI * cos_h.powi(4));
                let density = d * cos_h / (4.0 * i.dot(h));
                let both = DirectionPair::new(Direction::from_unit(i), Direction::from_unit(o));
                sum += brdf.luminance(&both).expect("a value") * i.z / density;
            }
            sum / points as f64 / (solid * mean_cos)
        })
        .collect();
    let mean = means.iter().sum::<f64>() / 16.0;
    let square: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    [mean, (square / (15.0 * 16.0)).sqrt()]
}

fn lobes_far_narrower_than_the_apertures_are_found(level: Level) {
    for alpha in level.of(vec![0.003], vec![0.01, 0.003, 0.001]) {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        for (name, pair) in geometries().into_iter().take(7) {
            for a in [[1.0, 1.0], [0.3, 1.5], [0.02, 1.0]].map(|a| a.map(deg)) {
                let [truth, sigma] = by_importance(&*brdf, alpha, &pair, a);
                // What an aperture sees of a far tail is rarely drawn.
                if sigma > 3e-3 * truth {
                    continue;
                }
                for tolerance in [1e-2, 1e-4, 1e-5] {
                    let got = average(&*brdf, &pair, a, tolerance);
                    let (value, error) = (got.value[0], got.error[0]);
                    let text = format!(
                        "{alpha} {name} {a:.4?} {tolerance:e}: {value} ± {error:e}, {truth} ± {sigma:e}, {} values",
                        got.evaluations
                    );
                    if tolerance == 1e-4 {
                        println!("{text}");
                    }
                    // Five standard errors of sixteen sets.
                    assert!((value - truth).abs() <= error + 5.0 * sigma, "{text}");
                    assert!(error <= tolerance * value + 1e-12, "{text}");
                }
            }
        }
    }
}

#[test]
fn the_error_is_bounded_where_the_horizon_cuts() {
    for alpha in [0.5, 0.1, 0.03] {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        let pair = DirectionPair::from_spherical;
        for (pair, diverges) in [
            (pair(deg(89.7), 0.0, deg(40.0), PI), false),
            (pair(deg(40.0), 0.0, deg(89.7), 2.0), false),
            (mirror(deg(89.7), 0.0, 0.0), true),
        ] {
            for a in [[1.0, 1.0], [0.5, 1.5]].map(|a| a.map(deg)) {
                let truth = brute(&*brdf, &pair, a, 24);
                // Cells that straddle the horizon: the error falls with their width alone.
                let unsure = 3.0 * (truth - brute(&*brdf, &pair, a, 17)).abs();
                let got = average(&*brdf, &pair, a, 1e-3);
                let text = format!(
                    "{alpha} {pair:?} {a:?}: {} ± {:e}, {truth} ± {unsure:e}, {} values",
                    got.value[0], got.error[0], got.evaluations
                );
                println!("{text}");
                assert!(got.clipped);
                assert!(
                    (got.value[0] - truth).abs() <= got.error[0] + unsure,
                    "{text}"
                );
                // Where both directions meet the horizon f_r diverges; there the bound need only hold.
                assert!(diverges || got.error[0] <= 1e-3 * got.value[0], "{text}");
            }
        }
    }
}

#[test]
fn smooth_materials_cost_few_values() {
    let optics = Optics::new(deg(0.25), deg(0.5), Tolerance::default());
    let random = gonio::sampling::Random::new(4);
    for (kind, text, most) in [
        ("lambert", "albedo = 0.5", 40.0),
        ("oren-nayar", "", 60.0),
        ("ggx", "alpha = 0.5", 50.0),
        ("ggx", "alpha = 0.1", 100.0),
        ("ggx", "alpha = 0.01", 400.0),
    ] {
        let brdf = model(kind, text);
        let mut work = Workspace::default();
        let mut values = 0;
        for i in 0..2000 {
            let pair = crate::common::cosine_pair(&random, i);
            let got = optics.average(&*brdf, &pair, &mut work).expect("a value");
            values += got.evaluations;
        }
        let mean = values as f64 / 2000.0;
        println!("{kind} {text}: {mean} values a reading");
        assert!(mean <= most, "{kind} {text}: {mean}");
    }
}

/// Reading by reading over a square of sensor directions around the normal: Σ, Σ x²/Σ, Σ y²/Σ, peak.
fn scan(brdf: &dyn Brdf, optics: &Optics, reach: f64) -> [f64; 4] {
    let n = 40;
    let step = reach / f64::from(n);
    let light = Direction::NORMAL;
    let rows: Vec<[f64; 4]> = (-n..=n)
        .into_par_iter()
        .map(|row| {
            let mut work = Workspace::default();
            let mut sums = [0.0; 4];
            for column in -n..=n {
                let (x, y) = (step * f64::from(column), step * f64::from(row));
                let omega_o = Direction::from_spherical(x.hypot(y), y.atan2(x));
                let pair = DirectionPair::new(light, omega_o);
                let value = optics
                    .average(brdf, &pair, &mut work)
                    .expect("a value")
                    .value[0];
                sums[0] += value * step * step;
                sums[1] += value * x * x * step * step;
                sums[2] += value * y * y * step * step;
                sums[3] = f64::max(sums[3], value);
            }
            sums
        })
        .collect();
    let total = |k: usize| rows.iter().map(|r| r[k]).sum::<f64>();
    let peak = rows.iter().map(|r| r[3]).fold(0.0, f64::max);
    [total(0), total(1) / total(0), total(2) / total(0), peak]
}

fn apertures_widen_a_lobe_by_their_second_moments(level: Level) {
    let a = [0.02, 0.012];
    let optics = Optics::new(a[0], a[1], Tolerance::default());
    let point = Optics::new(0.0, 0.0, Tolerance::default());
    for half_width in level.of(vec![0.015], vec![0.002, 0.005, 0.015, 0.04]) {
        // In the half vector; the sensor moves by twice the angle.
        let lobe = formula(move |p| {
            let h = p.half();
            let slope2 = (h.x * h.x + h.y * h.y) / (h.z * h.z);
            (-0.5 * slope2 / (half_width * half_width)).exp()
        });
        let width = 2.0 * half_width;
        let reach = 6.5 * width + a[0] + a[1];
        let [energy, x2, y2, peak] = scan(&lobe, &optics, reach);
        let [alone, x2_alone, _, top] = scan(&lobe, &point, reach);
        // The law is exact for a convolution in the plane. On the sphere each of angle, slope and
        // cosine differs from the others by a second-order share of the width squared; 1e-3 is the
        // step of the scan against the apertures.
        let slack = 1e-3 + 4.0 * (width * width + a[0] * a[0]);
        assert!((x2_alone / (width * width) - 1.0).abs() < slack);
        let want = width * width + 0.25 * (a[0] * a[0] + a[1] * a[1]);
        for got in [x2, y2] {
            assert!(
                (got / want - 1.0).abs() < slack,
                "{half_width}: {got} {want}"
            );
        }
        assert!(
            (energy / alone - 1.0).abs() < slack,
            "{half_width}: {energy} {alone}"
        );
        // A Gaussian convolved with both disks: its peak falls at least as with one Gaussian of
        // their second moment falls to half.
        assert!(
            peak < top && peak > 0.5 * top * width * width / want,
            "{half_width}: {peak} {top}"
        );
    }
}

#[test]
fn data_that_are_missing_are_left_out() {
    let pair = DirectionPair::from_spherical(0.5, 0.0, 0.6, 1.0);
    let optics = Optics::new(0.02, 0.02, Tolerance::default());
    let mut work = Workspace::default();
    for (hole, some) in [
        (0.0, true),
        (0.59, true),
        (0.6, true),
        (0.61, true),
        (0.7, false),
    ] {
        let holed = made(Symmetry::FULL, |p| {
            (p.omega_o.theta() >= hole).then_some([0.25, 0.5, 0.0])
        });
        let got = optics.average(&holed, &pair, &mut work);
        assert_eq!(got.is_some(), some, "{hole}");
        if let Some(got) = got {
            for (value, want) in got.value.into_iter().zip([0.25, 0.5, 0.0]) {
                assert!((value - want).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn without_apertures_a_reading_is_the_brdf_bit_for_bit() {
    let optics = Optics::new(0.0, 0.0, Tolerance::default());
    let random = gonio::sampling::Random::new(2);
    let mut work = Workspace::default();
    for (kind, text) in [("ggx", "alpha = 0.05"), ("oren-nayar", "")] {
        let brdf = model(kind, text);
        for i in 0..1000 {
            let pair = crate::common::random_pair(&random, i);
            let got = optics.average(&*brdf, &pair, &mut work).expect("a value");
            assert_eq!(Some(got.value[0]), brdf.luminance(&pair));
            assert_eq!((&got.error[..], got.evaluations), (&[0.0][..], 1));
        }
    }
}

#[test]
fn spots_are_compared_along_and_across() {
    let mut spec = super::specs().swap_remove(0);
    (spec.source.beam_mm, spec.detector.view_mm) = (10.0, 15.0);
    let filling = |theta_i: f64, theta_o: f64| {
        let pair = DirectionPair::from_spherical(deg(theta_i), 0.0, deg(theta_o), 0.0);
        gonio::instrument::footprint(&spec, &pair)
    };
    let spots = filling(60.0, 0.0);
    assert!((spots.lit_mm - 20.0).abs() < 1e-12 && spots.seen_mm == 15.0);
    assert_eq!(spots.filling, Filling::Mixed);
    assert_eq!(filling(0.0, 30.0).filling, Filling::UnderFilled);
    spec.detector.view_mm = 5.0;
    let pair = DirectionPair::from_spherical(0.0, 0.0, 0.5, 0.0);
    let over = gonio::instrument::footprint(&spec, &pair).filling;
    assert_eq!(over, Filling::OverFilled);
}

/// A BRDF that keeps the range of its values within the apertures, and refuses more of them than an
/// average may cost.
struct ObservedBrdf<'a> {
    of: &'a dyn Brdf,
    pair: DirectionPair,
    apertures: [f64; 2],
    seen: Mutex<(usize, [f64; 2])>,
}

impl Brdf for ObservedBrdf<'_> {
    fn channels(&self) -> &Channels {
        self.of.channels()
    }
    fn symmetry(&self) -> Symmetry {
        self.of.symmetry()
    }
    fn conserves_energy(&self) -> bool {
        self.of.conserves_energy()
    }
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let off = |a: Direction, b: Direction| angle_between(a.vector(), b.vector());
        let off = [
            off(pair.omega_i, self.pair.omega_i),
            off(pair.omega_o, self.pair.omega_o),
        ];
        // Rounding of the half vector, which directions are mirrored at.
        let slack = 4.0 * f64::EPSILON / self.pair.half().length();
        let within = (0..2).all(|k| off[k] <= self.apertures[k] * (1.0 + 1e-9) + slack);
        let presence = self.of.eval(pair, out);
        let mut seen = self.seen.lock().unwrap();
        seen.0 += 1;
        assert!(seen.0 <= Tolerance::default().max_evaluations(), "no end");
        if within {
            seen.1 = [seen.1[0].min(out[0]), seen.1[1].max(out[0])];
        }
        presence
    }
}

fn any_aperture_at_any_elevation_comes_to_an_end(level: Level) {
    let materials = [
        ("lambert", "albedo = 0.5"),
        ("ggx", "alpha = 0.3"),
        ("ggx", "alpha = 1e-6"),
        ("ward", "alpha = [0.01, 0.1]"),
        ("retro-reflective", "of = { kind = \"ggx\", alpha = 0.01 }"),
    ];
    let mut thetas = vec![0.0, deg(45.0), deg(89.0)];
    thetas.extend([3, 5, 7, 8, 9, 10, 11, 12].map(|e| FRAC_PI_2 - f64::powi(10.0, -e)));
    let mut cases = Vec::new();
    for (kind, text) in materials {
        for &theta in &thetas {
            for a in [1e-15, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3, 1e-1, 0.5] {
                for a in [[a, a], [0.0, a], [a, 0.3 * a]] {
                    cases.push((kind, text, theta, a));
                }
            }
        }
    }
    // No factor in common with what the cases are a product of.
    let step = level.of(13, 1);
    let most = cases
        .into_par_iter()
        .step_by(step)
        .map(|(kind, text, theta, a)| {
            let brdf = model(kind, text);
            let mut most = 0;
            // Mirror, retro and at right angles, and beside them by a part of the apertures.
            for turn in [PI, 0.0, FRAC_PI_2] {
                for [tilt, aside] in [[0.0, 0.0], [0.3 * a[1], 0.0], [0.0, 0.5 * a[0]]] {
                    let pair =
                        DirectionPair::from_spherical(theta, 0.3, theta - tilt, 0.3 + turn + aside);
                    let case = format!("{kind} {text} {theta} {a:?} {turn} {tilt:e} {aside:e}");
                    let watched = ObservedBrdf {
                        of: &*brdf,
                        pair,
                        apertures: a,
                        seen: Mutex::new((0, [f64::INFINITY, 0.0])),
                    };
                    let optics = Optics::new(a[0], a[1], Tolerance::default());
                    let got = optics.average(&watched, &pair, &mut Workspace::default());
                    let got = got.expect(&case);
                    let (count, [lo, hi]) = watched.seen.into_inner().unwrap();
                    assert_eq!(count, got.evaluations, "{case}");
                    let (value, error) = (got.value[0], got.error[0]);
                    assert!(value.is_finite() && !error.is_nan(), "{case}: {got:?}");
                    assert!(
                        value >= lo - error && value <= hi + error,
                        "{case}: {lo} {got:?} {hi}"
                    );
                    most = most.max(count);
                }
            }
            most
        });
    println!("at most {} values", most.max().unwrap_or_default());
}
