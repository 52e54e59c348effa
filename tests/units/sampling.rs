#[cfg(feature = "experiments")]
mod hemisphere {
    use crate::common::chi_squared::goodness;
    use crate::common::near;
    use gonio::geometry::Direction;
    use gonio::sampling::{
        Random, cosine_hemisphere, cosine_hemisphere_pdf, gauss_legendre, ggx_half_vector,
        ggx_half_vector_pdf,
    };
    use std::f64::consts::TAU;

    /// ∫ pdf sin θ dθ dφ over an annulus, in the logarithm of θ.
    fn integral(pdf: &dyn Fn(Direction) -> f64, lo: f64, hi: f64) -> f64 {
        let half = 0.5 * (hi / lo).ln();
        let node = |(x, weight): (f64, f64)| {
            let theta = lo * (half * (1.0 + x)).exp();
            let density = pdf(Direction::from_spherical(theta, 0.7));
            weight * half * theta * density * theta.sin() * TAU
        };
        gauss_legendre(40).into_iter().map(node).sum()
    }

    /// Compares a warp, whose peak is `width` rad wide, with its density.
    fn check(warp: impl Fn([f64; 2]) -> Direction, pdf: &dyn Fn(Direction) -> f64, width: f64) {
        // Annuli whose edges double, from well inside the peak to the horizon.
        let mut edges = vec![1e-6 * width];
        let doubling = (0..).map(|i| 0.1 * width * 1.3_f64.powi(i));
        edges.extend(doubling.take_while(|e| *e < 1.5));
        edges.push(std::f64::consts::FRAC_PI_2);
        let shares = edges.windows(2).map(|w| integral(pdf, w[0], w[1]));
        let shares: Vec<f64> = shares.collect();
        near(shares.iter().sum(), 1.0, 1e-9, width);

        // 16 sectors of every annulus that expects enough draws; the rest of it all is one bin.
        const SECTORS: usize = 16;
        let n = 200_000;
        let random = Random::new(4);
        let mut observed = vec![0_u64; shares.len() * SECTORS];
        for i in 0..n {
            let omega = warp(random.point(i));
            assert!((omega.vector().length() - 1.0).abs() < 4e-16);
            let ring = edges[1..edges.len() - 1].partition_point(|e| *e <= omega.theta());
            let turn = (omega.phi() / TAU).rem_euclid(1.0);
            observed[ring * SECTORS + (turn * SECTORS as f64) as usize % SECTORS] += 1;
        }
        let expected = |bin: usize| shares[bin / SECTORS] * n as f64 / SECTORS as f64;
        let (mut counts, mut wanted) = (vec![0], vec![0.0]);
        for (bin, count) in observed.into_iter().enumerate() {
            if expected(bin) >= 5.0 {
                counts.push(0);
                wanted.push(0.0);
            }
            let is_own = expected(bin) >= 5.0;
            let own = if is_own { counts.len() - 1 } else { 0 };
            counts[own] += count;
            wanted[own] += expected(bin);
        }
        if wanted[0] < 5.0 {
            counts.remove(0);
            wanted.remove(0);
        }
        let p = goodness(&counts, &wanted);
        assert!(p > 1e-3, "{width}: p = {p}, {} bins", counts.len());
    }

    #[test]
    fn samples_follow_their_densities() {
        check(cosine_hemisphere, &cosine_hemisphere_pdf, 1.0);
        for alpha in [1.0, 0.3, 0.01, 1e-4] {
            let pdf = |h| ggx_half_vector_pdf(alpha, h);
            check(|u| ggx_half_vector(alpha, u), &pdf, alpha);
        }
    }

    #[test]
    fn the_ends_of_the_square_are_the_pole_and_the_horizon() {
        let last = 1.0 - f64::EPSILON / 2.0;
        for u1 in [0.0, 0.5, last] {
            assert_eq!(cosine_hemisphere([0.0, u1]).cos_theta(), 1.0);
            assert_eq!(cosine_hemisphere([0.0, u1]).sin_theta(), 0.0);
            // Still above the horizon, by the square root of the last step.
            let grazing = cosine_hemisphere([last, u1]).cos_theta();
            near(grazing / 1.053_671_212_772_351e-8, 1.0, 1e-12, u1);
            for alpha in [1.0, 0.01, 1e-6] {
                assert_eq!(ggx_half_vector(alpha, [0.0, u1]).cos_theta(), 1.0);
                let h = ggx_half_vector(alpha, [last, u1]);
                assert!(h.cos_theta() > 0.0 && (h.vector().length() - 1.0).abs() < 4e-16);
            }
        }
        let below = Direction::from_spherical(2.0, 0.3);
        assert_eq!(cosine_hemisphere_pdf(below), 0.0);
        assert_eq!(ggx_half_vector_pdf(0.1, below), 0.0);
    }
}

#[cfg(feature = "experiments")]
mod points {
    use crate::common::chi_squared::{equal_bins, uniformity};
    use crate::common::product;
    use gonio::sampling::{Random, Sobol};

    #[test]
    fn every_block_is_stratified() {
        // (0, m, 2)-net: every dyadic rectangle of area 2^-m holds one of 2^m consecutive points.
        let mut sobol = Sobol::new(3);
        let shapes = [4, 10].map(|m| (0..=m).map(move |x_bits| (m, x_bits)));
        for (block, (m, x_bits)) in product([0, 1, 15], shapes.into_iter().flatten()) {
            let (nx, ny) = (1_u64 << x_bits, 1_u64 << (m - x_bits));
            let mut seen = vec![false; 1 << m];
            for i in 0..1 << m {
                let [x, y] = sobol.point(block * Sobol::BLOCK + i);
                let cell = (x * nx as f64) as u64 * ny + (y * ny as f64) as u64;
                assert!(!std::mem::replace(&mut seen[cell as usize], true));
            }
        }
        // Every single dimension of a whole block, one point in each of 65 536 intervals.
        for d in 0..8 {
            let mut seen = vec![false; 1 << 16];
            for i in 0..Sobol::BLOCK {
                let x = sobol.point::<8>(Sobol::BLOCK + i)[d];
                let cell = (x * 65_536.0) as usize;
                assert!(!std::mem::replace(&mut seen[cell], true), "{d} {cell}");
            }
        }
    }

    #[test]
    fn blocks_and_seeds_are_unrelated() {
        // Correlation of 65 536 independent pairs of points: standard error 0.004.
        let mut sobol = [Sobol::new(0), Sobol::new(1)];
        let [mut of_blocks, mut of_seeds] = [0.0, 0.0];
        for i in 0..Sobol::BLOCK {
            let [a] = sobol[0].point(i);
            let [b] = sobol[0].point(i + Sobol::BLOCK);
            let [c] = sobol[1].point(i);
            of_blocks += 12.0 * (a - 0.5) * (b - 0.5);
            of_seeds += 12.0 * (a - 0.5) * (c - 0.5);
        }
        let n = Sobol::BLOCK as f64;
        assert!((of_blocks / n).abs() < 0.02, "{}", of_blocks / n);
        assert!((of_seeds / n).abs() < 0.02, "{}", of_seeds / n);
    }

    #[test]
    fn a_point_depends_on_its_index_only() {
        let random = Random::new(5);
        let mut sobol = Sobol::new(5);
        // Two blocks of Sobol points, so that going back changes the cached seed.
        let indices: Vec<u64> = (65_000..66_000).chain([0, u64::MAX]).collect();
        let mut points = |i: u64| (random.point::<3>(i), sobol.point::<3>(i));
        let forwards: Vec<_> = indices.iter().map(|&i| points(i)).collect();
        for (&i, point) in indices.iter().zip(&forwards).rev() {
            assert_eq!(points(i), *point);
            assert_eq!(Random::new(5).point(i), point.0);
            assert_ne!(Random::new(6).point(i), point.0);
        }
    }

    #[test]
    fn more_dimensions_extend_a_point() {
        let random = Random::new(9);
        let mut sobol = Sobol::new(9);
        for i in [0, 1, 1000, 65_535, 65_536, 1 << 40] {
            let eight: [f64; 8] = sobol.point(i);
            assert_eq!(sobol.point::<1>(i), eight[..1]);
            assert_eq!(sobol.point::<4>(i), eight[..4]);
            assert_eq!(sobol.point::<5>(i), eight[..5]);
            assert_eq!(sobol.point::<7>(i), eight[..7]);
            // Beyond the first 16 words the generator moves on to its next block.
            let long: [f64; 40] = random.point(i);
            assert_eq!(random.point::<4>(i)[..], long[..4]);
            assert_eq!(random.point::<9>(i)[..], long[..9]);
        }
    }

    #[test]
    fn coordinates_are_inside_the_unit_interval() {
        let random = Random::new(1);
        let mut sobol = Sobol::new(1);
        for i in 0..100_000 {
            assert!(random.point::<2>(i).iter().all(|x| (0.0..1.0).contains(x)));
            let inside = |x: &f64| *x > 0.0 && *x < 1.0;
            assert!(sobol.point::<8>(i).iter().all(inside));
        }
    }

    #[test]
    fn random_points_are_uniform_and_streams_independent() {
        let random = Random::new(2);
        let points: Vec<[f64; 3]> = (0..100_000).map(|i| random.point(i)).collect();
        for d in 0..3 {
            let p = uniformity(&equal_bins(points.iter().map(|x| x[d]), 100));
            assert!(p > 1e-3, "dimension {d}: p = {p}");
        }
        // Two coordinates of one point, and the same coordinate of neighbouring streams.
        let cell = |a: f64, b: f64| ((a * 16.0).floor() + b) / 16.0;
        let within = points.iter().map(|x| cell(x[0], x[1]));
        let across = points.windows(2).map(|w| cell(w[0][0], w[1][0]));
        let p = [equal_bins(within, 256), equal_bins(across, 256)].map(|bins| uniformity(&bins));
        assert!(p.iter().all(|p| *p > 1e-3), "{p:?}");
    }

    #[test]
    fn smooth_integrals_converge_faster_than_random() {
        // RMS over 16 seeds of the error of ∫ Π (1 + (e^x_d − (e − 1))/2) = 1 over four dimensions.
        let rms = |n: u64| {
            let square = |seed: u64| {
                let mut sobol = Sobol::new(seed);
                let factor = |x: f64| 1.0 + 0.5 * (x.exp() - (1.0_f64.exp() - 1.0));
                let value = |i| sobol.point::<4>(i).map(factor).iter().product::<f64>();
                let sum: f64 = (0..n).map(value).sum();
                (sum / n as f64 - 1.0).powi(2)
            };
            ((0..16).map(square).sum::<f64>() / 16.0).sqrt()
        };
        let (coarse, fine) = (rms(1 << 8), rms(1 << 14));
        let order = (coarse / fine).log2() / 6.0;
        assert!(order > 0.9, "N^-{order}: {coarse:e} {fine:e}");
        // Sixteen blocks average sixteen independent nets: half an order, no worse.
        let many = rms(1 << 20);
        assert!(many < 0.35 * rms(1 << 16), "{many:e}");
    }
}

mod quadrature {
    use crate::common::near;
    use gonio::sampling::{GAUSS_KRONROD, gauss_legendre};

    /// ∫ x^degree dx from -1 to 1.
    fn exact(degree: i32) -> f64 {
        f64::from(1 - degree % 2) * 2.0 / f64::from(degree + 1)
    }

    #[test]
    fn polynomials_below_degree_2n_are_exact() {
        for n in [1, 2, 3, 8, 31, 64, 200] {
            let rule = gauss_legendre(n);
            assert!(rule.windows(2).all(|pair| pair[0].0 < pair[1].0));
            for degree in [0, 1, n as i32, 2 * n as i32 - 2, 2 * n as i32 - 1] {
                let got = rule.iter().map(|(x, w)| w * x.powi(degree));
                // Rounding of 200 weights near the ends adds up to some 1e-14.
                near(got.sum(), exact(degree), 1e-13, (n, degree));
            }
        }
    }

    #[test]
    fn the_pair_has_its_degrees() {
        for degree in 0..=24 {
            let off = |weight: usize| -> f64 {
                let terms = GAUSS_KRONROD.iter().map(|n| n[weight] * n[0].powi(degree));
                (terms.sum::<f64>() - exact(degree)).abs()
            };
            assert_eq!(off(1) < 1e-15, degree <= 23, "{degree}");
            assert_eq!(off(2) < 1e-15, degree <= 13 || degree % 2 == 1, "{degree}");
        }
    }
}
