//! Paired comparison of two choices on the same materials: ratio, interval, test, verdict.

use super::bootstrap::Bootstrap;
use super::mean::{log_error, mean};
use super::wilcoxon::{holm, signed_rank};
use std::fmt::{self, Display, Formatter};

/// The usual band: a ratio of errors from 1/1.01 to 1.01 is no difference.
pub const BAND: f64 = 1.01;

/// p-values below this are findings; intervals are of 95 %.
pub const SIGNIFICANCE: f64 = 0.05;

/// Verdict on the first of two choices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Its errors are smaller.
    Better,
    /// Its errors are larger.
    Worse,
    /// The interval lies within the band: a difference too small to matter.
    Same,
    /// The materials do not decide.
    Undecided,
}

impl Display for Verdict {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.pad(match self {
            Verdict::Better => "better",
            Verdict::Worse => "worse",
            Verdict::Same => "no difference",
            Verdict::Undecided => "undecided",
        })
    }
}

/// A choice A against a choice B, by their errors on the same materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paired {
    /// Number of materials.
    pub n: usize,
    /// Geometric mean over materials of error of A / error of B; below 1 where A is better.
    pub ratio: f64,
    /// 95 % interval of the ratio over materials, see [`Bootstrap::mean_interval`]; `None` with too few materials.
    pub interval: Option<[f64; 2]>,
    /// Two-sided p of the log ratios, see [`signed_rank`] and [`Paired::adjusted`]; `None` with too few ratios other than 1.
    pub p: Option<f64>,
    /// Materials on which the error of A is below that of B by more than the band.
    pub wins: usize,
    /// Materials on which the error of A is above that of B by more than the band.
    pub losses: usize,
    /// The other materials.
    pub ties: usize,
    /// The largest ratio that is no difference, at least 1.
    pub band: f64,
}

impl Paired {
    /// Compares (error of A, error of B), one pair per material.
    ///
    /// Errors below [`super::EXACT`] count as that: two exact reconstructions are a tie. The order of
    /// materials does not matter; A and B exchanged invert the ratio and its interval. `None` of no
    /// pairs, where an error is negative or not finite, and of a band that is not finite or below 1.
    pub fn new(pairs: &[(f64, f64)], band: f64, bootstrap: &Bootstrap) -> Option<Self> {
        if !(band >= 1.0 && band.is_finite()) {
            return None;
        }
        let log_ratio = |(a, b): &(f64, f64)| Some(log_error(*a)? - log_error(*b)?);
        let mut logs = pairs.iter().map(log_ratio).collect::<Option<Vec<f64>>>()?;
        // By size, which exchanging A and B keeps: the same sets of materials are then drawn.
        logs.sort_by(|x, y| x.abs().total_cmp(&y.abs()).then(x.total_cmp(y)));
        let (wins, losses) = (
            logs.iter().filter(|l| **l < -band.ln()).count(),
            logs.iter().filter(|l| **l > band.ln()).count(),
        );
        let interval = bootstrap.mean_interval(&logs);
        Some(Self {
            n: logs.len(),
            ratio: mean(&logs)?.exp(),
            interval: interval.map(|ends| ends.map(f64::exp)),
            p: signed_rank(&logs),
            wins,
            losses,
            ties: logs.len() - wins - losses,
            band,
        })
    }

    /// The comparison of errors that are known to these relative standard errors (of A, of B; one pair per
    /// material), taken for independent: each end of the interval is further out, in quadrature.
    #[must_use]
    pub fn known_to(self, relative: &[(f64, f64)]) -> Self {
        let square: f64 = relative.iter().map(|(a, b)| a * a + b * b).sum();
        // 95 % of a normal distribution.
        let more = 1.96 * square.sqrt() / self.n as f64;
        if more == 0.0 {
            return self;
        }
        let centre = self.ratio.ln();
        let off = |end: f64| (end.ln() - centre).hypot(more);
        let wider = |[low, high]: [f64; 2]| [centre - off(low), centre + off(high)].map(f64::exp);
        Self {
            interval: self.interval.map(wider),
            ..self
        }
    }

    /// The comparison of B with A.
    #[must_use]
    pub(crate) fn inverted(&self) -> Self {
        Self {
            ratio: 1.0 / self.ratio,
            interval: self.interval.map(|[low, high]| [1.0 / high, 1.0 / low]),
            wins: self.losses,
            losses: self.wins,
            ..*self
        }
    }

    /// The verdict on A:
    ///
    /// - *no difference*: the whole interval lies within the band, whatever p is;
    /// - *better*, *worse*: the interval leaves out 1 and p is below [`SIGNIFICANCE`]. The interval asks for the mean of log
    ///   ratios, which one material may carry, the test for the side they lean to, which next to nothing on each may carry;
    /// - else *undecided*, also where there is no interval or no p: six ratios other than 1 are the fewest that decide.
    pub fn verdict(&self) -> Verdict {
        let Some([low, high]) = self.interval else {
            return Verdict::Undecided;
        };
        if 1.0 / self.band <= low && high <= self.band {
            return Verdict::Same;
        }
        match self.p {
            Some(p) if p < SIGNIFICANCE && high < 1.0 => Verdict::Better,
            Some(p) if p < SIGNIFICANCE && low > 1.0 => Verdict::Worse,
            _ => Verdict::Undecided,
        }
    }

    /// The comparisons, read together: with p-values adjusted by [`holm`], and the verdicts that follow.
    pub fn adjusted(comparisons: &[Self]) -> Vec<Self> {
        let p = comparisons.iter().map(|c| c.p.unwrap_or(f64::NAN));
        let p: Vec<f64> = p.collect();
        let with = |(c, p): (&Self, f64)| Self {
            p: c.p.and(Some(p)),
            ..*c
        };
        comparisons.iter().zip(holm(&p)).map(with).collect()
    }
}

/// `0.842 [0.790, 0.901], p = 0.0031, 20 wins, 3 losses, 1 tie: better`.
impl Display for Paired {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "{:.3}", self.ratio)?;
        if let Some([low, high]) = self.interval {
            write!(f, " [{low:.3}, {high:.3}]")?;
        }
        match self.p {
            Some(p) if p < 1e-4 => write!(f, ", p < 0.0001")?,
            Some(p) => write!(f, ", p = {p:.4}")?,
            None => {}
        }
        let counts = [
            (self.wins, "win", "wins"),
            (self.losses, "loss", "losses"),
            (self.ties, "tie", "ties"),
        ];
        for (count, one, many) in counts {
            write!(f, ", {count} {}", if count == 1 { one } else { many })?;
        }
        write!(f, ": {}", self.verdict())
    }
}
