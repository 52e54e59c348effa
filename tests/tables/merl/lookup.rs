//! Pairs in: which cell, and what lies between the nodes.

use super::{angles, cells, file, first, grey, pair, ulps};
use crate::common::{cosine_pairs, material, near, product};
use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid, Nodes, SCALE, write_merl};
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::{Direction, DirectionPair};
use gonio::sampling::{self, Random, Sobol};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const GRIDS: [MerlGrid; 2] = [MerlGrid::RECIPROCAL, MerlGrid::FULL];

/// Each place of nodes, and how far from the lower edges of their cells it is.
const NODES: [(Nodes, f64); 2] = [(Nodes::Centre, 0.5), (Nodes::Corner, 0.0)];

/// The value at index coordinates, turned by `phi_h` about the normal.
fn at(table: &Merl, x: [f64; 3], phi_h: f64) -> Option<f64> {
    let [h, d, phi] = angles(x);
    first(table, &pair(h, d, phi, phi_h).unwrap())
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
        let theta_half_deg = theta_half.max(0.0) / FRAC_PI_2 * 90.0;
        let half = ((theta_half_deg * 90.0).sqrt() as i64).clamp(0, 89);
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
    let grid = MerlGrid::RECIPROCAL;
    let mut compared = 0;
    for pair in cosine_pairs(1).take(400_000) {
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
            let cell = grid.cell(&pair).map(|i| i as i64);
            assert_eq!(cell, reference::cell(a), "{a:?}");
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

#[test]
fn nearest_reads_every_node_s_own_cell() {
    for (grid, (nodes, _)) in product(GRIDS, NODES) {
        let (table, grid) = (self_naming(grid), grid.with_nodes(nodes));
        // At theta_d = 0 all phi_d are one pair.
        for cell in cells(grid).filter(|cell| cell[1] > 0) {
            let Some(pair) = grid.pair(cell) else {
                continue;
            };
            assert_eq!(grid.cell(&pair), cell);
            let own = grid.index(cell) as f64 * SCALE[0];
            assert_eq!(first(&table, &pair), Some(own));
        }
    }
}

#[test]
fn in_plane_pairs_read_the_first_column() {
    let table = self_naming(MerlGrid::RECIPROCAL);
    // At i = 11 they are in mirror position: the half vector is the normal, phi_d anything.
    for i in (1..80).filter(|&i| i != 11) {
        let [a, b] = [f64::from(i), f64::from(i) * 0.7 + 3.3].map(f64::to_radians);
        for phi in [0.0, 0.3, 2.0, PI, -1.0] {
            let pair = DirectionPair::from_spherical(a, phi, b, phi + PI);
            assert_eq!(table.grid().cell(&pair)[2], 0);
            assert_eq!(table.grid().cell(&pair.swapped())[2], 0);
        }
    }
}

#[test]
fn swapping_light_and_sensor_changes_no_bit() {
    let table = self_naming(MerlGrid::RECIPROCAL);
    for interpolation in [Interpolation::Nearest, Interpolation::Trilinear] {
        let table = table.clone().with_interpolation(interpolation);
        for pair in cosine_pairs(2).take(100_000) {
            assert_eq!(first(&table, &pair), first(&table, &pair.swapped()));
        }
        // Below the horizon a value is 0, and not missing.
        for theta in [FRAC_PI_2 + 1e-9, 2.0, PI] {
            let pair = DirectionPair::from_spherical(theta, 0.3, 0.2, 1.0);
            assert_eq!(first(&table, &pair), Some(0.0));
            assert_eq!(first(&table, &pair.swapped()), Some(0.0));
        }
        // In the plane and at the normal, where components are ±0.
        for (a, b) in [(0.3, 0.5), (0.4, 0.4), (0.0, 0.6), (0.0, 0.0)] {
            for phi in [0.0, PI, FRAC_PI_2] {
                let pair = DirectionPair::from_spherical(a, 0.0, b, phi);
                assert_eq!(first(&table, &pair), first(&table, &pair.swapped()));
            }
        }
    }
}

#[test]
fn trilinear_is_exact_on_functions_linear_in_the_coordinates() {
    let f = |x: [f64; 3]| 5.0 + 0.3 * x[0] + 0.2 * x[1] + 0.1 * x[2];
    for (grid, (nodes, shift)) in product(GRIDS, NODES) {
        for channels in [Channels::Luminance, Channels::Rgb] {
            let table = grey(grid, channels, |cell| f(cell.map(|i| i as f64 + shift)));
            let table = table.with_nodes(nodes);
            let n = grid.dims()[2] as f64;
            // From the first row with phi_d to the last.
            let (start, end) = (if shift > 0.0 { shift } else { 1.0 }, 89.0 + shift);
            let random = Random::new(4);
            let mut seen = 0;
            for i in 0..50_000 {
                let u: [f64; 4] = random.point(i);
                let [x_h, x_d] = [u[0], u[1]].map(|u| start + u * (end - start));
                let x = [x_h, x_d, shift + u[2] * (n - 1.0)];
                let [h, d, phi] = angles(x);
                let Some(pair) = pair(h, d, phi, TAU * u[3]) else {
                    continue;
                };
                seen += 1;
                let got = first(&table, &pair).unwrap();
                // Rounding of the pair moves phi_d by 4e-16 (1/|h_bar| + 1/|k|) rad, here 0.1 a degree.
                let moved = 4e-16 * (1.0 / (h.sin() * d.cos()) + 1.0 / d.sin());
                near(got, f(x), 1e-12 + 0.1 * moved.to_degrees(), (nodes, x));
            }
            assert!(seen > 25_000);
        }
    }
}

#[test]
fn trilinear_is_periodic_in_phi_and_constant_beyond_the_last_nodes() {
    for (nodes, shift) in NODES {
        let peak = |grid| {
            let at = |[.., phi]: [usize; 3]| if phi == 0 { 3.0 } else { 1.0 };
            grey(grid, Channels::Luminance, at).with_nodes(nodes)
        };
        let read = |table: &Merl, x, phi_h| at(table, x, phi_h).unwrap();
        let half = [(179.25, 1.5), (359.25, 1.5), (0.25, 2.5), (-0.75, 1.5)];
        let full = [(359.25, 1.5), (179.25, 1.0), (-0.25, 2.5)];
        for (grid, cases) in GRIDS.into_iter().zip([&half[..], &full]) {
            let table = peak(grid);
            for (x_phi, want) in cases {
                let got = read(&table, [10.0, 20.0, x_phi + shift], 0.4);
                near(got, *want, 1e-9, (grid, nodes, x_phi));
            }
        }
        let ends = grey(MerlGrid::RECIPROCAL, Channels::Luminance, |[h, d, _]| {
            (h + 1000 * d) as f64
        });
        let ends = ends.with_nodes(nodes);
        near(read(&ends, [89.7, 0.0, 90.0], 0.0), 89.0, 1e-9, nodes);
        near(read(&ends, [0.0, 89.7, 90.0], 0.0), 89_000.0, 1e-6, nodes);
    }
}

#[test]
fn trilinear_has_one_value_where_phi_d_means_nothing() {
    // With phi_d at the poles as published fits have it, and cells without data among them.
    let stored = |[h, d, phi]: [usize; 3]| match phi % 7 {
        0 => -1.0,
        r => (1 + h) as f64 + 0.01 * d as f64 + 0.07 * r as f64,
    };
    let mean = |[h, d]: [usize; 2]| {
        let cells = (0..180).map(|phi| stored([h, d, phi]));
        let data: Vec<f64> = cells.filter(|v| *v >= 0.0).collect();
        data.iter().sum::<f64>() / data.len() as f64
    };
    let poles = [1, 30, 70].into_iter().flat_map(|i| [[0, i], [i, 0]]);
    let poles: Vec<[usize; 2]> = poles.chain([[0, 0]]).collect();
    let channels = [Channels::Luminance, Channels::Rgb];
    for (channels, (nodes, shift)) in product(channels, NODES) {
        let table = grey(MerlGrid::RECIPROCAL, channels, stored).with_nodes(nodes);
        let nearest = table.clone().with_interpolation(Interpolation::Nearest);
        for &[h, d] in &poles {
            let mut read = Vec::new();
            for phi in 1..180 {
                let beside = |table, pole: f64| {
                    let x = |cell: usize| if cell == 0 { pole } else { cell as f64 + shift };
                    at(table, [x(h), x(d), f64::from(phi)], 0.3)
                };
                // 1e-5 cells from the pole a value may differ by as much.
                let limit = beside(&table, 1e-5).unwrap();
                near(limit, mean([h, d]), 1e-4, (nodes, h, d, phi));
                read.extend(beside(&nearest, 0.5));
            }
            // The reference reader's values are those that are stored.
            assert!(read.iter().any(|v| (v - read[0]).abs() > 0.1));
        }
    }
}

/// A table sends out as much light from three elevations as its material by readers that hold values constant, and linear ones
/// as much as these.
#[test]
fn a_table_reflects_as_much_as_its_material() {
    for alpha in [0.05, 0.1, 0.3] {
        let keys = format!("alpha = {alpha}\nfresnel = {{ kind = \"none\" }}");
        let material = material("ggx", &keys, Channels::Luminance);
        let mut bytes = Vec::new();
        write_merl(&*material, MerlGrid::RECIPROCAL, &mut bytes).unwrap();
        let table = Merl::read(bytes.as_slice(), Channels::Luminance).unwrap();
        let constant = table.clone().with_interpolation(Interpolation::Nearest);
        for theta in [0.0, 0.5, 1.0] {
            let light = Direction::from_spherical(theta, 0.0);
            let mut sums = [0.0; 3];
            let mut sobol = Sobol::new(2);
            for i in 0..1 << 14 {
                let normal = sampling::ggx_half_vector(alpha, sobol.point(i));
                let (l, h) = (light.vector(), normal.vector());
                let cos = l.dot(h);
                let pair = DirectionPair::new(light, Direction::from_unit(2.0 * cos * h - l));
                if cos <= 0.0 || !pair.is_above_horizon() {
                    continue;
                }
                let pdf = sampling::ggx_half_vector_pdf(alpha, normal) / (4.0 * cos);
                let weight = pair.omega_o.cos_theta() / pdf;
                let brdfs: [&dyn Brdf; 3] = [&*material, &table, &constant];
                for (sum, brdf) in sums.iter_mut().zip(brdfs) {
                    *sum += weight * first(brdf, &pair).unwrap_or(0.0);
                }
            }
            let [truth, linear, constant] = sums;
            near(linear / constant, 1.0, 3e-3, ("linear", alpha, theta));
            near(constant / truth, 1.0, 3e-3, ("constant", alpha, theta));
        }
    }
}

#[test]
fn missing_cells_are_missing_and_never_zero() {
    // A hole of one node, and a hole of eight.
    let hole = |cell: [usize; 3]| matches!(cell, [10, 20, 40] | [20..22, 30..32, 100..102]);
    for channels in [Channels::Luminance, Channels::Rgb] {
        // One missing channel is enough.
        let bytes = file(MerlGrid::RECIPROCAL, |c, cell| match (hole(cell), c) {
            (true, 1) => -1.0,
            (_, c) => 2.0 / SCALE[c],
        });
        let trilinear = Merl::read(bytes.as_slice(), channels).unwrap();
        let nearest = trilinear.clone().with_interpolation(Interpolation::Nearest);
        let at = |table: &Merl, x| at(table, x, 0.2);
        let close = |v: Option<f64>| v.is_some_and(|v| ulps(v, 2.0) <= 3.0);
        assert_eq!(at(&nearest, [10.5, 20.5, 40.5]), None);
        assert!(close(at(&nearest, [9.5, 20.5, 40.5])));
        for x in [[10.6, 20.6, 40.6], [10.4, 20.4, 40.4], [11.0, 21.0, 41.0]] {
            assert!(close(at(&trilinear, x)), "{x:?}");
        }
        for interpolated in [&nearest, &trilinear] {
            assert_eq!(at(interpolated, [21.0, 31.0, 101.0]), None);
        }
        assert!(close(at(&trilinear, [20.0, 31.0, 101.0])));
        let missing = cells(trilinear.grid()).filter(|cell| trilinear.value(*cell).is_none());
        assert_eq!(missing.count(), 9);
    }
}
