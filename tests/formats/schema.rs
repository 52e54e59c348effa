//! Every line that is written is what the JSON Schema says: the tests of round trips ask it of theirs.

use super::common::json_schema;
use gonio::measurement::measurement_schema;
use gonio::schedule::schedule_schema;
use serde_json::{Value, json};

fn valid(schema: &Value, value: &Value) -> Result<(), String> {
    json_schema::valid(schema, schema, value)
}

/// Checks every line of a text that was written.
pub fn check_lines(schema: &Value, text: &str) {
    for line in text.lines() {
        let value: Value = serde_json::from_str(line).unwrap();
        valid(schema, &value).unwrap_or_else(|e| panic!("{e}\n{line}"));
    }
}

#[test]
fn what_is_no_line_is_invalid() {
    let row = json!({
        "index": 1, "theta_i_deg": 1.0, "phi_i_deg": 2.0, "theta_o_deg": 3.0, "phi_o_deg": 4.0,
    });
    for schema in [schedule_schema(), measurement_schema()] {
        assert_eq!(valid(&schema, &row), Ok(()));
        for (key, bad) in [
            ("theta_i_deg", json!(90.0)),
            ("theta_o_deg", json!(-1.0)),
            ("phi_i_deg", json!(400.0)),
            ("phi_o_deg", Value::Null),
            ("index", json!(1.5)),
            ("block", json!("a")),
            ("light_deg", json!("far")),
            ("colour", json!(1.0)),
            ("seconds", json!(-1.0)),
        ] {
            let mut row = row.clone();
            row[key] = bad;
            assert!(valid(&schema, &row).is_err(), "{key}");
        }
        let mut short = row.clone();
        short.as_object_mut().unwrap().remove("phi_o_deg");
        assert!(valid(&schema, &short).is_err());
    }
    let mut value = row.clone();
    value["value"] = json!(0.5);
    assert_eq!(valid(&measurement_schema(), &value), Ok(()));
    assert!(valid(&schedule_schema(), &value).is_err());
}
