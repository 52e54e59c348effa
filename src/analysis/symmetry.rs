//! Symmetries of a BRDF: deviations from them, and the measurements they save.
//!
//! A law says f(p) = f(T p) for every pair p; T exchanges light and sensor (reciprocity), turns the
//! sample by 7.5, 30, 45 and 90° (isotropy) or mirrors it through the t–n and b–n planes
//! (bilateral). Every T keeps both elevations and solid angles. Over the fixed pairs of
//! [`symmetry_pairs`] the *relative error* is
//!
//! sqrt(Σ (f(p) − f(T p))² / Σ ½ (f(p)² + f(T p)²)),
//!
//! f in luminance, without the cosines: those are in the distribution of the pairs. It is 0 for a
//! symmetry, √2 for a BRDF that is lit on one side of it only, and at most 2. A high peak decides it
//! alone, so beside it stands the *pairwise error*, the root mean square of
//! (f(p) − f(T p))/½ (f(p) + f(T p)), in which a dim brushed base under a clear lacquer counts as much
//! as the lacquer's peak. A symmetry holds if both are within the tolerance. The largest
//! |ln f(p) − ln f(T p)| is reported too; a single bad pair decides it: noise near the horizon, a hole.
//!
//! The angles are whole steps of the tables that are measured at equal azimuths, so that a table is not
//! called anisotropic for being interpolated.

use crate::brdf::Brdf;
use crate::geometry::{DirectionPair, Symmetry};
use crate::metrics::{self, Measure, MetricsSpec, Values};
use crate::parametrization::{self, Axis, Unit};
use glam::{DMat3, DVec3};
use serde::Serialize;

/// Default error up to which a symmetry holds. Models reach 1e-12, the
/// cells of a table 1e-3, repeated measurements of one material about this.
pub const SYMMETRY_TOLERANCE: f64 = 0.01;

/// Turns of the sample (degrees).
const TURNS_DEG: [f64; 4] = [7.5, 30.0, 45.0, 90.0];

/// Largest elevation of the pairs, degrees: the widest measured tables end there.
const MASK_DEG: f64 = 75.0;

/// Deviation of f from one symmetry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// The relative error; 0 if nothing could be compared, or everything is black.
    pub relative: f64,
    /// The pairwise error; 0 in the same cases.
    pub pairwise: f64,
    /// Largest difference of logarithms; infinite if one of the two is 0.
    pub max_log: f64,
    /// Comparisons, several per pair where there are several T.
    pub compared: usize,
    /// Comparisons without data on either side.
    pub missing: usize,
    /// Comparisons with data on one side only.
    pub one_sided: usize,
}

impl Deviation {
    /// True if both errors are within the tolerance and no side alone has data too often to
    /// know: at most one comparison in a hundred.
    pub fn holds(&self, tolerance: f64) -> bool {
        self.compared > 0
            && self.relative <= tolerance
            && self.pairwise <= tolerance
            && 100 * self.one_sided <= self.compared + self.one_sided
    }
}

/// Deviation of a BRDF from each symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviations {
    /// Deviation under a turn of the sample.
    pub isotropy: Deviation,
    /// Deviation under an exchange of light and sensor.
    pub reciprocity: Deviation,
    /// Deviation under the two mirrors.
    pub bilateral: Deviation,
}

impl Deviations {
    /// The symmetries that hold within the tolerance.
    pub fn holding(&self, tolerance: f64) -> Symmetry {
        Symmetry {
            isotropic: self.isotropy.holds(tolerance),
            reciprocal: self.reciprocity.holds(tolerance),
            bilateral: self.bilateral.holds(tolerance),
        }
    }
}

/// The fixed pairs: 20 000 of measure `lobe`, both elevations below 75°.
pub fn symmetry_pairs() -> Vec<DirectionPair> {
    let spec = MetricsSpec {
        pairs: 20_000,
        mask_deg: MASK_DEG,
        ..MetricsSpec::default()
    };
    let pairs = metrics::test_pairs(Measure::Lobe, &spec);
    // Of constants, which the tests run through.
    pairs.unwrap_or_else(|e| unreachable!("the pairs of the symmetries: {e}"))
}

/// Measures all three symmetries at `pairs`. Runs on rayon's threads; the result does not depend on
/// their number.
pub fn deviations(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Deviations {
    let own = metrics::evaluate(brdf, pairs);
    let against = |maps: &[&dyn Fn(&DirectionPair) -> DirectionPair]| {
        let mut tally = Tally::default();
        for map in maps {
            let mapped: Vec<_> = pairs.iter().map(map).collect();
            tally.add(&own, &metrics::evaluate(brdf, &mapped));
        }
        tally.deviation()
    };
    let turned = |degrees: f64| {
        let turn = DMat3::from_rotation_z(degrees.to_radians());
        move |pair: &DirectionPair| pair.map(|v| turn * v)
    };
    let turns = TURNS_DEG.map(turned);
    let flipped = |x: f64, y: f64| {
        let flip = DVec3::new(x, y, 1.0);
        move |pair: &DirectionPair| pair.map(|v| v * flip)
    };
    Deviations {
        isotropy: against(&turns.each_ref().map(|t| t as &dyn Fn(&_) -> _)),
        reciprocity: against(&[&DirectionPair::swapped]),
        bilateral: against(&[&flipped(1.0, -1.0), &flipped(-1.0, 1.0)]),
    }
}

/// Sums over the comparisons of one law.
#[derive(Default)]
struct Tally {
    difference: f64,
    size: f64,
    pairwise: f64,
    found: Deviation,
}

impl Tally {
    fn add(&mut self, a: &Values, b: &Values) {
        for i in 0..a.luminance.len() {
            match (a.get(i), b.get(i)) {
                (Some(a), Some(b)) => self.compare(a, b),
                (None, None) => self.found.missing += 1,
                _ => self.found.one_sided += 1,
            }
        }
    }

    fn compare(&mut self, a: f64, b: f64) {
        self.found.compared += 1;
        self.difference += (a - b) * (a - b);
        self.size += 0.5 * (a * a + b * b);
        if a != b {
            let d = 2.0 * (a - b) / (a + b);
            self.pairwise += d * d;
            self.found.max_log = self.found.max_log.max((a.ln() - b.ln()).abs());
        }
    }

    fn deviation(self) -> Deviation {
        let root = |sum: f64, of: f64| if of > 0.0 { (sum / of).sqrt() } else { 0.0 };
        Deviation {
            relative: root(self.difference, self.size),
            pairwise: root(self.pairwise, self.found.compared as f64),
            ..self.found
        }
    }
}

/// The part of a parametrization's domain that is left to be measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Saving {
    /// The parametrization.
    pub parametrization: &'static str,
    /// Number of axes: 3 if isotropic, 4 if not.
    pub dimensions: usize,
    /// Number of configurations of which one is left, beside the axis that isotropy drops.
    pub copies: usize,
    /// Folds of the domain, e.g. `phi_d 360° to 90°`.
    pub folds: Vec<String>,
}

/// The savings by the symmetries in every parametrization. The number of copies is the same in all,
/// as it belongs to the pairs; the axis that gets shorter is not.
pub fn savings(symmetry: Symmetry) -> Vec<Saving> {
    let unfolded = Symmetry::NONE.with_isotropy(symmetry.isotropic);
    let entries = parametrization::all().into_iter();
    entries
        .map(|entry| {
            let (full, folded) = (entry.axes(unfolded), entry.axes(symmetry));
            // No place that a symmetry keeps: those have fewer images.
            let mut inside = [0.0; 4];
            for (i, (inside, axis)) in inside.iter_mut().zip(&folded).enumerate() {
                *inside = axis.range[0] + (0.31 + 0.1 * i as f64) * axis.length();
            }
            let form = entry.form(symmetry);
            let copies = form.images(&inside).len();
            let mut shortened = 1.0;
            let mut folds: Vec<String> = Vec::new();
            for (full, folded) in full.iter().zip(&folded) {
                if folded.length() < full.length() {
                    shortened *= full.length() / folded.length();
                    let lengths = format!("{} to {}", shown(full), shown(folded));
                    folds.push(format!("{} {lengths}", folded.symbol));
                }
            }
            // What no range shows: spherical coordinates keep one of (i, o) and (o, i).
            if shortened < 0.75 * copies as f64 {
                let radial = [folded[0].symbol, folded[folded.len() / 2].symbol];
                folds.push(match form.facts().exchange {
                    true => radial.join(" ≥ "),
                    false => "one image of each pair".into(),
                });
            }
            Saving {
                parametrization: entry.kind,
                dimensions: folded.len(),
                copies,
                folds,
            }
        })
        .collect()
}

fn shown(axis: &Axis) -> String {
    match axis.unit {
        Unit::Radian => format!("{:.0}°", axis.length().to_degrees()),
        Unit::One => format!("{}", axis.length()),
    }
}
