//! Readings of the pixels of a picture.
//!
//! A reading is the mean of patches of pixels, over that of the diffuse tile there: around the place of its pose, and around those that
//! the symmetries of the schedule make equal to it and the same picture holds. There an error of the centre or of the light moves
//! readings the other way, so that it cancels to the first order. A patch is averaged by a rule of degree 5.
//!
//! Type A, what differs from one picture to the next: what the sensor counts, which falls with the number of pixels of the patch,
//! the direction of the light, the scale, and the repeatability of the axes. All pixels of a picture share the last three. Type B,
//! what all pictures share: the distortion of the map from pixels to directions, the tile, the lamp since it was last compared with
//! the tile, offsets and rounding of axes, and the quadrature.

use super::session::{BOUND, Reading, Session, Spread, clipped};
use super::{NOISE, PICTURE, normal};
use crate::brdf::{Brdf, ChannelValues};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::optics::{Optics, Workspace};
use crate::instrument::picture::{Camera, Exposure, Lab};
use crate::sampling::Random;
use crate::schedule::{MAX_AXES, Pose, Positions, Schedule, Visit};
use glam::DVec2;
use std::f64::consts::{FRAC_PI_3, PI};
use std::sync::Arc;

/// Radon's rule of degree 5 on the unit disk: places and weights.
fn disk() -> [(DVec2, f64); 7] {
    let radius = (2.0_f64 / 3.0).sqrt();
    std::array::from_fn(|k| match k {
        0 => (DVec2::ZERO, 0.25),
        _ => (
            radius * DVec2::from_angle(k as f64 * FRAC_PI_3 + 0.5),
            0.125,
        ),
    })
}

/// A place of a picture, pixels, its weight, and the signal of 1 sr⁻¹ there.
#[derive(Clone, Copy)]
struct Place {
    at: DVec2,
    weight: f64,
    tile: f64,
}

/// The sum of the signals ⟨f_r cos θ_i⟩ of places, sr⁻¹, the bound of its error, and the sum of those of 1 sr⁻¹.
struct Seen {
    signal: ChannelValues,
    error: ChannelValues,
    of_one: f64,
    clipped: bool,
}

/// What looks at a material through a camera.
struct Look<'a> {
    camera: &'a Camera,
    optics: &'a Optics,
    brdf: &'a dyn Brdf,
}

impl Look<'_> {
    /// The places of a patch around each of some places, where the tile is seen.
    fn patches(&self, lab: &Lab, around: &[DVec2], radius: f64) -> Vec<Place> {
        let nodes = disk().into_iter().take(if radius > 0.0 { 7 } else { 1 });
        let places = nodes.flat_map(|(node, weight)| {
            let at = around.iter().map(move |&at| at + radius * node);
            at.map(move |at| (at, weight))
        });
        let seen = places.filter_map(|(at, weight)| {
            let pair = self.camera.pair(lab, at, Exposure::EXACT.lamp)?;
            let tile = self.optics.cosine(&pair);
            (tile > 0.0).then_some(Place { at, weight, tile })
        });
        seen.collect()
    }

    /// The sum over places that are `off` where they are taken to be, under a light that is off by `lamp`; `None` where the material has
    /// no data at the first. Where it has none at another that one is left out.
    fn sum(
        &self,
        lab: &Lab,
        places: &[Place],
        off: impl Fn(DVec2) -> DVec2,
        lamp: [f64; 2],
        work: &mut Workspace,
    ) -> Option<Seen> {
        let zero = ChannelValues::from_elem(0.0, self.brdf.channels().count());
        let mut seen = Seen {
            signal: zero.clone(),
            error: zero,
            of_one: 0.0,
            clipped: false,
        };
        for (i, place) in places.iter().enumerate() {
            // Beside the sphere, or in its own shadow, it is dark.
            if let Some(pair) = self.camera.pair(lab, place.at + off(place.at), lamp) {
                match self.optics.average(self.brdf, &pair, work) {
                    None if i == 0 => return None,
                    None => continue,
                    Some(average) => {
                        let factor = place.weight * self.optics.cosine(&pair);
                        for c in 0..seen.signal.len() {
                            seen.signal[c] += factor * average.value[c];
                            seen.error[c] += factor * average.error[c];
                        }
                        seen.clipped |= average.clipped;
                    }
                }
            }
            seen.of_one += place.weight * place.tile;
        }
        (seen.of_one > 0.0).then_some(seen)
    }
}

impl Seen {
    /// The sum over that of 1 sr⁻¹.
    fn values(&self) -> ChannelValues {
        self.signal.iter().map(|s| s / self.of_one).collect()
    }
}

/// No displacement.
fn exact(_: DVec2) -> DVec2 {
    DVec2::ZERO
}

impl Session<'_> {
    /// The schedule with the pairs that its visits read where camera or lamp are so near that directions vary over the picture, on no lattice.
    pub(super) fn as_seen(&self, camera: &Camera, schedule: &Arc<Schedule>) -> Arc<Schedule> {
        if !camera.is_near() {
            return Arc::clone(schedule);
        }
        let form = &schedule.parametrization;
        let mut poses = schedule.poses.clone();
        for visit in &self.itinerary.visits {
            let lab = self.bench.machine.lab(&visit.positions);
            let pair = camera.pair(&lab, camera.pixel(&lab), Exposure::EXACT.lamp);
            if let Some(pair) = pair {
                poses[visit.pose as usize] = Pose {
                    coords: form.forward(&pair),
                    pair,
                };
            }
        }
        Arc::new(Schedule {
            poses,
            lattice: None,
            ..(**schedule).clone()
        })
    }

    /// The reading of a pose in the picture whose first pose has this number; `None` if the material has no data there.
    pub(super) fn read_pixels(
        &self,
        camera: &Camera,
        brdf: &dyn Brdf,
        (pair, symmetry): (&DirectionPair, Symmetry),
        (visit, first): (&Visit, u32),
        random: &Random,
        work: &mut Workspace,
    ) -> Option<Reading> {
        let bench = self.bench;
        let look = Look {
            camera,
            optics: &bench.optics,
            brdf,
        };
        let right = bench.machine.lab(&visit.positions);
        let at = camera.pixel(&right);
        let known = camera.pair(&right, at, Exposure::EXACT.lamp)?;
        let radius = camera.patch(&right, at, &known);
        let mut images = camera.images(&right, at, symmetry);
        images.retain(|image| *image == at || camera.clearance(*image) >= radius);
        let places = look.patches(&right, &images, radius);
        let (exposure, positions) = self.exposed(camera, (visit, first), random);
        let off = |place: DVec2| match &bench.errors {
            Some(errors) => camera.displacement(&errors.distortion, place),
            None => DVec2::ZERO,
        };
        let wrong = bench.machine.lab(&positions);
        let seen = look.sum(&wrong, &places, off, exposure.lamp, work)?;
        let values = seen.values();
        // Of patches that overlap one counts.
        let apart = |image: &&DVec2| image.distance(at) >= 2.0 * radius;
        let patches = 1 + images.iter().filter(apart).count();
        let pixels = (PI * radius * radius).max(1.0) * patches as f64;
        let quadrature = |c: usize| seen.error[c] / (BOUND * seen.of_one);
        let Some(errors) = &bench.errors else {
            return Some(Reading {
                type_a: ChannelValues::from_elem(0.0, values.len()),
                type_b: (0..values.len()).map(quadrature).collect(),
                value: values,
                flags: clipped(seen.clipped),
            });
        };
        let hours = visit.since_calibration_seconds / 3600.0;
        let gain = (1.0 + errors.drift * hours) / errors.tile * exposure.scale;
        let drift = bench.spec.source.drift_per_hour * hours;
        let relative = bench.spec.calibration.uncertainty.powi(2) + drift * drift;
        let shared = |c: usize, value: f64| value * value * relative + quadrature(c).powi(2);
        let rough = Look {
            optics: &errors.rough,
            ..look
        };
        let mut positioning = self.moved(&rough, &images, (pair, symmetry), visit, work);
        for (variance, value) in positioning[0].iter_mut().zip(&values) {
            *variance += (camera.scale() * value).powi(2);
        }
        // What the sensor counts is that of a mean pixel.
        let tile = seen.of_one / places.iter().map(|place| place.weight).sum::<f64>();
        let light = values.iter().map(|value| value * tile * gain);
        let mut noise = random.stream(NOISE + u64::from(visit.pose));
        let mut reading = Reading::sensed(
            &errors.detector,
            light,
            (tile, pixels),
            shared,
            &positioning,
            &mut noise,
        );
        reading.flags = reading.flags.with(clipped(seen.clipped));
        Some(reading)
    }

    /// What is wrong with the picture of a visit, and where the axes stand.
    fn exposed(
        &self,
        camera: &Camera,
        (visit, first): (&Visit, u32),
        random: &Random,
    ) -> (Exposure, Positions) {
        let Some(errors) = &self.bench.errors else {
            return (Exposure::EXACT, visit.positions);
        };
        let mut stream = random.stream(PICTURE + u64::from(first));
        let exposure = camera.exposure(&mut stream, normal);
        let positions = errors.stand(&self.bench.machine, &visit.positions, &mut stream);
        (exposure, positions)
    }

    /// Variances of type A and of type B that wrong places and directions cause, by central differences to the second order as of
    /// other instruments.
    fn moved(
        &self,
        look: &Look<'_>,
        images: &[DVec2],
        (pair, symmetry): (&DirectionPair, Symmetry),
        visit: &Visit,
        work: &mut Workspace,
    ) -> [ChannelValues; 2] {
        let (machine, camera) = (&self.bench.machine, look.camera);
        let right = machine.lab(&visit.positions);
        let places = look.patches(&right, images, 0.0);
        let Some(centre) = look.sum(&right, &places, exact, [0.0; 2], work) else {
            let zero = ChannelValues::from_elem(0.0, look.brdf.channels().count());
            return [zero.clone(), zero];
        };
        let mut spread = Spread::around(centre.values());
        let values = |seen: Option<Seen>| Some(seen?.values());
        for distortion in camera.distortions() {
            let ends = [1.0, -1.0].map(|sign| {
                let off = |place: DVec2| sign * camera.displacement(&distortion, place);
                values(look.sum(&right, &places, off, [0.0; 2], work))
            });
            spread.add(0.0, ends);
        }
        let lamp = camera.lamp();
        for direction in [[lamp, 0.0], [0.0, lamp]]
            .into_iter()
            .filter(|_| lamp > 0.0)
        {
            let ends = [1.0, -1.0].map(|sign| {
                let lamp = direction.map(|angle| sign * angle);
                values(look.sum(&right, &places, exact, lamp, work))
            });
            spread.add(1.0, ends);
        }
        // A pose that shares the stop of another is read a little beside where it was asked for.
        let own = machine.place(pair, symmetry.isotropic).ok();
        let beside = own.map(|own| machine.stop(&own)).map_or(0.0, |own| {
            let stop = machine.stop(&visit.positions);
            let off = own.iter().zip(&stop).map(|(a, b)| (a - b).abs());
            off.fold(0.0, f64::max).min(camera.same_stop)
        });
        let beside = if camera.is_near() { 0.0 } else { beside };
        for i in (0..MAX_AXES.min(machine.axes().len())).filter(|&i| !machine.is_imaged(i)) {
            let axis = &machine.axes()[i];
            let scatter = axis.repeatability.powi(2);
            let shared = axis.bias.powi(2) + axis.resolution.powi(2) / 12.0 + beside * beside;
            let sigma = (scatter + shared).sqrt();
            if sigma == 0.0 {
                continue;
            }
            let ends = [sigma, -sigma].map(|by| {
                let mut positions = visit.positions;
                positions[i] += by;
                values(look.sum(&machine.lab(&positions), &places, exact, [0.0; 2], work))
            });
            spread.add(scatter / (sigma * sigma), ends);
        }
        spread.variances()
    }
}
