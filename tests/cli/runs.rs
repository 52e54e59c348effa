//! Runs: what they leave, what they depend on, what they replace, how they end.

use super::common::says;
use super::{Bench, SMALL, assert_same, finished, results};
use gonio::experiment::{Plan, Row, Source};
use gonio::report::RunFolder;
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn a_run_leaves_its_results_and_how_to_repeat_them() {
    let bench = Bench::new();
    let table = bench.good("run small.toml -o a");
    says(&table, "half-difference theta_h:square-root");
    says(&table, "ranking, lobe");
    let mut names = vec![
        "config.toml",
        "manifest.json",
        "ranking.csv",
        "report.html",
        "results.csv",
        "results.jsonl",
        "timings.jsonl",
        "timings.svg",
    ];
    names.insert(2, "pictures/errors.svg");
    assert_eq!(bench.files("a"), names);
    assert_eq!(bench.manifest("a")["files"], serde_json::json!(names));

    let rows = bench.rows("a");
    let count = 2 * 2 * 2 * 2 * 2 * 2 * 2;
    assert_eq!(rows.len(), count);
    // The table says the same.
    let mut reader = csv::Reader::from_path(bench.path("a/results.csv")).unwrap();
    let header: Vec<_> = Row::columns().map(|(name, _)| name).collect();
    assert_eq!(reader.headers().unwrap(), header);
    let table: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(table.len(), count);
    for (cells, row) in table.iter().zip(&rows) {
        let row = serde_json::to_value(row).unwrap();
        for (cell, value) in cells.iter().zip(row.as_object().unwrap().values()) {
            match value {
                serde_json::Value::Null => assert_eq!(cell, ""),
                serde_json::Value::String(text) => assert_eq!(cell, text),
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
    assert!(
        rows.iter()
            .all(|r| r.readings <= r.budget && r.readings + r.no_data == r.poses)
    );
    assert!(rows.iter().all(|r| r.value("nrmse").is_some()));

    let manifest = bench.manifest("a");
    assert_eq!(manifest["status"], "complete");
    assert_eq!(manifest["rows"], count);
    assert_eq!(manifest["seeds"], serde_json::json!([1, 2]));
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

[[material]]
kind = "lambert"

[[material]]
kind = "ggx"
alpha = 0.4

[[parametrization]]
kind = "half-difference"

[[sample_set]]
kind = "random"

[[sample_set]]
kind = "adaptive"

[[reconstruction]]
kind = "nearest"

[[reconstruction]]
kind = "kriging"

[[instrument]]
preset = "cornell"

[moments]
views = 2
order = 2
estimator = { kind = "peak-resolving", tolerance = 1e-2 }

[metrics]
pairs = 100
max_pairs = 1

[output]
schedules = "csv"
slices = true
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
    bench.good("run one/config.toml -q -o again");
    assert_same(&results(&bench, "one"), &results(&bench, "again"));
    bench.good("run small.toml -q -o other --seed 7");
    let rows = bench.rows("other");
    assert!(rows.iter().all(|r| r.seed == 7));
    let random = |rows: Vec<Row>| {
        let row = rows
            .into_iter()
            .find(|r| r.material != "lambert" && r.sample_set == "random");
        row.unwrap().value("nrmse")
    };
    assert_ne!(random(rows), random(bench.rows("one")));
}

#[test]
fn folders_are_chosen_kept_and_made_again() {
    let bench = Bench::new();
    let quick = "--set budgets=[60] --set seeds=[1] -q";
    let run = |more: &str| format!("run small.toml {quick} {more}");
    bench.good(run(""));
    let first = bench.read("runs/small/results.csv");
    // The same question goes on where it was, another takes the next name.
    bench.good(run(""));
    assert_eq!(bench.read("runs/small/results.csv"), first);
    let other = "--set metrics={pairs=400,max_pairs=1}";
    bench.good(run(other));
    bench.good(run(other));
    bench.good(run(""));
    bench.good(run("-o deep/er/a"));
    assert_eq!(fs::read_dir(bench.path("runs")).unwrap().count(), 2);
    for folder in ["runs/small", "runs/small-2", "deep/er/a"] {
        assert!(
            bench.path(folder).join("manifest.json").exists(),
            "{folder}"
        );
    }
    assert_eq!(bench.read("runs/small/results.csv"), first);
    let before = bench.read("deep/er/a/results.csv");
    bench.good(run("-o deep/er/a"));
    assert_eq!(bench.read("deep/er/a/results.csv"), before);

    // Made again is what a run made, and nothing else is touched.
    bench.write("deep/er/a/notes.txt", "mine");
    bench.good(run("-o deep/er/a --set output.schedules=csv"));
    let count = || {
        fs::read_dir(bench.path("deep/er/a/schedules"))
            .unwrap()
            .count()
    };
    assert_eq!(count(), 4);
    // Every row was there.
    assert_eq!(bench.read("deep/er/a/results.csv"), before);
    bench.good(run("-o deep/er/a --force"));
    assert!(!bench.path("deep/er/a/schedules").exists());
    assert_eq!(bench.read("deep/er/a/notes.txt"), "mine");
    let again = bench.read("deep/er/a/results.csv");
    assert!(again == before);
    // Also without naming the folder.
    let times = bench.read("runs/small/timings.jsonl");
    bench.good(run("--force"));
    assert!(bench.read("runs/small/results.csv") == first);
    assert!(bench.read("runs/small/timings.jsonl") != times);
    assert_eq!(fs::read_dir(bench.path("runs")).unwrap().count(), 2);
}

#[test]
fn other_peoples_files_are_left_alone() {
    let bench = Bench::new();
    for name in ["config.toml", "results.csv", "report.html"] {
        let _ = fs::remove_dir_all(bench.path("mine"));
        fs::create_dir(bench.path("mine")).unwrap();
        fs::write(bench.path("mine").join(name), "precious").unwrap();
        for force in ["", "--force"] {
            let args = format!("run small.toml -o mine {force}");
            let refusal = bench.refused(&args, 2);
            says(&refusal, &format!("{name} is here"));
            says(&refusal, "choose another folder with -o");
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
    let dimensions = [90_i32, 90, 180].iter().flat_map(|n| n.to_le_bytes());
    let cells = (0..3 * 90 * 90 * 180).flat_map(|_| (-1.0_f64).to_le_bytes());
    bench.write("empty.binary", dimensions.chain(cells).collect::<Vec<_>>());
    bench.write(
        "moments.toml",
        "experiment = \"moments\"\n[moments]\nviews = 3\n",
    );
    let both = "--set material=[{kind=\"lambert\"},{kind=\"merl\",path=\"empty.binary\"}]";
    // One of 2 materials: 2 warps, 2 budgets and 2 reconstructions, for one reason.
    let small = "run small.toml --set sample_set=[{kind=\"random\"}] --set seeds=[1] -o a";
    for (run, failed, jobs, rows) in [(small, 8, 16, 16), ("run moments.toml -o b", 1, 2, 1)] {
        let stderr = bench.ends(format!("{run} {both}"), 5);
        says(&stderr, "empty.binary: every cell");
        says(&stderr, &format!("{failed} of {jobs} jobs failed"));
        let manifest = bench.manifest(run.rsplit(' ').next().unwrap());
        assert_eq!(manifest["status"], "failed-jobs");
        assert_eq!(manifest["failures"][0]["jobs"], failed);
        assert_eq!(manifest["rows"], rows);
    }
}

#[cfg(unix)]
#[test]
fn nobody_needs_to_listen_on_stderr() {
    let bench = Bench::new();
    let good = "run small.toml --set budgets=[60] -o a";
    for (args, code) in [(good, 0), ("run none", 2)] {
        let mut command = bench.command(args);
        let mut child = command
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
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
    for force in ["", "--force"] {
        let args = format!("run small.toml -o a {force}");
        bench.refuses(&args, 2, "a run is going on here");
    }
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
    let mut command = bench.command("run long.toml -o a");
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    let records = bench.path("a").join(records);
    let start = Instant::now();
    let some = || fs::metadata(&records).is_ok_and(|m| m.len() > 2000);
    while !some() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// [`SMALL`] with thousands of budgets.
#[cfg(unix)]
fn long_acquisition() -> String {
    let budgets: Vec<_> = (20..5000).map(|b| b.to_string()).collect();
    let budgets = format!("budgets = [{}]", budgets.join(","));
    SMALL.replace("budgets = [60, 150]", &budgets)
}

/// Two long runs, and the files of their records and of their table.
#[cfg(unix)]
fn long_runs() -> [(String, &'static str, &'static str); 2] {
    let materials: String = (1000..5000)
        .map(|i| format!("[[material]]\nkind = \"ggx\"\nalpha = 0.{i}\n"))
        .collect();
    let moments = format!("experiment = \"moments\"\n[moments]\nviews = 9\n{materials}");
    [
        (long_acquisition(), "results.jsonl", "results.csv"),
        (moments, "profiles.jsonl", "profiles.csv"),
    ]
}

#[cfg(unix)]
#[test]
fn a_run_whose_folder_is_gone_does_not_end_well() {
    for (text, records, _) in long_runs() {
        let bench = Bench::new();
        let child = long_run(&bench, &text, records);
        fs::remove_dir_all(bench.path("a")).unwrap();
        let removed = Instant::now();
        let output = child.wait_with_output().unwrap();
        assert!(removed.elapsed() < Duration::from_secs(20));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        says(&stderr, "folder was removed");
        assert!(!bench.path("a").exists());
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_finished() {
    for (text, records, table) in long_runs() {
        let bench = Bench::new();
        let mut child = long_run(&bench, &text, records);
        let killed = Instant::now();
        let id = child.id().to_string();
        let kill = Command::new("kill").args(["-INT", &id]).status();
        assert!(kill.unwrap().success());
        let status = child.wait().unwrap();
        assert!(killed.elapsed() < Duration::from_secs(10));
        assert_eq!(status.code(), Some(130));
        let rows = finished(&bench, "a", records).len();
        let manifest = bench.manifest("a");
        assert!(rows > 0 && manifest["status"] == "interrupted");
        assert_eq!(manifest["rows"], rows);
        assert!(bench.files("a").iter().all(|name| !name.ends_with(".part")));
        // What there is is a table too, and no report is made of a part.
        let lines = bench.read(&format!("a/{table}")).lines().count() - 1;
        assert!(lines > 0 && lines.is_multiple_of(rows), "{lines} of {rows}");
        let report = ["a/report.html", "a/ranking.csv"].map(|file| bench.path(file));
        assert!(!report.iter().any(|file| file.exists()));
    }
}

#[test]
fn slices_are_written_if_asked() {
    let bench = Bench::new();
    let without = "--set budgets=[60] --set seeds=[1]";
    let sets = format!("{without} --set output.slices=true");
    bench.good(format!("run small.toml -q -o a {sets}"));
    let slices: Vec<_> = bench
        .files("a")
        .into_iter()
        .filter(|name| name.ends_with(".exr"))
        .collect();
    assert_eq!(slices.len(), 16, "{slices:?}");
    let listed = bench.manifest("a")["files"].to_string();
    assert!(slices.iter().all(|name| listed.contains(name)));
    // They change nothing else.
    bench.good(format!("run small.toml -q -o b {without}"));
    let [with, without] = ["a", "b"].map(|run| bench.read(&format!("{run}/results.csv")));
    assert!(with == without);
    // One is lost: it alone is made again.
    fs::remove_file(bench.path("a").join(&slices[3])).unwrap();
    bench.good(format!("run small.toml -q -o a {sets}"));
    assert!(bench.path("a").join(&slices[3]).exists());
    assert_eq!(bench.read("a/results.csv"), with);
}
