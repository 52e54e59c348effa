//! Height fields from files.

use crate::common::{near, says, table};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
    WritableImage,
};
use gonio::brdf::BuildError;
use gonio::light_paths::surface::{HeightField, HeightMapSpec, SurfaceSpec};
use std::io::Cursor;
use tempfile::TempDir;

/// A folder with a file, and the surface that it is.
struct Map {
    _dir: TempDir,
    spec: HeightMapSpec,
}

impl Map {
    fn of(bytes: &[u8], pitch_um: f64, height_um: Option<f64>) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("map");
        std::fs::write(&file, bytes).unwrap();
        let spec = HeightMapSpec {
            file,
            pitch_um,
            height_um,
        };
        Self { _dir: dir, spec }
    }

    fn field(&self) -> HeightField {
        self.spec.build(0).unwrap()
    }

    /// The sentence of a file that cannot be used.
    fn refused(&self) -> String {
        let told = match self.spec.build(0) {
            Err(BuildError::Data { path, message }) => {
                assert_eq!(path, self.spec.file);
                message
            }
            Err(e) => panic!("{e}"),
            Ok(field) => panic!("{:?} heights are read", field.size()),
        };
        assert!(!told.contains('\n') && told.len() < 400, "{told}");
        told
    }
}

fn refused(bytes: &[u8]) -> String {
    Map::of(bytes, 1.0, Some(1.0)).refused()
}

fn of_exr(channels: &[(&str, &[f32])], width: usize) -> Vec<u8> {
    let height = channels[0].1.len() / width;
    let list = channels.iter().map(|(name, values)| {
        let values = FlatSamples::F32(values.to_vec());
        AnyChannel::new(*name, values)
    });
    let list: SmallVec<_> = list.collect();
    let (look, raw) = (LayerAttributes::default(), Encoding::UNCOMPRESSED);
    let layer = Layer::new((width, height), look, raw, AnyChannels::sort(list));
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::from_layer(layer);
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// A PNG of so many samples; without any it is a header alone.
fn of_png(size: [u32; 2], color: png::ColorType, depth: png::BitDepth, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    if !samples.is_empty() {
        writer.write_image_data(samples).unwrap();
    }
    drop(writer);
    bytes
}

fn grey(size: [u32; 2], samples: &[u16]) -> Vec<u8> {
    let samples: Vec<u8> = samples.iter().flat_map(|v| v.to_be_bytes()).collect();
    let sixteen = png::BitDepth::Sixteen;
    of_png(size, png::ColorType::Grayscale, sixteen, &samples)
}

/// Rows from the top, of which no two numbers are equal.
const NUMBERS: [u16; 6] = [10, 65535, 300, 4, 5000, 60];

/// The same in cells of half a micron, from the lowest row on, less the smallest.
const CELLS: [f64; 6] = [0.0, 9992.0, 112.0, 12.0, 131062.0, 592.0];

#[test]
fn all_formats_have_the_same_heights() {
    let floats = NUMBERS.map(f32::from);
    let csv = |separator: &str| {
        let rows = NUMBERS.chunks(3).map(|row| {
            let cells: Vec<_> = row.iter().map(u16::to_string).collect();
            format!(" {}\r\n", cells.join(separator))
        });
        "\u{feff}# of a profilometer\n\n".to_owned() + &rows.collect::<String>()
    };
    let same = [
        (grey([3, 2], &NUMBERS), Some(65535.0)),
        (of_exr(&[("Y", &floats)], 3), None),
        (of_exr(&[("height", &floats)], 3), Some(1.0)),
        (of_exr(&[("of-any-name", &floats)], 3), None),
        (csv(",").into_bytes(), None),
        (csv("; ").into_bytes(), Some(1.0)),
        (csv("\t").replace("300", "300,0").into_bytes(), None),
    ];
    for (bytes, height_um) in same {
        let map = Map::of(&bytes, 0.5, height_um);
        let field = map.field();
        assert_eq!(field.size(), [3, 2]);
        let heights: Vec<f64> = field.heights().collect();
        assert_eq!(heights, CELLS);
        map.spec.check().unwrap();
        assert_eq!(map.spec.files(), std::slice::from_ref(&map.spec.file));
    }
}

#[test]
fn of_several_channels_that_of_heights_is_read() {
    let (up, down) = ([0.0, 1.0, 2.0, 3.0], [3.0, 2.0, 1.0, 0.0]);
    for (name, other) in [("Y", "A"), ("R", "G"), ("z", "G"), ("Height", "B")] {
        let map = Map::of(&of_exr(&[(name, &up), (other, &down)], 2), 1.0, None);
        let heights: Vec<f64> = map.field().heights().collect();
        assert_eq!(heights, [2.0, 3.0, 0.0, 1.0], "{name}");
    }
    let told = refused(&of_exr(&[("A", &up), ("B", &down)], 2));
    says(&told, "A, B; allowed: Y, R, Z or height");
}

#[test]
fn a_cast_is_upside_down_and_small_heights_on_a_tall_offset_are_kept() {
    let text = b"1e6,1000000.001\n1000000.002,1000000.004\n";
    for height_um in [1.0, -1.0] {
        let field = Map::of(text, 0.001, Some(height_um)).field();
        for (found, expected) in field.heights().zip([2.0, 4.0, 0.0, 1.0]) {
            near(found, height_um * expected, 1e-5, expected);
        }
    }
}

#[test]
fn a_constant_map_is_a_plane() {
    let map = Map::of(b"7,7,7\n7,7,7\n", 1.0, None);
    let field = map.field();
    assert!(field.all_slopes().all(|slopes| slopes == [0.0, 0.0]));
    assert!(map.spec.remarks(&field).is_empty());
}

/// Periods of a sine have no edge; a part of one, and a plane that was not levelled, have one.
#[test]
fn a_step_across_an_edge_is_told() {
    let told = |f: &dyn Fn(f64, f64) -> f64| {
        let row = |y: i32| {
            let cells: Vec<_> = (0..32).map(|x| f(x.into(), y.into()).to_string()).collect();
            cells.join(",") + "\n"
        };
        let text: String = (0..32).map(row).collect();
        let map = Map::of(text.as_bytes(), 1.0, None);
        map.spec.remarks(&map.field())
    };
    let turn = std::f64::consts::TAU / 32.0;
    assert!(told(&|x, y| (2.0 * turn * x).sin() + (turn * y).cos()).is_empty());
    let part = told(&|x, y| (1.5 * turn * x).cos() + (turn * y).cos());
    assert_eq!(part.len(), 1);
    let plane = told(&|x, y| 0.1 * x + 0.2 * y);
    let steps = "steps of 3.100 along x, 6.200 along y, where those inside are 0.100 along x, 0.200 along y";
    assert!(plane.len() == 1 && plane[0].contains(steps), "{plane:?}");
    assert!(plane[0].contains("map: not periodic: "), "{plane:?}");
}

#[test]
fn a_file_that_is_no_map_is_told_why() {
    let some = [0.5f32; 4];
    use png::{BitDepth, ColorType};
    let png = |color, depth, bytes: usize| of_png([2, 2], color, depth, &vec![9; bytes]);
    let grey_of_8 = png(ColorType::Grayscale, BitDepth::Eight, 4);
    let colour = png(ColorType::Rgb, BitDepth::Sixteen, 24);
    let with_alpha = png(ColorType::GrayscaleAlpha, BitDepth::Sixteen, 16);
    let of_csv = "neither OpenEXR nor PNG, and of CSV line 1 has a zero byte";
    let with = |value: f32| of_exr(&[("Y", &[0.0, 1.0, value, 2.0, 3.0, 4.0])], 2);
    let made = [
        (grey([1, 1], &[7]), "1 × 1 heights; allowed: 2 to 8192"),
        (grey([4, 1], &[7; 4]), "4 × 1 heights; allowed: 2 to 8192"),
        (of_exr(&[("Y", &some)], 4), "4 × 1 heights"),
        (Vec::new(), "× 0 heights; allowed: 2 to 8192"),
        ("1,".repeat(8192).into(), "line 1: cell 8193 is \"\""),
        ("1\n".repeat(8193).into(), "1 × 8193 heights"),
        (with(f32::NAN), "column 1, row 2 (counted from 1) is NaN"),
        (with(f32::NEG_INFINITY), "is -inf; allowed: finite"),
        (with(1e38), "e37 cells; allowed: less than 2e5"),
        (b"1,2\n3,\xff".to_vec(), "line 2: cell 2 is \"ÿ\""),
        (b"\0\0\0\0".to_vec(), of_csv),
        (grey_of_8, "this PNG is grey of 8 bits; allowed: grey of 16"),
        (colour, "this PNG is colour of 16 bits; allowed: grey"),
        (with_alpha, "grey with alpha of 16 bits"),
    ];
    let texts = table(
        r#"
        1,2,3\n          | 3 × 1 heights; allowed: 2 to 8192
        1\n2\n           | 1 × 2 heights; allowed: 2 to 8192
        # none\n         | × 0 heights; allowed: 2 to 8192
        1,2\n3\n         | line 2 has 1 cells; allowed: 2, as the first row
        1,2\n\n#\n3,4,5\n | line 4 has 3 cells; allowed: 2
        x,y\n1,2\n       | line 1: cell 1 is "x"; allowed: a finite number
        1,2\n3,nan\n     | line 2: cell 2 is "nan"; allowed: a finite number
        1,2\n3,1e999\n   | line 2: cell 2 is "1e999"; allowed: a finite
        1,2\n3,\n        | line 2: cell 2 is ""; allowed: a finite
        1,2\n"1,5"\n     | line 2: cell 1 is "\"1"; allowed: a finite
        "#,
    )
    .map(|[text, part]| (text.into(), part));
    for (bytes, part) in made.into_iter().chain(texts) {
        let told = refused(&bytes);
        says(&told, part);
    }
}

/// Sizes are looked at before there is room made for them.
#[test]
fn headers_that_promise_too_much_are_refused() {
    let (sixteen, grey) = (png::BitDepth::Sixteen, png::ColorType::Grayscale);
    let told = refused(&of_png([100_000, 90_000], grey, sixteen, &[]));
    says(&told, "100000 × 90000 heights; allowed: 2 to 8192");
    let told = refused(&of_png([8192, 8192], grey, sixteen, &[]));
    says(&told, "promise to hold 134217728; allowed: ");
    // The last column and row of an OpenEXR's window: the last two of its four numbers.
    let bytes = of_exr(&[("Y", &[0.0; 9])], 3);
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 12;
    let with = |last: [i32; 2]| {
        let mut bytes = bytes.clone();
        bytes[at..at + 8].copy_from_slice(&last.map(i32::to_le_bytes).concat());
        refused(&bytes)
    };
    let told = with([99_999_999, 2]);
    says(&told, "100000000 × 3 heights; allowed: 2 to 8192");
    let told = with([8191, 8191]);
    says(&told, "promise to hold 268435456; allowed: ");
}

/// Parts of a file are refused, or lack nothing that is a height.
#[test]
fn no_part_of_a_file_is_taken_for_all_of_it() {
    let floats = NUMBERS.map(f32::from);
    let whole = grey([3, 2], &NUMBERS);
    for bytes in [whole, of_exr(&[("Y", &floats)], 3)] {
        for end in 0..bytes.len() {
            let map = Map::of(&bytes[..end], 0.5, Some(65535.0));
            if let Ok(field) = map.spec.build(0) {
                // The end of a PNG has a chunk that says so, and nothing else.
                assert!(end + 12 >= bytes.len(), "{end}");
                assert!(field.heights().eq(CELLS), "{end}");
            }
        }
    }
}

#[test]
fn keys_have_ranges() {
    let bytes = grey([3, 2], &NUMBERS);
    let told = |pitch_um, height_um| {
        let built = Map::of(&bytes, pitch_um, height_um).spec.build(0);
        match built.map(|_| ()) {
            Err(BuildError::Parameter(e)) => e.to_string(),
            other => panic!("{other:?}"),
        }
    };
    let least = "pitch_um = 0: allowed is a number in (0, 1000000]";
    for (pitch_um, height_um, parts) in [
        (0.0, Some(1.0), least),
        (f64::NAN, Some(1.0), "pitch_um = NaN"),
        (1.0, Some(f64::INFINITY), "height_um = inf"),
        (
            1.0,
            None,
            "height_um = none: allowed is a number in … white",
        ),
    ] {
        says(&told(pitch_um, height_um), parts);
    }
}
