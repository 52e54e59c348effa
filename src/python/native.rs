//! The library without Python: what its arrays are compared with.
//!
//! Reads pairs from stdin, six f64 each (omega_i, omega_o, little-endian), evaluates GGX of roughness 0.3 at all of them
//! as often as the argument says, writes the values to stdout and the shortest wall time (s) to stderr.

use gonio::brdf::{Channels, all};
use gonio::geometry::{Direction, DirectionPair};
use gonio::{metrics, registry};
use std::error::Error;
use std::io::{Read, Write, stdin, stdout};
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let rounds: usize = std::env::args().nth(1).ok_or("how often?")?.parse()?;
    let mut bytes = Vec::new();
    stdin().read_to_end(&mut bytes)?;
    let number = |b: &[u8]| b.try_into().map(f64::from_le_bytes);
    let numbers: Result<Vec<f64>, _> = bytes.chunks_exact(8).map(number).collect();
    let numbers = numbers?;
    let direction = |v: &[f64]| Direction::from_unit(glam::DVec3::new(v[0], v[1], v[2]));
    let pairs = numbers.chunks_exact(6);
    let pairs = pairs.map(|p| DirectionPair::new(direction(&p[..3]), direction(&p[3..])));
    let pairs: Vec<DirectionPair> = pairs.collect();
    let ggx = all().into_iter().find(|e| e.kind == "ggx");
    let ggx = registry::read_text(&ggx.ok_or("no GGX")?, "alpha = 0.3")?;
    let ggx = ggx.build(Channels::Luminance)?;
    let (mut values, mut shortest) = (metrics::Values::default(), f64::INFINITY);
    for _ in 0..rounds {
        let start = Instant::now();
        values = metrics::evaluate(&*ggx, &pairs);
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    for value in values.luminance {
        stdout().write_all(&value.to_le_bytes())?;
    }
    eprintln!("{shortest}");
    Ok(())
}
