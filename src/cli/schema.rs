//! `gonio schema`.

use super::{choice_of, print};
use crate::error::Error;
use crate::experiment::{config_schema, instrument_schema};
use crate::measurement::measurement_schema;
use crate::schedule::{Choice, schedule_schema};
use clap::Args;

#[derive(Debug, Args)]
pub(super) struct Schema {
    /// Of which file
    #[arg(value_parser = choice_of(&FILES))]
    file: Asked,
}

/// The schema of a kind of files.
type Asked = fn() -> serde_json::Value;

/// Files that have one.
const FILES: [Choice<Asked>; 4] = choices! {
    "schedule", "What `gonio schedule` writes" => schedule_schema;
    "measurement", "What `gonio measure` writes" => measurement_schema;
    "config", "A config, as `gonio run` takes it" => config_schema;
    "instrument", "An instrument file, as `[[instrument]] file = …` names it" => instrument_schema;
};

impl Schema {
    pub(super) fn run(self) -> Result<(), Error> {
        print(&format!("{:#}\n", (self.file)()))
    }
}
