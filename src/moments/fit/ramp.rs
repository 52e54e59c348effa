//! The Hermite ramp of an energy profile and its derivatives with respect to the knots.

use serde::Serialize;

/// Ramp of the energy towards grazing views (Zubiaga et al. 2015, §3.4 and Fig. 7a): 0 below
/// the knot θ_0, where it starts with slope 0; between the knots the cubic Hermite spline; beyond
/// θ_1, of which the paper says nothing, the straight line with the spline's value and slope there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ramp {
    /// θ_0 < θ_1, rad.
    pub knots: [f64; 2],
    /// Height h at θ_1, in the unit of the energy; may be negative.
    pub height: f64,
    /// Slope m_1 at θ_1, in the unit of the energy per rad; may be negative.
    pub slope: f64,
}

impl Ramp {
    /// The ramp at view elevation `theta` (rad), in the unit of the energy.
    pub fn value(&self, theta: f64) -> f64 {
        let [h, m] = basis(self.knots, theta);
        self.height * h + self.slope * m
    }
}

/// Weights of the height and of the slope at `theta`: with t = (θ − θ_0)/(θ_1 − θ_0), between the
/// knots t²(3 − 2t) and (θ_1 − θ_0) t²(t − 1).
pub(super) fn basis([lower, upper]: [f64; 2], theta: f64) -> [f64; 2] {
    if theta <= lower {
        return [0.0, 0.0];
    }
    if theta >= upper {
        return [1.0, theta - upper];
    }
    let width = upper - lower;
    let t = (theta - lower) / width;
    [t * t * (3.0 - 2.0 * t), width * t * t * (t - 1.0)]
}

/// Derivatives of [`basis`] with respect to θ_0 and to θ_1. They are continuous in the knots.
pub(super) fn basis_by_knots([lower, upper]: [f64; 2], theta: f64) -> [[f64; 2]; 2] {
    if theta <= lower {
        return [[0.0; 2]; 2];
    }
    if theta >= upper {
        return [[0.0; 2], [0.0, -1.0]];
    }
    let width = upper - lower;
    let t = (theta - lower) / width;
    let s = 1.0 - t;
    [
        [-6.0 * t * s * s / width, 2.0 * t * s * s],
        [-6.0 * t * t * s / width, t * t * (1.0 - 2.0 * t)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: [f64; 2] = [0.7, 1.2];

    #[test]
    fn derivatives_agree_with_differences() {
        let step = 1e-6;
        for i in 0..60 {
            let theta = 0.4 + 0.0181 * f64::from(i);
            let exact = basis_by_knots(KNOTS, theta);
            for knot in 0..2 {
                let at = |sign: f64| {
                    let mut knots = KNOTS;
                    knots[knot] += sign * step;
                    basis(knots, theta)
                };
                let (above, below) = (at(1.0), at(-1.0));
                for part in 0..2 {
                    let difference = (above[part] - below[part]) / (2.0 * step);
                    let error = (difference - exact[knot][part]).abs();
                    assert!(error < 1e-8, "θ {theta} knot {knot} part {part}: {error}");
                }
            }
        }
    }
}
