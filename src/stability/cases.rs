//! The extreme table: pairs of directions where formulas break, and the members of registries at them.

use crate::brdf::{self, Brdf, BrdfSpec, Channels};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::parametrization::{self, Form, HalfDifference, Parametrization, WarpSpec, Warps};
use crate::registry::{self, Entry};
use crate::schedule::Schedule;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// A pair and where it lies.
#[derive(Clone, Debug)]
pub(super) struct Case {
    pub name: String,
    pub pair: DirectionPair,
}

/// Elevations in degrees, from the normal to 1e-10° above the horizon.
const ELEVATIONS: [f64; 11] = [
    0.0,
    1e-300,
    1e-12,
    1e-4,
    20.0,
    45.0,
    80.0,
    89.0,
    90.0 - 1e-4,
    90.0 - 1e-7,
    90.0 - 1e-10,
];

/// The seams of azimuths, and one that is none.
const AZIMUTHS: [f64; 6] = [0.4, 0.0, -0.0, PI, -PI, FRAC_PI_2];

/// Pairs at separations of 1e-1 to 1e-15 rad from retro-reflection, from the mirror direction and, at the horizon, from
/// opposed directions, along the plane of incidence and across it; poles and seams.
pub(super) fn pairs() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut add = |name: String, [ti, pi, to, po]: [f64; 4]| {
        let pair = DirectionPair::from_spherical(ti, pi, to, po);
        if pair.is_above_horizon() {
            cases.push(Case { name, pair });
        }
    };
    for (e, degrees) in ELEVATIONS.into_iter().enumerate() {
        let theta = degrees.to_radians();
        for (what, turn) in [("retro", 0.0), ("mirror", PI)] {
            let phi = AZIMUTHS[e % AZIMUTHS.len()];
            add(
                format!("{what} at {degrees}°, φ = {phi}"),
                [theta, phi, theta, phi + turn],
            );
            for power in 1..=15 {
                let d = 10f64.powi(-power);
                // Towards the normal, so that both stay above the horizon.
                let near = if theta > d { theta - d } else { theta + d };
                let phi = AZIMUTHS[(e + power as usize) % AZIMUTHS.len()];
                add(
                    format!("1e-{power} from {what} at {degrees}°, φ = {phi}"),
                    [near, phi, theta, phi + turn],
                );
                add(
                    format!("1e-{power} beside {what} at {degrees}°, φ = {phi}"),
                    [theta, phi + d, theta, phi + turn],
                );
            }
        }
        for phi in AZIMUTHS {
            for other in [0.0, 1e-9, 0.7, FRAC_PI_2 - 1e-9] {
                add(
                    format!("{degrees}° and {other} rad, φ = {phi} and 0"),
                    [theta, phi, other, 0.0],
                );
            }
        }
    }
    // Components negated: h or k along an axis to the last bit.
    let v = Direction::from_spherical(0.7, 0.4).vector();
    let to_the_last_bit = [
        ("mirror to the last bit", DVec3::new(-1.0, -1.0, 1.0)),
        ("retro to the last bit", DVec3::ONE),
        ("mirrored in t", DVec3::new(1.0, -1.0, 1.0)),
    ];
    cases.extend(to_the_last_bit.map(|(name, signs)| Case {
        name: name.into(),
        pair: DirectionPair::from_unit([v, v * signs]),
    }));
    cases
}

/// The pairs with both cosines above `cos`: others are too near to the horizon for an instrument or a table.
pub(super) fn pairs_above(cos: f64) -> Vec<Case> {
    let mut cases = pairs();
    cases.retain(|case| case.pair.least_cosine() > cos);
    cases
}

/// Symmetries of forms: nothing folded, all folded, in three coordinates and in four.
pub(super) const SYMMETRIES: [(&str, Symmetry); 4] = [
    ("isotropic", Symmetry::NONE.with_isotropy(true)),
    ("folded", Symmetry::FULL),
    ("anisotropic", Symmetry::NONE),
    ("orthotropic", Symmetry::ORTHOTROPIC),
];

/// Every parametrization, plain and with each example of each warp on each axis that can have it.
pub(super) fn forms(symmetry: Symmetry) -> Vec<(String, Arc<dyn Parametrization>)> {
    let warps = examples(parametrization::warps());
    let warps: Vec<WarpSpec> = warps.map(|example| *example.member).collect();
    let mut forms = Vec::new();
    for entry in parametrization::all() {
        let plain = entry.form(symmetry);
        let axes = plain.axes().to_vec();
        forms.push((entry.kind.to_owned(), plain));
        for &warp in &warps {
            for axis in &axes {
                let alone = Warps::from([(axis.symbol.to_owned(), warp)]);
                if let Ok(form) = entry.warped(symmetry, &alone) {
                    forms.push((format!("{} {}", entry.kind, form.warp_name()), form));
                }
            }
        }
    }
    forms
}

/// A member of a registry.
pub(super) struct Example<T: ?Sized> {
    pub kind: &'static str,
    /// Its kind and keys.
    pub name: String,
    pub member: Box<T>,
}

/// Every example of the entries of a registry.
pub(super) fn examples<T: ?Sized>(entries: Vec<Entry<T>>) -> impl Iterator<Item = Example<T>> {
    entries.into_iter().flat_map(|entry| {
        let read = move |text: &&str| {
            let name = match text.is_empty() {
                true => entry.kind.to_owned(),
                false => format!("{} {}", entry.kind, text.replace('\n', ", ")),
            };
            Some(Example {
                kind: entry.kind,
                name,
                member: registry::read_text(&entry, text).ok()?,
            })
        };
        entry.examples.iter().filter_map(read)
    })
}

pub(super) fn half_difference(symmetry: Symmetry) -> Arc<dyn Parametrization> {
    Arc::new(Form::<HalfDifference>::new(symmetry))
}

/// Cases as a schedule in half/difference coordinates.
pub(super) fn schedule_of(cases: &[Case], symmetry: Symmetry) -> Arc<Schedule> {
    let pairs = cases.iter().map(|case| case.pair);
    Arc::new(Schedule {
        sample_set: "extremes".into(),
        ..Schedule::of_pairs(half_difference(symmetry), pairs)
    })
}

/// A material of the registry in luminance, from its keys. A text that cannot be read is our own mistake, and a check
/// without cases is broken.
pub(super) fn material(text: &str) -> Option<Box<dyn Brdf>> {
    spec(text)?.build(Channels::Luminance).ok()
}

/// The specification of a material of the registry, from its keys.
pub(super) fn spec(text: &str) -> Option<Box<dyn BrdfSpec>> {
    let table = toml::de::DeTable::parse(text).ok()?;
    brdf::read(table).ok()
}
