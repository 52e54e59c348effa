//! Moments of materials without a run, and as quantities of an acquisition.

use super::common::{says, table};
use super::{Bench, READINGS, csv_rows, empty_merl};
use gonio::experiment::Row;
use gonio::moments::Component;
use serde_json::{Map, Value};

/// Few views, low order, an estimator that is content early.
const QUICK: &str = "--set moments.views=3 --set moments.order=2 --set moments.estimator={kind=\"peak-resolving\",tolerance=1e-2}";

const TWO: &str = r#"
experiment = "moments"
material = [
  { kind = "lambert", albedo = [0.2, 0.3, 0.4] },
  { kind = "ggx", name = "half/shiny", alpha = 0.4 },
]

[moments]
channels = ["red", "blue"]
views = 3
order = 3
estimator = { kind = "peak-resolving", tolerance = 1e-2 }
"#;

/// Rows by the names of their columns.
type Rows = Vec<Map<String, Value>>;

/// A table and an array of objects say the same; its rows.
fn same(csv: &str, json: &str) -> Rows {
    let objects: Rows = serde_json::from_str(json).unwrap();
    let rows = csv_rows(csv);
    let head = gonio::report::profiles_csv(&[]);
    assert!(rows[0].keys().eq(head.trim_end().split(',')));
    assert_eq!(rows.len(), objects.len());
    for (row, object) in rows.iter().zip(&objects) {
        assert!(object.keys().eq(row.keys()));
        for (cell, value) in row.values().zip(object.values()) {
            let cell = cell.as_str().unwrap();
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

/// The rows of `gonio moments`, which are those of both formats.
fn moments_of(bench: &Bench, args: &str) -> Rows {
    let csv = bench.good(format!("moments {args}"));
    let json = bench.good(format!("moments {args} --format json"));
    same(&csv, &json)
}

fn number(row: &Map<String, Value>, key: &str) -> f64 {
    let value = row[key].as_f64();
    value.unwrap_or_else(|| panic!("{key}: {row:?}"))
}

#[test]
fn a_table_and_materials_of_configs_have_moments() {
    let bench = Bench::new();
    bench.write("two.toml", TWO);
    bench.good("tabulate small.toml --material ggx-0.4 -o table.binary");
    let rows = |args: &str| moments_of(&bench, args);
    let table = rows(&format!("table.binary {QUICK}"));
    // A config of an acquisition has the same material.
    let model = rows(&format!("small.toml --material ggx-0.4 {QUICK}"));
    // So has a kind of material.
    assert!(model == rows(&format!("ggx --set alpha=0.4 {QUICK}")));
    assert!(table.iter().all(|r| r["material"] == "table"));
    let views: Vec<_> = model.iter().map(|r| number(r, "theta_o_deg")).collect();
    assert_eq!(views, [0.0, 44.5, 89.0]);
    for component in Component::ALL {
        // No number where none was asked for.
        let is_there = !model[0][&component.to_string()].is_null();
        assert_eq!(is_there, component.order() <= 2, "{component}");
    }
    for (table, model) in table.iter().zip(&model).take(2) {
        for component in ["energy", "mean_10", "covariance_20", "covariance_02"] {
            let error = number(table, component) - number(model, component);
            assert!(error.abs() < 1e-2, "{component}: {error}");
        }
    }
    let all = rows("two.toml");
    let name = |r: &Map<String, Value>| format!("{} {}", r["material"], r["channel"]);
    let order: Vec<_> = all.iter().map(name).step_by(3).collect();
    let names = r#""lambert" "red", "lambert" "blue", "half/shiny" "red", "half/shiny" "blue""#;
    assert_eq!(order.join(", "), names);
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
    let names = "config.toml half%2Fshiny.svg lambert.svg profiles.csv profiles.json";
    assert_eq!(bench.files("deep/out").join(" "), names);
    let csv = bench.read("deep/out/profiles.csv");
    same(&csv, &bench.read("deep/out/profiles.json"));
    assert_eq!(csv, bench.good("moments two.toml"));
    for name in ["lambert", "half%2Fshiny"] {
        let svg = bench.read(&format!("deep/out/{name}.svg"));
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("red") && svg.contains("blue") && !svg.contains("NaN"));
    }

    bench.write("deep/out/profiles.csv", "mine");
    bench.refuses(args, 2, "profiles.csv … --force");
    assert_eq!(bench.read("deep/out/profiles.csv"), "mine");
    bench.good(format!("{args} --force"));
    assert_eq!(bench.read("deep/out/profiles.csv"), csv);
    assert_eq!(bench.files("deep/out").join(" "), names);

    bench.write("file", "mine");
    bench.does(
        "2 | moments two.toml -o file | gonio: file:
         2 | moments two.toml -o file/below | gonio: file/below:",
    );
    assert_eq!(bench.read("file"), "mine");
}

#[test]
fn moments_that_cannot_be_are_refused_in_a_sentence() {
    let bench = Bench::new();
    bench.write("two.toml", TWO);
    bench.write("tiny.binary", [1, 2]);
    bench.write("empty.binary", empty_merl());
    bench.does(
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
        moments.max_view_deg=90 | moments.max_view_deg = 90 … (0, 90)
        moments.order=5 | order = 5 … [0, 4]
        moments.channels=[] | moments.channels = [] … average
        moments.channels=["red","red"] | moments.channels = [red, red] … each once
        moments.split=half | moments.split = "half" … minimum
        moments.estimator={kind="magic"} | kind = "magic" … peak-resolving
        moments.estimator={tolerance=0.2} | moments.estimator.tolerance = 0.2 … (0, 0.1]
        moments.estimator={kind="peak-resolving",max_evaluations=1} | moments.estimator.max_evaluations = 1 … at least
        moments.estimator={kind="monte-carlo",samples=1000} | moments.estimator.samples = 1000 … multiple of 32
        moments.estimator={kind="sobol",samples=96} | moments.estimator.samples = 96 … power of two
        moments.vistas=3 | moments.vistas … views
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
    let [stdout, stderr] = bench.ended(args, 0);
    // Some of them, then their number.
    assert_eq!(stderr.lines().count(), 3 + 1, "{stderr}");
    let told = "ggx-0.001 luminance at 0.000°: no sample near the mirror direction … 5 of 5 slices are unresolved";
    says(&stderr, told);
    let column = stdout.matches(",no sample near the mirror direction\n");
    assert_eq!(column.count(), 5);
}

/// The columns of moments of a row.
fn moments(row: &Row) -> [Option<f64>; 6] {
    let names = [
        "energy",
        "mean_deg",
        "mean",
        "covariance",
        "skewness",
        "kurtosis",
    ];
    names.map(|name| row.value(&format!("moment_{name}")))
}

#[test]
fn acquisitions_compare_moments_if_asked() {
    let bench = Bench::new();
    let small = "run small.toml -q --set budgets=[60] --set seeds=[1]";
    let size = format!("{QUICK} --set moments.order=4 --set moments.views=2");
    let asked = format!("{small} --set 'quantities=[\"albedo\", \"moments\"]' {size}");
    bench.good(format!("{small} --set quantities=[\"albedo\"] -o without"));
    let rows = bench.rows("without");
    assert!(rows.iter().all(|row| moments(row) == [None; 6]));
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

/// Moments of readings are as uncertain as these leave them, whatever their channels; those that they do not determine are left out.
#[test]
fn moments_of_readings_are_as_uncertain_as_these_leave_them() {
    let bench = Bench::new();
    bench.write(
        "plan.toml",
        "budgets = [40]\nmaterial = [{ kind = \"ggx\", alpha = 0.4 }]\nparametrization = [{ kind = \"half-difference\" }]\n\
         sample_set = [{ kind = \"sobol\" }]\nreconstruction = [{ kind = \"kriging\" }]\n",
    );
    bench.good("schedule plan.toml -o poses.csv");
    bench.good("measure poses.csv --config plan.toml -o exact.csv");
    // As noisy as the option says, in one channel and in two wavelengths.
    let exact = bench.read("exact.csv");
    let exact = exact.split_inclusive('\n').filter(|l| !l.starts_with('#'));
    let exact = csv_rows(&exact.collect::<String>());
    let file = |noise: f64, heads: &str| {
        let rows = exact.iter().map(|row| {
            let angle = |name: &str| row[name].as_str().unwrap().to_owned();
            let f: f64 = row["value"].as_str().unwrap().parse().unwrap();
            let angles = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"].map(angle);
            let scale = |head: &str| {
                if head.starts_with("type_a") {
                    noise
                } else {
                    1.0
                }
            };
            let values = heads.split(',').map(|head| (scale(head) * f).to_string());
            let values: Vec<String> = values.collect();
            format!("{},{}\n", angles.join(","), values.join(","))
        });
        READINGS.replace("value", heads) + &rows.collect::<String>()
    };
    bench.write("one.csv", file(0.01, "value,type_a"));
    bench.write("two.csv", file(0.0, "value_450nm,value_650nm"));
    bench.write("poor.csv", file(30.0, "value,type_a"));
    let options = format!("{QUICK} --set moments.max_view_deg=60");
    let truth = moments_of(&bench, &format!("ggx --set alpha=0.4 {options}"));
    let of_energy = |rows: &Rows| -> Vec<[f64; 2]> {
        let both = |row| ["energy", "energy_uncertainty"].map(|key| number(row, key));
        rows.iter().map(both).collect()
    };
    let [one, two] =
        ["one", "two"].map(|file| moments_of(&bench, &format!("{file}.csv {options}")));
    let [truth, one, two] = [truth, one, two].map(|rows| of_energy(&rows));
    let known = truth.into_iter().zip(one).zip(two);
    for (([f, exact], [g, noisy]), [h, between]) in known {
        // Noise of 1 % is most of what is not known of 40 readings of a wide lobe.
        let rising = [exact, between, noisy, 0.05 * f];
        assert!(rising.is_sorted_by(|a, b| a < b), "{rising:?}");
        assert!((g - f).abs() < 3.0 * noisy && (h - f).abs() < 3.0 * between.max(noisy));
    }
    let said = bench.ends(format!("moments poor.csv {options}"), 0);
    let told = "moments are left out: not defined, or not determined by the readings";
    says(&said, told);
}
