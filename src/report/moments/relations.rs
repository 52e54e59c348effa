//! Output of an experiment of kind `relations`: a table for people and one for programs.

use crate::experiment::moments::{degrees, shown};
use crate::experiment::relations::RelationRow;
use crate::moments::relations::{AngleMoments, Prediction, Relation};
use crate::report::csv::Csv;
use std::io::{self, Write};

/// A form of the relations, with its name.
pub(super) type Form = (&'static str, fn(&Relation) -> Option<Prediction>);

/// A moment, with its name.
type Moment = (&'static str, fn(&AngleMoments) -> f64);

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

/// Writes relations as CSV: a row per material, lighting, view and direction of its motion.
///
/// # Errors
/// Whatever `out` reports.
pub fn relations_csv(rows: &[RelationRow], out: &mut impl Write) -> io::Result<()> {
    let mut csv = Csv::new(out);
    csv.row(columns())?;
    for row in rows {
        csv.row(fields(row))?;
    }
    csv.flush()
}

/// The columns of `relations.csv`.
fn columns() -> Vec<String> {
    let mut columns: Vec<String> = [
        "material",
        "lighting",
        "along",
        "theta_o_deg",
        "window_deg",
        "slope",
        "slice_energy",
        "slice_mean_rad",
        "slice_variance_rad2",
    ]
    .map(String::from)
    .into();
    for (name, _) in MOMENTS {
        columns.push(format!("rendered_{name}"));
        columns.push(format!("rendered_{name}_uncertainty"));
    }
    for (form, _) in FORMS {
        columns.extend(MOMENTS.iter().map(|(name, _)| format!("{form}_{name}")));
        columns.extend(["energy", "mean", "variance"].map(|m| format!("{form}_{m}_error")));
    }
    columns.extend(["cut_share", "missing_share", "views", "resolved"].map(String::from));
    columns
}

/// The fields of a row; empty where there is no value. Errors are relative to the rendered value,
/// those of means in rendered standard deviations.
fn fields(row: &RelationRow) -> Vec<String> {
    let r = &row.relation;
    let number = |v: Option<f64>| v.map_or(String::new(), shown);
    let mut fields = vec![
        row.material.clone(),
        row.lighting.clone(),
        r.along.name().into(),
        shown(degrees(r.theta_o)),
        shown(degrees(r.window)),
        shown(r.slope),
        shown(r.energy),
        shown(r.mean),
        shown(r.variance),
    ];
    for (_, of) in MOMENTS {
        fields.push(number(r.rendered.as_ref().map(of)));
        fields.push(number(r.uncertainty.as_ref().map(of)));
    }
    for (_, form) in FORMS {
        let prediction = form(r);
        let errors = prediction.and_then(|p| p.errors);
        let moments = prediction.map(|p| p.moments);
        fields.extend(
            MOMENTS
                .iter()
                .map(|(_, of)| number(moments.as_ref().map(of))),
        );
        fields.extend(
            MOMENTS
                .iter()
                .map(|(_, of)| number(errors.as_ref().map(of))),
        );
    }
    fields.push(shown(r.cut_share));
    fields.push(shown(r.missing_share));
    fields.push(r.views.to_string());
    fields.push(r.resolved.to_string());
    fields
}

/// The head of the table for people.
pub fn relations_head() -> String {
    format!(
        "Errors against rendering: energy and variance relative to it, mean in its standard deviations.\n\n\
         {:33} {:>6}  {:^28}  {:^28}  {:^28}\n",
        "", "", "printed", "corrected", "windowed"
    ) + &format!(
        "{:33} {:>6}  {h}  {h}  {h}\n",
        "  material, lighting, along",
        "view",
        h = format_args!("{:>8} {:>9} {:>9}", "energy", "mean", "variance")
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
                Some(e) => format!(
                    "{:>7.1}% {:>9.3} {:>8.1}%",
                    100.0 * e.energy,
                    e.mean,
                    100.0 * e.variance
                ),
                None => format!("{:>28}", "undefined"),
            };
        }
        out += if r.resolved { "\n" } else { "  unresolved\n" };
    }
    out
}

/// The summary of a run: median error of each form over materials, lights and views.
pub fn relations_summary(rows: &[RelationRow]) -> String {
    let mut out = String::from("\nMedian error, without its sign:\n");
    let mut along: Vec<_> = rows.iter().map(|r| r.relation.along).collect();
    along.dedup();
    along.sort_by_key(|a| a.name());
    along.dedup();
    for along in along {
        out += &format!("  along {:<33}", along.name());
        for (_, form) in FORMS {
            let errors = rows.iter().map(|r| &r.relation);
            let errors = errors.filter(|r| r.along == along);
            let errors: Vec<AngleMoments> = errors.filter_map(|r| form(r)?.errors).collect();
            let of = |value: fn(&AngleMoments) -> f64| {
                let mut values: Vec<f64> = errors.iter().map(|e| value(e).abs()).collect();
                values.sort_by(f64::total_cmp);
                values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
            };
            out += &format!(
                "  {:>7.1}% {:>9.3} {:>8.1}%",
                100.0 * of(|e| e.energy),
                of(|e| e.mean),
                100.0 * of(|e| e.variance)
            );
        }
        out += "\n";
    }
    out
}
