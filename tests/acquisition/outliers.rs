//! Readings that a fault multiplied: they are found, and cost little.

use super::common::{Level, levels};
use super::{error_of, greedy, kriging, noisy, over_matte, task};
use gonio::acquisition::{Rule, acquire};
use gonio::reconstruct::suspects;
use gonio::sampling::Random;

levels! {
    faults_are_found_and_cost_little: "thorough: more lobes, readings and draws";
}

/// Of readings of lobes with a noise of one percent two in a hundred are multiplied or divided by 1.5 to 5.
fn faults_are_found_and_cost_little(level: Level) {
    let (mut good, mut doubted) = (0, 0);
    let (mut faults, mut found) = (0, 0);
    for (readings, most) in level.of(vec![(128, 1.3)], vec![(64, 1.5), (128, 1.3), (256, 1.3)]) {
        let (mut clean, mut with_faults) = (0.0, 0.0);
        for alpha in level.of(vec![0.05], vec![0.02, 0.05, 0.1, 0.2]) {
            let truth = over_matte(alpha);
            let measured = acquire(&greedy(Rule::Adaptive), &task(readings), &*truth).unwrap();
            // Without noise the edges of a lobe are the worst there is to be doubted.
            let edges = suspects(&measured);
            assert!(edges.is_empty(), "{alpha} {readings}: {edges:?}");
            for seed in 0..level.of(4, 8) {
                let mut some = noisy(&measured, readings, seed);
                let error = |some: &_| error_of(&*kriging(some), &*truth).ln();
                clean += error(&some);
                doubted += suspects(&some).len();
                good += readings;
                let random = Random::new(seed + 100);
                let mut wrong = Vec::new();
                for (i, value) in some.values.iter_mut().enumerate() {
                    let [any, size, way] = random.point::<3>(i as u64);
                    if any < 0.02 {
                        let factor = 1.5 * (5.0_f64 / 1.5).powf(size);
                        *value *= if way < 0.5 { factor } else { 1.0 / factor };
                        wrong.push(i);
                    }
                }
                with_faults += error(&some);
                let (right, false_alarms): (Vec<_>, Vec<_>) = suspects(&some)
                    .iter()
                    .map(|s| s.pose)
                    .partition(|pose| wrong.contains(pose));
                found += right.len();
                faults += wrong.len();
                doubted += false_alarms.len();
                good += readings - wrong.len();
            }
        }
        let draws = f64::from(level.of(4, 32));
        let ratio = ((with_faults - clean) / draws).exp();
        assert!(ratio < most, "{readings}: {ratio}");
    }
    assert!((doubted as f64) < 0.01 * good as f64, "{doubted} of {good}");
    // The others are within what the readings about them leave open.
    assert!(found * 2 > faults, "{found} of {faults}");
}
