mod compare {
    use gonio::brdf::{Channels, Lambert, Spectrum};
    use gonio::lighting::{LightingSpec, SkySpec};
    use gonio::report::pictures::Comparison;
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
        let picture = image::load_from_memory(&png).unwrap().into_rgba8();
        assert_eq!(picture.dimensions(), (3 * 24 + 16, 24));
        let at = |x: u32| picture.get_pixel(x, 8).0;
        let [truth, copy, difference] = [12, 44, 76].map(at);
        assert!(truth[0] > copy[0] && copy[0] > 0);
        assert!(difference[2] > difference[0], "{difference:?}");
        // Beside the spheres there is nothing.
        assert_eq!([at(27), picture.get_pixel(64, 0).0].map(|p| p[3]), [0, 0]);
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
}

mod lobe {
    use crate::common::made;
    use gonio::brdf::Brdf;
    use gonio::geometry::Symmetry;
    use gonio::moments::{Channel, Slice};
    use gonio::report::FlatSlice;

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
        let picture = image::load_from_memory(&png).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (540, 540));
        assert_eq!(picture.get_pixel(0, 539).0, [150; 3]);
        assert_eq!(picture.get_pixel(2, 539).0, [190; 3]);
        assert_ne!(picture.get_pixel(200, 10).0, [150; 3]);
    }
}

mod render {
    //! Reference for rendered spheres: the light integrated over rings about the mirror direction, of
    //! 1e-4 rad next to it, a sixth wider from ring to ring, up to 2.5° from where on they are equal.
    //! No random number is drawn.

    use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
    use gonio::lighting::Lighting;
    use gonio::report::SphereImage;
    use gonio::report::pictures::render_sphere;
    use gonio::{brdf, registry};
    use std::f64::consts::PI;

    /// A lighting by kind and keys.
    fn light(kind: &str, keys: &str) -> Box<dyn Lighting> {
        let all = gonio::lighting::all();
        let entry = all.iter().find(|e| e.kind == kind).unwrap();
        registry::read_text(entry, keys).unwrap().build().unwrap()
    }

    fn material(kind: &str, keys: &str) -> Box<dyn Brdf> {
        let all = brdf::all();
        let entry = all.iter().find(|e| e.kind == kind).unwrap();
        let spec = registry::read_text(entry, keys).unwrap();
        spec.build(Channels::Rgb).unwrap()
    }

    /// Mean of the differences over the mean of `want`, and their RMS over it.
    fn errors(got: &SphereImage, want: &SphereImage) -> [f64; 2] {
        let both = got.pixels.iter().zip(&want.pixels).enumerate();
        let [mut n, mut mean, mut sum, mut squares] = [0.0; 4];
        for (i, (got_pixel, want)) in both {
            assert_eq!(got_pixel.is_some(), got.coverage(i) > 0.0);
            // The rings look at middles alone.
            let (Some(got), Some(want), 1.0) = (got_pixel, want, got.coverage(i)) else {
                continue;
            };
            for c in 0..3 {
                n += 1.0;
                mean += want[c];
                sum += got[c] - want[c];
                squares += (got[c] - want[c]).powi(2);
            }
        }
        [sum / mean, (squares / n).sqrt() / (mean / n)]
    }

    #[test]
    fn a_diffuse_sphere_in_even_light_has_its_albedo() {
        let albedo = [0.2, 0.5, 0.8];
        let brdf = Lambert::new(Spectrum::Rgb(albedo), Channels::Rgb);
        let even = light("constant", "radiance = 2.0");
        let mut worst = Vec::new();
        for samples in [64, 1024] {
            let image = render_sphere(&brdf, &*even, 32, samples);
            let [mut n, mut sum, mut largest] = [0.0, 0.0, 0.0f64];
            for pixel in image.pixels.into_iter().flatten() {
                for c in 0..3 {
                    let relative = pixel[c] / (2.0 * albedo[c]);
                    n += 1.0;
                    sum += relative;
                    largest = largest.max((relative - 1.0).abs());
                }
            }
            assert!((sum / n - 1.0).abs() < 2e-3, "{}", sum / n);
            worst.push(largest);
        }
        assert!(worst[0] < 0.15 && worst[1] < 0.25 * worst[0], "{worst:?}");
    }

    #[test]
    fn black_light_is_black_and_tiny_mirrors_are_mirrors() {
        let mirror = material("ggx", "alpha = 1e-6");
        let black = render_sphere(&*mirror, &*light("constant", "radiance = 0.0"), 8, 4);
        assert!(black.pixels.into_iter().flatten().all(|p| p == [0.0; 3]));
        // What a mirror reflects of even light does not depend on its roughness.
        let even = light("constant", "");
        let rough = render_sphere(&*material("ggx", "alpha = 1e-3"), &*even, 16, 256);
        let fine = render_sphere(&*mirror, &*even, 16, 256);
        let [bias, difference] = errors(&fine, &rough);
        assert!(
            bias.abs() < 0.01 && difference < 0.05,
            "{bias} {difference}"
        );
    }

    #[test]
    fn the_edge_is_smooth() {
        for resolution in [1, 7, 64] {
            let all = 0..resolution * resolution;
            let image = SphereImage {
                resolution,
                pixels: vec![None; all.len()],
            };
            let area: f64 = all.map(|i| image.coverage(i)).sum();
            let share = area / (resolution * resolution) as f64;
            assert!(
                (share - PI / 4.0).abs() < 0.04 / resolution as f64,
                "{resolution} {share}"
            );
        }
    }

    #[test]
    fn threads_do_not_matter() {
        let (brdf, sky) = (material("ggx", "alpha = 0.2"), light("sky", ""));
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let draw = || render_sphere(&*brdf, &*sky, 24, 8);
            pool.build().unwrap().install(draw)
        };
        assert_eq!(with(1), with(3));
    }
}

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
    use gonio::brdf::{BrdfSpec, Channels, TestFunctionSpec};
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
