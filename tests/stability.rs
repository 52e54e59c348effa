//! The walk over the extreme cases: every law holds, and a member that is unstable is found.
#![cfg(feature = "stability")]

mod common;

use common::{Level, levels, made};
use glam::DVec3;
use gonio::brdf::{self, Brdf, BrdfSpec, BuildError, Channels, Tables};
use gonio::error::ParameterError;
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::{self, Azimuth, Chart, Form, Radial, Spherical};
use gonio::reconstruct::{self, Interpolant, Readings, Reconstruct, ReconstructError};
use gonio::registry::{self, Entry, Resolved};
use gonio::stability::{self, Check, Extent, Finding, Verdict};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

levels! {
    every_law_holds: "thorough: every check of every member";
}

/// Spherical coordinates by the arc cosine, which loses half of the digits at the normal.
#[derive(Clone, Copy)]
struct ByArcCosine;

impl Chart for ByArcCosine {
    const NAME: &'static str = "by-arc-cosine";
    const RADIAL: [Radial; 2] = Spherical::RADIAL;
    const AZIMUTH: [Azimuth; 2] = Spherical::AZIMUTH;
    const RELATIVE: Azimuth = Spherical::RELATIVE;
    const EXCHANGE: bool = Spherical::EXCHANGE;
    const NESTED: bool = Spherical::NESTED;
    const PEAK_AT_START: bool = Spherical::PEAK_AT_START;

    fn absolute([i, o]: [DVec3; 2]) -> [f64; 4] {
        let [_, phi_i, _, phi_o] = Spherical::absolute([i, o]);
        [i.z.acos(), phi_i, o.z.acos(), phi_o]
    }

    fn relative([i, o]: [DVec3; 2]) -> [f64; 3] {
        [i.z.acos(), o.z.acos(), Spherical::relative([i, o])[2]]
    }

    fn inverse(coords: [f64; 4]) -> ([DVec3; 2], bool) {
        Spherical::inverse(coords)
    }

    fn lift(coords: [f64; 3]) -> [f64; 4] {
        Spherical::lift(coords)
    }

    fn jacobian(coords: [f64; 4]) -> f64 {
        Spherical::jacobian(coords)
    }
}

/// A model that says it is reciprocal, and is negative at the mirror direction.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Lopsided {}

impl BrdfSpec for Lopsided {
    fn resolved(&self) -> registry::Keys {
        registry::resolved("lopsided", self)
    }
    fn label(&self) -> String {
        "lopsided".into()
    }
    fn check(&self, _: &Channels) -> Result<(), BuildError> {
        Ok(())
    }
    fn build(&self, _: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        Ok(Box::new(made(Symmetry::FULL, |pair| {
            let is_mirror = pair.half().truncate().length() < 1e-6;
            let cos = pair.omega_i.cos_theta();
            Some([if is_mirror { -1.0 } else { cos }])
        })))
    }
    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// The mean of the readings over their spread: nothing of readings that are equal.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Undefined {}

struct Constant(f64);

impl Interpolant for Constant {
    fn width(&self) -> usize {
        1
    }
    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        for (pair, out) in pairs.iter().zip(out) {
            *out = if pair.is_above_horizon() { self.0 } else { 0.0 };
        }
    }
}

impl Resolved for Undefined {
    fn resolved(&self) -> registry::Keys {
        registry::resolved("undefined", self)
    }
}

impl Reconstruct for Undefined {
    fn label(&self) -> String {
        "undefined".into()
    }
    fn needs_grid(&self) -> bool {
        false
    }
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        let values = (0..r.present.len()).filter_map(|i| Some(r.value(i)?[0]));
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread = values.iter().map(|v| (v - mean).abs()).sum::<f64>();
        Ok(Box::new(Constant(mean * spread / spread)))
    }
}

/// What a short walk finds of the members with a name.
fn walked(family: &str, keep: impl Fn(usize, &Check) -> bool) -> Vec<Finding> {
    let families = stability::all();
    let family = families.iter().find(|f| f.name == family);
    let family = family.expect("a family");
    let all = (family.checks)(Extent::Short).into_iter().enumerate();
    let checks: Vec<_> = all.filter(|(i, c)| keep(*i, c)).map(|(_, c)| c).collect();
    let stop = Arc::new(AtomicBool::new(false));
    stability::run(vec![(family.name, checks)], &stop, &|| ())
}

/// Members that this program joins to the registries, each of which breaks a law.
const OWN: [&str; 3] = ["by-arc-cosine", "lopsided", "undefined"];

fn every_law_holds(level: Level) {
    // The registries are of the whole process: the other test may have joined its members.
    let is_asked = |i: usize, check: &Check| {
        let own = OWN.iter().any(|own| check.member.starts_with(own));
        !own && i.is_multiple_of(level.of(11, 1))
    };
    for family in stability::all() {
        for finding in walked(family.name, is_asked) {
            assert_eq!(finding.verdict, Verdict::Holds, "{finding:#?}");
            assert!(finding.cases > 0 && finding.ratio <= finding.allowed);
        }
    }
}

#[test]
fn what_is_unstable_is_found() {
    // Members of a program's own are walked too.
    let lost = parametrization::entry::<Form<ByArcCosine>>("digits lost", &[""]);
    parametrization::join(lost).unwrap();
    brdf::join(Entry {
        kind: "lopsided",
        summary: "neither reciprocal nor positive",
        examples: &[""],
        read: |table| Ok(Box::new(registry::parse::<Lopsided>(table)?)),
    })
    .unwrap();
    reconstruct::join(Entry {
        kind: "undefined",
        summary: "0/0",
        examples: &[""],
        read: |table| Ok(Box::new(registry::parse::<Undefined>(table)?)),
    })
    .unwrap();
    let broken = |family: &str, member: &str| -> Vec<&'static str> {
        let found = walked(family, |_, c| c.member.starts_with(member));
        assert!(!found.is_empty(), "{member} was not walked");
        let broken = found.into_iter().filter(|f| f.verdict == Verdict::Broken);
        broken.map(|f| f.law).collect()
    };
    let lost = broken("parametrizations", "by-arc-cosine");
    assert!(lost.contains(&"pair, coordinates, pair"), "{lost:?}");
    let laws = "finite, not negative, 0 below the horizon; declared symmetries";
    assert_eq!(broken("models", "lopsided").join("; "), laws);
    let undefined = broken("reconstructions", "undefined");
    assert!(undefined.contains(&"finite and not negative, or refused with a reason"));
    assert!(undefined.contains(&"readings that are equal"));
}

/// An interrupted walk says of each law that was left that it was.
#[test]
fn laws_after_an_interruption_are_said_to_be_left() {
    let family = &stability::all()[0];
    let checks = (family.checks)(Extent::Short);
    let count = checks.len();
    let stop = Arc::new(AtomicBool::new(true));
    let found = stability::run(vec![(family.name, checks)], &stop, &|| ());
    assert_eq!(found.len(), count);
    assert!(
        found
            .iter()
            .all(|f| f.verdict == Verdict::Interrupted && f.cases == 0)
    );
    let text = gonio::report::stability_table(&found);
    let left = format!("interrupted before {count} were checked");
    assert!(text.contains(&left), "{text}");
}
