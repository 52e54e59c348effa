//! Poses in pictures: many that share a stop of an instrument that takes them.

use super::Schedule;
use super::sample_set::{PlanError, SampleSet, is_visible};
use super::{Pose, grid::Distinct};
use crate::error::{ParameterError, in_closed};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::parametrization::{Axis, Chart, HalfDifference, Parametrization};
use crate::registry::declare;
use crate::sampling::{GOLDEN_ANGLE, Sobol};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// The angle that all poses of a picture share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopAngle {
    /// θ_d, half the angle between light and sensor: of a sphere before a camera.
    ThetaD,
    /// The elevation of the light: of a mirror around a flat sample.
    ThetaI,
}

/// How the angles of pictures are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spread {
    /// At equal steps.
    Uniform,
    /// Denser towards the largest: the distance to it falls as the power 3/2.
    Grazing,
}

declare! {
    impl dyn SampleSet, "pictures": "pictures of many poses that share theta_d (a sphere and a camera) or theta_i (a mirror and a camera)", [
        "",
        "stop = \"theta_i\"\nfrom_deg = 0\nto_deg = 75\nnodes = 100",
        "angles_deg = [5, 20, 40, 60, 75]",
    ]
    /// Poses in pictures.
    pub struct Pictures {
        /// What the poses of a picture share: `theta_d` or `theta_i`.
        stop: StopAngle = StopAngle::ThetaD;
        /// Poses of a picture; a budget is that of so many pictures as it holds.
        nodes: usize = Pictures::NODES;
        /// Poses of all pictures together, at most: of more pictures each has fewer, down to 20.
        most: usize = 3000;
        /// The angle of the first picture, degrees.
        from_deg: f64 = 4.0;
        /// The angle of the last picture, degrees.
        to_deg: f64 = 79.0;
        /// How those between are spread: `grazing`, denser towards the last, or `uniform`.
        spread: Spread = Spread::Grazing;
        /// The angles of the pictures, degrees, instead of these three; a smaller budget has the first of them.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        angles_deg: Vec<f64> = Vec::new();
        /// Largest angle of light and sensor from the normal, degrees: no pose is chosen beyond.
        within_deg: f64 = 85.0;
    }
}

/// Poses of a picture where there are so many pictures that each has fewer: of more pictures than that none is taken.
const FEWEST: usize = 20;

/// Points tried for each node of a picture: at grazing a tenth of them is above the horizon.
const TRIES: u64 = 200;

impl Pictures {
    /// Poses of a picture where nothing else is asked for.
    pub(crate) const NODES: usize = 150;

    /// The angles of so many pictures, rad; of one alone the middle one.
    fn angles(&self, pictures: usize) -> Vec<f64> {
        if !self.angles_deg.is_empty() {
            let given = self.angles_deg.iter().take(pictures);
            return given.map(|angle| angle.to_radians()).collect();
        }
        let place = |i: usize| match pictures {
            1 => 0.5,
            _ => i as f64 / (pictures - 1) as f64,
        };
        let spread = |u: f64| match self.spread {
            Spread::Uniform => u,
            Spread::Grazing => 1.0 - (1.0 - u).powf(1.5),
        };
        let angle = |u: f64| self.from_deg + (self.to_deg - self.from_deg) * u;
        let angles = (0..pictures).map(|i| angle(spread(place(i))).to_radians());
        angles.collect()
    }

    /// The pair of a picture at a place of the unit square, its azimuths turned by `phi`; the half vector is denser towards the normal,
    /// where lobes are. `None` if it is out of reach.
    fn pair(
        &self,
        [angle, phi]: [f64; 2],
        [u, v]: [f64; 2],
        symmetry: Symmetry,
    ) -> Option<DirectionPair> {
        let theta_h = FRAC_PI_2 * u * u;
        // Azimuths that the symmetries make different, where the material can be turned.
        let once = |is: bool| if is && symmetry.isotropic { 0.5 } else { 1.0 };
        let turn = TAU * v * once(symmetry.bilateral);
        let [light, sensor] = match self.stop {
            StopAngle::ThetaD => {
                let phi_d = turn * once(symmetry.reciprocal);
                HalfDifference::inverse([theta_h, phi, angle, phi_d]).0
            }
            StopAngle::ThetaI => {
                let light = Direction::from_spherical(angle, phi).vector();
                let half = Direction::from_spherical(theta_h, phi + turn).vector();
                [light, half * (2.0 * half.dot(light)) - light]
            }
        };
        let direction = |v: DVec3| Direction::from_unit(v.normalize());
        let pair = DirectionPair::new(direction(light), direction(sensor));
        let within = self.within_deg.to_radians();
        let is_within = pair.omega_i.theta() <= within && pair.omega_o.theta() <= within;
        (is_within && is_visible(&pair)).then_some(pair)
    }
}

/// Draws of pictures, one after the other from one sequence of points.
pub(crate) struct Draws {
    sobol: Sobol,
    point: u64,
    hits: u32,
    distinct: Distinct,
}

impl Draws {
    /// Of a seed, in the coordinates of a form.
    pub(crate) fn new(seed: u64, form: &dyn Parametrization) -> Self {
        Self {
            sobol: Sobol::new(seed),
            point: 0,
            hits: 0,
            distinct: Distinct::new(form.axes()),
        }
    }

    /// The next picture at an angle, with azimuths that are turned by `phi`, rad: at most `nodes` poses that are `taken`.
    pub(crate) fn picture(
        &mut self,
        of: &Pictures,
        form: &dyn Parametrization,
        [angle, phi]: [f64; 2],
        nodes: usize,
        taken: impl Fn(&Pose) -> bool,
    ) -> Vec<Pose> {
        let symmetry = form.symmetry();
        let last = self.point + TRIES * nodes as u64;
        let mut poses = Vec::with_capacity(nodes);
        while poses.len() < nodes && self.point < last {
            let [u, v, ..]: [f64; 4] = self.sobol.point(self.point);
            self.point += 1;
            let Some(pair) = of.pair([angle, phi], [u, v], symmetry) else {
                continue;
            };
            let next = self.hits;
            self.hits += 1;
            let coords = form.canonical(&form.forward(&pair));
            let new = coords.filter(|coords| self.distinct.first(coords, next) == next);
            let new = new.map(|coords| Pose { coords, pair });
            poses.extend(new.filter(&taken));
        }
        poses
    }
}

/// The azimuth of a picture by its number, rad: each of a material that cannot be turned is of another one of the sample.
pub(crate) fn azimuth(picture: usize, symmetry: Symmetry) -> f64 {
    match symmetry.isotropic {
        true => 0.0,
        false => GOLDEN_ANGLE * picture as f64 % TAU,
    }
}

impl SampleSet for Pictures {
    fn is_unguided(&self) -> bool {
        true
    }

    fn check(&self, _: &[Axis]) -> Result<(), ParameterError> {
        for (key, value) in [("nodes", self.nodes), ("most", self.most)] {
            if value == 0 {
                return Err(ParameterError::new(
                    key,
                    value,
                    "a whole number, at least 1",
                ));
            }
        }
        in_closed("to_deg", self.to_deg, 0.0, 89.9)?;
        in_closed("from_deg", self.from_deg, 0.0, self.to_deg)?;
        in_closed("within_deg", self.within_deg, 1.0, 90.0)?;
        for (i, angle) in self.angles_deg.iter().enumerate() {
            in_closed(&format!("angles_deg[{i}]"), *angle, 0.0, 89.9)?;
        }
        Ok(())
    }

    fn plan(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        budget: usize,
        seed: u64,
    ) -> Result<Schedule, PlanError> {
        self.check(parametrization.axes())?;
        if budget < self.nodes {
            return Err(PlanError::Refused(format!(
                "budget = {budget} is smaller than a picture; allowed: at least nodes = {} poses, or fewer nodes",
                self.nodes
            )));
        }
        let fewest = FEWEST.min(self.nodes);
        let angles = self.angles((budget / self.nodes).min(self.most / fewest).max(1));
        let nodes = self.nodes.min(self.most / angles.len()).max(1);
        let symmetry = parametrization.symmetry();
        let mut draws = Draws::new(seed, &**parametrization);
        let mut poses = Vec::with_capacity(angles.len() * nodes);
        for (picture, angle) in angles.into_iter().enumerate() {
            let at = [angle, azimuth(picture, symmetry)];
            poses.extend(draws.picture(self, &**parametrization, at, nodes, |_| true));
        }
        let missed = 1.0 - f64::from(draws.hits) / draws.point as f64;
        Schedule::chosen(parametrization, Self::KIND, budget, poses, missed)
    }
}
