//! UTIA tables: the bytes, the nodes and what happens between them and beyond.

use super::malformed;
use crate::common::{material, member, near, present, product, says};
use gonio::brdf::measured::utia::{self, FILE_LEN, Utia};
use gonio::brdf::{self, Brdf, BrdfSpec, Channels};
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use std::fs;

const NODES: usize = 288 * 288;

fn bytes(value: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let cells = product(0..3, 0..NODES).into_iter();
    cells
        .flat_map(|(c, node)| value(c, node).to_le_bytes())
        .collect()
}

/// A table of which every value is multiplied by `scale`.
fn table(value: impl Fn(usize, usize) -> f64, scale: f64, channels: Channels) -> Utia {
    Utia::read(bytes(value).as_slice(), scale, channels).unwrap()
}

/// A material of a file.
fn spec(path: &std::path::Path, keys: &str) -> Box<dyn BrdfSpec> {
    member(brdf::all(), "utia", &format!("path = {path:?}\n{keys}"))
}

fn pair(angles_deg: [f64; 4]) -> DirectionPair {
    let [a, b, c, d] = angles_deg.map(f64::to_radians);
    DirectionPair::from_spherical(a, b, c, d)
}

/// Offsets worked out by hand from the layout of the database.
#[test]
fn values_stand_where_the_format_says() {
    assert_eq!(FILE_LEN, 1_990_656);
    // theta_i = 15°, phi_i = 7.5°: row 48 + 1 = 49; theta_v = 30°, phi_v = 352.5°: column 96 + 47.
    let by_hand = 49 * 288 + 143;
    assert_eq!(by_hand, 14_255);
    // Each value is the number of its place in the file.
    let table = table(|c, node| (c * NODES + node) as f64, 1.0, Channels::Rgb);
    for (angles, place) in [
        ([15.0, 7.5, 30.0, 352.5], 14_255),
        ([0.0, 0.0, 0.0, 0.0], 0),
        ([75.0, 352.5, 75.0, 352.5], 82_943),
        ([0.0, 0.0, 75.0, 90.0], 252),
        ([45.0, 180.0, 15.0, 0.0], (3 * 48 + 24) * 288 + 48),
    ] {
        for (c, got) in present(&table, &pair(angles)).into_iter().enumerate() {
            // The angle of a node is good to 1e-15 of a step, a step in theta_i changes 13 824.
            near(got, (c * NODES + place) as f64, 1e-9, angles);
        }
    }
}

/// Linear functions of each angle come back exactly, the azimuth through its full circle.
#[test]
fn between_nodes_the_value_is_linear_and_the_azimuth_closes() {
    // A hat in phi_v around 0°: 1 at node 0, 0 at all others.
    let hat = |node: usize| f64::from(u8::from(node.is_multiple_of(48)));
    let hats = table(|_, n| hat(n), 2.0, Channels::Luminance);
    for [phi, want] in [
        [0.0, 2.0],
        [3.75, 1.0],
        [-1.875, 1.5],
        [358.125, 1.5],
        [-7.5, 0.0],
    ] {
        let got = hats.luminance(&pair([22.0, 131.0, 41.0, phi])).unwrap();
        near(got, want, 1e-12, phi);
    }
}

#[test]
fn what_was_not_measured_is_missing() {
    let flat = table(|_, _| 0.25, 1.0, Channels::Rgb);
    assert_eq!(flat.symmetry(), Symmetry::NONE);
    present(&flat, &pair([75.0, 10.0, 75.0, 20.0]));
    for beyond in [[75.01, 10.0, 10.0, 20.0], [10.0, 10.0, 89.0, 20.0]] {
        assert_eq!(flat.luminance(&pair(beyond)), None);
    }
    let below = Direction::try_new(glam::DVec3::new(0.6, 0.0, -0.8)).unwrap();
    let below = DirectionPair::new(Direction::NORMAL, below);
    assert_eq!(present(&flat, &below), [0.0; 3]);
    // One channel of one node without data: left out where it is one of sixteen, missing on it. Stored, the second is
    // finite; in 1/sr it is not.
    let node = 2 * 48 * 288 + 2 * 48;
    for (bad, scale) in [(f64::NAN, 1.0), (1e305, 1e6)] {
        for channels in [Channels::Rgb, Channels::Luminance] {
            let holed = |c, n| if (c, n) == (1, node) { bad } else { 0.25 };
            let table = table(holed, scale, channels);
            assert_eq!(table.luminance(&pair([30.0, 0.0, 30.0, 0.0])), None);
            let beside = table.luminance(&pair([31.0, 1.0, 31.0, 1.0])).unwrap();
            near(beside / scale, 0.25, 1e-15, bad);
        }
    }
    // Noise below 0 is darkness.
    let dark = table(|_, _| -0.1, 1.0, Channels::Luminance);
    assert_eq!(dark.luminance(&pair([30.0, 0.0, 30.0, 0.0])), Some(0.0));
}

#[test]
fn marks_stand_for_no_reading_and_noise_for_0() {
    // Sensors at 15° with azimuths of 0°, 7.5° and 15°.
    let stored = |_, node| match node {
        48 => -999.0,
        49 => -0.001,
        50 => f64::INFINITY,
        _ => 0.25,
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bin");
    fs::write(&path, bytes(stored)).unwrap();
    let spec = spec(&path, "scale = 4");
    let marks = "taken for no reading: -999 in 3 cells, inf in 3 cells";
    let remarks = spec.build(Channels::Rgb).unwrap().remarks();
    assert_eq!(remarks, [marks, "3 values are below 0: taken as 0"]);
    for channels in [Channels::Rgb, Channels::Luminance] {
        let table = spec.build(channels).unwrap();
        assert_eq!(table.cells_without_reading(), 6);
        let at = |theta, phi| table.luminance(&pair([0.0, 0.0, theta, phi]));
        assert_eq!([at(15.0, 0.0), at(15.0, 15.0)], [None, None]);
        // The node at the normal is the only one with a reading, and all others are 4 · .25.
        for (theta, phi, want) in [(15.0, 7.5, 0.0), (7.5, 0.0, 1.0), (15.0, 22.5, 1.0)] {
            near(at(theta, phi).unwrap(), want, 1e-12, (theta, phi));
        }
    }
}

/// The truth at every node, whatever lies between: writer and reader agree with the definition of
/// the grid, which is written out here.
#[test]
fn a_written_table_holds_the_truth_at_its_nodes() {
    let text = "alpha = [0.2, 0.5]\nrho_s = [0.5, 0.3, 0.1]";
    let truth = material("ward", text, Channels::Rgb);
    let mut file = Vec::new();
    utia::write_utia(&*truth, &mut file).unwrap();
    assert_eq!(file.len() as u64, FILE_LEN);
    let grey = Utia::read(file.as_slice(), 1.0, Channels::Luminance).unwrap();
    let table = Utia::read(file.as_slice(), 1.0, Channels::Rgb).unwrap();
    for (i, a, v, b) in [(0, 0, 0, 0), (1, 3, 4, 40), (5, 47, 5, 23), (3, 12, 2, 36)] {
        let node = |t: i32, p: i32| [15.0 * f64::from(t), 7.5 * f64::from(p)];
        let ([ti, pi], [tv, pv]) = (node(i, a), node(v, b));
        let pair = pair([ti, pi, tv, pv]);
        let [want, got] = [&*truth, &table].map(|brdf| present(brdf, &pair));
        for (got, want) in got.into_iter().zip(want) {
            near(got / want, 1.0, 1e-12, pair);
        }
        let [a, b] = [&grey, &table].map(|table| table.luminance(&pair).unwrap());
        near(a / b, 1.0, 1e-14, pair);
    }
    // As a material: the same table without a file.
    let of = format!("kind = \"ward\", {}", text.replace('\n', ", "));
    let keys = format!("format = \"utia\"\nof = {{ {of} }}");
    let spec = member(brdf::all(), "tabulated", &keys);
    assert_eq!(spec.favours().name(), "spherical table");
    let symmetry = spec.symmetry(&Channels::Rgb).unwrap();
    assert_eq!(symmetry, Symmetry::ORTHOTROPIC);
    let memory = spec.build(Channels::Rgb).unwrap();
    assert_eq!(memory.symmetry(), Symmetry::ORTHOTROPIC);
    for pair in brdf::laws::pairs(500, 3) {
        assert_eq!(memory.luminance(&pair), table.luminance(&pair));
    }
}

#[test]
fn unusable_files_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("cloth.bin");
    let check = |keys: &str| spec(&path, keys).check(&Channels::Rgb);
    let checked = |keys: &str| check(keys).unwrap_err().to_string();
    let long = FILE_LEN as usize + 8;
    for (length, part) in [
        (None, "no access to this UTIA table"),
        (Some(12), "found 12 bytes, expected 1990656"),
        (Some(long), "expected 1990656"),
    ] {
        if let Some(length) = length {
            fs::write(&path, vec![0; length]).unwrap();
        }
        let sentence = checked("");
        assert!(sentence.starts_with(path.to_str().unwrap()), "{sentence}");
        says(&sentence, part);
        assert!(spec(&path, "").build(Channels::Luminance).is_err());
    }
    fs::write(&path, bytes(|_, _| f64::INFINITY)).unwrap();
    check("").unwrap();
    let refusal = spec(&path, "").build(Channels::Rgb).err().unwrap();
    says(&refusal.to_string(), "no data");
    fs::write(&path, bytes(|_, _| 1.0)).unwrap();
    assert_eq!(spec(&path, "").label(), "cloth");
    assert_eq!(spec(&path, "").favours().name(), "spherical table");
    says(&checked("scale = 0.0"), "scale = 0");
    let half = spec(&path, "scale = 0.5").build(Channels::Luminance);
    let got = half.unwrap().luminance(&pair([10.0, 0.0, 10.0, 0.0]));
    near(got.unwrap(), 0.5, 1e-15, "half");
    // Streams, whose length is not known beforehand.
    let long = [bytes(|_, _| 1.0), vec![0]].concat();
    for (length, part) in [(long.len(), "more data"), (100, "found 100 bytes")] {
        let read = Utia::read(&long[..length], 1.0, Channels::Luminance);
        says(&malformed(read), part);
    }
}
