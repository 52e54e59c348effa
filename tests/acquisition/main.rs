//! Laws of planners: poses that can be taken, chosen from readings alone, and better than points that know nothing.
#![cfg(feature = "experiments")]

mod apertures;
mod beforehand;
#[path = "../common/mod.rs"]
mod common;
mod moments;
mod outliers;

use moments::{known_moments_end_the_readings, poses_for_a_moment_serve_it};

use common::{Level, levels, made, model, test_pairs};
use gonio::acquisition::{self, Aim, Greedy, Planner, Rule, Target, Task, acquire, once};
use gonio::brdf::microfacet::{FresnelSpec, Ggx, Microfacet};
use gonio::brdf::{Brdf, Channels, Roughness};
use gonio::formats::{READ_READINGS, WRITE_READINGS};
use gonio::geometry::{Direction, DirectionPair, Symmetry, angle_between};
use gonio::instrument::{Bench, Ideal, Instrument, Order, Parts, presets, read};
use gonio::measurement::{About, Measurement, Outcome};
use gonio::metrics::{Errors, Expected, Measure};
use gonio::parametrization::{self, usual_form};
use gonio::reconstruct::{Kriging, Reconstruct};
use gonio::registry;
use gonio::schedule::{Assume, Pose, Schedule, Sequence, SobolSet, Unreachable};
use gonio::validation::CrossValidation;
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

levels! {
    poses_are_distinct_and_above_the_horizon_in_any_coordinates: "thorough: every planner in every coordinates";
    poses_depend_on_the_seed_and_not_on_the_number_of_threads: "thorough: more poses";
    a_machine_reaches_every_pose_that_is_chosen_for_it: "thorough: every planner on every machine";
    readings_of_a_file_lead_to_the_same_poses: "thorough: more poses";
    a_hole_is_asked_about_and_left: "thorough: every planner";
    planners_know_better_than_points_that_know_nothing: "thorough: more readings";
    expected_errors_are_not_too_small: "thorough: more lobes and readings";
    what_readings_choose_errs_little_more_than_the_best: "thorough: more lobes and readings";
    twice_the_readings_lower_the_error: "thorough: more lobes and readings";
    poses_for_a_moment_serve_it: "thorough: more lobes, moments and readings";
    known_moments_end_the_readings: "thorough: more materials and moments";
}

fn lobe(alpha: f64) -> Microfacet<Ggx> {
    let (alpha, fresnel) = (Roughness::Isotropic(alpha), FresnelSpec::default());
    Microfacet::new(alpha, &fresnel, Channels::Luminance)
}

fn task(budget: usize) -> Task<'static> {
    Task {
        form: usual_form(Symmetry::FULL),
        budget,
        seed: 1,
        machine: None,
        go_on: &|| true,
        truth: None,
    }
}

/// What chooses poses by a rule.
fn greedy(rule: Rule) -> Greedy {
    aimed(rule, |_| ())
}

/// What chooses poses by a rule for another aim than the usual one.
fn aimed(rule: Rule, change: impl FnOnce(&mut Aim)) -> Greedy {
    let mut aim = Aim::default();
    change(&mut aim);
    Greedy::new(rule, aim)
}

/// Every planner of the registry with its first example, or with all of them.
fn planners(level: Level) -> Vec<Box<dyn Planner>> {
    let of = move |entry: registry::Entry<dyn Planner>| {
        let examples = entry.examples.iter().take(level.of(1, usize::MAX));
        examples.map(move |text| registry::read_text(&entry, text).unwrap())
    };
    acquisition::all().into_iter().flat_map(of).collect()
}

/// Directions of poses, as bits.
fn bits(schedule: &Schedule) -> Vec<[u64; 6]> {
    let of = |pose: &Pose| {
        let [i, o] = [pose.pair.omega_i, pose.pair.omega_o].map(|d| d.vector());
        [i.x, i.y, i.z, o.x, o.y, o.z].map(f64::to_bits)
    };
    schedule.poses.iter().map(of).collect()
}

/// Half a lobe over half a matte part.
fn over_matte(alpha: f64) -> Box<dyn Brdf> {
    let part = |keys: String| format!("{{ weight = 0.5, brdf = {{ {keys} }} }}");
    let matte = part("kind = \"lambert\", albedo = 0.3".into());
    let lobe = part(format!("kind = \"ggx\", alpha = {alpha}"));
    model("sum", &format!("component = [{matte}, {lobe}]"))
}

/// What kriging makes of readings.
fn kriging(measured: &Measurement) -> Box<dyn Brdf> {
    Kriging::default().reconstruct(measured).unwrap()
}

/// The readings without what says how their poses were chosen, in other coordinates.
fn bare(measured: &Measurement) -> Measurement {
    let pairs = measured.schedule.poses.iter().map(|pose| pose.pair);
    let form = common::form("spherical", Symmetry::FULL);
    Measurement {
        schedule: Arc::new(Schedule::of_pairs(form, pairs)),
        ..measured.clone()
    }
}

/// Readings whose values have a noise of one percent, and nothing that says so.
fn noisy(measured: &Measurement, readings: usize, seed: u64) -> Measurement {
    let random = gonio::sampling::Random::new(seed);
    let mut some = measured.clone();
    let mut schedule = (*measured.schedule).clone();
    schedule.poses = schedule.poses.iter().take(readings).cloned().collect();
    some.schedule = Arc::new(schedule);
    some.outcomes.truncate(readings);
    some.values.truncate(readings * measured.channels.count());
    for (i, value) in some.values.iter_mut().enumerate() {
        let u: [f64; 12] = std::array::from_fn(|k| random.point::<1>((12 * i + k) as u64)[0]);
        *value *= 1.0 + 0.01 * (u.iter().sum::<f64>() - 6.0);
    }
    some
}

/// The errors of a reconstruction, cosine pairs.
fn errors_of(copy: &dyn Brdf, truth: &dyn Brdf) -> Errors {
    common::errors(truth, copy, &test_pairs(Measure::Cosine, 10_000))
}

fn error_of(copy: &dyn Brdf, truth: &dyn Brdf) -> f64 {
    errors_of(copy, truth).nrmse.unwrap()
}

/// Whatever coordinates readings are listed in, and whether or not anything says how they were chosen.
fn what_readings_choose_errs_little_more_than_the_best(level: Level) {
    for alpha in level.of(vec![0.1], vec![0.02, 0.05, 0.1, 0.3]) {
        let truth = over_matte(alpha);
        for readings in level.of(vec![64], vec![16, 64, 256]) {
            let task = task(readings);
            let measured = acquire(&greedy(Rule::Adaptive), &task, &*truth).unwrap();
            assert_eq!(measured.schedule.assumes.as_deref(), Some("kriging"));
            let validation = CrossValidation::new(&measured, None).unwrap();
            let methods = validation.candidates().into_iter();
            let copies = methods.filter_map(|method| method.reconstruct(&measured).ok());
            let errors = copies.map(|copy| error_of(&*copy, &*truth));
            let best = errors.fold(f64::INFINITY, f64::min);
            for measured in [&measured, &bare(&measured)] {
                let copy = gonio::validation::chosen(measured).reconstruct(measured);
                let copy = copy.unwrap();
                let error = error_of(&*copy, &*truth);
                assert!(error <= 1.2 * best, "{alpha} {readings}: {error} {best}");
            }
        }
    }
}

/// With a noise of one percent, on poses that follow a highlight, and in any coordinates alike.
fn twice_the_readings_lower_the_error(level: Level) {
    let alphas = level.of(vec![0.05], vec![0.02, 0.05, 0.1, 0.2]);
    let most = level.of(128, 256);
    let mut falls = Vec::new();
    for alpha in alphas {
        let truth = over_matte(alpha);
        let measured = acquire(&greedy(Rule::Adaptive), &task(most), &*truth).unwrap();
        let counts = (4..=most.ilog2()).map(|power| 1 << power);
        let draws = level.of(2, 4);
        let errors = counts.map(|readings| {
            let square = |seed| {
                let some = noisy(&measured, readings, seed);
                let error = error_of(&*kriging(&some), &*truth);
                if seed == 0 {
                    let again = error_of(&*kriging(&bare(&some)), &*truth);
                    assert!(error == again, "{alpha} {readings}");
                }
                error * error
            };
            ((0..draws).map(square).sum::<f64>() / draws as f64).sqrt()
        });
        let errors: Vec<f64> = errors.collect();
        for pair in errors.windows(2) {
            assert!(pair[1] < 1.1 * pair[0], "{alpha}: {errors:?}");
            falls.push((pair[1] / pair[0]).ln());
        }
    }
    let fall = (falls.iter().sum::<f64>() / falls.len() as f64).exp();
    assert!(fall < 0.8, "{fall}");
}

fn poses_are_distinct_and_above_the_horizon_in_any_coordinates(level: Level) {
    let truth = lobe(0.2);
    let budget = level.of(12, 30);
    // In quick tests every planner meets some of the coordinates, and all of these some planner.
    let stride = level.of(5, 1);
    for (i, planner) in planners(level).iter().enumerate() {
        planner.check(&[]).unwrap();
        for (j, entry) in parametrization::all().iter().enumerate() {
            let symmetries = [Symmetry::FULL, Symmetry::ORTHOTROPIC];
            for (k, symmetry) in symmetries.into_iter().enumerate() {
                if !(i + 2 * j + k).is_multiple_of(stride) {
                    continue;
                }
                let mut task = task(budget);
                task.form = entry.form(symmetry);
                let measured = acquire(&**planner, &task, &truth).unwrap();
                let poses = &measured.schedule.poses;
                let what = format!("{} in {}", planner.label(), entry.kind);
                assert_eq!(poses.len(), budget, "{what}");
                let distinct: HashSet<_> = bits(&measured.schedule).into_iter().collect();
                assert_eq!(distinct.len(), budget, "{what}");
                for pose in poses {
                    assert!(common::lowest(&pose.pair) > 0.0);
                    let i = pose.pair.omega_i;
                    let back = task.form.inverse(&pose.coords).unwrap().omega_i;
                    assert!((back.vector() - i.vector()).length() < 1e-6, "{what}");
                }
            }
        }
    }
}

fn poses_depend_on_the_seed_and_not_on_the_number_of_threads(level: Level) {
    let truth = lobe(0.1);
    for planner in planners(level) {
        let poses = |seed, threads| {
            let measured = common::on_threads(threads, || {
                let mut task = task(level.of(10, 40));
                task.seed = seed;
                acquire(&*planner, &task, &truth)
            });
            bits(&measured.unwrap().schedule)
        };
        let one = poses(1, 1);
        assert!(one == poses(1, 2), "{}", planner.label());
        assert!(one != poses(2, 1), "{}", planner.label());
    }
}

fn a_machine_reaches_every_pose_that_is_chosen_for_it(level: Level) {
    let truth = lobe(0.1);
    for (i, preset) in presets().iter().enumerate() {
        let spec = read(preset.text).unwrap();
        let bench = Bench::new(&spec, Parts::ALL, 1).unwrap();
        for (j, planner) in planners(level).iter().enumerate() {
            if !(i + j).is_multiple_of(level.of(presets().len(), 1)) {
                continue;
            }
            let mut task = task(24);
            task.machine = Some(bench.machine());
            let measured = acquire(&**planner, &task, &truth).unwrap();
            let itinerary = bench.plan(&measured.schedule, Order::AsGenerated);
            let visits = itinerary.visits.len();
            assert_eq!(visits, 24, "{} {}", preset.name, planner.label());
            // Of poses that are chosen for kriging whole pictures.
            let is_greedy = Rule::ALL
                .iter()
                .any(|rule| planner.label().starts_with(rule.name()));
            let is_picture = is_greedy && bench.machine().stop_angle().is_some();
            assert!(!is_picture || itinerary.stops() == 1, "{}", planner.label());
        }
    }
}

/// The planner keeps nothing: what it says depends on the readings, which may come from a file.
fn readings_of_a_file_lead_to_the_same_poses(level: Level) {
    let truth = lobe(0.1);
    for planner in planners(level) {
        let mut task = task(level.of(12, 40));
        task.truth = Some(&truth);
        let mut begun = task.clone();
        begun.budget = level.of(8, 20);
        let so_far = acquire(&*planner, &begun, &truth).unwrap();
        let mut file = Vec::new();
        let write = WRITE_READINGS.choose(None, Path::new("r.csv")).unwrap();
        write(&so_far, &About::default(), Sequence::Generated, &mut file).unwrap();
        let reader = READ_READINGS.choose(None, Path::new("r.csv")).unwrap();
        let text = String::from_utf8(file).unwrap();
        let again = reader(&text, "r.csv", &Assume::default());
        let again = again.unwrap().measurement;
        let [now, later] = [&so_far, &again].map(|m| planner.next(&task, m, 4).unwrap());
        assert_eq!(now, later, "{}", planner.label());
    }
}

/// The same poses as a measurement that has no reading.
fn in_vain(poses: Vec<Pose>, outcome: Outcome) -> Measurement {
    let schedule = Schedule::of_pairs(task(8).form, poses.iter().map(|pose| pose.pair));
    let mut measured = Ideal.measure(&lobe(0.1), &Arc::new(schedule));
    measured.outcomes.fill(outcome);
    measured
}

/// The larger distance of the two directions of pairs, in the frame where each is canonical.
fn apart(a: &Pose, b: &Pose) -> f64 {
    let form = usual_form(Symmetry::FULL);
    let folded = |pose: &Pose| form.inverse(&form.forward(&pose.pair)).unwrap();
    let (a, b) = (folded(a), folded(b));
    let off = |a: Direction, b: Direction| angle_between(a.vector(), b.vector());
    off(a.omega_i, b.omega_i).max(off(a.omega_o, b.omega_o))
}

#[test]
fn what_a_machine_refused_is_not_asked_for_again() {
    let truth = lobe(0.1);
    let planner = greedy(Rule::Adaptive);
    let first = acquire(&planner, &task(20), &truth).unwrap();
    let task = task(60);
    let wanted = planner.next(&task, &first, 10).unwrap();
    // All that would come next is refused, in a frame that is turned.
    let turned = |pose: &Pose| Pose {
        pair: common::turned(&pose.pair, 0.65),
        ..*pose
    };
    for frame in [wanted.clone(), wanted.iter().map(turned).collect()] {
        let refused = in_vain(frame, Outcome::Unreachable(Unreachable::Occluded));
        let both = first.followed_by(&refused).unwrap();
        assert_eq!(both.readings(), 20);
        let further = planner.next(&task, &both, 10).unwrap();
        assert_eq!(further.len(), 10);
        for old in &wanted {
            assert!(further.iter().all(|pose| apart(pose, old) > 0.0499));
        }
    }
}

/// A region without data, where the lobe peaks, takes some poses and not the acquisition.
fn a_hole_is_asked_about_and_left(level: Level) {
    let whole = lobe(0.05);
    let batch = level.of(8, 16);
    let is_hole = |pair: &DirectionPair| usual_form(Symmetry::FULL).forward(pair)[0] < 0.25;
    let holed = made(Symmetry::FULL, |pair| {
        (!is_hole(pair)).then(|| [whole.luminance(pair).unwrap()])
    });
    let asked = |planner: &dyn Planner, truth: &dyn Brdf| {
        let mut task = task(6 * batch);
        task.truth = Some(truth);
        let mut so_far = acquisition::nothing(&task);
        for _ in 0..6 {
            let poses = planner.next(&task, &so_far, batch).unwrap();
            let schedule = acquisition::scheduled(&task, planner, poses);
            let read = Ideal.measure(truth, &Arc::new(schedule));
            so_far = match so_far.outcomes.is_empty() {
                true => read,
                false => so_far.followed_by(&read).unwrap(),
            };
        }
        let poses = so_far.schedule.poses.iter();
        poses.filter(|pose| is_hole(&pose.pair)).count()
    };
    for planner in planners(level) {
        let without = asked(&*planner, &holed);
        // A third at most, or less than if it could be read.
        if without > 2 * batch {
            let with = asked(&*planner, &whole);
            let label = planner.label();
            assert!(4 * without <= 3 * with, "{label}: {without} of {with}");
        }
    }
}

#[test]
fn planners_differ_where_there_are_readings() {
    let truth = lobe(0.1);
    let begun = acquire(&greedy(Rule::AOptimal), &task(16), &truth).unwrap();
    let next = |rule| greedy(rule).next(&task(32), &begun, 8).unwrap();
    let rules = [Rule::AOptimal, Rule::Adaptive, Rule::Uncertainty];
    let [beforehand, adaptive, uncertain] = rules.map(next);
    assert!(beforehand != adaptive && adaptive != uncertain && beforehand != uncertain);
    // One of them looks at no value.
    let other = Ideal.measure(&lobe(0.4), &begun.schedule);
    let again = greedy(Rule::AOptimal).next(&task(32), &other, 8).unwrap();
    assert_eq!(again, beforehand);
    assert!(greedy(Rule::Adaptive).next(&task(32), &other, 8).unwrap() != adaptive);
}

/// A mirror-like lobe is read on its peak, once it is known to have one.
#[test]
fn peaks_are_read() {
    // The least certain place is the peak itself; what lowers the variance of all places most is near it.
    for (rule, within) in [(Rule::Adaptive, 0.01), (Rule::Uncertainty, 1e-6)] {
        let planner = greedy(rule);
        let measured = acquire(&planner, &task(200), &lobe(0.02)).unwrap();
        let theta_h = |pair: &DirectionPair| {
            let half = pair.omega_i.vector() + pair.omega_o.vector();
            half.truncate().length().atan2(half.z)
        };
        let poses = measured.schedule.poses.iter();
        let count = poses.filter(|pose| theta_h(&pose.pair) < within).count();
        assert!(count > 3, "{rule:?}: {count}");
    }
}

/// Geometric means of the errors of kriging over lobes from mirror-like to matte, from what a planner measured.
fn means(planner: &dyn Planner, budget: usize) -> [f64; 2] {
    let alphas = [0.03, 0.06, 0.1, 0.2, 0.4];
    let mut logs = [0.0; 2];
    for truth in alphas.map(lobe) {
        let measured = acquire(planner, &task(budget), &truth).unwrap();
        let e = errors_of(&*kriging(&measured), &truth);
        logs[0] += e.nrmse.unwrap().ln();
        logs[1] += e.log_relative.unwrap().ln();
    }
    logs.map(|sum| (sum / alphas.len() as f64).exp())
}

/// What planners know lowers their errors; the weight trades one error for the other.
fn planners_know_better_than_points_that_know_nothing(level: Level) {
    let sobol = once(Box::new(SobolSet {}));
    let of = |rule, weight, budget| means(&aimed(rule, |aim| aim.weight = weight), budget);
    let usual = Aim::default().weight;
    for budget in level.of(vec![32], vec![32, 64, 128]) {
        let [nrmse, log] = means(&*sobol, budget);
        // Before any reading: less of both. From the readings: much less where a material is bright.
        let rules = [Rule::AOptimal, Rule::Adaptive];
        let [beforehand, learned] = rules.map(|rule| of(rule, usual, budget));
        let is_less = beforehand[0] < nrmse && beforehand[1] < log;
        assert!(is_less, "{budget}: {beforehand:?} {nrmse} {log}");
        let is_less = learned[0] < 0.6 * nrmse && learned[1] < log;
        assert!(is_less, "{budget}: {learned:?} {nrmse} {log}");
        if budget != level.of(32, 64) {
            continue;
        }
        // Poses by the true errors leave a smaller error than poses by expected ones.
        let known = of(Rule::Oracle, usual, budget);
        assert!(known[0] < learned[0], "{known:?} {learned:?}");
        let [log, square] = [0.0, 1.0].map(|weight| of(Rule::Adaptive, weight, budget));
        let is_traded = square[0] < log[0] && log[1] < square[1];
        assert!(is_traded, "{log:?} {square:?}");
    }
    // Without the material an oracle has nothing to say.
    let begun = acquire(&greedy(Rule::Adaptive), &task(16), &lobe(0.1)).unwrap();
    let refused = greedy(Rule::Oracle).next(&task(32), &begun, 8);
    let refused = refused.unwrap_err().to_string();
    common::says(&refused, "oracle knows the material");
}

/// Models are smoother than the materials that the kernel was fitted to: no error that is made exceeds what is expected.
fn expected_errors_are_not_too_small(level: Level) {
    let planner = greedy(Rule::Adaptive);
    for alpha in level.of(vec![0.1, 0.4], vec![0.05, 0.1, 0.2, 0.4]) {
        let truth = lobe(alpha);
        for budget in level.of(vec![64], vec![64, 128]) {
            let task = task(budget);
            let measured = acquire(&planner, &task, &truth).unwrap();
            let next = planner.next(&task, &measured, 32).unwrap();
            let forecast = planner.forecast(&task, &measured, &next).unwrap();
            let both = |e: Expected| [e.nrmse.unwrap(), e.log_relative.unwrap()];
            let [[nrmse, log], then] = [forecast.now, forecast.then].map(both);
            assert!(then[0] < nrmse && then[1] < log);
            let made = errors_of(&*kriging(&measured), &truth);
            assert!(made.log_relative.unwrap() < log, "{alpha} {budget}");
            assert!(made.nrmse.unwrap() < nrmse, "{alpha} {budget}");
            // Nor is it anything.
            assert!(made.nrmse.unwrap() > 0.03 * nrmse, "{alpha} {budget}");
        }
    }
    // Poses in vain promise nothing.
    let begun = acquire(&planner, &task(16), &lobe(0.1)).unwrap();
    let further = planner.next(&task(48), &begun, 32).unwrap();
    let in_vain = in_vain(further, Outcome::NoData);
    let more = begun.followed_by(&in_vain).unwrap();
    let now = |m: &Measurement| planner.forecast(&task(48), m, &[]).unwrap().now;
    assert_eq!(now(&begun), now(&more));
    let nothing: Measurement = acquisition::nothing(&task(8));
    assert!(planner.forecast(&task(8), &nothing, &[]).is_none());
}

#[test]
fn reading_ends_once_the_target_is_reached() {
    let task = task(400);
    let truth = lobe(0.2);
    let targets = [
        [Some(0.1), None],
        [None, Some(0.05)],
        [Some(0.1), Some(0.03)],
    ];
    for [nrmse, log_relative] in targets {
        let target = Target {
            nrmse,
            log_relative,
        };
        let planner = aimed(Rule::Adaptive, |aim| aim.target = Some(target));
        let measured = acquire(&planner, &task, &truth).unwrap();
        let is_enough = |n: usize| {
            let poses = measured.schedule.poses[..n].into();
            let schedule = acquisition::scheduled(&task, &planner, poses);
            let some = Ideal.measure(&truth, &Arc::new(schedule));
            let now = planner.forecast(&task, &some, &[]).unwrap().now;
            let now = now.bound(some.readings());
            nrmse.is_none_or(|asked| now.nrmse.unwrap() <= asked)
                && log_relative.is_none_or(|asked| now.log_relative.unwrap() <= asked)
        };
        // Of all numbers after a batch the first that is enough.
        let mut ends = vec![8];
        while ends[ends.len() - 1] < measured.readings() {
            let n = ends[ends.len() - 1];
            ends.push((n + planner.batch(n, 400, false).unwrap()).min(400));
        }
        let first = ends.iter().find(|&&n| is_enough(n));
        assert_eq!(first, Some(&measured.readings()), "{ends:?}");
        assert!(measured.readings() < 400);
    }
}

#[test]
fn a_machine_goes_on_where_it_stands() {
    for preset in presets() {
        let spec = read(preset.text).unwrap();
        let bench = Bench::new(&spec, Parts::ALL, 1).unwrap();
        let mut task = task(60);
        task.machine = Some(bench.machine());
        let planner = greedy(Rule::AOptimal);
        let schedule = Arc::new(planner.design(&task).unwrap());
        // Of a picture some are beyond the horizon.
        let n = schedule.poses.len();
        assert!(n > 40, "{}", preset.name);
        let numbers: Vec<u32> = (0..n as u32).collect();
        // As numbered, batches are cut anywhere and the clock knows nothing of it.
        let whole = bench.plan(&schedule, Order::AsGenerated);
        let part = bench.plan_of(&schedule, &numbers[..25], Order::AsGenerated);
        let parts = bench.plan_further(&schedule, part.clone(), &numbers[25..], Order::AsGenerated);
        let stops = spec.timing.scan == gonio::instrument::Scan::Stop;
        if stops && spec.picture.is_none() {
            assert_eq!(parts.visits, whole.visits, "{}", preset.name);
        }
        // In the best order of each batch, time goes on and readings of one part are those of the whole.
        let part = bench.plan_of(&schedule, &numbers[..25], Order::TwoOpt);
        let parts = bench.plan_further(&schedule, part.clone(), &numbers[25..], Order::TwoOpt);
        assert_eq!(parts.visits[..25], part.visits[..]);
        let times: Vec<f64> = parts.visits.iter().map(|v| v.at_seconds).collect();
        assert!(times.is_sorted(), "{}", preset.name);
        let truth = lobe(0.1);
        let whole = bench.session(&parts, 3).measure(&truth, &schedule);
        let first = bench.session(&part, 3).measure(&truth, &schedule);
        let mut rest = parts.clone();
        rest.visits.drain(..25);
        let rest = bench.session(&rest, 3).measure(&truth, &schedule);
        for i in 0..n {
            let part = first.value(i).or(rest.value(i));
            assert_eq!(part, whole.value(i), "{} {i}", preset.name);
        }
    }
}

/// More than 2000 readings are no longer one system.
#[test]
#[ignore = "thorough: thousands of readings"]
fn poses_are_chosen_after_thousands_of_readings() {
    let truth = lobe(0.1);
    let measured = acquire(&*once(Box::new(SobolSet {})), &task(2100), &truth).unwrap();
    let planner = greedy(Rule::Adaptive);
    let of_moment = aimed(Rule::Adaptive, |aim| {
        aim.moment = Some("variance=0".parse().unwrap());
    });
    let expected = |readings: usize| {
        let some = noisy(&measured, readings, 1);
        let forecast = of_moment.forecast(&task(4000), &some, &[]).unwrap();
        [forecast.now.nrmse.unwrap(), forecast.moment.unwrap().now]
    };
    for (whole, local) in expected(1980).into_iter().zip(expected(2020)) {
        assert!((local / whole - 1.0).abs() < 0.1, "{local} {whole}");
    }
    let others = Task {
        seed: 7,
        ..task(60)
    };
    let others = acquire(&*once(Box::new(SobolSet {})), &others, &truth).unwrap();
    let in_vain = in_vain(others.schedule.poses.clone(), Outcome::NoData);
    let all = measured.followed_by(&in_vain).unwrap();
    let chosen = |threads| {
        common::on_threads(threads, || {
            let poses = planner.next(&task(4000), &all, 16).unwrap();
            let forecast = planner.forecast(&task(4000), &all, &poses).unwrap();
            (poses, forecast)
        })
    };
    let (poses, forecast) = chosen(1);
    assert_eq!(poses.len(), 16);
    for (i, pose) in poses.iter().enumerate() {
        assert!(poses[..i].iter().all(|other| apart(pose, other) > 1e-6));
    }
    let errors = [forecast.now, forecast.then].map(|e| e.nrmse.unwrap());
    assert!(errors[1] < errors[0], "{errors:?}");
    let true_error = error_of(&*kriging(&measured), &truth);
    assert!(
        (0.2..5.0).contains(&(true_error / errors[0])),
        "{true_error} {errors:?}"
    );
    let (again, forecast_again) = chosen(2);
    assert_eq!(forecast, forecast_again);
    let pairs = |poses: &[Pose]| poses.iter().map(|pose| pose.pair).collect::<Vec<_>>();
    assert!(pairs(&poses) == pairs(&again));
}
