//! Sheets of planes: a row per parametrization, a column per azimuth.

use super::plot::{BELOW, LEFT, Plane, Plot, text, text_upwards};
use crate::geometry::Symmetry;
use crate::parametrization::ParametrizationSpec;
use crate::registry::Entry;
use crate::report::svg::canvas::Canvas;

const SIDE: f64 = 190.0;
const MARGIN: f64 = 16.0;
const NAME: f64 = 26.0;
const STEP: [f64; 2] = [LEFT + SIDE + 12.0, 26.0 + SIDE + BELOW + 4.0];
const TOP: f64 = 48.0;

/// Height of the legend below.
const LEGEND: f64 = 98.0;

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
        let all = |(plane, phis): (_, &'_ Vec<f64>)| -> Vec<(&Plane, f64)> {
            phis.iter().map(|phi| (plane, *phi)).collect()
        };
        self.planes.iter().zip(&self.phi_deg).flat_map(all)
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
        let width = 2.0 * MARGIN + NAME + columns.max(3) as f64 * STEP[0];
        let below = TOP + self.planes.len() as f64 * STEP[1];
        let title = match self.cut() {
            Some(cut) => format!("{title}\n{cut}"),
            None => title.into(),
        };
        Canvas::titled(&title, [width, below + LEGEND], 22.0, |canvas| {
            for (place, (plane, phi)) in self.each().enumerate() {
                let [row, column] = [place / columns, place % columns];
                let y = TOP + row as f64 * STEP[1] + 26.0;
                if column == 0 {
                    let side = [MARGIN + 0.5 * NAME - 4.0, y + 0.5 * SIDE];
                    text_upwards(canvas, side, plane.name, 13.0);
                }
                let x = MARGIN + NAME + LEFT + column as f64 * STEP[0];
                let plot = Plot::new([x, y], SIDE);
                let azimuth = format!("{} = {phi}°", plane.azimuth);
                text(canvas, [x + 0.5 * SIDE, y - 11.0], &azimuth, 12.5, false);
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
