//! Names of columns: ours as people write them, and guesses of what others mean.

/// Angles of a pose, as the names of their columns begin.
pub(crate) const ANGLES: [&str; 5] = ["theta_i", "phi_i", "theta_o", "phi_o", "delta_phi"];

/// What we call units, and how else they are written, in small letters.
const UNITS: [(&str, &[&str]); 8] = [
    ("deg", &["degree", "degrees", "°"]),
    ("rad", &["radian", "radians"]),
    ("nm", &[]),
    ("µm", &["um", "μm"]),
    ("m", &[]),
    ("1/sr", &["sr^-1", "sr-1", "sr⁻¹", "/sr"]),
    ("%", &["percent"]),
    ("1", &["-", "a.u.", "counts", "v"]),
];

/// Units of wavelengths, and how many nm they are.
pub(crate) const WAVELENGTHS: [(&str, f64); 3] = [("nm", 1.0), ("µm", 1e3), ("m", 1e9)];

/// Columns of values and uncertainties, without their channels.
pub(crate) const FAMILIES: [&str; 5] = ["value", "value_cos", "type_a", "type_b", "uncertainty"];

/// Columns of what a detector counts: of the sample, in the dark (which may be missing), and of the light itself.
pub(crate) const COUNTS: [&str; 3] = ["signal", "dark", "reference"];

/// A unit without its brackets.
pub(crate) fn bare(unit: &str) -> &str {
    let unit = unit.trim();
    let inner = |open, close| unit.strip_prefix(open)?.strip_suffix(close);
    (inner('[', ']').or(inner('(', ')')).unwrap_or(unit)).trim()
}

/// What we call a unit.
fn unit_of(unit: &str) -> Option<&'static str> {
    let unit = bare(unit).to_lowercase();
    let is = |(ours, others): &&(&str, &[&str])| *ours == unit || others.contains(&&*unit);
    UNITS.iter().find(is).map(|(ours, _)| *ours)
}

/// A name without the unit of an angle that it ends in, and that.
pub(crate) fn split_angle(name: &str) -> (&str, Option<&'static str>) {
    let ends = [("_deg", "deg"), ("_rad", "rad")].into_iter();
    let mut found = ends.filter_map(|(end, unit)| Some((name.strip_suffix(end)?, Some(unit))));
    found.next().unwrap_or((name, None))
}

/// The unit that a label names, in brackets or at its end.
pub(crate) fn unit(label: &str) -> Option<&'static str> {
    let (name, unit) = split(label);
    unit.or(split_angle(name).1)
}

/// How many nm a unit of wavelengths is.
pub(crate) fn in_nm(unit: &str) -> Option<f64> {
    let found = WAVELENGTHS.iter().find(|(name, _)| *name == unit);
    found.map(|(_, factor)| *factor)
}

pub(crate) fn is_unit(text: &str) -> bool {
    unit_of(text).is_some()
}

/// A name and its unit, in brackets, behind a slash or behind a blank.
pub(crate) fn split(label: &str) -> (&str, Option<&'static str>) {
    let label = label.trim();
    let at = label.rfind(['[', '(']).or_else(|| label.rfind(" / "));
    let (name, unit) = label.split_at(at.unwrap_or(0));
    match unit_of(unit.trim_start_matches(" / ")) {
        Some(unit) if !name.is_empty() => (name.trim(), Some(unit)),
        _ => (label, None),
    }
}

/// The wavelength (nm) that a text names, e.g. `450 nm`.
pub(crate) fn wavelength(text: &str) -> Option<&str> {
    let number = text.strip_suffix("nm")?.trim_end_matches(['_', ' ']);
    // Digits alone: no sign, no exponent, no NaN.
    let plain = number.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    (plain && number.parse::<f64>().is_ok()).then_some(number)
}

/// Our name of a column that is written in other letters, with its unit in brackets or below it, and what multiplies its
/// numbers; `None` of one that is none of ours.
pub(crate) fn ours(label: &str) -> Option<(String, f64)> {
    let (name, unit) = split(label);
    let lower = name.to_lowercase().replace([' ', '-'], "_");
    let named = |name: String, factor: f64| Some((name, factor));
    // Of an angle that does not have a unit others decide.
    let angle = ANGLES.iter().find(|angle| **angle == lower);
    match (angle, unit) {
        (Some(angle), Some(unit @ ("deg" | "rad"))) => {
            return named(format!("{angle}_{unit}"), 1.0);
        }
        (Some(angle), None) => return named((*angle).into(), 1.0),
        (Some(_), Some(_)) => return None,
        (None, _) => {}
    }
    if let (bare, Some(end)) = split_angle(&lower)
        && ANGLES.contains(&bare)
    {
        let same = unit.is_none_or(|unit| unit == end);
        return if same { named(lower, 1.0) } else { None };
    }
    if let Some(rest) = lower.strip_prefix("wavelength") {
        let rest = rest.trim_start_matches('_');
        let unit = match (rest, unit) {
            ("", unit) => unit,
            (rest, unit) if unit.is_none() || unit == unit_of(rest) => Some(unit_of(rest)?),
            _ => return None,
        };
        return match unit {
            Some(unit) => named("wavelength_nm".into(), in_nm(unit)?),
            None => named("wavelength".into(), 1.0),
        };
    }
    if matches!(unit, None | Some("1/sr"))
        && let Some(nm) = wavelength(&lower)
    {
        return named(format!("value_{nm}nm"), 1.0);
    }
    let of_family = |family: &&str| {
        let end = channel(lower.strip_prefix(*family)?)?;
        Some(format!("{family}{end}"))
    };
    match (FAMILIES.iter().find_map(of_family), unit) {
        (Some(name), None | Some("1/sr")) => named(name, 1.0),
        (None, None | Some("1")) if is_further(&lower) => named(lower, 1.0),
        _ => None,
    }
}

/// The end of a column of values, as ours have it.
fn channel(end: &str) -> Option<String> {
    match ["", "_r", "_g", "_b", "_s", "_p"].contains(&end) {
        true => Some(end.to_owned()),
        false => Some(format!("_{}nm", wavelength(end.strip_prefix('_')?)?)),
    }
}

/// Columns of ours beside angles, wavelengths and values.
fn is_further(name: &str) -> bool {
    let all = [&["index", "block", "stop", "flags", "attempt"], &COUNTS[..]].concat();
    all.contains(&name) || VECTORS.concat().contains(&name)
}

/// Columns of the components of unit vectors towards light and sensor.
pub(crate) const VECTORS: [[&str; 3]; 2] = [
    ["omega_i_x", "omega_i_y", "omega_i_z"],
    ["omega_o_x", "omega_o_y", "omega_o_z"],
];

/// Words in the labels of polar angles and of azimuths, in small letters.
const POLAR: [&str; 7] = [
    "theta",
    "polar",
    "zenith",
    "winkel",
    "angle",
    "elevation",
    "aoi",
];
const AZIMUTH: [&str; 4] = ["phi", "azimuth", "azimut", "azi"];

/// Words in the labels of the angles of light and sensor; and what may be left of one without the word for the angle.
const SIDES: [(&[&str], &[&str]); 2] = [
    (
        &[
            "inc", "ein", "light", "source", "lamp", "illum", "sun", "aoi",
        ],
        &["i", "in", "l"],
    ),
    (
        &["out", "aus", "scat", "refl", "view", "sens", "det", "obs"],
        &["o", "r", "s", "v", "d", "e"],
    ),
];

/// Words in the labels of values, the surest first, and of uncertainties.
const VALUES: [&str; 6] = ["brdf", "bsdf", "value", "reflectance", "radiance", "intens"];
const UNCERTAIN: [&str; 5] = ["unc", "sigma", "std", "err", "u_"];

/// Has the letters of a word of values, and is none.
const NO_VALUE: &str = "irradiance";

/// Short names of values.
const SHORT: [&str; 3] = ["f_r", "fr", "f"];

/// Letters from which on a label is called by its number.
const LONG: usize = 40;

/// The angle that a label in small letters may be of.
fn angle_of(label: &str) -> Option<&'static str> {
    let of = |words: &[&str]| words.iter().any(|word| label.contains(word));
    let kind = match (of(&AZIMUTH), of(&POLAR)) {
        (true, _) => 1,
        (false, true) => 0,
        (false, false) => return None,
    };
    let words = AZIMUTH.iter().chain(&POLAR).filter(|word| **word != "aoi");
    let rest = words.fold(label.to_owned(), |rest, word| rest.replace(word, ""));
    let rest = rest.replace('_', "");
    let mut sides = SIDES.iter();
    let by_word = sides.position(|(all, _)| all.iter().any(|w| rest.contains(w)));
    let by_rest = || SIDES.iter().position(|(_, all)| all.contains(&&*rest));
    let side = by_word.or_else(by_rest)?;
    Some([["theta_i", "theta_o"], ["phi_i", "phi_o"]][kind][side])
}

/// What stands before and behind the wavelength in the label of a value, if another label differs from it by its number alone.
fn spectral(labels: &[String], value: usize) -> Option<[String; 2]> {
    let is_digit = |c: char| c.is_ascii_digit();
    let parts = |label: &str| {
        let from = label.find(is_digit)?;
        let (before, rest) = label.split_at(from);
        let (digits, after) = rest.split_at(rest.find(|c| !is_digit(c)).unwrap_or(rest.len()));
        let nm: u32 = digits.parse().ok()?;
        let around = [before, after].map(String::from);
        (100..=20_000).contains(&nm).then_some(around)
    };
    let own = parts(&labels[value])?;
    let alike = labels.iter().filter_map(|label| parts(label));
    (alike.filter(|other| *other == own).count() > 1).then_some(own)
}

/// The `--columns` that may be meant where names are not known: those of the angles and of a value, by words in the labels. `None` if
/// no light, sensor or value is found.
pub(crate) fn guess(labels: &[String]) -> Option<String> {
    // Columns without names are called by their numbers, and mostly in this order.
    let is_numbered = (1..).zip(labels).all(|(i, label)| *label == i.to_string());
    match labels.len() {
        4 if is_numbered => return Some("--columns theta_i=1,theta_o=2,phi_o=3,value=4".into()),
        5.. if is_numbered => {
            return Some("--columns theta_i=1,phi_i=2,theta_o=3,phi_o=4,value=5".into());
        }
        _ => {}
    }
    let part = |(name, unit): (&str, _)| (name.to_lowercase().replace([' ', '-', '.'], "_"), unit);
    let parts = labels.iter().map(|label| part(split(label)));
    let parts: Vec<(String, Option<&str>)> = parts.collect();
    let mut given: Vec<(String, usize)> = Vec::new();
    for (i, (name, unit)) in parts.iter().enumerate() {
        let (bare, end) = split_angle(name);
        let Some(angle) = angle_of(bare) else {
            continue;
        };
        if given.iter().all(|(name, _)| !name.starts_with(angle)) {
            let of_angle = unit.filter(|unit| ["deg", "rad"].contains(unit));
            let unit = end.or(of_angle);
            let unit = unit.map_or(String::new(), |unit| format!("_{unit}"));
            given.push((format!("{angle}{unit}"), i));
        }
    }
    let free = |given: &[(String, usize)], i: usize| given.iter().all(|(_, other)| *other != i);
    let has = |i: usize, words: &[&str]| words.iter().any(|word| parts[i].0.contains(word));
    let value = VALUES.iter().find_map(|word| {
        (0..labels.len()).find(|&i| {
            free(&given, i) && has(i, &[word]) && !has(i, &UNCERTAIN) && !has(i, &[NO_VALUE])
        })
    });
    let short = || (0..labels.len()).find(|&i| SHORT.contains(&parts[i].0.as_str()));
    let value = value.or_else(short)?;
    // An azimuth without a side is that of the sensor from the light's.
    let is_azimuth = |i: usize| AZIMUTH.iter().any(|word| parts[i].0.contains(word));
    let mut azimuths = (0..labels.len()).filter(|&i| i != value && is_azimuth(i));
    if let (Some(one), None) = (azimuths.next(), azimuths.next())
        && free(&given, one)
    {
        given.push(("phi_o".into(), one));
    }
    let of_wavelengths = spectral(labels, value);
    given.push(("value".into(), value));
    let uncertain = (0..labels.len()).find(|&i| free(&given, i) && has(i, &UNCERTAIN));
    given.extend(uncertain.map(|i| ("uncertainty".to_owned(), i)));
    let there = |role: &str| given.iter().any(|(name, _)| name.starts_with(role));
    if !there("theta_i") || !there("theta_o") {
        return None;
    }
    // What is called as ours is needs no name.
    given.retain(|(name, i)| ours(&labels[*i]).is_none_or(|(named, _)| named != *name));
    if given.is_empty() {
        return None;
    }
    given.sort_by_key(|(_, i)| *i);
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '-');
    let is_short = |label: &str| label.len() <= LONG && label.chars().all(is_plain);
    let pairs = given.iter().map(|(name, i)| match &of_wavelengths {
        Some([before, after]) if name == "value" => format!("'value_*nm={before}*{after}'"),
        _ if is_short(&labels[*i]) => format!("{name}={}", labels[*i]),
        // A number needs no quotes.
        _ => format!("{name}={}", i + 1),
    });
    let mut guess = format!("--columns {}", pairs.collect::<Vec<_>>().join(","));
    if given.iter().any(|(name, _)| ANGLES.contains(&&**name)) {
        guess += " --angles deg";
    }
    if parts[value].1 == Some("%") {
        guess += " --quantity percent";
    }
    if uncertain.is_some_and(|i| parts[i].1 == Some("%") || has(i, &["percent"])) {
        guess += " --uncertainties percent";
    }
    Some(guess)
}
