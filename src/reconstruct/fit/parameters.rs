//! The free numbers of a model, each on a scale without ends.
//!
//! A number x between ends that the model allows is w = ln x where it is positive and may not be negative, else x itself,
//! and w = a + (b − a) / (1 + e^(−t)). So no step leaves what is allowed, and no clamp hides a slope from the search. The
//! ends are found by asking the model: it refuses what is outside.

use crate::brdf::{self, Brdf, BrdfSpec, Channels};
use crate::error::{ParameterError, listed};
use crate::geometry::Symmetry;
use crate::numeric::last_where;
use crate::registry::{self, Keys};
use nalgebra::DVector;

/// Largest factor between a number and one that is tried, on a logarithmic scale; of a scale that is straight the
/// largest multiple.
const REACH: f64 = 1e6;

/// Smallest distance of a number from the ends of its scale, as a share of it: what is at an end starts beside it.
const MARGIN: f64 = 1e-3;

/// Half-width of what other starts are drawn from: a factor of 30, and as many times a number on a straight scale.
const SPREAD: f64 = 3.4;

/// A model with free numbers.
pub(super) struct Parameters {
    keys: Keys,
    /// The free numbers.
    pub free: Vec<Parameter>,
}

/// A free number.
pub(super) struct Parameter {
    /// Its place in the table of the model: `alpha`, `component[0].weight`.
    pub name: String,
    /// Its number among all of them.
    at: usize,
    /// Where the search starts.
    start: f64,
    logarithmic: bool,
    /// The ends of w.
    ends: [f64; 2],
}

impl Parameter {
    fn scaled(&self, x: f64) -> f64 {
        if self.logarithmic { x.ln() } else { x }
    }

    /// t of w.
    fn place(&self, w: f64) -> f64 {
        let [a, b] = self.ends;
        let share = ((w - a) / (b - a)).clamp(MARGIN, 1.0 - MARGIN);
        (share / (1.0 - share)).ln()
    }

    /// x at t, and dx/dt.
    pub(crate) fn value(&self, t: f64) -> [f64; 2] {
        let [a, b] = self.ends;
        let share = 1.0 / (1.0 + (-t).exp());
        let (w, slope) = (a + (b - a) * share, (b - a) * share * (1.0 - share));
        match self.logarithmic {
            true => [w.exp(), w.exp() * slope],
            false => [w, slope],
        }
    }
}

impl Parameters {
    /// The numbers of a model but the `fixed` ones.
    ///
    /// # Errors
    /// If the model is none of luminance, if there is no such number, and if none is left.
    pub(crate) fn new(model: &dyn BrdfSpec, fixed: &[String]) -> Result<Self, ParameterError> {
        let refused = |e: &dyn std::fmt::Display| {
            let allowed = format!("an analytic material ({e})");
            ParameterError::new("model", model.label(), allowed)
        };
        model.check(&Channels::Luminance).map_err(|e| refused(&e))?;
        let keys = model.resolved();
        let mut numbers = Vec::new();
        registry::each_number(&mut keys.clone(), &mut |place, x| {
            numbers.push((place.to_owned(), *x));
        });
        let names = || numbers.iter().map(|(name, _)| name.as_str());
        if let Some(other) = fixed.iter().find(|f| names().all(|name| name != **f)) {
            return Err(ParameterError::new("fixed", other, listed(names())));
        }
        let mut free = Vec::new();
        for (at, (name, start)) in numbers.iter().enumerate() {
            if fixed.contains(name) {
                continue;
            }
            let allowed = |x: f64| with(&keys, &[(at, x)]).is_some();
            let [low, high] = [-1.0, 1.0].map(|sign| end(*start, sign, &allowed));
            let logarithmic = low >= 0.0 && *start > 0.0;
            let ends = match logarithmic {
                true => [low.max(start / REACH).ln(), high.min(start * REACH).ln()],
                false => [low, high],
            };
            if ends[0] < ends[1] {
                free.push(Parameter {
                    name: name.clone(),
                    at,
                    start: *start,
                    logarithmic,
                    ends,
                });
            }
        }
        if free.is_empty() {
            let allowed = "a material with a number that is free";
            return Err(ParameterError::new("model", model.label(), allowed));
        }
        Ok(Self { keys, free })
    }

    /// Where the model is.
    pub(crate) fn start(&self) -> DVector<f64> {
        let places = self.free.iter().map(|p| p.place(p.scaled(p.start)));
        DVector::from_iterator(self.free.len(), places)
    }

    /// Another place, from uniform numbers in [0, 1).
    pub(crate) fn around(&self, mut uniform: impl FnMut() -> f64) -> DVector<f64> {
        let places = self.free.iter().map(|p| {
            let width = match p.logarithmic {
                true => SPREAD,
                false => SPREAD.exp() * p.start.abs().max(0.1),
            };
            p.place(p.scaled(p.start) + width * (2.0 * uniform() - 1.0))
        });
        DVector::from_iterator(self.free.len(), places.collect::<Vec<_>>())
    }

    /// The model at a place; `None` where its numbers do not go together.
    pub(crate) fn model(&self, place: &DVector<f64>) -> Option<Box<dyn Brdf>> {
        let numbers = self.free.iter().zip(place.iter());
        let numbers: Vec<_> = numbers.map(|(p, &t)| (p.at, p.value(t)[0])).collect();
        with(&self.keys, &numbers)?.build(Channels::Luminance).ok()
    }

    /// A symmetry that the model lacks somewhere; `None` if it has all that are needed.
    pub(crate) fn lacks(&self, needed: Symmetry) -> Option<&'static str> {
        // Numbers that happen to be equal are no symmetry.
        let mut next = 0.0;
        let elsewhere = self.around(|| {
            next = (next + 0.618_f64).fract();
            next
        });
        let models = [self.start(), elsewhere]
            .into_iter()
            .filter_map(|at| self.model(&at));
        let has = models.fold(needed, |all, model| all.and(model.symmetry()));
        [
            (needed.isotropic && !has.isotropic, "isotropic"),
            (needed.reciprocal && !has.reciprocal, "reciprocal"),
            (needed.bilateral && !has.bilateral, "mirror-symmetric"),
        ]
        .into_iter()
        .find_map(|(lacks, name)| lacks.then_some(name))
    }
}

/// The model with other numbers; `None` if it refuses them.
fn with(keys: &Keys, numbers: &[(usize, f64)]) -> Option<Box<dyn BrdfSpec>> {
    let mut keys = keys.clone();
    let mut at = 0;
    registry::each_number(&mut keys, &mut |_, x| {
        if let Some((_, new)) = numbers.iter().find(|(place, _)| *place == at) {
            *x = *new;
        }
        at += 1;
    });
    let spec = brdf::read_keys(keys).ok()?;
    spec.check(&Channels::Luminance).ok()?;
    Some(spec)
}

/// The last number that is allowed from `start` on, downwards or upwards (`sign`).
fn end(start: f64, sign: f64, allowed: &dyn Fn(f64) -> bool) -> f64 {
    let size = start.abs().max(1e-3);
    let mut inside = start;
    let mut outside = None;
    for k in -3..=6 {
        let x = start + sign * size * 10_f64.powi(k);
        if !allowed(x) {
            outside = Some(x);
            break;
        }
        inside = x;
    }
    outside.map_or(inside, |outside| last_where(inside, outside, 60, allowed))
}
