//! A sphere of a material under distant light, with points drawn where light and material are
//! bright.
//!
//! The scene is that of [`sphere`](crate::report::sphere()). Half of the points of a pixel come from a
//! table of the light (luminance times solid angle, in cells of 0.7°), half from tables of the
//! BRDF times cos θ_i ([`crate::importance`]), whose cells shrink to a millionth of a radian towards the mirror direction. Either
//! may miss what the other finds; both are weighed by the mean of the two densities (the balance
//! heuristic of Veach and Guibas 1995), so that a picture is right on average whatever the tables
//! hold, and its noise is small where either is good: a lamp on plaster, a window in chrome.
//!
//! Points are scrambled Sobol points, scrambled anew for each pixel.

use super::distribution::Distribution;
use crate::brdf::Brdf;
use crate::geometry::{Direction, DirectionPair};
use crate::importance::{
    Axes, Conditional, InCells, LightChart, RadialWarp, SamplerSettings, TabulatedSampler,
};
use crate::lighting::Lighting;
use crate::numeric::luminance;
use crate::parametrization::view_centered;
use crate::report::SphereImage;
use crate::report::pictures::slice::values;
use crate::report::pictures::sphere::{Frame, places, world};
use crate::sampling::Sobol;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Rows of the table of the light; twice as many columns.
const LIGHT_ROWS: usize = 256;

/// Renders a sphere with `samples` points a pixel, rounded up to an even number, at least 2 and
/// at most 65 536.
///
/// Radiance at the middles of pixels; on the edge, the mean over the part of a pixel that the sphere
/// covers. A BRDF without colours has its luminance in R, G and B; pairs
/// without data reflect nothing. `resolution` is clamped to [1, 4096]. Any number of threads gives
/// the same picture. Noise falls like 1/√samples or faster.
pub fn render_sphere(
    brdf: &dyn Brdf,
    lighting: &dyn Lighting,
    resolution: usize,
    samples: usize,
) -> SphereImage {
    let pixels = render(&[brdf], lighting, resolution, samples);
    image(resolution, &pixels, |p| p[0].images[0])
}

/// The spheres of a BRDF and of a copy of it.
pub struct SpherePair {
    /// The BRDF, then its copy.
    pub images: [SphereImage; 2],
    /// For each pixel, the share of the light on it (luminance times cos θ_i) that is left out of both, as one of
    /// them has no data there; 0 beside the sphere and in darkness.
    pub left_out: Vec<f64>,
}

/// The spheres of a BRDF beside each of its copies, as [`render_sphere`] draws them, but all by the same points:
/// where BRDFs agree pictures agree to the last digit, and noise hides no difference. Pairs that the BRDF or a copy
/// has no data for are left out of both.
pub fn render_spheres(
    brdf: &dyn Brdf,
    copies: &[&dyn Brdf],
    lighting: &dyn Lighting,
    resolution: usize,
    samples: usize,
) -> Vec<SpherePair> {
    let all: Vec<_> = [brdf].into_iter().chain(copies.iter().copied()).collect();
    let pixels = render(&all, lighting, resolution, samples);
    let beside = |copy: usize| SpherePair {
        images: [0, 1].map(|i| image(resolution, &pixels, |p| p[copy].images[i])),
        left_out: pixels
            .iter()
            .map(|p| p.as_ref().map_or(0.0, |p| p[copy].left_out))
            .collect(),
    };
    (0..copies.len()).map(beside).collect()
}

/// The picture of a number of each pixel.
fn image(
    resolution: usize,
    pixels: &[Option<Vec<Seen>>],
    of: impl Fn(&[Seen]) -> [f64; 3],
) -> SphereImage {
    SphereImage {
        resolution: clamped(resolution),
        pixels: pixels.iter().map(|p| p.as_deref().map(&of)).collect(),
    }
}

fn clamped(resolution: usize) -> usize {
    resolution.clamp(1, 4096)
}

/// The first of some BRDFs and another in a pixel, or itself, by the light that both have data for.
#[derive(Clone, Copy, Default)]
struct Seen {
    images: [[f64; 3]; 2],
    /// Share of the light that is left out.
    left_out: f64,
}

/// The pixels of a sphere: the first BRDF beside each of the others, alone beside itself; `None` beside the sphere.
fn render(
    brdfs: &[&dyn Brdf],
    lighting: &dyn Lighting,
    resolution: usize,
    samples: usize,
) -> Vec<Option<Vec<Seen>>> {
    let resolution = clamped(resolution);
    let points = samples.clamp(2, 1 << 16).div_ceil(2) as u64;
    let light = light_table(lighting);
    let lobes = lobes(brdfs);
    let shader = Shader {
        brdfs,
        lighting,
        light: &light,
    };
    let pixel = |pixel: usize| {
        let (places, _) = places(resolution, pixel);
        // The parts of a pixel on the edge share its points, but for the few that each needs.
        let points = match places.len() {
            0 => return None,
            1 => points,
            n => points.div_ceil(n as u64).max(points.min(8)),
        };
        let mut sum = vec![Seen::default(); (brdfs.len() - 1).max(1)];
        let share = 1.0 / places.len() as f64;
        for (part, [x, y]) in places.iter().enumerate() {
            let omega_o = view_centered(x.hypot(*y).asin(), 0.0);
            let seed = (pixel + part * resolution * resolution) as u64;
            let lobe = lobes.given(omega_o);
            let drawn = shader.draw(omega_o, &lobe, &Frame::new(*x, *y), seed, points);
            shader.shade(&drawn, share, &mut sum);
        }
        Some(sum)
    };
    let pixels = (0..resolution * resolution).into_par_iter();
    pixels.map(pixel).collect()
}

/// Distribution of light directions by luminance times solid angle.
fn light_table(lighting: &dyn Lighting) -> Distribution {
    let (rows, columns) = (LIGHT_ROWS, 2 * LIGHT_ROWS);
    // Corners of cells: an edge of a lamp then raises the cells on both of its sides.
    let corners = (0..=rows).into_par_iter().flat_map_iter(|row| {
        let theta = PI * row as f64 / rows as f64;
        (0..columns).map(move |column| {
            let phi = TAU * column as f64 / columns as f64;
            luminance(lighting.radiance(Direction::from_spherical(theta, phi)))
        })
    });
    let corners: Vec<f64> = corners.collect();
    let edge = |row: usize| {
        let s = (0.5 * PI * row as f64 / rows as f64).sin();
        2.0 * s * s
    };
    let edges: Vec<_> = (0..=rows).map(edge).collect();
    let mut weights = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        let angle = edges[row + 1] - edges[row];
        for column in 0..columns {
            let next = (column + 1) % columns;
            let at = |r: usize, c: usize| corners[r * columns + c];
            let sum = at(row, column) + at(row, next) + at(row + 1, column) + at(row + 1, next);
            weights.push(angle * sum);
        }
    }
    Distribution::new(edges, columns, weights)
}

/// Light directions by f_r cos θ_i, of the first BRDF and, as often, of the others.
fn lobes(brdfs: &[&dyn Brdf]) -> TabulatedSampler {
    let others = brdfs.len() - 1;
    // Half is the first's, whatever the others are like: it is looked at beside each of them.
    let share = |b: usize| match (b, others) {
        (_, 0) => 1.0,
        (0, _) => 0.5,
        _ => 0.5 / others as f64,
    };
    let shares: Vec<_> = brdfs
        .iter()
        .enumerate()
        .map(|(b, brdf)| (*brdf, share(b)))
        .collect();
    let settings = SamplerSettings {
        axes: Axes {
            chart: LightChart::HBar,
            // Lobes of mirrors are a millionth of a radian wide.
            warp: RadialWarp::FourthRoot,
            to_horizon: true,
        },
        in_cells: InCells::Bilinear,
        views: 64,
        // Views are seen from azimuth 0, whatever the symmetry.
        azimuths: 1,
        ..SamplerSettings::default()
    };
    #[expect(clippy::expect_used, reason = "these settings are within their ranges")]
    TabulatedSampler::mixed(&shares, settings).expect("a sampler")
}

struct Shader<'a> {
    brdfs: &'a [&'a dyn Brdf],
    lighting: &'a dyn Lighting,
    light: &'a Distribution,
}

/// Pairs of directions that were drawn, and radiance times cos θ_i over their density and number.
type Drawn = (Vec<DirectionPair>, Vec<[f64; 3]>);

impl Shader<'_> {
    /// Adds a share of a place of the sphere under each BRDF.
    fn shade(&self, (pairs, radiances): &Drawn, share: f64, to: &mut [Seen]) {
        let first = values(self.brdfs[0], pairs);
        for (i, to) in to.iter_mut().enumerate() {
            // Alone it is beside itself.
            let other = self.brdfs.get(i + 1).map(|brdf| values(*brdf, pairs));
            let both = first.iter().zip(other.as_ref().unwrap_or(&first));
            let mut seen = Seen::default();
            let [mut all, mut left_out] = [0.0; 2];
            for (radiance, both) in radiances.iter().zip(both) {
                let light = luminance(*radiance);
                all += light;
                let (Some(f), Some(g)) = both else {
                    left_out += light;
                    continue;
                };
                for (image, f) in seen.images.iter_mut().zip([f, g]) {
                    for c in 0..3 {
                        image[c] += f[c] * radiance[c];
                    }
                }
            }
            let channels = to.images.as_flattened_mut().iter_mut();
            for (to, seen) in channels.zip(seen.images.as_flattened()) {
                *to += share * seen;
            }
            to.left_out += share * if all > 0.0 { left_out / all } else { 0.0 };
        }
    }

    /// Draws directions of light at a place of the sphere.
    fn draw(
        &self,
        omega_o: Direction,
        lobe: &Conditional<'_>,
        frame: &Frame,
        seed: u64,
        points: u64,
    ) -> Drawn {
        let mut drawn = Drawn::default();
        // `density` is the sum of both tables', twice the mean.
        let mut push = |omega_i: Direction, towards: DVec3, density: f64| {
            drawn.0.push(DirectionPair::new(omega_i, omega_o));
            let light = self.lighting.radiance(Direction::from_unit(towards));
            let weight = omega_i.cos_theta() / density;
            drawn.1.push(light.map(|v| v * weight / points as f64));
        };
        let mut sobol = Sobol::new(seed);
        for i in 0..points {
            let [a, b, u, v] = sobol.point(i);
            if let Some((omega_i, of_lobe)) = lobe.draw([a, b]) {
                let towards = world(frame.camera(omega_i.vector()));
                let of_light = self.light.pdf(towards);
                push(omega_i, towards, of_lobe + of_light);
            }
            let (towards, of_light) = self.light.sample([u, v]);
            let local = frame.local(from_world(towards));
            if local.z > 0.0 {
                let omega_i = Direction::from_unit(local);
                push(omega_i, towards, of_light + lobe.pdf(omega_i));
            }
        }
        drawn
    }
}

/// From the light's frame to the camera's.
fn from_world(v: DVec3) -> DVec3 {
    DVec3::new(v.y, v.z, v.x)
}
