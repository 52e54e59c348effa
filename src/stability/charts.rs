//! The formulas of the charts in numbers of 50 digits, from their definitions: another way than that of the charts.

use crate::geometry::DirectionPair;
use crate::numeric::exact::Exact;

pub(super) type Vector = [Exact; 3];

/// ω_i and ω_o.
pub(super) type Pair = [Vector; 2];

/// What a direction is in 50 digits: its components, over their length.
fn unit(v: &Vector) -> Vector {
    let length = dot(v, v).sqrt();
    v.clone().map(|x| x / &length)
}

/// A pair in 50 digits.
pub(super) fn exactly(pair: &DirectionPair) -> Pair {
    components(pair).map(|v| unit(&v))
}

/// Components as they are stored, which the orthographic chart takes.
pub(super) fn components(pair: &DirectionPair) -> Pair {
    pair.vectors().map(|v| v.to_array().map(Exact::from))
}

/// [`exactly`] with one of the six components off by one rounding; `None` where it is 0.
pub(super) fn nudged(pair: &DirectionPair, component: usize) -> Option<Pair> {
    Some(nudged_components(pair, component)?.map(|v| unit(&v)))
}

/// [`components`] with one of them off by one rounding; `None` where it is 0.
pub(super) fn nudged_components(pair: &DirectionPair, component: usize) -> Option<Pair> {
    let mut vectors = components(pair);
    let x = &mut vectors[component / 3][component % 3];
    if x.is_zero() {
        return None;
    }
    *x = rounded(x, 1.0);
    Some(vectors)
}

/// A number off by one rounding, up or, of the other sign, down.
pub(super) fn rounded(x: &Exact, sign: f64) -> Exact {
    x.clone() * &(Exact::from(1.0) + Exact::from(sign * super::ROUNDING))
}

/// a + sign b.
fn sum(a: &Vector, b: &Vector, sign: f64) -> Vector {
    [0, 1, 2].map(|d| a[d].clone() + b[d].clone() * &sign.into())
}

fn dot(a: &Vector, b: &Vector) -> Exact {
    let [x, y, z] = [0, 1, 2].map(|d| a[d].clone() * &b[d]);
    x + y + z
}

fn length(v: &Vector) -> Exact {
    dot(v, v).sqrt()
}

fn hypot(x: &Exact, y: &Exact) -> Exact {
    (x.clone() * x + y.clone() * y).sqrt()
}

/// Half of the sum and half of the difference.
fn half_and_back([i, o]: &Pair) -> [Vector; 2] {
    let half = Exact::from(0.5);
    [1.0, -1.0].map(|sign| sum(i, o, sign).map(|x| x * &half))
}

/// rot(n, angle) v.
fn about_n(v: &Vector, (sin, cos): &(Exact, Exact)) -> Vector {
    let [x, y, z] = v;
    [
        x.clone() * cos - y.clone() * sin,
        x.clone() * sin + y.clone() * cos,
        z.clone(),
    ]
}

/// rot(b, angle) v.
fn about_b(v: &Vector, (sin, cos): &(Exact, Exact)) -> Vector {
    let [x, y, z] = v;
    [
        x.clone() * cos + z.clone() * sin,
        y.clone(),
        z.clone() * cos - x.clone() * sin,
    ]
}

fn negative((sin, cos): (Exact, Exact)) -> (Exact, Exact) {
    (-sin, cos)
}

/// An azimuth, 0 where it has no meaning.
fn azimuth(v: &Vector) -> Exact {
    Exact::atan2(&v[1], &v[0])
}

fn elevation(v: &Vector) -> Exact {
    Exact::atan2(&hypot(&v[0], &v[1]), &v[2])
}

/// Names of the charts with formulas here.
pub(super) const CHARTS: [&str; 5] = [
    "spherical",
    "half-difference",
    "orthographic",
    "hybrid",
    "stark",
];

/// The four coordinates of a pair in a chart that is named here: radial, azimuth, radial, azimuth.
pub(super) fn absolute(chart: &str, pair: &Pair) -> [Exact; 4] {
    let [h, k] = half_and_back(pair);
    match chart {
        "spherical" => {
            let [i, o] = pair;
            [elevation(i), azimuth(i), elevation(o), azimuth(o)]
        }
        "half-difference" => {
            let (theta_h, phi_h) = (elevation(&h), azimuth(&h));
            let turned = about_n(&pair[0], &negative(phi_h.sin_cos()));
            let d = about_b(&turned, &negative(theta_h.sin_cos()));
            let theta_d = Exact::atan2(&length(&k), &length(&h));
            [theta_h, phi_h, theta_d, azimuth(&d)]
        }
        "orthographic" => [
            hypot(&h[0], &h[1]),
            azimuth(&h),
            hypot(&k[0], &k[1]),
            azimuth(&k),
        ],
        "hybrid" => [hypot(&h[0], &h[1]), azimuth(&h), length(&k), azimuth(&k)],
        _ => {
            let [h_bar, phi_h, k, phi_k] = absolute("hybrid", pair);
            [h_bar.clone() * &h_bar, phi_h, k.clone() * &k, phi_k]
        }
    }
}

/// The three coordinates of isotropic materials: radial, radial, azimuth that does not turn with the sample.
pub(super) fn relative(chart: &str, pair: &Pair) -> [Exact; 3] {
    let [r1, a1, r2, a2] = absolute(chart, pair);
    let difference = match chart {
        "spherical" => a1 - a2,
        // Where h is the normal the sample may be turned so that it is 0.
        "half-difference" if r1.is_zero() => 0.0.into(),
        "half-difference" => a2,
        _ => a2 - a1,
    };
    // Where a radius vanishes its azimuth means nothing.
    let difference = match r1.is_zero() || r2.is_zero() {
        true => 0.0.into(),
        false => difference,
    };
    [r1, r2, difference]
}

/// The directions at the four coordinates of a chart that is named here; `None` outside its domain.
pub(super) fn inverse(chart: &str, coords: &[Exact; 4]) -> Option<Pair> {
    let [r1, a1, r2, a2] = coords;
    let pair = match chart {
        "spherical" => [[r1, a1], [r2, a2]].map(|[theta, phi]| polar(theta, phi)),
        "half-difference" => {
            let (turn, tilt) = (a1.sin_cos(), r1.sin_cos());
            let to_surface = |v: &Vector| about_n(&about_b(v, &tilt), &turn);
            let i = to_surface(&polar(r2, a2));
            let h = to_surface(&[0.0, 0.0, 1.0].map(Exact::from));
            let twice = dot(&i, &h) * &2.0.into();
            let o = [0, 1, 2].map(|d| twice.clone() * &h[d] - &i[d]);
            [i, o]
        }
        "orthographic" => {
            let [h, k] = [flat(r1, a1), flat(r2, a2)];
            let one = Exact::from(1.0);
            let lifted = |sign: f64| {
                let [x, y] = [0, 1].map(|d| h[d].clone() + k[d].clone() * &sign.into());
                let rest = one.clone() - x.clone() * &x - y.clone() * &y;
                let above = rest.is_positive() || rest.is_zero();
                above.then(|| [x, y, rest.sqrt()])
            };
            [lifted(1.0)?, lifted(-1.0)?]
        }
        "hybrid" => {
            let rest = Exact::from(1.0) - r1.clone() * r1 - r2.clone() * r2;
            if !rest.is_positive() && !rest.is_zero() {
                return None;
            }
            let h_z = rest.sqrt();
            let (_, cos) = (a1.clone() - a2).sin_cos();
            let theta_k = Exact::atan2(&h_z, &-(r1.clone() * &cos));
            let [h_x, h_y] = flat(r1, a1);
            let k = polar(&theta_k, a2).map(|x| x * r2);
            let h = [h_x, h_y, h_z];
            [1.0, -1.0].map(|sign| sum(&h, &k, sign))
        }
        _ => return inverse("hybrid", &[r1.sqrt(), a1.clone(), r2.sqrt(), a2.clone()]),
    };
    let above = pair.iter().all(|v| v[2].is_positive() || v[2].is_zero());
    above.then_some(pair)
}

/// The absolute coordinates of relative ones, at one orientation of the sample.
pub(super) fn lift(chart: &str, [r1, r2, a]: [Exact; 3]) -> [Exact; 4] {
    match chart {
        "spherical" => [r1, a, r2, 0.0.into()],
        _ => [r1, 0.0.into(), r2, a],
    }
}

/// Unit vector at an elevation and azimuth.
fn polar(theta: &Exact, phi: &Exact) -> Vector {
    let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
    [st.clone() * &cp, st * &sp, ct]
}

/// Vector of the tangent plane.
fn flat(r: &Exact, phi: &Exact) -> [Exact; 2] {
    let (sin, cos) = phi.sin_cos();
    [r.clone() * &cos, r.clone() * &sin]
}

/// Larger of the angles (rad) between the directions of two pairs.
pub(super) fn angle(a: &Pair, b: &Pair) -> f64 {
    let between = |a: &Vector, b: &Vector| {
        let [difference, sum] = [-1.0, 1.0].map(|sign| length(&sum(a, b, sign)).to_f64());
        2.0 * difference.atan2(sum)
    };
    between(&a[0], &b[0]).max(between(&a[1], &b[1]))
}

/// d ω_i d ω_o = J d(coordinates) at absolute coordinates inside the domain, by differences far below what 16 digits hold.
pub(super) fn jacobian(chart: &str, coords: &[Exact; 4]) -> Option<Exact> {
    // A step of a coordinate is a share of it, as coordinates end at 0.
    let share = Exact::from(1e-25);
    let pair = inverse(chart, coords)?;
    let frames = pair.clone().map(|v| frame(&v));
    let mut rows: Vec<Vec<Exact>> = Vec::new();
    for d in 0..4 {
        let step = match coords[d].is_zero() {
            true => share.clone(),
            false => share.clone() * &coords[d].abs(),
        };
        let twice = step.clone() * &2.0.into();
        let at = |sign: f64| {
            let mut moved = coords.clone();
            moved[d] = moved[d].clone() + step.clone() * &sign.into();
            inverse(chart, &moved)
        };
        let (up, down) = (at(1.0)?, at(-1.0)?);
        let along = |w: usize, e: usize| {
            let tangent = [0, 1, 2].map(|d| (up[w][d].clone() - &down[w][d]) / &twice);
            dot(&tangent, &frames[w][e])
        };
        rows.push(vec![along(0, 0), along(0, 1), along(1, 0), along(1, 1)]);
    }
    Some(determinant(&rows).abs())
}

/// Two vectors orthogonal to a unit vector and to each other.
fn frame(v: &Vector) -> [Vector; 2] {
    let axis = if v[0].abs().to_f64() < 0.7 { 0 } else { 1 };
    let along = v[axis].clone();
    let a: Vector = [0, 1, 2].map(|d| {
        let e = Exact::from(if d == axis { 1.0 } else { 0.0 });
        e - along.clone() * &v[d]
    });
    let a = unit(&a);
    let b = [(1, 2), (2, 0), (0, 1)].map(|(p, q)| v[p].clone() * &a[q] - v[q].clone() * &a[p]);
    [a, b]
}

/// Determinant of some rows, by expansion along the first.
fn determinant(rows: &[Vec<Exact>]) -> Exact {
    let Some((first, rest)) = rows.split_first() else {
        return 1.0.into();
    };
    let terms = first.iter().enumerate().map(|(c, x)| {
        let without = |row: &Vec<Exact>| [&row[..c], &row[c + 1..]].concat();
        let minor: Vec<Vec<Exact>> = rest.iter().map(without).collect();
        let sign = Exact::from(if c % 2 == 0 { 1.0 } else { -1.0 });
        sign * x * &determinant(&minor)
    });
    terms.fold(0.0.into(), |sum, term| sum + term)
}
