mod albedo;
mod expected;
#[cfg(feature = "experiments")]
mod pairs;
mod tally;
mod test_set;
mod uncovered;
mod within;

use crate::common::made;
use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics::{AlbedoProbe, Measure, MetricsSpec, Values, compare, evaluate, test_pairs};

/// Varies from pair to pair, has three channels, and no data for some pairs.
fn patchy() -> impl Brdf {
    made(Symmetry::NONE, |pair| {
        let v = pair.omega_i.vector();
        (v.x <= 0.5).then_some([v.z, 1.0 + v.y, v.x * v.x])
    })
}

fn pairs(n: usize) -> Vec<DirectionPair> {
    let spec = MetricsSpec {
        pairs: n,
        ..Default::default()
    };
    test_pairs(Measure::Cosine, &spec).unwrap()
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
fn any_number_of_threads_gives_the_same_bits() {
    let results = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let pairs = pairs(10_000);
            let truth = evaluate(&patchy(), &pairs);
            let lambert = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
            let errors = compare(&pairs, &truth, &evaluate(&lambert, &pairs));
            let probe = AlbedoProbe::new();
            let albedos = [&patchy() as &dyn Brdf, &lambert].map(|brdf| {
                let values = probe.evaluate(brdf);
                probe.albedos(&values, &values)
            });
            (truth, errors, albedos)
        })
    });
    assert!(results[0].1.pairs_missing > 0);
    // Not `assert_eq`: a failure would print some 20 000 numbers.
    assert!(results[0] == results[1]);
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
    let whole = evaluate(
        &Lambert::new(Spectrum::Grey(0.5), Channels::Rgb),
        &pairs(100),
    );
    assert!(whole.missing.is_empty());
}
