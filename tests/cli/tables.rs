//! Readings of others, and what is still to be read.

use super::common::{Level, levels, says, table};
use super::{Bench, ONE_SCHEDULE};
use std::f64::consts::PI;
use std::fs;

/// A matte layer below a lobe at the mirror direction, 1/sr.
pub fn f_r(theta_i: f64, theta_o: f64, az_from_mirror: f64) -> f64 {
    let [i, o, a] = [theta_i, theta_o, az_from_mirror].map(f64::to_radians);
    let cos = i.cos() * o.cos() + i.sin() * o.sin() * a.cos();
    0.1 + 2.0 * (40.0 * (cos - 1.0)).exp()
}

/// Sheets at three incidences: a row of cells for each pose.
pub fn sheets(cells: impl Fn(f64, f64, f64) -> String) -> String {
    let mut text = String::new();
    for theta_i in [20.0, 40.0, 60.0] {
        for theta_o in (0..80).step_by(8) {
            for az in (0..360).step_by(15) {
                text += &(cells(theta_i, f64::from(theta_o), f64::from(az)) + "\n");
            }
        }
    }
    text
}

#[test]
fn a_laboratory_s_table_is_read_as_its_options_say() {
    let bench = Bench::new();
    let ours = sheets(|i, o, a| format!("{i},0,{o},{},{}", (a + 180.0) % 360.0, f_r(i, o, a)));
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";
    bench.write("ours.csv", head.to_owned() + &ours);
    // Percent of a white tile, azimuths from the mirror direction, decimal commas.
    let percent = 100.0 * std::f64::consts::PI;
    let lab = sheets(|i, o, a| {
        let row = format!("{i};{o};{a};{};0.1;on", percent * f_r(i, o, a));
        row.replace('.', ",")
    });
    let lab = "\u{feff}in;out;az;R;u;lamp\n".to_owned() + &lab;
    bench.write("lab.csv", &lab);
    // The command of the page.
    let page = include_str!("../../src/docs/formats.md");
    let line = page
        .lines()
        .find(|l| l.starts_with("gonio reconstruct lab.csv "))
        .unwrap();
    let command = line.strip_prefix("gonio ").unwrap();
    let truth = "--reconstruction nearest --symmetry isotropic,bilateral,reciprocal";
    let ours = format!("reconstruct ours.csv {truth} -o ours.bin");
    assert_eq!(bench.ends(ours, 0), "ours.bin\n");
    let of_lab = format!("{command} {truth} -o lab.bin");
    assert_eq!(bench.ends(&of_lab, 0), "lab.bin\n");
    let passed = "columns that were passed over: lamp\n";
    bench.tells(format!("{of_lab} --force"), passed);
    let tables = ["ours.bin", "lab.bin"].map(|name| bench.read_bytes(name));
    let numbers = tables.map(|bytes| {
        let cells = bytes.chunks_exact(8);
        cells
            .map(|c| f64::from_le_bytes(c.try_into().unwrap()))
            .collect::<Vec<_>>()
    });
    assert!(numbers[0].len() == 3 * 288 * 288 && numbers[0].iter().any(|v| *v > 1.0));
    for (a, b) in numbers[0].iter().zip(&numbers[1]) {
        assert!((a - b).abs() <= 1e-9 * a.abs(), "{a} {b}");
    }
    // Without its azimuths the peak is at the light, and the program says what that may be.
    let (before, azimuth) = command.split_once(" --azimuth ").unwrap();
    let after = azimuth.split_once(' ').map_or("", |(_, after)| after);
    let told = bench.ends(format!("{before} {after} {truth}"), 0);
    says(
        &told,
        "lab.csv: readings within 10° of the light have a mean of ",
    );
    says(&told, "if the sample is no retro-reflector");
    assert_eq!(told.lines().count(), 1, "{told}");
    // A file that was cut.
    let cut: String = lab.chars().take(lab.chars().count() - 8).collect();
    bench.write("lab.csv", cut);
    bench.refuses(command, 3, "--partial reads up to the cut");
    bench.tells(
        format!("{command} --partial"),
        "cut: 719 rows were read, line 721 is left out",
    );
    // What the options cannot mean.
    for [more, part] in table(
        "--columns value | column = value: allowed is e.g. theta_i=thetaIn
         --azimuth north | possible values: sample, light, mirror, propagation
         --quantity dsf | reflectance-factor, percent",
    ) {
        let line = format!("reconstruct ours.csv --cross-validation none {more}");
        says(&bench.ends(line, 2), part);
    }
}

#[test]
fn what_is_left_of_a_schedule_is_written() {
    let bench = Bench::new();
    let schedule = |more: &str| bench.ends(format!("schedule small.toml {ONE_SCHEDULE} {more}"), 0);
    let measure = |schedule: &str, readings: &str| {
        let of = "--config small.toml --material ggx-0.4";
        bench.good(format!("measure {schedule} -o {readings} {of}"));
    };
    let rows = |name: &str| -> Vec<String> {
        let text = bench.read(name);
        let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
        rows.map(String::from).collect()
    };
    for instrument in ["", "--instrument utia --skip-unreachable"] {
        let with = |more: &str| schedule(&format!("{instrument} --force {more}"));
        assert_eq!(with("-o all.csv"), "all.csv\n");
        measure("all.csv", "readings.csv");
        let all = rows("all.csv");
        // Broken off in the middle of a row.
        let text = bench.read("readings.csv");
        let start = text.find("\nindex,").unwrap();
        let half = start + (text.len() - start) / 3;
        bench.write("part.csv", &text[..half]);
        let done = text[..half].lines().filter(|l| !l.starts_with('#')).count() - 2;
        assert!((1..all.len()).contains(&done), "{done}");
        let told = with("--append part.csv --partial -o left.csv");
        says(&told, &format!("cut: {done} rows were read"));
        says(&told, &format!("gonio: {done} of "));
        let left = rows("left.csv");
        assert_eq!(left.len(), all.len() - done);
        let index = |row: &String| row.split(',').next().unwrap().to_owned();
        let mut numbers: Vec<String> = left.iter().map(index).collect();
        let mut expected: Vec<String> = all[done..].iter().map(index).collect();
        numbers.sort();
        expected.sort();
        assert_eq!(numbers, expected);
        // The rest is measured like any schedule, and then nothing is left.
        measure("left.csv", "rest.csv");
        let head = text.lines().find(|l| !l.starts_with('#')).unwrap();
        let mut both = vec![head.to_owned()];
        both.extend(rows("readings.csv").into_iter().take(done));
        both.extend(rows("rest.csv"));
        let columns = |row: &String| row.split(',').count();
        assert!(both.iter().all(|row| columns(row) == columns(&both[0])));
        bench.write("both.csv", both.join("\n") + "\n");
        fs::remove_file(bench.path("left.csv")).unwrap();
        let told = with("--append both.csv -o left.csv");
        says(&told, "left.csv: nothing is left, no file is written");
        assert!(!bench.path("left.csv").exists());
        let to_stdout = bench.good(format!(
            "schedule small.toml {ONE_SCHEDULE} {instrument} --append both.csv"
        ));
        assert!(to_stdout.is_empty());
        for name in ["readings.csv", "rest.csv"] {
            fs::remove_file(bench.path(name)).unwrap();
        }
    }
    // How near is near.
    bench.write(
        "off.csv",
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n10,0,20,0,1\n",
    );
    let told = schedule("--append off.csv -o left.csv");
    says(&told, "gonio: 0 of  … ; readings of no pose: 1");
    for more in ["--tolerance 0.1", "--quantity percent"] {
        let told = bench.ends(format!("schedule small.toml {more}"), 2);
        says(&told, "--append <READINGS>");
    }
    bench.ends("schedule small.toml --append off.csv --tolerance -1", 2);
}

levels! {
    what_gains_energy_is_not_written: "thorough: every way to fill cells without readings about them";
}

fn what_gains_energy_is_not_written(level: Level) {
    let bench = Bench::new();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";
    let text = |scale: f64| {
        let rows =
            sheets(|i, o, a| format!("{i},0,{o},{},{}", (a + 180.0) % 360.0, scale * f_r(i, o, a)));
        head.to_owned() + &rows
    };
    bench.write("good.csv", text(1.0));
    bench.write("bright.csv", text(10.0));
    let named = level.of("--reconstruction nearest", "");
    let run = |file: &str, more: &str| {
        let args = format!(
            "reconstruct {file} -o copy.bin --force --cross-validation none {named} {more}"
        );
        let output = bench.gonio(&args);
        let [out, err] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
        (output.status.code(), out, err)
    };
    let (code, out, err) = run("bright.csv", "");
    assert_eq!(code, Some(6), "{err}");
    says(&err, "the albedo is … --accept-energy");
    assert!(out.contains("albedo: ") && !bench.path("copy.bin").exists());
    let (code, _, err) = run("bright.csv", "--accept-energy");
    assert_eq!(code, Some(0), "{err}");
    let (code, out, err) = run("good.csv", "");
    assert_eq!(code, Some(0), "{err}");
    let largest = out
        .lines()
        .find_map(|l| l.strip_prefix("largest value: "))
        .unwrap();
    let largest: f64 = largest.trim_end_matches(" 1/sr").parse().unwrap();
    assert!((2.0..9.0).contains(&largest), "{out}");
    says(&out, "coverage of the table: ");

    if level == Level::Quick {
        return;
    }
    // Cells without readings about them are left out if asked.
    let run = |file: &str, more: &str| run(file, &format!("--format merl {more}"));
    run("good.csv", "");
    let cells = || {
        let bytes = bench.read_bytes("copy.bin");
        let values = bytes[12..].chunks_exact(8);
        values
            .map(|c| f64::from_le_bytes(c.try_into().unwrap()))
            .collect::<Vec<_>>()
    };
    let all = cells();
    let (code, _, err) = run("good.csv", "--fill none");
    assert_eq!(code, Some(0), "{err}");
    let some = cells();
    let without = |cells: &[f64]| cells.iter().filter(|c| **c < 0.0).count();
    assert!(without(&some) > without(&all) + all.len() / 100);
    for (some, all) in some.iter().zip(&all).filter(|(some, _)| **some >= 0.0) {
        assert_eq!(some, all);
    }
    run("good.csv", "--fill nearest");
    // The largest reading, in units of a MERL file's red.
    let red = 2.1 * 1500.0;
    assert!(cells().iter().take(all.len() / 3).all(|c| *c <= red * 4.0));
    assert_eq!(run("good.csv", "--fill some").0, Some(2));
}

#[test]
fn gains_at_grazing_views_and_vague_readings_are_told() {
    let bench = Bench::new();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,uncertainty\n";
    let table = |value: &dyn Fn(f64) -> f64, uncertainty: f64| {
        let mut text = head.to_owned();
        for theta_i in [0.0_f64, 30.0, 60.0, 85.0] {
            for theta_o in [0.0, 30.0, 60.0, 85.0] {
                for phi in [0, 90, 180] {
                    let f_r = value(theta_i.max(theta_o));
                    let u = uncertainty * f_r;
                    text += &format!("{theta_i},0,{theta_o},{phi},{f_r},{u}\n");
                }
            }
        }
        bench.write("lab.csv", text);
        let how = "--reconstruction nearest -o copy.bin";
        let output = bench.gonio(format!("reconstruct lab.csv {how}"));
        let [out, err] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
        let written = fs::remove_file(bench.path("copy.bin")).is_ok();
        assert_eq!(written, output.status.code() == Some(0));
        (output.status.code(), out, err)
    };
    let (code, _, err) = table(&|theta| if theta > 80.0 { 3.0 } else { 0.01 }, 0.0);
    assert_eq!(code, Some(0), "{err}");
    let warning = "gonio: the albedo is above 1 of grazing light: ";
    assert!(err.contains(warning) && err.contains(" at 85°"), "{err}");
    // An uncertainty above 100 % is no excuse for everything.
    let (code, out, err) = table(&|_| 3.0, 0.8);
    assert_eq!(code, Some(6), "{err}");
    says(&err, "an uncertainty of 160 % (k = 2)");
    says(&out, "albedo: 9.4248 ± 4.7e0 at 0°");
    assert_eq!(table(&|_| 0.1, 0.8).0, Some(0));
    // Holes are 0 or as what is nearest: of .1 1/sr up to 35° and .2 up to 50°, of which a little more is within the readings.
    let mut text = head.to_owned();
    for (theta_i, theta_o) in (0..90)
        .step_by(10)
        .flat_map(|i| (0..52).step_by(2).map(move |o| (i, o)))
    {
        for phi in (0..360).step_by(if theta_o == 0 { 360 } else { 10 }) {
            let f_r = if theta_o < 35 { 0.1 } else { 0.2 };
            text += &format!("{theta_i},0,{theta_o},{phi},{f_r},0\n");
        }
    }
    bench.write("half.csv", text);
    let how = "reconstruct half.csv --reconstruction nearest --symmetry isotropic --fill none -o half.bin";
    let out = bench.good(how);
    let line = out.lines().find(|l| l.starts_with("albedo: ")).unwrap();
    let before = |at: &str| -> f64 {
        let text = line.split(at).next().unwrap();
        text.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let share = before(" % of the hemisphere") / 100.0;
    let [held, filled] = [before(" ± "), before(" if the rest")];
    let sin2 = 35_f64.to_radians().sin().powi(2);
    assert!((0.55..0.75).contains(&share), "{line}");
    assert!(
        (filled - PI * (0.1 * sin2 + 0.2 * (1.0 - sin2))).abs() < 0.01,
        "{line}"
    );
    assert!(
        (held - PI * (0.1 * sin2 + 0.2 * (share - sin2))).abs() < 0.01,
        "{line}"
    );
    // And nobody reads 150 digits.
    let (code, out, _) = table(&|_| 1e100, 0.0);
    assert_eq!(code, Some(6));
    says(&out, "albedo: 3.1416e100 ± ");
}

#[test]
fn a_table_keeps_its_colours() {
    let bench = Bench::new();
    let lambert = "[[material]]\nkind = \"lambert\"\nalbedo = [0.8, 0.4, 0.2]\n";
    let config = super::SMALL.replace("[[material]]\nkind = \"lambert\"\n", lambert);
    bench.write("colour.toml", config);
    let of = "colour.toml --material lambert";
    let tabulate = |what: &str, file: &str| {
        bench.good(format!("tabulate {what} -o {file}"));
        bench.read_bytes(file)
    };
    let table = tabulate(of, "a.binary");
    assert!(table == tabulate(&format!("{of} --set channels=rgb"), "b.binary"));
    let copy = tabulate("a.binary", "c.binary");
    assert_eq!(copy.len(), table.len());
    let numbers = |bytes: &[u8]| -> Vec<f64> {
        let cells = bytes[12..].chunks_exact(8);
        cells
            .map(|c| f64::from_le_bytes(c.try_into().unwrap()))
            .collect()
    };
    for (copy, cell) in numbers(&copy).into_iter().zip(numbers(&table)) {
        assert!((copy - cell).abs() <= 1e-15 * cell.abs());
    }
    // Red and blue of a cell above the horizon, in 1/sr.
    let ends = |bytes: &[u8]| {
        let all = numbers(bytes);
        [all[0] / 1500.0, all[2 * all.len() / 3] * 1.66 / 1500.0]
    };
    let [red, blue] = ends(&table);
    assert!((red / blue - 4.0).abs() < 1e-12, "{red} {blue}");
    for what in ["a.binary", of] {
        let grey = "--set channels=luminance --force";
        let [red, blue] = ends(&tabulate(&format!("{what} {grey}"), "grey.binary"));
        assert!((red / blue - 1.0).abs() < 1e-12, "{red} {blue}");
    }
}

#[test]
fn readings_are_a_material_of_commands_and_of_runs() {
    let bench = Bench::new();
    let head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";
    let ours = sheets(|i, o, a| format!("{i},0,{o},{},{}", (a + 180.0) % 360.0, f_r(i, o, a)));
    bench.write("ours.csv", head.to_owned() + &ours);
    // A reconstruction is its own truth.
    let said = bench.good("reconstruct ours.csv --against ours.csv");
    let line = said.lines().rfind(|l| l.starts_with("nrmse ")).unwrap();
    let error: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!(error < 1e-12, "{said}");
    // What its readings are worth is what a moment of it is worth.
    let mean = |keys: &str| -> f64 {
        let small = "moments ours.csv --json --set moments.views=2 --set";
        let said = bench.good(format!(
            "{small} reconstruction={{kind=\"nearest\"}} {keys}"
        ));
        let rows: serde_json::Value = serde_json::from_str(&said).unwrap();
        rows[0]["energy"]
            .as_f64()
            .unwrap_or_else(|| panic!("{said}"))
    };
    let pi = std::f64::consts::PI;
    let factor = mean("") / mean("--set quantity=reflectance-factor");
    assert!((factor / pi - 1.0).abs() < 1e-3, "{factor}");
    bench.good("symmetry ours.csv --set reconstruction={kind=\"nearest\"}");
    let size = "--view-deg 20 --resolution 8 -o slices";
    bench.good(format!("slice ours.csv {size}"));

    let config = "quantities = []\nbudgets = [60]\n[[material]]\nkind = \"readings\"\nname = \"lab\"\nfile = \"ours.csv\"\n\
                  reconstruction = { kind = \"nearest\" }\n\
                  [[reconstruction]]\nkind = \"nearest\"\n[metrics]\npairs = 200\nmax_pairs = 1\n";
    bench.write("c.toml", config);
    bench.good("run c.toml -o run -q");
    let first = bench.rows("run");
    assert!(!first.is_empty() && first.iter().all(|r| r.material == "lab"));
    // It goes on wherever the file is, and not with another one of that name.
    fs::rename(bench.path("ours.csv"), bench.path("moved.csv")).unwrap();
    let moved = "run c.toml -q --set material.0.file=moved.csv -o";
    bench.good(format!("{moved} run"));
    assert_eq!(
        bench.rows("run"),
        first,
        "times included: nothing was made again"
    );
    let other = ours.replacen("0.1", "0.2", 1);
    assert_ne!(other, ours);
    bench.write("moved.csv", head.to_owned() + &other);
    bench.good(format!("{moved} other"));
    let keys = |rows: &[gonio::experiment::Row]| -> Vec<String> {
        rows.iter().map(|r| r.key.clone()).collect()
    };
    let others = keys(&bench.rows("other"));
    assert!(keys(&first).iter().all(|key| !others.contains(key)));

    bench.refuses(
        "moments nothing.csv",
        3,
        "nothing.csv: cannot read this file",
    );
    bench.refuses("moments moved.csv --set quantity=lux", 2, "percent");
    let scene = "--set=channels={wavelengths_nm=[450]}";
    bench.refuses(
        format!("run c.toml --set material.0.file=moved.csv {scene}"),
        2,
        "material[0].file = moved.csv",
    );
}

#[test]
fn a_table_says_how_far_off_it_is() {
    let bench = Bench::new();
    let config = |alpha: f64| {
        let text =
            format!("channels = \"luminance\"\n\n[[material]]\nkind = \"ggx\"\nalpha = {alpha}\n");
        bench.write("c.toml", text);
    };
    let nrmse = |out: &str| -> Vec<f64> {
        let lines = out.lines().filter_map(|l| l.split_once(": nrmse "));
        lines
            .map(|(_, rest)| rest.split(',').next().unwrap().parse().unwrap())
            .collect()
    };
    config(0.3);
    let told = bench.good("tabulate c.toml -o t.bsdf");
    let usual = fs::metadata(bench.path("t.bsdf")).unwrap().len();
    // Up to 80°, then up to 90°, where a grid ends and the model has no bound.
    let [cosine, lobe, beyond @ ..] = &nrmse(&told)[..] else {
        panic!("{told}");
    };
    assert!(*cosine > 0.0 && *cosine < 2e-3 && *lobe < 2e-3, "{told}");
    assert!(beyond.len() == 2 && beyond[0] > 2.0 * cosine, "{told}");
    // Half of what it is asks for the next size, and gets a quarter.
    let half = format!("{}", 0.5 * cosine.max(*lobe));
    let finer = [
        "tabulate",
        "c.toml",
        "-o",
        "t.bsdf",
        "--force",
        "--tolerance",
        &half,
    ];
    let told = bench.good(finer);
    assert_eq!(nrmse(&told).len(), 8, "{told}");
    assert!(fs::metadata(bench.path("t.bsdf")).unwrap().len() > 4 * usual);
    // A format of one size says that it is too far off.
    config(0.01);
    let merl = "tabulate c.toml -o t.binary --tolerance 1e-6 -q";
    bench.refuses(merl, 6, "asked: at most 0.000001");
    let none = bench.ends("tabulate c.toml -o u.bsdf --tolerance 0", 2);
    says(&none, "a number in (0, 1]");
}

#[test]
fn a_table_that_is_not_read_has_no_tolerance() {
    let bench = Bench::new();
    let text = "channels = \"luminance\"\n\n[[material]]\nkind = \"lambert\"\n";
    bench.write("c.toml", text);
    let mbsdf = "tabulate c.toml -o t.mbsdf";
    bench.good(mbsdf);
    let asked = format!("{mbsdf} --force --tolerance 0.1");
    bench.refuses(&asked, 2, "mdl are not read back … with merl, utia");
}

#[test]
fn readings_of_several_lights_are_files_of_a_folder() {
    let bench = Bench::new();
    let text = "channels = \"luminance\"\n\n[[material]]\nkind = \"lambert\"\nalbedo = 0.5\n";
    bench.write("c.toml", text);
    let poses =
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n30,0,20,180\n60,0,20,180\n30,0,40,90\n";
    bench.write("p.csv", poses);
    let measure = |output: &'static str, more: &str| {
        let all = format!("measure p.csv --config c.toml -o {output}");
        format!("{all} {more}")
    };
    bench.refuses(measure("r.pab", ""), 2, "2 directions of the light; allowed: one in a file of pab-opto, or -o FOLDER --format pab-opto");
    assert!(!bench.path("r.pab").exists());
    bench.good(measure("r", "--format pab-opto"));
    let first = bench.read("r/light-0001.pab");
    says(&first, "\n#intheta 30 … #datapoints_in_file\t2\n");
    assert!(
        bench
            .read("r/light-0002.pab")
            .contains("#datapoints_in_file\t1\n")
    );
    bench.tells("reconstruct r/light-0001.pab r/light-0002.pab --cross-validation none --reconstruction nearest", "3 poses … 3 readings");
    bench.refused(measure("r", "--format pab-opto"), 2);
    // What is written again are the lights of now.
    bench.write("p.csv", poses.replace("60,0,20,180\n", ""));
    bench.good(measure("r", "--format pab-opto --force"));
    assert!(!bench.path("r/light-0002.pab").exists());
    bench.good(measure("one.pab", ""));
    assert_eq!(bench.read("one.pab"), first);
    // Uncertainties have no place, which is told.
    let told = bench.ends(
        measure("u.astm", "--instrument cornell --skip-unreachable"),
        0,
    );
    says(
        &told,
        "astm has no place for uncertainties, flags and poses without a reading",
    );
}

/// One bad file of a folder costs its own jobs.
#[test]
fn a_bad_file_of_a_folder_spoils_itself_only() {
    let bench = Bench::new();
    fs::create_dir(bench.path("tables")).unwrap();
    bench.write("a.toml", "[[material]]\nkind = \"lambert\"\n");
    bench.good("tabulate a.toml -o tables/good.binary");
    let bytes = bench.read_bytes("tables/good.binary");
    bench.write("tables/bad.binary", &bytes[..1_000_000]);
    let config = "quantities = []\nbudgets = [60]\nmaterials_dir = \"tables\"\n\
                  [[sample_set]]\nkind = \"random\"\n[[reconstruction]]\nkind = \"nearest\"\n[metrics]\npairs = 500\n";
    bench.write("folder.toml", config);
    let why = "bad.binary: found 1000000 bytes, expected 34992012 for a 90×90×180 table";
    bench.refuses(
        "check folder.toml",
        3,
        &format!("{why}; its jobs fail, the others run"),
    );
    let told = bench.ends("run folder.toml -o run", 5);
    assert!(
        told.contains(why) && told.contains("failed; the rows of the others are in run"),
        "{told}"
    );
    let mut materials: Vec<String> = bench.rows("run").into_iter().map(|r| r.material).collect();
    materials.dedup();
    assert_eq!(materials, ["good"]);
    let failures = &bench.manifest("run")["failures"];
    assert!(
        failures.to_string().contains("found 1000000 bytes"),
        "{failures}"
    );
    // The rows that are there are those of a folder without the file.
    fs::remove_file(bench.path("tables/bad.binary")).unwrap();
    bench.good("run folder.toml -o alone");
    assert_eq!(
        bench.read("run/results.csv"),
        bench.read("alone/results.csv")
    );
    bench.write("tables/good.binary", &bytes[..9]);
    bench.refused("check folder.toml", 3);
}

#[test]
fn a_table_that_cannot_be_written_is_refused_at_once() {
    let bench = Bench::new();
    let brushed = "[[material]]\nkind = \"smith-multiple\"\nalpha = [0.3, 0.6]\npaths = 1000000\n";
    bench.write("brushed.toml", brushed);
    let files = ["a.binary", "a.xml", "a.zbsdf", "a.mbsdf"];
    for file in files {
        bench.refuses(format!("tabulate brushed.toml -o {file}"), 2, "isotropic");
        assert!(!bench.path(&format!("{file}.part")).exists());
    }
    bench.refuses(
        "tabulate brushed.toml -o none/a.bin",
        2,
        "none/a.bin: there is no folder none",
    );
}
