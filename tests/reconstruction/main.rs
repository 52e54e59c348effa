//! Laws of reconstructions: what they reproduce, their symmetry, what they do at the edges.
#![cfg(feature = "experiments")]

#[path = "../common/mod.rs"]
mod common;

mod convergence;
mod coverage;
mod edges;
mod fit;
mod kriging;
mod layouts;
mod local_spline;
mod noise;
mod reproduction;
mod symmetric;
mod uncertainty;
mod validation;

use common::{ISOTROPIC, Level, ONE_SIDED, bent, form, made, member, polar, product};
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::{Details, Flags, Measurement, Outcome};
use gonio::parametrization::{AxisKind, Layout, Parametrization};
use gonio::reconstruct::{self, Reconstruct};
use gonio::registry::{self, Entry};
use gonio::schedule::{Centring, Grid, Pose, Ratio, SampleSet, Schedule, SobolSet};
use std::sync::Arc;

/// A material in luminance that has data everywhere.
fn material(symmetry: Symmetry, f: impl Fn(&DirectionPair) -> f64 + Send + Sync) -> impl Brdf {
    made(symmetry, move |pair| Some([f(pair)]))
}

/// A polynomial of the directions, so smooth through every pole and fold of every chart, that has
/// exactly the symmetries asked for. In [0.2, 2].
fn smooth(symmetry: Symmetry, pair: &DirectionPair) -> f64 {
    let (h, k) = (pair.half(), pair.back());
    let turn = h.cross(k).z;
    let mut f = 0.6 + 0.3 * h.z + 0.3 * k.z * k.z + 0.5 * turn * turn;
    if !symmetry.reciprocal {
        f += 0.1 * k.z;
    }
    if !symmetry.bilateral {
        f += 0.2 * turn * k.z;
    }
    if !symmetry.reciprocal && !symmetry.bilateral {
        f += 0.1 * turn;
    }
    if !symmetry.isotropic {
        f += 0.2 * (h.x * h.x + k.y * k.y);
        if !symmetry.bilateral {
            f += 0.1 * h.x;
        }
    }
    f
}

fn smooth_material(symmetry: Symmetry) -> impl Brdf {
    material(symmetry, move |pair| smooth(symmetry, pair))
}

/// Every polar parametrization under the symmetries, plain and with a square root on the first axis.
fn forms(symmetries: &[Symmetry]) -> Vec<Arc<dyn Parametrization>> {
    let both = |entry| symmetries.iter().flat_map(move |s| bent(&entry, *s));
    polar().flat_map(both).collect()
}

/// Every reconstruction that goes through its readings, and with linear values too where it has a choice. A fit and
/// sums of functions of a prior have laws of their own.
fn methods() -> Vec<Box<dyn Reconstruct>> {
    let mut methods = Vec::new();
    let of_readings = |e: &Entry<dyn Reconstruct>| !["fit", "components"].contains(&e.kind);
    for entry in reconstruct::all().into_iter().filter(of_readings) {
        methods.push(registry::read_text(&entry, "").unwrap());
        methods.extend(registry::read_text(&entry, "values = \"linear\""));
    }
    assert_eq!(methods.len(), 12);
    methods
}

/// The share by which a method misses readings of a smooth material that are exact: kriging has a variance that no
/// column explains, and takes all materials for reciprocal.
fn missed(method: &dyn Reconstruct, m: &Measurement) -> f64 {
    let symmetry = m.schedule.parametrization.symmetry();
    match method.label().starts_with("kriging") {
        false => 0.0,
        true if symmetry.reciprocal => 0.02,
        true => f64::INFINITY,
    }
}

fn method(kind: &str, text: &str) -> Box<dyn Reconstruct> {
    member(reconstruct::all(), kind, text)
}

/// The methods that take a sample set.
fn methods_on(set: &dyn SampleSet) -> impl Iterator<Item = Box<dyn Reconstruct>> {
    let is_grid = set.is_grid();
    let methods = methods().into_iter();
    methods.filter(move |m| is_grid || !m.needs_grid())
}

/// A grid with numbers of nodes in a ratio, or the usual one, and with its nodes where a centring says.
fn grid(ratio: &[f64], centring: &[Centring]) -> Grid {
    Grid {
        ratio: (!ratio.is_empty()).then(|| Ratio::Numbers(ratio.to_vec())),
        centring: Some(centring.to_vec()),
        ..Grid::default()
    }
}

/// A grid and a Sobol set.
fn sets() -> [Box<dyn SampleSet>; 2] {
    [Box::new(Grid::default()), Box::new(SobolSet {})]
}

fn measure(
    brdf: &dyn Brdf,
    form: &Arc<dyn Parametrization>,
    set: &dyn SampleSet,
    budget: usize,
) -> Measurement {
    Ideal.measure(brdf, &Arc::new(set.plan(form, budget, 1).unwrap()))
}

/// Every method meets one of so many forms in quick tests. It has no factor in common with what the forms are a product
/// of, so that each method meets every parametrization, every symmetry and both warps.
const SHARE: usize = 11;

/// Calls `check` with reconstructions of a material that can be made by methods on forms and sets: all of them, or
/// the share of quick tests.
fn each(
    level: Level,
    methods: &[Box<dyn Reconstruct>],
    forms: &[Arc<dyn Parametrization>],
    brdf: impl Fn(Symmetry) -> Box<dyn Brdf>,
    budget: usize,
    mut check: impl FnMut(&str, &dyn Reconstruct, &Measurement, &dyn Brdf),
) {
    let stride = level.of(SHARE.min(forms.len()), 1);
    for ((i, form), (j, set)) in product(forms.iter().enumerate(), sets().iter().enumerate()) {
        // The smallest grid of a full turn has two nodes around it.
        let Ok(schedule) = set.plan(form, budget, 1) else {
            continue;
        };
        let measurement = Ideal.measure(&*brdf(form.symmetry()), &Arc::new(schedule));
        for (k, method) in methods.iter().enumerate() {
            if method.needs_grid() && !set.is_grid() || !(i + j + k).is_multiple_of(stride) {
                continue;
            }
            let (label, on) = (method.label(), set.label());
            let (name, warp, symmetry) = (form.name(), form.warp_name(), form.symmetry());
            let what = format!("{label} on {on} in {name} {warp} {symmetry:?}");
            let brdf = method.reconstruct(&measurement).expect(&what);
            check(&what, &**method, &measurement, &*brdf);
        }
    }
}

/// [`each`] of all methods on all forms with some symmetries.
fn walk(
    level: Level,
    symmetries: &[Symmetry],
    brdf: impl Fn(Symmetry) -> Box<dyn Brdf>,
    budget: usize,
    check: impl FnMut(&str, &dyn Reconstruct, &Measurement, &dyn Brdf),
) {
    each(level, &methods(), &forms(symmetries), brdf, budget, check);
}

/// A measurement of half/difference poses by a function of the pair, with uncertainties of 0.
fn read(schedule: Arc<Schedule>, f: impl Fn(&DirectionPair) -> f64) -> Measurement {
    let values: Vec<f64> = schedule.poses.iter().map(|p| f(&p.pair)).collect();
    let n = values.len();
    Measurement {
        channels: Channels::Luminance,
        values,
        outcomes: vec![Outcome::Reading; n],
        places: Vec::new(),
        half_angles_deg: [0.0; 2],
        details: Some(Details {
            type_a: vec![0.0; n],
            type_b: vec![0.0; n],
            flags: vec![Flags::NONE; n],
        }),
        schedule,
    }
}

/// True if a pose lies on the node of the lattice, if there is one, where its configuration is
/// looked up. Two kinds of grid poses do not. Spherical: exchanging light and sensor may lead off
/// a lattice whose two halves have different steps. 4-D half/difference at theta_h = 0: nodes with
/// the same phi_h + phi_d are one configuration, looked up at phi_h = 0.
fn on_node(m: &Measurement, i: usize) -> bool {
    let (Some(lattice), form) = (&m.schedule.lattice, &m.schedule.parametrization) else {
        return true;
    };
    let coords = m.schedule.poses[i].coords;
    let off = |d: usize| {
        let x = lattice.axes[d].index(coords[d]);
        (x - x.round()).abs() > 1e-6
    };
    let exchanged = form.facts().exchange && form.symmetry().reciprocal;
    let at_pole = form.facts().layout == Layout::Nested && coords[0] == 0.0;
    !(exchanged || at_pole) || !(0..form.axes().len()).any(off)
}

/// The value of a reconstruction, which has one everywhere.
fn value(brdf: &dyn Brdf, pair: &DirectionPair) -> f64 {
    brdf.luminance(pair).expect("reconstructions have no holes")
}

/// The readings on nodes ([`on_node`]), and the errors of a reconstruction there.
fn errors_on_nodes(m: &Measurement, brdf: &dyn Brdf) -> Vec<(Pose, f64, f64)> {
    let poses = m.schedule.poses.iter().enumerate();
    let on_nodes = poses.filter(|(i, _)| on_node(m, *i));
    let errors = on_nodes.filter_map(|(i, pose)| {
        let reading = m.value(i)?[0];
        Some((*pose, reading, (value(brdf, &pose.pair) - reading).abs()))
    });
    errors.collect()
}

/// The symmetries most materials have: three in 3-D, three in 4-D.
fn some_symmetries() -> Vec<Symmetry> {
    let helmholtz = Symmetry {
        reciprocal: true,
        ..Symmetry::NONE
    };
    let isotropic = [Symmetry::FULL, ISOTROPIC, ONE_SIDED];
    [
        isotropic,
        [Symmetry::ORTHOTROPIC, Symmetry::NONE, helmholtz],
    ]
    .concat()
}

/// Axes that start at a pole.
fn radial(form: &dyn Parametrization) -> Vec<usize> {
    let axes = form.axes().iter().enumerate();
    let radial = axes.filter(|(_, a)| a.kind == AxisKind::Radial);
    radial.map(|(d, _)| d).collect()
}
