use gonio::metrics::{Values, share_within};

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
