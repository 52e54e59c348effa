//! Statistics of the heights and slopes of a surface.

use super::HeightField;
use serde::Serialize;
use std::fmt;

/// Numbers of one period; lengths in cells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Statistics {
    /// Cells along x and y.
    pub size: [usize; 2],
    /// Root mean square of the height about its mean.
    pub rms_height: f64,
    /// Largest less smallest height.
    pub range: f64,
    /// Root mean square of dz/dx and dz/dy of the triangles.
    pub rms_slope: [f64; 2],
    /// Area of the surface for each of the plane.
    pub area: f64,
    /// Lag along x and y where the correlation of heights falls below 1/e; `None` where it does not within half a period.
    pub correlation: [Option<f64>; 2],
    /// 1 over the root mean square of d²z/dx² and d²z/dy²: radii of curvature; `None` of what is straight.
    pub curvature_radius: [Option<f64>; 2],
    /// Largest difference of the cumulative distribution of slopes to that of Beckmann facets of alpha = √2 rms slope;
    /// `None` where an axis has no slope.
    pub beckmann: Option<f64>,
    /// Largest difference of the cumulative distribution of slopes to that of GGX facets; `None` as for `beckmann`.
    pub ggx: Option<f64>,
}

/// Lines of heights that the correlation is asked of.
const LINES: usize = 64;

impl Statistics {
    /// Of a period of `field`.
    pub(crate) fn new(field: &HeightField) -> Self {
        let size = field.size();
        let heights: Vec<f64> = field.heights().collect();
        let n = heights.len() as f64;
        let mean = heights.iter().sum::<f64>() / n;
        let variance = heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / n;
        let [low, high] = [f64::min, f64::max].map(|f| heights.iter().copied().fold(mean, f));
        let (mut squares, mut area) = ([0.0; 2], 0.0);
        for [x, y] in field.all_slopes() {
            squares[0] += x * x;
            squares[1] += y * y;
            area += (1.0 + x * x + y * y).sqrt();
        }
        let rms_slope = squares.map(|s| (s / (2.0 * n)).sqrt());
        let at = |x: usize, y: usize| heights[(y % size[1]) * size[0] + x % size[0]] - mean;
        let cells = || (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let lag = |[x, y]: [usize; 2], axis: usize, steps: usize| match axis {
            0 => at(x + steps, y),
            _ => at(x, y + steps),
        };
        let correlation = [0, 1].map(|axis| {
            // Lines along the axis, some of them where there are many: each lag asks all of them.
            let stride = size[1 - axis].div_ceil(LINES);
            let lines = || (0..size[1 - axis]).step_by(stride);
            let product = |steps: usize| {
                let places = lines().flat_map(|line| (0..size[axis]).map(move |i| [i, line]));
                let cells = places.map(|[i, line]| if axis == 0 { [i, line] } else { [line, i] });
                let sum: f64 = cells.map(|c| at(c[0], c[1]) * lag(c, axis, steps)).sum();
                sum / (lines().count() * size[axis]) as f64
            };
            crossing(size[axis] / 2, product(0), product)
        });
        let curvature_radius = [0, 1].map(|axis| {
            let second = |c: [usize; 2]| at(c[0], c[1]) - 2.0 * lag(c, axis, 1) + lag(c, axis, 2);
            let square = cells().map(|c| second(c).powi(2)).sum::<f64>() / n;
            (square > 0.0).then(|| 1.0 / square.sqrt())
        });
        let distances = (rms_slope[0] > 0.0 && rms_slope[1] > 0.0).then(|| {
            let scaled = |s: [f64; 2]| {
                let [x, y] = [0, 1].map(|axis| s[axis] / rms_slope[axis]);
                0.5 * (x * x + y * y)
            };
            let mut slopes: Vec<f64> = field.all_slopes().map(scaled).collect();
            slopes.sort_unstable_by(f64::total_cmp);
            let beckmann = distance(&slopes, |t| -(-t).exp_m1());
            [beckmann, distance(&slopes, |t| t / (1.0 + t))]
        });
        Self {
            size,
            rms_height: variance.sqrt(),
            range: high - low,
            rms_slope,
            area: area / (2.0 * n),
            correlation,
            curvature_radius,
            beckmann: distances.map(|d| d[0]),
            ggx: distances.map(|d| d[1]),
        }
    }
}

/// Whether light may be taken for rays on a surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Optics {
    /// The wavelength, cells.
    pub wavelength: f64,
    /// Smallest correlation length and radius of curvature over both axes, wavelengths.
    pub correlation: Option<f64>,
    /// See [`correlation`](Self::correlation).
    pub curvature_radius: Option<f64>,
    /// True if both are a wavelength at least (Thorsos 1988 asks for 2π l/λ > 6), or have none.
    pub holds: bool,
    /// True if the slope changes by less than half its rms from cell to cell.
    pub resolved: bool,
}

impl Statistics {
    /// Of a surface with cells of `pitch`, in light of `wavelength`, in one unit.
    pub(crate) fn optics(&self, pitch: f64, wavelength: f64) -> Optics {
        let in_waves = |lengths: [Option<f64>; 2]| {
            let smallest = lengths.into_iter().flatten().reduce(f64::min);
            smallest.map(|cells| cells * pitch / wavelength)
        };
        let correlation = in_waves(self.correlation);
        let curvature_radius = in_waves(self.curvature_radius);
        let slope = self.rms_slope.into_iter().fold(0.0, f64::max);
        let bend = self.curvature_radius.into_iter().flatten().reduce(f64::min);
        Optics {
            wavelength: wavelength / pitch,
            correlation,
            curvature_radius,
            holds: [correlation, curvature_radius]
                .iter()
                .all(|l| l.is_none_or(|l| l >= 1.0)),
            resolved: bend.is_none_or(|radius| radius * slope >= 2.0),
        }
    }
}

impl fmt::Display for Optics {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let waves =
            |length: Option<f64>| length.map_or_else(|| "none".into(), |l| format!("{l:.1}"));
        write!(
            f,
            "geometric optics {}: in wavelengths, correlation length {}, radius of curvature {}; allowed: 1 or more",
            if self.holds { "holds" } else { "does not hold" },
            waves(self.correlation),
            waves(self.curvature_radius),
        )?;
        if !self.resolved {
            f.write_str(
                "\nnot resolved: slopes change by more than half their rms from cell to cell",
            )?;
        }
        Ok(())
    }
}

/// Where the products of heights fall below the variance over e, between two whole lags.
fn crossing(most: usize, variance: f64, product: impl Fn(usize) -> f64) -> Option<f64> {
    let level = variance * (-1.0f64).exp();
    let mut before = variance;
    for steps in 1..=most {
        let now = product(steps);
        if now < level {
            return Some((steps - 1) as f64 + (before - level) / (before - now));
        }
        before = now;
    }
    None
}

/// Largest difference of the distribution of ascending numbers to the cumulative one `cdf` (Kolmogorov's).
fn distance(ascending: &[f64], cdf: impl Fn(f64) -> f64) -> f64 {
    let n = ascending.len() as f64;
    let steps = ascending.iter().enumerate();
    steps.fold(0.0, |most, (i, t)| {
        let asked = cdf(*t);
        let [low, high] = [i as f64 / n, (i + 1) as f64 / n];
        most.max((asked - low).abs()).max((asked - high).abs())
    })
}
