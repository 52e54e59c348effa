//! Laws of priors.
use super::super::posterior::Posterior;
use super::super::space::Space;
use super::super::system::Sites;
use super::super::{Kriging, LOG};
use super::*;
use crate::brdf::testing::made;
use crate::brdf::{Brdf, Channels};
use crate::instrument::{Ideal, Instrument};
use crate::measurement::Measurement;
use crate::reconstruct::Reconstruct;
use crate::schedule::SobolSet;

/// ln(f + ε) = Σ c_k q_k, of functions that are smooth on the lattice.
fn log(c: [f64; 3], pair: &DirectionPair) -> f64 {
    let half = pair.half();
    let (lifted, facing) = (half.z, half.dot(pair.omega_i.vector()));
    let q = [1.0 - lifted, (1.0 - facing).powi(2), lifted * facing];
    c.iter().zip(q).map(|(c, q)| c * q).sum()
}

/// A BRDF with such a logarithm in each channel.
fn member<const N: usize>(c: [[f64; 3]; N]) -> impl Brdf {
    made(Symmetry::FULL, move |pair| {
        Some(c.map(|c| LOG.inverse(log(c, pair))))
    })
}

/// Members of several families of names.
fn trained() -> Training {
    let mut training = Training::new(2000).unwrap();
    for i in 0..24 {
        let u = |k: f64| 4.0 * (f64::from(i + 1) * k).fract() - 2.0;
        let member = member([[0.8192, 0.6710, 0.5497].map(u)]);
        let name = format!("{i}-{}", ["wood", "paint", "felt"][i as usize % 3]);
        training.add(&name, &format!("{i}"), &member).unwrap();
    }
    training
}

fn measured(brdf: &dyn Brdf, budget: usize) -> Measurement {
    let schedule = SobolSet {}.plan(&usual_form(Symmetry::FULL), budget, 3);
    Ideal.measure(brdf, &Arc::new(schedule.unwrap()))
}

fn file(prior: &Prior) -> (tempfile::NamedTempFile, PriorFile) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(&file, prior.to_bytes()).unwrap();
    let named = PriorFile::from(file.path().to_owned());
    (file, named)
}

#[test]
fn what_is_expected_is_of_what_is_reconstructed() {
    let (_file, prior) = file(&trained().prior(80).unwrap());
    let kriging = Kriging {
        prior: Some(prior),
        ..Kriging::default()
    };
    // So far from the materials of the prior that both accounts have weight.
    let odd = made(Symmetry::FULL, |pair| {
        let more = 0.6 * (9.0 * pair.half().z).sin();
        Some([LOG.inverse(log([1.3, -0.7, 0.4], pair) + more)])
    });
    let readings = measured(&odd, 14);
    let (processes, _) = Posterior::all(&kriging, &readings).unwrap();
    let shares: Vec<f64> = processes.iter().map(|p| p.0).collect();
    assert!(
        shares.len() == 2 && shares[0].min(shares[1]) > 0.02,
        "{shares:?}"
    );
    let pairs: Vec<_> = measured(&odd, 60)
        .schedule
        .poses
        .iter()
        .map(|p| p.pair)
        .collect();
    let known = kriging
        .predictive(&readings)
        .unwrap()
        .unwrap()
        .predict(&pairs);
    let copy = kriging.reconstruct(&readings).unwrap();
    let of = |(_, process): &(f64, Posterior)| {
        let places = process.places(&pairs);
        let variances = process.variances(&places).into_iter();
        let variances = variances.map(|v| v * process.scale);
        (process.means(&places), variances.collect::<Vec<f64>>())
    };
    let [(a, of_a), (b, of_b)] = [0, 1].map(|k| of(&processes[k]));
    for (i, known) in known.iter().enumerate() {
        let f = copy.luminance(&pairs[i]).unwrap();
        // Its level has a variance, where that of a reconstruction comes from the readings alone.
        let off = (LOG.forward(f) - known.mean).abs();
        assert!(
            off < 0.1 * known.variance.sqrt(),
            "{i}: {off} {}",
            known.variance
        );
        // What both leave, and how far they are apart.
        let apart = shares[0] * shares[1] * (a[i] - b[i]).powi(2);
        let variance = shares[0] * of_a[i] + shares[1] * of_b[i] + apart;
        assert!((known.variance / variance - 1.0).abs() < 1e-9, "{i}");
    }
}

#[test]
fn a_material_that_it_was_made_of_is_recognized() {
    let prior = trained().prior(80).unwrap();
    let member_6 = [0.8192, 0.6710, 0.5497].map(|k: f64| 4.0 * (6.0 * k).fract() - 2.0);
    let readings = measured(&member([member_6]), 12);
    let pairs: Vec<_> = readings.schedule.poses.iter().map(|p| p.pair).collect();
    let sites = Sites::new(
        &pairs,
        &Space::usual(Symmetry::FULL),
        Some(prior.basis_at(&pairs)),
    );
    let values = pairs
        .iter()
        .zip(&sites.mean)
        .map(|(p, m)| log(member_6, p) - m);
    let data = Data {
        values: DMatrix::from_iterator(12, 1, values),
        noise: vec![1e-5; 12],
        sites,
    };
    // One that leaves next to nothing to chance.
    let kernel = Kernel::new(Symmetry::FULL).about(1e-6, 1e-4, 1e-4);
    let (centre, _) = prior.centred(&kernel, &data).unwrap();
    let likeliest = prior.centres.column(5);
    assert!((centre.mean.column(0) - likeliest).norm() < 0.01 * likeliest.norm());
}

#[test]
fn means_are_sums_of_functions() {
    let prior = trained().prior(80).unwrap();
    assert_eq!(prior.functions(), 3);
    let pairs: Vec<_> = measured(&member([[0.0; 3]]), 50).schedule.poses.clone();
    let pairs: Vec<_> = pairs.iter().map(|p| p.pair).collect();
    let (mean, functions) = prior.basis_at(&pairs);
    let coefficients = DMatrix::from_row_slice(3, 2, &[0.3, 1.0, -2.0, 0.0, 0.7, 5.0]);
    let mut out = vec![0.0; 100];
    prior.mean(&coefficients).add(&pairs, &mut out);
    let expected = functions.tr_mul(&coefficients);
    for i in 0..50 {
        for c in 0..2 {
            assert!((out[2 * i + c] - mean[i] - expected[(i, c)]).abs() < 1e-12);
        }
    }
}

#[test]
fn a_file_says_what_was_written_or_that_it_does_not() {
    let prior = trained().prior(2).unwrap();
    assert_eq!((prior.functions(), prior.materials().len()), (2, 24));
    let bytes = prior.to_bytes();
    let pairs = [DirectionPair::from_spherical(0.3, 0.0, 0.5, 1.0)];
    let back = Prior::decode(&bytes).unwrap();
    assert_eq!(back.basis_at(&pairs), prior.basis_at(&pairs));
    assert_eq!(back.materials(), prior.materials());
    let end = bytes.iter().position(|b| *b == b'\n').unwrap();
    let line = std::str::from_utf8(&bytes[..end]).unwrap();
    let told = |line: &str, body: &[u8]| {
        let all = [line.as_bytes(), b"\n", body].concat();
        Prior::decode(&all).unwrap_err()
    };
    let body = &bytes[end + 1..];
    assert_eq!(told(line, &body[..body.len() - 2]), "it was changed or cut");
    let other = line.replace("\"gonio_prior\":2", "\"gonio_prior\":9");
    assert_eq!(told(&other, body), "it has version 9, this program reads 2");
    for (key, value) in [
        ("nodes", "2000000000000"),
        ("functions", "18446744073709551615"),
        ("centres", "1"),
        ("scale", "-1.0"),
        ("share", "0.0"),
    ] {
        let start = line.find(&format!("\"{key}\":")).unwrap();
        let end = start + line[start..].find(',').unwrap();
        let other = format!("{}\"{key}\":{value}{}", &line[..start], &line[end..]);
        assert_eq!(told(&other, body), "it was changed or cut");
        // With a hash that fits the changed line.
        let mut about: About = serde_json::from_str(&other).unwrap();
        about.blake3 = file::hash(&about, body);
        let other = serde_json::to_string(&about).unwrap();
        assert_eq!(told(&other, body), "its numbers do not suit each other");
    }
    assert_eq!(told("kind,value", body), "it is something else");
    assert_eq!(Prior::decode(b"").unwrap_err(), "it is something else");
}

#[test]
fn a_member_of_a_family_is_known_from_as_many_readings_as_it_has_coefficients() {
    let c = [1.3, -0.7, 0.4];
    let brdf = member([c]);
    let (_file, prior) = file(&trained().prior(80).unwrap());
    let at = &measured(&brdf, 300).schedule.poses;
    // Mean errors of ln(f + ε).
    let [with, without] = [Some(prior), None].map(|prior| {
        let kriging = Kriging {
            prior,
            ..Kriging::default()
        };
        let copy = kriging.reconstruct(&measured(&brdf, 4)).unwrap();
        let off = at.iter().map(|pose| {
            let f = copy.luminance(&pose.pair).unwrap();
            (LOG.forward(f) - log(c, &pose.pair)).abs()
        });
        off.sum::<f64>() / at.len() as f64
    });
    assert!(with < 0.02 && with < 0.2 * without, "{with} {without}");
}

#[test]
fn each_channel_is_what_it_is_alone() {
    let members = [[1.3, -0.7, 0.4], [-1.0, 0.2, 1.5], [0.3, 1.4, -1.2]];
    let coloured = member(members);
    let (_file, prior) = file(&trained().prior(80).unwrap());
    // Shares are those of all channels together: one kernel and one share for each.
    let kriging = Kriging {
        prior: Some(prior),
        fit: false,
        ..Kriging::default()
    };
    let copy = kriging.reconstruct(&measured(&coloured, 5)).unwrap();
    for pose in &measured(&coloured, 100).schedule.poses {
        let mut f = [0.0; 3];
        let _ = copy.eval(&pose.pair, &mut f);
        for (f, member) in f.iter().zip(members) {
            let off = LOG.forward(*f) - log(member, &pose.pair);
            assert!(off.abs() < 0.15, "{off} at {pose:?}");
        }
    }
}

#[test]
fn what_contradicts_a_prior_is_reconstructed_without_it() {
    let stripes = made(Symmetry::FULL, |pair| {
        Some([(8.0 * (60.0 * pair.half().z).sin()).exp()])
    });
    let (_file, prior) = file(&trained().prior(80).unwrap());
    let readings = measured(&stripes, 30);
    let copy = |prior| {
        let kriging = Kriging {
            prior,
            ..Kriging::default()
        };
        kriging.reconstruct(&readings).unwrap()
    };
    let [with, without] = [Some(prior), None].map(copy);
    assert_eq!(with.remarks().len(), 1);
    for pose in &readings.schedule.poses {
        let [a, b] = [&with, &without].map(|copy| copy.luminance(&pose.pair));
        assert_eq!(a, b);
    }
}

#[test]
fn what_is_no_material_of_a_prior_is_refused() {
    let mut training = Training::new(2000).unwrap();
    training.add("a", "a", &member([[0.0; 3]])).unwrap();
    let skew = crate::brdf::all();
    let ward = skew.iter().find(|e| e.kind == "ward").unwrap();
    let ward = crate::registry::read_text(ward, "alpha = [0.1, 0.3]\nrho_s = 0.3").unwrap();
    let ward = ward.build(Channels::Luminance).unwrap();
    let told = training.add("w", "w", &*ward).unwrap_err().to_string();
    assert!(told.contains("w is not isotropic"), "{told}");
    let told = training.prior(80).unwrap_err().to_string();
    assert!(told.contains("at least 2"), "{told}");
}

/// The file that is a part of the program.
static BYTES: &[u8] = include_bytes!("built-in.gonio");

#[test]
fn the_prior_of_formulas_is_there() {
    let prior = PriorFile::from(PathBuf::from("built-in")).load().unwrap();
    assert!(prior.materials().len() > 50 && prior.to_bytes() == BYTES);
    assert!(BYTES.len() <= 300_000);
}
