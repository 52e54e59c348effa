//! Alignment of a lobe: a function of theta_h, of |h_bar|, or of something between.
//!
//! The width of a lobe that is a function of theta_h is the same at every theta_d; one over
//! |h_bar| = sin theta_h cos theta_d grows wider as cos theta_d falls. So the *alignment* q of a
//! BRDF is the exponent of
//!
//! sin(half width in theta_h) ∝ (cos theta_d)^−q,
//!
//! exactly 0 for any function of theta_h and exactly 1 for any function of |h_bar|.
//!
//! At each theta_d from 0 to 60° in steps of 5° the luminance is averaged over phi_d (and over phi_h
//! if the BRDF is anisotropic) as a function of theta_h, as far as no elevation exceeds 80°
//! (theta_h + theta_d ≤ 80°). The smallest of all these averages is the diffuse floor, the
//! same for every slice. The half width is where the average first falls to half of its
//! value at theta_h = 0, both above the floor: a factor that depends on theta_d alone (Fresnel)
//! drops out, and shadowing hardly varies within a narrow lobe. q is the slope of a least-squares
//! line, with the standard error that its residuals give.
//!
//! Wide lobes are seen whole at small theta_d only: fewer slices count, and the error says so.

use crate::brdf::Brdf;
use crate::geometry::{DirectionPair, Symmetry};
use crate::metrics;
use crate::parametrization::{Form, HalfDifference, Parametrization};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Steps in theta_d, and their size (degrees).
const SLICES: usize = 13;
const STEP_DEG: f64 = 5.0;

/// The largest elevation: beyond it measured tables are unreliable, and models diverge.
const HORIZON_DEG: f64 = 80.0;

/// Azimuths an average is taken over. None lies in a mirror plane, where tables may have seams.
const PHI_D: usize = 24;
const PHI_H: usize = 12;

/// The narrowest half width that is looked for (rad): a tenth of the narrowest model's.
const NARROWEST: f64 = 1e-7;

/// Ratio of neighbouring theta_h of the search.
const RATIO: f64 = 1.1;

/// A slice whose peak is less than this times the floor has no lobe.
const CONTRAST: f64 = 1.1;

/// Slices a line needs.
const MIN_SLICES: usize = 5;

/// Steps that are passed over at a time, about a factor of ten, and the share of the peak above which a step is flat.
const STRETCH: i32 = 24;
const LEVEL: f64 = 0.99;

/// Largest number of steps towards a half width, and the relative change that ends them.
const REFINEMENTS: usize = 45;
const REFINED: f64 = 1e-12;

/// The change of a lobe's width with theta_d, as an exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// The exponent: 0 for a lobe over theta_h, 1 for one over |h_bar|.
    pub q: f64,
    /// Standard error of q, from the residuals.
    pub standard_error: f64,
    /// Root mean square residual of the logarithm of the width.
    pub residual: f64,
    /// Half width at theta_d = 0 by the fitted line, rad.
    pub half_width: f64,
    /// Slices with a lobe that is seen down to half its height, of 13.
    pub slices: usize,
}

/// The alignment of a BRDF; `None` if there is no lobe at theta_h = 0 in at least five slices: a
/// diffuse material, a rim, or a lobe too wide to be seen whole.
pub fn alignment(brdf: &dyn Brdf) -> Option<Alignment> {
    let slices = (0..SLICES).into_par_iter();
    let slice = |i| Slice::new(brdf, i as f64 * STEP_DEG);
    let slices: Vec<Slice<'_>> = slices.map(slice).collect();
    let averages = slices.iter().flat_map(|s| &s.averages);
    let floor = averages.map(|(_, g)| *g).fold(f64::INFINITY, f64::min);
    let points = slices.par_iter().filter_map(|slice| {
        let width = slice.half_width(floor)?;
        Some([slice.theta_d.cos().ln(), width.sin().ln()])
    });
    line(&points.collect::<Vec<_>>())
}

/// The least-squares line of ln sin(width) over ln cos(theta_d).
fn line(points: &[[f64; 2]]) -> Option<Alignment> {
    if points.len() < MIN_SLICES {
        return None;
    }
    let n = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / n;
    let [x, y] = [mean(0), mean(1)];
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p[0] - x, p[1] - y)).sum();
    let (xx, xy): (f64, f64) = (sum(&|x, _| x * x), sum(&|x, y| x * y));
    let slope = xy / xx;
    let residuals: f64 = sum(&|x, y| (y - slope * x).powi(2));
    Some(Alignment {
        q: -slope,
        standard_error: (residuals / (n - 2.0) / xx).sqrt(),
        residual: (residuals / n).sqrt(),
        half_width: (y - slope * x).exp().min(1.0).asin(),
        slices: points.len(),
    })
}

/// The average over azimuths at one theta_d.
struct Slice<'a> {
    brdf: &'a dyn Brdf,
    form: Form<HalfDifference>,
    theta_d: f64,
    /// (theta_h, average), from 0 up.
    averages: Vec<(f64, f64)>,
}

impl<'a> Slice<'a> {
    fn new(brdf: &'a dyn Brdf, theta_d_deg: f64) -> Self {
        let symmetry = Symmetry::NONE.with_isotropy(brdf.symmetry().isotropic);
        let mut slice = Self {
            brdf,
            form: Form::<HalfDifference>::new(symmetry),
            theta_d: theta_d_deg.to_radians(),
            averages: Vec::new(),
        };
        let last = (HORIZON_DEG - theta_d_deg).to_radians();
        let peak = slice.average(0.0);
        // Stretches in which the lobe stays at its peak are passed over.
        let (mut first, stretch) = (NARROWEST, RATIO.powi(STRETCH));
        while stretch * first < last
            && let (Some(peak), Some(next)) = (peak, slice.average(stretch * first))
            && next >= LEVEL * peak
        {
            first *= stretch;
        }
        let steps = std::iter::successors(Some(first), |theta| Some(theta * RATIO));
        let thetas = steps.take_while(|theta| *theta < last).chain([last]);
        let averages = thetas.filter_map(|theta_h| Some((theta_h, slice.average(theta_h)?)));
        let of_peak = peak.map(|peak| (0.0, peak));
        slice.averages = of_peak.into_iter().chain(averages).collect();
        slice
    }

    /// Mean luminance over the azimuths; `None` if half of them have no data.
    fn average(&self, theta_h: f64) -> Option<f64> {
        let isotropic = self.form.symmetry().isotropic;
        let turns = if isotropic { 1 } else { PHI_H };
        let azimuth = |k: usize, n: usize| TAU * (k as f64 + 0.5) / n as f64;
        let coords = (0..turns * PHI_D).map(|k| {
            let (phi_h, phi_d) = (azimuth(k / PHI_D, PHI_H), azimuth(k % PHI_D, PHI_D));
            match isotropic {
                true => [theta_h, self.theta_d, phi_d, 0.0],
                false => [theta_h, phi_h, self.theta_d, phi_d],
            }
        });
        let pairs: Vec<DirectionPair> = coords.filter_map(|c| self.form.inverse(&c)).collect();
        let values = metrics::evaluate(self.brdf, &pairs);
        let found = (0..pairs.len()).filter_map(|i| values.get(i));
        let (sum, count) = found.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        (2 * count > turns * PHI_D).then(|| sum / count as f64)
    }

    /// The theta_h (rad) where the average first falls to half of its value at theta_h = 0, both
    /// above `floor`.
    fn half_width(&self, floor: f64) -> Option<f64> {
        let &(first, peak) = self.averages.first()?;
        // Without data at the peak there is nothing to take half of.
        if first > 0.0 || !(peak > CONTRAST * floor) {
            return None;
        }
        let half = 0.5 * (peak + floor);
        let crossing = self.averages.windows(2).find(|pair| pair[1].1 <= half)?;
        // Regula falsi, Illinois (Dowell and Jarratt 1971): an end that stays counts half.
        let [mut low, mut high] = [0, 1].map(|i| (crossing[i].0, crossing[i].1 - half));
        if low.0 == 0.0 {
            return None;
        }
        let (mut width, mut above) = (high.0, None);
        for _ in 0..REFINEMENTS {
            let next = high.0 - high.1 * (high.0 - low.0) / (high.1 - low.1);
            let is_done = (next - width).abs() <= REFINED * next;
            width = next;
            if is_done {
                break;
            }
            let over = self.average(width)? - half;
            let is_above = over > 0.0;
            let stays = above == Some(is_above);
            above = Some(is_above);
            let (end, other) = match is_above {
                true => (&mut low, &mut high),
                false => (&mut high, &mut low),
            };
            *end = (width, over);
            if stays {
                other.1 *= 0.5;
            }
        }
        Some(width)
    }
}
