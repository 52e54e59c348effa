//! What a page holds of materials beside their values: parametrizations, distortion, moments, spheres, errors.

use super::packed::Parts;
use crate::analysis::{Scale, View, Weight};
use crate::brdf::Brdf;
use crate::geometry::Symmetry;
use crate::lighting;
use crate::metrics::{Measure, MetricsSpec, TestSet};
use crate::moments::{Channel, Estimate, MomentsSpec, PeakResolving, Profile};
use crate::parametrization::{self, AxisKind, Unit, WarpSpec, Warps};
use crate::registry;
use crate::report::pictures::{self, SphereImage};
use rayon::prelude::*;
use serde_json::{Value as Json, json};

/// Pixels along each side of a sphere under the sky, and points a pixel.
const SKY: [usize; 2] = [160, 36];

/// Views of profiles of moments, every 3°.
const VIEWS: usize = 30;

/// Errors of B against A at some measures, as `gonio reconstruct --against` has them.
pub(super) fn errors(brdfs: &[&dyn Brdf], measures: &[Measure]) -> Vec<Json> {
    let [a, b] = brdfs else {
        return Vec::new();
    };
    let Ok(set) = TestSet::new(measures, &metrics()) else {
        return Vec::new();
    };
    let tally = set.compare(*a, *b).tally;
    let of = |(i, measure): (usize, &Measure)| {
        json!({
            "measure": measure.name(),
            "nrmse": tally.errors(i).nrmse,
            "error": tally.standard_errors(i).nrmse,
        })
    };
    measures.iter().enumerate().map(of).collect()
}

/// How errors of a page are found: as `gonio reconstruct --against` does.
pub(super) fn metrics() -> MetricsSpec {
    MetricsSpec {
        tolerance: 0.04,
        max_pairs: 1 << 14,
        ..MetricsSpec::default()
    }
}

/// 256 colours of [0, 1], six digits each.
pub(super) fn hex(colour: impl Fn(f64) -> [u8; 3]) -> String {
    let all = (0..256).map(|i| colour(f64::from(i) / 255.0));
    all.map(|[r, g, b]| format!("{r:02x}{g:02x}{b:02x}"))
        .collect()
}

/// The parametrizations, with the warps that their axes may have.
pub(super) fn charts() -> Vec<Json> {
    let warps = [
        ("none", None, 0.0),
        ("power", Some(WarpSpec::SquareRoot), 0.5),
        ("power", Some(WarpSpec::Power { exponent: 0.25 }), 0.25),
        ("sine", Some(WarpSpec::Arcsine), 1.0),
        ("sinh", Some(WarpSpec::Asinh { scale: 0.01 }), 0.01),
    ];
    let all = parametrization::all().into_iter().map(|entry| {
        let form = entry.form(Symmetry::FULL);
        let axes = form.axes().iter().map(|axis| {
            let fits = |warp: WarpSpec| {
                let warps = Warps::from([(axis.symbol.to_string(), warp)]);
                axis.kind == AxisKind::Radial && entry.warped(Symmetry::FULL, &warps).is_ok()
            };
            let all = warps.iter().filter(|(_, warp, _)| warp.is_none_or(fits));
            let all = all.map(|(family, warp, parameter)| {
                let name = warp.map_or("none".into(), WarpSpec::name);
                json!({"name": name, "family": family, "parameter": parameter})
            });
            let [low, high] = axis.range;
            json!({
                "symbol": axis.label, "low": low, "high": high, "angle": axis.unit == Unit::Radian,
                "warps": all.collect::<Vec<_>>(),
            })
        });
        let axes: Vec<Json> = axes.collect();
        json!({"kind": entry.kind, "axes": axes})
    });
    all.collect()
}

/// Shares of the variance of ln(f + ε) along the axes of each parametrization.
pub(super) fn distortion_of(name: &str, brdf: &dyn Brdf) -> Vec<Json> {
    let all = parametrization::all().into_par_iter().map(|entry| {
        let form = entry.form(brdf.symmetry().with_isotropy(true));
        let view = View::new(brdf, Scale::Log, &*form, Weight::Coordinates);
        let shares = view.distortion().shares;
        let gradients = view.gradients().all.shares();
        let errors = gradients.map(|all| all.map(|(_, error)| error));
        json!({
            "chart": entry.kind, "material": name,
            "shares": shares.as_ref().map(|s| s.axis), "both": shares.as_ref().map(|s| s.both),
            "gradients": gradients.map(|all| all.map(|(share, _)| share)),
            "error": errors.into_iter().flatten().fold(0.0, f64::max),
        })
    });
    all.collect()
}

/// Profiles of moments, as `gonio moments` prints them.
pub(super) fn moments(brdf: &dyn Brdf) -> Option<Json> {
    let spec = MomentsSpec {
        views: VIEWS,
        max_view_deg: 3.0 * (VIEWS - 1) as f64,
        ..MomentsSpec::default()
    };
    let resolving = PeakResolving::default();
    let profile = Profile::new(brdf, Channel::Luminance, &spec, &resolving, 1).ok()?;
    let components = spec.order.components().filter(|c| !c.is_odd());
    let components: Vec<_> = components.collect();
    let column = |c, number: fn(Estimate) -> f64| -> Vec<Option<f64>> {
        let slices = profile.slices.iter();
        slices.map(|s| s.moments.get(c).map(number)).collect()
    };
    let of = |number| -> Vec<_> { components.iter().map(|&c| column(c, number)).collect() };
    Some(json!({
        "columns": components.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "views": profile.views.iter().map(|v| v.to_degrees()).collect::<Vec<_>>(),
        "values": of(|e| e.value),
        "uncertainties": of(|e| e.uncertainty),
    }))
}

/// Spheres under the sky, of B with the error of its picture.
pub(super) fn sky(brdfs: &[&dyn Brdf], parts: &Parts) -> Option<Vec<Json>> {
    let mut all = lighting::all().into_iter();
    let entry = all.find(|entry| entry.kind == "sky")?;
    let light = registry::read_text(&entry, "").ok()?.build().ok()?;
    let [side, samples] = SKY;
    if let [a, b] = brdfs {
        let both = pictures::Comparison::new(*a, *b, &*light, side, samples);
        let (f, g, white) = (&both.truth, &both.reconstruction, both.truth.white());
        let a = sky_facts(0, f, white, None, parts);
        return Some(vec![a, sky_facts(1, g, white, both.nrmse, parts)]);
    }
    let one = |brdf: &&dyn Brdf| {
        let image = pictures::render_sphere(*brdf, &*light, side, samples);
        sky_facts(0, &image, image.white(), None, parts)
    };
    Some(brdfs.iter().map(one).collect())
}

fn sky_facts(i: usize, image: &SphereImage, white: f64, nrmse: Option<f64>, parts: &Parts) -> Json {
    let channel = |c| {
        let pixels = image.pixels.iter();
        pixels.map(move |pixel| pixel.map_or(f64::NAN, |pixel| pixel[c]))
    };
    let (name, side) = (format!("sky-{i}"), image.resolution);
    let values: Vec<f64> = (0..3).flat_map(channel).collect();
    let [low, step] = parts.add_values(&name, &values, 3);
    json!({
        "dims": [side, side], "white": white, "nrmse": nrmse,
        "step": step, "low": low, "blob": name,
    })
}
