//! Runs: what they leave, what they depend on, what they replace, how they end.

use super::{Bench, SMALL, timeless};
use gonio::experiment::{Config, Kind, Plan, Row, Source};
use gonio::report::RunFolder;
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn a_run_leaves_its_results_and_how_to_repeat_them() {
    let bench = Bench::new();
    let table = bench.good(&["run", "small.toml", "-o", "a"]);
    assert!(
        table.contains("half-difference theta_h:square-root"),
        "{table}"
    );
    assert!(table.contains("ranking, lobe"), "{table}");
    let names = [
        "config.toml",
        "manifest.json",
        "results.csv",
        "results.jsonl",
    ];
    assert_eq!(bench.files("a"), names);

    let rows = bench.rows("a");
    let count = 2 * 2 * 2 * 2 * 2 * 2 * 2;
    assert_eq!(rows.len(), count);
    let mut reader = csv::Reader::from_path(bench.path("a/results.csv")).unwrap();
    let from_csv: Vec<Row> = reader.deserialize().map(Result::unwrap).collect();
    assert!(rows == from_csv);
    let key = |row: &Row| {
        let place = |names: &[&str], name: &str| names.iter().position(|n| *n == name).unwrap();
        (
            place(&["lambert", "ggx-0.4"], &row.material),
            place(&["none", "theta_h:square-root"], &row.warp),
            place(&["grid", "random"], &row.sample_set),
            row.budget,
            place(&["nearest", "inverse-distance"], &row.reconstruction),
            row.seed,
            place(&["cosine", "lobe"], &row.measure),
        )
    };
    assert!(rows.is_sorted_by_key(key));
    assert!(
        rows.iter()
            .all(|r| r.readings <= r.budget && r.readings + r.no_data == r.poses)
    );
    assert!(rows.iter().all(|r| r.nrmse.is_some() && r.albedo.is_some()));

    let manifest = bench.manifest("a");
    assert_eq!(manifest["status"], "complete");
    assert_eq!(manifest["rows"], count);
    assert_eq!(manifest["seeds"], serde_json::json!([1, 2]));
    let hash = blake3::hash(SMALL.as_bytes()).to_string();
    assert_eq!(manifest["inputs"][0]["blake3"], hash);
    let machine = bench.dir.path().to_string_lossy().into_owned();
    assert!(!manifest.to_string().contains(&machine));
}

#[test]
fn bytes_depend_on_config_and_seed_only() {
    let bench = Bench::new();
    bench.good(&["run", "small.toml", "-q", "-o", "one", "--threads", "1"]);
    bench.good(&["run", "small.toml", "-q", "-o", "two", "--threads", "2"]);
    bench.good(&["run", "one/config.toml", "-q", "-o", "again"]);
    let one = timeless(&bench.read("one/results.csv"));
    assert_eq!(one, timeless(&bench.read("two/results.csv")));
    assert_eq!(one, timeless(&bench.read("again/results.csv")));
    assert_eq!(
        bench.read("one/config.toml"),
        bench.read("again/config.toml")
    );
    assert_eq!(bench.manifest("two")["threads"], 2);

    bench.good(&["run", "small.toml", "-q", "-o", "other", "--seed", "7"]);
    let rows = bench.rows("other");
    assert!(rows.iter().all(|r| r.seed == 7));
    let random = |rows: Vec<Row>| {
        let row = rows
            .into_iter()
            .find(|r| r.material != "lambert" && r.sample_set == "random");
        row.unwrap().nrmse
    };
    assert_ne!(random(rows), random(bench.rows("one")));
}

#[test]
fn folders_are_chosen_kept_and_replaced() {
    let bench = Bench::new();
    let quick = ["--set", "budgets=[60]", "--set", "seeds=[1]", "-q"];
    let run = |more: &[&'static str]| [&["run", "small.toml"], &quick[..], more].concat();
    bench.good(&run(&[]));
    bench.good(&run(&[]));
    bench.good(&run(&["-o", "deep/er/a"]));
    for folder in ["runs/small", "runs/small-2", "deep/er/a"] {
        assert!(
            bench.path(folder).join("manifest.json").exists(),
            "{folder}"
        );
    }
    let before = bench.read("deep/er/a/results.csv");
    let refusal = bench.refused(&run(&["-o", "deep/er/a"]), 2);
    assert!(
        refusal.contains("deep/er/a: a run is here already"),
        "{refusal}"
    );
    assert!(refusal.contains("--force"), "{refusal}");
    assert_eq!(bench.read("deep/er/a/results.csv"), before);

    // Replaced is what a run wrote, also one that crashed, and nothing else.
    fs::write(bench.path("deep/er/a/notes.txt"), "mine").unwrap();
    fs::write(bench.path("deep/er/a/results.csv.part"), "half").unwrap();
    bench.good(&run(&[
        "-o",
        "deep/er/a",
        "--force",
        "--set",
        "output.schedules=csv",
    ]));
    assert_eq!(bench.read("deep/er/a/notes.txt"), "mine");
    assert!(!bench.path("deep/er/a/results.csv.part").exists());
    assert_eq!(
        fs::read_dir(bench.path("deep/er/a/schedules"))
            .unwrap()
            .count(),
        4
    );
    bench.good(&run(&["-o", "deep/er/a", "--force"]));
    assert!(!bench.path("deep/er/a/schedules").exists());

    fs::create_dir(bench.path("mine")).unwrap();
    fs::write(bench.path("mine/config.toml"), "precious").unwrap();
    let refusal = bench.refused(&run(&["-o", "mine", "--force"]), 2);
    assert!(
        refusal.contains("config.toml is here, and no run wrote it"),
        "{refusal}"
    );
    assert_eq!(bench.files("mine"), ["config.toml"]);
    // Without a folder of its own, a run replaces nothing.
    assert_eq!(bench.gonio(&run(&["--force"])).status.code(), Some(2));
}

#[test]
fn a_job_that_fails_costs_only_its_rows() {
    let bench = Bench::new();
    let args = [
        "run",
        "small.toml",
        "-o",
        "a",
        "--set",
        "budgets=[2, 100]",
        "--set",
        "reconstruction=[{kind=\"nearest\"},{kind=\"thin-plate\"}]",
        "--set",
        "sample_set=[{kind=\"random\"}]",
        "--set",
        "seeds=[1]",
    ];
    let output = bench.gonio(&args);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(5), "{stderr}");
    // One of two reconstructions at one of two budgets, for 2 materials and 2 warps.
    assert_eq!(stderr.lines().count(), 4 + 1, "{stderr}");
    assert!(
        stderr.contains("random of 2 poses, seed 1, thin-plate: 2 readings"),
        "{stderr}"
    );
    assert!(stderr.contains("4 of 16 jobs failed"), "{stderr}");
    let manifest = bench.manifest("a");
    assert_eq!(manifest["status"], "failed-jobs");
    assert_eq!(manifest["failures"].as_array().unwrap().len(), 4);
    assert_eq!(bench.rows("a").len(), 12 * 2);
}

#[cfg(unix)]
#[test]
fn nobody_needs_to_listen_on_stderr() {
    let bench = Bench::new();
    let args = ["run", "small.toml", "--set", "budgets=[60]", "-o"];
    for (args, code) in [([&args[..], &["a"]].concat(), 0), (vec!["run", "none"], 2)] {
        let mut command = bench.command(&args);
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
fn a_run_that_goes_on_is_not_replaced() {
    let bench = Bench::new();
    let mut source = Source::read(&bench.path("small.toml")).unwrap();
    source.set("budgets=[60]", "--set".into()).unwrap();
    let plan = Plan::new(Config::read(&source).unwrap()).unwrap();
    let going_on =
        RunFolder::create(&bench.path("a"), false, Kind::Acquisition, &plan.resolved).unwrap();
    let files = bench.files("a");
    for force in [&[][..], &["--force"]] {
        let args = [&["run", "small.toml", "-o", "a"], force].concat();
        let message = bench.refused(&args, 2);
        assert!(message.contains("a run is going on here"), "{message}");
    }
    assert_eq!(bench.files("a"), files);
    // What a crash leaves is nobody's.
    drop(going_on);
    let message = bench.refused(&["run", "small.toml", "-o", "a"], 2);
    assert!(message.contains("--force"), "{message}");
    bench.good(&["run", "small.toml", "-q", "-o", "a", "--force"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_finished_rows() {
    let bench = Bench::new();
    // Hours of work.
    let budgets: Vec<_> = (20..5000).map(|b| b.to_string()).collect();
    let budgets = format!("budgets=[{}]", budgets.join(","));
    let args = ["run", "small.toml", "-o", "a", "--set", &budgets];
    let mut command = bench.command(&args);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let part = bench.path("a/results.jsonl.part");
    let start = Instant::now();
    while !part.exists() && start.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    let killed = Instant::now();
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let status = child.wait().unwrap();
    assert!(killed.elapsed() < Duration::from_secs(5));
    assert_eq!(status.code(), Some(130));
    let rows = bench.rows("a");
    assert!(!rows.is_empty());
    let manifest = bench.manifest("a");
    assert_eq!(manifest["status"], "interrupted");
    assert_eq!(manifest["rows"], rows.len());
    assert!(bench.files("a").iter().all(|name| !name.ends_with(".part")));
}

#[cfg(feature = "exr")]
#[test]
fn slices_are_written_if_asked() {
    let bench = Bench::new();
    let sets = [
        "--set",
        "budgets=[60]",
        "--set",
        "seeds=[1]",
        "--set",
        "output.slices=true",
    ];
    bench.good(&[&["run", "small.toml", "-q", "-o", "a"], &sets[..]].concat());
    let slices: Vec<_> = bench
        .files("a")
        .into_iter()
        .filter(|name| name.ends_with(".exr"))
        .collect();
    assert_eq!(slices.len(), 16, "{slices:?}");
    let listed = bench.manifest("a")["files"].to_string();
    assert!(slices.iter().all(|name| listed.contains(name)));
}
