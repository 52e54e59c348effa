//! Throughput of every stage, and of the machine. `cargo bench` runs all of it in about two minutes; a word after `--`
//! picks the benches whose path holds it.

mod brdf;
mod instrument;
mod machine;
mod parametrization;
mod pipeline;
mod reconstruct;

use gonio::brdf::{Brdf, Channels, Presence};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::Parametrization;
use gonio::registry;
use gonio::sampling::{Random, cosine_hemisphere};
use rayon::prelude::*;
use std::sync::Arc;

fn main() {
    divan::main();
}

/// A model from the registry, in luminance.
fn model(kind: &str, text: &str) -> Box<dyn Brdf> {
    let entries = gonio::brdf::all();
    let entry = entries.iter().find(|e| e.kind == kind).expect("a model");
    let spec = registry::read_text(entry, text).expect("its parameters");
    spec.build(Channels::Luminance).expect("a BRDF")
}

/// The plain form of a parametrization of the registry.
fn form(name: &str, symmetry: Symmetry) -> Arc<dyn Parametrization> {
    let entry = gonio::parametrization::find(name);
    entry.expect("a parametrization").form(symmetry)
}

/// Random pairs, both directions cosine-distributed.
fn pairs(n: u64) -> Vec<DirectionPair> {
    let random = Random::new(1);
    let pair = |i| {
        let [a, b, c, d] = random.point(i);
        DirectionPair::new(cosine_hemisphere([a, b]), cosine_hemisphere([c, d]))
    };
    (0..n).map(pair).collect()
}

/// Evaluates in tasks of 1024 pairs on rayon's pool, as metrics do.
fn evaluate(brdf: &dyn Brdf, pairs: &[DirectionPair], out: &mut [f64]) {
    const TASK: usize = 1024;
    pairs
        .par_chunks(TASK)
        .zip(out.par_chunks_mut(TASK))
        .for_each(|(pairs, out)| {
            let mut presence = [Presence::Present; TASK];
            brdf.eval_batch(pairs, out, &mut presence[..pairs.len()]);
        });
}

/// The moments of one slice at 45° up to order 2, its sets of points on all cores.
mod moments {
    use super::model;
    use divan::{Bencher, black_box};
    use gonio::moments::{
        Channel, Estimator, MonteCarlo, Order, PeakResolving, ScrambledSobol, Slice,
    };
    use std::f64::consts::FRAC_PI_4;

    /// Every angle alike, and nearly all of it within a degree.
    const MATERIALS: [&str; 2] = ["lambert", "ggx 0.01"];

    fn slice(bencher: Bencher, material: &str, estimator: &dyn Estimator) {
        let brdf = match material {
            "lambert" => model("lambert", "albedo = 0.5"),
            _ => model("ggx", "alpha = 0.01"),
        };
        let order = Order::new(2).expect("an order");
        let slice = Slice::new(&*brdf, Channel::Luminance, FRAC_PI_4).expect("a slice");
        bencher.bench_local(|| estimator.estimate(black_box(&slice), order, 1));
    }

    #[divan::bench(args = MATERIALS)]
    fn monte_carlo(bencher: Bencher, material: &str) {
        slice(bencher, material, &MonteCarlo { samples: 100_000 });
    }

    #[divan::bench(args = MATERIALS)]
    fn sobol(bencher: Bencher, material: &str) {
        slice(bencher, material, &ScrambledSobol { samples: 1 << 17 });
    }

    #[divan::bench(args = MATERIALS)]
    fn peak_resolving(bencher: Bencher, material: &str) {
        let estimator = PeakResolving {
            tolerance: 1e-4,
            ..PeakResolving::default()
        };
        slice(bencher, material, &estimator);
    }
}
