use super::super::kernel::{self, Kernel};
use super::super::prior::PriorFile;
use super::super::system::{self, MEAN, NUGGET};
use super::*;
use crate::sampling::{Random, cosine_hemisphere};

fn pairs(first: u64, n: usize) -> Vec<DirectionPair> {
    let random = Random::new(5);
    let pair = |i: u64| {
        let u: [f64; 4] = random.point(i);
        DirectionPair::new(
            cosine_hemisphere([u[0], u[1]]),
            cosine_hemisphere([u[2], u[3]]),
        )
    };
    (first..first + n as u64).map(pair).collect()
}

fn data(pairs: &[DirectionPair]) -> Data {
    let n = pairs.len();
    Data {
        sites: Sites::new(pairs, &Space::usual(Symmetry::FULL), None),
        // Enough for an inverse to keep nine digits.
        noise: (0..n).map(|i| 0.01 * (1 + i % 3) as f64).collect(),
        values: DMatrix::from_fn(n, 1, |i, _| (i as f64 * 0.7).sin()),
    }
}

fn given(kernel: &Kernel, data: Data) -> Posterior {
    Posterior::given(
        Covariance::new(kernel),
        None,
        data,
        Space::usual(Symmetry::FULL),
    )
    .unwrap()
}

/// The process of some readings, and the covariance of two lists by the formula.
fn process(
    read: &[DirectionPair],
) -> (
    Posterior,
    impl Fn(&[DirectionPair], &[DirectionPair]) -> DMatrix<f64>,
) {
    let kernel = Kernel::new(Symmetry::FULL);
    let process = given(&kernel, data(read));
    let by_formula = move |a: &[DirectionPair], b: &[DirectionPair]| {
        let [a, b] = [a, b].map(|list| kernel::usual_columns(list, Symmetry::FULL));
        DMatrix::from_fn(a.len(), b.len(), |i, j| {
            kernel.level + system::tests::by_formula(&kernel, &a[i], &b[j])
        })
    };
    (process, by_formula)
}

#[test]
fn means_and_covariances_are_those_of_the_textbook() {
    // Rasmussen & Williams 2006, (2.23) and (2.24), by an inverse.
    for n in [1, 7, 100, 200] {
        let (read, at) = (pairs(0, n), pairs(1000, 150));
        let (process, k) = process(&read);
        let mut of_readings = k(&read, &read);
        for (i, noise) in data(&read).noise.iter().enumerate() {
            of_readings[(i, i)] += noise;
        }
        let inverse = of_readings.try_inverse().unwrap();
        let with = k(&at, &read);
        let means = &with * &inverse * data(&read).values;
        let covariances = k(&at, &at) - &with * &inverse * with.transpose();
        let places = process.places(&at);
        let found = process.covariances(&places, &places);
        assert!((&found - &covariances).amax() < 1e-7, "{n}");
        let off = process.means(&places).into_iter().zip(means.iter());
        assert!(off.map(|(a, b)| (a - MEAN - b).abs()).fold(0.0, f64::max) < 1e-7);
        let variances = process.variances(&places).into_iter().enumerate();
        for (i, v) in variances {
            assert!((v - covariances[(i, i)]).abs() < 1e-7, "{n} {i}");
        }
    }
}

#[test]
fn a_prior_adds_its_functions() {
    let prior = PriorFile::from(std::path::PathBuf::from("built-in"))
        .load()
        .unwrap();
    let kernel = prior.kernel(Kernel::new(Symmetry::FULL));
    let (read, at) = (pairs(0, 20), pairs(1000, 30));
    let sites = |list: &[DirectionPair]| {
        Sites::new(
            list,
            &Space::usual(Symmetry::FULL),
            Some(prior.basis_at(list)),
        )
    };
    // One of two materials, each as likely as the other.
    let centres = [1.0, 2.0]
        .map(|k: f64| DMatrix::from_fn(prior.functions(), 1, |i, _| (k * i as f64).cos()));
    let centre = (&centres[0] + &centres[1]) / 2.0;
    let spread = centres.clone().map(|c| (c - &centre) * 0.5_f64.sqrt());
    let spread = DMatrix::from_columns(&spread.map(|c| c.column(0).into_owned()));
    let mut data = Data {
        sites: sites(&read),
        ..data(&read)
    };
    let values = data.values.clone();
    data.centre(&centre);
    let known = Known {
        prior: Arc::clone(&prior),
        centre: Centre {
            mean: centre.clone(),
            spread,
        },
    };
    let covariance = Covariance::new(&kernel);
    let process =
        Posterior::given(covariance, Some(known), data, Space::usual(Symmetry::FULL)).unwrap();
    // The posterior by inverses of dense matrices.
    let k = |a: &[DirectionPair], b: &[DirectionPair]| {
        let [a, b] = [sites(a), sites(b)];
        let plain = Covariance::new(&Kernel {
            share: 0.0,
            ..kernel.clone()
        });
        let plain = plain.between(&a.rows(), &b, 0..b.len());
        plain + a.functions.tr_mul(&b.functions) * kernel.share
    };
    let mut of_readings = k(&read, &read);
    for i in 0..20 {
        of_readings[(i, i)] += 0.01 * (1 + i % 3) as f64;
    }
    let inverse = of_readings.try_inverse().unwrap();
    let (here, there) = (sites(&read).functions, sites(&at));
    let with = k(&at, &read);
    let about = |centre: &DMatrix<f64>| {
        let off = &values - here.tr_mul(centre);
        &with * &inverse * off + there.functions.tr_mul(centre)
    };
    let places = process.places(&at);
    let expected = about(&centre);
    for (i, z) in process.means(&places).iter().enumerate() {
        assert!((z - there.mean[i] - expected[(i, 0)]).abs() < 1e-7, "{i}");
    }
    let mut expected = k(&at, &at) - &with * &inverse * with.transpose();
    for one in &centres {
        let off = about(one) - about(&centre);
        expected += &off * off.transpose() * 0.5;
    }
    let found = process.covariances(&places, &places);
    assert!((&found - &expected).amax() < 1e-7);
    for (i, v) in process.variances(&places).into_iter().enumerate() {
        assert!((v - expected[(i, i)]).abs() < 1e-7, "{i}");
    }
}

#[test]
fn readings_are_predicted_as_if_they_were_left_out() {
    let read = pairs(0, 40);
    let (process, _) = process(&read);
    let kernel = Kernel::new(Symmetry::FULL);
    let all = data(&read);
    for (i, square) in process.left_out().into_iter().enumerate() {
        let others: Vec<usize> = (0..read.len()).filter(|j| *j != i).collect();
        let without = Data {
            sites: all.sites.select(&others),
            noise: others.iter().map(|&j| all.noise[j]).collect(),
            values: all.values.select_rows(&others),
        };
        let without = given(&kernel, without);
        let place = without.places(&read[i..=i]);
        let off = without.means(&place)[0] - MEAN - all.values[i];
        let variance = without.variances(&place)[0] + all.noise[i];
        let expected = off * off / (variance * process.scale);
        assert!(
            (square / expected - 1.0).abs() < 1e-5,
            "{i}: {square} {expected}"
        );
    }
}

#[test]
fn further_readings_leave_variances_and_change_no_mean() {
    let (read, further, at) = (pairs(0, 60), pairs(60, 20), pairs(1000, 40));
    let (process, _) = process(&read);
    let (places, more) = (process.places(&at), process.places(&further));
    let (means, scale) = (process.means(&places), process.scale);
    // The variances that they leave once they are there.
    let mut all = data(&[read, further.clone()].concat());
    all.noise[60..].fill(NUGGET);
    let with = given(&Kernel::new(Symmetry::FULL), all);
    let left = with.variances(&with.places(&at));
    let expected = process.variances_with(&places, &more).unwrap();
    let supposed = process.supposing(&further, true).unwrap();
    let places = supposed.places(&at);
    assert_eq!(supposed.scale, scale);
    for (a, b) in supposed.means(&places).into_iter().zip(means) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    let variances = supposed.variances(&places).into_iter();
    for ((expected, left), supposed) in expected.into_iter().zip(left).zip(variances) {
        assert!((expected - left).abs() < 1e-7, "{expected} {left}");
        assert!((expected - supposed).abs() < 1e-6, "{expected} {supposed}");
    }
}

#[test]
fn without_readings_nothing_is_known() {
    let process = Posterior::before(Symmetry::FULL, None);
    let places = process.places(&pairs(0, 3));
    assert_eq!(process.means(&places), places.sites.mean);
    assert!(process.variances(&places).iter().all(|v| *v > 25.0));
    assert_eq!(process.covariances(&places, &places).shape(), (3, 3));
}
