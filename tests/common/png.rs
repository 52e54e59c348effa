//! Pictures that tests look at.

use std::io::Cursor;

/// Width, and R, G, B, A of the pixels of a PNG of 8 bits a channel in colours, row after row from the top.
pub fn pixels(png: &[u8]) -> (usize, Vec<[u8; 4]>) {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    let pixel = |p: &[u8]| [p[0], p[1], p[2], p.get(3).copied().unwrap_or(255)];
    let pixels = bytes.chunks_exact(frame.color_type.samples()).map(pixel);
    (frame.width as usize, pixels.collect())
}
