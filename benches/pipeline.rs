//! Plan, measure, reconstruct, evaluate: what one row of a run costs.

use super::{evaluate, form, model, pairs};
use divan::Bencher;
use gonio::brdf::{Brdf, Presence};
use gonio::geometry::DirectionPair;
use gonio::geometry::Symmetry;
use gonio::instrument::{self, Bench, Ideal, Instrument, Order, Parts};
use gonio::reconstruct::{Cubic, Reconstruct};
use gonio::schedule::{Grid, SampleSet, Schedule, SobolSet};
use rayon::prelude::*;
use std::sync::Arc;

#[divan::bench(args = [1000, 16_000], sample_count = 10)]
fn plan_measure_reconstruct_evaluate(bencher: Bencher, budget: usize) {
    let truth = model("ggx", "alpha = 0.3");
    let form = form("half-difference", Symmetry::FULL);
    let pairs = pairs(20_000);
    bencher.bench_local(|| {
        let schedule = Arc::new(Grid::default().plan(&form, budget, 1).expect("a schedule"));
        let measurement = Ideal.measure(&*truth, &schedule);
        let brdf = Cubic::default().reconstruct(&measurement).expect("a BRDF");
        let mut out = vec![0.0; pairs.len()];
        evaluate(&*brdf, &pairs, &mut out);
        out
    });
}

/// What an instrument costs, against nothing but the BRDF.
mod instruments {
    use super::*;

    const POSES: usize = 16_384;

    fn schedule() -> Arc<Schedule> {
        let form = form("hybrid", Symmetry::FULL);
        Arc::new(SobolSet {}.plan(&form, POSES, 3).expect("a schedule"))
    }

    /// The loop that the ideal instrument is measured by: its ratio to this is to be 1.
    fn direct(brdf: &dyn Brdf, schedule: &Schedule) -> (Vec<f64>, Vec<Presence>) {
        let mut values = vec![0.0; schedule.poses.len()];
        let mut presence = vec![Presence::Present; schedule.poses.len()];
        values
            .par_chunks_mut(1024)
            .zip(presence.par_chunks_mut(1024))
            .zip(schedule.poses.par_chunks(1024))
            .for_each(|((values, presence), poses)| {
                let pairs: Vec<DirectionPair> = poses.iter().map(|p| p.pair).collect();
                brdf.eval_batch(&pairs, values, presence);
            });
        (values, presence)
    }

    #[divan::bench(sample_count = 300)]
    fn eval_batch(bencher: Bencher) {
        let (truth, schedule) = (model("ggx", "alpha = 0.1"), schedule());
        bencher.bench_local(|| direct(&*truth, &schedule));
    }

    #[divan::bench(sample_count = 300)]
    fn ideal(bencher: Bencher) {
        let (truth, schedule) = (model("ggx", "alpha = 0.1"), schedule());
        bencher.bench_local(|| Ideal.measure(&*truth, &schedule));
    }

    fn session(bencher: Bencher, alpha: f64, parts: Parts) {
        let truth = model("ggx", &format!("alpha = {alpha}"));
        let schedule = schedule();
        let preset = instrument::presets().swap_remove(0);
        let spec = instrument::read(preset.text).expect("a preset");
        let bench = Bench::new(&spec, parts, 1).expect("an instrument");
        let itinerary = bench.plan(&schedule, Order::Sorted);
        let session = bench.session(&itinerary, 1);
        bencher.bench_local(|| session.measure(&*truth, &schedule));
    }

    #[divan::bench(args = [0.5, 0.1, 0.01], sample_count = 5)]
    fn everything(bencher: Bencher, alpha: f64) {
        session(bencher, alpha, Parts::ALL);
    }

    #[divan::bench(args = [0.5, 0.1, 0.01], sample_count = 5)]
    fn apertures(bencher: Bencher, alpha: f64) {
        let parts = Parts {
            noise: false,
            ..Parts::ALL
        };
        session(bencher, alpha, parts);
    }

    #[divan::bench(sample_count = 100)]
    fn axes_only(bencher: Bencher) {
        session(bencher, 0.1, Parts::NONE);
    }
}
