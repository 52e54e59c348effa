//! Sampling of directions from a tabulated density.

use glam::DVec3;
use std::f64::consts::TAU;

/// A density on the sphere that is constant in cells: rings about +z, cut into sectors.
///
/// Rings are kept by 1 − cos γ, γ the angle from +z: equal steps of it are equal solid angles, and
/// it keeps its digits next to the pole, where lobes of mirrors are a millionth of a radian wide.
pub(super) struct Distribution {
    /// 1 − cos γ at the edges of the rings, from 0 to 2.
    edges: Vec<f64>,
    sectors: usize,
    /// Cumulative probability of the rings.
    rings: Steps,
    /// That of the sectors of each ring.
    in_ring: Vec<Steps>,
    /// Density of each cell, sr⁻¹.
    density: Vec<f64>,
}

impl Distribution {
    /// `weights` is the probability of each cell, not normalised, ring after ring; each ≥ 0. If
    /// all are 0, directions are even.
    pub(crate) fn new(edges: Vec<f64>, sectors: usize, mut weights: Vec<f64>) -> Self {
        let count = edges.len() - 1;
        debug_assert_eq!(weights.len(), count * sectors);
        let angle = |ring: usize| (edges[ring + 1] - edges[ring]) * TAU / sectors as f64;
        if !weights.iter().any(|w| *w > 0.0) {
            for (cell, weight) in weights.iter_mut().enumerate() {
                *weight = angle(cell / sectors);
            }
        }
        let of_rings = weights.chunks_exact(sectors);
        let sums: Vec<f64> = of_rings.clone().map(|ring| ring.iter().sum()).collect();
        let total: f64 = sums.iter().sum();
        let rings = Steps::new(&sums, total);
        let in_ring = of_rings.zip(&sums);
        let in_ring = in_ring.map(|(ring, sum)| Steps::new(ring, *sum)).collect();
        let cells = weights.iter().enumerate();
        let density = cells.map(|(cell, w)| w / (total * angle(cell / sectors)));
        Self {
            density: density.collect(),
            edges,
            sectors,
            rings,
            in_ring,
        }
    }

    /// A direction from two numbers in `[0, 1)`, and its density.
    pub(crate) fn sample(&self, [u, v]: [f64; 2]) -> (DVec3, f64) {
        let (ring, s) = self.rings.picked(u);
        let (sector, t) = self.in_ring[ring].picked(v);
        let c = self.edges[ring] + s * (self.edges[ring + 1] - self.edges[ring]);
        let (sin_phi, cos_phi) = (TAU * (sector as f64 + t) / self.sectors as f64).sin_cos();
        let sin = (c * (2.0 - c)).max(0.0).sqrt();
        (
            DVec3::new(sin * cos_phi, sin * sin_phi, 1.0 - c),
            self.density[ring * self.sectors + sector],
        )
    }

    /// Density of [`sample`](Self::sample) at a unit vector, sr⁻¹.
    pub(crate) fn pdf(&self, d: DVec3) -> f64 {
        let sin2 = d.x * d.x + d.y * d.y;
        let c = if d.z > 0.0 {
            sin2 / (1.0 + d.z)
        } else {
            1.0 - d.z
        };
        let last = self.edges.len() - 2;
        let ring = self.edges[1..=last].partition_point(|e| *e <= c);
        let turn = d.y.atan2(d.x) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let sector = ((turn * self.sectors as f64) as usize).min(self.sectors - 1);
        self.density[ring * self.sectors + sector]
    }
}

/// A cumulative distribution.
struct Steps {
    /// 0, and the sums of the first weights, over the sum of all.
    sums: Vec<f64>,
    /// Where a search for each of as many even parts of [0, 1) begins (Chen and Asau 1974).
    guide: Vec<u32>,
}

impl Steps {
    fn new(weights: &[f64], total: f64) -> Self {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for weight in weights {
            sum += weight;
            sums.push(if total > 0.0 { sum / total } else { 0.0 });
        }
        let n = weights.len();
        let mut step = 0;
        let guide = (0..n).map(|part| {
            while step + 1 < n && sums[step + 1] <= part as f64 / n as f64 {
                step += 1;
            }
            step as u32
        });
        let guide = guide.collect();
        Self { sums, guide }
    }

    /// The step that `u` falls on, and where on it.
    fn picked(&self, u: f64) -> (usize, f64) {
        // Steps of no height are never picked: u lies below the next sum, or is past the last.
        let n = self.guide.len();
        let sums = &self.sums;
        let mut step = self.guide[((u * n as f64) as usize).min(n - 1)] as usize;
        while step + 1 < n && sums[step + 1] <= u {
            step += 1;
        }
        // Rounding of the part may have begun too far on.
        while step > 0 && sums[step] > u {
            step -= 1;
        }
        let height = sums[step + 1] - sums[step];
        let t = if height > 0.0 {
            (u - sums[step]) / height
        } else {
            0.5
        };
        (step, t.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    /// Rings a few widths apart, some cells of them empty.
    fn uneven() -> Distribution {
        let edges = vec![0.0, 1e-14, 1e-6, 0.3, 1.0, 2.0];
        let weights = (0..5 * 8).map(|i| f64::from(i * 7 % 5)).collect();
        Distribution::new(edges, 8, weights)
    }

    #[test]
    fn directions_are_unit_and_know_their_density() {
        let table = uneven();
        let mut points = Sobol::new(1);
        for i in 0..10_000 {
            let (d, density) = table.sample(points.point(i));
            assert!((d.length() - 1.0).abs() < 1e-15);
            assert!(density > 0.0);
            // Less than one in a million lies so near an edge that rounding moves it across.
            assert_eq!(table.pdf(d), density, "{i} {d}");
        }
    }

    #[test]
    fn the_density_is_that_of_the_directions() {
        // ∫ g p dω by drawing, and by the rule of midpoints in 1 − cos γ and azimuth.
        let table = uneven();
        let g = |d: DVec3| 1.5 + d.x + 0.5 * d.y * d.z + d.z * d.z;
        let mut points = Sobol::new(2);
        let n = 1 << 14;
        let drawn = (0..n)
            .map(|i| g(table.sample(points.point(i)).0))
            .sum::<f64>()
            / n as f64;
        let (mut sum, mut whole) = (0.0, 0.0);
        for ring in table.edges.windows(2) {
            for i in 0..40 {
                let c = ring[0] + (f64::from(i) + 0.5) / 40.0 * (ring[1] - ring[0]);
                let sin = (c * (2.0 - c)).sqrt();
                for k in 0..160 {
                    let (s, co) = (TAU * (f64::from(k) + 0.5) / 160.0).sin_cos();
                    let d = DVec3::new(sin * co, sin * s, 1.0 - c);
                    let part = table.pdf(d) * (ring[1] - ring[0]) / 40.0 * TAU / 160.0;
                    whole += part;
                    sum += g(d) * part;
                }
            }
        }
        assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        // The net has an error of some 1/n for smooth g, and some times that at the jumps.
        assert!((drawn - sum).abs() < 2e-3 * sum, "{drawn} {sum}");
    }

    #[test]
    fn without_weights_directions_are_even() {
        let table = Distribution::new(vec![0.0, 0.1, 2.0], 3, vec![0.0; 6]);
        for d in [DVec3::X, -DVec3::Z, DVec3::Z] {
            assert!((table.pdf(d) - 1.0 / (2.0 * TAU)).abs() < 1e-15);
        }
    }
}
