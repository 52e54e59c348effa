//! Equirectangular pictures of the light that arrives.

use super::{Format, ReadEnvironment};
use crate::lighting::MapSpec;

/// The first bytes of the file say how it is decoded.
const READ: ReadEnvironment = |path| {
    Box::new(MapSpec {
        path,
        rotation_deg: 0.0,
    })
};

/// OpenEXR.
pub(crate) const EXR: Format = Format {
    name: "exr",
    extensions: &["exr"],
    summary: "OpenEXR panorama with R, G, B or Y",
    read_environment: Some(READ),
    ..Format::NONE
};

/// Radiance HDR.
pub(crate) const HDR: Format = Format {
    name: "hdr",
    extensions: &["hdr"],
    summary: "Radiance panorama",
    read_environment: Some(READ),
    ..Format::NONE
};
