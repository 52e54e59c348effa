//! Poses after a scan of the retro-reflection, as Dupuy & Jakob (2018) place them: "An adaptive parameterization for
//! efficient material acquisition and rendering".
//!
//! A scan reads f_r(ω, ω) at several elevations. Of a microfacet model it is F D(ω) / (4 cos θ σ(ω)), where
//! σ(ω) = ∫ D(h) ⟨ω, h⟩ dh is the area of the facets that are seen; so D is the eigenvector of
//! D(ω) ∝ f_r(ω, ω) cos θ ∫ D(h) ⟨ω, h⟩ dh, which power iteration finds (Dupuy et al. 2015, "Extracting
//! microfacet-based BRDF parameters from arbitrary materials with power iterations"). Here D is isotropic.
//! Further views ω_o have elevations that are dense near the normal; to each belong half vectors with the density of the
//! normals that are seen, D(h) ⟨ω_o, h⟩ / σ(ω_o), and the light is where these reflect the view. Theirs are grids of
//! (u_1, u_2) that are mapped to those, ends and all, of thousands of poses, with an interpolant of their own; these are
//! points of a Sobol set, so that there are as many as are asked for. Before the scan is read all normals are alike.
//! Poses beyond 80°, or that cannot be taken, are left out for others.

use super::field::{MASK, MOST, Reach, admit, filled, is_inside, luminances};
use super::{Chosen, Planner, Task};
use crate::error::{ParameterError, in_closed};
use crate::geometry::{Direction, DirectionPair};
use crate::measurement::Measurement;
use crate::numeric::{hashed, last_where};
use crate::parametrization::Axis;
use crate::reconstruct::Transform;
use crate::registry::declare;
use crate::sampling::{Random, Sobol};
use crate::schedule::{Pose, SampleSet};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Readings of a scan: at least, at most, and of so many poses one.
const SCAN: (usize, usize, usize) = (4, 90, 8);

/// Readings are of the scan if their separation exceeds the least by no more than this, rad.
const OF_SCAN: f64 = PI / 180.0;

/// Steps by which a scan is widened until a machine takes it, rad, and their number.
const WIDER: (f64, usize) = (PI / 180.0, 60);

/// Elevations of facets.
const FACETS: usize = 512;

/// Steps of a power iteration, after which D does not change any more.
const STEPS: usize = 30;

/// Points that are tried for each pose, at most.
const PATIENCE: usize = 64;

declare! {
    dyn Planner, "dupuy-jakob": "a retro-reflective scan, then poses by the normals that it shows (Dupuy & Jakob 2018)", [
        "",
        "separation_deg = 4",
    ]
    /// Poses by the normals that a retro-reflective scan shows, as a config writes it.
    pub struct Retro {
        /// Angle between light and sensor during the scan, degrees in [0, 60]; more where the machine of a task needs it.
        /// What is read is taken for retro-reflection at the half vector.
        separation_deg: f64 = 0.0;
    }
}

/// An isotropic distribution of normals.
struct Facets {
    /// D at elevations of equal steps of their roots, at the middle of each step; its largest is 1.
    density: Vec<f64>,
}

/// Elevation of facet `i`, rad, and the part of it in an integral over elevations.
fn elevation(i: usize) -> (f64, f64) {
    let u = (i as f64 + 0.5) / FACETS as f64;
    (FRAC_PI_2 * u * u, FRAC_PI_2 * 2.0 * u / FACETS as f64)
}

/// Of a + b cos φ, cosine between a direction and facets at two elevations: a, b and the φ up to which it is positive.
fn cosine(theta: f64, other: f64) -> (f64, f64, f64) {
    let a = theta.cos() * other.cos();
    let b = theta.sin() * other.sin();
    let seen = if a >= b { PI } else { (-a / b).acos() };
    (a, b, seen)
}

/// ∫ ⟨ω, h⟩ dφ_h over facets at an elevation.
fn area(theta: f64, other: f64) -> f64 {
    let (a, b, seen) = cosine(theta, other);
    2.0 * (a * seen + b * seen.sin())
}

impl Facets {
    /// From elevations (increasing) and f_r(ω, ω) there; none: all normals are alike.
    fn new(scan: &[(f64, f64)]) -> Self {
        let log = Transform::Log { epsilon: 1e-6 };
        let at = |theta: f64| {
            let next = scan.partition_point(|s| s.0 < theta);
            let (Some(&after), Some(&before)) = (
                scan.get(next).or(scan.last()),
                scan.get(next.saturating_sub(1)),
            ) else {
                return 1.0;
            };
            // Straight in the logarithm over the root of the elevation.
            let (x, [a, b]) = (theta.sqrt(), [before, after].map(|s| s.0.sqrt()));
            let t = if b > a {
                ((x - a) / (b - a)).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let [from, to] = [before, after].map(|s| log.forward(s.1));
            log.inverse(from + t * (to - from)).max(1e-12)
        };
        let all: Vec<(f64, f64)> = (0..FACETS).map(elevation).collect();
        let back: Vec<f64> = all.iter().map(|&(t, _)| at(t) * t.cos()).collect();
        let kernel: Vec<f64> = all
            .iter()
            .flat_map(|&(t, _)| {
                let areas = all.iter();
                areas.map(move |&(other, step)| area(t, other) * other.sin() * step)
            })
            .collect();
        let mut density = vec![1.0; FACETS];
        for _ in 0..STEPS {
            let rows = kernel.chunks_exact(FACETS).zip(&back);
            let next = rows.map(|(row, f)| {
                let seen: f64 = row.iter().zip(&density).map(|(k, d)| k * d).sum();
                f * seen
            });
            let next: Vec<f64> = next.collect();
            let most = next.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
            density = next.into_iter().map(|d| d / most).collect();
        }
        Self { density }
    }

    /// Shares of the normals that are seen from an elevation up to each elevation.
    fn seen(&self, theta_o: f64) -> Vec<f64> {
        let mut sum = 0.0;
        let parts = self.density.iter().enumerate().map(|(i, d)| {
            let (theta, step) = elevation(i);
            sum += d * theta.sin() * step * area(theta_o, theta);
            sum
        });
        let sums: Vec<f64> = parts.collect();
        sums.iter().map(|s| s / sum).collect()
    }
}

/// The half vector of a point of the unit square among the normals that are seen from an elevation.
fn half_vector(shares: &[f64], theta_o: f64, [u, v]: [f64; 2]) -> DVec3 {
    let i = shares.partition_point(|s| *s < u).min(FACETS - 1);
    let before = if i > 0 { shares[i - 1] } else { 0.0 };
    let part = (u - before) / (shares[i] - before).max(f64::MIN_POSITIVE);
    let root = (i as f64 + part.clamp(0.0, 1.0)) / FACETS as f64;
    let theta = FRAC_PI_2 * root * root;
    let (a, b, seen) = cosine(theta_o, theta);
    // On both sides of the view; the integral of a + b cos φ grows with φ.
    let share = (2.0 * v - 1.0).abs() * (a * seen + b * seen.sin());
    let phi = last_where(0.0, seen, 50, |phi| a * phi + b * phi.sin() < share);
    let phi = phi.copysign(v - 0.5);
    Direction::from_spherical(theta, phi).vector()
}

/// The reflection of a view by facets with this normal.
fn reflected(view: DVec3, half: DVec3) -> Option<Direction> {
    Direction::try_new(2.0 * view.dot(half) * half - view)
}

/// Elevations of equal steps of their roots up to the mask, rad.
fn spaced(share: f64) -> f64 {
    MASK * share * share
}

impl Retro {
    /// The scan: `n` elevations from the normal on, at the least separation that can be taken.
    fn scan(&self, reach: &Reach<'_>, n: usize) -> Vec<Pose> {
        let (step, steps) = WIDER;
        let pose = |j: usize| {
            let theta = spaced(j as f64 / (n.max(2) - 1) as f64);
            let half = Direction::from_spherical(theta, 0.0).vector();
            let wider = (0..=steps).map(|k| self.separation_deg.to_radians() + k as f64 * step);
            wider
                .filter_map(|angle| {
                    let side = DVec3::Y * (0.5 * angle).tan();
                    let pair = DirectionPair::new(
                        Direction::try_new(half + side)?,
                        Direction::try_new(half - side)?,
                    );
                    reach.pose(&pair)
                })
                .next()
        };
        reach.hopeful((0..n).filter_map(pose).collect())
    }

    /// Poses by the normals that are known of, from the point with this number on, to add to others.
    fn grid(
        &self,
        task: &Task<'_>,
        reach: &Reach<'_>,
        facets: &Facets,
        first: usize,
        n: usize,
    ) -> Vec<Pose> {
        let views = (task.budget as f64).cbrt().round().max(1.0) as usize;
        let [turn, shift]: [f64; 2] = Random::new(hashed([task.seed, 0, 4])).point(0);
        let mut points = Sobol::new(hashed([task.seed, 0, 5]));
        let elevations = (0..views).map(|k| spaced((k as f64 + shift) / views as f64));
        let elevations: Vec<(f64, Vec<f64>)> = elevations.map(|t| (t, facets.seen(t))).collect();
        let mut poses: Vec<Pose> = Vec::new();
        for i in first..first + PATIENCE * n {
            if poses.len() == n || !(task.go_on)() {
                break;
            }
            let (theta, shares) = &elevations[i % views];
            let view = Direction::from_spherical(*theta, 0.0).vector();
            let light = reflected(
                view,
                half_vector(shares, *theta, points.point((i / views) as u64)),
            );
            // Azimuths of an anisotropic material; an isotropic one has them all.
            let turned = |d: DVec3| {
                let about = glam::DQuat::from_rotation_z(TAU * (turn + i as f64 * GOLDEN));
                Direction::try_new(about * d)
            };
            let pair =
                light.and_then(|l| Some(DirectionPair::new(turned(l.vector())?, turned(view)?)));
            let pose = pair.filter(is_inside).and_then(|pair| reach.pose(&pair));
            poses.extend(reach.hopeful(pose.into_iter().collect()));
        }
        poses
    }
}

/// The part of a turn that is least near to any fraction of it.
const GOLDEN: f64 = 0.381_966_011_250_105_1;

/// Elevations, increasing, and luminances of the readings of a scan.
fn read_back(so_far: &Measurement) -> Vec<(f64, f64)> {
    let read = luminances(so_far).filter_map(|(pair, f)| Some((pair, f?)));
    let read: Vec<_> = read.collect();
    let separations = read.iter().map(|(pair, _)| pair.separation());
    let least = separations.fold(f64::INFINITY, f64::min);
    let of_scan = read
        .iter()
        .filter(|(pair, _)| pair.separation() <= least + OF_SCAN);
    let mut scan: Vec<(f64, f64)> = of_scan
        .filter_map(|(pair, f)| Some((Direction::try_new(pair.half())?.theta(), *f)))
        .collect();
    scan.sort_by(|a, b| a.0.total_cmp(&b.0));
    scan
}

impl SampleSet for Retro {
    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        in_closed("separation_deg", self.separation_deg, 0.0, 60.0).map(drop)
    }

    plans_by_design!();
}

impl Planner for Retro {
    fn batch(&self, asked: usize, budget: usize, _: bool) -> Option<usize> {
        let (least, most, of) = SCAN;
        Some(match asked {
            0 => (budget / of).clamp(least, most).min(budget),
            _ => budget.saturating_sub(asked),
        })
    }

    fn most(&self) -> usize {
        MOST
    }

    fn next(&self, task: &Task<'_>, so_far: &Measurement, most: usize) -> Chosen {
        let before = so_far.schedule.poses.len();
        admit(KIND, before + most, MOST)?;
        let reach = Reach::new(task, so_far);
        let mut poses = match before {
            0 => self.scan(
                &reach,
                self.batch(0, task.budget, false).unwrap_or(most).min(most),
            ),
            _ => Vec::new(),
        };
        if poses.len() < most {
            let facets = Facets::new(&read_back(so_far));
            poses.extend(self.grid(task, &reach, &facets, before, most - poses.len()));
        }
        filled(KIND, (task, &reach), so_far, most, poses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::microfacet::{Beckmann, FresnelSpec, Microfacet};
    use crate::brdf::{Brdf, Channels, Roughness};

    fn lobe(alpha: f64) -> Microfacet<Beckmann> {
        let (alpha, fresnel) = (Roughness::Isotropic(alpha), FresnelSpec::default());
        Microfacet::new(alpha, &fresnel, Channels::Luminance)
    }

    fn scan(brdf: &dyn Brdf, n: usize) -> Vec<(f64, f64)> {
        let at = |j: usize| {
            let theta = spaced(j as f64 / (n - 1) as f64);
            let pair = DirectionPair::from_spherical(theta, 0.0, theta, 0.0);
            (theta, brdf.luminance(&pair).unwrap())
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn a_scan_shows_the_distribution_of_normals() {
        for alpha in [0.15, 0.3, 0.5] {
            let facets = Facets::new(&scan(&lobe(alpha), 60));
            for i in 0..FACETS {
                let theta = elevation(i).0;
                // Beckmann's D as a share of its peak; where there are few facets masking is not theirs.
                let want = (-(theta.tan() / alpha).powi(2)).exp() / theta.cos().powi(4);
                let off = facets.density[i] / facets.density[0] - want;
                assert!(off.abs() < 0.03, "{alpha} {theta}: {off}");
            }
        }
    }

    #[test]
    fn half_vectors_have_the_density_of_normals_that_are_seen() {
        let facets = Facets::new(&scan(&lobe(0.5), 60));
        let theta_o = 1.1;
        let view = Direction::from_spherical(theta_o, 0.0).vector();
        let shares = facets.seen(theta_o);
        let mut points = Sobol::new(1);
        let mut counts = [[0.0; 2]; 2];
        for i in 0..40_000 {
            let h = half_vector(&shares, theta_o, points.point(i));
            assert!(h.dot(view) > -1e-9);
            let (far, behind) = (h.z < 0.85, h.x < 0.0);
            counts[usize::from(far)][usize::from(behind)] += 1.0 / 40_000.0;
        }
        // By the midpoint rule.
        let (mut want, mut all) = ([[0.0; 2]; 2], 0.0);
        for (i, d) in facets.density.iter().enumerate() {
            let (theta, step) = elevation(i);
            for k in 0..720 {
                let h =
                    Direction::from_spherical(theta, TAU * (f64::from(k) + 0.5) / 720.0).vector();
                let part = d * theta.sin() * step * h.dot(view).max(0.0);
                want[usize::from(h.z < 0.85)][usize::from(h.x < 0.0)] += part;
                all += part;
            }
        }
        for (counts, want) in counts.as_flattened().iter().zip(want.as_flattened()) {
            assert!((counts - want / all).abs() < 0.004, "{counts} {want}");
        }
    }
}
