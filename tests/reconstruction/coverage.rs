//! What readings say of a pair.

use super::common::{near, values};
use super::layouts::pair;
use super::{form, measure, smooth_material};
use gonio::brdf::{Brdf, Presence};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::measurement::Outcome;
use gonio::metrics::{self, Measure, MetricsSpec, TestSet, Uncovered};
use gonio::reconstruct::{Cover, Coverage, Covered, Fill, NearestReading, Reconstruct};
use gonio::schedule::SobolSet;

#[test]
fn a_full_set_covers_all_and_a_half_one_its_half() {
    let form = form("half-difference", Symmetry::FULL);
    let mut m = measure(&smooth_material(Symmetry::FULL), &form, &SobolSet {}, 3000);
    let brdf = NearestReading::default().reconstruct(&m).unwrap();
    let grid = || {
        let angles = (0..8).flat_map(|i| (0..8).flat_map(move |o| (0..7).map(move |a| (i, o, a))));
        angles.map(|(i, o, a)| pair([10 * i, 10 * o, 30 * a].map(f64::from)))
    };
    let share = |cover: &Cover, of: Coverage, keep: &dyn Fn(&DirectionPair) -> bool| {
        let pairs: Vec<_> = grid().filter(|p| keep(p)).collect();
        let found = pairs.iter().filter(|p| cover.coverage(p) == of).count();
        found as f64 / pairs.len() as f64
    };
    let cover = Cover::of(&m).unwrap();
    assert!(share(&cover, Coverage::Interpolated, &|_| true) > 0.98);
    // Every reading is covered, and stays what it is whatever is filled in.
    for (i, pose) in m.schedule.poses.iter().enumerate().step_by(50) {
        let none = Covered::new(&*brdf, &m, Fill::None).unwrap();
        let mut out = [0.0];
        assert_eq!(none.eval(&pose.pair, &mut out), Presence::Present);
        assert_eq!(out[0], m.value(i).unwrap()[0]);
    }
    // Without the readings above 30° from the half vector to the normal.
    let axis = |p: &DirectionPair| form.forward(p)[0].to_degrees();
    for (pose, outcome) in m.schedule.poses.iter().zip(&mut m.outcomes) {
        if axis(&pose.pair) > 30.0 {
            *outcome = Outcome::NotVisited;
        }
    }
    let cover = Cover::of(&m).unwrap();
    assert!(share(&cover, Coverage::Interpolated, &|p| axis(p) < 25.0) > 0.97);
    assert!(share(&cover, Coverage::Interpolated, &|p| axis(p) > 40.0) < 0.03);
    assert!(share(&cover, Coverage::Unknown, &|p| axis(p) > 65.0) > 0.97);
    // One reading covers what is near to it.
    m.outcomes.fill(Outcome::NotVisited);
    m.outcomes[0] = Outcome::Reading;
    let cover = Cover::of(&m).unwrap();
    let own = cover.coverage(&m.schedule.poses[0].pair);
    assert_eq!(own, Coverage::Interpolated);
    assert!(share(&cover, Coverage::Interpolated, &|_| true) < 0.1);
}

#[test]
fn some_pairs_speak_for_all() {
    let form = form("half-difference", Symmetry::FULL);
    let mut m = measure(&smooth_material(Symmetry::FULL), &form, &SobolSet {}, 1000);
    for (pose, outcome) in m.schedule.poses.iter().zip(&mut m.outcomes) {
        if pose.pair.omega_i.theta() > 0.8 {
            *outcome = Outcome::NotVisited;
        }
    }
    let cover = Cover::of(&m).unwrap();
    let level = TestSet::new(&Measure::USUAL, &MetricsSpec::default()).unwrap();
    let level = level.level(0);
    let counted: Vec<usize> = Uncovered::counted(level.pairs.len()).collect();
    assert!((1500..=2000).contains(&counted.len()), "{}", counted.len());
    let counted: Vec<_> = counted.into_iter().map(|i| level.pairs[i]).collect();
    let counted = cover.coverages(&counted);
    let truth = values(vec![1.0; level.pairs.len()]);
    for (measure, weights) in Measure::USUAL.into_iter().zip(&level.weights) {
        let pairs = metrics::test_pairs(measure, &MetricsSpec::default()).unwrap();
        let all = cover.coverages(&pairs);
        let some = Uncovered::among(&counted, weights, &truth);
        for (found, what) in [
            (some.extrapolated, Coverage::Extrapolated),
            (some.unknown, Coverage::Unknown),
        ] {
            let p = all.iter().filter(|c| **c == what).count() as f64 / all.len() as f64;
            near(found.unwrap(), p, 3.0 * 0.015, (measure, what));
        }
        let inside = all.iter().filter(|c| **c == Coverage::Interpolated).count();
        assert!((0.1..0.9).contains(&(inside as f64 / all.len() as f64)));
    }
}
