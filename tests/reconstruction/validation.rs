//! Readings as judges: their weights, what is left out, and what they choose.

use super::common::{Level, levels, turned};
use super::layouts::{named, readings_of, scattered, sheets};
use super::method;
use gonio::brdf::Brdf;
use gonio::measurement::Measurement;
use gonio::metrics::{self, Errors, Measure, MetricsSpec};
use gonio::reconstruct::Reconstruct;
use gonio::validation::{CrossValidation, Left, ReferenceReadings, Scores, ValidationError};
use std::sync::Arc;

levels! {
    readings_choose_well: "thorough: three models, more readings";
}

/// What a model has at a layout, of which no uncertainty is told.
fn readings(model: &dyn Brdf, angles: &[[f64; 3]]) -> Measurement {
    Measurement {
        details: None,
        ..readings_of(model, angles)
    }
}

/// `nrmse`, `cosine`, between two BRDFs.
fn truth(model: &dyn Brdf, brdf: &dyn Brdf) -> Errors {
    let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default()).unwrap();
    super::common::errors(model, brdf, &pairs)
}

/// The candidates by their scores, best first.
fn ranked(m: &Measurement) -> Vec<(Arc<dyn Reconstruct>, Scores)> {
    let validation = CrossValidation::new(m, None).unwrap();
    validation.rank(validation.candidates(), || ()).unwrap()
}

/// Errors of a method at readings that it was not given.
fn left_out(validation: &CrossValidation, kind: &str) -> [f64; Errors::QUANTITIES.len()] {
    let method: Arc<dyn Reconstruct> = Arc::from(method(kind, ""));
    errors(&validation.scores(&[method], || ()).remove(0).unwrap())
}

fn errors(scores: &Scores) -> [f64; Errors::QUANTITIES.len()] {
    scores.0[0].map(|e| e.value.unwrap())
}

/// Readings that are spread in another way than the measure give the errors of the measure.
#[test]
fn readings_are_weighted_to_the_measure() {
    let model = named("ggx");
    // Not the distribution of any measure: dense near the normal.
    let steep = |[i, o, phi]: [f64; 3]| [i * i / 85.0, o * o / 85.0, phi];
    let angles: Vec<_> = scattered(6000).into_iter().map(steep).collect();
    let jury = ReferenceReadings::new(&readings(&*model, &angles)).unwrap();
    let lambert = named("lambert");
    let judged = jury.errors(&metrics::evaluate(&*lambert, jury.pairs()));
    let plain = truth(&*model, &*lambert);
    for (q, (quantity, of)) in Errors::QUANTITIES.iter().enumerate().take(5) {
        let [judged, plain] = [judged.0[0][q].value.unwrap(), of(&plain).unwrap()];
        let off = (judged / plain - 1.0).abs();
        assert!(off < 0.05, "{}: {judged} against {plain}", quantity.name);
    }
}

#[test]
fn a_constant_is_predicted_exactly() {
    let lambert = named("lambert");
    for angles in [sheets(&[15.0, 30.0, 60.0], 8, 12), scattered(100)] {
        let m = readings(&*lambert, &angles);
        for (method, scores) in ranked(&m) {
            for e in scores.0.as_flattened() {
                assert!(e.value.unwrap() < 1e-9, "{}: {e:?}", method.label());
                assert!(e.standard_error.is_none_or(|s| s < 1e-9));
            }
        }
    }
}

/// The error at readings left out is that of the reconstruction: scattered readings lose a tenth.
#[test]
fn scattered_readings_tell_the_error() {
    for name in ["ggx", "ward", "retro-reflective"] {
        let model = named(name);
        let m = readings(&*model, &scattered(800));
        let validation = CrossValidation::new(&m, None).unwrap();
        assert_eq!(validation.left(), Left::Points { sets: 10 });
        for kind in ["thin-plate", "inverse-distance", "nearest"] {
            let brdf = method(kind, "").reconstruct(&m).unwrap();
            let truth = truth(&*model, &*brdf).log_relative.unwrap();
            let [_, told, ..] = left_out(&validation, kind);
            let is_near = (0.8..1.6).contains(&(told / truth));
            assert!(is_near, "{name} {kind}: {told} of {truth}");
        }
    }
}

/// What the readings choose is nearly the best there is.
fn readings_choose_well(level: Level) {
    for name in level.of(vec!["ggx"], vec!["ggx", "retro-reflective", "phong"]) {
        let model = named(name);
        let incidences: Vec<f64> = (0..10).map(|i| 5.0 + 8.0 * f64::from(i)).collect();
        let layouts = [scattered(level.of(200, 800)), sheets(&incidences, 6, 12)];
        for angles in layouts.into_iter().take(level.of(1, 2)) {
            let m = readings(&*model, &angles);
            let truths = ranked(&m).into_iter().map(|(method, _)| {
                let brdf = method.reconstruct(&m).unwrap();
                truth(&*model, &*brdf).nrmse.unwrap()
            });
            let truths: Vec<f64> = truths.collect();
            let best = truths.iter().copied().fold(f64::INFINITY, f64::min);
            let worst = truths.iter().copied().fold(0.0, f64::max);
            let chosen = truths[0];
            assert!(chosen <= 3.0 * best, "{name}: {chosen}, best {best}");
            assert!(chosen <= 0.2 * worst, "{name}: {chosen}, worst {worst}");
        }
    }
}

/// A reading at the place of one that is left out would give it away, whatever sheet it is in.
#[test]
fn whole_sheets_are_left_out_with_their_images() {
    let model = named("ggx");
    // Every pair of these is measured twice: as (i, o) and as (o, i).
    let mut angles = sheets(&[20.0, 40.0, 60.0], 20, 30);
    angles.retain(|[_, o, _]| [20.0, 40.0, 60.0].contains(o));
    let m = readings(&*model, &angles);
    let validation = CrossValidation::new(&m, Some(true)).unwrap();
    let (sheets, of_sensor) = (3, false);
    assert_eq!(validation.left(), Left::Sheets { sheets, of_sensor });
    let errors = left_out(&validation, "nearest");
    assert!(errors[1] > 0.1, "{errors:?}");
}

/// Of an isotropic material each sheet may be measured at an azimuth of its own.
#[test]
fn a_turned_sheet_is_left_out_as_it_was() {
    let model = named("ggx");
    // Not on a lattice: readings at equal distances are ordered by rounding.
    let directions = (1..80).map(|k| [0.6180, 0.7549].map(|g| (f64::from(k) * g).fract()));
    let sheet = |i: f64| {
        let directions = directions.clone();
        directions.map(move |[o, phi]| [i, 80.0 * o, 180.0 * phi])
    };
    let angles: Vec<_> = [15.0, 30.0, 60.0].into_iter().flat_map(sheet).collect();
    let m = readings(&*model, &angles);
    let mut schedule = (*m.schedule).clone();
    for pose in &mut schedule.poses {
        pose.pair = turned(&pose.pair, 5.0 * pose.pair.omega_i.theta());
    }
    let turned = Measurement {
        schedule: Arc::new(schedule),
        ..m.clone()
    };
    let [plain, turned] =
        [m, turned].map(|m| left_out(&CrossValidation::new(&m, Some(true)).unwrap(), "nearest"));
    for (plain, turned) in plain.into_iter().zip(turned) {
        let off = (plain - turned).abs();
        assert!(off <= 1e-9 * plain.abs(), "{plain} {turned}");
    }
}

#[test]
fn what_cannot_be_validated_is_told() {
    let model = named("ggx");
    let one = readings(&*model, &[[30.0, 20.0, 10.0]]);
    let refused = CrossValidation::new(&one, None).map(|_| ()).unwrap_err();
    assert_eq!(refused, ValidationError::TooFew { places: 1 });
    let some = readings(&*model, &scattered(50));
    let refused = CrossValidation::new(&some, Some(true)).map(|_| ());
    assert_eq!(refused.unwrap_err(), ValidationError::NoSheets);
    assert!(CrossValidation::new(&some, None).is_ok());
    assert!(!ranked(&readings(&*model, &scattered(2))).is_empty());
}

#[test]
fn any_number_of_threads_chooses_the_same() {
    let m = readings(&*named("ggx"), &sheets(&[15.0, 30.0, 60.0], 10, 20));
    let [one, two] = [1, 2].map(|threads| {
        crate::common::on_threads(threads, || {
            let labelled = ranked(&m).into_iter().map(|(m, s)| (m.label(), s));
            labelled.collect::<Vec<_>>()
        })
    });
    assert!(one == two);
}
