//! Estimators of moments, at every view elevation, on slices with closed forms and on ever narrower lobes.

use super::models::ALPHAS;
use super::{Check, Extent, Family, Finding, Law, ROUNDING, cases};
use crate::brdf::Brdf;
use crate::brdf::testing::made;
use crate::geometry::Symmetry;
use crate::moments::{self, Channel, Component, Estimator, Order, PeakResolving, Slice};
use crate::parametrization::view_centered_angles;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "estimators",
    summary: "moments against closed forms and narrower rules, widths 1 … 1e-6: off by no more than they state",
    checks,
};

/// An error over what is stated: 1 is a bound kept, 6 a standard error that a billion of normal ones exceed once.
const STATED: Law = Law::bounded("closed form within the stated uncertainty", "own unit", 1.0);
const RANDOM: Law = Law::bounded("closed form within six standard errors", "own unit", 6.0);
const LOBES: Law = Law::bounded(
    "energy of a lobe within both uncertainties",
    "1/sr rad²",
    1.0,
);
const FINITE: Law = Law::strict("finite, or said to be unresolved");

/// View elevations, degrees.
const VIEWS: [f64; 7] = [0.0, 1e-9, 30.0, 60.0, 85.0, 89.999, 90.0 - 1e-10];

/// ∫ exp(−t²/(2 width²)) over [−π/2, π/2] of t + centre, and ∫ t exp(…) there.
fn truncated(centre: f64, width: f64) -> [f64; 2] {
    let [a, b] = [-FRAC_PI_2 - centre, FRAC_PI_2 - centre].map(|t| t / width);
    let [x, y] = [a, b].map(|t| t * FRAC_1_SQRT_2);
    let share = match (a > 0.0, b < 0.0) {
        (true, _) => libm::erfc(x) - libm::erfc(y),
        (_, true) => libm::erfc(-y) - libm::erfc(-x),
        _ => libm::erf(y) - libm::erf(x),
    };
    let bell = |t: f64| (-0.5 * t * t).exp();
    let first = width * width * (bell(a) - bell(b));
    [width * FRAC_PI_2.sqrt() * share, first]
}

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for example in cases::examples(moments::all()) {
        let by: Arc<dyn Estimator> = Arc::from(example.member);
        let name = by.label();
        let is_bounded = name.starts_with("peak");
        let law = if is_bounded { STATED } else { RANDOM };
        for width in extent.subset(vec![1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6], 3) {
            for base in [0.0, 1e-12] {
                let by = Arc::clone(&by);
                let member = format!("{name}, width {width:e}, base {base:e}");
                checks.push(Check::new(member, law, move |watch| {
                    closed_forms(&*by, width, base, extent, watch);
                }));
            }
        }
        for alpha in extent.subset(ALPHAS[1..].to_vec(), 3) {
            let by = Arc::clone(&by);
            let member = format!("{name}, ggx {alpha}");
            checks.push(Check::new(&*member, FINITE, move |watch| {
                finite(&*by, alpha, extent, watch);
            }));
            if is_bounded {
                let run = move |watch: &mut Finding| lobes(alpha, extent, watch);
                checks.push(Check::new(member, LOBES, run));
            }
        }
    }
    checks
}

/// The slice of a view, which every material has.
fn slice<'a>(brdf: &'a dyn Brdf, degrees: f64, watch: &mut Finding) -> Option<Slice<'a>> {
    let slice = Slice::new(brdf, Channel::Luminance, degrees.to_radians());
    if slice.is_err() {
        watch.holds(false, &degrees);
    }
    slice.ok()
}

/// Gaussians of two widths about the mirror direction of a view, on a constant.
fn closed_forms(by: &dyn Estimator, width: f64, base: f64, extent: Extent, watch: &mut Finding) {
    for degrees in extent.subset(VIEWS.to_vec(), 2) {
        let (centre, [wide, high]) = (-degrees.to_radians(), [width, 2.0 * width]);
        let brdf = made(Symmetry::NONE, |pair| {
            let [theta, phi] = view_centered_angles(pair.omega_i);
            let (x, y) = ((theta - centre) / wide, phi / high);
            Some([base + (-0.5 * (x * x + y * y)).exp()])
        });
        let Some(slice) = slice(&brdf, degrees, watch) else {
            continue;
        };
        let got = by.estimate(&slice, Order::MAX, 1);
        watch.spent(got.evaluations);
        // A result that is marked as unresolved is no violation.
        if got.unresolved.is_some() {
            watch.holds(true, &format_args!("{degrees}°, unresolved"));
            continue;
        }
        let [x, first] = truncated(centre, wide);
        let [y, _] = truncated(0.0, high);
        let energy = base * PI * PI + x * y;
        // The constant has its mean at 0.
        let mean = (centre * x + first) * y / energy;
        let components = [
            (Component::ENERGY, energy, energy),
            (Component { n: 1, m: 0 }, mean, width),
        ];
        for (c, want, size) in components {
            let Some(e) = got.moments.get(c) else {
                watch.holds(false, &format_args!("{c} at {degrees}°"));
                continue;
            };
            // Closed forms lose a digit or two where the lobe is wider than the square.
            let conditioning = e.uncertainty + 200.0 * ROUNDING * size.max(want.abs());
            let error = (e.value - want).abs();
            watch.see(error, conditioning, &format_args!("{c} at {degrees}°"));
        }
    }
}

fn material(alpha: &str) -> Option<Box<dyn Brdf>> {
    cases::material(&format!("kind = \"ggx\"\nalpha = {alpha}"))
}

fn finite(by: &dyn Estimator, alpha: &str, extent: Extent, watch: &mut Finding) {
    let Some(brdf) = material(alpha) else {
        return;
    };
    for degrees in extent.subset(VIEWS.to_vec(), 2) {
        let Some(slice) = slice(&*brdf, degrees, watch) else {
            continue;
        };
        let got = by.estimate(&slice, Order::MAX, 1);
        watch.spent(got.evaluations);
        for c in Component::ALL {
            // A moment that is undefined is not there.
            let holds = got.moments.get(c).is_none_or(|e| {
                let is_known = e.uncertainty.is_finite() || got.unresolved.is_some();
                e.value.is_finite() && e.uncertainty >= 0.0 && is_known
            });
            watch.holds(holds, &format_args!("{c} at {degrees}°"));
        }
    }
}

/// The default tolerance and one a thousand times less, which takes other nodes.
fn lobes(alpha: &str, extent: Extent, watch: &mut Finding) {
    let Some(brdf) = material(alpha) else {
        return;
    };
    let by = PeakResolving::default();
    let finer = PeakResolving {
        tolerance: 1e-3 * by.tolerance,
        ..by
    };
    for degrees in extent.subset(VIEWS.to_vec(), 2) {
        let Some(slice) = slice(&*brdf, degrees, watch) else {
            continue;
        };
        let order = Order::new(0).unwrap_or_default();
        let [got, want] = [&by, &finer].map(|by| by.estimate(&slice, order, 1));
        watch.spent(got.evaluations + want.evaluations);
        let energies = [&got, &want].map(|found| found.moments.get(Component::ENERGY));
        if let [Some(a), Some(b)] = energies {
            let conditioning = a.uncertainty + b.uncertainty + ROUNDING * b.value;
            let error = (a.value - b.value).abs();
            watch.see(error, conditioning, &format_args!("{degrees}°"));
        }
    }
}
