//! Estimators of moments over their samples or tolerances.

use super::truths::{self, SEED, text};
use crate::bench::{Column, Diagram, Judged, Ladder, Rung, Section, Settings, Watch};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::moments::{
    Channel, Component, Estimator, MomentsSpec, MonteCarlo, Order, PeakResolving, Profile,
    ScrambledSobol,
};
use crate::statistics::median;
use crate::validation::Estimate;
use std::cell::OnceCell;
use std::rc::Rc;
use std::time::Instant;

/// Energy and covariance of every view against a tight reference.
pub(super) const SECTION: Section = Section {
    name: "moments",
    summary: "estimators of moments of slices, over samples or tolerance",
    names: &["material", "estimator", "parameter"],
    color: 1,
    columns: &[
        Column::exact("evaluations", "values of the BRDF, mean over the views"),
        Column::estimated(
            "energy_error",
            "energy_known",
            "largest relative error of a view",
        ),
        Column::estimated(
            "covariance_error",
            "covariance_known",
            "largest error of a view and component over σ²",
        ),
        Column::exact(
            "covariance_median",
            "median over the views of the largest error of a component over σ²",
        ),
        Column::exact("unresolved_views", "views that are not resolved"),
    ],
    diagrams: &[
        Diagram::error("seconds", "energy_error"),
        Diagram::error("seconds", "covariance_error"),
    ],
    targets: (
        &["energy_error", "covariance_error"],
        &[1e-2, 1e-3, 1e-4, 1e-5, 1e-6],
    ),
    ladders,
};

/// What errors are against.
const REFERENCE: PeakResolving = PeakResolving {
    tolerance: 1e-9,
    max_evaluations: 2_000_000,
};
const FEW: usize = 1;

/// A material, and its reference as soon as it is asked for.
struct Subject {
    brdf: Rc<dyn Brdf>,
    spec: MomentsSpec,
    reference: OnceCell<Profile>,
}

type Rungs = Vec<(String, Rc<dyn Estimator>)>;

/// Every estimator with every parameter, cheapest first.
fn estimators(quick: bool) -> [(&'static str, Rungs); 3] {
    let few = |all: Rungs, n| match quick {
        true => all.into_iter().take(n).collect(),
        false => all,
    };
    let random = [1024, 10_016, 100_000, 320_000].map(|samples| {
        let by = MonteCarlo { samples };
        named(samples.to_string(), by)
    });
    let sobol = [10, 12, 14, 16, 18].map(|power| {
        let samples = 1 << power;
        named(format!("2^{power}"), ScrambledSobol { samples })
    });
    let peaks = [2, 3, 4, 5, 6, 7, 8].map(|power| {
        let (tolerance, rest) = (f64::powi(10.0, -power), PeakResolving::default());
        named(format!("1e-{power}"), PeakResolving { tolerance, ..rest })
    });
    [
        ("monte-carlo", few(random.into(), 3)),
        ("sobol", few(sobol.into(), 4)),
        (PEAKS, few(peaks.into(), 5)),
    ]
}

/// An estimator with the name of its rung.
fn named(rung: String, by: impl Estimator + 'static) -> (String, Rc<dyn Estimator>) {
    (rung, Rc::new(by))
}

/// The estimator that reports when its budget is exhausted.
const PEAKS: &str = "peak-resolving";

fn ladders(settings: &Settings) -> Result<Vec<Ladder>, Error> {
    let table = truths::table(settings)?;
    let views = if settings.quick { FEW } else { 90 };
    let spec = MomentsSpec {
        views: settings.views.unwrap_or(views),
        order: Order::new(2).unwrap_or_default(),
        ..MomentsSpec::default()
    };
    let materials = [
        ("lambert".into(), truths::built("lambert", "")?),
        truths::metal("0.1")?,
        truths::metal("0.01")?,
        truths::metal("0.001")?,
        table,
    ];
    let mut ladders = Vec::new();
    for (name, brdf) in materials {
        let subject = Rc::new(Subject {
            brdf,
            spec: spec.clone(),
            reference: OnceCell::new(),
        });
        for (n, (estimator, rungs)) in estimators(settings.quick).into_iter().enumerate() {
            // The first to be judged waits for the reference.
            ladders.push(ladder(&subject, [&name, estimator], rungs, n == 0));
        }
    }
    Ok(ladders)
}

fn ladder(subject: &Rc<Subject>, names: [&str; 2], rungs: Rungs, is_first: bool) -> Ladder {
    let can_be_exhausted = names[1] == PEAKS;
    let rung = |(setting, by): &(String, Rc<dyn Estimator>)| {
        let (of, judge_by, by) = (Rc::clone(subject), Rc::clone(subject), Rc::clone(by));
        let pass = move |_: &Watch| of.profile(&*by, &of.spec);
        let judge = move |profile| judge_by.judged(&profile, can_be_exhausted);
        Rung::new(setting, 1.0, pass, judge)
    };
    let ladder = Ladder::new(names, rungs.iter().map(rung));
    let of = Rc::clone(subject);
    let pilot = move || {
        let mut seconds = Vec::new();
        for (_, by) in &rungs {
            seconds.push([of.seconds(&**by)?, 0.0]);
        }
        if let (true, Some(first)) = (is_first, seconds.first_mut()) {
            first[1] = of.seconds(&REFERENCE)?;
        }
        Ok(seconds)
    };
    Ladder {
        pilot: Some(Box::new(pilot)),
        ..ladder
    }
}

impl Subject {
    fn profile(&self, by: &dyn Estimator, spec: &MomentsSpec) -> Result<Profile, String> {
        Profile::new(&*self.brdf, Channel::Luminance, spec, by, SEED).map_err(text)
    }

    /// Seconds of all views: those of a few, in proportion.
    fn seconds(&self, by: &dyn Estimator) -> Result<f64, String> {
        // As many as work at the same time: fewer would take as long.
        let views = rayon::current_num_threads().clamp(FEW, self.spec.views.max(FEW));
        let few = MomentsSpec {
            views,
            ..self.spec.clone()
        };
        let start = Instant::now();
        self.profile(by, &few)?;
        Ok(start.elapsed().as_secs_f64() * self.spec.views as f64 / views as f64)
    }

    fn judged(&self, got: &Profile, can_be_exhausted: bool) -> Result<Judged, String> {
        let reference = match self.reference.get() {
            Some(reference) => reference,
            None => {
                let made = self.profile(&REFERENCE, &self.spec)?;
                self.reference.get_or_init(|| made)
            }
        };
        let known = errors(reference, |v, c| {
            Some(reference.slices[v].moments.get(c)?.uncertainty)
        });
        let errors = errors(reference, |v, c| {
            let value = got.slices[v].moments.get(c)?.value;
            Some(value - reference.slices[v].moments.get(c)?.value)
        });
        let (all, unresolved) = (got.slices.len(), got.unresolved());
        let evaluations: usize = got.slices.iter().map(|s| s.evaluations).sum();
        // What is below the accuracy of the reference is not known.
        let error = |error: f64, known: f64| Estimate::new(error.max(known), Some(known));
        Ok(Judged {
            values: vec![
                Estimate::new((evaluations / all.max(1)) as f64, None),
                error(errors[0], known[0]),
                error(errors[1], known[1]),
                Estimate::new(errors[2].max(known[2]), None),
                Estimate::new(unresolved as f64, None),
            ],
            // A smaller tolerance would end at the same number of values with the same result.
            is_last: can_be_exhausted && unresolved == all,
            is_lawful: 2 * unresolved < all,
        })
    }
}

/// The largest of energy, the largest of covariance and its median over the views, of absolute differences by view and
/// component in units of the reference's scales. A moment that is undefined, as where an estimator saw nothing, counts as
/// off by 1: the whole of it.
fn errors(reference: &Profile, difference: impl Fn(usize, Component) -> Option<f64>) -> [f64; 3] {
    let (mut energy, mut covariances) = (0.0_f64, Vec::new());
    for (view, slice) in reference.slices.iter().enumerate() {
        let truth = &slice.moments;
        let (Some(alpha), Some([s, t])) = (truth.energy(), truth.sigma()) else {
            continue;
        };
        let off = |c, scale: f64| difference(view, c).map_or(1.0, |d| (d / scale).abs());
        energy = energy.max(off(Component::ENERGY, alpha));
        let second = Component::ALL.into_iter().filter(|c| c.order() == 2);
        let scaled = second.map(|c| off(c, s.powi(c.n as i32) * t.powi(c.m as i32)));
        covariances.push(scaled.fold(0.0, f64::max));
    }
    let covariance = covariances.iter().copied().fold(0.0, f64::max);
    [energy, covariance, median(&covariances).unwrap_or_default()]
}
