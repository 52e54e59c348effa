//! Whether a BRDF that goes into a file reflects more than it receives.

use super::print;
use super::talk::say;
use crate::brdf::{Brdf, laws};
use crate::error::Error;
use crate::geometry::Direction;
use clap::Args;
use rayon::prelude::*;

/// Options of what is written as a table.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct EnergyArgs {
    /// Write the table also if the BRDF reflects more than it receives, seen from 0° or 60°
    #[arg(long)]
    accept_energy: bool,
}

/// Views that are printed and must not gain energy, degrees.
const JUDGED_DEG: [f64; 2] = [0.0, 60.0];

/// Views of whose gains only a warning tells, degrees: there few instruments have readings, and
/// measured tables gain.
const GRAZING_DEG: [f64; 2] = [75.0, 85.0];

/// Azimuths of the views of a BRDF that is not isotropic, degrees; the largest albedo counts. The first three are the others mirrored.
const AZIMUTHS_DEG: [f64; 8] = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0];

/// Largest relative uncertainty that excuses an albedo: one of 100 % would excuse every one.
const EXCUSE: f64 = 0.5;

/// Albedos from here on are printed with an exponent.
const ABSURD: f64 = 1e3;

/// The largest albedo of a view over its azimuths.
#[derive(Clone, Copy)]
struct Albedo {
    degrees: f64,
    value: f64,
    /// That of the quadrature, three standard errors of random paths, and what the readings share (k = 2) as far as it counts.
    uncertainty: f64,
}

impl Albedo {
    /// Seen from an elevation (degrees) at one azimuth (rad).
    fn new(brdf: &dyn Brdf, degrees: f64, azimuth: f64, relative: f64) -> Self {
        let view = Direction::from_spherical(degrees.to_radians(), azimuth);
        let (albedo, noise) = laws::noisy_albedo(brdf, view);
        let value = albedo.max();
        Self {
            degrees,
            value,
            uncertainty: albedo.error + 3.0 * noise + relative.min(EXCUSE) * value,
        }
    }

    /// True if it exceeds 1 by more than its uncertainty; a NaN is no albedo.
    fn gains(&self) -> bool {
        !(self.value <= 1.0 + self.uncertainty)
    }
}

impl std::fmt::Display for Albedo {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self {
            degrees,
            value,
            uncertainty,
        } = self;
        if *value < ABSURD {
            write!(f, "{value:.4} ± {uncertainty:.1e} at {degrees}°")
        } else {
            write!(f, "{value:.4e} ± {uncertainty:.1e} at {degrees}°")
        }
    }
}

/// The albedos of some views (degrees), the azimuths of all of them at a time.
fn albedos(brdf: &dyn Brdf, views: &[f64], relative: f64) -> Vec<Albedo> {
    let azimuths = match brdf.symmetry() {
        symmetry if symmetry.isotropic => &AZIMUTHS_DEG[..1],
        symmetry if symmetry.bilateral => &AZIMUTHS_DEG[..3],
        _ => &AZIMUTHS_DEG,
    };
    let seen = |&degrees: &f64| azimuths.iter().map(move |phi| (degrees, phi.to_radians()));
    let seen: Vec<(f64, f64)> = views.iter().flat_map(seen).collect();
    let found: Vec<Albedo> = seen
        .into_par_iter()
        .map(|(degrees, phi)| Albedo::new(brdf, degrees, phi, relative))
        .collect();
    let of_views = found.chunks(azimuths.len());
    let largest = |all: &[Albedo]| {
        let all = all.iter().copied();
        all.max_by(|a, b| a.value.total_cmp(&b.value))
    };
    of_views.filter_map(largest).collect()
}

impl EnergyArgs {
    /// Prints the albedo at 0° and 60°, and warns of one above 1 at 75° or 85°; `relative` is its
    /// uncertainty beside that of the quadrature (k = 2).
    ///
    /// # Errors
    /// If one that is printed exceeds 1 by more than its uncertainty, of which at most half of the
    /// albedo counts.
    pub(super) fn check(self, brdf: &dyn Brdf, relative: f64) -> Result<(), Error> {
        let all = albedos(brdf, &[JUDGED_DEG, GRAZING_DEG].concat(), relative);
        let (judged, grazing) = all.split_at(JUDGED_DEG.len());
        let texts: Vec<String> = judged.iter().map(Albedo::to_string).collect();
        print(&format!("albedo: {}\n", texts.join(", ")))?;
        if relative > EXCUSE {
            say(&format!(
                "gonio: the readings share an uncertainty of {:.0} % of their mean (k = 2), too much \
                 to judge energy by: {:.0} % are taken",
                100.0 * relative,
                100.0 * EXCUSE
            ));
        }
        match judged.iter().find(|albedo| albedo.gains()) {
            Some(albedo) if !self.accept_energy => Err(Error::Violation(format!(
                "the albedo is {albedo}; allowed: at most 1 within its uncertainty, or \
                 --accept-energy; nothing was written"
            ))),
            _ => {
                let gains: Vec<String> = grazing
                    .iter()
                    .filter(|albedo| albedo.gains())
                    .map(Albedo::to_string)
                    .collect();
                if !gains.is_empty() {
                    say(&format!(
                        "gonio: the albedo is above 1 at grazing views: {}",
                        gains.join(", ")
                    ));
                }
                Ok(())
            }
        }
    }
}
