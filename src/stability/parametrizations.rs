//! Coordinates of pairs, pairs at coordinates, and Jacobians.

use super::cases::{self, Case, SYMMETRIES, pairs};
use super::charts::{self, CHARTS, Pair};
use super::{Check, Extent, Family, Finding, Law, ROUNDING, Test};
use crate::geometry::{DirectionPair, Symmetry, distance};
use crate::numeric::exact::Exact;
use crate::parametrization::{self, Axis, AxisKind, Coords, Parametrization};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "parametrizations",
    summary: "coordinates, directions and Jacobians against 50 digits; there and back, with warps and folds",
    checks,
};

/// A handful of operations, each of which rounds.
const COORDINATES: Law = Law::bounded("coordinates of a pair", "own unit", 8.0);
const DIRECTIONS: Law = Law::bounded("directions at coordinates", "rad", 8.0);
const JACOBIAN: Law = Law::bounded("Jacobian", "relative", 16.0);
const THERE_AND_BACK: Law = Law::bounded("pair, coordinates, pair", "rad", 4.0);
const OUTSIDE: Law = Law::strict("nothing outside the domain");

/// A form, plain or warped.
struct Checked {
    form: Arc<dyn Parametrization>,
    /// The form without warps.
    plain: Arc<dyn Parametrization>,
    /// Its name in [`charts`]; empty of a form without formulas there.
    chart: &'static str,
}

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for (what, symmetry) in SYMMETRIES {
        for (name, form) in cases::forms(symmetry) {
            let is_plain = form.warp_name() == "none";
            let is_folded = symmetry.reciprocal || symmetry.bilateral;
            let chart = CHARTS.into_iter().find(|c| is_plain && *c == form.name());
            let mut tests: Vec<Test<Checked>> = Vec::new();
            if chart.is_some() && !is_folded {
                tests.push((COORDINATES, coordinates));
            }
            if chart.is_some() {
                tests.extend([(DIRECTIONS, directions as _), (JACOBIAN, jacobian as _)]);
            }
            tests.extend([
                (THERE_AND_BACK, there_and_back as _),
                (OUTSIDE, outside as _),
            ]);
            let plain = parametrization::find(form.name()).map(|entry| entry.form(symmetry));
            let of = Checked {
                plain: plain.unwrap_or_else(|| Arc::clone(&form)),
                chart: chart.unwrap_or_default(),
                form,
            };
            let member = format!("{name} ({what})");
            checks.extend(Check::each(member, of, extent, &tests));
        }
    }
    checks
}

/// Coordinates in 50 digits, in the order of the form.
fn exactly(chart: &str, symmetry: Symmetry, pair: &Pair) -> Vec<Exact> {
    match symmetry.isotropic {
        true => charts::relative(chart, pair).into(),
        false => charts::absolute(chart, pair).into(),
    }
}

/// Distance of two coordinates, of azimuths the shorter way round.
fn gap(kind: AxisKind, a: &Exact, b: &Exact) -> f64 {
    let gap = (a.clone() - b).abs().to_f64();
    match kind {
        AxisKind::Periodic => gap.min((gap - TAU).abs()),
        _ => gap,
    }
}

/// Lengths of the vectors that azimuths are of, one for each axis; infinite of a radial coordinate.
fn radii(chart: &str, symmetry: Symmetry, pair: &Pair) -> Vec<f64> {
    let [r1, _, r2, _] = charts::absolute(chart, pair).map(|x| x.to_f64());
    match symmetry.isotropic {
        true => vec![f64::INFINITY, f64::INFINITY, r1.min(r2)],
        false => vec![f64::INFINITY, r1, f64::INFINITY, r2],
    }
}

/// Moves one of the components of a pair by a rounding.
type Nudge = fn(&DirectionPair, usize) -> Option<Pair>;

fn coordinates(Checked { form, chart, .. }: &Checked, extent: Extent, watch: &mut Finding) {
    for Case { name, pair } in extent.subset(pairs(), 7) {
        let got = form.forward(&pair);
        watch.spent(1);
        let (at, nudge): (Pair, Nudge) = match *chart {
            "orthographic" => (charts::components(&pair), charts::nudged_components),
            _ => (charts::exactly(&pair), charts::nudged),
        };
        let exactly = |pair: &Pair| exactly(chart, form.symmetry(), pair);
        let want = exactly(&at);
        let nudged = (0..6).filter_map(|d| Some(exactly(&nudge(&pair, d)?)));
        let nudged: Vec<_> = nudged.collect();
        let flat = pair.vectors().map(|v| v.truncate().length());
        let component = ROUNDING * flat[0].max(flat[1]);
        let radii = radii(chart, form.symmetry(), &at);
        for (d, axis) in form.axes().iter().enumerate() {
            // A vector shorter than one rounding of the components it is a difference of has no azimuth.
            if radii[d] < component {
                continue;
            }
            let error = gap(axis.kind, &got[d].into(), &want[d]);
            let moved = nudged.iter().map(|n| gap(axis.kind, &n[d], &want[d]));
            // Radial coordinates keep their digits towards a pole; azimuths are good to those of half a turn.
            let size = match axis.kind {
                AxisKind::Radial => want[d].abs().to_f64(),
                _ => PI,
            };
            // Below the smallest normal number there are no digits to keep.
            let rounding = (ROUNDING * size).max(f64::MIN_POSITIVE);
            let conditioning = moved.sum::<f64>() + rounding;
            watch.see(error, conditioning, &format_args!("{} {name}", axis.symbol));
        }
    }
}

/// The absolute coordinates of a form's.
fn absolute(chart: &str, symmetry: Symmetry, coords: &[Exact; 4]) -> [Exact; 4] {
    match (symmetry.isotropic, coords) {
        (true, [r1, r2, a, _]) => charts::lift(chart, [r1.clone(), r2.clone(), a.clone()]),
        (false, coords) => coords.clone(),
    }
}

/// Coordinates of the extreme pairs, and of corners and edges of the box and places beside them.
fn places(form: &dyn Parametrization, extent: Extent) -> Vec<(String, Coords)> {
    let of = |case: Case| (case.name, form.forward(&case.pair));
    let mut places: Vec<_> = extent.subset(pairs(), 7).into_iter().map(of).collect();
    let axes = form.axes();
    let shares = [0.0, 1e-300, 1e-12, 0.4, 1.0 - 1e-12, 1.0];
    let count = shares.len().pow(axes.len() as u32);
    let corners = (0..count).map(|n| {
        let mut coords = [0.0; 4];
        let mut rest = n;
        for (c, axis) in coords.iter_mut().zip(axes) {
            *c = axis.range[0] + axis.length() * shares[rest % shares.len()];
            rest /= shares.len();
        }
        (format!("{:?}", &coords[..axes.len()]), coords)
    });
    places.extend(extent.subset(corners.collect(), 11));
    places
}

/// Coordinates that are off by one rounding each way, one after the other.
fn nudged(coords: &[Exact; 4]) -> impl Iterator<Item = [Exact; 4]> {
    (0..8).filter(|k| !coords[k / 2].is_zero()).map(|k| {
        let mut moved = coords.clone();
        moved[k / 2] = charts::rounded(&moved[k / 2], [1.0, -1.0][k % 2]);
        moved
    })
}

fn directions(Checked { form, chart, .. }: &Checked, extent: Extent, watch: &mut Finding) {
    let symmetry = form.symmetry();
    for (name, coords) in places(&**form, extent) {
        let got = form.inverse(&coords);
        watch.spent(1);
        let of = |coords: &[Exact; 4]| charts::inverse(chart, &absolute(chart, symmetry, coords));
        let exact = coords.map(Exact::from);
        let want = of(&exact);
        // Beyond the domain there is nothing to be near to: on its edge rounding decides.
        let (Some(got), Some(want)) = (&got, &want) else {
            continue;
        };
        let error = charts::angle(&charts::components(got), want);
        let moved = nudged(&exact).filter_map(|n| Some(charts::angle(&of(&n)?, want)));
        watch.see(error, moved.sum::<f64>() + ROUNDING, &name);
    }
}

fn jacobian(Checked { form, chart, .. }: &Checked, extent: Extent, watch: &mut Finding) {
    let symmetry = form.symmetry();
    for (name, coords) in extent.subset(places(&**form, Extent::Whole), 31) {
        let of = |coords: &[Exact; 4]| charts::jacobian(chart, &absolute(chart, symmetry, coords));
        let exact = coords.map(Exact::from);
        // On the edge of the domain there is no difference to take.
        let Some(want) = of(&exact).map(|j| j.to_f64()).filter(|&j| j > 1e-9) else {
            continue;
        };
        let got = form.jacobian(&coords);
        watch.spent(1);
        // On the edge of the domain a rounding may be all of it.
        let off = |n| of(&n).map_or(f64::INFINITY, |j| (j.to_f64() - want).abs());
        let moved: f64 = nudged(&exact).map(off).sum();
        // Where a rounding changes half of it there is no number to agree on.
        let conditioning = match moved / want + ROUNDING {
            large if large > 0.5 => f64::INFINITY,
            conditioning => conditioning,
        };
        watch.see((got - want).abs() / want, conditioning, &name);
    }
}

/// What so many roundings of its coordinates move a pair by, rad.
fn moved(form: &dyn Parametrization, pair: &DirectionPair, watch: &mut Finding) -> f64 {
    let coords = form.forward(pair);
    watch.spent(2 * form.axes().len());
    let along = |d: usize| {
        // As many as a handful of operations make: one may be lost in a sum beside a root that it would open.
        let far = [1.0, -1.0].map(|sign| {
            let mut there = coords;
            there[d] *= 1.0 + sign * 8.0 * ROUNDING;
            let there = form.inverse(&there);
            there.map_or(0.0, |there| distance(&there, pair, form.symmetry()))
        });
        f64::max(far[0], far[1])
    };
    (0..form.axes().len()).map(along).sum()
}

/// A warp bends the coordinates of a plain form: their conditioning is its own too.
fn there_and_back(Checked { form, plain, .. }: &Checked, extent: Extent, watch: &mut Finding) {
    for Case { name, pair } in extent.subset(pairs(), 3) {
        watch.spent(2);
        let Some(back) = form.inverse(&form.forward(&pair)) else {
            // What has coordinates is a pair.
            watch.see(f64::INFINITY, ROUNDING, &name);
            continue;
        };
        let mut conditioning = 4.0 * ROUNDING + moved(&**form, &back, watch);
        if form.warp_name() != "none" {
            conditioning += moved(&**plain, &back, watch);
        }
        watch.see(distance(&pair, &back, form.symmetry()), conditioning, &name);
    }
}

fn outside(Checked { form, .. }: &Checked, _: Extent, watch: &mut Finding) {
    let axes = form.axes();
    let inside = |axis: &Axis| axis.range[0] + 0.3 * axis.length();
    let middle = std::array::from_fn(|d| axes.get(d).map_or(0.0, inside));
    // Whatever is refused below is refused for one coordinate alone.
    watch.holds(form.inverse(&middle).is_some(), &"all coordinates inside");
    for (d, axis) in axes.iter().enumerate() {
        let mut values = vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        if axis.kind == AxisKind::Radial {
            values.extend([-1e-3, axis.range[1] * 1.001, 1e300, -1e300]);
        }
        for value in values {
            let mut coords = middle;
            coords[d] = value;
            let is_refused = form.inverse(&coords).is_none();
            watch.spent(1);
            watch.holds(is_refused, &format_args!("{} = {value}", axis.symbol));
        }
    }
}
