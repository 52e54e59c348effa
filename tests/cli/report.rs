//! The report of a study, as a browser shows it.

use super::common::{Level, product};
use super::{Bench, csv_rows};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// A study that takes a moment: truths that favour this, that and neither.
const STUDY: &str = r#"
question = "In which coordinates?"
experiment = "study"
report = { title = "Parametrization study", reference = "half-difference", challenger = "hybrid" }
budgets = [60, 200, 600]
metrics = { pairs = 500, max_pairs = 1 }
material = [
  { kind = "ggx", alpha = 0.3 },
  { kind = "ggx", alpha = 0.5 },
  { kind = "ward", alpha = 0.4, name = "<script>document.title = 'broken'</script>" },
  { kind = "oren-nayar" },
  { kind = "test-s" },
  { kind = "test-g" },
]
parametrization = [
  { kind = "half-difference" },
  { kind = "half-difference", warp = { theta_h = "square-root" } },
  { kind = "hybrid" },
  { kind = "hybrid", warp = { h_bar = "square-root" } },
]
sample_set = [{ kind = "grid" }]
reconstruction = [{ kind = "cubic" }, { kind = "inverse-distance" }]
coordinates = [{ kind = "half-difference" }, { kind = "hybrid" }]
"#;

/// Tells of everything that is to be seen how large it is, what colours the page has, where its first
/// diagram ends before anything is unfolded, and the numbers of a column before and after a click on
/// its heading.
const PROBE: &str = r#"
addEventListener("load", async () => {
  const fold = document.querySelector(".answer .chart svg").getBoundingClientRect().bottom;
  // Parts that are inflated may have further ones.
  for (let left = 3; left > 0; left--) {
    for (const d of document.querySelectorAll("details")) d.open = true;
    await new Promise(done => setTimeout(done, 300));
  }
  const deflated = document.querySelectorAll("[data-deflated]").length;
  document.querySelector('#inflated button').click();
  const inflated = [...document.querySelectorAll('#inflated td')].map(cell => cell.textContent);
  const pictures = [...document.querySelectorAll("svg, img")];
  const seen = pictures.map(e => {
    // What is wide scrolls in a box of its own.
    const box = (e.closest(".wide") ?? e).getBoundingClientRect();
    return Math.round(box.width) + "x" + Math.round(box.height);
  });
  const named = pictures.filter(e => e.getAttribute("aria-label") || e.alt).length;
  const style = getComputedStyle(document.body);
  const out = document.createElement("pre");
  out.id = "probe";
  const letters = document.querySelector(".chart text");
  const letter = letters ? getComputedStyle(letters).fill : style.color;
  const wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  const columns = [["table.ranking", 3], ["table.duels", 2]].map(([name, column]) => {
    const table = document.querySelector(name);
    const numbers = () => [...table.querySelectorAll("tbody tr")].map(r => parseFloat(r.cells[column].textContent));
    const before = numbers();
    table.tHead.rows[0].cells[column].querySelector("button")?.click();
    return [before, numbers()];
  });
  out.textContent = JSON.stringify({ seen, named, title: document.title, paper: style.backgroundColor,
    ink: style.color, letter, wide, fold, columns,
    deflated, inflated,
    requests: performance.getEntriesByType("resource").length });
  document.body.append(out);
});
"#;

/// The browser that `.ci/run` names, else one that works, if there is one.
fn browser() -> Option<String> {
    let named = std::env::var("GONIO_BROWSER").ok();
    let works = |name: &&str| {
        let mut command = Command::new(name);
        command.arg("--version");
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|s| s.success())
    };
    let known = ["chromium", "chromium-browser", "google-chrome"];
    named.or_else(|| Some(known.into_iter().find(works)?.to_owned()))
}

/// Opens a page; stdout and the errors of the page.
fn open(browser: &str, dir: &Path, page: &Path, args: &[&str]) -> (String, Vec<String>) {
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu"]);
    command.args(["--enable-logging=stderr", "--v=0"]);
    command.args(["--window-size=1280,900", "--virtual-time-budget=10000"]);
    command.arg(format!("--user-data-dir={}", dir.join("profile").display()));
    command.args(args).arg(format!("file://{}", page.display()));
    let output = command.stdin(Stdio::null()).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    // What the page says is marked so; the rest is the browser talking of its machine.
    let errors = stderr.lines().filter(|l| l.contains("CONSOLE"));
    let errors = errors.map(String::from).collect();
    (String::from_utf8_lossy(&output.stdout).into_owned(), errors)
}

/// A part as long ones are, deflated by zlib: a table with the id `inflated` and the cells 2 and 1.
const LONG: &str = "<details><summary>Long</summary><div data-deflated=\"TY0xCsAwCAC/EvxAaOfUv5ia0kBIILr09zXFocsp54FJKbcSzkYiB8iYKhAqH1D71UgLA\
    ya9C7GNuVbsKRoNc8FPefDjBeNunr1wtf1U9Dp+r/EF\"></div></details>";

/// Perceived lightness of `rgb(r, g, b)`, 0 to 1.
fn luminance(color: &str) -> f64 {
    let inside = color.split(['(', ')']).nth(1).unwrap();
    let linear = |c: &str| (c.trim().parse::<f64>().unwrap() / 255.0).powf(2.2);
    let linear: Vec<f64> = inside.split(',').take(3).map(linear).collect();
    0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
}

fn study(level: Level) -> (Bench, String) {
    let bench = Bench::new();
    let small = "budgets = [60, 200]\npictures = { resolution = 16, samples = 4, budget = 60 }";
    let text = match level {
        Level::Quick => STUDY.replace("budgets = [60, 200, 600]", small),
        Level::Thorough => STUDY.into(),
    };
    bench.write("study.toml", text);
    bench.good("run study.toml -o one");
    let report = bench.read("one/report.html");
    (bench, report)
}

#[test]
fn a_report_needs_nothing_but_itself() {
    let (bench, report) = study(Level::Quick);
    // Names of XML vocabularies are no addresses.
    let text = report.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for address in ["http://", "https://", "src=\"/", "url(", "@import", "<link"] {
        assert!(!text.contains(address), "{address}");
    }
    // Every place of the contents is there.
    for target in text.split("href=\"#").skip(1) {
        let target = target.split('"').next().unwrap();
        assert!(text.contains(&format!("id=\"{target}\"")), "{target}");
    }
    let ranking = csv_rows(&bench.read("one/ranking.csv"));
    assert!(ranking.len() > 10);
    // The best of a column has no ratio, all others have.
    for row in &ranking {
        let is_best = row["place"] == "1";
        assert_eq!(row["ratio_to_best"] == "", is_best, "{row:?}");
    }
}

#[test]
#[ignore = "thorough: a browser is started five times"]
fn a_browser_shows_a_report() {
    let Some(browser) = &browser() else {
        return;
    };
    let (bench, report) = study(Level::Thorough);
    let dir = bench.path("one");
    // As it is: not a word of complaint, and printed on few pages.
    let pdf = dir.join("report.pdf");
    let print = format!("--print-to-pdf={}", pdf.display());
    let page = dir.join("report.html");
    let (_, errors) = open(browser, bench.dir.path(), &page, &[&print]);
    assert!(errors.is_empty(), "{errors:?}");
    let pdf = fs::read(pdf).unwrap();
    assert!(pdf.starts_with(b"%PDF"));
    let page = b"/Type /Page\n";
    let pages = pdf.windows(page.len()).filter(|w| w == page).count();
    assert!((3..=12).contains(&pages), "{pages} pages");
    // With a probe, which the policy is told of beside the page's own script.
    let hash = STANDARD.encode(Sha256::digest(PROBE));
    let allowed = report.replacen("script-src ", &format!("script-src 'sha256-{hash}' "), 1);
    let allowed = allowed.replacen("</main>", &format!("{LONG}</main>"), 1);
    assert!(allowed.contains(LONG) && allowed.contains(&hash));
    let probed = dir.join("probed.html");
    fs::write(&probed, format!("{allowed}<script>{PROBE}</script>")).unwrap();
    for ((scheme, is_dark), width) in product([("1", false), ("0", true)], [1280, 480]) {
        let scheme = format!("--blink-settings=preferredColorScheme={scheme}");
        // The last size given counts.
        let size = format!("--window-size={width},900");
        let args = [scheme.as_str(), &size, "--dump-dom"];
        let (dom, errors) = open(browser, bench.dir.path(), &probed, &args);
        assert!(errors.is_empty(), "{errors:?}");
        let json = dom.split("<pre id=\"probe\">").nth(1).expect("no probe");
        let json = json.split("</pre>").next().unwrap().replace("&lt;", "<");
        let found: Value = serde_json::from_str(&json).unwrap();
        assert_eq!(found["title"], "Parametrization study");
        assert_eq!(found["requests"], 0);
        assert_eq!(found["deflated"], 0);
        assert_eq!(found["inflated"], json!(["1", "2"]));
        let mut moved = false;
        for column in found["columns"].as_array().unwrap() {
            let [before, after] = [0, 1].map(|i| {
                let numbers = column[i].as_array().unwrap().iter();
                let numbers = numbers.map(|n| n.as_f64().unwrap_or(f64::INFINITY));
                numbers.collect::<Vec<_>>()
            });
            let mut sorted = before.clone();
            sorted.sort_by(f64::total_cmp);
            assert!(sorted.len() > 4 && after == sorted, "{column}");
            moved |= before != sorted;
        }
        assert!(moved, "{}", found["columns"]);
        if width == 1280 {
            let fold = found["fold"].as_f64().unwrap();
            assert!(fold < 800.0, "the first diagram ends at {fold}");
        }
        let seen = found["seen"].as_array().unwrap();
        // Curves of costs, forests, and one a material at least.
        assert!(seen.len() >= 12, "{}", seen.len());
        assert_eq!(found["named"], seen.len(), "pictures without a text");
        for size in seen {
            let (w, h) = size.as_str().unwrap().split_once('x').unwrap();
            let [w, h] = [w, h].map(|s| s.parse::<u32>().unwrap());
            assert!(w > 100 && h > 60, "{size}");
            assert!(w <= width, "{size} on {width}");
        }
        assert_eq!(found["wide"], 0, "wider than its window of {width}");
        let light = |key: &str| luminance(found[key].as_str().unwrap());
        assert_eq!(light("paper") < 0.2, is_dark, "{found}");
        for letters in ["ink", "letter"] {
            let (a, b) = (light(letters), light("paper"));
            let contrast = (a.max(b) + 0.05) / (a.min(b) + 0.05);
            // WCAG's level AAA.
            assert!(contrast > 7.0, "{letters}: {contrast}");
        }
    }
}
