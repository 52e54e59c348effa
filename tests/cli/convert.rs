//! `gonio convert`: what goes through is told, and is what was there.

use super::Bench;
use std::fs;

const MATERIAL: &str = "budgets = [60]\n[[material]]\nkind = \"ggx\"\nalpha = 0.3\n";

/// A measurement with noise, flags and poses out of reach, in a bench.
fn measured() -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("a.toml"), MATERIAL).unwrap();
    bench.shown("gonio schedule a.toml --budget 60 -o poses.csv");
    bench.shown("gonio measure poses.csv --config a.toml --instrument cornell --skip-unreachable -o lab.csv");
    bench
}

#[test]
fn arrays_and_lines_lose_nothing() {
    let bench = measured();
    let there = bench.shown("gonio convert lab.csv lab.npz");
    assert!(
        there.contains("kept: uncertainties, of type A and B"),
        "{there}"
    );
    assert!(
        !there.contains("changed: ") && there.contains("values moved by at most 0.0e0"),
        "{there}"
    );
    bench.shown("gonio convert lab.npz lab.jsonl");
    bench.shown("gonio convert lab.jsonl again.csv");
    bench.shown("gonio convert lab.csv once.csv");
    assert_eq!(bench.read("again.csv"), bench.read("once.csv"));
    // A schedule is one before and after.
    let told = bench.shown("gonio convert poses.csv poses.npz");
    assert!(told.contains("kept: 45 poses"), "{told}");
    bench.shown("gonio convert poses.npz poses.jsonl");
    bench.shown("gonio convert poses.jsonl again.csv --force");
    bench.shown("gonio convert poses.csv once.csv --force");
    assert_eq!(bench.read("again.csv"), bench.read("once.csv"));
    // What the set of the poses was called stays with the first file; the rows are the same.
    let rows = |file: &str| -> Vec<String> {
        let lines = bench.read(file);
        let lines = lines.lines().filter(|l| !l.starts_with('#'));
        lines.map(String::from).collect()
    };
    assert_eq!(rows("again.csv"), rows("poses.csv"));
}

#[test]
fn what_a_format_has_no_place_for_is_named() {
    let bench = measured();
    let told = bench.shown("gonio convert lab.csv lab.astm");
    assert!(
        told.contains("changed: uncertainties, of type A and B before, none after"),
        "{told}"
    );
    assert!(told.contains("kept: readings, "), "{told}");
    // A folder of one light a file, and all of them in one again.
    let folder = bench.shown("gonio convert lab.csv scans --format pab-opto");
    let moved = folder
        .lines()
        .find(|l| l.starts_with("values moved"))
        .unwrap();
    let number = |word: usize| moved.split(' ').nth(word).unwrap().parse::<f64>().unwrap();
    assert!(number(5) < 1e-5, "{folder}");
    let files: Vec<_> = fs::read_dir(bench.path("scans")).unwrap().collect();
    assert!(files.len() > 1);
    bench.refused(&["convert", "lab.csv", "lab.astm"], 2);
    bench.refused(&["convert", "lab.csv", "lab.binary"], 2);
    bench.refused(&["convert", "lab.csv", "lab.none"], 2);
    bench.refused(&["convert", "nowhere.csv", "b.csv"], 3);
}

#[test]
fn a_table_goes_into_another_format() {
    let bench = measured();
    bench.shown("gonio tabulate a.toml -o a.binary");
    let told = bench.shown("gonio convert a.binary a.bsdf");
    for line in [
        "table: R, G, B, isotropic",
        "errors of the table, cosine pairs",
        "reciprocity, ",
        "pairs without data: ",
    ] {
        assert!(told.contains(line), "{told}");
    }
    bench.refused(
        &["convert", "a.binary", "b.bin", "--tolerance", "1e-9", "-q"],
        6,
    );
    bench.refused(&["convert", "a.binary", "a.csv"], 2);
    bench.refused(&["convert", "a.binary", "a.bsdf", "c.binary"], 2);
    // Wavelengths of a table are those of its copy, or refused by one that has none.
    fs::write(
        bench.path("red.toml"),
        "[[material]]\nkind = \"lambert\"\nalbedo = { nm = [400, 700], values = [0.1, 0.7] }\n",
    )
    .unwrap();
    bench
        .shown("gonio tabulate red.toml --set channels={wavelengths_nm=[450,550,650]} -o red.bsdf");
    let told = bench.shown("gonio convert red.bsdf again.bsdf");
    assert!(told.starts_with("table: 450, 550, 650 nm"), "{told}");
    bench.refused(&["convert", "red.bsdf", "red.binary"], 2);
}

/// A copy of readings that do not say their symmetries does not say them either: what is made of it is the same. Keys of the
/// header that are lost are named.
#[test]
fn copies_of_bare_readings_are_reconstructed_alike() {
    let bench = Bench::new();
    let mut rows =
        "# operator = Kim\n# Tuesday\ntheta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n"
            .to_owned();
    for k in 0..90 {
        let (i, o, phi) = (2 + 7 * (k % 9), 1 + 9 * (k % 7), 40 * (k % 11) - 170);
        let value = 0.1 + 0.001 * f64::from(i + o);
        rows += &format!("{i},{},{o},{phi},{value}\n", 30 * (k % 5));
    }
    fs::write(bench.path("bare.csv"), rows).unwrap();
    let answer = |file: &str| {
        let text = bench.shown(&format!("gonio reconstruct {file}"));
        text.replace(file, "FILE")
    };
    let first = answer("bare.csv");
    assert!(first.contains("isotropic"), "{first}");
    for copy in ["copy.csv", "copy.jsonl", "copy.npz"] {
        let said = bench.shown(&format!("gonio convert bare.csv {copy}"));
        assert!(said.contains("left out of the header: operator"), "{said}");
        assert_eq!(answer(copy), first, "{copy}");
    }
}
