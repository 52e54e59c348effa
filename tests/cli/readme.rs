//! The README keeps its promises: it is short, its commands run, and print the numbers beside them.

use super::Bench;
use super::common::{Level, levels};
use super::pages::{blocks, commands, read, squeezed};
use std::path::Path;

/// Commands that this test, a test itself, leaves to others: `.ci/run` has those of cargo; `.ci/foreign` builds the wheel that
/// pip builds, and submits the recipe.
const OF_OTHERS: [&str; 5] = [
    "cargo test",
    "cargo install --path .",
    "cargo doc --no-deps --open",
    "pip install ./src/python",
    "sbatch configs/cluster/array.sh my-study.toml",
];

const MAIN_JOB: &str = "cargo run --release -- run configs/quickstart.toml";

/// Every command, in the order of the page: those of blocks, then those of the table.
fn all_commands(readme: &str) -> Vec<String> {
    let blocks = blocks(readme, "sh");
    let mut all: Vec<String> = blocks.into_iter().flat_map(commands).collect();
    // Cells in backquotes; one that ends in a backslash goes on in the row below.
    let rows = readme.lines().filter(|l| l.starts_with('|'));
    let cells = rows.filter_map(|l| l.trim_end_matches([' ', '|']).rsplit_once("| `"));
    let cells = cells.filter_map(|(_, cell)| cell.strip_suffix('`'));
    let of_table = cells.collect::<Vec<_>>().join("\n");
    all.extend(commands(&of_table));
    all
}

#[test]
fn the_readme_is_short_and_narrow() {
    let readme = read("README.md");
    assert!(readme.lines().count() <= 135);
    for line in readme.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let picture = readme.lines().find(|l| l.starts_with("![")).unwrap();
    assert!(picture.ends_with("](src/docs/explore.png)"));
}

#[test]
fn the_readme_shows_what_the_quickstart_prints() {
    let bench = Bench::new().with_configs();
    let printed = squeezed(&bench.shown("gonio run configs/quickstart.toml"));
    let readme = read("README.md");
    let shown = blocks(&readme, "text")[0].lines().filter(|l| !l.is_empty());
    let shown: Vec<String> = shown.map(squeezed).collect();
    assert_eq!(shown.len(), 9, "the README's table is gone");
    for line in shown {
        assert!(printed.contains(&line), "not printed today: {line}");
    }
}

levels! {
    the_readmes_commands_run: "thorough: at their full size";
}

/// What is dear is asked for less in the quick level.
fn less(command: &str) -> String {
    let command = command.replace("run my.binary", "run my.binary --set budgets=[40]");
    let command = command.replace("run my-study.toml", "run my-study.toml --set budgets=[40]");
    let command = command.replace("advise my.binary", "advise --help my.binary");
    let command = command.replace("explore my.binary", "explore --help my.binary");
    command.replace("reconstruct my.csv", "reconstruct --help my.csv")
}

fn the_readmes_commands_run(level: Level) {
    let bench = Bench::new().with_configs();
    let readme = read("README.md");
    let all = all_commands(&readme);
    assert_eq!(all[..2], [MAIN_JOB, "cargo test"]);
    for job in &all[..2] {
        let step = job.replace("cargo test", "cargo test --locked");
        let step = step.replace("--release --", "--release --locked --");
        let guards = read(".ci/run");
        // `step NAME COMMAND`.
        let named = guards.lines().filter_map(|line| line.strip_prefix("step "));
        let mut commands = named.filter_map(|line| Some(line.split_once(' ')?.1));
        assert!(commands.any(|command| command.starts_with(&step)), "{step}");
    }
    let mut own = 0;
    for command in &all {
        if command == MAIN_JOB || OF_OTHERS.contains(&command.as_str()) {
            continue;
        }
        assert!(command.starts_with("gonio "), "{command}");
        match level {
            Level::Quick => bench.shown(&less(command)),
            Level::Thorough => bench.shown(command),
        };
        own += 1;
    }
    assert!(own >= 8, "the README's commands are gone: {all:?}");
    let made = ["my.binary", "my.toml", "poses", "runs/my/results.csv"];
    let at_full_size = level.of(&[][..], &["copy.binary"]);
    for file in made.iter().chain(at_full_size) {
        assert!(bench.path(file).exists(), "{file}");
    }
    // In the text too each command is one, and each file that is linked is there.
    for span in readme.split('`').skip(1).step_by(2) {
        if let Some(command) = span.strip_prefix("gonio ") {
            let name = command.split_whitespace().next().unwrap();
            let name = if name.starts_with('-') { "" } else { name };
            bench.shown(&format!("gonio help {name}"));
        }
    }
    for link in readme.split("](").skip(1) {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(link.split([')', '#']).next().unwrap());
        assert!(file.is_file(), "{}", file.display());
    }
}
