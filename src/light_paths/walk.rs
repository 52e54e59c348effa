//! The random walk of light between the facets of a Smith surface (Heitz, Hanika, d'Eon and Dachsbacher 2016).
//!
//! A Smith surface has facets at all heights, of normals that do not depend on height or on each other. A ray along w meets
//! facets at the rate of a volume. Let t = −ln C be the depth of a point, C the share of the surface below it, 0 on top.
//! Whatever the distribution of heights is, along a ray
//!
//! dt = −(w_z/σ(−w)) dE,   E the optical depth, an exponential number between facets,   σ(ω) = ∫ max(0, ω·m) D(m) dω_m,
//!
//! so that a ray that goes up leaves (t < 0) with probability exp(−Λ(w) t), Λ(w) = σ(−w)/w_z; this is Smith's G₁ at that depth.
//! The facet that is met has a normal of density max(0, −w·m) D(m)/σ(−w).
//!
//! At each facet the walk adds what goes to the sensor, averaged over E, and goes on at one E: rays that leave are not
//! followed, their share is taken off the weight instead. So light of one facet is exact for mirrors: D G₂ F/(4 cos θ_i cos θ_o)
//! with the height-correlated G₂, and rare second facets of smooth surfaces are found by every path.

use super::accumulate::Bounces;
use super::facets::{Facets, survives};
use crate::brdf::ChannelValues;
use crate::brdf::microfacet::Distribution;
use crate::numeric::DENOMINATOR_FLOOR;
use crate::sampling::RandomStream;
use glam::DVec3;
use smallvec::smallvec;

/// Facets that every path meets before chance ends it.
const CERTAIN: usize = 4;

/// A surface of facets.
#[derive(Clone)]
pub(super) struct Walk<D> {
    pub normals: D,
    pub facets: Facets,
    /// Facets after which nothing is asked for.
    pub last: usize,
}

impl<D: Distribution> Walk<D> {
    /// True if nothing that is asked for depends on chance: light of one mirror.
    pub(crate) fn is_exact(&self) -> bool {
        self.last == 1 && matches!(self.facets, Facets::Mirror(_))
    }

    /// Follows light from `from` and adds what goes to `to`, both above the horizon; f_r in sr⁻¹ of each scattering order, one
    /// sample of it.
    pub(crate) fn follow(
        &self,
        [from, to]: [DVec3; 2],
        random: &mut RandomStream,
        bounces: &mut Bounces,
        channels: usize,
    ) {
        let cos_to = to.z.max(DENOMINATOR_FLOOR);
        let leaving = self.normals.seen_area(-to) / cos_to;
        let mut weight: ChannelValues = smallvec![1.0; channels];
        let mut values = weight.clone();
        let mut depth = 0.0f64;
        let mut back = from;
        for order in 1..=self.last {
            let area = self.normals.seen_area(back);
            if area <= 0.0 {
                return;
            }
            // Depth for each unit of optical depth, and what leaves to the sensor from the next facet, over all of them.
            let rise = -back.z / area;
            let (seen, held);
            if rise > 0.0 {
                let rate = (1.0 / rise).min(1.0 / DENOMINATOR_FLOOR);
                seen = between(depth, rate, leaving);
                held = -(-rate * depth).exp_m1();
                let optical = -(-random.next() * held).ln_1p();
                depth = (depth - optical * rise).max(0.0);
            } else {
                seen = (-leaving * depth).exp() / (1.0 - rise * leaving);
                held = 1.0;
                depth -= rise * -(-random.next()).ln_1p();
            }
            let normal = self.normals.visible_normal(back, random);
            let seen = seen / cos_to;
            match &self.facets {
                Facets::Mirror(fresnel) => {
                    let half = back + to;
                    if half.z > 0.0 && seen > 0.0 {
                        // Of any length, but its square must be a number.
                        let long = half / half.abs().max_element();
                        let density = self.normals.density(long) / (4.0 * area);
                        let cos_d = (0.5 * half.length()).min(1.0);
                        fresnel.scale(&[cos_d], &[density * seen], &mut values);
                        bounces.add(order, weight.iter().zip(&values).map(|(w, v)| w * v));
                    }
                }
                Facets::Diffuse(_) | Facets::Material(_) => {
                    let lit = normal.dot(to).max(0.0) * seen;
                    self.facets.value(back, to, normal, &mut values);
                    bounces.add(order, weight.iter().zip(&values).map(|(w, f)| w * f * lit));
                }
            }
            if order == self.last {
                return;
            }
            let next = self.facets.scatter(back, normal, &mut weight, random);
            weight.iter_mut().for_each(|w| *w *= held);
            if order >= CERTAIN && !survives(&mut weight, random) {
                return;
            }
            back = -next;
        }
    }

    /// Follows light from `from` as it goes: where it leaves and its scattering order, `None` of what chance ended or what
    /// meets more than are asked for. `weight` is what is left of each channel.
    pub(crate) fn path(
        &self,
        from: DVec3,
        random: &mut RandomStream,
        weight: &mut ChannelValues,
    ) -> Option<(DVec3, usize)> {
        let mut depth = 0.0f64;
        let mut back = from;
        for order in 0.. {
            let area = self.normals.seen_area(back);
            let optical = -(-random.next()).ln_1p();
            // What it rises by; without facets it leaves.
            let rise = -back.z * optical;
            if rise > 0.0 && rise >= depth * area {
                return (order > 0).then_some((-back, order));
            }
            if order == self.last || area <= 0.0 {
                return None;
            }
            depth = (depth - rise / area).max(0.0);
            let normal = self.normals.visible_normal(back, random);
            back = -self.facets.scatter(back, normal, weight, random);
            if order + 1 >= CERTAIN && !survives(weight, random) {
                return None;
            }
        }
        None
    }
}

/// ∫ exp(−E) exp(−leaving (depth − E/rate)) dE over 0 ≤ E ≤ rate · depth: what leaves from the next facet of a ray that goes up.
fn between(depth: f64, rate: f64, leaving: f64) -> f64 {
    let x = (rate - leaving) * depth;
    let whole = rate * depth;
    if whole == 0.0 {
        return 0.0;
    }
    // From the smaller exponent, so that neither overflows.
    let share = |x: f64| if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
    (-leaving.min(rate) * depth).exp() * share(x.abs()) * whole
}
