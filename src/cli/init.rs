//! `gonio init`: starters, each a config that runs as it is.

use super::{choices, note, print, refuse_unwritable, write_quietly};
use crate::error::Error;
use crate::experiment::{ADVICE, config_schema, instrument_schema};
use crate::schedule::Choice;
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Init {
    /// What the file is to describe
    #[arg(value_parser = choices(&STARTERS), default_value = "acquisition")]
    starter: &'static Choice<&'static str>,
    /// File to write, or - to print it [default: NAME.toml]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

/// The starter that is no config.
const INSTRUMENT: &str = "instrument";

/// The texts of files, by what they describe.
const STARTERS: [Choice<&str>; 6] = choices! {
    "acquisition", "Measure materials, reconstruct them, compare" =>
        include_str!("../../configs/starters/acquisition.toml");
    "study", "A cross table of coordinates and reconstructions with its statistics" =>
        include_str!("../../configs/starters/study.toml");
    "advise", "Which poses, and which reconstruction: what `gonio advise` compares" => ADVICE;
    "moments", "Moment profiles of materials" =>
        include_str!("../../configs/starters/moments.toml");
    "relations", "Moments of reflected light, rendered and predicted" =>
        include_str!("../../configs/relations.toml");
    INSTRUMENT, "A machine of one's own, to be named in `[[instrument]] file = …`" =>
        include_str!("../../configs/instruments/cornell.toml");
};

impl Init {
    pub(super) fn run(self) -> Result<(), Error> {
        let Choice {
            value: text, name, ..
        } = self.starter;
        let usual = || format!("{name}.toml").into();
        let path = self.output.unwrap_or_else(usual);
        if path == Path::new("-") {
            return print(text);
        }
        refuse_unwritable(&path, self.force)?;
        let (schema, json) = match *name {
            INSTRUMENT => ("gonio-instrument.schema.json", instrument_schema()),
            _ => ("gonio-config.schema.json", config_schema()),
        };
        let schema_path = path.with_file_name(schema);
        if schema_path == path {
            let message =
                "this is the name of the schema that is written beside it; choose another with -o";
            return Err(Error::output(path, message));
        }
        let is_ours = |text: String| text.contains("json-schema.org") && text.contains("gonio");
        if !fs::read_to_string(&schema_path).is_ok_and(is_ours) {
            refuse_unwritable(&schema_path, self.force)?;
        }
        // Editors of TOML check and complete by the file that this comment names, relative to the config.
        let text = format!("#:schema {schema}\n{text}");
        write_quietly(&path, text)?;
        write_quietly(&schema_path, format!("{json:#}\n"))?;
        let (path, schema) = (path.display(), schema_path.display());
        note(&format!(
            "{path} is written, and {schema} for editors; next: gonio check {path}"
        ));
        Ok(())
    }
}
