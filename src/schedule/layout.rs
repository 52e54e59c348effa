//! Published layouts of poses: directions that laboratories and standards measure at.

use super::points::first_of;
use super::sample_set::{Planned, SampleSet};
use crate::brdf::measured::merl::MerlGrid;
use crate::geometry::{Direction, DirectionPair};
use crate::parametrization::Parametrization;
use crate::registry::{Resolved, declare};
use crate::sampling::Random;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::Arc;

/// A layout of poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// The nodes of a MERL table (Matusik, Pfister, Brand, McMillan 2003): 90 of the root of θ_h, 90 of θ_d, of a degree each, and
    /// 180 of φ_d.
    Merl,
    /// Light and sensor at any two of 81 directions: the normal, and 6, 12, 18, 20 and 24 azimuths at elevations of 15, 30, 45, 60 and
    /// 75° (Sattler, Sarlette, Klein 2003, taken over by the BTF database of UTIA; its tables of BRDFs have 6 × 48 instead).
    UtiaBtf,
    /// ASTM E2194, of paint with metal flakes: light at 45°, sensor in its plane, 15, 45 and 110° from the mirror direction.
    AstmE2194,
    /// Multi-angle instruments for ASTM E2539, of interference pigments: light at 45°, sensor in its plane −15, 15, 25, 45, 75 and
    /// 110° from the mirror direction (towards the normal); light at 15°, sensor −15 and 15° from it.
    AstmE2539,
}

declare! {
    impl dyn SampleSet, "layout": "poses of a published layout: of MERL, UTIA's BTF, ASTM E2194 or E2539; of a larger one so many at random", [
        "",
        "of = \"astm-e2539\"",
    ]
    /// A published layout.
    pub struct LayoutSet {
        /// `merl`, `utia-btf`, `astm-e2194` or `astm-e2539`.
        of: Layout = Layout::UtiaBtf;
    }
}

/// Elevations of the directions of UTIA's BTF, degrees, and the number of azimuths at each, from 0 on.
const RINGS: [(f64, usize); 6] = [
    (0.0, 1),
    (15.0, 6),
    (30.0, 12),
    (45.0, 18),
    (60.0, 20),
    (75.0, 24),
];

/// Directions of [`RINGS`].
const DIRECTIONS: usize = 81;

/// Elevation of the light and angles from the mirror direction, degrees.
const E2194: [[f64; 2]; 3] = [[45.0, 15.0], [45.0, 45.0], [45.0, 110.0]];
const E2539: [[f64; 2]; 8] = [
    [45.0, -15.0],
    [45.0, 15.0],
    [45.0, 25.0],
    [45.0, 45.0],
    [45.0, 75.0],
    [45.0, 110.0],
    [15.0, -15.0],
    [15.0, 15.0],
];

/// The directions of [`RINGS`].
fn directions() -> impl Iterator<Item = Direction> {
    RINGS
        .into_iter()
        .flat_map(|(theta, azimuths): (f64, usize)| {
            let phi = move |k: usize| (360.0 * k as f64 / azimuths as f64).to_radians();
            (0..azimuths).map(move |k| Direction::from_spherical(theta.to_radians(), phi(k)))
        })
}

/// A pose in the plane of the light, the sensor so far from the mirror direction towards the normal, degrees.
fn aspecular([light, aspecular]: [f64; 2]) -> DirectionPair {
    let sensor: f64 = light - aspecular;
    let phi = if sensor < 0.0 { 0.0 } else { PI };
    DirectionPair::from_spherical(light.to_radians(), 0.0, sensor.abs().to_radians(), phi)
}

impl Layout {
    /// Poses, before those below the horizon are left out.
    fn len(self) -> usize {
        match self {
            Layout::Merl => MerlGrid::RECIPROCAL.dims().iter().product(),
            Layout::UtiaBtf => DIRECTIONS * DIRECTIONS,
            Layout::AstmE2194 => E2194.len(),
            Layout::AstmE2539 => E2539.len(),
        }
    }

    /// A pose; `None` if it is below the horizon.
    fn pose(self, number: usize) -> Option<DirectionPair> {
        match self {
            Layout::Merl => {
                let [_, d, p] = MerlGrid::RECIPROCAL.dims();
                MerlGrid::RECIPROCAL.pair([number / (d * p), number / p % d, number % p])
            }
            Layout::UtiaBtf => {
                let light = directions().nth(number / DIRECTIONS)?;
                let sensor = directions().nth(number % DIRECTIONS)?;
                Some(DirectionPair::new(light, sensor))
            }
            Layout::AstmE2194 => Some(aspecular(E2194[number])),
            Layout::AstmE2539 => Some(aspecular(E2539[number])),
        }
    }
}

impl SampleSet for LayoutSet {
    fn label(&self) -> String {
        let of = self.resolved().remove("of");
        of.and_then(|of| Some(of.as_str()?.to_owned()))
            .unwrap_or_default()
    }

    fn is_unguided(&self) -> bool {
        true
    }

    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Planned {
        let mut numbers: Vec<u32> = (0..self.of.len() as u32).collect();
        let mut random = Random::new(seed).stream(0);
        let all = numbers.len();
        let pairs = (0..all).filter_map(|next| {
            if budget < all {
                // A step of the shuffle of Fisher and Yates.
                let left = all - next;
                numbers.swap(next, next + (random.next() * left as f64) as usize);
            }
            self.of.pose(numbers[next] as usize)
        });
        first_of(form, budget, Self::KIND, pairs)
    }
}
