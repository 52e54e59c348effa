//! Where reconstructions may go wrong: the horizon, extreme values, missing data, few readings.

use super::common::{
    Level, edge_pairs, levels, lowest, made, model, near, random_pairs, says, table,
};
use super::{
    each, errors_on_nodes, form, forms, grid, measure, method, methods, methods_on, missed, smooth,
    smooth_material, some_symmetries, value, walk,
};
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::error::ParameterError;
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::measurement::{Measurement, Outcome};
use gonio::parametrization::AxisKind;
use gonio::reconstruct::ReconstructError;
use gonio::sampling::Random;
use gonio::schedule::{Centring, Grid, SampleSet, SobolSet};
use std::f64::consts::FRAC_PI_2;

levels! {
    values_are_finite_and_constants_stay_constant: "thorough: every method in every coordinates";
    readings_of_narrow_lobes_are_met: "thorough: every method in every coordinates";
    poses_without_data_are_left_out: "thorough: every method in every coordinates";
}

/// The edge table, random pairs, and pairs a hair above the horizon.
fn pairs() -> Vec<DirectionPair> {
    let random = Random::new(1);
    let mut pairs: Vec<_> = edge_pairs().into_iter().map(|(_, p)| p).collect();
    pairs.extend(random_pairs(1).take(100));
    for i in 0..50 {
        let [a, b, c, d]: [f64; 4] = random.point(1000 + i);
        let grazing = |u: f64| FRAC_PI_2 - 10f64.powf(-15.0 * u - 0.3);
        let theta_o = if i % 2 == 0 { grazing(b) } else { 1.5 * b };
        let [phi_i, phi_o] = [6.0 * c, 6.0 * d];
        let pair = DirectionPair::from_spherical(grazing(a), phi_i, theta_o, phi_o);
        pairs.push(pair);
    }
    pairs
}

fn check_range(what: &str, brdf: &dyn Brdf, pairs: &[DirectionPair]) {
    for pair in pairs {
        let f = value(brdf, pair);
        assert!(f >= 0.0 && f.is_finite(), "{what} {pair:?}: {f}");
        if !pair.is_above_horizon() {
            assert_eq!(f, 0.0, "{what} {pair:?}");
        }
    }
}

fn values_are_finite_and_constants_stay_constant(level: Level) {
    let pairs: Vec<_> = pairs().into_iter().step_by(level.of(5, 2)).collect();
    let mut lit = pairs.clone();
    lit.retain(DirectionPair::is_above_horizon);
    let below = DirectionPair::from_spherical(1.7, 0.3, 0.3, 0.1);
    let step = |pair: &DirectionPair| if pair.half().z > 0.9 { 1e12 } else { 0.0 };
    // Other constants, from one reading on, are those of `gonio stability`.
    for constant in [Some(0.2), None] {
        let f = move |pair: &DirectionPair| constant.unwrap_or_else(|| step(pair));
        let truth = |s| Box::new(super::material(s, f)) as Box<dyn Brdf>;
        let (all, budget) = (some_symmetries(), level.of(80, 200));
        walk(level, &all, truth, budget, |what, _, _, brdf| {
            check_range(what, brdf, &pairs);
            for pair in [below, below.swapped()] {
                assert_eq!(value(brdf, &pair), 0.0, "{what}");
            }
            for pair in lit.iter().filter(|_| constant.is_some()) {
                near(value(brdf, pair), 0.2, 2e-13, (what, pair));
            }
        });
    }
}

fn readings_of_narrow_lobes_are_met(level: Level) {
    // Nine decades between neighbours: rounding is relative to the largest of them in linear
    // values, and to f + epsilon in logarithms.
    let pairs = pairs();
    let truth = |_| model("ggx", "alpha = 0.003");
    let mut methods = methods();
    methods.retain(|method| !method.label().starts_with("kriging"));
    let forms = forms(&[Symmetry::FULL]);
    each(
        level,
        &methods,
        &forms,
        truth,
        1000,
        |what, method, m, brdf| {
            check_range(what, brdf, &pairs);
            let peak = m.values.iter().fold(0.0, |a: f64, &b| a.max(b));
            let linear = method.label().ends_with("-linear") || method.label() == "nearest";
            for (pose, reading, error) in errors_on_nodes(m, brdf) {
                let scale = if linear { peak } else { reading + 1e-3 };
                // Measured 3e-11, where a reading and its image beyond the pole nearly touch.
                assert!(error < 1e-9 * scale, "{what} {:?}: {error:e}", pose.coords);
            }
        },
    );
}

/// A smooth material without data where the light is low on one side.
fn with_hole(symmetry: Symmetry) -> Box<dyn Brdf> {
    Box::new(made(symmetry, move |pair| {
        let hole = lowest(pair) < 0.6 && pair.half().z > 0.5;
        (!hole).then(|| [smooth(symmetry, pair)])
    }))
}

fn poses_without_data_are_left_out(level: Level) {
    let (pairs, all) = (pairs(), some_symmetries());
    walk(level, &all, with_hole, 400, |what, method, m, brdf| {
        let counts = [m.readings(), m.no_data()];
        assert!(counts.iter().all(|n| *n > 20), "{what}: {counts:?}");
        check_range(what, brdf, &pairs);
        let truth = with_hole(brdf.symmetry());
        for (i, pose) in m.schedule.poses.iter().enumerate() {
            let (f, at) = (value(brdf, &pose.pair), pose.coords);
            // Continued from values in [0.2, 2], never from the NaN that was not measured.
            assert!((0.0..4.0).contains(&f), "{what} {at:?}: {f}");
            assert_eq!(m.value(i).is_some(), truth.luminance(&pose.pair).is_some());
        }
        for (pose, reading, error) in errors_on_nodes(m, brdf) {
            let allowed = missed(method, m).max(1e-7) * reading;
            assert!(error < allowed, "{what} {:?}: {error:e}", pose.coords);
        }
    });
}

/// A measurement in which only the first `readings` poses have data.
fn with_readings(set: &dyn SampleSet, budget: usize, readings: usize) -> Measurement {
    let lambert = model("lambert", "albedo = 0.5");
    let form = form("half-difference", Symmetry::FULL);
    let mut m = measure(&*lambert, &form, set, budget);
    for (i, outcome) in m.outcomes.iter_mut().enumerate().skip(readings) {
        *outcome = Outcome::NoData;
        m.values[i] = f64::NAN;
    }
    m
}

/// That one is enough is a law of `gonio stability`, `readings that are equal`.
#[test]
fn no_reading_is_refused() {
    for set in super::sets() {
        for method in methods_on(&*set) {
            let refused = method.reconstruct(&with_readings(&*set, 100, 0)).err();
            let label = method.label();
            let is_told = match &refused {
                Some(ReconstructError::TooFew { method, .. }) => label.starts_with(method),
                _ => false,
            };
            let text = refused.map_or(String::new(), |e| format!("{e:?}"));
            assert!(is_told, "{label}: {text}");
            says(&text, "readings: 0, needed: 1");
        }
    }
}

#[test]
fn other_sets_and_materials_than_those_of_a_method_are_refused() {
    let m = with_readings(&SobolSet {}, 100, 100);
    for kind in ["multilinear", "cubic"] {
        let method = method(kind, "");
        assert!(method.needs_grid());
        let Err(e) = method.reconstruct(&m) else {
            panic!("{kind} made something of a Sobol set")
        };
        let (method, sample_set) = (kind, "sobol".to_owned());
        assert_eq!(e, ReconstructError::NoGrid { method, sample_set });
        assert!(e.to_string().contains("grid") && e.to_string().contains("sobol"));
    }
    let brushed = Symmetry::ORTHOTROPIC;
    let form = form("half-difference", brushed);
    let m = measure(&smooth_material(brushed), &form, &SobolSet {}, 20);
    let refused = method("components", "").reconstruct(&m).err();
    let method = "components";
    assert_eq!(refused, Some(ReconstructError::Symmetry { method }));
}

#[test]
fn wrong_keys_are_named() {
    let wrong = table(
        r#"
        nearest inverse-distance thin-plate | coordinates = { kind = "hybird" } | coordinates.kind
        nearest inverse-distance thin-plate | coordinates = { kind = "half-difference", warp = { theta_x = "merl" } } | coordinates.warp.theta_x
        nearest inverse-distance thin-plate | coordinates = { kind = "half-difference", warp = { theta_d = "merl" } } | coordinates.warp.theta_d
        nearest inverse-distance thin-plate kriging | coordinates = { kind = "half-difference", warp = { phi_d = "square-root" } } | coordinates.warp.phi_d
        inverse-distance | power = 0.0 | power
        inverse-distance | neighbours = 0 | neighbours
        thin-plate | neighbours = 5 | neighbours
        thin-plate | neighbours = 257 | neighbours"#,
    );
    let wrong = wrong.map(|[kinds, keys, key]| (kinds, keys.to_owned(), key));
    let numbers = ["0.0", "-1.0", "nan", "inf"].into_iter().flat_map(|value| {
        [
            ("nearest inverse-distance thin-plate", "stretch"),
            ("multilinear cubic inverse-distance thin-plate", "epsilon"),
            ("components", "ridge"),
        ]
        .map(|(kinds, key)| (kinds, format!("{key} = {value}"), key))
    });
    let m = with_readings(&Grid::default(), 100, 100);
    for (kinds, keys, key) in wrong.chain(numbers) {
        for kind in kinds.split(' ') {
            let method = method(kind, &keys);
            let error: ParameterError = method.check().unwrap_err();
            assert_eq!(error.key, key, "{kind} {keys}");
            // Without the check the refusal is the same.
            let again = method.reconstruct(&m).err();
            let same = Some(ReconstructError::Parameter(error));
            assert_eq!(again, same, "{kind} {keys}");
        }
    }
}

#[test]
fn a_start_on_an_azimuth_is_refused() {
    // Nodes half a cell short of one end only: neither a period nor a mirror maps them to nodes.
    for symmetry in some_symmetries() {
        let form = form("half-difference", symmetry);
        for (d, axis) in form.axes().iter().enumerate() {
            let mut centring = vec![Centring::Cell; form.axes().len()];
            centring[d] = Centring::Start;
            match grid(&[], &centring).plan(&form, 1000, 1) {
                Ok(_) => assert_eq!(axis.kind, AxisKind::Radial),
                Err(e) => {
                    assert_ne!(axis.kind, AxisKind::Radial);
                    assert!(e.to_string().starts_with("centring"), "{e}");
                    assert!(e.to_string().contains("theta_h, theta_d"), "{e}");
                }
            }
        }
    }
}

/// Those of scattered readings are in `tests/channels.rs`.
#[test]
fn channels_of_a_grid_are_reconstructed_one_by_one() {
    let symmetry = Symmetry::FULL;
    let parts: [fn(f64) -> f64; 3] = [|f| f, |f| 3.0 - f, |f| f];
    let rgb = made(symmetry, |pair| {
        Some(parts.map(|part| part(smooth(symmetry, pair))))
    });
    let form = form("half-difference", symmetry);
    for kind in ["multilinear", "cubic"] {
        let of = |brdf: &dyn Brdf| {
            let m = measure(brdf, &form, &Grid::default(), 1000);
            method(kind, "").reconstruct(&m).unwrap()
        };
        let all = of(&rgb);
        assert_eq!(*all.channels(), Channels::Rgb);
        for (c, part) in parts.into_iter().enumerate() {
            let of_part = move |pair: &DirectionPair| part(smooth(symmetry, pair));
            let alone = of(&super::material(symmetry, of_part));
            for pair in random_pairs(2).take(300) {
                let mut out = [0.0; 3];
                assert_eq!(all.eval(&pair, &mut out), Presence::Present);
                // The same sums in the same order; a compiler may fuse them differently.
                let error = (out[c] - value(&*alone, &pair)).abs();
                assert!(error < 1e-14, "{kind} {c} {error:e}");
            }
        }
    }
}

#[test]
fn batches_and_threads_change_no_bit() {
    // More than one block of a batch, and a remainder.
    let mut pairs: Vec<_> = random_pairs(3).take(300).collect();
    pairs[17] = DirectionPair::new(Direction::from_spherical(2.0, 0.0), Direction::NORMAL);
    let grey = smooth_material(Symmetry::FULL);
    let rgb = made(Symmetry::ORTHOTROPIC, |pair| {
        let f = smooth(Symmetry::ORTHOTROPIC, pair);
        Some([f, f * f, 3.0 - f])
    });
    let run = |threads: usize| {
        let mut bits = Vec::new();
        crate::common::on_threads(threads, || {
            for truth in [&grey as &dyn Brdf, &rgb] {
                let n = truth.channels().count();
                let form = form("half-difference", truth.symmetry());
                for set in super::sets() {
                    let m = measure(truth, &form, &*set, 250);
                    for method in methods_on(&*set) {
                        let brdf = method.reconstruct(&m).unwrap();
                        let mut batch = vec![f64::NAN; pairs.len() * n];
                        let mut presence = vec![Presence::Missing; pairs.len()];
                        brdf.eval_batch(&pairs, &mut batch, &mut presence);
                        assert!(presence.iter().all(|p| *p == Presence::Present));
                        for (pair, batch) in pairs.iter().zip(batch.chunks(n)) {
                            let mut one = vec![f64::NAN; n];
                            assert_eq!(brdf.eval(pair, &mut one), Presence::Present);
                            assert_eq!(one, batch, "{}", method.label());
                        }
                        bits.extend(batch.iter().map(|f| f.to_bits()));
                    }
                }
            }
        });
        bits
    };
    assert_eq!(run(1), run(2));
}
