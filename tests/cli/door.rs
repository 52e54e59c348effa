//! The front door: what a newcomer types first, and what is said to a slip.

use super::Bench;
use std::fs;

/// A bench with a folder of two MERL tables.
fn tables() -> Bench {
    let bench = Bench::new();
    fs::create_dir(bench.path("brdfs")).unwrap();
    let written = ["tabulate", "small.toml", "--material", "ggx-0.4", "-o"];
    bench.good(&[&written[..], &["brdfs/satin.binary"]].concat());
    fs::copy(
        bench.path("brdfs/satin.binary"),
        bench.path("brdfs/twin.binary"),
    )
    .unwrap();
    bench
}

#[test]
fn tables_are_run_without_a_config() {
    let bench = tables();
    let small = ["--set", "budgets=[40]", "--set", "metrics.pairs=200", "-q"];
    let file = [&["run", "brdfs/satin.binary"], &small[..]].concat();
    bench.good(&file);
    let materials = |run: &str| {
        let mut names: Vec<_> = bench.rows(run).into_iter().map(|r| r.material).collect();
        names.dedup();
        names
    };
    assert_eq!(materials("runs/satin"), ["satin"]);
    let text = "configs/merl.toml";
    assert_eq!(bench.manifest("runs/satin")["inputs"][0]["path"], text);
    // It goes on where it was, is listed, and its config does the same again.
    let before = bench.read("runs/satin/results.jsonl");
    bench.good(&file);
    assert_eq!(bench.read("runs/satin/results.jsonl"), before);
    let listed = bench.good(&[&file[..], &["--list"]].concat());
    assert!(
        listed.contains("10 of 10 jobs are done in runs/satin"),
        "{listed}"
    );
    bench.good(&["run", "runs/satin/config.toml", "-o", "again", "-q"]);
    let ran = super::timeless_lines(&bench.read("again/results.jsonl"));
    assert_eq!(ran, super::timeless_lines(&before));

    let folder = [&["run", "brdfs", "--shard", "1/2"], &small[..]].concat();
    bench.good(&folder);
    bench.good(&[&["run", "brdfs", "-o", "both"], &small[..]].concat());
    assert_eq!(materials("both"), ["satin", "twin"]);
    assert!(bench.path("runs/brdfs.shard-1-of-2").is_dir());

    let checked = bench.good(&["check", "brdfs/twin.binary"]);
    assert!(
        checked.contains("twin") && !checked.contains("satin"),
        "{checked}"
    );
    let gone = bench.refused(&["run", "brdfs/gone.binary"], 3);
    assert!(
        gone.contains("gone.binary: cannot read this file"),
        "{gone}"
    );
    fs::create_dir(bench.path("empty")).unwrap();
    let empty = bench.refused(&["run", "empty"], 3);
    assert!(empty.contains("holds no MERL file"), "{empty}");
}
