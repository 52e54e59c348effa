//! The program as a user meets it: exit codes, sentences on stderr, files that are whole or not
//! there.

#[path = "../common/mod.rs"]
mod common;

mod analysis;
mod bench;
mod configs;
mod convert;
mod door;
mod explain;
mod explore;
mod faults;
mod files;
mod foreign;
mod inputs;
mod instruments;
mod laboratory;
mod moment_study;
mod moments;
mod pages;
mod paths;
mod picture;
mod planning;
mod readme;
mod report;
mod resuming;
mod runs;
mod schedules;
mod schemas;
mod short_forms;
mod spectral;
mod stability;
mod study;
mod surface;
mod symmetry;
mod tables;
mod training;
mod validation;

use common::says;
use gonio::experiment::{RESULTS_REVISION, Row};
use serde_json::{Map, Value};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The words of a command line: blanks part them, but those in single quotes.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted) = (Vec::new(), None::<String>, false);
    for c in line.chars() {
        match c {
            ' ' if !quoted => words.extend(word.take()),
            '\'' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            c => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

/// Columns of files of poses, and of readings.
const POSES: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n";
const READINGS: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";

/// A folder to run the program in.
struct Bench {
    dir: TempDir,
}

/// A small experiment with every kind of choice, and no albedo, which takes longer than all the rest.
const SMALL: &str = r#"
quantities = []
budgets = [60, 150]
seeds = [1, 2]
material = [{ kind = "lambert" }, { kind = "ggx", alpha = 0.4 }]
parametrization = [
  { kind = "half-difference" },
  { kind = "half-difference", warp = { theta_h = "square-root" } },
]
sample_set = [{ kind = "grid" }, { kind = "random" }]
reconstruction = [{ kind = "nearest" }, { kind = "inverse-distance" }]
metrics = { pairs = 500, max_pairs = 1 }
"#;

/// One schedule of `small.toml`.
const ONE_SCHEDULE: &str = "--budget 150 --warp none --sample-set grid --seed 1";

/// Materials of experiments on moments.
const MATERIALS: &str = r#"
[[material]]
kind = "lambert"

[[material]]
kind = "ggx"
alpha = 0.4
fresnel = { kind = "none" }

[[material]]
kind = "ggx"
alpha = 0.6
fresnel = { kind = "none" }
"#;

/// Bytes of a MERL table without a single value.
fn empty_merl() -> Vec<u8> {
    let dimensions = [90_i32, 90, 180].iter().flat_map(|n| n.to_le_bytes());
    let cells = (0..3 * 90 * 90 * 180).flat_map(|_| (-1.0_f64).to_le_bytes());
    dimensions.chain(cells).collect()
}

/// Bytes of a UTIA table that is `value` everywhere, but for 0.1 percent at 0.1.
fn utia(value: f64) -> Vec<u8> {
    let cells = (0..3 * 288 * 288).map(|i| value + 1e-7 * f64::from(i % 977));
    cells.flat_map(f64::to_le_bytes).collect()
}

/// Sends a signal to a process.
fn send(signal: &str, child: &Child) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-s", signal, &id]).status();
    assert!(sent.unwrap().success());
}

impl Bench {
    fn new() -> Self {
        let dir = TempDir::new().unwrap();
        fs::write(dir.path().join("small.toml"), SMALL).unwrap();
        Self { dir }
    }

    /// One with this config, `c.toml`.
    fn of(config: impl AsRef<[u8]>) -> Self {
        let bench = Self::new();
        bench.write("c.toml", config);
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, line: impl AsRef<str>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonio"));
        let words = words(line.as_ref());
        command.args(words).current_dir(self.dir.path());
        command.stdin(Stdio::null());
        command
    }

    /// A command under way, whose stderr is read at its end.
    fn started(&self, line: impl AsRef<str>) -> Child {
        let mut command = self.command(line);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().unwrap()
    }

    /// Exit code, stdout and stderr of a command.
    fn output(&self, line: impl AsRef<str>) -> (Option<i32>, String, String) {
        let output = self.command(line).output().unwrap();
        let [out, err] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
        (output.status.code(), out, err)
    }

    /// Stdout and stderr of a command, which must end with this exit code.
    fn ended(&self, line: &str, expected: i32) -> [String; 2] {
        let (code, out, err) = self.output(line);
        assert_eq!(code, Some(expected), "{line}: {err}");
        [out, err]
    }

    /// The stderr of a command, which must end with this exit code.
    fn ends(&self, line: impl AsRef<str>, code: i32) -> String {
        let [_, stderr] = self.ended(line.as_ref(), code);
        stderr
    }

    /// Runs what must work; its stdout.
    fn good(&self, line: impl AsRef<str>) -> String {
        let [stdout, _] = self.ended(line.as_ref(), 0);
        stdout
    }

    /// Runs what must work and print these parts; its stdout.
    fn tells(&self, line: impl AsRef<str>, parts: &str) -> String {
        let said = self.good(line);
        says(&said, parts);
        said
    }

    /// The JSON that a command prints.
    fn json(&self, line: impl AsRef<str>) -> Value {
        let line = line.as_ref();
        serde_json::from_str(&self.good(line)).unwrap_or_else(|e| panic!("{line}: {e}"))
    }

    /// Runs what must be refused, within a moment and in one line and those behind it; its stderr.
    fn refused(&self, line: impl AsRef<str>, code: i32) -> String {
        let (start, line) = (Instant::now(), line.as_ref());
        let stderr = self.ends(line, code);
        let lines = stderr.lines().filter(|l| !l.starts_with("  because: "));
        assert_eq!(lines.count(), 1, "{line}: {stderr}");
        // One second on an idle machine; tests share theirs.
        assert!(start.elapsed() < Duration::from_secs(5), "{line}");
        stderr
    }

    /// Runs what must be refused with these parts of a sentence; its stderr.
    fn refuses(&self, line: impl AsRef<str>, code: i32, parts: &str) -> String {
        let sentence = self.refused(line, code);
        says(&sentence, parts);
        sentence
    }

    /// Runs commands, a line `code | command | parts of what it prints` each, the parts as in [`says`]. What does not
    /// work is refused in a sentence, or by the usage of the command where a `+` follows the code.
    fn does(&self, table: &str) {
        for row in table.lines().filter(|row| !row.trim().is_empty()) {
            for [code, line, parts] in common::table(&format!("{row} | ")) {
                let parts = parts.trim_end_matches([' ', '|']);
                let text = match code.parse() {
                    Ok(0) => self.ended(line, 0).concat(),
                    Ok(code) => self.refused(line, code),
                    Err(_) => self.ends(line, code.trim_end_matches('+').parse().unwrap()),
                };
                says(&text, parts);
            }
        }
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        fs::write(self.path(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn read_bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Every file below a folder.
    fn files(&self, name: &str) -> Vec<String> {
        fn walk(dir: &Path, base: &Path, out: &mut Vec<String>) {
            for entry in fs::read_dir(dir).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    walk(&path, base, out);
                } else {
                    let name = path.strip_prefix(base).unwrap();
                    out.push(name.to_string_lossy().into_owned());
                }
            }
        }
        let mut files = Vec::new();
        let dir = self.path(name);
        walk(&dir, &dir, &mut files);
        files.sort();
        files
    }

    /// Lines of a text below its comments and the names of its columns.
    fn lines(&self, name: &str) -> Vec<String> {
        let text = self.read(name);
        let lines = text.lines().filter(|l| !l.starts_with('#')).skip(1);
        lines.map(String::from).collect()
    }

    fn rows(&self, run: &str) -> Vec<Row> {
        gonio::report::read_rows(&self.path(run)).unwrap()
    }

    /// The last line of the timings of a run.
    fn machine(&self, run: &str) -> Value {
        let text = self.read(&format!("{run}/timings.jsonl"));
        let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
        last["run"].clone()
    }

    /// Replaces the rows of a run by others, as it would have written them.
    fn seal(&self, run: &str, rows: &[Row]) {
        let line = |row: &Row| {
            let [fields, _] = gonio::experiment::Record::parts(row).unwrap();
            let text = serde_json::to_string(&fields).unwrap();
            let body = text.strip_suffix('}').unwrap();
            let hash = blake3::hash(body.as_bytes()).to_hex();
            format!("{body},\"seal\":\"{RESULTS_REVISION}:{}\"}}\n", &hash[..16])
        };
        let lines: String = rows.iter().map(line).collect();
        fs::write(self.path(run).join("results.jsonl"), lines).unwrap();
    }

    fn manifest(&self, run: &str) -> Value {
        serde_json::from_str(&self.read(&format!("{run}/manifest.json"))).unwrap()
    }
}

/// Lines of a file of records of a run that are whole.
fn finished(bench: &Bench, run: &str, records: &str) -> Vec<String> {
    let bytes = fs::read(bench.path(run).join(records)).unwrap_or_default();
    let end = bytes.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    let text = String::from_utf8(bytes[..end].to_vec()).expect("whole lines are text");
    text.lines().map(str::to_owned).collect()
}

/// A table with a heading, a map from names to cells for each row; every row has all columns.
fn csv_rows(text: &str) -> Vec<Map<String, Value>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let heads = reader.headers().unwrap().clone();
    let pairs = |row: csv::StringRecord| {
        let cells = heads.iter().zip(row.iter());
        cells.map(|(h, cell)| (h.into(), cell.into())).collect()
    };
    reader.records().map(|row| pairs(row.unwrap())).collect()
}

/// The number in a cell.
fn number(row: &Map<String, Value>, name: &str) -> f64 {
    row[name].as_str().unwrap().parse().unwrap()
}

/// The words of the last line that begins with a text.
fn words_after<'a>(text: &'a str, start: &str) -> Vec<&'a str> {
    let mut lines = text.lines().rev();
    let rest = lines.find_map(|l| l.trim_start().strip_prefix(start));
    let rest = rest.unwrap_or_else(|| panic!("no line {start} in {text}"));
    rest.split_whitespace().collect()
}

/// Every file of a run but those of wall times, and those that name the config's file.
fn results(bench: &Bench, run: &str) -> Vec<(String, Vec<u8>)> {
    let mut files = whole_run(bench, run);
    files.retain(|(name, _)| !["manifest.json", "report.html"].contains(&name.as_str()));
    files
}

/// Every file of a run but those of wall times.
fn whole_run(bench: &Bench, run: &str) -> Vec<(String, Vec<u8>)> {
    let mut files = bench.files(run);
    files.retain(|file| !["timings.jsonl", "timings.svg"].contains(&file.as_str()));
    let bytes = |file: String| (file.clone(), bench.read_bytes(&format!("{run}/{file}")));
    files.into_iter().map(bytes).collect()
}

/// The same results in two folders, or before and after.
fn assert_same(before: &[(String, Vec<u8>)], after: &[(String, Vec<u8>)]) {
    let names = |of: &[(String, Vec<u8>)]| of.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(before), names(after));
    for ((name, before), (_, after)) in before.iter().zip(after) {
        assert!(before == after, "{name} is another");
    }
}
