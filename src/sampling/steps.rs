//! Drawing from a list of weights.

/// A cumulative distribution over steps of equal width.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    /// 0, and the sums of the first weights, over the sum of all.
    sums: Vec<f64>,
    /// Where a search for each of as many even parts of [0, 1) begins (Chen and Asau 1974).
    guide: Vec<u32>,
}

impl Steps {
    /// Weights ≥ 0 and their sum.
    pub(crate) fn new(weights: &[f64], total: f64) -> Self {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for weight in weights {
            sum += weight;
            sums.push(if total > 0.0 { sum / total } else { 0.0 });
        }
        let n = weights.len();
        let mut step = 0;
        let guide = (0..n).map(|part| {
            while step + 1 < n && sums[step + 1] <= part as f64 / n as f64 {
                step += 1;
            }
            step as u32
        });
        let guide = guide.collect();
        Self { sums, guide }
    }

    /// The step that `u` in [0, 1) falls on, and where on it, in [0, 1].
    pub(crate) fn picked(&self, u: f64) -> (usize, f64) {
        // Steps of no height are never picked: u lies below the next sum, or is past the last.
        let n = self.guide.len();
        let sums = &self.sums;
        let mut step = self.guide[((u * n as f64) as usize).min(n - 1)] as usize;
        while step + 1 < n && sums[step + 1] <= u {
            step += 1;
        }
        // Rounding of the part may have begun too far on.
        while step > 0 && sums[step] > u {
            step -= 1;
        }
        let height = sums[step + 1] - sums[step];
        let t = if height > 0.0 {
            (u - sums[step]) / height
        } else {
            0.5
        };
        (step, t.clamp(0.0, 1.0))
    }

    /// Bytes that it holds.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.sums) + size_of_val(&*self.guide)
    }
}
