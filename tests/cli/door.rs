//! The front door: what a newcomer types first, and what is said to a slip.

use super::Bench;
use super::common::{says, table};
use std::fs;

/// A bench with a folder of two MERL tables.
fn tables() -> Bench {
    let bench = Bench::new();
    fs::create_dir(bench.path("brdfs")).unwrap();
    let written = "tabulate small.toml --material ggx-0.4 -o";
    bench.good(format!("{written} brdfs/satin.binary"));
    fs::copy(
        bench.path("brdfs/satin.binary"),
        bench.path("brdfs/twin.binary"),
    )
    .unwrap();
    bench
}

#[test]
fn tables_are_run_without_a_config() {
    let bench = tables();
    let small = "--set budgets=[40] --set 'metrics={ pairs = 200, max_pairs = 1 }' -q";
    let file = format!("run brdfs/satin.binary {small}");
    bench.good(&file);
    let materials = |run: &str| {
        let mut names: Vec<_> = bench.rows(run).into_iter().map(|r| r.material).collect();
        names.dedup();
        names
    };
    assert_eq!(materials("runs/satin"), ["satin"]);
    // Commands that look at materials take the folder too.
    let aligned = bench.good("distortion brdfs --table alignment");
    says(&aligned, "over 2 materials");
    let nearest = "--set interpolation=nearest";
    let other = bench.good(format!("distortion brdfs --table alignment {nearest}"));
    assert_ne!(aligned, other);
    let text = "configs/merl.toml";
    assert_eq!(bench.manifest("runs/satin")["inputs"][0]["path"], text);
    // It goes on where it was, is listed, and its config does the same again.
    let before = bench.read("runs/satin/results.jsonl");
    bench.good(&file);
    assert_eq!(bench.read("runs/satin/results.jsonl"), before);
    bench.tells(
        format!("{file} --list"),
        "10 of 10 jobs are done in runs/satin",
    );
    bench.good("run runs/satin/config.toml -o again -q");
    assert_eq!(bench.read("again/results.jsonl"), before);

    let folder = format!("run brdfs --shard 1/2 {small}");
    bench.good(&folder);
    bench.good(format!("run brdfs -o both {small}"));
    assert_eq!(materials("both"), ["satin", "twin"]);
    assert!(bench.path("runs/brdfs.shard-1-of-2").is_dir());

    let checked = bench.good("check brdfs/twin.binary");
    assert!(
        checked.contains("twin") && !checked.contains("satin"),
        "{checked}"
    );
    bench.refuses(
        "run brdfs/gone.binary",
        3,
        "gone.binary: cannot read this file",
    );
    fs::create_dir(bench.path("empty")).unwrap();
    bench.refuses("run empty", 3, "holds no MERL file");
}

#[test]
fn a_slip_in_a_name_is_told_the_name_that_is_near() {
    let bench = Bench::new();
    let edited = |from: &str, to: &str| {
        assert!(super::SMALL.contains(from), "{from}");
        let text = super::SMALL.replace(from, to);
        bench.write("slip.toml", text);
        bench.refused("check slip.toml", 2)
    };
    for (from, to, meant) in [
        ("\"half-difference\"", "\"hybird\"", "hybrid"),
        ("\"half-difference\"", "\"half\"", "half-difference"),
        ("square-root", "sqare-root", "square-root"),
        ("theta_h =", "theta_hh =", "theta_h"),
        (
            "\"square-root\"",
            "{ kind = \"power\", exponnent = 0.5 }",
            "exponent",
        ),
        ("\"nearest\"", "\"neerest\"", "nearest"),
        ("\"random\"", "\"randon\"", "random"),
        ("\"lambert\"", "\"Lambret\"", "lambert"),
        ("alpha", "aplha", "alpha"),
        ("budgets", "budget", "budgets"),
        ("pairs", "pair", "pairs"),
    ] {
        let sentence = edited(from, to);
        let meant = format!("; did you mean {meant}?");
        says(&sentence, &meant);
    }
    for [line, meant] in table(
        "check small.toml --set experiment=studdy | study
         check small.toml --set measures=[\"lob\"] | lobe
         check small.toml --set instrument=[{preset=\"utai\"}] | utia
         check small.toml --set coordinates=[{kind=\"owm\"}] | own
         check small.toml --set output.schedules=cvs | csv
         tabulate small.toml --material ggx -o x.binary | ggx-0.4
         schedule small.toml --instrument utai | utia
         check utai | utia
         schedule small.toml --sample-set gird | grid
         moments gxg | ggx
         subset --parametrization hybird --box k=0..1 | hybrid
         subset --parametrization hybrid --box hbar=0..1 | h_bar
         picture sphere ggx -o x --lighting sly | sky
         picture compare ggx -o x --reconstruction cubics | cubic",
    ) {
        let sentence = bench.refused(line, 2);
        let meant = format!("; did you mean {meant}?");
        assert!(sentence.trim_end().ends_with(&meant), "{line}: {sentence}");
    }
    // Nothing is guessed of what is like none of them.
    let sentence = bench.refused("moments chocolate", 2);
    assert!(!sentence.contains("did you mean"), "{sentence}");
}

#[test]
fn every_starter_is_a_config_that_checks() {
    let bench = Bench::new();
    let starters = [
        "acquisition",
        "study",
        "advise",
        "moments",
        "relations",
        "instrument",
    ];
    let help = bench.good("init --help");
    for starter in starters {
        says(&help, &format!("- {starter}:"));
        bench.good(format!("init {starter}"));
        let file = format!("{starter}.toml");
        let text = bench.read(&file);
        assert!(text.starts_with("# "), "{starter} says what it is");
        assert_eq!(bench.good(format!("init {starter} -o -")), text);
        bench.good(format!("check {file}"));
        bench.refuses(format!("init {starter}"), 2, "this file exists");
        bench.write(&file, "");
        bench.good(format!("init {starter} --force"));
        assert_eq!(bench.read(&file), text);
    }
    // Those that are listed are all.
    let listed = help.lines().filter(|l| l.trim_start().starts_with("- "));
    assert_eq!(listed.count(), starters.len(), "{help}");
    bench.good("init -o mine.toml");
}

#[test]
fn a_preset_that_is_printed_is_the_same_machine() {
    let bench = Bench::new();
    for preset in gonio::instrument::presets() {
        let text = bench.good(["list", "instruments", preset.name]);
        bench.write("mine.toml", text);
        let costs = |instrument: String, file: &str| {
            let config = format!(
                "budgets = [60]\n[[material]]\nkind = \"ggx\"\n[[instrument]]\n{instrument}\n"
            );
            bench.write("config.toml", config);
            let order = format!("--skip-unreachable --force -o {file}");
            bench.good(format!("schedule config.toml {order}"));
            bench.read(file)
        };
        let before = costs(format!("preset = {:?}", preset.name), "preset.csv");
        let mine = costs("file = \"mine.toml\"".into(), "mine.csv");
        says(&before, "rows in the order of time");
        assert!(before == mine, "{} is another", preset.name);
    }
    let refused = bench.refused("list instruments utai", 2);
    says(&refused, "; did you mean utia?");
    bench.refused("list warps power", 2);
}

#[test]
fn shells_and_man_know_every_command() {
    let bench = Bench::new();
    let help = bench.good("--help");
    let commands = help.lines().skip_while(|l| !l.starts_with("Commands:"));
    let commands = commands.skip(1).take_while(|l| !l.is_empty());
    let commands: Vec<&str> = commands
        .filter_map(|l| l.split_whitespace().next())
        .collect();
    assert!(commands.len() > 15, "{help}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = bench.good(format!("completions {shell}"));
        for command in &commands {
            assert!(script.contains(command), "{shell}: {command}");
        }
        assert!(script.contains("shard"), "{shell}");
    }
    assert!(bench.good("man").starts_with(".ie"));
    bench.good("man -o man1");
    for command in commands.iter().filter(|c| **c != "help") {
        let page = bench.read(&format!("man1/gonio-{command}.1"));
        says(&page, &format!("gonio\\-{command}"));
    }
    assert!(bench.path("man1/gonio-picture-compare.1").is_file());
    bench.refuses("man -o man1", 2, "this file exists");
}

#[test]
fn whatever_prints_a_table_prints_json_too() {
    let bench = Bench::new();
    let json = |line: &str| -> serde_json::Value {
        serde_json::from_str(&bench.good(line)).unwrap_or_else(|e| panic!("{line}: {e}"))
    };
    let listed = json("list --json");
    let families = listed.as_array().unwrap();
    let of = |family: &str| families.iter().find(|f| f["family"] == family).unwrap();
    let hybrid = of("parametrizations")["members"].as_array().unwrap().iter();
    assert!(hybrid.clone().any(|m| m["name"] == "hybrid"));
    // What is printed for people has the same names.
    let text = bench.good("list");
    for family in families {
        for member in family["members"].as_array().unwrap() {
            assert!(text.contains(member["name"].as_str().unwrap()), "{member}");
        }
    }
    let checked = json("check small.toml --json");
    assert_eq!(checked["materials"][1]["name"], "ggx-0.4");
    assert_eq!(checked["schedules"].as_array().unwrap().len(), 2 * 2 * 2);
    assert_eq!(checked["row_count"], 128);
    let machine =
        "check small.toml --json --set instrument=[{preset=\"utia\"}] --set readings=[20]";
    let checked = json(machine);
    assert!(
        checked["visits"][0]["minutes"].as_f64() > Some(0.0),
        "{checked}"
    );
    let moments = json("check small.toml --json --set quantities=[\"moments\"]");
    assert_eq!(moments["moments"]["order"], 4);
    let utia = json("check utia --json");
    assert_eq!(utia["instrument"]["name"], "utia");
    assert!(utia["reach"][0]["percent"].as_f64() > Some(10.0));
    let symmetry = json("symmetry lambert --json");
    assert_eq!(symmetry[0]["symmetries"][0]["holds"], true);
    assert!(json("distortion lambert --json --table stretch").is_array());
    assert!(json("claims --json").is_array());
    assert!(json("moments lambert --json --set moments.views=2").is_array());
    let one = "--seed 1 --warp none --sample-set grid --budget 60";
    let written = format!("schedule small.toml -o s.csv --json {one}");
    assert_eq!(json(&written)[0]["file"], "s.csv");
    for [line, option] in
        table("claims --json --format csv | --json\nschedule small.toml --json | --warp")
    {
        says(&bench.ends(line, 2), option);
    }
}

#[test]
fn every_command_can_be_quiet_verbose_or_coloured() {
    let bench = Bench::new();
    let stderr = |line: &str| bench.ends(line, 0);
    // Paths are told on stderr, by every command; results alone are on stdout.
    let written = "tabulate small.toml --material ggx-0.4 --force -o a.binary";
    assert_eq!(stderr(written), "a.binary\n");
    assert_eq!(stderr(&format!("{written} -q")), "");
    assert_eq!(stderr(&format!("--quiet {written}")), "");
    let verbose = stderr(&format!("{written} --verbose"));
    says(
        &verbose,
        "reads small.toml … material ggx-0.4 …  s on  … thread",
    );
    says(&stderr("check a.binary -v"), "reads a.binary");
    let views = "moments a.binary --set moments.views=2 -v";
    says(&stderr(views), "read a.binary");
    bench.ends("check small.toml -q -v", 2);
    // An error is told all the same, and red only if that is asked for: stderr is no terminal.
    let error = |line: &str| bench.ends(line, 2);
    let plain = error("check gone.toml -q");
    assert!(
        plain.starts_with("gonio: gone.toml: cannot read"),
        "{plain}"
    );
    let red = error("check gone.toml --color always");
    assert!(
        red.starts_with("\u{1b}[1m\u{1b}[31mgonio:\u{1b}[0m gone.toml"),
        "{red:?}"
    );
    assert_eq!(error("check gone.toml --color=never"), plain);
    let help = bench.good("--help --color always");
    assert!(help.contains('\u{1b}') && !bench.good("--help").contains('\u{1b}'));
    assert!(error("run --color blue").contains("auto, always, never"));
}

#[test]
#[cfg(unix)]
fn a_link_that_leads_nowhere_is_named() {
    let bench = tables();
    let broken = bench.path("brdfs/lost.binary");
    std::os::unix::fs::symlink("nowhere.binary", broken).unwrap();
    bench.refuses(
        "check brdfs",
        3,
        "brdfs/lost.binary: no access to this MERL table: ",
    );
    bench.good("check brdfs/satin.binary");
}

#[test]
fn negative_numbers_are_values() {
    let bench = Bench::new();
    for [option, allowed] in table(
        "--budget -1 | budget = -1: allowed is a whole number from 1 to
         --readings -1 | budget = -1: allowed is a whole number from 1 to
         --minutes -0.5 | '-0.5' for '--minutes <M>': allowed: a number in (0, ",
    ) {
        says(
            &bench.ends(format!("schedule small.toml {option}"), 2),
            allowed,
        );
    }
}

#[test]
fn nothing_and_one_are_told_as_such() {
    let bench = Bench::new();
    let text = bench.ends("reconstruct a.csv --columns ''", 2);
    says(&text, "allowed is e.g. theta_i=thetaIn");
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";
    bench.write("one.csv", head.to_owned() + "10,0,20,0,1\n");
    let said = bench.good("reconstruct one.csv --reconstruction nearest");
    assert!(said.starts_with("1 pose ("), "{said}");
    says(&said, "): 1 reading\n");
}

/// Readings of Lambert's material, with a noise of one percent; in one line the third digit of the value is the first.
#[test]
fn a_slip_of_the_pen_is_listed_and_marked() {
    let bench = Bench::new();
    let mut text = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n".to_owned();
    for i in 0..60_u32 {
        let value = if i == 40 {
            2.0
        } else {
            0.2 + 0.002 * f64::from(i * 37 % 60) / 60.0
        };
        text += &format!(
            "{},0,{},{},{value}\n",
            i * 7 % 80,
            i * 11 % 79,
            i * 29 % 360
        );
    }
    bench.write("slip.csv", text);
    let said = bench.good("reconstruct slip.csv --checked checked.csv");
    let listed = "left out: 1 reading, since all others contradict it\n  slip.csv:42: theta_i 40.00°, theta_o 45.00°";
    says(&said, listed);
    let marked = bench.read("checked.csv");
    let marked: Vec<&str> = marked
        .lines()
        .filter(|line| line.contains("suspected"))
        .collect();
    assert!(marked.len() == 1 && marked[0].contains(",2,"), "{marked:?}");
    let poses = ["next", "slip.csv", "--batch", "1", "-o", "next.csv"];
    bench.tells(poses, "left out: 1 reading");
    let all = bench.good("reconstruct slip.csv --take-all");
    assert!(!all.contains("left out: 1 reading"), "{all}");
    // Kriging says so where it does it by itself.
    for (robust, is_left_out) in [("robust=true", true), ("robust=false", false)] {
        let by = format!("--reconstruction kriging --set '{robust}'");
        let all = bench.good(format!("reconstruct slip.csv --take-all {by}"));
        assert_eq!(
            all.contains("1 reading is left out, contradicted"),
            is_left_out,
            "{all}"
        );
    }
}

/// Uncertainties of type B alone say nothing of what is between readings; lights that were not read have no albedo; a channel has
/// its name.
#[test]
fn what_readings_do_not_say_is_not_printed_as_a_number() {
    let bench = Bench::new();
    let mut text =
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value_r,value_g,value_b,uncertainty_r,uncertainty_g,uncertainty_b\n".to_owned();
    for i in 0..60_u32 {
        let (light, sensor, turned) = (i * 7 % 20, i * 11 % 40, i * 29 % 360);
        text += &format!("{light},0,{sensor},{turned},0.1,0.2,0.15,0.001,0.002,0.001\n");
    }
    bench.write("dim.csv", text);
    let said = bench.good("reconstruct dim.csv --reconstruction nearest -o dim.binary");
    says(&said, "within_2u –: no reading has");
    // 0.2 π of green; all readings share .004 of .45 (k = 1), which is twice .56 % of it.
    let albedo = "albedo: 0.6283 ± 1.1e-2 at 0° (G), none at 60°, where no light was read";
    says(&said, albedo);
}

#[test]
fn what_is_no_config_is_not_read_as_one() {
    let bench = Bench::new();
    for (file, format) in [("one.csv", "csv"), ("cloth.bin", "utia")] {
        bench.write(file, "");
        let sentence = bench.refused(format!("tabulate {file} -o x.binary"), 2);
        let part = format!("{file}: a file of format {format} is no config; allowed: a config");
        says(&sentence, &part);
    }
}
