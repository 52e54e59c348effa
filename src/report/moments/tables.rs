//! Output of a moment experiment: tables for people and for programs.

use crate::experiment::moments::{
    CorrelationRow, Group, ProfileFits, PublishedNumbers, Spread, at_bound, degrees, shown,
};
use crate::moments::Component;
use crate::report::csv::Csv;
use crate::statistics;
use serde_json::{Value, json};
use std::io::{self, Write};

/// The components whose course the horizon may explain, with their column.
const HORIZON: [(Component, &str); 6] = [
    (Component { n: 1, m: 0 }, "horizon_mean_10"),
    (Component { n: 2, m: 0 }, "horizon_covariance_20"),
    (Component { n: 0, m: 2 }, "horizon_covariance_02"),
    (Component { n: 3, m: 0 }, "horizon_skewness_30"),
    (Component { n: 4, m: 0 }, "horizon_kurtosis_40"),
    (Component { n: 0, m: 4 }, "horizon_kurtosis_04"),
];

const FIT_COLUMNS: [&str; 26] = [
    "group",
    "material",
    "channel",
    "diffuse",
    "clamped_share",
    "unresolved_views",
    "energy_base",
    "ramp_height",
    "ramp_slope",
    "knot_0_deg",
    "knot_1_deg",
    "knot_0_at_bound",
    "knot_1_at_bound",
    "knots_undetermined",
    "energy_mae",
    "energy_rmse",
    "energy_relative_mae",
    "energy_relative_rmse",
    "mean_slope",
    "mean_mae",
    "mean_rmse",
    "average_variance",
    "variance_mae",
    "variance_rmse",
    "skewness_30",
    "kurtosis_40",
];

/// Writes `fits.csv`: a row per material and channel; empty where there is no value.
///
/// # Errors
/// Whatever `out` reports.
pub fn fits_csv(groups: &[Group], out: &mut impl Write) -> io::Result<()> {
    let mut csv = Csv::new(out);
    let horizon = HORIZON.map(|(_, name)| name);
    csv.row(FIT_COLUMNS.iter().chain(&horizon))?;
    for group in groups {
        for fits in &group.fits {
            csv.row(fit_fields(group, fits))?;
        }
    }
    csv.flush()
}

fn fit_fields(group: &Group, fits: &ProfileFits) -> Vec<String> {
    let number = |v: Option<f64>| v.map_or(String::new(), shown);
    let energy = fits.energy.as_ref().ok();
    let ramp = energy.and_then(|e| e.ramp());
    let knots = energy.and_then(|e| e.knots()).map(|k| k.map(degrees));
    let undetermined = match &fits.energy {
        Err(e) => e.to_string(),
        Ok(fit) => fit.undetermined().map_or(String::new(), |u| u.to_string()),
    };
    let bounds = |i: usize| match energy.filter(|e| e.knots().is_some()) {
        Some(fit) => at_bound(fit, fits.range)[i].to_string(),
        None => String::new(),
    };
    let mean = fits.mean.as_ref().ok();
    let variance = fits.variance.as_ref().ok();
    let average = |n, m| number(fits.averages[Component { n, m }.index()]);
    let mut fields = vec![
        group.name.clone(),
        fits.material.clone(),
        fits.channel.name().into(),
        shown(fits.diffuse),
        shown(fits.clamped_share),
        fits.unresolved.to_string(),
        number(energy.map(|e| e.base())),
        number(ramp.map(|r| r.height)),
        number(ramp.map(|r| r.slope)),
        number(knots.map(|k| k[0])),
        number(knots.map(|k| k[1])),
        bounds(0),
        bounds(1),
        undetermined,
        number(energy.map(|e| e.errors().mae)),
        number(energy.map(|e| e.errors().rmse)),
        number(energy.map(|e| e.relative_errors().mae)),
        number(energy.map(|e| e.relative_errors().rmse)),
        number(mean.map(|m| m.slope())),
        number(mean.map(|m| m.errors().mae)),
        number(mean.map(|m| m.errors().rmse)),
        number(variance.map(|v| v.variance())),
        number(variance.map(|v| v.errors().mae)),
        number(variance.map(|v| v.errors().rmse)),
        average(3, 0),
        average(4, 0),
    ];
    for (component, _) in HORIZON {
        let explained = fits.clamping.as_ref();
        fields.push(number(
            explained.and_then(|c| c.explained[component.index()]),
        ));
    }
    fields
}

/// Writes `correlations.csv`.
///
/// # Errors
/// Whatever `out` reports.
pub fn correlations_csv(groups: &[Group], out: &mut impl Write) -> io::Result<()> {
    let mut csv = Csv::new(out);
    csv.row([
        "group",
        "between",
        "a",
        "b",
        "pearson",
        "spearman",
        "materials",
    ])?;
    let number = |v: Option<f64>| v.map_or(String::new(), shown);
    for group in groups {
        for row in &group.correlations {
            csv.row([
                group.name.clone(),
                row.between.into(),
                row.a.clone(),
                row.b.clone(),
                number(row.pearson),
                number(row.spearman),
                row.materials.to_string(),
            ])?;
        }
    }
    csv.flush()
}

/// Writes `summary.json`: an object per group.
///
/// # Errors
/// Whatever `out` reports.
pub fn summary_json(groups: &[Group], out: &mut impl Write) -> io::Result<()> {
    let summaries: serde_json::Map<String, Value> = groups
        .iter()
        .map(|group| (group.name.clone(), summary(group)))
        .collect();
    serde_json::to_writer_pretty(&mut *out, &summaries)?;
    out.write_all(b"\n")
}

fn summary(group: &Group) -> Value {
    let in_degrees = |spread: Option<Spread>| spread.map(|s| s.scaled(1f64.to_degrees()));
    let shared = group.shared.as_ref().ok().and_then(|s| s.knots());
    let horizon: serde_json::Map<String, Value> = HORIZON
        .iter()
        .map(|(c, name)| {
            let median = median(
                group
                    .first_channel()
                    .filter_map(|f| f.clamping.as_ref()?.explained[c.index()]),
            );
            ((*name).to_owned(), json!(median))
        })
        .collect();
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
        "explained_by_horizon_median": horizon,
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
    let mut out = String::new();
    for group in groups {
        let n = group.first_channel().count();
        let channel = group.fits.first().map_or("", |f| f.channel.name());
        let s = if n == 1 { "" } else { "s" };
        let others = published.filter(|p| p.group == group.name);
        let there = |of: fn(&PublishedNumbers) -> &String| others.map_or("", |p| of(p).as_str());
        out += &format!("\n{}: {n} material{s}, {channel}\n", group.name);
        let mut line = |what: &str, here: String, there: &str| {
            let text = if others.is_some() {
                format!("  {what:<44} {here:<43} {there}")
            } else {
                format!("  {what:<44} {here}")
            };
            out += text.trim_end();
            out += "\n";
        };
        line("", "here".into(), there(|p| &p.by));
        let spread = |spread: Option<Spread>| match spread {
            Some(s) => {
                let off = s.deviation.map(|d| format!(" ± {:.1}°", d.to_degrees()));
                let mean = s.mean.to_degrees();
                format!("{mean:.1}°{} ({})", off.unwrap_or_default(), s.materials)
            }
            None => "undetermined".into(),
        };
        let bound = |i: usize| match group.at_bounds[i] {
            0 => String::new(),
            n => format!("; at the range's end: {n}"),
        };
        line(
            "theta_0 of each material",
            spread(group.knots[0]) + &bound(0),
            there(|p| &p.theta_0),
        );
        line(
            "theta_1 of each material",
            spread(group.knots[1]) + &bound(1),
            there(|p| &p.theta_1),
        );
        let shared = match &group.shared {
            Ok(fit) => match (fit.knots(), fit.undetermined()) {
                (Some([a, b]), _) => {
                    let end = if fit.upper_at_end() {
                        ", the end of the range"
                    } else {
                        ""
                    };
                    format!("{:.1}°, {:.1}°{end}", a.to_degrees(), b.to_degrees())
                }
                (None, Some(why)) => why.to_string(),
                (None, None) => "undetermined".into(),
            },
            Err(e) => e.to_string(),
        };
        line(
            "theta_0, theta_1 shared by all",
            shared,
            there(|p| &p.theta_shared),
        );
        line(
            "energy rises from theta_0 to theta_1",
            format!("{} of {n}", group.boosted),
            there(|p| &p.energy_rises),
        );
        let range = |of: fn(&ProfileFits) -> Option<f64>| match group.spread(of) {
            Some(s) => format!("{:.3} … {:.3}", s.range[0], s.range[1]),
            None => "undefined".into(),
        };
        line(
            "slope of the mean",
            range(ProfileFits::slope),
            there(|p| &p.mean_slope),
        );
        line(
            "average variance (rad²)",
            range(ProfileFits::average_variance),
            there(|p| &p.average_variance),
        );
        let errors = |of: fn(&ProfileFits) -> Option<[f64; 2]>| {
            let mae = median(group.first_channel().filter_map(|f| Some(of(f)?[0])));
            let rmse = median(group.first_channel().filter_map(|f| Some(of(f)?[1])));
            match (mae, rmse) {
                (Some(mae), Some(rmse)) => format!("{mae:.4}, {rmse:.4}"),
                _ => "undefined".into(),
            }
        };
        line(
            "energy fit, median MAE and RMSE, relative",
            errors(|f| {
                let e = f.energy.as_ref().ok()?.relative_errors();
                Some([e.mae, e.rmse])
            }),
            there(|p| &p.energy_fit),
        );
        line(
            "mean fit, median MAE and RMSE (rad)",
            errors(|f| {
                let e = f.mean.as_ref().ok()?.errors();
                Some([e.mae, e.rmse])
            }),
            there(|p| &p.mean_fit),
        );
        line(
            "variance fit, median MAE and RMSE (rad²)",
            errors(|f| {
                let e = f.variance.as_ref().ok()?.errors();
                Some([e.mae, e.rmse])
            }),
            there(|p| &p.variance_fit),
        );
        // Of two colour channels and a quantity: the least of Pearson's coefficients of three pairs.
        let between = |quantity: &str| {
            let pairs = group
                .correlations
                .iter()
                .filter(|c| c.between == "channels" && c.a.split(' ').next() == Some(quantity));
            let least = pairs.filter_map(|c| c.pearson).min_by(f64::total_cmp);
            least.map(|r| format!("{r:.3}"))
        };
        let quantities = ["energy", "mean_slope", "average_variance"].map(between);
        if let [Some(energy), Some(slope), Some(variance)] = quantities {
            line(
                "least correlation between R, G, B",
                format!("energy {energy}, slope {slope}, variance {variance}"),
                "",
            );
        }
        let relation = match &group.relation {
            // Of one material or two the quadratic says nothing.
            _ if n < 3 => "too few materials".into(),
            Ok(fit) => {
                let r2 = fit
                    .r_squared()
                    .map_or("undefined".into(), |r| format!("{r:.3}"));
                format!("c {:.3}, R² {r2}", fit.coefficient())
            }
            Err(e) => e.to_string(),
        };
        line(
            "variance ≈ (π²/12)(1+µ) + c µ(1+µ)",
            relation,
            there(|p| &p.mean_variance),
        );
        let odd = largest_odd(group).map_or("undefined".into(), |v| format!("{v:.1e}"));
        line(
            "largest moment odd in phi, standardised",
            odd,
            there(|p| &p.odd_moments),
        );
        for row in strongest(group) {
            let what = format!("correlation of {}, {}", row.a, row.b);
            let rank = row.spearman.unwrap_or(0.0);
            line(&what, format!("{rank:.2} (rank, {})", row.materials), "");
        }
        for (component, name) in HORIZON {
            let values = group
                .first_channel()
                .filter_map(|f| f.clamping.as_ref()?.explained[component.index()]);
            let values: Vec<f64> = values.collect();
            let (most, all) = (values.iter().filter(|v| **v > 0.5).count(), values.len());
            if let Some(share) = median(values.into_iter()) {
                let what = name.replace("horizon_", "share the horizon explains of ");
                let share = format!("median {:.0} %; most for {most} of {all}", 100.0 * share);
                line(&what, share, there(|p| &p.horizon));
            }
        }
    }
    out
}
