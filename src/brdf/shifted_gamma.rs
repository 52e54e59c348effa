//! The shifted-gamma microfacet model of Bagher, Soler and Holzschuch (EGSR 2012), whose fits to the
//! MERL materials are published.
//!
//! f_r = (rho_d + rho_s F D G/(cos θ_i cos θ_o))/π, each channel with parameters of its own,
//!
//! D = kap exp(−u)/(π u^p cos⁴θ_h),   u = alpha + tan²θ_h/alpha,
//! F = f0 − f1 cos θ_d + (1 − f0)(1 − cos θ_d)⁵,
//! G = g(θ_i) g(θ_o),   g(θ) = 1 + lambda (1 − exp(c max(0, θ − theta0)^k)), clamped to [0, 1].
//!
//! 1/π stands both in f_r and in D. `theta0_rad` is in radians, as published: c is in rad^−k, and a
//! theta0 in degrees would mix units in one formula. θ is needed itself, so this is the one model
//! here with an atan2 per direction.
//!
//! Nothing is normalised: F may be negative or above 1, and where g(90°) > 0 f_r diverges at the horizon.
//! Each channel is clamped at 0 (and held finite by the floor on the denominator); luminance is
//! that of the clamped channels. Energy conservation is not declared. Where the shape
//! parameters are grey, D, F and G are computed once.

use super::formula::formula;
use super::half_vector::half_above;
use super::spectrum::Spectrum::Rgb;
use super::spectrum::{planes, spread};
use super::{Brdf, Channels, Presence, Spectrum};
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use std::f64::consts::FRAC_1_PI;

formula! {
    "shifted-gamma": "shifted-gamma microfacets (SGD) of Bagher et al. 2012", [
        // gold-paint
        "rho_d = [0.147708, 0.0806975, 0.033172]\nrho_s = [0.160592, 0.217282, 0.236425]\nalpha = [0.122506, 0.108069, 0.12187]\np = [0.795078, 0.637578, 0.936117]\nf0 = [9.16095e-12, 1.81225e-12, 0.0024589]\nf1 = [-0.596835, -0.331147, -0.140729]\nkap = [5.98176, 7.35539, 5.29722]\nlambda = [2.64832, 3.04253, 2.3013]\nc = [9.3111e-08, 8.80143e-08, 9.65288e-08]\nk = [24.3593, 24.4037, 25.3623]\ntheta0_rad = [-0.284195, -0.277297, -0.245352]",
        // chrome
        "rho_d = [0.00697189, 0.00655268, 0.0101854]\nrho_s = [0.0930656, 0.041946, 0.104558]\nalpha = [0.00013, 0.0002, 6e-5]\np = [0.3, 0.36, 0.26]\nf0 = [0.256314, 0.819565, 3.22085e-13]\nf1 = [-0.743686, -0.180435, -1.0]\nkap = [2200.0, 2150.0, 4100.0]\nlambda = [3.8545, 4.44817, 5.40959]\nc = [5.30781e-08, 1.04045e-07, 1.8e10]\nk = [354.965, 349.356, 457.0]\ntheta0_rad = [0.526796, 0.528469, 1.00293]",
        "rho_d = 0.1\nrho_s = [0.2, 0.1, 0.05]\nalpha = 0.05\np = 0.4\nf0 = 0.1\nf1 = -0.05\nkap = 20.0\nlambda = 3.0\nc = 1e-7\nk = 30.0\ntheta0_rad = 0.1",
    ]
    /// The shifted-gamma model, as a config writes it; the defaults are the published fit to MERL's
    /// gold-paint. The ranges are about a hundred times what the published fits reach (c: what they reach);
    /// they keep every product finite.
    pub struct ShiftedGammaSpec {
        /// Diffuse albedo.
        rho_d: Spectrum = Rgb([0.147708, 0.0806975, 0.033172]), in 0.0..=1.0;
        /// Scale of the lobe.
        rho_s: Spectrum = Rgb([0.160592, 0.217282, 0.236425]), in 0.0..=1e3;
        /// Width of the distribution of normals.
        alpha: Spectrum = Rgb([0.122506, 0.108069, 0.12187]), in 1e-7..=1e2;
        /// Exponent of the gamma distribution.
        p: Spectrum = Rgb([0.795078, 0.637578, 0.936117]), in 0.0..=10.0;
        /// Fresnel term: constant part.
        f0: Spectrum = Rgb([9.16095e-12, 1.81225e-12, 0.0024589]), in -1e3..=1e3;
        /// Fresnel term: slope in cos θ_d.
        f1: Spectrum = Rgb([-0.596835, -0.331147, -0.140729]), in -1e3..=1e3;
        /// Scale of the distribution of normals.
        kap: Spectrum = Rgb([5.98176, 7.35539, 5.29722]), in 0.0..=1e7;
        /// Shadowing: depth.
        lambda: Spectrum = Rgb([2.64832, 3.04253, 2.3013]), in 0.0..=1e9;
        /// Shadowing: rate (rad^−k).
        c: Spectrum = Rgb([9.3111e-08, 8.80143e-08, 9.65288e-08]), in 0.0..=1e38;
        /// Shadowing: exponent.
        k: Spectrum = Rgb([24.3593, 24.4037, 25.3623]), in 0.0..=1e5;
        /// Shadowing: elevation where it sets in (rad).
        theta0_rad: Spectrum = Rgb([-0.284195, -0.277297, -0.245352]), in -10.0..=10.0;
    }
    label: [alpha],
    favours: HalfAngle,
    build: ShiftedGamma::new,
}

/// The shifted-gamma BRDF.
#[derive(Clone, Debug)]
pub struct ShiftedGamma {
    channels: Channels,
    /// rho_d/π.
    diffuse: Vec<f64>,
    /// rho_s/π², as many as `diffuse`: 1 if all parameters are grey, else one a colour or wavelength.
    lobe: Vec<f64>,
    /// As many, or 1 if they are the same.
    shape: Vec<Shape>,
}

/// alpha, p, f0, f1, kap, lambda, c, k and theta0 of one channel: those in which f_r is not linear.
type Shape = [f64; 9];

/// Angles of a pair, shared by the three channels.
struct Angles {
    theta_i: f64,
    theta_o: f64,
    tan2_h: f64,
    /// 1/cos⁴θ_h.
    sec4_h: f64,
    cos_d: f64,
}

/// π F D G.
#[inline]
fn value(&[alpha, p, f0, f1, kap, lambda, c, k, theta0]: &Shape, a: &Angles) -> f64 {
    let u = alpha + a.tan2_h / alpha;
    // exp(−745) is the last number above 0; cos⁴θ_h cannot underflow before.
    if u > 745.0 {
        return 0.0;
    }
    let w = 1.0 - a.cos_d;
    let f = f0 - f1 * a.cos_d + (1.0 - f0) * (w * w * w * w * w);
    let d = kap * (-u - p * u.ln()).exp() * a.sec4_h;
    let shadowing = |theta: f64| {
        let x = (theta - theta0).max(0.0);
        // The power and, for the largest published c, exp overflow; capped, or c = 0 and lambda = 0
        // would give 0·∞.
        let exponent = c * x.powf(k).min(1e300);
        let growth = exponent.exp_m1().min(1e300);
        (1.0 - lambda * growth).clamp(0.0, 1.0)
    };
    f * d * shadowing(a.theta_i) * shadowing(a.theta_o)
}

impl ShiftedGamma {
    /// The BRDF of a checked spec.
    pub fn new(spec: &ShiftedGammaSpec, channels: Channels) -> Self {
        let shapes = [
            &spec.alpha,
            &spec.p,
            &spec.f0,
            &spec.f1,
            &spec.kap,
            &spec.lambda,
            &spec.c,
            &spec.k,
            &spec.theta0_rad,
        ];
        let shape: Vec<Shape> = planes(shapes, &channels).collect();
        let albedos = [&spec.rho_d, &spec.rho_s];
        let count = shape.len().max(planes(albedos, &channels).len());
        let each =
            |s: &Spectrum| -> Vec<f64> { (0..count).map(|i| s.plane(i, &channels)).collect() };
        let over_pi = |rho: Vec<f64>| rho.into_iter().map(|rho| rho * FRAC_1_PI).collect();
        Self {
            diffuse: over_pi(each(&spec.rho_d)),
            lobe: over_pi(over_pi(each(&spec.rho_s))),
            shape,
            channels,
        }
    }
}

impl Brdf for ShiftedGamma {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::FULL
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    #[inline]
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let Some((h, cos_d)) = half_above(pair) else {
            out.fill(0.0);
            return Presence::Present;
        };
        let z2 = h.z * h.z;
        let angles = Angles {
            theta_i: pair.omega_i.theta(),
            theta_o: pair.omega_o.theta(),
            tan2_h: (h.x * h.x + h.y * h.y) / z2,
            sec4_h: 1.0 / (z2 * z2),
            cos_d,
        };
        let cosines = pair.omega_i.cos_theta() * pair.omega_o.cos_theta();
        let scale = 1.0 / cosines.max(DENOMINATOR_FLOOR);
        let mut shape = 0.0;
        spread(self.diffuse.len(), out, |c| {
            if let Some(of_channel) = self.shape.get(c) {
                shape = value(of_channel, &angles) * scale;
            }
            (self.diffuse[c] + self.lobe[c] * shape).max(0.0)
        });
        Presence::Present
    }
}
