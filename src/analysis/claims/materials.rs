//! Statements under Figs. 3 to 5, each made of one measured material, on any BRDF.
//!
//! Of ln(f + 1e-3 sr⁻¹): the isolines of the pictures follow the luminance over many decades.

use super::identities::projections;
use super::{
    COMPARED, CONSTANT, Claim, Distortion, above, below, changes, form, of_charts, on_slices,
    per_chart, per_slice, percent, percentages, stated,
};
use crate::analysis::{Scale, View, Weight};
use crate::brdf::{Brdf, BuildError};
use crate::metrics::{Measure, MetricsSpec, test_pairs};

/// The part about the top left corner of a slice: the first third of the first axis, the last of
/// the second.
const CORNER: [[f64; 2]; 2] = [[0.0, 1.0 / 3.0], [2.0 / 3.0, 1.0]];

/// The claims on materials, measured on one.
///
/// # Errors
/// None, but those that choosing the test pairs could have.
pub fn on_material(name: &str, brdf: &dyn Brdf) -> Result<Vec<Claim>, BuildError> {
    let of = |weight: Weight| {
        COMPARED.map(|chart| View::new(brdf, Scale::Log, &*form(chart, true), weight).distortion())
    };
    let [pictures, solid] = [Weight::Coordinates, Weight::SolidAngle].map(of);
    let corner = COMPARED.map(|chart| {
        let form = form(chart, true);
        let view = View::new(brdf, Scale::Log, &*form, Weight::Coordinates);
        view.within(CORNER).distortion()
    });
    let spec = MetricsSpec {
        pairs: 20_000,
        ..MetricsSpec::default()
    };
    let pairs = test_pairs(Measure::Cosine, &spec)?;
    let claims = [
        like_s(&pictures, &solid),
        corner_stable(&corner),
        typical_slices(&pictures),
        least_change(&pictures, &solid),
        aligns_best(&pictures, &solid),
        projections(brdf, &pairs),
    ];
    Ok(claims.map(|claim| claim.on(name)).into())
}

fn like_s(pictures: &[Distortion; 3], solid: &[Distortion; 3]) -> Claim {
    let stated = stated("isolines-like-s");
    let (Some(slices), Some(overall), Some(by_solid)) = (
        of_charts(pictures, |d| on_slices(d, 0)),
        of_charts(pictures, |d| Some(d.shares?.axis[0])),
        of_charts(solid, |d| Some(d.shares?.axis[0])),
    ) else {
        return stated.undefined(CONSTANT);
    };
    let mut numbers = per_chart("share_of_first_axis", overall);
    numbers.extend(per_chart("share_of_first_axis_by_solid_angle", by_solid));
    let more = |i: usize| {
        let mut slices = slices[i].iter().zip(&slices[0]);
        slices.all(|(s, half)| above(*s, &[*half]))
    };
    let more_by_solid = above(by_solid[1].min(by_solid[2]), &by_solid[..1]);
    stated.found(
        &[more(1), more(2), more_by_solid],
        numbers,
        format!(
            "half/difference, orthographic, hybrid: the first axis explains {}; by solid angle {}",
            percentages(&overall),
            percentages(&by_solid)
        ),
    )
}

fn corner_stable(corner: &[Distortion; 3]) -> Claim {
    let stated = stated("sheen-corner-stable");
    let Some(change) = of_charts(corner, changes) else {
        return stated.undefined("the BRDF is constant about that corner");
    };
    stated.found(
        &[
            above(change[1], &[change[0], change[2]]),
            below(change[2], &change[..2]),
        ],
        per_chart("corner_changes_with_azimuth", change),
        format!(
            "half/difference, orthographic, hybrid: {} changes with the azimuth",
            percentages(&change)
        ),
    )
}

fn typical_slices(pictures: &[Distortion; 3]) -> Claim {
    let stated = stated("exceptional-slices");
    let deviations = |i: usize| -> Option<Vec<f64>> {
        let slices = pictures[i].slices.iter();
        slices.map(|s| s.deviation).collect()
    };
    let (Some(half), Some(orthographic)) = (deviations(0), deviations(1)) else {
        return stated.undefined(CONSTANT);
    };
    let of = |chart: usize, values: &[f64]| {
        let name = format!("deviation_{}", COMPARED[chart]);
        per_slice(&name, &pictures[chart], values)
    };
    let numbers = [of(0, &half), of(1, &orthographic)].concat();
    let most = |values: &[f64], at: usize| {
        let mut others = values.iter().enumerate().filter(|(i, _)| *i != at);
        others.all(|(_, v)| above(values[at], &[*v]))
    };
    stated.found(
        &[most(&half, 3), most(&orthographic, 0)],
        numbers,
        format!(
            "half/difference: {} at 90°, {} at 0°; orthographic: {} at 0°, {} at 90° of the variance",
            percent(half[3]),
            percent(half[0]),
            percent(orthographic[0]),
            percent(orthographic[3])
        ),
    )
}

fn least_change(pictures: &[Distortion; 3], solid: &[Distortion; 3]) -> Claim {
    let stated = stated("hybrid-changes-least");
    let least = |v: [f64; 3]| below(v[2], &v[..2]);
    in_both(
        stated,
        [pictures, solid],
        "changes_with_azimuth",
        changes,
        least,
    )
}

/// A claim of one number of each chart, in equal steps of the coordinates and by solid angle; `holds` of the numbers of all charts.
fn in_both(
    stated: Claim,
    found: [&[Distortion; 3]; 2],
    name: &str,
    of: impl Fn(&Distortion) -> Option<f64>,
    holds: impl Fn([f64; 3]) -> bool,
) -> Claim {
    let [Some(steps), Some(solid)] = found.map(|found| of_charts(found, &of)) else {
        return stated.undefined(CONSTANT);
    };
    let by_solid = name.to_owned() + BY_SOLID_ANGLE;
    let numbers = [per_chart(name, steps), per_chart(&by_solid, solid)].concat();
    let finding = format!(
        "half/difference, orthographic, hybrid: {}; by solid angle {}",
        percentages(&steps),
        percentages(&solid)
    );
    stated.found(&[holds(steps), holds(solid)], numbers, finding)
}

fn aligns_best(pictures: &[Distortion; 3], solid: &[Distortion; 3]) -> Claim {
    let stated = stated(ALIGNS_BEST);
    let sum = |d: &Distortion| Some(d.shares?.additive);
    let most = |v: [f64; 3]| above(v[2], &v[..2]);
    in_both(stated, [pictures, solid], SHARE_OF_A_SUM, sum, most)
}

const ALIGNS_BEST: &str = "hybrid-aligns-best";

/// Name of the share of a sum, before that of a chart.
const SHARE_OF_A_SUM: &str = "share_of_a_sum";

/// What follows the name of a number that is by solid angle.
const BY_SOLID_ANGLE: &str = "_by_solid_angle";

/// The claim on common materials, measured on all that claims were measured on; `None` of fewer than two.
pub fn on_materials(claims: &[Claim]) -> Option<Claim> {
    let all: Vec<&Claim> = claims
        .iter()
        .filter(|c| c.id == ALIGNS_BEST && !c.numbers.is_empty())
        .collect();
    let stated = stated("hybrid-aligns-best-of-all");
    let (mut cases, mut numbers, mut findings) = (Vec::new(), Vec::new(), Vec::new());
    for (end, weight) in [(BY_SOLID_ANGLE, "by solid angle"), ("", "in equal steps")] {
        let name = SHARE_OF_A_SUM.to_owned() + end;
        let shares: Vec<[f64; 3]> = all
            .iter()
            .filter_map(|claim| {
                let named = per_chart(&name, [0.0; 3]).into_iter();
                let of = |key: String| Some(claim.numbers.iter().find(|(n, _)| *n == key)?.1);
                let shares: Option<Vec<f64>> = named.map(|(key, _)| of(key)).collect();
                shares?.try_into().ok()
            })
            .collect();
        let mean =
            |chart: usize| shares.iter().map(|s| s[chart]).sum::<f64>() / shares.len() as f64;
        let means = [mean(0), mean(1), mean(2)];
        let more = |chart: usize| shares.iter().filter(|s| s[2] > s[chart]).count();
        cases.extend([0, 1].map(|chart| above(means[2], &[means[chart]])));
        numbers.extend(per_chart(&name, means));
        let [half, orthographic, hybrid] = means.map(percent);
        findings.push(format!(
            "{weight} {hybrid} against {half} in half/difference (more on {}) and {orthographic} in orthographic \
             coordinates (more on {})",
            more(0),
            more(1)
        ));
    }
    let finding = format!("over {} materials: {}", all.len(), findings.join("; "));
    (all.len() > 1).then(|| stated.found(&cases, numbers, finding))
}
