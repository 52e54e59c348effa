//! Findings of studies are those of errors that are known.

use super::common;
use super::common::{near, run};
use gonio::experiment::{Duel, Findings, Metric, Row};

/// Rows whose errors are a product of one factor a parametrization and material, and one a material.
fn product(factor: impl Fn(&str, usize) -> f64) -> Vec<Row> {
    let mut rows = Vec::new();
    let choices = common::product(["half-difference", "hybrid", "spherical"], [100, 1000]);
    for (m, (parametrization, budget)) in common::product(0..12, choices) {
        let error = (1 + m * m) as f64 * factor(parametrization, m) / budget as f64;
        let choice = [parametrization, "none"];
        let mut row = common::row(&format!("m{m}"), choice, budget, error);
        row.truth = if m < 6 { "a".into() } else { "b".into() };
        rows.push(row);
    }
    rows
}

/// What is found in rows, with a band of 5 %.
fn findings(rows: &[Row]) -> Findings {
    Findings::new(&rows.iter().collect::<Vec<_>>(), 1.05)
}

/// Twice the errors in hybrid.
fn hybrid_twice(parametrization: &str, _: usize) -> f64 {
    1.0 + f64::from(parametrization == "hybrid")
}

/// The first comparison of hybrid with another.
fn duel_of_hybrid(rows: &[Row]) -> Duel {
    let mut duels = findings(rows).duels.swap_remove(0).duels.into_iter();
    duels.find(|d| d.a.parametrization == "hybrid").unwrap()
}

#[test]
fn findings_are_those_of_the_factors() {
    let rows = product(|parametrization, m| match parametrization {
        "hybrid" => 2.0,
        // Better on half of the materials, and a little more worse on the others.
        "spherical" => [0.5, 2.2][m % 2],
        _ => 1.0,
    });
    let findings = findings(&rows);
    assert_eq!(findings.truths, ["a", "b"]);
    assert_eq!(findings.allowances, ["100 poses", "1000 poses"]);
    let ranking = findings.ranking(Metric::Nrmse, "cosine", None).unwrap();
    assert_eq!(ranking.scope.materials, 12);
    let of = |name: &str| {
        let mut lines = ranking.lines.iter();
        lines.find(|l| l.choice.parametrization == name).unwrap()
    };
    let hybrid = of("hybrid");
    // Errors fall as 1/budget for every material.
    near(hybrid.order.unwrap().slope, -1.0, 1e-12, "slope");
    let cell = hybrid.cells[0].unwrap();
    assert_eq!(cell.place, Some(3));
    let duel = cell.against_best.unwrap();
    let is_twice = (duel.ratio - 2.0).abs() < 1e-12 && duel.losses == 12;
    assert!(is_twice, "{duel}");
    let mut duels = findings.duels.iter();
    let duels = duels.find(|d| d.scope == ranking.scope).unwrap();
    let choices = ["spherical", "half-difference"];
    let mut duels = duels.duels.iter();
    let spherical = duels.find(|d| [&d.a, &d.b].map(|c| &c.parametrization) == choices);
    let spherical = spherical.unwrap();
    let duel = spherical.cells[1].unwrap();
    assert!((duel.ratio - 1.1f64.sqrt()).abs() < 1e-12);
    assert_eq!((duel.wins, duel.losses), (6, 6));
    assert_eq!(duel.verdict(), gonio::statistics::Verdict::Undecided);
    // Budget and material act on every choice alike; what spherical does depends on the material.
    let explained = &findings.explained[0];
    let place = |name: &str| explained.factors.iter().position(|f| *f == name).unwrap();
    let pair = |a: usize, b: usize| {
        let (a, b) = (a.min(b), a.max(b));
        let mut pairs = explained.shares.pairs.iter();
        pairs.find(|p| (p.0, p.1) == (a, b)).map_or(0.0, |p| p.2)
    };
    let shares = &explained.shares;
    assert!(shares.mains[place("budget")] > 0.1 && shares.mains[place("material")] > 0.1);
    assert!(pair(place("parametrization"), place("material")) > 0.01);
    assert!(pair(place("budget"), place("material")) < 1e-12);
    let of_pairs = shares.pairs.iter().map(|p| p.2).sum::<f64>();
    let total = shares.mains.iter().sum::<f64>() + of_pairs + shares.rest;
    near(total, 1.0, 1e-9, "all shares");
}

#[test]
fn ratios_over_all_budgets_are_of_mean_errors() {
    // Twice as much at the first budget, eight times at the second; one material lacks the second.
    let mut rows = product(|_, _| 1.0);
    for row in rows.iter_mut().filter(|r| r.parametrization == "hybrid") {
        let factor = if row.budget == 100 { 2.0 } else { 8.0 };
        let error = row.value("nrmse").map(|e| e * factor);
        let is_lacking = row.material == "m3" && row.budget == 1000;
        row.quantities.set("nrmse", error.filter(|_| !is_lacking));
    }
    let found = duel_of_hybrid(&rows).overall.unwrap();
    assert!((found.ratio - 4.0).abs() < 1e-12, "{found}");
    assert_eq!((found.n, found.losses), (11, 11));
    // At one budget there is nothing to bring together.
    rows.retain(|r| r.budget == 100);
    assert_eq!(duel_of_hybrid(&rows).overall, None);
}

/// Errors fall as a power of the readings, each with its own exponent, and one choice takes fewer readings than
/// it may: ratios are those at the fewer, and at the first budget, where nothing is below, at the more.
#[test]
fn ratios_are_at_equal_readings() {
    let mut rows = product(|_, _| 1.0);
    let exponent = |material: &str| 0.4 + 0.05 * material[1..].parse::<f64>().unwrap();
    for row in &mut rows {
        let hybrid = row.parametrization == "hybrid";
        let share = if hybrid { 0.9 } else { 1.0 };
        row.readings = (share * row.budget as f64) as usize;
        let error = (row.readings as f64).powf(-exponent(&row.material));
        let factor = if hybrid { 3.0 } else { 1.0 };
        row.quantities.set("nrmse", Some(factor * error));
    }
    let ratios = |rows: &[Row]| {
        let duel = duel_of_hybrid(rows);
        let cells = duel.cells.iter().copied().chain([duel.overall]);
        cells.map(|c| c.unwrap().ratio).collect::<Vec<_>>()
    };
    for ratio in ratios(&rows) {
        near(ratio, 3.0, 1e-12, "ratio");
    }
    // Of so many minutes ratios are those of what could be read in them.
    for row in &mut rows {
        row.allowed = format!("{} minutes", row.budget);
    }
    for ratio in ratios(&rows) {
        assert!(ratio > 3.2, "{ratio}");
    }
}

#[test]
fn seeds_are_no_materials() {
    let rows = product(hybrid_twice);
    let mut twice = rows.clone();
    // A second seed whose errors are twice as large: the mean is sqrt 2 larger, n stays.
    twice.extend(rows.iter().cloned().map(|mut row| {
        row.seed = 7;
        let error = row.value("nrmse").map(|e| 2.0 * e);
        row.quantities.set("nrmse", error);
        row
    }));
    let means = [&rows, &twice].map(|rows| {
        let findings = findings(rows);
        let ranking = findings.ranking(Metric::Nrmse, "cosine", None).unwrap();
        let cell = ranking.lines[1].cells[0].unwrap();
        assert_eq!(cell.against_best.unwrap().n, 12);
        cell.mean
    });
    assert!((means[1] / means[0] - 2f64.sqrt()).abs() < 1e-12);
}

#[test]
fn warps_are_paired_by_their_place() {
    let rows = product(|_, _| 1.0);
    let with = |row: &Row, warp: &str| Row {
        warp: warp.into(),
        ..row.clone()
    };
    // half-difference: none, a; hybrid: none, b, c; spherical: none.
    let rows = rows.iter().flat_map(|r| match r.parametrization.as_str() {
        "half-difference" => vec![r.clone(), with(r, "a")],
        "hybrid" => vec![r.clone(), with(r, "b"), with(r, "c")],
        _ => vec![r.clone()],
    });
    let findings = findings(&rows.collect::<Vec<_>>());
    let of = |a: &str, b: &str| {
        let duels = findings.duels[0].duels.iter();
        let between = duels.filter(|d| d.a.parametrization == a && d.b.parametrization == b);
        let warps = between.map(|d| (d.b.warp.as_str(), d.a.warp.as_str()));
        let mut warps: Vec<_> = warps.collect();
        warps.sort_unstable();
        warps
    };
    let none = ("none", "none");
    let of_hybrid = of("hybrid", "half-difference");
    assert_eq!(of_hybrid, [("a", "b"), ("a", "c"), none]);
    assert_eq!(of("spherical", "half-difference"), [("a", "none"), none]);
}

#[test]
fn materials_that_tell_nothing_are_left_out_and_named() {
    let rows = product(hybrid_twice);
    let with = |name: &str, error: Option<f64>| -> Vec<Row> {
        let mut others = rows.clone();
        others.retain(|r| r.material == "m0");
        for other in &mut others {
            other.material = name.into();
            other.quantities.set("nrmse", error);
        }
        others
    };
    let mut more = rows.clone();
    more.extend(with("exact", Some(3e-16)));
    // By one choice of several.
    let mut by_one = with("by-one", Some(0.1));
    for row in by_one.iter_mut().filter(|r| r.parametrization == "hybrid") {
        row.quantities.set("nrmse", Some(1e-13));
    }
    more.extend(by_one);
    more.extend(with("black", None));
    let [plain, more] = [&rows, &more].map(|rows| findings(rows));
    let ranking = |found: &Findings| {
        found
            .ranking(Metric::Nrmse, "cosine", None)
            .unwrap()
            .clone()
    };
    let [of_plain, of_more] = [&plain, &more].map(ranking);
    assert_eq!(of_plain.lines, of_more.lines);
    assert_eq!(of_more.scope.materials, 12);
    let left_out = of_more.scope.left_out.join(", ");
    let exact = "exact (exact by a choice), by-one (exact by a choice)";
    assert_eq!(left_out, format!("{exact}, black (no error is defined)"));
    // By the other error they are compared.
    let other = more.ranking(Metric::LogRelative, "cosine", None).unwrap();
    assert_eq!(other.scope.materials, 15);
}

#[test]
fn expected_errors_stand_beside_the_true_ones() {
    let text = r#"
seeds = [1, 2]
budgets = [12, 40]
measures = ["cosine", "lobe"]
quantities = ["expected"]
material = [
  { kind = "ggx", alpha = 0.3 },
  { kind = "ggx", alpha = 0.1 },
  { kind = "ward", alpha = 0.2, rho_s = 0.2 },
]
parametrization = [{ kind = "half-difference" }]
sample_set = [{ kind = "sobol" }]
reconstruction = [{ kind = "kriging" }, { kind = "thin-plate" }]
metrics = { pairs = 700, max_pairs = 1 }
"#;
    let (rows, _) = run(&common::plan(text).unwrap());
    for row in &rows {
        let is_expected = row.value("expected_nrmse").is_some();
        assert_eq!(is_expected, row.reconstruction == "kriging");
    }
    let findings = Findings::new(&rows.iter().collect::<Vec<_>>(), 1.0);
    // Two errors under two measures, of one of the two reconstructions.
    assert_eq!(findings.calibrations.len(), 4);
    for calibration in &findings.calibrations {
        let name = calibration.metric.name();
        assert_eq!(calibration.choice.reconstruction, "kriging");
        for (cell, allowed) in calibration.cells.iter().zip(["12 poses", "40 poses"]) {
            let cell = cell.unwrap();
            let of_material = |material: &str| {
                let is_mine = |row: &&Row| {
                    [&row.material, &row.reconstruction] == [material, "kriging"]
                        && [&row.measure, &row.allowed] == [&calibration.measure, allowed]
                };
                let ratios = rows.iter().filter(is_mine).map(|row| {
                    let expected = row.value(&format!("expected_{name}")).unwrap();
                    row.value(name).unwrap() / expected
                });
                let ratios: Vec<f64> = ratios.collect();
                assert_eq!(ratios.len(), 2, "{material}");
                (ratios[0] * ratios[1]).sqrt()
            };
            let mut of_materials = ["ggx-0.3", "ggx-0.1", "ward-0.2"].map(of_material);
            of_materials.sort_by(f64::total_cmp);
            assert_eq!((cell.count, cell.ninth), (3, None));
            assert!((cell.median / of_materials[1] - 1.0).abs() < 1e-12);
            assert_eq!(cell.below.is_some(), calibration.measure == "cosine");
        }
    }
}
