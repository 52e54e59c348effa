//! The diagrams of a moment experiment, after the figures of Zubiaga et al. 2015, and those of relations.

use super::relations::{FORMS, Moment, degrees_text};
use super::tables::{energy_errors, mean_errors, variance_errors};
use crate::error::count;
use crate::experiment::moments::{Group, MaterialProfiles, ProfileFits, degrees};
use crate::experiment::relations::RelationRow;
use crate::moments::relations::{Along, AngleMoments, Relation};
use crate::moments::{Channel, Component, FitErrors, Profile, SliceMoments};
use crate::numeric::extent;
use crate::report::grouped;
use crate::report::svg::plot::{Axis, Mark, Panel, Point, Series};
use std::f64::consts::PI;

/// Diagrams on one sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// File name without extension.
    pub name: String,
    /// Title above the diagrams, and below it notes in lines of their own: what is not drawn, as it vanishes.
    pub title: String,
    /// The diagrams, row by row.
    pub panels: Vec<Panel>,
    /// Number of diagrams in a row.
    pub columns: usize,
}

/// The components that do not vanish by symmetry (Fig. 4), or those that do (`odd`; Fig. 5).
fn components(odd: bool) -> Vec<Component> {
    let all = Component::ALL.into_iter();
    all.filter(|c| c.is_odd() == odd).collect()
}

/// Name of a component, and its unit in brackets.
pub(super) fn name_and_unit(Component { n, m }: Component) -> (String, &'static str) {
    match n + m {
        0 => ("energy".into(), " (rad²/sr)"),
        1 => (format!("mean {n}{m}"), " (°)"),
        2 => (format!("covariance {n}{m}"), " (rad²)"),
        3 => (format!("skewness {n}{m}"), ""),
        _ => (format!("excess kurtosis {n}{m}"), ""),
    }
}

/// The sheet of one material: a diagram per component, a colour per channel. `bilateral`: the material
/// is the same in a mirror.
pub fn material_sheet(of: &MaterialProfiles, bilateral: bool) -> Sheet {
    let curves: Vec<_> = match &of.profiles[..] {
        [profile] => vec![Curve::new(profile, "", 0)],
        several => several.iter().map(Curve::of_channel).collect(),
    };
    let all = [false, true].map(components).concat();
    let title = format!("Moments of {} over the view elevation", of.material);
    let (mut sheet, notes) = sheet(of.material.clone(), title, &curves, &all, bilateral);
    sheet.title += &notes;
    sheet.panels.extend(super::maps::panels(of));
    sheet
}

/// The sheets of a group; without one of moments odd in φ if all of these vanish. `bilateral`: all of its materials are
/// the same in a mirror.
pub fn group_sheets(group: &Group, members: &[&MaterialProfiles], bilateral: bool) -> Vec<Sheet> {
    let with_profile = members.iter().filter(|m| !m.profiles.is_empty());
    let curves = with_profile.enumerate().map(|(color, of)| {
        let profile = &of.profiles[0];
        Curve::new(profile, &of.material, color)
    });
    let curves: Vec<_> = curves.collect();
    let name = |stem: &str| format!("{}-{stem}", group.name);
    let of = format!("{}, {}", group.name, count(members.len(), "material"));
    let over_views = |stem: &str, title: &str, odd: bool| {
        let title = format!("{title}: {of}");
        sheet(name(stem), title, &curves, &components(odd), bilateral)
    };
    let (mut profiles, notes) = over_views("profiles", "Moment profiles", false);
    profiles.title += &notes;
    let (mut odd, notes) = over_views("near-zero", "Profiles of moments odd in φ", true);
    let correlation = Sheet {
        name: name("correlation"),
        title: format!("Mean slope and average variance: {of}"),
        panels: vec![relation_panel(group)],
        columns: 1,
    };
    let mut sheets = Vec::new();
    if odd.panels.is_empty() {
        profiles.title += &notes;
        sheets.push(profiles);
    } else {
        odd.title += &notes;
        sheets.extend([profiles, odd]);
    }
    sheets.extend([fits_sheet(group, &curves, name("fits"), &of), correlation]);
    sheets.extend(members.iter().filter_map(|of| {
        let panels = super::maps::panels(of);
        let stem = crate::report::file_stem(&of.material);
        (!panels.is_empty()).then(|| Sheet {
            name: name(&format!("azimuths-{stem}")),
            title: format!("Moments of {} over the directions of views", of.material),
            panels,
            columns: 2,
        })
    }));
    sheets
}

/// A profile and how it is drawn.
struct Curve<'a> {
    profile: &'a Profile,
    name: &'a str,
    color: usize,
    mark: Mark,
}

impl<'a> Curve<'a> {
    fn new(profile: &'a Profile, name: &'a str, color: usize) -> Self {
        Self {
            profile,
            name,
            color,
            mark: Mark::Line,
        }
    }

    /// One of several channels: in its colour where it has one, and green dashed, for eyes that cannot separate
    /// it from red.
    fn of_channel(profile: &'a Profile) -> Self {
        let color = match profile.channel {
            Channel::Luminance | Channel::Average => 6,
            Channel::Red => 1,
            Channel::Green => 2,
            Channel::Blue => 0,
        };
        let mut curve = Self::new(profile, profile.channel.name(), color);
        if profile.channel == Channel::Green {
            curve.mark = Mark::Dashed;
        }
        curve
    }

    /// A component over the views with its uncertainty; angles in degrees.
    fn points(&self, component: Component) -> Vec<(f64, Option<[f64; 2]>)> {
        let unit = match component.order() {
            1 => 1f64.to_degrees(),
            _ => 1.0,
        };
        let point = |(theta_o, slice): (&f64, &SliceMoments)| {
            let found = slice.moments.get(component);
            let found = found.map(|e| [e.value, e.uncertainty].map(|v| v * unit));
            (degrees(*theta_o), found)
        };
        let views = self.profile.views.iter();
        views.zip(&self.profile.slices).map(point).collect()
    }
}

/// Why a component has no diagram, and its largest absolute value.
type Vanished = (&'static str, f64);

/// A diagram for each component of `list` that was asked for and does not vanish, with bands of the uncertainty where
/// one is wide enough to be seen; and notes on the others, a line for each reason.
fn sheet(
    name: String,
    title: String,
    curves: &[Curve<'_>],
    list: &[Component],
    bilateral: bool,
) -> (Sheet, String) {
    let order = curves.iter().map(|c| c.profile.order.get()).max();
    let mut panels: Vec<Panel> = Vec::new();
    let mut vanished = Vec::new();
    for component in list.iter().filter(|c| Some(c.order()) <= order) {
        match panel(curves, *component, bilateral) {
            Ok(panel) => panels.push(panel),
            Err((why, size)) => vanished.push((why, (name_and_unit(*component).0, size))),
        }
    }
    let mut notes = String::new();
    for (why, all) in grouped(vanished) {
        let (names, sizes): (Vec<String>, Vec<f64>) = all.into_iter().unzip();
        let computed = match sizes.into_iter().fold(0.0, f64::max) {
            0.0 => String::new(),
            largest => format!(" (computed: at most {largest:.0e})"),
        };
        notes += &format!("\n{why}: {}{computed}", names.join(", "));
    }
    let is_band = |s: &Series| s.mark == Mark::Area;
    let said = match panels.iter().flat_map(|p| &p.series).any(is_band) {
        true => "bands: uncertainty",
        false => "uncertainties are within the lines",
    };
    let sheet = Sheet {
        name,
        title: format!("{title} ({said})"),
        panels,
        columns: 3,
    };
    (sheet, notes)
}

/// A component of all curves over the views. Where the light is mirrored in the plane of incidence one that is
/// odd in φ is 0, if what is computed does not deny it.
fn panel(curves: &[Curve<'_>], component: Component, bilateral: bool) -> Result<Panel, Vanished> {
    /// Bands that reach less far from their curve, over the height of the diagram, are within its line.
    const SEEN: f64 = 0.004;
    /// What is 0 by no symmetry, and below this everywhere, is 0 as far as one can see.
    const NOISE: f64 = 0.05;
    let (name, unit) = name_and_unit(component);
    let all: Vec<_> = curves.iter().map(|c| c.points(component)).collect();
    let found = || all.iter().flatten().filter_map(|(_, found)| *found);
    let largest = found().fold(0.0, |most: f64, [v, _]| most.max(v.abs()));
    // Random estimates are further off than one of their uncertainties now and then.
    let no_more = found().all(|[v, u]| v.abs() <= (5.0 * u).max(1e-9));
    // An energy or a covariance may be as small as its lobe is narrow.
    let may_vanish = !matches!(component.order(), 0 | 2);
    let why = if found().next().is_none() {
        Some("without data")
    } else if no_more && bilateral && component.is_odd() {
        Some("0 by symmetry")
    } else if no_more && may_vanish && largest < NOISE {
        Some("0 within the uncertainty")
    } else {
        None
    };
    if let Some(why) = why {
        return Err((why, largest));
    }
    let ends = extent(found().map(|[v, _]| v)).unwrap_or_default();
    // A constant stands in the middle of an axis of its own size.
    let height = match ends[1] - ends[0] {
        height if height > 1e-4 * largest => height,
        _ => 0.2 * largest,
    };
    let mut series = Vec::new();
    for (curve, points) in curves.iter().zip(&all) {
        let known = points.iter().filter_map(|(x, found)| Some((*x, (*found)?)));
        let known: Vec<(f64, [f64; 2])> = known.collect();
        if known.iter().any(|(_, [_, u])| *u > SEEN * height) {
            // A slice that is not resolved does not shrink the diagram of the others.
            let [lo, hi] = [ends[0] - 0.5 * height, ends[1] + 0.5 * height];
            let edge = |sign: f64| {
                move |&(x, [v, u]): &(f64, [f64; 2])| (x, Some((v + sign * u).clamp(lo, hi)))
            };
            let there = known.iter().map(edge(1.0));
            let back = known.iter().rev().map(edge(-1.0));
            series.push(Series::new("", curve.color, Mark::Area, there.chain(back)));
        }
        let points = points.iter().map(|(x, found)| (*x, found.map(|[v, _]| v)));
        series.push(Series::new(curve.name, curve.color, curve.mark, points));
    }
    Ok(over_views("", &format!("{name}{unit}"), series))
}

/// Computed and fitted values and errors (Fig. 6): energy, mean, average variance.
fn fits_sheet(group: &Group, curves: &[Curve<'_>], name: String, of: &str) -> Sheet {
    let fits: Vec<&ProfileFits> = group.first_channel().collect();
    let is_fitted = |theta: f64| fits.is_empty() || fits.iter().any(|f| f.range.contains(theta));
    // At the views that are fitted: beyond them profiles rise far above.
    let computed = |label: &str, value: &dyn Fn(&Profile, usize) -> Option<f64>| {
        let series = curves.iter().map(|c| {
            let views = c.profile.views.iter().enumerate();
            let views = views.filter(|(_, theta)| is_fitted(**theta));
            let points = views.map(|(v, theta)| (degrees(*theta), value(c.profile, v)));
            Series::new(c.name, c.color, Mark::Line, points)
        });
        over_views("computed", label, series)
    };
    let fitted = |label: &str, value: &dyn Fn(&ProfileFits, f64) -> Option<f64>| {
        let series = fits.iter().zip(curves).map(|(f, c)| {
            let views = c.profile.views.iter().filter(|v| f.range.contains(**v));
            let points = views.map(|&v| (degrees(v), value(f, v)));
            Series::new(c.name, c.color, Mark::Line, points)
        });
        over_views("fitted", label, series)
    };
    let errors = |label: &str, of: fn(&ProfileFits) -> Option<FitErrors>| {
        // From the best to the worst, as the figure of the paper.
        let found = fits.iter().filter_map(|f| of(f));
        let mut pairs: Vec<[f64; 2]> = found.map(|e| [e.mae, e.rmse]).collect();
        pairs.sort_by(|a, b| a[1].total_cmp(&b[1]));
        // Distinguished by their marks, in black or the last of many colours: the others belong to materials.
        let color = curves.len().max(6);
        let series = |(name, mark, which): (&str, Mark, usize)| {
            let values = pairs.iter().map(|pair| pair[which]).enumerate();
            let points = values.map(|(i, value)| ((i + 1) as f64, Some(value)));
            Series::new(name, color, mark, points)
        };
        let both = [("MAE", Mark::Line, 0), ("RMSE", Mark::Dashed, 1)].map(series);
        let axes = ["material, by RMSE", label].map(Axis::linear);
        Panel::new("errors of the fit", axes, both)
    };
    let energy = |p: &Profile, v: usize| p.slices[v].moments.energy();
    let mean = |p: &Profile, v: usize| Some(p.slices[v].moments.mean()?[0].to_degrees());
    let variance = |p: &Profile, v: usize| p.slices[v].moments.average_variance();
    let mut sheet = Sheet {
        name,
        title: format!("Profile fits: {of}"),
        panels: vec![
            computed("energy (rad²/sr)", &energy),
            fitted("energy (rad²/sr)", &|f, v| {
                Some(f.energy.as_ref().ok()?.value(v))
            }),
            errors("relative to the mean energy", energy_errors),
            computed("mean 10 (°)", &mean),
            fitted("mean 10 (°)", &|f, v| Some((f.slope()? * v).to_degrees())),
            errors("rad", mean_errors),
            computed("average variance (rad²)", &variance),
            fitted("average variance (rad²)", &|f, _| f.average_variance()),
            errors("rad²", variance_errors),
        ],
        columns: 3,
    };
    // One scale a row, but for the errors at its end.
    for row in sheet.panels.chunks_mut(3) {
        let series = row[..2].iter().flat_map(|p| &p.series);
        let values = series.flat_map(|s| &s.points).filter_map(|p| p.1);
        if let Some([lo, hi]) = extent(values).filter(|[lo, hi]| hi > lo) {
            let room = 0.04 * (hi - lo);
            for panel in &mut row[..2] {
                panel.y.range = Some([lo - room, hi + room]);
            }
        }
    }
    sheet
}

/// Average variance over mean slope, with the fitted quadratic (Fig. 7b).
fn relation_panel(group: &Group) -> Panel {
    let fits = group.first_channel();
    let materials = fits.filter_map(|f| Some((f.slope()?, f.average_variance())));
    let mut series = vec![Series::new("materials", 0, Mark::Points, materials)];
    if let Ok(fit) = &group.relation {
        let slopes = (0..=100).map(|i| f64::from(i) / 100.0 - 1.0);
        let curve = slopes.map(|slope| (slope, Some(fit.value(slope))));
        let name = "quadratic through mirror and Lambertian";
        series.push(Series::new(name, 1, Mark::Line, curve));
    }
    let ends = [(-1.0, Some(0.0)), (0.0, Some(PI * PI / 12.0))];
    series.push(Series::new("mirror, Lambertian", 2, Mark::Points, ends));
    let axes = ["slope of the mean", "average variance (rad²)"].map(Axis::linear);
    Panel::new("", axes, series)
}

fn over_views(
    title: impl Into<String>,
    label: &str,
    series: impl IntoIterator<Item = Series>,
) -> Panel {
    let view = Axis::linear("θ_o (°)").within([0.0, 90.0]);
    Panel::new(title, [view, Axis::linear(label)], series)
}

/// One sheet per material, lighting and window: rendered and predicted moments over the view, but for those that vanish.
pub fn relation_sheets(rows: &[RelationRow]) -> Vec<Sheet> {
    let mut sheets: Vec<Sheet> = Vec::new();
    let same = |a: &RelationRow, b: &RelationRow| {
        a.material == b.material
            && a.lighting == b.lighting
            && a.relation.window == b.relation.window
    };
    let is_one = rows
        .iter()
        .all(|r| r.relation.window == rows[0].relation.window);
    for rows in rows.chunk_by(same) {
        let window = degrees_text(rows[0].relation.window);
        let (material, lighting) = (&rows[0].material, &rows[0].lighting);
        let mut title =
            format!("Moments of radiance: {material} under {lighting}, window {window}°");
        let mut panels = Vec::new();
        for rows in rows.chunk_by(|a, b| a.relation.along == b.relation.along) {
            for panel in rendered_over_views(rows) {
                match vanishing(&panel) {
                    Some(largest) => {
                        let of = format!("{} {}", panel.y.label, panel.title);
                        title += &format!("\n0: {of} (computed: at most {largest:.0e})");
                    }
                    None => panels.push(panel),
                }
            }
        }
        sheets.push(Sheet {
            name: match is_one {
                true => format!("{material}-{lighting}"),
                false => format!("{material}-{lighting}-{window}deg"),
            },
            title,
            panels,
            columns: 3,
        });
    }
    sheets
}

/// The largest absolute value of a diagram that shows rounding alone: light in the plane of incidence has its mean there.
fn vanishing(panel: &Panel) -> Option<f64> {
    let points = panel.series.iter().flat_map(|s| &s.points);
    let sizes = points.filter_map(|p| p.1).map(f64::abs);
    sizes.reduce(f64::max).filter(|largest| *largest < 1e-9)
}

/// Places of the forms in the colour cycle: no green beside red.
const COLORS: [usize; 4] = [1, 6, 3, 2];

fn rendered_over_views(rows: &[RelationRow]) -> Vec<Panel> {
    let moments: [Moment; 3] = [
        ("energy", |m| Some(m.energy)),
        ("mean (°)", |m| Some(m.mean.to_degrees())),
        // Of a form that can be negative it has none.
        ("standard deviation (°)", |m| {
            Some(m.variance.max(0.0).sqrt().to_degrees())
        }),
    ];
    let panel = |(label, value): Moment| {
        let points = |of: &dyn Fn(&Relation) -> Option<AngleMoments>| -> Vec<Point> {
            let all = rows.iter().map(|row| &row.relation);
            all.map(|r| (degrees(r.theta_o), of(r).as_ref().and_then(value)))
                .collect()
        };
        let rendered = points(&|r| r.rendered);
        let mut series = vec![Series::new("rendered", 0, Mark::Line, rendered)];
        for ((name, form), color) in FORMS.into_iter().zip(COLORS) {
            let points = points(&|r| Some(form(r)?.moments));
            series.push(Series::new(name, color, Mark::Dashed, points));
        }
        let title = match rows[0].relation.along {
            Along::Theta => "along θ",
            Along::Phi => "along φ",
            Along::Azimuth => "about the normal",
        };
        Panel::new(title, ["θ_o (°)", label].map(Axis::linear), series)
    };
    moments.map(panel).into()
}
