//! Studies: their rows are those of an acquisition, and they are made once.
#![cfg(feature = "experiments")]

#[path = "../common/mod.rs"]
mod common;
mod findings;

use common::{Keep, Level, edited, levels, near, says};
use gonio::Error;
use gonio::experiment::{
    AnyPlan, Duel, Event, Experiment, Extent, Findings, Known, Observer, Plan, RESULTS_REVISION,
    Row, RowKey, Shard, Source, material_key,
};
use serde_json::{Map, Value, json};
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::Path;

levels! {
    materials_together_and_alone_have_the_same_rows_to_the_bit: "thorough: all quantities and channels";
    every_measure_is_waited_for: "thorough: more pairs";
}

/// Two symmetries, grids and scattered points, a reconstruction in its own and in other coordinates.
const TEXT: &str = r#"
budgets = [80, 200]
seeds = [1, 2]
measures = ["cosine", "lobe"]
material = [
  { kind = "ggx", alpha = 0.3 },
  { kind = "ggx", alpha = 0.1 },
  { kind = "lambert" },
  { kind = "ward", alpha = [0.2, 0.5] },
]
parametrization = [
  { kind = "half-difference" },
  { kind = "hybrid", warp = { h_bar = "square-root" } },
]
sample_set = [{ kind = "grid" }]
reconstruction = [
  { kind = "multilinear" },
  { kind = "cubic" },
  { kind = "thin-plate", neighbours = 16 },
]
metrics = { pairs = 700, max_pairs = 1 }
"#;

fn plan(text: &str) -> Plan {
    let text = format!("experiment = \"study\"\n{text}");
    Plan::read(&Source::new("c.toml", text)).unwrap()
}

fn run(plan: &Plan, known: &Known<Row>) -> Keep {
    let mut keep = Keep::default();
    let summary = plan.run(&Extent::default(), known, &mut keep).unwrap();
    assert!(summary.failures.is_empty(), "{:?}", summary.failures);
    keep
}

/// What asks for the materials of a run.
fn curious() -> Keep {
    Keep {
        curious: true,
        ..Keep::default()
    }
}

/// All rows of a plan, in the order they are made.
fn rows(plan: &Plan) -> Vec<Row> {
    run(plan, &Known::new()).rows
}

/// The keys that a plan says its rows have, in the order of results.
fn listed(plan: &Plan) -> Vec<RowKey> {
    let materials = plan.materials.iter().map(|m| material_key(m).unwrap());
    let materials: Vec<RowKey> = materials.collect();
    let expected = plan.expected(None).into_iter();
    expected.map(|e| e.key(&materials[e.material])).collect()
}

fn keys(rows: &[Row]) -> HashSet<RowKey> {
    rows.iter().map(|r| r.key.clone()).collect()
}

fn known(rows: &[Row]) -> Known<Row> {
    let known = rows.iter().map(|r| (r.key.clone(), r.clone().into()));
    known.collect()
}

/// Bytes of a UTIA table that is `value` everywhere.
fn utia(value: f64) -> Vec<u8> {
    value.to_le_bytes().repeat(3 * 288 * 288)
}

/// Without what depends on the clock of this computer, in the order of results.
fn timeless(plan: &Plan, rows: &[Row]) -> Vec<Row> {
    let keys = listed(plan);
    let place: HashMap<&RowKey, usize> = keys.iter().zip(0..).collect();
    let mut rows: Vec<Row> = rows.iter().cloned().map(Row::timeless).collect();
    rows.sort_by_key(|r| place[&r.key]);
    rows
}

/// Poses that depend on no parametrization are measured once, whichever parametrizations stand beside them, and what interpolates in
/// the coordinates of a schedule does so in each of these.
#[test]
fn sample_sets_of_no_parametrization_are_measured_once() {
    let text = |parametrizations: &str, more: &str| {
        format!(
            "budgets = [60]\nmeasures = [\"cosine\"]\nmaterial = [{{ kind = \"ggx\", alpha = 0.3 }}]\n\
             parametrization = [{parametrizations}]\n\
             sample_set = [{{ kind = \"sobol\" }}, {{ kind = \"directions\" }}, {{ kind = \"random\" }}]\n\
             reconstruction = [{{ kind = \"inverse-distance\" }}, \
             {{ kind = \"kriging\", fit = false, on = [\"sobol\", \"directions\"] }}]\n{more}\n\
             metrics = {{ pairs = 500, max_pairs = 1 }}"
        )
    };
    let [half, hybrid] = [
        "{ kind = \"half-difference\" }",
        "{ kind = \"hybrid\", warp = { h_bar = \"square-root\" } }",
    ];
    let error = |row: &Row| row.value("nrmse").unwrap();
    let of = |parametrizations: &str, more: &str| {
        let plan = plan(&text(parametrizations, more));
        let rows = rows(&plan);
        assert_eq!(rows.len(), plan.rows());
        let named = rows.iter().map(|r| {
            let poses = format!("{} {}", r.parametrization, r.sample_set);
            (
                format!("{poses} {} {}", r.reconstruction, r.coordinates),
                error(r),
            )
        });
        let named: HashMap<String, f64> = named.collect();
        assert_eq!(named.len(), rows.len());
        (named, Findings::new(&rows.iter().collect::<Vec<_>>(), 1.02))
    };
    let (named, findings) = of(&format!("{half}, {hybrid}"), "");
    let (turned, _) = of(&format!("{hybrid}, {half}"), "");
    let none = [
        "none directions inverse-distance half-difference",
        "none directions inverse-distance hybrid+h_bar:square-root",
        "none directions kriging-published default",
    ];
    let unguided = named.keys().filter(|name| name.starts_with("none "));
    assert_eq!(unguided.count(), none.len());
    for name in none {
        near(turned[name], named[name], 1e-9 * named[name], name);
    }
    assert!(named.contains_key("hybrid random inverse-distance own"));
    assert!(!named.contains_key("hybrid random kriging-published default"));
    // Each with what is as it but for the guide: the same reconstruction in the same coordinates.
    let against = findings.duels[0].duels.iter();
    let against = against.filter(|d| d.b.parametrization == "none");
    let name =
        |d: &Duel| [&d.a.parametrization, &d.a.sample_set, &d.b.coordinates].map(String::from);
    let against: Vec<_> = against.map(name).collect();
    let expected = common::table(
        "
        half-difference | sobol  | half-difference
        half-difference | random | half-difference
        hybrid          | sobol  | hybrid+h_bar:square-root
        hybrid          | random | hybrid+h_bar:square-root
        half-difference | sobol  | default
        hybrid          | sobol  | default",
    );
    assert_eq!(against, expected.collect::<Vec<_>>());
    // Columns of the schedule's own coordinates are what a config that names these has.
    let (own, _) = of(half, "coordinates = [{ kind = \"own\" }]");
    let (given, _) = of(half, "coordinates = [{ kind = \"half-difference\" }]");
    for (poses, coordinates) in [
        ("half-difference sobol", "own"),
        ("none directions", "half-difference"),
    ] {
        let asked = own[&format!("{poses} kriging-published {coordinates}")];
        let named = given[&format!("{poses} kriging-published half-difference")];
        assert_eq!(asked, named, "{poses}");
    }
}

/// Readings of one material of [`TEXT`] at a time, and of all of them together.
fn materials_together_and_alone_have_the_same_rows_to_the_bit(level: Level) {
    let few = TEXT.replace("budgets = [80, 200]", "budgets = [80]");
    let few = few.replace("seeds = [1, 2]", "seeds = [1]");
    let moments = "quantities = [\"albedo\", \"moments\"]\n";
    let table = "moments = { views = 2, order = 2, estimator = { kind = \"sobol\", samples = 128 }";
    let red = format!("{table}, channels = [\"red\"] }}\n");
    let table = format!("{table} }}\n");
    let texts = [
        format!("channels = \"rgb\"\n{moments}{few}{red}"),
        few.clone(),
        TEXT.to_owned(),
        format!("channels = \"rgb\"\nquantities = [\"albedo\"]\n{TEXT}"),
        format!("{moments}{few}{table}"),
    ];
    for text in texts.into_iter().take(level.of(1, 5)) {
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
        for (quantity, asked) in [("albedo", "quantities"), ("moment_energy", "moments =")] {
            let is_told = |r: &Row| r.value(quantity).is_some() == text.contains(asked);
            assert!(together.iter().all(is_told), "{quantity} in {text}");
        }
    }
}

#[test]
fn materials_without_data_somewhere_are_not_mixed_with_others() {
    // A table that ends at 75° beside one model that does not.
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bin");
    fs::write(&path, utia(0.1)).unwrap();
    let none = "{ isotropic = false, reciprocal = false, bilateral = false }";
    let text = format!(
        "budgets = [4000]\nmeasures = [\"cosine\"]\nmetrics = {{ pairs = 300, max_pairs = 1 }}\n\
         parametrization = [{{ kind = \"spherical\" }}]\nreconstruction = [{{ kind = \"multilinear\" }}]\n\
         material = [{{ kind = \"utia\", path = {path:?} }}, {{ kind = \"lambert\", symmetry = {none} }}]\n"
    );
    let rows = rows(&plan(&text));
    assert_eq!(rows.len(), 2);
    let lambert = rows.iter().find(|r| r.material == "lambert").unwrap();
    let table = &rows[0];
    assert!(table.readings < lambert.readings && table.pairs_missing > 0);
    assert!(lambert.value("nrmse").unwrap() < 1e-12 && lambert.pairs_missing == 0);
}

#[test]
fn what_is_known_is_not_done_again() {
    let plan = plan(TEXT);
    let whole = run(&plan, &Known::new());
    let listed = listed(&plan);
    assert_eq!(listed.len(), plan.rows());
    let all = keys(&whole.rows);
    assert_eq!(all, listed.iter().cloned().collect());
    assert!(whole.announced > 0.0);
    near(whole.work / whole.announced, 1.0, 1e-12, "work");
    // One event a schedule and material, each with the key of its rows in the results.
    let complete: HashSet<&RowKey> = whole.complete.iter().collect();
    assert_eq!([complete.len(), whole.complete.len()], [plan.rows(); 2]);
    let place: HashMap<&RowKey, usize> = listed.iter().zip(0..).collect();
    let of: HashMap<&str, &Row> = whole.rows.iter().map(|r| (r.key.as_str(), r)).collect();
    for material in &plan.materials {
        let mine = whole.complete.iter();
        let mine = mine.filter(|k| of[k.as_str()].material == material.name);
        assert!(mine.is_sorted_by_key(|k| place[k]), "{}", material.name);
    }
    // Rows that exist already are events of the run too.
    let again = run(&plan, &known(&whole.rows));
    assert!(again.rows.is_empty() && again.loaded.is_empty() && whole.loaded.is_empty());
    assert_eq!(again.complete, whole.complete);
    assert_eq!(again.work, whole.work);
    // Materials are shown where they are asked for, also if all rows are there.
    let names: Vec<&str> = plan.materials.iter().map(|m| m.name.as_str()).collect();
    for known in [Known::new(), known(&whole.rows)] {
        let mut keep = curious();
        plan.run(&Extent::default(), &known, &mut keep).unwrap();
        assert_eq!(keep.loaded, names);
        assert_eq!(keep.rows.len() + known.len(), plan.rows());
    }
    // Stopped somewhere and gone on, in any state: the same rows.
    for stop_at in [1, 40, 101] {
        let mut first = Keep {
            stop_at: Some(stop_at),
            ..Keep::default()
        };
        let summary = plan.run(&Extent::default(), &Known::new(), &mut first);
        assert!(summary.unwrap().interrupted && first.rows.len() >= stop_at);
        let rest = run(&plan, &known(&first.rows));
        assert_eq!(first.rows.len() + rest.rows.len(), whole.rows.len());
        assert_eq!(rest.complete, whole.complete);
        let rows = [first.rows, rest.rows].concat();
        assert!(timeless(&plan, &rows) == timeless(&plan, &whole.rows));
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
        ("[80, 200]", "[80, 200, 300]", n),
        ("[80, 200]", "[200, 80]", n),
        ("[80, 200]", "[200]", n / 2),
        ("[1, 2]", "[2, 3]", n / 2),
        ("alpha = 0.3", "alpha = 0.3, name = \"other\"", 3 * n / 4),
        ("alpha = 0.3", "alpha = 0.31", 3 * n / 4),
        ("pairs = 700", "pairs = 701", 0),
        ("neighbours = 16", "neighbours = 17", 2 * n / 3),
        ("\"square-root\"", "\"arcsine\"", n / 2),
    ] {
        let other = keys_of(&edited(TEXT, from, to));
        let common = other.iter().filter(|k| all.contains(*k)).count();
        assert_eq!(common, kept, "{to}");
    }
}

/// The parts of a run, which together have all rows and no row twice.
fn parts(plan: &Plan, all: &HashSet<RowKey>, of: usize) -> Vec<Keep> {
    let mut found = HashSet::new();
    let parts = (1..=of).map(|part| {
        let mut kept = curious();
        let extent = Extent {
            shard: Some(Shard { part, of }),
            ..Extent::default()
        };
        plan.run(&extent, &Known::new(), &mut kept).unwrap();
        near(
            kept.work,
            kept.announced,
            1e-9 * kept.announced.max(1.0),
            of,
        );
        for key in keys(&kept.rows) {
            assert!(found.insert(key), "{part}/{of}");
        }
        kept
    });
    let parts = parts.collect();
    assert_eq!(found, *all);
    parts
}

#[test]
fn shards_share_the_work_and_leave_nothing_out() {
    let whole = plan(TEXT);
    let all: HashSet<RowKey> = keys(&rows(&whole));
    for of in [2, 7] {
        let parts = parts(&whole, &all, of);
        let sizes = parts.iter().map(|part| part.rows.len());
        // Of equal schedules no part has more than one more.
        let each = whole.rows() / whole.units().len();
        let (least, most) = (sizes.clone().min(), sizes.max());
        assert!(most.unwrap() - least.unwrap() <= each, "{least:?} {most:?}");
    }
    // Materials of few schedules are shared out: schedules of a part, and materials of each.
    let few = plan(&TEXT.replace("[80, 200]", "[80]").replace("[1, 2]", "[1]"));
    assert_eq!((few.units().len(), few.materials.len()), (2, 4));
    let all: HashSet<RowKey> = keys(&rows(&few));
    for (of, most) in [(2, 4), (6, 2), (50, 1)] {
        let parts = parts(&few, &all, of);
        let is_busy = |part: &&Keep| !part.rows.is_empty();
        assert_eq!(parts.iter().filter(is_busy).count(), of.min(8));
        for part in &parts {
            let materials: HashSet<_> = part.rows.iter().map(|r| &r.material).collect();
            assert!(materials.len() <= most, "{of}: {materials:?}");
            // Nor are more built.
            assert!(part.loaded.len() <= most, "{of}: {:?}", part.loaded);
        }
    }
}

/// Replaces a file before a step of a run whose name begins so.
struct Swap<'a> {
    path: &'a Path,
    other: Vec<u8>,
    step: &'static str,
    /// Steps until then.
    wait: usize,
    failures: Vec<String>,
    made: usize,
}

impl<'a> Swap<'a> {
    fn new(path: &'a Path, other: Vec<u8>, step: &'static str, wait: usize) -> Self {
        Self {
            path,
            other,
            step,
            wait,
            failures: Vec::new(),
            made: 0,
        }
    }
}

impl<R> Observer<R> for Swap<'_> {
    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        match event {
            Event::Doing(what) if what.to_string().starts_with(self.step) => {
                if self.wait == 0 {
                    fs::write(self.path, &self.other).unwrap();
                }
                self.wait = self.wait.wrapping_sub(1);
            }
            Event::Failed(failure) => self.failures.push(failure.reason.clone()),
            Event::Made(made) => self.made += made.len(),
            _ => {}
        }
        Ok(())
    }
}

#[test]
fn a_file_that_is_replaced_under_way_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bin");
    fs::write(&path, utia(0.1)).unwrap();
    let table = format!("{{ kind = \"utia\", path = {path:?} }}");
    let materials = format!("[{table}, {{ kind = \"lambert\" }}]");
    let plan = plan(&format!("budgets = [60]\nmaterial = {materials}"));
    // As soon as it was hashed.
    let mut swap = Swap::new(&path, utia(0.2), "loading", 0);
    let summary = plan.run(&Extent::default(), &Known::new(), &mut swap);
    let [reason] = &swap.failures[..] else {
        panic!("{:?}", swap.failures)
    };
    says(reason, "replaced");
    // Nothing of the table, everything of the other material.
    assert_eq!(summary.unwrap().failures.len(), 1);
    assert_eq!(2 * swap.made, plan.rows());
}

#[test]
fn a_lighting_is_that_of_its_key() {
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
             moments = {{ order = 2, views = 5, estimator = {{ kind = \"peak-resolving\", tolerance = 1e-2 }} }}\n\
             relations = {{ views_deg = [30], tolerance = 1e-2 }}\nlighting = [{{ kind = \"map\", path = {path:?} }}]\n\
             material = [{{ kind = \"ggx\", alpha = 0.6 }}, {{ kind = \"ggx\", alpha = 0.5 }}]\n"
        );
        let plan = AnyPlan::read(&Source::new("c.toml", text)).unwrap();
        let AnyPlan::Relations(plan) = plan else {
            unreachable!("relations");
        };
        let mut swap = Swap::new(&path, panorama(200), "", before);
        let (extent, known) = (Extent::default(), Known::new());
        plan.run(&extent, &known, &mut swap).unwrap();
        assert_eq!((swap.made, swap.failures.len()), (records, 2 - records));
        let mut failures = swap.failures.iter();
        assert!(failures.all(|reason| reason.contains("replaced")));
    }
}

/// Pairs are added until every measure has converged, or as many as are allowed.
fn every_measure_is_waited_for(level: Level) {
    let most = level.of(10_000, 40_000);
    let text = TEXT.replace("max_pairs = 1", &format!("max_pairs = {most}"));
    let with = |measures: &str| {
        let plan = plan(&text.replace(r#"["cosine", "lobe"]"#, measures));
        rows(&plan)
    };
    let all = with("[\"cosine\", \"steep\", \"grazing\"]");
    // Rows of a reconstruction follow each other.
    let mut ended = [0, 0];
    for of in all.chunks(3) {
        assert!(of.iter().all(|r| r.pairs == of[0].pairs));
        let converged = of.iter().all(|r| r.converged);
        // A few are outside the window.
        assert!(converged || 2 * of[0].pairs > most, "{}", of[0].pairs);
        ended[usize::from(converged)] += 1;
    }
    assert!(ended[0] > 0 && ended[1] > 0, "{ended:?}");
    let pairs = |rows: &[Row]| -> usize { rows.iter().map(|r| r.pairs).sum() };
    assert!(pairs(&all) > 3 * pairs(&with("[\"cosine\"]")));
}

#[test]
fn parts_that_cannot_be_are_refused() {
    for text in ["0/4", "5/4", "1", "a/b", "1/0", "1/100001"] {
        let refusal = text.parse::<Shard>().unwrap_err().to_string();
        says(&refusal, "1 <= i <= n");
    }
}

/// Every stage of a run: schedules of both kinds, an instrument with its noise, reconstructions that
/// do and do not need a grid, all quantities.
const GOLDEN: &str = r#"
quantities = ["albedo", "moments"]
budgets = [150]
measures = ["lobe"]
material = [{ kind = "ggx", alpha = 0.3 }, { kind = "ward", alpha = [0.2, 0.5] }]
parametrization = [
  { kind = "half-difference", warp = { theta_h = "square-root" } },
  { kind = "hybrid" },
  { kind = "spherical" },
  { kind = "stark" },
]
sample_set = [{ kind = "grid" }, { kind = "sobol" }]
reconstruction = [
  { kind = "cubic" },
  { kind = "inverse-distance" },
  { kind = "thin-plate", neighbours = 12 },
]
instrument = [{ preset = "utia" }]
metrics = { pairs = 300, max_pairs = 1 }
moments = { views = 3, order = 3, estimator = { kind = "sobol", samples = 256 } }
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
    let of_another = format!("golden rows are of another revision than RESULTS_REVISION: {again}");
    assert_eq!(head["revision"], RESULTS_REVISION, "{of_another}");
    let revise = format!("raise RESULTS_REVISION, and {again}");
    let [rows_then, rows_now] = [golden.len(), today.len()];
    assert_eq!(rows_then, rows_now, "another number of rows: {revise}");
    for (then, now) in golden.iter().zip(&today) {
        assert!(then.keys().eq(now.keys()), "other columns: {revise}");
        for ((name, then), value) in then.iter().zip(now.values()) {
            assert!(agree(then, value), "{name} was {then}: {revise}: {now:?}");
        }
    }
}
