//! `gonio run` of a study: it goes on where it was, in parts or whole, and ends the same.

use super::Bench;

/// A study that takes a moment.
const STUDY: &str = r#"
question = "Which coordinates?"
experiment = "study"
budgets = [60, 150]
material = [{ kind = "ggx", alpha = 0.3 }, { kind = "low-abc-smooth" }]
parametrization = [{ kind = "half-difference" }, { kind = "hybrid" }]
sample_set = [{ kind = "grid" }]
reconstruction = [{ kind = "multilinear" }, { kind = "inverse-distance" }]
coordinates = [{ kind = "own" }, { kind = "spherical" }]
metrics = { pairs = 200, max_pairs = 1 }
pictures = { draw = false }
"#;

/// 2 materials × 2 parametrizations × 2 budgets × 3 reconstructions × 2 measures.
const ROWS: usize = 48;

fn bench() -> Bench {
    Bench::of(STUDY)
}

#[test]
fn a_study_goes_on_with_a_larger_question_and_back() {
    let bench = bench();
    let parts = "nrmse, cosine … nrmse, lobe … * best of its column … What explains";
    let text = bench.tells("run c.toml -q", parts);
    assert!(text.starts_with("Which coordinates?"), "{text}");
    let whole = bench.read("runs/c/results.csv");
    assert_eq!(whole.lines().count(), 1 + ROWS);
    for name in ["config.toml", "report.html", "results.jsonl"] {
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
    let [a, b, c] = [1, 2, 3].map(|i| format!("runs/c.shard-{i}-of-3"));
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
    bench.does(&format!(
        "0 | run c.toml -q -o other --set metrics.pairs=100
         3 | merge {a} other -o no | other/config.toml … another config
         3 | merge nowhere -o no | nowhere"
    ));
}
