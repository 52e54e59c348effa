//! The first mesh of a slice: rectangles that shrink towards its peaks.

use super::cubature::Rectangle;
use super::slice::{Batch, Slice};
use crate::parametrization::view_centered;
use std::f64::consts::FRAC_PI_2;

/// The peaks at the mirror direction and at the view.
pub(super) fn peaks(slice: &Slice<'_>) -> Vec<Peak> {
    let theta_o = slice.theta_o;
    let mut peaks = Vec::from_iter(Peak::find(slice, -theta_o));
    if theta_o > 1e-9 {
        // Only a peak or a ridge of its own: the flank of the mirror peak falls on one side.
        peaks.extend(Peak::find(slice, theta_o).filter(|p| p.on_both_sides));
    }
    peaks
}

/// Nodes of a slice, θ and φ (rad), with the areas that they stand for: Gauss's 2 × 2 in each rectangle of the first mesh, which
/// resolves the peaks. Of a slice that is the same at φ and −φ those at φ ≥ 0.
pub(super) fn nodes(slice: &Slice<'_>) -> Vec<([f64; 2], f64)> {
    let of = |r: &Rectangle| {
        let (centre, area) = (r.centre(), r.width(0) * r.width(1));
        let at = |axis: usize, side: f64| centre[axis] + side * 0.5 / 3_f64.sqrt() * r.width(axis);
        let both = [-1.0, 1.0].map(|t| [-1.0, 1.0].map(|p| [at(0, t), at(1, p)]));
        both.into_iter()
            .flatten()
            .map(move |point| (point, 0.25 * area))
            .collect::<Vec<_>>()
    };
    mesh(&peaks(slice), slice.is_mirrored(), COARSE)
        .iter()
        .flat_map(of)
        .collect()
}

/// A peak of a slice: direction and half widths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    /// θ; φ is 0.
    theta: f64,
    /// The smallest distance (rad) along θ and along φ at which the slice has half the value.
    half_width: [f64; 2],
    /// True if the slice falls to half the value in both senses of θ.
    on_both_sides: bool,
}

impl Peak {
    /// Number of scales that are tried: π/2 × 2^−k, down to 1e-13.
    const SCALES: i32 = 44;
    pub(super) const EVALUATIONS: usize = 1 + 4 * Self::SCALES as usize;

    /// The peak at (theta, 0), if the slice falls to half its value within a coarse rectangle.
    fn find(slice: &Slice<'_>, theta: f64) -> Option<Self> {
        let mut batch = Batch::default();
        batch.push(slice, view_centered(theta, 0.0));
        let steps = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        for k in 1..=Self::SCALES {
            let r = FRAC_PI_2 * f64::powi(2.0, -k);
            for [t, p] in steps {
                // A step across the horizon sees nothing; stopping short of it does no harm.
                let theta = (theta + r * t).clamp(-FRAC_PI_2, FRAC_PI_2);
                batch.push(slice, view_centered(theta, r * p));
            }
        }
        slice.evaluate(&mut batch);
        let (top, around) = batch.values().split_first()?;
        let mut half_width = [f64::INFINITY; 2];
        let mut falls = [false; 4];
        for (k, values) in (1..).zip(around.chunks_exact(4)) {
            let r = FRAC_PI_2 * f64::powi(2.0, -k);
            for (direction, value) in values.iter().enumerate() {
                let axis = direction / 2;
                let inside = axis == 1 || (theta + r * steps[direction][0]).abs() < FRAC_PI_2;
                if inside && *value < 0.5 * top {
                    half_width[axis] = half_width[axis].min(r);
                    falls[direction] = true;
                }
            }
        }
        let narrow = half_width.iter().any(|w| *w < COARSE);
        narrow.then_some(Self {
            theta,
            half_width,
            on_both_sides: falls[0] && falls[1],
        })
    }
}

/// Largest rectangle of the first mesh, rad: with 15 nodes along each angle no gap is wider than
/// 1.6°.
pub(super) const COARSE: f64 = FRAC_PI_2 / 6.0;

/// The same of a reconstruction that is compared with a truth, whose features are as wide as its readings lie apart, or at its peak.
pub(super) const COARSE_AGAINST: f64 = 3.0 * COARSE;

/// Rectangles that cover the square, or its half at φ ≥ 0, no wider than `coarse`, and shrink towards the peaks.
pub(super) fn mesh(peaks: &[Peak], half: bool, coarse: f64) -> Vec<Rectangle> {
    let mut whole = vec![Rectangle {
        lo: [-FRAC_PI_2, if half { 0.0 } else { -FRAC_PI_2 }],
        hi: [FRAC_PI_2; 2],
    }];
    let mut cut = |axis: usize, at: f64| {
        whole = whole
            .iter()
            .flat_map(|r| {
                if r.lo[axis] < at && at < r.hi[axis] {
                    r.cut(axis, at).to_vec()
                } else {
                    vec![*r]
                }
            })
            .collect();
    };
    for peak in peaks {
        cut(0, peak.theta);
        cut(1, 0.0);
    }
    let mut done = Vec::new();
    let mut stack = whole;
    while let Some(r) = stack.pop() {
        if let Some(parts) = towards_a_peak(&r, peaks) {
            stack.extend(parts);
        } else if let Some(axis) = [0, 1].into_iter().find(|&a| r.width(a) > 1.01 * coarse) {
            let parts = (r.width(axis) / coarse).ceil();
            let [below, above] = r.cut(axis, r.lo[axis] + r.width(axis) / parts);
            stack.extend([above, below]);
        } else {
            done.push(r);
        }
    }
    done
}

/// The parts of a rectangle that has a peak at a corner and is wide against it.
fn towards_a_peak(r: &Rectangle, peaks: &[Peak]) -> Option<Vec<Rectangle>> {
    for peak in peaks {
        let place = [peak.theta, 0.0];
        // −1 below, 1 above the peak; 0 if the peak is no corner.
        let side = [0, 1].map(|a| match place[a] {
            x if r.lo[a] == x => 1.0,
            x if r.hi[a] == x => -1.0,
            _ => 0.0,
        });
        if side.contains(&0.0) {
            continue;
        }
        // Both angles shrink in step, each against its own half width: a part beside the peak
        // that were far wider along it than the peak is would see too little of its flank.
        let ratio = [0, 1].map(|a| r.width(a) / peak.half_width[a]);
        let largest = ratio[0].max(ratio[1]);
        let mut parts = vec![*r];
        for a in 0..2 {
            if ratio[a] > 2.0 && ratio[a] > 0.25 * largest {
                let distance = peak.half_width[a].max(0.25 * r.width(a));
                let at = place[a] + side[a] * distance;
                parts = parts.iter().flat_map(|p| p.cut(a, at)).collect();
            }
        }
        if parts.len() > 1 {
            return Some(parts);
        }
    }
    None
}
