//! `gonio init`: starters, each a config that runs as it is.

use super::talk::note;
use super::{print, refuse_unwritable, written};
use crate::error::Error;
use crate::files::write_atomically;
use clap::{Args, ValueEnum};
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Init {
    /// What the file is to describe
    #[arg(value_enum, default_value = "acquisition")]
    starter: Starter,
    /// File to write, or - to print it [default: NAME.toml]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Starter {
    /// Measure materials, reconstruct them, compare
    Acquisition,
    /// A cross table of coordinates and reconstructions with its statistics
    Study,
    /// Which poses, and which reconstruction: what `gonio advise` compares
    Advise,
    /// Moment profiles of materials
    Moments,
    /// Moments of reflected light, rendered and predicted
    Relations,
    /// A machine of one's own, to be named in `[[instrument]] file = …`
    Instrument,
}

impl Starter {
    fn text(self) -> &'static str {
        match self {
            Starter::Acquisition => include_str!("../../configs/starters/acquisition.toml"),
            Starter::Study => include_str!("../../configs/starters/study.toml"),
            Starter::Advise => super::advise::CONFIG,
            Starter::Moments => include_str!("../../configs/starters/moments.toml"),
            Starter::Relations => include_str!("../../configs/relations.toml"),
            Starter::Instrument => include_str!("../../configs/instruments/cornell.toml"),
        }
    }
}

impl Init {
    pub(super) fn run(self) -> Result<(), Error> {
        let text = self.starter.text();
        let name = self.starter.to_possible_value();
        let name = name.map_or_else(String::new, |value| format!("{}.toml", value.get_name()));
        let path = self.output.unwrap_or_else(|| name.into());
        if path == Path::new("-") {
            return print(text);
        }
        refuse_unwritable(&path, self.force)?;
        let result = write_atomically(&path, |out| out.write_all(text.as_bytes()));
        written(&path, result)?;
        note(&format!(
            "{} is written; next: gonio check {0}",
            path.display()
        ));
        Ok(())
    }
}
