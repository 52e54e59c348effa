//! Monotone warps of one axis: what a config can name, and the maps that does.

use super::{Axis, AxisKind, Quantity, Unit, WarpProblem};
use crate::error::{ParameterError, in_closed, listed};
use crate::registry::{self, Entry, NoKeys, ReadError, Table};
use serde::de::{self, DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::fmt;

/// Warps by axis symbol.
pub type Warps = BTreeMap<String, WarpSpec>;

/// A warp as a config names it: `"square-root"`, or a table where it has keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WarpSpec {
    /// u = sqrt(x / x_max) in [0, 1]: fine near the pole; any radial axis.
    SquareRoot,
    /// u = 90 sqrt(theta_h / 90°) in [0, 90], the row index of a MERL table; half angles only.
    Merl,
    /// u = asin(x / x_max) in [0, π/2]: fine near the end, e.g. |k| → theta_d; lengths and angles.
    Arcsine,
    /// u = (x / x_max)^exponent in [0, 1]; any radial axis.
    Power {
        /// In [0.1, 1]: at 0.1 half of the axis holds a thousandth (2^-10) of its range, and a
        /// round trip loses 1/exponent ulp.
        exponent: f64,
    },
    /// u = asinh(x / s) / asinh(x_max / s) in [0, 1], s = scale x_max: equal steps up to s, steps that
    /// grow in proportion to x beyond; any radial axis.
    Asinh {
        /// Share of the axis, in [1e-4, 1]: at 1e-4 a round trip loses 10 ulp at the end of the axis.
        scale: f64,
    },
}

/// The keys of `power`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PowerKeys {
    exponent: f64,
}

/// The keys of `asinh`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AsinhKeys {
    scale: f64,
}

/// The entry of a warp without keys.
const fn plain(
    kind: &'static str,
    summary: &'static str,
    read: fn(Table<'_>) -> Result<Box<WarpSpec>, ReadError>,
) -> Entry<WarpSpec> {
    Entry {
        kind,
        summary,
        examples: &[""],
        read,
    }
}

/// The warp of the keys of a table.
fn keyed<K: DeserializeOwned>(
    table: Table<'_>,
    warp: fn(K) -> Result<WarpSpec, ParameterError>,
) -> Result<Box<WarpSpec>, ReadError> {
    let span = table.span();
    let warp = warp(registry::parse(table)?);
    warp.map(Box::new)
        .map_err(|e| ReadError::new(span, e.to_string()))
}

/// Every warp a config can name.
pub fn warps() -> Vec<Entry<WarpSpec>> {
    vec![
        plain(
            "square-root",
            "sqrt(x / x_max), in [0, 1]: fine near the pole; any radial axis",
            |table| keyed(table, |NoKeys {}| Ok(WarpSpec::SquareRoot)),
        ),
        plain(
            "merl",
            "90 sqrt(theta_h / 90°), in [0, 90]: the rows of a MERL table; theta_h",
            |table| keyed(table, |NoKeys {}| Ok(WarpSpec::Merl)),
        ),
        plain(
            "arcsine",
            "asin(x / x_max): fine near the end; of a length in degrees, e.g. |k| becomes theta_d, of an \
             angle over its largest, in [0, 1]",
            |table| keyed(table, |NoKeys {}| Ok(WarpSpec::Arcsine)),
        ),
        Entry {
            kind: POWER,
            summary: "(x / x_max)^exponent, in [0, 1]: 0.5 is the square root; any radial axis",
            examples: &["exponent = 0.5", "exponent = 0.3", "exponent = 1.0"],
            read: |table| keyed(table, |PowerKeys { exponent }| power(exponent)),
        },
        Entry {
            kind: ASINH,
            summary: "asinh(x / s) over its largest, in [0, 1], s = scale x_max: steps grow with x from s on; \
                      any radial axis",
            examples: &["scale = 0.01", "scale = 1.0"],
            read: |table| keyed(table, |AsinhKeys { scale }| asinh(scale)),
        },
    ]
}

const POWER: &str = "power";
const ASINH: &str = "asinh";

fn power(exponent: f64) -> Result<WarpSpec, ParameterError> {
    let exponent = in_closed("exponent", exponent, 0.1, 1.0)?;
    Ok(WarpSpec::Power { exponent })
}

fn asinh(scale: f64) -> Result<WarpSpec, ParameterError> {
    let scale = in_closed("scale", scale, 1e-4, 1.0)?;
    Ok(WarpSpec::Asinh { scale })
}

impl WarpSpec {
    /// The kind in configs.
    pub fn kind(self) -> &'static str {
        match self {
            WarpSpec::SquareRoot => "square-root",
            WarpSpec::Merl => "merl",
            WarpSpec::Arcsine => "arcsine",
            WarpSpec::Power { .. } => POWER,
            WarpSpec::Asinh { .. } => ASINH,
        }
    }

    /// The kind and every key with its value.
    pub fn resolved(self) -> registry::Keys {
        match self {
            WarpSpec::Power { exponent } => registry::resolved(POWER, &PowerKeys { exponent }),
            WarpSpec::Asinh { scale } => registry::resolved(ASINH, &AsinhKeys { scale }),
            WarpSpec::SquareRoot | WarpSpec::Merl | WarpSpec::Arcsine => {
                registry::resolved(self.kind(), &NoKeys {})
            }
        }
    }

    /// Name in results and headers of files: the kind, `power-0.3` of a power, `asinh-0.01`.
    pub fn name(self) -> String {
        match self {
            WarpSpec::Power { exponent } => format!("{POWER}-{exponent}"),
            WarpSpec::Asinh { scale } => format!("{ASINH}-{scale}"),
            WarpSpec::SquareRoot | WarpSpec::Merl | WarpSpec::Arcsine => self.kind().into(),
        }
    }

    /// The warp of a [`name`](Self::name).
    pub fn named(name: &str) -> Option<Self> {
        let warp = match name.split_once('-') {
            Some((POWER, exponent)) => power(exponent.parse().ok()?).ok()?,
            Some((ASINH, scale)) => asinh(scale.parse().ok()?).ok()?,
            _ => Self::of_kind(name).ok()?,
        };
        (warp.name() == name).then_some(warp)
    }

    /// A warp without keys.
    fn of_kind(kind: &str) -> Result<Self, ReadError> {
        let all = warps();
        let Some(entry) = all.iter().find(|e| e.kind == kind) else {
            // As serde refuses a variant, so that the config reader's words fit it.
            let allowed = listed(all.iter().map(|e| format!("`{}`", e.kind)));
            return Err(ReadError {
                message: format!("unknown variant `{kind}`, expected one of {allowed}"),
                span: None,
            });
        };
        Ok(*registry::read_text(entry, "")?)
    }

    /// True if equal steps of the warped coordinate get much shorter towards the start of the axis; of
    /// `asinh` up to a scale of a tenth, where the first are a tenth of the last.
    pub fn crowds_start(self) -> bool {
        match self {
            WarpSpec::SquareRoot | WarpSpec::Merl => true,
            WarpSpec::Arcsine => false,
            WarpSpec::Power { exponent } => exponent < 1.0,
            WarpSpec::Asinh { scale } => scale <= 0.1,
        }
    }

    /// The map on an axis, and the axis as it becomes.
    pub(super) fn on(self, axis: &Axis) -> Result<(Warp, Axis), WarpProblem> {
        let [lo, max] = axis.range;
        if axis.kind != AxisKind::Radial || lo != 0.0 {
            return Err(WarpProblem::NotRadial);
        }
        let (warp, top, unit) = match self {
            WarpSpec::SquareRoot => (Warp::Root { top: 1.0, max }, 1.0, Unit::One),
            WarpSpec::Merl if axis.quantity == Quantity::HalfAngle => {
                (Warp::Root { top: 90.0, max }, 90.0, Unit::One)
            }
            WarpSpec::Merl => return Err(WarpProblem::NotThetaH),
            WarpSpec::Arcsine if axis.quantity == Quantity::Other => {
                return Err(WarpProblem::NoArcsine);
            }
            WarpSpec::Arcsine => {
                // That of a length is an angle; that of an angle is none.
                let (top, unit) = match axis.unit {
                    Unit::Radian => (1.0, Unit::One),
                    Unit::One => (FRAC_PI_2, Unit::Radian),
                };
                let scale = top / FRAC_PI_2;
                (Warp::Arcsine { scale, max }, top, unit)
            }
            WarpSpec::Asinh { scale } => {
                let scale = scale * max;
                let top = (max / scale).asinh();
                (Warp::Asinh { scale, top, max }, 1.0, Unit::One)
            }
            WarpSpec::Power { exponent } => {
                let inverse = 1.0 / exponent;
                let warp = Warp::Power {
                    exponent,
                    inverse,
                    max,
                };
                (warp, 1.0, Unit::One)
            }
        };
        let bent = Axis {
            range: [0.0, top],
            warp: Some(self),
            unit,
            ..*axis
        };
        Ok((warp, bent))
    }
}

impl Serialize for WarpSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            WarpSpec::Power { .. } | WarpSpec::Asinh { .. } => {
                self.resolved().serialize(serializer)
            }
            WarpSpec::SquareRoot | WarpSpec::Merl | WarpSpec::Arcsine => {
                serializer.serialize_str(self.kind())
            }
        }
    }
}

impl<'de> Deserialize<'de> for WarpSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct V;
        impl<'de> Visitor<'de> for V {
            type Value = WarpSpec;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a warp, or a table with its kind and keys")
            }
            fn visit_str<E: de::Error>(self, kind: &str) -> Result<WarpSpec, E> {
                WarpSpec::of_kind(kind).map_err(E::custom)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<WarpSpec, A::Error> {
                let keys = registry::Keys::deserialize(de::value::MapAccessDeserializer::new(map))?;
                // Its place is that of the warp: the key is named here.
                let named = |e: ReadError| e.message.replacen("unknown field", "unknown key", 1);
                registry::read_keys("warp", &warps(), keys)
                    .map(|warp| *warp)
                    .map_err(|e| de::Error::custom(named(e)))
            }
        }
        deserializer.deserialize_any(V)
    }
}

/// A monotone map of one axis; odd, so that it extends through the pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Warp {
    /// u = x.
    Identity,
    /// u = top · sqrt(x/max).
    Root {
        /// Largest warped value.
        top: f64,
        /// Largest plain value.
        max: f64,
    },
    /// u = scale · asin(x/max).
    Arcsine {
        /// Largest warped value, over a right angle.
        scale: f64,
        /// Largest plain value.
        max: f64,
    },
    /// u = asinh(x/scale) / top.
    Asinh {
        /// Where steps begin to grow.
        scale: f64,
        /// asinh(max/scale).
        top: f64,
        /// Largest plain value.
        max: f64,
    },
    /// u = (x/max)^exponent.
    Power {
        /// The exponent, in (0, 1].
        exponent: f64,
        /// One over it.
        inverse: f64,
        /// Largest plain value.
        max: f64,
    },
}

impl Warp {
    /// Plain to warped.
    #[inline]
    pub fn forward(self, x: f64) -> f64 {
        match self {
            Warp::Identity => x,
            Warp::Root { top, max } => (top * (x.abs() / max).sqrt()).copysign(x),
            Warp::Arcsine { scale, max } => scale * (x / max).asin(),
            Warp::Asinh { scale, top, .. } => (x / scale).asinh() / top,
            Warp::Power { exponent, max, .. } => (x.abs() / max).powf(exponent).copysign(x),
        }
    }

    /// Plain to warped, of many in place.
    pub(super) fn forward_all<'a>(self, all: impl Iterator<Item = &'a mut f64>) {
        if self != Warp::Identity {
            all.for_each(|x| *x = self.forward(*x));
        }
    }

    /// Warped to plain.
    #[inline]
    pub fn inverse(self, u: f64) -> f64 {
        match self {
            Warp::Identity => u,
            Warp::Root { top, max } => {
                let t = u / top;
                // (1 + ulp)² · max would leave the axis. Not `min`: that would lose NaN.
                let t2 = if t * t > 1.0 { 1.0 } else { t * t };
                (t2 * max).copysign(u)
            }
            Warp::Arcsine { scale, max } => (u / scale).sin() * max,
            Warp::Asinh { scale, top, max } => {
                let x = scale * (u * top).sinh();
                if x.abs() > max { max.copysign(x) } else { x }
            }
            Warp::Power { inverse, max, .. } => {
                let t = u.abs().powf(inverse);
                let t = if t > 1.0 { 1.0 } else { t };
                (t * max).copysign(u)
            }
        }
    }

    /// dx/du at `u`.
    #[inline]
    pub fn slope(self, u: f64) -> f64 {
        match self {
            Warp::Identity => 1.0,
            Warp::Root { top, max } => 2.0 * max * u.abs() / (top * top),
            Warp::Arcsine { scale, max } => (u / scale).cos() * max / scale,
            Warp::Asinh { scale, top, .. } => scale * top * (u * top).cosh(),
            Warp::Power { inverse, max, .. } => max * inverse * u.abs().powf(inverse - 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Symmetry;
    use crate::parametrization::{Form, HalfDifference, Hybrid, Parametrization};

    #[test]
    fn steps_crowd_the_start_where_they_are_a_tenth_of_the_last() {
        let axis = Form::<HalfDifference>::new(Symmetry::FULL).axes()[0];
        let scales = [1e-4, 0.09, 0.11, 0.5].map(|scale| WarpSpec::Asinh { scale });
        let examples = warps().into_iter().flat_map(|entry| {
            let read = move |text: &&str| *registry::read_text(&entry, text).unwrap();
            entry.examples.iter().map(read).collect::<Vec<_>>()
        });
        for spec in examples.chain(scales) {
            let (warp, bent) = spec.on(&axis).unwrap();
            let crowds = warp.slope(0.0) < 0.1 * warp.slope(bent.range[1]);
            assert_eq!(spec.crowds_start(), crowds, "{spec:?}");
        }
    }

    #[test]
    fn the_arcsine_of_a_length_is_an_angle_and_that_of_an_angle_a_share() {
        let [theta_d, k] = [
            Form::<HalfDifference>::new(Symmetry::FULL).axes()[1],
            Form::<Hybrid>::new(Symmetry::FULL).axes()[1],
        ];
        for (axis, unit, top) in [(theta_d, Unit::One, 1.0), (k, Unit::Radian, FRAC_PI_2)] {
            let (warp, bent) = WarpSpec::Arcsine.on(&axis).unwrap();
            assert_eq!((bent.unit, bent.range), (unit, [0.0, top]));
            assert!((warp.forward(axis.range[1]) - top).abs() < 1e-15);
            assert!((warp.forward(0.5 * axis.range[1]) - top / 3.0).abs() < 1e-15);
        }
    }
}
