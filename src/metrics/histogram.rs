//! Weights by the size of a number, from which quantiles are read.

/// Weights by size of a number ≥ 0, in 32 steps for each factor of 2; several columns of them.
#[derive(Clone, Debug)]
pub(super) struct Histogram {
    columns: usize,
    /// Weight of each step, column after column of a step; empty without a weight.
    weights: Vec<f32>,
    /// The last step with a weight.
    last: usize,
}

impl Histogram {
    /// Bits of a number below those that count.
    const SHIFT: u32 = 52 - 5;

    /// The first step, of about 1e-9: what is smaller is in it and counts as 0.
    const LEAST: u64 = 0x3e11_2e0b_e826_d695 >> Self::SHIFT;

    /// The last step, of about 1e15, with what is larger.
    const LARGEST: u64 = 0x430c_6bf5_2634_0000 >> Self::SHIFT;

    pub(crate) fn new(columns: usize) -> Self {
        Self {
            columns,
            weights: Vec::new(),
            last: 0,
        }
    }

    /// The step of a number, counted from 0.
    #[inline(always)]
    pub(crate) fn step(x: f64) -> u64 {
        (x.to_bits() >> Self::SHIFT).clamp(Self::LEAST, Self::LARGEST) - Self::LEAST
    }

    /// Adds a weight for each column to a step.
    #[inline]
    pub(crate) fn add(&mut self, step: u64, weights: impl Iterator<Item = f64>) {
        if self.weights.is_empty() {
            let steps = (Self::LARGEST - Self::LEAST) as usize + 1;
            self.weights = vec![0.0; steps * self.columns];
        }
        let step = step as usize;
        self.last = self.last.max(step);
        let sums = &mut self.weights[step * self.columns..][..self.columns];
        for (sum, weight) in sums.iter_mut().zip(weights) {
            *sum += weight as f32;
        }
    }

    /// The number that `above` of the weight in a column of several together is above, linear within a step.
    pub(crate) fn quantile<'a>(
        all: impl Iterator<Item = &'a Self> + Clone,
        column: usize,
        above: f64,
    ) -> f64 {
        let at = |step: usize| f64::from_bits((step as u64 + Self::LEAST) << Self::SHIFT);
        let last = all.clone().map(|h| h.last).max().unwrap_or(0);
        let mut sum = 0.0;
        // From the largest: the few that count are sums of few.
        for step in (1..=last).rev() {
            let of = all
                .clone()
                .filter_map(|h| h.weights.get(step * h.columns + column));
            let here: f64 = of.map(|w| f64::from(*w)).sum();
            if here > 0.0 && sum + here >= above {
                let share = ((above - sum) / here).clamp(0.0, 1.0);
                return at(step + 1) - share * (at(step + 1) - at(step));
            }
            sum += here;
        }
        0.0
    }
}
