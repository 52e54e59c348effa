//! JSON Schema (2020-12) of the lines of a measurement.

use crate::schedule::ScheduleRow;
use crate::schedule::record::{line_schema, row_schema};
use schemars::JsonSchema;
use serde_json::{Value, json};

/// A row of a measurement: that of its schedule, and what was read there. Values are empty where
/// there is no reading; `flags` says why. Values by wavelength have columns such as `value_450nm`.
#[derive(Clone, Debug, JsonSchema)]
pub struct MeasurementRow {
    /// The pose.
    #[schemars(flatten)]
    pub pose: ScheduleRow,
    /// Luminance of f_r, sr⁻¹, without the cosine.
    pub value: Option<f64>,
    /// Red of f_r, sr⁻¹, without the cosine.
    pub value_r: Option<f64>,
    /// Green of f_r, sr⁻¹, without the cosine.
    pub value_g: Option<f64>,
    /// Blue of f_r, sr⁻¹, without the cosine.
    pub value_b: Option<f64>,
    /// Standard uncertainty (k = 1) of the scatter between readings, sr⁻¹.
    #[schemars(range(min = 0.0))]
    pub type_a: Option<f64>,
    /// Standard uncertainty (k = 1) of what readings share, sr⁻¹.
    #[schemars(range(min = 0.0))]
    pub type_b: Option<f64>,
    /// Both together: the root of the sum of their squares, sr⁻¹.
    #[schemars(range(min = 0.0))]
    pub uncertainty: Option<f64>,
    /// `type_a` of red.
    #[schemars(range(min = 0.0))]
    pub type_a_r: Option<f64>,
    /// `type_b` of red.
    #[schemars(range(min = 0.0))]
    pub type_b_r: Option<f64>,
    /// `uncertainty` of red.
    #[schemars(range(min = 0.0))]
    pub uncertainty_r: Option<f64>,
    /// `type_a` of green.
    #[schemars(range(min = 0.0))]
    pub type_a_g: Option<f64>,
    /// `type_b` of green.
    #[schemars(range(min = 0.0))]
    pub type_b_g: Option<f64>,
    /// `uncertainty` of green.
    #[schemars(range(min = 0.0))]
    pub uncertainty_g: Option<f64>,
    /// `type_a` of blue.
    #[schemars(range(min = 0.0))]
    pub type_a_b: Option<f64>,
    /// `type_b` of blue.
    #[schemars(range(min = 0.0))]
    pub type_b_b: Option<f64>,
    /// `uncertainty` of blue.
    #[schemars(range(min = 0.0))]
    pub uncertainty_b: Option<f64>,
    /// What is odd about the reading, or why there is none; several joined by `;`.
    pub flags: Option<String>,
    /// Number of the try, from 1; a later one replaces an earlier one.
    #[schemars(range(min = 1))]
    pub attempt: Option<u32>,
}

/// The JSON Schema of one line of a measurement in JSON Lines: a row, or the header in front.
pub fn measurement_schema() -> Value {
    let mut row = row_schema::<MeasurementRow>();
    let patterns = row.get_mut("patternProperties");
    if let Some(patterns) = patterns.and_then(Value::as_object_mut) {
        let value = json!({ "type": ["number", "null"] });
        let uncertainty = json!({ "type": ["number", "null"], "minimum": 0.0 });
        for (family, cell) in [
            ("value", &value),
            ("type_a", &uncertainty),
            ("type_b", &uncertainty),
            ("uncertainty", &uncertainty),
        ] {
            patterns.insert(format!("^{family}_[0-9.]+nm$"), cell.clone());
        }
    }
    line_schema("A line of a gonio measurement", row)
}
