//! Any BRDF as an RGL file.
//!
//! The distribution of normals D is read off the BRDF: f_r · 4 cos θ_i cos θ_o, averaged over theta_d =
//! [`PROFILE_DEG`] at phi_d = 90°, where neither retro-reflection nor grazing dominates. It only places nodes: values
//! are divided by the very function that the reader multiplies. Nodes are denser by the root of the visible normals,
//! D max(0, m·ω_i), and nowhere sparse: in proportion to them, a needle on a matte base would leave the base no nodes.
//!
//! Nodes below the horizon hold 0, and those without data hold the value of their neighbour: the format has neither
//! numbers below 0 nor holes.

use super::super::TableError;
use super::file::{Colours, Fields};
use super::warp::{Densities, Grids, Weighted};
use super::{jacobian, theta_of, u_of};
use crate::brdf::{Brdf, Presence};
use crate::geometry::{Direction, DirectionPair};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Differences of elevation (degrees) of the profile.
const PROFILE_DEG: [f64; 4] = [10.0, 20.0, 30.0, 40.0];

/// Nodes of distributions along each axis.
const NORMALS: usize = 128;

/// Nodes of distributions along φ of an isotropic table.
const NORMALS_OF_ISOTROPIC: usize = 2;

/// Share of a uniform density among the normals and the visible ones: values are divided by the former, and must not vary
/// where the latter leave few nodes.
const UNIFORM: f64 = 1e-2;

/// Density by which that of every (u, v) is raised, as a share of the mean. That of the visible normals falls with u³ at
/// the normal, where a cell of nodes would reach ten degrees.
const RAISED: f64 = 0.3;

/// Smallest density of samples, as a share of the mean.
const LEAST_SAMPLES: f64 = 1e-3;

/// The last elevation of the light, degrees.
const LAST_DEG: f64 = 89.9;

/// Azimuths of the sensor at which data is looked for.
const LOOKS: usize = 12;

/// Steps of the search for the last elevation that has data: to 1e-7 rad.
const BISECTIONS: usize = 24;

/// Nodes along each axis of the grid of an incidence, elevations of the light, and its azimuths over the whole circle if the
/// BRDF is not isotropic.
pub type Level = [usize; 3];

/// Those that a tolerance chooses from, the usual one first.
pub const LEVELS: [Level; 3] = [[64, 32, 25], [128, 64, 33], [256, 128, 49]];

/// The error of a BRDF without any value above 0, which has no distribution of normals.
fn black() -> TableError {
    TableError::NoData("an RGL table holds no BRDF that is 0, or not known, everywhere".into())
}

/// The luminance of a pair, `None` without data.
fn luminance(brdf: &dyn Brdf, pair: &DirectionPair) -> Option<f64> {
    brdf.luminance(pair).filter(|v| v.is_finite())
}

/// Elevation and azimuth of a node of a distribution of so many rows.
fn node(i: usize, rows: usize) -> [f64; 2] {
    let (row, column) = (i / NORMALS, i % NORMALS);
    let phi = TAU * row as f64 / (rows - 1) as f64 - PI;
    [theta_of(column as f64 / (NORMALS - 1) as f64), phi]
}

/// The distribution of normals of a BRDF.
fn normals(brdf: &dyn Brdf) -> Result<Grids, TableError> {
    let rows = match brdf.symmetry().isotropic {
        true => NORMALS_OF_ISOTROPIC,
        false => NORMALS,
    };
    let profile = |i: usize| {
        let [theta_h, phi_h] = node(i, rows);
        let h = Direction::from_spherical(theta_h, phi_h).vector();
        // Across the plane of normal and half vector.
        let across = DVec3::new(-phi_h.sin(), phi_h.cos(), 0.0);
        let pairs = PROFILE_DEG.map(|deg| {
            let (sin, cos) = deg.to_radians().sin_cos();
            let towards = |side: f64| Direction::from_unit(cos * h + side * sin * across);
            DirectionPair::new(towards(1.0), towards(-1.0))
        });
        let known = pairs.iter().filter(|p| p.is_above_horizon());
        let known = known.filter_map(|p| {
            Some(luminance(brdf, p)? * 4.0 * p.omega_i.cos_theta() * p.omega_o.cos_theta())
        });
        let known: Vec<f64> = known.collect();
        known.iter().sum::<f64>() / known.len().max(1) as f64
    };
    let found: Vec<f64> = (0..rows * NORMALS).into_par_iter().map(profile).collect();
    let largest = found.iter().copied().fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return Err(black());
    }
    // Projected onto the surface they have area 1, and uniform ones 1 / 2π a steradian.
    let projected = |(i, d): (usize, &f64)| {
        let u = (i % NORMALS) as f64 / (NORMALS - 1) as f64;
        let (sin, cos) = node(i, rows)[0].sin_cos();
        d * cos * jacobian(u, sin)
    };
    let area: f64 = found.iter().enumerate().map(projected).sum();
    let area = area / found.len() as f64;
    let density = |d: &f64| (d / area).max(UNIFORM / TAU) as f32;
    Ok(Grids {
        size: [NORMALS, rows],
        values: found.iter().map(density).collect(),
    })
}

impl Grids {
    /// Projected area of a micro-surface of these normals towards a direction: ∫ D(m) max(0, m·ω) dω_m, by midpoints.
    fn area(&self, towards: DVec3) -> f64 {
        const STEPS: usize = 2 * NORMALS;
        let step = 1.0 / STEPS as f64;
        let mut sum = 0.0;
        for i in 0..STEPS {
            let u = (i as f64 + 0.5) * step;
            let (sin, cos) = theta_of(u).sin_cos();
            for j in 0..STEPS {
                let v = (j as f64 + 0.5) * step;
                let (s, c) = (TAU * v - PI).sin_cos();
                let facing = towards.dot(DVec3::new(sin * c, sin * s, cos)).max(0.0);
                sum += self.one([u, v]) * facing * jacobian(u, sin);
            }
        }
        sum * step * step
    }

    /// The area for every elevation, and the azimuths of some rows, of which `own` differ.
    fn areas(&self, rows: usize, own: usize) -> Grids {
        let area = |i: usize| {
            let [theta, phi] = node(i, rows);
            self.area(Direction::from_spherical(theta, phi).vector()) as f32
        };
        let values: Vec<f32> = (0..own * NORMALS).into_par_iter().map(area).collect();
        Grids {
            size: [NORMALS, rows],
            values: values.repeat(rows / own),
        }
    }

    /// Density of nodes of the grids of a light, up to a factor.
    fn visible(&self, light: DVec3) -> Vec<f32> {
        let step = 1.0 / (NORMALS - 1) as f64;
        let nodes = (0..NORMALS * NORMALS).map(|i| {
            let [u, v] = [i % NORMALS, i / NORMALS].map(|k| k as f64 * step);
            let m = normal([u, v]);
            let j = jacobian(u, theta_of(u).sin());
            [self.one([u, v]) * light.dot(m).max(0.0) * j, j]
        });
        let nodes: Vec<[f64; 2]> = nodes.collect();
        let means = [0, 1].map(|k| nodes.iter().map(|n| n[k]).sum::<f64>() / nodes.len() as f64);
        let density = |[visible, j]: &[f64; 2]| {
            RAISED + (visible / means[0]).sqrt().max(UNIFORM * j / means[1])
        };
        nodes.iter().map(|n| density(n) as f32).collect()
    }
}

/// The direction at (u, v).
fn normal([u, v]: [f64; 2]) -> DVec3 {
    Direction::from_spherical(theta_of(u), TAU * v - PI).vector()
}

/// Tabulates a BRDF. R, G and B of one in luminance are equal. Also returns the number of nodes above the horizon without
/// data, which are filled.
///
/// # Errors
/// [`TableError::NoData`] of one that is 0, or not known, everywhere.
pub fn tabulate(
    brdf: &dyn Brdf,
    [nodes, elevations, azimuths]: Level,
) -> Result<(Fields, usize), TableError> {
    let ndf = normals(brdf)?;
    let is_isotropic = brdf.symmetry().isotropic;
    let steps = |from: f64, to: f64, count: usize| -> Vec<f32> {
        let at = |i: usize| from + (to - from) * i as f64 / (count - 1) as f64;
        (0..count).map(|i| at(i) as f32).collect()
    };
    let theta_i = steps(0.0, last_light(brdf), elevations);
    // An isotropic surface is the same from every azimuth.
    let (phi_i, rows, own) = match is_isotropic {
        true => (vec![0.0], NORMALS_OF_ISOTROPIC, 1),
        false => (steps(-PI, PI, azimuths), azimuths, azimuths),
    };
    let colours = match brdf.channels().wavelengths() {
        Some(w) => Colours::Wavelengths(w.nm().iter().map(|nm| *nm as f32).collect()),
        None => Colours::Rgb,
    };
    if let Colours::Wavelengths(nm) = &colours
        && !nm.is_sorted_by(|a, b| a < b)
    {
        let what = "would hold two that are one in single precision";
        return Err(TableError::field("wavelengths", what));
    }
    let light = |i: usize| {
        let [phi, theta] = [phi_i[i / theta_i.len()], theta_i[i % theta_i.len()]].map(f64::from);
        Direction::from_spherical(theta, phi)
    };
    let incidences = 0..phi_i.len() * theta_i.len();
    let sigma = ndf.areas(rows, own);
    let visible = incidences.clone().into_par_iter();
    let visible = visible.map(|i| ndf.visible(light(i).vector()));
    let visible: Vec<Vec<f32>> = visible.collect();
    let vndf = Grids {
        size: [NORMALS; 2],
        values: visible.concat(),
    };
    let densities = Densities::new(vndf.clone()).ok_or_else(black)?;
    let grids = incidences.into_par_iter().map(|i| {
        let incidence = Incidence {
            brdf,
            ndf: &ndf,
            densities: &densities,
            grid: i,
            light: light(i),
            area: sigma.one([
                u_of(light(i).theta()),
                (f64::from(phi_i[i / theta_i.len()]) + PI) / TAU,
            ]),
            nodes,
            colours: colours.count(),
        };
        incidence.grids(is_isotropic && theta_i[i % theta_i.len()] == 0.0)
    });
    let (grids, lost): (Vec<_>, Vec<usize>) = grids.unzip();
    // An incidence without data is that of the next elevation, or azimuth, that has some.
    let known: Vec<usize> = (0..grids.len()).filter(|i| grids[*i].is_some()).collect();
    let step = theta_i.len();
    let way =
        |a: usize, b: usize| step * (a / step).abs_diff(b / step) + (a % step).abs_diff(b % step);
    let mut held = Vec::new();
    for i in 0..grids.len() {
        let nearest = known.iter().min_by_key(|k| way(**k, i));
        held.extend(nearest.and_then(|k| grids[*k].as_ref()));
    }
    if held.is_empty() {
        return Err(black());
    }
    let all = |k: usize| Grids {
        size: [nodes; 2],
        values: held.iter().flat_map(|g| &g[k]).copied().collect(),
    };
    let fields = Fields {
        description: concat!("tabulated by gonio ", env!("CARGO_PKG_VERSION")).into(),
        jacobian: true,
        ndf,
        values: all(0),
        luminance: all(1),
        theta_i,
        phi_i,
        sigma,
        vndf,
        colours,
    };
    Ok((fields, lost.iter().sum()))
}

/// The last elevation of the light (rad) at which a BRDF has data, at most [`LAST_DEG`]: tables end before the horizon,
/// and nothing is made up beyond.
fn last_light(brdf: &dyn Brdf) -> f64 {
    let has_data = |theta: f64| {
        let mut pairs = (0..LOOKS).flat_map(|k| {
            let phi = TAU * k as f64 / LOOKS as f64;
            let light = Direction::from_spherical(theta, 0.3 * phi);
            let at = |deg: f64| Direction::from_spherical(deg.to_radians(), phi);
            PROFILE_DEG.map(|deg| DirectionPair::new(light, at(deg)))
        });
        pairs.any(|pair| luminance(brdf, &pair).is_some())
    };
    let whole = LAST_DEG.to_radians();
    if has_data(whole) {
        return whole;
    }
    let (mut known, mut unknown) = (0.0, whole);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (known + unknown);
        match has_data(middle) {
            true => known = middle,
            false => unknown = middle,
        }
    }
    // The node is in single precision, and must not round beyond.
    match known > 0.0 {
        true => known * (1.0 - 1e-6),
        false => whole,
    }
}

/// Pairs that [`tabulate`] evaluates of a BRDF that has data towards the horizon.
pub fn table_pairs(brdf: &dyn Brdf, [nodes, elevations, azimuths]: Level) -> u64 {
    let (rows, azimuths) = match brdf.symmetry().isotropic {
        true => (NORMALS_OF_ISOTROPIC, 1),
        false => (NORMALS, azimuths),
    };
    // And one towards the horizon.
    let profile = rows * NORMALS * PROFILE_DEG.len() + 1;
    (profile + azimuths * elevations * nodes.pow(2)) as u64
}

/// One incidence of a table.
struct Incidence<'a> {
    brdf: &'a dyn Brdf,
    ndf: &'a Grids,
    densities: &'a Densities,
    /// Its number among the densities.
    grid: usize,
    light: Direction,
    /// Projected area towards the light.
    area: f64,
    nodes: usize,
    colours: usize,
}

impl Incidence<'_> {
    /// The grids of values, colour after colour, and that of the density of samples; `None` without data; and the number of nodes above the horizon without data. At normal
    /// incidence of an isotropic surface nothing depends on the azimuth: `average` takes the mean over it.
    fn grids(&self, average: bool) -> (Option<[Vec<f32>; 2]>, usize) {
        let brdf = self.brdf;
        let (n, channels) = (self.nodes, brdf.channels().count());
        let own = Weighted::from_elem((self.grid, 1.0), 1);
        let step = 1.0 / (n - 1) as f64;
        let light = self.light.vector();
        let (mut pairs, mut factors) = (Vec::with_capacity(n * n), Vec::with_capacity(n * n));
        for i in 0..n * n {
            let place = [i % n, i / n].map(|k| k as f64 * step);
            let place = self.densities.place(self.grid, place);
            let m = normal(place);
            let facing = light.dot(m);
            let sensor = 2.0 * facing * m - light;
            let sensor = Direction::try_new(sensor).unwrap_or(Direction::NORMAL);
            let (_, density) = self.densities.uniform(&own, place);
            let j = jacobian(place[0], theta_of(place[0]).sin());
            pairs.push(DirectionPair::new(self.light, sensor));
            // Those of values and of the density of samples; 0 below the horizon.
            let cosine = match facing > 0.0 {
                true => sensor.cos_theta().max(0.0),
                false => 0.0,
            };
            let value = cosine * 4.0 * self.area / self.ndf.one(place);
            factors.push([value, cosine * 4.0 * facing * j / density]);
        }
        let (found, presence) = brdf.values(&pairs);
        let of = |i: usize| &found[channels * i..channels * (i + 1)];
        let is_seen = |i: &usize| factors[*i][0] > 0.0;
        let has_data =
            |i: usize| presence[i] == Presence::Present && of(i).iter().all(|v| v.is_finite());
        let lost = (0..n * n).filter(is_seen).filter(|i| !has_data(*i));
        let lost = lost.count();
        let Some(sources) = sources(n, &|i| is_seen(&i) && has_data(i)) else {
            return (None, lost);
        };
        let mut values = vec![0.0; self.colours * n * n];
        let mut samples = vec![0.0; n * n];
        for (i, (&source, [value, sample])) in sources.iter().zip(&factors).enumerate() {
            samples[i] = brdf.channels().luminance(of(source)) * sample;
            for (c, slot) in values.iter_mut().skip(i).step_by(n * n).enumerate() {
                *slot = of(source)[c.min(channels - 1)] * value;
            }
        }
        if average {
            let grids = values.chunks_exact_mut(n * n);
            let grids = grids.chain([&mut samples[..]]);
            grids.for_each(|grid| flatten(grid, n));
        }
        let mean = samples.iter().sum::<f64>() / (n * n) as f64;
        let least = match mean > 0.0 {
            true => LEAST_SAMPLES * mean,
            false => 1.0,
        };
        let single = |v: f64| v.min(f64::from(f32::MAX)) as f32;
        let grids = [
            values.into_iter().map(single).collect(),
            samples.into_iter().map(|s| single(s.max(least))).collect(),
        ];
        (Some(grids), lost)
    }
}

/// For each node of a grid that whose f_r it has: its own if that is known, else that of the nearest in its row, else of
/// the nearest row that has one; `None` if no node is known.
fn sources(n: usize, is_known: &dyn Fn(usize) -> bool) -> Option<Vec<usize>> {
    let rows: Vec<Vec<usize>> = (0..n)
        .map(|row| (n * row..n * (row + 1)).filter(|i| is_known(*i)).collect())
        .collect();
    let known: Vec<usize> = (0..n).filter(|row| !rows[*row].is_empty()).collect();
    let nearest = |i: usize| {
        let row = known.iter().min_by_key(|row| row.abs_diff(i / n))?;
        let nodes = rows[*row].iter().copied();
        nodes.min_by_key(|k| (k % n).abs_diff(i % n))
    };
    (0..n * n).map(nearest).collect()
}

/// Gives every row the mean of all.
fn flatten(grid: &mut [f64], n: usize) {
    for column in 0..n {
        let mean = grid.iter().skip(column).step_by(n).sum::<f64>() / n as f64;
        let column = grid.iter_mut().skip(column).step_by(n);
        column.for_each(|v| *v = mean);
    }
}
