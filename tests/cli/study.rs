//! `gonio run` of a study: it goes on where it was, in parts or whole, and ends the same.

use super::Bench;
use super::common::says;
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
    Bench::of(STUDY)
}

#[test]
fn a_study_goes_on_with_a_larger_question_and_back() {
    let bench = bench();
    let text = bench.good("run c.toml -q");
    assert!(text.starts_with("Which coordinates?"), "{text}");
    says(
        &text,
        "nrmse, cosine … nrmse, lobe … * best of its column … What explains",
    );
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
    // A larger question: the old rows are part of the answer.
    let here = "run c.toml -q -o runs/c";
    let more = "--set 'budgets=[60, 150, 300]'";
    bench.good(format!("{here} {more}"));
    let more = bench.read("runs/c/results.csv");
    assert_eq!(more.lines().count(), 1 + ROWS * 3 / 2);
    assert!(whole.lines().all(|l| more.contains(l)));
    // And back: rows of the larger question are kept, not shown.
    bench.good(here);
    assert_eq!(bench.read("runs/c/results.csv"), whole);
    let rows = bench.read("runs/c/results.jsonl");
    assert_eq!(rows.lines().count(), ROWS * 3 / 2);
    // --force makes them all again.
    bench.good("run c.toml -q --force");
    assert!(!bench.path("runs/c-2").exists());
    assert_eq!(bench.read("runs/c/results.jsonl").lines().count(), ROWS);
}

#[test]
fn a_part_may_be_missing_and_must_be_of_the_same_study() {
    let bench = bench();
    bench.good("run c.toml -q -o whole");
    for part in ["1/3", "2/3", "3/3"] {
        bench.good(format!("run c.toml -q --shard {part}"));
    }
    let parts = [1, 2, 3].map(|i| format!("runs/c.shard-{i}-of-3"));
    let [a, b, c] = parts.each_ref().map(String::as_str);
    // Without a part: what is there is there, and the exit code says that it is not all.
    bench.ends(format!("merge {a} {c} -o some"), 5);
    let rows = bench.read("some/results.csv").lines().count() - 1;
    assert!(0 < rows && rows < ROWS);
    assert_eq!(bench.manifest("some")["status"], "incomplete");
    // The missing part, put to it.
    bench.good(format!("merge {a} {b} {c} -o some --force"));
    let whole = bench.read("whole/results.csv");
    assert!(bench.read("some/results.csv") == whole);
    // Parts of something else.
    bench.good("run c.toml -q -o other --set 'metrics={ pairs = 100, max_pairs = 1 }'");
    bench.refuses(
        format!("merge {a} other -o no"),
        3,
        "other/config.toml … another config",
    );
    assert!(!bench.path("no").exists());
    bench.refuses("merge nowhere -o no", 3, "nowhere");
}

#[test]
fn acquisitions_and_studies_go_on_with_the_same_rows() {
    let bench = bench();
    let acquisition = STUDY.replace("\"study\"", "\"acquisition\"");
    // What an acquisition measures unasked.
    let none = acquisition.replace("budgets", "quantities = []\nbudgets");
    bench.write("a.toml", none);
    bench.good("run c.toml -q -o a");
    let before = bench.read("a/results.csv");
    bench.tells("run a.toml -q -o a", "ranking, lobe");
    assert_eq!(bench.read("a/results.csv"), before);
    // Another question of the same: its rows come after the old ones.
    bench.good("run small.toml -q -o a");
    assert_eq!(bench.rows("a").len(), ROWS + 128);
    assert_eq!(bench.read("a/results.csv").lines().count(), 1 + 128);
}

#[test]
#[ignore = "thorough: draws studies twice"]
fn materials_are_drawn_once() {
    let bench = bench();
    let small = "[pictures]\nresolution = 12\nsamples = 4\nbudget = 60\n";
    let text = STUDY.replace("[pictures]\ndraw = false\n", small);
    bench.write("c.toml", text);
    bench.good("run c.toml -q");
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
    bench.good("run c.toml -q");
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
    bench.write("c.toml", text);
    bench.good("run c.toml -q -o whole");
    for (part, folder) in [("1/2", "one"), ("2/2", "two")] {
        bench.good(format!("run c.toml -q --shard {part} -o {folder}"));
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
    bench.good("merge one two -o merged");
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
        bench.write("a.bin", bytes);
    };
    let text = STUDY
        .replace(
            "kind = \"low-abc-smooth\"",
            "kind = \"utia\"\npath = \"a.bin\"",
        )
        .replace("budgets = [60, 150]", "budgets = [300]");
    bench.write("c.toml", text);
    table(0.1);
    bench.good("run c.toml -q --shard 1/2 -o one");
    table(0.2);
    bench.good("run c.toml -q --shard 2/2 -o two");
    bench.refuses("merge one two -o no", 3, "another material … one");
    assert!(!bench.path("no").exists());
    // Made from the same: whatever else the folder held, and wherever the file is.
    let args = "run c.toml -q --shard 1/2 -o one";
    bench.good(format!(
        "{args} --set 'metrics={{ pairs = 100, max_pairs = 1 }}'"
    ));
    bench.good(args);
    let stderr = bench.ends("merge one two -o both", 0);
    says(&stderr, "rows of other configs left out");
    bench.refuses("merge one two -o both", 2, "--force");
}

#[test]
fn a_crash_inside_a_character_is_gone_on_with() {
    let bench = bench();
    let text = STUDY.replace("alpha = 0.3", "alpha = 0.3\nname = \"café\"");
    bench.write("c.toml", text);
    bench.good("run c.toml -q -o a");
    let files = bench.files("a");
    let rows = bench.read_bytes("a/results.jsonl");
    let cut = rows.windows(2).rposition(|w| w == "é".as_bytes()).unwrap() + 1;
    bench.write("a/results.jsonl", &rows[..cut]);
    bench.good("run c.toml -q -o a");
    assert_eq!(bench.read("a/results.csv").lines().count(), 1 + ROWS);
    assert_eq!(bench.files("a"), files);
}
