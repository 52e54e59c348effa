mod albedo;
mod expected;
#[cfg(feature = "experiments")]
mod pairs;
mod tally;
mod test_set;
mod uncovered;
mod within;

use crate::common::{made, test_pairs};
use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics::{Measure, Values, evaluate};

/// Varies from pair to pair, has three channels, and no data for some pairs.
fn patchy() -> impl Brdf {
    made(Symmetry::NONE, |pair| {
        let v = pair.omega_i.vector();
        (v.x <= 0.5).then_some([v.z, 1.0 + v.y, v.x * v.x])
    })
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
    let whole = evaluate(
        &Lambert::new(Spectrum::Grey(0.5), Channels::Rgb),
        &pairs(100),
    );
    assert!(whole.missing.is_empty());
}
