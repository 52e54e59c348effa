use gonio::statistics::{BAND, Bootstrap, Paired, Verdict};

/// Errors of A and B whose log ratio is `shift` and scatters by up to ± `spread`.
fn pairs(n: u32, shift: f64, spread: f64) -> Vec<(f64, f64)> {
    let pair = |k: u32| {
        let base = 0.01 * (f64::from(k) * 0.7).sin().exp();
        (base * (shift + spread * f64::from(k * k).sin()).exp(), base)
    };
    (1..=n).map(pair).collect()
}

/// The comparison of pairs that can be compared.
fn compared(pairs: &[(f64, f64)]) -> Paired {
    Paired::new(pairs, BAND, &Bootstrap::new(1)).unwrap()
}

fn verdict(n: u32, shift: f64, spread: f64) -> Verdict {
    compared(&pairs(n, shift, spread)).verdict()
}

#[test]
fn what_is_known_badly_has_a_wider_interval() {
    let plain = compared(&pairs(20, 0.1, 0.05));
    assert_eq!(plain.known_to(&[(0.0, 0.0); 20]).interval, plain.interval);
    let wide = plain.known_to(&[(0.3, 0.4); 20]);
    let [a, b] = [plain, wide].map(|p| p.interval.unwrap().map(|end| (end / p.ratio).ln()));
    // 0.5 for each of 20 materials.
    let more = 1.96 * 0.5 / 20_f64.sqrt();
    for (a, b) in a.into_iter().zip(b) {
        assert!((b - a.hypot(more).copysign(a)).abs() < 1e-12, "{a} {b}");
    }
    assert_eq!((wide.ratio, wide.p), (plain.ratio, plain.p));
    // Also where all ratios are one.
    let equal = Paired::new(&[(2.0, 2.0); 20], BAND, &Bootstrap::new(1)).unwrap();
    assert_eq!(equal.interval, Some([1.0, 1.0]));
    let [low, high] = equal.known_to(&[(0.3, 0.4); 20]).interval.unwrap();
    assert!(low < 0.99 && (low * high - 1.0).abs() < 1e-12);
}

#[test]
fn four_verdicts() {
    assert_eq!(verdict(24, -0.3, 0.4), Verdict::Better);
    assert_eq!(verdict(24, 0.3, 0.4), Verdict::Worse);
    assert_eq!(verdict(24, 0.0, 0.4), Verdict::Undecided);
    assert_eq!(verdict(24, 0.0, 0.004), Verdict::Same);
    // Sure, and within the band.
    assert_eq!(verdict(24, 0.005, 0.001), Verdict::Same);
    assert_eq!(verdict(24, 0.02, 0.001), Verdict::Worse);
    // Too few to tell, however clear.
    assert_eq!(verdict(5, -3.0, 0.1), Verdict::Undecided);
    assert_eq!(verdict(6, -3.0, 0.1), Verdict::Better);
}

#[test]
fn mean_and_sign_must_agree() {
    // A single material on which A is hopeless: the test leans to A, the mean does not.
    let mut one = pairs(30, -0.1, 0.05);
    one[7] = (1.0, 1e-6);
    let one = compared(&one);
    assert!(one.p.unwrap() < 1e-4 && one.ratio > 1.0);
    assert_eq!(one.verdict(), Verdict::Undecided);
    // Five of thirty differ, all to one side: the mean leans, the sign cannot be tested.
    let mut five = vec![(0.1, 0.1); 25];
    five.extend(pairs(5, -2.0, 0.1));
    let five = compared(&five);
    assert!(five.interval.unwrap()[1] < 1.0);
    assert_eq!((five.p, five.verdict()), (None, Verdict::Undecided));
}

#[test]
fn known_ratios() {
    let pairs = [
        (1.0, 2.0),
        (3.0, 1.5),
        (0.1, 0.4),
        (0.0, 1e-15),
        (1.005, 1.0),
    ];
    let found = compared(&pairs);
    assert!((found.ratio / (0.25f64 * 1.005).powf(0.2) - 1.0).abs() < 1e-14);
    assert_eq!((found.wins, found.losses, found.ties), (2, 1, 2));
    assert_eq!((found.n, found.interval, found.p), (5, None, None));
    // The interval is that of the log ratios, sorted by size.
    let logs = [-0.1, 0.2, -0.3, 0.4, 0.5, -0.6f64];
    let six = logs.map(|l| (l.exp(), 1.0));
    let got = compared(&six).interval.unwrap();
    let expected = Bootstrap::new(1).mean_interval(&logs).unwrap();
    for (g, e) in got.iter().zip(expected) {
        assert!((g.ln() - e).abs() < 1e-14, "{got:?}");
    }
}

#[test]
fn exchanged_and_shuffled() {
    let pairs = pairs(24, -0.1, 0.4);
    let found = compared(&pairs);
    let swapped: Vec<_> = pairs.iter().map(|(a, b)| (*b, *a)).collect();
    let back = compared(&swapped);
    let [low, high] = found.interval.unwrap();
    let [low_back, high_back] = back.interval.unwrap();
    for product in [found.ratio * back.ratio, low * high_back, high * low_back] {
        assert!((product - 1.0).abs() < 1e-13, "{product}");
    }
    assert_eq!(found.p, back.p);
    assert_eq!([found.wins, found.losses], [back.losses, back.wins]);
    let mut turned = pairs.clone();
    turned.reverse();
    assert_eq!(Paired::new(&turned, BAND, &Bootstrap::new(1)), Some(found));
}

#[test]
fn refuses_what_is_no_error() {
    for bad in [f64::NAN, f64::INFINITY, -0.1] {
        assert_eq!(Paired::new(&[(0.1, bad)], BAND, &Bootstrap::new(1)), None);
        assert_eq!(Paired::new(&[(bad, 0.1)], BAND, &Bootstrap::new(1)), None);
        assert_eq!(Paired::new(&[(0.1, 0.1)], bad, &Bootstrap::new(1)), None);
    }
    assert_eq!(Paired::new(&[(0.1, 0.1)], 0.99, &Bootstrap::new(1)), None);
    assert_eq!(Paired::new(&[], BAND, &Bootstrap::new(1)), None);
}

#[test]
fn many_comparisons_need_more() {
    // Of one true difference in forty comparisons the true one stays, and false ones go.
    let alone: Vec<Paired> = (0..40)
        .map(|k| {
            let wave = |i: u32| f64::from((i * i + 31 * k) * (i + 7)).sin();
            let pair = |i| ((0.3 * wave(i)).exp() * if k == 0 { 0.7 } else { 1.0 }, 1.0);
            compared(&(1..=24).map(pair).collect::<Vec<_>>())
        })
        .collect();
    let together = Paired::adjusted(&alone);
    let found = |list: &[Paired]| -> Vec<usize> {
        let is_decided = |k: &usize| list[*k].verdict() != Verdict::Undecided;
        (0..40).filter(is_decided).collect()
    };
    assert!(found(&alone).len() > 1, "no false finding to lose");
    assert_eq!(found(&together), [0]);
    let none = compared(&[(0.1, 0.2)]);
    assert_eq!(Paired::adjusted(&[none]), [none]);
}
