//! What readings say of their own reconstruction.

use super::{Progress, is_verbose, print};
use crate::error::{Error, count};
use crate::measurement::Measurement;
use crate::metrics::{Errors, Measure, WITHIN};
use crate::reconstruct::Reconstruct;
use crate::report::Columns;
use crate::validation::{Against, CrossValidation, Estimate, Scores};
use clap::ValueEnum;
use std::path::Path;
use std::sync::Arc;

/// Methods of a ranking that are printed without `--verbose`.
const SHOWN: usize = 8;

/// What is left out to judge methods by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum LeaveOut {
    /// Sheets if most readings lie in three or more, points if they lie in none, else nothing
    Auto,
    /// Whole sheets of constant incidence
    Sheets,
    /// 10-fold cross-validation: tenths of the readings, at random
    Points,
    /// Nothing: no errors without a truth
    None,
}

/// A number of some digits with its standard error, as text.
fn estimate(e: &Estimate, digits: usize) -> String {
    match (e.value, e.standard_error) {
        (None, _) => "undefined".into(),
        (Some(value), None) => format!("{value:.digits$e}"),
        (Some(value), Some(error)) => format!("{value:.digits$e} ± {error:.0e}"),
    }
}

/// Prints all errors at readings, and which share of the readings is within k = 2 if that is known.
pub(super) fn print_scores(
    scores: &Scores,
    within: Option<[Estimate; Measure::USUAL.len()]>,
) -> Result<(), Error> {
    let names = Errors::QUANTITIES.map(|(quantity, _)| quantity.name);
    let mut errors = Against {
        names: names.into(),
        columns: scores.0.map(Vec::from).into(),
    };
    if let Some(within) = within {
        errors.names.push(WITHIN.name);
        let columns = errors.columns.iter_mut().zip(within);
        columns.for_each(|(column, share)| column.push(share));
    }
    print(&table_of(&errors, &Measure::USUAL, 2))
}

/// Errors as a table of some digits, a column a measure.
pub(super) fn table_of(errors: &Against, measures: &[Measure], digits: usize) -> String {
    let measures = measures.iter().map(|m| format!("\t>{}", m.name()));
    let mut table = Columns::new(&format!("error{}", measures.collect::<String>()));
    for (i, name) in errors.names.iter().enumerate() {
        let cells = errors.columns.iter();
        let cells = cells.map(|c| format!("\t{}", estimate(&c[i], digits)));
        table.row(&format!("{name}{}", cells.collect::<String>()));
    }
    table.to_string()
}

impl LeaveOut {
    /// Prints how good `methods` are at readings that they were not given; returns the best. Without methods
    /// the readings choose from all that there are, in these `coordinates` if some are asked for. `None` if
    /// there is nothing to choose by.
    pub(super) fn choose(
        self,
        measurement: &Measurement,
        path: &Path,
        mut methods: Vec<Arc<dyn Reconstruct>>,
        coordinates: Option<&str>,
    ) -> Result<Option<Arc<dyn Reconstruct>>, Error> {
        let sheets = match self {
            Self::None => return Ok(None),
            Self::Auto => None,
            Self::Sheets => Some(true),
            Self::Points => Some(false),
        };
        let validation = match CrossValidation::new(measurement, sheets) {
            Ok(validation) => validation,
            Err(e) if sheets.is_none() => {
                print(&format!("no cross-validation: {e}\n"))?;
                return Ok(None);
            }
            Err(e) => return Err(Error::config("--cross-validation", e)),
        };
        if methods.is_empty() {
            methods = validation.candidates();
            methods.retain(|method| {
                let its = method.coordinates().map(|c| c.kind.as_str());
                coordinates.is_none() || its == coordinates
            });
        }
        let tasks = validation.tasks(methods.len()) as u64;
        let progress = Progress::with_work(tasks, "cross-validates");
        let failed = |e| Error::data(path, e);
        let ranked = validation.rank(methods, || progress.count(1));
        let ranked = ranked.map_err(failed)?;
        drop(progress);
        let all = measurement.readings();
        let of = match validation.readings() {
            some if some < all => format!(" ({some} of {} take part)", count(all, "reading")),
            _ => String::new(),
        };
        print(&format!("{}{of}\n", validation.left()))?;
        if ranked.len() > 1 {
            let shown = if is_verbose() { ranked.len() } else { SHOWN };
            let (quantity, measure) = (Errors::QUANTITIES[0].0.name, Measure::USUAL[0].name());
            let mut table = Columns::new(&format!("reconstruction\t>{quantity}, {measure}"));
            for (method, scores) in ranked.iter().take(shown) {
                let error = estimate(&scores.0[0][0], 2);
                table.row(&format!("{}\t{error}", method.label()));
            }
            print(&table.to_string())?;
            if shown < ranked.len() {
                let more = count(ranked.len() - shown, "more method");
                print(&format!("and {more} (--verbose shows all)\n"))?;
            }
        }
        let Some((best, scores)) = ranked.into_iter().next() else {
            return Ok(None);
        };
        let label = best.label();
        print(&format!("errors of {label} at readings left out:\n"))?;
        let within = validation.within(&*best).map_err(failed)?;
        print_scores(&scores, within)?;
        let stated = measurement.details.as_ref();
        if within.is_none() && stated.is_some_and(|d| d.type_b.iter().any(|u| *u > 0.0)) {
            let why = "no reading has an uncertainty of type A, and what is of type B they share";
            print(&format!("{} –: {why}\n", WITHIN.name))?;
        }
        Ok(Some(best))
    }
}
