//! Light through a surface.

use super::common::{says, table};
use super::{Bench, assert_same, results};
use gonio::experiment::Row;
use serde_json::Value;

/// A bench with a map of one wave along x, and of two along y.
fn map() -> Bench {
    let bench = Bench::new();
    let turn = std::f64::consts::TAU / 16.0;
    let height = |x: u8, y: u8| (turn * f64::from(x)).sin() + (2.0 * turn * f64::from(y)).cos();
    let row = |y: u8| (0..16).map(move |x| height(x, y).to_string());
    let rows = (0..16).map(|y| row(y).collect::<Vec<_>>().join(",") + "\n");
    bench.write("map.csv", rows.collect::<String>());
    bench
}

fn numbers(bench: &Bench, args: &str) -> Value {
    bench.json(format!("surface {args} --rays 500 --json"))
}

#[test]
fn examples_of_the_help_run() {
    let bench = map();
    let help = bench.good("surface --help");
    let lines = help.lines().map(str::trim);
    let examples: Vec<_> = lines.filter(|l| l.starts_with("gonio surface ")).collect();
    assert_eq!(examples.len(), 3, "{help}");
    for example in examples {
        let example = example
            .replace("map.exr", "map.csv")
            .replace("rms_slope", "size=64 --set correlation=8 --set rms_slope");
        let parts = " cells; heights: rms  … geometric optics  … masked … shadowed";
        bench.tells(format!("{} --rays 500", &example[6..]), parts);
    }
}

/// Light along the normal of mirrors at 45° leaves after two.
#[test]
fn json_has_every_number() {
    let bench = Bench::new();
    let grooves =
        "v-grooves --set facets.kind=mirror --set facets.fresnel.kind=none --elevation 0,60";
    let found = numbers(&bench, grooves);
    let light = found["light"].as_array().unwrap();
    assert_eq!(light.len(), 2);
    assert_eq!(light[0]["bounces"], serde_json::json!([0.0, 1.0, 0.0]));
    assert_eq!(found["surface"]["size"], serde_json::json!([16, 16]));
    // The same rays, on one thread and on two.
    let timeless = |threads: &str| {
        let args = format!("{grooves} --threads {threads}");
        let mut found = numbers(&bench, &args);
        for line in found["light"].as_array_mut().unwrap() {
            line.as_object_mut().unwrap().remove("seconds");
        }
        found
    };
    assert_eq!(timeless("1"), timeless("2"));
}

#[test]
fn a_map_has_a_pitch_and_is_told_to_have_edges() {
    let bench = map();
    let set = "height-map --set file=map.csv --set pitch_um=0.5";
    let run = format!("surface {set} --rays 500");
    let told = bench.ends(format!("{run} -v"), 0);
    says(&told, "gonio: surface height-map, reads map.csv\n");
    assert!(!told.contains("periodic"), "{told}");
    let found = numbers(&bench, set);
    assert_eq!(found["optics"]["wavelength"], 0.55 / 0.5);
    // Two sines of amplitude 2 cells.
    let rms = found["surface"]["rms_height"].as_f64().unwrap();
    assert!((rms - 2.0).abs() < 1e-6, "{rms}");
    // Twice the height of half the cells is twice the slope.
    let slope = |more: &str| {
        let found = numbers(&bench, &format!("{set} {more}"));
        found["surface"]["rms_slope"][0].as_f64().unwrap()
    };
    assert!((slope("--set height_um=3") / slope("") - 3.0).abs() < 1e-6);
    bench.does(&format!(
        "2 | {run} --pitch-um 2 | --pitch-um: 2: allowed is 0.5, the pitch_um of the surface
         0 | {run} --pitch-um 0.5"
    ));

    bench.write("map.csv", "0,1,2,3,4,5,6\n0,1,2,3,4,5,6\n");
    let told = bench.ends(run, 0);
    says(&told, "gonio: map.csv: not periodic: ");
    assert_eq!(told.lines().count(), 1, "{told}");
}

#[test]
fn what_is_wrong_is_told_in_a_sentence() {
    let bench = map();
    bench.write("text.csv", "1,2\n3,four\n");
    bench.write("empty.csv", "# nothing\n\n");
    for [code, args, part] in table(
        "2 | gausian | did you mean gaussian?
         2 | gaussian --set rms_slop=0.5 | did you mean rms_slope?
         2 | gaussian --set rms_slope=-1 | rms_slope = -1: allowed is a number in [0.000001, 10]
         2 | gaussian --set rms_slope | has no `=`
         2 | gaussian --set size=1 | size = 1: allowed is a whole number from 2 to 8192
         2 | gaussian --set size=4 | correlation = 12: allowed is a number in [1, 1], a quarter of size = 4
         2 | v-grooves --set size=3 | size = 3: allowed is an even number
         2 | height-map --set pitch_um=1 --set pitch_um=0 | file
         3 | height-map --set pitch_um=1 --set file= | \"\": cannot read this file:
         3 | height-map --set pitch_um=1 --set file=empty.csv | empty.csv: this map has 0 × 0 heights; allowed: 2 to 8192
         3 | height-map --set pitch_um=1 --set file=none.exr | none.exr: cannot read this file:
         3 | height-map --set pitch_um=1 --set file=. | .: cannot read this file: this is no regular file
         3 | height-map --set pitch_um=1 --set file=text.csv | text.csv: line 2: cell 2 is \"four\"; allowed: a finite number
         2 | woven --elevation 90 | '90' for '--elevation <DEG,…>': allowed: a number in [0, 89.9]
         2 | woven --azimuth 361 | '361' for '--azimuth <DEG>': allowed: a number
         2 | woven --rays 1.5 | '1.5' for '--rays <N>': allowed: a whole number from 2 to 1000000000000",
    ) {
        let [stdout, told] = bench.ended(&format!("surface {args}"), code.parse().unwrap());
        // In one line, but for the usage of an option.
        let is_usage = part.starts_with('\'');
        assert!(stdout.is_empty() && (is_usage || told.lines().count() == 1), "{args}: {told}");
        says(&told, part);
    }
}

/// A config with a micro-surface: its surface, and other keys of it.
fn micro(bench: &Bench, surface: &str, keys: &str) {
    let text = format!(
        "quantities = []\nbudgets = [40]\nparametrization = [{{ kind = \"hybrid\" }}]\nsample_set = [{{ kind = \"sobol\" }}]\n\
         reconstruction = [{{ kind = \"inverse-distance\" }}]\nmetrics = {{ pairs = 512, max_pairs = 512 }}\n[[material]]\n\
         name = \"facets\"\nkind = \"micro-surface\"\nsurface = {{ {surface} }}\nrays = 4096\npaths = 8\n{keys}\n"
    );
    bench.write("micro.toml", text);
}

const SMALL: &str = "kind = \"gaussian\", size = 64, correlation = 8";

#[test]
fn a_micro_surface_says_what_is_wrong() {
    let bench = map();
    for [surface, keys, parts] in table(
        r#"
        kind = "gravel" |  | gravel … gaussian
        SMALL | surfaces = 65 | surfaces = 65 … 1 to 64
        kind = "woven" | surfaces = 2 | surfaces = 2 … without a seed
        SMALL | half_angle_deg = 0.0 | half_angle_deg = 0 … 0.2
        SMALL | multiple_half_angle_deg = 30 | multiple_half_angle_deg = 30 … 20
        SMALL | bounces = "third" | bounces … later
        SMALL | facets = { kind = "material", brdf = { kind = "ward", alpha = [0.1, 0.3] } } | facets.brdf … isotropic"#,
    ) {
        micro(&bench, &surface.replace("SMALL", SMALL), keys);
        bench.refuses("check micro.toml", 2, parts);
    }
    let gone = "kind = \"height-map\", file = \"gone.csv\", pitch_um = 1.0";
    micro(&bench, gone, "");
    bench.refuses("check micro.toml", 3, "gone.csv");
}

/// A map that was measured is a material like any other; rows say nothing of threads.
#[test]
fn a_micro_surface_is_measured_and_reconstructed() {
    let bench = map();
    let surface = "kind = \"height-map\", file = \"map.csv\", pitch_um = 2.0";
    micro(
        &bench,
        surface,
        "facets = { kind = \"diffuse\", albedo = 0.5 }",
    );
    for threads in ["1", "2"] {
        bench.good(format!("run micro.toml --threads {threads} -o {threads}"));
    }
    assert_same(&results(&bench, "1"), &results(&bench, "2"));
    let rows = bench.rows("1");
    assert_eq!(rows.len(), 2);
    let is_near = |row: &Row| row.value("nrmse") < Some(1.0);
    assert!(rows.iter().all(is_near), "{rows:?}");
}

/// Mirrors of a few normals send light in a few directions: no pair has a value, and whoever checks or runs it is told.
#[test]
fn mirrors_of_grooves_have_no_value_at_a_pair() {
    let bench = Bench::new();
    micro(&bench, "kind = \"v-grooves\"", "");
    for (command, code) in [("check", 0), ("run", 5)] {
        let told = bench.ended(&format!("{command} micro.toml"), code).concat();
        says(&told, "no pair has a value");
    }
}
