//! Moments by adaptive cubature that finds the peak first.
//!
//! Where the mirror direction (−θ_o, 0) or the view itself (θ_o, 0) carries a peak, its half width
//! is found by bisection of scales, down to 1e-13 rad, and the square is cut into rectangles that
//! shrink by a factor of four towards it: a lobe of any width is resolved from the start, however
//! narrow it is. Rectangles whose error estimate is too large are then halved along the angle that
//! causes it until the sum of all estimates, carried over to every moment by its derivative, is
//! within the tolerance, or, of a reconstruction that is compared with a truth, within a fifth of the difference from it where that is more. A feature narrower than 1.5° anywhere else, or 5° of such a reconstruction, may be missed; no rule that
//! looks at finitely many values can promise more.

use super::component::{Component, Estimate, Moments, Order};
use super::cubature::{Cell, EVALUATIONS, Workspace};
use super::estimator::{Estimator, SliceMoments, Unresolved};
use super::mesh::{COARSE, COARSE_AGAINST, Peak, mesh, peaks};
use super::slice::Slice;
use super::tally::{Tally, powers, shifted};
use crate::error::{ParameterError, in_left_open};
use crate::parametrization::VIEW_CENTERED_AREA;
use crate::registry::declare;
use std::f64::consts::FRAC_PI_2;

declare! {
    impl dyn Estimator, "peak-resolving": "adaptive cubature that finds the peak first and keeps a tolerance", [
        "",
        "tolerance = 1e-6",
    ]
    /// Adaptive cubature around the peak.
    #[derive(Copy, PartialEq)]
    pub struct PeakResolving {
        /// Largest uncertainty: of the energy relative to it, of means relative to σ (to π/2 if no
        /// covariance is asked for), of covariances relative to σ², of standardised moments relative to
        /// the larger of 1 and the absolute moment of the same degrees, before anything is subtracted.
        tolerance: f64 = 1e-4;
        /// Most evaluations of the BRDF per slice.
        max_evaluations: usize = 1_000_000;
    }
}

impl PeakResolving {
    /// Most evaluations of the first mesh of a slice.
    const LEAST_EVALUATIONS: usize = 300_000;

    /// Largest uncertainty of a moment that is compared with a truth, as a share of the largest difference in its order, in the units of
    /// [`MomentErrors`](super::MomentErrors), where that is more than the tolerance.
    const OF_DIFFERENCE: f64 = 0.2;

    /// Integrates a slice; against the moments of a truth, if there are any.
    fn integrate(&self, slice: &Slice<'_>, truth: Option<&Moments>, order: Order) -> SliceMoments {
        let mut work = Workspace::default();
        let peaks = peaks(slice);
        let coarse = match truth {
            None => COARSE,
            Some(_) => COARSE_AGAINST,
        };
        let cells = mesh(&peaks, slice.is_mirrored(), coarse)
            .into_iter()
            .map(|r| Cell::new(slice, order, r, &mut work))
            .collect();
        let mut balance = Balance::new(cells, order, self.tolerance, truth);
        let mut evaluations = balance.cells.len() * EVALUATIONS + 2 * Peak::EVALUATIONS;
        loop {
            if balance.excess() <= 1.0 {
                balance.refresh();
                if balance.excess() <= 1.0 {
                    break;
                }
            }
            let mut worst = balance.worst();
            worst.truncate(self.max_evaluations.saturating_sub(evaluations) / (2 * EVALUATIONS));
            if worst.is_empty() {
                balance.refresh();
                break;
            }
            for (i, axis) in worst {
                let rectangle = balance.cells[i].cell.rectangle;
                let [below, above] = rectangle.cut(axis, rectangle.centre()[axis]);
                let mut half = |part| balance.judged(Cell::new(slice, order, part, &mut work));
                let [below, above] = [half(below), half(above)];
                balance.cells[i] = below;
                balance.cells.push(above);
                evaluations += 2 * EVALUATIONS;
            }
        }
        balance.finish(evaluations)
    }
}

impl Estimator for PeakResolving {
    fn label(&self) -> String {
        format!("{}-{:.0e}", Self::KIND, self.tolerance)
    }

    fn tolerance(&self) -> f64 {
        self.tolerance
    }

    fn check(&self) -> Result<(), ParameterError> {
        in_left_open("tolerance", self.tolerance, 0.0, 0.1)?;
        if self.max_evaluations < Self::LEAST_EVALUATIONS {
            let allowed = format!("a whole number, at least {}", Self::LEAST_EVALUATIONS);
            let key = "max_evaluations";
            return Err(ParameterError::new(key, self.max_evaluations, allowed));
        }
        Ok(())
    }

    fn estimate(&self, slice: &Slice<'_>, order: Order, _seed: u64) -> SliceMoments {
        self.integrate(slice, None, order)
    }

    fn estimate_against(
        &self,
        slice: &Slice<'_>,
        truth: &Moments,
        order: Order,
        _seed: u64,
    ) -> SliceMoments {
        self.integrate(slice, Some(truth), order)
    }
}

/// A cell and its errors.
struct Judged {
    cell: Cell,
    /// Errors of the components, in their scales, along both angles together.
    errors: [f64; 15],
    /// Largest error of a component along θ and along φ, in units of what is allowed of it.
    shares: [f64; 2],
}

/// The cells, their moments, and the errors of each.
struct Balance<'t> {
    cells: Vec<Judged>,
    order: Order,
    tolerance: f64,
    truth: Option<&'t Moments>,
    /// Largest error of each component, in its scale.
    allowed: [f64; 15],
    /// Propagation of errors with the moments of the cells at its making.
    propagation: Propagation,
    refreshed: usize,
}

impl<'t> Balance<'t> {
    /// An estimate is the difference of two rules, which now and then are wrong together, at a step
    /// in particular: it counts this many times.
    const SAFETY: f64 = 4.0;

    /// Errors of different cells have nothing to do with each other: their sum is taken as this
    /// many times the root of the sum of squares, or as the plain sum if that is less. Refinement
    /// stops where estimates are small by luck, and tables have kinks in every cell: one root would
    /// promise too much.
    const SIGMAS: f64 = 3.0;

    fn new(cells: Vec<Cell>, order: Order, tolerance: f64, truth: Option<&'t Moments>) -> Self {
        let mut balance = Self {
            propagation: Propagation::new(cells.iter(), order),
            refreshed: cells.len(),
            cells: Vec::new(),
            order,
            tolerance,
            truth,
            allowed: [tolerance; 15],
        };
        balance.allow();
        balance.cells = cells.into_iter().map(|c| balance.judged(c)).collect();
        balance
    }

    /// Carries every error over again, with the moments of all cells there are now.
    fn refresh(&mut self) {
        let cells = self.cells.iter().map(|c| &c.cell);
        self.propagation = Propagation::new(cells, self.order);
        self.refreshed = self.cells.len();
        self.allow();
        self.cells = self.cells.iter().map(|c| self.judged(c.cell)).collect();
    }

    /// Finds what is allowed with the moments that there are now: the tolerance, or a share of the largest difference from the truth
    /// in the order of a component: relative to the energy, in σ and σ² of the truth, of means in rad as well.
    fn allow(&mut self) {
        let Some(truth) = self.truth else {
            return;
        };
        let (values, scales) = (self.propagation.tally.values(), self.propagation.scales);
        let unit = |c: Component| match c.order() {
            0 => truth.energy(),
            1 | 2 => truth.unit(c),
            _ => Some(1.0),
        };
        let (mut most, mut most_rad) = ([0.0_f64; 5], 0.0_f64);
        for c in self.order.components() {
            let (value, truth, unit) = (values[c.index()], truth.get(c), unit(c));
            if let (Some(value), Some(truth), Some(unit)) = (value, truth, unit) {
                let off = (value - truth.value).abs();
                most[c.order()] = most[c.order()].max(off / unit.max(f64::MIN_POSITIVE));
                if c.order() == 1 {
                    most_rad = most_rad.max(off);
                }
            }
        }
        for c in self.order.components() {
            let (i, order) = (c.index(), c.order());
            let mut of_difference = most[order] * unit(c).unwrap_or(0.0);
            if order == 1 {
                of_difference = of_difference.min(most_rad);
            }
            let share = PeakResolving::OF_DIFFERENCE * of_difference / scales[i];
            // No scale: nothing to be uncertain of.
            let share = if share.is_finite() { share } else { 0.0 };
            self.allowed[i] = self.tolerance.max(share);
        }
    }

    fn judged(&self, cell: Cell) -> Judged {
        let mut both = [0.0; 15];
        let shares = [0, 1].map(|axis| {
            let errors = self
                .propagation
                .errors(cell.centre, &cell.differences[axis]);
            let mut largest = 0.0_f64;
            for ((sum, e), allowed) in both.iter_mut().zip(errors).zip(self.allowed) {
                let e = Self::SAFETY * e;
                *sum += e;
                largest = largest.max(e / allowed);
            }
            largest
        });
        Judged {
            cell,
            errors: both,
            shares,
        }
    }

    /// The error of each component over all cells, in its scale.
    fn totals(&self) -> [f64; 15] {
        let (mut sums, mut squares) = ([0.0; 15], [0.0; 15]);
        for cell in &self.cells {
            for (i, e) in cell.errors.iter().enumerate() {
                sums[i] += e;
                squares[i] += e * e;
            }
        }
        std::array::from_fn(|i| sums[i].min(Self::SIGMAS * squares[i].sqrt()))
    }

    /// Rounding of the sums, and of the angles against the smallest rectangle.
    fn rounding(&self) -> f64 {
        let sides = self.cells.iter().map(|c| {
            let rectangle = &c.cell.rectangle;
            rectangle.width(0).min(rectangle.width(1))
        });
        1e-14 + f64::EPSILON / sides.fold(FRAC_PI_2, f64::min)
    }

    /// The largest error in units of what rounding leaves of the allowed one; of half of it where
    /// rounding takes more, which no refinement mends.
    fn excess(&self) -> f64 {
        let rounding = self.rounding();
        // The 1e-9 keeps the sum of both below what is allowed whichever way it is rounded.
        self.largest(|error, allowed| {
            error / ((1.0 - 1e-9) * allowed - rounding).max(0.5 * allowed)
        })
    }

    /// The largest of a function of the error of each component and of what is allowed of it.
    fn largest(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        let both = self.totals().into_iter().zip(self.allowed);
        both.map(|(error, allowed)| of(error, allowed))
            .fold(0.0, f64::max)
    }

    /// The cells to be halved, worst first, each with the angle to halve: so many that the others
    /// together are within a third of the error there is, or half the tolerance.
    fn worst(&mut self) -> Vec<(usize, usize)> {
        // Moments that were far off in the beginning make a poor scale.
        if self.cells.len() > self.refreshed + self.refreshed / 2 {
            self.refresh();
        }
        let size = |i: usize| self.cells[i].shares[0] + self.cells[i].shares[1];
        let mut order: Vec<usize> = (0..self.cells.len()).collect();
        order.sort_by(|&a, &b| size(b).total_cmp(&size(a)).then(a.cmp(&b)));
        let (mut sum, mut squares) = (0.0, 0.0);
        for &i in &order {
            sum += size(i);
            squares += size(i) * size(i);
        }
        // A third of the way at a time: what is worth halving shows when the worst is gone, and
        // where the tolerance is out of reach the values go where they help most.
        let enough = f64::max(0.5, sum.min(Self::SIGMAS * f64::sqrt(squares)) / 3.0);
        let mut worst = Vec::new();
        for i in order {
            let rest = sum.min(Self::SIGMAS * f64::sqrt(squares.max(0.0)));
            if rest <= enough && !worst.is_empty() {
                break;
            }
            sum -= size(i);
            squares -= size(i) * size(i);
            let [theta, phi] = self.cells[i].shares;
            worst.push((i, usize::from(phi > theta)));
        }
        worst
    }

    fn finish(&self, evaluations: usize) -> SliceMoments {
        let cells = || self.cells.iter().map(|c| &c.cell);
        let share = |of: fn(&Cell) -> f64| {
            let area: f64 = cells().map(of).sum();
            (area / VIEW_CENTERED_AREA).clamp(0.0, 1.0)
        };
        let missing_share = share(|c| c.missing);
        let nothing = cells().all(|c| c.missing > c.area * (1.0 - 1e-12));
        let mut moments = Moments::default();
        if !nothing {
            let values = self.propagation.tally.values();
            let (scales, totals) = (self.propagation.scales, self.totals());
            let rounding = self.rounding();
            for c in self.order.components() {
                let i = c.index();
                moments.0[i] = values[i].map(|value| Estimate {
                    value,
                    uncertainty: (totals[i] + rounding) * scales[i],
                });
            }
        }
        let rounding = self.rounding();
        let excess = self.largest(|error, allowed| (error + rounding) / allowed);
        SliceMoments {
            moments,
            unresolved: (excess > 1.0 && !nothing).then_some(Unresolved::Tolerance { excess }),
            missing_share,
            clamped_share: share(|c| c.clamped),
            evaluations,
        }
    }
}

/// Propagation of errors from sums to moments, to first order.
struct Propagation {
    order: Order,
    tally: Tally,
    /// 1/σ_θ, 1/σ_φ.
    inverse: [f64; 2],
    /// Raw standardised central moments, 1 for (0, 0).
    k: [f64; 15],
    r: f64,
    /// Scale of the error of each component: α, σ, σ², and for standardised ones the
    /// larger of 1 and the absolute moment of the same degrees.
    scales: [f64; 15],
}

impl Propagation {
    fn new<'a>(cells: impl Iterator<Item = &'a Cell> + Clone, order: Order) -> Self {
        let mut tally = Tally::new(order);
        for cell in cells.clone() {
            tally.merge(&Tally::about(order, cell.centre, &cell.sums));
        }
        let weight = tally.weight().max(f64::MIN_POSITIVE);
        let sigma = match order.get() {
            // Without a covariance the square itself is the scale.
            0 | 1 => [FRAC_PI_2; 2],
            _ => [Component { n: 2, m: 0 }, Component { n: 0, m: 2 }]
                .map(|c| (tally.central(c) / weight).max(0.0).sqrt()),
        };
        let inverse = sigma.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 });
        let (px, py) = (powers(inverse[0]), powers(inverse[1]));
        let unit = |c: Component| px[c.n] * py[c.m] / weight;
        let mut k = [0.0; 15];
        for c in order.components() {
            k[c.index()] = tally.central(c) * unit(c);
        }
        let mut scales = [0.0; 15];
        let (sx, sy) = (powers(sigma[0]), powers(sigma[1]));
        for c in order.components() {
            scales[c.index()] = match c.order() {
                0 => tally.weight(),
                1 | 2 => sx[c.n] * sy[c.m],
                _ => 0.0,
            };
        }
        if order.get() > 2 {
            // Odd moments cancel between the two sides of the mean, their errors do not.
            let mean = tally.mean;
            for cell in cells {
                let [dx, dy] = [0, 1].map(|a| cell.centre[a] - mean[a]);
                let about_mean = shifted(&cell.sums, order, dx, dy);
                for c in order.components().skip(6) {
                    scales[c.index()] += about_mean[c.index()].abs() * unit(c);
                }
            }
            for scale in &mut scales[6..] {
                *scale = scale.max(1.0);
            }
        }
        Self {
            order,
            tally,
            inverse,
            k,
            r: k[4],
            scales,
        }
    }

    /// |error| of each component, in its scale, from an error of the sums about `centre`.
    fn errors(&self, centre: [f64; 2], difference: &[f64; 15]) -> [f64; 15] {
        let mut out = [0.0; 15];
        let weight = self.tally.weight();
        if weight <= 0.0 {
            return out;
        }
        let mean = self.tally.mean;
        let [dx, dy] = [0, 1].map(|a| centre[a] - mean[a]);
        let e = shifted(difference, self.order, dx, dy);
        let (px, py) = (powers(self.inverse[0]), powers(self.inverse[1]));
        let mut s = [0.0; 15];
        for c in self.order.components() {
            s[c.index()] = e[c.index()] / weight * px[c.n] * py[c.m];
        }
        out[0] = s[0].abs();
        if self.order.get() >= 1 {
            (out[1], out[2]) = (s[1].abs(), s[2].abs());
        }
        if self.order.get() < 2 {
            return out;
        }
        let d = [s[3] - s[0], s[4] - self.r * s[0], s[5] - s[0]];
        for i in 0..3 {
            out[3 + i] = d[i].abs();
        }
        let d_r = d[1] - 0.5 * self.r * (d[0] + d[2]);
        for c in self.order.components().skip(6) {
            let Component { n, m } = c;
            let i = c.index();
            let k = |n: usize, m: usize| self.k[Component { n, m }.index()];
            let mut error = s[i] - self.k[i] * s[0];
            if n > 0 {
                error -= n as f64 * s[1] * k(n - 1, m);
            }
            if m > 0 {
                error -= m as f64 * s[2] * k(n, m - 1);
            }
            // σ_θ and σ_φ change too.
            error -= self.k[i] * 0.5 * (n as f64 * d[0] + m as f64 * d[2]);
            error -= match (n, m) {
                (3, 1) | (1, 3) => 3.0 * d_r,
                (2, 2) => 4.0 * self.r * d_r,
                _ => 0.0,
            };
            out[i] = error.abs() / self.scales[i];
        }
        out
    }
}
