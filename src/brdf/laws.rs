//! The laws a BRDF should obey, as functions that measure deviations.
//!
//! | law | statement | function |
//! |---|---|---|
//! | positivity | 0 ≤ f < ∞ above the horizon, f = 0 below it | [`positivity`] |
//! | reciprocity | f(ω_i, ω_o) = f(ω_o, ω_i) | [`reciprocity`] |
//! | isotropy | f unchanged when the sample turns | [`isotropy`] |
//! | bilateral symmetry | f unchanged by a mirror through t–n and b–n | [`bilateral_symmetry`] |
//! | energy | ∫ f cos θ_i dω_i ≤ 1 for every ω_o | [`directional_albedo`], [`max_albedo`] |
//!
//! Nothing here judges: a caller compares the result with what the BRDF declares and with the
//! accuracy it needs. Pairs without data are left out and counted.

mod albedo;
mod lobe;

pub use albedo::{
    DirectionalAlbedo, MaxAlbedo, directional_albedo, max_albedo, noisy_albedo, standard_views,
};

use super::{Brdf, ChannelValues, Presence};
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::{Random, cosine_hemisphere, ggx_half_vector};
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The largest difference between two evaluations that are equal by a law.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deviation {
    /// Largest |a − b|/max(|a|, |b|) over pairs and channels.
    pub max_relative: f64,
    /// The pair with the largest difference.
    pub worst: Option<DirectionPair>,
    /// Pairs compared.
    pub compared: usize,
    /// Pairs without data on both sides.
    pub missing: usize,
    /// Pairs with data on one side only.
    pub one_sided: usize,
}

/// Counts of [`positivity`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Positivity {
    /// Pairs evaluated.
    pub evaluated: usize,
    /// Pairs without data.
    pub missing: usize,
    /// Pairs with a NaN or an infinity.
    pub not_finite: usize,
    /// Pairs with a value below 0.
    pub negative: usize,
    /// Pairs below the horizon with a value other than 0.
    pub lit_below_horizon: usize,
    /// The first pair of the last three kinds.
    pub worst: Option<DirectionPair>,
}

impl Positivity {
    /// True if every value was finite, not negative, and 0 below the horizon.
    pub fn holds(&self) -> bool {
        self.not_finite == 0 && self.negative == 0 && self.lit_below_horizon == 0
    }
}

/// Random pairs above the horizon that reach both the body of a BRDF and its peak: even ones have
/// both directions cosine-distributed, odd ones a half vector from GGX of alpha 0.3, 0.1, 0.03, 0.01.
pub fn pairs(count: usize, seed: u64) -> Vec<DirectionPair> {
    const ALPHA: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
    let random = Random::new(seed);
    let points = (0..).map(|i| (i as usize, random.point::<4>(i)));
    let candidates = points.filter_map(|(i, [a, b, c, d])| {
        let omega_o = cosine_hemisphere([a, b]);
        let omega_i = if i % 2 == 0 {
            cosine_hemisphere([c, d])
        } else {
            let h = ggx_half_vector(ALPHA[i / 2 % 4], [c, d]);
            super::half_vector::reflect(omega_o, h.vector())?
        };
        Some(DirectionPair::new(omega_i, omega_o))
    });
    candidates
        .filter(DirectionPair::is_above_horizon)
        .take(count)
        .collect()
}

/// The pairs where formulas break: normal/normal, exact mirror, exact retro-reflection, grazing
/// opposed, grazing retro, normal/grazing; separations of 1e-2 to 1e-15 rad from each; cosines
/// down to 1e-300; and pairs on and below the horizon.
pub fn edge_pairs() -> Vec<DirectionPair> {
    let z = |theta: f64, phi: f64| Direction::from_spherical(theta, phi);
    let low = |x: f64, y: f64, z: f64| Direction::from_unit(DVec3::new(x, y, z));
    let mut pairs = Vec::new();
    let anchors = [
        (0.0, 0.0, 0.0, 0.0),
        (0.7, 0.4, 0.7, 0.4 + TAU / 2.0),
        (0.7, 0.4, 0.7, 0.4),
        (FRAC_PI_2, 0.4, FRAC_PI_2, 0.4 + TAU / 2.0),
        (FRAC_PI_2, 0.4, FRAC_PI_2, 0.4),
        (0.0, 0.0, FRAC_PI_2, 1.1),
    ];
    for (ti, pi, to, po) in anchors {
        pairs.push(DirectionPair::from_spherical(ti, pi, to, po));
        for e in 2..=15 {
            let d = 10f64.powi(-e);
            pairs.push(DirectionPair::from_spherical(ti - d, pi, to, po));
            pairs.push(DirectionPair::from_spherical(ti, pi + d, to - d, po));
        }
    }
    // The mirror pair with components negated, so that h is along the normal to the last bit.
    let v = z(0.7, 0.4).vector();
    pairs.push(DirectionPair::new(low(v.x, v.y, v.z), low(-v.x, -v.y, v.z)));
    for e in [9, 30, 100, 160, 200, 300, 320] {
        let c = 10f64.powi(-e);
        let sin = (1.0 - c * c).sqrt();
        for o in [
            low(-sin, 0.0, c),
            low(sin, 0.0, c),
            low(0.0, sin, c),
            Direction::NORMAL,
            z(1.0, 2.0),
        ] {
            pairs.push(DirectionPair::new(low(sin, 0.0, c), o));
        }
    }
    for i in [low(1.0, 0.0, 0.0), low(0.6, 0.0, -0.8), low(0.0, 0.0, -1.0)] {
        for o in [Direction::NORMAL, z(1.0, 2.0), low(-1.0, 0.0, 0.0), i] {
            pairs.push(DirectionPair::new(i, o));
        }
    }
    let swapped: Vec<_> = pairs.iter().map(DirectionPair::swapped).collect();
    pairs.extend(swapped);
    pairs
}

/// Counts values that are not finite or negative, and those other than 0 where a direction is not
/// above the horizon.
pub fn positivity(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Positivity {
    let mut found = Positivity::default();
    let mut values = vec![0.0; brdf.channels().count()];
    for pair in pairs {
        found.evaluated += 1;
        if brdf.eval(pair, &mut values) == Presence::Missing {
            found.missing += 1;
            continue;
        }
        let not_finite = values.iter().any(|v| !v.is_finite());
        let negative = values.iter().any(|&v| v < 0.0);
        let lit = !pair.is_above_horizon() && values.iter().any(|&v| v != 0.0);
        found.not_finite += usize::from(not_finite);
        found.negative += usize::from(negative);
        found.lit_below_horizon += usize::from(lit);
        if not_finite || negative || lit {
            found.worst.get_or_insert(*pair);
        }
    }
    found
}

/// Deviation of f under an exchange of light and sensor.
pub fn reciprocity(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Deviation {
    Deviation::over(brdf, pairs.iter().map(|pair| (*pair, pair.swapped())))
}

/// Deviation of f under turns of the sample about its normal, by angles drawn from `seed`.
pub fn isotropy(brdf: &dyn Brdf, pairs: &[DirectionPair], seed: u64) -> Deviation {
    let random = Random::new(seed);
    let turned = pairs.iter().zip(0..).map(|(pair, i)| {
        let [u] = random.point(i);
        let turn = DMat3::from_rotation_z(TAU * u);
        (*pair, pair.map(|v| turn * v))
    });
    Deviation::over(brdf, turned)
}

/// Deviation of f under mirrors through the t–n plane and through the b–n plane. For an
/// isotropic BRDF every plane that holds the normal follows.
pub fn bilateral_symmetry(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Deviation {
    let flips = [DVec3::new(1.0, -1.0, 1.0), DVec3::new(-1.0, 1.0, 1.0)];
    let flipped = |pair: &DirectionPair, flip: DVec3| (*pair, pair.map(|v| v * flip));
    let both = pairs
        .iter()
        .flat_map(|p| flips.map(|flip| flipped(p, flip)));
    Deviation::over(brdf, both)
}

impl Deviation {
    /// That of values at pairs from those at others.
    fn over(brdf: &dyn Brdf, both: impl Iterator<Item = (DirectionPair, DirectionPair)>) -> Self {
        both.fold(Self::default(), |mut found, (a, b)| {
            found.compare(brdf, &a, &b);
            found
        })
    }

    fn compare(&mut self, brdf: &dyn Brdf, a: &DirectionPair, b: &DirectionPair) {
        let n = brdf.channels().count();
        let [mut x, mut y] = [(); 2].map(|()| ChannelValues::from_elem(0.0, n));
        match (brdf.eval(a, &mut x), brdf.eval(b, &mut y)) {
            (Presence::Present, Presence::Present) => {
                self.compared += 1;
                for (x, y) in x.into_iter().zip(y) {
                    let size = x.abs().max(y.abs());
                    // A NaN is a deviation too; `>` alone would let it pass.
                    let d = if x == y { 0.0 } else { (x - y).abs() / size };
                    if d > self.max_relative || (d.is_nan() && !self.max_relative.is_nan()) {
                        self.max_relative = d;
                        self.worst = Some(*a);
                    }
                }
            }
            (Presence::Missing, Presence::Missing) => self.missing += 1,
            _ => self.one_sided += 1,
        }
    }
}
