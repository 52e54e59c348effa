//! Moments of materials without a run, and as quantities of an acquisition.

use super::Bench;
use super::common::{says, table};
use gonio::experiment::Row;
use gonio::moments::Component;
use serde_json::Value;

/// Few views, low order, an estimator that is content early.
const QUICK: &str = "--set moments.views=3 --set moments.order=2 --set moments.estimator={kind=\"peak-resolving\",tolerance=1e-2}";

const TWO: &str = r#"
experiment = "moments"

[moments]
channels = ["red", "blue"]
views = 3
order = 3
estimator = { kind = "peak-resolving", tolerance = 1e-2 }

[[material]]
kind = "lambert"
albedo = [0.2, 0.3, 0.4]

[[material]]
kind = "ggx"
name = "half/shiny"
alpha = 0.4
"#;

/// A table and an array of objects say the same; its rows.
fn same(csv: &str, json: &str) -> Vec<serde_json::Map<String, Value>> {
    let objects: Vec<serde_json::Map<String, Value>> = serde_json::from_str(json).unwrap();
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let header: Vec<_> = reader.headers().unwrap().iter().map(String::from).collect();
    assert_eq!(header, gonio::report::profile_columns());
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), objects.len());
    for (row, object) in rows.iter().zip(&objects) {
        assert_eq!(object.keys().cloned().collect::<Vec<_>>(), header);
        for (cell, value) in row.iter().zip(object.values()) {
            match value {
                Value::String(text) => assert_eq!(cell, text),
                Value::Number(number) => assert_eq!(cell.parse().ok(), number.as_f64()),
                Value::Null => assert!(cell.is_empty() || cell == "inf", "{cell}"),
                other => panic!("{other}"),
            }
        }
    }
    objects
}

fn number(row: &serde_json::Map<String, Value>, key: &str) -> f64 {
    row[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key}: {row:?}"))
}

#[test]
fn a_kind_of_material_has_moments() {
    let bench = Bench::new();
    let ggx = format!("moments ggx --set alpha=0.4 {QUICK}");
    let csv = bench.good(&ggx);
    let json = bench.good(format!("{ggx} --format json"));
    let rows = same(&csv, &json);
    let views: Vec<_> = rows.iter().map(|r| number(r, "theta_o_deg")).collect();
    assert_eq!(views, [0.0, 44.5, 89.0]);
    for row in &rows {
        assert_eq!(row["material"], "ggx-0.4");
        assert_eq!(row["channel"], "luminance");
        for component in Component::ALL {
            // No number where none was asked for.
            let there = !row[&component.to_string()].is_null();
            assert_eq!(there, component.order() <= 2, "{component}");
        }
        assert!(row["unresolved"].is_null());
        assert!(number(row, "evaluations") > 0.0);
    }
    // The lobe leans towards the mirror direction.
    assert!(number(&rows[0], "mean_10").abs() < 1e-9);
    assert!(number(&rows[1], "mean_10") < -0.3);

    // Uniform in (θ, φ), whose square has the variance π²/12.
    let lambert = format!("moments lambert --format json {QUICK}");
    let rows: Vec<serde_json::Map<String, Value>> =
        serde_json::from_str(&bench.good(&lambert)).unwrap();
    for row in &rows {
        let variance = std::f64::consts::PI.powi(2) / 12.0;
        assert!((number(row, "covariance_20") - variance).abs() < 1e-9);
        assert!((number(row, "energy") - 0.5 * std::f64::consts::PI).abs() < 1e-9);
    }
}

#[test]
fn a_table_and_materials_of_configs_have_moments() {
    let bench = Bench::new();
    bench.write("two.toml", TWO);
    let material = "--material ggx-0.4 -o table.binary";
    bench.good(format!("tabulate small.toml {material}"));
    let rows = |args: &str| {
        let csv = bench.good(format!("moments {args}"));
        let json = bench.good(format!("moments {args} --format json"));
        same(&csv, &json)
    };
    let table = rows(&format!("table.binary {QUICK}"));
    // A config of an acquisition has the same material.
    let model = rows(&format!("small.toml --material ggx-0.4 {QUICK}"));
    assert!(table.iter().all(|r| r["material"] == "table"));
    assert!(model.iter().all(|r| r["material"] == "ggx-0.4"));
    for (table, model) in table.iter().zip(&model).take(2) {
        for component in ["energy", "mean_10", "covariance_20", "covariance_02"] {
            let error = number(table, component) - number(model, component);
            assert!(error.abs() < 1e-2, "{component}: {error}");
        }
    }
    let all = rows("two.toml");
    let order: Vec<_> = all
        .iter()
        .map(|r| format!("{} {}", r["material"], r["channel"]))
        .step_by(3)
        .collect();
    let names = [
        "\"lambert\" \"red\"",
        "\"lambert\" \"blue\"",
        "\"half/shiny\" \"red\"",
        "\"half/shiny\" \"blue\"",
    ];
    assert_eq!(order, names);
    let one = rows("two.toml --material half/shiny");
    assert!(one[..] == all[6..]);
}

#[test]
fn moments_go_to_a_folder() {
    let bench = Bench::new();
    bench.write("two.toml", TWO);
    let args = "moments two.toml -o deep/out";
    // Who writes files prints nothing.
    assert_eq!(bench.good(args), "");
    let mut names = vec!["config.toml", "profiles.csv", "profiles.json"];
    names.splice(1..1, ["half%2Fshiny.svg", "lambert.svg"]);
    assert_eq!(bench.files("deep/out"), names);
    let csv = bench.read("deep/out/profiles.csv");
    same(&csv, &bench.read("deep/out/profiles.json"));
    assert_eq!(csv, bench.good("moments two.toml"));
    for name in ["lambert", "half%2Fshiny"] {
        let svg = bench.read(&format!("deep/out/{name}.svg"));
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("red") && svg.contains("blue") && !svg.contains("NaN"));
    }

    bench.write("deep/out/profiles.csv", "mine");
    let refusal = bench.refused(args, 2);
    says(&refusal, "profiles.csv … --force");
    assert_eq!(bench.read("deep/out/profiles.csv"), "mine");
    bench.good(format!("{args} --force"));
    assert_eq!(bench.read("deep/out/profiles.csv"), csv);
    assert_eq!(bench.files("deep/out"), names);

    bench.write("file", "mine");
    for folder in ["file", "file/below"] {
        let refusal = bench.refused(format!("moments two.toml -o {folder}"), 2);
        assert!(
            refusal.starts_with(&format!("gonio: {folder}: ")),
            "{refusal}"
        );
    }
    assert_eq!(bench.read("file"), "mine");
}

#[test]
fn moments_that_cannot_be_are_refused_in_a_sentence() {
    let bench = Bench::new();
    bench.write("two.toml", TWO);
    bench.write("tiny.binary", [1, 2]);
    // Right in size and head, and without a single value.
    let mut empty: Vec<u8> = [90u32, 90, 180]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    let holes = std::iter::repeat_n((-1f64).to_le_bytes(), 3 * 90 * 90 * 180);
    empty.extend(holes.flatten());
    bench.write("empty.binary", empty);
    bench.refuses_all(
        r#"
        2 | moments shiny -o out | shiny … *.toml … *.binary … lambert, 
        2 | moments gone.toml -o out | gone.toml
        3 | moments gone.binary -o out | gone.binary … No such file
        3 | moments tiny.binary -o out | tiny.binary … 2 bytes
        3 | moments empty.binary -o out | gonio: empty.binary: every cell
        2 | moments two.toml --material gold -o out | --material … gold … allowed: lambert, half/shiny"#,
    );
    for [set, parts] in table(
        r#"
        moments.views=0 | moments.views = 0 … allowed is
        moments.views=1000000 | moments.views = 1000000 … allowed is
        moments.max_view_deg=90 | moments.max_view_deg = 90 … (0, 90)
        moments.max_view_deg=-1 | moments.max_view_deg = -1 … allowed is
        moments.max_view_deg=nan | moments.max_view_deg = NaN … allowed is
        moments.order=5 | order = 5 … [0, 4]
        moments.channels=[] | moments.channels = [] … average
        moments.channels=["red","red"] | moments.channels = [red, red] … each once
        moments.channels=["pink"] | moments.channels[0] = "pink" … average
        moments.split=half | moments.split = "half" … minimum
        moments.estimator={kind="magic"} | kind = "magic" … peak-resolving
        moments.estimator={tolerance=0.2} | moments.estimator.tolerance = 0.2 … (0, 0.1]
        moments.estimator={kind="peak-resolving",tolerance=0} | moments.estimator.tolerance = 0 … (0, 0.1]
        moments.estimator={kind="peak-resolving",max_evaluations=1} | moments.estimator.max_evaluations = 1 … at least
        moments.estimator={kind="monte-carlo",samples=1000} | moments.estimator.samples = 1000 … multiple of 32
        moments.estimator={kind="sobol",samples=96} | moments.estimator.samples = 96 … power of two
        moments.vistas=3 | moments.vistas … views
        alpha=0 | alpha = 0 … allowed is
        seeds=[1, 2] | seeds = [1, 2] … one seed"#,
    ) {
        bench.refuses(format!("moments ggx -o out --set '{set}'"), 2, parts);
    }
    bench.ends("moments ggx -o out --format json", 2);
    assert!(!bench.path("out").exists());
}

#[test]
fn slices_that_are_not_resolved_are_told() {
    let bench = Bench::new();
    let args = "moments ggx --set alpha=0.001 --set moments.views=5 --set moments.estimator={kind=\"monte-carlo\",samples=1024}";
    let output = bench.gonio(args);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    // Some of them, then their number.
    assert_eq!(stderr.lines().count(), 3 + 1, "{stderr}");
    says(
        &stderr,
        "ggx-0.001 luminance at 0.000°: no sample near the mirror direction",
    );
    says(&stderr, "5 of 5 slices are unresolved");
    let stdout = String::from_utf8(output.stdout).unwrap();
    let column = stdout.matches(",no sample near the mirror direction\n");
    assert_eq!(column.count(), 5);
}

/// The columns of moments of a row.
fn moments(row: &Row) -> [Option<f64>; 6] {
    [
        "moment_energy",
        "moment_mean_rad",
        "moment_mean",
        "moment_covariance",
        "moment_skewness",
        "moment_kurtosis",
    ]
    .map(|name| row.value(name))
}

#[test]
fn acquisitions_compare_moments_if_asked() {
    let bench = Bench::new();
    let one = "--set budgets=[60] --set seeds=[1]";
    let small = format!("run small.toml -q {one}");
    let albedo = "--set quantities=[\"albedo\"]";
    let asked = format!(
        "{small} --set 'quantities=[\"albedo\", \"moments\"]' {QUICK} --set moments.order=4 --set moments.views=2"
    );
    bench.good(format!("{small} {albedo} -o without"));
    let rows = bench.rows("without");
    assert!(rows.iter().all(|r| moments(r) == [None; 6]));
    assert!(
        rows.iter()
            .all(|r| r.value("moment_unresolved").is_none() && r.moment_seconds.is_none())
    );

    bench.good(format!("{asked} -o one"));
    assert!(!bench.read("one/results.csv").contains("NaN"));
    for row in bench.rows("one") {
        assert!(row.value("moment_unresolved").is_some() && row.moment_seconds.is_some());
        for error in moments(&row) {
            let error = error.unwrap_or_else(|| panic!("{row:?}"));
            // Constant is what every method reproduces.
            match row.material.as_str() {
                "lambert" => assert!(error.abs() < 1e-6, "{row:?}"),
                _ => assert!(error > 1e-4, "{row:?}"),
            }
        }
    }
    // It is the same for every measure, and changes nothing else.
    for pair in bench.rows("one").chunks(2) {
        assert_eq!(moments(&pair[0]), moments(&pair[1]));
    }
    for (with, without) in bench.rows("one").iter().zip(&rows) {
        for name in ["nrmse", "max_relative", "albedo"] {
            assert_eq!(with.value(name), without.value(name), "{name}");
        }
    }
    // Quantities that are not asked for are not there.
    let only = format!("{asked} --set quantities=[\"moments\"] -o only");
    bench.good(&only);
    for (only, both) in bench.rows("only").iter().zip(&bench.rows("one")) {
        assert_eq!(only.value("albedo"), None);
        assert_eq!(moments(only), moments(both));
    }
}

#[test]
fn moments_of_acquisitions_are_checked() {
    let bench = Bench::new();
    for [sets, parts] in table(
        r#"
        moments.views=3 | quantities = ["moments"]
        quantities=["colour"] | quantities[0] … moments
        quantities=["moments"] --set moments.views=0 | moments.views = 0
        quantities=["moments"] --set moments.channels=["red"] | moments.channels … channels = "rgb"
        quantities=["moments"] --set channels=rgb --set moments.channels=["red","blue"] | moments.channels … 2 channels"#,
    ) {
        bench.refuses(format!("run small.toml -o out --set {sets}"), 2, parts);
    }
    assert!(!bench.path("out").exists());
}
