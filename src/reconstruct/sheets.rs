//! A spline per sheet of constant incidence, and lines of constant half vector between the sheets.
//!
//! Laboratories take readings on a few sheets: the light stands still while the sensor scans. A highlight
//! moves from sheet to sheet, and its half vector stays. So a reading stands at the place of its half
//! vector, θ_h (cos ψ, sin ψ) with ψ its azimuth from that of the light, and each sheet has its own local
//! spline (see [`super::local_spline`]) over these places. A pair takes the values of two sheets at its own
//! place, and of these the one that is linear in ln cos θ_i: between the sheets, and some way past the last.
//! Where the material is reciprocal the pair turned round is another one with another θ_i: both are taken,
//! each with a weight that falls with the distance from its next sheet.
//!
//! If the sensor stood still, light and sensor are exchanged first. Readings that lie in no
//! sheets (less than 90 % of them, or only along lines), and those of materials that are not isotropic, are
//! interpolated by [`ThinPlate`] in half/difference coordinates.

use super::cloud::Cloud;
use super::local_spline::{Local, Scratch};
use super::scattered::ScatteredRule;
use super::transform::{EPSILON, Transform, Values};
use super::{
    Coordinates, Interpolant, Readings, Reconstruct, ReconstructError, ThinPlate, admit,
    check_neighbours,
};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::Warps;
use crate::registry::declare;
use rustc_hash::FxHashSet;

declare! {
    dyn Reconstruct, "sheets": "a spline per sheet of constant incidence, half vectors kept between sheets", [
        "neighbours = 16",
        "values = \"linear\"",
    ]
    /// The splines of sheets, as a config writes them.
    pub struct Sheets {
        /// Function of f_r that is interpolated.
        values: Values = Values::Log;
        /// Offset of the logarithm, sr⁻¹.
        epsilon: f64 = EPSILON;
        /// Number of neighbours in a sheet (readings and their mirror images).
        neighbours: usize = 16;
        /// True to miss readings by their uncertainty of type A, as far as the others ask for it.
        noise: bool = false;
    }
}

/// Fewest neighbours that are asked for: one more than the polynomials of a plane.
const FEWEST_NEIGHBOURS: usize = 4;

/// Incidences of a sheet differ by at most this, rad: 0.3°, what a machine misses.
const WIDTH: f64 = 5e-3;

/// Fewest readings of a sheet.
const FEWEST: usize = 8;

/// Share of the readings that must lie in sheets.
pub const IN_SHEETS: f64 = 0.9;

/// Distance from a sheet within which nothing else counts, rad.
const ON_SHEET: f64 = 1e-9;

/// Longest extrapolation past the first and the last sheet, in steps between the last two.
const REACH: f64 = 1.0;

/// Smallest cosine in [`fall`]: 87°.
const LOWEST: f64 = 0.05;

/// Places nearer to each other than this, rad, are one: a reading and its image.
const SAME: f64 = 1e-8;

/// Sheets nearer to the normal than this, rad: their readings depend on θ_h alone.
const NORMAL: f64 = 1e-6;

impl Reconstruct for Sheets {
    fn label(&self) -> String {
        super::label(KIND, self.values, self.noise, None)
    }

    fn weighs_readings(&self) -> bool {
        self.noise
    }

    // A system of equations.
    fn value_seconds(&self, _readings: usize) -> f64 {
        4e-5
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.values.check(self.epsilon)?;
        check_neighbours(self.neighbours, FEWEST_NEIGHBOURS).map(drop)
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        let symmetry = r.schedule.parametrization.symmetry();
        let transform = self.values.with(self.epsilon);
        admit(KIND, r.count(), usize::MAX)?;
        let r = &Readings {
            noise: r.noise.filter(|_| self.noise),
            ..*r
        };
        let readings = || {
            let poses = r.schedule.poses.iter().enumerate();
            poses.filter_map(|(i, pose)| {
                Some(Reading {
                    pair: pose.pair,
                    values: r.value(i)?,
                    noise: r.relative_noise(i, self.epsilon),
                })
            })
        };
        // The one that stood still is the one with fewer sheets. One side at a time: of many readings each is large.
        let sides = [false, true].into_iter().filter(|_| symmetry.isotropic);
        let found = sides.filter_map(|swapped| {
            let side: Vec<Reading> = match swapped {
                false => readings().collect(),
                true => readings().map(|r| r.swapped()).collect(),
            };
            Some((sheets(&side, r.width, transform, symmetry)?, swapped))
        });
        let found = found.min_by_key(|(sheets, _)| sheets.len());
        let Some((sheets, swapped)) = found else {
            return self.without_sheets().interpolate(r);
        };
        Ok(Box::new(SheetInterpolant {
            sheets,
            swapped,
            reciprocal: symmetry.reciprocal,
            width: r.width,
            transform,
            rule: Local::new(
                check_neighbours(self.neighbours, FEWEST_NEIGHBOURS)?,
                self.values,
            ),
        }))
    }
}

impl Sheets {
    /// What readings that lie in no sheets are interpolated by.
    fn without_sheets(&self) -> ThinPlate {
        ThinPlate {
            values: self.values,
            epsilon: self.epsilon,
            noise: self.noise,
            coordinates: Some(Coordinates {
                kind: "half-difference".into(),
                warp: Warps::default(),
            }),
            ..ThinPlate::default()
        }
    }
}

/// A reading, or the same turned round.
#[derive(Clone, Copy)]
struct Reading<'a> {
    pair: DirectionPair,
    /// f_r, sr⁻¹, one per channel.
    values: &'a [f64],
    /// Type A as a share of the values.
    noise: f64,
}

impl Reading<'_> {
    fn swapped(&self) -> Self {
        Self {
            pair: self.pair.swapped(),
            ..*self
        }
    }
}

/// Readings of one incidence.
struct Sheet {
    /// Incidence, rad.
    theta: f64,
    /// Places of half vectors with transformed values.
    cloud: Cloud<2>,
}

/// Positions in `thetas` (rad) of the readings of each incidence that many share, by incidence.
pub fn incidences(thetas: &[f64]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..thetas.len()).collect();
    order.sort_by(|&a, &b| thetas[a].total_cmp(&thetas[b]).then(a.cmp(&b)));
    let groups = order.chunk_by(|&a, &b| thetas[b] - thetas[a] < WIDTH);
    // A chain of small steps is no sheet.
    let spread = |group: &[usize]| thetas[group[group.len() - 1]] - thetas[group[0]];
    let sheets = groups.filter(|group| group.len() >= FEWEST && spread(group) <= WIDTH);
    sheets.map(<[usize]>::to_vec).collect()
}

/// Readings of which most lie in sheets: light or sensor stood still while the other moved.
pub(crate) struct Still {
    /// True if it was the sensor.
    pub of_sensor: bool,
    /// Numbers of the readings of each sheet, by elevation of what stood still.
    pub sheets: Vec<Vec<usize>>,
}

/// The sheets of constant incidence that most of some pairs lie in, if they do. What stood still is the one with fewer sheets.
pub(crate) fn still(pairs: &[DirectionPair]) -> Option<Still> {
    let side = |of_sensor: bool| {
        let direction = |p: &DirectionPair| if of_sensor { p.omega_o } else { p.omega_i };
        let thetas: Vec<f64> = pairs.iter().map(|p| direction(p).theta()).collect();
        let sheets = incidences(&thetas);
        let taken: usize = sheets.iter().map(Vec::len).sum();
        let most = !sheets.is_empty() && taken as f64 >= IN_SHEETS * pairs.len() as f64;
        most.then_some(Still { of_sensor, sheets })
    };
    let sides = [false, true].into_iter().filter_map(side);
    sides.min_by_key(|still| still.sheets.len())
}

/// Azimuths that differ by less than this, rad, are one: 0.06°.
const SAME_AZIMUTH: f64 = 1e-3;

/// True if most of some pairs lie in the plane of incidence.
pub(crate) fn are_in_plane(pairs: &[DirectionPair]) -> bool {
    let out = |pair: &&DirectionPair| {
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.vector().truncate());
        i.perp_dot(o).abs() > SAME_AZIMUTH
    };
    (pairs.iter().filter(out).count() as f64) < (1.0 - IN_SHEETS) * pairs.len() as f64
}

/// The sheets of some readings by incidence; `None` if most lie in none.
fn sheets(
    readings: &[Reading<'_>],
    width: usize,
    transform: Transform,
    symmetry: Symmetry,
) -> Option<Vec<Sheet>> {
    let thetas: Vec<f64> = readings.iter().map(|r| r.pair.omega_i.theta()).collect();
    let mut sheets = Vec::new();
    let mut taken = 0;
    for group in incidences(&thetas) {
        let mean = group.iter().map(|&i| thetas[i]).sum::<f64>() / group.len() as f64;
        let mut taken_places = FxHashSet::default();
        let own = group.iter().map(|&i| readings[i]);
        // A reading whose other direction is at this incidence too is in the sheet from both sides.
        let turned = readings
            .iter()
            .map(Reading::swapped)
            .filter(|r| symmetry.reciprocal && (r.pair.omega_i.theta() - mean).abs() < 0.5 * WIDTH);
        let (mut points, mut values, mut noise) = (Vec::new(), Vec::new(), Vec::new());
        for reading in own.chain(turned) {
            let [x, y] = place(&reading.pair, mean);
            let mirrored = if mean < NORMAL { [-x, y] } else { [x, -y] };
            let both = symmetry.bilateral || mean < NORMAL;
            for place in [[x, y], mirrored].into_iter().take(1 + usize::from(both)) {
                if taken_places.insert(place.map(|c| (c / SAME).round() as i64)) {
                    points.push(place);
                    values.extend(reading.values.iter().map(|&f| transform.forward(f)));
                    noise.push(reading.noise);
                }
            }
        }
        let cloud = Cloud::new(points, values, width, noise);
        // A scan along a line is no sheet.
        if mean >= NORMAL && cloud.is_in_sheets() {
            continue;
        }
        taken += group.len();
        sheets.push(Sheet { theta: mean, cloud });
    }
    (taken as f64 >= IN_SHEETS * readings.len() as f64 && taken > 0).then_some(sheets)
}

/// −ln cos θ: what values are linear in from sheet to sheet. With the half vector kept, f_r varies with
/// the cosines of both directions, as a factor and most towards grazing.
fn fall(theta: f64) -> f64 {
    -theta.cos().max(LOWEST).ln()
}

/// Place of the half vector of a pair on the sheet of incidence `theta`, rad.
fn place(pair: &DirectionPair, theta: f64) -> [f64; 2] {
    let light = pair.omega_i.vector();
    let h = light + pair.omega_o.vector();
    let across = h.truncate().length();
    let polar = across.atan2(h.z);
    let towards = light.truncate();
    if theta < NORMAL || across == 0.0 || towards.length() == 0.0 {
        return [polar, 0.0];
    }
    let scale = polar / (across * towards.length());
    let [cos, sin] = [h.truncate().dot(towards), towards.perp_dot(h.truncate())];
    [scale * cos, scale * sin]
}

struct SheetInterpolant {
    sheets: Vec<Sheet>,
    /// True if it was the sensor that stood still.
    swapped: bool,
    reciprocal: bool,
    width: usize,
    transform: Transform,
    rule: Local,
}

impl SheetInterpolant {
    /// Adds the weighted value of a pair whose first direction is that of the sheets; returns the weight.
    /// `values` is a buffer.
    fn add(
        &self,
        pair: &DirectionPair,
        scratch: &mut Box<Scratch<2>>,
        values: &mut [Vec<f64>; 2],
        out: &mut [f64],
    ) -> f64 {
        let theta = pair.omega_i.theta();
        let above = self.sheets.partition_point(|s| s.theta < theta);
        let last = self.sheets.len() - 1;
        let high = above.clamp(last.min(1), last);
        let low = high.saturating_sub(1);
        let [a, b] = [self.sheets[low].theta, self.sheets[high].theta];
        let width = fall(b) - fall(a);
        // Past the lowest cosine sheets are alike.
        let t = if width > 0.0 {
            (fall(theta) - fall(a)) / width
        } else {
            0.0
        };
        let t = t.clamp(-REACH, 1.0 + REACH);
        let distance = (theta - a).abs().min((theta - b).abs());
        let weight = distance.max(ON_SHEET).powi(-2);
        let [on_low, on_high] = values;
        let mut on = |sheet: &Sheet, value: &mut [f64]| {
            let x = place(pair, sheet.theta);
            self.rule.interpolate(&sheet.cloud, &[x], scratch, value);
        };
        on(&self.sheets[low], on_low);
        if t == 0.0 {
            on_high.copy_from_slice(on_low);
        } else {
            on(&self.sheets[high], on_high);
        }
        for ((out, &a), &b) in out.iter_mut().zip(&*on_low).zip(&*on_high) {
            let y = a + t * (b - a);
            *out += weight * y.min(a.max(b) + self.rule.above);
        }
        weight
    }
}

impl Interpolant for SheetInterpolant {
    fn width(&self) -> usize {
        self.width
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let mut scratch = Box::default();
        let mut values = [(); 2].map(|()| vec![0.0; self.width]);
        out.fill(0.0);
        let places = pairs.iter().zip(out.chunks_exact_mut(self.width));
        for (pair, out) in places.filter(|(pair, _)| pair.is_above_horizon()) {
            let mut total = 0.0;
            for swapped in [false, true] {
                if swapped == self.swapped || self.reciprocal {
                    let pair = if swapped { pair.swapped() } else { *pair };
                    total += self.add(&pair, &mut scratch, &mut values, out);
                }
            }
            for y in out {
                *y = self.transform.inverse(*y / total);
            }
        }
    }
}
