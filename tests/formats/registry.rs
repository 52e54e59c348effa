//! The list of formats: names and extensions say one thing each, and what it promises is there.

use super::common::{form, model, near, planned, says};
use super::{ScheduleFormat, text};
use gonio::brdf::{self, Channels};
use gonio::formats::{self, MERL, Tabulation};
use gonio::formats::{READ_READINGS, READ_SCHEDULE, READ_TABLE};
use gonio::formats::{WRITE_READINGS, WRITE_SCHEDULE, WRITE_TABLE};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::About;
use gonio::schedule::{AngleUnit, Assume, Azimuth, Quantity, Sequence};
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn names_and_extensions_tell_formats_apart() {
    let (mut names, mut extensions) = (BTreeSet::new(), BTreeSet::new());
    for format in formats::all() {
        assert!(names.insert(format.name), "{format:?} twice");
        assert!(!format.holds().is_empty(), "{format:?} holds nothing");
        assert!(!format.extensions.is_empty());
        for extension in format.extensions {
            assert!(extensions.insert(*extension), "{extension} twice");
            for name in [extension.to_string(), extension.to_uppercase()] {
                let path = format!("some.where/file.{name}");
                assert_eq!(formats::of_name(Path::new(&path)), Some(format));
            }
        }
    }
    for name in ["poses.json", "csv", "a.binary.part", ""] {
        assert_eq!(formats::of_name(Path::new(name)), None);
    }
}

#[test]
fn the_page_has_every_format() {
    let page = include_str!("../../src/docs/formats.md");
    let rows = formats::all().into_iter().map(|format| {
        let (name, holds, summary) = (format.name, format.holds(), format.summary);
        let (extensions, holds) = (format.extensions.join(", ."), holds.join(", "));
        format!("| `{name}` | .{extensions} | {holds} | {summary} |\n")
    });
    let table = "|---|---|---|---|\n".to_owned() + &rows.collect::<String>() + "\n";
    assert!(page.contains(&table), "the page should have\n{table}");
}

#[test]
fn the_page_has_every_convention() {
    let page = include_str!("../../src/docs/formats.md");
    let options = (AngleUnit::ALL.iter().map(|c| ("angles", c.name)))
        .chain(Azimuth::ALL.iter().map(|c| ("azimuth", c.name)))
        .chain(Quantity::ALL.iter().map(|c| ("quantity", c.name)));
    for (option, name) in options {
        let row = page.lines().find(|line| {
            line.starts_with(&format!("| `--{option} ")) && line.contains(&format!("{name}` |"))
        });
        assert!(row.is_some(), "no row of --{option} {name}");
    }
}

#[test]
fn what_is_not_known_is_refused_with_what_is_allowed() {
    let refused = |path: &str| WRITE_SCHEDULE.choose(None, Path::new(path)).unwrap_err();
    for path in ["a.txt", "a.bin", "a"] {
        let error = refused(path);
        says(&error.to_string(), "is known by this name");
        for format in WRITE_SCHEDULE.formats() {
            says(&error.to_string(), format.extension());
        }
    }
    // A name that was chosen goes before the extension.
    let csv = WRITE_SCHEDULE.named("csv").unwrap();
    assert!(WRITE_SCHEDULE.choose(Some(csv), Path::new("a.txt")).is_ok());
    let error = WRITE_SCHEDULE.named("merl").unwrap_err();
    says(&error.to_string(), "csv, json-lines");
    assert_eq!(WRITE_SCHEDULE.function(&MERL).unwrap_err(), error);
}

#[test]
fn every_text_is_recognised_and_read_by_what_wrote_it() {
    let schedule = planned(&form("hybrid", Symmetry::FULL), "grid", 40, 1);
    let measurement = Ideal.measure(&*model("lambert", "albedo = 0.5"), &schedule);
    let (about, order, assume) = (About::default(), Sequence::Generated, Assume::default());
    let text_of = |format: &formats::Format, bytes: &[u8]| {
        let written = super::as_text(format.name, bytes).unwrap();
        let is_text = format.as_text.is_none();
        assert!(!is_text || formats::of_text(&written) == Some(*format));
        written
    };
    for format in WRITE_SCHEDULE.formats() {
        let mut bytes = Vec::new();
        WRITE_SCHEDULE.function(&format).unwrap()(&schedule, order, &mut bytes).unwrap();
        let read = READ_SCHEDULE.function(&format).unwrap();
        let file = read(&text_of(&format, &bytes), "a", &assume).unwrap();
        // The poses of a lattice are laid out again, to the bit.
        assert_eq!(file.schedule.poses, schedule.poses);
    }
    for format in WRITE_READINGS.formats() {
        let mut bytes = Vec::new();
        let write = WRITE_READINGS.function(&format).unwrap();
        write(&measurement, &about, order, &mut bytes).unwrap();
        let read = READ_READINGS.function(&format).unwrap();
        let readings = read(&text_of(&format, &bytes), "a", &assume).unwrap();
        assert_eq!(readings.measurement.values, measurement.values);
        assert!(readings.notes.is_empty());
    }
    let alta = "#DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 0.3\n";
    assert_eq!(formats::of_text(alta).unwrap().name, "alta");
    // Spaces and a byte-order mark are no obstacle.
    let json = text(&schedule, None, ScheduleFormat::JsonLines);
    let json = formats::of_text(&format!("\u{feff} \n{json}")).unwrap();
    assert_eq!(json.name, "json-lines");
}

#[test]
fn every_table_is_read_by_what_wrote_it() {
    let dir = tempfile::tempdir().unwrap();
    let truth = model("lambert", "albedo = 0.5");
    for format in WRITE_TABLE.formats().filter(|f| f.table.read.is_some()) {
        let path = dir.path().join(format!("a.{}", format.extension()));
        let write = WRITE_TABLE.choose(None, &path).unwrap();
        assert_eq!(write(&*truth, Tabulation::default(), &path).unwrap(), 0);
        let spec = READ_TABLE.function(&format).unwrap()(path.clone());
        spec.check(&Channels::Luminance).unwrap();
        let again = brdf::read(toml::de::DeTable::parse(&spec.resolved().to_string()).unwrap());
        assert_eq!(again.unwrap().resolved(), spec.resolved());
        let table = spec.build(Channels::Luminance).unwrap();
        let pair = DirectionPair::from_spherical(0.4, 0.1, 0.9, 2.0);
        let [a, b] = [&truth, &table].map(|brdf| brdf.luminance(&pair).unwrap());
        // A format of several sizes is as near as they are fine.
        let most = if format.table.sizes == 1 { 1e-14 } else { 1e-3 };
        near(a, b, most, format.name);
    }
}

#[test]
fn only_tables_are_listed_and_in_order() {
    let dir = tempfile::tempdir().unwrap();
    assert!(formats::files_in(&dir.path().join("nowhere"), &MERL).is_err());
    assert!(formats::files_in(dir.path(), &MERL).unwrap().is_empty());
    for name in "b.binary a.binary ._a.binary c.binary.part d e.bin".split(' ') {
        std::fs::write(dir.path().join(name), "").unwrap();
    }
    std::fs::create_dir(dir.path().join("e.binary")).unwrap();
    // A link that leads nowhere is a table that cannot be read.
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere", dir.path().join("c.binary")).unwrap();
    let files = formats::files_in(dir.path(), &MERL).unwrap();
    let names: Vec<_> = files.iter().map(|p| p.file_name().unwrap()).collect();
    let expected = ["a.binary", "b.binary", "c.binary"];
    assert_eq!(names, expected[..if cfg!(unix) { 3 } else { 2 }]);
}
