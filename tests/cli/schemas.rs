//! The schemas of configs and instrument files: what is shipped fits, what is misspelt does not.

use super::Bench;
use super::common::json_schema::valid;
use super::common::table;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// True if a value fits a schema.
fn fits(schema: &Value, value: &Value) -> bool {
    valid(schema, schema, value).is_ok()
}

fn read(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

/// The texts of every config of a folder.
fn texts(folder: &str) -> Vec<(PathBuf, String)> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let paths = fs::read_dir(dir).unwrap().map(|e| e.unwrap().path());
    let files = paths.filter(|path| path.is_file());
    let read = |path: PathBuf| (path.clone(), fs::read_to_string(path).unwrap());
    files.map(read).collect()
}

/// A text with each of its keys written wrongly once; symbols of axes belong to a parametrization and
/// are not known to the schema.
fn misspelt(value: &Value) -> Vec<Value> {
    match value {
        Value::Object(keys) => {
            let mut all = Vec::new();
            for (key, inner) in keys {
                let mut wrong = keys.clone();
                let taken = wrong.remove(key).unwrap();
                wrong.insert(format!("{key}q"), taken);
                all.push(Value::Object(wrong));
                let axes = |inner: &&Value| key == "warp" && inner.is_object();
                let inner: Vec<Value> = match Some(inner).filter(axes) {
                    Some(axes) => misspelt(axes)
                        .into_iter()
                        .filter(|w| same_keys(w, axes))
                        .collect(),
                    None => misspelt(inner),
                };
                for inner in inner {
                    let mut wrong = keys.clone();
                    wrong.insert(key.clone(), inner);
                    all.push(Value::Object(wrong));
                }
            }
            all
        }
        Value::Array(items) => {
            let mut all = Vec::new();
            for (i, item) in items.iter().enumerate() {
                for inner in misspelt(item) {
                    let mut wrong = items.clone();
                    wrong[i] = inner;
                    all.push(Value::Array(wrong));
                }
            }
            all
        }
        _ => Vec::new(),
    }
}

fn same_keys(a: &Value, b: &Value) -> bool {
    let keys = |value: &Value| -> Vec<String> {
        let keys = value.as_object().unwrap().keys();
        keys.cloned().collect()
    };
    keys(a) == keys(b)
}

#[test]
fn schemas_fit_what_is_shipped_and_nothing_misspelt() {
    let bench = Bench::new();
    let schema =
        |of: &str| -> Value { serde_json::from_str(&bench.good(format!("schema {of}"))).unwrap() };
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
            for wrong in misspelt(&value) {
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
