//! Reconstructions run smoothly across folds and poles.

use super::common::{ISOTROPIC, Level, at as in_box, levels, made, mirrored, near, turned};
use super::{
    each, form, forms, grid, material, measure, method, methods, radial, smooth, smooth_material,
    some_symmetries, value,
};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::{AxisKind, Parametrization};
use gonio::sampling::Random;
use gonio::schedule::{Centring, Grid, SobolSet};

levels! {
    a_small_step_across_a_fold_or_a_pole_is_a_small_change: "thorough: every method in every coordinates";
    poles_are_as_good_as_any_other_place: "thorough: every symmetry in every coordinates";
}

/// The pair turned about the normal, with light and sensor exchanged, and mirrored.
pub fn moved(pair: &DirectionPair, turn: f64) -> [DirectionPair; 3] {
    [turned(pair, turn), pair.swapped(), mirrored(pair)]
}

/// A random configuration, up to some share of every axis, one of whose coordinates is replaced; `None` if it is not physical.
fn pair_at(
    form: &dyn Parametrization,
    share: f64,
    u: [f64; 4],
    at: usize,
    coordinate: f64,
) -> Option<DirectionPair> {
    let mut c = in_box(form, u.map(|u| 0.1 + share * u));
    c[at] = coordinate;
    let pair = form.inverse(&form.canonical(&c)?)?;
    pair.is_above_horizon().then_some(pair)
}

fn a_small_step_across_a_fold_or_a_pole_is_a_small_change(level: Level) {
    const STEP: f64 = 1e-7;
    let random = Random::new(3);
    let truth = |s| Box::new(smooth_material(s)) as _;
    let forms = forms(&some_symmetries());
    // Nearest is a step function, and a neighbourhood that is cut off at k may lose one neighbour to another in any
    // step.
    let mut methods = methods();
    methods.retain(|method| method.needs_grid());
    each(
        level,
        &methods,
        &forms,
        truth,
        600,
        |what, method, m, brdf| {
            let form = &*m.schedule.parametrization;
            let symmetry = form.symmetry();
            let warped = form.warp_name() != "none";
            if form.facts().exchange && symmetry.isotropic && symmetry.reciprocal && warped {
                // Light and sensor have different steps, and an exchange leads from one lattice to the
                // other: their interpolants agree no better than to their error.
                return;
            }
            for (d, axis) in form.axes().iter().enumerate() {
                let ends = match axis.kind {
                    AxisKind::Radial => vec![0.0],
                    _ => axis.range.to_vec(),
                };
                for (end, i) in ends.into_iter().flat_map(|e| (0..60).map(move |i| (e, i))) {
                    let u = random.point(i);
                    let step = STEP * axis.length();
                    let sides = [end - step, end + step].map(|c| pair_at(form, 0.9, u, d, c));
                    if let [Some(a), Some(b)] = sides {
                        let (f, g) = (value(brdf, &a), value(brdf, &b));
                        // Slopes are below 10 per axis length; lengths may be roots; and of what the
                        // spline's natural ends do, 0.27^8 = 3e-5 is left.
                        let cubic = method.label().starts_with("cubic");
                        let allowed = match (form.facts().squared, cubic) {
                            (true, _) => 2e-2,
                            (_, true) => 5e-5,
                            (_, false) => 1e-5,
                        };
                        near(f, g, allowed, (what, end, axis.symbol));
                    }
                }
            }
        },
    );
}

/// Mean error near the first and second pole, and anywhere.
fn errors(brdf: &dyn gonio::brdf::Brdf, form: &dyn Parametrization) -> [f64; 3] {
    let random = Random::new(4);
    let radial = radial(form);
    let mut sums = [[0.0; 2]; 3];
    for i in 0..2000 {
        let u: [f64; 4] = random.point(i);
        let v: [f64; 4] = random.point(i + 10_000);
        for (j, sum) in sums.iter_mut().enumerate() {
            // Stark's second coordinate is a square: 0.02 of it is 0.14 of the length.
            let (d, share) = match j {
                0 | 1 => (radial[j], 0.02 * v[0]),
                _ => (radial[0], 0.2 + 0.5 * v[0]),
            };
            let coordinate = share * form.axes()[d].length();
            let low = |p: &DirectionPair| p.omega_i.theta() < 1.2 && p.omega_o.theta() < 1.2;
            if let Some(pair) = pair_at(form, 0.6, u, d, coordinate).filter(low) {
                sum[0] += (value(brdf, &pair) - smooth(form.symmetry(), &pair)).abs();
                sum[1] += 1.0;
            }
        }
    }
    sums.map(|[sum, n]| {
        assert!(n > 100.0);
        sum / n
    })
}

fn poles_are_as_good_as_any_other_place(level: Level) {
    // A continuation through a pole to the wrong azimuth, or azimuths that lose their meaning at
    // it, mix readings of different configurations: errors of the size of the function's
    // asymmetry, 0.1, where they are 1e-2 to 1e-4 elsewhere.
    let mut symmetries = some_symmetries();
    symmetries.retain(|s| level == Level::Thorough || s.isotropic);
    for symmetry in symmetries {
        let budget = match symmetry.isotropic {
            true => level.of(1500, 3000),
            false => 20_000,
        };
        for name in ["half-difference", "spherical", "hybrid", "orthographic"] {
            let form = form(name, symmetry);
            let truth = smooth_material(symmetry);
            let grid = measure(&truth, &form, &Grid::default(), budget);
            let sobol = measure(&truth, &form, &SobolSet {}, budget);
            for (kind, m) in [
                ("multilinear", &grid),
                ("cubic", &grid),
                ("inverse-distance", &sobol),
                ("thin-plate", &sobol),
            ] {
                let brdf = method(kind, "values = \"linear\"").reconstruct(m).unwrap();
                let [first, second, anywhere] = errors(&*brdf, &*form);
                // Measured at most 2.8 times that, where a cell around a pole is short along the
                // axis but spans half a turn.
                let errors = format!("{first:.1e} {second:.1e} {anywhere:.1e}");
                let is_as_good = first.max(second) < 4.0 * anywhere;
                assert!(is_as_good, "{kind} in {name} {symmetry:?}: {errors}");
            }
        }
    }
}

/// A grid with nodes at the first pole.
fn from_the_pole() -> Grid {
    grid(&[], &[Centring::Start, Centring::Cell, Centring::Cell])
}

#[test]
fn readings_at_the_first_pole_speak_for_every_azimuth() {
    // A narrow lobe on a grid with nodes at theta_h = 0: right beside it, between the nodes of
    // theta_d and phi_d, the peak is 1. A pole that stands at one azimuth only leaves the next row
    // to the others: 0.3 there by inverse distance, 1.6 by the spline.
    let narrow = material(Symmetry::FULL, |pair| {
        let h = pair.half();
        (-400.0 * h.truncate().length_squared() / h.length_squared()).exp()
    });
    let form = form("half-difference", Symmetry::FULL);
    let measurement = measure(&narrow, &form, &from_the_pole(), 4000);
    for (kind, allowed) in [("inverse-distance", 0.1), ("thin-plate", 0.02)] {
        let brdf = method(kind, "").reconstruct(&measurement).unwrap();
        for i in 0..=20 {
            let phi_d = f64::from(i) / 20.0 * std::f64::consts::FRAC_PI_2;
            let f = value(&*brdf, &form.inverse(&[1e-4, 0.6, phi_d, 0.0]).unwrap());
            assert!((f - 1.0).abs() < allowed, "{kind} {phi_d}: {f}");
        }
    }
}

#[test]
fn a_pole_without_data_is_one_place() {
    // Its nodes continue the readings around it together: one value, whatever the azimuth.
    let material = made(ISOTROPIC, |pair| {
        let h = pair.half();
        let off_peak = h.truncate().length() > 0.01 * h.length();
        off_peak.then(|| [smooth(ISOTROPIC, pair)])
    });
    let form = form("half-difference", ISOTROPIC);
    let m = measure(&material, &form, &from_the_pole(), 2000);
    assert!(m.no_data() > 5);
    for kind in ["nearest", "multilinear", "cubic"] {
        let brdf = method(kind, "").reconstruct(&m).unwrap();
        for theta_d in [0.2, 0.7, 1.1] {
            let at = |phi_d| value(&*brdf, &form.inverse(&[1e-9, theta_d, phi_d, 0.0]).unwrap());
            let first = at(-3.0);
            for i in -2..=3 {
                let error = (at(f64::from(i)) / first - 1.0).abs();
                assert!(error < 1e-6, "{kind} {theta_d} {i}: {error:e}");
            }
        }
    }
}

#[test]
fn a_grid_with_its_own_ratio_and_centring_folds_onto_itself() {
    // Light and sensor at different steps; nodes at both ends of the azimuth.
    let form = form("spherical", Symmetry::FULL);
    let truth = smooth_material(Symmetry::FULL);
    for ratio in [[1.0, 1.0, 2.0], [2.0, 1.0, 2.0], [1.0, 3.0, 2.0]] {
        for centring in [Centring::Cell, Centring::Node] {
            let grid = grid(&ratio, &[Centring::Cell, Centring::Cell, centring]);
            let measurement = measure(&truth, &form, &grid, 2000);
            let brdf = method("cubic", "").reconstruct(&measurement).unwrap();
            let [first, second, anywhere] = errors(&*brdf, &*form);
            // Measured at most 1.0e-5; rounding an exchanged node to the nearest costs 1e-2.
            let worst = first.max(second).max(anywhere);
            assert!(worst < 3e-5, "{ratio:?} {centring:?}: {worst:e}");
        }
    }
}
