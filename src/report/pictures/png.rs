//! Pixels as PNG, and back.

use png::{BitDepth, ColorType, Compression, Decoder, Encoder, Filter, Transformations};
use std::io::{self, Cursor, Write};

/// Writes sRGB pixels, `width` to a row, as PNG.
pub(in crate::report) fn write_rgb(
    bytes: &[u8],
    width: usize,
    out: &mut impl Write,
) -> io::Result<()> {
    write_pixels(bytes, width, ColorType::Rgb, out)
}

/// Writes sRGB pixels with their opacity, `width` to a row, as PNG.
pub(in crate::report) fn write_rgba(
    bytes: &[u8],
    width: usize,
    out: &mut impl Write,
) -> io::Result<()> {
    write_pixels(bytes, width, ColorType::Rgba, out)
}

fn write_pixels(
    bytes: &[u8],
    width: usize,
    kind: ColorType,
    out: &mut impl Write,
) -> io::Result<()> {
    let row = width * kind.samples();
    let size = [width, bytes.len() / row.max(1)].map(u32::try_from);
    let [width, height] = [size[0], size[1]].map(|s| s.map_err(io::Error::other));
    let mut encoder = Encoder::new(out, width?, height?);
    encoder.set_color(kind);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    encoder.set_filter(Filter::Adaptive);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    Ok(writer.finish()?)
}

/// Pixels in R, G, B and opacity.
pub(in crate::report) struct Rgba {
    pub size: [u32; 2],
    /// Row after row from the top.
    pub pixels: Vec<[u8; 4]>,
}

/// The picture of a PNG, and the bytes of its pixels, of channels that the file has.
pub(in crate::report) fn read(png: &[u8]) -> Option<(Rgba, usize)> {
    let mut decoder = Decoder::new(Cursor::new(png));
    decoder.set_transformations(Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().ok()?;
    let mut bytes = vec![0; reader.output_buffer_size()?];
    let frame = reader.next_frame(&mut bytes).ok()?;
    bytes.truncate(frame.buffer_size());
    let pixels = bytes.chunks_exact(frame.color_type.samples());
    let pixels = pixels.map(|pixel| match *pixel {
        [grey] => [grey, grey, grey, 255],
        [grey, opacity] => [grey, grey, grey, opacity],
        [r, g, b] => [r, g, b, 255],
        [r, g, b, opacity, ..] => [r, g, b, opacity],
        [] => [0; 4],
    });
    let picture = Rgba {
        size: [frame.width, frame.height],
        pixels: pixels.collect(),
    };
    Some((picture, bytes.len()))
}
