//! A peak that is where the light is: of a retro-reflector, or of azimuths that are counted from
//! elsewhere.

use super::Measurement;
use crate::geometry::angle_between;
use crate::numeric::correlate;
use glam::DVec3;
use std::fmt;
use std::ops::Range;

/// Readings this close to a direction are near it, degrees.
const NEAR: f64 = 10.0;

/// Readings further away, up to this, are around it, degrees.
const AROUND: f64 = 20.0;

/// Elevations of the light (degrees) that are looked at: below, both directions are too close together;
/// above, matte materials of rough facets send back several times what they mirror.
const TELLING: [f64; 2] = [20.0, 60.5];

/// Cosine of the angle up to which azimuths of the light are one: 2.6°.
const SAME_AZIMUTH: f64 = 0.999;

/// Readings that a mean needs.
const ENOUGH: usize = 3;

/// How much higher readings are towards the light than towards its mirror direction, at least.
const HIGHER: f64 = 3.0;

/// How much higher readings are towards the light, at least, over all readings within 20°, of a rough lobe; no right model of the registry has both this and the correlation.
const ROUGH: f64 = 1.5;

/// Rank correlation of readings with the cosine of the half vector of the turned light, at least, where they are a lobe about it.
const LOBE: f64 = 0.5;

/// How much higher readings near a direction are than around it where there is a peak, at least.
const PEAK: f64 = 1.1;

/// Means of readings, sr⁻¹, that have their only peak at the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RetroPeak {
    /// Within 10° or 20° of the light.
    pub retro: f64,
    /// Within as much of its mirror direction, or within 20° if there is none so near.
    pub mirror: f64,
    /// Within how much of the light, degrees.
    of_light: f64,
    /// Within how much of the mirror direction, degrees.
    within: f64,
    /// True if the light's azimuth varies: the peak follows it.
    turns: bool,
}

impl fmt::Display for RetroPeak {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (from, option) = match self.turns {
            false => ("azimuths count from the mirror direction", "mirror"),
            true => (
                "the light's azimuths are those in which it travels",
                "propagation",
            ),
        };
        write!(
            f,
            "readings within {}° of the light have a mean of {:.3e} 1/sr, those within {}° of \
             its mirror direction one of {:.3e} 1/sr: if the sample is no retro-reflector, {from}, \
             which --azimuth {option} takes into account (--azimuth sample, if they are right)",
            self.of_light, self.retro, self.within, self.mirror
        )
    }
}

/// Sums and numbers of readings near a direction, and around it: nearer to the normal than the light, and further away.
#[derive(Default)]
struct Place {
    sums: [f64; 3],
    counts: [usize; 3],
}

impl Place {
    fn add(&mut self, degrees: f64, is_further: bool, value: f64) {
        let part = match degrees {
            degrees if degrees <= NEAR => 0,
            degrees if degrees <= AROUND => 1 + usize::from(is_further),
            _ => return,
        };
        self.sums[part] += value;
        self.counts[part] += 1;
    }

    /// The mean of some parts, of enough readings.
    fn mean(&self, parts: Range<usize>) -> Option<f64> {
        let count: usize = self.counts[parts.clone()].iter().sum();
        (count >= ENOUGH).then(|| self.sums[parts].iter().sum::<f64>() / count as f64)
    }

    /// The mean near the direction, and whether it is a peak: readings that only grow towards the
    /// horizon have none.
    fn peak(&self) -> Option<(f64, bool)> {
        let near = self.mean(0..1)?;
        Some((near, near > 0.0 && near >= PEAK * self.around()?))
    }

    /// The larger mean around the direction, of both sides or of the one that was read.
    fn around(&self) -> Option<f64> {
        let sides = [1..2, 2..3].into_iter();
        sides.filter_map(|side| self.mean(side)).reduce(f64::max)
    }
}

/// The peak at the light. Lights count between 20° and 60° from the normal. Readings near the light
/// (within 10°) are on average at least three times those near its mirror direction, and there is
/// a peak at the light and none at the mirror direction. A peak is 1.1 times the mean of the readings
/// around it (10° to 20°) that are nearer to the normal, and of those that are further away. Where no reading
/// is near the mirror direction, those around it stand for it.
///
/// A rough lobe has no such peak: then readings within 20° of the light are on average at least 1.5 times those within 20° of its
/// mirror direction, where there is no peak, and rise with the cosine of the half vector of the light turned by 180°: a rank correlation above .5.
pub fn retro_peak(measurement: &Measurement) -> Option<RetroPeak> {
    let (mut at_light, mut at_mirror) = (Place::default(), Place::default());
    let (mut first, mut turns) = (None, false);
    let (mut values, mut cosines) = (Vec::new(), Vec::new());
    let telling = TELLING[0]..=TELLING[1];
    for (i, pose) in measurement.schedule.poses.iter().enumerate() {
        let (light, sensor) = (pose.pair.omega_i, pose.pair.omega_o);
        let Some(reading) = measurement.value(i) else {
            continue;
        };
        if !telling.contains(&light.theta().to_degrees()) {
            continue;
        }
        let value = measurement.channels.luminance(reading);
        let azimuth = light.vector().truncate().normalize_or_zero();
        turns |= first.get_or_insert(azimuth).dot(azimuth) < SAME_AZIMUTH;
        let mirrored = light.vector() * DVec3::new(-1.0, -1.0, 1.0);
        let off = |v: DVec3| angle_between(sensor.vector(), v).to_degrees();
        let is_further = sensor.cos_theta() < light.cos_theta();
        at_light.add(off(light.vector()), is_further, value);
        at_mirror.add(off(mirrored), is_further, value);
        values.push(Some(value));
        cosines.push(Some((mirrored + sensor.vector()).normalize_or_zero().z));
    }
    // No arm reads at the light: a gap opposite a peak is the place of the light.
    let is_gap = at_mirror.counts[0] == 0;
    let lobe = match is_gap {
        false => at_mirror.peak(),
        true => at_mirror.around().map(|mean| (mean, false)),
    };
    let sharp = at_light.peak().zip(lobe);
    let sharp = sharp.filter(|((retro, is_peak), (mirror, is_mirror))| {
        *is_peak && !is_mirror && *retro >= HIGHER * mirror
    });
    // A rough lobe has no peak so near, but all is higher on its side.
    let rough = at_light.mean(0..3).zip(at_mirror.mean(0..3));
    let is_lobe = matches!(lobe, Some((_, true)));
    let rough = rough.filter(|(retro, mirror)| !is_lobe && *retro >= ROUGH * mirror);
    // That of sheen, which grows away from the half vector, is none: there is no lobe about the half vector of the turned light.
    let rough = rough.filter(|_| correlate(&values, &cosines).spearman > Some(LOBE));
    let (retro, mirror, within) = match (sharp, rough) {
        (Some(((retro, _), (mirror, _))), _) => (retro, mirror, if is_gap { AROUND } else { NEAR }),
        (None, Some((retro, mirror))) => (retro, mirror, AROUND),
        (None, None) => return None,
    };
    Some(RetroPeak {
        retro,
        mirror,
        of_light: if sharp.is_some() { NEAR } else { AROUND },
        within,
        turns,
    })
}
