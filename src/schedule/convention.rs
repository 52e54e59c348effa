//! Conventions of files that others wrote: names and units of their columns, where they count
//! azimuths from, what they call a value.

use crate::error::{excerpt, reason};
use crate::geometry::DirectionPair;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// One of the values of an option.
#[derive(Clone, Copy, Debug)]
pub struct Choice<T: 'static> {
    /// The value.
    pub value: T,
    /// What the command line calls it.
    pub name: &'static str,
    /// One line for help texts and the docs.
    pub meaning: &'static str,
}

/// A value with its name and what it means.
pub const fn choice<T>(value: T, name: &'static str, meaning: &'static str) -> Choice<T> {
    Choice {
        value,
        name,
        meaning,
    }
}

/// Names of choices, joined by commas.
pub(crate) fn names<T>(all: &[Choice<T>]) -> String {
    let names: Vec<_> = all.iter().map(|c| c.name).collect();
    names.join(", ")
}

/// Declares an enum of the values of an option, each with its name in files and on the command line and with what it means.
macro_rules! choices {
    (
        $(#[$about:meta])*
        pub enum $Type:ident {
            $($(#[$attribute:meta])* $Variant:ident = $name:literal: $meaning:literal,)+
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum $Type {
            $(
                $(#[$attribute])*
                #[serde(rename = $name)]
                $Variant,
            )+
        }

        impl $Type {
            /// Every value.
            pub const ALL: [Choice<Self>; [$($name),+].len()] =
                [$(choice(Self::$Variant, $name, $meaning)),+];
        }
    };
}

choices! {
    /// Unit of angles. A column that ends in `_` and the name of a unit is in it.
    pub enum AngleUnit {
        /// Degrees.
        Degrees = "deg": "degrees",
        /// Radians.
        Radians = "rad": "radians",
    }
}

impl AngleUnit {
    /// The angle in degrees.
    pub fn degrees(self, angle: f64) -> f64 {
        match self {
            Self::Degrees => angle,
            Self::Radians => angle.to_degrees(),
        }
    }
}

choices! {
    /// Where azimuths are counted from. Counted about the normal, between directions that point away
    /// from the sample, the mirror direction is 180° from the light.
    pub enum Azimuth {
        /// Both from an axis of the sample.
        Sample = "sample":
            "both from an axis of the sample: equal ones are retro, 180° apart is mirror",
        /// The sensor's from the light's.
        Light = "light": "the sensor's from the light's: 0 is retro, 180° mirror",
        /// The sensor's from that of the mirror direction.
        Mirror = "mirror": "the sensor's from the mirror direction's: 0 is mirror, 180° retro",
        /// Both from an axis of the sample, the light's where it goes to.
        Propagation = "propagation":
            "both from an axis of the sample, the light's is where it goes to: equal ones are mirror",
    }
}

impl Azimuth {
    /// Azimuths of light and sensor from an axis of the sample. `relative`: the sensor's is a
    /// difference to the light's, whatever its zero is.
    pub(crate) fn about_axis(self, relative: bool, half_turn: f64, [i, o]: [f64; 2]) -> [f64; 2] {
        let by_light = relative || matches!(self, Self::Light | Self::Mirror);
        let o = if by_light { i + o } else { o };
        match self {
            Self::Sample | Self::Light => [i, o],
            Self::Mirror => [i, o + half_turn],
            Self::Propagation => [i + half_turn, o],
        }
    }
}

choices! {
    /// The unit of the uncertainties of a file.
    pub enum UncertaintyUnit {
        /// That of the values.
        Value = "value": "in the unit of the values",
        /// A share of the value.
        Relative = "relative": "a share of the value: .02 is two percent",
        /// A hundred times that.
        Percent = "percent": "percent of the value",
    }
}

impl UncertaintyUnit {
    /// What multiplies an uncertainty of a value to have the unit of the value.
    pub(crate) fn factor(self, value: f64) -> f64 {
        match self {
            Self::Value => 1.0,
            Self::Relative => value.abs(),
            Self::Percent => 0.01 * value.abs(),
        }
    }
}

choices! {
    /// What a value of a file is.
    pub enum Quantity {
        /// f_r, sr⁻¹.
        Brdf = "brdf": "f_r, 1/sr, without any cosine",
        /// f_r cos theta_o, sr⁻¹.
        BrdfCosine = "brdf-cosine":
            "f_r cos theta_o, 1/sr: the cosine of the sensor (ALTA's INV_STERADIAN_COSINE_FACTOR, \
             the cosine-corrected BRDF of scatterometers)",
        /// f_r cos theta_i, sr⁻¹.
        BrdfCosineLight = "brdf-cosine-light":
            "f_r cos theta_i, 1/sr: the cosine of the light (our columns value_cos)",
        /// π f_r.
        ReflectanceFactor = "reflectance-factor": "pi f_r: 1 is a perfect matte white",
        /// 100 π f_r.
        Percent = "percent": "100 pi f_r: percent of a perfect matte white",
    }
}

impl Quantity {
    /// The number for a BRDF of 1 sr⁻¹.
    pub(crate) fn of_one(self, pair: &DirectionPair) -> f64 {
        match self {
            Self::Brdf => 1.0,
            Self::BrdfCosine => pair.omega_o.cos_theta(),
            Self::BrdfCosineLight => pair.omega_i.cos_theta(),
            Self::ReflectanceFactor => PI,
            Self::Percent => 100.0 * PI,
        }
    }
}

/// Conventions of a file of another program. What is not given is as in files of this one.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Conventions {
    /// Our names of columns and those in the file. With any, unknown columns are passed
    /// over.
    #[serde(deserialize_with = "columns")]
    pub columns: Vec<(String, String)>,
    /// The unit of angles whose column does not say it.
    pub angles: Option<AngleUnit>,
    /// True if polar angles count from the surface and not from the normal.
    pub elevation: bool,
    /// Where azimuths count from; by default from the sample, differences from the light.
    pub azimuth: Option<Azimuth>,
    /// What the values are; by default what the file says, else f_r.
    pub quantity: Option<Quantity>,
    /// The unit of uncertainties; by default that of the values.
    pub uncertainties: Option<UncertaintyUnit>,
    /// True if a file that was cut is read up to the cut.
    pub partial: bool,
    /// True if readings whose headers name several materials or instruments are taken for those of one.
    pub mixed: bool,
    /// A value that stands for no reading, beside the usual marks.
    pub no_reading: Option<f64>,
}

/// Columns from a table of their names.
fn columns<'de, D: Deserializer<'de>>(table: D) -> Result<Vec<(String, String)>, D::Error> {
    let names = BTreeMap::deserialize(table)?;
    Ok(names.into_iter().collect())
}

/// Angles of a pose, as the names of their columns begin.
pub(crate) const ANGLES: [&str; 5] = ["theta_i", "phi_i", "theta_o", "phi_o", "delta_phi"];

/// A name without the unit of an angle.
fn role(name: &str) -> &str {
    let mut units = AngleUnit::ALL.iter();
    let bare = units.find_map(|unit| name.strip_suffix(unit.name)?.strip_suffix('_'));
    bare.filter(|bare| ANGLES.contains(bare)).unwrap_or(name)
}

impl Conventions {
    /// Our names of these columns, with units; none of one whose name another column was given.
    ///
    /// # Errors
    /// A sentence: a name that is not there or there twice, an angle without a unit.
    pub(crate) fn our_names(&self, columns: &[String]) -> Result<Vec<String>, String> {
        for (i, (ours, theirs)) in self.columns.iter().enumerate() {
            let option = format!("--columns {}={}", excerpt(ours), excerpt(theirs));
            if !columns.contains(theirs) {
                let there = reason(columns.join(", "));
                return Err(format!(
                    "{option}: there is no such column; allowed: {there}"
                ));
            }
            let mut earlier = self.columns[..i].iter();
            if earlier.any(|(o, t)| role(o) == role(ours) || t == theirs) {
                return Err(format!(
                    "{option}: one of them is named before; allowed: each once"
                ));
            }
        }
        let name = |column: &String| {
            let mut given = self.columns.iter();
            let name = match given.find(|(_, theirs)| theirs == column) {
                Some((ours, _)) => ours,
                None if self.columns.iter().any(|(o, _)| role(o) == role(column)) => {
                    return Ok(String::new());
                }
                None => column,
            };
            if !ANGLES.contains(&name.as_str()) {
                return Ok(name.clone());
            }
            let said = |unit: &&Choice<AngleUnit>| column.ends_with(&format!("_{}", unit.name));
            let given = |unit: &&Choice<AngleUnit>| Some(unit.value) == self.angles;
            let units = AngleUnit::ALL;
            match units.iter().find(said).or(units.iter().find(given)) {
                Some(unit) => Ok(format!("{name}_{}", unit.name)),
                None => Err(format!(
                    "column {:?} does not say its unit; allowed: a name that ends in _deg or \
                     _rad, or --angles with one of {}",
                    excerpt(column),
                    names(&units)
                )),
            }
        };
        columns.iter().map(name).collect()
    }
}
