//! Facets of height fields as BRDFs: energy, errors, and what their slopes alone would do.
#![cfg(feature = "surfaces")]

mod common;

use common::light::assert_paths_bring_what_values_promise;
use common::{Level, cosine_pair, levels, near, product};
use gonio::brdf::microfacet::{Beckmann, FresnelSpec, Microfacet};
use gonio::brdf::{
    self, Brdf, BrdfSpec, CLASSES, Channels, Favours, Part, Presence, Roughness, Split, laws,
};
use gonio::geometry::{Direction, DirectionPair};
use gonio::light_paths::{MICRO_SURFACE, SMITH_MULTIPLE};
use gonio::registry;
use gonio::sampling::{
    Random, Sobol, cosine_hemisphere, cosine_hemisphere_pdf, ggx_half_vector, ggx_half_vector_pdf,
};
use std::collections::BTreeMap;
use std::f64::consts::{PI, SQRT_2};

levels! {
    values_integrate_to_one: "thorough: every surface, more directions and paths";
    errors_are_what_surfaces_differ_by: "thorough: larger surfaces and more pairs";
    paths_bring_what_values_promise: "thorough: more paths and pairs";
    gaussian_slopes_are_beckmanns_facets: "thorough: values at nodes, more directions";
    albedos_err_by_their_noise: "thorough: more materials and surfaces";
}

fn build(text: &str) -> Box<dyn Brdf> {
    let spec: Box<dyn BrdfSpec> = registry::read_text(&MICRO_SURFACE, text).unwrap();
    spec.build(Channels::Luminance).unwrap()
}

const WHITE: &str = "facets = { kind = \"diffuse\", albedo = 1.0 }";
const MIRRORS: &str = "facets = { kind = \"mirror\", fresnel = { kind = \"none\" } }";

/// Every kind of surface, steep.
const SURFACES: [&str; 6] = [
    "kind = \"gaussian\", rms_slope = 0.4, size = 512",
    "kind = \"gaussian\", rms_slope = [0.6, 0.2], size = 512",
    "kind = \"exponential\", rms_slope = 0.4, size = 512",
    "kind = \"dimples\", size = 512",
    "kind = \"dimples\", depth = -12.0, size = 512",
    "kind = \"woven\", thread = 128, size = 512",
];

/// Light of one mirror goes with the density of half vectors, on any surface.
#[test]
fn mirrors_favour_half_vectors() {
    let surface = "surface = { kind = \"gaussian\" }";
    let diffuse = "facets = { kind = \"diffuse\" }";
    for entry in [&MICRO_SURFACE, &SMITH_MULTIPLE] {
        let surface = match entry.kind == MICRO_SURFACE.kind {
            true => surface,
            false => "",
        };
        let of_several = ["bounces = \"second\"", "bounces = \"multiple\"", diffuse];
        let of_one = ["", "bounces = \"first\""].map(|keys| (keys, Favours::HalfAngle));
        let of_several = of_several.map(|keys| (keys, Favours::Neither));
        for (keys, favoured) in of_one.into_iter().chain(of_several) {
            let spec = registry::read_text(entry, &format!("{surface}\n{keys}")).unwrap();
            assert_eq!(spec.favours(), favoured, "{} {keys}", entry.kind);
        }
    }
}

#[test]
fn a_plane_of_any_facets_is_the_facet() {
    let model = brdf::read(toml::de::DeTable::parse("kind = \"ggx\"\nalpha = 0.2").unwrap());
    let model = model.unwrap().build(Channels::Rgb).unwrap();
    let plane = "surface = { kind = \"v-grooves\", angle_deg = 0.0 }\npaths = 32\n\
                 facets = { kind = \"material\", brdf = { kind = \"ggx\", alpha = 0.2 } }";
    let plane = registry::read_text(&MICRO_SURFACE, plane).unwrap();
    let plane = plane.build(Channels::Rgb).unwrap();
    for pair in laws::pairs(500, 5) {
        let [mut a, mut b] = [[0.0; 3]; 2];
        assert_eq!(plane.eval(&pair, &mut a), Presence::Present);
        _ = model.eval(&pair, &mut b);
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= 1e-14 * b.max(1.0), "{a} {b} {pair:?}");
        }
    }
}

/// ∫ f cos over the hemisphere, and its standard error over sets of directions: cosines, and reflections at GGX normals of two
/// roughnesses, the smaller for the flat parts of a surface.
fn energy(brdf: &dyn Brdf, theta_deg: f64, rays: Option<f64>, seed: u64) -> [f64; 2] {
    const SETS: u64 = 16;
    const POINTS: u64 = 64;
    const LOBES: [f64; 2] = [0.5, 0.008];
    let omega_o = Direction::from_spherical(theta_deg.to_radians(), 0.4);
    let split = brdf.as_split().unwrap();
    let (mut sum, mut square, mut more) = (0.0, 0.0, 0.0);
    // What is known at nodes errs alike at points between the same ones: cells of 3°.
    let mut cells: BTreeMap<[i32; 2], f64> = BTreeMap::new();
    for set in 0..SETS {
        let mut points = Sobol::new(SETS * seed + set);
        let mut all = 0.0;
        for i in 0..POINTS {
            let [choice, a, b] = points.point(i);
            let lobe = (4.0 * choice) as usize;
            let omega_i = match LOBES.get(lobe) {
                Some(alpha) => {
                    let (o, h) = (omega_o.vector(), ggx_half_vector(*alpha, [a, b]).vector());
                    Direction::try_new(2.0 * o.dot(h) * h - o).unwrap()
                }
                None => cosine_hemisphere([a, b]),
            };
            if omega_i.cos_theta() <= 0.0 {
                continue;
            }
            let half = (omega_i.vector() + omega_o.vector()).normalize();
            let normal = Direction::try_new(half).unwrap();
            let lobes = LOBES.map(|alpha| ggx_half_vector_pdf(alpha, normal));
            let lobes = lobes.iter().sum::<f64>() / (4.0 * half.dot(omega_o.vector()));
            let density = 0.5 * cosine_hemisphere_pdf(omega_i) + 0.25 * lobes;
            let split = split.split(&DirectionPair::new(omega_i, omega_o));
            let scale = omega_i.cos_theta() / density / POINTS as f64;
            all += split.part(Part::All)[0] * scale;
            if brdf.symmetry().isotropic {
                let turned = (omega_i.phi() - omega_o.phi()).cos().acos();
                let across = turned * omega_i.sin_theta().min(omega_o.sin_theta());
                let cell = [omega_i.theta(), across].map(|x| (x.to_degrees() / 3.0) as i32);
                *cells.entry(cell).or_default() +=
                    scale / SETS as f64 * split.transport.error(Part::All);
            }
            more += (split.value[1][0] + split.value[2][0]) * scale / SETS as f64;
        }
        sum += all;
        square += all * all;
    }
    let n = SETS as f64;
    let error = ((square - sum * sum / n) / (n * (n - 1.0))).sqrt();
    // Light of several mirrors is that of the paths that began or ended near the direction, the same for all sets: within 4° of it
    // or of its images, or in the ring about it that has its nodes.
    let (theta, r) = (theta_deg.to_radians(), 4f64.to_radians());
    let ring = (theta + r).min(PI / 2.0).sin().powi(2) - (theta - r).max(0.0).sin().powi(2);
    let share = match brdf.symmetry().isotropic {
        true => ring,
        false => 4.0 * r.sin().powi(2) * theta.cos(),
    };
    let kept = rays.map_or(0.0, |rays| more / (rays * share * more).sqrt());
    let at_nodes = cells.values().map(|e| e * e).sum::<f64>().sqrt();
    [sum / n, error.hypot(kept).hypot(at_nodes)]
}

/// Facets that lose nothing: all light that comes leaves.
fn values_integrate_to_one(level: Level) {
    let (mut pulls, mut errors, mut n) = (0.0, 0.0, 0.0);
    let (rays, paths) = level.of((200_000, 16), (1_000_000, 64));
    for surface in SURFACES.into_iter().step_by(level.of(3, 1)) {
        for facets in [MIRRORS, WHITE] {
            let numbers = format!("rays = {rays}\npaths = {paths}\nhalf_angle_deg = 2");
            let material = build(&format!("surface = {{ {surface} }}\n{facets}\n{numbers}"));
            for theta_deg in level.of(vec![30.0], vec![0.0, 30.0, 60.0, 80.0]) {
                let rays = (facets == MIRRORS).then_some(f64::from(rays));
                // Of directions of its own, so that errors have nothing to do with each other.
                let [energy, error] = energy(&*material, theta_deg, rays, n as u64);
                pulls += ((energy - 1.0) / error).powi(2);
                errors += error * error;
                n += 1.0;
                near(energy, 1.0, 4.0 * error, (surface, facets, theta_deg));
            }
        }
    }
    // Student's t of 15 degrees of freedom has a variance of 15/13.
    let (spread, error): (f64, f64) = (pulls / n, f64::sqrt(errors / n));
    let [widest, largest] = level.of([2.6, 0.04], [1.8, 0.02]);
    assert!(spread < widest && error < largest, "{spread} {error}");
}

/// Values of another surface and of other paths differ by what their errors say.
fn errors_are_what_surfaces_differ_by(level: Level) {
    let [size, rays, paths] = level.of([256, 200_000, 16], [512, 1_000_000, 64]);
    for (facets, bounds) in [(MIRRORS, 0.7..1.4), (WHITE, 0.7..1.4)] {
        let of = |seed: u64| {
            build(&format!(
                "surface = {{ kind = \"gaussian\", rms_slope = 0.5, size = {size}, seed = {seed} }}\n{facets}\n\
                 seed = {seed}\nrays = {rays}\npaths = {paths}"
            ))
        };
        let all: Vec<_> = (1..=level.of(2, 4)).map(|seed| of(100 * seed)).collect();
        let (mut squares, mut n) = ([0.0; CLASSES + 1], [0.0; CLASSES + 1]);
        let random = Random::new(2);
        for i in 0..150 {
            let pair = cosine_pair(&random, i);
            let splits = all.iter().map(|m| m.as_split().unwrap().split(&pair));
            let splits: Vec<Split> = splits.collect();
            for (a, b) in [(0, 1), (2, 3)].into_iter().take(all.len() / 2) {
                let parts = Part::CLASSES.into_iter().chain([Part::All]);
                for (i, part) in parts.enumerate() {
                    let [a, b] = [&splits[a], &splits[b]];
                    let error = a.error(part).hypot(b.error(part));
                    assert!(error > 0.0, "{facets} {part} {pair:?}");
                    squares[i] += ((a.part(part)[0] - b.part(part)[0]) / error).powi(2);
                    n[i] += 1.0;
                }
            }
        }
        let ratio = |i: usize| f64::sqrt(squares[i] / n[i]);
        let ratios: Vec<f64> = (0..n.len()).map(ratio).collect();
        assert!(
            ratios.iter().all(|r| bounds.contains(r)),
            "{facets}: {ratios:?}"
        );
    }
}

fn paths_bring_what_values_promise(level: Level) {
    for facets in [MIRRORS, WHITE] {
        let surface = "surface = { kind = \"gaussian\", rms_slope = 0.7, size = 512, seed = 4 }";
        let (rays, paths) = level.of((200_000, 16), (2_000_000, 64));
        let numbers = format!("rays = {rays}\npaths = {paths}");
        let material = build(&format!("{surface}\n{facets}\n{numbers}"));
        let split = material.as_split().unwrap();
        let numbers = level.of([1 << 16, 1 << 11], [1 << 18, 1 << 14]);
        let resolved = level.of([0.04, 0.14], [0.02, 0.05]);
        assert_paths_bring_what_values_promise(split, numbers, resolved);
    }
}

/// Gaussian slopes are the facets of Beckmann, alpha = √2 rms slope, whatever the correlation of heights. Of one facet only
/// shadows may differ, where heights and slopes have to do with each other.
fn gaussian_slopes_are_beckmanns_facets(level: Level) {
    // Short correlations: of a small surface the rms slope itself is a draw, and a mean over draws is no Gaussian.
    let kinds = [
        "gaussian\", correlation = 6",
        "exponential\", correlation = 12",
    ];
    // Of slopes that differ, each pair is looked at by itself, which is quick for few of them.
    let slopes = level.of([[0.3, 0.2]; 2], [[0.1; 2], [0.3; 2]]);
    for (kind, slopes) in kinds.into_iter().zip(slopes) {
        let material = build(&format!(
            "surface = {{ kind = \"{kind}, rms_slope = {slopes:?}, size = 256 }}\n{MIRRORS}\n\
                 surfaces = 50\nbounces = \"first\"\npaths = 400"
        ));
        let alpha = Roughness::Anisotropic(slopes.map(|slope| SQRT_2 * slope));
        let model = Microfacet::<Beckmann>::new(alpha, &FresnelSpec::None, Channels::Luminance);
        let thetas = level.of(vec![30.0], vec![0.0, 30.0, 60.0f64]);
        let leans = level.of(vec![0.0, 1.0], vec![0.0, 0.5, 1.0, 1.5]);
        // A half vector of a slope that is some rms slopes steep, in the plane of the light and across.
        for (theta_i, (lean, phi)) in product(thetas, product(leans, [0.0, 90.0f64])) {
            let slope = slopes[usize::from(phi > 0.0)];
            let h = Direction::from_spherical((lean * slope).atan(), phi.to_radians());
            let i = Direction::from_spherical(theta_i.to_radians(), 0.0);
            let (h, i_vector) = (h.vector(), i.vector());
            let o = Direction::try_new(2.0 * i_vector.dot(h) * h - i_vector).unwrap();
            if o.cos_theta() < 0.3 {
                continue;
            }
            let pair = DirectionPair::new(i, o);
            let split = material.as_split().unwrap().split(&pair);
            let (found, error) = (split.value[0][0], split.error(Part::First));
            let asked = model.luminance(&pair).unwrap();
            // Shadows agree with Smith's to 2 % here.
            near(
                found,
                asked,
                4.0 * error + 0.02 * asked,
                (kind, slopes, pair),
            );
            assert!(error < 0.03 * asked, "{kind} {slopes:?} {pair:?}: {error}");
        }
    }
}

/// Albedos of other surfaces and paths differ by no more than what each says that it errs by; with four times the paths it is half.
fn albedos_err_by_their_noise(level: Level) {
    const SEEDS: u32 = 8;
    let seen_from = Direction::from_spherical(0.5, 0.2);
    let of = |keys: &str, surface: &str, seed: u32| {
        let text = format!(
            "{keys}\nseed = {seed}\nsurface = {{ {surface}, size = 128, correlation = 8, seed = {seed} }}"
        );
        laws::noisy_albedo(&*build(&text), seen_from)
    };
    let gaussian = |slope| format!("kind = \"gaussian\", rms_slope = {slope}");
    let [even, brushed] = ["0.6", "[0.6, 0.3]"].map(gaussian);
    let mirrors = |paths| format!("{MIRRORS}\nrays = 16384\npaths = {paths}");
    let [white, more] = [4, 16].map(|paths| format!("{WHITE}\npaths = {paths}"));
    let white = (white, more, &even);
    let mirrors = [(mirrors(16), &even), (mirrors(4), &brushed)];
    let mirrors = mirrors.map(|(keys, surface)| (keys, String::new(), surface));
    let all = [white].into_iter().chain(mirrors);
    for (keys, more, surface) in all.take(level.of(1, 3)) {
        let all: Vec<_> = (0..SEEDS).map(|seed| of(&keys, surface, seed)).collect();
        let n = f64::from(SEEDS);
        let mean = all.iter().map(|(a, _)| a.value[0]).sum::<f64>() / n;
        let square: f64 = all.iter().map(|(a, _)| (a.value[0] - mean).powi(2)).sum();
        let spread = (square / (n - 1.0)).sqrt();
        let noise = all.iter().map(|(_, noise)| noise).sum::<f64>() / n;
        // The spread of eight has an error of a quarter; what does not leave to one side leaves to another, and is counted twice.
        let is_said = spread < 1.7 * noise && noise < 10.0 * spread;
        assert!(is_said, "{keys}: {spread} {noise}");
        if !more.is_empty() {
            let ratio = noise / of(&more, surface, 1).1;
            assert!((1.6..2.5).contains(&ratio), "{ratio}");
        }
    }
}
