//! Averages over both apertures: closed forms, brute force, and what they do to a lobe.

use crate::common::model;
use glam::DVec3;
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::geometry::{Direction, DirectionPair, Symmetry, angle_between};
use gonio::instrument::{Average, Optics, Tolerance, Workspace};
use gonio::sampling::{Sobol, gauss_legendre};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// A BRDF of one formula.
struct Formula<F>(F);

impl<F: Fn(&DirectionPair) -> f64 + Send + Sync> Brdf for Formula<F> {
    fn channels(&self) -> Channels {
        Channels::Luminance
    }
    fn symmetry(&self) -> Symmetry {
        Symmetry::NONE
    }
    fn conserves_energy(&self) -> bool {
        false
    }
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out[0] = if pair.is_above_horizon() {
            (self.0)(pair)
        } else {
            0.0
        };
        Presence::Present
    }
}

fn deg(x: f64) -> f64 {
    x.to_radians()
}

fn average(brdf: &dyn Brdf, pair: &DirectionPair, a: [f64; 2], relative: f64) -> Average {
    let tolerance = Tolerance {
        relative,
        max_evaluations: 4_000_000,
        ..Tolerance::default()
    };
    let optics = Optics::new(a[0], a[1], tolerance);
    let mut work = Workspace::default();
    optics.average(brdf, pair, &mut work).expect("a value")
}

/// A right-handed frame with the direction as its third vector.
fn frame(c: DVec3) -> [DVec3; 3] {
    let x = c.any_orthonormal_vector();
    [x, c.cross(x), c]
}

/// Directions of a cap at cos = 1 − u (1 − cos a), azimuth 2πv.
fn cap([x, y, z]: [DVec3; 3], a: f64, u: f64, v: f64) -> DVec3 {
    let drop = u * 2.0 * (0.5 * a).sin().powi(2);
    let sin = (drop * (2.0 - drop)).sqrt();
    let (s, c) = (TAU * v).sin_cos();
    (x * c + y * s) * sin + z * (1.0 - drop)
}

/// Polar products: n nodes of Gauss in the cosine and 2n even azimuths on either cap.
fn brute(brdf: &dyn Brdf, pair: &DirectionPair, a: [f64; 2], n: usize) -> f64 {
    let rule = gauss_legendre(n);
    let nodes = |c: Direction, a: f64| -> Vec<(DVec3, f64)> {
        let frame = frame(c.vector());
        let mut all = Vec::new();
        for (x, w) in &rule {
            for k in 0..2 * n {
                let v = (k as f64 + 0.37) / (2 * n) as f64;
                all.push((cap(frame, a, 0.5 * (1.0 + x), v), *w));
            }
        }
        all
    };
    let (light, sensor) = (nodes(pair.omega_i, a[0]), nodes(pair.omega_o, a[1]));
    let sums: Vec<[f64; 2]> = light
        .par_iter()
        .map(|(i, wi)| {
            let mut sums = [0.0; 2];
            if i.z <= 0.0 {
                return sums;
            }
            for (o, wo) in &sensor {
                if o.z <= 0.0 {
                    continue;
                }
                let pair = DirectionPair::new(Direction::from_unit(*i), Direction::from_unit(*o));
                let w = wi * wo * i.z;
                sums[0] += w * brdf.luminance(&pair).expect("a value");
                sums[1] += w;
            }
            sums
        })
        .collect();
    let total = |k: usize| sums.iter().map(|s| s[k]).sum::<f64>();
    total(0) / total(1)
}

fn mirror(theta: f64, off: f64, side: f64) -> DirectionPair {
    DirectionPair::from_spherical(theta, 0.0, theta + off, PI + side)
}

#[test]
fn explore() {
    let geometries = [
        ("mirror 0", mirror(0.0, 0.0, 0.0)),
        ("mirror 45", mirror(deg(45.0), 0.0, 0.0)),
        ("mirror 45 off", mirror(deg(45.0), deg(0.7), deg(0.5))),
        ("mirror 45 edge", mirror(deg(45.0), deg(2.1), deg(0.5))),
        ("near", mirror(deg(45.0), deg(4.0), deg(2.5))),
        ("mirror 80", mirror(deg(80.0), 0.0, 0.0)),
        ("mirror 80 off", mirror(deg(80.0), deg(0.7), deg(2.0))),
        (
            "retro 50",
            DirectionPair::from_spherical(deg(50.0), 0.0, deg(50.0), 0.0),
        ),
        (
            "far",
            DirectionPair::from_spherical(deg(50.0), 0.0, deg(10.0), 1.0),
        ),
        (
            "grazing",
            DirectionPair::from_spherical(deg(87.0), 0.0, deg(85.0), 2.5),
        ),
        ("cut", mirror(deg(89.3), 0.0, 0.0)),
    ];
    for alpha in [0.5, 0.1, 0.03, 0.01, 0.003, 0.001] {
        let brdf = model("ggx", &format!("alpha = {alpha}"));
        for (name, pair) in &geometries {
            for a in [
                [deg(1.0), deg(1.0)],
                [deg(0.3), deg(1.5)],
                [0.0, deg(1.0)],
                [deg(1.0), 0.0],
            ] {
                let n = if a[0] == 0.0 || a[1] == 0.0 { 60 } else { 24 };
                let truth = if alpha >= 0.01 {
                    brute(&*brdf, pair, a, n)
                } else {
                    f64::NAN
                };
                let mut line = format!("{alpha} {name} {:.1?}", a.map(f64::to_degrees));
                let best = average(&*brdf, pair, a, 1e-7);
                for tol in [1e-2, 1e-4, 1e-6] {
                    let t = std::time::Instant::now();
                    let got = average(&*brdf, pair, a, tol);
                    let us = t.elapsed().as_micros();
                    let v = best.value[0];
                    line += &format!(
                        " | {tol:.0e}: n {} true {:.1e} stated {:.1e} {us}us",
                        got.evaluations,
                        (got.value[0] - v).abs() / v,
                        got.error[0] / v
                    );
                }
                println!(
                    "{line} | brute {:.1e} st {:.1e}",
                    (best.value[0] - truth).abs() / truth,
                    best.error[0] / best.value[0]
                );
            }
        }
    }
}
