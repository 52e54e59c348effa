//! Which class leads where: light of each class in cells of the first two axes.

use super::sample::PathSample;
use crate::brdf::CLASSES;
use crate::geometry::Symmetry;
use crate::parametrization::{Coords, Parametrization, ParametrizationSpec};
use crate::registry::Entry;
use rayon::prelude::*;

/// Cells along either axis.
pub const CELLS: usize = 40;

/// Azimuths whose maps are made: thirds of the range.
const AZIMUTHS: usize = 4;

/// Half of what an azimuth's map is of, as a share of the range: 7.5° of 90°.
const HALF_WIDTH: f64 = 1.0 / 12.0;

/// Share of a cell that is above rounding, and far below what a map shows.
const ROUNDING: f64 = 1e-6;

/// Paths of a cell, at least: fewer do not tell who leads.
const FEWEST: f64 = 12.0;

/// Light over the first two axes of the isotropic form with every symmetry: every turn and mirror image of a path counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Middle and half width of the third coordinate, rad or without unit; `None`: all of it.
    pub azimuth: Option<[f64; 2]>,
    /// Share of all light that leaves, of each class: [`CELLS`] rows of as many cells, the first axis along a row.
    pub light: Vec<[f64; CLASSES]>,
    /// Paths of each cell.
    paths: Vec<f64>,
}

impl Map {
    /// Share of each class in the light of a cell; `None` where there are too few paths.
    pub fn shares(&self, cell: usize) -> Option<[f64; CLASSES]> {
        let total: f64 = self.light[cell].iter().sum();
        (self.paths[cell] >= FEWEST && total > 0.0).then(|| self.light[cell].map(|l| l / total))
    }
}

/// Sums of a map: of each cell the light of each class, and the number of paths.
type Tally = Vec<[f64; CLASSES + 1]>;

/// The map of all azimuths, and one of each of some.
pub(super) fn maps(sample: &PathSample, entry: &Entry<ParametrizationSpec>) -> Vec<Map> {
    let form = entry.form(Symmetry::FULL);
    let azimuth = form.axes()[2];
    let steps = (AZIMUTHS - 1) as f64;
    let middle = |i: usize| azimuth.range[0] + azimuth.length() * i as f64 / steps;
    let half = HALF_WIDTH * azimuth.length();
    let slabs = (0..AZIMUTHS).map(|i| Some([middle(i), half]));
    let slabs: Vec<Option<[f64; 2]>> = std::iter::once(None).chain(slabs).collect();
    let none: Vec<Tally> = vec![vec![[0.0; CLASSES + 1]; CELLS * CELLS]; slabs.len()];
    let batches = (0..sample.batches()).into_par_iter().map(|batch| {
        let mut tallies = none.clone();
        let range = sample.batch(batch);
        let mut coords = vec![[0.0; 4]; range.len()];
        form.forward_batch(&sample.pairs()[range.clone()], &mut coords);
        for (i, coords) in range.zip(coords) {
            let places = places(&*form, coords);
            let part = 1.0 / places.len() as f64;
            for (cell, azimuth) in places {
                for (tally, slab) in tallies.iter_mut().zip(&slabs) {
                    if slab.is_none_or(|[middle, half]| (azimuth - middle).abs() <= half) {
                        let class = usize::from(sample.classes()[i]);
                        tally[cell][class] += part * sample.light()[i];
                        tally[cell][CLASSES] += 1.0;
                    }
                }
            }
        }
        tallies
    });
    let mut sums = none.clone();
    for batch in batches.collect::<Vec<_>>() {
        for (sum, part) in sums.iter_mut().flatten().zip(batch.iter().flatten()) {
            (0..=CLASSES).for_each(|c| sum[c] += part[c]);
        }
    }
    let light = |[light @ .., _]: &[f64; CLASSES + 1]| *light;
    let total: f64 = sums[0].iter().flat_map(light).sum();
    let map = |(azimuth, tally): (Option<[f64; 2]>, Tally)| Map {
        azimuth,
        light: tally
            .iter()
            .map(|cell| light(cell).map(|l| l / total))
            .collect(),
        paths: tally.iter().map(|cell| cell[CLASSES]).collect(),
    };
    slabs.into_iter().zip(sums).map(map).collect()
}

/// The cell and the third coordinate of a path: both orders of light and sensor where the box has room for both.
fn places(form: &dyn Parametrization, coords: Coords) -> Vec<(usize, f64)> {
    let axes = form.axes();
    let place = |c: &Coords| {
        let cell = |i: usize| {
            let t = (c[i] - axes[i].range[0]) / axes[i].length();
            // What lies on an edge but for rounding, of facets that have few normals, is in one cell.
            ((t * CELLS as f64 + ROUNDING) as usize).min(CELLS - 1)
        };
        (cell(1) * CELLS + cell(0), c[2])
    };
    if !form.facts().exchange {
        return vec![place(&coords)];
    }
    let inside = |c: &&Coords| {
        axes.iter()
            .zip(*c)
            .all(|(a, x)| a.range[0] <= *x && *x <= a.range[1])
    };
    form.images(&coords)
        .iter()
        .filter(inside)
        .map(place)
        .collect()
}
