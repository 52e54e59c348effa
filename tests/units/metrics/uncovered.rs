use gonio::metrics::{Uncovered, Values};
use gonio::reconstruct::Coverage::{Extrapolated, Interpolated, Unknown};

#[test]
fn shares_are_of_the_pairs_that_are_compared() {
    let coverage = [Interpolated, Extrapolated, Unknown, Extrapolated, Unknown];
    let mut truth = Values {
        luminance: vec![1.0; 5],
        missing: Vec::new(),
    };
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
