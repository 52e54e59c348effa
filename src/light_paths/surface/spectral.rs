//! Gaussian random surfaces: white noise whose spectrum is given a shape.
//!
//! Heights have the correlation C(r) = h² c(r), the spectrum is its Fourier transform, and amplitudes are such that the
//! *triangles* have the asked rms slopes on average over seeds; those of one period differ.
//!
//! c = exp(−x²/l_x² − y²/l_y²): slopes are Gaussian of rms √2 h/l, the facets of `beckmann` of alpha = √2 rms slope.
//! c = exp(−√(x²/l_x² + y²/l_y²)): slopes grow without bound with the detail, so heights are smoothed by a Gaussian of the
//! given inner scale, and the slope is that of what is left.

use super::{Facts, HeightField, SurfaceSpec, check_size};
use crate::brdf::{BuildError, Roughness};
use crate::error::{ParameterError, in_closed};
use crate::registry::declare;
use crate::sampling::Random;
use rayon::prelude::*;
use rustfft::algorithm::{BluesteinsAlgorithm, Radix4};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::f64::consts::TAU;
use std::sync::Arc;

/// A number or two, with a message of its own.
fn slope<'de, D: Deserializer<'de>>(from: D) -> Result<Roughness, D::Error> {
    Roughness::deserialize(from).map_err(|_| {
        D::Error::custom("rms_slope: allowed is a number or two numbers [along x, along y]")
    })
}

declare! {
    impl dyn SurfaceSpec, "gaussian": "Gaussian random heights with the correlation exp(-r²/l²); rms_slope of one axis or both, brushed where they differ", [
        "rms_slope = 0.3\ncorrelation = 8\nsize = 128",
        "rms_slope = [0.3, 0.1]\ncorrelation = 6\nsize = 128",
    ]
    /// Heights with a Gaussian correlation, as a config writes them.
    pub struct GaussianSpec {
        /// Root mean square of dz/dx and dz/dy.
        #[serde(deserialize_with = "slope")]
        rms_slope: Roughness = Roughness::Isotropic(0.3);
        /// Correlation length along x, cells: c = 1/e there.
        correlation: f64 = 12.0;
        /// Cells along each axis of a period.
        size: usize = 1024;
        /// Another one gives another surface of the same statistics.
        seed: u64 = 1;
    }
}

declare! {
    impl dyn SurfaceSpec, "exponential": "Gaussian random heights with the correlation exp(-r/l), smooth below inner_scale; rms_slope of one axis or both", [
        "rms_slope = 0.3\ncorrelation = 16\ninner_scale = 4\nsize = 128",
    ]
    /// Heights with an exponential correlation, as a config writes them.
    pub struct ExponentialSpec {
        /// Root mean square of dz/dx and dz/dy.
        #[serde(deserialize_with = "slope")]
        rms_slope: Roughness = Roughness::Isotropic(0.3);
        /// Correlation length along x, cells: c = 1/e there.
        correlation: f64 = 24.0;
        /// Length below which heights are smooth, cells, 4 or more.
        inner_scale: f64 = 4.0;
        /// Cells along each axis of a period.
        size: usize = 1024;
        /// Another one gives another surface of the same statistics.
        seed: u64 = 1;
    }
}

fn facts(kind: &str, slope: Roughness, size: usize) -> Facts {
    Facts {
        label: format!("{kind}-{slope}"),
        symmetry: slope.symmetry(),
        is_random: true,
        cells: size * size,
    }
}

fn check(slope: Roughness, correlation: f64, size: usize) -> Result<(), ParameterError> {
    let [x, y] = slope.xy();
    for s in [x, y] {
        in_closed("rms_slope", s, 1e-6, 10.0)?;
    }
    check_size(size)?;
    let most = size as f64 / 4.0;
    if !(1.0..=most).contains(&correlation) {
        let allowed = format!("a number in [1, {most}], a quarter of size = {size}");
        return Err(ParameterError::new("correlation", correlation, allowed));
    }
    let across = correlation * x / y;
    if x != y && !(4.0..=most).contains(&across) {
        let allowed = format!(
            "[x, y] with a correlation length along y, {correlation} x/y, from 4 to {most} cells, a quarter of size"
        );
        let found = format!("[{x}, {y}]");
        return Err(ParameterError::new("rms_slope", found, allowed));
    }
    Ok(())
}

impl SurfaceSpec for GaussianSpec {
    fn facts(&self) -> Facts {
        facts(Self::KIND, self.rms_slope, self.size)
    }

    fn check(&self) -> Result<(), BuildError> {
        Ok(check(self.rms_slope, self.correlation, self.size)?)
    }

    fn build(&self, draw: u64) -> Result<HeightField, BuildError> {
        self.check()?;
        let seed = self.seed.wrapping_add(draw);
        let shape = |k2: f64| (-0.25 * k2).exp();
        synthesise(self.rms_slope, self.correlation, self.size, seed, shape)
    }
}

impl SurfaceSpec for ExponentialSpec {
    fn facts(&self) -> Facts {
        facts(Self::KIND, self.rms_slope, self.size)
    }

    fn check(&self) -> Result<(), BuildError> {
        check(self.rms_slope, self.correlation, self.size)?;
        in_closed("inner_scale", self.inner_scale, 4.0, self.correlation)?;
        Ok(())
    }

    fn build(&self, draw: u64) -> Result<HeightField, BuildError> {
        self.check()?;
        // Both heights of a product are smoothed, hence twice the exponent.
        let inner = (self.inner_scale / self.correlation).powi(2);
        let seed = self.seed.wrapping_add(draw);
        let shape = |k2: f64| (1.0 + k2).powf(-1.5) * (-0.5 * inner * k2).exp();
        synthesise(self.rms_slope, self.correlation, self.size, seed, shape)
    }
}

/// Heights whose spectrum goes as `shape` of the squared wave number in units of the correlation lengths. Those are `length`
/// along x, and along y as the ratio of the slopes asks.
fn synthesise(
    slope: Roughness,
    length: f64,
    n: usize,
    seed: u64,
    shape: impl Fn(f64) -> f64 + Sync,
) -> Result<HeightField, BuildError> {
    let [sx, sy] = slope.xy();
    let lengths = [length, length * sx / sy];
    let wave = |i: usize, length: f64| {
        let i = i as f64 - if 2 * i > n { n as f64 } else { 0.0 };
        (TAU / n as f64 * i, TAU / n as f64 * i * length)
    };
    let density = |x: usize, y: usize| match (x, y) {
        // The mean height has no effect.
        (0, 0) => 0.0,
        _ => shape(wave(x, lengths[0]).1.powi(2) + wave(y, lengths[1]).1.powi(2)),
    };
    // What a difference of neighbours along x has of each wave: |exp(ik) − 1|².
    let across: Vec<f64> = (0..n)
        .into_par_iter()
        .map(|y| {
            let row = (0..n).map(|x| density(x, y) * (2.0 * (0.5 * wave(x, 1.0).0).sin()).powi(2));
            row.sum()
        })
        .collect();
    let expected = across.iter().sum::<f64>() / (n * n) as f64;
    let scale = sx / expected.sqrt();

    let [forward, back] =
        [FftDirection::Forward, FftDirection::Inverse].map(|way| transform(n, way));
    let random = Random::new(seed);
    let mut field = vec![Complex::new(0.0, 0.0); n * n];
    field.par_chunks_mut(n).enumerate().for_each(|(y, row)| {
        let mut stream = random.stream(y as u64);
        for value in row {
            let radius = (-2.0 * (-stream.next()).ln_1p()).sqrt();
            value.re = radius * (TAU * stream.next()).cos();
        }
    });
    along_both(&forward, &mut field, n);
    // Transposed now: rows are of one x.
    field.par_chunks_mut(n).enumerate().for_each(|(x, column)| {
        for (y, value) in column.iter_mut().enumerate() {
            *value *= scale * density(x, y).sqrt() / (n * n) as f64;
        }
    });
    along_both(&back, &mut field, n);
    let heights: Vec<f64> = field.into_iter().map(|value| value.re).collect();
    Ok(HeightField::new([n, n], &heights)?)
}

/// The transform of `n` numbers: of powers of two, which others are embedded in, so that those of primes are not compiled.
fn transform(n: usize, way: FftDirection) -> Arc<dyn Fft<f64>> {
    match n.is_power_of_two() {
        true => Arc::new(Radix4::new(n, way)),
        false => {
            let around = Radix4::new((2 * n - 1).next_power_of_two(), way);
            Arc::new(BluesteinsAlgorithm::new(n, Arc::new(around)))
        }
    }
}

/// Transforms rows, and then columns; what comes out is transposed.
fn along_both(fft: &Arc<dyn Fft<f64>>, field: &mut Vec<Complex<f64>>, n: usize) {
    let rows = |field: &mut Vec<Complex<f64>>| {
        field.par_chunks_mut(n).for_each(|row| fft.process(row));
    };
    rows(field);
    let columns = (0..n).into_par_iter();
    let columns = columns.flat_map_iter(|x| (0..n).map(move |y| y * n + x));
    *field = columns.map(|place| field[place]).collect();
    rows(field);
}
