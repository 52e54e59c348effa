use gonio::moments::{Component, Order};

#[test]
fn components_know_their_place() {
    for (i, c) in Component::ALL.into_iter().enumerate() {
        assert_eq!(c.index(), i);
    }
    for order in 0..=4 {
        let order = Order::new(order).unwrap();
        assert_eq!(order.components().count(), order.count());
        assert!(order.components().all(|c| c.order() <= order.get()));
    }
    assert_eq!(Component { n: 2, m: 2 }.to_string(), "kurtosis_22");
    assert!(Order::new(5).is_none());
}
