//! Poses for the moments of slices: what is to be known is a sum over directions, not the BRDF at each.
//!
//! An error δ of ln(f + ε) at a direction shifts a moment of a slice by w (f + ε) δ, w the influence of that direction
//! ([`MomentErrors::influences`]). Its variance is that of a sum under the Gaussian process, which a reading lowers by the square
//! of its covariance with the sum over its own variance. The error of a view is the root of the variances of the components of the
//! moment, each in the unit of the error; what is made small is the sum of these errors over views.

use super::choice::{Targets, Wanted, most_informative};
use crate::brdf::{Brdf, Channels, Presence};
use crate::error::{ParameterError, one_of};
use crate::geometry::{DirectionPair, Symmetry};
use crate::moments::{Channel, Influences, MomentErrors, Slice, VIEW_BANDS, lambertian_part};
use crate::parametrization::VIEW_CENTERED_AREA;
use crate::reconstruct::{EPSILON, Places, Posterior};
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_2_PI;
use std::fmt;
use std::str::FromStr;

/// Views that the error over a band is estimated at, at the middle of equal parts of it.
const VIEWS: usize = 6;

/// Elevation of views, at most, degrees: beyond it is what no arm reads.
const LAST_VIEW: f64 = 85.0;

/// Energy of a slice without its diffuse part, over that of this part, up to which it is matte: what is left of it is rounding, or
/// ripples of an estimate, and has no moments.
const LEAST_LOBE: f64 = 0.01;

/// Largest level of each error, in the order of [`MomentErrors::QUANTITIES`].
const MOST_LEVEL: [f64; MomentErrors::COUNT] = [1.0, 90.0, 1.0, 1.0, 10.0, 100.0];

/// Errors that are shares, which a percentage may stand for, and the one in degrees.
const SHARES: [usize; 3] = [0, 2, 3];
const DEGREES: usize = 1;

/// What the names of columns of errors of moments begin with, which is left out here.
const PREFIX: &str = "moment_";

/// A moment that is to be known to a level: `covariance=0.05`, `energy_40_70=1%`, `mean_deg=1`; without a level that of
/// [`MomentErrors::LEVELS`]. Names are those of the columns of its errors without `moment_`; `variance` is the covariance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct MomentAim {
    /// Position of its band of views in [`VIEW_BANDS`].
    band: usize,
    /// Position of its error in [`MomentErrors::QUANTITIES`].
    of: usize,
    /// The error up to which it is known well enough; at 0 readings go on.
    pub level: f64,
}

impl MomentAim {
    /// The column of its error.
    pub fn column(&self) -> &'static str {
        MomentErrors::QUANTITIES[self.band][self.of].0.name
    }

    /// Its position in [`MomentErrors::QUANTITIES`]: band, and error.
    pub fn position(&self) -> [usize; 2] {
        [self.band, self.of]
    }

    /// The aim at another level.
    #[must_use]
    pub fn to(self, level: f64) -> Self {
        Self { level, ..self }
    }

    /// Its name, without the level.
    pub fn name(&self) -> &'static str {
        self.column().trim_start_matches(PREFIX)
    }

    /// Every error of every band, at level 0.
    fn all() -> impl Iterator<Item = Self> {
        let bands = 0..VIEW_BANDS.len();
        bands.flat_map(|band| {
            let level = 0.0;
            (0..MomentErrors::COUNT).map(move |of| Self { band, of, level })
        })
    }

    /// Elevations of its views, rad.
    fn views(&self) -> impl Iterator<Item = f64> {
        let [from, to] = VIEW_BANDS[self.band];
        let step = (to.min(LAST_VIEW) - from) / VIEWS as f64;
        (0..VIEWS).map(move |k| (from + (k as f64 + 0.5) * step).to_radians())
    }

    /// The sums by which its errors follow from those of a BRDF, for each view where it is defined. The diffuse part is taken off.
    fn influences(&self, brdf: &dyn Brdf) -> Vec<Influences> {
        let channel = Channel::Luminance;
        let Ok(diffuse) = lambertian_part(brdf, channel) else {
            return Vec::new();
        };
        let views: Vec<f64> = self.views().collect();
        let of = |view: &f64| {
            let slice = Slice::new(brdf, channel, *view).ok()?.without(diffuse);
            MomentErrors::influences(&slice, self.of, LEAST_LOBE * diffuse * VIEW_CENTERED_AREA)
        };
        views.par_iter().filter_map(of).collect()
    }

    /// Sums Σ w ln(f + ε) for each view of a BRDF, by which its errors follow from those of ln(f + ε).
    pub(super) fn sums(&self, brdf: &dyn Brdf) -> Vec<Influences> {
        let mut all = self.influences(brdf);
        for Influences { pairs, weights } in &mut all {
            let channels = brdf.channels();
            let (values, _) = brdf.values(pairs);
            let values = values.chunks(channels.count());
            let shifted: Vec<f64> = values.map(|f| channels.luminance(f) + EPSILON).collect();
            for sum in weights {
                sum.iter_mut().zip(&shifted).for_each(|(w, f)| *w *= f);
            }
        }
        all
    }
}

impl FromStr for MomentAim {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let (name, level) = match text.split_once('=') {
            Some((name, level)) => (name.trim(), Some(level.trim())),
            None => (text.trim(), None),
        };
        let refused = |allowed| ParameterError::new("for", format!("\"{text}\""), allowed);
        let known = match name.strip_prefix("variance") {
            Some(band) => format!("covariance{band}"),
            None => name.to_owned(),
        };
        let found = Self::all().find(|aim| aim.name() == known);
        let found = found.ok_or_else(|| {
            let names = Self::all().map(|aim| aim.name());
            refused(one_of(name, std::iter::once("variance").chain(names)))
        })?;
        let level = match level {
            None => MomentErrors::LEVELS[found.of]
                .ok_or_else(|| refused(format!("{name}=LEVEL: it has no level of its own")))?,
            Some(level) => {
                let (is_share, is_angle) = (SHARES.contains(&found.of), found.of == DEGREES);
                let (number, per) = match level.strip_suffix('%').filter(|_| is_share) {
                    Some(number) => (number, 100.0),
                    None => {
                        let angle = level.strip_suffix('°').or(level.strip_suffix("deg"));
                        (angle.filter(|_| is_angle).unwrap_or(level), 1.0)
                    }
                };
                let number = number.trim().parse::<f64>().ok();
                let most = MOST_LEVEL[found.of];
                // −0 is 0.
                let level = number.map(|n| n / per + 0.0);
                level.filter(|n| (0.0..=most).contains(n)).ok_or_else(|| {
                    let example = if is_share { ", as 0.05 or 5%" } else { "" };
                    refused(format!("{name}=LEVEL, a number from 0 to {most}{example}"))
                })?
            }
        };
        Ok(found.to(level))
    }
}

impl TryFrom<String> for MomentAim {
    type Error = ParameterError;

    fn try_from(text: String) -> Result<Self, ParameterError> {
        text.parse()
    }
}

impl From<MomentAim> for String {
    fn from(aim: MomentAim) -> Self {
        aim.to_string()
    }
}

/// `covariance_40_70=0.05`, which reads back as the same.
impl fmt::Display for MomentAim {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}={}", self.name(), self.level)
    }
}

/// The error of a moment that is expected: now, and with the readings of a batch too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentForecast {
    /// The moment.
    pub aim: MomentAim,
    /// With the readings so far.
    pub now: f64,
    /// With those of the batch too.
    pub then: f64,
}

/// Ratios of true and expected errors that nine of ten are below, in the order of [`MomentErrors::QUANTITIES`], of ten tables (four of the
/// mean, the skewness and the kurtosis) at 12 to 140 readings: beside what readings leave open an error has what linear sums, the kernel and the diffuse part err by.
/// [`docs::moments`](crate::docs::moments) has how often stops by them hold.
const NINTH: [f64; MomentErrors::COUNT] = [4.0, 2.2, 2.2, 2.5, 2.3, 4.5];

impl MomentForecast {
    /// What the errors of nine of ten materials are below, now and then.
    pub fn bounds(&self) -> [f64; 2] {
        [self.now, self.then].map(|error| NINTH[self.aim.of] * error)
    }

    /// True if what the error of nine of ten materials is below has reached the level.
    pub(super) fn is_reached(&self) -> bool {
        self.bounds()[0] <= self.aim.level
    }
}

/// The error that is expected over views, of the variances of the components of each: the mean of the absolute value of a normal number
/// for the root of their sum.
pub(super) fn expected(views: impl Iterator<Item = Vec<f64>>) -> Option<f64> {
    let (mut sum, mut n) = (0.0, 0);
    for variances in views {
        sum += (FRAC_2_PI * variances.iter().sum::<f64>()).sqrt();
        n += 1;
    }
    (n > 0).then(|| sum / f64::from(n))
}

/// Numbers of candidates whose readings lower the errors of a moment over views most, by the sums of each view; `None` if there are none.
pub(super) fn choose(
    process: &Posterior,
    sums: &[Influences],
    candidates: &Places,
    wanted: Wanted<'_>,
) -> Option<Vec<usize>> {
    let (targets, counts) = targets(process, sums, candidates)?;
    let worth = |variances: &[f64], out: &mut [f64]| worth(&counts, variances, out);
    Some(most_informative(
        process, candidates, targets, worth, wanted,
    ))
}

/// The components of all views as what readings are to lower, and the number of components of each view.
fn targets(
    process: &Posterior,
    sums: &[Influences],
    candidates: &Places,
) -> Option<(Targets, Vec<usize>)> {
    let (mut rows, mut variances, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    for Influences { pairs, weights } in sums {
        let places = process.places(pairs);
        let weights = DMatrix::from_fn(pairs.len(), weights.len(), |k, of| weights[of][k]);
        rows.push(weights.tr_mul(&process.covariances(&places, candidates)));
        variances.extend(process.variances_of_sums(&places, &weights, &[])?);
        counts.push(weights.ncols());
    }
    let columns = rows.first()?.ncols();
    let mut covariances = DMatrix::zeros(variances.len(), columns);
    let mut first = 0;
    for row in rows {
        covariances.rows_mut(first, row.nrows()).copy_from(&row);
        first += row.nrows();
    }
    Some((
        Targets {
            covariances,
            variances,
        },
        counts,
    ))
}

/// What a little less of each variance is worth: the derivative of the sum over views of the root of the sum over components.
fn worth(counts: &[usize], variances: &[f64], out: &mut [f64]) {
    // A view that is known to the last digit is worth no more than others.
    let least = 1e-6 * variances.iter().fold(1e-200, |a: f64, v| a.max(*v)).sqrt();
    let mut first = 0;
    for count in counts {
        let of = first..first + count;
        let error = variances[of.clone()].iter().sum::<f64>().sqrt();
        out[of].fill(0.5 / error.max(least));
        first += count;
    }
}

/// A BRDF that is known by ln(f + ε) at pairs.
pub(super) struct OfLogs<F> {
    pub symmetry: Symmetry,
    pub logs: F,
}

static LUMINANCE: Channels = Channels::Luminance;

impl<F: Fn(&[DirectionPair]) -> Vec<f64> + Send + Sync> Brdf for OfLogs<F> {
    fn channels(&self) -> &Channels {
        &LUMINANCE
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn is_mirrored(&self) -> bool {
        self.symmetry.bilateral
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let mut presence = [Presence::Present];
        self.eval_batch(std::slice::from_ref(pair), out, &mut presence);
        presence[0]
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        for (value, log) in out.iter_mut().zip((self.logs)(pairs)) {
            *value = (log.exp() - EPSILON).max(0.0);
        }
        presence.fill(Presence::Present);
    }
}
