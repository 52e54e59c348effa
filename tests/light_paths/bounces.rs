//! Classes of light paths and coordinates: laws of information, closed forms, boxes that are told by other paths than chose them.

use super::common::{near, product};
use super::{MIRRORS, paths, surface};
use gonio::analysis::bounces::{self, ChartBounces, Information, PathSample, Spread};
use gonio::analysis::{Estimate, Subset};
use gonio::brdf::microfacet::Ggx;
use gonio::brdf::{
    Brdf, CLASSES, Channels, LightPath, Part, Presence, Roughness, Source, Split, SplitBrdf,
};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::light_paths::SmithMultiple;
use gonio::parametrization::{self, WarpSpec, Warps};
use gonio::sampling::{Random, cosine_hemisphere, gauss_legendre};
use std::f64::consts::{FRAC_PI_2, PI};

/// Light of a diffuse surface, to which a formula gives the number of facets.
struct Formula<F> {
    /// Probabilities of the classes, for a pair on a surface.
    classes: F,
    surfaces: usize,
    seed: u64,
}

impl<F: Fn(&DirectionPair, u64) -> [f64; CLASSES] + Send + Sync> Brdf for Formula<F> {
    fn channels(&self) -> &Channels {
        &Channels::Luminance
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::FULL
    }

    fn conserves_energy(&self) -> bool {
        true
    }

    fn eval(&self, _: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(1.0 / PI);
        Presence::Present
    }
}

impl<F: Fn(&DirectionPair, u64) -> [f64; CLASSES] + Send + Sync> SplitBrdf for Formula<F> {
    fn split(&self, _: &DirectionPair) -> Split {
        unreachable!("paths are enough")
    }

    fn paths(&self, block: u64, count: usize, each: &mut dyn FnMut(LightPath)) {
        let mut random = Random::new(self.seed).stream(block);
        for _ in 0..count {
            let mut next = || cosine_hemisphere([random.next(), random.next()]);
            let pair = DirectionPair::new(next(), next());
            let [first, second, _] = (self.classes)(&pair, block % self.surfaces.max(1) as u64);
            let choice = random.next();
            let order = match choice {
                c if c < first => 1,
                c if c < first + second => 2,
                _ => 3 + (random.next() * 4.0) as usize,
            };
            // Some of what is lost is lost in weight, some in number.
            let light = 0.5 + random.next();
            if random.next() < 0.9 {
                each(LightPath { pair, order, light });
            }
        }
    }

    fn follows_pairs(&self) -> bool {
        true
    }

    fn noise(&self, _: &DirectionPair, _: &mut dyn FnMut(Source, f64)) {}

    fn surfaces(&self) -> usize {
        self.surfaces
    }
}

fn sample(
    paths: usize,
    classes: impl Fn(&DirectionPair) -> [f64; CLASSES] + Send + Sync,
) -> PathSample {
    follow(paths, 1, 1, |pair, _| classes(pair))
}

/// Paths on surfaces of which each has its own classes.
fn follow(
    paths: usize,
    surfaces: usize,
    seed: u64,
    classes: impl Fn(&DirectionPair, u64) -> [f64; CLASSES] + Send + Sync,
) -> PathSample {
    let formula = Formula {
        classes,
        surfaces,
        seed,
    };
    PathSample::follow(&formula, paths)
}

/// The larger elevation of a pair: the first spherical coordinate, whose sin⁴ is uniform on [0, 1].
fn larger(pair: &DirectionPair) -> f64 {
    pair.omega_i.theta().max(pair.omega_o.theta())
}

/// Mirrors of a roughness.
fn mirrors(alpha: f64, bounces: Part) -> SmithMultiple<Ggx> {
    surface(Roughness::Isotropic(alpha), &MIRRORS, paths(bounces, 2))
}

fn rough(alpha: f64, paths: usize) -> PathSample {
    PathSample::follow(&mirrors(alpha, Part::All), paths)
}

/// Every number of an information.
fn numbers(told: &Information) -> Vec<Estimate> {
    let pairs = told.pairs.iter().map(|(_, e)| *e);
    let single = told.single.iter().copied();
    single.chain(pairs).chain([told.all]).collect()
}

fn agree(a: Estimate, b: Estimate, errors: f64) -> bool {
    (a.value - b.value).abs() <= errors * a.error.hypot(b.error)
}

/// Asserts that a number is that of a formula, within so many of its errors.
#[track_caller]
fn assert_near(found: Estimate, want: f64, errors: f64) {
    let exact = Estimate {
        value: want,
        error: 0.0,
    };
    assert!(agree(found, exact, errors), "{found:?}, {want}");
}

/// −Σ p log2 p.
fn bits(shares: &[f64]) -> f64 {
    let there = shares.iter().filter(|p| **p > 0.0);
    -there.map(|p| p * p.log2()).sum::<f64>()
}

#[test]
fn what_one_axis_tells_is_the_integral_in_every_chart() {
    // With u = sin⁴ of the larger elevation, uniform: P(first) = 0.7 − 0.6 u, P(second) = 0.2 + 0.4 u, the rest 0.1 + 0.2 u.
    let classes = |u: f64| [0.7 - 0.6 * u, 0.2 + 0.4 * u, 0.1 + 0.2 * u];
    let sample = sample(1 << 19, |pair| classes(larger(pair).sin().powi(4)));
    let mut conditional = 0.0;
    for (t, w) in gauss_legendre(24) {
        conditional += 0.5 * w * bits(&classes(0.5 + 0.5 * t));
    }
    let entropy = bits(&classes(0.5));
    let exact = entropy - conditional;
    assert_near(bounces::entropy(&sample), entropy, 4.0);
    for entry in parametrization::all() {
        let form = entry.form(Symmetry::FULL);
        let told = bounces::information(&sample, &*form);
        assert_near(told.all, exact, 4.0);
        // The error is small enough to say something.
        let error = told.all.error;
        assert!(error < 0.1 * exact, "{}: {error}", entry.kind);
        if entry.kind == "spherical" {
            assert_near(told.single[0], exact, 4.0);
            assert!(told.single[0].error < 0.02 * exact);
            assert_eq!(told.best_single().0, 0);
            // Of the difference of azimuths the larger elevation is independent.
            let of_azimuth = told.single[2];
            assert!(of_azimuth.value <= 4.0 * of_azimuth.error, "{told:?}");
        }
    }
}

#[test]
fn independent_classes_tell_nothing() {
    let sample = sample(1 << 18, |_| [0.6, 0.3, 0.1]);
    let symmetries = [Symmetry::FULL, Symmetry::ORTHOTROPIC];
    for (entry, symmetry) in product(parametrization::all(), symmetries) {
        let told = bounces::information(&sample, &*entry.form(symmetry));
        let axes = told.single.len();
        assert_eq!(told.pairs.len(), axes * (axes - 1) / 2);
        for told in numbers(&told) {
            assert!(told.value <= 4.0 * told.error, "{}: {told:?}", entry.kind);
            assert!(told.error < 0.01, "{}: {told:?}", entry.kind);
        }
    }
}

#[test]
fn warps_change_nothing() {
    let sample = rough(0.7, 1 << 16);
    let mut warped = 0;
    for entry in parametrization::all() {
        let plain = bounces::information(&sample, &*entry.form(Symmetry::FULL));
        let axes = &entry.axes(Symmetry::FULL)[..2];
        for (warp, axis) in product([WarpSpec::SquareRoot, WarpSpec::Arcsine], axes) {
            let warps = Warps::from([(axis.symbol.to_owned(), warp)]);
            // Squares of lengths have no arcsine.
            let Ok(form) = entry.warped(Symmetry::FULL, &warps) else {
                continue;
            };
            let bent = bounces::information(&sample, &*form);
            assert_eq!(plain, bent, "{}", form.warp_name());
            warped += 1;
        }
    }
    assert!(warped > 10, "{warped}");
}

#[test]
fn all_axes_tell_the_same_in_every_chart_and_more_than_some() {
    for alpha in [0.5, 1.0] {
        let sample = rough(alpha, 1 << 19);
        let entropy = bounces::entropy(&sample);
        let mut all: Vec<(&str, Estimate)> = Vec::new();
        for entry in parametrization::all() {
            let told = bounces::information(&sample, &*entry.form(Symmetry::FULL));
            for told in numbers(&told) {
                assert!(told.value >= 0.0 && told.value <= entropy.value, "{told:?}");
            }
            let at_most = |a: Estimate, b: Estimate| a.value <= b.value || agree(a, b, 3.0);
            for ([i, k], pair) in &told.pairs {
                assert!(at_most(told.single[*i], *pair) && at_most(told.single[*k], *pair));
                assert!(at_most(*pair, told.all), "{}: {told:?}", entry.kind);
            }
            all.push((entry.kind, told.all));
        }
        for ((name, a), (other, b)) in product(&all, &all) {
            assert!(agree(*a, *b, 3.0), "{alpha}: {name} {a:?}, {other} {b:?}");
        }
    }
}

#[test]
fn the_best_box_is_told_by_paths_that_did_not_choose_it() {
    // Light of two facets between 30° and 50° of the larger elevation, and little of it elsewhere.
    let [inside, outside] = [0.97, 0.02];
    let degrees = |d: f64| f64::to_radians(d);
    let [low, high] = [30.0, 50.0].map(degrees);
    let classes = |pair: &DirectionPair| {
        let here = (low..high).contains(&larger(pair));
        let second = if here { inside } else { outside };
        [1.0 - second, second, 0.0]
    };
    let chosen = sample(1 << 18, classes);
    let others = follow(1 << 18, 1, 2, |pair, _| classes(pair));
    // sin⁴ θ of the larger elevation is uniform: as much as makes the box 90 % pure is taken from outside.
    let held = high.sin().powi(4) - low.sin().powi(4);
    let more = held * (inside - 0.9) / (0.9 - outside);
    let of_second = inside * held + outside * (1.0 - held);
    let most = (inside * held + outside * more) / of_second;
    for entry in parametrization::all() {
        let chart = ChartBounces::new(&chosen, &entry, Symmetry::FULL, 1, 0.9);
        let best = chart.best.unwrap();
        let subset = Subset::read(entry.form(Symmetry::FULL), &best.text).unwrap();
        let again = others.capture(|pair| subset.contains(pair));
        for class in [0, 1] {
            let [a, b] = [&best.capture, &again].map(|c| [c.inside[class], c.captured[class]]);
            for (a, b) in a.into_iter().zip(b) {
                assert!(agree(a, b, 4.0), "{}: {a:?} {b:?}", entry.kind);
            }
        }
        if entry.kind == "spherical" {
            let captured = best.capture.captured[1].value;
            let is_most = captured <= most + 0.01 && captured > most - 0.015;
            assert!(is_most, "{captured} {most}");
            assert!(best.chosen_by >= 0.9 && (best.capture.inside[1].value - 0.9).abs() < 0.02);
            // What is taken from outside may lie below, above, or both.
            let [from, to] = subset.ranges[0].map(f64::to_degrees);
            assert!((26.5..30.5).contains(&from), "{}", best.text);
            assert!((49.5..51.5).contains(&to), "{}", best.text);
        }
    }
    // Of three facets there is no light.
    let entry = parametrization::find("hybrid").unwrap();
    let none = ChartBounces::new(&chosen, &entry, Symmetry::FULL, 2, 0.9);
    assert!(none.best.is_none() && none.ranges.iter().all(|r| r[2].is_none()));
}

#[test]
fn a_box_that_chance_made_pure_is_not_told_to_be() {
    let sample = sample(1 << 15, |_| [0.5, 0.4, 0.1]);
    for entry in parametrization::all() {
        let chart = ChartBounces::new(&sample, &entry, Symmetry::FULL, 1, 0.9);
        let best = chart.best.unwrap();
        let chosen_by = best.chosen_by;
        assert!(chosen_by > 0.45 && chosen_by < 0.9, "{chosen_by}");
        // Few batches know their own error to a quarter.
        assert_near(best.capture.inside[1], 0.4, 5.0);
    }
}

#[test]
fn maps_hold_all_light_and_the_shares_of_their_places() {
    let second = |pair: &DirectionPair| {
        let h = (pair.omega_i.vector() + pair.omega_o.vector()).normalize();
        let u = h.z * h.z;
        [1.0 - u, u, 0.0]
    };
    let sample = sample(1 << 17, second);
    for entry in crate::common::polar() {
        let chart = ChartBounces::new(&sample, &entry, Symmetry::FULL, 1, 0.9);
        let [every, slabs @ ..] = &chart.maps[..] else {
            panic!("no maps");
        };
        let all: f64 = every.light.iter().flatten().sum();
        near(all, 1.0, 1e-9, entry.kind);
        assert!(every.azimuth.is_none() && slabs.len() == 4);
        for slab in slabs {
            let part: f64 = slab.light.iter().flatten().sum();
            assert!(part > 0.02 && part < 0.5, "{}: {part}", entry.kind);
        }
        if entry.kind == "half-difference" {
            let side = bounces::MAP_CELLS;
            let mut seen = 0;
            for cell in 0..side * side {
                let Some(shares) = every.shares(cell) else {
                    continue;
                };
                let middle = FRAC_PI_2 * ((cell % side) as f64 + 0.5) / side as f64;
                let u = middle.cos().powi(2);
                // At least a dozen paths of weights between 0.5 and 1.5, and the width of a cell.
                let error = 4.5 * (1.1 * (u * (1.0 - u)).max(0.05) / 12.0).sqrt() + 0.02;
                near(shares[1], u, error, cell);
                near(shares.iter().sum(), 1.0, 1e-12, cell);
                seen += 1;
            }
            assert!(seen > side * side / 3, "{seen}");
        }
    }
}

#[test]
fn ranges_are_quantiles() {
    let sample = sample(1 << 17, |_| [0.5, 0.3, 0.2]);
    let entry = parametrization::find("spherical").unwrap();
    let chart = ChartBounces::new(&sample, &entry, Symmetry::FULL, 1, 0.9);
    for class in 0..CLASSES {
        // sin⁴ of the larger elevation is uniform, and so is the difference of azimuths.
        let [thetas, _, phis] = [0, 1, 2].map(|axis| chart.ranges[axis][class].unwrap());
        for [low, high] in [thetas.map(|t| t.sin().powi(4)), phis.map(|phi| phi / PI)] {
            near(low, 0.025, 0.003, class);
            near(high, 0.975, 0.003, class);
        }
    }
}

#[test]
fn shares_are_means_of_light() {
    let sample = sample(1 << 18, |_| [0.6, 0.3, 0.1]);
    let shares = sample.shares();
    // Nine of ten leave, with 1 on average.
    assert_near(shares.albedo, 0.9, 4.0);
    assert!(shares.albedo.error < 2e-3);
    for (share, exact) in shares.classes.iter().zip([0.6, 0.3, 0.1]) {
        assert_near(*share, exact, 4.0);
    }
    // Both within 30°: sin⁴ 30° of the light of each class.
    let form = crate::common::form("spherical", Symmetry::FULL);
    let subset = Subset::read(form, "theta_i=0..30, theta_o=0..30").unwrap();
    let capture = sample.capture(|pair| subset.contains(pair));
    for (captured, share) in capture.captured.iter().zip(shares.classes) {
        assert_near(*captured, 0.0625, 4.0);
        assert!(share.error > 0.0);
    }
    // Of no light there are no shares.
    let nothing = sample.capture(|_| false);
    assert!(nothing.inside.iter().all(|e| e.value.is_nan()));
    assert!(nothing.captured.iter().all(|e| e.value == 0.0));
}

/// Light of one facet has a closed form, whose integrals over boxes know nothing of paths.
#[test]
fn boxes_hold_the_light_that_values_say() {
    let sample = rough(0.6, 1 << 18);
    let first = mirrors(0.6, Part::First);
    for (name, words) in [
        ("spherical", "theta_i=10..50, delta_phi=90..180"),
        ("half-difference", "theta_h=0..20, theta_d=20..60"),
        ("hybrid", "h_bar=0..0.4, k=0..0.6, delta=0..45"),
    ] {
        let entry = parametrization::find(name).unwrap();
        let subset = Subset::read(entry.form(Symmetry::FULL), words).unwrap();
        let captured = sample.capture(|pair| subset.contains(pair)).captured[0];
        let share = subset.energy_share(&first).unwrap();
        assert!(
            agree(captured, share, 4.0),
            "{name}: {captured:?} {share:?}"
        );
        assert!(captured.error < 0.01 && captured.value > 0.02);
    }
}

#[test]
fn errors_hold_what_surfaces_differ_by_where_there_are_enough() {
    let of = |surfaces: usize| {
        // Surfaces of 0.3 and 0.7 in turn.
        follow(100_000, surfaces, 1, |_, surface| {
            let first = if surface.is_multiple_of(2) { 0.3 } else { 0.7 };
            [first, 1.0 - first, 0.0]
        })
    };
    let many = of(8);
    assert_eq!([many.batches(), many.followed % 8], [8, 0]);
    assert_eq!(many.spread, Spread::Surfaces);
    let share = many.shares().classes[0];
    // Deviations of 0.2 over eight surfaces: 0.2/√7.
    assert!((share.error - 0.2 / 7f64.sqrt()).abs() < 0.01, "{share:?}");
    let few = of(2);
    assert_eq!([few.batches(), few.followed % 32], [16, 0]);
    assert_eq!(few.spread, Spread::FewSurfaces);
    let share = few.shares().classes[0];
    assert_near(share, 0.5, 5.0);
    assert!(share.error < 0.005, "{share:?}");
    assert_eq!(of(1).spread, Spread::FewSurfaces);
    assert_eq!(of(0).spread, Spread::Paths);
    assert_eq!(of(200).batches(), 64);
}
