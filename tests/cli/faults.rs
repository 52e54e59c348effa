//! What happens to a run on its way: it is killed, the disk is full or may not be written, another is in its folder, its
//! folder is moved, its data change, nobody hears what it prints. Whoever runs it again has the results of one that
//! nothing happened to, and nothing that was finished is made again.

use super::common::{Level, levels, says};
use super::{Bench, Line, SMALL, assert_same, finished, results};
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const RECORDS: &str = "results.jsonl";

/// A study with pictures, and an acquisition by an instrument in minutes.
fn configs() -> [String; 2] {
    let small = SMALL.replace("budgets = [60, 150]\nseeds = [1, 2]\n", "seeds = [1]\n");
    let one = small.replace("[[material]]\nkind = \"lambert\"\n", "");
    [
        format!(
            "experiment = \"study\"\nbudgets = [60]\n{one}\n\
             [pictures]\nresolution = 8\nsamples = 4\nbudget = 60\n"
        ),
        format!(
            "budgets = []\nminutes = [2]\n{small}\n[[instrument]]\npreset = \"cornell\"\n\n\
             [output]\nschedules = \"csv\"\n"
        ),
    ]
}

/// Whatever is there under its name is whole: what is drawn or laid out, and the report to its end.
fn assert_whole(bench: &Bench, run: &str, expected: &[(String, Vec<u8>)]) {
    if !bench.path(run).exists() {
        return;
    }
    for file in bench.files(run) {
        let bytes = fs::read(bench.path(run).join(&file)).unwrap();
        if file.ends_with("report.html") {
            assert!(bytes.ends_with(b"</html>\n") || bytes.ends_with(b"</html>"));
        }
        let name = file.rsplit('/').next().unwrap();
        let expected = expected.iter().find(|(name, _)| *name == file);
        if let (true, false, Some((_, whole))) =
            (file.contains('/'), name.starts_with('.'), expected)
        {
            assert!(bytes == *whole, "{file} is not whole");
        }
    }
}

/// True if every line of `before` is there, to the last digit of its seconds.
fn holds(after: &[String], before: &[String]) -> bool {
    before.iter().all(|line| after.contains(line))
}

levels! {
    a_run_that_is_killed_again_and_again_ends_as_one_that_is_not: "thorough: 24 kills of each run";
}

fn a_run_that_is_killed_again_and_again_ends_as_one_that_is_not(level: Level) {
    for text in configs() {
        let bench = Bench::of(text);
        let start = Instant::now();
        bench.good("run c.toml -q -o whole");
        let whole = start.elapsed().as_secs_f64();
        let expected = results(&bench, "whole");
        let again = ["run", "c.toml", "-q", "-o", "killed"];
        let mut before: Vec<String> = Vec::new();
        for kill in 0..level.of(2, 24) {
            let mut run = bench.command(again);
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
            let after = finished(&bench, "killed", RECORDS);
            assert!(
                holds(&after, &before),
                "kill {kill}: finished rows are lost"
            );
            before = after;
            assert_whole(&bench, "killed", &expected);
            if ended {
                assert_same(&expected, &results(&bench, "killed"));
                fs::remove_dir_all(bench.path("killed")).unwrap();
                before.clear();
            }
        }
        bench.good(again);
        assert!(holds(&finished(&bench, "killed", RECORDS), &before));
        assert_same(&expected, &results(&bench, "killed"));
        let left = bench.files("killed");
        assert!(!left.iter().any(|file| file.contains(".tmp")), "{left:?}");
    }
}

#[test]
#[ignore = "thorough: the pictures of a study, drawn three times"]
fn a_run_that_is_killed_while_it_draws_leaves_no_half_of_a_picture() {
    let bench = Bench::new();
    // Its schedules are written as they are measured, slices and pictures as they are drawn.
    let [study, _] = configs();
    let text = study + "\n[output]\nschedules = \"csv\"\nslices = true\n";
    bench.write("c.toml", text);
    bench.good("run c.toml -q -o whole");
    let expected = results(&bench, "whole");
    let again = ["run", "c.toml", "-q", "-o", "killed"];
    let drawn = || match bench.path("killed").exists() {
        true => bench
            .files("killed")
            .iter()
            .filter(|file| file.contains('/'))
            .count(),
        false => 0,
    };
    for files in [1, 9] {
        let mut run = bench.command(again);
        run.stderr(Stdio::null()).stdout(Stdio::null());
        let mut run = run.spawn().unwrap();
        while drawn() < files && run.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        run.kill().unwrap();
        run.wait().unwrap();
        assert_whole(&bench, "killed", &expected);
    }
    bench.good(again);
    assert_same(&expected, &results(&bench, "killed"));
    let left = bench.files("killed");
    assert!(!left.iter().any(|file| file.contains(".part")), "{left:?}");
}

#[test]
fn a_table_of_random_paths_that_is_killed_goes_on() {
    let bench = Bench::new();
    let material = |seed: u64| {
        format!(
            "[[material]]\nkind = \"smith-multiple\"\nalpha = [0.3, 0.6]\npaths = 4\nseed = {seed}\n"
        )
    };
    bench.write("c.toml", material(1));
    bench.write("other.toml", material(2));
    bench.good("tabulate c.toml -o whole.bin");
    assert!(!bench.path("whole.bin.part").exists());
    let again = ["tabulate", "c.toml", "-o", "killed.bin"];
    let part = bench.path("killed.bin.part");
    let kept = || fs::metadata(&part).map_or(0, |of| of.len());
    for bytes in [1, 800_000] {
        let mut table = bench.command(again);
        table.stderr(Stdio::null()).stdout(Stdio::null());
        let mut table = table.spawn().unwrap();
        while kept() < bytes && table.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        table.kill().unwrap();
        table.wait().unwrap();
        assert!(kept() >= bytes && !bench.path("killed.bin").exists());
    }
    bench.refuses(
        "tabulate other.toml -o killed.bin",
        2,
        "killed.bin.part … --force",
    );
    let output = bench.gonio(again);
    let told = String::from_utf8(output.stderr).unwrap();
    says(&told, "gonio: goes on from ");
    let [whole, killed] = ["whole.bin", "killed.bin"].map(|name| fs::read(bench.path(name)));
    assert!(whole.unwrap() == killed.unwrap() && !part.exists());
}

#[test]
fn a_folder_that_is_moved_away_ends_its_run() {
    for text in configs() {
        let bench = Bench::of(text);
        bench.good("run c.toml -q -o whole");
        let again = ["run", "c.toml", "-q", "-o", "here"];
        let mut run = bench.command(again);
        let run = run.stderr(Stdio::piped()).stdout(Stdio::null()).spawn();
        let run = run.unwrap();
        while finished(&bench, "here", RECORDS).is_empty() {
            std::thread::sleep(Duration::from_millis(1));
        }
        fs::rename(bench.path("here"), bench.path("away")).unwrap();
        let ended = run.wait_with_output().unwrap();
        let stderr = String::from_utf8(ended.stderr).unwrap();
        // It may have been at its end already.
        if !ended.status.success() {
            assert_eq!(ended.status.code(), Some(2), "{stderr}");
            assert!(stderr.starts_with("gonio: here"), "{stderr}");
            assert_eq!(stderr.lines().count(), 1, "{stderr}");
            assert!(!bench.path("here").exists());
        }
        fs::rename(bench.path("away"), bench.path("here")).unwrap();
        bench.good(again);
        assert_same(&results(&bench, "whole"), &results(&bench, "here"));
    }
}

/// The commands that print, each of which can do its work in a folder of [`prints`].
const PRINTING: [&str; 14] = [
    "--help",
    "--version",
    "run --help",
    "list",
    "list --json",
    "check c.toml",
    "check c.toml --json",
    "schema config",
    "completions bash",
    "man",
    "run c.toml -q -o run",
    "schedule c.toml -o -",
    "measure p.csv --config c.toml -o r.csv --force",
    "tabulate c.toml -o t.bin --force",
];

#[test]
#[cfg(target_os = "linux")]
fn results_that_cannot_be_printed_are_an_error() {
    let bench = Bench::new();
    let text = "budgets = [9]\n[[material]]\nkind = \"lambert\"\n";
    bench.write("c.toml", text);
    bench.good("schedule c.toml -o p.csv");
    bench.good("run c.toml -q -o whole");
    let expected = results(&bench, "whole");
    for args in PRINTING {
        let full = fs::OpenOptions::new().write(true).open("/dev/full");
        let mut command = bench.command(args);
        command.stdout(full.unwrap());
        let output = command.output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
        let told: Vec<_> = stderr
            .lines()
            .filter(|line| line.starts_with("gonio: stdout: "))
            .collect();
        assert_eq!(told.len(), 1, "{args:?}: {stderr}");
        // Closed ones are as if nobody listens: no file that is opened takes their place.
        let mut closed = Command::new("sh");
        closed.args([
            "-c",
            "exec \"$0\" \"$@\" <&- >&-",
            env!("CARGO_BIN_EXE_gonio"),
        ]);
        let closed = closed
            .args(args.words())
            .current_dir(bench.path(""))
            .output()
            .unwrap();
        assert_eq!(closed.status.code(), Some(0), "{args:?}");
        assert!(closed.stdout.is_empty());
    }
    assert_same(&expected, &results(&bench, "run"));
    let files = bench.files("");
    assert!(
        !files.iter().any(|file| file.contains(".part")),
        "{files:?}"
    );
}

/// The program as a user who may not write everywhere, as root may; `None`, aloud, where root cannot be another.
#[cfg(unix)]
fn unprivileged(bench: &Bench) -> Option<impl Fn(&str) -> std::process::Output> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::os::unix::process::CommandExt;
    const NOBODY: u32 = 65_534;
    let root = fs::metadata("/proc/self").is_ok_and(|me| me.uid() == 0);
    let (dir, program) = (bench.path(""), bench.path("gonio"));
    // Where the program is others may not look. A copy cannot be run as long as another thread forks.
    let linked = fs::hard_link(env!("CARGO_BIN_EXE_gonio"), &program);
    linked
        .or_else(|_| fs::copy(env!("CARGO_BIN_EXE_gonio"), &program).map(drop))
        .unwrap();
    if root {
        // The folder is only ours at first.
        fs::set_permissions(&dir, fs::Permissions::from_mode(0o777)).unwrap();
    }
    let run = move |args: &str| {
        let mut command = Command::new(&program);
        command
            .args(args.words())
            .current_dir(&dir)
            .stdin(Stdio::null());
        if root {
            command.uid(NOBODY).gid(NOBODY);
        }
        command.output()
    };
    match run("--version") {
        Ok(output) if output.status.success() => Some(move |args: &str| run(args).unwrap()),
        other => {
            eprintln!("skipped: no other user can run the program here ({other:?})");
            None
        }
    }
}

#[test]
#[cfg(unix)]
fn what_may_not_be_written_or_read_is_said() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Bench::new();
    let mode = |name: &str, mode| {
        fs::set_permissions(bench.path(name), fs::Permissions::from_mode(mode)).unwrap();
    };
    let Some(run) = unprivileged(&bench) else {
        return;
    };
    let good = |args: &str| {
        let output = run(args);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {stderr}");
    };
    let refused = |args: &str, code, place: &str| {
        let output = run(args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {stderr}");
        assert!(stderr.starts_with(&format!("gonio: {place}")), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{args:?}: {stderr}");
        says(&stderr, "ermission denied");
    };
    let [text, _] = configs();
    bench.write("c.toml", text);
    good("run c.toml -q -o whole");
    let expected = results(&bench, "whole");
    fs::create_dir(bench.path("closed")).unwrap();
    mode("closed", 0o555);
    for (args, place) in [
        ("run c.toml -q -o closed", "closed"),
        ("run c.toml -q -o closed/run", "closed/run"),
        ("init -o closed/a.toml", "closed/a.toml"),
        ("schedule small.toml -o closed/all/", "closed/all"),
        (
            "tabulate small.toml --material lambert -o closed/t.bin",
            "closed/t.bin",
        ),
    ] {
        refused(args, 2, place);
    }
    assert!(bench.files("closed").is_empty());
    // A run some of whose files were made by somebody else.
    let records = bench.read_bytes("whole/results.jsonl");
    let half = records.iter().position(|b| *b == b'\n').unwrap() + 1;
    fs::create_dir(bench.path("half")).unwrap();
    bench.write("half/results.jsonl", &records[..half]);
    mode("half", 0o777);
    mode("half/results.jsonl", 0o444);
    refused("run c.toml -q -o half", 2, "half");
    mode("half/results.jsonl", 0o666);
    mode("half", 0o555);
    refused("run c.toml -q -o half", 2, "half");
    mode("half", 0o777);
    good("run c.toml -q -o half");
    assert_same(&expected, &results(&bench, "half"));
    // What may not be read.
    bench.write("p.csv", "theta_i_deg,theta_o_deg,phi_o_deg,value\n");
    for (args, code, file) in [
        ("reconstruct p.csv", 3, "p.csv"),
        ("check c.toml", 2, "c.toml"),
    ] {
        mode(file, 0o000);
        refused(args, code, file);
        mode(file, 0o666);
    }
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_said_and_room_is_all_that_it_takes() {
    for text in configs() {
        let bench = Bench::of(text);
        bench.good("run c.toml -q -o whole");
        let expected = results(&bench, "whole");
        // No file may be larger than so many blocks of 512 or 1024 bytes.
        for blocks in [0, 4] {
            let line = format!("ulimit -f {blocks}; trap '' XFSZ; exec \"$0\" \"$@\"");
            let mut run = Command::new("sh");
            run.args(["-c", &line, env!("CARGO_BIN_EXE_gonio")]);
            run.args(["run", "c.toml", "-q", "-o", "full"]);
            let output = run.current_dir(bench.path("")).output().unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{blocks}: {stderr}");
            assert!(stderr.starts_with("gonio: full"), "{stderr}");
        }
        bench.good("run c.toml -q -o full");
        assert_same(&expected, &results(&bench, "full"));
    }
}

#[test]
fn two_runs_in_one_folder_do_not_mix() {
    for text in configs() {
        let bench = Bench::of(text);
        bench.good("run c.toml -q -o whole");
        let again = ["run", "c.toml", "-q", "-o", "both"];
        let runs = [(); 2].map(|()| bench.command(again).stderr(Stdio::piped()).spawn().unwrap());
        let ended = runs.map(|run| run.wait_with_output().unwrap());
        let codes = ended.each_ref().map(|run| run.status.code());
        assert!(codes.contains(&Some(0)), "{codes:?}");
        for run in ended.iter().filter(|run| !run.status.success()) {
            let stderr = String::from_utf8_lossy(&run.stderr);
            assert_eq!(run.status.code(), Some(2), "{stderr}");
            says(&stderr, "another");
        }
        assert_same(&results(&bench, "whole"), &results(&bench, "both"));
    }
}

#[test]
fn data_that_change_between_runs_are_measured_again() {
    let bench = Bench::new();
    let table = |alpha: f64| {
        let text = format!("[[material]]\nkind = \"ggx\"\nalpha = {alpha}\n");
        bench.write("m.toml", text);
        bench.good("tabulate m.toml -o table.binary -q --force");
    };
    let small = SMALL.replace(
        "budgets = [60, 150]\nseeds = [1, 2]",
        "budgets = [60]\nseeds = [1]",
    );
    let text = small.replace(
        "kind = \"ggx\"\nalpha = 0.4",
        "kind = \"merl\"\npath = \"table.binary\"",
    );
    bench.write("c.toml", text);
    table(0.3);
    bench.good("run c.toml -q -o a");
    let before = finished(&bench, "a", RECORDS);
    table(0.5);
    bench.good("run c.toml -q -o a");
    bench.good("run c.toml -q -o new");
    // Rows of the table as it was stay in the file of records, behind the others, and nowhere else.
    let [of_new, of_a] = ["new", "a"].map(|run| {
        let files = results(&bench, run).into_iter();
        let (records, others): (Vec<_>, Vec<_>) = files.partition(|f| f.0 == "results.jsonl");
        (String::from_utf8(records[0].1.clone()).unwrap(), others)
    });
    assert_same(&of_new.1, &of_a.1);
    assert!(of_a.0.starts_with(&of_new.0));
    assert!(holds(&finished(&bench, "a", RECORDS), &before));
}
