//! Light by the number of facets it met: closed forms, an independent walk, energy and laws within errors.

use super::common::light::assert_paths_bring_what_values_promise;
use super::common::{Level, levels, near, product};
use super::{MIRRORS, paths, surface, white};
use gonio::brdf::microfacet::fresnel::SchlickSpec;
use gonio::brdf::microfacet::{Beckmann, Distribution, FresnelSpec, Ggx, Microfacet};
use gonio::brdf::{
    Brdf, CLASSES, Channels, Part, Roughness, SampleBrdf, Spectrum, SplitBrdf, laws,
};
use gonio::geometry::{Direction, DirectionPair};
use gonio::light_paths::{FacetsSpec, SmithMultiple};
use gonio::sampling::{Random, cosine_hemisphere, cosine_hemisphere_pdf};

levels! {
    albedos_err_by_their_noise: "thorough: more seeds and views";
}

fn coloured() -> FresnelSpec {
    FresnelSpec::Schlick(SchlickSpec {
        f0: Spectrum::Rgb([0.9, 0.5, 0.1]),
    })
}

/// Energy of each class seen from `theta_deg`, of their sum, and standard errors: directions from a mixture of the cosine and
/// of the mirrored visible normals.
fn energies<D: Distribution>(
    surface: &SmithMultiple<D>,
    alpha: Roughness,
    omega_o: Direction,
    count: u64,
) -> ([f64; CLASSES + 1], [f64; CLASSES + 1]) {
    let lobe = Microfacet::<D>::new(alpha, &FresnelSpec::None, Channels::Luminance);
    let random = Random::new(7);
    let mut sums = [[0.0; 2]; CLASSES + 1];
    for i in 0..count {
        let [choice, a, b] = random.point(i);
        let omega_i = match choice < 0.5 {
            true => Some(cosine_hemisphere([a, b])),
            false => lobe.sample(omega_o, [a, b]),
        };
        // A draw below the horizon brings nothing.
        let Some(omega_i) = omega_i else { continue };
        let pair = DirectionPair::new(omega_i, omega_o);
        let density = 0.5 * (cosine_hemisphere_pdf(omega_i) + lobe.pdf(&pair));
        let split = surface.split(&pair);
        let mut values = [0.0; CLASSES + 1];
        for class in 0..CLASSES {
            values[class] = split.value[class][0] * omega_i.cos_theta() / density;
            values[CLASSES] += values[class];
        }
        for (sum, value) in sums.iter_mut().zip(values) {
            sum[0] += value;
            sum[1] += value * value;
        }
    }
    let n = count as f64;
    let mean = sums.map(|[sum, _]| sum / n);
    let error = sums.map(|[sum, square]| ((square - sum * sum / n) / (n * n)).max(0.0).sqrt());
    (mean, error)
}

#[test]
fn one_facet_is_the_model_of_single_reflection() {
    fn compare<D: Distribution>(fresnel: &FresnelSpec) {
        let anisotropic = Roughness::Anisotropic([0.05, 1.5]);
        for alpha in [Roughness::Isotropic(0.3), anisotropic] {
            let facets = FacetsSpec::Mirror(fresnel.clone());
            let first = paths(Part::First, 2);
            let walk = SmithMultiple::<D>::new(alpha, &facets, first, Channels::Rgb).unwrap();
            let model = Microfacet::<D>::new(alpha, fresnel, Channels::Rgb);
            for pair in laws::pairs(2000, 3) {
                let [mut a, mut b] = [[0.0; 3]; 2];
                _ = walk.eval(&pair, &mut a);
                _ = model.eval(&pair, &mut b);
                for (a, b) in a.iter().zip(b) {
                    // Twelve digits, of D at 1e-12 of a half vector's angle where it is steep.
                    assert!((a - b).abs() <= 1e-12 * b.max(1e-3), "{a} {b} {pair:?}");
                }
                let errors = walk.split(&pair).transport;
                assert!(errors.0.iter().all(|e| *e <= 1e-12 * a[0].max(1.0)));
            }
        }
    }
    compare::<Ggx>(&coloured());
    compare::<Beckmann>(&coloured());
}

/// No light is lost; and the energies of one and two facets are those of an independent walk (± .001).
#[test]
fn energies_add_up_and_are_those_of_an_independent_walk() {
    fn check<D: Distribution>(
        alpha: Roughness,
        facets: &FacetsSpec,
        theta_deg: f64,
        known: [f64; 2],
    ) {
        let view = Direction::from_spherical(theta_deg.to_radians(), 0.4);
        let count = if known[0] > 0.0 { 40_000 } else { 20_000 };
        let surface = surface::<D>(alpha, facets, paths(Part::All, 4));
        let (mean, error) = energies(&surface, alpha, view, count);
        let case = format!("{alpha} {theta_deg}: {mean:?} {error:?}");
        near(mean[CLASSES], 1.0, 3.5 * error[CLASSES], &case);
        assert!(error[CLASSES] < 0.03, "{case}");
        let known = known.into_iter().enumerate();
        for (class, known) in known.filter(|(_, known)| *known > 0.0) {
            near(mean[class], known, 0.0015 + 3.0 * error[class], &case);
            assert!(error[class] < 0.006, "{case}");
        }
    }
    for (alpha, theta_deg, known) in [
        (0.1, 0.0, [0.988, 0.011]),
        (0.5, 0.0, [0.688, 0.232]),
        (0.5, 60.0, [0.698, 0.240]),
        (1.0, 0.0, [0.306, 0.323]),
    ] {
        check::<Ggx>(Roughness::Isotropic(alpha), &MIRRORS, theta_deg, known);
    }
    let anisotropic = Roughness::Anisotropic([0.3, 1.0]);
    let alphas = [Roughness::Isotropic(0.2), anisotropic];
    let views = product([MIRRORS, white()], [0.0, 30.0, 60.0, 80.0]);
    for (alpha, (facets, theta_deg)) in product(alphas, views) {
        check::<Ggx>(alpha, &facets, theta_deg, [0.0; 2]);
        check::<Beckmann>(alpha, &facets, theta_deg, [0.0; 2]);
    }
}

/// Values of two seeds differ by what their errors say.
#[test]
fn errors_are_what_values_are_off_by() {
    let alpha = Roughness::Isotropic(0.5);
    for facets in [MIRRORS, white()] {
        let [a, b] = [1, 2].map(|seed| {
            let mut paths = paths(Part::All, 400);
            paths.seed = seed;
            surface::<Ggx>(alpha, &facets, paths)
        });
        let pairs: Vec<_> = laws::pairs(800, 9).into_iter().step_by(2).collect();
        let (mut square, mut n) = ([0.0; CLASSES + 1], 0.0);
        for pair in pairs {
            let [a, b] = [a.split(&pair), b.split(&pair)];
            n += 1.0;
            let parts = Part::CLASSES.into_iter().chain([Part::All]);
            for (square, part) in square.iter_mut().zip(parts) {
                let off = a.part(part)[0] - b.part(part)[0];
                let error = a.error(part).hypot(b.error(part));
                if off != 0.0 {
                    *square += (off / error).powi(2);
                }
            }
        }
        let ratio = square.map(|s: f64| (s / n).sqrt());
        // The first class of mirrors is exact.
        let judged = &ratio[usize::from(facets == MIRRORS)..];
        assert!(judged.iter().all(|r| (0.85..1.2).contains(r)), "{ratio:?}");
    }
}

/// And so do albedos, which lossless facets have 1; seen from the normal, where all azimuths are one pair, too.
fn albedos_err_by_their_noise(level: Level) {
    let seeds = level.of(16, 40);
    for theta in level.of(vec![0.5], vec![0.0, 0.5]) {
        let seen_from = Direction::from_spherical(theta, 0.0);
        let mut square = 0.0;
        for seed in 0..seeds {
            let mut paths = paths(Part::All, 16);
            paths.seed = seed;
            let alpha = Roughness::Isotropic(0.5);
            let rough = surface::<Ggx>(alpha, &MIRRORS, paths);
            let (albedo, noise) = laws::noisy_albedo(&rough, seen_from);
            square += ((albedo.value[0] - 1.0) / noise).powi(2) / seeds as f64;
        }
        // The root mean square of n has a relative error of 1/√2n: three of these.
        let slack = 3.0 / (2.0 * seeds as f64).sqrt();
        near(square.sqrt(), 1.0, slack, theta);
    }
}

/// Of coloured facets too, and of rough ones along one axis.
#[test]
fn paths_bring_what_values_promise() {
    let alpha = Roughness::Anisotropic([0.3, 0.8]);
    for facets in [FacetsSpec::Mirror(coloured()), white()] {
        let surface = surface::<Ggx>(alpha, &facets, paths(Part::All, 8));
        assert_paths_bring_what_values_promise(&surface, [1 << 18, 1 << 16], [0.01, 0.03]);
    }
}

/// A material of light of two facets has no other, neither along paths nor at pairs.
#[test]
fn light_that_is_not_asked_for_is_not_told() {
    let alpha = Roughness::Isotropic(0.7);
    for facets in [MIRRORS, white()] {
        let second = paths(Part::Second, 16);
        let second = surface::<Ggx>(alpha, &facets, second);
        let mut left = 0;
        second.paths(0, 4000, &mut |path| {
            assert_eq!(path.order, 2);
            left += 1;
        });
        assert!(left > 200, "{left}");
        for pair in laws::pairs(50, 2) {
            let split = second.split(&pair);
            let value = second.luminance(&pair).unwrap();
            assert_eq!([split.value[0][0], split.value[2][0]], [0.0; 2]);
            assert_eq!(split.part(Part::All)[0], value);
            assert_eq!(split.error(Part::All), split.error(Part::Second));
        }
    }
}

/// Light of one mirror is that of any number of paths, and has no error; that of a matte facet has one.
#[test]
fn one_mirror_knows_no_chance() {
    let alpha = Roughness::Isotropic(0.7);
    for facets in [MIRRORS, white()] {
        let of = |part| surface::<Ggx>(alpha, &facets, paths(part, 64));
        let [one, all] = [Part::First, Part::All].map(of);
        let is_exact = facets == MIRRORS;
        assert_eq!(one.follows_pairs(), !is_exact);
        assert_eq!(one.remarks().is_empty(), is_exact);
        assert!(all.follows_pairs() && !all.remarks().is_empty());
        let pairs = laws::pairs(50, 2).into_iter();
        for pair in pairs.filter(DirectionPair::is_above_horizon) {
            let [one, all] = [&one, &all].map(|surface| surface.split(&pair));
            let [a, b] = [&one, &all].map(|split| split.part(Part::First)[0]);
            let error = one.error(Part::First);
            match is_exact {
                true => assert!((a - b).abs().max(error) <= 1e-12 * b, "{a} {b} {error}"),
                false => assert!(error > 1e-4 * a, "{a} {error}"),
            }
        }
    }
}
