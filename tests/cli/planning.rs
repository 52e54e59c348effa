//! Planners as a user meets them: in configs, and from readings to the next poses.

use super::Bench;
use super::common::{Level, levels, says};
use super::pages::of_repository;
use std::fs;
use std::process::{Command, Output};

/// Runs the laboratory's script in a folder of the bench, for so many steps.
fn laboratory(bench: &Bench, folder: &str, steps: &str) -> Output {
    let folder = bench.path(folder);
    fs::create_dir_all(&folder).unwrap();
    let output = Command::new("sh")
        .arg(of_repository("tests/lab.sh"))
        .arg(env!("CARGO_BIN_EXE_gonio"))
        .arg(of_repository("configs/quickstart.toml"))
        .args(["ggx-0.3", "cornell", "3", steps])
        .current_dir(folder)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    output
}

/// The number after a word of a text.
pub fn after(text: &str, word: &str) -> f64 {
    let rest = text
        .split(word)
        .nth(1)
        .unwrap_or_else(|| panic!("no {word} in {text}"));
    let number = rest.split_whitespace().next().unwrap();
    number.trim_end_matches([',', ';']).parse().unwrap()
}

#[test]
fn readings_that_raise_an_expected_error_are_named() {
    let bench = Bench::new().with_configs();
    let measure = |n: u32, material: &str| {
        let line = format!(
            "measure p{n}.csv --config configs/quickstart.toml --material {material} -o r{n}.csv"
        );
        bench.good(&line);
    };
    bench.good("next --batch 8 -o p1.csv");
    measure(1, "lambert");
    bench.good("next r1.csv --batch 8 -o p2.csv");
    assert!(bench.read("p2.csv").contains("# assumes = \"kriging\"\n"));
    // What looked matte has a highlight, or has not.
    for (material, rises) in [("ggx-0.05", true), ("lambert", false)] {
        measure(2, material);
        let both = "next r1.csv r2.csv --mixed --batch 8 -o p3.csv";
        let told = bench.ends(both, 0);
        let sentence = "the readings of r2.csv raise the expected nrmse from ";
        assert_eq!(told.contains(sentence), rises, "{material}: {told}");
        fs::remove_file(bench.path("r2.csv")).unwrap();
        fs::remove_file(bench.path("p3.csv")).unwrap();
    }
}

#[test]
fn a_laboratory_goes_round_and_loses_nothing() {
    let bench = Bench::new();
    let whole = laboratory(&bench, "whole", "1000");
    // Broken off after every step.
    for _ in 0..6 {
        laboratory(&bench, "pieces", "1");
    }
    let pieces = laboratory(&bench, "pieces", "0");
    let mut files = 0;
    for file in fs::read_dir(bench.path("whole")).unwrap() {
        let file = file.unwrap();
        let again = bench.path("pieces").join(file.file_name());
        assert_eq!(fs::read(file.path()).unwrap(), fs::read(again).unwrap());
        files += 1;
    }
    assert_eq!(files, 6);
    let text = String::from_utf8(whole.stdout).unwrap();
    assert!(text.ends_with(&String::from_utf8(pieces.stdout).unwrap()));
    // 8, 8 and 16 readings; what is expected falls.
    says(&text, "so far: 16 poses, 16 readings");
    let expected: Vec<f64> = text
        .lines()
        .filter(|line| line.starts_with("now: ") || line.starts_with("then: "))
        .map(|line| after(line, "nrmse "))
        .collect();
    assert_eq!(expected.len(), 4, "{text}");
    assert!(
        expected[1] < expected[0] && expected[3] < expected[2],
        "{text}"
    );
}

#[test]
fn a_laboratory_is_told_when_to_stop() {
    let bench = Bench::new().with_configs();
    bench.good("next --batch 8 -o poses.csv");
    let config = "--config configs/quickstart.toml --material ggx-0.3";
    bench.good(format!("measure poses.csv {config} -o readings.csv"));
    let next = "next readings.csv --batch 8 -o more.csv --set target.nrmse=";
    let told = bench.good(format!("{next}9"));
    assert!(told.starts_with("stop: expected nrmse "), "{told}");
    assert!(!bench.path("more.csv").exists());
    bench.tells(format!("{next}1e-5"), "then: expected nrmse ");
    assert!(bench.path("more.csv").exists());
    // Where it is uncertain is drawn, though readings without noise have no uncertainty; nearest knows of no other.
    for (kind, is_known) in [("kriging", true), ("nearest", false)] {
        bench.good(format!(
            "reconstruct readings.csv --reconstruction {kind} --uncertainty {kind}.svg"
        ));
        let drawn = bench.read(&format!("{kind}.svg"));
        assert_eq!(drawn.contains("of its readings and between them"), is_known);
    }
    // The same numbers in a table of readings, and of a method that has none a sentence.
    let table = "reconstruct readings.csv --reconstruction kriging --uncertainty where.csv";
    bench.good(table);
    let text = bench.read("where.csv");
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert!(
        rows[0].contains("value,type_a,type_b,uncertainty"),
        "{}",
        rows[0]
    );
    // Each once that isotropy and the plane of incidence make one, and reciprocity: 17 of light from above.
    let of_light = |light: &str| {
        rows.iter()
            .filter(|row| row.split(',').nth(4) == Some(light))
            .count()
    };
    assert_eq!(of_light("0"), 18, "{}", rows[1]);
    let read = bench.good("reconstruct where.csv --cross-validation none");
    assert!(!read.contains("averaged"), "{read}");
    let nearest = "reconstruct readings.csv --reconstruction nearest --uncertainty no.csv";
    bench.refuses(nearest, 3, "most readings have no uncertainty");
    assert!(!bench.path("no.csv").exists());
    bench.refuses(
        "reconstruct readings.csv --uncertainty no.astm",
        2,
        "astm has no place for uncertainties; allowed: csv",
    );
    // What was asked for before is not to be read again.
    bench.good(format!("{next}9 --force"));
    assert!(!bench.path("more.csv").exists());
}

#[test]
fn what_cannot_be_planned_is_refused_in_a_sentence() {
    let bench = Bench::new();
    bench.good("next --batch 8 -o poses.csv");
    bench.refuses_all(
        "4 | next --batch 5000 -o x.csv | adaptive chooses at most 4000 poses
         2 | next --batch 8 --planner adaptve -o x.csv | did you mean adaptive
         2 | next --batch 8 --set weigth=1 -o x.csv | weight
         2 | next --batch 8 --set weight=2 -o x.csv | [0, 1]
         2 | next --batch 8 --set target.nrmse=0 -o x.csv | target.nrmse = 0: allowed is a number in (0.000001, 10]
         2 | next --batch 8 --set target={} -o x.csv | nrmse, log_relative or both
         2 | next --batch 8 --planner a-optimal --set target.nrmse=0.1 -o x.csv | before the first reading
         2 | next --batch 8 --instrument nobody -o x.csv | no instrument
         3 | next nothing.csv --batch 8 -o x.csv | nothing.csv
         3 | next poses.csv --batch 8 -o x.csv | poses.csv
         2 | next --batch 8 -o x.nobody | --format
         2 | next --batch 8 -o poses.csv | --force",
    );
    assert!(!bench.path("x.csv").exists());
}

const PLANNED: &str = r#"
quantities = []
budgets = [8, 6]
measures = ["cosine"]

[[material]]
kind = "ggx"
alpha = 0.1

[[material]]
kind = "ggx"
alpha = 0.3

[[parametrization]]
kind = "half-difference"
warp = { theta_h = "square-root" }

[[sample_set]]
kind = "a-optimal"

[[sample_set]]
kind = "adaptive"
weight = 0.5

[[reconstruction]]
kind = "kriging"

[metrics]
pairs = 500
max_pairs = 1
"#;

levels! {
    planners_run_in_studies_shard_by_shard_and_resume: "thorough: as many poses as are chosen at all";
}

fn planners_run_in_studies_shard_by_shard_and_resume(level: Level) {
    let bench = Bench::of(PLANNED);
    let schedules = "--set output.schedules=\"csv\"";
    bench.good(format!("run c.toml -o whole --threads 1 {schedules} -q"));
    // What is chosen for a material is written for it.
    let written = bench.files("whole/schedules");
    assert_eq!(written.len(), 2 + 4, "{written:?}");
    for part in 1..=2 {
        bench.good(format!("run c.toml -o part{part} --shard {part}/2 -q"));
    }
    bench.good("merge part1 part2 -o merged -q");
    let [whole, merged] = ["whole", "merged"].map(|dir| bench.rows(dir));
    assert_eq!((whole.len(), merged.len()), (8, 8));
    for (a, b) in whole.iter().zip(&merged) {
        assert_eq!((&a.key, a.readings), (&b.key, b.readings));
        assert_eq!(a.value("nrmse"), b.value("nrmse"), "{}", a.key);
    }
    // Nothing is made twice.
    bench.good("run c.toml -o whole");
    let rows = bench.rows("whole");
    assert_eq!(rows.len(), 8);
    assert!(
        rows.iter()
            .zip(&whole)
            .all(|(a, b)| a.plan_seconds == b.plan_seconds)
    );
    // A machine and a time.
    bench.write(
        "m.toml",
        PLANNED.replace("budgets = [8, 6]", "minutes = [3]")
            + "[[instrument]]\npreset = \"cornell\"\n",
    );
    bench.good("run m.toml -o minutes -q");
    assert_eq!(bench.rows("minutes").len(), 4);
    for row in bench.rows("minutes") {
        assert!(
            row.instrument_seconds.unwrap() <= 180.0 && row.readings > 5,
            "{}",
            row.readings
        );
        assert_eq!(row.reachable, 1.0);
    }
    bench.refuses(
        "check c.toml --set budgets=[5000]",
        2,
        "chooses at most 1000 poses",
    );
    bench.tells("check m.toml", "chosen from readings");
    bench.refuses(
        "schedule c.toml --sample-set adaptive --budget 12 -o s.csv",
        2,
        "gonio next",
    );
    if level == Level::Quick {
        return;
    }
    // A quick machine has time for more than is chosen.
    bench.good("run m.toml -o quick --set minutes=[1e4] --set sample_set=[{kind=\"a-optimal\"}] --set material=[{kind=\"lambert\"}] -q");
    assert_eq!(bench.rows("quick")[0].poses, 1000);
}

/// What `gonio advise --json` prints, and its commands as command lines of ours.
fn advised(bench: &Bench, line: &str) -> Vec<(serde_json::Value, Vec<String>)> {
    let advice: Vec<serde_json::Value> = serde_json::from_str(&bench.good(line)).unwrap();
    let commands = |a: &serde_json::Value| {
        let list = a["commands"].as_array().unwrap().iter();
        let text = list.map(|c| {
            c.as_str()
                .unwrap()
                .strip_prefix("gonio ")
                .unwrap()
                .to_owned()
        });
        text.collect()
    };
    advice
        .into_iter()
        .map(|a| (commands(&a), a))
        .map(|(c, a)| (a, c))
        .collect()
}

levels! {
    advice_is_what_a_run_finds_and_its_commands_run: "thorough: two materials, all choices and all commands";
}

fn advice_is_what_a_run_finds_and_its_commands_run(level: Level) {
    let bench = Bench::of(PLANNED);
    let one = r#"material=[{kind="ggx",alpha=0.1}]"#;
    let two = r#"material=[{kind="ggx",alpha=0.1},{kind="ggx",alpha=0.3}]"#;
    let budget = level.of(8, 16);
    let material = level.of(one, two);
    let ask = format!("advise c.toml --budget {budget} --set {material} -q");
    if level == Level::Thorough {
        let text = bench.good(&ask);
        assert!(text.starts_with("16 poses, 2 materials: "), "{text}");
    }
    let advice = advised(&bench, &format!("{ask} --json"));
    assert_eq!(advice.len(), 3);
    bench.good("init advise -q");
    let some = "--set sample_set=[{kind=\"sobol\"}] --set reconstruction=[{kind=\"kriging\"}] -q";
    let some = level.of(some, "-q");
    bench.good(format!(
        "run advise.toml -o all --set budgets=[{budget}] --set {material} {some}"
    ));
    let rows = bench.rows("all");
    let mean = |choice: [&str; 3]| {
        let mine = rows
            .iter()
            .filter(|r| [&*r.parametrization, &*r.sample_set, &*r.reconstruction] == choice);
        let errors: Vec<f64> = mine.map(|r| r.value("nrmse").unwrap()).collect();
        let n = level.of(1, 2);
        assert!(errors.is_empty() || errors.len() == n, "{choice:?}");
        (!errors.is_empty()).then(|| (errors.iter().map(|e| e.ln()).sum::<f64>() / n as f64).exp())
    };
    let mut before = 0.0;
    for (a, _) in &advice {
        let error = a["nrmse"]["mean"].as_f64().unwrap();
        assert!(error >= before, "{advice:?}");
        before = error;
        let choice =
            ["parametrization", "sample_set", "reconstruction"].map(|key| a[key].as_str().unwrap());
        // A run of these materials alone knows no prior.
        if choice.iter().any(|name| name.ends_with("-prior")) {
            continue;
        }
        match mean(choice) {
            Some(mean) => assert!((error / mean - 1.0).abs() < 1e-9, "{choice:?}"),
            None => assert_eq!(level, Level::Quick, "{choice:?}"),
        }
    }
    let best = advice[0].0["nrmse"]["mean"].as_f64().unwrap();
    for row in rows.iter().filter(|r| {
        ["sobol", "grid"].contains(&&*r.sample_set)
            || r.parametrization == "half-difference" && r.reconstruction == "kriging"
    }) {
        let choice = [
            &*row.parametrization,
            &*row.sample_set,
            &*row.reconstruction,
        ];
        let mean = mean(choice).unwrap();
        assert!(best <= mean * (1.0 + 1e-9), "{choice:?}");
    }
    // The last is a list that no reading changes.
    assert_eq!(advice[2].0["learns"], false);
    for (number, (_, commands)) in (1..).zip(&advice).take(level.of(1, 3)) {
        run_all(
            &bench,
            number,
            commands,
            "--config advise.toml --material ggx-0.1",
        );
    }
}

/// Runs the commands of the choice of a number one after the other, as they are, with readings of a material between them.
fn run_all(bench: &Bench, number: usize, commands: &[String], material: &str) {
    let mut read = 0;
    for command in commands {
        let readings = command.split(' ').find(|word| word.contains("-readings"));
        if let Some(name) = readings {
            let last = format!(
                "{number}-readings{}.csv",
                if read == 0 { 1 } else { read + 1 }
            );
            let mut poses = format!("{number}-poses{}.csv", if read == 0 { 1 } else { read + 1 });
            if !bench.path(&poses).exists() {
                poses = format!("{number}-poses.csv");
            }
            bench.good(format!("measure {poses} {material} -o {last} -q"));
            read += 1;
            // As a shell would.
            let all: Vec<String> = (1..=read)
                .map(|i| format!("{number}-readings{i}.csv"))
                .collect();
            bench.good(format!("{} -q", command.replace(name, &all.join(" "))));
        } else {
            bench.good(command);
        }
    }
    assert!(read > 0, "{commands:?}");
}

levels! {
    advice_is_for_a_material_and_an_instrument: "thorough: advice on a material with other symmetries, and its commands";
}

/// Poses are for the symmetries of the material, and keep to the time of the instrument.
fn advice_is_for_a_material_and_an_instrument(level: Level) {
    let bench = Bench::new();
    let machine = "--instrument cornell";
    let advice = advised(
        &bench,
        &format!("advise ggx --minutes 4 {machine} --json -q"),
    );
    for (a, commands) in &advice {
        let minutes = a["minutes"].as_f64().unwrap();
        assert!(2.0 < minutes && minutes <= 4.0, "{a}");
        assert!(commands.iter().any(|c| c.contains(machine)), "{commands:?}");
    }
    let ggx = "[[material]]\nkind = \"ggx\"\n";
    if level == Level::Thorough {
        let ask = "advise ggx --set alpha=[0.1,0.4] --budget 8 --json -q";
        bench.write("c.toml", format!("{ggx}alpha = [0.1, 0.4]\n"));
        for (number, (_, commands)) in (1..).zip(&advised(&bench, ask)) {
            run_all(&bench, number, commands, "--config c.toml");
            let first = ["poses1", "poses"].map(|name| bench.path(&format!("{number}-{name}.csv")));
            let written = first.iter().find(|path| path.exists()).unwrap();
            let text = fs::read_to_string(written).unwrap();
            says(&text, "symmetries reciprocal, bilateral");
        }
    }
    let mixed = format!("{ggx}{ggx}alpha = [0.1, 0.4]\n");
    bench.write("mixed.toml", mixed);
    bench.refuses_all(
        "2 | advise mixed.toml --budget 8 | allowed: materials of the same symmetries
         2 | advise nobody --budget 8 | nobody
         2 | advise ggx --budget 8 --instrument nobody | nobody
         2 | advise ggx --budget 8 --prior nobody.gonio | nobody.gonio
         2 | advise ggx --budget 8 --set alhpa=1 | alpha",
    );
    if level == Level::Thorough {
        bench.refuses(
            format!("advise ggx --minutes 0.1 {machine}"),
            4,
            "too short for one pose",
        );
    }
}

#[test]
fn schedules_follow_the_coordinates_they_are_uniform_in() {
    let bench = Bench::new();
    let all = ["spherical", "half-difference", "hybrid"];
    let mut text = "budgets = [9]\nsample_set = [{ kind = \"sobol\" }]\n\
                    reconstruction = [{ kind = \"nearest\" }]\n"
        .to_owned();
    for kind in all {
        text += &format!("[[parametrization]]\nkind = {kind:?}\n");
    }
    bench.write("c.toml", text + "[[material]]\nkind = \"ggx\"\n");
    for parametrization in all {
        let of = format!("--parametrization {parametrization} --budget 4000");
        bench.good(format!("schedule c.toml {of} -o s.csv --force -q"));
        let text = bench.good("density s.csv --elevation 90 --json");
        let lines: serde_json::Value = serde_json::from_str(&text).unwrap();
        let lines = lines.as_array().unwrap();
        assert_eq!(lines[0]["coordinates"], parametrization, "{text}");
        let less = |l: &serde_json::Value| l["less_than_first"].as_f64().unwrap();
        assert!(
            lines.len() > 4 && lines[1..].iter().all(|l| less(l) > 0.0),
            "{text}"
        );
        // As dense as its own points are, to what 4000 of them can tell.
        let [mean, error, own] = ["log_density", "standard_error", "of_own_points"]
            .map(|key| lines[0][key].as_f64().unwrap());
        assert!((mean - own).abs() < 4.0 * error.hypot(0.03), "{text}");
    }
    bench.tells("density s.csv --elevation 45", " beyond 45° are left out");
    bench.refuses_all(
        "3 | density nothing.csv | nothing.csv
         3 | density c.toml | c.toml
         2 | density s.csv --elevation 2 | too few points of ",
    );
}
