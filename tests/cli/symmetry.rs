//! Symmetries of materials.

use super::Bench;
use std::fs;

#[test]
fn a_material_is_told_its_symmetries_and_what_they_save() {
    let bench = Bench::new();
    let said = bench.good(&["symmetry", "low-abc-smooth", "--set", "b=3000.0"]);
    assert!(said.contains("favours h_bar: "), "{said}");
    assert!(said.contains("alignment q = 1.00"), "{said}");
    for law in ["isotropic", "reciprocal", "bilateral"] {
        let line = said
            .lines()
            .find(|l| l.trim_start().starts_with(law))
            .unwrap();
        let cells: Vec<_> = line.split_whitespace().collect();
        assert_eq!((cells[1], cells[7]), ("yes", "yes"), "{said}");
    }
    assert!(
        said.contains("3-D, 1/4: delta_phi 360° to 180°, theta_i ≥ theta_o"),
        "{said}"
    );
    assert_eq!(
        said.matches("3-D, 1/4").count(),
        gonio::parametrization::all().len()
    );

    let said = bench.good(&["symmetry", "ward", "--set", "alpha=[0.1, 0.3]"]);
    assert!(
        said.contains("4-D, 1/8: phi_h 360° to 90°, phi_d 360° to 180°"),
        "{said}"
    );
    let diffuse = bench.good(&["symmetry", "small.toml", "--material", "lambert"]);
    assert!(diffuse.contains("no lobe"), "{diffuse}");
    let all = bench.good(&["symmetry", "small.toml"]);
    assert!(all.starts_with(&diffuse), "{all}");
    let threads = bench.good(&["symmetry", "small.toml", "--threads", "1"]);
    assert_eq!(all, threads);
}

#[test]
fn a_table_is_read_by_its_extension_and_written_in_its_format() {
    let bench = Bench::new();
    fs::write(
        bench.path("cloth.toml"),
        "budgets = [60]\n[[material]]\nkind = \"ward\"\nalpha = [0.2, 0.4]\n\
         [[parametrization]]\nkind = \"spherical\"\n[[sample_set]]\nkind = \"grid\"\n\
         [[reconstruction]]\nkind = \"nearest\"\n",
    )
    .unwrap();
    let tabulate = [
        "tabulate",
        "cloth.toml",
        "--format",
        "utia",
        "-o",
        "cloth.bin",
    ];
    bench.good(&tabulate);
    assert_eq!(
        fs::metadata(bench.path("cloth.bin")).unwrap().len(),
        1_990_656
    );
    assert!(bench.refused(&tabulate, 2).contains("--force"));
    // A MERL table has no axis for the turn of the sample.
    let merl = ["tabulate", "cloth.toml", "-o", "cloth.binary"];
    assert!(bench.refused(&merl, 2).contains("not isotropic"));
    let said = bench.good(&["symmetry", "cloth.bin"]);
    assert!(said.contains("favours spherical table: "), "{said}");
    let cells = |law: &str| {
        let line = said
            .lines()
            .find(|l| l.trim_start().starts_with(law))
            .unwrap();
        let cells: Vec<_> = line.split_whitespace().map(String::from).collect();
        (cells[1].clone(), cells[7].clone())
    };
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    assert_eq!(cells("isotropic"), pair("no", "no"));
    assert_eq!(cells("reciprocal"), pair("no", "yes"));
    assert_eq!(cells("bilateral"), pair("no", "yes"));
}

#[test]
fn a_declared_symmetry_that_does_not_hold_is_a_violation() {
    let bench = Bench::new();
    fs::write(
        bench.path("wrong.toml"),
        "experiment = \"moments\"\n[[material]]\nkind = \"ward\"\nalpha = [0.2, 0.25]\n\
         symmetry = { isotropic = true }\n",
    )
    .unwrap();
    let sentence = bench.refused(&["symmetry", "wrong.toml"], 6);
    assert!(sentence.contains("is declared isotropic"), "{sentence}");
    bench.good(&["symmetry", "wrong.toml", "--tolerance", "1"]);
    for bad in ["0", "2", "NaN"] {
        let sentence = bench.refused(&["symmetry", "ggx", "--tolerance", bad], 2);
        assert!(sentence.contains("--tolerance"), "{sentence}");
    }
    assert!(bench.refused(&["symmetry", "shiny"], 2).contains("ggx"));
    fs::write(bench.path("short.bin"), "").unwrap();
    let sentence = bench.refused(&["symmetry", "short.bin"], 3);
    assert!(sentence.contains("expected 1990656"), "{sentence}");
}
