//! Analysis of the moment profiles of a group of materials: fits, correlations, and the part that
//! the horizon explains.

use super::profiles::MaterialProfiles;
use crate::moments::{
    Channel, Clamping, Component, EnergyFit, EnergySeries, FactorFit, FitError, MeanVarianceFit,
    Profile, ViewRange, fit_average_variance, fit_energy, fit_energy_shared, fit_mean,
    fit_mean_variance,
};
use crate::numeric::{Correlation, CorrelationMatrix, correlate, extent};
use serde::Serialize;

/// The fits of one profile, and averages over the fitted views.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileFits {
    /// Name of the material.
    pub material: String,
    /// Channel of the profile.
    pub channel: Channel,
    /// Diffuse part that was subtracted before, sr⁻¹.
    pub diffuse: f64,
    /// The views that were fitted.
    pub range: ViewRange,
    /// Base and ramp of the energy.
    pub energy: Result<EnergyFit, FitError>,
    /// Slope of the mean.
    pub mean: Result<FactorFit, FitError>,
    /// Constant that fits the variance, rad².
    pub variance: Result<FactorFit, FitError>,
    /// Average over the fitted views of each component, at its index.
    pub averages: [Option<f64>; 15],
    /// The largest size of each component over the fitted views; means and covariances in units of σ and σ².
    pub largest: [Option<f64>; 15],
    /// Clamping by the horizon, if the config asks for it.
    pub clamping: Option<Clamping>,
    /// Average share of the fitted slices that was below the diffuse part.
    pub clamped_share: f64,
    /// Fitted views that missed the estimator's tolerance.
    pub unresolved: usize,
}

impl ProfileFits {
    /// Fits one profile of a material; `tolerance` is the relative accuracy of its energies.
    pub(crate) fn new(
        of: &MaterialProfiles,
        index: usize,
        range: ViewRange,
        tolerance: f64,
    ) -> Self {
        let profile = &of.profiles[index];
        let views = &profile.views;
        let variances = [TT, PP].map(|c| profile.values(c));
        let inside = || {
            let slices = profile.slices.iter().zip(views);
            slices.filter(|(_, theta)| range.contains(**theta))
        };
        let average = |c: Component| {
            let values = inside().filter_map(|(s, _)| Some(s.moments.get(c)?.value));
            let (sum, n) = values.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
            (n > 0).then(|| sum / f64::from(n))
        };
        let largest = |c: Component| {
            let values = inside().filter_map(|(s, _)| {
                let value = s.moments.get(c)?.value.abs();
                match c.order() {
                    1 | 2 => {
                        let [theta, phi] = s.moments.sigma()?;
                        Some(value / (theta.powi(c.n as i32) * phi.powi(c.m as i32)))
                    }
                    _ => Some(value),
                }
            });
            values.reduce(f64::max)
        };
        let shares: f64 = inside().map(|(s, _)| s.clamped_share).sum();
        Self {
            material: of.material.clone(),
            channel: profile.channel,
            diffuse: profile.diffuse,
            range,
            energy: fit_energy(views, &profile.values(Component::ENERGY), range, tolerance),
            mean: fit_mean(views, &profile.values(MEAN), range),
            variance: fit_average_variance(views, &variances[0], &variances[1], range),
            averages: Component::ALL.map(average),
            largest: Component::ALL.map(largest),
            clamping: of.clamping.clone().filter(|_| index == 0),
            clamped_share: shares / inside().count().max(1) as f64,
            unresolved: inside().filter(|(s, _)| s.unresolved.is_some()).count(),
        }
    }

    /// Average over the fitted views of the component of these orders along θ and φ.
    fn average(&self, [n, m]: [usize; 2]) -> Option<f64> {
        self.averages[Component { n, m }.index()]
    }

    /// Slope µ̃ of the mean; `None` if its fit failed.
    pub(crate) fn slope(&self) -> Option<f64> {
        Some(self.mean.as_ref().ok()?.factor)
    }

    /// Average variance σ̃², rad²; `None` if its fit failed.
    pub(crate) fn average_variance(&self) -> Option<f64> {
        Some(self.variance.as_ref().ok()?.factor)
    }
}

const MEAN: Component = Component { n: 1, m: 0 };
const TT: Component = Component { n: 2, m: 0 };
const PP: Component = Component { n: 0, m: 2 };

/// Two flags: true if θ_0 is within half a degree of the first fitted view; if θ_1 is the last one.
pub(crate) fn at_bound(fit: &EnergyFit, range: ViewRange) -> [bool; 2] {
    match fit.knots() {
        Some([lower, _]) => [
            lower < range.ends[0] + 0.5_f64.to_radians(),
            fit.upper_at_end,
        ],
        None => [false; 2],
    }
}

/// Mean and spread of a number over the materials of a group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of the sample (n − 1); `None` for one material.
    pub deviation: Option<f64>,
    /// Smallest and largest.
    pub range: [f64; 2],
    /// Number of materials.
    pub materials: usize,
}

impl Spread {
    /// The spread in another unit: every value times `factor`.
    #[must_use]
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self {
            mean: self.mean * factor,
            deviation: self.deviation.map(|d| d * factor),
            range: self.range.map(|v| v * factor),
            ..self
        }
    }

    /// Mean and spread of some values; `None` if there are none.
    pub(crate) fn over(values: impl Iterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.collect();
        let (n, range) = (values.len(), extent(values.iter().copied())?);
        let mean = values.iter().sum::<f64>() / n as f64;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Some(Self {
            mean,
            deviation: (n > 1).then(|| (squares / (n - 1) as f64).sqrt()),
            range,
            materials: n,
        })
    }
}

/// A correlation of two quantities over the materials of a group.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CorrelationRow {
    /// `orders` or `channels`.
    pub between: &'static str,
    /// First quantity, or `quantity channel`.
    pub a: String,
    /// Second one.
    pub b: String,
    /// Pearson's coefficient.
    pub pearson: Option<f64>,
    /// Spearman's coefficient.
    pub spearman: Option<f64>,
    /// Materials that have both.
    pub materials: usize,
}

/// Analysis of a group of materials; fields that name no channel are of the first channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The kind of its materials.
    pub name: String,
    /// The fits, material after material, each with all its channels.
    pub fits: Vec<ProfileFits>,
    /// θ_0 and θ_1 of each material's own fit (rad), where these are determined and inside the range.
    pub knots: [Option<Spread>; 2],
    /// Materials whose θ_0 is the first, or whose θ_1 is the last view of the range ([`at_bound`]).
    pub at_bounds: [usize; 2],
    /// Materials whose fitted energy is larger at θ_1 than at θ_0.
    pub boosted: usize,
    /// The energy fits with the same knots for all materials, at least one.
    pub shared: Result<Vec<EnergyFit>, FitError>,
    /// Average variance as a function of the mean slope.
    pub relation: Result<MeanVarianceFit, FitError>,
    /// Correlations between orders, and between colour channels.
    pub correlations: Vec<CorrelationRow>,
}

impl Group {
    /// Analyses materials of a group; `fits` are those of its profiles, `tolerance` the relative accuracy of energies.
    pub(crate) fn new(
        name: String,
        members: &[&MaterialProfiles],
        fits: Vec<ProfileFits>,
        range: ViewRange,
        tolerance: f64,
    ) -> Self {
        let channels = members.first().map_or(1, |m| m.profiles.len().max(1));
        let first: Vec<&ProfileFits> = fits.iter().step_by(channels).collect();
        let energy_fits = || first.iter().filter_map(|f| f.energy.as_ref().ok());
        let knot = |i: usize| {
            let knots = energy_fits().filter(|fit| !at_bound(fit, range)[i]);
            Spread::over(knots.filter_map(|fit| Some(fit.knots()?[i])))
        };
        let at_bounds = [0, 1].map(|i| energy_fits().filter(|fit| at_bound(fit, range)[i]).count());
        let rises = |fit: &&EnergyFit| {
            let ends = fit.knots().map(|knots| knots.map(|k| fit.value(k)));
            ends.is_some_and(|[lower, upper]| upper > lower)
        };
        let profiles: Vec<&Profile> = members.iter().filter_map(|m| m.profiles.first()).collect();
        let energies = profiles.iter().map(|p| p.values(Component::ENERGY));
        let energies: Vec<_> = energies.collect();
        let series = profiles.iter().zip(&energies).map(|(p, values)| {
            let views = &p.views;
            EnergySeries { views, values }
        });
        let shines = |series: &EnergySeries<'_>| series.values.iter().flatten().any(|v| *v > 0.0);
        let series: Vec<_> = series.filter(shines).collect();
        let slopes: Vec<_> = first.iter().map(|f| f.slope()).collect();
        let variances: Vec<_> = first.iter().map(|f| f.average_variance()).collect();
        Self {
            knots: [knot(0), knot(1)],
            at_bounds,
            boosted: energy_fits().filter(rises).count(),
            shared: fit_energy_shared(&series, range, tolerance),
            relation: fit_mean_variance(&slopes, &variances),
            correlations: correlations(&fits, channels),
            name,
            fits,
        }
    }

    /// The fits of the first channel, one per material.
    pub(crate) fn first_channel(&self) -> impl Iterator<Item = &ProfileFits> {
        let channel = self.fits.first().map(|f| f.channel);
        self.fits.iter().filter(move |f| Some(f.channel) == channel)
    }

    /// Mean and spread of a number of the first channel over the materials.
    pub(crate) fn spread(&self, of: impl Fn(&ProfileFits) -> Option<f64>) -> Option<Spread> {
        Spread::over(self.first_channel().filter_map(of))
    }
}

/// A number of a profile, with its name.
type Quantity = (&'static str, fn(&ProfileFits) -> Option<f64>);

/// The quantities that are correlated over materials.
const QUANTITIES: [Quantity; 8] = [
    ("energy", |f| f.averages[0]),
    ("mean_slope", ProfileFits::slope),
    ("average_variance", ProfileFits::average_variance),
    ("skewness_30", |f| f.average([3, 0])),
    ("skewness_12", |f| f.average([1, 2])),
    ("kurtosis_40", |f| f.average([4, 0])),
    ("kurtosis_22", |f| f.average([2, 2])),
    ("kurtosis_04", |f| f.average([0, 4])),
];

fn correlations(fits: &[ProfileFits], channels: usize) -> Vec<CorrelationRow> {
    let column = |channel: usize, of: fn(&ProfileFits) -> Option<f64>| -> Vec<Option<f64>> {
        let of_channel = fits.iter().skip(channel).step_by(channels);
        of_channel.map(of).collect()
    };
    let row = |between, a, b, c: Correlation| CorrelationRow {
        between,
        a,
        b,
        pearson: c.pearson,
        spearman: c.spearman,
        materials: c.pairs,
    };
    let mut rows = Vec::new();
    let matrix = CorrelationMatrix::new(QUANTITIES.map(|(name, of)| (name, column(0, of))));
    for (i, a) in matrix.names().iter().enumerate() {
        for (j, b) in matrix.names().iter().enumerate().skip(i + 1) {
            rows.push(row("orders", a.clone(), b.clone(), matrix.rows()[i][j]));
        }
    }
    let is_colour = |c: &Channel| matches!(c, Channel::Red | Channel::Green | Channel::Blue);
    let colours = fits.iter().map(|f| f.channel).take(channels).enumerate();
    let colours: Vec<(usize, Channel)> = colours.filter(|(_, c)| is_colour(c)).collect();
    for (name, of) in QUANTITIES {
        for (k, &(i, a)) in colours.iter().enumerate() {
            for &(j, b) in &colours[k + 1..] {
                let c = correlate(&column(i, of), &column(j, of));
                let [a, b] = [a, b].map(|channel| format!("{name} {}", channel.name()));
                rows.push(row("channels", a, b, c));
            }
        }
    }
    rows
}
