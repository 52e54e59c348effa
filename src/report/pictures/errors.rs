//! Where a reconstruction errs, in the planes of the first two axes of parametrizations.

use super::compare::{place, signed};
use super::plates::Plates;
use super::plot::{OUTSIDE, Plane, Plot, Swatch, bar, swatches};
use super::slices::{Pixel, look, no_data};
use crate::brdf::Brdf;
use crate::numeric::luminance;
use crate::parametrization::ParametrizationSpec;
use crate::registry::Entry;
use crate::report::svg::canvas::Canvas;
use rayon::prelude::*;

/// Relative errors of a reconstruction in planes, one per parametrization and azimuth.
pub struct ErrorMap {
    plates: Plates,
    resolution: usize,
    /// Planes of the first parametrization first; row after row from the top.
    cells: Vec<Vec<Cell>>,
}

/// A pixel of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cell {
    /// A direction lies below the horizon.
    Outside,
    /// The truth or the reconstruction has no data here.
    Missing,
    /// (reconstruction − truth) / truth in luminance; infinite where only the truth is black.
    Error(f64),
}

impl Cell {
    fn new(truth: Pixel, reconstruction: Pixel) -> Self {
        match (truth, reconstruction) {
            (Pixel::Outside, _) | (_, Pixel::Outside) => Self::Outside,
            (Pixel::Value(f), Pixel::Value(g)) => {
                let [f, g] = [f, g].map(luminance);
                // Black that is black is no error.
                Self::Error(if f == g { 0.0 } else { (g - f) / f })
            }
            _ => Self::Missing,
        }
    }
}

impl ErrorMap {
    /// Azimuths of the planes, shares of their range: 0°, 30°, 60° and 90°, of spherical coordinates 0° to 180°.
    const AZIMUTHS: [f64; 4] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];

    /// Looks at the middles of `resolution` × `resolution` equal cells of each plane at azimuths of four shares of their range,
    /// first azimuth 0 for truths that are not isotropic.
    pub fn new(
        truth: &dyn Brdf,
        reconstruction: &dyn Brdf,
        parametrizations: &[Entry<ParametrizationSpec>],
        resolution: usize,
    ) -> Self {
        let azimuths = |plane: &Plane| {
            let [low, high] = plane.azimuth_deg;
            let at = |share: f64| (low + share * (high - low)).round();
            Self::AZIMUTHS.map(at).to_vec()
        };
        let plates = Plates::new(parametrizations, azimuths, truth.symmetry());
        let cells = |(plane, phi): &(&Plane, f64)| -> Vec<Cell> {
            let look = |brdf| look(brdf, plane, phi.to_radians(), resolution);
            let both = look(truth).into_iter().zip(look(reconstruction));
            both.map(|(f, g)| Cell::new(f, g)).collect()
        };
        let planes: Vec<_> = plates.each().collect();
        Self {
            cells: planes.par_iter().map(cells).collect(),
            plates,
            resolution,
        }
    }

    /// A row per parametrization, a column per azimuth, from blue (too dark) over white to red (too bright) by the logarithm
    /// of the relative error, on the one scale that all maps have. Grey: below the horizon; hatched: no data.
    pub fn svg(&self, title: &str) -> String {
        let draw = |canvas: &mut Canvas, plot: &Plot, at: usize| {
            let colour = |(i, cell): (usize, &Cell)| match cell {
                Cell::Outside => OUTSIDE,
                Cell::Missing => no_data(i, self.resolution),
                Cell::Error(error) => signed(place(*error)),
            };
            let colours: Vec<_> = self.cells[at].iter().enumerate().map(colour).collect();
            plot.raster(canvas, &colours);
        };
        self.plates.svg(title, draw, |canvas, [middle, below]| {
            let tick = |percent: f64| {
                let text = format!("{percent}").replace('-', "−");
                (0.5 + 0.5 * place(0.01 * percent), text)
            };
            let ticks = [-100.0, -10.0, -1.0, 0.0, 1.0, 10.0, 100.0].map(tick);
            let says = "relative error in luminance, (reconstruction − truth) / truth (%): \
                        blue too dark, red too bright, white within ±0.1 %";
            let colour = |t: f64| signed(2.0 * t - 1.0);
            bar(canvas, [middle, below + 14.0], 520.0, colour, &ticks, says);
            let mut meanings = vec![Swatch::OUTSIDE];
            if self.cells.iter().flatten().any(|c| *c == Cell::Missing) {
                meanings.push(Swatch::NO_DATA);
            }
            swatches(canvas, [middle, below + 78.0], &meanings);
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::testing::made;
    use crate::geometry::Symmetry;
    use crate::parametrization;
    use crate::report::pictures::plot::middles;

    #[test]
    fn errors_are_where_they_are_made_and_as_large() {
        let lobe = |far: f64, factor: f64| {
            made(Symmetry::FULL, move |pair| {
                let slope = pair.half().normalize().z;
                let f = 0.1 + slope.powi(20);
                // More than 60° from the normal there is no data.
                let near = pair.half().normalize().z > 0.5;
                near.then_some([if slope.acos() < far { factor * f } else { f }])
            })
        };
        let (side, within) = (24, 0.3);
        let charts = parametrization::all();
        let truth = lobe(0.0, 1.0);
        let same = ErrorMap::new(&truth, &truth, &charts, side);
        let exact = |c: &Cell| !matches!(c, Cell::Error(e) if *e != 0.0);
        assert!(same.cells.iter().flatten().all(exact));
        let brighter = ErrorMap::new(&truth, &lobe(within, 1.25), &charts, side);
        let mut seen = 0;
        for ((plane, phi), cells) in brighter.plates.each().zip(&brighter.cells) {
            for (cell, at) in cells.iter().zip(middles(side)) {
                let pair = plane.form.inverse(&plane.coords(at, phi.to_radians()));
                let slope = pair.map(|pair| pair.half().normalize().z.acos());
                match (cell, slope) {
                    (Cell::Error(error), Some(slope)) => {
                        let want = if slope < within { 0.25 } else { 0.0 };
                        assert!((error - want).abs() < 1e-12, "{error} {want}");
                        seen += usize::from(want > 0.0);
                    }
                    (Cell::Missing, Some(slope)) => assert!(slope >= 1.04),
                    (Cell::Outside, None) => {}
                    _ => panic!("{cell:?} {slope:?}"),
                }
            }
        }
        assert!(seen > 4 * charts.len());
        // Black that is to be black is right, light where there is none is off every scale.
        let [black, light] = [0.0, 1.0].map(|v| Pixel::Value([v; 3]));
        assert_eq!(Cell::new(black, black), Cell::Error(0.0));
        assert_eq!(Cell::new(black, light), Cell::Error(f64::INFINITY));
        assert_eq!(Cell::new(light, black), Cell::Error(-1.0));
    }
}
