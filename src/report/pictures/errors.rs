//! Where a reconstruction errs, in the planes of the first two axes of parametrizations.

use super::compare::{place, signed, signed_bar};
use super::plates::{Pixel, Plates, meanings, raster};
use super::plot::{Plane, Plot};
use super::slices::look;
use crate::brdf::Brdf;
use crate::numeric::luminance;
use crate::parametrization::ParametrizationSpec;
use crate::registry::Entry;
use crate::report::svg::canvas::Canvas;
use rayon::prelude::*;

/// Relative errors of a reconstruction in planes, one per parametrization and azimuth.
pub struct ErrorMap {
    plates: Plates,
    /// Planes of the first parametrization first; row after row from the top.
    cells: Vec<Vec<Pixel<f64>>>,
}

/// (reconstruction − truth) / truth in luminance; infinite where only the truth is black.
fn error(truth: Pixel<[f64; 3]>, reconstruction: Pixel<[f64; 3]>) -> Pixel<f64> {
    match (truth, reconstruction) {
        (Pixel::Outside, _) | (_, Pixel::Outside) => Pixel::Outside,
        (Pixel::Value(f), Pixel::Value(g)) => {
            let [f, g] = [f, g].map(luminance);
            // Black that is black is no error.
            Pixel::Value(if f == g { 0.0 } else { (g - f) / f })
        }
        _ => Pixel::Missing,
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
        let cells = |(plane, phi): &(&Plane, f64)| -> Vec<_> {
            let look = |brdf| look(brdf, plane, phi.to_radians(), resolution);
            let both = look(truth).into_iter().zip(look(reconstruction));
            both.map(|(f, g)| error(f, g)).collect()
        };
        let planes: Vec<_> = plates.each().collect();
        Self {
            cells: planes.par_iter().map(cells).collect(),
            plates,
        }
    }

    /// A row per parametrization, a column per azimuth, from blue (too dark) over white to red (too bright) by the logarithm
    /// of the relative error, on the one scale that all maps have. Grey: below the horizon; hatched: no data.
    pub fn svg(&self, title: &str) -> String {
        let draw = |canvas: &mut Canvas, plot: &Plot, at: usize| {
            raster(canvas, plot, &self.cells[at], |error| signed(place(*error)))
        };
        self.plates.svg(title, draw, |canvas, [middle, below]| {
            let says = "relative error in luminance, (reconstruction − truth) / truth (%): \
                        blue too dark, red too bright, white within ±0.1 %";
            signed_bar(canvas, [middle, below + 14.0], 100.0, says);
            meanings(canvas, [middle, below], &self.cells);
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
        let exact = |c: &Pixel<f64>| c.value().is_none_or(|e| *e == 0.0);
        assert!(same.cells.iter().flatten().all(exact));
        let brighter = ErrorMap::new(&truth, &lobe(within, 1.25), &charts, side);
        let mut seen = 0;
        for ((plane, phi), cells) in brighter.plates.each().zip(&brighter.cells) {
            for (cell, at) in cells.iter().zip(middles(side)) {
                let pair = plane.form.inverse(&plane.coords(at, phi.to_radians()));
                let slope = pair.map(|pair| pair.half().normalize().z.acos());
                match (cell, slope) {
                    (Pixel::Value(error), Some(slope)) => {
                        let want = if slope < within { 0.25 } else { 0.0 };
                        assert!((error - want).abs() < 1e-12, "{error} {want}");
                        seen += usize::from(want > 0.0);
                    }
                    (Pixel::Missing, Some(slope)) => assert!(slope >= 1.04),
                    (Pixel::Outside, None) => {}
                    _ => panic!("{cell:?} {slope:?}"),
                }
            }
        }
        assert!(seen > 4 * charts.len());
        // Black that is to be black is right, light where there is none is off every scale.
        let [black, light] = [0.0, 1.0].map(|v| Pixel::Value([v; 3]));
        assert_eq!(error(black, black), Pixel::Value(0.0));
        assert_eq!(error(black, light), Pixel::Value(f64::INFINITY));
        assert_eq!(error(light, black), Pixel::Value(-1.0));
    }
}
