//! What is known of a material before its first reading: the mean of ln(f + ε) over many materials, and the functions
//! of a pair that they differ by (principal components).
//!
//! Both are splines on a lattice in half/difference coordinates, square root along θ_h, of isotropic bilateral
//! materials; others have no prior. The coefficients of a material are near those of one of the many, with a variance
//! that is the same for all; the kernel of what the functions leave has all amplitudes of the usual one times a factor.
//! Variance and factor are those that make families of materials most likely that the functions were not made of.

mod file;
mod train;

pub use train::{TrainError, Training};

use super::kernel::Kernel;
use super::system::{self, Covariance, Data, FREEDOM};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::usual_form;
use crate::reconstruct::cubic::{Spline, spline};
use crate::reconstruct::grid::{Continuation, GridInterpolant};
use crate::reconstruct::{Readings, Transform};
use crate::schedule::{Grid, PlanError, Ratio, SampleSet, Schedule};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::SystemTime;

/// A material that a prior was made of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trained {
    /// Its name.
    pub name: String,
    /// A hash of what it is.
    pub content: String,
}

/// What the first line of a file of a prior says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    /// Version of the format.
    gonio_prior: u32,
    /// BLAKE3 of the line, with nothing here, and of all bytes after it, hexadecimal.
    blake3: String,
    /// The lattice is the largest with at most so many configurations.
    nodes: usize,
    /// Number of functions.
    functions: usize,
    /// Factor of all amplitudes of the kernel.
    scale: f64,
    /// Variance of the level of ln f.
    level: f64,
    /// Variance of each coefficient about that of a material.
    share: f64,
    /// Number of centres.
    centres: usize,
    materials: Vec<Trained>,
}

/// Configurations of a lattice, at most.
pub const NODES: RangeInclusive<usize> = 500..=90_000;

/// Functions of a prior, at most.
pub const FUNCTIONS: usize = 500;

/// Values of a node: mean, brightness, then the functions.
const BEFORE: usize = 2;

/// What many materials have in common.
pub struct Prior {
    about: About,
    /// The values of each configuration of the lattice, as in a file.
    values: Vec<half::f16>,
    table: GridInterpolant<Spline<3>, 3>,
    /// Coefficients of the channels of the materials, a column for each.
    centres: DMatrix<f64>,
}

impl std::fmt::Debug for Prior {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.about.fmt(f)
    }
}

/// Pairs of a task.
const TASK: usize = 128;

impl Prior {
    /// `None` if the values are not those of the lattice, or a number is out of its range.
    fn new(about: About, values: Vec<half::f16>) -> Option<Self> {
        let factors = [about.scale, about.share];
        let is_usual = NODES.contains(&about.nodes)
            && (1..=FUNCTIONS).contains(&about.functions)
            && about.centres <= values.len()
            && factors.iter().all(|x| train::SOUGHT.contains(x))
            && about.level == train::LEVEL
            && values.iter().all(|x| x.is_finite());
        if !is_usual {
            return None;
        }
        let schedule = lattice(about.nodes).ok()?;
        let width = BEFORE + about.functions;
        let of_nodes = schedule.poses.len() * width;
        if values.len() != of_nodes + about.functions * about.centres {
            return None;
        }
        let mut wide: Vec<f64> = values.iter().map(|x| x.to_f64()).collect();
        let centres = wide.split_off(of_nodes);
        let centres = DMatrix::from_vec(about.functions, about.centres, centres);
        let readings = Readings {
            schedule: &Arc::new(schedule),
            width,
            values: &wide,
            present: &vec![true; wide.len() / width],
            noise: None,
        };
        let table = spline::<3>(&readings, Transform::Linear, Continuation::default()).ok()?;
        Some(Self {
            about,
            values,
            table,
            centres,
        })
    }

    /// Number of its functions.
    pub fn functions(&self) -> usize {
        self.about.functions
    }

    /// Factor of all amplitudes of the kernel, and variance of the coefficients of functions.
    pub fn scale_and_share(&self) -> [f64; 2] {
        [self.about.scale, self.about.share]
    }

    /// True if materials of this symmetry have priors.
    pub(super) fn suits(symmetry: Symmetry) -> bool {
        symmetry == Symmetry::FULL
    }

    /// The materials that it was made of.
    pub fn materials(&self) -> &[Trained] {
        &self.about.materials
    }

    /// The kernel about a material of this prior, of a kernel without one.
    pub(super) fn kernel(&self, kernel: Kernel) -> Kernel {
        kernel.about(self.about.scale, self.about.level, self.about.share)
    }

    /// The kernel about the mean of this prior, of a kernel without one: coefficients of its materials have variance 1.
    pub(super) fn kernel_before(&self, kernel: Kernel) -> Kernel {
        kernel.about(self.about.scale, self.about.level, self.about.share + 1.0)
    }

    fn values_at(&self, pairs: &[DirectionPair]) -> DMatrix<f64> {
        let width = BEFORE + self.about.functions;
        let mut values = DMatrix::zeros(width, pairs.len());
        let tasks = values.as_mut_slice().par_chunks_mut(width * TASK);
        tasks
            .zip(pairs.par_chunks(TASK))
            .for_each(|(out, pairs)| self.table.transformed_batch(pairs, out));
        values
    }

    /// The mean of ln(f + ε) at pairs, and the functions, a column per pair.
    pub(super) fn at(&self, pairs: &[DirectionPair]) -> (Vec<f64>, DMatrix<f64>) {
        let values = self.values_at(pairs);
        let mean = values.row(0).iter().copied().collect();
        (mean, values.remove_rows(0, BEFORE))
    }

    /// f² of the materials at pairs, each as a share of its mean of (f cos)² under the cosine measure, on average.
    pub(crate) fn brightness(&self, pairs: &[DirectionPair]) -> Vec<f64> {
        let values = self.values_at(pairs);
        values.row(1).iter().map(|log| log.exp()).collect()
    }

    /// What readings say of the coefficients, a column for each value of a reading, by a kernel: the mean of those of the
    /// materials, each as often as it makes the readings likely. Then −ln of how likely all together make them, their
    /// mean over values, as of [`Data::likelihood`]. `None` if the covariances are singular.
    pub(super) fn centred(&self, kernel: &Kernel, data: &Data) -> Option<(Centre, f64)> {
        centred(&self.centres, kernel, data)
    }

    /// The mean plus the functions times coefficients, a column for each value of a pair.
    pub(super) fn mean(&self, coefficients: &DMatrix<f64>) -> Mean {
        let mut weights = coefficients.clone().insert_rows(0, BEFORE, 0.0);
        weights.row_mut(0).fill(1.0);
        let rule = self.table.rule().combined(&weights);
        Mean(self.table.with(rule, weights.ncols()))
    }
}

/// What readings say of the coefficients of functions before the rest is looked at.
#[derive(Clone)]
pub(super) struct Centre {
    /// Their means, a column for each value of a reading.
    pub mean: DMatrix<f64>,
    /// Columns the sum of whose squares is their covariance, those of the first value.
    pub spread: DMatrix<f64>,
}

/// The likelihood of a material from which on it is one of those that a material may be like.
const LIKELY: f64 = 1e-6;

/// [`Prior::centred`], about these centres.
fn centred(centres: &DMatrix<f64>, kernel: &Kernel, data: &Data) -> Option<(Centre, f64)> {
    let factor = Covariance::new(kernel).factor(data)?;
    let mut readings = data.values.clone();
    system::forward(&factor, &mut readings);
    let mut means = data.sites.functions.tr_mul(centres);
    system::forward(&factor, &mut means);
    let n = data.sites.len();
    let freedom = FREEDOM + n as f64;
    let mut loss = (0..n).map(|i| factor[(i, i)].ln()).sum::<f64>();
    let mut mean = DMatrix::zeros(centres.nrows(), data.values.ncols());
    let mut spread = DMatrix::zeros(centres.nrows(), 0);
    for (c, reading) in readings.column_iter().enumerate() {
        let of_centre = means.column_iter().map(|mean| {
            let square = (reading - mean).norm_squared();
            0.5 * freedom * (square / FREEDOM).ln_1p()
        });
        let losses = DVector::from_iterator(means.ncols(), of_centre);
        let least = losses.min();
        let likely = losses.map(|l| (least - l).exp());
        loss += (least - likely.mean().ln()) / data.values.ncols() as f64;
        let likely = &likely / likely.sum();
        mean.set_column(c, &(centres * &likely));
        if c == 0 {
            let near: Vec<usize> = (0..likely.len()).filter(|&k| likely[k] > LIKELY).collect();
            spread = centres.select_columns(&near);
            for (mut column, &k) in spread.column_iter_mut().zip(&near) {
                column -= mean.column(0);
                column *= likely[k].sqrt();
            }
        }
    }
    loss.is_finite().then_some((Centre { mean, spread }, loss))
}

/// A mean of ln(f + ε), of several values per pair.
pub(super) struct Mean(GridInterpolant<Spline<3>, 3>);

impl Mean {
    /// Adds it to the values of pairs (`pairs × width`).
    pub fn add(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let mut values = vec![0.0; out.len()];
        self.0.transformed_batch(pairs, &mut values);
        out.iter_mut().zip(values).for_each(|(o, v)| *o += v);
    }
}

/// The lattice of a prior with at most so many configurations: as fine along θ_h and θ_d as materials change.
fn lattice(nodes: usize) -> Result<Schedule, PlanError> {
    let grid = Grid {
        ratio: Some(Ratio::Numbers(vec![6.0, 4.0, 3.0])),
        ..Grid::default()
    };
    grid.plan(&usual_form(Symmetry::FULL), nodes, 0)
}

/// Name of the prior of formulas, where a config names a file.
const BUILT_IN: &str = "built-in";

/// That prior; `configs/families.toml` says of what it was made, and how.
static BYTES: &[u8] = include_bytes!("built-in.gonio");

/// A file of a prior, as configs name it, or `built-in`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(from = "PathBuf", into = "PathBuf")]
pub struct PriorFile {
    path: PathBuf,
    /// What it was when it was first asked for: a run goes on with that.
    known: OnceLock<Arc<Prior>>,
}

impl From<PathBuf> for PriorFile {
    fn from(path: PathBuf) -> Self {
        Self {
            path,
            known: OnceLock::new(),
        }
    }
}

impl From<PriorFile> for PathBuf {
    fn from(file: PriorFile) -> Self {
        file.path
    }
}

/// Priors that were read, with the size and time of their files then.
type Known = HashMap<PathBuf, (u64, Option<SystemTime>, Arc<Prior>)>;

impl PriorFile {
    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A hash of what the prior says; of a file that is none, why.
    pub fn content(&self) -> String {
        let known = self.load();
        known.map_or_else(|e| e.to_string(), |prior| prior.about.blake3.clone())
    }

    /// The prior, as it was when it was first asked for; a file that did not change is read once.
    ///
    /// # Errors
    /// If the file cannot be read, or holds no prior.
    pub fn load(&self) -> Result<Arc<Prior>, ParameterError> {
        if let Some(known) = self.known.get() {
            return Ok(Arc::clone(known));
        }
        let read = self.read();
        let known = read.map_err(|why| {
            let allowed = format!("{BUILT_IN:?}, or a file of gonio train ({why})");
            ParameterError::new("prior", format!("{:?}", self.path), allowed)
        })?;
        Ok(Arc::clone(self.known.get_or_init(|| known)))
    }

    fn read(&self) -> Result<Arc<Prior>, String> {
        static KNOWN: Mutex<Option<Known>> = Mutex::new(None);
        static FORMULAS: OnceLock<Result<Arc<Prior>, String>> = OnceLock::new();
        if self.path == Path::new(BUILT_IN) {
            let known = FORMULAS.get_or_init(|| Prior::decode(BYTES).map(Arc::new));
            return known.clone();
        }
        let about = std::fs::metadata(&self.path).map_err(|e| e.to_string())?;
        let (size, time) = (about.len(), about.modified().ok());
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let known = known.get_or_insert_default();
        match known.get(&self.path) {
            Some((s, t, prior)) if (*s, *t) == (size, time) => Ok(Arc::clone(prior)),
            _ => {
                let prior = Arc::new(Prior::read(&self.path).map_err(|e| e.to_string())?);
                known.insert(self.path.clone(), (size, time, Arc::clone(&prior)));
                Ok(prior)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::system::Sites;
    use super::super::{Kriging, TRANSFORM};
    use super::*;
    use crate::brdf::{Brdf, Channels, Presence};
    use crate::instrument::{Ideal, Instrument};
    use crate::measurement::Measurement;
    use crate::reconstruct::Reconstruct;
    use crate::schedule::SobolSet;

    /// ln(f + ε) = Σ c_k q_k, of functions that are smooth on the lattice.
    #[derive(Debug)]
    struct Member([f64; 3]);

    impl Member {
        fn log(&self, pair: &DirectionPair) -> f64 {
            let half = (pair.omega_i.vector() + pair.omega_o.vector()).normalize();
            let (lifted, facing) = (half.z, half.dot(pair.omega_i.vector()));
            let q = [1.0 - lifted, (1.0 - facing).powi(2), lifted * facing];
            self.0.iter().zip(q).map(|(c, q)| c * q).sum::<f64>()
        }
    }

    impl Brdf for Member {
        fn channels(&self) -> &Channels {
            &Channels::Luminance
        }
        fn symmetry(&self) -> Symmetry {
            Symmetry::FULL
        }
        fn conserves_energy(&self) -> bool {
            false
        }
        fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
            out[0] = TRANSFORM.inverse(self.log(pair));
            Presence::Present
        }
    }

    /// Members of several families of names.
    fn trained() -> Training {
        let mut training = Training::new(2000).unwrap();
        for i in 0..24 {
            let u = |k: f64| 4.0 * (f64::from(i + 1) * k).fract() - 2.0;
            let member = Member([0.8192, 0.6710, 0.5497].map(u));
            let name = format!("{i}-{}", ["wood", "paint", "felt"][i as usize % 3]);
            training.add(&name, &format!("{i}"), &member).unwrap();
        }
        training
    }

    fn measured(brdf: &dyn Brdf, budget: usize) -> Measurement {
        let schedule = SobolSet {}.plan(&usual_form(Symmetry::FULL), budget, 3);
        Ideal.measure(brdf, &Arc::new(schedule.unwrap()))
    }

    fn file(prior: &Prior) -> (tempfile::NamedTempFile, PriorFile) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(&file, prior.to_bytes()).unwrap();
        let named = PriorFile::from(file.path().to_owned());
        (file, named)
    }

    /// The largest error of ln(f + ε), by so many readings, with a prior and without.
    fn errors(brdf: &dyn Brdf, log: &dyn Fn(&DirectionPair) -> f64, n: usize) -> [f64; 2] {
        let (_file, prior) = file(&trained().prior(80).unwrap());
        let at: Vec<_> = measured(brdf, 300).schedule.poses.clone();
        [Some(prior), None].map(|prior| {
            let kriging = Kriging {
                prior,
                ..Kriging::default()
            };
            let copy = kriging.reconstruct(&measured(brdf, n)).unwrap();
            let off = |pose: &crate::schedule::Pose| {
                let mut f = [0.0];
                let _ = copy.eval(&pose.pair, &mut f);
                (TRANSFORM.forward(f[0]) - log(&pose.pair)).abs()
            };
            at.iter().map(off).sum::<f64>() / at.len() as f64
        })
    }

    #[test]
    fn a_member_of_a_family_is_known_from_as_many_readings_as_it_has_coefficients() {
        let member = Member([1.3, -0.7, 0.4]);
        let [with, without] = errors(&member, &|pair| member.log(pair), 4);
        assert!(with < 0.02 && with < 0.2 * without, "{with} {without}");
    }

    /// R, G, B, each a member of its own.
    struct Coloured([Member; 3]);

    impl Brdf for Coloured {
        fn channels(&self) -> &Channels {
            &Channels::Rgb
        }
        fn symmetry(&self) -> Symmetry {
            Symmetry::FULL
        }
        fn conserves_energy(&self) -> bool {
            false
        }
        fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
            for (out, member) in out.iter_mut().zip(&self.0) {
                *out = TRANSFORM.inverse(member.log(pair));
            }
            Presence::Present
        }
    }

    #[test]
    fn each_channel_is_what_it_is_alone() {
        let members = [[1.3, -0.7, 0.4], [-1.0, 0.2, 1.5], [0.3, 1.4, -1.2]];
        let coloured = Coloured(members.map(Member));
        let (_file, prior) = file(&trained().prior(80).unwrap());
        // Shares are those of all channels together: one kernel and one share for each.
        let kriging = Kriging {
            prior: Some(prior),
            fit: false,
            ..Kriging::default()
        };
        let copy = kriging.reconstruct(&measured(&coloured, 5)).unwrap();
        for pose in &measured(&coloured, 100).schedule.poses {
            let mut f = [0.0; 3];
            let _ = copy.eval(&pose.pair, &mut f);
            for (f, member) in f.iter().zip(&coloured.0) {
                let off = TRANSFORM.forward(*f) - member.log(&pose.pair);
                assert!(off.abs() < 0.15, "{off} at {pose:?}");
            }
        }
    }

    #[test]
    fn what_contradicts_a_prior_is_reconstructed_without_it() {
        struct Stripes;
        impl Brdf for Stripes {
            fn channels(&self) -> &Channels {
                &Channels::Luminance
            }
            fn symmetry(&self) -> Symmetry {
                Symmetry::FULL
            }
            fn conserves_energy(&self) -> bool {
                false
            }
            fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
                let half = (pair.omega_i.vector() + pair.omega_o.vector()).normalize();
                out[0] = (8.0 * (60.0 * half.z).sin()).exp();
                Presence::Present
            }
        }
        let (_file, prior) = file(&trained().prior(80).unwrap());
        let readings = measured(&Stripes, 30);
        let copy = |prior| {
            let kriging = Kriging {
                prior,
                ..Kriging::default()
            };
            kriging.reconstruct(&readings).unwrap()
        };
        let [with, without] = [Some(prior), None].map(copy);
        assert_eq!(with.remarks().len(), 1);
        for pose in &readings.schedule.poses {
            let (mut a, mut b) = ([0.0], [0.0]);
            let _ = with.eval(&pose.pair, &mut a);
            let _ = without.eval(&pose.pair, &mut b);
            assert_eq!(a, b);
        }
    }

    #[test]
    fn a_material_that_it_was_made_of_is_recognized() {
        let prior = trained().prior(80).unwrap();
        let member = Member([0.8192, 0.6710, 0.5497].map(|k: f64| 4.0 * (6.0 * k).fract() - 2.0));
        let readings = measured(&member, 12);
        let pairs: Vec<_> = readings.schedule.poses.iter().map(|p| p.pair).collect();
        let sites = Sites::new(&pairs, Symmetry::FULL, Some(prior.at(&pairs)));
        let values = pairs
            .iter()
            .zip(&sites.mean)
            .map(|(p, m)| member.log(p) - m);
        let data = Data {
            values: DMatrix::from_iterator(12, 1, values),
            noise: vec![1e-5; 12],
            sites,
        };
        // One that leaves next to nothing to chance.
        let kernel = Kernel::new(Symmetry::FULL).about(1e-6, 1e-4, 1e-4);
        let (centre, _) = prior.centred(&kernel, &data).unwrap();
        let likeliest = prior.centres.column(5);
        assert!((centre.mean.column(0) - likeliest).norm() < 0.01 * likeliest.norm());
    }

    #[test]
    fn means_are_sums_of_functions() {
        let prior = trained().prior(80).unwrap();
        assert_eq!(prior.functions(), 3);
        let pairs: Vec<_> = measured(&Member([0.0; 3]), 50).schedule.poses.clone();
        let pairs: Vec<_> = pairs.iter().map(|p| p.pair).collect();
        let (mean, functions) = prior.at(&pairs);
        let coefficients = DMatrix::from_row_slice(3, 2, &[0.3, 1.0, -2.0, 0.0, 0.7, 5.0]);
        let mut out = vec![0.0; 100];
        prior.mean(&coefficients).add(&pairs, &mut out);
        let expected = functions.tr_mul(&coefficients);
        for i in 0..50 {
            for c in 0..2 {
                assert!((out[2 * i + c] - mean[i] - expected[(i, c)]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_file_says_what_was_written_or_that_it_does_not() {
        let prior = trained().prior(2).unwrap();
        assert_eq!((prior.functions(), prior.materials().len()), (2, 24));
        let bytes = prior.to_bytes();
        let pairs = [DirectionPair::from_spherical(0.3, 0.0, 0.5, 1.0)];
        let back = Prior::decode(&bytes).unwrap();
        assert_eq!(back.at(&pairs), prior.at(&pairs));
        assert_eq!(back.materials(), prior.materials());
        let end = bytes.iter().position(|b| *b == b'\n').unwrap();
        let line = std::str::from_utf8(&bytes[..end]).unwrap();
        let told = |line: &str, body: &[u8]| {
            let all = [line.as_bytes(), b"\n", body].concat();
            Prior::decode(&all).unwrap_err()
        };
        let body = &bytes[end + 1..];
        assert_eq!(told(line, &body[..body.len() - 2]), "it was changed or cut");
        let other = line.replace("\"gonio_prior\":1", "\"gonio_prior\":9");
        assert_eq!(told(&other, body), "it has version 9, this program reads 1");
        for (key, value) in [
            ("nodes", "2000000000000"),
            ("functions", "18446744073709551615"),
            ("centres", "1"),
            ("scale", "-1.0"),
            ("share", "0.0"),
        ] {
            let start = line.find(&format!("\"{key}\":")).unwrap();
            let end = start + line[start..].find(',').unwrap();
            let other = format!("{}\"{key}\":{value}{}", &line[..start], &line[end..]);
            assert_eq!(told(&other, body), "it was changed or cut");
            // One who knows how to hash.
            let mut about: About = serde_json::from_str(&other).unwrap();
            about.blake3 = file::hash(&about, body);
            let other = serde_json::to_string(&about).unwrap();
            assert_eq!(told(&other, body), "its numbers do not suit each other");
        }
        assert_eq!(told("kind,value", body), "it is something else");
        assert_eq!(Prior::decode(b"").unwrap_err(), "it is something else");
    }

    #[test]
    fn what_is_no_material_of_a_prior_is_refused() {
        let mut training = Training::new(2000).unwrap();
        training.add("a", "a", &Member([0.0; 3])).unwrap();
        let skew = crate::brdf::all();
        let ward = skew.iter().find(|e| e.kind == "ward").unwrap();
        let ward = crate::registry::read_text(ward, "alpha = [0.1, 0.3]\nrho_s = 0.3").unwrap();
        let ward = ward.build(Channels::Luminance).unwrap();
        let told = training.add("w", "w", &*ward).unwrap_err().to_string();
        assert!(told.contains("w is not isotropic"), "{told}");
        let told = training.prior(80).unwrap_err().to_string();
        assert!(told.contains("at least 2"), "{told}");
    }

    #[test]
    fn the_prior_of_formulas_is_there() {
        let prior = PriorFile::from(PathBuf::from(BUILT_IN)).load().unwrap();
        assert!(prior.materials().len() > 50 && prior.to_bytes() == BYTES);
        assert!(BYTES.len() <= 300_000);
    }
}
