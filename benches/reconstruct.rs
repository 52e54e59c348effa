//! Every reconstruction: built from 64 000 readings (1000 where all of them make one system), and evaluated at
//! 200 000 pairs on all cores.

use super::{evaluate, model, pairs};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use gonio::brdf::Brdf;
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::Measurement;
use gonio::parametrization::{self, WarpSpec};
use gonio::reconstruct::{self, Reconstruct};
use gonio::registry;
use gonio::schedule::{Grid, SampleSet, SobolSet};
use std::collections::BTreeMap;
use std::sync::Arc;

const READINGS: usize = 64_000;
/// Readings of a method that solves one system of all of them.
const FEW: usize = 1000;
const PAIRS: u64 = 200_000;

/// A reconstruction on a sample set it can use.
#[derive(Debug)]
struct Case {
    method: Box<dyn Reconstruct>,
    grid: bool,
    symmetry: Symmetry,
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let set = if self.grid { "grid" } else { "sobol" };
        let dimensions = if self.symmetry.isotropic { 3 } else { 4 };
        write!(f, "{} {set} {dimensions}-D", self.method.label())
    }
}

impl Case {
    fn measure(&self) -> Measurement {
        let theta_h = BTreeMap::from([("theta_h".to_owned(), WarpSpec::SquareRoot)]);
        let form = parametrization::find("half-difference")
            .expect("a parametrization")
            .warped(self.symmetry, &theta_h)
            .expect("a warp");
        let readings = match self.method.weighs_readings() {
            true => FEW,
            false => READINGS,
        };
        let schedule = match self.grid {
            true => Grid::default().plan(&form, readings, 1),
            false => SobolSet {}.plan(&form, readings, 1),
        };
        let brdf = match self.symmetry.isotropic {
            true => model("ggx", "alpha = 0.3"),
            false => model("ggx", "alpha = [0.1, 0.4]"),
        };
        Ideal.measure(&*brdf, &Arc::new(schedule.expect("a schedule")))
    }

    fn build(&self, measurement: &Measurement) -> Box<dyn Brdf> {
        reconstruct::forget_searches();
        self.method.reconstruct(measurement).expect("a BRDF")
    }
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for symmetry in [Symmetry::FULL, Symmetry::ORTHOTROPIC] {
        for entry in reconstruct::all() {
            for grid in [true, false] {
                let method = registry::read_text(&entry, "").expect("its defaults");
                if grid || !method.needs_grid() {
                    cases.push(Case {
                        method,
                        grid,
                        symmetry,
                    });
                }
            }
        }
    }
    cases
}

#[divan::bench(args = cases(), sample_count = 5)]
fn build(bencher: Bencher, case: &Case) {
    let measurement = case.measure();
    bencher.bench(|| case.build(black_box(&measurement)));
}

#[divan::bench(args = cases(), sample_count = 5)]
fn evaluate_200_000(bencher: Bencher, case: &Case) {
    let brdf = case.build(&case.measure());
    let pairs = pairs(PAIRS);
    let mut out = vec![0.0; pairs.len()];
    bencher
        .counter(ItemsCount::new(pairs.len()))
        .bench_local(|| evaluate(&*brdf, black_box(&pairs), &mut out));
}
