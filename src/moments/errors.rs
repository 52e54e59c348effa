//! Errors of the moments of a reconstruction.

use crate::metrics::{Judged, Quantity};

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
    pub const QUANTITIES: [Judged<MomentErrors>; 6] = [
        (
            Quantity::real(
                "moment_energy",
                "mean over the views of the relative error of the energy of slices; this and the next six with quantities = [\"moments\"], the same for every measure",
            ),
            |e| e.energy,
        ),
        (
            Quantity::real(
                "moment_mean_rad",
                "mean over the views of the error of the mean direction of slices, the larger of both angles, in radians",
            ),
            |e| e.mean,
        ),
        (
            Quantity::real("moment_mean", "the same, each angle relative to its sigma"),
            |e| e.mean_relative,
        ),
        (
            Quantity::real(
                "moment_covariance",
                "mean over the views of the largest error of a covariance relative to sigma²",
            ),
            |e| e.covariance,
        ),
        (
            Quantity::real(
                "moment_skewness",
                "mean over the views of the largest error of a co-skewness",
            ),
            |e| e.skewness,
        ),
        (
            Quantity::real(
                "moment_kurtosis",
                "mean over the views of the largest error of an excess co-kurtosis",
            ),
            |e| e.kurtosis,
        ),
    ];

    /// Number of slices of truth and reconstruction that are not resolved.
    pub const UNRESOLVED: Quantity = Quantity::count(
        "moment_unresolved",
        "slices of truth and reconstruction whose moments missed the estimator's tolerance",
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
fn sigma(moments: &Moments, c: Component) -> Option<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, Channels, Lambert, Spectrum};
    use crate::moments::{Channel, MomentsSpec, PeakResolving};
    use crate::registry::read_text;

    fn profile(brdf: &dyn Brdf) -> Profile {
        let spec = MomentsSpec {
            views: 3,
            max_view_deg: 60.0,
            ..MomentsSpec::default()
        };
        let estimator = PeakResolving::default();
        Profile::new(brdf, Channel::Luminance, &spec, &estimator, 1).unwrap()
    }

    fn lambert(albedo: f64) -> Lambert {
        Lambert::new(Spectrum::Grey(albedo), Channels::Luminance)
    }

    #[test]
    fn a_darker_copy_errs_in_energy_alone() {
        let errors = MomentErrors::between(&profile(&lambert(0.8)), &profile(&lambert(0.6)));
        assert!((errors.energy.unwrap() - 0.25).abs() < 1e-12);
        for e in [
            errors.mean,
            errors.covariance,
            errors.skewness,
            errors.kurtosis,
        ] {
            assert!(e.unwrap() < 1e-12);
        }
    }

    #[test]
    fn black_has_no_moments_to_compare() {
        let errors = MomentErrors::between(&profile(&lambert(0.0)), &profile(&lambert(0.6)));
        assert_eq!(errors, MomentErrors::default());
        let errors = MomentErrors::between(&profile(&lambert(0.6)), &profile(&lambert(0.0)));
        assert_eq!((errors.energy, errors.mean), (Some(1.0), None));
    }

    #[test]
    fn a_wider_lobe_errs_as_its_moments_do() {
        let of = |alpha: f64| {
            let entry = crate::brdf::all().into_iter().find(|e| e.kind == "ggx");
            let spec = read_text(&entry.unwrap(), &format!("alpha = {alpha}")).unwrap();
            profile(&*spec.build(Channels::Luminance).unwrap())
        };
        let (f, g) = (of(0.2), of(0.25));
        let errors = MomentErrors::between(&f, &g);
        // By hand, from the profiles: one loop a quantity.
        let (mut mean, mut covariance) = (0.0, 0.0);
        for (f, g) in f.slices.iter().zip(&g.slices) {
            let ([ft, fp], [gt, gp]) = (f.moments.mean().unwrap(), g.moments.mean().unwrap());
            mean += (gt - ft).abs().max((gp - fp).abs()) / 3.0;
            let (f, g) = (
                f.moments.covariance().unwrap(),
                g.moments.covariance().unwrap(),
            );
            let relative = [
                (g[0] - f[0]).abs() / f[0],
                (g[1] - f[1]).abs() / (f[0] * f[2]).sqrt(),
                (g[2] - f[2]).abs() / f[2],
            ];
            covariance += relative.into_iter().fold(0.0, f64::max) / 3.0;
        }
        assert!((errors.mean.unwrap() - mean).abs() < 1e-15);
        assert!((errors.covariance.unwrap() - covariance).abs() < 1e-13);
        assert!(errors.covariance.unwrap() > 0.1);
    }
}
