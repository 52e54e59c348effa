//! Every line that is written is what the JSON Schema says.

use super::measurements::{about, measured, text as measurement_text};
use super::{backwards, kinds, schedules, text};
use gonio::measurement::measurement_schema;
use gonio::schedule::{ScheduleFormat, Sequence, schedule_schema};
use serde_json::{Value, json};

/// Checks a value against the part of JSON Schema that ours use; anything else panics.
fn valid(schema: &Value, value: &Value) -> Result<(), String> {
    let mut left = Vec::new();
    for (key, rule) in schema.as_object().unwrap() {
        match key.as_str() {
            "$schema" | "title" | "description" | "format" => {}
            "oneOf" => {
                let all = rule.as_array().unwrap();
                let results: Vec<_> = all.iter().map(|s| valid(s, value)).collect();
                if results.iter().filter(|r| r.is_ok()).count() != 1 {
                    return Err(format!("{results:?}"));
                }
            }
            "type" => {
                let types = match rule {
                    Value::Array(types) => types.clone(),
                    one => vec![one.clone()],
                };
                let is = |t: &Value| match t.as_str().unwrap() {
                    "object" => value.is_object(),
                    "number" => value.is_number(),
                    "integer" => value.is_u64() || value.is_i64(),
                    "string" => value.is_string(),
                    "null" => value.is_null(),
                    other => panic!("type {other}"),
                };
                if !types.iter().any(is) {
                    return Err(format!("{value} is no {rule}"));
                }
            }
            "minimum" | "maximum" | "exclusiveMaximum" => {
                let Some(x) = value.as_f64() else { continue };
                let limit = rule.as_f64().unwrap();
                let good = match key.as_str() {
                    "minimum" => x >= limit,
                    "maximum" => x <= limit,
                    _ => x < limit,
                };
                if !good {
                    return Err(format!("{x}: {key} {limit}"));
                }
            }
            "required" => {
                for name in rule.as_array().unwrap() {
                    if value.get(name.as_str().unwrap()).is_none() {
                        return Err(format!("{name} is missing"));
                    }
                }
            }
            "properties" | "patternProperties" | "additionalProperties" => left.push(key.as_str()),
            other => panic!("{other} is not checked"),
        }
    }
    let Some(object) = value.as_object().filter(|_| !left.is_empty()) else {
        return Ok(());
    };
    for (name, cell) in object {
        let mut known = false;
        if let Some(rule) = schema["properties"].get(name) {
            valid(rule, cell)?;
            known = true;
        }
        for (pattern, rule) in schema["patternProperties"]
            .as_object()
            .into_iter()
            .flatten()
        {
            // The only patterns are an ending, and a decimal between a start and an ending.
            let ending = pattern.strip_suffix('$').unwrap();
            let fits = match ending.split_once("[0-9.]+") {
                None => name.ends_with(ending),
                Some((start, ending)) => {
                    let start = start.strip_prefix('^').unwrap();
                    let rest = name.strip_prefix(start);
                    let number = rest.and_then(|rest| rest.strip_suffix(ending));
                    number.is_some_and(|n| !n.is_empty() && n.parse::<f64>().is_ok())
                }
            };
            if fits {
                valid(rule, cell)?;
                known = true;
            }
        }
        if !known && schema["additionalProperties"] == json!(false) {
            return Err(format!("{name} is not known"));
        }
    }
    Ok(())
}

fn check_lines(schema: &Value, text: &str) {
    for line in text.lines() {
        let value: Value = serde_json::from_str(line).unwrap();
        valid(schema, &value).unwrap_or_else(|e| panic!("{e}\n{line}"));
    }
}

#[test]
fn every_line_is_valid() {
    let (of_schedule, of_measurement) = (schedule_schema(), measurement_schema());
    for schedule in schedules() {
        let json = ScheduleFormat::JsonLines;
        check_lines(&of_schedule, &text(&schedule, None, json));
        let itinerary = backwards(&schedule);
        check_lines(&of_schedule, &text(&schedule, Some(&itinerary), json));
        for channels in kinds() {
            for details in [false, true] {
                let (m, itinerary) = measured(schedule.clone(), channels.clone(), details);
                let about = about(&m, &itinerary);
                for sequence in [Sequence::Generated, Sequence::Visits(&itinerary)] {
                    check_lines(
                        &of_measurement,
                        &measurement_text(&m, &about, sequence, json),
                    );
                }
            }
        }
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
