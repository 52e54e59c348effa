//! Coordinates that a truth favours, so that no comparison of parametrizations hides its bias.

use crate::registry::named;
use serde::{Deserialize, Serialize};

named! {
    /// The coordinates that a BRDF favours by its formula or by how it was tabulated; the summary is one sentence about the
    /// bias, for a report.
    ///
    /// A lobe that is a function of one coordinate needs fewer nodes in coordinates that have it as an axis. Terms that all models of
    /// a kind share (Fresnel, shadowing, cosines) vary slowly and are left out of account.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Favours {
        /// A distribution of theta_h (and phi_h): an axis of half/difference coordinates.
        HalfAngle = "theta_h":
            "What varies most is a function of theta_h, or keeps its width as one does, an axis of half-difference coordinates: \
             it favours them.",
        /// A distribution of |h_bar|: an axis of orthographic and hybrid coordinates (and of Stark's, squared).
        ProjectedHalf = "h_bar":
            "What varies most is a function of |h_bar|, or changes its width as one does, an axis of hybrid, orthographic and \
             Stark's coordinates: it favours them.",
        /// None: no dominant factor is constant along the axes of one parametrization.
        Neither = "neither":
            "What varies most is no function of theta_h or of |h_bar| alone: \
             no parametrization is favoured by construction.",
        /// A table over half/difference coordinates, denser at small theta_h.
        HalfDifferenceTable = "half-difference table":
            "The table was sampled in half-difference coordinates with a square root in theta_h: \
             it favours a grid in the same coordinates with the same warp.",
        /// Measured: the width of the lobe changes neither as over theta_h nor as over |h_bar|, or it is not known which.
        Between = "between":
            "The interval of the alignment q of the lobe holds one half: it is as far from a function of theta_h as of |h_bar|.",
        /// A table over half/difference coordinates of a lobe over theta_h.
        HalfAngleTable = "theta_h table":
            "The lobe is one over theta_h, and the table was sampled in half-difference coordinates with a square root in \
             theta_h: it favours these coordinates, most of all a grid with the same warp.",
        /// A table over half/difference coordinates of a lobe over |h_bar|.
        ProjectedHalfTable = "h_bar table":
            "The lobe is one over |h_bar|, which favours hybrid, orthographic and Stark's coordinates; but the table was \
             sampled in half-difference coordinates with a square root in theta_h, which favours a grid in these.",
        /// A table over half/difference coordinates of a lobe between both.
        BetweenTable = "between table":
            "The lobe is as far from a function of theta_h as of |h_bar|, but the table was sampled in half-difference \
             coordinates with a square root in theta_h, which favours a grid in these.",
        /// A table over spherical coordinates.
        SphericalTable = "spherical table":
            "The table was sampled in spherical coordinates: \
             it favours a grid in the same coordinates.",
        /// A reconstruction of readings.
        Reconstruction = "reconstruction":
            "It is a reconstruction of readings: \
             it favours the coordinates that these were interpolated in.",
    }
}

impl Favours {
    /// What it favours by the alignment q of its lobe and the standard error of q: the class that the interval of two standard
    /// errors lies in. Where what a table is sampled in, or a reconstruction interpolated in, is all that matters, that stays.
    #[must_use]
    pub fn measured(self, q: f64, standard_error: f64) -> Self {
        let is_over = |sign: f64| sign * (q - 0.5) > 2.0 * standard_error;
        let lobe = match () {
            () if is_over(-1.0) => [Favours::HalfAngle, Favours::HalfAngleTable],
            () if is_over(1.0) => [Favours::ProjectedHalf, Favours::ProjectedHalfTable],
            () => [Favours::Between, Favours::BetweenTable],
        };
        match self {
            Favours::SphericalTable | Favours::Reconstruction => self,
            Favours::HalfDifferenceTable => lobe[1],
            _ => lobe[0],
        }
    }

    /// True if a comparison of parametrizations on such truths says as much about them.
    pub fn is_biased(self) -> bool {
        !matches!(self, Favours::Neither | Favours::Between)
    }
}
