//! `gonio run` of a study: it goes on where it was, in parts or whole, and ends the same.

use super::Bench;
use std::fs;

/// A study that takes a moment.
const STUDY: &str = r#"
question = "Which coordinates?"
experiment = "study"
budgets = [60, 150]

[[material]]
kind = "ggx"
alpha = 0.3

[[material]]
kind = "low-abc-smooth"

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "hybrid"

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "multilinear"

[[reconstruction]]
kind = "inverse-distance"

[[coordinates]]
kind = "own"

[[coordinates]]
kind = "spherical"

[metrics]
pairs = 200
max_pairs = 1

[pictures]
draw = false
"#;

/// 2 materials × 2 parametrizations × 2 budgets × 3 reconstructions × 2 measures.
const ROWS: usize = 48;

fn bench() -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), STUDY).unwrap();
    bench
}

#[test]
fn a_study_goes_on_with_a_larger_question_and_back() {
    let bench = bench();
    let text = bench.good(&["run", "c.toml", "-q"]);
    assert!(text.starts_with("Which coordinates?"), "{text}");
    for part in [
        "nrmse, cosine",
        "nrmse, lobe",
        "* best of its column",
        "What explains",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let whole = bench.read("runs/c/results.csv");
    assert_eq!(whole.lines().count(), 1 + ROWS);
    for name in [
        "config.toml",
        "manifest.json",
        "report.html",
        "results.jsonl",
    ] {
        assert!(bench.path("runs/c").join(name).exists(), "{name}");
    }
    assert_eq!(bench.manifest("runs/c")["status"], "complete");
    let times = bench.read("runs/c/timings.jsonl");
    // After a crash in the middle of a line.
    let rows = bench.read("runs/c/results.jsonl");
    let cut = rows.match_indices('\n').nth(20).unwrap().0 + 30;
    fs::write(bench.path("runs/c/results.jsonl"), &rows[..cut]).unwrap();
    fs::remove_file(bench.path("runs/c/manifest.json")).unwrap();
    let list = bench.good(&["run", "c.toml", "--list"]);
    assert_eq!(
        list.lines().filter(|l| l.starts_with("open  ")).count(),
        14,
        "{list}"
    );
    assert!(
        list.ends_with("10 of 24 jobs are done in runs/c\n"),
        "{list}"
    );
    assert_eq!(bench.good(&["run", "c.toml", "-q"]), text);
    let again = bench.read("runs/c/results.csv");
    assert!(again == whole);
    // What was there has its old seconds.
    let kept = bench.read("runs/c/timings.jsonl");
    assert!(kept.lines().filter(|l| times.contains(l)).count() > 20);
    // A larger question: the old rows are part of the answer.
    let here = ["run", "c.toml", "-q", "-o", "runs/c"];
    let more = ["--set", "budgets=[60, 150, 300]"];
    bench.good(&[&here[..], &more].concat());
    let more = bench.read("runs/c/results.csv");
    assert_eq!(more.lines().count(), 1 + ROWS * 3 / 2);
    assert!(again.lines().all(|l| more.contains(l)));
    // And back: rows of the larger question are kept, not shown.
    bench.good(&here);
    assert_eq!(bench.read("runs/c/results.csv"), again);
    let rows = bench.read("runs/c/results.jsonl");
    assert_eq!(rows.lines().count(), ROWS * 3 / 2);
    // --force makes them all again.
    bench.good(&["run", "c.toml", "-q", "--force"]);
    assert!(!bench.path("runs/c-2").exists());
    assert_eq!(bench.read("runs/c/results.jsonl").lines().count(), ROWS);
}

#[test]
fn a_part_may_be_missing_and_must_be_of_the_same_study() {
    let bench = bench();
    bench.good(&["run", "c.toml", "-q", "-o", "whole"]);
    for part in ["1/3", "2/3", "3/3"] {
        bench.good(&["run", "c.toml", "-q", "--shard", part]);
    }
    let parts = [1, 2, 3].map(|i| format!("runs/c.shard-{i}-of-3"));
    let [a, b, c] = parts.each_ref().map(String::as_str);
    // Without a part: what is there is there, and the exit code says that it is not all.
    let output = bench.gonio(&["merge", a, c, "-o", "some"]);
    assert_eq!(output.status.code(), Some(5));
    let rows = bench.read("some/results.csv").lines().count() - 1;
    assert!(0 < rows && rows < ROWS);
    assert_eq!(bench.manifest("some")["status"], "incomplete");
    // The missing part, put to it.
    bench.good(&["merge", a, b, c, "-o", "some", "--force"]);
    let whole = bench.read("whole/results.csv");
    assert!(bench.read("some/results.csv") == whole);
    // Parts of something else.
    bench.good(&[
        "run",
        "c.toml",
        "-q",
        "-o",
        "other",
        "--set",
        "metrics={ pairs = 100, max_pairs = 1 }",
    ]);
    let refusal = bench.refused(&["merge", a, "other", "-o", "no"], 3);
    assert!(refusal.contains("other/config.toml") && refusal.contains("another config"));
    assert!(!bench.path("no").exists());
    assert!(
        bench
            .refused(&["merge", "nowhere", "-o", "no"], 3)
            .contains("nowhere")
    );
}

#[test]
fn acquisitions_and_studies_go_on_with_the_same_rows() {
    let bench = bench();
    let acquisition = STUDY.replace("\"study\"", "\"acquisition\"");
    // What an acquisition measures unasked.
    let none = acquisition.replace("budgets", "quantities = []\nbudgets");
    fs::write(bench.path("a.toml"), none).unwrap();
    bench.good(&["run", "c.toml", "-q", "-o", "a"]);
    let before = bench.read("a/results.csv");
    let table = bench.good(&["run", "a.toml", "-q", "-o", "a"]);
    assert!(table.contains("ranking, lobe"), "{table}");
    assert_eq!(bench.read("a/results.csv"), before);
    // Another question of the same: its rows come after the old ones.
    bench.good(&["run", "small.toml", "-q", "-o", "a"]);
    assert_eq!(bench.rows("a").len(), ROWS + 128);
    assert_eq!(bench.read("a/results.csv").lines().count(), 1 + 128);
}

#[test]
#[ignore = "thorough: draws studies twice"]
fn materials_are_drawn_once() {
    let bench = bench();
    let small = "[pictures]\nresolution = 12\nsamples = 4\nbudget = 60\n";
    let text = STUDY.replace("[pictures]\ndraw = false\n", small);
    fs::write(bench.path("c.toml"), text).unwrap();
    bench.good(&["run", "c.toml", "-q"]);
    let pictures = bench.files("runs/c/pictures");
    let count = |ending: &str| pictures.iter().filter(|f| f.ends_with(ending)).count();
    // Three of the study; of each of two materials its slices and two reconstructions.
    assert_eq!([count(".svg"), count(".png"), count(".exr")], [9, 4, 6]);
    let report = bench.read("runs/c/report.html");
    assert!(report.matches("<figure").count() >= 8);
    // One is lost: it alone is drawn again, though every row is there, with the same bytes.
    let lost = pictures.iter().find(|f| f.ends_with("hybrid.svg")).unwrap();
    let path = bench.path("runs/c/pictures").join(lost);
    let bytes = fs::read(&path).unwrap();
    // Those of the study itself are drawn at every run.
    let of_study = ["errors.svg", "functions.svg", "hemispheres.svg"];
    let drawn = |f: &&String| *f != lost && !of_study.contains(&f.as_str());
    let others: Vec<_> = pictures.iter().filter(drawn).collect();
    let times = || -> Vec<_> {
        let of = |f: &&String| fs::metadata(bench.path("runs/c/pictures").join(f));
        others
            .iter()
            .map(|f| of(f).unwrap().modified().unwrap())
            .collect()
    };
    let before = times();
    fs::remove_file(&path).unwrap();
    let rows = bench.read("runs/c/results.csv");
    bench.good(&["run", "c.toml", "-q"]);
    assert!(fs::read(&path).unwrap() == bytes);
    assert!(times() == before);
    assert!(bench.read("runs/c/results.csv") == rows);
    // All that is there is told, also if none of it was drawn now.
    let files = bench.files("runs/c");
    assert_eq!(bench.manifest("runs/c")["files"], serde_json::json!(files));
}

#[test]
fn parts_draw_their_own_materials() {
    use std::collections::BTreeSet;

    let bench = bench();
    let small = "[pictures]\nresolution = 12\nsamples = 4\nbudget = 60\n";
    let text = STUDY.replace("[pictures]\ndraw = false\n", small);
    fs::write(bench.path("c.toml"), text).unwrap();
    bench.good(&["run", "c.toml", "-q", "-o", "whole"]);
    for (part, folder) in [("1/2", "one"), ("2/2", "two")] {
        bench.good(&["run", "c.toml", "-q", "--shard", part, "-o", folder]);
    }
    let pictures = |run: &str| -> BTreeSet<String> {
        bench
            .files(&format!("{run}/pictures"))
            .into_iter()
            .collect()
    };
    let [whole, one, two] = ["whole", "one", "two"].map(pictures);
    let common: Vec<_> = one.intersection(&two).collect();
    assert!(common.is_empty(), "{common:?}");
    for material in ["ggx-0.3.", "low-abc-smooth-"] {
        let has = |part: &BTreeSet<String>| part.iter().any(|f| f.starts_with(material));
        assert!(has(&whole) && has(&one) != has(&two), "{material}");
    }
    // Drawn of all rows.
    let mut both: BTreeSet<String> = one.union(&two).cloned().collect();
    assert!(both.insert("errors.svg".into()));
    assert_eq!(both, whole);
    bench.good(&["merge", "one", "two", "-o", "merged"]);
    assert_eq!(pictures("merged"), whole);
    let bytes = |run: &str, file: &String| fs::read(bench.path(run).join("pictures").join(file));
    // Curves of costs tell the time.
    for file in whole.iter().filter(|f| *f != "errors.svg") {
        let [a, b] = ["whole", "merged"].map(|run| bytes(run, file).unwrap());
        assert!(a == b, "{file}");
    }
    let figures = |run: &str| {
        let report = bench.read(&format!("{run}/report.html"));
        report.matches("<figure").count()
    };
    assert_eq!(figures("merged"), figures("whole"));
}

#[test]
fn parts_must_be_of_the_same_inputs() {
    let bench = bench();
    let table = |value: f64| {
        let cells = (0..3 * 288 * 288).map(|i| value + 1e-7 * f64::from(i % 977));
        let bytes: Vec<u8> = cells.flat_map(f64::to_le_bytes).collect();
        fs::write(bench.path("a.bin"), bytes).unwrap();
    };
    let text = STUDY
        .replace(
            "kind = \"low-abc-smooth\"",
            "kind = \"utia\"\npath = \"a.bin\"",
        )
        .replace("budgets = [60, 150]", "budgets = [300]");
    fs::write(bench.path("c.toml"), text).unwrap();
    table(0.1);
    bench.good(&["run", "c.toml", "-q", "--shard", "1/2", "-o", "one"]);
    table(0.2);
    bench.good(&["run", "c.toml", "-q", "--shard", "2/2", "-o", "two"]);
    let refusal = bench.refused(&["merge", "one", "two", "-o", "no"], 3);
    assert!(
        refusal.contains("another material") && refusal.contains("one"),
        "{refusal}"
    );
    assert!(!bench.path("no").exists());
    // Made from the same: whatever else the folder held, and wherever the file is.
    let args = ["run", "c.toml", "-q", "--shard", "1/2", "-o", "one"];
    bench.good(
        &[
            &args[..],
            &["--set", "metrics={ pairs = 100, max_pairs = 1 }"],
        ]
        .concat(),
    );
    bench.good(&args);
    let output = bench.gonio(&["merge", "one", "two", "-o", "both"]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(
        stderr.contains("rows of other configs left out"),
        "{stderr}"
    );
    let refusal = bench.refused(&["merge", "one", "two", "-o", "both"], 2);
    assert!(refusal.contains("--force"), "{refusal}");
}

#[test]
fn a_crash_inside_a_character_is_gone_on_with() {
    let bench = bench();
    let text = STUDY.replace("alpha = 0.3", "alpha = 0.3\nname = \"café\"");
    fs::write(bench.path("c.toml"), text).unwrap();
    bench.good(&["run", "c.toml", "-q", "-o", "a"]);
    let files = bench.files("a");
    let rows = fs::read(bench.path("a/results.jsonl")).unwrap();
    let cut = rows.windows(2).rposition(|w| w == "é".as_bytes()).unwrap() + 1;
    fs::write(bench.path("a/results.jsonl"), &rows[..cut]).unwrap();
    bench.good(&["run", "c.toml", "-q", "-o", "a"]);
    assert_eq!(bench.read("a/results.csv").lines().count(), 1 + ROWS);
    assert_eq!(bench.files("a"), files);
}
