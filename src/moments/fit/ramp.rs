//! The Hermite ramp of an energy profile and its derivatives with respect to the knots.

/// Ramp of the energy towards grazing views (Zubiaga et al. 2015, §3.4 and Fig. 7a): 0 below
/// the knot θ_0, where it starts with slope 0; between the knots the cubic Hermite spline; beyond
/// θ_1, which the paper does not define, the straight line with the spline's value and slope there.
#[derive(Clone, Copy, Debug, PartialEq)]
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
