use crate::common::{self, product, says, table};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gonio::experiment::{Findings, Plan, Row, Source};
use gonio::report::{
    MaterialPictures, Picture, levels_text, ranking, ranking_csv, study_html as html, study_text,
    verdict_text,
};
use gonio::statistics::BAND;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};

const HOSTILE: &str = "<script>alert(1)</script>\"'&";

const CONFIG: &str = r#"
question = "Which of <b>them</b>?"
experiment = "study"
budgets = [100, 400]
material = [{ kind = "ggx", alpha = 0.3, name = "one" }]
parametrization = [{ kind = "half-difference" }, { kind = "hybrid" }]
sample_set = [{ kind = "grid" }]
reconstruction = [{ kind = "cubic" }]
"#;

/// A row of a material of a number that errs `error`, sampled in a parametrization with a warp.
fn row(m: usize, choice: [&str; 2], budget: usize, error: f64) -> Row {
    common::row(&format!("{m} {HOSTILE}"), choice, budget, error)
}

/// Errors of hybrid over those of half-difference are `ratio` on every material, about.
fn rows(materials: usize, ratio: f64, truth: &str) -> Vec<Row> {
    let mut rows = Vec::new();
    for m in 0..materials {
        for (c, parametrization) in ["half-difference", "hybrid"].into_iter().enumerate() {
            for budget in [100, 400] {
                let scatter = 1.0 + 1e-4 * ((m * m + c) as f64).sin();
                let error = 0.1 * (m + 1) as f64 / budget as f64 * scatter;
                let mut row = row(m, [parametrization, "none"], budget, error);
                row.truth = truth.into();
                if c == 1 {
                    row.quantities.set("nrmse", Some(ratio * error));
                }
                rows.push(row);
            }
        }
    }
    rows
}

/// Half-difference and hybrid, as they are and warped; `ratio` of each, but for scatter.
fn warped(materials: usize, ratios: [f64; 4]) -> Vec<Row> {
    let choices = [
        ["half-difference", "none"],
        ["half-difference", "theta_h:square-root"],
        ["hybrid", "none"],
        ["hybrid", "h_bar:square-root"],
    ];
    let mut rows = Vec::new();
    for (m, (choice, ratio)) in product(0..materials, choices.into_iter().zip(ratios)) {
        let error = 0.1 * (m + 1) as f64 * ratio * (1.0 + 1e-4 * (m as f64).sin());
        rows.push(row(m, choice, 100, error));
    }
    rows
}

/// What is found in rows.
fn findings(rows: &[Row]) -> Findings {
    Findings::new(&rows.iter().collect::<Vec<_>>(), BAND)
}

fn report(rows: &[Row]) -> String {
    let plan = Plan::read(&Source::new("study.toml", CONFIG)).unwrap();
    let facts = serde_json::json!({
        "gonio": "1.2.3",
        "inputs": [{ "path": HOSTILE, "blake3": "abc" }],
    });
    let svg = "<?xml version=\"1.0\"?><svg xmlns=\"http://www.w3.org/2000/svg\">\
               <image href=\"data:image/png;base64,iVBORw==\"/></svg>";
    let (caption, svg) = (HOSTILE.into(), svg.into());
    let picture = Picture { caption, svg };
    let own = rows.first().map(|r| {
        let (material, pictures) = (r.material.clone(), vec![picture.clone()]);
        MaterialPictures { material, pictures }
    });
    let (all, found) = (rows.iter().collect::<Vec<_>>(), findings(rows));
    html(&plan, &all, &found, &facts, &[picture], own.as_slice())
}

/// The diagrams of a report.
fn charts(report: &str) -> impl Iterator<Item = &str> {
    let charts = report.split("<figure class=\"chart\">").skip(1);
    charts.map(|chart| chart.split("</figure>").next().unwrap())
}

/// The text between the tags of the verdict.
fn verdict(report: &str) -> &str {
    let start = report.find("class=\"verdict\"").unwrap();
    let rest = &report[start..];
    &rest[..rest.find("</div>").unwrap()]
}

/// Names of the lines of a diagram with their colours.
fn looks(chart: &str) -> impl Iterator<Item = [&str; 2]> {
    chart.split("<g><title>").skip(1).map(|told| {
        let name = told.split(['\n', '<']).next().unwrap();
        // A line across has none.
        let mut fills = told.split("fill=\"").skip(1);
        let color = fills.find(|fill| !fill.starts_with("none")).unwrap();
        [name, color.split('"').next().unwrap()]
    })
}

#[test]
fn a_parametrization_has_one_colour() {
    let mut rows = warped(8, [4.0, 1.0, 6.0, 2.0]);
    for m in 0..8 {
        rows.push(row(m, ["spherical", "none"], 100, 0.3 * (m + 1) as f64));
        // Alone on a material, which must not change colours.
        rows.push(row(9, ["hybrid", "none"], 100, 0.3));
    }
    for mut row in rows.clone() {
        row.readings = 400;
        row.budget = 400;
        row.allowed = "400 poses".into();
        rows.push(row);
    }
    let text = report(&rows);
    let mut colors: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for [name, color] in charts(&text).flat_map(looks) {
        let own = name.split([' ', ',']).next().unwrap();
        colors.entry(own).or_default().insert(color);
    }
    let names = ["half-difference", "hybrid", "spherical"];
    assert!(colors.keys().eq(&names));
    assert!(colors.values().all(|c| c.len() == 1), "{colors:?}");
    let all: BTreeSet<_> = colors.values().flatten().collect();
    assert_eq!(all.len(), 3);
}

#[test]
fn a_curve_keeps_its_reconstruction() {
    // Cubic is best at 100, linear at 400 by more: over both budgets that is best. No line but those of the verdict is of both.
    let mut rows = Vec::new();
    for (m, (name, errors)) in product(0..6, [("cubic", [1.0, 0.9]), ("linear", [1.1, 0.2])]) {
        for (budget, error) in [100, 400].into_iter().zip(errors) {
            for parametrization in ["half-difference", "hybrid"] {
                let mut row = row(m, [parametrization, "none"], budget, error);
                row.reconstruction = name.into();
                rows.push(row);
            }
        }
    }
    let text = report(&rows);
    let mut linear_charts = 0;
    let mut charts = charts(&text);
    let best = "\nnrmse 1.00</title> … \nnrmse 0.200</title> … All by cubic at 100 poses and linear at 400 poses.";
    says(charts.next().unwrap(), best);
    for chart in charts {
        let has = |error: &str| chart.contains(&format!("\nnrmse {error}</title>"));
        let [cubic, linear] = [["1.00", "0.900"], ["1.10", "0.200"]];
        for (name, [first, last]) in [("cubic", cubic), ("linear", linear)] {
            assert_eq!(has(first), has(last), "{chart}");
            let by_name = format!("by {name}");
            assert!(!has(first) || chart.contains(&by_name), "{chart}");
        }
        linear_charts += usize::from(has(linear[0]));
    }
    // Against the instrument, and of six materials.
    assert_eq!(linear_charts, 1 + 6);
    let said = study_text(&findings(&rows));
    assert!(said.contains("hybrid, linear") && !said.contains("hybrid, cubic"));
}

#[test]
fn undecided_is_said_with_its_p() {
    // Better on half of the materials, worse on the others.
    let mut rows = rows(12, 1.0, "neither");
    for (i, row) in rows.iter_mut().enumerate() {
        let factor = 1.0 + 0.3 * (i as f64).sin();
        let error = row.value("nrmse").map(|e| e * factor);
        row.quantities.set("nrmse", error);
    }
    let text = report(&rows);
    let said = verdict(&text);
    assert!(said.contains("is undecided whether") && said.contains("is not below 0.05"));
    let shown: Vec<&str> = text.split("undecided").skip(1).collect();
    assert!(shown.len() > 4);
    for rest in shown {
        let near: String = rest.chars().take(90).collect();
        assert!(near.starts_with(", p ") || near.contains("(p "), "{near}");
    }
    let said = study_text(&findings(&rows));
    assert!(said.contains(", p ") && said.contains("adjusted by Holm over the 2 budgets"));
}

#[test]
fn the_verdict_is_what_was_found() {
    let worse = report(&rows(12, 1.5, "half-difference table"));
    // The known bias of the truth stands beside it.
    assert!(worse.contains("it favours a grid in the same coordinates with the same warp"));
    says(
        verdict(&worse),
        "unwarped hybrid errs 1.50 times (95 % 1.50–1.50) as much as unwarped half-difference … \
         worse on 12 of 12 materials, better on 0",
    );
    for [materials, ratio, truth, parts] in table(
        "12 | 0.8 | theta_h | better on 12 of 12 materials, worse on 0
         12 | 1 | neither | there is no difference between unwarped hybrid and unwarped half-difference … within the band of 1.0 %
         4 | 1.5 | neither | 4 materials cannot show that others follow
         3 | 0.01 | neither | unwarped hybrid errs least at every budget on these 3 materials: … \
             is 1/100 of that of unwarped half-difference: better on 3 of 3 materials … 1/100 at 400 poses … \
             3 materials cannot show that others follow.
         1 | 1.5 | neither | 1 material cannot show that others follow
         1 | 1.5 | neither | on this material: by cubic",
    ) {
        let rows = rows(materials.parse().unwrap(), ratio.parse().unwrap(), truth);
        says(verdict(&report(&rows)), parts);
        says(&verdict_text(&findings(&rows)), parts);
    }
    // What cannot be decided is not said to be undecided.
    let few = report(&rows(3, 0.01, "neither"));
    assert!(!verdict(&few).contains("ndecided"));
}

#[test]
fn the_chart_of_the_verdict_holds_every_coordinate() {
    let warps = "abcdefghi".chars().map(|c| format!("h_bar:{c}"));
    let mut names: Vec<String> = warps.collect();
    let mut rows = Vec::new();
    for m in 0..3 {
        for (budget, warp) in product([100, 400], &names) {
            rows.push(row(m, ["hybrid", warp], budget, 0.1));
        }
        let mut scattered = row(m, ["none", "none"], 100, 0.2);
        scattered.sample_set = "directions".into();
        rows.push(scattered);
    }
    names.push("none (directions)".into());
    let text = report(&rows);
    let chart = charts(&text).next().unwrap();
    let shown: BTreeSet<&str> = looks(chart).map(|[name, _]| name).collect();
    assert_eq!(shown.len(), names.len());
    for name in &names {
        let is_shown = shown.iter().any(|s| s.ends_with(name));
        assert!(is_shown, "{name} of {shown:?}");
    }
}

#[test]
fn what_is_exact_is_called_so_and_groups_without_materials_are_left_out() {
    let mut rows = rows(7, 1.5, "neither");
    // One exact in all coordinates, and one in some.
    for (name, errors) in [("matte", [2e-16, 0.0]), ("half", [3e-13, 0.1])] {
        for (parametrization, error) in ["half-difference", "hybrid"].into_iter().zip(errors) {
            for budget in [100, 400] {
                let mut row = common::row(name, [parametrization, "none"], budget, error);
                row.truth = "h_bar".into();
                rows.push(row);
            }
        }
    }
    let text = report(&rows);
    assert!(text.contains("matte (exact by a choice), half (exact by a choice)"));
    assert!(!text.contains("“h_bar”") && !text.contains("0 materials"));
    let of = |name: &str| {
        let (_, section) = text
            .split_once(&format!("<summary>{name}</summary>"))
            .unwrap();
        section.split("</section>").next().unwrap()
    };
    assert!(of("matte").contains("Exact: at every budget") && !of("matte").contains("<td"));
    assert_eq!(of("half").matches("<b>exact</b>").count(), 2);
    let all = of("matte").to_owned() + of("half");
    assert!(!all.contains("e-1"), "{all}");
}

#[test]
fn errors_of_moments_are_ranked_where_rows_have_them() {
    let mut rows = rows(7, 1.5, "neither");
    let texts = |rows: &[Row]| {
        let (all, found) = (rows.iter().collect::<Vec<_>>(), findings(rows));
        let (printed, page) = (ranking(&all), report(rows));
        [printed, study_text(&found), ranking_csv(&found), page]
    };
    for text in texts(&rows) {
        says(&text, "nrmse");
        assert!(!text.contains("moment_"), "{text}");
    }
    let mut of_lobe = rows.clone();
    for row in &mut of_lobe {
        row.measure = "lobe".into();
    }
    rows.extend(of_lobe);
    for row in &mut rows {
        let is_hybrid = row.parametrization == "hybrid";
        let error = if is_hybrid { 0.25 } else { 0.5 };
        row.quantities.set("moment_skewness", Some(error));
    }
    let [printed, study, table, page] = texts(&rows);
    // Once: they are the same for every measure.
    assert_eq!(printed.matches("ranking, moment_skewness").count(), 1);
    says(&printed, "ranking, moment_skewness … 0.5000 … 0.2500*");
    says(&study, "moment_skewness … 0.2500* (0.2500)");
    assert!(!printed.contains("moment_energy"));
    assert_eq!(table.matches("\nmoment_skewness,,,7,hybrid").count(), 2);
    says(&page, "moment_skewness, all 7 materials … 0.2500");
}

#[test]
fn readings_are_counted_until_errors_of_moments_stay_below_their_levels() {
    // Errors of the energy that fall as 1/readings: below 1 % from 100 c readings on, of which half the materials need 100 c₃.
    let mut rows = Vec::new();
    for m in 0..6_u8 {
        for (parametrization, times) in [("half-difference", 1.0), ("hybrid", 4.0)] {
            for budget in [100, 400, 1600] {
                let n = budget as f64;
                let mut row = row(m.into(), [parametrization, "none"], budget, 0.1 / n);
                let c = times * (1.0 + f64::from(m));
                // It rises again: no number of these is enough.
                let rising = if budget == 1600 { 0.2 } else { 0.01 };
                for (name, error) in [
                    ("moment_energy", c / n),
                    ("moment_energy_0_40", 0.5 * c / n),
                    ("moment_skewness", rising),
                ] {
                    row.quantities.set(name, Some(error));
                }
                rows.push(row);
            }
        }
    }
    let found = findings(&rows);
    let text = levels_text(&found);
    for [parts] in table(
        "readings until moment_energy ≤ 0.01 … all views … 0°–40°
         half-difference, cubic … 300 [≤ 100, 600] … 150 [≤ 100, 300]
         hybrid, cubic … 1200 [400, > 1600] … 600 [200, 1200]
         readings until moment_skewness ≤ 0.1 … half-difference, cubic … > 1600
         moment_energy … 100 … half-difference, cubic … half-difference, cubic … is the same",
    ) {
        // What errs least in nrmse errs four times less in energy too, and as much in skewness.
        says(&text, parts);
    }
    assert!(!text.contains("moment_kurtosis"));
    let said = "readings until moment_energy ≤ 0.01 … 1200 [400, &gt; 1600]";
    says(&report(&rows), said);
    assert_eq!(levels_text(&findings(&warped(8, [1.0; 4]))), "");
}

#[test]
fn every_truth_is_asked_for_the_pair_of_the_headline() {
    // On the first eight the warped are best, on the other eight the unwarped, by less.
    let mut rows = warped(8, [4.0, 1.0, 6.0, 2.0]);
    for mut row in warped(16, [1.0, 2.0, 1.1, 3.0]).split_off(32) {
        row.truth = "theta_h".into();
        rows.push(row);
    }
    assert_eq!(rows.len(), 64);
    let text = report(&rows);
    let pair = "as much as half-difference theta_h:square-root";
    let head = "hybrid h_bar:square-root errs 1.73 times";
    says(verdict(&text), &format!("{head} … {pair}"));
    let alone: Vec<&str> = text.split("On these alone, by cubic, ").skip(1).collect();
    assert_eq!(alone.len(), 2);
    for (alone, ratio) in alone.iter().zip(["2.00", "1.50"]) {
        let head = format!("hybrid h_bar:square-root errs {ratio} times");
        assert!(alone.starts_with(&head) && alone.contains(pair), "{alone}");
    }
    // Where the pair has no errors that is said, and no other takes its place.
    let is_lost = |r: &&mut Row| r.truth == "theta_h" && r.warp == "h_bar:square-root";
    for row in rows.iter_mut().filter(is_lost) {
        row.quantities.set("nrmse", None);
    }
    let text = report(&rows);
    assert_eq!(text.matches("On these alone, by cubic, ").count(), 1);
    let pair = "hybrid h_bar:square-root and half-difference theta_h:square-root";
    says(&text, &format!("On these alone {pair} cannot be compared"));
}

/// `count` warps of hybrid, each worse than the one before it.
fn many(materials: usize, count: usize) -> Vec<Row> {
    let names: Vec<String> = (0..count).map(|c| format!("h_bar:{c}")).collect();
    let mut rows = Vec::new();
    for (m, (c, name)) in product(0..materials, names.iter().enumerate()) {
        let scatter = 1.0 + 0.3 * ((m * m * (c + 1)) as f64).sin();
        let error = 0.1 * (1.0 + 0.01 * c as f64) * scatter;
        rows.push(row(m, ["hybrid", name], 100, error));
    }
    rows
}

#[test]
fn too_few_materials_for_many_choices_are_not_alike() {
    // 2 / 2⁸ · 39 = 0.30, 2 / 2⁸ · 5 = 0.04.
    let text = report(&many(8, 40));
    let note = "8 materials are too few to separate so many choices";
    assert_eq!(text.matches(note).count(), 2, "once a metric");
    assert!(text.contains("would have p 0.30"));
    assert!(!text.contains("near\"") && !text.contains("</b> ≈"));
    let text = report(&many(8, 6));
    assert!(!text.contains("too few to separate so many"));
    assert!(text.contains("near\"") && text.contains("</b> ≈"));
}

#[test]
fn a_report_of_nothing_is_a_page() {
    let text = report(&[]);
    assert!(text.contains("There are no results.") && text.ends_with("</html>"));
}

#[test]
fn lines_are_ranked_over_the_budgets_all_have() {
    // "a" is best at 100, and the only one that is spared the others; "b" is best at 400 and 1600.
    let mut rows = Vec::new();
    for m in 0..6 {
        let mut add = |name, budget, error| rows.push(row(m, ["hybrid", name], budget, error));
        for (budget, errors) in [(100, [1.2, 1.0, 1.1]), (400, [1.0, 9.0, 0.9])] {
            add("h_bar:late_", budget, errors[0]);
            if budget == 100 {
                add("h_bar:spared_", budget, errors[1]);
            }
            add("h_bar:good_", budget, errors[2]);
        }
    }
    let order = |rows: &[Row]| {
        let page = report(rows);
        let (_, table) = page.split_once("id=\"ranking-0\"").unwrap();
        let mut names = ["spared_", "good_", "late_"];
        names.sort_by_key(|name| table.find(name).unwrap());
        names
    };
    assert_eq!(order(&rows), ["spared_", "good_", "late_"]);
    // At 400 it counts for nothing, as not all have it.
    let is_late = |r: &&mut Row| r.budget == 400 && r.warp == "h_bar:late_";
    for row in rows.iter_mut().filter(is_late) {
        row.quantities.set("nrmse", Some(1e-6));
    }
    assert_eq!(order(&rows), ["spared_", "good_", "late_"]);
    // Ties: the order of the rows.
    for row in &mut rows {
        row.quantities.set("nrmse", Some(0.5));
    }
    assert_eq!(order(&rows), ["late_", "spared_", "good_"]);
}

#[test]
fn names_are_text_and_never_markup() {
    let text = report(&rows(7, 1.5, HOSTILE));
    let plain = report(&rows(7, 1.5, "neither"));
    let (_, script) = plain.split_once("<script>").unwrap();
    let (script, _) = script.split_once("</script>").unwrap();
    // The policy names the script and nothing else to run.
    let policy = plain.split("http-equiv=\"Content-Security-Policy\" content=\"");
    let policy = policy.last().unwrap().split('"').next().unwrap();
    let hash = STANDARD.encode(Sha256::digest(script));
    let allowed = policy.split("script-src").nth(1).unwrap();
    assert_eq!(allowed.trim(), format!("'sha256-{hash}'"));
    assert!(policy.starts_with("default-src 'none'") && !script.contains("</"));
    assert!(!text.contains("<b>them"));
    // Every picture has a text.
    let pictures = ["<svg ", "<img "].into_iter();
    let mut pictures = pictures.flat_map(|tag| text.split(tag).skip(1)).peekable();
    assert!(pictures.peek().is_some());
    for tag in pictures {
        let label = tag.starts_with("role=\"img\" aria-label=\"") || tag.starts_with("alt=\"");
        assert!(label && !tag.split('"').nth(1).unwrap().is_empty(), "{tag}");
    }
    // One script, the same whatever the names are.
    assert_eq!(text.matches("<script").count(), 1);
    assert!(text.contains(&format!("<script>{script}</script>")));
    assert!(text.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
    // Quotes end attributes.
    assert!(!text.contains("alt=\"<") && !text.contains("</script>\""));
    let text = text.replace(script, "");
    for tag in text.split('<').skip(1).filter_map(|t| t.split_once('>')) {
        assert_eq!(tag.0.matches('"').count() % 2, 0, "{}", tag.0);
    }
    assert!(text.contains("data:image/png;base64,iVBORw=="));
    assert!(!text.contains("<?xml"));
}
