//! Priors from materials.

use super::super::LOG;
use super::super::kernel::Kernel;
use super::super::space::Space;
use super::super::system::{Data, NUGGET, Sites};
use super::file::VERSION;
use super::{About, BEFORE, FUNCTIONS, Prior, Trained, centred, lattice};
use crate::brdf::Brdf;
use crate::error::count;
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::{Ideal, Instrument};
use crate::measurement::Outcome;
use crate::reconstruct::transform::EPSILON;
use crate::reconstruct::{Cubic, Reconstruct, ReconstructError};
use crate::sampling::Random;
use crate::schedule::{PlanError, Pose, Schedule};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::HashSet;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Elevation, degrees, beyond which materials count little: tables are extrapolated there.
const MASK_DEG: f64 = 80.0;

/// How little.
const BEYOND: f64 = 0.1;

/// Families are left out in so many groups, to see which kernel suits materials that a prior was not made of.
const GROUPS: usize = 5;

/// Readings of these materials: numbers, each of several lists.
const READINGS: [(usize, usize); 2] = [(8, 8), (28, 4)];

/// The kernel about a prior where there are too few materials to leave some out: scale and share.
const USUAL: [f64; 2] = [0.2, 0.3];

/// Where they are sought.
pub(super) const SOUGHT: RangeInclusive<f64> = 1e-3..=10.0;

/// Variance of the level of ln f about that of the prior.
pub(super) const LEVEL: f64 = 1.0;

/// Materials of which a prior is to be made.
pub struct Training {
    nodes: usize,
    schedule: Arc<Schedule>,
    /// The density of cos θ_i cos θ_o at each configuration, in the coordinates of the lattice.
    density: Vec<f64>,
    materials: Vec<Trained>,
    /// ln(f + ε) of each channel and of the luminance, with the number of its material.
    columns: Vec<(usize, Vec<f64>)>,
    /// Sums of f² as a share of its mean of (f cos)².
    brightness: Vec<f64>,
}

/// Reason why there is no prior of some materials.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A material is too rich.
    #[error("{name} is not isotropic, reciprocal and bilateral, as materials of a prior are")]
    Symmetry {
        /// Its name.
        name: String,
    },
    /// Two materials are one.
    #[error("{name} is the same as {other}; allowed: each material once")]
    Twice {
        /// The name of the second.
        name: String,
        /// That of the first.
        other: String,
    },
    /// A material has no value.
    #[error("{name}: {source}")]
    Material {
        /// Its name.
        name: String,
        /// What is amiss.
        source: ReconstructError,
    },
    /// A material has no value in some directions.
    #[error("{name} has no value in some directions below 80°; allowed: materials without holes")]
    Hole {
        /// Its name.
        name: String,
    },
    /// There are too few materials.
    #[error("a prior of {} says nothing; allowed: at least 2", count(*.0, "material"))]
    TooFew(usize),
    /// What materials differ by is nothing, or no number.
    #[error("these {0} materials differ by nothing that is a number")]
    Nothing(usize),
    /// There is no lattice.
    #[error(transparent)]
    Lattice(#[from] PlanError),
}

impl Training {
    /// No materials, on a lattice of so many configurations at most.
    ///
    /// # Errors
    /// If there are too few of them.
    pub fn new(nodes: usize) -> Result<Self, TrainError> {
        let schedule = lattice(nodes)?;
        let density = |pose: &Pose| {
            let [i, o] = [pose.pair.omega_i, pose.pair.omega_o].map(|d| d.cos_theta());
            i * o * schedule.parametrization.jacobian(&pose.coords)
        };
        let density: Vec<f64> = schedule.poses.iter().map(density).collect();
        Ok(Self {
            nodes,
            brightness: vec![0.0; density.len()],
            density,
            schedule: Arc::new(schedule),
            materials: Vec::new(),
            columns: Vec::new(),
        })
    }

    /// Adds a material, all of whose channels count; `content` is a hash of what it is.
    ///
    /// # Errors
    /// If it is of another symmetry, was added before, or has no value at all.
    pub fn add(&mut self, name: &str, content: &str, brdf: &dyn Brdf) -> Result<(), TrainError> {
        if brdf.symmetry() != Symmetry::FULL {
            return Err(TrainError::Symmetry { name: name.into() });
        }
        if let Some(other) = self.materials.iter().find(|m| m.content == content) {
            let (name, other) = (name.into(), other.name.clone());
            return Err(TrainError::Twice { name, other });
        }
        let mut measured = Ideal.measure(brdf, &self.schedule);
        if measured.outcomes.iter().any(|o| *o != Outcome::Reading) {
            // Holes are filled as the spline through all others does.
            let copy = Cubic::default().reconstruct(&measured);
            let copy = copy.map_err(|source| TrainError::Material {
                name: name.into(),
                source,
            })?;
            measured = Ideal.measure(&*copy, &self.schedule);
        }
        let number = self.materials.len();
        let channels = brdf.channels();
        let width = channels.count();
        let luminance = measured.values.chunks(width).map(|f| channels.luminance(f));
        let luminance: Vec<f64> = luminance.collect();
        let poses = self.schedule.poses.iter().zip(&self.density);
        // A black material is bright nowhere.
        let largest = luminance.iter().fold(EPSILON, |a, f| a.max(*f));
        let energy = poses.zip(&luminance).map(|((pose, density), f)| {
            let cosine = pose.pair.omega_i.cos_theta();
            (density * (f / largest * cosine).powi(2), *density)
        });
        let (energy, all) = energy.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        for (sum, f) in self.brightness.iter_mut().zip(&luminance) {
            *sum += (f / largest).powi(2) * all / energy.max(1e-30 * all);
        }
        let column = |f: &[f64]| (number, f.iter().map(|&f| LOG.forward(f)).collect());
        for c in 0..width {
            let of = measured.values.iter().skip(c).step_by(width).copied();
            let of: Vec<f64> = of.collect();
            // Grey values are equal in all channels and count once.
            let mut off = of
                .iter()
                .zip(&luminance)
                .map(|(f, l)| (f - l).abs() / (l + EPSILON));
            if off.any(|off| off > 1e-6) {
                self.columns.push(column(&of));
            }
        }
        self.columns.push(column(&luminance));
        self.materials.push(Trained {
            name: name.into(),
            content: content.into(),
        });
        Ok(())
    }

    /// Number of families of the materials, by the last words of their names.
    pub(crate) fn families(&self) -> usize {
        let families: HashSet<String> = self.materials.iter().map(family).collect();
        families.len()
    }

    /// The prior of all materials, of so many functions at most.
    ///
    /// # Errors
    /// If there are fewer than two materials.
    pub fn prior(self, functions: usize) -> Result<Prior, TrainError> {
        if self.materials.len() < 2 {
            return Err(TrainError::TooFew(self.materials.len()));
        }
        let nodes = self.density.len();
        let gram = self.gram();
        let all: Vec<usize> = (0..self.columns.len()).collect();
        let functions = functions.min(FUNCTIONS);
        let weights = principal(&gram, &all, functions);
        let [scale, share] = self.kernel(&gram, functions).unwrap_or(USUAL);
        let functions = weights.ncols();
        let every: Vec<usize> = (0..nodes).collect();
        let (mean, made) = self.functions(&all, &weights, &every);
        let count = self.materials.len() as f64;
        let mut values = Vec::with_capacity(nodes * (BEFORE + functions));
        for ((mean, bright), made) in mean.iter().zip(&self.brightness).zip(made.column_iter()) {
            let before: [f64; BEFORE] = [*mean, (bright / count).max(1e-30).ln()];
            values.extend(before.iter().chain(made.iter()));
        }
        let centres = coefficients(&weights);
        let about = About {
            gonio_prior: VERSION,
            blake3: String::new(),
            nodes: self.nodes,
            functions,
            scale,
            share,
            centres: all.len(),
            materials: self.materials,
        };
        let materials = about.materials.len();
        Prior::from_values(about, values, &centres).ok_or(TrainError::Nothing(materials))
    }

    /// The products of all columns.
    fn gram(&self) -> DMatrix<f64> {
        let weight = |pose: &Pose| if is_inside(pose) { 1.0 } else { BEYOND };
        let poses = self.schedule.poses.iter();
        let roots: Vec<f64> = poses.map(|pose| weight(pose).sqrt()).collect();
        let all = DMatrix::from_fn(roots.len(), self.columns.len(), |i, c| {
            roots[i] * self.columns[c].1[i]
        });
        all.tr_mul(&all)
    }

    /// The mean of some columns at some configurations, and functions, a column per configuration.
    fn functions(
        &self,
        columns: &[usize],
        weights: &DMatrix<f64>,
        at: &[usize],
    ) -> (Vec<f64>, DMatrix<f64>) {
        let values = DMatrix::from_fn(columns.len(), at.len(), |c, i| {
            self.columns[columns[c]].1[at[i]]
        });
        (
            values.row_mean().iter().copied().collect(),
            weights.tr_mul(&values),
        )
    }

    /// Scale and share of the kernel that make materials most likely that a prior was not made of; `None` if all are of
    /// one family.
    fn kernel(&self, gram: &DMatrix<f64>, functions: usize) -> Option<[f64; 2]> {
        let groups = groups(&self.materials);
        let count = 1 + groups.iter().max()?;
        if count < 2 {
            return None;
        }
        let lists = self.lists();
        let mut left_out = Vec::new();
        for group in 0..count {
            let is_in = |c: &usize| groups[self.columns[*c].0] == group;
            let (tested, trained): (Vec<usize>, Vec<usize>) =
                (0..self.columns.len()).partition(is_in);
            let weights = principal(gram, &trained, functions);
            let centres = coefficients(&weights);
            for at in &lists {
                let (mean, functions) = self.functions(&trained, &weights, at);
                let pairs: Vec<DirectionPair> =
                    at.iter().map(|&i| self.schedule.poses[i].pair).collect();
                let value = |i: usize, c: usize| self.columns[tested[c]].1[at[i]] - mean[i];
                let data = Data {
                    values: DMatrix::from_fn(at.len(), tested.len(), value),
                    noise: vec![NUGGET; at.len()],
                    sites: Sites {
                        mean,
                        functions,
                        ..Sites::new(&pairs, &Space::usual(Symmetry::FULL), None)
                    },
                };
                left_out.push((centres.clone(), data));
            }
        }
        let loss = |[scale, share]: [f64; 2]| -> f64 {
            let kernel = Kernel::new(Symmetry::FULL).about(scale, LEVEL, share);
            let of = |(centres, data): &(DMatrix<f64>, Data)| {
                let loss = centred(centres, &kernel, data).map_or(f64::INFINITY, |l| l.1);
                loss * data.values.ncols() as f64
            };
            left_out.iter().map(of).sum()
        };
        let mut best = (USUAL, loss(USUAL));
        for step in [4.0_f64, 2.0, 1.4] {
            loop {
                let before = best.1;
                for [a, b] in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
                    let tried = [best.0[0] * step.powi(a), best.0[1] * step.powi(b)];
                    let found = loss(tried);
                    if found < best.1 && tried.iter().all(|x| SOUGHT.contains(x)) {
                        best = (tried, found);
                    }
                }
                if !(best.1 < before) {
                    break;
                }
            }
        }
        Some(best.0)
    }

    /// Lists of configurations inside the mask.
    fn lists(&self) -> Vec<Vec<usize>> {
        let poses = &self.schedule.poses;
        let inside: Vec<usize> = (0..poses.len()).filter(|&i| is_inside(&poses[i])).collect();
        let random = Random::new(1);
        let mut next = 0;
        let mut list = |n: usize| -> Vec<usize> {
            let mut chosen = Vec::new();
            while chosen.len() < n.min(inside.len()) {
                let [u]: [f64; 1] = random.point(next);
                next += 1;
                let i = inside[(u * inside.len() as f64) as usize];
                if !chosen.contains(&i) {
                    chosen.push(i);
                }
            }
            chosen
        };
        let all = READINGS
            .iter()
            .flat_map(|&(n, lists)| std::iter::repeat_n(n, lists));
        all.map(&mut list).collect()
    }
}

/// True if both directions are inside the mask.
fn is_inside(pose: &Pose) -> bool {
    pose.pair.least_cosine() > MASK_DEG.to_radians().cos()
}

/// Weights that make principal components of some columns, with coefficients of variance 1, of the products of all: a
/// row per column, a column per component.
fn principal(gram: &DMatrix<f64>, columns: &[usize], most: usize) -> DMatrix<f64> {
    let n = columns.len();
    let mut centred = gram.select_rows(columns).select_columns(columns);
    let means = centred.row_mean();
    let mean = means.mean();
    for i in 0..n {
        for j in 0..n {
            centred[(i, j)] += mean - means[i] - means[j];
        }
    }
    let eigen = SymmetricEigen::new(centred);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // What is left after the last difference between two columns is rounding.
    let least = 1e-9 * eigen.eigenvalues[order[0]];
    order.retain(|&k| eigen.eigenvalues[k] > least);
    order.truncate(most);
    let component = |&k: &usize| {
        let column: DVector<f64> = eigen.eigenvectors.column(k) / (n as f64).sqrt();
        let sign = column[column.icamax()].signum();
        column * sign
    };
    let components: Vec<DVector<f64>> = order.iter().map(component).collect();
    match components.is_empty() {
        true => DMatrix::zeros(n, 0),
        false => DMatrix::from_columns(&components),
    }
}

/// The coefficients with which the components that weights make sum up to each column less the mean.
fn coefficients(weights: &DMatrix<f64>) -> DMatrix<f64> {
    weights.transpose() * weights.nrows() as f64
}

/// The family of a material: the last word of its name, without digits.
fn family(material: &Trained) -> String {
    let mut words = material.name.split(|c: char| !c.is_alphabetic());
    let last = words.rfind(|w| !w.is_empty());
    last.unwrap_or_default().to_lowercase()
}

/// The group of each material: each family is in one.
fn groups(materials: &[Trained]) -> Vec<usize> {
    let families: Vec<String> = materials.iter().map(family).collect();
    let mut sizes: Vec<(usize, &String)> = Vec::new();
    for family in &families {
        match sizes.iter_mut().find(|(_, f)| *f == family) {
            Some((size, _)) => *size += 1,
            None => sizes.push((1, family)),
        }
    }
    sizes.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(b.1)));
    let mut filled = vec![0; GROUPS.min(sizes.len())];
    let mut of = Vec::new();
    for (size, family) in sizes {
        let least = (0..filled.len()).min_by_key(|&g| filled[g]).unwrap_or(0);
        filled[least] += size;
        of.push((family, least));
    }
    let group = |family: &String| of.iter().find(|(f, _)| *f == family).map_or(0, |f| f.1);
    families.iter().map(group).collect()
}
