//! What is refused, what is listed, what is shipped.

use super::Bench;
use super::common::{Level, levels};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

#[test]
fn bad_input_is_refused_in_a_sentence_and_leaves_nothing() {
    let bench = Bench::new();
    fs::write(bench.path("file"), "").unwrap();
    fs::create_dir(bench.path("empty")).unwrap();
    fs::write(
        bench.path("short.binary"),
        [90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0, 1],
    )
    .unwrap();
    fs::write(bench.path("tiny.binary"), [1, 2]).unwrap();
    fs::write(
        bench.path("other.binary"),
        [9, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0],
    )
    .unwrap();
    let merl = |path| format!("material.1={{kind=\"merl\",path=\"{path}\"}}");
    let (gone, short) = (merl("gone.binary"), merl("short.binary"));
    let (tiny, other) = (merl("tiny.binary"), merl("other.binary"));
    // (override, exit code, what the sentence says)
    let cases: [(&str, i32, &[&str]); 14] = [
        ("metrics.pears=3", 2, &["metrics.pears", "allowed: pairs"]),
        (
            "budgets=[0]",
            2,
            &["budgets[0] = 0", "allowed is a whole number from 1"],
        ),
        ("budgets=many", 2, &["budgets", "\"many\"", "a list"]),
        (
            "material.1.alpha=0",
            2,
            &["material[1].alpha = 0", "allowed is"],
        ),
        (
            "material.1.alpha=-1.5",
            2,
            &["material[1].alpha = -1.5", "allowed is"],
        ),
        (
            "material.1.alpha=nan",
            2,
            &["material[1].alpha = NaN", "allowed is"],
        ),
        (
            "material.1.alpha=wide",
            2,
            &["material[1].alpha = \"wide\"", "allowed is"],
        ),
        ("material.7.alpha=1", 2, &["`7`", "0 to 1"]),
        (&gone, 3, &["gone.binary", "No such file"]),
        (&short, 3, &["short.binary", "34992012"]),
        (&tiny, 3, &["tiny.binary", "2 bytes"]),
        (&other, 3, &["other.binary", "9, 90, 180", "90, 90, 180"]),
        (
            "materials_dir=empty",
            3,
            &["empty", "no MERL file", "--set materials_dir=DIR"],
        ),
        (
            "materials_dir=nowhere",
            3,
            &["nowhere", "--set materials_dir=DIR"],
        ),
    ];
    for (set, code, says) in cases {
        for command in ["run", "check"] {
            let sentence = bench.refused(&[command, "small.toml", "--set", set], code);
            for part in says {
                assert!(
                    sentence.contains(part),
                    "{set}: {part} is not in: {sentence}"
                );
            }
        }
    }
    for folder in ["file", "file/below"] {
        let sentence = bench.refused(&["run", "small.toml", "-o", folder], 2);
        assert!(
            sentence.starts_with(&format!("gonio: {folder}: ")),
            "{sentence}"
        );
    }
    let sentence = bench.refused(&["run", "nothing.toml"], 2);
    assert!(
        sentence.contains("nothing.toml: cannot read this config"),
        "{sentence}"
    );
    assert!(!bench.path("runs").exists());
    for usage in [
        &["run"][..],
        &["walk"],
        &["run", "small.toml", "--threads", "0"],
    ] {
        assert_eq!(bench.gonio(usage).status.code(), Some(2), "{usage:?}");
    }
}

#[test]
fn lists_name_every_member_of_every_registry() {
    let bench = Bench::new();
    let all = bench.good(&["list"]);
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
        let one = bench.good(&["list", family]);
        assert!(all.contains(&one), "{family}");
        for name in names {
            let listed = |text: &str| text.lines().any(|l| l.starts_with(&format!("  {name} ")));
            assert!(listed(&one), "{name} is not among the {family}:\n{one}");
        }
    }
    let version = bench.good(&["--version"]);
    assert_eq!(version.trim(), concat!("gonio ", env!("CARGO_PKG_VERSION")));
}

levels! {
    every_shipped_config_is_read_and_checked: "thorough: each of them runs";
}

/// And runs, on a small budget, if there is time.
fn every_shipped_config_is_read_and_checked(level: Level) {
    let bench = Bench::new();
    let material = ["--material", "ggx-0.4"];
    let output = ["-o", "materials/ggx.binary"];
    fs::create_dir(bench.path("materials")).unwrap();
    let tabulate = [&["tabulate", "small.toml"], &material[..], &output[..]].concat();
    bench.good(&tabulate);
    assert!(bench.refused(&tabulate, 2).contains("this file exists"));
    bench.good(&[&tabulate[..], &["--force"]].concat());
    assert_eq!(
        fs::metadata(bench.path("materials/ggx.binary"))
            .unwrap()
            .len(),
        34_992_012
    );
    let sentence = bench.refused(&["tabulate", "small.toml", "-o", "x.binary"], 2);
    assert!(
        sentence.contains("allowed: one of lambert, ggx-0.4"),
        "{sentence}"
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
            bench.good(&["check", &file]);
            continue;
        }
        let mut small = vec!["--set", "budgets=[40]"];
        if text.contains("\nminutes = ") {
            small = vec!["--set", "readings=[40]", "--set", "minutes=[3]"];
        }
        bench.good(&[&["check", &file], &small[..]].concat());
        count += 1;
        // Studies take all of their materials, however few readings: the surfaces of one take half an hour.
        if level == Level::Quick || text.contains("\nexperiment = ") {
            continue;
        }
        small.extend(["--set", "metrics={ pairs = 200, max_pairs = 1 }", "-q"]);
        bench.good(&[&["run", &file, "-o", &name], &small[..]].concat());
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
