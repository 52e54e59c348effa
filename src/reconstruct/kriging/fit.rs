//! The kernel that fits the readings of one material best, near the one of many materials.

use super::kernel::Kernel;
use super::system::Data;
use crate::geometry::DirectionPair;
use crate::reconstruct::sheets::still;
use nalgebra::{DMatrix, DVector};

/// Width of the normal prior of the logarithms of amplitudes and lengths.
const WIDTH: f64 = 0.7;

/// Steps of the search; most materials need fewer.
const STEPS: usize = 25;

/// The search ends where a step lowers −ln(posterior) by less.
const ENOUGH: f64 = 1e-3;

/// A variance of readings that state no uncertainty, and how far its logarithm may be off: half a percent, .07 to 4 %.
pub(super) const UNSAID: f64 = 2.5e-5;
const UNSAID_WIDTH: f64 = 2.0;

/// The kernel of the largest posterior, never less likely than `kernel`. `unsaid`: readings have a variance that nothing states,
/// which is found as well.
fn fit(kernel: &Kernel, data: &Data, unsaid: bool) -> Kernel {
    let mut start = kernel.logs();
    let lengths = start.len();
    let mut widths = vec![WIDTH; lengths];
    if unsaid {
        start.push(UNSAID.ln());
        widths.push(UNSAID_WIDTH);
    }
    let widths = DVector::from_vec(widths);
    let start = DVector::from_vec(start);
    let of = |x: &DVector<f64>| {
        let (logs, variance) = x.as_slice().split_at(lengths);
        Kernel {
            unsaid: variance.first().map_or(0.0, |x| x.exp()),
            ..kernel.with_logs(logs)
        }
    };
    let objective = |x: &DVector<f64>| -> Option<(f64, DVector<f64>)> {
        let kernel = of(x);
        let found = data.clone().noisier(kernel.unsaid).likelihood(&kernel)?;
        let mut slope = found.by_logs;
        if unsaid {
            slope.push(found.by_noise * kernel.unsaid);
        }
        let off = (x - &start).component_div(&widths);
        let value = found.loss + 0.5 * off.norm_squared();
        Some((value, DVector::from_vec(slope) + off.component_div(&widths)))
    };
    // The prior's own curvature.
    let inverse = DMatrix::from_diagonal(&widths.map(|w| w * w));
    minimise(start.clone(), inverse, STEPS, ENOUGH, objective)
        .map_or_else(|| kernel.clone(), |x| of(&x))
}

/// Where a function is least: quasi-Newton steps (BFGS, Nocedal & Wright 2006, algorithm 6.1) from `start` and an inverse of its
/// curvature, each halved until it lowers the function; at most `steps`, until one lowers it by less than `enough`. `objective` is its
/// value and its slope; the result is `None` if it has none at the start.
pub(super) fn minimise(
    start: DVector<f64>,
    mut inverse: DMatrix<f64>,
    steps: usize,
    enough: f64,
    objective: impl Fn(&DVector<f64>) -> Option<(f64, DVector<f64>)>,
) -> Option<DVector<f64>> {
    let n = start.len();
    let mut x = start;
    let (mut value, mut slope) = objective(&x)?;
    for _ in 0..steps {
        let mut step = -(&inverse * &slope);
        // No logarithm moves by more than twice the width at once.
        step *= (2.0 * WIDTH / step.amax()).min(1.0);
        let descent = slope.dot(&step);
        if !(descent < 0.0) {
            break;
        }
        let tried = (0..8).find_map(|halvings| {
            let share = 0.5_f64.powi(halvings);
            let next = &x + &step * share;
            let (lower, at) = objective(&next)?;
            (lower <= value + 1e-4 * share * descent).then_some((next, lower, at))
        });
        let Some((next, lower, at)) = tried else {
            break;
        };
        let (moved, turned) = (&next - &x, &at - &slope);
        let curvature = moved.dot(&turned);
        if curvature > 1e-10 {
            let shear = DMatrix::identity(n, n) - &moved * turned.transpose() / curvature;
            inverse = &shear * inverse * shear.transpose() + &moved * moved.transpose() / curvature;
        }
        let gain = value - lower;
        (x, value, slope) = (next, lower, at);
        if gain < enough {
            break;
        }
    }
    Some(x)
}

/// The kernel that is [fitted](fit) to readings at some pairs, or `kernel` itself: the one that predicts better what is left out. That is
/// each reading in turn, or each sheet if readings lie in sheets: those of a sheet predict each other and say little of what lies between.
pub(super) fn better(
    kernel: &Kernel,
    data: &Data,
    pairs: &[DirectionPair],
    unsaid: bool,
) -> Kernel {
    let groups = still(pairs).map_or_else(
        || (0..pairs.len()).map(|i| vec![i]).collect(),
        |still| still.sheets,
    );
    let fitted = fit(kernel, data, unsaid);
    let published = Kernel {
        unsaid: fitted.unsaid,
        ..kernel.clone()
    };
    let loss = |kernel: &Kernel| {
        let data = data.clone().noisier(kernel.unsaid);
        data.left_out(kernel, &groups).unwrap_or(f64::INFINITY)
    };
    if loss(&fitted) <= loss(&published) {
        fitted
    } else {
        published
    }
}
