//! What happens to a run on its way: it is killed, the disk is full, another is in its folder, its data change. Whoever runs
//! it again has the results of one that nothing happened to, and nothing that was finished is made again.

use super::{Bench, SMALL, assert_same, results};
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Kills of each kind of run, `GONIO_KILLS` or a few.
fn kills() -> u32 {
    let kills = std::env::var("GONIO_KILLS");
    kills.map_or(4, |kills| kills.parse().expect("a number of kills"))
}

/// A study with pictures, and an acquisition by an instrument in minutes.
fn configs() -> [String; 2] {
    let small = SMALL.replace("budgets = [60, 150]\n", "");
    [
        format!(
            "experiment = \"study\"\nbudgets = [60]\n{small}\n\
             [pictures]\nresolution = 16\nsamples = 4\nbudget = 60\n"
        ),
        format!(
            "budgets = []\nminutes = [2]\n{small}\n[[instrument]]\npreset = \"cornell\"\n\n\
             [output]\nschedules = \"csv\"\n"
        ),
    ]
}

/// Lines of the records of a run that are whole.
fn finished(bench: &Bench, run: &str) -> Vec<String> {
    let bytes = fs::read(bench.path(run).join("results.jsonl")).unwrap_or_default();
    let end = bytes.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    let text = String::from_utf8(bytes[..end].to_vec()).expect("whole lines are text");
    text.lines().map(str::to_owned).collect()
}

/// True if every line of `before` is there, to the last digit of its seconds.
fn holds(after: &[String], before: &[String]) -> bool {
    before.iter().all(|line| after.contains(line))
}

#[test]
fn a_run_that_is_killed_again_and_again_ends_as_one_that_is_not() {
    for text in configs() {
        let bench = Bench::new();
        fs::write(bench.path("c.toml"), text).unwrap();
        let start = Instant::now();
        bench.good(&["run", "c.toml", "-q", "-o", "whole"]);
        let whole = start.elapsed().as_secs_f64();
        let expected = results(&bench, "whole");
        let again = ["run", "c.toml", "-q", "-o", "killed"];
        let mut before: Vec<String> = Vec::new();
        for kill in 0..kills() {
            let mut run = bench.command(&again);
            let mut run = run
                .stderr(Stdio::null())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            // Any moment of a run, and those of a start more often: what goes on has less to do.
            let moment = (f64::from(kill + 1) * 0.618_034).fract();
            std::thread::sleep(Duration::from_secs_f64(moment * moment * whole));
            run.kill().unwrap();
            let ended = run.wait().unwrap().success();
            let after = finished(&bench, "killed");
            assert!(
                holds(&after, &before),
                "kill {kill}: finished rows are lost"
            );
            before = after;
            if ended {
                assert_same(&expected, &results(&bench, "killed"));
                fs::remove_dir_all(bench.path("killed")).unwrap();
                before.clear();
            }
        }
        bench.good(&again);
        assert!(holds(&finished(&bench, "killed"), &before));
        assert_same(&expected, &results(&bench, "killed"));
        let left = bench.files("killed");
        assert!(!left.iter().any(|file| file.contains(".tmp")), "{left:?}");
    }
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_said_and_room_is_all_that_it_takes() {
    for text in configs() {
        let bench = Bench::new();
        fs::write(bench.path("c.toml"), text).unwrap();
        bench.good(&["run", "c.toml", "-q", "-o", "whole"]);
        let expected = results(&bench, "whole");
        // No file may be larger than so many blocks of 512 or 1024 bytes.
        for blocks in [0, 1, 4, 16] {
            let line = format!("ulimit -f {blocks}; trap '' XFSZ; exec \"$0\" \"$@\"");
            let mut run = Command::new("sh");
            run.args(["-c", &line, env!("CARGO_BIN_EXE_gonio")]);
            run.args(["run", "c.toml", "-q", "-o", "full"]);
            let output = run.current_dir(bench.path("")).output().unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{blocks}: {stderr}");
            assert!(stderr.starts_with("gonio: full"), "{stderr}");
        }
        bench.good(&["run", "c.toml", "-q", "-o", "full"]);
        assert_same(&expected, &results(&bench, "full"));
    }
}

#[test]
fn two_runs_in_one_folder_do_not_mix() {
    for text in configs() {
        let bench = Bench::new();
        fs::write(bench.path("c.toml"), text).unwrap();
        bench.good(&["run", "c.toml", "-q", "-o", "whole"]);
        let again = ["run", "c.toml", "-q", "-o", "both"];
        let runs = [(); 2].map(|()| {
            bench
                .command(&again)
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        });
        let ended = runs.map(|run| run.wait_with_output().unwrap());
        let codes = ended.each_ref().map(|run| run.status.code());
        assert!(codes.contains(&Some(0)), "{codes:?}");
        for run in ended.iter().filter(|run| !run.status.success()) {
            let stderr = String::from_utf8_lossy(&run.stderr);
            assert_eq!(run.status.code(), Some(2), "{stderr}");
            assert!(stderr.contains("another"), "{stderr}");
        }
        assert_same(&results(&bench, "whole"), &results(&bench, "both"));
    }
}

#[test]
fn data_that_change_between_runs_are_measured_again() {
    let bench = Bench::new();
    let table = |alpha: f64| {
        let text = format!("[[material]]\nkind = \"ggx\"\nalpha = {alpha}\n");
        fs::write(bench.path("m.toml"), text).unwrap();
        bench.good(&["tabulate", "m.toml", "-o", "table.binary", "-q", "--force"]);
    };
    let small = SMALL.replace("budgets = [60, 150]", "budgets = [60]");
    let text = small.replace(
        "kind = \"ggx\"\nalpha = 0.4",
        "kind = \"merl\"\npath = \"table.binary\"",
    );
    fs::write(bench.path("c.toml"), text).unwrap();
    table(0.3);
    bench.good(&["run", "c.toml", "-q", "-o", "a"]);
    let before = finished(&bench, "a");
    table(0.5);
    bench.good(&["run", "c.toml", "-q", "-o", "a"]);
    bench.good(&["run", "c.toml", "-q", "-o", "new"]);
    // Rows of the table as it was stay in the file of records, behind the others, and nowhere else.
    let [of_new, of_a] = ["new", "a"].map(|run| {
        let files = results(&bench, run).into_iter();
        let (records, others): (Vec<_>, Vec<_>) = files.partition(|f| f.0 == "results.jsonl");
        (String::from_utf8(records[0].1.clone()).unwrap(), others)
    });
    assert_same(&of_new.1, &of_a.1);
    assert!(of_a.0.starts_with(&of_new.0));
    assert!(holds(&finished(&bench, "a"), &before));
}
