//! What the README and the pages of `docs` tell the reader to type, and what that prints.

use super::Bench;
use super::common::{Level, levels};
use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// A file of the repository.
pub fn of_repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

pub fn read(path: &str) -> String {
    fs::read_to_string(of_repository(path)).unwrap()
}

/// Words with one space between them: columns may be narrower in a text than on a terminal.
pub fn squeezed(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The bodies of the fenced blocks of a language, one after the other.
pub fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let mut found = Vec::new();
    let mut rest = page;
    while let Some((_, fenced)) = rest.split_once("\n```") {
        let (tag, body) = fenced.split_once('\n').unwrap();
        let end = match body.starts_with("```") {
            true => 0,
            false => body.find("\n```").expect("a block ends") + 1,
        };
        if tag == language {
            found.push(&body[..end]);
        }
        rest = &body[end + 3..];
    }
    found
}

/// Commands, one a line, without comments; lines that end in a backslash go on.
pub fn commands(block: &str) -> Vec<String> {
    let lines = block.lines().filter(|l| !l.starts_with('#'));
    let lines: Vec<_> = lines.collect();
    let joined = lines.join("\n").replace("\\\n", " ");
    let lines = joined.lines().filter(|l| !l.trim().is_empty());
    lines.map(squeezed).collect()
}

impl Bench {
    /// The configs of the repository, where a clone has them.
    pub fn with_configs(self) -> Self {
        for dir in ["configs", "configs/instruments", "configs/starters"] {
            fs::create_dir(self.path(dir)).unwrap();
            for entry in fs::read_dir(of_repository(dir)).unwrap() {
                let entry = entry.unwrap();
                if entry.path().is_file() {
                    let copy = self.path(dir).join(entry.file_name());
                    fs::copy(entry.path(), copy).unwrap();
                }
            }
        }
        self
    }

    /// Has the shell do a line; all that a terminal would show.
    pub fn typed(&self, line: &str) -> (ExitStatus, String) {
        let program = Path::new(env!("CARGO_BIN_EXE_gonio")).parent().unwrap();
        let mut path = vec![program.to_owned()];
        path.extend(env::split_paths(&env::var_os("PATH").unwrap()));
        // One file for both streams keeps their order.
        let (shown, name) = (self.path(".shown"), "a file to write into");
        let out = File::create(&shown).expect(name);
        let mut shell = Command::new("sh");
        shell.args(["-c", line]).current_dir(self.path("."));
        shell.env("PATH", env::join_paths(path).unwrap());
        let both = out.try_clone().expect(name);
        shell.stdin(Stdio::null()).stdout(both).stderr(out);
        let status = shell.status().unwrap();
        (status, fs::read_to_string(shown).unwrap())
    }

    /// What a line shows that must work.
    pub fn shown(&self, line: &str) -> String {
        let (status, shown) = self.typed(line);
        assert!(status.success(), "{line}: {shown}");
        shown
    }
}

/// `gonio run` of what takes minutes, or needs a folder of measured materials, is a `gonio check`:
/// that reads the same config and the same files. A million light paths are a few thousand.
/// Of the dearest others the quick level sees only that their options are known.
fn checked(command: &str, level: Level) -> String {
    let command = command.replacen("gonio run ", "gonio check ", 1);
    let command = command.replacen("gonio paths ", "gonio paths --paths 4096 ", 1);
    let is_any_of = |dear: &[&str]| dear.iter().any(|words| command.starts_with(words));
    if level == Level::Thorough {
        command
    } else if is_any_of(&["gonio check configs/instruments.toml"]) {
        command + " --set readings=[40] --set minutes=[3]"
    } else if is_any_of(&[
        "gonio advise",
        "gonio subset",
        "gonio picture",
        "gonio claims",
    ]) {
        command + " --help"
    } else {
        command.replace("surfaces=8", "surfaces=1 --set surface.size=64")
    }
}

levels! {
    the_commands_of_the_pages_are_commands: "thorough: whole searches, advice and pictures";
}

fn the_commands_of_the_pages_are_commands(level: Level) {
    let bench = Bench::new().with_configs();
    // Of the materials that the papers name, two.
    let some = "tabulate small.toml --material ggx-0.4 -o";
    fs::create_dir(bench.path("brdfs")).unwrap();
    for name in ["alum-bronze", "pink-felt"] {
        bench.good(format!("{some} brdfs/{name}.binary"));
    }
    let mut count = 0;
    for page in ["findings", "parametrizations", "light_paths", "planning"] {
        for block in blocks(&read(&format!("src/docs/{page}.md")), "sh") {
            for command in commands(block) {
                assert!(command.starts_with("gonio "), "{page}: {command}");
                bench.shown(&checked(&command, level));
                count += 1;
            }
        }
    }
    assert!(count >= 10, "only {count} commands");
}

#[test]
fn the_recipes_of_a_cluster_use_what_there_is() {
    let bench = Bench::new();
    let page = read("src/docs/cluster.md");
    let mut options = 0;
    for recipe in fs::read_dir(of_repository("configs/cluster")).unwrap() {
        let name = recipe.unwrap().file_name().into_string().unwrap();
        assert!(page.contains(&format!("`{name}`")), "{name}");
        let recipe = read(&format!("configs/cluster/{name}"));
        let code = recipe.lines().filter(|l| !l.starts_with('#'));
        let code = code.collect::<Vec<_>>().join(" ");
        for command in code.split("gonio ").skip(1) {
            let words = command.split(['"', ' ']).filter(|w| !w.is_empty());
            let words: Vec<&str> = words.collect();
            let help = bench.good(format!("help {}", words[0]));
            for option in words.iter().filter(|w| w.starts_with("--")) {
                assert!(help.contains(option), "{name}: {option}");
                options += 1;
            }
        }
    }
    assert!(options >= 12, "only {options} options");
}

#[test]
#[ignore = "thorough: every machine with each of its budgets"]
fn the_findings_on_machines_are_what_is_printed() {
    let bench = Bench::new().with_configs();
    let page = read("src/docs/findings.md");
    let printed = bench.shown("gonio run configs/instruments.toml -q");
    let tables = blocks(&page, "text");
    let mut lines = tables[0].lines().filter(|l| !l.is_empty());
    assert_eq!(lines.clone().count(), 4 * 8);
    let gone = lines.find(|line| !printed.lines().any(|l| l == *line));
    assert_eq!(gone, None, "not printed today");
}
