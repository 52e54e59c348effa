//! Benches: every section of the registry, its table and files, what is refused, what a Ctrl-C leaves.

use super::common::{Level, levels, says};
use super::{Bench, csv_rows};
use gonio::bench::{self, Section};
use serde_json::{Map, Value};

/// A row by the names of its columns.
type Row = Map<String, Value>;

fn rows(bench: &Bench, section: &str) -> Vec<Row> {
    csv_rows(&bench.read(&format!("out/bench-{section}.csv")))
}

fn text<'a>(row: &'a Row, column: &str) -> &'a str {
    row[column].as_str().unwrap()
}

fn number(row: &Row, column: &str) -> Option<f64> {
    let text = text(row, column);
    (!text.is_empty()).then(|| text.parse().unwrap())
}

levels! {
    every_section_is_timed_judged_and_drawn: "thorough: all sections, and not only one of them";
}

/// One run, many laws.
fn every_section_is_timed_judged_and_drawn(level: Level) {
    let bench = Bench::new();
    let asked = level.of("moments", "");
    let (code, text, told) = bench.output(format!("bench --quick --threads 2 -o out {asked}"));
    assert_eq!(code, Some(0), "{told}");
    let sections = bench::all().into_iter();
    let sections = sections.filter(|s| asked.is_empty() || asked.contains(s.name));
    let sections: Vec<_> = sections.collect();
    // How long it takes is said before all else, and nothing is left out.
    let first = told.lines().next().unwrap();
    assert!(first.starts_with("gonio: takes about "), "{first}");
    assert!(!told.contains("left out"), "{told}");
    let files = |s: &&Section| ["csv", "svg"].map(|e| format!("bench-{}.{e}", s.name));
    let mut expected: Vec<String> = sections.iter().flat_map(files).collect();
    expected.sort();
    assert_eq!(bench.files("out"), expected);
    for section in sections {
        check(&bench, section, &text);
    }
    // Kept unless told otherwise.
    bench.does("2 | bench moments --quick -o out | bench-moments.csv … --force");
}

fn check(bench: &Bench, section: &Section, printed: &str) {
    let rows = rows(bench, section.name);
    let svg = bench.read(&format!("out/bench-{}.svg", section.name));
    assert!(svg.starts_with("<svg"));
    let title = format!("{}: {}", section.name, section.summary);
    assert!(printed.contains(&title), "{title}");
    assert!(rows.len() >= 2, "{}", section.name);
    for row in &rows {
        let [least, median, most] =
            ["seconds_min", "seconds", "seconds_max"].map(|c| number(row, c).unwrap());
        assert!(0.0 < least && least <= median && median <= most, "{row:?}");
        // The same names and the same time in the table.
        let seconds = format!("{median:.3e}");
        let names = section.names.iter().map(|n| text(row, n));
        let cells: Vec<_> = names.chain([seconds.as_str()]).collect();
        let has = |line: &str| {
            line.split_whitespace()
                .take(cells.len())
                .eq(cells.iter().copied())
        };
        assert!(printed.lines().any(has), "{row:?}");
        // Where it was measured.
        assert_eq!(row["threads"], "2");
        says(printed, &format!("{}, 2 threads", text(row, "cpu")));
        for column in section.columns {
            let value = number(row, column.name);
            // Each estimate says how well it is known.
            let known = column.uncertainty.map(|name| [value, number(row, name)]);
            let is_known = known.is_none_or(|of| of.iter().all(|n| *n >= Some(0.0)));
            assert!(is_known, "{row:?}");
        }
    }
    for diagram in section.diagrams {
        assert!(svg.contains(diagram.x) && svg.contains(diagram.y));
    }
}

#[test]
fn what_is_none_is_refused() {
    let bench = Bench::new();
    bench.refuses("bench moments --quick --merl small.toml", 3, "small.toml");
    let refusal = bench.ends("bench moment", 2);
    for section in bench::all() {
        says(&refusal, section.name);
    }
}

/// Finished rows are printed and written; the code says that there are not all.
#[cfg(unix)]
#[test]
fn ctrl_c_keeps_finished_rows() {
    use std::io::{BufRead, BufReader, Read};
    use std::process::Stdio;
    let bench = Bench::new();
    let mut command = bench.command("bench moments --views 2 -o out");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    // The first row.
    let row = lines.find(|l| l.as_ref().unwrap().starts_with("lambert "));
    assert!(row.is_some());
    super::send("INT", &child);
    let is_row = |l: &String| l.starts_with("lambert ") || l.starts_with("ggx");
    let rows_left = lines.map(Result::unwrap).filter(is_row);
    let printed = 1 + rows_left.take_while(|l| l.contains(" to ")).count();
    let mut told = String::new();
    let mut stderr = child.stderr.take().unwrap();
    stderr.read_to_string(&mut told).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{told}");
    let rows = rows(&bench, "moments");
    assert_eq!(rows.len(), printed);
    let finished = gonio::error::count_are(rows.len(), "finished row");
    says(&told, &format!("interrupted; {finished}"));
}
