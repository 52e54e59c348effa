//! In which form schedules and readings are written.

use serde::{Deserialize, Serialize};

/// File formats of a schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScheduleFormat {
    /// Comma-separated values with a commented header.
    Csv,
    /// One JSON object a line, the first one the header.
    JsonLines,
}

impl ScheduleFormat {
    /// The format a file name asks for: `.csv`, `.jsonl` or `.ndjson`.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "jsonl" | "ndjson" => Some(Self::JsonLines),
            _ => None,
        }
    }

    /// The extension of file names.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::JsonLines => "jsonl",
        }
    }
}
