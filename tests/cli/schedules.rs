//! Schedules for instruments.

use super::common::says;
use super::{Bench, ONE_SCHEDULE};
use std::process::Stdio;

#[test]
fn schedules_say_the_same_in_both_formats() {
    let bench = Bench::new();
    let schedule = |more: &str| bench.good(format!("schedule small.toml {ONE_SCHEDULE} {more}"));
    schedule("-o s.csv");
    schedule("-o s.jsonl");
    let text = bench.read("s.csv");
    assert_eq!(schedule(""), text);
    assert_eq!(schedule("-o - --format json-lines"), bench.read("s.jsonl"));

    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let header: Vec<_> = reader.headers().unwrap().iter().map(String::from).collect();
    let expected = [
        "index",
        "theta_h_deg",
        "theta_d_deg",
        "phi_d_deg",
        "theta_i_deg",
        "phi_i_deg",
        "theta_o_deg",
        "phi_o_deg",
    ];
    assert_eq!(header, expected);
    for name in &header {
        assert!(
            text.contains(&format!("# {name}: ")),
            "the header explains {name}"
        );
    }
    let from_csv: Vec<Vec<f64>> = reader
        .records()
        .map(|r| r.unwrap().iter().map(|v| v.parse().unwrap()).collect())
        .collect();
    let text = bench.read("s.jsonl");
    let mut lines = text
        .lines()
        .map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap());
    let about = lines.next().unwrap();
    assert_eq!(about["header"]["poses"], from_csv.len());
    let from_json: Vec<Vec<f64>> = lines
        .map(|l| {
            header
                .iter()
                .map(|name| l[name].as_f64().unwrap())
                .collect()
        })
        .collect();
    assert!(from_csv == from_json);
    assert!((1..=150).contains(&from_csv.len()));
    for (i, row) in from_csv.iter().enumerate() {
        assert_eq!(row[0], i as f64);
        assert!(row[4] < 90.0 && row[6] < 90.0, "{row:?}");
    }
}

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
    let sentence = bench.refused("schedule small.toml", 2);
    says(
        &sentence,
        "16 schedules … --warp (none, theta_h:square-root) … --budget … -o DIR/",
    );
    bench.good("schedule small.toml -o all/ --format json-lines");
    assert_eq!(bench.files("all").len(), 16);
    let one = "schedule all.toml -o one.txt";
    bench.write(
        "all.toml",
        "budgets = [9]\nmaterial = [{ kind = \"lambert\" }]",
    );
    bench.refuses(one, 2, "one.txt: no format of schedules is known");
    bench.good(format!("{one} --format csv"));
    bench.refuses(format!("{one} --format csv"), 2, "--force");
}

#[test]
fn a_schedule_may_be_of_any_size() {
    let bench = Bench::new();
    let one = "schedule small.toml --warp none --seed 1";
    let random = "--sample-set random";
    let of = |size: &str| bench.good(format!("{one} {random} {size} -o s.csv --force"));
    assert!(of("--budget 1").contains(": 1 pose\n"));
    assert!(of("--budget 7").contains(": 7 poses\n"));
    assert!(of("--budget 2e3").contains(": 2000 poses\n"));
    let utia = "--instrument utia --skip-unreachable";
    let minutes = |minutes: &str| -> f64 {
        let said = of(&format!("{utia} --minutes {minutes}"));
        let found = said.trim().rsplit(", ").next().unwrap().split(' ').next();
        found.unwrap().parse().unwrap()
    };
    for [allowed, least] in [[2.25, 0.1], [30.5, 28.0]] {
        let found = minutes(&allowed.to_string());
        assert!(
            (least..=allowed + 0.05).contains(&found),
            "{allowed}: {found}"
        );
    }
    bench.refuses(format!("{one} {random} --minutes 3"), 2, "--instrument");
    for (option, size, allowed) in [
        ("--budget", "0", "from 1 to 10000000"),
        ("--budget", "2e7", "from 1 to 10000000"),
        ("--budget", "16k", "from 1 to 10000000"),
        ("--readings", "1.5", "from 1 to 10000000"),
        ("--minutes", "0", "(0, 525600]"),
        ("--minutes", "soon", "(0, 525600]"),
    ] {
        let stderr = bench.ends(format!("{one} {option} {size}"), 2);
        assert!(
            stderr.contains(size) && stderr.contains(allowed),
            "{stderr}"
        );
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let bench = Bench::new();
    let mut command = bench.command("schedule small.toml --set budgets=[20000]");
    let choice = ["--warp", "none", "--sample-set", "random", "--seed", "1"];
    command
        .args(choice)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""));
}

#[test]
fn a_schedule_needs_no_material() {
    let bench = Bench::new();
    let config = "budgets = [100]\n\n[[parametrization]]\nkind = \"hybrid\"\n";
    bench.write("plan.toml", config);
    let satin = format!("{config}\n[[material]]\nkind = \"ggx\"\n");
    bench.write("satin.toml", satin);
    let machine = "--instrument utia --skip-unreachable";
    let schedule = |file: &str| {
        let output = bench.gonio(format!("schedule {file} {machine}"));
        assert!(output.status.success());
        (output.stdout, String::from_utf8(output.stderr).unwrap())
    };
    let (poses, note) = schedule("plan.toml");
    assert_eq!(
        note,
        "gonio: plan.toml names no material; the poses are for isotropic, reciprocal, bilateral ones\n"
    );
    assert!(poses == schedule("satin.toml").0);
    // What measures needs one.
    bench.refuses("run plan.toml", 2, "material is missing");
}
