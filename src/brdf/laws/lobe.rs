//! The half vectors of one view, about the peak of its lobe.
//!
//! dω_i = 4 (v·h) dω_h,   ω_i = 2 (v·h) h − v,   v = ω_o.
//!
//! Over half vectors in polar coordinates (θ, φ) about the normal, φ counted from the azimuth of v,
//! a mirror-like peak sits at θ = 0 for every view, however stretched it is over ω_i. ω_i is above
//! the horizon for θ < θ_m(φ), where
//!
//! tan 2θ_m = −cot θ_o / cos φ,   2 θ_m in (0, π),
//!
//! so that with s = θ/θ_m in [0, 1] the hemisphere is a rectangle. With v = (−x, −y, z) of ω_o the
//! peak at θ = 0 is that towards the sensor. Anisotropic lobes are ridges along the meridians of the
//! tangent axes.

use crate::brdf::{Brdf, Presence};
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::cut;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A view, and the peak its half vectors are about.
pub(super) struct Lobe<'a> {
    pub(super) brdf: &'a dyn Brdf,
    omega_o: Direction,
    /// The direction that h mirrors the light to.
    view: DVec3,
    /// Azimuths, counted from that of the view, that lobes are stretched along or the horizon bends
    /// at; from 0 to 2π.
    meridians: Vec<f64>,
}

/// Half vectors of one azimuth.
pub(super) struct Meridian {
    omega_o: Direction,
    view: DVec3,
    /// Cosine and sine of the azimuth.
    along: [f64; 2],
    /// θ_m at this azimuth, rad.
    end: f64,
}

impl Meridian {
    /// The pair at s, and cos θ_i dω_i / (ds dφ).
    pub(super) fn pair_and_weight(&self, s: f64) -> (DirectionPair, f64) {
        let (sin, cos) = (s * self.end).sin_cos();
        let h = DVec3::new(sin * self.along[0], sin * self.along[1], cos);
        let cos_d = self.view.dot(h);
        let omega_i = Direction::from_unit(2.0 * cos_d * h - self.view);
        let weight = self.end * sin * 4.0 * cos_d * omega_i.cos_theta().max(0.0);
        (DirectionPair::new(omega_i, self.omega_o), weight)
    }
}

/// Number of scales 2^−k that are tried along s and across meridians.
const SCALES: i32 = 36;

/// Ratio of the widths of neighbouring cells.
const GROWTH: f64 = 4.0;

/// Distance below which two ends of cells are one.
const NEAR: f64 = 1e-9;

/// `from`, and steps away from it up to `to`, the first `first` wide: cells that are wide against
/// their distance are none.
fn graded(from: f64, to: f64, first: f64) -> impl Iterator<Item = f64> {
    let length = (to - from).abs();
    let steps = std::iter::successors(Some(first), |w| Some(w * GROWTH));
    let steps = steps.take_while(move |w| *w * 1.5 < length);
    steps.map(move |w| from + w.copysign(to - from))
}

/// All ends in ascending order, without those of `more` that lie near others.
fn merged(mut ends: Vec<f64>, more: impl Iterator<Item = f64>) -> Vec<f64> {
    for x in more {
        if ends.iter().all(|end| (end - x).abs() > NEAR) {
            ends.push(x);
        }
    }
    ends.sort_by(f64::total_cmp);
    ends
}

impl<'a> Lobe<'a> {
    /// The half vectors about the mirror direction, or about the view itself.
    pub(super) fn new(brdf: &'a dyn Brdf, omega_o: Direction, retro: bool) -> Self {
        let turn = if retro { -1.0 } else { 1.0 };
        let view = omega_o.vector() * DVec3::new(turn, turn, 1.0);
        let quarters = |from: f64| (0..4).map(move |k| from + FRAC_PI_2 * f64::from(k));
        let mut meridians: Vec<f64> = quarters(0.0).chain([TAU]).collect();
        if !brdf.symmetry().isotropic {
            let axis = (-Direction::from_unit(view).phi()).rem_euclid(FRAC_PI_2);
            meridians = merged(meridians, quarters(axis));
        }
        Self {
            brdf,
            omega_o,
            view,
            meridians,
        }
    }

    pub(super) fn meridian(&self, phi: f64) -> Meridian {
        let (s, c) = phi.sin_cos();
        let sin = self.view.x.hypot(self.view.y);
        let [x, y] = if sin > 0.0 {
            [self.view.x / sin, self.view.y / sin]
        } else {
            [1.0, 0.0]
        };
        Meridian {
            omega_o: self.omega_o,
            view: self.view,
            along: [x * c - y * s, y * c + x * s],
            end: 0.5 * self.view.z.atan2(-c * sin),
        }
    }

    /// Luminances at points (s, φ); 0 without data.
    fn luminances(&self, points: &[[f64; 2]]) -> Vec<f64> {
        let pairs = points
            .iter()
            .map(|[s, phi]| self.meridian(*phi).pair_and_weight(*s).0);
        let pairs: Vec<_> = pairs.collect();
        let channels = self.brdf.channels();
        let (values, presence) = self.brdf.values(&pairs);
        let values = values.chunks_exact(channels.count()).zip(presence);
        values
            .map(|(values, presence)| match presence {
                Presence::Present => channels.luminance(values),
                Presence::Missing => 0.0,
            })
            .collect()
    }

    /// Luminance at the peak.
    pub(super) fn top(&self) -> f64 {
        self.luminances(&[[0.0, 0.0]])[0]
    }

    /// The smallest distances from a point, along each of the directions in (s, φ), at which the
    /// luminance is less than half of what it is at the point; infinite if it does not fall before
    /// the horizon.
    fn half_widths(&self, point: [f64; 2], directions: &[[f64; 2]]) -> Vec<f64> {
        let scale = |k: i32| f64::powi(2.0, -k);
        let mut points = vec![point];
        for [s, phi] in directions {
            points.extend((1..=SCALES).map(|k| {
                let on = [point[0] + scale(k) * s, point[1] + scale(k) * phi];
                if (0.0..1.0).contains(&on[0]) {
                    on
                } else {
                    point
                }
            }));
        }
        let values = self.luminances(&points);
        let falls = values[1..].chunks_exact(SCALES as usize).map(|around| {
            let below = (1..).zip(around).filter(|(_, v)| **v < 0.5 * values[0]);
            below.map(|(k, _)| scale(k)).fold(f64::INFINITY, f64::min)
        });
        falls.collect()
    }

    /// A possible second peak: its s on the meridian φ = 0, and its widths along s and φ; `None`
    /// without one.
    pub(super) fn second_peak(&self) -> Option<[f64; 3]> {
        let s = self.omega_o.theta() / self.meridian(0.0).end;
        // At the normal both are one; on the horizon nothing is seen of it.
        if !(NEAR..1.0 - NEAR).contains(&s) {
            return None;
        }
        let directions = [[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let widths = self.half_widths([s, 0.0], &directions);
        // The flank of the other peak falls on one side only.
        let [s_width, phi_width] = [widths[0].max(widths[1]), widths[2].max(widths[3])];
        (s_width < f64::INFINITY).then_some([s, widths[0].min(widths[1]), phi_width])
    }

    /// Ranges of s and φ that cover the hemisphere.
    pub(super) fn mesh(&self) -> Vec<[[f64; 2]; 2]> {
        let second = self.second_peak();
        let along = |phi: &f64| self.half_widths([0.0, *phi], &[[1.0, 0.0]])[0];
        let width = self.meridians.iter().map(along).fold(1.0, f64::min);
        let mut ends = vec![0.0, 1.0];
        ends.extend(second.map(|[s, ..]| s));
        // Seen at grazing, light changes sides with the view within its cosine of the horizon.
        let horizon = graded(1.0, 0.5, self.view.z);
        let ends = merged(ends, graded(0.0, 1.0, width).chain(horizon));
        let mut cells = Vec::new();
        for s in ends.windows(2) {
            for phi in self.sectors(0.5 * (s[0] + s[1])).windows(2) {
                cells.push([[s[0], s[1]], [phi[0], phi[1]]]);
            }
        }
        if let Some([s, s_width, phi_width]) = second {
            cells = cells
                .into_iter()
                .flat_map(|cell| towards(cell, s, [s_width, phi_width]))
                .collect();
        }
        cells
    }

    /// Ends of ranges of φ from 0 to 2π, which shrink towards meridians that values fall off beside
    /// at `s`.
    fn sectors(&self, s: f64) -> Vec<f64> {
        let widths = self.meridians.iter().map(|phi| {
            let widths = self.half_widths([s, *phi], &[[0.0, -1.0], [0.0, 1.0]]);
            // The horizon of a grazing view turns within its cosine where the meridian is across.
            let most = if phi.cos().abs() < 1e-9 {
                self.view.z
            } else {
                f64::INFINITY
            };
            [widths[0].min(most), widths[1].min(most)]
        });
        let widths: Vec<[f64; 2]> = widths.collect();
        let sectors = self.meridians.windows(2).zip(widths.windows(2));
        let more = sectors.flat_map(|(at, width)| {
            let middle = 0.5 * (at[0] + at[1]);
            graded(at[0], middle, width[0][1]).chain(graded(at[1], middle, width[1][0]))
        });
        merged(self.meridians.clone(), more)
    }
}

/// The parts of a cell with the peak at (s, 0) or (s, 2π) at a corner, which shrink towards it in
/// step, each axis against its own width; any other cell as it is.
fn towards(cell: [[f64; 2]; 2], s: f64, widths: [f64; 2]) -> Vec<[[f64; 2]; 2]> {
    let at_corner =
        |cell: &[[f64; 2]; 2]| cell[0].contains(&s) && (cell[1][0] == 0.0 || cell[1][1] == TAU);
    let (mut done, mut stack) = (Vec::new(), vec![cell]);
    while let Some(cell) = stack.pop() {
        let ratio = [0, 1].map(|a| (cell[a][1] - cell[a][0]) / widths[a]);
        let largest = ratio[0].max(ratio[1]);
        if !at_corner(&cell) || largest <= 2.0 {
            done.push(cell);
            continue;
        }
        let mut parts = vec![cell];
        for a in 0..2 {
            let [lo, hi] = cell[a];
            let from_start = if a == 0 { lo == s } else { lo == 0.0 };
            if ratio[a] > 2.0 && GROWTH * ratio[a] > largest {
                let step = widths[a].max((hi - lo) / GROWTH);
                let at = if from_start { lo + step } else { hi - step };
                parts = parts
                    .into_iter()
                    .flat_map(|part| cut(part, a, at))
                    .collect();
            }
        }
        stack.extend(parts);
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Channels;

    /// Every example of every model that needs no file, from views down to the horizon.
    #[test]
    fn cells_cover_the_hemisphere_once() {
        for entry in crate::brdf::all() {
            for text in entry.examples {
                let spec = crate::registry::read_text(&entry, text).unwrap();
                let Ok(brdf) = spec.build(Channels::Luminance) else {
                    continue;
                };
                for theta_o in [0.0, 1e-12, 0.3, 1.4, FRAC_PI_2 - 1e-6, FRAC_PI_2 - 1e-13] {
                    let omega_o = Direction::from_spherical(theta_o, 0.2);
                    for retro in [false, true] {
                        let lobe = Lobe::new(&*brdf, omega_o, retro);
                        let mesh = lobe.mesh();
                        let area = |[s, phi]: &[[f64; 2]; 2]| (s[1] - s[0]) * (phi[1] - phi[0]);
                        let total: f64 = mesh.iter().map(area).sum();
                        assert!((total / TAU - 1.0).abs() < 1e-12, "{total}");
                        assert!(mesh.iter().all(|cell| area(cell) > 0.0));
                        let inside =
                            |range: &[f64; 2], most: f64| range[0] >= 0.0 && range[1] <= most;
                        assert!(
                            mesh.iter()
                                .all(|[s, phi]| inside(s, 1.0) && inside(phi, TAU))
                        );
                        // The rectangle ends at the horizon.
                        for phi in [0.1, 1.5, 3.0, 4.8] {
                            let (pair, _) = lobe.meridian(phi).pair_and_weight(1.0);
                            assert!(pair.omega_i.cos_theta().abs() < 1e-15);
                        }
                    }
                }
            }
        }
    }
}
