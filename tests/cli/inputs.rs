//! Inputs: several that do not belong together, and outputs that are inputs.

use super::Bench;
use super::common::{says, table};
use std::fs;
use std::process::{Command, Stdio};
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
    let poses = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n";
    let rows = |from: usize| -> String {
        (0..12)
            .map(|k| format!("{},0,{},{}\n", from + 3 * k, 5 * k, 30 * k))
            .collect()
    };
    for (file, config, from) in [("a", "matte", 1), ("b", "matte", 2), ("c", "=matte", 3)] {
        bench.write("poses.csv", poses.to_owned() + &rows(from));
        let config = format!("{config}.toml");
        let file = format!("{file}.csv");
        bench.good(format!(
            "measure poses.csv --config {config} -o {file} --force"
        ));
    }
    bench.good("tabulate matte.toml -o matte.binary");
    bench
}

#[test]
fn readings_of_two_materials_are_not_taken_for_one() {
    let bench = bench();
    for (command, output) in [
        ("reconstruct a.csv FILE", None),
        ("convert a.csv FILE both.csv", Some("both.csv")),
        ("next a.csv FILE --batch 4 -o next.csv", Some("next.csv")),
    ] {
        let run = |file: &str, more: &str| command.replace("FILE", file) + more;
        let run_c = run("c.csv", "");
        let told = bench.refused(&run_c, 3);
        let sentence = "c.csv: these readings are of the material \"=matte\", those of a.csv of \"matte\"; allowed: readings of one, or --mixed";
        says(&told, sentence);
        for (file, more) in [("c.csv", " --mixed"), ("b.csv", "")] {
            output.map(|file| fs::remove_file(bench.path(file)));
            bench.good(run(file, more));
        }
    }
    assert!(bench.read("both.csv").contains("# material = \"matte\""));
    // Text that names a material in its rows.
    let pab = |name: &str| {
        format!(
            "#sample_name \"{name}\"\n#format: theta phi BRDF\n#intheta 30\n#inphi 0\n10 0 .1\n20 0 .1\n"
        )
    };
    bench.write("two.pab", pab("tile") + &pab("wood").replace("30", "40"));
    bench.refuses(
        "reconstruct two.pab",
        3,
        "two.pab:7: these readings are of the material \"wood\", those before of \"tile\"",
    );
}

#[test]
fn an_output_is_no_input() {
    let bench = bench();
    #[cfg(unix)]
    std::os::unix::fs::symlink("a.csv", bench.path("link.csv")).unwrap();
    let before = ["a.csv", "matte.binary", "matte.toml"].map(|file| bench.read_bytes(file));
    for args in [
        "reconstruct a.csv -o a.csv --format merl",
        "reconstruct a.csv --checked a.csv",
        "reconstruct a.csv --checked link.csv",
        "reconstruct a.csv --uncertainty a.csv",
        "next a.csv --batch 4 -o a.csv",
        "next a.csv b.csv --batch 4 -o link.csv",
        "convert a.csv a.csv",
        "convert link.csv a.csv",
        "convert matte.binary matte.binary",
        "measure a.csv --config matte.toml -o a.csv",
        "tabulate matte.toml -o matte.toml --format merl",
        "picture matte.toml -o matte.toml",
        "moments matte.binary -o matte.binary",
        "train matte.toml -o matte.toml",
        "schedule matte.toml --budget 8 -o matte.toml --format csv",
    ] {
        let mut words: Vec<&str> = args.split(' ').collect();
        words.push("--force");
        let output = bench.gonio(&words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{args}: {said}");
    }
    assert_eq!(
        before,
        ["a.csv", "matte.binary", "matte.toml"].map(|file| bench.read_bytes(file))
    );
    bench.refuses(
        "convert a.csv a.csv --force",
        2,
        "a.csv: this file is read and was to be replaced; choose another name",
    );
    // A copy is replaced, and two outputs are not one.
    bench.good("convert a.csv b.csv --force");
    bench.refuses(
        "reconstruct a.csv --checked x.csv --uncertainty x.csv",
        2,
        "x.csv: two of the files to be written have this name",
    );
}

/// What stands where there is no reading is none, in every format of text; all others are as they are.
#[test]
fn marks_are_no_readings() {
    let bench = Bench::new();
    let row = |k: usize, value: &str| {
        format!("{},0,{},{},{value}\n", 10 + k % 7 * 8, 5 + k % 9 * 7, 8 * k)
    };
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value";
    let good: String = (0..40)
        .map(|k| row(k, &format!("{}", 0.1 + 0.002 * k as f64)))
        .collect();
    let marked = |mark: &str| (40..44).map(|k| row(k, mark)).collect::<String>();
    let convert = |name: &str, text: String| {
        bench.write(name, text);
        let said = bench.ends(format!("convert {name} out.csv --force"), 0);
        let out = bench.read("out.csv");
        let rows = out.lines().filter(|l| !l.starts_with(['#', 'i']));
        let values: Vec<f64> = rows
            .filter_map(|l| l.split(',').nth_back(2)?.parse().ok())
            .collect();
        (values, said)
    };
    let (clean, said) = convert("lab.csv", format!("{head}\n{good}"));
    assert!(clean.len() == 40 && !said.contains("no reading"), "{said}");
    for mark in [
        "-999", "-9999", "-99", "9999", "1e30", "n.a.", "NaN", "-", "OVERFLOW", "#N/A",
    ] {
        let (values, said) = convert("lab.csv", format!("{head}\n{good}{}", marked(mark)));
        assert_eq!(values, clean, "{mark}");
        let of = mark
            .parse::<f64>()
            .map_or(mark.to_owned(), |number| number.to_string());
        says(&said, &format!("taken for no reading: {of} in 4 cells"));
    }
    // -1 where values are noise of that size is read.
    let (values, said) = convert("lab.csv", format!("{head}\n{good}{}", marked("-1")));
    assert!(values.len() == 44 && said.contains("below 0"), "{said}");
    // Zeros among ordinary values and a plateau are doubted, and passed over if that is wished.
    for (mark, doubt) in [
        ("0", "4 values are 0 and all others are 0.1 and more"),
        (
            "5.5",
            "the largest value, 5.5, is there 4 times, as if the sensor were saturated",
        ),
    ] {
        let text = format!("{head}\n{good}{}", marked(mark));
        let (values, said) = convert("lab.csv", text);
        assert!(values.len() == 44 && said.contains(doubt), "{said}");
        bench.good(format!(
            "convert lab.csv out.csv --force --no-reading {mark}"
        ));
        let out = bench.read("out.csv");
        assert_eq!(
            out.lines().filter(|l| l.contains("no-data")).count(),
            4,
            "{out}"
        );
    }
    // Of an uncertainty it is one that is not known.
    let unsure: String = good.lines().map(|l| format!("{l},.001\n")).collect();
    let unsure = unsure.replacen(",.001", ",-999", 3);
    let (_, said) = convert("unsure.csv", format!("{head},uncertainty\n{unsure}"));
    says(&said, "taken for no reading: -999 in 3 cells");
    // Of one channel: that row alone is lost.
    let rgb = good
        .lines()
        .map(|l| format!("{l},.2,.3\n"))
        .collect::<String>();
    let rgb = format!("{head}_r,value_g,value_b\n{rgb}70,0,10,5,.1,-999,.3\n");
    let (values, said) = convert("rgb.csv", rgb);
    assert!(
        values.len() == 40 && said.contains("1 pose without the value of some channel: no reading"),
        "{said}"
    );
    let pab = "#format: theta phi BRDF\n#intheta 30\n#inphi 0\n10 0 .1\n20 0 -999\n30 0 .2\n";
    let (values, said) = convert("tile.pab", pab.into());
    assert!(
        values.len() == 2 && said.contains("taken for no reading: -999 in 1 cell"),
        "{said}"
    );
    bench.ends("reconstruct tile.pab --strict", 3);
}

#[test]
fn names_are_no_formulas() {
    let bench = bench();
    let config = super::SMALL.replace(
        "kind = \"lambert\"\n",
        "kind = \"lambert\"\nname = \"=cmd()\"\n",
    );
    bench.write("small.toml", config);
    bench.good("run small.toml -o run");
    let table = bench.read("run/results.csv");
    let mut named = table.lines().filter(|line| line.contains("=cmd()"));
    assert!(
        named.clone().count() > 2 && named.all(|line| line.contains(",'=cmd(),")),
        "{table}"
    );
}

#[test]
fn threads_that_cannot_be_are_refused() {
    let bench = Bench::new();
    let mut command = bench.command("check small.toml");
    let output = command.env("RAYON_NUM_THREADS", "100000").output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    says(
        &said,
        "RAYON_NUM_THREADS = 100000: allowed is a whole number from 1 to 1024",
    );
}

/// What cannot be read is lost alone, and counted: a row without an angle or a wavelength, a pose without one of the wavelengths, a
/// file of several.
#[test]
fn bad_parts_spoil_themselves_only() {
    let bench = bench();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,wavelength_nm,value\n";
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
    for (more, sentence) in [
        (
            row(30, "NaN"),
            "1 row without an angle or a wavelength that others are at: passed over",
        ),
        (
            row(30, "450").replace("31,0", "n.a.,0"),
            "1 row without an angle or a wavelength",
        ),
        (
            row(30, "551"),
            "1 row without an angle or a wavelength that others are at",
        ),
        (
            row(30, "550"),
            "1 pose without the value of some channel: no reading",
        ),
    ] {
        let (values, said) = convert(&more);
        assert_eq!(values, clean, "{more}");
        says(&said, sentence);
        bench.ends("reconstruct nm.csv --strict", 3);
    }
    // One file of several.
    bench.write("cut.csv", "theta_i_deg,phi_i_deg\n1,");
    let run = "convert a.csv cut.csv b.csv c.jsonl --force";
    let said = bench.ends(run, 0);
    says(&said, "cut.csv: … ; the file is left out");
    bench.ends(format!("{run} --strict"), 3);
    bench.refuses("convert a.csv none.csv c.jsonl --force", 3, "none.csv");
}

/// Every command ends at once, leaves nothing half-written and says by which signal.
#[test]
#[cfg(unix)]
fn signals_end_every_command() {
    let bench = bench();
    let poses = (0..1500).map(|k| format!("{},0,{},{}\n", 1 + k % 70, 1 + k % 67, k % 360));
    let poses = poses.collect::<String>();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";
    bench.write("many.csv", head.to_owned() + &poses.replace('\n', ",.1\n"));
    let slow = "quantities = [\"moments\"]\nbudgets = [3000]\n[[material]]\nkind = \"ggx\"\nalpha = 0.3\n\
                [[parametrization]]\nkind = \"spherical\"\n[[sample_set]]\nkind = \"random\"\n\
                [[reconstruction]]\nkind = \"thin-plate\"\n[pictures]\ndraw = false\n";
    bench.write("slow.toml", slow);
    for [command, signal, code] in table(
        "
        tabulate matte.toml -o slow.xml --tolerance 1e-9 | TERM | 143
        tabulate matte.toml -o slow.bsdf --tolerance 1e-9 | INT | 130
        reconstruct many.csv | INT | 130
        reconstruct many.csv | TERM | 143
        run slow.toml -o slow | INT | 130",
    ) {
        let code = code.parse().unwrap();
        let words: Vec<&str> = command.split(' ').collect();
        let mut child = bench
            .command(&words)
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        thread::sleep(Duration::from_millis(250));
        assert!(
            child.try_wait().unwrap().is_none(),
            "{command} was done before"
        );
        let kill = Command::new("kill")
            .args(["-s", signal, &child.id().to_string()])
            .status();
        assert!(kill.unwrap().success());
        let sent = Instant::now();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(code), "{command}");
        assert!(
            sent.elapsed() < Duration::from_secs(1),
            "{command}: {:?}",
            sent.elapsed()
        );
        let left = bench
            .files("")
            .into_iter()
            .find(|file| file.ends_with(".part"));
        assert_eq!(left, None, "{command}");
    }
}
