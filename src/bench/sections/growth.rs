//! What readings, materials, parts and threads cost by their number.

use super::truths::{self, text};
use crate::acquisition::{Aim, Greedy, Rule, Task};
use crate::bench::machine::Memory;
use crate::bench::{Column, Diagram, Judged, Ladder, Rung, Section, Settings, Watch};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::{Event, Experiment, Extent, Known, Observer, Plan, Row, Shard, Source};
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument};
use crate::metrics::{self, Measure, MetricsSpec, test_pairs};
use crate::parametrization::usual_form;
use crate::reconstruct::{self, KRIGING, Reconstruct};
use crate::registry;
use crate::schedule::{SampleSet, SobolSet};
use crate::validation::Estimate;
use rayon::ThreadPoolBuilder;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

/// Seconds and bytes of a row by its readings, and of a study by its materials.
pub(super) const SECTION: Section = Section {
    name: "growth",
    summary: "seconds and memory, over the number of readings of a row, and of materials, parts and threads of a study",
    names: &["of", "method", "size"],
    color: 1,
    columns: &[
        Column::exact("number", "of readings, materials, parts or threads"),
        Column::exact("seconds_each", "seconds over the number"),
        Column::exact("build_seconds", "of them to reconstruct, s"),
        Column::exact("peak_bytes", "more than before, at most"),
        Column::exact("held_bytes", "more than before, at the end"),
    ],
    diagrams: &[
        Diagram::cost("number", "seconds"),
        Diagram::cost("number", "peak_bytes"),
    ],
    targets: (&[], &[]),
    ladders,
};

/// Pairs that a reconstruction is evaluated at.
const PAIRS: usize = 1 << 12;

fn ladders(settings: &Settings) -> Result<Vec<Ladder>, Error> {
    let (most, [materials, parts]): (_, [&[usize]; 2]) = match settings.quick {
        true => ([5, 3, 3], [&[1, 4]; 2]),
        false => ([7, 5, 5], [&[1, 4, 16, 64, 400], &[1, 4, 16, 64, 256]]),
    };
    let [scattered, kriged, asked] = most;
    let (_, brdf) = truths::metal("0.4")?;
    let mut ladders = Vec::new();
    for entry in reconstruct::all() {
        let method = registry::read_text(&entry, "").map_err(Error::internal)?;
        // Systems of all readings have limits of their own.
        let most = match entry.kind {
            KRIGING => kriged,
            _ if method.weighs_readings() => continue,
            _ => scattered,
        };
        let method: Rc<dyn Reconstruct> = method.into();
        let rungs = (2..=most).map(|power| rung(&brdf, &method, power));
        ladders.push(Ladder::new(["readings", entry.kind], rungs));
    }
    let batches = (2..=asked).map(|power| next(&brdf, power));
    ladders.push(Ladder::new(["readings", "next"], batches));
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    let studies = materials.iter().map(|&n| study([n, 1, all], n));
    ladders.push(Ladder::new(["materials", "study"], studies));
    let parts = parts.iter().map(|&n| study([MATERIALS, n, all], n));
    ladders.push(Ladder::new(["parts", "study"], parts));
    let threads = (0..).map(|k| 1 << k).take_while(|&n| n < 2 * all);
    let threads = threads.map(|n| {
        study(
            [if settings.quick { MATERIALS } else { MANY }, 1, n.min(all)],
            n.min(all),
        )
    });
    ladders.push(Ladder::new(["threads", "study"], threads));
    Ok(ladders)
}

/// What a pass took: its seconds, those of building, and bytes at most and at the end.
type Cost = [Option<f64>; 4];

/// The values of a row.
fn judged(number: usize, [seconds, build, peak, held]: Cost) -> Judged {
    let n = number as f64;
    let values = [Some(n), seconds.map(|s| s / n), build, peak, held];
    Judged::new(values.map(|v| Estimate::new(v, None)).into())
}

/// Does some work: its cost.
fn watched<T>(
    watch: &Watch,
    work: impl FnOnce() -> Result<(T, Option<f64>), String>,
) -> Result<Cost, String> {
    let before = watch.aside(Memory::watched);
    let start = Instant::now();
    let (made, build) = work()?;
    let seconds = start.elapsed().as_secs_f64();
    let after = watch.aside(Memory::now);
    drop(made);
    let more = |bytes: fn(Memory) -> f64| Some((bytes(after?) - before?.held).max(0.0));
    Ok([Some(seconds), build, more(|m| m.peak), more(|m| m.held)])
}

/// A row of 10^power readings: planned, measured, reconstructed and evaluated.
fn rung(brdf: &Rc<dyn Brdf>, method: &Rc<dyn Reconstruct>, power: u32) -> Rung {
    let (brdf, method) = (Rc::clone(brdf), Rc::clone(method));
    let budget = 10_usize.pow(power);
    let pass = move |watch: &Watch| {
        let spec = MetricsSpec {
            pairs: PAIRS,
            ..MetricsSpec::default()
        };
        let pairs = watch.aside(|| test_pairs(Measure::Cosine, &spec));
        let pairs = pairs.map_err(text)?;
        watched(watch, || {
            let form = usual_form(Symmetry::FULL);
            let schedule = truths::planned(&*method, &form, budget)?;
            let measured = Ideal.measure(&*brdf, &schedule);
            let start = Instant::now();
            reconstruct::forget_searches();
            let copy = method.reconstruct(&measured).map_err(text)?;
            let build = start.elapsed().as_secs_f64();
            let values = metrics::evaluate(&*copy, &pairs);
            Ok(((copy, values), Some(build)))
        })
    };
    let work = (budget + PAIRS) as f64;
    let judge = move |cost| Ok(judged(budget, cost));
    Rung::new(format!("10^{power}"), work, pass, judge)
}

/// Poses that are chosen at once.
const BATCH: usize = 16;

/// A batch chosen after 10^power readings, with the errors that are expected.
fn next(brdf: &Rc<dyn Brdf>, power: u32) -> Rung {
    let brdf = Rc::clone(brdf);
    let read = 10_usize.pow(power) - BATCH;
    let pass = move |watch: &Watch| {
        let so_far = watch.aside(|| {
            let form = usual_form(Symmetry::FULL);
            let schedule = SobolSet {}.plan(&form, read, 1).map_err(text)?;
            Ok::<_, String>(Ideal.measure(&*brdf, &Arc::new(schedule)))
        })?;
        watched(watch, || {
            reconstruct::forget_searches();
            let planner = Greedy::new(Rule::Adaptive, Aim::default());
            let task = Task::after(Some(&so_far), BATCH, Symmetry::FULL, 1);
            let batch = task.ask(&planner, Some(&so_far)).map_err(text)?;
            Ok((batch, None))
        })
    };
    let judge = move |cost| Ok(judged(read, cost));
    Rung::new(format!("10^{power}"), (read + 10_000) as f64, pass, judge)
}

/// Materials of a study whose parts are counted.
const MATERIALS: usize = 16;

/// Materials of a study whose threads are counted: seconds of work.
const MANY: usize = 400;

/// A study of so many metals in so many parts, each read and run for itself, on so many threads.
fn study(of: [usize; 3], number: usize) -> Rung {
    let [materials, parts, threads] = of;
    let metal = |i: usize| {
        let alpha = 0.1 + 0.4 * i as f64 / materials as f64;
        format!("[[material]]\nkind = \"ggx\"\nname = \"metal-{i}\"\nalpha = {alpha}\n")
    };
    let all: String = (0..materials).map(metal).collect();
    let text_of_config = format!(
        "budgets = [500]\n[[sample_set]]\nkind = \"grid\"\n[[reconstruction]]\nkind = \"cubic\"\n{all}"
    );
    let pass = move |watch: &Watch| {
        let source = Source::new("bench", text_of_config.as_str());
        let run = || {
            let mut plans = Vec::new();
            for part in 1..=parts {
                let plan = Plan::read(&source).map_err(text)?;
                let extent = Extent {
                    shard: Some(Shard { part, of: parts }),
                    ..Extent::default()
                };
                plan.run(&extent, &Known::new(), &mut Silent)
                    .map_err(text)?;
                plans.push(plan);
            }
            Ok((plans, None))
        };
        let pool = watch.aside(|| ThreadPoolBuilder::new().num_threads(threads).build());
        let pool = pool.map_err(text)?;
        watched(watch, || pool.install(run))
    };
    let work = (materials + parts) as f64 / threads as f64;
    let judge = move |cost| Ok(judged(number, cost));
    Rung::new(number.to_string(), work, pass, judge)
}

struct Silent;

impl Observer<Row> for Silent {
    fn observe(&mut self, _: &Event<'_, Row>) -> Result<(), Error> {
        Ok(())
    }
}
