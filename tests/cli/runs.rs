//! Runs: what they leave, what they depend on, what they replace, how they end.

use super::common::says;
use super::{Bench, SMALL, assert_same, csv_rows, empty_merl, finished, results, send};
use gonio::experiment::{Plan, Row, Source};
use gonio::report::RunFolder;
use serde_json::{Value, json};
use std::fs;
use std::time::{Duration, Instant};

#[test]
fn a_run_leaves_its_results_and_how_to_repeat_them() {
    let bench = Bench::new();
    let printed = "half-difference theta_h:square-root … ranking, lobe";
    bench.tells("run small.toml -o a", printed);
    let names = "config.toml manifest.json pictures/errors.svg ranking.csv report.html results.csv \
        results.jsonl timings.jsonl timings.svg";
    assert_eq!(bench.files("a").join(" "), names);

    let rows = bench.rows("a");
    let count = 2 * 2 * 2 * 2 * 2 * 2 * 2;
    assert_eq!(rows.len(), count);
    // The table says the same.
    let table = csv_rows(&bench.read("a/results.csv"));
    assert!(table[0].keys().eq(Row::columns().map(|(name, _)| name)));
    assert_eq!(table.len(), count);
    for (cells, row) in table.iter().zip(&rows) {
        let row = serde_json::to_value(row).unwrap();
        for (cell, value) in cells.values().zip(row.as_object().unwrap().values()) {
            let cell = cell.as_str().unwrap();
            match value {
                Value::Null => assert_eq!(cell, ""),
                Value::String(text) => assert_eq!(cell, text),
                number => assert_eq!(cell.parse().ok(), number.as_f64()),
            }
        }
    }
    let key = |row: &Row| {
        let place = |names: &[&str], name: &str| names.iter().position(|n| *n == name).unwrap();
        (
            place(&["lambert", "ggx-0.4"], &row.material),
            place(&["none", "theta_h:square-root"], &row.warp),
            place(&["grid", "random"], &row.sample_set),
            row.budget,
            row.seed,
            place(&["nearest", "inverse-distance"], &row.reconstruction),
            place(&["cosine", "lobe"], &row.measure),
        )
    };
    assert!(rows.is_sorted_by_key(key));
    for r in &rows {
        assert!(r.readings <= r.budget && r.readings + r.no_data == r.poses);
        assert!(r.value("nrmse").is_some());
    }
    let manifest = bench.manifest("a");
    assert_eq!(manifest["seeds"], json!([1, 2]));
    let hash = blake3::hash(SMALL.as_bytes()).to_string();
    assert_eq!(manifest["inputs"][0]["blake3"], hash);
    let machine = bench.dir.path().to_string_lossy().into_owned();
    assert!(!manifest.to_string().contains(&machine));
}

/// Some of everything that a run does on several threads: moments, albedos, poses that are chosen, a machine with
/// noise, slices. Random paths and rays are those of `surface` and `paths`.
const EVERYTHING: &str = r#"
quantities = ["albedo", "moments"]
budgets = [12]
material = [{ kind = "lambert" }, { kind = "ggx", alpha = 0.4 }]
parametrization = [{ kind = "half-difference" }]
sample_set = [{ kind = "random" }, { kind = "adaptive" }]
reconstruction = [{ kind = "nearest" }, { kind = "kriging" }]
instrument = [{ preset = "cornell" }]
moments = { views = 2, order = 2, estimator = { kind = "peak-resolving", tolerance = 1e-2 } }
metrics = { pairs = 100, max_pairs = 1 }
output = { schedules = "csv", slices = true }
"#;

#[test]
fn bytes_depend_on_config_and_seed_only() {
    let bench = Bench::new();
    bench.write("all.toml", EVERYTHING);
    bench.good("run all.toml -q -o one --threads 1");
    bench.good("run all.toml -q -o two --threads 2");
    assert_same(&results(&bench, "one"), &results(&bench, "two"));
    assert_eq!(bench.machine("two")["threads"], 2);

    bench.good("run small.toml -q -o one --force");
    bench.good("run small.toml -q -o other --seed 7");
    let rows = bench.rows("other");
    assert!(rows.iter().all(|r| r.seed == 7));
    let random = |rows: Vec<Row>| {
        let is_random = |r: &&Row| r.material != "lambert" && r.sample_set == "random";
        rows.iter().find(is_random).unwrap().value("nrmse")
    };
    assert_ne!(random(rows), random(bench.rows("one")));
}

#[test]
fn folders_are_chosen_kept_and_made_again() {
    let bench = Bench::new();
    let quick = "--set budgets=[60] --set seeds=[1] -q";
    let run = |more: &str| format!("run small.toml {quick} {more}");
    let count = || fs::read_dir(bench.path("runs")).unwrap().count();
    bench.good(run(""));
    let first = bench.read("runs/small/results.csv");
    // The same question goes on where it was, another takes the next name.
    let other = "--set metrics={pairs=400,max_pairs=1}";
    for more in ["", other, other, "", "-o deep/er/a"] {
        bench.good(run(more));
    }
    assert_eq!(count(), 2);
    for folder in ["runs/small", "runs/small-2", "deep/er/a"] {
        let manifest = bench.path(folder).join("manifest.json");
        assert!(manifest.exists(), "{folder}");
    }
    assert_eq!(bench.read("runs/small/results.csv"), first);
    let before = bench.read("deep/er/a/results.csv");
    // Made again is what a run made, and nothing else is touched.
    bench.write("deep/er/a/notes.txt", "mine");
    for (more, schedules) in [("", 0), ("--set output.schedules=csv", 4), ("--force", 0)] {
        bench.good(run(&format!("-o deep/er/a {more}")));
        assert_eq!(bench.read("deep/er/a/results.csv"), before);
        let mut files = bench.files("deep/er/a");
        files.retain(|file| file.starts_with("schedules/"));
        assert_eq!(files.len(), schedules, "{more}");
    }
    assert_eq!(bench.read("deep/er/a/notes.txt"), "mine");
    // Also without naming the folder.
    let times = bench.read("runs/small/timings.jsonl");
    bench.good(run("--force"));
    assert_eq!(bench.read("runs/small/results.csv"), first);
    assert!(bench.read("runs/small/timings.jsonl") != times);
    assert_eq!(count(), 2);
}

#[test]
fn other_peoples_files_are_left_alone() {
    let bench = Bench::new();
    for name in ["config.toml", "results.csv", "report.html"] {
        let _ = fs::remove_dir_all(bench.path("mine"));
        fs::create_dir(bench.path("mine")).unwrap();
        fs::write(bench.path("mine").join(name), "precious").unwrap();
        for force in ["", "--force"] {
            let told = format!("{name} is here … choose another folder with -o");
            bench.refuses(format!("run small.toml -o mine {force}"), 2, &told);
        }
        assert_eq!(bench.files("mine"), [name]);
        assert_eq!(bench.read(&format!("mine/{name}")), "precious");
    }
    bench.write("file", "mine");
    bench.refuses("run small.toml -o file", 2, "no folder");
}

/// A table without data: there is nothing to reconstruct.
#[test]
fn a_job_that_fails_costs_only_its_rows() {
    let bench = Bench::new();
    bench.write("empty.binary", empty_merl());
    let moments = "experiment = \"moments\"\nmoments = { views = 3 }\n";
    bench.write("moments.toml", moments);
    let both = "--set material=[{kind=\"lambert\"},{kind=\"merl\",path=\"empty.binary\"}]";
    // One of 2 materials: 2 warps, 2 budgets and 2 reconstructions, for one reason.
    let small = "run small.toml --set sample_set=[{kind=\"random\"}] --set seeds=[1] -o a";
    for (run, failed, jobs, rows) in [(small, 8, 16, 16), ("run moments.toml -o b", 1, 2, 1)] {
        let stderr = bench.ends(format!("{run} {both}"), 5);
        let failures = format!("empty.binary: every cell … {failed} of {jobs} jobs failed");
        says(&stderr, &failures);
        let manifest = bench.manifest(run.rsplit(' ').next().unwrap());
        assert_eq!(manifest["status"], "failed-jobs");
        assert_eq!(manifest["failures"][0]["jobs"], failed);
        assert_eq!(manifest["rows"], rows);
    }
}

#[cfg(unix)]
#[test]
fn stderr_may_be_closed() {
    let bench = Bench::new();
    let good = "run small.toml --set budgets=[60] -o a";
    for (args, code) in [(good, 0), ("run none", 2)] {
        let mut child = bench.started(args);
        drop(child.stderr.take());
        assert_eq!(child.wait().unwrap().code(), Some(code), "{args:?}");
    }
}

#[test]
fn a_run_that_goes_on_is_left_alone() {
    let bench = Bench::new();
    let mut source = Source::read(&bench.path("small.toml")).unwrap();
    source.set("budgets=[60]", "--set".into()).unwrap();
    let plan = Plan::read(&source).unwrap();
    let going_on = RunFolder::<Row>::open(&bench.path("a"), false, &plan.resolved).unwrap();
    let files = bench.files("a");
    let config = bench.read("a/config.toml");
    bench.does(
        "2 | run small.toml -o a | a run is going on here
         2 | run small.toml -o a --force | a run is going on here",
    );
    assert_eq!(bench.files("a"), files);
    assert_eq!(bench.read("a/config.toml"), config);
    // What a crash leaves is nobody's.
    drop(going_on);
    bench.good("run small.toml -q -o a");
    assert_eq!(bench.rows("a").len(), 128);
}

/// Hours of work in the folder `a`, as soon as its file of records has some.
#[cfg(unix)]
fn long_run(bench: &Bench, text: &str, records: &str) -> std::process::Child {
    bench.write("long.toml", text);
    let child = bench.started("run long.toml -o a");
    let records = bench.path("a").join(records);
    let start = Instant::now();
    let some = || fs::metadata(&records).is_ok_and(|m| m.len() > 2000);
    while !some() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// Two long runs, and the files of their records and of their table: thousands of budgets, thousands of materials.
#[cfg(unix)]
fn long_runs() -> [(String, &'static str, &'static str); 2] {
    let budgets: Vec<_> = (20..5000).map(|b| b.to_string()).collect();
    let acquisition = SMALL.replace("60, 150", &budgets.join(","));
    let material = |i: i32| format!("{{ kind = \"ggx\", alpha = 0.{i} }},");
    let materials: String = (1000..5000).map(material).collect();
    let moments = "experiment = \"moments\"\nmoments = { views = 9 }\n";
    let moments = format!("{moments}material = [{materials}]\n");
    [
        (acquisition, "results.jsonl", "results.csv"),
        (moments, "profiles.jsonl", "profiles.csv"),
    ]
}

#[cfg(unix)]
#[test]
fn a_run_whose_folder_is_gone_does_not_end_well() {
    for (text, records, _) in long_runs() {
        let bench = Bench::new();
        let child = long_run(&bench, &text, records);
        fs::rename(bench.path("a"), bench.path("away")).unwrap();
        let removed = Instant::now();
        let output = child.wait_with_output().unwrap();
        assert!(removed.elapsed() < Duration::from_secs(20));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        says(&stderr, "gonio: a … folder was removed");
        assert!(!bench.path("a").exists());
        // What was finished is whole.
        fs::rename(bench.path("away"), bench.path("a")).unwrap();
        let rows = finished(&bench, "a", records);
        let is_whole = |row: &String| serde_json::from_str::<Value>(row).is_ok();
        assert!(!rows.is_empty() && rows.iter().all(is_whole));
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_finished() {
    for (text, records, table) in long_runs() {
        let bench = Bench::new();
        let mut child = long_run(&bench, &text, records);
        let killed = Instant::now();
        send("INT", &child);
        let status = child.wait().unwrap();
        assert!(killed.elapsed() < Duration::from_secs(10));
        assert_eq!(status.code(), Some(130));
        let rows = finished(&bench, "a", records).len();
        let manifest = bench.manifest("a");
        assert!(rows > 0 && manifest["status"] == "interrupted");
        assert_eq!(manifest["rows"], rows);
        assert!(bench.files("a").iter().all(|name| !name.ends_with(".part")));
        // What there is is a table too, and no report is made of a part.
        let lines = bench.lines(&format!("a/{table}")).len();
        assert!(lines > 0 && lines.is_multiple_of(rows), "{lines} of {rows}");
        let report = ["a/report.html", "a/ranking.csv"].map(|file| bench.path(file));
        assert!(!report.iter().any(|file| file.exists()));
    }
}
