//! Any material as a measured table: the values that a file of it would give.
//!
//! The nested material is written by the format's writer and read by its reader, so that the result
//! has the cells, the rounding and the missing data of a file, without one. It answers "how much of
//! the error is the table's?" before an instrument is involved.

use super::merl::{Interpolation, Merl, MerlGrid, NOT_ISOTROPIC, Nodes, write_merl};
use super::utia::{FILE_LEN, Utia, write_utia};
use super::{TableError, without_wavelengths};
use crate::brdf::{self, Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::error::ParameterError;
use crate::geometry::Symmetry;
use crate::registry::{self, Entry, ReadError, Table, named};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

const KIND: &str = "tabulated";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "another material, written to a table in memory and read back",
    examples: &["of = { kind = \"lambert\", albedo = 0.5 }"],
    read: |table| Ok(Box::new(TabulatedSpec::read(table)?)),
};

named! {
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum TableFormat {
        /// MERL: 90×90×180 cells, or 90×90×360 if the material is not reciprocal.
        #[default]
        Merl = "merl",
        /// UTIA: 6×48 light directions × 6×48 sensor directions, to 75°.
        Utia = "utia",
    }
}

/// The keys beside the nested material, which is taken out before and listed so that the message
/// about an unknown key names it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Keys {
    format: TableFormat,
    /// Interpolation between nodes; of MERL tables only.
    interpolation: Option<Interpolation>,
    /// Where in its cell a value is exact; of MERL tables only.
    nodes: Option<Nodes>,
    #[serde(rename = "of", skip_serializing)]
    _of: IgnoredAny,
}

/// A tabulated material, as a config writes it.
#[derive(Debug)]
pub struct TabulatedSpec {
    keys: Keys,
    of: Box<dyn BrdfSpec>,
}

impl TabulatedSpec {
    fn read(mut table: Table<'_>) -> Result<Self, ReadError> {
        let Some(of) = registry::take(&mut table, "of", brdf::read)? else {
            let message = "of is missing from the tabulated material; allowed: the table of a \
                           material, e.g. of = { kind = \"lambert\" }";
            return Err(ReadError::new(table.span(), message));
        };
        let span = table.span();
        let mut keys: Keys = registry::parse(table)?;
        let interpolation = keys.interpolation.map(|_| "interpolation");
        match (keys.format, interpolation.or(keys.nodes.map(|_| "nodes"))) {
            (TableFormat::Merl, _) => {
                // Resolved keys name both.
                keys.interpolation.get_or_insert_default();
                keys.nodes.get_or_insert_default();
            }
            (TableFormat::Utia, None) => {}
            (TableFormat::Utia, Some(key)) => {
                let message = format!(
                    "{key} is a key of format \"merl\"; a table of format \"utia\" is linear in its four angles"
                );
                return Err(ReadError::new(span, message));
            }
        }
        Ok(Self { keys, of })
    }
}

impl BrdfSpec for TabulatedSpec {
    fn resolved(&self) -> registry::Keys {
        let own = registry::resolved(KIND, &self.keys);
        registry::with(own, "of", self.of.resolved())
    }

    fn label(&self) -> String {
        format!("{}-of-{}", self.keys.format.name(), self.of.label())
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        without_wavelengths("format", self.keys.format.name(), channels)?;
        self.of.check(channels)?;
        if self.keys.format == TableFormat::Utia || self.symmetry(channels)?.isotropic {
            return Ok(());
        }
        let allowed = format!("another material: {NOT_ISOTROPIC}");
        Err(ParameterError::new("of", self.of.label(), allowed).into())
    }

    fn symmetry(&self, channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(match self.keys.format {
            TableFormat::Merl => self.of.symmetry(channels)?,
            // The nodes are the same for light and sensor and on both sides of both tangent axes, so that exchanges and mirrors
            // stay; a turn by less than a step falls between nodes.
            TableFormat::Utia => self.of.symmetry(channels)?.with_isotropy(false),
        })
    }

    fn favours(&self) -> Favours {
        match self.keys.format {
            TableFormat::Merl => Favours::HalfDifferenceTable,
            TableFormat::Utia => Favours::SphericalTable,
        }
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        without_wavelengths("format", self.keys.format.name(), &channels)?;
        let brdf = self.of.build(channels.clone())?;
        // Memory neither fails nor runs over: what is left is a material that does not fit.
        let refused = |e: TableError| {
            ParameterError::new("of", self.of.label(), format!("another material: {e}"))
        };
        Ok(match self.keys.format {
            TableFormat::Merl => {
                let nodes = self.keys.nodes.unwrap_or_default();
                let table = merl_of(&*brdf, nodes, channels).map_err(refused)?;
                Box::new(table.with_interpolation(self.keys.interpolation.unwrap_or_default()))
            }
            TableFormat::Utia => Box::new(utia_of(&*brdf, channels).map_err(refused)?),
        })
    }

    fn remarks(&self) -> Vec<String> {
        self.of.remarks()
    }

    fn tables(&self) -> Tables {
        let bytes = match self.keys.format {
            // The grid is chosen when the material is built: the larger one.
            TableFormat::Merl => MerlGrid::FULL.file_len(),
            TableFormat::Utia => FILE_LEN,
        };
        Tables {
            channel_bytes: bytes as usize / Channels::Rgb.count(),
            ..self.of.tables()
        }
    }
}

fn merl_of(brdf: &dyn Brdf, nodes: Nodes, channels: Channels) -> Result<Merl, TableError> {
    let grid = MerlGrid::holding(brdf)?.with_nodes(nodes);
    let mut bytes = Vec::with_capacity(grid.file_len() as usize);
    write_merl(brdf, grid, &mut bytes)?;
    let mut table = Merl::read(bytes.as_slice(), channels)?.with_nodes(nodes);
    table.bilateral = brdf.symmetry().bilateral;
    Ok(table)
}

fn utia_of(brdf: &dyn Brdf, channels: Channels) -> Result<Utia, TableError> {
    let mut bytes = Vec::with_capacity(FILE_LEN as usize);
    write_utia(brdf, &mut bytes)?;
    let mut table = Utia::read(bytes.as_slice(), 1.0, channels)?;
    table.symmetry = brdf.symmetry().with_isotropy(false);
    Ok(table)
}
