//! The diagrams of a moment experiment, after the figures of Zubiaga et al. 2015.

use crate::experiment::moments::{Group, MaterialProfiles, ProfileFits, degrees};
use crate::moments::{Component, Profile};
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
    (Component { n: 1, m: 0 }, "mean 10 (deg)"),
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
    (Component { n: 0, m: 1 }, "mean 01 (deg)"),
    (Component { n: 1, m: 1 }, "covariance 11 (rad²)"),
    (Component { n: 2, m: 1 }, "skewness 21"),
    (Component { n: 0, m: 3 }, "skewness 03"),
    (Component { n: 3, m: 1 }, "excess kurtosis 31"),
    (Component { n: 1, m: 3 }, "excess kurtosis 13"),
];

/// The sheet of one material: a diagram per component, a colour per channel.
pub fn material_sheet(of: &MaterialProfiles) -> Sheet {
    let panel = |(component, label): (Component, &str)| Panel {
        y: axis(label),
        ..over_views(of.profiles.iter().enumerate().map(|(color, profile)| {
            let name = match of.profiles.len() {
                1 => String::new(),
                _ => profile.channel.name().to_owned(),
            };
            curve(profile, component, name, color)
        }))
    };
    let all = EVEN.into_iter().chain(ODD);
    let asked = all.filter(|(c, _)| of.profiles.iter().any(|p| c.order() <= p.order.get()));
    Sheet {
        name: of.material.clone(),
        title: format!("Moments of {} over the view elevation", of.material),
        panels: asked.map(panel).collect(),
        columns: 3,
    }
}

/// The sheets of a group.
pub fn group_sheets(group: &Group, members: &[&MaterialProfiles]) -> Vec<Sheet> {
    let profiles: Vec<&Profile> = members.iter().filter_map(|m| m.profiles.first()).collect();
    let name = |stem: &str| format!("{}-{stem}", group.name);
    let s = if members.len() == 1 { "" } else { "s" };
    let of = format!("{}, {} material{s}", group.name, members.len());
    let order = profiles.iter().map(|p| p.order.get()).max().unwrap_or(0);
    let sheet = |stem: &str, title: &str, list: &[(Component, &str)]| Sheet {
        name: name(stem),
        title: format!("{title}: {of}"),
        panels: list
            .iter()
            .filter(|(c, _)| c.order() <= order)
            .map(|(c, label)| Panel {
                y: axis(label),
                ..over_views(
                    profiles
                        .iter()
                        .enumerate()
                        .map(|(i, p)| curve(p, *c, String::new(), i)),
                )
            })
            .collect(),
        columns: 3,
    };
    let mut sheets = vec![
        sheet("profiles", "Moment profiles", &EVEN),
        sheet("near-zero", "Profiles of moments odd in phi", &ODD),
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
            computed("mean 10 (deg)", &mean),
            fitted("mean 10 (deg)", &|f, v| {
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
            ..axis("theta_o (deg)")
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

/// A component over the views; angles in degrees.
fn curve(profile: &Profile, component: Component, name: String, color: usize) -> Series {
    let unit = if component.order() == 1 {
        1f64.to_degrees()
    } else {
        1.0
    };
    let values = profile.values(component);
    let views = profile.views.iter();
    Series {
        name,
        color,
        mark: Mark::Line,
        points: views
            .zip(values)
            .map(|(&v, value)| (degrees(v), value.map(|x| x * unit)))
            .collect(),
    }
}
