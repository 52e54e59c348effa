//! Priors as a user meets them: made of materials, named by planners and reconstructions.

use super::Bench;
use super::pages::of_repository;
use super::planning::after;
use std::fs;

/// The first line of a file of a prior, and its numbers.
fn parts(bytes: &[u8]) -> (serde_json::Value, Vec<f64>) {
    let end = bytes.iter().position(|b| *b == b'\n').unwrap();
    let numbers = bytes[end + 1..].as_chunks::<2>().0.iter();
    let numbers = numbers.map(|b| half::f16::from_le_bytes(*b).to_f64());
    let head = serde_json::from_slice(&bytes[..end]).unwrap();
    (head, numbers.collect())
}

#[test]
fn the_built_in_prior_is_made_of_the_families_of_a_config() {
    let bench = Bench::new();
    let config = fs::read_to_string(of_repository("configs/families.toml")).unwrap();
    // As the config says.
    let line = config.lines().find(|line| line.contains("gonio train"));
    let words: Vec<&str> = line.unwrap().split_whitespace().skip(2).collect();
    let place = words.iter().position(|w| *w == "-o").unwrap() + 1;
    let kept = fs::read(of_repository(words[place])).unwrap();
    let families = of_repository(words[1]);
    let mut line = words.clone();
    (line[1], line[place]) = (families.to_str().unwrap(), "again.gonio");
    bench.good(line.join(" "));
    let again = bench.read_bytes("again.gonio");
    let ((kept, a), (again, b)) = (parts(&kept), parts(&again));
    for key in ["gonio_prior", "nodes", "functions", "centres", "materials"] {
        assert_eq!(kept[key], again[key]);
    }
    for key in ["scale", "share"] {
        let ratio = kept[key].as_f64().unwrap() / again[key].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 1e-9, "{key}");
    }
    // Processors round sums of products each in their way.
    assert_eq!(a.len(), b.len());
    let both = a.iter().zip(&b);
    let off = both.map(|(a, b)| (a - b).abs() / (1.0 + a.abs()));
    assert!(off.fold(0.0, f64::max) < 0.01);
}

/// Glossy materials of two families.
fn families() -> String {
    let material = |i: i32| {
        let (alpha, albedo) = (0.1 + 0.02 * f64::from(i), 0.1 + 0.05 * f64::from(i % 4));
        let name = format!("{i}-{}", ["paint", "plastic"][i as usize % 2]);
        format!(
            "[[material]]\nname = \"{name}\"\nkind = \"sum\"\ncomponent = [\
             {{ weight = 1.0, brdf = {{ kind = \"ggx\", alpha = {alpha:.2} }} }}, \
             {{ weight = {albedo:.2}, brdf = {{ kind = \"lambert\", albedo = 1.0 }} }}]\n"
        )
    };
    "experiment = \"moments\"\n".to_owned() + &(0..12).map(material).collect::<String>()
}

const STUDY: &str = "budgets = [4]\n\
    [[material]]\nname = \"new\"\nkind = \"sum\"\ncomponent = [\
    { weight = 1.0, brdf = { kind = \"ggx\", alpha = 0.17 } }, \
    { weight = 0.12, brdf = { kind = \"lambert\", albedo = 1.0 } }]\n\
    [[parametrization]]\nkind = \"half-difference\"\n\
    [[sample_set]]\nkind = \"adaptive\"\nprior = \"p.gonio\"\n\
    [[reconstruction]]\nkind = \"kriging\"\nprior = \"p.gonio\"\n\
    [[reconstruction]]\nkind = \"kriging\"\n";

#[test]
fn a_prior_helps_where_readings_are_few_and_never_knows_what_is_tested() {
    let bench = Bench::new();
    bench.write("f.toml", families());
    let train = "train f.toml --nodes 1500 --functions 6 -o p.gonio";
    let told = "12 materials of 2 families, 6 functions";
    bench.does(&format!(
        "0 | {train} | {told}
         2 | {train} | p.gonio … --force"
    ));
    bench.write("c.toml", STUDY);
    bench.good("run c.toml -o r -q");
    let error = |name: &str| {
        let rows = bench.rows("r");
        let of = |r: &&gonio::experiment::Row| r.reconstruction == name && r.measure == "cosine";
        let row = rows.iter().find(of).unwrap();
        (row.key.clone(), row.value("nrmse").unwrap())
    };
    let (key, with) = error("kriging-prior");
    assert!(with < 0.5 * error("kriging").1, "{with}");
    // Nothing is made twice, also where the file lies elsewhere.
    fs::rename(bench.path("p.gonio"), bench.path("q.gonio")).unwrap();
    bench.write("d.toml", STUDY.replace("p.gonio", "q.gonio"));
    bench.good("run d.toml -o s -q");
    assert_eq!(bench.rows("s")[0].key, bench.rows("r")[0].key);
    // Another prior is another question, if only for the families of its materials.
    let renamed = families().replace("-plastic", "-paint");
    bench.write("g.toml", renamed);
    bench.tells(train.replace("f.toml", "g.toml"), "not fitted");
    bench.good("run c.toml -o r -q");
    assert_ne!(error("kriging-prior").0, key);
    fs::remove_file(bench.path("p.gonio")).unwrap();
    let fewer = train.replace("-o p", "--except 3-plastic,4-paint -o p");
    assert!(bench.good(&fewer).starts_with("10 materials"));
    bench.good("run c.toml -o r -q");
    assert_ne!(error("kriging-prior").0, key);

    let misspelt = train.replace("-o p", "--except 3-plastik -o x");
    bench.does(&format!(
        "2 | {misspelt} | did you mean 3-plastic?
         2 | check c.toml --set reconstruction.0.prior=no.gonio | prior = \"no.gonio\" … gonio train"
    ));
    let all = families();
    let (_, tested) = all.split_once("[[").unwrap();
    let tested = tested.split("[[").next().unwrap();
    let methods = &STUDY[STUDY.find("[[parametrization").unwrap()..];
    bench.write("t.toml", format!("budgets = [4]\n[[{tested}{methods}"));
    let told = "sample_set[0].prior = \"p.gonio\" was made of \"0-paint\", which is the tested";
    bench.refuses("check t.toml", 2, told);
}

#[test]
fn a_laboratory_begins_with_what_others_were_like() {
    let bench = Bench::new();
    let next = "next --planner adaptive --set prior=\"built-in\" --batch 4";
    bench.good(format!("{next} -o a.csv"));
    let config = of_repository("configs/quickstart.toml");
    let of = format!("--config {} --material ggx-0.3", config.to_str().unwrap());
    bench.good(format!("measure a.csv {of} -o ar.csv"));
    let told = format!("{next} ar.csv -o b.csv");
    let told = bench.tells(told, "so far: 4 poses, 4 readings");
    let [now, then] = ["now", "then"].map(|at| after(&told, &format!("{at}: expected nrmse ")));
    assert!(then < now && now < 2.0, "{told}");
}
