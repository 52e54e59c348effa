//! The process given readings: ln(f + ε) at pairs, and how certain it is.

use super::Kriging;
use super::kernel::{self, Block, Columns, Flat, Kernel};
use super::system::{self, Data, FREEDOM, LEVEL, MEAN, NUGGET};
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::reconstruct::interpolant::{Readings, noise, present};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// ln(f + ε) of one value per pair as a Gaussian process: its level has a variance too, so that it is defined
/// without a single reading.
pub(crate) struct Posterior {
    symmetry: Symmetry,
    terms: Vec<Flat>,
    readings: Vec<Columns>,
    blocks: Vec<Block>,
    /// Cholesky's factor of the covariances of the readings, and these times ln(f + ε) less its mean.
    factor: DMatrix<f64>,
    weights: DMatrix<f64>,
    /// What all variances are to be multiplied by, from how well the readings suit the kernel.
    scale: f64,
    /// Variance of ln f by which a further reading is off, besides.
    noise: f64,
}

/// Pairs in the form that the process takes.
pub(crate) struct Places {
    columns: Vec<Columns>,
    /// The factor's inverse times the covariances of the readings with each pair: a column per pair.
    solved: DMatrix<f64>,
}

/// Pairs of a task.
const TASK: usize = 128;

impl Places {
    /// The place with this number.
    pub fn only(&self, i: usize) -> Self {
        Self {
            columns: vec![self.columns[i]],
            solved: self.solved.columns(i, 1).into_owned(),
        }
    }
}

/// Widths over which surprises at 64 readings are averaged, with the columns they are along.
const WIDTHS: [(usize, f64); 3] = [(kernel::U1, 0.15), (kernel::U2, 0.3), (kernel::U3, 0.4)];

impl Posterior {
    /// The process given the luminance of a measurement's readings, with a kernel that is fitted to them; `None` if
    /// their covariances are singular.
    pub fn of(measurement: &Measurement) -> Option<Self> {
        let channels = &measurement.channels;
        let width = channels.count();
        let luminance = |values: &[f64]| channels.luminance(values);
        let values: Vec<f64> = measurement.values.chunks(width).map(luminance).collect();
        // Of the channels together: they are read at once, with the noise of one.
        let type_a = noise(measurement);
        let type_a: Option<Vec<f64>> = type_a.map(|u| u.chunks(width).map(luminance).collect());
        let present = present(measurement);
        let readings = Readings {
            schedule: &measurement.schedule,
            width: 1,
            values: &values,
            present: &present,
            noise: type_a.as_deref(),
        };
        let kriging = Kriging::default();
        let kernel = kriging.kernel(&readings).ok()?;
        let symmetry = measurement.schedule.parametrization.symmetry();
        Self::given(&kernel, kriging.data(&readings, 1, 1), symmetry)
    }

    /// The process without a reading.
    pub fn prior(symmetry: Symmetry) -> Self {
        let kernel = Kernel::new(symmetry);
        let none = Data {
            columns: Vec::new(),
            noise: Vec::new(),
            values: DMatrix::zeros(0, 1),
        };
        let empty = DMatrix::zeros(0, 0);
        Self::with(&kernel, none, symmetry, empty, DMatrix::zeros(0, 1))
    }

    fn given(kernel: &Kernel, data: Data, symmetry: Symmetry) -> Option<Self> {
        let factor = system::factor(&kernel.flat(), &data, LEVEL)?;
        let mut weights = data.values.clone();
        system::back(&factor, &mut weights)?;
        Some(Self::with(kernel, data, symmetry, factor, weights))
    }

    fn with(
        kernel: &Kernel,
        data: Data,
        symmetry: Symmetry,
        factor: DMatrix<f64>,
        weights: DMatrix<f64>,
    ) -> Self {
        let square = data.values.dot(&weights);
        let n = data.columns.len() as f64;
        let noise = data.noise.iter().sum::<f64>() / n;
        Self {
            noise: if n > 0.0 { noise } else { NUGGET },
            symmetry,
            terms: kernel.flat(),
            blocks: kernel::blocks(&data.columns),
            readings: data.columns,
            factor,
            weights,
            scale: (FREEDOM + square) / (FREEDOM + n),
        }
    }

    /// What all variances are to be multiplied by.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Variance of ln f by which a further reading is off.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// Pairs, with what the readings say of them.
    pub fn places(&self, pairs: &[DirectionPair]) -> Places {
        let columns = kernel::columns(pairs, self.symmetry);
        let n = self.readings.len();
        let mut solved = DMatrix::zeros(n, columns.len());
        if n > 0 {
            let tasks = solved.as_mut_slice().par_chunks_mut(n * TASK);
            tasks
                .zip(columns.par_chunks(TASK))
                .for_each(|(out, columns)| {
                    system::fill(&self.terms, columns, &self.blocks, n, out);
                    let mut right = DMatrix::from_column_slice(n, columns.len(), out);
                    right.add_scalar_mut(LEVEL);
                    system::forward(&self.factor, &mut right);
                    out.copy_from_slice(right.as_slice());
                });
        }
        Places { columns, solved }
    }

    /// ln(f + ε) at places.
    pub fn means(&self, places: &Places) -> Vec<f64> {
        // K⁻¹ y = L⁻ᵀ (L⁻¹ y): the columns are solved by L already.
        let mut right = self.weights.clone();
        if right.nrows() > 0 {
            right = self.factor.lower_triangle().tr_mul(&right);
        }
        let means = places.solved.column_iter();
        means.map(|v| MEAN + v.dot(&right.column(0))).collect()
    }

    /// Variances of ln(f + ε) at places, without the scale.
    pub fn variances(&self, places: &Places) -> Vec<f64> {
        let prior = LEVEL + self.terms.iter().map(|t| t.amplitude).sum::<f64>();
        let squares = places.solved.column_iter().map(|v| v.norm_squared());
        squares.map(|s| (prior - s).max(0.0)).collect()
    }

    /// Variances at places once there are readings at others too, without the scale; `None` if these are singular.
    pub fn variances_with(&self, places: &Places, read: &Places) -> Option<Vec<f64>> {
        let mut own = self.covariances(read, read);
        for i in 0..own.nrows() {
            own[(i, i)] += self.noise;
        }
        let mut told = self.covariances(read, places);
        if !system::factored(&mut own) {
            return None;
        }
        system::forward(&own, &mut told);
        let before = self.variances(places).into_iter();
        let less = told.column_iter().map(|t| t.norm_squared());
        Some(before.zip(less).map(|(v, l)| (v - l).max(0.0)).collect())
    }

    /// Covariances of ln(f + ε) between two lists, without the scale: a column per place of the second.
    pub fn covariances(&self, of: &Places, with: &Places) -> DMatrix<f64> {
        let (rows, n) = (of.columns.len(), self.readings.len());
        let mut out = DMatrix::zeros(rows, with.columns.len());
        if rows == 0 {
            return out;
        }
        let blocks = kernel::blocks(&of.columns);
        let tasks = out.as_mut_slice().par_chunks_mut(rows * TASK).enumerate();
        tasks.for_each(|(task, out)| {
            let first = task * TASK;
            let columns = &with.columns[first..with.columns.len().min(first + TASK)];
            system::fill(&self.terms, columns, &blocks, rows, out);
            let mut values = DMatrix::from_column_slice(rows, columns.len(), out);
            values.add_scalar_mut(LEVEL);
            if n > 0 {
                let known = with.solved.columns(first, columns.len());
                values.gemm(-1.0, &of.solved.transpose(), &known, 1.0);
            }
            out.copy_from_slice(values.as_slice());
        });
        out
    }

    /// Squares of the errors of each reading as it is predicted from all others, in units of their variance: 1 on
    /// average if the kernel suits the material.
    fn left_out(&self) -> Vec<f64> {
        let n = self.readings.len();
        let mut inverse = DMatrix::identity(n, n);
        system::forward(&self.factor, &mut inverse);
        let all = self.weights.iter().zip(inverse.column_iter());
        let of = all.map(|(weight, column)| weight * weight / (column.norm_squared() * self.scale));
        of.collect()
    }

    /// The mean of those squares of the readings near each place.
    pub fn surprise(&self, places: &Places) -> Vec<f64> {
        let squares = self.left_out();
        let n = self.readings.len() as f64;
        let narrower = (64.0 / n).powf(1.0 / 6.0);
        let near = |x: &Columns| {
            let [mut sum, mut weights] = [0.0, 1e-300];
            for (reading, square) in self.readings.iter().zip(&squares) {
                let off = WIDTHS.map(|(c, w)| (x[c] - reading[c]) / (w * narrower));
                let weight = (-0.5 * off.iter().map(|d| d * d).sum::<f64>()).exp();
                sum += weight * square;
                weights += weight;
            }
            sum / weights
        };
        places.columns.par_iter().map(near).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Random, cosine_hemisphere};

    fn pairs(first: u64, n: usize) -> Vec<DirectionPair> {
        let random = Random::new(5);
        let pair = |i: u64| {
            let u: [f64; 4] = random.point(i);
            DirectionPair::new(
                cosine_hemisphere([u[0], u[1]]),
                cosine_hemisphere([u[2], u[3]]),
            )
        };
        (first..first + n as u64).map(pair).collect()
    }

    fn data(pairs: &[DirectionPair]) -> Data {
        let n = pairs.len();
        Data {
            columns: kernel::columns(pairs, Symmetry::FULL),
            // Enough for an inverse to keep nine digits.
            noise: (0..n).map(|i| 0.01 * (1 + i % 3) as f64).collect(),
            values: DMatrix::from_fn(n, 1, |i, _| (i as f64 * 0.7).sin()),
        }
    }

    /// The process of some readings, and the covariance of two lists by the formula.
    fn process(
        read: &[DirectionPair],
    ) -> (
        Posterior,
        impl Fn(&[DirectionPair], &[DirectionPair]) -> DMatrix<f64>,
    ) {
        let kernel = Kernel::new(Symmetry::FULL);
        let process = Posterior::given(&kernel, data(read), Symmetry::FULL).unwrap();
        let by_formula = move |a: &[DirectionPair], b: &[DirectionPair]| {
            let [a, b] = [a, b].map(|list| kernel::columns(list, Symmetry::FULL));
            DMatrix::from_fn(a.len(), b.len(), |i, j| {
                let of = |t: &kernel::Term| {
                    let off = t.lengths.iter().map(|(c, l)| (a[i][*c] - b[j][*c]) / l);
                    let r = (3.0 * off.map(|d| d * d).sum::<f64>()).sqrt();
                    t.amplitude * (1.0 + r) * (-r).exp()
                };
                LEVEL + kernel.terms.iter().map(of).sum::<f64>()
            })
        };
        (process, by_formula)
    }

    #[test]
    fn means_and_covariances_are_those_of_the_textbook() {
        // Rasmussen & Williams 2006, (2.23) and (2.24), by an inverse.
        for n in [1, 7, 100, 200] {
            let (read, at) = (pairs(0, n), pairs(1000, 150));
            let (process, k) = process(&read);
            let mut of_readings = k(&read, &read);
            for (i, noise) in data(&read).noise.iter().enumerate() {
                of_readings[(i, i)] += noise;
            }
            let inverse = of_readings.try_inverse().unwrap();
            let with = k(&at, &read);
            let means = &with * &inverse * data(&read).values;
            let covariances = k(&at, &at) - &with * &inverse * with.transpose();
            let places = process.places(&at);
            let found = process.covariances(&places, &places);
            assert!((&found - &covariances).amax() < 1e-7, "{n}");
            let off = process.means(&places).into_iter().zip(means.iter());
            assert!(off.map(|(a, b)| (a - MEAN - b).abs()).fold(0.0, f64::max) < 1e-7);
            let variances = process.variances(&places).into_iter().enumerate();
            for (i, v) in variances {
                assert!((v - covariances[(i, i)]).abs() < 1e-7, "{n} {i}");
            }
        }
    }

    #[test]
    fn further_readings_leave_the_variances_they_leave_once_they_are_there() {
        let (read, further, at) = (pairs(0, 60), pairs(60, 20), pairs(1000, 40));
        let (process, _) = process(&read);
        let expected = process.variances_with(&process.places(&at), &process.places(&further));
        let kernel = Kernel::new(Symmetry::FULL);
        let mut all = data(&[read, further].concat());
        all.noise[60..].fill(process.noise());
        let with = Posterior::given(&kernel, all, Symmetry::FULL).unwrap();
        let then = with.variances(&with.places(&at));
        for (expected, then) in expected.unwrap().into_iter().zip(then) {
            assert!((expected - then).abs() < 1e-7, "{expected} {then}");
        }
    }

    #[test]
    fn readings_are_predicted_as_if_they_were_left_out() {
        let read = pairs(0, 40);
        let (process, _) = process(&read);
        let kernel = Kernel::new(Symmetry::FULL);
        let all = data(&read);
        for (i, square) in process.left_out().into_iter().enumerate() {
            let others: Vec<usize> = (0..read.len()).filter(|j| *j != i).collect();
            let without = Data {
                columns: others.iter().map(|&j| all.columns[j]).collect(),
                noise: others.iter().map(|&j| all.noise[j]).collect(),
                values: all.values.select_rows(&others),
            };
            let without = Posterior::given(&kernel, without, Symmetry::FULL).unwrap();
            let place = without.places(&read[i..=i]);
            let off = without.means(&place)[0] - MEAN - all.values[i];
            let variance = without.variances(&place)[0] + all.noise[i];
            let expected = off * off / (variance * process.scale());
            assert!(
                (square / expected - 1.0).abs() < 1e-5,
                "{i}: {square} {expected}"
            );
        }
    }

    #[test]
    fn without_readings_nothing_is_known() {
        let process = Posterior::prior(Symmetry::FULL);
        let places = process.places(&pairs(0, 3));
        assert_eq!(process.means(&places), [MEAN; 3]);
        assert!(process.variances(&places).iter().all(|v| *v > LEVEL));
        assert_eq!(process.covariances(&places, &places).shape(), (3, 3));
    }
}
