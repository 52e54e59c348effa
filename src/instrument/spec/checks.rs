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
        self.check_picture(class)?;
        self.source.check("source")?;
        self.detector.check("detector")?;
        self.timing.check("timing")?;
        self.calibration.check("calibration")?;
        for (i, entry) in self.provenance.iter().enumerate() {
            let path = format!("provenance[{i}]");
            let allowed = "at least one key, e.g. \"detector.bits\"";
            let is_about_some = !entry.fields.is_empty();
            require(is_about_some, &format!("{path}.fields"), "[]", allowed)?;
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
            let allowed = "another name: base is what does not move";
            require(axis.name != BASE, &key, "\"base\"", allowed)?;
            unique(&key, &axis.name, self.axis[..i].iter().map(|a| &a.name))?;
        }
        for (i, axis) in self.axis.iter().enumerate() {
            self.check_mount(&format!("axis[{i}].parent"), &axis.parent)?;
            unit(&format!("axis[{i}].vector"), axis.vector)?;
        }
        for (i, axis) in self.axis.iter().enumerate() {
            let allowed = format!(
                "a chain that ends at base: {} would hang from itself",
                axis.name
            );
            let key = format!("axis[{i}].parent");
            let ends = !self.hangs_from_itself(axis);
            require(ends, &key, format!("{:?}", axis.parent), allowed)?;
        }
        let (required, class) = (class.axes, class.name);
        let (found, count) = (self.axis.len(), required.len());
        let allowed = format!("the {count} axes of {class}: {}", described(required));
        require(found == count, "axis", format!("{found} axes"), allowed)?;
        for (i, (axis, template)) in self.axis.iter().zip(required).enumerate() {
            let parent = template
                .parent
                .map_or(BASE, |parent| &self.axis[parent].name);
            let (role, vector) = (template.role, template.vector);
            let key = format!("axis[{i}].parent");
            let allowed = format!("{parent:?} for this axis of {class}, its {role}");
            let found = format!("{:?}", axis.parent);
            require(axis.parent == parent, &key, found, allowed)?;
            let key = format!("axis[{i}].vector");
            let allowed = format!("{vector:?} for this axis of {class}, its {role}");
            let found = format!("{:?}", axis.vector);
            require(axis.vector == vector, &key, found, allowed)?;
        }
        Ok(())
    }

    /// Checks which axes a picture covers, and that there is one where axes are imaged.
    fn check_picture(&self, class: &Class) -> Checked {
        let imaged: Vec<usize> = (0..self.axis.len())
            .filter(|&i| self.axis[i].imaged)
            .collect();
        let path = |i: usize, key: &str| format!("axis[{i}].{key}");
        if let Some(&other) = imaged.iter().find(|i| !class.imaged.contains(i)) {
            let could = classes().iter().filter(|class| !class.imaged.is_empty());
            let could = could.map(|class| {
                let roles = class.imaged.iter().map(|&i| class.axes[i].role);
                let roles = roles.collect::<Vec<_>>().join(" and ");
                format!("{roles} of {}", class.name)
            });
            let could = could.collect::<Vec<_>>().join(", or ");
            let allowed = format!("false; a picture covers {could}");
            return require(false, &path(other, "imaged"), true, allowed);
        }
        let Some(&first) = imaged.first() else {
            let allowed = "no table, as no axis is imaged";
            return require(self.picture.is_none(), "picture", "a table", allowed);
        };
        let left_out = class.imaged.iter().find(|i| !imaged.contains(i));
        if let Some(&left_out) = left_out {
            let allowed = format!("true, as {}: a picture covers both", path(first, "imaged"));
            return require(false, &path(left_out, "imaged"), false, allowed);
        }
        for i in imaged {
            let AxisSpec {
                resolution_deg,
                repeatability_deg,
                bias_deg,
                ..
            } = self.axis[i];
            let errors = [
                ("resolution_deg", resolution_deg),
                ("repeatability_deg", repeatability_deg),
                ("bias_deg", bias_deg),
            ];
            for (key, error) in errors {
                let allowed = "0 of an imaged axis; the errors of a picture are keys of [picture]";
                require(error == 0.0, &path(i, key), error, allowed)?;
            }
        }
        let allowed = "\"stop\", as a picture is taken at a stop";
        require(
            self.timing.scan == Scan::Stop,
            "timing.scan",
            "\"fly\"",
            allowed,
        )?;
        let Some(picture) = &self.picture else {
            let allowed = format!("a table, as {} = true", path(first, "imaged"));
            return require(false, "picture", "nothing", allowed);
        };
        picture.check("picture")?;
        let (lamp, camera) = (self.source.half_angle_deg, self.detector.half_angle_deg);
        let least = self.limits.separation_min_deg;
        let allowed = format!(
            "at least {}, the half-angles of light and sensor: closer, the lamp is in front of the camera",
            lamp + camera
        );
        let apart = least >= lamp + camera;
        require(apart, "limits.separation_min_deg", least, allowed)?;
        if !class.is_sphere() {
            let distances = [
                ("camera", picture.camera_radii),
                ("lamp", picture.lamp_radii),
            ];
            for (of, radii) in distances {
                let allowed = "0: there is no sphere that it could be so far from";
                require(radii == 0.0, &format!("picture.{of}_radii"), radii, allowed)?;
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
        let separation = limits.separation_min_deg;
        below("limits.separation_min_deg", separation, 180.0)?;
        for (i, pair) in limits.collision.iter().enumerate() {
            let key = format!("limits.collision[{i}].between");
            for part in &pair.between {
                let bodies = self.body.iter().map(|body| body.name.as_str());
                let known = [LIGHT, SENSOR].into_iter().chain(bodies);
                if !known.clone().any(|name| name == part) {
                    let allowed = format!("two of {}", one_of(part, known));
                    return Err(ParameterError::new(key, format!("{part:?}"), allowed));
                }
            }
            let differ = pair.between[0] != pair.between[1];
            let value = format!("{:?}", pair.between);
            require(differ, &key, value, "two different parts")?;
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
        let (min, max) = (self.min_deg, self.max_deg);
        let allowed = format!("a number below max_deg = {max}");
        // Both are finite.
        require(min < max, &key("min_deg"), min, allowed)?;
        let allowed = "true only if max_deg − min_deg is at least 360";
        let may_wrap = max - min >= 360.0;
        require(!self.wraps || may_wrap, &key("wraps"), true, allowed)
    }
}

impl DetectorSpec {
    /// Checks the order of its exposures.
    pub(super) fn check_exposures(&self, path: &str) -> Checked {
        let (min, max) = (self.exposure_min_s, self.exposure_max_s);
        let allowed = format!("at most exposure_max_s = {max}");
        require(min <= max, &format!("{path}.exposure_min_s"), min, allowed)
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

/// The error of a key whose value is not as it must be.
fn require(holds: bool, key: &str, value: impl Display, allowed: impl Display) -> Checked {
    match holds {
        true => Ok(()),
        false => Err(ParameterError::new(key, value, allowed.to_string())),
    }
}

pub(super) fn finite(key: &str, value: f64) -> Checked {
    require(value.is_finite(), key, value, "a finite number")?;
    sane(key, value.abs())
}

pub(super) fn above(key: &str, value: f64) -> Checked {
    in_left_open(key, value, 0.0, f64::INFINITY)?;
    sane(key, value)
}

pub(super) fn at_least_0(key: &str, value: f64) -> Checked {
    below(key, value, f64::INFINITY)?;
    sane(key, value)
}

/// Checks that a number is 0 or in `SANE`: squares and quotients then neither overflow nor vanish.
fn sane(key: &str, value: f64) -> Checked {
    let [least, most] = SANE;
    let allowed = format!("a number in [{least:e}, {most:e}]");
    let is_within = value == 0.0 || (least..=most).contains(&value);
    require(is_within, key, format!("{value:e}"), allowed)
}

/// Checks `0 ≤ value < end`.
pub(super) fn below(key: &str, value: f64, end: f64) -> Checked {
    let allowed = if end == f64::INFINITY {
        "a finite number, at least 0".into()
    } else {
        format!("a number in [0, {end})")
    };
    require(value >= 0.0 && value < end, key, value, allowed)
}

/// Checks the radius of a picture, pixels: in a smaller one a pixel is wider than the lobes of most materials.
pub(super) fn radius(key: &str, value: f64) -> Checked {
    in_closed(key, value, 8.0, 1e5)?;
    Ok(())
}

/// Checks a distance from a sphere, radii.
pub(super) fn distance(key: &str, value: f64) -> Checked {
    let allowed = "0 for a large distance, or a number in [1.5, 1e6]";
    require(
        value == 0.0 || (1.5..=1e6).contains(&value),
        key,
        value,
        allowed,
    )
}

pub(super) fn counted<N: From<u8> + PartialOrd + Display>(
    key: &str,
    value: N,
    most: u8,
) -> Checked {
    let allowed = format!("a whole number in [1, {most}]");
    let is_within = (N::from(1)..=N::from(most)).contains(&value);
    require(is_within, key, value, allowed)
}

fn unit(key: &str, vector: [f64; 3]) -> Checked {
    let is_unit = (DVec3::from(vector).length_squared() - 1.0).abs() <= UNIT;
    require(is_unit, key, format!("{vector:?}"), "a vector of length 1")
}

fn text(key: &str, value: &str) -> Checked {
    let (value, is_some) = (format!("{value:?}"), !value.trim().is_empty());
    require(is_some, key, value, "a text that is not empty")
}

/// Checks a name, which becomes part of columns, files and keys.
fn name(key: &str, value: &str) -> Checked {
    let fine = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let is_name = !value.is_empty() && value.chars().all(fine);
    let allowed = "a name of letters, digits, `_` and `-`";
    require(is_name, key, format!("{value:?}"), allowed)
}

fn unique<'a>(key: &str, value: &str, mut taken: impl Iterator<Item = &'a String>) -> Checked {
    let is_free = taken.all(|other| other != value);
    let allowed = "a name that nothing else has";
    require(is_free, key, format!("{value:?}"), allowed)
}
