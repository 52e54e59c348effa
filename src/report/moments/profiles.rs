//! Moment profiles as files: a row per material, channel and view.

use crate::experiment::moments::{ProfileRow, degrees};
use crate::moments::Component;
use crate::report::rows_json;
use crate::report::schema::{Schema, columns};
use serde_json::{Map, Value};

/// The columns of `profiles.csv`.
fn schema<'a>() -> Schema<ProfileRow<'a>> {
    let moment = |c: Component| {
        columns! { row in ProfileRow<'a>;
            c.to_string() => row.slice.moments.get(c).map(|e| e.value),
            format!("{c}_uncertainty") => row.slice.moments.get(c).map(|e| e.uncertainty),
        }
    };
    let first = columns! { row in ProfileRow<'a>;
        "material" => row.material,
        "channel" => row.channel.name(),
        "theta_o_deg" => degrees(row.theta_o),
        "phi_o_deg" => degrees(row.phi_o),
    };
    let last = columns! { row in ProfileRow<'a>;
        "missing_share" => row.slice.missing_share,
        "clamped_share" => row.slice.clamped_share,
        "evaluations" => row.slice.evaluations,
        "unresolved" => row.slice.unresolved.map(|why| why.to_string()),
    };
    let moments = Component::ALL.into_iter().map(moment);
    moments.fold(first, Schema::and).and(last)
}

/// Rows as CSV; an undefined moment is an empty field.
pub fn profiles_csv(rows: &[ProfileRow<'_>]) -> String {
    schema().csv(rows)
}

/// Rows as objects with the names of the columns; an undefined moment is `null`, one of unknown uncertainty (an infinite
/// one) has `null` for that.
pub fn profile_objects(rows: &[ProfileRow<'_>]) -> Vec<Map<String, Value>> {
    schema().objects(rows)
}

/// [`profile_objects`] as a JSON array.
pub fn profiles_json(rows: &[ProfileRow<'_>]) -> String {
    rows_json(&profile_objects(rows))
}
