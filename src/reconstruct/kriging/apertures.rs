//! Readings over finite apertures as readings in single directions.
//!
//! A reading is ⟨f cos θ_i⟩ / ⟨cos θ_i⟩, means over the directions of source and sensor of which each fills a cap. What such a
//! mean of the process is over its value there divides the reading; the process through the quotients gives the next ratios. That
//! is Richardson's and Lucy's iteration (Richardson 1972, Lucy 1974) with the smoothness of the kernel.

use super::Account;
use super::kernel::Kernel;
use super::process::Part;
use super::space::Space;
use super::system::Data;
use crate::geometry::{Direction, DirectionPair};
use crate::reconstruct::transform::EPSILON;
use glam::DVec3;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Iterations, at most: each follows what is finer, and noise.
const ITERATIONS: usize = 12;

/// Iterations end where no logarithm of a ratio moves by more.
const ENOUGH: f64 = 1e-3;

/// Largest logarithm of a ratio.
const LARGEST: f64 = 2.0;

/// Readings at a time.
const TASK: usize = 8;

/// Directions of a cap: its middle with weight 1/4, and six with 1/8 on a ring. For a flat disk that is exact to degree 5
/// (Abramowitz & Stegun 1964, 25.4.61).
const RING: usize = 6;

/// Directions of the cap of this half-angle (rad) about one, with their weights.
fn cap(middle: Direction, half_angle: f64) -> Vec<(f64, DVec3)> {
    let n = middle.vector();
    if half_angle == 0.0 {
        return vec![(1.0, n)];
    }
    let (t, b) = n.any_orthonormal_pair();
    let (sin, cos) = (half_angle * (2.0_f64 / 3.0).sqrt()).sin_cos();
    let ring = (0..RING).map(|k| {
        let (y, x) = (TAU * k as f64 / RING as f64).sin_cos();
        (0.125, n * cos + (t * x + b * y) * sin)
    });
    std::iter::once((0.25, n)).chain(ring).collect()
}

/// The logarithms of the ratios of means over these half-angles (rad) of source and sensor to values, a row per reading and a column
/// per value; and those that the process of these readings has at `further` pairs. `None` if covariances are singular.
pub(super) fn log_ratios(
    data: &Data,
    pairs: &[DirectionPair],
    further: &[DirectionPair],
    space: &Space,
    kernel: &Kernel,
    half_angles: [f64; 2],
) -> Option<[DMatrix<f64>; 2]> {
    let (n, width) = data.values.shape();
    let factor = data.ordinary(kernel).factor(data)?;
    let mut ratios = DMatrix::zeros(n, width);
    // Few readings are near a peak; the others are soon done.
    let mut open: Vec<usize> = (0..n).collect();
    let process = |ratios: &DMatrix<f64>| {
        let quotients = Data {
            values: &data.values - ratios,
            ..data.clone()
        };
        let solved = quotients.solve_by(kernel, &factor);
        Part::new(&Account::single(kernel.clone()), &data.sites, &solved)
    };
    for _ in 0..ITERATIONS {
        let process = process(&ratios);
        let some: Vec<DirectionPair> = open.iter().map(|&i| pairs[i]).collect();
        let next = of_process(&process, &some, space, width, half_angles);
        let mut moved = vec![0.0_f64; open.len()];
        for (k, &i) in open.iter().enumerate() {
            for c in 0..width {
                moved[k] = moved[k].max((next[(k, c)] - ratios[(i, c)]).abs());
                ratios[(i, c)] = next[(k, c)];
            }
        }
        let mut moved = moved.into_iter();
        open.retain(|_| moved.next().is_some_and(|by| by >= ENOUGH));
        if open.is_empty() {
            break;
        }
    }
    let of_further = match further.is_empty() {
        true => DMatrix::zeros(0, width),
        false => of_process(&process(&ratios), further, space, width, half_angles),
    };
    Some([ratios, of_further])
}

/// The logarithms of the ratios of one process.
fn of_process(
    process: &Part,
    pairs: &[DirectionPair],
    space: &Space,
    width: usize,
    [of_source, of_sensor]: [f64; 2],
) -> DMatrix<f64> {
    let mut logs = vec![0.0; pairs.len() * width];
    let tasks = pairs.par_iter().zip(logs.par_chunks_mut(width));
    tasks.with_min_len(TASK).for_each(|(pair, logs)| {
        let (lights, views) = (cap(pair.omega_i, of_source), cap(pair.omega_o, of_sensor));
        let mut near = vec![*pair];
        let mut weights = Vec::new();
        let mut all = 0.0;
        for (w_i, light) in &lights {
            for (w_o, view) in &views {
                let weight = w_i * w_o * light.z.max(0.0);
                all += weight;
                if light.z > 0.0 && view.z > 0.0 {
                    let [light, view] = [light, view].map(|v| Direction::from_unit(*v));
                    near.push(DirectionPair::new(light, view));
                    weights.push(weight);
                }
            }
        }
        let mut values = vec![0.0; near.len() * width];
        process.eval(&near, &space.columns(&near), &mut values);
        let f = |z: f64| (z.exp() - EPSILON).max(0.0);
        for (c, log) in logs.iter_mut().enumerate() {
            let mean = weights.iter().enumerate();
            let mean: f64 = mean.map(|(k, w)| w * f(values[(k + 1) * width + c])).sum();
            let ratio = (mean / all + EPSILON).ln() - values[c];
            *log = ratio.clamp(-LARGEST, LARGEST);
        }
    });
    DMatrix::from_row_slice(pairs.len(), width, &logs)
}
