//! Whether a BRDF that goes into a file reflects more than it receives.

use super::print;
use crate::brdf::{Brdf, laws};
use crate::error::Error;
use crate::geometry::Direction;
use clap::Args;

/// Options of what is written as a table.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct EnergyArgs {
    /// Write the table also if the BRDF reflects more than it receives
    #[arg(long)]
    accept_energy: bool,
}

/// Views that are asked, degrees.
const VIEWS_DEG: [f64; 2] = [0.0, 60.0];

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
            let view = Direction::from_spherical(degrees.to_radians(), 0.0);
            let albedo = laws::directional_albedo(brdf, view);
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
