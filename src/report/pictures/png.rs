//! Pixels as PNG, and back.

use crate::report::in_memory;
use png::{BitDepth, ColorType, Compression, Decoder, Encoder, Filter, Transformations};
use std::io::{self, Cursor};

/// Pixels, `width` to a row, as a PNG file: sRGB, or sRGB and opacity if `N` is 4.
pub(in crate::report) fn encoded<const N: usize>(pixels: &[[u8; N]], width: usize) -> Vec<u8> {
    let size = [width, pixels.len() / width.max(1)].map(|s| in_memory(u32::try_from(s)));
    let color = match N {
        4 => ColorType::Rgba,
        _ => ColorType::Rgb,
    };
    // A fifth larger than balanced, in a twentieth of the time.
    let how = (Filter::Adaptive, Compression::Fast);
    file(size, color, pixels.as_flattened(), None, how)
}

/// A PNG file of pixels of 8 bits a channel; of a palette with its colours, and its opacities if they are not all whole.
pub(in crate::report) fn file(
    [width, height]: [u32; 2],
    color: ColorType,
    bytes: &[u8],
    palette: Option<&(Vec<u8>, Option<Vec<u8>>)>,
    (filter, compression): (Filter, Compression),
) -> Vec<u8> {
    file_of(|file| {
        let mut encoder = Encoder::new(file, width, height);
        encoder.set_color(color);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(compression);
        encoder.set_filter(filter);
        if let Some((colours, opacities)) = palette {
            encoder.set_palette(colours);
            if let Some(opacities) = opacities {
                encoder.set_trns(opacities);
            }
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(bytes)?;
        Ok(writer.finish()?)
    })
}

/// The bytes of a picture that is written.
pub(in crate::report) fn file_of(
    write: impl FnOnce(&mut Cursor<Vec<u8>>) -> io::Result<()>,
) -> Vec<u8> {
    let mut file = Cursor::default();
    in_memory(write(&mut file));
    file.into_inner()
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
