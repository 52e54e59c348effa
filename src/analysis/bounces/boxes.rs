//! The box of coordinates that a class of light has almost to itself, and that holds most of it.
//!
//! Faces lie at quantiles of the light, rounded to the digits that are printed. All boxes between few faces are tried, the best are
//! moved face by face, two faces of an axis at a time, until nothing is gained, and once more between faces that lie closer about its
//! own. That is done by every other batch; what the box holds is estimated by the rest, so that the estimate is unbiased.

use super::forward;
use super::sample::{Capture, PathSample, capture};
use crate::analysis::Subset;
use crate::brdf::CLASSES;
use crate::error::listed;
use crate::parametrization::{Axis, Coords, Parametrization, Unit};
use std::sync::Arc;

/// Faces along an axis, the ends of the range included, where no light is at a single coordinate.
const FACES: usize = 49;

/// Every so many faces is one of the few.
const STRIDE: usize = 4;

/// Steps of printed digits between the tenth and the ninetieth percentile of an axis, at least.
const STEPS: f64 = 200.0;

/// Share of its class that a box holds at least; a smaller one is pure by chance.
pub(crate) const LEAST: f64 = 0.01;

/// A box, and what it holds by paths that had no part in its choice.
#[derive(Clone, Debug)]
pub struct BestBox {
    /// As `gonio subset --box` reads it; empty: every pair.
    pub text: String,
    /// What it holds.
    pub capture: Capture,
    /// Share of the class in the paths that chose it, in [0, 1]: at least what was asked for, or the largest that was found.
    pub chosen_by: f64,
    /// The class it was chosen for.
    class: usize,
}

impl BestBox {
    /// True if so much of its light is of the class by those that chose it, and, within three standard errors, by those of the estimate. Light
    /// in single directions may lie on a face, where the digits that are printed decide.
    pub(crate) fn is_pure(&self, purity: f64) -> bool {
        let share = self.capture.inside[self.class];
        self.chosen_by >= purity && share.value + 3.0 * share.error >= purity
    }
}

/// Two numbers of faces of each axis.
type Faces = [[usize; 2]; 3];

/// The best box of an isotropic form for class `class` with at least `purity` of its light; `None` if the class has no light.
pub(super) fn best(
    sample: &PathSample,
    form: &Arc<dyn Parametrization>,
    class: usize,
    purity: f64,
) -> Option<BestBox> {
    let axes = form.axes();
    let choosing = (0..sample.batches()).filter(|batch| batch % 2 == 0);
    let paths = Paths {
        sample,
        coords: forward(sample, &**form),
        chooses: choosing.flat_map(|batch| sample.batch(batch)).collect(),
        class,
    };
    let grids = [0, 1, 2].map(|i| Grid::new(&paths, i, &axes[i]));
    let table = |grids: &[Grid; 3]| Table::new(&paths, grids, axes);
    let coarse = Search::new(table(&grids), purity)?;
    let chosen = coarse.best();
    let fine: [Grid; 3] = std::array::from_fn(|i| grids[i].about(chosen[i]));
    let start = std::array::from_fn(|i| {
        chosen[i].map(|face| fine[i].faces.partition_point(|f| *f < grids[i].faces[face]))
    });
    let search = Search::new(table(&fine), purity)?;
    let (_, chosen) = search.moved(start);
    let [of_class, of_all] = search.table.sums(chosen);
    let text = text(axes, &fine, tightened(form, chosen, &fine));
    // From its own text, so that the estimate is of the box that is printed.
    let subset = Subset::read(Arc::clone(form), &text).ok()?;
    let odd = |sums: Vec<[f64; CLASSES]>| sums.into_iter().skip(1).step_by(2).collect();
    let inside = odd(sample.sums(|i| subset.contains(&sample.pairs[i])));
    Some(BestBox {
        text,
        capture: capture(&inside, &odd(sample.sums(|_| true))),
        chosen_by: of_class / of_all,
        class,
    })
}

/// Paths in coordinates, and those of them that choose a box for a class.
struct Paths<'a> {
    sample: &'a PathSample,
    coords: Vec<Coords>,
    chooses: Vec<usize>,
    class: usize,
}

impl Paths<'_> {
    fn is_of_class(&self, path: usize) -> bool {
        usize::from(self.sample.class[path]) == self.class
    }
}

/// Where faces may lie along an axis, in the units of files.
struct Grid {
    /// From the lower end of the range to the upper.
    faces: Vec<f64>,
    /// Faces lie at multiples of one over this, but for the ends.
    per_unit: f64,
    /// Coordinates that much of the light has: no face lies on them.
    singles: Vec<f64>,
}

impl Grid {
    /// Faces at quantiles.
    fn new(paths: &Paths<'_>, axis: usize, is: &Axis) -> Self {
        let sample = paths.sample;
        let placed = paths.chooses.iter().map(|&i| (paths.coords[i][axis], i));
        let mut order: Vec<(f64, usize)> = placed.collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // Quantiles of all light, and of the class.
        let quantiles = |count: usize, counts: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let kept = || order.iter().filter(|(_, i)| counts(*i));
            let total: f64 = kept().map(|(_, i)| sample.light[*i]).sum();
            let (mut found, mut sum) = (Vec::with_capacity(count), 0.0);
            for (x, i) in kept() {
                sum += sample.light[*i];
                while found.len() < count
                    && sum * (count + 1) as f64 > total * (found.len() + 1) as f64
                {
                    found.push(is.file_value(*x));
                }
            }
            found
        };
        let every = quantiles(FACES / 2, &|_| true);
        let tenth = every.len() / 10;
        let high = every.get(every.len().saturating_sub(1 + tenth));
        let spread = high.zip(every.get(tenth)).map_or(1.0, |(h, l)| h - l);
        let per_unit = 10f64.powi(decimals(spread, is));
        // Light at one coordinate, of facets that have few normals, is where neighbours agree. A face there would halve it by
        // rounding; of one a step beside it boxes have all of it or none.
        let on = |pair: &[f64]| {
            let [low, high] = [pair[0], pair[1]].map(|x| (x * per_unit).round());
            (low == high).then_some(low / per_unit)
        };
        let mut singles: Vec<f64> = every.windows(2).filter_map(on).collect();
        singles.dedup();
        let step = 1.0 / per_unit;
        let beside = singles.iter().flat_map(|x| [x - step, x + step]);
        let mut inside = quantiles(FACES - 2 - FACES / 2, &|i| paths.is_of_class(i));
        inside.extend(beside);
        inside.extend(every);
        let ends = is.range.map(|end| is.file_value(end));
        Self::rounded(inside, ends, per_unit, singles)
    }

    fn rounded(inside: Vec<f64>, [low, high]: [f64; 2], per_unit: f64, singles: Vec<f64>) -> Self {
        let is_free = |x: &f64| singles.iter().all(|s| (s - x).abs() * per_unit > 0.5);
        let mut faces = inside;
        faces
            .iter_mut()
            .for_each(|x| *x = (*x * per_unit).round() / per_unit);
        faces.retain(|x| low < *x && *x < high && is_free(x));
        faces.extend([low, high]);
        faces.sort_unstable_by(f64::total_cmp);
        faces.dedup();
        Self {
            faces,
            per_unit,
            singles,
        }
    }

    fn last(&self) -> usize {
        self.faces.len() - 1
    }

    /// Faces that lie closer about two of these.
    fn about(&self, chosen: [usize; 2]) -> Self {
        const PARTS: usize = FACES / 2;
        let near = chosen.iter().flat_map(|&face| {
            let [below, above] = [face.saturating_sub(1), (face + 1).min(self.last())];
            let [low, high] = [below, above].map(|face| self.faces[face]);
            let at = move |i: usize| low + (high - low) * i as f64 / PARTS as f64;
            (0..=PARTS).map(at).chain([self.faces[face]])
        });
        let ends = [0, self.last()].map(|face| self.faces[face]);
        Self::rounded(near.collect(), ends, self.per_unit, self.singles.clone())
    }
}

/// Decimals of a face: enough for [`STEPS`] of them in the spread of the light.
fn decimals(spread: f64, axis: &Axis) -> i32 {
    let least = match axis.unit {
        Unit::Radian => 1.0,
        Unit::One => 3.0,
    };
    (STEPS / spread.max(1e-9)).log10().ceil().clamp(least, 9.0) as i32
}

/// The box without what another box of the same pairs leaves out: with both orders of light and sensor in the domain, all
/// paths have the larger of the two radial coordinates first.
fn tightened(form: &Arc<dyn Parametrization>, chosen: Faces, grids: &[Grid; 3]) -> [[f64; 2]; 3] {
    let mut ends = [0, 1, 2].map(|i| chosen[i].map(|face| grids[i].faces[face]));
    let symmetry = form.symmetry();
    if form.facts().exchange && symmetry.reciprocal && symmetry.bilateral {
        ends[0][0] = ends[0][0].max(ends[1][0]);
        ends[1][1] = ends[1][1].min(ends[0][1]);
    }
    ends
}

/// A box in words; axes that are free are left out.
fn text(axes: &[Axis], grids: &[Grid; 3], ends: [[f64; 2]; 3]) -> String {
    let whole = |i: usize| [0, grids[i].last()].map(|face| grids[i].faces[face]);
    let named = (0..3).filter(|&i| ends[i] != whole(i));
    listed(named.map(|i| format!("{}={}..{}", axes[i].symbol, ends[i][0], ends[i][1])))
}

/// Light of the class, and of all, in all boxes that begin at the origin.
struct Table {
    size: [usize; 3],
    sums: Vec<[f64; 2]>,
}

impl Table {
    fn new(paths: &Paths<'_>, grids: &[Grid; 3], axes: &[Axis]) -> Self {
        let size = grids.each_ref().map(|grid| grid.faces.len());
        let mut table = Self {
            size,
            sums: vec![[0.0; 2]; size.iter().product()],
        };
        for &i in &paths.chooses {
            // The first face above it; those on the upper end are below that.
            let place = [0, 1, 2].map(|axis| {
                let x = axes[axis].file_value(paths.coords[i][axis]);
                let above = grids[axis].faces.partition_point(|face| *face <= x);
                above.clamp(1, size[axis] - 1)
            });
            let at = table.flat_index(place);
            let light = paths.sample.light[i];
            table.sums[at][1] += light;
            if paths.is_of_class(i) {
                table.sums[at][0] += light;
            }
        }
        let strides = [size[1] * size[2], size[2], 1];
        for axis in 0..3 {
            for at in 0..table.sums.len() {
                if at / strides[axis] % size[axis] > 0 {
                    let before = table.sums[at - strides[axis]];
                    (0..2).for_each(|k| table.sums[at][k] += before[k]);
                }
            }
        }
        table
    }

    fn flat_index(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * self.size[1] + j) * self.size[2] + k
    }

    /// Light of the class, and of all, in a box.
    fn sums(&self, [x, y, z]: Faces) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for corner in 0..8 {
            let end = [corner & 1, corner >> 1 & 1, corner >> 2];
            let part = self.sums[self.flat_index([x[end[0]], y[end[1]], z[end[2]]])];
            let sign = [-1.0, 1.0][end.iter().sum::<usize>() % 2];
            (0..2).for_each(|k| sums[k] += sign * part[k]);
        }
        sums
    }
}

struct Search {
    table: Table,
    /// Every pair.
    whole: Faces,
    purity: f64,
    /// Light of the class that a box holds at least.
    least: f64,
}

impl Search {
    /// `None` if there is no light of the class.
    fn new(table: Table, purity: f64) -> Option<Self> {
        let whole = table.size.map(|faces| [0, faces - 1]);
        let [of_class, _] = table.sums(whole);
        (of_class > 0.0).then_some(Self {
            least: LEAST * of_class,
            table,
            whole,
            purity,
        })
    }

    /// Larger is better: pure boxes by the light that they hold, all others below them by their purity.
    fn score(&self, faces: Faces) -> f64 {
        let [class, every] = self.table.sums(faces);
        if class < self.least {
            return -1.0;
        }
        let purity = class / every;
        match purity >= self.purity {
            true => 1.0 + class,
            false => purity,
        }
    }

    fn best(&self) -> Faces {
        let better = |a: (f64, Faces), b: (f64, Faces)| if b.0 > a.0 { b } else { a };
        let scored = |faces: Faces| (self.score(faces), faces);
        let few = |last| (0..last).step_by(STRIDE).chain([last]);
        let ranges = self
            .whole
            .map(|[_, last]| intervals(&few(last).collect::<Vec<_>>()));
        // The best of each range along the first axis: boxes that differ.
        let starts = ranges[0].iter().filter_map(|&x| {
            let others = ranges[1].iter();
            let others = others.flat_map(|&y| ranges[2].iter().map(move |&z| [x, y, z]));
            others.map(scored).reduce(better)
        });
        let moved = starts.map(|(_, start)| self.moved(start));
        moved.fold(scored(self.whole), better).1
    }

    /// A box with its faces moved until no axis gains anything.
    fn moved(&self, start: Faces) -> (f64, Faces) {
        let mut best = (self.score(start), start);
        loop {
            let before = best.0;
            for axis in 0..3 {
                let faces: Vec<usize> = (0..=self.whole[axis][1]).collect();
                for range in intervals(&faces) {
                    let mut other = best.1;
                    other[axis] = range;
                    let score = self.score(other);
                    if score > best.0 {
                        best = (score, other);
                    }
                }
            }
            if best.0 <= before {
                return best;
            }
        }
    }
}

/// Every two of some faces, the lower first.
fn intervals(faces: &[usize]) -> Vec<[usize; 2]> {
    let from = |i: usize| faces[i + 1..].iter().map(move |&to| [faces[i], to]);
    (0..faces.len()).flat_map(from).collect()
}
