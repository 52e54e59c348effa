//! What runs do, counted. Every number follows from the config and the library, so that no run does more than is
//! asked unseen: a count that is not expected is a failure too.

use super::common::{self, says};
use super::{Bench, MATERIALS, pages};
use gonio::analysis::alignment;
use gonio::brdf::{Channels, ObservedBrdf, Presence};
use gonio::experiment::{Plan, Unit};
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::metrics::{AlbedoProbe, TestSet};
use gonio::reconstruct::present;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Numbers by `stage.work`; none is 0.
#[derive(Clone, Debug, Default, PartialEq)]
struct Counts(BTreeMap<String, u64>);

impl Counts {
    fn add(&mut self, what: &str, number: usize) {
        if number > 0 {
            *self.0.entry(what.into()).or_default() += number as u64;
        }
    }

    /// Evaluations of a material at a stage; of a table they are look-ups.
    fn asks(&mut self, stage: &str, is_table: bool, pairs: usize) {
        self.add(&format!("{stage}.evaluations"), pairs);
        if is_table {
            self.add(&format!("{stage}.look_ups"), pairs);
        }
    }

    fn get(&self, what: &str) -> u64 {
        self.0.get(what).copied().unwrap_or(0)
    }

    /// Those of a run, and what its folder says of the files that it wrote, all of them once.
    fn of(bench: &Bench, run: &str) -> Self {
        let machine = bench.machine(run);
        let mut counts = Self::default();
        for (stage, works) in machine["counts"].as_object().unwrap() {
            for (work, number) in works.as_object().unwrap() {
                let number = number.as_u64().unwrap() as usize;
                counts.add(&format!("{stage}.{work}"), number);
            }
        }
        counts
    }

    /// Adds the files of a run but those of records, each written once.
    fn with_files(mut self, bench: &Bench, run: &str) -> Self {
        let files = bench.files(run);
        let others = ["config.toml", "manifest.json"];
        let files = files.iter().filter(|f| !f.ends_with(".jsonl"));
        for file in files.filter(|f| !others.contains(&f.as_str())) {
            let bytes = bench.read_bytes(&format!("{run}/{file}")).len();
            let below = ["pictures/", "figures/", "slices/"];
            let is_drawn = below.iter().any(|below| file.starts_with(below));
            let stage = if is_drawn { "pictures" } else { "report" };
            self.add(&format!("{stage}.files_written"), 1);
            self.add(&format!("{stage}.bytes_written"), bytes);
            self.add("pictures.drawn", usize::from(is_drawn));
        }
        self
    }

    /// Without files of results and pictures.
    fn without_files(mut self) -> Self {
        let of_files = |what: &str| what.ends_with("_written") || what.starts_with("pictures.");
        self.0.retain(|what, _| !of_files(what));
        self
    }
}

/// What an acquisition with an ideal instrument has to do for units, with one level of test pairs and all of its materials.
fn needed(plan: &Plan, units: &[Unit]) -> Counts {
    assert!(plan.metrics.max_pairs == 1 && plan.channels == Channels::Luminance);
    let mut counts = Counts::default();
    let set = TestSet::new(&plan.measures, &plan.metrics).unwrap();
    let pairs = set.level(0).pairs.len();
    let albedo = plan.albedo.then(AlbedoProbe::new);
    let probe = albedo.map_or(0, |probe| probe.pairs().len());
    counts.add("truth.test_pairs", pairs);
    let mut built = Vec::new();
    for material in &plan.materials {
        assert_eq!(material.symmetry, Symmetry::FULL);
        let brdf = material.spec.build(Channels::Luminance).unwrap();
        let tables = material.spec.tables();
        counts.add("load.materials", 1);
        counts.add("load.table_bytes", tables.channel_bytes);
        for file in tables.files {
            // Hashed, read, and hashed again: it may have been replaced meanwhile.
            counts.add("load.files_read", 3);
            let bytes = fs::metadata(file).unwrap().len() as usize;
            counts.add("load.bytes_read", 3 * bytes);
        }
        let aligned = AtomicU64::new(0);
        let seen = |_: &[f64], asked: &[Presence]| {
            aligned.fetch_add(asked.len() as u64, Ordering::Relaxed);
        };
        alignment(&ObservedBrdf::new(&*brdf, seen));
        let is_table = tables.channel_bytes > 0;
        counts.asks("truth", is_table, pairs + probe);
        counts.asks("alignment", is_table, aligned.into_inner() as usize);
        built.push((brdf, is_table));
    }
    let mut made = BTreeSet::new();
    for unit in units {
        let set = &plan.sample_sets[unit.sample_set].set;
        let methods = plan.methods_on(unit);
        if methods.is_empty() {
            continue;
        }
        let weighs = |m: &&usize| plan.methods[**m].method.weighs_readings();
        let weighing = methods.iter().filter(weighs).count();
        let seed = if set.is_random() { unit.seed } else { 0 };
        let budget = unit.allowance.count().unwrap();
        let at = unit.coordinates.map(|at| &plan.parametrizations[at]);
        let form = at.unwrap_or(&plan.unguided).form(Symmetry::FULL);
        let schedule = Arc::new(set.plan(&form.unwrap(), budget, seed).unwrap());
        let poses = schedule.poses.len();
        if made.insert((unit.coordinates, unit.sample_set, budget, seed)) {
            counts.add("plan.schedules", 1);
            counts.add("plan.poses", poses);
        }
        let mut alike = BTreeSet::new();
        for (brdf, is_table) in &built {
            let measured = Ideal.measure(&**brdf, &schedule);
            counts.add("measure.poses", poses);
            counts.add("measure.readings", measured.readings());
            counts.asks("measure", *is_table, poses);
            alike.insert(present(&measured));
        }
        // Neighbours depend on poses alone: one interpolant serves all materials that have data at the same.
        let (methods, one) = (methods.len(), methods.len() - weighing);
        let made = one * alike.len() + weighing * built.len();
        counts.add("reconstruct.reconstructions", made);
        let evaluated = methods * built.len() * (pairs + probe);
        counts.add("evaluate.evaluated", evaluated);
    }
    counts
}

fn plan(bench: &Bench, text: &str) -> Plan {
    bench.write("c.toml", text);
    common::plan(text).unwrap()
}

/// Runs `c.toml`, and returns its counts.
fn run(bench: &Bench, more: &str) -> Counts {
    bench.good(format!("run c.toml -q -o a {more}"));
    Counts::of(bench, "a")
}

#[test]
fn the_quickstart_does_what_its_rows_need() {
    let bench = Bench::new();
    let text = pages::read("configs/quickstart.toml");
    let text = text.replace("[250, 1000, 4000, 16000]", "[30, 60]");
    let pairs = "pairs = 200\nmax_pairs = 1";
    let text = text.replace("tolerance = 0.04\nmax_pairs = 16384", pairs);
    let text = text.replace("up_to = 250", "up_to = 30");
    let plan = plan(&bench, &text);
    let shown = bench.good("run c.toml -q -o a --explain");
    let counts = Counts::of(&bench, "a");
    let expected = needed(&plan, &plan.units());
    assert_eq!(counts, expected.clone().with_files(&bench, "a"));
    // What is printed is that.
    let lines: Vec<String> = shown.lines().map(pages::squeezed).collect();
    for number in ["plan.poses", "evaluate.evaluated"].map(|what| counts.get(what).to_string()) {
        let has = |line: &String| line.split(' ').any(|word| word == number);
        assert!(lines.iter().any(has), "{shown}");
    }
    let line = "tours there is no [[instrument]]";
    assert!(lines.iter().any(|shown| shown == line), "{shown}");
    // On any number of threads, and whether it is printed or not.
    for threads in ["1", "2"] {
        let again = run(&bench, &format!("--force --threads {threads}"));
        assert_eq!(again.without_files(), expected, "{threads}");
    }
}

/// Two materials that are drawn small, a model and a table.
const DRAWN: &str = r#"
experiment = "study"
budgets = [60]
material = [{ kind = "lambert" }, { kind = "merl", path = 'TABLE' }]
parametrization = [{ kind = "half-difference" }, { kind = "spherical" }]
sample_set = [{ kind = "grid" }]
reconstruction = [{ kind = "nearest" }, { kind = "multilinear" }]
metrics = { pairs = 200, max_pairs = 1 }
pictures = { resolution = 12, samples = 4, budget = 100 }
"#;

#[test]
fn a_run_that_goes_on_does_what_is_missing() {
    let bench = Bench::new();
    bench.good("tabulate small.toml --material ggx-0.4 -o t.binary");
    let text = DRAWN.replace("TABLE", &bench.path("t.binary").to_string_lossy());
    let some = plan(&bench, &text);
    let first = run(&bench, "");
    let drawn = first.get("pictures.evaluated");
    assert_eq!(first.without_files(), needed(&some, &some.units()));
    // A budget more: its schedules, with the materials built again; none is drawn again.
    let further = plan(&bench, &text.replace("[60]", "[60, 150]"));
    let mut units = further.units();
    units.retain(|unit| unit.allowance.count() == Some(150));
    let more = run(&bench, "");
    assert_eq!(more.get("pictures.evaluated"), 0);
    assert_eq!(more.without_files(), needed(&further, &units));
    // A picture is lost: it alone is drawn again, with the same bytes.
    let pictures = bench.files("a/pictures");
    let lost = pictures.iter().find(|f| f.ends_with("spherical.svg"));
    let lost = format!("a/pictures/{}", lost.unwrap());
    let bytes = bench.read_bytes(&lost);
    fs::remove_file(bench.path(&lost)).unwrap();
    let of_lost = run(&bench, "").get("pictures.evaluated");
    assert!(bench.read_bytes(&lost) == bytes);
    assert!(0 < of_lost && of_lost < drawn, "{of_lost} of {drawn}");
    // Nothing: files are hashed to know that, and what is made of all rows is written.
    let shown = bench.good("run c.toml -q -o a --explain");
    let mut expected = Counts::default();
    expected.add("load.files_read", 1);
    expected.add("load.bytes_read", bench.read_bytes("t.binary").len());
    assert_eq!(Counts::of(&bench, "a").without_files(), expected);
    let rows = bench.rows("a").len();
    says(&shown, &format!("0 rows made, {rows} rows known before"));
}

/// A machine that takes a value at a pose, and is sought for minutes or given a budget.
const MACHINE: &str = r#"
seeds = [1]
SIZE
quantities = []
material = [{ kind = "lambert" }]
parametrization = [{ kind = "half-difference" }]
sample_set = [{ kind = "grid" }]
reconstruction = [{ kind = "nearest" }]
instrument = [{ preset = "cornell", apertures = false, noise = false }]
metrics = { pairs = 200, max_pairs = 1 }
"#;

#[test]
fn seeds_and_materials_share_schedules_and_tours() {
    let bench = Bench::new();
    let more = |text: &str| {
        let two = "{ kind = \"lambert\" }, { kind = \"ggx\", alpha = 0.3 }";
        let text = text.replace("seeds = [1]", "seeds = [1, 2, 3]");
        text.replace("{ kind = \"lambert\" }", two)
    };
    let of_plan = |counts: &Counts| -> Counts {
        let mut plan = counts.clone();
        plan.0.retain(|what, _| what.starts_with("plan."));
        plan
    };
    // A budget: one schedule, its tour, and the tour without limits that says what holes cost.
    let text = MACHINE.replace("SIZE", "budgets = [120]");
    plan(&bench, &more(&text));
    let counts = run(&bench, "--force");
    let rows = bench.rows("a");
    let (poses, reachable) = (rows[0].poses, rows[0].reachable);
    assert!(reachable < 1.0);
    let planned = ["plan.schedules", "plan.tours"].map(|what| counts.get(what));
    assert_eq!(planned, [1, 2]);
    assert_eq!(counts.get("plan.poses"), poses as u64);
    // Two materials and three seeds, with limits and without.
    assert_eq!(counts.get("measure.poses"), (2 * 3 * 2 * poses) as u64);
    let visits = (reachable * poses as f64).round() as usize + poses;
    for what in ["measure.evaluations", "measure.readings"] {
        assert_eq!(counts.get(what), (2 * 3 * visits) as u64, "{what}");
    }
    // The materials of a seed together, with and without what cannot be reached.
    assert_eq!(counts.get("reconstruct.reconstructions"), 3 * 2);
    // Minutes: a search, which neither seeds nor materials repeat.
    let text = MACHINE.replace("SIZE", "minutes = [10]");
    plan(&bench, &text);
    let one = run(&bench, "--force");
    plan(&bench, &more(&text));
    let many = run(&bench, "--force");
    assert_eq!(of_plan(&one), of_plan(&many));
    let [of_one, of_many] = [&one, &many].map(|counts| counts.get("measure.evaluations"));
    assert_eq!(6 * of_one, of_many);
    // A search by halves that ends at half a percent, no budget twice, and at most a tour each beside the last two.
    let [schedules, tours] = ["plan.schedules", "plan.tours"].map(|what| one.get(what));
    let is_short = (2..25).contains(&schedules) && tours <= schedules + 2;
    assert!(is_short, "{one:?}");
}

#[test]
fn profiles_cost_what_their_slices_say() {
    let bench = Bench::new();
    let text = format!(
        "experiment = \"moments\"\n[moments]\nviews = 5\norder = 2\n\
         estimator = {{ kind = \"sobol\", samples = 512 }}\n{MATERIALS}"
    );
    bench.write("c.toml", text);
    let counts = run(&bench, "");
    let mut expected = Counts::default();
    expected.add("load.materials", 3);
    // 3 materials of 5 slices: the points of each, and a look where the peak should be.
    let points = 3 * 5 * (512 + 1);
    expected.add("moments.evaluations", points);
    assert_eq!(counts, expected.with_files(&bench, "a"));
    // Gone on with, nothing is evaluated.
    assert_eq!(run(&bench, "").without_files(), Counts::default());
}
