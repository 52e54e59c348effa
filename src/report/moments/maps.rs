//! Diagrams of moments over the directions of views, of anisotropic materials.

use super::figures::name_and_unit;
use crate::experiment::moments::{MaterialProfiles, degrees};
use crate::moments::{Component, Moments, Profile};
use crate::report::svg::plot::{Axis, Mark, Panel, Series};
use std::f64::consts::TAU;

/// Elevations of the views whose ellipses are drawn, and of those whose moments are drawn over the azimuth, at most.
const RINGS: usize = 4;
const CURVES: usize = 3;

/// Azimuths whose ellipses are drawn, at most.
const SPOKES: usize = 12;

/// Corners of an ellipse.
const CORNERS: usize = 32;

/// Width of a diagram over its height.
const ASPECT: f64 = 280.0 / 240.0;

/// Moments that a mirror in the plane of incidence makes vanish: where the view turns they measure the anisotropy.
const ODD: [Component; 3] = [
    Component { n: 0, m: 1 },
    Component { n: 1, m: 1 },
    Component { n: 2, m: 1 },
];

/// The ellipses of the covariance over the directions of views, and moments that are odd in φ over their azimuth; none of a material
/// whose views have one azimuth.
pub(super) fn panels(of: &MaterialProfiles) -> Vec<Panel> {
    let several = |p: &&Profile| p.views.len() > 1 && !of.further.is_empty();
    let Some(first) = of.profiles.first().filter(several) else {
        return Vec::new();
    };
    let further = of.further.iter().filter(|p| p.channel == first.channel);
    let all: Vec<&Profile> = std::iter::once(first).chain(further).collect();
    let odd = ODD.into_iter().filter(|c| c.order() <= first.order.get());
    let mut panels = Vec::from_iter(ellipses(&all));
    panels.extend(odd.map(|c| over_azimuths(&all, c)));
    panels
}

/// Positions of at most `most` of `n` views, spread over them, the first left out.
fn spread(n: usize, most: usize) -> impl Iterator<Item = usize> {
    let most = most.min(n.saturating_sub(1));
    (1..=most).map(move |k| k * (n - 1) / most)
}

/// The half axes of an ellipse of one standard deviation, by angle: a point (θ, φ), rad, for each corner.
fn ellipse(moments: &Moments) -> Option<impl Iterator<Item = [f64; 2]>> {
    let [tt, tp, pp] = moments.covariance()?;
    // By Cholesky's factor, which maps the circle onto it.
    let a = tt.sqrt();
    let (b, c) = (tp / a, (pp - tp * tp / tt).max(0.0).sqrt());
    (a > 0.0).then(|| {
        (0..=CORNERS).map(move |k| {
            let (sin, cos) = (k as f64 / CORNERS as f64 * TAU).sin_cos();
            [a * cos, b * cos + c * sin]
        })
    })
}

/// An ellipse of one standard deviation at each view, its θ along the azimuth of the view, all enlarged or shrunk alike; `None` without
/// covariances.
fn ellipses(all: &[&Profile]) -> Option<Panel> {
    let views = &all[0].views;
    let rings: Vec<usize> = spread(views.len(), RINGS).collect();
    let step = all.len().div_ceil(SPOKES);
    let shown = || {
        let profiles = all.iter().step_by(step);
        profiles.flat_map(|p| rings.iter().map(move |&v| (*p, v)))
    };
    let widths = shown().filter_map(|(p, v)| p.slices[v].moments.sigma());
    let widest = widths.flatten().reduce(f64::max)?;
    let last = views.last().map_or(90.0, |v| v.to_degrees());
    // Neighbours do not overlap along the radius, nor by much on the innermost ring.
    let scale = 0.4 * last / rings.len().max(1) as f64 / widest;
    let series = shown().filter_map(|(profile, v)| {
        let around = ellipse(&profile.slices[v].moments)?;
        let (sin, cos) = profile.azimuth.sin_cos();
        let r = views[v].to_degrees();
        let points = around.map(|[theta, phi]| {
            let [along, across] = [r + scale * theta, scale * phi];
            (along * cos - across * sin, Some(along * sin + across * cos))
        });
        Some(Series::new("", 0, Mark::Line, points.collect::<Vec<_>>()))
    });
    let times = scale / 1f64.to_degrees();
    let end = 1.15 * last;
    let axes = [
        Axis::linear("θ_o cos φ_o (°)").within([-ASPECT * end, ASPECT * end]),
        Axis::linear("θ_o sin φ_o (°)").within([-end, end]),
    ];
    let title = format!("ellipses of one standard deviation, × {times:.2}");
    Some(Panel::new(title, axes, series))
}

/// A moment over the azimuth of the view, at some elevations.
fn over_azimuths(all: &[&Profile], component: Component) -> Panel {
    let views = &all[0].views;
    let (name, unit) = name_and_unit(component);
    let scale = if component.order() == 1 {
        1f64.to_degrees()
    } else {
        1.0
    };
    let series = spread(views.len(), CURVES).enumerate().map(|(i, v)| {
        let points = all.iter().map(|p| {
            let value = p.slices[v].moments.value(component.n, component.m);
            (degrees(p.azimuth), value.map(|value| value * scale))
        });
        let title = format!("θ_o {:.0}°", degrees(views[v]));
        Series::new(title, i, Mark::Line, points.collect::<Vec<_>>())
    });
    let axes = [
        Axis::linear("φ_o (°)"),
        Axis::linear(format!("{name}{unit}")),
    ];
    Panel::new(format!("{name} over the azimuth"), axes, series)
}
