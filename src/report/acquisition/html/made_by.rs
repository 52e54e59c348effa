//! The last section of a report: config, inputs and versions that made it.

use super::table;
use crate::error::listed;
use maud::{Markup, html};
use serde_json::Value;

/// The manifest as a table, its inputs with their hashes, and the config.
pub(super) fn section(manifest: &Value, resolved: &toml::Table) -> Markup {
    let fields = [
        ("gonio", "version"),
        ("status", "status"),
        ("rows", "rows of this run"),
        ("options", "options"),
        ("seeds", "seeds"),
        ("missing", "materials without a file"),
        ("failures", "failures"),
    ];
    let list = |key: &str| manifest[key].as_array().map_or(&[][..], Vec::as_slice);
    let config = toml::to_string(resolved).unwrap_or_default();
    html! {
        div.wide {
            table {
                tbody {
                    @for (key, name) in fields {
                        @let text = text(&manifest[key]);
                        @if !text.is_empty() {
                            tr { th scope="row" { (name) } td { (text) } }
                        }
                    }
                }
            }
        }
        @if !list("inputs").is_empty() {
            (table(Some("inputs"), "", ["input", "BLAKE3"], html! {
                tbody {
                    @for input in list("inputs") {
                        tr { td { (text(&input["path"])) } td { code { (text(&input["blake3"])) } } }
                    }
                }
            }))
        }
        details {
            summary { "The config with every default (config.toml)" }
            pre { (config) }
        }
    }
}

/// A value as people write it; nothing for what is empty.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Number(number) => match number.as_f64() {
            Some(n) if !number.is_u64() => format!("{n:.2}"),
            _ => number.to_string(),
        },
        Value::Array(list) => listed(list.iter().map(text)),
        Value::Object(fields) => listed(fields.iter().map(|(k, v)| format!("{k} {}", text(v)))),
        Value::Bool(truth) => truth.to_string(),
    }
}
