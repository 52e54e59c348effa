//! Plan, measure, reconstruct, evaluate: what one row of a run costs.

use super::{evaluate, model, pairs};
use divan::Bencher;
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::parametrization;
use gonio::reconstruct;
use gonio::registry;
use gonio::schedule::{Grid, SampleSet};
use std::sync::Arc;

#[divan::bench(args = [1000, 16_000], sample_count = 10)]
fn plan_measure_reconstruct_evaluate(bencher: Bencher, budget: usize) {
    let truth = model("ggx", "alpha = 0.3");
    let entries = reconstruct::all();
    let cubic = entries
        .iter()
        .find(|e| e.kind == "cubic")
        .expect("a method");
    let cubic = registry::read_text(cubic, "").expect("its defaults");
    let form = parametrization::find("half-difference")
        .expect("a parametrization")
        .form(Symmetry::FULL);
    let pairs = pairs(20_000);
    bencher.bench_local(|| {
        let schedule = Arc::new(Grid::default().plan(&form, budget, 1).expect("a schedule"));
        let measurement = Ideal.measure(&*truth, &schedule);
        let brdf = cubic.reconstruct(&measurement).expect("a BRDF");
        let mut out = vec![0.0; pairs.len()];
        evaluate(&*brdf, &pairs, &mut out);
        out
    });
}
