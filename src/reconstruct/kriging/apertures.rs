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

/// Largest difference of ln f between the middle of a cap and a point of the coarse rule up to which that rule is taken as it is. Of an
/// exponential course it leaves out terms of the fourth order, 2e-4 there, and the product of what both caps add.
const FLAT: f64 = 0.3;

/// A rule for the disk: a ring at a radius over that of the disk, and a middle.
struct Rule {
    points: usize,
    radius: f64,
    middle: f64,
}

/// Exact to degree 5 (Abramowitz & Stegun 1964, 25.4.61): the middle with weight 1/4 and six with 1/8 at √(2/3).
const FINE: Rule = Rule {
    points: 6,
    radius: 0.816_496_580_927_726,
    middle: 0.25,
};

/// Exact to degree 2: three at √(1/2).
const COARSE: Rule = Rule {
    points: 3,
    radius: std::f64::consts::FRAC_1_SQRT_2,
    middle: 0.0,
};

impl Rule {
    /// Directions of the cap of this half-angle (rad) about one, with their weights.
    fn cap(&self, middle: Direction, half_angle: f64) -> Vec<(f64, DVec3)> {
        let n = middle.vector();
        if half_angle == 0.0 {
            return vec![(1.0, n)];
        }
        let (t, b) = n.any_orthonormal_pair();
        let (sin, cos) = (half_angle * self.radius).sin_cos();
        let weight = (1.0 - self.middle) / self.points as f64;
        let ring = (0..self.points).map(|k| {
            let (y, x) = (TAU * k as f64 / self.points as f64).sin_cos();
            (weight, n * cos + (t * x + b * y) * sin)
        });
        let middle = (self.middle > 0.0).then_some((self.middle, n));
        middle.into_iter().chain(ring).collect()
    }
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
    for round in 0..ITERATIONS {
        let process = process(&ratios);
        if round == 0 {
            let coarse = of_process(&process, pairs, space, (width, Means::Coarse), half_angles);
            open.retain(|&i| is_open(&coarse, i));
            ratios = coarse;
            open.iter().for_each(|&i| ratios.row_mut(i).fill(0.0));
        }
        let some: Vec<DirectionPair> = open.iter().map(|&i| pairs[i]).collect();
        let next = of_process(&process, &some, space, (width, Means::Fine), half_angles);
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
        false => {
            let process = process(&ratios);
            let mut all = of_process(
                &process,
                further,
                space,
                (width, Means::Coarse),
                half_angles,
            );
            let large = (0..further.len()).filter(|&i| is_open(&all, i));
            let large: Vec<usize> = large.collect();
            let some: Vec<DirectionPair> = large.iter().map(|&i| further[i]).collect();
            let fine = of_process(&process, &some, space, (width, Means::Fine), half_angles);
            for (k, &i) in large.iter().enumerate() {
                all.set_row(i, &fine.row(k));
            }
            all
        }
    };
    Some([ratios, of_further])
}

/// True of a reading that the coarse rule does not do for.
fn is_open(coarse: &DMatrix<f64>, row: usize) -> bool {
    coarse.row(row).iter().any(|ratio| ratio.is_nan())
}

/// How means over both caps are made.
#[derive(Clone, Copy)]
enum Means {
    /// Over each cap by itself, with the other direction in its middle: what either adds. NaN where ln f is not flat enough.
    Coarse,
    /// Over all pairs of both.
    Fine,
}

/// The logarithms of the ratios of one process.
fn of_process(
    process: &Part,
    pairs: &[DirectionPair],
    space: &Space,
    (width, means): (usize, Means),
    [of_source, of_sensor]: [f64; 2],
) -> DMatrix<f64> {
    let mut logs = vec![0.0; pairs.len() * width];
    let tasks = pairs.par_iter().zip(logs.par_chunks_mut(width));
    tasks.with_min_len(TASK).for_each(|(pair, logs)| {
        // Pairs with their weights, and those of their cosines: of the coarse rule what either cap adds, less the middle.
        let (mut near, mut weights, mut all) = (vec![*pair], Vec::new(), 0.0);
        let mut add = |lights: &[(f64, DVec3)], views: &[(f64, DVec3)]| {
            for (w_i, light) in lights {
                for (w_o, view) in views {
                    let weight = w_i * w_o * light.z.max(0.0);
                    all += weight;
                    if light.z > 0.0 && view.z > 0.0 {
                        let [light, view] = [light, view].map(|v| Direction::from_unit(*v));
                        near.push(DirectionPair::new(light, view));
                        weights.push(weight);
                    }
                }
            }
        };
        let caps = |rule: &Rule| {
            let lights = rule.cap(pair.omega_i, of_source);
            (lights, rule.cap(pair.omega_o, of_sensor))
        };
        let mut of_middle = 0.0;
        match means {
            Means::Fine => {
                let (lights, views) = caps(&FINE);
                add(&lights, &views);
            }
            Means::Coarse => {
                let (lights, views) = caps(&COARSE);
                let [light, view] = [pair.omega_i, pair.omega_o].map(|d| [(1.0, d.vector())]);
                add(&lights, &view);
                add(&light, &views);
                of_middle = pair.omega_i.cos_theta();
            }
        }
        let mut values = vec![0.0; near.len() * width];
        process.eval(&near, &space.columns(&near), &mut values);
        let f = |z: f64| (z.exp() - EPSILON).max(0.0);
        for (c, log) in logs.iter_mut().enumerate() {
            let mean = weights.iter().enumerate();
            let mean: f64 = mean.map(|(k, w)| w * f(values[(k + 1) * width + c])).sum();
            let mean = (mean - of_middle * f(values[c])) / (all - of_middle);
            let steep = |k: usize| (values[(k + 1) * width + c] - values[c]).abs() > FLAT;
            *log = match means {
                Means::Coarse if (0..weights.len()).any(steep) => f64::NAN,
                _ => ((mean + EPSILON).ln() - values[c]).clamp(-LARGEST, LARGEST),
            };
        }
    });
    DMatrix::from_row_slice(pairs.len(), width, &logs)
}
