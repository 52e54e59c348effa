use super::*;
use crate::geometry::distance;
use crate::instrument::{InstrumentSpec, Machine, presets, read};
use crate::parametrization::{Form, HalfDifference, Parametrization};
use crate::sampling::Random;
use std::f64::consts::{FRAC_PI_2, PI};

/// Specifications of the presets that take pictures, and the sphere before a near camera and a near lamp.
fn specs() -> Vec<InstrumentSpec> {
    let all = presets().into_iter().map(|p| read(p.text).unwrap());
    let mut specs: Vec<InstrumentSpec> = all.filter(|s| s.picture.is_some()).collect();
    assert_eq!(specs.len(), 2);
    let mut near = specs[0].clone();
    let picture = near.picture.as_mut().unwrap();
    (picture.camera_radii, picture.lamp_radii) = (10.0, 25.0);
    specs.push(near);
    specs
}

/// Random pairs of a seed that a machine can take, with where it stands there.
fn placed(machine: &Machine, seed: u64) -> Vec<(DirectionPair, Lab)> {
    let random = Random::new(seed);
    let form = Form::<HalfDifference>::new(Symmetry::FULL);
    let pairs = (0..200).filter_map(|i| {
        let [a, b, c]: [f64; 3] = random.point(i);
        form.inverse(&[FRAC_PI_2 * a * a, FRAC_PI_2 * b, PI * c, 0.0])
    });
    let place = |pair: DirectionPair| {
        let positions = machine.place(&pair, true).ok()?;
        Some((pair, machine.lab(&positions)))
    };
    let placed: Vec<_> = pairs.filter_map(place).collect();
    assert!(placed.len() > 40, "{}", placed.len());
    placed
}

#[test]
fn a_pixel_reads_the_pair_that_rays_meet_there() {
    for spec in specs() {
        let (camera, machine) = (Camera::new(&spec).unwrap(), Machine::new(&spec).unwrap());
        for (asked, lab) in placed(&machine, 1) {
            let pair = camera.pair(&lab, camera.pixel(&lab), [0.0; 2]).unwrap();
            // Rays by themselves: from the point of the unit sphere that has the normal to where camera and lamp stand.
            let n = lab.sample.z_axis;
            let to = |far: DVec3, radii: f64| match radii > 0.0 {
                true => far * radii - n,
                false => far,
            };
            let picture = spec.picture.as_ref().unwrap();
            let view = to(lab.sensor, picture.camera_radii);
            let light = to(lab.light, picture.lamp_radii);
            let angles = [
                (pair.omega_i.theta(), light.angle_between(n)),
                (pair.omega_o.theta(), view.angle_between(n)),
                (pair.separation(), light.angle_between(view)),
            ];
            for (found, right) in angles {
                assert!(
                    (found - right).abs() < 1e-7,
                    "{}: {found} {right}",
                    spec.name
                );
            }
            if !camera.is_near() {
                assert!(
                    distance(&pair, &asked, Symmetry::FULL) < 1e-7,
                    "{}",
                    spec.name
                );
            }
        }
    }
}

#[test]
fn normals_of_a_sphere_are_those_of_half_and_difference_angles() {
    let [sphere, ..] = &specs()[..] else { panic!() };
    let machine = Machine::new(sphere).unwrap();
    let form = Form::<HalfDifference>::new(Symmetry::FULL);
    for (pair, lab) in placed(&machine, 2) {
        let [theta_h, theta_d, phi_d, _] = form.forward(&pair);
        let h = DVec3::new(theta_d.sin(), 0.0, theta_d.cos());
        let e = DVec3::new(theta_d.cos(), 0.0, -theta_d.sin());
        let azimuth = phi_d.cos() * e + phi_d.sin() * DVec3::Y;
        let n = theta_h.cos() * h - theta_h.sin() * azimuth;
        // Up to the mirror image and the exchange of light and view.
        let [right, found] = [n, lab.sample.z_axis].map(|n| {
            let local = DVec3::new(n.dot(h), n.dot(e).abs(), n.y.abs());
            assert!(lab.sensor.distance(DVec3::Z) < 1e-12);
            local
        });
        assert!(right.distance(found) < 1e-7, "{right} {found}");
        // It is lit and seen.
        assert!(theta_h.tan() * theta_d.tan() * phi_d.cos().abs() < 1.0 + 1e-9);
    }
}

/// Pixels of a picture of the sphere at an angle between light and view, whose half vectors are within `t` of the normal.
fn pixels_within(camera: &Camera, machine: &Machine, theta_d: f64, t: f64) -> usize {
    let lab = machine.lab(&[2.0 * theta_d, 0.0, 0.0, 0.0]);
    let radius = camera.spec.radius_px as i32;
    let row = |y: i32| (-radius..radius).map(move |x| DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    let near = |at: &DVec2| {
        let pair = camera.pair(&lab, *at, [0.0; 2]);
        pair.is_some_and(|pair| pair.half().normalize().z > t.cos())
    };
    (-radius..radius).flat_map(row).filter(near).count()
}

#[test]
fn a_picture_has_as_many_pixels_near_the_mirror_direction_as_the_disk_there() {
    let [sphere, ..] = &specs()[..] else { panic!() };
    let (camera, machine) = (Camera::new(sphere).unwrap(), Machine::new(sphere).unwrap());
    for (theta_d, t) in [(10.0_f64, 20.0_f64), (30.0, 10.0), (60.0, 25.0)] {
        let (theta_d, t) = (theta_d.to_radians(), t.to_radians());
        let count = pixels_within(&camera, &machine, theta_d, t) as f64;
        let right = PI * (camera.spec.radius_px * t.sin()).powi(2) * theta_d.cos();
        // The edge of the disk cuts pixels.
        assert!((count / right - 1.0).abs() < 5e-3, "{count} {right}");
    }
}

#[test]
fn an_error_of_the_centre_turns_the_normal_by_a_pixel_over_the_cosine() {
    for spec in &specs()[..2] {
        let (camera, machine) = (Camera::new(spec).unwrap(), Machine::new(spec).unwrap());
        for (_, lab) in placed(&machine, 3) {
            let at = camera.pixel(&lab);
            let (by, radius) = (1e-4, camera.spec.radius_px);
            let outwards = at.normalize();
            let [a, b] = [1.0, -1.0].map(|s| camera.pair(&lab, at + s * by * outwards, [0.0; 2]));
            let (Some(a), Some(b)) = (a, b) else { continue };
            let turned = (a.omega_o.theta() - b.omega_o.theta()).abs() / (2.0 * by);
            let theta_o = lab.sensor.angle_between(lab.sample.z_axis);
            let right = match camera.is_sphere {
                true => 1.0 / (radius * theta_o.cos()),
                false => 2.0 * (0.5 * theta_o).cos().powi(2) / radius,
            };
            assert!(
                (turned / right - 1.0).abs() < 1e-4,
                "{}: {turned} {right}",
                spec.name
            );
        }
    }
}

#[test]
fn images_of_a_place_read_the_same_material() {
    for spec in specs() {
        let (camera, machine) = (Camera::new(&spec).unwrap(), Machine::new(&spec).unwrap());
        let mut most = 0;
        for (_, lab) in placed(&machine, 4) {
            let at = camera.pixel(&lab);
            let pair = camera.pair(&lab, at, [0.0; 2]).unwrap();
            let images = camera.images(&lab, at, Symmetry::FULL);
            assert_eq!(images[0], at);
            most = most.max(images.len());
            for &image in &images {
                let other = camera.pair(&lab, image, [0.0; 2]).unwrap();
                let off = distance(&pair, &other, Symmetry::FULL);
                assert!(off < 1e-7, "{}: {at} {image}: {off}", spec.name);
            }
            assert_eq!(camera.images(&lab, at, Symmetry::NONE).len(), 1);
        }
        // Both mirror images on a far sphere, one where light and view cannot change places.
        assert_eq!(
            most,
            if camera.is_sphere && !camera.is_near() {
                4
            } else {
                2
            }
        );
    }
}
