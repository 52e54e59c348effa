//! Instruments and orders of their visits over their budget.

use super::truths::{self, ERRORS, Pairs, SEED, Truth, text};
use crate::bench::{Column, Diagram, Ladder, Rung, Section, Settings, Watch};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{Bench, Instrument, Order, Parts, presets, read};
use crate::measurement::Measurement;
use crate::parametrization::usual_form;
use crate::reconstruct::default_for;
use crate::schedule::{Grid, SampleSet, Schedule};
use std::rc::Rc;
use std::sync::Arc;

/// Ordering the poses and measuring them with all flaws: what it takes here, and on the instrument.
pub(super) const SECTION: Section = Section {
    name: "instruments",
    summary: "instruments and orders of visits, over the budget of a grid",
    names: &["material", "instrument", "order", "budget"],
    color: 1,
    columns: &[
        ERRORS[0],
        ERRORS[1],
        Column::exact("minutes", "of the instrument"),
        Column::exact("readings", "poses that it reaches"),
    ],
    diagrams: &[
        Diagram::error("seconds", "nrmse"),
        Diagram::error("minutes", "nrmse"),
    ],
    targets: (&["nrmse"], &[0.3, 0.1, 0.03]),
    ladders,
};

fn ladders(settings: &Settings) -> Result<Vec<Ladder>, Error> {
    let (pairs, budgets, roughness): (_, &[usize], &[&str]) = match settings.quick {
        true => (Pairs::new(1 << 11)?, &[60, 240], &["0.4"]),
        false => (
            Pairs::new(1 << 13)?,
            &[125, 500, 2000, 8000],
            &["0.4", "0.1"],
        ),
    };
    let form = usual_form(Symmetry::FULL);
    let mut schedules = Vec::new();
    for &budget in budgets {
        let schedule = Grid::default().plan(&form, budget, SEED);
        schedules.push((budget, Arc::new(schedule.map_err(Error::internal)?)));
    }
    let mut ladders = Vec::new();
    for alpha in roughness {
        let (material, brdf) = truths::metal(alpha)?;
        let truth = Truth::new(brdf, &pairs);
        for preset in presets() {
            let spec = read(preset.text).map_err(Error::internal)?;
            let bench = Rc::new(Bench::new(&spec, Parts::ALL, SEED).map_err(Error::internal)?);
            for order in Order::ALL {
                let rungs = schedules.iter().map(|s| rung(&truth, &bench, order, s));
                ladders.push(Ladder::new([&material, preset.name, order.name()], rungs));
            }
        }
    }
    Ok(ladders)
}

fn rung(
    truth: &Rc<Truth>,
    bench: &Rc<Bench>,
    order: Order,
    (budget, schedule): &(usize, Arc<Schedule>),
) -> Rung {
    let (truth, bench, schedule) = (Rc::clone(truth), Rc::clone(bench), Arc::clone(schedule));
    let brdf = Rc::clone(&truth.brdf);
    let pass = move |_: &Watch| {
        let itinerary = bench.plan(&schedule, order);
        let measured = bench.session(&itinerary, SEED).measure(&*brdf, &schedule);
        Ok((measured, itinerary.seconds() / 60.0))
    };
    let judge = move |(measured, minutes): (Measurement, f64)| {
        let method = default_for(&measured);
        let copy = method.reconstruct(&measured).map_err(text)?;
        let values = truth.set.evaluate(&*copy);
        Ok(truth.judged(&values, &[minutes, measured.readings() as f64]))
    };
    Rung::new(budget.to_string(), *budget as f64, pass, judge)
}
