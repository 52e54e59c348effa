//! Sheets of planes: a row per parametrization, a column per azimuth.

use super::plot::{
    BELOW, LEFT, MARGIN, NAME, OUTSIDE, Plane, Plot, Swatch, hatched, swatches, text, text_upwards,
};
use crate::geometry::Symmetry;
use crate::parametrization::ParametrizationSpec;
use crate::registry::Entry;
use crate::report::svg::canvas::{Canvas, Ink};

/// Squares with axes, in rows that have a name at their left.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    /// Length of the side of a square, pixels.
    side: f64,
    /// Height at which the first row begins.
    top: f64,
}

impl Grid {
    pub(crate) const fn new(side: f64, top: f64) -> Self {
        Self { side, top }
    }

    /// Upper left corner of the square of a row and a column.
    fn corner(self, [row, column]: [usize; 2]) -> [f64; 2] {
        let [width, height] = [LEFT + self.side + 12.0, 26.0 + self.side + BELOW + 4.0];
        [
            MARGIN + NAME + LEFT + column as f64 * width,
            self.top + row as f64 * height + 26.0,
        ]
    }

    /// Width of a sheet, and the height at which its last row ends.
    pub(crate) fn size(self, [rows, columns]: [usize; 2]) -> [f64; 2] {
        let [x, y] = self.corner([rows, columns]);
        [x - LEFT + MARGIN, y - 26.0]
    }

    /// The square of a row and a column, below its title at a distance; the first of a row also writes the name of that.
    pub(crate) fn plot(
        self,
        canvas: &mut Canvas,
        [row, column]: [usize; 2],
        (name, title, above): (&str, &str, f64),
    ) -> Plot {
        let [x, y] = self.corner([row, column]);
        if column == 0 {
            let at = [MARGIN + 0.5 * NAME - 4.0, y + 0.5 * self.side];
            text_upwards(canvas, at, name);
        }
        text(canvas, [x + 0.5 * self.side, y - above], title, 12.5, false);
        Plot::new([x, y], self.side)
    }
}

/// A pixel of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pixel<T> {
    /// A direction lies below the horizon.
    Outside,
    /// There are no data here.
    Missing,
    /// What is here.
    Value(T),
}

impl<T> Pixel<T> {
    pub(crate) fn value(&self) -> Option<&T> {
        match self {
            Self::Value(value) => Some(value),
            _ => None,
        }
    }
}

/// Draws the pixels of a plane, row after row from the top.
pub(super) fn raster<T>(
    canvas: &mut Canvas,
    plot: &Plot,
    pixels: &[Pixel<T>],
    colour: impl Fn(&T) -> Ink,
) {
    let ink = |(i, pixel): (usize, &Pixel<T>)| match pixel {
        Pixel::Outside => OUTSIDE,
        Pixel::Missing => hatched(i, pixels.len().isqrt(), 5),
        Pixel::Value(value) => colour(value),
    };
    plot.raster(
        canvas,
        &pixels.iter().enumerate().map(ink).collect::<Vec<_>>(),
    );
}

/// Draws what grey and stripes among planes mean, below the scale of their colours.
pub(super) fn meanings<T>(
    canvas: &mut Canvas,
    [middle, below]: [f64; 2],
    planes: &[Vec<Pixel<T>>],
) {
    let is_missing = |pixel: &Pixel<T>| matches!(pixel, Pixel::Missing);
    let all = [Swatch::OUTSIDE, Swatch::NO_DATA];
    let shown = 1 + usize::from(planes.iter().flatten().any(is_missing));
    swatches(canvas, [middle, below + 78.0], &all[..shown]);
}

/// The first two axes of parametrizations at azimuths.
pub(super) struct Plates {
    planes: Vec<Plane>,
    /// Azimuths of each plane, degrees, as many of one as of all others.
    phi_deg: Vec<Vec<f64>>,
    /// An isotropic BRDF is the same whatever the first azimuth.
    isotropic: bool,
}

impl Plates {
    /// Planes of parametrizations at `azimuths` (degrees) of each, equally many, for a BRDF of a symmetry.
    pub(crate) fn new(
        parametrizations: &[Entry<ParametrizationSpec>],
        azimuths: impl Fn(&Plane) -> Vec<f64>,
        symmetry: Symmetry,
    ) -> Self {
        let planes: Vec<Plane> = parametrizations.iter().map(Plane::new).collect();
        Self {
            phi_deg: planes.iter().map(azimuths).collect(),
            planes,
            isotropic: symmetry.isotropic,
        }
    }

    /// Every plane with its azimuth, degrees; those of the first parametrization first.
    pub(crate) fn each(&self) -> impl Iterator<Item = (&Plane, f64)> {
        let all = self.planes.iter().zip(&self.phi_deg);
        all.flat_map(|(plane, phis)| phis.iter().map(move |phi| (plane, *phi)))
    }

    /// A text with the azimuths that are 0 in the planes of an anisotropic BRDF; `None` for an
    /// isotropic one.
    fn cut(&self) -> Option<String> {
        if self.isotropic {
            return None;
        }
        let mut symbols: Vec<_> = self.planes.iter().map(|p| p.turn).collect();
        symbols.sort_unstable();
        symbols.dedup();
        Some(format!(
            "anisotropic, cut at {} = 0°",
            symbols.join(" = 0°, ")
        ))
    }

    /// The sheet below a title: `draw` fills the plane of a place, `legend` what is below, about a middle and from a
    /// height on.
    pub(crate) fn svg(
        &self,
        title: &str,
        draw: impl Fn(&mut Canvas, &Plot, usize),
        legend: impl FnOnce(&mut Canvas, [f64; 2]),
    ) -> String {
        let columns = self.phi_deg.first().map_or(0, Vec::len);
        let grid = Grid::new(190.0, 48.0);
        let [width, below] = grid.size([self.planes.len(), columns.max(3)]);
        let title = match self.cut() {
            Some(cut) => format!("{title}\n{cut}"),
            None => title.into(),
        };
        Canvas::titled(&title, [width, below + 98.0], 22.0, |canvas| {
            for (place, (plane, phi)) in self.each().enumerate() {
                let [row, column] = [place / columns, place % columns];
                let title = format!("{} = {phi}°", plane.azimuth);
                let plot = grid.plot(canvas, [row, column], (plane.name, &title, 11.0));
                draw(canvas, &plot, place);
                plot.axes(canvas, plane, Some(phi.to_radians()));
            }
            legend(canvas, [0.5 * width, below])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parametrization::find;

    #[test]
    fn a_cut_names_each_azimuth_once() {
        let cut = |names: &[&str]| {
            let charts: Vec<_> = names.iter().map(|name| find(name).unwrap()).collect();
            Plates::new(&charts, |_| vec![0.0], Symmetry::NONE).cut()
        };
        let places = ["φ_h = 0°", "φ_h = 0°, φ_o = 0°"].map(|p| format!("anisotropic, cut at {p}"));
        let [one, two] = places.map(Some);
        assert_eq!(cut(&["hybrid", "half-difference"]), one);
        assert_eq!(cut(&["hybrid", "spherical"]), two);
    }
}
