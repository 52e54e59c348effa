//! Experiments by wavelength, from a config to files and back.

use super::Bench;
use super::common::says;
use super::files::errors;

const CONFIG: &str = r#"
channels = { wavelengths_nm = [450, 550.5, 1064] }
budgets = [100]
measures = ["cosine"]

[[material]]
kind = "ggx"
alpha = 0.4

[[material]]
kind = "lambert"
albedo = { nm = [400, 700, 1100], values = [0.2, 0.5, 0.9] }

[[parametrization]]
kind = "half-difference"

[[reconstruction]]
kind = "multilinear"

[metrics]
pairs = 500
max_pairs = 1
"#;

#[test]
fn a_run_by_wavelength_is_that_of_the_mean() {
    let bench = Bench::new();
    bench.write("s.toml", CONFIG);
    let grey = CONFIG.replace("{ wavelengths_nm = [450, 550.5, 1064] }", "\"luminance\"");
    let grey = grey.replace("{ nm = [400, 700, 1100], values = [0.2, 0.5, 0.9] }", "0.5");
    bench.write("l.toml", grey);
    bench.good("run s.toml -o s -q");
    bench.good("run l.toml -o l -q");
    let (spectral, grey) = (bench.rows("s"), bench.rows("l"));
    assert_eq!((spectral.len(), grey.len()), (2, 2));
    for (a, b) in spectral.iter().zip(&grey) {
        assert_ne!(a.key, b.key);
        let [a, b] = [a, b].map(|row| row.value("nrmse").unwrap());
        assert!((a - b).abs() < 1e-12 + 1e-9 * b, "{a} {b}");
    }
    // The config in the results says the wavelengths, and runs again.
    bench.good("check s/config.toml");
    assert!(bench.read("s/config.toml").contains("wavelengths_nm"));
}

#[test]
fn readings_by_wavelength_go_through_files() {
    let bench = Bench::new();
    bench.write("s.toml", CONFIG);
    let of = "--material lambert";
    bench.good(format!("schedule s.toml -o p.csv {of}"));
    for (file, header) in [
        (
            "r.csv",
            "# channels = {\"wavelengths_nm\":[450.0,550.5,1064.0]}",
        ),
        (
            "r.jsonl",
            "\"channels\":{\"wavelengths_nm\":[450.0,550.5,1064.0]}",
        ),
    ] {
        let measure = format!("measure p.csv --config s.toml -o {file}");
        bench.good(format!("{measure} {of}"));
        let text = bench.read(file);
        says(&text, header);
        assert!(text.contains("value_550.5nm") && !text.contains("value_r"));
        let how = "--reconstruction multilinear --against s.toml";
        let said = bench.good(format!("reconstruct {file} {how} {of}"));
        assert!(errors(&said, "cosine")[0] < 1e-12, "{said}");
        let table = "--reconstruction multilinear -o t.binary";
        bench.refuses(
            format!("reconstruct {file} {table}"),
            2,
            "R, G, B and no wavelengths",
        );
    }
    let tabulate = "tabulate s.toml -o t.binary";
    bench.refuses(format!("{tabulate} {of}"), 2, "R, G, B and no wavelengths");
    assert!(!bench.path("t.binary").exists());
}

#[test]
fn a_material_in_colour_has_no_wavelengths() {
    let bench = Bench::new();
    let colour = CONFIG.replace(
        "{ nm = [400, 700, 1100], values = [0.2, 0.5, 0.9] }",
        "[0.1, 0.2, 0.3]",
    );
    bench.write("c.toml", colour);
    let sentence = bench.refused("check c.toml", 2);
    let want = "material[1].albedo = [0.1, 0.2, 0.3]: allowed is a number or { nm, values }";
    says(&sentence, want);
    let short = CONFIG.replace("[400, 700, 1100]", "[400, 700, 1000]");
    bench.write("c.toml", short);
    bench.refuses("check c.toml", 2, "material[1].albedo … 1064 nm");
    for (bad, why) in [
        ("[550, 450]", "each above the one before"),
        ("[]", "1 to 512 of them"),
    ] {
        let set = format!("channels={{ wavelengths_nm = {bad} }}");
        bench.write("s.toml", CONFIG);
        bench.refuses(format!("check s.toml --set '{set}'"), 2, why);
    }
}
