//! Configs: every mistake is one sentence that names the place, the key, the value and what is
//! allowed; the resolved config means the same as the one it was made from.
#![cfg(feature = "experiments")]

mod common;

use common::table;
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

fn refusal(text: &str, sets: &[&str]) -> (String, u8) {
    match plan(text, sets) {
        Ok(_) => panic!("accepted: {sets:?}\n{text}"),
        Err(e) => (e.to_string(), e.exit_code()),
    }
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
        1000, | 1000000000, | c.toml:5: budgets[1] = 1000000000: allowed is a whole number from 1
        1000, | 250, | c.toml:5: budgets[1] = 250 is there twice
        1000, | 1e3, | c.toml:5: budgets[1] is floating point `1000.0`; allowed: a whole number
        1000, | "many", | c.toml:5: budgets[1] is string "many"; allowed: a whole number
        ["cosine"] | ["sine"] | c.toml:7: measures[0] = "sine"; allowed: cosine, lobe
        ["cosine"] | "cosine" | c.toml:7: measures is string "cosine"; allowed: a list
        "ggx" | "ggg" | c.toml:10: kind = "ggg" is not a material; allowed:
        kind = "ggx" |  | c.toml:9: kind is missing from the material; allowed:
        alpha = 0.3 | alpha = 0.0 | c.toml:11: material[0].alpha = 0: allowed is a number
        alpha = 0.3 | alpha = -0.5 | c.toml:11: material[0].alpha = -0.5: allowed is a number
        alpha = 0.3 | alpha = nan | c.toml:11: material[0].alpha = NaN: allowed is a number
        alpha = 0.3 | alpha = inf | c.toml:11: material[0].alpha = inf: allowed is a number
        alpha = 0.3 | alpha = true | c.toml:11: material[0].alpha = true: allowed is a number
        albedo = 0.5 | albdeo = 0.5 | c.toml:15: unknown key material[1].albdeo; allowed: kind, name, symmetry, albedo
        albedo = 0.5 | name = "ggx-0.3" | c.toml:15: material[1].name = "ggx-0.3" is taken
        albedo = 0.5 | name = " " | c.toml:15: material[1].name = " ": allowed is a text
        albedo = 0.5 | name = 7 | c.toml:15: name is 7; allowed: a string
        albedo = 0.5 | symmetry = { isotopic = true } | c.toml:15: unknown key material[1].symmetry.isotopic; allowed: isotropic, reciprocal, bilateral
        "hybrid" | "hibrid" | c.toml:18: kind = "hibrid" is not a parametrization; allowed: spherical,
        h_bar = | theta_h = | c.toml:19: parametrization[0].warp.theta_h = "square-root": no axis of hybrid; allowed: h_bar, k, delta
        "square-root" | "merl" | c.toml:19: parametrization[0].warp.h_bar = "merl":
        "square-root" | "sqrt" | c.toml:19: parametrization[0].warp.h_bar = "sqrt"; allowed: square-root, merl, arcsine
        "square-root" | { kind = "power", exponent = 1.5 } | c.toml:19: parametrization[0].warp.h_bar: exponent = 1.5: allowed is a number in [0.1, 1]
        "square-root" | { kind = "power", exponnent = 0.5 } | c.toml:19: parametrization[0].warp.h_bar: unknown key `exponnent`, expected `exponent`
        "square-root" | "power" | c.toml:19: parametrization[0].warp.h_bar lacks the key exponent
        "square-root" | { kind = "cube" } | c.toml:19: parametrization[0].warp.h_bar: kind = "cube" is not a warp; allowed: square-root, merl, arcsine, power
        "grid" | "grid"\nratio = "tuned" | c.toml:23: sample_set[0].ratio = "tuned" lacks what it is tuned on; allowed: with [tuning]
        "grid" | "grid"\nratio = "best" | c.toml:23: sample_set[0].ratio is string "best"; allowed: a list of numbers, or "tuned"
        [metrics] | [tuning]\nmaterials = [{ kind = "lambert" }]\n[metrics] | c.toml:27: tuning is never used; allowed: with a [[sample_set]] of ratio = "tuned"
        "grid" | "sobol" | c.toml:24: reconstruction[0] "cubic" is never used; allowed: an up_to that a budget stays within, and a grid
        "grid" | "grid"\nratio = [1, 2] | c.toml:23: ratio = [1.0, 2.0]: allowed is a number in [0.001, 1000] per axis (h_bar, k, delta) in hybrid
        "grid" | "grid"\nratio = [1, nan, 1] | c.toml:23: ratio = [1.0, NaN, 1.0]: allowed
        "cubic" | "cubic"\nepsilon = -1.0 | c.toml:26: epsilon = -1: allowed is
        pairs = 100 | pears = 100 | c.toml:28: unknown key metrics.pears; allowed: pairs, max_pairs, tolerance, mask_deg
        pairs = 100 | pairs = 0 | c.toml:28: metrics.pairs = 0: allowed is
        80.0 | nan | c.toml:30: metrics.mask_deg = NaN: allowed is
        slices = false | slices = 1 | c.toml:33: output.slices is integer `1`; allowed: true or false
        slices = false | schedules = true | c.toml:33: output.schedules is boolean `true`; allowed: false or one of "csv", "json-lines"
        slices = false | schedules = "xml" | c.toml:33: output.schedules is string "xml"; allowed: false
        question = "?" | merl = 3 | c.toml:1: merl is 3; allowed: a table
        seeds = [1] | seeds = [1 | c.toml:3:
        seeds = [1] | merl = { interpolation = "nearest" } | c.toml:2: merl has keys for the files of materials_dir, which is not set"#,
    ) {
        assert!(GOOD.contains(written), "{written}");
        let text = GOOD.replacen(written, instead, 1);
        let (message, code) = refusal(&text, &[]);
        assert!(message.starts_with(expected), "{instead}\n  {message}");
        assert_eq!(code, 2, "{message}");
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn warps_with_keys_are_named_by_them() {
    let text = GOOD.replacen(
        "\"square-root\"",
        "{ kind = \"power\", exponent = 0.3 }, k = { kind = \"arcsine\" }",
        1,
    );
    let plan = plan(&text, &[]).unwrap();
    assert_eq!(plan.parametrizations[0].warp, "h_bar:power-0.3;k:arcsine");
    let resolved = plan.resolved.to_string();
    assert!(resolved.contains("k = \"arcsine\""), "{resolved}");
    let again = self::plan(&resolved, &[]).unwrap();
    assert_eq!(again.resolved, plan.resolved);
    assert_eq!(
        again.parametrizations[0].warp,
        plan.parametrizations[0].warp
    );
}

#[test]
fn a_mistake_in_an_override_is_reported_with_the_override() {
    // (the override, the message after it)
    for [set, expected] in table(
        r#"
        nothing | has no `=`; allowed: key=value
        =3 | `` is no key
        a b=3 | `a b` is no key
        qestion=why | unknown key qestion; allowed: question
        metrics.pears=3 | unknown key metrics.pears; allowed: pairs
        metric.pairs=3 | unknown key metric; allowed: question
        material.2.alpha=0.1 | `2` is no position in material, which has 2; allowed: 0 to 1
        material.x.alpha=0.1 | `x` is no position in material
        material.all.beta=0.1 | no member has the key of `material.all.beta`
        metrics.all.pairs=3 | unknown key metrics.all
        budgets.2=5 | `2` is no position in budgets
        budgets.0.x=5 | budgets[0] is integer, which has no key `x`
        budgets.0=0 | budgets[0] = 0: allowed
        budgets=0 | budgets is integer `0`; allowed: a list
        budgets=nan | budgets is floating point `NaN`; allowed: a list
        material.0.alpha=nan | material[0].alpha = NaN: allowed
        material.0.alpha=wide | material[0].alpha = "wide": allowed is a number
        material.0=3 | material[0] is a table, not integer; allowed: {
        material=[] | material is missing; allowed: at least one [[material]], or materials_dir
        material.0={kind="merl"} | material[0] lacks the key path
        channels=grey | channels = "grey"; allowed: luminance
        parametrization=[{kind="stark"},{kind="stark"}] | parametrization[1] = "stark" is there twice
        reconstruction=[{kind="cubic"},{kind="cubic"}] | reconstruction[1].name = "cubic" is taken
        sample_set=[] | sample_set = []: allowed is at least one"#,
    ) {
        let (message, code) = refusal(GOOD, &[set]);
        let expected = format!("--set {set}: {expected}");
        assert!(message.starts_with(&expected), "{set}\n  {message}");
        assert_eq!(code, 2, "{message}");
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
    let (message, _) = refusal(&two, &["material.all.alpha=0"]);
    assert!(
        message.starts_with("--set material.all.alpha=0: material[0]"),
        "{message}"
    );
}

#[test]
fn lines_are_those_of_the_file_whatever_was_set() {
    let sets = ["metrics.seed=5", "material.0.name=first", "question=why"];
    let text = GOOD.replace("slices = false", "slices = 0");
    let (message, _) = refusal(&text, &sets);
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
    assert_eq!(
        plan.materials[1].spec.resolved()["albedo"]
            .as_array()
            .unwrap()
            .len(),
        3
    );
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
fn a_warp_must_suit_the_form_of_every_material() {
    // Axes of the 4-D form, which the anisotropic material needs, have names of their own.
    let sets = [
        "material.0.alpha=[0.1, 0.4]",
        "sample_set.0.ratio=[4, 4, 1]",
    ];
    let (message, _) = refusal(GOOD, &sets);
    assert!(
        message.contains("ratio") && message.contains("phi_h"),
        "{message}"
    );
}

#[test]
fn the_resolved_config_means_the_same() {
    let bare = "[[material]]\nkind = \"lambert\"\n";
    let anisotropic = "budgets = [300]\n[[material]]\nkind = \"ward\"\nalpha = [0.1, 0.2]\n";
    let scattered = "[[material]]\nkind = \"lambert\"\n[[sample_set]]\nkind = \"sobol\"\n\
        [[reconstruction]]\nkind = \"inverse-distance\"\ncoordinates = { kind = \"stark\" }\n";
    let tabulated = "[[material]]\nkind = \"tabulated\"\nof = { kind = \"ggx\", alpha = 0.5 }\n\
        symmetry = { bilateral = false }\n";
    for text in [GOOD, bare, anisotropic, scattered, tabulated] {
        let first = plan(text, &[]).unwrap();
        let written = toml::to_string(&first.resolved).unwrap();
        let second = plan(&written, &[]).unwrap();
        assert_eq!(first.resolved, second.resolved, "{written}");
        assert_eq!(first.rows(), second.rows());
        assert_eq!(first.symmetries(), second.symmetries());
    }
}

#[test]
fn defaults_are_written_out() {
    let plan = plan("[[material]]\nkind = \"lambert\"\n", &[]).unwrap();
    let resolved = toml::to_string(&plan.resolved).unwrap();
    for key in [
        "channels = \"luminance\"",
        "seeds = [1]",
        "pairs = ",
        "kind = \"grid\"",
        "slices = false",
    ] {
        assert!(resolved.contains(key), "{key} is not in\n{resolved}");
    }
}

#[test]
fn anisotropic_tables_are_refused_before_they_are_made() {
    let text = "[[material]]\nkind = \"tabulated\"\nof = { kind = \"ggx\", alpha = [0.1, 0.3] }\n";
    let (message, code) = refusal(text, &[]);
    assert!(
        message.starts_with("c.toml:3: material[0].of = ggx"),
        "{message}"
    );
    assert_eq!(code, 2);
}

#[test]
fn output_needs_a_build_that_can_make_it() {
    let cases = [
        ("slices", "pictures", cfg!(feature = "pictures")),
        ("parquet", "parquet", cfg!(feature = "parquet")),
    ];
    for (key, feature, is_there) in cases {
        let set = format!("output.{key}=true");
        if is_there {
            let output = plan(GOOD, &[&set]).unwrap().output;
            assert_eq!(
                [output.slices, output.parquet],
                [key == "slices", key == "parquet"]
            );
        } else {
            let (message, code) = refusal(GOOD, &[&set]);
            let told = [
                format!("output.{key} = true: this build of gonio cannot "),
                format!(
                    "it lacks the feature {feature} (cargo install --path . --features {feature})"
                ),
            ];
            assert!(told.iter().all(|part| message.contains(part)), "{message}");
            assert_eq!(code, 2);
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

[[material]]
kind = "lambert"

[[parametrization]]
kind = "hybrid"

[[sample_set]]
kind = "grid"

[[sample_set]]
kind = "sobol"

[[reconstruction]]
kind = "cubic"

[[reconstruction]]
kind = "nearest"
on = "sobol"
up_to = 100

[[coordinates]]
kind = "own"

[[coordinates]]
kind = "spherical"

[metrics]
pairs = 50
max_pairs = 1

[moments]
views = 3
order = 2

[pictures]
draw = false
resolution = 32

[output]
schedules = "csv"
"#;

#[test]
fn acquisitions_and_studies_may_ask_for_the_same() {
    let [acquisition, study] = ["acquisition", "study"].map(|kind| {
        let set = format!("experiment={kind}");
        plan(ALL_KEYS, &[&set]).unwrap()
    });
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
    let bare = "[[material]]\nkind = \"lambert\"\n";
    let [acquisition, study] = ["acquisition", "study"].map(|kind| {
        let set = format!("experiment={kind}");
        plan(bare, &[&set]).unwrap()
    });
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
    let labels: Vec<_> = plan
        .units()
        .iter()
        .flat_map(|unit| {
            let set = plan.sample_sets[unit.sample_set].name.clone();
            let methods = plan.methods_on(unit).into_iter();
            let named = methods.map(|m| plan.methods[m].name.clone());
            named
                .map(move |name| (set.clone(), name))
                .collect::<Vec<_>>()
        })
        .collect();
    let pair = |set: &str, name: &str| (set.to_owned(), name.to_owned());
    let of_budget = [
        vec![pair("grid", "cubic"), pair("grid", "nearest")],
        vec![pair("sobol", "nearest")],
    ];
    // Two budgets of each set.
    let expected = of_budget
        .map(|pairs| [pairs.clone(), pairs].concat())
        .concat();
    assert_eq!(labels, expected);
    // A set that nothing works on is a mistake, and so is what works on no set.
    let (message, code) = refusal(GOOD, &[two]);
    assert!(
        message.contains("sample_set[1] \"sobol\" has no reconstruction"),
        "{message}"
    );
    assert_eq!(code, 2);
    let sobol = "sample_set=[{kind=\"sobol\"}]";
    let (message, code) = refusal(GOOD, &[sobol, nearest]);
    assert!(
        message.contains("reconstruction[0] \"cubic\" is never used"),
        "{message}"
    );
    assert_eq!(code, 2);
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
