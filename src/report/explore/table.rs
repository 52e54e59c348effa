//! A BRDF as the page holds it: values at the nodes of a grid over half and difference angles.

use super::packed::Parts;
use crate::brdf::measured::merl::grid::{on_the_way, pair_of};
use crate::brdf::measured::merl::{Interpolation, MerlGrid, Nodes};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value as Json, json};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Cells along θ_h, θ_d, φ_d and φ_h of a material that changes as it is turned.
const TURNED: [usize; 4] = [45, 30, 36, 36];

/// Channels of a spectrum that a page holds beside its mean.
const OF_SPECTRUM: usize = 3;

/// The values of a BRDF at the nodes of a grid, channel after channel; NaN: no data.
pub(super) struct Grid {
    dims: Vec<usize>,
    symmetry: Symmetry,
    /// From the lower edge of a cell to its node, in cells.
    shift: f64,
    /// True if values are constant over cells.
    nearest: bool,
    /// Names of the channels; none: luminance alone.
    channels: Vec<String>,
    is_coloured: bool,
    values: Vec<f64>,
}

/// Where values of a grid are asked for: a cell's own node.
pub(super) fn node(dims: &[usize], symmetry: Symmetry, cell: &[usize]) -> Option<DirectionPair> {
    let around = if symmetry.reciprocal { PI } else { TAU };
    let at = |[h, d, phi]: [f64; 3]| pair_of([FRAC_PI_2 * (h * h), FRAC_PI_2 * d, around * phi]);
    let share = |axis: usize, beyond: f64| (cell[axis] as f64 + beyond) / dims[axis] as f64;
    let middle = [0, 1, 2].map(|axis| share(axis, 0.5));
    // As [`MerlGrid::pair`]: some part of a cell across the horizon is above it, nearest to its highest corner.
    let half = dims[2] / if symmetry.reciprocal { 2 } else { 4 };
    let up = f64::from(u8::from(cell[2] % (2 * half) < half));
    let corner = [share(0, 0.0), share(1, 0.0), share(2, up)];
    let pair = at(middle).or_else(|| on_the_way(corner, middle, at))?;
    let turn = if dims.len() > 3 { share(3, 0.5) } else { 0.0 };
    let (sin, cos) = (TAU * turn).sin_cos();
    let turned = |v: Direction| {
        let v = v.vector();
        let v = DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        Direction::from_unit(v)
    };
    let DirectionPair { omega_i, omega_o } = pair;
    Some(DirectionPair::new(turned(omega_i), turned(omega_o)))
}

impl Grid {
    /// The values of a BRDF; cells of a MERL table are its own. A coarse grid has a quarter of the nodes, which is enough between some
    /// thousand readings.
    pub fn of(brdf: &dyn Brdf, is_coarse: bool) -> Self {
        let symmetry = brdf.symmetry();
        let merl = brdf.as_merl();
        let grid = match (merl, symmetry.reciprocal) {
            (Some(table), _) => table.grid(),
            (None, true) => MerlGrid::RECIPROCAL,
            (None, false) => MerlGrid::FULL,
        };
        let [n_h, n_d, n_phi] = grid.dims();
        let dims = match symmetry.isotropic {
            true if is_coarse => vec![n_h, n_d / 2, n_phi / 2],
            true => vec![n_h, n_d, n_phi],
            false => {
                let [n_h, n_d, n_phi, turns] = TURNED;
                vec![n_h, n_d, n_phi << u32::from(!symmetry.reciprocal), turns]
            }
        };
        let shown = Shown::of(brdf.channels());
        let [n, width] = [shown.count(), brdf.channels().count()];
        let [n_d, turns] = [dims[1], *dims.get(3).unwrap_or(&1)];
        let row = |row: usize| {
            let mut values = vec![f64::NAN; n * dims[2] * turns];
            let (mut at, mut pairs) = (Vec::new(), Vec::new());
            for (i, to) in values.chunks_exact_mut(n).enumerate() {
                let cell = [row / n_d, row % n_d, i / turns, i % turns];
                if let Some(table) = merl {
                    let found = table.value([cell[0], cell[1], cell[2]]);
                    found.inspect(|found| to.copy_from_slice(&found[..n]));
                } else if let Some(pair) = node(&dims, symmetry, &cell) {
                    at.push(i);
                    pairs.push(pair);
                }
            }
            let (found, presence) = brdf.values(&pairs);
            let found = found.chunks_exact(width).zip(presence);
            for (i, (found, presence)) in at.into_iter().zip(found) {
                let is_data = found.iter().all(|v| v.is_finite());
                if presence == Presence::Present && is_data {
                    shown.write(found, &mut values[n * i..n * (i + 1)]);
                }
            }
            values
        };
        let rows = (0..dims[0] * n_d).into_par_iter();
        let all: Vec<f64> = rows.flat_map_iter(row).collect();
        let plane = |c| all.iter().skip(c).step_by(n);
        let names = shown.at.iter().filter_map(|&c| brdf.channels().name(c));
        let is_centre = grid.nodes() == Nodes::Centre;
        let mut made = Self {
            symmetry,
            shift: if is_centre { 0.5 } else { 0.0 },
            nearest: merl.is_some_and(|table| table.interpolation() == Interpolation::Nearest),
            channels: names.collect(),
            is_coloured: matches!(brdf.channels(), Channels::Rgb),
            values: (0..n).flat_map(plane).copied().collect(),
            dims,
        };
        made.leave_out_like_channels();
        made
    }

    fn cells(&self) -> usize {
        self.dims.iter().product()
    }

    /// Keeps one channel of those that are all the same.
    fn leave_out_like_channels(&mut self) {
        let mut planes = self.values.chunks_exact(self.cells());
        let first = planes.next().unwrap_or_default();
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        let same = |plane: &[f64]| plane.iter().zip(first).all(same);
        if self.is_coloured && planes.all(same) {
            self.values.truncate(self.cells());
            self.channels.clear();
            self.is_coloured = false;
        }
    }

    /// Luminance of a cell; NaN: no data.
    fn luminance(&self, cell: usize) -> f64 {
        match self.is_coloured {
            true => {
                Channels::Rgb.luminance(&[0, 1, 2].map(|c| self.values[c * self.cells() + cell]))
            }
            false => self.values[cell],
        }
    }

    /// The luminances that colours are for, sr⁻¹: all but a hundredth of the cells at either end; `None` of what is black, or has no data.
    fn range(&self) -> Option<[f64; 2]> {
        let all = (0..self.cells()).map(|cell| self.luminance(cell));
        let mut all: Vec<f64> = all.filter(|v| *v > 0.0).collect();
        if all.is_empty() {
            return None;
        }
        let mut at = |share: usize| {
            let at = (all.len() - 1) * share / 100;
            *all.select_nth_unstable_by(at, f64::total_cmp).1
        };
        Some([at(1), at(99)])
    }

    /// Facts of a material, and its values as a part.
    pub fn facts(&self, place: usize, name: &str, argument: &str, parts: &Parts) -> Json {
        let channels = self.values.len() / self.cells();
        let range = self.range();
        let blob = format!("table-{place}");
        let [low, step] = parts.add_values(&blob, &self.values, channels);
        // Plane 0 of the page is luminance: mixed of R, G, B, else held.
        let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let weights = units.iter().filter(|_| self.is_coloured);
        let weights: Vec<f64> = weights.map(|unit| Channels::Rgb.luminance(unit)).collect();
        let note = match (&range, self.dims.len()) {
            (None, _) if self.values.iter().any(|v| !v.is_nan()) => "all of its values are 0",
            (None, _) => "it has no data",
            (_, 4) => "between 45 × 30 × 36 × 36 nodes, which narrow lobes are not resolved by",
            _ => "",
        };
        json!({
            "name": name,
            "argument": argument,
            "symmetry": self.symmetry.to_string(),
            "channels": self.channels,
            "coloured": self.is_coloured,
            "table": {
                "dims": self.dims, "reciprocal": self.symmetry.reciprocal, "luminance": weights,
                "shift": self.shift, "nearest": self.nearest,
                "step": step, "low": low, "blob": blob,
            },
            "note": note,
            "range": range.unwrap_or([0.5, 1.0]),
        })
    }
}

/// What of the channels of a BRDF a page holds.
struct Shown<'a> {
    /// Those whose luminance stands before others: of a spectrum.
    mean: Option<&'a Channels>,
    /// Places of channels.
    at: Vec<usize>,
}

impl<'a> Shown<'a> {
    fn of(channels: &'a Channels) -> Self {
        let n = channels.count();
        let mut at: Vec<usize> = (0..n).collect();
        let is_spectrum = channels.wavelengths().is_some();
        if is_spectrum {
            at = (0..OF_SPECTRUM)
                .map(|i| i * (n - 1) / (OF_SPECTRUM - 1))
                .collect();
            at.dedup();
        }
        let mean = is_spectrum.then_some(channels);
        Self { mean, at }
    }

    fn count(&self) -> usize {
        self.at.len() + usize::from(self.mean.is_some())
    }

    fn write(&self, found: &[f64], to: &mut [f64]) {
        let mean = self.mean.map(|channels| channels.luminance(found));
        let values = mean.into_iter().chain(self.at.iter().map(|&i| found[i]));
        to.iter_mut()
            .zip(values)
            .for_each(|(to, value)| *to = value);
    }
}
