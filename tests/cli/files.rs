//! Poses and readings as files: schedule → measure → reconstruct.

use super::Bench;
use std::fs;

/// The numbers of a column of the table of errors.
pub fn errors(text: &str, measure: &str) -> Vec<f64> {
    let table = text.rfind("\nerror ").unwrap_or_else(|| panic!("{text}"));
    let mut rows = text[table..].lines().skip(1);
    let headings: Vec<&str> = rows.next().unwrap().split_whitespace().skip(1).collect();
    let column = headings.iter().position(|h| *h == measure).unwrap();
    let headings = headings.len();
    let cells = |row: &str| -> Vec<String> {
        // A number, or one with its standard error.
        let words: Vec<&str> = row.split_whitespace().collect();
        let mut cells = Vec::new();
        for (i, word) in words.iter().enumerate().skip(1) {
            if *word != "±" && words[i - 1] != "±" {
                cells.push((*word).to_owned());
            }
        }
        cells
    };
    let rows = rows.map(cells).take_while(|row| row.len() == headings);
    rows.map(|row| row[column].parse().unwrap()).collect()
}

#[test]
fn the_way_through_files_ends_where_a_run_does() {
    let bench = Bench::new();
    let config = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/quickstart.toml");
    let set = [
        "--set",
        "material=[{kind=\"ggx\",alpha=0.3}]",
        "--set",
        "budgets=[250]",
        "--set",
        "metrics={ pairs = 500, max_pairs = 1 }",
    ];
    bench.good(&[&["run", config, "-o", "run", "-q"], &set[..]].concat());
    let rows = bench.rows("run");
    let material = rows
        .iter()
        .map(|r| r.material.clone())
        .find(|name| name.contains("ggx"))
        .unwrap();
    for (format, choices) in [
        (
            "csv",
            [
                ("half-difference", "theta_h:square-root"),
                ("spherical", "none"),
            ],
        ),
        (
            "jsonl",
            [("half-difference", "none"), ("orthographic", "none")],
        ),
    ] {
        for (name, warp) in choices {
            let (poses, readings) = (format!("p.{format}"), format!("r.{format}"));
            let choice = ["--parametrization", name, "--warp", warp];
            let file = ["-o", &poses, "--force", "--material", &material];
            bench.good(&[&["schedule", config], &set[..], &choice, &file].concat());
            let file = ["--material", &material, "-o", &readings, "--force"];
            let said = bench.good(&[&["measure", &poses, "--config", config], &file[..]].concat());
            assert!(said.contains(" 0 without data"), "{said}");
            for kind in ["multilinear", "cubic"] {
                let how = ["--reconstruction", kind, "--against", "c.toml"];
                // The same test pairs as the run.
                let text = fs::read_to_string(config).unwrap()
                    + "\n[metrics]\npairs = 500\nmax_pairs = 1\n";
                fs::write(bench.path("c.toml"), text).unwrap();
                let of = ["--material", &material];
                let said = bench.good(&[&["reconstruct", &readings], &how[..], &of].concat());
                assert!(said.contains(&format!("in {name} coordinates")), "{said}");
                let mut compared = 0;
                for row in &rows {
                    let same = row.material == material
                        && (row.parametrization.as_str(), row.warp.as_str()) == (name, warp)
                        && row.reconstruction == kind;
                    if !same {
                        continue;
                    }
                    compared += 1;
                    let found = errors(&said, &row.measure);
                    assert_eq!(found.len(), 9);
                    // Bit-identical poses of a lattice: only the five printed digits round.
                    for (found, of_run) in found.iter().zip([
                        "nrmse",
                        "log_relative",
                        "log1p",
                        "cbrt",
                        "mean_relative",
                        "energy",
                        "relative_p999",
                        "extrapolated",
                        "unknown",
                    ]) {
                        let of_run = row.value(of_run).unwrap();
                        let close = (found - of_run).abs() <= 0.5001e-4 * of_run.abs().max(1e-300);
                        assert!(close, "{name} {warp} {kind}: {found} {of_run}");
                    }
                }
                assert_eq!(compared, 2, "both measures");
            }
        }
    }
}

const CONFIG: &str = "budgets = [9]\n[[material]]\nkind = \"lambert\"\nalbedo = 0.5\n";

#[test]
fn an_instrument_reads_the_same_through_files() {
    let bench = Bench::new();
    let config = r#"
budgets = [200]
measures = ["cosine"]
[[material]]
kind = "ggx"
alpha = 0.2
[[parametrization]]
kind = "hybrid"
[[reconstruction]]
kind = "cubic"
[[instrument]]
preset = "utia"
[metrics]
pairs = 2000
max_pairs = 1
"#;
    fs::write(bench.path("i.toml"), config).unwrap();
    bench.good(&["run", "i.toml", "-o", "run", "-q"]);
    let rows = bench.rows("run");
    let [row] = rows.as_slice() else {
        panic!("{} rows", rows.len())
    };
    assert!(row.reachable < 1.0);
    for format in ["csv", "jsonl"] {
        let (poses, readings) = (format!("p.{format}"), format!("r.{format}"));
        let sentence = bench.refused(&["schedule", "i.toml", "-o", &poses], 4);
        let lost = row.poses - row.readings;
        let told = format!("utia cannot take {lost} of {} poses (", row.poses);
        assert!(sentence.contains(&told), "{sentence}");
        assert!(sentence.contains("--skip-unreachable"), "{sentence}");
        assert!(!bench.path(&poses).exists());
        bench.good(&["schedule", "i.toml", "-o", &poses, "--skip-unreachable"]);
        let said = bench.good(&["measure", &poses, "--config", "i.toml", "-o", &readings]);
        let minutes = row.instrument_seconds.unwrap() / 60.0;
        let told = format!(
            "{} readings, 0 without data, {lost} out of reach, {minutes:.1} min",
            row.readings
        );
        assert!(said.contains(&told), "{said}");
        // What the schedule left out keeps its reason.
        let text = fs::read_to_string(bench.path(&readings)).unwrap();
        assert!(text.contains("unreachable:light-elevation"), "{text}");
        let against = ["--against", "i.toml", "--reconstruction", "cubic"];
        let said = bench.good(&[&["reconstruct", &readings], &against[..]].concat());
        // The same poses, times and noise: the same readings, hence the same errors.
        let found = errors(&said, "cosine")[0];
        let of_run = row.value("nrmse").unwrap();
        assert!(
            (found - of_run).abs() <= 0.5001e-4 * of_run,
            "{found} {of_run}"
        );
    }
}

#[test]
fn a_table_without_its_comments_is_taken_at_its_word() {
    let bench = Bench::new();
    let instrument = ["--instrument", "utia", "--skip-unreachable"];
    let choice = ["--material", "ggx-0.4", "--budget", "150", "--seed", "1"];
    let more = ["--warp", "none", "--sample-set", "grid", "-o", "p.csv"];
    bench.good(&[&["schedule", "small.toml"], &choice[..], &more, &instrument].concat());
    let text = fs::read_to_string(bench.path("p.csv")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
    assert!(rows[0].contains("turntable_deg"));
    fs::write(bench.path("bare.csv"), rows.join("\n") + "\n").unwrap();
    let of = [
        "--config",
        "small.toml",
        "--material",
        "ggx-0.4",
        "-o",
        "r.csv",
    ];
    let said = bench.good(&[&["measure", "bare.csv"], &of[..]].concat());
    let told = format!("{0} poses: {0} readings", rows.len() - 1);
    assert!(said.contains(&told), "{said}");
    // A schedule is no measurement, and says so.
    let sentence = bench.refused(&["reconstruct", "p.csv"], 3);
    assert!(sentence.contains("measure it first"), "{sentence}");
}

#[test]
fn poses_by_hand_are_measured_or_refused_with_their_reason() {
    let bench = Bench::new();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n";
    fs::write(
        bench.path("good.csv"),
        format!("{head}30,0,40,90\n45,0,45,180\n"),
    )
    .unwrap();
    fs::write(
        bench.path("retro.csv"),
        format!("{head}30,0,40,90\n45,0,45,0\n80,0,10,180\n"),
    )
    .unwrap();
    let measure = |file: &str, more: &[&str]| {
        let out = format!("{file}.readings.csv");
        let args = [
            "measure",
            file,
            "--config",
            "small.toml",
            "--material",
            "ggx-0.4",
        ];
        let out = ["--instrument", "utia", "-o", &out, "--force"];
        let more = [&args[..], &out[..], more].concat();
        bench.command(&more).output().unwrap()
    };
    assert_eq!(measure("good.csv", &[]).status.code(), Some(0));
    let refused = measure("retro.csv", &[]);
    assert_eq!(refused.status.code(), Some(4));
    let sentence = String::from_utf8(refused.stderr).unwrap();
    let told = "utia cannot take 2 of 3 poses (1: occluded, 2: light-elevation)";
    assert!(sentence.contains(told), "{sentence}");
    assert!(!bench.path("retro.csv.readings.csv").exists());
    assert_eq!(
        measure("retro.csv", &["--skip-unreachable"]).status.code(),
        Some(0)
    );
    let text = fs::read_to_string(bench.path("retro.csv.readings.csv")).unwrap();
    // Nothing is lost: the rows of both are there, without a value.
    assert!(text.contains(",occluded,1\n"), "{text}");
    assert!(text.contains(",unreachable:light-elevation,1\n"), "{text}");
    // The order of the file is the order of time.
    let rows: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
    assert_eq!(rows.len(), 4);
}

#[test]
fn a_table_from_a_spreadsheet_goes_all_the_way() {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CONFIG).unwrap();
    let mut table = "\u{feff}theta_i_deg;phi_i_deg;theta_o_deg;phi_o_deg\r\n".to_owned();
    for i in 0..9 {
        for j in 0..9 {
            table += &format!("{};0;{},5;{}\r\n", 10 * i, 9 * j, 20 * ((i + j) % 9));
        }
    }
    fs::write(bench.path("hand.csv"), table).unwrap();
    let said = bench.good(&["measure", "hand.csv", "--config", "c.toml", "-o", "r.csv"]);
    assert!(said.contains("81 poses: 81 readings"), "{said}");
    let said = bench.good(&[
        "reconstruct",
        "r.csv",
        "--against",
        "c.toml",
        "--reconstruction",
        "inverse-distance",
        "--set",
        "values=linear",
        "-o",
        "copy.bin",
    ]);
    for part in [
        "81 poses (file) in half-difference coordinates",
        "theta_i 0.00° to 80.00°, theta_o 0.50° to 72.50°",
    ] {
        assert!(said.contains(part), "{said}");
    }
    // Whatever mean of equal readings it is, it is that reading.
    assert!(errors(&said, "cosine")[0] < 1e-12, "{said}");
    assert_eq!(
        bench
            .files(".")
            .iter()
            .filter(|f| f.ends_with(".bin"))
            .count(),
        1
    );
    let said = bench.good(&["reconstruct", "r.csv", "--against", "copy.bin"]);
    assert!(errors(&said, "lobe")[1] < 1e-3, "{said}");
}

#[test]
fn alta_files_are_readings_too() {
    let bench = Bench::new();
    let mut text = "#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n".to_owned();
    for i in 0..20 {
        for j in 0..8 {
            let (h, d) = (0.07 * f64::from(i), 0.19 * f64::from(j));
            text += &format!("{h} {d} 1.2 0.25\n");
        }
    }
    fs::write(bench.path("alta.dat"), text).unwrap();
    let said = bench.good(&["reconstruct", "alta.dat", "--reconstruction", "nearest"]);
    assert!(
        said.contains("ALTA RUSIN_TH_TD_PD: ") && said.contains("nearest"),
        "{said}"
    );
    let below: usize = said
        .split("RUSIN_TH_TD_PD: ")
        .nth(1)
        .and_then(|rest| rest.split_whitespace().next()?.parse().ok())
        .unwrap();
    assert!((1..160).contains(&below), "{said}");
    fs::write(bench.path("bad.dat"), "#DIM 3 1\n#PARAM_IN COS_TH\n").unwrap();
    let sentence = bench.refused(&["reconstruct", "bad.dat"], 3);
    assert!(
        sentence.contains("bad.dat:2: #PARAM_IN COS_TH"),
        "{sentence}"
    );
}

#[test]
fn bad_input_is_refused_with_its_line() {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CONFIG).unwrap();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    let poses = |text: String| fs::write(bench.path("p.csv"), text).unwrap();
    let measure = ["measure", "p.csv", "--config", "c.toml", "-o", "r.csv"];
    for (rows, part) in [
        (
            "1,2,3,4\n1,2,93,4\n",
            "p.csv:3: theta_o_deg = 93: allowed is",
        ),
        (
            "1,2,3,4\n5,6,7,8\n1,2,3,4\n",
            "p.csv:4: this pose is that of line 2",
        ),
        ("1,2,3\n", "p.csv:2: 3 cells where there are 4 columns"),
        ("1,2,x,4\n", "p.csv:2: theta_o_deg = x"),
        ("", "p.csv: there is no row"),
    ] {
        poses(format!("{head}\n{rows}"));
        let sentence = bench.refused(&measure, 3);
        assert!(sentence.contains(part), "{sentence}");
        assert!(!bench.path("r.csv").exists());
    }
    poses(format!("{head},colour\n1,2,3,4,5\n"));
    let sentence = bench.refused(&measure, 3);
    assert!(
        sentence.contains("p.csv:1: column \"colour\" is not known"),
        "{sentence}"
    );
    let sentence = bench.refused(
        &["measure", "none.csv", "--config", "c.toml", "-o", "r.csv"],
        3,
    );
    assert!(sentence.contains("none.csv: cannot read"), "{sentence}");
    poses(format!("{head}\n1,2,3,4\n"));
    let to = |file| ["measure", "p.csv", "--config", "c.toml", "-o", file];
    assert!(
        bench
            .refused(&to("r.txt"), 2)
            .contains("allowed: .csv, .jsonl")
    );
    bench.good(&to("r.csv"));
    assert!(bench.refused(&to("r.csv"), 2).contains("--force"));
    bench.good(&[&to("r.csv")[..], &["--force"]].concat());

    let reconstruct =
        |more: &[&str], code| bench.refused(&[&["reconstruct", "r.csv"], more].concat(), code);
    for (more, code, part) in [
        (&["--reconstruction", "magic"][..], 2, "allowed: nearest"),
        (&["--reconstruction", "cubic"], 3, "cubic needs a grid"),
        (
            &["--reconstruction", "nearest", "--set", "wings=2"],
            2,
            "wings",
        ),
        (&["--parametrization", "cube"], 2, "allowed: spherical"),
        (
            &["--against", "c.toml", "--material", "gold"],
            2,
            "allowed: lambert",
        ),
        (&["--against", "nothing"], 2, "neither a config"),
    ] {
        let sentence = reconstruct(more, code);
        assert!(sentence.contains(part), "{sentence}");
    }
    // What is behind an error is told after it, a line each.
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    let odd = format!("{angles},value,flags\n1,2,3,4,5,dirty\n");
    fs::write(bench.path("odd.csv"), odd).unwrap();
    let output = bench.gonio(&["reconstruct", "odd.csv"]);
    let told = String::from_utf8(output.stderr).unwrap();
    let lines: Vec<_> = told.lines().collect();
    assert_eq!((output.status.code(), lines.len()), (Some(3), 2), "{told}");
    assert!(lines[0].contains("odd.csv:2: flags = \"dirty\" cannot be read"));
    assert!(lines[1].starts_with("  because: \"dirty\" is no flag; allowed are saturated"));

    // A table is no text, whatever it is wanted for; what is written has a format.
    fs::write(bench.path("t.binary"), "").unwrap();
    for (args, code, part) in [
        (
            &["reconstruct", "t.binary"][..],
            3,
            "allowed: csv, json-lines, npz, alta, pab-opto, astm",
        ),
        (
            &["measure", "t.binary", "--config", "c.toml", "-o", "x.csv"],
            3,
            "allowed: csv, json-lines, npz",
        ),
        (
            &["reconstruct", "r.csv", "-o", "x.ssdd"],
            2,
            "allowed: .binary, .bin, .bsdf, .xml, .zbsdf, .mbsdf, or --format",
        ),
        (
            &["tabulate", "c.toml", "-o", "x.ssdd"],
            2,
            "allowed: .binary, .bin, .bsdf, .xml, .zbsdf, .mbsdf, or --format",
        ),
    ] {
        let sentence = bench.refused(args, code);
        assert!(sentence.contains(part), "{sentence}");
    }
    bench.good(&[
        "reconstruct",
        "r.csv",
        "--reconstruction",
        "nearest",
        "-o",
        "x.BIN",
    ]);
    assert_eq!(fs::metadata(bench.path("x.BIN")).unwrap().len(), 1_990_656);

    let cut = bench.read("r.csv");
    fs::write(bench.path("r.csv"), &cut[..cut.len() - 4]).unwrap();
    let sentence = bench.refused(&["reconstruct", "r.csv"], 3);
    assert!(sentence.contains("r.csv:"), "{sentence}");
}

#[test]
fn the_schema_is_json() {
    let bench = Bench::new();
    for file in ["schedule", "measurement"] {
        let schema: serde_json::Value =
            serde_json::from_str(&bench.good(&["schema", file])).unwrap();
        assert_eq!(schema["oneOf"].as_array().unwrap().len(), 2);
    }
}

#[test]
fn a_picture_is_a_png() {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CONFIG).unwrap();
    let poses = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n1,0,2,0,0.1\n40,0,50,90,0.2\n";
    fs::write(bench.path("r.csv"), poses).unwrap();
    let picture = ["--reconstruction", "nearest", "--picture", "s.png"];
    bench.good(&[&["reconstruct", "r.csv"], &picture[..]].concat());
    assert!(
        fs::read(bench.path("s.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
}

#[test]
fn a_message_repeats_the_start_of_a_long_text() {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CONFIG).unwrap();
    let long = "1e x".repeat(1 << 18);
    let angles = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg";
    let alta = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n";
    let word = long.replace(' ', "_");
    for (line, part, text) in [
        (
            2,
            "value = 1e x1e",
            format!("{angles},value\n1,2,3,4,{long}\n"),
        ),
        (
            2,
            "value = 1e x1e",
            format!("{angles},value\n1,2,3,4,\"{long}\"\n"),
        ),
        (
            2,
            "flags = \"1e x",
            format!("{angles},value,flags\n1,2,3,4,5,{long}\n"),
        ),
        (1, "column \"1e x", format!("{angles},{long}\n1,2,3,4,5\n")),
        (
            1,
            "seed = \"1e x",
            format!("# seed = \"{long}\"\n{angles},value\n1,2,3,4,5\n"),
        ),
        (
            1,
            "parametrization = \"1e x",
            format!("# parametrization = \"{long}\"\n{angles},value\n1,2,3,4,5\n"),
        ),
        (
            1,
            "warp = \"1e x",
            format!("# warp = \"{long}\"\n{angles},value\n1,2,3,4,5\n"),
        ),
        (1, "value = \"1e x", format!("{{\"value\":\"{long}\"}}\n")),
        (
            2,
            "\"1e x",
            format!("{{\"value\":1}}\n{{\"value\":1,\"{long}\":1}}\n"),
        ),
        (1, "key \"1e x", format!("{{\"{long}\":1,\"{long}\":1}}\n")),
        (4, "1e_x", format!("{alta}{word} 0 0 0 1\n")),
        (1, "#DIM 1e x", alta.replace("4 1", &long)),
        (
            2,
            "#PARAM_IN 1e x",
            alta.replace("SPHERICAL_TL_PL_TV_PV", &long),
        ),
        (3, "#PARAM_OUT 1e x", alta.replace("INV_STERADIAN", &long)),
        (4, "#VS 1e x", format!("{alta}#VS {long}\n")),
        (4, "#FORMAT 1e x", format!("{alta}#FORMAT {long}\n")),
    ] {
        fs::write(bench.path("r.csv"), text).unwrap();
        let sentence = bench.refused(&["reconstruct", "r.csv"], 3);
        assert!(
            sentence.contains(&format!("r.csv:{line}: {part}")),
            "{sentence}"
        );
        // The list of columns that are allowed is the longest part of any.
        assert!(sentence.len() < 2000, "{sentence}");
    }
    let config = |text: String| fs::write(bench.path("long.toml"), text).unwrap();
    let quoted = format!("\"{long}\"");
    for text in [
        format!("experiment = {quoted}\n"),
        format!("channels = {quoted}\n"),
        format!("seeds = {quoted}\n"),
        format!("measures = [{quoted}]\n"),
        format!("{quoted} = 1\n"),
        format!("{quoted} = 1\n{quoted} = 1\n"),
        format!("[[material]]\nkind = {quoted}\n"),
        format!("[[material]]\nkind = {}\n", long.replace(' ', "")),
        format!("[[material]]\nkind = \"ggx\"\nalpha = {quoted}\n"),
        format!("[[material]]\nkind = \"ggx\"\n{quoted} = 1\n"),
        format!("{CONFIG}[[instrument]]\npreset = {quoted}\n"),
        format!("{CONFIG}name = {quoted}\n"),
    ] {
        config(text);
        let sentence = bench.refused(&["check", "long.toml"], 2);
        assert!(sentence.contains("long.toml"), "{sentence}");
        assert!(sentence.len() < 2000, "{sentence}");
    }
    let word = "w".repeat(100_000);
    for args in [
        &["check", "c.toml", "--set", &word][..],
        &["check", "c.toml", "--set", &format!("{word}=1")],
        &["check", "c.toml", "--set", &format!("material.{word}=1")],
        &[
            "check",
            "c.toml",
            "--set",
            &format!("material.0.kind={word}"),
        ],
        &["schedule", "c.toml", "--material", &word, "-o", "p.csv"],
        &[
            "schedule",
            "c.toml",
            "--parametrization",
            &word,
            "-o",
            "p.csv",
        ],
        &[
            "slice",
            "c.toml",
            "--material",
            &word,
            "--view-deg",
            "3",
            "-o",
            ".",
        ],
        &["tabulate", "c.toml", "--material", &word, "-o", "t.binary"],
        &["subset", "--parametrization", &word, "--box", "k=0..1"],
        &["subset", "--parametrization", "hybrid", "--box", &word],
    ] {
        let sentence = bench.refused(args, 2);
        assert!(sentence.len() < 2000, "{sentence}");
    }
}

#[test]
fn a_key_that_is_there_twice_is_refused() {
    let bench = Bench::new();
    let row = "\"theta_i_deg\":1,\"phi_i_deg\":2,\"theta_o_deg\":3,\"phi_o_deg\":4";
    for (text, place) in [
        (
            format!("{{{row},\"value\":1,\"value\":2}}\n"),
            "r.csv:1: key \"value\"",
        ),
        (
            format!("{{\"header\":{{\"rows\":7,\"rows\":1}}}}\n{{{row},\"value\":1}}\n"),
            "r.csv:1: key \"rows\"",
        ),
        (
            format!("{{\"header\":{{}},\"header\":{{}}}}\n{{{row},\"value\":1}}\n"),
            "r.csv:1: key \"header\"",
        ),
        (
            format!("{{{row},\"value\":1}}\n{{{row},\"phi_o_deg\":4,\"value\":1}}\n"),
            "r.csv:2: key \"phi_o_deg\"",
        ),
    ] {
        fs::write(bench.path("r.csv"), text).unwrap();
        let sentence = bench.refused(&["reconstruct", "r.csv"], 3);
        let told = format!("{place} is there twice; allowed: once");
        assert!(sentence.contains(&told), "{sentence}");
    }
}

#[test]
fn a_config_nested_without_end_is_refused() {
    let bench = Bench::new();
    let n = 10_000;
    for text in [
        format!("budgets = {}{}\n", "[".repeat(n), "]".repeat(n)),
        format!("metrics = {}1{}\n", "{a=".repeat(n), "}".repeat(n)),
        format!("{}a = 1\n", "a.".repeat(n)),
        format!("[{}a]\n", "a.".repeat(n)),
    ] {
        fs::write(bench.path("deep.toml"), text).unwrap();
        let sentence = bench.refused(&["check", "deep.toml"], 2);
        assert!(sentence.contains("deep.toml"), "{sentence}");
        assert!(
            sentence.contains("nested too deep; allowed: less than 80"),
            "{sentence}"
        );
    }
}

#[test]
fn a_name_that_no_file_can_have_is_refused() {
    let bench = Bench::new();
    let named = |table: &str, bytes: usize| {
        let name = "n".repeat(bytes);
        let text = format!("{CONFIG}[[parametrization]]\nkind = \"hybrid\"\n{table}");
        let text = text.replace("NAME", &format!("name = \"{name}\""));
        fs::write(bench.path("c.toml"), text).unwrap();
    };
    for (table, key) in [
        ("[[material]]\nkind = \"ggx\"\nNAME\n", "material[1].name"),
        (
            "[[sample_set]]\nkind = \"grid\"\nNAME\n",
            "sample_set[0].name",
        ),
        (
            "[[instrument]]\npreset = \"utia\"\nNAME\n",
            "instrument[0].name",
        ),
    ] {
        named(table, 201);
        for command in [
            &["check", "c.toml"][..],
            &["schedule", "c.toml", "-o", "out/"],
        ] {
            let sentence = bench.refused(command, 2);
            let told = format!("{key} = \"nnn");
            assert!(sentence.contains(&told), "{sentence}");
            assert!(
                sentence.contains("allowed is at most 200 bytes"),
                "{sentence}"
            );
            assert!(sentence.len() < 300, "{sentence}");
        }
        assert!(!bench.path("out").exists());
        named(table, 200);
        bench.good(&["schedule", "c.toml", "-o", "out/", "--skip-unreachable"]);
        assert!(!bench.files("out").is_empty());
        fs::remove_dir_all(bench.path("out")).unwrap();
    }
}

/// A pipe with a name, which nobody reads and nobody writes to.
#[cfg(unix)]
fn pipe(bench: &Bench, name: &str) {
    let made = std::process::Command::new("mkfifo")
        .arg(bench.path(name))
        .status();
    assert!(made.unwrap().success());
}

#[cfg(unix)]
#[test]
fn only_files_are_replaced_and_links_are_followed() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CONFIG).unwrap();
    bench.good(&["schedule", "c.toml", "-o", "p.csv"]);
    bench.good(&["measure", "p.csv", "--config", "c.toml", "-o", "r.csv"]);
    let commands: [&[&str]; 5] = [
        &["schedule", "c.toml"],
        &["measure", "p.csv", "--config", "c.toml"],
        &[
            "reconstruct",
            "r.csv",
            "--reconstruction",
            "nearest",
            "--format",
            "utia",
        ],
        &["tabulate", "c.toml", "--format", "utia"],
        &["claims", "--format", "csv"],
    ];
    pipe(&bench, "pipe.csv");
    fs::create_dir(bench.path("folder.csv")).unwrap();
    for command in commands {
        for (name, force) in [
            ("pipe.csv", &["--force"][..]),
            ("pipe.csv", &[]),
            ("folder.csv", &["--force"]),
        ] {
            if name == "folder.csv" && command[0] == "schedule" {
                continue; // Writes into it.
            }
            let sentence = bench.refused(&[command, &["-o", name], force].concat(), 2);
            assert!(sentence.contains("is no regular file"), "{sentence}");
        }
        // A link is somebody's choice of place; what it leads to is replaced whole.
        let [link, dangling] = ["link.csv", "dangling.csv"];
        for name in ["file", link, dangling, "new"] {
            let _ = fs::remove_file(bench.path(name));
        }
        fs::write(bench.path("file"), "old").unwrap();
        symlink("file", bench.path(link)).unwrap();
        symlink("new", bench.path(dangling)).unwrap();
        let to = |name| [command, &["-o", name]].concat();
        assert!(bench.refused(&to(link), 2).contains("--force"));
        assert_eq!(bench.read("file"), "old");
        bench.good(&[&to(link)[..], &["--force"]].concat());
        bench.good(&to(dangling));
        for name in [link, dangling] {
            let kind = bench.path(name).symlink_metadata().unwrap().file_type();
            assert!(kind.is_symlink(), "{command:?}");
        }
        let bytes = |name| fs::read(bench.path(name)).unwrap();
        assert!(bytes("new") == bytes("file") && bytes("file").len() > 100);
    }
    let kind = bench.path("pipe.csv").symlink_metadata().unwrap();
    assert!(kind.file_type().is_fifo());
    assert!(bench.files(".").iter().all(|name| !name.ends_with(".part")));
}

#[cfg(unix)]
#[test]
fn an_input_without_an_end_is_refused() {
    use std::process::Stdio;
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CONFIG).unwrap();
    for name in ["pipe", "pipe.binary", "pipe.bin", "pipe.hdr"] {
        pipe(&bench, name);
    }
    let map = [
        "picture",
        "sphere",
        "ggx",
        "-o",
        ".",
        "--lighting",
        "pipe.hdr",
    ];
    for (args, code) in [
        (&["check", "pipe"][..], 2),
        (&["check", "/dev/zero"], 2),
        (&["measure", "pipe", "--config", "c.toml", "-o", "r.csv"], 3),
        (&["reconstruct", "/dev/zero"], 3),
        (&["slice", "pipe.binary", "--view-deg", "30", "-o", "."], 3),
        (&["slice", "pipe.bin", "--view-deg", "30", "-o", "."], 3),
        (&map, 3),
    ] {
        let sentence = bench.refused(args, code);
        assert!(sentence.contains("regular file"), "{sentence}");
    }
    // What the process was given to read has an end, or is no text from the first byte on.
    let from = |file: &str| {
        let mut command = bench.command(&["check", "/dev/stdin"]);
        let input = fs::File::open(bench.path(file)).unwrap();
        command.stdin(Stdio::from(input)).output().unwrap()
    };
    assert_eq!(from("c.toml").status.code(), Some(0));
    let endless = from("/dev/zero");
    assert_eq!(endless.status.code(), Some(2));
    let sentence = String::from_utf8(endless.stderr).unwrap();
    assert!(sentence.contains("line 1 has a zero byte"), "{sentence}");
}
