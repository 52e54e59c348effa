use crate::common::{form, on_threads};
use gonio::experiment::{Counters, Counts, Row, Stage, Work, quantities};
use gonio::geometry::Symmetry;
use gonio::instrument::{Bench, Order, Parts};
use gonio::schedule::{RandomSet, SampleSet};
use rayon::prelude::*;
use std::collections::BTreeSet;

#[test]
fn every_stage_and_kind_has_a_place_and_a_name_of_its_own() {
    assert!(Stage::ALL.iter().enumerate().all(|(i, s)| *s as usize == i));
    assert!(Work::ALL.iter().enumerate().all(|(i, w)| *w as usize == i));
    let stages: BTreeSet<_> = Stage::ALL.iter().map(|s| s.name()).collect();
    let works: BTreeSet<_> = Work::ALL.iter().map(|w| w.name()).collect();
    assert_eq!(stages.len(), Stage::ALL.len());
    assert_eq!(works.len(), Work::ALL.len());
}

#[test]
fn no_thread_loses_a_count() {
    let counters = Counters::default();
    let add = |i: usize| counters.add(Stage::Measure, Work::Poses, i);
    on_threads(5, || (0..10_000).into_par_iter().for_each(add));
    (0..10).for_each(add);
    let pictures = counters.within(Stage::Pictures);
    pictures.add(Stage::Plan, Work::Drawn, 3);
    let counts = counters.clone().counts();
    assert_eq!(counts.get(Stage::Pictures, Work::Drawn), 3);
    assert_eq!(counts.get(Stage::Measure, Work::Poses), 49_995_000 + 45);
    assert_eq!(counts.get(Stage::Plan, Work::Drawn), 0);
    // Written and read again, and twice as much.
    let text = serde_json::to_string(&counts).unwrap();
    let expected = r#"{"measure":{"poses":49995045},"pictures":{"drawn":3}}"#;
    assert_eq!(text, expected);
    let mut twice: Counts = serde_json::from_str(&text).unwrap();
    twice.extend(&counts);
    assert_eq!(twice.get(Stage::Measure, Work::Poses), 99_990_090);
}

#[test]
fn a_tour_depends_on_poses_kind_limits_and_order_only() {
    let form = form("hybrid", Symmetry::FULL);
    let schedule = RandomSet {}.plan(&form, 100, 1).unwrap();
    for preset in gonio::instrument::presets() {
        let spec = gonio::instrument::read(preset.text).unwrap();
        for limits in [false, true] {
            let plan = |noise, apertures, realisation| {
                let parts = Parts {
                    limits,
                    apertures,
                    noise,
                };
                let bench = Bench::new(&spec, parts, realisation).unwrap();
                bench.plan(&schedule, Order::TwoOpt)
            };
            let tour = plan(true, true, 1);
            assert_eq!(plan(true, true, 2), tour);
            assert_eq!(plan(false, false, 1), tour);
        }
    }
}

#[test]
fn columns_are_what_is_written_and_read() {
    let mut row = Row {
        seed: 1 << 60,
        reachable: 0.1 + 0.2,
        instrument_seconds: Some(1e-7),
        ..Row::default()
    };
    for (i, quantity) in quantities().iter().enumerate() {
        let value = if quantity.is_count { 3.0 } else { 1.0 / 3.0 };
        row.quantities
            .set(quantity.name, (i % 3 > 0).then_some(value));
    }
    let text = serde_json::to_string(&row).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let written: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
    let columns = Row::columns().chain(Row::times());
    let columns: Vec<_> = columns.map(|(name, _)| name).collect();
    assert_eq!(written, columns);
    assert!(Row::columns().all(|(_, meaning)| !meaning.is_empty()));
    assert_eq!(serde_json::from_str::<Row>(&text).unwrap(), row);
    let stray = text.replacen("{\"key\"", "{\"stray\":1,\"key\"", 1);
    let refusal = serde_json::from_str::<Row>(&stray).unwrap_err().to_string();
    assert!(refusal.contains("stray"), "{refusal}");
}
