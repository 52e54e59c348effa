use super::{MaterialPictures, Media, Picture, html};
use crate::experiment::Source;
use crate::experiment::study::{Findings, StudyPlan, StudyRow};
use crate::statistics::BAND;

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

/// Errors of hybrid over those of half-difference are `ratio` on every material, about.
fn rows(materials: usize, ratio: f64, truth: &str) -> Vec<StudyRow> {
    let mut rows = Vec::new();
    for m in 0..materials {
        for (c, parametrization) in ["half-difference", "hybrid"].into_iter().enumerate() {
            for budget in [100, 400] {
                let scatter = 1.0 + 1e-4 * ((m * m + c) as f64).sin();
                let error = 0.1 * (m + 1) as f64 / budget as f64 * scatter;
                rows.push(StudyRow {
                    key: String::new(),
                    material: format!("{m} {HOSTILE}"),
                    truth: truth.into(),
                    parametrization: parametrization.into(),
                    warp: "none".into(),
                    sample_set: "grid".into(),
                    instrument: "ideal".into(),
                    reconstruction: "cubic".into(),
                    coordinates: "own".into(),
                    allowed: format!("{budget} poses"),
                    budget,
                    readings: budget,
                    seed: 1,
                    measure: "cosine".into(),
                    nrmse: Some(if c == 1 { ratio * error } else { error }),
                    log_relative: Some(error),
                    log1p: None,
                    cbrt: None,
                    mean_relative: None,
                    max_relative: None,
                    reachable: 1.0,
                    instrument_seconds: Some(60.0 * budget as f64),
                    unphysical_share: 0.0,
                    pairs: 100,
                    pairs_missing: 0,
                    alignment: None,
                    material_key: String::new(),
                    plan_seconds: 0.1,
                    measure_seconds: 0.1,
                    reconstruct_seconds: 0.1,
                    evaluate_seconds: 0.1,
                });
            }
        }
    }
    rows
}

fn report(rows: &[StudyRow]) -> String {
    let plan = StudyPlan::read(&Source::new("study.toml", CONFIG)).unwrap();
    let rows: Vec<&StudyRow> = rows.iter().collect();
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

/// The text between the tags of the verdict.
fn verdict(report: &str) -> &str {
    let start = report.find("class=\"verdict\"").unwrap();
    let rest = &report[start..];
    &rest[..rest.find("</div>").unwrap()]
}

#[test]
fn names_are_text_and_never_markup() {
    let text = report(&rows(7, 1.5, HOSTILE));
    assert!(!text.contains("<script") && !text.contains("<b>them"));
    assert!(text.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
    // Quotes end attributes.
    assert!(!text.contains("alt=\"<") && !text.contains("</script>\""));
    for tag in text.split('<').skip(1).filter_map(|t| t.split_once('>')) {
        assert_eq!(tag.0.matches('"').count() % 2, 0, "{}", tag.0);
    }
    assert!(text.contains("data:image/png;base64,iVBORw=="));
    assert!(!text.contains("<?xml"));
}

#[test]
fn the_verdict_is_what_was_found() {
    let text = report(&rows(12, 1.5, "half-difference table"));
    let worse = verdict(&text);
    assert!(worse.contains("hybrid errs 1.50 times (95 % 1.50–1.50) as much as half-difference"));
    assert!(
        worse.contains("worse on 12 of 12 materials, better on 0"),
        "{worse}"
    );
    // The bias is told beside it.
    assert!(text.contains("it favours a grid in the same coordinates with the same warp"));
    let better = report(&rows(12, 0.8, "theta_h"));
    assert!(verdict(&better).contains("better on 12 of 12 materials, worse on 0"));
    let same = report(&rows(12, 1.0, "neither"));
    let same = verdict(&same);
    assert!(same.contains("there is no difference between hybrid and half-difference"));
    assert!(same.contains("within the band of 1.0 %"), "{same}");
    let few = report(&rows(4, 1.5, "neither"));
    assert!(verdict(&few).contains("undecided, as 4 materials are too few to tell"));
}

#[test]
fn groups_of_truths_stand_side_by_side() {
    let mut rows = rows(6, 1.5, "theta_h");
    for row in rows
        .iter_mut()
        .filter(|r| r.material.starts_with(['3', '4', '5']))
    {
        row.truth = "h_bar".into();
    }
    let text = report(&rows);
    for part in [
        "all 6 materials",
        "3 materials of truth “theta_h”",
        "3 materials of truth “h_bar”",
        "an axis of half-difference coordinates",
        "an axis of hybrid, orthographic",
    ] {
        assert!(text.contains(part), "{part}");
    }
}

#[test]
fn a_report_of_nothing_is_a_page() {
    let text = report(&[]);
    assert!(text.contains("There are no results.") && text.ends_with("</html>"));
}

#[test]
#[cfg(feature = "plots")]
fn instruments_have_a_curve_of_their_own() {
    let mut rows = rows(6, 1.5, "theta_h");
    assert!(report(&rows).contains("minutes of the instrument"));
    for row in &mut rows {
        row.instrument_seconds = None;
    }
    let text = report(&rows);
    assert!(!text.contains("minutes of the instrument") && text.contains("seconds of computing"));
}
