//! The mean of the process as a function of a pair.

use super::kernel::{self, Block, Columns, Flat, LANES};
use super::line::Line;
use super::prior::Mean;
use super::space::Space;
use super::system::{Sites, Solved};
use super::{Account, LOG};
use crate::error::count_are;
use crate::geometry::DirectionPair;
use crate::numeric::vectorised;
use crate::reconstruct::interpolant::Interpolant;

/// The mean of the process given the readings.
pub(super) struct Process {
    pub parts: Vec<Part>,
    /// True if the readings contradict a prior that was given.
    pub contradicts: bool,
    /// Number of readings that all others contradict.
    pub left_out: usize,
    /// By how much ln f of a reading differs from that of the mean over apertures, at most.
    pub blurred: f64,
    pub space: Space,
}

/// Least logarithm of a ratio of a value and its mean over apertures from which on a peak is not determined: a factor of 1.5.
const BLURRED: f64 = 0.4;

/// The mean by one account of the readings.
pub(super) struct Part {
    share: f64,
    /// Terms of several columns, which are evaluated for each reading.
    terms: Vec<Flat>,
    /// Terms of one column.
    lines: Vec<Line>,
    blocks: Vec<Block>,
    /// Weights of the readings of a block, one array per value.
    weights: Vec<[f64; LANES]>,
    /// What is added to ln(f + ε) of each value everywhere.
    levels: Vec<f64>,
    /// What a prior and its functions add to it.
    mean: Option<Mean>,
}

impl Part {
    pub(crate) fn new(account: &Account, sites: &Sites, solved: &Solved) -> Self {
        let Solved { weights, levels } = solved;
        let columns = &sites.columns;
        let width = levels.len();
        let blocks = kernel::blocks(columns);
        let mut laid_out = vec![[0.0; LANES]; blocks.len() * width];
        for i in 0..weights.nrows() {
            for c in 0..width {
                laid_out[i / LANES * width + c][i % LANES] = weights[(i, c)];
            }
        }
        let kernel = &account.kernel;
        let (lines, terms): (Vec<Flat>, Vec<Flat>) = kernel
            .flat()
            .into_iter()
            .partition(|t| t.weights.len() == 1);
        let line = |t: &Flat| {
            let (column, square) = t.weights[0];
            let term = (t.amplitude, column, square.sqrt());
            Line::new(term, columns, weights)
        };
        let mean = account.known.as_ref().map(|known| {
            let update = &sites.functions * weights * kernel.share;
            known.prior.mean(&(&known.centre.mean + update))
        });
        Self {
            share: account.share,
            lines: lines.iter().map(line).collect(),
            terms,
            blocks,
            weights: laid_out,
            levels: levels.clone(),
            mean,
        }
    }

    /// Writes ln(f + ε) of pairs.
    pub(crate) fn eval(&self, pairs: &[DirectionPair], columns: &[Columns], out: &mut [f64]) {
        vectorised!(self.means(columns, out));
        for out in out.chunks_exact_mut(self.levels.len()) {
            out.iter_mut().zip(&self.levels).for_each(|(z, l)| *z += l);
        }
        if let Some(mean) = &self.mean {
            mean.add(pairs, out);
        }
    }

    /// Writes ln(f + ε) less its level at pairs.
    #[inline(always)]
    fn means(&self, columns: &[Columns], out: &mut [f64]) {
        let width = self.levels.len();
        let mut sums = vec![[0.0; LANES]; width];
        for (x, out) in columns.iter().zip(out.chunks_exact_mut(width)) {
            sums.fill([0.0; LANES]);
            for (block, weights) in self.blocks.iter().zip(self.weights.chunks_exact(width)) {
                let k = kernel::covariance(&self.terms, x, block);
                for (sum, weights) in sums.iter_mut().zip(weights) {
                    for i in 0..LANES {
                        sum[i] = k[i].mul_add(weights[i], sum[i]);
                    }
                }
            }
            for (out, sum) in out.iter_mut().zip(&sums) {
                *out = kernel::sum(sum);
            }
            for line in &self.lines {
                line.add(x, out);
            }
        }
    }
}

impl Interpolant for Process {
    fn width(&self) -> usize {
        self.parts[0].levels.len()
    }

    fn is_smooth(&self) -> bool {
        true
    }

    fn remarks(&self) -> Vec<String> {
        let remark = "the readings contradict the prior, which is left out";
        let contradicts = self.contradicts.then(|| remark.into());
        let blurred = (self.blurred > BLURRED).then(|| {
            format!(
                "a lobe is hardly wider than the apertures: its height, up to {:.1} times what was read, is not determined",
                self.blurred.exp()
            )
        });
        let left_out = (self.left_out > 0).then(|| {
            let are = count_are(self.left_out, "reading");
            format!("{are} left out, contradicted by all others (robust = false takes all)")
        });
        let all = [contradicts, left_out, blurred];
        all.into_iter().flatten().collect()
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let columns = self.space.columns(pairs);
        match self.parts.as_slice() {
            [part] => part.eval(pairs, &columns, out),
            parts => {
                let mut of_part = vec![0.0; out.len()];
                out.fill(0.0);
                for part in parts {
                    part.eval(pairs, &columns, &mut of_part);
                    let each = out.iter_mut().zip(&of_part);
                    each.for_each(|(z, of_part)| *z += part.share * of_part);
                }
            }
        }
        LOG.inverse_above(pairs, self.width(), out);
    }
}
