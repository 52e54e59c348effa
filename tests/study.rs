//! Studies: their rows are those of an acquisition, they are made once, their findings are those of
//! errors that are known.

use gonio::Error;
use gonio::brdf::Brdf;
use gonio::experiment::study::{
    Factor, Findings, Metric, RowKey, Shard, StudyObserver, StudyPlan, StudyRow, jobs, study,
};
use gonio::experiment::{self, Config, Failure, Material, Observer, Plan, Row, Source};
use std::collections::{HashMap, HashSet};

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
"#;

fn plan(text: &str) -> StudyPlan {
    let text = format!("experiment = \"study\"\n{text}");
    StudyPlan::read(&Source::new("c.toml", text)).unwrap()
}

#[derive(Default)]
struct Keep {
    rows: Vec<StudyRow>,
    loaded: Vec<String>,
    jobs: usize,
    /// Stops when there are so many rows.
    stop_at: Option<usize>,
}

impl StudyObserver for Keep {
    fn cancelled(&self) -> bool {
        self.stop_at.is_some_and(|n| self.rows.len() >= n)
    }
    fn stage(&mut self, _what: &str) {}
    fn loaded(&mut self, material: &Material, _: &dyn Brdf, _: &str) -> Result<(), Error> {
        self.loaded.push(material.name.clone());
        Ok(())
    }
    fn rows(&mut self, rows: Vec<StudyRow>) -> Result<(), Error> {
        self.rows.extend(rows);
        Ok(())
    }
    fn failed(&mut self, failure: &Failure) {
        panic!("{failure:?}");
    }
    fn advanced(&mut self, jobs: usize) {
        self.jobs += jobs;
    }
}

fn run(plan: &StudyPlan, shard: Option<Shard>, known: &HashSet<RowKey>) -> Keep {
    let mut keep = Keep::default();
    study(plan, shard, known, &mut keep).unwrap();
    keep
}

fn keys(rows: &[StudyRow]) -> HashSet<RowKey> {
    rows.iter().map(|r| r.key.clone()).collect()
}

/// Without what depends on the clock of this computer.
fn timeless(rows: &[StudyRow]) -> Vec<StudyRow> {
    let strip = |r: &StudyRow| StudyRow {
        plan_seconds: 0.0,
        measure_seconds: 0.0,
        reconstruct_seconds: 0.0,
        evaluate_seconds: 0.0,
        ..r.clone()
    };
    rows.iter().map(strip).collect()
}

#[test]
fn rows_are_those_of_an_acquisition_to_the_bit() {
    // Materials one by one and all together: weights are shared, values are not.
    struct Rows(Vec<Row>);
    impl Observer for Rows {
        fn rows(&mut self, rows: Vec<Row>) -> Result<(), Error> {
            self.0.extend(rows);
            Ok(())
        }
    }
    let source = Source::new("c.toml", TEXT);
    let acquisition = Plan::new(Config::read(&source).unwrap()).unwrap();
    let mut one_by_one = Rows(Vec::new());
    experiment::run(&acquisition, &mut one_by_one).unwrap();
    let plan = plan(TEXT);
    let together = run(&plan, None, &HashSet::new()).rows;
    assert_eq!(together.len(), plan.rows());
    assert_eq!(together.len(), one_by_one.0.len());
    let label = |r: &StudyRow| {
        let name = &r.reconstruction;
        format!(
            "{} {} {name} {} {} {}",
            r.material, r.parametrization, r.budget, r.seed, r.measure
        )
    };
    let known: HashMap<String, &StudyRow> = together.iter().map(|r| (label(r), r)).collect();
    assert_eq!(known.len(), together.len());
    for row in &one_by_one.0 {
        let name = &row.reconstruction;
        let label = format!(
            "{} {} {name} {} {} {}",
            row.material, row.parametrization, row.budget, row.seed, row.measure
        );
        let other = known[&label];
        let errors = [
            row.nrmse,
            row.log_relative,
            row.log1p,
            row.cbrt,
            row.max_relative,
        ];
        let others = [
            other.nrmse,
            other.log_relative,
            other.log1p,
            other.cbrt,
            other.max_relative,
        ];
        assert_eq!(errors, others, "{label}");
        assert_eq!((row.readings, row.pairs), (other.readings, other.pairs));
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
    std::fs::write(&path, bytes).unwrap();
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
"#
    );
    let rows = run(&plan(&text), None, &HashSet::new()).rows;
    assert_eq!(rows.len(), 2);
    let of = |name: &str| rows.iter().find(|r| r.material == name).unwrap();
    let (table, lambert) = (&rows[0], of("lambert"));
    assert!(table.readings < lambert.readings && table.pairs_missing > 0);
    assert!(lambert.nrmse.unwrap() < 1e-12 && lambert.pairs_missing == 0);
}

#[test]
fn what_is_known_is_not_done_again() {
    let plan = plan(TEXT);
    let whole = run(&plan, None, &HashSet::new());
    let jobs_there = jobs(&plan, None).unwrap();
    assert_eq!(whole.jobs, jobs_there.len());
    let listed: Vec<RowKey> = jobs_there.into_iter().flat_map(|j| j.keys).collect();
    assert_eq!(listed.len(), plan.rows());
    let all = keys(&whole.rows);
    assert_eq!(all, listed.iter().cloned().collect());
    let again = run(&plan, None, &all);
    assert!(again.rows.is_empty() && again.loaded.is_empty());
    assert_eq!(again.jobs, whole.jobs);
    // Stopped somewhere and gone on, in any state: the same rows.
    for stop_at in [1, 40, 101] {
        let mut first = Keep {
            stop_at: Some(stop_at),
            ..Keep::default()
        };
        let summary = study(&plan, None, &HashSet::new(), &mut first).unwrap();
        assert!(summary.interrupted && first.rows.len() >= stop_at);
        let rest = run(&plan, None, &keys(&first.rows));
        assert_eq!(first.rows.len() + rest.rows.len(), whole.rows.len());
        let mut rows = [first.rows, rest.rows].concat();
        let place: HashMap<&RowKey, usize> = listed.iter().zip(0..).collect();
        let sort = |rows: &mut Vec<StudyRow>| rows.sort_by_key(|r| place[&r.key]);
        sort(&mut rows);
        let mut expected = whole.rows.clone();
        sort(&mut expected);
        let errors = |rows: &[StudyRow]| -> Vec<_> { rows.iter().map(|r| r.nrmse).collect() };
        assert_eq!(errors(&rows), errors(&expected));
    }
}

#[test]
fn a_key_changes_with_what_determines_the_row_and_with_nothing_else() {
    let keys_of = |text: &str| -> Vec<RowKey> {
        let jobs = jobs(&plan(text), None).unwrap();
        jobs.into_iter().flat_map(|j| j.keys).collect()
    };
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
    let all: HashSet<RowKey> = keys(&run(&plan, None, &HashSet::new()).rows);
    for of in [1, 2, 3, 7] {
        let mut found = HashSet::new();
        let mut sizes = Vec::new();
        for part in 1..=of {
            let rows = run(&plan, Some(Shard { part, of }), &HashSet::new()).rows;
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
fn any_number_of_threads_gives_the_same_rows() {
    let plan = plan(TEXT);
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let rows = pool
            .unwrap()
            .install(|| run(&plan, None, &HashSet::new()).rows);
        timeless(&rows)
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
"#;
    let plan = plan(text);
    let rows = run(&plan, None, &HashSet::new()).rows;
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
    let again = StudyPlan::read(&Source::new("again", resolved)).unwrap();
    assert_eq!(again.resolved, plan.resolved);
    let listed = |plan: &StudyPlan| -> Vec<RowKey> {
        let jobs = jobs(plan, None).unwrap();
        jobs.into_iter().flat_map(|j| j.keys).collect()
    };
    assert_eq!(listed(&again), listed(&plan));
}

/// Rows whose errors are a product of one factor a choice and one a material.
fn product(factor: impl Fn(&str, &str, usize) -> f64) -> Vec<StudyRow> {
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
"#,
    );
    let made = run(&plan, None, &HashSet::new()).rows;
    let mut rows = Vec::new();
    for m in 0..12 {
        for row in &made {
            let difficulty = 1.0 + f64::from(m * m);
            let error = factor(&row.parametrization, &row.reconstruction, m as usize);
            let error = difficulty * error / row.budget as f64;
            rows.push(StudyRow {
                material: format!("m{m}"),
                truth: if m < 6 { "a".into() } else { "b".into() },
                readings: row.budget,
                nrmse: Some(error),
                log_relative: Some(error),
                ..row.clone()
            });
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
    let rows: Vec<&StudyRow> = rows.iter().collect();
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
        .find(|d| {
            d.factor == Factor::Sampling
                && d.a.parametrization == "spherical"
                && d.b.parametrization == "half-difference"
        })
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
    twice.extend(rows.iter().map(|r| StudyRow {
        seed: 7,
        nrmse: r.nrmse.map(|e| 2.0 * e),
        ..r.clone()
    }));
    let means = [&rows, &twice].map(|rows| {
        let rows: Vec<&StudyRow> = rows.iter().collect();
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
        match StudyPlan::read(&Source::new("c.toml", text)) {
            Ok(_) => panic!("accepted {to}"),
            Err(e) => {
                assert_eq!(e.exit_code(), 2, "{e}");
                e.to_string()
            }
        }
    };
    for (from, to, parts) in [
        (
            "neighbours = 16",
            "up_to = 0",
            ["reconstruction[2].up_to = 0", "from 1 to"],
        ),
        (
            "neighbours = 16",
            "up_to = 79",
            ["reconstruction[2]", "never used"],
        ),
        (
            "neighbours = 16",
            "on = \"nowhere\"",
            ["reconstruction[2].on", "allowed: grid"],
        ),
        ("seeds = [1, 2]", "band = 0.9", ["band = 0.9", "[1, 10]"]),
        (
            "seeds = [1, 2]",
            "channels = \"rgb\"",
            ["channels", "luminance"],
        ),
        (
            "seeds = [1, 2]",
            "quantities = [\"moments\"]",
            ["quantities", "study"],
        ),
        (
            "[metrics]",
            "[output]\nslices = true\n\n[metrics]",
            ["output", "slices = false"],
        ),
        (
            "[metrics]",
            "[pictures]\nsamples = 0\n\n[metrics]",
            ["pictures.samples = 0", "65536"],
        ),
        (
            "[metrics]",
            "[[coordinates]]\nkind = \"polar\"\n\n[metrics]",
            ["polar", "own"],
        ),
        (
            "[metrics]",
            "[[coordinates]]\nkind = \"hybrid\"\nwarp = { theta_h = \"merl\" }\n\n[metrics]",
            ["theta_h", "allowed"],
        ),
        (
            "[metrics]",
            "[coordinate]\n\n[metrics]",
            ["unknown key coordinate", "coordinates"],
        ),
    ] {
        let message = refused(from, to);
        for part in parts {
            assert!(message.contains(part), "{to}: {message}");
        }
        assert!(message.starts_with("c.toml"), "{message}");
    }
    for text in ["0/4", "5/4", "1", "a/b", "1/0", "1/100001"] {
        assert!(
            text.parse::<Shard>().unwrap_err().contains("1 <= i <= n"),
            "{text}"
        );
    }
}

#[test]
fn warps_are_paired_by_their_place() {
    let rows = product(|_, _, _| 1.0);
    let with = |row: &StudyRow, warp: &str| StudyRow {
        warp: warp.into(),
        ..row.clone()
    };
    // half-difference: none, a; hybrid: none, b, c; spherical: none.
    let rows: Vec<StudyRow> = rows
        .iter()
        .flat_map(|r| match r.parametrization.as_str() {
            "half-difference" => vec![r.clone(), with(r, "a")],
            "hybrid" => vec![r.clone(), with(r, "b"), with(r, "c")],
            _ => vec![r.clone()],
        })
        .collect();
    let rows: Vec<&StudyRow> = rows.iter().collect();
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
    let with = |name: &str, error: Option<f64>| -> Vec<StudyRow> {
        let first = rows.iter().filter(|r| r.material == "m0");
        let other = first.map(|r| StudyRow {
            material: name.into(),
            nrmse: error,
            ..r.clone()
        });
        other.collect()
    };
    let mut more = rows.clone();
    more.extend(with("exact", Some(3e-16)));
    more.extend(with("black", None));
    let [plain, more] = [&rows, &more].map(|rows| {
        let rows: Vec<&StudyRow> = rows.iter().collect();
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
            "exact (exact by every choice)",
            "black (no error is defined)"
        ]
    );
    // By the other error they are compared.
    let other = more.ranking(Metric::LogRelative, "cosine", None).unwrap();
    assert_eq!(other.scope.materials, 14);
}
