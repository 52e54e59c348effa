//! Reference for rendered spheres: the light integrated over rings about the mirror direction, of
//! 1e-4 rad next to it, a sixth wider from ring to ring, up to 2.5° from where on they are equal.
//! No random number is drawn.

use super::light;
use crate::common::{material, near, present, product, table};
use glam::DVec3;
use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
use gonio::geometry::{Direction, DirectionPair};
use gonio::lighting::Lighting;
use gonio::parametrization::view_centered;
use gonio::report::SphereImage;
use gonio::report::pictures::render_sphere;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Mean of the differences over the mean of `want`, and their RMS over it.
fn errors(got: &SphereImage, want: &SphereImage) -> [f64; 2] {
    let both = got.pixels.iter().zip(&want.pixels).enumerate();
    let [mut n, mut mean, mut sum, mut squares] = [0.0; 4];
    for (i, (got_pixel, want)) in both {
        assert_eq!(got_pixel.is_some(), got.coverage(i) > 0.0);
        // The rings look at middles alone.
        let (Some(got), Some(want), 1.0) = (got_pixel, want, got.coverage(i)) else {
            continue;
        };
        for c in 0..3 {
            n += 1.0;
            mean += want[c];
            sum += got[c] - want[c];
            squares += (got[c] - want[c]).powi(2);
        }
    }
    [sum / mean, (squares / n).sqrt() / (mean / n)]
}

#[test]
fn a_diffuse_sphere_in_even_light_has_its_albedo() {
    let albedo = [0.2, 0.5, 0.8];
    let brdf = Lambert::new(Spectrum::Rgb(albedo), Channels::Rgb);
    let even = light("constant", "radiance = 2.0");
    let mut worst = Vec::new();
    for samples in [64, 1024] {
        let image = render_sphere(&brdf, &*even, 32, samples);
        let [mut n, mut sum, mut largest] = [0.0, 0.0, 0.0f64];
        for (pixel, c) in product(image.pixels.into_iter().flatten(), 0..3) {
            let relative = pixel[c] / (2.0 * albedo[c]);
            n += 1.0;
            sum += relative;
            largest = largest.max((relative - 1.0).abs());
        }
        assert!((sum / n - 1.0).abs() < 2e-3, "{}", sum / n);
        worst.push(largest);
    }
    assert!(worst[0] < 0.15 && worst[1] < 0.25 * worst[0], "{worst:?}");
}

#[test]
fn black_light_is_black_and_tiny_mirrors_are_mirrors() {
    let mirror = material("ggx", "alpha = 1e-6", Channels::Rgb);
    let black = render_sphere(&*mirror, &*light("constant", "radiance = 0.0"), 8, 4);
    assert!(black.pixels.into_iter().flatten().all(|p| p == [0.0; 3]));
    // What a mirror reflects of even light does not depend on its roughness.
    let even = light("constant", "");
    let rough = material("ggx", "alpha = 1e-3", Channels::Rgb);
    let [rough, fine] = [&rough, &mirror].map(|brdf| render_sphere(&**brdf, &*even, 16, 256));
    let [bias, rms] = errors(&fine, &rough);
    assert!(bias.abs() < 0.01 && rms < 0.05, "{bias} {rms}");
}

#[test]
fn the_edge_is_smooth() {
    for resolution in [1, 7, 64] {
        let all = resolution * resolution;
        let pixels = vec![None; all];
        let image = SphereImage { resolution, pixels };
        let area: f64 = (0..all).map(|i| image.coverage(i)).sum();
        let most = 0.04 / resolution as f64;
        near(area / all as f64, PI / 4.0, most, resolution);
    }
}

#[test]
fn threads_do_not_matter() {
    let brdf = material("ggx", "alpha = 0.2", Channels::Rgb);
    let sky = light("sky", "");
    let draw = || render_sphere(&*brdf, &*sky, 24, 8);
    let with = |threads| crate::common::on_threads(threads, draw);
    assert_eq!(with(1), with(3));
}

/// A sphere as [`render_sphere`] draws it, without noise.
fn sphere(brdf: &dyn Brdf, lighting: &dyn Lighting, resolution: usize) -> SphereImage {
    let centre = |i: usize| (2.0 * i as f64 + 1.0) / resolution as f64 - 1.0;
    let rings = rings();
    let pixel = |i| {
        let (x, y) = (centre(i % resolution), -centre(i / resolution));
        let z2 = 1.0 - x * x - y * y;
        (z2 > 0.0).then(|| shade(brdf, lighting, &rings, DVec3::new(x, y, z2.sqrt())))
    };
    let pixels = (0..resolution * resolution).into_par_iter();
    let pixels = pixels.map(pixel).collect();
    SphereImage { resolution, pixels }
}

/// Directions about +z with their solid angles.
fn rings() -> Vec<(DVec3, f64)> {
    const FIRST: f64 = 1e-4;
    let widest = 2.5f64.to_radians();
    let mut out = vec![(DVec3::Z, TAU * (1.0 - FIRST.cos()))];
    let mut inner = FIRST;
    while inner < PI {
        let outer = (inner + (inner / 6.0).min(widest)).min(PI);
        let gamma = 0.5 * (inner + outer);
        let width = outer - inner;
        let turns = ((TAU * gamma.sin() / width) as usize).clamp(8, 144);
        let part = TAU / turns as f64;
        // cos a − cos b without cancellation.
        let angle = part * 2.0 * gamma.sin() * (0.5 * width).sin();
        let (s, c) = gamma.sin_cos();
        out.extend((0..turns).map(|k| {
            let (sp, cp) = (part * (k as f64 + 0.5)).sin_cos();
            (DVec3::new(s * cp, s * sp, c), angle)
        }));
        inner = outer;
    }
    out
}

/// What the camera sees of a point with a normal in its frame: x right, y up, z towards it.
fn shade(
    brdf: &dyn Brdf,
    lighting: &dyn Lighting,
    rings: &[(DVec3, f64)],
    normal: DVec3,
) -> [f64; 3] {
    // What the direction to the camera has beside the normal.
    let tangent = (DVec3::Z - normal.z * normal).normalize();
    let across = normal.cross(tangent);
    let theta_o = normal.truncate().length().asin();
    let omega_o = view_centered(theta_o, 0.0);
    let (s, c) = theta_o.sin_cos();
    let mut sum = [0.0; 3];
    for (d, angle) in rings {
        // The rings' pole is turned to the mirror direction, in the plane of incidence.
        let d = DVec3::new(c * d.x - s * d.z, d.y, s * d.x + c * d.z);
        if d.z <= 0.0 {
            continue;
        }
        let values = present(brdf, &DirectionPair::new(Direction::from_unit(d), omega_o));
        // The pole of the light is up.
        let v = d.x * tangent + d.y * across + d.z * normal;
        let light = lighting.radiance(Direction::from_unit(DVec3::new(v.z, v.x, v.y)));
        for c in 0..3 {
            sum[c] += angle * d.z * values[c] * light[c];
        }
    }
    sum
}

#[test]
fn it_agrees_with_the_rings_and_noise_falls() {
    // Light that the rings resolve to better than what is asked for here.
    let place = "theta_deg = 50\nphi_deg = 30\nwidth_deg = 15";
    let light = light(
        "blob",
        &format!("{place}\npeak = [9.0, 7.0, 5.0]\nbackground = 0.3"),
    );
    for [kind, keys] in table(
        "lambert |
         ggx | alpha = 0.05
         ggx | alpha = 0.001
         ggx | alpha = [0.1, 0.4]",
    ) {
        let brdf = material(kind, keys, Channels::Rgb);
        let want = sphere(&*brdf, &*light, 20);
        let at = |samples| errors(&render_sphere(&*brdf, &*light, 20, samples), &want);
        let [few, some, many] = [16, 64, 1024].map(at);
        // Independent pixels: the mean of about 310 has a 17th of their noise, colours share
        // theirs; the rings have errors of their own, up to 0.5 %.
        for [bias, noise] in [few, some, many] {
            near(bias, 0.0, 4.0 * noise / 17.0 + 0.005, (kind, keys));
        }
        // At least 1/√n, which from 16 to 64 points is 1/2 and to 1024 is 1/8.
        let noise = [few, some, many].map(|[_, noise]| noise);
        assert!(noise[1] < 0.65 * noise[0], "{kind} {keys} {noise:?}");
        assert!(noise[2] < 0.2 * noise[0] + 0.01, "{kind} {keys} {noise:?}");
        assert!(noise[1] < 0.12, "{kind} {keys} {noise:?}");
    }
}
