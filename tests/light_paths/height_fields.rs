//! Light by the number of facets that it met on height fields, ray by ray: closed forms, and rays that are followed slowly.

use super::common::{near, product};
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

fn energies(field: &HeightField, facets: &FacetsSpec, omega_i: Direction, rays: u64) -> Energies {
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
        for (share, want) in found.bounces.into_iter().zip([first, 1.0 - first]) {
            near(share, want, 4.0 * error + 1e-4, theta_deg);
        }
    }
}

/// Light at 45° < θ across grooves of 45° meets one side alone, (cos θ + sin θ)/2 of it for each of the plane, and of the plane
/// it meets cos θ: what is behind others is tan(θ − 45°). Along the grooves nothing is.
#[test]
fn grooves_are_shadowed_by_a_closed_form() {
    let grooves = field("v-grooves", "angle_deg = 45.0\nsize = 16");
    let shadowed = |theta, phi| energies(&grooves, &MIRRORS, at(theta, phi), 1).shadowed;
    for theta_deg in [46.0, 60.0, 75.0, 89.0] {
        let expected = f64::to_radians(theta_deg - 45.0).tan();
        for phi_deg in [0.0, 180.0] {
            near(shadowed(theta_deg, phi_deg), expected, 1e-12, theta_deg);
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
            let field = registry::read_text(&entry, example).unwrap();
            let field = field.build(0).unwrap();
            let facets = [&MIRRORS, &white(), &metal, &grey];
            for (facets, theta_deg) in product(facets, [0.0, 30.0, 60.0, 80.0, 89.0]) {
                let found = energies(&field, facets, at(theta_deg, 33.0), 8000);
                let out: f64 = found.bounces.iter().sum();
                let what = format!("{} {theta_deg}: {found:?}", entry.kind);
                assert_eq!(found.lost, 0, "{what}");
                near(out + found.absorbed, 1.0, 1e-11, &what);
                if *facets == MIRRORS || *facets == white() {
                    near(out, 1.0, 1e-11, &what);
                }
            }
        }
    }
}

/// The first of all triangles of the period and its neighbours that a ray meets, by the crossing of a plane.
fn first_of_all(field: &HeightField, from: DVec3, direction: DVec3, after: f64) -> Option<f64> {
    let [nx, ny] = field.size();
    let mut first: Option<f64> = None;
    for (y, x) in product(0..ny, 0..nx) {
        let heights = field.corners([x, y]);
        let corner = |i| DVec3::new((x + i % 2) as f64, (y + i / 2) as f64, heights[i]);
        let [a, b, c, d] = [0, 1, 2, 3].map(corner);
        let shifts = product(-2..=2, -2..=2);
        for ([p, q, r], (tx, ty)) in product([[a, b, d], [a, d, c]], shifts) {
            let shift = DVec3::new((tx * nx as i32).into(), (ty * ny as i32).into(), 0.0);
            let (e, f) = (q - p, r - p);
            let s = direction.cross(f);
            let det = e.dot(s);
            let to = from - p - shift;
            let u = to.dot(s) / det;
            let k = to.cross(e);
            let v = direction.dot(k) / det;
            let t = f.dot(k) / det;
            let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            if is_inside && t > after && first.is_none_or(|f| t < f) {
                first = Some(t);
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
        near(share, found, 4.0 * error + 1e-9, (theta_deg, error));
        let is_some = theta_deg < 40.0 || (0.01..0.6).contains(&found);
        assert!(is_some, "{theta_deg}: {found}");
    }
}

/// Whole paths, ray by ray, on heights that are all different, of periods that are no squares.
#[test]
fn rays_hit_what_they_meet_first() {
    let random = Random::new(11);
    for (size, steep) in [([13, 7], 1.0), ([2, 9], 3.0), ([70, 3], 0.4)] {
        let mut stream = random.stream(size[0] as u64);
        let heights = (0..size[0] * size[1]).map(|_| steep * stream.next());
        let field = HeightField::new(size, &heights.collect::<Vec<_>>()).unwrap();
        let tracer = Tracer::new(Arc::new(field.clone()));
        let mut compared = 0;
        for _ in 0..120 {
            let theta = 1.1 * stream.next();
            let phi = std::f64::consts::TAU * stream.next();
            let direction = -Direction::from_spherical(theta, phi).vector();
            let mut ray: Ray = tracer.from_sky([stream.next(), stream.next()], direction);
            let mut after = -1e-9;
            for _ in 0..6 {
                let (from, way) = (ray.place, ray.direction);
                let met = first_of_all(&field, from, way, after);
                match tracer.follow(ray) {
                    Exit::Hit(hit) => {
                        let place = hit.ray.place;
                        let back = |x: f64, n: usize| x - (x / n as f64 + 0.5).floor() * n as f64;
                        // Within the two periods on each side that are searched.
                        if let Some(t) = met {
                            let off = from + way * t - place;
                            let off = DVec3::new(back(off.x, size[0]), back(off.y, size[1]), off.z);
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
