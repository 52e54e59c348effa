//! What happens to a run on its way: it is killed, the disk is full or may not be written, another is in its folder, its
//! data change, nothing reads what it prints. Run again, it has the results of one that nothing happened to, and nothing that
//! was finished is made again.

use super::common::{Level, levels, says, table};
use super::{Bench, SMALL, assert_same, finished, results, words};
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

const RECORDS: &str = "results.jsonl";

/// Command lines of a run: whole, and what is done again after a fault.
const WHOLE: &str = "run c.toml -q -o whole";
const AGAIN: &str = "run c.toml -q -o killed";

/// A study with pictures, and an acquisition by an instrument in minutes.
fn configs() -> [String; 2] {
    let small = SMALL.replace("seeds = [1, 2]", "seeds = [1]");
    let minutes = small.replace("budgets = [60, 150]", "budgets = []\nminutes = [2]");
    let one = small.replace("{ kind = \"lambert\" }, ", "");
    let one = one.replace("[60, 150]", "[60]");
    // Its schedules are written as they are measured, slices and pictures as they are drawn.
    let pictures = "pictures = { resolution = 8, samples = 4, budget = 60 }\noutput = { schedules = \"csv\", slices = true }";
    let machine = "instrument = [{ preset = \"cornell\" }]\noutput = { schedules = \"csv\" }";
    [
        format!("experiment = \"study\"\n{one}{pictures}\n"),
        format!("{minutes}{machine}\n"),
    ]
}

/// A bench with a config, `c.toml`, and the results of a run of it in `whole`.
fn whole(text: &str) -> (Bench, Vec<(String, Vec<u8>)>) {
    let bench = Bench::of(text);
    bench.good(WHOLE);
    let expected = results(&bench, "whole");
    (bench, expected)
}

/// No file of a bench is one that was being written.
fn assert_no_parts(bench: &Bench) {
    let left = bench.files("");
    let is_part = |file: &String| file.contains(".part") || file.contains(".tmp");
    assert!(!left.iter().any(is_part), "{left:?}");
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
        let is_drawn = file.contains('/') && !name.starts_with('.');
        let expected = expected.iter().find(|(name, _)| is_drawn && *name == file);
        let is_whole = expected.is_none_or(|(_, whole)| bytes == *whole);
        assert!(is_whole, "{file} is not whole");
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
        let start = Instant::now();
        let (bench, expected) = whole(&text);
        let whole = start.elapsed().as_secs_f64();
        let mut before: Vec<String> = Vec::new();
        for kill in 0..level.of(2, 24) {
            let mut run = bench.started(AGAIN);
            // Any moment of a run, and those of a start more often: what goes on has less to do.
            let moment = (f64::from(kill + 1) * 0.618_034).fract();
            std::thread::sleep(Duration::from_secs_f64(moment * moment * whole));
            run.kill().unwrap();
            let ended = run.wait().unwrap().success();
            let after = finished(&bench, "killed", RECORDS);
            assert!(holds(&after, &before), "finished rows are lost: {kill}");
            before = after;
            assert_whole(&bench, "killed", &expected);
            if ended {
                assert_same(&expected, &results(&bench, "killed"));
                fs::remove_dir_all(bench.path("killed")).unwrap();
                before.clear();
            }
        }
        bench.good(AGAIN);
        assert!(holds(&finished(&bench, "killed", RECORDS), &before));
        assert_same(&expected, &results(&bench, "killed"));
        assert_no_parts(&bench);
    }
}

#[test]
fn a_table_of_random_paths_that_is_killed_goes_on() {
    let bench = Bench::new();
    let brushed = "kind = \"smith-multiple\", alpha = [0.3, 0.6], paths = 4";
    for (file, seed) in [("c.toml", 1), ("other.toml", 2)] {
        let material = format!("material = [{{ {brushed}, seed = {seed} }}]\n");
        bench.write(file, material);
    }
    bench.good("tabulate c.toml -o whole.bin");
    assert_no_parts(&bench);
    let part = bench.path("killed.bin.part");
    let kept = || fs::metadata(&part).map_or(0, |of| of.len());
    for bytes in [1, 800_000] {
        let mut table = bench.started("tabulate c.toml -o killed.bin");
        while kept() < bytes && table.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        table.kill().unwrap();
        table.wait().unwrap();
        assert!(kept() >= bytes && !bench.path("killed.bin").exists());
    }
    bench.does(
        "2 | tabulate other.toml -o killed.bin | killed.bin.part … --force
         0 | tabulate c.toml -o killed.bin | gonio: goes on from ",
    );
    let [whole, killed] = ["whole.bin", "killed.bin"].map(|name| bench.read_bytes(name));
    assert!(whole == killed && !part.exists());
}

/// The commands that print, each of which can do its work in one folder.
const PRINTING: &str = "
    --help
    --version
    run --help
    list
    list --json
    check c.toml
    check c.toml --json
    schema config
    completions bash
    man
    run c.toml -q -o run
    schedule c.toml -o -
    measure p.csv --config c.toml -o r.csv --force
    tabulate c.toml -o t.bin --force";

#[test]
#[cfg(target_os = "linux")]
fn results_that_cannot_be_printed_are_an_error() {
    let (bench, expected) = whole("budgets = [9]\nmaterial = [{ kind = \"lambert\" }]\n");
    bench.good("schedule c.toml -o p.csv");
    for [args] in table(PRINTING) {
        let full = fs::OpenOptions::new().write(true).open("/dev/full");
        let output = bench.command(args).stdout(full.unwrap()).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args}: {stderr}");
        let told = stderr.lines().filter(|l| l.starts_with("gonio: stdout: "));
        assert_eq!(told.count(), 1, "{args}: {stderr}");
        // Closed ones are as if nothing reads: no file that is opened takes their place.
        let mut closed = by_shell(&bench, "exec \"$0\" \"$@\" <&- >&-", args);
        let closed = closed.output().unwrap();
        assert_eq!(closed.status.code(), Some(0), "{args}");
        assert!(closed.stdout.is_empty());
    }
    assert_same(&expected, &results(&bench, "run"));
    assert_no_parts(&bench);
}

/// A command line that a line of the shell starts, as `$0` and what follows.
pub fn by_shell(bench: &Bench, shell: &str, args: &str) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", shell, env!("CARGO_BIN_EXE_gonio")]);
    command.args(words(args)).current_dir(bench.path(""));
    command
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
    let built = env!("CARGO_BIN_EXE_gonio");
    let linked = fs::hard_link(built, &program);
    linked
        .or_else(|_| fs::copy(built, &program).map(drop))
        .unwrap();
    if root {
        // The folder is only ours at first.
        fs::set_permissions(&dir, fs::Permissions::from_mode(0o777)).unwrap();
    }
    let run = move |args: &str| {
        let mut command = Command::new(&program);
        command.args(words(args)).current_dir(&dir);
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
    // Ends with a code, and with a sentence that begins with a place where it is not 0.
    let ends = |args: &str, code: i32, place: &str| {
        let output = run(args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args}: {stderr}");
        if code != 0 {
            assert!(stderr.starts_with(&format!("gonio: {place}")), "{stderr}");
            assert_eq!(stderr.lines().count(), 1, "{args}: {stderr}");
            says(&stderr, "ermission denied");
        }
    };
    let [text, _] = configs();
    bench.write("c.toml", text);
    ends(WHOLE, 0, "");
    fs::create_dir(bench.path("closed")).unwrap();
    mode("closed", 0o555);
    for [args, place] in table(
        "run c.toml -q -o closed | closed
         run c.toml -q -o closed/run | closed/run
         init -o closed/a.toml | closed/a.toml
         schedule small.toml -o closed/all/ | closed/all
         tabulate small.toml --material lambert -o closed/t.bin | closed/t.bin",
    ) {
        ends(args, 2, place);
    }
    assert!(bench.files("closed").is_empty());
    // What may not be read.
    bench.write("p.csv", "theta_i_deg,theta_o_deg,phi_o_deg,value\n");
    for (args, code, file) in [
        ("reconstruct p.csv", 3, "p.csv"),
        ("check c.toml", 2, "c.toml"),
    ] {
        mode(file, 0o000);
        ends(args, code, file);
        mode(file, 0o666);
    }
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_said_and_room_is_all_that_it_takes() {
    for text in configs() {
        let (bench, expected) = whole(&text);
        // No file may be larger than so many blocks of 512 or 1024 bytes.
        for blocks in [0, 4] {
            let line = format!("ulimit -f {blocks}; trap '' XFSZ; exec \"$0\" \"$@\"");
            let mut run = by_shell(&bench, &line, "run c.toml -q -o full");
            let output = run.output().unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{blocks}: {stderr}");
            assert!(stderr.starts_with("gonio: full"), "{stderr}");
        }
        bench.good("run c.toml -q -o full");
        assert_same(&expected, &results(&bench, "full"));
    }
}
