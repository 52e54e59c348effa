//! Schedules for instruments.

use super::Bench;
use super::common::{says, table};
use std::process::Stdio;

#[test]
fn a_run_writes_a_file_for_every_schedule_that_is_asked() {
    let bench = Bench::new();
    // Without limits as many poses are as many readings, so one schedule has two names.
    let text = bench.read("small.toml");
    let text = text.replace("[60, 150]", "[60]\nreadings = [60]");
    let instrument = "[[instrument]]\npreset = \"utia\"\nlimits = false\norder = \"sorted\"\n";
    let more = format!("{instrument}[output]\nschedules = \"csv\"\n");
    bench.write("two.toml", format!("{text}{more}"));
    bench.good("run two.toml -o run");
    let names = bench.files("run/schedules");
    // 2 parametrizations × 2 sets × 2 allowances × 2 seeds, once for both materials.
    assert_eq!(names.len(), 16, "{names:?}");
    bench.good("schedule two.toml --skip-unreachable -o folder/");
    assert_eq!(bench.files("folder"), names);
    for name in names {
        let of_run = bench.read(&format!("run/schedules/{name}"));
        assert_eq!(bench.read(&format!("folder/{name}")), of_run, "{name}");
    }
}

#[test]
fn several_schedules_need_a_choice_or_a_folder() {
    let bench = Bench::new();
    bench.does(
        "2 | schedule small.toml | 16 schedules … --warp (none, theta_h:square-root) … --budget … -o DIR/
         0 | schedule small.toml -o all/ --format json-lines",
    );
    assert_eq!(bench.files("all").len(), 16);
    bench.does(
        "2 | schedule lambert --parametrization hybrid --budget 9 -o one.txt | one.txt: no format of schedules is known
         0 | schedule lambert --parametrization hybrid --budget 9 -o one.txt --format csv
         2 | schedule lambert --parametrization hybrid --budget 9 -o one.txt --format csv | --force",
    );
}

#[test]
fn a_schedule_may_be_of_any_size() {
    let bench = Bench::new();
    let one = "schedule small.toml --warp none --seed 1";
    let random = "--sample-set random";
    let of = |size: &str| bench.good(format!("{one} {random} {size} -o s.csv --force"));
    for [size, poses] in table("1 | 1 pose\\n\n7 | 7 poses\\n\n2e3 | 2000 poses\\n") {
        says(&of(&format!("--budget {size}")), &format!(": {poses}"));
    }
    bench.refuses(format!("{one} {random} --minutes 3"), 2, "--instrument");
    // Negative numbers are values.
    for [option, size, allowed] in table(
        "--budget | 0 | from 1 to 10000000
         --budget | -1 | budget = -1: allowed is a whole number from 1 to
         --budget | 16k | from 1 to 10000000
         --minutes | 0 | (0, 525600]
         --minutes | -0.5 | '-0.5' for '--minutes <M>': allowed: a number in (0,",
    ) {
        let stderr = bench.ends(format!("{one} {option} {size}"), 2);
        says(&stderr, size);
        says(&stderr, allowed);
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let bench = Bench::new();
    let one = "--warp none --sample-set random --seed 1";
    let mut command = bench.command(format!("schedule small.toml --set budgets=[20000] {one}"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""));
}

#[test]
fn a_schedule_needs_no_material() {
    let bench = Bench::new();
    let config = "budgets = [100]\nparametrization = [{ kind = \"hybrid\" }]\n";
    bench.write("plan.toml", config);
    let satin = format!("{config}material = [{{ kind = \"ggx\" }}]\n");
    bench.write("satin.toml", satin);
    let utia = "--instrument utia --skip-unreachable";
    let schedule = |file: &str| bench.ended(&format!("schedule {file} {utia}"), 0);
    let [poses, note] = schedule("plan.toml");
    let told = "gonio: plan.toml names no material; the poses are for isotropic, reciprocal, bilateral ones\n";
    assert_eq!(note, told);
    assert!(poses == schedule("satin.toml")[0]);
    // What measures needs one.
    bench.refuses("run plan.toml", 2, "material is missing");
}
