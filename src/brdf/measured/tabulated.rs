//! Any material as a measured table: what a file of it would give back.
//!
//! The nested material is written by the format's writer and read by its reader, so that the result
//! has the cells, the rounding and the missing data of a file, without one. It answers "how much of
//! the error is the table's?" before an instrument is involved.

use super::merl::{Interpolation, Merl, MerlError, MerlGrid, write_merl};
use crate::brdf::{self, Brdf, BrdfSpec, BuildError, Channels, Favours};
use crate::error::ParameterError;
use crate::geometry::Symmetry;
use crate::registry::{self, Entry, ReadError, Table};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "tabulated";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "another material, written to a table in memory and read back",
    examples: &["of = { kind = \"lambert\", albedo = 0.5 }"],
    read: |table| Ok(Box::new(TabulatedSpec::read(table)?)),
};

/// The format of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TableFormat {
    /// MERL: 90×90×180 cells, or 90×90×360 if the material is not reciprocal.
    #[default]
    Merl,
}

impl TableFormat {
    fn name(self) -> &'static str {
        match self {
            TableFormat::Merl => "merl",
        }
    }
}

/// The keys beside the nested material.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Keys {
    format: TableFormat,
    interpolation: Interpolation,
}

/// What a config says.
#[derive(Debug)]
pub struct TabulatedSpec {
    keys: Keys,
    of: Box<dyn BrdfSpec>,
}

impl TabulatedSpec {
    /// A table of `of`.
    pub fn new(of: Box<dyn BrdfSpec>, format: TableFormat, interpolation: Interpolation) -> Self {
        let keys = Keys {
            format,
            interpolation,
        };
        Self { keys, of }
    }

    fn read(mut table: Table<'_>) -> Result<Self, ReadError> {
        let Some(of) = registry::take_table(&mut table, "of")? else {
            let message = "of is missing from the tabulated material; allowed: the table of a \
                           material, e.g. of = { kind = \"lambert\" }";
            return Err(ReadError::at(table.span(), message));
        };
        let of = brdf::read(of)?;
        let keys = registry::parse(table)?;
        Ok(Self { keys, of })
    }
}

impl BrdfSpec for TabulatedSpec {
    fn resolved(&self) -> toml::Table {
        let mut table = registry::resolved(KIND, &self.keys);
        table.insert("of".into(), self.of.resolved().into());
        table
    }

    fn label(&self) -> String {
        format!("{}-of-{}", self.keys.format.name(), self.of.label())
    }

    fn check(&self) -> Result<(), BuildError> {
        self.of.check()?;
        if self.symmetry()?.isotropic {
            return Ok(());
        }
        let allowed = format!("another material: {}", MerlError::NotIsotropic);
        Err(ParameterError::new("of", self.of.label(), allowed).into())
    }

    fn symmetry(&self) -> Result<Symmetry, BuildError> {
        self.of.symmetry()
    }

    fn favours(&self) -> Favours {
        let TableFormat::Merl = self.keys.format;
        Favours::HalfDifferenceTable
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let TableFormat::Merl = self.keys.format;
        let brdf = self.of.build(channels)?;
        let table = merl_of(brdf.as_ref(), channels).map_err(|e| {
            // Memory neither fails nor runs over: what is left is a material that does not fit.
            ParameterError::new("of", self.of.label(), format!("another material: {e}"))
        })?;
        Ok(Box::new(table.with_interpolation(self.keys.interpolation)))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.of.inputs()
    }
}

fn merl_of(brdf: &dyn Brdf, channels: Channels) -> Result<Merl, MerlError> {
    let grid = MerlGrid::holding(brdf)?;
    let mut bytes = Vec::with_capacity(grid.file_len() as usize);
    write_merl(brdf, grid, &mut bytes)?;
    let table = Merl::read(bytes.as_slice(), channels)?;
    Ok(table.with_bilateral(brdf.symmetry().bilateral))
}
