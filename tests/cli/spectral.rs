//! Experiments by wavelength, from a config to files and back.

use super::Bench;
use super::common::says;
use super::files::errors;

const CONFIG: &str = r#"
channels = { wavelengths_nm = [450, 550.5, 1064] }
budgets = [100]
measures = ["cosine"]
material = [
  { kind = "ggx", alpha = 0.4 },
  { kind = "lambert", albedo = { nm = [400, 700, 1100], values = [0.2, 0.5, 0.9] } },
]
parametrization = [{ kind = "half-difference" }]
reconstruction = [{ kind = "multilinear" }]
metrics = { pairs = 500, max_pairs = 1 }
"#;

const NO_WAVELENGTHS: &str = "R, G, B and no wavelengths";

#[test]
fn a_run_by_wavelength_is_that_of_the_mean() {
    let bench = Bench::new();
    bench.write("s.toml", CONFIG);
    let grey = CONFIG.replace("{ wavelengths_nm = [450, 550.5, 1064] }", "\"luminance\"");
    let grey = grey.replace("{ nm = [400, 700, 1100], values = [0.2, 0.5, 0.9] }", "0.5");
    bench.write("l.toml", grey);
    bench.does(
        "0 | run s.toml -o s -q
         0 | run l.toml -o l -q
         0 | check s/config.toml",
    );
    let (spectral, grey) = (bench.rows("s"), bench.rows("l"));
    assert_eq!((spectral.len(), grey.len()), (2, 2));
    for (a, b) in spectral.iter().zip(&grey) {
        assert_ne!(a.key, b.key);
        let [a, b] = [a, b].map(|row| row.value("nrmse").unwrap());
        assert!((a - b).abs() < 1e-12 + 1e-9 * b, "{a} {b}");
    }
    // The config in the results has the wavelengths, and can be read.
    assert!(bench.read("s/config.toml").contains("wavelengths_nm"));
}

#[test]
fn readings_by_wavelength_go_through_files() {
    let bench = Bench::new();
    bench.write("s.toml", CONFIG);
    let of = "--material lambert";
    bench.good(format!("schedule s.toml -o p.csv {of}"));
    let nm = "wavelengths_nm\":[450.0,550.5,1064.0]}";
    for (file, header) in [
        ("r.csv", format!("# channels = {{\"{nm}")),
        ("r.jsonl", format!("\"channels\":{{\"{nm}")),
    ] {
        bench.good(format!("measure p.csv --config s.toml -o {file} {of}"));
        let text = bench.read(file);
        says(&text, &header);
        assert!(text.contains("value_550.5nm") && !text.contains("value_r"));
        let how = format!("reconstruct {file} --reconstruction multilinear");
        let said = bench.good(format!("{how} --against s.toml {of}"));
        assert!(errors(&said, "cosine")[0] < 1e-12, "{said}");
        bench.refuses(format!("{how} -o t.binary"), 2, NO_WAVELENGTHS);
    }
    let tabulate = format!("tabulate s.toml -o t.binary {of}");
    bench.refuses(tabulate, 2, NO_WAVELENGTHS);
    assert!(!bench.path("t.binary").exists());
}
