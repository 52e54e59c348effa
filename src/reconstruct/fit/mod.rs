//! Fits: the reconstruction is a BRDF of the registry whose numbers suit the readings best.
//!
//! Every number in the table of the model is free but those that are `fixed`: amplitudes, roughnesses, indices, of a
//! sum its weights. Least squares of ln(f + ε) over the readings find them, from several starts, each number on a
//! scale between the ends that the model allows ([`parameters`]). A reading counts by its uncertainty of type A and
//! the [`MISFIT`] m together, so that standard errors are too large where the model suits better than that: of readings of the model
//! itself with a relative noise u by √(1 + (m/u)²), 1.2 at 3 %. The result holds the parameters with their standard errors, and names those that the readings
//! do not determine.

mod parameters;
mod solver;

use super::interpolant::{Interpolant, Readings};
use super::transform::{EPSILON, LOG};
use super::{Reconstruct, ReconstructError, admit};
use crate::brdf::microfacet::{FresnelSpec, Ggx, MicrofacetSpec};
use crate::brdf::{
    self, Brdf, BrdfSpec, ComponentSpec, LambertSpec, Presence, Roughness, Spectrum, SumSpec,
};
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use crate::registry::{self, Entry, ReadError, Resolved, Table};
use parameters::Parameters;
use serde::Deserialize;
use solver::Problem;

const KIND: &str = "fit";

/// The registry entry.
pub(super) const ENTRY: Entry<dyn Reconstruct> = Entry {
    kind: KIND,
    summary: "an analytic BRDF, or a sum of some, whose numbers are fitted to the readings",
    examples: &[
        "",
        "model = { kind = \"ggx\", alpha = 0.2 }",
        "model = { kind = \"ward\" }\nstarts = 4",
        "model = { kind = \"oren-nayar\" }\nfixed = [\"sigma_deg\"]",
    ],
    read,
};

/// The share of f that a model is not trusted to.
const MISFIT: f64 = 0.02;

/// Most starts of a search.
const MOST: usize = 1000;

/// A fit, as a config writes it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fit {
    /// The model; its numbers are where the search starts. `None`: Lambert's law plus a lobe of GGX.
    #[serde(deserialize_with = "registry::taken")]
    pub model: Option<Box<dyn BrdfSpec>>,
    /// Numbers of the model that stay as they are: `alpha`, `component[0].weight`.
    pub fixed: Vec<String>,
    /// Starts of the search, [1, 1000]: the numbers of the model, and others around them.
    pub starts: usize,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            model: None,
            fixed: Vec::new(),
            starts: 8,
        }
    }
}

fn read(mut table: Table<'_>) -> Result<Box<dyn Reconstruct>, ReadError> {
    let model = registry::take_table(&mut table, "model")?;
    let keys: Fit = registry::parse(table)?;
    Ok(Box::new(Fit {
        model: model.map(brdf::read).transpose()?,
        ..keys
    }))
}

/// The usual model: Lambert's law and a lobe of GGX without a Fresnel factor.
fn usual() -> SumSpec {
    let albedo = Spectrum::Grey(0.2);
    let lobe = MicrofacetSpec::<Ggx>::new(Roughness::Isotropic(0.2), FresnelSpec::None);
    let part = |weight, brdf: Box<dyn BrdfSpec>| ComponentSpec { weight, brdf };
    let diffuse = part(1.0, Box::new(LambertSpec { albedo }));
    SumSpec {
        component: vec![diffuse, part(0.3, Box::new(lobe))],
    }
}

/// The number of [`usual`] that stays: it is one with the albedo.
const USUALLY_FIXED: &str = "component[0].weight";

impl Fit {
    /// The free numbers of the model, if all keys are allowed.
    fn parameters(&self) -> Result<Parameters, ParameterError> {
        if !(1..=MOST).contains(&self.starts) {
            let allowed = format!("a whole number in [1, {MOST}]");
            return Err(ParameterError::new("starts", self.starts, allowed));
        }
        match &self.model {
            Some(model) => Parameters::new(&**model, &self.fixed),
            None => {
                let fixed = [&[USUALLY_FIXED.to_owned()], self.fixed.as_slice()].concat();
                Parameters::new(&usual(), &fixed)
            }
        }
    }
}

impl Resolved for Fit {
    fn resolved(&self) -> registry::Keys {
        let mut table = registry::Keys::new();
        table.insert("kind".into(), KIND.into());
        if let Some(model) = &self.model {
            table.insert("model".into(), model.resolved().into());
        }
        table.insert("fixed".into(), self.fixed.clone().into());
        table.insert("starts".into(), (self.starts as u32).into());
        table
    }
}

impl Reconstruct for Fit {
    fn label(&self) -> String {
        match &self.model {
            Some(model) => format!("{KIND}[{}]", model.label()),
            None => KIND.into(),
        }
    }

    fn weighs_readings(&self) -> bool {
        true
    }

    // A search from each start.
    fn fit_seconds(&self, readings: usize) -> f64 {
        self.starts as f64 * (1e-3 + 3e-6 * readings as f64)
    }

    fn takes_those_of_schedules(&self) -> bool {
        false
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.parameters().map(drop)
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        let parameters = self.parameters()?;
        admit(KIND, r.count(), usize::MAX)?;
        let needed = r.schedule.parametrization.symmetry();
        if let Some(lacks) = parameters.lacks(needed) {
            let allowed = format!("one that is {lacks}, as the readings are");
            return Err(ParameterError::new("model", self.label(), allowed).into());
        }
        let poses = r.schedule.poses.iter().zip(r.present);
        let pairs: Vec<DirectionPair> = poses.filter(|(_, p)| **p).map(|(p, _)| p.pair).collect();
        let mut fitted = Fitted::default();
        for c in 0..r.width {
            let of = (0..r.present.len()).filter(|&i| r.present[i]);
            let (mut logs, mut weights) = (Vec::new(), Vec::new());
            for i in of {
                let f = r.values[i * r.width + c].max(0.0);
                let noise = r.noise.map_or(0.0, |u| u[i * r.width + c]) / (f + EPSILON);
                logs.push(LOG.forward(f));
                weights.push(1.0 / noise.hypot(MISFIT));
            }
            let problem = Problem::new(&parameters, &pairs, &logs, &weights);
            let found = problem.solve(self.starts);
            let several = (r.width > 1).then_some(c + 1);
            fitted.remarks.extend(found.remarks(&parameters, several));
            // The search never leaves what the model allows.
            fitted.models.extend(parameters.model(&found.place));
        }
        Ok(Box::new(fitted))
    }
}

/// A model for each value.
#[derive(Default)]
struct Fitted {
    models: Vec<Box<dyn Brdf>>,
    remarks: Vec<String>,
}

impl Interpolant for Fitted {
    fn width(&self) -> usize {
        self.models.len()
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        for (c, model) in self.models.iter().enumerate() {
            let (values, presence) = model.values(pairs);
            let rows = out.chunks_exact_mut(self.models.len());
            for ((out, value), presence) in rows.zip(&values).zip(&presence) {
                out[c] = match presence {
                    Presence::Present => *value,
                    Presence::Missing => 0.0,
                };
            }
        }
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}
