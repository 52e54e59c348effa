//! A box of coordinates, and the set of pairs of directions it stands for (the "connections between
//! subsets of a parametrization and the corresponding subset of light paths" that Barla et al.
//! 2015 ask for).
//!
//! The set holds every pair that is in the box itself, or by a symmetry of the form, and every
//! turn of it about the normal: what a measurement of the box determines of a BRDF with these symmetries.
//! Its measure in d omega_i d omega_o is the integral of the Jacobian over the physical part of the
//! box, times 2π for the turn, times the images of each point, shared among those that are in the
//! box as well.

use crate::brdf::Brdf;
use crate::error::{ParameterError, one_of};
use crate::geometry::{Direction, DirectionPair};
use crate::instrument::Machine;
use crate::metrics;
use crate::numeric::{extent, last_where};
use crate::parametrization::{Axis, Coords, Parametrization, Unit, usual_form};
use crate::sampling::{Random, Sobol, gauss_legendre};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Panels along each of the first two axes, and half of them for the error.
const PANELS: usize = 32;

/// Gauss nodes of a panel.
const PANEL_NODES: usize = 3;

/// Gauss nodes of a physical piece of the azimuth.
const AZIMUTH_NODES: usize = 16;

/// Places along a quarter of the azimuth where it is looked whether the box is physical.
const PROBES: usize = 6;

/// Radial coordinates below it are a pole, whose azimuth is rounding.
const POLE: f64 = 1e-7;

/// Pairs of the Monte Carlo check: a standard error of 0.1 % for a set of half of all pairs.
const CHECK_PAIRS: u64 = 1 << 20;

/// Seed of the pairs that boxes around a set are counted by.
const IMAGE_SEED: u64 = 0x1A6E;

/// Points of a set that hold energy; of fewer a share is better found in the set alone.
const FEW: usize = 1000;

/// Independent sets of points for the standard error of energies.
const SETS: u64 = 16;

/// Points of each of them.
const SET_POINTS: u64 = 1 << 13;

/// Pairs that a share of energy asks for; of small sets more, once these are done.
pub const ENERGY_PAIRS: u64 = SETS * SET_POINTS;

/// A number and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// For a quadrature the difference from half as many nodes, else the standard error.
    pub error: f64,
}

impl Estimate {
    pub(super) fn new(value: f64, error: f64) -> Self {
        Self { value, error }
    }

    /// False if the error exceeds a tenth of the number.
    pub fn resolved(&self) -> bool {
        self.error <= 0.1 * self.value.abs()
    }

    /// This estimate over another, independent one, as a share: at most 1.
    fn share_of(&self, all: &Estimate) -> Estimate {
        let value = self.value / all.value;
        let error = (self.error / all.value).hypot(value * all.error / all.value);
        Estimate::new(value.min(1.0), error)
    }
}

/// The measure of a set, found in two ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubsetMeasure {
    /// By [`Subset::quadrature`], sr².
    pub quadrature: Estimate,
    /// By [`Subset::monte_carlo`], sr².
    pub counted: Estimate,
}

impl SubsetMeasure {
    /// True if counting is to be trusted: its stated error is smaller, or quadrature is so far off it
    /// that its own error must be understated.
    pub fn is_counted(&self) -> bool {
        let [a, b] = [self.quadrature, self.counted];
        b.error < a.error || (a.value - b.value).abs() > 4.0 * (a.error + b.error)
    }

    /// The measure with the more reliable error, sr².
    pub fn best(&self) -> Estimate {
        match self.is_counted() {
            true => self.counted,
            false => self.quadrature,
        }
    }

    /// Share of all pairs, in [0, 1].
    pub fn share(&self) -> Estimate {
        self.best().share_of(&Estimate::new(TAU * TAU, 0.0))
    }
}

/// A box of coordinates of an isotropic form.
#[derive(Clone)]
pub struct Subset {
    /// The form whose coordinates bound it.
    pub(crate) form: Arc<dyn Parametrization>,
    /// Lowest and highest coordinate along each axis.
    pub ranges: [[f64; 2]; 3],
}

/// A pair of the set, and the steradians² that a sample of its size stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// The pair; the symmetries give the others.
    pub pair: DirectionPair,
    /// Measure per unit of the box's volume, sr².
    pub weight: f64,
}

/// Smallest and largest angles (rad) over the pairs of a box, by name: elevations of light and sensor, the difference of
/// their azimuths, in [0, π], and the angle between them.
pub type Needs = [(&'static str, [f64; 2]); 4];

/// The part of a box that a machine can reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Share of the measure that it can reach, in [0, 1].
    pub share: f64,
    /// Name of each axis, and its lowest and highest position (rad); `None` if nothing is reached.
    pub axes: Vec<(String, Option<[f64; 2]>)>,
}

/// The box of another parametrization that holds the set.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Lowest and highest coordinate found along each axis.
    pub ranges: [[f64; 2]; 3],
    /// Measure of the set over that of the box, in [0, 1].
    pub fill: Estimate,
}

impl Subset {
    /// Reads a box: `symbol=low..high`, separated by commas; angles in degrees; axes that are not
    /// named are free.
    ///
    /// # Errors
    /// An axis that the form does not have, one named twice, a range that is no `low..high` with
    /// low < high, or leaves the axis.
    ///
    /// # Panics
    /// If the form has four axes.
    ///
    /// ```
    /// use gonio::analysis::Subset;
    /// use gonio::geometry::Symmetry;
    /// let form = gonio::parametrization::find("hybrid").unwrap().form(Symmetry::FULL);
    /// let subset = Subset::read(form, "h_bar=0..0.2, delta=30..60")?;
    /// assert_eq!(subset.ranges[1], [0.0, 1.0]);
    /// # Ok::<(), gonio::error::ParameterError>(())
    /// ```
    pub fn read(form: Arc<dyn Parametrization>, text: &str) -> Result<Self, ParameterError> {
        let mut subset = Self::whole(form);
        let axes = subset.form.axes();
        let mut named = [false; 3];
        for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let Some((symbol, range)) = part.split_once('=') else {
                let allowed = "axis=low..high, separated by commas, e.g. k=0.5..0.7";
                return Err(ParameterError::new("box", format!("{part:?}"), allowed));
            };
            let symbol = symbol.trim();
            let Some(i) = axes.iter().position(|a| a.symbol == symbol) else {
                let symbols = one_of(symbol, axes.iter().map(|a| a.symbol));
                let allowed = format!("an axis of {}: {symbols}", subset.form.name());
                return Err(ParameterError::new("box", format!("{symbol:?}"), allowed));
            };
            if std::mem::replace(&mut named[i], true) {
                return Err(ParameterError::new("box", part, "each axis once"));
            }
            subset.ranges[i] = read_range(&axes[i], range.trim())?;
        }
        Ok(subset)
    }

    /// All coordinates of a form.
    ///
    /// # Panics
    /// If the form has four axes.
    fn whole(form: Arc<dyn Parametrization>) -> Self {
        let axes = form.axes();
        assert_eq!(axes.len(), 3, "subsets are those of an isotropic form");
        let ranges = [0, 1, 2].map(|i| axes[i].range);
        Self { form, ranges }
    }

    /// True if the pair is in the box, or one of its images is.
    pub fn contains(&self, pair: &DirectionPair) -> bool {
        let images = self.form.images(&self.form.forward(pair));
        images.iter().any(|c| self.holds(c))
    }

    fn holds(&self, coords: &Coords) -> bool {
        let mut axes = self.ranges.iter().zip(coords);
        axes.all(|([lo, hi], c)| lo <= c && c <= hi)
    }

    /// Measure per unit of volume at a physical point of the box.
    fn density(&self, coords: &Coords) -> f64 {
        let images = self.form.images(coords);
        let inside = images.iter().filter(|c| self.holds(c)).count().max(1);
        TAU * self.form.jacobian(coords) * images.len() as f64 / inside as f64
    }

    fn volume(&self) -> f64 {
        self.ranges.iter().map(|[lo, hi]| hi - lo).product()
    }

    /// Measure of the set (sr²), by quadrature and by counting with this seed.
    pub fn measure(&self, seed: u64) -> SubsetMeasure {
        SubsetMeasure {
            quadrature: self.quadrature(),
            counted: self.monte_carlo(seed),
        }
    }

    /// Measure of the set (sr²) by quadrature. Coarse where the box is narrow and lies about the
    /// horizon: few nodes are above it.
    pub fn quadrature(&self) -> Estimate {
        let fine = self.integral(PANELS);
        Estimate::new(fine, (fine - self.integral(PANELS / 2)).abs())
    }

    fn integral(&self, panels: usize) -> f64 {
        let rule = gauss_legendre(PANEL_NODES);
        let along = gauss_legendre(AZIMUTH_NODES);
        let nodes = |[lo, hi]: [f64; 2], panels: usize| -> Vec<(f64, f64)> {
            let width = (hi - lo) / panels as f64;
            let panel = |i: usize| {
                let (start, half) = (lo + width * i as f64, 0.5 * width);
                rule.iter()
                    .map(move |(t, w)| (start + half * (1.0 + t), half * w))
            };
            (0..panels).flat_map(panel).collect()
        };
        // Not the same nodes along both: they would lie on x + y = 1, where the azimuth integral of
        // the orthographic Jacobian has a logarithmic pole.
        let first = nodes(self.ranges[0], panels);
        let second = nodes(self.ranges[1], panels + 5);
        let line = |&(x, w): &(f64, f64)| {
            let line = second.iter().map(|&(y, v)| v * self.line(x, y, &along));
            w * line.sum::<f64>()
        };
        let lines: Vec<f64> = first.par_iter().map(line).collect();
        lines.iter().sum()
    }

    /// The integral along the azimuth, quarter by quarter: integrands peak at whole quarters of a
    /// turn, where a direction comes closest to the horizon.
    fn line(&self, x: f64, y: f64, rule: &[(f64, f64)]) -> f64 {
        let [lo, hi] = self.ranges[2];
        let quarter = |phi: f64| phi / FRAC_PI_2;
        let first = quarter(lo).floor() as i32;
        let last = quarter(hi).ceil() as i32;
        let quarters = (first..last).map(|i| {
            let [from, to] = [i, i + 1].map(|i| f64::from(i) * FRAC_PI_2);
            [from.max(lo), to.min(hi)]
        });
        let filled = quarters.filter(|[from, to]| from < to);
        filled.map(|q| self.quarter(x, y, q, rule)).sum()
    }

    /// The integral along a part of the azimuth, physical piece by physical piece. The substitution by a sine
    /// takes away what the orthographic Jacobian diverges by where a piece ends on the horizon.
    fn quarter(&self, x: f64, y: f64, [lo, hi]: [f64; 2], rule: &[(f64, f64)]) -> f64 {
        let physical = |phi: f64| self.form.inverse(&[x, y, phi, 0.0]).is_some();
        let at = |i: usize| lo + (hi - lo) * i as f64 / PROBES as f64;
        let probes: Vec<(f64, bool)> = (0..=PROBES).map(|i| (at(i), physical(at(i)))).collect();
        let edges = probes.windows(2).filter_map(|ends| match ends {
            [(inside, true), (outside, false)] | [(outside, false), (inside, true)] => {
                Some(last_where(*inside, *outside, 45, physical))
            }
            _ => None,
        });
        let first = probes[0].1.then_some(lo);
        let last = probes[PROBES].1.then_some(hi);
        let ends: Vec<f64> = first.into_iter().chain(edges).chain(last).collect();
        let (pieces, _) = ends.as_chunks::<2>();
        let parts = pieces.iter().map(|ends| self.piece(x, y, *ends, rule));
        parts.fold(0.0, |sum, part| sum + part)
    }

    fn piece(&self, x: f64, y: f64, [from, to]: [f64; 2], rule: &[(f64, f64)]) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let node = |&(t, w): &(f64, f64)| {
            let (sin, cos) = (FRAC_PI_2 * t).sin_cos();
            let density = self.density(&[x, y, middle + half * sin, 0.0]);
            let density = if density.is_finite() { density } else { 0.0 };
            w * half * FRAC_PI_2 * cos * density
        };
        rule.iter().map(node).sum()
    }

    /// Measure of the set (sr²) by counting which of independent pairs, uniform over both
    /// hemispheres, are in it; shares nothing with [`quadrature`](Self::quadrature) but the coordinates of
    /// a pair.
    pub fn monte_carlo(&self, seed: u64) -> Estimate {
        let random = Random::new(seed);
        let is_inside = |&i: &u64| {
            let [a, b, c, d] = random.point(i);
            // Uniform in the cosine; 1 − u is never 0.
            let [theta_i, theta_o] = [a, c].map(|u| (1.0 - u).acos());
            let pair = DirectionPair::from_spherical(theta_i, TAU * b, theta_o, TAU * d);
            self.contains(&pair)
        };
        let inside = (0..CHECK_PAIRS).into_par_iter().filter(is_inside).count();
        let n = CHECK_PAIRS as f64;
        // None of n may still be one of them (Laplace), so that no error is 0.
        let likely = (inside as f64 + 1.0) / (n + 2.0);
        let error = TAU * TAU * (likely * (1.0 - likely) / n).sqrt();
        Estimate::new(TAU * TAU * inside as f64 / n, error)
    }

    /// The pair at a place of the box in the unit cube, turned by the fourth number; `None` where
    /// the box is not physical.
    fn member(&self, [a, b, c, turn]: [f64; 4]) -> Option<Member> {
        let at = |i: usize, t: f64| self.ranges[i][0] + t * (self.ranges[i][1] - self.ranges[i][0]);
        let coords = [at(0, a), at(1, b), at(2, c), 0.0];
        let pair = self.form.inverse(&coords)?;
        let weight = self.density(&coords);
        let turned = |d: Direction| Direction::from_spherical(d.theta(), d.phi() + TAU * turn);
        weight.is_finite().then(|| Member {
            pair: DirectionPair::new(turned(pair.omega_i), turned(pair.omega_o)),
            weight,
        })
    }

    /// Pairs spread evenly over the box by `points` Sobol points: those of the physical part.
    pub fn members(&self, points: u64, seed: u64) -> Vec<Member> {
        let mut sobol = Sobol::new(seed);
        let member = |i| self.member(sobol.point(i));
        (0..points).filter_map(member).collect()
    }

    /// [`members`](Self::members), and those of a lattice that reaches to the faces of the box,
    /// where the extremes are.
    fn extremes(&self) -> Vec<DirectionPair> {
        const STEPS: usize = 32;
        let axis = || 0..=STEPS;
        let lattice = axis().flat_map(|i| axis().flat_map(move |j| axis().map(move |k| [i, j, k])));
        let inverse = |node: [usize; 3]| {
            let place = |axis: usize| {
                let ([lo, hi], t) = (self.ranges[axis], node[axis] as f64 / STEPS as f64);
                // hi exactly at 1.
                lo * (1.0 - t) + hi * t
            };
            self.form.inverse(&[place(0), place(1), place(2), 0.0])
        };
        let mut pairs: Vec<_> = lattice.filter_map(inverse).collect();
        pairs.extend(self.members(SET_POINTS, 1).into_iter().map(|m| m.pair));
        pairs
    }

    /// The ranges of angles it needs; `None` if no point of the box was found physical.
    pub fn needs(&self) -> Option<Needs> {
        let pairs = self.extremes();
        let of = |name, angle: &dyn Fn(&DirectionPair) -> f64| {
            Some((name, extent(pairs.iter().map(angle))?))
        };
        let azimuth = |p: &DirectionPair| {
            let off = (p.omega_i.phi() - p.omega_o.phi()).abs();
            off.min(TAU - off).min(PI)
        };
        Some([
            of("theta_i", &|p| p.omega_i.theta())?,
            of("theta_o", &|p| p.omega_o.theta())?,
            of("azimuth difference", &azimuth)?,
            of("separation", &|p| p.separation())?,
        ])
    }

    /// The part of the box that a machine can reach; the sample may be turned about its normal.
    pub(crate) fn reach(&self, machine: &Machine) -> Reach {
        let (mut all, mut reached) = (0.0, 0.0);
        let axes = machine.axes().iter().map(|axis| (axis.name.clone(), None));
        let mut axes: Vec<(String, Option<[f64; 2]>)> = axes.collect();
        for member in self.members(SET_POINTS, 2) {
            all += member.weight;
            let Ok(positions) = machine.place(&member.pair, true) else {
                continue;
            };
            reached += member.weight;
            for ((_, range), position) in axes.iter_mut().zip(positions) {
                let [lo, hi] = range.unwrap_or([position; 2]);
                *range = Some([lo.min(position), hi.max(position)]);
            }
        }
        Reach {
            share: if all > 0.0 { reached / all } else { 0.0 },
            axes,
        }
    }

    /// Its image in another form: the smallest box, of some 40 000 pairs, and how much
    /// of it the set, of this measure, fills. `None` if no point of the box was found physical.
    /// Across the ends of a periodic axis the box is the whole axis.
    pub fn image(&self, form: &Arc<dyn Parametrization>, measure: &Estimate) -> Option<Image> {
        let pairs = self.extremes();
        let mut coords = vec![[0.0; 4]; pairs.len()];
        form.forward_batch(&pairs, &mut coords);
        // At a pole the azimuth is 0 by convention: that is no part of the image.
        let counts = |i: usize, c: &Coords| i < 2 || c[0].min(c[1]) > POLE;
        let along = |i: usize| extent(coords.iter().filter(|c| counts(i, c)).map(|c| c[i]));
        let ranges = [along(0)?, along(1)?, along(2)?];
        let form = Arc::clone(form);
        let whole = Subset { form, ranges }.measure(IMAGE_SEED);
        let fill = measure.share_of(&whole.best());
        Some(Image { ranges, fill })
    }

    /// ∫ f cos θ_i cos θ_o d omega_i d omega_o over the set (sr), in luminance. Pairs without data
    /// count nothing.
    pub fn energy(&self, brdf: &dyn Brdf) -> Estimate {
        let sets = (0..SETS).map(|seed| {
            let members = self.members(SET_POINTS, 3 + seed);
            energies(&members, brdf).sum::<f64>() * self.volume() / SET_POINTS as f64
        });
        mean(&sets.collect::<Vec<_>>())
    }

    /// Share of the energy of a BRDF that the set holds; `None` of a black one.
    ///
    /// The total energy is integrated in half/difference coordinates with theta_h spread towards
    /// the peak, where narrow lobes are wide, and the share is that of the points in the set. A
    /// small set with few of these points is integrated on its own.
    pub fn energy_share(&self, brdf: &dyn Brdf) -> Option<Estimate> {
        let whole = Subset::whole(usual_form(self.form.symmetry()));
        let mut hits = 0;
        let sets = (0..SETS).map(|seed| {
            let members = whole.members(SET_POINTS, 3 + seed);
            let (mut all, mut held) = (0.0, 0.0);
            for (energy, member) in energies(&members, brdf).zip(&members) {
                all += energy;
                if energy > 0.0 && self.contains(&member.pair) {
                    hits += 1;
                    held += energy;
                }
            }
            [held, all]
        });
        let sets: Vec<[f64; 2]> = sets.collect();
        let [held, all] = [0, 1].map(|i| sets.iter().map(|s| s[i]).sum::<f64>());
        if all == 0.0 {
            return None;
        }
        if hits < FEW {
            let total = whole.energy(brdf);
            return Some(self.energy(brdf).share_of(&total));
        }
        // Of a ratio: errors of both parts are those of the same points.
        let share = held / all;
        let off = sets
            .iter()
            .map(|[h, a]| (h - share * a) * SETS as f64 / all);
        Some(Estimate::new(share, mean(&off.collect::<Vec<_>>()).error))
    }
}

/// Contribution of each pair to the energy, per unit of the box's volume: weight f cos θ_i cos θ_o.
fn energies<'a>(members: &'a [Member], brdf: &dyn Brdf) -> impl Iterator<Item = f64> + use<'a> {
    let pairs: Vec<_> = members.iter().map(|m| m.pair).collect();
    let values = metrics::evaluate(brdf, &pairs);
    members.iter().enumerate().map(move |(i, m)| {
        let cosines = m.pair.omega_i.cos_theta() * m.pair.omega_o.cos_theta();
        m.weight * cosines * values.get(i).unwrap_or(0.0)
    })
}

/// Mean of independent numbers, and its standard error.
fn mean(numbers: &[f64]) -> Estimate {
    let n = numbers.len() as f64;
    let value = numbers.iter().sum::<f64>() / n;
    let square: f64 = numbers.iter().map(|s| (s - value) * (s - value)).sum();
    Estimate::new(value, (square / (n * (n - 1.0))).sqrt())
}

fn read_range(axis: &Axis, text: &str) -> Result<[f64; 2], ParameterError> {
    let [least, most] = axis.range.map(|end| axis.file_value(end));
    let unit = match axis.unit {
        Unit::Radian => ", in degrees",
        Unit::One => "",
    };
    let refused = || {
        let allowed = format!("low..high with {least} <= low < high <= {most}{unit}");
        ParameterError::new(format!("box: {}", axis.symbol), text, allowed)
    };
    let numbers = || {
        let (low, high) = text.split_once("..")?;
        Some([low.trim().parse::<f64>().ok()?, high.trim().parse().ok()?])
    };
    let [low, high] = numbers().ok_or_else(refused)?;
    // NaN fails.
    if !(least <= low && low < high && high <= most) {
        return Err(refused());
    }
    // The ends themselves to the bit: 90° in radians may round past π/2.
    let inside = |value: f64| match (value == least, value == most, axis.unit) {
        (true, ..) => axis.range[0],
        (_, true, _) => axis.range[1],
        (.., Unit::Radian) => value.to_radians(),
        (.., Unit::One) => value,
    };
    Ok([inside(low), inside(high)])
}
