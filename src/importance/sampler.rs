//! Drawing of light directions in proportion to f_r cos θ_i of any BRDF.

use super::chart::{Axes, LightChart, Place, RadialWarp, View};
use super::table::{CellTable, InCells, Mixture};
use crate::brdf::{Brdf, SampleBrdf};
use crate::error::{ParameterError, in_closed, in_whole};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::metrics;
use crate::parametrization::view_centered;
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Halvings of the cells at the pole, towards it: a lobe of a mirror is narrower than a cell.
const HALVINGS: i32 = 8;

/// Most cells along one axis, and most views.
const MOST: usize = 4096;

/// Largest share of the cosine: of 1 no draw would be from the tables.
const MOST_COSINE: f64 = 0.99;

/// How the tables of a [`TabulatedSampler`] are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplerSettings {
    /// Coordinates of the light direction.
    pub axes: Axes,
    /// Course of the density inside a cell.
    pub in_cells: InCells,
    /// Cells along the radius, and along the whole circle of azimuths, from 2 on; of the latter an odd number counts as the next where a
    /// symmetry halves the circle.
    pub cells: [usize; 2],
    /// Elevations of the view with a table each, at the middles of equal steps from 0° to 90°; from 1 on.
    pub views: usize,
    /// Azimuths of the view with a table each, of a BRDF that is not isotropic; from 1 on.
    pub azimuths: usize,
    /// Share of directions that are drawn by the cosine, from 0 to 0.99.
    pub cosine: f64,
}

impl Default for SamplerSettings {
    fn default() -> Self {
        Self {
            axes: Axes {
                chart: LightChart::HBar,
                warp: RadialWarp::SquareRoot,
                to_horizon: true,
            },
            in_cells: InCells::Bilinear,
            cells: [32, 32],
            views: 32,
            azimuths: 32,
            cosine: 0.01,
        }
    }
}

impl SamplerSettings {
    /// # Errors
    /// A number out of its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        for cells in self.cells {
            in_whole("cells", cells, [2, MOST])?;
        }
        in_whole("views", self.views, [1, MOST])?;
        in_whole("azimuths", self.azimuths, [1, MOST])?;
        in_closed("cosine", self.cosine, 0.0, MOST_COSINE)?;
        Ok(())
    }
}

/// Light directions by tables over a chart at a grid of views.
///
/// A view between two of the grid mixes their tables, drawn from and as density; each is read in the chart at the view itself, so
/// that poles and horizon are where they belong. The density is that of f_r cos θ_i, of luminance, in every cell: its integral over 2 × 2 points, at
/// the pole over more.
#[derive(Clone, Debug)]
pub struct TabulatedSampler {
    settings: SamplerSettings,
    /// True if azimuths are folded at the plane of incidence.
    is_folded: bool,
    azimuths: usize,
    /// By elevation, then azimuth of the view.
    tables: Vec<CellTable>,
}

impl TabulatedSampler {
    /// Of one BRDF; pairs without data count as black.
    ///
    /// # Errors
    /// See [`SamplerSettings::check`].
    pub fn new(brdf: &dyn Brdf, settings: SamplerSettings) -> Result<Self, ParameterError> {
        Self::mixed(&[(brdf, 1.0)], settings)
    }

    /// Of several: each view has the density of each in proportion to its share.
    ///
    /// # Errors
    /// See [`SamplerSettings::check`].
    pub fn mixed(
        brdfs: &[(&dyn Brdf, f64)],
        settings: SamplerSettings,
    ) -> Result<Self, ParameterError> {
        settings.check()?;
        let symmetries = brdfs.iter().map(|(brdf, _)| brdf.symmetry());
        let symmetry = symmetries.fold(Symmetry::FULL, Symmetry::and);
        let azimuths = if symmetry.isotropic {
            1
        } else {
            settings.azimuths
        };
        let mut sampler = Self {
            settings,
            is_folded: symmetry.isotropic && symmetry.bilateral,
            azimuths,
            tables: Vec::new(),
        };
        let count = settings.views * azimuths;
        let table = |n: usize| {
            let theta = FRAC_PI_2 * ((n / azimuths) as f64 + 0.5) / settings.views as f64;
            let phi = TAU * (n % azimuths) as f64 / azimuths as f64;
            let omega_o = view_centered(theta, 0.0).vector();
            let (sin, cos) = phi.sin_cos();
            let omega_o = DVec3::new(omega_o.x * cos, omega_o.x * sin, omega_o.z);
            sampler.table(brdfs, Direction::from_unit(omega_o))
        };
        sampler.tables = (0..count).into_par_iter().map(table).collect();
        Ok(sampler)
    }

    /// How it was made.
    pub fn settings(&self) -> &SamplerSettings {
        &self.settings
    }

    /// The same tables with another share of the cosine.
    pub(super) fn with_share_of_cosine(mut self, cosine: f64) -> Self {
        self.settings.cosine = cosine;
        self
    }

    /// Columns of a table.
    fn columns(&self) -> usize {
        match self.is_folded {
            true => self.settings.cells[1].div_ceil(2),
            false => self.settings.cells[1],
        }
    }

    /// The table of a view.
    fn table(&self, brdfs: &[(&dyn Brdf, f64)], omega_o: Direction) -> CellTable {
        let (rows, columns) = (self.settings.cells[0], self.columns());
        let view = View::new(omega_o);
        let mut pairs = Vec::new();
        let mut of = Vec::new();
        for row in 0..rows {
            for [low, high] in parts(row) {
                for share in [0.25, 0.75] {
                    let x = (low + share * (high - low)) / rows as f64;
                    for half in 0..2 * columns {
                        let v = (half as f64 + 0.5) / (2 * columns) as f64;
                        let v = if self.is_folded { 0.5 * v } else { v };
                        let Some(place) = self.settings.axes.place(&view, [x, v]) else {
                            continue;
                        };
                        let measure = place.omega_i.cos_theta() * place.jacobian * (high - low);
                        of.push((row * columns + half / 2, measure));
                        pairs.push(DirectionPair::new(place.omega_i, omega_o));
                    }
                }
            }
        }
        let mut weights = vec![0.0; rows * columns];
        for (brdf, share) in brdfs {
            let found = metrics::evaluate(*brdf, &pairs);
            let energy = |k: usize| found.get(k).map_or(0.0, |f| f.max(0.0) * of[k].1);
            let total: f64 = (0..of.len()).map(energy).sum();
            if total > 0.0 {
                for (k, (cell, _)) in of.iter().enumerate() {
                    weights[*cell] += share / total * energy(k);
                }
            }
        }
        CellTable::new(columns, weights, self.settings.in_cells, !self.is_folded)
    }

    /// The density of a view.
    pub fn given(&self, omega_o: Direction) -> Conditional<'_> {
        let view = View::new(omega_o);
        let views = self.settings.views;
        let at = (view.theta() / FRAC_PI_2 * views as f64 - 0.5).clamp(0.0, (views - 1) as f64);
        let low = (at as usize).min(views.saturating_sub(2));
        let t = at - low as f64;
        let elevations = [(low, 1.0 - t), (low + 1, t)];
        let m = self.azimuths;
        let around = if m > 1 { view.turns() * m as f64 } else { 0.0 };
        let (first, s) = (around as usize % m, around.fract());
        let azimuths = [(first, 1.0 - s), ((first + 1) % m, s)];
        let each = elevations
            .into_iter()
            .flat_map(|(k, t)| azimuths.map(|(j, s)| (k * m + j, t * s)));
        let each = each.filter(|(_, share)| *share > 0.0);
        Conditional {
            sampler: self,
            view,
            tables: Mixture(each.map(|(n, share)| (&self.tables[n], share)).collect()),
        }
    }

    /// A light direction by two numbers in [0, 1), and its density, sr⁻¹; `None` below the horizon.
    pub fn draw(&self, omega_o: Direction, u: [f64; 2]) -> Option<(Direction, f64)> {
        (omega_o.cos_theta() > 0.0)
            .then(|| self.given(omega_o))?
            .draw(u)
    }

    /// Bytes of the tables, over the whole circle of azimuths.
    pub fn bytes(&self) -> usize {
        let held: usize = self.tables.iter().map(CellTable::bytes).sum();
        held * if self.is_folded { 2 } else { 1 }
    }
}

/// The density of light directions at one view.
pub struct Conditional<'a> {
    sampler: &'a TabulatedSampler,
    view: View,
    /// Tables of the views about it.
    tables: Mixture<'a>,
}

impl Conditional<'_> {
    /// A light direction by two numbers in [0, 1), and its density, sr⁻¹; `None` below the horizon.
    pub fn draw(&self, [u, w]: [f64; 2]) -> Option<(Direction, f64)> {
        let SamplerSettings { axes, cosine, .. } = &self.sampler.settings;
        if u < *cosine {
            let omega_i = cosine_hemisphere([u / cosine, w]);
            return (omega_i.cos_theta() > 0.0).then(|| (omega_i, self.pdf(omega_i)));
        }
        let u = (u - cosine) / (1.0 - cosine);
        let place = match self.sampler.is_folded {
            true if w < 0.5 => {
                let [x, v] = self.tables.sample([u, 2.0 * w]);
                [x, 0.5 * v]
            }
            true => {
                let [x, v] = self.tables.sample([u, 2.0 * w - 1.0]);
                [x, 1.0 - 0.5 * v]
            }
            false => self.tables.sample([u, w]),
        };
        let Place { omega_i, jacobian } = axes.place(&self.view, place)?;
        Some((omega_i, self.pdf_at(place, jacobian, omega_i)))
    }

    /// Density of [`draw`](Self::draw) at a direction above the horizon, sr⁻¹.
    pub fn pdf(&self, omega_i: Direction) -> f64 {
        let (place, jacobian) = self.sampler.settings.axes.at(&self.view, omega_i);
        self.pdf_at(place, jacobian, omega_i)
    }

    /// [`pdf`](Self::pdf) of a direction whose place in the chart is known, with dω_i over dx dv there.
    pub(super) fn pdf_at(&self, [x, v]: [f64; 2], jacobian: f64, omega_i: Direction) -> f64 {
        let v = match self.sampler.is_folded {
            true => 2.0 * v.min(1.0 - v),
            false => v,
        };
        let cosine = self.sampler.settings.cosine;
        // At 90° the square of some azimuths is a point.
        let of_tables = match jacobian > 0.0 {
            true => self.tables.pdf([x, v]) / jacobian,
            false => 0.0,
        };
        (1.0 - cosine) * of_tables + cosine * cosine_hemisphere_pdf(omega_i)
    }
}

/// Parts of a row in units of its width: at the pole each half as wide as the one before.
fn parts(row: usize) -> SmallVec<[[f64; 2]; 9]> {
    if row > 0 {
        return SmallVec::from_slice(&[[row as f64, row as f64 + 1.0]]);
    }
    let at = |k: i32| if k > HALVINGS { 0.0 } else { 0.5_f64.powi(k) };
    (0..=HALVINGS).map(|k| [at(k + 1), at(k)]).collect()
}

impl SampleBrdf for TabulatedSampler {
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        self.draw(omega_o, u).map(|(omega_i, _)| omega_i)
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        if !pair.is_above_horizon() {
            return 0.0;
        }
        self.given(pair.omega_o).pdf(pair.omega_i)
    }
}
