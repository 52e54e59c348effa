//! `gonio stability`: the tables, the page, what is refused.

use super::Bench;
use super::common::says;

#[test]
fn a_family_is_walked_and_told() {
    let bench = Bench::new();
    let text = bench.good("stability files instruments --short");
    says(&text, "positions make the pair");
    assert!(
        text.contains("hold in") && !text.contains("BROKEN"),
        "{text}"
    );
    let files = "--format csv -o laws.csv --html laws.html";
    bench.good(format!("stability files --short {files}"));
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
    bench.refuses(
        "stability file",
        2,
        "\"file\" is no family … did you mean files?",
    );
    // Kept unless told otherwise.
    bench.refuses(
        "stability files --short --html laws.html",
        2,
        "laws.html … --force",
    );
}
