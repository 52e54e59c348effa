//! Integrals over the square (θ, φ) by the cubature of [`PeakResolving`], which takes any
//! integrand as a BRDF.

use super::super::component::{Component, Moments, Order};
use super::super::estimator::Estimator;
use super::super::peak::PeakResolving;
use super::super::slice::{Batch, Channel, Kind, Slice};
use crate::brdf::{Brdf, Channels, Presence};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::lighting::Lighting;
use crate::parametrization::view_centered_angles;
use glam::DVec3;

/// Radiance of a lighting in one channel, the lighting turned about the normal.
#[derive(Clone, Copy)]
pub(super) struct Light<'a> {
    lighting: &'a dyn Lighting,
    channel: Channel,
    cos: f64,
    sin: f64,
}

impl<'a> Light<'a> {
    /// The light whose `azimuth` (rad) lies at azimuth 0 of the local frame.
    pub(super) fn new(lighting: &'a dyn Lighting, channel: Channel, azimuth: f64) -> Self {
        let (sin, cos) = azimuth.sin_cos();
        Self {
            lighting,
            channel,
            cos,
            sin,
        }
    }

    /// Radiance × cos θ cos² φ: times dθ dφ the irradiance.
    pub(super) fn arriving(&self, omega: Direction) -> f64 {
        let v = omega.vector();
        let turned = DVec3::new(
            v.x * self.cos - v.y * self.sin,
            v.x * self.sin + v.y * self.cos,
            v.z,
        );
        let rgb = self.lighting.radiance(Direction::from_unit(turned));
        let radiance = self.channel.select(&Channels::Rgb, &rgb);
        radiance * v.z.max(0.0) * v.x.hypot(v.z)
    }
}

/// One number per direction of the light, whatever the view, as a BRDF.
struct Integrand<T>(T);

impl<T> Brdf for Integrand<T>
where
    T: Fn(&[DirectionPair], &mut [f64], &mut [Presence]) + Send + Sync,
{
    fn channels(&self) -> &Channels {
        &Channels::Luminance
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::NONE
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let mut presence = [Presence::Missing];
        (self.0)(&[*pair], out, &mut presence);
        presence[0]
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        (self.0)(pairs, out, presence);
    }
}

/// Value × irradiance per dθ dφ; 0 of no value.
fn lit(value: f64, light: &Light<'_>, omega: Direction) -> f64 {
    match value > 0.0 {
        true => value * light.arriving(omega),
        false => 0.0,
    }
}

/// Reflected radiance and its uncertainty, share of the slice without data, and whether the
/// tolerance was reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reflected {
    pub(super) radiance: f64,
    pub(super) uncertainty: f64,
    pub(super) missing_share: f64,
    pub(super) resolved: bool,
}

/// Zubiaga et al. 2015, Eq. 9, of the slice itself.
pub(super) fn reflected(slice: Slice<'_>, light: Light<'_>, rule: &PeakResolving) -> Reflected {
    let theta_o = slice.theta_o;
    let integrand = Integrand(
        |pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]| {
            let mut batch = Batch::default();
            for pair in pairs {
                batch.push(&slice, pair.omega_i);
            }
            slice.evaluate(&mut batch);
            for (i, pair) in pairs.iter().enumerate() {
                presence[i] = match batch.kinds()[i] {
                    Kind::Missing => Presence::Missing,
                    _ => Presence::Present,
                };
                out[i] = lit(batch.values()[i], &light, pair.omega_i);
            }
        },
    );
    let nothing = Reflected {
        radiance: 0.0,
        uncertainty: 0.0,
        missing_share: 1.0,
        resolved: true,
    };
    let Ok(slice) = Slice::new(&integrand, Channel::Luminance, theta_o) else {
        return nothing;
    };
    let result = rule.estimate(&slice, order(0), 0);
    match result.moments.get(Component::ENERGY) {
        Some(energy) => Reflected {
            radiance: energy.value,
            uncertainty: energy.uncertainty,
            missing_share: result.missing_share,
            resolved: result.unresolved.is_none(),
        },
        None => nothing,
    }
}

/// The order of a number from 0 to 4.
fn order(n: u8) -> Order {
    Order::new(n).unwrap_or_default()
}

/// Moments up to order 4 of weight(θ, φ) × irradiance; `centre` is the θ the weight is
/// concentrated at, with φ = 0.
pub(super) fn weighted_light(
    weight: impl Fn(f64, f64) -> f64 + Send + Sync,
    centre: f64,
    light: Light<'_>,
    rule: &PeakResolving,
) -> Result<(Moments, f64), ParameterError> {
    // The cubature looks for narrow peaks at minus the view's elevation.
    let sign = if centre > 0.0 { -1.0 } else { 1.0 };
    let brdf = Integrand(
        |pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]| {
            for (pair, out) in pairs.iter().zip(out) {
                let v = pair.omega_i.vector();
                let omega = Direction::from_unit(DVec3::new(sign * v.x, v.y, v.z));
                let [theta, phi] = view_centered_angles(omega);
                *out = lit(weight(theta, phi), &light, omega);
            }
            presence.fill(Presence::Present);
        },
    );
    let slice = Slice::new(&brdf, Channel::Luminance, centre.abs())?;
    Ok((rule.estimate(&slice, Order::MAX, 0).moments, sign))
}
