//! The reader of MERL files: no input may make it panic, and what it accepts must be read as finite
//! values ≥ 0 or as missing.
//!
//! A whole file has 35 MB, which no fuzzer finds. The input is stretched: even first byte, it is the
//! stream as it is; odd, a right header, then the input over and over, `second byte − 128` bytes
//! more or less than a table needs.
#![no_main]

use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid};
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::geometry::DirectionPair;
use libfuzzer_sys::fuzz_target;
use std::io::Read;

struct Cycle<'a> {
    data: &'a [u8],
    at: usize,
}

impl Read for Cycle<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = buffer.len().min(self.data.len() - self.at);
        buffer[..n].copy_from_slice(&self.data[self.at..self.at + n]);
        self.at = (self.at + n) % self.data.len();
        Ok(n)
    }
}

fn check(result: Result<Merl, gonio::brdf::measured::merl::MerlError>) {
    let Ok(table) = result else { return };
    let n = table.channels().count();
    for interpolation in [Interpolation::Nearest, Interpolation::Trilinear] {
        let table = table.clone().with_interpolation(interpolation);
        for i in 0..1000u32 {
            let t = f64::from(i);
            let pair =
                DirectionPair::from_spherical(t * 1.57e-3, t, (0.618 * t).fract() * 1.57, 2.3 * t);
            let mut out = [0.0; 3];
            let presence = table.eval(&pair, &mut out[..n]);
            assert!(out.iter().all(|v| v.is_finite() && *v >= 0.0));
            assert!(presence == Presence::Present || out == [0.0; 3]);
        }
    }
}

fuzz_target!(|data: &[u8]| {
    let [mode, length, rest @ ..] = data else {
        return;
    };
    let channels = match mode & 2 {
        0 => Channels::Luminance,
        _ => Channels::Rgb,
    };
    if mode & 1 == 0 || rest.is_empty() {
        return check(Merl::read(rest, channels));
    }
    let grid = match mode & 4 {
        0 => MerlGrid::Reciprocal,
        _ => MerlGrid::Full,
    };
    let header: Vec<u8> = grid
        .dims()
        .iter()
        .flat_map(|&n| (n as i32).to_le_bytes())
        .collect();
    let length = grid.file_len() - 12 + u64::from(*length) - 128;
    let body = Cycle { data: rest, at: 0 }.take(length);
    check(Merl::read(header.as_slice().chain(body), channels));
});
