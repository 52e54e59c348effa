//! What readings and materials cost by their number.

use super::truths::{self, text};
use crate::bench::machine::Memory;
use crate::bench::{Column, Diagram, Judged, Ladder, Rung, Section, Settings, Watch};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::{Event, Experiment, Extent, Known, Observer, Plan, Row, Source};
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument};
use crate::metrics::{self, Measure, MetricsSpec, test_pairs};
use crate::parametrization::usual_form;
use crate::reconstruct::{self, Reconstruct};
use crate::registry;
use crate::validation::Estimate;
use std::rc::Rc;
use std::time::Instant;

/// Seconds and bytes of a row by its readings, and of a study by its materials.
pub(super) const SECTION: Section = Section {
    name: "growth",
    summary: "seconds and memory, over the number of readings of a row and of materials of a study",
    names: &["of", "method", "size"],
    color: 1,
    columns: &[
        Column::exact("number", "of readings or materials"),
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
    let (most, materials): (_, &[usize]) = match settings.quick {
        true => (5, &[1, 4]),
        false => (7, &[1, 4, 16, 64, 400]),
    };
    let (_, brdf) = truths::metal("0.4")?;
    let mut ladders = Vec::new();
    for entry in reconstruct::all() {
        let method = registry::read_text(&entry, "").map_err(Error::internal)?;
        // One system of all readings has a limit of its own.
        if method.weighs_readings() {
            continue;
        }
        let method: Rc<dyn Reconstruct> = method.into();
        let rungs = (3..=most).map(|power| rung(&brdf, &method, power));
        ladders.push(Ladder::new(["readings", entry.kind], rungs));
    }
    let studies = materials.iter().map(|&n| study(n));
    ladders.push(Ladder::new(["materials", "study"], studies));
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

/// A study of so many metals.
fn study(materials: usize) -> Rung {
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
        watched(watch, || {
            let plan = Plan::read(&source).map_err(text)?;
            let ran = plan.run(&Extent::default(), &Known::new(), &mut Silent);
            ran.map_err(text)?;
            Ok((plan, None))
        })
    };
    let work = 1.0 + materials as f64;
    let judge = move |cost| Ok(judged(materials, cost));
    Rung::new(materials.to_string(), work, pass, judge)
}

struct Silent;

impl Observer<Row> for Silent {
    fn observe(&mut self, _: &Event<'_, Row>) -> Result<(), Error> {
        Ok(())
    }
}
