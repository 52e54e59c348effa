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

/// A moment, with its name.
pub(super) type Moment = (&'static str, fn(&AngleMoments) -> f64);

/// The forms, in the order of the columns.
pub(super) const FORMS: [Form; 3] = [
    ("printed", |r| r.printed),
    ("corrected", |r| r.corrected),
    ("windowed", |r| r.windowed),
];

/// The moments of a form, in the order of the columns.
const MOMENTS: [Moment; 3] = [
    ("energy", |m| m.energy),
    ("mean_rad", |m| m.mean),
    ("variance_rad2", |m| m.variance),
];

/// Relations as CSV: a row per material, lighting, view and direction of its motion.
pub fn relations_csv(rows: &[RelationRow]) -> String {
    schema().csv(rows)
}

/// Relations by the names of the columns, `null` where there is no value.
pub fn relation_objects(rows: &[RelationRow]) -> Vec<Map<String, Value>> {
    schema().objects(rows)
}

/// The columns of `relations.csv`. Errors are relative to the rendered value, those of means in rendered standard deviations.
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
            format!("rendered_{name}") => row.relation.rendered.as_ref().map(of),
            format!("rendered_{name}_uncertainty") => row.relation.uncertainty.as_ref().map(of),
        });
    }
    for (form, predicted) in FORMS {
        for (name, of) in MOMENTS {
            schema = schema.and(columns! { row in RelationRow;
                format!("{form}_{name}") => predicted(&row.relation).map(|p| of(&p.moments)),
            });
        }
        for (name, of) in MOMENTS {
            // They have no unit.
            let name = name.split('_').next().unwrap_or(name);
            schema = schema.and(columns! { row in RelationRow;
                format!("{form}_{name}_error") => predicted(&row.relation).and_then(|p| p.errors.as_ref().map(of)),
            });
        }
    }
    schema.and(columns! { row in RelationRow;
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
         {:40}{forms}\n{:33} {:>6}{moments}\n",
        "", "  material, lighting, along", "view"
    )
}

/// The lines of the table for people, one per row.
pub fn relations_lines(rows: &[RelationRow]) -> String {
    let mut out = String::new();
    for row in rows {
        let r = &row.relation;
        let name = format!("  {}, {}, {}", row.material, row.lighting, r.along.name());
        out += &format!("{name:<33} {:>5.0}°", r.theta_o.to_degrees());
        for (_, form) in FORMS {
            out += "  ";
            out += &match form(r).and_then(|p| p.errors) {
                Some(e) => errors_text([e.energy, e.mean, e.variance]),
                None => format!("{:>28}", "undefined"),
            };
        }
        out += if r.resolved { "\n" } else { "  unresolved\n" };
    }
    out
}

/// Errors of energy, mean and variance.
fn errors_text([energy, mean, variance]: [f64; 3]) -> String {
    let [energy, variance] = [energy, variance].map(|e| 100.0 * e);
    format!("{energy:>7.1}% {mean:>9.3} {variance:>8.1}%")
}

/// The summary of a run: median error of each form over materials, lights and views.
pub fn relations_summary(rows: &[RelationRow]) -> String {
    let mut out = String::from("\nMedian error, without its sign:\n");
    let mut along = each_once(rows.iter().map(|r| r.relation.along));
    along.sort_by_key(|a| a.name());
    for along in along {
        out += &format!("  along {:<33}", along.name());
        for (_, form) in FORMS {
            let errors = rows.iter().map(|r| &r.relation);
            let errors = errors.filter(|r| r.along == along);
            let errors: Vec<AngleMoments> = errors.filter_map(|r| form(r)?.errors).collect();
            let of = |value: fn(&AngleMoments) -> f64| {
                let mut values: Vec<f64> = errors.iter().map(|e| value(e).abs()).collect();
                upper_median(&mut values).unwrap_or(f64::NAN)
            };
            out += "  ";
            out += &errors_text(MOMENTS.map(|(_, moment)| of(moment)));
        }
        out += "\n";
    }
    out
}
