//! The laboratory's walk-through is played from its first command to its last.

use super::Bench;
use super::common::{Level, levels};
use super::pages::{of_repository, read};
use std::{env, fs};

/// A page with what its `console` blocks show today; each line after `$` is typed in turn, and each
/// `toml` block is the file that its first line names. The quick level only sees that what reconstructs is a command.
fn played(bench: &Bench, page: &str, level: Level) -> String {
    let mut now = String::new();
    let mut lines = page.lines().peekable();
    while let Some(line) = lines.next() {
        now += &format!("{line}\n");
        if line == "```toml" {
            let name = lines.peek().unwrap().trim_start_matches("# ");
            let body: Vec<_> = lines.clone().take_while(|l| *l != "```").collect();
            bench.write(name, body.join("\n") + "\n");
        }
        if line != "```console" {
            continue;
        }
        let mut is_kept = false;
        for line in lines.by_ref() {
            if let Some(command) = line.strip_prefix("$ ") {
                is_kept = level == Level::Quick && command.starts_with("gonio reconstruct ");
                if is_kept {
                    bench.shown(&format!("{command} --help"));
                    now += &format!("{line}\n");
                    continue;
                }
                let shown = bench.shown(command);
                // Progress that a slow machine prints.
                let is_progress = |l: &&str| l.starts_with("gonio: ") && l.contains(" left  ");
                let lines = shown.split_inclusive('\n');
                let shown: String = lines.filter(|line| !is_progress(line)).collect();
                now += &format!("{line}\n{shown}");
                if !shown.is_empty() && !shown.ends_with('\n') {
                    now.push('\n');
                }
            } else if line == "```" {
                now += "```\n";
                break;
            } else if is_kept {
                now += &format!("{line}\n");
            }
        }
    }
    now
}

levels! {
    the_laboratory_s_page_shows_what_its_commands_print: "thorough: it reconstructs three times";
}

fn the_laboratory_s_page_shows_what_its_commands_print(level: Level) {
    let bench = Bench::new();
    let page = read("src/docs/laboratory.md");
    let now = played(&bench, &page, level);
    if level == Level::Thorough && env::var_os("GONIO_BLESS").is_some() {
        fs::write(of_repository("src/docs/laboratory.md"), &now).unwrap();
        return;
    }
    let commands = page.matches("\n$ gonio ").count();
    assert!(commands >= 8, "its commands are gone");
    for (then, now) in page.lines().zip(now.lines()) {
        assert_eq!(
            then, now,
            "src/docs/laboratory.md shows what is not printed today: \
             GONIO_BLESS=1 cargo test --test cli laboratory -- --include-ignored writes its outputs anew"
        );
    }
    assert_eq!(page.lines().count(), now.lines().count());
    let made = [
        "poses.csv",
        "left.csv",
        "copy.binary",
        "copy.png",
        "where.svg",
    ];
    for file in &made[..level.of(2, 5)] {
        assert!(bench.path(file).exists(), "{file}");
    }
}
