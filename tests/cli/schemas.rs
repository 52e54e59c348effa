//! The schemas of configs and instrument files: what is shipped fits, what is misspelt does not.

use super::Bench;
use super::common::json_schema::valid;
use super::common::table;
use super::pages::of_repository;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// True if a value fits a schema.
fn fits(schema: &Value, value: &Value) -> bool {
    valid(schema, schema, value).is_ok()
}

fn read(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

/// The texts of every config of a folder.
fn texts(folder: &str) -> Vec<(PathBuf, String)> {
    let paths = fs::read_dir(of_repository(folder))
        .unwrap()
        .map(|e| e.unwrap().path());
    let files = paths.filter(|path| path.is_file());
    let read = |path: PathBuf| (path.clone(), fs::read_to_string(path).unwrap());
    files.map(read).collect()
}

/// A value with one item of each shape, which are keys and a kind, in place of many in its lists.
fn thinned(value: &Value) -> Value {
    match value {
        Value::Object(keys) => keys.iter().map(|(k, v)| (k.clone(), thinned(v))).collect(),
        Value::Array(items) => {
            let mut shapes = BTreeSet::new();
            let mut items: Vec<Value> = items.iter().map(thinned).collect();
            items.retain(|item| {
                let keys = item
                    .as_object()
                    .map(|o| o.keys().cloned().collect::<Vec<_>>());
                keys.is_none() || shapes.insert((keys, item["kind"].to_string()))
            });
            items.into()
        }
        other => other.clone(),
    }
}

/// A text with each of its keys written wrongly once; symbols of axes belong to a parametrization and
/// are not known to the schema.
fn misspelt(value: &Value) -> Vec<Value> {
    let mut all = Vec::new();
    match value {
        Value::Object(keys) => {
            for (key, inner) in keys {
                let mut with = |key_now: &str, value: Value| {
                    let mut wrong = keys.clone();
                    wrong.remove(key);
                    wrong.insert(key_now.into(), value);
                    all.push(Value::Object(wrong));
                };
                with(&format!("{key}q"), inner.clone());
                let axes = inner.as_object().filter(|_| key == "warp");
                let is_known = |wrong: &Value| {
                    axes.is_none_or(|axes| axes.keys().eq(wrong.as_object().unwrap().keys()))
                };
                for wrong in misspelt(inner).into_iter().filter(is_known) {
                    with(key, wrong);
                }
            }
        }
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                for inner in misspelt(item) {
                    let mut wrong = items.clone();
                    wrong[i] = inner;
                    all.push(Value::Array(wrong));
                }
            }
        }
        _ => {}
    }
    all
}

#[test]
fn schemas_fit_what_is_shipped_and_nothing_misspelt() {
    let bench = Bench::new();
    let schema = |of: &str| bench.json(format!("schema {of}"));
    let (config, instrument) = (schema("config"), schema("instrument"));
    let mut files = 0;
    for (schema, folder) in [
        (&config, "configs"),
        (&config, "configs/starters"),
        (&instrument, "configs/instruments"),
    ] {
        for (path, text) in texts(folder) {
            let value = read(&text);
            assert!(fits(schema, &value), "{}", path.display());
            for wrong in misspelt(&thinned(&value)) {
                assert!(!fits(schema, &wrong), "{}: {wrong}", path.display());
            }
            files += 1;
        }
    }
    assert!(files >= 14);
    // What a run resolves fits too.
    bench.good("run small.toml --seed 1 -o a -q");
    assert!(fits(&config, &read(&bench.read("a/config.toml"))));
    for [text, is] in table(
        r#"
        [[material]]\nkind = "sheen" | true
        [[material]]\nkind = "shen" | false
        [[material]]\nkind = "ggx"\nalpha = [0.1, 0.2] | true
        [metrics]\npairs = "many" | false
        [[material]]\nkind = "ggx"\nfresnel = { kind = "none", ior = 2 } | false
        [[material]]\nkind = "tabulated"\nof = { kind = "ggx", aplha = 1 } | false
        measures = ["lobe"] | true
        measures = ["lob"] | false
        band = "wide" | false
        channels = "rgb" | true
        channels = "wavelengths_nm" | false
        channels = { wavelengths_nm = [450, 550] } | true
        experiment = "relations"\nbudgets = [1] | false
        [merl]\ninterpolation = "cubic" | false
        [[parametrization]]\nkind = "hybrid"\nwarp = { h_bar = "root" } | false
        [[instrument]]\npreset = "utia"\norder = "sorted" | true
        [[instrument]]\npreset = "utia"\nordre = "sorted" | false"#,
    ) {
        let is: bool = is.parse().unwrap();
        assert_eq!(fits(&config, &read(text)), is, "{text}");
    }
}
