//! Symmetries of materials.

use super::Bench;

/// The two verdicts on a symmetry: of the material, and of its coordinates.
fn cells(said: &str, law: &str) -> [String; 2] {
    let line = said.lines().find(|l| l.trim_start().starts_with(law));
    let cells: Vec<_> = line.unwrap().split_whitespace().collect();
    [cells[1], cells[7]].map(String::from)
}

#[test]
fn a_material_is_told_its_symmetries_and_what_they_save() {
    let bench = Bench::new();
    let told = "favours h_bar:  … alignment q = 1.00 … 3-D, 1/4: delta_phi 360° to 180°, theta_i ≥ theta_o";
    let said = bench.tells("symmetry low-abc-smooth --set b=3000.0", told);
    for law in ["isotropic", "reciprocal", "bilateral"] {
        assert_eq!(cells(&said, law), ["yes", "yes"], "{said}");
    }
    let all = gonio::parametrization::all().len();
    assert_eq!(said.matches("3-D, 1/4").count(), all);

    let told = "4-D, 1/8: phi_h 360° to 90°, phi_d 360° to 180°";
    bench.tells("symmetry ward --set 'alpha=[0.1, 0.3]'", told);
    let diffuse = bench.tells("symmetry small.toml --material lambert", "no lobe");
    let all = bench.good("symmetry small.toml");
    assert!(all.starts_with(&diffuse), "{all}");
    let threads = bench.good("symmetry small.toml --threads 1");
    assert_eq!(all, threads);
}

#[test]
fn a_table_is_read_by_its_extension_and_written_in_its_format() {
    let bench = Bench::new();
    bench.good("tabulate ward --set alpha=[0.2,0.4] --format utia -o cloth.bin");
    assert_eq!(bench.read_bytes("cloth.bin").len(), 1_990_656);
    let said = bench.tells("symmetry cloth.bin", "favours spherical table: ");
    for (law, verdicts) in [
        ("isotropic", ["no", "no"]),
        ("reciprocal", ["no", "yes"]),
        ("bilateral", ["no", "yes"]),
    ] {
        assert_eq!(cells(&said, law), verdicts, "{said}");
    }
}

#[test]
fn a_declared_symmetry_that_does_not_hold_is_a_violation() {
    let bench = Bench::new();
    let keys = "kind = \"ward\", alpha = [0.2, 0.25], symmetry = { isotropic = true }";
    let wrong = format!("experiment = \"moments\"\nmaterial = [{{ {keys} }}]\n");
    bench.write("wrong.toml", wrong);
    bench.write("short.bin", "");
    bench.does(
        "6 | symmetry wrong.toml | is declared isotropic
         0 | symmetry wrong.toml --tolerance 1
         2 | symmetry ggx --tolerance 0 | --tolerance
         2 | symmetry ggx --tolerance 2 | --tolerance
         2 | symmetry ggx --tolerance NaN | --tolerance
         2 | symmetry shiny | ggx
         3 | symmetry short.bin | expected 1990656",
    );
}
