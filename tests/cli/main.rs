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
mod faults;
mod files;
mod foreign;
mod inputs;
mod instruments;
mod laboratory;
mod moment_study;
mod moments;
mod overview;
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
mod slice;
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
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The words of a command line.
trait Line {
    fn words(&self) -> Vec<String>;
}

/// Blanks part the words of a text, but those in single quotes.
impl Line for str {
    fn words(&self) -> Vec<String> {
        let (mut words, mut word, mut quoted) = (Vec::new(), None::<String>, false);
        for c in self.chars() {
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
}

impl Line for String {
    fn words(&self) -> Vec<String> {
        self.as_str().words()
    }
}

impl<S: AsRef<str>> Line for [S] {
    fn words(&self) -> Vec<String> {
        self.iter().map(|word| word.as_ref().to_owned()).collect()
    }
}

impl<S: AsRef<str>, const N: usize> Line for [S; N] {
    fn words(&self) -> Vec<String> {
        self[..].words()
    }
}

impl<S: AsRef<str>> Line for Vec<S> {
    fn words(&self) -> Vec<String> {
        self[..].words()
    }
}

impl<L: Line + ?Sized> Line for &L {
    fn words(&self) -> Vec<String> {
        (**self).words()
    }
}

/// A folder to run the program in.
struct Bench {
    dir: TempDir,
}

/// A small experiment with every kind of choice, and no albedo, which takes longer than all the rest.
const SMALL: &str = r#"
quantities = []
budgets = [60, 150]
seeds = [1, 2]

[[material]]
kind = "lambert"

[[material]]
kind = "ggx"
alpha = 0.4

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "half-difference"
warp = { theta_h = "square-root" }

[[sample_set]]
kind = "grid"

[[sample_set]]
kind = "random"

[[reconstruction]]
kind = "nearest"

[[reconstruction]]
kind = "inverse-distance"

[metrics]
pairs = 500
max_pairs = 1
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

    fn command(&self, line: impl Line) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonio"));
        command.args(line.words()).current_dir(self.dir.path());
        command.stdin(Stdio::null());
        command
    }

    fn gonio(&self, line: impl Line) -> Output {
        self.command(line).output().unwrap()
    }

    /// The stderr of a command, which must end with this exit code.
    fn ends(&self, line: impl Line, code: i32) -> String {
        let output = self.gonio(&line);
        let stderr = String::from_utf8(output.stderr).unwrap();
        let words = line.words();
        assert_eq!(output.status.code(), Some(code), "{words:?}: {stderr}");
        stderr
    }

    /// Runs what must work; its stdout.
    fn good(&self, line: impl Line) -> String {
        let output = self.gonio(&line);
        let stderr = String::from_utf8(output.stderr).unwrap();
        let words = line.words();
        assert_eq!(output.status.code(), Some(0), "{words:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs what must work and print these parts; its stdout.
    fn tells(&self, line: impl Line, parts: &str) -> String {
        let said = self.good(line);
        says(&said, parts);
        said
    }

    /// Runs what must be refused, within a moment and in one line and those behind it; its stderr.
    fn refused(&self, line: impl Line, code: i32) -> String {
        let start = Instant::now();
        let stderr = self.ends(&line, code);
        let words = line.words();
        let lines = stderr.lines().filter(|l| !l.starts_with("  because: "));
        assert_eq!(lines.count(), 1, "{words:?}: {stderr}");
        // One second on an idle machine; tests share theirs.
        assert!(start.elapsed() < Duration::from_secs(5), "{words:?}");
        stderr
    }

    /// Runs what must be refused with these parts of a sentence; its stderr.
    fn refuses(&self, line: impl Line, code: i32, parts: &str) -> String {
        let sentence = self.refused(line, code);
        says(&sentence, parts);
        sentence
    }

    /// Runs what must be refused: a line `code | command | parts of the sentence` each.
    fn refuses_all(&self, table: &str) {
        for [code, line, parts] in common::table(table) {
            self.refuses(line, code.parse().unwrap(), parts);
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

    fn rows(&self, run: &str) -> Vec<Row> {
        gonio::report::read_rows(&self.path(run)).unwrap()
    }

    /// The last line of the timings of a run.
    fn machine(&self, run: &str) -> serde_json::Value {
        let text = self.read(&format!("{run}/timings.jsonl"));
        let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
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

    fn manifest(&self, run: &str) -> serde_json::Value {
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

/// Every file of a run but those of wall times, and those that name the config's file.
fn results(bench: &Bench, run: &str) -> Vec<(String, Vec<u8>)> {
    let mut files = whole_run(bench, run);
    files.retain(|(name, _)| !["manifest.json", "report.html"].contains(&name.as_str()));
    files
}

/// Every file of a run but those of wall times.
fn whole_run(bench: &Bench, run: &str) -> Vec<(String, Vec<u8>)> {
    let files = bench.files(run).into_iter();
    let files = files.filter(|file| !["timings.jsonl", "timings.svg"].contains(&file.as_str()));
    let bytes = |file: String| {
        let bytes = fs::read(bench.path(run).join(&file)).unwrap();
        (file, bytes)
    };
    files.map(bytes).collect()
}

/// The same results in two folders, or before and after.
fn assert_same(before: &[(String, Vec<u8>)], after: &[(String, Vec<u8>)]) {
    let names = |results: &[(String, Vec<u8>)]| -> Vec<String> {
        results.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(before), names(after));
    for ((name, before), (_, after)) in before.iter().zip(after) {
        assert!(before == after, "{name} is another");
    }
}
