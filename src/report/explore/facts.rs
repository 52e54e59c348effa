//! What a page holds of materials beside their values: parametrizations, distortion, moments, spheres, errors.

use super::packed::{Coded, Parts};
use crate::analysis::{Scale, View, Weight};
use crate::brdf::Brdf;
use crate::geometry::Symmetry;
use crate::lighting::{self, Lighting};
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
        ("power", WarpSpec::SquareRoot, 0.5),
        ("power", WarpSpec::Power { exponent: 0.25 }, 0.25),
        ("sine", WarpSpec::Arcsine, 1.0),
        ("sinh", WarpSpec::Asinh { scale: 0.01 }, 0.01),
    ];
    let all = parametrization::all().into_iter().map(|entry| {
        let form = entry.form(Symmetry::FULL);
        let axes = form.axes().iter().map(|axis| {
            let fits = |warp: &WarpSpec| {
                let warps = Warps::from([(axis.symbol.to_string(), *warp)]);
                entry.warped(Symmetry::FULL, &warps).is_ok()
            };
            let suited = warps
                .iter()
                .filter(|(_, warp, _)| axis.kind == AxisKind::Radial && fits(warp));
            let suited = suited.map(|(family, warp, parameter)| {
                json!({"name": warp.name(), "family": family, "parameter": parameter})
            });
            let plain = json!({"name": "none", "family": "none", "parameter": 0});
            let all: Vec<Json> = std::iter::once(plain).chain(suited).collect();
            let [low, high] = axis.range;
            json!({
                "symbol": axis.label, "low": low, "high": high, "angle": axis.unit == Unit::Radian,
                "warps": all,
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
        let each = gradients.map(|all| all.map(|(share, _)| Some(share)));
        let error = gradients.map_or(0.0, |all| {
            all.into_iter().fold(0.0, |most, (_, e)| e.max(most))
        });
        json!({
            "chart": entry.kind, "material": name,
            "shares": shares.as_ref().map_or([None; 2], |s| s.axis.map(Some)),
            "both": shares.as_ref().map(|s| s.both),
            "gradients": each.unwrap_or([None; 3]), "error": error,
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
    let profile = Profile::new(
        brdf,
        Channel::Luminance,
        &spec,
        &PeakResolving::default(),
        1,
    )
    .ok()?;
    let components = spec.order.components().filter(|c| !c.is_odd());
    let components: Vec<_> = components.collect();
    let of = |number: fn(Estimate) -> f64| {
        let column = |c| {
            profile
                .slices
                .iter()
                .map(move |s| s.moments.get(c).map(number))
                .collect()
        };
        components
            .iter()
            .copied()
            .map(column)
            .collect::<Vec<Vec<Option<f64>>>>()
    };
    Some(json!({
        "columns": components.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "views": profile.views.iter().map(|v| v.to_degrees()).collect::<Vec<_>>(),
        "values": of(|e| e.value),
        "uncertainties": of(|e| e.uncertainty),
    }))
}

/// Spheres under the sky, and the error of the picture of B.
pub(super) fn sky(brdfs: &[&dyn Brdf], parts: &Parts) -> (Vec<Json>, Option<Json>) {
    let Some(light) = sky_light() else {
        return (vec![Json::Null; brdfs.len()], None);
    };
    let [side, samples] = SKY;
    match brdfs {
        [a, b] => {
            let both = pictures::Comparison::new(*a, *b, &*light, side, samples);
            let white = both.truth.white();
            let facts = [(0, &both.truth), (1, &both.reconstruction)];
            let facts = facts.map(|(place, image)| sky_facts(place, image, white, parts));
            (facts.to_vec(), Some(json!({"nrmse": both.nrmse})))
        }
        all => {
            let one = |brdf: &&dyn Brdf| {
                let image = pictures::render_sphere(*brdf, &*light, side, samples);
                sky_facts(0, &image, image.white(), parts)
            };
            (all.iter().map(one).collect(), None)
        }
    }
}

fn sky_light() -> Option<Box<dyn Lighting>> {
    let entry = lighting::all()
        .into_iter()
        .find(|entry| entry.kind == "sky")?;
    registry::read_text(&entry, "").ok()?.build().ok()
}

fn sky_facts(place: usize, image: &SphereImage, white: f64, parts: &Parts) -> Json {
    let values = image
        .pixels
        .iter()
        .flat_map(|pixel| pixel.unwrap_or([f64::NAN; 3]));
    let coded = Coded::new(&values.collect::<Vec<_>>());
    let blob = parts.add(&format!("sky-{place}"), &coded.bytes());
    json!({"side": image.resolution, "white": white, "step": coded.step, "low": coded.low, "blob": blob})
}
