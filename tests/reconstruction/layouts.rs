//! Readings that nobody planned: sheets, lines, a plane, points that almost coincide, gaps, two densities.

use super::common::{Level, levels, model, product, test_pairs};
use super::{material, method};
use gonio::brdf::{self, Brdf, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::measurement::Measurement;
use gonio::metrics::{self, Measure};
use gonio::parametrization::{self, Coords};
use gonio::reconstruct::{self, Coordinates, Interpolant, Readings, Reconstruct, values_at};
use gonio::registry;
use gonio::sampling::{Random, Sobol};
use gonio::schedule::Schedule;
use std::sync::Arc;

levels! {
    values_are_near_the_readings_and_not_much_worse_than_the_nearest: "thorough: every layout and model, more pairs";
}

/// theta_i, theta_o and the azimuth between them, degrees.
type Angles = [f64; 3];

/// Readings at constant incidences, every `step` in theta_o to 80° and every `turn` in azimuth.
pub fn sheets(incidences: &[f64], step: usize, turn: usize) -> Vec<Angles> {
    let mut angles = Vec::new();
    for &theta_i in incidences {
        angles.push([theta_i, 0.0, 0.0]);
        for theta_o in (step..=80).step_by(step) {
            let turns = (0..=180).step_by(turn);
            angles.extend(turns.map(|phi| [theta_i, theta_o as f64, phi as f64]));
        }
    }
    angles
}

/// Scans in the plane of incidence.
fn lines(incidences: &[f64], step: usize) -> Vec<Angles> {
    let scans = product([0.0, 180.0], (0..=80).step_by(step));
    let scans = product(incidences.iter().copied(), scans).into_iter();
    scans.map(|(i, (phi, o))| [i, o as f64, phi]).collect()
}

pub fn scattered(count: u64) -> Vec<Angles> {
    let mut sobol = Sobol::new(3);
    let mut next = |i| {
        let u: [f64; 3] = sobol.point(i);
        let theta = |u: f64| (u.sqrt() * 85_f64.to_radians().sin()).asin().to_degrees();
        [theta(u[0]), theta(u[1]), 180.0 * u[2]]
    };
    (0..count).map(&mut next).collect()
}

fn layouts() -> Vec<(&'static str, Vec<Angles>)> {
    let planes: Vec<f64> = (0..=16).map(|i| 5.0 * f64::from(i)).collect();
    let mut twice = scattered(300);
    for (i, [theta_i, theta_o, phi]) in scattered(300).into_iter().enumerate() {
        let off = 10_f64.powi(-1 - (i % 12) as i32);
        twice.push([theta_i + off, theta_o, phi]);
    }
    let mut gap = scattered(1200);
    gap.retain(|[theta_i, theta_o, phi]| (theta_i - theta_o).abs() > 12.0 || *phi < 150.0);
    let mut two = scattered(300);
    let near = |[i, o, phi]: Angles| [30.0 + 0.2 * i, 35.0 + 0.2 * o, 180.0 - 0.15 * phi];
    two.extend(scattered(1500).into_iter().map(near));
    vec![
        ("sheets", sheets(&[15.0, 30.0, 60.0], 4, 6)),
        ("sheet", sheets(&[45.0], 4, 6)),
        ("lines", lines(&[15.0, 30.0, 60.0], 2)),
        ("line", lines(&[45.0], 2)),
        ("plane", lines(&planes, 5)),
        ("point", vec![[45.0, 40.0, 170.0]]),
        ("coincident", twice),
        ("gap", gap),
        ("two densities", two),
    ]
}

pub fn pair([theta_i, theta_o, phi]: Angles) -> DirectionPair {
    let [i, o, phi] = [theta_i, theta_o, phi].map(f64::to_radians);
    DirectionPair::from_spherical(i, 0.0, o, phi)
}

pub fn schedule(angles: &[Angles]) -> Arc<Schedule> {
    let form = crate::common::form("half-difference", Symmetry::FULL);
    let mut schedule = Schedule::of_pairs(form, angles.iter().copied().map(pair));
    let mut places: Vec<Coords> = Vec::new();
    schedule.poses.retain(|pose| {
        let is_new = !places.contains(&pose.coords);
        places.push(pose.coords);
        is_new
    });
    Arc::new(schedule)
}

/// What a model has at a layout, with uncertainties of 0.
pub fn readings_of(model: &dyn Brdf, angles: &[Angles]) -> Measurement {
    let value = |pair: &DirectionPair| model.luminance(pair).unwrap_or(0.0);
    super::read(schedule(angles), value)
}

/// Every example of every model with all symmetries.
pub fn models() -> Vec<(String, Box<dyn Brdf>)> {
    let mut models = Vec::new();
    for entry in brdf::all() {
        for text in entry.examples {
            let built = registry::read_text(&entry, text).map(|s| s.build(Channels::Luminance));
            let Ok(Ok(model)) = built else {
                continue;
            };
            if model.symmetry() == Symmetry::FULL {
                models.push((format!("{} {text}", entry.kind), model));
            }
        }
    }
    assert!(models.len() > 20);
    models
}

/// The first of them whose name begins so.
pub fn named(name: &str) -> Box<dyn Brdf> {
    let found = models().into_iter().find(|(n, _)| n.starts_with(name));
    found.unwrap_or_else(|| panic!("no model {name}")).1
}

/// Every scattered method in every parametrization that it can work in, and as it is where that is not the coordinates of the
/// readings: kriging. That one, which is the dearest, in one of them.
fn methods() -> Vec<(String, &'static str, Arc<dyn Reconstruct>)> {
    let mut methods: Vec<(String, &'static str, Arc<dyn Reconstruct>)> = Vec::new();
    let kinds = parametrization::all().into_iter().map(|e| e.kind);
    let kinds: Vec<_> = kinds.collect();
    for entry in reconstruct::all() {
        let method: Arc<dyn Reconstruct> = registry::read_text(&entry, "").unwrap().into();
        if method.needs_grid() || ["fit", "components"].contains(&entry.kind) {
            continue;
        }
        let within = |kind_name: &&'static str| {
            let (kind, warp) = ((*kind_name).to_owned(), Default::default());
            let other = method.within(&Coordinates { kind, warp })?;
            Some(((*kind_name).to_owned(), entry.kind, other))
        };
        let is_kriging = entry.kind == "kriging";
        let chosen = |kind: &&&str| !is_kriging || **kind == "hybrid";
        methods.extend(kinds.iter().filter(chosen).filter_map(within));
        if is_kriging || !methods.iter().any(|m| m.1 == entry.kind) {
            methods.push(("half-difference".into(), entry.kind, method));
        }
    }
    methods
}

/// What a method makes of readings of every pose, so many values of each.
fn interpolated(
    method: &dyn Reconstruct,
    schedule: &Arc<Schedule>,
    values: &[f64],
) -> Box<dyn Interpolant> {
    let poses = schedule.poses.len();
    let readings = Readings {
        schedule,
        width: values.len() / poses,
        values,
        present: &vec![true; poses],
        noise: None,
        half_angles_deg: [0.0; 2],
    };
    method.interpolate(&readings).unwrap()
}

/// Truths at readings of a layout and at test pairs.
struct Bench {
    pairs: Vec<DirectionPair>,
    /// By model, then pair.
    truths: Vec<Vec<f64>>,
    models: Vec<(String, Box<dyn Brdf>)>,
}

impl Bench {
    fn new(models: Vec<(String, Box<dyn Brdf>)>, pairs: usize) -> Self {
        let pairs = test_pairs(Measure::Cosine, pairs);
        let truth = |(_, m): &(String, Box<dyn Brdf>)| metrics::evaluate(&**m, &pairs).luminance;
        Self {
            truths: models.iter().map(truth).collect(),
            pairs,
            models,
        }
    }

    /// Readings of all models, pose-major.
    fn readings(&self, schedule: &Schedule) -> Vec<f64> {
        let mut values = vec![0.0; schedule.poses.len() * self.models.len()];
        let rows = values.chunks_mut(self.models.len());
        for (pose, row) in schedule.poses.iter().zip(rows) {
            for ((_, model), value) in self.models.iter().zip(row) {
                let _ = model.eval(&pose.pair, std::slice::from_mut(value));
            }
        }
        values
    }

    /// Values at the pairs, pair-major.
    fn values(
        &self,
        method: &dyn Reconstruct,
        schedule: &Arc<Schedule>,
        readings: &[f64],
    ) -> Vec<f64> {
        let all = self.models.len();
        // Weights that depend on readings are of one material.
        let width = if method.weighs_readings() { 1 } else { all };
        let mut out = vec![0.0; self.pairs.len() * all];
        for first in (0..all).step_by(width) {
            let of = |row: &[f64]| row[first..first + width].to_vec();
            let values: Vec<f64> = readings.chunks(all).flat_map(of).collect();
            let interpolant = interpolated(method, schedule, &values);
            let values = values_at(&*interpolant, &self.pairs);
            for (out, values) in out.chunks_mut(all).zip(values.chunks(width)) {
                out[first..first + width].copy_from_slice(values);
            }
        }
        out
    }

    /// Squared errors of a model times the squared cosine, per pair.
    fn errors(&self, values: &[f64], model: usize) -> Vec<f64> {
        let width = self.models.len();
        let at = |(k, pair): (usize, &DirectionPair)| {
            let error = values[k * width + model] - self.truths[model][k];
            (error * pair.omega_i.cos_theta()).powi(2)
        };
        self.pairs.iter().enumerate().map(at).collect()
    }

    fn nrmse(&self, values: &[f64], model: usize) -> f64 {
        let truth: f64 = self.errors(&vec![0.0; values.len()], model).iter().sum();
        (self.errors(values, model).iter().sum::<f64>() / truth).sqrt()
    }
}

/// Ratio of two root mean squares and its standard error (bootstrap over pairs).
fn ratio(a: &[f64], b: &[f64]) -> (f64, f64) {
    let random = Random::new(7);
    let ratio = |draw| {
        let (mut above, mut below) = (0.0, 0.0);
        for k in 0..a.len() as u64 {
            let u: [f64; 1] = random.point(draw * a.len() as u64 + k);
            let k = (u[0] * a.len() as f64) as usize;
            above += a[k];
            below += b[k];
        }
        (above / below).sqrt()
    };
    let ratios: Vec<f64> = (0..25).map(ratio).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 24.0;
    let ratio = (a.iter().sum::<f64>() / b.iter().sum::<f64>()).sqrt();
    (ratio, variance.sqrt())
}

/// Benches with these models: of all for methods whose weights all materials share, and, as it takes long to fit
/// each by itself, of every fifth and one that is matte. In quick tests a share of either.
fn benches(level: Level, pairs: usize) -> [Bench; 2] {
    let is_matte = |model: &(String, _)| model.0.starts_with("oren-nayar");
    [level.of(6, 1), level.of(30, 5)].map(|step| {
        let some = models().into_iter().enumerate();
        let some = some.filter(|(i, model)| i % step == 0 || is_matte(model));
        Bench::new(some.map(|(_, model)| model).collect(), pairs)
    })
}

/// epsilon of the logarithm.
const EPSILON: f64 = 1e-3;

#[test]
fn one_bright_reading_does_not_spoil_the_others() {
    let mut angles = scattered(400);
    angles.push([40.0, 40.0, 180.0]);
    let schedule = schedule(&angles);
    let mut readings = vec![1e-30; schedule.poses.len()];
    readings[schedule.poses.len() - 1] = 1e12;
    let bench = Bench::new(Vec::new(), 2000);
    for (coordinates, kind, method) in methods() {
        let interpolant = interpolated(&*method, &schedule, &readings);
        let mut out = vec![0.0; bench.pairs.len()];
        interpolant.eval_batch(&bench.pairs, &mut out);
        let largest = out.iter().fold(0.0, |a: f64, b| a.max(*b));
        assert!(largest <= 4.0e12, "{coordinates} {kind} {largest:e}");
    }
}

/// Largest ratio of a method's error to that of the nearest reading in the same coordinates, beyond two
/// standard errors. Where a layout says nothing of most pairs (a line, a plane, a gap about the mirror
/// direction), one guess is as good as another, and these are what the guesses cost.
fn allowed([layout, coordinates, kind]: [&str; 3], model: &str) -> f64 {
    match (layout, kind) {
        // Of a pair and its exchange, two places there, one is kept: what is near may stand far away. Measured 2.12.
        (_, "thin-plate") if coordinates == "edwards" => 2.2,
        // Values of random paths differ at almost one place, and a thin plate goes through both. Measured 2.12.
        ("coincident", "thin-plate" | "sheets") if model.starts_with("smith-multiple") => 2.2,
        ("lines" | "line", "thin-plate" | "sheets") if coordinates == "stark" => 1.3,
        ("plane", "thin-plate" | "sheets") => 1.33,
        ("sheets", "thin-plate") if coordinates == "stark" => 1.25,
        // Light of two bounces in dimples has no lobe that a sheet shows the course of; measured 1.29.
        ("sheet", "thin-plate") if model.starts_with("micro-surface") => 1.33,
        ("lines" | "line" | "sheet", "thin-plate" | "sheets") => 1.2,
        // In a plane nothing is said of phi_d, which changes this one most.
        ("plane" | "lines", "kriging") if model.starts_with("oren-nayar") => 2.5,
        ("sheet" | "lines" | "line" | "plane" | "gap", "inverse-distance" | "kriging") => 1.35,
        // The highlight of these does not keep its half vector.
        ("sheets", "sheets") if model.starts_with("retro") || model.starts_with("sheen") => 2.5,
        _ => 1.05,
    }
}

/// Largest rise over the readings, as a factor, and fall below them, as a share of the range of their logarithm. A spline
/// rises to at most 4 times its neighbours, to 30 times where readings fill space, between sheets to 4 times that, and falls
/// by half the range of the logarithm, past the last sheet by as much again.
fn range(layout: &str, kind: &str) -> (f64, f64) {
    match (kind, layout) {
        ("thin-plate", "coincident" | "gap" | "two densities") => (30.0, 0.5),
        ("thin-plate", _) => (4.0, 0.5),
        ("sheets", _) => (16.0, 2.5),
        // Into a gap about the mirror direction it continues the flanks of the peak.
        ("kriging", _) => (300.0, 2.5),
        _ => (1.0, 0.0),
    }
}

fn values_are_near_the_readings_and_not_much_worse_than_the_nearest(level: Level) {
    let benches = benches(level, level.of(400, 2500));
    let mut wrong = Vec::new();
    let most = level.of(610, usize::MAX);
    for (layout, angles) in layouts().into_iter().filter(|(_, all)| all.len() <= most) {
        let schedule = schedule(&angles);
        let readings = benches.each_ref().map(|bench| bench.readings(&schedule));
        let methods = methods();
        for (coordinates, kind, method) in &methods {
            let which = usize::from(method.weighs_readings());
            let (bench, readings) = (&benches[which], &readings[which]);
            let is_nearest = |m: &&(String, _, _)| m.0 == *coordinates && m.1 == "nearest";
            let nearest = methods.iter().find(is_nearest).unwrap();
            let nearest = bench.values(&*nearest.2, &schedule, readings);
            let values = bench.values(&**method, &schedule, readings);
            let (rise, fall) = range(layout, kind);
            let width = bench.models.len();
            for (m, (model, _)) in bench.models.iter().enumerate() {
                let what = format!("{layout} {coordinates} {kind} {model}");
                let of = readings.iter().skip(m).step_by(width);
                let log = of.map(|f| (f + EPSILON).ln());
                let low = log.clone().fold(f64::INFINITY, f64::min);
                let high = log.fold(f64::NEG_INFINITY, f64::max);
                let floor = (low - fall * (high - low)).exp() * 0.999_999;
                let ceiling = rise * 1.000_001 * high.exp();
                for f in values.iter().skip(m).step_by(width) {
                    let inside = *f >= 0.0 && (floor..=ceiling).contains(&(f + EPSILON));
                    assert!(inside, "{what}: {f:e} not in {floor:e} to {ceiling:e}");
                }
                // Out of the plane of the readings every value is the kernel's guess, whose interval `uncertainty` tests.
                let is_guess = *kind == "kriging"
                    && coordinates == "hybrid"
                    && ["plane", "lines", "line"].contains(&layout);
                if is_guess || bench.nrmse(&nearest, m) < 1e-10 {
                    continue;
                }
                let (ratio, error) = ratio(&bench.errors(&values, m), &bench.errors(&nearest, m));
                if ratio > allowed([layout, coordinates, kind], model) + 2.0 * error {
                    wrong.push(format!("{what}: {ratio:.3} ± {error:.3}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn three_sheets_make_a_glossy_brdf() {
    let ggx = model("ggx", "alpha = 0.3");
    let bench = Bench::new(vec![("ggx".into(), ggx)], 10_000);
    let schedule = schedule(&sheets(&[15.0, 30.0, 60.0], 4, 6));
    assert_eq!(schedule.poses.len(), 1863);
    let readings = bench.readings(&schedule);
    for (coordinates, kind, method) in methods() {
        let level = match (kind, coordinates.as_str()) {
            ("thin-plate", "half-difference") => 0.05,
            ("thin-plate", "orthographic" | "hybrid") => 0.08,
            ("thin-plate", "spherical") => 0.20,
            // It keeps the highlight where it is.
            ("sheets", _) => 0.025,
            _ => continue,
        };
        let values = bench.values(&*method, &schedule, &readings);
        let error = bench.nrmse(&values, 0);
        assert!(error < level, "{kind} {coordinates} {error}");
    }
}

#[test]
fn sheets_may_be_of_the_sensor() {
    let brdf = material(Symmetry::FULL, |p: &DirectionPair| {
        let h = p.omega_i.vector() + p.omega_o.vector();
        (-20.0 * h.truncate().length_squared() / h.length_squared()).exp()
    });
    let bench = Bench::new(vec![("lobe".into(), Box::new(brdf))], 1000);
    let light = sheets(&[15.0, 30.0, 60.0], 4, 6);
    let sensor: Vec<Angles> = light.iter().map(|&[i, o, phi]| [o, i, phi]).collect();
    let method = method("sheets", "");
    let [a, b] = [light, sensor].map(|angles| {
        let schedule = schedule(&angles);
        let readings = bench.readings(&schedule);
        bench.values(&*method, &schedule, &readings)
    });
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() <= 1e-9 * (a.abs() + EPSILON), "{a} {b}");
    }
}
