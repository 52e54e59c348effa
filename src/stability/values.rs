//! Models in numbers of 50 digits, from their equations.

use super::charts::{Pair, Vector, rounded};
use crate::numeric::exact::Exact;
use crate::registry::Keys;

/// f_r (sr⁻¹) of a model at a pair above the horizon; `None` of a model without an equation here, or in colours.
/// `nudge`: with a component of the unit half vector off by one rounding, as such a model is a function of it.
pub(super) fn exact(keys: &Keys, pair: &Pair, nudge: Option<usize>) -> Option<Exact> {
    let number = |key: &str| keys.get(key)?.as_float();
    let of = |key: &str| number(key).map(Exact::from);
    let (mut half, cos_d) = half(pair);
    if let Some(d) = nudge {
        half[d] = rounded(&half[d], 1.0);
    }
    let [x, y, z] = &half;
    let one = Exact::from(1.0);
    let pi = Exact::pi();
    let [i, o] = pair;
    Some(match keys.get("kind")?.as_str()? {
        "lambert" => of("albedo")? / pi,
        "ggx" => {
            let [ax, ay] = roughness(keys)?;
            let s = square(&(x.clone() / &ax)) + square(&(y.clone() / &ay)) + square(z);
            let density = one / (pi * &ax * &ay * &square(&s));
            let area = |v: &[Exact; 3]| {
                (square(&(v[0].clone() * &ax)) + square(&(v[1].clone() * &ay)) + square(&v[2]))
                    .sqrt()
            };
            facets(pair, density, area) * &fresnel(keys, &cos_d)?
        }
        "beckmann" => {
            let [ax, ay] = roughness(keys)?;
            let lobe = gauss(&half, [&ax, &ay]);
            let density = lobe / &(pi.clone() * &ax * &ay * &square(&square(z)));
            let area = |v: &[Exact; 3]| {
                let s = (square(&(v[0].clone() * &ax)) + square(&(v[1].clone() * &ay))).sqrt();
                if s.is_zero() {
                    return v[2].clone();
                }
                let a = v[2].clone() / &s;
                // Beyond, the rest is below 1e-62.
                if a > 12.0.into() {
                    return v[2].clone();
                }
                v[2].clone() * &a.erf() + s * &(-square(&a)).exp() / &pi.sqrt()
            };
            facets(pair, density, area) * &fresnel(keys, &cos_d)?
        }
        "ward" => {
            let [ax, ay] = roughness(keys)?;
            let lobe = gauss(&half, [&ax, &ay]) / &(Exact::from(4.0) * &pi * &ax * &ay);
            let lobe = lobe / &(i[2].clone() * &o[2]).sqrt();
            of("rho_d")? / pi + of("rho_s")? * &lobe
        }
        "phong" => {
            let n = of("exponent")?;
            let two = Exact::from(2.0);
            let power = two.powf(&(n.clone() / &two));
            let scale = (n.clone() + &two) * (n.clone() + Exact::from(4.0))
                / &(Exact::from(8.0) * &pi * &(one / &power + &n));
            of("rho_d")? / pi + of("rho_s")? * &scale * &z.powf(&n)
        }
        "oren-nayar" => {
            let sigma = of("sigma_deg")? * &pi / &180.0.into();
            let s2 = square(&sigma);
            let a = one - s2.clone() / &((s2.clone() + decimal(33)) * &2.0.into());
            let b = decimal(45) * &s2 / &(s2 + decimal(9));
            let across = match i[0].clone() * &o[0] + i[1].clone() * &o[1] {
                across if across.is_positive() => across,
                _ => 0.0.into(),
            };
            let higher = if i[2] > o[2] { &i[2] } else { &o[2] };
            of("albedo")? / pi * &(a + b * &across / higher)
        }
        "sheen" => {
            let n = one / &of("alpha")?;
            let sin2 = square(x) + square(y);
            let rim = sin2.powf(&(n.clone() / &2.0.into()));
            let seen = i[2].clone() + &o[2] - i[2].clone() * &o[2];
            of("rho")? * &(n + Exact::from(2.0)) * &rim / &(Exact::from(8.0) * &pi * &seen)
        }
        _ => return None,
    })
}

/// Hundredths: 0.33 as the equation has it, not its `f64`.
fn decimal(hundredths: u32) -> Exact {
    Exact::from(f64::from(hundredths)) / &100.0.into()
}

fn square(x: &Exact) -> Exact {
    x.clone() * x
}

/// The unit half vector, and the length of (ω_i + ω_o)/2.
fn half([i, o]: &Pair) -> (Vector, Exact) {
    let half = [0, 1, 2].map(|d| (i[d].clone() + &o[d]) / &2.0.into());
    let cos_d = half.iter().map(square).fold(Exact::from(0.0), |a, b| a + b);
    let cos_d = cos_d.sqrt();
    // Opposed at the horizon: the normal is as right as any other.
    match cos_d.is_zero() {
        true => ([0.0, 0.0, 1.0].map(Exact::from), cos_d),
        false => (half.map(|x| x / &cos_d), cos_d),
    }
}

/// exp(−tan²θ_h (cos²φ_h/alpha_x² + sin²φ_h/alpha_y²)).
fn gauss([x, y, z]: &Vector, [ax, ay]: [&Exact; 2]) -> Exact {
    let t = square(&(x.clone() / ax)) + square(&(y.clone() / ay));
    (-(t / &square(z))).exp()
}

/// D over 2 (cos θ_o m(ω_i) + cos θ_i m(ω_o)).
fn facets([i, o]: &Pair, density: Exact, area: impl Fn(&[Exact; 3]) -> Exact) -> Exact {
    let seen = o[2].clone() * &area(i) + i[2].clone() * &area(o);
    density / &(seen * &2.0.into())
}

fn roughness(keys: &Keys) -> Option<[Exact; 2]> {
    let alpha = keys.get("alpha")?;
    let [x, y] = match alpha.as_array() {
        Some(both) => [both.first()?.as_float()?, both.get(1)?.as_float()?],
        None => [alpha.as_float()?; 2],
    };
    Some([x.into(), y.into()])
}

/// Reflectance of a facet at cos θ_d.
fn fresnel(keys: &Keys, c: &Exact) -> Option<Exact> {
    let term = keys.get("fresnel")?.as_table()?;
    let of = |key: &str| Some(Exact::from(term.get(key)?.as_float()?));
    let (one, two) = (Exact::from(1.0), Exact::from(2.0));
    Some(match term.get("kind")?.as_str()? {
        "none" => one,
        "schlick" => {
            let f0 = of("f0")?;
            let rest = one.clone() - c;
            let fifth = square(&square(&rest)) * &rest;
            f0.clone() + (one - f0) * &fifth
        }
        "dielectric" => {
            let n = of("ior")?;
            let g = (square(&n) - one.clone() + square(c)).sqrt();
            let (less, more) = (g.clone() - c, g + c);
            let a = square(&(less.clone() / &more));
            let b = (c.clone() * &more - one.clone()) / &(c.clone() * &less + &one);
            a * &(one + square(&b)) / &two
        }
        "conductor" => {
            let (eta2, kappa2) = (square(&of("eta")?), square(&of("kappa")?));
            let sin2 = one - square(c);
            let t = eta2.clone() - &kappa2 - &sin2;
            let ab = (square(&t) + eta2 * &kappa2 * &4.0.into()).sqrt();
            let a = ((ab.clone() + &t) / &two).sqrt();
            let ac2 = a * c * &two;
            let (p, q) = (ab.clone() + square(c), ac2.clone());
            let s = (p.clone() - &q) / &(p + q);
            let (p, q) = (square(c) * &ab + square(&sin2), ac2 * &sin2);
            let r = s.clone() * &((p.clone() - &q) / &(p + q));
            (s + r) / &two
        }
        _ => return None,
    })
}
