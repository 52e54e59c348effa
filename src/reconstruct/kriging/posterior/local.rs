//! The process of many readings: what is known at a pair follows from the readings nearest to it (Vecchia 1988; Datta,
//! Banerjee, Finley & Gelfand 2016), so that work grows in proportion to pairs, and not with the cube of readings.
//!
//! Readings on lines or sheets have their nearest ones on the same line: less than half of those that a pair is given are the nearest
//! of all, the others are the nearest of ever thinner parts of the readings. Tests compare them with a system of all readings: of 4000 over all
//! pairs, and of 1500 on six lines, of which the nearest alone would leave standard deviations 13 % larger than all do.

use super::super::kernel::{COLUMNS, Columns, Kernel};
use super::super::space::Space;
use super::super::sparse;
use super::super::system::{self, Covariance, Data, FREEDOM, Sites};
use super::super::{KIND, Kriging, MOST_COMPARED};
use super::{Estimates, Explained, LEAST_SURPRISE, Noise, Posterior};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::numeric::tree::{Near, Squared, Tree};
use crate::reconstruct::{LogNormal, ReconstructError, Suspect};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Readings that determine the process at a pair.
const NEAREST: usize = 256;

/// Of these the nearest of all readings, at least; the others are the nearest of each thinner part.
const NEAREST_OF_ALL: usize = 112;

/// Parts of the readings, at random, each a quarter of the one before.
const THINNER: usize = 3;

/// Supposed readings that a pair is given beside them, at most.
const SUPPOSED: usize = 64;

/// Of the nearest readings those whose own errors are predicted from all others, and those that a mean alone is of.
const LEFT_OUT: usize = 64;

/// Readings whose squared errors are averaged, of as many as are there before.
const SAMPLED: usize = 1024;

/// Readings that each of them is predicted by.
const PREDICTING: usize = 128;

/// ln(f + ε) of more readings than one system holds.
pub(crate) struct LocalPosterior {
    space: Space,
    covariance: Covariance,
    /// Two columns of values: ln(f + ε) less its mean beforehand, and the error that readings share beyond the least.
    data: Data,
    /// Where readings are, in the metric of [`Kernel::reach`](super::super::kernel::Kernel::reach).
    cloud: SiteTrees,
    /// Further pairs that count as read as expected; of no effect on means.
    supposed: Supposed,
    /// What all variances are to be multiplied by.
    pub scale: f64,
    noise: Noise,
    /// Error of ln f that all readings share at least.
    shared: f64,
}

/// Sites that are searched by their columns, each times a scale.
struct SiteTrees {
    scales: Columns,
    tree: Tree<COLUMNS, Squared>,
    /// Thinner parts, each with the numbers of its sites.
    thinner: Vec<(Tree<COLUMNS, Squared>, Vec<usize>)>,
}

impl SiteTrees {
    fn new(scales: Columns, sites: &[Columns]) -> Self {
        let points: Vec<Columns> = sites.iter().map(|x| scaled(x, &scales)).collect();
        Self {
            scales,
            tree: Tree::new(Squared, &points),
            thinner: Vec::new(),
        }
    }

    /// This cloud with its thinner parts.
    fn with_thinner(self, sites: &[Columns]) -> Self {
        let order = sparse::shuffled(sites.len());
        let part = |k: usize| {
            let numbers = order[..order.len() >> (2 * k)].to_vec();
            let points: Vec<Columns> = numbers
                .iter()
                .map(|&i| scaled(&sites[i], &self.scales))
                .collect();
            (Tree::new(Squared, &points), numbers)
        };
        Self {
            thinner: (1..=THINNER).map(part).collect(),
            ..self
        }
    }

    /// The numbers of the sites that determine a place, the nearest last, and the squared distance up to which all of them are near it.
    fn determining(&self, x: &Columns) -> (Vec<usize>, f64) {
        let near = self.nearest(x, NEAREST, f64::INFINITY);
        let reach2 = near.last().map_or(0.0, |last| last.distance);
        let mut near = near.into_iter().map(|near| near.number as usize);
        let mut chosen: Vec<usize> = near.by_ref().take(NEAREST_OF_ALL).collect();
        let of_each = (NEAREST - NEAREST_OF_ALL) / THINNER;
        let mut found = Vec::new();
        for (tree, numbers) in &self.thinner {
            tree.nearest(&scaled(x, &self.scales), NEAREST, f64::INFINITY, &mut found);
            let of = found.iter().map(|near| numbers[near.number as usize]);
            let new: Vec<usize> = of.filter(|i| !chosen.contains(i)).take(of_each).collect();
            chosen.extend(new);
        }
        let rest: Vec<usize> = near.filter(|i| !chosen.contains(i)).collect();
        chosen.extend(rest);
        chosen.truncate(NEAREST);
        chosen.reverse();
        (chosen, reach2)
    }

    /// The `count` nearest to a place up to a squared distance, nearest first.
    fn nearest(&self, x: &Columns, count: usize, most: f64) -> Vec<Near<f64>> {
        let mut found = Vec::with_capacity(2 * count);
        self.tree
            .nearest(&scaled(x, &self.scales), count, most, &mut found);
        found
    }
}

fn scaled(x: &Columns, scales: &Columns) -> Columns {
    std::array::from_fn(|c| x[c] * scales[c])
}

/// Pairs that are taken to be read, with the variance of ln f of each reading.
struct Supposed {
    sites: Sites,
    noise: Vec<f64>,
    cloud: SiteTrees,
}

impl Supposed {
    fn none(scales: Columns, space: &Space) -> Self {
        Self {
            sites: Sites::new(&[], space, None),
            noise: Vec::new(),
            cloud: SiteTrees::new(scales, &[]),
        }
    }
}

/// Pairs, with what the readings nearest to each say of it.
pub(crate) struct Nearby<'a> {
    local: &'a LocalPosterior,
    sites: Sites,
    of: Vec<Given>,
}

/// What is known at a pair.
struct Given {
    /// Numbers of the readings that determine it.
    read: Vec<u32>,
    /// Numbers of the supposed ones.
    supposed: Vec<u32>,
    /// The weight of each in the mean at the pair, of the supposed ones after the others.
    weights: DVector<f64>,
    /// Squared distance of the farthest reading.
    reach2: f64,
    mean: f64,
    /// Variance without the scale by the readings alone, and with the supposed ones.
    variances: [f64; 2],
    shared: f64,
    surprise: f64,
}

impl LocalPosterior {
    /// By the luminance of a measurement's readings, of which there are more than a prior is of use for; and the readings that all
    /// others contradict, which are left out.
    ///
    /// # Errors
    /// If there are none or too many, or their covariances are singular.
    pub(crate) fn new(
        kriging: &Kriging,
        measurement: &Measurement,
    ) -> Result<(Self, Vec<Suspect>), ReconstructError> {
        let Explained {
            space,
            mut accounts,
            shared,
            suspects,
        } = Explained::new(kriging, measurement)?;
        let (account, data, noise) = accounts.swap_remove(0);
        let readings = data.sites.len();
        let local = Self::given(&account.kernel, data, space, &shared);
        let local = local.ok_or(ReconstructError::Singular {
            method: KIND,
            readings,
        })?;
        Ok((Self { noise, ..local }, suspects))
    }

    /// By the readings, and the errors that they share.
    pub(super) fn given(kernel: &Kernel, data: Data, space: Space, shared: &[f64]) -> Option<Self> {
        let covariance = Covariance::new(kernel);
        let scales = kernel.reach();
        let least = super::least(shared);
        let scale = scale(&covariance, scales, &space, &data)?;
        let values = DMatrix::from_fn(data.sites.len(), 2, |i, c| match c {
            0 => data.values[(i, 0)],
            _ => shared[i] - least,
        });
        let columns = &data.sites.columns;
        let cloud = SiteTrees::new(scales, columns).with_thinner(columns);
        let supposed = Supposed::none(scales, &space);
        Some(Self {
            space,
            covariance,
            data: Data { values, ..data },
            cloud,
            supposed,
            scale,
            noise: Noise::default(),
            shared: least,
        })
    }

    /// This process with some pairs that count as if they had been read as expected; `None` if covariances are singular.
    pub(crate) fn supposing(self, pairs: &[DirectionPair]) -> Option<Self> {
        let supposed = self.supposed(pairs)?;
        Some(Self { supposed, ..self })
    }

    fn supposed(&self, pairs: &[DirectionPair]) -> Option<Supposed> {
        let none = Supposed::none(self.cloud.scales, &self.space);
        let sites = Sites::new(pairs, &self.space, None);
        let noise = |given: Given| self.noise.variance(given.mean);
        let noise = self.each(&sites, &none, noise)?;
        Some(Supposed {
            cloud: SiteTrees::new(self.cloud.scales, &sites.columns),
            noise,
            sites,
        })
    }

    /// What is known at pairs; `None` if covariances are singular.
    pub(crate) fn at(&self, pairs: &[DirectionPair]) -> Option<Nearby<'_>> {
        let sites = Sites::new(pairs, &self.space, None);
        Some(Nearby {
            local: self,
            of: self.each(&sites, &self.supposed, |given| given)?,
            sites,
        })
    }

    /// Something of what is known at each site.
    fn each<T: Send>(
        &self,
        sites: &Sites,
        supposed: &Supposed,
        of: impl Fn(Given) -> T + Sync,
    ) -> Option<Vec<T>> {
        let all = (0..sites.len()).into_par_iter();
        let of = |i| Some(of(self.given_nearest(&sites.select(&[i]), supposed)?));
        all.map(of).collect()
    }

    /// ln(f + ε) at pairs, each by the nearest 64 readings; `None` if covariances are singular.
    pub(crate) fn means(&self, pairs: &[DirectionPair]) -> Option<Vec<f64>> {
        let sites = Sites::new(pairs, &self.space, None);
        let mean = |i: usize| {
            let at = sites.select(&[i]);
            let near = self.cloud.nearest(&at.columns[0], LEFT_OUT, f64::INFINITY);
            let near: Vec<usize> = near.iter().map(|near| near.number as usize).collect();
            let [update, _] = predicted(&self.covariance, self.data.select(&near), &at)?;
            Some(at.mean[0] + update)
        };
        (0..sites.len()).into_par_iter().map(mean).collect()
    }

    /// What is known at one site.
    fn given_nearest(&self, at: &Sites, supposed: &Supposed) -> Option<Given> {
        let x = &at.columns[0];
        // The nearest of the readings come last: what they are missed by takes their rows alone.
        let (read, reach2) = self.cloud.determining(x);
        let further = supposed.cloud.nearest(x, SUPPOSED, reach2);
        let further: Vec<usize> = further.iter().map(|near| near.number as usize).collect();
        let numbers = |list: &[usize]| list.iter().map(|&i| i as u32).collect();
        let n = read.len();
        let mut data = self.data.select(&read);
        let own = data.values.clone();
        data.sites = data.sites.and(&supposed.sites.select(&further));
        data.noise
            .extend(further.iter().map(|&i| supposed.noise[i]));
        let factor = self.covariance.factor(&data)?;
        let mut weights = self.covariance.between(&data.sites.rows(), at, 0..1);
        system::forward(&factor, &mut weights);
        let corner = factor.view((0, 0), (n, n));
        let values = corner.solve_lower_triangular(&own)?;
        let estimates = values.tr_mul(&weights.rows(0, n));
        let before = self.covariance.variances(at)[0];
        let variances = [weights.rows(0, n).norm_squared(), weights.norm_squared()];
        let tail = n - n.min(LEFT_OUT);
        let tail = factor.view((tail, tail), (n - tail, n - tail));
        let inverse =
            tail.solve_lower_triangular(&DMatrix::identity(tail.nrows(), tail.nrows()))?;
        let values = values.rows(n - tail.nrows(), tail.nrows());
        let near = system::nearness(self.data.sites.len());
        let [mut sum, mut all] = [0.0, 1e-300];
        for (row, column) in inverse.column_iter().enumerate() {
            // A row of K⁻¹ is one of L⁻ᵀ times L⁻¹.
            let square = column.dot(&values.column(0)).powi(2) / column.norm_squared();
            let site = &data.sites.columns[n - tail.nrows() + row];
            let weight = near(x, site);
            sum += weight * square / self.scale;
            all += weight;
        }
        factor.tr_solve_lower_triangular_mut(&mut weights);
        Some(Given {
            mean: at.mean[0] + estimates[0],
            shared: self.shared + estimates[1].max(0.0),
            surprise: (sum / all).max(LEAST_SURPRISE),
            read: numbers(&read),
            supposed: numbers(&further),
            weights: weights.column(0).into_owned(),
            reach2,
            variances: variances.map(|less| (before - less).max(0.0)),
        })
    }

    /// What is known at each pair, now and once there are readings at others too, each as it is expected; `None` if covariances are
    /// singular.
    pub(crate) fn predict(
        &self,
        pairs: &[DirectionPair],
        read: &[DirectionPair],
    ) -> Option<Vec<[LogNormal; 2]>> {
        let sites = Sites::new(pairs, &self.space, None);
        self.each(&sites, &self.supposed(read)?, |given| {
            given.variances.map(|variance| LogNormal {
                mean: given.mean,
                variance: variance * self.scale + given.shared * given.shared,
                shared: given.shared * given.shared,
            })
        })
    }

    /// The process of as many readings as one system holds, those nearest to some pairs: no more is known by it than by all. `None`
    /// if their covariances are singular.
    pub(crate) fn about(&self, pairs: &[DirectionPair]) -> Option<Posterior> {
        let sites = self.space.columns(pairs);
        let near: Vec<Vec<usize>> = sites
            .par_iter()
            .map(|x| self.cloud.determining(x).0)
            .collect();
        let mut is_chosen = vec![false; self.data.sites.len()];
        let mut left = MOST_COMPARED;
        for rank in 1..=NEAREST {
            for of in near.iter().filter(|near| near.len() >= rank) {
                let chosen = &mut is_chosen[of[of.len() - rank]];
                if !*chosen && left > 0 {
                    *chosen = true;
                    left -= 1;
                }
            }
        }
        let chosen: Vec<usize> = (0..is_chosen.len()).filter(|&i| is_chosen[i]).collect();
        let data = self.data.select(&chosen);
        let errors: Vec<f64> = data
            .values
            .column(1)
            .iter()
            .map(|e| self.shared + e)
            .collect();
        let data = Data {
            values: data.values.columns(0, 1).into_owned(),
            ..data
        };
        let process = Posterior::given(self.covariance.clone(), None, data, self.space.clone())?;
        Some(Posterior {
            scale: self.scale,
            noise: self.noise,
            ..process.sharing(&errors)
        })
    }
}

/// What some readings add to the mean beforehand at a site, by their first values, and the variance that they leave.
fn predicted(covariance: &Covariance, mut near: Data, at: &Sites) -> Option<[f64; 2]> {
    let factor = covariance.factor(&near)?;
    let mut weights = covariance.between(&near.sites.rows(), at, 0..1);
    system::forward(&factor, &mut weights);
    system::forward(&factor, &mut near.values);
    let update = near.values.column(0).dot(&weights.column(0));
    let variance = covariance.variances(at)[0] - weights.norm_squared();
    Some([update, variance.max(0.0)])
}

/// The scale of all variances: (6 + yᵀ K⁻¹ y) / (6 + n), where yᵀ K⁻¹ y is the sum of the squared errors of readings as those before them
/// predict them, in units of their variance. 2000 at random are one system; of the others some are predicted by the nearest of those
/// before them.
fn scale(covariance: &Covariance, scales: Columns, space: &Space, data: &Data) -> Option<f64> {
    let n = data.sites.len();
    let data = data.select(&sparse::shuffled(n));
    let known = n.min(MOST_COMPARED);
    let first = data.select(&(0..known).collect::<Vec<_>>());
    let first = Posterior::given(covariance.clone(), None, first, space.clone())?;
    let mut sum = first.scale * (FREEDOM + known as f64);
    let mut level = known..n.min(2 * known);
    while !level.is_empty() {
        let cloud = SiteTrees::new(scales, &data.sites.columns[..level.end]);
        let square = |i: usize| {
            let at = data.sites.select(&[i]);
            // At least half of all are before it.
            let near = cloud
                .nearest(&at.columns[0], 3 * PREDICTING, f64::INFINITY)
                .into_iter();
            let before = near.map(|near| near.number as usize).filter(|k| *k < i);
            let near = data.select(&before.take(PREDICTING).collect::<Vec<_>>());
            let [update, variance] = predicted(covariance, near, &at)?;
            let off = data.values[(i, 0)] - update;
            Some(off * off / (variance + data.noise[i]))
        };
        let step = level.len().div_ceil(SAMPLED);
        let sample: Vec<usize> = level.clone().step_by(step).collect();
        let squares = sample.par_iter().map(|&i| square(i));
        let squares: Vec<f64> = squares.collect::<Option<_>>()?;
        sum += squares.iter().sum::<f64>() / sample.len() as f64 * level.len() as f64;
        level = level.end..n.min(2 * level.end);
    }
    Some(sum / (FREEDOM + n as f64))
}

impl Nearby<'_> {
    /// The sites that determine what is known at one.
    fn sites_of(&self, given: &Given) -> Sites {
        let LocalPosterior { data, supposed, .. } = self.local;
        let [read, further] = [&given.read, &given.supposed]
            .map(|list| list.iter().map(|&i| i as usize).collect::<Vec<_>>());
        data.sites
            .select(&read)
            .and(&supposed.sites.select(&further))
    }

    fn all(&self, of: impl Fn(&Given) -> f64) -> Vec<f64> {
        self.of.iter().map(of).collect()
    }
}

impl Estimates for Nearby<'_> {
    fn scale(&self) -> f64 {
        self.local.scale
    }

    fn means(&self) -> Vec<f64> {
        self.all(|given| given.mean)
    }

    fn variances(&self) -> Vec<f64> {
        self.all(|given| given.variances[1])
    }

    fn surprise(&self) -> Vec<f64> {
        self.all(|given| given.surprise)
    }

    fn noise(&self) -> Vec<f64> {
        self.all(|given| self.local.noise.variance(given.mean))
    }

    fn readable(&self) -> Vec<f64> {
        let LocalPosterior { data, supposed, .. } = self.local;
        let read = &data.sites.columns;
        if supposed.sites.len() == 0 {
            return vec![1.0; self.of.len()];
        }
        let weight = system::nearness(read.len());
        let near = |x: &Columns, of: &[Columns]| -> f64 { of.iter().map(|y| weight(x, y)).sum() };
        let share = |x: &Columns| {
            let [had, not] = [read, &supposed.sites.columns].map(|of| near(x, of));
            (1.0 + had) / (1.0 + had + not)
        };
        self.sites.columns.par_iter().map(share).collect()
    }

    /// Of pairs that share no readings it is 0, of others it follows from those of the first.
    fn covariances_with(&self, number: usize) -> DVector<f64> {
        let (covariance, cloud) = (&self.local.covariance, &self.local.cloud);
        let own = self.sites.select(&[number]);
        let place = scaled(&own.columns[0], &cloud.scales);
        let before = covariance.between(&self.sites.rows(), &own, 0..1);
        let of = |i: usize| {
            let given = &self.of[i];
            let at = scaled(&self.sites.columns[i], &cloud.scales);
            let way = at.iter().zip(&place).map(|(a, b)| (a - b) * (a - b));
            if i == number {
                given.variances[1]
            } else if way.sum::<f64>() < given.reach2 {
                let with = covariance.between(&self.sites_of(given).rows(), &own, 0..1);
                before[i] - with.column(0).dot(&given.weights)
            } else {
                0.0
            }
        };
        let all: Vec<f64> = (0..self.of.len()).into_par_iter().map(of).collect();
        DVector::from_vec(all)
    }
}
