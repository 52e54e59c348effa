//! A parameter that is one number, three, or a function of wavelength.

use super::Channels;
use super::channels::{ascending, mean_over};
use crate::error::{ParameterError, in_range};
use crate::numeric;
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::ops::RangeBounds;

/// A grey value, a linear R, G, B triple, or a sampled spectrum; a config writes `0.5`,
/// `[0.5, 0.4, 0.3]` or `{ nm = [400, 550, 700], values = [0.1, 0.4, 0.3] }`.
///
/// A grey value suits every scene, a triple one in luminance or R, G, B, a sampled spectrum one of
/// wavelengths; [`within`](Self::within) refuses the rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Spectrum {
    /// One value for every channel.
    Grey(f64),
    /// R, G, B.
    Rgb([f64; 3]),
    /// Values at wavelengths.
    Sampled(SampledSpectrum),
}

/// Values at ascending wavelengths, linear in between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledSpectrum {
    /// Wavelengths, nm.
    nm: Vec<f64>,
    /// One a wavelength.
    values: Vec<f64>,
}

impl SampledSpectrum {
    /// The most samples there may be.
    pub const MAX: usize = 4096;

    /// From 1 to [`MAX`](Self::MAX) ascending wavelengths (nm) and as many values.
    ///
    /// # Errors
    /// Other numbers of either, or wavelengths that do not ascend or are outside
    /// [`Wavelengths::RANGE_NM`](super::Wavelengths::RANGE_NM); the key is `nm` or `values`.
    pub fn new(nm: Vec<f64>, values: Vec<f64>) -> Result<Self, ParameterError> {
        if !(1..=Self::MAX).contains(&nm.len()) {
            let found = format!("{} wavelengths", nm.len());
            let allowed = format!("1 to {} of them", Self::MAX);
            return Err(ParameterError::new("nm", found, allowed));
        }
        if nm.len() != values.len() {
            let found = format!("{} numbers", values.len());
            let allowed = format!("as many as nm has, {}", nm.len());
            return Err(ParameterError::new("values", found, allowed));
        }
        ascending("nm", &nm)?;
        Ok(Self { nm, values })
    }

    /// First and last wavelength, nm.
    fn range(&self) -> [f64; 2] {
        [self.nm[0], self.nm[self.nm.len() - 1]]
    }

    /// The value at a wavelength (nm); outside the range the nearest.
    fn value_at(&self, nm: f64) -> f64 {
        let above = self.nm.partition_point(|x| *x < nm);
        let (below, above) = (above.saturating_sub(1), above.min(self.nm.len() - 1));
        let [x0, x1] = [self.nm[below], self.nm[above]];
        let [y0, y1] = [self.values[below], self.values[above]];
        if nm >= x1 || below == above {
            // Also at a sample itself, whose value stays what was written.
            return y1;
        }
        y0 + (y1 - y0) * ((nm - x0) / (x1 - x0))
    }
}

impl Spectrum {
    /// R, G, B; grey if there are no colours.
    pub fn rgb(&self) -> [f64; 3] {
        match self {
            Spectrum::Grey(v) => [*v; 3],
            Spectrum::Rgb(v) => *v,
            Spectrum::Sampled(s) => [mean_over(&s.nm, &s.values); 3],
        }
    }

    /// Rec. 709 luminance; of a sampled spectrum the mean over its wavelengths.
    pub fn luminance(&self) -> f64 {
        match self {
            Spectrum::Sampled(s) => mean_over(&s.nm, &s.values),
            _ => numeric::luminance(self.rgb()),
        }
    }

    /// The values of a scene's channels, one each: right where the BRDF is linear in this parameter,
    /// because then the luminance of the BRDF is the BRDF of the luminance.
    pub fn linear(&self, channels: &Channels) -> Vec<f64> {
        match channels {
            Channels::Luminance => vec![self.luminance()],
            _ => (0..channels.count())
                .map(|c| self.plane(c, channels))
                .collect(),
        }
    }

    /// How many different values there are to work out where a BRDF is not linear in this
    /// parameter: 1 if grey, 3 (in luminance too) if in colour, else one a wavelength.
    pub fn distinct(&self, channels: &Channels) -> usize {
        match (self, channels) {
            (Spectrum::Rgb(_), Channels::Luminance | Channels::Rgb) => 3,
            (Spectrum::Sampled(_), Channels::Wavelengths(w)) => w.nm().len(),
            (Spectrum::Grey(_) | Spectrum::Rgb(_) | Spectrum::Sampled(_), _) => 1,
        }
    }

    /// Value `plane` of as many as the parameters of a model have together, for a scene that
    /// [`within`](Self::within) accepts.
    pub fn plane(&self, plane: usize, channels: &Channels) -> f64 {
        match (self, channels) {
            (Spectrum::Grey(v), _) => *v,
            (Spectrum::Rgb(v), Channels::Luminance | Channels::Rgb) => v[plane],
            (Spectrum::Sampled(s), Channels::Wavelengths(w)) => s.value_at(w.nm()[plane]),
            // What `within` refuses is taken for grey.
            (Spectrum::Rgb(_) | Spectrum::Sampled(_), _) => self.luminance(),
        }
    }

    /// Checks every value against a range, and that a scene in `channels` can make use of it.
    ///
    /// # Errors
    /// A value outside the range; R, G, B in a scene of wavelengths; a sampled spectrum in another,
    /// or one that does not reach from the first wavelength of the scene to its last.
    pub fn within(
        &self,
        key: &str,
        range: impl RangeBounds<f64>,
        channels: &Channels,
    ) -> Result<(), ParameterError> {
        let refuse = |found, allowed| Err(ParameterError::new(key, found, allowed));
        let values = match (self, channels.wavelengths()) {
            (Spectrum::Grey(v), _) => std::slice::from_ref(v),
            (Spectrum::Rgb(v), None) => v,
            (Spectrum::Rgb([r, g, b]), Some(_)) => {
                let allowed = "a number or { nm, values } in a scene of wavelengths";
                return refuse(format!("[{r}, {g}, {b}]"), allowed.to_owned());
            }
            (Spectrum::Sampled(s), scene) => {
                let [first, last] = s.range();
                let found = format!("{{ nm = [{first} to {last}], … }}");
                let Some(scene) = scene else {
                    let allowed = "a number or [r, g, b] in a scene without wavelengths";
                    return refuse(found, allowed.into());
                };
                let nm = scene.nm();
                let [from, to] = [nm[0], nm[nm.len() - 1]];
                if from < first || to > last {
                    let allowed =
                        format!("samples from {from} to {to} nm, the wavelengths of the scene");
                    return refuse(found, allowed);
                }
                &s.values
            }
        };
        values
            .iter()
            .try_for_each(|&v| in_range(key, v, &range).map(drop))
    }
}

/// A number that has a range.
pub(crate) trait Limited {
    /// Checks a number against a range, in any channels.
    fn within(
        &self,
        key: &str,
        range: impl RangeBounds<f64>,
        channels: &Channels,
    ) -> Result<(), ParameterError>;
}

impl Limited for f64 {
    fn within(
        &self,
        key: &str,
        range: impl RangeBounds<f64>,
        _channels: &Channels,
    ) -> Result<(), ParameterError> {
        in_range(key, *self, &range).map(drop)
    }
}

/// [`linear`](Spectrum::linear) times a factor.
pub(super) fn scaled(spectrum: &Spectrum, channels: &Channels, factor: f64) -> Vec<f64> {
    let mut values = spectrum.linear(channels);
    values.iter_mut().for_each(|v| *v *= factor);
    values
}

/// The values that go together of the parameters a BRDF is not linear in: one set if all are grey,
/// else one a colour or wavelength.
pub(super) fn planes<'a, const N: usize>(
    spectra: [&'a Spectrum; N],
    channels: &'a Channels,
) -> impl ExactSizeIterator<Item = [f64; N]> + 'a {
    let count = spectra.map(|s| s.distinct(channels)).into_iter().max();
    (0..count.unwrap_or(1)).map(move |i| spectra.map(|s| s.plane(i, channels)))
}

/// Writes the channels of a scene from `count` different values, in ascending order: one for all, the
/// luminance of three, or one each.
#[inline]
pub(super) fn spread(count: usize, out: &mut [f64], mut value: impl FnMut(usize) -> f64) {
    if count == 1 {
        out.fill(value(0));
    } else if out.len() == 1 {
        out[0] = numeric::luminance([value(0), value(1), value(2)]);
    } else {
        for (c, out) in out.iter_mut().enumerate() {
            *out = value(c);
        }
    }
}

/// `0.5`, `0.5-0.4-0.3` or `400-700nm`: a piece of a label.
impl fmt::Display for Spectrum {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Spectrum::Grey(v) => write!(f, "{v}"),
            Spectrum::Rgb([r, g, b]) => write!(f, "{r}-{g}-{b}"),
            Spectrum::Sampled(s) => write!(f, "{}-{}nm", s.range()[0], s.range()[1]),
        }
    }
}

impl<'de> Deserialize<'de> for Spectrum {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct V;
        impl<'de> Visitor<'de> for V {
            type Value = Spectrum;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, three numbers [r, g, b] or { nm = [...], values = [...] }")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Spectrum, E> {
                Ok(Spectrum::Grey(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Spectrum, E> {
                Ok(Spectrum::Grey(v as f64))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Spectrum, A::Error> {
                let mut rgb = [0.0; 3];
                for (i, v) in rgb.iter_mut().enumerate() {
                    *v = seq
                        .next_element()?
                        .ok_or_else(|| de::Error::invalid_length(i, &self))?;
                }
                if seq.next_element::<f64>()?.is_some() {
                    return Err(de::Error::invalid_length(4, &self));
                }
                Ok(Spectrum::Rgb(rgb))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Spectrum, A::Error> {
                let read = de::value::MapAccessDeserializer::new(map);
                let SampledSpectrum { nm, values } = SampledSpectrum::deserialize(read)?;
                let sampled = SampledSpectrum::new(nm, values).map_err(de::Error::custom)?;
                Ok(Spectrum::Sampled(sampled))
            }
        }
        deserializer.deserialize_any(V)
    }
}
