//! What runs do, counted. Every number follows from the config and the library, so that nobody does more than is
//! asked unseen: a count that is not expected is a failure too.

use super::common::says;
use super::{Bench, MATERIALS, pages};
use gonio::analysis::alignment;
use gonio::brdf::{Brdf, Channels, ObservedBrdf, Presence};
use gonio::experiment::moments::MaterialProfiles;
use gonio::experiment::{Plan, Shard, Source, Unit};
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::metrics::{AlbedoProbe, TestSet};
use gonio::reconstruct::present;
use gonio::schedule::Schedule;
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
    fn asks(&mut self, stage: &str, material: &Material, pairs: usize) {
        self.add(&format!("{stage}.evaluations"), pairs);
        if material.table_bytes > 0 {
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
                counts.add(
                    &format!("{stage}.{work}"),
                    number.as_u64().unwrap() as usize,
                );
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
            let bytes = fs::metadata(bench.path(run).join(file)).unwrap().len() as usize;
            let below = file.split_once('/').map(|(below, _)| below);
            let stage = match below {
                Some("pictures" | "figures" | "slices") => "pictures",
                _ => "report",
            };
            self.add(&format!("{stage}.files_written"), 1);
            self.add(&format!("{stage}.bytes_written"), bytes);
            if stage == "pictures" {
                self.add("pictures.drawn", 1);
            }
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

/// A material of a plan, built.
struct Material {
    brdf: Box<dyn Brdf>,
    table_bytes: usize,
}

/// The number of pairs that something asks a BRDF for.
fn asked(brdf: &dyn Brdf, by: impl FnOnce(&dyn Brdf)) -> usize {
    let count = AtomicU64::new(0);
    by(&ObservedBrdf::new(brdf, |_: &[f64], pairs: &[Presence]| {
        count.fetch_add(pairs.len() as u64, Ordering::Relaxed);
    }));
    count.into_inner() as usize
}

/// The part of an acquisition with an ideal instrument that some units and materials are.
struct Part<'a> {
    plan: &'a Plan,
    units: Vec<Unit>,
    /// By position.
    materials: Vec<usize>,
}

impl<'a> Part<'a> {
    fn whole(plan: &'a Plan) -> Self {
        Self {
            plan,
            units: plan.units(),
            materials: (0..plan.materials.len()).collect(),
        }
    }

    fn schedule(&self, coordinates: usize, set: usize, budget: usize, seed: u64) -> Arc<Schedule> {
        let plan = self.plan;
        let form = plan.parametrizations[coordinates].form(Symmetry::FULL);
        let set = &plan.sample_sets[set].set;
        Arc::new(set.plan(&form.unwrap(), budget, seed).unwrap())
    }

    fn built(&self) -> Vec<Material> {
        let of = |&i: &usize| {
            let material = &self.plan.materials[i];
            assert_eq!(material.symmetry, Symmetry::FULL);
            Material {
                brdf: material.spec.build(Channels::Luminance).unwrap(),
                table_bytes: material.spec.tables().channel_bytes,
            }
        };
        self.materials.iter().map(of).collect()
    }

    /// What has to be done, with one level of test pairs.
    fn counts(&self) -> Counts {
        let plan = self.plan;
        assert!(plan.metrics.max_pairs == 1 && plan.channels == Channels::Luminance);
        let mut counts = Counts::default();
        let set = TestSet::new(&plan.measures, &plan.metrics).unwrap();
        let pairs = set.level(0).pairs.len();
        let probe = if plan.albedo {
            AlbedoProbe::new().pairs().len()
        } else {
            0
        };
        counts.add("truth.test_pairs", pairs);
        let built = self.built();
        for (i, material) in self.materials.iter().zip(&built) {
            counts.add("load.materials", 1);
            counts.add("load.table_bytes", material.table_bytes);
            for file in plan.materials[*i].spec.tables().files {
                // Hashed, read, and hashed again: it may have been replaced meanwhile.
                counts.add("load.files_read", 3);
                let bytes = fs::metadata(file).unwrap().len() as usize;
                counts.add("load.bytes_read", 3 * bytes);
            }
            counts.asks("truth", material, pairs + probe);
            let aligned = asked(&*material.brdf, |brdf| _ = alignment(brdf));
            counts.asks("alignment", material, aligned);
        }
        let mut made = BTreeSet::new();
        for unit in &self.units {
            let set = &plan.sample_sets[unit.sample_set];
            let seed = if set.set.is_random() { unit.seed } else { 0 };
            let budget = unit.allowance.count().unwrap();
            let schedule = self.schedule(unit.coordinates, unit.sample_set, budget, seed);
            let poses = schedule.poses.len();
            if made.insert((unit.coordinates, unit.sample_set, budget, seed)) {
                counts.add("plan.schedules", 1);
                counts.add("plan.poses", poses);
            }
            let mut alike = BTreeSet::new();
            for material in &built {
                let measured = Ideal.measure(&*material.brdf, &schedule);
                counts.add("measure.poses", poses);
                counts.add("measure.readings", measured.readings());
                counts.asks("measure", material, poses);
                alike.insert(present(&measured));
            }
            // Neighbours depend on poses alone: one interpolant serves all materials that have data at the same.
            let methods = plan.methods_on(unit).len();
            counts.add("reconstruct.reconstructions", methods * alike.len());
            counts.add(
                "evaluate.evaluated",
                methods * built.len() * (pairs + probe),
            );
        }
        counts
    }
}

fn plan(bench: &Bench, text: &str) -> Plan {
    bench.write("c.toml", text);
    Plan::read(&Source::new("c.toml", text)).unwrap()
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
    let text = text.replace("[250, 1000, 4000, 16000]", "[250, 1000]");
    let text = format!("{text}\n[metrics]\npairs = 600\nmax_pairs = 1\n");
    let plan = plan(&bench, &text);
    let shown = bench.good("run c.toml -q -o a --explain");
    let counts = Counts::of(&bench, "a");
    let expected = Part::whole(&plan).counts();
    assert_eq!(counts, expected.clone().with_files(&bench, "a"));
    // 4 materials, one of them a table; 5 coordinates, 2 budgets, 2 reconstructions, no difference in data.
    assert_eq!(counts.get("load.materials"), 4);
    assert_eq!(counts.get("plan.schedules"), 10);
    assert_eq!(counts.get("reconstruct.reconstructions"), 20);
    assert_eq!(
        4 * counts.get("truth.look_ups"),
        counts.get("truth.evaluations")
    );
    // Tables, report and curves of seconds, and the curves of errors.
    assert_eq!(
        [
            counts.get("report.files_written"),
            counts.get("pictures.drawn")
        ],
        [4, 1]
    );
    // What is printed is that.
    let words: Vec<Vec<&str>> = shown
        .lines()
        .map(|l| l.split_whitespace().collect())
        .collect();
    for number in [counts.get("plan.poses"), counts.get("evaluate.evaluated")] {
        let number = number.to_string();
        assert!(
            words.iter().any(|line| line.contains(&number.as_str())),
            "{shown}"
        );
    }
    for line in [
        "160 rows made, 0 rows known before",
        "tours there is no [[instrument]]",
        "moments quantities has no \"moments\"",
        "pictures pictures.draw is false",
    ] {
        assert!(
            words.iter().any(|words| words.join(" ") == line),
            "{line}: {shown}"
        );
    }
    // On any number of threads, and whether it is printed or not.
    for threads in ["1", "2"] {
        let again = run(&bench, &format!("--force --threads {threads}"));
        assert_eq!(again.without_files(), expected, "{threads}");
    }
}

/// Two materials that are drawn small.
const DRAWN: &str = r#"
experiment = "study"
budgets = [60, 150]

[[material]]
kind = "lambert"

[[material]]
kind = "ggx"
alpha = 0.3

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "spherical"

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "nearest"

[[reconstruction]]
kind = "multilinear"

[metrics]
pairs = 200
max_pairs = 1

[pictures]
resolution = 12
samples = 4
budget = 100
"#;

/// The same with a table, the file `t.binary`, as the second material.
fn with_table(bench: &Bench) -> String {
    let tabulate = "tabulate small.toml --material ggx-0.4";
    bench.good(format!("{tabulate} -o t.binary"));
    let table = format!("kind = \"merl\"\npath = {:?}", bench.path("t.binary"));
    DRAWN.replace("kind = \"ggx\"\nalpha = 0.3", &table)
}

#[test]
fn a_part_of_a_study_reads_builds_and_draws_its_own_materials() {
    let bench = Bench::new();
    let text = with_table(&bench);
    let text = text.replace("[60, 150]", "[60]");
    // One schedule and two materials: each part has a material.
    let spherical = "[[parametrization]]\nkind = \"spherical\"\n";
    let plan = plan(&bench, &text.replace(spherical, ""));
    for part in [1, 2] {
        let shard = Shard { part, of: 2 };
        let share = plan.share(Some(shard));
        let materials = (0..2)
            .filter(|i| share.materials.has(*i))
            .collect::<Vec<_>>();
        assert_eq!(materials, [part - 1]);
        let mine = Part {
            plan: &plan,
            units: share.units,
            materials,
        };
        let expected = mine.counts();
        let folder = format!("part-{part}");
        bench.good(format!("run c.toml -q -o {folder} --shard {}", shard));
        let counts = Counts::of(&bench, &folder);
        assert_eq!(counts.get("load.files_read") > 0, part == 2);
        assert_eq!(counts.without_files(), expected);
    }
    // Together they are the whole, but for test pairs, schedules and pictures of the study, which each part makes.
    bench.good("merge part-1 part-2 -o both");
    let both = Counts::of(&bench, "both");
    let whole = run(&bench, "");
    for shared in [
        "truth.test_pairs",
        "plan.schedules",
        "plan.poses",
        "pictures.schedules",
    ] {
        assert_eq!(both.get(shared), 2 * whole.get(shared), "{shared}");
    }
    for same in [
        "load.materials",
        "load.bytes_read",
        "truth.evaluations",
        "alignment.evaluations",
        "measure.poses",
        "evaluate.evaluated",
        "pictures.evaluated",
    ] {
        assert_eq!(both.get(same), whole.get(same), "{same}");
    }
}

#[test]
fn a_run_that_goes_on_does_what_is_missing() {
    let bench = Bench::new();
    let text = with_table(&bench);
    let some = text.replace("[60, 150]", "[60]");
    let plan_of_some = plan(&bench, &some);
    let first = run(&bench, "");
    assert!(first.get("pictures.evaluated") > 0);
    let expected = Part::whole(&plan_of_some).counts();
    assert_eq!(first.without_files(), expected);
    // A budget more: its schedules, with the materials built again; none is drawn again.
    let plan = plan(&bench, &text);
    let mut further = Part::whole(&plan);
    further
        .units
        .retain(|unit| unit.allowance.count() == Some(150));
    let more = run(&bench, "");
    assert_eq!(more.get("pictures.evaluated"), 0);
    assert_eq!(more.without_files(), further.counts());
    // Nothing: files are hashed to know that, and what is made of all rows is written.
    let shown = bench.good("run c.toml -q -o a --explain");
    let counts = Counts::of(&bench, "a");
    let mut expected = Counts::default();
    expected.add("load.files_read", 1);
    expected.add(
        "load.bytes_read",
        fs::metadata(bench.path("t.binary")).unwrap().len() as usize,
    );
    assert_eq!(counts.clone().without_files(), expected);
    assert_eq!(counts.get("report.files_written"), 4);
    // Those of the study itself, its curves among them.
    assert_eq!(counts.get("pictures.drawn"), 3);
    let rows = bench.rows("a").len();
    says(&shown, &format!("0 rows made, {rows} rows known before"));
}

/// A machine that takes a value at a pose, and is sought for minutes or given a budget.
const MACHINE: &str = r#"
seeds = [1]
SIZE
quantities = []

[[material]]
kind = "lambert"

[[parametrization]]
kind = "half-difference"

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "nearest"

[[instrument]]
preset = "cornell"
apertures = false
noise = false

[metrics]
pairs = 200
max_pairs = 1
"#;

#[test]
fn seeds_and_materials_share_schedules_and_tours() {
    let bench = Bench::new();
    let more = |text: &str| {
        let ggx = "[[material]]\nkind = \"ggx\"\nalpha = 0.3\n\n[[parametrization]]";
        text.replace("seeds = [1]", "seeds = [1, 2, 3]")
            .replace("[[parametrization]]", ggx)
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
    assert_eq!(
        [counts.get("plan.schedules"), counts.get("plan.tours")],
        [1, 2]
    );
    assert_eq!(counts.get("plan.poses"), poses as u64);
    // Two materials and three seeds, with limits and without.
    assert_eq!(counts.get("measure.poses"), (2 * 3 * 2 * poses) as u64);
    let visits = (reachable * poses as f64).round() as usize + poses;
    assert_eq!(counts.get("measure.evaluations"), (2 * 3 * visits) as u64);
    assert_eq!(
        counts.get("measure.readings"),
        counts.get("measure.evaluations")
    );
    // The materials of a seed together, with and without what cannot be reached.
    assert_eq!(counts.get("reconstruct.reconstructions"), 3 * 2);
    // Minutes: a search, which neither seeds nor materials repeat.
    let text = MACHINE.replace("SIZE", "minutes = [10]");
    plan(&bench, &text);
    let one = run(&bench, "--force");
    plan(&bench, &more(&text));
    let many = run(&bench, "--force");
    assert_eq!(of_plan(&one), of_plan(&many));
    assert_eq!(
        6 * one.get("measure.evaluations"),
        many.get("measure.evaluations")
    );
    // A search by halves that ends at half a percent, no budget twice, and at most a tour each beside the last two.
    let [schedules, tours] = ["plan.schedules", "plan.tours"].map(|what| one.get(what));
    assert!(
        (2..25).contains(&schedules) && tours <= schedules + 2,
        "{one:?}"
    );
    for threads in ["1", "2"] {
        let again = run(&bench, &format!("--force --threads {threads}"));
        assert_eq!(again.without_files(), many.clone().without_files());
    }
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
    let records: Vec<MaterialProfiles> = gonio::report::read_rows(&bench.path("a")).unwrap();
    let slices = records
        .into_iter()
        .flat_map(|r| r.profiles)
        .flat_map(|p| p.slices);
    assert_eq!(slices.map(|s| s.evaluations).sum::<usize>(), points);
    // Gone on with, nothing is evaluated.
    let shown = bench.good("run c.toml -q -o a --explain");
    assert_eq!(Counts::of(&bench, "a").without_files(), Counts::default());
    says(
        &shown,
        "0 rows made, 3 rows known before … spheres     analysis.spheres names no material",
    );
}
