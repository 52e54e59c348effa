//! The process given readings: ln(f + ε) at pairs, and how certain it is.

mod local;
mod mixture;

pub(crate) use local::LocalPosterior;
pub(crate) use mixture::Mixture;

use super::kernel::Columns;
use super::prior::{Centre, Prior, PriorFile};
use super::space::Space;
use super::system::{self, Covariance, Data, FREEDOM, NUGGET, Rows, Sites};
use super::{Account, Known, Kriging};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::numeric::upper_median;
use crate::reconstruct::interpolant::{Readings, noise, present};
use crate::reconstruct::transform::EPSILON;
use crate::reconstruct::{ReconstructError, Suspect};
use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;
use std::sync::Arc;

/// ln(f + ε) of one value per pair as a Gaussian process: its level has a variance too, so that it is defined
/// without a single reading.
pub(crate) struct Posterior {
    space: Space,
    covariance: Covariance,
    /// What other materials say; `None`: what all have in common.
    known: Option<Known>,
    data: Data,
    /// One flag per row of the data: false where a reading is only supposed, and none can be had.
    read: Vec<bool>,
    rows: Rows,
    /// Cholesky's factor L of the covariances of the readings.
    factor: DMatrix<f64>,
    /// L⁻¹ y, y = ln(f + ε) less its mean.
    solved: DVector<f64>,
    /// L⁻¹ times the functions of a prior at the readings times the spread of their coefficients.
    spread: DMatrix<f64>,
    /// What all variances are to be multiplied by, from how well the readings suit the kernel.
    pub scale: f64,
    noise: Noise,
    /// What errors of ln f all readings share at least; and L⁻¹ times what each has beyond.
    shared: (f64, DVector<f64>),
}

/// Share of what apertures change of ln f that remains in doubt.
const UNRESOLVED: f64 = 0.5;

/// Pairs in the form that the process takes.
pub(crate) struct Places {
    sites: Sites,
    /// The factor's inverse times the covariances of the readings with each pair: a column per pair.
    solved: DMatrix<f64>,
    /// By how much ln f differs by which materials of a prior this one may be like: a column per pair, the sum of whose
    /// squares is a variance.
    spread: DMatrix<f64>,
}

/// Pairs of a task.
const TASK: usize = 128;

impl Places {
    /// The place with this number.
    pub(crate) fn only(&self, i: usize) -> Self {
        Self {
            sites: self.sites.select(&[i]),
            solved: self.solved.columns(i, 1).into_owned(),
            spread: self.spread.columns(i, 1).into_owned(),
        }
    }
}

/// What is known of ln(f + ε) at each of some pairs.
pub(crate) trait Estimates {
    /// What variances are to be multiplied by.
    fn scale(&self) -> f64;

    fn means(&self) -> Vec<f64>;

    /// Variances, without the scale.
    fn variances(&self) -> Vec<f64>;

    /// Squared errors of the readings near each pair as all others predict them, in units of their variance.
    fn surprise(&self) -> Vec<f64>;

    /// Variances by which further readings are off.
    fn noise(&self) -> Vec<f64>;

    /// How likely there is a reading to be had, in [0, 1].
    fn readable(&self) -> Vec<f64>;

    /// Covariances of all with the pair of this number, without the scale.
    fn covariances_with(&self, number: usize) -> DVector<f64>;

    /// ln(f + ε) as large as it may well be: by its variance larger than the mean, and by 1 at most.
    fn likely_most(&self) -> Vec<f64> {
        let both = self.means().into_iter().zip(self.variances());
        both.map(|(z, v)| z + (v * self.scale()).min(1.0)).collect()
    }
}

/// Places of a process of one system.
impl Estimates for (&Posterior, &Places) {
    fn scale(&self) -> f64 {
        self.0.scale
    }

    fn means(&self) -> Vec<f64> {
        self.0.means(self.1)
    }

    fn variances(&self) -> Vec<f64> {
        self.0.variances(self.1)
    }

    fn surprise(&self) -> Vec<f64> {
        self.0.surprise(self.1)
    }

    fn noise(&self) -> Vec<f64> {
        self.0.noise(self.1)
    }

    fn readable(&self) -> Vec<f64> {
        self.0.readable(self.1)
    }

    fn covariances_with(&self, number: usize) -> DVector<f64> {
        let (process, places) = self;
        let with = process.covariances(places, &places.only(number));
        with.column(0).into_owned()
    }
}

/// The error that all readings share at least; 0 of none.
fn least(errors: &[f64]) -> f64 {
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// The least surprise that counts.
const LEAST_SURPRISE: f64 = 1e-3;

/// Processes, each with its share; all together 1.
type Shared = Vec<(f64, Posterior)>;

/// The luminance of readings, and what explains it.
struct Explained {
    space: Space,
    /// Each with the readings as its system, and the noise of further ones.
    accounts: Vec<(Account, Data, Noise)>,
    /// Error of ln f of each reading that others share.
    shared: Vec<f64>,
    /// Readings that all others contradict, and that are left out.
    suspects: Vec<Suspect>,
}

impl Explained {
    fn new(kriging: &Kriging, measurement: &Measurement) -> Result<Self, ReconstructError> {
        let channels = &measurement.channels;
        let width = channels.count();
        let luminance = |values: &[f64]| channels.luminance(values);
        let values: Vec<f64> = measurement.values.chunks(width).map(luminance).collect();
        // Of the channels together: they are read at once, with the noise of one.
        let each = noise(measurement);
        let type_a: Option<Vec<f64>> = each
            .as_ref()
            .map(|u| u.chunks(width).map(luminance).collect());
        let present = present(measurement);
        let all = Readings::new(measurement, &present, each.as_deref());
        let readings = Readings {
            width: 1,
            values: &values,
            noise: type_a.as_deref(),
            ..all
        };
        let solver = kriging.solver(measurement.schedule.parametrization.symmetry())?;
        let (kernel, suspects) = solver.common(&all);
        let kernel = match width {
            1 => kernel,
            _ => solver.fitted(&Readings {
                present: &super::without(&readings, &suspects),
                ..readings
            }),
        };
        let in_values = super::in_values(&readings, &suspects);
        let prepared = solver.prepared(&readings, kernel, &suspects);
        let readings = prepared.readings(&readings);
        let accounts = solver.accounts(&readings, prepared.kernel.clone())?;
        let type_b = measurement.details.as_ref().map(|d| &d.type_b);
        let shared = |i: usize| {
            let of = |f: f64| f.max(0.0) + EPSILON;
            let b = type_b.map_or(0.0, |b| luminance(&b[i * width..(i + 1) * width]));
            let share = (b / of(values[i])).ln_1p();
            share.hypot(UNRESOLVED * prepared.doubts[i])
        };
        let chosen = solver.chosen(&readings, super::MOST_SPARSE);
        let shared: Vec<f64> = chosen.into_iter().map(shared).collect();
        let of = |account: Account| {
            let data = solver.data_of(&account, &readings, super::MOST_SPARSE);
            let noise = Noise::estimate(&readings, account.kernel.unsaid);
            (account, data, noise)
        };
        Ok(Self {
            accounts: accounts.into_iter().map(of).collect(),
            space: solver.space,
            suspects: in_values,
            shared,
        })
    }
}

impl Posterior {
    /// The likeliest process given the luminance of a measurement's readings.
    ///
    /// # Errors
    /// If their covariances are singular.
    pub(crate) fn likeliest(
        kriging: &Kriging,
        measurement: &Measurement,
    ) -> Result<Self, ReconstructError> {
        let all = Self::all(kriging, measurement)?.0.into_iter();
        let likeliest = all.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, process)) = likeliest else {
            unreachable!("there is an account of what all materials have in common")
        };
        Ok(process)
    }

    /// A process for each account of the luminance of a measurement's readings, with its share; and the readings that all
    /// others contradict, which are left out.
    ///
    /// # Errors
    /// If their covariances are singular.
    pub fn all(
        kriging: &Kriging,
        measurement: &Measurement,
    ) -> Result<(Shared, Vec<Suspect>), ReconstructError> {
        let explained = Explained::new(kriging, measurement)?;
        let (space, shared) = (explained.space, explained.shared);
        let process = |(account, data, noise): (Account, Data, Noise)| {
            let (share, known) = (account.share, account.known);
            let given = Self::given(Covariance::new(&account.kernel), known, data, space.clone());
            let given = given.ok_or(ReconstructError::Singular {
                method: super::KIND,
                readings: measurement.readings(),
            })?;
            Ok((share, Self { noise, ..given }.sharing(&shared)))
        };
        let all: Result<Vec<_>, ReconstructError> =
            explained.accounts.into_iter().map(process).collect();
        Ok((all?, explained.suspects))
    }

    /// The process without a reading, in no chosen coordinates.
    pub(crate) fn before(symmetry: Symmetry, prior: Option<&Arc<Prior>>) -> Self {
        Self::unread(symmetry, Space::usual(symmetry), prior)
    }

    /// The process without a reading, by the keys of kriging.
    ///
    /// # Errors
    /// If there are no such coordinates or no such prior.
    pub(crate) fn beforehand(
        kriging: &Kriging,
        symmetry: Symmetry,
    ) -> Result<Self, ParameterError> {
        let prior = kriging.prior.as_ref().map(PriorFile::load).transpose()?;
        let space = kriging.solver(symmetry)?.space;
        Ok(Self::unread(symmetry, space, prior.as_ref()))
    }

    fn unread(symmetry: Symmetry, space: Space, prior: Option<&Arc<Prior>>) -> Self {
        let prior = prior.filter(|_| Prior::suits(symmetry)).cloned();
        let kernel = space.kernel();
        let kernel = match &prior {
            Some(prior) => prior.kernel_before(kernel),
            None => kernel,
        };
        let none = Data {
            sites: Sites::new(&[], &space, prior.as_ref().map(|p| p.basis_at(&[]))),
            noise: Vec::new(),
            values: DMatrix::zeros(0, 1),
        };
        let known = prior.map(|prior| Known {
            centre: Centre {
                mean: DMatrix::zeros(none.sites.functions.nrows(), 1),
                spread: DMatrix::zeros(none.sites.functions.nrows(), 0),
            },
            prior,
        });
        let before = Self::given(Covariance::new(&kernel), known, none, space);
        before.unwrap_or_else(|| unreachable!("nothing is not singular"))
    }

    fn given(
        covariance: Covariance,
        known: Option<Known>,
        data: Data,
        space: Space,
    ) -> Option<Self> {
        let factor = covariance.factor(&data)?;
        let mut solved = data.values.clone();
        system::forward(&factor, &mut solved);
        let solved = solved.column(0).into_owned();
        let n = data.sites.len();
        let mut spread = match &known {
            Some(known) => data.sites.functions.tr_mul(&known.centre.spread),
            None => DMatrix::zeros(n, 0),
        };
        system::forward(&factor, &mut spread);
        Some(Self {
            space,
            spread,
            covariance,
            known,
            rows: data.sites.rows(),
            read: vec![true; n],
            data,
            scale: (FREEDOM + solved.norm_squared()) / (FREEDOM + n as f64),
            factor,
            solved,
            noise: Noise::default(),
            shared: (0.0, DVector::zeros(n)),
        })
    }

    /// This posterior with errors of ln f that readings share, which further readings do not average out; one per reading.
    fn sharing(self, errors: &[f64]) -> Self {
        let least = least(errors);
        let mut beyond = DMatrix::from_iterator(errors.len(), 1, errors.iter().map(|e| e - least));
        system::forward(&self.factor, &mut beyond);
        Self {
            shared: (least, beyond.column(0).into_owned()),
            ..self
        }
    }

    /// Errors of ln(f + ε) at places that further readings do not average out.
    pub(crate) fn shared(&self, places: &Places) -> Vec<f64> {
        let (least, beyond) = &self.shared;
        let at = places.solved.column_iter().map(|v| v.dot(beyond));
        at.map(|e| least + e.max(0.0)).collect()
    }

    /// The process as it would be with readings at some pairs more, each as it is expected: variances fall, means and
    /// scale stay. `can_be_read`: false where there were none to be had. `None` if the covariances are singular.
    pub(crate) fn supposing(self, pairs: &[DirectionPair], can_be_read: bool) -> Option<Self> {
        if pairs.is_empty() {
            return Some(self);
        }
        let places = self.places(pairs);
        let means = self.means(&places);
        let (scale, noise, mut read) = (self.scale, self.noise, self.read);
        read.resize(read.len() + pairs.len(), can_be_read);
        let mut data = self.data;
        let off = means.iter().zip(&places.sites.mean).map(|(z, m)| z - m);
        let all: Vec<f64> = data.values.iter().copied().chain(off).collect();
        data.values = DMatrix::from_vec(all.len(), 1, all);
        data.sites = data.sites.and(&places.sites);
        data.noise
            .extend(means.iter().map(|&log| noise.variance(log)));
        let supposed = Self::given(self.covariance, self.known, data, self.space)?;
        Some(Self {
            scale,
            noise,
            read,
            ..supposed
        })
    }

    /// The prior it is about.
    pub(crate) fn prior(&self) -> Option<&Prior> {
        self.known.as_ref().map(|known| &*known.prior)
    }

    /// Variances of ln f by which further readings at places are off.
    pub fn noise(&self, places: &Places) -> Vec<f64> {
        let means = self.means(places).into_iter();
        means.map(|log| self.noise.variance(log)).collect()
    }

    /// Pairs, with what the readings say of them.
    pub(crate) fn places(&self, pairs: &[DirectionPair]) -> Places {
        let known = self.known.as_ref();
        let mut sites = Sites::new(pairs, &self.space, known.map(|k| k.prior.basis_at(pairs)));
        let mut spread = DMatrix::zeros(0, sites.len());
        if let Some(Known { centre, .. }) = known {
            let update = sites.functions.tr_mul(&centre.mean);
            let means = sites.mean.iter_mut().zip(update.iter());
            means.for_each(|(m, t)| *m += t);
            spread = centre.spread.tr_mul(&sites.functions);
        }
        let n = self.data.sites.len();
        let solved = system::by_columns([n, sites.len()], TASK, |of| {
            let mut right = self.covariance.between(&self.rows, &sites, of);
            system::forward(&self.factor, &mut right);
            right
        });
        if n > 0 {
            // What the readings say of a material that is like another shifts with that.
            spread.gemm_tr(-1.0, &self.spread, &solved, 1.0);
        }
        Places {
            sites,
            solved,
            spread,
        }
    }

    /// ln(f + ε) at places.
    pub(crate) fn means(&self, places: &Places) -> Vec<f64> {
        let updates = places.solved.column_iter().map(|v| v.dot(&self.solved));
        updates
            .zip(&places.sites.mean)
            .map(|(t, m)| m + t)
            .collect()
    }

    /// Variances of ln(f + ε) at places, without the scale.
    pub(crate) fn variances(&self, places: &Places) -> Vec<f64> {
        let before = self.covariance.variances(&places.sites).into_iter();
        let squares = places.solved.column_iter().map(|v| v.norm_squared());
        let spread = places.spread.column_iter().map(|v| v.norm_squared());
        let left = before.zip(squares).zip(spread);
        left.map(|((v, s), more)| (v - s).max(0.0) + more).collect()
    }

    /// Variances at places once there are readings at others too, without the scale; `None` if these are singular.
    #[cfg(test)]
    pub(crate) fn variances_with(&self, places: &Places, read: &Places) -> Option<Vec<f64>> {
        self.lowered(&self.variances(places), places, read)
    }

    /// The variances at places, as readings at others lower them; `None` if these are singular.
    fn lowered(&self, variances: &[f64], places: &Places, read: &Places) -> Option<Vec<f64>> {
        if read.sites.len() == 0 {
            return Some(variances.to_vec());
        }
        let projected = self.projected(read, self.covariances(read, places))?;
        let less = projected.column_iter().map(|t| t.norm_squared());
        let both = variances.iter().zip(less);
        Some(both.map(|(v, l)| (v - l).max(0.0)).collect())
    }

    /// Variances of sums of ln(f + ε) over places, a column of weights for each, without the scale, once there are readings at
    /// pairs too; `None` if these are singular.
    pub(crate) fn variances_of_sums(
        &self,
        places: &Places,
        weights: &DMatrix<f64>,
        read: &[DirectionPair],
    ) -> Option<Vec<f64>> {
        let weighted = self.covariances(places, places) * weights;
        let both = weights.column_iter().zip(weighted.column_iter());
        let before = both.map(|(own, of)| own.dot(&of));
        if read.is_empty() {
            return Some(before.map(|v| v.max(0.0)).collect());
        }
        let read = self.places(read);
        let projected = self.projected(&read, self.covariances(&read, places) * weights)?;
        let less = projected.column_iter().map(|t| t.norm_squared());
        Some(before.zip(less).map(|(v, l)| (v - l).max(0.0)).collect())
    }

    /// Covariances with readings at places, a row for each, times the inverse of the factor of those of the readings; `None` if these are singular.
    fn projected(&self, read: &Places, mut with: DMatrix<f64>) -> Option<DMatrix<f64>> {
        let mut own = self.covariances(read, read);
        for (i, noise) in self.noise(read).into_iter().enumerate() {
            own[(i, i)] += noise;
        }
        system::factored(&mut own).then(|| system::forward(&own, &mut with))?;
        Some(with)
    }

    /// Covariances of ln(f + ε) between two lists, without the scale: a column per place of the second.
    pub(crate) fn covariances(&self, of: &Places, with: &Places) -> DMatrix<f64> {
        let size = [of.sites.len(), with.sites.len()];
        let rows = of.sites.rows();
        // For one column the transpose would cost more than the product.
        let across = (with.sites.len() > 1).then(|| of.solved.transpose());
        let spread = of.spread.transpose();
        system::by_columns(size, TASK, |chosen| {
            let known = with.solved.columns(chosen.start, chosen.len());
            let more = with.spread.columns(chosen.start, chosen.len());
            let mut values = self.covariance.between(&rows, &with.sites, chosen);
            values.gemm(1.0, &spread, &more, 1.0);
            match &across {
                Some(across) => values.gemm(-1.0, across, &known, 1.0),
                None => values -= of.solved.tr_mul(&known),
            }
            values
        })
    }

    /// Squares of the errors of each reading as it is predicted from all others, in units of their variance: 1 on
    /// average if the kernel suits the material.
    fn left_out(&self) -> Vec<f64> {
        let n = self.data.sites.len();
        let mut inverse = DMatrix::identity(n, n);
        system::forward(&self.factor, &mut inverse);
        // A row of K⁻¹ is one of L⁻ᵀ times L⁻¹.
        let square = |column: DVectorView<'_, f64>| {
            column.dot(&self.solved).powi(2) / (column.norm_squared() * self.scale)
        };
        inverse.column_iter().map(square).collect()
    }

    /// The mean of those squares of the readings near each place.
    pub(crate) fn surprise(&self, places: &Places) -> Vec<f64> {
        let squares = self.left_out();
        let near = |x: &Columns| {
            let [mut sum, mut weights] = [0.0, 1e-300];
            for ((weight, square), _) in self.near(x).zip(&squares).zip(&self.read).filter(|r| *r.1)
            {
                sum += weight * square;
                weights += weight;
            }
            // Readings that are no surprise at all leave something to be known.
            (sum / weights).max(LEAST_SURPRISE)
        };
        places.sites.columns.par_iter().map(near).collect()
    }

    /// How likely there is a reading to be had at each place: the share of those near, and of one besides.
    pub(crate) fn readable(&self, places: &Places) -> Vec<f64> {
        if self.read.iter().all(|read| *read) {
            return vec![1.0; places.sites.len()];
        }
        let share = |x: &Columns| {
            let [mut read, mut all] = [1.0, 1.0];
            for (weight, is_read) in self.near(x).zip(&self.read) {
                all += weight;
                read += if *is_read { weight } else { 0.0 };
            }
            read / all
        };
        places.sites.columns.par_iter().map(share).collect()
    }

    /// The weights of all rows of the data near a place: 1 where they are at it.
    fn near(&self, x: &Columns) -> impl Iterator<Item = f64> {
        let read = self.read.iter().filter(|read| **read).count();
        let (rows, near) = (self.data.sites.columns.iter(), system::nearness(read));
        rows.map(move |row| near(x, row))
    }
}

/// Noise of further readings, from those there are: of f a share of it, and a floor (sr⁻¹).
#[derive(Clone, Copy, Default)]
struct Noise {
    relative: f64,
    floor: f64,
}

impl Noise {
    /// The floor is the least uncertainty of the readings; what the share explains is the rest, in the median. `unsaid` is the variance of
    /// ln f of readings that state none.
    fn estimate(readings: &Readings<'_>, unsaid: f64) -> Self {
        let Some(uncertainties) = readings.noise else {
            return Self {
                relative: unsaid.sqrt(),
                floor: 0.0,
            };
        };
        let all = (0..readings.present.len()).filter(|&i| readings.present[i]);
        let all: Vec<[f64; 2]> = all
            .map(|i| [readings.values[i].max(0.0), uncertainties[i]])
            .collect();
        let floor = all.iter().map(|[_, u]| *u).fold(f64::INFINITY, f64::min);
        let rest = |[f, u]: &[f64; 2]| (u * u - floor * floor).max(0.0).sqrt() / (f + EPSILON);
        let mut shares: Vec<f64> = all.iter().map(rest).collect();
        let median = upper_median(&mut shares).unwrap_or(0.0);
        Self {
            relative: median.hypot(unsaid.sqrt()),
            floor: if floor.is_finite() { floor } else { 0.0 },
        }
    }

    /// The variance of ln(f + ε), where that is `log`.
    fn variance(&self, log: f64) -> f64 {
        let f = log.exp();
        NUGGET + self.relative.powi(2) + (self.floor / f.max(EPSILON)).powi(2)
    }
}

#[cfg(test)]
mod tests;
