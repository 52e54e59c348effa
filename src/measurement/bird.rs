//! The universal BRDF data format of the BiRD project (JSON, schema version 1.0), in which national laboratories exchange readings.
//!
//! `data` holds arrays of one number a reading: `theta_i`, `phi_i`, `theta_r`, `phi_r` (deg, ° or rad), `BRDF` (1/sr) and, if there
//! are such, its standard uncertainty `uBRDF` (1/sr or %), `wavelength_i` (nm or μm) and `polarization_i` (s and p, or Stokes vectors
//! whose second component is 1 of s). One uncertainty of all stands in `BRDF.uncertainty`. Azimuths count from a mark on the sample.
//! Of readings in s and in p polarised light the mean is read, or one of them ([`crate::schedule::Conventions::polarisation`]).
//!
//! `metadata` and what `data` says beside numbers is kept in the header of our own files, and written again. Where there is none,
//! a file that is written says of each required key that it is not known.

use super::file::read_measurement;
use super::scattered::refuse_columns;
use super::{About, Measurement, Readings};
use crate::error::{count, excerpt};
use crate::schedule::names;
use crate::schedule::{Assume, FileError, Polarisation, Sequence, UncertaintyUnit};
use rustc_hash::FxHashMap;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::io::{self, Write};

const SCHEMA: &str = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json";

const OF_SR: [&str; 2] = ["1/sr", "sr^-1"];

/// Angles there and their names here.
const ANGLES: [(&str, &str); 4] = [
    ("theta_i", "theta_i"),
    ("phi_i", "phi_i"),
    ("theta_r", "theta_o"),
    ("phi_r", "phi_o"),
];

/// A variable of one number a reading.
#[derive(Deserialize)]
struct Variable {
    unit: String,
    values: Vec<f64>,
    uncertainty: Option<Uncertainty>,
}

/// An uncertainty of all values of a variable.
#[derive(Deserialize)]
struct Uncertainty {
    value: f64,
    unit: String,
}

#[derive(Deserialize)]
struct States {
    values: Vec<State>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum State {
    Name(String),
    Stokes([f64; 4]),
}

/// Difference from 1 or 0 that the component of a Stokes vector may have.
const SLACK: f64 = 1e-6;

impl State {
    /// The polarisation; the mean of both stands for light that has none.
    fn polarisation(&self) -> Option<Polarisation> {
        let is = |name: &str, second: f64| match self {
            Self::Name(found) => found == name,
            Self::Stokes([a, b, c, d]) => {
                let off = [a - 1.0, b - second, *c, *d];
                off.iter().all(|x| x.abs() <= SLACK)
            }
        };
        let all = [
            ("s", 1.0, Polarisation::S),
            ("p", -1.0, Polarisation::P),
            ("u", 0.0, Polarisation::Mean),
        ];
        let found = all.into_iter().find(|(name, second, _)| is(name, *second));
        found.map(|(.., polarisation)| polarisation)
    }
}

/// True of a text of one JSON object with `metadata` and `data`.
pub(crate) fn is_bird(text: &str) -> bool {
    let head = text.chars().take(1 << 10);
    let head: String = head.filter(|c| !c.is_whitespace()).collect();
    let has = |key: &str| head.contains(&format!("\"{key}\":{{"));
    head.starts_with('{') && (has("metadata") || has("data"))
}

/// The readings as a table of ours, and the unit of their uncertainties.
struct Long {
    text: String,
    /// Poses in one polarisation whose other is not there.
    single: usize,
    unit: UncertaintyUnit,
    note: Option<String>,
}

/// Reads a text; `name` stands for the file in messages.
///
/// # Errors
/// One sentence: no JSON, a key that is missing or has another type, arrays of different lengths, a state of polarisation that is neither
/// s nor p, and those of [`read_measurement`] with the place in the arrays.
pub fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let conventions = &assume.conventions;
    refuse_columns("the BiRD format", name, conventions, Some("--polarisation"))?;
    let refuse = |message: String| FileError::whole(name, message);
    let mut file: Map<String, Value> = serde_json::from_str(text).map_err(|e| {
        let is_cut = e.is_eof();
        FileError::on_line(name, e.line(), format!("this is no JSON: {e}")).cut_if(is_cut)
    })?;
    let Some(Value::Object(mut data)) = file.remove("data") else {
        let message = "data is missing: an object of arrays of numbers";
        return Err(refuse(message.into()));
    };
    let long = long_form(&data, conventions.polarisation).map_err(refuse)?;
    let mut assume = assume.clone();
    // Those of s and of p are read already.
    assume.conventions.polarisation = None;
    assume.conventions.uncertainties = Some(long.unit);
    let mut readings = read_measurement(&long.text, name, &assume).map_err(|e| match e.line {
        // Rows of the table are places of the arrays.
        Some(line) => refuse(format!("reading {}: {}", line - 1, e.message)),
        None => e,
    })?;
    readings.notes.extend(long.note);
    for warning in &mut readings.warnings {
        *warning = of_readings(warning);
    }
    if long.single > 0 {
        let what = "in s or in p polarised light alone: no reading";
        let sentence = format!("{} {what}", count(long.single, "pose"));
        readings.warnings.push(sentence);
        if readings.measurement.readings() == 0 {
            let message = "no pose has a reading in the polarisation that is asked for";
            return Err(refuse(message.into()));
        }
    }
    // It was read to its end.
    readings.intact = true;
    for place in &mut readings.measurement.places {
        place.line = 0;
    }
    let metadata = file.remove("metadata").unwrap_or_default();
    let text_of = |path: &str| Some(metadata.pointer(path)?.as_str()?.to_owned());
    readings.about.material = text_of("/sample/name");
    readings.about.instrument = text_of("/instrumentation/name");
    if metadata.pointer("/sample/properties_symmetry") == Some(&json!("isotropic")) {
        let note = "the sample is called isotropic: --symmetry says so";
        readings.notes.push(note.into());
    }
    for variable in data.values_mut() {
        if let Value::Object(variable) = variable {
            variable.remove("values");
        }
    }
    let unread = data.remove_entry("adhoc_variables");
    readings.unread = unread.into_iter().map(|(key, _)| key).collect();
    readings.about.foreign_header = Some(json!({ "metadata": metadata, "data": data }));
    Ok(readings)
}

/// A sentence about a line of the table as one about a reading of the arrays.
fn of_readings(sentence: &str) -> String {
    let Some((before, after)) = sentence.split_once("line ") else {
        return sentence.into();
    };
    let digits = after.bytes().take_while(u8::is_ascii_digit).count();
    match after[..digits].parse::<usize>() {
        Ok(line) => format!("{before}reading {}{}", line - 1, &after[digits..]),
        Err(_) => sentence.into(),
    }
}

/// A variable, or why it cannot be read.
fn variable<T: for<'de> Deserialize<'de>>(
    data: &Map<String, Value>,
    key: &str,
) -> Result<Option<T>, String> {
    let value = data.get(key).map(T::deserialize).transpose();
    value.map_err(|e| format!("data.{key}: {e}"))
}

/// Refuses an array of another length than that of f_r.
fn same_length(key: &str, found: usize, n: usize) -> Result<(), String> {
    match found == n {
        true => Ok(()),
        false => Err(format!(
            "data.{key} has {found} values; allowed: {n}, as data.BRDF"
        )),
    }
}

/// The readings as CSV: a line each below the names.
fn long_form(
    data: &Map<String, Value>,
    polarisation: Option<Polarisation>,
) -> Result<Long, String> {
    let needed = |key: &str| -> Result<Variable, String> {
        variable(data, key)?.ok_or_else(|| format!("data.{key} is missing"))
    };
    let brdf = needed("BRDF")?;
    let n = brdf.values.len();
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let mut add = |key: &str, ours: &str, allowed: &str, v: Variable| {
        same_length(key, v.values.len(), n)?;
        let name = format!("{ours} [{}]", v.unit);
        if names::ours(&name).is_none() {
            let unit = excerpt(&v.unit);
            return Err(format!(
                "data.{key}.unit = {unit}: allowed are units {allowed}"
            ));
        }
        columns.push((name, v.values));
        Ok::<(), String>(())
    };
    for (key, ours) in ANGLES {
        add(key, ours, "such as deg or rad", needed(key)?)?;
    }
    for key in ["wavelength_i", "wavelength_r"] {
        if let Some(v) = variable::<Variable>(data, key)? {
            add(key, "wavelength", "such as nm or µm", v)?;
            break;
        }
    }
    if !OF_SR.contains(&brdf.unit.as_str()) {
        let unit = excerpt(&brdf.unit);
        let allowed = OF_SR.join(", ");
        return Err(format!("data.BRDF.unit = {unit}: allowed are {allowed}"));
    }
    let (uncertainties, unit) = match (variable::<Variable>(data, "uBRDF")?, &brdf.uncertainty) {
        (Some(v), _) => {
            same_length("uBRDF", v.values.len(), n)?;
            (Some(v.values), v.unit)
        }
        (None, Some(one)) => (Some(vec![one.value; n]), one.unit.clone()),
        (None, None) => (None, OF_SR[0].to_owned()),
    };
    let unit = match unit.as_str() {
        "%" => UncertaintyUnit::Percent,
        unit if OF_SR.contains(&unit) => UncertaintyUnit::Value,
        unit => {
            let (unit, allowed) = (excerpt(unit), OF_SR.join(", "));
            return Err(format!(
                "unit of uncertainties = {unit}: allowed are {allowed} and %"
            ));
        }
    };
    let light = states(data, "polarization_i", n)?;
    if let Some(sensor) = states(data, "polarization_r", n)?
        && let Some(at) = sensor.iter().position(|state| *state != Polarisation::Mean)
    {
        return Err(format!(
            "data.polarization_r, reading {}: the sensor sees one polarisation; allowed: readings of both together",
            at + 1
        ));
    }
    let mut text: String = columns.iter().map(|(name, _)| name.clone() + ",").collect();
    text += match uncertainties {
        Some(_) => "value,uncertainty\n",
        None => "value\n",
    };
    let mut push = |row: usize, value: Option<[f64; 2]>| {
        for (_, column) in &columns {
            let _ = write!(text, "{},", column[row]);
        }
        let _ = match (value, &uncertainties) {
            (Some([value, u]), Some(_)) => writeln!(text, "{value},{u}"),
            (Some([value, _]), None) => writeln!(text, "{value}"),
            (None, Some(_)) => writeln!(text, ","),
            (None, None) => writeln!(text),
        };
    };
    let reading = |row: usize| {
        let u = uncertainties.as_ref().map_or(0.0, |u| u[row]);
        [brdf.values[row], u]
    };
    let Some(light) = light.filter(|all| all.iter().any(|state| *state != Polarisation::Mean))
    else {
        if polarisation.is_some() {
            return Err("--polarisation: there are no readings in s and p polarised light".into());
        }
        (0..n).for_each(|row| push(row, Some(reading(row))));
        return Ok(Long {
            text,
            single: 0,
            unit,
            note: None,
        });
    };
    // Readings of one pose and wavelength in s and p polarised light are one, in the order of the first of them.
    let mut both: Vec<(usize, [Option<[f64; 2]>; 2])> = Vec::new();
    let mut places: FxHashMap<Vec<u64>, Vec<usize>> = FxHashMap::default();
    for (row, state) in light.iter().enumerate() {
        if *state == Polarisation::Mean {
            both.push((row, [Some(reading(row)); 2]));
            continue;
        }
        let which = usize::from(*state == Polarisation::P);
        let key: Vec<u64> = columns.iter().map(|(_, c)| c[row].to_bits()).collect();
        // Repeats are taken in their order.
        let known = places.entry(key).or_default();
        match known.iter().find(|at| both[**at].1[which].is_none()) {
            Some(&at) => both[at].1[which] = Some(reading(row)),
            None => {
                known.push(both.len());
                let mut new = [None; 2];
                new[which] = Some(reading(row));
                both.push((row, new));
            }
        }
    }
    let which = polarisation.unwrap_or(Polarisation::Mean);
    let mut single = 0;
    for (row, [s, p]) in both {
        // What both share is as large in their mean. In percent it is that of the mean of the values.
        let mean = |[s, p]: [[f64; 2]; 2]| {
            let value = 0.5 * (s[0] + p[0]);
            let shared = match unit {
                UncertaintyUnit::Percent if value != 0.0 => (s[0] * s[1] + p[0] * p[1]) / value,
                _ => s[1] + p[1],
            };
            [value, 0.5 * shared]
        };
        let value = match which {
            Polarisation::S => s,
            Polarisation::P => p,
            Polarisation::Mean => s.zip(p).map(|(s, p)| mean([s, p])),
        };
        single += usize::from(value.is_none());
        push(row, value);
    }
    Ok(Long {
        text,
        single,
        unit,
        note: Some(which.note()),
    })
}

fn states(
    data: &Map<String, Value>,
    key: &str,
    n: usize,
) -> Result<Option<Vec<Polarisation>>, String> {
    let Some(States { values }) = variable(data, key)? else {
        return Ok(None);
    };
    same_length(key, values.len(), n)?;
    let state = |(i, state): (usize, &State)| {
        state.polarisation().ok_or_else(|| {
            let what = match state {
                State::Name(name) => excerpt(name).into_owned(),
                State::Stokes(v) => format!("{v:?}"),
            };
            format!(
                "data.{key}, reading {}: {what}; allowed: s, p, u, [1, 1, 0, 0], [1, -1, 0, 0] and [1, 0, 0, 0]",
                i + 1
            )
        })
    };
    let all = values.iter().enumerate().map(state);
    Ok(Some(all.collect::<Result<_, _>>()?))
}

/// What is required and not known.
fn unknown_metadata(about: &About) -> Value {
    let unknown = "not known";
    json!({
        "schema": SCHEMA,
        "id": "urn:not-known",
        "type": "BRDF",
        "timestamp": "1970-01-01T00:00:00+00",
        "provenance": {
            "organization": unknown,
            "location": { "country": unknown, "city": unknown, "street": unknown, "building_nr": unknown, "postal_code": unknown },
            "email": unknown,
            "contact_person": unknown,
        },
        "description": "Written by gonio; the time and what else is not known is not that of the measurement.",
        "method": if about.seed.is_some() { "simulation" } else { "measurement" },
        "instrumentation": "NA",
        "software": "NA",
        "sample": {
            "name": about.material.as_deref().unwrap_or(unknown),
            "type": unknown,
            "shape": unknown,
            "dimensions": {},
            "zero_azimuth_location": unknown,
        },
        "environment": "NA",
    })
}

/// Writes the readings of a measurement, those below 0 as 0; of R, G and B, for which there is no place, that is an error.
pub fn write(
    measurement: &Measurement,
    about: &About,
    sequence: Sequence<'_>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let nm: &[f64] = match measurement.channels.wavelengths() {
        Some(all) => all.nm(),
        None if measurement.channels.count() == 1 => &[],
        None => {
            let message = "the BiRD format holds luminance or wavelengths, and no R, G and B";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
    };
    let n = measurement.channels.count();
    let mut angles: [Vec<f64>; 4] = Default::default();
    let [mut wavelengths, mut values, mut uncertainties]: [Vec<f64>; 3] = Default::default();
    for pose in measurement.read_poses(sequence) {
        let Some(reading) = measurement.value(pose) else {
            continue;
        };
        let pair = &measurement.schedule.poses[pose].pair;
        let [i, o] = [pair.omega_i, pair.omega_o].map(super::pab::text_angles);
        for (c, value) in reading.iter().enumerate() {
            let azimuth = |phi: f64| phi.rem_euclid(360.0);
            let all = [i[0], azimuth(i[1]), o[0], azimuth(o[1])];
            for (to, angle) in angles.iter_mut().zip(all) {
                to.push(angle);
            }
            wavelengths.extend(nm.get(c));
            values.push(value.max(0.0));
            if let Some(details) = &measurement.details {
                let at = pose * n + c;
                uncertainties.push(details.type_a[at].hypot(details.type_b[at]));
            }
        }
    }
    let known = about.foreign_header.clone().unwrap_or_default();
    let metadata = match known.get("metadata") {
        Some(metadata @ Value::Object(_)) => metadata.clone(),
        _ => unknown_metadata(about),
    };
    let mut data = Map::new();
    let mut add = |key: &str, unit: &str, values: &[f64]| {
        let mut variable = match known.pointer(&format!("/data/{key}")) {
            Some(Value::Object(kept)) => kept.clone(),
            _ => Map::new(),
        };
        variable.insert("unit".into(), unit.into());
        variable.insert("values".into(), json!(values));
        data.insert(key.into(), variable.into());
    };
    for ((key, _), values) in ANGLES.iter().zip(&angles) {
        add(key, "deg", values);
    }
    if !wavelengths.is_empty() {
        add("wavelength_i", "nm", &wavelengths);
    }
    add("BRDF", "sr^-1", &values);
    if uncertainties.iter().any(|u| *u > 0.0) {
        add("uBRDF", "sr^-1", &uncertainties);
    }
    serde_json::to_writer(&mut *out, &json!({ "metadata": metadata, "data": data }))?;
    out.write_all(b"\n")
}
