//! Statements of section 3 and of the appendix that are equations.

use super::{Bench, COMPARED, Claim, EXACT, G, form, largest, lattice, per_chart, percent, stated};
use crate::analysis::{Averaging, reduced};
use crate::brdf::Brdf;
use crate::geometry::DirectionPair;
use crate::metrics::{self, Values};
use crate::numeric::{extent, wrap_angle};
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) fn claims(bench: &Bench) -> [Claim; 9] {
    [
        equal_at_90(),
        reciprocity(bench),
        length_of_k(bench),
        length_of_h_bar(bench),
        cosines(bench),
        theta_k(bench),
        phi_k(bench),
        slices(),
        projections(&*bench.functions[G], &bench.pairs).on("test-g"),
    ]
}

fn equal_at_90() -> Claim {
    let [orthographic, hybrid] = ["orthographic", "hybrid"].map(|name| form(name, true));
    let miss = largest(lattice().filter_map(|[x, y]| {
        let pair = hybrid.inverse(&[x, y, FRAC_PI_2, 0.0])?;
        let [h, k, delta, _] = orthographic.forward(&pair);
        Some(largest([h - x, k - y, delta - FRAC_PI_2].map(f64::abs)))
    }));
    stated("orthographic-is-hybrid-at-90").exact(miss)
}

fn reciprocity(bench: &Bench) -> Claim {
    let miss = COMPARED.map(|name| {
        let form = form(name, false);
        largest(bench.pairs.iter().map(|pair| {
            let [a, b] = [form.forward(pair), form.forward(&pair.swapped())];
            let turn = wrap_angle(b[2] - a[2] - PI).abs();
            // An azimuth about a short vector is as uncertain as that vector is short.
            largest([(a[0] - b[0]).abs(), (a[1] - b[1]).abs(), turn * a[0] * a[1]])
        }))
    });
    let worst = largest(miss);
    stated("reciprocity-is-half-a-turn").found(
        &miss.map(|m| m < EXACT),
        per_chart("largest_difference", miss),
        format!("exact: largest difference {worst:.1e}"),
    )
}

fn length_of_k(bench: &Bench) -> Claim {
    let half = form("half-difference", false);
    let miss = largest(bench.pairs.iter().map(|pair| {
        let theta_d = half.forward(pair)[1];
        let kk = pair.back().length_squared();
        (theta_d.cos().powi(2) - (1.0 - kk)).abs()
    }));
    stated("cos-theta-d").exact(miss)
}

fn length_of_h_bar(bench: &Bench) -> Claim {
    let half = form("half-difference", false);
    let [mut printed, mut appendix] = [0.0_f64; 2];
    for pair in &bench.pairs {
        let [theta_h, theta_d, ..] = half.forward(pair);
        let hh = pair.half().truncate().length_squared();
        let (sin, cos) = (theta_h.sin(), theta_d.cos());
        printed = printed.max((hh - sin * cos).abs());
        appendix = appendix.max((hh - sin * sin * cos * cos).abs());
    }
    stated("length-of-h-bar").found(
        &[printed < EXACT, appendix < EXACT],
        vec![
            ("largest_difference_section_3".into(), printed),
            ("largest_difference_appendix".into(), appendix),
        ],
        format!("section 3 is off by up to {printed:.2}; the appendix is exact"),
    )
}

fn cosines(bench: &Bench) -> Claim {
    let miss = largest(bench.pairs.iter().map(|pair| {
        let (h, k) = pair.half_and_back();
        let kk = k.length_squared();
        // |k|² (1 + cos² theta_k), with |k|² cos² theta_k = k_z².
        let printed = 1.0 - h.truncate().length_squared() - kk - k.z * k.z;
        (pair.omega_i.cos_theta() * pair.omega_o.cos_theta() - printed).abs()
    }));
    stated("product-of-cosines").exact(miss)
}

fn theta_k(bench: &Bench) -> Claim {
    let hybrid = form("hybrid", false);
    let other = bench.pairs.iter().filter(|pair| {
        let [h_bar, _, delta, _] = hybrid.forward(pair);
        let (h, k) = pair.half_and_back();
        let printed = (-h.z / (h_bar * delta.cos())).atan();
        let true_angle = k.truncate().length().atan2(k.z);
        (printed - true_angle).abs() > 1e-3
    });
    let share = other.count() as f64 / bench.pairs.len() as f64;
    stated("theta-k").found(
        &[share == 0.0, share < 1.0],
        vec![("share_on_the_other_branch".into(), share)],
        format!(
            "{} of all pairs take the other branch: k changes sign, light and sensor are exchanged",
            percent(share)
        ),
    )
}

fn phi_k(bench: &Bench) -> Claim {
    let [half, _, hybrid] = COMPARED.map(|name| form(name, false));
    let off =
        |pair: &DirectionPair| wrap_angle(hybrid.forward(pair)[2] - half.forward(pair)[2]).abs();
    let mut off: Vec<f64> = bench.pairs.iter().map(off).collect();
    off.sort_by(f64::total_cmp);
    let most = off[off.len() - 1];
    let [median_deg, most_deg] = [off[off.len() / 2], most].map(f64::to_degrees);
    stated("phi-k-is-a-sum").found(
        &[most < EXACT],
        vec![
            ("median_difference_deg".into(), median_deg),
            ("largest_difference_deg".into(), most_deg),
        ],
        format!(
            "off by {median_deg:.1}° in the median, {most_deg:.0}° at most of these; towards 90° \
             for grazing half vectors"
        ),
    )
}

fn slices() -> Claim {
    let [half, _, hybrid] = COMPARED.map(|name| form(name, false));
    let spread = |delta: f64| {
        let ends = lattice().filter_map(|[x, y]| {
            let pair = hybrid.inverse(&[x, y, delta, 0.0])?;
            Some(half.forward(&pair)[2])
        });
        let [lo, hi] = extent(ends).unwrap_or_default();
        (hi - lo).to_degrees()
    };
    let angles: [f64; 4] = [0.0, 30.0, 60.0, 90.0];
    let spreads = angles.map(|a| spread(a.to_radians()));
    let keys = angles.map(|a| format!("spread_of_phi_d_at_{a}deg_deg"));
    stated("slices-correspond").found(
        &spreads.map(|s| s < 1e-4),
        keys.into_iter().zip(spreads).collect(),
        format!(
            "at 0° and 90°; phi_d spreads over {:.1}° at 30° and {:.1}° at 60°",
            spreads[1], spreads[2]
        ),
    )
}

/// Two-dimensional approximations of one BRDF in both coordinates.
pub(super) fn projections(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Claim {
    let stated = stated("projection-to-two-dimensions");
    let forms = ["half-difference", "hybrid"].map(|name| form(name, true));
    let truth = metrics::evaluate(brdf, pairs);
    let of = |averaging: Averaging| {
        let [a, b] = [0, 1].map(|i| reduced(brdf, &*forms[i], averaging, pairs));
        let error = |from: &Values, to: &Values| metrics::compare(pairs, from, to).nrmse;
        Some([error(&truth, &a)?, error(&truth, &b)?, error(&a, &b)?])
    };
    let [Some(uniform), Some(solid), Some(cosine)] = Averaging::ALL.map(of) else {
        return stated.undefined("the BRDF is black, so that there is no norm to normalise by");
    };
    let all = [uniform, solid, cosine];
    let numbers = Averaging::ALL
        .iter()
        .zip(all)
        .flat_map(|(averaging, errors)| {
            let of = ["half-difference", "hybrid", "between"];
            of.map(|of| format!("nrmse_{}_{of}", averaging.name()))
                .into_iter()
                .zip(errors)
        });
    // Two quadratures of a measured table, linear between nodes, agree to some 1e-4.
    let same = |[half, hybrid, apart]: [f64; 3]| apart < 1e-3 + 0.01 * half.max(hybrid);
    stated.found(
        &all.map(same),
        numbers.collect(),
        format!(
            "over equal steps errors are {:.4} and {:.4} and the two differ by {:.4}; over solid \
             angle both err by {:.4} and differ by {:.1e}",
            uniform[0], uniform[1], uniform[2], solid[0], solid[2]
        ),
    )
}
