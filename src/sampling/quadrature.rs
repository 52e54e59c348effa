//! Gauss–Legendre quadrature.
//!
//! ∫₋₁¹ p(x) dx = Σ w_j p(x_j), exact for polynomials of degree below 2n. The nodes are the roots
//! of the Legendre polynomial P_n, the weights 2/((1 − x²) P_n'(x)²).

use std::f64::consts::PI;

/// The `n` nodes (ascending, inside (−1, 1)) and weights (summing to 2) on [−1, 1].
///
/// ```
/// let rule = gonio::sampling::gauss_legendre(5);
/// let integral: f64 = rule.iter().map(|(x, w)| w * x.powi(8)).sum();
/// assert!((integral - 2.0 / 9.0).abs() < 1e-15);
/// ```
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|j| {
            // Tricomi's estimate, good to O(n⁻⁴): Newton reaches the last bit in three or four steps,
            // and stays in its basin for every n.
            let size = n as f64;
            let angle = PI * (j as f64 + 0.75) / (size + 0.5);
            let mut x = -(1.0 - (size - 1.0) / (8.0 * size * size * size)) * angle.cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let value;
                (value, slope) = legendre(n, x);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// P_n(x) and its derivative, by the three-term recurrence; |x| < 1.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    for k in 1..=n {
        let k = k as f64;
        (before, value) = (
            value,
            ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k,
        );
    }
    (value, n as f64 * (before - x * value) / (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_below_degree_2n_are_exact() {
        for n in [1, 2, 3, 8, 31, 64, 200] {
            let rule = gauss_legendre(n);
            assert!(rule.windows(2).all(|pair| pair[0].0 < pair[1].0));
            for degree in [0, 1, n, 2 * n - 2, 2 * n - 1] {
                let got: f64 = rule.iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                let want = if degree % 2 == 0 {
                    2.0 / (degree as f64 + 1.0)
                } else {
                    0.0
                };
                // Rounding of 200 weights near the ends adds up to some 1e-14.
                assert!((got - want).abs() < 1e-13, "{n} {degree}: {got} {want}");
            }
        }
    }
}
