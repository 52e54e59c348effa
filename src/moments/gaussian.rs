//! Gaussians on [−π/2, π/2], renormalised.

use crate::error::{ParameterError, in_left_open};
use crate::sampling::gauss_legendre;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
use std::sync::LazyLock;

/// Nodes on one panel, over which the exponent changes by at most [`PANEL`].
static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| gauss_legendre(16));
const PANEL: f64 = 4.0;
/// Distance below the peak (in the exponent) beyond which values add less than rounding does.
const NEGLIGIBLE: f64 = -45.0;

/// A density on [−π/2, π/2] (per rad) whose logarithm is a quadratic: a Gaussian cut off at both
/// ends and scaled to integral 1 (Zubiaga et al. 2015, Eqs. 7 and 8).
///
/// log p(t) = tilt u − curvature u²/2 + constant, u = (t − anchor)/scale. A curvature of 0 is an
/// exponential, or the uniform density; a negative one an *inverted* Gaussian, highest at one or
/// both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruncatedGaussian {
    anchor: f64,
    scale: f64,
    curvature: f64,
    /// Coordinate u of the highest point.
    peak: f64,
    /// Slope of the exponent there: 0 but at an end.
    slope: f64,
    /// Distances of the two ends from the peak, in u: ≤ 0 and ≥ 0.
    ends: [f64; 2],
    /// ∫ exp(exponent − its peak) du.
    mass: f64,
}

impl TruncatedGaussian {
    /// The Gaussian of this centre and this σ (rad, > 0), cut off. The centre (rad) may lie
    /// outside. Mean and variance of the result are *not* these parameters.
    ///
    /// # Errors
    /// If σ is not in (0, ∞) or the centre is not finite.
    pub fn new(centre: f64, sigma: f64) -> Result<Self, ParameterError> {
        in_left_open("sigma", sigma, 0.0, f64::INFINITY)?;
        if !centre.is_finite() {
            return Err(ParameterError::new("centre", centre, "a finite number"));
        }
        Ok(Self::raw(centre, sigma, 0.0, 1.0))
    }

    /// The member of the family with this mean (rad) and this variance (rad²).
    ///
    /// It exists for every pair that any density on [−π/2, π/2] has, 0 < variance < (π/2)² −
    /// mean²: quadratic exponents on a bounded interval are a regular exponential family, whose
    /// means of (t, t²) fill the interior of all that are possible. Variances above that of the
    /// flattest Gaussian (π²/12 at mean 0) give inverted ones.
    ///
    /// # Errors
    /// If the pair is impossible, or so close to the limit that rounding decides.
    pub fn matched(mean: f64, variance: f64) -> Result<Self, ParameterError> {
        let limit = (FRAC_PI_2 - mean) * (FRAC_PI_2 + mean);
        in_left_open("mean", mean.abs(), -1.0, FRAC_PI_2)?;
        in_left_open("variance", variance, 0.0, limit)?;
        let scale = variance.sqrt();
        // Newton's method on the convex function ln Z(tilt, curvature) + curvature/2, whose
        // gradient vanishes where the mean of u is 0 and that of u² is 1.
        let (mut tilt, mut curvature) = (0.0, 1.0);
        let mut now = Self::raw(mean, scale, tilt, curvature);
        let mut last = f64::INFINITY;
        for _ in 0..200 {
            let [m1, m2, c11, c12, c22] = now.sums();
            let gradient = [m1, 0.5 * (1.0 - m2)];
            let residual = m1.abs().max((m2 - 1.0).abs());
            // Rounding ends the progress; 1e-9 is what a caller may rely on.
            if residual < 1e-14 || (residual < 1e-9 && residual >= 0.5 * last) {
                return Ok(now);
            }
            last = residual;
            let hessian = [c11, -0.5 * c12, 0.25 * c22];
            let determinant = hessian[0] * hessian[2] - hessian[1] * hessian[1];
            if !(determinant > 0.0) {
                break;
            }
            let step = [
                -(hessian[2] * gradient[0] - hessian[1] * gradient[1]) / determinant,
                -(hessian[0] * gradient[1] - hessian[1] * gradient[0]) / determinant,
            ];
            let descent = gradient[0] * step[0] + gradient[1] * step[1];
            let height = now.log_mass(tilt) + 0.5 * curvature;
            let mut length = 1.0;
            loop {
                let (s, k) = (tilt + length * step[0], curvature + length * step[1]);
                let next = Self::raw(mean, scale, s, k);
                let lower = next.log_mass(s) + 0.5 * k <= height + 1e-4 * length * descent;
                // Near the end differences of heights are rounding: full steps are right there.
                if lower || residual < 1e-4 || length < 1e-6 {
                    (tilt, curvature, now) = (s, k, next);
                    break;
                }
                length *= 0.5;
            }
        }
        let allowed = format!("a number in (0, {limit}), and not at the limit");
        Err(ParameterError::new("variance", variance, allowed))
    }

    fn raw(anchor: f64, scale: f64, tilt: f64, curvature: f64) -> Self {
        let lo = (-FRAC_PI_2 - anchor) / scale;
        let hi = (FRAC_PI_2 - anchor) / scale;
        let height = |u: f64| u * (tilt - 0.5 * curvature * u);
        let (peak, slope) = if curvature > 0.0 {
            let centre = tilt / curvature;
            if centre <= lo {
                (lo, (tilt - curvature * lo).min(0.0))
            } else if centre >= hi {
                (hi, (tilt - curvature * hi).max(0.0))
            } else {
                (centre, 0.0)
            }
        } else if height(lo) > height(hi) {
            (lo, tilt - curvature * lo)
        } else {
            (hi, tilt - curvature * hi)
        };
        let mut lobe = Self {
            anchor,
            scale,
            curvature,
            peak,
            slope,
            ends: [lo - peak, hi - peak],
            mass: 1.0,
        };
        lobe.mass = lobe.closed_mass().unwrap_or_else(|| {
            let mut mass = 0.0;
            lobe.walk(|_, w| mass += w);
            mass
        });
        lobe
    }

    /// Exponent at v = u − peak, relative to the peak.
    #[inline]
    fn exponent(&self, v: f64) -> f64 {
        v * (self.slope - 0.5 * self.curvature * v)
    }

    /// ln ∫ exp(tilt u − curvature u²/2) du.
    fn log_mass(&self, tilt: f64) -> f64 {
        self.mass.ln() + self.peak * (tilt - 0.5 * self.curvature * self.peak)
    }

    /// The mass by error functions; `None` for inverted or nearly flat ones, where digits are lost.
    fn closed_mass(&self) -> Option<f64> {
        let [a, b] = self.ends;
        let k = self.curvature;
        if !(k * (b - a) * (b - a) > 1.0) {
            return None;
        }
        let unit = k.sqrt() * FRAC_1_SQRT_2;
        let both = if self.slope == 0.0 {
            libm::erf(b * unit) + libm::erf(-a * unit)
        } else {
            // The centre lies outside, where differences of erf lose everything: of scaled
            // complementary ones, they lose nothing.
            let beyond = self.slope.abs() / k;
            let width = b - a;
            let far = (-width * (self.slope.abs() + 0.5 * k * width)).exp();
            scaled_erfc(beyond * unit) - far * scaled_erfc((beyond + width) * unit)
        };
        Some((0.5 * PI / k).sqrt() * both)
    }

    /// Nodes v and weights (rule × density, not normalised) of a quadrature to rounding, from
    /// every high end down to where nothing is left.
    fn walk(&self, mut visit: impl FnMut(f64, f64)) {
        let [a, b] = self.ends;
        // Where the exponent turns: downwards from the peak, or upwards at the bottom between two
        // high ends.
        let turn = if self.curvature < 0.0 {
            (self.slope / self.curvature).clamp(a, b)
        } else {
            0.0
        };
        let mut descend = |from: f64, to: f64| {
            let sign = (to - from).signum();
            let mut v = from;
            while v != to && self.exponent(v) > NEGLIGIBLE {
                let slope = (self.slope - self.curvature * v).abs();
                let step = 2.0 * PANEL
                    / (slope + (slope * slope + 2.0 * PANEL * self.curvature.abs()).sqrt());
                let end = if step < (to - v).abs() {
                    v + sign * step
                } else {
                    to
                };
                let (middle, half) = (0.5 * (v + end), 0.5 * (end - v).abs());
                for (x, w) in RULE.iter() {
                    let node = middle + half * x;
                    visit(node, half * w * self.exponent(node).exp());
                }
                v = end;
            }
        };
        if self.curvature < 0.0 {
            descend(a, turn);
            descend(b, turn);
        } else {
            descend(turn, a);
            descend(turn, b);
        }
    }

    /// Means of u and u², variance of u, covariance of u and u², variance of u².
    fn sums(&self) -> [f64; 5] {
        let mut nodes = Vec::with_capacity(400);
        self.walk(|v, w| nodes.push((v + self.peak, w)));
        let mean = |of: &dyn Fn(f64) -> f64| {
            let sum: f64 = nodes.iter().map(|(u, w)| w * of(*u)).sum();
            sum / nodes.iter().map(|(_, w)| w).sum::<f64>()
        };
        let (m1, m2) = (mean(&|u| u), mean(&|u| u * u));
        let c11 = mean(&|u| (u - m1) * (u - m1));
        let c12 = mean(&|u| (u - m1) * (u * u - m2));
        let c22 = mean(&|u| (u * u - m2) * (u * u - m2));
        [m1, m2, c11, c12, c22]
    }

    /// Density at t (rad), rad⁻¹; 0 outside [−π/2, π/2].
    #[inline]
    pub fn density(&self, t: f64) -> f64 {
        if !(t.abs() <= FRAC_PI_2) {
            return 0.0;
        }
        let v = (t - self.anchor) / self.scale - self.peak;
        self.exponent(v).exp() / (self.mass * self.scale)
    }

    /// Mean (rad) and variance (rad²).
    ///
    /// With p the density and x its two ends, integration by parts gives for centre c and σ:
    /// mean = c + σ² (p(x₁) − p(x₂)), variance = σ² (1 + (x₁ − c) p(x₁) − (x₂ − c) p(x₂)) −
    /// (mean − c)². This is used where it keeps its digits; else a quadrature to rounding.
    pub fn mean_and_variance(&self) -> [f64; 2] {
        let [a, b] = self.ends;
        let k = self.curvature;
        let [mean, variance] = if self.slope == 0.0 && k * (b - a) * (b - a) > 1.0 {
            let [pa, pb] = [a, b].map(|v| self.exponent(v).exp() / self.mass);
            let mean = (pa - pb) / k;
            [mean, (1.0 + a * pa - b * pb) / k - mean * mean]
        } else {
            let (mut mass, mut mean, mut variance) = (0.0, 0.0, 0.0);
            self.walk(|v, w| {
                mass += w;
                mean += w * v;
            });
            mean /= mass;
            self.walk(|v, w| variance += w * (v - mean) * (v - mean));
            [mean, variance / mass]
        };
        [
            self.anchor + self.scale * (self.peak + mean),
            self.scale * self.scale * variance,
        ]
    }

    /// 1/σ², rad⁻²; 0 for an exponential, negative for an inverted Gaussian.
    pub fn precision(&self) -> f64 {
        self.curvature / (self.scale * self.scale)
    }
}

/// exp(x²) erfc(x) for x ≥ 0.
fn scaled_erfc(x: f64) -> f64 {
    if x < 20.0 {
        return (x * x).exp() * libm::erfc(x);
    }
    // Asymptotic series; at 20 the first term left out is 7e-16.
    let y = 0.5 / (x * x);
    let odd = [11.0, 9.0, 7.0, 5.0, 3.0, 1.0];
    let series = odd.iter().fold(1.0, |rest, n| 1.0 - n * y * rest);
    series / (x * PI.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scaled_error_function_is_continuous() {
        // exp(400) is good to 400 ulp.
        let (below, above) = (20.0 * (1.0 - 1e-15), 20.0);
        assert!((scaled_erfc(below) / scaled_erfc(above) - 1.0).abs() < 2e-13);
        assert_eq!(scaled_erfc(0.0), 1.0);
    }
}
