//! Claims as a table for people and as files.

use crate::analysis::Claim;
use crate::experiment::moments::shown;
use crate::report::csv::Csv;
use std::io::{self, Write};

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

/// Writes a row per claim; its numbers as `name=value`, separated by semicolons.
///
/// # Errors
/// Whatever `out` reports.
pub fn claims_csv(claims: &[Claim], out: &mut impl Write) -> io::Result<()> {
    let mut csv = Csv::new(out);
    csv.row([
        "id",
        "place",
        "material",
        "verdict",
        "finding",
        "statement",
        "criterion",
        "numbers",
    ])?;
    for claim in claims {
        let numbers = claim.numbers.iter();
        let numbers: Vec<_> = numbers.map(|(n, v)| format!("{n}={}", shown(*v))).collect();
        csv.row([
            claim.id,
            claim.place,
            claim.material.as_deref().unwrap_or_default(),
            claim.verdict.name(),
            &claim.finding,
            claim.statement,
            claim.criterion,
            &numbers.join(";"),
        ])?;
    }
    csv.flush()
}

/// Writes a JSON array of objects; `numbers` is an object of its own.
///
/// # Errors
/// Whatever `out` reports.
pub fn claims_json(claims: &[Claim], out: &mut impl Write) -> io::Result<()> {
    let objects = claims.iter().map(|claim| {
        let numbers = claim.numbers.iter();
        let numbers: serde_json::Map<_, _> =
            numbers.map(|(n, v)| (n.clone(), (*v).into())).collect();
        serde_json::json!({
            "id": claim.id,
            "place": claim.place,
            "material": claim.material,
            "verdict": claim.verdict,
            "finding": claim.finding,
            "statement": claim.statement,
            "criterion": claim.criterion,
            "numbers": numbers,
        })
    });
    super::rows_json(&objects.collect::<Vec<_>>(), out)
}
