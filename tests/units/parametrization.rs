use crate::common::product;
use gonio::geometry::angle_between;
use gonio::parametrization::{Warp, WarpSpec, view_centered, view_centered_angles, warps};
use gonio::registry;
use std::f64::consts::FRAC_PI_2;

#[test]
fn angles_come_back() {
    let steps = [-1.0, -1.0 + 1e-9, -0.5, -1e-9, 0.0, 1e-12, 0.3, 1.0 - 1e-12];
    for (theta, phi) in product(steps.map(|s| s * FRAC_PI_2), steps.map(|s| s * FRAC_PI_2)) {
        let there = view_centered(theta, phi);
        let [t, p] = view_centered_angles(there);
        let again = view_centered(t, p);
        let miss = angle_between(there.vector(), again.vector());
        assert!(miss < 3e-16, "{theta} {phi}: {miss}");
        assert!((p - phi).abs() < 3e-16, "{phi} {p}");
        // A ring of radius cos φ: its angles are that much less sure.
        assert!((t - theta).abs() * phi.cos() < 3e-16, "{theta} {t}");
    }
}

#[test]
fn the_element_of_solid_angle_is_cos_phi() {
    let step = 1e-5;
    for (theta, phi) in [(0.2, 0.9), (-1.3, 0.1), (0.0, -1.2)] {
        let along = |dt: f64, dp: f64| view_centered(theta + dt, phi + dp).vector();
        let by_theta = (along(step, 0.0) - along(-step, 0.0)) / (2.0 * step);
        let by_phi = (along(0.0, step) - along(0.0, -step)) / (2.0 * step);
        let element = by_theta.cross(by_phi).length();
        // Central differences: step² / 6.
        assert!((element - phi.cos()).abs() < 1e-10, "{element}");
    }
}

#[test]
fn the_power_of_a_half_is_the_square_root() {
    let max = 1.3;
    let root = Warp::Root { top: 1.0, max };
    let power = Warp::Power {
        exponent: 0.5,
        inverse: 2.0,
        max,
    };
    for i in -1000..=1000 {
        let t = f64::from(i) / 1000.0;
        // One rounding of the root and one of the power, each half an ulp of values up to 2.6.
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 5e-16 * a.abs(), "{t}: {a} {b}");
        close(root.forward(t * max), power.forward(t * max));
        close(root.inverse(t), power.inverse(t));
        close(root.slope(t), power.slope(t));
    }
}

#[test]
fn names_and_tables_come_back() {
    for entry in warps() {
        for example in entry.examples {
            let warp = *registry::read_text(&entry, example).unwrap();
            assert_eq!(warp.kind(), entry.kind);
            assert_eq!(WarpSpec::named(&warp.name()), Some(warp));
            let mut table = toml::Table::new();
            table.insert("w".into(), toml::Value::try_from(warp).unwrap());
            let again: toml::Table = toml::from_str(&table.to_string()).unwrap();
            assert_eq!(again["w"].clone().try_into::<WarpSpec>().unwrap(), warp);
        }
    }
    for name in " power power- power-0.50 power-2 power-nan asinh asinh-0 merl-1".split(' ') {
        assert_eq!(WarpSpec::named(name), None, "{name}");
    }
}
