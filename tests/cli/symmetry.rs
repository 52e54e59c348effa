//! Symmetries of materials.

use super::Bench;
use super::common::says;
use std::fs;

#[test]
fn a_material_is_told_its_symmetries_and_what_they_save() {
    let bench = Bench::new();
    let said = bench.good("symmetry low-abc-smooth --set b=3000.0");
    says(&said, "favours h_bar: ");
    says(&said, "alignment q = 1.00");
    for law in ["isotropic", "reciprocal", "bilateral"] {
        let line = said
            .lines()
            .find(|l| l.trim_start().starts_with(law))
            .unwrap();
        let cells: Vec<_> = line.split_whitespace().collect();
        assert_eq!((cells[1], cells[7]), ("yes", "yes"), "{said}");
    }
    says(&said, "3-D, 1/4: delta_phi 360° to 180°, theta_i ≥ theta_o");
    assert_eq!(
        said.matches("3-D, 1/4").count(),
        gonio::parametrization::all().len()
    );

    bench.tells(
        "symmetry ward --set 'alpha=[0.1, 0.3]'",
        "4-D, 1/8: phi_h 360° to 90°, phi_d 360° to 180°",
    );
    let diffuse = bench.good("symmetry small.toml --material lambert");
    says(&diffuse, "no lobe");
    let all = bench.good("symmetry small.toml");
    assert!(all.starts_with(&diffuse), "{all}");
    let threads = bench.good("symmetry small.toml --threads 1");
    assert_eq!(all, threads);
}

#[test]
fn a_table_is_read_by_its_extension_and_written_in_its_format() {
    let bench = Bench::new();
    bench.write(
        "cloth.toml",
        "budgets = [60]\n[[material]]\nkind = \"ward\"\nalpha = [0.2, 0.4]\n\
         [[parametrization]]\nkind = \"spherical\"\n[[sample_set]]\nkind = \"grid\"\n\
         [[reconstruction]]\nkind = \"nearest\"\n",
    );
    let tabulate = [
        "tabulate",
        "cloth.toml",
        "--format",
        "utia",
        "-o",
        "cloth.bin",
    ];
    bench.good(tabulate);
    assert_eq!(
        fs::metadata(bench.path("cloth.bin")).unwrap().len(),
        1_990_656
    );
    bench.refuses(tabulate, 2, "--force");
    // A MERL table has no axis for the turn of the sample.
    let merl = ["tabulate", "cloth.toml", "-o", "cloth.binary"];
    bench.refuses(merl, 2, "not isotropic");
    let said = bench.good("symmetry cloth.bin");
    says(&said, "favours spherical table: ");
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
    bench.write(
        "wrong.toml",
        "experiment = \"moments\"\n[[material]]\nkind = \"ward\"\nalpha = [0.2, 0.25]\n\
         symmetry = { isotropic = true }\n",
    );
    bench.refuses("symmetry wrong.toml", 6, "is declared isotropic");
    bench.good("symmetry wrong.toml --tolerance 1");
    for bad in ["0", "2", "NaN"] {
        bench.refuses(format!("symmetry ggx --tolerance {bad}"), 2, "--tolerance");
    }
    bench.refuses("symmetry shiny", 2, "ggx");
    bench.write("short.bin", "");
    bench.refuses("symmetry short.bin", 3, "expected 1990656");
}
