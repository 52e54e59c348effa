//! Refuses a preset that describes no instrument, with the path of the key.

use super::{AxisSpec, BASE, DetectorSpec, InstrumentSpec, LIGHT, SENSOR, Scan, TimingSpec};
use crate::error::{ParameterError, one_of};
pub(super) use crate::error::{in_closed, in_left_open};
use crate::instrument::class::{AxisTemplate, Class, classes};
use glam::DVec3;
use std::fmt::Display;

type Checked = Result<(), ParameterError>;

/// Smallest and largest size of a number other than 0.
const SANE: [f64; 2] = [1e-9, 1e15];

/// Tolerance of the square of a unit vector's length: files give four decimals.
const UNIT: f64 = 1e-3;

impl InstrumentSpec {
    /// Checks every key.
    ///
    /// # Errors
    /// Names the first wrong key by its path, e.g. `axis[1].min_deg`, positions counted from 0.
    pub fn check(&self) -> Result<(), ParameterError> {
        name("name", &self.name)?;
        text("about", &self.about)?;
        let class = self.kinematic_class()?;
        self.check_chain(class)?;
        for (i, axis) in self.axis.iter().enumerate() {
            axis.check(&format!("axis[{i}]"))?;
        }
        self.check_bodies()?;
        self.check_limits()?;
        self.source.check("source")?;
        self.detector.check("detector")?;
        self.timing.check("timing")?;
        self.calibration.check("calibration")?;
        for (i, entry) in self.provenance.iter().enumerate() {
            let path = format!("provenance[{i}]");
            if entry.fields.is_empty() {
                let allowed = "at least one key, e.g. \"detector.bits\"";
                return Err(ParameterError::new(format!("{path}.fields"), "[]", allowed));
            }
            text(&format!("{path}.source"), &entry.source)?;
        }
        Ok(())
    }

    /// The class that the file names.
    pub(crate) fn kinematic_class(&self) -> Result<&'static Class, ParameterError> {
        let class = classes().iter().find(|class| class.name == self.class);
        class.ok_or_else(|| {
            let names: Vec<_> = classes().iter().map(|class| class.name).collect();
            let value = format!("{:?}", self.class);
            ParameterError::new("class", value, format!("one of {}", names.join(", ")))
        })
    }

    /// Names, parents and vectors of the axes: a chain, and that of the class.
    fn check_chain(&self, class: &Class) -> Checked {
        for (i, axis) in self.axis.iter().enumerate() {
            let key = format!("axis[{i}].name");
            name(&key, &axis.name)?;
            if axis.name == BASE {
                let allowed = "another name: base is what does not move";
                return Err(ParameterError::new(key, "\"base\"", allowed));
            }
            unique(&key, &axis.name, self.axis[..i].iter().map(|a| &a.name))?;
        }
        for (i, axis) in self.axis.iter().enumerate() {
            self.check_mount(&format!("axis[{i}].parent"), &axis.parent)?;
            unit(&format!("axis[{i}].vector"), axis.vector)?;
        }
        for (i, axis) in self.axis.iter().enumerate() {
            if self.hangs_from_itself(axis) {
                let key = format!("axis[{i}].parent");
                let value = format!("{:?}", axis.parent);
                let allowed = format!(
                    "a chain that ends at base: {} would hang from itself",
                    axis.name
                );
                return Err(ParameterError::new(key, value, allowed));
            }
        }
        let (required, class) = (class.axes, class.name);
        if self.axis.len() != required.len() {
            let allowed = format!(
                "the {} axes of {class}: {}",
                required.len(),
                described(required)
            );
            return Err(ParameterError::new(
                "axis",
                format!("{} axes", self.axis.len()),
                allowed,
            ));
        }
        for (i, (axis, template)) in self.axis.iter().zip(required).enumerate() {
            let parent = template
                .parent
                .map_or(BASE, |parent| self.axis[parent].name.as_str());
            let role = template.role;
            if axis.parent != parent {
                return Err(ParameterError::new(
                    format!("axis[{i}].parent"),
                    format!("{:?}", axis.parent),
                    format!("{parent:?} for this axis of {class}, its {role}"),
                ));
            }
            if axis.vector != template.vector {
                return Err(ParameterError::new(
                    format!("axis[{i}].vector"),
                    format!("{:?}", axis.vector),
                    format!("{:?} for this axis of {class}, its {role}", template.vector),
                ));
            }
        }
        Ok(())
    }

    fn parent(&self, name: &str) -> Option<&AxisSpec> {
        self.axis.iter().find(|axis| axis.name == name)
    }

    /// True if the way to the base comes back to this axis.
    fn hangs_from_itself(&self, axis: &AxisSpec) -> bool {
        let mut above = self.parent(&axis.parent);
        // A way that is longer than the number of axes goes round a loop further up.
        for _ in 0..self.axis.len() {
            match above {
                None => return false,
                Some(found) if found.name == axis.name => return true,
                Some(found) => above = self.parent(&found.parent),
            }
        }
        false
    }

    /// Checks the name of the axis that a part is mounted on.
    fn check_mount(&self, key: &str, value: &str) -> Checked {
        if value == BASE || self.parent(value).is_some() {
            return Ok(());
        }
        let names = one_of(value, self.axis.iter().map(|axis| &axis.name));
        let allowed = format!("base or the name of an axis: {names}");
        Err(ParameterError::new(key, format!("{value:?}"), allowed))
    }

    fn check_bodies(&self) -> Checked {
        for (i, body) in self.body.iter().enumerate() {
            let key = format!("body[{i}].name");
            name(&key, &body.name)?;
            let taken = [LIGHT.to_owned(), SENSOR.to_owned()];
            let before = self.body[..i].iter().map(|b| &b.name);
            unique(&key, &body.name, taken.iter().chain(before))?;
            self.check_mount(&format!("body[{i}].axis"), &body.axis)?;
            unit(&format!("body[{i}].direction"), body.direction)?;
        }
        Ok(())
    }

    fn check_limits(&self) -> Checked {
        let limits = &self.limits;
        let theta = |key, value| in_left_open(key, value, 0.0, 90.0);
        theta("limits.theta_i_max_deg", limits.theta_i_max_deg)?;
        theta("limits.theta_o_max_deg", limits.theta_o_max_deg)?;
        below(
            "limits.separation_min_deg",
            limits.separation_min_deg,
            180.0,
        )?;
        for (i, pair) in limits.collision.iter().enumerate() {
            let key = format!("limits.collision[{i}].between");
            for part in &pair.between {
                let known = [LIGHT, SENSOR].contains(&part.as_str());
                if !known && !self.body.iter().any(|body| body.name == *part) {
                    let bodies = self.body.iter().map(|body| body.name.as_str());
                    let names = one_of(part, [LIGHT, SENSOR].into_iter().chain(bodies));
                    return Err(ParameterError::new(
                        key,
                        format!("{part:?}"),
                        format!("two of {names}"),
                    ));
                }
            }
            if pair.between[0] == pair.between[1] {
                let value = format!("{:?}", pair.between);
                return Err(ParameterError::new(key, value, "two different parts"));
            }
            let key = format!("limits.collision[{i}].angle_min_deg");
            above(&key, pair.angle_min_deg)?;
            below(&key, pair.angle_min_deg, 180.0)?;
        }
        Ok(())
    }
}

impl AxisSpec {
    /// Checks the ends of its range.
    pub(super) fn check_range(&self, path: &str) -> Checked {
        let key = |key: &str| format!("{path}.{key}");
        if self.min_deg >= self.max_deg {
            let allowed = format!("a number below max_deg = {}", self.max_deg);
            return Err(ParameterError::new(key("min_deg"), self.min_deg, allowed));
        }
        if self.wraps && self.max_deg - self.min_deg < 360.0 {
            let allowed = "true only if max_deg − min_deg is at least 360";
            return Err(ParameterError::new(key("wraps"), true, allowed));
        }
        Ok(())
    }
}

impl DetectorSpec {
    /// Checks the order of its exposures.
    pub(super) fn check_exposures(&self, path: &str) -> Checked {
        if self.exposure_min_s <= self.exposure_max_s {
            return Ok(());
        }
        let key = format!("{path}.exposure_min_s");
        let allowed = format!("at most exposure_max_s = {}", self.exposure_max_s);
        Err(ParameterError::new(key, self.exposure_min_s, allowed))
    }
}

impl TimingSpec {
    /// Checks the rate of readings, which a sweep needs.
    pub(super) fn check_rate(&self, path: &str) -> Checked {
        let key = format!("{path}.sample_rate_hz");
        match (self.scan, self.sample_rate_hz) {
            (_, Some(rate)) => above(&key, rate),
            (Scan::Stop, None) => Ok(()),
            (Scan::Fly, None) => {
                let allowed = "a finite number above 0, as scan = \"fly\"";
                Err(ParameterError::new(key, "nothing", allowed))
            }
        }
    }
}

/// The axes of a class in words.
fn described(axes: &[AxisTemplate]) -> String {
    let words = axes.iter().map(|axis| {
        let parent = axis.parent.map_or(BASE, |parent| axes[parent].role);
        format!("{} on {parent} about {:?}", axis.role, axis.vector)
    });
    words.collect::<Vec<_>>().join("; ")
}

pub(super) fn finite(key: &str, value: f64) -> Checked {
    if !value.is_finite() {
        return Err(ParameterError::new(key, value, "a finite number"));
    }
    if value == 0.0 {
        Ok(())
    } else {
        sane(key, value.abs())
    }
}

pub(super) fn above(key: &str, value: f64) -> Checked {
    in_left_open(key, value, 0.0, f64::INFINITY)?;
    sane(key, value)
}

pub(super) fn at_least_0(key: &str, value: f64) -> Checked {
    below(key, value, f64::INFINITY)?;
    if value > 0.0 {
        sane(key, value)
    } else {
        Ok(())
    }
}

/// Checks that a number is in `SANE`: squares and quotients then neither overflow nor vanish.
fn sane(key: &str, value: f64) -> Checked {
    let [least, most] = SANE;
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let allowed = format!("a number in [{least:e}, {most:e}]");
    Err(ParameterError::new(key, format!("{value:e}"), allowed))
}

/// Checks `0 ≤ value < end`.
pub(super) fn below(key: &str, value: f64, end: f64) -> Checked {
    if value >= 0.0 && value < end {
        return Ok(());
    }
    let allowed = if end == f64::INFINITY {
        "a finite number, at least 0".into()
    } else {
        format!("a number in [0, {end})")
    };
    Err(ParameterError::new(key, value, allowed))
}

pub(super) fn counted<N: From<u8> + PartialOrd + Display>(
    key: &str,
    value: N,
    most: u8,
) -> Checked {
    if (N::from(1)..=N::from(most)).contains(&value) {
        return Ok(());
    }
    let allowed = format!("a whole number in [1, {most}]");
    Err(ParameterError::new(key, value, allowed))
}

fn unit(key: &str, vector: [f64; 3]) -> Checked {
    if (DVec3::from(vector).length_squared() - 1.0).abs() <= UNIT {
        return Ok(());
    }
    let value = format!("{vector:?}");
    Err(ParameterError::new(key, value, "a vector of length 1"))
}

fn text(key: &str, value: &str) -> Checked {
    if !value.trim().is_empty() {
        return Ok(());
    }
    let allowed = "a text that is not empty";
    Err(ParameterError::new(key, format!("{value:?}"), allowed))
}

/// Checks a name, which becomes part of columns, files and keys.
fn name(key: &str, value: &str) -> Checked {
    let fine = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !value.is_empty() && value.chars().all(fine) {
        return Ok(());
    }
    let allowed = "a name of letters, digits, `_` and `-`";
    Err(ParameterError::new(key, format!("{value:?}"), allowed))
}

fn unique<'a>(key: &str, value: &str, mut taken: impl Iterator<Item = &'a String>) -> Checked {
    if taken.all(|other| other != value) {
        return Ok(());
    }
    let allowed = "a name that nothing else has";
    Err(ParameterError::new(key, format!("{value:?}"), allowed))
}
