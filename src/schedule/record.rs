//! JSON Schema (2020-12) of the lines of a schedule.

use super::import::coordinate_columns;
use schemars::JsonSchema;
use serde_json::{Map, Value, json};

/// A row of a schedule. Columns of coordinates and of axis positions come on top: which ones the
/// header says.
#[derive(Clone, Debug, JsonSchema)]
pub struct ScheduleRow {
    /// Number of the pose in its schedule, from 0.
    pub index: Option<u32>,
    /// Angle of the light from the normal, degrees.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub theta_i_deg: f64,
    /// Azimuth of the light, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub phi_i_deg: f64,
    /// Angle of the sensor from the normal, degrees.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub theta_o_deg: f64,
    /// Azimuth of the sensor, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub phi_o_deg: f64,
    /// Number of the run of rows that share a light direction, from 0.
    pub block: Option<u32>,
    /// Travel from the row before, and settling, s.
    #[schemars(range(min = 0.0))]
    pub move_seconds: Option<f64>,
    /// All exposures of this pose, s.
    #[schemars(range(min = 0.0))]
    pub exposure_seconds: Option<f64>,
    /// Moving, exposures, overhead and a calibration before it, s.
    #[schemars(range(min = 0.0))]
    pub seconds: Option<f64>,
    /// From the start to the middle of the exposures, s.
    #[schemars(range(min = 0.0))]
    pub at_seconds: Option<f64>,
}

/// The JSON Schema of one line of a schedule in JSON Lines: a row, or the header in front.
pub fn schedule_schema() -> Value {
    line_schema("A line of a gonio schedule", row_schema::<ScheduleRow>())
}

/// The schema of a row with the columns of coordinates and axes, which no struct can name.
pub(crate) fn row_schema<T: JsonSchema>() -> Value {
    let mut schema = schemars::schema_for!(T).to_value();
    let number = json!({ "type": ["number", "null"] });
    if let Some(properties) = schema.get_mut("properties").and_then(Value::as_object_mut) {
        let plain = coordinate_columns().into_iter();
        let plain = plain.filter(|column| !column.ends_with("_deg"));
        properties.extend(plain.map(|column| (column, number.clone())));
    }
    if let Some(object) = schema.as_object_mut() {
        object.insert("patternProperties".into(), json!({ "_deg$": number }));
        object.insert("additionalProperties".into(), json!(false));
        object.remove("$schema");
    }
    schema
}

/// A row, or the header.
pub(crate) fn line_schema(title: &str, row: Value) -> Value {
    let mut schema = Map::new();
    let version = "https://json-schema.org/draft/2020-12/schema";
    schema.insert("$schema".into(), json!(version));
    schema.insert("title".into(), json!(title));
    let header = json!({
        "type": "object",
        "description": "The first line: what the columns are, and facts about the rows.",
        "properties": { "header": { "type": "object" } },
        "required": ["header"],
        "additionalProperties": false,
    });
    schema.insert("oneOf".into(), json!([header, row]));
    Value::Object(schema)
}
