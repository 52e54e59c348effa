//! Studies: their rows are those of an acquisition, they are made once, their findings are those of
//! errors that are known.
#![cfg(feature = "experiments")]

mod common;

use common::{Level, levels, says, table};
use gonio::Error;
use gonio::experiment::relations::{MaterialRelations, RelationsPlan};
use gonio::experiment::{
    ByProduct, Event, Experiment, Extent, Findings, Known, Metric, Observer, Plan,
    RESULTS_REVISION, Row, RowKey, Shard, Source, material_key,
};
use serde_json::{Map, Value, json};
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::Path;

levels! {
    materials_together_and_alone_have_the_same_rows_to_the_bit: "thorough: all quantities and channels";
    parts_of_a_measure_are_not_waited_for: "thorough: more pairs";
}

/// Two symmetries, grids and scattered points, a reconstruction in its own and in other coordinates.
const TEXT: &str = r#"
budgets = [80, 200]
seeds = [1, 2]
measures = ["cosine", "lobe"]

[[material]]
kind = "ggx"
alpha = 0.3

[[material]]
kind = "ggx"
alpha = 0.1

[[material]]
kind = "lambert"

[[material]]
kind = "ward"
alpha = [0.2, 0.5]

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "hybrid"
warp = { h_bar = "square-root" }

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "multilinear"

[[reconstruction]]
kind = "cubic"

[[reconstruction]]
kind = "thin-plate"
neighbours = 16

[metrics]
pairs = 700
max_pairs = 1
"#;

fn plan(text: &str) -> Plan {
    let text = format!("experiment = \"study\"\n{text}");
    Plan::read(&Source::new("c.toml", text)).unwrap()
}

#[derive(Default)]
struct Keep {
    rows: Vec<Row>,
    /// What was told of each schedule and material, in the order it was told.
    complete: Vec<RowKey>,
    loaded: Vec<String>,
    announced: f64,
    work: f64,
    /// Wants to see all materials.
    curious: bool,
    /// Stops when there are so many rows.
    stop_at: Option<usize>,
}

impl Observer<Row> for Keep {
    fn cancelled(&self) -> bool {
        self.stop_at.is_some_and(|n| self.rows.len() >= n)
    }

    fn begins(&mut self, work: f64) {
        self.announced = work;
    }

    fn wants(&self, wish: &ByProduct<'_>) -> bool {
        self.curious && matches!(wish, ByProduct::Material(..))
    }

    fn observe(&mut self, event: &Event<'_, Row>) -> Result<(), Error> {
        match event {
            Event::Made(rows) => self.rows.extend_from_slice(rows),
            Event::Complete(rows) => self.complete.extend(rows.iter().map(|r| r.key.clone())),
            Event::Loaded(material, ..) => self.loaded.push(material.name.clone()),
            Event::Advanced(work) => self.work += work,
            Event::Failed(failure) => panic!("{failure:?}"),
            _ => {}
        }
        Ok(())
    }
}

fn run(plan: &Plan, shard: Option<Shard>, known: &Known<Row>) -> Keep {
    let mut keep = Keep::default();
    let extent = Extent {
        shard,
        ..Extent::default()
    };
    plan.run(&extent, known, &mut keep).unwrap();
    keep
}

/// All rows of a plan, in the order they are made.
fn rows(plan: &Plan) -> Vec<Row> {
    run(plan, None, &Known::new()).rows
}

/// The keys that a plan says its rows have, in the order of results.
fn listed(plan: &Plan) -> Vec<RowKey> {
    let materials: Vec<RowKey> = plan
        .materials
        .iter()
        .map(|m| material_key(m).unwrap())
        .collect();
    let expected = plan.expected(None).into_iter();
    expected.map(|e| e.key(&materials[e.material])).collect()
}

fn keys(rows: &[Row]) -> HashSet<RowKey> {
    rows.iter().map(|r| r.key.clone()).collect()
}

fn known(rows: &[Row]) -> Known<Row> {
    rows.iter()
        .map(|r| (r.key.clone(), r.clone().into()))
        .collect()
}

/// Without what depends on the clock of this computer, in the order of results.
fn timeless(plan: &Plan, rows: &[Row]) -> Vec<Row> {
    let keys = listed(plan);
    let place: HashMap<&RowKey, usize> = keys.iter().zip(0..).collect();
    let strip = |r: &Row| Row {
        plan_seconds: Some(0.0),
        measure_seconds: Some(0.0),
        reconstruct_seconds: Some(0.0),
        evaluate_seconds: Some(0.0),
        moment_seconds: None,
        ..r.clone()
    };
    let mut rows: Vec<Row> = rows.iter().map(strip).collect();
    rows.sort_by_key(|r| place[&r.key]);
    rows
}

/// Readings of one material of [`TEXT`] at a time, and of all of them together.
fn materials_together_and_alone_have_the_same_rows_to_the_bit(level: Level) {
    let few = TEXT.replace("budgets = [80, 200]", "budgets = [80]");
    let few = few.replace("seeds = [1, 2]", "seeds = [1]");
    let moments = "quantities = [\"albedo\", \"moments\"]\n";
    let table = "[moments]\nviews = 2\norder = 2\n\
        estimator = { kind = \"sobol\", samples = 128 }\n";
    let texts = [
        few.clone(),
        format!("channels = \"rgb\"\n{moments}{few}{table}channels = [\"red\"]\n"),
        TEXT.to_owned(),
        format!("channels = \"rgb\"\nquantities = [\"albedo\"]\n{TEXT}"),
        format!("{moments}{few}{table}"),
    ];
    for text in texts.into_iter().take(level.of(2, 5)) {
        let whole = plan(&text);
        let together = rows(&whole);
        assert_eq!(together.len(), whole.rows());
        let together = timeless(&whole, &together);
        let mut alone = Vec::new();
        for name in whole.materials.iter().map(|m| m.name.clone()) {
            let mut one = plan(&text);
            one.materials.retain(|m| m.name == name);
            alone.extend(rows(&one));
        }
        assert!(together == timeless(&whole, &alone), "{text}");
        // One at a time, because there is no room for two.
        let mut narrow = Keep::default();
        let extent = Extent {
            memory: 1,
            ..Extent::default()
        };
        whole.run(&extent, &Known::new(), &mut narrow).unwrap();
        assert!(together == timeless(&whole, &narrow.rows), "{text}");
        let of = |row: &Row| (row.value("albedo"), row.value("moment_energy"));
        let asked = text.contains("quantities");
        assert!(together.iter().all(|r| of(r).0.is_some() == asked));
        let asked = text.contains("[moments]");
        assert!(together.iter().all(|r| of(r).1.is_some() == asked));
    }
}

#[test]
fn materials_without_data_somewhere_are_not_mixed_with_others() {
    // A table that ends at 75° beside one model that does not.
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bin");
    let mut bytes = Vec::new();
    for i in 0..3 * 288 * 288 {
        bytes.extend((0.1 + 1e-7 * f64::from(i % 977)).to_le_bytes());
    }
    fs::write(&path, bytes).unwrap();
    let text = format!(
        r#"
budgets = [4000]
measures = ["cosine"]

[[material]]
kind = "utia"
path = {path:?}

[[material]]
kind = "lambert"
symmetry = {{ isotropic = false, reciprocal = false, bilateral = false }}

[[parametrization]]
kind = "spherical"

[[reconstruction]]
kind = "multilinear"

[metrics]
pairs = 300
max_pairs = 1
"#
    );
    let rows = rows(&plan(&text));
    assert_eq!(rows.len(), 2);
    let of = |name: &str| rows.iter().find(|r| r.material == name).unwrap();
    let (table, lambert) = (&rows[0], of("lambert"));
    assert!(table.readings < lambert.readings && table.pairs_missing > 0);
    assert!(lambert.value("nrmse").unwrap() < 1e-12 && lambert.pairs_missing == 0);
}

#[test]
fn what_is_known_is_not_done_again() {
    let plan = plan(TEXT);
    let whole = run(&plan, None, &Known::new());
    let listed = listed(&plan);
    assert_eq!(listed.len(), plan.rows());
    let all = keys(&whole.rows);
    assert_eq!(all, listed.iter().cloned().collect());
    assert!(whole.announced > 0.0);
    assert!((whole.work / whole.announced - 1.0).abs() < 1e-12);
    let again = run(&plan, None, &known(&whole.rows));
    assert!(again.rows.is_empty() && again.loaded.is_empty());
    // It is told as if it were made now.
    assert_eq!(again.complete, whole.complete);
    assert_eq!(again.work, whole.work);
    // Stopped somewhere and gone on, in any state: the same rows.
    for stop_at in [1, 40, 101] {
        let mut first = Keep {
            stop_at: Some(stop_at),
            ..Keep::default()
        };
        let summary = plan.run(&Extent::default(), &Known::new(), &mut first);
        assert!(summary.unwrap().interrupted && first.rows.len() >= stop_at);
        let rest = run(&plan, None, &known(&first.rows));
        assert_eq!(first.rows.len() + rest.rows.len(), whole.rows.len());
        assert_eq!(rest.complete, whole.complete);
        let rows = [first.rows, rest.rows].concat();
        assert!(timeless(&plan, &rows) == timeless(&plan, &whole.rows));
    }
}

#[test]
fn all_of_a_schedule_is_told_once_in_the_order_of_results() {
    let plan = plan(TEXT);
    let whole = run(&plan, None, &Known::new());
    let complete: HashSet<&RowKey> = whole.complete.iter().collect();
    assert_eq!(
        (complete.len(), whole.complete.len()),
        (plan.rows(), plan.rows())
    );
    let order: Vec<RowKey> = listed(&plan);
    let place: HashMap<&RowKey, usize> = order.iter().zip(0..).collect();
    // Material by material, each as in the results.
    let of: HashMap<&str, &Row> = whole.rows.iter().map(|r| (r.key.as_str(), r)).collect();
    for material in &plan.materials {
        let mine = whole.complete.iter();
        let mine = mine.filter(|k| of[k.as_str()].material == material.name);
        assert!(mine.is_sorted_by_key(|k| place[k]), "{}", material.name);
    }
}

#[test]
fn materials_are_shown_to_those_who_want_them() {
    let plan = plan(TEXT);
    let names: Vec<&str> = plan.materials.iter().map(|m| m.name.as_str()).collect();
    let whole = run(&plan, None, &Known::new());
    assert!(whole.loaded.is_empty());
    // Also if all rows are there.
    for known in [Known::new(), known(&whole.rows)] {
        let mut keep = Keep {
            curious: true,
            ..Keep::default()
        };
        plan.run(&Extent::default(), &known, &mut keep).unwrap();
        assert_eq!(keep.loaded, names);
        assert_eq!(keep.rows.len() + known.len(), plan.rows());
    }
}

#[test]
fn a_key_changes_with_what_determines_the_row_and_with_nothing_else() {
    let keys_of = |text: &str| listed(&plan(text));
    let all: HashSet<RowKey> = keys_of(TEXT).into_iter().collect();
    let n = all.len();
    assert_eq!(n, keys_of(TEXT).len(), "no two rows share a key");
    // How many keys are kept.
    for (from, to, kept) in [
        ("budgets = [80, 200]", "budgets = [80, 200, 300]", n),
        ("budgets = [80, 200]", "budgets = [200, 80]", n),
        ("budgets = [80, 200]", "budgets = [200]", n / 2),
        ("seeds = [1, 2]", "seeds = [2, 3]", n / 2),
        (
            "\nalpha = 0.3",
            "\nalpha = 0.3\nname = \"other\"",
            3 * n / 4,
        ),
        ("\nalpha = 0.3", "\nalpha = 0.31", 3 * n / 4),
        ("pairs = 700", "pairs = 701", 0),
        ("neighbours = 16", "neighbours = 17", 2 * n / 3),
        ("h_bar = \"square-root\"", "h_bar = \"arcsine\"", n / 2),
    ] {
        assert!(TEXT.contains(from));
        let other = keys_of(&TEXT.replace(from, to));
        let common = other.iter().filter(|k| all.contains(*k)).count();
        assert_eq!(common, kept, "{to}");
    }
}

#[test]
fn shards_share_the_work_and_leave_nothing_out() {
    let plan = plan(TEXT);
    let all: HashSet<RowKey> = keys(&rows(&plan));
    for of in [1, 2, 3, 7] {
        let mut found = HashSet::new();
        let mut sizes = Vec::new();
        for part in 1..=of {
            let rows = run(&plan, Some(Shard { part, of }), &Known::new()).rows;
            sizes.push(rows.len());
            for key in keys(&rows) {
                assert!(found.insert(key), "{part}/{of}");
            }
        }
        assert_eq!(found, all);
        // Of equal schedules no part has more than one more.
        let each = plan.rows() / plan.units().len();
        let (least, most) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
        assert!(most - least <= each, "{sizes:?}");
    }
}

#[test]
fn materials_of_few_schedules_are_shared_out() {
    let text = TEXT.replace("[80, 200]", "[80]").replace("[1, 2]", "[1]");
    let plan = plan(&text);
    assert_eq!((plan.units().len(), plan.materials.len()), (2, 4));
    let all: HashSet<RowKey> = keys(&rows(&plan));
    // Schedules of a part, and materials of each.
    for (of, most) in [(2, 4), (4, 2), (6, 2), (8, 1), (50, 1)] {
        let mut found = HashSet::new();
        let mut busy = 0;
        for part in 1..=of {
            let kept = run(&plan, Some(Shard { part, of }), &Known::new());
            assert!((kept.announced - kept.work).abs() < 1e-9 * kept.announced.max(1.0));
            let materials: HashSet<_> = kept.rows.iter().map(|r| r.material.clone()).collect();
            assert!(materials.len() <= most, "{part}/{of}");
            busy += usize::from(!kept.rows.is_empty());
            for key in keys(&kept.rows) {
                assert!(found.insert(key), "{part}/{of}");
            }
        }
        assert_eq!((found, busy), (all.clone(), of.min(8)));
    }
}

#[test]
fn a_file_that_is_replaced_under_way_is_told() {
    /// Replaces the file as soon as it was hashed.
    struct Swap(std::path::PathBuf, Vec<String>, usize);
    impl Observer<Row> for Swap {
        fn observe(&mut self, event: &Event<'_, Row>) -> Result<(), Error> {
            match event {
                Event::Doing(what) if what.to_string().starts_with("loading") => {
                    fs::write(&self.0, table(0.2)).unwrap();
                }
                Event::Failed(failure) => self.1.push(failure.reason.clone()),
                Event::Made(rows) => self.2 += rows.len(),
                _ => {}
            }
            Ok(())
        }
    }
    fn table(value: f64) -> Vec<u8> {
        (0..3 * 288 * 288)
            .flat_map(|_| value.to_le_bytes())
            .collect()
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bin");
    fs::write(&path, table(0.1)).unwrap();
    let text = format!(
        "budgets = [60]\n[[material]]\nkind = \"utia\"\npath = {:?}\n[[material]]\nkind = \"lambert\"",
        path.display().to_string()
    );
    let plan = plan(&text);
    let mut swap = Swap(path, Vec::new(), 0);
    let summary = plan
        .run(&Extent::default(), &Known::new(), &mut swap)
        .unwrap();
    assert!(
        swap.1.len() == 1 && swap.1[0].contains("replaced"),
        "{:?}",
        swap.1
    );
    // Nothing of the table, everything of the other material.
    assert_eq!((2 * swap.2, summary.failures.len()), (plan.rows(), 1));
}

#[test]
fn a_lighting_is_that_of_its_key() {
    /// Replaces the panorama before a material, or after it.
    struct Swap {
        path: std::path::PathBuf,
        before: usize,
        materials: usize,
        failures: Vec<String>,
        records: usize,
    }
    impl Observer<MaterialRelations> for Swap {
        fn observe(&mut self, event: &Event<'_, MaterialRelations>) -> Result<(), Error> {
            match event {
                Event::Doing(_) => {
                    if self.materials == self.before {
                        fs::write(&self.path, panorama(200)).unwrap();
                    }
                    self.materials += 1;
                }
                Event::Failed(failure) => self.failures.push(failure.reason.clone()),
                Event::Made(records) => self.records += records.len(),
                _ => {}
            }
            Ok(())
        }
    }
    /// A Radiance picture of 4 × 2 pixels of one grey.
    fn panorama(grey: u8) -> Vec<u8> {
        let head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
        let pixels = [grey, grey, grey, 128].repeat(8);
        [head.as_bytes(), &pixels].concat()
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.hdr");
    // Before the first material both are of other light than their keys; before the second the
    // light that they mean is there.
    for (before, records) in [(0, 0), (1, 2)] {
        fs::write(&path, panorama(100)).unwrap();
        let text = format!(
            "experiment = \"relations\"\n\
             [moments]\norder = 2\nviews = 5\n\
             estimator = {{ kind = \"peak-resolving\", tolerance = 1e-2 }}\n\
             [relations]\nviews_deg = [30]\ntolerance = 1e-2\n\
             [[lighting]]\nkind = \"map\"\npath = {:?}\n\
             [[material]]\nkind = \"ggx\"\nalpha = 0.6\n[[material]]\nkind = \"ggx\"\nalpha = 0.5\n",
            path.display().to_string()
        );
        let plan = RelationsPlan::read(&Source::new("c.toml", text)).unwrap();
        let mut swap = Swap {
            path: path.clone(),
            before,
            materials: 0,
            failures: Vec::new(),
            records: 0,
        };
        let (extent, known) = (Extent::default(), Known::new());
        plan.run(&extent, &known, &mut swap).unwrap();
        assert_eq!((swap.records, swap.failures.len()), (records, 2 - records));
        assert!(
            swap.failures
                .iter()
                .all(|reason| reason.contains("replaced"))
        );
    }
}

/// Pairs are added until the cosine measure is known, with its parts beside it or not; what is left of these is
/// told.
fn parts_of_a_measure_are_not_waited_for(level: Level) {
    let text = TEXT.replace(
        "max_pairs = 1\n",
        &format!("max_pairs = {}\n", level.of(10_000, 20_000)),
    );
    let with = |measures: &str| {
        let plan = plan(&text.replace(
            r#"measures = ["cosine", "lobe"]"#,
            &format!("measures = {measures}"),
        ));
        let mut rows = timeless(&plan, &rows(&plan));
        rows.iter_mut().for_each(|r| r.key = RowKey::default());
        rows
    };
    let all = with("[\"cosine\", \"steep\", \"grazing\"]");
    let cosine: Vec<Row> = all
        .iter()
        .filter(|r| r.measure == "cosine")
        .cloned()
        .collect();
    assert!(cosine == with("[\"cosine\"]"));
    // Rows of a reconstruction follow each other.
    let is_left = |of: &[Row]| of[0].converged && of[1..].iter().any(|r| !r.converged);
    assert!(all.chunks(3).any(is_left));
    // Alone a part is waited for.
    let grazing = with("[\"grazing\"]");
    let pairs = |rows: &[Row]| rows.iter().map(|r| r.pairs).sum::<usize>();
    assert!(pairs(&grazing) > pairs(&cosine));
}

#[test]
fn any_number_of_threads_gives_the_same_rows() {
    let plan = plan(TEXT);
    let [one, two] = [1, 2].map(|threads| {
        let rows = crate::common::on_threads(threads, || rows(&plan));
        timeless(&plan, &rows)
    });
    assert!(one == two);
}

#[test]
fn scattered_reconstructions_are_made_in_every_coordinates_and_where_they_are_asked_for() {
    let text = r#"
budgets = [60, 150]

[[material]]
kind = "ggx"
alpha = 0.5

[[parametrization]]
kind = "hybrid"

[[sample_set]]
kind = "grid"

[[sample_set]]
kind = "sobol"

[[reconstruction]]
kind = "cubic"

[[reconstruction]]
kind = "inverse-distance"
on = "sobol"
up_to = 100

[[coordinates]]
kind = "own"

[[coordinates]]
kind = "half-difference"

[metrics]
pairs = 200
max_pairs = 1
"#;
    let plan = plan(text);
    let rows = rows(&plan);
    let mut found: Vec<_> = rows
        .iter()
        .filter(|r| r.measure == "cosine")
        .map(|r| {
            (
                r.sample_set.as_str(),
                r.reconstruction.as_str(),
                r.coordinates.as_str(),
                r.budget,
            )
        })
        .collect();
    found.sort_unstable();
    let mut expected = vec![
        ("grid", "cubic", "own", 60),
        ("grid", "cubic", "own", 150),
        ("sobol", "inverse-distance", "half-difference", 60),
        ("sobol", "inverse-distance", "own", 60),
    ];
    expected.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(plan.rows(), 8);
    // The resolved config is this study again.
    let resolved = toml::to_string(&plan.resolved).unwrap();
    let again = Plan::read(&Source::new("again", resolved)).unwrap();
    assert_eq!(again.resolved, plan.resolved);
    assert_eq!(listed(&again), listed(&plan));
}

/// Rows whose errors are a product of one factor a choice and one a material.
fn product(factor: impl Fn(&str, &str, usize) -> f64) -> Vec<Row> {
    let plan = plan(
        r#"
budgets = [100, 1000]
measures = ["cosine"]

[[material]]
kind = "lambert"

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "hybrid"

[[parametrization]]
kind = "spherical"

[[reconstruction]]
kind = "cubic"

[metrics]
pairs = 10
max_pairs = 1
"#,
    );
    let made = rows(&plan);
    let mut rows = Vec::new();
    for m in 0..12 {
        for row in &made {
            let difficulty = 1.0 + f64::from(m * m);
            let error = factor(&row.parametrization, &row.reconstruction, m as usize);
            let error = difficulty * error / row.budget as f64;
            let mut row = Row {
                material: format!("m{m}"),
                truth: if m < 6 { "a".into() } else { "b".into() },
                readings: row.budget,
                ..row.clone()
            };
            row.quantities.set("nrmse", Some(error));
            row.quantities.set("log_relative", Some(error));
            rows.push(row);
        }
    }
    rows
}

#[test]
fn findings_are_those_of_the_factors() {
    let rows = product(|parametrization, _, m| match parametrization {
        "hybrid" => 2.0,
        // Better on half of the materials, and a little more worse on the others.
        "spherical" => [0.5, 2.2][m % 2],
        _ => 1.0,
    });
    let rows: Vec<&Row> = rows.iter().collect();
    let findings = Findings::new(&rows, 1.05);
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
    assert!((hybrid.order.unwrap().slope + 1.0).abs() < 1e-12);
    let cell = hybrid.cells[0].unwrap();
    assert_eq!(cell.place, Some(3));
    let duel = cell.against_best.unwrap();
    assert!(
        (duel.ratio - 2.0).abs() < 1e-12 && duel.losses == 12,
        "{duel}"
    );
    let duels = findings
        .duels
        .iter()
        .find(|d| d.scope == ranking.scope)
        .unwrap();
    let spherical = duels
        .duels
        .iter()
        .find(|d| d.a.parametrization == "spherical" && d.b.parametrization == "half-difference")
        .unwrap();
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
    let total: f64 = shares.mains.iter().sum::<f64>()
        + shares.pairs.iter().map(|p| p.2).sum::<f64>()
        + shares.rest;
    assert!((total - 1.0).abs() < 1e-9, "{total}");
}

#[test]
fn ratios_over_all_budgets_are_of_mean_errors() {
    // Twice as much at the first budget, eight times at the second; one material lacks the second.
    let mut rows = product(|_, _, _| 1.0);
    for row in rows.iter_mut().filter(|r| r.parametrization == "hybrid") {
        let factor = if row.budget == 100 { 2.0 } else { 8.0 };
        let error = row.value("nrmse").map(|e| e * factor);
        let is_lacking = row.material == "m3" && row.budget == 1000;
        row.quantities.set("nrmse", error.filter(|_| !is_lacking));
    }
    let overall = |rows: &[&Row]| {
        let findings = Findings::new(rows, 1.05);
        let mut duels = findings.duels[0].duels.iter();
        let of = duels.find(|d| d.a.parametrization == "hybrid");
        of.unwrap().overall
    };
    let all: Vec<&Row> = rows.iter().collect();
    let found = overall(&all).unwrap();
    assert!((found.ratio - 4.0).abs() < 1e-12, "{found}");
    assert_eq!((found.n, found.losses), (11, 11));
    // At one budget there is nothing to bring together.
    let first: Vec<&Row> = rows.iter().filter(|r| r.budget == 100).collect();
    assert_eq!(overall(&first), None);
}

/// Errors fall as a power of the readings, each with its own exponent, and one choice takes fewer readings than
/// it may: ratios are those at the fewer, and at the first budget, where nothing is below, at the more.
#[test]
fn ratios_are_at_equal_readings() {
    let mut rows = product(|_, _, _| 1.0);
    let exponent = |material: &str| 0.4 + 0.05 * material[1..].parse::<f64>().unwrap();
    for row in &mut rows {
        let hybrid = row.parametrization == "hybrid";
        let share = if hybrid { 0.9 } else { 1.0 };
        row.readings = (share * row.budget as f64) as usize;
        let error = (row.readings as f64).powf(-exponent(&row.material));
        row.quantities
            .set("nrmse", Some(if hybrid { 3.0 * error } else { error }));
    }
    let ratios = |rows: &[Row]| {
        let rows: Vec<&Row> = rows.iter().collect();
        let findings = Findings::new(&rows, 1.05);
        let mut duels = findings.duels[0].duels.iter();
        let duel = duels.find(|d| d.a.parametrization == "hybrid").unwrap();
        let cells = duel.cells.iter().copied().chain([duel.overall]);
        cells.map(|c| c.unwrap().ratio).collect::<Vec<_>>()
    };
    for ratio in ratios(&rows) {
        assert!((ratio - 3.0).abs() < 1e-12, "{ratio}");
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
    let rows = product(|parametrization, _, _| {
        if parametrization == "hybrid" {
            2.0
        } else {
            1.0
        }
    });
    let mut twice = rows.clone();
    // A second seed whose errors are twice as large: the mean is sqrt 2 larger, n stays.
    twice.extend(rows.iter().map(|r| {
        let mut other = Row {
            seed: 7,
            ..r.clone()
        };
        let error = r.value("nrmse").map(|e| 2.0 * e);
        other.quantities.set("nrmse", error);
        other
    }));
    let means = [&rows, &twice].map(|rows| {
        let rows: Vec<&Row> = rows.iter().collect();
        let findings = Findings::new(&rows, 1.05);
        let ranking = findings
            .ranking(Metric::Nrmse, "cosine", None)
            .unwrap()
            .clone();
        let cell = ranking.lines[1].cells[0].unwrap();
        assert_eq!(cell.against_best.unwrap().n, 12);
        cell.mean
    });
    assert!((means[1] / means[0] - 2f64.sqrt()).abs() < 1e-12);
}

#[test]
fn mistakes_are_told_with_their_place() {
    let refused = |from: &str, to: &str| {
        assert!(TEXT.contains(from));
        let text = format!("experiment = \"study\"\n{}", TEXT.replace(from, to));
        match Plan::read(&Source::new("c.toml", text)) {
            Ok(_) => panic!("accepted {to}"),
            Err(e) => {
                assert_eq!(e.exit_code(), 2, "{e}");
                e.to_string()
            }
        }
    };
    for [from, to, parts] in table(
        r#"
        neighbours = 16 | up_to = 0 | reconstruction[2].up_to = 0 … from 1 to
        neighbours = 16 | up_to = 79 | reconstruction[2] … never used
        neighbours = 16 | on = "nowhere" | reconstruction[2].on … allowed: grid
        seeds = [1, 2] | band = 0.9 | band = 0.9 … [1, 10]
        [metrics] | [pictures]\nsamples = 0\n\n[metrics] | pictures.samples = 0 … 65536
        [metrics] | [[coordinates]]\nkind = "polar"\n\n[metrics] | polar … own
        [metrics] | [[coordinates]]\nkind = "hybrid"\nwarp = { theta_h = "merl" }\n\n[metrics] | theta_h … allowed
        [metrics] | [coordinate]\n\n[metrics] | unknown key coordinate … coordinates"#,
    ) {
        let message = refused(from, to);
        says(&message, parts);
        assert!(message.starts_with("c.toml"), "{message}");
    }
    for text in ["0/4", "5/4", "1", "a/b", "1/0", "1/100001"] {
        let refusal = text.parse::<Shard>().unwrap_err().to_string();
        assert!(refusal.contains("1 <= i <= n"), "{text}");
    }
}

#[test]
fn warps_are_paired_by_their_place() {
    let rows = product(|_, _, _| 1.0);
    let with = |row: &Row, warp: &str| Row {
        warp: warp.into(),
        ..row.clone()
    };
    // half-difference: none, a; hybrid: none, b, c; spherical: none.
    let rows: Vec<Row> = rows
        .iter()
        .flat_map(|r| match r.parametrization.as_str() {
            "half-difference" => vec![r.clone(), with(r, "a")],
            "hybrid" => vec![r.clone(), with(r, "b"), with(r, "c")],
            _ => vec![r.clone()],
        })
        .collect();
    let rows: Vec<&Row> = rows.iter().collect();
    let findings = Findings::new(&rows, 1.05);
    let of = |a: &str, b: &str| {
        let duels = findings.duels[0].duels.iter();
        let between = duels.filter(|d| d.a.parametrization == a && d.b.parametrization == b);
        let mut warps: Vec<_> = between
            .map(|d| (d.b.warp.as_str(), d.a.warp.as_str()))
            .collect();
        warps.sort_unstable();
        warps
    };
    assert_eq!(
        of("hybrid", "half-difference"),
        [("a", "b"), ("a", "c"), ("none", "none")]
    );
    assert_eq!(
        of("spherical", "half-difference"),
        [("a", "none"), ("none", "none")]
    );
}

#[test]
fn materials_that_tell_nothing_are_left_out_and_named() {
    let rows = product(|parametrization, _, _| {
        if parametrization == "hybrid" {
            2.0
        } else {
            1.0
        }
    });
    let with = |name: &str, error: Option<f64>| -> Vec<Row> {
        let first = rows.iter().filter(|r| r.material == "m0");
        let other = first.map(|r| {
            let mut other = Row {
                material: name.into(),
                ..r.clone()
            };
            other.quantities.set("nrmse", error);
            other
        });
        other.collect()
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
    let [plain, more] = [&rows, &more].map(|rows| {
        let rows: Vec<&Row> = rows.iter().collect();
        Findings::new(&rows, 1.05)
    });
    let of = |findings: &Findings| {
        findings
            .ranking(Metric::Nrmse, "cosine", None)
            .unwrap()
            .clone()
    };
    assert_eq!(of(&plain).lines, of(&more).lines);
    assert_eq!(of(&more).scope.materials, 12);
    assert_eq!(
        of(&more).scope.left_out,
        [
            "exact (exact by a choice)",
            "by-one (exact by a choice)",
            "black (no error is defined)"
        ]
    );
    // By the other error they are compared.
    let other = more.ranking(Metric::LogRelative, "cosine", None).unwrap();
    assert_eq!(other.scope.materials, 15);
}

/// Every stage of a run: schedules of both kinds, an instrument with its noise, reconstructions that
/// do and do not need a grid, all quantities.
const GOLDEN: &str = r#"
quantities = ["albedo", "moments"]
budgets = [150]
measures = ["lobe"]

[[material]]
kind = "ggx"
alpha = 0.3

[[material]]
kind = "ward"
alpha = [0.2, 0.5]

[[parametrization]]
kind = "half-difference"
warp = { theta_h = "square-root" }

[[parametrization]]
kind = "hybrid"

[[parametrization]]
kind = "spherical"

[[parametrization]]
kind = "stark"

[[sample_set]]
kind = "grid"

[[sample_set]]
kind = "sobol"

[[reconstruction]]
kind = "cubic"

[[reconstruction]]
kind = "inverse-distance"

[[reconstruction]]
kind = "thin-plate"
neighbours = 12

[[instrument]]
preset = "utia"

[metrics]
pairs = 300
max_pairs = 1

[moments]
views = 3
order = 3
estimator = { kind = "sobol", samples = 256 }
"#;

/// What a row says but for its keys, which differ wherever a config may say more, and the clock.
fn told(row: &Row) -> Map<String, Value> {
    let Value::Object(mut columns) = serde_json::to_value(row).unwrap() else {
        panic!("a row is no object");
    };
    columns.retain(|name, _| {
        let timed = name.ends_with("_seconds") && name != "instrument_seconds";
        !timed && name != "key" && name != "material_key"
    });
    columns
}

/// The same but for rounding, which is that of the machine.
fn agree(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-12 + 1e-9 * a.abs().max(b.abs()),
        _ => a == b,
    }
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
    let rows = run(&plan(text), None, &Known::new()).rows;
    let expected = |row: &Row| row.value("expected_nrmse");
    assert!(
        rows.iter()
            .all(|row| expected(row).is_some() == (row.reconstruction == "kriging"))
    );
    let findings = Findings::new(&rows.iter().collect::<Vec<_>>(), 1.0);
    // Two errors under two measures, of one of the two reconstructions.
    assert_eq!(findings.calibrations.len(), 4);
    for calibration in &findings.calibrations {
        let name = calibration.metric.name();
        assert_eq!(calibration.choice.reconstruction, "kriging");
        for (cell, allowed) in calibration.cells.iter().zip(["12 poses", "40 poses"]) {
            let cell = cell.unwrap();
            let mut of_materials: Vec<f64> = ["ggx-0.3", "ggx-0.1", "ward-0.2"]
                .iter()
                .map(|material| {
                    let mine = rows.iter().filter(|row| {
                        row.material == *material
                            && row.reconstruction == "kriging"
                            && (row.measure.as_str(), row.allowed.as_str())
                                == (calibration.measure.as_str(), allowed)
                    });
                    let ratios: Vec<f64> = mine
                        .map(|row| {
                            let expected = row.value(&format!("expected_{name}")).unwrap();
                            row.value(name).unwrap() / expected
                        })
                        .collect();
                    assert_eq!(ratios.len(), 2, "{material}");
                    (ratios[0] * ratios[1]).sqrt()
                })
                .collect();
            of_materials.sort_by(f64::total_cmp);
            assert_eq!((cell.count, cell.ninth), (3, None));
            assert!((cell.median / of_materials[1] - 1.0).abs() < 1e-12);
            assert_eq!(cell.below.is_some(), calibration.measure == "cosine");
        }
    }
}

#[test]
fn numbers_change_with_their_revision_only() {
    let plan = plan(GOLDEN);
    let today: Vec<Map<String, Value>> = timeless(&plan, &rows(&plan)).iter().map(told).collect();
    assert_eq!(today.len(), plan.rows());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/rows.jsonl");
    if std::env::var_os("GONIO_BLESS").is_some() {
        let mut lines = json!({ "revision": RESULTS_REVISION }).to_string() + "\n";
        for row in &today {
            lines += &(serde_json::to_string(row).unwrap() + "\n");
        }
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, lines).unwrap();
    }
    let golden = fs::read_to_string(&path).unwrap();
    let mut golden = golden.lines().map(|l| serde_json::from_str(l).unwrap());
    let head: Map<String, Value> = golden.next().unwrap();
    let golden: Vec<Map<String, Value>> = golden.collect();
    let again = "make tests/golden/rows.jsonl again with GONIO_BLESS=1";
    assert_eq!(
        head["revision"], RESULTS_REVISION,
        "the golden rows are of another revision than RESULTS_REVISION: {again}"
    );
    let revise = format!("raise RESULTS_REVISION, and {again}");
    assert_eq!(
        golden.len(),
        today.len(),
        "there are other rows than there were: {revise}"
    );
    for (then, now) in golden.iter().zip(&today) {
        assert!(
            then.keys().eq(now.keys()),
            "rows have other columns than they had: {revise}"
        );
        let of = [
            "material",
            "parametrization",
            "sample_set",
            "reconstruction",
        ];
        let row = of.map(|name| now[name].to_string()).join(", ");
        for ((name, then), now) in then.iter().zip(now.values()) {
            assert!(
                agree(then, now),
                "{name} of {row} is {now} and was {then}: {revise}"
            );
        }
    }
}
