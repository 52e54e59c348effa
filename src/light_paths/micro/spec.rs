//! A micro-surface, as a config writes it.

use super::super::facets::{self, FacetsSpec};
use super::super::gathered::Event;
use super::super::normals::{Facet, Normals};
use super::super::smith::PATHS;
use super::super::surface::{self, SurfaceSpec};
use super::{MicroSurface, binned};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Part, Tables};
use crate::error::{ParameterError, in_closed, in_left_open, in_whole};
use crate::geometry::Symmetry;
use crate::registry::{self, Entry, ReadError, Table, keys};
use serde::de::IgnoredAny;

const KIND: &str = "micro-surface";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "the facets of a height field (gonio list surfaces), which light meets one after the other; bounces: all, first, \
              second, later or multiple; mirrors are counted in a cone of half_angle_deg, after the second facet of multiple_half_angle_deg",
    examples: &[
        "surface = { kind = \"gaussian\", rms_slope = 0.3, size = 128, correlation = 8 }\nrays = 65536\npaths = 64",
        "surface = { kind = \"dimples\", radius = 12, depth = 6, size = 128 }\nbounces = \"second\"\nrays = 65536\npaths = 64",
        "surface = { kind = \"woven\", thread = 16, size = 64 }\nfacets = { kind = \"diffuse\", albedo = 0.8 }\npaths = 64",
    ],
    read,
};

keys! {
    /// The keys of the table itself; `surface` and `facets`, tables with kinds of their own, are taken out before.
    pub(super) struct Keys {
        bounces: Part = Part::All;
        /// Surfaces that are averaged, each of the next seed.
        surfaces: usize = 1;
        /// Illuminated part of the edges of a period.
        spot: f64 = 1.0;
        half_angle_deg: f64 = 1.0;
        /// Of a surface that looks the same however it is turned, the angle between nodes.
        multiple_half_angle_deg: f64 = 4.0;
        /// Paths a pair, or a node.
        paths: usize = 256;
        /// Standard error of the paths as a share of the value, down to which up to 64 times as many are followed; of mirrors for light of
        /// the first.
        relative_error: Option<f64> = None;
        /// Paths that are followed for light of more than one mirror; kept, unless they are counted at nodes.
        rays: usize = 1 << 23;
        seed: u64 = 1;
        #[serde(rename = "surface", skip_serializing)]
        _surface: IgnoredAny = IgnoredAny;
        #[serde(rename = "facets", skip_serializing)]
        _facets: IgnoredAny = IgnoredAny;
    }
}

/// Most paths at each of the tens of thousands of nodes of what looks the same however it is turned.
const MOST_AT_NODES: usize = 1 << 16;

/// Cells of a surface that is drawn that are illuminated at least: of fewer normals no pair has a value.
const FEWEST: f64 = 64.0;

/// Facets of a height field, as a config writes them.
#[derive(Debug)]
pub struct MicroSurfaceSpec {
    pub(super) keys: Keys,
    pub(super) surface: Box<dyn SurfaceSpec>,
    pub(super) facets: FacetsSpec,
}

fn read(mut table: Table<'_>) -> Result<Box<dyn BrdfSpec>, ReadError> {
    let span = table.span();
    let surface = registry::take_table(&mut table, "surface")?;
    let facets = facets::take(&mut table)?;
    let keys = registry::parse(table)?;
    let Some(surface) = surface else {
        let message =
            "surface is missing from the micro-surface; allowed: a table with a kind of surface";
        return Err(ReadError::new(span, message));
    };
    Ok(Box::new(MicroSurfaceSpec {
        keys,
        surface: surface::read(surface)?,
        facets,
    }))
}

impl MicroSurfaceSpec {
    /// True if values are found at nodes: those of a surface that looks the same however it is turned, and of facets that have no
    /// peaks but those of the density of normals.
    pub(super) fn has_nodes(&self) -> bool {
        let asked = match self.facets {
            FacetsSpec::Mirror(_) => self.keys.bounces.holds(1),
            FacetsSpec::Diffuse(_) => true,
            FacetsSpec::Material(_) => false,
        };
        asked && self.surface.facts().symmetry.isotropic
    }

    /// Angle about a half vector of the normals whose mirror directions lie within the asked one.
    pub(super) fn cone(&self) -> f64 {
        0.5 * self.keys.half_angle_deg.to_radians()
    }
}

impl BrdfSpec for MicroSurfaceSpec {
    fn resolved(&self) -> registry::Keys {
        let mut table = registry::resolved(KIND, &self.keys);
        table.insert("surface".into(), self.surface.resolved().into());
        table.insert("facets".into(), self.facets.resolved().into());
        table
    }

    fn label(&self) -> String {
        let label = format!("micro-{}", self.surface.facts().label);
        self.facets.labelled(label, self.keys.bounces)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        let keys = &self.keys;
        self.surface.check().map_err(|e| e.within("surface"))?;
        self.facets.check(channels)?;
        let facts = self.surface.facts();
        if !facts.is_random && keys.surfaces != 1 {
            let allowed = "1 of a surface without a seed";
            return Err(ParameterError::new("surfaces", keys.surfaces, allowed).into());
        }
        in_whole("surfaces", keys.surfaces, [1, 64])?;
        in_left_open("spot", keys.spot, 0.0, 1.0)?;
        in_closed("half_angle_deg", keys.half_angle_deg, 0.2, 10.0)?;
        in_closed(
            "multiple_half_angle_deg",
            keys.multiple_half_angle_deg,
            0.5,
            20.0,
        )?;
        let [least, most] = PATHS;
        let most = if self.has_nodes() {
            MOST_AT_NODES
        } else {
            most
        };
        in_whole("paths", keys.paths, [least * keys.surfaces, most])?;
        if let Some(error) = keys.relative_error {
            in_closed("relative_error", error, 1e-3, 1.0)?;
            if let (FacetsSpec::Mirror(_), false) = (&self.facets, keys.bounces.holds(1)) {
                let allowed = "none: light of more than one mirror is counted among rays";
                return Err(ParameterError::new("relative_error", error, allowed).into());
            }
        }
        in_whole("rays", keys.rays, [1 << 10, 1 << 28])?;
        if facts.is_random && keys.spot * keys.spot * (facts.cells as f64) < FEWEST {
            let cells = facts.cells;
            let allowed =
                format!("so large that {FEWEST} cells are illuminated; the period has {cells}");
            return Err(ParameterError::new("spot", keys.spot, allowed).into());
        }
        Ok(())
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(self.surface.facts().symmetry)
    }

    /// Heights that are drawn have no remarks before they are.
    fn remarks(&self) -> Vec<String> {
        let known = (!self.surface.facts().is_random).then(|| self.surface.build(0));
        let Some(Ok(field)) = known else {
            return Vec::new();
        };
        let mut remarks = self.surface.remarks(&field);
        if let FacetsSpec::Mirror(_) = self.facets
            && Normals::new(&field, self.keys.spot, self.cone(), true).are_few()
        {
            remarks.push(
                "its mirrors have a few normals only, so that no pair has a value; gonio surface and gonio paths tell where light goes"
                    .into(),
            );
        }
        remarks
    }

    fn favours(&self) -> Favours {
        self.facets.favours(self.keys.bounces)
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(MicroSurface::new(self, channels)?))
    }

    fn tables(&self) -> Tables {
        // Of a cell a height and, of mirrors, two facets; of light of more mirrors nodes, or paths that are kept: their directions, twice
        // for a while, of half of them at most.
        let of_facets = self.facets.tables();
        let is_of_mirrors = matches!(self.facets, FacetsSpec::Mirror(_));
        let cell = 4 + if is_of_mirrors {
            2 * size_of::<Facet>()
        } else {
            0
        };
        let later = match self.surface.facts().symmetry.isotropic {
            _ if !is_of_mirrors || self.keys.bounces == Part::First => 0,
            true => binned::channel_bytes(self.keys.multiple_half_angle_deg.to_radians()),
            false => self.keys.rays * size_of::<Event>(),
        };
        let cells = self.keys.surfaces * self.surface.facts().cells;
        Tables {
            files: [self.surface.files(), of_facets.files].concat(),
            channel_bytes: of_facets.channel_bytes + cells * cell + later,
        }
    }
}
