//! What can be said of a parametrization before anything is measured.

use super::Bench;
use super::common::{Level, levels, says};
use std::collections::BTreeMap;

#[test]
fn claims_are_judged_with_and_without_a_material() {
    let bench = Bench::new();
    let said = bench.good("claims");
    says(&said, "holds          f-aligned-hybrid");
    says(&said, "does not hold  phi-k-is-a-sum");
    assert!(!said.contains("isolines-like-s"), "{said}");
    bench.good("claims lambert --format json -o claims.json");
    let rows: serde_json::Value = serde_json::from_str(&bench.read("claims.json")).unwrap();
    let rows = rows.as_array().unwrap();
    let of_material = rows.iter().filter(|r| r["material"] == "lambert").count();
    assert_eq!(of_material, 6);
    let undefined = |r: &&serde_json::Value| r["verdict"] == "not-defined";
    assert_eq!(rows.iter().filter(undefined).count(), 5);
    let row = rows
        .iter()
        .find(|r| r["id"] == "slices-correspond")
        .unwrap();
    assert_eq!(row["verdict"], "holds-partly");
    assert!(row["numbers"]["spread_of_phi_d_at_30deg_deg"].as_f64() > Some(20.0));
    bench.refuses("claims -o claims.json", 2, "--force");
    bench.refuses("claims shiny", 2, "lambert");
}

#[test]
fn distortion_is_told_for_every_parametrization() {
    let bench = Bench::new();
    let csv = bench.good("distortion test-s --format csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    let heads = rows.headers().unwrap().clone();
    let place = |name: &str| heads.iter().position(|h| h == name).unwrap();
    let rows: Vec<_> = rows.records().map(Result::unwrap).collect();
    // Four slices and all of them, in five parametrizations.
    assert_eq!(rows.len(), 25);
    for row in &rows {
        let first: f64 = row[place("first")].parse().unwrap();
        let along = ["hybrid", "orthographic", "stark"].contains(&&row[place("parametrization")]);
        assert_eq!((first - 1.0).abs() < 1e-12, along, "{row:?}");
        assert_eq!(&row[place("scale")], "value");
    }
    let said = bench.good("distortion lambert --table stretch");
    assert_eq!(said.lines().count(), 8, "{said}");
    bench.tells(
        "distortion lambert --table reduction",
        "half-difference  uniform",
    );
    bench.refuses("distortion small.toml --material x", 2, "ggx");
}

levels! {
    alignment_is_that_of_all_materials: "thorough: as many materials as an interval takes";
}

/// Alignment over materials is the mean of what is told of each.
fn alignment_is_that_of_all_materials(level: Level) {
    let bench = Bench::new();
    let all = [
        "alpha = 0.1",
        "alpha = 0.4",
        "alpha = 0.2",
        "alpha = 0.3",
        "alpha = 0.5",
    ];
    let kinds = &all[..level.of(2, 5)];
    let n = kinds.len() + 1;
    let mut config = "experiment = \"moments\"\n".to_owned();
    for keys in kinds {
        config += &format!("[[material]]\nkind = \"ggx\"\n{keys}\n");
    }
    config += "[[material]]\nkind = \"low-abc-smooth\"\n";
    std::fs::write(bench.path("many.toml"), &config).unwrap();
    let table = |args: &str| -> Vec<BTreeMap<String, String>> {
        let csv = bench.good(format!("distortion many.toml --format csv {args}"));
        let mut rows = csv::Reader::from_reader(csv.as_bytes());
        rows.deserialize().map(Result::unwrap).collect()
    };
    let aligned = table("--table alignment");
    assert_eq!(aligned.len(), 20);
    for weight in ["coordinates", "solid-angle"] {
        let shares = table(&format!("--weight {weight}"));
        let shares_of = |parametrization: &str, function: &str| -> Vec<f64> {
            let of = shares
                .iter()
                .filter(|r| r["parametrization"] == parametrization);
            let all = of.filter(|r| r["phi_deg"].is_empty());
            all.map(|r| r[function].parse().unwrap()).collect()
        };
        for row in aligned.iter().filter(|r| r["weight"] == weight) {
            let shares = shares_of(&row["parametrization"], &row["function"]);
            let reference = shares_of("half-difference", &row["function"]);
            let number = |name: &str| row[name].parse::<f64>().unwrap();
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
    let said = bench.good("distortion many.toml --table alignment");
    says(
        &said,
        &format!("nodes weighed by solid-angle, over {n} materials"),
    );
    // The same beside a picture.
    let picture = "--table alignment --picture aligned.svg";
    let drawn = format!("distortion many.toml {picture}");
    assert_eq!(bench.good(&drawn), said);
    let svg = bench.read("aligned.svg");
    assert!(
        svg.starts_with("<svg") && svg.contains(&format!("{n} materials")),
        "{svg}"
    );
    bench.refuses(&drawn, 2, "--force");
    bench.good(format!("{drawn} --force"));
    let other = ["distortion", "many.toml", "--picture", "shares.svg"];
    bench.refuses(other, 2, "--table alignment");
}

levels! {
    a_box_is_told_and_drawn: "thorough: the box of everything, a narrow one, one of black";
}

fn a_box_is_told_and_drawn(level: Level) {
    let bench = Bench::new();
    let of = "subset --parametrization spherical --box";
    let inside = format!("{of} 'theta_i=0..30, theta_o=0..30' --material lambert -o box.svg");
    // sin⁴ 30°.
    bench.tells(inside, "energy              6.2");
    assert!(bench.read("box.svg").starts_with("<svg"));
    bench.refuses_all(
        "2 | subset --parametrization spherical --box theta_h=0..30 | --box … theta_h … theta_i, theta_o, delta_phi
         2 | subset --parametrization spherical --box theta_i=30..91 | 30..91 … 90 … degrees
         2 | subset --parametrization polar --box '' | half-difference",
    );
    if level == Level::Quick {
        return;
    }
    let whole = bench.good(format!("{of} '' --format json"));
    let whole: serde_json::Value = serde_json::from_str(&whole).unwrap();
    assert!((whole["share_of_all_pairs"].as_f64().unwrap() - 1.0).abs() < 1e-6);
    assert_eq!(whole["images"].as_object().unwrap().len(), 4);
    bench.tells(
        format!("{of} theta_i=0..30 --material lambert --set albedo=0"),
        "energy              – of that of lambert",
    );
    let narrow = "subset --parametrization stark --box alpha=0.95..1";
    bench.tells(narrow, "sr² counted (");
}
