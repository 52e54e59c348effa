//! What a session states about its readings is what they do.

use crate::common::{material, model};
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Bench, Ideal, Instrument, InstrumentSpec, Order, Parts};
use gonio::measurement::{Details, Flags, Measurement};
use gonio::schedule::{Itinerary, Pose, Schedule};
use gonio::{registry, schedule};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;
use std::sync::Arc;

/// The first preset.
fn cornell() -> InstrumentSpec {
    let spec = super::specs().swap_remove(0);
    assert_eq!(spec.name, "cornell");
    spec
}

/// No error of any kind, one exposure.
fn quiet() -> InstrumentSpec {
    let mut spec = cornell();
    for axis in &mut spec.axis {
        (axis.repeatability_deg, axis.bias_deg, axis.resolution_deg) = (0.0, 0.0, 0.0);
    }
    let detector = &mut spec.detector;
    (detector.read_noise, detector.dark_rate) = (0.0, 0.0);
    (detector.shot_noise, detector.bits) = (false, 32);
    // White fills a third of the range.
    (detector.exposures, detector.exposure_min_s) = (1, 0.3);
    (detector.exposure_max_s, detector.reference_rate) = (0.3, 1e5);
    (spec.source.drift_per_hour, spec.calibration.uncertainty) = (0.0, 0.0);
    spec
}

fn schedule_of(pairs: impl Iterator<Item = DirectionPair>) -> Arc<Schedule> {
    let form = crate::common::form("spherical", Symmetry::FULL);
    let sets = schedule::all();
    let sobol = sets.iter().find(|e| e.kind == "sobol").expect("a set");
    let sobol = registry::read_text(sobol, "").expect("its defaults");
    let mut schedule = sobol.plan(&form, 10, 1).expect("a schedule");
    let coords = schedule.poses[0].coords;
    schedule.poses = pairs.map(|pair| Pose { coords, pair }).collect();
    Arc::new(schedule)
}

/// The same pose many times over, every visit like the first.
fn repeats(bench: &Bench, pair: DirectionPair, n: usize) -> (Arc<Schedule>, Itinerary) {
    let schedule = schedule_of(std::iter::repeat_n(pair, n));
    let one = schedule_of(std::iter::once(pair));
    let mut itinerary = bench.plan(&one, Order::AsGenerated);
    let first = itinerary.visits[0];
    itinerary.visits = vec![first; n];
    for (visit, pose) in itinerary.visits.iter_mut().zip(0..) {
        visit.pose = pose;
    }
    (schedule, itinerary)
}

fn measure(spec: &InstrumentSpec, brdf: &dyn Brdf, pair: DirectionPair, n: usize) -> Measurement {
    let bench = Bench::new(spec, Parts::ALL, 5).expect("an instrument");
    let (schedule, itinerary) = repeats(&bench, pair, n);
    let measurement = bench.session(&itinerary, 11).measure(brdf, &schedule);
    assert_eq!(measurement.readings(), n);
    measurement
}

fn details(measurement: &Measurement) -> &Details {
    measurement.details.as_ref().expect("uncertainties")
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The sum of n squared deviations in units of the stated variance lies where χ² of that many
/// degrees of freedom lies in all but one of 10⁴ cases.
fn assert_chi_squared(sum: f64, degrees: usize, text: &str) {
    let chi = ChiSquared::new(degrees as f64).expect("degrees");
    let p = chi.cdf(sum);
    println!("{text}: χ²/n = {:.4}, p = {p:.4}", sum / degrees as f64);
    assert!(
        (5e-5..=1.0 - 5e-5).contains(&p),
        "{text}: χ²/n = {}",
        sum / degrees as f64
    );
}

fn off_mirror() -> DirectionPair {
    DirectionPair::from_spherical(0.6, 0.0, 0.4, PI - 0.3)
}

/// What limits the reading, and an instrument that has only that.
fn limits() -> Vec<(&'static str, InstrumentSpec)> {
    let mut shot = quiet();
    shot.detector.shot_noise = true;
    let mut dim = shot.clone();
    dim.detector.reference_rate = 100.0;
    let mut read = quiet();
    read.detector.read_noise = 100.0;
    let mut arms = quiet();
    for axis in &mut arms.axis {
        axis.repeatability_deg = 0.02;
    }
    let mut all = cornell();
    all.calibration.every_minutes = 0.0;
    vec![
        ("shot", shot),
        ("few electrons", dim),
        ("read", read),
        ("repeatability", arms),
        ("all", all),
    ]
}

#[test]
fn the_scatter_is_what_type_a_states() {
    let n = 10_000;
    for (name, spec) in limits() {
        for (kind, text) in [("lambert", "albedo = 0.5"), ("ggx", "alpha = 0.3")] {
            let brdf = model(kind, text);
            let measured = measure(&spec, &*brdf, off_mirror(), n);
            let stated = &details(&measured).type_a;
            let mean_of = mean(&measured.values);
            let square = mean(&stated.iter().map(|u| u * u).collect::<Vec<_>>());
            let sum: f64 = measured
                .values
                .iter()
                .map(|v| (v - mean_of).powi(2) / square)
                .sum();
            assert_chi_squared(sum, n - 1, &format!("{name} {kind}"));
            // The mean is that of the same realisation without scatter.
            let mut silent = spec.clone();
            for axis in &mut silent.axis {
                axis.repeatability_deg = 0.0;
            }
            (silent.detector.shot_noise, silent.detector.read_noise) = (false, 0.0);
            silent.detector.bits = 32;
            let expected = measure(&silent, &*brdf, off_mirror(), 1).values[0];
            let standard = (square / n as f64).sqrt();
            let off = (mean_of - expected) / standard;
            println!(
                "  mean off by {off:.2} standard errors, u = {:.2e}",
                square.sqrt() / mean_of
            );
            // 4: one in 16 000.
            assert!(off.abs() < 4.0, "{name} {kind}: {off}");
        }
    }
}

#[test]
fn steps_of_the_converter_are_a_uniform_error() {
    let n = 10_000;
    let mut spec = quiet();
    spec.detector.bits = 8;
    let brdf = model("lambert", "albedo = 0.9");
    let pair =
        |i: usize| DirectionPair::from_spherical(0.2 + 0.9 * i as f64 / n as f64, 0.0, 0.3, 2.0);
    let schedule = schedule_of((0..n).map(pair));
    let bench = Bench::new(&spec, Parts::ALL, 1).expect("an instrument");
    let itinerary = bench.plan(&schedule, Order::AsGenerated);
    let measured = bench.session(&itinerary, 1).measure(&*brdf, &schedule);
    assert_eq!(measured.readings(), n);
    let deviations = measured.values.iter().zip(&details(&measured).type_a);
    let sum: f64 = deviations.map(|(v, u)| ((v - 0.9 / PI) / u).powi(2)).sum();
    assert_chi_squared(sum, n, "quantisation");
}

#[test]
fn realisations_scatter_as_type_b_states() {
    let n = 2000;
    let tile = |spec: &mut InstrumentSpec| spec.calibration.uncertainty = 0.005;
    let lamp = |spec: &mut InstrumentSpec| spec.source.drift_per_hour = 0.01;
    let axes = |spec: &mut InstrumentSpec| spec.axis.iter_mut().for_each(|a| a.bias_deg = 0.05);
    type Edit<'a> = &'a dyn Fn(&mut InstrumentSpec);
    let cases: [(&str, &[Edit]); 4] = [
        ("tile", &[&tile]),
        ("lamp", &[&lamp]),
        ("axes", &[&axes]),
        ("all", &[&tile, &lamp, &axes]),
    ];
    for (name, changes) in cases {
        let mut spec = quiet();
        changes.iter().for_each(|change| change(&mut spec));
        for (kind, text) in [("lambert", "albedo = 0.5"), ("ggx", "alpha = 0.3")] {
            let brdf = model(kind, text);
            let mut values = Vec::new();
            let mut squares = Vec::new();
            for realisation in 0..n {
                let bench = Bench::new(&spec, Parts::ALL, realisation).expect("an instrument");
                let (schedule, mut itinerary) = repeats(&bench, off_mirror(), 1);
                itinerary.visits[0].since_calibration_seconds = 1800.0;
                let measured = bench.session(&itinerary, 1).measure(&*brdf, &schedule);
                values.push(measured.values[0]);
                squares.push(details(&measured).type_b[0].powi(2));
            }
            let (mean_of, square) = (mean(&values), mean(&squares));
            let sum: f64 = values.iter().map(|v| (v - mean_of).powi(2) / square).sum();
            assert_chi_squared(sum, n as usize - 1, &format!("{name} {kind}"));
        }
    }
}

#[test]
fn rounding_of_positions_is_of_type_b() {
    let n = 2000;
    let mut spec = quiet();
    spec.axis.iter_mut().for_each(|a| a.resolution_deg = 0.05);
    let brdf = model("ggx", "alpha = 0.3");
    let pair =
        |i: usize| DirectionPair::from_spherical(0.3 + 0.5 * i as f64 / n as f64, 0.0, 0.41, 2.0);
    let schedule = schedule_of((0..n).map(pair));
    let bench = Bench::new(&spec, Parts::ALL, 1).expect("an instrument");
    let itinerary = bench.plan(&schedule, Order::AsGenerated);
    let measured = bench.session(&itinerary, 1).measure(&*brdf, &schedule);
    let exact = Bench::new(
        &spec,
        Parts {
            noise: false,
            ..Parts::ALL
        },
        1,
    )
    .expect("an instrument");
    let exact = exact.session(&itinerary, 1).measure(&*brdf, &schedule);
    // The apertures leave a bound of their average, and nothing scatters.
    assert!(details(&exact).type_a.iter().all(|u| *u == 0.0));
    let both = measured.values.iter().zip(&exact.values);
    let sum: f64 = both
        .zip(&details(&measured).type_b)
        .map(|((v, w), u)| ((v - w) / u).powi(2))
        .sum();
    assert_chi_squared(sum, n, "resolution");
}

#[test]
fn flags_are_where_they_belong() {
    let mirror = DirectionPair::from_spherical(0.6, 0.0, 0.6, PI);
    // Narrower than the apertures, so that the reading is about 1/(π a²) with a the sensor's
    // half-angle: over ten thousand times the tile, more than the shortest exposure holds. Its
    // tails are dark, as those of GGX are not.
    let lobe = model("beckmann", "alpha = 0.001");
    for (spec, pair, saturated, buried) in [
        (cornell(), mirror, true, false),
        (cornell(), off_mirror(), false, true),
        (quiet(), mirror, true, false),
    ] {
        let measured = measure(&spec, &*lobe, pair, 20);
        for flags in &details(&measured).flags {
            assert_eq!(flags.has(Flags::SATURATED), saturated);
            assert!(!flags.has(Flags::CLIPPED));
        }
        let below = details(&measured)
            .flags
            .iter()
            .filter(|f| f.has(Flags::BELOW_NOISE))
            .count();
        // A signal of nothing is below twice its noise in 98 % of all readings.
        assert!(if buried { below >= 16 } else { below == 0 }, "{below}");
    }
    // Full scale is where it is said to be: a lower bound, of the shortest exposure.
    let spec = cornell();
    let measured = measure(&spec, &*lobe, mirror, 1);
    let rate = spec.detector.full_scale / spec.detector.exposure_min_s - spec.detector.dark_rate;
    let full = rate / spec.detector.reference_rate * spec.calibration.reflectance / PI;
    let mean_cos =
        mirror.omega_i.cos_theta() * 0.5 * (1.0 + spec.source.half_angle_deg.to_radians().cos());
    assert!((measured.values[0] * mean_cos / full - 1.0).abs() < 1e-12);
}

#[test]
fn bracketing_recovers_six_decades() {
    let mut spec = quiet();
    let detector = &mut spec.detector;
    (detector.shot_noise, detector.read_noise, detector.bits) = (true, 10.0, 16);
    (
        detector.exposures,
        detector.exposure_min_s,
        detector.exposure_max_s,
    ) = (7, 1e-3, 1000.0);
    let mut single = spec.clone();
    (single.detector.exposures, single.detector.exposure_min_s) = (1, 0.1);
    single.detector.exposure_max_s = 0.1;
    let (mut good, mut good_single) = (0, 0);
    for k in 0..=12 {
        let albedo = 1e-6 * f64::powf(10.0, 0.5 * f64::from(k));
        let brdf = model("lambert", &format!("albedo = {albedo}"));
        for (spec, good) in [(&spec, &mut good), (&single, &mut good_single)] {
            // The lamp is so bright that white fills a tenth of the shortest exposure, and a millionth
            // of it frees some thousand electrons in the longest.
            let mut spec = spec.clone();
            spec.detector.reference_rate = 1e7;
            let measured = measure(&spec, &*brdf, off_mirror(), 200);
            let details = details(&measured);
            let fine = |i: &usize| {
                let (v, u) = (measured.values[*i], details.type_a[*i]);
                u < 0.02 * v
                    && details.flags[*i] == Flags::NONE
                    && (v - albedo / PI).abs() < 5.0 * u
            };
            *good += usize::from((0..200).filter(fine).count() >= 199);
        }
    }
    println!("decades: {good} and {good_single} of 13 steps");
    assert_eq!(good, 13);
    assert!(good_single < 10, "{good_single}");
}

fn poses(n: usize) -> Arc<Schedule> {
    let form = crate::common::form("spherical", Symmetry::FULL);
    let sets = schedule::all();
    let sobol = sets.iter().find(|e| e.kind == "sobol").expect("a set");
    let sobol = registry::read_text(sobol, "").expect("its defaults");
    Arc::new(sobol.plan(&form, n, 3).expect("a schedule"))
}

#[test]
fn one_thread_or_two_the_same_bits() {
    let schedule = poses(700);
    let brdf = material("ggx", "alpha = 0.1", Channels::Rgb);
    for spec in super::specs() {
        let bench = Bench::new(&spec, Parts::ALL, 3).expect("an instrument");
        let mut itinerary = bench.plan(&schedule, Order::Sorted);
        let run = |threads: usize, itinerary: &Itinerary| {
            crate::common::on_threads(threads, || {
                bench.session(itinerary, 9).measure(&*brdf, &schedule)
            })
        };
        let (one, two) = (run(1, &itinerary), run(2, &itinerary));
        let bits = |m: &Measurement| m.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&one), bits(&two));
        assert!(one.outcomes == two.outcomes && one.details == two.details);
        assert_eq!(one.readings(), itinerary.visits.len());
        assert_eq!(one.unreachable(), itinerary.unreachable.len());
        // Nor does noise depend on the other poses.
        let kept = itinerary.visits.split_off(itinerary.visits.len() / 2);
        itinerary.visits = kept;
        let half = run(2, &itinerary);
        for visit in &itinerary.visits {
            let i = visit.pose as usize;
            assert_eq!(half.value(i), one.value(i));
        }
        let other = bench.session(&itinerary, 10).measure(&*brdf, &schedule);
        assert_ne!(bits(&half), bits(&other));
    }
}

#[test]
fn with_every_part_off_a_bench_is_ideal() {
    let schedule = poses(3000);
    for spec in super::specs() {
        let bench = Bench::new(&spec, Parts::NONE, 3).expect("an instrument");
        let itinerary = bench.plan(&schedule, Order::AsGenerated);
        assert!(itinerary.unreachable.is_empty());
        for channels in [Channels::Luminance, Channels::Rgb] {
            let brdf = material("ggx", "alpha = 0.05", channels);
            let got = bench.session(&itinerary, 1).measure(&*brdf, &schedule);
            let want = Ideal.measure(&*brdf, &schedule);
            assert_eq!(got.values, want.values);
            assert!(got.outcomes == want.outcomes && got.details.is_none());
        }
    }
}

/// Correlation of two samples.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let pairs = || a.iter().zip(b).map(|(x, y)| (x - mean_a, y - mean_b));
    let [ab, aa, bb] = [
        pairs().map(|(x, y)| x * y).sum::<f64>(),
        pairs().map(|(x, _)| x * x).sum(),
        pairs().map(|(_, y)| y * y).sum(),
    ];
    ab / (aa * bb).sqrt()
}

#[test]
fn one_seed_for_everything_draws_independent_errors() {
    let brdf = model("lambert", "albedo = 0.5");
    let mut tile = quiet();
    tile.calibration.uncertainty = 0.01;
    let mut noisy = quiet();
    noisy.detector.read_noise = 100.0;
    let n = 1000;
    // 4.5 standard deviations of the correlation of independent numbers: one in 150 000.
    let most = 4.5 / f64::from(n).sqrt();
    // Of the machine and of its first readings, over seeds.
    let read = |spec: &InstrumentSpec, seed: u64, pose: usize| {
        let bench = Bench::new(spec, Parts::ALL, seed).expect("an instrument");
        let (schedule, itinerary) = repeats(&bench, off_mirror(), 3);
        bench
            .session(&itinerary, seed)
            .measure(&*brdf, &schedule)
            .values[pose]
    };
    let over = |spec: &InstrumentSpec, pose: usize| -> Vec<f64> {
        (0..n as u64).map(|seed| read(spec, seed, pose)).collect()
    };
    let of_tile = over(&tile, 0);
    for pose in 0..3 {
        let r = correlation(&of_tile, &over(&noisy, pose));
        assert!(r.abs() < most, "{pose}: {r}");
    }
    // Of a reading and of the place of its pose, over poses of a random set.
    let seed = 7;
    let form = crate::common::form("spherical", gonio::geometry::Symmetry::FULL);
    let sets = gonio::schedule::all();
    let random = sets.iter().find(|e| e.kind == "random").expect("a set");
    let random = gonio::registry::read_text(random, "").expect("no keys");
    let schedule = Arc::new(random.plan(&form, n as usize, seed).expect("poses"));
    let parts = Parts {
        limits: false,
        ..Parts::ALL
    };
    let bench = Bench::new(&noisy, parts, seed).expect("an instrument");
    let itinerary = bench.plan(&schedule, Order::AsGenerated);
    let measured = bench.session(&itinerary, seed).measure(&*brdf, &schedule);
    let error: Vec<f64> = measured
        .values
        .iter()
        .zip(&details(&measured).type_a)
        .map(|(v, u)| (v - 0.5 / PI) / u)
        .collect();
    for axis in 0..3 {
        let place: Vec<f64> = schedule.poses.iter().map(|p| p.coords[axis]).collect();
        let r = correlation(&error, &place);
        assert!(r.abs() < most, "{axis}: {r}");
    }
}

/// On top of a peak the first derivative says nothing, and every error makes the reading smaller.
#[test]
fn a_peak_is_as_uncertain_as_it_is_stated() {
    let mut spec = quiet();
    for axis in &mut spec.axis {
        (axis.repeatability_deg, axis.bias_deg) = (0.1, 0.2);
    }
    // Room for the peak.
    spec.detector.reference_rate = 1.0;
    let mirror = DirectionPair::from_spherical(0.6, 0.0, 0.6, PI);
    let exact = measure(
        &{
            let mut s = spec.clone();
            for a in &mut s.axis {
                (a.repeatability_deg, a.bias_deg) = (0.0, 0.0);
            }
            s
        },
        &*model("ggx", "alpha = 0.03"),
        mirror,
        1,
    )
    .values[0];
    let brdf = model("ggx", "alpha = 0.03");
    let (mut squares, mut stated) = (0.0, 0.0);
    let n = 400;
    for realisation in 0..n {
        let bench = Bench::new(&spec, Parts::ALL, realisation).expect("an instrument");
        let (schedule, itinerary) = repeats(&bench, mirror, 1);
        let measured = bench.session(&itinerary, 3).measure(&*brdf, &schedule);
        let d = details(&measured);
        squares += (measured.values[0] - exact).powi(2);
        stated += d.type_a[0].powi(2) + d.type_b[0].powi(2);
    }
    let ratio = (squares / stated).sqrt();
    println!("rms deviation over stated uncertainty on a peak: {ratio:.2}");
    // To the second order of each axis: what is left out are higher orders and products.
    assert!((0.6..1.7).contains(&ratio), "{ratio}");
}
