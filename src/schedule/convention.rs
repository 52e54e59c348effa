//! Conventions of files that others wrote: names and units of their columns, where they count
//! azimuths from, what they call a value.

use super::names::{self, ANGLES};
use crate::error::{excerpt, listed, reason};
use crate::geometry::DirectionPair;
use rustc_hash::{FxHashMap, FxHashSet};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::num::NonZeroUsize;

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
pub(crate) fn names_of<T>(all: &[Choice<T>]) -> String {
    listed(all.iter().map(|c| c.name))
}

/// Declares an enum of the values of an option, each with its name in files and on the command line and with what it means, which is its doc.
macro_rules! choices {
    (
        $(#[$about:meta])*
        pub enum $Type:ident {
            $($Variant:ident = $name:literal: $meaning:literal,)+
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum $Type {
            $(
                #[doc = $meaning]
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
        Degrees = "deg": "degrees",
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
        Sample = "sample":
            "both from an axis of the sample: equal ones are retro, 180° apart is mirror",
        Light = "light": "the sensor's from the light's: 0 is retro, 180° mirror",
        Mirror = "mirror": "the sensor's from the mirror direction's: 0 is mirror, 180° retro",
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
        Value = "value": "in the unit of the values",
        Relative = "relative": "a share of the value: .02 is two percent",
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
    /// Which values of a file that has those of s and of p polarised light are read.
    pub enum Polarisation {
        Mean = "mean": "the mean of both, as for light that is not polarised",
        S = "s": "across the plane of incidence",
        P = "p": "in the plane of incidence",
    }
}

impl Polarisation {
    pub(crate) fn note(self) -> String {
        let what = match self {
            Self::Mean => "the mean of s and p polarised light (--polarisation s or p)",
            Self::S => "s polarised light",
            Self::P => "p polarised light",
        };
        format!("values are those of {what}")
    }
}

choices! {
    /// What a value of a file is.
    pub enum Quantity {
        Brdf = "brdf": "f_r, 1/sr, without any cosine",
        BrdfCosine = "brdf-cosine":
            "f_r cos theta_o, 1/sr: the cosine of the sensor (ALTA's INV_STERADIAN_COSINE_FACTOR, \
             the cosine-corrected BRDF of scatterometers)",
        BrdfCosineLight = "brdf-cosine-light":
            "f_r cos theta_i, 1/sr: the cosine of the light (our columns value_cos)",
        ReflectanceFactor = "reflectance-factor": "pi f_r: 1 is a perfect matte white",
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
    /// Standard deviations that uncertainties are, from above 0; by default 1.
    pub coverage_factor: Option<f64>,
    /// Which values are read of s and p polarised light; by default their mean.
    pub polarisation: Option<Polarisation>,
    /// True if a file that was cut is read up to the cut.
    pub partial: bool,
    /// True if readings whose headers name several materials or instruments are taken for those of one.
    pub mixed: bool,
    /// A value that stands for no reading, beside the usual marks.
    pub no_reading: Option<f64>,
    /// Readings of each stop that rows are averaged to, where rows are pixels of pictures with a column of the stop.
    #[serde(deserialize_with = "whole_pixels")]
    pub pixels: Option<NonZeroUsize>,
}

/// Readings of each stop.
///
/// # Errors
/// If it is no whole number from 1 to a million.
pub(crate) fn whole_pixels<'de, D: Deserializer<'de>>(
    value: D,
) -> Result<Option<NonZeroUsize>, D::Error> {
    let allowed = || D::Error::custom("pixels: allowed is a whole number from 1 to 1000000");
    let number = f64::deserialize(value)?;
    let is_allowed = number.fract() == 0.0 && (1.0..=1e6).contains(&number);
    let number = NonZeroUsize::new(number as usize).filter(|_| is_allowed);
    number.map(Some).ok_or_else(allowed)
}

/// Columns from a table of their names.
fn columns<'de, D: Deserializer<'de>>(table: D) -> Result<Vec<(String, String)>, D::Error> {
    let names = BTreeMap::deserialize(table)?;
    Ok(names.into_iter().collect())
}

/// A name without the unit of an angle.
fn role(name: &str) -> &str {
    match names::split_angle(name) {
        (bare, _) if ANGLES.contains(&bare) => bare,
        _ => name,
    }
}

/// What a column is of whose unit nothing names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unsaid {
    Angle,
    Wavelength,
}

/// Between which wavelengths light is, nm.
const LIGHT_NM: [f64; 2] = [100.0, 2e4];

impl Unsaid {
    /// The name of the only unit that numbers from `least` to `most` can have, and the factor to ours; `None` of several.
    pub(crate) fn unit(self, [least, most]: [f64; 2]) -> Option<(&'static str, f64)> {
        match self {
            Self::Angle => (most > 2.0 * PI + 1e-3).then_some(("degrees", 1.0)),
            Self::Wavelength => {
                let [from, to] = LIGHT_NM;
                let is_light = |factor: f64| least * factor >= from && most * factor <= to;
                let mut units = names::WAVELENGTHS.into_iter();
                units.find(|(_, factor)| is_light(*factor))
            }
        }
    }

    pub(crate) fn refuse(self, label: &str) -> String {
        let allowed = match self {
            Self::Angle => format!(
                "a name that ends in _deg or _rad, or --angles with one of {}",
                names_of(&AngleUnit::ALL)
            ),
            Self::Wavelength => "a name that ends in _nm, _um or _m".into(),
        };
        format!("column {label:?} does not say its unit; allowed: {allowed}")
    }
}

/// Our name of a column of a file.
#[derive(Clone, Debug)]
pub(crate) struct NamedColumn {
    /// The name; none of a column whose name another one was given.
    pub name: String,
    /// What multiplies its numbers.
    pub factor: f64,
    /// Of a column whose unit nothing names; its name has ours.
    pub unsaid: Option<Unsaid>,
    /// True if `--columns` names it.
    pub is_given: bool,
}

/// Stands for any letters in the names of `--columns`.
const ANY: char = '*';

/// What stands for [`ANY`] of a pattern in a label.
fn filling<'l>(pattern: &str, label: &'l str) -> Option<&'l str> {
    let (before, after) = pattern.split_once(ANY)?;
    let filling = label.strip_prefix(before)?.strip_suffix(after)?;
    Some(filling).filter(|filling| !filling.is_empty())
}

/// Columns that `--columns` names, of which there may be tens of thousands: our names by place, and those without units.
type Given = (FxHashMap<usize, String>, FxHashSet<String>);

impl Conventions {
    /// A polar angle (degrees) counted from the normal.
    pub(super) fn theta(&self, degrees: f64) -> f64 {
        match self.elevation {
            true => 90.0 - degrees,
            false => degrees,
        }
    }

    /// The place of the column that `theirs` is: its label, or its number from 1.
    fn place(theirs: &str, labels: &[String]) -> Option<usize> {
        let find = |is: &dyn Fn(&str) -> bool| labels.iter().position(|label| is(label));
        let by_label = find(&|label| label == theirs);
        // A unit may stand behind a name, or below it.
        let by_name = || find(&|label| names::split(label).0 == theirs);
        by_label.or_else(by_name).or_else(|| {
            let number: usize = theirs.parse().ok()?;
            number.checked_sub(1).filter(|i| *i < labels.len())
        })
    }

    /// True of a label that `--columns` names.
    pub(crate) fn names(&self, label: &str) -> bool {
        let mut all = self.columns.iter();
        all.any(|(_, theirs)| {
            let is_number = theirs.parse::<f64>().is_ok();
            let bare = names::split(label).0;
            !is_number && (theirs == label || theirs == bare) || filling(theirs, label).is_some()
        })
    }

    /// True if `--columns` calls columns by their numbers alone.
    pub(crate) fn are_numbers(&self) -> bool {
        let is_number = |(_, theirs): &(String, String)| theirs.parse::<usize>().is_ok();
        !self.columns.is_empty() && self.columns.iter().all(is_number)
    }

    /// The columns that `--columns` names, one for each label that is like a pattern.
    fn given(&self, labels: &[String]) -> Result<Given, String> {
        let (mut given, mut roles) = Given::default();
        for (ours, theirs) in &self.columns {
            let option = format!("--columns {}={}", excerpt(ours), excerpt(theirs));
            let found: Vec<(String, usize)> = match ours.contains(ANY) && theirs.contains(ANY) {
                true => (labels.iter().enumerate())
                    .filter_map(|(i, label)| {
                        let filling = filling(theirs, label)?;
                        Some((ours.replacen(ANY, filling, 1), i))
                    })
                    .collect(),
                false => Vec::from_iter(Self::place(theirs, labels).map(|i| (ours.clone(), i))),
            };
            let refuse =
                |why: &str, allowed: &str| Err(format!("{option}: {why}; allowed: {allowed}"));
            if found.is_empty() {
                return refuse("there is no such column", &reason(labels.join(", ")));
            }
            for (ours, i) in found {
                let is_new = roles.insert(role(&ours).to_owned());
                if !is_new || given.insert(i, ours).is_some() {
                    return refuse("one of them is named before", "each once");
                }
            }
        }
        Ok((given, roles))
    }

    /// Our names of these columns, with units, or a sentence on a name that is not there or there twice.
    pub(crate) fn our_names(&self, labels: &[String]) -> Result<Vec<NamedColumn>, String> {
        let (given, roles) = self.given(labels)?;
        let name = |(i, label): (usize, &String)| {
            let by_user = given.get(&i);
            let written = by_user.unwrap_or(label);
            let found = names::ours(written);
            let (mut name, mut factor) = found.unwrap_or_else(|| (written.clone(), 1.0));
            let is_given = by_user.is_some();
            let mut unsaid = None;
            if !is_given && roles.contains(role(&name)) {
                name.clear();
            }
            if ANGLES.contains(&name.as_str()) {
                let of_label = names::unit(label);
                let units = AngleUnit::ALL;
                let said = |unit: &&Choice<AngleUnit>| of_label == Some(unit.name);
                let chosen = |unit: &&Choice<AngleUnit>| Some(unit.value) == self.angles;
                let unit = units.iter().find(said).or(units.iter().find(chosen));
                unsaid = unit.is_none().then_some(Unsaid::Angle);
                name = format!("{name}_{}", unit.unwrap_or(&units[0]).name);
            } else if name == "wavelength" {
                name = "wavelength_nm".into();
                let of_label = names::unit(label).and_then(names::in_nm);
                unsaid = of_label.is_none().then_some(Unsaid::Wavelength);
                factor = of_label.unwrap_or(1.0);
            }
            NamedColumn {
                name,
                factor,
                unsaid,
                is_given,
            }
        };
        Ok(labels.iter().enumerate().map(name).collect())
    }
}
