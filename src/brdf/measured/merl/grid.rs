//! Coordinates of a pair in the table.
//!
//! Angles of the half/difference parametrization (Rusinkiewicz), from the unnormalised h and k,
//! p the unit azimuth of h:
//!
//! ```text
//! theta_h = atan2(|h_bar|, h_z)                        [0, π/2]
//! theta_d = atan2(|k|, |h|)                            [0, π/2]
//! phi_d   = atan2(p × k, cos theta_h (p·k) − sin theta_h k_z)
//! ```
//!
//! Index coordinates (cell i covers `[i, i + 1)`; its node is at i + ½, or at i, see [`Nodes`]):
//!
//! ```text
//! x_h = 90 sqrt(theta_h / 90°)     x_d = theta_d / 1°     x_phi = phi_d / 1°
//! ```
//!
//! Rows of nodes along theta_h and theta_d are numbered from the angle 0, where phi_d has no meaning and all values of a row are
//! one: row 0 is that pole, row r the nodes of cell r − 1 if nodes are centres, of cell r if they are corners.
//!
//! phi_d has period 180° in a reciprocal table (exchanging light and sensor adds 180°), 360°
//! otherwise. Degenerate cases: at h_bar = 0 any azimuth of h is right and p = (1, 0) is taken; at
//! k = 0 any phi_d is right and 0 is taken. Small angles are not snapped to 0: the peak of a glossy
//! material lies in theta_h < 0.26°.

use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric::HORIZON_SLACK;
use crate::numeric::angles::atan2;
use crate::parametrization::Frame;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

/// Cells along theta_h and along theta_d.
pub(crate) const THETA_CELLS: usize = 90;

/// Index coordinates per radian: cells of 1°.
const PER_RADIAN: f64 = 180.0 / PI;

/// Distance below an edge, in cells, within which `nearest` counts a pair as on it.
///
/// A pair built for a node carries rounding of up to 2e-9 cells in phi_d. Without this a table read at its own nodes would
/// return its neighbours' values half of the time, and in-plane pairs (phi_d = 180° ≡ 0°) would flip between the first and the
/// last cell. It is less than 4e-10 rad.
const EDGE_SLACK: f64 = 1e-8;

/// Where in its cell a value is exact, and from where to where values are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nodes {
    /// In the middle of index coordinates: for readers that hold a value constant over its cell, as the database's own does.
    #[default]
    Centre,
    /// At the lowest index coordinates, as libbsdf reads them.
    Corner,
}

impl Nodes {
    /// From the lower edge of a cell to its node, in cells.
    fn shift(self) -> f64 {
        match self {
            Nodes::Centre => 0.5,
            Nodes::Corner => 0.0,
        }
    }

    /// The rows of nodes before that of cell 0 (see the module).
    fn before(self) -> usize {
        match self {
            Nodes::Centre => 1,
            Nodes::Corner => 0,
        }
    }
}

/// Halvings of the way from a node to the highest corner of its cell: the last is tens of times [`EDGE_SLACK`] away from it.
const HALVINGS: i32 = 20;

/// The pair of a place above the horizon on the way from the highest corner of a cell, which has one if any place has, to its node.
pub(crate) fn on_the_way(
    corner: [f64; 3],
    node: [f64; 3],
    pair: impl Fn([f64; 3]) -> Option<DirectionPair>,
) -> Option<DirectionPair> {
    pair(corner)?;
    (1..=HALVINGS).find_map(|halvings| {
        let share = 0.5_f64.powi(halvings);
        pair(std::array::from_fn(|c| {
            corner[c] + share * (node[c] - corner[c])
        }))
    })
}

/// Angles `[theta_h, theta_d, phi_d]` (rad) at index coordinates.
fn angles([h, d, phi]: [f64; 3]) -> [f64; 3] {
    let root = h / THETA_CELLS as f64;
    [FRAC_PI_2 * (root * root), d.to_radians(), phi.to_radians()]
}

/// The pair at index coordinates, half vector in the t–n plane; `None` if a direction is not above the horizon.
fn pair(coordinates: [f64; 3]) -> Option<DirectionPair> {
    pair_of(angles(coordinates))
}

/// The pair of angles (rad), half vector in the t–n plane; `None` if a direction is not above the horizon.
pub(crate) fn pair_of([theta_h, theta_d, phi_d]: [f64; 3]) -> Option<DirectionPair> {
    let (sin_h, cos_h) = theta_h.sin_cos();
    let (sin_d, cos_d) = theta_d.sin_cos();
    let (sin_phi, cos_phi) = phi_d.sin_cos();
    let h = DVec3::new(sin_h, 0.0, cos_h) * cos_d;
    let k = DVec3::new(cos_h * cos_phi, sin_phi, -sin_h * cos_phi) * sin_d;
    // Some corners lie exactly on the horizon (theta_h = 10° and 40°, theta_d = 90° − theta_h, phi_d = 0 and 180°).
    // Without the slack rounding lifts them to a cosine of 1e-17, where some models diverge, and trilinear look-ups would
    // spread that.
    let above = h.z - k.z.abs() > HORIZON_SLACK;
    above.then(|| DirectionPair::new(Direction::from_unit(h + k), Direction::from_unit(h - k)))
}

/// Layout of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MerlGrid {
    /// True if exchanging light and sensor leads to the same cell.
    pub(super) reciprocal: bool,
    /// Where in its cell a value is exact.
    pub(super) nodes: Nodes,
}

impl MerlGrid {
    /// 90×90×180: isotropic and reciprocal, phi_d in [0°, 180°); values at centres.
    pub const RECIPROCAL: Self = Self {
        reciprocal: true,
        nodes: Nodes::Centre,
    };

    /// 90×90×360: isotropic only, phi_d in [0°, 360°); values at centres.
    pub const FULL: Self = Self {
        reciprocal: false,
        nodes: Nodes::Centre,
    };

    /// This grid with other nodes.
    #[must_use]
    pub fn with_nodes(self, nodes: Nodes) -> Self {
        Self { nodes, ..self }
    }

    /// Where in its cell a value is exact.
    pub fn nodes(self) -> Nodes {
        self.nodes
    }

    /// Cells along theta_h, theta_d, phi_d: the file's header.
    pub fn dims(self) -> [usize; 3] {
        let phi = if self.reciprocal { 180 } else { 360 };
        [THETA_CELLS, THETA_CELLS, phi]
    }

    /// The layout with this header, if there is one.
    pub(crate) fn from_dims(found: [i32; 3]) -> Option<Self> {
        [MerlGrid::RECIPROCAL, MerlGrid::FULL]
            .into_iter()
            .find(|grid| grid.dims().map(|n| n as i32) == found)
    }

    /// Symmetries of a table with this layout; whether phi_d and −phi_d agree is up to its owner.
    pub(crate) fn symmetry(self, bilateral: bool) -> Symmetry {
        Symmetry {
            isotropic: true,
            reciprocal: self.reciprocal,
            bilateral,
        }
    }

    /// Cells in one plane.
    pub fn cells(self) -> usize {
        self.dims().iter().product()
    }

    /// Position of cell `[theta_h, theta_d, phi_d]` in a plane.
    #[inline]
    pub fn index(self, [h, d, phi]: [usize; 3]) -> usize {
        phi + self.dims()[2] * (d + THETA_CELLS * h)
    }

    fn coordinates_of_node(self, cell: [usize; 3]) -> [f64; 3] {
        cell.map(|i| i as f64 + self.nodes.shift())
    }

    /// How many cells of a row have values of their own in a material of such symmetries: all, or the first half of them, where
    /// the cells phi and `dims()[2]` − 1 − phi are equal.
    pub(super) fn own_cells(self, symmetry: Symmetry) -> usize {
        let is_in_table = symmetry.reciprocal || !self.reciprocal;
        let is_mirrored = symmetry.isotropic && symmetry.bilateral && is_in_table;
        let all = self.dims()[2];
        if self.nodes == Nodes::Centre && is_mirrored {
            all / 2
        } else {
            all
        }
    }

    /// The number of cells that a material of such symmetries is evaluated at: a part of each is above the horizon.
    pub(crate) fn pairs(self, symmetry: Symmetry) -> u64 {
        let [n_h, n_d, _] = self.dims();
        let n_phi = self.own_cells(symmetry);
        let rows = (0..n_h).flat_map(|h| (0..n_d).map(move |d| (h, d)));
        let above = |(h, d)| {
            let cells = (0..n_phi).filter(|&phi| self.pair([h, d, phi]).is_some());
            cells.count() as u64
        };
        rows.map(above).sum()
    }

    /// The pair that a cell's value is of, half vector in the t–n plane: that at its node, or where this is not above the horizon (h_z ≤
    /// |k_z|) one of the part of the cell that is, so that every pair above the horizon has a node with data around it; `None` if
    /// none is.
    pub fn pair(self, cell: [usize; 3]) -> Option<DirectionPair> {
        let node = self.coordinates_of_node(cell);
        if let Some(pair) = pair(node) {
            return Some(pair);
        }
        // The corner of a cell that is highest: at small angles, and away from the plane of incidence.
        let [h, d, phi] = cell;
        let corner = [h, d, if phi % 180 < 90 { phi + 1 } else { phi }].map(|i| i as f64);
        on_the_way(corner, node, pair)
    }

    /// Index coordinates `[x_h, x_d, x_phi]` of a pair: `x_h`, `x_d` in `[0, 90]`, `x_phi` in
    /// `[0, dims()[2]]`. Without meaning for a pair below the horizon.
    #[inline]
    pub fn coordinates(self, pair: &DirectionPair) -> [f64; 3] {
        self.coordinates_of(pair.vectors())
    }

    /// [`coordinates`](Self::coordinates) of ω_i and ω_o, without branches.
    #[inline(always)]
    pub(super) fn coordinates_of(self, directions: [DVec3; 2]) -> [f64; 3] {
        let Frame {
            theta_h,
            theta_d,
            k: [x, y],
            ..
        } = Frame::new(directions);
        // A pair with y < 0 is exchanged here rather than its angle mended later: both orders of
        // light and sensor then run through the same arithmetic and give the same bits.
        let exchanged = (y < 0.0) | ((y == 0.0) & (x < 0.0));
        let (x, y) = if exchanged { (-x, -y) } else { (x, y) };
        let phi_d = atan2(y, x);
        let turn = !self.reciprocal && exchanged;
        let phi_d = if turn { phi_d + PI } else { phi_d };
        let cells = THETA_CELLS as f64;
        [
            (theta_h * (cells * cells / FRAC_PI_2)).sqrt(),
            theta_d * PER_RADIAN,
            phi_d * PER_RADIAN,
        ]
    }

    /// The cell `[theta_h, theta_d, phi_d]` a pair falls in: the reference reader's, clamped to the
    /// last cell in theta and periodic in phi_d.
    #[inline]
    pub fn cell(self, pair: &DirectionPair) -> [usize; 3] {
        self.lower_edges(self.coordinates(pair)).map(|x| x as usize)
    }

    /// Position in a plane of the cell at index coordinates, without branches or conversions, which vectors have not.
    #[inline(always)]
    pub(super) fn index_at(self, coordinates: [f64; 3]) -> u32 {
        let [h, d, phi] = self.lower_edges(coordinates);
        let n_phi = self.dims()[2] as f64;
        whole(phi + n_phi * (d + THETA_CELLS as f64 * h))
    }

    /// The node below index coordinates, and where these are between it and the next. Constant beyond the last node of
    /// theta_h and theta_d; periodic in phi_d.
    #[inline(always)]
    pub(super) fn corner(self, [x_h, x_d, x_phi]: [f64; 3]) -> Corner {
        let (shift, last) = (self.nodes.shift(), self.last_row() as f64);
        let [y_h, y_d] = [x_h, x_d].map(|x| (x + shift).min(last));
        let y_phi = x_phi - shift;
        let [h, d, phi] = [y_h, y_d, y_phi].map(f64::floor);
        // From the pole to the first nodes it is half a cell if these are centres.
        let along_theta = |y: f64, row: f64| {
            let part = y - row;
            if row > 0.0 {
                part
            } else {
                (part - shift) / (1.0 - shift)
            }
        };
        let part = [along_theta(y_h, h), along_theta(y_d, d), y_phi - phi];
        let n_phi = self.dims()[2] as f64;
        // Before the first node is the last; x_phi may round up to n_phi.
        let phi = if phi < 0.0 { phi + n_phi } else { phi };
        let phi = if phi < n_phi { phi } else { 0.0 };
        Corner {
            whole: [h, d, phi].map(whole),
            part,
        }
    }

    /// The last row of nodes along theta_h and along theta_d.
    #[inline(always)]
    pub(super) fn last_row(self) -> usize {
        THETA_CELLS - 1 + self.nodes.before()
    }

    /// Position of the node of row `h` of theta_h, row `d` of theta_d and column `phi`: in a plane, or behind it among
    /// [means](Self::POLES).
    #[inline(always)]
    pub(super) fn position(self, [h, d]: [usize; 2], phi: usize) -> usize {
        let before = self.nodes.before();
        let [cell_h, cell_d] = [h, d].map(|row| row.max(before) - before);
        if h == 0 {
            self.cells() + cell_d
        } else if d == 0 {
            self.cells() + THETA_CELLS + cell_h
        } else {
            self.index([cell_h, cell_d, phi])
        }
    }

    /// Means over phi_d behind the cells of a plane: at theta_h = 0 by the cells of theta_d, then at theta_d = 0 by those of theta_h.
    pub(super) const POLES: usize = 2 * THETA_CELLS;

    /// The cell of column 0 whose row has the mean number `i`.
    pub(super) fn row_of_mean(i: usize) -> [usize; 3] {
        match i.checked_sub(THETA_CELLS) {
            None => [0, i, 0],
            Some(h) => [h, 0, 0],
        }
    }

    /// Whole index coordinates of the cell at `coordinates`; NaN counts as the last.
    #[inline(always)]
    fn lower_edges(self, coordinates: [f64; 3]) -> [f64; 3] {
        let [h, d, phi] = coordinates.map(|x| (x + EDGE_SLACK).floor());
        let last = (THETA_CELLS - 1) as f64;
        let [h, d] = [h, d].map(|x| if x < last { x } else { last });
        let n_phi = self.dims()[2] as f64;
        [h, d, if phi < n_phi { phi } else { 0.0 }]
    }
}

impl fmt::Display for MerlGrid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [h, d, phi] = self.dims();
        write!(f, "{h}×{d}×{phi}")
    }
}

/// A place between nodes.
#[derive(Clone, Copy, Default)]
pub(super) struct Corner {
    /// The node below.
    pub whole: [u32; 3],
    /// Shares of a cell beyond it, in [0, 1).
    pub part: [f64; 3],
}

/// A whole number from 0 to 2³², converted without instructions that vectors lack.
#[inline(always)]
fn whole(x: f64) -> u32 {
    // Beside 2⁵² the last bits of a sum are a whole number.
    (x + 4_503_599_627_370_496.0).to_bits() as u32
}
