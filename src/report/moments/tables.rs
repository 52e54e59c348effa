//! Output of a moment experiment: tables for people and for programs.

use crate::error::count;
use crate::experiment::moments::{
    CorrelationRow, Group, ProfileFits, PublishedNumbers, Spread, at_bound, degrees,
};
use crate::moments::{Component, FitErrors, Ramp};
use crate::report::in_memory;
use crate::report::schema::{Schema, columns};
use crate::statistics;
use serde_json::{Value, json};

/// The components whose course the horizon may explain.
const HORIZON: [Component; 6] = [
    Component { n: 1, m: 0 },
    Component { n: 2, m: 0 },
    Component { n: 0, m: 2 },
    Component { n: 3, m: 0 },
    Component { n: 4, m: 0 },
    Component { n: 0, m: 4 },
];

/// A fit with its group.
type Fit<'a> = (&'a Group, &'a ProfileFits);

/// `fits.csv`: a row per material and channel; empty where there is no value.
pub fn fits_csv(groups: &[Group]) -> String {
    let rows = groups
        .iter()
        .flat_map(|group| group.fits.iter().map(move |fits| (group, fits)));
    fit_schema().csv(&rows.collect::<Vec<Fit<'_>>>())
}

fn fit_schema<'a>() -> Schema<Fit<'a>> {
    let schema = columns! { (group, fits) in Fit<'a>;
        "group" => group.name.clone(),
        "material" => fits.material.clone(),
        "channel" => fits.channel.name(),
        "diffuse" => fits.diffuse,
        "clamped_share" => fits.clamped_share,
        "unresolved_views" => fits.unresolved,
        "energy_base" => fits.energy.as_ref().ok().map(|e| e.base),
        "ramp_height" => ramp(fits).map(|r| r.height),
        "ramp_slope" => ramp(fits).map(|r| r.slope),
        "knot_0_deg" => knots(fits).map(|k| degrees(k[0])),
        "knot_1_deg" => knots(fits).map(|k| degrees(k[1])),
        "knot_0_at_bound" => are_at_bound(fits).map(|are| are[0]),
        "knot_1_at_bound" => are_at_bound(fits).map(|are| are[1]),
        "knots_undetermined" => match &fits.energy {
            Err(e) => Some(e.to_string()),
            Ok(fit) => fit.undetermined.map(|why| why.to_string()),
        },
        "energy_mae" => fits.energy.as_ref().ok().map(|e| e.errors.mae),
        "energy_rmse" => fits.energy.as_ref().ok().map(|e| e.errors.rmse),
        "energy_relative_mae" => energy_errors(fits).map(|e| e.mae),
        "energy_relative_rmse" => energy_errors(fits).map(|e| e.rmse),
        "mean_slope" => fits.slope(),
        "mean_mae" => mean_errors(fits).map(|e| e.mae),
        "mean_rmse" => mean_errors(fits).map(|e| e.rmse),
        "average_variance" => fits.average_variance(),
        "variance_mae" => variance_errors(fits).map(|e| e.mae),
        "variance_rmse" => variance_errors(fits).map(|e| e.rmse),
        "skewness_30" => fits.averages[Component { n: 3, m: 0 }.index()],
        "kurtosis_40" => fits.averages[Component { n: 4, m: 0 }.index()],
    };
    let horizon = HORIZON.map(|c| {
        columns! { (_, fits) in Fit<'a>; format!("horizon_{c}") => explained(fits, c), }
    });
    horizon.into_iter().fold(schema, Schema::and)
}

fn ramp(fits: &ProfileFits) -> Option<Ramp> {
    fits.energy.as_ref().ok()?.ramp
}

fn knots(fits: &ProfileFits) -> Option<[f64; 2]> {
    fits.energy.as_ref().ok()?.knots()
}

/// Whether each knot is at an end of the views.
fn are_at_bound(fits: &ProfileFits) -> Option<[bool; 2]> {
    let energy = fits.energy.as_ref().ok().filter(|e| e.knots().is_some());
    energy.map(|fit| at_bound(fit, fits.range))
}

/// The share of a component's course that the horizon explains.
fn explained(fits: &ProfileFits, component: Component) -> Option<f64> {
    fits.clamping.as_ref()?.explained[component.index()]
}

/// `correlations.csv`: a row per group and pair of quantities.
pub fn correlations_csv(groups: &[Group]) -> String {
    let rows = groups
        .iter()
        .flat_map(|group| group.correlations.iter().map(move |row| (group, row)));
    let schema = columns! { (group, row) in (&Group, &CorrelationRow);
        "group" => group.name.clone(),
        "between" => row.between,
        "a" => row.a.clone(),
        "b" => row.b.clone(),
        "pearson" => row.pearson,
        "spearman" => row.spearman,
        "materials" => row.materials,
    };
    schema.csv(&rows.collect::<Vec<_>>())
}

/// `summary.json`: an object per group.
pub fn summary_json(groups: &[Group]) -> String {
    let summaries = groups.iter().map(|g| (g.name.clone(), summary(g)));
    let summaries = Value::Object(summaries.collect());
    in_memory(serde_json::to_string_pretty(&summaries)) + "\n"
}

fn summary(group: &Group) -> Value {
    let in_degrees = |spread: Option<Spread>| spread.map(|s| s.scaled(1f64.to_degrees()));
    let shared = group.shared.as_ref().ok().and_then(|s| s[0].knots());
    let horizon = HORIZON.map(|c| {
        let median = median(group.first_channel().filter_map(|f| explained(f, c)));
        (format!("horizon_{c}"), json!(median))
    });
    json!({
        "materials": group.first_channel().count(),
        "channel": group.fits.first().map(|f| f.channel.name()),
        "knot_0_deg": in_degrees(group.knots[0]),
        "knot_1_deg": in_degrees(group.knots[1]),
        "knots_at_bounds": group.at_bounds,
        "energy_rises": group.boosted,
        "shared_knots_deg": shared.map(|k| k.map(degrees)),
        "mean_slope": group.spread(ProfileFits::slope),
        "average_variance": group.spread(ProfileFits::average_variance),
        "variance_of_slope": group.relation.as_ref().ok(),
        "largest_odd": largest_odd(group),
        "explained_by_horizon_median": Value::from_iter(horizon),
    })
}

/// The largest component that is odd in φ, in units of σ; 0 for symmetric slices.
fn largest_odd(group: &Group) -> Option<f64> {
    let odd = Component::ALL.into_iter().filter(|c| c.is_odd());
    odd.filter_map(|c| Some(group.spread(|f| f.largest[c.index()])?.range[1]))
        .reduce(f64::max)
}

/// The three pairs of quantities of different order that vary together most, by rank; none with
/// fewer than five materials.
fn strongest(group: &Group) -> Vec<&CorrelationRow> {
    let rows = group.correlations.iter();
    let mut rows: Vec<_> = rows
        .filter(|r| r.between == "orders" && r.materials >= 5 && r.spearman.is_some())
        // Of one family they say little: kurtosis along both angles.
        .filter(|r| r.a.split('_').next() != r.b.split('_').next())
        .collect();
    let size = |r: &CorrelationRow| r.spearman.map_or(0.0, f64::abs);
    rows.sort_by(|a, b| size(b).total_cmp(&size(a)));
    rows.truncate(3);
    rows
}

/// The median; `None` of no values.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    statistics::median(&values.collect::<Vec<f64>>())
}

/// The table at the end of a run: fits and correlations of each group, beside published numbers if
/// the config has them.
pub fn study_table(groups: &[Group], published: Option<&PublishedNumbers>) -> String {
    let table = |group| group_table(group, published.filter(|p| p.group == group.name));
    groups.iter().map(table).collect()
}

fn group_table(group: &Group, published: Option<&PublishedNumbers>) -> String {
    let n = group.first_channel().count();
    let channel = group.fits.first().map_or("", |f| f.channel.name());
    let mut out = format!("\n{}: {}, {channel}\n", group.name, count(n, "material"));
    // A quantity, its value here, and the published text about it.
    macro_rules! line {
        ($what:expr => $here:expr) => {
            out += &table_line(&$what, &$here, published.map(|_| ""))
        };
        ($what:expr => $here:expr, $there:ident) => {
            out += &table_line(&$what, &$here, published.map(|p| p.$there.as_str()))
        };
    }
    let errors = |of: fn(&ProfileFits) -> Option<FitErrors>| {
        let of_all = |which: fn(FitErrors) -> f64| {
            median(group.first_channel().filter_map(|f| of(f).map(which)))
        };
        match (of_all(|e| e.mae), of_all(|e| e.rmse)) {
            (Some(mae), Some(rmse)) => format!("{mae:.4}, {rmse:.4}"),
            _ => "undefined".into(),
        }
    };
    let range = |of: fn(&ProfileFits) -> Option<f64>| match group.spread(of) {
        Some(s) => format!("{:.3} … {:.3}", s.range[0], s.range[1]),
        None => "undefined".into(),
    };
    line!("" => "here", by);
    line!("theta_0 of each material" => knot(group, 0), theta_0);
    line!("theta_1 of each material" => knot(group, 1), theta_1);
    line!("theta_0, theta_1 shared by all" => shared_knots(group), theta_shared);
    line!("energy rises from theta_0 to theta_1" => format!("{} of {n}", group.boosted), energy_rises);
    line!("slope of the mean" => range(ProfileFits::slope), mean_slope);
    line!("average variance (rad²)" => range(ProfileFits::average_variance), average_variance);
    line!("energy fit, median MAE and RMSE, relative" => errors(energy_errors), energy_fit);
    line!("mean fit, median MAE and RMSE (rad)" => errors(mean_errors), mean_fit);
    line!("variance fit, median MAE and RMSE (rad²)" => errors(variance_errors), variance_fit);
    let quantities = ["energy", "mean_slope", "average_variance"];
    if let [Some(energy), Some(slope), Some(variance)] = quantities.map(|q| between(group, q)) {
        let least = format!("energy {energy:.3}, slope {slope:.3}, variance {variance:.3}");
        line!("least correlation between R, G, B" => least);
    }
    let undefined = || "undefined".to_owned();
    let relation = match &group.relation {
        // Of one material or two the quadratic is not determined.
        _ if n < 3 => "too few materials".into(),
        Ok(fit) => {
            let r2 = fit.r_squared.map_or_else(undefined, |r| format!("{r:.3}"));
            format!("c {:.3}, R² {r2}", fit.coefficient)
        }
        Err(e) => e.to_string(),
    };
    line!("variance ≈ (π²/12)(1+µ) + c µ(1+µ)" => relation, mean_variance);
    let odd = largest_odd(group).map_or_else(undefined, |v| format!("{v:.1e}"));
    line!("largest moment odd in phi, standardised" => odd, odd_moments);
    for row in strongest(group) {
        let rank = row.spearman.unwrap_or(0.0);
        let rank = format!("{rank:.2} (rank, {})", row.materials);
        line!(format!("correlation of {}, {}", row.a, row.b) => rank);
    }
    for component in HORIZON {
        let shares = || {
            group
                .first_channel()
                .filter_map(|f| explained(f, component))
        };
        let (most, all) = (shares().filter(|v| *v > 0.5).count(), shares().count());
        if let Some(share) = median(shares()) {
            let what = format!("share the horizon explains of {component}");
            let share = format!("median {:.0} %; most for {most} of {all}", 100.0 * share);
            line!(what => share, horizon);
        }
    }
    out
}

fn table_line(what: &str, here: &str, there: Option<&str>) -> String {
    let line = match there {
        Some(there) => format!("  {what:<44} {here:<43} {there}"),
        None => format!("  {what:<44} {here}"),
    };
    line.trim_end().to_owned() + "\n"
}

/// Mean and spread of a knot of the energies, and how often it is at an end of the views.
fn knot(group: &Group, which: usize) -> String {
    let spread = match group.knots[which] {
        Some(s) => {
            let off = s.deviation.map(|d| format!(" ± {:.1}°", d.to_degrees()));
            let mean = s.mean.to_degrees();
            format!("{mean:.1}°{} ({})", off.unwrap_or_default(), s.materials)
        }
        None => "undetermined".into(),
    };
    match group.at_bounds[which] {
        0 => spread,
        n => format!("{spread}; at the range's end: {n}"),
    }
}

fn shared_knots(group: &Group) -> String {
    let fit = match &group.shared {
        Ok(fits) => &fits[0],
        Err(e) => return e.to_string(),
    };
    match (fit.knots(), fit.undetermined) {
        (Some(knots), _) => {
            let [a, b] = knots.map(f64::to_degrees);
            let end = match fit.upper_at_end {
                true => ", the end of the range",
                false => "",
            };
            format!("{a:.1}°, {b:.1}°{end}")
        }
        (None, Some(why)) => why.to_string(),
        (None, None) => "undetermined".into(),
    }
}

/// Of two colour channels and a quantity: the least of Pearson's coefficients of three pairs.
fn between(group: &Group, quantity: &str) -> Option<f64> {
    let all = group.correlations.iter();
    let of_channels = all.filter(|c| c.between == "channels");
    let pairs = of_channels.filter(|c| c.a.split(' ').next() == Some(quantity));
    pairs.filter_map(|c| c.pearson).min_by(f64::total_cmp)
}

/// Errors of the fit of energies, relative to their mean.
pub(super) fn energy_errors(fits: &ProfileFits) -> Option<FitErrors> {
    Some(fits.energy.as_ref().ok()?.relative_errors)
}

/// Errors of the fit of means, rad.
pub(super) fn mean_errors(fits: &ProfileFits) -> Option<FitErrors> {
    Some(fits.mean.as_ref().ok()?.errors)
}

/// Errors of the fit of variances, rad².
pub(super) fn variance_errors(fits: &ProfileFits) -> Option<FitErrors> {
    Some(fits.variance.as_ref().ok()?.errors)
}
