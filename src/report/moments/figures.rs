//! The diagrams of a moment experiment, after the figures of Zubiaga et al. 2015.

use crate::experiment::moments::{Group, MaterialProfiles, ProfileFits, degrees};
use crate::moments::{Channel, Component, Profile, SliceMoments};
use crate::report::svg::plot::{Axis, Mark, Panel, Series};
use std::f64::consts::PI;

/// Diagrams on one sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// File name without extension.
    pub name: String,
    /// Title above the diagrams.
    pub title: String,
    /// The diagrams, row by row.
    pub panels: Vec<Panel>,
    /// Number of diagrams in a row.
    pub columns: usize,
}

/// The components that do not vanish by symmetry, with their labels (Fig. 4).
const EVEN: [(Component, &str); 9] = [
    (Component { n: 0, m: 0 }, "energy (rad²/sr)"),
    (Component { n: 1, m: 0 }, "mean 10 (°)"),
    (Component { n: 2, m: 0 }, "covariance 20 (rad²)"),
    (Component { n: 0, m: 2 }, "covariance 02 (rad²)"),
    (Component { n: 3, m: 0 }, "skewness 30"),
    (Component { n: 1, m: 2 }, "skewness 12"),
    (Component { n: 4, m: 0 }, "excess kurtosis 40"),
    (Component { n: 2, m: 2 }, "excess kurtosis 22"),
    (Component { n: 0, m: 4 }, "excess kurtosis 04"),
];

/// The components that vanish by symmetry, with their labels (Fig. 5).
const ODD: [(Component, &str); 6] = [
    (Component { n: 0, m: 1 }, "mean 01 (°)"),
    (Component { n: 1, m: 1 }, "covariance 11 (rad²)"),
    (Component { n: 2, m: 1 }, "skewness 21"),
    (Component { n: 0, m: 3 }, "skewness 03"),
    (Component { n: 3, m: 1 }, "excess kurtosis 31"),
    (Component { n: 1, m: 3 }, "excess kurtosis 13"),
];

/// The sheet of one material: a diagram per component, a colour per channel. `bilateral`: the material
/// is the same in a mirror.
pub fn material_sheet(of: &MaterialProfiles, bilateral: bool) -> Sheet {
    let alone = of.profiles.len() == 1;
    let curve = |profile| match alone {
        true => Curve {
            profile,
            name: "",
            color: 0,
            mark: Mark::Line,
        },
        false => Curve::of_channel(profile),
    };
    let curves: Vec<_> = of.profiles.iter().map(curve).collect();
    let all: Vec<_> = EVEN.into_iter().chain(ODD).collect();
    let title = format!("Moments of {} over the view elevation", of.material);
    sheet(of.material.clone(), &title, &curves, &all, bilateral)
}

/// The sheets of a group. `bilateral`: all of its materials are the same in a mirror.
pub fn group_sheets(group: &Group, members: &[&MaterialProfiles], bilateral: bool) -> Vec<Sheet> {
    /// Most materials whose colours can be told apart, and are named.
    const NAMED: usize = 7;
    let profiles: Vec<&Profile> = members.iter().filter_map(|m| m.profiles.first()).collect();
    let first = members
        .iter()
        .filter_map(|m| Some((m, m.profiles.first()?)));
    let curves = first.enumerate().map(|(color, (of, profile))| Curve {
        profile,
        name: if members.len() > NAMED {
            ""
        } else {
            &of.material
        },
        color,
        mark: Mark::Line,
    });
    let curves: Vec<_> = curves.collect();
    let name = |stem: &str| format!("{}-{stem}", group.name);
    let s = if members.len() == 1 { "" } else { "s" };
    let of = format!("{}, {} material{s}", group.name, members.len());
    let over_views = |stem: &str, title: &str, list: &[(Component, &str)]| {
        let title = format!("{title}: {of}");
        sheet(name(stem), &title, &curves, list, bilateral)
    };
    let mut sheets = vec![
        over_views("profiles", "Moment profiles", &EVEN),
        over_views("near-zero", "Profiles of moments odd in φ", &ODD),
        fits_sheet(group, &profiles, name("fits"), &of),
    ];
    sheets.push(Sheet {
        name: name("correlation"),
        title: format!("Mean slope and average variance: {of}"),
        panels: vec![relation_panel(group)],
        columns: 1,
    });
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
    /// One of several channels: in its colour where it has one, and green dashed, as not everybody can tell
    /// it from red.
    fn of_channel(profile: &'a Profile) -> Self {
        let (color, mark) = match profile.channel {
            Channel::Luminance | Channel::Average => (6, Mark::Line),
            Channel::Red => (1, Mark::Line),
            Channel::Green => (2, Mark::Dashed),
            Channel::Blue => (0, Mark::Line),
        };
        let name = profile.channel.name();
        Self {
            profile,
            name,
            color,
            mark,
        }
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
        self.profile
            .views
            .iter()
            .zip(&self.profile.slices)
            .map(point)
            .collect()
    }
}

/// A diagram for each component of `list` that was asked for, with bands of the uncertainty where one is
/// wide enough to be seen.
fn sheet(
    name: String,
    title: &str,
    curves: &[Curve<'_>],
    list: &[(Component, &str)],
    bilateral: bool,
) -> Sheet {
    let order = curves.iter().map(|c| c.profile.order.get()).max();
    let asked = list.iter().filter(|(c, _)| Some(c.order()) <= order);
    let panels: Vec<Panel> = asked
        .map(|(component, label)| Panel {
            y: axis(label),
            ..panel(curves, *component, bilateral)
        })
        .collect();
    let is_band = |s: &Series| s.mark == Mark::Area;
    let said = match panels.iter().flat_map(|p| &p.series).any(is_band) {
        true => "bands: uncertainty",
        false => "uncertainties are within the lines",
    };
    Sheet {
        name,
        title: format!("{title} ({said})"),
        panels,
        columns: 3,
    }
}

/// A component of all curves over the views. Where the light is mirrored in the plane of incidence one that is
/// odd in φ is 0, if what is computed does not deny it.
fn panel(curves: &[Curve<'_>], component: Component, bilateral: bool) -> Panel {
    /// Bands that reach less far from their curve, over the height of the diagram, are within its line.
    const SEEN: f64 = 0.004;
    /// Values below this say nothing of what is to be 0; larger ones are noise that is worth a look.
    const NOISE: f64 = 0.05;
    const ZERO: &str = "0 by symmetry";
    let all: Vec<_> = curves.iter().map(|c| c.points(component)).collect();
    let found = || all.iter().flatten().filter_map(|(_, found)| *found);
    let largest = found().fold(0.0, |most: f64, [v, _]| most.max(v.abs()));
    // Random estimates are further off than one of their uncertainties now and then.
    let no_more = found().all(|[v, u]| v.abs() <= (5.0 * u).max(1e-9));
    let zero = bilateral && component.is_odd() && no_more;
    if zero && largest < NOISE {
        let line = Series {
            color: curves.first().map_or(0, |c| c.color),
            points: [0.0, 90.0].map(|x| (x, Some(0.0))).into(),
            ..Series::default()
        };
        return Panel {
            title: format!("{ZERO} (computed: at most {largest:.0e})"),
            ..over_views(std::iter::once(line))
        };
    }
    let ends = found().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], [v, _]| {
        [lo.min(v), hi.max(v)]
    });
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
            series.push(Series {
                color: curve.color,
                mark: Mark::Area,
                points: there.chain(back).collect(),
                ..Series::default()
            });
        }
        series.push(Series {
            name: curve.name.into(),
            color: curve.color,
            mark: curve.mark,
            points: points
                .iter()
                .map(|(x, found)| (*x, found.map(|[v, _]| v)))
                .collect(),
        });
    }
    Panel {
        title: if zero { ZERO.into() } else { String::new() },
        ..over_views(series.into_iter())
    }
}

/// Computed and fitted values and errors (Fig. 6): energy, mean, average variance.
fn fits_sheet(group: &Group, profiles: &[&Profile], name: String, of: &str) -> Sheet {
    let fits: Vec<&ProfileFits> = group.first_channel().collect();
    let computed = |label: &str, value: &dyn Fn(&Profile, usize) -> Option<f64>| Panel {
        title: "computed".into(),
        y: axis(label),
        ..over_views(profiles.iter().enumerate().map(|(i, p)| {
            Series {
                color: i,
                points: (0..p.views.len())
                    .map(|v| (degrees(p.views[v]), value(p, v)))
                    .collect(),
                ..Series::default()
            }
        }))
    };
    let fitted = |label: &str, value: &dyn Fn(&ProfileFits, f64) -> Option<f64>| Panel {
        title: "fitted".into(),
        y: axis(label),
        ..over_views(fits.iter().zip(profiles).enumerate().map(|(i, (f, p))| {
            Series {
                color: i,
                points: p
                    .views
                    .iter()
                    .filter(|v| f.range.contains(**v))
                    .map(|&v| (degrees(v), value(f, v)))
                    .collect(),
                ..Series::default()
            }
        }))
    };
    let errors = |label: &str, of: &dyn Fn(&ProfileFits) -> Option<[f64; 2]>| {
        // From the best to the worst, as the figure of the paper.
        let mut pairs: Vec<[f64; 2]> = fits.iter().filter_map(|f| of(f)).collect();
        pairs.sort_by(|a, b| a[1].total_cmp(&b[1]));
        // Told apart by their marks: colours belong to the materials of the other panels.
        let series = |name: &str, mark: Mark, which: usize| Series {
            name: name.into(),
            color: 0,
            mark,
            points: pairs
                .iter()
                .enumerate()
                .map(|(i, pair)| ((i + 1) as f64, Some(pair[which])))
                .collect(),
        };
        Panel {
            title: "errors of the fit".into(),
            x: axis("material, by RMSE"),
            y: axis(label),
            series: vec![
                series("MAE", Mark::Line, 0),
                series("RMSE", Mark::Dashed, 1),
            ],
        }
    };
    // One scale a row, that of the fitted views: beyond them profiles may leave it.
    let ranges = [0, 3, 6];
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
            errors("relative to the mean energy", &|f| {
                let e = f.energy.as_ref().ok()?.relative_errors();
                Some([e.mae, e.rmse])
            }),
            computed("mean 10 (°)", &mean),
            fitted("mean 10 (°)", &|f, v| {
                Some(f.mean.as_ref().ok()?.value(v).to_degrees())
            }),
            errors("rad", &|f| {
                let e = f.mean.as_ref().ok()?.errors();
                Some([e.mae, e.rmse])
            }),
            computed("average variance (rad²)", &variance),
            fitted("average variance (rad²)", &|f, v| {
                Some(f.variance.as_ref().ok()?.value(v))
            }),
            errors("rad²", &|f| {
                let e = f.variance.as_ref().ok()?.errors();
                Some([e.mae, e.rmse])
            }),
        ],
        columns: 3,
    };
    let inside = |x: f64| fits.iter().any(|f| f.range.contains(x.to_radians()));
    for row in ranges {
        let points = sheet.panels[row..row + 2].iter().flat_map(|p| &p.series);
        let points = points.flat_map(|s| &s.points);
        let values = points.filter_map(|(x, y)| y.filter(|_| inside(*x)));
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), y| {
            (lo.min(y), hi.max(y))
        });
        if hi > lo {
            let room = 0.04 * (hi - lo);
            for panel in &mut sheet.panels[row..row + 2] {
                panel.y.range = Some([lo - room, hi + room]);
            }
        }
    }
    sheet
}

/// Average variance over mean slope, with the fitted quadratic (Fig. 7b).
fn relation_panel(group: &Group) -> Panel {
    let mut series = vec![Series {
        name: "materials".into(),
        color: 0,
        mark: Mark::Points,
        points: group
            .first_channel()
            .filter_map(|f| Some((f.slope()?, f.average_variance())))
            .collect(),
    }];
    if let Ok(fit) = &group.relation {
        let slope = |i: i32| f64::from(i) / 100.0 - 1.0;
        series.push(Series {
            name: "quadratic through mirror and Lambertian".into(),
            color: 1,
            mark: Mark::Line,
            points: (0..=100)
                .map(|i| (slope(i), Some(fit.value(slope(i)))))
                .collect(),
        });
    }
    series.push(Series {
        name: "mirror, Lambertian".into(),
        color: 2,
        mark: Mark::Points,
        points: vec![(-1.0, Some(0.0)), (0.0, Some(PI * PI / 12.0))],
    });
    Panel {
        title: String::new(),
        x: axis("slope of the mean"),
        y: axis("average variance (rad²)"),
        series,
    }
}

fn over_views(series: impl Iterator<Item = Series>) -> Panel {
    Panel {
        x: Axis {
            range: Some([0.0, 90.0]),
            ..axis("θ_o (°)")
        },
        series: series.collect(),
        ..Panel::default()
    }
}

fn axis(label: &str) -> Axis {
    Axis {
        label: label.into(),
        ..Axis::default()
    }
}
