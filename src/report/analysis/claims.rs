//! Claims as a table for people and as files.

use crate::analysis::Claim;
use crate::experiment::moments::shown;
use crate::report::schema::{Schema, columns};
use serde_json::{Value, json};

/// The width of the table, characters.
const WIDTH: usize = 100;

/// Column where the text of a row starts, characters.
const INDENT: usize = 15;

/// A paragraph per claim: verdict, name, place, statement, finding.
pub fn claims_table(claims: &[Claim]) -> String {
    let mut out = String::new();
    for claim in claims {
        let material = claim.material.as_ref();
        let material = material.map_or(String::new(), |m| format!(", here on {m}"));
        let head = format!("{} ({}){material}", claim.id, claim.place);
        out += &format!("{:INDENT$}{head}\n", claim.verdict.name());
        out += &wrapped(claim.statement);
        out += &wrapped(&format!("→ {}", claim.finding));
        out += "\n";
    }
    out
}

/// A text broken into lines of the table.
fn wrapped(text: &str) -> String {
    let mut out = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH - INDENT {
            out += &format!("{:INDENT$}{line}\n", "");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line += word;
    }
    out + &format!("{:INDENT$}{line}\n", "")
}

/// The columns of files, whose verdicts and numbers depend on the format.
fn schema(verdict: fn(&Claim) -> Value, numbers: fn(&Claim) -> Value) -> Schema<Claim> {
    columns! { claim in Claim;
        "id" => claim.id,
        "place" => claim.place,
        "material" => claim.material.as_deref(),
        "verdict" => verdict(claim),
        "finding" => claim.finding.as_str(),
        "statement" => claim.statement,
        "criterion" => claim.criterion,
        "numbers" => numbers(claim),
    }
}

/// A row per claim; its numbers as `name=value`, separated by semicolons.
pub fn claims_csv(claims: &[Claim]) -> String {
    let numbers = |claim: &Claim| {
        let numbers = claim.numbers.iter();
        let numbers: Vec<_> = numbers.map(|(n, v)| format!("{n}={}", shown(*v))).collect();
        numbers.join(";").into()
    };
    schema(|claim| claim.verdict.name().into(), numbers).csv(claims)
}

/// A JSON array of objects; `numbers` is an object of its own.
pub fn claims_json(claims: &[Claim]) -> String {
    let numbers = |claim: &Claim| claim.numbers.iter().cloned().collect();
    let schema = schema(|claim| json!(claim.verdict), numbers);
    super::rows_json(&schema.objects(claims))
}
