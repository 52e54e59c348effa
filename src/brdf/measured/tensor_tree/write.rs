//! Any isotropic BRDF as a tensor tree.

use super::node::{Built, Node};
use super::read::BLOCKS;
use super::{GREY, MERGED, UNSEEN, WAVELENGTHS, XYZ, disk};
use crate::brdf::measured::{TableError, suits_isotropic, values_or_exchanged, values_or_nan};
use crate::brdf::{Brdf, Channels};
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::safe_sqrt;
use glam::DVec3;
use rayon::prelude::*;
use std::io::{self, Write};

/// Halvings of each axis down to the finest cells, by the size of the table.
pub const LEVELS: [usize; 3] = [7, 8, 9];

/// Halvings down to the cells of which the root mean square is taken.
const COARSE: usize = 6;

/// Halvings down to the cubes that are evaluated one at a time.
const CUBES: usize = 3;

/// Chromaticities (u', v') that are stored as one may differ by this standard deviation. The eye needs ten times as much
/// side by side.
const SAME_COLOUR: f64 = 1e-4;

const HEAD: &str = concat!(
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n",
    "<WindowElement xmlns=\"http://windows.lbl.gov\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
     xsi:schemaLocation=\"http://windows.lbl.gov/BSDF-v1.4.xsd\">\n",
    "<!-- tabulated by gonio ",
    env!("CARGO_PKG_VERSION"),
    " -->\n",
    "<WindowElementType>System</WindowElementType>\n<FileType>BSDF</FileType>\n<Optical>\n<Layer>\n",
    "<Material><Name>gonio</Name><Manufacturer>gonio</Manufacturer><DeviceType>Other</DeviceType></Material>\n",
    "<DataDefinition><IncidentDataStructure>TensorTree3</IncidentDataStructure></DataDefinition>\n",
);

/// Pairs that [`tabulate`] evaluates.
///
/// # Errors
/// [`TableError::Unsuited`] of a BRDF that is not isotropic, or is by wavelength.
pub fn table_pairs(brdf: &dyn Brdf, level: usize) -> Result<u64, TableError> {
    suits_isotropic(brdf, "a TensorTree3", WAVELENGTHS, 0)?;
    Ok((1 << (3 * COARSE - 1)) + (1 << (3 * level - 1)))
}

/// The pair at a point of the tree's cube.
fn pair([x, s, t]: [f64; 3]) -> DirectionPair {
    let sin = 1.0 - 2.0 * x;
    let light = DVec3::new(-sin, 0.0, safe_sqrt(1.0 - sin * sin));
    let [x, y] = disk([s, t]);
    let sensor = DVec3::new(x, y, safe_sqrt(1.0 - x * x - y * y));
    let [light, sensor] =
        [light, sensor].map(|v| Direction::try_new(v).unwrap_or(Direction::NORMAL));
    DirectionPair::new(light, sensor)
}

/// Root mean square of f_r cos theta_i for cosine-distributed directions.
fn root_mean_square(brdf: &dyn Brdf) -> f64 {
    let cells = 1 << COARSE;
    let (n, step) = (brdf.channels().count(), 1.0 / cells as f64);
    let sheet = |i: usize| {
        let at = |k: usize| (k as f64 + 0.5) * step;
        let pairs = (0..cells * cells).map(|k| pair([at(i), at(k / cells), at(k % cells)]));
        let pairs: Vec<DirectionPair> = pairs.collect();
        let light = pairs[0].omega_i;
        let found = values_or_nan(brdf, &pairs);
        let known = found.chunks_exact(n).map(|v| brdf.channels().luminance(v));
        let known = known.filter(|v| !v.is_nan());
        let [sum, count] = known.fold([0.0; 2], |[s, c], v| [s + v * v, c + 1.0]);
        // Cosine-distributed lights have sin theta_i in proportion to itself.
        let weight = light.sin_theta();
        [weight * light.cos_theta().powi(2) * sum, weight * count]
    };
    let sheets: Vec<[f64; 2]> = (0..cells / 2).into_par_iter().map(sheet).collect();
    let [sum, weight] = [0, 1].map(|k| sheets.iter().map(|sheet| sheet[k]).sum::<f64>());
    (sum / weight.max(f64::MIN_POSITIVE)).sqrt()
}

/// The planes of luminance and, of R, G, B, those of u' and v', of a cube of cells from `corner` on; NaN without data.
/// Black has no chromaticity. Also returns the number of cells without data.
fn planes(brdf: &dyn Brdf, corner: [usize; 3], level: usize) -> (Vec<Vec<f64>>, usize) {
    let (side, step) = (1 << (level - CUBES), 1.0 / (1_usize << level) as f64);
    let at = |k: usize, axis: usize| ((corner[axis] + k) as f64 + 0.5) * step;
    let pairs = (0..side * side * side).map(|i| {
        let [x, s, t] = [i / (side * side), i / side % side, i % side];
        pair([at(x, 0), at(s, 1), at(t, 2)])
    });
    let (found, lost) = values_or_exchanged(brdf, &pairs.collect::<Vec<_>>());
    let channels = brdf.channels();
    let each = found.chunks_exact(channels.count());
    let luminance = |v: &[f64]| match v {
        rgb @ [_, _, _] => XYZ.row(1).dot(DVec3::from_slice(rgb)),
        v => v[0],
    };
    let mut planes = vec![each.clone().map(luminance).collect()];
    if let Channels::Rgb = channels {
        let colour = |k: usize| {
            each.clone().map(move |v| {
                let xyz = XYZ * DVec3::from_slice(v);
                // 0/0 of black is NaN.
                [4.0 * xyz.x, 9.0 * xyz.y][k] / (xyz.x + 15.0 * xyz.y + 3.0 * xyz.z)
            })
        };
        planes.extend([0, 1].map(|k| colour(k).collect()));
    }
    (planes, lost)
}

/// The tree of a cube of cells from `corner` on.
fn build(
    side: usize,
    corner: [usize; 3],
    cell: &mut dyn FnMut([usize; 3]) -> Built,
    is_one: &dyn Fn(f64, f64) -> bool,
) -> Built {
    if side == 1 {
        return cell(corner);
    }
    let half = side / 2;
    let parts = std::array::from_fn(|part| {
        let corner = std::array::from_fn(|k| corner[k] + (part >> k & 1) * half);
        build(half, corner, cell, is_one)
    });
    Built::from_parts(parts, is_one)
}

/// The trees of luminance and, of R, G, B, those of u' and v', and the number of finest cells without data, which are filled.
///
/// # Errors
/// [`TableError`], but no [`TableError::Io`].
pub fn tabulate(brdf: &dyn Brdf, level: usize) -> Result<(Vec<Node>, usize), TableError> {
    let pairs = table_pairs(brdf, level)?;
    let scale = MERGED * MERGED * root_mean_square(brdf);
    let is_one: [&(dyn Fn(f64, f64) -> bool + Sync); 2] = [
        &|mean, deviation| deviation * deviation <= scale * mean,
        &|_, deviation| deviation <= SAME_COLOUR,
    ];
    // Those of the lower half of the first axis.
    let cubes = 1 << (3 * CUBES - 1);
    let number = |[x, s, t]: [usize; 3]| (((x << CUBES) | s) << CUBES) | t;
    let of = |cube: usize| {
        let side = 1 << (level - CUBES);
        let mask = (1 << CUBES) - 1;
        let place = [cube >> (2 * CUBES), (cube >> CUBES) & mask, cube & mask];
        let (planes, lost) = planes(brdf, place.map(|k| k * side), level);
        let tree = |(k, plane): (usize, &Vec<f64>)| {
            let cell = |[x, s, t]: [usize; 3]| Built::cell(plane[(x * side + s) * side + t]);
            build(side, [0; 3], &mut { cell }, is_one[k.min(1)])
        };
        (planes.iter().enumerate().map(tree).collect(), lost)
    };
    let built: Vec<(Vec<Built>, usize)> = (0..cubes).into_par_iter().map(of).collect();
    let lost = built.iter().map(|(_, lost)| lost).sum();
    let mut trees = Vec::new();
    let mut built: Vec<_> = built.into_iter().map(|(b, _)| b.into_iter()).collect();
    for k in 0..brdf.channels().count() {
        let mut cubes: Vec<Option<Built>> = built.iter_mut().map(Iterator::next).collect();
        // Each place is asked for once; those of the upper half of the first axis are not there.
        let mut cube = |place| {
            let found = cubes.get_mut(number(place)).and_then(Option::take);
            found.unwrap_or_else(|| Built::cell(f64::NAN))
        };
        let mut tree = build(1 << CUBES, [0; 3], &mut cube, is_one[k.min(1)]).node;
        if matches!(tree, Node::Leaf(value) if value.is_nan()) {
            if k == 0 {
                return Err(TableError::NoData(format!(
                    "this material has no data at any of the {pairs} pairs of the tree"
                )));
            }
            tree = Node::Leaf(GREY[k - 1]);
        }
        trees.push(tree);
    }
    // Radiance takes the least value of all for a matte part, and what is left of the chromaticities is wrong then.
    if trees.len() > 1 && trees[0].least() > 0.0 {
        for place in UNSEEN {
            trees[0].clear(place, level);
        }
    }
    let least = trees[0].least();
    if let Node::Parts(parts) = &mut trees[0] {
        let upper = parts.iter_mut().skip(1).step_by(2);
        upper.for_each(|part| *part = Node::Leaf(least));
    }
    Ok((trees, lost))
}

/// Writes trees as the XML of a `WindowElement`, which has its faces the other way round than Radiance: what is reflected
/// at its back leaves above the surface.
pub fn write_tensor_tree(trees: &[Node], out: &mut impl Write) -> io::Result<()> {
    out.write_all(HEAD.as_bytes())?;
    for (tree, name) in trees.iter().zip(BLOCKS) {
        write!(
            out,
            "<WavelengthData>\n\
             <LayerNumber>System</LayerNumber>\n\
             <Wavelength unit=\"Integral\">{name}</Wavelength>\n\
             <SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>\n\
             <DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>\n\
             <WavelengthDataBlock>\n\
             <WavelengthDataDirection>Reflection Back</WavelengthDataDirection>\n\
             <AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n\
             <ScatteringDataType>BRDF</ScatteringDataType>\n\
             <ScatteringData>\n"
        )?;
        tree.write(out)?;
        out.write_all(b"\n</ScatteringData>\n</WavelengthDataBlock>\n</WavelengthData>\n")?;
    }
    out.write_all(b"</Layer>\n</Optical>\n</WindowElement>\n")
}
