//! A parametrization that is no polar chart, and none of the crate's: the components of the
//! projected half and back vectors. It needs nothing but this file.
#![cfg(feature = "experiments")]

mod common;

use common::{
    Level, images, levels, member, near, planned, random_pair, random_pairs, says, symmetries,
    turned,
};
use glam::{DVec2, Vec3Swizzles};
use gonio::brdf::Brdf;
use gonio::geometry::{Direction, DirectionPair, Symmetry, distance};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::Measurement;
use gonio::parametrization::{
    self, Axis, AxisKind, Coords, Edwards, Mapped, Maps, Parametrization, ParametrizationKind,
    ParametrizationSpec, Quantity, mapped_entry,
};
use gonio::reconstruct;
use gonio::registry::{self, Entry};
use gonio::sampling::Random;
use std::sync::Arc;

levels! {
    grids_and_scattered_searches_converge: "thorough: in four dimensions";
}

/// (h_x, h_y, k_x, k_y); isotropic: |h_bar|, and k_bar along and across h_bar.
struct Cartesian;

const ENTRY: Entry<ParametrizationSpec> = mapped_entry::<Cartesian>(
    "components of the projected half and back vectors",
    &["", "warp = {}"],
);

impl Maps for Cartesian {
    const KIND: &'static str = "cartesian";

    fn axes(isotropic: bool) -> Vec<Axis> {
        let axis = |symbol, label| Axis::straight(symbol, label, [-1.0, 1.0]);
        if !isotropic {
            let all = ["h_x", "h_y", "k_x", "k_y"];
            return all.map(|symbol| axis(symbol, symbol)).to_vec();
        }
        let length = Axis {
            range: [0.0, 1.0],
            kind: AxisKind::Radial,
            quantity: Quantity::Length,
            peak_at_start: true,
            density: 2.0,
            ..axis("h_bar", "|h̄|")
        };
        vec![length, axis("k_along", "k∥"), axis("k_across", "k⊥")]
    }

    fn forward(pair: &DirectionPair, isotropic: bool) -> Coords {
        let (h, k) = (pair.half().xy(), pair.back().xy());
        if isotropic {
            let along = h.try_normalize().unwrap_or(DVec2::X);
            [h.length(), along.dot(k), along.perp_dot(k), 0.0]
        } else {
            [h.x, h.y, k.x, k.y]
        }
    }

    fn inverse(&[a, b, c, d]: &Coords, isotropic: bool) -> Option<DirectionPair> {
        let (h, k) = match isotropic {
            true => (DVec2::new(a, 0.0), DVec2::new(b, c)),
            false => (DVec2::new(a, b), DVec2::new(c, d)),
        };
        let up = |v: DVec2| {
            let z2 = 1.0 - v.length_squared();
            (z2 >= 0.0).then(|| Direction::from_unit(v.extend(z2.sqrt())))
        };
        Some(DirectionPair::new(up(h + k)?, up(h - k)?))
    }
}

/// Edwards' maps without their Jacobian.
struct Halfway;

impl Maps for Halfway {
    const KIND: &'static str = "halfway";

    fn axes(isotropic: bool) -> Vec<Axis> {
        Edwards::axes(isotropic)
    }

    fn forward(pair: &DirectionPair, isotropic: bool) -> Coords {
        Edwards::forward(pair, isotropic)
    }

    fn inverse(coords: &Coords, isotropic: bool) -> Option<DirectionPair> {
        Edwards::inverse(coords, isotropic)
    }
}

/// The formula of a Jacobian is that which is found by differences, and (u, v) fills the unit disk: its edge is the horizon.
#[test]
fn the_disk_of_half_vectors_has_its_jacobian_and_its_edge() {
    for symmetry in [Symmetry::NONE, Symmetry::FULL] {
        let exact = Mapped::<Edwards>::with_symmetry(symmetry);
        let found = Mapped::<Halfway>::with_symmetry(symmetry);
        let high = random_pairs(6)
            .take(500)
            .filter(|p| common::lowest(p) > 0.2);
        for pair in high {
            let c = exact.forward(&pair);
            near(found.jacobian(&c) / exact.jacobian(&c), 1.0, 1e-5, pair);
            let disk = match symmetry.isotropic {
                true => [c[1], c[2]],
                false => [c[2], c[3]],
            };
            let r = disk[0].hypot(disk[1]);
            assert!(r < 1.0, "{pair:?}");
            let outwards = |r: f64| {
                let mut c = c;
                let at = if symmetry.isotropic { 1 } else { 2 };
                (c[at], c[at + 1]) = (disk[0] * r, disk[1] * r);
                exact.inverse(&c)
            };
            let edge = outwards((1.0 - 1e-9) / r).expect("in the disk");
            assert!(edge.omega_o.cos_theta() < 1e-7, "{edge:?}");
            assert!(outwards((1.0 + 1e-9) / r).is_none());
        }
    }
}

/// What is made of two maps and a domain: images, representatives and a Jacobian.
#[test]
fn maps_alone_make_a_parametrization() {
    let edwards = parametrization::find("edwards").expect("a member");
    let forms = symmetries().into_iter();
    for p in forms.flat_map(|s| [ENTRY.form(s), edwards.form(s)]) {
        let symmetry = p.symmetry();
        for (i, pair) in random_pairs(5).take(500).enumerate() {
            let c = p.forward(&pair);
            let back = p.inverse(&c).expect("physical");
            near(distance(&pair, &back, symmetry), 0.0, 1e-7, pair);
            let mut same = images(&pair, symmetry);
            if symmetry.isotropic {
                same.push(turned(&pair, i as f64));
            }
            for image in &same {
                let d = p.forward(image);
                for k in 0..4 {
                    near(d[k], c[k], 1e-12, (symmetry, image));
                }
            }
            let all = p.images(&c);
            let copies = [symmetry.reciprocal, symmetry.bilateral];
            let copies: usize = copies.map(|has| 1 + usize::from(has)).iter().product();
            let mirrors = 1 + usize::from(symmetry.bilateral && !symmetry.isotropic);
            assert_eq!((all[0], all.len()), (c, copies * mirrors));
            for image in &all {
                let image = p.inverse(image).expect("physical");
                near(distance(&pair, &image, symmetry), 0.0, 1e-7, pair);
            }
            let lowest = common::lowest(&pair);
            if lowest > 0.1 && p.name() == ENTRY.kind {
                // d omega = dx dy / cos theta, and (h, k) to (h + k, h − k) has determinant 4.
                let turn = if symmetry.isotropic { c[0] } else { 1.0 };
                let cosines = pair.omega_i.cos_theta() * pair.omega_o.cos_theta();
                let want = 4.0 * turn / cosines;
                near(p.jacobian(&c) / want, 1.0, 1e-6 / turn, (symmetry, pair));
            }
        }
    }
}

/// The inverse of another map.
struct Lost;

impl Maps for Lost {
    const KIND: &'static str = "lost";

    fn axes(isotropic: bool) -> Vec<Axis> {
        Cartesian::axes(isotropic)
    }

    fn forward(pair: &DirectionPair, isotropic: bool) -> Coords {
        Cartesian::forward(pair, isotropic)
    }

    fn inverse(&[a, b, c, d]: &Coords, isotropic: bool) -> Option<DirectionPair> {
        Cartesian::inverse(&[a, b, -0.9 * c, d], isotropic)
    }
}

#[test]
fn an_inverse_that_does_not_invert_is_refused() {
    let entry = mapped_entry::<Lost>("not what it says", &[""]);
    let refused = registry::read_text(&entry, "").expect_err("it is no inverse");
    let refused = refused.to_string();
    says(&refused, "\"lost\"");
    says(
        &refused,
        "allowed is an inverse that leads back to every pair",
    );
    says(&refused, "is off by");
}

fn reconstructed(method: &str, measurement: &Measurement) -> Box<dyn Brdf> {
    let method = member(reconstruct::all(), method, "");
    method.reconstruct(measurement).expect("enough readings")
}

/// The root of the mean squared relative error over pairs that are not near the horizon.
fn error(truth: &dyn Brdf, made: &dyn Brdf) -> f64 {
    let random = Random::new(9);
    let pairs = (0..4000).map(|i| random_pair(&random, i));
    let high = |p: &DirectionPair| p.omega_i.theta() < 1.2 && p.omega_o.theta() < 1.2;
    let (mut sum, mut n) = (0.0, 0.0);
    for pair in pairs.filter(high) {
        let [f, g] = [truth, made].map(|b| b.luminance(&pair).expect("no holes"));
        sum += (g / f - 1.0).powi(2);
        n += 1.0;
    }
    f64::sqrt(sum / n)
}

fn grids_and_scattered_searches_converge(level: Level) {
    let truth = common::model("ggx", "alpha = 0.6");
    let symmetries = [Symmetry::FULL, Symmetry::ORTHOTROPIC, Symmetry::NONE];
    for symmetry in symmetries.into_iter().take(level.of(1, 3)) {
        let p = ENTRY.form(symmetry);
        let budgets = match symmetry.isotropic {
            true => [500, 8000],
            false => [4000, 64_000],
        };
        for (set, method) in [
            ("grid", "multilinear"),
            ("grid", "cubic"),
            ("sobol", "inverse-distance"),
            ("stratified", "nearest"),
        ] {
            let [rough, fine] = budgets.map(|budget| {
                let schedule = planned(&p, set, budget, 1);
                assert!(schedule.poses.len() <= budget && schedule.poses.len() > budget / 2);
                let measurement = Ideal.measure(&*truth, &schedule);
                error(&*truth, &*reconstructed(method, &measurement))
            });
            println!("{symmetry:?} {set} {method}: {rough:.4} {fine:.4}");
            // Sixteen times the readings halve the spacing at least.
            let what = format!("{symmetry:?} {set} {method}");
            assert!(fine < rough / 1.4, "{what}: {rough} {fine}");
        }
    }
}

#[test]
fn a_straight_search_finds_what_a_polar_one_does() {
    // |h_bar| and |k_bar| with their azimuths, in polar coordinates, are these components.
    let truth = common::model("ggx", "alpha = 0.3");
    let polar = common::form("orthographic", Symmetry::NONE);
    let random = Random::new(4);
    let made = [polar.clone(), ENTRY.form(Symmetry::NONE)].map(|p| {
        let mut schedule = (*planned(&polar, "sobol", 3000, 1)).clone();
        for pose in &mut schedule.poses {
            pose.coords = p.forward(&pose.pair);
        }
        schedule.parametrization = p;
        let measurement = Ideal.measure(&*truth, &Arc::new(schedule));
        reconstructed("inverse-distance", &measurement)
    });
    for i in 0..2000 {
        let pair = random_pair(&random, i);
        let [a, b] = [&made[0], &made[1]].map(|m| m.luminance(&pair).expect("no holes"));
        near(a / b, 1.0, 1e-9, pair);
    }
}

#[test]
#[cfg(feature = "pictures")]
fn pictures_say_its_labels() {
    let svg = gonio::report::pictures::hemispheres_svg(&[ENTRY], &[30.0]);
    for label in ["cartesian", "|h̄|", "k∥"] {
        assert!(svg.contains(label), "{label}");
    }
    let functions = gonio::report::pictures::test_functions_svg(&[ENTRY], &[30.0], &[0.0]);
    assert!(functions.contains("k⊥"));
}
