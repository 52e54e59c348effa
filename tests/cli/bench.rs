//! Benches: the table, the files, what is refused.

use super::Bench;

/// One view: everything is there, within seconds.
const QUICK: [&str; 6] = ["bench", "moments", "--views", "1", "--threads", "2"];

#[test]
fn moments_are_timed_and_compared() {
    let bench = Bench::new();
    let text = bench.good(&[&QUICK[..], &["-o", "deep/out"]].concat());
    for kind in ["monte-carlo", "sobol", "peak-resolving"] {
        assert!(text.contains(kind), "{text}");
    }
    let mut reader = csv::Reader::from_path(bench.path("deep/out/bench.csv")).unwrap();
    let header: Vec<_> = reader.headers().unwrap().iter().map(String::from).collect();
    assert_eq!(header[..3], ["material", "estimator", "parameter"]);
    let place = |name: &str| header.iter().position(|h| h == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let number = |row: &csv::StringRecord, name: &str| row[place(name)].parse::<f64>().unwrap();
    let materials: Vec<&str> = rows.iter().map(|r| &r[0]).collect();
    for material in [
        "lambert",
        "ggx-0.1",
        "ggx-0.01",
        "ggx-0.001",
        "table-ggx-0.1",
    ] {
        // 4 rungs of Monte Carlo, 5 of Sobol, at most 7 of the other.
        let count = materials.iter().filter(|m| **m == material).count();
        assert!((10..=16).contains(&count), "{material}: {count}");
    }
    for row in &rows {
        assert!(number(row, "seconds") > 0.0 && number(row, "evaluations") > 0.0);
        assert!(number(row, "covariance_median") <= number(row, "covariance_error"));
        if &row[1] == "peak-resolving" && number(row, "unresolved_views") == 0.0 {
            let tolerance: f64 = row[2].parse().unwrap();
            assert!(number(row, "energy_error") <= tolerance, "{row:?}");
            assert!(number(row, "covariance_error") <= tolerance, "{row:?}");
        }
        if &row[0] == "ggx-0.001" && &row[1] == "monte-carlo" && &row[2] == "1024" {
            assert_eq!(number(row, "unresolved_views"), 1.0);
        }
    }
    let svg = bench.read("deep/out/bench.svg");
    assert!(svg.starts_with("<svg") && svg.contains("ggx-0.001"));
    // Kept unless told otherwise.
    let refusal = bench.refused(&[&QUICK[..], &["-o", "deep/out"]].concat(), 2);
    assert!(
        refusal.contains("bench.csv") && refusal.contains("--force"),
        "{refusal}"
    );
}

#[test]
fn a_table_that_is_none_is_refused() {
    let bench = Bench::new();
    let refusal = bench.refused(&[&QUICK[..], &["--merl", "small.toml"]].concat(), 3);
    assert!(refusal.contains("small.toml"), "{refusal}");
}
