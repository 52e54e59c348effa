//! Configs: every mistake is one sentence that names the place, the key, the value and what is
//! allowed; the resolved config means the same as the one it was made from.
#![cfg(feature = "experiments")]

mod common;

use common::{edited, says, table};
use gonio::Error;
use gonio::experiment::{Event, Experiment, Extent, Known, Observer, Plan, Row, Source};

/// A config in which every part is written out; tests change one thing at a time.
const GOOD: &str = r#"question = "?"
seeds = [1]
budgets = [
  250,
  1000,
]
measures = ["cosine"]

[[material]]
kind = "ggx"
alpha = 0.3

[[material]]
kind = "lambert"
albedo = 0.5

[[parametrization]]
kind = "hybrid"
warp = { h_bar = "square-root" }

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "cubic"

[metrics]
pairs = 100
max_pairs = 1
mask_deg = 80.0

[output]
slices = false
"#;

fn plan(text: &str, sets: &[&str]) -> Result<Plan, Error> {
    let mut source = Source::new("c.toml", text);
    for set in sets {
        source.set(set, format!("--set {set}"))?;
    }
    Plan::read(&source)
}

/// The sentence that refuses a config, which is in one line and ends the program with 2.
fn refusal(text: &str, sets: &[&str]) -> String {
    let refusal = plan(text, sets).err();
    let refusal = refusal.unwrap_or_else(|| panic!("accepted: {sets:?}\n{text}"));
    let message = refusal.to_string();
    assert_eq!(refusal.exit_code(), 2, "{message}");
    assert!(!message.contains('\n'), "{message}");
    message
}

#[test]
fn a_mistake_in_the_file_is_reported_with_its_line() {
    // (what is written, what stands there instead, the message)
    for [written, instead, expected] in table(
        r#"
        question = "?" | qestion = "?" | c.toml:1: unknown key qestion; allowed: question, experiment, channels
        seeds = [1] | seeds = [] | c.toml:2: seeds = []: allowed is at least one
        kind = "cubic" | kind = "thin-plate"\nstretch = 1e-9 | c.toml:26: stretch = 0.000000001: allowed is a number in [0.001, 1000]
        kind = "cubic" | kind = "cubic"\nstretch = 1 | c.toml:26: unknown key reconstruction[0].stretch; allowed: kind, name, up_to, on, values, epsilon
        seeds = [1] | seeds = [1]\nseeds = [2] | c.toml:3: key seeds is there twice; allowed: once
        seeds = [1] | seeds = [3, 3] | c.toml:2: seeds[1] = 3 is there twice
        seeds = [1] | seeds = [-1] | c.toml:2: seeds[0] = -1: allowed is a whole number from 0
        1000, | 0, | c.toml:5: budgets[1] = 0: allowed is a whole number from 1 to 10000000
        1000, | 1e3, | c.toml:5: budgets[1] is floating point `1000.0`; allowed: a whole number
        ["cosine"] | ["sine"] | c.toml:7: measures[0] = "sine"; allowed: cosine, lobe
        ["cosine"] | "cosine" | c.toml:7: measures is string "cosine"; allowed: a list
        "ggx" | "ggg" | c.toml:10: kind = "ggg" is not a material; allowed:
        kind = "ggx" |  | c.toml:9: kind is missing from the material; allowed:
        alpha = 0.3 | alpha = 0.0 | c.toml:11: material[0].alpha = 0: allowed is a number
        kind = "lambert"\nalbedo = 0.5 | kind = "tabulated"\nof = { kind = "ggx", alpha = [0.1, 0.3] } | c.toml:15: material[1].of = ggx
        albedo = 0.5 | name = "ggx-0.3" | c.toml:15: material[1].name = "ggx-0.3" is taken
        albedo = 0.5 | name = " " | c.toml:15: material[1].name = " ": allowed is a text
        albedo = 0.5 | name = 7 | c.toml:15: name is 7; allowed: a string
        albedo = 0.5 | symmetry = { isotopic = true } | c.toml:15: unknown key material[1].symmetry.isotopic; allowed: isotropic, reciprocal, bilateral
        "hybrid" | "hibrid" | c.toml:18: kind = "hibrid" is not a parametrization; allowed: spherical,
        h_bar = | theta_h = | c.toml:19: parametrization[0].warp.theta_h = "square-root": no axis of hybrid; allowed: h_bar, k, delta
        "square-root" | "sqrt" | c.toml:19: parametrization[0].warp.h_bar = "sqrt"; allowed: square-root, merl, arcsine
        "square-root" | { kind = "power", exponent = 1.5 } | c.toml:19: parametrization[0].warp.h_bar: exponent = 1.5: allowed is a number in [0.1, 1]
        "square-root" | "power" | c.toml:19: parametrization[0].warp.h_bar lacks the key exponent
        "grid" | "grid"\nratio = "tuned" | c.toml:23: sample_set[0].ratio = "tuned" lacks what it is tuned on; allowed: with [tuning]
        "grid" | "grid"\nratio = "best" | c.toml:23: sample_set[0].ratio is string "best"; allowed: a list of numbers, or "tuned"
        [metrics] | [tuning]\nmaterials = [{ kind = "lambert" }]\n[metrics] | c.toml:27: tuning is never used; allowed: with a [[sample_set]] of ratio = "tuned"
        "grid" | "sobol" | c.toml:24: reconstruction[0] "cubic" is never used; allowed: an up_to that a budget stays within, and a grid
        "cubic" | "cubic"\nup_to = 79 | c.toml:24: reconstruction[0] "cubic" is never used; allowed: an up_to that a budget stays within
        "grid" | "grid"\nratio = [1, 2] | c.toml:23: ratio = [1.0, 2.0]: allowed is a number in [0.001, 1000] per axis (h_bar, k, delta) in hybrid
        "cubic" | "cubic"\nepsilon = -1.0 | c.toml:26: epsilon = -1: allowed is
        pairs = 100 | pears = 100 | c.toml:28: unknown key metrics.pears; allowed: pairs, max_pairs, tolerance, mask_deg
        pairs = 100 | pairs = 0 | c.toml:28: metrics.pairs = 0: allowed is
        80.0 | nan | c.toml:30: metrics.mask_deg = NaN: allowed is
        slices = false | slices = 1 | c.toml:33: output.slices is integer `1`; allowed: true or false
        slices = false | schedules = true | c.toml:33: output.schedules is boolean `true`; allowed: false or one of "csv", "json-lines"
        question = "?" | merl = 3 | c.toml:1: merl is 3; allowed: a table
        seeds = [1] | seeds = [1 | c.toml:3:
        seeds = [1] | merl = { interpolation = "nearest" } | c.toml:2: merl has keys for the files of materials_dir, which is not set"#,
    ) {
        let message = refusal(&edited(GOOD, written, instead), &[]);
        assert!(message.starts_with(expected), "{instead}\n  {message}");
    }
}

#[test]
fn warps_with_keys_are_named_by_them() {
    let warps = "{ kind = \"power\", exponent = 0.3 }, k = { kind = \"arcsine\" }";
    let plan = plan(&edited(GOOD, "\"square-root\"", warps), &[]).unwrap();
    assert_eq!(plan.parametrizations[0].warp, "h_bar:power-0.3;k:arcsine");
    let resolved = plan.resolved.to_string();
    assert!(resolved.contains("k = \"arcsine\""), "{resolved}");
    let again = self::plan(&resolved, &[]).unwrap();
    assert_eq!(again.resolved, plan.resolved);
}

#[test]
fn a_mistake_in_an_override_is_reported_with_the_override() {
    // (the override, the message after it)
    for [set, expected] in table(
        r#"
        nothing | has no `=`; allowed: key=value
        =3 | `` is no key
        a b=3 | `a b` is no key
        material.2.alpha=0.1 | `2` is no position in material, which has 2; allowed: 0 to 1
        material.all.beta=0.1 | no member has the key of `material.all.beta`
        metrics.all.pairs=3 | unknown key metrics.all
        budgets.2=5 | `2` is no position in budgets
        budgets.0.x=5 | budgets[0] is integer, which has no key `x`
        budgets=0 | budgets is integer `0`; allowed: a list
        material.0=3 | material[0] is a table, not integer; allowed: {
        material=[] | material is missing; allowed: at least one [[material]], or materials_dir
        material.0={kind="merl"} | material[0] lacks the key path
        channels=grey | channels = "grey"; allowed: luminance
        parametrization=[{kind="stark"},{kind="stark"}] | parametrization[1] = "stark" is there twice
        reconstruction=[{kind="cubic"},{kind="cubic"}] | reconstruction[1].name = "cubic" is taken
        sample_set=[] | sample_set = []: allowed is at least one
        band=0.9 | band = 0.9: allowed is a number in [1, 10]
        reconstruction.0.up_to=0 | reconstruction[0].up_to = 0: allowed is a whole number from 1 to
        reconstruction.0.on=nowhere | reconstruction[0].on = "nowhere" is no sample set of this config; allowed: grid
        pictures={samples=0} | pictures.samples = 0: allowed is a whole number from 1 to 65536
        coordinates=[{kind="polar"}] | coordinates[0].kind = polar: allowed is spherical, half-difference, orthographic, hybrid, stark, edwards, own
        coordinates=[{kind="hybrid",warp={theta_h="merl"}}] | coordinates.warp.theta_h = merl: allowed is no axis of hybrid; allowed: h_bar, k, delta"#,
    ) {
        let message = refusal(GOOD, &[set]);
        let expected = format!("--set {set}: {expected}");
        assert!(message.starts_with(&expected), "{set}\n  {message}");
    }
}

#[test]
fn all_is_each_member_that_has_the_key() {
    let two = GOOD.replace("\"lambert\"\nalbedo", "\"ggx\"\nname = \"b\"\nalpha");
    let resolved = |text: &str, sets: &[&str]| plan(text, sets).unwrap().resolved;
    let both = resolved(&two, &["material.0.alpha=0.7", "material.1.alpha=0.7"]);
    assert_eq!(resolved(&two, &["material.all.alpha=0.7"]), both);
    // Lambert has no such key.
    let one = resolved(GOOD, &["material.0.alpha=0.7"]);
    assert_eq!(resolved(GOOD, &["material.all.alpha=0.7"]), one);
    let message = refusal(&two, &["material.all.alpha=0"]);
    let start = "--set material.all.alpha=0: material[0]";
    assert!(message.starts_with(start), "{message}");
}

#[test]
fn lines_are_those_of_the_file_whatever_was_set() {
    let sets = ["metrics.seed=5", "material.0.name=first", "question=why"];
    let text = GOOD.replace("slices = false", "slices = 0");
    let message = refusal(&text, &sets);
    assert!(message.starts_with("c.toml:33: output.slices"), "{message}");
}

#[test]
fn overrides_are_toml_or_bare_strings() {
    let sets = [
        "budgets=[7, 20]",
        "material.1.albedo=[0.1, 0.2, 0.3]",
        "material.0={kind = \"ggx\", alpha = 0.4, name = \"mine\"}",
        "metrics.pairs=7",
        "question=which one = best?",
        "channels=rgb",
        "output={schedules=\"csv\"}",
    ];
    let plan = plan(GOOD, &sets).unwrap();
    assert_eq!(plan.budgets, [7, 20]);
    assert_eq!(plan.metrics.pairs, 7);
    assert_eq!(plan.materials[0].name, "mine");
    let albedo = &plan.materials[1].spec.resolved()["albedo"];
    assert_eq!(albedo.as_array().unwrap().len(), 3);
    assert_eq!(plan.question.as_deref(), Some("which one = best?"));
    assert_eq!(plan.channels.count(), 3);
    assert!(plan.output.schedules.0.is_some());
}

#[test]
fn symmetry_is_the_materials_own_unless_overridden() {
    let of = |sets: &[&str]| plan(GOOD, sets).unwrap().materials[0].symmetry;
    let own = of(&[]);
    assert!(own.isotropic && own.reciprocal && own.bilateral);
    let less = of(&["material.0.symmetry={bilateral=false}"]);
    assert!(less.isotropic && less.reciprocal && !less.bilateral);
    let anisotropic = of(&["material.0.alpha=[0.1, 0.4]"]);
    assert!(!anisotropic.isotropic);
}

#[test]
fn the_resolved_config_means_the_same() {
    let bare = "material = [{ kind = \"lambert\" }]\n";
    let anisotropic = "budgets = [300]\nmaterial = [{ kind = \"ward\", alpha = [0.1, 0.2] }]\n";
    let scattered = "material = [{ kind = \"lambert\" }]\nsample_set = [{ kind = \"sobol\" }]\n\
        reconstruction = [{ kind = \"inverse-distance\", coordinates = { kind = \"stark\" } }]\n";
    let tabulated = "[[material]]\nkind = \"tabulated\"\nof = { kind = \"ggx\", alpha = 0.5 }\n\
        symmetry = { bilateral = false }\n";
    for text in [GOOD, bare, anisotropic, scattered, tabulated, ALL_KEYS] {
        let first = plan(text, &[]).unwrap();
        let written = toml::to_string(&first.resolved).unwrap();
        let second = plan(&written, &[]).unwrap();
        assert_eq!(first.resolved, second.resolved, "{written}");
        assert_eq!(first.rows(), second.rows());
        assert_eq!(first.symmetries(), second.symmetries());
        // Defaults are written out.
        for key in ["channels = ", "seeds = [1", "pairs = ", "slices = false"] {
            assert!(written.contains(key), "{key} is not in\n{written}");
        }
    }
}

#[test]
fn output_needs_a_build_that_can_make_it() {
    let cases = [
        ("slices", "pictures", cfg!(feature = "pictures")),
        ("explore", "pictures", cfg!(feature = "pictures")),
        ("parquet", "parquet", cfg!(feature = "parquet")),
    ];
    for (key, feature, is_there) in cases {
        let set = format!("output.{key}=true");
        if is_there {
            let output = plan(GOOD, &[&set]).unwrap().output;
            let found = [output.slices, output.explore, output.parquet];
            let names = ["slices", "explore", "parquet"];
            assert_eq!(found, names.map(|of| of == key));
        } else {
            let told = format!(
                "output.{key} = true: this build of gonio cannot  … it lacks the feature {feature} \
                 (cargo install --path . --features {feature})"
            );
            says(&refusal(GOOD, &[&set]), &told);
        }
    }
}

/// What both kinds of configs may ask for.
const ALL_KEYS: &str = r#"
channels = "rgb"
quantities = ["moments", "albedo"]
budgets = [40, 200]
seeds = [1, 2]
measures = ["lobe"]
band = 1.2
material = [{ kind = "lambert" }]
parametrization = [{ kind = "hybrid" }]
sample_set = [{ kind = "grid" }, { kind = "sobol" }]
reconstruction = [{ kind = "cubic" }, { kind = "nearest", on = "sobol", up_to = 100 }]
coordinates = [{ kind = "own" }, { kind = "spherical" }]
metrics = { pairs = 50, max_pairs = 1 }
moments = { views = 3, order = 2 }
pictures = { draw = false, resolution = 32 }
output = { schedules = "csv" }
"#;

/// A config as that of an acquisition and of a study.
fn both(text: &str) -> [Plan; 2] {
    ["acquisition", "study"].map(|kind| plan(text, &[&format!("experiment={kind}")]).unwrap())
}

#[test]
fn acquisitions_and_studies_may_ask_for_the_same() {
    let [acquisition, study] = both(ALL_KEYS);
    // Cubic at two budgets, nearest in two coordinates at one, with two seeds each.
    assert_eq!(study.rows(), 2 * (2 + 2));
    let [mut a, mut b] = [&acquisition, &study].map(|p| p.resolved.clone());
    for (table, kind) in [(&mut a, "acquisition"), (&mut b, "study")] {
        let found = table.remove("experiment");
        assert_eq!(found.unwrap().as_str(), Some(kind));
    }
    assert_eq!(a, b);
    let labels = |plan: &Plan| -> Vec<_> {
        let expected = plan.expected(None).into_iter();
        expected.map(|e| (e.label.clone(), e.part)).collect()
    };
    // The same question is the same row, whoever asks.
    assert_eq!(labels(&acquisition), labels(&study));
}

#[test]
fn kinds_differ_in_what_they_do_unasked() {
    let bare = "material = [{ kind = \"lambert\" }]\n";
    let [acquisition, study] = both(bare);
    assert!(acquisition.albedo && !study.albedo);
    assert!(study.pictures.draw && !acquisition.pictures.draw);
    assert!(acquisition.moments.is_none() && study.moments.is_none());
    // Whoever writes the table wants its pictures.
    assert!(plan(bare, &["pictures={}"]).unwrap().pictures.draw);
}

#[test]
fn what_needs_a_grid_is_used_on_grids() {
    let two = "sample_set=[{kind=\"grid\"},{kind=\"sobol\"}]";
    let nearest = "reconstruction=[{kind=\"cubic\"},{kind=\"nearest\"}]";
    let plan = plan(GOOD, &[two, nearest]).unwrap();
    let mut labels = Vec::new();
    for unit in plan.units() {
        for method in plan.methods_on(&unit) {
            let set = &plan.sample_sets[unit.sample_set].name;
            labels.push(format!("{set} {}", plan.methods[method].name));
        }
    }
    // Two budgets of each set.
    let (grid, sobol) = (["grid cubic", "grid nearest"], ["sobol nearest"]);
    assert_eq!(labels, [&grid[..], &grid, &sobol, &sobol].concat());
    // A set that nothing works on is a mistake.
    let idle = "sample_set[1] \"sobol\" has no reconstruction";
    says(&refusal(GOOD, &[two]), idle);
    // Axes of the 4-D form, which an anisotropic material needs, have names of their own.
    let anisotropic = "material.0.alpha=[0.1, 0.4]";
    let message = refusal(GOOD, &[anisotropic, "sample_set.0.ratio=[4, 4, 1]"]);
    says(&message, "ratio … phi_h");
}

/// Asks to stop as soon as something is reconstructed, to be compared.
#[derive(Default)]
struct Impatient {
    reconstructing: bool,
    rows: usize,
}

impl Observer<Row> for Impatient {
    fn cancelled(&self) -> bool {
        self.reconstructing
    }

    fn observe(&mut self, event: &Event<'_, Row>) -> Result<(), Error> {
        match event {
            Event::Doing(what) => {
                self.reconstructing = what.to_string().starts_with("reconstructing");
            }
            Event::Made(rows) => self.rows += rows.len(),
            _ => {}
        }
        Ok(())
    }
}

#[test]
fn a_run_stops_within_its_last_stage_too() {
    let plan = plan("[[material]]\nkind = \"lambert\"", &["budgets=[50]"]).unwrap();
    let mut observer = Impatient::default();
    let summary = plan.run(&Extent::default(), &Known::new(), &mut observer);
    let summary = summary.unwrap();
    assert!(summary.interrupted && observer.reconstructing);
    assert_eq!((summary.rows, observer.rows), (0, 0));
}
