//! The rows of a short form of each config, to the bit: a change of the source that is to change no result changes none of
//! these. `GONIO_BLESS=1 cargo test --test cli short_forms -- --ignored` writes `tests/golden/configs.tsv` anew.

use super::pages::of_repository;
use super::{Bench, RESULTS_REVISION};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::{env, fs};

/// Options of all that measure.
const ACQUISITION: &str =
    "--set budgets=[60,200] --set seeds=[1] --set metrics.pairs=512 --set metrics.max_pairs=512";

/// A surface that is small, in place of those of a config.
const SURFACE: &str = "--set material.all.surfaces=1 --set material.all.surface={kind=\"gaussian\",rms_slope=0.3,size=48}";

/// A material of one small surface and few paths.
const MATERIAL: &str = "--set material=[{name=\"m\",kind=\"micro-surface\",surface={kind=\"gaussian\",rms_slope=0.3,size=48},\
     facets={kind=\"mirror\"},surfaces=1,paths=16}]";

/// Each config, and what makes it short.
const SHORT: [(&str, &[&str]); 18] = [
    ("barla2015", &[ACQUISITION, "--shard 1/340"]),
    (
        "bounces",
        &[
            SURFACE,
            "--set moments.views=1 --set moments.order=1 --set moments.estimator.tolerance=0.1 --shard 1/9",
        ],
    ),
    ("causes", &[ACQUISITION]),
    ("convergence", &[ACQUISITION]),
    ("doubling", &[ACQUISITION, "--shard 1/4"]),
    ("families", &["--set moments.views=2 --shard 1/20"]),
    ("grids", &[ACQUISITION]),
    ("instruments", &[ACQUISITION, "--shard 1/8"]),
    ("merl", &[ACQUISITION]),
    (
        "micro",
        &[
            ACQUISITION,
            MATERIAL,
            "--set quantities=[] --set metrics.pairs=64 --set metrics.max_pairs=64 --set measures=[\"cosine\"] --shard 1/40",
        ],
    ),
    (
        "moments-study",
        &["--set budgets=[64] --set moments.views=2 --shard 1/40"],
    ),
    (
        "pictures",
        &[
            "--set budgets=[200] --set minutes=[2] --set metrics.pairs=512 --set metrics.max_pairs=512 --shard 1/8",
        ],
    ),
    ("planning", &[ACQUISITION, "--shard 1/4"]),
    ("published", &[ACQUISITION, "--shard 1/8"]),
    ("quickstart", &[ACQUISITION]),
    ("relations", &["--set relations.views_deg=[30] --shard 1/3"]),
    ("study", &[ACQUISITION, "--shard 1/4"]),
    ("zubiaga2015", &["--set moments.views=2 --shard 1/8"]),
];

#[test]
#[ignore = "thorough: a short form of each config"]
fn short_forms_of_configs_have_the_rows_that_they_had() {
    let bench = Bench::new().with_configs();
    fs::create_dir(bench.path("materials")).unwrap();
    // Of the materials that the papers name, two.
    for name in ["gold-metallic-paint3", "pink-felt"] {
        let file = format!("materials/{name}.binary");
        let table = "tabulate configs/quickstart.toml --material ggx-0.3";
        bench.good(format!("{table} -o {file}"));
    }
    let configs = fs::read_dir(of_repository("configs")).unwrap();
    let configs = configs.filter_map(|entry| {
        let name = entry.unwrap().file_name().into_string().unwrap();
        name.strip_suffix(".toml").map(String::from)
    });
    let listed = SHORT.map(|(name, _)| name.to_owned());
    assert_eq!(configs.collect::<BTreeSet<_>>(), BTreeSet::from(listed));
    let mut found = format!("revision\t{RESULTS_REVISION}\n");
    for (name, options) in SHORT {
        let config = format!("configs/{name}.toml");
        bench.good(format!("run {config} -q -o {name} {}", options.join(" ")));
        let rows = ["results", "profiles", "relations"];
        let rows = rows.map(|rows| bench.path(&format!("{name}/{rows}.jsonl")));
        let rows = rows.map(|rows| fs::read_to_string(rows).unwrap_or_default());
        let rows = rows.concat();
        assert!(!rows.is_empty(), "{name}");
        let hash = blake3::hash(rows.as_bytes()).to_hex();
        writeln!(found, "{name}\t{}\t{}", rows.lines().count(), &hash[..16]).unwrap();
    }
    let golden = of_repository("tests/golden/configs.tsv");
    if env::var_os("GONIO_BLESS").is_some() {
        fs::write(&golden, &found).unwrap();
    }
    let expected = fs::read_to_string(&golden).unwrap();
    let differ = found.lines().zip(expected.lines()).filter(|(a, b)| a != b);
    let differ: Vec<_> = differ.collect();
    assert!(
        differ.is_empty() && found.len() == expected.len(),
        "{differ:?}: where numbers are to change, RESULTS_REVISION rises and GONIO_BLESS=1 writes the file anew"
    );
}
