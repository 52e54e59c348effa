//! A BRDF as the page holds it: values at the nodes of a grid over half and difference angles.

use super::packed::{Coded, Parts};
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
    nodes: Nodes,
    interpolation: Interpolation,
    /// Names of the channels; none: luminance alone.
    channels: Vec<String>,
    is_coloured: bool,
    values: Vec<f64>,
}

/// Where values of a grid are asked for: a cell's own node.
pub(super) fn node(dims: &[usize], symmetry: Symmetry, cell: &[usize]) -> Option<DirectionPair> {
    let around = if symmetry.reciprocal { PI } else { TAU };
    let at = |shares: [f64; 4]| {
        let [theta_h, theta_d] = [FRAC_PI_2 * shares[0] * shares[0], FRAC_PI_2 * shares[1]];
        let (sin, cos) = (TAU * shares[3]).sin_cos();
        let turned = |v: Direction| {
            let v = v.vector();
            let v = DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
            Direction::from_unit(v)
        };
        let pair = pair_of([theta_h, theta_d, around * shares[2]])?;
        Some(DirectionPair::new(
            turned(pair.omega_i),
            turned(pair.omega_o),
        ))
    };
    let share = |axis: usize, beyond: f64| {
        let cell = *cell.get(axis).unwrap_or(&0) as f64;
        let all = *dims.get(axis).unwrap_or(&1) as f64;
        if dims.len() <= axis {
            0.0
        } else {
            (cell + beyond) / all
        }
    };
    let middle = [0, 1, 2, 3].map(|axis| share(axis, 0.5));
    if let Some(pair) = at(middle) {
        return Some(pair);
    }
    // As [`MerlGrid::pair`]: some part of a cell across the horizon is above it, nearest to its highest corner.
    let half = dims[2] / if symmetry.reciprocal { 2 } else { 4 };
    let up = if cell[2] % (2 * half) < half {
        1.0
    } else {
        0.0
    };
    let corner = [share(0, 0.0), share(1, 0.0), share(2, up), middle[3]];
    on_the_way(corner, middle, at)
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
        let dims = match symmetry.isotropic {
            true if is_coarse => {
                let [n_h, n_d, n_phi] = grid.dims();
                vec![n_h, n_d / 2, n_phi / 2]
            }
            true => grid.dims().to_vec(),
            false => {
                let mut dims = TURNED.to_vec();
                dims[2] *= if symmetry.reciprocal { 1 } else { 2 };
                dims
            }
        };
        let shown = Shown::of(brdf.channels());
        let n = shown.count();
        let [n_d, n_phi] = [dims[1], dims[2]];
        let turns = *dims.get(3).unwrap_or(&1);
        let rows: Vec<Vec<f64>> = (0..dims[0] * n_d)
            .into_par_iter()
            .map(|row| {
                let mut values = vec![f64::NAN; n * n_phi * turns];
                let (h, d) = (row / n_d, row % n_d);
                let mut at = Vec::new();
                let mut pairs = Vec::new();
                for i in 0..n_phi * turns {
                    let (phi, turn) = (i / turns, i % turns);
                    if let Some(table) = merl {
                        let found = table.value([h, d, phi]);
                        if let Some(found) = found {
                            values[n * i..n * (i + 1)].copy_from_slice(&found[..n]);
                        }
                        continue;
                    }
                    if let Some(pair) = node(&dims, symmetry, &[h, d, phi, turn]) {
                        at.push(i);
                        pairs.push(pair);
                    }
                }
                let (found, presence) = brdf.values(&pairs);
                let width = brdf.channels().count();
                let found = found.chunks_exact(width).zip(presence);
                for (i, (found, presence)) in at.into_iter().zip(found) {
                    let is_data = found.iter().all(|v| v.is_finite());
                    if presence == Presence::Present && is_data {
                        shown.write(found, &mut values[n * i..n * (i + 1)]);
                    }
                }
                values
            })
            .collect();
        let planes = (0..n).flat_map(|c| {
            let of_row =
                move |row: &Vec<f64>| row.iter().skip(c).step_by(n).copied().collect::<Vec<_>>();
            rows.iter().flat_map(of_row).collect::<Vec<f64>>()
        });
        let mut made = Self {
            symmetry,
            nodes: merl.map_or(Nodes::Centre, |table| table.grid().nodes()),
            interpolation: merl.map_or(Interpolation::Trilinear, |table| table.interpolation()),
            channels: shown.names(),
            is_coloured: matches!(brdf.channels(), Channels::Rgb),
            values: planes.collect(),
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
        let same = |plane: &[f64]| {
            plane
                .iter()
                .zip(first)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        };
        if self.is_coloured && planes.all(same) {
            self.values.truncate(self.dims.iter().product());
            self.channels.clear();
            self.is_coloured = false;
        }
    }

    /// Luminance of every cell; NaN: no data.
    fn luminance(&self) -> Vec<f64> {
        let planes: Vec<&[f64]> = self.values.chunks_exact(self.cells()).collect();
        match (&planes[..], self.is_coloured) {
            ([r, g, b], true) => {
                let all = r.iter().zip(*g).zip(*b);
                all.map(|((r, g), b)| Channels::Rgb.luminance(&[*r, *g, *b]))
                    .collect()
            }
            (planes, _) => planes.first().map_or(Vec::new(), |first| first.to_vec()),
        }
    }

    /// The luminances that colours are for, sr⁻¹: all but a hundredth of the cells at either end; `None` of what is black, or has no data.
    fn range(&self) -> Option<[f64; 2]> {
        let all = self.luminance().into_iter().filter(|v| *v > 0.0);
        let mut all: Vec<f64> = all.collect();
        if all.is_empty() {
            return None;
        }
        let mut at = |share: usize| {
            let at = (all.len() - 1) * share / 100;
            *all.select_nth_unstable_by(at, f64::total_cmp).1
        };
        Some([at(1), at(99)])
    }

    /// What the page is to know of a material, and its values.
    pub fn facts(&self, place: usize, name: &str, argument: &str, parts: &Parts) -> Json {
        let coded = Coded::new(&self.values);
        let channels = self.values.len() / self.cells();
        let range = self.range();
        let blob = parts.add(&format!("table-{place}"), &coded.differences(channels));
        // Plane 0 of the page is luminance: mixed of R, G, B, else held.
        let weights = match self.is_coloured {
            true => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|unit| Channels::Rgb.luminance(&unit))
                .to_vec(),
            false => Vec::new(),
        };
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
                "shift": match self.nodes { Nodes::Centre => 0.5, Nodes::Corner => 0.0 },
                "nearest": self.interpolation == Interpolation::Nearest,
                "step": coded.step, "low": coded.low, "blob": blob,
            },
            "note": note,
            "range": range.unwrap_or([0.5, 1.0]),
        })
    }
}

/// What of the channels of a BRDF a page holds.
enum Shown {
    Luminance,
    Rgb,
    /// The mean, then wavelengths by their places, with their names.
    Spectrum(Channels, Vec<usize>, Vec<String>),
}

impl Shown {
    fn of(channels: &Channels) -> Self {
        match channels {
            Channels::Luminance => Self::Luminance,
            Channels::Rgb => Self::Rgb,
            Channels::Wavelengths(all) => {
                let last = all.nm().len() - 1;
                let mut at: Vec<usize> = (0..OF_SPECTRUM)
                    .map(|i| i * last / (OF_SPECTRUM - 1))
                    .collect();
                at.dedup();
                let names = at.iter().map(|&i| format!("{} nm", all.nm()[i])).collect();
                Self::Spectrum(channels.clone(), at, names)
            }
        }
    }

    fn count(&self) -> usize {
        match self {
            Self::Luminance => 1,
            Self::Rgb => 3,
            Self::Spectrum(_, at, _) => 1 + at.len(),
        }
    }

    fn names(&self) -> Vec<String> {
        match self {
            Self::Luminance => Vec::new(),
            Self::Rgb => ["R", "G", "B"].map(String::from).to_vec(),
            Self::Spectrum(_, _, names) => names.clone(),
        }
    }

    fn write(&self, found: &[f64], to: &mut [f64]) {
        match self {
            Self::Luminance | Self::Rgb => to.copy_from_slice(found),
            Self::Spectrum(channels, at, _) => {
                to[0] = channels.luminance(found);
                for (to, &i) in to[1..].iter_mut().zip(at) {
                    *to = found[i];
                }
            }
        }
    }
}
