//! Planners as a user meets them: in configs, and from readings to the next poses.

use super::common::{Level, levels, says};
use super::pages::of_repository;
use super::{Bench, assert_same, whole_run};
use gonio::experiment::Row;
use serde_json::Value;
use std::fs;
use std::process::Command;

/// Runs the laboratory's script in a folder of the bench, for so many steps; its stdout.
fn laboratory(bench: &Bench, folder: &str, steps: &str) -> String {
    let folder = bench.path(folder);
    fs::create_dir_all(&folder).unwrap();
    let mut command = Command::new("sh");
    command.arg(of_repository("tests/lab.sh"));
    command.arg(env!("CARGO_BIN_EXE_gonio"));
    command.arg(of_repository("configs/quickstart.toml"));
    command.args(["ggx-0.3", "cornell", "3", steps]);
    let output = command.current_dir(folder).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The number after a word of a text.
pub fn after(text: &str, word: &str) -> f64 {
    let rest = text.split(word).nth(1);
    let rest = rest.unwrap_or_else(|| panic!("no {word} in {text}"));
    let number = rest.split_whitespace().next().unwrap();
    number.trim_end_matches([',', ';']).parse().unwrap()
}

#[test]
fn readings_that_raise_an_expected_error_are_named() {
    let bench = Bench::new().with_configs();
    let measure = |n: u32, material: &str| {
        let of = format!("--config configs/quickstart.toml --material {material}");
        bench.good(format!("measure p{n}.csv {of} -o r{n}.csv --force"));
    };
    bench.good("next --batch 8 -o p1.csv");
    measure(1, "lambert");
    bench.good("next r1.csv --batch 8 -o p2.csv");
    assert!(bench.read("p2.csv").contains("# assumes = \"kriging\"\n"));
    // What looked matte has a highlight, or has not.
    for (material, rises) in [("ggx-0.05", true), ("lambert", false)] {
        measure(2, material);
        let both = "next r1.csv r2.csv --mixed --batch 8 -o p3.csv --force";
        let told = bench.ends(both, 0);
        let sentence = "the readings of r2.csv raise the expected nrmse from ";
        assert_eq!(told.contains(sentence), rises, "{material}: {told}");
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
    assert_same(&whole_run(&bench, "whole"), &whole_run(&bench, "pieces"));
    assert_eq!(bench.files("whole").len(), 6);
    assert!(whole.ends_with(&pieces));
    // 8, 8 and 16 readings; what is expected falls.
    says(&whole, "so far: 16 poses, 16 readings");
    let is_forecast = |line: &&str| line.starts_with("now: ") || line.starts_with("then: ");
    let lines = whole.lines().filter(is_forecast);
    let expected: Vec<f64> = lines.map(|line| after(line, "nrmse ")).collect();
    let [now, then, later_now, later_then] = expected[..] else {
        panic!("{whole}")
    };
    assert!(then < now && later_then < later_now, "{whole}");
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
        let drawn = format!("--reconstruction {kind} --uncertainty {kind}.svg");
        bench.good(format!("reconstruct readings.csv {drawn}"));
        let drawn = bench.read(&format!("{kind}.svg"));
        assert_eq!(drawn.contains("of its readings and between them"), is_known);
    }
    // The same numbers in a table of readings, and of a method that has none a sentence.
    bench.good("reconstruct readings.csv --reconstruction kriging --uncertainty where.csv");
    let text = bench.read("where.csv");
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let columns = "value,type_a,type_b,uncertainty";
    assert!(rows[0].contains(columns), "{}", rows[0]);
    // Each once that isotropy and the plane of incidence make one, and reciprocity: 17 of light from above.
    let is_from_above = |row: &&&str| row.split(',').nth(4) == Some("0");
    assert_eq!(rows.iter().filter(is_from_above).count(), 18, "{}", rows[1]);
    let read = bench.good("reconstruct where.csv --cross-validation none");
    assert!(!read.contains("averaged"), "{read}");
    bench.does(
        "3 | reconstruct readings.csv --reconstruction nearest --uncertainty no.csv | most readings have no uncertainty
         2 | reconstruct readings.csv --uncertainty no.astm | astm has no place for uncertainties; allowed: csv",
    );
    assert!(!bench.path("no.csv").exists());
    // What was asked for before is not to be read again.
    bench.good(format!("{next}9 --force"));
    assert!(!bench.path("more.csv").exists());
    let next = "next readings.csv --batch 8 -o more.csv --for";
    let told = "stop: expected nrmse … moment_mean_deg … upper bound";
    bench.tells(format!("{next} mean_deg=90"), told);
    assert!(!bench.path("more.csv").exists());
    bench.tells(format!("{next} variance=1%"), "moment_covariance ");
    assert!(bench.path("more.csv").exists());
}

#[test]
fn what_cannot_be_planned_is_refused_in_a_sentence() {
    let bench = Bench::new();
    bench.good("next --batch 8 -o poses.csv");
    bench.does(
        "4 | next --batch 5000 -o x.csv | adaptive chooses at most 4000 poses
         2 | next --batch 8 --planner adaptve -o x.csv | did you mean adaptive
         2 | next --batch 8 --set weigth=1 -o x.csv | weight
         2 | next --batch 8 --set target.nrmse=0 -o x.csv | target.nrmse = 0: allowed is a number in (0.000001, 10]
         2 | next --batch 8 --set target={} -o x.csv | nrmse, log_relative or both
         2 | next --batch 8 --planner a-optimal --set target.nrmse=0.1 -o x.csv | before the first reading
         2+ | next --batch 8 --for width=5% -o x.csv | --for … allowed is variance
         2+ | next --batch 8 --for variance=5 -o x.csv | --for … a number from 0 to 1, as 0.05 or 5%
         2 | next --batch 8 --planner a-optimal --for variance=5% -o x.csv | before the first reading
         2 | next --batch 8 --planner sobol --for variance=5% -o x.csv | --planner
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
material = [{ kind = "ggx", alpha = 0.1 }, { kind = "ggx", alpha = 0.3 }]
parametrization = [{ kind = "half-difference", warp = { theta_h = "square-root" } }]
sample_set = [{ kind = "a-optimal" }, { kind = "adaptive", weight = 0.5 }]
reconstruction = [{ kind = "kriging" }]
metrics = { pairs = 500, max_pairs = 1 }
"#;

#[test]
fn planners_run_in_studies_shard_by_shard_and_resume() {
    let bench = Bench::of(PLANNED);
    let schedules = "--set output.schedules=\"csv\"";
    bench.good(format!("run c.toml -o whole --threads 1 {schedules} -q"));
    // What is chosen for a material is written for it.
    let written = bench.files("whole/schedules");
    assert_eq!(written.len(), 2 + 4, "{written:?}");
    bench.does(
        "0 | run c.toml -o part1 --shard 1/2 -q
         0 | run c.toml -o part2 --shard 2/2 -q
         0 | merge part1 part2 -o merged -q",
    );
    let [whole, merged] = ["whole", "merged"].map(|dir| bench.rows(dir));
    // Nothing is made twice.
    bench.good("run c.toml -o whole");
    let again = bench.rows("whole");
    assert_eq!([whole.len(), merged.len(), again.len()], [8; 3]);
    for ((a, b), again) in whole.iter().zip(&merged).zip(&again) {
        assert_eq!((&a.key, a.readings), (&b.key, b.readings));
        assert_eq!(a.value("nrmse"), b.value("nrmse"), "{}", a.key);
        assert!(a.plan_seconds == again.plan_seconds);
    }
    // A machine and a time.
    let machine = "instrument = [{ preset = \"cornell\" }]\n";
    let minutes = PLANNED.replace("budgets = [8, 6]", "minutes = [3]");
    bench.write("m.toml", minutes + machine);
    bench.good("run m.toml -o minutes -q");
    let rows = bench.rows("minutes");
    assert_eq!(rows.len(), 4);
    for row in rows {
        let seconds = row.instrument_seconds.unwrap();
        assert!(seconds <= 180.0 && row.readings > 5, "{}", row.readings);
        assert_eq!(row.reachable, 1.0);
    }
    bench.does(
        "2 | check c.toml --set budgets=[5000] | chooses at most 1000 poses
         0 | check m.toml | chosen from readings
         2 | schedule c.toml --sample-set adaptive --budget 12 -o s.csv | gonio next",
    );
}

/// What `gonio advise --json` prints, and its commands as command lines of ours.
fn advised(bench: &Bench, line: &str) -> Vec<(Value, Vec<String>)> {
    let advice = bench.json(line);
    let advice = advice.as_array().unwrap().iter().map(|a| {
        let commands = a["commands"].as_array().unwrap().iter();
        let ours = |c: &Value| c.as_str().unwrap().strip_prefix("gonio ").unwrap().into();
        (a.clone(), commands.map(ours).collect())
    });
    advice.collect()
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
    let run = format!("run advise.toml -o all --set budgets=[{budget}]");
    bench.good(format!("{run} --set {material} {some}"));
    let rows = bench.rows("all");
    let mean = |choice: [&str; 3]| {
        let mine = rows.iter().filter(|r| choice_of(r) == choice);
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
    let is_plain = |r: &&Row| {
        ["sobol", "grid"].contains(&&*r.sample_set)
            || r.parametrization == "half-difference" && r.reconstruction == "kriging"
    };
    for choice in rows.iter().filter(is_plain).map(choice_of) {
        assert!(best <= mean(choice).unwrap() * (1.0 + 1e-9), "{choice:?}");
    }
    // The last is a list that no reading changes.
    assert_eq!(advice[2].0["learns"], false);
    for (number, (_, commands)) in (1..).zip(&advice).take(level.of(1, 3)) {
        let material = "--config advise.toml --material ggx-0.1";
        run_all(&bench, number, commands, material);
    }
}

/// What a row is of.
fn choice_of(row: &Row) -> [&str; 3] {
    [&row.parametrization, &row.sample_set, &row.reconstruction].map(|name| &**name)
}

/// Runs the commands of the choice of a number one after the other, as they are, with readings of a material between them.
fn run_all(bench: &Bench, number: usize, commands: &[String], material: &str) {
    let mut read = 0;
    for command in commands {
        let Some(name) = command.split(' ').find(|word| word.contains("-readings")) else {
            bench.good(command);
            continue;
        };
        read += 1;
        let mut poses = format!("{number}-poses{read}.csv");
        if !bench.path(&poses).exists() {
            poses = format!("{number}-poses.csv");
        }
        let readings = |i: i32| format!("{number}-readings{i}.csv");
        let now = readings(read);
        bench.good(format!("measure {poses} {material} -o {now} -q"));
        // As a shell would.
        let all: Vec<String> = (1..=read).map(readings).collect();
        bench.good(format!("{} -q", command.replace(name, &all.join(" "))));
    }
    assert!(read > 0, "{commands:?}");
}

levels! {
    advice_is_for_a_material_and_an_instrument: "thorough: advice for too short a time";
}

/// Poses are for the symmetries of the material, and keep to the time of the instrument.
fn advice_is_for_a_material_and_an_instrument(level: Level) {
    let bench = Bench::new();
    let machine = "--instrument utia";
    let ask = format!("advise ggx --set alpha=[0.1,0.4] --minutes 2 {machine} --json -q");
    let advice = advised(&bench, &ask);
    for (a, commands) in &advice {
        let minutes = a["minutes"].as_f64().unwrap();
        assert!(1.0 < minutes && minutes <= 2.0, "{a}");
        assert!(commands.iter().any(|c| c.contains(machine)), "{commands:?}");
    }
    let ggx = "[[material]]\nkind = \"ggx\"\n";
    let (_, commands) = &advice[0];
    bench.good(&commands[0]);
    let (_, written) = commands[0].split_once("-o ").unwrap();
    let text = bench.read(written.split(' ').next().unwrap());
    says(&text, "symmetries reciprocal, bilateral");
    let mixed = format!("{ggx}{ggx}alpha = [0.1, 0.4]\n");
    bench.write("mixed.toml", mixed);
    bench.does(
        "2 | advise mixed.toml --budget 8 | allowed: materials of the same symmetries
         2 | advise nobody --budget 8 | nobody
         2+ | advise ggx | --budget
         2 | advise ggx --for variance=0 | allowed is a level above 0
         2+ | advise ggx --for variance --by nrmse | --by
         2 | advise ggx --budget 8 --instrument nobody | nobody
         2 | advise ggx --budget 8 --prior nobody.gonio | nobody.gonio",
    );
    if level == Level::Thorough {
        // Poses for a moment are the best for it, and beside them stand those for the BRDF.
        let ask = "advise ggx --set alpha=0.1 --for variance=20% --json -q";
        let advice = advised(&bench, ask);
        let sets = advice.iter().map(|(a, _)| a["sample_set"].as_str());
        let sets: Vec<_> = sets.map(Option::unwrap).collect();
        says(sets[0], "for-covariance");
        assert!(sets.contains(&"adaptive"), "{sets:?}");
        says(&advice[0].1[0], "--for covariance=0.2");
        assert!(advice[0].0["moment"]["mean"].as_f64().unwrap() <= 0.2);
        // Fewer poses than a usual picture has, by commands that write them.
        let ask = "advise ggx --budget 100 --instrument sphere-camera --json -q";
        let bench = Bench::new();
        for (_, commands) in advised(&bench, ask) {
            let first = commands.iter().take_while(|c| !c.contains("readings"));
            first.for_each(|command| drop(bench.good(command)));
        }
        let told = bench.ends(format!("advise ggx --minutes 0.1 {machine}"), 4);
        says(&told, "too short for one pose");
    }
}

#[test]
fn schedules_follow_the_coordinates_they_are_uniform_in() {
    let bench = Bench::new();
    let all = ["spherical", "half-difference", "hybrid"];
    let kinds = all.map(|kind| format!("{{ kind = {kind:?} }}")).join(", ");
    let text = "budgets = [9]\nmaterial = [{ kind = \"ggx\" }]\nsample_set = [{ kind = \"sobol\" }]\n\
        reconstruction = [{ kind = \"nearest\" }]\n";
    bench.write("c.toml", format!("{text}parametrization = [{kinds}]\n"));
    for parametrization in all {
        let of = format!("--parametrization {parametrization} --budget 1500");
        bench.good(format!("schedule c.toml {of} -o s.csv --force -q"));
        let text = bench.json("density s.csv --elevation 90 --json");
        let lines = text.as_array().unwrap();
        assert_eq!(lines[0]["coordinates"], parametrization, "{text}");
        let less = |l: &Value| l["less_than_first"].as_f64() > Some(0.0);
        assert!(lines.len() > 4 && lines[1..].iter().all(less), "{text}");
        // As dense as its own points are, to what 1500 of them can show.
        let [mean, error, own] = ["log_density", "standard_error", "of_own_points"]
            .map(|key| lines[0][key].as_f64().unwrap());
        assert!((mean - own).abs() < 4.0 * error.hypot(0.03), "{text}");
    }
    bench.tells("density s.csv --elevation 45", " beyond 45° are left out");
    bench.does(
        "3 | density nothing.csv | nothing.csv
         3 | density c.toml | c.toml
         2 | density s.csv --elevation 2 | too few points of ",
    );
}
