//! `gonio run` of a study: it goes on where it was.

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

#[test]
fn a_study_goes_on_with_a_larger_question_and_back() {
    let bench = Bench::of(STUDY);
    let parts = "nrmse, cosine … nrmse, lobe … * best of its column … What explains";
    let text = bench.tells("run c.toml -q", parts);
    assert!(text.starts_with("Which coordinates?"), "{text}");
    let whole = bench.read("runs/c/results.csv");
    assert_eq!(whole.lines().count(), 1 + ROWS);
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
