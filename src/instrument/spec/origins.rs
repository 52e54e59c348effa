//! The provenance of each number of a preset.

use super::{InstrumentSpec, Provenance};
use toml::{Table, Value};

impl InstrumentSpec {
    /// Every numeric key, defaults filled in, with the first entry of the provenance that is about
    /// it. Elements of lists are called by their name, or by their position from 0:
    /// `axis.ring.min_deg`, `limits.collision.0.angle_min_deg`.
    pub fn origins(&self) -> Vec<(String, Option<&Provenance>)> {
        let mut keys = Vec::new();
        // Structs of numbers, strings and tables: serialization cannot fail on them.
        if let Ok(mut root) = Table::try_from(self) {
            root.remove("provenance");
            numbers("", &Value::Table(root), &mut keys);
        }
        let origin = |key: String| {
            let about = |entry: &&Provenance| entry.fields.iter().any(|field| fits(field, &key));
            let entry = self.provenance.iter().find(about);
            (key, entry)
        };
        keys.into_iter().map(origin).collect()
    }
}

/// True if a field is about a key; each `*` stands for one name.
fn fits(field: &str, key: &str) -> bool {
    let (field, key): (Vec<_>, Vec<_>) = (field.split('.').collect(), key.split('.').collect());
    field.len() == key.len() && field.iter().zip(&key).all(|(f, k)| *f == "*" || f == k)
}

/// Appends the paths of numbers and of vectors.
fn numbers(path: &str, value: &Value, keys: &mut Vec<String>) {
    let below = |name: &str| match path {
        "" => name.to_owned(),
        _ => format!("{path}.{name}"),
    };
    let number = |v: &Value| v.is_integer() || v.is_float();
    match value {
        Value::Array(items) if items.iter().all(number) => keys.push(path.to_owned()),
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                let name = item.get("name").and_then(Value::as_str);
                let name = name.map_or_else(|| i.to_string(), String::from);
                numbers(&below(&name), item, keys);
            }
        }
        Value::Table(table) => {
            for (name, value) in table {
                numbers(&below(name), value, keys);
            }
        }
        v if number(v) => keys.push(path.to_owned()),
        _ => {}
    }
}
