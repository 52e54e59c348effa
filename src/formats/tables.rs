//! Tables of BRDFs.

use super::{Format, TableError};
use crate::brdf::measured::{mdl, merl, rgl, tensor_tree, utia, zemax};
use crate::files;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// Isotropic tables over half/difference angles, of the MERL database.
pub const MERL: Format = Format {
    name: "merl",
    extensions: &["binary"],
    summary: "isotropic, over half/difference angles",
    read_table: Some(|path| Box::new(merl::MerlSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        let grid = merl::MerlGrid::holding(brdf)?;
        let (content, filled) = merl::tabulate(brdf, grid, of.fill)?;
        write(path, filled, |out| content.write(out))
    }),
    has_holes: true,
    table_pairs: Some(|brdf, _| Ok(merl::MerlGrid::holding(brdf)?.pairs())),
    ..Format::NONE
};

/// Anisotropic tables over the angles of light and sensor, of the UTIA database.
pub(crate) const UTIA: Format = Format {
    name: "utia",
    extensions: &["bin"],
    summary: "anisotropic, over elevations to 75° and azimuths",
    read_table: Some(|path| Box::new(utia::UtiaSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        let (content, filled) = utia::tabulate(brdf, of.fill)?;
        write(path, filled, |out| content.write(out))
    }),
    has_holes: true,
    table_pairs: Some(|brdf, _| Ok(utia::suits(brdf).map(|()| utia::NODES as u64)?)),
    ..Format::NONE
};

/// Tables that follow the visible normals, isotropic or not, of the RGL database.
pub(crate) const RGL: Format = Format {
    name: "rgl",
    extensions: &["bsdf"],
    summary: "over visible normals, for Mitsuba and pbrt; R, G, B or wavelengths",
    read_table: Some(|path| Box::new(rgl::RglSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        let (fields, filled) = rgl::fields(brdf, rgl::LEVELS[of.size])?;
        write(path, filled, |out| fields.write(out))
    }),
    table_pairs: Some(|brdf, size| Ok(rgl::table_pairs(brdf, rgl::LEVELS[size]))),
    table_sizes: rgl::LEVELS.len(),
    ..Format::NONE
};

/// Isotropic tensor trees of Radiance, which are fine where the BRDF changes.
pub(crate) const TENSOR_TREE: Format = Format {
    name: "tensor-tree",
    extensions: &["xml"],
    summary: "isotropic, for the material BSDF of Radiance: TensorTree3, luminance or R, G, B",
    read_table: Some(|path| Box::new(tensor_tree::TensorTreeSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        let (trees, filled) = tensor_tree::trees(brdf, tensor_tree::LEVELS[of.size])?;
        write(path, filled, |out| {
            tensor_tree::write_tensor_tree(&trees, out)
        })
    }),
    table_pairs: Some(|brdf, size| {
        tensor_tree::suits(brdf)?;
        Ok(tensor_tree::table_pairs(tensor_tree::LEVELS[size]))
    }),
    table_sizes: tensor_tree::LEVELS.len(),
    ..Format::NONE
};

/// Isotropic tables about the mirror direction, of OpticStudio (Zemax).
pub(crate) const ZEMAX: Format = Format {
    name: "zemax",
    extensions: &["zbsdf"],
    summary: "isotropic, about the mirror direction, text of OpticStudio (Zemax); luminance, R, G, B or one wavelength",
    read_table: Some(|path| Box::new(zemax::ZemaxSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        let (table, filled) = zemax::tabulate(brdf, zemax::LEVELS[of.size])?;
        write(path, filled, |out| table.write(out))
    }),
    table_pairs: Some(|brdf, size| {
        zemax::suits(brdf)?;
        Ok(zemax::table_pairs(brdf, zemax::LEVELS[size]))
    }),
    table_sizes: zemax::LEVELS.len(),
    ..Format::NONE
};

/// Isotropic tables over elevations and the angle between azimuths, of the Material Definition Language.
pub(crate) const MDL: Format = Format {
    name: "mdl",
    extensions: &["mbsdf"],
    summary: "isotropic, over elevations, for MDL (Omniverse, Iray); luminance, R, G, B or one wavelength",
    write_table: Some(|brdf, _, path| {
        let (values, filled) = mdl::tabulate(brdf)?;
        write(path, filled, |out| {
            mdl::write(&values, brdf.channels(), out)
        })
    }),
    table_pairs: Some(|brdf, _| Ok(mdl::suits(brdf).map(|()| mdl::table_pairs(brdf))?)),
    ..Format::NONE
};

/// Writes the file of a BRDF that was tabulated; `filled` of its pairs had no data.
fn write(
    path: &Path,
    filled: usize,
    body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<usize, TableError> {
    files::write_atomically(path, body).map_err(TableError::Io)?;
    Ok(filled)
}
