use gonio::bench::{self, Settings, Time, front};
use gonio::sampling::Random;

/// By the definition, point by point.
#[test]
fn nothing_on_a_front_is_dominated_and_all_else_is() {
    // Few values, so that many are equal.
    let mut stream = Random::new(1).stream(0);
    let mut random = || (16.0 * stream.next()).floor();
    for _ in 0..50 {
        let points: Vec<_> = (0..12).map(|_| Some([random(), random()])).collect();
        let dominates =
            |a: [f64; 2], b: [f64; 2]| a[0] <= b[0] && a[1] <= b[1] && (a[0] < b[0] || a[1] < b[1]);
        for (point, is_on) in points.iter().flatten().zip(front(&points)) {
            let mut others = points.iter().flatten();
            let dominated = others.any(|other| dominates(*other, *point));
            assert_eq!(is_on, !dominated, "{point:?} of {points:?}");
        }
    }
}

#[test]
fn times_lie_on_lines_in_logarithms() {
    let points = [(1.0, 1e-1), (100.0, 1e-2), (1e4, 1e-4)];
    let at = |target| Time::to_reach(target, &points, true).unwrap();
    assert_eq!(at(0.5), Time::AtMost(1.0));
    for (target, want) in [(1e-1_f64.powf(1.5), 10.0), (1e-3, 1e3), (1e-4, 1e4)] {
        let Time::Between(got) = at(target) else {
            panic!("{target}")
        };
        assert!((got / want - 1.0).abs() < 1e-12, "{target}: {got}");
    }
    let Time::Beyond(got) = at(1e-5) else {
        panic!()
    };
    assert!((got / 1e6 - 1.0).abs() < 1e-12);
    // A ladder that ends in an exact result.
    let exact = Time::to_reach(1e-3, &[(1.0, 0.1), (2.0, 0.0)], true);
    assert_eq!(exact, Some(Time::Between(2.0)));
    assert_eq!(Time::to_reach(1.0, &[], true), None);
    let far = Time::to_reach(1e-7, &points, true);
    assert_eq!(far, Some(Time::MoreThan(1e4)));
    let lawless = Time::to_reach(1e-5, &points, false);
    assert_eq!(lawless, Some(Time::MoreThan(1e4)));
}

/// Whatever costs too much at a large budget is still timed at a small one.
#[test]
fn every_choice_has_a_rung() {
    let settings = Settings {
        quick: true,
        views: None,
        merl: None,
    };
    for section in bench::all() {
        for ladder in (section.ladders)(&settings).unwrap() {
            let (name, names) = (section.name, ladder.names);
            assert!(!ladder.rungs.is_empty(), "{name} {names:?}");
        }
    }
}
