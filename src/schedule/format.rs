//! File formats of schedules and readings.

/// Forms of a table with a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScheduleFormat {
    /// Comma-separated values with a commented header.
    Csv,
    /// One JSON object per line, the first one the header.
    JsonLines,
    /// An archive of NumPy, an array a column.
    #[cfg(feature = "arrays")]
    Arrays,
}

impl ScheduleFormat {
    /// The form of a text: JSON Lines begin with an object.
    pub fn of_text(text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        if text.trim_start().starts_with('{') {
            Self::JsonLines
        } else {
            Self::Csv
        }
    }
}
