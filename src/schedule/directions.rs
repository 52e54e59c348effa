//! Directions of light and sensor that are uniform by themselves: a control that no parametrization is favoured by.

use super::points::accept;
use super::sample_set::{Planned, SampleSet, place};
use crate::geometry::{Direction, DirectionPair};
use crate::parametrization::Parametrization;
use crate::registry::declare;
use crate::sampling::{Sobol, cosine_hemisphere};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::Arc;

/// What directions are uniform in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Density {
    /// The solid angle times the cosine, of either direction. That is uniform in the plane vectors (h̄, k̄), of which the Jacobian is constant
    /// there: cos θ_i cos θ_o dω_i dω_o = 4 dh̄ dk̄.
    Cosine,
    /// The solid angle of either direction.
    SolidAngle,
}

declare! {
    impl dyn SampleSet, "directions": "Sobol points uniform in the directions themselves, by cosine or by solid angle, in any coordinates the same", [
        "",
        "density = \"solid-angle\"",
    ]
    /// Uniform directions.
    pub struct Directions {
        /// What they are uniform in: `cosine` or `solid-angle`.
        density: Density = Density::Cosine;
    }
}

impl Density {
    /// A direction from two numbers in [0, 1).
    fn direction(self, [u, v]: [f64; 2]) -> Direction {
        match self {
            Density::Cosine => cosine_hemisphere([u, v]),
            // 1 − u is a uniform cosine.
            Density::SolidAngle => Direction::from_spherical((1.0 - u).acos(), TAU * v),
        }
    }
}

impl SampleSet for Directions {
    fn label(&self) -> String {
        match self.density {
            Density::Cosine => Self::KIND.into(),
            Density::SolidAngle => format!("{}-solid-angle", Self::KIND),
        }
    }

    fn is_unguided(&self) -> bool {
        true
    }

    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Planned {
        let mut sobol = Sobol::new(seed);
        let isotropic = form.symmetry().isotropic;
        let pose = |i: u64| {
            let [a, b, c, d]: [f64; 4] = sobol.point(i);
            // The azimuth of the sample changes nothing of an isotropic material: three dimensions are more even than four.
            let azimuth = if isotropic { 0.0 } else { d };
            let [light, sensor] = [[a, azimuth], [b, c]].map(|u| self.density.direction(u));
            let coords = form.forward(&DirectionPair::new(light, sensor));
            place(&**form, &coords)
        };
        accept(form, budget, Self::KIND, pose)
    }
}
