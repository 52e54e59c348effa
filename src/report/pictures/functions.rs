//! The test functions of Barla et al. 2015 on the hemisphere and in slices (their Fig. 2).

use super::dome::{Dome, From};
use super::plates::Grid;
use super::plot::{MARGIN, Plane, Plot, Swatch, middles, swatches};
use crate::brdf::{Brdf, BrdfSpec, Channels, TestFunctionSpec};
use crate::geometry::DirectionPair;
use crate::parametrization::ParametrizationSpec;
use crate::registry::Entry;
use crate::report::svg::canvas::{Align, Canvas, Ink, Lettering};

const SIDE: f64 = 170.0;
const PIXELS: usize = 256;

/// The row of hemispheres, and the planes below it.
const HEMISPHERES: Grid = Grid::new(SIDE, 64.0);
const PLANES: Grid = Grid::new(SIDE, 286.0);

/// S, G and F with their inks.
const FUNCTIONS: [(TestFunctionSpec, Ink, &str); 3] = [
    (TestFunctionSpec::S, [255, 60, 40], "S = 1 − |h\u{304}|"),
    (
        TestFunctionSpec::G,
        [70, 110, 255],
        "G = 1 − cos θ_i cos θ_o",
    ),
    (TestFunctionSpec::F, [255, 255, 255], "F = 1 − cos θ_d"),
];

/// The test functions S (red), G (blue) and F (white): on the hemisphere seen along the mirror
/// direction, at each view elevation (degrees, in [0, 90)), and below it in the plane of the first two
/// axes of each parametrization, at each azimuth (degrees), where that is physical. Isolines
/// every 0.1.
pub fn test_functions_svg(
    parametrizations: &[Entry<ParametrizationSpec>],
    theta_o_deg: &[f64],
    phi_deg: &[f64],
) -> String {
    let planes: Vec<_> = parametrizations.iter().map(Plane::new).collect();
    let functions = FUNCTIONS.map(|(spec, ink, _)| match spec.build(Channels::Luminance) {
        Ok(function) => (function, ink),
        Err(e) => unreachable!("test functions have no parameters: {e}"),
    });
    let columns = theta_o_deg.len().max(phi_deg.len());
    let [width, below] = PLANES.size([planes.len(), columns]);
    let title = "Test functions S, G and F on the hemisphere and in slices of coordinates";
    Canvas::titled(title, [width, below + MARGIN], 24.0, |canvas| {
        let mut at = [0.5 * width - 340.0, 48.0];
        for (_, ink, name) in FUNCTIONS {
            let [x, y] = at;
            canvas.block([x, y - 6.0], [x + 22.0, y + 6.0], [0; 3]);
            canvas.line(&[[x + 2.0, y], [x + 20.0, y]], ink, 2.4);
            canvas.text([x + 28.0, y], name, Lettering::new(12.5, Align::Start));
            at[0] += 180.0;
        }
        swatches(canvas, [at[0] + 60.0, at[1]], &[Swatch::OUTSIDE]);
        for (i, theta) in theta_o_deg.iter().enumerate() {
            let title = format!("θ_o = {theta}°");
            let plot = HEMISPHERES.plot(canvas, [0, i], ("hemisphere", &title, 12.0));
            let dome = Dome::new(From::Mirror, theta.to_radians());
            draw(canvas, &plot, &functions, &dome.pairs(PIXELS));
            dome.outline(canvas, &plot);
        }
        for (j, plane) in planes.iter().enumerate() {
            for (i, phi) in phi_deg.iter().enumerate() {
                let title = format!("{} = {phi}°", plane.azimuth);
                let plot = PLANES.plot(canvas, [j, i], (plane.name, &title, 11.0));
                let phi = phi.to_radians();
                let pair = |p| plane.form.inverse(&plane.coords(p, phi));
                let pairs: Vec<_> = middles(PIXELS).map(pair).collect();
                draw(canvas, &plot, &functions, &pairs);
                plot.axes(canvas, plane, Some(phi));
            }
        }
    })
}

fn draw(
    canvas: &mut Canvas,
    plot: &Plot,
    functions: &[(Box<dyn Brdf>, Ink)],
    pairs: &[Option<DirectionPair>],
) {
    let value = |f: &dyn Brdf, pair: &Option<DirectionPair>| f.luminance(pair.as_ref()?);
    let values = functions.iter().map(|(f, ink)| {
        let values: Vec<_> = pairs.iter().map(|p| value(&**f, p)).collect();
        (values, ink)
    });
    let values: Vec<_> = values.collect();
    let pixel = |i: usize| {
        if pairs[i].is_none() {
            return [255; 3];
        }
        // Colours add as lights do; a power keeps them apart, as each is near 1 somewhere.
        let mut sum = [0.0f64; 3];
        for (values, ink) in &values {
            let v = values[i].unwrap_or(0.0).powi(2);
            for c in 0..3 {
                sum[c] += 0.45 * v * f64::from(ink[c]);
            }
        }
        sum.map(|c| c.min(255.0) as u8)
    };
    let pixels: Vec<_> = (0..pairs.len()).map(pixel).collect();
    plot.raster(canvas, &pixels);
    for (values, ink) in &values {
        for i in 1..10 {
            plot.isolines(canvas, values, 0.1 * f64::from(i), **ink, 0.9);
        }
    }
}
