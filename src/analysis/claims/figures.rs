//! Statements under Figs. 1 and 2 and in section 3, on the functions F, S and G.

use super::{
    ALIGNED, Bench, COMPARED, CONSTANT, Claim, EXACT, F, G, S, above, below, changes, form,
    largest, lattice, of_charts, on_slices, per_chart, per_slice, percent, percentages, stated,
};
use crate::analysis::LATTICE;
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::last_where;
use crate::parametrization::view_centered;
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) fn claims(bench: &Bench) -> Vec<Claim> {
    let mut claims = vec![back_isolines(bench), mirror_isolines()];
    let aligned = [
        ("f-aligned-half-difference", F, "half-difference", 1),
        ("f-aligned-hybrid", F, "hybrid", 1),
        ("s-aligned-orthographic", S, "orthographic", 0),
        ("s-aligned-hybrid", S, "hybrid", 0),
    ];
    for (id, function, chart, axis) in aligned {
        let stated = stated(id);
        let Some(shares) = on_slices(&bench.distortion(function, chart), axis) else {
            claims.push(stated.undefined(CONSTANT));
            continue;
        };
        let least = shares.into_iter().fold(f64::INFINITY, f64::min);
        claims.push(stated.found(
            &[1.0 - least < EXACT],
            vec![("least_share".into(), least)],
            format!("share {least:.9} on the worst slice"),
        ));
    }
    claims.extend([
        f_bends(bench),
        s_distorted(bench),
        s_independent(bench),
        g_horizon(bench),
        g_ranking(bench),
        g_circular(bench),
    ]);
    claims
}

fn back_isolines(bench: &Bench) -> Claim {
    // The angle between light and view is 2 theta_d, |k| its sine; |k_bar| is |h_bar| of the same
    // light and a view turned by half a turn.
    let [half, orthographic, hybrid] = COMPARED.map(|name| form(name, false));
    let miss = bench.pairs.iter().map(|pair| {
        let view = Direction::from_spherical(pair.omega_o.theta(), pair.omega_o.phi() + PI);
        let turned = DirectionPair::new(pair.omega_i, view);
        let theta_d = 0.5 * pair.separation();
        let by = [
            half.forward(pair)[1] - theta_d,
            hybrid.forward(pair)[1] - theta_d.sin(),
            orthographic.forward(pair)[1] - orthographic.forward(&turned)[0],
        ];
        largest(by.map(f64::abs))
    });
    let miss = largest(miss);
    stated("back-isolines-concentric").exact(miss)
}

fn mirror_isolines() -> Claim {
    const VIEW: f64 = 75.0;
    const ACROSS: f64 = 15.0;
    // Extent towards the normal of the isoline through a point beside the mirror direction.
    let aspect = |chart: &str, across: f64| {
        let form = form(chart, false);
        let view = VIEW.to_radians();
        let first = |theta: f64, phi: f64| {
            let light = view_centered(theta - view, phi);
            form.forward(&DirectionPair::new(light, view_centered(view, 0.0)))[0]
        };
        let level = first(0.0, across.to_radians());
        let end = last_where(0.0, FRAC_PI_2, 60, |theta| first(theta, 0.0) < level);
        end.to_degrees() / across
    };
    let [theta_h, h_bar] = ["half-difference", "hybrid"].map(|c| aspect(c, ACROSS));
    let [small_theta_h, small_h_bar] = ["half-difference", "hybrid"].map(|c| aspect(c, 0.01));
    stated("mirror-isolines-pinched").found(
        &[h_bar < 0.99 * theta_h, small_h_bar < 0.99 * small_theta_h],
        vec![
            ("aspect_theta_h".into(), theta_h),
            ("aspect_h_bar".into(), h_bar),
            ("aspect_small_theta_h".into(), small_theta_h),
            ("aspect_small_h_bar".into(), small_h_bar),
        ],
        format!(
            "15° wide isolines are {theta_h:.2} and {h_bar:.2} times as long as wide, small ones \
             {small_theta_h:.2} and {small_h_bar:.2}: about a narrow peak both are 1/cos 75°"
        ),
    )
}

fn f_bends(bench: &Bench) -> Claim {
    let stated = stated("f-bends-orthographic");
    let found = bench.distortion(F, "orthographic");
    let Some(shares) = on_slices(&found, 1) else {
        return stated.undefined(CONSTANT);
    };
    // Along the anti-diagonal |k_bar| falls where |h_bar| rises: F rises with both.
    let form = form("orthographic", true);
    let value = |x: f64, y: f64| {
        let pair = form.inverse(&[x, y, 0.0, 0.0])?;
        Some(pair.back().length())
    };
    let step = 1.0 / LATTICE as f64;
    let nodes = (1..LATTICE).flat_map(|i| (1..LATTICE).map(move |j| [i, j]));
    let falls = |node: [usize; 2]| {
        let [x, y] = node.map(|i| i as f64 * step);
        let here = value(x, y)?;
        Some((value(x + step, y)? - here) * (value(x, y + step)? - here) > 0.0)
    };
    let slopes: Vec<bool> = nodes.filter_map(falls).collect();
    let falling = slopes.iter().filter(|s| **s).count() as f64 / slopes.len() as f64;
    let mut numbers = per_slice("share_k_bar", &found, &shares);
    numbers.push(("falling_isolines_0deg".into(), falling));
    let less = shares[..3].iter().all(|s| *s < 1.0 - EXACT);
    stated.found(
        &[1.0 - shares[3] < EXACT && less, falling > 0.99],
        numbers,
        format!(
            "|k_bar| explains {} of F at 90° and {} at 0°; {} of the isolines fall there",
            percent(shares[3]),
            percent(shares[0]),
            percent(falling)
        ),
    )
}

fn s_distorted(bench: &Bench) -> Claim {
    let stated = stated("s-distorted-half-difference");
    let found = bench.distortion(S, "half-difference");
    let Some(shares) = on_slices(&found, 0) else {
        return stated.undefined(CONSTANT);
    };
    let cases: Vec<bool> = shares.iter().map(|s| *s < ALIGNED).collect();
    let explained = percentages(&shares);
    let finding = format!("theta_h explains {explained} of S at 0°, 30°, 60° and 90°");
    stated.found(&cases, per_slice("share_theta_h", &found, &shares), finding)
}

fn s_independent(bench: &Bench) -> Claim {
    let stated = stated("s-independent-of-phi-d");
    let Some(change) = changes(&bench.distortion(S, "half-difference")) else {
        return stated.undefined(CONSTANT);
    };
    stated.found(
        &[change.abs() < EXACT],
        vec![("share_changing_with_phi_d".into(), change)],
        format!("{change:.1e} of the variance changes with phi_d"),
    )
}

fn g_horizon(bench: &Bench) -> Claim {
    let g = &*bench.functions[G];
    let lights = (0..8).map(|i| view_centered(0.2 * i as f64 - 0.7, 0.3));
    let horizon = view_centered(FRAC_PI_2 - 1e-9, 0.0);
    let value = |light| g.luminance(&DirectionPair::new(light, horizon));
    let value = largest(lights.filter_map(value));
    stated("g-zero-on-the-horizon").found(
        &[value.abs() < EXACT],
        vec![("g_on_the_horizon".into(), value)],
        format!("G is {value:.3} there; the product of cosines is 0"),
    )
}

fn g_ranking(bench: &Bench) -> Claim {
    let stated = stated("g-ranking");
    let found = COMPARED.map(|chart| bench.distortion(G, chart));
    let (Some(change), Some(bent), Some(apart)) = (
        of_charts(&found, changes),
        of_charts(&found, |d| Some(1.0 - d.shares?.additive)),
        of_charts(&found, |d| d.shares.map(|s| 1.0 - s.axis[0].max(s.axis[1]))),
    ) else {
        return stated.undefined(CONSTANT);
    };
    let most = |v: [f64; 3]| above(v[0], &v[1..]);
    let least = |v: [f64; 3]| below(v[2], &v[..2]);
    let mut numbers = per_chart("changes_with_azimuth", change);
    numbers.extend(per_chart("beyond_a_sum_of_two_axes", bent));
    numbers.extend(per_chart("beyond_the_best_axis", apart));
    let cases = [change, bent, apart].map(|v| [most(v), least(v)]);
    let finding = format!(
        "half/difference, orthographic, hybrid: {} of G changes with the azimuth, {} is no sum of \
         functions of the first two axes, {} is not explained by the best axis",
        percentages(&change),
        percentages(&bent),
        percentages(&apart)
    );
    stated.found(cases.as_flattened(), numbers, finding)
}

fn g_circular(bench: &Bench) -> Claim {
    let g = &*bench.functions[G];
    let miss = |chart: &str, delta: f64| {
        let form = form(chart, true);
        largest(lattice().filter_map(|[x, y]| {
            let value = g.luminance(&form.inverse(&[x, y, delta, 0.0])?)?;
            Some((value - x * x - y * y).abs())
        }))
    };
    let charts = ["orthographic", "hybrid"];
    let (at_90, at_0) = (
        charts.map(|c| miss(c, FRAC_PI_2)),
        charts.map(|c| miss(c, 0.0)),
    );
    let numbers = [(90, at_90), (0, at_0)]
        .into_iter()
        .flat_map(|(angle, miss)| {
            let key = move |chart| format!("largest_difference_{chart}_{angle}deg");
            charts.map(key).into_iter().zip(miss)
        });
    let most = largest(at_90);
    let [orthographic, hybrid] = at_0;
    stated("g-circular-at-90").found(
        &at_90.map(|miss| miss < EXACT),
        numbers.collect(),
        format!(
            "exact at 90° (largest difference {most:.1e}); at 0° off by up to {orthographic:.2} \
             and {hybrid:.2}"
        ),
    )
}
