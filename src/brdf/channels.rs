//! What an evaluation returns: luminance, R, G, B, or one value a wavelength.

use crate::error::ParameterError;
use crate::numeric;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// What a scene asks a BRDF to return; fixed when the BRDF is built, so that a scene in
/// luminance does one channel of work and a table in luminance holds one plane.
///
/// A config writes `"luminance"`, `"rgb"`, `{ wavelengths_nm = [450, 550, 650] }` or
/// `{ wavelengths_nm = { from = 400, to = 700, step = 10 } }`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channels {
    /// One value: Rec. 709 luminance.
    Luminance,
    /// Three values: linear R, G, B.
    Rgb,
    /// One value a wavelength.
    #[serde(rename = "wavelengths_nm")]
    Wavelengths(Wavelengths),
}

impl Channels {
    /// Number of values per evaluation: 1, 3, or the number of wavelengths.
    #[inline]
    pub fn count(&self) -> usize {
        match self {
            Channels::Luminance => 1,
            Channels::Rgb => 3,
            Channels::Wavelengths(w) => w.nm().len(),
        }
    }

    /// Luminance of one evaluation of this kind, sr⁻¹. Of a spectrum it is the mean over wavelength
    /// by the trapezoid rule (Abramowitz and Stegun 1964, 25.4.1), in the ultraviolet and infrared too: what a sensor of flat
    /// response sees.
    #[inline]
    pub fn luminance(&self, values: &[f64]) -> f64 {
        match self {
            Channels::Luminance => values[0],
            Channels::Rgb => numeric::luminance([values[0], values[1], values[2]]),
            Channels::Wavelengths(w) => mean_over(w.nm(), values),
        }
    }

    /// R, G, B of one evaluation, for pictures: grey if it is not in colour.
    #[inline]
    pub fn rgb(&self, values: &[f64]) -> [f64; 3] {
        match self {
            Channels::Luminance | Channels::Wavelengths(_) => [self.luminance(values); 3],
            Channels::Rgb => [values[0], values[1], values[2]],
        }
    }

    /// What a channel is called: R, G, B, or its wavelength; luminance has no name.
    pub fn name(&self, channel: usize) -> Option<String> {
        match self {
            Channels::Luminance => None,
            Channels::Rgb => Some(["R", "G", "B"][channel].into()),
            Channels::Wavelengths(w) => Some(format!("{} nm", w.nm()[channel])),
        }
    }

    /// The wavelengths (nm), if there is one value for each.
    pub fn wavelengths(&self) -> Option<&Wavelengths> {
        match self {
            Channels::Wavelengths(w) => Some(w),
            Channels::Luminance | Channels::Rgb => None,
        }
    }
}

/// Mean over wavelength of values at ascending `nm`, by the trapezoid rule; of one value itself.
pub(super) fn mean_over(nm: &[f64], values: &[f64]) -> f64 {
    if let [value] = values {
        return *value;
    }
    let areas = nm.windows(2).zip(values.windows(2));
    let area: f64 = areas
        .map(|(nm, v)| 0.5 * (nm[1] - nm[0]) * (v[0] + v[1]))
        .sum();
    area / (nm[nm.len() - 1] - nm[0])
}

/// Wavelengths in nm, ascending: 1 to [`MAX`](Self::MAX) of them, each once. Cheap to clone.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written")]
pub struct Wavelengths(Arc<[f64]>);

impl Wavelengths {
    /// The most there may be.
    pub const MAX: usize = 512;

    /// Shortest and longest, nm: from the vacuum ultraviolet to the thermal infrared.
    pub const RANGE_NM: [f64; 2] = [100.0, 20_000.0];

    /// From ascending numbers of nm.
    ///
    /// # Errors
    /// Too few or too many, one outside [`RANGE_NM`](Self::RANGE_NM), or one that is not longer
    /// than the one before; the key is `wavelengths_nm`.
    ///
    /// ```
    /// use gonio::brdf::{Channels, Wavelengths};
    /// let channels = Channels::Wavelengths(Wavelengths::new(&[450.0, 550.0, 650.0])?);
    /// assert_eq!(channels.count(), 3);
    /// assert_eq!(channels.luminance(&[0.1, 0.3, 0.5]), 0.3);
    /// assert!(Wavelengths::new(&[650.0, 450.0]).is_err());
    /// # Ok::<(), gonio::error::ParameterError>(())
    /// ```
    pub fn new(nm: &[f64]) -> Result<Self, ParameterError> {
        if !(1..=Self::MAX).contains(&nm.len()) {
            return Err(refused(
                format!("{} values", nm.len()),
                format!("1 to {} of them", Self::MAX),
            ));
        }
        ascending(KEY, nm)?;
        Ok(Self(nm.into()))
    }

    /// The numbers, nm.
    #[inline]
    pub fn nm(&self) -> &[f64] {
        &self.0
    }

    /// From `from` to `to` in equal steps; `to` is one of them.
    fn stepped(Steps { from, to, step }: Steps) -> Result<Self, ParameterError> {
        let count = ((to - from) / step).round();
        if !(0.0..Self::MAX as f64).contains(&count)
            || (from + count * step - to).abs() > 1e-9 * to.abs()
        {
            let found = format!("{{ from = {from}, to = {to}, step = {step} }}");
            let allowed = format!(
                "a number of whole steps above 0 from the first to the last, at most {} wavelengths",
                Self::MAX
            );
            return Err(refused(found, allowed));
        }
        let count = count as usize;
        // Steps of decimals give decimals: a millionth of a nm is far below what is measured.
        let at = |i: usize| match i {
            0 => from,
            i if i == count => to,
            i => ((from + i as f64 * step) * 1e6).round() / 1e6,
        };
        let nm: Vec<f64> = (0..=count).map(at).collect();
        Self::new(&nm)
    }
}

const KEY: &str = "wavelengths_nm";

fn refused(value: String, allowed: String) -> ParameterError {
    ParameterError::new(KEY, value, allowed)
}

/// Checks that wavelengths (nm) ascend within the range that is allowed.
pub(super) fn ascending(key: &str, nm: &[f64]) -> Result<(), ParameterError> {
    let [lo, hi] = Wavelengths::RANGE_NM;
    let mut last = f64::NEG_INFINITY;
    for &nm in nm {
        if !(lo..=hi).contains(&nm) || nm <= last {
            let allowed = format!("numbers of nm in [{lo}, {hi}], each above the one before");
            return Err(ParameterError::new(key, nm, allowed));
        }
        last = nm;
    }
    Ok(())
}

/// Finite numbers, never NaN.
impl Eq for Wavelengths {}

impl Hash for Wavelengths {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.iter().for_each(|nm| nm.to_bits().hash(state));
    }
}

impl fmt::Debug for Wavelengths {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Steps {
    from: f64,
    to: f64,
    step: f64,
}

/// Wavelengths as a config writes them.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected numbers of nm, or { from, to, step } in nm"
)]
enum Written {
    List(Vec<f64>),
    Steps(Steps),
}

impl TryFrom<Written> for Wavelengths {
    type Error = ParameterError;

    fn try_from(written: Written) -> Result<Self, ParameterError> {
        match written {
            Written::List(nm) => Self::new(&nm),
            Written::Steps(steps) => Self::stepped(steps),
        }
    }
}
