//! Poses and readings as files: schedule → measure → reconstruct.

use super::common::{edited, near, product, says, table};
use super::{Bench, POSES, READINGS};
use gonio::experiment::Row;
use std::fs;

/// The numbers of a column of the table of errors.
pub fn errors(text: &str, measure: &str) -> Vec<f64> {
    let table = text.rfind("\nerror ").unwrap_or_else(|| panic!("{text}"));
    let mut rows = text[table..].lines().skip(1);
    let headings: Vec<&str> = rows.next().unwrap().split_whitespace().skip(1).collect();
    let column = headings.iter().position(|h| *h == measure).unwrap();
    // Cells are numbers, or those with their standard errors.
    let cells = |row: &str| -> Vec<String> {
        let row = row.replace(" ± ", "±");
        row.split_whitespace().skip(1).map(String::from).collect()
    };
    let rows = rows
        .map(cells)
        .take_while(|row| row.len() == headings.len());
    let number = |row: Vec<String>| row[column].split('±').next().unwrap().parse().unwrap();
    rows.map(number).collect()
}

#[test]
fn the_way_through_files_ends_where_a_run_does() {
    let bench = Bench::new();
    let config = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/quickstart.toml");
    let set = "--set material=[{kind=\"ggx\",alpha=0.3}] --set budgets=[250] --set 'metrics={ pairs = 500, max_pairs = 1 }'";
    let sets = "--set sample_set=[{kind=\"grid\"}] --set reconstruction=[{kind=\"multilinear\"},{kind=\"cubic\"}]";
    bench.good(format!("run {config} -o run -q {set} {sets}"));
    let rows = bench.rows("run");
    let material = rows.iter().map(|r| r.material.as_str());
    let material = { material }.find(|name| name.contains("ggx")).unwrap();
    // The same test pairs as the run.
    let text = fs::read_to_string(config).unwrap();
    let pairs = "pairs = 500\nmax_pairs = 1";
    let text = edited(&text, "tolerance = 0.04\nmax_pairs = 16384", pairs);
    bench.write("c.toml", text);
    for [format, name, warp] in table(
        "csv | half-difference | theta_h:square-root
         csv | spherical | none
         jsonl | half-difference | none
         jsonl | orthographic | none",
    ) {
        let (poses, readings) = (format!("p.{format}"), format!("r.{format}"));
        let choice = format!("--parametrization {name} --warp '{warp}'");
        let of = format!("--material {material}");
        let schedule = format!("schedule {config} {set} {choice} --sample-set grid");
        bench.good(format!("{schedule} -o {poses} --force {of}"));
        let measure = format!("measure {poses} --config {config} {of} -o {readings} --force");
        bench.tells(measure, " 0 without data");
        for kind in ["multilinear", "cubic"] {
            let how = format!("--reconstruction {kind} --against c.toml");
            let said = bench.good(format!("reconstruct {readings} {how} {of}"));
            says(&said, &format!("in {name} coordinates"));
            let is_same = |row: &&Row| {
                [&*row.material, &row.parametrization, &row.warp] == [material, name, warp]
                    && row.reconstruction == kind
            };
            let same: Vec<_> = rows.iter().filter(is_same).collect();
            assert_eq!(same.len(), 2, "both measures");
            for row in same {
                let found = errors(&said, &row.measure);
                assert_eq!(found.len(), 9);
                // Bit-identical poses of a lattice: only the five printed digits round.
                let names = "nrmse log_relative log1p cbrt mean_relative energy relative_p999 extrapolated unknown";
                for (found, of_run) in found.iter().zip(names.split(' ')) {
                    let of_run = row.value(of_run).unwrap();
                    let close = (found - of_run).abs() <= 0.5001e-4 * of_run.abs().max(1e-300);
                    assert!(close, "{name} {warp} {kind}: {found} {of_run}");
                }
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
material = [{ kind = "ggx", alpha = 0.2 }]
parametrization = [{ kind = "hybrid" }]
reconstruction = [{ kind = "cubic" }]
instrument = [{ preset = "utia" }]
metrics = { pairs = 2000, max_pairs = 1 }
"#;
    bench.write("i.toml", config);
    bench.good("run i.toml -o run -q");
    let [row]: [Row; 1] = bench.rows("run").try_into().unwrap();
    assert!(row.reachable < 1.0);
    for format in ["csv", "jsonl"] {
        let (poses, readings) = (format!("p.{format}"), format!("r.{format}"));
        let (lost, all) = (row.poses - row.readings, row.poses);
        let told = format!("utia cannot take {lost} of {all} poses ( … --skip-unreachable");
        bench.refuses(format!("schedule i.toml -o {poses}"), 4, &told);
        assert!(!bench.path(&poses).exists());
        bench.good(format!("schedule i.toml -o {poses} --skip-unreachable"));
        let minutes = row.instrument_seconds.unwrap() / 60.0;
        let left_out = format!("0 without data, {lost} out of reach, {minutes:.1} min");
        let told = format!("{} readings, {left_out}", row.readings);
        let measure = format!("measure {poses} --config i.toml -o {readings}");
        bench.tells(measure, &told);
        // What the schedule left out keeps its reason.
        says(&bench.read(&readings), "unreachable:light-elevation");
        let against = "--against i.toml --reconstruction cubic";
        let said = bench.good(format!("reconstruct {readings} {against}"));
        // The same poses, times and noise: the same readings, hence the same errors.
        let found = errors(&said, "cosine")[0];
        let of_run = row.value("nrmse").unwrap();
        near(found, of_run, 0.5001e-4 * of_run, format);
    }
}

#[test]
fn poses_by_hand_are_measured_or_refused_with_their_reason() {
    let bench = Bench::new();
    bench.write("good.csv", format!("{POSES}30,0,40,90\n45,0,45,180\n"));
    let retro = format!("{POSES}30,0,40,90\n45,0,45,0\n80,0,10,180\n");
    bench.write("retro.csv", retro);
    let measure =
        "--config small.toml --material ggx-0.4 --instrument utia -o readings.csv --force";
    let told = "utia cannot take 2 of 3 poses (1: occluded, 2: light-elevation)";
    bench.refuses(format!("measure retro.csv {measure}"), 4, told);
    assert!(!bench.path("readings.csv").exists());
    bench.does(&format!(
        "0 | measure good.csv {measure}
         0 | measure retro.csv {measure} --skip-unreachable"
    ));
    // Nothing is lost, in the order of the file, which is that of time: the rows of both are there, without a value.
    let rows = bench.lines("readings.csv");
    assert_eq!(rows.len(), 3);
    says(&rows[1], ",occluded,1");
    says(&rows[2], ",unreachable:light-elevation,1");
}

#[test]
fn a_table_from_a_spreadsheet_goes_all_the_way() {
    let bench = Bench::of(CONFIG);
    let mut table = "\u{feff}theta_i_deg;phi_i_deg;theta_o_deg;phi_o_deg\r\n".to_owned();
    for (i, j) in product(0..9, 0..9) {
        table += &format!("{};0;{},5;{}\r\n", 10 * i, 9 * j, 20 * ((i + j) % 9));
    }
    bench.write("hand.csv", table);
    let measure = "measure hand.csv --config c.toml -o r.csv";
    bench.tells(measure, "81 poses: 81 readings");
    let parts = "81 poses (file) in half-difference coordinates … theta_i 0.00° to 80.00°, theta_o 0.50° to 72.50°";
    let how = "--reconstruction inverse-distance --set values=linear -o copy.bin";
    let said = bench.tells(format!("reconstruct r.csv --against c.toml {how}"), parts);
    // Whatever mean of equal readings it is, it is that reading.
    assert!(errors(&said, "cosine")[0] < 1e-12, "{said}");
    let said = bench.good("reconstruct r.csv --against copy.bin");
    assert!(errors(&said, "lobe")[1] < 1e-3, "{said}");
}

#[test]
fn bad_input_is_refused_with_its_line() {
    let bench = Bench::of(CONFIG);
    bench.write("p.csv", POSES.to_owned() + "1,2,3,4\n");
    let measure = "measure p.csv --config c.toml -o r.csv";
    bench.good(measure);
    bench.write("t.binary", "");
    // A binary table in place of text, and an output of unknown format.
    bench.does(
        "3 | measure none.csv --config c.toml -o x.csv | none.csv: cannot read
         3 | reconstruct p.csv | measure it first
         2 | measure p.csv --config c.toml -o r.txt | allowed: .csv, .jsonl
         2 | measure p.csv --config c.toml -o r.csv | --force
         2 | reconstruct r.csv --reconstruction magic | allowed: nearest
         3 | reconstruct r.csv --reconstruction cubic | cubic needs a grid
         2 | reconstruct r.csv --reconstruction nearest --set wings=2 | wings
         2 | reconstruct r.csv --parametrization cube | allowed: spherical
         2 | reconstruct r.csv --against c.toml --material gold | allowed: lambert
         2 | reconstruct r.csv --against nothing | neither a config
         3 | reconstruct t.binary | allowed: csv, json-lines, npz, alta, pab-opto, astm
         3 | measure t.binary --config c.toml -o x.csv | allowed: csv, json-lines, npz
         2 | reconstruct r.csv -o x.ssdd | allowed: .binary, .bin, .bsdf, .xml, .zbsdf, .mbsdf, or --format
         2 | tabulate c.toml -o x.ssdd | allowed: .binary, .bin, .bsdf, .xml, .zbsdf, .mbsdf, or --format",
    );
    bench.good(format!("{measure} --force"));
    // What is behind an error is told after it, a line each.
    let flagged = READINGS.replace("value", "value,flags");
    bench.write("odd.csv", format!("{flagged}1,2,3,4,5,dirty\n"));
    let told = "odd.csv:2: flags = \"dirty\" cannot be read … \n  because: \"dirty\" is no flag; allowed are saturated";
    bench.refuses("reconstruct odd.csv", 3, told);
    bench.good("reconstruct r.csv --reconstruction nearest -o x.BIN --picture s.png");
    assert_eq!(bench.read_bytes("x.BIN").len(), 1_990_656);
    assert!(bench.read_bytes("s.png").starts_with(b"\x89PNG"));
    let cut = bench.read("r.csv");
    bench.write("r.csv", &cut[..cut.len() - 4]);
    bench.refuses("reconstruct r.csv", 3, "r.csv:");
}

#[test]
fn a_message_repeats_the_start_of_a_long_text() {
    let bench = Bench::of(CONFIG);
    let long = "1e x".repeat(1 << 18);
    let angles = POSES.trim_end();
    let alta = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n";
    // LONG and WORD are long.
    let filled = |text: &str| {
        let text = text.replace("ANGLES", angles).replace("ALTA", alta);
        let text = text.replace("WORD", &long.replace(' ', "_"));
        text.replace("LONG", &long) + "\n"
    };
    for [line, part, text] in table(
        r#"
        2 | value = 1e x1e | ANGLES,value\n1,2,3,4,LONG
        2 | value = 1e x1e | ANGLES,value\n1,2,3,4,"LONG"
        2 | flags = "1e x | ANGLES,value,flags\n1,2,3,4,5,LONG
        1 | column "1e x | ANGLES,LONG\n1,2,3,4,5
        2 | seed = "1e x | # sample_set = "file"\n# seed = "LONG"\nANGLES,value\n1,2,3,4,5
        1 | value = "1e x | {"value":"LONG"}
        2 | "1e x | {"value":1}\n{"value":1,"LONG":1}
        1 | key "1e x | {"LONG":1,"LONG":1}
        4 | 1e_x | ALTAWORD 0 0 0 1
        1 | #DIM 1e x | #DIM LONG\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN
        3 | #PARAM_OUT 1e x | #DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT LONG
        4 | #FORMAT 1e x | ALTA#FORMAT LONG"#,
    ) {
        bench.write("r.csv", filled(text));
        let part = format!("r.csv:{line}: {part}");
        let sentence = bench.refuses("reconstruct r.csv", 3, &part);
        // The list of columns that are allowed is the longest part of any.
        assert!(sentence.len() < 2000, "{sentence}");
    }
    for [text] in table(
        r#"
        experiment = "LONG"
        measures = ["LONG"]
        "LONG" = 1
        material = [{ kind = "LONG" }]
        material = [{ kind = "ggx", alpha = "LONG" }]
        material = [{ kind = "ggx" }]\ninstrument = [{ preset = "LONG" }]"#,
    ) {
        bench.write("long.toml", filled(text));
        let sentence = bench.refuses("check long.toml", 2, "long.toml");
        assert!(sentence.len() < 2000, "{sentence}");
    }
    let word = "w".repeat(100_000);
    for [line] in table(
        "check c.toml --set WORD
         check c.toml --set material.WORD=1
         check c.toml --set material.0.kind=WORD
         schedule c.toml --material WORD -o p.csv
         tabulate c.toml --material WORD -o t.binary
         subset --parametrization hybrid --box WORD",
    ) {
        let sentence = bench.refused(line.replace("WORD", &word), 2);
        assert!(sentence.len() < 2000, "{sentence}");
    }
}

#[test]
fn a_key_that_is_there_twice_is_refused() {
    let bench = Bench::new();
    let row = r#""theta_i_deg":1,"phi_i_deg":2,"theta_o_deg":3,"phi_o_deg":4"#;
    for [place, text] in table(
        r#"
        r.csv:1: key "value" | {ROW,"value":1,"value":2}
        r.csv:1: key "rows" | {"header":{"rows":7,"rows":1}}\n{ROW,"value":1}
        r.csv:1: key "header" | {"header":{},"header":{}}\n{ROW,"value":1}
        r.csv:2: key "phi_o_deg" | {ROW,"value":1}\n{ROW,"phi_o_deg":4,"value":1}"#,
    ) {
        bench.write("r.csv", text.replace("ROW", row));
        let told = format!("{place} is there twice; allowed: once");
        bench.refuses("reconstruct r.csv", 3, &told);
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
        bench.write("deep.toml", text);
        let told = "deep.toml … nested too deep; allowed: less than 80";
        bench.refuses("check deep.toml", 2, told);
    }
}

#[test]
fn a_name_that_no_file_can_have_is_refused() {
    let bench = Bench::new();
    for [key, table] in table(
        r#"
        material[1] | [[material]]\nkind = "ggx"
        sample_set[0] | [[sample_set]]\nkind = "grid"
        instrument[0] | [[instrument]]\npreset = "utia""#,
    ) {
        let named = |bytes: usize| {
            let name = format!("name = {:?}", "n".repeat(bytes));
            let hybrid = "[[parametrization]]\nkind = \"hybrid\"";
            bench.write("c.toml", format!("{CONFIG}{hybrid}\n{table}\n{name}\n"));
        };
        named(201);
        for command in ["check c.toml", "schedule c.toml -o out/"] {
            let told = format!("{key}.name = \"nnn … allowed is at most 200 bytes");
            let sentence = bench.refuses(command, 2, &told);
            assert!(sentence.len() < 300, "{sentence}");
        }
        assert!(!bench.path("out").exists());
        named(200);
        bench.good("schedule c.toml -o out/ --skip-unreachable");
        assert!(!bench.files("out").is_empty());
        fs::remove_dir_all(bench.path("out")).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn only_files_are_replaced_and_links_are_followed() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let bench = Bench::of(CONFIG);
    bench.good("schedule c.toml -o p.csv");
    bench.good("measure p.csv --config c.toml -o r.csv");
    let mut pipe = std::process::Command::new("mkfifo");
    let pipe = pipe.arg(bench.path("pipe.csv")).status();
    assert!(pipe.unwrap().success());
    fs::create_dir(bench.path("folder.csv")).unwrap();
    for command in [
        "schedule c.toml",
        "measure p.csv --config c.toml",
        "reconstruct r.csv --reconstruction nearest --format utia",
        "tabulate c.toml --format utia",
        "claims --format csv",
    ] {
        for to in ["pipe.csv --force", "pipe.csv", "folder.csv --force"] {
            // A schedule is written into a folder.
            if !(to.starts_with("folder") && command.starts_with("schedule")) {
                bench.refuses(format!("{command} -o {to}"), 2, "is no regular file");
            }
        }
        // What a link leads to is replaced whole.
        for name in ["file", "link.csv"] {
            let _ = fs::remove_file(bench.path(name));
        }
        bench.write("file", "old");
        symlink("file", bench.path("link.csv")).unwrap();
        bench.good(format!("{command} -o link.csv --force"));
        let kind = bench.path("link.csv").symlink_metadata().unwrap();
        assert!(kind.file_type().is_symlink(), "{command:?}");
        assert!(bench.read_bytes("file").len() > 100, "{command:?}");
    }
    let kind = bench.path("pipe.csv").symlink_metadata().unwrap();
    assert!(kind.file_type().is_fifo());
    assert!(bench.files(".").iter().all(|name| !name.ends_with(".part")));
}

#[cfg(unix)]
#[test]
fn a_text_from_stdin_has_an_end() {
    use std::process::Stdio;
    let bench = Bench::of(CONFIG);
    // What is no text is none from the first byte on.
    let from = |file: &str| {
        let mut command = bench.command("check /dev/stdin");
        let input = fs::File::open(bench.path(file)).unwrap();
        command.stdin(Stdio::from(input)).output().unwrap()
    };
    assert_eq!(from("c.toml").status.code(), Some(0));
    let endless = from("/dev/zero");
    assert_eq!(endless.status.code(), Some(2));
    let sentence = String::from_utf8(endless.stderr).unwrap();
    says(&sentence, "line 1 has a zero byte");
}
