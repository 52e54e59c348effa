//! Laws of charts, tables and samplers.

use super::chart::{Axes, RadialWarp, View};
use super::table::{CellTable, InCells, Mixture};
use super::{SamplerSettings, TabulatedSampler};
use crate::brdf::microfacet::{FresnelSpec, Ggx, Microfacet};
use crate::brdf::{Brdf, Channels, Presence, Roughness};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::sampling::Random;
use glam::DVec3;
use smallvec::smallvec;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Every chart with every warp.
fn charts() -> Vec<Axes> {
    let all = Axes::all();
    let fourth = all.iter().filter(|axes| axes.warp == RadialWarp::Plain);
    let fourth: Vec<_> = fourth
        .map(|axes| Axes {
            warp: RadialWarp::FourthRoot,
            ..*axes
        })
        .collect();
    all.into_iter().chain(fourth).collect()
}

/// A lobe beside the mirror direction, which no mirror and no exchange leaves unchanged.
struct Skewed;

impl Brdf for Skewed {
    fn channels(&self) -> &Channels {
        &Channels::Luminance
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry {
            isotropic: true,
            ..Symmetry::NONE
        }
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let [i, o] = pair.vectors();
        let beside = DVec3::new(-0.8 * o.x - 0.3 * o.y, -0.8 * o.y + 0.3 * o.x, o.z);
        let lobe = (-4.0 * (i - beside).length_squared()).exp();
        out[0] = if pair.is_above_horizon() {
            lobe + 0.05
        } else {
            0.0
        };
        Presence::Present
    }
}

fn ggx(alpha: Roughness) -> Box<dyn Brdf> {
    Box::new(Microfacet::<Ggx>::new(
        alpha,
        &FresnelSpec::default(),
        Channels::Luminance,
    ))
}

#[test]
fn places_return_and_jacobians_are_those_of_differences() {
    let random = Random::new(3);
    for axes in charts() {
        for (n, theta) in [0.0_f64, 20.0, 60.0, 85.0, 89.9].into_iter().enumerate() {
            let view = View::new(Direction::from_spherical(
                theta.to_radians(),
                0.7 * n as f64,
            ));
            for i in 0..200 {
                let [x, v]: [f64; 2] = random.point(i);
                let [x, v] = [0.01 + 0.98 * x, 0.01 + 0.98 * v];
                let Some(place) = axes.place(&view, [x, v]) else {
                    assert!(!axes.to_horizon, "{} {theta} {x} {v}", axes.name());
                    continue;
                };
                // Where a step reaches over the horizon, or Jacobians that diverge there bend, differences are none.
                if place.omega_i.cos_theta() < 0.03 {
                    continue;
                }
                let ([y, w], jacobian) = axes.at(&view, place.omega_i);
                // A half vector of grazing directions is a small sum.
                let off = (x - y).abs().max((v - w).abs()) * view.theta().cos();
                assert!(
                    off < 1e-7,
                    "{} {theta}: {x} {v} became {y} {w}",
                    axes.name()
                );
                assert!(
                    (jacobian / place.jacobian - 1.0).abs() * view.theta().cos() < 1e-6,
                    "{} {theta}",
                    axes.name()
                );
                let step = 1e-5;
                let omega = |x: f64, v: f64| Some(axes.place(&view, [x, v])?.omega_i.vector());
                let ends = [
                    [omega(x - step, v), omega(x + step, v)],
                    [omega(x, v - step), omega(x, v + step)],
                ];
                let along = ends.map(|[a, b]| Some((b? - a?) / (2.0 * step)));
                let [Some(a), Some(b)] = along else { continue };
                let area = a.cross(b).length();
                let off = (area / place.jacobian - 1.0).abs() * view.theta().cos();
                assert!(
                    off < 2e-4,
                    "{} {theta} {x} {v}: {area} {}",
                    axes.name(),
                    place.jacobian
                );
            }
        }
    }
}

#[test]
fn points_of_a_table_follow_its_density() {
    for in_cells in InCells::ALL {
        for closes in [true, false] {
            let tables = [0, 11].map(|first| {
                let weights = (first..first + 5 * 6)
                    .map(|i| f64::from(i * 7 % 5))
                    .collect();
                CellTable::new(6, weights, in_cells, closes)
            });
            let table = Mixture(smallvec![(&tables[0], 0.3), (&tables[1], 0.7)]);
            // Parts of cells: the density is a polynomial in each, of degree 1 along either axis.
            let parts = [10, 12];
            let expected = |k: usize| {
                let at = [k / parts[1], k % parts[1]];
                table.pdf([0, 1].map(|d| (at[d] as f64 + 0.5) / parts[d] as f64)) / 120.0
            };
            let expected: Vec<f64> = (0..120).map(expected).collect();
            assert!((expected.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let mut counts = vec![0.0; 120];
            let (random, n) = (Random::new(9), 60_000);
            for i in 0..n {
                let point = table.sample(random.point(i));
                let [row, column] = [0, 1].map(|d| (point[d] * parts[d] as f64) as usize);
                counts[row * parts[1] + column] += 1.0;
            }
            let p = goodness(&counts, &expected, n as f64);
            assert!(p > 1e-4, "{in_cells:?} {closes}: {p}");
        }
    }
}

/// Probability of a χ² statistic at least as large, bins with few expected counts pooled.
fn goodness(counts: &[f64], expected: &[f64], n: f64) -> f64 {
    let (mut statistic, mut bins, mut pool) = (0.0, 0, [0.0; 2]);
    let mut add = |count: f64, expected: f64| {
        statistic += (count - expected).powi(2) / expected;
        bins += 1;
    };
    for (count, share) in counts.iter().zip(expected) {
        match n * share {
            few if few < 8.0 => pool = [pool[0] + count, pool[1] + few],
            expected => add(*count, expected),
        }
    }
    if pool[1] >= 8.0 {
        add(pool[0], pool[1]);
    } else {
        assert!(pool[0] < 30.0, "{} where {} are expected", pool[0], pool[1]);
    }
    ChiSquared::new(f64::from(bins - 1)).unwrap().sf(statistic)
}

/// Draws in bins of cos θ_i and φ_i against integrals of the density, whose solid angles are those of differences of the chart:
/// they share no Jacobian with it.
#[test]
fn draws_follow_the_density_and_it_integrates_to_one() {
    const BINS: [usize; 2] = [6, 12];
    const CELLS: [usize; 2] = [12, 16];
    const GRID: [usize; 2] = [240, 480];
    let brdfs: [Box<dyn Brdf>; 3] = [
        ggx(Roughness::Isotropic(0.3)),
        Box::new(Skewed),
        ggx(Roughness::Anisotropic([0.15, 0.5])),
    ];
    let bin = |omega_i: Direction| {
        let z = (omega_i.cos_theta() * BINS[0] as f64) as usize;
        let turn = (omega_i.phi() / TAU).rem_euclid(1.0);
        let around = (turn * BINS[1] as f64) as usize;
        z.min(BINS[0] - 1) * BINS[1] + around.min(BINS[1] - 1)
    };
    let mut worst = 1.0_f64;
    let mut tests = 0_u64;
    let ended = charts().into_iter().filter(|axes| axes.to_horizon);
    for (n, axes) in ended.enumerate() {
        let settings = SamplerSettings {
            axes,
            in_cells: InCells::ALL[n % 2],
            cells: CELLS,
            views: 6,
            azimuths: 8,
            cosine: 0.05,
        };
        let brdf = &brdfs[n % 3];
        let sampler = TabulatedSampler::new(&**brdf, settings).unwrap();
        for theta in [0.0_f64, 35.0, 70.0, 85.0] {
            let omega_o = Direction::from_spherical(theta.to_radians(), 7.0 * TAU / 96.0);
            let (view, density) = (View::new(omega_o), sampler.given(omega_o));
            let mut expected = vec![0.0; BINS[0] * BINS[1]];
            let parts = Random::new(1000 + tests);
            for i in 0..GRID[0] {
                for k in 0..GRID[1] {
                    // Rows are fine at the edges of cells, so at pole and horizon.
                    let at = |dx: f64, dv: f64| {
                        let share = |i: usize, d: f64, n: usize| (i as f64 + 0.5 + d) / n as f64;
                        let x = share(i, dx, GRID[0]) * CELLS[0] as f64;
                        let v = share(k, dv, GRID[1]);
                        let (cell, s) = (x.floor(), x.fract());
                        let x = (cell + s * s * (3.0 - 2.0 * s)) / CELLS[0] as f64;
                        [x.clamp(1e-12, 1.0 - 1e-12), v]
                    };
                    let corner =
                        |dx: f64, dv: f64| Some(axes.place(&view, at(dx, dv))?.omega_i.vector());
                    let diagonal = |dv: f64| Some(corner(0.5, dv)? - corner(-0.5, -dv)?);
                    let (Some(omega_i), Some(a), Some(b)) = (
                        axes.place(&view, at(0.0, 0.0)),
                        diagonal(0.5),
                        diagonal(-0.5),
                    ) else {
                        continue;
                    };
                    let mass = density.pdf(omega_i.omega_i) * 0.5 * a.cross(b).length();
                    // A part belongs to the bin of a random point of it: on average edges are cut where they are.
                    let [s, t]: [f64; 2] = parts.point((i * GRID[1] + k) as u64);
                    if let Some(within) = axes.place(&view, at(s - 0.5, t - 0.5)) {
                        expected[bin(within.omega_i)] += mass;
                    }
                }
            }
            let all: f64 = expected.iter().sum();
            let mut counts = vec![0.0; expected.len()];
            let (random, n) = (Random::new(tests), 20_000);
            let (mut above, mut others) = (0.0, 0);
            for i in 0..n {
                if let Some((omega_i, pdf)) = density.draw(random.point(i)) {
                    counts[bin(omega_i)] += 1.0;
                    above += 1.0;
                    let again = density.pdf(omega_i);
                    others += usize::from((pdf / again - 1.0).abs() > 1e-4);
                }
            }
            let name = format!("{} {:?} {theta}", axes.name(), settings.in_cells);
            // At an edge of a cell rounding may choose the other one.
            assert!(others < 3, "{name}: {others}");
            assert_eq!(above, n as f64, "{name}");
            assert!((all - 1.0).abs() < 5e-3, "{name}: {all}");
            expected.iter_mut().for_each(|e| *e /= all);
            let p = goodness(&counts, &expected, n as f64);
            println!("{name}: {all:.4} {p:.4}");
            worst = worst.min(p);
            tests += 1;
        }
    }
    assert!(worst * tests as f64 > 1e-3, "{worst} of {tests}");
}
