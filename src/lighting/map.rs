//! A panorama from a file.
//!
//! Equirectangular, twice as wide as high, as seen from the middle of the sphere: the top row is
//! next to the zenith (+z), the centre column (u = 1/2) looks towards azimuth 0 (+x), and azimuth
//! grows to the left: u = 1/2 − φ/2π, v = θ/π. Pixels are points at their centres, joined
//! bilinearly, around the seam as well; at a pole is the mean of the row next to it.

use super::{Lighting, LightingSpec};
use crate::brdf::BuildError;
use crate::error::in_closed;
use crate::files::PictureError;
use crate::geometry::Direction;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

const KIND: &str = "map";

/// The registry entry.
pub const ENTRY: Entry<dyn LightingSpec> = Entry {
    kind: KIND,
    summary: "an equirectangular panorama, OpenEXR or Radiance HDR",
    examples: &[],
    read: |table| Ok(Box::new(registry::parse::<MapSpec>(table)?)),
};

/// A panorama, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapSpec {
    /// The picture: OpenEXR with R, G, B or Y, or Radiance HDR; values are linear.
    pub path: PathBuf,
    /// Turns the light about +z, counter-clockwise seen from above, degrees, in [-360, 360].
    #[serde(default)]
    pub rotation_deg: f64,
}

impl LightingSpec for MapSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        let stem = self.path.file_stem().map(|s| s.to_string_lossy());
        stem.map_or(KIND.into(), |s| format!("{KIND}-{s}"))
    }

    fn check(&self) -> Result<(), BuildError> {
        in_closed("rotation_deg", self.rotation_deg, -360.0, 360.0)?;
        files::size(&self.path)
            .and_then(aspect)
            .map_err(|e| BuildError::data(&self.path, e))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn build(&self) -> Result<Box<dyn Lighting>, BuildError> {
        self.check()?;
        let map = files::pixels(&self.path)
            .and_then(|([width, _], pixels)| Map::new(width, pixels))
            .map_err(|e| BuildError::data(&self.path, e))?;
        Ok(Box::new(map.rotated(self.rotation_deg.to_radians())))
    }
}

fn aspect([width, height]: [usize; 2]) -> Result<(), PictureError> {
    if height > 0 && width >= 2 && width.abs_diff(2 * height) <= 1 {
        return Ok(());
    }
    Err(PictureError(format!(
        "this picture is {width} × {height} pixels; allowed: twice as wide as high"
    )))
}

/// A panorama.
#[derive(Clone, Debug)]
pub struct Map {
    width: usize,
    height: usize,
    /// R, G, B, row after row from the zenith.
    pixels: Vec<[f32; 3]>,
    /// Means of the first and the last row.
    poles: [[f64; 3]; 2],
    rotation: f64,
}

impl Map {
    /// A panorama of linear R, G, B, row after row from the zenith, `width` to a row.
    ///
    /// # Errors
    /// If it is not twice as wide as high (to a pixel), or if a value is negative or not finite.
    pub fn new(width: usize, pixels: Vec<[f32; 3]>) -> Result<Self, PictureError> {
        let height = pixels.len() / width.max(1);
        aspect([width, height])?;
        if pixels.len() != width * height {
            let message = format!("the last row has less than {width} pixels");
            return Err(PictureError(message));
        }
        let wrong = |v: &f32| !(v.is_finite() && *v >= 0.0);
        if let Some(i) = pixels.iter().position(|p| p.iter().any(wrong)) {
            return Err(PictureError(format!(
                "the pixel in column {}, row {} (counted from 0) is {:?}; allowed: finite numbers not below 0",
                i % width,
                i / width,
                pixels[i]
            )));
        }
        let mean = |row: &[[f32; 3]]| {
            let sum = |c: usize| row.iter().map(|p| f64::from(p[c])).sum::<f64>();
            std::array::from_fn(|c| sum(c) / width as f64)
        };
        Ok(Self {
            width,
            height,
            poles: [
                mean(&pixels[..width]),
                mean(&pixels[pixels.len() - width..]),
            ],
            pixels,
            rotation: 0.0,
        })
    }

    /// The light turned about +z by `angle` (rad), counter-clockwise seen from above.
    #[must_use]
    pub fn rotated(mut self, angle: f64) -> Self {
        self.rotation += angle;
        self
    }

    /// A row at a column (0 is the centre of the first pixel), around the seam.
    fn row(&self, row: usize, column: f64) -> [f64; 3] {
        let first = column.floor();
        let t = column - first;
        let at = |column: f64| {
            // After rounding the remainder may be the width itself.
            let column = column.rem_euclid(self.width as f64) as usize % self.width;
            self.pixels[row * self.width + column]
        };
        mixed(at(first).map(f64::from), at(first + 1.0).map(f64::from), t)
    }
}

fn mixed(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|c| (1.0 - t) * a[c] + t * b[c])
}

impl Lighting for Map {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let u = 0.5 - (omega.phi() - self.rotation) / TAU;
        let column = u * self.width as f64 - 0.5;
        let row = omega.theta() / PI * self.height as f64 - 0.5;
        let last = self.height - 1;
        if row < 0.0 {
            return mixed(self.row(0, column), self.poles[0], -2.0 * row);
        }
        let above = row.floor() as usize;
        if above >= last {
            let past = (2.0 * (row - last as f64)).min(1.0);
            return mixed(self.row(last, column), self.poles[1], past);
        }
        let [a, b] = [above, above + 1].map(|r| self.row(r, column));
        mixed(a, b, row - above as f64)
    }
}

/// Width, height, and R, G, B row after row from the top.
type Picture = ([usize; 2], Vec<[f32; 3]>);

/// Reading pictures.
#[cfg(feature = "pictures")]
mod files {
    use super::super::hdr;
    use super::{Path, Picture};
    use crate::error::{listed, reason};
    use crate::files::{PictureError, exr_headers, exr_layer, may_unpack, open};
    use std::fs::File;
    use std::io::{BufReader, Read};

    enum Format {
        Exr,
        Hdr,
    }

    /// The format by the first bytes: names may be wrong.
    fn format(path: &Path) -> Result<Format, PictureError> {
        let mut start = Vec::new();
        open(path)?.take(4).read_to_end(&mut start)?;
        match start[..] {
            [0x76, 0x2f, 0x31, 0x01] => Ok(Format::Exr),
            [b'#', b'?', ..] => Ok(Format::Hdr),
            _ => Err(PictureError(
                "this is no picture that can be read; allowed: OpenEXR, Radiance HDR".into(),
            )),
        }
    }

    /// Checks that a file of `packed` bytes can hold so many values, each held in four bytes.
    fn held(packed: u64, size: [usize; 2], channels: usize) -> Result<(), PictureError> {
        let [width, height] = size;
        let values = width.saturating_mul(height).saturating_mul(channels);
        may_unpack(packed, values.saturating_mul(4) as u64).map_err(|why| {
            PictureError(format!("this picture is {width} × {height} pixels: {why}"))
        })
    }

    /// Width and height of a Radiance file that can be unpacked, and the file from its first pixel on.
    fn hdr_header(path: &Path) -> Result<([usize; 2], BufReader<File>), PictureError> {
        let file = open(path)?;
        let packed = file.metadata()?.len();
        let mut input = BufReader::new(file);
        let size = hdr::size(&mut input)?;
        held(packed, size, 3)?;
        Ok((size, input))
    }

    /// Width and height, from the header, of a picture that can be unpacked.
    pub fn size(path: &Path) -> Result<[usize; 2], PictureError> {
        let packed = std::fs::metadata(path)?.len();
        match format(path)? {
            Format::Exr => {
                let headers = exr_headers(path)?;
                let size =
                    |h: &exr::meta::header::Header| [h.layer_size.width(), h.layer_size.height()];
                for header in &headers {
                    held(packed, size(header), header.channels.list.len())?;
                }
                let size = headers.first().map(size);
                size.ok_or_else(|| PictureError::unread("it has no layer"))
            }
            Format::Hdr => Ok(hdr_header(path)?.0),
        }
    }

    /// Width, height, and R, G, B row after row from the top.
    pub fn pixels(path: &Path) -> Result<Picture, PictureError> {
        match format(path)? {
            Format::Exr => exr_pixels(path),
            Format::Hdr => {
                let (size, mut input) = hdr_header(path)?;
                Ok((size, hdr::pixels(&mut input, size)?))
            }
        }
    }

    fn exr_pixels(path: &Path) -> Result<Picture, PictureError> {
        let layer = exr_layer(path)?;
        let size = [layer.size.width(), layer.size.height()];
        let list = layer.channel_data.list;
        let find = |name: &str| {
            list.iter()
                .find(|c| c.name.to_string().eq_ignore_ascii_case(name))
        };
        let channels = match (find("R"), find("G"), find("B"), find("Y")) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (_, _, _, Some(y)) => [y, y, y],
            _ => {
                let names = reason(listed(list.iter().map(|c| &c.name)));
                let message = format!("its channels are {names}; allowed: R, G, B or Y");
                return Err(PictureError(message));
            }
        };
        let count = size[0] * size[1];
        if channels.iter().any(|c| c.sample_data.len() != count) {
            let message = "some of its channels are coarser than others";
            return Err(PictureError(message.into()));
        }
        let pixel = |i: usize| channels.map(|c| c.sample_data.value_by_flat_index(i).to_f32());
        Ok((size, (0..count).map(pixel).collect()))
    }
}

#[cfg(not(feature = "pictures"))]
mod files {
    use super::{Path, Picture, PictureError};

    pub fn size(_path: &Path) -> Result<[usize; 2], PictureError> {
        let message = "this build of gonio cannot read pictures: it lacks the feature pictures";
        Err(PictureError(message.into()))
    }

    pub fn pixels(path: &Path) -> Result<Picture, PictureError> {
        size(path).map(|size| (size, Vec::new()))
    }
}
