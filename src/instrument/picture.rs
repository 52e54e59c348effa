//! Pictures: the pixels of one stop read many pairs of directions.
//!
//! *Sphere and camera* (Marschner et al. 2000, Matusik et al. 2003). Far camera along lab z, far light at the angle 2θ_d from it:
//! l = (sin 2θ_d, 0, cos 2θ_d), v = z, h = (sin θ_d, 0, cos θ_d), e = (cos θ_d, 0, −sin θ_d). Where the normal of the sphere is
//!
//! n = cos θ_h h − sin θ_h (cos φ_d e + sin φ_d y)
//!
//! a pixel reads (θ_h, θ_d, φ_d). It is lit and seen where θ_h < 90° and tan θ_h tan θ_d |cos φ_d| < 1. Its place is R (n_x, n_y), so it
//! spans 1/(R cos θ_o) of the normal, and an error of the centre acts alike. Of a camera or a lamp at a finite distance v and l
//! are those of the place on the sphere: θ_d then varies over the picture. That the lamp is fainter where it is farther is taken to
//! be divided out.
//!
//! *Mirror and camera* (Ward 1992, Dana 2001). The place is that of ω_o in a paraboloid of which the sample is the focus,
//! R tan(θ_o/2) (cos φ_o, sin φ_o), in the frame of the sample: it spans 2 cos²(θ_o/2)/R.

use super::spec::{InstrumentSpec, PictureSpec};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::sampling::RandomStream;
use crate::schedule::Unreachable;
use glam::{DMat3, DQuat, DVec2, DVec3};
use smallvec::SmallVec;

/// The largest radius of a patch over its distance from the mirror direction: a peak there is wider than a patch elsewhere.
const CLEAR: f64 = 0.125;

/// Distance from the outline of the sphere within which nothing is read, in standard deviations of the centre.
const OUTLINE: f64 = 3.0;

/// Directions in the lab.
pub(super) struct Lab {
    /// From the sample to the light.
    pub(super) light: DVec3,
    /// From the sample to the sensor.
    pub(super) sensor: DVec3,
    /// From the sample's frame to the lab: tangent, bitangent, normal.
    pub(super) sample: DMat3,
}

/// A camera that reads the pairs of a stop by pixels.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    spec: PictureSpec,
    /// True if it sees a sphere of the material, false if a mirror around a flat sample.
    is_sphere: bool,
    /// Tolerance of the positions of a stop, rad.
    pub(super) same_stop: f64,
}

/// Errors of a picture beside those of the map from pixels to directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exposure {
    /// Angles by which the light is off in two directions, rad.
    pub(super) lamp: [f64; 2],
    /// Ratio of the scale to the right one.
    pub(super) scale: f64,
}

impl Exposure {
    /// Without errors.
    pub(super) const EXACT: Self = Self {
        lamp: [0.0; 2],
        scale: 1.0,
    };
}

impl Camera {
    /// The camera of an instrument; `None` if it takes no pictures.
    pub(super) fn new(spec: &InstrumentSpec) -> Option<Self> {
        let picture = spec.picture.as_ref()?;
        let is_sphere = spec.kinematic_class().is_ok_and(|class| class.is_sphere());
        Some(Self {
            same_stop: picture.same_stop_deg.to_radians(),
            spec: picture.clone(),
            is_sphere,
        })
    }

    /// As [`PictureSpec::is_near`].
    pub(super) fn is_near(&self) -> bool {
        self.spec.is_near()
    }

    /// How far a place is within the outline of the sphere, less what an error of the centre may move it, pixels; without end in a mirror.
    pub(super) fn clearance(&self, at: DVec2) -> f64 {
        if !self.is_sphere {
            return f64::INFINITY;
        }
        let margin = OUTLINE * self.spec.centre_px.hypot(self.spec.map_px);
        self.spec.radius_px - at.length() - margin
    }

    /// Refuses a pose behind the outline of the sphere that a near camera sees, or in the shadow of a near lamp.
    pub(super) fn sees(&self, lab: &Lab) -> Result<(), Unreachable> {
        let n = lab.sample.z_axis;
        let hides = |from: DVec3, radii: f64| radii > 0.0 && n.dot(from) * radii <= 1.0;
        if hides(lab.light, self.spec.lamp_radii) {
            return Err(Unreachable::LightElevation);
        }
        if hides(lab.sensor, self.spec.camera_radii) {
            return Err(Unreachable::SensorElevation);
        }
        Ok(())
    }

    /// The place of the pose that the axes stand at, pixels from the centre.
    pub(super) fn pixel(&self, lab: &Lab) -> DVec2 {
        match self.is_sphere {
            true => self.of_normal(lab.sample.z_axis),
            false => self.of_view(lab.sample.transpose() * lab.sensor),
        }
    }

    /// The place of the mirror direction, pixels.
    fn highlight(&self, lab: &Lab) -> DVec2 {
        if self.is_sphere {
            let mut half = (lab.light + lab.sensor).normalize();
            // Of near ones directions depend on where it is.
            for _ in 0..if self.is_near() { 8 } else { 0 } {
                let light = from(lab.light, self.spec.lamp_radii, half);
                half = (light + from(lab.sensor, self.spec.camera_radii, half)).normalize();
            }
            return self.of_normal(half);
        }
        let light = lab.sample.transpose() * lab.light;
        self.of_view(DVec3::new(-light.x, -light.y, light.z))
    }

    /// The places of a picture that symmetries make equal to one, itself first: its mirror image at the plane of light and view, and on
    /// a sphere that of which the normal is turned half a turn about the half vector, where light and view change places.
    pub(super) fn images(&self, lab: &Lab, at: DVec2, symmetry: Symmetry) -> SmallVec<[DVec2; 4]> {
        let mut images = SmallVec::from_slice(&[at]);
        let mut add = |image: DVec2| {
            // Nearer, they are the same pixels.
            if images
                .iter()
                .all(|other: &DVec2| other.distance(image) > 1.0)
            {
                images.push(image);
            }
        };
        if self.is_sphere {
            let Some(n) = self.normal(at) else {
                return images;
            };
            let across = lab.sensor.cross(lab.light).normalize_or_zero();
            let half = (lab.light + lab.sensor).normalize();
            let mirrored = |n: DVec3| n - across * (2.0 * n.dot(across));
            let swapped = |n: DVec3| half * (2.0 * n.dot(half)) - n;
            let mut seen = |n: DVec3| {
                if n.z > 0.0 {
                    add(self.of_normal(n));
                }
            };
            let is_reciprocal = symmetry.reciprocal && !self.is_near();
            if symmetry.bilateral {
                seen(mirrored(n));
            }
            if is_reciprocal {
                seen(swapped(n));
            }
            if symmetry.bilateral && is_reciprocal {
                seen(swapped(mirrored(n)));
            }
        } else if symmetry.bilateral && symmetry.isotropic {
            let light = (lab.sample.transpose() * lab.light)
                .truncate()
                .normalize_or_zero();
            if light != DVec2::ZERO {
                add(light * (2.0 * at.dot(light)) - at);
            }
        }
        images
    }

    fn of_normal(&self, n: DVec3) -> DVec2 {
        let (radius, camera) = (self.spec.radius_px, self.spec.camera_radii);
        match camera > 0.0 {
            // So that the edge of the sphere is at the radius: there n_z = 1/camera.
            true => n.truncate() * (radius * (camera * camera - 1.0).sqrt() / (camera - n.z)),
            false => n.truncate() * radius,
        }
    }

    fn of_view(&self, view: DVec3) -> DVec2 {
        view.truncate() * (self.spec.radius_px / (1.0 + view.z))
    }

    /// The normal of the sphere at a place; `None` beside it.
    fn normal(&self, at: DVec2) -> Option<DVec3> {
        let (radius, camera) = (self.spec.radius_px, self.spec.camera_radii);
        if camera == 0.0 {
            let p = at / radius;
            let z2 = 1.0 - p.length_squared();
            return (z2 > 0.0).then(|| p.extend(z2.sqrt()));
        }
        // The first point of a ray from the camera on the sphere.
        let edge = camera * camera - 1.0;
        let ray = at / (radius * edge.sqrt());
        let square = ray.length_squared() + 1.0;
        let root = camera * camera - square * edge;
        (root > 0.0).then(|| {
            let t = edge / (camera + root.sqrt());
            (ray * t).extend(camera - t)
        })
    }

    /// The pair at a place, in the frame of the sample there, up to a turn about the normal on a sphere; the light is off by `lamp`,
    /// rad, in two directions. `None` where nothing is seen.
    pub(super) fn pair(&self, lab: &Lab, at: DVec2, lamp: [f64; 2]) -> Option<DirectionPair> {
        let (across, along) = lab.light.any_orthonormal_pair();
        let light = (lab.light + across * lamp[0] + along * lamp[1]).normalize();
        let (frame, light, view) = if self.is_sphere {
            let n = self.normal(at)?;
            let frame = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, n));
            let light = from(light, self.spec.lamp_radii, n);
            (frame, light, from(lab.sensor, self.spec.camera_radii, n))
        } else {
            let p = at / self.spec.radius_px;
            let square = p.length_squared();
            let view = (2.0 * p).extend(1.0 - square) / (1.0 + square);
            (lab.sample, light, lab.sample * view)
        };
        let local = |v: DVec3| Direction::from_unit((frame.transpose() * v).normalize());
        let pair = DirectionPair::new(local(light), local(view));
        pair.is_above_horizon().then_some(pair)
    }

    /// Radius of the disk of pixels that a reading is the mean of: the largest one times the lesser cosine, so that it spans no more of
    /// the normal at grazing; smaller near the mirror direction and the outline; at least half a pixel.
    pub(super) fn patch(&self, lab: &Lab, at: DVec2, pair: &DirectionPair) -> f64 {
        let cosine = pair.omega_i.cos_theta().min(pair.omega_o.cos_theta());
        let clear = CLEAR * at.distance(self.highlight(lab));
        let largest = self.spec.patch_px * cosine;
        largest.min(clear).min(self.clearance(at)).max(0.5)
    }

    /// Numbers that the distortion of one instrument is made of, from normal ones.
    pub(super) fn distortion(&self, mut normal: impl FnMut(u64) -> f64) -> [f64; 6] {
        let sigma = |k| {
            if k < 2 {
                self.spec.centre_px
            } else {
                self.spec.map_px
            }
        };
        std::array::from_fn(|k| sigma(k) * normal(k as u64))
    }

    /// How far a place is from where it is taken to be, pixels.
    pub(super) fn displacement(&self, of: &[f64; 6], at: DVec2) -> DVec2 {
        let p = at / self.spec.radius_px;
        let linear = |x: f64, y: f64| x * p.x + y * p.y;
        DVec2::new(of[0] + linear(of[2], of[3]), of[1] + linear(of[4], of[5]))
    }

    /// The numbers of a distortion by one standard deviation, one after the other.
    pub(super) fn distortions(&self) -> impl Iterator<Item = [f64; 6]> {
        let sigmas = self.distortion(|_| 1.0);
        let one = move |k: usize| std::array::from_fn(|i| if i == k { sigmas[i] } else { 0.0 });
        (0..6).filter(move |&k| sigmas[k] > 0.0).map(one)
    }

    /// Standard deviation of the light in either direction, rad.
    pub(super) fn lamp(&self) -> f64 {
        self.spec.lamp_deg.to_radians()
    }

    /// Relative standard deviation of the scale of a picture.
    pub(super) fn scale(&self) -> f64 {
        self.spec.scale
    }

    /// Errors of one picture.
    pub(super) fn exposure(
        &self,
        stream: &mut RandomStream,
        normal: fn(&mut RandomStream) -> f64,
    ) -> Exposure {
        Exposure {
            lamp: [0; 2].map(|_| self.lamp() * normal(stream)),
            scale: 1.0 + self.scale() * normal(stream),
        }
    }
}

/// The direction from a point of the unit sphere towards what is so many radii from its centre in a direction; 0: far.
fn from(far: DVec3, radii: f64, point: DVec3) -> DVec3 {
    match radii > 0.0 {
        true => (far * radii - point).normalize(),
        false => far,
    }
}

#[cfg(test)]
mod tests;
