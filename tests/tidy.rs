//! The arrows of the house: a module uses only what stands above it (see `docs::design`), and the
//! habits that can be read off the text.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the bottom of the house to its roof; each uses only earlier ones.
const ORDER: &str = "\
    numeric statistics error files registry geometry sampling parametrization brdf light_paths lighting \
    schedule measurement instrument reconstruct metrics validation importance moments acquisition analysis formats \
    stability experiment report bench cli";

/// What stands outside the house: its doors, its pages, and the package for Python, which is a crate of its own.
const OUTSIDE: [&str; 4] = ["lib", "main", "docs", "python"];

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
    for Module { path, code } in modules() {
        let place = |name: &str| {
            let place = ORDER.split(' ').position(|m| m == name);
            place.unwrap_or_else(|| panic!("{path:?}: {name} has no place in the house"))
        };
        let own = place(&path[0]);
        for used in code.split("crate::").skip(1) {
            let end = used.find(|c: char| !c.is_alphanumeric() && c != '_');
            let used = &used[..end.unwrap_or(used.len())];
            // `crate::Error` is the crate's own error; `crate::{…}` would hide arrows.
            assert!(!used.is_empty(), "{path:?}: write one use per module");
            if used != "Error" {
                let is_below = place(used) <= own;
                assert!(is_below, "{path:?} uses {used}, which stands above it");
                arrows += 1;
            }
        }
    }
    assert!(
        arrows > 100,
        "only {arrows} arrows: is the source still here?"
    );
}

/// A module of the library and its code.
struct Module {
    /// `["experiment", "findings", "index"]`.
    path: Vec<String>,
    code: String,
}

/// Every module of the library.
fn modules() -> Vec<Module> {
    let all = files(&source(), ".rs");
    let module = |file: &PathBuf| {
        let inside = file.strip_prefix(source()).unwrap().with_extension("");
        let parts = inside.iter().map(|p| p.to_str().unwrap().to_owned());
        let mut path: Vec<String> = parts.collect();
        if path.last().is_some_and(|p| p == "mod") {
            path.pop();
        }
        let code = code(file);
        Module { path, code }
    };
    let of_library = |m: &Module| !OUTSIDE.contains(&m.path[0].as_str());
    all.iter().map(module).filter(of_library).collect()
}

/// The paths of a `use` tree, one an item: `a::{b, c::D}` is `a::b` and `a::c::D`.
fn leaves(tree: &str) -> Vec<Vec<String>> {
    let Some((head, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        return vec![path.split("::").map(|p| p.trim().to_owned()).collect()];
    };
    let body = rest.trim_end().trim_end_matches('}');
    let (mut depth, mut item, mut items) = (0, String::new(), Vec::new());
    for c in body.chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => items.push(std::mem::take(&mut item)),
            _ => {}
        }
        if c != ',' || depth > 0 {
            item.push(c);
        }
    }
    items.push(item);
    let items = items.iter().filter(|i| !i.trim().is_empty());
    let inner = items.flat_map(|i| leaves(&format!("{head}{}", i.trim())));
    inner.collect()
}

/// Every path that a module imports or passes on, from the root of the library; `true` of those it
/// passes on.
fn imports(module: &Module) -> Vec<(Vec<String>, bool)> {
    let mut found = Vec::new();
    let text = module.code.replace('\n', " ");
    for (at, _) in text.match_indices("use ") {
        let before = text[..at].trim_end();
        let Some(end) = text[at..].find(';') else {
            continue;
        };
        let passes_on = before.ends_with("pub") || before.ends_with(')');
        if !(passes_on || before.is_empty() || before.ends_with([';', '}', '{', ']'])) {
            continue;
        }
        for path in leaves(&text[at + 4..at + end]) {
            let mut base = module.path.clone();
            let mut rest = &path[..];
            match rest[0].as_str() {
                "crate" => {
                    base.clear();
                    rest = &rest[1..];
                }
                "self" => rest = &rest[1..],
                _ => {
                    while rest.first().is_some_and(|p| p == "super") {
                        base.pop();
                        rest = &rest[1..];
                    }
                }
            }
            base.extend_from_slice(rest);
            found.push((base, passes_on));
        }
    }
    found
}

/// The arrows between modules: who uses what of whom, where names that a door passes on lead to the
/// module that has them. A module and the modules inside it are one house: their arrows are left out.
/// So are those of a registry's `all()` to its members.
fn arrows(modules: &[Module]) -> Vec<Vec<usize>> {
    let place = |path: &[String]| modules.iter().position(|m| m.path == path);
    // The module a path leads into, and what is left of the path.
    let enter = |path: &[String]| {
        let lengths = (1..=path.len()).rev();
        let mut found = lengths.filter_map(|n| Some((place(&path[..n])?, path[n..].to_vec())));
        found.next()
    };
    let all: Vec<Vec<(Vec<String>, bool)>> = modules.iter().map(imports).collect();
    let passed = |at: usize| all[at].iter().filter(|(_, on)| *on).map(|(path, _)| path);
    let follow = |path: &[String]| {
        let (mut at, mut rest) = enter(path)?;
        for _ in 0..8 {
            let Some(name) = rest.first() else {
                break;
            };
            let is_of = |path: &&Vec<String>, name: &str| path.last().is_some_and(|l| l == name);
            // All that another door passes on.
            let doors = passed(at).filter(|path| is_of(path, "*"));
            let doors = doors.filter_map(|path| place(&path[..path.len() - 1]));
            let mut names = passed(at).chain(doors.flat_map(passed));
            let Some(next) = names.find(|path| is_of(path, name)) else {
                break;
            };
            let next = enter(next)?;
            if next.0 == at {
                break;
            }
            (at, rest) = next;
        }
        Some(at)
    };
    let mut arrows = Vec::new();
    for (i, module) in modules.iter().enumerate() {
        let has_all = module.code.contains("pub fn all()");
        let mut targets = Vec::new();
        for (path, passes_on) in &all[i] {
            let Some(target) = follow(path).filter(|t| *t != i && !passes_on) else {
                continue;
            };
            let other = &modules[target];
            let [ours, theirs] = [&module.path, &other.path];
            let one_house = theirs.starts_with(ours) || ours.starts_with(theirs);
            let declares = ["Entry<", "declare! {", "formula! {", "file_table! {"];
            let member = has_all && declares.iter().any(|d| other.code.contains(d));
            if !one_house && !member {
                targets.push(target);
            }
        }
        arrows.push(targets);
    }
    arrows
}

#[test]
fn no_modules_form_a_circle() {
    let modules = modules();
    let arrows = arrows(&modules);
    assert!(arrows.iter().map(Vec::len).sum::<usize>() > 500);
    // Leaves are taken away until none is left; what stays is part of a circle or leads into one.
    let mut left: Vec<usize> = (0..modules.len()).collect();
    loop {
        let free = |&m: &usize| !arrows[m].iter().any(|t| left.contains(t));
        let (gone, stay): (Vec<usize>, Vec<usize>) = left.iter().partition(|m| free(m));
        left = stay;
        if gone.is_empty() {
            break;
        }
    }
    let names: Vec<_> = left.iter().map(|&m| modules[m].path.join("::")).collect();
    assert!(
        names.is_empty(),
        "a circle, or what leads into one: {names:?}"
    );
}

#[test]
fn no_file_outgrows_its_purpose_or_is_left_undone() {
    // Put together here so that this file does not find itself.
    let macros = ["todo", "unimplemented", "dbg"].map(|word| format!("{word}!"));
    let words = [&macros[..], &[".unwrap()".to_owned()]].concat();
    for path in files(&source(), ".rs") {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 600, "{} has {lines} lines", path.display());
        // Unit tests in files of their own: compiled for tests only.
        if path.ends_with("tests.rs") {
            continue;
        }
        let code = code(&path);
        for word in &words {
            assert!(!code.contains(word.as_str()), "{}: {word}", path.display());
        }
    }
}

#[test]
fn every_config_asks_a_question() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let mut configs = files(&configs, ".toml");
    // Instruments are no experiments.
    configs.retain(|path| !path.parent().unwrap().ends_with("instruments"));
    assert!(configs.len() >= 2);
    for path in configs {
        let text = fs::read_to_string(&path).unwrap();
        let asks = text.lines().any(|line| line.starts_with("question = "));
        assert!(asks, "{}", path.display());
    }
}
