//! The moments of a mixture under a light through a window over the view, in closed form.
//!
//! Let the view move by τ, and the centre of a component of energy α by c τ in the chart. Through a window exp(−(τ − d)²/(2v²)), and
//! with ln α linear and quadratic in τ (a, q), light from (θ, φ) is seen with weight exp(c₀ + b τ − p τ²/2) times α over 2π σ_θ σ_φ,
//!
//! - p = 1/v² − q + c_θ²/σ_θ² + c_φ²/σ_φ²,
//! - b = d/v² + a + c_θ (θ − µ)/σ_θ² + c_φ φ/σ_φ²,
//! - c₀ = −(d²/v² + (θ − µ)²/σ_θ² + φ²/σ_φ²)/2:
//!
//! a normal density of τ of mean b/p and variance 1/p, which is cut to the views that are rendered. Its raw moments are summed over
//! the light. Where the view turns about the normal by the angle ȧ τ, (θ, φ) moves by ȧ τ sin θ along φ: c_φ is that of the place, so
//! that a lobe is sheared; that it also moves by −ȧ τ cos θ tan φ along θ is left out, since along the great circle the rise of the
//! view cancels it in the centre. Near the normal, where the view turns fast, lobes are round, and c is that of the centre.

use super::integrand::Light;
use super::mixture::{Gaussian, MOST_CURVED, Mixture};
use super::motion::Place;
use crate::parametrization::view_centered;
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

/// Moments of t of orders 0 to 4, about t = 0.
pub(super) type Raw = [f64; 5];

/// σ of what is summed over the light, on either side.
const REACH: f64 = 7.0;

/// Elevation of a view, rad, up to which its lobe is round: where the view turns about the normal, the lobe moves and is not sheared.
const ROUND: f64 = 0.1;

/// Nodes per σ of the sum over the light: of smooth light 1.1 err by 1e-9.
const PER_SIGMA: f64 = 4.0;

/// A window exp(−(t − centre)²/(2 width²)) times an amplitude, over the views from `range[0]` to `range[1]`; angles in rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub centre: f64,
    pub width: f64,
    pub amplitude: f64,
    pub range: [f64; 2],
}

/// A window over the view as a sum of narrower ones at most `widest` wide (rad), those that reach into its range: of width
/// w² = u² + v², W(t) = Σ_j h w/(v u √(2π)) exp(−t_j²/(2u²)) exp(−(t − t_j)²/(2v²)), t_j = j h, h = v ≤ w/1.5. The sum is that over
/// a Gaussian of t_j of width uv/w, to 4e-5.
pub(super) fn narrow(width: f64, widest: f64, range: [f64; 2]) -> Vec<Window> {
    if width <= widest * (1.0 + 1e-9) {
        return vec![Window {
            centre: 0.0,
            width,
            amplitude: 1.0,
            range,
        }];
    }
    let v = widest.min(width / 1.5);
    let u = (width * width - v * v).sqrt();
    let at = |j: i64| {
        let t = j as f64 * v;
        let amplitude = width / (u * TAU.sqrt()) * (-0.5 * (t / u).powi(2)).exp();
        Window {
            centre: t,
            width: v,
            amplitude,
            range,
        }
    };
    let reach = 4.5 * u / v;
    let [lo, hi] = range;
    let first = (-reach).max(lo / v - 5.0).floor() as i64;
    let last = reach.min(hi / v + 5.0).ceil() as i64;
    (first..=last).map(at).collect()
}

/// Raw moments of t of the light that a mixture reflects through a window; `place` is where the view of the mixture stands,
/// and `step` the largest distance of directions of the light, rad.
pub(super) fn moments(
    mixture: &Mixture,
    window: &Window,
    place: &Place,
    light: &Light<'_>,
    step: f64,
) -> Raw {
    let mut sum = [0.0; 5];
    for component in &mixture.components {
        let of = of_component(component, window, place, light, step);
        sum.iter_mut().zip(of).for_each(|(sum, of)| *sum += of);
    }
    sum
}

/// The sum over the light of one component.
fn of_component(g: &Gaussian, window: &Window, place: &Place, light: &Light<'_>, step: f64) -> Raw {
    let v2 = window.width * window.width;
    let off = window.centre - place.t;
    let rate = place.elevation[0];
    let is_sheared = place.theta_o > ROUND;
    let [_, first, second] = g.log_energy;
    // ln α is even about the normal, of slope q θ_o beside it.
    let slope = if is_sheared {
        first
    } else {
        second * place.theta_o
    };
    let (a, q) = (
        first * rate,
        // The window has to fall.
        (second * rate * rate + slope * place.elevation[1]).min(MOST_CURVED / v2),
    );
    let [mu, along] = [g.centre[0], g.centre[1] * rate];
    let [st, sp] = g.sigma;
    // Where the window and the energy together are greatest, and how wide they are: a light matters around that.
    let own = 1.0 / v2 - q;
    let (middle, spread) = ((off / v2 + a) / own, own.sqrt().recip());
    // And a lobe moves across as it does along θ.
    let across = match is_sheared {
        true => place.turn * mu.sin(),
        false => g.centre[1] * place.turn * place.theta_o.sin(),
    };
    let theta = Nodes::new(mu + along * middle, st.hypot(along * spread), step);
    let phi = Nodes::new(across * middle, sp.hypot(across * spread), step);
    let scale = window.amplitude * g.log_energy[0].exp() / (TAU * st * sp) * theta.step * phi.step;
    let mut sum = [0.0; 5];
    for theta in theta.all() {
        let x = (theta - mu) / st;
        // Velocity of the place over the σ of the lobe.
        let cx = along / st;
        let cy = match is_sheared {
            true => place.turn * theta.sin() / sp,
            false => across / sp,
        };
        let p = own + cx * cx + cy * cy;
        let deviation = p.sqrt().recip();
        let of_theta = off / v2 + a + cx * x;
        for phi in phi.all() {
            let y = phi / sp;
            let b = of_theta + cy * y;
            let log = 0.5 * (b * b / p - off * off / v2 - x * x - y * y);
            if log < -40.0 {
                continue;
            }
            let weight = log.exp() * light.arriving(view_centered(theta, phi));
            if weight > 0.0 {
                let of = cut_moments(place.t + b / p, deviation, window.range);
                let weight = scale * weight * deviation * TAU.sqrt();
                let each = sum.iter_mut().zip(of);
                each.for_each(|(sum, of)| *sum += weight * of);
            }
        }
    }
    sum
}

/// Equally spaced angles within reach of a centre, inside the square of the chart: the midpoint rule, which of what falls as a
/// Gaussian does errs by less than any power of the step.
struct Nodes {
    first: f64,
    step: f64,
    count: usize,
}

impl Nodes {
    fn new(centre: f64, sigma: f64, largest: f64) -> Self {
        let low = (centre - REACH * sigma).clamp(-FRAC_PI_2, FRAC_PI_2);
        let high = (centre + REACH * sigma).clamp(-FRAC_PI_2, FRAC_PI_2);
        let length = (high - low).min(PI);
        let count = (length / (sigma / PER_SIGMA).min(largest)).ceil().max(1.0);
        let step = length / count;
        Self {
            first: low + 0.5 * step,
            step,
            count: count as usize,
        }
    }

    fn all(&self) -> impl Iterator<Item = f64> {
        (0..self.count).map(|i| self.first + self.step * i as f64)
    }
}

/// Raw moments of a normal variable that counts between two ends only; of order 0 the probability to lie there.
fn cut_moments(mean: f64, deviation: f64, [lo, hi]: [f64; 2]) -> Raw {
    let variance = deviation * deviation;
    let mut raw = [1.0, mean, 0.0, 0.0, 0.0];
    let [a, b] = [lo, hi].map(|end| (end - mean) / deviation);
    let is_inside = a < -9.0 && b > 9.0;
    let [at_lo, at_hi] = match is_inside {
        true => [0.0; 2],
        false => [a, b].map(|z| deviation * (-0.5 * z * z).exp() / TAU.sqrt()),
    };
    if !is_inside {
        // Of the tail, or the difference would have no digits.
        raw[0] = match a > 0.0 {
            true => 0.5 * (libm::erfc(a / SQRT_2) - libm::erfc(b / SQRT_2)),
            false => 0.5 * (libm::erfc(-b / SQRT_2) - libm::erfc(-a / SQRT_2)),
        };
        raw[1] = mean * raw[0] + at_lo - at_hi;
    }
    for n in 2..5 {
        let ends = lo.powi(n as i32 - 1) * at_lo - hi.powi(n as i32 - 1) * at_hi;
        raw[n] = mean * raw[n - 1] + (n - 1) as f64 * variance * raw[n - 2] + ends;
    }
    raw
}

#[cfg(test)]
mod tests {
    use super::super::Along;
    use super::super::integrand::Light;
    use super::*;
    use crate::geometry::Direction;
    use crate::lighting::Lighting;
    use crate::moments::Channel;
    use crate::parametrization::view_centered_angles;

    const RANGE: [f64; 2] = [-0.9, 0.35];

    struct Blob;

    impl Lighting for Blob {
        fn radiance(&self, omega: Direction) -> [f64; 3] {
            let [theta, phi] = view_centered_angles(omega);
            let square = (theta + 0.5).powi(2) + (phi - 0.1).powi(2);
            [(-50.0 * square).exp(); 3]
        }
    }

    fn close(a: &Raw, b: &Raw, tolerance: f64) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance * b.abs(), "{a} {b}");
        }
    }

    /// Raw moments of a function over the range, by the midpoint rule.
    fn raw(n: u32, f: impl Fn(f64) -> f64) -> Raw {
        let step = (RANGE[1] - RANGE[0]) / f64::from(n);
        let mut sum = [0.0; 5];
        for i in 0..n {
            let t = RANGE[0] + step * (f64::from(i) + 0.5);
            let f = step * f(t);
            (0..5).for_each(|k| sum[k] += f * t.powi(k as i32));
        }
        sum
    }

    #[test]
    fn narrow_windows_add_up_to_a_wide_one() {
        let gaussian =
            |w: &Window, t: f64| w.amplitude * (-0.5 * ((t - w.centre) / w.width).powi(2)).exp();
        for ratio in [1.0, 1.0001, 1.02, 1.1, 1.3, 1.7, 3.9, 20.0] {
            let parts = narrow(0.35, 0.35 / ratio, [-1.4, 1.4]);
            for t in (-10..=10).map(|i| 0.1 * f64::from(i)) {
                let sum: f64 = parts.iter().map(|w| gaussian(w, t)).sum();
                let whole = (-0.5 * (t / 0.35_f64).powi(2)).exp();
                assert!((sum - whole).abs() < 1e-4, "{ratio}, {t}: {sum} {whole}");
            }
        }
    }

    #[test]
    fn moments_between_ends_are_those_of_a_quadrature() {
        for (mean, deviation) in [(0.0, 0.1), (0.5, 0.2), (-0.3, 0.9), (2.0, 0.3), (-1.4, 0.1)] {
            let density = |t: f64| (-0.5 * ((t - mean) / deviation).powi(2)).exp();
            let by_sum = raw(40_000, |t| density(t) / (deviation * TAU.sqrt()));
            close(&cut_moments(mean, deviation, RANGE), &by_sum, 1e-6);
        }
    }

    /// The definition: a view at t sees ∫ α N(θ; µ + c t, σ_θ) N(φ; ȧ t sin θ, σ_φ) L cos θ cos² φ.
    #[test]
    fn the_closed_form_is_the_sum_over_views() {
        let component = Gaussian {
            log_energy: [-0.3, 0.8, -2.0],
            centre: [-0.6, -0.7],
            sigma: [0.2, 0.15],
        };
        let mixture = Mixture {
            components: vec![component],
            misfit: 0.0,
        };
        let light = Light::new(&Blob, Channel::Luminance, 0.0);
        let window = Window {
            centre: 0.05,
            width: 0.18,
            amplitude: 0.8,
            range: RANGE,
        };
        for along in [Along::Theta, Along::Phi, Along::Azimuth] {
            let place = along.place(0.7, 0.02);
            let radiance = |t: f64| {
                let (tau, off) = (t - place.t, (t - window.centre) / window.width);
                let [first, second] = place.elevation;
                let (a, q) = (0.8 * first, -2.0 * first * first + 0.8 * second);
                let energy = (-0.3 + a * tau + 0.5 * q * tau * tau - 0.5 * off * off).exp();
                let n = 60;
                let step = 1.6 / f64::from(n);
                let mut sum = 0.0;
                for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                    let [theta, phi] = [i, j].map(|k| -0.8 + step * (f64::from(k) + 0.5));
                    let theta = theta - 0.5;
                    let x = (theta + 0.6 + 0.7 * first * tau) / 0.2;
                    let y = (phi - place.turn * theta.sin() * tau) / 0.15;
                    let lobe = (-0.5 * (x * x + y * y)).exp() / (TAU * 0.2 * 0.15);
                    let inside = theta.abs() < FRAC_PI_2;
                    sum += if inside {
                        lobe * light.arriving(view_centered(theta, phi))
                    } else {
                        0.0
                    };
                }
                0.8 * energy * sum * step * step
            };
            let by_sum = raw(200, radiance);
            let found = moments(&mixture, &window, &place, &light, 0.03);
            close(&found, &by_sum, 2e-3);
        }
    }
}
