//! The arrows of the house: a module uses only what stands above it (see `docs::design`), and the
//! habits that can be read off the text.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the bottom of the house to its roof; each uses only earlier ones.
const ORDER: [&str; 20] = [
    "numeric",
    "statistics",
    "error",
    "files",
    "registry",
    "geometry",
    "sampling",
    "parametrization",
    "brdf",
    "lighting",
    "schedule",
    "measurement",
    "instrument",
    "reconstruct",
    "metrics",
    "moments",
    "analysis",
    "experiment",
    "report",
    "cli",
];

/// Every file below `dir` whose name ends so.
fn files(dir: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.to_str().unwrap().ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The text without comments and without unit tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let code = text.lines().filter(|l| !l.trim_start().starts_with("//"));
    code.collect::<Vec<_>>().join("\n")
}

#[test]
fn arrows_point_down() {
    let mut arrows = 0;
    for path in files(&source(), ".rs") {
        let inside = path.strip_prefix(source()).unwrap();
        let module = inside.iter().next().unwrap().to_str().unwrap();
        let module = module.trim_end_matches(".rs");
        if ["lib", "main", "docs"].contains(&module) {
            continue;
        }
        let place = |name: &str| ORDER.iter().position(|m| *m == name);
        let own = place(module).unwrap_or_else(|| panic!("{module} has no place in the house"));
        for used in code(&path).split("crate::").skip(1) {
            let used: String = used
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            // `crate::Error` is the crate's own error; `crate::{…}` would hide arrows.
            assert!(
                !used.is_empty(),
                "{}: write one use per module",
                inside.display()
            );
            if used == "Error" {
                continue;
            }
            let target = place(&used)
                .unwrap_or_else(|| panic!("{} uses {used}, which has no place", inside.display()));
            assert!(
                target <= own,
                "{} uses {used}, which stands above it",
                inside.display()
            );
            arrows += 1;
        }
    }
    assert!(
        arrows > 100,
        "only {arrows} arrows found: is the source still here?"
    );
}

#[test]
fn no_file_outgrows_its_purpose() {
    for path in files(&source(), ".rs") {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 600, "{} has {lines} lines", path.display());
    }
}

#[test]
fn nothing_is_left_undone() {
    // Put together here so that this file does not find itself.
    let words = ["todo", "unimplemented", "dbg"].map(|w| format!("{w}!"));
    for path in files(&source(), ".rs") {
        // Unit tests in files of their own: compiled for tests only.
        if path.ends_with("sampling/testing.rs") || path.ends_with("tests.rs") {
            continue;
        }
        let code = code(&path);
        for word in &words {
            assert!(!code.contains(word.as_str()), "{}: {word}", path.display());
        }
        assert!(!code.contains(".unwrap()"), "{} unwraps", path.display());
    }
}

#[test]
fn every_config_asks_a_question() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let mut configs = files(&configs, ".toml");
    // Instruments are no experiments.
    configs.retain(|path| {
        !path
            .parent()
            .is_some_and(|dir| dir.ends_with("instruments"))
    });
    assert!(configs.len() >= 2);
    for path in configs {
        let text = fs::read_to_string(&path).unwrap();
        assert!(
            text.lines().any(|l| l.starts_with("question = ")),
            "{}",
            path.display()
        );
    }
}
