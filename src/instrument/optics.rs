//! Averages of a BRDF over finite apertures.
//!
//! Light arrives from a cap of directions around ω_i and is collected over a cap around ω_o, both
//! evenly per solid angle. A reading is relative to a Lambertian tile under the same apertures, so
//! what is reported is
//!
//! value = ⟨f_r cos θ_i⟩ / ⟨cos θ_i⟩,
//!
//! both averages over both caps (four dimensions), a direction below the horizon counting as 0 in
//! either. This is the mean reflectance factor of a conical–conical geometry (Nicodemus et al. 1977)
//! over that of the tile, times the tile's f_r.
//!
//! Three steps, each only where the one before is not good enough:
//! 1. a sparse rule of 37 points, exact to degree 5 (Smolyak's sum of rules for the disk),
//! 2. products of disk rules of rising degree,
//! 3. an adaptive rule in the half vector, see `lobe`: a reflection lobe depends on two of the four
//!    dimensions, and there alone must the cells be small.
//!
//! A peak is looked for where peaks are, at the mirror direction and at the retro direction. A
//! feature far narrower than the apertures anywhere else can be missed: finitely many values cannot
//! promise more.

mod batch;
mod disk;
mod footprint;
mod lens;
mod lobe;

pub use footprint::{Filling, Footprint, collected, footprint};

use crate::brdf::{Brdf, ChannelValues};
use crate::geometry::DirectionPair;
pub use batch::Workspace;
use batch::{Sums, ratio, ratios, weight};
use disk::{Disk, PRODUCTS, Rules};
use lens::Lens;
use lobe::{Peak, PeakKind};

/// Tolerance and cost limit of an average.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Largest error relative to the value, in (0, 0.1].
    pub relative: f64,
    /// An error that never matters, sr⁻¹: below it a tail is not followed.
    pub absolute: f64,
    /// Values of the BRDF after which an average is refined no further. Where they do not suffice
    /// the error that is reported is larger than the tolerance.
    pub refinement: usize,
}

impl Tolerance {
    /// The most values of the BRDF that one average costs. The last refinement takes up to twice
    /// what all before may have cost, and the first look at the narrowest peak in the widest
    /// apertures 1.7 million whatever the refinement.
    pub fn max_evaluations(&self) -> usize {
        (3 * self.refinement).max(2_000_000)
    }
}

impl Default for Tolerance {
    fn default() -> Self {
        Self {
            // Less than the tiles of the presets are uncertain, which goes into every reading.
            relative: 1e-3,
            absolute: 1e-12,
            refinement: 100_000,
        }
    }
}

/// Rounding of a sum of some thousand products, relative.
const ROUNDING: f64 = 1e-13;

/// One average over both apertures.
#[derive(Clone, Debug, PartialEq)]
pub struct Average {
    /// f_r of every channel, sr⁻¹.
    pub value: ChannelValues,
    /// Bound of the error of the quadrature of every channel, sr⁻¹.
    pub error: ChannelValues,
    /// Part of an aperture is below the horizon.
    pub clipped: bool,
    /// Number of evaluations of the BRDF.
    pub evaluations: usize,
}

/// The apertures of an instrument.
#[derive(Clone, Debug)]
pub struct Optics {
    source: f64,
    detector: f64,
    tolerance: Tolerance,
    rules: Rules,
    lens: Lens,
}

impl Optics {
    /// The apertures of these half-angles of source and detector, rad, in [0, 0.5]; 0 is a single
    /// direction.
    pub fn new(source: f64, detector: f64, tolerance: Tolerance) -> Self {
        Self {
            source,
            detector,
            tolerance,
            rules: Rules::new(),
            lens: Lens::new(),
        }
    }

    /// The average around a pair above the horizon; `None` if the material has no data anywhere.
    pub fn average(
        &self,
        brdf: &dyn Brdf,
        pair: &DirectionPair,
        work: &mut Workspace,
    ) -> Option<Average> {
        let start = work.evaluations;
        let cut = [(pair.omega_i, self.source), (pair.omega_o, self.detector)]
            .map(|(omega, half_angle)| omega.cos_theta() < half_angle.sin());
        let clipped = cut[0] || cut[1];
        if self.source == 0.0 && self.detector == 0.0 {
            return work.single(brdf, pair).map(|value| Average {
                error: ChannelValues::from_elem(0.0, value.len()),
                value,
                clipped,
                evaluations: 1,
            });
        }
        let best = self.best(brdf, pair, clipped, work);
        let evaluations = work.evaluations - start;
        if weight(&best.sums) <= 0.0 {
            // Also where the material has values but every node fell between them.
            return None;
        }
        let value = ratios(&best.sums);
        let mut error = best.error;
        for (error, value) in error.iter_mut().zip(&value) {
            // Rounding of the sums, and of directions against what they differ by.
            *error = error.max(ROUNDING * value.abs());
        }
        Some(Average {
            value,
            error,
            clipped,
            evaluations,
        })
    }

    /// ⟨cos θ_i⟩ over both whole apertures, what is below the horizon counting as 0: the signal of a
    /// perfect diffuser, times π.
    pub(crate) fn cosine(&self, pair: &DirectionPair) -> f64 {
        let [light, sensor] = self.disks(pair);
        self.rules.means(&light)[1] * self.rules.means(&sensor)[0]
    }

    fn disks(&self, pair: &DirectionPair) -> [Disk; 2] {
        let sensor = Disk::new(pair.omega_o, self.detector);
        [Disk::new(pair.omega_i, self.source), sensor]
    }

    /// The estimate of the cheapest rule that is within the tolerance, else of the best one.
    fn best(
        &self,
        brdf: &dyn Brdf,
        pair: &DirectionPair,
        clipped: bool,
        work: &mut Workspace,
    ) -> Estimate {
        work.missing = false;
        let start = work.evaluations;
        let disks = self.disks(pair);
        if clipped || self.half_vector_is_lost(pair) {
            return self.products(brdf, &disks, work);
        }
        let find = |kind| Peak::find(self, brdf, pair, kind, work);
        let peaks = [PeakKind::Mirror, PeakKind::Retro].map(find);
        let peaks = peaks.into_iter().flatten();
        let peak = peaks.min_by(|a, b| a.width.total_cmp(&b.width));
        let narrow = peak.filter(|peak| peak.width < NARROW * (self.source + self.detector));
        let mut steps = Vec::new();
        if narrow.is_none() {
            let least_gain = LEAST_GAIN[usize::from(peak.is_some())];
            let (third, sparse) = self.rules.sparse(brdf, &disks, work);
            if sparse.good(&self.tolerance) && !work.missing {
                return sparse;
            }
            steps.extend([third, sparse]);
            // The last order costs more than a few cells.
            for order in 0..PRODUCTS.len() - 1 {
                let sums = self.rules.product(brdf, &disks, order, work);
                let step = Estimate::after(sums, &steps, least_gain);
                if step.good(&self.tolerance) {
                    return step;
                }
                let hopeless = order > 0 && step.hopeless(&self.tolerance, steps.last());
                steps.push(step);
                if hopeless {
                    break;
                }
            }
        }
        let spent = work.evaluations - start;
        let budget = self.tolerance.refinement.saturating_sub(spent);
        // Kinks of a table are everywhere: it would take all there is for little.
        let (peak, budget) = match narrow {
            Some(peak) => (peak, budget),
            None => (Peak::unseen(self, pair), budget / 4),
        };
        let lobe = lobe::integrate(self, brdf, pair, &peak, budget, work);
        match steps.pop() {
            Some(best) if !lobe.better_than(&best) => best,
            _ => lobe,
        }
    }

    /// Rounding of the half vector, which grows as light and sensor become opposite, moves directions
    /// by more than a thousandth of the smaller aperture.
    fn half_vector_is_lost(&self, pair: &DirectionPair) -> bool {
        let apertures = [self.source, self.detector].into_iter();
        let smaller = apertures.filter(|a| *a > 0.0).fold(f64::INFINITY, f64::min);
        f64::EPSILON > 1e-3 * smaller * pair.half().length()
    }

    /// The best estimate from products alone, over directions above the horizon. Models
    /// diverge where both directions are on the horizon; a difference of two orders is then no better
    /// than the one before.
    fn products(&self, brdf: &dyn Brdf, disks: &[Disk; 2], work: &mut Workspace) -> Estimate {
        let mut steps = Vec::with_capacity(PRODUCTS.len());
        let mut order = 0;
        loop {
            let sums = self.rules.product(brdf, disks, order, work);
            let step = Estimate::after(sums, &steps, 1.0);
            order += 1;
            if order == PRODUCTS.len() || (order > 1 && step.good(&self.tolerance)) {
                return step;
            }
            steps.push(step);
        }
    }
}

/// Smallest factor by which a step of higher degree is taken to reduce differences, away from a
/// peak and on one: less is luck.
const LEAST_GAIN: [f64; 2] = [0.25, 0.5];

/// Half width of a peak, over the sum of the apertures, below which cells must shrink towards it.
const NARROW: f64 = 0.5;

/// A ratio of sums, and how far off it may be.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    sums: Sums,
    error: ChannelValues,
}

impl Estimate {
    /// A difference of two rules counts this many times: now and then both are wrong together.
    const SAFETY: f64 = 3.0;

    /// The next step of a sequence of rising degree.
    ///
    /// The error is the difference from the step before. The step before that says how fast
    /// differences fall, which keeps a difference that is small by luck from being believed: of a
    /// smooth function as their squares, and never less than by `least_gain`.
    fn after(sums: Sums, steps: &[Estimate], least_gain: f64) -> Self {
        let mut error = ChannelValues::from_elem(f64::INFINITY, sums.len() - 1);
        if let Some(last) = steps.last() {
            let difference = |a: &Sums, b: &Sums, c: usize| (ratio(a, c) - ratio(b, c)).abs();
            for (c, error) in error.iter_mut().enumerate() {
                *error = Self::SAFETY * difference(&sums, &last.sums, c);
                if let [.., before, last] = steps {
                    let slower = difference(&last.sums, &before.sums, c);
                    let relative = slower / ratio(&sums, c).abs().max(f64::MIN_POSITIVE);
                    *error = error.max(slower * relative.max(least_gain).min(1.0));
                }
            }
        }
        Self { sums, error }
    }

    /// True if every channel is within the tolerance.
    fn good(&self, tolerance: &Tolerance) -> bool {
        self.excess(tolerance) <= 1.0
    }

    /// Largest ratio of a channel's error to its bound.
    fn excess(&self, tolerance: &Tolerance) -> f64 {
        let value = |c: usize| ratio(&self.sums, c).abs();
        let allowed = |c: usize| tolerance.relative * value(c) + tolerance.absolute;
        let errors = self.error.iter().enumerate();
        let ratios = errors.map(|(c, error)| error / allowed(c));
        ratios.fold(0.0, f64::max)
    }

    /// The next product would not be good either, judged by this one and that before.
    fn hopeless(&self, tolerance: &Tolerance, before: Option<&Estimate>) -> bool {
        let excess = self.excess(tolerance);
        match before {
            Some(before) if before.error[0].is_finite() => {
                let gain = excess / before.excess(tolerance).max(f64::MIN_POSITIVE);
                excess * gain.min(1.0) > 1.0
            }
            _ => excess > 1e4,
        }
    }

    fn better_than(&self, other: &Self) -> bool {
        let largest = |e: &Self| e.error.iter().copied().fold(0.0, f64::max);
        largest(self) < largest(other)
    }
}
