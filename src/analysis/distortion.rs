//! Distortion: distance of the isolines of a BRDF from the axes of a parametrization (Barla et al.
//! 2015, Figs. 2-5, as numbers).
//!
//! On a slice of fixed azimuth the first two axes span a plane. If isolines run along an axis, the
//! function depends on the other axis alone: that one explains all of its variance, and all of the
//! energy of its gradient lies along it. Both shares are invariant under a change of units, and
//! the share of the variance, but for how nodes are weighed, also under warps of the axes.

use super::{Cell, Scale, Shares};
use crate::brdf::Brdf;
use crate::geometry::DirectionPair;
use crate::metrics::{self, Values};
use crate::numeric::GRAZING_COS;
use crate::parametrization::{Axis, AxisKind, Coords, Parametrization};
use crate::registry::named;
use crate::sampling::Sobol;

/// Nodes along each of the first two axes, in the middle of equal cells.
pub const LATTICE: usize = 64;

/// Cells along the azimuth, for numbers about all slices together.
pub const PHI_CELLS: usize = 16;

/// Slices of fixed azimuth.
const SLICES: usize = 4;

named! {
    /// Weight of a node of the lattice.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Weight {
        /// 1 for each, as in a picture of the slice or a grid of measurements.
        Coordinates = "coordinates",
        /// The Jacobian: the steradians² it stands for, the same set of pairs whatever the
        /// parametrization.
        SolidAngle = "solid-angle",
    }
}

/// Distortion on a slice of fixed azimuth.
#[derive(Clone, Debug, PartialEq)]
pub struct SliceDistortion {
    /// The third coordinate (rad).
    pub phi: f64,
    /// Share of the lattice that is above the horizon and has data.
    pub physical: f64,
    /// Shares of the variance; `None` if the function is constant on this slice.
    pub shares: Option<Shares>,
    /// Mean squared deviation from the average over all azimuths at the same place, in units of
    /// the variance over all azimuths: how far this slice is from the typical one. `None` if the
    /// function is constant.
    pub deviation: Option<f64>,
}

/// Distortion of a BRDF in a parametrization.
#[derive(Clone, Debug, PartialEq)]
pub struct Distortion {
    /// Slices at [`slice_angles`].
    pub slices: Vec<SliceDistortion>,
    /// Share of the 3-D lattice that is above the horizon and has data.
    pub physical: f64,
    /// Shares of the variance over all azimuths, by functions that are the same on every slice:
    /// 1 − `both` is the share that changes with the azimuth. `None` if the function is constant.
    pub shares: Option<Shares>,
}

/// Energy of the gradient: the weighted mean of the squared derivative along each axis, each axis of length 1, by several sets of points.
///
/// It is that of pairs whose directions are both up to 80° from the normal. Along an axis that is a sine the derivative of a cosine grows
/// as its inverse towards the horizon, and the integral of its square as the logarithm of where it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient<const N: usize>(Vec<[f64; N]>);

/// Energies of the gradient of a BRDF in a parametrization.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradients {
    /// Along the first two axes, on slices at [`slice_angles`].
    pub slices: [Gradient<2>; SLICES],
    /// Along all three, over all azimuths.
    pub all: Gradient<3>,
}

/// Sets of points by which a gradient is known; their scatter is its error.
const SETS: u64 = 16;

/// Points of a set: at first, and at most.
const POINTS: [u64; 2] = [256, 1 << 14];

/// Standard error of a share from which on no more points are taken.
const ENOUGH: f64 = 0.003;

/// The cosine of 80°, down to which directions count.
const LOWEST: f64 = 0.173_648_177_666_930_33;

/// Step of a derivative to either side, as a share of the axis: far below any lobe, and far above rounding.
const STEP: f64 = 1e-5;

impl<const N: usize> Gradient<N> {
    /// The energy along each axis.
    pub fn energy(&self) -> [f64; N] {
        Self::mean(self.0.iter())
    }

    /// Share of the energy that lies along each axis, with its standard error (jackknife over sets); `None` if there is none.
    pub fn shares(&self) -> Option<[(f64, f64); N]> {
        let of = |energy: [f64; N]| {
            let total: f64 = energy.iter().sum();
            (total > 0.0).then(|| energy.map(|e| e / total))
        };
        let all = of(self.energy())?;
        let mut squares = [0.0; N];
        for left in 0..self.0.len() {
            let others = self.0.iter().enumerate().filter(|(set, _)| *set != left);
            let others = of(Self::mean(others.map(|(_, energy)| energy)))?;
            for (square, (a, b)) in squares.iter_mut().zip(others.into_iter().zip(all)) {
                *square += (a - b) * (a - b);
            }
        }
        let n = self.0.len() as f64;
        Some(std::array::from_fn(|axis| {
            (all[axis], (squares[axis] * (n - 1.0) / n).sqrt())
        }))
    }

    fn mean<'a>(sets: impl Iterator<Item = &'a [f64; N]>) -> [f64; N] {
        let (mut sum, mut count) = ([0.0; N], 0.0_f64);
        for energy in sets {
            for (sum, e) in sum.iter_mut().zip(energy) {
                *sum += e;
            }
            count += 1.0;
        }
        sum.map(|s| s / count.max(1.0))
    }
}

/// Where the slices are: four from end to end of an axis, 0°, 30°, 60°, 90° of a half-vector chart
/// and 0°, 60°, 120°, 180° of the spherical one; of a periodic axis the starts of equal quarters.
pub fn slice_angles(axis: &Axis) -> [f64; SLICES] {
    let steps = match axis.kind {
        AxisKind::Mirrored | AxisKind::Straight => SLICES - 1,
        AxisKind::Periodic | AxisKind::Radial => SLICES,
    };
    std::array::from_fn(|i| axis.range[0] + axis.length() * i as f64 / steps as f64)
}

/// A BRDF, in luminance and on a scale, in the 3-D form of a parametrization. An anisotropic BRDF is seen with its half
/// vector (spherical: its view) at azimuth 0.
#[derive(Clone, Copy)]
pub struct View<'a> {
    brdf: &'a dyn Brdf,
    scale: Scale,
    form: &'a dyn Parametrization,
    weight: Weight,
    window: [[f64; 2]; 2],
}

impl<'a> View<'a> {
    /// A BRDF on the whole plane of the first two axes.
    ///
    /// # Panics
    /// If `form` has four axes.
    pub fn new(
        brdf: &'a dyn Brdf,
        scale: Scale,
        form: &'a dyn Parametrization,
        weight: Weight,
    ) -> Self {
        let axes = form.axes().len();
        assert_eq!(axes, 3, "slices are those of an isotropic form");
        Self {
            brdf,
            scale,
            form,
            weight,
            window: [[0.0, 1.0]; 2],
        }
    }

    /// This view on a part of its plane: start and end along each axis, as shares of the axis.
    #[must_use]
    pub fn within(self, window: [[f64; 2]; 2]) -> Self {
        Self { window, ..self }
    }

    /// Measures the distortion.
    pub fn distortion(&self) -> Distortion {
        let azimuth = &self.form.axes()[2];
        let cell =
            |i: usize| azimuth.range[0] + azimuth.length() * (i as f64 + 0.5) / PHI_CELLS as f64;
        let block = self.nodes(&std::array::from_fn::<_, PHI_CELLS, _>(cell));
        let (typical, variance) = (block.typical(), block.variance());
        let slices = slice_angles(azimuth).into_iter().map(|phi| {
            let plane = self.nodes(&[phi]);
            SliceDistortion {
                phi,
                physical: plane.physical(),
                shares: plane.shares(),
                deviation: variance.map(|v| plane.deviation(&typical) / v),
            }
        });
        Distortion {
            slices: slices.collect(),
            physical: block.physical(),
            shares: block.shares(),
        }
    }

    /// The energies of the gradient where [`distortion`](Self::distortion) measures shares of the variance, which takes less time.
    /// Derivatives are those per whole axis.
    pub fn gradients(&self) -> Gradients {
        Gradients {
            slices: slice_angles(&self.form.axes()[2]).map(|phi| self.gradient(Some(phi))),
            all: self.gradient(None),
        }
    }

    fn weight(&self, coords: &Coords) -> f64 {
        match self.weight {
            Weight::Coordinates => 1.0,
            Weight::SolidAngle => self.form.jacobian(coords),
        }
    }

    /// The nodes of the slices at these azimuths.
    fn nodes(&self, azimuths: &[f64]) -> Block {
        let axes = self.form.axes();
        let at = |axis: usize, i: usize| {
            let [start, end] = self.window[axis];
            let share = start + (end - start) * (i as f64 + 0.5) / LATTICE as f64;
            axes[axis].range[0] + axes[axis].length() * share
        };
        let mut places = Vec::new();
        let mut pairs: Vec<DirectionPair> = Vec::new();
        for (slice, &phi) in azimuths.iter().enumerate() {
            for i in 0..LATTICE {
                for j in 0..LATTICE {
                    let coords: Coords = [at(0, i), at(1, j), phi, 0.0];
                    let weight = self.weight(&coords);
                    // On the horizon itself a BRDF is 0 by convention, which is no isoline.
                    if let Some(pair) = self.form.inverse(&coords)
                        && pair.least_cosine() > GRAZING_COS
                        && weight.is_finite()
                    {
                        places.push(((slice * LATTICE + i) * LATTICE + j, weight));
                        pairs.push(pair);
                    }
                }
            }
        }
        let values: Values = metrics::evaluate(self.brdf, &pairs);
        let mut nodes = vec![None; azimuths.len() * LATTICE * LATTICE];
        for (index, (place, weight)) in places.into_iter().enumerate() {
            nodes[place] = values.get(index).map(|f| (weight, self.scale.apply(f)));
        }
        Block { nodes }
    }

    /// The energy of the gradient along the first `N` axes, on the slice of an azimuth or over all.
    fn gradient<const N: usize>(&self, azimuth: Option<f64>) -> Gradient<N> {
        let mut points = POINTS[0];
        loop {
            let sets = (0..SETS).map(|set| self.energies(azimuth, set, points));
            let found = Gradient(sets.collect());
            let shares = found.shares();
            let is_known = shares.is_none_or(|all| all.iter().all(|(_, error)| *error <= ENOUGH));
            if is_known || points >= POINTS[1] {
                return found;
            }
            points *= 4;
        }
    }

    /// Mean squared central differences at a set of points.
    fn energies<const N: usize>(&self, azimuth: Option<f64>, set: u64, points: u64) -> [f64; N] {
        let axes = self.form.axes();
        let mut sobol = Sobol::new(set);
        let is_above = |pair: &DirectionPair| pair.least_cosine() > LOWEST;
        let (mut weights, mut pairs) = (Vec::new(), Vec::new());
        for point in 0..points {
            let u: [f64; 3] = sobol.point(point);
            let at = |axis: usize| {
                let [start, end] = self.window.get(axis).copied().unwrap_or([0.0, 1.0]);
                axes[axis].range[0] + axes[axis].length() * (start + (end - start) * u[axis])
            };
            let coords: Coords = [at(0), at(1), azimuth.unwrap_or_else(|| at(2)), 0.0];
            let weight = self.weight(&coords);
            let around: Option<Vec<DirectionPair>> = (0..2 * N)
                .map(|side| {
                    let mut coords = coords;
                    let step = STEP * axes[side / 2].length();
                    coords[side / 2] += if side % 2 == 0 { -step } else { step };
                    self.form.inverse(&coords).filter(is_above)
                })
                .collect();
            if let Some(around) = around.filter(|_| weight.is_finite()) {
                weights.push(weight);
                pairs.extend(around);
            }
        }
        let values = metrics::evaluate(self.brdf, &pairs);
        let (mut energy, mut total) = ([0.0; N], 0.0);
        for (point, weight) in weights.into_iter().enumerate() {
            let value = |side| Some(self.scale.apply(values.get(2 * N * point + side)?));
            let slope = |axis| Some((value(2 * axis + 1)? - value(2 * axis)?) / (2.0 * STEP));
            if let Some(slopes) = (0..N).map(slope).collect::<Option<Vec<f64>>>() {
                for (energy, slope) in energy.iter_mut().zip(slopes) {
                    *energy += weight * slope * slope;
                }
                total += weight;
            }
        }
        energy.map(|e| if total > 0.0 { e / total } else { 0.0 })
    }
}

/// Weight and value of every node that has one, slice after slice.
struct Block {
    nodes: Vec<Option<(f64, f64)>>,
}

impl Block {
    /// The average of all slices at each place.
    fn typical(&self) -> Vec<Option<f64>> {
        let place = |place: usize| {
            let slices = self.nodes.iter().skip(place).step_by(LATTICE * LATTICE);
            let (w, s) = weight_and_sum(slices.flatten());
            (w > 0.0).then(|| s / w)
        };
        (0..LATTICE * LATTICE).map(place).collect()
    }

    /// Weighted mean of the squares of `of(place, value)`.
    fn mean_square(&self, of: impl Fn(usize, f64) -> Option<f64>) -> f64 {
        let (mut square, mut total) = (0.0, 0.0);
        for (index, node) in self.nodes.iter().enumerate() {
            if let Some((w, v)) = node
                && let Some(d) = of(index % (LATTICE * LATTICE), *v)
            {
                square += w * d * d;
                total += w;
            }
        }
        if total > 0.0 { square / total } else { 0.0 }
    }

    /// Variance of the values; `None` if it is rounding.
    fn variance(&self) -> Option<f64> {
        self.shares()?;
        let (w, s) = weight_and_sum(self.nodes.iter().flatten());
        Some(self.mean_square(|_, v| Some(v - s / w)))
    }

    /// Mean squared deviation from the typical value of each place.
    fn deviation(&self, typical: &[Option<f64>]) -> f64 {
        self.mean_square(|place, v| typical[place].map(|t| v - t))
    }

    fn physical(&self) -> f64 {
        self.nodes.iter().flatten().count() as f64 / self.nodes.len() as f64
    }

    fn shares(&self) -> Option<Shares> {
        let cells = self.nodes.iter().enumerate().filter_map(|(index, node)| {
            let (weight, value) = (*node)?;
            Some(Cell {
                place: [index / LATTICE % LATTICE, index % LATTICE],
                weight,
                value,
            })
        });
        Shares::of([LATTICE; 2], &cells.collect::<Vec<_>>())
    }
}

/// Weight of some nodes, and their weighted sum.
fn weight_and_sum<'a>(nodes: impl Iterator<Item = &'a (f64, f64)>) -> (f64, f64) {
    nodes.fold((0.0, 0.0), |(w, s), (x, v)| (w + x, s + x * v))
}
