//! Laws of pictures.

/// An SVG without the bytes of its pictures.
fn without_images(svg: &str) -> String {
    let mut parts = svg.split("base64,");
    let first = parts.next().unwrap_or_default();
    let rest = parts.filter_map(|p| Some(p.split_once('"')?.1));
    std::iter::once(first).chain(rest).collect()
}

mod compare {
    use crate::common::{made, png::pixels};
    use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
    use gonio::geometry::Symmetry;
    use gonio::lighting::{LightingSpec, SkySpec};
    use gonio::report::pictures::Comparison;
    use std::f64::consts::PI;
    use std::io;

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
        let png = darker.png().unwrap();
        let (width, picture) = pixels(&png);
        assert_eq!([width, picture.len() / width], [3 * 24 + 16, 24]);
        let at = |x: usize| picture[8 * width + x];
        let [truth, copy, difference] = [12, 44, 76].map(at);
        assert!(truth[0] > copy[0] && copy[0] > 0);
        assert!(difference[2] > difference[0], "{difference:?}");
        // Beside the spheres there is nothing.
        assert_eq!([at(27), picture[64]].map(|p| p[3]), [0, 0]);
        let mut exr = io::Cursor::new(Vec::new());
        darker.write_exr(&mut exr).unwrap();
        assert!(exr.into_inner().starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    }

    #[test]
    fn plates_quote_the_errors() {
        let plate = |darker: f64, title: &str| {
            let made = compare(0.5, darker);
            made.svg(title, &made.png().unwrap()).unwrap()
        };
        let svg = plate(0.2, "half");
        assert!(svg.contains("nrmse 0.6000") && svg.contains("reconstruction"));
        // The scale is drawn, with its numbers, and is that of any other comparison.
        let numbers = |svg: &str| ["−1", "−0.01", "0.1"].map(|n| svg.contains(&format!("\n{n}\n")));
        assert_eq!(svg.matches("<image").count(), 2);
        assert_eq!(numbers(&svg), [true; 3]);
        assert_eq!(numbers(&plate(0.499, "near")), [true; 3]);
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
        let entries = gonio::lighting::all();
        let even = entries.iter().find(|e| e.kind == "constant").unwrap();
        let even = gonio::registry::read_text(even, "")
            .unwrap()
            .build()
            .unwrap();
        let bound = 70_f64.to_radians();
        let matte = |albedo| Lambert::new(Spectrum::Grey(albedo), Channels::Luminance);
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
            let png = found.png().unwrap();
            let (width, picture) = pixels(&png);
            // The leftmost pixels of the sphere.
            for x in [0, 64 + 8, 2 * (64 + 8)] {
                let [r, g, b, _] = picture[32 * width + x];
                assert!(NO_DATA.contains(&[r, g, b]), "{x}: {r}");
            }
        }
        let nothing = Comparison::new(&empty, &matte(0.5), &*even, 16, 8);
        assert_eq!((nothing.nrmse, nothing.without_data), (None, 1.0));
    }
}

mod lobe {
    use super::without_images;
    use crate::common::{made, png::pixels};
    use gonio::brdf::Brdf;
    use gonio::geometry::Symmetry;
    use gonio::moments::{Channel, Slice};
    use gonio::report::{FlatSlice, Radius, slice_svg};

    /// No data for φ < 0, a lobe elsewhere.
    fn half() -> impl Brdf {
        made(Symmetry::NONE, |pair| {
            let v = pair.omega_i.vector();
            (v.y >= 0.0).then_some([1.0 + v.x])
        })
    }

    #[test]
    fn missing_data_is_hatched() {
        let half = half();
        let slice = Slice::new(&half, Channel::Luminance, 0.4).unwrap();
        let flat = FlatSlice::new(&slice, 10);
        let mut png = Vec::new();
        flat.write_png(FlatSlice::range(std::slice::from_ref(&flat)), &mut png)
            .unwrap();
        let (width, picture) = pixels(&png);
        assert_eq!([width, picture.len() / width], [540, 540]);
        let at = |x: usize, y: usize| picture[540 * y + x];
        assert_eq!(at(0, 539), [150, 150, 150, 255]);
        assert_eq!(at(2, 539), [190, 190, 190, 255]);
        assert_ne!(at(200, 10), [150, 150, 150, 255]);
    }

    #[test]
    fn lobes_are_whole_pictures() {
        let half = half();
        for theta_o in [0.0, 0.7, 1.5] {
            let slice = Slice::new(&half, Channel::Luminance, theta_o).unwrap();
            for radius in [Radius::Linear, Radius::CubeRoot] {
                let flat = FlatSlice::new(&slice, 10);
                let range = FlatSlice::range(std::slice::from_ref(&flat));
                let svg = slice_svg("a & b", &slice, &flat, range, radius).unwrap();
                assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
                assert!(
                    svg.contains("50.0 % of the faces have no data") && svg.contains("no data\n")
                );
                assert!(!without_images(&svg).contains("NaN"));
            }
        }
    }
}

mod render;

mod slice {
    use gonio::brdf::{Channels, Lambert, Spectrum};
    use gonio::report::{RESOLUTION, write_slice};
    use std::io;

    #[test]
    fn layers_read_back_with_their_mask() {
        let [truth, other] =
            [0.5, 0.25].map(|albedo| Lambert::new(Spectrum::Grey(albedo), Channels::Luminance));
        let mut file = io::Cursor::new(Vec::new());
        write_slice(&truth, &other, &mut file).unwrap();
        file.set_position(0);
        let layer = gonio::files::exr_layer_of(file).unwrap();
        let at = |name: &str, x: usize, y: usize| {
            let list = &layer.channel_data.list;
            let channel = list.iter().find(|c| c.name.to_string() == name).unwrap();
            channel
                .sample_data
                .value_by_flat_index(y * RESOLUTION + x)
                .to_f32()
        };
        let (middle, quarter) = (RESOLUTION / 2, 0.25 / std::f32::consts::PI);
        assert_eq!(at("difference.Y", middle, middle), -quarter);
        assert_eq!(at("truth.A", middle, middle), 1.0);
        assert_eq!(at("truth.A", 0, 0), 0.0);
        assert_eq!(layer.channel_data.list.len(), 6);
    }
}

mod slices {

    use crate::common::made;
    use gonio::brdf::{Brdf, BrdfSpec, Channels, TestFunctionSpec};
    use gonio::geometry::Symmetry;
    use gonio::parametrization;
    use gonio::parametrization::ParametrizationSpec;
    use gonio::registry::Entry;
    use gonio::report::pictures::BrdfSlices;
    use std::io;

    fn charts(names: &[&str]) -> Vec<Entry<ParametrizationSpec>> {
        let found = names
            .iter()
            .map(|name| parametrization::find(name).unwrap());
        found.collect()
    }

    #[test]
    fn files_hold_the_function_of_the_axes() {
        // 1 − |h̄| is 1 − the first coordinate, whatever the others are.
        let s = TestFunctionSpec::S.build(Channels::Luminance).unwrap();
        let slices = BrdfSlices::new(&*s, &charts(&["hybrid", "orthographic"]), &[0.0, 22.5], 32);
        let mut file = io::Cursor::new(Vec::new());
        slices.write_exr(&mut file).unwrap();
        file.set_position(0);
        let layer = gonio::files::exr_layer_of(file).unwrap();
        let list = &layer.channel_data.list;
        assert_eq!(list.len(), 2 * 2 * 2);
        let values = |name: &str| {
            let channel = list.iter().find(|c| c.name.to_string() == name).unwrap();
            let value = |i| channel.sample_data.value_by_flat_index(i).to_f32();
            (0..32 * 32).map(value).collect::<Vec<_>>()
        };
        for plane in ["hybrid.phi_0", "orthographic.phi_22p5"] {
            let (y, a) = (values(&format!("{plane}.Y")), values(&format!("{plane}.A")));
            let mut inside = 0;
            for i in 0..32 * 32 {
                let h_bar = ((i % 32) as f32 + 0.5) / 32.0;
                assert!(a[i] == 0.0 || (y[i] - (1.0 - h_bar)).abs() < 1e-5);
                inside += usize::from(a[i] == 1.0);
            }
            assert!((400..900).contains(&inside), "{inside}");
            // The lower left is mirror reflection at the normal, the upper right is no pair.
            assert!(a[31 * 32] == 1.0 && a[31] == 0.0);
        }
    }

    /// Has no data for light from the left, and is black.
    fn half() -> impl Brdf {
        made(Symmetry::NONE, |pair| {
            (pair.omega_i.theta() <= 0.7).then_some([0.0])
        })
    }

    #[test]
    fn black_and_missing_data_are_pictures_too() {
        let slices = BrdfSlices::new(&half(), &charts(&["spherical"]), &[0.0], 20);
        let svg = slices.svg("black").unwrap();
        assert!(svg.contains("all is black") && svg.contains("anisotropic, cut at"));
        let s = TestFunctionSpec::S.build(Channels::Luminance).unwrap();
        let isotropic = BrdfSlices::new(&*s, &charts(&["hybrid"]), &[0.0], 8);
        assert!(!isotropic.svg("x").unwrap().contains("cut at"));
    }
}

mod sphere {
    use gonio::report::FilterEllipse;

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
}

mod hemispheres {
    use super::without_images;
    use gonio::parametrization;
    use gonio::report::pictures::hemispheres_svg;

    #[test]
    fn a_plate_has_a_key_and_two_hemispheres_a_view() {
        let svg = hemispheres_svg(&parametrization::all(), &[0.0, 45.0]).unwrap();
        let rows = parametrization::all().len();
        assert_eq!(svg.matches("<image").count(), rows * 5);
        assert!(
            svg.starts_with("<svg")
                && svg.ends_with("</svg>\n")
                && !without_images(&svg).contains("NaN")
        );
        for entry in parametrization::all() {
            assert!(svg.contains(entry.kind));
        }
        assert_eq!(
            svg,
            hemispheres_svg(&parametrization::all(), &[0.0, 45.0]).unwrap()
        );
    }
}
