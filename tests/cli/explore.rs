use super::{Bench, READINGS};

/// A study of one material and one instrument, which writes a page; nothing is reconstructed from two readings.
const STUDY: &str = r#"
budgets = [2]
measures = ["cosine"]
material = [{ kind = "lambert", albedo = 0.5 }]
parametrization = [{ kind = "hybrid" }]
sample_set = [{ kind = "sobol" }]
reconstruction = [{ kind = "nearest" }]
instrument = [{ preset = "cornell" }]
metrics = { pairs = 200, tolerance = 1.0 }
output = { explore = true }
"#;

#[test]
fn pages_are_written_whole_or_not_at_all() {
    let bench = Bench::new();
    bench.good("explore lambert -o one.html");
    let page = bench.read("one.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>"));
    assert!(page.contains("gonio explore lambert -o one.html"));
    // The same bytes on one thread.
    bench.good("explore lambert -o one.html --threads 1 --force");
    let again = bench.read("one.html").replace(" --threads 1", "");
    assert!(page == again, "another page on one thread");
    let reading = format!("{READINGS}30,0,20,180,0.5\n");
    bench.write("reading.csv", &reading);
    bench.write(
        "poses.csv",
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n30,0,20,180\n",
    );
    bench.does(
        "0 | explore --readings reading.csv -o reading.html
         0 | explore -o blank.html
         2 | explore lambert -o one.html | one.html … --force
         2+ | explore lambert | --output
         2 | explore shiny -o x.html | shiny … ggx
         2+ | explore lambert --set-b albedo=0.1 -o x.html | required
         2 | explore --schedule poses.csv -o x.html | poses.csv … no instrument; allowed: with --instrument
         3 | explore --schedule reading.csv --instrument cornell -o x.html | reading.csv
         2 | explore lambert --schedule poses.csv --instrument nonsense -o x.html | nonsense
         2+ | explore lambert --instrument cornell -o x.html | required
         2+ | explore lambert --seed 3 -o x.html | required
         0 | explore lambert --readings reading.csv --schedule poses.csv --instrument cornell -o both.html
         2+ | explore lambert --gallery pages | cannot be used with
         0 | explore lambert --schedule poses.csv --instrument cornell -o tour.html",
    );
    assert!(!bench.path("x.html").exists());
}

#[test]
fn a_run_writes_a_page_where_it_is_asked() {
    let bench = Bench::new();
    bench.write("study.toml", STUDY);
    bench.good("run study.toml");
    let page = bench.read("runs/study/explore.html");
    assert!(page.contains("The readings are simulated, of lambert"));
    // A run that goes on has it still.
    bench.good("run study.toml");
    let again = bench.read("runs/study/explore.html");
    assert!(page == again, "another page of the same run");
}
