//! Which part of a parametrization light of one facet, of two, of more is in: the connection between subsets of a parametrization
//! and subsets of light paths that Barla et al. 2015 ask for.
//!
//! Paths are drawn from the measure f cos θ_i cos θ_o, so that the light of a class in any set of coordinates is a mean over paths,
//! and no BRDF value is asked for ([`SplitBrdf::paths`](crate::brdf::SplitBrdf::paths)).

mod boxes;
mod information;
mod map;
mod sample;

pub(crate) use boxes::{BestBox, LEAST as LEAST_CAPTURE};
pub use information::Information;
pub use map::{CELLS as MAP_CELLS, Map};
pub use sample::{Capture, LightShares, PathSample, Spread};

use super::Estimate;
use crate::brdf::CLASSES;
use crate::geometry::Symmetry;
use crate::parametrization::{Axis, Coords, Parametrization, ParametrizationSpec};
use crate::registry::Entry;
use rayon::prelude::*;

/// Paths that are brought into coordinates at a time.
const CHUNK: usize = 1 << 14;

/// Light of a class that lies below its range, and above it.
const TAIL: f64 = 0.025;

/// What one parametrization says of the classes.
#[derive(Clone, Debug)]
pub struct ChartBounces {
    /// Its name.
    pub name: &'static str,
    /// Axes of the form of the material.
    pub axes: Vec<Axis>,
    /// What its coordinates tell of the class.
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
    let symbol = |axis: &Axis| match axis.symbol {
        "theta_i" if symmetry.reciprocal => "theta_max",
        "theta_o" if symmetry.reciprocal => "theta_min",
        symbol => symbol,
    };
    let axes = axes.iter();
    axes.map(|axis| Axis {
        symbol: symbol(axis),
        ..*axis
    })
    .collect()
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
        Self {
            name: entry.kind,
            axes: folded(form.axes(), symmetry),
            information,
            ranges: ranges(sample, &coords, &ranks),
            map_axes: {
                let axes = entry.axes(Symmetry::FULL);
                [axes[0], axes[1], axes[2]]
            },
            maps: map::maps(sample, entry),
            best,
        }
    }
}

/// What the coordinates of a form tell of the class of light, bits.
pub fn information(sample: &PathSample, form: &dyn Parametrization) -> Information {
    let coords = forward(sample, form);
    information::information(sample, &information::ranks(&coords, form.axes().len()))
}

/// Entropy of the class of light, bits: what coordinates tell at most.
pub fn entropy(sample: &PathSample) -> Estimate {
    information::entropy(sample)
}

/// Coordinates of all paths.
fn forward(sample: &PathSample, form: &dyn Parametrization) -> Vec<Coords> {
    let mut coords = vec![[0.0; 4]; sample.pairs().len()];
    let chunks = coords.par_chunks_mut(CHUNK);
    chunks
        .zip(sample.pairs().par_chunks(CHUNK))
        .for_each(|(coords, pairs)| form.forward_batch(pairs, coords));
    coords
}

/// The ranges of all axes.
fn ranges(
    sample: &PathSample,
    coords: &[Coords],
    ranks: &[Vec<u32>],
) -> Vec<[Option<[f64; 2]>; CLASSES]> {
    let mut totals = [0.0; CLASSES];
    for (class, light) in sample.classes().iter().zip(sample.light()) {
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
            let class = usize::from(sample.classes()[i]);
            sums[class] += sample.light()[i];
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
