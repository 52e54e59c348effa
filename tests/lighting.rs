//! Lightings: what each kind shines, and panoramas from files.
#![cfg(feature = "pictures")]

mod common;

use common::{member, near, product, says};
use gonio::geometry::Direction;
use gonio::lighting::{self, Lighting, LightingSpec, Map};
use gonio::registry;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn spec(kind: &str, keys: &str) -> Box<dyn LightingSpec> {
    member(lighting::all(), kind, keys)
}

fn light(kind: &str, keys: &str) -> Box<dyn Lighting> {
    spec(kind, keys).build().unwrap()
}

/// Directions all over the sphere, poles, seam and horizon among them.
fn directions() -> Vec<Direction> {
    let thetas = (0..=36).map(|i| PI * f64::from(i) / 36.0);
    let grid = thetas.flat_map(|t| (-18..=18).map(move |j| (t, PI * f64::from(j) / 18.0)));
    grid.map(|(t, p)| Direction::from_spherical(t, p)).collect()
}

#[test]
fn every_example_shines_and_reads_back() {
    for entry in lighting::all() {
        for text in entry.examples {
            let spec = registry::read_text(&entry, text).unwrap();
            let table = toml::to_string(&spec.resolved()).unwrap();
            let table = toml::de::DeTable::parse(&table).unwrap();
            let again = lighting::read(table).unwrap();
            assert_eq!(again.resolved(), spec.resolved());
            let light = spec.build().unwrap();
            let mut total = 0.0;
            for omega in directions() {
                let value = light.radiance(omega);
                assert!(value.iter().all(|v| v.is_finite() && *v >= 0.0), "{text}");
                total += value[1];
            }
            assert!(total > 0.0);
        }
    }
}

#[test]
fn keys_out_of_range_are_refused() {
    let wrong = [
        ("constant", "radiance = -1.0"),
        ("blob", "width_deg = 0"),
        ("blob", "theta_deg = 181"),
        ("checker", "step_deg = 50"),
        ("sky", "sun_theta_deg = 91"),
        ("sky", "sun_edge_deg = 90"),
        ("sky", "zenith = [0.1, -0.1, 0.2]"),
    ];
    for (kind, keys) in wrong {
        let message = spec(kind, keys).check().unwrap_err().to_string();
        says(&message, keys.split(' ').next().unwrap());
    }
}

#[test]
fn a_blob_is_where_it_says() {
    let keys = "theta_deg = 60\nphi_deg = 90\nwidth_deg = 5\nbackground = 0";
    let blob = light("blob", keys);
    near(at(&*blob, 60.0, 90.0)[0], 1.0, 1e-12, "centre");
    let found = at(&*blob, 65.0, 90.0)[0];
    near(found, (-0.5f64).exp(), 1e-9, "one width");
    assert!(at(&*blob, 60.0, -90.0)[0] < 1e-12);
}

/// The radiance from a direction, °.
fn at(light: &dyn Lighting, theta: f64, phi: f64) -> [f64; 3] {
    let [theta, phi] = [theta, phi].map(f64::to_radians);
    light.radiance(Direction::from_spherical(theta, phi))
}

#[test]
fn the_sky_is_above_the_ground_and_has_a_sun() {
    let sky = light("sky", "sun_theta_deg = 40\nsun_phi_deg = -30");
    let at = |theta, phi| at(&*sky, theta, phi);
    assert!(at(40.0, -30.0)[0] > 100.0 * at(40.0, 30.0)[0]);
    // Half of it at its edge.
    near(at(43.0, -30.0)[0] / at(40.0, -30.0)[0], 0.5, 0.01, "edge");
    assert!(at(89.0 - 1.0, 100.0)[2] > 3.0 * at(92.0, 100.0)[2]);
    // Nothing jumps at the horizon.
    for step in -20..20 {
        let [a, b] = [step, step + 1].map(|s| at(90.0 + 0.1 * f64::from(s), 10.0)[2]);
        near(a, b, 0.12, step);
    }
}

/// Radiance without a jump anywhere.
fn smooth(omega: Direction) -> [f64; 3] {
    let v = omega.vector();
    [
        1.5 + v.x + 0.3 * v.z,
        1.2 + 0.5 * v.y * v.z + 0.2 * v.x,
        2.0 + v.z + 0.5 * v.x * v.y,
    ]
}

/// The panorama of a function, by the documented convention.
fn panorama(height: usize, of: impl Fn(Direction) -> [f64; 3]) -> (usize, Vec<[f32; 3]>) {
    let width = 2 * height;
    let pixel = |k: usize| {
        let sizes = [(k % width, width), (k / width, height)];
        let [u, v] = sizes.map(|(i, n)| (i as f64 + 0.5) / n as f64);
        let omega = Direction::from_spherical(PI * v, TAU * (0.5 - u));
        of(omega).map(|v| v as f32)
    };
    (width, (0..width * height).map(pixel).collect())
}

fn map(height: usize, of: impl Fn(Direction) -> [f64; 3]) -> Map {
    let (width, pixels) = panorama(height, of);
    Map::new(width, pixels).unwrap()
}

fn largest_error(map: &dyn Lighting, of: impl Fn(Direction) -> [f64; 3]) -> f64 {
    let error = |omega: Direction| {
        let (got, want) = (map.radiance(omega), of(omega));
        (0..3).map(|c| (got[c] - want[c]).abs()).fold(0.0, f64::max)
    };
    directions().into_iter().map(error).fold(0.0, f64::max)
}

#[test]
fn a_map_interpolates_what_it_was_made_of() {
    assert!(largest_error(&map(8, |_| [0.5, 1.0, 2.0]), |_| [0.5, 1.0, 2.0]) < 1e-12);
    // Bilinear: a quarter of the error at half the step.
    let [coarse, fine] = [32, 64].map(|n| largest_error(&map(n, smooth), smooth));
    assert!(coarse < 0.01 && fine < 0.35 * coarse, "{coarse} {fine}");
}

#[test]
fn rows_run_from_the_zenith_and_columns_against_the_azimuth() {
    let mut pixels = vec![[0.0f32; 3]; 8 * 4];
    pixels[8 + 2] = [1.0; 3];
    let map = Map::new(8, pixels).unwrap();
    let brightest = directions().into_iter().max_by(|a, b| {
        let value = |d: &Direction| map.radiance(*d)[0];
        value(a).total_cmp(&value(b))
    });
    let omega = brightest.unwrap();
    // Row 1 of 4 is above the horizon; column 2 of 8 is left of the middle, towards +y.
    near(omega.theta(), 1.5 / 4.0 * PI, 0.06, "row");
    near(omega.phi(), (0.5 - 2.5 / 8.0) * TAU, 0.1, "column");
    // Turned by a quarter, counter-clockwise seen from above.
    let turned = map.clone().rotated(FRAC_PI_2);
    for omega in directions() {
        let before = Direction::from_spherical(omega.theta(), omega.phi() - FRAC_PI_2);
        let found = turned.radiance(omega)[0];
        near(found, map.radiance(before)[0], 1e-12, omega);
    }
}

#[test]
fn poles_and_seam_have_no_jump() {
    let map = map(16, |omega| {
        let x = omega.phi().sin() + omega.theta().cos();
        [2.0 + x; 3]
    });
    let value = |theta, phi| map.radiance(Direction::from_spherical(theta, phi))[0];
    for (pole, k) in product([0.0, PI], 0..12) {
        let turned = value(pole, TAU * f64::from(k) / 12.0);
        near(turned, value(pole, 0.0), 1e-6, (pole, k));
        near(turned, value((pole - 1e-6).abs(), 1.0), 1e-4, (pole, k));
    }
    for theta in [0.01, 0.3, 1.5, 3.1] {
        let expected = value(theta, -PI + 1e-9);
        near(value(theta, PI - 1e-9), expected, 1e-6, theta);
    }
}

#[test]
fn maps_that_are_none_are_refused() {
    let refusal = Map::new(10, vec![[1.0; 3]; 40]).unwrap_err();
    says(&refusal.to_string(), "10 × 4");
    assert!(Map::new(9, vec![[1.0; 3]; 36]).is_ok());
    assert!(Map::new(7, vec![[1.0; 3]; 28]).is_ok());
    assert!(Map::new(0, vec![]).is_err());
    for bad in [f32::NAN, -1.0, f32::INFINITY] {
        let mut pixels = vec![[1.0; 3]; 32];
        pixels[8 + 3][1] = bad;
        let refusal = Map::new(8, pixels).unwrap_err();
        says(&refusal.to_string(), "column 3, row 1");
    }
}

mod files {
    use super::*;
    use crate::common::table;
    use std::fs;
    use std::path::Path;

    fn write_exr(path: &Path, width: usize, pixels: &[[f32; 3]]) {
        let at = |x: usize, y: usize| {
            let [r, g, b] = pixels[y * width + x];
            (r, g, b)
        };
        exr::prelude::write_rgb_file(path, width, pixels.len() / width, at).unwrap();
    }

    fn write_hdr(path: &Path, width: usize, pixels: &[[f32; 3]]) {
        let mut bytes = hdr_header(width, pixels.len() / width);
        for row in pixels.chunks(width) {
            let row: Vec<[u8; 4]> = row.iter().map(shared_exponent).collect();
            bytes.extend([2, 2, (width >> 8) as u8, width as u8]);
            for byte in 0..4 {
                let values: Vec<u8> = row.iter().map(|pixel| pixel[byte]).collect();
                let runs = values.chunk_by(|a, b| a == b);
                for run in runs.flat_map(|run| run.chunks(127)) {
                    bytes.extend([128 + run.len() as u8, run[0]]);
                }
            }
        }
        fs::write(path, bytes).unwrap();
    }

    fn hdr_header(width: usize, height: usize) -> Vec<u8> {
        let head = "#?RADIANCE\n# by hand\nFORMAT=32-bit_rle_rgbe\n\n";
        format!("{head}-Y {height} +X {width}\n").into_bytes()
    }

    fn shared_exponent(rgb: &[f32; 3]) -> [u8; 4] {
        let largest = rgb.iter().copied().fold(1e-30, f32::max);
        let exponent = largest.log2().floor() as i32 + 1;
        let [r, g, b] = rgb.map(|v| (v * 2f32.powi(8 - exponent)) as u8);
        [r, g, b, (exponent + 128) as u8]
    }

    /// Rows of all three kinds have the values of their bytes, to the bit.
    #[test]
    fn rows_are_whole_pixels_or_runs() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rows.hdr");
        let read = |rows: &[u8], width: usize, height: usize| {
            fs::write(&path, [&hdr_header(width, height), rows].concat()).unwrap();
            from(&path).map(|light| {
                // Up, where all weight is on the first row.
                light.radiance(Direction::try_new(glam::DVec3::Z).unwrap())
            })
        };
        let pixel = [64, 128, 255, 130];
        let want = [64.0, 128.0, 255.0].map(|c| c * 2f64.powi(130 - 136));
        let whole = pixel.repeat(8);
        // Seven copies; and 3 + 256 · 1 of them.
        let old = [&pixel[..], &[1, 1, 1, 7]].concat();
        let long = [&pixel[..], &[1, 1, 1, 3, 1, 1, 1, 1]].concat();
        let runs = pixel.map(|byte| [131, byte, 5, byte, byte, byte, byte, byte]);
        let new = [&[2, 2, 0, 8][..], runs.as_flattened()].concat();
        for (row, width) in [(&whole, 8), (&old, 8), (&new, 8), (&long, 260)] {
            let rows = row.repeat(width / 2);
            assert_eq!(read(&rows, width, width / 2).unwrap(), want);
            let message = read(&rows[..rows.len() - 1], width, width / 2).unwrap_err();
            says(&message, &format!("cut in row {}", width / 2 - 1));
            let message = read(row, 2, 1).map(drop);
            assert_eq!(message.is_err(), row != &whole, "{message:?}");
        }
        // The smallest exponents are 2^-135 and 0.
        for (exponent, unit) in [(0, 0.0), (1, 2f64.powi(-135)), (2, 2f64.powi(-134))] {
            let found = read(&[3, 5, 7, exponent].repeat(2), 2, 1).unwrap();
            assert_eq!(found, [3.0, 5.0, 7.0].map(|c| c * unit));
        }
        // Nothing to repeat; a count above all numbers.
        let endless = [&pixel[..], &[1, 1, 1, 0].repeat(12), &[1, 1, 1, 1]].concat();
        for row in [[1, 1, 1, 1].repeat(2), endless] {
            assert!(read(&row, 2, 1).is_err());
        }
    }

    fn from(path: &Path) -> Result<Box<dyn Lighting>, String> {
        let path = path.to_str().unwrap();
        let spec = spec("map", &format!("path = '{path}'"));
        let checked = spec.check().map_err(|e| e.to_string());
        checked.and_then(|()| spec.build().map_err(|e| e.to_string()))
    }

    #[test]
    fn both_formats_hold_the_same_picture() {
        let dir = tempfile::tempdir().unwrap();
        let (width, pixels) = panorama(24, smooth);
        let [exr, hdr] = ["a.exr", "a.hdr"].map(|name| dir.path().join(name));
        write_exr(&exr, width, &pixels);
        write_hdr(&hdr, width, &pixels);
        let [exr, hdr] = [from(&exr).unwrap(), from(&hdr).unwrap()];
        let memory = Map::new(width, pixels).unwrap();
        for omega in directions() {
            let lights: [&dyn Lighting; 3] = [&*exr, &*hdr, &memory];
            let [a, b, c] = lights.map(|light| light.radiance(omega));
            let largest = c.into_iter().fold(0.0, f64::max);
            for i in 0..3 {
                near(a[i], c[i], 1e-6, "OpenEXR");
                // One exponent for three colours, eight bits each.
                near(b[i], c[i], 0.01 * largest, "Radiance HDR");
            }
        }
        let spec = spec("map", "path = 'a.exr'\nrotation_deg = 30");
        assert_eq!(spec.inputs(), [Path::new("a.exr")]);
        assert_eq!(spec.label(), "map-a");
    }

    #[test]
    fn files_that_cannot_be_used_are_named_with_the_reason() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        write_exr(&at("square.exr"), 8, &[[1.0; 3]; 64]);
        write_hdr(&at("square.hdr"), 8, &[[1.0; 3]; 64]);
        let mut pixels = vec![[1.0; 3]; 32];
        pixels[13] = [0.5, f32::NAN, 0.5];
        write_exr(&at("nan.exr"), 8, &pixels);
        fs::write(at("text.exr"), "hello").unwrap();
        let whole = fs::read(at("nan.exr")).unwrap();
        fs::write(at("cut.exr"), &whole[..whole.len() / 2]).unwrap();
        for [name, text] in table(
            r"
            cut.hdr  | #?RADIANCE\n
            rgbe.hdr | #?RGBE\n
            xyze.hdr | #?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n
            up.hdr   | #?RADIANCE\n\n+Y 4 +X 8\n
            more.hdr | #?RADIANCE\n\n-Y 4 +X 8 9\n
            huge.hdr | #?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 60000\n",
        ) {
            fs::write(at(name), text).unwrap();
        }
        // A few bytes whose header promises gigabytes.
        let mut huge = whole.clone();
        for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
            let mut windows = huge.windows(window.len());
            let found = windows.position(|w| w == window.as_bytes());
            let last = found.unwrap() + window.len() + 4 + 8;
            huge[last..last + 4].copy_from_slice(&59_999_i32.to_le_bytes());
            huge[last + 4..last + 8].copy_from_slice(&29_999_i32.to_le_bytes());
        }
        fs::write(at("huge.exr"), huge).unwrap();
        for [name, part] in table(
            r#"
            square.exr | 8 × 8
            square.hdr | 8 × 8
            nan.exr | column 5, row 1
            text.exr | OpenEXR, Radiance HDR
            cut.exr | cannot read
            cut.hdr | cannot read this file: its header has no end
            rgbe.hdr | #?RADIANCE
            xyze.hdr | "32-bit_rle_xyze"; allowed: 32-bit_rle_rgbe
            up.hdr | "+Y 4 +X 8"; allowed: -Y height +X width
            more.hdr | -Y 4 +X 8 9
            huge.exr | 60000 × 30000 pixels:
            huge.hdr | 60000 × 30000 pixels: 53 bytes promise
            absent.exr | cannot read"#,
        ) {
            let message = from(&at(name)).err().expect(name);
            says(&message, &format!("{name} … {part}"));
        }
    }
}
