//! The front door: what a newcomer types first, and what is said to a slip.

use super::common::{near, says, table};
use super::{Bench, READINGS};
use std::fs;

/// A bench with a folder of two MERL tables.
fn tables() -> Bench {
    let bench = Bench::new();
    fs::create_dir(bench.path("brdfs")).unwrap();
    bench.good("tabulate small.toml --material ggx-0.4 -o brdfs/satin.binary");
    let [satin, twin] = ["satin", "twin"].map(|name| bench.path(&format!("brdfs/{name}.binary")));
    fs::copy(satin, twin).unwrap();
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
    let align = "distortion brdfs --table alignment";
    let aligned = bench.tells(align, "over 2 materials");
    let other = bench.good(format!("{align} --set interpolation=nearest"));
    assert_ne!(aligned, other);
    let text = "configs/merl.toml";
    assert_eq!(bench.manifest("runs/satin")["inputs"][0]["path"], text);
    // It goes on where it was, is listed, and its config does the same again.
    let before = bench.read("runs/satin/results.jsonl");
    bench.good(&file);
    assert_eq!(bench.read("runs/satin/results.jsonl"), before);
    fs::create_dir(bench.path("empty")).unwrap();
    bench.does(&format!(
        "0 | {file} --list | 10 of 10 jobs are done in runs/satin
         0 | run runs/satin/config.toml -o again -q
         0 | run brdfs --shard 1/2 {small}
         0 | run brdfs -o both {small}
         3 | run brdfs/gone.binary | gone.binary: cannot read this file
         3 | run empty | holds no MERL file"
    ));
    assert_eq!(bench.read("again/results.jsonl"), before);
    assert_eq!(materials("both"), ["satin", "twin"]);
    assert!(bench.path("runs/brdfs.shard-1-of-2").is_dir());
    let checked = bench.tells("check brdfs/twin.binary", "twin");
    assert!(!checked.contains("satin"), "{checked}");
}

#[test]
fn a_slip_in_a_name_is_told_the_name_that_is_near() {
    let bench = Bench::new();
    for [line, meant] in table(
        r#"check small.toml --set parametrization.0.kind=hybird | hybrid
         check small.toml --set parametrization.1.warp.theta_h=sqare-root | square-root
         check small.toml --set parametrization.1.warp={theta_hh="arcsine"} | theta_h
         check small.toml --set parametrization.1.warp.theta_h={kind="power",exponnent=0.5} | exponent
         check small.toml --set material.0.kind=Lambret | lambert
         check small.toml --set budget=[9] | budgets
         check small.toml --set experiment=studdy | study
         check small.toml --set measures=["lob"] | lobe
         check small.toml --set instrument=[{preset="utai"}] | utia
         check small.toml --set coordinates=[{kind="owm"}] | own
         check small.toml --set output.schedules=cvs | csv
         tabulate small.toml --material ggx -o x.binary | ggx-0.4
         schedule small.toml --instrument utai | utia
         check utai | utia
         schedule small.toml --sample-set gird | grid
         moments gxg | ggx
         subset --parametrization hybrid --box hbar=0..1 | h_bar
         picture sphere ggx -o x --lighting sly | sky
         picture compare ggx -o x --reconstruction cubics | cubic"#,
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
    let help = bench.good("init --help");
    // Those that are listed are all.
    let lines = help.lines().map(str::trim_start);
    let listed = lines.filter_map(|l| l.strip_prefix("- "));
    let starters: Vec<_> = listed.map(|l| l.split(':').next().unwrap()).collect();
    let all = "acquisition study advise moments relations instrument";
    assert_eq!(starters.join(" "), all, "{help}");
    for starter in starters {
        bench.good(format!("init {starter}"));
        let file = format!("{starter}.toml");
        let text = bench.read(&file);
        let (schema, rest) = text.split_once('\n').unwrap();
        assert!(rest.starts_with("# "), "{starter} says what it is");
        assert_eq!(bench.good(format!("init {starter} -o -")), rest);
        // The first line names a schema that is there, for editors.
        let schema = bench.read(schema.strip_prefix("#:schema ").unwrap());
        let kind = ["config", "instrument"][usize::from(starter == "instrument")];
        assert_eq!(bench.good(format!("schema {kind}")), schema);
        bench.good(format!("check {file}"));
        bench.refuses(format!("init {starter}"), 2, "this file exists");
        bench.write(&file, "");
        bench.good(format!("init {starter} --force"));
        assert_eq!(bench.read(&file), text);
    }
    bench.good("init -o mine.toml");
}

#[test]
fn a_preset_that_is_printed_is_the_same_machine() {
    let bench = Bench::new();
    for preset in gonio::instrument::presets() {
        let text = bench.good(format!("list instruments {}", preset.name));
        bench.write("mine.toml", text);
        let costs = |instrument: String| {
            let config = format!("budgets = [60]\nmaterial = [{{ kind = \"ggx\" }}]\n{instrument}");
            bench.write("config.toml", config);
            bench.good("schedule config.toml --skip-unreachable --force -o costs.csv");
            bench.read("costs.csv")
        };
        let before = costs(format!("instrument = [{{ preset = {:?} }}]", preset.name));
        says(&before, "rows in the order of time");
        let mine = costs("instrument = [{ file = \"mine.toml\" }]".into());
        assert!(before == mine, "{} is another", preset.name);
    }
    bench.refused("list warps power", 2);
}

#[test]
fn shells_and_man_know_every_command() {
    let bench = Bench::new();
    let help = bench.good("--help");
    let commands = help.lines().skip_while(|l| !l.starts_with("Commands:"));
    let commands = commands.skip(1).take_while(|l| !l.is_empty());
    let commands = commands.filter_map(|l| l.split_whitespace().next());
    let commands: Vec<&str> = commands.collect();
    assert!(commands.len() > 15, "{help}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = bench.good(format!("completions {shell}"));
        for word in commands.iter().chain(&["shard"]) {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    // Members of registries are completed, and files beside them where an argument takes both.
    bench.write("gfile.toml", "");
    let script = bench.good("completions bash");
    bench.write("script.bash", &script);
    for [words, found] in table(
        "tabulate g | gfile.toml ggx
         measure p.csv --config g | gfile.toml ggx
         measure p.csv --instrument c | cornell
         check ros | rosi
         reconstruct a.csv --error-map-in hy | hybrid
         reconstruct a.csv --reconstruction a | auto
         next a.csv --planner a-o | a-optimal
         schedule c.toml --sample-set so | sobol",
    ) {
        let all: Vec<&str> = words.split(' ').collect();
        let [.., before, word] = &all[..] else {
            panic!("{words}");
        };
        let asks = format!(
            "source script.bash; COMP_WORDS=(gonio {words}); COMP_CWORD={}; _gonio gonio {word} {before}; \
             printf '%s\\n' \"${{COMPREPLY[@]}}\" | sort",
            all.len()
        );
        let mut bash = std::process::Command::new("bash");
        bash.args(["-c", &asks]).current_dir(bench.path(""));
        let output = String::from_utf8(bash.output().unwrap().stdout).unwrap();
        let completed: Vec<&str> = output.lines().collect();
        assert_eq!(completed.join(" "), found, "{words}");
    }
    let zsh = bench.good("completions zsh");
    says(&zsh, "#compdef gonio … _alternative 'names:name:(cornell");
    assert!(bench.good("man").starts_with(".ie"));
    bench.good("man -o man1");
    for command in commands.iter().filter(|c| **c != "help") {
        let page = bench.read(&format!("man1/gonio-{command}.1"));
        says(&page, &format!("gonio\\-{command}"));
    }
    assert!(bench.path("man1/gonio-picture-compare.1").is_file());
    bench.refuses("man -o man1", 2, "this file exists");
}

/// What a check estimates is the sum of its parts, and dearer reconstructions take longer.
#[test]
fn the_estimate_of_a_check_adds_up() {
    let bench = Bench::new();
    let seconds = |sets: &str| {
        let found = bench.json(format!("check small.toml --json {sets}"));
        found["core_seconds"].as_f64().unwrap()
    };
    let budgets = |list: &str, kind: &str| {
        let of = format!("--set budgets=[{list}] --set reconstruction=[{{kind=\"{kind}\"}}]");
        seconds(&format!("{of} --set sample_set=[{{kind=\"sobol\"}}]"))
    };
    let [one, other, both] = ["60", "500", "60,500"].map(|list| budgets(list, "kriging"));
    near(one + other, both, 1e-9 * both, "two budgets");
    assert!(other > one && other > 10.0 * budgets("500", "nearest"));
    // The summary stands above the schedules.
    let parts = "to reconstruct and compare: about … within a factor of three … schedules for";
    bench.tells("check small.toml", parts);
}

#[test]
fn whatever_prints_a_table_prints_json_too() {
    let bench = Bench::new();
    let one = "--seed 1 --warp none --sample-set grid --budget 60";
    for [line, place, expected] in table(&format!(
        r#"check small.toml --json | /row_count | 128
         check small.toml --json --set quantities=["moments"] | /moments/order | 4
         check utia --json | /instrument/name | "utia"
         symmetry lambert --json | /0/symmetries/0/holds | true
         schedule small.toml -o s.csv --json {one} | /0/file | "s.csv""#
    )) {
        let found = bench.json(line);
        let at = found.pointer(place).map(ToString::to_string);
        assert_eq!(at.as_deref(), Some(expected), "{line}: {found}");
    }
    for line in [
        "distortion lambert --json --table stretch",
        "claims --json",
        "moments lambert --json --set moments.views=2",
    ] {
        assert!(bench.json(line).is_array(), "{line}");
    }
    bench.does(
        "2+ | claims --json --format csv | --json
         2+ | schedule small.toml --json | --warp",
    );
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
    for [line, parts] in table(&format!(
        "{written} --verbose | reads small.toml … material ggx-0.4 …  s on  … thread
         check a.binary -v | reads a.binary
         moments a.binary --set moments.views=2 -v | read a.binary"
    )) {
        says(&stderr(line), parts);
    }
    // An error is told all the same, and red only if that is asked for: stderr is no terminal.
    let plain = bench.ends("check gone.toml -q", 2);
    says(&plain, "gonio: gone.toml: cannot read");
    let red = bench.ends("check gone.toml --color always", 2);
    let start = "\u{1b}[1m\u{1b}[31mgonio:\u{1b}[0m gone.toml";
    assert!(red.starts_with(start), "{red:?}");
    assert_eq!(bench.ends("check gone.toml --color=never", 2), plain);
    let help = bench.good("--help --color always");
    assert!(help.contains('\u{1b}') && !bench.good("--help").contains('\u{1b}'));
    bench.does(
        "2+ | check small.toml -q -v
         2+ | run --color blue | auto, always, never",
    );
}

#[test]
#[cfg(unix)]
fn a_link_that_leads_nowhere_is_named() {
    let bench = tables();
    let broken = bench.path("brdfs/lost.binary");
    std::os::unix::fs::symlink("nowhere.binary", broken).unwrap();
    bench.does(
        "3 | check brdfs | brdfs/lost.binary: no access to this MERL table:
         0 | check brdfs/satin.binary",
    );
}

/// Readings of Lambert's material, with a noise of one percent; in one line the third digit of the value is the first.
#[test]
fn a_slip_of_the_pen_is_listed_and_marked() {
    let bench = Bench::new();
    let row = |i: u32| {
        let noisy = 0.2 + 0.002 * f64::from(i * 37 % 60) / 60.0;
        let value = if i == 40 { 2.0 } else { noisy };
        let [light, sensor, turned] = [i * 7 % 80, i * 11 % 79, i * 29 % 360];
        format!("{light},0,{sensor},{turned},{value}\n")
    };
    let rows: String = (0..60).map(row).collect();
    bench.write("slip.csv", READINGS.to_owned() + &rows);
    let listed = r"left out: 1 reading, since all others contradict it\n  slip.csv:42: theta_i 40.00°, theta_o 45.00°";
    // Kriging says so where it does it by itself.
    let kriging = "reconstruct slip.csv --take-all --reconstruction kriging --set";
    bench.does(&format!(
        "0 | reconstruct slip.csv --checked checked.csv | {listed}
         0 | next slip.csv --batch 1 -o next.csv | left out: 1 reading
         0 | {kriging} robust=true | 1 reading is left out, contradicted"
    ));
    let marked = bench.read("checked.csv");
    let marked = marked.lines().filter(|line| line.contains("suspected"));
    let marked: Vec<&str> = marked.collect();
    assert!(marked.len() == 1 && marked[0].contains(",2,"), "{marked:?}");
    let all = bench.good("reconstruct slip.csv --take-all");
    assert!(!all.contains("left out: 1 reading"), "{all}");
    let plain = bench.good(format!("{kriging} robust=false"));
    assert!(!plain.contains("1 reading is left out"), "{plain}");
}

/// Uncertainties of type B alone say nothing of what is between readings; lights that were not read have no albedo; a channel has
/// its name.
#[test]
fn what_readings_do_not_say_is_not_printed_as_a_number() {
    let bench = Bench::new();
    let columns = "value_r,value_g,value_b,uncertainty_r,uncertainty_g,uncertainty_b";
    let mut text = READINGS.replace("value", columns);
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
fn files_and_kinds_stand_in_place_of_a_config() {
    let bench = Bench::new();
    bench.does(
        "0 | schedule lambert --set albedo=0.5 --parametrization hybrid --budget 40 -o s.csv
         0 | measure s.csv --config lambert --set albedo=0.5 -o r.brdf
         0 | tabulate lambert --set albedo=0.5 -o t.zbsdf",
    );
    // What is in a file says what it is.
    fs::rename(bench.path("t.zbsdf"), bench.path("t.bsdf")).unwrap();
    fs::rename(bench.path("r.brdf"), bench.path("r.txt")).unwrap();
    for file in ["t.bsdf", "r.txt"] {
        let few = "--set budgets=[40] --set metrics.tolerance=0.5";
        bench.does(&format!(
            "0 | schedule {file} --parametrization hybrid --budget 20 -o s-{file}.csv
             0 | measure s.csv --config {file} -o m-{file}.csv
             0 | run {file} {few} -o run-{file} | hybrid"
        ));
    }
    bench.write("one.csv", "");
    bench.write("cloth.bin", "");
    bench.does(
        "3 | tabulate one.csv -o x.binary | one.csv … no line that names the columns
         3 | tabulate cloth.bin -o x.binary | cloth.bin
         2 | tabulate lamberd -o x.binary | cannot read this config",
    );
}
