//! Numbers of some 50 digits, to judge those of 16 by.

use astro_float_num::{BigFloat, Consts, RoundingMode, Sign};
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Bits of a number: 57 digits.
const BITS: usize = 192;
const NEAREST: RoundingMode = RoundingMode::ToEven;

thread_local! {
    /// π, ln 2 and the like, as far as they are known.
    static CONSTANTS: RefCell<Consts> =
        RefCell::new(Consts::new().expect("there is memory for a few constants"));
}

/// A real number, rounded to 192 bits after every operation.
#[derive(Clone, Debug, PartialEq, PartialOrd)]
pub(crate) struct Exact(BigFloat);

impl From<f64> for Exact {
    /// The number itself.
    fn from(x: f64) -> Self {
        // A subnormal number comes out as half of itself: it is lifted by a power of 2, which is exact.
        if x.abs() < f64::MIN_POSITIVE {
            let lift = 2f64.powi(200);
            return Self(BigFloat::from_f64(x * lift, BITS)) / Self(BigFloat::from_f64(lift, BITS));
        }
        Self(BigFloat::from_f64(x, BITS))
    }
}

impl Exact {
    /// π.
    pub(crate) fn pi() -> Self {
        CONSTANTS.with_borrow_mut(|constants| Self(constants.pi(BITS, NEAREST)))
    }

    /// Nearest `f64` but for the last bit; ±∞ beyond its range, 0 below it.
    pub(crate) fn to_f64(&self) -> f64 {
        if self.0.is_zero() {
            return 0.0;
        }
        let Some((words, _, sign, exponent, _)) = self.0.as_raw_parts() else {
            return if self.0.is_inf_pos() {
                f64::INFINITY
            } else if self.0.is_inf_neg() {
                f64::NEG_INFINITY
            } else {
                f64::NAN
            };
        };
        // The mantissa is in [½, 1), its highest word last; two factors reach the subnormal numbers.
        let top = words.last().map_or(0.0, |&w| w as f64) * 2f64.powi(-64);
        let half = exponent.clamp(-2200, 2200) / 2;
        let size = top * 2f64.powi(half) * 2f64.powi(exponent.clamp(-2200, 2200) - half);
        if sign == Sign::Neg { -size } else { size }
    }

    /// True of a number above 0.
    pub(crate) fn is_positive(&self) -> bool {
        self.0.is_positive() && !self.0.is_zero()
    }

    /// True of 0.
    pub(crate) fn is_zero(&self) -> bool {
        self.0.is_zero()
    }

    /// Square root; 0 of a number below 0.
    pub(crate) fn sqrt(&self) -> Self {
        if self.is_positive() {
            Self(self.0.sqrt(BITS, NEAREST))
        } else {
            0.0.into()
        }
    }

    /// Magnitude.
    pub(crate) fn abs(&self) -> Self {
        Self(self.0.abs())
    }

    /// e to this power.
    pub(crate) fn exp(&self) -> Self {
        CONSTANTS.with_borrow_mut(|c| Self(self.0.exp(BITS, NEAREST, c)))
    }

    /// Natural logarithm.
    pub(crate) fn ln(&self) -> Self {
        CONSTANTS.with_borrow_mut(|c| Self(self.0.ln(BITS, NEAREST, c)))
    }

    /// This number, which is not below 0, to a power; 0⁰ = 1.
    pub(crate) fn powf(&self, exponent: &Self) -> Self {
        match (exponent.is_zero(), self.is_positive()) {
            (true, _) => 1.0.into(),
            (_, false) => 0.0.into(),
            (false, true) => (self.ln() * exponent).exp(),
        }
    }

    /// Sine and cosine.
    pub(crate) fn sin_cos(&self) -> (Self, Self) {
        CONSTANTS.with_borrow_mut(|c| {
            let sin = self.0.sin(BITS, NEAREST, c);
            (Self(sin), Self(self.0.cos(BITS, NEAREST, c)))
        })
    }

    /// Angle (rad) of the vector (x, y), in (−π, π]; 0 of no vector.
    pub(crate) fn atan2(y: &Self, x: &Self) -> Self {
        if x.is_zero() && y.is_zero() {
            return 0.0.into();
        }
        let atan = |q: Self| CONSTANTS.with_borrow_mut(|c| Self(q.0.atan(BITS, NEAREST, c)));
        let two = Self::from(2.0);
        if y.abs() > x.abs() {
            let right = Self::pi() / &two;
            let right = if y.is_positive() { right } else { -right };
            return right - atan(x.clone() / y);
        }
        let angle = atan(y.clone() / x);
        match (x.is_positive(), y.is_positive() || y.is_zero()) {
            (true, _) => angle,
            (false, true) => angle + Self::pi(),
            (false, false) => angle - Self::pi(),
        }
    }

    /// The error function of a number in [0, 12], by its series.
    pub(crate) fn erf(&self) -> Self {
        let square = self.clone() * self;
        let mut term = self.clone();
        let mut sum = self.clone();
        for n in 1..700 {
            let n = f64::from(n);
            term = -(term * &square / &Self::from(n));
            let next = term.clone() / &Self::from(2.0 * n + 1.0);
            sum = sum + &next;
            if next.abs().to_f64() < 1e-60 && n > square.to_f64() {
                break;
            }
        }
        sum * &Self::from(2.0) / &Self::pi().sqrt()
    }
}

macro_rules! operation {
    ($trait:ident, $method:ident) => {
        impl $trait<&Exact> for Exact {
            type Output = Exact;
            fn $method(self, other: &Exact) -> Exact {
                Exact(self.0.$method(&other.0, BITS, NEAREST))
            }
        }
        impl $trait<Exact> for Exact {
            type Output = Exact;
            fn $method(self, other: Exact) -> Exact {
                self.$method(&other)
            }
        }
    };
}

operation!(Add, add);
operation!(Sub, sub);
operation!(Mul, mul);
operation!(Div, div);

impl Neg for Exact {
    type Output = Exact;
    fn neg(self) -> Exact {
        Exact(self.0.neg())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::sampling::Random;

    /// What `got` differs by from the exact number, in units of 2⁻⁵³ of the size that is given.
    pub fn off(got: f64, want: &Exact, size: f64) -> f64 {
        let off = Exact::from(got) - want;
        (off.to_f64() / size).abs() * 2f64.powi(53)
    }

    /// Numbers > 0, evenly spread over decades.
    pub fn numbers(n: u64, [least, most]: [f64; 2]) -> impl Iterator<Item = f64> {
        let random = Random::new(7);
        (0..n).map(move |i| {
            let [size] = random.point(i);
            10f64.powf(least + (most - least) * size)
        })
    }

    /// The functions are judged by `angles` and `powers`, which are judged by them.
    #[test]
    fn there_are_fifty_digits() {
        assert_eq!(Exact::from(5e-324).to_f64(), 5e-324);
        assert_eq!((Exact::from(1e-300) * &1e-300.into()).to_f64(), 0.0);
        for x in [0.3, 1.0, 2.5] {
            let (erf, root) = (
                Exact::from(x).erf().to_f64(),
                Exact::from(x).sqrt().to_f64(),
            );
            assert!((erf - libm::erf(x)).abs() <= 4e-16 && (root - x.sqrt()).abs() <= 4e-16);
        }
        let third = Exact::from(1.0) / &3.0.into();
        let rest = third * &3.0.into() - Exact::from(1.0);
        assert!(rest.to_f64().abs() < 1e-50);
        let (sin, cos) = Exact::from(0.7).sin_cos();
        let one = sin.clone() * &sin + cos.clone() * &cos - Exact::from(1.0);
        assert!(one.to_f64().abs() < 1e-50);
        let back = Exact::atan2(&sin, &cos) - Exact::from(0.7);
        assert!(back.to_f64().abs() < 1e-50);
    }
}
