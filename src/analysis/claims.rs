//! Claims of Barla, Belcour and Pacanowski 2015 about the parametrizations, each tested.
//!
//! Most of their statements are read off pictures. Each row here is one of them in our words, with
//! what is measured, the criterion and the numbers. The pictures show slices in equal steps of the
//! coordinates, so distortions weigh nodes by [`Weight::Coordinates`] unless a row says otherwise.
//! Shares of a variance are ranked where they differ by more than a tenth of a percent.

mod figures;
mod identities;
mod materials;

use super::{Distortion, LATTICE, Scale, SliceDistortion, View, Weight};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, TestFunctionSpec};
use crate::error::listed;
use crate::geometry::{DirectionPair, Symmetry};
use crate::metrics::{Measure, MetricsSpec, test_pairs};
use crate::parametrization::{self, Parametrization};
use crate::registry::named;
use serde::Serialize;
use std::sync::Arc;

pub use materials::{on_material, on_materials};

named! {
    /// Outcome of a test of a statement.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Verdict {
        /// True in all of its cases.
        Holds = "holds",
        /// True in some of its cases.
        HoldsPartly = "holds partly",
        /// True in none of its cases.
        DoesNotHold = "does not hold",
        /// Undefined: a share of a variance, or of a norm, that is zero.
        NotDefined = "not defined",
    }
}

impl Verdict {
    /// Holds if all of the cases do, partly if some do.
    fn of(cases: &[bool]) -> Self {
        if cases.iter().all(|c| *c) {
            Verdict::Holds
        } else if cases.contains(&true) {
            Verdict::HoldsPartly
        } else {
            Verdict::DoesNotHold
        }
    }
}

/// A statement and what was measured of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// A name to cite it by.
    pub id: &'static str,
    /// Section or figure of the paper.
    pub place: &'static str,
    /// The BRDF it was measured on; `None` if it needs none but the test functions.
    pub material: Option<String>,
    /// The statement, in our words.
    pub statement: &'static str,
    /// The measured numbers, and the condition under which the statement holds.
    pub criterion: &'static str,
    /// Measured numbers: names, with their units, and values; empty if nothing is defined.
    pub numbers: Vec<(String, f64)>,
    /// The outcome.
    pub verdict: Verdict,
    /// The finding in a phrase.
    pub finding: String,
}

/// The statements: a line each with its name, its place, itself and its criterion, below their headings.
const STATEMENTS: &str = include_str!("claims/statements.tsv");

/// The claim of a name, before it is measured.
fn stated(name: &str) -> Claim {
    let claim = STATEMENTS.lines().find_map(|line| {
        let mut cells = line.split('\t');
        Some(Claim {
            id: cells.next().filter(|id| *id == name)?,
            place: cells.next()?,
            material: None,
            statement: cells.next()?,
            criterion: cells.next()?,
            numbers: Vec::new(),
            verdict: Verdict::NotDefined,
            finding: String::new(),
        })
    });
    // A constant of this module names it.
    claim.unwrap_or_else(|| unreachable!("{name} is no statement"))
}

impl Claim {
    /// The claim, measured: it holds, partly, or not, as all, some or none of the cases do.
    fn found(self, cases: &[bool], numbers: Vec<(String, f64)>, finding: String) -> Self {
        Self {
            numbers,
            verdict: Verdict::of(cases),
            finding,
            ..self
        }
    }

    /// The claim of an identity, which holds if no difference that was found is more than rounding.
    fn exact(self, largest_difference: f64) -> Self {
        let numbers = vec![("largest_difference".into(), largest_difference)];
        let finding = format!("exact: largest difference {largest_difference:.1e}");
        self.found(&[largest_difference < EXACT], numbers, finding)
    }

    /// The claim on a BRDF that leaves nothing to measure.
    fn undefined(self, why: &str) -> Self {
        let finding = why.into();
        Self { finding, ..self }
    }

    /// The claim as one that was measured on a BRDF.
    fn on(self, brdf: &str) -> Self {
        let material = Some(brdf.into());
        Self { material, ..self }
    }
}

/// Tolerance of identities that are exact on paper: square roots near the horizon keep 1e-8.
const EXACT: f64 = 1e-7;

/// Share of a function's variance on a slice from which on one axis counts as aligned with it.
const ALIGNED: f64 = 0.95;

/// Shares of a variance that differ by less are the same: a tenth of a percent is no isoline.
const DISTINCT: f64 = 1e-3;

/// True if one share is larger than others by more than [`DISTINCT`].
fn above(share: f64, others: &[f64]) -> bool {
    others.iter().all(|o| share > o + DISTINCT)
}

/// True if one share is smaller than others by more than [`DISTINCT`].
fn below(share: f64, others: &[f64]) -> bool {
    others.iter().all(|o| share < o - DISTINCT)
}

/// The charts that the paper compares.
const COMPARED: [&str; 3] = ["half-difference", "orthographic", "hybrid"];

/// A chart that the paper compares, for isotropic BRDFs: folded by every symmetry, or by none.
fn form(name: &str, folded: bool) -> Arc<dyn Parametrization> {
    let symmetry = Symmetry {
        isotropic: true,
        reciprocal: folded,
        bilateral: folded,
    };
    // A constant of this module names it.
    let entry = parametrization::find(name);
    let entry = entry.unwrap_or_else(|| unreachable!("{name} is no parametrization"));
    entry.form(symmetry)
}

/// The test functions, and pairs to try identities on.
struct Bench {
    functions: [Box<dyn Brdf>; 3],
    pairs: Vec<DirectionPair>,
}

/// Place of a test function in [`Bench::functions`].
const F: usize = 0;
const S: usize = 1;
const G: usize = 2;

impl Bench {
    fn new() -> Result<Self, BuildError> {
        let build = |spec: TestFunctionSpec| spec.build(Channels::Luminance);
        let (f, s, g) = (
            TestFunctionSpec::F,
            TestFunctionSpec::S,
            TestFunctionSpec::G,
        );
        let spec = MetricsSpec {
            pairs: 20_000,
            mask_deg: 90.0,
            ..MetricsSpec::default()
        };
        Ok(Self {
            functions: [build(f)?, build(s)?, build(g)?],
            pairs: test_pairs(Measure::Cosine, &spec)?,
        })
    }

    fn distortion(&self, function: usize, chart: &str) -> Distortion {
        let form = form(chart, true);
        let brdf = &*self.functions[function];
        View::new(brdf, Scale::Value, &*form, Weight::Coordinates).distortion()
    }
}

/// The claims that need no data: on identities, and on the functions F, S and G.
///
/// # Errors
/// None, but those that building the test functions could have.
pub fn on_test_functions() -> Result<Vec<Claim>, BuildError> {
    let bench = Bench::new()?;
    let mut claims = figures::claims(&bench);
    claims.extend(identities::claims(&bench));
    Ok(claims)
}

/// Reason why shares of a variance are not defined.
const CONSTANT: &str = "the BRDF is constant, so that there is no variance to have a share of";

/// Share that one axis explains on each slice; `None` if the function is constant on one.
fn on_slices(distortion: &Distortion, axis: usize) -> Option<Vec<f64>> {
    let slices = distortion.slices.iter();
    slices.map(|s| s.shares.map(|s| s.axis[axis])).collect()
}

/// Share of the variance that changes with the azimuth; `None` if there is no variance.
fn changes(distortion: &Distortion) -> Option<f64> {
    distortion.shares.map(|s| 1.0 - s.both)
}

/// The value of `of` for each chart; `None` if it is undefined for one.
fn of_charts<T>(found: &[Distortion; 3], of: impl Fn(&Distortion) -> Option<T>) -> Option<[T; 3]> {
    let [a, b, c] = found;
    Some([of(a)?, of(b)?, of(c)?])
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Numbers of each slice, named after it.
fn per_slice(name: &str, distortion: &Distortion, values: &[f64]) -> Vec<(String, f64)> {
    let key = |slice: &SliceDistortion| format!("{name}_{:.0}deg", slice.phi.to_degrees());
    let keys = distortion.slices.iter().map(key);
    keys.zip(values.iter().copied()).collect()
}

/// Numbers of each chart the paper compares, named after it.
fn per_chart(name: &str, values: [f64; 3]) -> Vec<(String, f64)> {
    let keys = COMPARED.map(|chart| format!("{name}_{chart}"));
    keys.into_iter().zip(values).collect()
}

/// The middles of 64 × 64 equal cells of a unit square.
fn lattice() -> impl Iterator<Item = [f64; 2]> {
    let nodes = (0..LATTICE).flat_map(|i| (0..LATTICE).map(move |j| [i, j]));
    nodes.map(|node| node.map(|i| (i as f64 + 0.5) / LATTICE as f64))
}

/// Several percentages, e.g. of the charts that the paper compares.
fn percentages(shares: &[f64]) -> String {
    listed(shares.iter().map(|share| percent(*share)))
}

/// "12.3 %".
fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}
