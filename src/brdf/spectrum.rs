//! A parameter that is one number or three.

use super::Channels;
use crate::error::{ParameterError, in_closed};
use crate::numeric;
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// A grey value or a linear R, G, B triple; a config writes `0.5` or `[0.5, 0.4, 0.3]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Spectrum {
    /// The same for every channel.
    Grey(f64),
    /// R, G, B.
    Rgb([f64; 3]),
}

impl Spectrum {
    /// R, G, B.
    pub fn rgb(self) -> [f64; 3] {
        match self {
            Spectrum::Grey(v) => [v; 3],
            Spectrum::Rgb(v) => v,
        }
    }

    /// The values of a scene's channels: right where the BRDF is linear in this parameter,
    /// because then the luminance of the BRDF is the BRDF of the luminance.
    pub fn linear(self, channels: Channels) -> [f64; 3] {
        match channels {
            Channels::Luminance => [numeric::luminance(self.rgb()), 0.0, 0.0],
            Channels::Rgb => self.rgb(),
        }
    }

    /// How many different values there are to work out: 1 if grey, 3 if not.
    pub fn distinct(self) -> usize {
        match self {
            Spectrum::Grey(_) => 1,
            Spectrum::Rgb(_) => 3,
        }
    }

    /// Checks every value against `[lo, hi]`.
    pub fn check(self, key: &str, lo: f64, hi: f64) -> Result<(), ParameterError> {
        match self {
            Spectrum::Grey(v) => in_closed(key, v, lo, hi).map(drop),
            Spectrum::Rgb(v) => v
                .iter()
                .try_for_each(|&v| in_closed(key, v, lo, hi).map(drop)),
        }
    }
}

/// `0.5`, or `0.5-0.4-0.3`: a piece of a label.
impl fmt::Display for Spectrum {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Spectrum::Grey(v) => write!(f, "{v}"),
            Spectrum::Rgb([r, g, b]) => write!(f, "{r}-{g}-{b}"),
        }
    }
}

impl<'de> Deserialize<'de> for Spectrum {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct V;
        impl<'de> Visitor<'de> for V {
            type Value = Spectrum;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or three numbers [r, g, b]")
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
        }
        deserializer.deserialize_any(V)
    }
}
