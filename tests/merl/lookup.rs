//! Pairs in: which cell, and what lies between the nodes.

use super::{angles, cells, file, first, grey, pair, ulps};
use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid, SCALE};
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::geometry::DirectionPair;
use gonio::sampling::{self, Random};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const GRIDS: [MerlGrid; 2] = [MerlGrid::Reciprocal, MerlGrid::Full];

fn random_pairs(seed: u64, n: u64) -> impl Iterator<Item = DirectionPair> {
    let random = Random::new(seed);
    (0..n).map(move |i| {
        let u: [f64; 4] = random.point(i);
        DirectionPair::new(
            sampling::cosine_hemisphere([u[0], u[1]]),
            sampling::cosine_hemisphere([u[2], u[3]]),
        )
    })
}

/// The reference reader (Matusik's `BRDFRead.cpp`), with its dot products and acos.
mod reference {
    use super::{FRAC_PI_2, PI};
    use glam::DVec3;

    /// Rodrigues' rotation, as `rotate_vector`.
    fn rotate(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
        let (sin, cos) = angle.sin_cos();
        v * cos + axis * (v.dot(axis) * (1.0 - cos)) + axis.cross(v) * sin
    }

    /// `std_coords_to_half_diff_coords`: theta_half, theta_diff, fi_diff.
    pub fn angles(incoming: DVec3, outgoing: DVec3) -> [f64; 3] {
        let half = ((incoming + outgoing) / 2.0).normalize();
        let theta_half = half.z.acos();
        let fi_half = half.y.atan2(half.x);
        let temp = rotate(incoming, DVec3::Z, -fi_half);
        let diff = rotate(temp, DVec3::Y, -theta_half);
        [theta_half, diff.z.acos(), diff.y.atan2(diff.x)]
    }

    /// `theta_half_index`, `theta_diff_index`, `phi_diff_index`.
    pub fn cell([theta_half, theta_diff, mut phi_diff]: [f64; 3]) -> [i64; 3] {
        let half = if theta_half <= 0.0 {
            0
        } else {
            let theta_half_deg = theta_half / FRAC_PI_2 * 90.0;
            ((theta_half_deg * 90.0).sqrt() as i64).clamp(0, 89)
        };
        let diff = ((theta_diff / (PI * 0.5) * 90.0) as i64).clamp(0, 89);
        if phi_diff < 0.0 {
            phi_diff += PI;
        }
        let phi = ((phi_diff / PI * 360.0 / 2.0) as i64).clamp(0, 179);
        [half, diff, phi]
    }
}

#[test]
fn nearest_reads_the_reference_reader_s_cells() {
    let grid = MerlGrid::Reciprocal;
    let mut compared = 0;
    for pair in random_pairs(1, 400_000) {
        let a = reference::angles(pair.omega_i.vector(), pair.omega_o.vector());
        // Its acos is good to 1e-8 rad near the peak; within 1e-7 of an edge the two may differ.
        let near_edge = (0..3).any(|axis| {
            [-1e-7, 1e-7].into_iter().any(|e| {
                let mut b = a;
                b[axis] += e;
                reference::cell(b) != reference::cell(a)
            })
        });
        if !near_edge {
            compared += 1;
            assert_eq!(
                grid.cell(&pair).map(|i| i as i64),
                reference::cell(a),
                "{a:?}"
            );
        }
    }
    assert!(compared > 390_000, "{compared}");
}

/// Each cell's stored R is its own index: the table says which cell it was asked for.
fn self_naming(grid: MerlGrid) -> Merl {
    let bytes = file(grid, |_, cell| grid.index(cell) as f64);
    Merl::read(bytes.as_slice(), Channels::Rgb)
        .unwrap()
        .with_interpolation(Interpolation::Nearest)
}

/// Asserts that the pair at the angles (rad) reads `cell`; false if it is below the horizon.
fn reads(table: &Merl, a: [f64; 3], phi_h: f64, cell: [usize; 3]) -> bool {
    let Some(pair) = pair(a[0], a[1], a[2], phi_h) else {
        return false;
    };
    let want = table.grid().index(cell) as f64 * SCALE[0];
    if first(table, &pair) != Some(want) {
        panic!(
            "{a:?} phi_h {phi_h}: want {cell:?}, got {:?}",
            table.grid().cell(&pair)
        );
    }
    true
}

#[test]
fn nearest_reads_every_cell_at_its_centre() {
    for grid in GRIDS {
        let table = self_naming(grid);
        let mut seen = 0;
        for (i, cell) in cells(grid).enumerate() {
            let centre = angles(cell.map(|i| i as f64 + 0.5));
            seen += usize::from(reads(&table, centre, i as f64, cell));
        }
        assert!(seen as f64 > 0.74 * grid.cells() as f64, "{seen}");
    }
}

#[test]
fn nearest_keeps_both_sides_of_every_edge_apart() {
    // 1e-9 rad: 2 to 4 times what a pair near the peak and near theta_d = 90° can carry in f64.
    const SIDE: f64 = 1e-9;
    for grid in GRIDS {
        let table = self_naming(grid);
        let n_phi = grid.dims()[2];
        let mut seen = 0;
        for (i, cell) in cells(grid).enumerate() {
            for axis in 0..3 {
                let mut lower = cell.map(|i| i as f64 + 0.5);
                lower[axis] = cell[axis] as f64;
                let at = angles(lower);
                let (mut above, mut below) = (at, at);
                above[axis] += SIDE;
                below[axis] -= SIDE;
                seen += usize::from(reads(&table, above, i as f64, cell));
                let mut previous = cell;
                match (cell[axis], axis) {
                    (0, 2) => previous[axis] = n_phi - 1,
                    (0, _) => continue,
                    (n, _) => previous[axis] = n - 1,
                }
                seen += usize::from(reads(&table, below, i as f64, previous));
            }
        }
        assert!(seen as f64 > 0.74 * 5.9 * grid.cells() as f64, "{seen}");
    }
}

#[test]
fn nearest_reads_every_node_s_own_cell() {
    for grid in GRIDS {
        let table = self_naming(grid);
        // At theta_d = 0 all phi_d are one pair.
        for cell in cells(grid).filter(|cell| cell[1] > 0) {
            let Some(pair) = grid.pair(cell) else {
                continue;
            };
            assert_eq!(grid.cell(&pair), cell);
            assert_eq!(
                first(&table, &pair),
                Some(grid.index(cell) as f64 * SCALE[0])
            );
        }
    }
}

#[test]
fn in_plane_pairs_read_the_first_column() {
    let table = self_naming(MerlGrid::Reciprocal);
    // At i = 11 they are in mirror position: the half vector is the normal, phi_d anything.
    for i in (1..80).filter(|&i| i != 11) {
        let (a, b) = (
            f64::from(i).to_radians(),
            (f64::from(i) * 0.7 + 3.3).to_radians(),
        );
        for phi in [0.0, 0.3, 2.0, PI, -1.0] {
            let pair = DirectionPair::from_spherical(a, phi, b, phi + PI);
            assert_eq!(table.grid().cell(&pair)[2], 0);
            assert_eq!(table.grid().cell(&pair.swapped())[2], 0);
        }
    }
}

#[test]
fn swapping_light_and_sensor_changes_no_bit() {
    let table = self_naming(MerlGrid::Reciprocal);
    for interpolation in [Interpolation::Nearest, Interpolation::Trilinear] {
        let table = table.clone().with_interpolation(interpolation);
        for pair in random_pairs(2, 100_000) {
            assert_eq!(first(&table, &pair), first(&table, &pair.swapped()));
        }
        // In the plane and at the normal, where components are ±0.
        for (a, b) in [
            (0.3, 0.5),
            (0.5, 0.3),
            (0.4, 0.4),
            (0.0, 0.6),
            (0.6, 0.0),
            (0.0, 0.0),
        ] {
            for phi in [0.0, PI, FRAC_PI_2] {
                let pair = DirectionPair::from_spherical(a, 0.0, b, phi);
                assert_eq!(first(&table, &pair), first(&table, &pair.swapped()));
            }
        }
    }
}

#[test]
fn trilinear_weights_sum_to_one() {
    for channels in [Channels::Luminance, Channels::Rgb] {
        let table = grey(MerlGrid::Reciprocal, channels, |_| 0.7);
        for pair in random_pairs(3, 100_000) {
            let v = first(&table, &pair).unwrap();
            assert!((v - 0.7).abs() < 1e-15, "{v}");
        }
    }
}

#[test]
fn trilinear_is_exact_on_functions_linear_in_the_coordinates() {
    let f = |x: [f64; 3]| 5.0 + 0.3 * x[0] + 0.2 * x[1] + 0.1 * x[2];
    for grid in GRIDS {
        for channels in [Channels::Luminance, Channels::Rgb] {
            let table = grey(grid, channels, |cell| f(cell.map(|i| i as f64)));
            let n = grid.dims()[2] as f64;
            let random = Random::new(4);
            let mut seen = 0;
            for i in 0..100_000 {
                let u: [f64; 4] = random.point(i);
                // From the first row on: at theta_h = 0 phi_d means nothing.
                let x = [1.0 + u[0] * 88.0, 0.01 + u[1] * 88.98, u[2] * (n - 1.0)];
                let [h, d, phi] = angles(x);
                let Some(pair) = pair(h, d, phi, TAU * u[3]) else {
                    continue;
                };
                seen += 1;
                let got = first(&table, &pair).unwrap();
                // Rounding of the pair moves phi_d by 4e-16 (1/|h_bar| + 1/|k|) rad, here 0.1 a degree.
                let moved = 4e-16 * (1.0 / (h.sin() * d.cos()) + 1.0 / d.sin());
                let allowed = 1e-12 + 0.1 * moved.to_degrees();
                assert!((got - f(x)).abs() < allowed, "{x:?}: {got} {}", f(x));
            }
            assert!(seen > 50_000);
        }
    }
}

#[test]
fn trilinear_is_periodic_in_phi_and_constant_beyond_the_last_nodes() {
    let reciprocal = grey(MerlGrid::Reciprocal, Channels::Luminance, |[.., phi]| {
        if phi == 0 { 3.0 } else { 1.0 }
    });
    for (x_phi, want) in [(179.25, 1.5), (359.25, 1.5), (0.25, 2.5), (-0.75, 1.5)] {
        let [h, d, phi] = angles([10.0, 20.0, x_phi]);
        let got = first(&reciprocal, &pair(h, d, phi, 0.4).unwrap()).unwrap();
        assert!((got - want).abs() < 1e-9, "{x_phi}: {got}");
    }
    let full = grey(MerlGrid::Full, Channels::Luminance, |[.., phi]| {
        if phi == 0 { 3.0 } else { 1.0 }
    });
    for (x_phi, want) in [(359.25, 1.5), (179.25, 1.0), (-0.25, 2.5)] {
        let [h, d, phi] = angles([10.0, 20.0, x_phi]);
        let got = first(&full, &pair(h, d, phi, 0.4).unwrap()).unwrap();
        assert!((got - want).abs() < 1e-9, "{x_phi}: {got}");
    }
    let ends = grey(MerlGrid::Reciprocal, Channels::Luminance, |[h, d, _]| {
        (h + 1000 * d) as f64
    });
    let beyond = |x: [f64; 3]| {
        let [h, d, phi] = angles(x);
        first(&ends, &pair(h, d, phi, 0.0).unwrap()).unwrap()
    };
    assert!((beyond([89.7, 0.0, 90.0]) - 89.0).abs() < 1e-9);
    assert!((beyond([0.0, 89.7, 90.0]) - 89_000.0).abs() < 1e-6);
}

#[test]
fn trilinear_has_one_value_at_each_theta_d_of_the_pole() {
    // With phi_d at theta_h = 0 as published fits have it, and cells without data among them.
    let stored = |[h, d, phi]: [usize; 3]| match phi % 7 {
        0 => -1.0,
        r => (1 + h) as f64 + 0.01 * d as f64 + 0.07 * r as f64,
    };
    let mean = |d: usize| {
        let cells = (0..180).map(|phi| stored([0, d, phi]));
        let data: Vec<f64> = cells.filter(|v| *v >= 0.0).collect();
        data.iter().sum::<f64>() / data.len() as f64
    };
    for channels in [Channels::Luminance, Channels::Rgb] {
        let table = grey(MerlGrid::Reciprocal, channels, stored);
        let nearest = table.clone().with_interpolation(Interpolation::Nearest);
        for d in [1, 30, 70] {
            let mut read = Vec::new();
            for phi in 1..180 {
                let at = |x_h: f64| {
                    let [h, d, phi] = angles([x_h, d as f64, f64::from(phi)]);
                    pair(h, d, phi, 0.3).unwrap()
                };
                // theta_h = 3e-14 rad: its coordinate, 1e-5 cells, is what a value may differ by.
                let limit = first(&table, &at(1e-5)).unwrap();
                assert!(
                    (limit - mean(d)).abs() < 1e-4,
                    "{d} {phi}: {limit} {}",
                    mean(d)
                );
                read.extend(first(&nearest, &at(0.5)));
            }
            // The reference reader's values are those that are stored.
            assert!(read.iter().any(|v| (v - read[0]).abs() > 0.1));
        }
    }
}

#[test]
fn trilinear_error_falls_with_the_square_of_the_detail() {
    // The grid is fixed, so the function changes: cos(m phi_d) on midpoints errs by (m π/180)²/8.
    let error = |m: f64| {
        let table = grey(MerlGrid::Reciprocal, Channels::Luminance, |[.., phi]| {
            2.0 + (m * (phi as f64).to_radians()).cos()
        });
        (0..180).fold(0.0f64, |worst, i| {
            let [h, d, phi] = angles([40.5, 20.5, f64::from(i) + 0.5]);
            let got = first(&table, &pair(h, d, phi, 0.1).unwrap()).unwrap();
            worst.max((got - 2.0 - (m * phi).cos()).abs())
        })
    };
    for m in [2.0, 4.0, 8.0, 16.0] {
        let expected = (m * PI / 180.0).powi(2) / 8.0;
        assert!(
            (error(m) / expected - 1.0).abs() < 0.02,
            "{m}: {}",
            error(m)
        );
    }
}

#[test]
fn missing_cells_are_missing_and_never_zero() {
    // A hole of one node, and a hole of eight.
    let in_block = |cell: [usize; 3]| {
        (20..22).contains(&cell[0]) && (30..32).contains(&cell[1]) && (100..102).contains(&cell[2])
    };
    let hole = |cell: [usize; 3]| cell == [10, 20, 40] || in_block(cell);
    for channels in [Channels::Luminance, Channels::Rgb] {
        // One missing channel is enough.
        let bytes = file(MerlGrid::Reciprocal, |c, cell| match (hole(cell), c) {
            (true, 1) => -1.0,
            (_, c) => 2.0 / SCALE[c],
        });
        let trilinear = Merl::read(bytes.as_slice(), channels).unwrap();
        let nearest = trilinear.clone().with_interpolation(Interpolation::Nearest);
        let at = |table: &Merl, x: [f64; 3]| {
            let [h, d, phi] = angles(x);
            first(table, &pair(h, d, phi, 0.2).unwrap())
        };
        let close = |v: Option<f64>| v.is_some_and(|v| ulps(v, 2.0) <= 3.0);
        assert_eq!(at(&nearest, [10.5, 20.5, 40.5]), None);
        assert!(close(at(&nearest, [9.5, 20.5, 40.5])));
        for x in [[10.1, 20.1, 40.1], [9.9, 19.9, 39.9], [10.5, 20.5, 40.5]] {
            assert!(close(at(&trilinear, x)), "{x:?}");
        }
        for interpolated in [&nearest, &trilinear] {
            assert_eq!(at(interpolated, [20.5, 30.5, 100.5]), None);
        }
        assert!(close(at(&trilinear, [19.5, 30.5, 100.5])));
        assert_eq!(trilinear.missing_cells(), 9);
    }
}

#[test]
fn below_the_horizon_is_zero_not_missing() {
    let table = self_naming(MerlGrid::Reciprocal);
    for theta in [FRAC_PI_2 + 1e-9, 2.0, PI] {
        let pair = DirectionPair::from_spherical(theta, 0.3, 0.2, 1.0);
        assert_eq!(first(&table, &pair), Some(0.0));
        assert_eq!(first(&table, &pair.swapped()), Some(0.0));
    }
}

#[test]
fn a_batch_is_its_pairs_one_by_one() {
    let table = self_naming(MerlGrid::Reciprocal);
    let pairs: Vec<_> = random_pairs(5, 1000).collect();
    for interpolation in [Interpolation::Nearest, Interpolation::Trilinear] {
        let table = table.clone().with_interpolation(interpolation);
        let (mut out, mut presence) = (vec![0.0; 3000], vec![Presence::Missing; 1000]);
        table.eval_batch(&pairs, &mut out, &mut presence);
        for (i, pair) in pairs.iter().enumerate() {
            let mut one = [0.0; 3];
            assert_eq!(table.eval(pair, &mut one), presence[i]);
            assert_eq!(one, out[3 * i..3 * i + 3]);
        }
    }
}
