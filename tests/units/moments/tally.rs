use gonio::moments::{Component, Order, Tally};
use gonio::sampling::Random;

/// Points around `centre` with spread `width`, weighted unevenly.
fn cloud(n: usize, centre: [f64; 2], width: f64) -> (Vec<[f64; 2]>, Vec<f64>) {
    let random = Random::new(3);
    (0..n as u64)
        .map(|i| {
            let [a, b, w] = random.point(i);
            let x = centre[0] + width * (a * a - 0.3);
            ([x, centre[1] + width * (b - 0.2 * a)], w)
        })
        .unzip()
}

fn close(a: &Tally, b: &Tally, tolerance: f64) {
    for (x, y) in a.values().into_iter().zip(b.values()) {
        let (x, y) = (x.unwrap(), y.unwrap());
        assert!((x - y).abs() <= tolerance * (1.0 + y.abs()), "{x} {y}");
    }
}

#[test]
fn merging_parts_in_any_grouping_gives_the_whole() {
    let (points, weights) = cloud(1000, [0.3, -0.2], 1.0);
    let whole = Tally::of(Order::MAX, &points, &weights);
    for size in [1, 7, 100, 999] {
        let mut merged = Tally::new(Order::MAX);
        for (p, w) in points.chunks(size).zip(weights.chunks(size)) {
            merged.merge(&Tally::of(Order::MAX, p, w));
        }
        close(&merged, &whole, 1e-13);
    }
}

#[test]
fn a_far_and_narrow_cloud_keeps_its_digits() {
    // The same cloud at the origin and at −1.57, widths down to 1e-6: raw sums would keep
    // (1e-6/1.57)² / 1e-16, that is no digits, of the variance.
    let reference = {
        let (points, weights) = cloud(4096, [0.0; 2], 1.0);
        Tally::of(Order::MAX, &points, &weights).values()
    };
    for width in [1e-2, 1e-4, 1e-6] {
        let (points, weights) = cloud(4096, [-1.57, 0.0], width);
        let mut tally = Tally::new(Order::MAX);
        for (p, w) in points.chunks(64).zip(weights.chunks(64)) {
            tally.merge(&Tally::of(Order::MAX, p, w));
        }
        let values = tally.values();
        for c in Component::ALL.into_iter().filter(|c| c.order() >= 2) {
            let scale = if c.order() == 2 { width * width } else { 1.0 };
            let (got, want) = (
                values[c.index()].unwrap() / scale,
                reference[c.index()].unwrap(),
            );
            // What is left is the rounding of the points themselves, 2e-16/width.
            assert!(
                (got - want).abs() < 4e-15 / width + 1e-12,
                "{width} {c}: {got} {want}"
            );
        }
    }
}

#[test]
fn lower_orders_are_the_same_numbers() {
    let (points, weights) = cloud(100, [0.1, 0.2], 0.5);
    let full = Tally::of(Order::MAX, &points, &weights).values();
    for order in 0..4 {
        let order = Order::new(order).unwrap();
        let some = Tally::of(order, &points, &weights).values();
        for c in Component::ALL {
            match some[c.index()] {
                Some(v) => assert!((v - full[c.index()].unwrap()).abs() < 1e-14),
                None => assert!(c.order() > order.get()),
            }
        }
    }
}

#[test]
fn what_has_no_weight_has_no_mean() {
    let black = Tally::of(Order::MAX, &[[0.1, 0.2]; 5], &[0.0; 5]);
    assert_eq!(black.values()[0], Some(0.0));
    assert!(black.values()[1..].iter().all(Option::is_none));
    let point = Tally::of(Order::MAX, &[[0.1, 0.2]], &[2.0]).values();
    assert_eq!((point[3], point[6]), (Some(0.0), None));
}
