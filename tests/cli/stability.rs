//! `gonio stability`: the tables, the page, what is refused.

use super::{Bench, csv_rows};

#[test]
fn a_family_is_walked_and_told() {
    let bench = Bench::new();
    let made = "positions make the pair … hold in";
    let text = bench.tells("stability files instruments --short", made);
    assert!(!text.contains("BROKEN"), "{text}");
    let files = "--format csv -o laws.csv --html laws.html";
    bench.good(format!("stability files --short {files}"));
    let rows = csv_rows(&bench.read("laws.csv"));
    for name in "member error at conditioning evaluations seconds verdict".split(' ') {
        assert!(rows[0].contains_key(name), "{name}");
    }
    assert!(rows.len() > 3);
    let page = bench.read("laws.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("csv, readings"));
    bench.does("2 | stability file | \"file\" is no family … did you mean files?");
    // Kept unless told otherwise.
    bench.does("2 | stability files --short --html laws.html | laws.html … --force");
}
