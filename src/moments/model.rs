//! The model of a BRDF slice by its moments up to order 2 (Zubiaga et al. 2015, §3.1).
//!
//! ρ_θo(θ, φ) = α(θ_o) g_θ(θ) g_φ(φ) (Eq. 7): two Gaussians on [−π/2, π/2], each renormalised to
//! integral 1 ([`TruncatedGaussian`]), so that α is the energy of the slice exactly. It is separable, symmetric
//! about the plane of incidence and isotropic, neither reciprocal nor energy-conserving: a tool
//! for analysis, as a BRDF so that everything here works on it.
//!
//! At a view exactly along the normal the plane of incidence is undefined; there the model has the
//! slice whose plane is t–n, which turns with no sample.

mod curve;
mod gaussian;

pub(in crate::moments) use curve::Curve;
pub use gaussian::{TruncatedGaussian, gaussian_scaling};

use super::component::Order;
use super::profile::Profile;
use crate::brdf::{Brdf, Channels, Presence};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::parametrization::view_centered_angles;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// Rule that makes the Gaussians from mean and variance of a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SliceGaussians {
    /// Rule of the paper: mean and variance of the slice are centre and σ² of the Gaussian
    /// *before* it is cut off; mean and variance of the model are others (asked variance 0.823,
    /// π²/12: 0.546).
    Parameters,
    /// The truncated Gaussian has mean and variance of the slice. Where the slice is flatter than
    /// any Gaussian the exponent's sign turns: see [`TruncatedGaussian::matched`].
    #[default]
    Matched,
}

/// Moments of the slice at one view, a node of the model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SliceNode {
    /// View elevation, rad, in [0, π/2).
    pub theta_o: f64,
    /// Energy α, rad² sr⁻¹.
    pub energy: f64,
    /// Mean µ_θ, rad.
    pub mean: f64,
    /// Variances σ_θ², σ_φ², rad².
    pub variance: [f64; 2],
}

impl SliceNode {
    /// The nodes of a profile: each view whose moments up to order 2 are defined.
    pub(crate) fn of(profile: &Profile) -> Vec<Self> {
        let node = |(theta_o, slice): (&f64, &super::SliceMoments)| {
            let m = slice.moments;
            let [tt, _, pp] = m.covariance()?;
            (tt > 0.0 && pp > 0.0).then_some(Self {
                theta_o: *theta_o,
                energy: m.energy()?,
                mean: m.mean()?[0],
                variance: [tt, pp],
            })
        };
        profile
            .views
            .iter()
            .zip(&profile.slices)
            .filter_map(node)
            .collect()
    }
}

/// The slice of the model at one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceShape {
    /// Energy α, rad² sr⁻¹.
    pub energy: f64,
    /// Density g_θ, rad⁻¹.
    pub theta: TruncatedGaussian,
    /// Density g_φ, rad⁻¹.
    pub phi: TruncatedGaussian,
}

impl SliceShape {
    /// ρ(θ, φ), sr⁻¹, angles of [`view_centered`](crate::parametrization::view_centered) (rad).
    #[inline]
    pub(crate) fn value(&self, theta: f64, phi: f64) -> f64 {
        self.energy * self.theta.density(theta) * self.phi.density(phi)
    }
}

/// The slice model as a BRDF of one channel.
///
/// Energy and the parameters of both Gaussians are interpolated over the view elevation by
/// monotone cubics (Fritsch, Butland 1984) and constant past the last node. With matched
/// Gaussians, mean and variance are met at the nodes and nearly so between.
#[derive(Clone, Debug)]
pub struct SliceModel {
    /// Energy; then anchor, scale, tilt and curvature over θ, and over φ.
    curves: Vec<Curve>,
}

impl SliceModel {
    /// The model through nodes of strictly ascending view elevation.
    ///
    /// # Errors
    /// If there are none, one is out of range, or their views do not ascend.
    pub fn new(nodes: &[SliceNode], gaussians: SliceGaussians) -> Result<Self, ParameterError> {
        let mut rows = Vec::new();
        let mut last = f64::NEG_INFINITY;
        for node in nodes {
            if !(0.0..FRAC_PI_2).contains(&node.theta_o) || node.theta_o <= last {
                let allowed = "angles in [0, π/2), ascending";
                return Err(ParameterError::new("theta_o", node.theta_o, allowed));
            }
            last = node.theta_o;
            if !(node.energy >= 0.0 && node.energy.is_finite()) {
                let allowed = "a finite number, at least 0";
                return Err(ParameterError::new("energy", node.energy, allowed));
            }
            let mut row = vec![node.energy];
            for (axis, mean) in [node.mean, 0.0].into_iter().enumerate() {
                let variance = node.variance[axis];
                let lobe = match gaussians {
                    SliceGaussians::Matched => TruncatedGaussian::matched(mean, variance)?,
                    SliceGaussians::Parameters => TruncatedGaussian::new(mean, variance.sqrt())?,
                };
                row.extend(lobe.parameters());
            }
            rows.push(row);
        }
        let curve = |i: usize| {
            let points = nodes.iter().zip(&rows);
            Curve::new(points.map(|(node, row)| (node.theta_o, row[i])))
        };
        let curves: Option<Vec<Curve>> = (0..9).map(curve).collect();
        let allowed = "at least one view with moments";
        let curves = curves.ok_or_else(|| ParameterError::new("nodes", 0, allowed))?;
        Ok(Self { curves })
    }

    /// The model of a profile of order 2 or more; views whose moments are undefined are left out. A
    /// diffuse part that was subtracted stays subtracted.
    ///
    /// # Errors
    /// If the order is less, or as [`new`](Self::new).
    pub fn of(profile: &Profile, gaussians: SliceGaussians) -> Result<Self, ParameterError> {
        if profile.order.get() < 2 {
            let order: u8 = Order::into(profile.order);
            return Err(ParameterError::new("order", order, "2 or more"));
        }
        Self::new(&SliceNode::of(profile), gaussians)
    }

    /// The slice at a view elevation (rad).
    pub fn at(&self, theta_o: f64) -> SliceShape {
        let at: Vec<f64> = self.curves.iter().map(|c| c.at(theta_o)).collect();
        let lobe = |i: usize| TruncatedGaussian::raw(at[i], at[i + 1], at[i + 2], at[i + 3]);
        SliceShape {
            energy: at[0],
            theta: lobe(1),
            phi: lobe(5),
        }
    }
}

/// Value of a slice for a pair, sr⁻¹; 0 unless both directions are above the horizon.
#[inline]
fn value(shape: &SliceShape, pair: &DirectionPair) -> f64 {
    if !pair.is_above_horizon() {
        return 0.0;
    }
    let (i, o) = (pair.omega_i.vector(), pair.omega_o.vector());
    let sine = pair.omega_o.sin_theta();
    // The sample is turned until the view has azimuth 0.
    let (cos, sin) = if sine > 0.0 {
        (o.x / sine, o.y / sine)
    } else {
        (1.0, 0.0)
    };
    let turned = DVec3::new(i.x * cos + i.y * sin, i.y * cos - i.x * sin, i.z);
    let [theta, phi] = view_centered_angles(Direction::from_unit(turned));
    shape.value(theta, phi)
}

impl Brdf for SliceModel {
    fn channels(&self) -> &Channels {
        &Channels::Luminance
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry {
            isotropic: true,
            reciprocal: false,
            bilateral: true,
        }
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out[0] = value(&self.at(pair.omega_o.theta()), pair);
        Presence::Present
    }

    /// Neighbouring pairs mostly share their view: its slice is made once.
    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let mut known: Option<(Direction, SliceShape)> = None;
        for ((pair, out), presence) in pairs.iter().zip(out).zip(presence) {
            let shape = match known {
                Some((view, shape)) if view == pair.omega_o => shape,
                _ => self.at(pair.omega_o.theta()),
            };
            known = Some((pair.omega_o, shape));
            *out = value(&shape, pair);
            *presence = Presence::Present;
        }
    }
}
