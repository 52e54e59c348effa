//! The fifteen moments of a slice up to order 4, and their values.

use crate::error::ParameterError;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The order up to which moments are computed, 0 to 4: energy, mean, covariance, co-skewness,
/// co-kurtosis. Higher ones are not computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Order(u8);

impl Order {
    /// The highest order.
    pub const MAX: Order = Order(4);

    /// The order of a number from 0 to 4; `None` above 4.
    pub fn new(order: u8) -> Option<Self> {
        (order <= 4).then_some(Self(order))
    }

    /// The order as a number, 0 to 4.
    #[inline]
    pub fn get(self) -> usize {
        usize::from(self.0)
    }

    /// Number of components up to this order.
    #[inline]
    pub fn count(self) -> usize {
        (self.get() + 1) * (self.get() + 2) / 2
    }

    /// The components up to this order, order by order.
    pub fn components(self) -> impl Iterator<Item = Component> {
        Component::ALL.into_iter().take(self.count())
    }
}

impl Default for Order {
    fn default() -> Self {
        Self::MAX
    }
}

impl TryFrom<u8> for Order {
    type Error = ParameterError;
    fn try_from(order: u8) -> Result<Self, ParameterError> {
        Self::new(order)
            .ok_or_else(|| ParameterError::new("order", order, "a whole number in [0, 4]"))
    }
}

impl From<Order> for u8 {
    fn from(order: Order) -> u8 {
        order.0
    }
}

/// The moment of degree n in θ and m in φ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Component {
    /// Degree in θ.
    pub n: usize,
    /// Degree in φ.
    pub m: usize,
}

impl Component {
    /// Every component up to order 4: (0,0), (1,0), (0,1), (2,0), (1,1), (0,2), …
    pub const ALL: [Component; 15] = {
        let mut all = [Component { n: 0, m: 0 }; 15];
        let (mut order, mut i) = (0, 0);
        while order <= 4 {
            let mut m = 0;
            while m <= order {
                all[i] = Component { n: order - m, m };
                i += 1;
                m += 1;
            }
            order += 1;
        }
        all
    };

    /// Energy, (0, 0).
    pub const ENERGY: Component = Component { n: 0, m: 0 };

    /// Its order, n + m.
    #[inline]
    pub fn order(self) -> usize {
        self.n + self.m
    }

    /// Position in [`ALL`](Self::ALL).
    #[inline]
    pub const fn index(self) -> usize {
        let order = self.n + self.m;
        order * (order + 1) / 2 + self.m
    }

    /// True if this vanishes for a slice that is symmetric about the plane of incidence.
    pub fn is_odd(self) -> bool {
        self.m % 2 == 1
    }

    /// Name of its order.
    pub(crate) fn family(self) -> &'static str {
        ["energy", "mean", "covariance", "skewness", "kurtosis"][self.order()]
    }
}

/// `energy`, `mean_10`, `covariance_11`, `kurtosis_22`: the order's name and the degrees.
impl fmt::Display for Component {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.order() {
            0 => f.write_str(self.family()),
            _ => write!(f, "{}_{}{}", self.family(), self.n, self.m),
        }
    }
}

/// A number and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// One standard deviation for a random estimator, a bound of the quadrature error for a
    /// deterministic one, in the unit of the value; and, of values that follow random paths, one
    /// standard error of these more. Infinite where it is not known.
    #[serde(with = "crate::numeric::infinite_as_null")]
    pub uncertainty: f64,
}

/// Moments of one slice.
///
/// Energy α = ∬ ρ dθ dφ (rad² sr⁻¹, no cosine and no solid-angle factor: a moment in the plane
/// (θ, φ), not an albedo). Every other one is of ρ/α: mean (rad), covariance (rad², central),
/// co-skewness (standardised by σ_θ and σ_φ), excess co-kurtosis (3, 3r, 1 + 2r², 3r, 3
/// subtracted for (4,0), (3,1), (2,2), (1,3), (0,4); r the correlation. Zubiaga et al. 2015 print
/// the case r = 0).
///
/// A component is `None` if it was not asked for or is undefined: everything where no part of the
/// slice has data, orders from 1 for a black slice, from 3 for one without width.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments(pub(super) [Option<Estimate>; 15]);

impl Moments {
    /// The estimate of a component; `None` if undefined or not asked for.
    #[inline]
    pub fn get(&self, component: Component) -> Option<Estimate> {
        self.0[component.index()]
    }

    /// The value of the component of degree `n` in θ and `m` in φ; n + m ≤ 4.
    #[inline]
    pub fn value(&self, n: usize, m: usize) -> Option<f64> {
        Some(self.get(Component { n, m })?.value)
    }

    /// Energy α, rad² sr⁻¹.
    pub fn energy(&self) -> Option<f64> {
        self.value(0, 0)
    }

    /// Mean (µ_θ, µ_φ), rad.
    pub fn mean(&self) -> Option<[f64; 2]> {
        Some([self.value(1, 0)?, self.value(0, 1)?])
    }

    /// Covariance Σ₂₀, Σ₁₁, Σ₀₂, rad².
    pub fn covariance(&self) -> Option<[f64; 3]> {
        Some([self.value(2, 0)?, self.value(1, 1)?, self.value(0, 2)?])
    }

    /// Standard deviations σ_θ, σ_φ (rad); `None` also if one of them is 0.
    pub fn sigma(&self) -> Option<[f64; 2]> {
        let [tt, _, pp] = self.covariance()?;
        (tt > 0.0 && pp > 0.0).then(|| [tt.sqrt(), pp.sqrt()])
    }

    /// σ_θ^n σ_φ^m, in whose units errors of means and covariances are compared.
    pub(super) fn unit(&self, c: Component) -> Option<f64> {
        let [theta, phi] = self.sigma()?;
        Some(theta.powi(c.n as i32) * phi.powi(c.m as i32))
    }

    /// Average variance (σ_θ² + σ_φ²)/2, rad².
    pub(crate) fn average_variance(&self) -> Option<f64> {
        let [tt, _, pp] = self.covariance()?;
        Some(0.5 * (tt + pp))
    }
}
