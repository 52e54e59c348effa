use super::{MaterialPictures, Media, POLICY, Picture, SCRIPT, html};
use crate::experiment::{Findings, Plan, Quantities, Row, Source};
use crate::statistics::BAND;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

const HOSTILE: &str = "<script>alert(1)</script>\"'&";

const CONFIG: &str = r#"
question = "Which of <b>them</b>?"
experiment = "study"
budgets = [100, 400]

[[material]]
kind = "ggx"
alpha = 0.3
name = "one"

[[parametrization]]
kind = "half-difference"

[[parametrization]]
kind = "hybrid"

[[sample_set]]
kind = "grid"

[[reconstruction]]
kind = "cubic"
"#;

/// A row of a material that errs `error`, sampled in a parametrization with a warp.
fn row(m: usize, [parametrization, warp]: [&str; 2], budget: usize, error: f64) -> Row {
    Row {
        material: format!("{m} {HOSTILE}"),
        truth: "neither".into(),
        parametrization: parametrization.into(),
        warp: warp.into(),
        sample_set: "grid".into(),
        instrument: "ideal".into(),
        reconstruction: "cubic".into(),
        coordinates: "own".into(),
        allowed: format!("{budget} poses"),
        budget,
        readings: budget,
        seed: 1,
        measure: "cosine".into(),
        quantities: errors(error),
        reachable: 1.0,
        instrument_seconds: Some(60.0 * budget as f64),
        pairs: 100,
        plan_seconds: 0.1,
        measure_seconds: 0.1,
        reconstruct_seconds: 0.1,
        evaluate_seconds: 0.1,
        ..Row::default()
    }
}

/// The errors that reports compare, all alike.
fn errors(error: f64) -> Quantities {
    let mut errors = Quantities::default();
    for name in ["nrmse", "log_relative"] {
        errors.set(name, Some(error));
    }
    errors
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

fn report(rows: &[Row]) -> String {
    let plan = Plan::read(&Source::new("study.toml", CONFIG)).unwrap();
    let rows: Vec<&Row> = rows.iter().collect();
    let findings = Findings::new(&rows, BAND);
    let facts = serde_json::json!({
        "gonio": "1.2.3",
        "inputs": [{ "path": HOSTILE, "blake3": "abc" }],
    });
    let picture = |media| Picture {
        caption: HOSTILE.into(),
        alt: HOSTILE.into(),
        media,
    };
    let svg = "<?xml version=\"1.0\"?><svg xmlns=\"http://www.w3.org/2000/svg\"></svg>";
    let own = rows.first().map(|r| MaterialPictures {
        material: r.material.clone(),
        pictures: vec![picture(Media::Png(vec![0x89, 0x50, 0x4e, 0x47]))],
    });
    let own: Vec<_> = own.into_iter().collect();
    let general = [picture(Media::Svg(svg.into()))];
    html(&plan, &rows, &findings, &facts, &general, &own).unwrap()
}

#[test]
fn names_are_text_and_never_markup() {
    let text = report(&rows(7, 1.5, HOSTILE));
    assert!(!text.contains("<b>them"));
    // One script, the same whatever the names are.
    assert_eq!(text.matches("<script").count(), 1);
    assert!(text.contains(&format!("<script>{SCRIPT}</script>")));
    assert!(text.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
    // Quotes end attributes.
    assert!(!text.contains("alt=\"<") && !text.contains("</script>\""));
    let text = text.replace(SCRIPT, "");
    for tag in text.split('<').skip(1).filter_map(|t| t.split_once('>')) {
        assert_eq!(tag.0.matches('"').count() % 2, 0, "{}", tag.0);
    }
    assert!(text.contains("data:image/png;base64,iVBORw=="));
    assert!(!text.contains("<?xml"));
}

#[test]
fn the_policy_names_the_script_and_nothing_else_to_run() {
    let hash = STANDARD.encode(Sha256::digest(SCRIPT));
    let allowed = POLICY.split("script-src").nth(1).unwrap();
    assert_eq!(allowed.trim(), format!("'sha256-{hash}'"));
    assert!(POLICY.starts_with("default-src 'none'") && !SCRIPT.contains("</"));
    assert!(report(&rows(7, 1.5, "neither")).contains(&format!("content=\"{POLICY}\"")));
}

#[test]
fn lines_are_ranked_over_the_budgets_all_have() {
    // "a" is best at 100, and the only one that is spared the others; "b" is best at 400 and 1600.
    let mut rows = Vec::new();
    for m in 0..6 {
        let mut add = |name, budget, error| rows.push(row(m, ["hybrid", name], budget, error));
        for (budget, errors) in [(100, [1.2, 1.0, 1.1]), (400, [1.0, 9.0, 0.9])] {
            add("h_bar:late", budget, errors[0]);
            if budget == 100 {
                add("h_bar:spared", budget, errors[1]);
            }
            add("h_bar:good", budget, errors[2]);
        }
    }
    let order = |rows: &[Row]| -> Vec<String> {
        let rows: Vec<&Row> = rows.iter().collect();
        let findings = Findings::new(&rows, BAND);
        let sorted = crate::report::acquisition::order::sorted(&findings.rankings[0]);
        sorted
            .iter()
            .map(|l| l.choice.warp[6..].to_owned())
            .collect()
    };
    assert_eq!(order(&rows), ["spared", "good", "late"]);
    // At 400 it counts for nothing, as not all have it.
    for row in rows
        .iter_mut()
        .filter(|r| r.budget == 400 && r.warp == "h_bar:late")
    {
        row.quantities.set("nrmse", Some(1e-6));
    }
    assert_eq!(order(&rows), ["spared", "good", "late"]);
    // Ties: the order of the rows.
    rows.iter_mut()
        .for_each(|r| r.quantities.set("nrmse", Some(0.5)));
    assert_eq!(order(&rows), ["late", "spared", "good"]);
}
