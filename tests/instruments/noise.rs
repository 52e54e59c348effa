//! What a session states about its readings is what they do.

use crate::common::{form, material, model, near, planned, preset};
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Bench, Instrument, InstrumentSpec, Order, Parts};
use gonio::measurement::{Details, Flags, Measurement};
use gonio::schedule::{Itinerary, Pose, Schedule};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;
use std::sync::Arc;

fn cornell() -> InstrumentSpec {
    preset("cornell")
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
    let schedule = planned(&form("spherical", Symmetry::FULL), "sobol", 10, 1);
    let coords = schedule.poses[0].coords;
    Arc::new(Schedule {
        poses: pairs.map(|pair| Pose { coords, pair }).collect(),
        ..(*schedule).clone()
    })
}

fn bench(spec: &InstrumentSpec, realisation: u64) -> Bench {
    Bench::new(spec, Parts::ALL, realisation).expect("an instrument")
}

/// The schedule read once, as it was generated.
fn read(bench: &Bench, brdf: &dyn Brdf, schedule: &Arc<Schedule>, seed: u64) -> Measurement {
    let itinerary = bench.plan(schedule, Order::AsGenerated);
    bench.session(&itinerary, seed).measure(brdf, schedule)
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
    let bench = bench(spec, 5);
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

/// The sum of squared deviations, each in units of its stated uncertainty, lies where χ² of so many degrees of freedom
/// lies in all but one of 10⁴ cases.
fn assert_chi_squared(deviations: impl Iterator<Item = f64>, degrees: usize, text: &str) {
    let sum: f64 = deviations.map(|d| d * d).sum();
    let p = ChiSquared::new(degrees as f64).expect("degrees").cdf(sum);
    let ratio = sum / degrees as f64;
    assert!((5e-5..=1.0 - 5e-5).contains(&p), "{text}: χ²/n = {ratio}");
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
            let values = measured.values.iter();
            let deviations = values.map(|v| (v - mean_of) / square.sqrt());
            assert_chi_squared(deviations, n - 1, &format!("{name} {kind}"));
            // The mean is that of the same realisation without scatter.
            let mut silent = spec.clone();
            for axis in &mut silent.axis {
                axis.repeatability_deg = 0.0;
            }
            (silent.detector.shot_noise, silent.detector.read_noise) = (false, 0.0);
            silent.detector.bits = 32;
            let expected = measure(&silent, &*brdf, off_mirror(), 1).values[0];
            let standard = (square / n as f64).sqrt();
            // 4: one in 16 000.
            near((mean_of - expected) / standard, 0.0, 4.0, (name, kind));
        }
    }
}

#[test]
fn steps_of_the_converter_are_a_uniform_error() {
    let n = 10_000;
    let mut spec = quiet();
    spec.detector.bits = 8;
    let brdf = model("lambert", "albedo = 0.9");
    let pair = |i| DirectionPair::from_spherical(0.2 + 0.9 * i as f64 / n as f64, 0.0, 0.3, 2.0);
    let measured = read(&bench(&spec, 1), &*brdf, &schedule_of((0..n).map(pair)), 1);
    assert_eq!(measured.readings(), n);
    let deviations = measured.values.iter().zip(&details(&measured).type_a);
    let deviations = deviations.map(|(v, u)| (v - 0.9 / PI) / u);
    assert_chi_squared(deviations, n, "quantisation");
}

#[test]
fn realisations_scatter_as_type_b_states() {
    let n = 2000;
    let tile = |spec: &mut InstrumentSpec| spec.calibration.uncertainty = 0.005;
    let lamp = |spec: &mut InstrumentSpec| spec.source.drift_per_hour = 0.01;
    let axes = |spec: &mut InstrumentSpec| spec.axis.iter_mut().for_each(|a| a.bias_deg = 0.05);
    type Edit<'a> = &'a dyn Fn(&mut InstrumentSpec);
    let all: [Edit; 3] = [&tile, &lamp, &axes];
    let cases = [
        ("tile", &all[..1]),
        ("lamp", &all[1..2]),
        ("axes", &all[2..]),
    ];
    for (name, changes) in cases.into_iter().chain([("all", &all[..])]) {
        let mut spec = quiet();
        changes.iter().for_each(|change| change(&mut spec));
        for (kind, text) in [("lambert", "albedo = 0.5"), ("ggx", "alpha = 0.3")] {
            let brdf = model(kind, text);
            let mut values = Vec::new();
            let mut squares = Vec::new();
            for realisation in 0..n {
                let bench = bench(&spec, realisation);
                let (schedule, mut itinerary) = repeats(&bench, off_mirror(), 1);
                itinerary.visits[0].since_calibration_seconds = 1800.0;
                let measured = bench.session(&itinerary, 1).measure(&*brdf, &schedule);
                values.push(measured.values[0]);
                squares.push(details(&measured).type_b[0].powi(2));
            }
            let (mean_of, square) = (mean(&values), mean(&squares));
            let deviations = values.iter().map(|v| (v - mean_of) / square.sqrt());
            assert_chi_squared(deviations, n as usize - 1, &format!("{name} {kind}"));
        }
    }
}

#[test]
fn rounding_of_positions_is_of_type_b() {
    let n = 2000;
    let mut spec = quiet();
    spec.axis.iter_mut().for_each(|a| a.resolution_deg = 0.05);
    let brdf = model("ggx", "alpha = 0.3");
    let pair = |i| DirectionPair::from_spherical(0.3 + 0.5 * i as f64 / n as f64, 0.0, 0.41, 2.0);
    let schedule = schedule_of((0..n).map(pair));
    let measured = read(&bench(&spec, 1), &*brdf, &schedule, 1);
    let mut parts = Parts::ALL;
    parts.noise = false;
    let exact = Bench::new(&spec, parts, 1).expect("an instrument");
    let exact = read(&exact, &*brdf, &schedule, 1);
    // The apertures leave a bound of their average, and nothing scatters.
    assert!(details(&exact).type_a.iter().all(|u| *u == 0.0));
    let both = measured.values.iter().zip(&exact.values);
    let deviations = both.zip(&details(&measured).type_b);
    assert_chi_squared(deviations.map(|((v, w), u)| (v - w) / u), n, "resolution");
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
        let count = |flag| {
            let flags = details(&measured).flags.iter();
            flags.filter(|flags| flags.has(flag)).count()
        };
        assert_eq!(count(Flags::SATURATED), if saturated { 20 } else { 0 });
        assert_eq!(count(Flags::CLIPPED), 0);
        let below = count(Flags::BELOW_NOISE);
        // A signal of nothing is below twice its noise in 98 % of all readings.
        assert!(if buried { below >= 16 } else { below == 0 }, "{below}");
    }
    // Full scale is where it is said to be: a lower bound, of the shortest exposure.
    let spec = cornell();
    let measured = measure(&spec, &*lobe, mirror, 1);
    let rate = spec.detector.full_scale / spec.detector.exposure_min_s - spec.detector.dark_rate;
    let full = rate / spec.detector.reference_rate * spec.calibration.reflectance / PI;
    let of_cap = 0.5 * (1.0 + spec.source.half_angle_deg.to_radians().cos());
    let mean_cos = mirror.omega_i.cos_theta() * of_cap;
    let found = measured.values[0] * mean_cos / full;
    near(found, 1.0, 1e-12, "full scale");
}

#[test]
fn bracketing_recovers_six_decades() {
    // The lamp is so bright that white fills a tenth of the shortest exposure, and a millionth of it frees some thousand
    // electrons in the longest.
    let exposing = |exposures, min_s, max_s| {
        let mut spec = quiet();
        let detector = &mut spec.detector;
        (detector.shot_noise, detector.read_noise, detector.bits) = (true, 10.0, 16);
        (detector.exposures, detector.reference_rate) = (exposures, 1e7);
        (detector.exposure_min_s, detector.exposure_max_s) = (min_s, max_s);
        spec
    };
    let (spec, single) = (exposing(7, 1e-3, 1000.0), exposing(1, 0.1, 0.1));
    let (mut good, mut good_single) = (0, 0);
    for k in 0..=12 {
        let albedo = 1e-6 * f64::powf(10.0, 0.5 * f64::from(k));
        let brdf = model("lambert", &format!("albedo = {albedo}"));
        for (spec, good) in [(&spec, &mut good), (&single, &mut good_single)] {
            let measured = measure(spec, &*brdf, off_mirror(), 200);
            let details = details(&measured);
            let fine = |i: &usize| {
                let (v, u) = (measured.values[*i], details.type_a[*i]);
                let is_fine = u < 0.02 * v && details.flags[*i] == Flags::NONE;
                is_fine && (v - albedo / PI).abs() < 5.0 * u
            };
            *good += usize::from((0..200).filter(fine).count() >= 199);
        }
    }
    assert_eq!(good, 13);
    assert!(good_single < 10, "{good_single}");
}

fn poses(n: usize) -> Arc<Schedule> {
    planned(&form("spherical", Symmetry::FULL), "sobol", n, 3)
}

#[test]
fn one_thread_or_two_the_same_bits() {
    let schedule = poses(700);
    let brdf = material("ggx", "alpha = 0.1", Channels::Rgb);
    for spec in super::specs() {
        let bench = bench(&spec, 3);
        let mut itinerary = bench.plan(&schedule, Order::Sorted);
        let run = |threads: usize, itinerary: &Itinerary| {
            let measure = || bench.session(itinerary, 9).measure(&*brdf, &schedule);
            crate::common::on_threads(threads, measure)
        };
        let (one, two) = (run(1, &itinerary), run(2, &itinerary));
        let bits = |m: &Measurement| m.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&one), bits(&two));
        assert!(one.outcomes == two.outcomes && one.details == two.details);
        assert_eq!(one.readings(), itinerary.visits.len());
        assert_eq!(one.unreachable(), itinerary.unreachable.len());
        // Nor does noise depend on the poses of other stops.
        let middle = itinerary.visits[itinerary.visits.len() / 2].stop;
        let start = itinerary
            .visits
            .partition_point(|visit| visit.stop < middle);
        let kept = itinerary.visits.split_off(start);
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

/// Correlation of two samples.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum = |of: fn(f64, f64) -> f64| -> f64 {
        let pairs = a.iter().zip(b).map(|(x, y)| of(x - mean_a, y - mean_b));
        pairs.sum()
    };
    sum(|x, y| x * y) / (sum(|x, _| x * x) * sum(|_, y| y * y)).sqrt()
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
    let of_pose = |spec: &InstrumentSpec, seed: u64, pose: usize| {
        let bench = bench(spec, seed);
        let (schedule, itinerary) = repeats(&bench, off_mirror(), 3);
        let measured = bench.session(&itinerary, seed).measure(&*brdf, &schedule);
        measured.values[pose]
    };
    let over = |spec: &InstrumentSpec, pose: usize| -> Vec<f64> {
        let values = (0..n as u64).map(|seed| of_pose(spec, seed, pose));
        values.collect()
    };
    let of_tile = over(&tile, 0);
    for pose in 0..3 {
        near(correlation(&of_tile, &over(&noisy, pose)), 0.0, most, pose);
    }
    // Of a reading and of the place of its pose, over poses of a random set.
    let seed = 7;
    let form = form("spherical", Symmetry::FULL);
    let schedule = planned(&form, "random", n as usize, seed);
    let mut parts = Parts::ALL;
    parts.limits = false;
    let free = Bench::new(&noisy, parts, seed).expect("an instrument");
    let measured = read(&free, &*brdf, &schedule, seed);
    let readings = measured.values.iter().zip(&details(&measured).type_a);
    let error: Vec<f64> = readings.map(|(v, u)| (v - 0.5 / PI) / u).collect();
    for axis in 0..3 {
        let place: Vec<f64> = schedule.poses.iter().map(|p| p.coords[axis]).collect();
        near(correlation(&error, &place), 0.0, most, axis);
    }
}

/// On top of a peak the first derivative says nothing, and every error makes the reading smaller.
#[test]
fn a_peak_is_as_uncertain_as_it_is_stated() {
    let mut spec = quiet();
    // Room for the peak.
    spec.detector.reference_rate = 1.0;
    let mirror = DirectionPair::from_spherical(0.6, 0.0, 0.6, PI);
    let brdf = model("ggx", "alpha = 0.03");
    let exact = measure(&spec, &*brdf, mirror, 1).values[0];
    for axis in &mut spec.axis {
        (axis.repeatability_deg, axis.bias_deg) = (0.1, 0.2);
    }
    let (mut squares, mut stated) = (0.0, 0.0);
    for realisation in 0..400 {
        let bench = bench(&spec, realisation);
        let (schedule, itinerary) = repeats(&bench, mirror, 1);
        let measured = bench.session(&itinerary, 3).measure(&*brdf, &schedule);
        let d = details(&measured);
        squares += (measured.values[0] - exact).powi(2);
        stated += d.type_a[0].powi(2) + d.type_b[0].powi(2);
    }
    let ratio = (squares / stated).sqrt();
    // To the second order of each axis: what is left out are higher orders and products.
    assert!((0.6..1.7).contains(&ratio), "{ratio}");
}
