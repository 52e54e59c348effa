//! UTIA tables: the bytes, the nodes and what happens between them and beyond. No file is needed: every
//! table is made here.
#![cfg(feature = "experiments")]

use gonio::brdf::measured::utia::{self, FILE_LEN, Utia, index};
use gonio::brdf::{self, Brdf, Channels, Presence};
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use std::fs;
use toml::de::DeTable;

const NODES: usize = 288 * 288;

fn bytes(value: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let planes = (0..3).flat_map(|c| (0..NODES).map(move |node| (c, node)));
    planes
        .flat_map(|(c, node)| value(c, node).to_le_bytes())
        .collect()
}

fn rgb(table: &Utia, pair: &DirectionPair) -> Option<[f64; 3]> {
    let mut out = [f64::NAN; 3];
    (table.eval(pair, &mut out) == Presence::Present).then_some(out)
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
    assert_eq!(index([1, 1], [2, 47]), by_hand);
    assert_eq!(by_hand, 14_255);
    // Each value is the number of its place in the file.
    let file = bytes(|c, node| (c * NODES + node) as f64);
    let table = Utia::read(file.as_slice(), 1.0, Channels::Rgb).unwrap();
    for (angles, place) in [
        ([15.0, 7.5, 30.0, 352.5], 14_255),
        ([0.0, 0.0, 0.0, 0.0], 0),
        ([75.0, 352.5, 75.0, 352.5], 82_943),
        ([0.0, 0.0, 75.0, 90.0], 252),
        ([45.0, 180.0, 15.0, 0.0], (3 * 48 + 24) * 288 + 48),
    ] {
        let got = rgb(&table, &pair(angles)).unwrap();
        for (c, got) in got.into_iter().enumerate() {
            let want = (c * NODES + place) as f64;
            // The angle of a node is good to 1e-15 of a step, a step in theta_i changes 13 824.
            assert!((got - want).abs() < 1e-9, "{angles:?}: {got} {want}");
        }
    }
}

/// Linear functions of each angle come back exactly, the azimuth through its full circle.
#[test]
fn between_nodes_the_value_is_linear_and_the_azimuth_closes() {
    // A hat in phi_v around 0°: 1 at node 0, 0 at all others.
    let hat = |node: usize| f64::from(u8::from(node.is_multiple_of(48)));
    let table = Utia::read(bytes(|_, n| hat(n)).as_slice(), 2.0, Channels::Luminance).unwrap();
    for (phi, want) in [
        (0.0, 2.0),
        (3.75, 1.0),
        (-1.875, 1.5),
        (358.125, 1.5),
        (-7.5, 0.0),
    ] {
        let got = table.luminance(&pair([22.0, 131.0, 41.0, phi])).unwrap();
        assert!((got - want).abs() < 1e-12, "{phi}: {got}");
    }
    // A product of elevations.
    let product = |node: usize| ((node / 288 / 48) * (node % 288 / 48)) as f64;
    let table = Utia::read(
        bytes(|_, n| product(n)).as_slice(),
        1.0,
        Channels::Luminance,
    )
    .unwrap();
    let got = table.luminance(&pair([40.0, 12.0, 70.0, 200.0])).unwrap();
    assert!((got - 40.0 * 70.0 / 225.0).abs() < 1e-12, "{got}");
}

#[test]
fn what_was_not_measured_is_missing() {
    let table = Utia::read(bytes(|_, _| 0.25).as_slice(), 1.0, Channels::Rgb).unwrap();
    assert_eq!(table.symmetry(), Symmetry::NONE);
    assert!(rgb(&table, &pair([75.0, 10.0, 75.0, 20.0])).is_some());
    assert_eq!(rgb(&table, &pair([75.01, 10.0, 10.0, 20.0])), None);
    assert_eq!(rgb(&table, &pair([10.0, 10.0, 89.0, 20.0])), None);
    let below = DirectionPair::new(
        Direction::NORMAL,
        Direction::try_new(glam::DVec3::new(0.6, 0.0, -0.8)).unwrap(),
    );
    assert_eq!(rgb(&table, &below), Some([0.0; 3]));

    // One channel of one node without data: left out where it is one of sixteen, missing on it.
    let node = index([2, 0], [2, 0]);
    let holed = |c, n| if (c, n) == (1, node) { f64::NAN } else { 0.25 };
    for channels in [Channels::Rgb, Channels::Luminance] {
        let table = Utia::read(bytes(holed).as_slice(), 1.0, channels).unwrap();
        assert_eq!(table.luminance(&pair([30.0, 0.0, 30.0, 0.0])), None);
        let near = table.luminance(&pair([31.0, 1.0, 31.0, 1.0])).unwrap();
        assert!((near - 0.25).abs() < 1e-15);
    }
    // Stored, it is finite; in 1/sr it is not.
    let huge = |c, n| if (c, n) == (1, node) { 1e305 } else { 0.25 };
    for channels in [Channels::Rgb, Channels::Luminance] {
        let table = Utia::read(bytes(huge).as_slice(), 1e6, channels).unwrap();
        assert_eq!(table.luminance(&pair([30.0, 0.0, 30.0, 0.0])), None);
    }
    // Noise below 0 is darkness.
    let table = Utia::read(bytes(|_, _| -0.1).as_slice(), 1.0, Channels::Luminance).unwrap();
    assert_eq!(table.luminance(&pair([30.0, 0.0, 30.0, 0.0])), Some(0.0));
}

/// The truth at every node, whatever lies between: writer and reader agree with the definition of
/// the grid, which is written out here.
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
    let keys = format!("kind = \"utia\"\npath = {path:?}\nscale = 4");
    let spec = brdf::read(DeTable::parse(&keys).unwrap()).unwrap();
    assert_eq!(
        spec.build(Channels::Rgb).unwrap().remarks(),
        [
            "taken for no reading: -999 in 3 cells, inf in 3 cells",
            "3 values are below 0: taken as 0"
        ]
    );
    for channels in [Channels::Rgb, Channels::Luminance] {
        let table = spec.build(channels).unwrap();
        assert_eq!(table.cells_without_reading(), 6);
        let at = |theta, phi| table.luminance(&pair([0.0, 0.0, theta, phi]));
        assert_eq!([at(15.0, 0.0), at(15.0, 15.0)], [None, None]);
        // The node at the normal is the only one with a reading, and all others are 4 · .25.
        for (theta, phi, want) in [(15.0, 7.5, 0.0), (7.5, 0.0, 1.0), (15.0, 22.5, 1.0)] {
            assert!(
                (at(theta, phi).unwrap() - want).abs() < 1e-12,
                "{theta} {phi}"
            );
        }
    }
}

#[test]
fn a_written_table_holds_the_truth_at_its_nodes() {
    let text = "kind = \"ward\"\nalpha = [0.2, 0.5]\nrho_s = [0.5, 0.3, 0.1]";
    let spec = brdf::read(DeTable::parse(text).unwrap()).unwrap();
    let truth = spec.build(Channels::Rgb).unwrap();
    let mut file = Vec::new();
    utia::write_utia(&*truth, &mut file).unwrap();
    assert_eq!(file.len() as u64, FILE_LEN);
    let grey = Utia::read(file.as_slice(), 1.0, Channels::Luminance).unwrap();
    let table = Utia::read(file.as_slice(), 1.0, Channels::Rgb).unwrap();
    for (i, a, v, b) in [(0, 0, 0, 0), (1, 3, 4, 40), (5, 47, 5, 23), (3, 12, 2, 36)] {
        let node = |t: i32, p: i32| [15.0 * f64::from(t), 7.5 * f64::from(p)];
        let ([ti, pi], [tv, pv]) = (node(i, a), node(v, b));
        let pair = pair([ti, pi, tv, pv]);
        let mut want = [0.0; 3];
        assert_eq!(truth.eval(&pair, &mut want), Presence::Present);
        let got = rgb(&table, &pair).unwrap();
        for (got, want) in got.into_iter().zip(want) {
            assert!((got / want - 1.0).abs() < 1e-12, "{got} {want}");
        }
        let (a, b) = (
            grey.luminance(&pair).unwrap(),
            table.luminance(&pair).unwrap(),
        );
        assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
    }
    // As a material: the same table without a file.
    let text = format!(
        "kind = \"tabulated\"\nformat = \"utia\"\nof = {{ {} }}",
        text.replace('\n', ", ")
    );
    let spec = brdf::read(DeTable::parse(&text).unwrap()).unwrap();
    assert_eq!(spec.favours().name(), "spherical table");
    assert_eq!(
        spec.symmetry(&Channels::Rgb).unwrap(),
        Symmetry::ORTHOTROPIC
    );
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
    let spec = |rest: &str| {
        let text = format!("kind = \"utia\"\npath = {path:?}\n{rest}");
        brdf::read(DeTable::parse(&text).unwrap()).unwrap()
    };
    let refused = |part: &str| {
        let sentence = spec("").check(&Channels::Rgb).unwrap_err().to_string();
        assert!(sentence.starts_with(path.to_str().unwrap()), "{sentence}");
        assert!(sentence.contains(part), "{sentence}");
        assert!(spec("").build(Channels::Luminance).is_err());
    };
    refused("no access to this UTIA table");
    fs::write(&path, [0; 12]).unwrap();
    refused("found 12 bytes, expected 1990656");
    fs::write(&path, vec![0; FILE_LEN as usize + 8]).unwrap();
    refused("expected 1990656");
    fs::write(&path, bytes(|_, _| f64::INFINITY)).unwrap();
    spec("").check(&Channels::Rgb).unwrap();
    let sentence = spec("").build(Channels::Rgb).err().unwrap().to_string();
    assert!(sentence.contains("no data"), "{sentence}");
    fs::write(&path, bytes(|_, _| 1.0)).unwrap();
    assert_eq!(spec("").label(), "cloth");
    assert_eq!(spec("").favours().name(), "spherical table");
    let sentence = spec("scale = 0.0")
        .check(&Channels::Rgb)
        .unwrap_err()
        .to_string();
    assert!(sentence.contains("scale = 0"), "{sentence}");
    let brdf = spec("scale = 0.5").build(Channels::Luminance).unwrap();
    let got = brdf.luminance(&pair([10.0, 0.0, 10.0, 0.0])).unwrap();
    assert!((got - 0.5).abs() < 1e-15);
    // Streams, whose length is not known beforehand.
    let long = [bytes(|_, _| 1.0), vec![0]].concat();
    let error = Utia::read(long.as_slice(), 1.0, Channels::Luminance).unwrap_err();
    assert!(error.to_string().contains("more data"));
    let error = Utia::read(&long[..100], 1.0, Channels::Luminance).unwrap_err();
    assert!(error.to_string().contains("found 100 bytes"));
}
