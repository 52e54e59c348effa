//! Where reconstructions may go wrong: the horizon, extreme values, missing data, few readings.

use super::common::{Level, edge_pairs, levels, model, random_pair};
use super::{
    Material, each, form, forms, measure, method, methods, missed, on_node, smooth,
    some_symmetries, value,
};
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::error::ParameterError;
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::{Measurement, Outcome};
use gonio::parametrization::{self, AxisKind};
use gonio::reconstruct::{self, ReconstructError};
use gonio::registry;
use gonio::sampling::Random;
use gonio::schedule::{Centring, Grid, SampleSet, SobolSet};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

levels! {
    values_are_finite_and_not_negative_for_extreme_materials: "thorough: every method in every coordinates";
    values_are_finite_and_not_negative_for_a_mirror: "thorough: every method in every coordinates";
    poses_without_data_are_left_out: "thorough: every method in every coordinates";
}

/// The edge table, random pairs, and pairs a hair above the horizon.
fn pairs() -> Vec<DirectionPair> {
    let random = Random::new(1);
    let mut pairs: Vec<_> = edge_pairs().into_iter().map(|(_, p)| p).collect();
    pairs.extend((0..100).map(|i| random_pair(&random, i)));
    for i in 0..50 {
        let [a, b, c, d]: [f64; 4] = random.point(1000 + i);
        let grazing = |u: f64| FRAC_PI_2 - 10f64.powf(-15.0 * u - 0.3);
        let theta_o = if i % 2 == 0 { grazing(b) } else { 1.5 * b };
        pairs.push(DirectionPair::from_spherical(
            grazing(a),
            6.0 * c,
            theta_o,
            6.0 * d,
        ));
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

fn values_are_finite_and_not_negative_for_extreme_materials(level: Level) {
    let pairs: Vec<_> = pairs().into_iter().step_by(5).collect();
    let below = DirectionPair::new(
        Direction::from_spherical(1.7, 0.3),
        Direction::from_spherical(0.3, 0.1),
    );
    let step = |pair: &DirectionPair| if pair.half().z > 0.9 { 1e12 } else { 0.0 };
    let materials: [fn(&DirectionPair) -> f64; 3] = [|_| 0.0, |_| 1e12, step];
    for (i, f) in materials.into_iter().enumerate() {
        let truth = |s| Box::new(super::material(s, f)) as Box<dyn Brdf>;
        each(
            level,
            &methods(),
            &forms(&some_symmetries()),
            truth,
            200,
            |what, _, _, brdf| {
                check_range(what, brdf, &pairs);
                assert_eq!(value(brdf, &below), 0.0, "{what}");
                assert_eq!(value(brdf, &below.swapped()), 0.0, "{what}");
                let constant = [0.0, 1e12].get(i).copied();
                for pair in pairs.iter().filter(|p| p.is_above_horizon()) {
                    if let Some(constant) = constant {
                        let error = (value(brdf, pair) - constant).abs();
                        assert!(error <= 1e-11 * constant + 1e-15, "{what} {error:e}");
                    }
                }
            },
        );
    }
}

fn values_are_finite_and_not_negative_for_a_mirror(level: Level) {
    let pairs = pairs();
    for (symmetry, text) in [
        (Symmetry::FULL, "alpha = 1e-4"),
        (Symmetry::ORTHOTROPIC, "alpha = [1e-4, 2e-3]"),
    ] {
        let truth = |_| model("ggx", text);
        each(
            level,
            &methods(),
            &forms(&[symmetry]),
            truth,
            1000,
            |what, _, _, brdf| {
                check_range(what, brdf, &pairs);
            },
        );
    }
}

/// A smooth material without data where the light is low on one side.
fn with_hole(symmetry: Symmetry) -> Box<dyn Brdf> {
    Box::new(Material {
        symmetry,
        channels: Channels::Luminance,
        f: move |pair: &DirectionPair| {
            let lowest = pair.omega_i.cos_theta().min(pair.omega_o.cos_theta());
            let hole = lowest < 0.6 && pair.half().z > 0.5;
            (!hole).then(|| [smooth(symmetry, pair); 3])
        },
    })
}

fn poses_without_data_are_left_out(level: Level) {
    let pairs = pairs();
    each(
        level,
        &methods(),
        &forms(&some_symmetries()),
        with_hole,
        400,
        |what, method, m, brdf| {
            let (readings, missing) = (m.readings(), m.no_data());
            assert!(
                readings > 20 && missing > 20,
                "{what}: {readings} {missing}"
            );
            check_range(what, brdf, &pairs);
            let truth = with_hole(brdf.symmetry());
            for (i, pose) in m.schedule.poses.iter().enumerate() {
                let f = value(brdf, &pose.pair);
                // Continued from values in [0.2, 2], never from the NaN that was not measured.
                assert!((0.0..4.0).contains(&f), "{what} {:?}: {f}", pose.coords);
                assert_eq!(m.value(i).is_some(), truth.luminance(&pose.pair).is_some());
                if let Some(reading) = m.value(i).filter(|_| on_node(m, i)) {
                    let error = (f / reading[0] - 1.0).abs();
                    assert!(
                        error < missed(method, m).max(1e-7),
                        "{what} {:?}: {error:e}",
                        pose.coords
                    );
                }
            }
        },
    );
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

#[test]
fn too_few_readings_are_refused_and_just_enough_are_not() {
    let pairs = pairs();
    let sets: [&dyn SampleSet; 2] = [&Grid::default(), &SobolSet {}];
    for set in sets {
        for method in methods() {
            if method.needs_grid() && !set.is_grid() {
                continue;
            }
            let label = method.label();
            let needed = 1;
            for readings in [0, 1, 5, 6] {
                let m = with_readings(set, 100, readings);
                match method.reconstruct(&m) {
                    Ok(brdf) => {
                        assert!(readings >= needed, "{label} {readings}");
                        check_range(&label, &*brdf, &pairs);
                        for pair in pairs.iter().filter(|p| p.is_above_horizon()) {
                            let f = value(&*brdf, pair);
                            let error = (f * std::f64::consts::PI / 0.5 - 1.0).abs();
                            assert!(error < 1e-9, "{label} {readings}: {error:e}");
                        }
                    }
                    Err(ReconstructError::TooFew {
                        method,
                        readings: found,
                        needed: asked,
                    }) => {
                        assert!(readings < needed, "{label} {readings}");
                        assert!(label.starts_with(method));
                        assert_eq!((found, asked), (readings, needed), "{label}");
                    }
                    Err(e) => panic!("{label} {readings}: {e}"),
                }
            }
        }
    }
}

#[test]
fn one_pose_makes_a_constant() {
    let pairs = pairs();
    let truth = |s| Box::new(super::smooth_material(s)) as Box<dyn Brdf>;
    let mut grids = 0;
    for form in forms(&some_symmetries()) {
        for method in methods() {
            if method.label().starts_with("thin-plate") {
                continue;
            }
            // The smallest grid of a full turn has two nodes around it.
            let Ok(schedule) = Grid::default().plan(&form, 1, 1) else {
                continue;
            };
            grids += 1;
            let m = Ideal.measure(&*truth(form.symmetry()), &Arc::new(schedule));
            let brdf = method.reconstruct(&m).unwrap();
            for pair in pairs.iter().filter(|p| p.is_above_horizon()) {
                let error = (value(&*brdf, pair) / m.values[0] - 1.0).abs();
                assert!(
                    error < 1e-12,
                    "{} {} {error:e}",
                    form.name(),
                    method.label()
                );
            }
        }
    }
    assert!(grids > 50);
}

#[test]
fn grid_methods_refuse_other_sets() {
    let m = with_readings(&SobolSet {}, 100, 100);
    for kind in ["multilinear", "cubic"] {
        let method = method(kind, "");
        assert!(method.needs_grid());
        let Err(e) = method.reconstruct(&m) else {
            panic!("{kind} made something of a Sobol set")
        };
        let sample_set = "sobol".to_owned();
        assert_eq!(
            e,
            ReconstructError::NoGrid {
                method: kind,
                sample_set
            }
        );
        assert!(e.to_string().contains("grid") && e.to_string().contains("sobol"));
    }
}

#[test]
fn wrong_keys_are_named() {
    let key = |kind: &str, text: &str| {
        let method = method(kind, text);
        let error: ParameterError = method.check().unwrap_err();
        let m = with_readings(&Grid::default(), 100, 100);
        // Whoever skips the check is told the same.
        let Err(again) = method.reconstruct(&m) else {
            panic!("{kind} accepted {text}")
        };
        assert_eq!(again, ReconstructError::Parameter(error.clone()));
        error.key
    };
    for kind in ["nearest", "inverse-distance", "thin-plate"] {
        assert_eq!(
            key(kind, "coordinates = { kind = \"hybird\" }"),
            "coordinates.kind"
        );
        let warp = |axis: &str, warp: &str| {
            key(
                kind,
                &format!(
                    "coordinates = {{ kind = \"half-difference\", warp = {{ {axis} = \"{warp}\" }} }}"
                ),
            )
        };
        assert_eq!(warp("theta_x", "merl"), "coordinates.warp.theta_x");
        assert_eq!(warp("theta_d", "merl"), "coordinates.warp.theta_d");
        assert_eq!(warp("phi_d", "square-root"), "coordinates.warp.phi_d");
        for value in ["0.0", "-1.0", "nan", "inf"] {
            assert_eq!(key(kind, &format!("stretch = {value}")), "stretch");
        }
    }
    for kind in ["multilinear", "cubic", "inverse-distance", "thin-plate"] {
        for value in ["0.0", "-1.0", "nan", "inf"] {
            assert_eq!(key(kind, &format!("epsilon = {value}")), "epsilon");
        }
    }
    assert_eq!(key("inverse-distance", "power = 0.0"), "power");
    assert_eq!(key("inverse-distance", "neighbours = 0"), "neighbours");
    assert_eq!(key("thin-plate", "neighbours = 5"), "neighbours");
    assert_eq!(key("thin-plate", "neighbours = 257"), "neighbours");
}

#[test]
fn a_start_on_an_azimuth_is_refused() {
    // Nodes half a cell short of one end only: neither a period nor a mirror maps them to nodes.
    for symmetry in some_symmetries() {
        let form = form("half-difference", symmetry);
        for (d, axis) in form.axes().iter().enumerate() {
            let mut centring = vec![Centring::Cell; form.axes().len()];
            centring[d] = Centring::Start;
            let grid = Grid {
                ratio: None,
                centring: Some(centring),
                ..Grid::default()
            };
            match grid.plan(&form, 1000, 1) {
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

#[test]
fn channels_are_reconstructed_one_by_one() {
    let random = Random::new(2);
    let symmetry = Symmetry::FULL;
    let f = move |pair: &DirectionPair| {
        let f = smooth(symmetry, pair);
        Some([f, 3.0 - f, f])
    };
    let rgb = Material {
        symmetry,
        channels: Channels::Rgb,
        f,
    };
    let first = Material {
        symmetry,
        channels: Channels::Luminance,
        f,
    };
    let second = super::material(symmetry, move |pair| 3.0 - smooth(symmetry, pair));
    let form = form("half-difference", symmetry);
    let kriging = reconstruct::all();
    let kriging = kriging.iter().find(|e| e.kind == "kriging").unwrap();
    let examples = kriging.examples.iter();
    // So few that a prior counts.
    let few = examples.map(|keys| (registry::read_text(kriging, keys).unwrap(), 20));
    let tried: Vec<_> = methods()
        .into_iter()
        .map(|m| (m, 1000))
        .chain(few)
        .collect();
    for set in super::sets() {
        for (method, budget) in &tried {
            // Weights that are of all channels together are not those of one.
            if method.needs_grid() && !set.is_grid() || method.weighs_readings() {
                continue;
            }
            let of = |brdf: &dyn Brdf| {
                let m = measure(brdf, &form, &*set, *budget);
                method.reconstruct(&m).unwrap()
            };
            let (all, first, second) = (of(&rgb), of(&first), of(&second));
            assert_eq!(*all.channels(), Channels::Rgb);
            assert_eq!(*first.channels(), Channels::Luminance);
            for i in 0..300 {
                let pair = random_pair(&random, i);
                let mut out = [0.0; 3];
                assert_eq!(all.eval(&pair, &mut out), Presence::Present);
                let expected = [value(&*first, &pair), value(&*second, &pair)];
                for (c, expected) in [(0, expected[0]), (1, expected[1]), (2, expected[0])] {
                    // The same sums in the same order; a compiler may fuse them differently.
                    let error = (out[c] - expected).abs();
                    assert!(error < 1e-14, "{} {c} {error:e}", method.label());
                }
            }
        }
    }
}

#[test]
fn batches_and_threads_change_no_bit() {
    let random = Random::new(3);
    // More than one block of a batch, and a remainder.
    let mut pairs: Vec<_> = (0..300).map(|i| random_pair(&random, i)).collect();
    pairs[17] = DirectionPair::new(Direction::from_spherical(2.0, 0.0), Direction::NORMAL);
    let run = |threads: usize| {
        let mut bits = Vec::new();
        crate::common::on_threads(threads, || {
            for (channels, symmetry) in [
                (Channels::Luminance, Symmetry::FULL),
                (Channels::Rgb, Symmetry::ORTHOTROPIC),
            ] {
                let f = move |pair: &DirectionPair| {
                    let f = smooth(symmetry, pair);
                    Some([f, f * f, 3.0 - f])
                };
                let n = channels.count();
                let truth = Material {
                    symmetry,
                    channels,
                    f,
                };
                for set in super::sets() {
                    let m = measure(&truth, &form("half-difference", symmetry), &*set, 800);
                    for method in methods() {
                        if method.needs_grid() && !set.is_grid() {
                            continue;
                        }
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

#[test]
fn every_parametrization_is_met() {
    let names: Vec<_> = forms(&[Symmetry::FULL]).iter().map(|f| f.name()).collect();
    for entry in parametrization::all() {
        assert!(names.contains(&entry.kind));
    }
}
