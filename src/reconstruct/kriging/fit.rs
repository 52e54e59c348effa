//! The kernel that fits the readings of one material best, near the one of many materials.

use super::kernel::Kernel;
use super::system::Data;
use nalgebra::{DMatrix, DVector};

/// Width of the normal prior of the logarithms of amplitudes and lengths.
const WIDTH: f64 = 0.7;

/// Steps of the search; most materials need fewer.
const STEPS: usize = 25;

/// The search ends where a step lowers −ln(posterior) by less.
const ENOUGH: f64 = 1e-3;

/// The kernel of the largest posterior: quasi-Newton steps (BFGS, Nocedal & Wright 2006, algorithm 6.1) from
/// `kernel`, each halved until it lowers the objective. The result is never less likely than `kernel`.
pub(super) fn fit(kernel: &Kernel, data: &Data) -> Kernel {
    let start = kernel.logs();
    let objective = |x: &DVector<f64>| -> Option<(f64, DVector<f64>)> {
        let (loss, slope) = data.likelihood(&kernel.with_logs(x.as_slice()))?;
        let off = (x - DVector::from_column_slice(&start)) / WIDTH;
        let value = loss + 0.5 * off.norm_squared();
        Some((value, DVector::from_vec(slope) + off / WIDTH))
    };
    let n = start.len();
    let mut x = DVector::from_column_slice(&start);
    let Some((mut value, mut slope)) = objective(&x) else {
        return kernel.clone();
    };
    // The prior's own curvature.
    let mut inverse = DMatrix::identity(n, n) * (WIDTH * WIDTH);
    for _ in 0..STEPS {
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
        if gain < ENOUGH {
            break;
        }
    }
    kernel.with_logs(x.as_slice())
}
