//! Surfaces whose heights are known: one period of a height field.

mod height_map;
mod shapes;
mod spectral;
mod statistics;

pub use height_map::HeightMapSpec;
pub(crate) use statistics::{Optics, Statistics};

use crate::brdf::BuildError;
use crate::error::{ParameterError, in_whole};
use crate::geometry::Symmetry;
use crate::registry::{self, Entry, ReadError, Resolved, Table};
use std::fmt;
use std::path::PathBuf;

/// A surface, as a config writes it.
pub trait SurfaceSpec: Resolved + fmt::Debug + Send + Sync {
    /// Checks every parameter, and every file.
    fn check(&self) -> Result<(), BuildError>;

    /// What is known before it is built.
    fn facts(&self) -> Facts;

    /// Heights of one period; of a random surface those of the seed `draw` after its own.
    fn build(&self, draw: u64) -> Result<HeightField, BuildError>;

    /// What is peculiar about its files, or may be wrong, a sentence each; of the heights that it was built to.
    fn remarks(&self, _field: &HeightField) -> Vec<String> {
        Vec::new()
    }

    /// The files that it reads.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Width of a cell, µm, of a surface that has one.
    fn pitch_um(&self) -> Option<f64> {
        None
    }
}

/// What is known of a surface before it is built.
#[derive(Clone, Debug)]
pub struct Facts {
    /// A piece of a material's label, e.g. `gaussian-0.3`.
    pub label: String,
    /// Symmetries of what the surface does to light, on average over all surfaces of its kind.
    pub symmetry: Symmetry,
    /// True if its heights are drawn by a seed, so that there are others of its kind.
    pub is_random: bool,
    /// Cells of a period, or about as many: what it takes to hold one.
    pub cells: usize,
}

impl Facts {
    /// Of a square period of one shape that runs along the axes.
    fn of_shape(label: String, size: usize) -> Self {
        Self {
            label,
            symmetry: Symmetry::ORTHOTROPIC,
            is_random: false,
            cells: size * size,
        }
    }
}

/// Every kind of surface that a config can name.
pub fn all() -> Vec<Entry<dyn SurfaceSpec>> {
    vec![
        spectral::GaussianSpec::ENTRY,
        spectral::ExponentialSpec::ENTRY,
        shapes::GroovesSpec::ENTRY,
        shapes::DimplesSpec::ENTRY,
        shapes::WovenSpec::ENTRY,
        height_map::ENTRY,
    ]
}

/// Reads a surface from its config table.
pub fn read(table: Table<'_>) -> Result<Box<dyn SurfaceSpec>, ReadError> {
    registry::read("surface", &all(), table)
}

/// Fewest and most heights along an axis of a period.
pub(super) const SIZE: [usize; 2] = [2, 8192];

/// Heights in cells, and their range, are below it: squares of slopes are numbers.
const HIGHEST: f64 = 1e30;

/// Checks the number of heights along an axis.
fn check_size(size: usize) -> Result<(), ParameterError> {
    in_whole("size", size, SIZE).map(drop)
}

/// Heights at the corners of square cells, of a surface that goes on periodically. A cell has two triangles, on either side
/// of its diagonal x = y. Lengths are in cells; the normal of the surface is +z.
#[derive(Clone, Debug)]
pub struct HeightField {
    /// Cells along x and y.
    size: [usize; 2],
    /// (size + 1) heights along both axes, the last ones those of the next period; x runs fastest.
    heights: Vec<f32>,
}

impl HeightField {
    /// A period of `size` cells along x and y, with the height of each one's lower corner, x fastest.
    ///
    /// # Errors
    /// Fewer than 2 or more than 8192 cells along an axis, or a height that is no finite number.
    ///
    /// # Panics
    /// If there are not as many heights as cells.
    pub fn new(size: [usize; 2], heights: &[f64]) -> Result<Self, ParameterError> {
        size.into_iter().try_for_each(check_size)?;
        let [nx, ny] = size;
        assert_eq!(heights.len(), nx * ny);
        if let Some(bad) = heights.iter().find(|h| !(h.abs() < HIGHEST)) {
            let allowed = "finite numbers below 1e30";
            return Err(ParameterError::new("height", bad, allowed));
        }
        let at = |x: usize, y: usize| heights[(y % ny) * nx + x % nx] as f32;
        let padded = (0..=ny).flat_map(|y| (0..=nx).map(move |x| at(x, y)));
        Ok(Self {
            size,
            heights: padded.collect(),
        })
    }

    /// A square period of `size` cells along each axis, by the height of each cell (x, y).
    fn square(size: usize, height: impl Fn(usize, usize) -> f64) -> Result<Self, BuildError> {
        let cells = (0..size).flat_map(|y| (0..size).map(move |x| (x, y)));
        let heights: Vec<f64> = cells.map(|(x, y)| height(x, y)).collect();
        Ok(Self::new([size; 2], &heights)?)
    }

    /// Cells along x and y.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Heights at the corners of a cell: (0, 0), (1, 0), (0, 1), (1, 1).
    #[inline]
    pub fn corners(&self, [x, y]: [usize; 2]) -> [f64; 4] {
        let row = self.size[0] + 1;
        let first = y * row + x;
        let two = |i: usize| [f64::from(self.heights[i]), f64::from(self.heights[i + 1])];
        let ([a, b], [c, d]) = (two(first), two(first + row));
        [a, b, c, d]
    }

    /// Slopes (dz/dx, dz/dy) of both triangles of a cell, that of x ≥ y first.
    #[inline]
    pub fn slopes(&self, cell: [usize; 2]) -> [[f64; 2]; 2] {
        let [a, b, c, d] = self.corners(cell);
        [[b - a, d - b], [d - c, c - a]]
    }

    /// Slopes of all triangles, each of which covers half a cell of the plane.
    pub fn all_slopes(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let [nx, ny] = self.size;
        (0..ny).flat_map(move |y| (0..nx).flat_map(move |x| self.slopes([x, y])))
    }

    /// Heights of one period, x fastest.
    pub fn heights(&self) -> impl Iterator<Item = f64> + Clone + '_ {
        let [nx, ny] = self.size;
        (0..ny).flat_map(move |y| (0..nx).map(move |x| f64::from(self.heights[y * (nx + 1) + x])))
    }
}
