//! Kriging: ln(f + ε) as a Gaussian process whose covariance is a sum of functions of a few columns of a
//! pair each ([`kernel`]), with hyper-parameters that were fitted to the MERL database.
//!
//! The mean is a constant that the readings determine; readings have the variance of their noise, and one that no column
//! explains, by which they are missed: half a percent. Amplitudes and lengths are fitted again to the readings of a
//! material, near those of the database ([`fit`]), unless these lie in sheets or lines: then columns vary together,
//! and a fit takes the trend along one for that along another. All of it is reciprocal.
//!
//! A [`Prior`] holds statistics of many materials: the mean of ln f is theirs then, most of what a material differs by
//! is a sum of some functions of a pair, and the terms above are for the rest. What is made of the readings with it and
//! without are weighed by how likely either makes them, and the prior counts less the more readings there are, up to 32;
//! below a share of a hundredth it is left out.
//!
//! Readings that all others contradict are left out ([`outliers`]; of at most 2000), and those over finite apertures are divided by
//! what these make of them ([`apertures`]; of more than 2000 as the process of so many of them does).
//!
//! With `coordinates` the columns are those of a parametrization and its warps ([`space`]), and the constants those that make 61 materials
//! likeliest ([`trained`], [`kernel_training`]).
//!
//! More than 10 000 readings are approximated: 4000 of them, at random, determine the process everywhere, given all others
//! ([`sparse`]). How certain it is at a pair follows of more than 2000 readings from 256 of them (`posterior/local.rs`).
//!
//! Readings in the plane of incidence alone say nothing of φ_d. It then continues by the kernel of other materials,
//! which for Oren and Nayar's errs at most 2.5 times as much as the nearest reading does, in spherical coordinates 4 times
//! (`tests/reconstruction/layouts.rs`).

mod apertures;
mod common;
mod fit;
mod kernel;
mod kernel_training;
mod left_out;
mod line;
mod outliers;
mod posterior;
mod prior;
mod process;
mod space;
mod sparse;
mod system;
mod trained;

pub use common::{forget_searches, suspects};
pub use kernel_training::KernelTraining;
pub(crate) use posterior::{Estimates, LocalPosterior, Mixture, Places, Posterior};
pub(super) use prior::Mean;
pub use prior::{FUNCTIONS, NODES, Prior, PriorFile, TrainError, Trained, Training};
pub(crate) use sparse::some;
pub use trained::Kernels;

use super::interpolant::{Interpolant, Readings};
use super::sheets::are_in_plane;
use super::transform::{EPSILON, LOG, Values};
use super::{
    Coordinates, LeftOut, Predicted, Predictive, Reconstruct, ReconstructError, Suspect, admit,
};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::registry::declare;
use kernel::Kernel;
use left_out::Missed;
use nalgebra::DMatrix;
use prior::Centre;
use process::{Part, Process};
use space::Space;
use std::sync::Arc;
use system::{Data, Likelihood, NUGGET, Sites};

declare! {
    dyn Reconstruct, "kriging": "Gaussian process of ln f with a kernel fitted to many materials; at most 100 000 readings", [
        "",
        "prior = \"built-in\"",
        "fit = false",
        "noise = false",
        "fit = false\nnoise = false",
        "fit = false\nnoise = false\nprior = \"built-in\"",
        "coordinates = { kind = \"hybrid\", warp = { h_bar = \"square-root\" } }",
    ]
    /// Kriging, as a config writes it.
    pub struct Kriging {
        /// True to fit amplitudes and lengths of the kernel to the first channel of the readings, where these fill space.
        fit: bool = true;
        /// True to miss readings by their uncertainty of type A, where they have one.
        noise: bool = true;
        /// True to leave out those of 33 to 2000 readings that all others contradict.
        robust: bool = true;
        /// What is known beforehand: `built-in` (materials of formulas), or a file of `gonio train`.
        prior: Option<PriorFile> = None;
        /// Coordinates of the kernel; by default columns of half/difference ones.
        coordinates: Option<Coordinates> = None;
    }
}

/// Readings to which a kernel is fitted, at most: spread evenly over all.
const FITTED: usize = 300;

/// Readings up to which a prior is of use: they say more themselves then.
pub const TRUSTED: usize = 32;

/// The share of a prior from which on it is left out.
const LEFT_OUT: f64 = 0.01;

/// Readings that are compared with what all others predict, at most: seconds of work.
pub(crate) const MOST_COMPARED: usize = 2000;

/// Variance of ln f of a reading that is to predict nothing.
const WORTHLESS: f64 = 1e6;

/// Readings of one system, at most: its matrix then has 800 MB. More are approximated ([`sparse`]).
const MOST: usize = 10_000;

/// Readings that are approximated, at most: a minute's work.
pub(crate) const MOST_SPARSE: usize = 100_000;

impl Kriging {
    /// This method for a material of such symmetries.
    ///
    /// # Errors
    /// If its coordinates do not exist.
    fn solver(&self, symmetry: Symmetry) -> Result<Solver<'_>, ParameterError> {
        let space = Space::new(symmetry, self.coordinates.as_ref())?;
        Ok(Solver { keys: self, space })
    }
}

/// Kriging of a material.
struct Solver<'a> {
    keys: &'a Kriging,
    space: Space,
}

impl Solver<'_> {
    /// Numbers of at most so many readings, spread evenly over all.
    fn chosen(&self, r: &Readings<'_>, most: usize) -> Vec<usize> {
        let all = (0..r.present.len()).filter(|&i| r.present[i]);
        match r.count() {
            ..=MOST => all.step_by(r.count().div_ceil(most).max(1)).collect(),
            // Steps as long as the rows of a grid would miss what is along them.
            count => {
                let all: Vec<usize> = all.collect();
                let some = sparse::some(count, most).into_iter();
                some.map(|k| all[k]).collect()
            }
        }
    }

    /// The pairs of at most so many readings.
    fn pairs(&self, r: &Readings<'_>, most: usize) -> Vec<DirectionPair> {
        let chosen = self.chosen(r, most).into_iter();
        chosen.map(|i| r.schedule.poses[i].pair).collect()
    }

    /// The readings as a system, at most so many of them, and of their values the first `width`.
    fn data(&self, r: &Readings<'_>, most: usize, width: usize, prior: Option<&Prior>) -> Data {
        let chosen = self.chosen(r, most);
        let pairs = self.pairs(r, most);
        let noise = |&i: &usize| {
            let of_first = r
                .noise
                .filter(|_| self.keys.noise)
                .map_or(0.0, |u| u[i * r.width]);
            let relative = of_first / (r.values[i * r.width].max(0.0) + EPSILON);
            NUGGET + relative * relative
        };
        let sites = Sites::new(&pairs, &self.space, prior.map(|p| p.basis_at(&pairs)));
        let value =
            |k: usize, c: usize| LOG.forward(r.values[chosen[k] * r.width + c]) - sites.mean[k];
        Data {
            values: DMatrix::from_fn(chosen.len(), width, value),
            noise: chosen.iter().map(noise).collect(),
            sites,
        }
    }

    /// The readings as the system of an account, at most so many of them.
    fn data_of(&self, account: &Account, r: &Readings<'_>, most: usize) -> Data {
        let known = account.known.as_ref();
        let data = self.data(r, most, r.width, known.map(|known| &*known.prior));
        let mut data = data.noisier(account.kernel.unsaid);
        if let Some(known) = known {
            data.centre(&known.centre.mean);
        }
        data
    }

    /// True if a kernel is fitted to the readings. In the plane of incidence φ_d is one value: nothing can be left out that a fit
    /// along it would miss.
    fn fits(&self, r: &Readings<'_>) -> bool {
        self.keys.fit && !are_in_plane(&self.pairs(r, FITTED))
    }

    /// The kernel of what all materials have in common, fitted if it is to be.
    fn fitted(&self, r: &Readings<'_>) -> Kernel {
        let published = self.space.kernel();
        match self.fits(r) {
            true => {
                let data = self.data(r, FITTED, 1, None);
                fit::better(&published, &data, &self.pairs(r, FITTED), self.unsaid(r))
            }
            false => published,
        }
    }

    /// True if the noise of readings is fitted, since most state none: a few that were repeated say nothing of the others. Few
    /// readings do not separate noise from detail.
    fn unsaid(&self, r: &Readings<'_>) -> bool {
        let states = |&i: &usize| {
            let noise = r.noise.map(|u| &u[i * r.width..(i + 1) * r.width]);
            r.present[i] && noise.is_some_and(|u| u.iter().any(|&u| u > 0.0))
        };
        let stated = (0..r.present.len()).filter(states).count();
        self.keys.noise && 2 * stated < r.count() && r.count() > TRUSTED
    }

    /// What kriging makes of readings before it reconstructs them.
    fn prepared(
        &self,
        r: &Readings<'_>,
        kernel: Kernel,
        suspects: &[outliers::Suspect],
    ) -> Prepared {
        let mut prepared = Prepared {
            present: without(r, suspects),
            kernel,
            values: None,
            doubts: vec![0.0; r.present.len()],
        };
        if r.half_angles_deg == [0.0; 2] {
            return prepared;
        }
        let half_angles = r.half_angles_deg.map(f64::to_radians);
        let sharp = prepared.readings(r);
        let data = self.data(&sharp, MOST_COMPARED, r.width, None);
        let data = data.noisier(prepared.kernel.unsaid);
        let rows = self.chosen(&sharp, MOST_COMPARED);
        let pairs = self.pairs(&sharp, MOST_COMPARED);
        // Of more readings the others are divided by what the process of these makes of them.
        let mut is_one = vec![false; r.present.len()];
        rows.iter().for_each(|&row| is_one[row] = true);
        let others = (0..r.present.len()).filter(|&i| sharp.present[i] && !is_one[i]);
        let others: Vec<usize> = others.collect();
        let further: Vec<DirectionPair> =
            others.iter().map(|&i| r.schedule.poses[i].pair).collect();
        let kernel = &prepared.kernel;
        let ratios =
            apertures::log_ratios(&data, &pairs, &further, &self.space, kernel, half_angles);
        let Some(ratios) = ratios else {
            return prepared;
        };
        let mut values = r.values.to_vec();
        for (rows, ratios) in [rows, others].iter().zip(&ratios) {
            for (k, &row) in rows.iter().enumerate() {
                for c in 0..r.width {
                    let value = &mut values[row * r.width + c];
                    *value = LOG.inverse(LOG.forward(*value) - ratios[(k, c)]);
                }
                prepared.doubts[row] = ratios.row(k).amax();
            }
        }
        prepared.values = Some(values);
        prepared.kernel = self.fitted(&prepared.readings(r));
        prepared
    }

    /// What explains the readings, with kernels that are fitted to their first value if they are to be and fill space:
    /// what all materials have in common, and a prior as far as the readings are likelier with it.
    fn accounts(&self, r: &Readings<'_>, common: Kernel) -> Result<Vec<Account>, ReconstructError> {
        let prior = self.keys.prior.as_ref().filter(|_| applies(r));
        let prior = prior.map(PriorFile::load).transpose()?;
        let fits = self.fits(r);
        let Some(prior) = prior else {
            return Ok(vec![Account::single(common)]);
        };
        let mut kernel = prior.kernel(self.space.kernel());
        let about = self.data(r, MOST, r.width, Some(&prior));
        let centred = |kernel: &Kernel| prior.centred(kernel, &about);
        let (centre, _) = centred(&kernel).ok_or_else(|| singular(r))?;
        if fits {
            let mut first = self.data(r, MOST, 1, Some(&prior));
            first.centre(&centre.mean.columns(0, 1).into_owned());
            kernel = fit::better(&kernel, &first, &self.pairs(r, MOST), false);
        }
        let all = self.data(r, MOST, r.width, None);
        let (Some((centre, with)), Some(Likelihood { loss: without, .. })) =
            (centred(&kernel), all.likelihood(&common))
        else {
            return Ok(vec![Account::single(common)]);
        };
        // The weight of a prior falls with the number of readings.
        let faded = 1.0 - (r.count() as f64 / (TRUSTED + 1) as f64).powi(2);
        let share = faded / (1.0 + (with - without).exp());
        if share < LEFT_OUT {
            return Ok(vec![Account::single(common)]);
        }
        let known = Known { prior, centre };
        Ok(vec![
            Account {
                share,
                kernel,
                known: Some(known),
            },
            Account {
                share: 1.0 - share,
                ..Account::single(common)
            },
        ])
    }
}

/// Readings in the form that they are reconstructed in.
struct Prepared {
    /// One flag per pose: true if it has a reading that counts.
    present: Vec<bool>,
    /// What all materials have in common, fitted to the readings.
    kernel: Kernel,
    /// Values in single directions, where readings are means over apertures.
    values: Option<Vec<f64>>,
    /// By how much ln f of each reading in its direction differs from that of the mean, in absolute value.
    doubts: Vec<f64>,
}

impl Prepared {
    /// The readings, with the values and flags of these.
    fn readings<'a>(&'a self, r: &Readings<'a>) -> Readings<'a> {
        Readings {
            present: &self.present,
            values: self.values.as_deref().unwrap_or(r.values),
            ..*r
        }
    }
}

/// One flag per pose: true if it has a reading that is none of the suspects.
fn without(r: &Readings<'_>, suspects: &[outliers::Suspect]) -> Vec<bool> {
    let mut present = r.present.to_vec();
    suspects.iter().for_each(|s| present[s.row] = false);
    present
}

/// Suspects in units of f, of the first value of readings.
fn in_values(r: &Readings<'_>, suspects: &[outliers::Suspect]) -> Vec<Suspect> {
    let in_value = |s: &outliers::Suspect| {
        let value = r.values[s.row * r.width];
        let expected = LOG.forward(value) - s.off;
        Suspect {
            pose: s.row,
            value,
            expected: LOG.inverse(expected),
            uncertainty: expected.exp() * s.deviation,
        }
    };
    suspects.iter().map(in_value).collect()
}

/// True if there are so few readings, of a material of such symmetries, that a prior is of use.
fn applies(r: &Readings<'_>) -> bool {
    Prior::suits(symmetry(r)) && r.count() <= TRUSTED
}

/// What explains readings.
struct Account {
    /// How much it counts; all together 1.
    share: f64,
    kernel: Kernel,
    known: Option<Known>,
}

impl Account {
    /// The only one.
    fn single(kernel: Kernel) -> Self {
        Self {
            share: 1.0,
            kernel,
            known: None,
        }
    }
}

fn singular(r: &Readings<'_>) -> ReconstructError {
    ReconstructError::Singular {
        method: KIND,
        readings: r.count(),
    }
}

/// A prior, and what readings say of the coefficients of its functions.
#[derive(Clone)]
struct Known {
    prior: Arc<Prior>,
    centre: Centre,
}

fn symmetry(r: &Readings<'_>) -> Symmetry {
    r.schedule.parametrization.symmetry()
}

impl Reconstruct for Kriging {
    fn label(&self) -> String {
        let mut label = super::label(KIND, Values::Log, false, self.coordinates.as_ref());
        for (given, name) in [
            (self.fit, "-published"),
            (self.noise, "-exact"),
            (self.robust, "-non-robust"),
        ] {
            if !given {
                label.push_str(name);
            }
        }
        if self.prior.is_some() {
            label.push_str("-prior");
        }
        label
    }

    chooses_coordinates!();

    fn prior(&self) -> Option<&PriorFile> {
        self.prior.as_ref()
    }

    fn weighs_readings(&self) -> bool {
        self.fit || self.noise || self.prior.is_some()
    }

    // The search for a kernel takes a part of the readings, the system of equations up to 2000 of them.
    fn fit_seconds(&self, readings: usize) -> f64 {
        let n = readings as f64;
        let search = if self.fit {
            3e-6 * n.min(400.0).powi(2)
        } else {
            0.0
        };
        search + 3e-10 * n.min(2000.0).powi(3)
    }

    // A sum over all readings.
    fn value_seconds(&self, readings: usize) -> f64 {
        5e-8 * readings as f64
    }

    fn takes_those_of_schedules(&self) -> bool {
        false
    }

    fn check(&self) -> Result<(), ParameterError> {
        Space::new(Symmetry::FULL, self.coordinates.as_ref())?;
        self.prior
            .iter()
            .try_for_each(|prior| prior.load().map(drop))
    }

    fn predictive(
        &self,
        measurement: &Measurement,
    ) -> Result<Option<Box<dyn Predictive>>, ReconstructError> {
        Ok(Some(Box::new(Mixture::new(self, measurement)?)))
    }

    fn leave_out(
        &self,
        r: &Readings<'_>,
        sets: &[LeftOut],
    ) -> Result<Option<Vec<Predicted>>, ReconstructError> {
        if self.prior.is_some() || r.count() > MOST_COMPARED {
            return Ok(None);
        }
        let solver = self.solver(symmetry(r))?;
        let (kernel, suspects) = solver.common(r);
        let prepared = solver.prepared(r, kernel, &suspects);
        let values = prepared.values.as_deref().unwrap_or(r.values);
        let r = &Readings { values, ..*r };
        let mut data = solver.data(r, MOST_COMPARED, r.width, None);
        data = data.noisier(prepared.kernel.unsaid);
        let rows = solver.chosen(r, MOST_COMPARED);
        let mut number = vec![usize::MAX; r.present.len()];
        rows.iter()
            .enumerate()
            .for_each(|(k, &row)| number[row] = k);
        // Suspects predict nothing, and are predicted.
        suspects
            .iter()
            .for_each(|s| data.noise[number[s.row]] = WORTHLESS);
        let left = |set: &LeftOut| {
            let of = 0..rows.len();
            of.filter(|&k| !set.present[rows[k]]).collect::<Vec<_>>()
        };
        let groups: Vec<Vec<usize>> = sets.iter().map(left).collect();
        let missed = data.missed(&prepared.kernel, &groups);
        let missed = missed.ok_or_else(|| singular(r))?;
        let predicted = |((set, group), missed): ((&LeftOut, &Vec<usize>), &Missed)| {
            let mut predicted = Predicted {
                values: Vec::new(),
                variances: Vec::new(),
            };
            for &pose in &set.poses {
                let k = number[pose];
                // Groups are in the order of rows.
                let at = group.partition_point(|&row| row < k);
                predicted.values.extend((0..r.width).map(|c| {
                    let z = data.values[(k, c)] - missed.off[(at, c)];
                    LOG.inverse(z + data.sites.mean[k])
                }));
                let variance = missed.variances[at] - missed.scale * data.noise[k];
                predicted.variances.push(variance.max(0.0));
            }
            predicted
        };
        let all = sets.iter().zip(&groups).zip(&missed);
        Ok(Some(all.map(predicted).collect()))
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        admit(KIND, r.count(), MOST_SPARSE)?;
        let solver = self.solver(symmetry(r))?;
        let (kernel, suspects) = solver.common(r);
        let readings = solver.prepared(r, kernel, &suspects);
        let r = &readings.readings(r);
        let accounts = solver.accounts(r, readings.kernel.clone())?;
        let left_out = accounts.iter().all(|account| account.known.is_none());
        let contradicts = self.prior.is_some() && applies(r) && left_out;
        let mut parts = Vec::new();
        for account in accounts {
            let data = solver.data_of(&account, r, MOST_SPARSE);
            let solved = match data.sites.len() {
                ..=MOST => data
                    .solve(&account.kernel)
                    .map(|solved| (data.sites, solved)),
                readings => {
                    let telling = sparse::some(readings, sparse::TELLING);
                    sparse::solve(&data, &account.kernel, &telling)
                }
            };
            let (sites, solved) = solved.ok_or_else(|| singular(r))?;
            parts.push(Part::new(&account, &sites, &solved));
        }
        Ok(Box::new(Process {
            parts,
            contradicts,
            left_out: suspects.len(),
            blurred: readings.doubts.iter().copied().fold(0.0, f64::max),
            space: solver.space,
        }))
    }
}
