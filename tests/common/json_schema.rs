//! The part of JSON Schema that ours use; anything else panics.

use serde_json::Value;

/// Checks a value against a schema, whose references are to places of `root`.
pub fn valid(root: &Value, schema: &Value, value: &Value) -> Result<(), String> {
    let fits = |rule: &Value, value: &Value| valid(root, rule, value);
    let list = |rule: &Value| {
        rule.as_array()
            .cloned()
            .unwrap_or_else(|| vec![rule.clone()])
    };
    let object = value.as_object();
    for (key, rule) in schema.as_object().unwrap() {
        let good = match key.as_str() {
            "$schema" | "$defs" | "title" | "description" | "format" => true,
            "properties" | "patternProperties" => true,
            "$ref" => {
                let pointer = rule.as_str().unwrap().trim_start_matches('#');
                fits(root.pointer(pointer).unwrap(), value).is_ok()
            }
            "anyOf" => list(rule).iter().any(|one| fits(one, value).is_ok()),
            "oneOf" => {
                list(rule)
                    .iter()
                    .filter(|one| fits(one, value).is_ok())
                    .count()
                    == 1
            }
            "const" => rule == value,
            "enum" => list(rule).contains(value),
            "type" => list(rule).iter().any(|of| match of.as_str().unwrap() {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "integer" => value.is_i64() || value.is_u64(),
                "number" => value.is_number(),
                "null" => value.is_null(),
                other => panic!("type {other}"),
            }),
            "minimum" => value.as_f64().is_none_or(|x| x >= rule.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|x| x <= rule.as_f64().unwrap()),
            "exclusiveMaximum" => value.as_f64().is_none_or(|x| x < rule.as_f64().unwrap()),
            "required" => {
                let has = |name: &Value| value.get(name.as_str().unwrap()).is_some();
                object.is_none() || list(rule).iter().all(has)
            }
            "minProperties" => object.is_none_or(|o| o.len() as u64 >= rule.as_u64().unwrap()),
            "items" => {
                let items = value.as_array().into_iter().flatten();
                items.into_iter().all(|item| fits(rule, item).is_ok())
            }
            "additionalProperties" => {
                let others = object.into_iter().flatten();
                let mut others = others.filter(|(name, _)| rules(schema, name).is_empty());
                others.all(|(_, value)| match rule {
                    Value::Bool(allowed) => *allowed,
                    rule => fits(rule, value).is_ok(),
                })
            }
            other => panic!("{other} is not checked"),
        };
        if !good {
            return Err(format!("{value} is against {key} {rule}"));
        }
    }
    for (name, value) in object.into_iter().flatten() {
        for rule in rules(schema, name) {
            fits(rule, value).map_err(|e| format!("{name}: {e}"))?;
        }
    }
    Ok(())
}

/// What a schema says of a property. Patterns are an ending, or a decimal between a start and an ending.
fn rules<'a>(schema: &'a Value, name: &str) -> Vec<&'a Value> {
    let of = |key: &str| {
        schema
            .get(key)
            .and_then(Value::as_object)
            .into_iter()
            .flatten()
    };
    let fits = |pattern: &str| {
        let ending = pattern.strip_suffix('$').unwrap();
        let Some((start, ending)) = ending.split_once("[0-9.]+") else {
            return name.ends_with(ending);
        };
        let rest = name.strip_prefix(start.strip_prefix('^').unwrap());
        let number = rest.and_then(|rest| rest.strip_suffix(ending));
        number.is_some_and(|n| n.parse::<f64>().is_ok())
    };
    let named = of("properties").filter(|(known, _)| *known == name);
    let patterned = of("patternProperties").filter(|(pattern, _)| fits(pattern));
    named.chain(patterned).map(|(_, rule)| rule).collect()
}
