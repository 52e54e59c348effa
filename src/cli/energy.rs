//! Whether a BRDF that goes into a file reflects more than it receives.

use super::{listed, print, say};
use crate::brdf::{Brdf, Presence, laws, of_wrapped};
use crate::error::Error;
use crate::geometry::{Direction, DirectionPair};
use crate::measurement::Measurement;
use crate::reconstruct::Predictive;
use crate::sampling::{Random, cosine_hemisphere};
use crate::schedule::Quantity;
use clap::Args;
use glam::DVec3;
use rayon::prelude::*;

/// Options of what is written as a table.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct EnergyArgs {
    /// Write the table also if the BRDF reflects more than it receives, lit from 0° or 60°
    #[arg(long)]
    accept_energy: bool,
}

/// Elevations of the light that are printed and must not gain energy, degrees.
const JUDGED_DEG: [f64; 2] = [0.0, 60.0];

/// Elevations whose gains are a warning and no error, degrees: there few instruments have readings, and
/// measured tables gain.
const GRAZING_DEG: [f64; 2] = [75.0, 85.0];

/// Azimuths of the lights of a BRDF that is not isotropic, degrees; the largest albedo counts. The first three are the others mirrored.
const AZIMUTHS_DEG: [f64; 8] = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0];

/// Largest relative uncertainty that excuses an albedo: one of 100 % would excuse every one.
const EXCUSE: f64 = 0.5;

/// Albedos from here on are printed with an exponent.
const ABSURD: f64 = 1e3;

/// A BRDF with light and sensor exchanged: what is seen from a direction is what is reflected of light from there.
struct Exchanged<'a>(&'a dyn Brdf);

impl Brdf for Exchanged<'_> {
    of_wrapped!(0);

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        self.0.eval(&pair.swapped(), out)
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let swapped: Vec<DirectionPair> = pairs.iter().map(DirectionPair::swapped).collect();
        self.0.eval_batch(&swapped, out, presence);
    }
}

/// What is known of the readings that a BRDF was made of.
pub(super) struct Known<'a> {
    pub(super) measurement: &'a Measurement,
    pub(super) predictive: Option<&'a dyn Predictive>,
}

impl Known<'_> {
    /// The relative uncertainty (k = 2) of the albedo of light from a direction, if all errors of the BRDF have one sign.
    fn uncertainty(&self, light: Direction) -> f64 {
        let random = Random::new(0);
        let pair = |i| DirectionPair::new(light, cosine_hemisphere(random.point(i)));
        let pairs: Vec<DirectionPair> = (0..SEEN).map(pair).collect();
        let [mut error, mut all] = [0.0; 2];
        let predicted = self.predictive.map(|known| known.predict(&pairs));
        for known in predicted.unwrap_or_default() {
            let f = known.mean.exp();
            error += f * known.variance.sqrt();
            all += f;
        }
        let own = if all > 0.0 { 2.0 * (error / all) } else { 0.0 };
        own.max(common_uncertainty(self.measurement))
    }

    /// True if there is a reading with light near this elevation, degrees, or with the sensor there, of a reciprocal material.
    fn is_lit(&self, degrees: f64) -> bool {
        let schedule = &self.measurement.schedule;
        let reciprocal = schedule.parametrization.symmetry().reciprocal;
        let near = |d: Direction| (d.theta().to_degrees() - degrees).abs() <= SAME_LIGHT;
        let mut poses = schedule.poses.iter().enumerate();
        poses.any(|(i, pose)| {
            let is_near = near(pose.pair.omega_i) || reciprocal && near(pose.pair.omega_o);
            is_near && self.measurement.value(i).is_some()
        })
    }
}

/// What all readings share (type B, k = 2), as a share of their mean.
fn common_uncertainty(measurement: &Measurement) -> f64 {
    let n = measurement.channels.count();
    let Some(details) = &measurement.details else {
        return 0.0;
    };
    let (mut uncertainty, mut value) = (0.0, 0.0);
    for (i, own) in details.type_b.chunks(n).enumerate() {
        if let Some(values) = measurement.value(i) {
            value += values.iter().sum::<f64>();
            uncertainty += own.iter().sum::<f64>();
        }
    }
    if value > 0.0 {
        2.0 * uncertainty / value
    } else {
        0.0
    }
}

/// Directions that an uncertainty of an albedo is made of.
const SEEN: u64 = 512;

/// Rings of equal weight, each of half as many directions, in which holes are looked for.
const RINGS: usize = 64;

/// Elevations of a light that are one, degrees.
const SAME_LIGHT: f64 = 10.0;

/// What one channel reflects of a light to where there is no data, if each direction there has the value of the nearest with data, as a
/// share of what is known.
fn filling(brdf: &dyn Brdf, light: Direction, channel: usize) -> f64 {
    let mut values = vec![0.0; brdf.channels().count()];
    let (mut known, mut holes) = (Vec::new(), Vec::new());
    let middles = |n: usize| (0..n).map(move |k| (k as f64 + 0.5) / n as f64);
    for [u, v] in middles(RINGS).flat_map(|u| middles(RINGS / 2).map(move |v| [u, v])) {
        let sensor = cosine_hemisphere([u, v]);
        match brdf.eval(&DirectionPair::new(light, sensor), &mut values) {
            Presence::Present => known.push((sensor.vector(), values[channel])),
            Presence::Missing => holes.push(sensor.vector()),
        }
    }
    let nearest = |hole: &DVec3| {
        let towards = |(sensor, _): &(DVec3, f64)| sensor.dot(*hole);
        let nearest = known.iter();
        let nearest = nearest.max_by(|a, b| towards(a).total_cmp(&towards(b)));
        nearest.map_or(0.0, |(_, value)| *value)
    };
    let all: f64 = known.iter().map(|(_, value)| value).sum();
    let filled: f64 = holes.iter().map(nearest).sum();
    if all > 0.0 { filled / all } else { 0.0 }
}

/// The largest albedo of a light over its azimuths.
#[derive(Clone)]
struct Albedo {
    degrees: f64,
    value: f64,
    /// The channel that it is of, of several.
    channel: Option<String>,
    /// That of the quadrature, three standard errors of random paths, and that of the readings as far as it counts.
    uncertainty: f64,
    /// Share of the hemisphere, by its cosine, without data; that counts as 0 in the value.
    missing: f64,
    /// The albedo where each direction without data has the value of the nearest that has some.
    filled: f64,
}

impl Albedo {
    /// Of light from an elevation (degrees) at one azimuth (rad).
    fn new(brdf: &dyn Brdf, degrees: f64, azimuth: f64, known: Option<&Known<'_>>) -> Self {
        let light = Direction::from_spherical(degrees.to_radians(), azimuth);
        // Random paths are those of a reciprocal surface.
        let (albedo, noise) = match brdf.as_split() {
            Some(_) => laws::noisy_albedo(brdf, light),
            None => laws::noisy_albedo(&Exchanged(brdf), light),
        };
        let value = albedo.max();
        let channel = albedo.value.iter().position(|v| *v == value).unwrap_or(0);
        let relative = known.map_or(0.0, |known| known.uncertainty(light));
        Self {
            degrees,
            value,
            channel: brdf.channels().name(channel),
            uncertainty: albedo.error + 3.0 * noise + relative.min(EXCUSE) * value,
            missing: albedo.missing,
            filled: match albedo.missing > HOLES {
                true => value * (1.0 + filling(brdf, light, channel)),
                false => value,
            },
        }
    }

    /// True if it exceeds 1 by more than its uncertainty; a NaN is no albedo.
    fn gains(&self) -> bool {
        !(self.value <= 1.0 + self.uncertainty)
    }
}

impl std::fmt::Display for Albedo {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.value {
            value if value < ABSURD => write!(f, "{value:.4}")?,
            value => write!(f, "{value:.4e}")?,
        }
        write!(f, " ± {:.1e} at {}°", self.uncertainty, self.degrees)?;
        if let Some(channel) = &self.channel {
            write!(f, " ({channel})")?;
        }
        if self.missing > HOLES {
            let (share, filled) = (100.0 * (1.0 - self.missing), self.filled);
            write!(f, " from {share:.0} % of the hemisphere, ")?;
            write!(f, "{filled:.4} if the rest is as what is nearest to it")?;
        }
        Ok(())
    }
}

/// Share of the hemisphere without data from which on it is printed.
const HOLES: f64 = 1e-3;

/// The albedos of lights from some elevations (degrees), the azimuths of all of them at a time.
fn albedos(brdf: &dyn Brdf, lights: &[f64], known: Option<&Known<'_>>) -> Vec<Albedo> {
    let azimuths = match brdf.symmetry() {
        symmetry if symmetry.isotropic => &AZIMUTHS_DEG[..1],
        symmetry if symmetry.bilateral => &AZIMUTHS_DEG[..3],
        _ => &AZIMUTHS_DEG,
    };
    let lit = |&degrees: &f64| azimuths.iter().map(move |phi| (degrees, phi.to_radians()));
    let lit: Vec<(f64, f64)> = lights.iter().flat_map(lit).collect();
    let albedo = |(degrees, phi)| Albedo::new(brdf, degrees, phi, known);
    let found: Vec<Albedo> = lit.into_par_iter().map(albedo).collect();
    let of_lights = found.chunks(azimuths.len());
    let largest = |all: &[Albedo]| {
        all.iter()
            .max_by(|a, b| a.value.total_cmp(&b.value))
            .cloned()
    };
    of_lights.filter_map(largest).collect()
}

/// What readings may be whose albedos are above 1 as those of f_r: the quantity of which they are possible, and its key.
fn other_quantity(albedos: &[Albedo]) -> String {
    let most = albedos.iter().map(|a| a.value).fold(0.0, f64::max);
    let pair = DirectionPair::from_spherical(0.0, 0.0, 0.0, 0.0);
    let albedo = |quantity: Quantity| most / quantity.of_one(&pair);
    let mut others = [Quantity::ReflectanceFactor, Quantity::Percent].into_iter();
    // The least factor that makes them possible, and not far less.
    let possible = others.find(|quantity| (0.01..=1.0).contains(&albedo(*quantity)));
    let mut all = Quantity::ALL.iter();
    let Some(choice) = all.find(|choice| Some(choice.value) == possible) else {
        return String::new();
    };
    let (name, meaning, albedo) = (choice.name, choice.meaning, albedo(choice.value));
    format!("; if the readings are {name} ({meaning}), it is {albedo:.3}: --quantity {name}")
}

impl EnergyArgs {
    /// Prints what is reflected of light from 0° and 60°, and warns of more than all at 75° or 85°; of readings, what is `known`.
    /// An error if one that is printed exceeds 1 by more than its uncertainty, of which at most half of the albedo counts.
    pub(super) fn check(self, brdf: &dyn Brdf, known: Option<&Known<'_>>) -> Result<(), Error> {
        let is_lit = |degrees: &f64| known.is_none_or(|known| known.is_lit(*degrees));
        let judged: Vec<f64> = JUDGED_DEG.into_iter().filter(is_lit).collect();
        let grazing: Vec<f64> = GRAZING_DEG.into_iter().filter(is_lit).collect();
        let all = albedos(brdf, &[&judged[..], &grazing].concat(), known);
        let (judged, grazing) = all.split_at(judged.len());
        let texts = JUDGED_DEG.map(|degrees| {
            match judged.iter().find(|albedo| albedo.degrees == degrees) {
                Some(albedo) => albedo.to_string(),
                None => format!("none at {degrees}°, where no light was read"),
            }
        });
        print(&format!("albedo: {}\n", listed(texts)))?;
        let normal = Direction::from_spherical(0.0, 0.0);
        let relative = known.map_or(0.0, |known| known.uncertainty(normal));
        if relative > EXCUSE {
            let [found, taken] = [relative, EXCUSE].map(|share| 100.0 * share);
            say(&format!(
                "gonio: the readings leave an uncertainty of {found:.0} % (k = 2), too much to judge energy by: {taken:.0} % are taken"
            ));
        }
        if let Some(albedo) = judged.iter().find(|albedo| albedo.gains())
            && !self.accept_energy
        {
            let other = known.map(|_| other_quantity(judged)).unwrap_or_default();
            return Err(Error::Violation(format!(
                "the albedo is {albedo}; allowed: at most 1 within its uncertainty, or \
                 --accept-energy; nothing was written{other}"
            )));
        }
        let grazing = listed(grazing.iter().filter(|albedo| albedo.gains()));
        if !grazing.is_empty() {
            say(&format!(
                "gonio: the albedo is above 1 of grazing light: {grazing}"
            ));
        }
        Ok(())
    }
}
