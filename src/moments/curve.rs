//! Monotone cubic interpolation of a quantity over the view elevation.

/// A piecewise cubic through points, monotone wherever the points are, with continuous slope
/// (Fritsch, Butland 1984): no overshoot, so that what is positive at the nodes is positive
/// between them, and points on a line give that line. Constant past both ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl Curve {
    /// Through points of strictly ascending x; `None` if there are none.
    pub(super) fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        if x.is_empty() {
            return None;
        }
        let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
        let secant: Vec<f64> = y
            .windows(2)
            .zip(&h)
            .map(|(w, h)| (w[1] - w[0]) / h)
            .collect();
        let n = x.len();
        let mut slope = vec![0.0; n];
        for i in 1..n - 1 {
            let (before, after) = (secant[i - 1], secant[i]);
            if before * after > 0.0 {
                // The harmonic mean keeps each slope within three times the smaller secant.
                let (a, b) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
                slope[i] = (a + b) / (a / before + b / after);
            }
        }
        match n {
            1 => {}
            2 => slope = vec![secant[0]; 2],
            _ => {
                slope[0] = end_slope([h[0], h[1]], [secant[0], secant[1]]);
                slope[n - 1] = end_slope([h[n - 2], h[n - 3]], [secant[n - 2], secant[n - 3]]);
            }
        }
        Some(Self { x, y, slope })
    }

    pub(super) fn value_at(&self, x: f64) -> f64 {
        let above = self.x.partition_point(|node| *node <= x);
        if above == 0 {
            return self.y[0];
        }
        let i = above - 1;
        if above == self.x.len() {
            return self.y[i];
        }
        let h = self.x[above] - self.x[i];
        let t = (x - self.x[i]) / h;
        let rest = 1.0 - t;
        let rise = self.y[above] - self.y[i];
        self.y[i]
            + t * t * (3.0 - 2.0 * t) * rise
            + h * t * rest * (rest * self.slope[i] - t * self.slope[above])
    }

    /// The first node.
    pub(super) fn first(&self) -> f64 {
        self.x[0]
    }

    /// The last node.
    pub(super) fn last(&self) -> f64 {
        self.x[self.x.len() - 1]
    }
}

/// The slope at an end, from the two nearest intervals, kept from overshooting.
fn end_slope(h: [f64; 2], secant: [f64; 2]) -> f64 {
    let slope = ((2.0 * h[0] + h[1]) * secant[0] - h[0] * secant[1]) / (h[0] + h[1]);
    if slope * secant[0] <= 0.0 {
        0.0
    } else if secant[0] * secant[1] <= 0.0 && slope.abs() > 3.0 * secant[0].abs() {
        3.0 * secant[0]
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_lines_and_monotone_points_stay_monotone() {
        let nodes = [0.0, 0.1, 0.4, 0.5, 1.0];
        let line = Curve::new(nodes.map(|x| (x, 2.0 - 0.6 * x))).unwrap();
        let step = Curve::new(nodes.map(|x| (x, f64::from(u8::from(x > 0.3))))).unwrap();
        let mut last = 0.0;
        for i in 0..=1000 {
            let x = f64::from(i) * 1e-3;
            assert!((line.value_at(x) - 2.0 + 0.6 * x).abs() < 1e-15);
            assert!(step.value_at(x) >= last && step.value_at(x) <= 1.0);
            last = step.value_at(x);
        }
        assert_eq!((line.value_at(-1.0), line.value_at(2.0)), (2.0, 1.4));
        assert!(Curve::new([]).is_none());
    }

    #[test]
    fn a_smooth_function_is_met_to_third_order() {
        let worst = |n: i32| {
            let curve = Curve::new(
                (0..=n)
                    .map(|i| f64::from(i) / f64::from(n))
                    .map(|x| (x, x.exp())),
            );
            let curve = curve.unwrap();
            (0..=777)
                .map(|i| f64::from(i) / 777.0)
                .map(|x| (curve.value_at(x) - x.exp()).abs())
                .fold(0.0, f64::max)
        };
        assert!(worst(10) < 1e-3 && worst(80) < worst(10) / 300.0);
    }
}
