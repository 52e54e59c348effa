//! `gonio schema`.

use super::print;
use crate::error::Error;
use crate::experiment::{config_schema, instrument_schema};
use crate::measurement::measurement_schema;
use crate::schedule::schedule_schema;
use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
pub(super) struct Schema {
    /// Of which file
    file: File,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum File {
    /// What `gonio schedule` writes
    Schedule,
    /// What `gonio measure` writes
    Measurement,
    /// A config, as `gonio run` takes it
    Config,
    /// An instrument file, as `[[instrument]] file = …` names it
    Instrument,
}

impl Schema {
    pub(super) fn run(self) -> Result<(), Error> {
        let schema = match self.file {
            File::Schedule => schedule_schema(),
            File::Measurement => measurement_schema(),
            File::Config => config_schema(),
            File::Instrument => instrument_schema(),
        };
        print(&format!("{schema:#}\n"))
    }
}
