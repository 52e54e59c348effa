//! Pairs to coordinates and back, one thread, in batches.

use super::pairs;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use gonio::geometry::Symmetry;
use gonio::parametrization::{self, Parametrization};
use std::fmt;
use std::sync::Arc;

const PAIRS: u64 = 100_000;

/// One form, with a name for the report.
struct Form(Arc<dyn Parametrization>);

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {}-D", self.0.name(), self.0.axes().len())
    }
}

/// Every parametrization, isotropic and not.
fn forms() -> Vec<Form> {
    let entries = parametrization::all();
    let of = |s| entries.iter().map(move |e| Form(e.form(s)));
    of(Symmetry::FULL)
        .chain(of(Symmetry::ORTHOTROPIC))
        .collect()
}

#[divan::bench(args = forms())]
fn forward(bencher: Bencher, form: &Form) {
    let pairs = pairs(PAIRS);
    let mut coords = vec![[0.0; 4]; pairs.len()];
    bencher
        .counter(ItemsCount::new(pairs.len()))
        .bench_local(|| form.0.forward_batch(black_box(&pairs), &mut coords));
}

#[divan::bench(args = forms())]
fn inverse(bencher: Bencher, form: &Form) {
    let mut coords = vec![[0.0; 4]; PAIRS as usize];
    form.0.forward_batch(&pairs(PAIRS), &mut coords);
    let mut out = vec![None; coords.len()];
    bencher
        .counter(ItemsCount::new(coords.len()))
        .bench_local(|| form.0.inverse_batch(black_box(&coords), &mut out));
}
