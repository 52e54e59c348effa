//! Errors of the moments of a reconstruction.

use crate::metrics::{Judged, Quantity, quantities};

use super::component::{Component, Moments};
use super::profile::Profile;

/// Moment errors of a reconstruction: means over the views of the largest error of the components
/// of each order. A view where the truth or the reconstruction leaves a moment undefined is left
/// out of that mean; `None` if that leaves none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MomentErrors {
    /// |α_g − α_f| / α_f.
    pub energy: Option<f64>,
    /// |µ_g − µ_f|, rad.
    pub mean: Option<f64>,
    /// |µ_g − µ_f|, each component relative to σ_f.
    pub mean_relative: Option<f64>,
    /// |Σ_g − Σ_f|, each component relative to σ_f².
    pub covariance: Option<f64>,
    /// Error of the standardised co-skewness.
    pub skewness: Option<f64>,
    /// Error of the excess co-kurtosis.
    pub kurtosis: Option<f64>,
}

impl MomentErrors {
    /// Every error, in the order of columns, with its field.
    pub const QUANTITIES: [Judged<MomentErrors>; 6] = quantities! {
        "moment_energy": energy,
            "mean over the views of the relative error of the energy of slices; this and the next six with quantities = [\"moments\"], the same for every measure";
        "moment_mean_rad": mean,
            "mean over the views of the error of the mean direction of slices, the larger of both angles, in radians";
        "moment_mean": mean_relative, "the same, each angle relative to its sigma";
        "moment_covariance": covariance,
            "mean over the views of the largest error of a covariance relative to sigma²";
        "moment_skewness": skewness, "mean over the views of the largest error of a co-skewness";
        "moment_kurtosis": kurtosis,
            "mean over the views of the largest error of an excess co-kurtosis";
    };

    /// Number of slices of truth and reconstruction that are not resolved.
    pub(crate) const UNRESOLVED: Quantity = Quantity::count(
        "moment_unresolved",
        "slices of the truth whose moments missed the estimator's tolerance, and of the reconstruction whose moments missed that and a fifth of their error",
    );

    /// Compares two profiles of the same views; `truth` is f.
    ///
    /// # Panics
    /// If they have different views.
    pub fn between(truth: &Profile, reconstruction: &Profile) -> Self {
        assert_eq!(truth.views, reconstruction.views);
        let mean = |of: fn(&Moments, &Moments) -> Option<f64>| {
            let pairs = truth.slices.iter().zip(&reconstruction.slices);
            let errors = pairs.filter_map(|(f, g)| of(&f.moments, &g.moments));
            let (sum, n) = errors.fold((0.0, 0), |(sum, n), e| (sum + e, n + 1));
            (n > 0).then(|| sum / f64::from(n))
        };
        Self {
            energy: mean(|f, g| {
                let alpha = f.energy()?;
                (alpha > 0.0).then_some((g.energy()? - alpha).abs() / alpha)
            }),
            mean: mean(|f, g| largest(f, g, 1, |_| Some(1.0))),
            mean_relative: mean(|f, g| largest(f, g, 1, |c| sigma(f, c))),
            covariance: mean(|f, g| largest(f, g, 2, |c| sigma(f, c))),
            skewness: mean(|f, g| largest(f, g, 3, |_| Some(1.0))),
            kurtosis: mean(|f, g| largest(f, g, 4, |_| Some(1.0))),
        }
    }
}

/// σ_θ^n σ_φ^m.
pub(super) fn sigma(moments: &Moments, c: Component) -> Option<f64> {
    let [theta, phi] = moments.sigma()?;
    Some(theta.powi(c.n as i32) * phi.powi(c.m as i32))
}

/// The largest error of the components of an order, each in its unit.
fn largest(
    f: &Moments,
    g: &Moments,
    order: usize,
    unit: impl Fn(Component) -> Option<f64>,
) -> Option<f64> {
    let components = Component::ALL.into_iter().filter(|c| c.order() == order);
    components
        .map(|c| Some((g.get(c)?.value - f.get(c)?.value).abs() / unit(c)?))
        .try_fold(0.0, |most: f64, e| Some(most.max(e?)))
}
