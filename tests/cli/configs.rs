//! What is refused, what is listed, what is shipped.

use super::Bench;
use gonio::registry::Entry;
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
    for command in ["run", "check"] {
        let refused = "
            2 | SET metrics.pears=3 | metrics.pears … allowed: pairs
            2 | SET material.7.alpha=1 | `7` … 0 to 1
            3 | SET material.1={kind=\"merl\",path=\"gone.binary\"} | gone.binary … No such file
            3 | SET material.1={kind=\"merl\",path=\"short.binary\"} | short.binary … 34992012
            3 | SET material.1={kind=\"merl\",path=\"tiny.binary\"} | tiny.binary … 2 bytes
            3 | SET material.1={kind=\"merl\",path=\"other.binary\"} | other.binary … 9, 90, 180 … 90, 90, 180
            3 | SET materials_dir=empty | empty … no MERL file … --set materials_dir=DIR
            3 | SET materials_dir=nowhere | nowhere … --set materials_dir=DIR";
        bench.does(&refused.replace("SET", &format!("{command} small.toml --set")));
    }
    bench.does(
        "2 | run small.toml -o file | gonio: file:
         2 | run small.toml -o file/below | gonio: file/below:
         2 | run nothing.toml | nothing.toml: cannot read this config
         2+ | run
         2+ | walk
         2+ | run small.toml --threads 0",
    );
    assert!(!bench.path("runs").exists());
}

#[test]
fn lists_name_every_member_of_every_registry() {
    let bench = Bench::new();
    let all = bench.good("list");
    let listed = bench.json("list --json");
    let listed = listed.as_array().unwrap();
    fn kinds<S: ?Sized>(entries: &[Entry<S>]) -> Vec<&'static str> {
        entries.iter().map(|e| e.kind).collect()
    }
    let measures = gonio::metrics::Measure::ALL.iter().map(|m| m.name());
    let formats = gonio::formats::all();
    let formats = formats.iter().map(|f| f.name);
    for (family, names) in [
        ("materials", kinds(&gonio::experiment::materials())),
        ("sample-sets", kinds(&gonio::schedule::all())),
        ("reconstructions", kinds(&gonio::reconstruct::all())),
        ("parametrizations", kinds(&gonio::parametrization::all())),
        ("warps", kinds(&gonio::parametrization::warps())),
        ("measures", measures.collect()),
        ("formats", formats.collect()),
    ] {
        let one = bench.good(format!("list {family}"));
        assert!(all.contains(&one), "{family}");
        let json = listed.iter().find(|f| f["family"] == family).unwrap();
        let json = json["members"].as_array().unwrap().iter();
        let json: Vec<_> = json.map(|m| m["name"].as_str().unwrap()).collect();
        assert_eq!(json, names, "{family}");
        for name in names {
            let listed = |text: &str| text.lines().any(|l| l.starts_with(&format!("  {name} ")));
            assert!(listed(&one), "{name} is not among the {family}:\n{one}");
        }
    }
    let version = bench.good("--version");
    assert_eq!(version.trim(), concat!("gonio ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn every_shipped_config_is_read_and_checked() {
    let bench = Bench::new();
    fs::create_dir(bench.path("materials")).unwrap();
    let tabulate = "tabulate small.toml --material ggx-0.4 -o materials/ggx.binary";
    bench.does(&format!(
        "0 | {tabulate}
         2 | {tabulate} | this file exists
         0 | {tabulate} --force
         2 | tabulate small.toml -o x.binary | allowed: one of lambert, ggx-0.4"
    ));
    assert_eq!(bench.read_bytes("materials/ggx.binary").len(), 34_992_012);
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
        let text = fs::read_to_string(&path).unwrap();
        let file = path.to_string_lossy();
        let has_no_budget = |kind| text.contains(&format!("\nexperiment = \"{kind}"));
        if ["moments", "relations"].into_iter().any(has_no_budget) {
            bench.good(format!("check {file}"));
            continue;
        }
        let small = match text.contains("\nminutes = ") {
            true => "--set budgets=[200] --set readings=[150] --set minutes=[3]",
            false => "--set budgets=[40]",
        };
        bench.good(format!("check {file} {small}"));
        count += 1;
    }
    assert!(count >= 3);
}
