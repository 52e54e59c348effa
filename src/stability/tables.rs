//! Measured tables: the right cell everywhere, values within their cells, and tables that are black, bright in one
//! cell, spread over 42 decades, broken, or empty.

use super::cases::{Case, pairs};
use super::models::neighbours;
use super::{Check, Extent, Family, Finding, Law, ROUNDING, charts};
use crate::brdf::measured::merl::{Interpolation, Merl, MerlGrid, SCALE};
use crate::brdf::measured::utia::{self, Utia};
use crate::brdf::{Brdf, Channels};
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::exact::Exact;
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) const FAMILY: Family = Family {
    name: "tables",
    summary: "MERL and UTIA: the right cell, between its nodes, black, bright in one cell, 42 decades, NaN, empty",
    checks,
};

const CELL: Law = Law::bounded("the nearest cell holds the pair", "cells", 8.0);
const BETWEEN: Law = Law::bounded("a constant table is constant", "relative", 16.0);
const LINEAR: Law = Law::bounded("linear in the angles of its nodes", "relative", 16.0);
const FINITE: Law = Law::strict("finite and not negative, or missing");
const MISSING: Law = Law::strict("without data it is refused, or missing");

/// A distance below an edge within which a pair counts as on it, in cells: see the table's own page.
const EDGE: f64 = 1e-8;

/// A MERL table of values of R, G and B (sr⁻¹) by cell.
fn merl(value: impl Fn(usize) -> f64) -> Option<Merl> {
    let grid = MerlGrid::RECIPROCAL;
    let [n_h, n_d, n_phi] = grid.dims();
    let cells = n_h * n_d * n_phi;
    let mut bytes = Vec::with_capacity(12 + 24 * cells);
    for n in grid.dims() {
        bytes.extend((n as i32).to_le_bytes());
    }
    for scale in SCALE {
        bytes.extend((0..cells).flat_map(|cell| (value(cell) / scale).to_le_bytes()));
    }
    Merl::read(bytes.as_slice(), Channels::Luminance).ok()
}

/// A UTIA table of values by node.
fn utia(value: impl Fn(usize) -> f64) -> Option<Utia> {
    let plane = (0..utia::NODES).flat_map(|node| value(node).to_le_bytes());
    let bytes = plane.collect::<Vec<u8>>().repeat(3);
    Utia::read(bytes.as_slice(), 1.0, Channels::Luminance).ok()
}

/// Values of tables by the number of a cell.
type Content = (&'static str, fn(usize) -> f64);

/// Numbers spread over the table, without a pattern that its axes know.
fn scattered(cell: usize) -> f64 {
    ((cell as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 11) as f64 / (1u64 << 53) as f64
}

const CONTENTS: [Content; 5] = [
    ("black", |_| 0.0),
    ("1e-30 to 1e12", |cell| {
        10f64.powf(-30.0 + 42.0 * scattered(cell))
    }),
    (
        "one bright cell",
        |cell| if cell == 12_345 { 1e12 } else { 1e-30 },
    ),
    ("subnormal and largest", |cell| match cell % 3 {
        0 => 5e-324,
        1 => 1e300,
        _ => 0.0,
    }),
    ("broken", |cell| match cell % 7 {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => f64::NEG_INFINITY,
        3 => -1.0,
        _ => scattered(cell),
    }),
];

/// Values that are none; a negative one is one of MERL's alone.
const EMPTY: [(&str, f64); 3] = [
    ("negative", -1.0),
    ("NaN", f64::NAN),
    ("infinite", f64::INFINITY),
];

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = vec![
        Check::new("merl nearest", CELL, move |watch| right_cell(extent, watch)),
        Check::new("utia", LINEAR, move |watch| linear(extent, watch)),
        Check::new("merl, empty", MISSING, |watch| {
            for (what, value) in EMPTY {
                watch.holds(merl(|_| value).is_none(), &what);
            }
        }),
        Check::new("utia, empty", MISSING, |watch| {
            for (what, value) in &EMPTY[1..] {
                watch.holds(utia(|_| *value).is_none(), what);
            }
        }),
    ];
    for size in [1e-30, 1.0, 1e12] {
        let member = format!("merl trilinear, {size:e}");
        checks.push(Check::new(member, BETWEEN, move |watch| {
            constant(merl(|_| size), size, extent, watch);
        }));
        let member = format!("utia, {size:e}");
        checks.push(Check::new(member, BETWEEN, move |watch| {
            constant(utia(|_| size), size, extent, watch);
        }));
    }
    for (name, value) in extent.subset(CONTENTS.to_vec(), 2) {
        for interpolation in [Interpolation::Nearest, Interpolation::Trilinear] {
            let member = format!("merl {interpolation:?}, {name}").to_lowercase();
            checks.push(Check::new(member, FINITE, move |watch| {
                let table = merl(value).map(|table| table.with_interpolation(interpolation));
                finite(table, extent, watch);
            }));
        }
        checks.push(Check::new(format!("utia, {name}"), FINITE, move |watch| {
            finite(utia(value), extent, watch);
        }));
    }
    checks
}

/// Index coordinates of a pair in a MERL table, with 50 digits.
fn index(pair: &charts::Pair) -> [Exact; 3] {
    let [theta_h, theta_d, phi_d] = charts::relative("half-difference", pair);
    let degree = Exact::pi() / &180.0.into();
    let right = Exact::pi() / &2.0.into();
    let phi = match phi_d / &degree {
        phi if phi < 0.0.into() => phi + &180.0.into(),
        phi => phi,
    };
    let theta_h = (theta_h / &right).sqrt() * &90.0.into();
    [theta_h, theta_d / &degree, phi]
}

/// A table whose cells hold their own numbers.
fn right_cell(extent: Extent, watch: &mut Finding) {
    let table = merl(|cell| 1.0 + cell as f64);
    let Some(table) = table.map(|t| t.with_interpolation(Interpolation::Nearest)) else {
        return;
    };
    let dims = table.grid().dims();
    let mut cases: Vec<Case> = extent.subset(pairs(), 3);
    // Middles and edges of cells, those of the peak first.
    let axis = vec![0.0, 0.2, 0.5, 1.0, 1.5, 7.3, 44.0, 44.5, 88.9];
    let axis = extent.subset(axis, 2);
    for &h in &axis {
        for &d in &axis {
            for phi in [0.0, 0.5, 90.0, 90.5, 179.5] {
                let theta_h = FRAC_PI_2 * (h / 90.0) * (h / 90.0);
                let coords = [theta_h, d * PI / 180.0, phi * PI / 180.0];
                let absolute = charts::lift("half-difference", coords.map(Exact::from));
                let Some(pair) = charts::inverse("half-difference", &absolute) else {
                    continue;
                };
                let pair = pair.map(|v| Direction::try_new(v.map(|x| x.to_f64()).into()));
                if let [Some(i), Some(o)] = pair {
                    let pair = DirectionPair::new(i, o);
                    let name = format!("index {h}, {d}, {phi}");
                    cases.push(Case { name, pair });
                }
            }
        }
    }
    for Case { name, pair } in cases.into_iter().filter(|c| c.pair.is_above_horizon()) {
        watch.spent(1);
        let Some(value) = table.luminance(&pair) else {
            watch.holds(false, &name);
            continue;
        };
        let number = (value - 1.0).round() as usize;
        let (row, last) = (number / dims[2], number % dims[2]);
        let cell = [row / dims[1], row % dims[1], last];
        let at = index(&charts::exactly(&pair));
        let nudged = (0..6).filter_map(|d| charts::nudged(&pair, d));
        let nudged: Vec<_> = nudged.map(|p| index(&p)).collect();
        for d in 0..3 {
            let x = at[d].to_f64();
            // The last cell reaches to the horizon, and the azimuth goes round.
            let gap = |low: f64| (low - x).max(x - low - 1.0).max(0.0);
            let low = cell[d] as f64;
            let turn = dims[2] as f64;
            let off = match d {
                2 => gap(low).min(gap(low - turn)).min(gap(low + turn)),
                _ if cell[d] + 1 == dims[d] => (low - x).max(0.0),
                _ => gap(low),
            };
            let moved = nudged.iter().map(|n| {
                let moved = (n[d].clone() - &at[d]).abs().to_f64();
                if d == 2 {
                    moved.min((moved - turn).abs())
                } else {
                    moved
                }
            });
            let conditioning = moved.sum::<f64>() + ROUNDING * x + EDGE / CELL.allowed;
            watch.see(off, conditioning, &format_args!("axis {d}, {name}"));
        }
    }
}

/// Shows the values of a table at the extreme pairs; beyond 75° one of UTIA has none.
fn each_value(
    table: Option<impl Brdf>,
    extent: Extent,
    watch: &mut Finding,
    see: impl Fn(&mut Finding, Case, Option<f64>),
) {
    let Some(table) = table else {
        return;
    };
    for case in extent.subset(pairs(), 3) {
        watch.spent(1);
        let value = table.luminance(&case.pair);
        see(watch, case, value);
    }
}

fn constant(table: Option<impl Brdf>, size: f64, extent: Extent, watch: &mut Finding) {
    each_value(table, extent, watch, |watch, Case { name, .. }, value| {
        if let Some(value) = value {
            watch.see((value - size).abs() / size, ROUNDING, &name);
        }
    });
}

fn finite(table: Option<impl Brdf>, extent: Extent, watch: &mut Finding) {
    each_value(table, extent, watch, |watch, Case { name, .. }, value| {
        watch.is_reflectance(value.unwrap_or(0.0), &name);
    });
}

/// A table of a sum of its elevations, which its interpolation gives back.
fn linear(extent: Extent, watch: &mut Finding) {
    let of = |theta_i: f64, theta_o: f64| 1.0 + theta_i + 3.0 * theta_o;
    let elevation = |direction: usize| (direction / utia::AZIMUTHS) as f64 * PI / 12.0;
    let directions = utia::ELEVATIONS * utia::AZIMUTHS;
    let table = utia(|node| of(elevation(node / directions), elevation(node % directions)));
    let Some(table) = table else {
        return;
    };
    let value = |pair: &DirectionPair| table.luminance(pair);
    for Case { name, pair } in extent.subset(pairs(), 3) {
        watch.spent(1);
        let Some(got) = value(&pair) else {
            continue;
        };
        let [theta_i, _, theta_o, _] = charts::absolute("spherical", &charts::exactly(&pair));
        let want = of(theta_i.to_f64(), theta_o.to_f64());
        let moved = neighbours(&pair).filter_map(|p| value(&p));
        let conditioning = moved.map(|v| (v - got).abs()).sum::<f64>() / want + ROUNDING;
        watch.see((got - want).abs() / want, conditioning, &name);
    }
}
