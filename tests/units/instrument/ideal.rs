use crate::common::made;
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::schedule::Schedule;
use gonio::{parametrization, registry, schedule};
use std::sync::Arc;

fn poses() -> Arc<Schedule> {
    let hybrid = parametrization::find("hybrid").unwrap();
    let sets = schedule::all();
    let sobol = sets.iter().find(|e| e.kind == "sobol").unwrap();
    let sobol = registry::read_text(sobol, "").unwrap();
    // More poses than one parallel task holds.
    let form = hybrid.form(Symmetry::FULL);
    Arc::new(sobol.plan(&form, 2 * 1024 + 7, 3).unwrap())
}

#[test]
fn missing_data_is_reported_and_counted() {
    // Half a hemisphere without data.
    let holed = made(Symmetry::FULL, |pair| {
        (pair.separation() >= 1.0).then_some([0.25])
    });
    let poses = poses();
    let measurement = Ideal.measure(&holed, &poses);
    let near = |p: &&schedule::Pose| p.pair.separation() < 1.0;
    let missing = poses.poses.iter().filter(near).count();
    assert!(missing > 100);
    assert_eq!(measurement.no_data(), missing);
    assert_eq!(measurement.readings(), poses.poses.len() - missing);
}
