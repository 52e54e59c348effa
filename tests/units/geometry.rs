use glam::DVec3;
use gonio::geometry::{Direction, angle_between};
use std::f64::consts::{FRAC_PI_2, PI};

#[test]
fn angles_survive_at_both_ends() {
    for e in 1..16 {
        let d = 10f64.powi(-e);
        for base in [0.0, FRAC_PI_2] {
            let a = Direction::from_spherical(base, 0.3);
            let b = Direction::from_spherical(base - d, 0.3);
            let got = angle_between(a.vector(), b.vector());
            assert!((got - d).abs() < 3e-16, "{base} {d} {got}");
        }
        let a = Direction::from_spherical(0.4, 0.0);
        let opposite = Direction::try_new(-a.vector()).unwrap();
        assert!((angle_between(a.vector(), opposite.vector()) - PI).abs() < 1e-15);
    }
}

#[test]
fn vectors_without_direction_are_refused() {
    assert!(Direction::try_new(DVec3::ZERO).is_none());
    assert!(Direction::try_new(DVec3::new(f64::NAN, 0.0, 1.0)).is_none());
    assert!(Direction::try_new(DVec3::new(f64::INFINITY, 0.0, 1.0)).is_none());
    let tiny = Direction::try_new(DVec3::new(3e-200, 0.0, 4e-200)).unwrap();
    assert!((tiny.cos_theta() - 0.8).abs() < 1e-15);
}

#[test]
fn the_normal_has_azimuth_zero() {
    for v in [DVec3::new(-0.0, 0.0, 1.0), DVec3::new(-0.0, -0.0, 1.0)] {
        assert_eq!(Direction::try_new(v).unwrap().phi(), 0.0);
    }
}
