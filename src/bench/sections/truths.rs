//! Materials that benches measure, and how far something is from one.

use crate::bench::{Column, Diagram, Judged, Settings};
use crate::brdf::measured::merl::Merl;
use crate::brdf::{self, Brdf, Channels};
use crate::error::Error;
use crate::metrics::{self, Level, Measure, MetricsSpec, TestSet, Values};
use crate::parametrization::Parametrization;
use crate::reconstruct::Reconstruct;
use crate::schedule::{Grid, SampleSet, Schedule, SobolSet};
use crate::validation::Estimate;
use std::rc::Rc;
use std::sync::Arc;

/// Seed of everything random here.
pub(super) const SEED: u64 = 1;

pub(super) type Named = (String, Rc<dyn Brdf>);

/// A material from the registry. Names and keys are constants: a failure is an internal error.
pub(super) fn built(kind: &str, text: &str) -> Result<Rc<dyn Brdf>, Error> {
    let keys = format!("kind = \"{kind}\"\n{text}");
    let keys = toml::de::DeTable::parse(&keys).map_err(Error::internal)?;
    let spec = brdf::read(keys).map_err(Error::internal)?;
    let built = spec.build(Channels::Luminance);
    Ok(built.map_err(Error::internal)?.into())
}

/// Metal of some roughness.
pub(super) fn metal(alpha: &str) -> Result<Named, Error> {
    let name = format!("ggx-{alpha}");
    Ok((name, built("ggx", &format!("alpha = {alpha}"))?))
}

/// The measured table, or the one that stands for it.
pub(super) fn table(settings: &Settings) -> Result<Named, Error> {
    let Some(path) = &settings.merl else {
        let text = "of = { kind = \"ggx\", alpha = 0.1 }";
        return Ok(("table-ggx-0.1".into(), built("tabulated", text)?));
    };
    let table = Merl::load(path, Channels::Luminance, None).map_err(|e| Error::data(path, e))?;
    let name = path.file_stem().unwrap_or("table".as_ref());
    Ok((name.to_string_lossy().into_owned(), Rc::new(table)))
}

/// Poses for a method: a grid if it needs one, else Sobol points.
pub(super) fn planned(
    method: &dyn Reconstruct,
    form: &Arc<dyn Parametrization>,
    budget: usize,
) -> Result<Arc<Schedule>, String> {
    let set: &dyn SampleSet = match method.needs_grid() {
        true => &Grid::default(),
        false => &SobolSet {},
    };
    Ok(Arc::new(set.plan(form, budget, SEED).map_err(text)?))
}

/// Errors of a BRDF, each with its standard error.
pub(super) const ERRORS: [Column; 2] = [
    Column::estimated("nrmse", "nrmse_se", "RMS of (g − f) cos over RMS of f cos"),
    Column::estimated(
        "log_relative",
        "log_relative_se",
        "mean |ln((g + 1e-3)/(f + 1e-3))|",
    ),
];

/// Both errors over the seconds.
pub(super) const DIAGRAMS: [Diagram; 2] = [
    Diagram::error("seconds", "nrmse"),
    Diagram::error("seconds", "log_relative"),
];

/// A truth at test pairs.
pub(super) struct Truth {
    pub brdf: Rc<dyn Brdf>,
    /// The test pairs.
    pub set: Rc<Pairs>,
    values: Values,
}

/// Test pairs that truths share.
pub(super) struct Pairs {
    set: TestSet,
    level: Level,
}

impl Pairs {
    /// About so many, cosine-distributed.
    pub(crate) fn new(pairs: usize) -> Result<Rc<Self>, Error> {
        let spec = MetricsSpec {
            pairs,
            ..MetricsSpec::default()
        };
        let set = TestSet::new(&[Measure::Cosine], &spec);
        let set = set.map_err(Error::internal)?;
        let level = set.level(0);
        Ok(Rc::new(Self { set, level }))
    }

    /// Values of a BRDF there.
    pub(crate) fn evaluate(&self, brdf: &dyn Brdf) -> Values {
        metrics::evaluate(brdf, &self.level.pairs)
    }

    pub(crate) fn count(&self) -> usize {
        self.level.pairs.len()
    }
}

impl Truth {
    pub(crate) fn new(brdf: Rc<dyn Brdf>, set: &Rc<Pairs>) -> Rc<Self> {
        Rc::new(Self {
            values: set.evaluate(&*brdf),
            brdf,
            set: Rc::clone(set),
        })
    }

    /// The errors of values at the pairs, and then other numbers.
    pub(crate) fn judged(&self, values: &Values, others: &[f64]) -> Judged {
        let mut tally = self.set.set.tally();
        self.set.level.add_to(&mut tally, &self.values, values);
        let (errors, standard) = (tally.errors(0), tally.standard_errors(0));
        let estimated = [
            Estimate::new(errors.nrmse, standard.nrmse),
            Estimate::new(errors.log_relative, standard.log_relative),
        ];
        let others = others.iter().map(|x| Estimate::new(*x, None));
        Judged::new(estimated.into_iter().chain(others).collect())
    }
}

/// An error as the text that leaves a rung out.
pub(super) fn text(e: impl std::fmt::Display) -> String {
    e.to_string()
}
