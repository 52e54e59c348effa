//! Which part of a parametrization light of one facet, of two, of more is in: the connection between subsets of a parametrization
//! and subsets of light paths that Barla et al. 2015 ask for.
//!
//! Paths are drawn from the measure f cos θ_i cos θ_o, so that the light of a class in any set of coordinates is a mean over paths,
//! and no BRDF value is asked for ([`SplitBrdf::paths`](crate::brdf::SplitBrdf::paths)).

mod boxes;
mod information;
mod sample;

pub(crate) use boxes::{BestBox, LEAST as LEAST_CAPTURE};
pub use information::{Information, entropy};
pub use sample::{Capture, LightShares, PathSample, Spread};

use crate::brdf::CLASSES;
use crate::geometry::Symmetry;
use crate::parametrization::{Axis, Coords, Parametrization, ParametrizationSpec};
use crate::registry::Entry;
use rayon::prelude::*;

/// Paths that are brought into coordinates at a time.
const CHUNK: usize = 1 << 14;

/// Light of a class that lies below its range, and above it.
const TAIL: f64 = 0.025;

/// Information of the coordinates of one parametrization on the class of scattering order.
#[derive(Clone, Debug)]
pub struct ChartBounces {
    /// Its name.
    pub name: &'static str,
    /// Axes of the form of the material.
    pub axes: Vec<Axis>,
    /// Mutual information of its coordinates and the class.
    pub information: Information,
    /// Of each axis the range that holds 95 % of the light of each class, 2.5 % on either side; `None` of a class without light.
    pub ranges: Vec<[Option<[f64; 2]>; CLASSES]>,
    /// The three axes of the form with every symmetry, over the first two of which maps are.
    pub map_axes: [Axis; 3],
    /// Light over its first two axes: at all azimuths, and about some.
    pub maps: Vec<Map>,
    /// The box that a class has almost to itself; `None` if there is no light of it.
    pub best: Option<BestBox>,
}

/// Axes by what they hold of pairs that reciprocity folds: of both elevations `theta_max` the larger and `theta_min` the lesser.
fn folded(axes: &[Axis], symmetry: Symmetry) -> Vec<Axis> {
    let mut axes = axes.to_vec();
    for axis in axes.iter_mut().filter(|_| symmetry.reciprocal) {
        match axis.symbol {
            "theta_i" => axis.symbol = "theta_max",
            "theta_o" => axis.symbol = "theta_min",
            _ => {}
        }
    }
    axes
}

impl ChartBounces {
    /// Analyses one parametrization for a material of some symmetry; the box is that of `class` with so much of its own light
    /// (`purity`, in (0, 1]), in the isotropic form.
    pub fn new(
        sample: &PathSample,
        entry: &Entry<ParametrizationSpec>,
        symmetry: Symmetry,
        class: usize,
        purity: f64,
    ) -> Self {
        let form = entry.form(symmetry);
        let coords = forward(sample, &*form);
        let ranks = information::ranks(&coords, form.axes().len());
        let flat = symmetry.with_isotropy(true);
        let (information, best) = rayon::join(
            || information::information(sample, &ranks),
            || boxes::best(sample, &entry.form(flat), class, purity),
        );
        let isotropic = entry.axes(Symmetry::FULL);
        Self {
            name: entry.kind,
            axes: folded(form.axes(), symmetry),
            information,
            ranges: ranges(sample, &coords, &ranks),
            map_axes: [0, 1, 2].map(|i| isotropic[i]),
            maps: maps(sample, entry),
            best,
        }
    }
}

/// Mutual information of the coordinates of a form and the class of light, bits.
pub fn information(sample: &PathSample, form: &dyn Parametrization) -> Information {
    let coords = forward(sample, form);
    information::information(sample, &information::ranks(&coords, form.axes().len()))
}

fn forward(sample: &PathSample, form: &dyn Parametrization) -> Vec<Coords> {
    let mut coords = vec![[0.0; 4]; sample.pairs.len()];
    let chunks = (sample.pairs.par_chunks(CHUNK), coords.par_chunks_mut(CHUNK));
    let chunks = chunks.into_par_iter();
    chunks.for_each(|(pairs, coords)| form.forward_batch(pairs, coords));
    coords
}

fn ranges(
    sample: &PathSample,
    coords: &[Coords],
    ranks: &[Vec<u32>],
) -> Vec<[Option<[f64; 2]>; CLASSES]> {
    let mut totals = [0.0; CLASSES];
    for (class, light) in sample.class.iter().zip(&sample.light) {
        totals[usize::from(*class)] += light;
    }
    let axis = |(axis, ranks): (usize, &Vec<u32>)| {
        let mut order = vec![0; ranks.len()];
        for (i, rank) in ranks.iter().enumerate() {
            order[*rank as usize] = i;
        }
        let mut sums = [0.0; CLASSES];
        let mut ends: [[Option<f64>; 2]; CLASSES] = [[None; 2]; CLASSES];
        for i in order {
            let class = usize::from(sample.class[i]);
            sums[class] += sample.light[i];
            for (end, share) in ends[class].iter_mut().zip([TAIL, 1.0 - TAIL]) {
                if end.is_none() && sums[class] >= share * totals[class] {
                    *end = Some(coords[i][axis]);
                }
            }
        }
        ends.map(|[low, high]| Some([low?, high?]))
    };
    ranks.par_iter().enumerate().map(axis).collect()
}

/// Cells along either axis.
pub const MAP_CELLS: usize = 40;

/// Azimuths whose maps are made: thirds of the range.
const AZIMUTHS: usize = 4;

/// Half of what an azimuth's map is of, as a share of the range: 7.5° of 90°.
const HALF_WIDTH: f64 = 1.0 / 12.0;

/// Share of a cell that is above rounding, and far below what a map shows.
const ROUNDING: f64 = 1e-6;

/// Paths of a cell, at least: fewer do not determine the leading class.
const FEWEST: f64 = 12.0;

/// Light over the first two axes of the isotropic form with every symmetry: every turn and mirror image of a path counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Middle and half width of the third coordinate, rad or without unit; `None`: all of it.
    pub azimuth: Option<[f64; 2]>,
    /// Share of all light that leaves, of each class: [`MAP_CELLS`] rows of as many cells, the first axis along a row.
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
fn maps(sample: &PathSample, entry: &Entry<ParametrizationSpec>) -> Vec<Map> {
    let form = entry.form(Symmetry::FULL);
    let azimuth = form.axes()[2];
    let steps = (AZIMUTHS - 1) as f64;
    let middle = |i: usize| azimuth.range[0] + azimuth.length() * i as f64 / steps;
    let half = HALF_WIDTH * azimuth.length();
    let slabs = (0..AZIMUTHS).map(|i| Some([middle(i), half]));
    let slabs: Vec<Option<[f64; 2]>> = std::iter::once(None).chain(slabs).collect();
    let mut sums: Vec<Tally> = vec![vec![[0.0; CLASSES + 1]; MAP_CELLS * MAP_CELLS]; slabs.len()];
    let batches = (0..sample.batches()).into_par_iter().map(|batch| {
        let mut tallies = sums.clone();
        let range = sample.batch(batch);
        let mut coords = vec![[0.0; 4]; range.len()];
        form.forward_batch(&sample.pairs[range.clone()], &mut coords);
        for (i, coords) in range.zip(coords) {
            let places = places(&*form, coords);
            let part = 1.0 / places.len() as f64;
            for (cell, azimuth) in places {
                for (tally, slab) in tallies.iter_mut().zip(&slabs) {
                    if slab.is_none_or(|[middle, half]| (azimuth - middle).abs() <= half) {
                        let class = usize::from(sample.class[i]);
                        tally[cell][class] += part * sample.light[i];
                        tally[cell][CLASSES] += 1.0;
                    }
                }
            }
        }
        tallies
    });
    for batch in batches.collect::<Vec<_>>() {
        for (sum, part) in sums.iter_mut().flatten().zip(batch.iter().flatten()) {
            (0..=CLASSES).for_each(|c| sum[c] += part[c]);
        }
    }
    let light = |[light @ .., _]: &[f64; CLASSES + 1]| *light;
    let total: f64 = sums[0].iter().flat_map(light).sum();
    let share = |cell: &_| light(cell).map(|l| l / total);
    let map = |(azimuth, tally): (Option<[f64; 2]>, Tally)| Map {
        azimuth,
        light: tally.iter().map(share).collect(),
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
            ((t * MAP_CELLS as f64 + ROUNDING) as usize).min(MAP_CELLS - 1)
        };
        (cell(1) * MAP_CELLS + cell(0), c[2])
    };
    if !form.facts().exchange {
        return vec![place(&coords)];
    }
    let is_on = |(axis, x): (&Axis, &f64)| axis.range[0] <= *x && *x <= axis.range[1];
    let is_inside = |c: &&Coords| axes.iter().zip(*c).all(is_on);
    let images = form.images(&coords);
    images.iter().filter(is_inside).map(place).collect()
}
