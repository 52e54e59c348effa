//! Nodes of what depends on θ_i, θ_o and |Δφ| alone, and is the same if light and sensor are exchanged: all that a surface does
//! which looks the same however it is turned, but for its normals.
//!
//! Elevations have a node each some degrees; a pair of them has nodes in Δφ as far from each other on the sphere, or nearer
//! where circles are small. Between nodes values are linear.

use crate::sampling::gauss_legendre;
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Nodes about a pair, and their shares of its value: eight, 1 in all.
pub(super) type Shares = SmallVec<[(usize, f64); 8]>;

/// Intervals of half a circle: of fewer, chords are far from its arcs.
const FEWEST: usize = 12;

/// See the page of the module.
pub(super) struct Nodes {
    /// Elevations, from 0 on.
    thetas: Vec<f64>,
    power: f64,
    /// First node of each pair of elevations k ≥ l, at k(k + 1)/2 + l, and the number of all.
    first: Vec<usize>,
}

impl Nodes {
    /// Nodes `step` (rad) apart at the normal. Elevations are reach·(1 − (1 − u)^power) at even steps of u.
    pub(super) fn new(step: f64, power: f64, reach: f64) -> Self {
        let across = (power * reach / step).round().max(2.0);
        let elevation = |k: f64| reach * (1.0 - (1.0 - k / across).powf(power));
        let thetas: Vec<f64> = (0..=across as usize).map(|k| elevation(k as f64)).collect();
        let mut first = vec![0];
        for k in 0..thetas.len() {
            for l in 0..=k {
                // On the smaller of the two circles.
                let intervals = match l {
                    0 => 0,
                    l => FEWEST.max((PI * thetas[l].sin() / step).round() as usize),
                };
                first.push(first[first.len() - 1] + intervals + 1);
            }
        }
        Self {
            thetas,
            power,
            first,
        }
    }

    /// Nodes in all.
    pub(super) fn len(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// Elevations, intervals in Δφ and the place among them of each node.
    fn all(&self) -> impl Iterator<Item = ([usize; 2], usize, usize)> {
        let rows = (0..self.thetas.len()).flat_map(|k| (0..=k).map(move |l| [k, l]));
        rows.zip(self.first.windows(2)).flat_map(|(row, first)| {
            let intervals = first[1] - first[0] - 1;
            (0..=intervals).map(move |place| (row, intervals, place))
        })
    }

    /// Light and sensor at each node.
    pub(super) fn pairs(&self) -> Vec<[DVec3; 2]> {
        let pairs = self.all().map(|([k, l], intervals, place)| {
            let azimuth = PI * place as f64 / intervals.max(1) as f64;
            let [a, b] = [k, l].map(|k| self.thetas[k].sin_cos());
            let turned = DVec3::new(b.0 * azimuth.cos(), b.0 * azimuth.sin(), b.1);
            [DVec3::new(a.0, 0.0, a.1), turned]
        });
        pairs.collect()
    }

    /// ∫∫ share cos θ_i cos θ_o dω_i dω_o of each node: π² in all, of nodes that reach the horizon.
    pub(super) fn measures(&self) -> Vec<f64> {
        // ∫ share cos θ sin θ dθ.
        let rule = gauss_legendre(8);
        let mut rings = vec![0.0; self.thetas.len()];
        for (k, ends) in self.thetas.windows(2).enumerate() {
            let half = 0.5 * (ends[1] - ends[0]);
            for (x, w) in &rule {
                let theta = ends[0] + half * (1.0 + x);
                let light = half * w * theta.sin() * theta.cos();
                rings[k] += 0.5 * (1.0 - x) * light;
                rings[k + 1] += 0.5 * (1.0 + x) * light;
            }
        }
        let measures = self.all().map(|([k, l], intervals, place)| {
            let azimuth = match place {
                _ if intervals == 0 => PI,
                0 => 0.5 * PI / intervals as f64,
                place if place == intervals => 0.5 * PI / intervals as f64,
                _ => PI / intervals as f64,
            };
            // Δφ of either sign, and either of two elevations the light's.
            let ways = if k == l { 2.0 } else { 4.0 };
            TAU * ways * rings[k] * rings[l] * azimuth
        });
        measures.collect()
    }

    /// The nodes about a pair of unit vectors.
    pub(super) fn around(&self, [a, b]: [DVec3; 2]) -> Shares {
        let (along, across) = (a.x * b.x + a.y * b.y, a.x * b.y - a.y * b.x);
        let azimuth = across.abs().atan2(along);
        let [a, b] = [a, b].map(|v| self.elevation(v.x.hypot(v.y).atan2(v.z)));
        let mut shares = Shares::new();
        for (k, of_k) in a {
            for (l, of_l) in b {
                let (k, l) = (k.max(l), k.min(l));
                let row = k * (k + 1) / 2 + l;
                let intervals = self.first[row + 1] - self.first[row] - 1;
                let place = azimuth / PI * intervals as f64;
                let below = (place as usize).min(intervals.saturating_sub(1));
                let share = place - below as f64;
                for (place, of_place) in [(below, 1.0 - share), (below + 1, share)] {
                    let share = of_k * of_l * of_place;
                    if share > 0.0 {
                        let node = self.first[row] + place;
                        match shares.iter_mut().find(|(other, _)| *other == node) {
                            Some((_, sum)) => *sum += share,
                            None => shares.push((node, share)),
                        }
                    }
                }
            }
        }
        shares
    }

    /// The two elevations about one, and their shares.
    fn elevation(&self, theta: f64) -> [(usize, f64); 2] {
        let last = self.thetas.len() - 1;
        let reach = self.thetas[last];
        let u = 1.0 - (1.0 - theta / reach).max(0.0).powf(1.0 / self.power);
        let below = ((u * last as f64) as usize).min(last - 1);
        let [low, high] = [below, below + 1].map(|k| self.thetas[k]);
        let share = ((theta - low) / (high - low)).clamp(0.0, 1.0);
        [(below, 1.0 - share), (below + 1, share)]
    }
}

/// Elevation of the last nodes of what has values at pairs: what reaches the horizon has none.
pub(super) const LAST: f64 = FRAC_PI_2 * (1.0 - 0.5 / 90.0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DirectionPair;

    fn pair(theta_i: f64, theta_o: f64, azimuth: f64) -> [DVec3; 2] {
        DirectionPair::from_spherical(theta_i, 0.3, theta_o, 0.3 + azimuth).vectors()
    }

    #[test]
    fn measures_are_those_of_the_hemispheres() {
        for (step, power) in [(0.07, 1.0), (0.05, 1.5), (0.9, 1.0)] {
            let nodes = Nodes::new(step, power, FRAC_PI_2);
            let measures = nodes.measures();
            assert_eq!(measures.len(), nodes.len());
            assert!((measures.iter().sum::<f64>() - PI * PI).abs() < 1e-12);
        }
    }

    #[test]
    fn shares_are_one_at_their_nodes_and_in_all() {
        let nodes = Nodes::new(0.05, 1.5, LAST);
        for (node, at) in nodes.pairs().into_iter().enumerate() {
            let shares = nodes.around(at);
            let own = shares.iter().find(|(other, _)| *other == node);
            assert!((own.unwrap().1 - 1.0).abs() < 1e-9, "{node}: {shares:?}");
        }
        for i in 0..100 {
            let [a, b, c] = [0.617, 0.31, 0.77].map(|step| (step * f64::from(i)).fract());
            let shares = nodes.around(pair(1.6 * a, 1.6 * b, 6.4 * c));
            assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    /// What is the same however the pair is turned, mirrored or exchanged, and smooth, is found again: second order in the step.
    #[test]
    fn values_between_nodes_converge_to_those_of_a_smooth_function() {
        let smooth = |[a, b]: [DVec3; 2]| (0.5 * (a + b).z + 0.3 * (a.dot(b))).exp();
        let error = |step: f64| {
            let nodes = Nodes::new(step, 1.5, LAST);
            let values: Vec<f64> = nodes.pairs().into_iter().map(smooth).collect();
            let worst = (0..1000).map(|i| {
                let [a, b, c] = [0.617, 0.317, 0.771].map(|step| (step * f64::from(i)).fract());
                let at = pair(LAST * a, LAST * b, 6.4 * c);
                let found: f64 = nodes.around(at).iter().map(|(n, s)| s * values[*n]).sum();
                (found - smooth(at)).abs()
            });
            worst.fold(0.0, f64::max)
        };
        let [coarse, fine] = [0.1, 0.025].map(error);
        // h²/8 times second derivatives along three coordinates, each e^1.3 at most.
        let bound = 3.0 * 1.3f64.exp() * 0.025f64.powi(2) / 8.0;
        assert!(fine < bound && fine < coarse / 8.0, "{coarse} {fine}");
    }
}
