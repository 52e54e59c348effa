//! What uncertainties of readings make of their reconstruction.

use super::common::{
    Level, bent, levels, made, model, near, peak_resolving, planned, test_pairs, views,
};
use super::layouts::{named, pair, readings_of, scattered, schedule};
use super::{each, form, method, methods, read, smooth, value};
use gonio::brdf::Brdf;
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::measurement::{Details, Flags, Measurement};
use gonio::metrics::{self, Measure, MetricsSpec};
use gonio::moments::{Channel, Component, Profile};
use gonio::parametrization;
use gonio::reconstruct::{Cover, Coverage, Estimated, Reconstruct, Replicated, Uncertain};
use gonio::sampling::Random;
use gonio::validation::{CrossValidation, ReferenceReadings};
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;

levels! {
    kriging_errs_as_it_says: "thorough: more lobes, noises and draws";
    moments_of_readings_err_as_they_say: "thorough: ten materials, more readings and views";
}

/// Readings of a smooth material with uncertainties of both types, shares of their values.
fn readings(angles: &[[f64; 3]], type_a: f64, type_b: f64) -> Measurement {
    let mut m = read(schedule(angles), |pair| smooth(Symmetry::FULL, pair));
    let share = |u: f64| m.values.iter().map(|v| u * v).collect();
    let (type_a, type_b) = (share(type_a), share(type_b));
    let details = m.details.as_mut().unwrap();
    (details.type_a, details.type_b) = (type_a, type_b);
    m
}

fn replicated(m: &Measurement, method: &dyn Reconstruct) -> Replicated {
    Replicated::of(m, method).unwrap().unwrap()
}

fn is_predictive(method: &dyn Reconstruct, m: &Measurement) -> bool {
    method.predictive(m).unwrap().is_some()
}

fn pairs() -> Vec<DirectionPair> {
    test_pairs(Measure::Cosine, 500)
}

fn scattered_methods() -> impl Iterator<Item = Box<dyn Reconstruct>> {
    methods().into_iter().filter(|m| !m.needs_grid())
}

/// Lets readings err by their type A.
pub fn err(m: &mut Measurement, seed: u64) {
    let random = Random::new(seed);
    let Some(details) = &m.details else { return };
    for (i, (value, u)) in m.values.iter_mut().zip(&details.type_a).enumerate() {
        let z: f64 = StandardNormal.sample(&mut random.stream(i as u64));
        *value += u * z;
    }
}

#[test]
fn the_nearest_reading_gives_its_own_uncertainty() {
    let mut m = readings(&scattered(300), 0.0, 0.01);
    let details = m.details.as_mut().unwrap();
    for (i, u) in details.type_a.iter_mut().enumerate() {
        *u = 1e-3 * (1 + i % 7) as f64;
    }
    let nearest = replicated(&m, &*method("nearest", ""));
    let details = m.details.as_ref().unwrap();
    let pairs: Vec<_> = m.schedule.poses.iter().map(|p| p.pair).collect();
    for (i, u) in nearest.luminance_at(&pairs).into_iter().enumerate() {
        assert_eq!(u.value, m.values[i]);
        assert!((u.type_a / details.type_a[i] - 1.0).abs() < 1e-9, "{i}");
        assert!((u.type_b / details.type_b[i] - 1.0).abs() < 1e-9, "{i}");
    }
}

/// The only uncertain reading makes its surroundings uncertain, and nothing far from it.
#[test]
fn the_uncertainty_of_a_reading_decays_around_it() {
    let mut angles = scattered(600);
    angles.push([40.0, 20.0, 60.0]);
    // Nothing beside that of the last.
    let mut m = readings(&angles, 1e-9, 0.0);
    let last = m.values.len() - 1;
    let u = 0.01 * m.values[last];
    m.details.as_mut().unwrap().type_a[last] = u;
    for method in scattered_methods() {
        let of = replicated(&m, &*method);
        let at =
            |theta_o: f64, phi: f64| of.luminance_at(&[pair([40.0, theta_o, phi])])[0].type_a / u;
        if is_predictive(&*method, &m) {
            // Least where the readings are, and never less than nothing beside.
            assert!(at(20.0, 60.0) < at(89.0, 175.0), "{}", method.label());
            continue;
        }
        let (here, far) = (at(20.0, 60.0), at(75.0, 175.0));
        // Where uncertain readings are missed for the sake of the others, less is left.
        let least = if method.weighs_readings() { 0.0 } else { 0.97 };
        assert!((least..1.03).contains(&here), "{}: {here}", method.label());
        assert!(far < 0.02, "{}: {far}", method.label());
    }
}

#[test]
fn the_plain_part_is_the_reconstruction() {
    let m = readings(&scattered(400), 0.05, 0.02);
    for method in scattered_methods() {
        let brdf = method.reconstruct(&m).unwrap();
        let of = replicated(&m, &*method);
        for (pair, u) in pairs().iter().zip(of.luminance_at(&pairs())) {
            near(u.value / value(&*brdf, pair), 1.0, 1e-12, method.label());
        }
    }
}

/// A mean of independent errors is less than each.
#[test]
fn a_mean_is_less_uncertain_than_readings() {
    let m = readings(&scattered(1500), 0.05, 0.0);
    let mean = |method: Box<dyn Reconstruct>| {
        let of = replicated(&m, &*method).luminance_at(&pairs());
        of.iter().map(|u| u.type_a / u.value).sum::<f64>() / of.len() as f64
    };
    let nearest = mean(method("nearest", ""));
    let several = mean(method("inverse-distance", ""));
    assert!((nearest - 0.05).abs() < 1e-3, "{nearest}");
    assert!(several < 0.8 * nearest, "{several} of {nearest}");
}

/// Readings of Lambert's law err by nothing but their uncertainties; those of a lobe say nothing of what is
/// between them.
#[test]
fn readings_alone_are_within_their_uncertainty() {
    let share = |name: &str, claimed: f64| {
        let model = named(name);
        let mut m = readings_of(&*model, &scattered(3000));
        let truth = ReferenceReadings::new(&m).unwrap();
        m.details.as_mut().unwrap().type_a = m.values.iter().map(|v| 0.03 * v).collect();
        err(&mut m, 7);
        let claims = |u: &f64| claimed * u;
        let details = m.details.as_mut().unwrap();
        details.type_a = details.type_a.iter().map(claims).collect();
        let method = method("nearest", "");
        let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default()).unwrap();
        let brdf = method.reconstruct(&m).unwrap();
        let of = replicated(&m, &*method);
        let at = |pairs: &[DirectionPair]| -> Vec<f64> {
            let found = of.luminance_at(pairs);
            found.iter().map(Uncertain::uncertainty).collect()
        };
        let [f, g] = [&*model, &*brdf].map(|b| metrics::evaluate(b, &pairs));
        let plain = metrics::share_within(|_| 1.0, &f, &g, &at(&pairs)).unwrap();
        let predicted = metrics::evaluate(&*brdf, truth.pairs());
        let judged = truth.within(&predicted, &at(truth.pairs()))[0];
        let validation = CrossValidation::new(&m, Some(false)).unwrap();
        let left_out = validation.within(&*method).unwrap().unwrap()[0];
        for of in [judged, left_out] {
            assert!(of.standard_error.unwrap() < 0.02, "{of:?}");
        }
        [plain, judged.value.unwrap(), left_out.value.unwrap()]
    };
    for of in share("lambert", 1.0) {
        assert!((0.93..0.975).contains(&of), "{of}");
    }
    // Half of what it is: k = 1, 68 %.
    let [half, _, left_out] = share("lambert", 0.5);
    for of in [half, left_out] {
        assert!((0.64..0.73).contains(&of), "{of}");
    }
    let [lobe, at_readings, left_out] = share("ggx", 1.0);
    assert!(lobe < 0.8 && at_readings > 0.9, "{lobe} {at_readings}");
    assert!(left_out < 0.9, "{left_out}");
}

/// Nineteen of twenty truths are within what kriging says (k = 2) of the noise and of what lies between readings.
fn kriging_errs_as_it_says(level: Level) {
    let lobe = |alpha: f64| model("ggx", &format!("alpha = {alpha}"));
    let cases = [(lobe(0.3), 0.03), (lobe(0.3), 0.01), (lobe(0.1), 0.03)];
    for (truth, noise) in cases.into_iter().take(level.of(1, 3)) {
        let mut m = readings_of(&*truth, &scattered(250));
        m.details.as_mut().unwrap().type_a = m.values.iter().map(|v| noise * v).collect();
        let within_hull = Cover::of(&m).unwrap();
        let mut all = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default()).unwrap();
        all.truncate(2000);
        let inside = within_hull.coverages(&all);
        let mut inside = inside.iter().map(|c| *c == Coverage::Interpolated);
        all.retain(|_| inside.next().unwrap());
        let (mut right, mut pairs) = (0_usize, 0);
        for seed in 0..level.of(4, 20) {
            let mut m = m.clone();
            err(&mut m, seed);
            let of = replicated(&m, &*method("kriging", "")).luminance_at(&all);
            pairs += all.len();
            let is_right = |(pair, u): &(&DirectionPair, &Uncertain)| {
                (value(&*truth, pair) - u.value).abs() <= 2.0 * u.uncertainty()
            };
            right += all.iter().zip(&of).filter(is_right).count();
        }
        let share = right as f64 / pairs as f64;
        assert!((0.93..0.999).contains(&share), "{noise}: {share}");
    }
}

/// Materials from matte to lobes of 1°.
fn lobes(level: Level) -> Vec<Box<dyn Brdf>> {
    let all: &[(&str, &str, &[f64])] = level.of(
        &[("ggx", "alpha", &[0.03, 0.3])],
        &[
            ("ggx", "alpha", &[0.02, 0.05, 0.1, 0.3]),
            ("beckmann", "alpha", &[0.04, 0.25]),
            ("ward", "alpha", &[0.05, 0.15]),
            ("oren-nayar", "sigma_deg", &[20.0]),
            ("phong", "exponent", &[60.0]),
        ],
    );
    let of = |&(kind, key, values): &(&str, &str, &[f64])| {
        let of = values.iter();
        of.map(|x| model(kind, &format!("{key} = {x:?}")))
            .collect::<Vec<_>>()
    };
    all.iter().flat_map(of).collect()
}

/// Intervals of moments of noisy readings hold those of the truth as often as they say: of what is open between readings and of
/// noise, lobes narrower than 3° included.
fn moments_of_readings_err_as_they_say(level: Level) {
    let (spec, estimator) = (views(level.of(2, 3), 70.0), peak_resolving(1e-3));
    let channel = Channel::Luminance;
    let entry = parametrization::find("half-difference").unwrap();
    let [_, form] = bent(&entry, Symmetry::FULL);
    let schedule = planned(&form, "sobol", level.of(100, 250), 1);
    let kriging: Arc<dyn Reconstruct> = Arc::from(method("kriging", ""));
    let (mut all, mut within) = (0_usize, [0_usize; 2]);
    for (number, truth) in (0..).zip(lobes(level)) {
        let of_truth = Profile::new(&*truth, channel, &spec, &estimator, 1).unwrap();
        let value = |pair: &DirectionPair| truth.luminance(pair).unwrap_or(0.0);
        let mut exact = read(Arc::clone(&schedule), value);
        let noise = exact.values.iter().map(|v| 0.01 * v).collect();
        exact.details.as_mut().unwrap().type_a = noise;
        for draw in 0..2 {
            let mut m = exact.clone();
            err(&mut m, 1000 * number + draw);
            let copy = Estimated::new(Arc::clone(&kriging), m).unwrap();
            let of_copy = Profile::new(&copy, channel, &spec, &estimator, 1).unwrap();
            for (f, g) in of_truth.slices.iter().zip(&of_copy.slices) {
                // Odd ones are 0 by symmetry.
                for c in Component::ALL.into_iter().filter(|c| !c.is_odd()) {
                    if let [Some(f), Some(g)] = [f, g].map(|s| s.moments.get(c)) {
                        let off = (f.value - g.value).abs() / g.uncertainty;
                        all += 1;
                        let both = within.iter_mut().zip([1.0, 2.0]);
                        both.for_each(|(n, times)| *n += usize::from(off <= times));
                    }
                }
            }
        }
    }
    let [one, two] = within.map(|n| n as f64 / all as f64);
    // Formulas are smoother than the materials that kriging expects: measured 0.95 and 0.98.
    let holds = one >= level.of(0.4, 0.68) && two >= level.of(0.8, 0.95);
    assert!(holds, "{all}: {one} {two}");
}

/// Readings that end at 60°: moments of views that were read and of one that was not, by a method that says what is between readings
/// and by one that does not.
#[test]
fn nothing_is_known_beyond_the_elevations_that_were_read() {
    let truth = model("ggx", "alpha = 0.2");
    let mut angles = scattered(300);
    angles.retain(|[i, o, _]| i.max(*o) < 60.0);
    let mut m = readings_of(&*truth, &angles);
    m.details.as_mut().unwrap().type_a = m.values.iter().map(|v| 0.01 * v).collect();
    err(&mut m, 1);
    let (spec, estimator) = (views(3, 80.0), peak_resolving(1e-2));
    let profile =
        |brdf: &dyn Brdf| Profile::new(brdf, Channel::Luminance, &spec, &estimator, 1).unwrap();
    let of_truth = profile(&*truth);
    for kind in ["kriging", "thin-plate"] {
        let copy = Estimated::new(Arc::from(method(kind, "")), m.clone()).unwrap();
        let slices = of_truth.slices.iter().zip(profile(&copy).slices);
        for (i, (f, g)) in slices.enumerate() {
            let is_left_out = Component::ALL.map(|c| g.moments.get(c).is_none());
            // Of the view at 80° everything.
            assert_eq!(is_left_out == [true; 15], i == 2, "{kind} {i}");
            for c in Component::ALL {
                let [Some(f), Some(g)] = [f.moments, g.moments].map(|moments| moments.get(c))
                else {
                    continue;
                };
                let off = (f.value - g.value).abs() / g.uncertainty;
                assert!(off <= 3.0, "{kind} {c}: {f:?} {g:?}");
            }
        }
    }
}

#[test]
fn readings_without_uncertainties_have_none() {
    let mut m = readings(&scattered(50), 0.0, 0.0);
    let nearest = method("nearest", "");
    assert!(Replicated::of(&m, &*nearest).unwrap().is_none());
    // A few that were repeated.
    m.details.as_mut().unwrap().type_a[..20].fill(0.1);
    assert!(Replicated::of(&m, &*nearest).unwrap().is_none());
    m.details = None;
    assert!(Replicated::of(&m, &*nearest).unwrap().is_none());
}

/// Grids and scattered readings, all symmetries and channels: alike for the same share.
#[test]
fn channels_and_grids_keep_a_common_scale() {
    let coloured = |symmetry: Symmetry| -> Box<dyn Brdf> {
        Box::new(made(symmetry, move |p| {
            Some([1.0, 0.5, 0.8].map(|c| c * smooth(symmetry, p)))
        }))
    };
    let forms = ["half-difference", "spherical"].map(|name| form(name, Symmetry::FULL));
    let (level, all) = (Level::Quick, methods());
    each(level, &all, &forms, coloured, 300, |what, method, m, _| {
        let mut m = m.clone();
        m.details = Some(Details {
            type_a: vec![0.0; m.values.len()],
            type_b: m.values.iter().map(|v| 0.02 * v).collect(),
            flags: vec![Flags::NONE; m.outcomes.len()],
        });
        let is_predictive = is_predictive(method, &m);
        for u in replicated(&m, method).luminance_at(&pairs()[..50]) {
            near(u.type_b / u.value, 0.02, 1e-3, what);
            // Between readings without scatter only kriging has an uncertainty of type A.
            assert!(is_predictive || u.type_a == 0.0, "{what}: {}", u.type_a);
        }
    });
}
