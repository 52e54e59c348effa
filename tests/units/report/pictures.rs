//! Laws of pictures.

mod render;

use crate::common::{made, matte, png::pixels};
use gonio::brdf::{Brdf, BrdfSpec, Channels, Lambert, Spectrum, TestFunctionSpec};
use gonio::geometry::Symmetry;
use gonio::lighting::{Lighting, LightingSpec, SkySpec};
use gonio::moments::{Channel, Slice};
use gonio::parametrization::{self, ParametrizationSpec};
use gonio::registry::{self, Entry};
use gonio::report::pictures::{BrdfSlices, Comparison};
use gonio::report::{FilterEllipse, FlatSlice, RESOLUTION, Radius, slice_svg, write_slice};
use std::f64::consts::PI;
use std::io::Cursor;

/// An SVG without the bytes of its pictures, which has a beginning, an end and numbers.
fn drawn(svg: &str) -> String {
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    let mut parts = svg.split("base64,");
    let first = parts.next().unwrap_or_default();
    let rest = parts.filter_map(|p| Some(p.split_once('"')?.1));
    let text: String = std::iter::once(first).chain(rest).collect();
    assert!(!text.contains("NaN"));
    text
}

/// A lighting by kind and keys.
fn light(kind: &str, keys: &str) -> Box<dyn Lighting> {
    let all = gonio::lighting::all();
    let entry = all.iter().find(|e| e.kind == kind).unwrap();
    registry::read_text(entry, keys).unwrap().build().unwrap()
}

fn compare(truth: f64, other: f64) -> Comparison {
    let [f, g] = [truth, other].map(|a| Lambert::new(Spectrum::Grey(a), Channels::Rgb));
    let sky = SkySpec::default().build().unwrap();
    Comparison::new(&f, &g, &*sky, 24, 8)
}

#[test]
fn the_errors_of_a_darker_copy_are_exact() {
    // By the same points a copy of 0.4 times the albedo is 0.4 times the picture, noise and all.
    let darker = compare(0.5, 0.2);
    let near = |v: Option<f64>| (v.unwrap() - 0.6).abs() < 1e-12;
    assert!(near(darker.nrmse) && near(darker.mean_relative));
    let same = compare(0.5, 0.5);
    assert_eq!((same.nrmse, same.mean_relative), (Some(0.0), Some(0.0)));
    // Relative to nothing.
    for grey in [0.0, 0.3] {
        let black = compare(0.0, grey);
        assert_eq!((black.nrmse, black.mean_relative), (None, None));
        assert_eq!(black.errors(), "image nrmse –, mean relative –");
    }
}

#[test]
fn pictures_lie_side_by_side() {
    let darker = compare(0.5, 0.2);
    let png = darker.png();
    let (width, picture) = pixels(&png);
    assert_eq!([width, picture.len() / width], [3 * 24 + 16, 24]);
    let at = |x: usize| picture[8 * width + x];
    let [truth, copy, difference] = [12, 44, 76].map(at);
    assert!(truth[0] > copy[0] && copy[0] > 0);
    // What is darker is blue in the picture of differences.
    assert!(difference[2] > difference[0], "{difference:?}");
    // Beside the spheres there is nothing.
    assert_eq!([at(27), picture[64]].map(|p| p[3]), [0, 0]);
    let mut exr = Cursor::new(Vec::new());
    darker.write_exr(&mut exr).unwrap();
    assert!(exr.into_inner().starts_with(&[0x76, 0x2f, 0x31, 0x01]));
}

#[test]
fn plates_quote_the_errors() {
    // The scale is drawn, with its numbers, and is that of any other comparison.
    for (darker, title) in [(0.2, "half"), (0.499, "near")] {
        let made = compare(0.5, darker);
        let svg = made.svg(title, &made.png());
        for number in ["−1", "−0.01", "0.1"] {
            assert!(svg.contains(&format!("\n{number}\n")), "{title}: {number}");
        }
        if title == "half" {
            assert!(svg.contains("nrmse 0.6000") && svg.contains("reconstruction"));
            assert_eq!(svg.matches("<image").count(), 2);
        }
    }
}

/// The greys of stripes that stand for no data.
const NO_DATA: [[u8; 3]; 2] = [[150; 3], [190; 3]];

/// Reflects like a matte surface of albedo 0.5, and has no data beyond some elevation of light
/// or view.
fn bounded(theta: f64) -> impl Brdf {
    made(Symmetry::FULL, move |pair| {
        let outer = pair.omega_i.theta().max(pair.omega_o.theta());
        (outer <= theta).then_some([0.5 / PI])
    })
}

#[test]
fn missing_data_are_not_black() {
    let even = light("constant", "");
    let bound = 70_f64.to_radians();
    // Whichever of the two lacks data: what both have is equal, or 0.4 of it.
    let [bounded, empty] = [bound, 0.0].map(bounded);
    for (truth, other, want) in [
        (&bounded as &dyn Brdf, &matte(0.5) as &dyn Brdf, 0.0),
        (&matte(0.5), &bounded, 0.0),
        (&bounded, &matte(0.2), 0.6),
    ] {
        let found = Comparison::new(truth, other, &*even, 64, 32);
        for error in [found.nrmse, found.mean_relative] {
            assert!((error.unwrap() - want).abs() < 1e-12, "{error:?} {want}");
        }
        // The ring of the disk beyond sin 70°, within a pixel of its edge; other views have
        // sin² 70° of their light from within 70°.
        let ring = 1.0 - bound.sin().powi(2);
        assert!((found.without_data - ring).abs() < 0.04, "{found:?}");
        let said = found.errors();
        assert!(said.ends_with("% without data"), "{said}");
        let (width, picture) = pixels(&found.png());
        // The leftmost pixels of the sphere.
        for x in [0, 64 + 8, 2 * (64 + 8)] {
            let [r, g, b, _] = picture[32 * width + x];
            assert!(NO_DATA.contains(&[r, g, b]), "{x}: {r}");
        }
    }
    let nothing = Comparison::new(&empty, &matte(0.5), &*even, 16, 8);
    assert_eq!((nothing.nrmse, nothing.without_data), (None, 1.0));
}

/// A flat slice of a lobe, which has no data for φ < 0.
fn with_half_a_lobe(theta_o: f64, look: impl Fn(&Slice<'_>, &FlatSlice, [f64; 2])) {
    let half = made(Symmetry::NONE, |pair| {
        let v = pair.omega_i.vector();
        (v.y >= 0.0).then_some([1.0 + v.x])
    });
    let slice = Slice::new(&half, Channel::Luminance, theta_o).unwrap();
    let flat = FlatSlice::new(&slice, 10);
    let range = FlatSlice::range(std::slice::from_ref(&flat));
    look(&slice, &flat, range);
}

#[test]
fn missing_data_is_hatched() {
    with_half_a_lobe(0.4, |_, flat, range| {
        let png = flat.png(range);
        let (width, picture) = pixels(&png);
        assert_eq!([width, picture.len() / width], [540, 540]);
        let at = |x: usize, y: usize| picture[540 * y + x];
        assert_eq!(at(0, 539), [150, 150, 150, 255]);
        assert_eq!(at(2, 539), [190, 190, 190, 255]);
        assert_ne!(at(200, 10), [150, 150, 150, 255]);
    });
}

#[test]
fn lobes_are_whole_pictures() {
    for theta_o in [0.0, 0.7, 1.5] {
        with_half_a_lobe(theta_o, |slice, flat, range| {
            for radius in [Radius::Linear, Radius::CubeRoot] {
                let svg = slice_svg("a & b", slice, flat, range, radius);
                let text = drawn(&svg);
                assert!(text.contains("50.0 % of the faces have no data"));
                assert!(text.contains("no data\n"));
            }
        });
    }
}

/// Reads the layers of an OpenEXR file back: their number, and the value of a layer at a place.
fn layers(write: impl FnOnce(&mut Cursor<Vec<u8>>)) -> (usize, impl Fn(&str, usize) -> f32) {
    let mut file = Cursor::new(Vec::new());
    write(&mut file);
    file.set_position(0);
    let list = gonio::files::exr_layer_of(file).unwrap().channel_data.list;
    (list.len(), move |name: &str, place: usize| {
        let channel = list.iter().find(|c| c.name.to_string() == name).unwrap();
        channel.sample_data.value_by_flat_index(place).to_f32()
    })
}

#[test]
fn layers_read_back_with_their_mask() {
    let (count, value) = layers(|file| write_slice(&matte(0.5), &matte(0.25), file).unwrap());
    let middle = (RESOLUTION + 1) * (RESOLUTION / 2);
    let quarter = 0.25 / std::f32::consts::PI;
    assert_eq!(value("difference.Y", middle), -quarter);
    assert_eq!(value("truth.A", middle), 1.0);
    assert_eq!(value("truth.A", 0), 0.0);
    assert_eq!(count, 6);
}

fn charts(names: &[&str]) -> Vec<Entry<ParametrizationSpec>> {
    let found = names.iter().map(|name| parametrization::find(name));
    found.map(Option::unwrap).collect()
}

#[test]
fn files_hold_the_function_of_the_axes() {
    // 1 − |h̄| is 1 − the first coordinate, whatever the others are.
    let s = TestFunctionSpec::S.build(Channels::Luminance).unwrap();
    let slices = BrdfSlices::new(&*s, &charts(&["hybrid", "orthographic"]), &[0.0, 22.5], 32);
    let (count, value) = layers(|file| slices.write_exr(file).unwrap());
    assert_eq!(count, 2 * 2 * 2);
    for plane in ["hybrid.phi_0", "orthographic.phi_22p5"] {
        let [y, a] = ["Y", "A"].map(|layer| format!("{plane}.{layer}"));
        let mut inside = 0;
        for i in 0..32 * 32 {
            let h_bar = ((i % 32) as f32 + 0.5) / 32.0;
            let is_inside = value(&a, i) == 1.0;
            assert!(is_inside || value(&a, i) == 0.0);
            assert!(!is_inside || (value(&y, i) - (1.0 - h_bar)).abs() < 1e-5);
            inside += usize::from(is_inside);
        }
        assert!((400..900).contains(&inside), "{inside}");
        // The lower left is mirror reflection at the normal, the upper right is no pair.
        assert!(value(&a, 31 * 32) == 1.0 && value(&a, 31) == 0.0);
    }
}

#[test]
fn black_and_missing_data_are_pictures_too() {
    // No data for light from the left, and black.
    let half = made(Symmetry::NONE, |pair| {
        (pair.omega_i.theta() <= 0.7).then_some([0.0])
    });
    let slices = BrdfSlices::new(&half, &charts(&["spherical"]), &[0.0], 20);
    let svg = slices.svg("black");
    assert!(svg.contains("all is black") && svg.contains("anisotropic, cut at"));
    let s = TestFunctionSpec::S.build(Channels::Luminance).unwrap();
    let isotropic = BrdfSlices::new(&*s, &charts(&["hybrid"]), &[0.0], 8);
    assert!(!isotropic.svg("x").contains("cut at"));
}

#[test]
fn a_mirrors_filter_is_a_point_at_its_place() {
    for (theta_o, azimuth) in [(0.0, 0.3), (0.7, -2.0), (1.4, 1.0)] {
        let filter = FilterEllipse {
            theta_o,
            azimuth,
            mean: [-theta_o, 0.0],
            covariance: [0.0; 3],
        };
        let [x, y] = filter.point();
        for p in filter.outline() {
            assert!((p[0] - x).hypot(p[1] - y) < 1e-12);
        }
        // The normal lies nearer the middle than the mirror direction does.
        let [a, b] = filter.seen(0.0, 0.0);
        assert!(a.hypot(b) <= x.hypot(y));
    }
}
