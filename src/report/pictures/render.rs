//! A sphere of a material under distant light, with points drawn where light and material are
//! bright.
//!
//! The scene is that of [`sphere`](crate::report::sphere()). Half of the points of a pixel come from a
//! table of the light (luminance times solid angle, in cells of 0.7°), half from a table of the
//! BRDF times cos θ_i about the mirror direction, whose cells shrink to 1e-7 rad towards it. Either
//! may miss what the other finds; both are weighed by the mean of the two densities (the balance
//! heuristic of Veach and Guibas 1995), so that a picture is right on average whatever the tables
//! hold, and its noise is small where either is good: a lamp on plaster, a window in chrome.
//!
//! Points are scrambled Sobol points, scrambled anew for each pixel.

use super::distribution::Distribution;
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{Direction, DirectionPair};
use crate::lighting::Lighting;
use crate::numeric::luminance;
use crate::parametrization::view_centered;
use crate::report::SphereImage;
use crate::report::pictures::sphere::{Frame, places, world};
use crate::sampling::Sobol;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Rows of the table of the light; twice as many columns.
const LIGHT_ROWS: usize = 256;

/// Views whose lobes are tabulated, at the middles of equal steps from 0° to 90°.
const VIEWS: usize = 64;

/// Sectors of a ring of a lobe.
const SECTORS: usize = 24;

/// Share of a lobe's directions that are even over the hemisphere: narrow features that its table
/// has missed lie there.
const EVEN: f64 = 0.1;

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
    let ([image], _) = render_spheres([brdf], lighting, resolution, samples);
    image
}

/// The spheres of several BRDFs, as [`render_sphere`] draws them, but by the same points: where
/// BRDFs agree pictures agree to the last digit, and noise hides no difference. Pairs that one of
/// them has no data for are left out of all. Second is, for each pixel, the share of the light on
/// it (luminance times cos θ_i) that is left out; 0 beside the sphere and in darkness.
pub fn render_spheres<const N: usize>(
    brdfs: [&dyn Brdf; N],
    lighting: &dyn Lighting,
    resolution: usize,
    samples: usize,
) -> ([SphereImage; N], Vec<f64>) {
    let resolution = resolution.clamp(1, 4096);
    let points = samples.clamp(2, 1 << 16).div_ceil(2) as u64;
    let light = light_table(lighting);
    let views = (0..VIEWS).into_par_iter();
    let lobes: Vec<_> = views
        .map(|i| lobe_table(&brdfs, FRAC_PI_2 * (i as f64 + 0.5) / VIEWS as f64))
        .collect();
    let rows = (0..resolution).into_par_iter().map(|row| {
        let mut shader = Shader::new(brdfs, lighting, &light);
        let pixels = (row * resolution..(row + 1) * resolution).map(|pixel| {
            let (places, _) = places(resolution, pixel);
            // The parts of a pixel on the edge share its points, but for the few that each needs.
            let points = match places.len() {
                0 => return None,
                1 => points,
                n => points.div_ceil(n as u64).max(points.min(8)),
            };
            let mut sum = ([[0.0; 3]; N], 0.0);
            for (part, [x, y]) in places.iter().enumerate() {
                let theta_o = x.hypot(*y).asin();
                let nearest = (theta_o / FRAC_PI_2 * VIEWS as f64) as usize;
                let lobe = Lobe {
                    table: &lobes[nearest.min(VIEWS - 1)],
                    omega_o: view_centered(theta_o, 0.0),
                };
                let seed = (pixel + part * resolution * resolution) as u64;
                let found = shader.pixel(&lobe, &Frame::at(*x, *y), seed, points);
                let share = 1.0 / places.len() as f64;
                for (sum, found) in sum.0.iter_mut().flatten().zip(found.0.iter().flatten()) {
                    *sum += share * found;
                }
                sum.1 += share * found.1;
            }
            Some(sum)
        });
        pixels.collect::<Vec<_>>()
    });
    let rows: Vec<_> = rows.collect();
    let pixels = rows.concat();
    let images = std::array::from_fn(|i| SphereImage {
        resolution,
        pixels: pixels.iter().map(|p| p.map(|(all, _)| all[i])).collect(),
    });
    let left_out = pixels.iter().map(|p| p.map_or(0.0, |(_, share)| share));
    (images, left_out.collect())
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

/// Distribution of light directions about the mirror direction of a view: f_r cos θ_i times solid
/// angle.
fn lobe_table(brdfs: &[&dyn Brdf], theta_o: f64) -> Distribution {
    const FIRST: f64 = 1e-7;
    let widest = 4f64.to_radians();
    let mut gammas = vec![0.0, FIRST];
    let mut last = FIRST;
    while last < PI {
        last = (last + (last / 4.0).min(widest)).min(PI);
        gammas.push(last);
    }
    let edge = |gamma: &f64| 2.0 * (0.5 * gamma).sin().powi(2);
    let edges: Vec<f64> = gammas.iter().map(edge).collect();
    let omega_o = view_centered(theta_o, 0.0);
    let cells = gammas.windows(2).flat_map(|ring| {
        let (s, c) = (0.5 * (ring[0] + ring[1])).sin_cos();
        (0..SECTORS).map(move |k| {
            let (sp, cp) = (TAU * (k as f64 + 0.5) / SECTORS as f64).sin_cos();
            from_mirror(DVec3::new(s * cp, s * sp, c), omega_o)
        })
    });
    let cells: Vec<DVec3> = cells.collect();
    let above: Vec<_> = (0..cells.len()).filter(|&i| cells[i].z > 0.0).collect();
    let pair = |&i: &usize| DirectionPair::new(Direction::from_unit(cells[i]), omega_o);
    let pairs: Vec<_> = above.iter().map(pair).collect();
    let angle = |cell: usize| {
        let ring = cell / SECTORS;
        (edges[ring + 1] - edges[ring]) * TAU / SECTORS as f64
    };
    let mut weights = vec![0.0; cells.len()];
    for brdf in brdfs {
        let n = brdf.channels().count();
        let mut values = vec![0.0; n * pairs.len()];
        let mut presence = vec![Presence::Missing; pairs.len()];
        brdf.eval_batch(&pairs, &mut values, &mut presence);
        for ((&i, f), presence) in above.iter().zip(values.chunks_exact(n)).zip(presence) {
            if presence == Presence::Present {
                weights[i] += brdf.channels().luminance(f) * cells[i].z * angle(i);
            }
        }
    }
    let total: f64 = weights.iter().sum();
    for (i, cell) in cells.iter().enumerate() {
        // Cells that reach over the horizon, for any view that is served by this table.
        if cell.z > -0.2 {
            weights[i] += EVEN * total * angle(i) / TAU;
        }
    }
    Distribution::new(edges, SECTORS, weights)
}

/// The table of a view nearby, about the mirror direction of this one.
struct Lobe<'a> {
    table: &'a Distribution,
    omega_o: Direction,
}

/// From the frame whose pole is the mirror direction, x in the plane of incidence, to the local
/// one; the view has azimuth 0.
fn from_mirror(d: DVec3, omega_o: Direction) -> DVec3 {
    let o = omega_o.vector();
    DVec3::new(o.z * d.x - o.x * d.z, d.y, o.x * d.x + o.z * d.z)
}

/// Back from [`from_mirror`].
fn to_mirror(d: DVec3, omega_o: Direction) -> DVec3 {
    let o = omega_o.vector();
    DVec3::new(o.z * d.x + o.x * d.z, d.y, o.z * d.z - o.x * d.x)
}

/// Shading of pixels, with buffers that a row of pixels shares.
struct Shader<'a, const N: usize> {
    brdfs: [&'a dyn Brdf; N],
    lighting: &'a dyn Lighting,
    light: &'a Distribution,
    pairs: Vec<DirectionPair>,
    /// Direction towards the light in the light's frame, and cos θ_i over twice the mean density.
    towards: Vec<(Direction, f64)>,
    radiance: Vec<[f64; 3]>,
    values: Vec<f64>,
    presence: Vec<Presence>,
    /// True where every BRDF has data.
    known: Vec<bool>,
}

impl<'a, const N: usize> Shader<'a, N> {
    fn new(brdfs: [&'a dyn Brdf; N], lighting: &'a dyn Lighting, light: &'a Distribution) -> Self {
        Self {
            brdfs,
            lighting,
            light,
            pairs: Vec::new(),
            towards: Vec::new(),
            radiance: Vec::new(),
            values: Vec::new(),
            presence: Vec::new(),
            known: Vec::new(),
        }
    }

    /// Radiance of a pixel under each BRDF, and the share of the light from directions where one of
    /// them has no data.
    fn pixel(
        &mut self,
        lobe: &Lobe<'_>,
        frame: &Frame,
        seed: u64,
        points: u64,
    ) -> ([[f64; 3]; N], f64) {
        let omega_o = lobe.omega_o;
        self.pairs.clear();
        self.towards.clear();
        let mut sobol = Sobol::new(seed);
        for i in 0..points {
            let [a, b, u, v] = sobol.point(i);
            let (about, of_lobe) = lobe.table.sample([a, b]);
            let local = from_mirror(about, omega_o);
            if local.z > 0.0 {
                let towards = world(frame.camera(local));
                let of_light = self.light.pdf(towards);
                self.push(local, omega_o, towards, of_lobe + of_light);
            }
            let (towards, of_light) = self.light.sample([u, v]);
            let local = frame.local(from_world(towards));
            if local.z > 0.0 {
                let of_lobe = lobe.table.pdf(to_mirror(local, omega_o));
                self.push(local, omega_o, towards, of_light + of_lobe);
            }
        }
        self.radiance.clear();
        for (towards, weight) in &self.towards {
            let light = self.lighting.radiance(*towards);
            self.radiance
                .push(light.map(|v| v * weight / points as f64));
        }
        let n = self.pairs.len();
        self.known.clear();
        self.known.resize(n, true);
        self.values.clear();
        self.presence.resize(n, Presence::Missing);
        let mut start = 0;
        for brdf in self.brdfs {
            self.presence.fill(Presence::Missing);
            let end = start + brdf.channels().count() * n;
            self.values.resize(end, 0.0);
            brdf.eval_batch(&self.pairs, &mut self.values[start..], &mut self.presence);
            for (known, presence) in self.known.iter_mut().zip(&self.presence) {
                *known &= *presence == Presence::Present;
            }
            start = end;
        }
        let [mut all, mut left_out] = [0.0; 2];
        for (light, known) in self.radiance.iter().zip(&self.known) {
            all += luminance(*light);
            left_out += if *known { 0.0 } else { luminance(*light) };
        }
        let share = if all > 0.0 { left_out / all } else { 0.0 };
        let mut start = 0;
        let reflected = self.brdfs.map(|brdf| {
            let channels = brdf.channels();
            let end = start + channels.count() * n;
            let values = &self.values[start..end];
            start = end;
            self.reflected(values, channels)
        });
        (reflected, share)
    }

    /// What a BRDF of these values makes of the light of a pixel.
    fn reflected(&self, values: &[f64], channels: &Channels) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let values = values.chunks_exact(channels.count());
        let found = self.radiance.iter().zip(values);
        for ((light, f), known) in found.zip(&self.known) {
            if *known {
                let f = channels.rgb(f);
                for channel in 0..3 {
                    sum[channel] += f[channel] * light[channel];
                }
            }
        }
        sum
    }

    /// A direction drawn with a density that is the sum of both tables'.
    fn push(&mut self, local: DVec3, omega_o: Direction, towards: DVec3, density: f64) {
        let omega_i = Direction::from_unit(local);
        self.pairs.push(DirectionPair::new(omega_i, omega_o));
        let towards = Direction::from_unit(towards);
        self.towards.push((towards, local.z / density));
    }
}

/// From the light's frame to the camera's.
fn from_world(v: DVec3) -> DVec3 {
    DVec3::new(v.y, v.z, v.x)
}

#[cfg(test)]
mod tests;
