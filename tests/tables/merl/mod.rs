//! MERL tables: the bytes, the cells and what happens between them.

mod format;
mod lookup;
mod writing;

use crate::common::merl_file as file;
use gonio::brdf::measured::merl::{Merl, MerlGrid, SCALE};
use gonio::brdf::{Brdf, Channels, Presence};
use gonio::geometry::{Direction, DirectionPair};

/// A table whose three channels all read `value(cell)` in sr⁻¹ to an ulp or two.
fn grey(grid: MerlGrid, channels: Channels, value: impl Fn([usize; 3]) -> f64) -> Merl {
    let bytes = file(grid, |c, cell| value(cell) / SCALE[c]);
    Merl::read(bytes.as_slice(), channels).unwrap()
}

/// Every cell of a grid.
fn cells(grid: MerlGrid) -> impl Iterator<Item = [usize; 3]> {
    let [n_h, n_d, n_phi] = grid.dims();
    (0..n_h).flat_map(move |h| (0..n_d).flat_map(move |d| (0..n_phi).map(move |phi| [h, d, phi])))
}

/// The pair with the given theta_h, theta_d, phi_d (rad), turned by phi_h about the normal, if both
/// directions are above the horizon.
///
/// d = (sin theta_d cos phi_d, sin theta_d sin phi_d, cos theta_d) is turned by theta_h about b and
/// phi_h about n; omega_o is the same with d's first two components negated. Each component carries
/// at most three roundings, 2e-16: theta_h and theta_d are good to 2e-16/|h| and phi_d to
/// 2e-16/|h_bar| rad, 5e-10 in the worst cell (theta_h = 0.003°, theta_d = 89.5°).
fn pair(theta_h: f64, theta_d: f64, phi_d: f64, phi_h: f64) -> Option<DirectionPair> {
    let (sh, ch) = theta_h.sin_cos();
    let (sd, cd) = theta_d.sin_cos();
    let (sf, cf) = phi_d.sin_cos();
    let (sp, cp) = phi_h.sin_cos();
    let make = |x: f64, y: f64| {
        let (x, z) = (x * ch + cd * sh, cd * ch - x * sh);
        Direction::try_new([x * cp - y * sp, x * sp + y * cp, z].into())
    };
    let pair = DirectionPair::new(make(sd * cf, sd * sf)?, make(-sd * cf, -sd * sf)?);
    pair.is_above_horizon().then_some(pair)
}

/// Angles at index coordinates, by the definition of the grid.
fn angles([x_h, x_d, x_phi]: [f64; 3]) -> [f64; 3] {
    let theta_h = std::f64::consts::FRAC_PI_2 * (x_h / 90.0).powi(2);
    [theta_h, x_d.to_radians(), x_phi.to_radians()]
}

/// The value of the first channel, if there is one.
fn first(brdf: &dyn Brdf, pair: &DirectionPair) -> Option<f64> {
    let mut out = [f64::NAN; 3];
    let n = brdf.channels().count();
    match brdf.eval(pair, &mut out[..n]) {
        Presence::Present => Some(out[0]),
        Presence::Missing => {
            assert_eq!(out[..n], [0.0; 3][..n], "values are left at 0");
            None
        }
    }
}

/// Distance in units in the last place of `b`.
fn ulps(a: f64, b: f64) -> f64 {
    let ulp = f64::from_bits(b.abs().to_bits() + 1) - b.abs();
    ((a - b) / ulp).abs()
}
