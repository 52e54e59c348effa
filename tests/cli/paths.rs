//! `gonio paths`, and what `gonio subset` says of facets.

use super::Bench;
use super::common::{near, product, table};
use serde_json::Value;

const FEW: &str = "paths smith-multiple --set paths=2 --paths 20000";

/// A value and its error.
fn known(estimate: &Value) -> [f64; 2] {
    ["value", "error"].map(|key| estimate[key].as_f64().unwrap())
}

#[test]
fn paths_are_told_and_drawn() {
    let bench = Bench::new();
    let rough = "--set alpha=0.5";
    let parts = "first 7 … half-difference  theta_ … --box … Ranges that hold 95 %";
    bench.tells(format!("{FEW} {rough} -o maps.svg"), parts);
    let drawn = bench.read("maps.svg");
    let charts = gonio::parametrization::all();
    assert!(drawn.starts_with("<svg"));
    // A raster for all azimuths and each of four.
    assert_eq!(drawn.matches("<image").count(), 5 * charts.len());
    bench.refuses(format!("{FEW} -o maps.svg"), 2, "--force");
    assert_eq!(bench.read("maps.svg"), drawn);

    let args = format!("{FEW} {rough} --json --bounce first --purity 0.8");
    let text = bench.good(&args);
    assert!(bench.good(format!("{args} --threads 1")) == text);
    let told: Value = serde_json::from_str(&text).unwrap();
    let shares = ["first", "second", "later"].map(|class| known(&told["shares"][class])[0]);
    near(shares.iter().sum(), 1.0, 1e-12, shares);
    let of_charts = told["parametrizations"].as_object().unwrap();
    assert_eq!(of_charts.len(), charts.len());
    assert_eq!([&told["box_of"], &told["errors"]], ["first", "paths"]);
}

#[test]
fn subset_tells_the_facets_that_light_met() {
    let bench = Bench::new();
    let of = "subset --parametrization hybrid --box";
    let few = "--material smith-multiple --set paths=2 --set alpha=0.8";
    let told = "  facets met          first  …   of each number      first ";
    bench.tells(format!("{of} h_bar=0..0.5 {few}"), told);
    let said = bench.good(format!("{of} h_bar=0..0.5 --material lambert"));
    assert!(!said.contains("facets"), "{said}");
}

#[test]
fn paths_refuse_what_they_cannot_use() {
    let bench = Bench::new();
    bench.does(
        "2 | paths lambert | lambert … number of facets … smith-multiple
         2 | paths small.toml | --material … lambert, ggx-0.4
         2 | paths smith-multiple --set facets.kind=diffuse --set facets.albedo=0 | no light leaves … allowed",
    );
    for [option, value, part] in table(
        "--purity | 0 | (0, 1]
         --purity | nine | (0, 1]
         --paths | 1000 | 1024
         --bounce | third | second",
    ) {
        let stderr = bench.ends(format!("paths smith-multiple {option} {value}"), 2);
        assert!(stderr.contains(option) && stderr.contains(part), "{stderr}");
    }
}

/// Of a truth from random paths rows say what it may be off by, and reports where its light is; of others neither.
#[test]
fn studies_tell_of_light_paths_and_of_their_errors() {
    let bench = Bench::of(
        r#"
experiment = "study"
budgets = [60]
material = [{ kind = "smith-multiple", alpha = 0.5, paths = 8 }, { kind = "ggx", alpha = 0.5 }]
parametrization = [{ kind = "half-difference" }]
sample_set = [{ kind = "grid" }]
reconstruction = [{ kind = "cubic" }]
metrics = { pairs = 400, max_pairs = 1 }
pictures = { resolution = 24, samples = 4, budget = 60 }
"#,
    );
    bench.good("run c.toml -q");
    for (row, name) in product(bench.rows("runs/c"), ["truth_nrmse", "truth_log_relative"]) {
        let error = row.quantities.get(name);
        assert_eq!(error.is_some(), row.material.starts_with("smith"), "{name}");
    }
    let pictures = bench.files("runs/c/pictures");
    let of_paths = pictures.iter().filter(|f| f.contains(".paths."));
    let of_paths: Vec<_> = of_paths.collect();
    assert!(of_paths.len() == 2 && of_paths.iter().all(|f| f.contains("smith")));
    let told = "Light by the number of facets that it met, of 131072 paths";
    assert_eq!(bench.read("runs/c/report.html").matches(told).count(), 2);
}

/// Before light is followed.
#[test]
fn pictures_have_a_name_and_a_folder() {
    let bench = Bench::new();
    for command in [FEW, "subset --parametrization hybrid --box h_bar=0..0.2"] {
        bench.does(&format!(
            "2 | {command} -o maps.png | maps.png: this picture is SVG; allowed: a name that ends in .svg
             2 | {command} -o none/maps.svg | none/maps.svg: there is no folder none"
        ));
    }
    bench.does(&format!(
        "0 | {FEW} -o maps.SVG
         0 | {FEW} -o maps.SVG --force"
    ));
}

/// Light of 45° grooves that met two facets comes back along the groove mirrored and across it reversed; that of one met it at 45°,
/// the edge of cells and the end of boxes.
#[test]
fn light_of_two_sides_of_a_groove_has_a_box_to_itself() {
    let bench = Bench::new();
    for fresnel in ["schlick", "none"] {
        let fresnel = format!("facets.fresnel.kind={fresnel}");
        let grooves = "micro-surface --set surface.kind=v-grooves --set facets.kind=mirror";
        let args = format!("--set '{fresnel}' --paths 65536 --json");
        let told = bench.json(format!("paths {grooves} {args}"));
        let best = &told["parametrizations"]["half-difference"]["box"];
        assert_eq!(best["pure"], true, "{best}");
        let [inside, captured] =
            ["share_inside", "captured"].map(|key| known(&best["classes"]["second"][key])[0]);
        assert!(inside > 0.9 && captured > 0.99, "{best}");
    }
}

#[test]
fn light_of_one_class_leaves_nothing_to_tell() {
    let bench = Bench::new();
    let told = "second 100 % … All of it met two facets";
    let said = bench.tells(format!("{FEW} --set bounces=second"), told);
    assert!(!said.contains("--box"), "{said}");
}
