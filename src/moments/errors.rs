//! Errors of the moments of a reconstruction.

use crate::metrics::{Judged, Quantity};

use super::component::{Component, Estimate, Moments, Order};
use super::mesh::nodes;
use super::noise::Sums;
use super::profile::Profile;
use super::slice::{Batch, Slice};
use super::tally::Tally;
use crate::geometry::DirectionPair;
use crate::parametrization::view_centered;

/// Moment errors of a reconstruction: means over the views of one of the [`VIEW_BANDS`] of the largest error of the components
/// of each order. A view where the truth or the reconstruction leaves a moment undefined is left
/// out of that mean; `None` if that leaves none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MomentErrors {
    /// |α_g − α_f| / α_f.
    pub energy: Option<f64>,
    /// |µ_g − µ_f|, degrees.
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

/// Ranges of the view elevation that errors of moments are averaged over, degrees, the upper end inside, as is 0: all views,
/// and three bands. Views beyond 85° are in none of the three.
pub const VIEW_BANDS: [[f64; 2]; 4] = [[0.0, 90.0], [0.0, 40.0], [40.0, 70.0], [70.0, 85.0]];

/// Degrees by which rounding may move a view across the end of a band.
const AT_END: f64 = 1e-9;

/// The columns of the errors over a band, whose names end in `$of`; `$views` names its views in their summaries.
macro_rules! in_band {
    ($of:literal, $views:literal) => {
        [
            in_band!("moment_energy", $of, "of the relative error of the energy of slices", $views, energy),
            in_band!("moment_mean_deg", $of,
                "of the error of the mean direction of slices, the larger of both angles, in degrees", $views, mean),
            in_band!("moment_mean", $of, "of the same, each angle relative to its sigma", $views, mean_relative),
            in_band!("moment_covariance", $of, "of the largest error of a covariance relative to sigma²", $views, covariance),
            in_band!("moment_skewness", $of, "of the largest error of a co-skewness", $views, skewness),
            in_band!("moment_kurtosis", $of, "of the largest error of an excess co-kurtosis", $views, kurtosis),
        ]
    };
    ($name:literal, $of:literal, $summary:literal, $views:literal, $field:ident) => {
        (
            Quantity::real(concat!($name, $of), concat!("mean over ", $views, " ", $summary)),
            |of| of.$field,
        )
    };
}

impl MomentErrors {
    /// Number of errors over each band.
    pub(crate) const COUNT: usize = 6;

    /// Every error, in the order of columns, with its field, for each of the [`VIEW_BANDS`].
    pub const QUANTITIES: [[Judged<MomentErrors>; Self::COUNT]; VIEW_BANDS.len()] = [
        in_band!(
            "",
            "the views (these, with quantities = [\"moments\"], are the same for every measure)"
        ),
        in_band!("_0_40", "the views up to 40°"),
        in_band!("_40_70", "the views above 40° up to 70°"),
        in_band!("_70_85", "the views above 70° up to 85°"),
    ];

    /// Levels of the errors, in the order of [`QUANTITIES`](Self::QUANTITIES): 1 % of the energy, 1° of the mean direction, 5 % of
    /// the covariance, 0.1 of a skewness and 0.2 of a kurtosis. The mean in units of the width of the lobe has none of its own.
    pub const LEVELS: [Option<f64>; Self::COUNT] = [
        Some(0.01),
        Some(1.0),
        None,
        Some(0.05),
        Some(0.1),
        Some(0.2),
    ];

    /// Number of slices of truth and reconstruction that are not resolved.
    pub(crate) const UNRESOLVED: Quantity = Quantity::count(
        "moment_unresolved",
        "slices of the truth whose moments missed the estimator's tolerance, and of the reconstruction whose moments missed that and a fifth of their error",
    );

    /// Compares two profiles of the same views, over each of the [`VIEW_BANDS`]; `truth` is f.
    ///
    /// # Panics
    /// If they have different views.
    pub fn between(truth: &Profile, reconstruction: &Profile) -> [Self; VIEW_BANDS.len()] {
        assert_eq!(truth.views, reconstruction.views);
        VIEW_BANDS.map(|[from, to]| {
            let is_in = |view: f64| {
                let view = view.to_degrees();
                (from == 0.0 || view > from + AT_END) && view <= to + AT_END
            };
            Self::over(truth, reconstruction, is_in)
        })
    }

    /// What small errors of f at pairs of a slice shift an error of [`QUANTITIES`](Self::QUANTITIES) by, `of` its position: for each
    /// component of its order a sum Σ w f, in the unit of the error. `None` of a slice whose moments of that order are not defined, or whose
    /// energy is `least` or less.
    pub(crate) fn influences(slice: &Slice<'_>, of: usize, least: f64) -> Option<Influences> {
        let nodes = nodes(slice);
        let moments = at_nodes(slice, &nodes);
        let alpha = moments.energy().filter(|alpha| *alpha > least)?;
        let Sums { pairs, mut weights } = Sums::new(slice, &moments, alpha, &nodes);
        let order = [0, 1, 1, 2, 3, 4][of];
        let mut all = Vec::new();
        for c in Component::ALL.into_iter().filter(|c| c.order() == order) {
            let unit = match of {
                0 => alpha,
                1 => 1_f64.to_radians(),
                2 | 3 => moments.unit(c)?,
                _ => moments.value(c.n, c.m).map(|_| 1.0)?,
            };
            let mut sum = std::mem::take(&mut weights[c.index()]);
            sum.iter_mut().for_each(|w| *w /= unit);
            all.extend(sum.iter().any(|w| *w != 0.0).then_some(sum));
        }
        Some(Influences {
            pairs,
            weights: all,
        })
    }

    /// Compares two profiles over some of their views.
    fn over(truth: &Profile, reconstruction: &Profile, is_in: impl Fn(f64) -> bool) -> Self {
        let mean = |of: fn(&Moments, &Moments) -> Option<f64>| {
            let pairs = truth.slices.iter().zip(&reconstruction.slices);
            let pairs = pairs.zip(&truth.views).filter(|(_, view)| is_in(**view));
            let errors = pairs.filter_map(|((f, g), _)| of(&f.moments, &g.moments));
            let (sum, n) = errors.fold((0.0, 0), |(sum, n), e| (sum + e, n + 1));
            (n > 0).then(|| sum / f64::from(n))
        };
        Self {
            energy: mean(|f, g| {
                let alpha = f.energy()?;
                (alpha > 0.0).then_some((g.energy()? - alpha).abs() / alpha)
            }),
            mean: mean(|f, g| largest(f, g, 1, |_| Some(1_f64.to_radians()))),
            mean_relative: mean(|f, g| largest(f, g, 1, |c| f.unit(c))),
            covariance: mean(|f, g| largest(f, g, 2, |c| f.unit(c))),
            skewness: mean(|f, g| largest(f, g, 3, |_| Some(1.0))),
            kurtosis: mean(|f, g| largest(f, g, 4, |_| Some(1.0))),
        }
    }
}

/// Sums Σ w f over pairs of a slice, a list of weights for each.
pub(crate) struct Influences {
    pub pairs: Vec<DirectionPair>,
    pub weights: Vec<Vec<f64>>,
}

/// The moments of a slice by its nodes alone; where the BRDF is mirrored those at φ ≥ 0 are given.
fn at_nodes(slice: &Slice<'_>, nodes: &[([f64; 2], f64)]) -> Moments {
    let mut batch = Batch::default();
    for (point, _) in nodes {
        batch.push(slice, view_centered(point[0], point[1]));
    }
    slice.evaluate(&mut batch);
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for ((point, area), value) in nodes.iter().zip(batch.values()) {
        points.push(*point);
        weights.push(area * value);
        if slice.is_mirrored() {
            points.push([point[0], -point[1]]);
            weights.push(area * value);
        }
    }
    let values = Tally::from_points(Order::MAX, &points, &weights).values();
    Moments(values.map(|value| {
        value.map(|value| Estimate {
            value,
            uncertainty: 0.0,
        })
    }))
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
