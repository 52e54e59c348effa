//! Benches: every section of the registry, its table and files, what is refused, what a Ctrl-C leaves.

use super::Bench;
use super::common::{Level, levels, says};
use gonio::bench::{self, Section};
use std::collections::HashMap;

/// A row by the names of its columns.
type Row = HashMap<String, String>;

fn rows(bench: &Bench, section: &str) -> Vec<Row> {
    let path = bench.path(&format!("out/bench-{section}.csv"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &Row, column: &str) -> Option<f64> {
    let text = row
        .get(column)
        .unwrap_or_else(|| panic!("{column} of {row:?}"));
    (!text.is_empty()).then(|| text.parse().unwrap())
}

/// What a row is compared within, and its choice.
fn ladder<'a>(section: &Section, row: &'a Row) -> Vec<&'a str> {
    let last = section.names.len() - 1;
    section.names[..last]
        .iter()
        .map(|n| row[*n].as_str())
        .collect()
}

levels! {
    every_section_is_timed_judged_and_drawn: "thorough: all sections, and not only two of them";
}

/// One run, many laws.
fn every_section_is_timed_judged_and_drawn(level: Level) {
    let bench = Bench::new();
    let asked = level.of("moments instruments", "");
    let args = "bench --quick --threads 2 -o out";
    let output = bench.gonio(format!("{args} {asked}"));
    let sections = bench::all().into_iter();
    let sections = sections.filter(|s| asked.is_empty() || asked.contains(s.name));
    let sections: Vec<_> = sections.collect();
    let [text, told] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    assert_eq!(output.status.code(), Some(0), "{told}");
    // How long it takes is said before all else, and nothing is left out.
    let first = told.lines().next().unwrap();
    let seconds = first.strip_prefix("gonio: takes about ").unwrap();
    let seconds: f64 = seconds.strip_suffix(" s").unwrap().parse().unwrap();
    assert!(seconds >= level.of(0.0, 1.0), "{first}");
    assert!(!told.contains("left out"), "{told}");
    let files: Vec<String> = sections
        .iter()
        .flat_map(|s| ["csv", "svg"].map(|e| format!("bench-{}.{e}", s.name)))
        .collect();
    let mut written = bench.files("out");
    written.sort();
    let mut expected = files.clone();
    expected.sort();
    assert_eq!(written, expected);
    for section in sections {
        check(&bench, section, &text);
    }
    moments_keep_their_tolerances(&bench);
    if level == Level::Thorough {
        errors_fall_with_the_budget(&bench);
    }
    // Kept unless told otherwise.
    bench.refuses(
        "bench moments --quick -o out",
        2,
        "bench-moments.csv … --force",
    );
}

fn check(bench: &Bench, section: &Section, text: &str) {
    let rows = rows(bench, section.name);
    let svg = bench.read(&format!("out/bench-{}.svg", section.name));
    assert!(svg.starts_with("<svg"));
    let title = format!("{}: {}", section.name, section.summary);
    assert!(text.contains(&title), "{title}");
    assert!(rows.len() >= 2, "{}", section.name);
    for row in &rows {
        let [least, median, most] =
            ["seconds_min", "seconds", "seconds_max"].map(|c| number(row, c).unwrap());
        assert!(0.0 < least && least <= median && median <= most, "{row:?}");
        // The same names and the same time in the table.
        let last = *section.names.last().unwrap();
        let seconds = format!("{median:.3e}");
        let has = |line: &&str| {
            let mut words = line.split_whitespace();
            let names = ladder(section, row).into_iter().chain([row[last].as_str()]);
            names.into_iter().all(|n| words.next() == Some(n)) && words.next() == Some(&seconds)
        };
        assert!(text.lines().any(|l| has(&l)), "{row:?}");
        // Where it was measured.
        assert_eq!(row["threads"], "2");
        says(text, &format!("{}, 2 threads", row["cpu"]));
        for column in section.columns {
            let value = number(row, column.name);
            // Each estimate says how well it is known.
            if let Some(uncertainty) = column.uncertainty {
                assert!(
                    value.unwrap() >= 0.0 && number(row, uncertainty).unwrap() >= 0.0,
                    "{row:?}"
                );
            }
        }
    }
    for diagram in section.diagrams {
        assert!(svg.contains(diagram.x) && svg.contains(diagram.y));
        if diagram.has_front {
            fronts(section, diagram, &rows, text);
        }
    }
}

/// No row on a front is dominated, and each other row is.
fn fronts(section: &Section, diagram: &bench::Diagram, rows: &[Row], text: &str) {
    let point = |row: &Row| Some([number(row, diagram.x)?, number(row, diagram.y)?]);
    for row in rows {
        let case = section.names[0];
        let others = rows
            .iter()
            .filter(|r| r[case] == row[case])
            .filter_map(point);
        let Some(own) = point(row) else {
            assert_eq!(row[&diagram.column()], "false");
            continue;
        };
        let better = |o: [f64; 2]| o[0] <= own[0] && o[1] <= own[1] && o != own;
        let dominated = others.into_iter().any(better);
        assert_eq!(row[&diagram.column()], (!dominated).to_string(), "{row:?}");
        let head = format!("best {} for its {}, {}", diagram.y, diagram.x, row[case]);
        assert!(text.contains(&head), "{head}");
    }
}

fn moments_keep_their_tolerances(bench: &Bench) {
    let rows = rows(bench, "moments");
    for material in [
        "lambert",
        "ggx-0.1",
        "ggx-0.01",
        "ggx-0.001",
        "table-ggx-0.1",
    ] {
        // 3 rungs of Monte Carlo, 4 of Sobol, at most 5 of the other.
        let count = rows.iter().filter(|r| r["material"] == material).count();
        assert!((8..=12).contains(&count), "{material}: {count}");
    }
    for row in &rows {
        let number = |column| number(row, column).unwrap();
        assert!(number("evaluations") > 0.0);
        assert!(number("covariance_median") <= number("covariance_error"));
        if row["estimator"] == "peak-resolving" && number("unresolved_views") == 0.0 {
            let tolerance: f64 = row["parameter"].parse().unwrap();
            assert!(number("energy_error") <= tolerance, "{row:?}");
            assert!(number("covariance_error") <= tolerance, "{row:?}");
        }
        if row["material"] == "ggx-0.001" && row["parameter"] == "1024" {
            assert_eq!(number("unresolved_views"), 1.0);
        }
    }
}

/// On a smooth material four times the readings of a grid are worth something to both methods of a grid.
fn errors_fall_with_the_budget(bench: &Bench) {
    let section = bench::all()
        .into_iter()
        .find(|s| s.name == "reconstructions");
    let section = section.unwrap();
    let mut compared = 0;
    for pair in rows(bench, section.name).windows(2) {
        let [few, many] = pair else { unreachable!() };
        let is_ladder = ladder(section, few) == ladder(section, many);
        let is_grid = ["multilinear", "cubic"].contains(&few["reconstruction"].as_str());
        if is_ladder && is_grid && few["material"] == "ggx-0.4" {
            let errors = [few, many].map(|row| number(row, "nrmse").unwrap());
            assert!(errors[1] < errors[0], "{few:?} {many:?}");
            compared += 1;
        }
    }
    // Three coordinates, each with a warp and without.
    assert_eq!(compared, 2 * 3 * 2);
}

#[test]
fn what_is_none_is_refused() {
    let bench = Bench::new();
    let args = "bench moments --quick --merl small.toml";
    bench.refuses(args, 3, "small.toml");
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
    use std::process::{Command, Stdio};
    let bench = Bench::new();
    let mut command = bench.command("bench moments --views 2 -o out");
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    // The first row.
    let row = lines.find(|l| l.as_ref().unwrap().starts_with("lambert "));
    assert!(row.is_some());
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let printed = 1 + lines
        .map(Result::unwrap)
        .filter(|l| l.starts_with("lambert ") || l.starts_with("ggx"))
        .take_while(|l| l.contains(" to "))
        .count();
    let mut told = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut told)
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{told}");
    let rows = rows(&bench, "moments");
    assert_eq!(rows.len(), printed);
    let last = format!(
        "interrupted; {}",
        gonio::error::count_are(rows.len(), "finished row")
    );
    says(&told, &last);
}
