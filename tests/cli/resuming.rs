//! Runs of every kind go on where they were, in parts or whole, and end the same.

use super::common::table;
use super::{Bench, SMALL, assert_same, results, utia, whole_run};
use serde_json::json;
use std::fs;

/// A kind of run: its config, the file of its records, how many there are, and of how many jobs.
struct Kind {
    text: String,
    records: &'static str,
    rows: usize,
    jobs: usize,
}

const MATTE: &str = r#"
material = [
  { name = "a", kind = "lambert", albedo = 0.2 },
  { name = "b", kind = "lambert", albedo = 0.5 },
  { name = "c", kind = "lambert", albedo = 0.8 },
]
"#;

/// One of each.
fn kinds() -> [Kind; 4] {
    let second = "  { kind = \"half-difference\", warp = { theta_h = \"square-root\" } },\n";
    let small = SMALL.replace(second, "").replace("[60, 150]", "[60]");
    let small = small.replace("seeds = [1, 2]", "seeds = [1]");
    let moments = |kind: &str, order: usize| {
        format!(
            "experiment = {kind:?}{MATTE}[moments]\nviews = 3\norder = {order}\n\
             estimator = {{ kind = \"peak-resolving\", tolerance = 1e-2 }}\n"
        )
    };
    let lights = "relations = { views_deg = [30], tolerance = 1e-2, components = 1 }\n\
        lighting = [{ kind = \"blob\", theta_deg = 40, phi_deg = 180, width_deg = 10 }]\n";
    let kind = |text: String, records, rows, jobs| Kind {
        text,
        records,
        rows,
        jobs,
    };
    let acquisition = format!("{small}output = {{ schedules = \"csv\", slices = true }}\n");
    let study = format!("experiment = \"study\"\n{small}pictures = {{ draw = false }}\n");
    let relations = lights.to_owned() + &moments("relations", 2);
    [
        kind(acquisition, "results.jsonl", 16, 8),
        kind(study, "results.jsonl", 16, 8),
        kind(moments("moments", 2), "profiles.jsonl", 3, 3),
        kind(relations, "relations.jsonl", 3, 3),
    ]
}

/// A folder with the config `c.toml` of a kind, and a whole run of it in `a`.
fn whole(kind: &Kind) -> (Bench, String) {
    let bench = Bench::of(&kind.text);
    let text = bench.good("run c.toml -q -o a");
    let records = bench.read(&format!("a/{}", kind.records));
    assert_eq!(records.lines().count(), kind.rows);
    (bench, text)
}

const AGAIN: &str = "run c.toml -q -o a";

/// Neither by itself, nor by a part of it, which is refused, nor by `--force`.
#[test]
fn what_is_done_is_told_again_and_stays() {
    for kind in kinds() {
        let (bench, text) = whole(&kind);
        let path = bench.path("a").join(kind.records);
        let (files, records) = (bench.files("a"), fs::read(&path).unwrap());
        let before = results(&bench, "a");
        let manifest_is_whole = || {
            let manifest = bench.manifest("a");
            assert_eq!(manifest["files"], json!(files));
            assert_eq!(manifest["status"], "complete");
            // Those that are there, not those of the second time.
            assert_eq!(manifest["rows"], kind.rows);
        };
        manifest_is_whole();
        // Every digit of what is printed, the seconds too.
        assert_eq!(bench.good(AGAIN), text);
        assert!(fs::read(&path).unwrap() == records, "{}", kind.text);
        manifest_is_whole();
        let list = bench.good("run c.toml -o a --list");
        let done = list.lines().filter(|l| l.starts_with("done  ")).count();
        assert_eq!(done, kind.jobs, "{list}");
        let last = format!("{0} of {0} jobs are done in a\n", kind.jobs);
        assert!(list.ends_with(&last), "{list}");
        bench.refuses(format!("{AGAIN} --shard 1/2"), 2, "--shard 1/2");
        // Nor is it one of another kind.
        let other = kinds().into_iter().find(|k| k.records != kind.records);
        bench.write("other.toml", other.unwrap().text);
        for force in ["", "--force"] {
            let told = "a: … is here … another folder with -o";
            bench.refuses(format!("run other.toml -o a {force}"), 2, told);
        }
        assert_eq!(bench.files("a"), files);
        assert_same(&before, &results(&bench, "a"));
        // What it leaves repeats it.
        bench.good("run a/config.toml -q -o again");
        assert_same(&before, &results(&bench, "again"));
        // All of it again: another run with the same results, in other times.
        let times = bench.read("a/timings.jsonl");
        bench.good(format!("{AGAIN} --force"));
        assert_same(&before, &results(&bench, "a"));
        assert!(times != bench.read("a/timings.jsonl"), "{}", kind.text);
    }
}

#[test]
fn what_a_crash_leaves_is_gone_on_with() {
    for (at, kind) in kinds().into_iter().enumerate() {
        let (bench, _) = whole(&kind);
        let path = bench.path("a").join(kind.records);
        let before = results(&bench, "a");
        let whole = fs::read(&path).unwrap();
        let lines: Vec<usize> = (0..whole.len()).filter(|&i| whole[i] == b'\n').collect();
        let kept = kind.rows / 3;
        let line = lines[kept - 1] + 1;
        // In the middle of a line and of a character, where a line was to be, and before the first line.
        let cut = [&whole[..line + 40], b"\xc3", &[0; 100]].concat();
        let zeros = [&whole[..line], &[0; 100]].concat();
        let all = [cut, zeros, Vec::new(), vec![0; 3]];
        // Records of every kind are written and read by the same code: each end for one kind.
        let ends = if at == 0 { 4 } else { 1 };
        for left in all.into_iter().take(ends) {
            let kept = if left.len() > 3 { kept } else { 0 };
            fs::write(&path, &left).unwrap();
            fs::remove_file(bench.path("a/manifest.json")).unwrap();
            let list = bench.good("run c.toml -o a --list");
            let open = list.lines().filter(|l| l.starts_with("open  ")).count();
            let per_job = kind.rows / kind.jobs;
            assert_eq!(open, kind.jobs - kept / per_job, "{list}");
            // Who looks does not touch.
            assert!(fs::read(&path).unwrap() == left);
            bench.good(AGAIN);
            assert_same(&before, &results(&bench, "a"));
            let again = fs::read(&path).unwrap();
            assert!(again[..lines[0]] == whole[..lines[0]] || kept == 0);
            let list = bench.good("run c.toml -o a --list");
            assert!(!list.contains("open  "), "{list}");
        }
    }
}

#[test]
fn parts_make_up_the_whole() {
    for kind in kinds() {
        let (bench, _) = whole(&kind);
        let mut rows = 0;
        // What a part has it has as a table too.
        let table = kind.records.replace("jsonl", "csv");
        let lines = |run: &str| bench.lines(&format!("{run}/{table}"));
        let mut of_parts = Vec::new();
        for part in [1, 2] {
            let shard = format!("{part}/2");
            let list = bench.tells(format!("run c.toml --shard {shard} --list"), "open  ");
            assert!(!list.contains("done  "), "{list}");
            bench.good(format!("run c.toml -q --shard {shard}"));
            let folder = format!("runs/c.shard-{part}-of-2");
            let records = bench.read(&format!("{folder}/{}", kind.records));
            assert!((1..kind.rows).contains(&records.lines().count()));
            rows += records.lines().count();
            of_parts.extend(lines(&folder));
            assert!(!bench.path(&folder).join("report.html").exists());
        }
        assert_eq!(rows, kind.rows);
        let mut of_whole = lines("a");
        of_whole.sort();
        of_parts.sort();
        assert_eq!(of_parts, of_whole);
        let parts = "runs/c.shard-1-of-2 runs/c.shard-2-of-2";
        // Without a part: what is there is there, and the exit code says that it is not all.
        bench.ends("merge runs/c.shard-1-of-2 -o merged", 5);
        assert_eq!(bench.manifest("merged")["status"], "incomplete");
        let merge = format!("merge {parts} -o merged --force");
        let text = bench.ends(&merge, 0);
        let last = format!("{0} of {0} rows are in merged\n", kind.rows);
        assert!(text.ends_with(&last), "{text}");
        assert_same(&whole_run(&bench, "a"), &whole_run(&bench, "merged"));
        assert_eq!(bench.files("merged"), bench.files("a"));
        assert_eq!(bench.manifest("merged")["status"], "complete");
        let onto_itself = "merge runs/c.shard-1-of-2 -o runs/c.shard-1-of-2 --force";
        bench.refuses(onto_itself, 2, "one of the parts");
        // What was put together is a run like any other.
        let list = bench.good("run c.toml -o merged --list");
        assert!(!list.contains("open  "), "{list}");
    }
}

#[test]
fn notes_of_somebody_else_are_not_cut() {
    let bench = Bench::new();
    for kind in kinds() {
        bench.write("c.toml", &kind.text);
        fs::create_dir_all(bench.path("mine")).unwrap();
        let notes = bench.path("mine").join(kind.records);
        fs::write(&notes, "my notes").unwrap();
        bench.does(
            "3 | run c.toml -q -o mine | no record
             3 | run c.toml -q -o mine --force",
        );
        assert_eq!(fs::read_to_string(&notes).unwrap(), "my notes");
        // Records of another version stop no run, nor what a crash left half written.
        fs::write(&notes, "{\"key\":\"0123\",\"of\":\"old\"}\n").unwrap();
        bench.write("mine/.gonio-1-2.part", "half");
        bench.does(
            "3 | run c.toml -q -o mine
             0 | run c.toml -q -o mine --force",
        );
        let records = fs::read_to_string(&notes).unwrap();
        assert_eq!(records.lines().count(), kind.rows);
        assert!(!bench.path("mine/.gonio-1-2.part").exists());
        fs::remove_dir_all(bench.path("mine")).unwrap();
    }
}

#[test]
fn parts_made_elsewhere_are_put_together_and_parts_that_differ_are_not() {
    let bench = Bench::new();
    let part = |place: &str, shard: &str, value: f64| {
        fs::create_dir_all(bench.path(place)).unwrap();
        bench.write(&format!("{place}/a.bin"), utia(value));
        let table = format!("{{ kind = \"utia\", path = \"{place}/a.bin\" }}");
        let text = "budgets = [60, 90]\npictures = { draw = false }";
        bench.write("c.toml", format!("{text}\nmaterial = [{table}]\n"));
        let run = format!("run c.toml -q --shard {shard} --force");
        bench.good(format!("{run} -o part-{place}"));
    };
    part("here", "1/2", 0.1);
    part("there", "2/2", 0.1);
    // Files of others, and folders, are taken along as far as they can be.
    fs::create_dir_all(bench.path("part-there/pictures/mine")).unwrap();
    bench.good("merge part-here part-there -o both");
    assert_eq!(bench.rows("both").len(), 4);
    let manifest = bench.manifest("both");
    let inputs = manifest["inputs"].as_array().unwrap().iter();
    let paths: Vec<_> = inputs.map(|i| i["path"].as_str().unwrap()).collect();
    assert_eq!(paths, ["c.toml", "here/a.bin", "there/a.bin"]);
    let seconds = &bench.machine("both")["seconds"]["measure"];
    assert!(seconds.as_f64() > Some(0.0));
    // The same rows with another number.
    let mut rows = bench.rows("both");
    for row in &mut rows {
        row.pairs += 1;
    }
    bench.seal("part-there", &rows);
    let other = "other numbers than in part-here";
    let refusal = bench.refuses("merge part-here part-there -o no", 3, other);
    let mut keys = rows.iter().map(|row| &row.key);
    assert!(keys.any(|key| refusal.contains(key)), "{refusal}");
    // Another table, another config, and none.
    part("there", "2/2", 0.2);
    bench.does(
        "3 | merge part-here part-there -o no | another material … part-here
         0 | run small.toml -q -o other
         3 | merge part-here other -o no | other/config.toml … another config
         3 | merge nowhere -o no | nowhere",
    );
    assert!(!bench.path("no").exists());
}

#[test]
fn rows_of_another_material_of_the_same_name_are_left_out() {
    let bench = Bench::new();
    for alpha in [0.1, 0.2] {
        let material = format!("{{ name = \"metal\", kind = \"ggx\", alpha = {alpha} }}");
        let text = "budgets = [60, 90]\npictures = { draw = false }";
        bench.write("c.toml", format!("{text}\nmaterial = [{material}]\n"));
        bench.does(
            "0 | run c.toml -q -o p --shard 1/2
             0 | run c.toml -q -o q --shard 2/2",
        );
    }
    bench.does(
        "0 | merge p q -o both | rows of other configs left out
         2 | merge p q -o both | --force
         0 | run c.toml -q -o whole",
    );
    assert_same(&results(&bench, "both"), &results(&bench, "whole"));
    // The config is that of 0.2 already, the rows are not.
    let rows = bench.read("p/results.jsonl");
    let old: String = rows.split_inclusive('\n').skip(2).collect();
    bench.write("p/results.jsonl", old);
    bench.ends("merge p q -o some", 5);
    assert_eq!(bench.rows("some").len(), 2);
}

#[test]
fn a_changed_digit_is_no_row() {
    let bench = Bench::new();
    let run = "run small.toml -q -o a";
    bench.good(run);
    let file = bench.path("a/results.jsonl");
    let records = fs::read_to_string(&file).unwrap();
    let seal = |line: &str| line.find("\"seal\"").unwrap();
    let second = records.find('\n').unwrap() + 1;
    let digit = second + records[second..].find("\"nrmse\":").unwrap() + 10;
    let end = second + seal(&records[second..]);
    let changed = |at: usize, by: &str| {
        let mut text = records.clone();
        text.replace_range(at..at + by.len(), by);
        text
    };
    let is_seven = records[digit..].starts_with('7');
    let other = if is_seven { "3" } else { "7" };
    let unsealed = records.replacen(&records[end - 1..end + 28], "", 1);
    for (text, part) in [
        (changed(digit, other), "is … not as it was written"),
        (changed(end + 8, "19"), "is … revision 19 of results"),
        (unsealed, "has no seal"),
    ] {
        fs::write(&file, &text).unwrap();
        for [args] in table("run small.toml -q -o a\nmerge a -o b\nrun small.toml -o a --list") {
            bench.refuses(args, 3, &format!("results.jsonl: line 2 … {part}"));
        }
        assert_eq!(bench.read("a/results.jsonl"), text);
    }
    // Asked for, all is made again. Times are no results: without them a run goes on.
    bench.good(format!("{run} --force"));
    assert_eq!(bench.read("a/results.jsonl"), records);
    let times = bench.read("a/timings.jsonl");
    for lost in [
        times.replacen('}', ",\"nrmse\":0.5}", 1),
        times.replacen("_seconds\":", "_seconds\":\"late\",\"x\":", 1),
        times.replacen("_seconds\":", "_seconds\":1e999,\"x\":", 1),
    ] {
        bench.write("a/timings.jsonl", lost);
        bench.good(run);
        assert_eq!(bench.read("a/results.jsonl"), records);
    }
    fs::remove_file(bench.path("a/timings.jsonl")).unwrap();
    bench.good(run);
    assert_eq!(bench.read("a/results.jsonl"), records);
}
