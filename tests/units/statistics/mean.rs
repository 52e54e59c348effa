use gonio::statistics::{geometric_mean, mean_and_error, upper_quantile};

#[test]
fn means_of_logs() {
    // scipy.stats.gmean([0.02, 0.3, 1.7, 5e-4])
    let mean = geometric_mean(&[0.02, 0.3, 1.7, 5e-4]).unwrap();
    assert!((mean / 0.047_521_762_994_729_51 - 1.0).abs() < 1e-14);
    // sqrt(1e-12 · 1)
    let floored = geometric_mean(&[0.0, 1.0]).unwrap();
    assert!((floored / 1e-6 - 1.0).abs() < 1e-14);
    assert_eq!(geometric_mean(&[1e-300]), geometric_mean(&[0.0]));
}

#[test]
fn one_more_value_is_below_as_often_as_is_said() {
    // Of n + 1 values in any order the last is below the quantile of the others in at least that share.
    for n in [9, 10, 19, 40] {
        let all: Vec<f64> = (0..=n).map(|i| f64::from(i * 7919 % (n + 1))).collect();
        let below = (0..all.len()).filter(|&last| {
            let mut others = all.clone();
            let value = others.remove(last);
            value <= upper_quantile(&others, 0.9).unwrap()
        });
        let share = below.count() as f64 / all.len() as f64;
        assert!(
            (0.9..0.9 + 1.0 / f64::from(n)).contains(&share),
            "{n}: {share}"
        );
    }
    assert_eq!(upper_quantile(&[1.0; 8], 0.9), None);
    assert_eq!(upper_quantile(&[], 0.0), None);
}

#[test]
fn means_are_known_to_their_errors() {
    // scipy.stats.sem([1, 2, 4, 9])
    let (mean, error) = mean_and_error(&[1.0, 2.0, 4.0, 9.0]).unwrap();
    assert_eq!(mean, 4.0);
    assert!((error.unwrap() - 1.779_513_042_005_219).abs() < 1e-12);
    assert_eq!(mean_and_error(&[3.0]), Some((3.0, None)));
    assert_eq!(mean_and_error(&[]), None);
}

#[test]
fn no_mean_where_an_error_is_none() {
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(geometric_mean(&[1.0, bad]), None, "{bad}");
    }
    assert_eq!(geometric_mean(&[]), None);
}
