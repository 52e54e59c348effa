//! Laws of pictures.

/// An SVG without the bytes of its pictures.
fn without_images(svg: &str) -> String {
    let mut parts = svg.split("base64,");
    let first = parts.next().unwrap_or_default();
    let rest = parts.filter_map(|p| Some(p.split_once('"')?.1));
    std::iter::once(first).chain(rest).collect()
}

mod compare {
    use crate::common::made;
    use gonio::brdf::Brdf;
    use gonio::brdf::{Channels, Lambert, Spectrum};
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
            let picture = image::load_from_memory(&png).unwrap().into_rgba8();
            // The leftmost pixels of the sphere.
            for x in [0, 64 + 8, 2 * (64 + 8)] {
                let [r, g, b, _] = picture.get_pixel(x, 32).0;
                assert!(NO_DATA.contains(&[r, g, b]), "{x}: {r}");
            }
        }
        let nothing = Comparison::new(&empty, &matte(0.5), &*even, 16, 8);
        assert_eq!((nothing.nrmse, nothing.without_data), (None, 1.0));
    }
}

mod lobe {
    use super::without_images;
    use crate::common::made;
    use gonio::brdf::Brdf;
    use gonio::geometry::Symmetry;
    use gonio::moments::{Channel, Slice};
    use gonio::report::FlatSlice;
    use gonio::report::{Radius, slice_svg};

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

mod render {
    //! Reference for rendered spheres: the light integrated over rings about the mirror direction, of
    //! 1e-4 rad next to it, a sixth wider from ring to ring, up to 2.5° from where on they are equal.
    //! No random number is drawn.

    use glam::DVec3;
    use gonio::brdf::Presence;
    use gonio::geometry::{Direction, DirectionPair};
    use gonio::parametrization::view_centered;
    use rayon::prelude::*;
    use std::f64::consts::TAU;

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

    /// From the camera's frame (x right, y up, z towards it) to that of the light, whose pole is up.
    fn world(v: DVec3) -> DVec3 {
        DVec3::new(v.z, v.x, v.y)
    }

    /// Normal and tangents of a point of the sphere, in the camera's frame.
    struct Frame([DVec3; 3]);

    impl Frame {
        fn at(x: f64, y: f64) -> Self {
            let normal = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
            // What the direction to the camera has beside the normal.
            let tangent = (DVec3::Z - normal.z * normal).normalize();
            Self([tangent, normal.cross(tangent), normal])
        }

        fn camera(&self, local: DVec3) -> DVec3 {
            let [t, b, n] = self.0;
            local.x * t + local.y * b + local.z * n
        }
    }

    /// A sphere as [`render_sphere`] draws it, without noise.
    fn sphere(brdf: &dyn Brdf, lighting: &dyn Lighting, resolution: usize) -> SphereImage {
        let centre = |i: usize| (2.0 * i as f64 + 1.0) / resolution as f64 - 1.0;
        let half = resolution.div_ceil(2);
        let dirs = rings();
        // Eight pixels see the sphere from one elevation, and share what the BRDF is there.
        let corner = (0..half).flat_map(|a| (a..half).map(move |b| (a, b)));
        let corner: Vec<_> = corner.collect();
        let shaded = corner.par_iter().flat_map_iter(|&(a, b)| {
            let (x, y) = (centre(a), centre(b));
            let sin = x.hypot(y);
            let mut found = Vec::new();
            if sin < 1.0 {
                let nodes = nodes(brdf, &dirs, sin.asin());
                let [a, b] = [[a, resolution - 1 - a], [b, resolution - 1 - b]];
                for (p, q) in a.into_iter().flat_map(|p| b.map(|q| (p, q))) {
                    for (column, row) in [(p, q), (q, p)] {
                        let frame = Frame::at(centre(column), -centre(row));
                        found.push((row * resolution + column, shade(&nodes, &frame, lighting)));
                    }
                }
            }
            found
        });
        let shaded: Vec<_> = shaded.collect();
        let mut pixels = vec![None; resolution * resolution];
        for (place, value) in shaded {
            pixels[place] = Some(value);
        }
        SphereImage { resolution, pixels }
    }

    /// Directions about +z with their solid angles.
    fn rings() -> Vec<(DVec3, f64)> {
        const FIRST: f64 = 1e-4;
        let widest = 2.5f64.to_radians();
        let mut out = vec![(DVec3::Z, TAU * (1.0 - FIRST.cos()))];
        let mut inner = FIRST;
        while inner < PI {
            let outer = (inner + (inner / 6.0).min(widest)).min(PI);
            let gamma = 0.5 * (inner + outer);
            let width = outer - inner;
            let turns = ((TAU * gamma.sin() / width) as usize).clamp(8, 144);
            let part = TAU / turns as f64;
            // cos a − cos b without cancellation.
            let angle = part * 2.0 * gamma.sin() * (0.5 * width).sin();
            let (s, c) = gamma.sin_cos();
            out.extend((0..turns).map(|k| {
                let (sp, cp) = (part * (k as f64 + 0.5)).sin_cos();
                (DVec3::new(s * cp, s * sp, c), angle)
            }));
            inner = outer;
        }
        out
    }

    /// Light directions in the local frame, each with the share of its radiance that is reflected.
    fn nodes(brdf: &dyn Brdf, rings: &[(DVec3, f64)], theta_o: f64) -> Vec<(DVec3, [f64; 3])> {
        let omega_o = view_centered(theta_o, 0.0);
        // The rings' pole is turned to the mirror direction, in the plane of incidence.
        let (s, c) = theta_o.sin_cos();
        let turned = |d: DVec3| DVec3::new(c * d.x - s * d.z, d.y, s * d.x + c * d.z);
        let mut kept = Vec::with_capacity(rings.len());
        let mut pairs = Vec::with_capacity(rings.len());
        for &(d, angle) in rings {
            let d = turned(d);
            if d.z > 0.0 {
                kept.push((d, angle * d.z));
                pairs.push(DirectionPair::new(Direction::from_unit(d), omega_o));
            }
        }
        let n = brdf.channels().count();
        let mut values = vec![0.0; n * pairs.len()];
        let mut presence = vec![Presence::Missing; pairs.len()];
        brdf.eval_batch(&pairs, &mut values, &mut presence);
        let found = kept.into_iter().zip(values.chunks_exact(n)).zip(presence);
        let mut nodes: Vec<_> = found
            .filter(|found| found.1 == Presence::Present)
            .map(|(((d, w), v), _)| (d, std::array::from_fn(|c| w * v[c % n])))
            .collect();
        // What is left out is less than a millionth of the whole.
        let size = |w: &[f64; 3]| w.iter().sum::<f64>();
        let total: f64 = nodes.iter().map(|(_, w)| size(w)).sum();
        let least = 1e-6 * total / nodes.len().max(1) as f64;
        nodes.retain(|(_, w)| size(w) >= least);
        nodes
    }

    fn shade(nodes: &[(DVec3, [f64; 3])], frame: &Frame, lighting: &dyn Lighting) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(local, weight) in nodes {
            let light = lighting.radiance(Direction::from_unit(world(frame.camera(local))));
            for c in 0..3 {
                sum[c] += weight[c] * light[c];
            }
        }
        sum
    }

    #[test]
    fn a_diffuse_sphere_in_even_light_is_a_disk_of_its_albedo() {
        let brdf = Lambert::new(Spectrum::Rgb([0.2, 0.5, 0.8]), Channels::Rgb);
        let image = sphere(&brdf, &*light("constant", "radiance = 2.0"), 16);
        let area = image.pixels.iter().flatten().count() as f64 / 256.0;
        assert!((area - PI / 4.0).abs() < 0.03);
        for pixel in image.pixels.into_iter().flatten() {
            for (got, albedo) in pixel.into_iter().zip([0.2, 0.5, 0.8]) {
                assert!((got - 2.0 * albedo).abs() < 2e-3 * albedo, "{got}");
            }
        }
    }

    #[test]
    fn a_mirror_shows_the_light() {
        let all = brdf::all();
        let ggx = all.iter().find(|e| e.kind == "ggx").unwrap();
        let spec = registry::read_text(ggx, "alpha = 0.001").unwrap();
        let brdf = spec.build(Channels::Luminance).unwrap();
        let even = sphere(&*brdf, &*light("constant", ""), 20);
        let sky = light("sky", "");
        let image = sphere(&*brdf, &*sky, 20);
        let mut seen = 0;
        for row in 0..20 {
            for column in 0..20 {
                let [x, y] = [column, 19 - row].map(|i| (2.0 * f64::from(i) + 1.0) / 20.0 - 1.0);
                let r2: f64 = x * x + y * y;
                let Some(pixel) = image.pixels[(20 * row + column) as usize] else {
                    continue;
                };
                if r2 > 0.9 {
                    continue;
                }
                let n = DVec3::new(x, y, (1.0 - r2).sqrt());
                let mirrored = world(2.0 * n.z * n - DVec3::Z);
                let want = sky.radiance(Direction::from_unit(mirrored));
                let reflectance = even.pixels[(20 * row + column) as usize].unwrap();
                for c in 0..3 {
                    let want = want[c] * reflectance[c];
                    assert!(
                        (pixel[c] - want).abs() < 0.03 * want,
                        "{x} {y} {pixel:?} {want}"
                    );
                }
                seen += 1;
            }
        }
        assert!(seen > 200);
    }

    #[test]
    fn it_agrees_with_the_rings_and_noise_falls() {
        // Light that the rings resolve to better than what is asked for here.
        let light = light(
            "blob",
            "theta_deg = 50\nphi_deg = 30\nwidth_deg = 15\npeak = [9.0, 7.0, 5.0]\n\
         background = 0.3",
        );
        let materials = [
            ("lambert", ""),
            ("ggx", "alpha = 0.05"),
            ("ggx", "alpha = 0.001"),
            ("ggx", "alpha = [0.1, 0.4]"),
        ];
        for (kind, keys) in materials {
            let brdf = material(kind, keys);
            let want = sphere(&*brdf, &*light, 20);
            let at = |samples| errors(&render_sphere(&*brdf, &*light, 20, samples), &want);
            let [few, some, many] = [16, 64, 1024].map(at);
            // Independent pixels: the mean of about 310 has a 17th of their noise, colours share
            // theirs; the rings have errors of their own, up to 0.5 %.
            for [bias, noise] in [few, some, many] {
                assert!(
                    bias.abs() < 4.0 * noise / 17.0 + 0.005,
                    "{kind} {keys} {bias} {noise}"
                );
            }
            // At least 1/√n, which from 16 to 64 points is 1/2 and to 1024 is 1/8.
            assert!(some[1] < 0.65 * few[1], "{kind} {keys} {few:?} {some:?}");
            assert!(
                many[1] < 0.2 * few[1] + 0.01,
                "{kind} {keys} {few:?} {many:?}"
            );
            assert!(some[1] < 0.12, "{kind} {keys} {some:?}");
        }
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

mod functions {
    use super::without_images;
    use gonio::parametrization;
    use gonio::report::pictures::test_functions_svg;

    #[test]
    fn a_plate_has_every_view_and_slice() {
        let charts: Vec<_> = ["hybrid", "spherical"]
            .into_iter()
            .filter_map(parametrization::find)
            .collect();
        let svg = test_functions_svg(&charts, &[20.0], &[0.0, 90.0]).unwrap();
        assert_eq!(svg.matches("<image").count(), 1 + 2 * 2);
        assert!(
            svg.contains("|h\u{304}|")
                && svg.contains("Δφ")
                && !without_images(&svg).contains("NaN")
        );
    }
}
