//! The program as a user meets it: exit codes, sentences on stderr, files that are whole or not
//! there.

use gonio::experiment::Row;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A folder to run the program in.
struct Bench {
    dir: TempDir,
}

/// A small experiment with every kind of choice.
const SMALL: &str = r#"
budgets = [60, 150]
seeds = [1, 2]

[[material]]
kind = "lambert"

[[material]]
kind = "ggx"
alpha = 0.4

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "half-difference"
warp = { theta_h = "square-root" }

[[sample_set]]
kind = "grid"

[[sample_set]]
kind = "random"

[[reconstruction]]
kind = "nearest"

[[reconstruction]]
kind = "inverse-distance"

[metrics]
pairs = 500
"#;

impl Bench {
    fn new() -> Self {
        let dir = TempDir::new().unwrap();
        fs::write(dir.path().join("small.toml"), SMALL).unwrap();
        Self { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonio"));
        command.args(args).current_dir(self.dir.path());
        command.stdin(Stdio::null());
        command
    }

    fn gonio(&self, args: &[&str]) -> Output {
        self.command(args).output().unwrap()
    }

    /// Runs what must work; its stdout.
    fn good(&self, args: &[&str]) -> String {
        let output = self.gonio(args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs what must be refused, within a moment and in one line; its stderr.
    fn refused(&self, args: &[&str], code: i32) -> String {
        let start = Instant::now();
        let output = self.gonio(args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{args:?}: {stderr}");
        // One second on an idle machine; tests share theirs.
        assert!(start.elapsed() < Duration::from_secs(5), "{args:?}");
        stderr
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Every file below a folder.
    fn files(&self, name: &str) -> Vec<String> {
        fn walk(dir: &Path, base: &Path, out: &mut Vec<String>) {
            for entry in fs::read_dir(dir).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    walk(&path, base, out);
                } else {
                    let name = path.strip_prefix(base).unwrap();
                    out.push(name.to_string_lossy().into_owned());
                }
            }
        }
        let mut files = Vec::new();
        let dir = self.path(name);
        walk(&dir, &dir, &mut files);
        files.sort();
        files
    }

    fn rows(&self, run: &str) -> Vec<Row> {
        let text = self.read(&format!("{run}/results.jsonl"));
        let lines = text.lines().map(|l| serde_json::from_str(l).unwrap());
        lines.collect()
    }

    fn manifest(&self, run: &str) -> serde_json::Value {
        serde_json::from_str(&self.read(&format!("{run}/manifest.json"))).unwrap()
    }
}

/// A CSV without the columns that time makes.
fn timeless(csv: &str) -> String {
    let mut lines = csv.lines();
    let header: Vec<_> = lines.next().unwrap().split(',').collect();
    let keep: Vec<_> = (0..header.len())
        .filter(|&i| !header[i].ends_with("_seconds"))
        .collect();
    let row = |cells: Vec<&str>| {
        let cells: Vec<_> = keep.iter().map(|&i| cells[i]).collect();
        cells.join(",") + "\n"
    };
    let rest = lines.map(|line| row(line.split(',').collect()));
    std::iter::once(row(header.clone())).chain(rest).collect()
}

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
fn bad_input_is_refused_in_a_sentence_and_leaves_nothing() {
    let bench = Bench::new();
    fs::write(bench.path("file"), "").unwrap();
    fs::create_dir(bench.path("empty")).unwrap();
    fs::write(
        bench.path("short.binary"),
        [90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0, 1],
    )
    .unwrap();
    fs::write(bench.path("tiny.binary"), [1, 2]).unwrap();
    fs::write(
        bench.path("other.binary"),
        [9, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0],
    )
    .unwrap();
    let merl = |path| format!("material.1={{kind=\"merl\",path=\"{path}\"}}");
    let (gone, short) = (merl("gone.binary"), merl("short.binary"));
    let (tiny, other) = (merl("tiny.binary"), merl("other.binary"));
    // (override, exit code, what the sentence says)
    let cases: [(&str, i32, &[&str]); 14] = [
        ("metrics.pears=3", 2, &["metrics.pears", "allowed: pairs"]),
        (
            "budgets=[0]",
            2,
            &["budgets[0] = 0", "allowed is a whole number from 1"],
        ),
        ("budgets=many", 2, &["budgets", "\"many\"", "a list"]),
        (
            "material.1.alpha=0",
            2,
            &["material[1].alpha = 0", "allowed is"],
        ),
        (
            "material.1.alpha=-1.5",
            2,
            &["material[1].alpha = -1.5", "allowed is"],
        ),
        (
            "material.1.alpha=nan",
            2,
            &["material[1].alpha = NaN", "allowed is"],
        ),
        (
            "material.1.alpha=wide",
            2,
            &["material[1].alpha = \"wide\"", "allowed is"],
        ),
        ("material.7.alpha=1", 2, &["`7`", "0 to 1"]),
        (&gone, 3, &["gone.binary", "No such file"]),
        (&short, 3, &["short.binary", "34992012"]),
        (&tiny, 3, &["tiny.binary", "2 bytes"]),
        (&other, 3, &["other.binary", "9, 90, 180", "90, 90, 180"]),
        (
            "materials_dir=empty",
            3,
            &["empty", "no MERL file", "--set materials_dir=DIR"],
        ),
        (
            "materials_dir=nowhere",
            3,
            &["nowhere", "--set materials_dir=DIR"],
        ),
    ];
    for (set, code, says) in cases {
        for command in ["run", "check"] {
            let sentence = bench.refused(&[command, "small.toml", "--set", set], code);
            for part in says {
                assert!(
                    sentence.contains(part),
                    "{set}: {part} is not in: {sentence}"
                );
            }
        }
    }
    for folder in ["file", "file/below"] {
        let sentence = bench.refused(&["run", "small.toml", "-o", folder], 2);
        assert!(
            sentence.starts_with(&format!("gonio: {folder}: ")),
            "{sentence}"
        );
    }
    let sentence = bench.refused(&["run", "nothing.toml"], 2);
    assert!(
        sentence.contains("nothing.toml: cannot read this config"),
        "{sentence}"
    );
    assert!(!bench.path("runs").exists());
    for usage in [
        &["run"][..],
        &["walk"],
        &["run", "small.toml", "--threads", "0"],
    ] {
        assert_eq!(bench.gonio(usage).status.code(), Some(2), "{usage:?}");
    }
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
        stderr.contains("random of 2, seed 1, thin-plate: 2 readings"),
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

#[test]
fn schedules_say_the_same_in_both_formats() {
    let bench = Bench::new();
    let choice = [
        "--budget",
        "150",
        "--warp",
        "none",
        "--sample-set",
        "grid",
        "--seed",
        "1",
    ];
    let schedule =
        |more: &[&str]| bench.good(&[&["schedule", "small.toml"], &choice[..], more].concat());
    schedule(&["-o", "s.csv"]);
    schedule(&["-o", "s.jsonl"]);
    let text = bench.read("s.csv");
    assert_eq!(schedule(&[]), text);
    assert_eq!(
        schedule(&["-o", "-", "--format", "json-lines"]),
        bench.read("s.jsonl")
    );

    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let header: Vec<_> = reader.headers().unwrap().iter().map(String::from).collect();
    let expected = [
        "index",
        "theta_h_deg",
        "theta_d_deg",
        "phi_d_deg",
        "theta_i_deg",
        "phi_i_deg",
        "theta_o_deg",
        "phi_o_deg",
    ];
    assert_eq!(header, expected);
    for name in &header {
        assert!(
            text.contains(&format!("# {name}: ")),
            "the header explains {name}"
        );
    }
    let from_csv: Vec<Vec<f64>> = reader
        .records()
        .map(|r| r.unwrap().iter().map(|v| v.parse().unwrap()).collect())
        .collect();
    let text = bench.read("s.jsonl");
    let mut lines = text
        .lines()
        .map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap());
    let about = lines.next().unwrap();
    assert_eq!(about["header"]["poses"], from_csv.len());
    let from_json: Vec<Vec<f64>> = lines
        .map(|l| {
            header
                .iter()
                .map(|name| l[name].as_f64().unwrap())
                .collect()
        })
        .collect();
    assert!(from_csv == from_json);
    assert!((1..=150).contains(&from_csv.len()));
    for (i, row) in from_csv.iter().enumerate() {
        assert_eq!(row[0], i as f64);
        assert!(row[4] < 90.0 && row[6] < 90.0, "{row:?}");
    }
}

#[test]
fn several_schedules_need_a_choice_or_a_folder() {
    let bench = Bench::new();
    let sentence = bench.refused(&["schedule", "small.toml"], 2);
    for part in [
        "16 schedules",
        "--warp (none, theta_h:square-root)",
        "--budget",
        "-o DIR/",
    ] {
        assert!(sentence.contains(part), "{sentence}");
    }
    bench.good(&[
        "schedule",
        "small.toml",
        "-o",
        "all/",
        "--format",
        "json-lines",
    ]);
    assert_eq!(bench.files("all").len(), 16);
    let sentence = bench.refused(&["schedule", "small.toml", "--budget", "7"], 2);
    assert!(
        sentence.contains("\"7\" is not in this config; allowed: 150, 60"),
        "{sentence}"
    );
    let one = ["schedule", "all.toml", "-o", "one.txt"];
    fs::write(
        bench.path("all.toml"),
        "budgets = [9]\nmaterial = [{ kind = \"lambert\" }]",
    )
    .unwrap();
    assert!(
        bench
            .refused(&one, 2)
            .contains("one.txt: the format is not known")
    );
    bench.good(&[&one[..], &["--format", "csv"]].concat());
    assert!(
        bench
            .refused(&[&one[..], &["--format", "csv"]].concat(), 2)
            .contains("--force")
    );
}

#[test]
fn lists_name_every_member_of_every_registry() {
    let bench = Bench::new();
    let all = bench.good(&["list"]);
    let mut names: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut add = |family, list: Vec<&str>| {
        names.insert(family, list.into_iter().map(String::from).collect());
    };
    add(
        "materials",
        gonio::brdf::all().iter().map(|e| e.kind).collect(),
    );
    add(
        "sample-sets",
        gonio::schedule::all().iter().map(|e| e.kind).collect(),
    );
    add(
        "reconstructions",
        gonio::reconstruct::all().iter().map(|e| e.kind).collect(),
    );
    add(
        "parametrizations",
        gonio::parametrization::all()
            .iter()
            .map(|e| e.name)
            .collect(),
    );
    add(
        "warps",
        gonio::parametrization::WarpName::ALL
            .iter()
            .map(|w| w.name())
            .collect(),
    );
    add(
        "measures",
        gonio::metrics::Measure::ALL
            .iter()
            .map(|m| m.name())
            .collect(),
    );
    for (family, names) in names {
        let one = bench.good(&["list", family]);
        assert!(all.contains(&one), "{family}");
        for name in names {
            let listed = |text: &str| text.lines().any(|l| l.starts_with(&format!("  {name} ")));
            assert!(listed(&one), "{name} is not among the {family}:\n{one}");
        }
    }
    let version = bench.good(&["--version"]);
    assert_eq!(version.trim(), concat!("gonio ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn every_shipped_config_runs_on_a_small_budget() {
    let bench = Bench::new();
    let material = ["--material", "ggx-0.4"];
    let output = ["-o", "materials/ggx.binary"];
    fs::create_dir(bench.path("materials")).unwrap();
    let tabulate = [&["tabulate", "small.toml"], &material[..], &output[..]].concat();
    bench.good(&tabulate);
    assert!(bench.refused(&tabulate, 2).contains("this file exists"));
    bench.good(&[&tabulate[..], &["--force"]].concat());
    assert_eq!(
        fs::metadata(bench.path("materials/ggx.binary"))
            .unwrap()
            .len(),
        34_992_012
    );
    let sentence = bench.refused(&["tabulate", "small.toml", "-o", "x.binary"], 2);
    assert!(
        sentence.contains("allowed: one of lambert, ggx-0.4"),
        "{sentence}"
    );

    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let mut count = 0;
    for entry in fs::read_dir(configs).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).unwrap();
        assert!(
            text.starts_with("# ") && text.contains("\nquestion = "),
            "{name} asks"
        );
        let file = path.to_string_lossy();
        let small = ["--set", "budgets=[40]", "--set", "metrics.pairs=200", "-q"];
        bench.good(&["check", &file, "--set", "budgets=[40]"]);
        bench.good(&[&["run", &file, "-o", &name], &small[..]].concat());
        assert_eq!(bench.manifest(&name)["status"], "complete", "{name}");
        count += 1;
    }
    assert!(count >= 2);
    // Of the files that were read, the hash is kept.
    let inputs = &bench.manifest("merl")["inputs"];
    assert_eq!(inputs[1]["path"], "materials/ggx.binary");
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let bench = Bench::new();
    let mut command = bench.command(&["schedule", "small.toml", "--set", "budgets=[20000]"]);
    let choice = ["--warp", "none", "--sample-set", "random", "--seed", "1"];
    command
        .args(choice)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""));
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
