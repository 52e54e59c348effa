//! Output of an experiment of kind `relations`: a table for people and one for programs.

use crate::experiment::moments::degrees;
use crate::experiment::relations::RelationRow;
use crate::moments::relations::{AngleMoments, Prediction, Relation};
use crate::numeric::upper_median;
use crate::report::each_once;
use crate::report::schema::{Schema, columns};
use serde_json::{Map, Value};

/// A form of the relations, with its name.
pub(super) type Form = (&'static str, fn(&Relation) -> Option<Prediction>);

/// A moment, with its name; `None` where a form has none.
pub(super) type Moment = (&'static str, fn(&AngleMoments) -> Option<f64>);

/// The forms, in the order of the columns.
pub(super) const FORMS: [Form; 4] = [
    ("printed", |r| r.printed),
    ("corrected", |r| r.corrected),
    ("windowed", |r| r.windowed),
    ("mixture", |r| r.mixture),
];

/// The moments of a form, in the order of the columns.
const MOMENTS: [Moment; 5] = [
    ("energy", |m| Some(m.energy)),
    ("mean_rad", |m| Some(m.mean)),
    ("variance_rad2", |m| Some(m.variance)),
    ("skewness", |m| m.skewness),
    ("kurtosis", |m| m.kurtosis),
];

/// Skewness and kurtosis of radiance above which their errors are summed up: nearer to 0 nothing is predicted.
const AT_LEAST: [f64; 2] = [0.2, 0.3];

/// Relations as CSV: a row per material, lighting, view and direction of its motion.
pub fn relations_csv(rows: &[RelationRow]) -> String {
    schema().csv(rows)
}

/// Relations by the names of the columns, `null` where there is no value.
pub fn relation_objects(rows: &[RelationRow]) -> Vec<Map<String, Value>> {
    schema().objects(rows)
}

/// The columns of `relations.csv`. Errors are relative to the rendered value, those of means in rendered standard deviations, of
/// skewness and (excess) kurtosis the difference.
fn schema() -> Schema<RelationRow> {
    let mut schema = columns! { row in RelationRow;
        "material" => row.material.clone(),
        "lighting" => row.lighting.clone(),
        "along" => row.relation.along.name(),
        "theta_o_deg" => degrees(row.relation.theta_o),
        "window_deg" => degrees(row.relation.window),
        "slope" => row.relation.slope,
        "slice_energy" => row.relation.energy,
        "slice_mean_rad" => row.relation.mean,
        "slice_variance_rad2" => row.relation.variance,
    };
    for (name, of) in MOMENTS {
        schema = schema.and(columns! { row in RelationRow;
            format!("rendered_{name}") => row.relation.rendered.as_ref().and_then(of),
            format!("rendered_{name}_uncertainty") => row.relation.uncertainty.as_ref().and_then(of),
        });
    }
    for (form, predicted) in FORMS {
        for (name, of) in MOMENTS {
            schema = schema.and(columns! { row in RelationRow;
                format!("{form}_{name}") => predicted(&row.relation).and_then(|p| of(&p.moments)),
            });
        }
        for (name, of) in MOMENTS {
            // They have no unit.
            let name = name.split('_').next().unwrap_or(name);
            schema = schema.and(columns! { row in RelationRow;
                format!("{form}_{name}_error") => predicted(&row.relation).and_then(|p| of(p.errors.as_ref()?)),
            });
        }
    }
    schema.and(columns! { row in RelationRow;
        "components" => row.relation.components,
        "misfit" => row.relation.misfit,
        "cut_share" => row.relation.cut_share,
        "missing_share" => row.relation.missing_share,
        "views" => row.relation.views,
        "resolved" => row.relation.resolved,
    })
}

/// The head of the table for people.
pub fn relations_head() -> String {
    let forms: String = FORMS.map(|(form, _)| format!("  {form:^28}")).concat();
    let moments = format!("  {:>8} {:>9} {:>9}", "energy", "mean", "variance").repeat(FORMS.len());
    format!(
        "Errors against rendering: energy and variance relative to it, mean in its standard deviations.\n\n\
         {:47}{forms}\n{:33} {:>6} {:>6}{moments}\n",
        "", "  material, lighting, along", "window", "view"
    )
}

/// The lines of the table for people, one per row.
pub fn relations_lines(rows: &[RelationRow]) -> String {
    let mut out = String::new();
    for row in rows {
        let r = &row.relation;
        let name = format!("  {}, {}, {}", row.material, row.lighting, r.along.name());
        let [window, view] = [r.window, r.theta_o].map(degrees_text);
        out += &format!("{name:<33} {window:>5}° {view:>5}°");
        for (_, form) in FORMS {
            out += "  ";
            out += &match form(r).and_then(|p| p.errors) {
                Some(e) => {
                    let [energy, variance] = [e.energy, e.variance].map(|e| 100.0 * e);
                    format!("{energy:>7.1}% {:>9.3} {variance:>8.1}%", e.mean)
                }
                None => format!("{:>28}", "undefined"),
            };
        }
        out += if r.resolved { "\n" } else { "  unresolved\n" };
    }
    out
}

/// The summary of a run: of each form the median and the largest error over materials, lights and views.
pub fn relations_summary(rows: &[RelationRow]) -> String {
    let [skewness, kurtosis] = AT_LEAST;
    let mut out = format!(
        "\nMedian and largest error, without their signs; of skewness and kurtosis the difference, where they exceed {skewness} and {kurtosis}:\n\
         {:28}{:>19}{:>17}{:>19}{:>17}{:>17}  without a value\n",
        "  window, along, form", "energy", "mean", "variance", "skewness", "kurtosis"
    );
    let relations = || rows.iter().map(|r| &r.relation);
    let windows = each_once(relations().map(|r| r.window.to_bits()));
    let mut along = each_once(relations().map(|r| r.along));
    along.sort_by_key(|a| a.name());
    for window in windows {
        for along in &along {
            let of_kind = |r: &&Relation| r.along == *along && r.window.to_bits() == window;
            let degrees = degrees_text(f64::from_bits(window));
            for (name, form) in FORMS {
                let lead = format!("  {degrees}°, {}, {name}", along.name());
                out += &format!("{lead:28}");
                let mut lacks = 0;
                for (i, (moment, of)) in MOMENTS.iter().enumerate() {
                    let mut errors = Vec::new();
                    for r in relations().filter(of_kind) {
                        let Some(rendered) = r.rendered.as_ref().and_then(of) else {
                            continue;
                        };
                        if i >= 3 && !(rendered.abs() > AT_LEAST[i - 3]) {
                            continue;
                        }
                        match form(r).and_then(|p| of(p.errors.as_ref()?)) {
                            Some(error) => errors.push(error.abs()),
                            None => lacks += usize::from(i == 0),
                        }
                    }
                    out += &spread_text(moment, errors);
                }
                out += &format!("{lacks:>8}\n");
            }
        }
    }
    out
}

/// An angle as it was written, in degrees.
pub(super) fn degrees_text(radians: f64) -> String {
    ((radians.to_degrees() * 1e9).round() / 1e9).to_string()
}

/// Median and largest of errors without signs.
fn spread_text(moment: &str, mut errors: Vec<f64>) -> String {
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let median = upper_median(&mut errors);
    match (median, moment) {
        (Some(median), "energy" | "variance_rad2") => {
            format!(" {:>8.2}% {:>7.1}%", 100.0 * median, 100.0 * largest)
        }
        (Some(median), _) => format!(" {median:>8.3} {largest:>7.3}"),
        (None, "energy" | "variance_rad2") => format!("{:>19}", "-"),
        (None, _) => format!("{:>17}", "-"),
    }
}
