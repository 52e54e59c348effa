//! Heights that were measured, or drawn: the numbers of a file.

mod read;

use super::{Facts, HeightField, SurfaceSpec};
use crate::brdf::BuildError;
use crate::error::{ParameterError, in_closed, in_left_open};
use crate::geometry::Symmetry;
use crate::registry::{self, Entry, Resolved};
use read::Numbers;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The registry entry. No examples: those must build on every machine, and this kind needs a file.
pub const ENTRY: Entry<dyn SurfaceSpec> = Entry {
    kind: HeightMapSpec::KIND,
    summary: "the heights in `file`, OpenEXR, PNG of 16 bits or CSV, as one period; pitch_um is the width of a cell, \
              height_um the height of white in a PNG, of 1 in the others",
    examples: &[],
    read: |table| Ok(Box::new(registry::parse::<HeightMapSpec>(table)?)),
};

/// Range of the heights of a map, cells, below which rays pass its cells in time.
const HIGHEST: f64 = 2e5;

/// Largest step across an edge of the map, in steps inside it (both rms), that is taken for one of a periodic surface.
const SEAM: f64 = 4.0;

/// A height map, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightMapSpec {
    /// The map as seen from above: x to the right, y upwards.
    pub file: PathBuf,
    /// Width of a cell, µm, in (0, 10⁶].
    pub pitch_um: f64,
    /// Height of the number 1, µm, of a PNG that of 65535, in [−10⁶, 10⁶]: below 0 the map is of a cast. 1 if it is not said,
    /// but of a PNG it must be.
    pub height_um: Option<f64>,
}

impl HeightMapSpec {
    const KIND: &'static str = "height-map";

    fn check_keys(&self) -> Result<(), ParameterError> {
        in_left_open("pitch_um", self.pitch_um, 0.0, 1e6)?;
        in_closed("height_um", self.height_um.unwrap_or(1.0), -1e6, 1e6).map(drop)
    }

    /// Height of the number 1, cells.
    fn cells(&self, numbers: &Numbers) -> Result<f64, ParameterError> {
        let height_um = match (self.height_um, numbers.white) {
            (Some(height), white) => height / white.unwrap_or(1.0),
            (None, None) => 1.0,
            (None, Some(_)) => {
                let allowed = "a number in [-1e6, 1e6] for a PNG: the height of white, µm";
                return Err(ParameterError::new("height_um", "none", allowed));
            }
        };
        Ok(height_um / self.pitch_um)
    }
}

impl Resolved for HeightMapSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(Self::KIND, self)
    }
}

impl SurfaceSpec for HeightMapSpec {
    fn facts(&self) -> Facts {
        let stem = self.file.file_stem().unwrap_or_default();
        let bytes = std::fs::metadata(&self.file).map_or(0, |file| file.len());
        Facts {
            label: format!("map-{}", stem.to_string_lossy()),
            // Of a measured map only reciprocity is certain.
            symmetry: Symmetry {
                reciprocal: true,
                ..Symmetry::NONE
            },
            is_random: false,
            // Two bytes each, as in a PNG; numbers of other files are longer.
            cells: (bytes / 2) as usize,
        }
    }

    fn check(&self) -> Result<(), BuildError> {
        self.build(0).map(drop)
    }

    fn build(&self, _draw: u64) -> Result<HeightField, BuildError> {
        self.check_keys()?;
        let numbers = read::numbers(&self.file).map_err(|e| BuildError::data(&self.file, e))?;
        let cells = self.cells(&numbers)?;
        let refused = |e| BuildError::data(&self.file, e);
        let [low, high] = numbers.range().map_err(refused)?;
        let range = (high - low) * cells.abs();
        if !(range < HIGHEST) {
            let message = format!(
                "the heights range over {range:e} cells; allowed: less than 2e5 (height_um and pitch_um scale them)"
            );
            return Err(BuildError::data(&self.file, message));
        }
        // From the lowest on: single precision is for the differences.
        let rows = numbers.values.chunks_exact(numbers.size[0]).rev();
        let heights: Vec<f64> = rows.flatten().map(|v| (v - low) * cells).collect();
        Ok(HeightField::new(numbers.size, &heights)?)
    }

    fn remarks(&self, field: &HeightField) -> Vec<String> {
        let [inside, across] = steps(field);
        let is_wall = |axis: usize| across[axis] > SEAM * inside[axis];
        if !is_wall(0) && !is_wall(1) {
            return Vec::new();
        }
        let file = self.file.display();
        let both = |[x, y]: [f64; 2]| format!("{x:.3} along x, {y:.3} along y");
        vec![format!(
            "{file}: not periodic: the map goes on where it began, with steps of {}, where those inside are {} (rms, cells)",
            both(across),
            both(inside)
        )]
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.file.clone()]
    }

    fn pitch_um(&self) -> Option<f64> {
        Some(self.pitch_um)
    }
}

/// Root mean square of the steps along x and y from cell to cell, inside the period and across its edges.
fn steps(field: &HeightField) -> [[f64; 2]; 2] {
    let [nx, ny] = field.size();
    let mut squares = [[0.0; 2]; 2];
    for y in 0..ny {
        for x in 0..nx {
            let [a, b, c, _] = field.corners([x, y]);
            squares[usize::from(x + 1 == nx)][0] += (b - a).powi(2);
            squares[usize::from(y + 1 == ny)][1] += (c - a).powi(2);
        }
    }
    let counts = [[(nx - 1) * ny, nx * (ny - 1)], [ny, nx]];
    let rms =
        |place: usize, axis: usize| (squares[place][axis] / counts[place][axis] as f64).sqrt();
    [0, 1].map(|place| [0, 1].map(|axis| rms(place, axis)))
}

#[cfg(test)]
mod tests;
