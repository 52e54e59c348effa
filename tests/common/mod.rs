//! What tests share: the two levels of a law, random pairs, and the edge table every parametrization and model meets.
#![allow(dead_code, unused_imports, unused_macros)] // Each test binary uses its part of this file.

#[cfg(feature = "experiments")]
pub mod chi_squared;
pub mod draws;
pub mod json_schema;
pub mod light;
#[cfg(feature = "pictures")]
pub mod png;

use glam::DVec3;
use gonio::brdf::measured::merl::MerlGrid;
use gonio::brdf::{Brdf, Channels, Lambert, Presence, Spectrum, Wavelengths};
#[cfg(feature = "experiments")]
use gonio::experiment::{
    ByProduct, Event, Experiment, Extent, Known, Observer, Plan, Row, RowKey, Source, Summary,
};
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::instrument::{self, InstrumentSpec};
use gonio::metrics::{self, Errors, Measure, MetricsSpec, Values};
use gonio::moments::{MomentsSpec, PeakResolving};
use gonio::parametrization::{
    self, Coords, Layout, Parametrization, ParametrizationSpec, WarpSpec,
};
use gonio::registry::{self, Entry};
use gonio::sampling::{Random, cosine_hemisphere};
use gonio::schedule::{self, Schedule};
use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// How much of a law a test asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// The smallest size that shows the law; a part of `cargo test`.
    Quick,
    /// Every combination, at full size; a part of `.ci/thorough`.
    Thorough,
}

impl Level {
    /// A size for each level.
    pub fn of<T>(self, quick: T, thorough: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Thorough => thorough,
        }
    }
}

/// Two tests of each function that takes a [`Level`]: `name::quick`, and `name::thorough`, which is ignored
/// unless it is asked for.
macro_rules! levels {
    ($($(#[$attribute:meta])* $name:ident: $reason:literal;)*) => {$(
        $(#[$attribute])*
        mod $name {
            #[test]
            fn quick() {
                super::$name($crate::common::Level::Quick);
            }

            #[test]
            #[ignore = $reason]
            fn thorough() {
                super::$name($crate::common::Level::Thorough);
            }
        }
    )*};
}
pub(crate) use levels;

/// Asserts that a text has these parts in this order; what is between them is `…`.
#[track_caller]
pub fn says(text: &str, parts: &str) {
    let mut rest = text;
    for part in parts.split(" … ") {
        let found = rest.split_once(part);
        rest = found
            .unwrap_or_else(|| panic!("{part} is not in: {text}"))
            .1;
    }
}

/// The rows of a table of cases, a line each, with cells between ` | `, in which `\n` and `\t` are those characters.
pub fn table<const N: usize>(text: &str) -> impl Iterator<Item = [&'static str; N]> {
    let rows = text.lines().map(str::trim).filter(|row| !row.is_empty());
    rows.map(|row| {
        let padded = format!(" {row} ").replace("\\n", "\n").replace("\\t", "\t");
        let cells = padded
            .leak()
            .splitn(N, " | ")
            .map(|cell| cell.trim_matches(' '));
        let cells: Vec<&str> = cells.collect();
        cells.try_into().unwrap_or_else(|_| panic!("{row}"))
    })
}

/// Pair `i` of a random sequence: both directions uniform on the hemisphere.
pub fn random_pair(random: &Random, i: u64) -> DirectionPair {
    let u: [f64; 4] = random.point(i);
    let uniform = |a: f64, b: f64| {
        let (s, c) = (TAU * b).sin_cos();
        let sin = ((1.0 - a) * (1.0 + a)).sqrt();
        Direction::from_unit(DVec3::new(sin * c, sin * s, a))
    };
    DirectionPair::new(uniform(1.0 - u[0], u[1]), uniform(1.0 - u[2], u[3]))
}

/// Random pairs of a seed: both directions uniform on the hemisphere.
pub fn random_pairs(seed: u64) -> impl Iterator<Item = DirectionPair> {
    let random = Random::new(seed);
    (0..).map(move |i| random_pair(&random, i))
}

/// The smaller cosine of the two directions.
pub fn lowest(pair: &DirectionPair) -> f64 {
    pair.omega_i.cos_theta().min(pair.omega_o.cos_theta())
}

/// The pair turned about the normal.
pub fn turned(pair: &DirectionPair, by: f64) -> DirectionPair {
    let turn = |d: Direction| Direction::from_spherical(d.theta(), d.phi() + by);
    DirectionPair::new(turn(pair.omega_i), turn(pair.omega_o))
}

/// The pair with its azimuths negated.
pub fn mirrored(pair: &DirectionPair) -> DirectionPair {
    let mirror = |d: Direction| Direction::from_spherical(d.theta(), -d.phi());
    DirectionPair::new(mirror(pair.omega_i), mirror(pair.omega_o))
}

/// The pairs that reciprocity and the two mirrors call equal to one, if they are in its symmetry: itself first.
pub fn images(pair: &DirectionPair, symmetry: Symmetry) -> Vec<DirectionPair> {
    let mut images = vec![*pair];
    if symmetry.reciprocal {
        images.push(pair.swapped());
    }
    if symmetry.bilateral {
        let others = images.iter().flat_map(|p| {
            let mirrored = mirrored(p);
            [mirrored, turned(&mirrored, PI), turned(p, PI)]
        });
        images.extend(others.collect::<Vec<_>>());
    }
    images
}

/// Pair `i` of a random sequence: both directions cosine-distributed.
pub fn cosine_pair(random: &Random, i: u64) -> DirectionPair {
    let u: [f64; 4] = random.point(i);
    DirectionPair::new(
        cosine_hemisphere([u[0], u[1]]),
        cosine_hemisphere([u[2], u[3]]),
    )
}

/// Random pairs of a seed: both directions cosine-distributed.
pub fn cosine_pairs(seed: u64) -> impl Iterator<Item = DirectionPair> {
    let random = Random::new(seed);
    (0..).map(move |i| cosine_pair(&random, i))
}

/// The edge table: normal/normal, exact mirror, exact retro, grazing/opposed (h = 0),
/// grazing/retro, normal/grazing, each exactly and at separations 1e-2 … 1e-15 from it.
pub fn edge_pairs() -> Vec<(String, DirectionPair)> {
    let graze = FRAC_PI_2;
    let corners = [
        ("normal/normal", [0.0, 0.0, 0.0, 0.0]),
        ("mirror", [0.7, 0.3, 0.7, 0.3 + PI]),
        ("retro", [0.7, 0.3, 0.7, 0.3]),
        ("grazing/opposed", [graze, 0.4, graze, 0.4 + PI]),
        ("grazing/retro", [graze, 0.4, graze, 0.4]),
        ("grazing/sideways", [graze, 0.4, graze, 0.4 + FRAC_PI_2]),
        ("normal/grazing", [0.0, 0.0, graze, 1.2]),
        ("grazing/normal", [graze, -2.0, 0.0, 0.0]),
    ];
    let mut pairs = Vec::new();
    for (name, [ti, pi, to, po]) in corners {
        pairs.push((
            name.to_owned(),
            DirectionPair::from_spherical(ti, pi, to, po),
        ));
        for e in 2..=15 {
            let d = 10f64.powi(-e);
            // Towards the normal, so that both directions stay above the horizon.
            let inner = |t: f64| if t > 1.0 { t - d } else { t + d };
            for (move_i, move_o, turn) in [
                (true, false, 0.0),
                (false, true, 0.0),
                (true, true, 0.0),
                (false, false, d),
                (true, false, d),
            ] {
                let ti = if move_i { inner(ti) } else { ti };
                let to = if move_o { inner(to) } else { to };
                pairs.push((
                    format!("{name} {move_i} {move_o} {turn:e} at 1e-{e}"),
                    DirectionPair::from_spherical(ti, pi + turn, to, po),
                ));
            }
        }
    }
    pairs
}

/// Every combination of the three symmetries.
pub fn symmetries() -> Vec<Symmetry> {
    (0..8)
        .map(|bits| Symmetry {
            isotropic: bits & 1 != 0,
            reciprocal: bits & 2 != 0,
            bilateral: bits & 4 != 0,
        })
        .collect()
}

/// The parametrizations whose coordinates are radii and azimuths: the others have no poles.
pub fn polar() -> impl Iterator<Item = Entry<ParametrizationSpec>> {
    let is_polar =
        |e: &Entry<ParametrizationSpec>| e.form(Symmetry::NONE).facts().layout != Layout::Straight;
    parametrization::all().into_iter().filter(is_polar)
}

/// A parametrization under a symmetry, plain and with a square root on the first axis.
pub fn bent(
    entry: &Entry<ParametrizationSpec>,
    symmetry: Symmetry,
) -> [Arc<dyn Parametrization>; 2] {
    let first = entry.axes(symmetry)[0].symbol.to_owned();
    let root = [(first, WarpSpec::SquareRoot)].into();
    let warped = entry.warped(symmetry, &root).expect("any radial axis");
    [entry.form(symmetry), warped]
}

/// Coordinates at a share of every axis.
pub fn at(p: &dyn Parametrization, shares: [f64; 4]) -> Coords {
    let mut c = [0.0; 4];
    for (c, (axis, share)) in c.iter_mut().zip(p.axes().iter().zip(shares)) {
        *c = axis.range[0] + axis.length() * share;
    }
    c
}

/// Every example of every warp.
pub fn warps() -> Vec<WarpSpec> {
    let mut warps = Vec::new();
    for entry in parametrization::warps() {
        let read = |text: &&str| *registry::read_text(&entry, text).expect("an example");
        warps.extend(entry.examples.iter().map(read));
    }
    warps
}

/// Asserts that a number is nearer to the expected one than `most`; `what` says which case it is.
#[track_caller]
pub fn near(found: f64, expected: f64, most: f64, what: impl std::fmt::Debug) {
    let off = (found - expected).abs();
    assert!(off < most, "{what:?}: {found} is {off:e} from {expected}");
}

/// Asserts that every edit of a text, `old | new | parts of the sentence`, is refused with that sentence.
#[track_caller]
pub fn refused_edits<T, E: std::fmt::Display>(
    text: &str,
    edits: &str,
    read: impl Fn(&str) -> Result<T, E>,
) {
    for [old, new, parts] in table(edits) {
        let e = read(&edited(text, old, new)).err();
        says(&e.expect(parts).to_string(), parts);
    }
}

/// Every member of a list with every one of another, which runs fastest.
pub fn product<A: Clone, B: Clone>(
    first: impl IntoIterator<Item = A>,
    second: impl IntoIterator<Item = B>,
) -> Vec<(A, B)> {
    let second: Vec<B> = second.into_iter().collect();
    let with = |a: A| second.iter().map(move |b| (a.clone(), b.clone()));
    first.into_iter().flat_map(with).collect()
}

/// A member of a family by its kind, with these keys.
pub fn member<T: ?Sized>(family: Vec<Entry<T>>, kind: &str, keys: &str) -> Box<T> {
    let entry = family.iter().find(|e| e.kind == kind);
    let entry = entry.unwrap_or_else(|| panic!("{kind} is in no registry"));
    registry::read_text(entry, keys).unwrap_or_else(|e| panic!("{kind}: {e}"))
}

/// A schedule of a sample set with its defaults.
pub fn planned(
    form: &Arc<dyn Parametrization>,
    set: &str,
    budget: usize,
    seed: u64,
) -> Arc<Schedule> {
    let set = member(schedule::all(), set, "");
    Arc::new(set.plan(form, budget, seed).expect("a schedule"))
}

/// Channels of these wavelengths, nm.
pub fn wavelengths(nm: &[f64]) -> Channels {
    Channels::Wavelengths(Wavelengths::new(nm).expect("wavelengths"))
}

/// The values of all channels at a pair that has data.
pub fn present(brdf: &dyn Brdf, pair: &DirectionPair) -> Vec<f64> {
    let mut out = vec![f64::NAN; brdf.channels().count()];
    assert_eq!(brdf.eval(pair, &mut out), Presence::Present, "{pair:?}");
    out
}

/// A matte material in luminance.
pub fn matte(albedo: f64) -> Lambert {
    Lambert::new(Spectrum::Grey(albedo), Channels::Luminance)
}

/// A model from the registry, in luminance.
pub fn model(kind: &str, keys: &str) -> Box<dyn Brdf> {
    material(kind, keys, Channels::Luminance)
}

/// A model from the registry.
pub fn material(kind: &str, keys: &str, channels: Channels) -> Box<dyn Brdf> {
    let spec = member(gonio::brdf::all(), kind, keys);
    spec.build(channels).expect("a BRDF")
}

/// A parametrization of a name.
pub fn form(name: &str, symmetry: Symmetry) -> Arc<dyn Parametrization> {
    let entry = parametrization::find(name).expect("in the registry");
    entry.form(symmetry)
}

/// A file of MERL whose planes hold `value(channel, cell)` as stored, unscaled.
pub fn merl_file(grid: MerlGrid, value: impl Fn(usize, [usize; 3]) -> f64) -> Vec<u8> {
    let [n_h, n_d, n_phi] = grid.dims();
    let mut bytes = Vec::with_capacity(grid.file_len() as usize);
    for n in grid.dims() {
        bytes.extend((n as i32).to_le_bytes());
    }
    for (c, h) in product(0..3, 0..n_h) {
        for d in 0..n_d {
            let row = (0..n_phi).flat_map(|phi| value(c, [h, d, phi]).to_le_bytes());
            bytes.extend(row);
        }
    }
    bytes
}

/// An instrument of the registry.
#[cfg(feature = "experiments")]
pub fn preset(name: &str) -> InstrumentSpec {
    let mut all = instrument::presets().into_iter();
    let preset = all.find(|p| p.name == name).expect("a preset");
    instrument::read(preset.text).unwrap()
}

/// What a function makes on so many threads.
pub fn on_threads<T: Send>(threads: usize, make: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().expect("a pool").install(make)
}

pub const ISOTROPIC: Symmetry = Symmetry {
    isotropic: true,
    ..Symmetry::NONE
};

/// All but the mirror.
pub const ONE_SIDED: Symmetry = Symmetry {
    bilateral: false,
    ..Symmetry::FULL
};

/// So many views of a profile, up to an elevation.
pub fn views(views: usize, max_view_deg: f64) -> MomentsSpec {
    MomentsSpec {
        views,
        max_view_deg,
        ..MomentsSpec::default()
    }
}

/// The usual estimator of moments, with a tolerance.
pub fn peak_resolving(tolerance: f64) -> PeakResolving {
    PeakResolving {
        tolerance,
        ..PeakResolving::default()
    }
}

/// Values of pairs all of which have some.
pub fn values(luminance: Vec<f64>) -> Values {
    let missing = Vec::new();
    Values { luminance, missing }
}

/// A BRDF that a test makes of a function.
struct Made<F> {
    channels: Channels,
    symmetry: Symmetry,
    f: F,
}

impl<const N: usize, F> Brdf for Made<F>
where
    F: Fn(&DirectionPair) -> Option<[f64; N]> + Send + Sync,
{
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let values = (self.f)(pair);
        // Whoever uses a value that is not there shall notice.
        out.copy_from_slice(&values.unwrap_or([f64::NAN; N]));
        match values {
            Some(_) => Presence::Present,
            None => Presence::Missing,
        }
    }
}

/// A BRDF of one grey channel, or of R, G and B, that declares a symmetry; `None`: no data.
pub fn made<const N: usize>(
    symmetry: Symmetry,
    f: impl Fn(&DirectionPair) -> Option<[f64; N]> + Send + Sync,
) -> impl Brdf {
    let channels = match N {
        1 => Channels::Luminance,
        _ => Channels::Rgb,
    };
    Made {
        channels,
        symmetry,
        f,
    }
}

/// Rows and events of a run. It is stopped when there are so many rows, or after so many questions whether to
/// stop.
#[cfg(feature = "experiments")]
#[derive(Default)]
pub struct Keep {
    pub rows: Vec<Row>,
    /// Keys of the rows of each schedule and material, in the order of their events.
    pub complete: Vec<RowKey>,
    pub loaded: Vec<String>,
    /// Work in the units of [`Observer::begins`]: all of it, and what is done.
    pub announced: f64,
    pub work: f64,
    /// Asks for all materials.
    pub curious: bool,
    pub stop_at: Option<usize>,
    pub patience: Option<Cell<usize>>,
}

#[cfg(feature = "experiments")]
impl Observer<Row> for Keep {
    fn cancelled(&self) -> bool {
        let is_over = |left: &Cell<usize>| left.replace(left.get().saturating_sub(1)) == 0;
        self.stop_at.is_some_and(|n| self.rows.len() >= n)
            || self.patience.as_ref().is_some_and(is_over)
    }

    fn begins(&mut self, work: f64) {
        self.announced = work;
    }

    fn requests(&self, wish: &ByProduct<'_>) -> bool {
        self.curious && matches!(wish, ByProduct::Material(..))
    }

    fn observe(&mut self, event: &Event<'_, Row>) -> Result<(), gonio::Error> {
        match event {
            Event::Made(rows) => self.rows.extend_from_slice(rows),
            Event::Complete(rows) => self.complete.extend(rows.iter().map(|r| r.key.clone())),
            Event::Loaded(material, ..) => self.loaded.push(material.name.clone()),
            Event::Advanced(work) => self.work += work,
            _ => {}
        }
        Ok(())
    }
}

/// Runs a plan, in which nothing may fail; its rows and the summary.
#[cfg(feature = "experiments")]
pub fn run(plan: &Plan) -> (Vec<Row>, Summary) {
    let mut keep = Keep::default();
    let summary = plan
        .run(&Extent::default(), &Known::new(), &mut keep)
        .unwrap();
    assert!(summary.failures.is_empty(), "{:?}", summary.failures);
    (keep.rows, summary)
}

/// A row of a material that errs `error`, sampled in a parametrization with a warp and reconstructed by cubic.
#[cfg(feature = "experiments")]
pub fn row(material: &str, [parametrization, warp]: [&str; 2], budget: usize, error: f64) -> Row {
    let mut row = Row {
        material: material.into(),
        truth: "neither".into(),
        parametrization: parametrization.into(),
        warp: warp.into(),
        sample_set: "grid".into(),
        instrument: "ideal".into(),
        reconstruction: "cubic".into(),
        coordinates: "own".into(),
        allowed: format!("{budget} poses"),
        budget,
        readings: budget,
        seed: 1,
        measure: "cosine".into(),
        reachable: 1.0,
        instrument_seconds: Some(60.0 * budget as f64),
        pairs: 100,
        plan_seconds: Some(0.1),
        measure_seconds: Some(0.1),
        reconstruct_seconds: Some(0.1),
        evaluate_seconds: Some(0.1),
        ..Row::default()
    };
    for name in ["nrmse", "log_relative"] {
        row.quantities.set(name, Some(error));
    }
    row
}

/// The plan of a config, `c.toml`.
#[cfg(feature = "experiments")]
pub fn plan(text: &str) -> Result<Plan, gonio::Error> {
    Plan::read(&Source::new("c.toml", text))
}

/// A text with one edit.
pub fn edited(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// Pairs of a measure that errors are compared at.
pub fn test_pairs(measure: Measure, pairs: usize) -> Vec<DirectionPair> {
    let spec = MetricsSpec {
        pairs,
        ..MetricsSpec::default()
    };
    metrics::test_pairs(measure, &spec).unwrap()
}

/// Errors of a copy at pairs.
pub fn errors(truth: &dyn Brdf, copy: &dyn Brdf, pairs: &[DirectionPair]) -> Errors {
    let [truth, copy] = [truth, copy].map(|brdf| metrics::evaluate(brdf, pairs));
    metrics::compare(pairs, &truth, &copy)
}
