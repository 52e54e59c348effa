//! Sentences of the library in the words of a caller: keywords of Python in the place of options of the command and of a config.

use gonio::error::listed;
use gonio::schedule::{AngleUnit, Azimuth, Polarisation, Quantity, UncertaintyUnit};

/// Keywords that say how a file by others is read, which the materials of a config have as keys.
const CONVENTIONS: &str = "columns angles elevation azimuth quantity uncertainties \
    coverage_factor polarisation partial mixed no_reading pixels";

/// Options that are true or left out.
const SWITCHES: [&str; 4] = ["elevation", "partial", "mixed", "force"];

/// Names of the values of an option, if they are listed.
fn values(option: &str) -> Vec<&'static str> {
    match option {
        "angles" => AngleUnit::ALL.map(|c| c.name).to_vec(),
        "azimuth" => Azimuth::ALL.map(|c| c.name).to_vec(),
        "quantity" => Quantity::ALL.map(|c| c.name).to_vec(),
        "uncertainties" => UncertaintyUnit::ALL.map(|c| c.name).to_vec(),
        "polarisation" => Polarisation::ALL.map(|c| c.name).to_vec(),
        _ => Vec::new(),
    }
}

/// A sentence with `angles="deg"` for `--angles deg`, `mixed=True` for `--mixed`, `columns={"value": "4"}` for `--columns value=4`.
pub fn in_keywords(sentence: &str) -> String {
    let sentence = of_config(sentence);
    let mut words = sentence.split(' ').peekable();
    let mut out: Vec<String> = Vec::new();
    // True behind a keyword with its value: another one follows a comma.
    let mut is_open = false;
    while let Some(word) = words.next() {
        let plain = word.trim_start_matches(['(', '`', '"']);
        let name = plain.strip_prefix("--").unwrap_or_default();
        let is_letter = |c: char| c.is_ascii_lowercase() || c == '-';
        let (name, end) = name.split_at(name.find(|c| !is_letter(c)).unwrap_or(name.len()));
        if !name.starts_with(|c: char| c.is_ascii_lowercase()) {
            out.push(word.to_owned());
            is_open = false;
            continue;
        }
        if let (true, Some(last)) = (is_open, out.last_mut()) {
            last.push(',');
        }
        let before = word[..word.len() - plain.len()].replace('`', "");
        let (name, end) = (name.replace('-', "_"), end.replace('`', ""));
        let value = words.peek().filter(|_| end.is_empty());
        if let Some((value, rest)) = value.and_then(|value| of_value(&name, value)) {
            words.next();
            is_open = rest.is_empty();
            out.push(format!("{before}{name}={value}{rest}"));
        } else if SWITCHES.contains(&name.as_str()) {
            is_open = end.is_empty();
            out.push(format!("{before}{name}=True{end}"));
        } else {
            is_open = false;
            out.push(format!("{before}{name}{end}"));
        }
    }
    out.join(" ")
}

/// The value of an option as Python writes it, and what follows in the same word; `None` of a word that is none.
fn of_value<'w>(option: &str, word: &'w str) -> Option<(String, &'w str)> {
    let plain = word.trim_end_matches([',', ';', ':', ')', '`']);
    let rest = &word[plain.len()..];
    if plain.contains('=') {
        let pairs = plain.split(',').map(|pair| {
            let (key, value) = pair.split_once('=')?;
            Some(format!("\"{key}\": \"{value}\""))
        });
        let pairs = pairs.collect::<Option<Vec<_>>>()?;
        return Some((format!("{{{}}}", pairs.join(", ")), rest));
    }
    if plain.parse::<f64>().is_ok() {
        return Some((plain.to_owned(), rest));
    }
    let is_listed = values(option).contains(&plain);
    is_listed.then(|| (format!("\"{plain}\""), rest))
}

/// A sentence with options for keys of a config in backticks, and dictionaries for their tables.
fn of_config(sentence: &str) -> String {
    let marks = sentence.matches('`').count();
    let parts = sentence.split('`').enumerate().map(|(i, part)| {
        let (key, table) = part.split_once(" =").unwrap_or((part, ""));
        if i % 2 == 0 {
            return part.to_owned();
        }
        // One that nothing closes.
        if i == marks {
            return format!("`{part}");
        }
        if CONVENTIONS.split(' ').any(|known| known == key) && table.is_empty() {
            return format!("--{}", key.replace('_', "-"));
        }
        let keys = table.strip_prefix(" { ").and_then(|t| t.strip_suffix(" }"));
        let keys = keys.map(|keys| {
            let pairs = keys.split(", ").filter_map(|pair| pair.split_once(" = "));
            let pairs = listed(pairs.map(|(key, value)| format!("\"{key}\": {value}")));
            format!("{key}={{{pairs}}}")
        });
        keys.unwrap_or_else(|| format!("`{part}`"))
    });
    parts.collect()
}

/// A sentence with the bare names of tables for `[[material]]` and `[moments]`.
pub fn without_brackets(sentence: &str) -> String {
    let bare = |word: &str| {
        let name = word.trim_matches(['[', ']', ',', ';', '.']);
        let is_table =
            word.starts_with('[') && name.chars().all(|c| c.is_ascii_lowercase() || c == '_');
        match is_table && !name.is_empty() {
            true => word.replace(['[', ']'], ""),
            false => word.to_owned(),
        }
    };
    let words: Vec<String> = sentence.split(' ').map(bare).collect();
    words.join(" ")
}
