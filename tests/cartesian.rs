//! A parametrization that is no polar chart, and none of the crate's: the components of the
//! projected half and back vectors. It needs nothing but this file.
#![cfg(feature = "experiments")]

mod common;

use common::{Level, levels, member, near, planned, random_pair};
use glam::{DVec2, Vec3Swizzles};
use gonio::brdf::Brdf;
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::Measurement;
use gonio::parametrization::{
    Axis, AxisKind, Coords, Facts, Images, Layout, Parametrization, ParametrizationKind,
    ParametrizationSpec, Quantity, Unit, entry,
};
use gonio::reconstruct;
use gonio::registry::Entry;
use gonio::sampling::Random;
use std::sync::Arc;

levels! {
    grids_and_scattered_searches_converge: "thorough: in four dimensions";
}

/// (h_x, h_y, k_x, k_y); isotropic: |h_bar|, and k_bar along and across h_bar.
struct Cartesian {
    symmetry: Symmetry,
    axes: Vec<Axis>,
}

const ENTRY: Entry<ParametrizationSpec> = entry::<Cartesian>(
    "components of the projected half and back vectors",
    &["", "warp = {}"],
);

impl ParametrizationKind for Cartesian {
    const KIND: &'static str = "cartesian";

    fn with_symmetry(symmetry: Symmetry) -> Self {
        let axis = |symbol, label, folded: bool| Axis {
            symbol,
            label,
            unit: Unit::One,
            range: [if folded { 0.0 } else { -1.0 }, 1.0],
            kind: AxisKind::Straight,
            quantity: Quantity::Other,
            peak_at_start: false,
            density: 1.0,
            warp: None,
        };
        let Symmetry {
            reciprocal,
            bilateral,
            ..
        } = symmetry;
        let axes = if symmetry.isotropic {
            let length = Axis {
                kind: AxisKind::Radial,
                quantity: Quantity::Length,
                peak_at_start: true,
                density: 2.0,
                ..axis("h_bar", "|h̄|", true)
            };
            vec![
                length,
                axis("k_along", "k∥", reciprocal),
                axis("k_across", "k⊥", bilateral),
            ]
        } else {
            vec![
                axis("h_x", "h_x", bilateral),
                axis("h_y", "h_y", bilateral),
                axis("k_x", "k_x", reciprocal),
                axis("k_y", "k_y", false),
            ]
        };
        Self { symmetry, axes }
    }
}

impl Cartesian {
    /// Exchange turns k round; the mirrors turn one component of both vectors.
    fn fold(&self, [mut a, mut b, mut c, mut d]: Coords) -> Coords {
        let s = self.symmetry;
        if s.isotropic {
            // |h_bar|, along, across: beyond the pole both vectors have turned.
            if a < 0.0 {
                (a, b, c) = (-a, -b, -c);
            }
            if s.bilateral {
                c = c.abs();
            }
            if s.reciprocal && (b < 0.0 || b == 0.0 && c < 0.0) {
                (b, c) = (-b, if s.bilateral { c } else { -c });
            }
            return [a, b, c, 0.0];
        }
        if s.bilateral && a < 0.0 {
            (a, c) = (-a, -c);
        }
        if s.bilateral && b < 0.0 {
            (b, d) = (-b, -d);
        }
        if s.reciprocal && (c < 0.0 || c == 0.0 && d < 0.0) {
            (c, d) = (-c, -d);
        }
        [a, b, c, d]
    }
}

impl Parametrization for Cartesian {
    fn name(&self) -> &'static str {
        Self::KIND
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn forward(&self, pair: &DirectionPair) -> Coords {
        let (h, k) = (pair.half().xy(), pair.back().xy());
        self.fold(if self.symmetry.isotropic {
            let along = h.try_normalize().unwrap_or(DVec2::X);
            [h.length(), along.dot(k), along.perp_dot(k), 0.0]
        } else {
            [h.x, h.y, k.x, k.y]
        })
    }

    fn inverse(&self, &[a, b, c, d]: &Coords) -> Option<DirectionPair> {
        let (h, k) = if self.symmetry.isotropic {
            (DVec2::new(a, 0.0), DVec2::new(b, c))
        } else {
            (DVec2::new(a, b), DVec2::new(c, d))
        };
        let up = |v: DVec2| {
            let z2 = 1.0 - v.length_squared();
            (z2 >= 0.0).then(|| Direction::from_unit(v.extend(z2.sqrt())))
        };
        Some(DirectionPair::new(up(h + k)?, up(h - k)?))
    }

    fn canonical(&self, coords: &Coords) -> Option<Coords> {
        let inside = coords.iter().all(|c| c.abs() <= 1.0);
        inside.then(|| self.fold(*coords))
    }

    fn jacobian(&self, coords: &Coords) -> f64 {
        // d omega = dx dy / cos theta, and (h, k) to (h + k, h − k) has determinant 4.
        let Some(pair) = self.inverse(coords) else {
            return f64::INFINITY;
        };
        let turn = if self.symmetry.isotropic {
            coords[0]
        } else {
            1.0
        };
        4.0 * turn / (pair.omega_i.cos_theta() * pair.omega_o.cos_theta())
    }

    fn facts(&self) -> Facts {
        Facts {
            layout: Layout::Straight,
            exchange: false,
            round_trip: [1e-12, 4e-8],
            singular: true,
            squared: false,
        }
    }

    fn images(&self, &[a, b, c, d]: &Coords) -> Images {
        let s = self.symmetry;
        let mut images = Images::from_slice(&[[a, b, c, d]]);
        // Signs of the coordinates.
        let exchanged = match s.isotropic {
            true => [1.0, -1.0, -1.0, 0.0],
            false => [1.0, 1.0, -1.0, -1.0],
        };
        let mirrored: &[Coords] = match s.isotropic {
            true => &[[1.0, 1.0, -1.0, 0.0]],
            false => &[[-1.0, 1.0, -1.0, 1.0], [1.0, -1.0, 1.0, -1.0]],
        };
        let exchanged = s.reciprocal.then_some(&exchanged).into_iter();
        for signs in exchanged.chain(mirrored.iter().filter(|_| s.bilateral)) {
            let image = |c: &Coords| std::array::from_fn(|k| signs[k] * c[k]);
            let more: Images = images.iter().map(image).collect();
            images.extend(more);
        }
        images
    }
}

/// A reconstruction of a material from so many readings in some coordinates.
fn made(
    p: &Arc<dyn Parametrization>,
    set: &str,
    method: &str,
    budget: usize,
    brdf: &dyn Brdf,
) -> Box<dyn Brdf> {
    let schedule = planned(p, set, budget, 1);
    assert!(schedule.poses.len() <= budget && schedule.poses.len() > budget / 2);
    reconstructed(method, &Ideal.measure(brdf, &schedule))
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
        let [few, many] = if symmetry.isotropic {
            [500, 8000]
        } else {
            [4000, 64_000]
        };
        for (set, method) in [
            ("grid", "multilinear"),
            ("grid", "cubic"),
            ("sobol", "inverse-distance"),
            ("stratified", "nearest"),
        ] {
            let of = |budget| error(&*truth, &*made(&p, set, method, budget, &*truth));
            let [rough, fine] = [few, many].map(of);
            println!("{symmetry:?} {set} {method}: {rough:.4} {fine:.4}");
            // Sixteen times the readings halve the spacing at least.
            assert!(
                fine < rough / 1.4,
                "{symmetry:?} {set} {method}: {rough} {fine}"
            );
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
