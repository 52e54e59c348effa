use super::super::kernel::{self, Kernel};
use super::super::prior::PriorFile;
use super::super::system::{self, MEAN, NUGGET};
use super::*;
use crate::geometry::Direction;
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

/// Errors that readings share.
fn shared(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.01 * (1 + i % 4) as f64).collect()
}

/// Both processes of some readings.
fn whole_and_local(data: &Data) -> (Posterior, LocalPosterior) {
    let (kernel, shared) = (Kernel::new(Symmetry::FULL), shared(data.sites.len()));
    let whole = given(&kernel, data.clone()).sharing(&shared);
    let space = Space::usual(Symmetry::FULL);
    let local = LocalPosterior::given(&kernel, data.clone(), space, &shared).unwrap();
    (whole, local)
}

#[test]
fn of_few_readings_the_nearest_are_all() {
    let near = |a: &[f64], b: &[f64]| {
        assert_eq!(a.len(), b.len());
        let are_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6 * (1e-3 + b.abs());
        assert!(a.iter().zip(b).all(are_near), "{a:?} {b:?}");
    };
    for n in [1, 40, 64] {
        let (whole, local) = whole_and_local(&data(&pairs(0, n)));
        let (at, further) = (pairs(1000, 30), pairs(2000, 9));
        let places = whole.places(&at);
        let nearby = local.at(&at).unwrap();
        let all: [&dyn Estimates; 2] = [&(&whole, &places), &nearby];
        let [a, b] = all;
        assert!((a.scale() / b.scale() - 1.0).abs() < 1e-9);
        near(&a.means(), &b.means());
        near(&a.variances(), &b.variances());
        near(&a.surprise(), &b.surprise());
        near(&a.noise(), &b.noise());
        let known = local.predict(&at, &[]).unwrap();
        let errors: Vec<f64> = known.iter().map(|known| known[0].shared.sqrt()).collect();
        near(&whole.shared(&places), &errors);
        // The farthest reading bounds what is near enough to have a covariance.
        let with = [a, b].map(|of| of.covariances_with(3));
        let far = (0..at.len()).filter(|&i| {
            let off = (with[0][i] - with[1][i]).abs();
            assert!(with[1][i] == 0.0 || off < 1e-9, "{n} {i}");
            off > 1e-9
        });
        assert!(far.count() < at.len() / 2 || n == 1);
        // Supposed readings: those nearer than the farthest.
        let (whole, local) = (
            whole.supposing(&further, false).unwrap(),
            local.supposing(&further).unwrap(),
        );
        let places = whole.places(&at);
        let nearby = local.at(&at).unwrap();
        near(&whole.readable(&places), &nearby.readable());
        for (a, b) in whole.variances(&places).iter().zip(nearby.variances()) {
            assert!(b >= a - 1e-9, "{n}");
        }
    }
}

/// Readings on lines: about as many pairs, each with the sensor on a half circle.
fn on_lines(lines: usize, n: usize) -> Vec<DirectionPair> {
    let of = |k: usize| {
        let light = pairs(300 + (k % lines) as u64, 1)[0].omega_i;
        let theta = (k / lines) as f64 / (n / lines) as f64 * 1.4;
        DirectionPair::new(light, Direction::from_spherical(theta, (k % lines) as f64))
    };
    (0..n).map(of).collect()
}

#[test]
fn readings_on_lines_determine_what_lies_between() {
    let read = on_lines(6, 1500);
    let readings = Data {
        noise: vec![1e-4; 1500],
        ..data(&read)
    };
    let (whole, local) = whole_and_local(&readings);
    let at = pairs(5000, 60);
    let sum = |variances: Vec<f64>| variances.iter().map(|v| v.sqrt()).sum::<f64>();
    let more = sum(local.at(&at).unwrap().variances()) / sum(whole.variances(&whole.places(&at)));
    assert!((1.0..1.05).contains(&more), "{more}");
}

#[test]
fn the_nearest_readings_of_many_say_nearly_as_much_as_all() {
    let readings = Data {
        noise: vec![1e-4; 1200],
        ..data(&pairs(0, 1200))
    };
    let (whole, local) = whole_and_local(&readings);
    let at = pairs(5000, 60);
    let places = whole.places(&at);
    let nearby = local.at(&at).unwrap();
    let sum = |variances: Vec<f64>| variances.iter().map(|v| v.sqrt()).sum::<f64>();
    let more = sum(nearby.variances()) / sum(whole.variances(&places));
    assert!((1.0..1.03).contains(&more), "{more}");
    // Covariances of two pairs, and sums over all.
    let (a, b) = (
        nearby.covariances_with(7),
        (&whole, &places).covariances_with(7),
    );
    let off = (a - &b).amax() / b[7];
    assert!(off < 0.05, "{off}");
    let weights = DMatrix::from_element(60, 1, 1.0 / 60.0);
    let of = |process: &Posterior| {
        let places = process.places(&at);
        process.variances_of_sums(&places, &weights, &[]).unwrap()[0]
    };
    let more = of(&local.about(&at).unwrap()) / of(&whole);
    assert!((1.0 - 1e-9..1.05).contains(&more), "{more}");
}

#[test]
#[ignore = "thorough: a system of 4000 readings"]
fn of_4000_readings_errors_are_expected_within_3_percent() {
    for noise in [1e-6_f64, 1e-4, 4e-4] {
        let read = pairs(0, 4000);
        let lobe = |pair: &DirectionPair| {
            let [i, o] = pair.vectors();
            let cosine = (i + o).normalize().z;
            (0.05 + (-(1.0 - cosine * cosine) / 0.02).exp()).ln() - MEAN
        };
        let off = |i: usize| noise.sqrt() * (i as f64 * 0.77).sin() * 2.0_f64.sqrt();
        let data = Data {
            noise: vec![NUGGET + noise; 4000],
            values: DMatrix::from_fn(4000, 1, |i, _| lobe(&read[i]) + off(i)),
            ..data(&read)
        };
        let (whole, local) = whole_and_local(&data);
        let at = pairs(9000, 400);
        let places = whole.places(&at);
        let nearby = local.at(&at).unwrap();
        let expected = |of: &dyn Estimates| {
            let all = of.variances().into_iter();
            all.map(|v| (v * of.scale()).sqrt()).sum::<f64>()
        };
        let ratio = expected(&nearby) / expected(&(&whole, &places));
        assert!((ratio - 1.0).abs() < 0.03, "{noise}: {ratio}");
    }
}
