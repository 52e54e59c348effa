//! Inputs: several that do not belong together, and outputs that are inputs.

use super::common::{says, table};
use super::{Bench, POSES, READINGS, send};
use std::thread;
use std::time::{Duration, Instant};

const LAMBERT: &str =
    "channels = \"luminance\"\n\n[[material]]\nname = \"NAME\"\nkind = \"lambert\"\n";

/// Readings of two materials, of one twice, and a table of one.
fn bench() -> Bench {
    let bench = Bench::new();
    for name in ["matte", "=matte"] {
        bench.write(&format!("{name}.toml"), LAMBERT.replace("NAME", name));
    }
    for (file, config, from) in [("a", "matte", 1), ("b", "matte", 2), ("c", "=matte", 3)] {
        let row = |k: usize| format!("{},0,{},{}\n", from + 3 * k, 5 * k, 30 * k);
        let rows: String = (0..12).map(row).collect();
        bench.write("poses.csv", POSES.to_owned() + &rows);
        let of = format!("--config {config}.toml -o {file}.csv");
        bench.good(format!("measure poses.csv {of}"));
    }
    bench.good("tabulate matte.toml -o matte.binary");
    bench
}

#[test]
fn readings_of_two_materials_are_not_taken_for_one() {
    let bench = bench();
    for command in [
        "reconstruct a.csv FILE",
        "convert a.csv FILE both.csv --force",
        "next a.csv FILE --batch 4 -o next.csv --force",
    ] {
        let sentence = "c.csv: these readings are of the material \"=matte\", those of a.csv of \"matte\"; allowed: readings of one, or --mixed";
        bench.refuses(command.replace("FILE", "c.csv"), 3, sentence);
        bench.good(command.replace("FILE", "c.csv") + " --mixed");
        bench.good(command.replace("FILE", "b.csv"));
    }
    assert!(bench.read("both.csv").contains("# material = \"matte\""));
    // Text that names a material in its rows.
    let pab = |name: &str, light: u32| {
        let rows = "#inphi 0\n10 0 .1\n20 0 .1\n";
        format!("#sample_name \"{name}\"\n#format: theta phi BRDF\n#intheta {light}\n{rows}")
    };
    bench.write("two.pab", pab("tile", 30) + &pab("wood", 40));
    let told = "two.pab:7: these readings are of the material \"wood\", those before of \"tile\"";
    bench.refuses("reconstruct two.pab", 3, told);
}

#[test]
fn an_output_is_no_input() {
    let bench = bench();
    #[cfg(unix)]
    std::os::unix::fs::symlink("a.csv", bench.path("link.csv")).unwrap();
    let before = ["a.csv", "matte.binary", "matte.toml"].map(|file| bench.read_bytes(file));
    let refused = "
        reconstruct a.csv -o a.csv --format merl
        reconstruct a.csv --checked a.csv
        reconstruct a.csv --checked link.csv
        reconstruct a.csv --uncertainty a.csv
        next a.csv --batch 4 -o a.csv
        next a.csv b.csv --batch 4 -o link.csv
        convert a.csv a.csv
        convert link.csv a.csv
        convert matte.binary matte.binary
        measure a.csv --config matte.toml -o a.csv
        tabulate matte.toml -o matte.toml --format merl
        picture matte.toml -o matte.toml
        moments matte.binary -o matte.binary
        train matte.toml -o matte.toml
        schedule matte.toml --budget 8 -o matte.toml --format csv";
    for [line] in table(refused) {
        bench.ends(format!("{line} --force"), 2);
    }
    let after = ["a.csv", "matte.binary", "matte.toml"].map(|file| bench.read_bytes(file));
    assert!(before == after);
    // A copy is replaced, and two outputs are not one.
    bench.does(
        "2 | convert a.csv a.csv --force | a.csv: this file is read and was to be replaced; choose another name
         0 | convert a.csv b.csv --force
         2 | reconstruct a.csv --checked x.csv --uncertainty x.csv | x.csv: two of the files to be written have this name",
    );
}

/// What stands where there is no reading is none, in every format of text; all others are as they are.
#[test]
fn marks_are_no_readings() {
    let bench = Bench::new();
    let row = |k: usize, value: &str| {
        format!("{},0,{},{},{value}\n", 10 + k % 7 * 8, 5 + k % 9 * 7, 8 * k)
    };
    let value = |k: usize| (0.1 + 0.002 * k as f64).to_string();
    let good: String = (0..40).map(|k| row(k, &value(k))).collect();
    let marked = |mark: &str| {
        let rows: String = (40..44).map(|k| row(k, mark)).collect();
        format!("{READINGS}{good}{rows}")
    };
    let convert = |name: &str, text: String| {
        bench.write(name, text);
        let said = bench.ends(format!("convert {name} out.csv --force"), 0);
        let rows = bench.lines("out.csv").into_iter();
        let value = |l: String| l.split(',').nth_back(2)?.parse().ok();
        (rows.filter_map(value).collect::<Vec<f64>>(), said)
    };
    let (clean, said) = convert("lab.csv", format!("{READINGS}{good}"));
    assert!(clean.len() == 40 && !said.contains("no reading"), "{said}");
    for mark in "-999 -9999 -99 9999 1e30 n.a. NaN - OVERFLOW #N/A".split(' ') {
        let (values, said) = convert("lab.csv", marked(mark));
        assert_eq!(values, clean, "{mark}");
        let number = mark.parse::<f64>().map(|number| number.to_string());
        let of = number.unwrap_or(mark.into());
        says(&said, &format!("taken for no reading: {of} in 4 cells"));
    }
    // -1 where values are noise of that size is read. Zeros among ordinary values and a plateau are doubted, and passed over if
    // that is wished.
    for [mark, doubt] in table(
        "-1 | below 0
         0 | 4 values are 0 and all others are 0.1 and more
         5.5 | the largest value, 5.5, is there 4 times, as if the sensor were saturated",
    ) {
        let (values, said) = convert("lab.csv", marked(mark));
        assert!(values.len() == 44 && said.contains(doubt), "{said}");
        if mark == "-1" {
            continue;
        }
        bench.good(format!(
            "convert lab.csv out.csv --force --no-reading {mark}"
        ));
        let out = bench.lines("out.csv");
        let lost = out.iter().filter(|l| l.contains("no-data"));
        assert_eq!(lost.count(), 4, "{out:?}");
    }
    // Of an uncertainty it is one that is not known.
    let unsure: String = good.lines().map(|l| format!("{l},.001\n")).collect();
    let unsure = unsure.replacen(",.001", ",-999", 3);
    let head = READINGS.trim_end();
    let (_, said) = convert("unsure.csv", format!("{head},uncertainty\n{unsure}"));
    says(&said, "taken for no reading: -999 in 3 cells");
    let pab = "#format: theta phi BRDF\n#intheta 30\n#inphi 0\n10 0 .1\n20 0 -999\n30 0 .2\n";
    let (values, said) = convert("tile.pab", pab.into());
    says(&said, "taken for no reading: -999 in 1 cell");
    assert_eq!(values.len(), 2, "{said}");
}

#[test]
fn names_are_no_formulas() {
    let bench = bench();
    let config = super::SMALL.replace("\"lambert\"", "\"lambert\", name = \"=cmd()\"");
    bench.write("small.toml", config);
    bench.good("run small.toml -o run");
    let table = bench.read("run/results.csv");
    let [named, quoted] = ["=cmd()", ",'=cmd(),"].map(|name| table.matches(name).count());
    assert!(named > 2 && quoted == named, "{table}");
}

#[test]
fn threads_that_cannot_be_are_refused() {
    let bench = Bench::new();
    let mut command = bench.command("check small.toml");
    let output = command.env("RAYON_NUM_THREADS", "100000").output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    let told = "RAYON_NUM_THREADS = 100000: allowed is a whole number from 1 to 1024";
    says(&said, told);
}

/// What cannot be read is lost alone, and counted: a row without an angle or a wavelength, a pose without one of the wavelengths, a
/// file of several.
#[test]
fn bad_parts_spoil_themselves_only() {
    let bench = bench();
    let head = READINGS.replace("value", "wavelength_nm,value");
    let row =
        |k: usize, nm: &str| format!("{},0,{},{},{nm},0.{}\n", 1 + k, 2 + k, 9 * k, 1 + k % 9);
    let good: String = (0..20).map(|k| row(k, "450") + &row(k, "550")).collect();
    let convert = |more: &str| {
        bench.write("nm.csv", format!("{head}{good}{more}"));
        let said = bench.ends("convert nm.csv nm.jsonl --force", 0);
        let lines = bench.read("nm.jsonl");
        let values = lines.lines().skip(1).map(|line| {
            let row: serde_json::Value = serde_json::from_str(line).unwrap();
            ["value_450nm", "value_550nm"].map(|name| row[name].as_f64())
        });
        (values.filter(|v| v[0].is_some()).collect::<Vec<_>>(), said)
    };
    let (clean, said) = convert("");
    assert!(clean.len() == 20 && !said.contains("passed over"), "{said}");
    let others = "1 row without an angle or a wavelength that others are at: passed over";
    let no_angle = row(30, "450").replace("31,0", "n.a.,0");
    let no_channel = "1 pose without the value of some channel: no reading";
    for (more, sentence) in [
        (row(30, "NaN"), others),
        (no_angle, "1 row without an angle or a wavelength"),
        (row(30, "551"), others),
        (row(30, "550"), no_channel),
    ] {
        let (values, said) = convert(&more);
        assert_eq!(values, clean, "{more}");
        says(&said, sentence);
        bench.ends("reconstruct nm.csv --strict", 3);
    }
    // One file of several.
    bench.write("cut.csv", "theta_i_deg,phi_i_deg\n1,");
    let run = "convert a.csv cut.csv b.csv c.jsonl --force";
    bench.does(&format!(
        "0 | {run} | cut.csv: … ; the file is left out
         3+ | {run} --strict
         3 | convert a.csv none.csv c.jsonl --force | none.csv"
    ));
    // An empty cell of a file by others is a reading that is lost.
    bench.write(
        "holes.csv",
        READINGS.to_owned() + "10,0,20,0,.1\n10,0,30,0,\n",
    );
    bench.good("convert holes.csv d.csv");
    let lost = bench.ends("convert holes.csv e.csv --strict", 3);
    says(&lost, "1 cell is empty: no reading … 1 reading is lost");
}

/// Every command ends at once, leaves nothing half-written and says by which signal.
#[test]
#[cfg(unix)]
fn signals_end_every_command() {
    let bench = bench();
    let poses = (0..1500).map(|k| format!("{},0,{},{},.1\n", 1 + k % 70, 1 + k % 67, k % 360));
    bench.write("many.csv", READINGS.to_owned() + &poses.collect::<String>());
    for [command, signal, code] in table(
        "tabulate matte.toml -o slow.xml --tolerance 1e-9 | TERM | 143
         tabulate matte.toml -o slow.bsdf --tolerance 1e-9 | INT | 130
         reconstruct many.csv | INT | 130
         reconstruct many.csv | TERM | 143",
    ) {
        let mut child = bench.started(command);
        thread::sleep(Duration::from_millis(250));
        let done = child.try_wait().unwrap();
        assert!(done.is_none(), "{command} was done before");
        send(signal, &child);
        let sent = Instant::now();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), code.parse().ok(), "{command}");
        let late = sent.elapsed();
        assert!(late < Duration::from_secs(1), "{command}: {late:?}");
        let files = bench.files("");
        let left = files.iter().find(|file| file.ends_with(".part"));
        assert_eq!(left, None, "{command}");
    }
}
