//! `gonio paths`, and what `gonio subset` says of facets.

use super::Bench;
use super::common::{Level, levels, says};
use serde_json::Value;

const FEW: &str = "paths smith-multiple --set paths=2 --paths 20000";

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// A value and its error.
fn known(estimate: &Value) -> [f64; 2] {
    ["value", "error"].map(|key| estimate[key].as_f64().unwrap())
}

levels! {
    paths_are_told_and_drawn: "thorough: the box that is found, as `subset` counts it";
}

fn paths_are_told_and_drawn(level: Level) {
    let bench = Bench::new();
    let rough = "--set alpha=0.5";
    let said = bench.good(format!("{FEW} {rough} -o maps.svg"));
    says(
        &said,
        "first 7 … half-difference  theta_ … --box … Ranges that hold 95 %",
    );
    let drawn = bench.read("maps.svg");
    let charts = gonio::parametrization::all();
    assert!(drawn.starts_with("<svg"));
    // A raster for all azimuths and each of four.
    assert_eq!(drawn.matches("<image").count(), 5 * charts.len());
    let again = format!("{FEW} -o maps.svg");
    bench.refuses(&again, 2, "--force");
    assert_eq!(bench.read("maps.svg"), drawn);

    let args = format!("{FEW} {rough} --json --bounce first --purity 0.8");
    let text = bench.good(&args);
    assert!(bench.good(format!("{args} --threads 1")) == text);
    let told = json(&text);
    let shares = ["first", "second", "later"].map(|class| known(&told["shares"][class])[0]);
    assert!(
        (shares.iter().sum::<f64>() - 1.0).abs() < 1e-12,
        "{shares:?}"
    );
    assert_eq!(
        told["parametrizations"].as_object().unwrap().len(),
        charts.len()
    );
    assert_eq!([&told["box_of"], &told["errors"]], ["first", "paths"]);
    for chart in charts {
        let told = &told["parametrizations"][chart.kind];
        assert_eq!(told["information"].as_array().unwrap().len(), 3 + 3 + 1);
        let maps = told["maps"].as_array().unwrap();
        let light = maps[0]["light"].as_array().unwrap().iter();
        let light = light.flat_map(|row| row.as_array().unwrap());
        let all: f64 = light.map(|cell| cell.as_f64().unwrap()).sum();
        assert!((all - 1.0).abs() < 1e-3 && maps.len() == 5, "{all}");
    }
    if level == Level::Quick {
        return;
    }
    // The box is what `subset` says that it is, with both orders of light and sensor in it.
    let found = &told["parametrizations"]["spherical"]["box"];
    let words = found["box"].as_str().unwrap();
    let found = &found["classes"]["first"];
    let args = format!(
        "subset --parametrization spherical --box '{words}' --json --material smith-multiple --set paths=2"
    );
    let again = json(&bench.good(format!("{args} {rough}")));
    for key in ["share_inside", "captured"] {
        let [a, b] = [
            known(&found[key]),
            known(&again["bounces"]["classes"]["first"][key]),
        ];
        assert!(
            (a[0] - b[0]).abs() < 5.0 * a[1].hypot(b[1]),
            "{key}: {a:?} {b:?}"
        );
    }
    assert!(known(&found["share_inside"])[0] > 0.75, "{found}");
}

levels! {
    subset_tells_the_facets_that_light_met: "thorough: a box of everything, and one of light that meets no facets";
}

fn subset_tells_the_facets_that_light_met(level: Level) {
    let bench = Bench::new();
    let of = "subset --parametrization hybrid --box";
    let few = "--material smith-multiple --set paths=2 --set alpha=0.8";
    bench.tells(
        format!("{of} h_bar=0..0.5 {few}"),
        "  facets met          first  …   of each number      first ",
    );
    if level == Level::Quick {
        return;
    }
    // The whole of the light is inside.
    bench.tells(
        format!("{of} '' {few} --set bounces=first"),
        "first 100 %, second 0 %, later 0 % of the light inside",
    );
    let said = bench.good(format!("{of} h_bar=0..0.5 --material lambert"));
    assert!(!said.contains("facets"), "{said}");
}

#[test]
fn paths_refuse_what_they_cannot_use() {
    let bench = Bench::new();
    bench.refuses_all(
        "2 | paths lambert | lambert … number of facets … smith-multiple
         2 | paths small.toml | --material … lambert, ggx-0.4
         2 | paths smith-multiple --set facets.kind=diffuse --set facets.albedo=0 | no light leaves … allowed",
    );
    for (option, value, part) in [
        ("--purity", "0", "(0, 1]"),
        ("--purity", "nine", "(0, 1]"),
        ("--paths", "1000", "1024"),
        ("--bounce", "third", "second"),
    ] {
        let stderr = bench.ends(format!("paths smith-multiple {option} {value}"), 2);
        assert!(stderr.contains(option) && stderr.contains(part), "{stderr}");
    }
}

/// Of a truth from random paths rows say what it may be off by, and reports where its light is; of others neither.
#[test]
fn studies_tell_of_light_paths_and_of_their_errors() {
    let bench = Bench::new();
    let config = r#"
experiment = "study"
budgets = [60]

[[material]]
kind = "smith-multiple"
alpha = 0.5
paths = 8

[[material]]
kind = "ggx"
alpha = 0.5

[[parametrization]]
kind = "half-difference"

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "cubic"

[metrics]
pairs = 400
max_pairs = 1

[pictures]
resolution = 24
samples = 4
budget = 60
"#;
    std::fs::write(bench.path("c.toml"), config).unwrap();
    let more_paths = "--set material.0.paths=128 --set pictures.draw=false -o more";
    bench.good("run c.toml -q");
    bench.good(format!("run c.toml -q {more_paths}"));
    let errors = |run: &str, material: &str| -> Vec<Option<f64>> {
        let rows = bench.rows(run);
        let of = rows.iter().filter(|row| row.material.starts_with(material));
        let names = ["truth_nrmse", "truth_log_relative"];
        of.flat_map(|row| names.map(|name| row.quantities.get(name)))
            .collect()
    };
    let [few, many] = ["runs/c", "more"].map(|run| errors(run, "smith"));
    assert!(!few.is_empty() && few.len() == many.len());
    for (few, many) in few.into_iter().zip(many) {
        // Sixteen times the paths: a quarter.
        let ratio = few.unwrap() / many.unwrap();
        assert!((3.0..5.0).contains(&ratio), "{few:?} {many:?}");
    }
    assert!(errors("runs/c", "ggx").iter().all(Option::is_none));
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
        let to = |file| format!("{command} -o {file}");
        bench.refuses(
            to("maps.png"),
            2,
            "maps.png: this picture is SVG; allowed: a name that ends in .svg",
        );
        bench.refuses(
            to("none/maps.svg"),
            2,
            "none/maps.svg: there is no folder none",
        );
    }
    let maps = format!("{FEW} -o maps.SVG");
    bench.good(&maps);
    bench.good(format!("{maps} --force"));
}

/// Light of 45° grooves that met two facets comes back along the groove mirrored and across it reversed; that of one met it at 45°,
/// the edge of cells and the end of boxes.
#[test]
fn light_of_two_sides_of_a_groove_has_a_box_to_itself() {
    let bench = Bench::new();
    for fresnel in ["schlick", "none"] {
        let fresnel = format!("facets.fresnel.kind={fresnel}");
        let args = format!(
            "paths micro-surface --set surface.kind=v-grooves --set facets.kind=mirror --set '{fresnel}' --paths 65536 --json"
        );
        let told = json(&bench.good(&args));
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
    let said = bench.good(format!("{FEW} --set bounces=second"));
    says(&said, "second 100 % … All of it met two facets");
    assert!(!said.contains("--box"), "{said}");
}
