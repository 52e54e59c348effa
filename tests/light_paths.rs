//! Light by the number of facets it met: closed forms, an independent walk, energy and laws within errors.

mod common;

use common::light::assert_paths_bring_what_values_promise;
use common::{Level, levels};
use gonio::brdf::microfacet::{Beckmann, Distribution, FresnelSpec, Ggx, Microfacet};
use gonio::brdf::{
    Brdf, CLASSES, Channels, Part, Roughness, SampleBrdf, Spectrum, SplitBrdf, laws,
};
use gonio::geometry::{Direction, DirectionPair};
use gonio::light_paths::{DiffuseSpec, FacetsSpec, Paths, SmithMultiple};
use gonio::sampling::{Random, cosine_hemisphere, cosine_hemisphere_pdf};

levels! {
    albedos_err_by_their_noise: "thorough: more seeds and views";
}

const MIRRORS: FacetsSpec = FacetsSpec::Mirror(FresnelSpec::None);

fn white() -> FacetsSpec {
    FacetsSpec::Diffuse(DiffuseSpec {
        albedo: Spectrum::Grey(1.0),
    })
}

fn paths(bounces: Part, paths: usize) -> Paths {
    Paths {
        bounces,
        paths,
        seed: 1,
    }
}

fn surface<D: Distribution>(alpha: Roughness, facets: &FacetsSpec, n: usize) -> SmithMultiple<D> {
    SmithMultiple::new(alpha, facets, paths(Part::All, n), Channels::Luminance).unwrap()
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
    let fresnel = FresnelSpec::Schlick(gonio::brdf::microfacet::fresnel::SchlickSpec {
        f0: Spectrum::Rgb([0.9, 0.5, 0.1]),
    });
    fn compare<D: Distribution>(fresnel: &FresnelSpec) {
        for alpha in [
            Roughness::Isotropic(0.3),
            Roughness::Anisotropic([0.05, 1.5]),
        ] {
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
                assert!(
                    walk.split(&pair)
                        .transport
                        .classes
                        .iter()
                        .all(|e| *e <= 1e-12 * a[0].max(1.0))
                );
            }
        }
    }
    compare::<Ggx>(&fresnel);
    compare::<Beckmann>(&fresnel);
}

/// GGX of roughness 1 seen along the normal: the energy of one facet is 1 − ln 2.
#[test]
fn one_facet_of_unit_roughness_has_a_closed_form() {
    let alpha = Roughness::Isotropic(1.0);
    let first = paths(Part::First, 2);
    let surface = SmithMultiple::<Ggx>::new(alpha, &MIRRORS, first, Channels::Luminance).unwrap();
    let albedo = laws::directional_albedo(&surface, Direction::NORMAL).value[0];
    assert!(
        (albedo - (1.0 - std::f64::consts::LN_2)).abs() < 1e-8,
        "{albedo}"
    );
}

/// Energies of one, two and three facets by an independent walk (± .001); the rest, so that all of them are 1.
#[test]
fn energies_are_those_of_an_independent_walk() {
    let known = [
        (0.1, 0.0, [0.988, 0.011]),
        (0.5, 0.0, [0.688, 0.232]),
        (0.5, 60.0, [0.698, 0.240]),
        (1.0, 0.0, [0.306, 0.323]),
    ];
    for (alpha, theta_deg, known) in known {
        let alpha = Roughness::Isotropic(alpha);
        let omega_o = Direction::from_spherical(f64::to_radians(theta_deg), 0.4);
        let (mean, error) = energies(&surface::<Ggx>(alpha, &MIRRORS, 4), alpha, omega_o, 40_000);
        for (class, known) in known.into_iter().enumerate() {
            let off = (mean[class] - known).abs();
            assert!(
                off < 0.0015 + 3.0 * error[class],
                "{alpha} {theta_deg} {mean:?} {error:?}"
            );
            assert!(error[class] < 0.006, "{error:?}");
        }
    }
}

#[test]
fn no_light_is_lost() {
    let views = [0.0, 30.0, 60.0, 80.0].map(|t| Direction::from_spherical(f64::to_radians(t), 0.4));
    fn check<D: Distribution>(alpha: Roughness, facets: &FacetsSpec, views: &[Direction]) {
        let surface = surface::<D>(alpha, facets, 4);
        for view in views {
            let (mean, error) = energies(&surface, alpha, *view, 20_000);
            let [all, off] = [mean[CLASSES], error[CLASSES]];
            assert!(
                (all - 1.0).abs() < 3.5 * off,
                "{alpha} {view:?}: {all} ± {off}"
            );
            assert!(off < 0.03, "{alpha} {view:?}: ± {off}");
        }
    }
    for alpha in [
        Roughness::Isotropic(0.2),
        Roughness::Anisotropic([0.3, 1.0]),
    ] {
        for facets in [MIRRORS, white()] {
            check::<Ggx>(alpha, &facets, &views);
            check::<Beckmann>(alpha, &facets, &views);
        }
    }
}

/// Values of two seeds differ by what their errors say.
#[test]
fn errors_are_what_values_are_off_by() {
    let alpha = Roughness::Isotropic(0.5);
    for facets in [MIRRORS, white()] {
        let of = |seed| {
            let paths = Paths {
                seed,
                ..paths(Part::All, 400)
            };
            SmithMultiple::<Ggx>::new(alpha, &facets, paths, Channels::Luminance).unwrap()
        };
        let [a, b] = [of(1), of(2)];
        let pairs: Vec<_> = laws::pairs(800, 9).into_iter().step_by(2).collect();
        let (mut square, mut n) = ([0.0; CLASSES + 1], 0.0);
        for pair in pairs {
            let [a, b] = [a.split(&pair), b.split(&pair)];
            n += 1.0;
            let parts = Part::CLASSES.into_iter().chain([Part::All]);
            for (square, part) in square.iter_mut().zip(parts) {
                let off = a.part(part)[0] - b.part(part)[0];
                let error = a.error(part).hypot(b.error(part));
                *square += match off == 0.0 {
                    true => 0.0,
                    false => (off / error).powi(2),
                };
            }
        }
        let ratio = square.map(|s: f64| (s / n).sqrt());
        // The first class of mirrors is exact.
        let judged = if facets == MIRRORS {
            &ratio[1..]
        } else {
            &ratio[..]
        };
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
            let paths = Paths {
                seed,
                ..paths(Part::All, 16)
            };
            let alpha = Roughness::Isotropic(0.5);
            let rough =
                SmithMultiple::<Ggx>::new(alpha, &MIRRORS, paths, Channels::Luminance).unwrap();
            let (albedo, noise) = laws::noisy_albedo(&rough, seen_from);
            square += ((albedo.value[0] - 1.0) / noise).powi(2) / seeds as f64;
        }
        // The root mean square of n has a relative error of 1/√2n: three of these.
        let ratio = square.sqrt();
        let slack = 3.0 / (2.0 * seeds as f64).sqrt();
        assert!((ratio - 1.0).abs() < slack, "{theta}: {ratio}");
    }
}

/// Of coloured facets too, and of rough ones along one axis.
#[test]
fn paths_bring_what_values_promise() {
    let alpha = Roughness::Anisotropic([0.3, 0.8]);
    let coloured = FacetsSpec::Mirror(FresnelSpec::Schlick(
        gonio::brdf::microfacet::fresnel::SchlickSpec {
            f0: Spectrum::Rgb([0.9, 0.5, 0.1]),
        },
    ));
    for facets in [coloured, white()] {
        let surface = surface::<Ggx>(alpha, &facets, 8);
        assert_paths_bring_what_values_promise(&surface, [1 << 18, 1 << 16], [0.01, 0.03]);
    }
}

/// A material of light of two facets has no other, neither along paths nor at pairs.
#[test]
fn light_that_is_not_asked_for_is_not_told() {
    let alpha = Roughness::Isotropic(0.7);
    for facets in [MIRRORS, white()] {
        let second = paths(Part::Second, 16);
        let second =
            SmithMultiple::<Ggx>::new(alpha, &facets, second, Channels::Luminance).unwrap();
        let mut left = 0;
        second.paths(0, 4000, &mut |path| {
            assert_eq!(path.met, 2);
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
        let [one, all] = [Part::First, Part::All].map(|part| {
            SmithMultiple::<Ggx>::new(alpha, &facets, paths(part, 64), Channels::Luminance).unwrap()
        });
        let is_exact = facets == MIRRORS;
        assert_eq!(one.follows_pairs(), !is_exact);
        assert_eq!(one.remarks().is_empty(), is_exact);
        assert!(all.follows_pairs() && !all.remarks().is_empty());
        for pair in laws::pairs(50, 2)
            .iter()
            .filter(|pair| pair.is_above_horizon())
        {
            let [one, all] = [&one, &all].map(|surface| surface.split(pair));
            let [a, b] = [&one, &all].map(|split| split.part(Part::First)[0]);
            let error = one.error(Part::First);
            match is_exact {
                true => assert!((a - b).abs().max(error) <= 1e-12 * b, "{a} {b} {error}"),
                false => assert!(error > 1e-4 * a, "{a} {error}"),
            }
        }
    }
}

#[cfg(feature = "surfaces")]
mod surfaces {
    use super::{MIRRORS, white};
    use glam::DVec3;
    use gonio::brdf::Channels;
    use gonio::brdf::microfacet::FresnelSpec;
    use gonio::geometry::Direction;
    use gonio::light_paths::surface::{self, HeightField};
    use gonio::light_paths::{Energies, Exit, FacetsSpec, Ray, Tracer, Transport, TransportSpec};
    use gonio::registry;
    use gonio::sampling::Random;
    use std::sync::Arc;

    fn field(kind: &str, text: &str) -> HeightField {
        let entries = surface::all();
        let entry = entries.iter().find(|e| e.kind == kind).unwrap();
        registry::read_text(entry, text).unwrap().build(0).unwrap()
    }

    fn energies(
        field: &HeightField,
        facets: &FacetsSpec,
        omega_i: Direction,
        rays: u64,
    ) -> Energies {
        let spec = TransportSpec { rays, seed: 3 };
        Transport::new(Arc::new(field.clone()), facets, &Channels::Luminance)
            .unwrap()
            .energies(omega_i, &spec)
    }

    fn at(theta_deg: f64, phi_deg: f64) -> Direction {
        Direction::from_spherical(theta_deg.to_radians(), phi_deg.to_radians())
    }

    /// Grooves of 45°, light in the plane across them: tan θ of it leaves after one facet, the rest after two, back to the light.
    #[test]
    fn square_grooves_have_a_closed_form() {
        let grooves = field("v-grooves", "angle_deg = 45.0\nsize = 16");
        for theta_deg in [0.0, 10.0, 30.0, 44.0] {
            let found = energies(&grooves, &MIRRORS, at(theta_deg, 0.0), 100_000);
            let first = theta_deg.to_radians().tan();
            let error = (first * (1.0 - first) / 1e5).sqrt();
            assert!(
                (found.bounces[0] - first).abs() < 4.0 * error + 1e-4,
                "{found:?}"
            );
            assert!(
                (found.bounces[1] - (1.0 - first)).abs() < 4.0 * error + 1e-4,
                "{found:?}"
            );
        }
    }

    #[test]
    fn a_plane_reflects_once() {
        let plane = HeightField::new([3, 2], &[0.7; 6]).unwrap();
        for theta_deg in [0.0, 45.0, 89.9] {
            let found = energies(&plane, &MIRRORS, at(theta_deg, 20.0), 5000);
            assert_eq!(
                (found.bounces, found.lost),
                ([1.0, 0.0, 0.0], 0),
                "{theta_deg}"
            );
            assert!(found.shadowed < 1e-15, "{found:?}");
        }
    }

    /// Light at 45° < θ across grooves of 45° meets one side alone, (cos θ + sin θ)/2 of it for each of the plane, and of the plane
    /// it meets cos θ: what is behind others is tan(θ − 45°). Along the grooves nothing is.
    #[test]
    fn grooves_are_shadowed_by_a_closed_form() {
        let grooves = field("v-grooves", "angle_deg = 45.0\nsize = 16");
        let shadowed =
            |theta_deg, phi_deg| energies(&grooves, &MIRRORS, at(theta_deg, phi_deg), 1).shadowed;
        for theta_deg in [46.0, 60.0, 75.0, 89.0] {
            let expected = f64::to_radians(theta_deg - 45.0).tan();
            for phi_deg in [0.0, 180.0] {
                let found = shadowed(theta_deg, phi_deg);
                assert!((found - expected).abs() < 1e-12, "{theta_deg}: {found}");
            }
            assert!(shadowed(theta_deg, 90.0) < 1e-12, "{theta_deg}");
            assert!(shadowed(44.0, 0.0) < 1e-12);
        }
    }

    /// Without absorption everything leaves; with it, what leaves and what is absorbed is everything.
    #[test]
    fn no_ray_is_lost() {
        let metal = FacetsSpec::default();
        let grey = FacetsSpec::Mirror(FresnelSpec::default());
        for entry in surface::all() {
            for example in entry.examples {
                let field = registry::read_text(&entry, example)
                    .unwrap()
                    .build(0)
                    .unwrap();
                for facets in [&MIRRORS, &white(), &metal, &grey] {
                    for theta_deg in [0.0, 30.0, 60.0, 80.0, 89.0] {
                        let found = energies(&field, facets, at(theta_deg, 33.0), 8000);
                        let out: f64 = found.bounces.iter().sum();
                        let name = entry.kind;
                        assert_eq!(found.lost, 0, "{name} {theta_deg}: {found:?}");
                        let sum = out + found.absorbed;
                        assert!((sum - 1.0).abs() < 1e-11, "{name} {theta_deg}: {found:?}");
                        if *facets == MIRRORS || *facets == white() {
                            assert!((out - 1.0).abs() < 1e-11, "{name} {theta_deg}: {found:?}");
                        }
                    }
                }
            }
        }
    }

    /// The first of all triangles of the period and its neighbours that a ray meets, by the crossing of a plane.
    fn first_of_all(field: &HeightField, from: DVec3, direction: DVec3, after: f64) -> Option<f64> {
        let [nx, ny] = field.size();
        let mut first: Option<f64> = None;
        for y in 0..ny {
            for x in 0..nx {
                let [a, b, c, d] = field.corners([x, y]);
                let corner =
                    |u: usize, v: usize, z: f64| DVec3::new((x + u) as f64, (y + v) as f64, z);
                let [a, b, c, d] = [
                    corner(0, 0, a),
                    corner(1, 0, b),
                    corner(0, 1, c),
                    corner(1, 1, d),
                ];
                for [p, q, r] in [[a, b, d], [a, d, c]] {
                    for (tx, ty) in (-2..=2).flat_map(|tx| (-2..=2).map(move |ty| (tx, ty))) {
                        let shift =
                            DVec3::new((tx * nx as i32).into(), (ty * ny as i32).into(), 0.0);
                        let (e, f) = (q - p, r - p);
                        let s = direction.cross(f);
                        let det = e.dot(s);
                        let to = from - p - shift;
                        let u = to.dot(s) / det;
                        let k = to.cross(e);
                        let v = direction.dot(k) / det;
                        let t = f.dot(k) / det;
                        if u >= 0.0
                            && v >= 0.0
                            && u + v <= 1.0
                            && t > after
                            && first.is_none_or(|f| t < f)
                        {
                            first = Some(t);
                        }
                    }
                }
            }
        }
        first
    }

    /// Points of a surface, and whether they see the light.
    #[test]
    fn what_is_shadowed_does_not_see_the_light() {
        let mut stream = Random::new(5).stream(0);
        let heights: Vec<f64> = (0..35).map(|_| 3.0 * stream.next()).collect();
        let field = HeightField::new([7, 5], &heights).unwrap();
        for theta_deg in [20.0, 45.0, 60.0] {
            let omega_i = at(theta_deg, 70.0);
            let light = omega_i.vector();
            let (mut turned, mut behind, mut squares) = (0.0, 0.0, 0.0);
            for _ in 0..5000 {
                let [x, y] = [7.0, 5.0].map(|n| n * stream.next());
                let cell = [x as usize, y as usize];
                let [u, v] = [x.fract(), y.fract()];
                let [low, high] = field.slopes(cell);
                let slope = if u >= v { low } else { high };
                let height = field.corners(cell)[0] + slope[0] * u + slope[1] * v;
                let area = light.dot(DVec3::new(-slope[0], -slope[1], 1.0)).max(0.0);
                turned += area;
                let from = DVec3::new(x, y, height);
                if area > 0.0 && first_of_all(&field, from, light, 1e-9).is_some() {
                    behind += area;
                    squares += area * area;
                }
            }
            let [share, error] = [behind, squares.sqrt()].map(|sum| sum / turned);
            let found = energies(&field, &MIRRORS, omega_i, 1).shadowed;
            assert!(
                (share - found).abs() < 4.0 * error + 1e-9,
                "{theta_deg}: {share} ± {error}, {found}"
            );
            assert!(
                theta_deg < 40.0 || (0.01..0.6).contains(&found),
                "{theta_deg}: {found}"
            );
        }
    }

    /// Whole paths, ray by ray, on heights that are all different, of periods that are no squares.
    #[test]
    fn rays_hit_what_they_meet_first() {
        let random = Random::new(11);
        for (size, steep) in [([13, 7], 1.0), ([2, 9], 3.0), ([70, 3], 0.4)] {
            let mut stream = random.stream(size[0] as u64);
            let heights: Vec<f64> = (0..size[0] * size[1])
                .map(|_| steep * stream.next())
                .collect();
            let field = HeightField::new(size, &heights).unwrap();
            let tracer = Tracer::new(Arc::new(field.clone()));
            let mut compared = 0;
            for _ in 0..120 {
                let theta = 1.1 * stream.next();
                let phi = std::f64::consts::TAU * stream.next();
                let direction = -Direction::from_spherical(theta, phi).vector();
                let mut ray: Ray = tracer.from_sky([stream.next(), stream.next()], direction);
                let mut after = -1e-9;
                for _ in 0..6 {
                    let (from, way) = (ray.place(), ray.direction());
                    let met = first_of_all(&field, from, way, after);
                    match tracer.follow(ray) {
                        Exit::Hit(hit) => {
                            let place = hit.place();
                            let back =
                                |x: f64, n: usize| x - (x / n as f64 + 0.5).floor() * n as f64;
                            // Within the two periods on each side that are searched.
                            if let Some(t) = met {
                                let off = from + way * t - place;
                                let off =
                                    DVec3::new(back(off.x, size[0]), back(off.y, size[1]), off.z);
                                assert!(off.length() < 1e-9, "{off} {from} {way}");
                                compared += 1;
                            }
                            let next = way - 2.0 * way.dot(hit.normal) * hit.normal;
                            ray = hit.turned(next.normalize());
                            after = 1e-9;
                        }
                        Exit::Sky => {
                            assert!(met.is_none(), "{from} {way}");
                            compared += 1;
                            break;
                        }
                        Exit::Lost => panic!("{from} {way}"),
                    }
                }
            }
            assert!(compared > 200, "{compared}");
        }
    }
}
