//! Archives of NumPy: what a program may write, and what is refused.

use super::common::{near, says};
use super::{ANGLES, as_text};
use gonio::formats::load_readings;
use gonio::geometry::Direction;
use gonio::schedule::Assume;
use std::io::{Cursor, Write};

/// The header of an array and its bytes.
fn array(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let fortran = if fortran { "True" } else { "False" };
    let mut head =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
    while (10 + head.len() + 1) % 64 != 0 {
        head.push(' ');
    }
    head.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((head.len() as u16).to_le_bytes());
    bytes.extend(head.bytes());
    bytes.extend(data);
    bytes
}

fn numbers(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn column(values: &[f64]) -> Vec<u8> {
    let shape = format!("({},)", values.len());
    array("<f8", false, &shape, &numbers(values))
}

fn archive(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    for (name, bytes) in files {
        zip.start_file(*name, options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The archive of one file, whose list of files gives it this size in the field for large ones.
fn promising(size: u64, mut archive: Vec<u8>) -> Vec<u8> {
    let find = |a: &[u8], mark: &[u8]| a.windows(4).rposition(|w| w == mark).unwrap();
    let entry = find(&archive, b"PK\x01\x02");
    archive[entry + 24..entry + 28].fill(0xff);
    let name = usize::from(archive[entry + 28]);
    assert_eq!(archive[entry + 30], 0);
    archive[entry + 30] = 12;
    let field = [&[1, 0, 8, 0], &size.to_le_bytes()[..]].concat();
    let place = entry + 46 + name;
    archive.splice(place..place, field);
    let end = find(&archive, b"PK\x05\x06");
    archive[end + 12] += 12;
    archive
}

/// Vectors of any length in place of angles, single precision, integers, packed.
#[test]
fn vectors_stand_for_angles() {
    let lights = [[0.0, 0.0, 2.0], [0.3, -0.4, 0.5], [-0.1, 0.2, 0.9]];
    let sensors = [[0.1f32, 0.0, 1.0], [0.0, 0.5, 0.5], [-0.3, 0.3, 0.1]];
    let values = array("<u2", false, "(3,)", &[3, 0, 1, 0, 2, 0]);
    let single = sensors.as_flattened().iter().flat_map(|v| v.to_be_bytes());
    let single: Vec<u8> = single.collect();
    let double = numbers(lights.as_flattened());
    let bytes = archive(&[
        ("value.npy", values),
        ("omega_i.npy", array("<f8", false, "(3, 3)", &double)),
        ("omega_o.npy", array(">f4", false, "(3, 3)", &single)),
        ("uncertainty.npy", column(&[0.1, 0.2, f64::NAN])),
    ]);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mine.npz");
    std::fs::write(&path, bytes).unwrap();
    let otherwise = gonio::geometry::Symmetry::NONE;
    let assume = Assume {
        otherwise,
        ..Assume::default()
    };
    let readings = load_readings(&path, &assume).unwrap();
    let m = &readings.measurement;
    assert_eq!(m.readings(), 3);
    for (i, value) in [3.0, 1.0, 2.0].into_iter().enumerate() {
        let place = (0..3).find(|p| m.values[*p] == value).unwrap();
        let pair = m.schedule.poses[place].pair;
        let [light, sensor] = [lights[i], sensors[i].map(f64::from)];
        for (found, want) in [(pair.omega_i, light), (pair.omega_o, sensor)] {
            let want = Direction::try_new(want.into()).unwrap().vector();
            near(found.vector().distance(want), 0.0, 1e-14, i);
        }
    }
}

/// Headers as other programs write them, and texts of both kinds.
#[test]
fn headers_and_texts_are_read_as_numpy_reads_them() {
    let plain = column(&[10.0, 20.0]);
    let text = std::str::from_utf8(&plain[10..plain.len() - 16]).unwrap();
    let headed = |version: u8, text: &str| {
        let size = text.len() as u32;
        let size = size.to_le_bytes();
        let size = if version == 1 { &size[..2] } else { &size };
        let start = [b"\x93NUMPY", &[version, 0][..], size].concat();
        [&start, text.as_bytes(), &plain[plain.len() - 16..]].concat()
    };
    let wide = "ok\0é\0\0".chars();
    let wide: Vec<u8> = wide.flat_map(|c| u32::from(c).to_be_bytes()).collect();
    let read = |angle: Vec<u8>, flags: Vec<u8>| {
        let others = "phi_i_deg.npy theta_o_deg.npy phi_o_deg.npy value.npy".split(' ');
        let others: Vec<_> = others.map(|name| (name, plain.clone())).collect();
        let own = [("theta_i_deg.npy", angle), ("flags.npy", flags)];
        as_text("npz", &archive(&[&own[..], &others].concat()))
    };
    let usual = read(plain.clone(), array(">U3", false, "(2,)", &wide)).unwrap();
    says(&usual, "\"ok\" … \"é\"");
    let bytes = "ok\0é\0".as_bytes();
    for angle in [
        headed(1, "{'shape':[2],'fortran_order':True,\"descr\":\"<f8\"}"),
        headed(2, text),
        headed(3, text),
    ] {
        let flags = array("|S3", false, "(2,)", bytes);
        assert_eq!(read(angle, flags).unwrap(), usual);
    }
    let head = |descr: &str, shape: &str| {
        format!("{{'descr': {descr}, 'shape': {shape}, 'fortran_order': False}}")
    };
    let structured = head("[('a', '<f4'), ('b', [('c', '<f4')])]", "(2,)");
    let endless = format!("{{'descr': {}", "[".repeat(60_000));
    let short = "{'descr': '<f8', 'shape': (2,)}".into();
    for (text, part) in [
        (structured, "it holds [('a'"),
        (endless, "its header is {'descr'"),
        (short, "allowed: descr, fortran_order and shape"),
        (head("'<f8'", "((2,),)"), "its header is"),
        (head("'<f8'", "(-2,)"), "its header is"),
        (head("'|f8'", "(2,)"), "it holds |f8"),
    ] {
        let refusal = read(headed(1, &text), plain.clone()).unwrap_err();
        says(&refusal.to_string(), part);
    }
}

#[test]
fn what_is_no_table_is_refused_by_name() {
    let with = |name: &str, bytes: Vec<u8>| {
        let names: Vec<String> = ANGLES.split(',').map(|a| format!("{a}.npy")).collect();
        let angles = names.iter().map(|n| (n.as_str(), column(&[10.0, 20.0])));
        let files: Vec<_> = angles.chain([(name, bytes)]).collect();
        as_text("npz", &archive(&files))
    };
    let values = |descr, shape, data: &[u8]| array(descr, false, shape, data);
    let two = &numbers(&[1.0, 2.0]);
    let whole = column(&[1.0, 2.0]);
    assert!(with("value.npy", column(&[1.0, f64::NAN])).is_ok());
    let long_name = format!("{}.npy", "x".repeat(300));
    let terabytes = "(1099511627776, 1099511627776)";
    let infinite = column(&[1.0, f64::INFINITY]);
    let (round, three) = ("theta_i_deg.npy/../value.npy", column(&[1.0, 2.0, 3.0]));
    let fortran = array("<f8", true, "(2, 3)", &[0; 48]);
    let cut_head = b"\x93NUMPY\x02\x00\xff\xff\xff\xff{".to_vec();
    for (name, bytes, part) in [
        ("value.npy", column(&[1.0]), "\"value\""),
        ("value.npy", infinite, "holds inf at row 1"),
        ("value.txt", whole.clone(), "value.txt"),
        (round, three, "shape [3]"),
        ("value.npy", values("<f8", "(2, 1)", two), "[2, 1]"),
        ("value.npy", values("<f8", "(3,)", two), "cut"),
        ("value.npy", values("<f8", terabytes, &two[..8]), "is cut"),
        ("value.npy", values("<c16", "(1,)", &[0; 16]), "c16"),
        ("value.npy", values("|O", "(2,)", &[0; 16]), "it holds"),
        ("omega_i.npy", fortran, "Fortran"),
        ("header.npy", whole.clone(), "header holds numbers"),
        ("value.npy", cut_head, "cut"),
        ("value.npy", Vec::new(), "is cut"),
        ("value.npy", b"\x93NUMPY\x04\x00\0\0".to_vec(), "version 4"),
        ("value.npy", b"PK\x03\x04\x04\x00\0\0".to_vec(), "begin"),
        ("flags.npy", values("|S1", "(2,)", b"a\xff"), "UTF-8"),
        ("flags.npy", values("<U1", "(2,)", &[255; 8]), "Unicode"),
        (&long_name, whole, "long name"),
    ] {
        let sentence = with(name, bytes).unwrap_err().to_string();
        let rest = sentence.strip_prefix("m: ").expect(&sentence);
        assert!(!rest.contains('\n'), "{sentence}");
        says(rest, part);
    }
    // Vectors beside angles are theirs, of any length; alone they have a direction.
    let refusal = |bytes: &[u8]| as_text("npz", bytes).unwrap_err().to_string();
    let vectors = |v: &[f64]| array("<f8", false, "(2, 3)", &numbers(v));
    let at = |deg: f64| {
        let (s, c) = f64::to_radians(deg).sin_cos();
        [s * c * 2.0, s * s * 2.0, c * 2.0]
    };
    let both = [at(10.0), at(20.0)];
    assert!(with("omega_i.npy", vectors(both.as_flattened())).is_ok());
    let other = with("omega_i.npy", vectors(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
    let other = other.unwrap_err().to_string();
    says(&other, "not the directions of theta_i_deg");
    let none = vectors(&[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let none = archive(&[("omega_i.npy", none)]);
    says(&refusal(&none), "no direction at row 1");
    let whole = archive(&[("value.npy", column(&[1.0, 2.0]))]);
    for cut in [0, 3, 30, whole.len() / 2, whole.len() - 1] {
        assert!(as_text("npz", &whole[..cut]).is_err());
    }
    // A digit that changed on the disk, and two arrays of one name.
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default();
    let stored = stored.compression_method(zip::CompressionMethod::Stored);
    zip.start_file("value.npy", stored).unwrap();
    zip.write_all(&column(&[1.0, 2.0])).unwrap();
    let mut flipped = zip.finish().unwrap().into_inner();
    let two = 2_f64.to_le_bytes();
    let place = flipped.windows(8).position(|w| w == two).unwrap();
    flipped[place + 6] ^= 1;
    says(&refusal(&flipped), "\"value\" cannot be read");
    let mut twice = archive(&[("valua.npy", column(&[1.0])), ("value.npy", column(&[2.0]))]);
    while let Some(place) = twice.windows(5).position(|w| w == b"valua") {
        twice[place + 4] = b'e';
    }
    says(&refusal(&twice), "lists 2 arrays of 1 names");
    // More than the file bears out is not made room for.
    let held = format!("{} bytes promise to hold {}", whole.len() + 12, u64::MAX);
    says(&refusal(&promising(u64::MAX, whole)), &held);
    assert!(as_text("npz", &archive(&[])).is_err());
    says(&refusal(b"theta_i_deg,value\n"), "numpy.savez");
}
