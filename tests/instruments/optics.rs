//! Averages over both apertures: closed forms, brute force, and what they do to a lobe.

use crate::common::{Level, cosine_pairs, levels, made, model, near, product, random_pairs};
use glam::DVec3;
use gonio::brdf::Brdf;
use gonio::geometry::{Direction, DirectionPair, Symmetry, angle_between};
use gonio::instrument::{Average, Filling, Optics, Tolerance, Workspace};
use gonio::sampling::{Sobol, gauss_legendre, ggx_half_vector, ggx_half_vector_pdf};
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
        let is_above = pair.is_above_horizon();
        Some([if is_above { f(pair) } else { 0.0 }])
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
        let azimuth = |k: usize| (k as f64 + 0.37) / (2 * n) as f64;
        let at = |(x, w): (f64, f64), k| (cap(frame, a, 0.5 * (1.0 + x), azimuth(k)), w);
        let nodes = product(rule.clone(), 0..2 * n).into_iter();
        nodes.map(|(node, k)| at(node, k)).collect()
    };
    let (light, sensor) = (nodes(pair.omega_i, a[0]), nodes(pair.omega_o, a[1]));
    let above = |(d, _): &&(DVec3, f64)| d.z > 0.0;
    let sums = light.par_iter().filter(above).map(|(i, wi)| {
        let mut sums = [0.0; 2];
        for (o, wo) in sensor.iter().filter(above) {
            let pair = DirectionPair::new(Direction::from_unit(*i), Direction::from_unit(*o));
            let w = wi * wo * i.z;
            sums[0] += w * brdf.luminance(&pair).expect("a value");
            sums[1] += w;
        }
        sums
    });
    let sums: Vec<[f64; 2]> = sums.collect();
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
            "inside a grazing one",
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
    let steep = [0.0, 50.0, 87.5, 89.9];
    let thetas = [0.0, 30.0, 85.0, 88.0, 89.5, 89.99];
    for (theta_i, theta_o) in product(thetas, steep) {
        for a in [[1.0, 2.0], [0.0, 3.0], [3.0, 0.0], [10.0, 5.0]] {
            let pair = DirectionPair::from_spherical(deg(theta_i), 0.2, deg(theta_o), 2.0);
            let got = average(&*brdf, &pair, a.map(deg), 1e-4);
            near(got.value[0] * PI / 0.5, 1.0, 1e-12, (a, theta_i, theta_o));
            let cut = theta_i + a[0] > 90.0 || theta_o + a[1] > 90.0;
            assert_eq!(got.clipped, cut, "{a:?} {theta_i} {theta_o}");
            assert!(got.evaluations < 4000);
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
            let sensor = (&of_sensor as &dyn Brdf, pair.omega_o.cos_theta() * first);
            let cases = [sensor, (&of_light, second / (z * first))];
            for ((brdf, want), tolerance) in product(cases, [1e-2, 1e-4, 1e-6]) {
                let got = average(brdf, &pair, [a, a], tolerance);
                let (error, stated) = ((got.value[0] - want).abs(), got.error[0]);
                assert!(error <= stated, "{a} {theta}: {error:e} {stated:e}");
                assert!(stated <= tolerance * want + 1e-12);
            }
        }
        // Half of the light's cap below the horizon: integrals of z and z² over the other half.
        let pair = DirectionPair::from_spherical(0.5 * PI, 0.3, 0.2, 2.0);
        let first = a - a.sin() * a.cos();
        let second = 0.5 * PI * (2.0 / 3.0 - a.cos() + a.cos().powi(3) / 3.0);
        let got = average(&of_light, &pair, [a, 0.0], 1e-6);
        let (error, stated) = ((got.value[0] - second / first).abs(), got.error[0]);
        // 1e-11: the closed forms cancel at small angles.
        assert!(error <= stated + 1e-11 / a, "{a}: {error:e} {stated:e}");
        assert!(got.clipped && stated <= 1e-6 * got.value[0]);
    }
}

/// Asserts that an average is as near to the truth as it states, and states no more than the tolerance, with `diverges` any error;
/// the truth is known to `unsure`.
fn assert_bounded(
    what: &str,
    (brdf, pair, a): (&dyn Brdf, &DirectionPair, [f64; 2]),
    [truth, unsure]: [f64; 2],
    tolerance: f64,
    diverges: bool,
) -> Average {
    let got = average(brdf, pair, a, tolerance);
    let (value, error) = (got.value[0], got.error[0]);
    let text = format!("{what} {a:.3?} {tolerance:e}: {got:?}, {truth} ± {unsure:e}");
    assert!((value - truth).abs() <= error + unsure, "{text}");
    assert!(diverges || error <= tolerance * value + 1e-12, "{text}");
    got
}

#[test]
fn the_stated_error_bounds_the_true_one() {
    for (alpha, n) in [(0.5, 10), (0.1, 16), (0.03, 20), (0.01, 24)] {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        for ((name, pair), a) in product(geometries(), APERTURES) {
            let a = a.map(deg);
            let n = if a[0] * a[1] == 0.0 { 6 * n } else { n };
            let truth = brute(&*brdf, &pair, a, n);
            // A lower order says how good the truth is.
            let unsure = (truth - brute(&*brdf, &pair, a, n - n / 5)).abs() + 1e-12 * truth;
            if unsure > 1e-4 * truth {
                continue;
            }
            for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
                let case = (&*brdf, &pair, a);
                assert_bounded(name, case, [truth, unsure], tolerance, false);
            }
        }
    }
}

/// GGX lobes by importance sampling: light uniform in its cap, half vector from D cos θ_h, and what
/// meets the sensor's cap counts. Mean and standard error of 16 scrambled sets.
fn by_importance(brdf: &dyn Brdf, alpha: f64, pair: &DirectionPair, a: [f64; 2]) -> [f64; 2] {
    let light = frame(pair.omega_i.vector());
    let cos_cap = a[1].cos();
    let solid = TAU * 2.0 * (0.5 * a[1]).sin().powi(2);
    let mean_cos = pair.omega_i.cos_theta() * 0.5 * (1.0 + a[0].cos());
    let points = 1_u64 << 15;
    let mean_of_set = |seed: u64| {
        let mut sobol = Sobol::new(seed);
        let mut sum = 0.0;
        for k in 0..points {
            let [u, v, s, t] = sobol.point(k);
            let i = cap(light, a[0], u, v);
            let normal = ggx_half_vector(alpha, [s, t]);
            let h = normal.vector();
            let o = 2.0 * i.dot(h) * h - i;
            if o.dot(pair.omega_o.vector()) < cos_cap || o.z <= 0.0 {
                continue;
            }
            let density = ggx_half_vector_pdf(alpha, normal) / (4.0 * i.dot(h));
            let both = DirectionPair::new(Direction::from_unit(i), Direction::from_unit(o));
            sum += brdf.luminance(&both).expect("a value") * i.z / density;
        }
        sum / points as f64 / (solid * mean_cos)
    };
    let means: Vec<f64> = (0..16).into_par_iter().map(mean_of_set).collect();
    let mean = means.iter().sum::<f64>() / 16.0;
    let square: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    [mean, (square / (15.0 * 16.0)).sqrt()]
}

fn lobes_far_narrower_than_the_apertures_are_found(level: Level) {
    let apertures = [[1.0, 1.0], [0.3, 1.5], [0.02, 1.0]];
    for alpha in level.of(vec![0.003], vec![0.01, 0.003, 0.001]) {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        for ((name, pair), a) in product(geometries().into_iter().take(7), apertures) {
            let a = a.map(deg);
            let [truth, sigma] = by_importance(&*brdf, alpha, &pair, a);
            // What an aperture sees of a far tail is rarely drawn.
            if sigma > 3e-3 * truth {
                continue;
            }
            for tolerance in [1e-2, 1e-4, 1e-5] {
                let case = (&*brdf, &pair, a);
                // Five standard errors of sixteen sets.
                assert_bounded(name, case, [truth, 5.0 * sigma], tolerance, false);
            }
        }
    }
}

#[test]
fn the_error_is_bounded_where_the_horizon_cuts() {
    let pair = DirectionPair::from_spherical;
    // Where both directions meet the horizon f_r diverges; there the bound need only hold.
    let pairs = [
        (pair(deg(89.7), 0.0, deg(40.0), PI), false),
        (pair(deg(40.0), 0.0, deg(89.7), 2.0), false),
        (mirror(deg(89.7), 0.0, 0.0), true),
    ];
    for alpha in [0.5, 0.1, 0.03] {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        for ((pair, diverges), a) in product(pairs, [[1.0, 1.0], [0.5, 1.5]]) {
            let a = a.map(deg);
            let truth = brute(&*brdf, &pair, a, 24);
            // Cells that straddle the horizon: the error falls with their width alone.
            let unsure = 3.0 * (truth - brute(&*brdf, &pair, a, 17)).abs();
            let case = (&*brdf, &pair, a);
            let got = assert_bounded("horizon", case, [truth, unsure], 1e-3, diverges);
            assert!(got.clipped);
        }
    }
}

#[test]
fn smooth_materials_cost_few_values() {
    let optics = Optics::new(deg(0.25), deg(0.5), Tolerance::default());
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
        for pair in cosine_pairs(4).take(2000) {
            let got = optics.average(&*brdf, &pair, &mut work).expect("a value");
            values += got.evaluations;
        }
        let mean = values as f64 / 2000.0;
        assert!(mean <= most, "{kind} {text}: {mean}");
    }
}

/// Reading by reading over a square of sensor directions around the normal: Σ, Σ x²/Σ, Σ y²/Σ, peak.
fn scan(brdf: &dyn Brdf, optics: &Optics, reach: f64) -> [f64; 4] {
    let n = 40;
    let step = reach / f64::from(n);
    let row = |row: i32| {
        let mut work = Workspace::default();
        let mut sums = [0.0; 4];
        for column in -n..=n {
            let (x, y) = (step * f64::from(column), step * f64::from(row));
            let omega_o = Direction::from_spherical(x.hypot(y), y.atan2(x));
            let pair = DirectionPair::new(Direction::NORMAL, omega_o);
            let average = optics.average(brdf, &pair, &mut work);
            let value = average.expect("a value").value[0];
            sums[0] += value * step * step;
            sums[1] += value * x * x * step * step;
            sums[2] += value * y * y * step * step;
            sums[3] = f64::max(sums[3], value);
        }
        sums
    };
    let rows: Vec<[f64; 4]> = (-n..=n).into_par_iter().map(row).collect();
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
        let square = width * width;
        let slack = 1e-3 + 4.0 * (square + a[0] * a[0]);
        let want = square + 0.25 * (a[0] * a[0] + a[1] * a[1]);
        for ratio in [x2_alone / square, x2 / want, y2 / want, energy / alone] {
            near(ratio, 1.0, slack, half_width);
        }
        // A Gaussian convolved with both disks: its peak falls at least as with one Gaussian of
        // their second moment falls to half.
        let least = 0.5 * top * width * width / want;
        assert!(peak < top && peak > least, "{half_width}: {peak} {top}");
    }
}

#[test]
fn data_that_are_missing_are_left_out() {
    let pair = DirectionPair::from_spherical(0.5, 0.0, 0.6, 1.0);
    let optics = Optics::new(0.02, 0.02, Tolerance::default());
    let mut work = Workspace::default();
    for hole in [0.0, 0.59, 0.6, 0.61, 0.7] {
        let holed = made(Symmetry::FULL, |p| {
            (p.omega_o.theta() >= hole).then_some([0.25, 0.5, 0.0])
        });
        let got = optics.average(&holed, &pair, &mut work);
        assert_eq!(got.is_some(), hole < 0.7, "{hole}");
        let values = got.into_iter().flat_map(|got| got.value);
        for (value, want) in values.zip([0.25, 0.5, 0.0]) {
            near(value, want, 1e-12, hole);
        }
    }
}

#[test]
fn without_apertures_a_reading_is_the_brdf_bit_for_bit() {
    let optics = Optics::new(0.0, 0.0, Tolerance::default());
    let mut work = Workspace::default();
    for (kind, text) in [("ggx", "alpha = 0.05"), ("oren-nayar", "")] {
        let brdf = model(kind, text);
        for pair in random_pairs(2).take(1000) {
            let got = optics.average(&*brdf, &pair, &mut work).expect("a value");
            assert_eq!(Some(got.value[0]), brdf.luminance(&pair));
            assert_eq!((&got.error[..], got.evaluations), (&[0.0][..], 1));
        }
    }
}

#[test]
fn spots_are_compared_along_and_across() {
    let mut spec = super::specs().swap_remove(0);
    spec.source.beam_mm = 10.0;
    let mut footprint = |view_mm, theta_i: f64, theta_o: f64| {
        spec.detector.view_mm = view_mm;
        let pair = DirectionPair::from_spherical(theta_i, 0.0, theta_o, 0.0);
        gonio::instrument::footprint(&spec, &pair)
    };
    let spots = footprint(15.0, deg(60.0), 0.0);
    near(spots.lit_mm, 20.0, 1e-12, "lit");
    assert_eq!((spots.seen_mm, spots.filling), (15.0, Filling::Mixed));
    let under = footprint(15.0, 0.0, deg(30.0)).filling;
    let over = footprint(5.0, 0.0, 0.5).filling;
    assert_eq!([under, over], [Filling::UnderFilled, Filling::OverFilled]);
}

/// Number of values that an average asked a BRDF for, no more than it may cost, and the range of those within the apertures.
type Seen = (usize, [f64; 2]);

/// A BRDF that notes what is asked of it about a pair.
fn observed(of: &dyn Brdf, pair: DirectionPair, a: [f64; 2], seen: &Mutex<Seen>) -> impl Brdf {
    made(of.symmetry(), move |asked| {
        let ends = |pair: &DirectionPair| [pair.omega_i, pair.omega_o].map(|d| d.vector());
        let (ours, centre) = (ends(asked), ends(&pair));
        let off = [0, 1].map(|k| angle_between(ours[k], centre[k]));
        // Rounding of the half vector, which directions are mirrored at.
        let slack = 4.0 * f64::EPSILON / pair.half().length();
        let within = (0..2).all(|k| off[k] <= a[k] * (1.0 + 1e-9) + slack);
        let value = of.luminance(asked)?;
        let mut seen = seen.lock().unwrap();
        seen.0 += 1;
        assert!(seen.0 <= Tolerance::default().max_evaluations(), "no end");
        if within {
            seen.1 = [seen.1[0].min(value), seen.1[1].max(value)];
        }
        Some([value])
    })
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
    let widths = [1e-15, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3, 1e-1, 0.5];
    let both = widths.into_iter();
    let apertures = both.flat_map(|a| [[a, a], [0.0, a], [a, 0.3 * a]]);
    let mut cases = Vec::new();
    for (material, theta) in product(materials, thetas) {
        cases.extend(apertures.clone().map(|a| (material, theta, a)));
    }
    let values = |((kind, text), theta, a): ((&str, &str), f64, [f64; 2])| {
        let brdf = model(kind, text);
        let mut most = 0;
        // Mirror, retro and at right angles, and beside them by a part of the apertures.
        let beside = [[0.0, 0.0], [0.3 * a[1], 0.0], [0.0, 0.5 * a[0]]];
        for (turn, [tilt, aside]) in product([PI, 0.0, FRAC_PI_2], beside) {
            let pair = DirectionPair::from_spherical(theta, 0.3, theta - tilt, 0.3 + turn + aside);
            let case = format!("{kind} {text} {theta} {a:?} {turn} {tilt:e} {aside:e}");
            let seen = Mutex::new((0, [f64::INFINITY, 0.0]));
            let watched = observed(&*brdf, pair, a, &seen);
            let optics = Optics::new(a[0], a[1], Tolerance::default());
            let got = optics.average(&watched, &pair, &mut Workspace::default());
            let got = got.expect(&case);
            let (count, [lo, hi]) = *seen.lock().unwrap();
            assert_eq!(count, got.evaluations, "{case}");
            let (value, error) = (got.value[0], got.error[0]);
            assert!(value.is_finite() && !error.is_nan(), "{case}: {got:?}");
            let is_between = value >= lo - error && value <= hi + error;
            assert!(is_between, "{case}: {lo} {got:?} {hi}");
            most = most.max(count);
        }
        most
    };
    // No factor in common with what the cases are a product of.
    let step = level.of(13, 1);
    let most = cases.into_par_iter().step_by(step).map(values);
    println!("at most {} values", most.max().unwrap_or_default());
}
