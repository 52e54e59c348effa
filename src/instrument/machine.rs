//! The moving parts: a chain of rotation axes, its class and its limits.

use super::class::Class;
use super::motion::AxisMotion;
use super::picture::{Camera, Lab};
use super::spec::{InstrumentSpec, LIGHT, SENSOR};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, angle_between};
use crate::schedule::{MAX_AXES, Positions, StopAngle, Unreachable};
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Rounding that is allowed beyond a limit, rad: an inverse makes a dozen roundings of numbers of
/// size π. Positions are put back onto their limit.
const SLACK: f64 = 1e-13;

/// A rotation axis, angles in radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// Lowest and highest position, rad.
    pub range: [f64; 2],
    /// Its speed and acceleration.
    pub motion: AxisMotion,
    /// Smallest step, rad; 0: none.
    pub resolution: f64,
    /// Standard deviation from one approach to the next, rad.
    pub repeatability: f64,
    /// Standard deviation of the offset that all positions of one instrument share, rad.
    pub bias: f64,
    /// True if a picture covers it.
    pub imaged: bool,
}

impl Axis {
    /// The position within the range that is the same as `angle`, by the fewest whole turns.
    /// `None` if there is none.
    fn within_range(&self, angle: f64) -> Option<f64> {
        let [min, max] = self.range;
        // The fewest and the most turns that may be added.
        let fewest = ((min - SLACK - angle) / TAU).ceil();
        let most = ((max + SLACK - angle) / TAU).floor();
        if fewest > most {
            return None;
        }
        let turns = 0.0_f64.clamp(fewest, most);
        Some((angle + TAU * turns).clamp(min, max))
    }
}

/// The axis that a part turns with (`None`: fixed to the base), and its direction away from the sample while all stand at 0.
type Mount = (Option<usize>, DVec3);

/// Two parts and the smallest angle between them, rad.
#[derive(Clone, Debug)]
struct Collision {
    between: [Mount; 2],
    angle_min: f64,
}

/// Limits of angles and collisions, rad.
#[derive(Clone, Debug)]
struct Limits {
    theta_i_max: f64,
    theta_o_max: f64,
    separation_min: f64,
    collisions: Vec<Collision>,
}

/// A chain of axes with its limits.
#[derive(Debug)]
pub struct Machine {
    axes: Vec<Axis>,
    class: &'static Class,
    /// `None` if it reads one pair at a stop.
    camera: Option<Camera>,
    /// `None`: everything that a camera can see can be reached.
    limits: Option<Limits>,
}

impl Machine {
    /// The machine of a preset.
    ///
    /// # Errors
    /// As [`InstrumentSpec::check`].
    pub fn new(spec: &InstrumentSpec) -> Result<Self, ParameterError> {
        spec.check()?;
        let class = spec.kinematic_class()?;
        let axes = spec.axis.iter().map(|axis| Axis {
            name: axis.name.clone(),
            range: [axis.min_deg.to_radians(), axis.max_deg.to_radians()],
            motion: AxisMotion {
                speed: axis.speed_deg_per_s.to_radians(),
                acceleration: axis.acceleration_deg_per_s2.to_radians(),
                wraps: axis.wraps,
            },
            resolution: axis.resolution_deg.to_radians(),
            repeatability: axis.repeatability_deg.to_radians(),
            bias: axis.bias_deg.to_radians(),
            imaged: axis.imaged,
        });
        let ends = class.ends;
        let part = |name: &String| match name.as_str() {
            LIGHT => (ends.light, DVec3::Z),
            SENSOR => (ends.sensor, DVec3::Z),
            // The check has found every other name among the bodies.
            _ => {
                let body = spec.body.iter().find(|body| body.name == *name);
                body.map_or((None, DVec3::Z), |body| {
                    let axis = spec.axis.iter().position(|axis| axis.name == body.axis);
                    (axis, DVec3::from(body.direction).normalize())
                })
            }
        };
        let collisions = spec.limits.collision.iter().map(|pair| Collision {
            between: pair.between.each_ref().map(part),
            angle_min: pair.angle_min_deg.to_radians(),
        });
        Ok(Self {
            axes: axes.collect(),
            limits: Some(Limits {
                theta_i_max: spec.limits.theta_i_max_deg.to_radians(),
                theta_o_max: spec.limits.theta_o_max_deg.to_radians(),
                separation_min: spec.limits.separation_min_deg.to_radians(),
                collisions: collisions.collect(),
            }),
            camera: Camera::new(spec),
            class,
        })
    }

    /// The chain without limits: [`place`](Self::place) gives the preferred
    /// solution of every pair.
    #[must_use]
    pub fn without_limits(self) -> Self {
        Self {
            limits: None,
            ..self
        }
    }

    /// The axes, in the order of [`Positions`].
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The kinematic class.
    pub fn class(&self) -> &Class {
        self.class
    }

    /// The pair that the axes make, whether they can stand there or not: every axis turns its
    /// children about its own vector in the frame of its parent.
    pub fn forward(&self, positions: &Positions) -> DirectionPair {
        let Lab {
            light,
            sensor,
            sample,
        } = self.lab(positions);
        let to_sample = sample.transpose();
        // A product of rotations is good to a few ulp; a direction is unit to one.
        let local = |v: DVec3| Direction::from_unit((to_sample * v).normalize());
        DirectionPair::new(local(light), local(sensor))
    }

    /// What takes its pictures; `None` if it reads one pair at a stop.
    pub(super) fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    /// Where light, sensor and sample are in the lab.
    pub(super) fn lab(&self, positions: &Positions) -> Lab {
        let rotations = self.rotations(positions);
        Lab {
            light: mounted(&rotations, self.class.ends.light).z_axis,
            sensor: mounted(&rotations, self.class.ends.sensor).z_axis,
            sample: mounted(&rotations, self.class.ends.sample),
        }
    }

    /// The angle that the pairs of one picture share; `None` if it reads one pair at a stop.
    pub fn stop_angle(&self) -> Option<StopAngle> {
        self.camera.as_ref()?;
        Some(match self.class.is_sphere() {
            true => StopAngle::ThetaD,
            false => StopAngle::ThetaI,
        })
    }

    /// True if a picture covers an axis.
    pub(super) fn is_imaged(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(|axis| axis.imaged)
    }

    /// Positions of the axes that a picture does not cover; 0 of the others.
    pub(super) fn stop(&self, positions: &Positions) -> Positions {
        std::array::from_fn(|i| if self.is_imaged(i) { 0.0 } else { positions[i] })
    }

    /// The first solution within all limits.
    ///
    /// # Errors
    /// If there is none, the reason of the first: the elevation of the light, of the sensor, the
    /// angle between them, the first axis out of its range, the first parts that collide.
    pub fn place(&self, pair: &DirectionPair, turn_freely: bool) -> Result<Positions, Unreachable> {
        if let Some(limits) = &self.limits {
            limits.admit(pair)?;
        }
        let mut found: Option<Result<Positions, Unreachable>> = None;
        (self.class.inverse)(pair, turn_freely, &mut |solution| {
            if matches!(found, Some(Ok(_))) {
                return;
            }
            let admitted = self.admit(&solution);
            if found.is_none() || admitted.is_ok() {
                found = Some(admitted);
            }
        });
        // Every class has a solution for every pair.
        found.unwrap_or(Err(Unreachable::AxisRange(0)))
    }

    /// The solution with its positions in their ranges, or the reason that forbids it.
    fn admit(&self, solution: &Positions) -> Result<Positions, Unreachable> {
        if let Some(camera) = &self.camera {
            camera.sees(&self.lab(solution))?;
        }
        let Some(limits) = &self.limits else {
            return Ok(*solution);
        };
        let mut positions = [0.0; MAX_AXES];
        for (i, axis) in self.axes.iter().enumerate() {
            let position = axis.within_range(solution[i]);
            positions[i] = position.ok_or(Unreachable::AxisRange(i as u8))?;
        }
        if let Some(camera) = &self.camera
            && camera.clearance(camera.pixel(&self.lab(&positions))) <= 0.0
        {
            return Err(Unreachable::SensorElevation);
        }
        if limits.collisions.is_empty() {
            return Ok(positions);
        }
        let rotations = self.rotations(&positions);
        for (i, collision) in limits.collisions.iter().enumerate() {
            let direction = |(axis, vector): Mount| mounted(&rotations, axis) * vector;
            let [a, b] = collision.between.map(direction);
            if angle_between(a, b) < collision.angle_min - SLACK {
                return Err(Unreachable::Collision(i as u8));
            }
        }
        Ok(positions)
    }

    /// The frame of every axis in the lab.
    fn rotations(&self, positions: &Positions) -> [DMat3; MAX_AXES] {
        let mut rotations = [DMat3::IDENTITY; MAX_AXES];
        // Axes are those of the class, as the check has found: parents come before their children.
        for (i, axis) in self.class.axes.iter().enumerate() {
            let own = DMat3::from_axis_angle(axis.vector.into(), positions[i]);
            rotations[i] = mounted(&rotations, axis.parent) * own;
        }
        rotations
    }
}

impl Limits {
    /// Refuses a pair that no solution can save.
    fn admit(&self, pair: &DirectionPair) -> Result<(), Unreachable> {
        if pair.omega_i.theta() > self.theta_i_max + SLACK {
            return Err(Unreachable::LightElevation);
        }
        if pair.omega_o.theta() > self.theta_o_max + SLACK {
            return Err(Unreachable::SensorElevation);
        }
        if pair.separation() < self.separation_min - SLACK {
            return Err(Unreachable::Occluded);
        }
        Ok(())
    }
}

/// The frame of parts mounted on an axis (`None`: the base).
fn mounted(rotations: &[DMat3; MAX_AXES], axis: Option<usize>) -> DMat3 {
    axis.map_or(DMat3::IDENTITY, |axis| rotations[axis])
}
