//! Grids whose ratio is tuned on materials that are not tested.
#![cfg(feature = "experiments")]

mod common;

use common::{Keep, edited, plan, run, says, table};
use gonio::experiment::{Experiment, Extent, Known, Row};
use std::cell::Cell;

const CONFIG: &str = r#"
budgets = [200, 600]
measures = ["lobe"]

[[material]]
kind = "ggx"
alpha = 0.2

[[material]]
kind = "beckmann"
alpha = 0.3

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "hybrid"
warp = { h_bar = { kind = "power", exponent = 0.6 } }

[[sample_set]]
kind = "grid"
ratio = "tuned"

[[reconstruction]]
kind = "multilinear"

[[reconstruction]]
kind = "cubic"

[metrics]
pairs = 500
max_pairs = 1

[tuning]
pairs = 500
materials = [
  { kind = "ggx", alpha = 0.25 },
  { kind = "lambert", albedo = 0.5 },
  { kind = "ward", rho_d = 0.2, rho_s = 0.3, alpha = 0.2 },
]
"#;

fn bits(rows: &[Row]) -> Vec<Option<u64>> {
    let bits = |r: &Row| r.value("nrmse").map(f64::to_bits);
    rows.iter().map(bits).collect()
}

#[test]
fn each_grid_is_tuned_once_and_never_worse_on_what_it_is_tuned_on() {
    let plan = plan(CONFIG).expect("a plan");
    let (rows, summary) = run(&plan);
    assert_eq!(rows.len(), plan.rows());
    // Two parametrizations and two budgets, shared by both materials and reconstructions.
    assert_eq!(summary.tuned.len(), 4);
    for tuned in &summary.tuned {
        assert!(tuned.nrmse <= tuned.nrmse_untuned, "{tuned:?}");
        assert!(tuned.tried > 4 && tuned.ratio.len() == 3, "{tuned:?}");
    }
    let mut tuned = summary.tuned.iter();
    assert!(tuned.any(|t| t.nrmse < 0.95 * t.nrmse_untuned));
    // The numbers that are told, written out, make the same rows.
    for tuned in &summary.tuned {
        let (parametrization, budget) = (&tuned.grid.parametrization, tuned.grid.budget);
        let (front, _) = CONFIG.split_once("[tuning]").expect("at the end");
        let text = front.replace("\"tuned\"", &format!("{:?}", tuned.ratio));
        let text = text.replace("[200, 600]", &format!("[{budget}]"));
        let (written, _) = run(&common::plan(&text).expect("a plan"));
        let of = |rows: &[Row]| {
            let mine = rows.iter().filter(|r| {
                r.parametrization == *parametrization && r.allowed == format!("{budget} poses")
            });
            mine.cloned().collect::<Vec<_>>()
        };
        assert_eq!(bits(&of(&written)), bits(&of(&rows)), "{tuned:?}");
        assert_eq!(of(&rows).len(), 4);
    }
}

#[test]
fn threads_do_not_matter_and_the_training_materials_are_in_the_keys() {
    let on = |threads: usize| {
        crate::common::on_threads(threads, || {
            let (rows, summary) = run(&plan(CONFIG).expect("a plan"));
            (bits(&rows), summary.tuned, summary.keys)
        })
    };
    let one = on(1);
    assert_eq!(one, on(2));
    let other = CONFIG.replace("albedo = 0.5", "albedo = 0.6");
    let keys = |text: &str| {
        let expected = plan(text).expect("a plan").expected(None);
        expected.iter().map(|e| e.key("m")).collect::<Vec<_>>()
    };
    assert_eq!(keys(CONFIG), keys(CONFIG));
    assert!(keys(CONFIG).iter().all(|key| !keys(&other).contains(key)));
    let plan = plan(CONFIG).expect("a plan");
    assert_eq!(keys(&plan.resolved.to_string()), keys(CONFIG));
}

#[test]
fn tuning_can_be_stopped() {
    let plan = plan(CONFIG).expect("a plan");
    // Some questions come before the first tuning; most come within it.
    let mut keep = Keep {
        patience: Some(Cell::new(12)),
        ..Keep::default()
    };
    let summary = plan.run(&Extent::default(), &Known::default(), &mut keep);
    let summary = summary.expect("no error");
    assert!(summary.interrupted && summary.rows == 0 && summary.tuned.is_empty());
}

#[test]
fn tested_materials_are_refused_whatever_they_are_called() {
    for [from, to, parts] in table(
        r#"
        { kind = "lambert", albedo = 0.5 } | { kind = "beckmann", alpha = 0.3, name = "other" } | tuning.materials[1] = "other" … beckmann … not tested
        pairs = 500\nmaterials | pairs = 0\nmaterials | tuning.pairs = 0 … allowed
        budgets = [200, 600] | budgets = [200]\nminutes = [10]\ninstrument = [{ preset = "utia" }] | minutes do not go with the tuned ratio … allowed: budgets
"#,
    ) {
        let message = plan(&edited(CONFIG, from, to)).err().expect(to).to_string();
        says(&message, parts);
    }
    // A material that breaks what a schedule folds has no say in it.
    let (front, _) = CONFIG.split_once("materials = [").unwrap();
    let ward = "materials = [{ kind = \"ward\", rho_d = 0.2, rho_s = 0.3, alpha = [0.05, 0.2] }]";
    let message = plan(&format!("{front}{ward}")).err().unwrap().to_string();
    says(&message, "tuning.materials has none with the symmetries of");
}
