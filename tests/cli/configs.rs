//! What is refused, what is listed, what is shipped.

use super::Bench;
use super::common::{self, Level, levels};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

#[test]
fn bad_input_is_refused_in_a_sentence_and_leaves_nothing() {
    let bench = Bench::new();
    bench.write("file", "");
    fs::create_dir(bench.path("empty")).unwrap();
    bench.write("short.binary", [90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0, 1]);
    bench.write("tiny.binary", [1, 2]);
    bench.write("other.binary", [9, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0]);
    let table = "
        2 | metrics.pears=3 | metrics.pears … allowed: pairs
        2 | budgets=[0] | budgets[0] = 0 … allowed is a whole number from 1
        2 | budgets=many | budgets … \"many\" … a list
        2 | material.1.alpha=-1.5 | material[1].alpha = -1.5 … allowed is
        2 | material.1.alpha=nan | material[1].alpha = NaN … allowed is
        2 | material.1.alpha=wide | material[1].alpha = \"wide\" … allowed is
        2 | material.7.alpha=1 | `7` … 0 to 1
        3 | material.1={kind=\"merl\",path=\"gone.binary\"} | gone.binary … No such file
        3 | material.1={kind=\"merl\",path=\"short.binary\"} | short.binary … 34992012
        3 | material.1={kind=\"merl\",path=\"tiny.binary\"} | tiny.binary … 2 bytes
        3 | material.1={kind=\"merl\",path=\"other.binary\"} | other.binary … 9, 90, 180 … 90, 90, 180
        3 | materials_dir=empty | empty … no MERL file … --set materials_dir=DIR
        3 | materials_dir=nowhere | nowhere … --set materials_dir=DIR";
    for command in ["run", "check"] {
        for [code, set, parts] in common::table(table) {
            let line = format!("{command} small.toml --set {set}");
            bench.refuses(line, code.parse().unwrap(), parts);
        }
    }
    for folder in ["file", "file/below"] {
        let sentence = bench.refused(format!("run small.toml -o {folder}"), 2);
        assert!(
            sentence.starts_with(&format!("gonio: {folder}: ")),
            "{sentence}"
        );
    }
    bench.refuses(
        "run nothing.toml",
        2,
        "nothing.toml: cannot read this config",
    );
    assert!(!bench.path("runs").exists());
    for usage in ["run", "walk", "run small.toml --threads 0"] {
        bench.ends(usage, 2);
    }
}

#[test]
fn lists_name_every_member_of_every_registry() {
    let bench = Bench::new();
    let all = bench.good("list");
    let mut names: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut add = |family, list: Vec<&str>| {
        names.insert(family, list.into_iter().map(String::from).collect());
    };
    add(
        "materials",
        gonio::experiment::materials()
            .iter()
            .map(|e| e.kind)
            .collect(),
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
            .map(|e| e.kind)
            .collect(),
    );
    add(
        "warps",
        gonio::parametrization::warps()
            .iter()
            .map(|e| e.kind)
            .collect(),
    );
    add(
        "measures",
        gonio::metrics::Measure::ALL
            .iter()
            .map(|m| m.name())
            .collect(),
    );
    add(
        "formats",
        gonio::formats::all().iter().map(|f| f.name).collect(),
    );
    for (family, names) in names {
        let one = bench.good(format!("list {family}"));
        assert!(all.contains(&one), "{family}");
        for name in names {
            let listed = |text: &str| text.lines().any(|l| l.starts_with(&format!("  {name} ")));
            assert!(listed(&one), "{name} is not among the {family}:\n{one}");
        }
    }
    let version = bench.good("--version");
    assert_eq!(version.trim(), concat!("gonio ", env!("CARGO_PKG_VERSION")));
}

levels! {
    every_shipped_config_is_read_and_checked: "thorough: each of them runs";
}

/// And runs, on a small budget, if there is time.
fn every_shipped_config_is_read_and_checked(level: Level) {
    let bench = Bench::new();
    let material = "--material ggx-0.4";
    let output = "-o materials/ggx.binary";
    fs::create_dir(bench.path("materials")).unwrap();
    let tabulate = format!("tabulate small.toml {material} {output}");
    bench.good(&tabulate);
    bench.refuses(&tabulate, 2, "this file exists");
    bench.good(format!("{tabulate} --force"));
    assert_eq!(
        fs::metadata(bench.path("materials/ggx.binary"))
            .unwrap()
            .len(),
        34_992_012
    );
    bench.refuses(
        "tabulate small.toml -o x.binary",
        2,
        "allowed: one of lambert, ggx-0.4",
    );

    // Materials that configs name, one of each list.
    for named in ["alum-bronze", "gold-metallic-paint3"] {
        let copy = bench.path(&format!("materials/{named}.binary"));
        fs::copy(bench.path("materials/ggx.binary"), copy).unwrap();
    }
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let mut count = 0;
    for entry in fs::read_dir(configs).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            // Instruments, which configs name.
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).unwrap();
        assert!(
            text.starts_with("# ") && text.contains("\nquestion = "),
            "{name} asks"
        );
        let file = path.to_string_lossy();
        if text.contains("\nexperiment = \"moments") || text.contains("\nexperiment = \"relations")
        {
            // Without a budget; run in `moment_study`.
            bench.good(format!("check {file}"));
            continue;
        }
        let mut small = "--set budgets=[40]".to_owned();
        if text.contains("\nminutes = ") {
            small = "--set readings=[40] --set minutes=[3]".into();
        }
        bench.good(format!("check {file} {small}"));
        count += 1;
        // Studies take all of their materials, however few readings: the surfaces of one take half an hour.
        if level == Level::Quick || text.contains("\nexperiment = ") {
            continue;
        }
        small += " --set metrics={pairs=200,max_pairs=1} -q";
        bench.good(format!("run {file} -o {name} {small}"));
        assert_eq!(bench.manifest(&name)["status"], "complete", "{name}");
    }
    assert!(count >= 3);
    if level == Level::Quick {
        return;
    }
    // Of the files that were read, the hash is kept.
    let inputs = &bench.manifest("merl")["inputs"];
    let paths: Vec<_> = inputs
        .as_array()
        .unwrap()
        .iter()
        .map(|i| &i["path"])
        .collect();
    assert!(paths.contains(&&"materials/ggx.binary".into()), "{paths:?}");
}
