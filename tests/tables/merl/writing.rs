//! BRDFs out: what a cell holds, what is refused, and that the bytes are always the same.

use super::{cells, first, ulps};
use crate::common::{ISOTROPIC, ONE_SIDED, made, material, member, present, says};
use gonio::brdf::measured::TableError;
use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid, write_merl};
use gonio::brdf::{self, Brdf, Channels};
use gonio::formats::{self, Tabulation};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::registry;

type Hole = fn(&DirectionPair) -> bool;

/// A smooth function with the symmetries asked for and no other; missing where `hole` says.
fn smooth(channels: &Channels, reciprocal: bool, hole: Hole) -> Box<dyn Brdf> {
    let symmetry = if reciprocal { ONE_SIDED } else { ISOTROPIC };
    let values = move |pair: &DirectionPair| {
        let (h, k) = (pair.half(), pair.back());
        let turn = h.cross(k).z;
        // Even in k, changed by a mirror; the second is odd in k.
        let even = 0.4 + 0.2 * h.z + 0.1 * turn * k.z;
        let odd = f64::from(!reciprocal) * (0.05 * turn + 0.1 * k.z);
        let f = f64::from(pair.is_above_horizon()) * (even + odd);
        (!hole(pair)).then_some([f, f * f, 1.0 - f])
    };
    match channels {
        Channels::Rgb => Box::new(made(symmetry, values)),
        _ => Box::new(made(symmetry, move |pair| values(pair).map(|v| [v[0]]))),
    }
}

fn whole(_: &DirectionPair) -> bool {
    false
}

fn written(brdf: &dyn Brdf, grid: MerlGrid) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_merl(brdf, grid, &mut bytes).unwrap();
    assert_eq!(bytes.len() as u64, grid.file_len());
    bytes
}

/// Writes, reads and compares every node; returns the worst distance in ulp.
fn round_trip(brdf: &dyn Brdf, grid: MerlGrid) -> f64 {
    let channels = brdf.channels();
    let table = Merl::read(written(brdf, grid).as_slice(), channels.clone()).unwrap();
    let (mut worst, mut held) = (0.0f64, 0);
    for cell in cells(grid) {
        let (got, pair) = (table.value(cell), grid.pair(cell));
        assert_eq!(got.is_some(), pair.is_some(), "{cell:?}");
        let (Some(got), Some(pair)) = (got, pair) else {
            continue;
        };
        held += 1;
        for (got, want) in got.into_iter().zip(present(brdf, &pair)) {
            worst = worst.max(ulps(got, want));
        }
    }
    assert!(held as f64 > 0.75 * grid.cells() as f64, "{held}");
    worst
}

#[test]
fn what_is_written_is_read_back() {
    // Luminance adds the roundings of three weights and two sums.
    for (channels, ulp) in [(Channels::Rgb, 2.0), (Channels::Luminance, 3.0)] {
        let lambert = material("lambert", "albedo = [0.9, 0.5, 0.2]", channels.clone());
        let worst = [
            round_trip(&*lambert, MerlGrid::RECIPROCAL),
            round_trip(&*smooth(&channels, true, whole), MerlGrid::RECIPROCAL),
            round_trip(&*smooth(&channels, false, whole), MerlGrid::FULL),
        ];
        assert!(worst.iter().all(|&w| w <= ulp), "{channels:?}: {worst:?}");
    }
}

/// Whatever its cells hold: at the horizon, below it, beside cells without data.
#[test]
fn a_copy_of_a_table_has_its_cells() {
    for grid in [MerlGrid::RECIPROCAL, MerlGrid::FULL] {
        let smooth = smooth(&Channels::Rgb, grid == MerlGrid::RECIPROCAL, whole);
        let mut bytes = written(&*smooth, grid);
        for (i, cell) in bytes[12..].as_chunks_mut::<8>().0.iter_mut().enumerate() {
            let i = i % grid.cells();
            let value = match i % 7 {
                3 => -1.0,
                _ => 1.0 + (i % 1000) as f64,
            };
            *cell = value.to_le_bytes();
        }
        let table = Merl::read(bytes.as_slice(), Channels::Rgb).unwrap();
        let copy = written(&table, grid);
        let numbers = |bytes: &[u8]| -> Vec<f64> {
            let cells = bytes[12..].as_chunks().0.iter();
            cells.map(|b| f64::from_le_bytes(*b)).collect()
        };
        for (copy, cell) in numbers(&copy).into_iter().zip(numbers(&bytes)) {
            assert!((copy - cell).abs() <= 1e-15 * cell.abs(), "{copy} {cell}");
        }
    }
}

#[test]
fn missing_data_stay_missing() {
    let holed = smooth(&Channels::Rgb, true, |pair| pair.separation() < 0.2);
    let bytes = written(&*holed, MerlGrid::RECIPROCAL);
    let table = Merl::read(bytes.as_slice(), Channels::Rgb).unwrap();
    let table = table.with_interpolation(Interpolation::Nearest);
    for plane in table.planes() {
        assert_eq!(plane[0], -1.0);
        assert!(plane.iter().all(|&v| v >= 0.0 || v == -1.0));
    }
    assert_eq!(table.value([10, 5, 7]), None);
    assert!(table.value([10, 6, 7]).is_some());
}

#[test]
fn broken_promises_are_written_as_missing() {
    // The last is finite, but not once it is divided by the scale of the file.
    for broken in [-0.5, f64::NAN, f64::INFINITY, 1e306] {
        let brdf = made(Symmetry::FULL, |_| Some([1.0, broken, 1.0]));
        let bytes = written(&brdf, MerlGrid::RECIPROCAL);
        assert!(bytes[12..].chunks(8).all(|b| b == (-1.0f64).to_le_bytes()));
    }
}

#[test]
fn a_table_refuses_what_it_cannot_hold() {
    let sided = smooth(&Channels::Luminance, false, whole);
    let error = write_merl(&*sided, MerlGrid::RECIPROCAL, &mut Vec::new()).unwrap_err();
    assert!(matches!(error, TableError::Unsuited(why) if why.contains("90×90×360 can hold it")));
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let brdf = smooth(&Channels::Rgb, true, whole);
    let on = |threads| crate::common::on_threads(threads, || written(&*brdf, MerlGrid::RECIPROCAL));
    assert!(on(1) == on(2));
}

#[test]
fn an_error_of_the_disk_is_passed_on() {
    struct Broken;
    impl std::io::Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("cable"))
        }
    }
    impl std::io::Write for Broken {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("disk full"))
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let grey = material("lambert", "albedo = 0.5", Channels::Luminance);
    let written = write_merl(&*grey, MerlGrid::RECIPROCAL, &mut Broken).unwrap_err();
    let read = Merl::read(Broken, Channels::Rgb).unwrap_err();
    for (error, why) in [(written, "disk full"), (read, "cable")] {
        let sentence = format!("no access to this MERL table: {why}");
        assert_eq!(error.to_string(), sentence);
    }
    let folder = tempfile::tempdir().unwrap();
    let write = formats::MERL.table.write.unwrap();
    let error = write(&*grey, Tabulation::default(), folder.path()).unwrap_err();
    assert!(matches!(error, TableError::Io(..)), "{error}");
}

#[test]
fn a_config_tabulates_another_material() {
    let of = "{ kind = 'lambert', albedo = [0.9, 0.5, 0.2] }";
    let keys = format!("format = 'merl'\ninterpolation = 'nearest'\nof = {of}");
    let spec = member(brdf::all(), "tabulated", &keys);
    assert_eq!(spec.label(), "merl-of-lambert");
    assert!(spec.tables().files.is_empty());
    // What holds the material holds its table.
    let of = "{ kind = 'tabulated', of = { kind = 'lambert' } }";
    let component = format!("component = [{{ weight = 0.5, brdf = {of} }}]");
    let retro = format!("of = {of}");
    for (kind, keys) in [("retro-reflective", retro), ("sum", component)] {
        let holder = member(brdf::all(), kind, &keys);
        assert_eq!(holder.tables(), spec.tables());
        assert!(holder.tables().channel_bytes >= 8 * MerlGrid::RECIPROCAL.cells());
    }
    spec.check(&Channels::Rgb).unwrap();
    for channels in [Channels::Rgb, Channels::Luminance] {
        let table = spec.build(channels.clone()).unwrap();
        assert_eq!(*table.channels(), channels);
        assert_eq!(table.symmetry(), Symmetry::FULL);
        let lambert = material("lambert", "albedo = [0.9, 0.5, 0.2]", channels);
        let pair = DirectionPair::from_spherical(0.4, 0.1, 0.9, 2.0);
        let [got, want] = [&table, &lambert].map(|brdf| first(&**brdf, &pair));
        assert!(ulps(got.unwrap(), want.unwrap()) <= 3.0);
    }

    let entry = brdf::all().into_iter().find(|e| e.kind == "tabulated");
    for (keys, part) in [
        ("", "of is missing"),
        ("of = { kind = 'lambert', albdeo = 1 }", "albdeo"),
        ("of = { kind = 'velvet-underground' }", "velvet-underground"),
        ("of = { kind = 'lambert' }\nsize = 3", "size"),
    ] {
        let refusal = registry::read_text(entry.as_ref().unwrap(), keys);
        says(&refusal.unwrap_err().message, part);
    }
    let bright = "of = { kind = 'lambert', albedo = 2.0 }";
    let bright = member(brdf::all(), "tabulated", bright);
    assert!(bright.check(&Channels::Rgb).is_err() && bright.build(Channels::Rgb).is_err());
}

#[test]
fn a_material_that_does_not_fit_is_the_config_s_fault() {
    let of = "{ kind = 'ward', alpha = [0.1, 0.4] }";
    let keys = format!("format = 'merl'\nof = {of}");
    let spec = member(brdf::all(), "tabulated", &keys);
    let error = spec.build(Channels::Luminance).err().unwrap();
    assert!(matches!(error, brdf::BuildError::Parameter(_)));
    assert!(error.to_string().contains("not isotropic"), "{error}");
}
