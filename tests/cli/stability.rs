//! `gonio stability`: the tables, the page, what is refused.

use super::Bench;

#[test]
fn a_family_is_walked_and_told() {
    let bench = Bench::new();
    let text = bench.good(&["stability", "files", "instruments", "--short"]);
    assert!(text.contains("positions make the pair"), "{text}");
    assert!(
        text.contains("hold in") && !text.contains("BROKEN"),
        "{text}"
    );
    let files = ["--format", "csv", "-o", "laws.csv", "--html", "laws.html"];
    bench.good(&[&["stability", "files", "--short"], &files[..]].concat());
    let mut reader = csv::Reader::from_path(bench.path("laws.csv")).unwrap();
    let header: Vec<_> = reader.headers().unwrap().iter().map(String::from).collect();
    for name in [
        "member",
        "error",
        "at",
        "conditioning",
        "evaluations",
        "seconds",
        "verdict",
    ] {
        assert!(header.iter().any(|h| h == name), "{name}");
    }
    assert!(reader.records().count() > 3);
    let page = bench.read("laws.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("csv, readings"));
    let refusal = bench.refused(&["stability", "file"], 2);
    assert!(refusal.contains("\"file\" is no family") && refusal.contains("did you mean files?"));
    // Kept unless told otherwise.
    let refusal = bench.refused(&["stability", "files", "--short", "--html", "laws.html"], 2);
    assert!(
        refusal.contains("laws.html") && refusal.contains("--force"),
        "{refusal}"
    );
}
