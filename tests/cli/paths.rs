//! `gonio paths`, and what `gonio subset` says of facets.

use super::Bench;
use super::common::{Level, levels};
use serde_json::Value;

const FEW: [&str; 6] = [
    "paths",
    "smith-multiple",
    "--set",
    "paths=2",
    "--paths",
    "20000",
];

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
    let rough = ["--set", "alpha=0.5"];
    let said = bench.good(&[&FEW[..], &rough, &["-o", "maps.svg"]].concat());
    for part in [
        "first 7",
        "half-difference  theta_",
        "--box",
        "Ranges that hold 95 %",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let drawn = bench.read("maps.svg");
    let charts = gonio::parametrization::all();
    assert!(drawn.starts_with("<svg"));
    // A raster for all azimuths and each of four.
    assert_eq!(drawn.matches("<image").count(), 5 * charts.len());
    let again = [&FEW[..], &["-o", "maps.svg"]].concat();
    assert!(bench.refused(&again, 2).contains("--force"));
    assert_eq!(bench.read("maps.svg"), drawn);

    let args = [
        &FEW[..],
        &rough,
        &["--json", "--bounce", "first", "--purity", "0.8"],
    ]
    .concat();
    let text = bench.good(&args);
    assert!(bench.good(&[&args[..], &["--threads", "1"]].concat()) == text);
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
    let args = [
        "subset",
        "--parametrization",
        "spherical",
        "--box",
        words,
        "--json",
        "--material",
        "smith-multiple",
        "--set",
        "paths=2",
    ];
    let again = json(&bench.good(&[&args[..], &rough].concat()));
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
    let args = |bounds: &'static str, material: &'static str| {
        [
            "subset",
            "--parametrization",
            "hybrid",
            "--box",
            bounds,
            "--material",
            material,
        ]
    };
    let few = ["--set", "paths=2", "--set", "alpha=0.8"];
    let said = bench.good(&[&args("h_bar=0..0.5", "smith-multiple")[..], &few].concat());
    assert!(said.contains("  facets met          first "), "{said}");
    assert!(said.contains("  of each number      first "), "{said}");
    if level == Level::Quick {
        return;
    }
    // The whole of the light is inside.
    let first = ["--set", "bounces=first"];
    let said = bench.good(&[&args("", "smith-multiple")[..], &few, &first].concat());
    assert!(
        said.contains("first 100 %, second 0 %, later 0 % of the light inside"),
        "{said}"
    );
    let said = bench.good(&args("h_bar=0..0.5", "lambert"));
    assert!(!said.contains("facets"), "{said}");
}

#[test]
fn paths_refuse_what_they_cannot_use() {
    let bench = Bench::new();
    let refused = |args: &[&str], parts: &[&str]| {
        let sentence = bench.refused(&[&["paths"], args].concat(), 2);
        assert!(
            parts.iter().all(|part| sentence.contains(part)),
            "{sentence}"
        );
    };
    refused(
        &["lambert"],
        &["lambert", "number of facets", "smith-multiple"],
    );
    refused(&["small.toml"], &["--material", "lambert, ggx-0.4"]);
    let black = ["--set", "facets.kind=diffuse", "--set", "facets.albedo=0"];
    refused(
        &[&["smith-multiple"], &black[..]].concat(),
        &["no light leaves", "allowed"],
    );
    for (option, value, part) in [
        ("--purity", "0", "(0, 1]"),
        ("--purity", "nine", "(0, 1]"),
        ("--paths", "1000", "1024"),
        ("--bounce", "third", "second"),
    ] {
        let output = bench.gonio(&["paths", "smith-multiple", option, value]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
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
    let more_paths = [
        "--set",
        "material.0.paths=128",
        "--set",
        "pictures.draw=false",
        "-o",
        "more",
    ];
    bench.good(&["run", "c.toml", "-q"]);
    bench.good(&[&["run", "c.toml", "-q"], &more_paths[..]].concat());
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
    let of_box = [
        "subset",
        "--parametrization",
        "hybrid",
        "--box",
        "h_bar=0..0.2",
    ];
    for command in [&FEW[..], &of_box] {
        let to = |file| [command, &["-o", file]].concat();
        let told = bench.refused(&to("maps.png"), 2);
        assert!(
            told.contains("maps.png: this picture is SVG; allowed: a name that ends in .svg"),
            "{told}"
        );
        let told = bench.refused(&to("none/maps.svg"), 2);
        assert!(
            told.contains("none/maps.svg: there is no folder none"),
            "{told}"
        );
    }
    let maps = [&FEW[..], &["-o", "maps.SVG"]].concat();
    bench.good(&maps);
    bench.good(&[&maps[..], &["--force"]].concat());
}

/// Light of 45° grooves that met two facets comes back along the groove mirrored and across it reversed; that of one met it at 45°,
/// the edge of cells and the end of boxes.
#[test]
fn light_of_two_sides_of_a_groove_has_a_box_to_itself() {
    let bench = Bench::new();
    for fresnel in ["schlick", "none"] {
        let fresnel = format!("facets.fresnel.kind={fresnel}");
        let args = [
            "paths",
            "micro-surface",
            "--set",
            "surface.kind=v-grooves",
            "--set",
            "facets.kind=mirror",
            "--set",
            &fresnel,
            "--paths",
            "65536",
            "--json",
        ];
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
    let said = bench.good(&[&FEW[..], &["--set", "bounces=second"]].concat());
    assert!(
        said.contains("second 100 %") && said.contains("All of it met two facets"),
        "{said}"
    );
    assert!(!said.contains("--box"), "{said}");
}
