//! When visits take place: stops, sweeps and calibrations.

use crate::common::{form, near, planned, preset, product};
use gonio::geometry::Symmetry;
use gonio::instrument::{Machine, Motion, Scan, Stop, TimingSpec};
use gonio::sampling::Random;
use gonio::schedule::{Schedule, Visit};

/// A schedule of `n` poses whose lights change with every `lights`-th.
fn schedule(n: usize, lights: usize) -> Schedule {
    let form = form("half-difference", Symmetry::NONE);
    let mut schedule = (*planned(&form, "random", n, 1)).clone();
    for i in 0..n {
        schedule.poses[i].pair.omega_i = schedule.poses[i - i % lights].pair.omega_i;
    }
    schedule
}

struct Setting {
    scan: Scan,
    rate: Option<f64>,
    exposure: f64,
    every_minutes: f64,
}

const STOP: Setting = Setting {
    scan: Scan::Stop,
    rate: None,
    exposure: 0.25,
    every_minutes: 0.0,
};

/// Stops, with a calibration every so many minutes.
fn calibrated(every_minutes: f64) -> Setting {
    Setting {
        every_minutes,
        ..STOP
    }
}

const SETTLE: f64 = 0.2;

const OVERHEAD: f64 = 0.1;

const TILE: f64 = 20.0;

/// Three axes that are alike, and one exposure.
fn motion(setting: &Setting) -> Motion {
    let mut spec = preset("cornell");
    for axis in &mut spec.axis {
        axis.speed_deg_per_s = 0.5_f64.to_degrees();
        axis.acceleration_deg_per_s2 = 1.0_f64.to_degrees();
    }
    // Times are also those of settings that no instrument may have.
    let machine = Machine::new(&spec).unwrap();
    spec.timing = TimingSpec {
        scan: setting.scan,
        settle_s: SETTLE,
        overhead_s: OVERHEAD,
        sample_rate_hz: setting.rate,
    };
    spec.detector.exposures = 1;
    spec.detector.exposure_min_s = setting.exposure;
    spec.detector.exposure_max_s = setting.exposure;
    spec.calibration.every_minutes = setting.every_minutes;
    spec.calibration.seconds = TILE;
    Motion::new(&spec, &machine)
}

/// Rows along the first axis with steps of `d`, the second axis changes between them.
fn rows(rows: usize, columns: usize, d: f64) -> Vec<Stop> {
    let stop = |i: usize| {
        let (row, column) = (i / columns, i % columns);
        let back = row % 2 == 1;
        let column = if back { columns - 1 - column } else { column };
        (i as u32, [d * column as f64, 0.2 * row as f64, 0.1, 0.0])
    };
    (0..rows * columns).map(stop).collect()
}

fn wandering(n: usize) -> Vec<Stop> {
    let random = Random::new(3);
    let stop = |i| {
        let [a, b, c] = random.point(i);
        (i as u32, [a, b, c, 0.0])
    };
    (0..n as u64).map(stop).collect()
}

fn total(visits: &[Visit]) -> f64 {
    visits.iter().map(|v| v.seconds).sum()
}

/// When a visit begins, s after the latest calibration.
fn begins(v: &Visit) -> f64 {
    v.since_calibration_seconds - 0.5 * v.exposure_seconds - v.move_seconds
}

#[test]
fn stop_and_go_adds_up() {
    let (n, every) = (400, 5.0);
    let schedule = schedule(n, 7);
    let motion = motion(&calibrated(every));
    let mut path = wandering(n);
    // A pose where the one before was: nothing moves, nothing settles.
    path[50].1 = path[49].1;
    let visits = motion.timed(&schedule, Vec::new(), &path);
    let (mut here, mut now, mut calibrated, mut tiles) = ([0.0; 4], 0.0, f64::NEG_INFINITY, 0);
    for (i, (visit, stop)) in visits.iter().zip(&path).enumerate() {
        assert_eq!((visit.pose, visit.positions), *stop);
        let mut begins = now;
        if now - calibrated > 60.0 * every {
            begins += TILE;
            calibrated = begins;
            tiles += 1;
        }
        let moves = motion.travel().seconds(&here, &stop.1) + if i == 50 { 0.0 } else { SETTLE };
        assert_eq!(visit.move_seconds, moves);
        assert_eq!(visit.exposure_seconds, 0.25);
        let middle = begins + moves + 0.125;
        near(visit.at_seconds, middle, 1e-9, i);
        let found = visit.since_calibration_seconds;
        near(found, middle - calibrated, 1e-9, i);
        now = begins + moves + 0.25 + OVERHEAD;
        here = stop.1;
    }
    assert!(tiles > 2, "{tiles}");
    near(total(&visits), now, 1e-9, "total");
    let end = visits[n - 1].at_seconds + 0.125 + OVERHEAD;
    near(end, total(&visits), 1e-9, "end");
}

#[test]
fn blocks_share_their_light() {
    let (n, lights) = (60, 7);
    let schedule = schedule(n, lights);
    let path = wandering(n);
    let visits = motion(&STOP).timed(&schedule, Vec::new(), &path);
    for (i, visit) in visits.iter().enumerate() {
        assert_eq!(visit.block as usize, i / lights);
    }
    // Backwards the blocks are the same, numbered from the other end.
    let back: Vec<Stop> = path.into_iter().rev().collect();
    let visits = motion(&STOP).timed(&schedule, Vec::new(), &back);
    for (visit, stop) in visits.iter().zip(&back) {
        let number = (n - 1) / lights - stop.0 as usize / lights;
        assert_eq!(visit.block as usize, number);
    }
}

#[test]
fn tiles_are_read_as_often_as_the_time_asks() {
    let n = 600;
    let schedule = schedule(n, n);
    let path = wandering(n);
    let tiles = |every_minutes: f64| {
        let visits = motion(&calibrated(every_minutes)).timed(&schedule, Vec::new(), &path);
        let extra = visits.iter().filter(|v| {
            let rest = v.move_seconds + v.exposure_seconds + OVERHEAD;
            v.seconds - rest > 0.5 * TILE
        });
        let longest = visits.iter().map(begins).fold(0.0, f64::max);
        assert!(every_minutes == 0.0 || longest <= 60.0 * every_minutes * (1.0 + 1e-12));
        (extra.count(), total(&visits))
    };
    let (once, bare) = tiles(0.0);
    assert_eq!(once, 1);
    let bare = bare - TILE;
    for every in [1.0, 2.5, 10.0] {
        // Each interval is as long as asked, and at most the rest of a visit (< 4 s) longer.
        let (count, seconds) = tiles(every);
        let most = (bare / (60.0 * every)).floor() as usize + 1;
        let least = (bare / (60.0 * every + 4.0)).floor() as usize;
        let range = least..=most;
        assert!(range.contains(&count), "{count} of {range:?}");
        near(seconds - bare, TILE * count as f64, 1e-8, every);
    }
    // Shorter than any visit: before every one.
    assert_eq!(tiles(1e-6).0, n);
}

#[test]
fn a_long_sweep_takes_the_time_of_one_move() {
    // No exposures to wait for: one trapezoid over everything.
    let path = rows(1, 41, 0.05);
    let schedule = schedule(path.len(), 1);
    let fly = Setting {
        scan: Scan::Fly,
        exposure: 0.0,
        ..STOP
    };
    let visits = motion(&fly).timed(&schedule, Vec::new(), &path);
    let first = visits[0].seconds;
    let one = motion(&STOP);
    let whole = one.travel().seconds(&[0.0; 4], &[2.0, 0.0, 0.0, 0.0]);
    near(total(&visits) - first, whole, 1e-12, "one move");
    // Exposures or the rate of readings set the pace where they are slower than the axis; the
    // ramps are as long as the pace asks.
    let paces = [
        (0.3, None, 0.3),
        (0.0, Some(4.0), 0.25),
        (0.3, Some(2.0), 0.5),
    ];
    for (exposure, rate, pace) in paces {
        let fly = Setting {
            exposure,
            rate,
            ..fly
        };
        let visits = motion(&fly).timed(&schedule, Vec::new(), &path);
        let seconds = total(&visits) - visits[0].seconds;
        let ramps = 0.05 / pace / 1.0;
        near(seconds, 40.0 * pace + ramps, 1e-12, pace);
        for v in &visits[1..] {
            near(v.seconds - v.move_seconds, exposure, 1e-12, pace);
            assert!(v.move_seconds >= 0.0);
        }
    }
}

#[test]
fn flying_is_never_slower_than_stopping() {
    let settings = product([0.0, 0.1, 0.5, 3.0], [0.0, 0.01, 0.25, 3.0]);
    let rates = [None, Some(1000.0), Some(2.0), Some(0.2)];
    let paths = product(rates, [1e-4, 0.01, 0.3]);
    for ((every_minutes, exposure), (rate, d)) in product(settings, paths) {
        let path = rows(12, 9, d);
        let schedule = schedule(path.len(), 1);
        let timed = |scan| {
            let setting = Setting {
                scan,
                rate,
                exposure,
                every_minutes,
            };
            motion(&setting).timed(&schedule, Vec::new(), &path)
        };
        let (flown, stopped) = (timed(Scan::Fly), timed(Scan::Stop));
        let (fly, stop) = (total(&flown), total(&stopped));
        assert!(fly <= stop + 1e-9, "{fly} {stop}");
        if rate.is_none_or(|rate| rate > 10.0) && ![0.1, 0.5].contains(&every_minutes) {
            // Of nine visits at least one in two neither settles nor idles.
            assert!(fly < stop - 0.3 * 0.5 * path.len() as f64, "{fly} {stop}");
        }
        let mut now = 0.0;
        for (visit, stop) in flown.iter().zip(&path) {
            assert_eq!((visit.pose, visit.positions), *stop);
            let range = 0.5 * exposure - 1e-9..visit.seconds + 1e-9;
            assert!(range.contains(&(visit.at_seconds - now)), "{visit:?}");
            // No visit of a sweep begins when a calibration is due.
            assert!(every_minutes == 0.0 || begins(visit) <= 60.0 * every_minutes + 1e-9);
            now += visit.seconds;
        }
    }
}

#[test]
fn without_sweeps_flying_is_stopping() {
    let n = 100;
    let schedule = schedule(n, 1);
    let setting = calibrated(1.0);
    let stopped = motion(&setting);
    let flown = motion(&Setting {
        scan: Scan::Fly,
        rate: Some(100.0),
        ..setting
    });
    // One axis alone moves, but it turns back at every visit.
    let mut zigzag = rows(1, n, 0.05);
    zigzag.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
    for path in [wandering(n), zigzag] {
        let [a, b] = [&flown, &stopped].map(|m| m.timed(&schedule, Vec::new(), &path));
        assert_eq!(a, b);
    }
}
