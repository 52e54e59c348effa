//! Whether a BRDF that goes into a file reflects more than it receives.

use super::print;
use crate::brdf::{Brdf, laws};
use crate::error::Error;
use crate::geometry::Direction;
use clap::Args;

/// Options of what is written as a table.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct EnergyArgs {
    /// Write the table also if the BRDF reflects more than it receives, seen from 0° or 60°
    #[arg(long)]
    accept_energy: bool,
}

/// Views that are asked, degrees.
const VIEWS_DEG: [f64; 2] = [0.0, 60.0];

/// Azimuths of the views of a BRDF that is not isotropic, degrees; the largest albedo counts.
const AZIMUTHS_DEG: [f64; 8] = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0];

impl EnergyArgs {
    /// Prints the albedo at 0° and 60°; `relative` is its uncertainty beside that of the quadrature
    /// (k = 2).
    ///
    /// # Errors
    /// If it exceeds 1 by more than its uncertainty.
    pub(super) fn check(self, brdf: &dyn Brdf, relative: f64) -> Result<(), Error> {
        let mut texts = Vec::new();
        let mut above = None;
        for degrees in VIEWS_DEG {
            let azimuths = match brdf.symmetry().isotropic {
                true => &AZIMUTHS_DEG[..1],
                false => &AZIMUTHS_DEG,
            };
            let views: Vec<Direction> = azimuths
                .iter()
                .map(|phi: &f64| Direction::from_spherical(degrees.to_radians(), phi.to_radians()))
                .collect();
            let Some(laws::MaxAlbedo { albedo, .. }) = laws::max_albedo(brdf, &views) else {
                continue;
            };
            let value = albedo.max();
            let uncertainty = albedo.error + relative * value;
            let text = format!("{value:.4} ± {uncertainty:.1e} at {degrees}°");
            // A NaN is no albedo.
            if !(value <= 1.0 + uncertainty) {
                above.get_or_insert_with(|| text.clone());
            }
            texts.push(text);
        }
        print(&format!("albedo: {}\n", texts.join(", ")))?;
        match above {
            Some(text) if !self.accept_energy => Err(Error::Violation(format!(
                "the albedo is {text}; allowed: at most 1 within its uncertainty, or --accept-energy; \
                 nothing was written"
            ))),
            _ => Ok(()),
        }
    }
}
