mod expected;
#[cfg(feature = "experiments")]
mod pairs;
mod tally;
mod test_set;

use crate::common::{self, made, matte, test_pairs};
use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics::{
    AlbedoProbe, Measure, MetricsSpec, Uncovered, Values, evaluate, share_within,
};
use gonio::reconstruct::Coverage::{Extrapolated, Interpolated, Unknown};

/// Varies from pair to pair, has three channels, and no data for some pairs.
fn patchy() -> impl Brdf {
    made(Symmetry::NONE, |pair| {
        let v = pair.omega_i.vector();
        (v.x <= 0.5).then_some([v.z, 1.0 + v.y, v.x * v.x])
    })
}

/// So many pairs within a mask and a least separation.
fn spec(pairs: usize, mask_deg: f64, min_separation_deg: f64, seed: u64) -> MetricsSpec {
    MetricsSpec {
        pairs,
        mask_deg,
        min_separation_deg,
        seed,
        ..MetricsSpec::default()
    }
}

fn pairs(n: usize) -> Vec<DirectionPair> {
    test_pairs(Measure::Cosine, n)
}

#[test]
fn slabs_make_up_the_whole() {
    // Some slabs have holes, some do not.
    let pairs = pairs(50);
    let slabs: Vec<_> = pairs.chunks(3).map(|p| evaluate(&patchy(), p)).collect();
    let whole = |slab: &Values| slab.missing.is_empty();
    assert!(slabs.iter().any(whole) && !slabs.iter().all(whole));
    let mut values = Values::default();
    slabs.into_iter().for_each(|slab| values.append(slab));
    assert!(values == evaluate(&patchy(), &pairs));
}

#[test]
fn a_batch_equals_single_look_ups() {
    // Whole chunks, a part of one, and nothing.
    for n in [1, 1024, 2 * 1024 + 17] {
        let pairs = pairs(n);
        let values = evaluate(&patchy(), &pairs);
        for (i, pair) in pairs.iter().enumerate() {
            assert_eq!(values.get(i), patchy().luminance(pair));
        }
    }
    assert!(evaluate(&patchy(), &[]).luminance.is_empty());
    let whole = Lambert::new(Spectrum::Grey(0.5), Channels::Rgb);
    assert!(evaluate(&whole, &pairs(100)).missing.is_empty());
}

#[test]
fn lambert_is_exact_to_rounding() {
    let probe = AlbedoProbe::new();
    let values = probe.evaluate(&matte(0.7));
    for albedo in probe.albedos(&values, &values) {
        assert!((albedo / 0.7 - 1.0).abs() < 1e-13, "{albedo}");
    }
}

#[test]
fn missing_pairs_are_left_out_of_both() {
    let probe = AlbedoProbe::new();
    let grey = |albedo| probe.evaluate(&matte(albedo));
    let (mut truth, mut reconstruction) = (grey(0.5), grey(0.6));
    let whole = probe.error(&truth, &reconstruction).unwrap();
    assert!((whole - 0.2).abs() < 1e-12, "{whole}");
    truth.missing = (0..probe.pairs().len()).map(|i| i % 3 == 0).collect();
    reconstruction.missing = (0..probe.pairs().len()).map(|i| i % 5 == 0).collect();
    assert!(probe.albedos(&truth, &reconstruction)[0] < 0.45);
    let part = probe.error(&truth, &reconstruction).unwrap();
    assert!((part - 0.2).abs() < 1e-12, "{part}");
}

#[test]
fn shares_are_of_the_pairs_that_are_compared() {
    let coverage = [Interpolated, Extrapolated, Unknown, Extrapolated, Unknown];
    let mut truth = common::values(vec![1.0; 5]);
    let shares = |truth: &Values| {
        let found = Uncovered::among(&coverage, &[1.0; 5], truth);
        Uncovered::QUANTITIES.map(|(_, of)| of(&found))
    };
    assert_eq!(shares(&truth), [Some(0.4), Some(0.4)]);
    truth.missing = vec![false, false, false, false, true];
    assert_eq!(shares(&truth), [Some(0.5), Some(0.25)]);
    // What breaks the promise of a BRDF is not compared either.
    truth.luminance[1] = f64::NAN;
    assert_eq!(shares(&truth), [Some(1.0 / 3.0); 2]);
    truth.missing = vec![true; 5];
    assert_eq!(shares(&truth), [None; 2]);
}

#[test]
fn pairs_count_by_their_weight_where_both_have_a_value() {
    let values = |luminance: [f64; 4], missing: [bool; 4]| Values {
        luminance: luminance.into(),
        missing: missing.into(),
    };
    let truth = values([1.0, 1.0, 0.0, 1.0], [false, false, false, true]);
    let same = values([1.0, 1.25, 0.0, 9.0], [false; 4]);
    let weights = [3.0, 1.0, 4.0, 5.0];
    let share = |u: f64| share_within(|i| weights[i], &truth, &same, &[u; 4]);
    assert_eq!(share(0.0), Some(7.0 / 8.0));
    assert_eq!(share(0.124), Some(7.0 / 8.0));
    assert_eq!(share(0.125), Some(1.0));
    assert_eq!(share_within(|_| 0.0, &truth, &same, &[1.0; 4]), None);
}
