//! Numbers of rows.

/// A number, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// `None` where undefined.
    pub value: Option<f64>,
    /// Its standard error, or what it is known to; `None` of what is exact.
    pub uncertainty: Option<f64>,
}

impl Value {
    /// A number that is known.
    pub(crate) fn exact(value: f64) -> Self {
        Self {
            value: Some(value),
            uncertainty: None,
        }
    }

    /// An estimate.
    pub(crate) fn estimated(value: Option<f64>, uncertainty: Option<f64>) -> Self {
        Self { value, uncertainty }
    }
}
