//! What can be said of a parametrization before anything is measured.

use super::common::{Level, levels, says};
use super::{Bench, csv_rows, number};
use serde_json::Value;

type Row = serde_json::Map<String, Value>;

#[test]
fn claims_are_judged_with_and_without_a_material() {
    let bench = Bench::new();
    let parts = "holds          f-aligned-hybrid … does not hold  phi-k-is-a-sum";
    let said = bench.tells("claims", parts);
    assert!(!said.contains("isolines-like-s"), "{said}");
    bench.good("claims lambert --format json -o claims.json");
    let rows: Value = serde_json::from_str(&bench.read("claims.json")).unwrap();
    let rows = rows.as_array().unwrap();
    let row = rows.iter().find(|r| r["id"] == "slices-correspond");
    assert_eq!(row.unwrap()["verdict"], "holds-partly");
    bench.refuses("claims -o claims.json", 2, "--force");
    bench.refuses("claims shiny", 2, "lambert");
}

#[test]
fn distortion_is_told_for_every_parametrization() {
    let bench = Bench::new();
    let rows = csv_rows(&bench.good("distortion test-s --format csv"));
    // Four slices and all of them, in each parametrization.
    let all = gonio::parametrization::all().len();
    assert_eq!(rows.len(), 5 * all);
    let said = bench.good("distortion lambert --table stretch");
    assert_eq!(said.lines().count(), 3 + all, "{said}");
    bench.does(
        "0 | distortion lambert --table reduction | half-difference  uniform
         2 | distortion small.toml --material x | ggx",
    );
}

levels! {
    alignment_is_that_of_all_materials: "thorough: as many materials as an interval takes";
}

/// Alignment over materials is the mean of what is told of each.
fn alignment_is_that_of_all_materials(level: Level) {
    let bench = Bench::new();
    let alphas = &[0.1, 0.4, 0.2, 0.3, 0.5][..level.of(1, 5)];
    let n = alphas.len() + 1;
    let ggx = |alpha| format!("{{ kind = \"ggx\", alpha = {alpha} }}, ");
    let ggx = alphas.iter().map(ggx);
    let materials = ggx.collect::<String>() + "{ kind = \"low-abc-smooth\" }";
    let text = format!("experiment = \"moments\"\nmaterial = [{materials}]\n");
    bench.write("many.toml", text);
    let table =
        |args: &str| csv_rows(&bench.good(format!("distortion many.toml --format csv {args}")));
    let aligned = table("--table alignment");
    // Two functions by two weights.
    assert_eq!(aligned.len(), 4 * gonio::parametrization::all().len());
    for weight in ["coordinates", "solid-angle"] {
        let shares = table(&format!("--weight {weight}"));
        let shares_of = |parametrization: &Value, function: &str| -> Vec<f64> {
            let is_of = |r: &&Row| r["parametrization"] == *parametrization && r["phi_deg"] == "";
            let of = shares.iter().filter(is_of);
            of.map(|r| number(r, function)).collect()
        };
        for row in aligned.iter().filter(|r| r["weight"] == weight) {
            let function = row["function"].as_str().unwrap();
            let shares = shares_of(&row["parametrization"], function);
            let reference = shares_of(&"half-difference".into(), function);
            let number = |name: &str| number(row, name);
            let mean = |of: &dyn Fn(usize) -> f64| (0..n).map(of).sum::<f64>() / n as f64;
            assert_eq!((number("materials"), shares.len()), (n as f64, n));
            assert!((number("mean") - mean(&|i| shares[i])).abs() < 1e-12);
            let difference = mean(&|i| shares[i] - reference[i]);
            assert!((number("difference") - difference).abs() < 1e-12);
            let more = (0..n).filter(|&i| shares[i] > reference[i]).count();
            assert_eq!(number("more"), more as f64);
            if level == Level::Thorough {
                assert!(number("low") <= difference && difference <= number("high"));
            }
        }
    }
    let told = format!("nodes weighed by solid-angle, over {n} materials");
    let said = bench.tells("distortion many.toml --table alignment", &told);
    // The same beside a picture.
    let drawn = "distortion many.toml --table alignment --picture aligned.svg";
    assert_eq!(bench.good(drawn), said);
    let svg = bench.read("aligned.svg");
    assert!(svg.starts_with("<svg"));
    says(&svg, &format!("{n} materials"));
    // A mark for each and their mean, in every parametrization and with both weights, of several shapes.
    let marks = (n + 1) * 2 * gonio::parametrization::all().len();
    let [circles, others] = ["<circle", "z\"/>"].map(|tag| svg.matches(tag).count());
    assert_eq!(circles + others, marks);
    assert!(circles > 0 && others > 0);
    bench.does(&format!(
        "2 | {drawn} | --force
         0 | {drawn} --force
         2 | distortion many.toml --picture shares.svg | --table alignment"
    ));
}

#[test]
fn a_box_is_told_and_drawn() {
    let bench = Bench::new();
    let of = "subset --parametrization spherical --box";
    let inside = format!("{of} 'theta_i=0..30, theta_o=0..30' --material lambert -o box.svg");
    // sin⁴ 30°.
    bench.tells(inside, "energy              6.2");
    assert!(bench.read("box.svg").starts_with("<svg"));
    bench.does(
        "2 | subset --parametrization spherical --box theta_h=0..30 | --box … theta_h … theta_i, theta_o, delta_phi
         2 | subset --parametrization polar --box '' | half-difference",
    );
}

#[test]
fn samplers_are_compared_by_their_coordinates() {
    let bench = Bench::new();
    let text = bench.tells(
        "sampling ggx --set alpha=0.1 --views 4 --picture p.svg",
        "h_bar square-root … its own: … least at 16²: ",
    );
    let picture = bench.read("p.svg");
    assert!(picture.contains("square-root, ends: horizon") && picture.contains("h_bar, bilinear"));
    let rows = bench.json("sampling ggx --set alpha=0.1 --views 4 --json");
    let rows = rows.as_array().unwrap();
    let of = |sampler: &'static str| rows.iter().filter(move |row| row["sampler"] == sampler);
    let variance =
        |row: &serde_json::Value| row["relative_variance"].as_f64().unwrap_or(f64::INFINITY);
    assert_eq!(of("omega_i").count(), 2 * 2 * 4 * 2, "{text}");
    // Of one view, azimuths and cells: half vectors beat the directions themselves, and those beat the cosine.
    let least = |sampler: &'static str| {
        of(sampler)
            .filter(|r| r["cells"] != 64)
            .map(variance)
            .fold(9e9, f64::min)
    };
    assert!(10.0 * least("half-vector") < least("omega_i"));
    assert!(least("omega_i") < variance(of("cosine").next().unwrap()));
    bench.write(
        "black.toml",
        "experiment = \"moments\"\nmaterial = [{ kind = \"lambert\", albedo = 0.0 }]\n",
    );
    bench.does(
        "2 | sampling ggx --views 0 | --views … 0 … from 1 to 256
         2 | sampling ggx --views 2000 | --views … 2000 … from 1 to 256
         2 | sampling shiny | ggx
         2 | sampling ggx --picture p.svg | --force
         2 | sampling ggx --picture p.png | .svg
         0 | sampling black.toml --views 2 | is left out: it reflects nothing, or has no data, at any view",
    );
}
