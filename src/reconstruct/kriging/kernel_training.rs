//! Constants of kernels that suit many materials.

use super::LOG;
use super::fit::minimise;
use super::kernel::Kernel;
use super::prior::TrainError;
use super::space::{self, Space};
use super::system::{Data, MEAN, NUGGET, Sites};
use super::trained::{DEFAULT, Kernels, start};
use crate::brdf::{Brdf, Presence};
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::{self, WarpSpec, Warps, usual_form};
use crate::reconstruct::Coordinates;
use crate::sampling::{Random, cosine_hemisphere};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Numbers of pairs at which materials are looked at together, several times each.
const LISTS: [(usize, usize); 2] = [(64, 4), (256, 2)];

/// Elevation, degrees, beyond which no material is looked at: tables are extrapolated there.
const MASK_DEG: f64 = 80.0;

/// Width of the normal prior of the logarithms of constants about those of the start.
const WIDTH: f64 = 3.0;

/// Steps of a search.
const STEPS: usize = 300;

/// A search ends where a step lowers −ln(posterior) of a material by less.
const ENOUGH: f64 = 1e-4;

/// Decimals of the logarithms of constants.
const DECIMALS: f64 = 1e3;

/// Materials to which kernels are to be fitted.
pub struct KernelTraining {
    /// Lists of pairs: of each list half lie evenly in half/difference coordinates with a square root along θ_h, half under the cosine
    /// measure of both directions.
    lists: Vec<Vec<DirectionPair>>,
    names: Vec<String>,
    /// ln(f + ε) of the luminance, material after material, of all lists.
    values: Vec<Vec<f64>>,
}

impl Default for KernelTraining {
    fn default() -> Self {
        let form = usual_form(Symmetry::FULL);
        let random = Random::new(SEED);
        let mut points = (0..).map(|i| random.point::<4>(i));
        let mut list = |n: usize| {
            let mut pairs = Vec::new();
            while pairs.len() < n {
                let Some(u) = points.next() else { break };
                let pair = if pairs.len() % 2 == 0 {
                    let coords = std::array::from_fn(|d| {
                        let axis = form.axes().get(d);
                        axis.map_or(0.0, |axis| axis.range[0] + u[d] * axis.length())
                    });
                    form.inverse(&coords)
                } else {
                    let [i, o] = [[u[0], u[1]], [u[2], u[3]]].map(cosine_hemisphere);
                    Some(DirectionPair::new(i, o))
                };
                let mask = MASK_DEG.to_radians().cos();
                let inside = |p: &DirectionPair| p.least_cosine() > mask;
                pairs.extend(pair.filter(inside));
            }
            pairs
        };
        let sizes = LISTS
            .iter()
            .flat_map(|&(n, times)| std::iter::repeat_n(n, times));
        Self {
            lists: sizes.map(&mut list).collect(),
            names: Vec::new(),
            values: Vec::new(),
        }
    }
}

/// A seed that no user can give.
const SEED: u64 = u64::MAX - 2;

impl KernelTraining {
    /// Adds a material.
    ///
    /// # Errors
    /// If it is of another symmetry, or has no value somewhere.
    pub fn add(&mut self, name: &str, brdf: &dyn Brdf) -> Result<(), TrainError> {
        if brdf.symmetry() != Symmetry::FULL {
            return Err(TrainError::Symmetry { name: name.into() });
        }
        let pairs = self.lists.concat();
        let (values, presence) = brdf.values(&pairs);
        if presence.contains(&Presence::Missing) {
            return Err(TrainError::Hole { name: name.into() });
        }
        let channels = brdf.channels();
        let values = values.chunks(channels.count());
        let luminance = values.map(|f| channels.luminance(f));
        self.values
            .push(luminance.map(|f| LOG.forward(f)).collect());
        self.names.push(name.into());
        Ok(())
    }

    /// The kernels that make all materials most likely, of each parametrization with each of some warps, and without a choice of
    /// coordinates. `doing` gets the label of each before it.
    ///
    /// # Errors
    /// If there are fewer than two materials.
    pub fn kernels(
        self,
        command: String,
        mut doing: impl FnMut(&str),
    ) -> Result<Kernels, TrainError> {
        if self.names.len() < 2 {
            return Err(TrainError::TooFew(self.names.len()));
        }
        let mut constants = BTreeMap::new();
        doing(DEFAULT);
        let usual = Space::usual(Symmetry::FULL);
        constants.insert(
            DEFAULT.to_owned(),
            self.fitted(&usual, &Kernel::new(Symmetry::FULL)),
        );
        for coordinates in coordinates() {
            let label = coordinates.label();
            doing(&label);
            let form = coordinates.form(Symmetry::FULL);
            let (Ok(form), Ok(space)) = (form, Space::new(Symmetry::FULL, Some(&coordinates)))
            else {
                continue;
            };
            let from = space::kernel(&*form, &start());
            constants.insert(label, self.fitted(&space, &from));
        }
        Ok(Kernels {
            command,
            materials: self.names,
            blake3: Kernels::hash(&constants),
            constants,
        })
    }

    /// The values of all lists, in a space.
    fn data(&self, space: &Space) -> Vec<Data> {
        let mut before = 0;
        let data = self.lists.iter().map(|pairs| {
            let first = before;
            before += pairs.len();
            let value = |i: usize, c: usize| self.values[c][first + i] - MEAN;
            Data {
                sites: Sites::new(pairs, space, None),
                noise: vec![NUGGET; pairs.len()],
                values: DMatrix::from_fn(pairs.len(), self.names.len(), value),
            }
        });
        data.collect()
    }

    /// The logarithms of the constants of the likeliest kernel in a space.
    fn fitted(&self, space: &Space, from: &Kernel) -> Vec<f64> {
        let data = self.data(space);
        let start = DVector::from_vec(from.logs());
        let n = start.len();
        let inverse = DMatrix::from_diagonal_element(n, n, 0.01);
        let loss = |x: &DVector<f64>| loss(&data, from, x);
        let found = minimise(start.clone(), inverse, STEPS, ENOUGH, loss).unwrap_or(start);
        found
            .iter()
            .map(|x| (x * DECIMALS).round() / DECIMALS)
            .collect()
    }
}

/// −ln of the posterior of constants whose logarithms are `x`, about those of `from`, and its derivatives.
fn loss(data: &[Data], from: &Kernel, x: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
    let kernel = from.with_logs(x.as_slice());
    let off = (x - DVector::from_vec(from.logs())) / WIDTH;
    let (mut value, mut slope) = (0.5 * off.norm_squared(), off / WIDTH);
    for data in data {
        let found = data.likelihood(&kernel)?;
        value += found.loss;
        slope += DVector::from_vec(found.by_logs);
    }
    Some((value, slope))
}

/// Coordinates for which constants are fitted: each parametrization plain, and with a square root or an inverse hyperbolic sine
/// along the first radial axis (of a parametrization that exchange exchanges both), each without and with an arcsine along the second.
fn coordinates() -> Vec<Coordinates> {
    let firsts = [
        None,
        Some(WarpSpec::SquareRoot),
        Some(WarpSpec::Asinh { scale: 0.01 }),
    ];
    let mut all = Vec::new();
    for entry in parametrization::all() {
        let form = entry.form(Symmetry::FULL);
        let [first, second, ..] = form.axes() else {
            continue;
        };
        for along in firsts {
            for arcsine in [false, true] {
                let mut warp = Warps::new();
                warp.extend(along.map(|w| (first.symbol.to_owned(), w)));
                let other = if form.facts().exchange {
                    along
                } else {
                    arcsine.then_some(WarpSpec::Arcsine)
                };
                warp.extend(other.map(|w| (second.symbol.to_owned(), w)));
                let exists = entry.warped(Symmetry::FULL, &warp).is_ok();
                let coordinates = Coordinates {
                    kind: entry.kind.to_owned(),
                    warp,
                };
                if exists && !all.contains(&coordinates) {
                    all.push(coordinates);
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Channels, all};
    use crate::registry::read_text;

    #[test]
    fn fitted_constants_are_the_likeliest() {
        let mut training = KernelTraining::default();
        training.lists.truncate(1);
        for (kind, keys) in [("ggx", "alpha = 0.2"), ("oren-nayar", "sigma_deg = 30.0")] {
            let entry = all().into_iter().find(|entry| entry.kind == kind).unwrap();
            let spec = read_text(&entry, keys).unwrap();
            let brdf = spec.build(Channels::Luminance).unwrap();
            training.add(kind, &*brdf).unwrap();
        }
        let chosen = coordinates();
        let chosen = chosen.iter().find(|c| c.kind == "hybrid").unwrap();
        let form = chosen.form(Symmetry::FULL).unwrap();
        let space = Space::new(Symmetry::FULL, Some(chosen)).unwrap();
        let from = space::kernel(&*form, &start());
        let fitted = training.fitted(&space, &from);
        assert_eq!(fitted, training.fitted(&space, &from));
        let data = training.data(&space);
        let loss = |x: &[f64]| {
            loss(&data, &from, &DVector::from_column_slice(x))
                .unwrap()
                .0
        };
        let least = loss(&fitted);
        assert!(least < loss(&from.logs()) - 1.0);
        for i in 0..fitted.len() {
            for step in [-0.3, 0.3] {
                let mut moved = fitted.clone();
                moved[i] += step;
                // The search ends where a step gains less than `ENOUGH` of a material.
                assert!(loss(&moved) > least - 1e-2, "constant {i} by {step}");
            }
        }
    }
}
