//! The README keeps its promises: its commands run, and print the numbers beside them.

use super::Bench;
use std::fs;
use std::path::Path;

/// The repository.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_readme_shows_what_the_quickstart_prints() {
    let bench = Bench::new();
    let config = root().join("configs/quickstart.toml");
    let printed = bench.good(&["run", config.to_str().unwrap(), "-o", "quickstart"]);
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let (_, block) = readme.split_once("```text\n").unwrap();
    let (block, _) = block.split_once("```").unwrap();
    let shown: Vec<&str> = block
        .lines()
        .filter(|l| !l.is_empty() && *l != "…")
        .collect();
    assert!(shown.len() > 10, "the README's block is gone");
    for line in shown {
        assert!(
            printed.lines().any(|l| l == line),
            "not printed today: {line}"
        );
    }
}

#[test]
fn the_readmes_commands_run() {
    let bench = Bench::new();
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let mut commands = 0;
    for line in readme.lines().filter(|l| l.starts_with("gonio ")) {
        let line = line.replace("configs/", &format!("{}/configs/", root().display()));
        let args: Vec<&str> = line.split_whitespace().skip(1).collect();
        bench.good(&args);
        commands += 1;
    }
    assert!(commands >= 3, "the README's commands are gone");
    for file in ["poses.csv", "ggx.binary", "out/results.csv"] {
        assert!(bench.path(file).exists(), "{file}");
    }
}
