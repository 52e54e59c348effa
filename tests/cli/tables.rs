//! Readings of others, and what is still to be read.

use super::common::{Level, levels, product, says};
use super::{Bench, ONE_SCHEDULE, POSES, READINGS, words_after};
use std::collections::BTreeSet;
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
    for (theta_i, theta_o) in product([20.0, 40.0, 60.0], (0..80).step_by(8)) {
        for az in (0..360).step_by(15) {
            text += &(cells(theta_i, f64::from(theta_o), f64::from(az)) + "\n");
        }
    }
    text
}

/// A file of readings of the sheets, `scale` times as bright.
pub fn readings(scale: f64) -> String {
    let row = |i, o, a| format!("{i},0,{o},{},{}", (a + 180.0) % 360.0, scale * f_r(i, o, a));
    READINGS.to_owned() + &sheets(row)
}

/// The numbers of 64 bits in bytes.
fn numbers(bytes: &[u8]) -> Vec<f64> {
    let cells = bytes.as_chunks::<8>().0.iter();
    cells.map(|cell| f64::from_le_bytes(*cell)).collect()
}

#[test]
fn a_laboratory_s_table_is_read_as_its_options_say() {
    let bench = Bench::new();
    bench.write("ours.csv", readings(1.0));
    // Percent of a white tile, azimuths from the mirror direction, decimal commas.
    let lab = sheets(|i, o, a| {
        let row = format!("{i};{o};{a};{};0.1;on", 100.0 * PI * f_r(i, o, a));
        row.replace('.', ",")
    });
    let lab = "\u{feff}in;out;az;R;u;lamp\n".to_owned() + &lab;
    bench.write("lab.csv", &lab);
    // The command of the page.
    let page = include_str!("../../src/docs/formats.md");
    let command = page
        .lines()
        .find_map(|l| l.strip_prefix("gonio reconstruct lab.csv "));
    let command = format!("reconstruct lab.csv {}", command.unwrap());
    let truth = "--reconstruction nearest --symmetry isotropic,bilateral,reciprocal";
    let ours = format!("reconstruct ours.csv {truth} -o ours.bin");
    assert_eq!(bench.ends(ours, 0), "ours.bin\n");
    let of_lab = format!("{command} {truth} -o lab.bin");
    assert_eq!(bench.ends(&of_lab, 0), "lab.bin\n");
    let passed = "ignored columns: lamp\n";
    bench.tells(format!("{of_lab} --force"), passed);
    let [ours, of_lab] = ["ours.bin", "lab.bin"].map(|name| numbers(&bench.read_bytes(name)));
    assert!(ours.len() == 3 * 288 * 288 && ours.iter().any(|v| *v > 1.0));
    for (a, b) in ours.iter().zip(&of_lab) {
        assert!((a - b).abs() <= 1e-9 * a.abs(), "{a} {b}");
    }
    // A file that was cut.
    let cut: String = lab.chars().take(lab.chars().count() - 8).collect();
    bench.write("lab.csv", cut);
    let ours = "reconstruct ours.csv --cross-validation none";
    bench.does(&format!(
        "3 | {command} | --partial reads up to the cut
         0 | {command} --partial | cut: 719 rows were read, line 721 is left out
         2+ | {ours} --columns value | column = value: allowed is e.g. theta_i=thetaIn
         2+ | {ours} --azimuth north | possible values: sample, light, mirror, propagation
         2+ | {ours} --quantity dsf | reflectance-factor, percent"
    ));
}

#[test]
fn what_is_left_of_a_schedule_is_written() {
    let bench = Bench::new();
    let schedule = |more: &str| bench.ends(format!("schedule small.toml {ONE_SCHEDULE} {more}"), 0);
    let measure = |schedule: &str, readings: &str| {
        let of = "--config small.toml --material ggx-0.4";
        bench.good(format!("measure {schedule} -o {readings} --force {of}"));
    };
    let rows = |name: &str| bench.lines(name);
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
        let cut = format!("cut: {done} rows were read … gonio: {done} of ");
        says(&told, &cut);
        let left = rows("left.csv");
        assert_eq!(left.len(), all.len() - done);
        let indices = |rows: &[String]| -> BTreeSet<String> {
            let index = |row: &String| row.split(',').next().unwrap().to_owned();
            rows.iter().map(index).collect()
        };
        assert_eq!(indices(&left), indices(&all[done..]));
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
        let to_stdout = format!("schedule small.toml {ONE_SCHEDULE} {instrument}");
        let to_stdout = bench.good(format!("{to_stdout} --append both.csv"));
        assert!(to_stdout.is_empty());
    }
    // How near is near.
    bench.write("off.csv", READINGS.to_owned() + "10,0,20,0,1\n");
    let told = schedule("--append off.csv -o left.csv");
    says(&told, "gonio: 0 of  … ; readings of no pose: 1");
    bench.does(
        "2+ | schedule small.toml --tolerance 0.1 | --append <READINGS>
         2+ | schedule small.toml --quantity percent | --append <READINGS>
         2+ | schedule small.toml --append off.csv --tolerance -1",
    );
}

levels! {
    what_gains_energy_is_not_written: "thorough: every way to fill cells without readings about them";
}

fn what_gains_energy_is_not_written(level: Level) {
    let bench = Bench::new();
    bench.write("good.csv", readings(1.0));
    bench.write("bright.csv", readings(10.0));
    let named = level.of("--reconstruction nearest", "");
    let how = format!("-o copy.bin --force --cross-validation none {named}");
    let run = |file: &str, more: &str, code| {
        bench.ended(&format!("reconstruct {file} {how} {more}"), code)
    };
    let [out, err] = run("bright.csv", "", 6);
    says(&err, "the albedo is … --accept-energy");
    assert!(out.contains("albedo: ") && !bench.path("copy.bin").exists());
    run("bright.csv", "--accept-energy", 0);
    let [out, _] = run("good.csv", "", 0);
    let largest: f64 = words_after(&out, "largest value: ")[0].parse().unwrap();
    assert!((2.0..9.0).contains(&largest), "{out}");
    says(&out, "coverage of the table: ");

    if level == Level::Quick {
        return;
    }
    // Cells without readings about them are left out if asked.
    let run = |more: &str, code| run("good.csv", &format!("--format merl {more}"), code);
    run("", 0);
    let cells = || numbers(&bench.read_bytes("copy.bin")[12..]);
    let all = cells();
    run("--fill none", 0);
    let some = cells();
    let without = |cells: &[f64]| cells.iter().filter(|c| **c < 0.0).count();
    assert!(without(&some) > without(&all) + all.len() / 100);
    for (some, all) in some.iter().zip(&all).filter(|(some, _)| **some >= 0.0) {
        assert_eq!(some, all);
    }
    run("--fill nearest", 0);
    // The largest reading, in units of a MERL file's red.
    let red = 2.1 * 1500.0;
    assert!(cells().iter().take(all.len() / 3).all(|c| *c <= red * 4.0));
    run("--fill some", 2);
}

#[test]
fn gains_at_grazing_views_and_vague_readings_are_told() {
    let bench = Bench::new();
    let head = READINGS.replace("value", "value,uncertainty");
    let table = |value: &dyn Fn(f64) -> f64, uncertainty: f64, code| {
        let mut text = head.clone();
        let thetas = [0.0_f64, 30.0, 60.0, 85.0];
        for (theta_i, (theta_o, phi)) in product(thetas, product(thetas, [0, 90, 180])) {
            let f_r = value(theta_i.max(theta_o));
            let u = uncertainty * f_r;
            text += &format!("{theta_i},0,{theta_o},{phi},{f_r},{u}\n");
        }
        bench.write("lab.csv", text);
        let how = "--reconstruction nearest -o copy.bin";
        let said = bench.ended(&format!("reconstruct lab.csv {how}"), code);
        let written = fs::remove_file(bench.path("copy.bin")).is_ok();
        assert_eq!(written, code == 0);
        said
    };
    let [_, err] = table(&|theta| if theta > 80.0 { 3.0 } else { 0.01 }, 0.0, 0);
    let warning = "gonio: the albedo is above 1 of grazing light: ";
    assert!(err.contains(warning) && err.contains(" at 85°"), "{err}");
    // An uncertainty above 100 % is no excuse for everything.
    let [out, err] = table(&|_| 3.0, 0.8, 6);
    says(&err, "an uncertainty of 160 % (k = 2)");
    says(&out, "albedo: 9.4248 ± 4.7e0 at 0°");
    table(&|_| 0.1, 0.8, 0);
    // Holes are 0 or as what is nearest: of .1 1/sr up to 35° and .2 up to 50°, of which a little more is within the readings.
    let mut text = head.clone();
    for (i, k) in (0..9 * 26).map(|n| (n / 26, n % 26)) {
        let (theta_i, theta_o) = (10 * i, 2 * k);
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
    for (found, outer) in [(filled, 1.0), (held, share)] {
        let expected = PI * (0.1 * sin2 + 0.2 * (outer - sin2));
        assert!((found - expected).abs() < 0.01, "{line}");
    }
    // No number has 150 digits.
    let [out, _] = table(&|_| 1e100, 0.0, 6);
    says(&out, "albedo: 3.1416e100 ± ");
}

#[test]
fn a_table_keeps_its_colours() {
    let bench = Bench::new();
    let coloured = "kind = \"lambert\", albedo = [0.8, 0.4, 0.2]";
    let config = super::SMALL.replace("kind = \"lambert\"", coloured);
    bench.write("colour.toml", config);
    let of = "colour.toml --material lambert";
    let tabulate = |what: &str, file: &str| {
        bench.good(format!("tabulate {what} -o {file}"));
        bench.read_bytes(file)
    };
    let table = tabulate(of, "a.binary");
    // Red and blue of a cell above the horizon, in 1/sr.
    let ends = |bytes: &[u8]| {
        let all = numbers(&bytes[12..]);
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
fn a_table_says_how_far_off_it_is() {
    let bench = Bench::new();
    let config = |alpha: f64| {
        let text = format!("material = [{{ kind = \"ggx\", alpha = {alpha} }}]\n");
        bench.write("c.toml", text + "channels = \"luminance\"\n");
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
    let again = format!("tabulate c.toml -o t.bsdf --force --tolerance {half}");
    let told = bench.good(again);
    assert_eq!(nrmse(&told).len(), 8, "{told}");
    assert!(fs::metadata(bench.path("t.bsdf")).unwrap().len() > 4 * usual);
    // A format of one size says that it is too far off.
    config(0.01);
    bench.does(
        "6 | tabulate c.toml -o t.binary --tolerance 1e-6 -q | asked: at most 0.000001
         2+ | tabulate c.toml -o u.bsdf --tolerance 0 | a number in (0, 1]
         0 | tabulate c.toml -o t.mbsdf
         2 | tabulate c.toml -o t.mbsdf --force --tolerance 0.1 | mdl are not read back … with merl, utia",
    );
}

#[test]
fn readings_of_several_lights_are_files_of_a_folder() {
    let bench = Bench::new();
    let text = "channels = \"luminance\"\nmaterial = [{ kind = \"lambert\", albedo = 0.5 }]\n";
    bench.write("c.toml", text);
    let poses = format!("{POSES}30,0,20,180\n60,0,20,180\n30,0,40,90\n");
    bench.write("p.csv", &poses);
    let measure = "measure p.csv --config c.toml -o";
    let lights = "2 directions of the light; allowed: one in a file of pab-opto, or -o FOLDER --format pab-opto";
    bench.refuses(format!("{measure} r.pab"), 2, lights);
    assert!(!bench.path("r.pab").exists());
    bench.good(format!("{measure} r --format pab-opto"));
    let first = bench.read("r/light-0001.pab");
    says(&first, "\n#intheta 30 … #datapoints_in_file\t2\n");
    says(&bench.read("r/light-0002.pab"), "#datapoints_in_file\t1\n");
    // What is written again are the lights of now.
    let both = "r/light-0001.pab r/light-0002.pab --cross-validation none --reconstruction nearest";
    bench.does(&format!(
        "0 | reconstruct {both} | 3 poses … 3 readings
         2 | {measure} r --format pab-opto"
    ));
    bench.write("p.csv", poses.replace("60,0,20,180\n", ""));
    // A format without a column for uncertainties: a warning.
    let told = "astm has no place for uncertainties, flags and poses without a reading";
    bench.does(&format!(
        "0 | {measure} r --format pab-opto --force
         0 | {measure} one.pab
         0 | {measure} u.astm --instrument cornell --skip-unreachable | {told}"
    ));
    assert!(!bench.path("r/light-0002.pab").exists());
    assert_eq!(bench.read("one.pab"), first);
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
    let config = "quantities = []\nbudgets = [60]\nmaterials_dir = \"tables\"\nmetrics = { pairs = 500 }\n\
                  sample_set = [{ kind = \"random\" }]\nreconstruction = [{ kind = \"nearest\" }]\n";
    bench.write("folder.toml", config);
    let why = "bad.binary: found 1000000 bytes, expected 34992012 for a 90×90×180 table";
    bench.does(&format!(
        "3 | check folder.toml | {why}; its jobs fail, the others run
         5+ | run folder.toml -o run | {why} … failed; the rows of the others are in run"
    ));
    let rows = bench.rows("run");
    assert!(rows.iter().all(|row| row.material == "good"));
    // The rows that are there are those of a folder without the file.
    fs::remove_file(bench.path("tables/bad.binary")).unwrap();
    bench.good("run folder.toml -o alone");
    let [run, alone] = ["run", "alone"].map(|run| bench.read(&format!("{run}/results.csv")));
    assert_eq!(run, alone);
    bench.write("tables/good.binary", &bytes[..9]);
    bench.refused("check folder.toml", 3);
}

#[test]
fn a_table_that_cannot_be_written_is_refused_at_once() {
    let bench = Bench::new();
    let brushed = "{ kind = \"smith-multiple\", alpha = [0.3, 0.6], paths = 1000000 }";
    bench.write("brushed.toml", format!("material = [{brushed}]\n"));
    for file in ["a.binary", "a.xml", "a.zbsdf", "a.mbsdf"] {
        bench.refuses(format!("tabulate brushed.toml -o {file}"), 2, "isotropic");
        assert!(!bench.path(&format!("{file}.part")).exists());
    }
    bench.does("2 | tabulate brushed.toml -o none/a.bin | none/a.bin: there is no folder none");
}
