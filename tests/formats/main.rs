//! Files of schedules and measurements: what is written is what is read, and what was cut, mixed up
//! or misspelt is refused with its line.
#![cfg(all(feature = "arrays", feature = "experiments"))]

#[path = "../common/mod.rs"]
mod common;

mod alta;
mod conventions;
mod doubts;
mod field;
mod instruments;
mod lab;
mod measurements;
mod npz;
mod registry;
mod schedules;
mod schema;
mod visited;

use common::{planned, polar, says, wavelengths};
use gonio::brdf::Channels;
use gonio::formats::{self, READ_READINGS, Readings, of_text, read_readings};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::{self, WarpSpec};
use gonio::schedule::{AngleUnit, Azimuth, Choice, Conventions, Polarisation, Quantity};
use gonio::schedule::{Assume, FileError, MAX_AXES, write_schedule};
use gonio::schedule::{Itinerary, Schedule, ScheduleFormat, Unreachable, Visit};
use std::sync::Arc;

/// An error and those behind it.
fn chain(e: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(e.source(), |e| e.source());
    causes.fold(e.to_string(), |text, e| format!("{text}; because: {e}"))
}

/// The columns of angles, degrees.
const ANGLES: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";

/// The head of an ALTA file whose coordinates are four angles, rad.
const ALTA: &str = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n";

/// Conventions from words, those of the command line without their dashes.
fn conventions(words: &str) -> Conventions {
    fn choice<T: Copy, const N: usize>(all: [Choice<T>; N], name: &str) -> Option<T> {
        let found = all.into_iter().find(|choice| choice.name == name);
        Some(found.expect("a name").value)
    }
    let mut conventions = Conventions::default();
    for word in words.split_whitespace() {
        match word.split_once('=').unwrap_or((word, "")) {
            ("elevation", _) => conventions.elevation = true,
            ("partial", _) => conventions.partial = true,
            ("pixels", n) => conventions.pixels = n.parse().ok(),
            ("angles", name) => conventions.angles = choice(AngleUnit::ALL, name),
            ("azimuth", name) => conventions.azimuth = choice(Azimuth::ALL, name),
            ("polarisation", name) => conventions.polarisation = choice(Polarisation::ALL, name),
            ("coverage-factor", k) => conventions.coverage_factor = k.parse().ok(),
            ("quantity", name) => conventions.quantity = choice(Quantity::ALL, name),
            ("columns", pairs) => {
                let pairs = pairs.split(',').filter_map(|pair| pair.split_once('='));
                conventions.columns = pairs.map(|(a, b)| (a.into(), b.into())).collect();
            }
            _ => panic!("{word}"),
        }
    }
    conventions
}

/// The readings of a text in the format that it says.
fn try_read(text: &str, conventions: Conventions) -> Result<Readings, FileError> {
    let assume = Assume {
        conventions,
        ..Assume::default()
    };
    let read = READ_READINGS.function(&of_text(text).unwrap()).unwrap();
    read_readings(read, text, "m.csv", &assume)
}

/// The readings of a text under conventions.
fn read(text: &str, words: &str) -> Readings {
    let readings = try_read(text, conventions(words));
    readings.unwrap_or_else(|e| panic!("{words}: {}\n{text}", chain(&e)))
}

/// Asserts that a text is refused in this line, `-` for none, with these parts of the sentence, of which nothing is lost on
/// the way to the terminal.
#[track_caller]
fn refused<T>(read: Result<T, FileError>, line: &str, parts: &str) {
    let e = read.err().unwrap_or_else(|| panic!("taken: {parts}"));
    assert_eq!(e.line, line.parse().ok(), "{e}");
    let sentence = chain(&e);
    let place = e.line.map_or(": ".into(), |line| format!(":{line}: "));
    assert!(sentence.starts_with(&format!("{}{place}", e.name)), "{e}");
    says(&sentence, parts);
    let error = gonio::Error::from(e);
    assert_eq!((error.exit_code(), chain(&error)), (3, sentence));
}

/// The text that bytes of a format stand for.
fn as_text(name: &str, bytes: &[u8]) -> Result<String, FileError> {
    let format = formats::all().into_iter().find(|f| f.name == name).unwrap();
    match format.as_text {
        Some(as_text) => as_text(bytes, "m"),
        None => Ok(String::from_utf8(bytes.to_vec()).unwrap()),
    }
}

const FORMATS: [ScheduleFormat; 2] = [ScheduleFormat::Csv, ScheduleFormat::JsonLines];

/// Luminance, colours, one wavelength, and several that no short decimal names.
fn kinds() -> [Channels; 4] {
    let many = [380.5, 1550.0 / 3.0, 632.8, 1064.0, 10_600.0];
    let spectral = [wavelengths(&[450.0]), wavelengths(&many)];
    let [one, many] = spectral;
    [Channels::Luminance, Channels::Rgb, one, many]
}

/// Grids and scattered sets in every polar parametrization, with and without symmetries, one warped.
fn schedules() -> Vec<Arc<Schedule>> {
    let mut schedules = Vec::new();
    for symmetry in [Symmetry::FULL, Symmetry::NONE] {
        let mut forms: Vec<_> = polar().map(|e| e.form(symmetry)).collect();
        let root = WarpSpec::SquareRoot;
        for (name, warps) in [
            ("half-difference", [("theta_h", root), ("theta_d", root)]),
            ("hybrid", [("k", WarpSpec::Arcsine), ("h_bar", root)]),
        ] {
            let warps = warps.map(|(axis, warp)| (axis.to_owned(), warp)).into();
            let entry = parametrization::find(name).unwrap();
            forms.push(entry.warped(symmetry, &warps).unwrap());
        }
        let sets = |form| ["grid", "sobol"].map(|set| planned(form, set, 120, 1));
        schedules.extend(forms.iter().flat_map(sets));
    }
    schedules
}

/// An itinerary backwards, with every fifth pose out of reach for all sorts of reasons.
fn backwards(schedule: &Schedule) -> Itinerary {
    let reasons = [
        Unreachable::LightElevation,
        Unreachable::SensorElevation,
        Unreachable::Occluded,
        Unreachable::AxisRange(2),
        Unreachable::Collision(1),
    ];
    let mut itinerary = Itinerary {
        instrument: "a bench, with \"quotes\"".into(),
        // The second is called like a coordinate.
        axes: ["light, \"upper\" arm", "theta_i", "turn"]
            .map(String::from)
            .into(),
        order: "as-generated".into(),
        visits: Vec::new(),
        unreachable: Vec::new(),
    };
    for pose in (0..schedule.poses.len() as u32).rev() {
        if pose % 5 == 3 {
            let why = reasons[pose as usize / 5 % reasons.len()];
            itinerary.unreachable.push((pose, why));
            continue;
        }
        let x = f64::from(pose);
        let mut positions = [0.0; MAX_AXES];
        positions[..3].copy_from_slice(&[0.1 * x, -1.0 / (1.0 + x), 3.0]);
        itinerary.visits.push(Visit {
            pose,
            block: pose / 7,
            stop: pose,
            positions,
            move_seconds: 0.1 + x,
            exposure_seconds: 0.3,
            seconds: 1.0 + x,
            at_seconds: 1e4 - x,
            since_calibration_seconds: 0.0,
        });
    }
    itinerary
}

fn text(schedule: &Schedule, itinerary: Option<&Itinerary>, format: ScheduleFormat) -> String {
    let mut bytes = Vec::new();
    write_schedule(schedule, itinerary.into(), format, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// The larger chord between the directions of two pairs.
fn chord(a: &DirectionPair, b: &DirectionPair) -> f64 {
    let light = (a.omega_i.vector() - b.omega_i.vector()).length();
    light.max((a.omega_o.vector() - b.omega_o.vector()).length())
}

/// Line ends from which on a text is cut: every byte of its last three lines but the last.
fn cuts(text: &str) -> impl Iterator<Item = &str> {
    let ends: Vec<_> = text.match_indices('\n').map(|(i, _)| i).collect();
    let from = ends[ends.len() - 4];
    (from..text.len() - 1).filter_map(move |end| text.get(..end))
}

/// A text without the lines of its header.
fn bare(text: &str) -> String {
    let lines = text.lines().filter(|l| !l.starts_with('#'));
    lines.flat_map(|line| [line, "\n"]).collect()
}
