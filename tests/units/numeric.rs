use crate::common::product;
use gonio::numeric::wrap_angle;
use std::f64::consts::PI;

#[test]
fn wrapping_keeps_the_angle() {
    for (turn, a) in product(-3..=3, [-3.1, -1.0, 0.0, 1e-9, 2.0, 3.1]) {
        let w = wrap_angle(a + f64::from(turn) * 2.0 * PI);
        assert!((w - a).abs() < 1e-14, "{a} {turn} {w}");
    }
    assert_eq!(wrap_angle(PI), PI);
}
