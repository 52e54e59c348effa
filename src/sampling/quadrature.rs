//! Gauss–Legendre quadrature: the rule of the `gauss-quad` crate for any number of nodes.
//!
//! ∫₋₁¹ p(x) dx = Σ w_j p(x_j), exact for polynomials of degree below 2n.

use gauss_quad::GaussLegendre;

/// The `n` nodes (ascending, inside (−1, 1)) and weights (summing to 2) on [−1, 1].
///
/// ```
/// let rule = gonio::sampling::gauss_legendre(5);
/// let integral: f64 = rule.iter().map(|(x, w)| w * x.powi(8)).sum();
/// assert!((integral - 2.0 / 9.0).abs() < 1e-14);
/// ```
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    match GaussLegendre::new(n) {
        Ok(rule) => {
            let mut pairs = rule.into_node_weight_pairs();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            pairs
        }
        // The crate has no rule of a single node: the midpoint rule is it.
        Err(_) if n == 1 => vec![(0.0, 2.0)],
        Err(_) => Vec::new(),
    }
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
