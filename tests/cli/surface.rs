//! Light through a surface.

use super::common::{says, table};
use super::{Bench, assert_same, results};
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
    serde_json::from_str(&bench.good(format!("surface {args} --rays 500 --json"))).unwrap()
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
        let said = bench.good(format!("{} --rays 500", &example[6..]));
        says(
            &said,
            " cells; heights: rms  … geometric optics  … masked … shadowed",
        );
    }
}

/// Light along the normal of mirrors at 45° leaves after two, and at 60° across them tan 15° is shadowed.
#[test]
fn json_has_every_number() {
    let bench = Bench::new();
    let grooves =
        "v-grooves --set facets.kind=mirror --set facets.fresnel.kind=none --elevation 0,60";
    let found = numbers(&bench, grooves);
    let keys =
        |value: &Value| -> Vec<String> { value.as_object().unwrap().keys().cloned().collect() };
    assert_eq!(keys(&found), ["surface", "optics", "light"]);
    assert_eq!(
        keys(&found["light"][0]),
        [
            "elevation_deg",
            "bounces",
            "errors",
            "error_of_sum",
            "absorbed",
            "masked",
            "shadowed",
            "lost",
            "segments",
            "seconds"
        ]
    );
    let light = found["light"].as_array().unwrap();
    assert_eq!(light.len(), 2);
    assert_eq!(
        (&light[0]["elevation_deg"], &light[0]["lost"]),
        (&0.0.into(), &0.into())
    );
    assert_eq!(light[0]["bounces"], serde_json::json!([0.0, 1.0, 0.0]));
    assert_eq!(
        (&light[0]["absorbed"], &light[0]["masked"]),
        (&0.0.into(), &1.0.into())
    );
    let shadowed = [0, 1].map(|i| light[i]["shadowed"].as_f64().unwrap());
    assert!(shadowed[0] < 1e-12 && (shadowed[1] - f64::to_radians(15.0).tan()).abs() < 1e-12);
    assert_eq!(found["surface"]["size"], serde_json::json!([16, 16]));
    let area = found["surface"]["area"].as_f64().unwrap();
    assert!((area - std::f64::consts::SQRT_2).abs() < 1e-12);

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
    let reads = "gonio: surface height-map, reads map.csv\n";
    assert!(
        told.starts_with(reads) && !told.contains("periodic"),
        "{told}"
    );
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
    bench.refuses(
        format!("{run} --pitch-um 2"),
        2,
        "--pitch-um: 2: allowed is 0.5, the pitch_um of the surface",
    );
    bench.good(format!("{run} --pitch-um 0.5"));

    bench.write("map.csv", "0,1,2,3,4,5,6\n0,1,2,3,4,5,6\n");
    let told = bench.ends(run, 0);
    assert!(
        told.starts_with("gonio: map.csv: not periodic: ") && told.lines().count() == 1,
        "{told}"
    );
}

#[test]
fn what_is_wrong_is_told_in_a_sentence() {
    let bench = map();
    bench.write("text.csv", "1,2\n3,four\n");
    bench.write("dot.csv", "1\n");
    bench.write("empty.csv", "# nothing\n\n");
    for [code, args, part] in table(
        "2 | gausian | did you mean gaussian?
         2 | gaussian --set rms_slop=0.5 | did you mean rms_slope?
         2 | gaussian --set rms_slope=-1 | rms_slope = -1: allowed is a number in [0.000001, 10]
         2 | gaussian --set rms_slope=[0.005,0.5] | rms_slope = [0.005, 0.5]: allowed is
         2 | gaussian --set rms_slope | has no `=`
         2 | gaussian --set size=1 | size = 1: allowed is a whole number from 2 to 8192
         2 | gaussian --set rms_slope=1e300 | rms_slope = 1e300: allowed is
         2 | gaussian --set size=4 | correlation = 12: allowed is a number in [1, 1], a quarter of size = 4
         2 | v-grooves --set size=3 | size = 3: allowed is an even number
         2 | v-grooves --set facets.kind=glass | allowed: mirror, diffuse
         2 | height-map --set file=map.csv | height-map: lacks the key pitch_um
         2 | height-map --set pitch_um=1 --set pitch_um=0 | file
         3 | height-map --set pitch_um=1 --set file= | \"\": cannot read this file: 
         3 | height-map --set pitch_um=1 --set file=empty.csv | empty.csv: this map has 0 × 0 heights; allowed: 2 to 8192
         3 | height-map --set pitch_um=1 --set file=none.exr | none.exr: cannot read this file: 
         3 | height-map --set pitch_um=1 --set file=. | .: cannot read this file: this is no regular file
         3 | height-map --set pitch_um=1 --set file=text.csv | text.csv: line 2: cell 2 is \"four\"; allowed: a finite number
         3 | height-map --set pitch_um=1 --set file=dot.csv | dot.csv: this map has 1 × 1 heights; allowed: 2 to 8192
         2 | woven --elevation 90 | '90' for '--elevation <DEG,…>': allowed: a number in [0, 89.9]
         2 | woven --elevation low | 'low' for '--elevation <DEG,…>': allowed: a number
         2 | woven --azimuth 361 | '361' for '--azimuth <DEG>': allowed: a number
         2 | woven --pitch-um 0 | '0' for '--pitch-um <UM>': allowed: a number
         2 | woven --rays 1.5 | '1.5' for '--rays <N>': allowed: a whole number from 2 to 1000000000000
         2 | woven --seed=-1 | '-1' for '--seed <N>': allowed: a whole number from 0 on",
    ) {
        let output = bench.gonio(format!("surface {args}"));
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), code.parse().ok(), "{args}: {told}");
        assert!(output.stdout.is_empty(), "{args}");
        says(&told, part);
    }
    // In one line.
    bench.refused("surface gausian", 2);
    bench.refused("surface gaussian --set rms_slope=-1", 2);
    bench.refused("surface height-map --set pitch_um=1 --set file=none.exr", 3);
}

/// A config with a micro-surface: its surface, and other keys of it.
fn micro(bench: &Bench, surface: &str, keys: &str) {
    let text = format!(
        "quantities = []\nbudgets = [40]\n\n[[material]]\nname = \"facets\"\nkind = \"micro-surface\"\nsurface = {{ {surface} }}\n\
         rays = 4096\npaths = 8\n{keys}\n\n[[parametrization]]\nkind = \"hybrid\"\n\n[[sample_set]]\nkind = \"sobol\"\n\n\
         [[reconstruction]]\nkind = \"inverse-distance\"\n\n[metrics]\npairs = 512\nmax_pairs = 512\n"
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
        kind = "gaussian", size = 1 |  | surface.size = 1 … 2 to 8192
        kind = "gaussian", slope = 1 |  | slope … rms_slope
        SMALL | surfaces = 65 | surfaces = 65 … 1 to 64
        kind = "woven" | surfaces = 2 | surfaces = 2 … without a seed
        SMALL | half_angle_deg = 0.0 | half_angle_deg = 0 … 0.2
        SMALL | multiple_half_angle_deg = 30 | multiple_half_angle_deg = 30 … 20
        SMALL | spot = 0.0 | spot = 0 … 1
        SMALL | bounces = "third" | bounces … later
        SMALL | relative_error = 0.0 | relative_error = 0 … 0.001
        SMALL | facets = { kind = "material", brdf = { kind = "ward", alpha = [0.1, 0.3] } } | facets.brdf … isotropic"#,
    ) {
        micro(&bench, &surface.replace("SMALL", SMALL), keys);
        bench.refuses("check micro.toml", 2, parts);
    }
    micro(
        &bench,
        "kind = \"height-map\", file = \"gone.csv\", pitch_um = 1.0",
        "",
    );
    bench.refuses("check micro.toml", 3, "gone.csv");
}

/// A map that was measured is a material like any other; rows say nothing of threads.
#[test]
fn a_micro_surface_is_measured_and_reconstructed() {
    let bench = map();
    micro(
        &bench,
        "kind = \"height-map\", file = \"map.csv\", pitch_um = 2.0",
        "facets = { kind = \"diffuse\", albedo = 0.5 }",
    );
    for threads in ["1", "2"] {
        bench.good(format!("run micro.toml --threads {threads} -o {threads}"));
    }
    assert_same(&results(&bench, "1"), &results(&bench, "2"));
    let rows = bench.rows("1");
    assert_eq!(rows.len(), 2);
    assert!(
        rows.iter().all(|row| row.value("nrmse") < Some(1.0)),
        "{rows:?}"
    );
}

/// Mirrors of a few normals send light in a few directions: no pair has a value, and whoever checks or runs it is told.
#[test]
fn mirrors_of_grooves_have_no_value_at_a_pair() {
    let bench = Bench::new();
    micro(&bench, "kind = \"v-grooves\"", "");
    for (command, code) in [("check", 0), ("run", 5)] {
        let said = bench.gonio(format!("{command} micro.toml"));
        assert_eq!(said.status.code(), Some(code));
        let told = [said.stdout, said.stderr].concat();
        let told = String::from_utf8(told).unwrap();
        says(&told, "no pair has a value");
    }
}
